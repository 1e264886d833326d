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

static Name *place_of(const NameSet *set, Name name)
{
    uint32_t k = (uint32_t)(((uintptr_t)name * 0x9e3779b97f4a7c15u) >> 32);
    for (;; k++) {
        Name *place = &set->names[k & (set->capacity - 1)];
        if (!*place || *place == name) return place;
    }
}

static bool set_has(const NameSet *set, Name name)
{
    return set->capacity && *place_of(set, name) == name;
}

static void set_add(Arena *arena, NameSet *set, Name name)
{
    if (2 * set->count >= set->capacity) {
        NameSet old = *set;
        set->capacity = old.capacity ? old.capacity * 2 : 64;
        set->names = arena_array(arena, Name, set->capacity);
        for (uint32_t k = 0; k < old.capacity; k++) {
            if (old.names[k]) *place_of(set, old.names[k]) = old.names[k];
        }
    }
    Name *place = place_of(set, name);
    if (!*place) set->count++;
    *place = name;
}

void lost_add(Unit *unit, Name name)
{
    set_add(&unit->arena, &unit->lost.words, name);
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
        if (p == begin) {
            p++;
            continue;
        }
        if (!is_letter(*begin)) continue;
        Name name = name_of(&unit->names, begin, (size_t)(p - begin));
        lost_add(unit, name);
        const char *mark = p;
        while (mark < end && *mark == ' ') mark++;
        bool defined = mark < end && (*mark == ':' || (*mark == '=' && mark[1] != '='));
        if (defined) set_add(&unit->arena, &unit->lost.defined, name);
    }
}

void lost_line(Unit *unit, Span span)
{
    Lost *lost = &unit->lost;
    const Source *source = source_of(&unit->sources, span.begin);
    if (!source) return;
    const char *text = source->text;
    uint32_t begin = span.begin - source->base, end = begin;
    if (begin > source->length) begin = end = source->length;
    while (begin > 0 && text[begin - 1] != '\n') begin--;
    const char *line_end = memchr(text + end, '\n', source->length - end);
    end = line_end ? (uint32_t)(line_end - text) : source->length;
    Span line = {source->base + begin, source->base + end + 1};
    if (lost->line_count && lost->lines[lost->line_count - 1].begin == line.begin) return;
    if (lost->line_count == lost->line_capacity) {
        uint32_t capacity = lost->line_capacity ? lost->line_capacity * 2 : 16;
        Span *lines = arena_array(&unit->arena, Span, capacity);
        if (lost->line_count) memcpy(lines, lost->lines, lost->line_count * sizeof *lines);
        lost->lines = lines;
        lost->line_capacity = capacity;
    }
    lost->lines[lost->line_count++] = line;
    lost_text(unit, line);
}

bool lost_in_line(const Unit *unit, Span span)
{
    const Lost *lost = &unit->lost;
    for (uint32_t k = 0; k < lost->line_count; k++) {
        if (span.begin >= lost->lines[k].begin && span.begin < lost->lines[k].end) return true;
    }
    return false;
}

bool lost_report(const Unit *unit, Span span)
{
    const Lost *lost = &unit->lost;
    if (span.begin >= lost->silent.begin && span.begin < lost->silent.end) return true;
    return lost->read && lost_in_line(unit, span);
}

bool lost_name(const Unit *unit, Name name)
{
    const Lost *lost = &unit->lost;
    return lost->files || lost->shape || set_has(&lost->words, name);
}

bool lost_definition(const Unit *unit, Name name)
{
    return set_has(&unit->lost.defined, name);
}
