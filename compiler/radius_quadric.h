// Offsets by a radius of quadrics of any kind, as expressions: the greatest q in a ball about the point, and for a negative
// radius the least.
//
// With q = Xᵀ S X + b X + c, the axes of S as coordinates, eigenvalues λᵢ there, p = grad q / 2 at X, and the radius D:
//
//     q(X + d) <= h(μ) = q(X) + μ D² + Σ pᵢ² / (μ - λᵢ)        for |d| <= D and any μ >= 0 that is above all λᵢ
//
// and the least h is the greatest q exactly: this is the dual of a quadratic function's maximum in a ball, which has no gap.
// The least h is where d with dᵢ = pᵢ / (μ - λᵢ) has the length D (for an ellipsoid of revolution the root of a quartic, for
// three different axes one of degree 6), or where μ is as small as it may be. Newton's method on 1/|d| - 1/D, which is nearly
// a straight line in μ, comes there from below; its start is the exact μ of balls, cylinders, slabs and planes.
//
// So the expression is never less than the greatest q but for rounding, whatever the steps have reached; and it is greater
// by no more than RADIUS_QUADRIC_TOLERANCE of what q varies by on the sphere. tests/unit/test_operation.c samples both.
//
// How the trust region's equation is solved: Moré and Sorensen, Computing a trust region step, 1983.
#ifndef SCN_COMPILER_RADIUS_QUADRIC_H
#define SCN_COMPILER_RADIUS_QUADRIC_H

#include "compiler/ir.h"

#define RADIUS_QUADRIC_TOLERANCE 2e-6

// The greatest value of a QUADRIC in the ball of the radius, a scalar of frame rate at most, as a scalar of point rate; the
// least in that of -radius where the radius is negative. 0 where coefficients move and the mixed ones are not 0.
IrId radius_quadric(Ir *ir, IrId quadric, IrId radius);

#endif
