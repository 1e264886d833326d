// Formulas: a condition on two coordinates, made of numbers, comparisons with constants, AND and OR, as it is asked where only
// signs matter: pictures of slices, and whatever else asks inside or outside.
//
// Numbers are steps of tapes (kernels/tape_shared.h) in float, each computed and rounded as the kernels do it; equal ones are
// one. `F < t` is not computed where it need not be: it is pushed down to what F is made of,
//
//     max(a, b) < t     a < t and b < t
//     min(a, b) < t     a < t or b < t
//     -a < t            a >= the next float above -t
//     |a| < t           a < t and a >= the next float above -t
//     g(a) < t          a < T or a >= T, for a step g that rises or falls throughout: compiler/threshold.h finds T
//     a - b < 0         a < b
//
// and the same of `>=`. Each of these answers exactly as the numbers would, bit for bit. What remains are comparisons of what is no
// such step: sums of two things that vary, squares, sines. Where a number may be undefined (NaN) nothing is pushed, and a
// comparison with what is undefined does not hold.
//
// What a number can be is known by intervals over |across|, |up| <= FORMULA_REACH, so a formula is good for any window there.
//
//     Formula *f = formula_new(arena, true);
//     uint32_t r = formula_op2(f, TAPE_ADD, formula_op1(f, TAPE_SQUARE, FORMULA_ACROSS), formula_op1(f, TAPE_SQUARE, FORMULA_UP));
//     uint32_t disc = formula_compare(f, formula_op1(f, TAPE_SQRT, r), false, 1);   // sqrt(x² + y²) < 1
//     FormulaSteps steps;
//     if (formula_steps(f, disc, arena, &steps)) …
#ifndef SCN_COMPILER_FORMULA_H
#define SCN_COMPILER_FORMULA_H

#include <stdbool.h>
#include <stdint.h>

#include "kernels/slice_shared.h"
#include "kernels/tape_shared.h"
#include "lang/arena.h"

#define FORMULA_REACH 65536.0f

enum { FORMULA_ACROSS, FORMULA_UP };  // numbers
enum { FORMULA_FALSE, FORMULA_TRUE }; // conditions

typedef struct FormulaNumber {
    uint8_t op;       // TAPE_NUMBER: `value`; the two coordinates are TAPE_OPS
    uint8_t depends;  // SLICE_ACROSS, SLICE_UP
    bool vanishes;    // may be 0 in a whole region, as max(Q, 0)
    bool doubt;       // may be undefined or infinite
    uint32_t a, b, c; // numbers; of TAPE_POWER b is the exponent, c the third of those that TAPE_TAKES_THREE
    float value, low, high;
} FormulaNumber;

typedef struct FormulaCondition {
    uint8_t op;    // SLICE_BELOW … SLICE_OR
    uint32_t a, b; // numbers, or of SLICE_AND and SLICE_OR conditions
    float value;   // of SLICE_BELOW and SLICE_FROM
} FormulaCondition;

typedef struct Formula {
    Arena *arena;
    bool pushing; // false: F is computed and compared, for tests of what pushing gives
    FormulaNumber *numbers;
    uint32_t number_count, number_capacity;
    FormulaCondition *conditions;
    uint32_t condition_count, condition_capacity;
    struct FormulaTable *table; // what is equal is one
    uint32_t depth;
} Formula;

Formula *formula_new(Arena *arena, bool pushing);

uint32_t formula_value(Formula *f, float value);
// Steps with operands that are numbers; those of numbers that are known are folded.
uint32_t formula_op1(Formula *f, uint32_t op, uint32_t a);
uint32_t formula_op2(Formula *f, uint32_t op, uint32_t a, uint32_t b);
uint32_t formula_power(Formula *f, uint32_t a, int32_t exponent);
uint32_t formula_op3(Formula *f, uint32_t op, uint32_t a, uint32_t b, uint32_t c);

uint32_t formula_compare(Formula *f, uint32_t a, bool from, float t); // a >= t if `from`, else a < t
uint32_t formula_and(Formula *f, uint32_t a, uint32_t b);
uint32_t formula_or(Formula *f, uint32_t a, uint32_t b);

// The program of a condition (kernels/slice_shared.h), in the arena. `known`: it is FORMULA_FALSE or FORMULA_TRUE, and there are no
// steps. False where there are too many steps.
typedef struct FormulaSteps {
    TapeStep *steps;
    uint32_t numbers, compares, logics;
    uint32_t mixed; // numbers that depend on both
    bool known, holds;
} FormulaSteps;
bool formula_steps(const Formula *f, uint32_t condition, Arena *arena, FormulaSteps *steps);

#endif
