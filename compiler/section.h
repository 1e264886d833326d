// Sections: what a plane perpendicular to an axis cuts out of a scene, as a formula (compiler/formula.h).
//
// A point of the plane is inside where it is inside of the scene, F >= 0: of a union inside of one part, of an intersection inside
// of all, of a leaf where its F, computed in float as the formula says, is not negative; what is undefined is outside. Across
// and up in the plane are the two other axes in the order x, y, z:
//
//     plane    across, up
//     x = c    y, z
//     y = c    x, z
//     z = c    x, y
//
// A quadric is a conic in the plane; it is taken about its own centre, so that float's rounding is relative to its size and
// not to its place.
//
//     Formula *f = formula_new(arena, true);
//     SectionTrouble trouble;
//     uint32_t inside;
//     if (!section_formula(f, plan, values, &(SectionPlane){.axis = 2, .at = 0}, &inside, &trouble)) …trouble.leaf…
#ifndef SCN_COMPILER_SECTION_H
#define SCN_COMPILER_SECTION_H

#include "compiler/formula.h"
#include "compiler/plan.h"

typedef struct SectionPlane {
    int axis; // 0 … 2: x, y, z
    double at;
} SectionPlane;

typedef struct SectionTrouble {
    uint32_t leaf; // of the plan
    const char *reason;
} SectionTrouble;

// The axes across and up.
void section_axes(const SectionPlane *plane, int axes[2]);

// The condition. False where a leaf has no expression, with which one and why. `values` are a frame's.
bool section_formula(Formula *f, const Plan *plan, const double *values, const SectionPlane *plane, uint32_t *inside,
                     SectionTrouble *trouble);

#endif
