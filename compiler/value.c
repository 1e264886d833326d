#include "compiler/value.h"

#include <assert.h>
#include <string.h>

int value_size(Type type)
{
    if (type.list) return 0;
    switch (type.kind) {
    case TYPE_BOOL:
    case TYPE_INT:
    case TYPE_NUMBER: return 1;
    case TYPE_VEC2:
    case TYPE_RANGE:
    case TYPE_ANIMATION: return 2;
    case TYPE_VEC3:
    case TYPE_COLOR: return 3;
    default: return 0;
    }
}

Scalar value_part(const Value *value, int k)
{
    int size = value_size(value->type);
    assert(k < size && "a value has this part");
    return size == 1 ? value->scalar : value->vector[k];
}

Value value_vector(Arena *arena, Type type, const Scalar *parts, int count)
{
    Scalar *own = arena_array(arena, Scalar, count);
    memcpy(own, parts, (size_t)count * sizeof *own);
    return (Value){.type = type, .vector = own};
}

bool value_is_bad(const Value *value)
{
    if (type_bad(value->type)) return true;
    for (int k = value_size(value->type) - 1; k >= 0; k--) {
        if (scalar_bad(value_part(value, k))) return true;
    }
    return false;
}

const Scalar *value_varying(const Value *value)
{
    int size = value_size(value->type);
    if (size == 1) return value->scalar.id ? &value->scalar : NULL;
    for (int k = 0; k < size; k++) {
        if (value->vector[k].id) return &value->vector[k];
    }
    return NULL;
}

static bool same_shape(Type a, Type b)
{
    return type_equal(a, b) || (a.list && b.kind == TYPE_ANY);
}

Value value_convert(Arena *arena, Value value, Type want)
{
    if (type_bad(value.type) || type_bad(want) || want.kind == TYPE_ANY || same_shape(value.type, want)) return value;
    if (want.list) {
        Value *items = arena_array(arena, Value, value.list.count);
        for (uint32_t i = 0; i < value.list.count; i++)
            items[i] = value_convert(arena, value.list.items[i], type_element(want));
        value.list.items = items;
    }
    bool whole = value.type.whole;
    value.type = want;
    value.type.whole = whole;
    value.type.zero = false;
    return value;
}

double srgb_to_linear(double encoded)
{
    return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

// --- text

static const char *number_text(Arena *arena, Scalar s, Type type, int digits)
{
    if (s.id) return "…";
    if (digits < 1) digits = 1;
    if (digits > 17) digits = 17;
    if (type.kind == TYPE_INT) return arena_printf(arena, "%.0f", s.number);
    double number = s.number == 0 ? 0 : s.number; // no sign of zero
    if (type.angle == 1 && !type.time) return arena_printf(arena, "%.*gdeg", digits, number * (180 / M_PI));
    if (type.time == 1 && !type.angle) return arena_printf(arena, "%.*gs", digits, number);
    if (!type.angle && !type.time) return arena_printf(arena, "%.*g", digits, number);
    Type unit = type_number(type.angle, type.time);
    return arena_printf(arena, "%.*g (%s, in rad and s)", digits, number, type_text(arena, unit));
}

typedef struct Text { // grows by doubling, so that a list of many is not copied for each
    Arena *arena;
    char *text;
    size_t length, capacity;
} Text;

static void add(Text *t, const char *text)
{
    size_t length = strlen(text);
    if (t->length + length + 1 > t->capacity) {
        size_t capacity = (t->length + length + 1) * 2;
        char *larger = arena_alloc(t->arena, capacity);
        if (t->length) memcpy(larger, t->text, t->length);
        t->text = larger;
        t->capacity = capacity;
    }
    memcpy(t->text + t->length, text, length + 1);
    t->length += length;
}

static void add_value(Text *t, const Value *value, int digits)
{
    Type type = value->type, part = type_number(type.angle, type.time);
    if (type.list) {
        add(t, "[");
        for (uint32_t i = 0; i < value->list.count; i++) {
            if (i) add(t, ", ");
            add_value(t, &value->list.items[i], digits);
        }
        add(t, "]");
        return;
    }
    switch (type.kind) {
    case TYPE_BOOL: add(t, value->scalar.id ? "…" : value->scalar.number ? "true" : "false"); break;
    case TYPE_INT:
    case TYPE_NUMBER: add(t, number_text(t->arena, value->scalar, type, digits)); break;
    case TYPE_STRING: add(t, value->string); break;
    case TYPE_RANGE:
        if (type.whole) part = type_of(TYPE_INT);
        add(t, number_text(t->arena, value->vector[0], part, digits));
        add(t, " .. ");
        add(t, number_text(t->arena, value->vector[1], part, digits));
        break;
    case TYPE_VEC2:
    case TYPE_VEC3:
    case TYPE_COLOR:
        for (int k = 0; k < value_size(type); k++) {
            add(t, k ? ", " : "(");
            add(t, number_text(t->arena, value->vector[k], part, digits));
        }
        add(t, ")");
        break;
    default: add(t, type_phrase(t->arena, type)); break;
    }
}

const char *value_text(Arena *arena, const Value *value, int digits)
{
    if (type_is(value->type, TYPE_STRING)) return value->string;
    Text t = {.arena = arena};
    add(&t, "");
    add_value(&t, value, digits);
    return t.text;
}
