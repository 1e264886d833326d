// The tables of a plan as bytes, and whether they make sense.
#ifndef SCN_RUNTIME_PLAN_TABLES_H
#define SCN_RUNTIME_PLAN_TABLES_H

#include "compiler/plan.h"
#include "runtime/failure.h"
#include "runtime/record.h"

// Writes a plan, or fills one whose memory is in the record's arena; then plan_check() says whether it is one.
void plan_record(Record *r, Plan *plan);

// Whether every index, count, kind and nesting of the plan is valid: then frames can be evaluated and everything
// uploaded without a further test. False with the first thing that is wrong.
bool plan_check(const Plan *plan, Failure *failure);

// A patch of a plan alone: all that says how it moves.
void plan_patch_record(Record *r, PlanPatch *patch);

#endif
