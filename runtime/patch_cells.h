// A patch as a surface between its nodes: bicubic cells in Bézier form, with bounds.
//
// Between nodes a patch is the Catmull–Rom surface through them, which is C¹ and needs one more line of nodes outside
// each edge. Those are x[−1] = x[1] − 2h·slope (u = 0, v = 0) and x[n+1] = x[n−1] + 2h·slope (u = 1, v = 1), as in the
// difference scheme, so the slope of the surface at an edge's nodes is the edge's condition exactly. Beside the ends of
// an edge the positions along the crossing edge decide instead: a slope there that contradicts them (the literature's
// cases 3a to 3d) would bulge that edge itself. Then x[−1] = 3x[0] − 3x[1] + x[2], which takes the own slope of the
// curve through the three; at the corners this is done along both edges.
//
// With n = nodes − 1 cells a side, cell (i, j) covers u from i/n to (i + 1)/n and v from j/n to (j + 1)/n. Its Bézier
// points of component c are 16 values: point (k, l), k along u, at points[((c n + i) n + j) 16 + 4k + l]. The corner
// points are the nodes.
//
// A surface lies within its Bézier points; so patch_cells_bounds() holds for every (u, v) of the cell, in exact
// arithmetic and to rounding (2e-15 of the largest point) in double. They are mostly 1.0 to 1.05 times the true range
// of a cell, 2.2 times in the worst cells of the literature's cases.
//
// Between two steps the shape is the mix of both, and so are its points: patch_cells_fill() from mixed nodes and mixed
// edges gives them.
#ifndef SCN_RUNTIME_PATCH_CELLS_H
#define SCN_RUNTIME_PATCH_CELLS_H

#include "runtime/patch_model.h"

typedef struct PatchCells {
    int nodes, count; // count = nodes − 1, cells a side
    double *points;   // 3 · count² · 16
    double *grid;     // (nodes + 2)²: a component with the lines outside, while filling
} PatchCells;

// What a component does over a cell: its value and its derivatives by u and v lie within these.
typedef struct PatchBounds {
    double low, high;
    double slope_u_low, slope_u_high, slope_v_low, slope_v_high;
} PatchBounds;

// NULL where the memory is not there. The points are not set. The caller frees them.
PatchCells *patch_cells_new(int nodes);
void patch_cells_free(PatchCells *cells); // NULL is nothing

// Makes the points of all three components from places over nodes, whose frame is taken from the edges.
void patch_cells_fill(PatchCells *cells, const double *const x[3], const PatchEdges *edges, PatchTangents rule);

// The 16 points of a cell.
const double *patch_cells_points(const PatchCells *cells, int component, int i, int j);

// Bounds of a component over a cell, and over all cells.
PatchBounds patch_cells_bounds(const PatchCells *cells, int component, int i, int j);
PatchBounds patch_cells_all(const PatchCells *cells, int component);

// The value of a component at (u, v), each clamped to 0 … 1; its derivatives where not NULL.
double patch_cells_at(const PatchCells *cells, int component, double u, double v, double *by_u, double *by_v);

#endif
