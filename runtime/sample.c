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

static void add_floats(float *sum, const float *values, size_t count)
{
    for (size_t i = 0; i < count; i++) sum[i] += values[i];
}

static void add_places(Film *sum, const Film *film, size_t pixels)
{
    for (size_t i = 0; i < pixels; i++) {
        if (!(film->depth[i] < sum->depth[i])) continue;
        sum->depth[i] = film->depth[i];
        if (film->position) memcpy(sum->position + 3 * i, film->position + 3 * i, 3 * sizeof(float));
    }
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

void samples_add(Samples *samples, const Film *film)
{
    Film *sum = samples->sum;
    size_t pixels = (size_t)film->width * (size_t)film->height;
    if (!samples->count++) {
        if (film->color) memcpy(sum->color, film->color, pixels * 4 * sizeof(float));
        if (film->normal) memcpy(sum->normal, film->normal, pixels * 3 * sizeof(float));
        if (film->depth) memcpy(sum->depth, film->depth, pixels * sizeof(float));
        if (film->position) memcpy(sum->position, film->position, pixels * 3 * sizeof(float));
        if (film->certificate) memcpy(sum->certificate, film->certificate, pixels * sizeof(float));
        if (film->id) memset(samples->cover, 0, pixels * sizeof *samples->cover);
    } else {
        if (film->color) add_floats(sum->color, film->color, pixels * 4);
        if (film->normal) add_floats(sum->normal, film->normal, pixels * 3);
        if (film->depth) add_places(sum, film, pixels);
        for (size_t i = 0; film->certificate && i < pixels; i++)
            sum->certificate[i] = fmaxf(sum->certificate[i], film->certificate[i]);
    }
    if (film->id)
        for (size_t i = 0; i < pixels; i++) add_cover(&samples->cover[i], film->id[i]);
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

void samples_resolve(Samples *samples, Film *film)
{
    const Film *sum = samples->sum;
    size_t pixels = (size_t)film->width * (size_t)film->height;
    float share = 1 / (float)samples->count;
    if (film->color)
        for (size_t i = 0; i < pixels * 4; i++) film->color[i] = sum->color[i] * share;
    if (film->depth) memcpy(film->depth, sum->depth, pixels * sizeof(float));
    if (film->position) memcpy(film->position, sum->position, pixels * 3 * sizeof(float));
    if (film->certificate) memcpy(film->certificate, sum->certificate, pixels * sizeof(float));
    for (size_t i = 0; film->normal && i < pixels; i++) {
        memcpy(film->normal + 3 * i, sum->normal + 3 * i, 3 * sizeof(float));
        resolve_normal(film->normal + 3 * i);
    }
    for (size_t i = 0; film->id && i < pixels; i++) {
        resolve_cover(&samples->cover[i], share);
        film->id[i] = samples->cover[i].id[0];
    }
    film->cover = samples->cover;
}
