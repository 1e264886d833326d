// Outer bounds: a box that certainly holds an object.
//
// From a plan and a frame's values, in double, rounded outwards a little (1e-9 of the size), so that a box of an
// object is never too small. A side without an end is infinite; what is certainly empty has low > high. What rounding
// may have tilted or bent counts as straight (1e-12): a cylinder along an axis is bounded across it. For
//
//   a quadric        the exact box of an ellipsoid, cylinder, slab, half-space or paraboloid; all others have no end
//   an intersection  the meeting of its parts' boxes; where that has no end, also what planes bound together, cylinders
//                    between planes, and sums of two quadrics (where both are positive, so is their sum): a turned box,
//                    a cylinder or a cone with caps are bounded by what none of their parts bounds alone
//   a free form      the hull of its base and of where perturbations add to it
//   a general field  what intervals cannot exclude (tape_bounds() of compiler/tape.h)
//   a union          the hull of its parts
#ifndef SCN_COMPILER_BOUNDS_H
#define SCN_COMPILER_BOUNDS_H

#include <stdbool.h>

#include "compiler/plan.h"

typedef struct Bounds {
    double low[3], high[3];
} Bounds;

Bounds bounds_of_quadric(const double q[10]); // of F >= 0

// Makes the box of an intersection smaller by what quadrics bound together that meet in it (F >= 0 of each).
void bounds_cut(Bounds *box, const double *const *quadrics, uint32_t count);

Bounds bounds_of_leaf(const Plan *plan, const double *values, const PlanLeaf *leaf);
Bounds bounds_of_component(const Plan *plan, const double *values, uint32_t component);
Bounds bounds_of_plan(const Plan *plan, const double *values); // of the whole scene
Bounds bounds_of_object(const Plan *plan, const double *values,
                        uint32_t object); // of the scene's components that have leaves of it

bool bounds_empty(const Bounds *b);
bool bounds_finite(const Bounds *b); // and not empty
bool bounds_meet(const Bounds *a, const Bounds *b);

#endif
