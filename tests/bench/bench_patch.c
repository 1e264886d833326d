// How long a step of deformable patches takes: on the device in float, and on the host in double.
//
//     bench-patch [--threads N] [--json] [--quick]
//
// Every patch is the literature's case 3d with slopes on all components, so that all three have work; "x3 only" is the
// same as a height field, whose first two components rest. Milliseconds are of one step of all patches together: wall
// time, and time of the process on all cores. --quick does a few steps of each, to see that it runs.
//
// Then through scenes, as `scn render` does it: a hundred patches whose force is another in each of their steps, in frames of 24 a second at 64 x 64
// pixels (a step is a frame's time by its steps: the picture is in it); and pictures of one patch at 512 x 512, as a sheet, of a thickness, and of a thickness among
// set operations.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "runtime/patch_device.h"
#include "runtime/scn.h"
#include "tests/unit/patch_cases.h"

typedef struct Options {
    int threads;
    bool json, quick;
} Options;

typedef struct Row {
    const char *name;
    int nodes, patches;
    bool all, moving, contact;
    double bound; // ms of wall time that are asked for; 0: none
} Row;

typedef struct Cost {
    double wall, cpu; // ms a step
    int iterations;
} Cost;

static double clock_ms(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

static void die(const char *text)
{
    fprintf(stderr, "bench-patch: %s\n", text);
    exit(3);
}

static PatchModel model_of(const Row *row)
{
    PatchModel model = patch_case_model(&patch_cases[7], row->nodes, 1e-3);
    if (row->all) model.tangents = PATCH_TANGENTS_ALL;
    return model;
}

// Everything that a scene may change in each step: edges and a force at each node.
static void drive(PatchDevice *patches, const Row *row, PatchEdges *edges, double *force, int t)
{
    Failure failure;
    for (int k = 0; k < row->nodes; k++) edges->position[PATCH_U0][2][k] = 0.1 * sin(0.05 * t + k);
    for (int k = 0; k < row->nodes * row->nodes; k++) force[k] = 100 * sin(0.1 * t + 0.01 * k);
    for (int k = 0; k < row->patches; k++)
        if (!patch_device_edges(patches, k, edges, &failure) ||
            !patch_device_force(patches, k, (const double *const[3]){NULL, NULL, force}, &failure))
            die(failure.text);
}

// A ball for each patch, coming down into it.
static void place_balls(PatchDevice *patches, int count, int t)
{
    Failure failure;
    PatchSolid *balls = calloc((size_t)count, sizeof *balls);
    int *owner = calloc((size_t)count, sizeof *owner);
    if (!balls || !owner) die("out of memory");
    double z = fmax(0.1, 0.35 - 0.01 * t);
    for (int k = 0; k < count; k++) {
        balls[k] = (PatchSolid){{-1, -1, -1, 0, 0, 0, 1, 0.8, 2 * z, 0.09 - 0.25 - 0.16 - z * z}, 1e5};
        owner[k] = k;
    }
    if (!patch_device_solids(patches, balls, owner, count, &failure)) die(failure.text);
    free(balls);
    free(owner);
}

static Cost measure(Device *device, const Row *row, const Options *options)
{
    Failure failure;
    PatchDevice *patches = patch_device_new(device, row->nodes, PATCH_PLAIN, row->patches, &failure);
    if (!patches) die(failure.text);
    PatchModel model = model_of(row);
    PatchEdges *edges = patch_case_edges(&patch_cases[7], row->nodes);
    double *force = calloc((size_t)row->nodes * row->nodes, sizeof *force);
    int *steps = calloc((size_t)row->patches, sizeof *steps);
    if (!force || !steps) die("out of memory");
    for (int k = 0; k < row->patches; k++) {
        steps[k] = 1;
        if (!patch_device_model(patches, k, &model, &failure) ||
            !patch_device_start(patches, k, edges, NULL, NULL, &failure))
            die(failure.text);
    }
    // Long enough for the clock, and through the part of the motion where most iterations are needed.
    int count = options->quick ? 3 : 100;
    double wall = 0, cpu = 0;
    for (int t = -2; t < count; t++) {
        if (t == 0) {
            clFinish(device->queue);
            wall = clock_ms(CLOCK_MONOTONIC);
            cpu = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
        }
        if (row->moving) drive(patches, row, edges, force, t);
        if (row->contact) place_balls(patches, row->patches, t);
        if (!patch_device_step(patches, steps, &failure)) die(failure.text);
    }
    clFinish(device->queue);
    Cost cost = {(clock_ms(CLOCK_MONOTONIC) - wall) / count, (clock_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu) / count, 0};
    PatchResult result;
    PatchFault fault;
    if (!patch_device_result(patches, 0, 2, &result, &failure) ||
        !patch_device_read(patches, 0, NULL, NULL, &fault, &failure))
        die(failure.text);
    if (fault.kind != PATCH_FINE) die(fault.text);
    cost.iterations = result.iterations;
    free(force);
    free(steps);
    patch_edges_free(edges);
    patch_device_free(patches);
    return cost;
}

static void print_row(const Row *row, Cost cost, const Options *options)
{
    if (options->json)
        printf("{\"name\": \"%s\", \"nodes\": %d, \"patches\": %d, \"wall_ms\": %.4f, \"cpu_ms\": %.4f, "
               "\"iterations\": %d, \"bound_ms\": %g}\n",
               row->name, row->nodes, row->patches, cost.wall, cost.cpu, cost.iterations, row->bound);
    else
        printf("%-34s %4d %5d %10.3f %10.3f %8.0f %5d %s\n", row->name, row->nodes, row->patches, cost.wall, cost.cpu,
               1e3 / cost.wall, cost.iterations,
               row->bound == 0           ? ""
               : cost.wall <= row->bound ? "ok"
                                         : "TOO SLOW");
}

static void measure_host(int nodes, const Options *options)
{
    Failure failure;
    PatchFault fault;
    PatchModel model = patch_case_model(&patch_cases[7], nodes, 1e-3);
    PatchEdges *edges = patch_case_edges(&patch_cases[7], nodes);
    PatchHost *patch = patch_host_new(&model, PATCH_DIRECT, &failure);
    if (!patch) die(failure.text);
    patch_host_start(patch, edges, NULL, NULL);
    double start = clock_ms(CLOCK_MONOTONIC);
    if (!patch_host_step(patch, NULL, &fault)) die(fault.text);
    double first = clock_ms(CLOCK_MONOTONIC) - start;
    int count = options->quick ? 2 : 20;
    start = clock_ms(CLOCK_MONOTONIC);
    double cpu = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    for (int t = 0; t < count; t++)
        if (!patch_host_step(patch, NULL, &fault)) die(fault.text);
    Cost cost = {(clock_ms(CLOCK_MONOTONIC) - start) / count, (clock_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu) / count, 0};
    print_row(&(Row){.name = "host, double, three components", .nodes = nodes, .patches = 1}, cost, options);
    print_row(&(Row){.name = "host, double, factor and first step", .nodes = nodes, .patches = 1},
              (Cost){first, first, 0}, options);
    patch_host_free(patch);
    patch_edges_free(edges);
}

static void frame_of(ScnScene *scene, int frame, int size)
{
    float *color = malloc((size_t)size * (size_t)size * 4 * sizeof *color);
    ScnFrameDesc desc = {.width = size, .height = size, .time = frame / 24.0, .frame = frame, .color = color};
    if (!color || scn_render(scene, &desc) != SCN_OK) die(color ? scn_error(scene) : "out of memory");
    free(color);
}

// Milliseconds of each of `count` frames after the first, `spacing` frames apart.
static Cost frames_of(const char *text, int size, int spacing, int count, const Options *options)
{
    ScnScene *scene = scn_load(&(ScnSceneDesc){.bytes = text,
                                               .size = strlen(text),
                                               .device = "cpu",
                                               .threads = options->threads,
                                               .no_cache = true,
                                               .quick = options->quick});
    if (scn_status(scene) != SCN_OK) die(scn_diagnostics_text(scene, false));
    frame_of(scene, 1, size);
    double wall = clock_ms(CLOCK_MONOTONIC), cpu = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    for (int k = 1; k <= count; k++) frame_of(scene, 1 + k * spacing, size);
    Cost cost = {(clock_ms(CLOCK_MONOTONIC) - wall) / count, (clock_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu) / count, 0};
    scn_free(scene);
    return cost;
}

static void measure_scenes(const Options *options)
{
    static const char hundred[] =
        "scn 1;\ncamera { eye: (5, -16, 12); look_at: (5.5, 5, 0); up: (0, 0, 1); fov: 40deg; }\n"
        "fn skin(k: int) -> patch { patch(grid: 33, force: (0, 0, 100 * sin(360deg * (time / 1s) + k * 20deg))) }\n"
        "for k in 0 .. 100 { skin(k).move(1.1 * mod(k, 10), 1.1 * floor(k / 10), 0); }\n";
    static const char patch[] =
        "scn 1;\ncamera { eye: (2.6, -2.9, 1.9); look_at: (0.5, 0.5, 0.1); up: (0, 0, 1); fov: 26deg; }\n"
        "light { direction: (0.9, 0.3, -0.8); }\npatch p { grid: 17; start: (u, v, 4 * u * (1 - u) * v * (1 - v) * "
        "sin(540deg * u)); }\n";
    static const char *const shown[][2] = {
        {"a sheet, 512 x 512", "p;\n"},
        {"of a thickness, 512 x 512", "p.thicken(thickness: 0.12);\n"},
        {"of a thickness less a sphere", "p.thicken(thickness: 0.12) - sphere(0.3).move(0.5, 0.5, 0);\n"},
    };
    double steps = 1000.0 / 24;
    Cost cost = frames_of(hundred, 64, 1, options->quick ? 1 : 6, options);
    print_row(&(Row){.name = "in a rendered scene", .nodes = 33, .patches = 100, .bound = 1000.0 / 60},
              (Cost){cost.wall / steps, cost.cpu / steps, 0}, options);
    for (int k = 0; k < 3; k++) {
        char text[600];
        snprintf(text, sizeof text, "%s%s", patch, shown[k][1]);
        cost = frames_of(text, options->quick ? 64 : 512, 0, options->quick ? 1 : 3, options);
        print_row(&(Row){.name = shown[k][0], .nodes = 17, .patches = 1}, cost, options);
    }
}

int main(int argc, char **argv)
{
    Options options = {.threads = 2};
    for (int k = 1; k < argc; k++) {
        if (!strcmp(argv[k], "--json"))
            options.json = true;
        else if (!strcmp(argv[k], "--quick"))
            options.quick = true;
        else if (!strcmp(argv[k], "--threads") && k + 1 < argc)
            options.threads = atoi(argv[++k]);
        else {
            fprintf(stderr, "usage: bench-patch [--threads N] [--json] [--quick]\n");
            return 2;
        }
    }
    Failure failure;
    Device *device = device_open(&(DeviceDesc){.choice = "cpu", .threads = options.threads}, &failure);
    if (!device) die(failure.text);
    const Row rows[] = {
        {"x3 only", 65, 1, false, false, false, 1},
        {"all components", 65, 1, true, false, false, 1},
        {"edges and forces move", 65, 1, true, true, false, 0},
        {"a ball lies on it", 65, 1, false, false, true, 0},
        {"x3 only", 129, 1, false, false, false, 5},
        {"all components", 129, 1, true, false, false, 5},
        {"edges and forces move", 129, 1, true, true, false, 0},
        {"x3 only", 33, 100, false, false, false, 1000.0 / 60},
        {"all components", 33, 100, true, false, false, 1000.0 / 60},
        {"edges and forces move", 33, 100, true, true, false, 0},
        {"a ball lies on each", 33, 100, false, false, true, 0},
    };
    if (!options.json)
        printf("%-34s %4s %5s %10s %10s %8s %5s\n", "", "grid", "count", "wall ms", "cpu ms", "steps/s", "its");
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        print_row(&rows[k], measure(device, &rows[k], &options), &options);
    measure_host(65, &options);
    measure_host(129, &options);
    device_close(device);
    measure_scenes(&options);
    return 0;
}
