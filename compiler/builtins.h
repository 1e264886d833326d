// What is built in: the table of builtins.def, and the tags of the prelude (stdlib/prelude/*.scn), which are written
// in SCN.
//
// The table keeps each signature as the reference prints it. builtin_callable() reads one into parameters when it is
// first used, so a compilation pays for what it calls.
#ifndef SCN_COMPILER_BUILTINS_H
#define SCN_COMPILER_BUILTINS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "compiler/types.h"
#include "lang/unit.h"

typedef enum BuiltinId {
#define BUILTIN(id, kind, since, signature, doc) BUILTIN_##id,
#include "compiler/builtins.def"
#undef BUILTIN
    BUILTIN_END
} BuiltinId;

typedef enum BuiltinKind {
    KIND_SET,
    KIND_SHAPE,
    KIND_PERTURBATION,
    KIND_OPERATION,
    KIND_MODIFIER,
    KIND_THING,
    KIND_ANSWER,
    KIND_FUNCTION,
    KIND_CONSTANT
} BuiltinKind;

typedef enum BuiltinSince { SINCE_NOW, SINCE_LATER } BuiltinSince;

typedef struct Builtin {
    const char *signature; // "sin(v: angle) -> scalar"; begins with the name
    const char *doc;
    uint8_t kind;  // BuiltinKind
    uint8_t since; // BuiltinSince
} Builtin;

extern const Builtin builtins[BUILTIN_END];

// Types that only signatures have: what the arguments have in common decides the result.
typedef enum Generic {
    GENERIC_NONE,
    GENERIC_NUMBER,
    GENERIC_RANGE,
    GENERIC_VECTOR,
    GENERIC_NUMERIC,
    GENERIC_MOVABLE
} Generic;

struct Callable;

// Interns the name that a signature begins with.
Name builtin_name(Unit *unit, BuiltinId id);

// Reads the signature of a built-in that is called, into the unit's arena.
struct Callable *builtin_callable(Unit *unit, BuiltinId id);

// The type of a constant: what stands behind its colon.
Type builtin_constant_type(BuiltinId id);

#endif
