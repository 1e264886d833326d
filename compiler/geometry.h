// Warnings that only a look at the geometry can give: quadrics without a surface, perturbations that change nothing, a
// scene that shows nothing, a camera inside of an object.
//
// They never alarm falsely: what is reported is certain. Of quadrics and perturbations only those are looked at that
// do not move; the camera is looked at as it is at time 0 with the default parameters. Where that frame has an error
// (an assert, a division by zero), nothing is said here: rendering says it.
#ifndef SCN_COMPILER_GEOMETRY_H
#define SCN_COMPILER_GEOMETRY_H

#include "compiler/ir.h"
#include "compiler/plan.h"
#include "lang/unit.h"

// The quadrics of the scene as it is written: before the passes.
void warn_of_quadrics(Unit *unit, const Ir *ir);

// The rest.
void warn_of_geometry(Unit *unit, const Ir *ir, const Plan *plan, const PlanOrigins *origins);

#endif
