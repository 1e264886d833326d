#include "compiler/leaf.h"

#include "compiler/eval.h"
#include "compiler/quadric.h"

const double leaf_default_material[LEAF_MATERIAL_PARTS] = {0.8, 0.8, 0.8, 0.1, 0.8, 0.2, 30, 0, 0, 1.5, 0};
IrId leaf_function(const Ir *ir, IrId base, IrId *matrix)
{
    *matrix = 0;
    if (ir_at(ir, base)->op != OP_TRANSFORM) return base;
    *matrix = ir_operand(ir, base, 1);
    return ir_operand(ir, base, 0);
}

bool leaf_is_base(const Ir *ir, IrId id)
{
    IrId matrix;
    IrOp op = ir_at(ir, leaf_function(ir, id, &matrix))->op;
    return op == OP_QUADRIC || op == OP_FIELD;
}

static IrOp patch_op(const Ir *ir, IrId id)
{
    if (ir_at(ir, id)->op == OP_TRANSFORM) id = ir_operand(ir, id, 0);
    return ir_at(ir, id)->op;
}

bool leaf_is_sheet(const Ir *ir, IrId id)
{
    return patch_op(ir, id) == OP_SHEET;
}

bool leaf_is_thick(const Ir *ir, IrId id)
{
    return patch_op(ir, id) == OP_THICKEN;
}

bool leaf_is_patch(const Ir *ir, IrId id)
{
    return leaf_is_sheet(ir, id) || leaf_is_thick(ir, id);
}

bool leaf_is_core(const Ir *ir, IrId id)
{
    return leaf_is_base(ir, id) || (ir_at(ir, id)->op == OP_FREEFORM && leaf_is_base(ir, ir_operand(ir, id, 0)));
}

bool leaf_const_quadric(const Ir *ir, IrId quadric, double q[10])
{
    if (ir_at(ir, quadric)->op != OP_QUADRIC) return false;
    for (uint32_t k = 0; k < 10; k++) {
        if (!ir_is_const(ir, ir_operand(ir, quadric, k), &q[k])) return false;
    }
    return true;
}

// Coefficients that come out of a fold are equal to each other, as a sphere's, or to nothing else.
IrId leaf_quadric(Ir *ir, Span span, const double q[10])
{
    IrId operands[10];
    for (int k = 0; k < 10; k++) {
        int same = 0;
        while (same < k && q[same] != q[k]) same++;
        operands[k] = same < k ? operands[same] : q[k] == 0 ? ir_const(ir, 0) : ir_const_alone(ir, q[k]);
    }
    return ir_node(ir, OP_QUADRIC, span, operands, 10);
}

// What becomes of coefficient k of a quadric. What is done to the free term, 9, is also what is done to F itself.
typedef IrId Change(Ir *ir, Span span, int k, IrId coefficient, IrId argument);

static IrId changed_function(Ir *ir, IrId function, Change *change, IrId argument)
{
    IrId operands[10];
    Span span = ir_at(ir, function)->span;
    if (ir_at(ir, function)->op == OP_FIELD)
        return ir_op1(ir, OP_FIELD, span, change(ir, span, 9, ir_operand(ir, function, 0), argument));
    for (int k = 0; k < 10; k++) operands[k] = change(ir, span, k, ir_operand(ir, function, (uint32_t)k), argument);
    return ir_node(ir, OP_QUADRIC, span, operands, 10);
}

// What is done to coefficients is done inside of the map: negation is the same there, and a constant added too.
static IrId changed_base(Ir *ir, IrId base, Change *change, IrId argument)
{
    IrId matrix, function = changed_function(ir, leaf_function(ir, base, &matrix), change, argument);
    return matrix ? ir_op2(ir, OP_TRANSFORM, ir_at(ir, base)->span, function, matrix) : function;
}

static IrId minus(Ir *ir, Span span, IrId scalar)
{
    double value;
    if (ir_is_const(ir, scalar, &value)) return ir_const(ir, 0 - value); // 0 and not -0
    return ir_op1(ir, OP_NEG, span, scalar);
}

static IrId negated(Ir *ir, Span span, int k, IrId coefficient, IrId argument)
{
    return minus(ir, span, coefficient);
}

static IrId grown(Ir *ir, Span span, int k, IrId coefficient, IrId argument)
{
    return k == 9 ? ir_op2(ir, OP_ADD, span, coefficient, argument) : coefficient;
}

static IrId unless_all(Ir *ir, Span span, int k, IrId coefficient, IrId condition)
{
    return ir_op3(ir, OP_SELECT, span, condition, coefficient, ir_const(ir, k == 9 ? 1 : 0));
}

IrId leaf_negate_base(Ir *ir, IrId base)
{
    return changed_base(ir, base, negated, 0);
}

IrId leaf_grow_base(Ir *ir, IrId base, IrId grow)
{
    double value;
    return ir_is_const(ir, grow, &value) && value == 0 ? base : changed_base(ir, base, grown, grow);
}

static IrId with_strength(Ir *ir, IrId perturbation, IrId strength)
{
    if (ir_at(ir, perturbation)->op == OP_LIFT) {
        IrId operands[5];
        for (uint32_t k = 0; k < 5; k++) operands[k] = k == 1 ? strength : ir_operand(ir, perturbation, k);
        return ir_node(ir, OP_LIFT, ir_at(ir, perturbation)->span, operands, 5);
    }
    IrOp op = (IrOp)ir_at(ir, perturbation)->op; // PERTURB, COPY
    IrId first = ir_operand(ir, perturbation, 0), last = ir_operand(ir, perturbation, 2);
    return ir_op3(ir, op, ir_at(ir, perturbation)->span, first, strength, last);
}

uint32_t leaf_copy_count(const Ir *ir, IrId copy)
{
    return ir_at(ir, ir_operand(ir, copy, 0))->count;
}

IrId leaf_copy_part(Ir *ir, IrId copy, uint32_t k)
{
    IrId part = ir_operand(ir, ir_operand(ir, copy, 0), k), matrix = ir_operand(ir, copy, 2);
    Span span = ir_at(ir, part)->span;
    IrId base = ir_operand(ir, part, 0), inner, function = leaf_function(ir, base, &inner);
    double q[10], m[12], inverse[12];
    bool known = !inner && leaf_const_quadric(ir, function, q) && ir_const_matrix(ir, matrix, m) &&
                 matrix_inverse(m, inverse) && quadric_transform(q, inverse, q);
    if (known)
        base = leaf_quadric(ir, span, q);
    else
        base = ir_op2(ir, OP_TRANSFORM, span, function, inner ? ir_op2(ir, OP_COMPOSE, span, matrix, inner) : matrix);
    IrId strength = ir_op2(ir, OP_MUL, span, ir_operand(ir, part, 1), ir_operand(ir, copy, 1));
    return ir_op3(ir, OP_PERTURB, span, base, strength, ir_operand(ir, part, 2));
}

static IrId negated_perturbation(Ir *ir, IrId perturbation, IrId argument)
{
    return with_strength(ir, perturbation, minus(ir, ir_at(ir, perturbation)->span, ir_operand(ir, perturbation, 1)));
}

static IrId perturbation_unless_all(Ir *ir, IrId perturbation, IrId condition)
{
    Span span = ir_at(ir, perturbation)->span;
    IrId strength = ir_operand(ir, perturbation, 1);
    return with_strength(ir, perturbation, ir_op3(ir, OP_SELECT, span, condition, strength, ir_const(ir, 0)));
}

IrId leaf_negate_perturbation(Ir *ir, IrId perturbation)
{
    return negated_perturbation(ir, perturbation, 0);
}

static IrId changed_core(Ir *ir, IrId core, Change *change, IrId (*change_perturbation)(Ir *, IrId, IrId),
                         IrId argument)
{
    if (leaf_is_base(ir, core)) return changed_base(ir, core, change, argument);
    uint32_t count = ir_at(ir, core)->count;
    Span span = ir_at(ir, core)->span;
    Arena scratch = {0};
    IrId *operands = arena_array(&scratch, IrId, count);
    operands[0] = changed_base(ir, ir_operand(ir, core, 0), change, argument);
    for (uint32_t k = 1; k < count; k++) operands[k] = change_perturbation(ir, ir_operand(ir, core, k), argument);
    IrId result = ir_node(ir, OP_FREEFORM, span, operands, count);
    arena_release(&scratch);
    return result;
}

// The same thick patch with another side.
static IrId changed_side(Ir *ir, IrId leaf, Change *change, IrId argument)
{
    IrId matrix, thick = leaf_function(ir, leaf, &matrix);
    Span span = ir_at(ir, thick)->span;
    IrId side = change(ir, span, 0, ir_operand(ir, thick, 2), argument);
    thick = ir_op3(ir, OP_THICKEN, span, ir_operand(ir, thick, 0), ir_operand(ir, thick, 1), side);
    return matrix ? ir_op2(ir, OP_TRANSFORM, ir_at(ir, leaf)->span, thick, matrix) : thick;
}

IrId leaf_negate(Ir *ir, IrId core)
{
    if (leaf_is_thick(ir, core)) return changed_side(ir, core, negated, 0);
    return changed_core(ir, core, negated, negated_perturbation, 0);
}

IrId leaf_marked(Ir *ir, Span span, IrId leaf, IrId paint, IrId shown, IrId named)
{
    if (paint) leaf = ir_op2(ir, OP_PAINT, span, leaf, paint);
    if (shown) leaf = ir_op2(ir, OP_SHOW, span, leaf, shown);
    if (!named) return leaf;
    return ir_node_text(ir, OP_NAMED, ir_at(ir, named)->span, &leaf, 1, ir_at(ir, named)->text);
}

IrId leaf_unless_all(Ir *ir, IrId core, IrId condition)
{
    if (leaf_is_thick(ir, core)) return changed_side(ir, core, unless_all, condition);
    return changed_core(ir, core, unless_all, perturbation_unless_all, condition);
}

IrId leaf_mark_all(Ir *ir, IrId core, IrId condition)
{
    Span span = ir_at(ir, core)->span;
    IrId shown = ir_op2(ir, OP_SHOW, span, ir_op1(ir, OP_COMPLEMENT, span, core), condition);
    return ir_op1(ir, OP_COMPLEMENT, span, shown);
}
