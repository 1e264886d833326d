#include "tests/property/soundness_cases.h"

#include <float.h>
#include <math.h>

const char *const tape_op_names[TAPE_OPS] = {
    [TAPE_NUMBER] = "number",
    [TAPE_ADD] = "add",
    [TAPE_SUB] = "sub",
    [TAPE_BACK_SUB] = "back-sub",
    [TAPE_MUL] = "mul",
    [TAPE_DIV] = "div",
    [TAPE_BACK_DIV] = "back-div",
    [TAPE_MIN] = "min",
    [TAPE_MAX] = "max",
    [TAPE_NEG] = "neg",
    [TAPE_ABS] = "abs",
    [TAPE_SQUARE] = "square",
    [TAPE_SQRT] = "sqrt",
    [TAPE_POWER] = "power",
    [TAPE_POW] = "pow",
    [TAPE_EXP] = "exp",
    [TAPE_LOG] = "log",
    [TAPE_SIN] = "sin",
    [TAPE_COS] = "cos",
    [TAPE_TAN] = "tan",
    [TAPE_ASIN] = "asin",
    [TAPE_ACOS] = "acos",
    [TAPE_ATAN] = "atan",
    [TAPE_ATAN2] = "atan2",
    [TAPE_MOD] = "mod",
    [TAPE_FLOOR] = "floor",
    [TAPE_CEIL] = "ceil",
    [TAPE_ROUND] = "round",
    [TAPE_SIGN] = "sign",
    [TAPE_LT] = "lt",
    [TAPE_LE] = "le",
    [TAPE_EQ] = "eq",
    [TAPE_AND] = "and",
    [TAPE_OR] = "or",
    [TAPE_NOT] = "not",
    [TAPE_SELECT] = "select",
    [TAPE_LSE] = "lse",
    [TAPE_NOISE] = "noise",
    [TAPE_CELLS] = "cells",
};

// --- numbers

// Numbers where something happens: ends of domains, jumps, poles, turns, what is as large or as small as floats are.
static float special(Random *r)
{
    static const float few[] = {0,          1,      2,       0.5f,       3,          0.25f,      1e-7f,
                                1e-20f,     1e-38f, 1e-42f,  1.5707963f, 3.1415927f, 6.2831853f, 0.78539816f,
                                1e4f,       65536,  3e7f,    1e18f,      1e30f,      FLT_MAX,    0.99999994f,
                                1.0000001f, 88.7f,  -103.9f, 0.33333334f};
    float x = few[random_below(r, sizeof few / sizeof *few)];
    return random_below(r, 2) ? x : -x;
}

static float any_number(Random *r)
{
    switch (random_below(r, 4)) {
    case 0: return special(r);
    case 1: return (float)(random_below(r, 9) - 4);
    case 2: return (float)(exp(random_in(r, -12, 12)) * (random_below(r, 2) ? 1 : -1));
    default: return (float)random_in(r, -4, 4);
    }
}

float random_float(Random *r, float low, float high)
{
    int choice = random_below(r, 10);
    float x = choice == 0   ? low
              : choice == 1 ? high
              : choice == 2 ? special(r)
              : choice == 3 ? nearbyintf((float)random_in(r, fmax(low, -1e6), fmin(high, 1e6)))
              : choice == 4 ? (float)((1.5707963267948966) *
                                      nearbyint(random_in(r, fmax(low, -1e4), fmin(high, 1e4)) / 1.5707963267948966))
                            : (float)((double)low + ((double)high - low) * random_in(r, 0, 1));
    return fminf(fmaxf(x, low), high);
}

// --- tapes

static bool takes_two(uint32_t op)
{
    return (op >= TAPE_ADD && op <= TAPE_MAX) || op == TAPE_POW || op == TAPE_ATAN2 || op == TAPE_MOD ||
           op == TAPE_LSE || (op >= TAPE_LT && op <= TAPE_OR);
}

static uint32_t operand(Random *r, uint32_t count)
{
    uint32_t known = TAPE_POINT + count;
    if (count && random_below(r, 2)) return known - 1; // so that tapes are deep
    return (uint32_t)random_below(r, (int)known);
}

static TapeStep random_step(Random *r, uint32_t op, RandomTape *tape)
{
    uint32_t k = tape->count, a = operand(r, k), b = operand(r, k);
    if (op == TAPE_NUMBER ||
        (takes_two(op) && (op == TAPE_BACK_SUB || op == TAPE_BACK_DIV || random_below(r, 3) == 0))) {
        tape->values[k] = any_number(r);
        return (TapeStep){op | (op == TAPE_NUMBER ? 0 : TAPE_LITERAL) | a << 8, k};
    }
    if (op == TAPE_POWER) b = (uint32_t)(random_below(r, 4) ? random_below(r, 9) - 4 : random_below(r, 200) - 100);
    if (TAPE_TAKES_THREE(op)) b |= operand(r, k) << 16;
    if (op != TAPE_POWER && !TAPE_TAKES_THREE(op) && !takes_two(op)) b = 0;
    return (TapeStep){op | a << 8, b};
}

// As compiler/tape.c does: what is needed in any case is strict, a branch is lazy.
static void mark_lazy(RandomTape *tape)
{
    bool strict[TAPE_POINT + STEPS] = {0};
    strict[TAPE_POINT + tape->count - 1] = true;
    for (uint32_t k = tape->count; k-- > 0;) {
        TapeStep *step = &tape->steps[k];
        uint32_t op = TAPE_OP(step->word);
        if (!strict[TAPE_POINT + k]) {
            step->word |= TAPE_LAZY;
            continue;
        }
        if (op == TAPE_NUMBER) continue;
        strict[TAPE_A(step->word)] = true;
        if (op == TAPE_NOISE || op == TAPE_CELLS) strict[step->b & 0xffff] = strict[step->b >> 16] = true;
        if (takes_two(op) && op != TAPE_AND && op != TAPE_OR && !(step->word & TAPE_LITERAL)) strict[step->b] = true;
    }
}

RandomTape random_tape(Random *r, uint32_t op)
{
    RandomTape tape = {.count = 0};
    uint32_t count = op < TAPE_OPS ? 1 : 1 + (uint32_t)random_below(r, STEPS);
    while (tape.count < count) {
        uint32_t one = op < TAPE_OPS ? op : (uint32_t)random_below(r, TAPE_OPS);
        tape.steps[tape.count] = random_step(r, one, &tape);
        tape.count++;
    }
    mark_lazy(&tape);
    return tape;
}

// --- cases

static void random_side(Random *r, float *low, float *high)
{
    double middle = random_in(r, -4, 4), size = exp(random_in(r, -16, 3));
    switch (random_below(r, 10)) {
    case 0: middle = any_number(r), size = 0; break; // a point
    case 1: middle = special(r), size *= 1e-3; break;
    case 2: middle = any_number(r), size = fabs(middle) * exp(random_in(r, -16, 1)); break;
    case 3: middle = 0; break;
    case 4: middle = 0, size = exp(random_in(r, -100, -12)); break; // denormals with them
    case 5: size = exp(random_in(r, 3, 80)); break;
    default: break;
    }
    double part = random_below(r, 6) ? random_in(r, 0, 1) : random_below(r, 2);
    *low = (float)fmax(middle - part * size, -FLT_MAX);
    *high = fmaxf((float)fmin(middle + (1 - part) * size, FLT_MAX), *low);
    if (random_below(r, 40) == 0) *high = INFINITY;
    if (random_below(r, 40) == 0) *low = -INFINITY;
}

static float bounded(float x)
{
    return fminf(fmaxf(x, -FLT_MAX), FLT_MAX);
}

void random_case(Random *r, float *in)
{
    bool place = random_below(r, 8) == 0; // the box is a point
    for (uint32_t k = 0; k < 3; k++) {
        float low, high;
        random_side(r, &low, &high);
        if (place) low = high = bounded(low);
        in[(IN_BOX + 2 * k) * CASES] = low;
        in[(IN_BOX + 2 * k + 1) * CASES] = high;
        for (uint32_t n = 0; n < POINTS; n++)
            in[(IN_POINTS + 3 * n + k) * CASES] = random_float(r, bounded(low), bounded(high));
        in[(IN_RAY + k) * CASES] = (float)random_in(r, -4, 4);
        in[(IN_RAY + 3 + k) * CASES] =
            random_below(r, 5) ? (float)random_in(r, -1, 1) : (float)(random_below(r, 3) - 1);
        if (random_below(r, 12) == 0) in[(IN_RAY + k) * CASES] = special(r);
    }
    float p = (float)random_in(r, -6, 6), q = p + (float)exp(random_in(r, -14, 3));
    if (random_below(r, 12) == 0) q = p;
    if (random_below(r, 12) == 0) p = 0, q = (float)exp(random_in(r, -40, 12));
    in[(IN_RAY + 6) * CASES] = p;
    in[(IN_RAY + 7) * CASES] = q;
}
