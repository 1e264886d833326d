// Tapes (tape_shared.h) evaluated: at points, over boxes, and with the gradient; over pieces of rays strip.cl evaluates them.
//
// Ranges are rounded outwards after every operation, by what OpenCL's full profile allows the operation to be wrong: half a unit in the last place
// for sums and products, 2.5 for quotients, 3 for roots, exponentials and logarithms, 4 for sines, arcus sines and cosines, 5 for tangents and arcus
// tangents, 6 for atan2. An end that is not a number or too large is infinite. So the range of a tape holds every value that the expression, with the
// tape's numbers, has for real numbers there. What may be undefined, and what certainly is, is kept by lane.
//
// What PoCL 3.1 was seen to be wrong by, in units in the last place of the result, at the points and, of ranges at a place, in their middle (scn-soundness
// --points 1000000 --verbose, which fails beyond what stands here as allowed):
//
//     + - * / square        0.5    allowed 0.5, quotients 1       exp, log      0.85, 0.54   1.5
//     min max neg abs …     exact  0                              asin, acos    0.61, 0.60   1.5
//     sqrt                  0.54   1                              atan, atan2   0.80, 0.76   1.5
//     sin, cos (to 10^4)    1.4    2                              pow           1.6 for each unit of |log of the result|, 2
//     tan (to 10^4)         3.0    4                              whole powers  0.7 for each unit of the exponent, 1
//     mod                   0.7 of the greater operand's, 1, or on the other side of its jump; lse  1.1 of 1 or of the result's, 2
//     noise, cells          1.2, 0.9 of those of 1, 4
//
// Values stand in memory of the tile (v): TAPE_POINT coordinates first.

#define LARGEST 3.402823e38f

typedef struct Tape {
    __global const TapeStep *steps;
    uint count, root; // steps; the value that is the tape's
} Tape;

#define TAPE_SHARES 0x80000000u // in a root: values share places, since few of them are needed at a time

INLINE uint place_of(const Tape *tape, TapeStep step, uint k)
{
    return tape->root & TAPE_SHARES ? TAPE_PLACE(step.word) : TAPE_POINT + k;
}

typedef struct Range {
    FLOAT low, high;
} Range;

typedef struct Doubt { // lanes
    INT maybe, never;  // undefined for some, for all of the range
} Doubt;

// PoCL 3.1 reduces all lanes of a vector by the method for large angles where one of them is larger than some 10^7, or not a number, and what that makes of
// small ones is wrong by up to four times their size. So lanes that are near are evaluated without those that are far.
#define NEAR_ALONE(name, function)                            \
    static FLOAT name##_mixed(FLOAT x) { BY_HALVES(function, x) } \
    static FLOAT name(FLOAT x)                                \
    {                                                         \
        INT far = !(size_of(x) <= 1e6f);                      \
        FLOAT zero = 0.0f, all = name##_mixed(far ? zero : x); \
        if (!ANY(far)) return all;                            \
        return far ? name##_mixed(x) : all;                   \
    }
NEAR_ALONE(each_sin, sin)
NEAR_ALONE(each_cos, cos)
NEAR_ALONE(each_tan, tan)
static FLOAT each_asin(FLOAT x) { BY_HALVES(asin, x) }
static FLOAT each_acos(FLOAT x) { BY_HALVES(acos, x) }
static FLOAT each_atan(FLOAT x) { BY_HALVES(atan, x) }
static FLOAT each_exp(FLOAT x) { BY_HALVES(exp, x) }
static FLOAT each_log(FLOAT x) { BY_HALVES(log, x) }
static FLOAT each_floor(FLOAT x) { BY_HALVES(floor, x) }
static FLOAT each_ceil(FLOAT x) { BY_HALVES(ceil, x) }
static FLOAT each_round(FLOAT x) { BY_HALVES(round, x) }
static FLOAT each_atan2(FLOAT y, FLOAT x)
{
#if LANES == 32
    FLOAT r;
    r.lo = atan2(y.lo, x.lo);
    r.hi = atan2(y.hi, x.hi);
    return r;
#else
    return atan2(y, x);
#endif
}

// --- at points

static FLOAT whole_power(FLOAT a, int n)
{
    FLOAT r = 1.0f;
    if (n == 0) return a == a ? r : a;
    for (uint k = (uint)abs(n); k; k >>= 1) {
        if (k & 1u) r *= a;
        a *= a;
    }
    return n < 0 ? 1.0f / r : r;
}

static FLOAT defined(FLOAT r, FLOAT a, FLOAT b)
{
    FLOAT nothing = NAN;
    return ((a == a) & (b == b)) ? r : nothing;
}

INLINE FLOAT truth(INT mask)
{
    FLOAT one = 1.0f, zero = 0.0f;
    return mask ? one : zero;
}

NOINLINE void rare_value(uint op, const FLOAT *pa, const FLOAT *pb, FLOAT *result)
{
    FLOAT a = *pa, b = *pb, r = NAN;
    switch (op) {
    case TAPE_POW: r = each_exp(b * each_log(a)); break;
    case TAPE_LSE: r = defined(most(a, b) + each_log(1.0f + each_exp(-size_of(a - b))), a, b); break;
    case TAPE_EXP: r = each_exp(a); break;
    case TAPE_LOG: r = each_log(a); break;
    case TAPE_SIN: r = each_sin(a); break;
    case TAPE_COS: r = each_cos(a); break;
    case TAPE_TAN: r = each_tan(a); break;
    case TAPE_ASIN: r = each_asin(a); break;
    case TAPE_ACOS: r = each_acos(a); break;
    case TAPE_ATAN: r = each_atan(a); break;
    case TAPE_ATAN2: r = each_atan2(a, b); break;
    case TAPE_MOD: { // rounding may bring it to the other side of 0, or beyond b
        FLOAT low = b < 0.0f ? b : 0.0f * b, high = b > 0.0f ? b : 0.0f * b;
        r = a - b * each_floor(a / b);
        r = r < low ? low : r;
        r = r > high ? high : r;
        break;
    }
    case TAPE_FLOOR: r = each_floor(a); break;
    case TAPE_CEIL: r = each_ceil(a); break;
    case TAPE_ROUND: r = each_round(a); break;
    case TAPE_SIGN: r = defined(truth(a > 0.0f) - truth(a < 0.0f), a, a); break;
    case TAPE_LT: r = defined(truth(a < b), a, b); break;
    case TAPE_LE: r = defined(truth(a <= b), a, b); break;
    case TAPE_EQ: r = defined(truth(a == b), a, b); break;
    case TAPE_AND: r = (a == 0.0f) ? a : defined(truth(b != 0.0f), a, b); break;
    case TAPE_OR: r = ((a == a) & (a != 0.0f)) ? truth(a == a) : defined(truth(b != 0.0f), a, b); break;
    case TAPE_NOT: r = defined(truth(a == 0.0f), a, a); break;
    default: break;
    }
    *result = r;
}

NOINLINE void tape_value(const Tape *tape, const FLOAT *point, __global FLOAT *v, FLOAT *result)
{
    for (uint k = 0; k < TAPE_POINT; k++) v[k] = point[k];
    for (uint k = 0; k < tape->count; k++) {
        TapeStep step = tape->steps[k];
        FLOAT a = v[TAPE_A(step.word)], b = as_float(step.b), r;
        uint op = TAPE_OP(step.word);
        if (!(step.word & TAPE_LITERAL) && op <= TAPE_MAX && op) b = v[step.b];
        switch (op) {
        case TAPE_NUMBER: r = b; break;
        case TAPE_ADD: r = a + b; break;
        case TAPE_SUB: r = a - b; break;
        case TAPE_BACK_SUB: r = b - a; break;
        case TAPE_MUL: r = a * b; break;
        case TAPE_DIV: r = a / b; break;
        case TAPE_BACK_DIV: r = b / a; break;
        case TAPE_MIN:
            r = b < a ? b : a;
            r = b == b ? r : b;
            break;
        case TAPE_MAX:
            r = b > a ? b : a;
            r = b == b ? r : b;
            break;
        case TAPE_NEG: r = -a; break;
        case TAPE_ABS: r = a < 0.0f ? -a : a; break;
        case TAPE_SQUARE: r = a * a; break;
        case TAPE_SQRT: r = root(a); break;
        case TAPE_POWER: r = whole_power(a, (int)step.b); break;
        case TAPE_SELECT: {
            FLOAT nothing = NAN;
            r = a != 0.0f ? v[step.b & 0xffffu] : v[step.b >> 16];
            r = a == a ? r : nothing;
            break;
        }
        case TAPE_NOISE:
        case TAPE_CELLS: {
            FLOAT place[3] = {a, v[step.b & 0xffffu], v[step.b >> 16]};
            Noise noise;
            noise_value(op, place, &noise);
            r = noise.f;
            break;
        }
        default:
            if (!(step.word & TAPE_LITERAL) && (op == TAPE_POW || op == TAPE_ATAN2 || op == TAPE_MOD || op == TAPE_LSE || (op >= TAPE_LT && op <= TAPE_OR))) b = v[step.b];
            {
                FLOAT x = a, y = b, z; // copies: what a function can reach stays in memory
                rare_value(op, &x, &y, &z);
                r = z;
            }
            break;
        }
        v[place_of(tape, step, k)] = r;
    }
    *result = v[tape->root & 0xffffu];
}

// --- ranges

// What is infinite on the wrong side, or not a number, becomes infinite on the right one.
INLINE FLOAT below(FLOAT x, float units)
{
    FLOAT none = -INFINITY;
    x -= size_of(x) * (units * 1.2e-7f) + 1.2e-38f;
    return x == x ? x : none;
}

INLINE FLOAT above(FLOAT x, float units)
{
    FLOAT none = INFINITY;
    x += size_of(x) * (units * 1.2e-7f) + 1.2e-38f;
    return x == x ? x : none;
}

INLINE Range outward(FLOAT low, FLOAT high, float units)
{
    return (Range){below(low, units), above(high, units)};
}

// An infinite end is not reached, so 0 times it is 0.
INLINE FLOAT product(FLOAT a, FLOAT b)
{
    FLOAT p = a * b, zero = 0.0f;
    return p == p ? p : zero;
}

// Sums, differences and products rounded down and up: by the processor where it can, else as below() and above() do. An end is never infinite on the wrong
// side, so no sum of two lower or of two upper ends is undefined.
#ifdef HAS_DIRECTED
#define BY_HALVES_DIRECTED(operation, a, b, way)    \
    FLOAT result;                                   \
    result.lo = operation((a).lo, (b).lo, way);     \
    result.hi = operation((a).hi, (b).hi, way);     \
    return result;
#if LANES == 16
#undef BY_HALVES_DIRECTED
#define BY_HALVES_DIRECTED(operation, a, b, way) return operation(a, b, way);
#endif
#define DOWN 9 // towards -infinity, without exceptions
#define UP 10
INLINE FLOAT sum_below(FLOAT a, FLOAT b) { BY_HALVES_DIRECTED(__builtin_ia32_addps512, a, b, DOWN) }
INLINE FLOAT sum_above(FLOAT a, FLOAT b) { BY_HALVES_DIRECTED(__builtin_ia32_addps512, a, b, UP) }
INLINE FLOAT difference_below(FLOAT a, FLOAT b) { BY_HALVES_DIRECTED(__builtin_ia32_subps512, a, b, DOWN) }
INLINE FLOAT difference_above(FLOAT a, FLOAT b) { BY_HALVES_DIRECTED(__builtin_ia32_subps512, a, b, UP) }
INLINE FLOAT product_below(FLOAT a, FLOAT b) { BY_HALVES_DIRECTED(__builtin_ia32_mulps512, a, b, DOWN) }
INLINE FLOAT product_above(FLOAT a, FLOAT b) { BY_HALVES_DIRECTED(__builtin_ia32_mulps512, a, b, UP) }
#else
INLINE FLOAT sum_below(FLOAT a, FLOAT b) { return below(a + b, 1.0f); }
INLINE FLOAT sum_above(FLOAT a, FLOAT b) { return above(a + b, 1.0f); }
INLINE FLOAT difference_below(FLOAT a, FLOAT b) { return below(a - b, 1.0f); }
INLINE FLOAT difference_above(FLOAT a, FLOAT b) { return above(a - b, 1.0f); }
INLINE FLOAT product_below(FLOAT a, FLOAT b) { return below(product(a, b), 1.0f); }
INLINE FLOAT product_above(FLOAT a, FLOAT b) { return above(product(a, b), 1.0f); }
#endif

INLINE Range range_everything(void)
{
    FLOAT low = -INFINITY, high = INFINITY;
    return (Range){low, high};
}

INLINE Range range_choose(INT mask, Range a, Range b)
{
    return (Range){mask ? a.low : b.low, mask ? a.high : b.high};
}

INLINE Range range_hull(Range a, Range b)
{
    return (Range){least(a.low, b.low), most(a.high, b.high)};
}

INLINE Range range_add(Range a, Range b)
{
    return (Range){sum_below(a.low, b.low), sum_above(a.high, b.high)};
}

INLINE Range range_sub(Range a, Range b)
{
    return (Range){difference_below(a.low, b.high), difference_above(a.high, b.low)};
}

INLINE Range range_mul(Range a, Range b)
{
#ifdef HAS_DIRECTED
    FLOAT p = product_below(a.low, b.low), q = product_below(a.low, b.high), r = product_below(a.high, b.low), s = product_below(a.high, b.high);
    FLOAT zero = 0.0f;
    INT odd = (p != p) | (q != q) | (r != r) | (s != s); // infinite times 0
    Range result = {least(least(p, q), least(r, s)), most(most(product_above(a.low, b.low), product_above(a.low, b.high)),
                                                          most(product_above(a.high, b.low), product_above(a.high, b.high)))};
    if (!ANY(odd)) return result;
    p = p == p ? p : zero;
    q = q == q ? q : zero;
    r = r == r ? r : zero;
    s = s == s ? s : zero;
    Range careful = outward(least(least(p, q), least(r, s)), most(most(p, q), most(r, s)), 1.0f);
    return (Range){odd ? careful.low : result.low, odd ? careful.high : result.high};
#else
    FLOAT p = product(a.low, b.low), q = product(a.low, b.high), r = product(a.high, b.low), s = product(a.high, b.high);
    return outward(least(least(p, q), least(r, s)), most(most(p, q), most(r, s)), 1.0f);
#endif
}

INLINE Range range_scale(Range a, float b)
{
    FLOAT factor = b, zero = 0.0f;
    if (b == 0.0f) return (Range){zero, zero};
    return b < 0.0f ? (Range){product_below(a.high, factor), product_above(a.low, factor)} : (Range){product_below(a.low, factor), product_above(a.high, factor)};
}

INLINE INT has_zero(Range a)
{
    return (a.low <= 0.0f) & (a.high >= 0.0f);
}

NOINLINE Range range_div(Range a, Range b)
{
    FLOAT p = a.low / b.low, q = a.low / b.high, r = a.high / b.low, s = a.high / b.high;
    Range result = outward(least(least(p, q), least(r, s)), most(most(p, q), most(r, s)), 3.0f);
    INT bad = has_zero(b) | (p != p) | (q != q) | (r != r) | (s != s);
    return range_choose(bad, range_everything(), result);
}

// Whether the inverse of a number is a float with all its digits: dividing by it is a product.
INLINE int has_inverse(float b)
{
    return fabs(b) > 1e-37f && fabs(b) < 1e37f;
}

INLINE Range range_over(Range a, float b)
{
    float inverse = 1.0f / b;
    return inverse < 0.0f ? outward(inverse * a.high, inverse * a.low, 3.0f) : outward(inverse * a.low, inverse * a.high, 3.0f);
}

INLINE Range range_square(Range a)
{
    FLOAT zero = 0.0f, near = least(size_of(a.low), size_of(a.high)), far = most(size_of(a.low), size_of(a.high));
    return (Range){has_zero(a) ? zero : most(product_below(near, near), zero), product_above(far, far)};
}

INLINE Range range_abs(Range a)
{
    FLOAT zero = 0.0f;
    return (Range){has_zero(a) ? zero : most(a.low, -a.high), most(-a.low, a.high)};
}

INLINE Range range_root(Range a)
{
    FLOAT zero = 0.0f, tiny = 1.2e-38f; // below it the step of Newton in root() has no digits
    Range r = outward(root(most(a.low, tiny)), root(most(a.high, tiny)), 4.0f);
    r.low = a.low < tiny ? zero : r.low;
    return r;
}

static Range range_exp(Range a)
{
    Range r = outward(each_exp(a.low), each_exp(a.high), 4.0f);
    r.low = most(r.low, 0.0f);
    return r;
}

static Range range_log(Range a)
{
    FLOAT none = -INFINITY;
    Range r = outward(each_log(most(a.low, 0.0f)), each_log(most(a.high, 0.0f)), 4.0f);
    r.low = a.low > 0.0f ? r.low : none;
    return r;
}

// The whole power n of both ends keeps their order, or is even.
static Range range_power(Range a, int n)
{
    float units = 1.0f + (float)abs(n);
    FLOAT one = 1.0f, zero = 0.0f;
    if (n == 0) return (Range){one, one};
    Range base = (n & 1) ? a : range_abs(a);
    Range r = outward(whole_power(base.low, abs(n)), whole_power(base.high, abs(n)), units);
    if (!(n & 1)) r.low = most(r.low, zero);
    return n < 0 ? range_div((Range){one, one}, r) : r;
}

// Whether the range holds first + a whole number of turns.
static INT has_turn(Range a, float first)
{
    FLOAT low = (a.low - first) * 0.15915494f, high = (a.high - first) * 0.15915494f;
    FLOAT margin = 1e-6f * (1.0f + size_of(low) + size_of(high));
    return each_floor(high + margin) >= each_ceil(low - margin);
}

static Range range_wave(Range a, float top, FLOAT p, FLOAT q)
{
    FLOAT one = 1.0f, minus = -1.0f;
    Range r = outward(least(p, q), most(p, q), 5.0f);
    INT far = (INT)!(a.high - a.low < 6.28f) | (size_of(a.low) > 1e4f) | (size_of(a.high) > 1e4f);
    r.high = (far | has_turn(a, top)) ? one : least(r.high, one);
    r.low = (far | has_turn(a, top + 3.1415927f)) ? minus : most(r.low, minus);
    return r;
}

static Range range_sin(Range a)
{
    return range_wave(a, 1.5707963f, each_sin(a.low), each_sin(a.high));
}

static Range range_cos(Range a)
{
    return range_wave(a, 0.0f, each_cos(a.low), each_cos(a.high));
}

static INT has_pole(Range a) // of the tangent
{
    return (INT)!(a.high - a.low < 3.14f) | (size_of(a.low) > 1e4f) | (size_of(a.high) > 1e4f) | has_turn(a, 1.5707963f) | has_turn(a, -1.5707963f);
}

static Range range_atan2(Range y, Range x)
{
    FLOAT p = each_atan2(y.low, x.low), q = each_atan2(y.low, x.high), r = each_atan2(y.high, x.low), s = each_atan2(y.high, x.high);
    FLOAT low = -3.1415930f, high = 3.1415930f;
    Range result = outward(least(least(p, q), least(r, s)), most(most(p, q), most(r, s)), 8.0f);
    return range_choose((x.low <= 0.0f) & has_zero(y), (Range){low, high}, result);
}

static Range range_mod(Range a, Range b)
{
    FLOAT zero = 0.0f;
    Range turns = range_div(a, b);
    turns.low = each_floor(turns.low);
    turns.high = each_floor(turns.high);
    Range r = range_sub(a, range_mul(turns, b));
    Range whole = {least(b.low, zero), most(b.high, zero)};
    INT near = (turns.low == turns.high) & !has_zero(b);
    r.low = most(r.low, whole.low);
    r.high = least(r.high, whole.high);
    return range_choose(near & (r.low <= r.high), r, whole);
}

static Range range_truth(INT may_be_false, INT may_be_true)
{
    FLOAT zero = 0.0f, one = 1.0f;
    return (Range){may_be_false ? zero : one, may_be_true ? one : zero};
}

static INT has_other(Range a)
{
    return (a.low != 0.0f) | (a.high != 0.0f);
}

// What an operation of one operand is not defined for.
static void doubt_unary(uint op, Range a, int lazy, Doubt *doubt)
{
    INT maybe, never;
    if (op == TAPE_SQRT || op == TAPE_LOG || op == TAPE_POW) {
        maybe = !(a.low >= 0.0f);
        never = a.high < 0.0f;
    } else {
        maybe = !((a.low >= -1.0f) & (a.high <= 1.0f));
        never = (a.low > 1.0f) | (a.high < -1.0f);
    }
    doubt->maybe = doubt->maybe | maybe;
    if (!lazy) doubt->never = doubt->never | never;
}

// What is infinite may come to nothing.
static INT endless(Range a)
{
    return (a.low == -INFINITY) | (a.high == INFINITY);
}

NOINLINE void rare_range(uint op, const Range *pa, const Range *pb, int lazy, Doubt *doubt, Range *result)
{
    Range a = *pa, b = *pb, r = range_everything();
    FLOAT one = 1.0f, minus = -1.0f;
    switch (op) {
    case TAPE_POW:
        doubt_unary(op, a, lazy, doubt);
        doubt->maybe = doubt->maybe | ((a.low <= 0.0f) & (b.low <= 0.0f));
        r = range_exp(range_mul(b, range_log(a)));
        r = range_choose((a.low <= 0.0f) & (b.low <= 0.0f), range_everything(), r);
        break;
    case TAPE_LSE: { // it rises with both; exp and log are wrong by less than 6e-7 together
        FLOAT low = most(a.low, b.low) + each_log(1.0f + each_exp(-size_of(a.low - b.low)));
        FLOAT high = most(a.high, b.high) + each_log(1.0f + each_exp(-size_of(a.high - b.high)));
        r = outward(low - 6e-7f, high + 6e-7f, 2.0f);
        break;
    }
    case TAPE_EXP: r = range_exp(a); break;
    case TAPE_LOG:
        doubt_unary(op, a, lazy, doubt);
        r = range_log(a);
        break;
    case TAPE_SIN:
        doubt->maybe = doubt->maybe | endless(a);
        r = range_sin(a);
        break;
    case TAPE_COS:
        doubt->maybe = doubt->maybe | endless(a);
        r = range_cos(a);
        break;
    case TAPE_TAN: {
        INT pole = has_pole(a);
        doubt->maybe = doubt->maybe | pole;
        r = range_choose(pole, r, outward(each_tan(a.low), each_tan(a.high), 6.0f));
        break;
    }
    case TAPE_ASIN:
        doubt_unary(op, a, lazy, doubt);
        r = outward(each_asin(most(a.low, minus)), each_asin(least(a.high, one)), 5.0f);
        break;
    case TAPE_ACOS:
        doubt_unary(op, a, lazy, doubt);
        r = outward(each_acos(least(a.high, one)), each_acos(most(a.low, minus)), 5.0f);
        break;
    case TAPE_ATAN: r = outward(each_atan(a.low), each_atan(a.high), 6.0f); break;
    case TAPE_ATAN2: r = range_atan2(a, b); break;
    case TAPE_MOD:
        doubt->maybe = doubt->maybe | has_zero(b) | endless(a) | endless(b);
        r = range_mod(a, b);
        break;
    case TAPE_FLOOR: r = (Range){each_floor(a.low), each_floor(a.high)}; break;
    case TAPE_CEIL: r = (Range){each_ceil(a.low), each_ceil(a.high)}; break;
    case TAPE_ROUND: r = (Range){each_round(a.low), each_round(a.high)}; break;
    case TAPE_SIGN: r = (Range){truth(a.low > 0.0f) - truth(a.low < 0.0f), truth(a.high > 0.0f) - truth(a.high < 0.0f)}; break;
    case TAPE_LT: r = range_truth(a.high >= b.low, a.low < b.high); break;
    case TAPE_LE: r = range_truth(a.high > b.low, a.low <= b.high); break;
    case TAPE_EQ: r = range_truth((a.low != a.high) | (b.low != b.high) | (a.low != b.low), (a.low <= b.high) & (b.low <= a.high)); break;
    case TAPE_AND: r = range_truth(has_zero(a) | has_zero(b), has_other(a) & has_other(b)); break;
    case TAPE_OR: r = range_truth(has_zero(a) & has_zero(b), has_other(a) | has_other(b)); break;
    case TAPE_NOT: r = range_truth(has_other(a), has_zero(a)); break;
    default: break;
    }
    *result = r;
}

static int takes_second(uint op)
{
    return (op >= TAPE_ADD && op <= TAPE_MAX) || op == TAPE_POW || op == TAPE_ATAN2 || op == TAPE_MOD || op == TAPE_LSE || (op >= TAPE_LT && op <= TAPE_OR);
}

// The range of an operation but SELECT. b is its second operand, or twice the literal.
INLINE Range step_range(TapeStep step, Range a, Range b, Doubt *doubt)
{
    uint op = TAPE_OP(step.word);
    Range r;
    switch (op) {
    case TAPE_NUMBER: return b;
    case TAPE_ADD: return range_add(a, b);
    case TAPE_SUB: return range_sub(a, b);
    case TAPE_BACK_SUB: return range_sub(b, a);
    case TAPE_MUL: return step.word & TAPE_LITERAL ? range_scale(a, as_float(step.b)) : range_mul(a, b);
    case TAPE_DIV:
        if (step.word & TAPE_LITERAL && has_inverse(as_float(step.b))) return range_over(a, as_float(step.b));
        doubt->maybe = doubt->maybe | has_zero(b);
        return range_div(a, b);
    case TAPE_BACK_DIV: doubt->maybe = doubt->maybe | has_zero(a); return range_div(b, a);
    case TAPE_MIN: return (Range){least(a.low, b.low), least(a.high, b.high)};
    case TAPE_MAX: return (Range){most(a.low, b.low), most(a.high, b.high)};
    case TAPE_NEG: return (Range){-a.high, -a.low};
    case TAPE_ABS: return range_abs(a);
    case TAPE_SQUARE: return range_square(a);
    case TAPE_SQRT: doubt_unary(op, a, step.word & TAPE_LAZY, doubt); return range_root(a);
    case TAPE_POWER:
        if ((int)step.b < 0) doubt->maybe = doubt->maybe | has_zero(a);
        return range_power(a, (int)step.b);
    default: {
        Range x = a, y = b; // copies: what a function can reach stays in memory
        rare_range(op, &x, &y, step.word & TAPE_LAZY, doubt, &r);
        return r;
    }
    }
}

// A number of a tape; where it is none, or too large for a float, nothing is known.
INLINE Range range_literal(uint bits)
{
    float b = as_float(bits);
    Range r;
    r.low = b < INFINITY ? b : -INFINITY;
    r.high = b > -INFINITY ? b : INFINITY;
    return r;
}

// Noise, and, where `slopes` is not NULL, its three slopes.
NOINLINE void range_of_noise(uint op, const Range *place, Doubt *doubt, Range *result, Range *slopes)
{
    FLOAT low[3], high[3], slope_low[3], slope_high[3];
    for (uint k = 0; k < 3; k++) {
        low[k] = place[k].low;
        high[k] = place[k].high;
        doubt->maybe = doubt->maybe | endless(place[k]);
    }
    noise_range(op, low, high, &result->low, &result->high, slope_low, slope_high);
    for (uint k = 0; k < 3 && slopes; k++) slopes[k] = (Range){slope_low[k], slope_high[k]};
}

INLINE void range_noise(TapeStep step, __global const Range *v, Doubt *doubt, Range *result)
{
    Range place[3] = {v[TAPE_A(step.word)], v[step.b & 0xffffu], v[step.b >> 16]};
    range_of_noise(TAPE_OP(step.word), place, doubt, result, 0);
}

// The tape over boxes, a lane each.
NOINLINE void tape_range(const Tape *tape, const Range *box, __global FLOAT *memory, Range *result, Doubt *doubt)
{
    __global Range *v = (__global Range *)memory;
    doubt->maybe = doubt->never = (box[0].low != box[0].low) & (box[0].low == box[0].low); // none
    for (uint k = 0; k < TAPE_POINT; k++) v[k] = box[k];
    for (uint k = 0; k < tape->count; k++) {
        TapeStep step = tape->steps[k];
        uint op = TAPE_OP(step.word);
        Range a = v[TAPE_A(step.word)], b, r;
        if (op == TAPE_SELECT) {
            Range first = v[step.b & 0xffffu], second = v[step.b >> 16];
            r = range_choose(!has_zero(a), first, range_choose(!has_other(a), second, range_hull(first, second)));
        } else if (TAPE_TAKES_THREE(op)) {
            range_noise(step, v, doubt, &r);
        } else {
            if (!(step.word & TAPE_LITERAL) && takes_second(op)) b = v[step.b];
            else b = range_literal(step.b);
            r = step_range(step, a, b, doubt);
        }
        v[place_of(tape, step, k)] = r;
    }
    *result = v[tape->root & 0xffffu];
}

// --- gradients

typedef struct Gradient {
    FLOAT f, x, y, z;
} Gradient;

// The derivative at a point: ranges of one number would do it too, at four times the cost.
NOINLINE void rare_slope(uint op, int power, const FLOAT *pa, const FLOAT *pb, const FLOAT *pr, FLOAT *by_a, FLOAT *by_b)
{
    FLOAT a = *pa, b = *pb, r = *pr, s = 0.0f, t = 0.0f, zero = 0.0f;
    switch (op) {
    case TAPE_POWER: s = power ? (float)power * whole_power(a, power - 1) : zero; break;
    case TAPE_POW:
        s = b * r / a;
        t = a > 0.0f ? r * each_log(a) : zero;
        break;
    case TAPE_EXP: s = r; break;
    case TAPE_LOG: s = 1.0f / a; break;
    case TAPE_SIN: s = each_cos(a); break;
    case TAPE_COS: s = -each_sin(a); break;
    case TAPE_TAN: s = 1.0f + r * r; break;
    case TAPE_ASIN: s = inverse_root(1.0f - a * a); break;
    case TAPE_ACOS: s = -inverse_root(1.0f - a * a); break;
    case TAPE_ATAN: s = 1.0f / (1.0f + a * a); break;
    case TAPE_ATAN2: {
        FLOAT square = a * a + b * b;
        s = b / square;
        t = -a / square;
        break;
    }
    case TAPE_LSE: // not exp(a - r): where a and b are large and equal r is no more than they are
        s = 1.0f / (1.0f + each_exp(b - a));
        t = 1.0f / (1.0f + each_exp(a - b));
        break;
    case TAPE_MOD:
        s = 1.0f;
        t = -each_floor(a / b);
        break;
    default: break;
    }
    *by_a = s;
    *by_b = t;
}

// Where the operands of MIN and MAX are equal the first decides.
NOINLINE void tape_gradient(const Tape *tape, const FLOAT *point, __global FLOAT *memory, Gradient *result)
{
    __global Gradient *v = (__global Gradient *)memory;
    FLOAT zero = 0.0f, one = 1.0f;
    for (uint k = 0; k < TAPE_POINT; k++) v[k] = (Gradient){point[k], k == 0 ? one : zero, k == 1 ? one : zero, k == 2 ? one : zero};
    for (uint k = 0; k < tape->count; k++) {
        TapeStep step = tape->steps[k];
        uint op = TAPE_OP(step.word);
        Gradient a = v[TAPE_A(step.word)], b = {as_float(step.b), zero, zero, zero}, r;
        if (!(step.word & TAPE_LITERAL) && takes_second(op)) b = v[step.b];
        FLOAT by_a = zero, by_b = zero;
        switch (op) {
        case TAPE_NUMBER: r.f = b.f; break;
        case TAPE_ADD: r.f = a.f + b.f; by_a = by_b = one; break;
        case TAPE_SUB: r.f = a.f - b.f; by_a = one; by_b = -one; break;
        case TAPE_BACK_SUB: r.f = b.f - a.f; by_a = -one; by_b = one; break;
        case TAPE_MUL: r.f = a.f * b.f; by_a = b.f; by_b = a.f; break;
        case TAPE_DIV: r.f = a.f / b.f; by_a = 1.0f / b.f; by_b = -r.f * by_a; break;
        case TAPE_BACK_DIV: r.f = b.f / a.f; by_b = 1.0f / a.f; by_a = -r.f * by_b; break;
        case TAPE_MIN: r.f = least(b.f, a.f); by_b = b.f < a.f ? one : zero; by_a = 1.0f - by_b; break;
        case TAPE_MAX: r.f = most(b.f, a.f); by_b = b.f > a.f ? one : zero; by_a = 1.0f - by_b; break;
        case TAPE_NEG: r.f = -a.f; by_a = -one; break;
        case TAPE_ABS: r.f = size_of(a.f); by_a = a.f < 0.0f ? -one : one; break;
        case TAPE_SQUARE: r.f = a.f * a.f; by_a = 2.0f * a.f; break;
        case TAPE_SQRT: r.f = root(a.f); by_a = 0.5f / r.f; break;
        case TAPE_SELECT: {
            Gradient first = v[step.b & 0xffffu], second = v[step.b >> 16];
            INT chosen = a.f != 0.0f;
            v[place_of(tape, step, k)] = (Gradient){chosen ? first.f : second.f, chosen ? first.x : second.x, chosen ? first.y : second.y, chosen ? first.z : second.z};
            continue;
        }
        case TAPE_NOISE:
        case TAPE_CELLS: {
            Gradient second = v[step.b & 0xffffu], third = v[step.b >> 16];
            FLOAT place[3] = {a.f, second.f, third.f};
            Noise n;
            noise_value(op, place, &n);
            v[place_of(tape, step, k)] = (Gradient){n.f, n.x * a.x + n.y * second.x + n.z * third.x, n.x * a.y + n.y * second.y + n.z * third.y,
                                           n.x * a.z + n.y * second.z + n.z * third.z};
            continue;
        }
        default:
            {
                FLOAT x = a.f, y = b.f, z, by_x, by_y; // copies: what a function can reach stays in memory
                if (op == TAPE_POWER) z = whole_power(x, (int)step.b);
                else rare_value(op, &x, &y, &z);
                rare_slope(op, (int)step.b, &x, &y, &z, &by_x, &by_y);
                r.f = z;
                by_a = by_x;
                by_b = by_y;
            }
            break;
        }
        r.x = product(by_a, a.x) + product(by_b, b.x);
        r.y = product(by_a, a.y) + product(by_b, b.y);
        r.z = product(by_a, a.z) + product(by_b, b.z);
        v[place_of(tape, step, k)] = r;
    }
    *result = v[tape->root & 0xffffu];
}
