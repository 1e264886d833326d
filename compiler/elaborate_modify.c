// Modifiers: affine maps of objects, quadrics and perturbations, paint, names, showing.
#include <assert.h>
#include <string.h>

#include "compiler/evaluator.h"

static void vector_ids(Eval *e, const Value *vector, IrId ids[3])
{
    for (int k = 0; k < 3; k++) ids[k] = scalar_id(e, vector->vector[k]);
}

static bool is_zero(Scalar s)
{
    return !s.id && s.number == 0;
}

static IrId map_move(Eval *e, const Node *node, const Value *args)
{
    IrId by[3];
    for (int k = 0; k < 3; k++) by[k] = scalar_id(e, args[1 + k].scalar);
    return ir_move(e->ir, span_of(e, node), by);
}

static IrId map_move_by(Eval *e, const Node *node, const Value *args)
{
    IrId by[3];
    vector_ids(e, &args[1], by);
    return ir_move(e->ir, span_of(e, node), by);
}

static IrId map_rotate(Eval *e, const Node *node, const Value *args)
{
    IrId angles[3], about[3];
    for (int k = 0; k < 3; k++) angles[k] = scalar_id(e, args[1 + k].scalar);
    vector_ids(e, &args[4], about);
    return ir_rotate_xyz(e->ir, span_of(e, node), angles, about);
}

static IrId map_rotate_axis(Eval *e, const Node *node, const Call *call, const Value *args)
{
    if (is_zero(args[1].vector[0]) && is_zero(args[1].vector[1]) && is_zero(args[1].vector[2])) {
        complain(e, bound_node(call, 1, node), DIAG_OUT_OF_RANGE, "an axis has a direction: write (0, 0, 1)");
        return 0;
    }
    IrId axis[3], about[3];
    vector_ids(e, &args[1], axis);
    vector_ids(e, &args[3], about);
    return ir_rotate_axis(e->ir, span_of(e, node), axis, scalar_id(e, args[2].scalar), about);
}

static IrId map_scale(Eval *e, const Node *node, const Call *call, const Value *args)
{
    IrId factors[3], about[3];
    for (int k = 0; k < 3; k++) {
        if (is_zero(args[1 + k].scalar)) {
            complain(e, bound_node(call, (uint32_t)(1 + k), node), DIAG_OUT_OF_RANGE,
                     "a scale of 0 leaves nothing: write another factor");
            return 0;
        }
        factors[k] = scalar_id(e, args[1 + k].scalar);
    }
    vector_ids(e, &args[4], about);
    return ir_scale(e->ir, span_of(e, node), factors, about);
}

static IrId map_shear(Eval *e, const Node *node, const Value *args)
{
    IrId factors[6];
    for (int k = 0; k < 6; k++) factors[k] = scalar_id(e, args[1 + k].scalar);
    return ir_shear(e->ir, span_of(e, node), factors);
}

static IrId map_matrix(Eval *e, const Node *node, const Call *call, const Value *args)
{
    enum { NUMBERS = 12 };
    if (args[1].list.count != NUMBERS) {
        complain(e, bound_node(call, 1, node), DIAG_VALUE_COUNT,
                 "a matrix is three rows of four, 12 numbers, and here are %u", args[1].list.count);
        return 0;
    }
    IrId ids[NUMBERS];
    for (int k = 0; k < NUMBERS; k++) {
        if (at_point(e, args[1].list.items[k].scalar)) {
            report_rate(e, bound_node(call, 1, node), DIAG_POINT_RATE, "a matrix");
            return 0;
        }
        ids[k] = scalar_id(e, args[1].list.items[k].scalar);
    }
    return ir_node(e->ir, OP_MATRIX, span_of(e, node), ids, NUMBERS);
}

// X − 2 (n · (X − at)) n
static IrId map_mirror(Eval *e, const Node *node, const Call *call, const Value *args)
{
    enum { NORMAL = 1, AT };
    const Scalar *normal = args[NORMAL].vector, *at = args[AT].vector;
    if (is_zero(normal[0]) && is_zero(normal[1]) && is_zero(normal[2])) {
        complain(e, bound_node(call, NORMAL, node), DIAG_OUT_OF_RANGE, "a normal has a direction: write (1, 0, 0)");
        return 0;
    }
    Scalar square = scalar_of(0), height = scalar_of(0);
    for (int k = 0; k < 3; k++) {
        square = scalar_op2(e, OP_ADD, node, square, scalar_op2(e, OP_MUL, node, normal[k], normal[k]));
        height = scalar_op2(e, OP_ADD, node, height, scalar_op2(e, OP_MUL, node, normal[k], at[k]));
    }
    IrId ids[12];
    for (int i = 0; i < 3; i++) {
        Scalar twice = scalar_op2(e, OP_DIV, node, scalar_op2(e, OP_MUL, node, scalar_of(2), normal[i]), square);
        for (int j = 0; j < 3; j++) {
            Scalar part = scalar_op2(e, OP_MUL, node, twice, normal[j]);
            ids[4 * i + j] = scalar_id(e, scalar_op2(e, OP_SUB, node, scalar_of(i == j), part));
        }
        ids[4 * i + 3] = scalar_id(e, scalar_op2(e, OP_MUL, node, twice, height));
    }
    return ir_node(e->ir, OP_MATRIX, span_of(e, node), ids, 12);
}

IrId transform_parts(Eval *e, const Node *at, IrOp op, IrId part, IrId matrix)
{
    return ir_op2(e->ir, op, span_of(e, at), part, matrix);
}

static Value transformed(Eval *e, const Node *node, Value of, IrId matrix)
{
    if (!matrix) return value_bad();
    IrId first;
    if (of.type.kind == TYPE_PERTURBATION) {
        IrId *ids = arena_array(&e->scratch, IrId, of.parts.count);
        for (uint32_t i = 0; i < of.parts.count; i++)
            ids[i] = transform_parts(e, node, OP_PTRANSFORM, of.parts.ids[i], matrix);
        first = of.parts.count ? ids[0] : 0;
        of.parts.ids = ids;
    } else {
        first = of.id = transform_parts(e, node, OP_TRANSFORM, of.id, matrix);
    }
    if (first && ir_bad_fold(e->ir, first)) {
        complain(e, node, DIAG_OUT_OF_RANGE, "this map flattens space, so nothing is left: its determinant is 0");
        return value_bad();
    }
    return of;
}

static Value eval_paint(Eval *e, const Node *node, const Value *of, IrId material)
{
    return value_node(TYPE_OBJECT, ir_op2(e->ir, OP_PAINT, span_of(e, node), of->id, material));
}

// A colour alone is a material that is else as `material { }`.
static IrId material_of(Eval *e, const Node *node, const Value *color)
{
    const Callable *material = builtin_callable(e->unit, BUILTIN_MATERIAL);
    IrId ids[11];
    for (int k = 0; k < 3; k++) ids[k] = scalar_id(e, color->vector[k]);
    for (uint32_t i = 1; i < material->count; i++)
        ids[2 + i] = scalar_id(e, builtin_default(e, &material->parameters[i]).scalar);
    return ir_node(e->ir, OP_MATERIAL, span_of(e, node), ids, 11);
}

static Value eval_show(Eval *e, const Node *node, const Value *of, Scalar when)
{
    if (!when.id && when.number != 0) return value_node(TYPE_OBJECT, of->id);
    return value_node(TYPE_OBJECT, ir_op2(e->ir, OP_SHOW, span_of(e, node), of->id, scalar_id(e, when)));
}

// --- copies: the branch is there once, under a map for each

static bool copy_count(Eval *e, const Node *node, const Call *call, uint32_t at, const Value *count, double *copies)
{
    const Node *where = bound_node(call, at, node);
    if (!want_const(e, where, count->scalar, "the number of copies", copies)) return false;
    if (*copies >= 0 && *copies <= ITEMS_MAX) return true;
    complain(e, where, DIAG_OUT_OF_RANGE, "there are from 0 to %d copies", ITEMS_MAX);
    return false;
}

typedef IrId CopyMap(Eval *e, const Node *node, const Value *way, double i, double copies);

static IrId step_map(Eval *e, const Node *node, const Value *step, double i, double copies)
{
    IrId by[3];
    for (int k = 0; k < 3; k++) by[k] = scalar_id(e, scalar_op2(e, OP_MUL, node, step->vector[k], scalar_of(i)));
    return ir_move(e->ir, span_of(e, node), by);
}

static IrId turn_map(Eval *e, const Node *node, const Value *axis, double i, double copies)
{
    IrId ids[3];
    vector_ids(e, axis, ids);
    return ir_rotate_axis(e->ir, span_of(e, node), ids, ir_const(e->ir, 2 * M_PI * i / copies), NULL);
}

static Value eval_copies(Eval *e, const Node *node, const Value *of, const Value *way, double copies, CopyMap *map)
{
    IrId *ids = arena_array(&e->scratch, IrId, (size_t)copies);
    uint32_t count = 0;
    for (double i = 0; i < copies; i++) {
        if (!count_item(e, node)) return value_bad();
        ids[count++] = i == 0 ? of->id : transform_parts(e, node, OP_TRANSFORM, of->id, map(e, node, way, i, copies));
    }
    return join_sets(e, node, OP_UNION, ids, count);
}

static Value eval_repeat(Eval *e, const Node *node, const Call *call, const Value *args)
{
    enum { STEP = 1, COUNT };
    double copies;
    if (call->bound[COUNT].how == BOUND_DEFAULT) return eval_endless(e, node, args[0].id, &args[STEP]);
    if (!copy_count(e, node, call, COUNT, &args[COUNT], &copies)) return value_bad();
    return eval_copies(e, node, &args[0], &args[STEP], copies, step_map);
}

static Value eval_around(Eval *e, const Node *node, const Call *call, const Value *args)
{
    enum { COUNT = 1, AXIS };
    double copies;
    if (!copy_count(e, node, call, COUNT, &args[COUNT], &copies)) return value_bad();
    const Scalar *axis = args[AXIS].vector;
    if (is_zero(axis[0]) && is_zero(axis[1]) && is_zero(axis[2])) {
        complain(e, bound_node(call, AXIS, node), DIAG_OUT_OF_RANGE, "an axis has a direction: write (0, 0, 1)");
        return value_bad();
    }
    return eval_copies(e, node, &args[0], &args[AXIS], copies, turn_map);
}

Value eval_modifier(Eval *e, const Node *node, const Call *call, const Value *args)
{
    IrId matrix;
    switch (call->callee->id) {
    case BUILTIN_MOVE: matrix = map_move(e, node, args); break;
    case BUILTIN_MOVE_BY: matrix = map_move_by(e, node, args); break;
    case BUILTIN_ROTATE: matrix = map_rotate(e, node, args); break;
    case BUILTIN_ROTATE_AXIS: matrix = map_rotate_axis(e, node, call, args); break;
    case BUILTIN_SCALE: matrix = map_scale(e, node, call, args); break;
    case BUILTIN_SHEAR: matrix = map_shear(e, node, args); break;
    case BUILTIN_MATRIX: matrix = map_matrix(e, node, call, args); break;
    case BUILTIN_MIRROR: matrix = map_mirror(e, node, call, args); break;
    case BUILTIN_REPEAT: return eval_repeat(e, node, call, args);
    case BUILTIN_AROUND: return eval_around(e, node, call, args);
    case BUILTIN_PAINT: return eval_paint(e, node, &args[0], args[1].id);
    case BUILTIN_PAINT_COLOR: return eval_paint(e, node, &args[0], material_of(e, node, &args[1]));
    case BUILTIN_NAMED: {
        Span span = span_of(e, node);
        return value_node(TYPE_OBJECT,
                          ir_node_text(e->ir, OP_NAMED, span, &args[0].id, 1,
                                       arena_text(&e->unit->arena, args[1].string, strlen(args[1].string))));
    }
    case BUILTIN_TWIST:
    case BUILTIN_BEND:
    case BUILTIN_TAPER:
    case BUILTIN_STRETCH:
    case BUILTIN_ATTRACT: return eval_operation(e, node, call, args);
    case BUILTIN_SHOW: return eval_show(e, node, &args[0], args[1].scalar);
    default:
        assert(call->callee->id == BUILTIN_HIDE && "check() reports what is not there yet");
        return eval_show(e, node, &args[0], scalar_of(0));
    }
    return transformed(e, node, args[0], matrix);
}
