// LAPACK's band storage: column c of the matrix is a run of `rows` values with the diagonal at place `diagonal`, so
// entry (r, c) is at c * rows + diagonal + r − c. Cholesky keeps the lower half, diagonal 0; the general factor keeps
// both, and above them as many places more, which exchanges of rows fill. The unknowns are numbered along v first, so
// the band is as narrow as the grid allows.
#include "runtime/patch_band.h"

#include <stdlib.h>

#include <lapacke.h>

typedef struct Storage {
    int rows, diagonal;
    double *values; // NULL: not made
} Storage;

struct PatchBand {
    int nodes, m, unknowns;
    Storage half, whole;
    lapack_int *pivots; // of the general factor
    bool general;       // the factor is that
};

static size_t size_of(const PatchBand *band, const Storage *storage)
{
    return (size_t)band->unknowns * (size_t)storage->rows;
}

PatchBand *patch_band_new(int nodes, Failure *failure)
{
    PatchBand *band = calloc(1, sizeof *band);
    if (band) {
        int m = nodes - 2;
        *band = (PatchBand){
            .nodes = nodes, .m = m, .unknowns = m * m, .half = {2 * m + 1, 0, NULL}, .whole = {6 * m + 1, 4 * m, NULL}};
        band->half.values = malloc(size_of(band, &band->half) * sizeof(double));
        if (band->half.values) return band;
    }
    patch_band_free(band);
    fail(failure, "out of memory for the direct solver of a patch of %d nodes a side", nodes);
    return NULL;
}

void patch_band_free(PatchBand *band)
{
    if (!band) return;
    free(band->half.values);
    free(band->whole.values);
    free(band->pivots);
    free(band);
}

static void fill(const PatchBand *band, Storage *storage, const PatchStiffness *stiffness, PatchClosure closure,
                 double mu)
{
    int m = band->m, lowest = -storage->diagonal;
    for (size_t k = 0; k < size_of(band, storage); k++) storage->values[k] = 0;
    for (int i = 1; i <= m; i++)
        for (int j = 1; j <= m; j++) {
            double *diagonal =
                storage->values + (size_t)((i - 1) * m + j - 1) * (size_t)storage->rows + storage->diagonal;
            for (int p = -2; p <= 2; p++)
                for (int q = -2; q <= 2; q++) {
                    int below = p * m + q; // how far the row is under the diagonal
                    // A neighbour beyond the end of its line would be counted as a node of the next line.
                    if (below >= lowest && j + q >= 1 && j + q <= m)
                        diagonal[below] += patch_entry(stiffness, closure, band->nodes, i, j, p, q);
                }
            *diagonal += mu;
        }
}

static void take_out(const PatchBand *band, Storage *storage, int unknown)
{
    int reach = 2 * band->m;
    for (int k = -reach; k <= reach; k++) {
        int other = unknown + k;
        if (other < 0 || other >= band->unknowns) continue;
        double *own = storage->values + (size_t)unknown * (size_t)storage->rows + storage->diagonal;
        double *column = storage->values + (size_t)other * (size_t)storage->rows + storage->diagonal;
        if (k >= -storage->diagonal) own[k] = k == 0;
        if (-k >= -storage->diagonal) column[-k] = k == 0;
    }
}

static void assemble(const PatchBand *band, Storage *storage, const PatchStiffness *stiffness, PatchClosure closure,
                     double mu, const PatchPin *pins, int pin_count)
{
    fill(band, storage, stiffness, closure, mu);
    for (int k = 0; k < pin_count; k++) take_out(band, storage, (pins[k].i - 1) * band->m + pins[k].j - 1);
}

bool patch_band_factor(PatchBand *band, const PatchStiffness *stiffness, PatchClosure closure, double mu,
                       const PatchPin *pins, int pin_count)
{
    band->general = false;
    assemble(band, &band->half, stiffness, closure, mu, pins, pin_count);
    return !LAPACKE_dpbtrf_work(LAPACK_COL_MAJOR, 'L', band->unknowns, 2 * band->m, band->half.values, band->half.rows);
}

bool patch_band_factor_any(PatchBand *band, const PatchStiffness *stiffness, PatchClosure closure, double mu,
                           const PatchPin *pins, int pin_count)
{
    if (patch_band_factor(band, stiffness, closure, mu, pins, pin_count)) return true;
    if (!band->whole.values) band->whole.values = malloc(size_of(band, &band->whole) * sizeof(double));
    if (!band->pivots) band->pivots = malloc((size_t)band->unknowns * sizeof *band->pivots);
    if (!band->whole.values || !band->pivots) return false;
    band->general = true;
    assemble(band, &band->whole, stiffness, closure, mu, pins, pin_count);
    int reach = 2 * band->m;
    return !LAPACKE_dgbtrf_work(LAPACK_COL_MAJOR, band->unknowns, band->unknowns, reach, reach, band->whole.values,
                                band->whole.rows, band->pivots);
}

void patch_band_solve(const PatchBand *band, double *x, int count)
{
    int n = band->unknowns, reach = 2 * band->m;
    if (band->general)
        LAPACKE_dgbtrs_work(LAPACK_COL_MAJOR, 'N', n, reach, reach, count, band->whole.values, band->whole.rows,
                            band->pivots, x, n);
    else
        LAPACKE_dpbtrs_work(LAPACK_COL_MAJOR, 'L', n, reach, count, band->half.values, band->half.rows, x, n);
}
