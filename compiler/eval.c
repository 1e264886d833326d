#include "compiler/eval.h"

#include <math.h>
#include <string.h>

#include "compiler/noise.h"

bool eval_knows(IrOp op)
{
    return op >= OP_ADD && op <= OP_SELECT;
}

static bool is_lazy(IrOp op)
{
    return op == OP_AND || op == OP_OR || op == OP_SELECT;
}

// The double nearest to a multiple of a quarter turn misses it by up to half a unit in its last place, and so does the
// sine there. `r` is sin x or cos x. Small x are left alone: sin(1e-20) is 1e-20.
static double snap(double x, double r)
{
    return fabs(x) > 1 && fabs(r) < 4e-16 * fabs(x) ? 0 : r;
}

// The sign of b: mod(-1, 3) is 2.
static double mod(double a, double b)
{
    double r = fmod(a, b);
    return r != 0 && (r < 0) != (b < 0) ? r + b : r;
}

static double truth(bool b)
{
    return b ? 1 : 0;
}

double eval_scalar(IrOp op, const double *args)
{
    double a = args[0];
    double b = ir_ops[op].operands > 1 ? args[1] : 0, c = ir_ops[op].operands > 2 ? args[2] : 0;
    if (is_lazy(op)) {
        if (!isfinite(a)) return NAN;
        if (op == OP_SELECT) return a != 0 ? b : args[2];
        if (op == OP_AND && a == 0) return 0;
        if (op == OP_OR && a != 0) return 1;
        return isfinite(b) ? truth(b != 0) : NAN;
    }
    if (!isfinite(a) || !isfinite(b) || !isfinite(c)) return NAN;
    switch (op) {
    case OP_ADD: return a + b;
    case OP_SUB: return a - b;
    case OP_MUL: return a * b;
    case OP_DIV: return a / b;
    case OP_NEG: return -a;
    case OP_ABS: return fabs(a);
    case OP_SIGN: return truth(a > 0) - truth(a < 0);
    case OP_MIN: return a < b ? a : b;
    case OP_MAX: return a > b ? a : b;
    case OP_MOD: return mod(a, b);
    case OP_POW: return pow(a, b);
    case OP_SQRT: return sqrt(a);
    case OP_EXP: return exp(a);
    case OP_LOG: return log(a);
    case OP_SIN: return snap(a, sin(a));
    case OP_COS: return snap(a, cos(a));
    case OP_TAN: return snap(a, cos(a)) == 0 ? INFINITY : snap(a, sin(a)) / cos(a);
    case OP_ASIN: return asin(a);
    case OP_ACOS: return acos(a);
    case OP_ATAN: return atan(a);
    case OP_ATAN2: return atan2(a, b);
    case OP_FLOOR: return floor(a);
    case OP_CEIL: return ceil(a);
    case OP_ROUND: return round(a);
    case OP_HASH: return noise_hash(a, b);
    case OP_NOISE: return noise_gradient(a, b, c);
    case OP_CELLS: return noise_cells(a, b, c);
    case OP_LT: return truth(a < b);
    case OP_LE: return truth(a <= b);
    case OP_EQ: return truth(a == b);
    case OP_NOT: return truth(a == 0);
    default: return NAN; // not an operation of scalars: eval_knows() is false
    }
}

const char *eval_complaint(IrOp op, const double *args)
{
    switch (op) {
    case OP_DIV: return args[1] == 0 ? "division by zero" : "the quotient is too large";
    case OP_MOD: return "mod by zero";
    case OP_SQRT: return "the square root of a negative number";
    case OP_LOG: return args[0] == 0 ? "the logarithm of zero" : "the logarithm of a negative number";
    case OP_ASIN: return "asin of a number that is not in -1..1";
    case OP_ACOS: return "acos of a number that is not in -1..1";
    case OP_TAN: return "the tangent of a right angle";
    case OP_POW:
        if (args[0] == 0) return "zero to a negative power";
        return args[0] < 0 && args[1] != floor(args[1]) ? "a negative number to a power that is not whole"
                                                        : "the power is too large";
    case OP_HASH: return "a key of random is beyond 9007199254740992";
    case OP_PLACE: return "tool-misses: there is no surface along the gradient";
    case OP_SURFACE: return "tool-misses: the ray meets no surface in this frame";
    case OP_STAND: return "the tool has no place: its normal is zero";
    case OP_STEEPNESS: return "the axis of the footprint does not meet the surface between the caps";
    case OP_HEIGHT: return "the perturbation does not reach the point at its height";
    case OP_INVERSE:
    case OP_TRANSFORM:
    case OP_PTRANSFORM: return "the transform cannot be inverted: it flattens space";
    default: return "the number is too large";
    }
}

void matrix_compose(const double a[12], const double b[12], double result[12])
{
    double r[12];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++) {
            double sum = j == 3 ? a[4 * i + 3] : 0;
            for (int k = 0; k < 3; k++) sum += a[4 * i + k] * b[4 * k + j];
            r[4 * i + j] = sum;
        }
    }
    memcpy(result, r, sizeof r);
}

// By cofactors: exact for moves, and for turns by quarters.
bool matrix_inverse(const double m[12], double result[12])
{
    double r[12];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            r[4 * i + j] = m[4 * a + c] * m[4 * b + d] - m[4 * a + d] * m[4 * b + c];
        }
    }
    double det = m[0] * r[0] + m[1] * r[4] + m[2] * r[8];
    double size = 0; // of the terms: the determinant is noise where they cancel
    for (int k = 0; k < 3; k++) size += fabs(m[k] * r[4 * k]);
    if (!isfinite(det) || !(fabs(det) > 1e-15 * size) || det == 0) return false;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) r[4 * i + j] /= det;
        r[4 * i + 3] = -(r[4 * i] * m[3] + r[4 * i + 1] * m[7] + r[4 * i + 2] * m[11]);
    }
    for (int k = 0; k < 12; k++) {
        if (!isfinite(r[k])) return false;
    }
    memcpy(result, r, sizeof r);
    return true;
}

void matrix_point(const double m[12], const double p[3], double result[3])
{
    double r[3];
    for (int i = 0; i < 3; i++) r[i] = m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3];
    memcpy(result, r, sizeof r);
}

static void cross(const double a[3], const double b[3], double r[3])
{
    r[0] = a[1] * b[2] - a[2] * b[1];
    r[1] = a[2] * b[0] - a[0] * b[2];
    r[2] = a[0] * b[1] - a[1] * b[0];
}

static bool normalize(double v[3])
{
    double length = hypot(hypot(v[0], v[1]), v[2]);
    if (!isfinite(length) || length == 0) return false;
    for (int k = 0; k < 3; k++) v[k] /= length;
    return true;
}

bool matrix_stand(const double point[3], const double normal[3], double turn, double result[12])
{
    double z[3] = {normal[0], normal[1], normal[2]};
    if (!normalize(z) || !isfinite(turn)) return false;
    int least = 0; // where it leans equally, x goes before y before z
    for (int k = 1; k < 3; k++) {
        if (fabs(z[k]) < fabs(z[least])) least = k;
    }
    double axis[3] = {0}, x[3], y[3];
    axis[least] = 1;
    cross(z, axis, x);
    normalize(x);
    cross(z, x, y);
    double c = eval_scalar(OP_COS, &turn), s = eval_scalar(OP_SIN, &turn);
    for (int k = 0; k < 3; k++) {
        if (!isfinite(point[k])) return false;
        result[4 * k] = c * x[k] + s * y[k];
        result[4 * k + 1] = c * y[k] - s * x[k];
        result[4 * k + 2] = z[k];
        result[4 * k + 3] = point[k];
    }
    return true;
}
