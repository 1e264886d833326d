// Whether a map of the frame keeps all distances, whatever moves: turns, moves and mirrors do, and frames of tools.
//
// Of a matrix the rows are tested to be of unit length and at right angles at a few random values of all that it is made of:
// numbers that are arithmetic, roots, sines and cosines are computed, and any other number is one that may be anything. So
// what holds there holds always, but for a coincidence of eight draws of fifteen digits; and conditions, keys and curves, which
// differ from place to place, are never looked into.
#ifndef SCN_COMPILER_RIGID_H
#define SCN_COMPILER_RIGID_H

#include "compiler/ir.h"

bool matrix_is_rigid(const Ir *ir, IrId matrix);

#endif
