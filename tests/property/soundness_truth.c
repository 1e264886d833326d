#include "tests/property/soundness_truth.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "tests/oracle/oracle_noise.h"

// --- pairs

static Pair grown(Real low, Real high)
{
    Real by = 8 * LDBL_EPSILON;
    return (Pair){low - by * fabsl(low) - LDBL_MIN, high + by * fabsl(high) + LDBL_MIN};
}

static Pair pair(Real x)
{
    return (Pair){x, x};
}

static Pair minus(Pair a)
{
    return (Pair){-a.high, -a.low};
}

static Pair plus(Pair a, Pair b)
{
    return grown(a.low + b.low, a.high + b.high);
}

static Pair times(Pair a, Pair b)
{
    Real p = a.low * b.low, q = a.low * b.high, r = a.high * b.low, s = a.high * b.high;
    return grown(fminl(fminl(p, q), fminl(r, s)), fmaxl(fmaxl(p, q), fmaxl(r, s)));
}

static bool has_zero(Pair a)
{
    return a.low <= 0 && a.high >= 0;
}

static bool is_zero(Pair a)
{
    return a.low == 0 && a.high == 0;
}

static Pair over(Pair a, Pair b) // b does not have 0
{
    return times(a, grown(1 / b.high, 1 / b.low));
}

static Pair rising(Real f(Real), Pair a)
{
    return grown(f(a.low), f(a.high));
}

// Of a function whose slope is within -1 … 1.
static Pair gentle(Real f(Real), Pair a)
{
    Real middle = a.low + (a.high - a.low) / 2, by = (a.high - a.low) + 8 * LDBL_EPSILON;
    return (Pair){f(middle) - by, f(middle) + by};
}

static Pair whole_power(Pair a, uint32_t n)
{
    Pair r = pair(1);
    for (; n; n >>= 1) {
        if (n & 1) r = times(r, a);
        a = times(a, a);
    }
    return r;
}

// --- values

Truth truth_number(Real value, Real derivative)
{
    return (Truth){TRUTH_KNOWN, pair(value), pair(derivative), true, true};
}

Truth truth_ahead(float o, float e, float s)
{
    Truth r = truth_number(0, e);
    r.f = e == 0 || s == 0 ? pair(o) : plus(pair(o), times(pair(s), pair(e)));
    return r;
}

static Truth state(TruthState s)
{
    return (Truth){.state = s};
}

static Truth known(Pair f, Pair slope, Truth a)
{
    return (Truth){TRUTH_KNOWN, f, is_zero(a.d) ? pair(0) : times(slope, a.d), a.smooth, true};
}

// A value that stays the same around the point, if `smooth`.
static Truth flat(Real f, bool smooth)
{
    Truth r = truth_number(f, 0);
    r.smooth = smooth;
    return r;
}

static Truth step_down(Real f(Real), Pair a)
{
    if (f(a.low) != f(a.high)) return state(TRUTH_UNSETTLED);
    Real beside = 1e-12L * (1 + fabsl(a.low));
    return flat(f(a.low), f(a.low - beside) == f(a.high + beside));
}

static Truth quotient(Truth a, Truth b)
{
    if (is_zero(b.f) && is_zero(a.f)) return state(TRUTH_UNDEFINED);
    if (is_zero(b.f) && !has_zero(a.f)) return state(TRUTH_INFINITE);
    if (has_zero(b.f)) return state(TRUTH_UNSETTLED);
    Truth r = known(over(a.f, b.f), pair(1), a);
    r.d = over(plus(a.d, minus(times(r.f, b.d))), b.f);
    r.smooth = a.smooth && b.smooth;
    return r;
}

// Of a negative number there is a power only where the exponent is known to be whole: then it is TAPE_POWER.
static Truth any_power(Truth a, Truth b)
{
    if (a.f.high < 0) return state(TRUTH_UNDEFINED);
    if (is_zero(a.f) && b.f.low > 0) return flat(0, false);
    if (is_zero(a.f) && b.f.high < 0) return state(TRUTH_INFINITE);
    if (a.f.low <= 0) return state(TRUTH_UNSETTLED);
    Pair log_a = rising(logl, a.f);
    Truth r = known(rising(expl, times(b.f, log_a)), pair(1), a);
    r.d = times(r.f, plus(times(b.d, log_a), times(b.f, over(a.d, a.f))));
    r.smooth = a.smooth && b.smooth;
    return r;
}

static Truth power(Truth a, int32_t n)
{
    if (n == 0) return flat(1, true);
    if (n < 0) return quotient(flat(1, true), power(a, -n));
    Pair f = whole_power(a.f, (uint32_t)n);
    if (n % 2 == 0 && f.low < 0) f.low = 0;
    return known(f, times(pair(n), whole_power(a.f, (uint32_t)n - 1)), a);
}

static Truth remainder_of(Truth a, Truth b)
{
    Real floors[2];
    if (is_zero(b.f)) return state(TRUTH_UNDEFINED);
    if (has_zero(b.f)) return state(TRUTH_UNSETTLED);
    bool exact = a.f.low == a.f.high && b.f.low == b.f.high, whole = false;
    if (exact) { // fmodl() is
        Real r = fmodl(a.f.low, b.f.low);
        whole = r == 0;
        if (r != 0 && (r < 0) != (b.f.low < 0)) r += b.f.low;
        floors[0] = floors[1] = rintl((a.f.low - r) / b.f.low);
        if (!(fabsl(floors[0]) < 0x1p60L)) return state(TRUTH_UNSETTLED);
    } else {
        Pair q = over(a.f, b.f);
        floors[0] = floorl(q.low);
        floors[1] = floorl(q.high);
    }
    if (floors[0] != floors[1]) return state(TRUTH_UNSETTLED);
    Pair k = pair(floors[0]);
    Truth r = known(plus(a.f, minus(times(k, b.f))), pair(1), a);
    if (b.f.low > 0)
        r.f = (Pair){fmaxl(r.f.low, 0), fminl(r.f.high, b.f.high)};
    else
        r.f = (Pair){fmaxl(r.f.low, b.f.low), fminl(r.f.high, 0)};
    r.d = plus(a.d, minus(times(k, b.d)));
    r.smooth = a.smooth && b.smooth && !whole;
    return r;
}

static Truth angle(Truth y, Truth x)
{
    if (x.f.low <= 0 && has_zero(y.f)) return state(TRUTH_UNSETTLED); // pi or -pi, as the sign of a zero is
    Real p = atan2l(y.f.low, x.f.low), q = atan2l(y.f.low, x.f.high), r = atan2l(y.f.high, x.f.low),
         s = atan2l(y.f.high, x.f.high);
    Truth t = known(grown(fminl(fminl(p, q), fminl(r, s)), fmaxl(fmaxl(p, q), fmaxl(r, s))), pair(1), y);
    Pair square = plus(times(x.f, x.f), times(y.f, y.f));
    t.smooth = x.smooth && y.smooth && square.low > 0;
    if (t.smooth) t.d = over(plus(times(x.f, y.d), minus(times(y.f, x.d))), square);
    return t;
}

static Truth logarithm_of_sum(Truth a, Truth b)
{
    Pair most = {fmaxl(a.f.low, b.f.low), fmaxl(a.f.high, b.f.high)};
    Pair rest = plus(rising(expl, plus(a.f, minus(most))), rising(expl, plus(b.f, minus(most))));
    Truth r = known(plus(most, rising(logl, rest)), pair(1), a);
    Pair share = over(pair(1), plus(pair(1), rising(expl, plus(b.f, minus(a.f)))));
    r.d = plus(times(share, a.d), times(plus(pair(1), minus(share)), b.d));
    r.smooth = a.smooth && b.smooth;
    return r;
}

static Truth lesser(Truth a, Truth b)
{
    Truth r = a.f.high < b.f.low ? a : b;
    if (a.f.high < b.f.low || b.f.high < a.f.low) return r;
    r.f = (Pair){fminl(a.f.low, b.f.low), fminl(a.f.high, b.f.high)};
    r.smooth = false;
    return r;
}

static Truth negated(Truth a)
{
    a.f = minus(a.f);
    a.d = minus(a.d);
    return a;
}

// -1: not known.
static int truth_less(Pair a, Pair b, bool or_equal)
{
    if (a.high < b.low) return 1;
    if (a.low > b.high) return 0;
    if (a.low == a.high && b.low == b.high) return or_equal; // equal
    return -1;
}

static Truth condition(int answer, bool smooth)
{
    return answer < 0 ? state(TRUTH_UNSETTLED) : flat(answer, smooth);
}

static Truth lazy(uint32_t op, Truth a, Truth b)
{
    if (a.state == TRUTH_UNDEFINED) return a;
    if (a.state != TRUTH_KNOWN || (has_zero(a.f) && !is_zero(a.f))) return state(TRUTH_UNSETTLED);
    if (is_zero(a.f) == (op == TAPE_AND)) return flat(op == TAPE_OR, a.smooth);
    if (b.state == TRUTH_UNDEFINED) return b;
    if (b.state != TRUTH_KNOWN || (has_zero(b.f) && !is_zero(b.f))) return state(TRUTH_UNSETTLED);
    return flat(!is_zero(b.f), a.smooth && b.smooth && !is_zero(b.f) && !is_zero(a.f));
}

static Truth chosen(Truth c, Truth a, Truth b)
{
    if (c.state == TRUTH_UNDEFINED) return c;
    if (c.state != TRUTH_KNOWN || (has_zero(c.f) && !is_zero(c.f))) return state(TRUTH_UNSETTLED);
    Truth r = is_zero(c.f) ? b : a;
    r.smooth &= c.smooth && (is_zero(c.d) || !is_zero(c.f));
    return r;
}

static Truth arcus(uint32_t op, Truth a)
{
    if (a.f.low > 1 || a.f.high < -1) return state(TRUTH_UNDEFINED);
    if (a.f.low < -1 || a.f.high > 1) return state(TRUTH_UNSETTLED);
    Pair rest = plus(pair(1), minus(times(a.f, a.f)));
    Truth r = known(op == TAPE_ASIN ? rising(asinl, a.f) : minus(rising(acosl, minus(a.f))), pair(1), a);
    if (op == TAPE_ACOS) r.f = grown(acosl(a.f.high), acosl(a.f.low));
    r.smooth = a.smooth && rest.low > 0;
    if (!r.smooth) return r;
    Pair slope = over(pair(1), rising(sqrtl, rest));
    r.d = times(op == TAPE_ASIN ? slope : minus(slope), a.d);
    return r;
}

static Truth unary(uint32_t op, Truth a)
{
    Truth r;
    switch (op) {
    case TAPE_NEG: return negated(a);
    case TAPE_ABS:
        if (!has_zero(a.f)) return a.f.low < 0 ? negated(a) : a;
        a.smooth = false;
        a.f = (Pair){0, fmaxl(-a.f.low, a.f.high)};
        return a;
    case TAPE_SQUARE:
        r = known(times(a.f, a.f), times(pair(2), a.f), a);
        r.f.low = fmaxl(r.f.low, 0);
        return r;
    case TAPE_SQRT:
        if (a.f.high < 0) return state(TRUTH_UNDEFINED);
        if (is_zero(a.f)) return flat(0, false);
        if (a.f.low <= 0) return state(TRUTH_UNSETTLED);
        r.f = rising(sqrtl, a.f);
        return known(r.f, over(pair(0.5L), r.f), a);
    case TAPE_EXP: return known(rising(expl, a.f), rising(expl, a.f), a);
    case TAPE_LOG:
        if (a.f.high < 0) return state(TRUTH_UNDEFINED);
        if (is_zero(a.f)) return state(TRUTH_INFINITE);
        if (a.f.low <= 0) return state(TRUTH_UNSETTLED);
        return known(rising(logl, a.f), over(pair(1), a.f), a);
    case TAPE_SIN: return known(gentle(sinl, a.f), gentle(cosl, a.f), a);
    case TAPE_COS: return known(gentle(cosl, a.f), minus(gentle(sinl, a.f)), a);
    case TAPE_TAN: {
        Pair c = gentle(cosl, a.f);
        if (has_zero(c) || a.f.high - a.f.low > 1) return state(TRUTH_UNSETTLED);
        r.f = rising(tanl, a.f);
        return known(r.f, plus(pair(1), times(r.f, r.f)), a);
    }
    case TAPE_ASIN:
    case TAPE_ACOS: return arcus(op, a);
    case TAPE_ATAN: return known(rising(atanl, a.f), over(pair(1), plus(pair(1), times(a.f, a.f))), a);
    case TAPE_FLOOR: return step_down(floorl, a.f);
    case TAPE_CEIL: return step_down(ceill, a.f);
    case TAPE_ROUND: return step_down(roundl, a.f);
    case TAPE_SIGN:
        return has_zero(a.f) ? (is_zero(a.f) ? flat(0, false) : state(TRUTH_UNSETTLED))
                             : flat(a.f.low > 0 ? 1 : -1, true);
    case TAPE_NOT:
        return has_zero(a.f) && !is_zero(a.f) ? state(TRUTH_UNSETTLED)
                                              : flat(is_zero(a.f), is_zero(a.f) ? false : a.smooth);
    default: return state(TRUTH_UNSETTLED);
    }
}

static Truth binary(uint32_t op, Truth a, Truth b)
{
    Truth r;
    bool smooth = a.smooth && b.smooth;
    switch (op) {
    case TAPE_ADD:
    case TAPE_SUB:
    case TAPE_BACK_SUB:
        if (op == TAPE_SUB) b = negated(b);
        if (op == TAPE_BACK_SUB) a = negated(a);
        r = known(plus(a.f, b.f), pair(1), a);
        r.d = plus(a.d, b.d);
        r.smooth = smooth;
        return r;
    case TAPE_MUL:
        r = known(times(a.f, b.f), b.f, a);
        r.d = plus(r.d, times(a.f, b.d));
        r.smooth = smooth;
        return r;
    case TAPE_DIV: return quotient(a, b);
    case TAPE_BACK_DIV: return quotient(b, a);
    case TAPE_MIN: return lesser(a, b);
    case TAPE_MAX: return negated(lesser(negated(a), negated(b)));
    case TAPE_POW: return any_power(a, b);
    case TAPE_LSE: return logarithm_of_sum(a, b);
    case TAPE_ATAN2: return angle(a, b);
    case TAPE_MOD: return remainder_of(a, b);
    case TAPE_LT: return condition(truth_less(a.f, b.f, false), a.f.high < b.f.low || a.f.low > b.f.high);
    case TAPE_LE: return condition(truth_less(a.f, b.f, true), a.f.high < b.f.low || a.f.low > b.f.high);
    case TAPE_EQ: {
        int at_most = truth_less(a.f, b.f, true), less = truth_less(a.f, b.f, false);
        return condition(at_most < 0 ? -1 : at_most && !less, a.f.high < b.f.low || a.f.low > b.f.high);
    }
    default: return state(TRUTH_UNSETTLED);
    }
}

static bool takes_two(uint32_t op)
{
    return (op >= TAPE_ADD && op <= TAPE_MAX) || op == TAPE_POW || op == TAPE_ATAN2 || op == TAPE_MOD ||
           op == TAPE_LSE || (op >= TAPE_LT && op <= TAPE_OR);
}

// --- noise

static Truth noise(uint32_t op, Truth x, Truth y, Truth z)
{
    const Truth *at[3] = {&x, &y, &z};
    Real p[3], slopes[3], width = 8 * LDBL_EPSILON;
    bool alone = true, level = true;
    for (int k = 0; k < 3; k++) {
        if (at[k]->state == TRUTH_UNDEFINED) return state(TRUTH_UNDEFINED);
    }
    for (int k = 0; k < 3; k++) {
        if (at[k]->state != TRUTH_KNOWN) return state(TRUTH_UNSETTLED);
        p[k] = at[k]->f.low + (at[k]->f.high - at[k]->f.low) / 2;
        width += at[k]->f.high - at[k]->f.low;
        level &= is_zero(at[k]->d);
    }
    if (!(width < 1e-6L)) return state(TRUTH_UNSETTLED);
    Real f = op == TAPE_NOISE ? oracle_noise(p, slopes) : oracle_cells(p, slopes, &alone);
    Truth r = truth_number(0, 0);
    r.f = (Pair){f - 4 * width, f + 4 * width};
    r.smooth = x.smooth && y.smooth && z.smooth && (alone || level);
    for (int k = 0; k < 3; k++) {
        Real by = op == TAPE_NOISE ? 40 * width : 1e6L * width;
        r.d = plus(r.d, times((Pair){slopes[k] - by, slopes[k] + by}, at[k]->d));
    }
    return r;
}

static Truth step_of(TapeStep step, const Truth *v)
{
    uint32_t op = TAPE_OP(step.word);
    float literal;
    memcpy(&literal, &step.b, sizeof literal);
    Truth a = v[TAPE_A(step.word)], b = truth_number(0, 0);
    if (op == TAPE_NUMBER) return truth_number(literal, 0);
    if (op == TAPE_SELECT) return chosen(a, v[step.b & 0xffff], v[step.b >> 16]);
    if (TAPE_TAKES_THREE(op)) return noise(op, a, v[step.b & 0xffff], v[step.b >> 16]);
    if (takes_two(op)) b = step.word & TAPE_LITERAL ? truth_number(literal, 0) : v[step.b];
    if (op == TAPE_AND || op == TAPE_OR) return lazy(op, a, b);
    if (a.state == TRUTH_UNDEFINED || b.state == TRUTH_UNDEFINED) return state(TRUTH_UNDEFINED);
    if (a.state != TRUTH_KNOWN || b.state != TRUTH_KNOWN) return state(TRUTH_UNSETTLED);
    return op == TAPE_POWER ? power(a, (int32_t)step.b) : takes_two(op) ? binary(op, a, b) : unary(op, a);
}

static bool is_ordinary(Pair f)
{
    return f.high <= 1e37L && f.low >= -1e37L && (f.low >= 1e-36L || f.high <= -1e-36L || is_zero(f));
}

Truth truth_of(const TapeStep *steps, uint32_t count, Truth *v)
{
    bool ordinary = true;
    for (int k = 0; k < 3; k++) ordinary &= is_ordinary(v[k].f);
    for (uint32_t k = 0; k < count; k++) {
        Truth r = step_of(steps[k], v);
        if (r.state == TRUTH_KNOWN && !(isfinite(r.f.low) && isfinite(r.f.high))) r = state(TRUTH_UNSETTLED);
        r.smooth &= isfinite(r.d.low) && isfinite(r.d.high);
        ordinary &= r.state == TRUTH_KNOWN ? is_ordinary(r.f) : r.state != TRUTH_INFINITE;
        v[TAPE_POINT + k] = r;
    }
    Truth last = v[TAPE_POINT + count - 1];
    last.ordinary = ordinary;
    return last;
}
