// Rays against dense sampling in double: on a displaced sphere, a displaced free form, a patch as a sheet and one as a solid.
// (Thick patches, and sheets that fold, are no functions of x and y: tests/unit/test_patch_thick.c.)
//
// Each picture is 320 x 320 rays. The function of the object is sampled along each of them, in double, from the patch as
// the host solves it; where it changes its sign the renderer must have met the surface there or before, and where the
// renderer says that it has met it, the function has to be 0. So no root is missed, and none is made up.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/patch_scene.h"
#include "runtime/scene.h"

enum { SIZE = 320, SAMPLES = 240 };

typedef double Function(PatchSolve *solve, const double p[3]); // > 0 before the surface

typedef struct Look { // orthographic
    double eye[3], at[3], height;
} Look;

static double height_at(PatchSolve *solve, double u, double v)
{
    double place[3];
    patch_solve_point(solve, u, v, place);
    return place[2];
}

static double displaced_sphere(PatchSolve *solve, const double p[3])
{
    double f = (1 - p[0] * p[0] - p[1] * p[1] - p[2] * p[2]) / 2, u = p[0] + 0.5, v = p[1] + 0.5;
    bool within = u >= 0 && u <= 1 && v >= 0 && v <= 1 && p[2] >= 0.3 && p[2] <= 2.5;
    return -(f + (within ? height_at(solve, u, v) : 0));
}

// 1 − r² with a bump of half the cube of a quadric, which the footprint covers in part; |∇F| = 2 in the footprint's middle.
static double displaced_form(PatchSolve *solve, const double p[3])
{
    double f = 1 - p[0] * p[0] - p[1] * p[1] - p[2] * p[2], u = p[0] + 0.4, v = p[1] + 0.5;
    double x = p[0] - 0.5, z = p[2] - 0.8, q = 0.6 - 9 * (x * x + p[1] * p[1] + z * z);
    bool within = u >= 0 && u <= 1 && v >= 0 && v <= 1 && p[2] >= 0.2 && p[2] <= 2.5;
    return -(f + (q > 0 ? 0.5 * q * q * q : 0) + (within ? 2 * height_at(solve, u, v) : 0));
}

static double solid(PatchSolve *solve, const double p[3])
{
    bool within = p[0] >= 0 && p[0] <= 1 && p[1] >= 0 && p[1] <= 1;
    return within ? fmax(p[2] - height_at(solve, p[0], p[1]), -0.3 - p[2]) : 1;
}

static double height_field(PatchSolve *solve, const double p[3])
{
    if (p[0] < 0 || p[0] > 1 || p[1] < 0 || p[1] > 1) return NAN;
    return p[2] - height_at(solve, p[0], p[1]);
}

static void ray_of(const Look *look, int i, int j, double origin[3], double direction[3])
{
    double f[3], r[3], s[3], length = 0;
    for (int k = 0; k < 3; k++) f[k] = look->at[k] - look->eye[k];
    for (int k = 0; k < 3; k++) length += f[k] * f[k];
    for (int k = 0; k < 3; k++) f[k] /= sqrt(length);
    r[0] = f[1], r[1] = -f[0], r[2] = 0; // f x up
    length = hypot(r[0], r[1]);
    for (int k = 0; k < 3; k++) r[k] /= length;
    s[0] = r[1] * f[2] - r[2] * f[1], s[1] = r[2] * f[0] - r[0] * f[2], s[2] = r[0] * f[1] - r[1] * f[0];
    double x = ((i + 0.5) / SIZE - 0.5) * look->height, y = (0.5 - (j + 0.5) / SIZE) * look->height;
    for (int k = 0; k < 3; k++) {
        origin[k] = look->eye[k] + x * r[k] + y * s[k];
        direction[k] = f[k];
    }
}

static double along(Function *f, PatchSolve *solve, const double o[3], const double d[3], double t)
{
    return f(solve, (double[3]){o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]});
}

// The first change of sign among the samples of the ray; INFINITY if there is none.
static double first_change(Function *f, PatchSolve *solve, const double o[3], const double d[3], double near,
                           double far)
{
    double before = NAN, at = near;
    for (int k = 0; k <= SAMPLES; k++) {
        double t = near + (far - near) * k / SAMPLES, value = along(f, solve, o, d, t);
        if (!isnan(before) && !isnan(value) && (before > 0) != (value > 0)) {
            double low = at, high = t;
            for (int step = 0; step < 40; step++) {
                double middle = 0.5 * (low + high);
                if ((along(f, solve, o, d, middle) > 0) == (before > 0))
                    low = middle;
                else
                    high = middle;
            }
            return high;
        }
        before = value;
        at = t;
    }
    return INFINITY;
}

static void compare(const char *text, Function *f, const Look *look, double near, double far)
{
    char scene_text[2000];
    snprintf(scene_text, sizeof scene_text,
             "camera { eye: (%g, %g, %g); look_at: (%g, %g, %g); up: (0, 0, 1); projection: \"orthographic\"; height: "
             "%g; }\n%s",
             look->eye[0], look->eye[1], look->eye[2], look->at[0], look->at[1], look->at[2], look->height, text);
    ScnScene *scene = scn_load(&(ScnSceneDesc){
        .bytes = (const uint8_t *)scene_text, .size = strlen(scene_text), .device = "cpu", .quick = true});
    if (scn_status(scene) != SCN_OK) print_message("%s%s\n", scn_diagnostics_text(scene, false), scn_error(scene));
    assert_int_equal(scn_status(scene), SCN_OK);
    float *place = malloc(3 * SIZE * SIZE * sizeof *place), *color = malloc(4 * SIZE * SIZE * sizeof *color);
    ScnStatus status = scn_render(
        scene, &(ScnFrameDesc){.width = SIZE, .height = SIZE, .time = 25e-3, .color = color, .position = place});
    if (status != SCN_OK) print_message("%s\n", scn_error(scene));
    assert_int_equal(status, SCN_OK);
    Failure failure = {""};
    FrameError error;
    PatchSolve *solve = patch_solve_new(&scene->package->plan->patches[0], &(PatchSolveDesc){.fps = 24}, &failure);
    assert_non_null(solve);
    assert_true(patch_solve_to(solve, 25e-3, scene->inputs, &error));
    int missed = 0, made_up = 0, late = 0, met = 0;
    for (int j = 0; j < SIZE; j++)
        for (int i = 0; i < SIZE; i++) {
            double o[3], d[3], t = 0;
            ray_of(look, i, j, o, d);
            const float *p = place + 3 * (j * SIZE + i);
            bool hit = color[4 * (j * SIZE + i) + 3] > 0;
            double expected = first_change(f, solve, o, d, near, far);
            for (int k = 0; k < 3; k++) t += (p[k] - o[k]) * d[k];
            met += hit;
            if (!hit) {
                missed += isfinite(expected);
                continue;
            }
            // The function just before and just behind the place that was met.
            double front = along(f, solve, o, d, t - 2e-4), back = along(f, solve, o, d, t + 2e-4);
            bool crosses =
                isnan(front) || isnan(back) || (front > 0) != (back > 0) || fmin(fabs(front), fabs(back)) < 2e-4;
            made_up += !crosses;
            late += t > expected + 1e-3;
        }
    print_message("%d of %d rays meet it; missed %d, late %d, made up %d\n", met, SIZE * SIZE, missed, late, made_up);
    assert_true(met > SIZE * SIZE / 20);
    assert_int_equal(missed, 0);
    assert_int_equal(late, 0);
    assert_int_equal(made_up, 0);
    patch_solve_free(solve);
    free(place);
    free(color);
    scn_free(scene);
}

static void no_root_of_a_displaced_sphere_is_missed(void **state)
{
    static const Look look = {{2.1, -2.9, 2.3}, {0, 0, 0.2}, 2.9};
    compare("patch p { grid: 17; force: (0, 0, 350 * sin(540deg * u)); }\n"
            "sphere(1).displace(by: p, corner: (-0.5, -0.5, 0), u: (1, 0, 0), v: (0, 1, 0), caps: 0.3 .. 2.5);\n",
            displaced_sphere, &look, 2, 7);
}

static void no_root_of_a_sheet_is_missed(void **state)
{
    static const Look look = {{2.6, -2.9, 1.9}, {0.5, 0.5, 0.3}, 2.2};
    compare("patch p { grid: 17; edge(u: 0) { tangent: 3; }; }\np;\n", height_field, &look, 1, 7);
}

static void no_root_of_a_displaced_free_form_is_missed(void **state)
{
    static const Look look = {{2.1, -2.9, 2.3}, {0.1, 0, 0.2}, 2.9};
    compare("patch p { grid: 17; force: (0, 0, 300 * sin(540deg * v)); edge(v: 1) { tangent: -0.5; } }\n"
            "freeform(quadric(-1, -1, -1, 0, 0, 0, 0, 0, 0, 1)) {\n"
            "    perturb(quadric(-9, -9, -9, 0, 0, 0, 9, 0, 14.4, -7.41), strength: 0.5);\n"
            "}.displace(by: p, corner: (-0.4, -0.5, 0), u: (1, 0, 0), v: (0, 1, 0), caps: 0.2 .. 2.5);\n",
            displaced_form, &look, 2, 7);
}

static void no_root_of_a_solid_is_missed(void **state)
{
    static const Look look = {{2.6, -2.9, 1.9}, {0.5, 0.5, 0.1}, 2.1};
    compare("patch p { grid: 17; force: (0, 0, 600 * sin(540deg * u)); edge(u: 0) { tangent: 2; }; }\n"
            "p.solid(floor: -0.3);\n",
            solid, &look, 2, 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_root_of_a_displaced_sphere_is_missed),
        cmocka_unit_test(no_root_of_a_displaced_free_form_is_missed),
        cmocka_unit_test(no_root_of_a_sheet_is_missed),
        cmocka_unit_test(no_root_of_a_solid_is_missed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
