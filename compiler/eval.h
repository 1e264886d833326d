// The scalar evaluator: what an operation of the IR does with numbers. Building folds constants with it, and frames
// are computed with it, so a value does not depend on when it became known.
//
// Everything is in double. A value that is not finite says "undefined": it poisons what is computed from it (the
// result is NaN), but for AND and OR that their left side decides and the branch that SELECT does not choose. So
// whoever uses a value has one test to make, isfinite(), and a division by zero in a branch not taken harms nobody.
//
// sin and cos of what rounds to a multiple of a quarter turn are exact: -1, 0 or 1. So boxes that are turned by 90deg
// stay straight.
#ifndef SCN_COMPILER_EVAL_H
#define SCN_COMPILER_EVAL_H

#include <stdbool.h>

#include "compiler/ir.h"

// True for the operations that eval_scalar() knows: those that make a scalar from scalars.
bool eval_knows(IrOp op);

// The operation of its operands' values.
double eval_scalar(IrOp op, const double *args);

// Why the operation has no finite value of these arguments: "division by zero". For messages.
const char *eval_complaint(IrOp op, const double *args);

// Affine maps: three rows of four, X' = M X + d. The result may be one of the arguments.
void matrix_compose(const double a[12], const double b[12], double result[12]); // a after b
bool matrix_inverse(const double m[12], double result[12]);                     // false if singular or not finite
void matrix_point(const double m[12], const double p[3], double result[3]);

// The frame of a tool at a point: z along the outward normal (of any length but 0), x the cross product of z with the
// world axis that it leans to least, turned by `turn` about z (lang/reference.md, tools). False if there is no such
// frame.
bool matrix_stand(const double point[3], const double normal[3], double turn, double result[12]);

#endif
