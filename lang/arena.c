// Blocks double in size up to a limit, so that a small compilation takes little memory and a large one few
// calls of malloc. A request that is larger than a block gets a block of its own, put behind the newest one, whose rest
// stays usable. Blocks come from calloc: the system's fresh pages are zero already, so zeroed memory costs nothing.
#include "lang/arena.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

struct ArenaBlock {
    ArenaBlock *before; // the next older one
    size_t size;        // of what follows
    alignas(max_align_t) char memory[];
};

enum { FIRST_BLOCK = 16 << 10, LAST_BLOCK = 32 << 20, ALIGNMENT = alignof(max_align_t), SMALL_ALIGNMENT = 8 };

static _Noreturn void out_of_memory(size_t size)
{
    fprintf(stderr, "scn: out of memory (%zu bytes more were wanted)\n", size);
    exit(3);
}

// A scene of 100,000 quadrics fills some 300 MB once, and the system then spends as long on handing out 4 KB at a time as
// the parser on its work. What has not been touched yet may come in pages of 2 MB; a system without them says no, which changes nothing.
static void ask_for_large_pages(char *memory, size_t size)
{
    enum { LARGE_PAGE = 2 << 20 };
    char *begin = memory + (size_t)(-(uintptr_t)memory % LARGE_PAGE);
    if (size < 2 * (size_t)LARGE_PAGE || begin > memory + size - LARGE_PAGE) return;
    size_t whole = (size_t)(memory + size - begin) / LARGE_PAGE * LARGE_PAGE;
    (void)madvise(begin, whole, MADV_HUGEPAGE);
}

static ArenaBlock *block_new(size_t size)
{
    if (size > SIZE_MAX - sizeof(ArenaBlock)) out_of_memory(size);
    ArenaBlock *block = calloc(1, sizeof(ArenaBlock) + size);
    if (!block) out_of_memory(size);
    block->size = size;
    ask_for_large_pages(block->memory, size);
    return block;
}

static void *alloc_slowly(Arena *arena, size_t size)
{
    size_t newest = arena->blocks ? arena->blocks->size : 0;
    size_t wanted = newest == 0 ? FIRST_BLOCK : newest < LAST_BLOCK ? newest * 2 : LAST_BLOCK;
    if (arena->blocks && size > wanted / 4) { // a block of its own
        ArenaBlock *block = block_new(size);
        block->before = arena->blocks->before;
        arena->blocks->before = block;
        return block->memory;
    }
    ArenaBlock *block = block_new(size > wanted ? size : wanted);
    block->before = arena->blocks;
    arena->blocks = block;
    arena->next = block->memory + size;
    arena->end = block->memory + block->size;
    return block->memory;
}

void *arena_alloc(Arena *arena, size_t size)
{
    if (size > SIZE_MAX - ALIGNMENT) out_of_memory(size);
    // The size of a type is a multiple of its alignment. So what is no multiple of the largest alignment does not need it, and
    // texts and nodes stand closer.
    size_t rounded = (size + SMALL_ALIGNMENT - 1) / SMALL_ALIGNMENT * SMALL_ALIGNMENT;
    if (rounded == 0) rounded = SMALL_ALIGNMENT; // so that two empty allocations are two places
    size_t gap = rounded % ALIGNMENT == 0 ? (size_t)(-(uintptr_t)arena->next % ALIGNMENT) : 0;
    if ((size_t)(arena->end - arena->next) < rounded + gap) {
        arena->used += rounded;
        return alloc_slowly(arena, rounded);
    }
    arena->used += rounded + gap;
    void *memory = arena->next + gap;
    arena->next += rounded + gap;
    return memory;
}

void *arena_alloc_array(Arena *arena, size_t size, size_t count)
{
    if (size && count > SIZE_MAX / size) out_of_memory(SIZE_MAX);
    return arena_alloc(arena, size * count);
}

char *arena_text(Arena *arena, const char *text, size_t length)
{
    char *copy = arena_alloc(arena, length + 1);
    if (length) memcpy(copy, text, length);
    return copy;
}

char *arena_vprintf(Arena *arena, const char *format, va_list values)
{
    va_list again;
    va_copy(again, values);
    int length = vsnprintf(NULL, 0, format, values);
    if (length < 0) length = 0; // only a malformed multibyte text for %ls, which nobody passes
    char *text = arena_alloc(arena, (size_t)length + 1);
    vsnprintf(text, (size_t)length + 1, format, again);
    va_end(again);
    return text;
}

char *arena_printf(Arena *arena, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    char *text = arena_vprintf(arena, format, values);
    va_end(values);
    return text;
}

void arena_release(Arena *arena)
{
    ArenaBlock *block = arena->blocks;
    while (block) {
        ArenaBlock *before = block->before;
        free(block);
        block = before;
    }
    *arena = (Arena){0};
}
