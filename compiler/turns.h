// Turns of coordinates at the beginning of tapes, as twists and bends make them:
//
//     u = p cos t - q sin t,   v = p sin t + q cos t        p and q are two of x, y, z; t is whatever it is
//
// Intervals cannot see that u² + v² = p² + q²: far away, where they know nothing about t, a turned ball may be anywhere. So
// bounds look at what is turned first: where it is within a box of u, v and the third coordinate, the whole is within
// the same distance from the axis.
#ifndef SCN_COMPILER_TURNS_H
#define SCN_COMPILER_TURNS_H

#include <stdbool.h>
#include <stdint.h>

#include "kernels/tape_shared.h"

// Whether all that the steps take from two coordinates is their turn. Then `rest` are the steps of what is turned, with the
// turned coordinates in the place of the two (u of p, v of q), and `turned` has their numbers, p and q. `rest` has room for
// `count` steps, and its numbers are those of `steps`.
bool turns_take(const TapeStep *steps, uint32_t count, TapeStep *rest, uint32_t *rest_count, int turned[2]);

#endif
