#include "compiler/pairs.h"

#include <string.h>

void *array_room(Arena *arena, void *array, uint32_t count, uint32_t *capacity, size_t size)
{
    if (count < *capacity) return array;
    uint32_t old = *capacity;
    *capacity = old ? 2 * old : 64;
    while (*capacity <= count) *capacity *= 2;
    void *larger = arena_alloc_array(arena, size, *capacity);
    if (array) memcpy(larger, array, old * size);
    return larger;
}

Pairs pairs_new(Arena *arena)
{
    Pairs pairs = {.arena = arena, .count = 1};
    pairs.list = array_room(arena, NULL, 0, &pairs.capacity, sizeof(Pair));
    return pairs;
}

static uint32_t first_slot(const Pairs *pairs, uint32_t a, uint32_t b)
{
    uint64_t h = ((uint64_t)a << 32 | b) * 0x9e3779b97f4a7c15u;
    return (uint32_t)(h >> 32) & (pairs->slot_count - 1);
}

static void put(Pairs *pairs, uint32_t index)
{
    uint32_t k = first_slot(pairs, pairs->list[index].a, pairs->list[index].b);
    while (pairs->slots[k]) k = (k + 1) & (pairs->slot_count - 1);
    pairs->slots[k] = index;
}

uint32_t pairs_find(const Pairs *pairs, uint32_t a, uint32_t b)
{
    if (!pairs->slot_count) return 0;
    for (uint32_t k = first_slot(pairs, a, b); pairs->slots[k]; k = (k + 1) & (pairs->slot_count - 1)) {
        const Pair *pair = &pairs->list[pairs->slots[k]];
        if (pair->a == a && pair->b == b) return pairs->slots[k];
    }
    return 0;
}

uint32_t pairs_index(Pairs *pairs, uint32_t a, uint32_t b, bool *added)
{
    uint32_t index = pairs_find(pairs, a, b);
    if (added) *added = !index;
    if (index) return index;
    pairs->list = array_room(pairs->arena, pairs->list, pairs->count, &pairs->capacity, sizeof(Pair));
    index = pairs->count++;
    pairs->list[index] = (Pair){a, b};
    if (2 * pairs->count > pairs->slot_count) {
        pairs->slot_count = pairs->slot_count ? 2 * pairs->slot_count : 256;
        pairs->slots = arena_array(pairs->arena, uint32_t, pairs->slot_count);
        for (uint32_t k = 1; k < pairs->count; k++) put(pairs, k);
    } else {
        put(pairs, index);
    }
    return index;
}
