// Rays: the first crossing of a surface, of known shapes and of random fields of every kind.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "compiler/object.h"
#include "compiler/ray.h"
#include "ir_random.h"

static Arena arena;

static bool first_of(Ir *ir, IrId field, const double from[3], const double direction[3], double *t)
{
    IrValues v = ir_evaluate(ir, &arena, 0, (const double[1]){0});
    FieldCode code = ir_field_code(&v, field);
    return ray_first(code, v.values, from, direction, t);
}

static void assert_first(Ir *ir, IrId field, double x, double y, double expected)
{
    double t = NAN;
    assert_true(first_of(ir, field, (double[3]){x, y, 5}, (double[3]){0, 0, -1}, &t));
    assert_true(fabs(t - expected) < 1e-12 * expected);
}

static void assert_misses(Ir *ir, IrId field, double x, double y)
{
    double t;
    assert_false(first_of(ir, field, (double[3]){x, y, 5}, (double[3]){0, 0, -1}, &t));
}

static IrId set(Ir *ir, IrOp op, IrId a, IrId b)
{
    return ir_op2(ir, op, test_span, a, b);
}

static void quadrics_from_outside_and_inside(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId ball = ir_sphere(ir, 1);
    double t;
    assert_first(ir, ball, 0, 0, 4);
    assert_first(ir, ball, 0.6, 0, 4.2);
    assert_misses(ir, ball, 1.1, 0);
    assert_true(first_of(ir, ball, (double[3]){0, 0, 0.5}, (double[3]){0, 0, -1}, &t)); // it leaves
    assert_true(fabs(t - 1.5) < 1e-12);
    assert_false(first_of(ir, ball, (double[3]){0, 0, 5}, (double[3]){0, 0, 1}, &t)); // behind is not ahead
}

static void what_touches_is_not_crossed(void **state)
{
    Ir *ir = ir_new(&arena);
    assert_misses(ir, ir_sphere(ir, 1), 1, 0);
}

static void sets_ask_all_their_leaves(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId ball = ir_sphere(ir, 1), small = ir_sphere(ir, 0.5), near = ir_moved(ir, small, 0, 0, 2);
    assert_first(ir, set(ir, OP_UNION, ball, near), 0, 0, 2.5);
    assert_misses(ir, set(ir, OP_INTERSECT, ball, near), 0, 0);
    IrId cup = set(ir, OP_INTERSECT, ball, ir_op1(ir, OP_COMPLEMENT, test_span, ir_moved(ir, small, 0, 0, 1)));
    assert_first(ir, cup, 0, 0, 4.5); // the bottom of the hollow
    IrId hollow = set(ir, OP_INTERSECT, ball, ir_op1(ir, OP_COMPLEMENT, test_span, ball));
    assert_misses(ir, hollow, 0.3, 0.2); // equal faces leave nothing between them
    assert_misses(ir, ir_node(ir, OP_UNION, test_span, NULL, 0), 0, 0);
}

static void far_surfaces_are_found(void **state)
{
    Ir *ir = ir_new(&arena);
    double plane[10] = {0, 0, 0, 0, 0, 0, 0, 0, -1e-4, -1}; // z <= -10000
    assert_first(ir, ir_quadric(ir, plane), 0, 0, 10005);
    double slab[10] = {0, 0, -1, 0, 0, 0, 0, 0, 0, 1e-10}; // a sheet of 2e-5
    double t;
    assert_true(first_of(ir, ir_quadric(ir, slab), (double[3]){0, 0, 5}, (double[3]){0, 0, -1}, &t));
    assert_true(fabs(t - (5 - 1e-5)) < 1e-9);
}

// A thin spike that steps would leap over.
static void thin_supports_are_met(void **state)
{
    Ir *ir = ir_new(&arena);
    double q[10] = {-1e8, -1e8, 0, 0, 0, 0, 0, 0, 0, 1}; // a cylinder of radius 1e-4 about z
    IrId strength = ir_const(ir, 2), zero = ir_const(ir, 0);
    IrId spike = ir_op3(ir, OP_PERTURB, test_span, ir_quadric(ir, q), strength, zero);
    IrId hedgehog = set(ir, OP_FREEFORM, ir_sphere(ir, 1), spike);
    double t;
    assert_true(first_of(ir, hedgehog, (double[3]){5, 0, 2}, (double[3]){-1, 0, 0}, &t)); // above the ball
    assert_true(fabs(t - 5) < 1e-4);
}

// F has one sign up to the crossing and the other behind it, wherever one looks.
static void random_fields_change_their_sign_there_and_not_before(void **state)
{
    enum { FIELDS = 400, RAYS = 8, LOOKS = 400 };
    Random random = {12};
    int hits = 0;
    for (int i = 0; i < FIELDS; i++) {
        Arena local = {0};
        Ir *ir = random_ir(&local, &random, false);
        IrValues v = ir_evaluate(ir, &local, 0, (const double[1]){0});
        FieldCode code = ir_field_code(&v, ir->root);
        for (int k = 0; k < RAYS; k++) {
            double from[3], way[3], p[3], t = INFINITY;
            for (int j = 0; j < 3; j++) {
                from[j] = random_in(&random, -4, 4);
                way[j] = random_in(&random, -1, 1) - from[j];
            }
            bool inside = field_at(code, v.values, from).f > 0;
            bool hit = ray_first(code, v.values, from, way, &t);
            hits += hit;
            double end = hit && t < 20 ? t : 20;
            for (int look = 1; look <= LOOKS; look++) {
                double at = end * look / (LOOKS + 1.0);
                for (int j = 0; j < 3; j++) p[j] = from[j] + at * way[j];
                double f = field_at(code, v.values, p).f;
                if (fabs(f) > 1e-7 * (1 + fabs(f))) assert_int_equal(f > 0, inside);
            }
            if (!hit) continue;
            for (int j = 0; j < 3; j++) p[j] = from[j] + t * way[j];
            FieldValue there = field_at(code, v.values, p);
            double slope = fabs(there.gradient[0] * way[0] + there.gradient[1] * way[1] + there.gradient[2] * way[2]);
            if (slope > 1e-3) assert_true(fabs(there.f) / slope < 1e-6);
        }
        arena_release(&local);
    }
    assert_true(hits > FIELDS); // it is not all misses
}

// The same random objects as one expression: field programs with a tape give the F, the gradient and the crossing that
// those of quadrics do.
static void what_is_an_expression_is_crossed_where_its_quadrics_are(void **state)
{
    enum { FIELDS = 150, RAYS = 6 };
    Random random = {31};
    int hits = 0, agree = 0, misses = 0;
    for (int i = 0; i < FIELDS; i++) {
        Arena local = {0};
        Ir *ir = random_ir(&local, &random, false);
        IrId exact = ir->root, leaves = object_leaves(ir, exact);
        if (object_may_hide(ir, leaves)) { // what is nowhere is a large number in expressions, not infinity
            arena_release(&local);
            continue;
        }
        IrId general = ir_op1(ir, OP_FIELD, test_span, object_expression(ir, leaves));
        IrId half = set(ir, OP_INTERSECT, exact, general); // an expression beside quadrics
        ir_complete(ir, set(ir, OP_UNION, exact, half));
        IrValues v = ir_evaluate(ir, &local, 0, (const double[1]){0});
        FieldCode a = ir_field_code(&v, exact), b = ir_field_code(&v, i % 2 ? general : half);
        assert_false(field_is_general(a));
        assert_true(field_is_general(b));
        for (int k = 0; k < RAYS; k++) {
            double from[3], way[3], t = 0, u = 0;
            for (int j = 0; j < 3; j++) {
                from[j] = random_in(&random, -4, 4);
                way[j] = random_in(&random, -1, 1) - from[j];
            }
            FieldValue f = field_at(a, v.values, from), g = field_at(b, v.values, from);
            if (isfinite(f.f)) assert_true(fabs(f.f - g.f) <= 1e-9 * (1 + fabs(f.f)));
            bool hit = ray_first(a, v.values, from, way, &t), also = ray_first_general(b, v.values, from, way, &u);
            if (!hit) {
                misses++;
                assert_false(also);
                continue;
            }
            hits++;
            agree += also && fabs(t - u) <= 1e-9 * (1 + t);
        }
        arena_release(&local);
    }
    assert_true(hits > FIELDS && misses > FIELDS);
    print_message("%d of %d crossings agree\n", agree, hits);
    assert_true(agree >= hits - hits / 100); // where two leaves touch on the way, rounding decides
}

static void what_is_undefined_is_outside(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId x = ir_node(ir, OP_X, test_span, NULL, 0), z = ir_node(ir, OP_Z, test_span, NULL, 0);
    IrId r = ir_op2(ir, OP_SUB, test_span, ir_const(ir, 1), ir_op2(ir, OP_MUL, test_span, z, z));
    IrId root = ir_op1(ir, OP_FIELD, test_span, ir_op1(ir, OP_SQRT, test_span, r)); // defined for |z| <= 1
    assert_first(ir, root, 0, 0, 4);
    assert_misses(ir, ir_op1(ir, OP_COMPLEMENT, test_span, root), 0, 0);
    assert_first(ir, set(ir, OP_UNION, root, ir_sphere(ir, 2)), 0, 0, 3);
    assert_first(ir, set(ir, OP_INTERSECT, root, ir_sphere(ir, 2)), 0, 0, 4);
    IrId pole = ir_op2(ir, OP_DIV, test_span, ir_const(ir, 1), ir_op2(ir, OP_SUB, test_span, z, ir_const(ir, 2)));
    assert_first(ir, ir_op1(ir, OP_COMPLEMENT, test_span, ir_op1(ir, OP_FIELD, test_span, pole)), 0, 0, 3);
    IrId step = ir_op2(ir, OP_SUB, test_span, ir_const(ir, 0.5), ir_op1(ir, OP_FLOOR, test_span, z));
    assert_first(ir, ir_op1(ir, OP_FIELD, test_span, step), 0, 0, 4); // a jump over 0 is a surface
    IrId tangled = ir_op1(ir, OP_SIN, test_span, ir_op2(ir, OP_MUL, test_span, ir_const(ir, 1000), x));
    assert_misses(ir, ir_op1(ir, OP_FIELD, test_span, ir_op2(ir, OP_SUB, test_span, tangled, ir_const(ir, 2))), 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quadrics_from_outside_and_inside),
        cmocka_unit_test(what_touches_is_not_crossed),
        cmocka_unit_test(sets_ask_all_their_leaves),
        cmocka_unit_test(far_surfaces_are_found),
        cmocka_unit_test(thin_supports_are_met),
        cmocka_unit_test(what_is_an_expression_is_crossed_where_its_quadrics_are),
        cmocka_unit_test(what_is_undefined_is_outside),
        cmocka_unit_test(random_fields_change_their_sign_there_and_not_before),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    arena_release(&arena);
    return failed;
}
