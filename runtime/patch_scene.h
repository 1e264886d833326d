// A patch of a scene as it is at a time: solved from its start, step by step, with what the scene says of it.
//
//     PatchSolve *solve = patch_solve_new(&plan->patches[k], &(PatchSolveDesc){.fps = plan->fps}, &failure);
//     while (…) {
//         if (!patch_solve_to(solve, time, inputs, &error)) …error.text at error.span…
//         PatchShape shape = patch_solve_shape(solve);
//     }
//     patch_solve_free(solve);
//
// Simulation time is the scene's time and has its own steps. Between two of them the shape is the mix of both. What is
// shown at a time follows from the scene, its params and that time alone: a moment that is asked for first gives the
// bits of running through, on the same device: also where it is found by a checkpoint. (Handles that move while time goes on are the exception that they have to be: the patch goes
// on from where it is. Where they move and time does not go on, it is solved again from its start.)
//
// On the device nothing is read back before the step that is shown, and where nothing of the equation changes with time, steps are one launch.
//
// Whatever cannot be solved stops with a sentence and a place in the scene: an equation that patch_diagnose() refuses,
// a patch that diverges, a value that is not finite. A shape never holds what is not finite.
#ifndef SCN_RUNTIME_PATCH_SCENE_H
#define SCN_RUNTIME_PATCH_SCENE_H

#include <stdint.h>

#include "compiler/frame.h"
#include "runtime/device.h"
#include "runtime/failure.h"
#include "runtime/patch_model.h"

typedef enum PatchMethod { PATCH_METHOD_DIRECT, PATCH_METHOD_DEVICE, PATCH_METHOD_ITERATIVE } PatchMethod;

// "device", "direct", "gauss-seidel". False for other words.
bool patch_method_named(const char *name, PatchMethod *method);

typedef struct PatchSolveDesc {
    double fps; // of the scene: what `frame` counts
    PatchMethod method;
    Device *device; // of PATCH_METHOD_DEVICE; has to outlive the solve
    bool
        anyway; // what the device does not know (contacts with other solids than quadrics, many pins) is solved directly
    bool cached;             // checkpoints are kept on disk (runtime/patch_cache.h): not of PATCH_METHOD_ITERATIVE
    const char *checkpoints; // … in this folder, cached or not; NULL: in that of the cache
    int sweeps;              // limit of PATCH_METHOD_ITERATIVE in a step; 0: its default
} PatchSolveDesc;

typedef struct PatchSolve PatchSolve;

typedef struct PatchShape {
    int nodes;
    const double *x[3]; // places over nodes
    const PatchEdges *edges;
    PatchTangents tangents;
    double time;    // that was asked for
    uint64_t steps; // done so far
    int sweeps;     // of the last step of PATCH_METHOD_ITERATIVE, and its residual
    double residual;
} PatchShape;

PatchSolve *patch_solve_new(const PlanPatch *patch, const PatchSolveDesc *desc, Failure *failure);
void patch_solve_free(PatchSolve *solve); // NULL is nothing

// Brings the patch to a time, from where it is or from its start. `inputs` are the scene's handles. After false nothing
// may be asked of the shape, and the next call starts anew.
bool patch_solve_to(PatchSolve *solve, double time, const double *inputs, FrameError *error);

// The same for many patches, which step together: those that are alike in one launch (runtime/patch_batch.h), where they
// were joined before any of them was solved. The bits are those of each alone.
void patch_solves_join(PatchSolve *const *solves, uint32_t count);
bool patch_solves_to(PatchSolve *const *solves, uint32_t count, double time, const double *inputs, FrameError *error);

// What the patch is now: good until the next call.
PatchShape patch_solve_shape(const PatchSolve *solve);

// How many checkpoints were damaged, and so not used, since it was made; and of the last the file and the reason, "" if
// there is none.
int patch_solve_damaged(const PatchSolve *solve);
const char *patch_solve_damage(const PatchSolve *solve);

// The value and the place of the shape at (u, v), by its bicubic cells (runtime/patch_cells.h): exact at nodes.
bool patch_solve_point(PatchSolve *solve, double u, double v, double place[3]);

#endif
