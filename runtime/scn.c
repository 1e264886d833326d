// The part of the public API that needs no device: what the compiler says, what a scene holds, its parameters.
#include "runtime/scn.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "compiler/param.h"
#include "runtime/scene.h"
#include "runtime/scene_patches.h"

_Static_assert((int)SCN_PARAM_COLOR == (int)PARAM_COLOR && (int)SCN_PARAM_STRING == (int)PARAM_STRING,
               "the types of params are the compiler's");
_Static_assert((int)SCN_LAYER_CERTIFICATE == (int)FILM_CERTIFICATE && SCN_LAYERS == FILM_ALL,
               "the layers are the film's");

double scene_milliseconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

double scene_cpu_milliseconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

ScnStatus scene_fail(ScnScene *scene, ScnStatus status, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    // The arguments may be the old text itself.
    char text[sizeof scene->failure.text];
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    memcpy(scene->failure.text, text, sizeof text);
    return status;
}

ScnStatus scene_fail_frame(ScnScene *scene, const FrameError *error, double time, double frame)
{
    if (error->world) return scene_fail(scene, SCN_WORLD_FAILED, "%s", error->text);
    char place[4200];
    const char *text, *code = diag_code_name(frame_error_code(error, &text));
    scene->frame_error = *error;
    scene->frame_wrong = true;
    scene_place(scene, error->span, place, sizeof place);
    return scene_fail(scene, SCN_SCENE_WRONG, "%s%serror: %s (at %gs, frame %g) [%s]", place, *place ? ": " : "", text,
                      time, frame, code);
}

const char *scn_version(void)
{
    return SCN_VERSION;
}

ScnScene *scn_load(const ScnSceneDesc *desc)
{
    return scene_new(desc, &(CompileOptions){0});
}

ScnScene *scene_new(const ScnSceneDesc *desc, const CompileOptions *dumps)
{
    ScnScene *scene = calloc(1, sizeof *scene);
    if (!scene) return NULL;
    scene->compile_options = *dumps;
    double start = scene_milliseconds();
    unit_init(&scene->unit);
    scene_load(scene, desc);
    scene->diagnostics = diag_sorted(&scene->unit, &scene->unit.arena, &scene->diagnostic_count);
    if (scene->package) {
        const Plan *plan = scene->package->plan;
        if (desc->device) scene->device_choice = arena_text(&scene->unit.arena, desc->device, strlen(desc->device));
        scene->threads = desc->threads;
        scene->lanes = desc->lanes;
        scene->no_cache = desc->no_cache;
        scene->quick = desc->quick;
        if (desc->checkpoints)
            scene->checkpoints = arena_text(&scene->unit.arena, desc->checkpoints, strlen(desc->checkpoints));
        if (desc->solver) scene->solver = arena_text(&scene->unit.arena, desc->solver, strlen(desc->solver));
        scene->values = arena_array(&scene->unit.arena, double, plan->slot_count);
    }
    scene->stats.load_ms = scene_milliseconds() - start;
    return scene;
}

void scn_free(ScnScene *scene)
{
    if (!scene) return;
    samples_free(scene->samples);
    film_free(scene->film);
    renderer_free(scene->renderer);
    scene_patches_free(scene);
    program_free(scene->program);
    device_close(scene->device);
    free(scene->diagnostics_text[0]);
    free(scene->diagnostics_text[1]);
    free(scene->printed);
    bytes_close(&scene->file);
    unit_release(&scene->unit);
    free(scene);
}

ScnStatus scn_status(const ScnScene *scene)
{
    return scene->status;
}

const char *scn_error(const ScnScene *scene)
{
    return scene->failure.text;
}

void scn_cancel(ScnScene *scene)
{
    atomic_store(&scene->cancel, true);
}

void scn_stats(const ScnScene *scene, ScnStats *stats)
{
    *stats = scene->stats;
}

// --- diagnostics

int scn_diagnostic_count(const ScnScene *scene)
{
    return scene->diagnostic_count;
}

typedef struct Region {
    const char *path;
    uint32_t line, column, end_line, end_column;
} Region;

static Region region_of(const ScnScene *scene, Span span)
{
    if (!span.end) return (Region){0};
    Place begin = source_place(&scene->unit.sources, span.begin), end = source_place(&scene->unit.sources, span.end);
    return (Region){begin.source ? begin.source->path : NULL, begin.line, begin.column, end.line, end.column};
}

static void set_place(ScnDiagnostic *diagnostic, const Region *at)
{
    diagnostic->path = at->path;
    diagnostic->line = at->line;
    diagnostic->column = at->column;
    diagnostic->end_line = at->end_line;
    diagnostic->end_column = at->end_column;
}

bool scn_diagnostic(const ScnScene *scene, int index, ScnDiagnostic *diagnostic)
{
    static const char *const severities[] = {
        [SEVERITY_NOTE] = "note", [SEVERITY_WARNING] = "warning", [SEVERITY_ERROR] = "error"};
    if (index < 0 || index >= scene->diagnostic_count) return false;
    const Diag *d = scene->diagnostics[index];
    *diagnostic =
        (ScnDiagnostic){.severity = severities[d->severity], .code = diag_code_name(d->code), .text = d->text};
    Region at = region_of(scene, d->span);
    set_place(diagnostic, &at);
    return true;
}

bool scn_frame_diagnostic(const ScnScene *scene, ScnDiagnostic *diagnostic)
{
    if (!scene->frame_wrong) return false;
    Span span = scene->frame_error.span;
    *diagnostic = (ScnDiagnostic){.severity = "error"};
    diagnostic->code = diag_code_name(frame_error_code(&scene->frame_error, &diagnostic->text));
    Region at = scene->is_package ? (Region){0} : region_of(scene, span);
    const PackagePlace *place = at.path ? NULL : package_place(scene->package, span);
    if (place) at = (Region){place->path, place->line, place->column, place->line, place->column + 1};
    set_place(diagnostic, &at);
    return true;
}

static bool give_note(const ScnScene *scene, const char *text, Span span, ScnDiagnosticNote *found)
{
    Region at = region_of(scene, span);
    *found = (ScnDiagnosticNote){text, at.path, at.line, at.column, at.end_line, at.end_column};
    return true;
}

bool scn_diagnostic_note(const ScnScene *scene, int index, int note, ScnDiagnosticNote *found)
{
    if (index < 0 || index >= scene->diagnostic_count || note < 0) return false;
    const Diag *d = scene->diagnostics[index];
    for (const DiagLabel *label = d->labels; label; label = label->next) {
        if (note-- == 0) return give_note(scene, label->text, label->span, found);
    }
    const Source *source = d->span.end ? source_of(&scene->unit.sources, d->span.begin) : NULL;
    for (int depth = 0; source && source->included_at.end && depth < DIAG_INCLUDES_SHOWN; depth++) {
        if (note-- == 0)
            return give_note(scene, source->library ? "used from here" : "included from here", source->included_at,
                             found);
        source = source_of(&scene->unit.sources, source->included_at.begin);
    }
    return false;
}

bool scn_diagnostic_fix(const ScnScene *scene, int index, int fix, ScnFix *found)
{
    static const ScnConfidence confidences[] = {
        [FIX_SURE] = SCN_FIX_SURE, [FIX_LIKELY] = SCN_FIX_LIKELY, [FIX_GUESS] = SCN_FIX_GUESS};
    if (index < 0 || index >= scene->diagnostic_count || fix < 0) return false;
    for (const DiagFix *f = scene->diagnostics[index]->fixes; f; f = f->next) {
        if (fix-- > 0) continue;
        Region at = region_of(scene, f->span);
        *found = (ScnFix){confidences[f->kind], f->text, at.path, at.line, at.column, at.end_line, at.end_column};
        return true;
    }
    return false;
}

const char *scn_diagnostics_text(ScnScene *scene, bool color)
{
    char **text = &scene->diagnostics_text[color];
    if (*text) return *text;
    size_t size;
    FILE *out = open_memstream(text, &size);
    if (!out) return "";
    diag_print(&scene->unit, out, color);
    fclose(out);
    return *text ? *text : "";
}

const char *scn_printed(const ScnScene *scene)
{
    return scene->printed ? scene->printed : "";
}

// --- what a scene holds

bool scn_info(const ScnScene *scene, ScnInfo *info)
{
    const Package *package = scene->package;
    if (!package) return false;
    const Plan *plan = package->plan;
    uint32_t kinds[LEAF_GROUP + 1] = {0};
    for (uint32_t i = 0; i < plan->leaf_count; i++) kinds[plan->leaves[i].kind]++;
    *info = (ScnInfo){
        .scene = package->scene,
        .version = package->version,
        .package = scene->is_package,
        .objects = plan->object_count - 1,
        .shapes = plan->shape_count,
        .leaves = plan->leaf_count - kinds[LEAF_GROUP],
        .quadrics = kinds[LEAF_QUADRIC],
        .freeforms = kinds[LEAF_FREEFORM],
        .perturbations = plan->perturbation_count,
        .groups = plan->group_count,
        .materials = plan->material_count,
        .lights = plan->light_count,
        .params = plan->param_count,
        .frame_values = plan->step_count,
        .automatic_camera = plan->image[plan->camera + 14] != 0,
        .orthographic = plan->orthographic,
        .duration = plan->duration,
        .fps = plan->fps,
        .frames = 1,
        .kernel_bytes = package->kernel_length,
        .value_bytes = plan->slot_count * sizeof(double),
        .file_bytes = scene->file.size,
        .binaries = (int)package->binary_count,
    };
    // A duration of whole frames has that many: the one at its end belongs to what follows.
    if (plan->duration > 0 && plan->fps > 0) info->frames = (int)fmin(fmax(1, round(plan->duration * plan->fps)), 1e8);
    for (int i = 0; i < 16; i++) sprintf(info->structure + 2 * i, "%02x", package->structure[i]);
    return true;
}

int scn_object_count(const ScnScene *scene)
{
    return scene->package ? (int)scene->package->plan->object_count : 0;
}

const char *scn_object_name(const ScnScene *scene, int index)
{
    if (index < 0 || index >= scn_object_count(scene)) return NULL;
    return scene->package->plan->objects[index].name;
}

bool scn_binary_device(const ScnScene *scene, int index, const char **device, size_t *size)
{
    if (!scene->package || index < 0 || (uint32_t)index >= scene->package->binary_count) return false;
    *device = scene->package->binaries[index].key;
    *size = scene->package->binaries[index].size;
    return true;
}

// --- parameters

const char *scn_source(const ScnScene *scene, int index)
{
    for (uint32_t k = 0; k < scene->unit.sources.count; k++) {
        const Source *source = scene->unit.sources.list[k];
        if (!source->prelude && index-- == 0) return source->path;
    }
    return NULL;
}

int scn_param_count(const ScnScene *scene)
{
    return scene->package ? (int)scene->package->plan->param_count : 0;
}

bool scn_param(const ScnScene *scene, int index, ScnParam *result)
{
    if (index < 0 || index >= scn_param_count(scene)) return false;
    const IrParam *param = &scene->package->plan->params[index];
    *result = (ScnParam){
        .name = param->name,
        .doc = param->doc,
        .type = (ScnParamType)param->type,
        .structure = param->structure,
        .count = param_size(param->type),
        .text = param->text,
        .choices = param->choices,
        .ranged = param->ranged,
        .low = param->low,
        .high = param->high,
    };
    for (int c = 0; c < result->count; c++) {
        result->initial[c] = param->value[c];
        result->value[c] = param->structure ? param->value[c] : scene->inputs[param->slot + (uint32_t)c];
    }
    return true;
}

static const IrParam *find_param(ScnScene *scene, const char *name)
{
    const Plan *plan = scene->package->plan;
    for (uint32_t i = 0; i < plan->param_count; i++)
        if (!strcmp(plan->params[i].name, name)) return &plan->params[i];
    const char **names = malloc((plan->param_count + 1) * sizeof *names);
    for (uint32_t i = 0; names && i < plan->param_count; i++) names[i] = plan->params[i].name;
    const char *nearest = names ? nearest_name(name, names, (int)plan->param_count) : NULL;
    free(names);
    if (nearest)
        scene_fail(scene, SCN_CALL_WRONG, "the scene has no param %s: do you mean %s?", name, nearest);
    else if (!plan->param_count)
        scene_fail(scene, SCN_CALL_WRONG, "the scene has no param %s: it has none at all", name);
    else
        scene_fail(scene, SCN_CALL_WRONG, "the scene has no param %s: `scn info` lists them", name);
    return NULL;
}

static ScnStatus set_values(ScnScene *scene, const IrParam *param, const double *values)
{
    memcpy(scene->inputs + param->slot, values, (size_t)param_size(param->type) * sizeof *values);
    scene->camera_width = scene->camera_height = 0;
    return SCN_OK;
}

// The param of that name, if it can be set now.
static const IrParam *find_handle(ScnScene *scene, const char *name)
{
    const IrParam *param = find_param(scene, name);
    if (!param || !param->structure) return param;
    scene_fail(scene, SCN_CALL_WRONG, "param %s shapes the scene: it is set when the scene is loaded%s", name,
               scene->is_package ? ", and a package is compiled with it" : "");
    return NULL;
}

ScnStatus scn_set(ScnScene *scene, const char *name, const double *values, int count)
{
    if (!scene->package) return scene->status;
    const IrParam *param = find_handle(scene, name);
    if (!param) return SCN_CALL_WRONG;
    int wanted = param_size(param->type);
    if (count != wanted)
        return scene_fail(scene, SCN_CALL_WRONG, "param %s has %d numbers, not %d", name, wanted, count);
    ParamValue value = {0};
    for (int c = 0; c < count; c++) {
        if (!isfinite(values[c])) return scene_fail(scene, SCN_CALL_WRONG, "param %s wants finite numbers", name);
        value.number[c] = values[c];
    }
    Arena scratch = {0};
    const char *wrong = param_test(&scratch, param, &value);
    ScnStatus status =
        wrong ? scene_fail(scene, SCN_CALL_WRONG, "param %s: %s", name, wrong) : set_values(scene, param, values);
    arena_release(&scratch);
    return status;
}

ScnStatus scn_set_text(ScnScene *scene, const char *name, const char *text)
{
    if (!scene->package) return scene->status;
    const IrParam *param = find_handle(scene, name);
    if (!param) return SCN_CALL_WRONG;
    Arena scratch = {0};
    ParamValue value;
    const char *wrong = param_parse(&scratch, param, text, &value);
    ScnStatus status =
        wrong ? scene_fail(scene, SCN_CALL_WRONG, "param %s: %s", name, wrong) : set_values(scene, param, value.number);
    arena_release(&scratch);
    return status;
}

// --- devices

int scn_devices(ScnDevice *devices, int capacity)
{
    DeviceInfo infos[64];
    int limit = capacity < 64 ? capacity : 64;
    int count = device_list(infos, limit, NULL);
    for (int i = 0; i < count && i < limit; i++) {
        ScnDevice *device = &devices[i];
        *device = (ScnDevice){.cpu = infos[i].is_cpu,
                              .fp64 = infos[i].has_fp64,
                              .compute_units = infos[i].compute_units,
                              .memory = infos[i].memory,
                              .max_buffer = infos[i].max_buffer};
        memcpy(device->name, infos[i].name, sizeof device->name);
        memcpy(device->platform, infos[i].platform, sizeof device->platform);
        memcpy(device->version, infos[i].version, sizeof device->version);
        memcpy(device->driver, infos[i].driver, sizeof device->driver);
    }
    return count;
}
