// The surface between a patch's nodes: it goes through them, has the edges' slopes, and stays within its bounds.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "runtime/patch_cells.h"
#include "runtime/patch_host.h"
#include "tests/unit/patch_cases.h"

// A case of the literature at t = 0.025, and its surface.
typedef struct Solved {
    PatchHost *patch;
    PatchEdges *edges;
    PatchCells *cells;
} Solved;

static Solved solve(const PatchCase *one, int nodes)
{
    PatchModel model = patch_case_model(one, nodes, 1e-3);
    Solved solved = {patch_host_new(&model, PATCH_DIRECT, NULL), patch_case_edges(one, nodes), patch_cells_new(nodes)};
    assert_true(solved.patch && solved.cells);
    patch_host_start(solved.patch, solved.edges, NULL, NULL);
    for (int t = 0; t < 25; t++) assert_true(patch_host_step(solved.patch, NULL, NULL));
    patch_cells_fill(solved.cells, (const double *const *)solved.patch->x, solved.edges, PATCH_TANGENTS_X3);
    return solved;
}

static void drop(Solved *solved)
{
    patch_host_free(solved->patch);
    patch_edges_free(solved->edges);
    patch_cells_free(solved->cells);
}

static void goes_through_the_nodes(void **state)
{
    Solved solved = solve(&patch_cases[6], 17);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < 17; i++)
            for (int j = 0; j < 17; j++)
                assert_true(fabs(patch_cells_at(solved.cells, c, i / 16.0, j / 16.0, NULL, NULL) -
                                 solved.patch->x[c][i * 17 + j]) < 1e-14);
    // The first two components are u and v between the nodes too.
    unsigned seed = 5;
    for (int k = 0; k < 1000; k++) {
        double u = 0.5 + 0.5 * patch_noise(&seed), v = 0.5 + 0.5 * patch_noise(&seed), by_u, by_v;
        assert_true(fabs(patch_cells_at(solved.cells, 0, u, v, &by_u, &by_v) - u) < 1e-12 && fabs(by_u - 1) < 1e-10 &&
                    fabs(by_v) < 1e-10);
        assert_true(fabs(patch_cells_at(solved.cells, 1, u, v, &by_u, &by_v) - v) < 1e-12 && fabs(by_u) < 1e-10 &&
                    fabs(by_v - 1) < 1e-10);
    }
    drop(&solved);
}

static void edges_have_their_slopes(void **state)
{
    for (int k = 0; k < PATCH_CASES; k++) {
        Solved solved = solve(&patch_cases[k], 17);
        const double *slope = patch_cases[k].slope;
        for (int at = 1; at < 16; at++) {
            double s = at / 16.0, along;
            patch_cells_at(solved.cells, 2, 0, s, &along, NULL);
            assert_true(fabs(along - slope[PATCH_U0]) < 1e-11);
            patch_cells_at(solved.cells, 2, 1, s, &along, NULL);
            assert_true(fabs(along - slope[PATCH_U1]) < 1e-11);
            patch_cells_at(solved.cells, 2, s, 0, NULL, &along);
            assert_true(fabs(along - slope[PATCH_V0]) < 1e-11);
            patch_cells_at(solved.cells, 2, s, 1, NULL, &along);
            assert_true(fabs(along - slope[PATCH_V1]) < 1e-11);
        }
        // x3 = 0 on the whole edge, also where the slopes contradict that at the corners.
        for (int at = 0; at <= 160; at++) {
            double s = at / 160.0;
            for (int end = 0; end < 2; end++) {
                assert_true(fabs(patch_cells_at(solved.cells, 2, end, s, NULL, NULL)) < 1e-14);
                assert_true(fabs(patch_cells_at(solved.cells, 2, s, end, NULL, NULL)) < 1e-14);
            }
        }
        drop(&solved);
    }
}

// Random nodes, so that nothing is smooth: value and slopes are continuous from cell to cell.
static void is_smooth_across_cells(void **state)
{
    enum { nodes = 9 };
    unsigned seed = 11;
    double values[3][nodes * nodes];
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < nodes * nodes; k++) values[c][k] = patch_noise(&seed);
    PatchEdges *edges = patch_edges_new(nodes);
    PatchCells *cells = patch_cells_new(nodes);
    for (size_t k = 0; k < patch_edges_count(nodes); k++) patch_edges_values(edges)[k] = patch_noise(&seed);
    patch_cells_fill(cells, (const double *const[3]){values[0], values[1], values[2]}, edges, PATCH_TANGENTS_ALL);
    for (int c = 0; c < 3; c++)
        for (int k = 1; k < nodes - 1; k++)
            for (int t = 0; t <= 100; t++) {
                double at = k / (nodes - 1.0), other = t / 100.0, small = 1e-9, a, b, d, e;
                double low = patch_cells_at(cells, c, at - small, other, &a, &b),
                       high = patch_cells_at(cells, c, at + small, other, &d, &e);
                assert_true(fabs(low - high) < 1e-6 && fabs(a - d) < 1e-4 && fabs(b - e) < 1e-4);
                low = patch_cells_at(cells, c, other, at - small, &a, &b),
                high = patch_cells_at(cells, c, other, at + small, &d, &e);
                assert_true(fabs(low - high) < 1e-6 && fabs(a - d) < 1e-4 && fabs(b - e) < 1e-4);
            }
    patch_edges_free(edges);
    patch_cells_free(cells);
}

static void bounds_hold_and_are_tight(void **state)
{
    for (int k = 0; k < PATCH_CASES; k++) {
        Solved solved = solve(&patch_cases[k], 17);
        PatchBounds all = patch_cells_all(solved.cells, 2);
        double lowest = INFINITY, highest = -INFINITY;
        for (int cell = 0; cell < 16 * 16; cell++) {
            int i = cell / 16, j = cell % 16;
            PatchBounds bounds = patch_cells_bounds(solved.cells, 2, i, j);
            double slack = 1e-13, low = INFINITY, high = -INFINITY;
            for (int a = 0; a <= 12; a++)
                for (int b = 0; b <= 12; b++) {
                    double by_u, by_v, u = (i + fmin(a / 12.0, 1 - 1e-12)) / 16,
                                       v = (j + fmin(b / 12.0, 1 - 1e-12)) / 16;
                    double value = patch_cells_at(solved.cells, 2, u, v, &by_u, &by_v);
                    assert_true(value >= bounds.low - slack && value <= bounds.high + slack);
                    assert_true(by_u >= bounds.slope_u_low - 1e-10 && by_u <= bounds.slope_u_high + 1e-10);
                    assert_true(by_v >= bounds.slope_v_low - 1e-10 && by_v <= bounds.slope_v_high + 1e-10);
                    low = fmin(low, value), high = fmax(high, value);
                }
            assert_true(bounds.high - bounds.low < 2.3 * (high - low) + 1e-12);
            lowest = fmin(lowest, low), highest = fmax(highest, high);
        }
        assert_true(all.low <= lowest + 1e-13 && all.high >= highest - 1e-13);
        assert_true(all.high - all.low < 1.1 * (highest - lowest));
        drop(&solved);
    }
}

// Against the solution on a fine grid, at places between the nodes of the coarse one: the error falls as the scheme's
// own does.
static void finer_grids_come_nearer(void **state)
{
    Solved fine = solve(&patch_cases[0], 65);
    double error[2];
    for (int k = 0; k < 2; k++) {
        Solved coarse = solve(&patch_cases[0], (16 << k) + 1);
        error[k] = 0;
        unsigned seed = 3;
        for (int t = 0; t < 500; t++) {
            double u = 0.5 + 0.5 * patch_noise(&seed), v = 0.5 + 0.5 * patch_noise(&seed);
            double difference =
                patch_cells_at(coarse.cells, 2, u, v, NULL, NULL) - patch_cells_at(fine.cells, 2, u, v, NULL, NULL);
            error[k] = fmax(error[k], fabs(difference));
        }
        drop(&coarse);
    }
    assert_true(error[0] < 0.06 && error[1] < error[0] / 3.5);
    drop(&fine);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(goes_through_the_nodes),  cmocka_unit_test(edges_have_their_slopes),
        cmocka_unit_test(is_smooth_across_cells),  cmocka_unit_test(bounds_hold_and_are_tight),
        cmocka_unit_test(finer_grids_come_nearer),
    };
    return cmocka_run_group_tests_name("patch cells", tests, NULL, NULL);
}
