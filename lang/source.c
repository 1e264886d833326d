// The list of sources is sorted by base by construction, so a position is found by bisection. Lines are found once
// per source, on the first place that is asked of it, and by bisection after that.
#include "lang/source.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "lang/utf8.h"

Source *source_add(Sources *sources, const char *path, const char *text, size_t length, Span included_at)
{
    if (length >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0) text += 3, length -= 3;
    // Positions begin at 1: 0 is nowhere. The place after the last byte of a text is its own, for what is missing there.
    uint64_t base = 1;
    if (sources->count) {
        const Source *last = sources->list[sources->count - 1];
        base = (uint64_t)last->base + last->length + 1;
    }
    if (base + length + 1 > UINT32_MAX) return NULL;
    if (sources->count == sources->capacity) {
        uint32_t capacity = sources->capacity ? sources->capacity * 2 : 16;
        Source **list = arena_array(sources->arena, Source *, capacity);
        if (sources->count) memcpy(list, sources->list, sizeof *list * sources->count);
        sources->list = list;
        sources->capacity = capacity;
    }
    Source *source = arena_new(sources->arena, Source);
    source->path = path;
    source->text = text;
    source->length = (uint32_t)length;
    source->base = (uint32_t)base;
    source->included_at = included_at;
    sources->list[sources->count++] = source;
    return source;
}

// Reads until the end into a text that grows: pipes do not tell their size. What is outgrown stays in the arena until its
// end, together at most as much as the text.
static char *read_all(Arena *arena, int file, size_t expected, size_t *length)
{
    size_t capacity = expected + 1;
    char *text = arena_alloc(arena, capacity);
    size_t used = 0;
    for (;;) {
        if (used + 1 >= capacity) {
            char *larger = arena_alloc(arena, capacity * 2);
            memcpy(larger, text, used);
            text = larger;
            capacity *= 2;
        }
        ssize_t got = read(file, text + used, capacity - used - 1);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return NULL;
        if (got == 0) break;
        used += (size_t)got;
        if (used > SOURCE_LENGTH_MAX) {
            errno = EFBIG;
            return NULL;
        }
    }
    text[used] = 0;
    *length = used;
    return text;
}

char *source_read(Arena *arena, const char *path, size_t *length)
{
    bool standard_input = strcmp(path, "-") == 0;
    int file = standard_input ? STDIN_FILENO : open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return NULL;
    struct stat status;
    char *text = NULL;
    if (fstat(file, &status) != 0) goto done;
    if (S_ISDIR(status.st_mode)) {
        errno = EISDIR;
        goto done;
    }
    if (status.st_size > SOURCE_LENGTH_MAX) {
        errno = EFBIG;
        goto done;
    }
    text = read_all(arena, file, status.st_size > 0 ? (size_t)status.st_size + 1 : 4096, length);
done:
    if (!standard_input) {
        int error = errno;
        close(file);
        errno = error;
    }
    return text;
}

const Source *source_of(const Sources *sources, uint32_t position)
{
    if (position == 0) return NULL;
    uint32_t low = 0, high = sources->count; // the one sought is in [low, high)
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (sources->list[middle]->base <= position)
            low = middle;
        else
            high = middle;
    }
    if (low == high) return NULL;
    const Source *source = sources->list[low];
    return position >= source->base && position <= source->base + source->length ? source : NULL;
}

static void find_lines(const Sources *sources, Source *source)
{
    const char *end = source->text + source->length;
    uint32_t count = 1;
    for (const char *p = source->text; (p = memchr(p, '\n', (size_t)(end - p))); p++) count++;
    uint32_t *start = arena_array(sources->arena, uint32_t, count);
    uint32_t line = 1;
    for (const char *p = source->text; (p = memchr(p, '\n', (size_t)(end - p))); p++) {
        start[line++] = (uint32_t)(p - source->text) + 1;
    }
    source->line_start = start;
    source->line_count = count;
}

static uint32_t line_of(const Source *source, uint32_t offset)
{
    uint32_t low = 0, high = source->line_count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (source->line_start[middle] <= offset)
            low = middle;
        else
            high = middle;
    }
    return low;
}

Place source_place(const Sources *sources, uint32_t position)
{
    Place place = {0};
    Source *source = (Source *)source_of(sources, position);
    if (!source) return place;
    if (!source->line_start) find_lines(sources, source);
    uint32_t offset = position - source->base;
    uint32_t line = line_of(source, offset);
    uint32_t start = source->line_start[line];
    uint32_t end = line + 1 < source->line_count ? source->line_start[line + 1] - 1 : source->length;
    if (end > start && source->text[end - 1] == '\r') end--;
    place.source = source;
    place.line = line + 1;
    place.line_text = source->text + start;
    place.line_length = end - start;
    if (offset > end) offset = end; // inside a line's CR LF
    place.column = 1;
    for (uint32_t at = start; at < offset;) {
        uint32_t code;
        at += (uint32_t)utf8_read(source->text + at, source->length - at, &code);
        place.column++;
        place.width += utf8_columns(code, place.width);
    }
    return place;
}
