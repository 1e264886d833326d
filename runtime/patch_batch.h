// Patches of a scene that step together on the device: one launch does a step of all of them, one read brings all shapes.
//
//     PatchBatch *batch = patch_batch_new(nodes, closure);
//     int k = patch_batch_join(batch);                             for each patch, before the batch is opened
//     if (!patch_batch_open(batch, device, cached, &failure)) …    makes batch->patches
//     for each round:
//         …patch_device_edges(batch->patches, k, …)…  patch_batch_touch(batch, k, &solid, &failure)
//         patch_batch_will_step(batch, k, steps)
//         if (!patch_batch_launch(batch, &failure)) …              does what will step; the others rest
//     patch_batch_leave(batch);                                    as often as it was joined: the last one frees it
//
// Those that share a batch have equal grids and closures, and it is best that they are alike in whether they touch solids and
// whether many steps are one launch (runtime/patch_device.h). Which patches are together changes no bit.
#ifndef SCN_RUNTIME_PATCH_BATCH_H
#define SCN_RUNTIME_PATCH_BATCH_H

#include "runtime/patch_device.h"

typedef struct PatchBatch {
    PatchDevice *patches; // NULL: not opened
    int nodes, members, left;
    PatchClosure closure;
    int *steps;   // of each, in the next launch
    bool waiting; // one of them is not 0
    PatchSolid *solids;
    int *touched; // which patch a solid pushes
    int solid_count, solid_room;
} PatchBatch;

// NULL where there is no memory.
PatchBatch *patch_batch_new(int nodes, PatchClosure closure);

// A place in the batch.
int patch_batch_join(PatchBatch *batch);
void patch_batch_leave(PatchBatch *batch); // NULL is nothing

// Makes the patches on the device, if they are not there. `cached`: their kernels are kept on disk.
bool patch_batch_open(PatchBatch *batch, Device *device, bool cached, Failure *failure);

// What pushes a patch in the next launch.
bool patch_batch_touch(PatchBatch *batch, int member, const PatchSolid *solid, Failure *failure);

void patch_batch_will_step(PatchBatch *batch, int member, int steps);

// Does the steps and forgets them and the solids.
bool patch_batch_launch(PatchBatch *batch, Failure *failure);

// Forgets what would be launched.
void patch_batch_drop(PatchBatch *batch);

#endif
