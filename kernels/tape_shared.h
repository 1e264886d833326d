// Tapes: expressions of general fields as the host (compiler/tape.c, runtime/fold_field.c) gives them to the kernels (field.cl).
//
// A tape is a list of steps in order of evaluation. Values 0, 1 and 2 are the coordinates of the point, step k gives value 3 + k. An operand is the
// number of a value; with TAPE_LITERAL the second operand is a number itself. So numbers are data, and a scene of other numbers, or of other
// expressions, is the same kernel.
//
// The same text is compiled by both sides (shared.h says how).
#ifndef SCN_KERNELS_TAPE_SHARED_H
#define SCN_KERNELS_TAPE_SHARED_H

#define TAPE_NUMBER 0u // b itself
#define TAPE_ADD 1u
#define TAPE_SUB 2u
#define TAPE_BACK_SUB 3u // b - a
#define TAPE_MUL 4u
#define TAPE_DIV 5u
#define TAPE_BACK_DIV 6u // b / a
#define TAPE_MIN 7u
#define TAPE_MAX 8u
#define TAPE_NEG 9u
#define TAPE_ABS 10u
#define TAPE_SQUARE 11u
#define TAPE_SQRT 12u
#define TAPE_POWER 13u // a to the whole power b, a signed number, not a value
#define TAPE_POW 14u
#define TAPE_EXP 15u
#define TAPE_LOG 16u
#define TAPE_SIN 17u
#define TAPE_COS 18u
#define TAPE_TAN 19u
#define TAPE_ASIN 20u
#define TAPE_ACOS 21u
#define TAPE_ATAN 22u
#define TAPE_ATAN2 23u
#define TAPE_MOD 24u
#define TAPE_FLOOR 25u
#define TAPE_CEIL 26u
#define TAPE_ROUND 27u
#define TAPE_SIGN 28u
#define TAPE_LT 29u
#define TAPE_LE 30u
#define TAPE_EQ 31u
#define TAPE_AND 32u
#define TAPE_OR 33u
#define TAPE_NOT 34u
#define TAPE_SELECT 35u // a ? b & 0xffff : b >> 16
#define TAPE_LSE 36u // log(exp a + exp b), which is never too large: smooth unions are made of it
#define TAPE_NOISE 37u // noise of the point a, b & 0xffff, b >> 16 (compiler/noise.h)
#define TAPE_CELLS 38u // cells of it
#define TAPE_OPS 39u

#define TAPE_TAKES_THREE(op) ((op) == TAPE_SELECT || (op) == TAPE_NOISE || (op) == TAPE_CELLS)

#define TAPE_OP(word) ((word) & 63u)
#define TAPE_LAZY 64u     // something undefined here may not matter: a branch that is perhaps not chosen
#define TAPE_LITERAL 128u // b is a float
#define TAPE_A(word) ((word) >> 8 & 0xffffu)
#define TAPE_PLACE(word) ((word) >> 24) // of tapes whose values share places (cells.cl): where the step's stands

#define TAPE_POINT 3u       // values before the first step's
#define TAPE_STEPS_MAX 65000u // values have numbers of 16 bits
#define TAPE_POWER_MAX 1024

typedef struct TapeStep {
    unsigned word; // operation, flags, first operand
    unsigned b;
} TapeStep;

// A general field seen in a view (shared.h), in the place of a quadric's record. With s = w / W, the depth in the view, its own coordinates are
//     a + s b,  a = u U + v V + one,  b = kappa (u U + v V) + w
// and outside of s_low … s_high there is nothing of it.
typedef struct FieldRecord {
    float u[3], v[3], w[3], one[3];
    float s_low, s_high;
    unsigned first, count; // of its tape's steps; count 0: not shown
} FieldRecord;

#endif
