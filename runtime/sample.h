// One smooth picture from many frames, each with its rays at another place in the pixels: N x N places in a regular
// grid.
//
//     Samples *samples = samples_new(width, height, layers, n);
//     for (int i = 0; i < n * n; i++) { samples_place(samples, i, film); …render film…; samples_add(samples, film, NULL); }
//     samples_resolve(samples, film, NULL);
//
// Colour and coverage are means in linear light. Depth and position are those of the nearest sample of the pixel (so
// FILM_POSITION wants FILM_DEPTH too), the normal is the mean of the normals there are, made unit. Film.cover has the
// shares of the first FILM_COVERS objects that the pixel's samples met, by falling share; the id is the first of
// them. Objects beyond are left out.
#ifndef SCN_RUNTIME_SAMPLE_H
#define SCN_RUNTIME_SAMPLE_H

#include <stdatomic.h>

#include "runtime/film.h"

typedef struct Samples Samples;

Samples *samples_new(int width, int height, unsigned layers, int n); // NULL: no memory
void samples_free(Samples *samples);
void samples_clear(Samples *samples);
void samples_place(const Samples *samples, int index, Film *film); // sets film->place_x, place_y

// Both answer false, with half of the work done, soon after `cancel` is set, which may be NULL: a large picture takes
// tenths of a second. After samples_resolve() film->cover belongs to the samples.
bool samples_add(Samples *samples, const Film *film, const atomic_bool *cancel);
bool samples_resolve(Samples *samples, Film *film, const atomic_bool *cancel);

#endif
