// Names as pointers: the same text gives the same pointer, so names are compared with ==.
#ifndef SCN_LANG_INTERN_H
#define SCN_LANG_INTERN_H

#include <stddef.h>
#include <stdint.h>

#include "lang/arena.h"

typedef const char *Name; // zero-terminated, interned

typedef struct Names {
    Arena *arena;
    struct NameSlot *slots;
    uint32_t count, capacity; // capacity is a power of two
} Names;

Name name_of(Names *names, const char *text, size_t length);
Name name_text(Names *names, const char *text); // of a zero-terminated text

// The nearest of `count` candidates to `wrong` by edit distance (transpositions count one), if it is near enough to
// be meant: at most a third of its length wrong. Of equally near ones the first in the alphabet. NULL otherwise.
const char *nearest_name(const char *wrong, const char *const *candidates, int count);

#endif
