// Making a tape is a sweep down the expression's nodes, which marks what is reached and where something undefined may
// not matter, and a sweep up, which writes steps. Evaluations are one loop over the steps each.
#include "compiler/tape.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/noise.h"
#include "compiler/pairs.h"
#include "compiler/turns.h"

// --- what an expression is made of

enum { MARK_REACHED = 1, MARK_STRICT = 2 };

// Whether an operand decides in any case: a branch that is not chosen may be undefined.
static bool is_strict_operand(IrOp op, uint32_t k)
{
    if (op == OP_SELECT) return k == 0;
    return (op != OP_AND && op != OP_OR) || k == 0;
}

static uint8_t *mark(const Ir *ir, IrId expression, Arena *scratch)
{
    uint8_t *marks = arena_array(scratch, uint8_t, expression + 1);
    marks[expression] = MARK_REACHED | MARK_STRICT;
    for (IrId id = expression; id > 0; id--) {
        if (!marks[id] || ir_at(ir, id)->rate != RATE_POINT) continue;
        for (uint32_t k = 0; k < ir_at(ir, id)->count; k++) {
            uint8_t below = is_strict_operand((IrOp)ir_at(ir, id)->op, k) ? marks[id] : MARK_REACHED;
            marks[ir_operand(ir, id, k)] |= below;
        }
    }
    return marks;
}

void tape_needs(const Ir *ir, IrId expression, void *context, void (*need)(void *context, IrId scalar))
{
    Arena scratch = {0};
    const uint8_t *marks = mark(ir, expression, &scratch);
    for (IrId id = 1; id <= expression; id++) {
        if (marks[id] && ir_at(ir, id)->rate != RATE_POINT) need(context, id);
    }
    arena_release(&scratch);
}

// --- making

typedef struct Maker {
    Arena *arena;
    const Ir *ir;
    const TapeSlots *slots;
    TapeStep *steps;
    uint32_t count, capacity;
    uint32_t *values; // of each node, the number of its value + 1
    uint32_t lazy;    // flag of the steps that are being written
} Maker;

static uint32_t put(Maker *m, uint32_t op, uint32_t a, uint32_t b)
{
    m->steps = array_room(m->arena, m->steps, m->count, &m->capacity, sizeof *m->steps);
    m->steps[m->count] = (TapeStep){op | m->lazy | a << 8, b};
    return TAPE_POINT + m->count++;
}

static bool is_number(const Maker *m, IrId id)
{
    return ir_at(m->ir, id)->rate != RATE_POINT;
}

static Slot slot_of(const Maker *m, IrId id)
{
    return m->slots->scalar(m->slots->context, id);
}

// The value of an operand; what is no expression becomes a step of its own.
static uint32_t value_of(Maker *m, IrId id)
{
    if (!m->values[id]) m->values[id] = put(m, TAPE_NUMBER, 0, slot_of(m, id)) + 1;
    return m->values[id] - 1;
}

static uint32_t put_unary(Maker *m, IrId id, uint32_t op)
{
    return put(m, op, value_of(m, ir_operand(m->ir, id, 0)), 0);
}

// `back` is the operation with its operands exchanged, TAPE_OPS if there is none.
static uint32_t put_binary(Maker *m, IrId id, uint32_t op, uint32_t back)
{
    IrId a = ir_operand(m->ir, id, 0), b = ir_operand(m->ir, id, 1);
    if (is_number(m, b)) return put(m, op | TAPE_LITERAL, value_of(m, a), slot_of(m, b));
    if (is_number(m, a) && back < TAPE_OPS) return put(m, back | TAPE_LITERAL, value_of(m, b), slot_of(m, a));
    if (op == TAPE_MUL && a == b) return put(m, TAPE_SQUARE, value_of(m, a), 0);
    uint32_t first = value_of(m, a);
    return put(m, op, first, value_of(m, b));
}

// A power that is known and whole is multiplied out; the square root is exact.
static uint32_t put_power(Maker *m, IrId id)
{
    double exponent;
    uint32_t base = value_of(m, ir_operand(m->ir, id, 0));
    bool known = ir_is_const(m->ir, ir_operand(m->ir, id, 1), &exponent);
    if (known && exponent == 2) return put(m, TAPE_SQUARE, base, 0);
    if (known && exponent == 0.5) return put(m, TAPE_SQRT, base, 0);
    if (known && exponent == floor(exponent) && fabs(exponent) <= TAPE_POWER_MAX)
        return put(m, TAPE_POWER, base, (uint32_t)(int32_t)exponent);
    return put_binary(m, id, TAPE_POW, TAPE_OPS);
}

static uint32_t put_select(Maker *m, IrId id)
{
    uint32_t condition = value_of(m, ir_operand(m->ir, id, 0));
    uint32_t a = value_of(m, ir_operand(m->ir, id, 1)), b = value_of(m, ir_operand(m->ir, id, 2));
    return put(m, TAPE_SELECT, condition, a | b << 16);
}

static uint32_t put_noise(Maker *m, IrId id, uint32_t op)
{
    uint32_t x = value_of(m, ir_operand(m->ir, id, 0)), y = value_of(m, ir_operand(m->ir, id, 1));
    return put(m, op, x, y | value_of(m, ir_operand(m->ir, id, 2)) << 16);
}

enum { SUMMANDS_MAX = 64 };

// The exponents of a sum of exponentials; 0 where it is something else.
static uint32_t exponents_of(const Maker *m, IrId sum, IrId exponents[SUMMANDS_MAX])
{
    IrId waiting[SUMMANDS_MAX] = {sum};
    uint32_t count = 0;
    for (uint32_t left = 1; left;) {
        IrId id = waiting[--left];
        IrOp op = (IrOp)ir_at(m->ir, id)->op;
        if (is_number(m, id) || (op != OP_ADD && op != OP_EXP) || count + left + 2 > SUMMANDS_MAX) return 0;
        if (op == OP_EXP) {
            exponents[count++] = ir_operand(m->ir, id, 0);
        } else {
            waiting[left++] = ir_operand(m->ir, id, 1);
            waiting[left++] = ir_operand(m->ir, id, 0);
        }
    }
    return count > 1 ? count : 0;
}

// The logarithm of a sum of exponentials is one operation, term by term: its parts would soon be too large.
static uint32_t put_log(Maker *m, IrId id)
{
    IrId exponents[SUMMANDS_MAX];
    uint32_t count = exponents_of(m, ir_operand(m->ir, id, 0), exponents);
    if (!count) return put_unary(m, id, TAPE_LOG);
    uint32_t sum = value_of(m, exponents[0]);
    for (uint32_t k = 1; k < count; k++) {
        uint32_t next = value_of(m, exponents[k]);
        sum = put(m, TAPE_LSE, sum, next);
    }
    return sum;
}

static uint32_t put_node(Maker *m, IrId id)
{
    switch ((IrOp)ir_at(m->ir, id)->op) {
    case OP_X: return 0;
    case OP_Y: return 1;
    case OP_Z: return 2;
    case OP_ADD: return put_binary(m, id, TAPE_ADD, TAPE_ADD);
    case OP_SUB: return put_binary(m, id, TAPE_SUB, TAPE_BACK_SUB);
    case OP_MUL: return put_binary(m, id, TAPE_MUL, TAPE_MUL);
    case OP_DIV: return put_binary(m, id, TAPE_DIV, TAPE_BACK_DIV);
    case OP_MIN: return put_binary(m, id, TAPE_MIN, TAPE_MIN);
    case OP_MAX: return put_binary(m, id, TAPE_MAX, TAPE_MAX);
    case OP_MOD: return put_binary(m, id, TAPE_MOD, TAPE_OPS);
    case OP_POW: return put_power(m, id);
    case OP_ATAN2: return put_binary(m, id, TAPE_ATAN2, TAPE_OPS);
    case OP_LT: return put_binary(m, id, TAPE_LT, TAPE_OPS);
    case OP_LE: return put_binary(m, id, TAPE_LE, TAPE_OPS);
    case OP_EQ: return put_binary(m, id, TAPE_EQ, TAPE_EQ);
    case OP_AND: return put_binary(m, id, TAPE_AND, TAPE_OPS);
    case OP_OR: return put_binary(m, id, TAPE_OR, TAPE_OPS);
    case OP_NEG: return put_unary(m, id, TAPE_NEG);
    case OP_ABS: return put_unary(m, id, TAPE_ABS);
    case OP_SIGN: return put_unary(m, id, TAPE_SIGN);
    case OP_SQRT: return put_unary(m, id, TAPE_SQRT);
    case OP_EXP: return put_unary(m, id, TAPE_EXP);
    case OP_LOG: return put_log(m, id);
    case OP_SIN: return put_unary(m, id, TAPE_SIN);
    case OP_COS: return put_unary(m, id, TAPE_COS);
    case OP_TAN: return put_unary(m, id, TAPE_TAN);
    case OP_ASIN: return put_unary(m, id, TAPE_ASIN);
    case OP_ACOS: return put_unary(m, id, TAPE_ACOS);
    case OP_ATAN: return put_unary(m, id, TAPE_ATAN);
    case OP_FLOOR: return put_unary(m, id, TAPE_FLOOR);
    case OP_CEIL: return put_unary(m, id, TAPE_CEIL);
    case OP_ROUND: return put_unary(m, id, TAPE_ROUND);
    case OP_NOT: return put_unary(m, id, TAPE_NOT);
    case OP_SELECT: return put_select(m, id);
    case OP_NOISE: return put_noise(m, id, TAPE_NOISE);
    case OP_CELLS: return put_noise(m, id, TAPE_CELLS);
    default: return put(m, TAPE_NUMBER, 0, slot_of(m, id)); // known once a frame
    }
}

static bool has_operand_b(uint32_t op)
{
    return (op >= TAPE_ADD && op <= TAPE_MAX) || op == TAPE_POW || op == TAPE_LSE || op == TAPE_ATAN2 ||
           op == TAPE_MOD || (op >= TAPE_LT && op <= TAPE_OR);
}

int tape_operands(TapeStep step, uint32_t operands[3])
{
    uint32_t op = TAPE_OP(step.word);
    int count = 0;
    if (op == TAPE_NUMBER) return 0;
    operands[count++] = TAPE_A(step.word);
    if (TAPE_TAKES_THREE(op)) {
        operands[count++] = step.b & 0xffff;
        operands[count++] = step.b >> 16;
    }
    if (has_operand_b(op) && !(step.word & TAPE_LITERAL)) operands[count++] = step.b;
    return count;
}

TapeStep tape_renumbered(TapeStep step, const uint32_t *number)
{
    uint32_t op = TAPE_OP(step.word);
    if (op != TAPE_NUMBER) step.word = (step.word & 255u) | number[TAPE_A(step.word)] << 8;
    if (TAPE_TAKES_THREE(op)) step.b = number[step.b & 0xffff] | number[step.b >> 16] << 16;
    if (has_operand_b(op) && !(step.word & TAPE_LITERAL)) step.b = number[step.b];
    return step;
}

// Steps whose value nothing needs go, and the others are numbered anew.
static void drop_unused(Maker *m, Arena *scratch)
{
    uint32_t count = 0, *number = arena_array(scratch, uint32_t, TAPE_POINT + m->count); // 1: needed
    if (!m->count || m->count > TAPE_STEPS_MAX) return;
    number[TAPE_POINT + m->count - 1] = 1;
    for (uint32_t k = m->count; k-- > 0;) {
        uint32_t operands[3];
        int used = number[TAPE_POINT + k] ? tape_operands(m->steps[k], operands) : 0;
        for (int i = 0; i < used; i++) number[operands[i]] = 1;
    }
    for (uint32_t k = 0; k < TAPE_POINT; k++) number[k] = k;
    for (uint32_t k = 0; k < m->count; k++) {
        if (!number[TAPE_POINT + k]) continue;
        m->steps[count] = tape_renumbered(m->steps[k], number);
        number[TAPE_POINT + k] = TAPE_POINT + count++;
    }
    m->count = count;
}

bool tape_new(Arena *arena, const Ir *ir, IrId expression, const TapeSlots *slots, TapeStep **steps, uint32_t *count)
{
    Arena scratch = {0};
    Maker m = {.arena = arena, .ir = ir, .slots = slots};
    const uint8_t *marks = mark(ir, expression, &scratch);
    m.values = arena_array(&scratch, uint32_t, expression + 1);
    uint32_t last = 0;
    for (IrId id = 1; id <= expression && m.count <= TAPE_STEPS_MAX; id++) {
        if (!marks[id] || (is_number(&m, id) && id != expression)) continue;
        m.lazy = marks[id] & MARK_STRICT ? 0 : TAPE_LAZY;
        last = put_node(&m, id);
        m.values[id] = last + 1;
    }
    // The last step is the value of the tape, so a bare coordinate is made one.
    m.lazy = 0;
    if (m.count <= TAPE_STEPS_MAX && last + 1 != TAPE_POINT + m.count) put(&m, TAPE_MIN, last, last);
    if (!m.count) put(&m, TAPE_MIN, last, last);
    drop_unused(&m, &scratch);
    arena_release(&scratch);
    *steps = m.steps;
    *count = m.count;
    return m.count <= TAPE_STEPS_MAX;
}

bool tape_check(const TapeStep *steps, uint32_t count, Slot slot_count)
{
    if (!count || count > TAPE_STEPS_MAX + 1) return false;
    for (uint32_t k = 0; k < count; k++) {
        uint32_t op = TAPE_OP(steps[k].word), a = TAPE_A(steps[k].word), b = steps[k].b, known = TAPE_POINT + k;
        if (op >= TAPE_OPS || a >= known) return false;
        if (TAPE_TAKES_THREE(op) && ((b & 0xffff) >= known || b >> 16 >= known)) return false;
        bool slot = op == TAPE_NUMBER || (has_operand_b(op) && steps[k].word & TAPE_LITERAL);
        if (slot ? b >= slot_count : has_operand_b(op) && b >= known) return false;
        if (op == TAPE_POWER && abs((int32_t)b) > TAPE_POWER_MAX) return false;
    }
    return true;
}

// --- numbers

static bool is_literal(TapeStep step)
{
    return TAPE_OP(step.word) == TAPE_NUMBER || step.word & TAPE_LITERAL;
}

// A literal exponent that is whole in this frame is multiplied out, as one that is const.
static bool whole_power(TapeStep step, double exponent, TapeStep *power)
{
    if (TAPE_OP(step.word) != TAPE_POW || !(step.word & TAPE_LITERAL)) return false;
    if (exponent != floor(exponent) || !(fabs(exponent) <= TAPE_POWER_MAX)) return false;
    *power = (TapeStep){(step.word & ~(63u | TAPE_LITERAL)) | TAPE_POWER, (uint32_t)(int32_t)exponent};
    return true;
}

void tape_bake(const TapeStep *steps, uint32_t count, const double *values, TapeStep *baked)
{
    for (uint32_t k = 0; k < count; k++) {
        baked[k] = steps[k];
        if (!is_literal(steps[k]) || whole_power(steps[k], values[steps[k].b], &baked[k])) continue;
        float number = (float)values[steps[k].b];
        memcpy(&baked[k].b, &number, sizeof number);
    }
}

// --- at a point

typedef struct Point { // a value and its derivatives by x, y, z
    double f, d[3];
} Point;

static Point chain(double f, Point a, double by_a)
{
    Point r = {.f = f};
    for (int k = 0; k < 3; k++) r.d[k] = a.d[k] == 0 ? 0 : by_a * a.d[k];
    return r;
}

static Point chain2(double f, Point a, double by_a, Point b, double by_b)
{
    Point r = chain(f, a, by_a), s = chain(f, b, by_b);
    for (int k = 0; k < 3; k++) r.d[k] += s.d[k];
    return r;
}

static Point undefined(void)
{
    return (Point){.f = NAN};
}

static double truth(bool b)
{
    return b ? 1 : 0;
}

static Point flat(double f)
{
    return (Point){.f = f};
}

static Point unary_at(uint32_t op, Point a)
{
    double f = a.f;
    switch (op) {
    case TAPE_NEG: return chain(-f, a, -1);
    case TAPE_ABS: return f < 0 ? chain(-f, a, -1) : a;
    case TAPE_SQUARE: return chain(f * f, a, 2 * f);
    case TAPE_SQRT: return chain(sqrt(f), a, 0.5 / sqrt(f));
    case TAPE_EXP: return chain(exp(f), a, exp(f));
    case TAPE_LOG: return chain(log(f), a, 1 / f);
    case TAPE_SIN: return chain(sin(f), a, cos(f));
    case TAPE_COS: return chain(cos(f), a, -sin(f));
    case TAPE_TAN: return chain(tan(f), a, 1 + tan(f) * tan(f));
    case TAPE_ASIN: return chain(asin(f), a, 1 / sqrt(1 - f * f));
    case TAPE_ACOS: return chain(acos(f), a, -1 / sqrt(1 - f * f));
    case TAPE_ATAN: return chain(atan(f), a, 1 / (1 + f * f));
    case TAPE_FLOOR: return flat(floor(f));
    case TAPE_CEIL: return flat(ceil(f));
    case TAPE_ROUND: return flat(round(f));
    case TAPE_SIGN: return isnan(f) ? undefined() : flat(truth(f > 0) - truth(f < 0));
    case TAPE_NOT: return isnan(f) ? undefined() : flat(truth(f == 0));
    default: return undefined();
    }
}

static Point power_at(Point a, int32_t n)
{
    if (isnan(a.f)) return undefined(); // also to the power 0
    return chain(pow(a.f, n), a, n ? n * pow(a.f, n - 1) : 0);
}

static Point lazy_at(uint32_t op, Point a, Point b)
{
    bool decided = op == TAPE_AND ? a.f == 0 : a.f != 0;
    if (isnan(a.f) || (!decided && isnan(b.f))) return undefined();
    return flat(truth(decided ? op == TAPE_OR : b.f != 0));
}

// a - b floor(a / b), exact: that difference itself would be lost where a / b is large.
static double remainder_at(double a, double b)
{
    double r = fmod(a, b);
    return r != 0 && (r < 0) != (b < 0) ? r + b : r;
}

static Point binary_at(uint32_t op, Point a, Point b)
{
    double f = a.f, g = b.f;
    if (op == TAPE_AND || op == TAPE_OR) return lazy_at(op, a, b);
    if (isnan(f) || isnan(g)) return undefined();
    switch (op) {
    case TAPE_ADD: return chain2(f + g, a, 1, b, 1);
    case TAPE_SUB: return chain2(f - g, a, 1, b, -1);
    case TAPE_BACK_SUB: return chain2(g - f, b, 1, a, -1);
    case TAPE_MUL: return chain2(f * g, a, g, b, f);
    case TAPE_DIV: return chain2(f / g, a, 1 / g, b, -f / (g * g));
    case TAPE_BACK_DIV: return chain2(g / f, b, 1 / f, a, -g / (f * f));
    case TAPE_MIN: return f <= g ? a : b;
    case TAPE_MAX: return f >= g ? a : b;
    case TAPE_POW: // whole powers that are known are TAPE_POWER
        if (f < 0) return undefined();
        return chain2(pow(f, g), a, g * pow(f, g - 1), b, f > 0 ? pow(f, g) * log(f) : 0);
    case TAPE_LSE: {
        double most = fmax(f, g), r = isinf(most) ? most : most + log1p(exp(-fabs(f - g)));
        return chain2(r, a, 1 / (1 + exp(g - f)), b, 1 / (1 + exp(f - g)));
    }
    case TAPE_ATAN2: return chain2(atan2(f, g), a, g / (f * f + g * g), b, -f / (f * f + g * g));
    case TAPE_MOD: return chain2(remainder_at(f, g), a, 1, b, -floor(f / g));
    case TAPE_LT: return flat(truth(f < g));
    case TAPE_LE: return flat(truth(f <= g));
    case TAPE_EQ: return flat(truth(f == g));
    default: return undefined();
    }
}

static Point noise_of(uint32_t op, Point x, Point y, Point z)
{
    double p[3] = {x.f, y.f, z.f}, by[3];
    if (!isfinite(x.f) || !isfinite(y.f) || !isfinite(z.f)) return undefined();
    double f = op == TAPE_NOISE ? noise_gradient_slopes(p, by) : noise_cells_slopes(p, by);
    Point r = chain2(f, x, by[0], y, by[1]), third = chain(0, z, by[2]);
    for (int k = 0; k < 3; k++) r.d[k] += third.d[k];
    return r;
}

static Point step_at(TapeStep step, const double *values, const Point *v)
{
    uint32_t op = TAPE_OP(step.word);
    Point a = v[TAPE_A(step.word)];
    TapeStep power;
    if (op == TAPE_NUMBER) return flat(values[step.b]);
    if (op == TAPE_POWER) return power_at(a, (int32_t)step.b);
    if (op == TAPE_SELECT) return isnan(a.f) ? undefined() : v[a.f != 0 ? step.b & 0xffff : step.b >> 16];
    if (TAPE_TAKES_THREE(op)) return noise_of(op, a, v[step.b & 0xffff], v[step.b >> 16]);
    if (!has_operand_b(op)) return unary_at(op, a);
    if (is_literal(step) && whole_power(step, values[step.b], &power)) return power_at(a, (int32_t)power.b);
    return binary_at(op, a, is_literal(step) ? flat(values[step.b]) : v[step.b]);
}

FieldValue tape_steps_at(const TapeStep *steps, uint32_t count, const double *values, const double point[3],
                         double *work)
{
    Point *v = (Point *)work;
    for (int k = 0; k < 3; k++) {
        v[k] = flat(point[k]);
        v[k].d[k] = 1;
    }
    for (uint32_t k = 0; k < count; k++) v[TAPE_POINT + k] = step_at(steps[k], values, v);
    Point last = v[TAPE_POINT + count - 1];
    return (FieldValue){last.f, {last.d[0], last.d[1], last.d[2]}};
}

FieldValue tape_at(const Plan *plan, const PlanTape *tape, const double *values, const double point[3], double *work)
{
    return tape_steps_at(plan->tape_steps + tape->first, tape->count, values, point, work);
}

// --- over a box

static Interval power_over(Interval a, int32_t n)
{
    Interval one = interval_of(1, 1);
    if (n == 0) return (Interval){1, 1, a.partial};
    if (n > 0) return interval_power(a, (uint32_t)n);
    return interval_op2(TAPE_DIV, one, interval_power(a, (uint32_t)-n));
}

static Interval step_over(TapeStep step, const double *values, const Interval *v)
{
    uint32_t op = TAPE_OP(step.word);
    Interval a = v[TAPE_A(step.word)];
    TapeStep power;
    if (op == TAPE_NUMBER) return interval_of(values[step.b], values[step.b]);
    if (op == TAPE_POWER) return power_over(a, (int32_t)step.b);
    if (op == TAPE_SELECT) return interval_select(a, v[step.b & 0xffff], v[step.b >> 16]);
    if (TAPE_TAKES_THREE(op)) return interval_op3(op, (const Interval[3]){a, v[step.b & 0xffff], v[step.b >> 16]});
    if (!has_operand_b(op)) return interval_op1(op, a);
    if (is_literal(step) && whole_power(step, values[step.b], &power)) return power_over(a, (int32_t)power.b);
    Interval number = {0};
    if (is_literal(step)) number = interval_of(values[step.b], values[step.b]);
    return interval_op2(op, a, is_literal(step) ? number : v[step.b]);
}

Interval tape_steps_over(const TapeStep *steps, uint32_t count, const double *values, const Interval box[3],
                         double *work)
{
    Interval *v = (Interval *)work;
    memcpy(v, box, 3 * sizeof *v);
    for (uint32_t k = 0; k < count; k++) v[TAPE_POINT + k] = step_over(steps[k], values, v);
    return v[TAPE_POINT + count - 1];
}

Interval tape_over(const Plan *plan, const PlanTape *tape, const double *values, const Interval box[3], double *work)
{
    return tape_steps_over(plan->tape_steps + tape->first, tape->count, values, box, work);
}

// --- bounds

// A search has this many steps to evaluate, and cells at one time.
enum { BOUNDS_CELLS = 512, BOUNDS_LEVELS = 8, BOUNDS_STEPS = 1 << 20 };

typedef struct Cell {
    double low[3], high[3];
} Cell;

typedef struct Search {
    const Plan *plan;
    const PlanTape *tape;
    const double *values;
    double *work;
    int64_t left; // steps
    bool ends[3]; // along which axes slices were cut off: across the others the function may go on for ever
    Cell known;   // around points that are inside: what lies in it is no matter
} Search;

static bool cell_matters(Search *s, const Cell *cell)
{
    Interval box[3];
    for (int k = 0; k < 3; k++) box[k] = interval_of(cell->low[k], cell->high[k]);
    s->left -= s->tape->count + 8;
    Interval f = tape_over(s->plan, s->tape, s->values, box, s->work);
    return !interval_is_empty(f) && f.high >= 0;
}

// Takes from one side of the box what is certainly outside, half of it, a quarter, an eighth and so on, until a 32nd is too
// much. Whether any of it is gone.
static bool cut_side(Search *s, Cell *box, int axis, bool upper)
{
    bool any = false;
    for (double part = 0.5; part > 1.0 / 64 && s->left > 0;) {
        Cell slice = *box;
        double at = upper ? box->high[axis] - part * (box->high[axis] - box->low[axis])
                          : box->low[axis] + part * (box->high[axis] - box->low[axis]);
        *(upper ? &slice.low[axis] : &slice.high[axis]) = at;
        if (!(slice.low[axis] < slice.high[axis]) || cell_matters(s, &slice)) {
            part /= 2;
            continue;
        }
        *(upper ? &box->high[axis] : &box->low[axis]) = at;
        s->ends[axis] = any = true;
    }
    return any;
}

// What is cut along one axis may let more be cut along another.
static void cut_sides(Search *s, Cell *box)
{
    enum { ROUNDS = 8 };
    bool again = true;
    for (int round = 0; round < ROUNDS && again && s->left > BOUNDS_STEPS / 2; round++) {
        again = false;
        for (int side = 0; side < 6; side++) again |= cut_side(s, box, side / 2, side % 2 != 0);
    }
}

// The eight parts of a cell, fewer where an axis is not cut.
static bool part_of(const Search *s, const Cell *cell, uint32_t part, Cell *result)
{
    *result = *cell;
    for (int axis = 0; axis < 3; axis++) {
        bool upper = part >> axis & 1;
        double middle = cell->low[axis] + (cell->high[axis] - cell->low[axis]) / 2;
        if (s->ends[axis])
            *(upper ? &result->low[axis] : &result->high[axis]) = middle;
        else if (upper)
            return false;
    }
    return true;
}

static bool is_known(const Search *s, const Cell *cell)
{
    for (int axis = 0; axis < 3; axis++) {
        if (s->ends[axis] && !(cell->low[axis] >= s->known.low[axis] && cell->high[axis] <= s->known.high[axis]))
            return false;
    }
    return true;
}

static void look_inside(Search *s, const Cell *cell)
{
    double p[3];
    for (int axis = 0; axis < 3; axis++) p[axis] = cell->low[axis] + (cell->high[axis] - cell->low[axis]) / 2;
    s->left -= s->tape->count;
    if (!(tape_at(s->plan, s->tape, s->values, p, s->work).f >= 0)) return;
    for (int axis = 0; axis < 3; axis++) {
        s->known.low[axis] = fmin(s->known.low[axis], p[axis]);
        s->known.high[axis] = fmax(s->known.high[axis], p[axis]);
    }
}

// Fills `next` with what matters of the parts of all cells; false where that is too much.
static bool refine(Search *s, const Cell *cells, uint32_t count, Cell *next, uint32_t *next_count)
{
    *next_count = 0;
    for (uint32_t k = 0; k < count; k++) {
        for (uint32_t part = 0; part < 8; part++) {
            Cell cell;
            if (!part_of(s, &cells[k], part, &cell) || is_known(s, &cell) || !cell_matters(s, &cell)) continue;
            look_inside(s, &cell);
            if (*next_count == BOUNDS_CELLS || s->left < 0) return false;
            next[(*next_count)++] = cell;
        }
    }
    return true;
}

// Makes the box smaller by what is known of tapes that turn two coordinates first (compiler/turns.h).
static void clip_by_turn(const Plan *plan, const PlanTape *tape, const double *values, double low[3], double high[3])
{
    Arena scratch = {0};
    PlanTape rest = {0};
    TapeStep *steps = arena_array(&scratch, TapeStep, tape->count);
    int turned[2];
    if (turns_take(plan->tape_steps + tape->first, tape->count, steps, &rest.count, turned)) {
        double least[3], most[3], reach[3];
        tape_bounds(&(Plan){.tape_steps = steps}, &rest, values, least, most);
        for (int k = 0; k < 3; k++) reach[k] = fmax(fabs(least[k]), fabs(most[k]));
        double radius = hypot(reach[turned[0]], reach[turned[1]]) * (1 + 1e-12);
        for (int k = 0; k < 3; k++) {
            bool turns = k == turned[0] || k == turned[1], empty = !(least[k] <= most[k]);
            low[k] = fmax(low[k], turns && !empty ? -radius : least[k]);
            high[k] = fmin(high[k], turns && !empty ? radius : most[k]);
        }
    }
    arena_release(&scratch);
}

void tape_bounds_within(const Plan *plan, const PlanTape *tape, const double *values, double low[3], double high[3])
{
    clip_by_turn(plan, tape, values, low, high);
    Arena scratch = {0};
    Search s = {.plan = plan, .tape = tape, .values = values, .left = BOUNDS_STEPS};
    s.work = arena_array(&scratch, double, TAPE_WORK *(size_t)(TAPE_POINT + tape->count));
    Cell *cells = arena_array(&scratch, Cell, BOUNDS_CELLS), *next = arena_array(&scratch, Cell, BOUNDS_CELLS);
    uint32_t count = 1, next_count;
    for (int axis = 0; axis < 3; axis++) {
        s.ends[axis] = low[axis] > -TAPE_REACH && high[axis] < TAPE_REACH;
        cells->low[axis] = fmax(low[axis], -TAPE_REACH);
        cells->high[axis] = fmin(high[axis], TAPE_REACH);
        s.known.low[axis] = INFINITY;
        s.known.high[axis] = -INFINITY;
        if (!(cells->low[axis] <= cells->high[axis])) count = 0;
    }
    if (count) cut_sides(&s, cells);
    count = count && cell_matters(&s, cells);
    Cell whole = *cells;
    if (count) look_inside(&s, &whole);
    for (int level = 0; level < BOUNDS_LEVELS && count; level++) {
        if (!s.ends[0] && !s.ends[1] && !s.ends[2]) break;
        if (s.left < 8 * (int64_t)count * (tape->count + 8) || !refine(&s, cells, count, next, &next_count)) break;
        Cell *old = cells;
        cells = next;
        next = old;
        count = next_count;
    }
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = s.known.low[axis];
        high[axis] = s.known.high[axis];
        for (uint32_t k = 0; k < count; k++) {
            low[axis] = fmin(low[axis], cells[k].low[axis]);
            high[axis] = fmax(high[axis], cells[k].high[axis]);
        }
        if (!s.ends[axis] && low[axis] <= high[axis]) {
            low[axis] = whole.low[axis];
            high[axis] = whole.high[axis];
        }
        if (low[axis] == -TAPE_REACH) low[axis] = -INFINITY;
        if (high[axis] == TAPE_REACH) high[axis] = INFINITY;
    }
    arena_release(&scratch);
}

void tape_bounds(const Plan *plan, const PlanTape *tape, const double *values, double low[3], double high[3])
{
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = -INFINITY;
        high[axis] = INFINITY;
    }
    tape_bounds_within(plan, tape, values, low, high);
}
