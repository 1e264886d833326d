#include "lang/lost.h"

#include <string.h>

#include "lang/unit.h"

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

static bool goes_on(char c)
{
    return is_letter(c) || (c >= '0' && c <= '9');
}

static Name *place_of(const Lost *lost, Name name)
{
    uint32_t k = (uint32_t)(((uintptr_t)name * 0x9e3779b97f4a7c15u) >> 32);
    for (;; k++) {
        Name *place = &lost->names[k & (lost->capacity - 1)];
        if (!*place || *place == name) return place;
    }
}

static void add(Unit *unit, Name name)
{
    Lost *lost = &unit->lost;
    if (2 * lost->count >= lost->capacity) {
        Lost old = *lost;
        lost->capacity = old.capacity ? old.capacity * 2 : 64;
        lost->names = arena_array(&unit->arena, Name, lost->capacity);
        for (uint32_t k = 0; k < old.capacity; k++) {
            if (old.names[k]) *place_of(lost, old.names[k]) = old.names[k];
        }
    }
    Name *place = place_of(lost, name);
    if (!*place) lost->count++;
    *place = name;
}

void lost_text(Unit *unit, Span span)
{
    const Source *source = source_of(&unit->sources, span.begin);
    if (!source || span.end <= span.begin) return;
    const char *p = source->text + (span.begin - source->base), *end = source->text + source->length;
    if (span.end - source->base < source->length) end = source->text + (span.end - source->base);
    while (p < end) {
        const char *begin = p;
        while (p < end && goes_on(*p)) p++;
        if (p > begin && is_letter(*begin)) add(unit, name_of(&unit->names, begin, (size_t)(p - begin)));
        if (p == begin) p++;
    }
}

bool lost_name(const Unit *unit, Name name)
{
    const Lost *lost = &unit->lost;
    return lost->files || lost->shape || (lost->capacity && *place_of(lost, name) == name);
}
