// Bounds: exact where the shape has exact ones, never too small, honest about what has no end.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "compiler/bounds.h"
#include "compiler/frame.h"
#include "compiler/lower.h"
#include "compiler/passes.h"
#include "ir_random.h"

static Arena arena;

static Plan *plan_of(Ir *ir)
{
    Plan *plan;
    for (int k = 0; k < PASS_COUNT; k++) {
        Arena scratch = {0};
        assert_true(passes[k].run(ir, &scratch));
        arena_release(&scratch);
    }
    assert_int_equal(plan_lower(ir, &arena, &plan, NULL), LOWER_DONE);
    return plan;
}

static Bounds scene_bounds(Ir *ir, IrId root)
{
    FrameError error;
    ir_complete(ir, root);
    Plan *plan = plan_of(ir);
    double *values = arena_array(&arena, double, plan->slot_count);
    assert_true(frame_evaluate(plan, &(FrameInput){0}, values, &error));
    return bounds_of_plan(plan, values);
}

static void assert_box(Bounds b, double x0, double x1, double y0, double y1, double z0, double z1)
{
    const double low[3] = {x0, y0, z0}, high[3] = {x1, y1, z1};
    for (int k = 0; k < 3; k++) {
        bool ok = b.low[k] <= low[k] && b.high[k] >= high[k];
        if (isfinite(low[k])) ok = ok && b.low[k] > low[k] - 0.02 * (1 + fabs(low[k]));
        if (isfinite(high[k])) ok = ok && b.high[k] < high[k] + 0.02 * (1 + fabs(high[k]));
        if (!ok) fail_msg("axis %d: %.12g..%.12g, not %g..%g", k, b.low[k], b.high[k], low[k], high[k]);
    }
}

static IrId slab(Ir *ir, int axis, double low, double high) // (t - low)(high - t) / (high - low)
{
    double q[10] = {0}, width = high - low;
    q[axis] = -1 / width;
    q[6 + axis] = (low + high) / width;
    q[9] = -low * high / width;
    return ir_quadric(ir, q);
}

static IrId both(Ir *ir, IrOp op, IrId a, IrId b)
{
    return ir_op2(ir, op, test_span, a, b);
}

static IrId box(Ir *ir, double x, double y, double z)
{
    IrId o[3] = {slab(ir, 0, -x, x), slab(ir, 1, -y, y), slab(ir, 2, -z, z)};
    return ir_node(ir, OP_INTERSECT, test_span, o, 3);
}

static IrId turned(Ir *ir, IrId field, double x, double y, double z)
{
    IrId angles[3] = {ir_const(ir, x), ir_const(ir, y), ir_const(ir, z)};
    return ir_op2(ir, OP_TRANSFORM, test_span, field, ir_rotate_xyz(ir, test_span, angles, NULL));
}

static const double cylinder[10] = {-0.5, -0.5, 0, 0, 0, 0, 0, 0, 0, 0.5};

static void of_one_quadric(void **state)
{
    Ir *ir = ir_new(&arena);
    assert_box(scene_bounds(ir, ir_moved(ir, ir_sphere(ir, 2), 1, 0, -3)), -1, 3, -2, 2, -5, -1);
    assert_box(scene_bounds(ir, slab(ir, 1, 2, 3)), -INFINITY, INFINITY, 2, 3, -INFINITY, INFINITY);
    assert_box(scene_bounds(ir, ir_quadric(ir, cylinder)), -1, 1, -1, 1, -INFINITY, INFINITY);
    const double half[10] = {[7] = -1, [9] = 4}, bowl[10] = {-1, -1, 0, 0, 0, 0, 0, 0, 1, 0}, cone[10] = {-1, -1, 1};
    assert_box(scene_bounds(ir, ir_quadric(ir, half)), -INFINITY, INFINITY, -INFINITY, 4, -INFINITY, INFINITY);
    assert_box(scene_bounds(ir, ir_quadric(ir, bowl)), -INFINITY, INFINITY, -INFINITY, INFINITY, 0, INFINITY);
    assert_box(scene_bounds(ir, ir_quadric(ir, cone)), -INFINITY, INFINITY, -INFINITY, INFINITY, -INFINITY, INFINITY);
}

static void of_a_box(void **state)
{
    Ir *ir = ir_new(&arena);
    assert_box(scene_bounds(ir, box(ir, 1, 2, 3)), -1, 1, -2, 2, -3, 3);
    double d = 3 / sqrt(2);
    assert_box(scene_bounds(ir, turned(ir, box(ir, 1, 2, 3), 0, 0, M_PI / 4)), -d, d, -d, d, -3, 3);
    Bounds b = scene_bounds(ir, turned(ir, box(ir, 1, 1, 1), 0.3, 0.7, 1.1));
    assert_true(bounds_finite(&b) && b.high[0] < 1.74);
    assert_box(scene_bounds(ir, turned(ir, box(ir, 1, 2, 3), M_PI / 2, 0, 0)), -1, 1, -3, 3, -2, 2);
}

static void of_half_spaces(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId o[4]; // a tetrahedron with corners 0 and 1 on each axis
    for (int k = 0; k < 3; k++) {
        double q[10] = {0};
        q[6 + k] = 1;
        o[k] = ir_quadric(ir, q);
    }
    o[3] = ir_quadric(ir, (const double[10]){[6] = -1, [7] = -1, [8] = -1, [9] = 1});
    assert_box(scene_bounds(ir, ir_node(ir, OP_INTERSECT, test_span, o, 4)), 0, 1, 0, 1, 0, 1);
}

// A prism of eighteen sides that leans, between slanting ends: twenty planes, none of them across an axis.
static void of_leaning_prisms(void **state)
{
    (void)state;
    Ir *ir = ir_new(&arena);
    double x = 0, y = 0, z = 0, axis[3] = {0.3, 0.4, sqrt(1 - 0.25)};
    IrId sides[10];
    for (int k = 0; k < 10; k++) {
        double angle = k * M_PI / 9, u[3] = {axis[2], 0, -axis[0]}, v[3], n[3], half = k < 9 ? 0.5 : 1;
        double across = sqrt(axis[0] * axis[0] + axis[2] * axis[2]);
        for (int i = 0; i < 3; i++) u[i] /= across;
        for (int i = 0; i < 3; i++) v[i] = axis[(i + 1) % 3] * u[(i + 2) % 3] - axis[(i + 2) % 3] * u[(i + 1) % 3];
        for (int i = 0; i < 3; i++) n[i] = k < 9 ? cos(angle) * u[i] + sin(angle) * v[i] : axis[i];
        double q[10] = {
            -n[0] * n[0], -n[1] * n[1], -n[2] * n[2], -2 * n[0] * n[1], -2 * n[0] * n[2], -2 * n[1] * n[2], 0, 0, 0,
            half * half};
        sides[k] = ir_quadric(ir, q);
    }
    Bounds b = scene_bounds(ir, ir_node(ir, OP_INTERSECT, (Span){0}, sides, 10));
    // A corner is half / cos(10 degrees) from the axis, on one of eighteen rays; the box is around those of both ends.
    for (int end = -1; end <= 1; end += 2) {
        for (int k = 0; k < 18; k++) {
            double angle = (k + 0.5) * M_PI / 9, r = 0.5 / cos(M_PI / 18),
                   across = sqrt(axis[0] * axis[0] + axis[2] * axis[2]);
            double u[3] = {axis[2] / across, 0, -axis[0] / across}, v[3], p[3];
            for (int i = 0; i < 3; i++) v[i] = axis[(i + 1) % 3] * u[(i + 2) % 3] - axis[(i + 2) % 3] * u[(i + 1) % 3];
            for (int i = 0; i < 3; i++) p[i] = end * axis[i] + r * (cos(angle) * u[i] + sin(angle) * v[i]);
            x = fmax(x, p[0]), y = fmax(y, p[1]), z = fmax(z, p[2]);
        }
    }
    assert_box(b, -x, x, -y, y, -z, z);
}

static void of_what_has_caps(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId capped = both(ir, OP_INTERSECT, ir_quadric(ir, cylinder), slab(ir, 2, -3, 3));
    assert_box(scene_bounds(ir, capped), -1, 1, -1, 1, -3, 3);
    double d = (3 + 1) / sqrt(2);
    assert_box(scene_bounds(ir, turned(ir, capped, 0, M_PI / 4, 0)), -d, d, -1, 1, -d, d);
    const double cone[10] = {-1, -1, 1, 0, 0, 0, 0, 0, -2, 1}; // x^2 + y^2 <= (1 - z)^2
    IrId tip = both(ir, OP_INTERSECT, ir_quadric(ir, cone), slab(ir, 2, 0, 1));
    Bounds b = scene_bounds(ir, tip);
    assert_true(bounds_finite(&b) && b.low[0] <= -1 && b.low[0] > -1.6 && b.high[2] >= 1 && b.high[2] < 1.01);
    const double bowl[10] = {-1, -1, 0, 0, 0, 0, 0, 0, 1, 0};
    b = scene_bounds(ir, both(ir, OP_INTERSECT, ir_quadric(ir, bowl), slab(ir, 2, -4, 4)));
    assert_true(bounds_finite(&b) && b.low[0] <= -2 && b.low[0] > -3.5);
}

static void of_sets_and_free_forms(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId a = ir_sphere(ir, 1), far = ir_moved(ir, ir_sphere(ir, 1), 10, 0, 0);
    assert_box(scene_bounds(ir, both(ir, OP_UNION, a, far)), -1, 11, -1, 1, -1, 1);
    Bounds b = scene_bounds(ir, both(ir, OP_INTERSECT, a, far));
    assert_true(bounds_empty(&b));
    IrId hole = ir_op1(ir, OP_COMPLEMENT, test_span, ir_sphere(ir, 0.5));
    assert_box(scene_bounds(ir, both(ir, OP_INTERSECT, a, hole)), -1, 1, -1, 1, -1, 1);
    b = scene_bounds(ir, hole);
    assert_true(isinf(b.low[0]) && isinf(b.high[2]));
    IrId bump = ir_moved(ir, ir_sphere(ir, 1), 0, 2, 0);
    IrId adds = ir_op3(ir, OP_PERTURB, test_span, bump, ir_const(ir, 1), ir_const(ir, 0));
    IrId takes = ir_op3(ir, OP_PERTURB, test_span, bump, ir_const(ir, -1), ir_const(ir, 0));
    assert_box(scene_bounds(ir, both(ir, OP_FREEFORM, a, adds)), -1, 1, -1, 3, -1, 1);
    assert_box(scene_bounds(ir, both(ir, OP_FREEFORM, a, takes)), -1, 1, -1, 1, -1, 1);
}

static void of_nothing_and_everything(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId empty = ir_node(ir, OP_EMPTY, test_span, NULL, 0);
    Bounds b = scene_bounds(ir, empty);
    assert_true(bounds_empty(&b));
    b = scene_bounds(ir, ir_op1(ir, OP_COMPLEMENT, test_span, empty));
    assert_false(bounds_empty(&b));
    b = scene_bounds(ir, ir_quadric(ir, (const double[10]){-1, -1, -1, 0, 0, 0, 0, 0, 0, -1}));
    assert_true(bounds_empty(&b));
    b = scene_bounds(ir, ir_quadric(ir, (const double[10]){-1, 0, 0, 0, 0, 0, 0, 0, 0, -1}));
    assert_true(bounds_empty(&b));
}

static void of_a_named_object(void **state)
{
    Ir *ir = ir_new(&arena);
    FrameError error;
    IrId ball = ir_moved(ir, ir_sphere(ir, 1), 5, 0, 0);
    IrId named = ir_node_text(ir, OP_NAMED, test_span, &ball, 1, "ball");
    ir_complete(ir, both(ir, OP_UNION, ir_sphere(ir, 1), named));
    Plan *plan = plan_of(ir);
    double *values = arena_array(&arena, double, plan->slot_count);
    assert_true(frame_evaluate(plan, &(FrameInput){0}, values, &error));
    assert_int_equal(plan->object_count, 2);
    assert_string_equal(plan->objects[1].name, "ball");
    assert_box(bounds_of_object(plan, values, 1), 4, 6, -1, 1, -1, 1);
}

// No point that is inside is outside of the box.
static void never_too_small(void **state)
{
    int finite = 0;
    for (uint64_t seed = 1; seed <= 3000; seed++) {
        Arena mine = {0};
        Random random = {seed};
        Ir *ir = random_ir(&mine, &random, seed % 2);
        double input = 0.3;
        FrameError error;
        Plan *plan = plan_of(ir);
        double *values = arena_array(&mine, double, plan->slot_count);
        assert_true(frame_evaluate(plan, &(FrameInput){0.4, 9, &input}, values, &error));
        Bounds b = bounds_of_plan(plan, values);
        finite += bounds_finite(&b);
        for (int n = 0; n < 200; n++) {
            double p[3];
            for (int k = 0; k < 3; k++) p[k] = random_in(&random, -4, 4);
            if (plan_field(plan, values, p, NULL) < 0) continue;
            for (int k = 0; k < 3; k++) {
                if (p[k] >= b.low[k] && p[k] <= b.high[k]) continue;
                fail_msg("seed %llu: (%g, %g, %g) is inside, the box is %g..%g on axis %d", (unsigned long long)seed,
                         p[0], p[1], p[2], b.low[k], b.high[k], k);
            }
        }
        arena_release(&mine);
        arena_release(&arena);
    }
    assert_true(finite > 100);
}

static int release(void **state)
{
    arena_release(&arena);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(of_one_quadric, release),
        cmocka_unit_test_teardown(of_a_box, release),
        cmocka_unit_test_teardown(of_half_spaces, release),
        cmocka_unit_test_teardown(of_leaning_prisms, release),
        cmocka_unit_test_teardown(of_what_has_caps, release),
        cmocka_unit_test_teardown(of_sets_and_free_forms, release),
        cmocka_unit_test_teardown(of_nothing_and_everything, release),
        cmocka_unit_test_teardown(of_a_named_object, release),
        cmocka_unit_test_teardown(never_too_small, release),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
