// What drives a patch of a scene: its equation, edges, forces and what acts on it, evaluated from its program
// (compiler/plan.h) at the times of its steps.
//
//     PatchDriver *drive = patch_driver_new(&plan->patches[k], fps);
//     patch_driver_at(drive, t, inputs, &trouble)            the numbers at t: drive->model, without its pins
//     patch_driver_force(drive, x, &trouble)                 forces over nodes at that time, presses included
//     patch_driver_at(drive, t + dt, inputs, &trouble)       … and at the end of the step
//     patch_driver_edges(drive, x, &trouble)                 edges, and pins into drive->model
//     patch_host_step(host, &(PatchDrive){…, .contact = patch_driver_contact, .context = drive}, &fault)
//
// Everything is in double; a value that is not finite stops with the place in the scene. `x`, the nodes' places, is
// what x, y and z mean in the scene's expressions, and where presses and contacts meet the patch.
//
// A press at (u, v) stands in the frame of the surface there: its origin at the surface, z along the normal x_u × x_v, x
// along x_u. At each node it is a force along that normal: strength times the function of the perturbation there.
//
// A contact pushes nodes that are inside of an object out along −∇F/|∇F| with its stiffness times their depth, the length
// to the surface that way (runtime/patch_contact.h says how a step takes that in).
#ifndef SCN_RUNTIME_PATCH_DRIVE_H
#define SCN_RUNTIME_PATCH_DRIVE_H

#include "compiler/frame.h"
#include "runtime/patch_contact.h"
#include "runtime/patch_model.h"

typedef struct PatchDriver {
    const PlanPatch *patch;
    double fps;
    double *values;    // slots of the program, as evaluated last
    PatchModel model;  // its pins point to `pins`
    PatchPin *pins;    // of the parts
    PatchEdges *edges; // as patch_driver_edges() left them
    double *force[3];  // over nodes
    bool has_force[3]; // a component that is not NULL for the solver
    bool has_contact;
    bool edges_known; // they need not be evaluated again
    double *memory;
} PatchDriver;

// NULL where the memory is not there. The plan has to outlive it; the caller frees it.
PatchDriver *patch_driver_new(const PlanPatch *patch, double fps);
void patch_driver_free(PatchDriver *driver); // NULL is nothing

bool patch_driver_at(PatchDriver *driver, double time, const double *inputs, FrameError *error);
bool patch_driver_edges(PatchDriver *driver, const double *const x[3], FrameError *error);
bool patch_driver_force(PatchDriver *driver, const double *const x[3], FrameError *error);

// Places over nodes at the start, from the scene's `start`.
bool patch_driver_start(PatchDriver *driver, double *const x[3], FrameError *error);

// A PatchContactLaw whose context is a PatchDriver.
void patch_driver_contact(void *context, const PatchTouch *touch);

// The solid of a contact with a quadric, moved or not. False for other objects.
bool patch_driver_solid(const PatchDriver *driver, const PlanPart *part, PatchSolid *solid);

#endif
