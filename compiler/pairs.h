// Numbers for pairs of numbers: the same pair has the same index, in the order in which pairs came. Index 0 is never
// given.
#ifndef SCN_COMPILER_PAIRS_H
#define SCN_COMPILER_PAIRS_H

#include <stdbool.h>
#include <stdint.h>

#include "lang/arena.h"

typedef struct Pair {
    uint32_t a, b;
} Pair;

typedef struct Pairs {
    Arena *arena;
    Pair *list; // [1, count)
    uint32_t count, capacity;
    uint32_t *slots, slot_count; // open addressing over indices; slot_count is a power of two
} Pairs;

Pairs pairs_new(Arena *arena);

// The pair's index. `*added` tells whether it is new; may be NULL.
uint32_t pairs_index(Pairs *pairs, uint32_t a, uint32_t b, bool *added);

// The pair's index, or 0.
uint32_t pairs_find(const Pairs *pairs, uint32_t a, uint32_t b);

// Room for an element at index `count`, in an array of the arena that doubles. What is new in it is zero.
void *array_room(Arena *arena, void *array, uint32_t count, uint32_t *capacity, size_t size);

#endif
