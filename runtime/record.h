// Numbers and texts as bytes, in both directions with the same code, so that what is written is what is read:
//
//     static void leaf_record(Record *r, PlanLeaf *leaf) { record_u32(r, &leaf->kind); record_u32(r, &leaf->quadric); … }
//
// A Record that writes grows its bytes; one that reads takes them from a given range, and after its end gives zeros
// and is `bad`. So a reader runs to the end of its plan and asks once. Little-endian.
#ifndef SCN_RUNTIME_RECORD_H
#define SCN_RUNTIME_RECORD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "lang/arena.h"

typedef struct Record {
    bool writing;
    bool bad;        // reading: there was less than was asked for, or a text that is none; writing: out of memory
    uint8_t *bytes;  // writing: owned by the record, freed by record_release or taken over
    size_t size;     // writing: how much is written; reading: how much there is
    size_t at;       // reading: how much is read
    size_t capacity; // writing
    Arena *arena;    // reading: for texts and arrays
} Record;

void record_u8(Record *r, uint8_t *value);
void record_u16(Record *r, uint16_t *value);
void record_u32(Record *r, uint32_t *value);
void record_u64(Record *r, uint64_t *value);
void record_f64(Record *r, double *value);
void record_bool(Record *r, bool *value);
void record_text(Record *r, const char **text); // may be NULL; no zero within

// Bytes as they are; reading, `*bytes` points into the record's.
void record_bytes(Record *r, const uint8_t **bytes, size_t size);

// Many at once: as fast as memory goes.
void record_f64s(Record *r, double *values, size_t count);
void record_u32s(Record *r, uint32_t *values, size_t count);

// The count of a table whose entries take at least `least` bytes each: reading, more than the bytes that are left can
// hold is `bad` and 0.
void record_count(Record *r, uint32_t *count, size_t least);

// Zeros to the next multiple of `step` (written; skipped and not looked at where it reads).
void record_align(Record *r, size_t step);

void record_release(Record *r);

// Reads or writes a table: its count and each entry by `one`. `array` is a pointer variable.
#define record_table(r, array, count, least, one)                                                                      \
    do {                                                                                                               \
        record_count((r), &(count), (least));                                                                          \
        if (!(r)->writing) (array) = arena_alloc_array((r)->arena, sizeof *(array), (count));                          \
        for (uint32_t record_i = 0; record_i < (count); record_i++) one((r), &(array)[record_i]);                      \
    } while (0)

#endif
