// The pictures of a reference: every example rendered by the same library as every other scene, with the camera and the lights that it
// lacks chosen for it.
#include <stdlib.h>
#include <string.h>

#include <png.h>

#include "compiler/bounds.h"
#include "compiler/frame.h"
#include "runtime/command.h"
#include "runtime/doc.h"
#include "runtime/image_png.h"
#include "runtime/report.h"
#include "runtime/scene.h"

enum { SAMPLES = 3 };

typedef struct Job {
    const Doc *doc;
    const DocPictures *pictures;
    const DocEntry *entry;
    int number; // of the example among those of its word, from 1
    float *pixels;
    uint8_t *bytes;
} Job;

// What stands before an example comes behind the line of its version, which is first in every file.
static const char *example_text(Arena *arena, const DocExample *example, const char *shown)
{
    size_t version = strncmp(shown, "scn ", 4) ? 0 : strcspn(shown, "\n");
    return arena_printf(arena, "%.*s%s%s%s", (int)version, shown, version && *example->before ? "\n" : "",
                        example->before, shown + version);
}

static ScnScene *load(const Job *job, const DocExample *example, const char *shown)
{
    Arena *arena = &job->doc->unit->arena;
    const char *text = example_text(arena, example, shown);
    return scn_load(&(ScnSceneDesc){
        .path = arena_printf(arena, "%s-%s-%d.scn", job->doc->path, job->entry->name, job->number),
        .bytes = text,
        .size = strlen(text),
        .include_paths = job->pictures->includes,
        .include_path_count = job->pictures->include_count,
        .device = job->pictures->device,
        .quick = true,
    });
}

static bool has_end(const ScnScene *scene)
{
    const Plan *plan = scene->package->plan;
    Arena scratch = {0};
    double *values = arena_array(&scratch, double, plan->slot_count);
    FrameError error;
    bool finite = false;
    if (frame_evaluate(plan, &(FrameInput){.inputs = scene->inputs}, values, &error)) {
        Bounds bounds = bounds_of_plan(plan, values);
        finite = bounds_finite(&bounds);
    }
    arena_release(&scratch);
    return finite;
}

// The scene of an example; one without end is cut where the example is a default.
static ScnScene *load_example(const Job *job, DocExample *example)
{
    ScnScene *scene = load(job, example, example->shown);
    if (!scene || !example->clipped || scn_status(scene) != SCN_OK || has_end(scene)) return scene;
    scn_free(scene);
    example->shown = example->clipped;
    return load(job, example, example->shown);
}

static bool encode(const Job *job, DocExample *example)
{
    uint32_t width = (uint32_t)job->pictures->width, height = (uint32_t)job->pictures->height;
    for (size_t i = 0; i < (size_t)width * height; i++) {
        for (size_t k = 0; k < 3; k++)
            job->bytes[3 * i + k] = (uint8_t)(255 * srgb_encode(job->pixels[4 * i + k]) + 0.5);
    }
    png_image image = {.version = PNG_IMAGE_VERSION, .width = width, .height = height, .format = PNG_FORMAT_RGB};
    png_alloc_size_t size = 0;
    if (!png_image_write_to_memory(&image, NULL, &size, 0, job->bytes, 0, NULL)) return false;
    example->png = malloc(size);
    if (!example->png || !png_image_write_to_memory(&image, example->png, &size, 0, job->bytes, 0, NULL)) return false;
    example->png_size = size;
    return true;
}

static int render(const Job *job, DocExample *example)
{
    ScnScene *scene = load_example(job, example);
    if (!scene) abort(); // as in arena_alloc()
    ScnStatus status = scn_status(scene);
    if (status == SCN_OK) {
        status = scn_render(scene, &(ScnFrameDesc){
                                       .width = job->pictures->width,
                                       .height = job->pictures->height,
                                       .samples = SAMPLES,
                                       .color = job->pixels,
                                   });
        if (status == SCN_OK && !encode(job, example)) status = SCN_WORLD_FAILED;
    }
    int result = EXIT_DONE;
    bool tried = example->made_up && status == SCN_SCENE_WRONG; // not every word can do with what was made up
    if (status != SCN_OK && !tried) {
        report_scene(scene);
        if (status == SCN_SCENE_WRONG) command_error("the example of %s is wrong", job->entry->name);
        result = command_result(scene, status);
    }
    scn_free(scene);
    return result;
}

int doc_pictures(Doc *doc, const DocPictures *pictures)
{
    size_t count = (size_t)pictures->width * (size_t)pictures->height;
    Job job = {
        .doc = doc, .pictures = pictures, .pixels = malloc(count * 4 * sizeof(float)), .bytes = malloc(count * 3)};
    if (!job.pixels || !job.bytes) abort(); // as in arena_alloc()
    int worst = EXIT_DONE;
    for (DocGroup *group = doc->groups; group; group = group->next) {
        for (DocEntry *entry = group->entries; entry; entry = entry->next) {
            job.entry = entry;
            job.number = 0;
            for (DocForm *form = entry->forms; form; form = form->next) {
                for (DocExample *example = form->examples; example && worst != EXIT_WORLD; example = example->next) {
                    job.number++;
                    int status = render(&job, example);
                    if (status > worst) worst = status;
                }
            }
        }
    }
    free(job.pixels);
    free(job.bytes);
    return worst;
}

void doc_release(Doc *doc)
{
    for (DocGroup *group = doc->groups; group; group = group->next) {
        for (DocEntry *entry = group->entries; entry; entry = entry->next) {
            for (DocForm *form = entry->forms; form; form = form->next) {
                for (DocExample *example = form->examples; example; example = example->next) free(example->png);
            }
        }
    }
}
