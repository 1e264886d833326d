// The part of the public API that uses a device: frames, images, packages.
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "compiler/emit.h"
#include "compiler/frame.h"
#include "runtime/camera.h"
#include "runtime/framing.h"
#include "runtime/image_exr.h"
#include "runtime/image_png.h"
#include "runtime/scene.h"
#include "runtime/scene_patches.h"
#include "runtime/slice_package.h"

#define SAMPLE_LIMIT   16
#define CAMERA_MOMENTS 9      // of an animation, for which an automatic camera is placed
#define MANY_VALUES    200000 // of a frame: then only three moments are looked at

// --- device and kernels

static ScnStatus open_device(ScnScene *scene)
{
    if (scene->device) return SCN_OK;
    double start = scene_milliseconds();
    DeviceDesc desc = {
        .choice = scene->device_choice, .threads = scene->threads, .width = scene->lanes, .no_cache = scene->no_cache};
    scene->device = device_open(&desc, &scene->failure);
    if (!scene->device) return SCN_WORLD_FAILED;
    scene->stats.device_ms = scene_milliseconds() - start;
    scene->stats.device = scene->device->info.name;
    return SCN_OK;
}

// Kernels as good as the compiler makes them; NULL with the failure set. With `ready_only` they are not compiled: NULL
// without a failure then.
static Program *full_program(ScnScene *scene, bool ready_only)
{
    const Package *package = scene->package;
    char key[DEVICE_KEY_SIZE];
    device_key(scene->device, key);
    const PackageBinary *binary = package_binary(package, key);
    ProgramDesc desc = {
        .source = package->kernel,
        .length = package->kernel_length,
        .options = emit_options(scene->device->width),
        .binary = binary ? binary->bytes : NULL,
        .binary_size = binary ? binary->size : 0,
        .no_cache = scene->no_cache,
        .ready_only = ready_only,
    };
    return program_build(scene->device, &desc, &scene->failure);
}

// PoCL builds kernels without optimising them in half the time, 1.2 s instead of 1.7 s for a small scene and 1.2 s
// instead of 2.5 s for one of many shapes. They give the same picture, bit for bit, since what the compiler may
// do with floating point is fixed before it optimises; they take three to six times as long for it. With general fields
// nothing is gained: what is not optimised is so much code then that it takes longer to build.
static Program *quick_program(ScnScene *scene)
{
    char options[256];
    snprintf(options, sizeof options, "%s -cl-opt-disable", emit_options(scene->device->width));
    ProgramDesc desc = {
        .source = scene->package->kernel,
        .length = scene->package->kernel_length,
        .options = options,
        .no_cache = scene->no_cache,
    };
    return program_build(scene->device, &desc, &scene->failure);
}

static ScnStatus build_program(ScnScene *scene)
{
    if (scene->program) return SCN_OK;
    bool quick = scene->quick && scene->device->info.is_pocl && !scene->package->plan->tape_count;
    scene->program = full_program(scene, quick);
    if (!scene->program && quick) {
        scene->program = quick_program(scene);
        scene->stats.quick = true;
    }
    if (!scene->program) return SCN_WORLD_FAILED;
    scene->stats.build_ms = scene->program->build_ms;
    scene->stats.kernel_builds += scene->program->builds;
    scene->stats.from_cache = scene->program->from_cache;
    scene->stats.from_binary = scene->program->from_binary;
    return SCN_OK;
}

// PoCL compiles a kernel a second time, for the work-groups that it is launched with, when it is launched first. A
// picture of one pixel makes that part of the building.
static void launch_once(ScnScene *scene)
{
    double start = scene_milliseconds();
    FrameError error;
    Film *film = film_new(1, 1, FILM_COLOR);
    const Plan *plan = scene->package->plan;
    RenderJob job = {.values = scene->values, .film = film};
    if (film && frame_evaluate(plan, &(FrameInput){.inputs = scene->inputs}, scene->values, &error)) {
        double *camera = scene->values + plan->camera;
        if (camera[14] != 0)
            camera_frame(camera, plan->orthographic, &(Box){{-1, -1, -1}, {1, 1, 1}}, 1); // it has no eye yet
        renderer_frame(scene->renderer, &job, NULL, NULL); // what fails will fail again, in a frame that is asked for
    }
    film_free(film);
    scene->stats.build_ms += scene_milliseconds() - start;
}

static ScnStatus make_renderer(ScnScene *scene)
{
    if (scene->renderer) return SCN_OK;
    scene->renderer = renderer_new(scene->device, scene->program->cl, scene->package->plan, &scene->failure);
    if (!scene->renderer) return SCN_WORLD_FAILED;
    if (scene->program->builds) launch_once(scene);
    return SCN_OK;
}

// What must be there before a frame. What was made stays where a later part fails.
static ScnStatus prepare(ScnScene *scene)
{
    if (!scene->package) return scene->status;
    ScnStatus status = open_device(scene);
    if (status == SCN_OK) status = build_program(scene);
    if (status == SCN_OK) status = make_renderer(scene);
    return status;
}

static bool take_cancel(ScnScene *scene)
{
    return atomic_exchange(&scene->cancel, false);
}

ScnStatus scn_prepare(ScnScene *scene)
{
    ScnStatus status = prepare(scene);
    if (status == SCN_OK && take_cancel(scene)) return scene_fail(scene, SCN_CANCELLED, "cancelled");
    return status;
}

ScnStatus scn_store_kernels(ScnScene *scene)
{
    ScnStatus status = prepare(scene);
    if (status != SCN_OK || scene->stats.quick) return status;
    return program_store(scene->program, &scene->failure) ? SCN_OK : SCN_WORLD_FAILED;
}

// --- a frame's values

static ScnStatus evaluate(ScnScene *scene, double time, double frame)
{
    FrameError error;
    FrameInput input = {.time = time, .frame = frame, .inputs = scene->inputs};
    if (frame_evaluate(scene->package->plan, &input, scene->values, &error) &&
        scene_patches_to(scene, time, scene->values, &error))
        return SCN_OK;
    return scene_fail_frame(scene, &error, time, frame);
}

// The values of some moments of the animation, so that the camera stands still in it, whichever frames are rendered. A
// moment that cannot be evaluated is left out: its own frame will tell. Returns how many there are.
static int find_moments(ScnScene *scene, double **moments, const PatchCells *const **cells, double time)
{
    const Plan *plan = scene->package->plan;
    bool moves = plan->duration > 0 && (plan->step_count || plan->patch_count);
    int wanted = !moves ? 1 : plan->slot_count < MANY_VALUES ? CAMERA_MOMENTS : 3, count = 0;
    for (int i = 0; i < wanted; i++) {
        if (!moments[count]) moments[count] = malloc(plan->slot_count * sizeof(double));
        if (!moments[count]) break;
        FrameInput input = {.time = moves ? plan->duration * i / (wanted - 1) : time, .inputs = scene->inputs};
        input.frame = floor(input.time * plan->fps + 1e-6);
        FrameError error;
        bool ok = frame_evaluate(plan, &input, moments[count], &error) &&
                  scene_patches_to(scene, input.time, moments[count], &error);
        if (ok && plan->patch_count) cells[count] = scene_patches_copy(scene);
        count += ok;
    }
    return count;
}

static ScnStatus place_camera(ScnScene *scene, const ScnFrameDesc *desc)
{
    const Plan *plan = scene->package->plan;
    double *moments[CAMERA_MOMENTS] = {0};
    const PatchCells *const *cells[CAMERA_MOMENTS] = {0};
    memcpy(scene->camera, scene->values + plan->camera, sizeof scene->camera);
    int count = find_moments(scene, moments, cells, desc->time);
    bool ok = count && framing_camera(plan, moments, cells, count, desc->width, desc->height, scene->camera);
    for (int i = 0; i < CAMERA_MOMENTS; i++) {
        free(moments[i]);
        patches_copy_free(cells[i], plan->patch_count);
    }
    if (ok && plan->patch_count) { // they were taken to other moments
        ScnStatus status = evaluate(scene, desc->time, desc->frame);
        if (status != SCN_OK) return status;
    }
    if (!ok) return scene_fail(scene, SCN_WORLD_FAILED, "there is no memory to find a place for the camera");
    scene->camera_width = desc->width;
    scene->camera_height = desc->height;
    return SCN_OK;
}

static ScnStatus frame_values(ScnScene *scene, const ScnFrameDesc *desc)
{
    const Plan *plan = scene->package->plan;
    ScnStatus status = evaluate(scene, desc->time, desc->frame);
    if (status != SCN_OK || scene->values[plan->camera + 14] == 0) return status;
    if (scene->camera_width != desc->width || scene->camera_height != desc->height) status = place_camera(scene, desc);
    if (status == SCN_OK) memcpy(scene->values + plan->camera, scene->camera, sizeof scene->camera);
    return status;
}

// --- a frame

static unsigned wanted_layers(const ScnFrameDesc *desc)
{
    unsigned layers = desc->layers & SCN_LAYERS;
    if (desc->color) layers |= FILM_COLOR;
    if (desc->depth) layers |= FILM_DEPTH;
    if (desc->normal) layers |= FILM_NORMAL;
    if (desc->position) layers |= FILM_POSITION;
    if (desc->id) layers |= FILM_ID;
    if (desc->certificate) layers |= FILM_CERTIFICATE;
    // The nearest of several samples gives the position.
    if (desc->samples > 1 && layers & FILM_POSITION) layers |= FILM_DEPTH;
    return layers;
}

// Whether the machine can hold a picture, on the device too: asking for more memory than there is may succeed, and
// end the process when it is used.
static bool has_memory(const ScnFrameDesc *desc, unsigned layers)
{
    double there = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGESIZE);
    return 2 * (double)film_bytes(desc->width, desc->height, layers) < there;
}

// The film and the samples for a description; those of the frame before are used again where they fit.
static ScnStatus make_film(ScnScene *scene, const ScnFrameDesc *desc, unsigned layers)
{
    int n = desc->samples > 1 ? desc->samples : 1;
    Film *film = scene->film;
    bool fits = film && film->width == desc->width && film->height == desc->height && film->layers == layers;
    if (!fits || scene->samples_n != n) {
        samples_free(scene->samples);
        scene->samples = NULL;
    }
    if (!fits) {
        film_free(film);
        scene->film = has_memory(desc, layers) ? film_new(desc->width, desc->height, layers) : NULL;
    }
    if (scene->film && n > 1 && !scene->samples) scene->samples = samples_new(desc->width, desc->height, layers, n);
    scene->samples_n = n;
    if (scene->film && (n == 1 || scene->samples)) return SCN_OK;
    return scene_fail(scene, SCN_WORLD_FAILED, "there is no memory for a picture of %dx%d", desc->width, desc->height);
}

// Which of the samples of a frame is rendered, for whoever is told how far it is.
typedef struct Step {
    const ScnFrameDesc *desc;
    int done, count;
} Step;

static void tell_progress(void *data, double share)
{
    const Step *step = data;
    step->desc->progress(step->desc->progress_data, (step->done + share) / step->count);
}

static ScnStatus render_once(ScnScene *scene, Step *step)
{
    RenderStats stats = {0};
    RenderJob job = {.values = scene->values,
                     .cells = scene_patches_cells(scene),
                     .film = scene->film,
                     .cancel = &scene->cancel,
                     .progress = step->desc->progress ? tell_progress : NULL,
                     .progress_data = step};
    RenderResult result = renderer_frame(scene->renderer, &job, &stats, &scene->failure);
    if (result == RENDER_CANCELLED) return SCN_CANCELLED;
    if (result != RENDER_DONE) return SCN_WORLD_FAILED;
    scene->stats.device_bytes = stats.device_bytes;
    scene->stats.uncertain += stats.uncertain;
    scene->stats.rays += (uint64_t)scene->film->width * (uint64_t)scene->film->height + stats.shadow_rays;
    step->done++;
    return SCN_OK;
}

static ScnStatus render_samples(ScnScene *scene, const ScnFrameDesc *desc)
{
    Film *film = scene->film;
    Step step = {.desc = desc, .count = scene->samples_n * scene->samples_n};
    film->cover = NULL;
    film->place_x = film->place_y = 0.5;
    if (step.count == 1) return render_once(scene, &step);
    samples_clear(scene->samples);
    while (step.done < step.count) {
        samples_place(scene->samples, step.done, film);
        ScnStatus status = render_once(scene, &step);
        if (status != SCN_OK) return status;
        if (!samples_add(scene->samples, film, &scene->cancel)) return SCN_CANCELLED;
    }
    return samples_resolve(scene->samples, film, &scene->cancel) ? SCN_OK : SCN_CANCELLED;
}

static void copy_layer(void *to, const void *from, const Film *film, size_t bytes)
{
    if (to) memcpy(to, from, (size_t)film->width * (size_t)film->height * bytes);
}

static void copy_layers(const ScnFrameDesc *desc, const Film *film)
{
    copy_layer(desc->color, film->color, film, 4 * sizeof(float));
    copy_layer(desc->depth, film->depth, film, sizeof(float));
    copy_layer(desc->normal, film->normal, film, 3 * sizeof(float));
    copy_layer(desc->position, film->position, film, 3 * sizeof(float));
    copy_layer(desc->id, film->id, film, sizeof(uint32_t));
    copy_layer(desc->certificate, film->certificate, film, sizeof(float));
}

static ScnStatus check_frame(ScnScene *scene, const ScnFrameDesc *desc, unsigned layers)
{
    if (desc->width < 1 || desc->height < 1 || desc->width > FILM_MAX_SIZE || desc->height > FILM_MAX_SIZE)
        return scene_fail(scene, SCN_CALL_WRONG, "a picture has 1 to %d pixels a side, not %dx%d", FILM_MAX_SIZE,
                          desc->width, desc->height);
    if (!layers) return scene_fail(scene, SCN_CALL_WRONG, "no layer of the picture is wanted");
    if (desc->samples < 0 || desc->samples > SAMPLE_LIMIT)
        return scene_fail(scene, SCN_CALL_WRONG, "samples are 1 to %d, not %d", SAMPLE_LIMIT, desc->samples);
    return SCN_OK;
}

static ScnStatus render_frame(ScnScene *scene, const ScnFrameDesc *desc, unsigned layers)
{
    ScnStatus status = make_film(scene, desc, layers);
    if (status == SCN_OK) status = frame_values(scene, desc);
    if (status == SCN_OK) status = render_samples(scene, desc);
    return status;
}

ScnStatus scn_render(ScnScene *scene, const ScnFrameDesc *desc)
{
    if (!scene->package) return scene->status;
    unsigned layers = wanted_layers(desc);
    ScnStatus status = check_frame(scene, desc, layers);
    if (status == SCN_OK) status = prepare(scene);
    if (status != SCN_OK) return status;
    scene->frame_there = false;
    double start = scene_milliseconds(), cpu = scene_cpu_milliseconds();
    status = render_frame(scene, desc, layers);
    // Asked for at any moment of the frame, even behind its last tile: else it would meet the next one.
    if (take_cancel(scene)) status = SCN_CANCELLED;
    if (status == SCN_CANCELLED) return scene_fail(scene, SCN_CANCELLED, "cancelled");
    if (status != SCN_OK) return status;
    copy_layers(desc, scene->film);
    scene->frame_there = true;
    scene->frame_time = desc->time;
    scene->frame_number = (int)fmax(fmin(desc->frame, 2e9), -2e9);
    scene->stats.frame_ms = scene_milliseconds() - start;
    scene->stats.frame_cpu_ms = scene_cpu_milliseconds() - cpu;
    scene->stats.frames++;
    return SCN_OK;
}

// --- files

static bool ends_with(const char *text, const char *end)
{
    size_t length = strlen(text), tail = strlen(end);
    return length >= tail && !strcasecmp(text + length - tail, end);
}

static bool write_exr(ScnScene *scene, const char *path, const ScnImageDesc *desc)
{
    const Plan *plan = scene->package->plan;
    const char **names = malloc(plan->object_count * sizeof *names);
    if (!names) return fail(&scene->failure, "cannot write %s: out of memory", path);
    for (uint32_t i = 0; i < plan->object_count; i++) names[i] = plan->objects[i].name;
    bool ok = image_write_exr(path,
                              &(ExrDesc){
                                  .film = scene->film,
                                  .layers = desc->layers ? desc->layers : FILM_COLOR,
                                  .pixels = desc->half   ? EXR_PIXELS_HALF
                                            : desc->full ? EXR_PIXELS_FLOAT
                                                         : EXR_PIXELS_AUTO,
                                  .objects = names,
                                  .object_count = plan->object_count,
                                  .scene = scene->package->scene,
                                  .time = scene->frame_time,
                                  .frame = scene->frame_number,
                                  .unfinished = desc->unfinished,
                              },
                              &scene->failure);
    free(names);
    return ok;
}

ScnStatus scn_write_image(ScnScene *scene, const char *path, const ScnImageDesc *desc)
{
    if (!scene->package) return scene->status;
    if (!scene->frame_there) return scene_fail(scene, SCN_CALL_WRONG, "there is no frame to write to %s", path);
    bool exr = ends_with(path, ".exr");
    if (!exr && !ends_with(path, ".png"))
        return scene_fail(scene, SCN_CALL_WRONG, "a picture's name ends in .exr or .png, unlike %s", path);
    if (desc->bits != 0 && desc->bits != 8 && desc->bits != 16)
        return scene_fail(scene, SCN_CALL_WRONG, "a PNG has 8 or 16 bits, not %d", desc->bits);
    unsigned layers = exr && desc->layers ? desc->layers : FILM_COLOR;
    if (layers & ~scene->film->layers)
        return scene_fail(scene, SCN_CALL_WRONG, "the frame has not all layers that %s is to have", path);
    bool ok = exr ? write_exr(scene, path, desc)
                  : image_write_png(path,
                                    &(PngDesc){.film = scene->film,
                                               .bits = desc->bits,
                                               .scene = scene->package->scene,
                                               .software = "scn " SCN_VERSION,
                                               .unfinished = desc->unfinished},
                                    &scene->failure);
    return ok ? SCN_OK : SCN_WORLD_FAILED;
}

// The kernels' binary for the scene's device, as the package's only one. The program is the scene's, or one made for
// this if the scene's is a quick one.
static ScnStatus make_binary(ScnScene *scene, PackageBinary *binary, char key[static DEVICE_KEY_SIZE])
{
    ScnStatus status = open_device(scene);
    if (status != SCN_OK) return status;
    bool own = scene->program && !scene->stats.quick;
    Program *program = own ? scene->program : full_program(scene, false);
    if (!program) return SCN_WORLD_FAILED;
    device_key(scene->device, key);
    binary->key = key;
    binary->bytes = program_binary(program, &binary->size, &scene->failure);
    // The binary is there now, so the cache costs nothing; where it cannot be written, nothing is lost.
    if (binary->bytes) program_store(program, NULL);
    if (!own) {
        scene->stats.build_ms = program->build_ms;
        scene->stats.kernel_builds += program->builds;
        program_free(program);
    }
    return binary->bytes ? SCN_OK : SCN_WORLD_FAILED;
}

ScnStatus scn_write_package(ScnScene *scene, const char *path, bool source_only, ScnUnfinished *unfinished)
{
    if (!scene->package) return scene->status;
    Package package = *scene->package;
    PackageBinary *binaries = arena_array(&scene->unit.arena, PackageBinary, package.binary_count + 1), *own = NULL;
    char key[DEVICE_KEY_SIZE];
    package.binaries = binaries;
    package.binary_count = 0;
    for (uint32_t k = 0; k < scene->package->binary_count; k++) {
        if (slice_package_is(&scene->package->binaries[k]))
            binaries[package.binary_count++] = scene->package->binaries[k];
    }
    if (!source_only) {
        own = &binaries[package.binary_count];
        ScnStatus status = make_binary(scene, own, key);
        if (status != SCN_OK) return status;
        package.binary_count++;
    }
    bool ok = package_write(path, &package, unfinished, &scene->failure);
    if (own) free((void *)(uintptr_t)own->bytes);
    return ok ? SCN_OK : SCN_WORLD_FAILED;
}
