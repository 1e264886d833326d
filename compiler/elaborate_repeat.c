// `repeat` without a count: all copies, in both directions.
//
// F at X is F of the object at the place that X has within its own step. With s the step, u = X·s / |s|² and r = u - round(u):
//
//     X'(j) = (X - u s) + (r - j) s             F = max over j of F(X'(j))
//
// The object lies within some steps, u in low … high; so these j are all whose copies X may be in: from -1/2 - high to
// 1/2 - low. r is clamped to -1/2 … 1/2, which it never leaves, so that bounds over a large box know it too.
#include <math.h>

#include "compiler/evaluator.h"
#include "compiler/expression.h"
#include "compiler/field.h"
#include "compiler/object.h"
#include "compiler/object_box.h"

enum { NEIGHBOURS_MAX = 64 };

typedef struct Endless {
    Eval *e;
    Ir *ir;
    const Node *node;
    Span span;
    double step[3], square; // the step, its length squared
} Endless;

static IrId op2(const Endless *r, IrOp op, IrId a, IrId b)
{
    return ir_op2(r->ir, op, r->span, a, b);
}

static IrId number(const Endless *r, double value)
{
    return ir_const(r->ir, value);
}

static IrId axis(const Endless *r, int k)
{
    static const IrOp axes[3] = {OP_X, OP_Y, OP_Z};
    return ir_node(r->ir, axes[k], r->span, NULL, 0);
}

static IrId combined(const Endless *r, const double factors[3])
{
    IrId sum = number(r, 0);
    for (int k = 0; k < 3; k++) {
        if (factors[k] != 0) sum = op2(r, OP_ADD, sum, op2(r, OP_MUL, axis(r, k), number(r, factors[k])));
    }
    return sum;
}

// Two directions that are square to the step and to each other, of any length.
static void across(const double step[3], double v[3], double w[3])
{
    int least = 0;
    for (int k = 1; k < 3; k++) least = fabs(step[k]) < fabs(step[least]) ? k : least;
    double a[3] = {least == 0, least == 1, least == 2};
    for (int k = 0; k < 3; k++) v[k] = step[(k + 1) % 3] * a[(k + 2) % 3] - step[(k + 2) % 3] * a[(k + 1) % 3];
    for (int k = 0; k < 3; k++) w[k] = step[(k + 1) % 3] * v[(k + 2) % 3] - step[(k + 2) % 3] * v[(k + 1) % 3];
}

// --- how far the object reaches

// How far the object reaches along the step, in steps. False where it moves.
static bool reach(const Endless *r, IrId leaves, double *low, double *high)
{
    double v[3], w[3], from[3], to[3];
    IrId turned[3];
    if (ir_at(r->ir, leaves)->moves) return false;
    across(r->step, v, w);
    for (int k = 0; k < 3; k++) turned[k] = combined(r, (double[3]){r->step[k], v[k], w[k]});
    IrId expression = expression_substitute(r->ir, object_expression(r->ir, leaves), turned);
    if (!field_fold_bounds(r->ir, expression, from, to)) return false;
    double least = 0, most = 0, box[2][3];
    object_box(r->ir, leaves, box[0], box[1]);
    for (int k = 0; k < 3; k++) {
        double along = r->step[k] / r->square;
        if (along == 0) continue;
        least += along * box[along < 0][k];
        most += along * box[along > 0][k];
    }
    *low = fmax(from[0], least);
    *high = fmin(to[0], most);
    return true;
}

// --- copies

// The coordinates within the step, for the copy that is j steps before it.
static void coordinates(const Endless *r, double j, IrId at[3])
{
    double along[3];
    for (int k = 0; k < 3; k++) along[k] = r->step[k] / r->square;
    IrId u = combined(r, along), rest = op2(r, OP_SUB, u, ir_op1(r->ir, OP_ROUND, r->span, u));
    rest = op2(r, OP_MIN, op2(r, OP_MAX, rest, number(r, -0.5)), number(r, 0.5));
    rest = op2(r, OP_SUB, rest, number(r, j));
    for (int i = 0; i < 3; i++) {
        double square_to[3];
        for (int k = 0; k < 3; k++) square_to[k] = (i == k) - r->step[i] * r->step[k] / r->square;
        at[i] = combined(r, square_to);
        if (r->step[i] != 0) at[i] = op2(r, OP_ADD, op2(r, OP_MUL, rest, number(r, r->step[i])), at[i]);
    }
}

static Value refused(const Endless *r, DiagCode code, const char *text)
{
    complain(r->e, r->node, code, "%s", text);
    return value_bad();
}

Value eval_endless(Eval *e, const Node *node, IrId object, const Value *step)
{
    Endless r = {.e = e, .ir = e->ir, .node = node, .span = span_of(e, node)};
    for (int k = 0; k < 3; k++) {
        if (!want_const(e, node, step->vector[k], "the step of copies without a count", &r.step[k])) return value_bad();
        r.square += r.step[k] * r.step[k];
    }
    if (!(r.square > 0)) return refused(&r, DIAG_OUT_OF_RANGE, "a step has a length: write (1, 0, 0)");
    if (object_is_patched(e->ir, object))
        return refused(&r, DIAG_NOT_YET,
                       "copies of patches without a count are not there yet in this version of scn: say "
                       "how many, count: 10");
    IrId leaves = object_leaves(e->ir, object);
    double low, high;
    if (leaves && !reach(&r, leaves, &low, &high))
        return refused(&r, DIAG_NOT_YET,
                       "copies without a count of what moves are not there yet in this version of scn: say "
                       "how many, count: 10, or move all of them together, a.repeat(step).move(…)");
    if (leaves && low > high) return value_node(TYPE_OBJECT, ir_node(e->ir, OP_EMPTY, r.span, NULL, 0));
    if (leaves && !(high - low < NEIGHBOURS_MAX))
        return refused(&r, DIAG_OUT_OF_RANGE,
                       "the object is longer than 64 steps: copies without a count are of what has an "
                       "end along the step");
    IrId parts[NEIGHBOURS_MAX + 2];
    uint32_t count = 0;
    for (double j = ceil(-0.5 - high); leaves && j <= floor(0.5 - low) && count < NEIGHBOURS_MAX + 2; j++) {
        IrId at[3];
        if (!count_item(e, node)) return value_bad();
        coordinates(&r, j, at);
        parts[count] = object_warped(e->ir, leaves, at);
        if (!parts[count++]) leaves = 0;
    }
    if (!leaves) {
        complain(e, node, DIAG_TOO_MANY_ITEMS, "the object has more than %d parts: use fewer copies", ITEMS_MAX);
        return value_bad();
    }
    return value_node(TYPE_OBJECT, ir_node(e->ir, OP_UNION, r.span, parts, count));
}
