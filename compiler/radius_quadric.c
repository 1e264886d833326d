#include "compiler/radius_quadric.h"

#include <math.h>
#include <string.h>

#include "compiler/leaf.h"

enum { NEWTON_STEPS = 3 };

typedef struct Axes { // a quadric in the coordinates of its axes, X' = R X
    double R[3][3];
    IrId lambda[3], half[3]; // eigenvalues, half the linear coefficients
    IrId free_term;
    bool flat[3]; // both are known to be 0
} Axes;

typedef struct Maker {
    Ir *ir;
    Span span;
} Maker;

static IrId op1(const Maker *m, IrOp op, IrId a)
{
    return ir_op1(m->ir, op, m->span, a);
}

static IrId op2(const Maker *m, IrOp op, IrId a, IrId b)
{
    return ir_op2(m->ir, op, m->span, a, b);
}

static IrId number(const Maker *m, double value)
{
    return ir_const(m->ir, value);
}

static IrId square(const Maker *m, IrId a)
{
    return op2(m, OP_MUL, a, a);
}

static bool is_zero(const Maker *m, IrId id)
{
    double value;
    return ir_is_const(m->ir, id, &value) && value == 0;
}

// --- axes

// Jacobi's rotations: S becomes diagonal, the rows of R the axes. Three of them a sweep, each exact for its entry.
static void find_axes(double S[3][3], double R[3][3])
{
    enum { SWEEPS = 12 };
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) R[i][j] = i == j;
    }
    for (int step = 0; step < 3 * SWEEPS; step++) {
        int i = step % 3, j = (i + 1) % 3;
        if (S[i][j] == 0) continue;
        // The smaller of the two angles that do it: with the other, axes may change places for ever.
        double apart = S[j][j] - S[i][i], angle = apart == 0 ? M_PI / 4 : 0.5 * atan(2 * S[i][j] / apart);
        double c = cos(angle), s = sin(angle);
        for (int k = 0; k < 3; k++) { // columns
            double a = S[k][i], b = S[k][j];
            S[k][i] = c * a - s * b;
            S[k][j] = s * a + c * b;
        }
        for (int k = 0; k < 3; k++) { // rows
            double a = S[i][k], b = S[j][k], x = R[i][k], y = R[j][k];
            S[i][k] = c * a - s * b;
            S[j][k] = s * a + c * b;
            R[i][k] = c * x - s * y;
            R[j][k] = s * x + c * y;
        }
    }
}

static void const_axes(const Maker *m, const double q[10], Axes *axes)
{
    double S[3][3] = {{q[0], q[3] / 2, q[4] / 2}, {q[3] / 2, q[1], q[5] / 2}, {q[4] / 2, q[5] / 2, q[2]}}, size = 0;
    find_axes(S, axes->R);
    for (int i = 0; i < 3; i++) size = fmax(size, fabs(S[i][i]));
    for (int i = 0; i < 3; i++) {
        double half = 0, lambda = fabs(S[i][i]) > 1e-13 * size ? S[i][i] : 0, reach = 0;
        for (int k = 0; k < 3; k++) {
            half += axes->R[i][k] * q[6 + k] / 2;
            reach += fabs(q[6 + k]);
        }
        if (fabs(half) <= 1e-14 * reach) half = 0;
        axes->lambda[i] = number(m, lambda);
        axes->half[i] = number(m, half);
        axes->flat[i] = lambda == 0 && half == 0;
    }
}

// What moves has its axes along x, y and z.
static bool axes_of(const Maker *m, IrId quadric, Axes *axes)
{
    const Ir *ir = m->ir;
    double q[10];
    memset(axes, 0, sizeof *axes);
    axes->free_term = ir_operand(ir, quadric, 9);
    if (leaf_const_quadric(ir, quadric, q)) {
        const_axes(m, q, axes);
        return true;
    }
    for (uint32_t k = 3; k < 6; k++) {
        if (!is_zero(m, ir_operand(ir, quadric, k))) return false;
    }
    for (uint32_t k = 0; k < 3; k++) {
        axes->R[k][k] = 1;
        axes->lambda[k] = ir_operand(ir, quadric, k);
        axes->half[k] = op2(m, OP_MUL, ir_operand(ir, quadric, 6 + k), number(m, 0.5));
        axes->flat[k] = is_zero(m, axes->lambda[k]) && is_zero(m, axes->half[k]);
    }
    return true;
}

// Minus the function; what changes its sign are three eigenvalues and four coefficients.
static void negate(const Maker *m, Axes *axes)
{
    for (int k = 0; k < 3; k++) {
        axes->lambda[k] = op1(m, OP_NEG, axes->lambda[k]);
        axes->half[k] = op1(m, OP_NEG, axes->half[k]);
    }
    axes->free_term = op1(m, OP_NEG, axes->free_term);
}

static IrId coordinate(const Maker *m, const double row[3])
{
    static const IrOp names[3] = {OP_X, OP_Y, OP_Z};
    IrId sum = number(m, 0);
    for (int k = 0; k < 3; k++) {
        if (row[k] == 0) continue;
        sum = op2(m, OP_ADD, op2(m, OP_MUL, ir_node(m->ir, names[k], m->span, NULL, 0), number(m, row[k])), sum);
    }
    return sum;
}

// --- the dual

typedef struct Dual {
    const Maker *m;
    const Axes *axes;
    IrId radius;      // positive
    IrId p[3], pp[3]; // half the gradient, and squared
    IrId value;       // q
    IrId top;       // the greatest λ; what is searched for is σ = μ - top, so that nothing is lost where it is small
    IrId below[3];  // top - λᵢ
    IrId low, high; // what holds σ
} Dual;

static IrId joined(const Maker *m, IrOp op, IrId a, IrId b)
{
    return a ? op2(m, op, a, b) : b;
}

// |pᵢ| = (μ - λᵢ) |dᵢ| and |d| = D: μ is at least λᵢ + |pᵢ| / D for each axis and λ + |p| / D for the least of them, and at
// most that for the greatest. Where the greatest λ is not negative μ stays a little above it: a quadric that no direction of
// which falls has its maximum there at p = 0.
static void bound(Dual *d)
{
    const Maker *m = d->m;
    IrId size = 0, sum = 0, farthest = 0, zero = number(m, 0);
    for (int k = 0; k < 3; k++) {
        if (!d->axes->flat[k]) d->top = joined(m, OP_MAX, d->top, d->axes->lambda[k]);
    }
    d->low = op2(m, OP_MAX, op1(m, OP_NEG, d->top), zero);
    for (int k = 0; k < 3; k++) {
        if (d->axes->flat[k]) continue;
        IrId steep = op2(m, OP_DIV, op1(m, OP_ABS, d->p[k]), d->radius);
        d->below[k] = op2(m, OP_SUB, d->top, d->axes->lambda[k]);
        size = joined(m, OP_MAX, size, op1(m, OP_ABS, d->axes->lambda[k]));
        farthest = joined(m, OP_MAX, farthest, d->below[k]);
        sum = joined(m, OP_ADD, sum, d->pp[k]);
        d->low = op2(m, OP_MAX, op2(m, OP_SUB, steep, d->below[k]), d->low);
    }
    d->high = op2(m, OP_DIV, op1(m, OP_SQRT, sum), d->radius);
    d->low = op2(m, OP_MAX, d->low, op2(m, OP_SUB, d->high, farthest));
    double known;
    if (!ir_is_const(m->ir, d->top, &known) || known >= 0)
        d->low = op2(m, OP_MAX, d->low, op2(m, OP_MUL, op2(m, OP_MAX, size, number(m, 1e-9)), number(m, 1e-6)));
    d->high = op2(m, OP_MAX, d->high, d->low);
}

// Σ pᵢ² / (μ - λᵢ)^power
static IrId weighed(const Dual *d, IrId sigma, int power)
{
    const Maker *m = d->m;
    IrId sum = 0;
    for (int k = 0; k < 3; k++) {
        if (d->axes->flat[k]) continue;
        IrId above = op2(m, OP_ADD, sigma, d->below[k]), divisor = above;
        for (int i = 1; i < power; i++) divisor = op2(m, OP_MUL, divisor, above);
        sum = joined(m, OP_ADD, sum, op2(m, OP_DIV, d->pp[k], divisor));
    }
    return sum;
}

// μ + (|d| / D - 1) |d|² / Σ dᵢ² / (μ - λᵢ). Where the gradient is 0 there is no step.
static IrId stepped(const Dual *d, IrId sigma)
{
    const Maker *m = d->m;
    IrId squares = weighed(d, sigma, 2), slope = op2(m, OP_MAX, weighed(d, sigma, 3), number(m, 1e-18));
    IrId far = op2(m, OP_SUB, op2(m, OP_DIV, op1(m, OP_SQRT, squares), d->radius), number(m, 1));
    IrId step = op2(m, OP_MUL, far, op2(m, OP_DIV, squares, slope));
    return op2(m, OP_MIN, op2(m, OP_MAX, op2(m, OP_ADD, sigma, step), d->low), d->high);
}

static IrId greatest(const Maker *m, const Axes *axes, IrId radius)
{
    Dual d = {.m = m, .axes = axes, .radius = radius, .value = axes->free_term};
    for (int k = 0; k < 3; k++) {
        if (axes->flat[k]) continue;
        IrId x = coordinate(m, axes->R[k]), slope = op2(m, OP_MUL, axes->lambda[k], x);
        d.p[k] = op2(m, OP_ADD, slope, axes->half[k]);
        d.pp[k] = square(m, d.p[k]);
        // λ x² + 2 h x
        d.value = op2(m, OP_ADD, d.value, op2(m, OP_MUL, x, op2(m, OP_ADD, d.p[k], axes->half[k])));
    }
    bound(&d);
    IrId sigma = d.low;
    for (int k = 0; k < NEWTON_STEPS; k++) sigma = stepped(&d, sigma);
    IrId mu = op2(m, OP_ADD, sigma, d.top);
    IrId gain = op2(m, OP_ADD, op2(m, OP_MUL, mu, square(m, radius)), weighed(&d, sigma, 1));
    return op2(m, OP_ADD, d.value, gain);
}

IrId radius_quadric(Ir *ir, IrId quadric, IrId radius)
{
    Maker m = {ir, ir_at(ir, quadric)->span};
    Axes axes;
    double known;
    if (!axes_of(&m, quadric, &axes)) return 0;
    IrId distance = op2(&m, OP_MAX, op1(&m, OP_ABS, radius), number(&m, 1e-9)), grown, shrunk;
    bool certain = ir_is_const(ir, radius, &known);
    grown = greatest(&m, &axes, distance);
    if (certain && known >= 0) return grown;
    negate(&m, &axes);
    shrunk = op1(&m, OP_NEG, greatest(&m, &axes, distance));
    if (certain) return shrunk;
    return ir_op3(ir, OP_SELECT, m.span, op2(&m, OP_LT, radius, number(&m, 0)), shrunk, grown);
}
