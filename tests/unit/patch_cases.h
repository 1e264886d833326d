// The eleven configurations of the literature (You & Zhang, Deformation of Dynamic Surfaces, figures 2 to 4), for the
// tests of patches.
#ifndef SCN_TESTS_PATCH_CASES_H
#define SCN_TESTS_PATCH_CASES_H

#include <math.h>
#include <stdlib.h>

#include "runtime/patch_model.h"

typedef struct PatchCase {
    const char *name;
    double b, c, d, density, damping, force;
    double slope[PATCH_EDGES]; // b1, b3, b5, b7: of x3 on u = 0, u = 1, v = 0, v = 1
} PatchCase;

static const PatchCase patch_cases[] = {
    {"2a", 1, 2, 1, 0.1, 1, 800, {0}},
    {"2b", 10, 2, 1, 0.1, 1, 800, {0}},
    {"2c", 1, -1.5, 1, 0.1, 1, 800, {0}},
    {"2d", 1, 2, -0.001, 0.1, 1, 800, {0}},
    {"3a", 1, 2, 1, 0.1, 1, 800, {3, 0, 0, 0}},
    {"3b", 1, 2, 1, 0.1, 1, 800, {0, 10, 0, 0}},
    {"3c", 1, 2, 1, 0.1, 1, 800, {3, 3, 3, 0}},
    {"3d", 1, 2, 1, 0.1, 1, 800, {-3, 3, -3, 3}},
    {"4i", 1, 2, 1, 0.1, 1, -800, {0}},
    {"4j", 1, 2, 1, 0.1, 20, 800, {0}},
    {"4k", 1, 2, 1, 1, 1, 800, {0}},
};
#define PATCH_CASES (int)(sizeof patch_cases / sizeof *patch_cases)

static inline PatchModel patch_case_model(const PatchCase *from, int nodes, double step)
{
    PatchModel model = patch_model_base(nodes);
    model.step = step;
    for (int c = 0; c < 3; c++) model.stiffness[c] = (PatchStiffness){from->b, from->c, from->d};
    model.density = from->density;
    model.damping = from->damping;
    model.force[2] = from->force;
    return model;
}

static inline PatchEdges *patch_case_edges(const PatchCase *from, int nodes)
{
    PatchEdges *edges = patch_edges_new(nodes);
    if (!edges) abort();
    for (int e = 0; e < PATCH_EDGES; e++)
        for (int k = 0; k < nodes; k++) edges->tangent[e][2][k] = from->slope[e];
    return edges;
}

// Seven places off the centre, in sixteenths; none is another with u and v exchanged.
static const int patch_probes[7][2] = {{2, 5}, {3, 12}, {7, 2}, {9, 14}, {11, 6}, {13, 9}, {5, 8}};

// Index of the node of a probe on a grid of 16·k + 1 nodes.
static inline int patch_probe_node(int probe, int nodes)
{
    int k = (nodes - 1) / 16;
    return patch_probes[probe][0] * k * nodes + patch_probes[probe][1] * k;
}

// Numbers that look random and are always the same: −1 … 1.
static inline double patch_noise(unsigned *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / 8388608.0 - 1;
}

#endif
