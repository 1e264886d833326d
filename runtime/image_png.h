// PNG, for looking at: the colour of a film, encoded as sRGB (IEC 61966-2-1, the exact curve, clipped to 0 … 1).
#ifndef SCN_RUNTIME_IMAGE_PNG_H
#define SCN_RUNTIME_IMAGE_PNG_H

#include "runtime/file.h"
#include "runtime/film.h"

typedef struct PngDesc {
    const Film *film;             // has FILM_COLOR; its alpha is left out, since the background is in the colour
    int bits;                     // 8 or 16 a channel; 0: 8
    const char *scene, *software; // texts in the file; NULL: none
    Unfinished *unfinished;       // may be NULL
} PngDesc;

// Writes the file whole or not at all; `failure` names it.
bool image_write_png(const char *path, const PngDesc *desc, Failure *failure);

// Encoded value of linear light, 0 … 1.
double srgb_encode(double linear);

#endif
