// One array gives each kind its name and its phrase; dimensions are written by their exponents.
#include "compiler/types.h"

#include <assert.h>
#include <string.h>

static const struct {
    const char *name, *phrase, *plural;
    bool writable; // authors can write the name as a type
} kinds[TYPE_KIND_COUNT] = {
    [TYPE_ERROR] = {"error", "a value", "values", false},
    [TYPE_ANY] = {"value", "a value", "values", false},
    [TYPE_BOOL] = {"bool", "a bool", "bools", true},
    [TYPE_INT] = {"int", "an int", "ints", true},
    [TYPE_NUMBER] = {"scalar", "a number", "numbers", true},
    [TYPE_VEC2] = {"vec2", "a vec2", "vec2s", true},
    [TYPE_VEC3] = {"vec3", "a vec3", "vec3s", true},
    [TYPE_COLOR] = {"color", "a color", "colors", true},
    [TYPE_STRING] = {"string", "a string", "strings", true},
    [TYPE_RANGE] = {"range", "a range", "ranges", true},
    [TYPE_QUADRIC] = {"quadric", "a quadric", "quadrics", true},
    [TYPE_OBJECT] = {"object", "an object", "objects", true},
    [TYPE_PERTURBATION] = {"perturbation", "a perturbation", "perturbations", true},
    [TYPE_MATERIAL] = {"material", "a material", "materials", true},
    [TYPE_LIGHT] = {"light", "a light", "lights", true},
    [TYPE_CAMERA] = {"camera", "a camera", "cameras", true},
    [TYPE_PATCH] = {"patch", "a patch", "patches", true},
    [TYPE_VOLUME] = {"volume", "a volume", "volumes", true},
    [TYPE_CONTACT] = {"contact", "a contact", "contacts", true},
    [TYPE_MEMBERSHIP] = {"membership", "a membership", "memberships", true},
    [TYPE_INTERVAL] = {"interval", "an interval", "intervals", true},
    [TYPE_PLACE] = {"place", "a place", "places", true},
    [TYPE_BACKGROUND] = {"background", "a background", "backgrounds", false},
    [TYPE_ANIMATION] = {"animation", "an animation", "animations", false},
    [TYPE_PART] = {"part", "a part of a patch", "parts of a patch", false},
};

const char *const type_names[] = {
    "bool",   "int",    "scalar",  "angle",      "time",         "vec2",     "vec3",  "color",
    "string", "range",  "quadric", "object",     "perturbation", "material", "light", "camera",
    "patch",  "volume", "contact", "membership", "interval",     "place",    NULL,
};

bool type_equal(Type a, Type b)
{
    return a.kind == b.kind && a.list == b.list && a.angle == b.angle && a.time == b.time;
}

bool type_same_dimension(Type a, Type b)
{
    return a.zero || b.zero || (a.angle == b.angle && a.time == b.time);
}

bool type_converts(Type have, Type want)
{
    if (type_bad(have) || type_bad(want) || type_is(want, TYPE_ANY)) return true;
    if (have.kind == TYPE_ANY && have.list) return want.list >= have.list;
    if (want.kind == TYPE_ANY) return have.list >= want.list;
    if (have.list != want.list) return false;
    if (have.kind == want.kind) return type_same_dimension(have, want);
    switch (want.kind) {
    case TYPE_NUMBER: return have.kind == TYPE_INT && type_same_dimension(have, want);
    case TYPE_OBJECT: return have.kind == TYPE_QUADRIC || have.kind == TYPE_PATCH || have.kind == TYPE_VOLUME;
    case TYPE_COLOR: return have.kind == TYPE_VEC3 && !have.angle && !have.time;
    default: return false;
    }
}

bool type_join(Type a, Type b, Type *joined)
{
    if (type_bad(a) || type_bad(b)) {
        *joined = type_of(TYPE_ERROR);
        return true;
    }
    // A literal 0 beside a number with a unit takes that unit; beside another 0 it stays free.
    bool zero = a.zero && b.zero;
    if (a.zero && !b.zero && type_converts(a, b)) {
        *joined = b;
        return true;
    }
    if (type_converts(b, a))
        *joined = a;
    else if (type_converts(a, b))
        *joined = b;
    else
        return false;
    joined->zero = zero;
    if (joined->kind == TYPE_RANGE) joined->whole = a.whole && b.whole;
    return true;
}

bool type_named(const char *name, Type *type)
{
    if (!strcmp(name, "angle"))
        *type = type_number(1, 0);
    else if (!strcmp(name, "time"))
        *type = type_number(0, 1);
    else {
        for (int kind = 0; kind < TYPE_KIND_COUNT; kind++) {
            if (!kinds[kind].writable || strcmp(kinds[kind].name, name)) continue;
            *type = type_of((TypeKind)kind);
            return true;
        }
        return false;
    }
    return true;
}

// "angle", "angle/time", "1/time^2": a dimension that is not (0, 0).
static const char *dimension_text(Arena *arena, int angle, int time)
{
    const char *word[2] = {"angle", "time"};
    int exponent[2] = {angle, time};
    const char *above = NULL, *below = NULL;
    for (int i = 0; i < 2; i++) {
        int e = exponent[i] < 0 ? -exponent[i] : exponent[i];
        if (!e) continue;
        const char *power = e == 1 ? word[i] : arena_printf(arena, "%s^%d", word[i], e);
        const char **side = exponent[i] > 0 ? &above : &below;
        *side = *side ? arena_printf(arena, "%s*%s", *side, power) : power;
    }
    if (!below) return above;
    return arena_printf(arena, strchr(below, '*') ? "%s/(%s)" : "%s/%s", above ? above : "1", below);
}

const char *type_text(Arena *arena, Type type)
{
    if (type.list) return arena_printf(arena, "[%s]", type_text(arena, type_element(type)));
    assert(type.kind < TYPE_KIND_COUNT && "every kind has a name");
    if (!type.angle && !type.time) return kinds[type.kind].name;
    const char *dimension = dimension_text(arena, type.angle, type.time);
    if (type.kind == TYPE_NUMBER) return dimension;
    return arena_printf(arena, "%s of %s", kinds[type.kind].name, dimension);
}

const char *type_phrase(Arena *arena, Type type)
{
    if (type.list == 1 && !type.angle && !type.time)
        return arena_printf(arena, "a list of %s", kinds[type.kind].plural);
    if (type.list) return arena_printf(arena, "a list (%s)", type_text(arena, type));
    if (!type.angle && !type.time) return kinds[type.kind].phrase;
    if (type.kind != TYPE_NUMBER) return arena_printf(arena, "a %s", type_text(arena, type));
    if (type.angle == 1 && !type.time) return "an angle";
    if (type.time == 1 && !type.angle) return "a time";
    return arena_printf(arena, "a number of %s", type_text(arena, type));
}
