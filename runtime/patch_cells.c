// The lines outside are filled first, into a grid with a frame of one; then each cell is two passes of the same cubic,
// over v and over u.
#include "runtime/patch_cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

PatchCells *patch_cells_new(int nodes)
{
    PatchCells *cells = calloc(1, sizeof *cells);
    if (!cells) return NULL;
    cells->nodes = nodes;
    cells->count = nodes - 1;
    cells->points = malloc((size_t)cells->count * cells->count * 48 * sizeof *cells->points);
    cells->grid = malloc((size_t)(nodes + 2) * (nodes + 2) * sizeof *cells->grid);
    if (cells->points && cells->grid) return cells;
    patch_cells_free(cells);
    return NULL;
}

void patch_cells_free(PatchCells *cells)
{
    if (!cells) return;
    free(cells->points);
    free(cells->grid);
    free(cells);
}

// The next value of the parabola through three, the nearest first.
static double extend(double x0, double x1, double x2)
{
    return 3 * x0 - 3 * x1 + x2;
}

// Fills the grid with a component's nodes and the lines outside.
static void fill_grid(PatchCells *cells, const double *x, const PatchEdges *edges, PatchTangents rule, int component)
{
    int n = cells->nodes, side = n + 2, last = n - 1;
    double *grid = cells->grid, reach = 2.0 / last;
    double *inside = grid + side + 1; // node (i, j) is inside[i * side + j]
    for (int i = 0; i < n; i++) memcpy(inside + i * side, x + (size_t)i * n, (size_t)n * sizeof *x);
    for (int k = 0; k < n; k++) {
        inside[k * side] = edges->position[PATCH_V0][component][k];
        inside[k * side + last] = edges->position[PATCH_V1][component][k];
    }
    for (int k = 0; k < n; k++) {
        inside[k] = edges->position[PATCH_U0][component][k];
        inside[last * side + k] = edges->position[PATCH_U1][component][k];
    }
    for (int k = 1; k < last; k++) {
        inside[-side + k] = inside[side + k] - reach * patch_edges_slope(edges, rule, PATCH_U0, component, k);
        inside[n * side + k] =
            inside[(last - 1) * side + k] + reach * patch_edges_slope(edges, rule, PATCH_U1, component, k);
        inside[k * side - 1] = inside[k * side + 1] - reach * patch_edges_slope(edges, rule, PATCH_V0, component, k);
        inside[k * side + n] =
            inside[k * side + last - 1] + reach * patch_edges_slope(edges, rule, PATCH_V1, component, k);
    }
    for (int end = 0; end < 2; end++) {
        int at = end ? last : 0;
        double *row = inside + at * side, *column = inside + at;
        row[-1] = extend(row[0], row[1], row[2]);
        row[n] = extend(row[last], row[last - 1], row[last - 2]);
        column[-side] = extend(column[0], column[side], column[2 * side]);
        column[n * side] = extend(column[last * side], column[(last - 1) * side], column[(last - 2) * side]);
    }
    // The corners outside, by the same rule along the lines outside; the mean of both ways.
    for (int a = 0; a < 2; a++)
        for (int b = 0; b < 2; b++) {
            int i = a ? n : -1, j = b ? n : -1, di = a ? -side : side, dj = b ? -1 : 1;
            double *corner = inside + i * side + j;
            double along_u = extend(corner[di], corner[2 * di], corner[3 * di]),
                   along_v = extend(corner[dj], corner[2 * dj], corner[3 * dj]);
            *corner = (along_u + along_v) / 2;
        }
}

// The Bézier points of the piece between x[1] and x[2] of the curve through four values, `step` apart.
static void bezier_of(const double *x, int step, double *points, int points_step)
{
    double x0 = x[0], x1 = x[step], x2 = x[2 * step], x3 = x[3 * step];
    points[0] = x1;
    points[points_step] = x1 + (x2 - x0) / 6;
    points[2 * points_step] = x2 - (x3 - x1) / 6;
    points[3 * points_step] = x2;
}

void patch_cells_fill(PatchCells *cells, const double *const x[3], const PatchEdges *edges, PatchTangents rule)
{
    int side = cells->nodes + 2;
    double *points = cells->points;
    for (int c = 0; c < 3; c++) {
        fill_grid(cells, x[c], edges, rule, c);
        for (int i = 0; i < cells->count; i++)
            for (int j = 0; j < cells->count; j++, points += 16) {
                double rows[16]; // four lines of the grid, each with its four points over v
                for (int k = 0; k < 4; k++) bezier_of(cells->grid + (i + k) * side + j, 1, rows + 4 * k, 1);
                for (int l = 0; l < 4; l++) bezier_of(rows + l, 4, points + l, 4);
            }
    }
}

const double *patch_cells_points(const PatchCells *cells, int component, int i, int j)
{
    return cells->points + (((size_t)component * cells->count + (size_t)i) * cells->count + (size_t)j) * 16;
}

PatchBounds patch_cells_bounds(const PatchCells *cells, int component, int i, int j)
{
    const double *g = patch_cells_points(cells, component, i, j);
    double speed = 3.0 * cells->count;
    PatchBounds bounds = {INFINITY, -INFINITY, INFINITY, -INFINITY, INFINITY, -INFINITY};
    for (int k = 0; k < 16; k++) {
        bounds.low = fmin(bounds.low, g[k]);
        bounds.high = fmax(bounds.high, g[k]);
        if (k < 12) {
            double slope = speed * (g[k + 4] - g[k]);
            bounds.slope_u_low = fmin(bounds.slope_u_low, slope);
            bounds.slope_u_high = fmax(bounds.slope_u_high, slope);
        }
        if (k % 4 < 3) {
            double slope = speed * (g[k + 1] - g[k]);
            bounds.slope_v_low = fmin(bounds.slope_v_low, slope);
            bounds.slope_v_high = fmax(bounds.slope_v_high, slope);
        }
    }
    return bounds;
}

PatchBounds patch_cells_all(const PatchCells *cells, int component)
{
    PatchBounds all = patch_cells_bounds(cells, component, 0, 0);
    for (int k = 1; k < cells->count * cells->count; k++) {
        PatchBounds one = patch_cells_bounds(cells, component, k / cells->count, k % cells->count);
        all.low = fmin(all.low, one.low);
        all.high = fmax(all.high, one.high);
        all.slope_u_low = fmin(all.slope_u_low, one.slope_u_low);
        all.slope_u_high = fmax(all.slope_u_high, one.slope_u_high);
        all.slope_v_low = fmin(all.slope_v_low, one.slope_v_low);
        all.slope_v_high = fmax(all.slope_v_high, one.slope_v_high);
    }
    return all;
}

// Bernstein's cubics at s, and their derivatives.
static void weights_of(double s, double weights[4], double slopes[4])
{
    double r = 1 - s;
    weights[0] = r * r * r;
    weights[1] = 3 * r * r * s;
    weights[2] = 3 * r * s * s;
    weights[3] = s * s * s;
    slopes[0] = -3 * r * r;
    slopes[1] = 3 * r * (r - 2 * s);
    slopes[2] = 3 * s * (2 * r - s);
    slopes[3] = 3 * s * s;
}

// The cell of a coordinate, and where in it.
static int cell_of(int count, double u, double *within)
{
    double place = fmin(fmax(u, 0), 1) * count;
    int cell = (int)fmin(floor(place), count - 1);
    *within = place - cell;
    return cell;
}

double patch_cells_at(const PatchCells *cells, int component, double u, double v, double *by_u, double *by_v)
{
    double s, t, u_weights[4], u_slopes[4], v_weights[4], v_slopes[4], value = 0, along_u = 0, along_v = 0;
    int i = cell_of(cells->count, u, &s), j = cell_of(cells->count, v, &t);
    const double *g = patch_cells_points(cells, component, i, j);
    weights_of(s, u_weights, u_slopes);
    weights_of(t, v_weights, v_slopes);
    for (int k = 0; k < 4; k++)
        for (int l = 0; l < 4; l++) {
            value += u_weights[k] * v_weights[l] * g[4 * k + l];
            along_u += u_slopes[k] * v_weights[l] * g[4 * k + l];
            along_v += u_weights[k] * v_slopes[l] * g[4 * k + l];
        }
    if (by_u) *by_u = along_u * cells->count;
    if (by_v) *by_v = along_v * cells->count;
    return value;
}
