// The pieces that the solvers of patches share: the operator, the edges' load, the beam's modes, the banded factor, and
// the diagnosis.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "runtime/patch_band.h"
#include "runtime/patch_diagnose.h"
#include "runtime/patch_modes.h"
#include "tests/unit/patch_cases.h"

static const PatchStiffness odd_stiffness = {1.3, -0.7, 2.9};

// x = u³v² − 2uv³ has exact differences: b·0 + c ∂⁴/∂u²∂v² + d·0 = c·12u, with its own values on the edges and slopes
// of the grid.
static void operator_and_edges(void **state)
{
    for (int nodes = PATCH_MIN_NODES; nodes <= 20; nodes += 5) {
        int m = nodes - 2, n = nodes - 1;
        double h = 1.0 / n;
        PatchModel model = patch_model_base(nodes);
        model.stiffness[2] = odd_stiffness;
        PatchEdges *edges = patch_edges_new(nodes);
        double *x = calloc((size_t)4 * m * m, sizeof *x), *y = x + m * m, *g = y + m * m;
#define SHAPE(u, v) ((u) * (u) * (u) * (v) * (v)-2 * (u) * (v) * (v) * (v))
        for (int k = 0; k < nodes; k++) {
            double s = k * h;
            for (int end = 0; end < 2; end++) {
                edges->position[PATCH_U0 + end][2][k] = SHAPE(end, s);
                edges->position[PATCH_V0 + end][2][k] = SHAPE(s, end);
                edges->tangent[PATCH_U0 + end][2][k] = (SHAPE(end + h, s) - SHAPE(end - h, s)) / (2 * h);
                edges->tangent[PATCH_V0 + end][2][k] = (SHAPE(s, end + h) - SHAPE(s, end - h)) / (2 * h);
            }
        }
        for (int i = 0; i < m; i++)
            for (int j = 0; j < m; j++) x[i * m + j] = SHAPE((i + 1) * h, (j + 1) * h);
        patch_apply(&odd_stiffness, PATCH_PLAIN, nodes, 0, x, y);
        patch_edge_load(&model, edges, 2, g);
        for (int i = 0; i < m; i++)
            for (int j = 0; j < m; j++)
                assert_true(fabs(y[i * m + j] - g[i * m + j] - odd_stiffness.c * 12 * (i + 1) * h) < 1e-7);
        // The entries are those of the product.
        for (int k = 0; k < m * m; k++) x[k] = 0;
        int i = m / 2, j = 0;
        x[i * m + j] = 1;
        patch_apply(&odd_stiffness, PATCH_PLAIN, nodes, 3, x, y);
        for (int p = -2; p <= 2; p++)
            for (int q = 0; q <= 2; q++) {
                if (i + p < 0 || i + p >= m || j + q >= m) continue;
                double entry =
                    patch_entry(&odd_stiffness, PATCH_PLAIN, nodes, i + 1, j + 1, p, q) + (p == 0 && q == 0 ? 3 : 0);
                assert_true(fabs(y[(i + p) * m + j + q] - entry) < 1e-9 * fabs(entry) + 1e-12);
            }
        free(x);
        patch_edges_free(edges);
    }
}

static void slopes_by_rule(void **state)
{
    PatchEdges *edges = patch_edges_new(9);
    for (int c = 0; c < 3; c++) edges->tangent[PATCH_U0][c][4] = 7;
    edges->position[PATCH_U1][0][4] = 3;
    assert_true(patch_edges_slope(edges, PATCH_TANGENTS_ALL, PATCH_U0, 0, 4) == 7);
    assert_true(patch_edges_slope(edges, PATCH_TANGENTS_X3, PATCH_U0, 2, 4) == 7);
    // The line to the opposite edge: x1 goes from 0 to 3, x2 stays.
    assert_true(patch_edges_slope(edges, PATCH_TANGENTS_X3, PATCH_U0, 0, 4) == 3);
    assert_true(patch_edges_slope(edges, PATCH_TANGENTS_X3, PATCH_U0, 1, 4) == 0);
    assert_true(patch_edges_slope(edges, PATCH_TANGENTS_X3, PATCH_V1, 1, 4) == 1);
    patch_edges_free(edges);
}

// In the basis of modes the operator is what it says, for even and odd numbers of unknowns.
static void modes_diagonalise(void **state)
{
    const int sizes[] = {5, 6, 17, 34, 65};
    for (int k = 0; k < 5; k++) {
        int nodes = sizes[k], m = nodes - 2;
        PatchModes *modes = patch_modes_new(nodes, PATCH_PLAIN, NULL);
        assert_non_null(modes);
        int order = modes->order, half = modes->half;
        assert_int_equal(half % 16, 0);
        double *x = calloc((size_t)3 * m * m + (size_t)6 * order * order, sizeof *x), *lx = x + m * m,
               *back = lx + m * m;
        double *y = back + m * m, *ly = y + order * order, *by = ly + order * order, *expected = by + order * order,
               *work = expected + order * order;
        unsigned seed = 9;
        for (int t = 0; t < m * m; t++) x[t] = patch_noise(&seed);
        patch_modes_of_nodes(modes, x, y, work);
        patch_modes_to_nodes(modes, y, back, work);
        for (int t = 0; t < m * m; t++) assert_true(fabs(back[t] - x[t]) < 1e-12);
        patch_apply(&odd_stiffness, PATCH_PLAIN, nodes, 0, x, lx);
        patch_modes_of_nodes(modes, lx, ly, work);
        // B̂ y B̂, block by block.
        for (int a = 0; a < order; a++)
            for (int c = 0; c < order; c++) {
                const double *block = a < half ? modes->b_even : modes->b_odd;
                double sum = 0;
                for (int t = 0; t < half; t++)
                    sum += block[a % half * half + t] * y[((a < half ? 0 : half) + t) * order + c];
                by[a * order + c] = sum;
            }
        double scale = 0;
        for (int a = 0; a < order; a++)
            for (int c = 0; c < order; c++) {
                const double *block = c < half ? modes->b_even : modes->b_odd;
                double sum = 0;
                for (int t = 0; t < half; t++)
                    sum += by[a * order + (c < half ? 0 : half) + t] * block[t * half + c % half];
                double value =
                    odd_stiffness.c * sum +
                    (odd_stiffness.b * modes->lambda[a] + odd_stiffness.d * modes->lambda[c]) * y[a * order + c];
                expected[a * order + c] = value;
                scale = fmax(scale, fabs(value));
            }
        for (int t = 0; t < order * order; t++) assert_true(fabs(expected[t] - ly[t]) < 1e-10 * scale);
        // The first mode is the clamped beam's, with the grid's error of order 2.
        if (nodes == 65) assert_true(fabs(modes->lambda[0] / 500.5639 - 1) < 0.005);
        free(x);
        patch_modes_free(modes);
    }
}

static void modes_of_an_edge_load(void **state)
{
    for (int nodes = 5; nodes <= 33; nodes += 7) {
        PatchModel model = patch_model_base(nodes);
        PatchEdges *edges = patch_edges_new(nodes);
        PatchModes *modes = patch_modes_new(nodes, PATCH_PLAIN, NULL);
        int m = modes->m, order = modes->order;
        unsigned seed = 21;
        for (size_t k = 0; k < patch_edges_count(nodes); k++) patch_edges_values(edges)[k] = patch_noise(&seed);
        double *g = calloc((size_t)m * m + (size_t)4 * order * order, sizeof *g), *y = g + m * m,
               *other = y + order * order, *work = other + order * order;
        patch_edge_load(&model, edges, 2, g);
        patch_modes_of_nodes(modes, g, y, work);
        patch_modes_of_frame(modes, g, other, work);
        double scale = 0;
        for (int k = 0; k < order * order; k++) scale = fmax(scale, fabs(y[k]));
        for (int k = 0; k < order * order; k++) assert_true(fabs(y[k] - other[k]) < 1e-13 * scale);
        free(g);
        patch_edges_free(edges);
        patch_modes_free(modes);
    }
}

// The banded factors solve what the operator multiplies, pins and all.
static void band_solves(void **state)
{
    enum { nodes = 12, m = nodes - 2 };
    const PatchPin pins[2] = {{3, 4, {0}}, {9, 10, {0}}};
    const PatchStiffness bad = {1, -3, 1};
    double x[m * m], y[m * m];
    unsigned seed = 4;
    PatchBand *band = patch_band_new(nodes, NULL);
    for (int run = 0; run < 2; run++) {
        const PatchStiffness *s = run ? &bad : &odd_stiffness;
        for (int k = 0; k < m * m; k++) x[k] = patch_noise(&seed);
        x[2 * m + 3] = x[8 * m + 9] = 0;
        patch_apply(s, PATCH_PLAIN, nodes, 50, x, y);
        y[2 * m + 3] = y[8 * m + 9] = 0;
        if (run) assert_false(patch_band_factor(band, s, PATCH_PLAIN, 50, pins, 2));
        assert_true(run ? patch_band_factor_any(band, s, PATCH_PLAIN, 50, pins, 2)
                        : patch_band_factor(band, s, PATCH_PLAIN, 50, pins, 2));
        patch_band_solve(band, y, 1);
        for (int k = 0; k < m * m; k++) assert_true(fabs(x[k] - y[k]) < 1e-9);
    }
    patch_band_free(band);
}

// ---- the diagnosis

// The findings of a model as names, "!" before errors.
static const char *diagnosis(const PatchModel *model)
{
    static char text[400];
    PatchFinding findings[PATCH_FINDINGS];
    int count = patch_diagnose(model, findings, PATCH_FINDINGS);
    assert_true(count <= PATCH_FINDINGS);
    text[0] = 0;
    for (int k = 0; k < count; k++) {
        assert_true(findings[k].text[0] != 0);
        snprintf(text + strlen(text), sizeof text - strlen(text), "%s%s%s", k ? " " : "", findings[k].error ? "!" : "",
                 patch_problem_name(findings[k].problem));
    }
    return text;
}

static void diagnosis_by_name(void **state)
{
    PatchModel model = patch_model_base(33);
    assert_string_equal(diagnosis(&model), "");
    model.density = -0.1;
    model.damping = -1;
    assert_string_equal(diagnosis(&model), "!density-negative !damping-negative");
    model = patch_model_base(4);
    assert_string_equal(diagnosis(&model), "!grid");
    model = patch_model_base(300);
    assert_string_equal(diagnosis(&model), "!grid");
    model = patch_model_base(33);
    model.step = 0;
    assert_string_equal(diagnosis(&model), "!step");
    model.step = NAN;
    assert_string_equal(diagnosis(&model), "!not-finite");
    model = patch_model_base(33);
    model.scheme = PATCH_NEWMARK;
    model.density = model.damping = 0;
    assert_string_equal(diagnosis(&model), "!nothing-moves");
    PatchPin pins[2] = {{3, 3, {0}}, {3, 3, {0}}};
    model = patch_model_base(9);
    model.pins = pins;
    model.pin_count = 2;
    assert_string_equal(diagnosis(&model), "!pin-twice");
    pins[1].i = 8;
    assert_string_equal(diagnosis(&model), "!pin-place");
}

// Where L stops being positive definite is known: between 71 and 73 nodes for d = −0.001; between c = −2.01 and −2.0102
// at 9 nodes.
static void diagnosis_of_ill_posed_equations(void **state)
{
    PatchModel model = patch_model_base(65);
    for (int c = 0; c < 3; c++) model.stiffness[c].d = -0.001;
    assert_string_equal(diagnosis(&model), "d-negative");
    model.nodes = 71;
    assert_string_equal(diagnosis(&model), "d-negative");
    model.nodes = 73;
    assert_string_equal(diagnosis(&model), "d-negative !operator");
    model.insist = true;
    assert_string_equal(diagnosis(&model), "d-negative operator");
    model = patch_model_base(9);
    model.stiffness[1].c = -2;
    assert_string_equal(diagnosis(&model), "");
    model.stiffness[1].c = -2.009;
    assert_string_equal(diagnosis(&model), "c-below");
    model.stiffness[1].c = -2.011;
    assert_string_equal(diagnosis(&model), "c-below !operator");
    PatchFinding findings[2];
    assert_int_equal(patch_diagnose(&model, findings, 2), 2);
    assert_int_equal(findings[0].component, 1);
    assert_true(findings[0].value == -2.011 && findings[0].bound == -2);
    model.stiffness[1] = (PatchStiffness){-1, 0, 1};
    assert_string_equal(diagnosis(&model), "b-negative !operator");
    model.stiffness[1] = (PatchStiffness){0, 0, 0};
    assert_string_equal(diagnosis(&model), "!operator");
    model.stiffness[1] = (PatchStiffness){0, 0, 1}; // strings along v, each for itself
    assert_string_equal(diagnosis(&model), "");
}

// The bound on dt is where the error is what was asked for. The base case's first mode has λ = 1294.9.
static void step_for_an_accuracy(void **state)
{
    PatchModel model = patch_model_base(33);
    // To first order the scheme has η + dt λ for η, so the rate s is wrong by λ dt s/|2ρs + η|, relative to s.
    assert_true(fabs(patch_rate_error(&model, 1294.9, 1e-6) / (1294.9e-6 / sqrt(4 * 0.1 * 1294.9 - 1)) - 1) < 1e-3);
    for (int scheme = 0; scheme < 2; scheme++) {
        model.scheme = scheme;
        double bound = patch_step_bound(&model, 1294.9, 0.01);
        assert_true(fabs(patch_rate_error(&model, 1294.9, bound) - 0.01) < 1e-6);
        // Order 1, and order 2.
        double order = log2(patch_rate_error(&model, 1294.9, bound) / patch_rate_error(&model, 1294.9, bound / 2));
        assert_true(fabs(order - (scheme ? 2 : 1)) < 0.1);
    }
    model = patch_model_base(33);
    model.accuracy = 0.01;
    assert_string_equal(diagnosis(&model), "step-large");
    PatchFinding finding;
    patch_diagnose(&model, &finding, 1);
    assert_false(finding.error);
    assert_true(finding.value == 1e-3 && finding.bound > 1.5e-4 && finding.bound < 2e-4);
    model.step = finding.bound;
    assert_string_equal(diagnosis(&model), "");
    // The estimate of the lowest eigenvalue.
    assert_true(fabs(patch_lowest(&model.stiffness[0]) / 1294.9 - 1) < 0.01);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(operator_and_edges),
        cmocka_unit_test(slopes_by_rule),
        cmocka_unit_test(modes_diagonalise),
        cmocka_unit_test(modes_of_an_edge_load),
        cmocka_unit_test(band_solves),
        cmocka_unit_test(diagnosis_by_name),
        cmocka_unit_test(diagnosis_of_ill_posed_equations),
        cmocka_unit_test(step_for_an_accuracy),
    };
    return cmocka_run_group_tests_name("patch model", tests, NULL, NULL);
}
