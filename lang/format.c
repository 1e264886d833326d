// The entry of the formatter. A range of lines is what is left when the gaps between the words that lie outside of it are taken from the
// source as they are: so one way of formatting serves both.
#include "lang/format.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lang/ast.h"
#include "lang/formatter.h"

// --- The test: the same tree and the same comments

// The printed tree, which says nothing about places. Owned by the caller.
static char *tree_text(const char *text, size_t length)
{
    Unit unit;
    unit_init(&unit);
    char *printed = NULL;
    size_t size;
    FILE *out = open_memstream(&printed, &size);
    const Source *source = source_add(&unit.sources, "", text, length, (Span){0});
    if (out && source) ast_print(&unit, parse_source(&unit, source), out);
    if (out) fclose(out);
    bool good = out && source && !unit.errors;
    unit_release(&unit);
    if (good) return printed;
    free(printed);
    return NULL;
}

static bool same_comments(Unit *unit, const Pieces *before, const Source *result, Arena *arena)
{
    Pieces after = pieces_read(unit, result, arena);
    if (before->comment_count != after.comment_count) return false;
    for (int i = 0; i < after.comment_count; i++) {
        const char *a = before->source->text + before->comments[i].begin, *b = result->text + after.comments[i].begin;
        const char *a_end = before->source->text + before->comments[i].end,
                   *b_end = result->text + after.comments[i].end;
        while (a < a_end || b < b_end) { // space at the ends of lines is not kept
            if (a < a_end && b < b_end && *a == *b) {
                a++, b++;
                continue;
            }
            const char *space = a;
            while (space < a_end && is_blank(*space)) space++;
            if (space == a || space == a_end || *space != '\n') return false;
            a = space;
        }
    }
    return true;
}

static bool is_same(const Source *source, const Pieces *pieces, const char *text, size_t length, Arena *arena)
{
    char *before = tree_text(source->text, source->length), *after = tree_text(text, length);
    bool same = before && after && strcmp(before, after) == 0;
    free(before);
    free(after);
    if (!same) return false;
    Unit unit;
    unit_init(&unit);
    const Source *result = source_add(&unit.sources, "", text, length, (Span){0});
    same = result && same_comments(&unit, pieces, result, arena);
    unit_release(&unit);
    return same;
}

// --- Lines

// True if a line from `first` to `last` begins or is whole between a word in line `from` and one in line `to`.
static bool in_lines(const FormatOptions *options, uint32_t from, uint32_t to)
{
    if (from == to) return options->first_line <= from && from <= options->last_line;
    return options->first_line <= to && from + 1 <= options->last_line;
}

static uint32_t last_line_of(const Pieces *pieces, const Piece *piece)
{
    uint32_t line = piece->line;
    for (uint32_t i = piece->begin; i < piece->end; i++) line += pieces->source->text[i] == '\n';
    return line;
}

typedef struct Text {
    const char *at;
    size_t length;
} Text;

// What of a gap stands in the line of the word before it: a comment behind that.
static Text line_rest(Text gap)
{
    const char *end = memchr(gap.at, '\n', gap.length);
    return (Text){gap.at, end ? (size_t)(end - gap.at) : gap.length};
}

static Text trimmed(Text text)
{
    while (text.length && is_blank(text.at[text.length - 1])) text.length--;
    while (text.length && is_blank(*text.at)) text.at++, text.length--;
    return text;
}

static bool same_text(Text a, Text b)
{
    return a.length == b.length && !memcmp(a.at, b.at, a.length);
}

static size_t add_text(char *to, Text text)
{
    memcpy(to, text.at, text.length);
    return text.length;
}

// A gap from the word that ends in line `from` to one in line `to`. What follows a word in its line belongs to that line, where both texts have it there.
static size_t add_gap(char *to, const FormatOptions *options, uint32_t from, uint32_t line, Text printed, Text source)
{
    Text first = line_rest(printed), written = line_rest(source);
    bool breaks = first.length < printed.length && written.length < source.length;
    size_t length = 0;
    if (breaks && same_text(trimmed(first), trimmed(written))) {
        length = add_text(to, in_lines(options, from, from) ? first : written);
        printed = (Text){first.at + first.length, printed.length - first.length};
        source = (Text){written.at + written.length, source.length - written.length};
    }
    return length + add_text(to + length, in_lines(options, from, line) ? printed : source);
}

// What is written: the gap before each word from the result where it is in the range, else from the source.
static Printed mix(const Pieces *pieces, const Printed *printed, const FormatOptions *options, Arena *arena)
{
    const char *source = pieces->source->text;
    char *text = arena_alloc(arena, printed->length + pieces->source->length + 1);
    size_t length = 0, from_printed = 0;
    uint32_t from_source = 0, line = 1;
    for (int i = 0; i < pieces->count; i++) {
        const Piece *piece = &pieces->list[i];
        bool end = i == pieces->count - 1;
        bool written = printed->begin[i] != NOT_WRITTEN && piece->length && piece->end > piece->begin;
        if (!written && !end)
            continue; // a comma or semicolon that only one of the two texts has: it is part of the gap
        length += add_gap(text + length, options, line, piece->line,
                          (Text){printed->text + from_printed, printed->begin[i] - from_printed},
                          (Text){source + from_source, piece->begin - from_source});
        length += add_text(text + length, (Text){source + piece->begin, piece->end - piece->begin});
        from_printed = printed->begin[i] + piece->length;
        from_source = piece->end;
        line = last_line_of(pieces, piece);
    }
    text[length] = 0;
    return (Printed){.text = text, .length = length};
}

char *format_source(Unit *unit, const Source *source, const FormatOptions *options, size_t *length)
{
    Arena scratch = {0};
    Pieces pieces = pieces_read(unit, source, &scratch);
    Printed printed = boxes_print(&pieces, boxes_make(&pieces, &scratch), &scratch);
    if (options->first_line) printed = mix(&pieces, &printed, options, &scratch);
    char *text = NULL;
    if (is_same(source, &pieces, printed.text, printed.length, &scratch)) {
        text = arena_text(&unit->arena, printed.text, printed.length);
        *length = printed.length;
    }
    arena_release(&scratch);
    return text;
}
