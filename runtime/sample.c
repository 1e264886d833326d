// A picture of 8 by 8 samples needs no 64 films: sums and the nearest sample are kept as the frames come.
#include "runtime/sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct Samples {
    int n, count;     // count: frames added
    Film *sum;        // sums of colour and normal; nearest depth and its position
    FilmCover *cover; // weights are counts of samples
};

Samples *samples_new(int width, int height, unsigned layers, int n)
{
    Samples *samples = calloc(1, sizeof *samples);
    if (!samples) return NULL;
    size_t pixels = (size_t)width * (size_t)height;
    samples->n = n;
    samples->sum = film_new(width, height, layers);
    if (layers & FILM_ID) samples->cover = malloc(pixels * sizeof *samples->cover);
    if (!samples->sum || (layers & FILM_ID && !samples->cover)) {
        samples_free(samples);
        return NULL;
    }
    return samples;
}

void samples_free(Samples *samples)
{
    if (!samples) return;
    film_free(samples->sum);
    free(samples->cover);
    free(samples);
}

void samples_clear(Samples *samples)
{
    samples->count = 0;
}

void samples_place(const Samples *samples, int index, Film *film)
{
    film->place_x = (index % samples->n + 0.5) / samples->n;
    film->place_y = (index / samples->n + 0.5) / samples->n;
}

// Pixels `begin` to before `end` of a picture: what is done between two looks at whether it is cancelled.
typedef struct Part {
    size_t begin, end;
} Part;

#define PART_PIXELS (1u << 18)

static bool next_part(Part *part, const Film *film, const atomic_bool *cancel)
{
    size_t pixels = (size_t)film->width * (size_t)film->height;
    part->begin = part->end;
    part->end = part->begin + PART_PIXELS < pixels ? part->begin + PART_PIXELS : pixels;
    return part->begin < pixels && !(cancel && atomic_load_explicit(cancel, memory_order_relaxed));
}

static bool parts_are_done(const Part *part, const Film *film)
{
    return part->begin == (size_t)film->width * (size_t)film->height;
}

// A layer of so many numbers a pixel.
static void add_layer(float *sum, const float *values, const Part *part, size_t channels, bool first)
{
    size_t begin = part->begin * channels, end = part->end * channels;
    if (!values) return;
    if (first) {
        memcpy(sum + begin, values + begin, (end - begin) * sizeof *sum);
    } else {
        for (size_t i = begin; i < end; i++) sum[i] += values[i];
    }
}

static void add_places(Film *sum, const Film *film, const Part *part, bool first)
{
    for (size_t i = part->begin; film->depth && i < part->end; i++) {
        if (!first && !(film->depth[i] < sum->depth[i])) continue;
        sum->depth[i] = film->depth[i];
        if (film->position) memcpy(sum->position + 3 * i, film->position + 3 * i, 3 * sizeof(float));
    }
}

static void add_doubts(Film *sum, const Film *film, const Part *part, bool first)
{
    for (size_t i = part->begin; film->certificate && i < part->end; i++)
        sum->certificate[i] = first ? film->certificate[i] : fmaxf(sum->certificate[i], film->certificate[i]);
}

static void add_cover(FilmCover *cover, uint32_t id)
{
    if (!id) return;
    for (int k = 0; k < FILM_COVERS; k++) {
        if (cover->id[k] && cover->id[k] != id) continue;
        cover->id[k] = id;
        cover->weight[k] += 1;
        return;
    }
}

bool samples_add(Samples *samples, const Film *film, const atomic_bool *cancel)
{
    Film *sum = samples->sum;
    bool first = !samples->count++;
    Part part = {0};
    while (next_part(&part, film, cancel)) {
        add_layer(sum->color, film->color, &part, 4, first);
        add_layer(sum->normal, film->normal, &part, 3, first);
        add_places(sum, film, &part, first);
        add_doubts(sum, film, &part, first);
        if (!film->id) continue;
        if (first) memset(samples->cover + part.begin, 0, (part.end - part.begin) * sizeof *samples->cover);
        for (size_t i = part.begin; i < part.end; i++) add_cover(&samples->cover[i], film->id[i]);
    }
    return parts_are_done(&part, film);
}

// Turns counts into weights and sorts them by weight; equal ones stay in their order.
static void resolve_cover(FilmCover *cover, float share)
{
    for (int k = 0; k < FILM_COVERS; k++) {
        uint32_t id = cover->id[k];
        float weight = cover->weight[k] * share;
        int place = k;
        for (; place > 0 && cover->weight[place - 1] < weight; place--) {
            cover->id[place] = cover->id[place - 1];
            cover->weight[place] = cover->weight[place - 1];
        }
        cover->id[place] = id;
        cover->weight[place] = weight;
    }
}

static void resolve_normal(float normal[3])
{
    float length = sqrtf(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    if (length <= 0) return;
    for (int c = 0; c < 3; c++) normal[c] /= length;
}

bool samples_resolve(Samples *samples, Film *film, const atomic_bool *cancel)
{
    const Film *sum = samples->sum;
    float share = 1 / (float)samples->count;
    Part part = {0};
    while (next_part(&part, film, cancel)) {
        size_t begin = part.begin, count = part.end - part.begin;
        for (size_t i = 4 * begin; film->color && i < 4 * part.end; i++) film->color[i] = sum->color[i] * share;
        if (film->depth) memcpy(film->depth + begin, sum->depth + begin, count * sizeof(float));
        if (film->position) memcpy(film->position + 3 * begin, sum->position + 3 * begin, 3 * count * sizeof(float));
        if (film->certificate) memcpy(film->certificate + begin, sum->certificate + begin, count * sizeof(float));
        for (size_t i = begin; film->normal && i < part.end; i++) {
            memcpy(film->normal + 3 * i, sum->normal + 3 * i, 3 * sizeof(float));
            resolve_normal(film->normal + 3 * i);
        }
        for (size_t i = begin; film->id && i < part.end; i++) {
            resolve_cover(&samples->cover[i], share);
            film->id[i] = samples->cover[i].id[0];
        }
    }
    film->cover = samples->cover;
    return parts_are_done(&part, film);
}
