// The eleven configurations of the literature, as a scene says them, against a reference of its own.
//
// The reference is written from the equation and shares nothing with the product: unknowns are all nodes inside and one
// line of values outside of each edge; each row is Eq. 1 with the differences of Eqs. 3 to 5 at a node inside, or the
// condition of Eq. 7 for a value outside. Nothing is folded back, nothing is symmetric; the rows are solved by
// elimination with pivots in a band. In time it is (x⁺ − 2x + x⁻)/dt² and (x⁺ − x⁻)/2dt of three shapes.
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
enum { CASES = sizeof cases / sizeof *cases, PROBES = 7 };

// Seven nodes that every grid of 16k + 1 has, of which none is the middle or stands on a diagonal.
static const int probes[PROBES][2] = {{4, 6}, {12, 5}, {3, 8}, {8, 3}, {2, 13}, {14, 9}, {7, 10}}; // of sixteenths

// --- the reference

// A matrix in a band, row by row: entry (r, c) at rows[r * width + c - r + low]; elimination with row exchanges fills up
// to twice `low` to the right.
typedef struct Band {
    int count, low, width;
    double *rows;
    int *pivots;
} Band;

static double *entry(Band *band, int row, int column)
{
    return &band->rows[(size_t)row * (size_t)band->width + (size_t)(column - row + band->low)];
}

static void factor(Band *band)
{
    int n = band->count, low = band->low;
    for (int k = 0; k < n; k++) {
        int last = k + low < n ? k + low : n - 1, right = k + 2 * low < n ? k + 2 * low : n - 1, best = k;
        for (int r = k + 1; r <= last; r++)
            if (fabs(*entry(band, r, k)) > fabs(*entry(band, best, k))) best = r;
        band->pivots[k] = best;
        for (int c = k; best != k && c <= right; c++) {
            double swap = *entry(band, k, c);
            *entry(band, k, c) = *entry(band, best, c);
            *entry(band, best, c) = swap;
        }
        for (int r = k + 1; r <= last; r++) {
            double ratio = *entry(band, r, k) / *entry(band, k, k);
            *entry(band, r, k) = ratio;
            for (int c = k + 1; ratio != 0 && c <= right; c++) *entry(band, r, c) -= ratio * *entry(band, k, c);
        }
    }
}

static void solve(Band *band, double *x)
{
    int n = band->count, low = band->low;
    for (int k = 0; k < n; k++) {
        double swap = x[k];
        x[k] = x[band->pivots[k]];
        x[band->pivots[k]] = swap;
        for (int r = k + 1; r <= k + low && r < n; r++) x[r] -= *entry(band, r, k) * x[k];
    }
    for (int k = n; k-- > 0;) {
        for (int c = k + 1; c <= k + 2 * low && c < n; c++) x[k] -= *entry(band, k, c) * x[c];
        x[k] /= *entry(band, k, k);
    }
}

// x3 alone. Nodes (i, j) from -1 to n + 1 along both; all of them are rows, those that nothing needs are x = 0.
typedef struct Reference {
    const Case *of;
    int n, side; // cells; values a line
    double dt;
    Band band;
    double *x, *before, *right;
} Reference;

static int at(const Reference *r, int i, int j)
{
    return (i + 1) * r->side + j + 1;
}

static void put(Reference *r, int row, int i, int j, double value)
{
    *entry(&r->band, row, at(r, i, j)) += value;
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

static Reference *reference_new(const Case *of, int nodes, double dt)
{
    Reference *r = calloc(1, sizeof *r);
    r->of = of;
    r->n = nodes - 1;
    r->side = nodes + 2;
    r->dt = dt;
    r->band.count = r->side * r->side;
    r->band.low = 2 * r->side;
    r->band.width = 3 * r->band.low + 1;
    r->band.rows = calloc((size_t)r->band.count * (size_t)r->band.width, sizeof(double));
    r->band.pivots = calloc((size_t)r->band.count, sizeof(int));
    r->x = calloc((size_t)r->band.count, sizeof(double));
    r->before = calloc((size_t)r->band.count, sizeof(double));
    r->right = calloc((size_t)r->band.count, sizeof(double));
    fill(r);
    factor(&r->band);
    return r;
}

static void reference_free(Reference *r)
{
    free(r->band.rows);
    free(r->band.pivots);
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
    solve(&r->band, r->right);
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

// The largest difference at the seven places and three moments, relative to the largest value.
static double difference(const Case *of, int nodes, double dt, PatchMethod method, Device *device)
{
    static const int moments[] = {3, 10, 25};
    Reference *r = reference_new(of, nodes, dt);
    Solved solved = solve_scene(of, nodes, dt, method, device);
    double worst = 0, largest = 0;
    int steps = 0;
    for (int m = 0; m < 3; m++) {
        FrameError error;
        for (; steps < moments[m]; steps++) reference_step(r);
        bool ok = patch_solve_to(solved.solve, moments[m] * dt, solved.scene->inputs, &error);
        if (!ok) print_message("%s: %s\n", of->name, error.text);
        assert_true(ok);
        assert_int_equal(patch_solve_shape(solved.solve).steps, moments[m]);
        for (int k = 0; k < PROBES; k++) {
            double place[3], expected = r->x[at(r, probes[k][0] * r->n / 16, probes[k][1] * r->n / 16)];
            assert_true(patch_solve_point(solved.solve, probes[k][0] / 16.0, probes[k][1] / 16.0, place));
            worst = fmax(worst, fabs(place[2] - expected));
            largest = fmax(largest, fabs(expected));
            assert_true(fabs(place[0] - probes[k][0] / 16.0) < 1e-5 && fabs(place[1] - probes[k][1] / 16.0) < 1e-5);
        }
    }
    assert_true(largest > 0.01);
    patch_solve_free(solved.solve);
    scn_free(solved.scene);
    reference_free(r);
    return worst / largest;
}

static void all_cases_in_double(void **state)
{
    static const double steps[] = {0.25e-3, 1e-3, 5e-3};
    for (int c = 0; c < CASES; c++)
        for (int k = 0; k < 3; k++) assert_true(difference(&cases[c], 17, steps[k], PATCH_METHOD_DIRECT, NULL) < 1e-8);
    for (int c = 0; c < CASES; c++) assert_true(difference(&cases[c], 33, 2e-3, PATCH_METHOD_DIRECT, NULL) < 1e-8);
}

// Two cases that differ along u and v, on large grids.
static void large_grids_in_double(void **state)
{
    assert_true(difference(&cases[1], 65, 1e-3, PATCH_METHOD_DIRECT, NULL) < 1e-8);
    assert_true(difference(&cases[5], 129, 1e-3, PATCH_METHOD_DIRECT, NULL) < 1e-8);
}

static void all_cases_on_the_device(void **state)
{
    Failure failure = {""};
    Device *device = device_open(&(DeviceDesc){.choice = "cpu"}, &failure);
    if (!device) skip();
    for (int c = 0; c < CASES; c++) assert_true(difference(&cases[c], 17, 1e-3, PATCH_METHOD_DEVICE, device) < 2e-3);
    for (int c = 0; c < CASES; c += 2)
        assert_true(difference(&cases[c], 33, 0.5e-3, PATCH_METHOD_DEVICE, device) < 2e-3);
    assert_true(difference(&cases[5], 65, 1e-3, PATCH_METHOD_DEVICE, device) < 2e-3);
    device_close(device);
}

static void by_sweeps_on_a_coarse_grid(void **state)
{
    assert_true(difference(&cases[6], 17, 0.25e-3, PATCH_METHOD_ITERATIVE, NULL) < 1e-8);
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
        cmocka_unit_test(all_cases_in_double),
        cmocka_unit_test(large_grids_in_double),
        cmocka_unit_test(all_cases_on_the_device),
        cmocka_unit_test(by_sweeps_on_a_coarse_grid),
        cmocka_unit_test(sizes_are_those_of_the_literature),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
