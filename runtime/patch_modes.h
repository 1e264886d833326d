// The modes of a clamped beam on a patch's grid: A = QΛQᵀ, and B in their basis (runtime/patch_model.h).
//
// In the basis of products of modes, Y = QᵀXQ, the patch's operator is nearly diagonal:
//
//     L Y = h⁻⁴((bΛ_i + dΛ_j) Y + c B̂YB̂)   B̂ = QᵀBQ
//
// The values here are scaled: lambda has the h⁻⁴, b_even, b_odd and beta the h⁻². They depend on the number of nodes
// and the closure of A alone.
//
// A and B commute with the mirror k → m + 1 − k, so every mode is even or odd, and B̂ couples none of one kind with one
// of the other. Modes are kept by kind, each kind padded to a multiple of 16, so that products run over whole vectors:
//
//     index of a mode   0 … even−1   even … half−1   half … half+odd−1   half+odd … 2·half−1
//                       even modes   padding: zero   odd modes           padding: zero
//
// A column of nodes is folded to match: (x_k + x_mirror)/√2 in the first half (the middle node itself where m is odd),
// (x_k − x_mirror)/√2 in the second. Folding is orthogonal, and a mode is a combination of folded values of its own
// half: q_even, q_odd hold entry (folded node r, mode a) at r * half + a.
#ifndef SCN_RUNTIME_PATCH_MODES_H
#define SCN_RUNTIME_PATCH_MODES_H

#include "runtime/failure.h"
#include "runtime/patch_model.h"

#define PATCH_MODE_PAD 16

typedef struct PatchModes {
    int nodes, m;           // nodes a side, unknowns a side
    int even, odd;          // modes of each kind: (m + 1)/2, m/2
    int half, order;        // padded modes of a kind and of both: order = 2·half
    double *lambda, *beta;  // order values each; padding: 1 and 0
    double *q_even, *q_odd; // half × half
    double *b_even, *b_odd; // half × half, symmetric; their diagonals are beta
} PatchModes;

// NULL with `failure` set where the memory is not there. The caller frees them.
PatchModes *patch_modes_new(int nodes, PatchClosure closure, Failure *failure);
void patch_modes_free(PatchModes *modes); // NULL is nothing

// Between an array over unknowns (m × m) and one over modes (order × order, padding zero). `work` has 2 · order²
// values.
void patch_modes_of_nodes(const PatchModes *modes, const double *x, double *y, double *work);
void patch_modes_to_nodes(const PatchModes *modes, const double *y, double *x, double *work);

// As patch_modes_of_nodes() for an x that is zero but for its two outer rows and columns on each side, as an edge's
// load is: O(nodes²), not O(nodes³). `work` has order values.
void patch_modes_of_frame(const PatchModes *modes, const double *x, double *y, double *work);

// Row `node` (0 … m − 1) of Q: the value of each mode there, order values.
void patch_modes_row(const PatchModes *modes, int node, double *row);

#endif
