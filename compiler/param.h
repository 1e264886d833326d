// Values for params as they are written outside of a scene: on the command line (-D name=value), in the API and in
// editors.
//
//     0.5  -3  1e-3      numbers                 30deg 1.5rad 0.25turn   angles        2s 250ms   times
//     (1, 2)  (1, 2, 3)  vectors                 #fff #c8814b            colors (or a vector, in linear light)
//     true  false        bools                   word                    strings: all of the text, or in "quotes"
//
// An angle and a time need their unit, as in scenes; `12f` is not known here, since frames are the scene's affair.
#ifndef SCN_COMPILER_PARAM_H
#define SCN_COMPILER_PARAM_H

#include <stdbool.h>

#include "compiler/ir.h"
#include "lang/arena.h"

typedef struct Define { // of -D name=text
    const char *name, *text;
} Define;

typedef struct ParamValue {
    double number[3]; // bool: 1 or 0; radians, seconds; color: linear light
    const char *text; // PARAM_STRING, in the arena
} ParamValue;

// Reads `text` as a value for `param` and tests it against the param's range and choices. Returns NULL, or what is
// wrong with it, as a sentence that says what to write (in the arena).
const char *param_parse(Arena *arena, const IrParam *param, const char *text, ParamValue *value);

// The same for a type alone.
const char *param_parse_type(Arena *arena, ParamType type, const char *text, ParamValue *value);

// Tests a value against the range and the choices. NULL, or what is wrong.
const char *param_test(Arena *arena, const IrParam *param, const ParamValue *value);

// A value as param_parse reads it back: "0.5", "30deg", "(1, 2, 3)".
const char *param_text(Arena *arena, ParamType type, const ParamValue *value);

int param_size(ParamType type); // numbers of a value: 1, 2, 3; 0 of a string
const char *param_type_name(ParamType type);

// The nearest of the params' names to one that is none of them, or NULL.
const char *param_nearest(const Ir *ir, const char *name);

#endif
