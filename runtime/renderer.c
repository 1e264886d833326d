// A frame is cut into bands of tiles, so that a cancelled one ends soon: a band is made about as long as BAND_MS from what the bands before it
// took, and two are under way at a time. Tiles are independent, so neither bands nor threads can be seen in a picture.
//
// The layers of a CPU's film are buffers over the film's own memory: nothing is copied.
#include "runtime/renderer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "compiler/emit.h"
#include "runtime/pocl.h"
#include "runtime/view.h"

_Static_assert(sizeof(QuadricRecord) == 64, "as on the device");
_Static_assert(sizeof(PlanNode) == 32, "as on the device");
_Static_assert(sizeof(ClusterPart) == PART_RECORDS * sizeof(QuadricRecord), "as on the device");
_Static_assert(sizeof(CopyRecord) == COPY_RECORDS * sizeof(QuadricRecord), "as on the device");
_Static_assert(sizeof(ViewConstants) == 19 * 4, "as on the device");
_Static_assert(sizeof(LightConstants) == 16 * 4, "as on the device");
_Static_assert(sizeof(MaterialConstants) == 9 * 4, "as on the device");
_Static_assert(sizeof(FrameConstants) == 41 * 4, "as on the device");

#define BAND_MS       25.0
#define FIRST_BAND    128         // tiles, before anything is known
#define LIST_ROOM     1024        // items in a tile's list, at first
#define LIST_BYTES    (64u << 20) // for the lists of the tiles of a band
#define COPY_BYTES    (24u << 20) // the same where lists make records of copies, with these
#define SHADOW_BIAS   1e-4        // in units
#define FILM_LAYERS   6
#define REGION_FIELDS 24           // general fields that a region keeps
#define REGION_BYTES  (256u << 20) // for all regions of a picture

typedef struct Buffer {
    cl_mem mem;
    size_t size;
    void *host; // the memory it lies over; NULL: its own
} Buffer;

typedef enum BufferName {
    BUFFER_FRAME,
    BUFFER_VIEWS,
    BUFFER_LIGHTS,
    BUFFER_RECORDS,
    BUFFER_BOXES,
    BUFFER_ITEMS,
    BUFFER_NODES,
    BUFFER_MATERIALS,
    BUFFER_TAPES,
    BUFFER_WORK,
    BUFFER_COUNTERS,
    BUFFER_FILM,
    BUFFER_COUNT = BUFFER_FILM + FILM_LAYERS
} BufferName;

struct Renderer {
    const Device *device;
    const Plan *plan;
    Layout layout;
    cl_kernel kernel;
    Buffer buffers[BUFFER_COUNT]; // in the order of the kernel's arguments
    // What the device holds of the frame before.
    double *values;
    Box bounds; // of its scene; they hold while `folded` is not 0
    Projection *views;
    int view_count, view_capacity, folded; // folded: views whose records and boxes are those of `values`
    Projection *wanted;
    uint64_t tapes; // version of those on the device
    ViewConstants *view_constants;
    LightConstants *light_constants;
    MaterialConstants *material_constants;
    FrameConstants frame;
    uint32_t list_room; // items in the list of a tile
    uint32_t regions;   // of the frame
    uint32_t tiles;     // of the frame
    uint32_t slots;     // work-items that have room for their tiles' lists: at most as many run at a time
    double tile_ms;     // what a tile took; 0: not known
};

static double now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

// Buffers.

static void buffer_release(Buffer *buffer)
{
    if (buffer->mem) clReleaseMemObject(buffer->mem);
    *buffer = (Buffer){0};
}

// Makes the buffer at least `size` bytes, or exactly over `host`. What it held is lost if it changes.
static bool buffer_ensure(Renderer *r, BufferName name, size_t size, void *host, Failure *failure)
{
    Buffer *buffer = &r->buffers[name];
    if (size < 64) size = 64;
    if (buffer->mem && buffer->host == host && (host ? buffer->size == size : buffer->size >= size)) return true;
    buffer_release(buffer);
    cl_int status;
    buffer->mem =
        clCreateBuffer(r->device->context, CL_MEM_READ_WRITE | (host ? CL_MEM_USE_HOST_PTR : 0), size, host, &status);
    if (status != CL_SUCCESS) {
        buffer->mem = NULL;
        return fail(failure, "the device has no %.1f MB for this picture: %s", (double)size / 1e6,
                    device_error(status));
    }
    buffer->size = size;
    buffer->host = host;
    return true;
}

// Without waiting: the data are left as they are until the frame ends. Each wait would wake two threads, and a frame of S1 took 0.2 ms longer for all of
// them together, whatever the number of threads.
static bool buffer_send(Renderer *r, BufferName name, const void *data, size_t size, Failure *failure)
{
    if (!buffer_ensure(r, name, size, NULL, failure)) return false;
    if (!size) return true;
    cl_int status =
        clEnqueueWriteBuffer(r->device->queue, r->buffers[name].mem, CL_FALSE, 0, size, data, 0, NULL, NULL);
    if (status != CL_SUCCESS) return fail(failure, "cannot write to the device: %s", device_error(status));
    return true;
}

// Until what was sent has arrived.
static bool wait_for_queue(Renderer *r, Failure *failure)
{
    cl_int status = clFinish(r->device->queue);
    return status == CL_SUCCESS || fail(failure, "the device failed: %s", device_error(status));
}

static bool buffer_write(Renderer *r, BufferName name, const void *data, size_t size, Failure *failure)
{
    return buffer_send(r, name, data, size, failure) && wait_for_queue(r, failure);
}

static void *buffer_map(Renderer *r, BufferName name, cl_map_flags flags, size_t offset, size_t size, Failure *failure)
{
    cl_int status;
    void *host = clEnqueueMapBuffer(r->device->queue, r->buffers[name].mem, CL_TRUE, flags, offset, size, 0, NULL, NULL,
                                    &status);
    if (status == CL_SUCCESS) return host;
    fail(failure, "cannot reach the device's memory: %s", device_error(status));
    return NULL;
}

static void buffer_unmap(Renderer *r, BufferName name, void *host)
{
    clEnqueueUnmapMemObject(r->device->queue, r->buffers[name].mem, host, 0, NULL, NULL);
}

// Making.

Renderer *renderer_new(const Device *device, cl_program program, const Plan *plan, Failure *failure)
{
    Renderer *r = calloc(1, sizeof *r);
    if (!r) {
        fail(failure, "out of memory");
        return NULL;
    }
    r->device = device;
    r->plan = plan;
    cl_int status;
    r->kernel = clCreateKernel(program, EMIT_KERNEL, &status);
    if (status != CL_SUCCESS) {
        char cache[POCL_PATH_SIZE];
        fail(failure, "the device's program has no kernel (%s)", device_error(status));
        if (device->info.is_pocl && pocl_cache_folder(cache))
            fail(failure, "the OpenCL driver's cache is damaged: delete the folder %s", cache);
        free(r);
        return NULL;
    }
    bool ready = layout_init(&r->layout, plan, device->info.has_fp64);
    r->values = calloc(plan->slot_count + 1, sizeof *r->values);
    r->light_constants = calloc(plan->light_count + 1, sizeof *r->light_constants);
    r->material_constants = calloc(plan->material_count + 1, sizeof *r->material_constants);
    r->view_capacity = 1 + 6 * (int)plan->light_count;
    r->views = calloc((size_t)r->view_capacity, sizeof *r->views);
    r->wanted = calloc((size_t)r->view_capacity, sizeof *r->wanted);
    r->view_constants = calloc((size_t)r->view_capacity, sizeof *r->view_constants);
    if (!ready || !r->values || !r->light_constants || !r->material_constants || !r->views || !r->wanted ||
        !r->view_constants) {
        fail(failure, "out of memory");
        renderer_free(r);
        return NULL;
    }
    const Layout *layout = &r->layout;
    if (!buffer_write(r, BUFFER_ITEMS, layout->items, layout->item_stride * sizeof *layout->items, failure) ||
        !buffer_write(r, BUFFER_NODES, layout->nodes, layout->record_count * sizeof *layout->nodes, failure)) {
        renderer_free(r);
        return NULL;
    }
    r->list_room = layout->item_stride < LIST_ROOM ? layout->item_stride : LIST_ROOM;
    return r;
}

void renderer_free(Renderer *r)
{
    if (!r) return;
    clFinish(r->device->queue); // a frame that failed may have sent what is freed here
    for (int k = 0; k < BUFFER_COUNT; k++) buffer_release(&r->buffers[k]);
    if (r->kernel) clReleaseKernel(r->kernel);
    layout_release(&r->layout);
    free(r->values);
    free(r->light_constants);
    free(r->material_constants);
    free(r->views);
    free(r->wanted);
    free(r->view_constants);
    free(r);
}

void renderer_bounds(Renderer *r, const double *values, Box *box)
{
    view_frame(&r->layout, values);
    view_bounds(&r->layout, values, box);
}

// Views.

// The cosines at the rim of a spot's light and where it is full; softer than a float can tell is hard.
static void make_spot(LightConstants *c, const PlanLight *light, const double *v, const Projection *primary)
{
    double fade = v[12] / primary->unit, length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    c->fade = fade > 0 ? (float)(1 / (fade * fade)) : 0;
    c->rim = -2;
    c->rise = 1;
    if (light->kind != LIGHT_SPOT) return;
    double full = cos(fmin(v[9] / 2, M_PI)), rim = cos(fmin(v[9] / 2 + v[10], M_PI));
    c->rim = (float)rim;
    c->rise = (float)(1 / fmax(full - rim, 1e-6));
    for (int axis = 0; axis < 3; axis++) {
        const double *a = primary->axis[axis];
        c->axis[axis] = (float)((a[0] * v[0] + a[1] * v[1] + a[2] * v[2]) / (length > 0 ? length : 1));
    }
}

static int make_lights(Renderer *r, const double *values, const Box *bounds)
{
    const Plan *plan = r->plan;
    const Projection *primary = &r->wanted[0];
    int count = 1;
    for (uint32_t k = 0; k < plan->light_count; k++) {
        const PlanLight *light = &plan->lights[k];
        const double *v = values + light->values;
        LightConstants *c = &r->light_constants[k];
        int views = v[13] != 0 ? view_light(plan, values, light, bounds, primary, &r->wanted[count]) : 0;
        *c = (LightConstants){.point = light->kind != LIGHT_DIRECTIONAL,
                              .shadow = v[13] != 0,
                              .first_view = (unsigned)count,
                              .view_count = (unsigned)views};
        double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (int axis = 0; axis < 3; axis++) {
            const double *a = primary->axis[axis], *o = primary->origin;
            c->color[axis] = (float)v[6 + axis];
            double at = c->point ? (a[0] * (v[3] - o[0]) + a[1] * (v[4] - o[1]) + a[2] * (v[5] - o[2])) / primary->unit
                                 : -(a[0] * v[0] + a[1] * v[1] + a[2] * v[2]) / (length > 0 ? length : 1);
            c->at[axis] = (float)at;
        }
        make_spot(c, light, v, primary);
        for (int view = 0; view < views; view++) r->view_constants[count + view].faced = views > 1;
        count += views;
    }
    return count;
}

// Before the records of views stand the parts of clusters, behind them the room for what lists make of copies.
static uint32_t first_record(const Renderer *r, uint32_t view)
{
    return PART_RECORDS * r->layout.clusters.part_count + view * r->layout.record_count;
}

static void make_view_constants(Renderer *r, int count)
{
    for (int k = 0; k < count; k++) {
        const Projection *p = &r->wanted[k];
        ViewConstants *c = &r->view_constants[k];
        c->kappa = (float)p->kappa;
        c->start = (float)p->start;
        c->limit = (float)p->limit;
        c->first_record = first_record(r, (unsigned)k);
        c->first_box = (unsigned)k * BOX_FLOATS(r->layout.item_count);
        c->unit_distance = p->kappa > 0 ? (float)(1 / p->kappa) : 0;
        view_map(&r->wanted[0], p, c->map);
    }
}

#define LOCAL_SIZE 64 // work-items that share a tile where they are not packets
#define WORKERS    4 // for each thread where they are: the device may give a thread several of them, one after the other

// Packets: a work-item takes one tile after the other. Else a tile is a work-group.
static bool takes_tiles(const Renderer *r)
{
    return r->device->width == 16;
}

static uint32_t worker_count(const Renderer *r)
{
    return WORKERS * (r->device->info.compute_units ? r->device->info.compute_units : 1);
}

// Steps for the shortened tapes of a tile: for as many slabs as most tiles have.
static uint32_t tape_pool(const Renderer *r)
{
    uint32_t wanted = 24 * r->layout.fields.longest;
    return wanted > 32768 ? 32768 : wanted;
}

// A tile's memory for general fields, in unsigneds.
static uint32_t field_room(const Renderer *r)
{
    uint32_t lanes = r->device->width == 1 ? LOCAL_SIZE : 32;
    return r->plan->tape_count ? FIELD_ROOM(r->layout.fields.longest, tape_pool(r), lanes) : 0;
}

// How many tiles have room for their lists at a time, where a list's tile takes so many unsigneds.
static uint32_t slots_for(const Renderer *r, uint32_t slot_size, uint32_t tiles)
{
    bool shares = r->layout.clusters.shares;
    uint32_t records = shares ? r->list_room * (uint32_t)(sizeof(QuadricRecord) / 4) : 0;
    uint32_t slots = (shares ? COPY_BYTES : LIST_BYTES) / 4 / (slot_size + records);
    if (slots < 2) slots = 2;
    if (takes_tiles(r) && slots > worker_count(r)) slots = worker_count(r);
    return slots > tiles ? tiles : slots;
}

static uint32_t slot_lists(const Renderer *r)
{
    return ((2 + BOX_ARRAYS) * r->list_room + 31) & ~31u;
}

// Bytes for the records that lists make of copies.
static size_t copy_room(const Renderer *r)
{
    if (!r->layout.clusters.shares) return 0;
    return (size_t)slots_for(r, slot_lists(r) + field_room(r), r->tiles) * r->list_room * sizeof(QuadricRecord);
}

static bool write_parts(Renderer *r, Failure *failure)
{
    size_t size = (size_t)r->layout.clusters.part_count * sizeof(ClusterPart);
    if (!size) return true;
    cl_int status = clEnqueueWriteBuffer(r->device->queue, r->buffers[BUFFER_RECORDS].mem, CL_TRUE, 0, size,
                                         r->layout.clusters.parts, 0, NULL, NULL);
    if (status != CL_SUCCESS) return fail(failure, "cannot write to the device: %s", device_error(status));
    return true;
}

// Folds the views that are not on the device yet.
static bool fold_views(Renderer *r, const double *values, int count, Failure *failure)
{
    const Layout *layout = &r->layout;
    size_t records = (size_t)layout->record_count * sizeof(QuadricRecord),
           all = first_record(r, (uint32_t)count) * sizeof(QuadricRecord);
    size_t boxes = BOX_FLOATS((size_t)layout->item_count) * sizeof(float);
    // A buffer that is made anew may well have the handle of the one before, so what they hold is told by their sizes.
    if (r->buffers[BUFFER_RECORDS].size < all + copy_room(r) || r->buffers[BUFFER_BOXES].size < boxes * (size_t)count)
        r->folded = 0;
    if (!buffer_ensure(r, BUFFER_RECORDS, all + copy_room(r), NULL, failure) ||
        !buffer_ensure(r, BUFFER_BOXES, boxes * (size_t)count, NULL, failure)) {
        r->folded = 0;
        return false;
    }
    if (!r->folded && !write_parts(r, failure)) return false;
    for (int k = 0; k < count; k++) {
        if (k < r->folded && !memcmp(&r->views[k], &r->wanted[k], sizeof *r->views)) continue;
        if (records) {
            size_t at = first_record(r, (uint32_t)k) * sizeof(QuadricRecord);
            QuadricRecord *to = buffer_map(r, BUFFER_RECORDS, CL_MAP_WRITE, at, records, failure);
            float *box = to ? buffer_map(r, BUFFER_BOXES, CL_MAP_WRITE, boxes * (size_t)k, boxes, failure) : NULL;
            if (!box) {
                r->folded = 0;
                return false;
            }
            view_fold(&r->layout, values, &r->wanted[k], to, box);
            buffer_unmap(r, BUFFER_RECORDS, to);
            buffer_unmap(r, BUFFER_BOXES, box);
        }
        r->views[k] = r->wanted[k];
    }
    r->folded = count;
    return true;
}

// A highlight is (r v)^shininess: cosines up to this one make less than 2^-40 of it.
static double dull_cosine(double shininess)
{
    return shininess >= 1 ? exp2(-40 / shininess) : -1;
}

static void make_materials(Renderer *r, const double *values)
{
    for (uint32_t k = 0; k < r->plan->material_count; k++) {
        const double *v = values + r->plan->materials[k].values;
        r->material_constants[k] = (MaterialConstants){.color = {(float)v[0], (float)v[1], (float)v[2]},
                                                       .ambient = (float)v[3],
                                                       .diffuse = (float)v[4],
                                                       .specular = (float)v[5],
                                                       .shininess = (float)v[6],
                                                       .emission = (float)v[10],
                                                       .dull = (float)dull_cosine(v[6])};
    }
}

// Film.

static void film_layers(const Film *film, void *memory[FILM_LAYERS], size_t size[FILM_LAYERS])
{
    size_t pixels = (size_t)film->width * (size_t)film->height;
    void *all[FILM_LAYERS] = {film->color, film->depth, film->normal, film->position, film->id, film->certificate};
    static const int channels[FILM_LAYERS] = {4, 1, 3, 3, 1, 1};
    for (int k = 0; k < FILM_LAYERS; k++) {
        memory[k] = (film->layers >> k & 1u) ? all[k] : NULL;
        size[k] = memory[k] ? pixels * (size_t)channels[k] * sizeof(float) : 0;
    }
}

static bool ensure_film(Renderer *r, const Film *film, Failure *failure)
{
    void *memory[FILM_LAYERS];
    size_t size[FILM_LAYERS];
    film_layers(film, memory, size);
    for (int k = 0; k < FILM_LAYERS; k++)
        if (!buffer_ensure(r, BUFFER_FILM + k, size[k], r->device->info.is_cpu ? memory[k] : NULL, failure))
            return false;
    return true;
}

static bool read_film(Renderer *r, const Film *film, Failure *failure)
{
    void *memory[FILM_LAYERS];
    size_t size[FILM_LAYERS];
    film_layers(film, memory, size);
    for (int k = 0; k < FILM_LAYERS; k++) {
        if (!memory[k]) continue;
        cl_int status = CL_SUCCESS;
        if (r->buffers[BUFFER_FILM + k].host) {
            void *host = clEnqueueMapBuffer(r->device->queue, r->buffers[BUFFER_FILM + k].mem, CL_FALSE, CL_MAP_READ, 0,
                                            size[k], 0, NULL, NULL, &status);
            if (status == CL_SUCCESS) buffer_unmap(r, BUFFER_FILM + k, host);
        } else {
            status = clEnqueueReadBuffer(r->device->queue, r->buffers[BUFFER_FILM + k].mem, CL_FALSE, 0, size[k],
                                         memory[k], 0, NULL, NULL);
        }
        if (status != CL_SUCCESS) return fail(failure, "cannot read from the device: %s", device_error(status));
    }
    return wait_for_queue(r, failure);
}

// Frames.

static bool set_arguments(Renderer *r, Failure *failure)
{
    cl_int status = CL_SUCCESS;
    for (cl_uint k = 0; k < BUFFER_COUNT && status == CL_SUCCESS; k++)
        status = clSetKernelArg(r->kernel, k, sizeof(cl_mem), &r->buffers[k].mem);
    if (status != CL_SUCCESS) return fail(failure, "cannot set the kernel's arguments: %s", device_error(status));
    return true;
}

static bool upload(Renderer *r, const RenderJob *job, uint32_t tiles_across, uint32_t tiles_down, RenderStats *stats,
                   Failure *failure)
{
    const Film *film = job->film;
    const Plan *plan = r->plan;
    const double *values = job->values;
    double begin = now_ms();
    Screen screen;
    view_frame(&r->layout, values);
    bool changed = r->tapes != r->layout.fields.version;
    if (changed || !view_same_geometry(&r->layout, values, r->values)) r->folded = 0;
    r->tapes = 0; // until they are on the device
    r->layout.cells = job->cells;
    // As long as folding a view: half a millisecond of a frame of 4096 perturbations, two of 10,000 objects.
    if (!r->folded) view_bounds(&r->layout, values, &r->bounds);
    view_primary(&r->layout, values, &r->bounds, film->width, film->height, &r->wanted[0], &screen);
    int views = make_lights(r, values, &r->bounds);
    make_view_constants(r, views);
    if (!fold_views(r, values, views, failure)) return false;
    memcpy(r->values, values, plan->slot_count * sizeof *values);
    make_materials(r, values);
    stats->fold_ms = now_ms() - begin;
    stats->views = views;

    const Projection *primary = &r->wanted[0];
    r->frame = (FrameConstants){.width = film->width,
                                .height = film->height,
                                .tiles_across = (int)tiles_across,
                                .tiles_down = tiles_down,
                                .layers = film->layers,
                                .u0 = (float)(screen.u0 + (film->place_x - 0.5) * screen.du),
                                .v0 = (float)(screen.v0 + (film->place_y - 0.5) * screen.dv),
                                .du = (float)screen.du,
                                .dv = (float)screen.dv,
                                .item_count = r->layout.item_count,
                                .item_stride = r->layout.item_stride,
                                .light_count = film->layers & FILM_COLOR ? plan->light_count : 0,
                                .leaf_count = r->layout.leaf_count,
                                .bias = (float)SHADOW_BIAS,
                                .orthographic = plan->orthographic,
                                .unit = (float)primary->unit};
    for (int k = 0; k < 3; k++) {
        r->frame.origin[k] = (float)primary->origin[k];
        r->frame.background[k] = (float)values[plan->background + (Slot)k];
        for (int axis = 0; axis < 3; axis++) r->frame.axes[3 * axis + k] = (float)primary->axis[axis][k];
    }
    size_t tapes = changed ? plan->tape_step_count * sizeof(TapeStep) : 0;
    if (!buffer_write(r, BUFFER_TAPES, r->layout.fields.baked, tapes, failure)) return false;
    r->tapes = r->layout.fields.version;
    return buffer_send(r, BUFFER_VIEWS, r->view_constants, (size_t)views * sizeof *r->view_constants, failure) &&
           buffer_send(r, BUFFER_LIGHTS, r->light_constants, plan->light_count * sizeof *r->light_constants, failure) &&
           buffer_send(r, BUFFER_MATERIALS, r->material_constants, plan->material_count * sizeof *r->material_constants,
                       failure);
}

// How many fields a region is to have room for.
static uint32_t region_fields(const Plan *plan)
{
    uint32_t count = 0;
    for (uint32_t k = 0; k < plan->leaf_count && count < REGION_FIELDS; k++)
        count += plan->leaves[k].kind == LEAF_FIELD;
    return count;
}

// Regions are for packets, and for pictures for which they do not take too much memory. Returns what they take, in unsigneds.
static size_t make_regions(Renderer *r)
{
    uint32_t side = TILE_SIZE * REGION_TILES;
    uint32_t across = ((uint32_t)r->frame.width + side - 1) / side,
             down = ((uint32_t)r->frame.height + side - 1) / side;
    r->frame.region_fields = r->device->width == 1 ? 0 : region_fields(r->plan);
    r->frame.region_size = REGION_ROOM(r->frame.region_fields, tape_pool(r));
    size_t size = (size_t)across * down * r->frame.region_size;
    r->regions = r->frame.region_fields && size <= REGION_BYTES / 4 ? across * down : 0;
    r->frame.regions_across = r->regions ? across : 0;
    return r->regions ? size : 0;
}

// Room for lists of `list_room` items, for as many tiles as fit, and all the kernel's arguments.
static bool make_room(Renderer *r, uint32_t tiles, Failure *failure)
{
    uint32_t lists = slot_lists(r), slot_size = lists + field_room(r);
    r->slots = slots_for(r, slot_size, tiles);
    r->frame.list_capacity = r->list_room;
    r->frame.copy_first = first_record(r, (uint32_t)r->folded);
    r->frame.slot_size = slot_size;
    r->frame.field_offset = lists;
    r->frame.tape_longest = r->layout.fields.longest;
    r->frame.tape_pool = tape_pool(r);
    r->frame.region_first = r->slots;
    size_t work = (size_t)r->slots * slot_size + make_regions(r);
    static const unsigned zeros[COUNTER_COUNT];
    return buffer_ensure(r, BUFFER_WORK, work * 4, NULL, failure) &&
           buffer_send(r, BUFFER_FRAME, &r->frame, sizeof r->frame, failure) &&
           buffer_send(r, BUFFER_COUNTERS, zeros, sizeof zeros, failure) && set_arguments(r, failure);
}

// `longest`: list that did not fit; 0 if all did.
static bool read_counters(Renderer *r, uint32_t *longest, RenderStats *stats, Failure *failure)
{
    unsigned counters[COUNTER_COUNT];
    cl_int status = clEnqueueReadBuffer(r->device->queue, r->buffers[BUFFER_COUNTERS].mem, CL_TRUE, 0, sizeof counters,
                                        counters, 0, NULL, NULL);
    if (status != CL_SUCCESS) return fail(failure, "cannot read from the device: %s", device_error(status));
    *longest = counters[COUNTER_LIST];
    stats->uncertain = counters[COUNTER_UNCERTAIN];
    stats->shadow_rays = (uint64_t)counters[COUNTER_SHADOWS_HIGH] << 32 | counters[COUNTER_SHADOWS];
    return true;
}

static bool is_cancelled(const RenderJob *job)
{
    return job->cancel && atomic_load_explicit(job->cancel, memory_order_relaxed);
}

typedef struct Band {
    cl_event event; // NULL: none
    uint32_t tiles;
} Band;

// Waits for a band and learns what a tile takes; `*mark` is when the device began with it, and then when it ended.
static bool finish_band(Renderer *r, Band *band, double *mark, Failure *failure)
{
    if (!band->event) return true;
    cl_int status = clWaitForEvents(1, &band->event);
    clReleaseEvent(band->event);
    band->event = NULL;
    double end = now_ms();
    r->tile_ms = fmax((end - *mark) / band->tiles, 1e-6);
    *mark = end;
    if (status != CL_SUCCESS) return fail(failure, "the device failed: %s", device_error(status));
    return true;
}

static bool start_band(Renderer *r, Band *band, uint32_t first, uint32_t tiles, RenderStages stages, Failure *failure)
{
    // PoCL's binaries hold the function for work-groups of one; elsewhere a group shares its tile.
    size_t local = r->device->width == 1 && !r->device->info.is_cpu ? LOCAL_SIZE : 1;
    size_t global = (takes_tiles(r) && r->slots < tiles ? r->slots : tiles) * local;
    cl_uint begin = first, end = first + tiles, stage = stages;
    cl_int status = clSetKernelArg(r->kernel, BUFFER_COUNT, sizeof begin, &begin);
    if (status == CL_SUCCESS) status = clSetKernelArg(r->kernel, BUFFER_COUNT + 1, sizeof end, &end);
    if (status == CL_SUCCESS) status = clSetKernelArg(r->kernel, BUFFER_COUNT + 2, sizeof stage, &stage);
    if (status == CL_SUCCESS)
        status = clEnqueueNDRangeKernel(r->device->queue, r->kernel, 1, NULL, &global, &local, 0, NULL, &band->event);
    if (status != CL_SUCCESS) {
        band->event = NULL;
        return fail(failure, "the device does not run the kernel: %s", device_error(status));
    }
    band->tiles = tiles;
    clFlush(r->device->queue);
    return true;
}

// Where a tile is a work-group at most `slots` tiles a band: as many have room for their lists. Bands run one after another, so they share it.
static RenderResult run_bands(Renderer *r, const RenderJob *job, uint32_t tiles, RenderStats *stats, Failure *failure)
{
    Band running = {0}, next;
    RenderResult result = RENDER_DONE;
    double mark = now_ms();
    for (uint32_t first = 0; first < tiles; first += next.tiles) {
        if (is_cancelled(job)) {
            result = RENDER_CANCELLED;
            break;
        }
        double fit = r->tile_ms > 0 ? BAND_MS / r->tile_ms : FIRST_BAND;
        // Where work-items take tiles, a band of a few would leave threads without any at its end.
        uint32_t most = takes_tiles(r) ? tiles : r->slots, least = takes_tiles(r) ? 2 * r->slots : 1;
        uint32_t count = fit < least ? least : fit < most ? (uint32_t)fit : most;
        if (count > tiles - first) count = tiles - first;
        if (!start_band(r, &next, first, count, job->stages, failure)) {
            result = RENDER_FAILED;
            break;
        }
        stats->bands++;
        bool good = finish_band(r, &running, &mark, failure);
        running = next;
        if (!good) {
            result = RENDER_FAILED;
            break;
        }
        if (job->progress) job->progress(job->progress_data, (double)first / tiles);
    }
    if (!finish_band(r, &running, &mark, failure)) result = RENDER_FAILED;
    return result;
}

// What general fields are in the regions of the picture, which its tiles begin with.
static bool run_regions(Renderer *r, Failure *failure)
{
    uint32_t most = takes_tiles(r) ? r->regions : r->slots;
    for (uint32_t first = 0; first < r->regions; first += most) {
        Band band;
        double mark = now_ms(), tile_ms = r->tile_ms;
        uint32_t count = r->regions - first < most ? r->regions - first : most;
        bool good = start_band(r, &band, first, count, (RenderStages)STAGE_REGIONS, failure) &&
                    finish_band(r, &band, &mark, failure);
        r->tile_ms = tile_ms;
        if (!good) return false;
    }
    return true;
}

RenderResult renderer_frame(Renderer *r, const RenderJob *job, RenderStats *stats, Failure *failure)
{
    RenderStats unused;
    if (!stats) stats = &unused;
    *stats = (RenderStats){.items = r->layout.item_count};
    const Film *film = job->film;
    uint32_t across = ((uint32_t)film->width + TILE_SIZE - 1) / TILE_SIZE,
             down = ((uint32_t)film->height + TILE_SIZE - 1) / TILE_SIZE;
    uint32_t tiles = across * down;
    if (tiles != r->tiles) r->list_room = r->layout.item_stride < LIST_ROOM ? r->layout.item_stride : LIST_ROOM;
    r->tiles = tiles;
    if (!ensure_film(r, film, failure) || !upload(r, job, across, down, stats, failure)) return RENDER_FAILED;
    double began = now_ms();
    uint32_t longest = 0;
    RenderResult result;
    do { // again where a list did not fit: the lists of pixels, and then those of lights, so at most three times
        while (r->list_room < longest) r->list_room *= 2;
        if (longest && r->layout.clusters.shares && !fold_views(r, r->values, r->folded, failure)) return RENDER_FAILED;
        if (!make_room(r, tiles, failure)) return RENDER_FAILED;
        if (!run_regions(r, failure)) return RENDER_FAILED;
        result = run_bands(r, job, tiles, stats, failure);
        if (result != RENDER_FAILED && !read_counters(r, &longest, stats, failure)) return RENDER_FAILED;
    } while (result == RENDER_DONE && longest);
    if (result == RENDER_FAILED || !read_film(r, film, failure)) return RENDER_FAILED;
    stats->run_ms = now_ms() - began;
    stats->list_room = r->list_room;
    for (int k = 0; k < BUFFER_COUNT; k++) stats->device_bytes += r->buffers[k].size;
    return result;
}
