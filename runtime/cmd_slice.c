// scn slice: what a plane cuts out of a scene (compiler/section.h, runtime/slice.h), as a picture and as counts.
//
// Inside has the colour of its material, as it is painted and without light, or is dark where nobody painted it; outside is white.
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "compiler/bounds.h"
#include "compiler/frame.h"
#include "compiler/section.h"
#include "lang/source.h"
#include "runtime/command.h"
#include "runtime/image_png.h"
#include "runtime/import_vm.h"
#include "runtime/scene.h"
#include "runtime/slice_package.h"

enum { DEFAULT_SIZE = 1024 };

typedef struct Slicing {
    const Options *options;
    bool is_model; // FILE.vm
    ScnScene *scene;
    const Plan *plan;
    double *values;
    SectionPlane plane;
    SliceView view;
    Arena arena;
    Formula *formula;
    uint32_t condition;
    FormulaSteps steps;
    bool of_package; // drawn by code that the package holds
    const uint16_t *bits;
    uint32_t stride;
    uint64_t inside;
    double draw_ms;
    int builds;
    char device[256];
    uint8_t (*colors)[3]; // of the plan's materials
    bool one_material;
} Slicing;

// --- the command line

static const char axis_names[3] = {'x', 'y', 'z'};

static bool read_number(const char *text, double *value)
{
    char *end;
    *value = strtod(text, &end);
    return end != text && !*end && fabs(*value) <= FORMULA_REACH;
}

// `option`: which one the text is of.
static bool read_plane(Slicing *s, const char *option, const char *text)
{
    s->plane = (SectionPlane){.axis = -1};
    for (int k = 0; k < 3; k++) {
        if ((text[0] | 0x20) == axis_names[k] && text[1] == '=') s->plane.axis = k;
    }
    if (s->plane.axis >= 0 && read_number(text + 2, &s->plane.at)) return true;
    command_error("--%s wants an axis and where on it, at most %g from the origin, as z=0.5, not \"%s\"", option,
                  (double)FORMULA_REACH, text);
    return false;
}

// "-1..2.5"
static bool read_range(const char *text, size_t length, double range[2])
{
    char copy[128];
    if (length >= sizeof copy) return false;
    memcpy(copy, text, length);
    copy[length] = 0;
    char *dots = strstr(copy, "..");
    if (!dots) return false;
    *dots = 0;
    return read_number(copy, &range[0]) && read_number(dots + 2, &range[1]) && range[0] < range[1];
}

static bool read_window(Slicing *s, double window[4])
{
    const char *text = s->options->window, *comma = strchr(text, ',');
    if (comma && read_range(text, (size_t)(comma - text), window) &&
        read_range(comma + 1, strlen(comma + 1), window + 2))
        return true;
    command_error(
        "--window wants what is across and up, each from less to more and within %g, as -1..1,0..2.5, not \"%s\"",
        (double)FORMULA_REACH, text);
    return false;
}

// The bounds of those parts of the scene that have an end across and up, and a twentieth around them.
static void find_window(const Slicing *s, double window[4])
{
    static const double unit[4] = {-1, 1, -1, 1};
    const PlanGroup *scene = &s->plan->groups[0];
    int axes[2];
    bool found = false;
    section_axes(&s->plane, axes);
    for (uint32_t k = 0; k < scene->component_count && !s->is_model; k++) {
        Bounds b = bounds_of_component(s->plan, s->values, scene->component_begin + k);
        bool near = !bounds_empty(&b);
        for (int axis = 0; axis < 2; axis++) {
            double low = b.low[axes[axis]], high = b.high[axes[axis]];
            near &= low < high && fabs(low) < FORMULA_REACH / 2 && fabs(high) < FORMULA_REACH / 2;
        }
        for (int axis = 0; axis < 2 && near; axis++) {
            double low = b.low[axes[axis]], high = b.high[axes[axis]];
            window[2 * axis] = found ? fmin(window[2 * axis], low) : low;
            window[2 * axis + 1] = found ? fmax(window[2 * axis + 1], high) : high;
        }
        found |= near;
    }
    if (!found) memcpy(window, unit, sizeof unit);
    for (int axis = 0; axis < 2 && found; axis++) {
        double margin = 0.05 * (window[2 * axis + 1] - window[2 * axis]);
        window[2 * axis] -= margin;
        window[2 * axis + 1] += margin;
    }
}

// A window that was not asked for grows to the shape of the picture, so that pixels are squares.
static void fit_window(double window[4], double width, double height)
{
    double across = window[1] - window[0], up = window[3] - window[2];
    double wanted = fmax(across, up * width / height);
    for (int k = 0; k < 2; k++) {
        double more = (k ? wanted * height / width - up : wanted - across) / 2;
        window[2 * k] -= more;
        window[2 * k + 1] += more;
    }
}

static bool set_view(Slicing *s)
{
    const Options *o = s->options;
    double window[4], width = o->width, height = o->height;
    if (o->window && !read_window(s, window)) return false;
    if (!o->window) find_window(s, window);
    if (!o->height) {
        double longer = o->width ? o->width : DEFAULT_SIZE, across = window[1] - window[0], up = window[3] - window[2];
        width = across >= up ? longer : fmax(1, rint(longer * across / up));
        height = up >= across ? longer : fmax(1, rint(longer * up / across));
    }
    if (!o->window) fit_window(window, width, height);
    s->view = (SliceView){(uint32_t)width, (uint32_t)height, window[0], window[1], window[2], window[3]};
    for (int k = 0; k < 4; k++) {
        if (fabs(window[k]) <= FORMULA_REACH) continue;
        command_error("the picture would show more than %g from the origin: give a --window", (double)FORMULA_REACH);
        return false;
    }
    return true;
}

// --- the scene

bool command_is_model(const char *path)
{
    size_t length = strlen(path);
    return length > 3 && !strcasecmp(path + length - 3, ".vm");
}

// A model becomes a scene in memory, as `scn import` writes it.
ScnScene *command_load_model(const Options *options, int *status)
{
    const char *path = options->files[0], *scene = NULL;
    size_t length, size;
    Arena arena = {0};
    Failure failure;
    const char *text = source_read(&arena, path, &length);
    *status = text ? EXIT_SCENE : EXIT_WORLD;
    if (text) scene = import_vm(&arena, text, length, &size, &failure);
    ScnScene *loaded = NULL;
    if (!text) {
        command_error("cannot read %s: %s", path, strerror(errno));
    } else if (!scene) {
        command_error("%s: %s", path, failure.text);
    } else {
        CommandScene parts;
        command_describe(options, &parts);
        parts.desc.bytes = scene;
        parts.desc.size = size;
        loaded = scn_load(&parts.desc);
        *status = command_loaded(loaded);
    }
    arena_release(&arena);
    return *status == EXIT_DONE ? loaded : NULL;
}

static int evaluate(Slicing *s)
{
    double time, frame;
    FrameError error;
    if (!command_time(s->options, s->scene, &time, &frame)) return EXIT_USAGE;
    s->plan = s->scene->package->plan;
    s->values = arena_array(&s->arena, double, s->plan->slot_count);
    if (frame_evaluate(s->plan, &(FrameInput){time, frame, s->scene->inputs}, s->values, &error)) return EXIT_DONE;
    return command_result(s->scene, scene_fail_frame(s->scene, &error, time, frame));
}

// "scene.scn:3:1: the patch skin cannot be sliced: …"
static void refuse_leaf(const Slicing *s, const SectionTrouble *trouble)
{
    const PlanLeaf *leaf = &s->plan->leaves[trouble->leaf];
    const PlanObject *object = &s->plan->objects[leaf->object];
    const PlanPatch *patch =
        leaf->kind == LEAF_SHEET || leaf->kind == LEAF_THICK ? &s->plan->patches[leaf->begin] : NULL;
    const char *name = *object->name || !patch ? object->name : patch->name;
    char place[4200];
    scene_place(s->scene, *object->name || !patch ? object->span : patch->span, place, sizeof place);
    command_error("%s%s%s%s cannot be sliced: %s", place, *place ? ": " : "", *name ? "the object " : "",
                  *name ? name : "an object without a name", trouble->reason);
}

static int make_formula(Slicing *s)
{
    SectionTrouble trouble;
    s->formula = formula_new(&s->arena, true);
    if (!section_formula(s->formula, s->plan, s->values, &s->plane, &s->condition, &trouble)) {
        refuse_leaf(s, &trouble);
        return EXIT_SCENE;
    }
    if (formula_steps(s->formula, s->condition, &s->arena, &s->steps)) return EXIT_DONE;
    command_error("%s takes more than %u steps in this plane: slice parts of it", s->options->files[0],
                  SLICE_STEPS_MAX);
    return EXIT_SCENE;
}

// --- code for packages

int command_slice_code(const Options *options, ScnScene *scene)
{
    Slicing s = {.options = options, .scene = scene};
    FormulaCode code;
    Failure failure;
    if (!read_plane(&s, "slice", options->slice)) return EXIT_USAGE;
    int status = evaluate(&s);
    if (status == EXIT_DONE) status = make_formula(&s);
    if (status == EXIT_DONE && !formula_emit(s.formula, s.condition, &s.arena, &code)) {
        command_error("--slice %s: there is no code for %s: leave --slice out, `scn slice` needs none", options->slice,
                      s.steps.known
                          ? "what is nothing, or everything"
                          : "what may be undefined, needs functions as sin, or has a part of more than 1000 steps");
        status = EXIT_SCENE;
    }
    Device *device = NULL;
    if (status == EXIT_DONE) {
        device = device_open(&(DeviceDesc){.choice = options->device}, &failure);
        bool ok = device && slice_package_add(scene->package, &scene->unit.arena, device, &s.steps, &code,
                                              options->no_cache, &failure);
        if (!ok) {
            command_error("%s", failure.text);
            status = EXIT_WORLD;
        }
    }
    device_close(device);
    arena_release(&s.arena);
    return status;
}

// --- the picture

// By the code that a package holds for just this formula, else by the formula's program. The picture is the same.
static Slicer *make_slicer(Slicing *s, Device *device, Failure *failure)
{
    FormulaCode code;
    Slicer *slicer = NULL;
    if (s->scene->is_package && formula_emit(s->formula, s->condition, &s->arena, &code))
        slicer = slice_package_slicer(s->scene->package, device, &s->steps, &code);
    s->of_package = slicer != NULL;
    if (slicer) return slicer;
    slicer = slicer_new(device, &(SlicerDesc){.no_cache = s->options->no_cache}, failure);
    if (slicer && slicer_program(slicer, &s->steps, failure)) return slicer;
    slicer_free(slicer);
    return NULL;
}

static bool draw(Slicing *s, Device **device, Slicer **slicer, Failure *failure)
{
    const Options *o = s->options;
    *device = device_open(&(DeviceDesc){.choice = o->device, .threads = o->threads}, failure);
    if (!*device) return false;
    snprintf(s->device, sizeof s->device, "%s", (*device)->info.name);
    *slicer = make_slicer(s, *device, failure);
    if (!*slicer) return false;
    s->builds = slicer_built(*slicer)->builds;
    double begin = scene_milliseconds();
    if (!slicer_draw(*slicer, &s->view, SLICE_TILES, failure)) return false;
    s->draw_ms = scene_milliseconds() - begin;
    s->bits = slicer_bits(*slicer, failure);
    if (!s->bits) return false;
    s->stride = slicer_stride(*slicer);
    s->inside = slicer_count(*slicer, s->bits);
    return true;
}

// Colours of materials, and whether all leaves have the same one.
static void find_colors(Slicing *s)
{
    static const double unpainted[3] = {0.05, 0.05, 0.05};
    const Plan *plan = s->plan;
    s->colors = arena_alloc_array(&s->arena, sizeof *s->colors, plan->material_count);
    for (uint32_t k = 0; k < plan->material_count; k++) {
        const double *color = k ? s->values + plan->materials[k].values : unpainted;
        for (int c = 0; c < 3; c++) s->colors[k][c] = (uint8_t)lrint(255 * srgb_encode(color[c]));
    }
    s->one_material = true;
    uint32_t first = UINT32_MAX;
    for (uint32_t k = 0; k < plan->leaf_count; k++) {
        if (plan->leaves[k].kind == LEAF_GROUP) continue;
        if (first == UINT32_MAX) first = plan->leaves[k].material;
        if (plan->leaves[k].material != first) s->one_material = false;
    }
}

// The material of a point that is inside: that of the leaf whose F is the scene's.
static uint32_t material_at(const Slicing *s, int x, int y)
{
    const SliceView *v = &s->view;
    int axes[2];
    uint32_t leaf = 0;
    double point[3];
    section_axes(&s->plane, axes);
    point[s->plane.axis] = s->plane.at;
    point[axes[0]] = v->x0 + (x + 0.5) * (v->x1 - v->x0) / v->width;
    point[axes[1]] = v->y1 - (y + 0.5) * (v->y1 - v->y0) / v->height;
    if (!s->one_material)
        plan_field(s->plan, s->values, point, &leaf);
    else
        while (s->plan->leaves[leaf].kind == LEAF_GROUP) leaf++;
    return leaf < s->plan->leaf_count ? s->plan->leaves[leaf].material : 0;
}

static void picture_row(void *context, int y, uint8_t *row)
{
    const Slicing *s = context;
    const uint16_t *bits = s->bits + (size_t)y * s->stride;
    for (int x = 0; x < (int)s->view.width; x++, row += 3) {
        if (bits[x / 16] >> (x % 16) & 1)
            memcpy(row, s->colors[material_at(s, x, y)], 3);
        else
            memset(row, 255, 3);
    }
}

static int write_pictures(Slicing *s)
{
    Failure failure;
    if (s->options->output_count) find_colors(s);
    PngDesc desc = {.row = picture_row,
                    .context = s,
                    .width = (int)s->view.width,
                    .height = (int)s->view.height,
                    .scene = s->scene->package->scene,
                    .software = "scn",
                    .unfinished = command_unfinished()};
    for (int k = 0; k < s->options->output_count; k++) {
        if (image_write_png(s->options->outputs[k], &desc, &failure)) continue;
        command_error("%s", failure.text);
        return EXIT_WORLD;
    }
    return EXIT_DONE;
}

static bool check_outputs(const Options *o)
{
    for (int k = 0; k < o->output_count; k++) {
        size_t length = strlen(o->outputs[k]);
        if (length > 4 && !strcasecmp(o->outputs[k] + length - 4, ".png")) continue;
        command_error("-o %s: a slice is a picture whose name ends in .png", o->outputs[k]);
        return false;
    }
    return true;
}

// --- what is said about it

static double area_of(const Slicing *s)
{
    const SliceView *v = &s->view;
    return (double)s->inside * ((v->x1 - v->x0) / v->width) * ((v->y1 - v->y0) / v->height);
}

static cJSON *range_json(double low, double high)
{
    return cJSON_CreateDoubleArray((double[]){low, high}, 2);
}

static void print_json(const Slicing *s)
{
    const SliceView *v = &s->view;
    cJSON *json = cJSON_CreateObject();
    char axis[2] = {axis_names[s->plane.axis]};
    cJSON_AddStringToObject(json, "scene", s->scene->package->scene);
    cJSON_AddStringToObject(json, "axis", axis);
    cJSON_AddNumberToObject(json, "at", s->plane.at);
    cJSON_AddItemToObject(json, "across", range_json(v->x0, v->x1));
    cJSON_AddItemToObject(json, "up", range_json(v->y0, v->y1));
    cJSON_AddNumberToObject(json, "width", v->width);
    cJSON_AddNumberToObject(json, "height", v->height);
    cJSON_AddNumberToObject(json, "inside", (double)s->inside);
    cJSON_AddNumberToObject(json, "outside", (double)v->width * v->height - (double)s->inside);
    cJSON_AddNumberToObject(json, "area", area_of(s));
    cJSON_AddNumberToObject(json, "numbers", s->steps.numbers);
    cJSON_AddNumberToObject(json, "comparisons", s->steps.compares);
    cJSON_AddNumberToObject(json, "conditions", s->steps.logics);
    cJSON_AddStringToObject(json, "device", s->device);
    cJSON_AddStringToObject(json, "drawn_by", s->of_package ? "package" : "program");
    cJSON_AddNumberToObject(json, "kernel_builds", s->builds);
    cJSON_AddNumberToObject(json, "draw_ms", s->draw_ms);
    command_json(stdout, json);
}

static void print_text(const Slicing *s)
{
    const SliceView *v = &s->view;
    int axes[2];
    section_axes(&s->plane, axes);
    printf("%c = %g, %c %g .. %g, %c %g .. %g: %llu of %llu pixels inside, area %g\n", axis_names[s->plane.axis],
           s->plane.at, axis_names[axes[0]], v->x0, v->x1, axis_names[axes[1]], v->y0, v->y1,
           (unsigned long long)s->inside, (unsigned long long)v->width * v->height, area_of(s));
}

int command_slice(const Options *options)
{
    Slicing s = {.options = options};
    Device *device = NULL;
    Slicer *slicer = NULL;
    Failure failure;
    if (!read_plane(&s, "plane", options->plane ? options->plane : "z=0") || !check_outputs(options)) return EXIT_USAGE;
    int status;
    s.is_model = command_is_model(options->files[0]);
    s.scene = s.is_model ? command_load_model(options, &status) : command_load(options, &status);
    if (s.scene) status = evaluate(&s);
    if (status == EXIT_DONE) status = set_view(&s) ? make_formula(&s) : EXIT_USAGE;
    if (status == EXIT_DONE && !draw(&s, &device, &slicer, &failure)) {
        command_error("%s", failure.text);
        status = EXIT_WORLD;
    }
    if (status == EXIT_DONE) status = write_pictures(&s);
    if (status == EXIT_DONE && options->json)
        print_json(&s);
    else if (status == EXIT_DONE && !options->quiet)
        print_text(&s);
    slicer_free(slicer);
    device_close(device);
    command_free(s.scene);
    arena_release(&s.arena);
    return status;
}
