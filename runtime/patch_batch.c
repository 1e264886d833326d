#include "runtime/patch_batch.h"

#include <stdlib.h>
#include <string.h>

PatchBatch *patch_batch_new(int nodes, PatchClosure closure)
{
    PatchBatch *batch = calloc(1, sizeof *batch);
    if (batch) *batch = (PatchBatch){.nodes = nodes, .closure = closure};
    return batch;
}

int patch_batch_join(PatchBatch *batch)
{
    batch->left++;
    return batch->members++;
}

void patch_batch_leave(PatchBatch *batch)
{
    if (!batch || --batch->left > 0) return;
    patch_device_free(batch->patches);
    free(batch->steps);
    free(batch->solids);
    free(batch->touched);
    free(batch);
}

bool patch_batch_open(PatchBatch *batch, Device *device, bool cached, Failure *failure)
{
    if (batch->patches) return true;
    if (!batch->steps) batch->steps = calloc((size_t)batch->members, sizeof *batch->steps);
    if (!batch->steps) return fail(failure, "out of memory for patches");
    batch->patches = patch_device_new(device, batch->nodes, batch->closure, batch->members, failure);
    // Where the kernels cannot be kept nothing is lost but the time to build them again.
    if (batch->patches && cached) patch_device_store(batch->patches, &(Failure){""});
    return batch->patches != NULL;
}

static bool grow(PatchBatch *batch, Failure *failure)
{
    int room = 2 * batch->solid_room + 16;
    PatchSolid *solids = realloc(batch->solids, (size_t)room * sizeof *solids);
    if (solids) batch->solids = solids;
    int *touched = realloc(batch->touched, (size_t)room * sizeof *touched);
    if (touched) batch->touched = touched;
    if (!solids || !touched) return fail(failure, "out of memory for what touches patches");
    batch->solid_room = room;
    return true;
}

bool patch_batch_touch(PatchBatch *batch, int member, const PatchSolid *solid, Failure *failure)
{
    if (batch->solid_count == batch->solid_room && !grow(batch, failure)) return false;
    batch->solids[batch->solid_count] = *solid;
    batch->touched[batch->solid_count++] = member;
    return true;
}

void patch_batch_will_step(PatchBatch *batch, int member, int steps)
{
    batch->steps[member] = steps;
    batch->waiting |= steps > 0;
}

void patch_batch_drop(PatchBatch *batch)
{
    if (batch->steps) memset(batch->steps, 0, (size_t)batch->members * sizeof *batch->steps);
    batch->waiting = false;
    batch->solid_count = 0;
}

bool patch_batch_launch(PatchBatch *batch, Failure *failure)
{
    bool ok = patch_device_solids(batch->patches, batch->solids, batch->touched, batch->solid_count, failure) &&
              patch_device_step(batch->patches, batch->steps, failure);
    patch_batch_drop(batch);
    return ok;
}
