// Values of elaboration: what an expression of a scene is while the scene is built.
//
// Numbers are Scalars: a const one is a double at hand, any other a scalar node of the IR, so arithmetic of constants
// costs no node. Objects, materials, lights and cameras are nodes of the IR. Strings, ranges and lists are known when
// compiled and live in the arena of the elaboration. Angles are in radians, times in seconds.
//
// A NaN that is const, and TYPE_ERROR, are what was already reported: they go through everything without a further
// message.
#ifndef SCN_COMPILER_VALUE_H
#define SCN_COMPILER_VALUE_H

#include <math.h>
#include <stdbool.h>

#include "compiler/ir.h"
#include "compiler/types.h"

typedef struct Scalar {
    double number; // if id is 0
    IrId id;
} Scalar;

typedef struct Value {
    Type type;
    union {
        Scalar scalar;        // bool (1 or 0), int, number; membership: F at the point
        const Scalar *vector; // vec2, vec3, color: 2 or 3; range: low, high; animation: duration, frames a second
        const char *string;
        struct {
            const struct Value *items;
            uint32_t count;
        } list;
        struct {
            const IrId *ids;
            uint32_t count;
        } parts; // perturbation: the sum of these
        IrId id; // quadric, object, material, light, camera, background; place: the map of its frame
    };
} Value;

static inline Scalar scalar_of(double number)
{
    return (Scalar){.number = number};
}
static inline bool scalar_is_const(Scalar s)
{
    return !s.id;
}
static inline bool scalar_bad(Scalar s)
{
    return !s.id && isnan(s.number);
}

static inline Value value_bad(void)
{
    return (Value){.type = {.kind = TYPE_ERROR}};
}
static inline Value value_scalar(Type type, Scalar scalar)
{
    return (Value){.type = type, .scalar = scalar};
}
static inline Value value_int(double number)
{
    return value_scalar(type_of(TYPE_INT), scalar_of(number));
}
static inline Value value_bool(bool b)
{
    return value_scalar(type_of(TYPE_BOOL), scalar_of(b));
}
static inline Value value_node(TypeKind kind, IrId id)
{
    return (Value){.type = {.kind = (uint8_t)kind}, .id = id};
}
static inline Value value_string(const char *text)
{
    return (Value){.type = {.kind = TYPE_STRING}, .string = text};
}
Value value_vector(Arena *arena, Type type, const Scalar *parts, int count);

// How many Scalars a value of this type has: 1, 2, 3, or 0.
int value_size(Type type);
// The k-th of them.
Scalar value_part(const Value *value, int k);

// Poisoned, or with a part that is.
bool value_is_bad(const Value *value);

// The first part that is not const, or NULL.
const Scalar *value_varying(const Value *value);

// The value as `want`, to which its type converts: ints become scalars, vectors colours, the elements of lists each.
Value value_convert(Arena *arena, Value value, Type want);

// As print and strings show it: "2.5", "90deg", "(1, 2, 3)", "[1, 2]". What is not const is shown as "…".
const char *value_text(Arena *arena, const Value *value, int digits);

// sRGB, as #rrggbb and srgb() have it, to linear light.
double srgb_to_linear(double encoded);

#endif
