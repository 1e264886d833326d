// PNG, for looking at: the colour of a film, encoded as sRGB (IEC 61966-2-1, the exact curve, clipped to 0 … 1).
#ifndef SCN_RUNTIME_IMAGE_PNG_H
#define SCN_RUNTIME_IMAGE_PNG_H

#include "runtime/file.h"
#include "runtime/film.h"

// Fills a row of a picture that is no film: sRGB of 8 bits, three bytes a pixel.
typedef void PngRow(void *context, int y, uint8_t *row);

typedef struct PngDesc {
    const Film *film; // has FILM_COLOR; its alpha is left out, since the background is in the colour
    int bits;         // 8 or 16 a channel; 0: 8
    PngRow *row;      // instead of a film, with …
    void *context;
    int width, height;
    const char *scene, *software; // texts in the file; NULL: none
    Unfinished *unfinished;       // may be NULL
} PngDesc;

// Writes the file whole or not at all; `failure` names it.
bool image_write_png(const char *path, const PngDesc *desc, Failure *failure);

// Encoded value of linear light, 0 … 1.
double srgb_encode(double linear);

#endif
