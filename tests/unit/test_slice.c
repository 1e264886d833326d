// Slices on the device: whatever the formula and the size, pictures made by tiles are those whose pixels are computed one by one.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/slice.h"

typedef struct Fixture {
    Device *device;
    Slicer *slicer, *small, *truth; // small: with hardly any room for programs of tiles
} Fixture;

static int set_up(void **state)
{
    Failure failure;
    Fixture *x = calloc(1, sizeof *x);
    *state = x;
    x->device = device_open(&(DeviceDesc){.choice = "cpu"}, &failure);
    if (!x->device) return -1;
    x->slicer = slicer_new(x->device, &(SlicerDesc){0}, &failure);
    x->small = slicer_new(x->device, &(SlicerDesc){.pool = 40}, &failure);
    x->truth = slicer_new(x->device, &(SlicerDesc){0}, &failure);
    return x->slicer && x->small && x->truth ? 0 : -1;
}

static int tear_down(void **state)
{
    Fixture *x = *state;
    slicer_free(x->slicer);
    slicer_free(x->small);
    slicer_free(x->truth);
    device_close(x->device);
    free(x);
    return 0;
}

// --- random formulas

static uint32_t next_random(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(*state >> 32);
}

static float random_unit(uint64_t *state)
{
    return (float)next_random(state) * 0x1p-31f - 1;
}

static const uint32_t all_ops[] = {
    TAPE_ADD,  TAPE_SUB,   TAPE_MUL, TAPE_DIV,   TAPE_MIN,  TAPE_MAX,    TAPE_NEG,    TAPE_ABS,   TAPE_SQUARE,
    TAPE_POW,  TAPE_SQRT,  TAPE_EXP, TAPE_LOG,   TAPE_SIN,  TAPE_COS,    TAPE_TAN,    TAPE_ASIN,  TAPE_ACOS,
    TAPE_ATAN, TAPE_ATAN2, TAPE_MOD, TAPE_FLOOR, TAPE_CEIL, TAPE_ROUND,  TAPE_SIGN,   TAPE_LT,    TAPE_LE,
    TAPE_EQ,   TAPE_AND,   TAPE_OR,  TAPE_NOT,   TAPE_LSE,  TAPE_POWER,  TAPE_SELECT, TAPE_MIN,   TAPE_MAX,
    TAPE_ADD,  TAPE_SUB,   TAPE_MUL, TAPE_MIN,   TAPE_MAX,  TAPE_SQUARE, TAPE_NOISE,  TAPE_CELLS,
};
enum { ALL_OPS = sizeof all_ops / sizeof *all_ops };

static bool has_two(uint32_t op)
{
    return op <= TAPE_MAX || op == TAPE_POW || op == TAPE_ATAN2 || op == TAPE_MOD || op == TAPE_LSE ||
           (op >= TAPE_LT && op <= TAPE_OR);
}

static uint32_t random_number(Formula *f, const uint32_t *made, uint32_t count, uint64_t *seed)
{
    uint32_t choice = next_random(seed) % 4;
    if (choice == 0) return formula_value(f, next_random(seed) % 4 ? random_unit(seed) * 3 : 0);
    if (choice == 1 || !count) return next_random(seed) % 2;
    return made[count - 1 - next_random(seed) % (count < 8 ? count : 8)];
}

// The same formula of the same seed, pushed or not.
static bool random_formula(Arena *arena, uint64_t seed, bool pushing, bool gentle, FormulaSteps *steps)
{
    uint32_t made[64], count = 8 + next_random(&seed) % 40, inside = FORMULA_FALSE;
    Formula *f = formula_new(arena, pushing);
    for (uint32_t k = 0; k < count; k++) {
        uint32_t op = all_ops[next_random(&seed) % (gentle ? 9 : ALL_OPS)];
        if (gentle && op == TAPE_DIV) op = TAPE_MAX;
        uint32_t a = random_number(f, made, k, &seed), b = random_number(f, made, k, &seed),
                 c = random_number(f, made, k, &seed);
        made[k] = op == TAPE_POWER       ? formula_power(f, a, (int32_t)(next_random(&seed) % 11) - 5)
                  : TAPE_TAKES_THREE(op) ? formula_op3(f, op, a, b, c)
                  : has_two(op)          ? formula_op2(f, op, a, b)
                                         : formula_op1(f, op, a);
    }
    for (uint32_t k = 1; k <= 4; k++) {
        uint32_t one = formula_compare(f, made[count - k], next_random(&seed) & 1, k == 1 ? 0 : random_unit(&seed));
        inside = k & 1 ? formula_or(f, inside, one) : formula_and(f, inside, one);
    }
    inside = formula_or(f, inside, formula_compare(f, made[count - 1], true, 0));
    return formula_steps(f, inside, arena, steps);
}

// --- comparing

static uint64_t differences(Slicer *a, Slicer *b, uint32_t height)
{
    Failure failure;
    const uint16_t *p = slicer_bits(a, &failure), *q = slicer_bits(b, &failure);
    uint64_t count = 0;
    assert_non_null(p);
    assert_non_null(q);
    assert_int_equal(slicer_stride(a), slicer_stride(b));
    for (size_t k = 0; k < (size_t)slicer_stride(a) * height; k++) count += (uint64_t)__builtin_popcount(p[k] ^ q[k]);
    return count;
}

static void draw(Slicer *slicer, const SliceView *view, SliceHow how)
{
    Failure failure;
    if (!slicer_draw(slicer, view, how, &failure)) fail_msg("%s", failure.text);
}

// Pictures of a program by tiles, with and without room, against those of the plain one.
static uint64_t check(const Fixture *x, const FormulaSteps *pushed, const FormulaSteps *plain, const SliceView *view)
{
    Failure failure;
    assert_true(slicer_program(x->truth, plain, &failure));
    draw(x->truth, view, SLICE_BRUTE);
    const FormulaSteps *programs[] = {pushed, plain};
    for (int k = 0; k < 2; k++) {
        Slicer *slicer = k ? x->small : x->slicer;
        assert_true(slicer_program(slicer, programs[k], &failure));
        draw(slicer, view, SLICE_TILES);
        assert_int_equal(differences(slicer, x->truth, view->height), 0);
    }
    const uint16_t *bits = slicer_bits(x->truth, &failure);
    return slicer_count(x->truth, bits);
}

static const SliceView views[] = {
    {64, 64, -1, 1, -1, 1},       {1, 1, -1, 1, -1, 1},         {17, 130, -2, 3, -0.1, 0.1},    {300, 65, -4, 4, -1, 1},
    {257, 255, -1.3, 1.7, -2, 2}, {1030, 20, -30, 30, -0.5, 1}, {96, 96, 0.1, 0.1001, -50, 50},
};
enum { VIEWS = sizeof views / sizeof *views };

static void random_formulas(Fixture *x, uint64_t first, int count, bool gentle, int *mixed)
{
    for (int k = 0; k < count; k++) {
        Arena arena = {0};
        FormulaSteps pushed, plain;
        const SliceView *view = &views[k % VIEWS];
        assert_true(random_formula(&arena, first + (uint64_t)k, true, gentle, &pushed));
        assert_true(random_formula(&arena, first + (uint64_t)k, false, gentle, &plain));
        uint64_t inside = check(x, &pushed, &plain, view);
        *mixed += inside > 0 && inside < (uint64_t)view->width * view->height;
        arena_release(&arena);
    }
}

// --- tests

static void formulas_of_all_operations(void **state)
{
    int mixed = 0;
    random_formulas(*state, 1, 420, false, &mixed);
    assert_true(mixed > 100); // pictures with both colours
}

// Of sums, products, roots of what is defined: nearly all of it is pushed.
static void formulas_that_are_pushed(void **state)
{
    int mixed = 0;
    random_formulas(*state, 10000, 420, true, &mixed);
    assert_true(mixed > 100);
}

// A union of discs: many tiles and levels, and programs that become short.
static void a_thousand_discs(void **state)
{
    Arena arena = {0};
    FormulaSteps steps[2];
    for (int plain = 0; plain < 2; plain++) {
        Formula *f = formula_new(&arena, !plain);
        uint64_t seed = 7;
        uint32_t inside = FORMULA_FALSE;
        for (int k = 0; k < 1000; k++) {
            uint32_t u = formula_op2(f, TAPE_SUB, FORMULA_ACROSS, formula_value(f, random_unit(&seed)));
            uint32_t v = formula_op2(f, TAPE_SUB, FORMULA_UP, formula_value(f, random_unit(&seed)));
            uint32_t square = formula_op2(f, TAPE_ADD, formula_op1(f, TAPE_SQUARE, u), formula_op1(f, TAPE_SQUARE, v));
            uint32_t disc = formula_op2(f, TAPE_BACK_SUB, formula_op1(f, TAPE_SQRT, square), formula_value(f, 0.01f));
            inside = formula_or(f, inside, formula_compare(f, disc, true, 0));
        }
        assert_true(formula_steps(f, inside, &arena, &steps[plain]));
    }
    uint64_t inside = check(*state, &steps[0], &steps[1], &(SliceView){1100, 700, -1, 1, -1, 1});
    assert_in_range(inside, 1100 * 700 / 20, 1100 * 700 / 8);
    arena_release(&arena);
}

// A disc with 500 small bumps and dents, F + sum of s max(Q, 0)³: far from a bump its steps are gone.
static void a_free_form_of_many_perturbations(void **state)
{
    Arena arena = {0};
    FormulaSteps steps;
    Formula *f = formula_new(&arena, true);
    uint64_t seed = 21;
    uint32_t zero = formula_value(f, 0), u = formula_op1(f, TAPE_SQUARE, FORMULA_ACROSS),
             sum = formula_op1(f, TAPE_SQUARE, FORMULA_UP);
    sum = formula_op2(f, TAPE_BACK_SUB, formula_op2(f, TAPE_ADD, u, sum), formula_value(f, 0.5f));
    for (int k = 0; k < 500; k++) {
        u = formula_op2(f, TAPE_SUB, FORMULA_ACROSS, formula_value(f, random_unit(&seed)));
        uint32_t v = formula_op2(f, TAPE_SUB, FORMULA_UP, formula_value(f, random_unit(&seed)));
        u = formula_op1(f, TAPE_SQUARE, u);
        uint32_t q = formula_op2(f, TAPE_ADD, u, formula_op1(f, TAPE_SQUARE, v));
        q = formula_op2(f, TAPE_BACK_SUB, formula_op2(f, TAPE_MUL, q, formula_value(f, 200)), formula_value(f, 1));
        q = formula_op2(f, TAPE_MAX, q, zero);
        q = formula_op2(f, TAPE_MUL, formula_op1(f, TAPE_SQUARE, q), q);
        q = formula_op2(f, TAPE_MUL, q, formula_value(f, random_unit(&seed)));
        sum = k % 2 ? formula_op2(f, TAPE_ADD, sum, q) : formula_op2(f, TAPE_SUB, sum, q);
    }
    assert_true(formula_steps(f, formula_compare(f, sum, true, 0), &arena, &steps));
    uint64_t inside = check(*state, &steps, &steps, &(SliceView){300, 290, -1, 1, -1, 1});
    assert_in_range(inside, 300 * 290 / 4, 300 * 290 / 2);
    arena_release(&arena);
}

// Discs, and what is left of the plane without them: an OR of groups and an AND of groups, as code.
static void code_draws_what_programs_draw(void **state)
{
    Fixture *x = *state;
    for (int either = 0; either < 2; either++) {
        Arena arena = {0};
        FormulaSteps steps;
        FormulaCode code;
        Failure failure;
        Formula *f = formula_new(&arena, true);
        uint64_t seed = 11;
        uint32_t inside = either ? FORMULA_FALSE : FORMULA_TRUE;
        for (int k = 0; k < 60; k++) {
            uint32_t u = formula_op2(f, TAPE_SUB, FORMULA_ACROSS, formula_value(f, random_unit(&seed)));
            uint32_t v =
                formula_op2(f, TAPE_DIV, formula_op2(f, TAPE_SUB, FORMULA_UP, formula_value(f, random_unit(&seed))),
                            formula_value(f, 1.5f));
            uint32_t square = formula_op2(f, TAPE_ADD, formula_op1(f, TAPE_SQUARE, u), formula_op1(f, TAPE_SQUARE, v));
            uint32_t tilted = formula_op2(f, TAPE_MAX, formula_op1(f, TAPE_ABS, formula_op2(f, TAPE_SUB, u, v)),
                                          formula_op2(f, TAPE_MUL, u, v));
            uint32_t disc = formula_op2(f, TAPE_MIN, formula_op1(f, TAPE_SQRT, square), tilted);
            uint32_t part = formula_compare(f, disc, !either, 0.04f);
            inside = either ? formula_or(f, inside, part) : formula_and(f, inside, part);
        }
        assert_true(formula_steps(f, inside, &arena, &steps));
        assert_true(formula_emit(f, inside, &arena, &code));
        assert_true(code.groups > 3);
        Slicer *slicer = slicer_new(x->device, &(SlicerDesc){.code = &code, .pool = 30}, &failure);
        if (!slicer) fail_msg("%s", failure.text);
        assert_true(slicer_program(x->truth, &steps, &failure));
        for (int k = 0; k < VIEWS; k++) {
            draw(slicer, &views[k], SLICE_TILES);
            draw(x->truth, &views[k], SLICE_BRUTE);
            assert_int_equal(differences(slicer, x->truth, views[k].height), 0);
        }
        slicer_free(slicer);
        arena_release(&arena);
    }
}

// A sum of 3,000 waves: there is no room for 16 rows of each of its numbers.
static void more_numbers_than_there_are_rows_for(void **state)
{
    Arena arena = {0};
    FormulaSteps steps;
    Formula *f = formula_new(&arena, true);
    uint64_t seed = 3;
    uint32_t sum = formula_value(f, 0);
    for (int k = 0; k < 3000; k++) {
        uint32_t phase = formula_op2(f, TAPE_MUL, FORMULA_ACROSS, formula_value(f, 20 * random_unit(&seed)));
        phase = formula_op2(f, TAPE_ADD, phase,
                            formula_op2(f, TAPE_MUL, FORMULA_UP, formula_value(f, 20 * random_unit(&seed))));
        sum = formula_op2(f, TAPE_ADD, sum, formula_op1(f, TAPE_SQUARE, phase));
        sum = formula_op2(f, TAPE_SUB, sum, formula_value(f, 30));
    }
    uint32_t inside = formula_compare(f, sum, true, 0);
    assert_true(formula_steps(f, inside, &arena, &steps));
    assert_true(steps.mixed > SLICE_MIXED_MAX);
    uint64_t count = check(*state, &steps, &steps, &(SliceView){70, 50, -1, 1, -1, 1});
    assert_in_range(count, 1, 70 * 50 - 1);
    arena_release(&arena);
}

static void what_is_everywhere_or_nowhere(void **state)
{
    Fixture *x = *state;
    Failure failure;
    SliceView view = {33, 5, -1, 1, -1, 1};
    for (int holds = 0; holds < 2; holds++) {
        assert_true(slicer_program(x->slicer, &(FormulaSteps){.known = true, .holds = holds}, &failure));
        draw(x->slicer, &view, SLICE_TILES);
        const uint16_t *bits = slicer_bits(x->slicer, &failure);
        assert_int_equal(slicer_count(x->slicer, bits), holds ? 33 * 5 : 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(formulas_of_all_operations),
        cmocka_unit_test(formulas_that_are_pushed),
        cmocka_unit_test(a_thousand_discs),
        cmocka_unit_test(more_numbers_than_there_are_rows_for),
        cmocka_unit_test(a_free_form_of_many_perturbations),
        cmocka_unit_test(code_draws_what_programs_draw),
        cmocka_unit_test(what_is_everywhere_or_nowhere),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
