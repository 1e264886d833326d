#include "compiler/expression.h"

#include <math.h>

#include "compiler/leaf.h"
#include "compiler/quadric.h"

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

// The sum of factor[k] times the coordinates and of a constant. What is 0 leaves no trace.
static IrId linear_form(Ir *ir, Span span, const double factor[3], double constant)
{
    static const IrOp axes[3] = {OP_X, OP_Y, OP_Z};
    IrId sum = 0;
    for (int k = 0; k < 3; k++) {
        if (factor[k] == 0) continue;
        IrId term = ir_node(ir, axes[k], span, NULL, 0);
        if (factor[k] != 1) term = times(ir, span, ir_const(ir, factor[k]), term);
        sum = sum ? ir_op2(ir, OP_ADD, span, sum, term) : term;
    }
    return constant != 0 ? ir_op2(ir, OP_ADD, span, sum, ir_const(ir, constant)) : sum;
}

// How far from the origin, in units, squares are completed: what is further keeps its coefficients, since a ball of radius 10^6 whose surface is at
// the origin is exact there so, and in squares about its middle wrong by 0.06 in floats.
#define MIDDLE_REACH 64.0

// A const quadric as squares about its middle, s (u + l / 2s)² in its own axes u: ranges over boxes hold little more than the values then. From ten
// coefficients x² and x vary as if they had nothing to do with each other: blends of small balls took 2.4 times as long.
static IrId squares_expression(Ir *ir, Span span, const double coefficients[10])
{
    double q[10], size = fmax(fabs(coefficients[0]), fmax(fabs(coefficients[1]), fabs(coefficients[2])));
    for (int k = 0; k < 10; k++) q[k] = k >= 3 && k < 6 && fabs(coefficients[k]) < 1e-14 * size ? 0 : coefficients[k];
    QuadricAxes axes;
    quadric_axes(q, &axes);
    double rest[3] = {0}, constant = axes.constant; // what is not in a square is a linear form
    IrId sum = 0;
    for (int k = 0; k < 3; k++) {
        double s = axes.square[k], middle = s != 0 ? -axes.linear[k] / (2 * s) : 0, shift = middle;
        if (!(fabs(middle) <= MIDDLE_REACH)) shift = 0;
        if (shift == 0) {
            for (int j = 0; j < 3; j++) rest[j] += axes.linear[k] * axes.axis[k][j];
        } else {
            constant -= s * shift * shift;
        }
        if (s == 0) continue;
        IrId u = linear_form(ir, span, axes.axis[k], -shift);
        IrId term = times(ir, span, ir_const(ir, s), times(ir, span, u, u));
        sum = sum ? ir_op2(ir, OP_ADD, span, sum, term) : term;
    }
    IrId last =
        rest[0] != 0 || rest[1] != 0 || rest[2] != 0 ? linear_form(ir, span, rest, constant) : ir_const(ir, constant);
    return sum ? ir_op2(ir, OP_ADD, span, sum, last) : last;
}

// Coefficients that are known to be 0 leave no trace.
static IrId quadric_expression(Ir *ir, IrId quadric)
{
    Span span = ir_at(ir, quadric)->span;
    double q[10];
    if (leaf_const_quadric(ir, quadric, q)) return squares_expression(ir, span, q);
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

enum { GAINS_MAX = 1000 }; // additions in each other that are taken out of a maximum

// F of F + gain, with the gain, also of -(G - gain); 0: it is no sum.
static IrId without_gain(Ir *ir, IrId sum, IrId *gain)
{
    bool negated = ir_at(ir, sum)->op == OP_NEG;
    if (negated) sum = ir_operand(ir, sum, 0);
    if (ir_at(ir, sum)->op != (negated ? OP_SUB : OP_ADD)) return 0;
    *gain = ir_operand(ir, sum, 1);
    IrId rest = ir_operand(ir, sum, 0);
    return negated ? ir_op1(ir, OP_NEG, ir_at(ir, sum)->span, rest) : rest;
}

static IrId decided(Ir *ir, IrOp op, Span span, IrId a, IrId b, int depth)
{
    if (a == b) return a;
    IrId gain, other;
    IrId f = depth < GAINS_MAX ? without_gain(ir, a, &gain) : 0, g = f ? without_gain(ir, b, &other) : 0;
    if (!g || gain != other) return ir_op2(ir, op, span, a, b);
    IrId sharp = decided(ir, op, span, f, g, depth + 1);
    // sharp + (smooth - sharp)
    if (ir_at(ir, gain)->op == OP_SUB && ir_operand(ir, gain, 1) == sharp) return ir_operand(ir, gain, 0);
    return ir_op2(ir, OP_ADD, span, sharp, gain);
}

IrId expression_decided(Ir *ir, IrOp op, Span span, IrId a, IrId b)
{
    return decided(ir, op, span, a, b, 0);
}

IrId expression_mixed(Ir *ir, Span span, IrId a, IrId b, IrId t)
{
    if (a == b) return a;
    IrId one = ir_const(ir, 1), zero = ir_const(ir, 0), rest = ir_op2(ir, OP_SUB, span, one, t);
    IrId sum = ir_op2(ir, OP_ADD, span, times(ir, span, rest, a), times(ir, span, t, b));
    sum = ir_op3(ir, OP_SELECT, span, ir_op2(ir, OP_LE, span, one, t), b, sum);
    return ir_op3(ir, OP_SELECT, span, ir_op2(ir, OP_LE, span, t, zero), a, sum);
}
