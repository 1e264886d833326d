// One patch, solved on the host in double: the reference, and what `--solver direct` uses.
//
//     PatchHost *patch = patch_host_new(&model, PATCH_DIRECT, &failure);
//     patch_host_start(patch, edges, start, NULL);
//     while (patch->steps < wanted) {
//         …edges at patch->time + step, forces at patch_host_force_time(patch)…
//         if (!patch_host_step(patch, &(PatchDrive){.edges = edges, .force = {NULL, NULL, forces}}, &fault)) …fault.text…
//     }
//     patch_host_free(patch);
//
// PATCH_DIRECT factors L + μ by banded Cholesky (runtime/patch_band.h): one factor for each different stiffness of the
// three components, made again only when step, density, damping, scheme, stiffness, grid or pins change, not when edges
// or forces do. A contact is solved by conjugate gradients that this factor preconditions.
//
// PATCH_GAUSS_SEIDEL is the literature's "iterative" reading, for study: it starts each step from the last shape, stops
// at the tolerance or the limit of sweeps, and says how far it came. It takes tens of thousands of sweeps a step on 33
// nodes. It knows no contacts.
//
// The same calls give the same bits on the same machine. Going on from a checkpoint gives the bits of running through.
#ifndef SCN_RUNTIME_PATCH_HOST_H
#define SCN_RUNTIME_PATCH_HOST_H

#include <stdint.h>

#include "runtime/failure.h"
#include "runtime/patch_contact.h"
#include "runtime/patch_model.h"
#include "runtime/patch_state.h"

typedef enum PatchSolver { PATCH_DIRECT, PATCH_GAUSS_SEIDEL } PatchSolver;

// Why a patch stopped.
typedef enum PatchFaultKind { PATCH_FINE, PATCH_DIVERGED, PATCH_INDEFINITE } PatchFaultKind;

typedef struct PatchFault {
    PatchFaultKind kind;
    int component;  // 0 … 2
    int i, j;       // the node, where it diverged
    uint64_t step;  // number of the step that failed, from 0
    double value;   // the coordinate, where it diverged; not finite perhaps
    char text[200]; // a sentence for people, without a full stop
} PatchFault;

typedef struct PatchHost {
    PatchModel model; // as set last; its pins are the patch's own copy
    PatchSolver solver;
    uint64_t steps;      // done since the start
    double time;         // seconds since the start
    double *x[3], *v[3]; // places and V over nodes, with the edges of `time`
    // Gauss–Seidel: when to stop, and how the last step ended (the worst component).
    int sweep_limit;
    double tolerance;
    int sweeps;
    double residual; // |right side − matrix · x| / |right side|
    int factored;    // factorisations so far
    int iterations;  // of conjugate gradients in the last step: 0 without a contact
    struct PatchHostWork *work;
} PatchHost;

// What drives one step. Zero and NULL: nothing new.
typedef struct PatchDrive {
    const PatchEdges *edges;  // at the end of the step; NULL: as they are
    const double *force[3];   // over nodes, added to the model's force, at patch_host_force_time(); NULL: none
    PatchContactLaw *contact; // NULL: none
    void *context;            // of the law
} PatchDrive;

// NULL with `failure` set: the model is not one that can be solved (the finding of patch_diagnose() that says so), or
// no memory. The patch is the flat unit square, at rest. The caller frees it.
PatchHost *patch_host_new(const PatchModel *model, PatchSolver solver, Failure *failure);
void patch_host_free(PatchHost *patch); // NULL is nothing

// Sets another model on the same grid. Places, V and time stay.
bool patch_host_model(PatchHost *patch, const PatchModel *model, Failure *failure);

// Starts anew at time 0 from places and velocities over nodes (a NULL among them: the flat square, at rest); the frame
// of the places is taken from the edges (NULL: the unit square's), pinned nodes are put where their pins are.
void patch_host_start(PatchHost *patch, const PatchEdges *edges, const double *const x[3], const double *const v[3]);

// The time at which the forces of the next step are to be evaluated: now (implicit), or in the middle of the step
// (newmark).
double patch_host_force_time(const PatchHost *patch);

// Does one step. False with `fault` set where the patch diverges or the matrix is not positive definite; the state is
// then as before.
bool patch_host_step(PatchHost *patch, const PatchDrive *drive, PatchFault *fault);

// Names the processor, of which LAPACK's bits depend: checkpoints of equal keys go on to equal bits.
void patch_host_key(char key[static PATCH_SOLVER_KEY]);

// Writes a checkpoint if `capacity` suffices and returns the bytes it needs; bytes may be NULL.
size_t patch_host_save(const PatchHost *patch, void *bytes, size_t capacity);

// Goes back to a checkpoint. The model is not in it: set the one that was. False with `failure` set, and nothing
// changed, if it does not fit.
bool patch_host_restore(PatchHost *patch, const void *bytes, size_t size, Failure *failure);

// The edges of the patch's time.
const PatchEdges *patch_host_edges(const PatchHost *patch);

// Energy of the free patch with its edges at zero, (ρ/2 + η dt/4)|V|² + ½ xᵀLx over unknowns of a component: it never
// grows in the implicit scheme.
double patch_host_energy(const PatchHost *patch, int component);

#endif
