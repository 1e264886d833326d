// What is read of patches on a device: places, how they are, and checkpoints.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/patch_device_parts.h"
#include "runtime/patch_state.h"

// Brings what is shown of all patches, and how they are, to the host.
static bool fetch(PatchDevice *patches, Failure *failure)
{
    size_t slots = (size_t)patches->slots;
    if (patches->fetched) return true;
    patches->fetched =
        patch_device_show(patches, SHOW_PLACES, failure) &&
        patch_mirror_read(&patches->places, patches->device, 0, slots * patch_grid_of(patches) * sizeof(float),
                          patches->read_places, failure) &&
        patch_mirror_read(&patches->results, patches->device, 0, slots * sizeof(PatchResult), patches->read_results,
                          failure);
    return patches->fetched;
}

static PatchResult result_of(const PatchDevice *patches, const PatchResult *results, int slot)
{
    int epoch = ((PatchRecord *)patches->records.bytes)[slot].epoch;
    return results[slot].epoch == epoch ? results[slot] : (PatchResult){.epoch = epoch};
}

bool patch_device_result(PatchDevice *patches, int patch, int component, PatchResult *result, Failure *failure)
{
    if (!fetch(patches, failure)) return false;
    *result = result_of(patches, patches->read_results, 3 * patch + component);
    return true;
}

static void find_fault(const PatchDevice *patches, int patch, PatchFault *fault)
{
    const PatchSide *side = &patches->sides[patch];
    *fault = (PatchFault){.kind = PATCH_FINE};
    for (int c = 0; c < 3 && fault->kind == PATCH_FINE; c++) {
        PatchResult result = result_of(patches, patches->read_results, 3 * patch + c);
        if (result.status == SLOT_FINE) continue;
        fault->component = c;
        fault->step = side->epoch_step + (uint64_t)result.steps;
        fault->value = result.size;
        double limit = side->model.limit > 0 ? side->model.limit : PATCH_LIMIT;
        if (result.status == SLOT_DIVERGED) {
            fault->kind = PATCH_DIVERGED;
            snprintf(fault->text, sizeof fault->text, "the patch diverges: in step %llu x%d went beyond %g",
                     (unsigned long long)fault->step, c + 1, limit);
        } else {
            fault->kind = PATCH_INDEFINITE;
            snprintf(fault->text, sizeof fault->text,
                     "the patch cannot take step %llu: for x%d the matrix of a step of %gs is not positive definite",
                     (unsigned long long)fault->step, c + 1, side->model.step);
        }
    }
}

static void places_of(const PatchDevice *patches, const float *values, int patch, double *const to[3])
{
    size_t grid = patch_grid_of(patches);
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; to[c] && k < grid; k++) to[c][k] = values[((size_t)patch * 3 + c) * grid + k];
}

// Velocities are asked for by studies alone, so they are not kept.
static bool read_speeds(PatchDevice *patches, int patch, double *const v[3], Failure *failure)
{
    size_t size = (size_t)patches->slots * patch_grid_of(patches) * sizeof(float);
    float *values = malloc(size);
    if (!values) return patch_no_memory(failure);
    bool ok = patch_device_show(patches, SHOW_VELOCITIES, failure) &&
              patch_mirror_read(&patches->places, patches->device, 0, size, values, failure);
    if (ok) places_of(patches, values, patch, v);
    free(values);
    return ok;
}

bool patch_device_read(PatchDevice *patches, int patch, double *const x[3], double *const v[3], PatchFault *fault,
                       Failure *failure)
{
    if ((x || fault) && !fetch(patches, failure)) return false;
    if (x) places_of(patches, patches->read_places, patch, x);
    if (fault) find_fault(patches, patch, fault);
    return !v || read_speeds(patches, patch, v, failure);
}

const PatchEdges *patch_device_edges_now(const PatchDevice *patches, int patch)
{
    return patches->sides[patch].edges;
}

double patch_device_time(const PatchDevice *patches, int patch)
{
    const PatchSide *side = &patches->sides[patch];
    return side->origin + (double)(side->steps - side->origin_step) * side->model.step;
}

uint64_t patch_device_steps(const PatchDevice *patches, int patch)
{
    return patches->sides[patch].steps;
}

double patch_device_force_time(const PatchDevice *patches, int patch)
{
    const PatchModel *model = &patches->sides[patch].model;
    return patch_device_time(patches, patch) + (model->scheme == PATCH_NEWMARK ? model->step / 2 : 0);
}

// ---- checkpoints

void patch_device_key(const PatchDevice *patches, char key[static PATCH_SOLVER_KEY])
{
    strcpy(key, "device-");
    for (int k = 0; k < 16; k++) sprintf(key + 7 + 2 * k, "%02x", patches->program->key[k]);
}

size_t patch_device_save(PatchDevice *patches, int patch, void *bytes, size_t capacity, Failure *failure)
{
    PatchWriter writer = {bytes, capacity, 0};
    const PatchSide *side = &patches->sides[patch];
    size_t edges = patch_edges_count(patches->nodes) * sizeof(double),
           state = 2 * patch_square_of(patches) * sizeof(float);
    if (bytes && !fetch(patches, failure)) return 0;
    patch_write_header(&writer, PATCH_STATE_DEVICE, patches->nodes, 1);
    patch_write(&writer, &side->origin, sizeof side->origin);
    patch_write(&writer, &side->steps, sizeof side->steps);
    patch_write(&writer, &side->origin_step, sizeof side->origin_step);
    patch_write(&writer, &side->epoch_step, sizeof side->epoch_step);
    patch_write(&writer, patch_edges_values(side->edges), edges);
    patch_write(&writer, patch_edges_values(side->next), edges);
    for (int c = 0; c < 3; c++) {
        int slot = 3 * patch + c;
        PatchResult result = {0};
        if (bytes) {
            result = result_of(patches, patches->read_results, slot);
            if (!patch_mirror_read(&patches->state, patches->device, (size_t)slot * state, state, patches->floats,
                                   failure))
                return 0;
        }
        patch_write(&writer, &result, sizeof result);
        patch_write(&writer, patches->floats, state);
    }
    return patch_write_end(&writer);
}

bool patch_device_restore(PatchDevice *patches, int patch, const void *bytes, size_t size, Failure *failure)
{
    PatchReader reader;
    if (!patch_read_header(&reader, bytes, size, PATCH_STATE_DEVICE, patches->nodes, 1, failure)) return false;
    if (size != patch_device_save(patches, patch, NULL, 0, failure))
        return fail(failure, "the checkpoint of the patch has a wrong length");
    size_t edges = patch_edges_count(patches->nodes) * sizeof(double),
           state = 2 * patch_square_of(patches) * sizeof(float);
    PatchSide *side = &patches->sides[patch];
    patches->fetched = false;
    patch_read(&reader, &side->origin, sizeof side->origin);
    patch_read(&reader, &side->steps, sizeof side->steps);
    patch_read(&reader, &side->origin_step, sizeof side->origin_step);
    patch_read(&reader, &side->epoch_step, sizeof side->epoch_step);
    patch_read(&reader, patch_edges_values(side->edges), edges);
    patch_read(&reader, patch_edges_values(side->next), edges);
    side->moving = memcmp(patch_edges_values(side->edges), patch_edges_values(side->next), edges) != 0;
    for (int c = 0; c < 3; c++) {
        PatchResult result;
        size_t slot = (size_t)(3 * patch + c);
        patch_read(&reader, &result, sizeof result);
        patch_read(&reader, patches->floats, state);
        for (size_t k = 0; k < state / sizeof(float); k++)
            if (!isfinite(patches->floats[k])) return fail(failure, "the checkpoint of the patch is not finite");
        result.epoch = ((PatchRecord *)patches->records.bytes)[slot].epoch;
        if (!patch_mirror_write(&patches->results, patches->device, slot * sizeof result, sizeof result, &result,
                                failure) ||
            !patch_mirror_write(&patches->state, patches->device, slot * state, state, patches->floats, failure))
            return false;
    }
    patch_device_write_load(patches, patch);
    patch_device_write_edges(patches, patch);
    return true;
}
