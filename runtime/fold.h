// One quadric seen in one view: its record and its box (kernels/shared.h says what they mean).
#ifndef SCN_RUNTIME_FOLD_H
#define SCN_RUNTIME_FOLD_H

#include <stdbool.h>

#include "kernels/shared.h"
#include "runtime/camera.h"
#include "runtime/faces.h"

struct Projection;

// W² Q = ww w² + 2 w (uw U + vw V + w1) + uu U² + 2 uv U V + vv V² + 2 u1 U + 2 v1 V + one.
typedef struct ScreenQuadric {
    double uu, uv, uw, u1, vv, vw, v1, ww, w1, one;
} ScreenQuadric;

// Columns of the map from (U, V, w, 1) to homogeneous world coordinates.
typedef struct ScreenMap {
    double column[4][4];
} ScreenMap;

void fold_map(const struct Projection *projection, ScreenMap *map);
void fold_quadric(const double q[10], const ScreenMap *map, ScreenQuadric *folded);
void fold_add(ScreenQuadric *sum, double factor, const ScreenQuadric *folded);

// The largest of its coefficients.
double fold_largest(const ScreenQuadric *folded);

// The record of factor * Q. A factor of 0 leaves it open: one that makes it safe for floats. Returns the factor.
double fold_record(const ScreenQuadric *folded, double factor, QuadricRecord *record);

// The record of a slab or a half-space, by its planes: what depends on one alone is the same for all that have it. Returns the factor, as fold_record().
double fold_planes(const LeafFace *face, const struct Projection *projection, QuadricRecord *record);

// The record of a leaf that is not shown: empty.
void fold_hidden(QuadricRecord *record);

// Whether a perturbation is so strong that polynomials of its pieces have coefficients that are much larger than the base is in its support, whose box that is.
bool fold_strong(const ScreenQuadric *base, const ScreenQuadric *perturbation, double strength, const Box *support,
                 double kappa);

// Where in (U, V, w) it is >= 0: a box that holds it, with a margin for what floats may add; infinite sides where it has no end.
void fold_box(const ScreenQuadric *folded, Box *box);

// Where it is < 0, alike.
void fold_outside_box(const ScreenQuadric *folded, Box *box);

#endif
