// OpenEXR: the layers of a film with their numbers as they are.
//
//   layer      channels                                  type
//   color      R G B A                                   half (or float): linear light, A is coverage
//   depth      Z                                         float: along the viewing direction, +infinity where nothing is hit
//   normal     N.X N.Y N.Z                               half (or float)
//   position   P.X P.Y P.Z                               float
//   id         id                                        32-bit integer: 0 nothing, else the place in `scn/objects`, from 1
//              CryptoObject00.R …, CryptoObject01.R …    float: Cryptomatte 1.2, two objects and their coverage each; the
//                                                        manifest in the header gives their names
//   certificate certificate                              half (or float): 1 where the first surface is not certain, else 0
//
// One part of scan lines, ZIP compression (without loss). The header has `scn/version`, `scn/scene`, `scn/frame`,
// `scn/time` (seconds), `scn/objects` and `software`.
#ifndef SCN_RUNTIME_IMAGE_EXR_H
#define SCN_RUNTIME_IMAGE_EXR_H

#include "runtime/file.h"
#include "runtime/film.h"

typedef enum ExrPixels {
    EXR_PIXELS_AUTO,  // as in the table above
    EXR_PIXELS_HALF,  // half wherever it can be: not for Z, P, ids
    EXR_PIXELS_FLOAT, // float for all
} ExrPixels;

typedef struct ExrDesc {
    const Film *film;
    unsigned layers; // of those that the film has; 0: all of them
    ExrPixels pixels;
    const char *const *objects; // their names: objects[k] is that of id k + 1; "" has none
    uint32_t object_count;
    const char *scene; // NULL: none
    double time;
    int frame;
    Unfinished *unfinished; // may be NULL
} ExrDesc;

// Writes the file whole or not at all; `failure` names it.
bool image_write_exr(const char *path, const ExrDesc *desc, Failure *failure);

// The number that Cryptomatte gives to a name.
uint32_t cryptomatte_hash(const char *name);

#endif
