// The types of SCN values (lang/reference.md, section 6).
//
// A type is a small value, compared by type_equal(), copied freely. A list is its element's type with `list` one
// higher, so [[vec3]] is {TYPE_VEC3, .list = 2}. Numbers, vectors and ranges have a dimension angle^a time^t; of
// these only scalar (0, 0), angle (1, 0) and time (0, 1) have names, the others occur on the way.
//
// TYPE_ERROR is the type of what was already reported: it agrees with everything, so that one mistake is one message.
// TYPE_ANY is the element of an empty list, and what a built-in takes that takes anything.
#ifndef SCN_COMPILER_TYPES_H
#define SCN_COMPILER_TYPES_H

#include <stdbool.h>
#include <stdint.h>

#include "lang/arena.h"

typedef enum TypeKind {
    TYPE_ERROR,
    TYPE_ANY,
    TYPE_BOOL,
    TYPE_INT,
    TYPE_NUMBER, // scalar, angle, time and every other dimension
    TYPE_VEC2,
    TYPE_VEC3,
    TYPE_COLOR,
    TYPE_STRING,
    TYPE_RANGE,
    TYPE_QUADRIC,
    TYPE_OBJECT,
    TYPE_PERTURBATION,
    TYPE_MATERIAL,
    TYPE_LIGHT,
    TYPE_CAMERA,
    TYPE_PATCH,
    TYPE_VOLUME,
    TYPE_CONTACT,
    TYPE_MEMBERSHIP,
    TYPE_INTERVAL,
    TYPE_PLACE,
    TYPE_BACKGROUND,
    TYPE_ANIMATION,
    TYPE_PART, // of a patch
    TYPE_KIND_COUNT
} TypeKind;

typedef struct Type {
    uint8_t kind;       // TypeKind
    uint8_t list;       // how many lists deep
    int8_t angle, time; // exponents of the dimension
    bool zero;          // the literal 0 (or a vector of them): has the unit that its place wants
    bool whole;         // TYPE_RANGE: its ends are ints, so `for` can walk it
} Type;

static inline Type type_of(TypeKind kind)
{
    return (Type){.kind = (uint8_t)kind};
}
static inline Type type_list(Type element)
{
    element.list++;
    element.zero = false;
    return element;
}
static inline Type type_element(Type list)
{
    list.list--;
    return list;
}
static inline Type type_number(int angle, int time)
{
    return (Type){.kind = TYPE_NUMBER, .angle = (int8_t)angle, .time = (int8_t)time};
}
static inline bool type_is(Type type, TypeKind kind)
{
    return type.kind == kind && !type.list;
}
static inline bool type_bad(Type type)
{
    return type.kind == TYPE_ERROR;
}
static inline bool type_is_number(Type t)
{
    return !t.list && (t.kind == TYPE_INT || t.kind == TYPE_NUMBER);
}
static inline bool type_is_vector(Type t)
{
    return !t.list && (t.kind == TYPE_VEC2 || t.kind == TYPE_VEC3);
}
static inline bool type_is_field(Type t)
{
    return !t.list && (t.kind == TYPE_QUADRIC || t.kind == TYPE_OBJECT);
}
// Numbers, vectors and colours: what an IR scalar or a few of them hold.
static inline bool type_is_numeric(Type t)
{
    return type_is_number(t) || type_is_vector(t) || type_is(t, TYPE_COLOR);
}

bool type_equal(Type a, Type b); // `zero` and `whole` aside

// Same dimension, or one of them is a literal 0.
bool type_same_dimension(Type a, Type b);

// Whether a value of type `have` may stand where `want` is wanted: equal, or by the conversions that happen by
// themselves: int -> scalar, quadric -> object, vec3 -> color, the literal 0 to any unit, an empty list to any list;
// lists by their elements.
bool type_converts(Type have, Type want);

// The type that both become, as the branches of an `if` and the elements of a list do. False if there is none.
bool type_join(Type a, Type b, Type *joined);

// The type of a name in `param x: NAME`: bool int scalar … interval place. False if it names none.
bool type_named(const char *name, Type *type);
extern const char *const type_names[]; // ended by NULL, for suggestions

// "[vec3]", "time", "angle/time": as authors write it, where they can. Constant or in the arena.
const char *type_text(Arena *arena, Type type);

// With an article: "a list of objects", "an angle", "a number".
const char *type_phrase(Arena *arena, Type type);

#endif
