// Where soundness.c and soundness.cl have their numbers: quantities of a tape, CASES numbers each.
#ifndef SCN_TESTS_SOUNDNESS_SHARED_H
#define SCN_TESTS_SOUNDNESS_SHARED_H

#define POINTS 8 // of a case

#define IN_BOX    0u  // low, high of x, y, z
#define IN_POINTS 6u  // x, y, z of each
#define IN_RAY    30u // o, e, p, q
#define IN_COUNT  38u

#define OUT_RANGE    0u // low, high, maybe, never
#define OUT_VALUES   4u
#define OUT_GRADIENT 12u // of the first point
#define OUT_STRIP    15u // at p low, high, at q low, high, maybe, never
#define OUT_COUNT    21u

#endif
