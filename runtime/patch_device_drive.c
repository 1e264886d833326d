// What drives patches, from the host to the device's mirrors.
//
// Edges are transformed to modes here, in double: in float the cancellation between what the edges add and what L takes
// away would be visible on large grids. It costs O(nodes²), since only two rows and columns on each side are not zero.
#include <stdlib.h>
#include <string.h>

#include "runtime/patch_device_parts.h"
#include "runtime/patch_diagnose.h"
#include "runtime/patch_pins.h"

// ---- models, pins, edges, forces

// Writes where a patch's pins are and, if `matrix`, what holds them.
static bool write_pins(PatchDevice *patches, int patch, bool matrix, Failure *failure)
{
    PatchSide *side = &patches->sides[patch];
    size_t room = (size_t)patches->pin_room;
    int count = side->model.pin_count;
    if (!count) return true;
    int *pins = patch_mirror_change(&patches->pins, (size_t)patch * room * 2 * sizeof(int), room * 2 * sizeof(int));
    for (int k = 0; k < count; k++) {
        pins[2 * k] = side->pins[k].i - 1;
        pins[2 * k + 1] = side->pins[k].j - 1;
    }
    for (int c = 0; c < 3; c++) {
        size_t slot = (size_t)(3 * patch + c);
        float *targets = patch_mirror_change(&patches->targets, slot * room * sizeof(float), room * sizeof(float));
        for (int k = 0; k < count; k++) targets[k] = (float)side->pins[k].to[c];
        if (!matrix) continue;
        float *inverse =
            patch_mirror_change(&patches->inverses, slot * room * room * sizeof(float), room * room * sizeof(float));
        if (!patch_pins_inverse(patches->modes, &side->model, c, patches->square, inverse, failure)) return false;
    }
    return true;
}

// Makes room for more pins and writes those of all patches.
static bool grow_pins(PatchDevice *patches, int wanted, Failure *failure)
{
    int room = patches->pin_room;
    while (room < wanted) room *= 2;
    if (!patch_device_make_pins(patches, room, failure)) return false;
    for (int k = 0; k < patches->count; k++)
        if (!write_pins(patches, k, true, failure)) return false;
    return true;
}

static void write_records(PatchDevice *patches, int patch)
{
    PatchSide *side = &patches->sides[patch];
    const PatchModel *model = &side->model;
    PatchCoefficients k = patch_coefficients(model);
    for (int c = 0; c < 3; c++) {
        PatchRecord *record = patch_device_record(patches, 3 * patch + c);
        record->b = (float)model->stiffness[c].b;
        record->c = (float)model->stiffness[c].c;
        record->d = (float)model->stiffness[c].d;
        record->mu = (float)k.mu;
        record->eta = (float)model->damping;
        record->dt = (float)model->step;
        record->theta = (float)k.theta;
        record->force = (float)model->force[c];
        record->limit = (float)(model->limit > 0 ? model->limit : PATCH_LIMIT);
        record->tolerance = (float)patches->tolerance;
        record->iterations = patches->iterations;
        record->pins = model->pin_count;
    }
}

void patch_device_resume(PatchDevice *patches, int patch)
{
    for (int c = 0; c < 3; c++) patch_device_record(patches, 3 * patch + c)->epoch++;
    patches->sides[patch].epoch_step = patches->sides[patch].steps;
    patches->fetched = false;
}

// The load of the edges of a patch in the next step.
void patch_device_write_load(PatchDevice *patches, int patch)
{
    PatchSide *side = &patches->sides[patch];
    size_t square = patch_square_of(patches);
    double line[PATCH_MAX_NODES + 2 * PATCH_MODE_PAD];
    patch_edges_copy(patches->inside, side->edges);
    patch_edges_mix(patches->inside, side->next, patch_coefficients(&side->model).theta);
    for (int c = 0; c < 3; c++) {
        patch_edge_load(&side->model, patches->inside, c, patches->frame);
        patch_modes_of_frame(patches->modes, patches->frame, patches->square, line);
        float *load =
            patch_mirror_change(&patches->load, (size_t)(3 * patch + c) * square * sizeof *load, square * sizeof *load);
        patch_floats_of(patches->square, load, square);
    }
}

// The positions that a picture has along the edges.
void patch_device_write_edges(PatchDevice *patches, int patch)
{
    patches->fetched = false;
    size_t side = (size_t)patches->nodes, slot = 4 * side;
    float *places =
        patch_mirror_change(&patches->edges, (size_t)patch * 3 * slot * sizeof *places, 3 * slot * sizeof *places);
    for (size_t c = 0; c < 3; c++)
        for (size_t e = 0; e < PATCH_EDGES; e++)
            patch_floats_of(patches->sides[patch].next->position[e][c], places + c * slot + e * side, side);
}

bool patch_device_model(PatchDevice *patches, int patch, const PatchModel *model, Failure *failure)
{
    PatchSide *side = &patches->sides[patch];
    if (model->nodes != patches->nodes)
        return fail(failure, "a patch of %d nodes a side cannot get %d", patches->nodes, model->nodes);
    if (model->closure != patches->closure) return fail(failure, "a patch cannot get another closure");
    if (model->pin_count > PATCH_MAX_PINS)
        return fail(failure, "%d pins in a patch: on the device there are at most %d, the direct solver has any number",
                    model->pin_count, PATCH_MAX_PINS);
    if (patch_model_pushed(&side->model, model)) {
        for (int c = 0; c < 3; c++) {
            patch_device_record(patches, 3 * patch + c)->force = (float)model->force[c];
            side->model.force[c] = model->force[c];
        }
        return true;
    }
    if (!patch_accept(model, failure)) return false;
    PatchPin *pins = NULL;
    if (model->pin_count) {
        pins = malloc((size_t)model->pin_count * sizeof *pins);
        if (!pins) return patch_no_memory(failure);
        memcpy(pins, model->pins, (size_t)model->pin_count * sizeof *pins);
    }
    bool same = patch_pins_same(&side->model, model);
    if (model->step != side->model.step) {
        side->origin = patch_device_time(patches, patch);
        side->origin_step = side->steps;
    }
    free(side->pins);
    side->pins = pins;
    side->model = *model;
    side->model.pins = pins;
    write_records(patches, patch);
    patch_device_write_load(patches, patch);
    if (model->pin_count > patches->pin_room) return grow_pins(patches, model->pin_count, failure);
    return write_pins(patches, patch, !same, failure);
}

// Writes places and velocities over nodes (NULL: zero) as the state of a slot.
static bool write_state(PatchDevice *patches, int slot, const double *x, const double *v, Failure *failure)
{
    size_t square = patch_square_of(patches), m = (size_t)patches->modes->m;
    for (int k = 0; k < 2; k++) {
        const double *from = k ? v : x;
        for (size_t i = 0; i < m; i++)
            for (size_t j = 0; j < m; j++)
                patches->frame[i * m + j] = from ? from[(i + 1) * patches->nodes + j + 1] : 0;
        patch_modes_of_nodes(patches->modes, patches->frame, patches->square, patches->other);
        patch_floats_of(patches->square, patches->floats + k * square, square);
    }
    size_t size = 2 * square * sizeof(float);
    return patch_mirror_write(&patches->state, patches->device, (size_t)slot * size, size, patches->floats, failure);
}

bool patch_device_start(PatchDevice *patches, int patch, const PatchEdges *edges, const double *const x[3],
                        const double *const v[3], Failure *failure)
{
    PatchSide *side = &patches->sides[patch];
    size_t grid = patch_grid_of(patches), nodes = (size_t)patches->nodes;
    if (edges) patch_edges_copy(side->next, edges);
    patch_edges_copy(side->edges, side->next);
    side->moving = false;
    side->steps = side->origin_step = 0;
    side->origin = 0;
    double *places = calloc(2 * grid, sizeof *places), *speeds = places + grid;
    if (!places) return patch_no_memory(failure);
    bool ok = true;
    for (int c = 0; ok && c < 3; c++) {
        for (size_t k = 0; k < grid; k++) {
            double flat = c == 2 ? 0 : (double)(c ? k % nodes : k / nodes) / (double)(nodes - 1);
            places[k] = x && x[c] ? x[c][k] : flat;
            speeds[k] = v && v[c] ? v[c][k] : 0;
        }
        for (int k = 0; k < side->model.pin_count; k++) {
            size_t node = (size_t)side->pins[k].i * nodes + (size_t)side->pins[k].j;
            places[node] = side->pins[k].to[c];
            speeds[node] = 0;
        }
        ok = write_state(patches, 3 * patch + c, places, speeds, failure);
    }
    free(places);
    write_records(patches, patch);
    patch_device_resume(patches, patch);
    patch_device_write_load(patches, patch);
    patch_device_write_edges(patches, patch);
    return ok;
}

bool patch_device_edges(PatchDevice *patches, int patch, const PatchEdges *edges, Failure *failure)
{
    if (edges->nodes != patches->nodes)
        return fail(failure, "the edges of a patch have %d nodes, it has %d", edges->nodes, patches->nodes);
    patch_edges_copy(patches->sides[patch].next, edges);
    patches->sides[patch].moving = true;
    patch_device_write_load(patches, patch);
    patch_device_write_edges(patches, patch);
    return true;
}

bool patch_device_force(PatchDevice *patches, int patch, const double *const force[3], Failure *failure)
{
    size_t grid = patch_grid_of(patches), all = (size_t)patches->slots * grid * sizeof(float);
    if (!patches->force.bytes && !force[0] && !force[1] && !force[2]) return true;
    if (!patches->force.bytes && !patch_mirror_make(&patches->force, patches->device, all, true, failure)) return false;
    for (int c = 0; c < 3; c++) {
        int slot = 3 * patch + c, flags = ((PatchRecord *)patches->records.bytes)[slot].flags;
        int wanted = force[c] ? flags | PATCH_HAS_FORCE : flags & ~PATCH_HAS_FORCE;
        if (wanted != flags) patch_device_record(patches, slot)->flags = wanted;
        if (force[c])
            patch_floats_of(
                force[c],
                patch_mirror_change(&patches->force, (size_t)slot * grid * sizeof(float), grid * sizeof(float)), grid);
    }
    return true;
}

// ---- contacts

static void flag_contact(PatchDevice *patches)
{
    for (int slot = 0; slot < patches->slots; slot++) {
        PatchRecord *record = patch_device_record(patches, slot);
        record->flags =
            patch_device_has_contact(patches) ? record->flags | PATCH_HAS_TOUCH : record->flags & ~PATCH_HAS_TOUCH;
    }
}

bool patch_device_solids(PatchDevice *patches, const PatchSolid *solids, const int *patch, int count, Failure *failure)
{
    size_t size = (size_t)count * sizeof(PatchSolidRecord);
    bool room = patches->solids.bytes && patches->solids.size >= size;
    if (count && !room && !patch_mirror_make(&patches->solids, patches->device, 2 * size, true, failure)) return false;
    if (count) {
        PatchSolidRecord *records = patch_mirror_change(&patches->solids, 0, size);
        for (int s = 0; s < count; s++) {
            patch_floats_of(solids[s].quadric, records[s].quadric, 10);
            records[s].stiffness = (float)solids[s].stiffness;
            records[s].patch = patch[s];
        }
    }
    bool had = patch_device_has_contact(patches);
    patches->solid_count = count;
    if (patch_device_has_contact(patches) != had) flag_contact(patches);
    return true;
}

void patch_device_law(PatchDevice *patches, PatchDeviceLaw *law, void *context)
{
    patches->law = law;
    patches->law_context = context;
    flag_contact(patches);
}

void patch_device_precision(PatchDevice *patches, int iterations, double tolerance)
{
    patches->iterations = iterations;
    patches->tolerance = tolerance;
    for (int slot = 0; slot < patches->slots; slot++) {
        PatchRecord *record = patch_device_record(patches, slot);
        record->iterations = iterations;
        record->tolerance = (float)tolerance;
    }
}
