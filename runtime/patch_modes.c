// Each kind of mode is an eigenproblem of half the size, which is a quarter of the work, and the kinds are exact: the
// eigenvectors of the whole matrix would mix an even with an odd mode wherever rounding lets them.
#include "runtime/patch_modes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lapacke.h>

static double beam_entry(PatchClosure closure, int m, int r, int c)
{
    double line[3];
    patch_line(closure, m, r, line);
    int distance = abs(r - c);
    return distance < 2 ? line[c - r + 1] : distance == 2;
}

static double second_entry(PatchClosure closure, int m, int r, int c)
{
    int distance = abs(r - c);
    return distance == 0 ? 2 : distance == 1 ? -1 : 0;
}

// Entry (r, c) of a matrix between folded values of one kind, sign +1 (even) or −1 (odd).
static double folded_entry(double (*entry)(PatchClosure, int, int, int), PatchClosure closure, int m, int r, int c,
                           int sign)
{
    int r2 = m - 1 - r, c2 = m - 1 - c;
    double sum = entry(closure, m, r, c) + entry(closure, m, r2, c2) +
                 sign * (entry(closure, m, r, c2) + entry(closure, m, r2, c));
    // A middle node is its own mirror and counts once, with weight 1 for 1/√2 + 1/√2.
    double weight = (r == r2 ? sqrt(0.5) : 1) * (c == c2 ? sqrt(0.5) : 1);
    return 0.5 * sum * weight;
}

// The modes of one kind: `size` of them into lambda and q, B in their basis into b.
static bool make_kind(PatchModes *modes, PatchClosure closure, int size, int sign, double *lambda, double *beta,
                      double *q, double *b)
{
    int m = modes->m, half = modes->half;
    double *vectors = malloc(((size_t)2 * size * size + size) * sizeof *vectors);
    if (!vectors) return false;
    double *product = vectors + (size_t)size * size, *values = product + (size_t)size * size;
    for (int r = 0; r < size; r++)
        for (int c = 0; c < size; c++) vectors[r * size + c] = folded_entry(beam_entry, closure, m, r, c, sign);
    bool ok = !LAPACKE_dsyev(LAPACK_COL_MAJOR, 'V', 'U', size, vectors, size, values);

    double n = m + 1;
    for (int a = 0; ok && a < size; a++) { // vector a is column a: vectors[a * size …]
        lambda[a] = values[a] * n * n * n * n;
        for (int r = 0; r < size; r++) q[r * half + a] = vectors[a * size + r];
        for (int r = 0; r < size; r++) {
            double sum = 0;
            for (int c = r > 1 ? r - 2 : 0; c < size && c <= r + 2; c++)
                sum += folded_entry(second_entry, closure, m, r, c, sign) * vectors[a * size + c];
            product[a * size + r] = sum;
        }
    }
    for (int a = 0; ok && a < size; a++)
        for (int k = 0; k <= a; k++) {
            double sum = 0;
            for (int r = 0; r < size; r++) sum += vectors[k * size + r] * product[a * size + r];
            b[a * half + k] = b[k * half + a] = sum * n * n;
            if (k == a) beta[a] = sum * n * n;
        }
    free(vectors);
    return ok;
}

PatchModes *patch_modes_new(int nodes, PatchClosure closure, Failure *failure)
{
    PatchModes *modes = calloc(1, sizeof *modes);
    if (!modes) goto failed;
    modes->nodes = nodes;
    modes->m = nodes - 2;
    modes->even = (modes->m + 1) / 2;
    modes->odd = modes->m / 2;
    modes->half = (modes->even + PATCH_MODE_PAD - 1) / PATCH_MODE_PAD * PATCH_MODE_PAD;
    modes->order = 2 * modes->half;
    size_t square = (size_t)modes->half * modes->half;
    modes->lambda = calloc(2 * (size_t)modes->order + 4 * square, sizeof(double));
    if (!modes->lambda) goto failed;
    modes->beta = modes->lambda + modes->order;
    modes->q_even = modes->beta + modes->order;
    modes->q_odd = modes->q_even + square;
    modes->b_even = modes->q_odd + square;
    modes->b_odd = modes->b_even + square;
    for (int a = 0; a < modes->order; a++) modes->lambda[a] = 1;
    if (make_kind(modes, closure, modes->even, 1, modes->lambda, modes->beta, modes->q_even, modes->b_even) &&
        make_kind(modes, closure, modes->odd, -1, modes->lambda + modes->half, modes->beta + modes->half, modes->q_odd,
                  modes->b_odd))
        return modes;
failed:
    patch_modes_free(modes);
    fail(failure, "out of memory for the modes of a patch of %d nodes a side", nodes);
    return NULL;
}

void patch_modes_free(PatchModes *modes)
{
    if (!modes) return;
    free(modes->lambda);
    free(modes);
}

// Folds count values, `step` apart, into half + half values, `out_step` apart.
static void fold(const PatchModes *modes, const double *x, int step, double *y, int out_step)
{
    int m = modes->m;
    for (int r = 0; r < modes->odd; r++) {
        double low = x[(size_t)r * step], high = x[(size_t)(m - 1 - r) * step];
        y[(size_t)r * out_step] = (low + high) * sqrt(0.5);
        y[(size_t)(modes->half + r) * out_step] = (low - high) * sqrt(0.5);
    }
    if (modes->even > modes->odd) y[(size_t)modes->odd * out_step] = x[(size_t)modes->odd * step];
}

static void unfold(const PatchModes *modes, const double *y, int step, double *x, int out_step)
{
    int m = modes->m;
    for (int r = 0; r < modes->odd; r++) {
        double even = y[(size_t)r * step], odd = y[(size_t)(modes->half + r) * step];
        x[(size_t)r * out_step] = (even + odd) * sqrt(0.5);
        x[(size_t)(m - 1 - r) * out_step] = (even - odd) * sqrt(0.5);
    }
    if (modes->even > modes->odd) x[(size_t)modes->odd * out_step] = y[(size_t)modes->odd * step];
}

// y = Q x for each column of x (order × order) where `forward` is false, Qᵀ x where it is true.
static void rotate(const PatchModes *modes, const double *x, double *y, bool forward)
{
    int half = modes->half, order = modes->order;
    memset(y, 0, (size_t)order * order * sizeof *y);
    for (int kind = 0; kind < 2; kind++) {
        const double *q = kind ? modes->q_odd : modes->q_even;
        const double *from = x + (size_t)kind * half * order;
        double *to = y + (size_t)kind * half * order;
        int size = kind ? modes->odd : modes->even;
        for (int r = 0; r < size; r++)
            for (int a = 0; a < size; a++) {
                double value = q[r * half + a];
                const double *source = from + (size_t)(forward ? r : a) * order;
                double *target = to + (size_t)(forward ? a : r) * order;
                for (int k = 0; k < order; k++) target[k] += value * source[k];
            }
    }
}

static void transpose(int order, const double *x, double *y)
{
    for (int r = 0; r < order; r++)
        for (int c = 0; c < order; c++) y[(size_t)c * order + r] = x[(size_t)r * order + c];
}

void patch_modes_of_nodes(const PatchModes *modes, const double *x, double *y, double *work)
{
    int m = modes->m, order = modes->order;
    double *other = work + (size_t)order * order;
    // The rows of x are folded along v into the columns of `work`, so the first product is over v.
    memset(work, 0, (size_t)order * order * sizeof *work);
    memset(y, 0, (size_t)order * order * sizeof *y);
    for (int i = 0; i < m; i++) fold(modes, x + (size_t)i * m, 1, work + i, order);
    rotate(modes, work, other, true);
    for (int a = 0; a < order; a++) fold(modes, other + (size_t)a * order, 1, y + a, order);
    rotate(modes, y, work, true);
    memcpy(y, work, (size_t)order * order * sizeof *y);
}

void patch_modes_to_nodes(const PatchModes *modes, const double *y, double *x, double *work)
{
    int m = modes->m, order = modes->order;
    double *other = work + (size_t)order * order;
    rotate(modes, y, work, false);
    transpose(order, work, other);
    rotate(modes, other, work, false);
    // Row r of `work` is folded node r along v, over folded nodes along u; row i of `other` becomes node i along u,
    // over folded v.
    for (int r = 0; r < order; r++) unfold(modes, work + (size_t)r * order, 1, other + r, order);
    for (int i = 0; i < m; i++) unfold(modes, other + (size_t)i * order, 1, x + (size_t)i * m, 1);
}

void patch_modes_row(const PatchModes *modes, int node, double *row)
{
    int half = modes->half, mirror = modes->m - 1 - node;
    memset(row, 0, (size_t)modes->order * sizeof *row);
    int folded = node < mirror ? node : mirror;
    double weight = node == mirror ? 1 : sqrt(0.5), sign = node < mirror ? 1 : -1;
    for (int a = 0; a < modes->even; a++) row[a] = weight * modes->q_even[folded * half + a];
    if (node == mirror) return;
    for (int a = 0; a < modes->odd; a++) row[half + a] = sign * weight * modes->q_odd[folded * half + a];
}

// y += u vᵀ.
static void add_outer(int order, const double *u, const double *v, double *y)
{
    for (int a = 0; a < order; a++)
        for (int c = 0; c < order; c++) y[(size_t)a * order + c] += u[a] * v[c];
}

// The modes of a line of nodes.
static void line_modes(const PatchModes *modes, const double *x, double *y)
{
    int order = modes->order, half = modes->half;
    double folded[PATCH_MAX_NODES + 2 * PATCH_MODE_PAD] = {0};
    fold(modes, x, 1, folded, 1);
    memset(y, 0, (size_t)order * sizeof *y);
    for (int r = 0; r < modes->even; r++)
        for (int a = 0; a < modes->even; a++) y[a] += modes->q_even[r * half + a] * folded[r];
    for (int r = 0; r < modes->odd; r++)
        for (int a = 0; a < modes->odd; a++) y[half + a] += modes->q_odd[r * half + a] * folded[half + r];
}

void patch_modes_of_frame(const PatchModes *modes, const double *x, double *y, double *work)
{
    int m = modes->m, order = modes->order;
    const int outer[4] = {0, 1, m - 2, m - 1};
    double row[PATCH_MAX_NODES + 2 * PATCH_MODE_PAD], line[PATCH_MAX_NODES];
    memset(y, 0, (size_t)order * order * sizeof *y);
    for (int k = 0; k < 4; k++) {
        if (k && outer[k] == outer[k - 1]) continue; // three rows in all
        patch_modes_row(modes, outer[k], row);
        line_modes(modes, x + (size_t)outer[k] * m, work);
        add_outer(order, row, work, y);
        // What the rows have counted is not counted by the columns.
        for (int i = 0; i < m; i++) line[i] = i < 2 || i >= m - 2 ? 0 : x[(size_t)i * m + outer[k]];
        line_modes(modes, line, work);
        add_outer(order, work, row, y);
    }
}
