// Random tapes over every operation of kernels/tape_shared.h, and where they are asked: boxes, points in them and pieces of rays, of all sizes and kinds.
#ifndef SCN_TESTS_SOUNDNESS_CASES_H
#define SCN_TESTS_SOUNDNESS_CASES_H

#include "compiler/interval.h"
#include "kernels/tape_shared.h"
#include "tests/property/soundness_shared.h"
#include "tests/unit/ir_random.h"

enum { CASES = 32, STEPS = 16 };

typedef struct RandomTape {
    TapeStep steps[STEPS]; // as plans have them, their numbers in `values`
    double values[STEPS];  // floats all of them
    uint32_t count;
} RandomTape;

extern const char *const tape_op_names[TAPE_OPS];

// A tape of one step of that operation, or, for TAPE_OPS, of several of any.
RandomTape random_tape(Random *r, uint32_t op);

// The inputs of one case (soundness_shared.h), each CASES apart.
void random_case(Random *r, float *in);

// A float within low … high, at their ends now and then.
float random_float(Random *r, float low, float high);

#endif
