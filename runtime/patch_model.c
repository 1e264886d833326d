// The stencil is written once, as the table of patch_entry(); patch_apply() walks it with the borders folded back, and
// the edges' load is gathered the other way round, from each edge value to the unknowns whose stencils reach it. That
// is why the load costs O(nodes) and not O(nodes²): it is computed for every step whose edges move.
#include "runtime/patch_model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool same_but_force(const PatchModel *a, const PatchModel *b)
{
    if (a->nodes != b->nodes || a->pin_count != b->pin_count) return false;
    for (int k = 0; k < a->pin_count; k++) {
        const PatchPin *p = &a->pins[k], *q = &b->pins[k];
        if (p->i != q->i || p->j != q->j || memcmp(p->to, q->to, sizeof p->to)) return false;
    }
    return a->step == b->step && a->density == b->density && a->damping == b->damping && a->scheme == b->scheme &&
           a->closure == b->closure && a->tangents == b->tangents && a->limit == b->limit &&
           a->accuracy == b->accuracy && a->insist == b->insist &&
           !memcmp(a->stiffness, b->stiffness, sizeof a->stiffness);
}

bool patch_model_pushed(const PatchModel *a, const PatchModel *b)
{
    for (int c = 0; c < 3; c++)
        if (!isfinite(b->force[c])) return false;
    return same_but_force(a, b);
}

bool patch_model_same(const PatchModel *a, const PatchModel *b)
{
    return same_but_force(a, b) && !memcmp(a->force, b->force, sizeof a->force);
}

PatchModel patch_model_base(int nodes)
{
    PatchStiffness base = {1, 2, 1};
    return (PatchModel){
        .nodes = nodes,
        .step = 1e-3,
        .stiffness = {base, base, base},
        .density = 0.1,
        .damping = 1,
        .force = {0, 0, 800},
    };
}

size_t patch_edges_count(int nodes)
{
    return (size_t)PATCH_EDGES * 3 * 2 * (size_t)nodes;
}

PatchEdges *patch_edges_new(int nodes)
{
    PatchEdges *edges = malloc(sizeof *edges);
    double *values = calloc(patch_edges_count(nodes), sizeof *values);
    if (!edges || !values) {
        free(edges);
        free(values);
        return NULL;
    }
    edges->nodes = nodes;
    for (int e = 0; e < PATCH_EDGES; e++)
        for (int c = 0; c < 3; c++) {
            edges->position[e][c] = values;
            edges->tangent[e][c] = values + nodes;
            values += 2 * nodes;
        }
    for (int k = 0; k < nodes; k++) {
        double s = k / (double)(nodes - 1);
        edges->position[PATCH_U1][0][k] = edges->position[PATCH_V1][1][k] = 1;
        edges->position[PATCH_U0][1][k] = edges->position[PATCH_U1][1][k] = s;
        edges->position[PATCH_V0][0][k] = edges->position[PATCH_V1][0][k] = s;
    }
    return edges;
}

double *patch_edges_values(const PatchEdges *edges)
{
    return edges->position[0][0];
}

void patch_edges_free(PatchEdges *edges)
{
    if (!edges) return;
    free(patch_edges_values(edges));
    free(edges);
}

void patch_edges_copy(PatchEdges *to, const PatchEdges *from)
{
    memcpy(patch_edges_values(to), patch_edges_values(from), patch_edges_count(to->nodes) * sizeof(double));
}

void patch_edges_mix(PatchEdges *edges, const PatchEdges *other, double fraction)
{
    double *to = patch_edges_values(edges);
    const double *from = patch_edges_values(other);
    for (size_t k = 0; k < patch_edges_count(edges->nodes); k++) to[k] += fraction * (from[k] - to[k]);
}

static bool is_u(PatchEdge edge)
{
    return edge <= PATCH_U1;
}

double patch_edges_slope(const PatchEdges *edges, PatchTangents rule, PatchEdge edge, int component, int k)
{
    if (rule == PATCH_TANGENTS_ALL || component == 2) return edges->tangent[edge][component][k];
    PatchEdge low = is_u(edge) ? PATCH_U0 : PATCH_V0;
    return edges->position[low + 1][component][k] - edges->position[low][component][k];
}

void patch_edges_place(const PatchEdges *edges, int component, double *x)
{
    int n = edges->nodes;
    // In this order the edges of u have the corners.
    for (int k = 0; k < n; k++) {
        x[k * n] = edges->position[PATCH_V0][component][k];
        x[k * n + n - 1] = edges->position[PATCH_V1][component][k];
    }
    memcpy(x + (size_t)(n - 1) * n, edges->position[PATCH_U1][component], (size_t)n * sizeof *x);
    memcpy(x, edges->position[PATCH_U0][component], (size_t)n * sizeof *x);
}

PatchCoefficients patch_coefficients(const PatchModel *model)
{
    double theta = model->scheme == PATCH_NEWMARK ? 0.5 : 1, dt = model->step, rho = model->density,
           eta = model->damping;
    return (PatchCoefficients){
        .theta = theta,
        .mu = (2 * rho + eta * dt) / (2 * theta * theta * dt * dt),
        .nu = model->scheme == PATCH_NEWMARK ? 2 * rho / dt : (2 * rho - eta * dt) / (2 * dt),
    };
}

const PatchEnd *patch_end(PatchClosure closure)
{
    // What makes rows exact for i² − 1/6 and i³ − i/2, symmetric; the rest makes them exact for 1 and i.
    static const PatchEnd ends[] = {
        [PATCH_PLAIN] = {.own = 1, .near_position = -4, .near_slope = -2, .far_position = 1},
        [PATCH_ACCURATE] = {.own = 431.0 / 47 - 6,
                            .pair = 4 - 202.0 / 47,
                            .second = 283.0 / 47 - 6,
                            .near_position = -276.0 / 47,
                            .near_slope = -168.0 / 47,
                            .far_position = 60.0 / 47,
                            .far_slope = 12.0 / 47},
    };
    return &ends[closure];
}

void patch_line(PatchClosure closure, int m, int k, double line[3])
{
    const PatchEnd *end = patch_end(closure);
    line[0] = line[2] = -4;
    line[1] = 6;
    // On few nodes a row can be beside both ends.
    for (int side = 0; side < 2; side++) {
        int at = side ? m - 1 - k : k;
        if (at == 0) line[1] += end->own;
        if (at == 1) line[1] += end->second;
        if (at == 0) line[side ? 0 : 2] += end->pair;
        if (at == 1) line[side ? 2 : 0] += end->pair;
    }
}

double patch_entry(const PatchStiffness *stiffness, PatchClosure closure, int nodes, int i, int j, int p, int q)
{
    int last = nodes - 2;
    if (i + p < 1 || i + p > last || j + q < 1 || j + q > last) return 0;
    double h = 1.0 / (nodes - 1), scale = 1 / (h * h * h * h), value = 0;
    double b = stiffness->b, c = stiffness->c, d = stiffness->d;
    double along_u[3], along_v[3];
    patch_line(closure, last, i - 1, along_u);
    patch_line(closure, last, j - 1, along_v);
    if (p == 0 && q == 0) {
        value = b * along_u[1] + 4 * c + d * along_v[1];
    } else if (q == 0) {
        value = abs(p) == 1 ? b * along_u[p + 1] - 2 * c : b;
    } else if (p == 0) {
        value = abs(q) == 1 ? d * along_v[q + 1] - 2 * c : d;
    } else if (abs(p) == 1 && abs(q) == 1) {
        value = c;
    }
    return value * scale;
}

// One row of unknowns, number i from 0; rows that are not there count as zero.
static void apply_row(const PatchStiffness *s, PatchClosure closure, int m, int i, double shift, const double *x,
                      double *y)
{
    // Two zeros on both sides let the inner loop run without a test.
    double padded[5][PATCH_MAX_NODES + 4];
    for (int k = 0; k < 5; k++) {
        int at = i + k - 2;
        memset(padded[k], 0, (size_t)(m + 4) * sizeof *x);
        if (at >= 0 && at < m) memcpy(padded[k] + 2, x + (size_t)at * m, (size_t)m * sizeof *x);
    }
    double n = m + 1, scale = n * n * n * n, b = s->b * scale, c = s->c * scale, d = s->d * scale;
    double line[3];
    patch_line(closure, m, i, line);
    const double *up2 = padded[0] + 2, *up = padded[1] + 2, *own = padded[2] + 2, *low = padded[3] + 2,
                 *low2 = padded[4] + 2;
    for (int j = 0; j < m; j++) {
        double u4 = up2[j] + line[0] * up[j] + line[1] * own[j] + line[2] * low[j] + low2[j];
        double v4 = own[j - 2] - 4 * own[j - 1] + 6 * own[j] - 4 * own[j + 1] + own[j + 2];
        double mixed = up[j - 1] - 2 * up[j] + up[j + 1] - 2 * (own[j - 1] - 2 * own[j] + own[j + 1]) + low[j - 1] -
                       2 * low[j] + low[j + 1];
        y[j] = b * u4 + c * mixed + d * v4 + shift * own[j];
    }
    const PatchEnd *end = patch_end(closure);
    y[0] += d * (end->own * own[0] + end->pair * own[1]);
    y[1] += d * (end->pair * own[0] + end->second * own[1]);
    y[m - 1] += d * (end->own * own[m - 1] + end->pair * own[m - 2]);
    y[m - 2] += d * (end->pair * own[m - 1] + end->second * own[m - 2]);
}

void patch_apply(const PatchStiffness *stiffness, PatchClosure closure, int nodes, double shift, const double *x,
                 double *y)
{
    int m = nodes - 2;
    for (int i = 0; i < m; i++) apply_row(stiffness, closure, m, i, shift, x, y + (size_t)i * m);
}

// The load of one edge on the line of unknowns next to it and on the one after that, both at place k of the edge.
//
// With p the edge's positions and s its slope, the plain fourth difference across the edge reaches p with −4 from the near
// line, and the value outside, x[1] ∓ 2h s, with 1; from the far line it reaches p with 1. The mixed difference of the
// near line has p's second difference along the edge. Fourth differences along the edge do not leave the line.
static void edge_lines(const PatchModel *model, const PatchEdges *edges, PatchEdge edge, int component, int k,
                       double *near, double *far)
{
    const PatchStiffness *s = &model->stiffness[component];
    double n = model->nodes - 1, scale = n * n * n * n, across = is_u(edge) ? s->b : s->d;
    const double *p = edges->position[edge][component];
    double slope = patch_edges_slope(edges, model->tangents, edge, component, k);
    const PatchEnd *end = patch_end(model->closure);
    double away = (edge == PATCH_U0 || edge == PATCH_V0 ? 1 : -1) * slope / n;
    *near = -scale *
            (across * (end->near_slope * away + end->near_position * p[k]) + s->c * (p[k - 1] - 2 * p[k] + p[k + 1]));
    *far = -scale * across * (end->far_position * p[k] + end->far_slope * away);
}

// A corner's position is in the mixed difference of one unknown. The edge of u has counted its own value there, the
// edge of v as well.
static double corner_twice(const PatchModel *model, const PatchEdges *edges, int component, PatchEdge v_edge, int end)
{
    double n = model->nodes - 1, scale = n * n * n * n;
    return scale * model->stiffness[component].c * edges->position[v_edge][component][end ? model->nodes - 1 : 0];
}

void patch_edge_load(const PatchModel *model, const PatchEdges *edges, int component, double *g)
{
    int m = model->nodes - 2;
    memset(g, 0, (size_t)m * m * sizeof *g);
    for (int k = 1; k <= m; k++) {
        double near, far;
        double *row = g + k - 1, *column = g + (size_t)(k - 1) * m;
        edge_lines(model, edges, PATCH_U0, component, k, &near, &far);
        row[0] += near;
        row[m] += far;
        edge_lines(model, edges, PATCH_U1, component, k, &near, &far);
        row[(size_t)(m - 1) * m] += near;
        row[(size_t)(m - 2) * m] += far;
        edge_lines(model, edges, PATCH_V0, component, k, &near, &far);
        column[0] += near;
        column[1] += far;
        edge_lines(model, edges, PATCH_V1, component, k, &near, &far);
        column[m - 1] += near;
        column[m - 2] += far;
    }
    for (int end = 0; end < 2; end++) {
        double *row = g + (end ? (size_t)(m - 1) * m : 0);
        row[0] += corner_twice(model, edges, component, PATCH_V0, end);
        row[m - 1] += corner_twice(model, edges, component, PATCH_V1, end);
    }
}
