// Exact thresholds: for a step g of float arithmetic that rises or falls throughout, the floats x with g(x) < t.
//
// A step that is rounded correctly is monotone as a function of floats, so there is one float at which the answer changes, and
// it is found by halving the floats between -infinity and infinity, each with g as it is computed. Comparing x with that float
// is then the same as computing g(x) and comparing that, bit for bit, for every x but NaN.
//
//     Threshold below = threshold_below(TAPE_ADD, 0.1f, 0);   // x + 0.1f < 0
//     below.kind == THRESHOLD_BELOW, below.at == -0.1f        // x < -0.1f
#ifndef SCN_COMPILER_THRESHOLD_H
#define SCN_COMPILER_THRESHOLD_H

#include <stdbool.h>
#include <stdint.h>

typedef enum ThresholdKind {
    THRESHOLD_NEVER,
    THRESHOLD_ALWAYS,
    THRESHOLD_BELOW, // x < at
    THRESHOLD_FROM,  // x >= at
} ThresholdKind;

typedef struct Threshold {
    ThresholdKind kind;
    float at;
} Threshold;

// Whether the operation (kernels/tape_shared.h) with x as its first operand and c as the second, if it has one, is such a step.
bool threshold_is_monotone(uint32_t op, float c);

// Its value, in float. The operations of threshold_is_monotone().
float threshold_step(uint32_t op, float x, float c);

// Where it is less than t, which is not NaN. For the square root of what is not negative.
Threshold threshold_below(uint32_t op, float c, float t);

// The next float above or, where `up` is false, below. The ends are infinite.
float threshold_next(float x, bool up);

#endif
