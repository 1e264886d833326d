#include "runtime/record.h"

#include <endian.h>
#include <stdlib.h>
#include <string.h>

// Room for `size` more bytes that are written, or NULL.
static uint8_t *grow(Record *r, size_t size)
{
    if (r->bad) return NULL;
    if (size > r->capacity - r->size) {
        size_t capacity = r->capacity ? r->capacity * 2 : 4096;
        if (capacity < r->size + size) capacity = r->size + size;
        uint8_t *bytes = realloc(r->bytes, capacity);
        if (!bytes) {
            r->bad = true;
            return NULL;
        }
        r->bytes = bytes;
        r->capacity = capacity;
    }
    uint8_t *at = r->bytes + r->size;
    r->size += size;
    return at;
}

// The next `size` bytes that are read, or NULL.
static const uint8_t *take(Record *r, size_t size)
{
    if (r->bad || size > r->size - r->at) {
        r->bad = true;
        return NULL;
    }
    const uint8_t *at = r->bytes + r->at;
    r->at += size;
    return at;
}

// `size` bytes in either direction; zeros where there are none to read.
static void copy(Record *r, void *value, size_t size)
{
    if (size == 0) return; // value may be NULL then
    if (r->writing) {
        uint8_t *to = grow(r, size);
        if (to) memcpy(to, value, size);
        return;
    }
    const uint8_t *from = take(r, size);
    if (from)
        memcpy(value, from, size);
    else
        memset(value, 0, size);
}

void record_u8(Record *r, uint8_t *value)
{
    copy(r, value, 1);
}

void record_u16(Record *r, uint16_t *value)
{
    uint16_t little = r->writing ? htole16(*value) : 0;
    copy(r, &little, sizeof little);
    if (!r->writing) *value = le16toh(little);
}

void record_u32(Record *r, uint32_t *value)
{
    uint32_t little = r->writing ? htole32(*value) : 0;
    copy(r, &little, sizeof little);
    if (!r->writing) *value = le32toh(little);
}

void record_u64(Record *r, uint64_t *value)
{
    uint64_t little = r->writing ? htole64(*value) : 0;
    copy(r, &little, sizeof little);
    if (!r->writing) *value = le64toh(little);
}

void record_f64(Record *r, double *value)
{
    uint64_t bits;
    memcpy(&bits, value, sizeof bits);
    record_u64(r, &bits);
    if (!r->writing) memcpy(value, &bits, sizeof bits);
}

void record_bool(Record *r, bool *value)
{
    uint8_t byte = r->writing ? *value : 0;
    record_u8(r, &byte);
    if (byte > 1) r->bad = true;
    if (!r->writing) *value = byte == 1;
}

void record_text(Record *r, const char **text)
{
    uint32_t length = UINT32_MAX;
    if (r->writing && *text) length = (uint32_t)strlen(*text);
    record_u32(r, &length);
    if (r->writing) {
        if (*text) copy(r, (void *)(uintptr_t)*text, length);
        return;
    }
    *text = NULL;
    if (length == UINT32_MAX || r->bad) return;
    const char *from = (const char *)take(r, length);
    if (!from) return;
    if (memchr(from, 0, length))
        r->bad = true;
    else
        *text = arena_text(r->arena, from, length);
}

void record_bytes(Record *r, const uint8_t **bytes, size_t size)
{
    if (!r->writing) {
        *bytes = take(r, size);
        return;
    }
    uint8_t *to = grow(r, size);
    if (to && size) memcpy(to, *bytes, size);
}

void record_f64s(Record *r, double *values, size_t count)
{
#if __BYTE_ORDER == __LITTLE_ENDIAN
    copy(r, values, count * sizeof *values);
#else
    for (size_t i = 0; i < count; i++) record_f64(r, &values[i]);
#endif
}

void record_u32s(Record *r, uint32_t *values, size_t count)
{
#if __BYTE_ORDER == __LITTLE_ENDIAN
    copy(r, values, count * sizeof *values);
#else
    for (size_t i = 0; i < count; i++) record_u32(r, &values[i]);
#endif
}

void record_count(Record *r, uint32_t *count, size_t least)
{
    record_u32(r, count);
    if (r->writing || *count <= (r->size - r->at) / least) return;
    r->bad = true;
    *count = 0;
}

void record_align(Record *r, size_t step)
{
    static const uint8_t zeros[64];
    size_t at = r->writing ? r->size : r->at, missing = (step - at % step) % step;
    const uint8_t *bytes = zeros;
    record_bytes(r, &bytes, missing);
}

void record_release(Record *r)
{
    if (r->writing) free(r->bytes);
    *r = (Record){0};
}
