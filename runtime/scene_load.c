// From a file or bytes to a scene that can be rendered: a package is read, a source text compiled.
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "compiler/compile.h"
#include "runtime/patch_check.h"
#include "runtime/patch_scene.h"
#include "runtime/scene.h"

const char *scene_place(const ScnScene *scene, Span span, char *text, size_t size)
{
    const PackagePlace *place = package_place(scene->package, span);
    text[0] = 0;
    if (place) snprintf(text, size, "%s:%u:%u", place->path, place->line, place->column);
    return text;
}

static double *first_inputs(Arena *arena, const Plan *plan)
{
    double *inputs = arena_array(arena, double, plan->input_count);
    for (uint32_t i = 0; i < plan->param_count; i++) {
        const IrParam *param = &plan->params[i];
        if (!param->structure)
            memcpy(inputs + param->slot, param->value, (size_t)param_size(param->type) * sizeof(double));
    }
    return inputs;
}

// --- packages

static ScnStatus load_package(ScnScene *scene, const ScnSceneDesc *desc)
{
    scene->is_package = true;
    scene->package = package_decode(&scene->unit.arena, scene->file.bytes, scene->file.size, &scene->failure);
    if (!scene->package) {
        fail_prefix(&scene->failure, "cannot use %s", desc->path ? desc->path : "the package");
        return SCN_WORLD_FAILED;
    }
    scene->inputs = first_inputs(&scene->unit.arena, scene->package->plan);
    if (desc->only)
        return scene_fail(scene, SCN_CALL_WRONG, "what a package shows is chosen when it is built: scn build --only %s",
                          desc->only);
    if (desc->camera)
        return scene_fail(scene, SCN_CALL_WRONG,
                          "the camera of a package is chosen when it is built: scn build --camera %s", desc->camera);
    for (int i = 0; i < desc->setting_count; i++) {
        ScnStatus status = scn_set_text(scene, desc->settings[i].name, desc->settings[i].value);
        if (status != SCN_OK) return status;
    }
    return SCN_OK;
}

// --- scenes

// The text of the scene in the arena, or NULL with the failure set.
static const char *read_text(ScnScene *scene, const ScnSceneDesc *desc, size_t *length)
{
    Arena *arena = &scene->unit.arena;
    if (desc->bytes) {
        *length = desc->size;
        return arena_text(arena, desc->bytes, desc->size);
    }
    char *text = source_read(arena, desc->path, length);
    if (!text) fail(&scene->failure, "cannot read %s: %s", desc->path, strerror(errno));
    return text;
}

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static bool set_options(ScnScene *scene, const ScnSceneDesc *desc)
{
    Unit *unit = &scene->unit;
    unit->include_paths = desc->include_paths;
    unit->include_path_count = desc->include_path_count;
    unit->search_path = desc->search_path ? desc->search_path : getenv("SCN_PATH");
    unit->diagnostics.warnings_are_errors = desc->strict;
    for (int i = 0; i < desc->warning_count; i++) {
        const char *wrong = diag_set_warning(&unit->arena, &unit->diagnostics, desc->warnings[i]);
        if (!wrong) continue;
        scene_fail(scene, SCN_CALL_WRONG, "%s", wrong);
        return false;
    }
    return true;
}

// What `print` in the scene writes is collected, since the library prints nothing itself.
static Compiled *run_compiler(ScnScene *scene, const ScnSceneDesc *desc, const Source *source)
{
    Arena *arena = &scene->unit.arena;
    Define *defines = arena_array(arena, Define, desc->setting_count);
    for (int i = 0; i < desc->setting_count; i++)
        defines[i] = (Define){desc->settings[i].name, desc->settings[i].value};
    CompileOptions options = scene->compile_options;
    options.defines = defines;
    options.define_count = desc->setting_count;
    options.camera = desc->camera;
    options.only = desc->only;
    options.kernel = !desc->check_only;
    options.patches = options.patches || desc->check_only; // so that the mistakes of all are found
    options.unused = desc->check_only;
    size_t size;
    options.print = open_memstream(&scene->printed, &size);
    Compiled *compiled = compile(&scene->unit, source, &options);
    if (options.print) fclose(options.print);
    return compiled;
}

static bool check_patches(ScnScene *scene, const Plan *plan)
{
    if (plan->patch_count) patch_check(&scene->unit, plan, first_inputs(&scene->unit.arena, plan));
    return !scene->unit.errors;
}

static ScnStatus load_source(ScnScene *scene, const ScnSceneDesc *desc)
{
    const char *path = !desc->path ? "scene" : strcmp(desc->path, "-") ? desc->path : "<stdin>";
    size_t length;
    const char *text = read_text(scene, desc, &length);
    if (!text) return SCN_WORLD_FAILED;
    if (package_is((const uint8_t *)text, length))
        return scene_fail(scene, SCN_WORLD_FAILED, "%s is a package: packages are read from files, not from pipes",
                          path);
    if (!set_options(scene, desc)) return SCN_CALL_WRONG;
    Source *source = source_add(&scene->unit.sources, path, text, length, (Span){0});
    if (!source) return scene_fail(scene, SCN_WORLD_FAILED, "cannot read %s: it is too large", path);
    Compiled *compiled = run_compiler(scene, desc, source);
    if (compiled->wrong) return scene_fail(scene, SCN_CALL_WRONG, "%s", compiled->wrong);
    if (!compiled->plan || scene->unit.errors) return SCN_SCENE_WRONG;
    if (!check_patches(scene, compiled->plan)) return SCN_SCENE_WRONG;
    scene->package = arena_new(&scene->unit.arena, Package);
    *scene->package = (Package){
        .version = SCN_VERSION,
        .scene = base_name(path),
        .plan = compiled->plan,
        .kernel = compiled->kernel ? compiled->kernel : "",
        .kernel_length = compiled->kernel_length,
    };
    package_map_places(scene->package, &scene->unit.arena, &scene->unit.sources);
    package_hash_structure(scene->package);
    scene->inputs = first_inputs(&scene->unit.arena, scene->package->plan);
    return SCN_OK;
}

// --- either

static bool named_as_package(const char *path)
{
    size_t length = strlen(path);
    return length > 5 && !strcasecmp(path + length - 5, ".scnk");
}

// Reads the first bytes of what may be a package; all of it where it is one. What is called a package and is none is no
// text either: package_decode() says so, instead of a parser that wonders at its bytes.
static bool open_package(ScnScene *scene, const ScnSceneDesc *desc)
{
    if (desc->bytes) {
        if (!package_is(desc->bytes, desc->size)) return false;
        scene->file = (FileBytes){malloc(desc->size), desc->size};
        if (!scene->file.bytes) abort(); // as in arena_alloc()
        memcpy(scene->file.bytes, desc->bytes, desc->size);
        return true;
    }
    if (!strcmp(desc->path, "-") || (!package_file(desc->path) && !named_as_package(desc->path))) return false;
    return bytes_open(&scene->file, desc->path, NULL);
}

// What would be found out only in a frame, or never.
static ScnStatus check_description(ScnScene *scene, const ScnSceneDesc *desc)
{
    PatchMethod method;
    if (!desc->path && !desc->bytes) return scene_fail(scene, SCN_CALL_WRONG, "there is no scene to load");
    if (desc->lanes != 0 && desc->lanes != 1 && desc->lanes != 16)
        return scene_fail(scene, SCN_CALL_WRONG, "lanes are 1 or 16, or 0 for the device's own, not %d", desc->lanes);
    if (desc->threads < 0)
        return scene_fail(scene, SCN_CALL_WRONG, "threads are 1 or more, or 0 for all, not %d", desc->threads);
    if (desc->solver && !patch_method_named(desc->solver, &method))
        return scene_fail(scene, SCN_CALL_WRONG, "patches are solved by device, direct or gauss-seidel, not by \"%s\"",
                          desc->solver);
    return SCN_OK;
}

void scene_load(ScnScene *scene, const ScnSceneDesc *desc)
{
    scene->status = check_description(scene, desc);
    if (scene->status != SCN_OK) return;
    if (open_package(scene, desc))
        scene->status = load_package(scene, desc);
    else
        scene->status = load_source(scene, desc);
    if (scene->status != SCN_OK) scene->package = NULL;
}
