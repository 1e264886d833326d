// Frames: what moves has the value that it would have if it were const; errors say where and why; programs of any
// origin are checked.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "compiler/frame.h"
#include "compiler/lower.h"
#include "compiler/passes.h"
#include "ir_random.h"

static Arena arena;

static Plan *plan_of(Ir *ir, IrId root)
{
    Plan *plan;
    ir_complete(ir, root);
    for (int k = 0; k < PASS_COUNT; k++) {
        Arena scratch = {0};
        assert_true(passes[k].run(ir, &scratch));
        arena_release(&scratch);
    }
    assert_int_equal(plan_lower(ir, &arena, &plan, NULL), LOWER_DONE);
    assert_int_equal(frame_check(plan), plan->step_count);
    return plan;
}

static IrId op(Ir *ir, IrOp what, IrId a, IrId b)
{
    return ir_op2(ir, what, test_span, a, b);
}
static IrId number(Ir *ir, double value)
{
    return ir_const(ir, value);
}
static IrId time_of(Ir *ir)
{
    return ir_node(ir, OP_TIME, test_span, NULL, 0);
}

static IrId ball_of(Ir *ir, IrId radius) // r^2 - |X|^2
{
    IrId o[10];
    for (int k = 0; k < 10; k++) o[k] = number(ir, k < 3 ? -1 : 0);
    o[9] = op(ir, OP_MUL, radius, radius);
    return ir_node(ir, OP_QUADRIC, test_span, o, 10);
}

static IrId moved_by(Ir *ir, IrId field, IrId x)
{
    IrId by[3] = {x, number(ir, 0), number(ir, 0)};
    return op(ir, OP_TRANSFORM, field, ir_move(ir, test_span, by));
}

static const double *values_at(const Plan *plan, double time, const double *inputs)
{
    FrameError error;
    double *values = arena_array(&arena, double, plan->slot_count);
    if (!frame_evaluate(plan, &(FrameInput){time, floor(time * 24), inputs}, values, &error))
        fail_msg("%s", error.text);
    return values;
}

static double field_at_time(Ir *ir, IrId root, double time, double x)
{
    const Plan *plan = plan_of(ir, root);
    return plan_field(plan, values_at(plan, time, NULL), (const double[3]){x, 0, 0}, NULL);
}

static void const_scenes_have_no_steps(void **state)
{
    Ir *ir = ir_new(&arena);
    const Plan *plan = plan_of(ir, ir_moved(ir, ir_sphere(ir, 1), 1, 2, 3));
    assert_int_equal(plan->step_count, 0);
}

static void only_what_is_needed_is_computed(void **state)
{
    Ir *ir = ir_new(&arena);
    op(ir, OP_ADD, time_of(ir), number(ir, 5)); // nobody uses it
    const Plan *plan = plan_of(ir, ball_of(ir, time_of(ir)));
    assert_int_equal(plan->step_count, 2); // time * time, and its place among the coefficients
    assert_int_equal(plan->steps[0].kind, STEP_SCALAR);
    assert_int_equal(plan->steps[1].kind, STEP_GATHER);
}

static void time_frame_and_handles_come_in(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId handle = ir_handle(ir, 2), frame = ir_node(ir, OP_FRAME, test_span, NULL, 0);
    const Plan *plan = plan_of(ir, ball_of(ir, op(ir, OP_ADD, handle, op(ir, OP_ADD, time_of(ir), frame))));
    const double origin[3] = {0};
    assert_true(plan_field(plan, values_at(plan, 0, NULL), origin, NULL) == 4); // the default
    assert_true(plan_field(plan, values_at(plan, 0.5, NULL), origin, NULL) == 14.5 * 14.5);
    assert_true(plan_field(plan, values_at(plan, 0, (const double[]){3}), origin, NULL) == 9);
}

static void moving_maps_are_substituted(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId field = moved_by(ir, moved_by(ir, moved_by(ir, ball_of(ir, number(ir, 1)), number(ir, 2)), time_of(ir)),
                          number(ir, -1));
    assert_true(field_at_time(ir, field, 0.5, 1.5) == 1);
    assert_true(field_at_time(ir, field, 3, 4) == 1);
}

static void what_moves_is_what_it_would_be_if_it_stood(void **state)
{
    for (uint64_t seed = 1; seed <= 500; seed++) {
        Random random = {seed};
        Ir *ir = ir_new(&arena);
        double value = random_in(&random, 0.2, 2);
        IrId handle = ir_handle(ir, value), still = number(ir, value), fields[2];
        for (int k = 0; k < 2; k++) { // the same object with a handle and with its value
            IrId v = k ? still : handle;
            IrId zero = number(ir, 0), axis[3] = {v, number(ir, 1), number(ir, 0.3)},
                 by[3] = {v, op(ir, OP_SUB, v, number(ir, 1)), zero};
            IrId body = op(ir, OP_TRANSFORM, ball_of(ir, v), ir_rotate_axis(ir, test_span, axis, v, by));
            body = op(ir, OP_TRANSFORM, body, ir_move(ir, test_span, by));
            IrId place[5] = {body, number(ir, 0.1), v, number(ir, 2), v};
            IrId frame = ir_node(ir, OP_PLACE, test_span, place, 5);
            IrId bump = ir_quadric(ir, (const double[10]){-20, -20, -10, 0, 0, 0, 0, 0, 0, 1});
            IrId height[6] = {body, bump, frame, zero, zero, op(ir, OP_MUL, v, number(ir, 0.1))};
            IrId strength = ir_node(ir, OP_HEIGHT, test_span, height, 6);
            IrId perturbation = ir_op3(ir, OP_PERTURB, test_span, bump, strength, zero);
            fields[k] = op(ir, OP_FREEFORM, body, op(ir, OP_PTRANSFORM, perturbation, frame));
        }
        const Plan *moving = plan_of(ir, fields[0]);
        const Plan *standing = plan_of(ir, fields[1]);
        assert_int_equal(standing->step_count, 0);
        const double *a = values_at(moving, 0, NULL), *b = values_at(standing, 0, NULL);
        for (int n = 0; n < 50; n++) {
            double p[3];
            for (int k = 0; k < 3; k++) p[k] = random_in(&random, -3, 3);
            double f = plan_field(moving, a, p, NULL), g = plan_field(standing, b, p, NULL);
            if (fabs(f - g) > 1e-9 * fmax(1, fabs(g)))
                fail_msg("seed %llu: %.17g and %.17g", (unsigned long long)seed, f, g);
        }
        arena_release(&arena);
    }
}

// --- errors

static void assert_fails(Ir *ir, IrId root, double time, const char *text)
{
    FrameError error;
    const Plan *plan = plan_of(ir, root);
    double *values = arena_array(&arena, double, plan->slot_count);
    if (frame_evaluate(plan, &(FrameInput){.time = time}, values, &error)) fail_msg("no error: %s", text);
    if (!strstr(error.text, text)) fail_msg("'%s' is not '%s'", error.text, text);
    assert_int_equal(error.span.begin, test_span.begin);
}

static void errors_name_their_cause(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId t = time_of(ir), one = number(ir, 1), zero = number(ir, 0);
    assert_fails(ir, ball_of(ir, op(ir, OP_ADD, op(ir, OP_DIV, one, t), one)), 0, "division by zero");
    assert_fails(ir, ball_of(ir, ir_op1(ir, OP_SQRT, test_span, op(ir, OP_SUB, t, one))), 0,
                 "square root of a negative");
    assert_fails(ir, ball_of(ir, ir_op1(ir, OP_EXP, test_span, op(ir, OP_MUL, t, number(ir, 1e5)))), 1, "too large");
    IrId factors[3] = {t, one, one};
    IrId scaled = op(ir, OP_TRANSFORM, ir_sphere(ir, 1), ir_scale(ir, test_span, factors, NULL));
    assert_fails(ir, scaled, 0, "cannot be inverted");
    IrId place[5] = {ir_sphere(ir, 1), t, zero, zero, zero}; // at the centre there is no gradient
    IrId bump = ir_op3(ir, OP_PERTURB, test_span, ir_sphere(ir, 1), one, zero);
    bump = op(ir, OP_PTRANSFORM, bump, ir_node(ir, OP_PLACE, test_span, place, 5));
    assert_fails(ir, op(ir, OP_FREEFORM, ir_sphere(ir, 1), bump), 0, "misses");
    IrId inverse = ir_op1(ir, OP_INVERSE, test_span, ir_scale(ir, test_span, factors, NULL));
    assert_fails(ir, op(ir, OP_TRANSFORM, ir_sphere(ir, 1), inverse), 0, "cannot be inverted");
    IrId stand[7] = {zero, zero, zero, t, t, zero, zero};
    assert_fails(ir, op(ir, OP_TRANSFORM, ir_sphere(ir, 1), ir_node(ir, OP_STAND, test_span, stand, 7)), 0, "no place");
    IrId identity = ir_matrix(ir, test_span, (const double[12]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    IrId height[6] = {ir_sphere(ir, 1), ir_sphere(ir, 1), identity, t, zero, zero};
    IrId form =
        op(ir, OP_FREEFORM, ir_sphere(ir, 1),
           ir_op3(ir, OP_PERTURB, test_span, ir_sphere(ir, 1), ir_node(ir, OP_HEIGHT, test_span, height, 6), zero));
    assert_fails(ir, form, 2, "does not reach");
}

static void const_errors_are_the_frames_too(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId zero = number(ir, 0), one = number(ir, 1), flat[3] = {one, one, zero};
    assert_fails(ir, ball_of(ir, op(ir, OP_DIV, one, zero)), 0, "division by zero");
    assert_fails(ir, op(ir, OP_TRANSFORM, ir_sphere(ir, 1), ir_scale(ir, test_span, flat, NULL)), 0,
                 "cannot be inverted");
}

static void what_is_not_chosen_harms_nobody(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId t = time_of(ir), one = number(ir, 1);
    IrId safe = op(ir, OP_LT, number(ir, 0.5), t);
    IrId radius = ir_op3(ir, OP_SELECT, test_span, safe, op(ir, OP_DIV, one, t), number(ir, 3));
    assert_true(field_at_time(ir, ball_of(ir, radius), 0, 0) == 9);
    assert_true(field_at_time(ir, ball_of(ir, radius), 2, 0) == 0.25);
    IrId both = op(ir, OP_AND, safe, op(ir, OP_LT, op(ir, OP_DIV, one, t), one));
    assert_true(field_at_time(ir, ball_of(ir, both), 0, 0) == 0);
}

static void asserts_speak_first(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId t = time_of(ir), condition = op(ir, OP_LT, number(ir, 0), t);
    IrId ball = ball_of(ir, op(ir, OP_DIV, number(ir, 1), t));
    IrId asserted = ir_node_text(ir, OP_ASSERT, test_span, &condition, 1, "time is to have begun");
    ir->asserts = &asserted;
    ir->assert_count = 1;
    assert_fails(ir, ball, 0, "time is to have begun");
    assert_true(field_at_time(ir, ball, 1, 0) == 1);
}

static void inputs_are_numbers(void **state)
{
    Ir *ir = ir_new(&arena);
    FrameError error;
    const Plan *plan = plan_of(ir, ball_of(ir, ir_handle(ir, 1)));
    double *values = arena_array(&arena, double, plan->slot_count);
    assert_false(frame_evaluate(plan, &(FrameInput){.time = NAN}, values, &error));
    assert_false(frame_evaluate(plan, &(FrameInput){.inputs = (const double[]){INFINITY}}, values, &error));
    assert_non_null(strstr(error.text, "parameter"));
}

// --- visibility

static void hidden_things_are_not_there(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId t = time_of(ir), shown = op(ir, OP_LT, number(ir, 1), t);
    IrId ball = ball_of(ir, number(ir, 2)), hole = ball_of(ir, number(ir, 1));
    assert_true(field_at_time(ir, op(ir, OP_SHOW, ball, shown), 0, 0) == -INFINITY);
    assert_true(field_at_time(ir, op(ir, OP_SHOW, ball, shown), 2, 0) == 4);
    IrId cut = op(ir, OP_INTERSECT, ball, ir_op1(ir, OP_COMPLEMENT, test_span, op(ir, OP_SHOW, hole, shown)));
    assert_true(field_at_time(ir, cut, 0, 0) > 0); // a hidden thing subtracts nothing
    assert_true(field_at_time(ir, cut, 2, 0) < 0);
    assert_true(field_at_time(ir, cut, 0, 1.9) > 0);
    assert_true(field_at_time(ir, cut, 0, 2.1) < 0);
}

// --- programs of any origin

static void broken_programs_are_found(void **state)
{
    for (int fault = 0; fault < 400; fault++) {
        Random random = {(uint64_t)fault};
        Ir *ir = random_ir(&arena, &random, true);
        Plan *plan = plan_of(ir, ir->root);
        if (plan->step_count) {
            PlanStep *step = &plan->steps[random_below(&random, (int)plan->step_count)];
            switch (fault % 6) {
            case 0: step->result = plan->slot_count; break;
            case 1: step->count = plan->operand_count + 1; break;
            case 2: step->kind = 77; break;
            case 3: plan->operands[step->first] = UINT32_MAX; break;
            case 4: step->first = UINT32_MAX; break;
            case 5: plan->slot_count = 3; break;
            }
            assert_true(frame_check(plan) < plan->step_count);
        }
        arena_release(&arena);
    }
}

// Whatever the operands are, a program that passes the check runs without reading beyond its values.
static void checked_programs_can_be_run(void **state)
{
    int run = 0;
    for (uint64_t seed = 1; seed <= 3000; seed++) {
        Random random = {seed};
        FrameError error;
        Ir *ir = random_ir(&arena, &random, true);
        Plan *plan = plan_of(ir, ir->root);
        for (int k = 0; k < 3 && plan->operand_count; k++) {
            uint32_t *operand = &plan->operands[random_below(&random, (int)plan->operand_count)];
            *operand = (uint32_t)random_below(&random, (int)plan->slot_count);
        }
        if (frame_check(plan) == plan->step_count) {
            double *values = malloc(plan->slot_count * sizeof *values); // alone, so that a sanitizer sees its ends
            frame_evaluate(plan, &(FrameInput){.time = 0.5}, values, &error);
            free(values);
            run++;
        }
        arena_release(&arena);
    }
    assert_true(run > 500);
}

static int release(void **state)
{
    arena_release(&arena);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(const_scenes_have_no_steps, release),
        cmocka_unit_test_teardown(only_what_is_needed_is_computed, release),
        cmocka_unit_test_teardown(time_frame_and_handles_come_in, release),
        cmocka_unit_test_teardown(moving_maps_are_substituted, release),
        cmocka_unit_test_teardown(what_moves_is_what_it_would_be_if_it_stood, release),
        cmocka_unit_test_teardown(errors_name_their_cause, release),
        cmocka_unit_test_teardown(const_errors_are_the_frames_too, release),
        cmocka_unit_test_teardown(what_is_not_chosen_harms_nobody, release),
        cmocka_unit_test_teardown(asserts_speak_first, release),
        cmocka_unit_test_teardown(inputs_are_numbers, release),
        cmocka_unit_test_teardown(hidden_things_are_not_there, release),
        cmocka_unit_test_teardown(broken_programs_are_found, release),
        cmocka_unit_test_teardown(checked_programs_can_be_run, release),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
