// The patches of a scene that is rendered: solved to the time of a frame, and as cells that can be drawn.
//
//     FrameError error;
//     if (!scene_patches_to(scene, time, scene->values, &error)) …error.text at error.span…
//     RenderJob job = {.values = scene->values, .cells = scene_patches_cells(scene), …};
//
// They are made when the first frame wants them, and kept: the next frame goes on from where this one is.
#ifndef SCN_RUNTIME_SCENE_PATCHES_H
#define SCN_RUNTIME_SCENE_PATCHES_H

#include "compiler/frame.h"
#include "runtime/patch_cells.h"
#include "runtime/scene.h"

// Solves all patches to a time and writes their boxes to the frame's values. True at once where there are none.
bool scene_patches_to(ScnScene *scene, double time, double *values, FrameError *error);

// By patch; NULL where there are none.
const PatchCells *const *scene_patches_cells(const ScnScene *scene);

// Copies of the cells as they are now, for later; NULL where there is no memory. patches_copy_free() frees them.
const PatchCells *const *scene_patches_copy(const ScnScene *scene);
void patches_copy_free(const PatchCells *const *copy, uint32_t count);

void scene_patches_free(ScnScene *scene);

#endif
