// What the three files of patches on a device share (runtime/patch_device.h is the manual): patch_device.c makes them and
// launches, patch_device_drive.c writes what drives them, patch_device_read.c reads them and their checkpoints.
//
// All that may change by the frame lies in mirrors (runtime/patch_mirror.h); patch_device_step() uploads what has changed
// and launches.
#ifndef SCN_RUNTIME_PATCH_DEVICE_PARTS_H
#define SCN_RUNTIME_PATCH_DEVICE_PARTS_H

#include "runtime/patch_device.h"
#include "runtime/patch_mirror.h"
#include "runtime/patch_modes.h"
#include "runtime/program.h"

// What the host knows of a patch.
typedef struct PatchSide {
    PatchModel model;
    PatchPin *pins;    // of the model
    PatchEdges *edges; // at the end of the steps told so far
    PatchEdges *next;  // at the end of the next one
    bool moving;       // the two differ
    double origin;     // time at which the present dt began
    uint64_t steps, origin_step;
    uint64_t epoch_step; // steps done when the epoch of its records began
} PatchSide;

struct PatchDevice {
    Device *device;
    Program *program; // the device's
    int builds;
    cl_kernel step, show, contact;
    PatchClosure closure;
    int nodes, count, slots, pin_room;
    size_t group; // work-items of a work-group
    int iterations;
    double tolerance;
    PatchModes *modes;
    PatchSide *sides;
    PatchMirror records, table, load, force, edges, pins, targets, inverses, solids; // written by the host
    PatchMirror results, state, work, touch, kappa, places, pushes;                  // by the device
    int solid_count;
    PatchDeviceLaw *law;
    void *law_context;
    PatchEdges *inside;             // those of w in the next step
    double *frame, *square, *other; // over unknowns; over modes; two of those
    float *floats;                  // two arrays over modes
    bool fetched;                   // the next two are those of now
    float *read_places;             // of all slots over nodes
    PatchResult *read_results;      // of all slots
};

// How many values the modes of a slot are, and the nodes of a component.
static inline size_t patch_square_of(const PatchDevice *patches)
{
    return (size_t)patches->modes->order * patches->modes->order;
}

static inline size_t patch_grid_of(const PatchDevice *patches)
{
    return (size_t)patches->nodes * patches->nodes;
}

static inline void patch_floats_of(const double *from, float *to, size_t count)
{
    for (size_t k = 0; k < count; k++) to[k] = (float)from[k];
}

static inline bool patch_no_memory(Failure *failure)
{
    return fail(failure, "out of memory for patches");
}

static inline PatchRecord *patch_device_record(PatchDevice *patches, int slot) // to be changed
{
    return patch_mirror_change(&patches->records, (size_t)slot * sizeof(PatchRecord), sizeof(PatchRecord));
}

static inline bool patch_device_has_contact(const PatchDevice *patches)
{
    return patches->solid_count || patches->law;
}

// Makes room for `room` pins a patch. The pins have to be written anew.
bool patch_device_make_pins(PatchDevice *patches, int room, Failure *failure);

// To the device, with the next upload: the load of the edges of a patch in its next step, and the positions that a
// picture has along the edges.
void patch_device_write_load(PatchDevice *patches, int patch);
void patch_device_write_edges(PatchDevice *patches, int patch);

#endif
