// Numbers and conditions stand after what they are made of, so their numbers are an order of evaluation.
#include "compiler/formula.h"

#include <math.h>
#include <string.h>

#include "compiler/interval.h"
#include "compiler/pairs.h"
#include "compiler/threshold.h"

// --- what is there already

typedef enum EntryKind { ENTRY_NUMBER = 1, ENTRY_CONDITION, ENTRY_PUSHED } EntryKind;

typedef struct Entry {
    uint32_t key[4], index; // key[0]: EntryKind and operation, 0 where the place is free
} Entry;

typedef struct FormulaTable {
    Entry *entries;
    uint32_t count, size; // size: a power of two
} FormulaTable;

static uint32_t place_of(const FormulaTable *table, const uint32_t key[4])
{
    uint64_t hash = 0;
    for (int k = 0; k < 4; k++) {
        hash = (hash ^ key[k]) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;
    }
    uint32_t place = (uint32_t)hash & (table->size - 1);
    while (table->entries[place].key[0] && memcmp(table->entries[place].key, key, sizeof table->entries->key))
        place = (place + 1) & (table->size - 1);
    return place;
}

static void grow(Formula *f)
{
    FormulaTable *table = f->table, old = *table;
    table->size = old.size ? 2 * old.size : 1024;
    table->entries = arena_array(f->arena, Entry, table->size);
    for (uint32_t k = 0; k < old.size; k++) {
        if (old.entries[k].key[0]) table->entries[place_of(table, old.entries[k].key)] = old.entries[k];
    }
}

// The index that stands at the key, or NULL; a new place for it is filled with `index`.
static const uint32_t *find(const Formula *f, const uint32_t key[4])
{
    const Entry *entry = &f->table->entries[place_of(f->table, key)];
    return entry->key[0] ? &entry->index : NULL;
}

static void keep(Formula *f, const uint32_t key[4], uint32_t index)
{
    if (2 * ++f->table->count > f->table->size) grow(f);
    Entry *entry = &f->table->entries[place_of(f->table, key)];
    memcpy(entry->key, key, sizeof entry->key);
    entry->index = index;
}

static uint32_t bits_of(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

// --- what a number can be

static bool has_second(uint32_t op)
{
    return (op >= TAPE_ADD && op <= TAPE_MAX) || op == TAPE_POW || op == TAPE_LSE || op == TAPE_ATAN2 ||
           op == TAPE_MOD || (op >= TAPE_LT && op <= TAPE_OR);
}

// Kernels round these as IEEE 754 says, or they are exact.
static bool is_correct(uint32_t op)
{
    return op <= TAPE_POWER || (op >= TAPE_FLOOR && op <= TAPE_SELECT);
}

static Interval interval_of_number(const Formula *f, uint32_t a)
{
    const FormulaNumber *number = &f->numbers[a];
    return (Interval){number->low, number->high, number->doubt};
}

static Interval power_over(Interval a, int32_t n)
{
    if (n == 0) return (Interval){1, 1, a.partial};
    Interval r = n == 1 || n == -1 ? a : interval_power(a, (uint32_t)(n < 0 ? -n : n));
    return n > 0 ? r : interval_op2(TAPE_DIV, interval_of(1, 1), r);
}

static Interval over(const Formula *f, const FormulaNumber *n)
{
    Interval a = interval_of_number(f, n->a);
    if (n->op == TAPE_POWER) return power_over(a, (int32_t)n->b);
    if (n->op == TAPE_SELECT) return interval_select(a, interval_of_number(f, n->b), interval_of_number(f, n->c));
    if (TAPE_TAKES_THREE(n->op))
        return interval_op3(n->op, (const Interval[3]){a, interval_of_number(f, n->b), interval_of_number(f, n->c)});
    return has_second(n->op) ? interval_op2(n->op, a, interval_of_number(f, n->b)) : interval_op1(n->op, a);
}

// What rounding may make of a number, at most.
static double size_of(const Formula *f, uint32_t a)
{
    return fmax(fabs(f->numbers[a].low), fabs(f->numbers[a].high)) * 0x1p-22;
}

// The interval of real numbers, rounded to floats, holds all floats that are rounded from them. A power is a product of
// products, each rounded; what the device computes of functions may be wrong by a few units in the last place.
static void bound(const Formula *f, FormulaNumber *n)
{
    enum { UNITS = 64 };
    Interval r = over(f, n);
    if (n->op == TAPE_POWER || !is_correct(n->op)) {
        double share = (n->op == TAPE_POWER ? TAPE_POWER_MAX : UNITS) * 0x1p-23;
        if (n->op == TAPE_POW) share = 1e-3; // exp of a rounded product
        double margin = 0x1p-20;
        if (n->op == TAPE_MOD)
            margin += size_of(f, n->a) + size_of(f, n->b); // a - b floor(a / b), where a is much larger
        r.low -= share * fabs(r.low) + margin;
        r.high += share * fabs(r.high) + margin;
    }
    n->low = (float)r.low;
    n->high = (float)r.high;
    n->doubt = r.partial || !isfinite(n->low) || !isfinite(n->high);
    n->doubt |= f->numbers[n->a].doubt || (has_second(n->op) && f->numbers[n->b].doubt);
    if (TAPE_TAKES_THREE(n->op)) n->doubt |= f->numbers[n->b].doubt || f->numbers[n->c].doubt;
    if (!n->doubt) return;
    n->low = -INFINITY;
    n->high = INFINITY;
}

// --- numbers

static uint32_t put(Formula *f, FormulaNumber n)
{
    uint32_t key[4] = {ENTRY_NUMBER | (uint32_t)n.op << 8, n.a, n.b, n.c};
    if (n.op == TAPE_NUMBER) key[1] = bits_of(n.value);
    const uint32_t *there = find(f, key);
    if (there) return *there;
    f->numbers = array_room(f->arena, f->numbers, f->number_count, &f->number_capacity, sizeof *f->numbers);
    f->numbers[f->number_count] = n;
    keep(f, key, f->number_count);
    return f->number_count++;
}

uint32_t formula_value(Formula *f, float value)
{
    bool doubt = !isfinite(value);
    return put(f, (FormulaNumber){.op = TAPE_NUMBER,
                                  .value = value,
                                  .low = doubt ? -INFINITY : value,
                                  .high = doubt ? INFINITY : value,
                                  .doubt = doubt});
}

static bool is_value(const Formula *f, uint32_t a)
{
    return f->numbers[a].op == TAPE_NUMBER;
}

static bool is_zero(const Formula *f, uint32_t a)
{
    return f->numbers[a].op == TAPE_NUMBER && f->numbers[a].value == 0;
}

static bool vanishes(const Formula *f, const FormulaNumber *n)
{
    bool a = f->numbers[n->a].vanishes, b = has_second(n->op) && f->numbers[n->b].vanishes;
    switch (n->op) {
    case TAPE_MIN:
    case TAPE_MAX: return is_zero(f, n->b) || (a && b);
    case TAPE_MUL: return a || b;
    case TAPE_ADD:
    case TAPE_SUB: return a && b;
    case TAPE_POWER: return a && (int32_t)n->b > 0;
    case TAPE_NEG:
    case TAPE_ABS:
    case TAPE_SQUARE:
    case TAPE_SQRT: return a;
    default: return false;
    }
}

static uint32_t step(Formula *f, FormulaNumber n)
{
    n.depends = f->numbers[n.a].depends;
    if (has_second(n.op)) n.depends |= f->numbers[n.b].depends;
    if (TAPE_TAKES_THREE(n.op)) n.depends = SLICE_ACROSS | SLICE_UP; // as kernels have it
    n.vanishes = vanishes(f, &n);
    bound(f, &n);
    return put(f, n);
}

uint32_t formula_op1(Formula *f, uint32_t op, uint32_t a)
{
    const FormulaNumber *n = &f->numbers[a];
    if (n->op == TAPE_NUMBER && threshold_is_monotone(op, 0) && !(op == TAPE_SQRT && n->value < 0))
        return formula_value(f, threshold_step(op, n->value, 0));
    if (n->op == TAPE_NUMBER && op == TAPE_SQUARE) return formula_value(f, n->value * n->value);
    if (n->op == TAPE_NUMBER && op == TAPE_ABS) return formula_value(f, fabsf(n->value));
    if (n->op == TAPE_NEG && op == TAPE_NEG) return n->a;
    if (n->op == TAPE_NEG && (op == TAPE_SQUARE || op == TAPE_ABS)) a = n->a;
    return step(f, (FormulaNumber){.op = (uint8_t)op, .a = a});
}

static bool fold(uint32_t op, float a, float b, float *result)
{
    switch (op) {
    case TAPE_ADD:
    case TAPE_SUB:
    case TAPE_BACK_SUB:
    case TAPE_MUL:
    case TAPE_DIV: *result = threshold_step(op, a, b); break;
    case TAPE_BACK_DIV: *result = b / a; break;
    case TAPE_MIN: *result = b < a ? b : a; break;
    case TAPE_MAX: *result = b > a ? b : a; break;
    default: return false;
    }
    return isfinite(*result);
}

// The same operation with its operands exchanged; TAPE_OPS if there is none.
static uint32_t exchanged(uint32_t op)
{
    switch (op) {
    case TAPE_ADD:
    case TAPE_MUL:
    case TAPE_MIN:
    case TAPE_MAX:
    case TAPE_EQ: return op;
    case TAPE_SUB: return TAPE_BACK_SUB;
    case TAPE_BACK_SUB: return TAPE_SUB;
    case TAPE_DIV: return TAPE_BACK_DIV;
    case TAPE_BACK_DIV: return TAPE_DIV;
    default: return TAPE_OPS;
    }
}

uint32_t formula_op2(Formula *f, uint32_t op, uint32_t a, uint32_t b)
{
    float value;
    if (is_value(f, a) && is_value(f, b) && fold(op, f->numbers[a].value, f->numbers[b].value, &value))
        return formula_value(f, value);
    bool symmetric = exchanged(op) == op;
    // One order of operands, so that what is equal is one: a number that is known second, else the older first.
    if (exchanged(op) < TAPE_OPS && ((is_value(f, a) && !is_value(f, b)) ||
                                     (symmetric && !is_value(f, b) && a > b && op != TAPE_MIN && op != TAPE_MAX))) {
        uint32_t first = a;
        op = exchanged(op);
        a = b;
        b = first;
    }
    if ((op == TAPE_MIN || op == TAPE_MAX) && a == b) return a;
    return step(f, (FormulaNumber){.op = (uint8_t)op, .a = a, .b = b});
}

uint32_t formula_power(Formula *f, uint32_t a, int32_t exponent)
{
    return step(f, (FormulaNumber){.op = TAPE_POWER, .a = a, .b = (uint32_t)exponent});
}

uint32_t formula_op3(Formula *f, uint32_t op, uint32_t a, uint32_t b, uint32_t c)
{
    return step(f, (FormulaNumber){.op = (uint8_t)op, .a = a, .b = b, .c = c});
}

Formula *formula_new(Arena *arena, bool pushing)
{
    Formula *f = arena_new(arena, Formula);
    *f = (Formula){.arena = arena, .pushing = pushing, .condition_count = 2};
    f->table = arena_new(arena, FormulaTable);
    f->conditions = arena_array(arena, FormulaCondition, 64);
    f->condition_capacity = 64;
    grow(f);
    for (uint32_t k = 0; k < SLICE_POINT; k++) {
        put(f,
            (FormulaNumber){
                .op = TAPE_OPS, .depends = (uint8_t)(1u << k), .a = k, .low = -FORMULA_REACH, .high = FORMULA_REACH});
    }
    return f;
}

// --- conditions

static uint32_t put_condition(Formula *f, FormulaCondition c)
{
    uint32_t key[4] = {ENTRY_CONDITION | (uint32_t)c.op << 8, c.a, c.b, bits_of(c.value)};
    const uint32_t *there = find(f, key);
    if (there) return *there;
    f->conditions =
        array_room(f->arena, f->conditions, f->condition_count, &f->condition_capacity, sizeof *f->conditions);
    f->conditions[f->condition_count] = c;
    keep(f, key, f->condition_count);
    return f->condition_count++;
}

// Two comparisons of one number with floats, the same way: the stricter of them, or of OR the other.
static bool join_compares(Formula *f, uint32_t op, uint32_t a, uint32_t b, uint32_t *result)
{
    const FormulaCondition *p = &f->conditions[a], *q = &f->conditions[b];
    if (p->op != q->op || p->a != q->a || (p->op != SLICE_BELOW && p->op != SLICE_FROM)) return false;
    bool least = (p->op == SLICE_BELOW) == (op == SLICE_AND);
    *result = (p->value < q->value) == least ? a : b;
    return true;
}

static uint32_t join(Formula *f, uint32_t op, uint32_t a, uint32_t b)
{
    uint32_t decides = op == SLICE_AND ? FORMULA_FALSE : FORMULA_TRUE, joined;
    if (a == decides || b == decides) return decides;
    if (a <= FORMULA_TRUE || a == b) return b;
    if (b <= FORMULA_TRUE) return a;
    if (join_compares(f, op, a, b, &joined)) return joined;
    return put_condition(f, (FormulaCondition){(uint8_t)op, a < b ? a : b, a < b ? b : a, 0});
}

uint32_t formula_and(Formula *f, uint32_t a, uint32_t b)
{
    return join(f, SLICE_AND, a, b);
}

uint32_t formula_or(Formula *f, uint32_t a, uint32_t b)
{
    return join(f, SLICE_OR, a, b);
}

// --- pushing

enum { DEPTH_MAX = 5000 }; // below it F is computed: the stack has an end

static uint32_t pushed_through_step(Formula *f, const FormulaNumber *n, bool from, float t)
{
    float c = has_second(n->op) ? f->numbers[n->b].value : 0;
    Threshold below = threshold_below(n->op, c, t);
    if (below.kind == THRESHOLD_NEVER) return from ? FORMULA_TRUE : FORMULA_FALSE;
    if (below.kind == THRESHOLD_ALWAYS) return from ? FORMULA_FALSE : FORMULA_TRUE;
    return formula_compare(f, n->a, (below.kind == THRESHOLD_FROM) != from, below.at);
}

// What stands for a comparison of a number that is defined everywhere.
static uint32_t pushed(Formula *f, uint32_t a, bool from, float t)
{
    FormulaNumber n = f->numbers[a]; // a copy: the array may move
    if (n.low >= t || n.high < t) return (n.low >= t) == from ? FORMULA_TRUE : FORMULA_FALSE;
    if (n.op == TAPE_MIN || n.op == TAPE_MAX) {
        uint32_t first = formula_compare(f, n.a, from, t), second = formula_compare(f, n.b, from, t);
        return join(f, (n.op == TAPE_MAX) == from ? SLICE_OR : SLICE_AND, first, second);
    }
    if (n.op == TAPE_ABS && t > 0) {
        uint32_t first = formula_compare(f, n.a, from, t),
                 second = formula_compare(f, n.a, !from, threshold_next(-t, true));
        return join(f, from ? SLICE_OR : SLICE_AND, first, second);
    }
    bool known = has_second(n.op) && is_value(f, n.b);
    if ((known || !has_second(n.op)) && threshold_is_monotone(n.op, known ? f->numbers[n.b].value : 0))
        return pushed_through_step(f, &n, from, t);
    // a - b < 0, and a - b < the least float above 0, which is a <= b: no difference of two floats is rounded to 0.
    if (n.op == TAPE_SUB && t == 0)
        return put_condition(f, (FormulaCondition){from ? SLICE_NOT_LESS : SLICE_LESS, n.a, n.b, 0});
    if (n.op == TAPE_SUB && t == threshold_next(0, true))
        return put_condition(f, (FormulaCondition){from ? SLICE_LESS : SLICE_NOT_LESS, n.b, n.a, 0});
    return put_condition(f, (FormulaCondition){from ? SLICE_FROM : SLICE_BELOW, a, 0, t});
}

uint32_t formula_compare(Formula *f, uint32_t a, bool from, float t)
{
    const FormulaNumber *n = &f->numbers[a];
    if (n->op == TAPE_NUMBER) return (from ? n->value >= t : n->value < t) ? FORMULA_TRUE : FORMULA_FALSE;
    if (!f->pushing || n->doubt || f->depth >= DEPTH_MAX)
        return put_condition(f, (FormulaCondition){from ? SLICE_FROM : SLICE_BELOW, a, 0, t});
    const uint32_t key[4] = {ENTRY_PUSHED, a, from, bits_of(t)};
    const uint32_t *there = find(f, key);
    if (there) return *there;
    f->depth++;
    uint32_t result = pushed(f, a, from, t);
    f->depth--;
    keep(f, key, result);
    return result;
}

// --- programs

typedef struct Scheduler {
    const Formula *f;
    Arena *arena;
    FormulaSteps *result;
    uint32_t *places, *spread; // of numbers + 1: where they are, and where they are as ones that depend on both
    uint32_t *conditions;      // of conditions
    bool signs_of_zero;        // matter: a number is divided by another, or the like
    uint32_t count, capacity;
} Scheduler;

static bool is_logic(const FormulaCondition *c)
{
    return c->op == SLICE_AND || c->op == SLICE_OR;
}

static bool has_two(const FormulaCondition *c)
{
    return c->op == SLICE_LESS || c->op == SLICE_NOT_LESS;
}

// Where this is computed, 0 and -0 are not the same, and a sum with 0 is not always its other side.
static bool sees_sign_of_zero(const Formula *f, const FormulaNumber *n)
{
    return (n->op == TAPE_DIV && !is_value(f, n->b)) || n->op == TAPE_BACK_DIV || n->op == TAPE_ATAN2 ||
           n->op == TAPE_POW || (n->op == TAPE_POWER && (int32_t)n->b < 0);
}

static void reach(Scheduler *s, uint32_t condition)
{
    const Formula *f = s->f;
    s->conditions[condition] = 1;
    for (uint32_t k = condition + 1; k-- > 2;) {
        const FormulaCondition *c = &f->conditions[k];
        if (!s->conditions[k]) continue;
        if (is_logic(c)) {
            s->conditions[c->a] = s->conditions[c->b] = 1;
        } else {
            s->places[c->a] = 1;
            if (has_two(c)) s->places[c->b] = 1;
        }
    }
    for (uint32_t k = f->number_count; k-- > SLICE_POINT;) {
        const FormulaNumber *n = &f->numbers[k];
        if (!s->places[k] || n->op == TAPE_NUMBER) continue;
        s->signs_of_zero |= sees_sign_of_zero(f, n);
        s->places[n->a] = 1;
        if (has_second(n->op) || TAPE_TAKES_THREE(n->op)) s->places[n->b] = 1;
        if (TAPE_TAKES_THREE(n->op)) s->places[n->c] = 1;
    }
}

static uint32_t put_step(Scheduler *s, uint32_t word, uint32_t b)
{
    FormulaSteps *r = s->result;
    r->steps = array_room(s->arena, r->steps, s->count, &s->capacity, sizeof *r->steps);
    r->steps[s->count] = (TapeStep){word, b};
    if (SLICE_CLASS(word) == (SLICE_ACROSS | SLICE_UP)) r->mixed++;
    return s->count++;
}

// What a number depends on, as steps say it: what is known takes the place of one that depends on the place across.
static uint32_t class_of(const FormulaNumber *n)
{
    return n->depends ? n->depends : SLICE_ACROSS;
}

// The place of an operand; a number that is known becomes a step.
static uint32_t place(Scheduler *s, uint32_t number)
{
    const FormulaNumber *n = &s->f->numbers[number];
    if (number < SLICE_POINT) return number;
    if (s->places[number] < 2) {
        uint32_t word =
            TAPE_NUMBER | SLICE_LITERAL | (n->doubt ? SLICE_DOUBT : 0) | SLICE_ACROSS << 8 | SLICE_ACROSS << 14;
        s->places[number] = put_step(s, word, bits_of(n->value)) + SLICE_POINT;
    }
    return s->places[number];
}

static uint32_t spread_place(Scheduler *s, uint32_t number)
{
    const FormulaNumber *n = &s->f->numbers[number];
    uint32_t at = place(s, number), class = class_of(n);
    if (class == (SLICE_ACROSS | SLICE_UP)) return at;
    if (!s->spread[number]) {
        uint32_t word = SLICE_SPREAD | SLICE_LITERAL | (n->doubt ? SLICE_DOUBT : 0) | class << 8 | 3u << 14 | at << 16;
        s->spread[number] = put_step(s, word, 0) + SLICE_POINT;
    }
    return s->spread[number];
}

static void number_step(Scheduler *s, uint32_t k)
{
    const FormulaNumber *n = &s->f->numbers[k];
    const FormulaNumber *second = &s->f->numbers[has_second(n->op) ? n->b : n->a];
    uint32_t word = n->op | (n->doubt ? SLICE_DOUBT : 0) | class_of(&s->f->numbers[n->a]) << 8 |
                    class_of(second) << 10 | class_of(n) << 14;
    uint32_t a = place(s, n->a), b = 0;
    bool sum = (n->op == TAPE_ADD || n->op == TAPE_SUB) && second->op != TAPE_NUMBER;
    if (sum && !s->signs_of_zero && (s->f->numbers[n->a].vanishes || second->vanishes)) word |= SLICE_VANISHES;
    if (TAPE_TAKES_THREE(n->op)) {
        b = spread_place(s, n->b);
        b |= spread_place(s, n->c) << 16;
    } else if (!has_second(n->op)) {
        word |= SLICE_LITERAL;
        b = n->op == TAPE_POWER ? n->b : 0;
    } else if (second->op == TAPE_NUMBER) {
        word |= SLICE_LITERAL;
        b = bits_of(second->value);
    } else {
        b = place(s, n->b);
    }
    s->places[k] = put_step(s, word | a << 16, b) + SLICE_POINT;
}

static void compare_step(Scheduler *s, const FormulaCondition *c)
{
    const FormulaNumber *a = &s->f->numbers[c->a], *b = &s->f->numbers[has_two(c) ? c->b : c->a];
    bool doubt = a->doubt || b->doubt;
    uint32_t word = c->op | (doubt ? SLICE_DOUBT : 0) | class_of(a) << 8 | class_of(b) << 10 | place(s, c->a) << 16;
    if (!has_two(c)) word |= SLICE_LITERAL;
    put_step(s, word, has_two(c) ? place(s, c->b) : bits_of(c->value));
}

// Numbers, then comparisons, then AND and OR.
static bool schedule(Scheduler *s, uint32_t condition)
{
    const Formula *f = s->f;
    FormulaSteps *r = s->result;
    for (uint32_t k = SLICE_POINT; k < f->number_count && s->count <= SLICE_STEPS_MAX; k++) {
        if (s->places[k] && f->numbers[k].op != TAPE_NUMBER) number_step(s, k);
    }
    r->numbers = s->count;
    for (uint32_t k = 2; k <= condition && s->count <= SLICE_STEPS_MAX; k++) {
        if (!s->conditions[k] || is_logic(&f->conditions[k])) continue;
        compare_step(s, &f->conditions[k]);
        s->conditions[k] = r->compares++;
    }
    for (uint32_t k = 2; k <= condition && s->count <= SLICE_STEPS_MAX; k++) {
        const FormulaCondition *c = &f->conditions[k];
        if (!s->conditions[k] && k != condition) continue;
        if (!is_logic(c)) continue;
        put_step(s, c->op | s->conditions[c->a] << 16, s->conditions[c->b]);
        s->conditions[k] = r->compares + r->logics++;
    }
    return s->count <= SLICE_STEPS_MAX;
}

bool formula_steps(const Formula *f, uint32_t condition, Arena *arena, FormulaSteps *steps)
{
    *steps = (FormulaSteps){.known = condition <= FORMULA_TRUE, .holds = condition == FORMULA_TRUE};
    if (steps->known) return true;
    Arena scratch = {0};
    Scheduler s = {.f = f, .arena = arena, .result = steps};
    s.places = arena_array(&scratch, uint32_t, f->number_count);
    s.spread = arena_array(&scratch, uint32_t, f->number_count);
    s.conditions = arena_array(&scratch, uint32_t, condition + 1);
    reach(&s, condition);
    bool ok = schedule(&s, condition);
    arena_release(&scratch);
    return ok;
}
