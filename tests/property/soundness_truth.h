// The true value of a tape, and its derivative, in long double: the third evaluation, which shares nothing with the host's and the device's.
//
// Numbers are pairs of ends that hold the real number, a few units of 2^-63 apart. Where these cannot tell which side of a jump a number is on, or which
// branch is taken, the value is unsettled, and nothing is said of it.
#ifndef SCN_TESTS_SOUNDNESS_TRUTH_H
#define SCN_TESTS_SOUNDNESS_TRUTH_H

#include <stdbool.h>
#include <stdint.h>

#include "kernels/tape_shared.h"

typedef long double Real;

typedef struct Pair {
    Real low, high;
} Pair;

typedef enum TruthState {
    TRUTH_KNOWN,
    TRUTH_UNDEFINED, // certainly
    TRUTH_INFINITE,  // 1/0, log 0
    TRUTH_UNSETTLED
} TruthState;

typedef struct Truth {
    TruthState state;
    Pair f, d;     // the value and its derivative
    bool smooth;   // the derivative is there, and known
    bool ordinary; // no number on the way is infinite, beyond what floats can hold, or below it
} Truth;

// What the steps, as kernels read them, are worth: `v` has TAPE_POINT coordinates, with their derivatives, and room for a value a step. The last is returned.
Truth truth_of(const TapeStep *steps, uint32_t count, Truth *v);

Truth truth_number(Real value, Real derivative);
Truth truth_ahead(float o, float e, float s); // the coordinate o + s e, whose derivative is e

#endif
