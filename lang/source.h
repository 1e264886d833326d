// Source texts and places in them.
//
// All texts of a compilation share one space of positions: each file begins where the one before it
// ended (plus one), so a place is one number and a Span two, whatever file it is in. Lines and columns are
// computed only to print.
#ifndef SCN_LANG_SOURCE_H
#define SCN_LANG_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "lang/arena.h"

enum { SOURCE_LENGTH_MAX = 1 << 30 }; // bytes of one file

typedef struct Span {
    uint32_t begin, end; // [begin, end) in the common space of positions; 0,0 is "nowhere"
} Span;

typedef struct Source {
    const char *path;     // as it is shown to people
    const char *text;     // NUL-terminated; a byte-order mark is skipped
    uint32_t length;      // bytes, without the NUL
    uint32_t base;        // position of text[0]
    Span included_at;     // the include or use that brought it; nowhere for the main file
    bool library;         // came by `use`, or is part of the standard library
    bool prelude;         // compiled into scn, not read from a file
    uint32_t *line_start; // made on first use
    uint32_t line_count;
} Source;

typedef struct Sources {
    Arena *arena;
    Source **list; // in order of base
    uint32_t count, capacity;
} Sources;

// A place as people read it. Line and column count from 1; column counts code points, `width` columns of a
// terminal before the place (a tab goes to the next multiple of 8, a wide character takes 2).
typedef struct Place {
    const Source *source; // NULL for nowhere
    uint32_t line, column, width;
    const char *line_text; // not terminated at the line's end
    uint32_t line_length;
} Place;

// Adds a text that the arena owns or that outlives it. Positions are 32 bits: returns NULL where the sum of all
// texts would not fit.
Source *source_add(Sources *sources, const char *path, const char *text, size_t length, Span included_at);

// Reads a whole file ("-" is standard input) into the arena, with a terminating zero. On failure returns NULL and sets
// errno: that of the system, EISDIR for a folder, EFBIG beyond SOURCE_LENGTH_MAX.
char *source_read(Arena *arena, const char *path, size_t *length);

// The source that a position is in, its end included. NULL for nowhere.
const Source *source_of(const Sources *sources, uint32_t position);
Place source_place(const Sources *sources, uint32_t position);

static inline Span span_join(Span a, Span b)
{
    if (!a.end) return b;
    if (!b.end) return a;
    return (Span){a.begin < b.begin ? a.begin : b.begin, a.end > b.end ? a.end : b.end};
}

#endif
