// Field programs: F and its gradient at a point, in double on the host.
//
// A field of the IR is compiled to postfix code over numbered values (slots of a plan, or an array of constants). The
// code is what frames use to bring tools to a surface and to solve heights, what building folds the const ones with,
// and what tests compare passes by.
//
//     FieldCode code;
//     if (field_code(&arena, ir, object, &slots, &code)) { FieldValue v = field_at(code, values, p); }
//
// The words, each an operation and its operands:
//
//     FIELD_QUADRIC q        push F of the ten values at q
//     FIELD_EMPTY            push -infinity
//     FIELD_MAX, FIELD_MIN   of the two on top; where both are equal the deeper one stays
//     FIELD_NEGATE           the top
//     FIELD_CUBE s c         pop Q; top += s max(Q + c, 0)^3, s and c values
//     FIELD_SHOW s           the top is -infinity where value s is 0
//     FIELD_MIX t            pop G; top = (1 - t) top + t G, t a value in 0 … 1; where it is 0 or 1 only the one counts
//     FIELD_MIX_AT           pop t, pop G; the same with the t of the point, which is clamped to 0 … 1
//     FIELD_TAPE n, steps    push F of the n steps (compiler/tape.h), two words each; NaN where it is undefined: outside
//     FIELD_ENTER m          what follows is at M^-1 X, the twelve values at m being M^-1; the outer point is kept
//     FIELD_LEAVE            back to the outer point; the top's gradient becomes one of that point
#ifndef SCN_COMPILER_FIELD_H
#define SCN_COMPILER_FIELD_H

#include <stdbool.h>
#include <stdint.h>

#include "compiler/ir.h"
#include "lang/arena.h"

typedef enum FieldOp {
    FIELD_QUADRIC,
    FIELD_EMPTY,
    FIELD_MAX,
    FIELD_MIN,
    FIELD_NEGATE,
    FIELD_CUBE,
    FIELD_SHOW,
    FIELD_MIX,
    FIELD_MIX_AT,
    FIELD_TAPE,
    FIELD_ENTER,
    FIELD_LEAVE
} FieldOp;

// Limits of a program: values and points that wait at one time, and words. A scene that goes beyond has no field code.
enum { FIELD_STACK_MAX = 512, FIELD_POINTS_MAX = 512, FIELD_WORDS_MAX = 1 << 20 };

typedef struct FieldCode {
    const uint32_t *words;
    uint32_t count;
} FieldCode;

typedef struct FieldValue {
    double f;
    double gradient[3];
} FieldValue;

// Where the values of a field are. Each function returns the index of the first value.
typedef struct FieldSlots {
    void *context;
    uint32_t (*scalar)(void *context, IrId scalar);
    uint32_t (*quadric)(void *context, IrId quadric); // OP_QUADRIC: its ten coefficients
    uint32_t (*inverse)(void *context, IrId matrix);  // the twelve values of the matrix's inverse
} FieldSlots;

// Compiles a field; no quadric in it has coefficients of point rate. False where a limit is exceeded.
bool field_code(Arena *arena, const Ir *ir, IrId field, const FieldSlots *slots, FieldCode *code);

// Whether code of any origin can be run over `value_count` values: its operands name values and it leaves one.
bool field_check(FieldCode code, uint32_t value_count);

FieldValue field_at(FieldCode code, const double *values, const double point[3]);

// OP_PLACE: the frame where the line through `point` along the gradient meets the surface nearest to the point, found
// by steps that grow by a tenth; the sign change is certain and the place exact to rounding. False if there is none.
bool field_place(FieldCode code, const double *values, const double point[3], double turn, double result[12]);

// OP_HEIGHT: -F(p) / Q(point)^3 where p is `point` moved by the matrix. Not finite where Q is not positive there.
double field_height(FieldCode field, FieldCode support, const double *values, const double matrix[12],
                    const double point[3]);

// Where the operation at a word ends: the word of the next one.
uint32_t field_after(FieldCode code, uint32_t at);

// Whether the code has expressions, and F is no piecewise polynomial along a ray.
bool field_is_general(FieldCode code);

// OP_AT: F at a point, +-1e300 where it is infinite, -1e300 where it is undefined, and not finite where the point is not.
double field_value(FieldCode code, const double *values, const double point[3]);
// OP_STEEPNESS: |gradient F| where the axis x = y = 1/2 of the frame meets the surface, from `high` down to `low`: the first
// of a thousand steps over which F changes its sign. NaN where there is none.
double field_steepness(FieldCode code, const double *values, const double frame[12], double low, double high);

// The same for nodes whose operands are all const. False if they have no finite value.
bool field_fold_place(const Ir *ir, const IrId operands[5], double result[12]);
bool field_fold_surface(const Ir *ir, const IrId operands[7], double result[12]); // compiler/ray.h
bool field_fold_height(const Ir *ir, const IrId operands[6], double *strength);
// tape_bounds() of an expression of the point (compiler/tape.h). False where it is not const but for the point.
bool field_fold_bounds(const Ir *ir, IrId expression, double low[3], double high[3]);
bool field_fold_at(const Ir *ir, const IrId operands[4], double *f);
bool field_fold_steepness(const Ir *ir, const IrId operands[4], double *steepness);

#endif
