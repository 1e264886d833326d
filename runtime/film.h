// A picture in memory: the layers of one frame, as the renderer gives them and the image writers take them.
//
// Rows run from the top, pixels from the left, without padding. A layer that was not asked for is NULL. Memory is
// the film's own, made once for a size and used for every frame.
//
//     Film *film = film_new(width, height, FILM_COLOR | FILM_DEPTH);
//     …renderer fills it…
//     film_free(film);
#ifndef SCN_RUNTIME_FILM_H
#define SCN_RUNTIME_FILM_H

#include <stdbool.h>
#include <stdint.h>

typedef enum FilmLayer {
    FILM_COLOR = 1, // R G B linear light, A coverage 0 … 1 (the background is in R G B where A is less than 1)
    FILM_DEPTH =
        2, // distance from the eye along the viewing direction (not along the ray); +infinity where nothing is hit
    FILM_NORMAL = 4,       // outward, unit length, world coordinates; 0 0 0 where nothing is hit
    FILM_POSITION = 8,     // world coordinates; 0 0 0 where nothing is hit
    FILM_ID = 16,          // 1 + index into Plan.objects; 0 where nothing is hit
    FILM_CERTIFICATE = 32, // 0: what the ray meets first is certain; 1: floats could not tell (a general field's alone)
} FilmLayer;
#define FILM_ALL 63u

// Which objects cover a pixel, by falling weight; free places have id 0 and weight 0.
#define FILM_COVERS 4
typedef struct FilmCover {
    uint32_t id[FILM_COVERS]; // as in Film.id
    float weight[FILM_COVERS];
} FilmCover;

typedef struct Film {
    int width, height;
    unsigned layers;    // FilmLayer bits
    float *color;       // 4 a pixel
    float *depth;       // 1
    float *normal;      // 3: unit length, towards the viewer
    float *position;    // 3
    uint32_t *id;       // 1
    float *certificate; // 1
    FilmCover *cover;   // one a pixel, of a picture made from several frames (runtime/sample.h); else NULL
    // Where in its pixel the ray goes, from the pixel's left and top edge: 0.5 0.5 is the centre. Many frames with
    // different places make one smooth picture (runtime/sample.h).
    double place_x, place_y;
    void *memory; // holds all layers
} Film;

// NULL where the memory is not there. width and height are 1 … FILM_MAX_SIZE. The place is the centre.
Film *film_new(int width, int height, unsigned layers);
void film_free(Film *film); // NULL is nothing
#define FILM_MAX_SIZE 32768

// Bytes of a film of that size.
uint64_t film_bytes(int width, int height, unsigned layers);

#endif
