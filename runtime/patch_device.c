// What the host keeps of each patch, and the order in which it goes to the device. All that may change by the frame
// lies in mirrors (runtime/patch_mirror.h); patch_device_step() uploads what has changed and launches.
//
// Edges are transformed to modes here, in double: in float the cancellation between what the edges add and what L takes
// away would be visible on large grids. It costs O(nodes²), since only two rows and columns on each side are not zero.
#include "runtime/patch_device.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "patch_kernels.h"
#include "runtime/patch_diagnose.h"
#include "runtime/patch_mirror.h"
#include "runtime/patch_modes.h"
#include "runtime/patch_pins.h"
#include "runtime/patch_state.h"
#include "runtime/program.h"

#define DEFAULT_ITERATIONS 40
#define DEFAULT_TOLERANCE  1e-6
#define GROUP_SIZE         256 // work-items of a work-group where a work-item does one column
#define MOST_PATCHES       20000

_Static_assert(sizeof(PatchRecord) == 64, "a patch record is 16 words on both sides");
_Static_assert(sizeof(PatchResult) == 32, "a patch result is 8 words on both sides");
_Static_assert(sizeof(PatchSolidRecord) == 48, "a solid is 12 words on both sides");

// What the host knows of a patch.
typedef struct Side {
    PatchModel model;
    PatchPin *pins;    // of the model
    PatchEdges *edges; // at the end of the steps told so far
    PatchEdges *next;  // at the end of the next one
    bool moving;       // the two differ
    double origin;     // time at which the present dt began
    uint64_t steps, origin_step;
    uint64_t epoch_step; // steps done when the epoch of its records began
} Side;

struct PatchDevice {
    Device *device;
    Program *program; // the device's
    int builds;
    cl_kernel step, show, contact;
    int nodes, count, slots, pin_room;
    size_t group; // work-items of a work-group
    int iterations;
    double tolerance;
    PatchModes *modes;
    Side *sides;
    PatchMirror records, table, load, force, edges, pins, targets, inverses, solids; // written by the host
    PatchMirror results, state, work, touch, kappa, places, pushes;                  // by the device
    int solid_count;
    PatchDeviceLaw *law;
    void *law_context;
    PatchEdges *inside;             // those of w in the next step
    double *frame, *square, *other; // over unknowns; over modes; two of those
    float *floats;                  // two arrays over modes
};

static size_t square_of(const PatchDevice *patches)
{
    return (size_t)patches->modes->order * patches->modes->order;
}

static size_t grid_of(const PatchDevice *patches)
{
    return (size_t)patches->nodes * patches->nodes;
}

static void floats_of(const double *from, float *to, size_t count)
{
    for (size_t k = 0; k < count; k++) to[k] = (float)from[k];
}

static bool no_memory(Failure *failure)
{
    return fail(failure, "out of memory for patches");
}

// ---- making and freeing

static bool build_program(PatchDevice *patches, Failure *failure)
{
    patches->program = patches->device->patches;
    if (patches->program) return true;
    // The structs that both sides share come first.
    size_t head = patch_kernels_patch_shared_h_length, length = head + patch_kernels_patch_cl_length;
    char *source = malloc(length);
    if (!source) return no_memory(failure);
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
    floats_of(modes->lambda, table + TABLE_LAMBDA(half), order);
    floats_of(modes->beta, table + TABLE_BETA(half), order);
    floats_of(modes->b_even, table + TABLE_B(half), block);
    floats_of(modes->b_odd, table + TABLE_B(half) + block, block);
    floats_of(modes->q_even, q, block);
    floats_of(modes->q_odd, q + block, block);
    for (size_t kind = 0; kind < 2; kind++)
        for (size_t r = 0; r < half; r++)
            for (size_t a = 0; a < half; a++) qt[kind * block + a * half + r] = q[kind * block + r * half + a];
    double *row = patches->square, *sum = patches->other;
    memset(sum, 0, order * sizeof *sum);
    for (int k = 0; k < modes->m; k++) {
        patch_modes_row(modes, k, row);
        floats_of(row, table + rows + (size_t)k * order, order);
        // The sum over a whole odd mode is zero, and not what rounding would leave of it.
        for (size_t a = 0; a < half; a++) sum[a] += row[a];
    }
    floats_of(sum, table + TABLE_SUM(half), order);
    return patch_mirror_upload(&patches->table, patches->device, failure);
}

// Makes room for `room` pins a patch. The pins have to be written anew.
static bool make_pins(PatchDevice *patches, int room, Failure *failure)
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
    size_t slots = (size_t)patches->slots, square = square_of(patches) * sizeof(float),
           grid = grid_of(patches) * sizeof(float);
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
    return make_pins(patches, 1, failure);
}

static bool allocate(PatchDevice *patches, Failure *failure)
{
    patches->modes = patch_modes_new(patches->nodes, failure);
    if (!patches->modes) return false;
    size_t m = (size_t)patches->modes->m, square = square_of(patches);
    patches->sides = calloc((size_t)patches->count, sizeof *patches->sides);
    patches->inside = patch_edges_new(patches->nodes);
    patches->frame = malloc(m * m * sizeof *patches->frame);
    patches->square = malloc(square * sizeof *patches->square);
    patches->other = malloc(2 * square * sizeof *patches->other);
    patches->floats = malloc(2 * square * sizeof *patches->floats);
    if (!patches->sides || !patches->inside || !patches->frame || !patches->square || !patches->other ||
        !patches->floats)
        return no_memory(failure);
    for (int k = 0; k < patches->count; k++) {
        patches->sides[k].edges = patch_edges_new(patches->nodes);
        patches->sides[k].next = patch_edges_new(patches->nodes);
        if (!patches->sides[k].edges || !patches->sides[k].next) return no_memory(failure);
    }
    return true;
}

PatchDevice *patch_device_new(Device *device, int nodes, int count, Failure *failure)
{
    PatchModel base = patch_model_base(nodes);
    if (!patch_accept(&base, failure)) return NULL;
    // A launch has a work-group for each component; on CPUs those that need no compiler at the start are for fewer than
    // 65,536.
    if (count < 1 || count > MOST_PATCHES) {
        fail(failure, "%d patches at once: 1 to %d are possible", count, MOST_PATCHES);
        return NULL;
    }
    PatchDevice *patches = calloc(1, sizeof *patches);
    if (!patches) {
        no_memory(failure);
        return NULL;
    }
    *patches = (PatchDevice){.device = device,
                             .nodes = nodes,
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

// ---- models, pins, edges, forces

static PatchRecord *change_record(PatchDevice *patches, int slot)
{
    return patch_mirror_change(&patches->records, (size_t)slot * sizeof(PatchRecord), sizeof(PatchRecord));
}

// Writes where a patch's pins are and, if `matrix`, what holds them.
static bool write_pins(PatchDevice *patches, int patch, bool matrix, Failure *failure)
{
    Side *side = &patches->sides[patch];
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
    if (!make_pins(patches, room, failure)) return false;
    for (int k = 0; k < patches->count; k++)
        if (!write_pins(patches, k, true, failure)) return false;
    return true;
}

static void write_records(PatchDevice *patches, int patch)
{
    Side *side = &patches->sides[patch];
    const PatchModel *model = &side->model;
    PatchCoefficients k = patch_coefficients(model);
    for (int c = 0; c < 3; c++) {
        PatchRecord *record = change_record(patches, 3 * patch + c);
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
        record->epoch++; // what stopped goes on
    }
    side->epoch_step = side->steps;
}

// The load of the edges of a patch in the next step.
static void write_load(PatchDevice *patches, int patch)
{
    Side *side = &patches->sides[patch];
    size_t square = square_of(patches);
    double line[PATCH_MAX_NODES + 2 * PATCH_MODE_PAD];
    patch_edges_copy(patches->inside, side->edges);
    patch_edges_mix(patches->inside, side->next, patch_coefficients(&side->model).theta);
    for (int c = 0; c < 3; c++) {
        patch_edge_load(&side->model, patches->inside, c, patches->frame);
        patch_modes_of_frame(patches->modes, patches->frame, patches->square, line);
        float *load =
            patch_mirror_change(&patches->load, (size_t)(3 * patch + c) * square * sizeof *load, square * sizeof *load);
        floats_of(patches->square, load, square);
    }
}

// The positions that a picture has along the edges.
static void write_edges(PatchDevice *patches, int patch)
{
    size_t side = (size_t)patches->nodes, slot = 4 * side;
    float *places =
        patch_mirror_change(&patches->edges, (size_t)patch * 3 * slot * sizeof *places, 3 * slot * sizeof *places);
    for (size_t c = 0; c < 3; c++)
        for (size_t e = 0; e < PATCH_EDGES; e++)
            floats_of(patches->sides[patch].next->position[e][c], places + c * slot + e * side, side);
}

bool patch_device_model(PatchDevice *patches, int patch, const PatchModel *model, Failure *failure)
{
    Side *side = &patches->sides[patch];
    if (model->nodes != patches->nodes)
        return fail(failure, "a patch of %d nodes a side cannot get %d", patches->nodes, model->nodes);
    if (model->pin_count > PATCH_MAX_PINS)
        return fail(failure, "%d pins in a patch: on the device there are at most %d, the direct solver has any number",
                    model->pin_count, PATCH_MAX_PINS);
    if (!patch_accept(model, failure)) return false;
    PatchPin *pins = NULL;
    if (model->pin_count) {
        pins = malloc((size_t)model->pin_count * sizeof *pins);
        if (!pins) return no_memory(failure);
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
    write_load(patches, patch);
    if (model->pin_count > patches->pin_room) return grow_pins(patches, model->pin_count, failure);
    return write_pins(patches, patch, !same, failure);
}

// Writes places and velocities over nodes (NULL: zero) as the state of a slot.
static bool write_state(PatchDevice *patches, int slot, const double *x, const double *v, Failure *failure)
{
    size_t square = square_of(patches), m = (size_t)patches->modes->m;
    for (int k = 0; k < 2; k++) {
        const double *from = k ? v : x;
        for (size_t i = 0; i < m; i++)
            for (size_t j = 0; j < m; j++)
                patches->frame[i * m + j] = from ? from[(i + 1) * patches->nodes + j + 1] : 0;
        patch_modes_of_nodes(patches->modes, patches->frame, patches->square, patches->other);
        floats_of(patches->square, patches->floats + k * square, square);
    }
    size_t size = 2 * square * sizeof(float);
    return patch_mirror_write(&patches->state, patches->device, (size_t)slot * size, size, patches->floats, failure);
}

bool patch_device_start(PatchDevice *patches, int patch, const PatchEdges *edges, const double *const x[3],
                        const double *const v[3], Failure *failure)
{
    Side *side = &patches->sides[patch];
    size_t grid = grid_of(patches), nodes = (size_t)patches->nodes;
    if (edges) patch_edges_copy(side->next, edges);
    patch_edges_copy(side->edges, side->next);
    side->moving = false;
    side->steps = side->origin_step = 0;
    side->origin = 0;
    double *places = calloc(2 * grid, sizeof *places), *speeds = places + grid;
    if (!places) return no_memory(failure);
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
    write_load(patches, patch);
    write_edges(patches, patch);
    return ok;
}

bool patch_device_edges(PatchDevice *patches, int patch, const PatchEdges *edges, Failure *failure)
{
    if (edges->nodes != patches->nodes)
        return fail(failure, "the edges of a patch have %d nodes, it has %d", edges->nodes, patches->nodes);
    patch_edges_copy(patches->sides[patch].next, edges);
    patches->sides[patch].moving = true;
    write_load(patches, patch);
    write_edges(patches, patch);
    return true;
}

bool patch_device_force(PatchDevice *patches, int patch, const double *const force[3], Failure *failure)
{
    size_t grid = grid_of(patches), all = (size_t)patches->slots * grid * sizeof(float);
    if (!patches->force.bytes && !patch_mirror_make(&patches->force, patches->device, all, true, failure)) return false;
    for (int c = 0; c < 3; c++) {
        int slot = 3 * patch + c;
        PatchRecord *record = change_record(patches, slot);
        record->flags = force[c] ? record->flags | PATCH_HAS_FORCE : record->flags & ~PATCH_HAS_FORCE;
        if (force[c])
            floats_of(force[c],
                      patch_mirror_change(&patches->force, (size_t)slot * grid * sizeof(float), grid * sizeof(float)),
                      grid);
    }
    return true;
}

// ---- contacts

static bool has_contact(const PatchDevice *patches)
{
    return patches->solid_count || patches->law;
}

static void flag_contact(PatchDevice *patches)
{
    for (int slot = 0; slot < patches->slots; slot++) {
        PatchRecord *record = change_record(patches, slot);
        record->flags = has_contact(patches) ? record->flags | PATCH_HAS_TOUCH : record->flags & ~PATCH_HAS_TOUCH;
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
            floats_of(solids[s].quadric, records[s].quadric, 10);
            records[s].stiffness = (float)solids[s].stiffness;
            records[s].patch = patch[s];
        }
    }
    bool had = has_contact(patches);
    patches->solid_count = count;
    if (has_contact(patches) != had) flag_contact(patches);
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
        PatchRecord *record = change_record(patches, slot);
        record->iterations = iterations;
        record->tolerance = (float)tolerance;
    }
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
    if (!upload_all(patches, failure)) return false;
    if (!has_contact(patches)) return launch_step(patches, STEP_COMMIT, failure);
    size_t grid = grid_of(patches) * sizeof(float);
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
        bool single = has_contact(patches);
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
                    change_record(patches, slot)->steps = own;
        }
        if (!launch_all(patches, failure)) return false;
        for (int k = 0; k < patches->count; k++) {
            Side *side = &patches->sides[k];
            int own = steps[k] - done < now ? steps[k] - done : now;
            if (own <= 0) continue;
            side->steps += (uint64_t)own;
            if (!side->moving) continue;
            patch_edges_copy(side->edges, side->next);
            side->moving = false;
            if (side->model.scheme == PATCH_NEWMARK) write_load(patches, k);
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

// ---- reading

bool patch_device_result(PatchDevice *patches, int patch, int component, PatchResult *result, Failure *failure)
{
    int slot = 3 * patch + component;
    if (!patch_mirror_read(&patches->results, patches->device, (size_t)slot * sizeof *result, sizeof *result, result,
                           failure))
        return false;
    int epoch = ((PatchRecord *)patches->records.bytes)[slot].epoch;
    if (result->epoch != epoch) *result = (PatchResult){.epoch = epoch};
    return true;
}

static bool find_fault(PatchDevice *patches, int patch, PatchFault *fault, Failure *failure)
{
    const Side *side = &patches->sides[patch];
    *fault = (PatchFault){.kind = PATCH_FINE};
    for (int c = 0; c < 3 && fault->kind == PATCH_FINE; c++) {
        PatchResult result;
        if (!patch_device_result(patches, patch, c, &result, failure)) return false;
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
    return true;
}

static bool read_nodes(PatchDevice *patches, int patch, int what, double *const to[3], Failure *failure)
{
    size_t grid = grid_of(patches), size = grid * sizeof(float);
    float *values = malloc(size);
    if (!values) return no_memory(failure);
    bool ok = patch_device_show(patches, what, failure);
    for (int c = 0; ok && c < 3; c++) {
        if (!to[c]) continue;
        ok =
            patch_mirror_read(&patches->places, patches->device, (size_t)(3 * patch + c) * size, size, values, failure);
        for (size_t k = 0; ok && k < grid; k++) to[c][k] = values[k];
    }
    free(values);
    return ok;
}

bool patch_device_read(PatchDevice *patches, int patch, double *const x[3], double *const v[3], PatchFault *fault,
                       Failure *failure)
{
    return (!x || read_nodes(patches, patch, SHOW_PLACES, x, failure)) &&
           (!v || read_nodes(patches, patch, SHOW_VELOCITIES, v, failure)) &&
           (!fault || find_fault(patches, patch, fault, failure));
}

const PatchEdges *patch_device_edges_now(const PatchDevice *patches, int patch)
{
    return patches->sides[patch].edges;
}

double patch_device_time(const PatchDevice *patches, int patch)
{
    const Side *side = &patches->sides[patch];
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

size_t patch_device_save(PatchDevice *patches, void *bytes, size_t capacity, Failure *failure)
{
    PatchWriter writer = {bytes, capacity, 0};
    size_t edges = patch_edges_count(patches->nodes) * sizeof(double), state = 2 * square_of(patches) * sizeof(float);
    patch_write_header(&writer, PATCH_STATE_DEVICE, patches->nodes, patches->count);
    for (int k = 0; k < patches->count; k++) {
        const Side *side = &patches->sides[k];
        patch_write(&writer, &side->origin, sizeof side->origin);
        patch_write(&writer, &side->steps, sizeof side->steps);
        patch_write(&writer, &side->origin_step, sizeof side->origin_step);
        patch_write(&writer, &side->epoch_step, sizeof side->epoch_step);
        patch_write(&writer, patch_edges_values(side->edges), edges);
        patch_write(&writer, patch_edges_values(side->next), edges);
        for (int c = 0; c < 3; c++) {
            PatchResult result = {0};
            size_t place = (size_t)(3 * k + c);
            if (bytes &&
                (!patch_device_result(patches, k, c, &result, failure) ||
                 !patch_mirror_read(&patches->state, patches->device, place * state, state, patches->floats, failure)))
                return 0;
            patch_write(&writer, &result, sizeof result);
            patch_write(&writer, patches->floats, state);
        }
    }
    return patch_write_end(&writer);
}

bool patch_device_restore(PatchDevice *patches, const void *bytes, size_t size, Failure *failure)
{
    PatchReader reader;
    if (!patch_read_header(&reader, bytes, size, PATCH_STATE_DEVICE, patches->nodes, patches->count, failure))
        return false;
    if (size != patch_device_save(patches, NULL, 0, failure))
        return fail(failure, "the checkpoint of the patches has a wrong length");
    size_t edges = patch_edges_count(patches->nodes) * sizeof(double), state = 2 * square_of(patches) * sizeof(float);
    for (int k = 0; k < patches->count; k++) {
        Side *side = &patches->sides[k];
        patch_read(&reader, &side->origin, sizeof side->origin);
        patch_read(&reader, &side->steps, sizeof side->steps);
        patch_read(&reader, &side->origin_step, sizeof side->origin_step);
        patch_read(&reader, &side->epoch_step, sizeof side->epoch_step);
        patch_read(&reader, patch_edges_values(side->edges), edges);
        patch_read(&reader, patch_edges_values(side->next), edges);
        side->moving = memcmp(patch_edges_values(side->edges), patch_edges_values(side->next), edges) != 0;
        for (int c = 0; c < 3; c++) {
            PatchResult result;
            size_t place = (size_t)(3 * k + c);
            patch_read(&reader, &result, sizeof result);
            patch_read(&reader, patches->floats, state);
            result.epoch = ((PatchRecord *)patches->records.bytes)[place].epoch;
            if (!patch_mirror_write(&patches->results, patches->device, place * sizeof result, sizeof result, &result,
                                    failure) ||
                !patch_mirror_write(&patches->state, patches->device, place * state, state, patches->floats, failure))
                return false;
        }
        write_load(patches, k);
        write_edges(patches, k);
    }
    return true;
}
