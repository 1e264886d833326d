// A deformable patch: the description of its equation, its edges, and the difference scheme that all solvers share.
//
// A patch is a surface x(u, v, t) over the unit square whose three components solve, each with its own stiffness,
//
//     b ∂⁴x/∂u⁴ + c ∂⁴x/∂u²∂v² + d ∂⁴x/∂v⁴ + ρ ∂²x/∂t² + η ∂x/∂t = f
//
// with positions and slopes given on the four edges (You & Zhang, Deformation of Dynamic Surfaces, Eq. 1). Times are
// seconds.
//
// The grid has `nodes` × `nodes` nodes, h = 1/(nodes − 1), node (i, j) at u = i h, v = j h, and every array over nodes
// holds it at i * nodes + j. The unknowns are the (nodes − 2)² nodes inside; an array over unknowns holds node (i, j)
// at (i − 1) * (nodes − 2) + (j − 1). L is the difference operator of the first three terms (their Eq. 3, divided by
// h⁴)
//
//     h⁴L = b A⊗I + c B⊗B + d I⊗A,   B = tridiag(−1, 2, −1),   A = pentadiag(1, −4, 6, −4, 1) with 7 at both ends
//
// The 7 is the value outside an edge folded back: x[−1] = x[1] − 2h·slope at u = 0, x[n+1] = x[n−1] + 2h·slope at u =
// 1, the slope always toward growing u (v). Hence L is symmetric, and edges stand in the right side alone.
//
// What the 7 costs. It is the literature's rule, of second order: the middle of the clamped plate under a uniform load
// sinks 3.32, 0.842 and 0.2115 % too far at 17, 33 and 65 nodes. PATCH_ACCURATE ends A otherwise, for 0.193, −0.009 and
// −0.010 % (tests/unit/test_patch_closure.c), by the corner
//
//     1/47 |  431 −202 |        in place of        |  7 −4 |
//          | −202  283 |                           | −4  6 |
//
// Near an edge of position 0 and slope 0 a shape is a multiple of i² plus one of i³, i counting nodes from the edge. What
// A takes for such shapes, for it is exactly 0 there, is i² + δ and i³ + γi instead: as if the edge stood off by δ/2 h²x''
// and were turned by γ/6 h²x'''. Both are of second order, and no symmetric A has both 0: to sum i² A i³ by parts gives
// 3δ + γ = −1, whatever the corner. The plain one is δ = 0, γ = −1, which makes every plate too soft. But where the
// load is spread x'' and x''' are of opposite signs at an edge, so that the two errors can cancel: for the clamped beam
// they do at δ = −1/5. PATCH_ACCURATE is δ = −1/6, γ = −1/2, which halves γ for whatever shape; the three numbers of the
// corner follow from these two. On 17 nodes ten of the literature's cases are two to ten times nearer to their limit.
// Since A ≥ B² still, L is positive definite wherever the plain one is known to be. The price: places beside an edge
// are of order h² off, δ/2 h²x'', and no longer h³, and shapes whose x'' and x''' have one sign there up to three times
// as far.
//
// One-sided ends can be of third order, but are not symmetric, which the factors of the host and the modes of the device
// live by. Symmetric ones from D2ᵀ W D2, W the weights of a better quadrature, are off pointwise where they are
// right on average, and of first order (weights 5/8, 7/8: 0.385 % at 65 nodes; 3/8, 7/6, 23/24: 1.2 %).
//
// One step. Both schemes are the same solve at a point inside the step, θ = 1 (implicit) or ½ (newmark):
//
//     (L + μ) w = f + g + μ x + ν V        μ = (2ρ + η dt)/(2θ²dt²)
//     V⁺ = V + (w − x − θ dt V)/(θ²dt)     x⁺ = x + dt((1 − θ)V + θV⁺)
//
// g is the part of the edges. With e = w − x − θ dt V this reads (L + μ) e = f + g − ηV − L(x + θ dt V), V⁺ = V +
// e/(θ²dt).
//
// * implicit: w = x⁺; multiplied by 2 dt² h⁴ it is the literature's Eq. 6. V is the backward difference (x − x⁻)/dt,
//   the edges are those at t + dt, f is that at t. First order in dt: it damps a mode of eigenvalue λ as if η were η +
//   dt λ.
// * newmark: the average acceleration scheme, space at (x⁺ + 2x + x⁻)/4. V is the velocity at t, the edges are the mean
//   of those at t and t + dt, f is that at t + dt/2. Second order, no damping of its own: what is rough in the start
//   rings on.
//
// Both are stable for every dt where L has no negative eigenvalue and ρ, η are not negative (see patch_diagnose.h).
// With ρ = 0 the implicit scheme moves in double steps; with ρ = η = 0 it gives the static shape at once.
#ifndef SCN_RUNTIME_PATCH_MODEL_H
#define SCN_RUNTIME_PATCH_MODEL_H

#include <stdbool.h>
#include <stddef.h>

#define PATCH_MIN_NODES 5
#define PATCH_MAX_NODES 257

typedef enum PatchScheme { PATCH_IMPLICIT, PATCH_NEWMARK } PatchScheme;

// How A ends at an edge: as the literature's does, or by the other corner above.
typedef enum PatchClosure { PATCH_PLAIN, PATCH_ACCURATE } PatchClosure;

// An end of A: what is beside the diagonal's 6 and its neighbours' −4 at the line of unknowns next to the edge (`own`, and
// `pair` between it and the second line) and at the second (`second`), and what the two have of the edge's position and
// of h times its slope away from the edge.
typedef struct PatchEnd {
    double own, pair, second;
    double near_position, near_slope, far_position, far_slope;
} PatchEnd;

const PatchEnd *patch_end(PatchClosure closure);

// Row k (0 … m − 1) of A: what it has at k − 1, k and k + 1. It has 1 at k − 2 and k + 2.
void patch_line(PatchClosure closure, int m, int k, double line[3]);

// Which components take the slopes given on the edges. With PATCH_TANGENTS_X3 only the third does; the first two have
// the slope of the straight line to the opposite edge, so that x1 = u, x2 = v stays as it is and the patch is a height
// field.
typedef enum PatchTangents { PATCH_TANGENTS_X3, PATCH_TANGENTS_ALL } PatchTangents;

typedef struct PatchStiffness {
    double b, c, d;
} PatchStiffness;

// A node that is held at a place. Edge nodes are held by their edge and cannot be pinned.
typedef struct PatchPin {
    int i, j; // 1 … nodes − 2
    double to[3];
} PatchPin;

typedef struct PatchModel {
    int nodes;   // a side
    double step; // dt, seconds
    PatchStiffness stiffness[3];
    double density, damping; // ρ, η
    double force[3];         // the same at all nodes
    PatchScheme scheme;
    PatchClosure closure;
    PatchTangents tangents;
    const PatchPin *pins; // borrowed; at most one a node
    int pin_count;
    double limit;    // a coordinate larger than this means that the patch diverges; 0: PATCH_LIMIT
    double accuracy; // wanted relative accuracy of the slowest mode's motion, for patch_diagnose(); 0: not asked
    bool insist; // solve although L is not positive definite, to study that: the direct solver takes any matrix then
} PatchModel;

#define PATCH_LIMIT 1e6

// Whether two models are the same; whether they are but for the force, which needs no more than a right side.
bool patch_model_same(const PatchModel *a, const PatchModel *b);
bool patch_model_pushed(const PatchModel *a, const PatchModel *b); // and the force of b is finite

// The literature's base case: b = d = 1, c = 2, ρ = 0.1, η = 1, f = (0, 0, 800), a step of a millisecond, implicit.
PatchModel patch_model_base(int nodes);

// The four edges. Positions win over each other at corners in this order: u = 0, u = 1, v = 0, v = 1.
typedef enum PatchEdge { PATCH_U0, PATCH_U1, PATCH_V0, PATCH_V1, PATCH_EDGES } PatchEdge;

// Positions and slopes along the edges: value k of an edge is at v (u) = k h. The slope is ∂x/∂u on u = 0 and u = 1,
// ∂x/∂v on v = 0 and v = 1, toward growing u and v.
typedef struct PatchEdges {
    int nodes;
    double *position[PATCH_EDGES][3]; // nodes values each
    double *tangent[PATCH_EDGES][3];  // nodes values each; the ends are not used
} PatchEdges;

// Edges of the flat unit square x1 = u, x2 = v, x3 = 0 with slopes 0. NULL where the memory is not there. The caller
// frees them.
PatchEdges *patch_edges_new(int nodes);
void patch_edges_free(PatchEdges *edges);                      // NULL is nothing
void patch_edges_copy(PatchEdges *to, const PatchEdges *from); // of the same size

// Moves `edges` on the way to `other`: 0 leaves them, 1 makes them equal. Of the same size.
void patch_edges_mix(PatchEdges *edges, const PatchEdges *other, double fraction);

// All values of the edges in one run, for saving them: the first of patch_edges_count(nodes).
double *patch_edges_values(const PatchEdges *edges);
size_t patch_edges_count(int nodes);

// The slope that counts at place k of an edge, by the rule of PatchTangents.
double patch_edges_slope(const PatchEdges *edges, PatchTangents rule, PatchEdge edge, int component, int k);

// Writes the edges' positions into the frame of a grid of nodes.
void patch_edges_place(const PatchEdges *edges, int component, double *x);

// The numbers of a step.
typedef struct PatchCoefficients {
    double theta, mu, nu;
} PatchCoefficients;

PatchCoefficients patch_coefficients(const PatchModel *model);

// y = L x + `shift` x over unknowns, edges at zero.
void patch_apply(const PatchStiffness *stiffness, PatchClosure closure, int nodes, double shift, const double *x,
                 double *y);

// The entry of L at a node's own place, and of the row towards node (i + p, j + q), for |p| + |q| <= 2. 0 where that is
// not an unknown.
double patch_entry(const PatchStiffness *stiffness, PatchClosure closure, int nodes, int i, int j, int p, int q);

// g = −L x over unknowns, of an x that is zero inside and given on the edges: what the edges add to the right side.
// Only the two rows and columns next to an edge are not zero.
void patch_edge_load(const PatchModel *model, const PatchEdges *edges, int component, double *g);

#endif
