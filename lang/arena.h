// Memory of one compilation.
//
// An arena hands out zeroed memory that lives until the arena is released; nothing in it is freed
// alone. A compilation has one arena, a pass may have a scratch arena of its own. Running out of
// memory ends the process inside arena_alloc() (message on stderr, exit status 3), so no caller tests.
//
//     Arena arena = {0};
//     Node *node = arena_new(&arena, Node);
//     arena_release(&arena);
#ifndef SCN_LANG_ARENA_H
#define SCN_LANG_ARENA_H

#include <stdalign.h>
#include <stdarg.h>
#include <stddef.h>

typedef struct ArenaBlock ArenaBlock;

typedef struct Arena {
    ArenaBlock *blocks; // newest first
    char *next, *end;   // what is left of the newest
    size_t used;        // bytes handed out, for statistics
} Arena;

// Returns `size` zeroed bytes aligned for any object of that size. Never NULL, also for size 0.
void *arena_alloc(Arena *arena, size_t size);

// Returns a copy of `text[0..length)` with a terminating zero.
char *arena_text(Arena *arena, const char *text, size_t length);

// Returns formatted text, zero-terminated.
char *arena_printf(Arena *arena, const char *format, ...) __attribute__((format(printf, 2, 3)));
char *arena_vprintf(Arena *arena, const char *format, va_list values) __attribute__((format(printf, 2, 0)));

// Returns room for `count` things of `size` bytes; a product that does not fit into a size_t is running out of memory.
void *arena_alloc_array(Arena *arena, size_t size, size_t count);

// Frees everything. The arena can be used again.
void arena_release(Arena *arena);

#define arena_new(arena, Type)          ((Type *)arena_alloc((arena), sizeof(Type)))
#define arena_array(arena, Type, count) ((Type *)arena_alloc_array((arena), sizeof(Type), (size_t)(count)))

#endif
