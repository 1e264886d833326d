// Many patches of one grid at once on an OpenCL device, in float, in the basis of beam modes (kernels/patch.cl).
//
//     PatchDevice *patches = patch_device_new(device, nodes, closure, count, &failure);
//     for each: patch_device_model(patches, k, &model, &failure); patch_device_start(patches, k, edges, x, v);
//     for each frame:
//         patch_device_model() where handles moved, patch_device_edges() and patch_device_force() where they change
//         patch_device_step(patches, steps, &failure)       enqueues; nothing is waited for and nothing read
//         patch_device_show(patches, SHOW_PLACES, &failure) the nodes' places, into patches->nodes on the device
//         patch_device_read(patches, k, x, v, &fault, &failure)                          … and on the host
//     patch_device_free(patches);
//
// It takes the steps of PatchHost (runtime/patch_host.h): the same scheme, edges, forces, pins and contacts, within
// what float and the tolerance of conjugate gradients leave (1e-6 of the shape, 1e-5 at 129 nodes). Nothing of the
// model is in a factor: every number of it may change in every frame at no cost but its upload (pins cost a small
// matrix for each change of stiffness, step, density or damping).
//
// What differs from the host's solver: edges and forces that change in every step make launches of one step. Pins are
// at most 64 a patch, and hold to about 1e-6. Divergence is seen by the device: the patch rests with its last good
// shape, and whoever reads it is told; it stays so, whatever it is given, until it is started anew or told to go on. A
// patch whose matrix is not positive definite is stopped too, as soon as a step meets a direction that shows it.
//
// The bits depend on the device and its compiler, not on threads, the number of patches, or how steps are put into
// launches.
#ifndef SCN_RUNTIME_PATCH_DEVICE_H
#define SCN_RUNTIME_PATCH_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#include "kernels/patch_shared.h"
#include "runtime/device.h"
#include "runtime/failure.h"
#include "runtime/patch_contact.h"
#include "runtime/patch_host.h"
#include "runtime/patch_model.h"
#include "runtime/patch_state.h"

typedef struct PatchDevice PatchDevice;

// What a contact law of the caller's own finds on the device, as it is called before each step: it enqueues a kernel on
// the device's queue that reads `nodes` (places: 3 components of nodes² floats a patch) and adds to `touch` (forces,
// laid out like nodes) and `kappa` (nodes² floats a patch, never negative), which are zero. See runtime/patch_contact.h
// for what they mean. False with `failure` set stops.
typedef bool PatchDeviceLaw(void *context, PatchDevice *patches, cl_mem nodes, cl_mem touch, cl_mem kappa,
                            Failure *failure);

// `count` flat patches at rest with the base model, all of one closure, as their modes are. NULL with `failure` set. The device has to outlive them; the caller
// frees them.
PatchDevice *patch_device_new(Device *device, int nodes, PatchClosure closure, int count, Failure *failure);
void patch_device_free(PatchDevice *patches); // NULL is nothing

// How many times the OpenCL compiler ran: 1, or 0 where the cache had the binary (runtime/program.h), or other patches of the device have it. Storing puts it
// there, which long renderings have the time for.
int patch_device_builds(const PatchDevice *patches);
bool patch_device_store(const PatchDevice *patches, Failure *failure);

// Sets the model of a patch; its edges, forces and state stay. False with `failure` set: not acceptable
// (runtime/patch_diagnose.h).
bool patch_device_model(PatchDevice *patches, int patch, const PatchModel *model, Failure *failure);

// A patch that had stopped goes on from its last good shape.
void patch_device_resume(PatchDevice *patches, int patch);

// Starts a patch anew at time 0, as patch_host_start() does.
bool patch_device_start(PatchDevice *patches, int patch, const PatchEdges *edges, const double *const x[3],
                        const double *const v[3], Failure *failure);

// The edges at the end of the next step and from then on.
bool patch_device_edges(PatchDevice *patches, int patch, const PatchEdges *edges, Failure *failure);

// Forces over nodes, added to the model's own from the next step on; NULL components: none.
bool patch_device_force(PatchDevice *patches, int patch, const double *const force[3], Failure *failure);

// Solids that push patches, from the next step on; copied. `patch[s]` is the one that solid s pushes. No solids: count
// 0.
bool patch_device_solids(PatchDevice *patches, const PatchSolid *solids, const int *patch, int count, Failure *failure);

// A law of the caller's own, asked beside the solids; NULL: none.
void patch_device_law(PatchDevice *patches, PatchDeviceLaw *law, void *context);

// Most iterations of conjugate gradients in a step, and the residual at which they stop. 40 and 1e-6 if this is not
// called.
void patch_device_precision(PatchDevice *patches, int iterations, double tolerance);

// Enqueues steps[k] steps of each patch k.
bool patch_device_step(PatchDevice *patches, const int *steps, Failure *failure);

// Enqueues the writing of places (SHOW_PLACES) or velocities (SHOW_VELOCITIES) of all patches to the buffer of nodes.
bool patch_device_show(PatchDevice *patches, int what, Failure *failure);
cl_mem patch_device_nodes(const PatchDevice *patches); // 3 components of nodes² floats a patch

// Waits, and gives places and velocities over nodes (NULL: not wanted) and how the patch is: fault->kind is PATCH_FINE
// or why it stopped. What is read are the places and results of all patches at once, which the others are then given
// without waiting.
bool patch_device_read(PatchDevice *patches, int patch, double *const x[3], double *const v[3], PatchFault *fault,
                       Failure *failure);

// Waits, and says how a slot (component of a patch) did in the last launch.
bool patch_device_result(PatchDevice *patches, int patch, int component, PatchResult *result, Failure *failure);

// The edges of the patch's time, of all steps that it was told to do.
const PatchEdges *patch_device_edges_now(const PatchDevice *patches, int patch);

// Seconds and steps since the start that a patch was told to do, and when its next step's forces are wanted.
double patch_device_time(const PatchDevice *patches, int patch);
uint64_t patch_device_steps(const PatchDevice *patches, int patch);
double patch_device_force_time(const PatchDevice *patches, int patch);

// Names the kernels and the device: checkpoints of equal keys go on to equal bits.
void patch_device_key(const PatchDevice *patches, char key[static PATCH_SOLVER_KEY]);

// A checkpoint of a patch, as patch_host_save() and patch_host_restore(); its model, forces and solids are not in it, its
// edges are. It does not matter which patch, or of how many, it was; one that could not be
// restored has to be started anew. The size is 0 with `failure` set where the device
// does not answer.
size_t patch_device_save(PatchDevice *patches, int patch, void *bytes, size_t capacity, Failure *failure);
bool patch_device_restore(PatchDevice *patches, int patch, const void *bytes, size_t size, Failure *failure);

#endif
