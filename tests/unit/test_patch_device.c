// Patches on the device against the double solver, and what the device promises of its own: the same bits however steps
// are launched, no shape that is not finite, no kernel built twice. Without an OpenCL device the tests are skipped.
//
// `test_patch_device small` runs one test at width 1 on a small grid, for tools that watch each access of a kernel.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "runtime/patch_device.h"
#include "tests/unit/patch_cases.h"

static Device *device;
static Failure failure;
static bool small_only;

#define NEED(what)                                                                                                     \
    do {                                                                                                               \
        if (!(what)) fail_msg("%s", failure.text);                                                                     \
    } while (0)

static int open_device(void **state)
{
    device = device_open(&(DeviceDesc){.choice = "cpu"}, &failure);
    return 0;
}

static int close_device(void **state)
{
    device_close(device);
    return 0;
}

static void needs_device(void)
{
    if (!device) skip();
}

// A device holds the solver's program for all of its patches: another one begins without.
static void reopen_device(void)
{
    needs_device();
    int width = device->width;
    device_close(device);
    device = device_open(&(DeviceDesc){.choice = "cpu", .width = width}, &failure);
    NEED(device);
}

static PatchDevice *make(int nodes, int count)
{
    needs_device();
    PatchDevice *patches = patch_device_new(device, nodes, PATCH_PLAIN, count, &failure);
    NEED(patches);
    return patches;
}

// The places of a patch, to be freed by free(x[0]).
static void read_places(PatchDevice *patches, int patch, int nodes, double *x[3])
{
    size_t grid = (size_t)nodes * nodes;
    x[0] = malloc(3 * grid * sizeof **x);
    x[1] = x[0] + grid;
    x[2] = x[1] + grid;
    PatchFault fault;
    NEED(patch_device_read(patches, patch, x, NULL, &fault, &failure));
    if (fault.kind != PATCH_FINE) fail_msg("%s", fault.text);
}

// The largest difference to the host's patch, over all three components.
static double difference(PatchDevice *patches, int patch, const PatchHost *host)
{
    double *x[3], largest = 0;
    int nodes = host->model.nodes;
    read_places(patches, patch, nodes, x);
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < nodes * nodes; k++) largest = fmax(largest, fabs(x[c][k] - host->x[c][k]));
    free(x[0]);
    return largest;
}

static PatchHost *host_of(const PatchModel *model)
{
    PatchHost *host = patch_host_new(model, PATCH_DIRECT, &failure);
    NEED(host);
    return host;
}

static void step_host(PatchHost *host, const PatchDrive *drive)
{
    PatchFault fault;
    if (!patch_host_step(host, drive, &fault)) fail_msg("%s", fault.text);
}

static void eleven_cases_agree_with_host(void **state)
{
    const double lengths[] = {2e-4, 1e-3, 5e-3};
    for (int nodes = 17; nodes <= 65; nodes = 2 * nodes - 1) {
        PatchDevice *patches = make(nodes, PATCH_CASES);
        for (int s = 0; s < 3; s++) {
            if (nodes == 65 && s == 0) continue; // 125 steps of the direct solver take their time
            int steps[PATCH_CASES];
            for (int k = 0; k < PATCH_CASES; k++) {
                PatchModel model = patch_case_model(&patch_cases[k], nodes, lengths[s]);
                PatchEdges *edges = patch_case_edges(&patch_cases[k], nodes);
                NEED(patch_device_model(patches, k, &model, &failure));
                NEED(patch_device_start(patches, k, edges, NULL, NULL, &failure));
                steps[k] = (int)lround(0.025 / lengths[s]);
                patch_edges_free(edges);
            }
            NEED(patch_device_step(patches, steps, &failure));
            for (int k = 0; k < PATCH_CASES; k++) {
                PatchModel model = patch_case_model(&patch_cases[k], nodes, lengths[s]);
                PatchEdges *edges = patch_case_edges(&patch_cases[k], nodes);
                PatchHost *host = host_of(&model);
                patch_host_start(host, edges, NULL, NULL);
                for (int t = 0; t < steps[k]; t++) step_host(host, NULL);
                double error = difference(patches, k, host);
                if (!(error < 2e-5)) fail_msg("%s, %d nodes, dt %g: %g", patch_cases[k].name, nodes, lengths[s], error);
                PatchResult result;
                NEED(patch_device_result(patches, k, 2, &result, &failure));
                assert_true(result.residual <= 1e-6f && result.iterations <= 24 && result.steps == steps[k]);
                patch_host_free(host);
                patch_edges_free(edges);
            }
        }
        patch_device_free(patches);
    }
}

static void move_edges(PatchEdges *edges, int t)
{
    unsigned seed = 17 + (unsigned)t;
    for (size_t k = 0; k < patch_edges_count(edges->nodes); k++)
        patch_edges_values(edges)[k] += 0.02 * patch_noise(&seed);
}

// Three stiffnesses, slopes on all components, edges and forces that change in every step, a rough start; both schemes,
// even and odd grids.
static void all_that_moves_agrees_with_host(void **state)
{
    for (int run = 0; run < 4; run++) {
        int nodes = run % 2 ? 12 : 21;
        size_t grid = (size_t)nodes * nodes;
        PatchModel model = patch_model_base(nodes);
        model.scheme = run / 2 ? PATCH_NEWMARK : PATCH_IMPLICIT;
        model.tangents = PATCH_TANGENTS_ALL;
        model.stiffness[0] = (PatchStiffness){1, 0, 3};
        model.stiffness[1] = (PatchStiffness){2, -1, 0.5};
        model.stiffness[2] = (PatchStiffness){0.5, 3, 2};
        PatchDevice *patches = make(nodes, 2);
        PatchHost *host = host_of(&model);
        PatchEdges *edges = patch_edges_new(nodes);
        double *memory = calloc(9 * grid, sizeof *memory), *x[3], *v[3], *force[3];
        unsigned seed = 99;
        for (int c = 0; c < 3; c++) {
            x[c] = memory + (size_t)c * grid, v[c] = x[c] + 3 * grid, force[c] = v[c] + 3 * grid;
            for (size_t k = 0; k < grid; k++) {
                double u = (double)(k / nodes) / (nodes - 1), w = (double)(k % nodes) / (nodes - 1);
                x[c][k] = u * u + c * w - u * w, v[c][k] = 3 * sin(5 * u) * w;
            }
        }
        NEED(patch_device_model(patches, 1, &model, &failure));
        NEED(patch_device_start(patches, 1, edges, (const double *const *)x, (const double *const *)v, &failure));
        patch_host_start(host, edges, (const double *const *)x, (const double *const *)v);
        for (int t = 0; t < 30; t++) {
            if (t % 3 != 2) move_edges(edges, t); // a step without a change between
            for (size_t k = 0; k < 3 * grid; k++) force[0][k] = 300 * patch_noise(&seed);
            if (t % 3 != 2) NEED(patch_device_edges(patches, 1, edges, &failure));
            NEED(patch_device_force(patches, 1, (const double *const[3]){force[0], t % 4 ? force[1] : NULL, force[2]},
                                    &failure));
            assert_true(patch_device_force_time(patches, 1) == patch_host_force_time(host));
            NEED(patch_device_step(patches, (int[]){3, 1}, &failure));
            step_host(host, &(PatchDrive){.edges = edges, .force = {force[0], t % 4 ? force[1] : NULL, force[2]}});
        }
        double error = difference(patches, 1, host);
        if (!(error < 1e-4)) fail_msg("run %d: %g", run, error);
        assert_int_equal(patch_device_steps(patches, 1), 30);
        assert_int_equal(patch_device_steps(patches, 0), 90);
        assert_true(patch_device_time(patches, 1) == host->time);
        free(memory);
        patch_edges_free(edges);
        patch_host_free(host);
        patch_device_free(patches);
    }
}

static void pins_agree_with_host(void **state)
{
    enum { nodes = 33 };
    // A row of neighbours, as a pole holds a flag, and one by itself that moves.
    PatchPin pins[9];
    for (int k = 0; k < 8; k++) pins[k] = (PatchPin){9 + k, 5, {(9 + k) / 32.0, 5 / 32.0, 0.2}};
    pins[8] = (PatchPin){22, 20, {0.7, 0.6, -0.5}};
    for (int scheme = 0; scheme < 2; scheme++) {
        PatchModel model = patch_model_base(nodes);
        model.scheme = scheme;
        model.pins = pins;
        model.pin_count = 9;
        PatchDevice *patches = make(nodes, 2);
        PatchHost *host = host_of(&model);
        NEED(patch_device_model(patches, 1, &model, &failure));
        NEED(patch_device_start(patches, 1, NULL, NULL, NULL, &failure));
        for (int t = 0; t < 40; t++) {
            pins[8].to[2] = -0.5 + 0.01 * t;
            NEED(patch_device_model(patches, 1, &model, &failure));
            NEED(patch_host_model(host, &model, &failure));
            NEED(patch_device_step(patches, (int[]){1, 1}, &failure));
            step_host(host, NULL);
        }
        double error = difference(patches, 1, host), *x[3];
        if (!(error < 1e-4)) fail_msg("scheme %d: %g", scheme, error);
        read_places(patches, 1, nodes, x);
        for (int k = 0; k < 9; k++)
            for (int c = 0; c < 3; c++) assert_true(fabs(x[c][pins[k].i * nodes + pins[k].j] - pins[k].to[c]) < 1e-5);
        free(x[0]);
        // The patch beside it has none.
        PatchModel base = patch_model_base(nodes);
        PatchHost *other = host_of(&base);
        for (int t = 0; t < 40; t++) step_host(other, NULL);
        assert_true(difference(patches, 0, other) < 1e-5);
        patch_host_free(other);
        patch_host_free(host);
        patch_device_free(patches);
    }
    PatchModel model = patch_model_base(nodes);
    model.pins = pins;
    model.pin_count = 65;
    PatchDevice *patches = make(nodes, 1);
    assert_false(patch_device_model(patches, 0, &model, &failure));
    assert_non_null(strstr(failure.text, "at most 64"));
    patch_device_free(patches);
}

static PatchSolid ball_at(double x, double y, double z, double r, double stiffness)
{
    PatchSolid ball = {{-1, -1, -1, 0, 0, 0, 2 * x, 2 * y, 2 * z, r * r - x * x - y * y - z * z}, stiffness};
    for (int k = 0; k < 10; k++) ball.quadric[k] /= 2 * r;
    return ball;
}

// A falling ball and a rising one, at moderate and at great stiffness.
static void solids_agree_with_host(void **state)
{
    enum { nodes = 25 };
    for (int run = 0; run < 2; run++) {
        PatchModel model = patch_model_base(nodes);
        model.force[2] = 100;
        PatchDevice *patches = make(nodes, 2);
        PatchHost *host = host_of(&model);
        NEED(patch_device_model(patches, 1, &model, &failure));
        for (int t = 0; t < 80; t++) {
            double stiffness = run ? 1e6 : 2e4;
            PatchSolid balls[2] = {ball_at(0.4, 0.35, 0.6 - 0.005 * t, 0.25, stiffness),
                                   ball_at(0.75, 0.7, -0.4 + 0.005 * t, 0.2, stiffness)};
            NEED(patch_device_solids(patches, balls, (int[]){1, 1}, 2, &failure));
            NEED(patch_device_step(patches, (int[]){1, 1}, &failure));
            step_host(host, &(PatchDrive){.contact = patch_contact_solids, .context = &(PatchSolids){balls, 2}});
        }
        double error = difference(patches, 1, host);
        if (!(error < (run ? 2e-3 : 2e-4))) fail_msg("run %d: %g", run, error);
        // Without solids the launches are as before.
        NEED(patch_device_solids(patches, NULL, NULL, 0, &failure));
        NEED(patch_device_step(patches, (int[]){5, 5}, &failure));
        for (int t = 0; t < 5; t++) step_host(host, NULL);
        assert_true(difference(patches, 1, host) < 3e-3);
        patch_host_free(host);
        patch_device_free(patches);
    }
}

// A law of the caller's: a bed of springs without a length, force 50 up and stiffness 1000 at all nodes.
static bool bed_on_device(void *context, PatchDevice *patches, cl_mem nodes, cl_mem touch, cl_mem kappa, Failure *why)
{
    int side = *(int *)context;
    size_t grid = (size_t)side * side * sizeof(float);
    float push = 50, stiffness = 1000;
    clEnqueueFillBuffer(device->queue, touch, &push, sizeof push, 2 * grid, grid, 0, NULL, NULL);
    clEnqueueFillBuffer(device->queue, kappa, &stiffness, sizeof stiffness, 0, grid, 0, NULL, NULL);
    return true;
}

static void bed_on_host(void *context, const PatchTouch *touch)
{
    for (int k = 0; k < touch->nodes * touch->nodes; k++) {
        touch->force[2][k] += 50;
        touch->stiffness[k] += 1000;
    }
}

static void laws_agree_with_host(void **state)
{
    int nodes = 14;
    PatchModel model = patch_model_base(nodes);
    PatchDevice *patches = make(nodes, 1);
    PatchHost *host = host_of(&model);
    patch_device_law(patches, bed_on_device, &nodes);
    NEED(patch_device_step(patches, (int[]){20}, &failure));
    for (int t = 0; t < 20; t++) step_host(host, &(PatchDrive){.contact = bed_on_host});
    assert_true(difference(patches, 0, host) < 1e-5);
    patch_host_free(host);
    patch_device_free(patches);
}

// ---- the device's own promises

// A batch that differs in all but patch `which`, which is case 3c; its places after 20 steps, launched in pieces of
// `piece`.
static void run_batch(int count, int which, int piece, double *x[3])
{
    enum { nodes = 33 };
    PatchDevice *patches = make(nodes, count);
    int *steps = calloc((size_t)count, sizeof *steps);
    for (int k = 0; k < count; k++) {
        const PatchCase *one = &patch_cases[k == which ? 6 : k % PATCH_CASES];
        PatchModel model = patch_case_model(one, nodes, 1e-3);
        PatchEdges *edges = patch_case_edges(one, nodes);
        NEED(patch_device_model(patches, k, &model, &failure));
        NEED(patch_device_start(patches, k, edges, NULL, NULL, &failure));
        patch_edges_free(edges);
        steps[k] = piece;
    }
    for (int done = 0; done < 20; done += piece) NEED(patch_device_step(patches, steps, &failure));
    read_places(patches, which, nodes, x);
    free(steps);
    patch_device_free(patches);
}

static void bits_do_not_depend_on_launches(void **state)
{
    double *whole[3], *other[3];
    run_batch(1, 0, 20, whole);
    for (int k = 0; k < 2; k++) {
        run_batch(k ? 1 : 5, k ? 0 : 3, k ? 1 : 5, other);
        assert_memory_equal(whole[0], other[0], 3 * 33 * 33 * sizeof(double));
        free(other[0]);
    }
    free(whole[0]);
}

static void checkpoints_continue_bit_for_bit(void **state)
{
    enum { nodes = 17 };
    for (int scheme = 0; scheme < 2; scheme++) {
        PatchModel model = patch_case_model(&patch_cases[5], nodes, 1e-3);
        model.scheme = scheme;
        PatchEdges *edges = patch_case_edges(&patch_cases[5], nodes);
        PatchDevice *patches = make(nodes, 2), *others = make(nodes, 2);
        for (int k = 0; k < 2; k++) {
            NEED(patch_device_model(patches, k, &model, &failure));
            NEED(patch_device_model(others, k, &model, &failure));
        }
        NEED(patch_device_edges(patches, 1, edges, &failure));
        NEED(patch_device_step(patches, (int[]){4, 7}, &failure));
        // Edges that have been told but not stepped to belong to the state.
        edges->position[PATCH_U0][2][5] = 0.3;
        NEED(patch_device_edges(patches, 1, edges, &failure));
        size_t size = patch_device_save(patches, 0, NULL, 0, &failure);
        unsigned char *bytes = malloc(size);
        // Patches take each other's: here they change places.
        for (int k = 0; k < 2; k++) {
            assert_int_equal(patch_device_save(patches, k, bytes, size, &failure), size);
            NEED(patch_device_restore(others, 1 - k, bytes, size, &failure));
        }
        NEED(patch_device_step(patches, (int[]){9, 6}, &failure));
        NEED(patch_device_step(others, (int[]){6, 9}, &failure));
        for (int k = 0; k < 2; k++) {
            double *x[3], *y[3];
            read_places(patches, k, nodes, x);
            read_places(others, 1 - k, nodes, y);
            assert_memory_equal(x[0], y[0], 3 * nodes * nodes * sizeof(double));
            assert_true(patch_device_time(patches, k) == patch_device_time(others, 1 - k));
            free(x[0]);
            free(y[0]);
        }
        bytes[size - 3] ^= 4;
        assert_false(patch_device_restore(others, 1, bytes, size, &failure));
        assert_false(patch_device_restore(others, 1, bytes, size / 2, &failure));
        free(bytes);
        patch_edges_free(edges);
        patch_device_free(patches);
        patch_device_free(others);
    }
}

static void divergence_is_caught(void **state)
{
    enum { nodes = 81 };
    PatchDevice *patches = make(nodes, 3);
    PatchModel model = patch_case_model(&patch_cases[3], nodes, 1e-3), base = patch_model_base(nodes);
    assert_false(patch_device_model(patches, 0, &model, &failure));
    assert_non_null(strstr(failure.text, "not positive definite on 81 nodes"));
    model.insist = true;
    NEED(patch_device_model(patches, 0, &model, &failure));
    // The second patch gets a force that is not a number, the third is well.
    size_t grid = nodes * nodes;
    double *force = calloc(grid, sizeof *force);
    force[grid / 2] = NAN;
    NEED(patch_device_force(patches, 1, (const double *const[3]){NULL, force, NULL}, &failure));
    NEED(patch_device_step(patches, (int[]){30, 30, 30}, &failure));
    double *x = malloc(3 * grid * sizeof *x), *places[3] = {x, x + grid, x + 2 * grid};
    for (int k = 0; k < 3; k++) {
        PatchFault fault;
        NEED(patch_device_read(patches, k, places, NULL, &fault, &failure));
        assert_true((fault.kind != PATCH_FINE) == (k < 2));
        if (k == 1) assert_true(fault.kind == PATCH_DIVERGED && fault.component == 1 && fault.step == 0);
        if (k < 2) assert_true(fault.text[0] != 0);
        for (size_t t = 0; t < 3 * grid; t++) assert_true(fabs(x[t]) < 1e6);
    }
    // Nothing that it is given lets it forget that. Told to, it goes on from the last good shape.
    PatchFault fault;
    base.force[2] = 700;
    NEED(patch_device_model(patches, 1, &base, &failure));
    NEED(patch_device_force(patches, 1, (const double *const[3]){NULL, NULL, NULL}, &failure));
    NEED(patch_device_step(patches, (int[]){0, 30, 0}, &failure));
    NEED(patch_device_read(patches, 1, NULL, NULL, &fault, &failure));
    assert_int_equal(fault.kind, PATCH_DIVERGED);
    patch_device_resume(patches, 1);
    NEED(patch_device_step(patches, (int[]){0, 30, 0}, &failure));
    NEED(patch_device_read(patches, 1, places, NULL, &fault, &failure));
    assert_int_equal(fault.kind, PATCH_FINE);
    assert_true(fabs(x[2 * grid + grid / 2]) > 0.1);
    // A limit that a healthy patch passes.
    base.limit = 1e-3;
    NEED(patch_device_model(patches, 2, &base, &failure));
    NEED(patch_device_step(patches, (int[]){0, 0, 5}, &failure));
    NEED(patch_device_read(patches, 2, NULL, NULL, &fault, &failure));
    assert_int_equal(fault.kind, PATCH_DIVERGED);
    assert_int_equal(fault.step, 30);
    free(x);
    free(force);
    patch_device_free(patches);
}

// Every number of the model changes before every step: no kernel is built, and the shape is the host's.
static void handles_are_free(void **state)
{
    enum { nodes = 17 };
    char folder[] = "/tmp/scn-patch-XXXXXX", command[64];
    assert_non_null(mkdtemp(folder));
    setenv("XDG_CACHE_HOME", folder, 1);
    reopen_device();
    PatchDevice *patches = make(nodes, 1);
    PatchModel model = patch_model_base(nodes);
    PatchHost *host = host_of(&model);
    int builds = patch_device_builds(patches);
    assert_int_equal(builds, 1);
    for (int t = 0; t < 20; t++) {
        model.step = 1e-3 * (1 + 0.1 * (t % 5));
        model.density = 0.1 + 0.01 * t;
        model.damping = 1 + 0.3 * t;
        model.force[2] = 800 - 30 * t;
        model.stiffness[2] = (PatchStiffness){1 + 0.1 * t, 2 - 0.1 * t, 1 + 0.05 * t};
        model.scheme = t / 10;
        NEED(patch_device_model(patches, 0, &model, &failure));
        NEED(patch_host_model(host, &model, &failure));
        NEED(patch_device_step(patches, (int[]){1}, &failure));
        step_host(host, NULL);
        assert_true(patch_device_time(patches, 0) == host->time);
    }
    assert_true(difference(patches, 0, host) < 1e-5);
    assert_int_equal(patch_device_builds(patches), builds);
    patch_host_free(host);
    // What is stored is not built again.
    NEED(patch_device_store(patches, &failure));
    patch_device_free(patches);
    reopen_device();
    patches = make(nodes, 1);
    assert_int_equal(patch_device_builds(patches), 0);
    PatchModel base = patch_model_base(nodes);
    host = host_of(&base);
    NEED(patch_device_step(patches, (int[]){3}, &failure));
    for (int t = 0; t < 3; t++) step_host(host, NULL);
    assert_true(difference(patches, 0, host) < 1e-5);
    patch_host_free(host);
    patch_device_free(patches);
    snprintf(command, sizeof command, "rm -rf %s", folder);
    assert_int_equal(system(command), 0);
}

// Steps up to 10⁶ s from rest end at the static shape and never leave 1.1 of it.
static void stable_for_every_step(void **state)
{
    enum { nodes = 33 };
    PatchModel model = patch_model_base(nodes), still = model;
    still.density = still.damping = 0;
    PatchHost *host = host_of(&still);
    step_host(host, NULL);
    PatchDevice *patches = make(nodes, 1);
    for (double dt = 1; dt < 2e6; dt *= 1000) {
        model.step = dt;
        NEED(patch_device_model(patches, 0, &model, &failure));
        NEED(patch_device_start(patches, 0, NULL, NULL, NULL, &failure));
        for (int t = 0; t < 10; t++) {
            NEED(patch_device_step(patches, (int[]){1}, &failure));
            double *x[3];
            read_places(patches, 0, nodes, x);
            assert_true(fabs(x[2][16 * 34]) < 1.1 * host->x[2][16 * 34]);
            free(x[0]);
        }
        NEED(patch_device_step(patches, (int[]){20}, &failure));
        assert_true(difference(patches, 0, host) < 2e-5);
    }
    // The static shape itself, in one step; and c = 0, for which the preconditioner is the operator.
    still.stiffness[2].c = 0;
    NEED(patch_host_model(host, &still, &failure));
    step_host(host, NULL);
    NEED(patch_device_model(patches, 0, &still, &failure));
    NEED(patch_device_step(patches, (int[]){1}, &failure));
    PatchResult result;
    NEED(patch_device_result(patches, 0, 2, &result, &failure));
    assert_true(result.iterations <= 2);
    assert_true(difference(patches, 0, host) < 2e-5);
    patch_host_free(host);
    patch_device_free(patches);
}

static void small_patches(void **state)
{
    const int sizes[] = {6, 5, 9};
    for (int s = 0; s < (small_only ? 1 : 3); s++) {
        int nodes = sizes[s];
        PatchPin pins[2] = {{2, 2, {0.4, 0.3, 0.2}}, {3, 2, {0.7, 0.3, 0.3}}};
        PatchModel model = patch_case_model(&patch_cases[6], nodes, 1e-3);
        model.pins = pins;
        model.pin_count = s == 1 ? 0 : 2;
        PatchEdges *edges = patch_case_edges(&patch_cases[6], nodes);
        PatchDevice *patches = make(nodes, 1);
        PatchHost *host = host_of(&model);
        NEED(patch_device_model(patches, 0, &model, &failure));
        NEED(patch_device_start(patches, 0, edges, NULL, NULL, &failure));
        patch_host_start(host, edges, NULL, NULL);
        double *force = calloc((size_t)nodes * nodes, sizeof *force);
        force[nodes + 1] = 500;
        NEED(patch_device_force(patches, 0, (const double *const[3]){NULL, NULL, force}, &failure));
        for (int t = 0; t < 2; t++) {
            PatchSolid ball = ball_at(0.5, 0.5, 0.45, 0.5, 1e4);
            NEED(patch_device_solids(patches, &ball, (int[]){0}, t, &failure));
            NEED(patch_device_step(patches, (int[]){1}, &failure));
            PatchSolids solids = {&ball, t};
            step_host(host,
                      &(PatchDrive){.force = {NULL, NULL, force}, .contact = patch_contact_solids, .context = &solids});
        }
        double error = difference(patches, 0, host);
        if (!(error < 1e-5)) fail_msg("%d nodes: %g", nodes, error);
        free(force);
        patch_edges_free(edges);
        patch_host_free(host);
        patch_device_free(patches);
    }
}

static int open_narrow(void **state)
{
    small_only = true;
    device = device_open(&(DeviceDesc){.choice = "0", .width = 1}, &failure);
    return 0;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(small_patches),
        cmocka_unit_test(eleven_cases_agree_with_host),
        cmocka_unit_test(all_that_moves_agrees_with_host),
        cmocka_unit_test(pins_agree_with_host),
        cmocka_unit_test(solids_agree_with_host),
        cmocka_unit_test(laws_agree_with_host),
        cmocka_unit_test(bits_do_not_depend_on_launches),
        cmocka_unit_test(checkpoints_continue_bit_for_bit),
        cmocka_unit_test(divergence_is_caught),
        cmocka_unit_test(handles_are_free),
        cmocka_unit_test(stable_for_every_step),
    };
    const struct CMUnitTest small[] = {cmocka_unit_test(small_patches)};
    if (argc > 1 && !strcmp(argv[1], "small"))
        return cmocka_run_group_tests_name("patch device, width 1", small, open_narrow, close_device);
    return cmocka_run_group_tests_name("patch device", tests, open_device, close_device);
}
