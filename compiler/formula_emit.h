// Formulas as OpenCL C: functions for parts of one formula, which kernels/slice_lists.cl joins.
//
// Where the formula is an OR of many things, or an AND, they are put into groups of a few steps each. Of a group there is a function
// that says what is known of it in 16 parts of a tile, and one for 16 x 16 pixels, straight lines of code both. Tiles then hold lists
// of the groups that matter there, in the place of programs. All numbers are in the code: another plane, or the same one at
// another time, is other code. It pays where the same picture, in any window, is drawn many times (runtime/slice.h has figures).
//
//     FormulaCode code;
//     if (formula_emit(f, condition, arena, &code)) …
#ifndef SCN_COMPILER_FORMULA_EMIT_H
#define SCN_COMPILER_FORMULA_EMIT_H

#include <stddef.h>

#include "compiler/formula.h"

typedef struct FormulaCode {
    const char *text; // functions group_known() and group_pixels(), and the number of groups
    size_t length;
    uint32_t groups, steps;
} FormulaCode;

enum {
    FORMULA_GROUP_STEPS = 60,  // of a group, about
    FORMULA_GROUP_MOST = 1000, // and where one thing alone takes more; beyond, compilers take long
    FORMULA_CODE_MOST = 20000, // of all groups
};

// False where the formula is known, may be undefined, or takes too many steps: then it is left to programs.
bool formula_emit(const Formula *f, uint32_t condition, Arena *arena, FormulaCode *code);

#endif
