// The frame program's evaluator: from a time and handles to the values of a frame, in double on the host.
#ifndef SCN_COMPILER_FRAME_H
#define SCN_COMPILER_FRAME_H

#include <stdbool.h>

#include "compiler/plan.h"
#include "lang/diag.h"

typedef struct FrameInput {
    double time;          // seconds
    double frame;         // number of the frame
    const double *inputs; // plan->input_count handle values, radians and seconds; NULL: the defaults
} FrameInput;

typedef struct FrameError {
    Span span;
    DiagCode code;
    bool world;     // it is no fault of the scene: a device or the memory failed
    char text[240]; // "division by zero", "tool-misses: …", the message of a failed assert
} FrameError;

// The code of an error and its text: some texts begin with a code of their own, "out-of-range: …", which is then left out.
DiagCode frame_error_code(const FrameError *error, const char **text);

// Fills `values` (plan->slot_count doubles). Returns false and says where and why if a value is not finite, a matrix
// singular, a tool misses or an assert fails; `values` is then not to be used.
bool frame_evaluate(const Plan *plan, const FrameInput *input, double *values, FrameError *error);

// The same in parts, for programs that are run in parts (PlanPatch): first the constants and what comes from outside,
// then steps from … to - 1.
bool frame_begin(const Plan *plan, const FrameInput *input, double *values, FrameError *error);
bool frame_run(const Plan *plan, uint32_t from, uint32_t to, double *values, FrameError *error);

// Whether every step names slots, operands and operations that there are, so that a program of any origin can be run:
// plan->step_count if so, else the first step that does not.
uint32_t frame_check(const Plan *plan);

#endif
