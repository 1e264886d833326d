// Formulas as a specification: exact thresholds of float steps, what is pushed and what is not, and that nothing changes by pushing.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/formula_emit.h"
#include "compiler/threshold.h"

// --- random numbers

static uint32_t next_random(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(*state >> 32);
}

static float random_unit(uint64_t *state)
{
    return (float)next_random(state) * 0x1p-31f - 1;
}

// Any finite float, small ones often.
static float random_float(uint64_t *state)
{
    return random_unit(state) * exp2f((float)(next_random(state) % 40) - 20);
}

// --- thresholds

static const uint32_t steps_of_one[] = {TAPE_ADD, TAPE_SUB,  TAPE_BACK_SUB, TAPE_MUL,  TAPE_DIV,
                                        TAPE_NEG, TAPE_SQRT, TAPE_FLOOR,    TAPE_CEIL, TAPE_ROUND};
enum { STEPS_OF_ONE = sizeof steps_of_one / sizeof *steps_of_one };

static bool holds(Threshold t, float x)
{
    switch (t.kind) {
    case THRESHOLD_NEVER: return false;
    case THRESHOLD_ALWAYS: return true;
    case THRESHOLD_BELOW: return x < t.at;
    default: return x >= t.at;
    }
}

static void check_around(uint32_t op, float c, float t, Threshold found, float at, int count)
{
    float up = at, down = at;
    for (int k = 0; k < count; k++, up = threshold_next(up, true), down = threshold_next(down, false)) {
        const float both[2] = {up, down};
        for (int side = 0; side < 2; side++) {
            float x = both[side];
            if (op == TAPE_SQRT && x < 0) continue;
            assert_int_equal(holds(found, x), threshold_step(op, x, c) < t);
        }
    }
}

// For each step, every float near the threshold, the ends, both zeros and many others.
static void thresholds_are_exact(void **state)
{
    uint64_t seed = 1;
    for (int k = 0; k < 2000; k++) {
        uint32_t op = steps_of_one[(uint32_t)k % STEPS_OF_ONE];
        float c = random_float(&seed), t = random_float(&seed);
        if (k % 7 == 0) t = 0;
        if (k % 11 == 0) t = threshold_next(0, true);
        assert_true(threshold_is_monotone(op, c));
        Threshold found = threshold_below(op, c, t);
        if (found.kind >= THRESHOLD_BELOW) check_around(op, c, t, found, found.at, 200);
        const float others[] = {INFINITY, -INFINITY, 0.0f, -0.0f, t, c, 3e38f, -3e38f, 1e-40f, -1e-40f};
        for (size_t i = 0; i < sizeof others / sizeof *others; i++) check_around(op, c, t, found, others[i], 3);
        for (int i = 0; i < 20; i++) check_around(op, c, t, found, random_float(&seed), 2);
    }
}

static void steps_that_are_not_monotone(void **state)
{
    assert_false(threshold_is_monotone(TAPE_MUL, 0));
    assert_false(threshold_is_monotone(TAPE_DIV, 0));
    assert_false(threshold_is_monotone(TAPE_ADD, INFINITY));
    assert_false(threshold_is_monotone(TAPE_SQUARE, 0));
    assert_false(threshold_is_monotone(TAPE_BACK_DIV, 1));
    assert_false(threshold_is_monotone(TAPE_EXP, 0)); // which is rounded as the device likes
}

// --- chains

enum { CHAIN_MAX = 12 };

typedef struct Chain {
    uint32_t ops[CHAIN_MAX], count;
    float numbers[CHAIN_MAX];
} Chain;

static float chain_at(const Chain *chain, float x)
{
    for (uint32_t k = 0; k < chain->count; k++) x = threshold_step(chain->ops[k], x, chain->numbers[k]);
    return x;
}

static uint32_t chain_number(Formula *f, Chain *chain, uint64_t *seed)
{
    uint32_t number = FORMULA_ACROSS;
    chain->count = 1 + next_random(seed) % CHAIN_MAX;
    for (uint32_t k = 0; k < chain->count; k++) {
        uint32_t op = steps_of_one[next_random(seed) % STEPS_OF_ONE];
        if (op == TAPE_SQRT && !(f->numbers[number].low >= 0)) op = TAPE_ADD;
        chain->ops[k] = op;
        chain->numbers[k] = random_unit(seed) * 4;
        bool two = op <= TAPE_DIV;
        number = two ? formula_op2(f, op, number, formula_value(f, chain->numbers[k])) : formula_op1(f, op, number);
    }
    return number;
}

// A chain of such steps becomes one comparison of the place across, which answers as the chain does at every float near it.
static void chains_become_one_comparison(void **state)
{
    uint64_t seed = 5;
    int compared = 0;
    for (int k = 0; k < 1000; k++) {
        Arena arena = {0};
        Chain chain;
        Formula *f = formula_new(&arena, true);
        uint32_t number = chain_number(f, &chain, &seed);
        float t = chain_at(&chain, random_unit(&seed) * 100);
        if (isfinite(t) && !f->numbers[number].doubt) {
            uint32_t condition = formula_compare(f, number, k & 1, t);
            if (condition > FORMULA_TRUE) {
                const FormulaCondition *c = &f->conditions[condition];
                assert_int_equal(c->a, FORMULA_ACROSS);
                float up = c->value, down = c->value;
                for (int i = 0; i < 300; i++, up = threshold_next(up, true), down = threshold_next(down, false)) {
                    bool wanted = k & 1 ? chain_at(&chain, up) >= t : chain_at(&chain, up) < t;
                    assert_int_equal(c->op == SLICE_FROM ? up >= c->value : up < c->value, wanted);
                    wanted = k & 1 ? chain_at(&chain, down) >= t : chain_at(&chain, down) < t;
                    assert_int_equal(c->op == SLICE_FROM ? down >= c->value : down < c->value, wanted);
                }
                compared++;
            }
        }
        arena_release(&arena);
    }
    assert_true(compared > 300);
}

// --- shapes of formulas

static void a_distance_needs_no_root(void **state)
{
    Arena arena = {0};
    FormulaSteps steps;
    Formula *f = formula_new(&arena, true);
    uint32_t square =
        formula_op2(f, TAPE_ADD, formula_op1(f, TAPE_SQUARE, FORMULA_ACROSS), formula_op1(f, TAPE_SQUARE, FORMULA_UP));
    uint32_t disc = formula_compare(f, formula_op1(f, TAPE_SQRT, square), false, 1);
    assert_true(formula_steps(f, disc, &arena, &steps));
    assert_int_equal(steps.numbers, 3);
    assert_int_equal(steps.compares, 1);
    assert_int_equal(steps.logics, 0);
    assert_int_equal(steps.mixed, 1);
    arena_release(&arena);
}

static void a_maximum_becomes_conditions(void **state)
{
    Arena arena = {0};
    Formula *f = formula_new(&arena, true);
    uint32_t most = formula_op2(f, TAPE_MAX, FORMULA_ACROSS, FORMULA_UP);
    const FormulaCondition *c = &f->conditions[formula_compare(f, most, false, 0.5f)];
    assert_int_equal(c->op, SLICE_AND);
    c = &f->conditions[formula_compare(f, formula_op1(f, TAPE_NEG, most), false, 0)];
    assert_int_equal(c->op, SLICE_OR);
    assert_int_equal(f->conditions[c->a].op, SLICE_FROM);
    assert_true(f->conditions[c->a].value == threshold_next(0, true));
    arena_release(&arena);
}

static void a_difference_becomes_a_comparison(void **state)
{
    Arena arena = {0};
    Formula *f = formula_new(&arena, true);
    uint32_t rest = formula_op2(f, TAPE_SUB, FORMULA_ACROSS, FORMULA_UP);
    const FormulaCondition *c = &f->conditions[formula_compare(f, rest, true, 0)];
    assert_int_equal(c->op, SLICE_NOT_LESS);
    assert_int_equal(c->a, FORMULA_ACROSS);
    arena_release(&arena);
}

static void what_may_be_undefined_is_computed(void **state)
{
    Arena arena = {0};
    Formula *f = formula_new(&arena, true);
    uint32_t root = formula_op1(f, TAPE_SQRT, FORMULA_ACROSS);
    assert_true(f->numbers[root].doubt);
    const FormulaCondition *c = &f->conditions[formula_compare(f, root, false, 1)];
    assert_int_equal(c->a, root);
    arena_release(&arena);
}

static void what_is_known_needs_no_steps(void **state)
{
    Arena arena = {0};
    FormulaSteps steps;
    Formula *f = formula_new(&arena, true);
    uint32_t square = formula_op1(f, TAPE_SQUARE, FORMULA_ACROSS);
    assert_int_equal(formula_compare(f, square, false, 0), FORMULA_FALSE);
    assert_int_equal(formula_compare(f, square, true, 0), FORMULA_TRUE);
    uint32_t below = formula_compare(f, FORMULA_ACROSS, false, 1),
             lower = formula_compare(f, FORMULA_ACROSS, false, 0.5f);
    assert_int_equal(formula_and(f, below, lower), lower);
    assert_int_equal(formula_or(f, below, lower), below);
    assert_int_equal(formula_or(f, below, FORMULA_TRUE), FORMULA_TRUE);
    assert_true(formula_steps(f, FORMULA_TRUE, &arena, &steps));
    assert_true(steps.known && steps.holds);
    arena_release(&arena);
}

static void equal_numbers_are_one(void **state)
{
    Arena arena = {0};
    Formula *f = formula_new(&arena, true);
    uint32_t a = formula_op2(f, TAPE_ADD, FORMULA_ACROSS, FORMULA_UP),
             b = formula_op2(f, TAPE_ADD, FORMULA_UP, FORMULA_ACROSS);
    assert_int_equal(a, b);
    uint32_t minus = formula_op1(f, TAPE_NEG, a);
    assert_int_equal(formula_op1(f, TAPE_NEG, minus), a);
    assert_int_equal(formula_op1(f, TAPE_SQUARE, minus), formula_op1(f, TAPE_SQUARE, a));
    assert_int_equal(formula_op2(f, TAPE_ADD, formula_value(f, 1), formula_value(f, 2)), formula_value(f, 3));
    arena_release(&arena);
}

static void too_many_steps_are_refused(void **state)
{
    Arena arena = {0};
    FormulaSteps steps;
    Formula *f = formula_new(&arena, true);
    uint32_t any = FORMULA_FALSE, sum = FORMULA_ACROSS;
    for (int k = 0; k < 70000; k++) sum = formula_op2(f, TAPE_ADD, formula_op1(f, TAPE_SIN, sum), FORMULA_UP);
    any = formula_or(f, any, formula_compare(f, sum, true, 0.5f));
    assert_false(formula_steps(f, any, &arena, &steps));
    arena_release(&arena);
}

// What is emitted is readable, and what it cannot say is left to programs.
static void formulas_as_code(void **state)
{
    Arena arena = {0};
    FormulaCode code;
    Formula *f = formula_new(&arena, true);
    uint32_t u = formula_op1(f, TAPE_SQUARE, FORMULA_ACROSS);
    uint32_t disc = formula_op2(f, TAPE_ADD, u, formula_op1(f, TAPE_SQUARE, FORMULA_UP));
    uint32_t inside = formula_compare(f, disc, false, 1);
    inside = formula_and(f, inside, formula_compare(f, FORMULA_UP, true, 0.5f));
    assert_true(formula_emit(f, inside, &arena, &code));
    assert_int_equal(code.groups, 1);
    assert_non_null(strstr(code.text, "Range n2 = RANGE_SQUARE(n0);"));
    assert_non_null(strstr(code.text, "FLOAT n4 = POINT_ADD(n2, EACH(n3));"));
    assert_non_null(strstr(code.text, "KNOWN_FROM(n1, 0x1p-1f)"));
    assert_false(formula_emit(f, FORMULA_TRUE, &arena, &code));
    uint32_t wave = formula_compare(f, formula_op1(f, TAPE_SIN, FORMULA_ACROSS), false, 0.5f);
    assert_false(formula_emit(f, wave, &arena, &code));
    uint32_t root = formula_compare(f, formula_op1(f, TAPE_SQRT, FORMULA_ACROSS), false, 0.5f);
    assert_false(formula_emit(f, root, &arena, &code));
    arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(thresholds_are_exact),
        cmocka_unit_test(steps_that_are_not_monotone),
        cmocka_unit_test(chains_become_one_comparison),
        cmocka_unit_test(a_distance_needs_no_root),
        cmocka_unit_test(a_maximum_becomes_conditions),
        cmocka_unit_test(a_difference_becomes_a_comparison),
        cmocka_unit_test(what_may_be_undefined_is_computed),
        cmocka_unit_test(what_is_known_needs_no_steps),
        cmocka_unit_test(equal_numbers_are_one),
        cmocka_unit_test(too_many_steps_are_refused),
        cmocka_unit_test(formulas_as_code),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
