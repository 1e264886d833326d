// A picture is a few launches in a row: one for each level of tiles, with a work-item for each processor that takes tile after tile. Nothing is read
// back between them.
#include "runtime/slice.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "slice_kernels.h"

_Static_assert(sizeof(SliceNode) == 32, "as on the device");
_Static_assert(sizeof(SliceFrame) == 32, "as on the device");

#define POOL_STEPS (1u << 20)
#define OPTIONS    "-cl-std=CL1.2 -D WIDTH=16"

typedef struct Room { // a buffer that grows
    cl_mem mem;
    size_t size;
} Room;

typedef enum RoomName {
    ROOM_COUNTERS,
    ROOM_POOL,
    ROOM_NODES,
    ROOM_NEXT,
    ROOM_ACROSS,
    ROOM_UP,
    ROOM_PICTURE,
    ROOM_MEMORY,
    ROOM_FRAME,
    ROOM_COUNT
} RoomName;

struct Slicer {
    Device *device;
    Program *program;
    cl_kernel tiles, each; // each: NULL where the formula is emitted
    Room rooms[ROOM_COUNT];
    uint32_t pool;      // asked for
    FormulaSteps steps; // the program; steps.steps are the slicer's
    SliceView view;     // of the places that are on the device
    SliceFrame frame;
    uint32_t workers;
    uint32_t groups; // of an emitted formula; 0: it is a program
    bool exact;      // quotients and roots are rounded to nearest, and nothing is flushed to 0
    uint16_t *bits;
    size_t bits_size;
};

static bool failed(Failure *failure, const char *what, cl_int status)
{
    return fail(failure, "%s (%s)", what, device_error(status));
}

// --- making

// The kernels, and between them what is emitted; without that the last two files do not belong to them.
static char *join_sources(const FormulaCode *code, size_t *length)
{
    char *text = NULL;
    FILE *out = open_memstream(&text, length);
    if (!out) return NULL;
    if (code) fputs("#define SLICE_EMITTED\n", out);
    for (const slice_kernels_file *file = slice_kernels_files; file->name; file++) {
        bool of_groups = !strcmp(file->name, "slice_group.cl"), of_lists = !strcmp(file->name, "slice_lists.cl");
        if (!code && (of_groups || of_lists)) continue;
        if (of_lists) fwrite(code->text, 1, code->length, out);
        fwrite(file->text, 1, file->length, out);
    }
    if (!fclose(out)) return text;
    free(text);
    return NULL;
}

static Program *build(Device *device, const SlicerDesc *desc, bool exact, Failure *failure)
{
    size_t length;
    char *source = join_sources(desc->code, &length);
    if (!source) {
        fail(failure, "out of memory");
        return NULL;
    }
    Program *program =
        program_build(device,
                      &(ProgramDesc){.source = source,
                                     .length = length,
                                     .options = exact ? OPTIONS " -cl-fp32-correctly-rounded-divide-sqrt" : OPTIONS,
                                     .binary = desc->binary,
                                     .binary_size = desc->binary_size,
                                     .no_cache = desc->no_cache},
                      failure);
    free(source);
    return program;
}

void slicer_free(Slicer *s)
{
    if (!s) return;
    for (int k = 0; k < ROOM_COUNT; k++) {
        if (s->rooms[k].mem) clReleaseMemObject(s->rooms[k].mem);
    }
    if (s->tiles) clReleaseKernel(s->tiles);
    if (s->each) clReleaseKernel(s->each);
    program_free(s->program);
    free(s->steps.steps);
    free(s->bits);
    free(s);
}

const Program *slicer_built(const Slicer *s)
{
    return s->program;
}

// --- memory

static bool make_room(Slicer *s, RoomName name, size_t size, Failure *failure)
{
    Room *room = &s->rooms[name];
    if (room->mem && room->size >= size) return true;
    if (room->mem) clReleaseMemObject(room->mem);
    cl_int status;
    *room = (Room){.size = size};
    room->mem = clCreateBuffer(s->device->context, CL_MEM_READ_WRITE, size, NULL, &status);
    if (status == CL_SUCCESS) return true;
    room->mem = NULL;
    return fail(failure, "no memory on the device for a slice: %zu bytes (%s)", size, device_error(status));
}

static bool upload(Slicer *s, RoomName name, const void *bytes, size_t size, bool wait, Failure *failure)
{
    cl_int status = clEnqueueWriteBuffer(s->device->queue, s->rooms[name].mem, wait ? CL_TRUE : CL_FALSE, 0, size,
                                         bytes, 0, NULL, NULL);
    return status == CL_SUCCESS || failed(failure, "cannot send a slice to the device", status);
}

static bool make_memory(Slicer *s, Failure *failure)
{
    return make_room(s, ROOM_MEMORY, (size_t)s->workers * s->frame.room, failure) &&
           make_room(s, ROOM_COUNTERS, SLICE_COUNTERS * sizeof(uint32_t), failure) &&
           make_room(s, ROOM_FRAME, sizeof(SliceFrame), failure);
}

// The list of all groups is the first tile's.
static bool list_groups(Slicer *s, uint32_t groups, Failure *failure)
{
    uint32_t *list = malloc(groups * sizeof *list);
    if (!list) return fail(failure, "out of memory");
    for (uint32_t k = 0; k < groups; k++) list[k] = k;
    s->groups = groups;
    s->frame = (SliceFrame){.conditions = groups, .room = SLICE_ROOM(0, groups, 0)};
    s->frame.pool = groups + (s->pool ? s->pool : 2 * POOL_STEPS);
    bool ok = make_room(s, ROOM_POOL, s->frame.pool * sizeof *list, failure) && make_memory(s, failure) &&
              upload(s, ROOM_POOL, list, groups * sizeof *list, true, failure);
    free(list);
    return ok;
}

static bool make_kernels(Slicer *s, const SlicerDesc *desc, Failure *failure)
{
    cl_int status;
    s->tiles = clCreateKernel(s->program->cl, desc->code ? "slice_lists" : "slice_tiles", &status);
    if (status == CL_SUCCESS && !desc->code) s->each = clCreateKernel(s->program->cl, "slice_each", &status);
    if (status != CL_SUCCESS) return failed(failure, "the kernels of slices are not there", status);
    return !desc->code || list_groups(s, desc->code->groups, failure);
}

Slicer *slicer_new(Device *device, const SlicerDesc *desc, Failure *failure)
{
    Slicer *s = calloc(1, sizeof *s);
    if (!s) {
        fail(failure, "out of memory");
        return NULL;
    }
    cl_device_fp_config config = 0;
    clGetDeviceInfo(device->id, CL_DEVICE_SINGLE_FP_CONFIG, sizeof config, &config, NULL);
    const cl_device_fp_config wanted = CL_FP_DENORM | CL_FP_INF_NAN | CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT;
    s->exact = (config & wanted) == wanted;
    s->device = device;
    s->pool = desc->pool;
    s->workers = device->info.compute_units ? device->info.compute_units : 1;
    if (desc->code && !s->exact)
        fail(failure, "%s does not round quotients and roots to nearest", device->info.name);
    else
        s->program = build(device, desc, s->exact, failure);
    if (s->program && make_kernels(s, desc, failure)) return s;
    slicer_free(s);
    return NULL;
}

// --- the program

static uint32_t step_count(const FormulaSteps *steps)
{
    return steps->numbers + steps->compares + steps->logics;
}

bool slicer_program(Slicer *s, const FormulaSteps *steps, Failure *failure)
{
    free(s->steps.steps);
    s->steps = *steps;
    s->steps.steps = NULL;
    s->frame = (SliceFrame){0};
    if (steps->known) return true;
    uint32_t count = step_count(steps);
    s->steps.steps = malloc(count * sizeof *steps->steps);
    if (!s->steps.steps) return fail(failure, "out of memory");
    memcpy(s->steps.steps, steps->steps, count * sizeof *steps->steps);
    uint32_t conditions = steps->compares + steps->logics;
    uint32_t mixed = steps->mixed < SLICE_MIXED_MAX ? steps->mixed : SLICE_MIXED_MAX;
    s->frame.numbers = steps->numbers;
    s->frame.conditions = conditions;
    s->frame.mixed = mixed;
    s->frame.pool = count + (s->pool ? s->pool : POOL_STEPS);
    s->frame.room = SLICE_ROOM(steps->numbers, conditions, mixed);
    return make_room(s, ROOM_POOL, s->frame.pool * sizeof(TapeStep), failure) && make_memory(s, failure) &&
           upload(s, ROOM_POOL, s->steps.steps, count * sizeof(TapeStep), true, failure);
}

// --- the view

static uint32_t rounded(uint32_t count, uint32_t unit)
{
    return (count + unit - 1) / unit;
}

static bool send_places(Slicer *s, const SliceView *view, Failure *failure)
{
    uint32_t most = view->width > view->height ? view->width : view->height;
    float *places = malloc(most * sizeof *places);
    if (!places) return fail(failure, "out of memory");
    double step = (view->x1 - view->x0) / view->width;
    for (uint32_t k = 0; k < view->width; k++) places[k] = (float)(view->x0 + (k + 0.5) * step);
    bool ok = make_room(s, ROOM_ACROSS, view->width * sizeof *places, failure) &&
              upload(s, ROOM_ACROSS, places, view->width * sizeof *places, true, failure);
    step = (view->y1 - view->y0) / view->height;
    for (uint32_t k = 0; k < view->height; k++) places[k] = (float)(view->y1 - (k + 0.5) * step);
    ok = ok && make_room(s, ROOM_UP, view->height * sizeof *places, failure) &&
         upload(s, ROOM_UP, places, view->height * sizeof *places, true, failure);
    free(places);
    return ok;
}

// The picture, the places and what the kernels know of both.
static bool set_view(Slicer *s, const SliceView *view, Failure *failure)
{
    if (!memcmp(&s->view, view, sizeof *view) && s->frame.width == view->width) return true;
    s->frame.width = view->width;
    s->frame.height = view->height;
    s->frame.stride = 4 * rounded(view->width, 64);
    s->view = (SliceView){0};
    size_t tiles = (size_t)rounded(view->width, 64) * rounded(view->height, 64) + s->workers;
    if (!send_places(s, view, failure) ||
        !make_room(s, ROOM_PICTURE, (size_t)s->frame.stride * view->height * sizeof(uint16_t), failure) ||
        !make_room(s, ROOM_NODES, tiles * sizeof(SliceNode), failure) ||
        !make_room(s, ROOM_NEXT, tiles * sizeof(SliceNode), failure) ||
        !upload(s, ROOM_FRAME, &s->frame, sizeof s->frame, true, failure))
        return false;
    s->view = *view;
    return true;
}

// --- drawing

static bool set_arguments(Slicer *s, cl_kernel kernel, bool exchanged, uint32_t level, uint32_t size, Failure *failure)
{
    const RoomName order[] = {ROOM_FRAME,
                              ROOM_COUNTERS,
                              ROOM_POOL,
                              exchanged ? ROOM_NEXT : ROOM_NODES,
                              exchanged ? ROOM_NODES : ROOM_NEXT,
                              ROOM_ACROSS,
                              ROOM_UP,
                              ROOM_PICTURE,
                              ROOM_MEMORY};
    const cl_uint count = sizeof order / sizeof *order;
    cl_int status = CL_SUCCESS;
    for (cl_uint k = 0; k < count; k++) status |= clSetKernelArg(kernel, k, sizeof(cl_mem), &s->rooms[order[k]].mem);
    status |= clSetKernelArg(kernel, count, sizeof level, &level);
    status |= clSetKernelArg(kernel, count + 1, sizeof size, &size);
    return status == CL_SUCCESS || failed(failure, "cannot give a slice to its kernels", status);
}

static bool launch(Slicer *s, cl_kernel kernel, Failure *failure)
{
    size_t global = s->workers, local = 1;
    cl_int status = clEnqueueNDRangeKernel(s->device->queue, kernel, 1, NULL, &global, &local, 0, NULL, NULL);
    return status == CL_SUCCESS || failed(failure, "cannot draw a slice", status);
}

// The largest tile, and how many levels there are below it.
static uint32_t largest_tile(const SliceView *view, uint32_t *levels)
{
    uint32_t most = view->width > view->height ? view->width : view->height, size = 4 * SLICE_LEAF;
    for (*levels = 1; size < most; size *= 4) ++*levels;
    return size;
}

// The tile that holds the whole picture, once for each worker: each makes programs for a share of its parts. The smallest tiles are drawn whole.
static uint32_t first_nodes(const Slicer *s, uint32_t levels, SliceNode nodes[16])
{
    uint32_t count = levels == 1 ? 1 : s->workers < 16 ? s->workers : 16;
    for (uint32_t k = 0; k < count; k++) {
        nodes[k] = (SliceNode){.numbers = s->groups ? s->groups : s->steps.numbers,
                               .compares = s->steps.compares,
                               .logics = s->steps.logics};
        for (uint32_t part = k; part < 16; part += count) nodes[k].parts |= 1u << part;
    }
    return count;
}

static bool draw_tiles(Slicer *s, Failure *failure)
{
    SliceNode nodes[16];
    uint32_t counters[SLICE_COUNTERS] = {[SLICE_COUNT_POOL] = s->groups ? s->groups : step_count(&s->steps)}, levels;
    uint32_t size = largest_tile(&s->view, &levels), count = first_nodes(s, levels, nodes);
    counters[SLICE_COUNT_NODES(0)] = count;
    if (!upload(s, ROOM_COUNTERS, counters, sizeof counters, false, failure) ||
        !upload(s, ROOM_NODES, nodes, count * sizeof *nodes, false, failure))
        return false;
    for (uint32_t level = 0; level < levels; level++, size /= 4) {
        if (!set_arguments(s, s->tiles, level & 1, level, size / 4, failure) || !launch(s, s->tiles, failure))
            return false;
    }
    cl_int status = clFinish(s->device->queue);
    return status == CL_SUCCESS || failed(failure, "cannot draw a slice", status);
}

static bool draw_each(Slicer *s, Failure *failure)
{
    SliceNode node = {.numbers = s->steps.numbers, .compares = s->steps.compares, .logics = s->steps.logics};
    uint32_t counters[SLICE_COUNTERS] = {0};
    if (!upload(s, ROOM_COUNTERS, counters, sizeof counters, true, failure) ||
        !upload(s, ROOM_NODES, &node, sizeof node, true, failure) || !set_arguments(s, s->each, false, 0, 0, failure) ||
        !launch(s, s->each, failure))
        return false;
    cl_int status = clFinish(s->device->queue);
    return status == CL_SUCCESS || failed(failure, "cannot draw a slice", status);
}

bool slicer_draw(Slicer *s, const SliceView *view, SliceHow how, Failure *failure)
{
    if (s->steps.known) {
        s->frame = (SliceFrame){.width = view->width, .height = view->height, .stride = 4 * rounded(view->width, 64)};
        return true;
    }
    if (!set_view(s, view, failure)) return false;
    return (how == SLICE_BRUTE || !s->exact) && !s->groups ? draw_each(s, failure) : draw_tiles(s, failure);
}

// --- the picture

uint32_t slicer_stride(const Slicer *s)
{
    return s->frame.stride;
}

// Bits beyond the width are whatever the kernels found there.
static void clear_beyond(Slicer *s)
{
    uint32_t last = s->frame.width / 16, rest = s->frame.width % 16;
    for (uint32_t y = 0; y < s->frame.height; y++) {
        uint16_t *row = s->bits + (size_t)y * s->frame.stride;
        if (rest) row[last] &= (uint16_t)((1u << rest) - 1);
        for (uint32_t k = last + (rest != 0); k < s->frame.stride; k++) row[k] = 0;
    }
}

const uint16_t *slicer_bits(Slicer *s, Failure *failure)
{
    size_t size = (size_t)s->frame.stride * s->frame.height * sizeof *s->bits;
    if (size > s->bits_size) {
        free(s->bits);
        s->bits = malloc(size);
        s->bits_size = s->bits ? size : 0;
    }
    if (!s->bits) {
        fail(failure, "out of memory");
        return NULL;
    }
    if (s->steps.known) {
        memset(s->bits, s->steps.holds ? 0xff : 0, size);
    } else {
        cl_int status =
            clEnqueueReadBuffer(s->device->queue, s->rooms[ROOM_PICTURE].mem, CL_TRUE, 0, size, s->bits, 0, NULL, NULL);
        if (status != CL_SUCCESS) {
            failed(failure, "cannot read a slice", status);
            return NULL;
        }
    }
    clear_beyond(s);
    return s->bits;
}

uint64_t slicer_count(const Slicer *s, const uint16_t *bits)
{
    uint64_t count = 0;
    size_t words = (size_t)s->frame.stride * s->frame.height;
    for (size_t k = 0; k < words; k++) count += (uint64_t)__builtin_popcount(bits[k]);
    return count;
}
