// Quadrics as ten coefficients, in double.
//
//     F = A11 x^2 + A22 y^2 + A33 z^2 + A12 xy + A13 xz + A23 yz + A14 x + A24 y + A34 z + A44
//
// in that order in an array q[10]. As a form, F = (X 1) S (X 1)^T, where S has A12/2 … A34/2 off its diagonal.
#ifndef SCN_COMPILER_QUADRIC_H
#define SCN_COMPILER_QUADRIC_H

#include <stdbool.h>

double quadric_at(const double q[10], const double p[3]);
void quadric_gradient(const double q[10], const double p[3], double gradient[3]);

// The quadric of F(M^-1 X), from M^-1: S' = M^-T S M^-1. False if a coefficient is not finite. `result` may be `q`.
bool quadric_transform(const double q[10], const double inverse[12], double result[10]);

// F in its own axes: F = sum over k of (square[k] u_k^2 + linear[k] u_k) + constant, u_k = axis[k] . X, axes of length
// 1. Squares that are noise (1e-12 of the largest) are 0; then so is a linear part that is noise beside what the
// others are. Squares ascend.
typedef struct QuadricAxes {
    double square[3], linear[3], constant;
    double axis[3][3];
} QuadricAxes;
void quadric_axes(const double q[10], QuadricAxes *axes);

// The maximum of F over space; +infinity where there is none. Exact but for rounding and for what quadric_axes() takes
// as noise.
double quadric_peak(const double q[10]);

// Whether F + w G <= 0 everywhere. Certain: false where rounding leaves it open.
bool quadric_sum_not_positive(const double f[10], double w, const double g[10]);

#endif
