// Where a ray first crosses the surface of a field: for tools that stand on `surface(…)`, when a scene is compiled and
// in each frame.
//
// Nothing is sampled. Along a ray every quadric is a polynomial of degree 2 and every perturbation the cube of one where
// that is positive, so between the ends of its supports each leaf is a polynomial of degree 6 at most. Its changes of
// sign are isolated in Bernstein form: coefficients of one sign are no root, one change of sign among them is one root,
// and what is neither is halved. Set operations then only ask which leaves are positive, and between two neighbouring
// changes of any leaf none changes; so the first change of the whole is found for certain, but for what rounding hides:
// leaves that touch the ray without crossing it, a leaf that is thinner than about 1e-6 of the way (its two roots are one, to the
// root of what double resolves), and what lies between two leaves closer than 1e-12 of it.
//
// Where a part is a general field, the whole of F is asked over pieces of the ray instead, by intervals in double that are
// rounded outwards (compiler/ray_field.c): what is positive or negative all along is passed over, anything else is halved,
// down to 2^-48 of the piece, where the sign in the middle decides.
#ifndef SCN_COMPILER_RAY_H
#define SCN_COMPILER_RAY_H

#include <stdbool.h>

#include "compiler/field.h"

// The least t > 0 at which F(from + t direction) changes its sign. From outside that is where the ray enters, from
// inside where it leaves. False if there is none, or a number on the way is not finite. It allocates what it needs and
// gives it back; the time is that of sorting the roots of all leaves that the ray meets.
bool ray_first(FieldCode code, const double *values, const double from[3], const double direction[3], double *t);

// What ray_first() does for code with expressions, of any code. It looks as far as TAPE_REACH (compiler/tape.h) about
// the origin.
bool ray_first_general(FieldCode code, const double *values, const double from[3], const double direction[3],
                       double *t);

// OP_SURFACE: the frame that stands where the ray from `from` through `toward` first crosses the surface, z along the
// outward normal. False where it crosses none, or the field has no gradient there.
bool ray_surface(FieldCode code, const double *values, const double from[3], const double toward[3], double result[12]);

#endif
