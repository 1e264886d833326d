#include "compiler/interval.h"

#include <float.h>
#include <math.h>

#include "compiler/noise.h"
#include "kernels/tape_shared.h"

Interval interval_of(double low, double high)
{
    return (Interval){.low = low, .high = high};
}

Interval interval_empty(void)
{
    return (Interval){.low = INFINITY, .high = -INFINITY, .partial = true};
}

bool interval_is_empty(Interval a)
{
    return !(a.low <= a.high);
}

Interval interval_hull(Interval a, Interval b)
{
    bool partial = a.partial || b.partial;
    if (interval_is_empty(a)) a = b;
    if (interval_is_empty(b)) b = a;
    return (Interval){fmin(a.low, b.low), fmax(a.high, b.high), partial};
}

// --- rounding

static double below(double x, int steps)
{
    if (isnan(x)) return -INFINITY;
    if (x > DBL_MAX) return DBL_MAX; // a finite number was too large
    return x - steps * (fabs(x) * DBL_EPSILON + DBL_MIN);
}

static double above(double x, int steps)
{
    return -below(-x, steps);
}

static Interval outward(double low, double high, int steps)
{
    return (Interval){.low = below(low, steps), .high = above(high, steps)};
}

// --- arithmetic

// An end that is infinite is not reached, so 0 times it is 0.
static double product(double a, double b)
{
    return a == 0 || b == 0 ? 0 : a * b;
}

static Interval multiplied(Interval a, Interval b)
{
    double p = product(a.low, b.low), q = product(a.low, b.high), r = product(a.high, b.low),
           s = product(a.high, b.high);
    return outward(fmin(fmin(p, q), fmin(r, s)), fmax(fmax(p, q), fmax(r, s)), 1);
}

static Interval divided(Interval a, Interval b)
{
    if (b.low == 0 && b.high == 0) {
        Interval r = a.low != 0 || a.high != 0 ? interval_of(-INFINITY, INFINITY) : interval_empty();
        r.partial = true;
        return r;
    }
    if (b.low <= 0 && b.high >= 0) {
        Interval r = interval_of(-INFINITY, INFINITY);
        r.partial = true; // 0 / 0
        return r;
    }
    double low = INFINITY, high = -INFINITY;
    const double tops[2] = {a.low, a.high}, bottoms[2] = {b.low, b.high};
    for (int k = 0; k < 4; k++) {
        double q = tops[k & 1] == 0 ? 0 : tops[k & 1] / bottoms[k >> 1];
        if (isnan(q)) return interval_of(-INFINITY, INFINITY);
        low = fmin(low, q);
        high = fmax(high, q);
    }
    return outward(low, high, 1);
}

static Interval absolute(Interval a)
{
    if (a.low >= 0) return a;
    if (a.high <= 0) return interval_of(-a.high, -a.low);
    return interval_of(0, fmax(-a.low, a.high));
}

Interval interval_power(Interval a, uint32_t exponent)
{
    if (interval_is_empty(a)) return a;
    bool partial = a.partial;
    if (exponent % 2 == 0) a = absolute(a);
    Interval r = outward(pow(a.low, exponent), pow(a.high, exponent), 4);
    if (a.low >= 0) r.low = fmax(r.low, 0);
    r.partial = partial;
    return r;
}

// --- functions

static Interval monotone(double function(double), Interval a)
{
    return outward(function(a.low), function(a.high), 4);
}

static bool contains_turn(Interval a, double first)
{
    const double turn = 2 * M_PI;
    double low = (a.low - first) / turn, high = (a.high - first) / turn;
    double margin = 1e-14 * (1 + fabs(low) + fabs(high));
    return floor(high + margin) >= ceil(low - margin);
}

static Interval wave(double function(double), Interval a, double top)
{
    if (!(a.high - a.low < 2 * M_PI) || fabs(a.low) > 1e9 || fabs(a.high) > 1e9) return interval_of(-1, 1);
    double p = function(a.low), q = function(a.high);
    Interval r = outward(fmin(p, q), fmax(p, q), 4);
    if (contains_turn(a, top)) r.high = 1;
    if (contains_turn(a, top + M_PI)) r.low = -1;
    return interval_of(fmax(r.low, -1), fmin(r.high, 1));
}

static Interval tangent(Interval a)
{
    if (!(a.high - a.low < M_PI) || fabs(a.low) > 1e9 || fabs(a.high) > 1e9 || contains_turn(a, M_PI / 2) ||
        contains_turn(a, -M_PI / 2))
        return (Interval){-INFINITY, INFINITY, true};
    return monotone(tan, a);
}

// Inside of low … high the function is defined.
static Interval within(double function(double), Interval a, double low, double high, bool falling)
{
    if (a.high < low || a.low > high) return interval_empty();
    Interval cut = {fmax(a.low, low), fmin(a.high, high), false};
    Interval r = falling ? outward(function(cut.high), function(cut.low), 4) : monotone(function, cut);
    r.partial = a.low < low || a.high > high;
    return r;
}

static Interval logarithm(Interval a)
{
    Interval r = within(log, a, 0, INFINITY, false);
    if (a.low <= 0 && !interval_is_empty(r)) r.low = -INFINITY;
    return r;
}

static Interval root(Interval a)
{
    if (a.high < 0) return interval_empty();
    Interval r = outward(sqrt(fmax(a.low, 0)), sqrt(a.high), 1);
    r.low = fmax(r.low, 0);
    r.partial = a.low < 0;
    return r;
}

static Interval angle(Interval y, Interval x)
{
    if (x.low <= 0 && y.low <= 0 && y.high >= 0) return interval_of(-M_PI - 1e-15, M_PI + 1e-15);
    double low = INFINITY, high = -INFINITY;
    const double ys[2] = {y.low, y.high}, xs[2] = {x.low, x.high};
    for (int k = 0; k < 4; k++) {
        double r = atan2(ys[k & 1], xs[k >> 1]);
        low = fmin(low, r);
        high = fmax(high, r);
    }
    return outward(low, high, 4);
}

static Interval any_power(Interval a, Interval b)
{
    if (a.high < 0) { // whole powers of negative numbers, now and then
        Interval r = {-INFINITY, INFINITY, true};
        return r;
    }
    bool partial = a.low < 0 || (a.low <= 0 && b.low <= 0);
    Interval base = {fmax(a.low, 0), a.high, false};
    Interval exponent = multiplied(b, logarithm(base));
    if (partial && a.low < 0) return (Interval){-INFINITY, INFINITY, true};
    Interval r = monotone(exp, exponent);
    // the library's exp and log, and what the product of them adds
    double widen = 8 * DBL_EPSILON * (1 + fmax(fabs(exponent.low), fabs(exponent.high)));
    r.low = widen < 1 ? below(r.low * (1 - widen), 1) : 0;
    r.high = isfinite(widen) ? above(r.high * (1 + widen), 1) : INFINITY;
    r.low = fmax(r.low, 0);
    if (a.low <= 0 && b.high <= 0) r.high = INFINITY;
    if (a.low <= 0 && b.high >= 0) r.low = fmin(r.low, 0);
    if (b.low <= 0 && b.high >= 0) r.low = fmin(r.low, 1), r.high = fmax(r.high, 1);
    r.partial = partial;
    return r;
}

static Interval steps_of(double function(double), Interval a)
{
    return interval_of(function(a.low), function(a.high));
}

static Interval remainder_of(Interval a, Interval b)
{
    if (b.low <= 0 && b.high >= 0) {
        double most = fmax(-b.low, b.high);
        return (Interval){-most, most, true};
    }
    Interval turns = steps_of(floor, divided(a, b));
    Interval whole = b.low > 0 ? interval_of(0, b.high) : interval_of(b.low, 0);
    if (!(turns.low == turns.high)) return whole;
    Interval product = multiplied(turns, b);
    Interval r = outward(a.low - product.high, a.high - product.low, 1);
    r.low = fmax(r.low, whole.low);
    r.high = fmin(r.high, whole.high);
    return r.low <= r.high ? r : whole;
}

static double logarithm_of_sum(double a, double b)
{
    double most = fmax(a, b);
    return isinf(most) ? most : most + log1p(exp(-fabs(a - b)));
}

// --- conditions

static Interval truth(bool may_be_false, bool may_be_true)
{
    return interval_of(may_be_false ? 0 : 1, may_be_true ? 1 : 0);
}

static bool has_zero(Interval a)
{
    return a.low <= 0 && a.high >= 0;
}

static bool has_other(Interval a)
{
    return a.low != 0 || a.high != 0;
}

static double sign_of(double x)
{
    return (x > 0) - (x < 0);
}

// What is infinite may come to nothing: inf - inf, 0 inf, the sine of inf.
static bool is_endless(Interval a)
{
    return isinf(a.low) || isinf(a.high);
}

Interval interval_op1(uint32_t op, Interval a)
{
    Interval r = {-INFINITY, INFINITY, true};
    if (interval_is_empty(a)) return interval_empty();
    switch (op) {
    case TAPE_NEG: r = interval_of(-a.high, -a.low); break;
    case TAPE_ABS: r = absolute(a), r.partial = false; break;
    case TAPE_SQUARE: return interval_power(a, 2);
    case TAPE_SQRT: r = root(a); break;
    case TAPE_EXP: r = monotone(exp, a), r.low = fmax(r.low, 0); break;
    case TAPE_LOG: r = logarithm(a); break;
    case TAPE_SIN: r = wave(sin, a, M_PI / 2); break;
    case TAPE_COS: r = wave(cos, a, 0); break;
    case TAPE_TAN: r = tangent(a); break;
    case TAPE_ASIN: r = within(asin, a, -1, 1, false); break;
    case TAPE_ACOS: r = within(acos, a, -1, 1, true); break;
    case TAPE_ATAN: r = monotone(atan, a); break;
    case TAPE_FLOOR: r = steps_of(floor, a); break;
    case TAPE_CEIL: r = steps_of(ceil, a); break;
    case TAPE_ROUND: r = steps_of(round, a); break;
    case TAPE_SIGN: r = steps_of(sign_of, a); break;
    case TAPE_NOT: r = truth(has_other(a), has_zero(a)); break;
    default: break;
    }
    r.partial |= a.partial || ((op == TAPE_SIN || op == TAPE_COS || op == TAPE_TAN) && is_endless(a));
    return r;
}

Interval interval_op2(uint32_t op, Interval a, Interval b)
{
    Interval r = {-INFINITY, INFINITY, true};
    if ((op == TAPE_AND || op == TAPE_OR) && interval_is_empty(b)) b = (Interval){0, 1, true}; // the left may decide
    if (interval_is_empty(a) || interval_is_empty(b)) return interval_empty();
    switch (op) {
    case TAPE_ADD: r = outward(a.low + b.low, a.high + b.high, 1); break;
    case TAPE_SUB: r = outward(a.low - b.high, a.high - b.low, 1); break;
    case TAPE_BACK_SUB: r = outward(b.low - a.high, b.high - a.low, 1); break;
    case TAPE_MUL: r = multiplied(a, b); break;
    case TAPE_DIV: r = divided(a, b); break;
    case TAPE_BACK_DIV: r = divided(b, a); break;
    case TAPE_MIN: r = interval_of(fmin(a.low, b.low), fmin(a.high, b.high)); break;
    case TAPE_MAX: r = interval_of(fmax(a.low, b.low), fmax(a.high, b.high)); break;
    case TAPE_LSE:
        r = outward(logarithm_of_sum(a.low, b.low), logarithm_of_sum(a.high, b.high), 8);
        r.low -= 1e-15;
        r.high += 1e-15;
        break;
    case TAPE_POW: r = any_power(a, b); break;
    case TAPE_ATAN2: r = angle(a, b); break;
    case TAPE_MOD: r = remainder_of(a, b); break;
    case TAPE_LT: r = truth(a.high >= b.low, a.low < b.high); break;
    case TAPE_LE: r = truth(a.high > b.low, a.low <= b.high); break;
    case TAPE_EQ:
        r = truth(!(a.low == a.high && b.low == b.high && a.low == b.low), a.low <= b.high && b.low <= a.high);
        break;
    case TAPE_AND: r = truth(has_zero(a) || has_zero(b), has_other(a) && has_other(b)); break;
    case TAPE_OR: r = truth(has_zero(a) && has_zero(b), has_other(a) || has_other(b)); break;
    default: break;
    }
    bool arithmetic = op <= TAPE_BACK_DIV || op == TAPE_POW || op == TAPE_MOD;
    r.partial |= a.partial || b.partial || (arithmetic && (is_endless(a) || is_endless(b)));
    return r;
}

Interval interval_select(Interval condition, Interval a, Interval b)
{
    if (interval_is_empty(condition)) return interval_empty();
    Interval r = !has_zero(condition) ? a : !has_other(condition) ? b : interval_hull(a, b);
    r.partial |= condition.partial;
    return r;
}

// About the value in the middle, by the steepest slope that there is: kernels/noise.cl has the numbers.
Interval interval_op3(uint32_t op, const Interval place[3])
{
    double middle[3], away = 0, steepest = op == TAPE_NOISE ? 3.7 : 1, low = op == TAPE_NOISE ? -1 : 0;
    bool partial = false;
    for (int k = 0; k < 3; k++) {
        if (interval_is_empty(place[k])) return interval_empty();
        partial |= place[k].partial || is_endless(place[k]);
        middle[k] = place[k].low / 2 + place[k].high / 2;
        away += fmax(place[k].high - middle[k], middle[k] - place[k].low);
    }
    away = 1.000001 * steepest * away + 1e-14;
    if (!(away < 2)) return (Interval){low, 1, partial};
    double f = op == TAPE_NOISE ? noise_gradient(middle[0], middle[1], middle[2])
                                : noise_cells(middle[0], middle[1], middle[2]);
    return (Interval){fmax(f - away, low), fmin(f + away, 1), partial};
}
