// scn patch: the solved values of a scene's patches, without a picture.
//
// At each time and for each patch: the centre, the L2 norm of x, y and z over the unit square (trapezoidal rule over the
// nodes), the least and the greatest x, y and z of the nodes, and the places that --probe asks for.
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/command.h"
#include "runtime/file.h"
#include "runtime/patch_scene.h"
#include "runtime/scene.h"

typedef struct Probe {
    double u, v;
} Probe;

typedef struct Survey { // of a patch at a time
    double centre[3], norm[3], least[3], greatest[3];
} Survey;

typedef struct Patches {
    const Options *options;
    ScnScene *scene;
    const Plan *plan;
    Probe probes[OPTION_LIMIT];
    int probe_count;
    double *times;
    int time_count;
    PatchMethod method;
    Device *device;
    cJSON *json; // an array; NULL: not wanted
} Patches;

// --- the command line

static bool read_probes(Patches *p)
{
    for (int i = 0; i < p->options->probe_count; i++) {
        const char *text = p->options->probes[i];
        char *next, *end;
        Probe *probe = &p->probes[p->probe_count++];
        probe->u = strtod(text, &next);
        probe->v = *next == ',' ? strtod(next + 1, &end) : NAN;
        bool ok = next != text && *next == ',' && end != next + 1 && !*end;
        if (ok && probe->u >= 0 && probe->u <= 1 && probe->v >= 0 && probe->v <= 1) continue;
        command_error("--probe wants u,v, both from 0 to 1, as 0.25,0.5, not \"%s\"", text);
        return false;
    }
    return true;
}

static bool read_times(Patches *p)
{
    static const char *const zero = "0s";
    const char *text = p->options->times ? p->options->times : p->options->time ? p->options->time : zero;
    double fps = p->plan->fps > 0 ? p->plan->fps : 24;
    p->times = calloc(strlen(text) + 1, sizeof *p->times);
    while (p->times) {
        char one[64] = "";
        size_t length = strcspn(text, ",");
        if (length < sizeof one) memcpy(one, text, length);
        if (!options_time(one, fps, &p->times[p->time_count]) || !(p->times[p->time_count] >= 0)) {
            command_error("--times wants times as 1.5s, 300ms or 12f, joined by commas, not \"%.*s\"", (int)length,
                          text);
            return false;
        }
        p->time_count++;
        if (!text[length]) return true;
        text += length + 1;
    }
    command_error("out of memory");
    return false;
}

// Which patches: all, or that of --patch.
static bool is_wanted(const Patches *p, const PlanPatch *patch)
{
    return !p->options->patch || !strcmp(p->options->patch, patch->name);
}

static bool find_patch(const Patches *p)
{
    bool found = !p->options->patch && p->plan->patch_count;
    for (uint32_t k = 0; k < p->plan->patch_count; k++) found |= is_wanted(p, &p->plan->patches[k]);
    if (found) return true;
    if (!p->plan->patch_count)
        command_error("%s has no patch", p->options->files[0]);
    else
        command_error("the scene has no patch %s, but %s", p->options->patch, p->plan->patches[0].name);
    return false;
}

// --- what there is

static void survey(PatchSolve *solve, const PatchShape *shape, Survey *s)
{
    int nodes = shape->nodes;
    double h = 1.0 / (nodes - 1);
    patch_solve_point(solve, 0.5, 0.5, s->centre);
    for (int c = 0; c < 3; c++) {
        s->least[c] = INFINITY;
        s->greatest[c] = -INFINITY;
        double sum = 0;
        for (int i = 0; i < nodes; i++)
            for (int j = 0; j < nodes; j++) {
                double x = shape->x[c][i * nodes + j];
                double weight = (i == 0 || i == nodes - 1 ? 0.5 : 1) * (j == 0 || j == nodes - 1 ? 0.5 : 1);
                s->least[c] = fmin(s->least[c], x);
                s->greatest[c] = fmax(s->greatest[c], x);
                sum += weight * x * x;
            }
        s->norm[c] = sqrt(sum) * h;
    }
}

static void print_place(const Patches *p, const PatchShape *shape, const char *name, const char *what,
                        const Probe *probe, const double place[3])
{
    if (p->options->csv) {
        printf("%s,%.17g,%llu,%s,", name, shape->time, (unsigned long long)shape->steps, what);
        if (probe)
            printf("%.17g,%.17g", probe->u, probe->v);
        else
            printf(",");
        printf(",%.17g,%.17g,%.17g\n", place[0], place[1], place[2]);
        return;
    }
    char where[64] = "";
    if (probe) snprintf(where, sizeof where, " %g,%g", probe->u, probe->v);
    printf("  %-8s%-14s %16.9g %16.9g %16.9g\n", what, where, place[0], place[1], place[2]);
}

static void print_shape(Patches *p, PatchSolve *solve, const PatchShape *shape, const char *name, const Survey *s)
{
    static const Probe middle = {0.5, 0.5};
    if (!p->options->csv) {
        printf("patch %s at %gs, %llu steps", name, shape->time, (unsigned long long)shape->steps);
        if (p->method == PATCH_METHOD_ITERATIVE)
            printf(", the last in %d sweeps to a residual of %.2g", shape->sweeps, shape->residual);
        printf("\n  %-22s %16s %16s %16s\n", "", "x", "y", "z");
    }
    print_place(p, shape, name, "centre", &middle, s->centre);
    print_place(p, shape, name, "norm", NULL, s->norm);
    print_place(p, shape, name, "least", NULL, s->least);
    print_place(p, shape, name, "greatest", NULL, s->greatest);
    for (int k = 0; k < p->probe_count; k++) {
        double place[3];
        patch_solve_point(solve, p->probes[k].u, p->probes[k].v, place);
        print_place(p, shape, name, "probe", &p->probes[k], place);
    }
}

static void add_shape(Patches *p, PatchSolve *solve, const PatchShape *shape, const char *name, const Survey *s)
{
    cJSON *entry = cJSON_CreateObject();
    cJSON_AddItemToArray(p->json, entry);
    cJSON_AddStringToObject(entry, "patch", name);
    cJSON_AddNumberToObject(entry, "time", shape->time);
    cJSON_AddNumberToObject(entry, "steps", (double)shape->steps);
    cJSON_AddNumberToObject(entry, "nodes", shape->nodes);
    cJSON_AddItemToObject(entry, "centre", cJSON_CreateDoubleArray(s->centre, 3));
    cJSON_AddItemToObject(entry, "norm", cJSON_CreateDoubleArray(s->norm, 3));
    cJSON_AddItemToObject(entry, "least", cJSON_CreateDoubleArray(s->least, 3));
    cJSON_AddItemToObject(entry, "greatest", cJSON_CreateDoubleArray(s->greatest, 3));
    cJSON *probes = cJSON_AddArrayToObject(entry, "probes");
    for (int k = 0; k < p->probe_count; k++) {
        double place[3];
        cJSON *probe = cJSON_CreateObject();
        patch_solve_point(solve, p->probes[k].u, p->probes[k].v, place);
        cJSON_AddNumberToObject(probe, "u", p->probes[k].u);
        cJSON_AddNumberToObject(probe, "v", p->probes[k].v);
        cJSON_AddItemToObject(probe, "place", cJSON_CreateDoubleArray(place, 3));
        cJSON_AddItemToArray(probes, probe);
    }
    if (p->method != PATCH_METHOD_ITERATIVE) return;
    cJSON_AddNumberToObject(entry, "sweeps", shape->sweeps);
    cJSON_AddNumberToObject(entry, "residual", shape->residual);
}

// --- solving

static int solve_patch(Patches *p, const PlanPatch *patch)
{
    Failure failure = {""};
    PatchSolveDesc desc = {.fps = p->plan->fps,
                           .method = p->method,
                           .device = p->device,
                           .sweeps = p->options->sweeps,
                           .checkpoints = p->options->checkpoints};
    PatchSolve *solve = patch_solve_new(patch, &desc, &failure);
    if (!solve) {
        command_error("%s", failure.text);
        return EXIT_WORLD;
    }
    int status = EXIT_DONE;
    for (int k = 0; k < p->time_count && status == EXIT_DONE; k++) {
        FrameError error;
        if (!patch_solve_to(solve, p->times[k], p->scene->inputs, &error)) {
            double frame = floor(p->times[k] * p->plan->fps + 1e-6);
            status = command_result(p->scene, scene_fail_frame(p->scene, &error, p->times[k], frame));
            break;
        }
        PatchShape shape = patch_solve_shape(solve);
        Survey s;
        survey(solve, &shape, &s);
        if (p->json)
            add_shape(p, solve, &shape, patch->name, &s);
        else
            print_shape(p, solve, &shape, patch->name, &s);
    }
    int damaged = patch_solve_damaged(solve);
    if (damaged)
        command_warning("%d checkpoint%s of patches could not be used: %s", damaged, damaged == 1 ? "" : "s",
                        patch_solve_damage(solve));
    patch_solve_free(solve);
    return status;
}

static int solve_all(Patches *p)
{
    int status = EXIT_DONE;
    Failure failure = {""};
    if (p->method == PATCH_METHOD_DEVICE) {
        p->device = device_open(&(DeviceDesc){.choice = p->options->device, .threads = p->options->threads}, &failure);
        if (!p->device) {
            command_error("%s", failure.text);
            return EXIT_WORLD;
        }
    }
    if (p->options->checkpoints && !make_folders(p->options->checkpoints)) {
        command_error("cannot make the folder for checkpoints %s: %s", p->options->checkpoints, strerror(errno));
        return EXIT_WORLD;
    }
    if (p->options->json) p->json = cJSON_CreateArray();
    if (p->options->csv) printf("patch,time,steps,what,u,v,x,y,z\n");
    for (uint32_t k = 0; k < p->plan->patch_count && status == EXIT_DONE; k++)
        if (is_wanted(p, &p->plan->patches[k])) status = solve_patch(p, &p->plan->patches[k]);
    if (p->json && status == EXIT_DONE)
        command_json(stdout, p->json);
    else
        cJSON_Delete(p->json);
    device_close(p->device);
    return status;
}

int command_patch(const Options *options)
{
    CommandScene parts;
    command_describe(options, &parts);
    parts.desc.check_only = true;
    ScnScene *scene = scene_new(&parts.desc, &(CompileOptions){.patches = true});
    int status = command_loaded(scene);
    if (status != EXIT_DONE) return status;
    Patches p = {.options = options, .scene = scene, .plan = scene->package->plan};
    if (options->solver) patch_method_named(options->solver, &p.method);
    status = EXIT_USAGE;
    if (find_patch(&p) && read_probes(&p) && read_times(&p)) status = solve_all(&p);
    free(p.times);
    scn_free(scene);
    return status;
}
