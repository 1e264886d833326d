// Making patches, and the order in which what has changed goes to the device.
#include "runtime/patch_device.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "patch_kernels.h"
#include "runtime/patch_device_parts.h"
#include "runtime/patch_diagnose.h"
#include "runtime/program.h"

#define DEFAULT_ITERATIONS 40
#define DEFAULT_TOLERANCE  1e-6
#define GROUP_SIZE         256 // work-items of a work-group where a work-item does one column
#define MOST_PATCHES       20000

_Static_assert(sizeof(PatchRecord) == 64, "a patch record is 16 words on both sides");
_Static_assert(sizeof(PatchResult) == 32, "a patch result is 8 words on both sides");
_Static_assert(sizeof(PatchSolidRecord) == 48, "a solid is 12 words on both sides");

// ---- making and freeing

static bool build_program(PatchDevice *patches, Failure *failure)
{
    patches->program = patches->device->patches;
    if (patches->program) return true;
    // The structs that both sides share come first.
    size_t head = patch_kernels_patch_shared_h_length, length = head + patch_kernels_patch_cl_length;
    char *source = malloc(length);
    if (!source) return patch_no_memory(failure);
    memcpy(source, patch_kernels_patch_shared_h, head);
    memcpy(source + head, patch_kernels_patch_cl, patch_kernels_patch_cl_length);
    char options[80];
    snprintf(options, sizeof options, "-cl-std=CL1.2 -DWIDTH=%d -DGROUP=%d", patches->device->width > 1 ? 16 : 1,
             (int)patches->group);
    patches->program =
        program_build(patches->device, &(ProgramDesc){.source = source, .length = length, .options = options}, failure);
    free(source);
    if (!patches->program) return false;
    patches->device->patches = patches->program;
    patches->builds = patches->program->builds;
    return true;
}

static bool build(PatchDevice *patches, Failure *failure)
{
    if (!build_program(patches, failure)) return false;
    cl_int status;
    patches->step = clCreateKernel(patches->program->cl, "patch_step", &status);
    if (status == CL_SUCCESS) patches->show = clCreateKernel(patches->program->cl, "patch_nodes", &status);
    if (status == CL_SUCCESS) patches->contact = clCreateKernel(patches->program->cl, "patch_contact", &status);
    return patch_device_did(status, "run kernels for", failure);
}

// Writes the table of modes to the device.
static bool make_table(PatchDevice *patches, Failure *failure)
{
    const PatchModes *modes = patches->modes;
    size_t half = (size_t)modes->half, order = 2 * half, block = half * half, rows = TABLE_ROWS(half);
    if (!patch_mirror_make(&patches->table, patches->device, (rows + (size_t)modes->m * order) * sizeof(float), true,
                           failure))
        return false;
    float *table = (float *)patches->table.bytes, *q = table + TABLE_Q(half), *qt = table + TABLE_QT(half);
    patch_floats_of(modes->lambda, table + TABLE_LAMBDA(half), order);
    patch_floats_of(modes->beta, table + TABLE_BETA(half), order);
    patch_floats_of(modes->b_even, table + TABLE_B(half), block);
    patch_floats_of(modes->b_odd, table + TABLE_B(half) + block, block);
    patch_floats_of(modes->q_even, q, block);
    patch_floats_of(modes->q_odd, q + block, block);
    for (size_t kind = 0; kind < 2; kind++)
        for (size_t r = 0; r < half; r++)
            for (size_t a = 0; a < half; a++) qt[kind * block + a * half + r] = q[kind * block + r * half + a];
    double *row = patches->square, *sum = patches->other;
    memset(sum, 0, order * sizeof *sum);
    for (int k = 0; k < modes->m; k++) {
        patch_modes_row(modes, k, row);
        patch_floats_of(row, table + rows + (size_t)k * order, order);
        // The sum over a whole odd mode is zero, and not what rounding would leave of it.
        for (size_t a = 0; a < half; a++) sum[a] += row[a];
    }
    patch_floats_of(sum, table + TABLE_SUM(half), order);
    return patch_mirror_upload(&patches->table, patches->device, failure);
}

// Makes room for `room` pins a patch. The pins have to be written anew.
bool patch_device_make_pins(PatchDevice *patches, int room, Failure *failure)
{
    size_t slots = (size_t)patches->slots, one = (size_t)room;
    Device *device = patches->device;
    PatchMirror pins = {0}, targets = {0}, inverses = {0};
    if (!patch_mirror_make(&pins, device, (size_t)patches->count * one * 2 * sizeof(int), true, failure) ||
        !patch_mirror_make(&targets, device, slots * one * sizeof(float), true, failure) ||
        !patch_mirror_make(&inverses, device, slots * one * one * sizeof(float), true, failure)) {
        patch_mirror_free(&pins);
        patch_mirror_free(&targets);
        patch_mirror_free(&inverses);
        return false;
    }
    patch_mirror_free(&patches->pins);
    patch_mirror_free(&patches->targets);
    patch_mirror_free(&patches->inverses);
    patches->pins = pins;
    patches->targets = targets;
    patches->inverses = inverses;
    patches->pin_room = room;
    return true;
}

// Buffers that only forces and contacts need are small ones until somebody asks for those.
static bool make_buffers(PatchDevice *patches, Failure *failure)
{
    Device *device = patches->device;
    size_t slots = (size_t)patches->slots, square = patch_square_of(patches) * sizeof(float),
           grid = patch_grid_of(patches) * sizeof(float);
    struct {
        PatchMirror *mirror;
        size_t size;
        bool on_host;
    } const list[] = {
        {&patches->records, slots * sizeof(PatchRecord), true},
        {&patches->load, slots * square, true},
        {&patches->edges, slots * 4 * (size_t)patches->nodes * sizeof(float), true},
        {&patches->force, 4, false},
        {&patches->solids, 4, false},
        {&patches->results, slots * sizeof(PatchResult), false},
        {&patches->state, slots * STATE_ARRAYS * square, false},
        {&patches->work, slots * WORK_ARRAYS * square, false},
        {&patches->touch, 4, false},
        {&patches->kappa, 4, false},
        {&patches->places, slots * grid, false},
        {&patches->pushes, slots * 3 * PATCH_MAX_PINS * sizeof(float), false},
    };
    for (size_t k = 0; k < sizeof list / sizeof *list; k++)
        if (!patch_mirror_make(list[k].mirror, device, list[k].size, list[k].on_host, failure)) return false;
    return patch_device_make_pins(patches, 1, failure);
}

static bool allocate(PatchDevice *patches, Failure *failure)
{
    patches->modes = patch_modes_new(patches->nodes, patches->closure, failure);
    if (!patches->modes) return false;
    size_t m = (size_t)patches->modes->m, square = patch_square_of(patches);
    patches->sides = calloc((size_t)patches->count, sizeof *patches->sides);
    patches->inside = patch_edges_new(patches->nodes);
    patches->frame = malloc(m * m * sizeof *patches->frame);
    patches->square = malloc(square * sizeof *patches->square);
    patches->other = malloc(2 * square * sizeof *patches->other);
    patches->floats = malloc(2 * square * sizeof *patches->floats);
    patches->read_places = malloc((size_t)patches->slots * patch_grid_of(patches) * sizeof *patches->read_places);
    patches->read_results = malloc((size_t)patches->slots * sizeof *patches->read_results);
    if (!patches->read_places || !patches->read_results || !patches->sides || !patches->inside || !patches->frame ||
        !patches->square || !patches->other || !patches->floats)
        return patch_no_memory(failure);
    for (int k = 0; k < patches->count; k++) {
        patches->sides[k].edges = patch_edges_new(patches->nodes);
        patches->sides[k].next = patch_edges_new(patches->nodes);
        if (!patches->sides[k].edges || !patches->sides[k].next) return patch_no_memory(failure);
    }
    return true;
}

PatchDevice *patch_device_new(Device *device, int nodes, PatchClosure closure, int count, Failure *failure)
{
    PatchModel base = patch_model_base(nodes);
    base.closure = closure;
    if (!patch_accept(&base, failure)) return NULL;
    // A launch has a work-group for each component; on CPUs those that need no compiler at the start are for fewer than
    // 65,536.
    if (count < 1 || count > MOST_PATCHES) {
        fail(failure, "%d patches at once: 1 to %d are possible", count, MOST_PATCHES);
        return NULL;
    }
    PatchDevice *patches = calloc(1, sizeof *patches);
    if (!patches) {
        patch_no_memory(failure);
        return NULL;
    }
    *patches = (PatchDevice){.device = device,
                             .nodes = nodes,
                             .closure = closure,
                             .count = count,
                             .slots = 3 * count,
                             .iterations = DEFAULT_ITERATIONS,
                             .tolerance = DEFAULT_TOLERANCE};
    // PoCL copies what follows a barrier under a condition, for each: it never finishes a work-group of several for
    // these kernels.
    patches->group = device->width > 1 || device->info.is_pocl ? 1 : GROUP_SIZE;
    bool ok = allocate(patches, failure) && build(patches, failure) && make_table(patches, failure) &&
              make_buffers(patches, failure);
    for (int k = 0; ok && k < count; k++)
        ok =
            patch_device_model(patches, k, &base, failure) && patch_device_start(patches, k, NULL, NULL, NULL, failure);
    if (ok) return patches;
    patch_device_free(patches);
    return NULL;
}

void patch_device_free(PatchDevice *patches)
{
    if (!patches) return;
    PatchMirror *const mirrors[] = {
        &patches->records, &patches->table,    &patches->load,   &patches->force,   &patches->edges, &patches->pins,
        &patches->targets, &patches->inverses, &patches->solids, &patches->results, &patches->state, &patches->work,
        &patches->touch,   &patches->kappa,    &patches->places, &patches->pushes,
    };
    clFinish(patches->device->queue);
    for (size_t k = 0; k < sizeof mirrors / sizeof *mirrors; k++) patch_mirror_free(mirrors[k]);
    if (patches->step) clReleaseKernel(patches->step);
    if (patches->show) clReleaseKernel(patches->show);
    if (patches->contact) clReleaseKernel(patches->contact);
    for (int k = 0; patches->sides && k < patches->count; k++) {
        patch_edges_free(patches->sides[k].edges);
        patch_edges_free(patches->sides[k].next);
        free(patches->sides[k].pins);
    }
    free(patches->sides);
    patch_edges_free(patches->inside);
    patch_modes_free(patches->modes);
    free(patches->frame);
    free(patches->square);
    free(patches->other);
    free(patches->floats);
    free(patches->read_places);
    free(patches->read_results);
    free(patches);
}

int patch_device_builds(const PatchDevice *patches)
{
    return patches->builds;
}

bool patch_device_store(const PatchDevice *patches, Failure *failure)
{
    return program_store(patches->program, failure);
}

// ---- launches

typedef struct Argument {
    size_t size;
    const void *value;
} Argument;

#define BUFFER(mirror)                                                                                                 \
    {                                                                                                                  \
        sizeof(cl_mem), &(mirror).buffer                                                                               \
    }
#define NUMBER(value)                                                                                                  \
    {                                                                                                                  \
        sizeof(int), &(value)                                                                                          \
    }

static bool launch(PatchDevice *patches, cl_kernel kernel, const Argument *arguments, cl_uint count, size_t groups,
                   size_t group, Failure *failure)
{
    cl_int status = CL_SUCCESS;
    for (cl_uint k = 0; k < count && status == CL_SUCCESS; k++)
        status = clSetKernelArg(kernel, k, arguments[k].size, arguments[k].value);
    size_t items = groups * group;
    if (status == CL_SUCCESS)
        status = clEnqueueNDRangeKernel(patches->device->queue, kernel, 1, NULL, &items, &group, 0, NULL, NULL);
    return patch_device_did(status, "run kernels for", failure);
}

static bool launch_step(PatchDevice *patches, int mode, Failure *failure)
{
    const Argument arguments[] = {
        BUFFER(patches->records),
        BUFFER(patches->results),
        BUFFER(patches->table),
        BUFFER(patches->state),
        BUFFER(patches->work),
        BUFFER(patches->load),
        BUFFER(patches->force),
        BUFFER(patches->touch),
        BUFFER(patches->kappa),
        BUFFER(patches->pins),
        BUFFER(patches->targets),
        BUFFER(patches->inverses),
        BUFFER(patches->pushes),
        NUMBER(patches->nodes),
        NUMBER(patches->modes->half),
        NUMBER(patches->pin_room),
        NUMBER(mode),
    };
    return launch(patches, patches->step, arguments, sizeof arguments / sizeof *arguments, (size_t)patches->slots,
                  patches->group, failure);
}

static bool launch_show(PatchDevice *patches, int what, Failure *failure)
{
    const Argument arguments[] = {
        BUFFER(patches->records), BUFFER(patches->table),       BUFFER(patches->state),
        BUFFER(patches->work),    BUFFER(patches->edges),       BUFFER(patches->places),
        NUMBER(patches->nodes),   NUMBER(patches->modes->half), NUMBER(what),
    };
    return launch(patches, patches->show, arguments, sizeof arguments / sizeof *arguments, (size_t)patches->slots,
                  patches->group, failure);
}

// Asks the solids and the law at the places that `what` shows.
static bool launch_contact(PatchDevice *patches, int what, Failure *failure)
{
    if (!launch_show(patches, what, failure)) return false;
    const Argument arguments[] = {
        BUFFER(patches->solids), NUMBER(patches->solid_count), BUFFER(patches->places),
        BUFFER(patches->touch),  BUFFER(patches->kappa),       NUMBER(patches->nodes),
    };
    size_t lines = (size_t)patches->count * (size_t)patches->nodes;
    if (!launch(patches, patches->contact, arguments, sizeof arguments / sizeof *arguments, lines, 1, failure))
        return false;
    return !patches->law || patches->law(patches->law_context, patches, patches->places.buffer, patches->touch.buffer,
                                         patches->kappa.buffer, failure);
}

static bool upload_all(PatchDevice *patches, Failure *failure)
{
    PatchMirror *const mirrors[] = {
        &patches->records, &patches->load,    &patches->force,    &patches->edges,
        &patches->pins,    &patches->targets, &patches->inverses, &patches->solids,
    };
    for (size_t k = 0; k < sizeof mirrors / sizeof *mirrors; k++)
        if (!patch_mirror_upload(mirrors[k], patches->device, failure)) return false;
    return true;
}

// One launch of the steps in the records, with what a contact needs before.
static bool launch_all(PatchDevice *patches, Failure *failure)
{
    patches->fetched = false;
    if (!upload_all(patches, failure)) return false;
    if (!patch_device_has_contact(patches)) return launch_step(patches, STEP_COMMIT, failure);
    size_t grid = patch_grid_of(patches) * sizeof(float);
    if (patches->touch.size < (size_t)patches->slots * grid &&
        (!patch_mirror_make(&patches->touch, patches->device, (size_t)patches->slots * grid, false, failure) ||
         !patch_mirror_make(&patches->kappa, patches->device, (size_t)patches->count * grid, false, failure)))
        return false;
    return launch_contact(patches, SHOW_PLACES, failure) && launch_step(patches, STEP_TRIAL, failure) &&
           launch_contact(patches, SHOW_TRIAL, failure) && launch_step(patches, STEP_AFTER, failure);
}

bool patch_device_step(PatchDevice *patches, const int *steps, Failure *failure)
{
    for (int done = 0;;) {
        // Edges that move, and contacts, are for one step; else all that is left is one launch.
        int most = 0;
        bool single = patch_device_has_contact(patches);
        for (int k = 0; k < patches->count; k++) {
            int left = steps[k] - done;
            if (left > most) most = left;
            single = single || (left > 0 && patches->sides[k].moving);
        }
        if (most <= 0) return true;
        int now = single ? 1 : most;
        for (int k = 0; k < patches->count; k++) {
            int own = steps[k] - done < now ? steps[k] - done : now;
            if (own < 0) own = 0;
            for (int slot = 3 * k; slot < 3 * k + 3; slot++)
                if (((PatchRecord *)patches->records.bytes)[slot].steps != own)
                    patch_device_record(patches, slot)->steps = own;
        }
        if (!launch_all(patches, failure)) return false;
        for (int k = 0; k < patches->count; k++) {
            PatchSide *side = &patches->sides[k];
            int own = steps[k] - done < now ? steps[k] - done : now;
            if (own <= 0) continue;
            side->steps += (uint64_t)own;
            if (!side->moving) continue;
            patch_edges_copy(side->edges, side->next);
            side->moving = false;
            if (side->model.scheme == PATCH_NEWMARK) patch_device_write_load(patches, k);
        }
        done += now;
    }
}

bool patch_device_show(PatchDevice *patches, int what, Failure *failure)
{
    return upload_all(patches, failure) && launch_show(patches, what, failure);
}

cl_mem patch_device_nodes(const PatchDevice *patches)
{
    return patches->places.buffer;
}
