// The eleven configurations of the literature, as a scene says them, against a reference of its own.
//
// The reference is written from the equation and shares nothing with the product: unknowns are all nodes inside and one
// line of values outside of each edge; each row is Eq. 1 with the differences of Eqs. 3 to 5 at a node inside, or the
// condition of Eq. 7 for a value outside. Nothing is folded back, nothing is symmetric; the rows are solved by LAPACK's
// elimination with pivots for general bands. In time it is (x⁺ − 2x + x⁻)/dt² and (x⁺ − x⁻)/2dt of three shapes.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <lapacke.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/patch_scene.h"
#include "runtime/scene.h"

typedef struct Case {
    const char *name;
    double b, c, d, rho, eta, f, slope[4]; // u = 0, u = 1, v = 0, v = 1
} Case;

static const Case cases[] = {
    {"2a", 1, 2, 1, 0.1, 1, 800, {0, 0, 0, 0}},    {"2b", 10, 2, 1, 0.1, 1, 800, {0, 0, 0, 0}},
    {"2c", 1, -1.5, 1, 0.1, 1, 800, {0, 0, 0, 0}}, {"2d", 1, 2, -0.001, 0.1, 1, 800, {0, 0, 0, 0}},
    {"3a", 1, 2, 1, 0.1, 1, 800, {3, 0, 0, 0}},    {"3b", 1, 2, 1, 0.1, 1, 800, {0, 10, 0, 0}},
    {"3c", 1, 2, 1, 0.1, 1, 800, {3, 3, 3, 0}},    {"3d", 1, 2, 1, 0.1, 1, 800, {-3, 3, -3, 3}},
    {"4i", 1, 2, 1, 0.1, 1, -800, {0, 0, 0, 0}},   {"4j", 1, 2, 1, 0.1, 20, 800, {0, 0, 0, 0}},
    {"4k", 1, 2, 1, 1, 1, 800, {0, 0, 0, 0}},
};

// b d < 0: the operator stops being positive definite between 71 and 73 nodes.
static bool is_ill_posed(const Case *of, int nodes)
{
    return of->d < 0 && nodes > 71;
}

enum { CASES = sizeof cases / sizeof *cases, PROBES = 7 };

// Seven nodes that every grid of 16k + 1 has, of which none is the middle or stands on a diagonal.
static const int probes[PROBES][2] = {{4, 6}, {12, 5}, {3, 8}, {8, 3}, {2, 13}, {14, 9}, {7, 10}}; // of sixteenths

// --- the reference

// A matrix in a band as LAPACK has it: entry (r, c) at rows[c * height + 2 low + r - c], with `low` diagonals on both sides
// and room for as many that row exchanges fill.
typedef struct Band {
    int count, low, height;
    double *rows;
    lapack_int *pivots;
} Band;

static double *entry(Band *band, int row, int column)
{
    return &band->rows[(size_t)column * (size_t)band->height + (size_t)(2 * band->low + row - column)];
}

static void factor(Band *band)
{
    assert_int_equal(LAPACKE_dgbtrf_work(LAPACK_COL_MAJOR, band->count, band->count, band->low, band->low, band->rows,
                                         band->height, band->pivots),
                     0);
}

static void solve(const Band *band, double *x)
{
    assert_int_equal(LAPACKE_dgbtrs_work(LAPACK_COL_MAJOR, 'N', band->count, band->low, band->low, 1, band->rows,
                                         band->height, band->pivots, x, band->count),
                     0);
}

// x3 alone. Nodes (i, j) from -1 to n + 1 along both; all of them are rows, those that nothing needs are x = 0.
typedef struct Reference {
    const Case *of;
    int n, side; // cells; values a line
    double dt;
    Band *band; // of the cases with this equation
    double *x, *before, *right;
} Reference;

// The cases differ in fewer equations than they are: forces and slopes stand in the right side.
typedef struct Equations {
    int nodes;
    double dt;
    const Case *of[CASES];
    Band bands[CASES];
    int count;
} Equations;

static int at(const Reference *r, int i, int j)
{
    return (i + 1) * r->side + j + 1;
}

static void put(Reference *r, int row, int i, int j, double value)
{
    *entry(r->band, row, at(r, i, j)) += value;
}

static void put_equation(Reference *r, int i, int j)
{
    static const int fourth[5] = {1, -4, 6, -4, 1}, second[3] = {1, -2, 1};
    const Case *k = r->of;
    double n4 = pow(r->n, 4);
    int row = at(r, i, j);
    for (int p = -2; p <= 2; p++) {
        put(r, row, i + p, j, k->b * n4 * fourth[p + 2]);
        put(r, row, i, j + p, k->d * n4 * fourth[p + 2]);
    }
    for (int p = -1; p <= 1; p++)
        for (int q = -1; q <= 1; q++) put(r, row, i + p, j + q, k->c * n4 * second[p + 1] * second[q + 1]);
    put(r, row, i, j, k->rho / (r->dt * r->dt) + k->eta / (2 * r->dt));
}

static void fill(Reference *r)
{
    int n = r->n;
    for (int i = -1; i <= n + 1; i++)
        for (int j = -1; j <= n + 1; j++) {
            int row = at(r, i, j);
            bool along_i = i >= 1 && i < n, along_j = j >= 1 && j < n;
            if (along_i && along_j) {
                put_equation(r, i, j);
                continue;
            }
            double n4 = pow(n, 4); // so that the rows are of one size, as pivots want it
            put(r, row, i, j, n4); // an edge, a corner, or the near side of a slope
            if (i == -1 && along_j) put(r, row, 1, j, -n4);
            if (i == n + 1 && along_j) put(r, row, n - 1, j, -n4);
            if (j == -1 && along_i) put(r, row, i, 1, -n4);
            if (j == n + 1 && along_i) put(r, row, i, n - 1, -n4);
        }
}

static Equations equations_of(int nodes, double dt)
{
    return (Equations){.nodes = nodes, .dt = dt};
}

static void equations_release(Equations *equations)
{
    for (int k = 0; k < equations->count; k++) {
        free(equations->bands[k].rows);
        free(equations->bands[k].pivots);
    }
}

static Band *find_band(const Equations *equations, const Case *of)
{
    for (int k = 0; k < equations->count; k++) {
        const Case *other = equations->of[k];
        if (other->b == of->b && other->c == of->c && other->d == of->d && other->rho == of->rho &&
            other->eta == of->eta)
            return (Band *)&equations->bands[k];
    }
    return NULL;
}

static Reference *reference_new(Equations *equations, const Case *of)
{
    Reference *r = calloc(1, sizeof *r);
    r->of = of;
    r->n = equations->nodes - 1;
    r->side = equations->nodes + 2;
    r->dt = equations->dt;
    r->band = find_band(equations, of);
    size_t count = (size_t)r->side * (size_t)r->side;
    if (!r->band) {
        equations->of[equations->count] = of;
        r->band = &equations->bands[equations->count++];
        *r->band = (Band){.count = (int)count, .low = 2 * r->side, .height = 6 * r->side + 1};
        r->band->rows = calloc(count * (size_t)r->band->height, sizeof(double));
        r->band->pivots = calloc(count, sizeof *r->band->pivots);
        fill(r);
        factor(r->band);
    }
    r->x = calloc(count, sizeof(double));
    r->before = calloc(count, sizeof(double));
    r->right = calloc(count, sizeof(double));
    return r;
}

static void reference_free(Reference *r)
{
    free(r->x);
    free(r->before);
    free(r->right);
    free(r);
}

static void reference_step(Reference *r)
{
    const Case *k = r->of;
    double dt = r->dt, slope = 2 * pow(r->n, 3); // 2h of a row that is multiplied by n⁴
    for (int i = -1; i <= r->n + 1; i++)
        for (int j = -1; j <= r->n + 1; j++) {
            int row = at(r, i, j);
            bool along_i = i >= 1 && i < r->n, along_j = j >= 1 && j < r->n;
            double *right = &r->right[row];
            *right = 0;
            if (along_i && along_j)
                *right =
                    k->f + k->rho * (2 * r->x[row] - r->before[row]) / (dt * dt) + k->eta * r->before[row] / (2 * dt);
            if (i == -1 && along_j) *right = -slope * k->slope[0];
            if (i == r->n + 1 && along_j) *right = slope * k->slope[1];
            if (j == -1 && along_i) *right = -slope * k->slope[2];
            if (j == r->n + 1 && along_i) *right = slope * k->slope[3];
        }
    solve(r->band, r->right);
    double *old = r->before;
    r->before = r->x;
    r->x = r->right;
    r->right = old;
}

// --- the scene

typedef struct Solved {
    ScnScene *scene;
    PatchSolve *solve;
} Solved;

static Solved solve_scene(const Case *of, int nodes, double dt, PatchMethod method, Device *device)
{
    char count[16], step[32];
    snprintf(count, sizeof count, "%d", nodes);
    snprintf(step, sizeof step, "%.17gs", dt);
    ScnSetting settings[] = {{"which", of->name}, {"nodes", count}, {"dt", step}};
    ScnSceneDesc desc = {.path = SCENE, .settings = settings, .setting_count = 3, .check_only = true};
    Solved solved = {.scene = scene_new(&desc, &(CompileOptions){.patches = true})};
    if (scn_status(solved.scene) != SCN_OK) print_message("%s", scn_diagnostics_text(solved.scene, false));
    assert_int_equal(scn_status(solved.scene), SCN_OK);
    assert_int_equal(solved.scene->package->plan->patch_count, 1);
    Failure failure = {""};
    solved.solve = patch_solve_new(&solved.scene->package->plan->patches[0],
                                   &(PatchSolveDesc){.fps = 24, .method = method, .device = device}, &failure);
    assert_non_null(solved.solve);
    return solved;
}

// x3 at the seven places and three moments, by the reference.
enum { MOMENTS = 3 };
static const int moments[MOMENTS] = {2, 5, 9}; // in steps

typedef struct Expected {
    double values[MOMENTS][PROBES], largest;
} Expected;

static Expected expected_of(Equations *equations, const Case *of)
{
    Expected expected = {0};
    Reference *r = reference_new(equations, of);
    for (int m = 0, steps = 0; m < MOMENTS; m++) {
        for (; steps < moments[m]; steps++) reference_step(r);
        for (int k = 0; k < PROBES; k++) {
            double value = r->x[at(r, probes[k][0] * r->n / 16, probes[k][1] * r->n / 16)];
            expected.values[m][k] = value;
            expected.largest = fmax(expected.largest, fabs(value));
        }
    }
    reference_free(r);
    assert_true(expected.largest > 1e-4);
    return expected;
}

// The largest difference from that, relative to the largest value.
static double difference(const Expected *expected, const Case *of, int nodes, double dt, PatchMethod method,
                         Device *device)
{
    Solved solved = solve_scene(of, nodes, dt, method, device);
    double worst = 0;
    for (int m = 0; m < MOMENTS; m++) {
        FrameError error;
        bool ok = patch_solve_to(solved.solve, moments[m] * dt, solved.scene->inputs, &error);
        if (!ok) fail_msg("%s: %s", of->name, error.text);
        assert_int_equal(patch_solve_shape(solved.solve).steps, moments[m]);
        for (int k = 0; k < PROBES; k++) {
            double place[3];
            assert_true(patch_solve_point(solved.solve, probes[k][0] / 16.0, probes[k][1] / 16.0, place));
            worst = fmax(worst, fabs(place[2] - expected->values[m][k]));
            assert_true(fabs(place[0] - probes[k][0] / 16.0) < 1e-5 && fabs(place[1] - probes[k][1] / 16.0) < 1e-5);
        }
    }
    patch_solve_free(solved.solve);
    scn_free(solved.scene);
    return worst / expected->largest;
}

static Device *device;

static int open_device(void **state)
{
    Failure failure = {""};
    device = device_open(&(DeviceDesc){.choice = "cpu"}, &failure);
    return device ? 0 : -1;
}

static int close_device(void **state)
{
    device_close(device);
    return 0;
}

// Every case in double, to 1e-8 of its size; and in float, to 2e-3.
static void compare_all(int nodes, double dt)
{
    Equations equations = equations_of(nodes, dt);
    for (int c = 0; c < CASES; c++) {
        if (is_ill_posed(&cases[c], nodes)) continue;
        Expected expected = expected_of(&equations, &cases[c]);
        double direct = difference(&expected, &cases[c], nodes, dt, PATCH_METHOD_DIRECT, NULL);
        double single = difference(&expected, &cases[c], nodes, dt, PATCH_METHOD_DEVICE, device);
        if (!(direct < 1e-8) || !(single < 2e-3))
            fail_msg("%s on %d nodes at steps of %gs: %g in double, %g in float", cases[c].name, nodes, dt, direct,
                     single);
    }
    equations_release(&equations);
}

static void all_cases_on_17_nodes(void **state)
{
    compare_all(17, 0.25e-3);
    compare_all(17, 1e-3);
    compare_all(17, 5e-3);
}

static void all_cases_on_33_nodes(void **state)
{
    compare_all(33, 0.5e-3);
    compare_all(33, 2e-3);
}

static void all_cases_on_65_nodes(void **state)
{
    compare_all(65, 0.5e-3);
    compare_all(65, 3e-3);
}

static void all_cases_on_129_nodes(void **state)
{
    compare_all(129, 1e-3);
}

// 2d grows on 129 nodes: the scene is refused.
static void an_ill_posed_case_is_refused(void **state)
{
    assert_true(is_ill_posed(&cases[3], 129) && !is_ill_posed(&cases[3], 65));
    ScnSetting settings[] = {{"which", "2d"}, {"nodes", "129"}};
    ScnSceneDesc desc = {.path = SCENE, .settings = settings, .setting_count = 2, .check_only = true};
    ScnScene *scene = scene_new(&desc, &(CompileOptions){.patches = true});
    assert_int_equal(scn_status(scene), SCN_SCENE_WRONG);
    assert_non_null(strstr(scn_diagnostics_text(scene, false), "patch-ill-posed"));
    scn_free(scene);
}

static void by_sweeps_on_a_coarse_grid(void **state)
{
    Equations equations = equations_of(17, 0.25e-3);
    Expected expected = expected_of(&equations, &cases[6]);
    assert_true(difference(&expected, &cases[6], 17, 0.25e-3, PATCH_METHOD_ITERATIVE, NULL) < 1e-8);
    equations_release(&equations);
}

// What the literature says of its pictures, at 25 ms: 2b is smaller than 2a, 2c and 2d larger, 4i its mirror image, 4j much
// smaller, 4k noticeably reduced.
static void sizes_are_those_of_the_literature(void **state)
{
    double size[CASES];
    for (int c = 0; c < CASES; c++) {
        Solved solved = solve_scene(&cases[c], 33, 1e-3, PATCH_METHOD_DIRECT, NULL);
        FrameError error;
        double place[3];
        assert_true(patch_solve_to(solved.solve, 25e-3, solved.scene->inputs, &error));
        assert_true(patch_solve_point(solved.solve, 0.5, 0.5, place));
        size[c] = place[2];
        patch_solve_free(solved.solve);
        scn_free(solved.scene);
    }
    assert_true(size[1] < 0.5 * size[0]);
    assert_true(size[2] > 1.3 * size[0] && size[3] > 1.2 * size[0]);
    assert_true(fabs(size[8] + size[0]) < 1e-12);
    assert_true(size[9] < 0.5 * size[0] && size[10] < 0.8 * size[0]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_cases_on_17_nodes),
        cmocka_unit_test(all_cases_on_33_nodes),
        cmocka_unit_test(all_cases_on_65_nodes),
        cmocka_unit_test(all_cases_on_129_nodes),
        cmocka_unit_test(an_ill_posed_case_is_refused),
        cmocka_unit_test(by_sweeps_on_a_coarse_grid),
        cmocka_unit_test(sizes_are_those_of_the_literature),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
