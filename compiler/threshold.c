// Floats are counted: their bits, as whole numbers with the sign of the float, stand in the order of the floats, and both
// zeros have the number 0.
#include "compiler/threshold.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#include "kernels/tape_shared.h"

static int32_t number_of(float x)
{
    int32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits >= 0 ? bits : INT32_MIN - bits;
}

static float float_of(int32_t number)
{
    float x;
    int32_t bits = number >= 0 ? number : INT32_MIN - number;
    memcpy(&x, &bits, sizeof x);
    return x;
}

bool threshold_is_monotone(uint32_t op, float c)
{
    switch (op) {
    case TAPE_ADD:
    case TAPE_SUB:
    case TAPE_BACK_SUB: return isfinite(c);
    case TAPE_MUL:
    case TAPE_DIV: return isfinite(c) && c != 0;
    case TAPE_NEG:
    case TAPE_SQRT:
    case TAPE_FLOOR:
    case TAPE_CEIL:
    case TAPE_ROUND: return true;
    default: return false;
    }
}

float threshold_step(uint32_t op, float x, float c)
{
    switch (op) {
    case TAPE_ADD: return x + c;
    case TAPE_SUB: return x - c;
    case TAPE_BACK_SUB: return c - x;
    case TAPE_MUL: return x * c;
    case TAPE_DIV: return x / c;
    case TAPE_NEG: return -x;
    case TAPE_SQRT: return x < 0 ? -INFINITY : sqrtf(x);
    case TAPE_FLOOR: return floorf(x);
    case TAPE_CEIL: return ceilf(x);
    default: return roundf(x);
    }
}

Threshold threshold_below(uint32_t op, float c, float t)
{
    int32_t low = number_of(-INFINITY), high = number_of(INFINITY);
    bool at_low = threshold_step(op, -INFINITY, c) < t, at_high = threshold_step(op, INFINITY, c) < t;
    if (at_low == at_high) return (Threshold){at_low ? THRESHOLD_ALWAYS : THRESHOLD_NEVER, 0};
    while (high - (int64_t)low > 1) { // the answer changes between low and high
        int32_t middle = (int32_t)(low + (high - (int64_t)low) / 2);
        if ((threshold_step(op, float_of(middle), c) < t) == at_low)
            low = middle;
        else
            high = middle;
    }
    return (Threshold){at_low ? THRESHOLD_BELOW : THRESHOLD_FROM, float_of(high)};
}

float threshold_next(float x, bool up)
{
    int32_t number = number_of(x), end = number_of(up ? INFINITY : -INFINITY);
    return number == end ? x : float_of(up ? number + 1 : number - 1);
}
