// What is wrong with the patches of a scene, as far as it can be known when it is compiled: with its params as they are.
//
// The compiler tells what single numbers are out of bounds (compiler/elaborate_patch.c); here is what only the whole
// equation shows, by patch_diagnose(): an operator that is not positive definite on its grid, a step that is too large
// for the accuracy that is asked for, pins that are beside the grid. When a handle moves there later, the frame stops
// with the same sentence (runtime/patch_scene.h).
#ifndef SCN_RUNTIME_PATCH_CHECK_H
#define SCN_RUNTIME_PATCH_CHECK_H

#include "compiler/plan.h"
#include "lang/unit.h"

// Reports at the patches' spans. `inputs` are the handles' values.
void patch_check(Unit *unit, const Plan *plan, const double *inputs);

#endif
