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
    case BUILTIN_PAINT: return eval_paint(e, node, &args[0], args[1].id);
    case BUILTIN_PAINT_COLOR: return eval_paint(e, node, &args[0], material_of(e, node, &args[1]));
    case BUILTIN_NAMED: {
        Span span = span_of(e, node);
        return value_node(TYPE_OBJECT,
                          ir_node_text(e->ir, OP_NAMED, span, &args[0].id, 1,
                                       arena_text(&e->unit->arena, args[1].string, strlen(args[1].string))));
    }
    case BUILTIN_SHOW: return eval_show(e, node, &args[0], args[1].scalar);
    default:
        assert(call->callee->id == BUILTIN_HIDE && "check() reports what is not there yet");
        return eval_show(e, node, &args[0], scalar_of(0));
    }
    return transformed(e, node, args[0], matrix);
}
