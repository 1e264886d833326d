// Noise and cells (lang/reference.md, section 9) in long double, by the definitions of compiler/noise.h, written a second time.
#ifndef SCN_TESTS_ORACLE_NOISE_H
#define SCN_TESTS_ORACLE_NOISE_H

#include <stdbool.h>

// The value at a place, with the three derivatives.
long double oracle_noise(const long double place[3], long double slopes[3]);

// `alone`: one point is the nearest for certain and is not here, so that the derivatives are those of its distance.
long double oracle_cells(const long double place[3], long double slopes[3], bool *alone);

#endif
