// Tapes over pieces of rays. A value along a piece, from its place p to its place q, lies in a strip: above the straight line through two lower ends and
// below the one through two upper ends. Sums, differences and multiples of strips are exact but for rounding, and so is a coordinate of a ray, so a plane is
// met to the last digit by one evaluation; of what is curved a strip is wrong by the square of the length of the piece, and of what has an edge in the piece
// by the length. Rounding is outwards, as of ranges (tape.cl).
//
// What bends upwards lies below the chord of its ends and above any tangent, what bends downwards the other way round; where a tangent touches is free, so
// rounding does not matter there. Other functions g are taken as g(c) + k (a - c) for the middle c of their operand a and of its slope k, wrong by what the
// slope may differ from k times how far a may be from c. Steps and conditions have the range of all of the piece.
//
// Ranges of a value and of its slope, with the range at p to narrow it, which were here before, took 510 ms CPU for a frame of colonnade (./dev bench FOLDER); strips
// take 70: there is a third less to carry, planes need no search, and where faces lie in each other the mean of both is decided at once.

typedef struct Strip { // what a value may be at p, and at q
    Range p, q;
} Strip;

INLINE Strip strip_flat(Range r)
{
    return (Strip){r, r};
}

INLINE Range strip_range(Strip a)
{
    return (Range){least(a.p.low, a.q.low), most(a.p.high, a.q.high)};
}

INLINE Strip strip_choose(INT mask, Strip a, Strip b)
{
    return (Strip){range_choose(mask, a.p, b.p), range_choose(mask, a.q, b.q)};
}

INLINE Range range_negated(Range a)
{
    return (Range){-a.high, -a.low};
}

INLINE Strip strip_negated(Strip a)
{
    return (Strip){range_negated(a.p), range_negated(a.q)};
}

INLINE Strip strip_sum(Strip a, Strip b)
{
    return (Strip){range_add(a.p, b.p), range_add(a.q, b.q)};
}

INLINE Strip strip_scale(Strip a, float b)
{
    return (Strip){range_scale(a.p, b), range_scale(a.q, b)};
}

// What is unknown has no end.
INLINE FLOAT known_low(FLOAT x)
{
    FLOAT none = -INFINITY;
    return x == x ? x : none;
}

INLINE FLOAT known_high(FLOAT x)
{
    FLOAT none = INFINITY;
    return x == x ? x : none;
}

// An upper line of the lesser of two lines that cross in the piece: either of them, or any mean of both. One that is below 0 at p says up to where the result is
// negative, and does so the farther the later it meets 0. Of two that run against each other the mean that is level is least, at the height of their crossing;
// it is taken where that is not above 0, or by no more than the strips are wide: faces that lie in each other, which no other line would show to be there.
INLINE void lesser_crossed(Strip a, Strip b, FLOAT *at_p, FLOAT *at_q)
{
    FLOAT rise_a = a.q.high - a.p.high, rise_b = b.q.high - b.p.high;
    INT down_a = a.p.high < 0.0f, down_b = b.p.high < 0.0f, lower = most(a.p.high, a.q.high) < most(b.p.high, b.q.high);
    INT first = (down_a & down_b) ? a.p.high * rise_b < b.p.high * rise_a : (down_a | (lower & !down_b));
    *at_p = first ? a.p.high : b.p.high;
    *at_q = first ? a.q.high : b.q.high;
    INT opposite = ((rise_a > 0.0f) & (rise_b < 0.0f)) | ((rise_a < 0.0f) & (rise_b > 0.0f));
    if (!ANY(opposite)) return;
    FLOAT share = rise_b / (rise_b - rise_a), rest = 1.0f - share;
    FLOAT from_a = share * a.p.high, from_b = rest * b.p.high, along_a = share * rise_a, along_b = rest * rise_b;
    FLOAT crossing = from_a + from_b;
    FLOAT margin = 3e-7f * (size_of(from_a) + size_of(from_b) + size_of(along_a) + size_of(along_b)) + 1e-37f;
    crossing = most(crossing, crossing + (along_a + along_b)) + margin;
    INT deep = least(a.p.high, b.p.high) < -crossing;
    INT level = opposite & (crossing > -INFINITY) & ((crossing <= 0.0f) | (!deep & (crossing - 2.0f * margin <= (a.p.high - a.p.low) + (b.p.high - b.p.low))));
    *at_p = level ? crossing : *at_p;
    *at_q = level ? crossing : *at_q;
}

INLINE Strip strip_min(Strip a, Strip b)
{
    Strip r;
    r.p.low = least(a.p.low, b.p.low);
    r.q.low = least(a.q.low, b.q.low);
    INT first = (a.p.high <= b.p.high) & (a.q.high <= b.q.high), second = (b.p.high <= a.p.high) & (b.q.high <= a.q.high);
    r.p.high = first ? a.p.high : b.p.high;
    r.q.high = first ? a.q.high : b.q.high;
    INT crossed = !(first | second);
    if (!ANY(crossed)) return r;
    FLOAT at_p, at_q;
    lesser_crossed(a, b, &at_p, &at_q);
    r.p.high = crossed ? at_p : r.p.high;
    r.q.high = crossed ? at_q : r.q.high;
    return r;
}

INLINE Strip strip_max(Strip a, Strip b)
{
    return strip_negated(strip_min(strip_negated(a), strip_negated(b)));
}

INLINE Strip strip_abs(Strip a)
{
    FLOAT zero = 0.0f;
    INT above_zero = (a.p.low >= 0.0f) & (a.q.low >= 0.0f), below_zero = (a.p.high <= 0.0f) & (a.q.high <= 0.0f);
    Strip r;
    r.p.low = above_zero ? a.p.low : below_zero ? -a.p.high : zero;
    r.q.low = above_zero ? a.q.low : below_zero ? -a.q.high : zero;
    r.p.high = most(a.p.high, -a.p.low);
    r.q.high = most(a.q.high, -a.q.low);
    return r;
}

// Above the chord it is not; the tangent where a is m is m (2 a - m), and is nowhere negative if m is at most twice the lesser end.
INLINE Strip strip_square(Strip a)
{
    FLOAT zero = 0.0f;
    INT above_zero = (a.p.low > 0.0f) & (a.q.low > 0.0f), below_zero = (a.p.high < 0.0f) & (a.q.high < 0.0f);
    FLOAT n0 = above_zero ? a.p.low : below_zero ? -a.p.high : zero, n1 = above_zero ? a.q.low : below_zero ? -a.q.high : zero;
    FLOAT m = least(0.5f * (n0 + n1), 2.0f * least(n0, n1));
    FLOAT f0 = most(a.p.high, -a.p.low), f1 = most(a.q.high, -a.q.low);
    Strip r;
    r.p = (Range){most(product_below(m, difference_below(2.0f * n0, m)), zero), product_above(f0, f0)};
    r.q = (Range){most(product_below(m, difference_below(2.0f * n1, m)), zero), product_above(f1, f1)};
    return r;
}

// Below the chord it is not; sqrt(a) <= (a / g + g) / 2 for any g > 0.
INLINE Strip strip_root(Strip a)
{
    FLOAT zero = 0.0f, tiny = 1.2e-38f; // below it root() has no digits
    INT whole = (a.p.low >= 0.0f) & (a.q.low >= 0.0f);
    FLOAT u0 = most(a.p.high, tiny), u1 = most(a.q.high, tiny);
    FLOAT g = 0.5f * (root(u0) + root(u1)), inverse = 1.0f / g;
    FLOAT l0 = below(root(most(a.p.low, tiny)), 4.0f), l1 = below(root(most(a.q.low, tiny)), 4.0f);
    l0 = (whole & (a.p.low >= tiny)) ? l0 : zero;
    l1 = (whole & (a.q.low >= tiny)) ? l1 : zero;
    Strip r;
    r.p = (Range){l0, above(0.5f * (u0 * inverse + g), 5.0f)};
    r.q = (Range){l1, above(0.5f * (u1 * inverse + g), 5.0f)};
    return r;
}

INLINE Range slopes_of(Strip a)
{
    FLOAT d0 = difference_below(a.q.low, a.p.low), d1 = difference_below(a.q.high, a.p.high);
    FLOAT e0 = difference_above(a.q.low, a.p.low), e1 = difference_above(a.q.high, a.p.high);
    return (Range){least(known_low(d0), known_low(d1)), most(known_high(e0), known_high(e1))};
}

// A product of two lines is its chord less t (1 - t) times the product of their slopes.
INLINE Strip strip_mul(Strip a, Strip b)
{
    FLOAT zero = 0.0f;
    Strip r = {range_mul(a.p, b.p), range_mul(a.q, b.q)};
    Range bend = range_mul(slopes_of(a), slopes_of(b));
    FLOAT down = most(0.25f * bend.high, zero), up = most(-0.25f * bend.low, zero);
    r.p = (Range){known_low(difference_below(r.p.low, down)), known_high(sum_above(r.p.high, up))};
    r.q = (Range){known_low(difference_below(r.q.low, down)), known_high(sum_above(r.q.high, up))};
    return r;
}

// 1 / a below its chord and above its tangents (2 - a / m) / m; nothing is known where a may be 0.
NOINLINE void strip_reciprocal(const Strip *pa, Strip *result)
{
    Strip a = *pa, r;
    INT positive = (a.p.low > 0.0f) & (a.q.low > 0.0f), negative = (a.p.high < 0.0f) & (a.q.high < 0.0f);
    FLOAT n0 = positive ? a.p.low : -a.p.high, n1 = positive ? a.q.low : -a.q.high;
    FLOAT f0 = positive ? a.p.high : -a.p.low, f1 = positive ? a.q.high : -a.q.low;
    FLOAT inverse = 1.0f / (0.5f * f0 + 0.5f * f1);
    r.p = (Range){below((2.0f - f0 * inverse - 8e-7f) * inverse, 4.0f), above(1.0f / n0, 3.0f)};
    r.q = (Range){below((2.0f - f1 * inverse - 8e-7f) * inverse, 4.0f), above(1.0f / n1, 3.0f)};
    r = strip_choose(positive, r, strip_negated(r));
    *result = strip_choose(positive | negative, r, strip_flat(range_everything()));
}

static Range all_numbers(FLOAT x)
{
    return (Range){x, x};
}

// g(c) + k (a - c), wrong by `bend` at most.
static Strip strip_bent(Strip a, FLOAT c, Range g, FLOAT k, FLOAT bend)
{
    Strip r = {range_mul(all_numbers(k), range_sub(a.p, all_numbers(c))), range_mul(all_numbers(k), range_sub(a.q, all_numbers(c)))};
    INT known = (INT)(size_of(k) < INFINITY) & (size_of(c) < INFINITY) & (bend < INFINITY) & (g.low > -INFINITY) & (g.high < INFINITY);
    Range wide = {difference_below(g.low, bend), sum_above(g.high, bend)};
    r.p = range_add(r.p, wide);
    r.q = range_add(r.q, wide);
    return strip_choose(known, r, strip_flat(range_everything()));
}

static FLOAT reach_of(Range all, FLOAT c)
{
    return most(difference_above(all.high, c), difference_above(c, all.low));
}

// The same of a strip a in a range about c, where g has the slope s.
static Strip strip_tangent(Strip a, Range all, FLOAT c, Range g, Range s)
{
    FLOAT k = 0.5f * s.low + 0.5f * s.high;
    FLOAT spread = most(difference_above(s.high, k), difference_above(k, s.low));
    return strip_bent(a, c, g, k, product_above(spread, reach_of(all, c)));
}

// The lower line, and the upper one, of whichever strip is better somewhere; `r` is the range of all of it.
static Strip strip_within(Strip a, Range r)
{
    INT low = (a.p.low > r.low) | (a.q.low > r.low), high = (a.p.high < r.high) | (a.q.high < r.high);
    a.p.low = low ? a.p.low : r.low;
    a.q.low = low ? a.q.low : r.low;
    a.p.high = high ? a.p.high : r.high;
    a.q.high = high ? a.q.high : r.high;
    return a;
}

// The derivative of an operation of one operand, as a range: a its operand, r its result.
NOINLINE void unary_slope(uint op, int power, const Range *pa, const Range *pr, Range *result)
{
    Range a = *pa, r = *pr, s = range_everything();
    FLOAT one = 1.0f, zero = 0.0f, infinite = INFINITY;
    Range ones = {one, one};
    switch (op) {
    case TAPE_POWER: s = power ? range_scale(range_power(a, power - 1), (float)power) : (Range){zero, zero}; break;
    case TAPE_LOG: {
        Range inside = {most(a.low, zero), a.high};
        s = range_div(ones, inside);
        s = range_choose(a.low > 0.0f, s, (Range){zero, infinite});
        break;
    }
    case TAPE_TAN: s = range_choose(has_pole(a), s, range_add(ones, range_square(r))); break;
    case TAPE_ASIN:
    case TAPE_ACOS: {
        Range rest = range_sub(ones, range_square(a));
        rest.low = most(rest.low, zero);
        rest.high = most(rest.high, zero);
        rest = range_root(rest);
        s = (Range){below(1.0f / rest.high, 3.0f), rest.low > 0.0f ? above(1.0f / rest.low, 3.0f) : infinite};
        if (op == TAPE_ACOS) s = (Range){-s.high, -s.low};
        break;
    }
    case TAPE_ATAN: s = range_div(ones, range_add(ones, range_square(a))); break;
    default: break;
    }
    *result = s;
}

// Below the chord and above the tangent e^m (1 + a - m), which is nowhere negative if m is at most 1 more than the lesser end.
static Strip strip_exp(Strip a)
{
    FLOAT zero = 0.0f, one = 1.0f;
    FLOAT lower = least(a.p.low, a.q.low), next = lower + 1.0f, m;
    next = next - lower <= 1.0f ? next : lower; // of large numbers the next is farther away
    m = least(0.5f * (a.p.low + a.q.low), next);
    FLOAT touch = most(below(each_exp(m), 4.0f), zero);
    Strip r;
    r.p.low = most(product_below(touch, sum_below(one, difference_below(a.p.low, m))), zero);
    r.q.low = most(product_below(touch, sum_below(one, difference_below(a.q.low, m))), zero);
    r.p.high = above(each_exp(a.p.high), 4.0f);
    r.q.high = above(each_exp(a.q.high), 4.0f);
    return r;
}

// sin(c) + cos(c) (a - c) is wrong by half the square of a - c at most, and so it is with the cosine.
static Strip strip_wave(uint op, Strip a, Range all, Doubt *doubt)
{
    FLOAT c = 0.5f * all.low + 0.5f * all.high, reach = reach_of(all, c), one = 1.0f, minus = -1.0f;
    Range whole = {minus, one};
    doubt->maybe = doubt->maybe | endless(all);
    INT far = (INT)!(reach < 1.4f) | (size_of(c) > 1e4f);
    c = far ? 0.0f : c;
    FLOAT sine = each_sin(c), cosine = each_cos(c), g = op == TAPE_SIN ? sine : cosine, k = op == TAPE_SIN ? cosine : -sine;
    FLOAT bend = above(0.5f * reach * reach + 2e-6f * reach, 4.0f);
    Strip r = strip_bent(a, c, outward(g, g, 5.0f), k, bend);
    return strip_choose(far, strip_flat(whole), strip_within(r, whole));
}

NOINLINE void strip_function(TapeStep step, const Strip *pa, Doubt *doubt, Strip *result)
{
    uint op = TAPE_OP(step.word);
    Strip a = *pa;
    if (op == TAPE_EXP) {
        *result = strip_exp(a);
        return;
    }
    Range all = strip_range(a), b = range_literal(step.b);
    if (op == TAPE_SIN || op == TAPE_COS) {
        *result = strip_wave(op, a, all, doubt);
        return;
    }
    Range r = step_range(step, all, b, doubt);
    *result = strip_flat(r);
    if (op != TAPE_POWER && !(op >= TAPE_LOG && op <= TAPE_ATAN)) return;
    Doubt unused = *doubt;
    FLOAT c = 0.5f * all.low + 0.5f * all.high;
    Range s, g = step_range(step, all_numbers(c), b, &unused);
    unary_slope(op, (int)step.b, &all, &r, &s);
    *result = strip_within(strip_tangent(a, all, c, g, s), r);
}

static FLOAT log_of_sum(FLOAT a, FLOAT b)
{
    return most(a, b) + each_log(1.0f + each_exp(-size_of(a - b)));
}

// log(exp a + exp b) below the chord and above a tangent, for which w is the part of the larger.
static Strip strip_lse(Strip a, Strip b)
{
    FLOAT none = -INFINITY;
    FLOAT ma = 0.5f * a.p.low + 0.5f * a.q.low, mb = 0.5f * b.p.low + 0.5f * b.q.low;
    FLOAT small = each_exp(-size_of(ma - mb)), middle = most(ma, mb) + each_log(1.0f + small), w = 1.0f / (1.0f + small);
    INT first = ma >= mb;
    FLOAT a0 = a.p.low - ma, a1 = a.q.low - ma, b0 = b.p.low - mb, b1 = b.q.low - mb;
    FLOAT big0 = first ? a0 : b0, big1 = first ? a1 : b1, rest0 = first ? b0 : a0, rest1 = first ? b1 : a1;
    FLOAT margin = 6e-7f + 6e-7f * (size_of(middle) + size_of(big0) + size_of(big1) + size_of(rest0) + size_of(rest1));
    FLOAT low0 = middle + (rest0 + w * (big0 - rest0)) - margin, low1 = middle + (rest1 + w * (big1 - rest1)) - margin;
    INT bounded = (low0 > none) & (low1 > none); // else it is above either of them
    INT either = (a.p.low > none) & (a.q.low > none);
    Strip r;
    r.p.low = bounded ? low0 : either ? a.p.low : b.p.low;
    r.q.low = bounded ? low1 : either ? a.q.low : b.q.low;
    r.p.high = above(log_of_sum(a.p.high, b.p.high) + 6e-7f, 2.0f);
    r.q.high = above(log_of_sum(a.q.high, b.q.high) + 6e-7f, 2.0f);
    return r;
}

// Operations of two operands that few tapes are made of.
NOINLINE void strip_rare(TapeStep step, const Strip *pa, const Strip *pb, Doubt *doubt, Strip *result)
{
    uint op = TAPE_OP(step.word);
    Strip a = *pa, b = *pb, one, r;
    if (op == TAPE_LSE) {
        *result = strip_lse(a, b);
        return;
    }
    if (op == TAPE_DIV || op == TAPE_BACK_DIV) {
        Strip divisor = op == TAPE_DIV ? b : a, divided = op == TAPE_DIV ? a : b;
        doubt->maybe = doubt->maybe | has_zero(strip_range(divisor));
        strip_reciprocal(&divisor, &one);
        *result = strip_mul(divided, one);
        return;
    }
    Range x = strip_range(a), y = strip_range(b), all = step_range(step, x, y, doubt);
    r = strip_flat(all);
    if (op == TAPE_POW) { // exp(b log a)
        Doubt unused = *doubt;
        strip_function((TapeStep){TAPE_LOG, 0}, &a, &unused, &one);
        r = strip_mul(b, one);
        strip_function((TapeStep){TAPE_EXP, 0}, &r, &unused, &one);
        r = strip_choose(x.low > 0.0f, strip_within(one, all), r);
        r = strip_choose(x.low > 0.0f, r, strip_flat(all));
    } else if (op == TAPE_ATAN2) {
        Range square = range_add(range_square(x), range_square(y)), g;
        FLOAT c = 0.5f * x.low + 0.5f * x.high, d = 0.5f * y.low + 0.5f * y.high, zero = 0.0f;
        g = range_atan2(all_numbers(c), all_numbers(d));
        one = strip_sum(strip_tangent(a, x, c, g, range_div(y, square)), strip_tangent(b, y, d, all_numbers(zero), range_negated(range_div(x, square))));
        r = strip_choose((y.low <= 0.0f) & has_zero(x), r, strip_within(one, all));
    } else if (op == TAPE_MOD) { // a less a whole number of b
        Range turns = range_div(x, y);
        turns.low = each_floor(turns.low);
        turns.high = each_floor(turns.high);
        one = strip_sum(a, strip_negated((Strip){range_mul(turns, b.p), range_mul(turns, b.q)}));
        r = strip_choose((turns.low == turns.high) & !has_zero(y), strip_within(one, all), r);
    }
    *result = r;
}

INLINE Strip strip_select(Strip c, Strip a, Strip b)
{
    Range all = strip_range(c);
    Strip either = {range_hull(a.p, b.p), range_hull(a.q, b.q)};
    return strip_choose(!has_zero(all), a, strip_choose(!has_other(all), b, either));
}

INLINE Range range_at(FLOAT o, FLOAT e, FLOAT s)
{
    Range way = {known_low(product_below(e, s)), known_high(product_above(e, s))};
    return (Range){sum_below(o, way.low), sum_above(o, way.high)};
}

// The value in the middle of the box and a tangent along each axis.
NOINLINE void strip_noise(TapeStep step, __global const Strip *v, Doubt *doubt, Strip *result)
{
    Strip places[3] = {v[TAPE_A(step.word)], v[step.b & 0xffffu], v[step.b >> 16]}, r = {{0.0f, 0.0f}, {0.0f, 0.0f}};
    Range all[3], middles[3], slopes[3], whole, g, zero = {0.0f, 0.0f};
    Doubt unused = *doubt;
    for (uint k = 0; k < 3; k++) {
        all[k] = strip_range(places[k]);
        middles[k] = all_numbers(0.5f * all[k].low + 0.5f * all[k].high);
    }
    range_of_noise(TAPE_OP(step.word), all, doubt, &whole, slopes);
    range_of_noise(TAPE_OP(step.word), middles, &unused, &g, 0);
    for (uint k = 0; k < 3; k++) r = strip_sum(r, strip_tangent(places[k], all[k], middles[k].low, k ? zero : g, slopes[k]));
    *result = strip_within(r, whole);
}

#define STEP_KEY(word) ((word) & (63u | TAPE_LITERAL))
#define WITH_NUMBER(op) (op | TAPE_LITERAL)

// The tape over the piece from p to q of the rays o + s e.
NOINLINE void tape_strip(const Tape *tape, const FLOAT *o, const FLOAT *e, const FLOAT *p, const FLOAT *q, __global FLOAT *memory, Strip *result, Doubt *doubt)
{
    __global Strip *v = (__global Strip *)memory;
    doubt->maybe = doubt->never = (*p != *p) & (*p == *p); // none
    for (uint k = 0; k < TAPE_POINT; k++) v[k] = (Strip){range_at(o[k], e[k], *p), range_at(o[k], e[k], *q)};
    for (uint k = 0; k < tape->count; k++) {
        TapeStep step = tape->steps[k];
        Strip a = v[TAPE_A(step.word)], b, r;
        float number = as_float(step.b); // where it is none, or infinite, nothing is known
        FLOAT low = number < INFINITY ? number : -INFINITY, high = number > -INFINITY ? number : INFINITY;
        switch (STEP_KEY(step.word)) {
        case WITH_NUMBER(TAPE_ADD):
            r.p = (Range){sum_below(a.p.low, low), sum_above(a.p.high, high)};
            r.q = (Range){sum_below(a.q.low, low), sum_above(a.q.high, high)};
            break;
        case WITH_NUMBER(TAPE_SUB):
            r.p = (Range){difference_below(a.p.low, high), difference_above(a.p.high, low)};
            r.q = (Range){difference_below(a.q.low, high), difference_above(a.q.high, low)};
            break;
        case WITH_NUMBER(TAPE_BACK_SUB):
            r.p = (Range){difference_below(low, a.p.high), difference_above(high, a.p.low)};
            r.q = (Range){difference_below(low, a.q.high), difference_above(high, a.q.low)};
            break;
        case WITH_NUMBER(TAPE_MUL): r = strip_scale(a, number); break;
        case TAPE_ADD: r = strip_sum(a, v[step.b]); break;
        case TAPE_SUB: r = strip_sum(a, strip_negated(v[step.b])); break;
        case TAPE_MUL: r = strip_mul(a, v[step.b]); break;
        case TAPE_MIN: r = strip_min(a, v[step.b]); break;
        case TAPE_MAX: r = strip_max(a, v[step.b]); break;
        case TAPE_NEG: r = strip_negated(a); break;
        case TAPE_ABS: r = strip_abs(a); break;
        case TAPE_SQUARE: r = strip_square(a); break;
        case TAPE_SQRT:
            doubt_unary(TAPE_SQRT, strip_range(a), step.word & TAPE_LAZY, doubt);
            r = strip_root(a);
            break;
        case TAPE_SELECT: r = strip_select(a, v[step.b & 0xffffu], v[step.b >> 16]); break;
        case TAPE_NOISE:
        case TAPE_CELLS: {
            Strip z;
            strip_noise(step, v, doubt, &z);
            r = z;
            break;
        }
        default: {
            int literal = (step.word & TAPE_LITERAL) != 0;
            b = strip_flat(range_literal(step.b));
            if (TAPE_OP(step.word) == TAPE_NUMBER) {
                r = b;
            } else if (TAPE_OP(step.word) == TAPE_MIN) {
                r = strip_min(a, b);
            } else if (TAPE_OP(step.word) == TAPE_MAX) {
                r = strip_max(a, b);
            } else if (TAPE_OP(step.word) == TAPE_DIV && literal && has_inverse(number)) {
                r = (Strip){range_over(a.p, number), range_over(a.q, number)};
            } else if (takes_second(TAPE_OP(step.word))) {
                Strip x = a, y = b, z; // copies: what a function can reach stays in memory
                if (!literal) y = v[step.b];
                strip_rare(step, &x, &y, doubt, &z);
                r = z;
            } else {
                Strip x = a, z;
                strip_function(step, &x, doubt, &z);
                r = z;
            }
            break;
        }
        }
        v[place_of(tape, step, k)] = r;
    }
    *result = v[tape->root & 0xffffu];
}
