#include "compiler/quadric.h"

#include <math.h>
#include <string.h>

double quadric_at(const double q[10], const double p[3])
{
    double x = p[0], y = p[1], z = p[2];
    return x * (q[0] * x + q[3] * y + q[4] * z + q[6]) + y * (q[1] * y + q[5] * z + q[7]) + z * (q[2] * z + q[8]) +
           q[9];
}

void quadric_gradient(const double q[10], const double p[3], double gradient[3])
{
    double x = p[0], y = p[1], z = p[2];
    gradient[0] = 2 * q[0] * x + q[3] * y + q[4] * z + q[6];
    gradient[1] = 2 * q[1] * y + q[3] * x + q[5] * z + q[7];
    gradient[2] = 2 * q[2] * z + q[4] * x + q[5] * y + q[8];
}

// The form S of order 4, row by row.
static void quadric_form(const double q[10], double s[16])
{
    double rows[16] = {q[0],     q[3] / 2, q[4] / 2, q[6] / 2, q[3] / 2, q[1],     q[5] / 2, q[7] / 2,
                       q[4] / 2, q[5] / 2, q[2],     q[8] / 2, q[6] / 2, q[7] / 2, q[8] / 2, q[9]};
    memcpy(s, rows, sizeof rows);
}

// With N = M^-1 and its linear part L and move d: the quadratic part is L^T A L; the linear one L^T (2 A d + b), which
// is L^T times the gradient at d; the free term is F(d).
bool quadric_transform(const double q[10], const double inverse[12], double result[10])
{
    double d[3] = {inverse[3], inverse[7], inverse[11]};
    double a[3][3] = {{q[0], q[3] / 2, q[4] / 2}, {q[3] / 2, q[1], q[5] / 2}, {q[4] / 2, q[5] / 2, q[2]}};
    double al[3][3], lal[3][3], gradient[3], linear[3];
    quadric_gradient(q, d, gradient);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            al[i][j] = a[i][0] * inverse[j] + a[i][1] * inverse[4 + j] + a[i][2] * inverse[8 + j];
        }
    }
    for (int i = 0; i < 3; i++) {
        for (int j = i; j < 3; j++) {
            lal[i][j] = inverse[i] * al[0][j] + inverse[4 + i] * al[1][j] + inverse[8 + i] * al[2][j];
        }
        linear[i] = inverse[i] * gradient[0] + inverse[4 + i] * gradient[1] + inverse[8 + i] * gradient[2];
    }
    double r[10] = {lal[0][0],     lal[1][1], lal[2][2], 2 * lal[0][1], 2 * lal[0][2],
                    2 * lal[1][2], linear[0], linear[1], linear[2],     quadric_at(q, d)};
    for (int k = 0; k < 10; k++) {
        if (!isfinite(r[k])) return false;
    }
    memcpy(result, r, sizeof r);
    return true;
}

// Turns rows and columns i and j of the symmetric matrix so that its element there vanishes (Jacobi; Golub and Van
// Loan, 8.5), and the rows of `vectors` along.
static void jacobi_turn(int n, double *m, double *vectors, int i, int j)
{
    double off = m[n * i + j];
    double theta = (m[n * j + j] - m[n * i + i]) / (2 * off);
    double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1));
    double c = 1 / sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < n; k++) {
        double a = m[n * k + i], b = m[n * k + j];
        m[n * k + i] = c * a - s * b;
        m[n * k + j] = s * a + c * b;
    }
    for (int k = 0; k < n; k++) {
        double a = m[n * i + k], b = m[n * j + k];
        m[n * i + k] = c * a - s * b;
        m[n * j + k] = s * a + c * b;
        double v = vectors[n * i + k], w = vectors[n * j + k];
        vectors[n * i + k] = c * v - s * w;
        vectors[n * j + k] = s * v + c * w;
    }
    m[n * i + j] = m[n * j + i] = 0;
}

// The symmetric matrix becomes diagonal: its eigenvalues, the rows of `vectors` the eigenvectors.
static void diagonalize(int n, double *m, double *vectors)
{
    for (int k = 0; k < n * n; k++) vectors[k] = k % (n + 1) == 0;
    for (int sweep = 0; sweep < 30; sweep++) {
        bool done = true;
        for (int i = 0; i < n; i++) {
            for (int j = i + 1; j < n; j++) {
                double off = fabs(m[n * i + j]);
                if (off <= 1e-17 * (fabs(m[n * i + i]) + fabs(m[n * j + j])) || off < 1e-300) continue;
                jacobi_turn(n, m, vectors, i, j);
                done = false;
            }
        }
        if (done) return;
    }
}

static void swap_axes(QuadricAxes *axes, int i, int j)
{
    QuadricAxes old = *axes;
    axes->square[i] = old.square[j];
    axes->square[j] = old.square[i];
    memcpy(axes->axis[i], old.axis[j], sizeof old.axis[j]);
    memcpy(axes->axis[j], old.axis[i], sizeof old.axis[i]);
}

void quadric_axes(const double q[10], QuadricAxes *axes)
{
    double a[9] = {q[0], q[3] / 2, q[4] / 2, q[3] / 2, q[1], q[5] / 2, q[4] / 2, q[5] / 2, q[2]};
    diagonalize(3, a, axes->axis[0]);
    for (int k = 0; k < 3; k++) axes->square[k] = a[4 * k];
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < 2 - pass; k++) {
            if (axes->square[k] > axes->square[k + 1]) swap_axes(axes, k, k + 1);
        }
    }
    double largest = fmax(fabs(axes->square[0]), fabs(axes->square[2])), steepest = 0;
    axes->constant = q[9];
    for (int k = 0; k < 3; k++) {
        const double *u = axes->axis[k];
        axes->linear[k] = u[0] * q[6] + u[1] * q[7] + u[2] * q[8];
        steepest = fmax(steepest, fabs(axes->linear[k]));
    }
    for (int k = 0; k < 3; k++) {
        if (fabs(axes->square[k]) > 1e-12 * largest) continue;
        axes->square[k] = 0;
        if (fabs(axes->linear[k]) <= 1e-12 * fmax(steepest, largest)) axes->linear[k] = 0;
    }
}

double quadric_peak(const double q[10])
{
    QuadricAxes axes;
    quadric_axes(q, &axes);
    double peak = axes.constant;
    for (int k = 0; k < 3; k++) {
        if (axes.square[k] > 0 || (axes.square[k] == 0 && axes.linear[k] != 0)) return INFINITY;
        if (axes.square[k] < 0) peak -= axes.linear[k] * axes.linear[k] / (4 * axes.square[k]);
    }
    return peak;
}

// The form of a sum that is nowhere positive has no positive eigenvalue; one that is within rounding of 0 does not
// count as negative.
bool quadric_sum_not_positive(const double f[10], double w, const double g[10])
{
    double a[16], b[16], m[16], vectors[16], size = 0;
    quadric_form(f, a);
    quadric_form(g, b);
    for (int k = 0; k < 16; k++) {
        m[k] = a[k] + w * b[k];
        size = fmax(size, fabs(a[k]) + fabs(w * b[k]));
    }
    diagonalize(4, m, vectors);
    for (int k = 0; k < 4; k++) {
        if (!(m[5 * k] < -1e-13 * size)) return false;
    }
    return true;
}
