// The banded factor of L + μ over the unknowns of a patch (runtime/patch_model.h), by LAPACK in double.
//
// Cholesky's, of half-bandwidth 2m for m = nodes − 2 unknowns a row: 4 MB at 65 nodes, 33 MB at 129, 260 MB at 257. A
// matrix that is not positive definite has a general factor with row exchanges, three times as large, if that is asked
// for. Pinned unknowns are taken out: their rows and columns are those of the identity, and solving gives back what the
// right side has there.
//
//     PatchBand *band = patch_band_new(nodes, &failure);
//     if (patch_band_factor(band, &stiffness, closure, mu, pins, count)) patch_band_solve(band, x, 1);
//     patch_band_free(band);
#ifndef SCN_RUNTIME_PATCH_BAND_H
#define SCN_RUNTIME_PATCH_BAND_H

#include "runtime/failure.h"
#include "runtime/patch_model.h"

typedef struct PatchBand PatchBand;

// NULL with `failure` set where the memory is not there.
PatchBand *patch_band_new(int nodes, Failure *failure);
void patch_band_free(PatchBand *band); // NULL is nothing

// False if the matrix is not positive definite; the band is then not to be used for solving.
bool patch_band_factor(PatchBand *band, const PatchStiffness *stiffness, PatchClosure closure, double mu,
                       const PatchPin *pins, int pin_count);

// The same for any matrix that is not singular. False if it is, or if there is no memory.
bool patch_band_factor_any(PatchBand *band, const PatchStiffness *stiffness, PatchClosure closure, double mu,
                           const PatchPin *pins, int pin_count);

// Replaces `count` right sides, one after the other in x, by the solutions.
void patch_band_solve(const PatchBand *band, double *x, int count);

#endif
