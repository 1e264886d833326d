// Operations on objects against their definitions: F of the result is computed from F of the operands, point by point in
// double, as lang/reference.md says it, and offsets by a radius against spheres that are sampled.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/compile.h"
#include "compiler/eval.h"
#include "compiler/object.h"
#include "compiler/radius_quadric.h"

// F of the scene of a text.
typedef struct Function {
    Unit unit;
    Ir *ir;
    IrId root, expression;
    double *values;
} Function;

static Function *function_new(const char *text)
{
    Function *f = calloc(1, sizeof *f);
    unit_init(&f->unit);
    Source *source = source_add(&f->unit.sources, "test.scn", text, strlen(text), (Span){0});
    CompileElaborated elaborated = {0};
    compile(&f->unit, source, &(CompileOptions){.elaborated = &elaborated});
    if (f->unit.errors || !elaborated.ir) {
        diag_print(&f->unit, stderr, false);
        fail_msg("it does not compile: %s", text);
    }
    f->ir = (Ir *)elaborated.ir; // what it reaches is only added to
    f->root = elaborated.root;
    f->expression = object_expression(f->ir, object_leaves(f->ir, elaborated.root));
    f->values = calloc(f->expression + 1, sizeof *f->values);
    return f;
}

static void function_free(Function *f)
{
    free(f->values);
    unit_release(&f->unit);
    free(f);
}

static double function_at(const Function *f, const double p[3])
{
    for (IrId id = 1; id <= f->expression; id++) {
        const IrNode *node = ir_at(f->ir, id);
        double o[3] = {0};
        for (uint32_t k = 0; k < node->count && k < 3; k++) o[k] = f->values[ir_operand(f->ir, id, k)];
        if (node->type != IR_SCALAR) continue;
        if (node->op >= OP_X && node->op <= OP_Z)
            f->values[id] = p[node->op - OP_X];
        else if (node->op == OP_CONST)
            f->values[id] = node->number;
        else
            f->values[id] = eval_knows((IrOp)node->op) ? eval_scalar((IrOp)node->op, o) : NAN;
    }
    return f->values[f->expression];
}

static uint64_t random_bits(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return *state >> 32;
}

static double random_in(uint64_t *state, double low, double high)
{
    return low + (high - low) * (double)random_bits(state) / 4294967296.0;
}

static void random_point(uint64_t *state, double p[3])
{
    for (int k = 0; k < 3; k++) p[k] = random_in(state, -2, 2);
}

// Where F of the operand is looked at for a point, as the reference has it.
typedef void Coordinates(const double p[3], double at[3]);

static const char operand[] =
    "(freeform(ellipsoid(1, 0.8, 1.2)) { perturb(sphere(0.6).move(0.8, 0, 0.3), strength: 4); }.rotate(x: 20deg)"
    " - box(0.5, 0.7, 3).move(0.1, 0.3, 0) | (~cylinder(0.3, axis: (1, 1, 0)) & sphere(0.9).move(1, 0, "
    "0)).paint(#f00))";

static void assert_warp(const char *modifier, Coordinates *coordinates)
{
    char text[1000];
    snprintf(text, sizeof text, "%s;", operand);
    Function *plain = function_new(text);
    snprintf(text, sizeof text, "%s.%s;", operand, modifier);
    Function *warped = function_new(text);
    uint64_t state = 1;
    for (int k = 0; k < 500; k++) {
        double p[3], at[3];
        random_point(&state, p);
        coordinates(p, at);
        double expected = function_at(plain, at), found = function_at(warped, p);
        if (fabs(found - expected) > 1e-9 * (1 + fabs(expected)))
            fail_msg("%s at %g %g %g: %g instead of %g", modifier, p[0], p[1], p[2], found, expected);
    }
    function_free(plain);
    function_free(warped);
}

static void by_twist(const double p[3], double at[3])
{
    double a = -0.7 * p[2];
    at[0] = p[0] * cos(a) - p[1] * sin(a);
    at[1] = p[0] * sin(a) + p[1] * cos(a);
    at[2] = p[2];
}

static void by_bend(const double p[3], double at[3])
{
    double a = 0.4 * p[2];
    at[0] = p[0] * cos(a) + p[2] * sin(a);
    at[1] = p[1];
    at[2] = -p[0] * sin(a) + p[2] * cos(a);
}

static void by_taper(const double p[3], double at[3])
{
    double part = fmin(fmax((p[2] + 0.5) / 1.5, 0), 1), m = 1 + part * (0.3 - 1);
    at[0] = p[0] / m;
    at[1] = p[1] / m;
    at[2] = p[2];
}

static void by_stretch(const double p[3], double at[3])
{
    double z = p[2], a = -0.3, b = 0.2, k = 3;
    at[0] = p[0];
    at[1] = p[1];
    at[2] = z < a ? z : z < a + k * (b - a) ? a + (z - a) / k : z - (k - 1) * (b - a);
}

static void by_attract(const double p[3], double at[3])
{
    double centre[3] = {0.5, 0.2, -0.1}, square = 0;
    for (int k = 0; k < 3; k++) square += (p[k] - centre[k]) * (p[k] - centre[k]);
    double w = fmax(0, 1 - square / (1.2 * 1.2));
    for (int k = 0; k < 3; k++) at[k] = centre[k] + (p[k] - centre[k]) * (1 + 0.6 * w * w * w);
}

static void warps_are_other_coordinates(void **state)
{
    assert_warp("twist(rate: 0.7rad)", by_twist);
    assert_warp("bend(rate: 0.4rad)", by_bend);
    assert_warp("taper(z: -0.5 .. 1, to: 0.3)", by_taper);
    assert_warp("stretch(z: -0.3 .. 0.2, by: 3)", by_stretch);
    assert_warp("attract(at: (0.5, 0.2, -0.1), radius: 1.2, amount: 0.6)", by_attract);
}

// --- what is made of F and G

typedef double Combination(double f, double g);

static void assert_combination(const char *one, const char *other, const char *text, Combination *combination)
{
    char line[1000];
    snprintf(line, sizeof line, "%s;", one);
    Function *f = function_new(line);
    snprintf(line, sizeof line, "%s;", other);
    Function *g = function_new(line), *both = function_new(text);
    uint64_t state = 2;
    for (int k = 0; k < 500; k++) {
        double p[3];
        random_point(&state, p);
        double expected = combination(function_at(f, p), function_at(g, p)), found = function_at(both, p);
        if (fabs(found - expected) > 1e-9 * (1 + fabs(expected)))
            fail_msg("%s at %g %g %g: %g instead of %g", text, p[0], p[1], p[2], found, expected);
    }
    function_free(f);
    function_free(g);
    function_free(both);
}

static double gain(double f, double g)
{
    double h = fmax(0.5 - fabs(f - g), 0);
    return h * h / (4 * 0.5);
}

static double smooth_union(double f, double g)
{
    return fmax(f, g) + gain(f, g);
}

static double smooth_intersection(double f, double g)
{
    return fmin(f, g) - gain(f, g);
}

static double smooth_difference(double f, double g)
{
    return fmin(f, -g) - gain(f, -g);
}

static double r_union(double f, double g)
{
    return f + g + sqrt(f * f + g * g);
}

static double r_difference(double f, double g)
{
    return f - g - sqrt(f * f + g * g);
}

static void blends_are_what_the_reference_says(void **state)
{
    const char *a = "sphere(1)", *b = "box(1.4, 1, 1).move(0.6, 0.2, 0)";
    assert_combination(a, b, "union(sphere(1), box(1.4, 1, 1).move(0.6, 0.2, 0), blend: 0.5);", smooth_union);
    assert_combination(a, b, "union(sphere(1).paint(#f00), box(1.4, 1, 1).move(0.6, 0.2, 0), blend: 0.5);",
                       smooth_union);
    assert_combination(a, b, "intersect(sphere(1), box(1.4, 1, 1).move(0.6, 0.2, 0), blend: 0.5);",
                       smooth_intersection);
    assert_combination(a, b, "subtract(sphere(1).paint(#f00), box(1.4, 1, 1).move(0.6, 0.2, 0), blend: 0.5);",
                       smooth_difference);
    assert_combination(a, b, "union(sphere(1), box(1.4, 1, 1).move(0.6, 0.2, 0), style: \"rfunction\");", r_union);
    assert_combination(a, b, "union(sphere(1), box(1.4, 1, 1).move(0.6, 0.2, 0).paint(#f00), style: \"rfunction\");",
                       r_union);
    assert_combination(a, b, "subtract(sphere(1), box(1.4, 1, 1).move(0.6, 0.2, 0), style: \"rfunction\");",
                       r_difference);
}

static double plus_a_quarter(double f, double g)
{
    return f + 0.25;
}

static double plus_g(double f, double g)
{
    return f + g;
}

static void iso_offsets_add_to_f(void **state)
{
    char text[1000];
    snprintf(text, sizeof text, "%s.offset(iso: 0.25);", operand);
    assert_combination(operand, "sphere(1)", text, plus_a_quarter);
    snprintf(text, sizeof text, "(~%s).offset(iso: (1 - x^2 - y^2 - z^2) / 2);", operand);
    char not [1000];
    snprintf(not, sizeof not, "~%s", operand);
    assert_combination(not, "sphere(1)", text, plus_g);
}

static void a_free_form_stays_one(void **state)
{
    Function *f =
        function_new("freeform(sphere(1)) { perturb(sphere(1).move(1, 0, 0), strength: 2); }.offset(iso: 0.2);");
    assert_int_equal(ir_at(f->ir, object_leaves(f->ir, f->root))->class, CLASS_FREEFORM);
    function_free(f);
    f = function_new("sphere(1).offset(iso: 0.2).offset(radius: 0.1);");
    assert_int_equal(ir_at(f->ir, object_leaves(f->ir, f->root))->class, CLASS_QUADRIC);
    function_free(f);
}

// F(X + d N), N from differences.
static void normal_offsets_look_along_the_normal(void **state)
{
    static const char *const modifiers[2] = {"offset(normal: 0.3)", "offset(normal: 0.3, unnormalised: true)"};
    const char *plain_text =
        "freeform(ellipsoid(1, 0.7, 1.2)) { perturb(sphere(0.6).move(0.8, 0, 0.3), strength: 4); }";
    for (int m = 0; m < 2; m++) {
        char text[1000];
        snprintf(text, sizeof text, "%s;", plain_text);
        Function *plain = function_new(text);
        snprintf(text, sizeof text, "%s.%s;", plain_text, modifiers[m]);
        Function *moved = function_new(text);
        uint64_t seed = 3;
        for (int k = 0; k < 300; k++) {
            double p[3], g[3], at[3];
            random_point(&seed, p);
            for (int i = 0; i < 3; i++) {
                double a[3] = {p[0], p[1], p[2]}, b[3] = {p[0], p[1], p[2]};
                a[i] += 1e-5;
                b[i] -= 1e-5;
                g[i] = (function_at(plain, a) - function_at(plain, b)) / 2e-5;
            }
            double length = m ? 1 : sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
            for (int i = 0; i < 3; i++) at[i] = p[i] + 0.3 * g[i] / length;
            double expected = function_at(plain, at), found = function_at(moved, p);
            if (fabs(found - expected) > 1e-6 * (1 + fabs(expected)))
                fail_msg("%s at %g %g %g: %g instead of %g", modifiers[m], p[0], p[1], p[2], found, expected);
        }
        function_free(plain);
        function_free(moved);
    }
}

// --- radii

static void random_part(uint64_t *state, bool shrinks, char *text, size_t size)
{
    double a = random_in(state, 0.3, 1), b = random_in(state, 0.3, 1), c = random_in(state, 0.3, 1);
    switch (random_bits(state) % 7) {
    case 0: snprintf(text, size, "sphere(%.3f)", a); break;
    case 1: snprintf(text, size, "cylinder(radius: %.3f, axis: (%.3f, %.3f, 0.2))", a, b, c); break;
    case 2: snprintf(text, size, "slab(z: %.3f .. %.3f)", -a, b); break;
    case 3: snprintf(text, size, "halfspace((%.3f, -%.3f, 0.3), at: (0, 0, %.3f))", a, b, c); break;
    case 4: snprintf(text, size, "box(%.3f, %.3f, %.3f)", 2 * a, 2 * b, 2 * c); break;
    case 5: snprintf(text, size, "cylinder(radius: %.3f, height: %.3f)", a, 2 * b); break;
    default: snprintf(text, size, shrinks ? "sphere(%.3f)" : "(~sphere(%.3f))", a); break;
    }
    size_t length = strlen(text);
    snprintf(text + length, size - length, ".rotate(x: %.1fdeg, y: %.1fdeg).scale(%.3f).move(%.3f, %.3f, 0)",
             random_in(state, 0, 90), random_in(state, 0, 90), random_in(state, 0.7, 1.3), random_in(state, -0.5, 0.5),
             random_in(state, -0.5, 0.5));
}

enum { DIRECTIONS = 200, SHELLS = 3 };

// The greatest F within the radius, or the least, of those that are sampled.
static double sampled(const Function *f, const double p[3], double radius)
{
    double best = function_at(f, p);
    for (int k = 0; k < DIRECTIONS; k++) {
        double z = 1 - (2 * k + 1.0) / DIRECTIONS, r = sqrt(1 - z * z), a = 2.399963229728653 * k;
        for (int s = 1; s <= SHELLS; s++) {
            double d = fabs(radius) * s / SHELLS, q[3] = {p[0] + d * r * cos(a), p[1] + d * r * sin(a), p[2] + d * z};
            double value = function_at(f, q);
            best = radius > 0 ? fmax(best, value) : fmin(best, value);
        }
    }
    return best;
}

// Inside of the offset is where the sampled ball has a point of the object; where it has none the offset is empty but for
// what lies between samples, where F differs by `between` at most: |∇F| is not above 4 here, gaps not above a quarter of D.
static void radii_are_balls(void **unused)
{
    uint64_t state = 4;
    int inside = 0, outside = 0;
    for (int k = 0; k < 1000; k++) {
        char one[300], other[300], text[1000];
        double radius = random_in(&state, 0.05, 0.4) * (k % 2 ? 1 : -1), between = fabs(radius) * 0.25 * 4;
        random_part(&state, radius < 0, one, sizeof one);
        random_part(&state, radius < 0, other, sizeof other);
        const char *join = k % 3 == 0 ? NULL : radius > 0 ? "|" : "&";
        if (!join)
            snprintf(text, sizeof text, "%s;", one);
        else
            snprintf(text, sizeof text, "%s %s %s;", one, join, other);
        Function *plain = function_new(text);
        text[strlen(text) - 1] = 0;
        char offset[1100];
        snprintf(offset, sizeof offset, "(%s).offset(radius: %.4f);", text, radius);
        Function *grown = function_new(offset);
        for (int i = 0; i < 5; i++) {
            double p[3];
            random_point(&state, p);
            double best = sampled(plain, p, radius), found = function_at(grown, p);
            bool sure_in = radius > 0 ? best > 1e-9 : best > between,
                 sure_out = radius > 0 ? best < -between : best < -1e-9;
            inside += sure_in;
            outside += sure_out;
            if ((sure_in && !(found >= 0)) || (sure_out && !(found < 0)))
                fail_msg("%s at %g %g %g: F = %g, sampled %g", offset, p[0], p[1], p[2], found, best);
        }
        function_free(plain);
        function_free(grown);
    }
    assert_true(inside > 500);
    assert_true(outside > 500);
}

static void in_ball(const double p[3], double radius, double way[3], double q[3])
{
    double length = fmax(hypot(hypot(way[0], way[1]), way[2]), 1);
    for (int k = 0; k < 3; k++) {
        way[k] /= length;
        q[k] = p[k] + radius * way[k];
    }
}

// The greatest F in the ball: from the best of samples on its surface, and from its middle, by steps that become smaller.
// `range`: how far apart values on the surface are.
static double sampled_greatest(const Function *f, uint64_t *state, const double p[3], double radius, double *range)
{
    double best = function_at(f, p), most = -INFINITY, least = INFINITY, way[3] = {0}, q[3];
    for (int k = 0; k < DIRECTIONS; k++) {
        double z = 1 - (2 * k + 1.0) / DIRECTIONS, r = sqrt(1 - z * z), a = 2.399963229728653 * k;
        double at[3] = {r * cos(a), r * sin(a), z};
        in_ball(p, radius, at, q);
        double value = function_at(f, q);
        least = fmin(least, value);
        most = fmax(most, value);
        if (value <= best) continue;
        best = value;
        memcpy(way, at, sizeof way);
    }
    *range = most - least;
    for (double step = 0.3; step > 1e-6; step *= 0.98) {
        double other[3];
        for (int k = 0; k < 3; k++) other[k] = way[k] + step * random_in(state, -1, 1);
        in_ball(p, radius, other, q);
        double value = function_at(f, q);
        if (value <= best) continue;
        best = value;
        memcpy(way, other, sizeof way);
    }
    return best;
}

static void random_quadric(uint64_t *state, char *text, size_t size)
{
    double a = random_in(state, 0.2, 1), b = random_in(state, 0.2, 1), c = random_in(state, 0.2, 1);
    switch (random_bits(state) % 9) {
    case 0: snprintf(text, size, "ellipsoid(%.3f, %.3f, %.3f)", a, b, c); break;
    case 1: snprintf(text, size, "ellipsoid(%.3f, %.3f, %.3f)", a, a, 0.2 * c); break;
    case 2: snprintf(text, size, "ellipsoid(%.3f, %.3f, 0.7).scale(%.3f, 1, 1)", a, b, 0.2 + c); break;
    case 3: snprintf(text, size, "cone(%.3f)", a); break;
    case 4: snprintf(text, size, "paraboloid(%.3f)", a); break;
    case 5: snprintf(text, size, "hyperboloid1(%.3f, slope: %.3f)", a, b); break;
    case 6: snprintf(text, size, "saddle(%.3f, %.3f)", a, b); break;
    case 7: snprintf(text, size, "cylinder(%.3f).scale(%.3f, 1, 1)", a, 0.2 + b); break;
    default:
        snprintf(text, size, "quadric(%.3f, %.3f, %.3f, %.3f, %.3f, %.3f, %.3f, 0.3, %.3f, 0.1)", a - b, b - c, c - 0.5,
                 a - 0.6, b - 0.6, c - 0.6, a - c, b);
    }
    size_t length = strlen(text);
    snprintf(text + length, size - length, ".rotate(x: %.1fdeg, y: %.1fdeg).move(%.3f, %.3f, 0)",
             random_in(state, 0, 90), random_in(state, 0, 90), random_in(state, -0.5, 0.5),
             random_in(state, -0.5, 0.5));
}

// F of the offset of a quadric that keeps no class is the greatest F in the ball itself: never less than what is sampled,
// and greater by no more than the tolerance of what F does on the sphere.
static void radii_of_quadrics_are_the_greatest_of_the_ball(void **unused)
{
    uint64_t state = 9;
    double above = 0, below = 0;
    for (int k = 0; k < 1000; k++) {
        char text[600], plain_text[700], grown_text[700];
        double radius = round(1e4 * pow(10, random_in(&state, -2, 0.3))) * (k % 2 ? 1e-4 : -1e-4);
        random_quadric(&state, text, sizeof text);
        snprintf(plain_text, sizeof plain_text, "%s%s;", k % 2 ? "" : "~", text);
        snprintf(grown_text, sizeof grown_text, "%s%s.offset(radius: %.4f);", k % 2 ? "" : "~", text, radius);
        Function *plain = function_new(plain_text), *grown = function_new(grown_text);
        for (int i = 0; i < 2; i++) {
            double p[3], range;
            random_point(&state, p);
            double best = sampled_greatest(plain, &state, p, fabs(radius), &range), found = function_at(grown, p);
            below = fmax(below, (best - found) / range);
            above = fmax(above, (found - best) / range);
            if (found < best - 1e-12 * (1 + range) || found > best + RADIUS_QUADRIC_TOLERANCE * range)
                fail_msg("%s at %g %g %g: F = %.9g, sampled %.9g, range %g", grown_text, p[0], p[1], p[2], found, best,
                         range);
        }
        function_free(plain);
        function_free(grown);
    }
    print_message("below what is sampled by %.2g, above it by %.2g of the range\n", below, above);
}

// On the surface of the offset the object is at that distance: along the axis where it is known.
static void radii_are_exact(void **state)
{
    static const struct {
        const char *text;
        double p[3];
    } cases[] = {
        {"sphere(1).offset(radius: 0.25);", {1.25, 0, 0}},
        {"sphere(1).offset(radius: -0.25);", {0, 0.75, 0}},
        {"(~sphere(1)).offset(radius: 0.25);", {0, 0.75, 0}},
        {"sphere(1).scale(2).offset(radius: 0.5);", {0, 0, 2.5}},
        {"slab(z: 0 .. 1).offset(radius: 0.5);", {3, 4, 1.5}},
        {"halfspace((0, 2, 0)).offset(radius: 0.5);", {3, 0.5, 1}},
        {"box(2).offset(radius: 0.5);", {1.3, 1.4, 0}},     // 0.3, 0.4, 0.5: on the round edge
        {"box(2).offset(radius: 0.75);", {1.5, 1.5, 1.25}}, // the round corner
        {"box(2).offset(radius: -0.5);", {0.5, 0.2, 0.1}},
        {"cylinder(radius: 1, height: 2).offset(radius: 0.5);", {0, 1.4, 1.3}},
        {"capsule((0, 0, 0), (1, 0, 0), 0.25).offset(radius: 0.25);", {-0.5, 0, 0}},
        {"shell(sphere(1), 0.5);", {1.25, 0, 0}},
        {"shell(sphere(1), 0.5);", {0, 0.75, 0}},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        Function *f = function_new(cases[k].text);
        double found = function_at(f, cases[k].p);
        if (fabs(found) > 1e-12) fail_msg("%s: F = %g on its surface", cases[k].text, found);
        function_free(f);
    }
}

static void what_shrinks_to_nothing_is_empty(void **state)
{
    static const char *const texts[] = {"sphere(0.5).offset(radius: -0.75);", "slab(z: 0 .. 1).offset(radius: -0.75);",
                                        "box(1).offset(radius: -0.75);"};
    uint64_t seed = 5;
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
        Function *f = function_new(texts[k]);
        for (int i = 0; i < 200; i++) {
            double p[3];
            random_point(&seed, p);
            assert_true(function_at(f, p) < 0);
        }
        assert_true(function_at(f, (double[3]){0, 0, 0.5}) < 0);
        function_free(f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(warps_are_other_coordinates),
        cmocka_unit_test(blends_are_what_the_reference_says),
        cmocka_unit_test(iso_offsets_add_to_f),
        cmocka_unit_test(a_free_form_stays_one),
        cmocka_unit_test(normal_offsets_look_along_the_normal),
        cmocka_unit_test(radii_are_balls),
        cmocka_unit_test(radii_of_quadrics_are_the_greatest_of_the_ball),
        cmocka_unit_test(radii_are_exact),
        cmocka_unit_test(what_shrinks_to_nothing_is_empty),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
