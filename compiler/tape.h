// Tapes: the expressions of general fields as lists of steps (kernels/tape_shared.h says what a step means).
//
// A tape is made once from an expression of the IR; its numbers are slots of the plan, so a frame changes numbers and
// never steps. What is computed once a frame is no step: tapes hold what depends on the point. Powers are taken apart,
// operands that are numbers are literals, equal steps are one.
//
// On the host tapes are evaluated in double: at a point with the gradient, and over a box by intervals (outward, so the
// result holds every value of F there). Both are what the kernels do in float.
//
//     double *work = …;                                          // TAPE_WORK for each value
//     FieldValue f = tape_at(plan, tape, values, point, work);   // NaN: undefined there
//     Interval range = tape_over(plan, tape, values, box, work); // empty: undefined everywhere
#ifndef SCN_COMPILER_TAPE_H
#define SCN_COMPILER_TAPE_H

#include "compiler/field.h"
#include "compiler/interval.h"
#include "compiler/ir.h"
#include "compiler/plan.h"
#include "kernels/tape_shared.h"

// Where the numbers of a tape are: the slot of an expression of frame rate at most.
typedef struct TapeSlots {
    void *context;
    Slot (*scalar)(void *context, IrId scalar);
} TapeSlots;

// Calls `need` for every expression of frame rate that the tape of the expression names. Shared parts once.
void tape_needs(const Ir *ir, IrId expression, void *context, void (*need)(void *context, IrId scalar));

// The steps of an expression, in the arena. False where there are more than TAPE_STEPS_MAX.
bool tape_new(Arena *arena, const Ir *ir, IrId expression, const TapeSlots *slots, TapeStep **steps, uint32_t *count);

// Whether steps of any origin make sense over `slot_count` slots.
bool tape_check(const TapeStep *steps, uint32_t count, Slot slot_count);

// The steps with the frame's numbers, in float, as the kernels read them.
void tape_bake(const TapeStep *steps, uint32_t count, const double *values, TapeStep *baked);

// The values that a step takes, and their count. The step where value k is number[k].
int tape_operands(TapeStep step, uint32_t operands[3]);
TapeStep tape_renumbered(TapeStep step, const uint32_t *number);

enum { TAPE_WORK = 4 }; // doubles for each value of a tape, TAPE_POINT + count of them, in either evaluation

FieldValue tape_at(const Plan *plan, const PlanTape *tape, const double *values, const double point[3], double *work);
Interval tape_over(const Plan *plan, const PlanTape *tape, const double *values, const Interval box[3], double *work);

// The same of steps that are no plan's, as field programs have them (compiler/field.h).
FieldValue tape_steps_at(const TapeStep *steps, uint32_t count, const double *values, const double point[3],
                         double *work);
Interval tape_steps_over(const TapeStep *steps, uint32_t count, const double *values, const Interval box[3],
                         double *work);

// A box that holds all of F >= 0 that is within TAPE_REACH of the origin, in the expression's own coordinates. Slices are
// cut off its sides for as long as intervals say that F < 0 in them, then what is left is cut into boxes, and each is asked.
// What a twist or a bend turns is as far from its axis as before (compiler/turns.h).
// Sides whose end is not found are infinite; low > high: nothing is there.
#define TAPE_REACH 65536.0 // beyond it general fields are not looked for
void tape_bounds(const Plan *plan, const PlanTape *tape, const double *values, double low[3], double high[3]);

// The same of what is within a box, from which it begins; its sides may be infinite.
void tape_bounds_within(const Plan *plan, const PlanTape *tape, const double *values, double low[3], double high[3]);

#endif
