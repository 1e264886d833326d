// The oracle against geometry that is known in closed form, and against itself: exact roots, dense samples and the IR's own field must agree.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/oracle/oracle.h"

static const Span nowhere;

static IrId number(Ir *ir, double value)
{
    return ir_const(ir, value);
}

static IrId quadric(Ir *ir, const double a[10])
{
    IrId operands[10];
    for (int k = 0; k < 10; k++) operands[k] = number(ir, a[k]);
    return ir_node(ir, OP_QUADRIC, nowhere, operands, 10);
}

static IrId sphere(Ir *ir, double x, double y, double z, double r)
{
    return quadric(ir, (double[]){-1, -1, -1, 0, 0, 0, 2 * x, 2 * y, 2 * z, r * r - x * x - y * y - z * z});
}

static IrId two(Ir *ir, IrOp op, IrId a, IrId b)
{
    return ir_node(ir, op, nowhere, (IrId[]){a, b}, 2);
}

static IrId perturb(Ir *ir, IrId q, double strength)
{
    return ir_node(ir, OP_PERTURB, nowhere, (IrId[]){q, number(ir, strength), number(ir, 0)}, 3);
}

static IrId thing(Ir *ir, IrOp op, const double *values, uint32_t count)
{
    IrId operands[16];
    for (uint32_t k = 0; k < count; k++) operands[k] = number(ir, values[k]);
    return ir_node_index(ir, op, nowhere, operands, count, 0);
}

// A scene of one field, seen from (0, 0, 5), with a light that travels along -z.
static Oracle *scene(Ir *ir, IrId root)
{
    static char why[ORACLE_ERROR];
    ir->root = root;
    ir->camera = thing(ir, OP_CAMERA, (double[15]){0, 0, 5, 0, 0, 0, 0, 1, 0, 0.7, 2}, 15);
    ir->background = thing(ir, OP_BACKGROUND, (double[4]){0.1, 0.2, 0.3}, 4);
    ir->lights = arena_array(ir->arena, IrId, 1);
    ir->lights[0] = thing(ir, OP_LIGHT, (double[14]){0, 0, -1, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 1}, 14);
    ir->light_count = 1;
    Oracle *oracle = oracle_new(ir, &(OracleFrame){0}, why);
    if (!oracle) fail_msg("%s", why);
    return oracle;
}

static OracleRay ray(double x, double y, double z, double dx, double dy, double dz)
{
    double length = sqrt(dx * dx + dy * dy + dz * dz);
    return (OracleRay){{x, y, z}, {dx / length, dy / length, dz / length}, 0, ORACLE_INFINITY};
}

static void near_to(double a, double b, double tolerance)
{
    if (!(fabs(a - b) <= tolerance)) fail_msg("%.17g is not %.17g", a, b);
}

static void a_sphere_is_hit_where_it_is(void **state)
{
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    Oracle *oracle = scene(ir, sphere(ir, 0, 0, 0, 1));
    OracleRay r = ray(0.6, 0, 5, 0, 0, -1);
    OracleHit hit;
    assert_true(oracle_hit(oracle, &r, &hit));
    near_to(hit.t, 4.2, 1e-14);
    assert_false(hit.leaving);
    near_to(hit.normal[0], 0.6, 1e-14);
    near_to(hit.normal[2], 0.8, 1e-14);
    r = ray(1.0000001, 0, 5, 0, 0, -1);
    assert_false(oracle_hit(oracle, &r, &hit));
    oracle_free(oracle);
    arena_release(&arena);
}

static void from_inside_the_way_out_is_the_hit_and_its_normal_looks_back(void **state)
{
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    Oracle *oracle = scene(ir, sphere(ir, 0, 0, 0, 1));
    OracleRay r = ray(0, 0, 0.5, 0, 0, -1);
    OracleHit hit;
    assert_true(oracle_hit(oracle, &r, &hit));
    assert_true(hit.leaving);
    near_to(hit.t, 1.5, 1e-14);
    near_to(hit.normal[2], 1, 1e-14);
    assert_true(oracle_blocked(oracle, &r));
    oracle_free(oracle);
    arena_release(&arena);
}

static void a_transform_moves_the_point_back(void **state)
{
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    IrId by[3] = {number(ir, 1), number(ir, 2), number(ir, 0)};
    IrId factors[3] = {number(ir, 2), number(ir, 0.5), number(ir, 1)},
         zero[3] = {number(ir, 0), number(ir, 0), number(ir, 0)};
    IrId map = two(ir, OP_COMPOSE, ir_move(ir, nowhere, by), ir_scale(ir, nowhere, factors, zero));
    Oracle *oracle = scene(ir, two(ir, OP_TRANSFORM, sphere(ir, 0, 0, 0, 1), map));
    OracleRay r = ray(-5, 2, 0, 1, 0, 0);
    OracleHit hit;
    assert_true(oracle_hit(oracle, &r, &hit));
    near_to(hit.t, 4, 1e-13);
    r = ray(1, 9, 0, 0, -1, 0);
    assert_true(oracle_hit(oracle, &r, &hit));
    near_to(hit.t, 6.5, 1e-13);
    near_to(hit.normal[1], 1, 1e-13);
    oracle_free(oracle);
    arena_release(&arena);
}

static void a_bored_ball_is_open_and_its_wall_points_inward(void **state)
{
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    IrId cylinder = quadric(ir, (double[]){-1, -1, 0, 0, 0, 0, 0, 0, 0, 0.25});
    IrId bored = two(ir, OP_INTERSECT, sphere(ir, 0, 0, 0, 1), ir_node(ir, OP_COMPLEMENT, nowhere, &cylinder, 1));
    Oracle *oracle = scene(ir, bored);
    OracleRay r = ray(0.1, 0.1, 5, 0, 0, -1);
    OracleHit hit;
    assert_false(oracle_hit(oracle, &r, &hit));
    r = ray(0, 0, 0, 1, 0, 0);
    assert_true(oracle_hit(oracle, &r, &hit));
    near_to(hit.t, 0.5, 1e-14);
    near_to(hit.normal[0], -1, 1e-14);
    assert_int_equal(hit.leaf, 1);
    oracle_free(oracle);
    arena_release(&arena);
}

static void of_coincident_faces_the_first_decides(void **state)
{
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    Oracle *oracle = scene(ir, two(ir, OP_UNION, sphere(ir, 0, 0, 0, 1), sphere(ir, 0, 0, 0, 1)));
    OracleRay r = ray(0.3, 0.2, 5, 0, 0, -1);
    OracleHit hit;
    assert_true(oracle_hit(oracle, &r, &hit));
    assert_int_equal(hit.leaf, 0);
    assert_int_equal(hit.ties, 1);
    oracle_free(oracle);
    arena_release(&arena);
}

static double random_number(double low, double high)
{
    return low + (high - low) * drand48();
}

// A sphere with bumps and dents, deformed once more as a part of a set operation.
static IrId lumpy(Ir *ir)
{
    IrId operands[9] = {sphere(ir, 0, 0, 0, 1)};
    for (int k = 1; k < 9; k++) {
        double p[3] = {random_number(-1, 1), random_number(-1, 1), random_number(-1, 1)};
        double length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]), s = 6;
        for (int i = 0; i < 3; i++) p[i] /= length;
        IrId q = quadric(ir, (double[]){-s, -s, -s, 0, 0, 0, 2 * s * p[0], 2 * s * p[1], 2 * s * p[2], 1 - s});
        operands[k] = perturb(ir, q, k % 3 ? 0.8 : -0.6);
    }
    IrId blob = ir_node(ir, OP_FREEFORM, nowhere, operands, 9);
    IrId hole = sphere(ir, 0.9, 0.2, 0.3, 0.5);
    IrId set = two(ir, OP_INTERSECT, blob, ir_node(ir, OP_COMPLEMENT, nowhere, &hole, 1));
    return two(ir, OP_DEFORM, set, perturb(ir, sphere(ir, 0.6, 0.4, 0.7, 0.6), 5));
}

// Both ways give the same of random rays from a distance. Returns how many hit.
static int compare_ways(Oracle *oracle)
{
    int hits = 0;
    for (int k = 0; k < 400; k++) {
        double o[3] = {random_number(-4, 4), random_number(-4, 4), 4}, d[3];
        for (int i = 0; i < 3; i++) d[i] = -o[i] + random_number(-1.2, 1.2);
        OracleRay r = ray(o[0], o[1], o[2], d[0], d[1], d[2]);
        OracleHit exact, dense;
        bool hit = oracle_hit(oracle, &r, &exact);
        assert_int_equal(hit, oracle_reference_hit(oracle, &r, 4000, &dense));
        assert_int_equal(hit, oracle_blocked(oracle, &r));
        if (!hit) continue;
        hits++;
        near_to(exact.t, dense.t, 1e-9 * exact.t);
        assert_int_equal(exact.leaf, dense.leaf);
        for (int i = 0; i < 3; i++) near_to(exact.normal[i], dense.normal[i], 1e-6);
        double g[3], f = oracle_field(oracle, exact.point, g);
        near_to(f, 0, 1e-12 * (1 + fabs(g[0]) + fabs(g[1]) + fabs(g[2])) * (1 + exact.t));
    }
    return hits;
}

static void exact_roots_and_dense_samples_agree(void **state)
{
    srand48(7);
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    Oracle *oracle = scene(ir, lumpy(ir));
    assert_in_range(compare_ways(oracle), 100, 390);
    oracle_free(oracle);
    arena_release(&arena);
}

static void supports_without_an_end_are_followed_to_it(void **state)
{
    srand48(8);
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    IrId outside = quadric(ir, (double[]){0.6, 0.6, 0.6, 0, 0, 0, -0.36, -0.24, -0.36, -0.25}); // of a ball
    IrId plane = quadric(ir, (double[]){0, 0, 0, 0, 0, 0, 1, 0.2, 0, -0.3});
    IrId slab = quadric(ir, (double[]){0, -4, 0, 0, 0, 0, 0, 0, 0, 1});
    IrId operands[4] = {sphere(ir, 0, 0, 0, 1), perturb(ir, outside, -0.4), perturb(ir, plane, 0.3),
                        perturb(ir, slab, 0.2)};
    Oracle *oracle = scene(ir, ir_node(ir, OP_FREEFORM, nowhere, operands, 4));
    assert_in_range(compare_ways(oracle), 50, 400);
    oracle_free(oracle);
    arena_release(&arena);
}

static void the_tree_of_leaves_is_the_field_of_the_ir(void **state)
{
    srand48(11);
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    IrId root = lumpy(ir);
    Oracle *oracle = scene(ir, root);
    for (int k = 0; k < 500; k++) {
        double p[3] = {random_number(-1.5, 1.5), random_number(-1.5, 1.5), random_number(-1.5, 1.5)}, g[3], h[3];
        near_to(oracle_field(oracle, p, g), oracle_ir_field(oracle, root, p, h), 1e-12);
        for (int i = 0; i < 3; i++) near_to(g[i], h[i], 1e-11);
    }
    oracle_free(oracle);
    arena_release(&arena);
}

static void the_middle_of_a_lit_ball_has_the_formulas_colour(void **state)
{
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    double m[11] = {0.5, 0.25, 1, 0.1, 0.7, 0.4, 20};
    Oracle *oracle = scene(ir, two(ir, OP_PAINT, sphere(ir, 0, 0, 0, 1), thing(ir, OP_MATERIAL, m, 11)));
    float rgb[3];
    oracle_render(oracle, 1, 1, 1, 0, 1e-6, rgb); // n, l and v all along z: color (ambient + diffuse) + specular
    for (int i = 0; i < 3; i++) near_to(rgb[i], m[i] * 0.8 + 0.4, 1e-6);
    oracle_free(oracle);
    arena_release(&arena);
}

static void a_ball_in_front_shadows_the_one_behind(void **state)
{
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    Oracle *oracle = scene(ir, two(ir, OP_UNION, sphere(ir, 0, 0, 0, 1), sphere(ir, 0, 0, 8, 0.5)));
    OracleRay r = oracle_camera_ray(oracle, 0.5, 0.5, 1, 1);
    OracleHit hit;
    double color[3];
    assert_true(oracle_hit(oracle, &r, &hit));
    near_to(hit.t, 4, 1e-13); // the other ball is behind the camera
    oracle_shade(oracle, &r, &hit, 0, 1e-6, color);
    near_to(color[0], 0.08, 1e-12); // the default material's ambient part alone
    oracle_free(oracle);
    arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sphere_is_hit_where_it_is),
        cmocka_unit_test(from_inside_the_way_out_is_the_hit_and_its_normal_looks_back),
        cmocka_unit_test(a_transform_moves_the_point_back),
        cmocka_unit_test(a_bored_ball_is_open_and_its_wall_points_inward),
        cmocka_unit_test(of_coincident_faces_the_first_decides),
        cmocka_unit_test(exact_roots_and_dense_samples_agree),
        cmocka_unit_test(supports_without_an_end_are_followed_to_it),
        cmocka_unit_test(the_tree_of_leaves_is_the_field_of_the_ir),
        cmocka_unit_test(the_middle_of_a_lit_ball_has_the_formulas_colour),
        cmocka_unit_test(a_ball_in_front_shadows_the_one_behind),
    };
    return cmocka_run_group_tests_name("oracle", tests, NULL, NULL);
}
