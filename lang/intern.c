// An open hash table with linear probing that is never more than half full. Each slot keeps the hash, so growing
// and most comparisons do not touch the texts. The hash is FNV-1a with a final mix: names are short, and it has no
// tables and no seed, so the order of nothing depends on an address.
#include "lang/intern.h"

#include <limits.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef struct NameSlot {
    Name name; // NULL: free
    uint32_t hash, length;
} NameSlot;

static uint32_t hash_of(const char *text, size_t length)
{
    uint32_t hash = 2166136261u;
    for (size_t i = 0; i < length; i++) hash = (hash ^ (unsigned char)text[i]) * 16777619u;
    hash ^= hash >> 15;
    return hash * 2654435769u;
}

static void grow(Names *names)
{
    uint32_t capacity = names->capacity ? names->capacity * 2 : 256;
    NameSlot *slots = arena_array(names->arena, NameSlot, capacity);
    for (uint32_t i = 0; i < names->capacity; i++) {
        if (!names->slots[i].name) continue;
        uint32_t at = names->slots[i].hash & (capacity - 1);
        while (slots[at].name) at = (at + 1) & (capacity - 1);
        slots[at] = names->slots[i];
    }
    names->slots = slots;
    names->capacity = capacity;
}

Name name_of(Names *names, const char *text, size_t length)
{
    if (names->count * 2 >= names->capacity) grow(names);
    uint32_t hash = hash_of(text, length);
    uint32_t at = hash & (names->capacity - 1);
    for (; names->slots[at].name; at = (at + 1) & (names->capacity - 1)) {
        const NameSlot *slot = &names->slots[at];
        if (slot->hash == hash && slot->length == length && memcmp(slot->name, text, length) == 0) return slot->name;
    }
    NameSlot new_slot = {.name = arena_text(names->arena, text, length), .hash = hash, .length = (uint32_t)length};
    names->slots[at] = new_slot;
    names->count++;
    return new_slot.name;
}

Name name_text(Names *names, const char *text)
{
    return name_of(names, text, strlen(text));
}

// --- nearest_name ---

enum { LONGEST = 63 }; // a longer name is not compared: nobody mistypes it without copying it

static int smallest(int a, int b, int c)
{
    int m = a < b ? a : b;
    return m < c ? m : c;
}

static char lower(char c)
{
    return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

// The optimal string alignment distance: insertions, deletions, replacements and transpositions of neighbours cost 2, a
// letter in the wrong case costs 1. Gives up with INT_MAX as soon as a row is beyond `limit`.
static int distance(const char *a, int a_length, const char *b, int b_length, int limit)
{
    int rows[3][LONGEST + 1];
    int *before = rows[0], *last = rows[1], *row = rows[2];
    for (int j = 0; j <= b_length; j++) last[j] = 2 * j;
    for (int i = 1; i <= a_length; i++) {
        row[0] = 2 * i;
        int best = row[0];
        for (int j = 1; j <= b_length; j++) {
            int differs = a[i - 1] == b[j - 1] ? 0 : lower(a[i - 1]) == lower(b[j - 1]) ? 1 : 2;
            row[j] = smallest(last[j] + 2, row[j - 1] + 2, last[j - 1] + differs);
            bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if (swapped && before[j - 2] + 2 < row[j]) row[j] = before[j - 2] + 2;
            if (row[j] < best) best = row[j];
        }
        if (best > limit) return INT_MAX;
        int *free_row = before;
        before = last;
        last = row;
        row = free_row;
    }
    return last[b_length];
}

const char *nearest_name(const char *wrong, const char *const *candidates, int count)
{
    int length = (int)strnlen(wrong, LONGEST + 1);
    if (length == 0 || length > LONGEST) return NULL;
    // A third of the letters, counted in halves; one letter in names of two and three, since "fv" is likely "fov".
    int limit = length < 2 ? 1 : length < 6 ? 2 : length * 2 / 3;
    const char *nearest = NULL;
    for (int i = 0; i < count; i++) {
        int candidate_length = (int)strnlen(candidates[i], LONGEST + 1);
        if (candidate_length > LONGEST || 2 * abs(candidate_length - length) > limit) continue;
        if (strcmp(wrong, candidates[i]) == 0) continue; // not a suggestion
        bool only_case = candidate_length == length && strcasecmp(wrong, candidates[i]) == 0;
        int d = only_case ? 1 : distance(wrong, length, candidates[i], candidate_length, limit);
        if (d > limit) continue;
        if (d == limit && nearest && strcmp(nearest, candidates[i]) <= 0) continue; // of equals the first by name
        nearest = candidates[i];
        limit = d;
    }
    return nearest;
}
