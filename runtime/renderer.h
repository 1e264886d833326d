// Frames on a device: uploads what a frame's values give, runs the kernel tile by tile, brings the layers into a film.
//
//     Renderer *renderer = renderer_new(device, program->cl, plan, &failure);
//     if (renderer_frame(renderer, &(RenderJob){.values = values, .film = film}, &stats, &failure) == RENDER_DONE) …
//     renderer_free(renderer);
//
// A Renderer belongs to one plan and one program and is used by one thread at a time; a film may be of another size every time. After the
// first frame of a size and number of lights nothing is allocated. A frame whose geometry and views are those of the frame before uploads nothing.
#ifndef SCN_RUNTIME_RENDERER_H
#define SCN_RUNTIME_RENDERER_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include <CL/cl.h>

#include "compiler/plan.h"
#include "runtime/camera.h"
#include "runtime/device.h"
#include "runtime/failure.h"
#include "runtime/film.h"

typedef struct Renderer Renderer;

typedef enum RenderResult { RENDER_DONE, RENDER_CANCELLED, RENDER_FAILED } RenderResult;

// How far a frame goes: less than all is for measuring.
typedef enum RenderStages { RENDER_ALL, RENDER_LISTS, RENDER_HITS, RENDER_SHADOWS } RenderStages;

typedef struct RenderJob {
    const double *values;                  // of the frame (compiler/frame.h), plan->slot_count
    const struct PatchCells *const *cells; // of the plan's patches at that time; NULL where it has none
    Film *film;                            // its size, layers and place in the pixel say what is rendered
    const atomic_bool *cancel; // may be set by any thread: the frame ends within a tenth of a second; NULL: never
    void (*progress)(void *data, double share); // called between bands with what is done of the frame, 0 … 1; NULL: not
    void *progress_data;
    RenderStages stages;
} RenderJob;

typedef struct RenderStats {
    double fold_ms; // wall time of folding views
    double run_ms;  // … from the first band's start to the picture's end
    int views;      // of the camera and all lights
    int bands;
    uint32_t items;        // components and perturbations
    uint32_t list_room;    // items in the list of a tile; a tile that wants more is run again with more room
    uint64_t device_bytes; // of all buffers
    uint32_t uncertain;    // pixels whose first surface floats could not tell
    uint64_t shadow_rays;  // rays from what is seen to lights that it faces
} RenderStats;

// NULL with `failure` set. Borrows the device, the program and the plan.
Renderer *renderer_new(const Device *device, cl_program program, const Plan *plan, Failure *failure);
void renderer_free(Renderer *renderer); // NULL is nothing

// `stats` may be NULL. Where it was cancelled or failed the film holds some tiles of the frame.
RenderResult renderer_frame(Renderer *renderer, const RenderJob *job, RenderStats *stats, Failure *failure);

// Bounds of what the frame shows, for cameras that frame the scene. Sides without an end are infinite; low > high: nothing is shown.
void renderer_bounds(Renderer *renderer, const double *values, Box *box);

#endif
