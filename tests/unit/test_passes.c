// Passes: F stays what it was at every point, and each leaves the form that its documentation promises.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>

#include "compiler/frame.h"
#include "compiler/lower.h"
#include "compiler/passes.h"
#include "ir_random.h"

enum { RANDOM_SCENES = 3000, POINTS = 12 };

static void random_point(Random *random, double p[3])
{
    for (int k = 0; k < 3; k++) p[k] = random_in(random, -3, 3);
}

static double field_of(const Ir *ir, double time, const double *inputs, const double p[3], double *size)
{
    Arena scratch = {0};
    IrValues values = ir_evaluate(ir, &scratch, time, inputs);
    FieldCode code = ir_field_code(&values, ir->root);
    FieldValue value = field_at(code, values.values, p);
    *size = 0; // of the numbers that F is made of
    for (uint32_t k = 0; k < values.count; k++) *size = fmax(*size, fabs(values.values[k]));
    arena_release(&scratch);
    return value.f;
}

static void assert_same_field(double a, double b, double size, const char *after, uint64_t seed)
{
    double scale = fmax(1, fmax(fabs(a), size));
    if (a == b || fabs(a - b) <= 1e-9 * scale * scale) return;
    fail_msg("after %s, seed %llu: F was %.17g and is %.17g", after, (unsigned long long)seed, a, b);
}

// Where something hidden is subtracted, F is infinite in the IR; a leaf with that condition is F = 1 or F = -1
// instead. So in such scenes what is not between is compared by its sign.
static bool subtracts_hidden(const Ir *ir)
{
    bool complement = false, show = false;
    for (IrId id = 1; id < ir->count; id++) {
        complement |= ir_at(ir, id)->op == OP_COMPLEMENT;
        show |= ir_at(ir, id)->op == OP_SHOW;
    }
    return complement && show;
}

static bool same_side(double a, double b)
{
    return fabs(a) > 0.999 && fabs(b) > 0.999 && (a > 0) == (b > 0);
}

static void check_scene(uint64_t seed, bool moving)
{
    Arena arena = {0};
    Random random = {seed};
    Ir *ir = random_ir(&arena, &random, moving);
    double time = random_in(&random, 0, 3), input = random_in(&random, -1, 1);
    double points[POINTS][3], before[POINTS];
    bool hidden = subtracts_hidden(ir);
    double size;
    assert_null(ir_verify(ir));
    for (int k = 0; k < POINTS; k++) {
        random_point(&random, points[k]);
        before[k] = field_of(ir, time, &input, points[k], &size);
    }
    for (int pass = 0; pass < PASS_COUNT; pass++) {
        Arena scratch = {0};
        assert_true(passes[pass].run(ir, &scratch));
        arena_release(&scratch);
        const char *wrong = pass_verify(ir, &passes[pass]);
        if (wrong) fail_msg("seed %llu: %s", (unsigned long long)seed, wrong);
        for (int k = 0; k < POINTS; k++) {
            double after = field_of(ir, time, &input, points[k], &size);
            if (hidden && same_side(before[k], after)) continue;
            assert_same_field(before[k], after, size, passes[pass].name, seed);
        }
    }
    Plan *plan;
    FrameError error;
    assert_int_equal(plan_lower(ir, &arena, &plan, NULL), LOWER_DONE);
    assert_int_equal(frame_check(plan), plan->step_count);
    double *values = arena_array(&arena, double, plan->slot_count);
    if (!frame_evaluate(plan, &(FrameInput){time, floor(time * 24), &input}, values, &error)) {
        fail_msg("seed %llu: the frame fails: %s", (unsigned long long)seed, error.text);
    }
    for (int k = 0; k < POINTS; k++) {
        double after = plan_field(plan, values, points[k], NULL);
        if (hidden && same_side(before[k], after)) continue;
        assert_same_field(before[k], after, size, "lowering", seed);
    }
    arena_release(&arena);
}

static void the_field_stays_what_it_was(void **state)
{
    for (uint64_t seed = 1; seed <= RANDOM_SCENES; seed++) check_scene(seed, false);
}

static void the_field_of_what_moves_stays_what_it_was(void **state)
{
    for (uint64_t seed = 1; seed <= RANDOM_SCENES; seed++) check_scene(seed, true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_field_stays_what_it_was),
        cmocka_unit_test(the_field_of_what_moves_stays_what_it_was),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
