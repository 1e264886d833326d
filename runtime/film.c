#include "runtime/film.h"

#include <stdlib.h>
#include <sys/mman.h>

// All layers of a film lie in one block, each at a multiple of 64 bytes, so one allocation is checked and freed.
typedef struct Layout {
    uint64_t color, depth, normal, position, id, certificate, end;
} Layout;

static uint64_t place(uint64_t *end, bool wanted, uint64_t bytes)
{
    uint64_t begin = *end;
    if (wanted) *end += (bytes + 63) / 64 * 64;
    return begin;
}

static Layout layout(int width, int height, unsigned layers)
{
    uint64_t pixels = (uint64_t)width * (uint64_t)height, end = 0;
    Layout at = {
        .color = place(&end, layers & FILM_COLOR, pixels * 4 * sizeof(float)),
        .depth = place(&end, layers & FILM_DEPTH, pixels * sizeof(float)),
        .normal = place(&end, layers & FILM_NORMAL, pixels * 3 * sizeof(float)),
        .position = place(&end, layers & FILM_POSITION, pixels * 3 * sizeof(float)),
        .id = place(&end, layers & FILM_ID, pixels * sizeof(uint32_t)),
        .certificate = place(&end, layers & FILM_CERTIFICATE, pixels * sizeof(float)),
    };
    at.end = end;
    return at;
}

#define LARGE_PAGE (2u << 20)

// Large pages make large films quick to fill for the first time and to give back.
static void *layer_memory(uint64_t size)
{
    if (size < 2 * LARGE_PAGE) return aligned_alloc(64, size ? size : 64);
    size = (size + LARGE_PAGE - 1) / LARGE_PAGE * LARGE_PAGE;
    void *memory = aligned_alloc(LARGE_PAGE, size);
    if (memory) madvise(memory, size, MADV_HUGEPAGE);
    return memory;
}

uint64_t film_bytes(int width, int height, unsigned layers)
{
    return layout(width, height, layers).end;
}

Film *film_new(int width, int height, unsigned layers)
{
    if (width < 1 || height < 1 || width > FILM_MAX_SIZE || height > FILM_MAX_SIZE) return NULL;
    Film *film = calloc(1, sizeof *film);
    if (!film) return NULL;
    Layout at = layout(width, height, layers);
    char *memory = layer_memory(at.end);
    if (!memory) {
        free(film);
        return NULL;
    }
    *film =
        (Film){.width = width, .height = height, .layers = layers, .memory = memory, .place_x = 0.5, .place_y = 0.5};
    if (layers & FILM_COLOR) film->color = (float *)(memory + at.color);
    if (layers & FILM_DEPTH) film->depth = (float *)(memory + at.depth);
    if (layers & FILM_NORMAL) film->normal = (float *)(memory + at.normal);
    if (layers & FILM_POSITION) film->position = (float *)(memory + at.position);
    if (layers & FILM_ID) film->id = (uint32_t *)(memory + at.id);
    if (layers & FILM_CERTIFICATE) film->certificate = (float *)(memory + at.certificate);
    return film;
}

void film_free(Film *film)
{
    if (!film) return;
    free(film->memory);
    free(film);
}
