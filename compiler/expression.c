#include "compiler/expression.h"

#include "compiler/leaf.h"

// --- what it is made of

// Operands come before what uses them: a sweep down marks what of point rate the expression reaches.
bool *expression_reached(const Ir *ir, IrId expression, Arena *scratch)
{
    bool *reached = arena_array(scratch, bool, expression + 1);
    reached[expression] = ir_at(ir, expression)->rate == RATE_POINT;
    for (IrId id = expression; id > 0; id--) {
        for (uint32_t k = 0; reached[id] && k < ir_at(ir, id)->count; k++) {
            IrId operand = ir_operand(ir, id, k);
            if (ir_at(ir, operand)->rate == RATE_POINT) reached[operand] = true;
        }
    }
    return reached;
}

static bool is_known(IrOp op)
{
    return op == OP_X || op == OP_Y || op == OP_Z || (op >= OP_ADD && op <= OP_ROUND) || op == OP_NOISE ||
           op == OP_CELLS || (op >= OP_LT && op <= OP_SELECT);
}

IrOp expression_unknown(const Ir *ir, IrId expression)
{
    Arena scratch = {0};
    const bool *reached = expression_reached(ir, expression, &scratch);
    IrOp unknown = OP_NONE;
    for (IrId id = 1; id <= expression && !unknown; id++) {
        if (reached[id] && !is_known((IrOp)ir_at(ir, id)->op)) unknown = (IrOp)ir_at(ir, id)->op;
    }
    arena_release(&scratch);
    return unknown;
}

bool expression_has(const Ir *ir, IrId expression, IrOp op)
{
    Arena scratch = {0};
    const bool *reached = expression_reached(ir, expression, &scratch);
    bool has = false;
    for (IrId id = 1; id <= expression; id++) has |= reached[id] && ir_at(ir, id)->op == op;
    arena_release(&scratch);
    return has;
}

// --- substitution

typedef struct Substitution {
    Ir *ir;
    Arena scratch;
    IrId *results; // by node; 0: not known yet
    const IrId *coordinates;
} Substitution;

static IrId rebuilt(Substitution *s, IrId id)
{
    IrNode node = *ir_at(s->ir, id);
    IrId operands[3] = {0};
    for (uint32_t k = 0; k < node.count; k++) {
        IrId operand = ir_operand(s->ir, id, k);
        operands[k] = s->results[operand] ? s->results[operand] : operand;
    }
    switch ((IrOp)node.op) {
    case OP_X: return s->coordinates[0];
    case OP_Y: return s->coordinates[1];
    case OP_Z: return s->coordinates[2];
    default: return ir_node(s->ir, (IrOp)node.op, node.span, operands, node.count);
    }
}

IrId expression_substitute(Ir *ir, IrId expression, const IrId coordinates[3])
{
    Substitution s = {.ir = ir, .coordinates = coordinates};
    const bool *reached = expression_reached(ir, expression, &s.scratch);
    s.results = arena_array(&s.scratch, IrId, expression + 1);
    for (IrId id = 1; id <= expression; id++) {
        if (reached[id]) s.results[id] = rebuilt(&s, id);
    }
    IrId result = s.results[expression] ? s.results[expression] : expression;
    arena_release(&s.scratch);
    return result;
}

// --- maps

static IrId entry(Ir *ir, Span span, IrId matrix, uint32_t index)
{
    return ir_node_index(ir, OP_ENTRY, span, &matrix, 1, index);
}

void expression_inverse_point(Ir *ir, Span span, IrId matrix, IrId coordinates[3])
{
    static const IrOp axes[3] = {OP_X, OP_Y, OP_Z};
    IrId inverse = ir_op1(ir, OP_INVERSE, span, matrix);
    for (uint32_t row = 0; row < 3; row++) {
        IrId sum = entry(ir, span, inverse, 4 * row + 3);
        for (uint32_t k = 0; k < 3; k++) {
            IrId factor = entry(ir, span, inverse, 4 * row + k);
            double value;
            if (ir_is_const(ir, factor, &value) && value == 0) continue;
            IrId axis = ir_node(ir, axes[k], span, NULL, 0);
            sum = ir_op2(ir, OP_ADD, span, sum, ir_op2(ir, OP_MUL, span, factor, axis));
        }
        coordinates[row] = sum;
    }
}

// --- bases

static IrId times(Ir *ir, Span span, IrId a, IrId b)
{
    return ir_op2(ir, OP_MUL, span, a, b);
}

// Coefficients that are known to be 0 leave no trace.
static IrId quadric_expression(Ir *ir, IrId quadric)
{
    Span span = ir_at(ir, quadric)->span;
    IrId x = ir_node(ir, OP_X, span, NULL, 0), y = ir_node(ir, OP_Y, span, NULL, 0),
         z = ir_node(ir, OP_Z, span, NULL, 0);
    const IrId factors[9][2] = {{x, x}, {y, y}, {z, z}, {x, y}, {x, z}, {y, z}, {x, 0}, {y, 0}, {z, 0}};
    IrId sum = ir_operand(ir, quadric, 9);
    for (uint32_t k = 0; k < 9; k++) {
        IrId coefficient = ir_operand(ir, quadric, k);
        double value;
        if (ir_is_const(ir, coefficient, &value) && value == 0) continue;
        IrId term = factors[k][1] ? times(ir, span, factors[k][0], factors[k][1]) : factors[k][0];
        sum = ir_op2(ir, OP_ADD, span, sum, times(ir, span, coefficient, term));
    }
    return sum;
}

IrId expression_of_base(Ir *ir, IrId base)
{
    IrId matrix, function = leaf_function(ir, base, &matrix), coordinates[3];
    IrId expression =
        ir_at(ir, function)->op == OP_FIELD ? ir_operand(ir, function, 0) : quadric_expression(ir, function);
    if (!matrix) return expression;
    expression_inverse_point(ir, ir_at(ir, base)->span, matrix, coordinates);
    return expression_substitute(ir, expression, coordinates);
}

static IrId plus_cube(Ir *ir, Span span, IrId sum, IrId perturbation)
{
    IrId q = expression_of_base(ir, ir_operand(ir, perturbation, 0));
    q = ir_op2(ir, OP_ADD, span, q, ir_operand(ir, perturbation, 2));
    IrId positive = ir_op2(ir, OP_MAX, span, q, ir_const(ir, 0));
    IrId cube = times(ir, span, times(ir, span, positive, positive), positive);
    return ir_op2(ir, OP_ADD, span, sum, times(ir, span, ir_operand(ir, perturbation, 1), cube));
}

IrId expression_perturbed(Ir *ir, const IrId *operands, uint32_t count)
{
    if (count == 1) return operands[0];
    Span span = ir_at(ir, operands[0])->span;
    IrId sum = expression_of_base(ir, operands[0]);
    for (uint32_t k = 1; k < count; k++) {
        if (ir_at(ir, operands[k])->op != OP_COPY) {
            sum = plus_cube(ir, span, sum, operands[k]);
            continue;
        }
        uint32_t parts = leaf_copy_count(ir, operands[k]);
        for (uint32_t part = 0; part < parts; part++)
            sum = plus_cube(ir, span, sum, leaf_copy_part(ir, operands[k], part));
    }
    return ir_op1(ir, OP_FIELD, span, sum);
}

IrId expression_mixed(Ir *ir, Span span, IrId a, IrId b, IrId t)
{
    if (a == b) return a;
    IrId one = ir_const(ir, 1), zero = ir_const(ir, 0), rest = ir_op2(ir, OP_SUB, span, one, t);
    IrId sum = ir_op2(ir, OP_ADD, span, times(ir, span, rest, a), times(ir, span, t, b));
    sum = ir_op3(ir, OP_SELECT, span, ir_op2(ir, OP_LE, span, one, t), b, sum);
    return ir_op3(ir, OP_SELECT, span, ir_op2(ir, OP_LE, span, t, zero), a, sum);
}
