// Slices: where a condition on two numbers holds, pixel by pixel, each exactly as if it were computed there alone.
//
// A tile is cut into 4 x 4 parts, which are the lanes of one packet. First come ranges: of each number in each part, then which comparisons, ANDs and ORs
// hold all over a part, or nowhere in it, 16 bits each. Parts that are decided are filled. For the others it is traced back what of the program they still
// need, and they get a program of that alone: where one side of an AND holds all over the part, the other side takes its place, and so it is with sums of
// which one side is 0, as perturbations are outside of their supports. Parts of 16 x 16
// pixels run theirs at once; larger ones are tiles of the next level. Work-items take tiles by a counter.
//
// A range is rounded to nearest: sums, products, quotients and roots that are rounded to nearest rise and fall with their exact values, so such a range holds
// every float that the operation gives in it. Functions, which devices may get wrong by some units, have wider ranges (doubtful_range()). A comparison with
// what may be undefined is never known to hold.
//
// In a part of 16 x 16 pixels what depends on the place across alone is one packet for all rows, what depends on the place up alone one packet for all
// columns; what depends on both is 16 packets. A condition is 16 times 16 bits.
//
// Memory is that of the work-item (slice_shared.h has the parts): nothing here is private but what fits into registers, so it runs on any device.

#pragma OPENCL FP_CONTRACT OFF

typedef __global const TapeStep *Steps;

typedef struct Memory {
    __global Range *ranges;
    __global FLOAT *mixed;
    __global ushort *need, *want, *map, *place;
    __global uint *choice, *known;
    __global ushort16 *bits;
    __global TapeStep *steps;
} Memory;

static Memory memory_of(__constant SliceFrame *frame, __global uchar *memory)
{
    uint n = frame->numbers, c = frame->conditions, mixed = frame->mixed;
    __global uchar *at = memory + (size_t)get_global_id(0) * frame->room;
    return (Memory){
        (__global Range *)(at + SLICE_RANGES),
        (__global FLOAT *)(at + SLICE_MIXED(n)),
        (__global ushort *)(at + SLICE_NEED(n, mixed)),
        (__global ushort *)(at + SLICE_WANT(n, c, mixed)),
        (__global ushort *)(at + SLICE_MAP(n, mixed)),
        (__global ushort *)(at + SLICE_PLACE(n, c, mixed)),
        (__global uint *)(at + SLICE_CHOICE(n, mixed)),
        (__global uint *)(at + SLICE_KNOWN(n, mixed)),
        (__global ushort16 *)(at + SLICE_BITS(n, c, mixed)),
        (__global TapeStep *)(at + SLICE_STEPS(n, c, mixed)),
    };
}

#define LITERAL(op) (op | SLICE_LITERAL)
#define LOW_BIT(bits) (31u - clz((bits) & -(bits)))

// --- numbers at points

NOINLINE void rare_number(uint op, uint power, const FLOAT *a, const FLOAT *b, FLOAT *result)
{
    if (op == TAPE_POWER)
        *result = whole_power(*a, (int)power);
    else
        rare_value(op, a, b, result);
}

INLINE FLOAT step_number(TapeStep step, FLOAT a, FLOAT b)
{
    FLOAT r;
    switch (TAPE_OP(step.word)) {
    case TAPE_NUMBER: return b;
    case TAPE_ADD: return a + b;
    case TAPE_SUB: return a - b;
    case TAPE_BACK_SUB: return b - a;
    case TAPE_MUL: return a * b;
    case TAPE_DIV: return a / b;
    case TAPE_BACK_DIV: return b / a;
    case TAPE_MIN: r = b < a ? b : a; return b == b ? r : b;
    case TAPE_MAX: r = b > a ? b : a; return b == b ? r : b;
    case TAPE_NEG: return -a;
    case TAPE_ABS: return a < 0.0f ? -a : a;
    case TAPE_SQUARE: return a * a;
    case TAPE_SQRT: return sqrt(a);
    case SLICE_SPREAD: return a;
    default: rare_number(TAPE_OP(step.word), step.b, &a, &b, &r); return r;
    }
}

INLINE FLOAT selected(FLOAT condition, FLOAT a, FLOAT b)
{
    FLOAT nothing = NAN, r = condition != 0.0f ? a : b;
    return condition == condition ? r : nothing;
}

// What takes three operands.
INLINE FLOAT third_number(uint op, FLOAT a, FLOAT b, FLOAT c)
{
    if (op == TAPE_SELECT) return selected(a, b, c);
    FLOAT place[3] = {a, b, c};
    Noise noise;
    noise_value(op, place, &noise);
    return noise.f;
}

// --- ranges

static FLOAT all_of(float x)
{
    FLOAT r = x;
    return r;
}

// The range of a quotient or a power, of a divisor without zero.
static Range quotient_range(Range a, Range b)
{
    FLOAT p = a.low / b.low, q = a.low / b.high, r = a.high / b.low, s = a.high / b.high;
    return (Range){least(least(p, q), least(r, s)), most(most(p, q), most(r, s))};
}

static Range product_range(Range a, Range b)
{
    FLOAT p = a.low * b.low, q = a.low * b.high, r = a.high * b.low, s = a.high * b.high;
    return (Range){least(least(p, q), least(r, s)), most(most(p, q), most(r, s))};
}

static Range square_range(Range a)
{
    FLOAT p = a.low * a.low, q = a.high * a.high, zero = 0.0f;
    return (Range){has_zero(a) ? zero : least(p, q), most(p, q)};
}

static Range absolute_range(Range a)
{
    FLOAT zero = 0.0f;
    return (Range){has_zero(a) ? zero : most(a.low, -a.high), most(a.high, -a.low)};
}

// Products of products, each rounded: they rise with |a|.
static Range power_range(Range a, int n)
{
    FLOAT one = 1.0f;
    if (n == 0) return (Range){one, one};
    Range base = (n & 1) ? a : absolute_range(a);
    Range r = {whole_power(base.low, n), whole_power(base.high, n)};
    return n > 0 ? r : (Range){least(r.low, r.high), most(r.low, r.high)};
}

// What a device computes of functions, at any point of the range: its ends are moved once more.
static Range wider(Range r)
{
    return outward(r.low, r.high, 16.0f);
}

// a - b floor(a / b) as it is computed: beyond b, or below 0, by what rounding adds where a is much larger.
static Range remainder_range(Range a, Range b)
{
    Range turns = range_div(a, b);
    turns.low = each_floor(turns.low);
    turns.high = each_floor(turns.high);
    Range r = range_sub(a, range_mul(turns, b));
    FLOAT margin = 4.8e-7f * (most(size_of(a.low), size_of(a.high)) + most(size_of(b.low), size_of(b.high)));
    r.low = most(r.low, least(b.low, all_of(0.0f)) - margin);
    r.high = least(r.high, most(b.high, all_of(0.0f)) + margin);
    return r;
}

static Range function_range(uint op, Range a, Range b, Doubt *doubt)
{
    Range r;
    if (op == TAPE_MOD) {
        doubt->maybe = doubt->maybe | has_zero(b);
        return remainder_range(a, b);
    }
    if (op == TAPE_POW) {
        doubt->maybe = doubt->maybe | (INT)!(a.low > 0.0f);
        return wider(range_exp(wider(range_mul(b, wider(range_log(a))))));
    }
    rare_range(op, &a, &b, 1, doubt, &r);
    return op >= TAPE_FLOOR && op <= TAPE_SELECT ? r : wider(r);
}

// Ranges of what may be undefined or endless; `doubt` collects the parts where it may be so.
NOINLINE void doubtful_range(TapeStep step, const Range *pa, const Range *pb, uint *doubt, Range *result)
{
    Range a = *pa, b = *pb, r;
    FLOAT zero = 0.0f;
    Doubt maybe = {(INT)(0), (INT)(0)};
    uint op = TAPE_OP(step.word);
    switch (op) {
    case TAPE_NUMBER: r = b; break;
    case TAPE_ADD: r = (Range){a.low + b.low, a.high + b.high}; break;
    case TAPE_SUB: r = (Range){a.low - b.high, a.high - b.low}; break;
    case TAPE_BACK_SUB: r = (Range){b.low - a.high, b.high - a.low}; break;
    case TAPE_MUL: r = product_range(a, b); break;
    case TAPE_DIV: maybe.maybe = has_zero(b); r = quotient_range(a, b); break;
    case TAPE_BACK_DIV: maybe.maybe = has_zero(a); r = quotient_range(b, a); break;
    case TAPE_MIN: r = (Range){least(a.low, b.low), least(a.high, b.high)}; break;
    case TAPE_MAX: r = (Range){most(a.low, b.low), most(a.high, b.high)}; break;
    case TAPE_NEG: r = (Range){-a.high, -a.low}; break;
    case TAPE_ABS: r = absolute_range(a); break;
    case TAPE_SQUARE: r = square_range(a); break;
    case TAPE_SQRT: maybe.maybe = !(a.low >= 0.0f); r = (Range){sqrt(most(a.low, zero)), sqrt(most(a.high, zero))}; break;
    case TAPE_POWER:
        if ((int)step.b < 0) maybe.maybe = has_zero(a);
        r = power_range(a, (int)step.b);
        break;
    case SLICE_SPREAD: r = a; break;
    default: r = function_range(op, a, b, &maybe); break;
    }
    INT whole = (a.low > -INFINITY) & (a.high < INFINITY) & (b.low > -INFINITY) & (b.high < INFINITY) & (r.low > -INFINITY) & (r.high < INFINITY);
    INT bad = maybe.maybe | !whole;
    *result = range_choose(bad, range_everything(), r);
    *doubt |= mask_bits(bad);
}

static Range selected_range(Range condition, Range a, Range b)
{
    Range r = range_hull(a, b);
    r = range_choose(!has_zero(condition), a, r);
    return range_choose((condition.low == 0.0f) & (condition.high == 0.0f), b, r);
}

NOINLINE void third_range(uint op, const Range *place, Range *result)
{
    Doubt none = {(INT)(0), (INT)(0)};
    range_of_noise(op, place, &none, result, 0);
}

// The range of the second operand, or of the literal.
INLINE Range second_range(TapeStep step, __global const Range *ranges)
{
    Range b = {all_of(as_float(step.b)), all_of(as_float(step.b))};
    if (!(step.word & SLICE_LITERAL)) b = ranges[step.b];
    else if (TAPE_OP(step.word) == TAPE_POWER) b = ranges[SLICE_A(step.word)]; // its literal is no float
    return b;
}

// A range of a number that is defined all over the tile.
INLINE Range step_number_range(TapeStep step, __global const Range *ranges)
{
    Range a = ranges[SLICE_A(step.word)];
    float c = as_float(step.b);
    FLOAT zero = 0.0f;
    switch (SLICE_KEY(step.word)) {
    case LITERAL(TAPE_NUMBER): return (Range){all_of(c), all_of(c)};
    case LITERAL(TAPE_ADD): return (Range){a.low + c, a.high + c};
    case LITERAL(TAPE_SUB): return (Range){a.low - c, a.high - c};
    case LITERAL(TAPE_BACK_SUB): return (Range){c - a.high, c - a.low};
    case LITERAL(TAPE_MUL): return c < 0.0f ? (Range){a.high * c, a.low * c} : (Range){a.low * c, a.high * c};
    case LITERAL(TAPE_DIV): return c < 0.0f ? (Range){a.high / c, a.low / c} : (Range){a.low / c, a.high / c};
    case LITERAL(TAPE_MIN): return (Range){least(a.low, all_of(c)), least(a.high, all_of(c))};
    case LITERAL(TAPE_MAX): return (Range){most(a.low, all_of(c)), most(a.high, all_of(c))};
    case LITERAL(TAPE_NEG): return (Range){-a.high, -a.low};
    case LITERAL(TAPE_ABS): return absolute_range(a);
    case LITERAL(TAPE_SQUARE): return square_range(a);
    case LITERAL(TAPE_SQRT): return (Range){sqrt(most(a.low, zero)), sqrt(most(a.high, zero))};
    case LITERAL(SLICE_SPREAD): return a;
    case TAPE_ADD: {
        Range b = ranges[step.b];
        return (Range){a.low + b.low, a.high + b.high};
    }
    case TAPE_SUB: {
        Range b = ranges[step.b];
        return (Range){a.low - b.high, a.high - b.low};
    }
    case TAPE_MUL: return product_range(a, ranges[step.b]);
    case TAPE_MIN: {
        Range b = ranges[step.b];
        return (Range){least(a.low, b.low), least(a.high, b.high)};
    }
    case TAPE_MAX: {
        Range b = ranges[step.b];
        return (Range){most(a.low, b.low), most(a.high, b.high)};
    }
    case TAPE_SELECT: return selected_range(a, ranges[step.b & 0xffffu], ranges[step.b >> 16]);
    case TAPE_NOISE:
    case TAPE_CELLS: {
        Range place[3] = {a, ranges[step.b & 0xffffu], ranges[step.b >> 16]}, r;
        third_range(TAPE_OP(step.word), place, &r);
        return r;
    }
    default: {
        uint none = 0;
        Range b = second_range(step, ranges), r;
        doubtful_range(step, &a, &b, &none, &r);
        return r;
    }
    }
}

static uint number_ranges(Steps steps, uint count, __global Range *ranges)
{
    uint doubt = 0;
    for (uint k = 0; k < count; k++) {
        TapeStep step = steps[k];
        if (step.word & SLICE_DOUBT && !TAPE_TAKES_THREE(TAPE_OP(step.word))) { // of those the operands have doubts
            Range a = ranges[SLICE_A(step.word)], b = second_range(step, ranges), r;
            doubtful_range(step, &a, &b, &doubt, &r);
            ranges[SLICE_POINT + k] = r;
        } else {
            ranges[SLICE_POINT + k] = step_number_range(step, ranges);
        }
    }
    return doubt;
}

// --- what is known of conditions: bits 0-15 the parts where it holds all over, 16-31 where it holds nowhere

INLINE uint known_compare(TapeStep step, __global const Range *ranges, uint doubt)
{
    Range a = ranges[SLICE_A(step.word)], b;
    uint holds, fails;
    float t = as_float(step.b);
    switch (TAPE_OP(step.word)) {
    case SLICE_BELOW:
        holds = mask_bits(a.high < t);
        fails = mask_bits(a.low >= t);
        break;
    case SLICE_FROM:
        holds = mask_bits(a.low >= t);
        fails = mask_bits(a.high < t);
        break;
    case SLICE_LESS:
        b = ranges[step.b];
        holds = mask_bits(a.high < b.low);
        fails = mask_bits(a.low >= b.high);
        break;
    default:
        b = ranges[step.b];
        holds = mask_bits(a.low >= b.high);
        fails = mask_bits(a.high < b.low);
        break;
    }
    if (step.word & SLICE_DOUBT) holds &= ~doubt;
    return holds | fails << 16;
}

NOINLINE static uint program_known(Steps steps, uint numbers, uint compares, uint logics, Memory m)
{
    uint doubt = number_ranges(steps, numbers, m.ranges);
    steps += numbers;
    for (uint k = 0; k < compares; k++) m.known[k] = known_compare(steps[k], m.ranges, doubt);
    steps += compares;
    for (uint k = 0; k < logics; k++) {
        uint a = m.known[SLICE_A(steps[k].word)], b = m.known[steps[k].b];
        uint both = a & b, either = a | b;
        uint swap = TAPE_OP(steps[k].word) == SLICE_AND ? 0xffffu : 0xffff0000u; // where both must
        m.known[compares + k] = (both & swap) | (either & ~swap);
    }
    return m.known[compares + logics - 1];
}

// --- what parts need

typedef struct Counts { // by part
    uint16 numbers, compares, logics;
} Counts;

#define PART ((uint16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))

INLINE uint16 each_bit(uint bits)
{
    return ((uint16)(bits) >> PART) & 1u;
}

INLINE uint decided(uint known)
{
    return (known | known >> 16) & 0xffffu;
}

// The parts where the first operand (bits 0-15) or the second one (16-31) takes the place of the result, all over the part: of MIN and MAX the one that is it,
// of sums the one beside which the other is 0. What takes the place must depend on the same, so that the steps that use it stay as they are.
static uint chosen(TapeStep step, __global const Range *ranges)
{
    uint op = TAPE_OP(step.word), class = SLICE_CLASS(step.word), first, second;
    int sum = (step.word & SLICE_VANISHES) != 0;
    if ((op != TAPE_MIN && op != TAPE_MAX && !sum) || step.word & SLICE_DOUBT) return 0;
    Range a = ranges[SLICE_A(step.word)], b = second_range(step, ranges);
    if (sum) {
        first = mask_bits((b.low == 0.0f) & (b.high == 0.0f));
        second = op == TAPE_ADD ? mask_bits((a.low == 0.0f) & (a.high == 0.0f)) & ~first : 0u;
    } else {
        uint a_less = mask_bits(a.high < b.low), b_less = mask_bits(b.high < a.low);
        first = op == TAPE_MIN ? a_less : b_less;
        second = op == TAPE_MIN ? b_less : a_less;
    }
    if (SLICE_CLASS_A(step.word) != class) first = 0;
    if (step.word & SLICE_LITERAL || SLICE_CLASS_B(step.word) != class) second = 0;
    return first | second << 16;
}

static void trace_numbers(Steps steps, uint numbers, Memory m, Counts *counts)
{
    for (uint k = numbers; k-- > 0;) {
        uint need = m.need[SLICE_POINT + k];
        if (!need) continue;
        TapeStep step = steps[k];
        uint choice = chosen(step, m.ranges), first = choice & 0xffffu, second = choice >> 16;
        m.choice[SLICE_POINT + k] = choice;
        if (TAPE_TAKES_THREE(TAPE_OP(step.word))) {
            m.need[step.b & 0xffffu] |= (ushort)need;
            m.need[step.b >> 16] |= (ushort)need;
        } else if (!(step.word & SLICE_LITERAL)) {
            m.need[step.b] |= (ushort)(need & ~first);
        }
        m.need[SLICE_A(step.word)] |= (ushort)(need & ~second);
        counts->numbers += each_bit(need & ~(first | second));
    }
}

NOINLINE static void trace(Steps steps, uint numbers, uint compares, uint logics, uint parts, Memory m, Counts *counts)
{
    counts->numbers = counts->compares = counts->logics = (uint16)(0);
    for (uint k = 0; k < numbers + SLICE_POINT; k++) m.need[k] = 0;
    for (uint k = 0; k < compares + logics; k++) m.want[k] = 0;
    m.want[compares + logics - 1] = (ushort)parts;
    for (uint k = logics; k-- > 0;) {
        uint want = m.want[compares + k];
        if (!want) continue;
        TapeStep step = steps[numbers + compares + k];
        uint a = SLICE_A(step.word), b = step.b, known_a = decided(m.known[a]), known_b = decided(m.known[b]);
        m.want[a] |= (ushort)(want & ~known_a);
        m.want[b] |= (ushort)(want & ~known_b);
        counts->logics += each_bit(want & ~(known_a | known_b));
    }
    for (uint k = 0; k < compares; k++) {
        uint want = m.want[k];
        if (!want) continue;
        TapeStep step = steps[numbers + k];
        m.need[SLICE_A(step.word)] |= (ushort)want;
        if (!(step.word & SLICE_LITERAL)) m.need[step.b] |= (ushort)want;
        counts->compares += each_bit(want);
    }
    trace_numbers(steps, numbers, m, counts);
}

// --- programs of parts

INLINE short16 parts_mask(uint bits)
{
    return ((ushort16)((ushort)bits) & (ushort16)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768)) != (ushort16)(0);
}

INLINE ushort16 parts_of(__global const ushort *list, uint k)
{
    return ((__global const ushort16 *)list)[k];
}

// Writes the programs of parts. `at`: of each the next step. In programs of parts of 16 x 16 pixels (`leaf`) numbers that depend on both are numbered by
// themselves, and so are the others.
NOINLINE static void write_numbers(Steps steps, uint numbers, uint parts, int leaf, Memory m, __global TapeStep *out, uint *at)
{
    __global ushort16 *map = (__global ushort16 *)m.map;
    ushort16 single = (ushort16)(SLICE_POINT), mixed = (ushort16)(0);
    map[0] = (ushort16)(0);
    map[1] = (ushort16)(1);
    for (uint k = 0; k < numbers; k++) {
        uint need = m.need[SLICE_POINT + k] & parts;
        if (!need) continue;
        TapeStep step = steps[k];
        uint op = TAPE_OP(step.word), choice = m.choice[SLICE_POINT + k], first = choice & need, second = choice >> 16 & need;
        uint written = need & ~(first | second);
        __global const ushort *a = m.map + 16 * SLICE_A(step.word), *b = m.map, *c = m.map;
        if (TAPE_TAKES_THREE(op)) {
            b += 16 * (step.b & 0xffffu);
            c += 16 * (step.b >> 16);
        } else if (!(step.word & SLICE_LITERAL)) {
            b += 16 * step.b;
        }
        for (uint left = written; left; left &= left - 1u) {
            uint part = LOW_BIT(left);
            uint other = step.word & SLICE_LITERAL ? step.b : TAPE_TAKES_THREE(op) ? b[part] | (uint)c[part] << 16 : b[part];
            out[at[part]++] = (TapeStep){(step.word & 0xffffu) | (uint)a[part] << 16, other};
        }
        ushort16 one = as_ushort16(parts_mask(written)); // -1 where it is written
        int apart = leaf && SLICE_CLASS(step.word) == 3u;
        ushort16 to = apart ? mixed : single;
        if (apart) mixed -= one;
        else single -= one;
        if (first | second) {
            to = parts_mask(first) ? parts_of(a, 0) : to;
            to = parts_mask(second) ? parts_of(b, 0) : to;
        }
        map[SLICE_POINT + k] = to;
    }
}

NOINLINE static void write_conditions(Steps steps, uint numbers, uint compares, uint logics, uint parts, Memory m, __global TapeStep *out, uint *at)
{
    __global ushort16 *place = (__global ushort16 *)m.place;
    ushort16 next = (ushort16)(0);
    for (uint k = 0; k < compares; k++) {
        uint want = m.want[k] & parts;
        if (!want) continue;
        TapeStep step = steps[numbers + k];
        __global const ushort *a = m.map + 16 * SLICE_A(step.word), *b = m.map + (step.word & SLICE_LITERAL ? 0u : 16u * step.b);
        for (uint left = want; left; left &= left - 1u) {
            uint part = LOW_BIT(left);
            out[at[part]++] = (TapeStep){(step.word & 0xffffu) | (uint)a[part] << 16, step.word & SLICE_LITERAL ? step.b : b[part]};
        }
        place[k] = next;
        next -= as_ushort16(parts_mask(want));
    }
    for (uint k = 0; k < logics; k++) {
        uint want = m.want[compares + k] & parts;
        if (!want) continue;
        TapeStep step = steps[numbers + compares + k];
        uint a = SLICE_A(step.word), b = step.b, known_a = decided(m.known[a]), known_b = decided(m.known[b]);
        uint both = want & ~(known_a | known_b);
        ushort16 to = parts_mask(known_a) ? place[b] : place[a]; // where one side is known it holds, and the other takes its place
        if (both) {
            __global const ushort *first = m.place + 16 * a, *second = m.place + 16 * b;
            for (uint left = both; left; left &= left - 1u) {
                uint part = LOW_BIT(left);
                out[at[part]++] = (TapeStep){(step.word & 0xffffu) | (uint)first[part] << 16, second[part]};
            }
            short16 here = parts_mask(both);
            to = here ? next : to;
            next -= as_ushort16(here);
        }
        place[compares + k] = to;
    }
}

// --- pixels

// What a number of the program depends on decides where it stands: in the 16 packets of `mixed`, or in one of `single`.
INLINE FLOAT row_of(uint class, uint number, uint row, __global const FLOAT *single, __global const FLOAT *mixed)
{
    if (class == 3u) return mixed[16u * number + row];
    if (class == SLICE_ACROSS) return single[number];
    return all_of(((__global const float *)(single + number))[row]);
}

#define ROWS(expression)                                                                                 \
    if (class_a == SLICE_UP) {                                                                           \
        for (uint row = 0; row < 16; row++) {                                                            \
            FLOAT x = all_of(((__global const float *)(single + a))[row]), y = second[stride_b * row];   \
            to[row] = expression;                                                                        \
        }                                                                                                \
    } else if (class_b == SLICE_UP) {                                                                    \
        for (uint row = 0; row < 16; row++) {                                                            \
            FLOAT x = first[stride_a * row], y = all_of(((__global const float *)(single + step.b))[row]); \
            to[row] = expression;                                                                        \
        }                                                                                                \
    } else {                                                                                             \
        for (uint row = 0; row < 16; row++) {                                                            \
            FLOAT x = first[stride_a * row], y = second[stride_b * row];                                 \
            to[row] = expression;                                                                        \
        }                                                                                                \
    }                                                                                                    \
    return;

// A number that depends on both, 16 rows of it.
static void mixed_number(TapeStep step, __global const FLOAT *single, __global const FLOAT *mixed, __global FLOAT *to)
{
    uint a = SLICE_A(step.word), class_a = SLICE_CLASS_A(step.word), class_b = SLICE_CLASS_B(step.word);
    if (!(step.word & SLICE_LITERAL) && TAPE_OP(step.word) <= TAPE_MUL) {
        __global const FLOAT *first = class_a == 3u ? mixed + 16u * a : single + a, *second = class_b == 3u ? mixed + 16u * step.b : single + step.b;
        uint stride_a = class_a == 3u, stride_b = class_b == 3u;
        switch (TAPE_OP(step.word)) {
        case TAPE_ADD: ROWS(x + y)
        case TAPE_SUB: ROWS(x - y)
        case TAPE_MUL: ROWS(x * y)
        default: break;
        }
    }
    for (uint row = 0; row < 16; row++) {
        FLOAT x = row_of(class_a, a, row, single, mixed), y = all_of(as_float(step.b));
        if (TAPE_TAKES_THREE(TAPE_OP(step.word))) {
            to[row] = third_number(TAPE_OP(step.word), x, mixed[16u * (step.b & 0xffffu) + row], mixed[16u * (step.b >> 16) + row]);
            continue;
        }
        if (!(step.word & SLICE_LITERAL)) y = row_of(class_b, step.b, row, single, mixed);
        to[row] = step_number(step, x, y);
    }
}

INLINE INT compared(uint op, FLOAT a, FLOAT b)
{
    if (op == SLICE_BELOW || op == SLICE_LESS) return a < b;
    return a >= b;
}

static void compare_pixels(TapeStep step, __global const FLOAT *single, __global const FLOAT *mixed, __global ushort16 *to)
{
    uint a = SLICE_A(step.word), op = TAPE_OP(step.word), class_a = SLICE_CLASS_A(step.word), class_b = SLICE_CLASS_B(step.word);
    bool literal = step.word & SLICE_LITERAL;
    if (literal) class_b = class_a;
    if (class_a == class_b && class_a != 3u) {
        FLOAT b = all_of(as_float(step.b));
        if (!literal) b = single[step.b];
        INT mask = compared(op, single[a], b);
        *to = class_a == SLICE_ACROSS ? (ushort16)((ushort)mask_bits(mask)) : convert_ushort16(mask);
        return;
    }
    __global ushort *rows = (__global ushort *)to;
    if (literal) {
        __global const FLOAT *first = mixed + 16u * a;
        float t = as_float(step.b);
        if (op == SLICE_BELOW)
            for (uint row = 0; row < 16; row++) rows[row] = (ushort)mask_bits(first[row] < t);
        else
            for (uint row = 0; row < 16; row++) rows[row] = (ushort)mask_bits(first[row] >= t);
        return;
    }
    for (uint row = 0; row < 16; row++)
        rows[row] = (ushort)mask_bits(compared(op, row_of(class_a, a, row, single, mixed), row_of(class_b, step.b, row, single, mixed)));
}

// The conditions of 16 x 16 pixels.
NOINLINE static ushort16 leaf_pixels(Steps steps, uint numbers, uint compares, uint logics, FLOAT across, FLOAT up, Memory m)
{
    __global FLOAT *single = (__global FLOAT *)m.ranges, *mixed = m.mixed, *next = single + SLICE_POINT;
    __global ushort16 *bits = m.bits;
    single[0] = across;
    single[1] = up;
    for (uint k = 0; k < numbers; k++) {
        TapeStep step = steps[k];
        if (SLICE_CLASS(step.word) == 3u) {
            mixed_number(step, single, m.mixed, mixed);
            mixed += 16;
        } else {
            FLOAT b = all_of(as_float(step.b));
            if (!(step.word & SLICE_LITERAL)) b = single[step.b];
            *next++ = step_number(step, single[SLICE_A(step.word)], b);
        }
    }
    for (uint k = 0; k < compares; k++) compare_pixels(steps[numbers + k], single, m.mixed, bits + k);
    steps += numbers + compares;
    for (uint k = 0; k < logics; k++) {
        TapeStep step = steps[k];
        ushort16 a = bits[SLICE_A(step.word)], b = bits[step.b];
        bits[compares + k] = TAPE_OP(step.word) == SLICE_AND ? a & b : a | b;
    }
    return bits[compares + logics - 1];
}

// 16 pixels beside each other, by a whole program: the bits where it holds.
static uint row_pixels(Steps steps, uint numbers, uint compares, uint logics, FLOAT across, float up, Memory m)
{
    __global FLOAT *v = (__global FLOAT *)m.ranges;
    v[0] = across;
    v[1] = all_of(up);
    for (uint k = 0; k < numbers; k++) {
        TapeStep step = steps[k];
        FLOAT a = v[SLICE_A(step.word)], b = all_of(as_float(step.b));
        if (TAPE_TAKES_THREE(TAPE_OP(step.word))) {
            v[SLICE_POINT + k] = third_number(TAPE_OP(step.word), a, v[step.b & 0xffffu], v[step.b >> 16]);
            continue;
        }
        if (!(step.word & SLICE_LITERAL)) b = v[step.b];
        v[SLICE_POINT + k] = step_number(step, a, b);
    }
    for (uint k = 0; k < compares; k++) {
        TapeStep step = steps[numbers + k];
        FLOAT b = all_of(as_float(step.b));
        if (!(step.word & SLICE_LITERAL)) b = v[step.b];
        m.want[k] = (ushort)mask_bits(compared(TAPE_OP(step.word), v[SLICE_A(step.word)], b));
    }
    steps += numbers + compares;
    for (uint k = 0; k < logics; k++) {
        ushort a = m.want[SLICE_A(steps[k].word)], b = m.want[steps[k].b];
        m.want[compares + k] = TAPE_OP(steps[k].word) == SLICE_AND ? a & b : a | b;
    }
    return m.want[compares + logics - 1];
}
