// Patches of a scene, solved to a time by each solver: from the start, on the way, from a checkpoint, and where there is none.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "runtime/patch_cache.h"
#include "runtime/patch_scene.h"
#include "runtime/scene.h"

static const char steady[] =
    "patch p { grid: 9; edge(u: 0) { position: spline([(0, 0, 0), (0, 0.5, 0.2), (0, 1, 0)], v); } }\np;\n";
static const char moving[] =
    "patch p { grid: 9; damping: 1 + time / 1s; force: (0, 0, 800 * u * cos(360deg * (time / 100ms))); }\np;\n";
static const char touched[] =
    "patch p { grid: 9; scheme: \"newmark\"; force: (0, 0, 100 * z); pin(0.5, 0.5, to: (0.5, 0.5, 0.1));\n"
    "    press(by: bump(radius: 0.2, height: 0.1), u: 0.3, v: 0.7, strength: 500);\n"
    "    contact(with: sphere(0.4).move(0.7, 0.3, -0.45 + time / 1s), stiffness: 1000); }\np;\n";
static const char accurate[] =
    "patch p { grid: 9; closure: \"accurate\"; edge(u: 1) { tangent: 3; } pin(0.3, 0.5, to: (0.3, 0.5, 0.2)); }\np;\n";
static const char *const scenes[] = {steady, moving, touched, accurate};

typedef struct Bench {
    ScnScene *scene;
    Device *device;
} Bench;

static Bench bench_new(const char *text)
{
    Failure failure;
    Bench bench = {.device = device_open(&(DeviceDesc){.choice = "cpu"}, &failure)};
    assert_non_null(bench.device);
    bench.scene = scn_load(&(ScnSceneDesc){.bytes = text, .size = strlen(text), .check_only = true});
    if (scn_status(bench.scene) != SCN_OK) print_message("%s\n", scn_diagnostics_text(bench.scene, false));
    assert_int_equal(scn_status(bench.scene), SCN_OK);
    return bench;
}

static void bench_free(Bench *bench)
{
    scn_free(bench->scene);
    device_close(bench->device);
}

static PatchSolve *solve_new(const Bench *bench, PatchMethod method, bool cached)
{
    Failure failure;
    PatchSolveDesc desc = {.fps = 24, .method = method, .device = bench->device, .cached = cached};
    PatchSolve *solve = patch_solve_new(&bench->scene->package->plan->patches[0], &desc, &failure);
    assert_non_null(solve);
    return solve;
}

static void to(const Bench *bench, PatchSolve *solve, double time)
{
    FrameError error;
    if (!patch_solve_to(solve, time, bench->scene->inputs, &error)) fail_msg("%s", error.text);
}

// Places over nodes at a time, of a solver of its own that goes there by way of `stops` moments.
static double *places(const Bench *bench, PatchMethod method, bool cached, double time, int stops)
{
    PatchSolve *solve = solve_new(bench, method, cached);
    for (int k = 1; k <= stops; k++) to(bench, solve, time * k / (stops + 1.0));
    to(bench, solve, time);
    PatchShape shape = patch_solve_shape(solve);
    size_t grid = (size_t)shape.nodes * (size_t)shape.nodes;
    double *all = malloc(3 * grid * sizeof *all);
    for (int c = 0; c < 3; c++) memcpy(all + (size_t)c * grid, shape.x[c], grid * sizeof *all);
    patch_solve_free(solve);
    return all;
}

enum { PLACES = 3 * 9 * 9 };

static double difference(const double *a, const double *b)
{
    double worst = 0;
    for (int k = 0; k < PLACES; k++) worst = fmax(worst, fabs(a[k] - b[k]));
    return worst;
}

static void the_device_agrees_with_the_host(void **state)
{
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
        Bench bench = bench_new(scenes[k]);
        double *host = places(&bench, PATCH_METHOD_DIRECT, false, 0.0503, 0);
        double *device = places(&bench, PATCH_METHOD_DEVICE, false, 0.0503, 0);
        assert_true(difference(host, device) < 1e-5);
        free(host);
        free(device);
        bench_free(&bench);
    }
}

static int checkpoints(const char *folder)
{
    int count = 0;
    DIR *dir = opendir(folder);
    for (struct dirent *one; dir && (one = readdir(dir));) count += !strncmp(one->d_name, "patch-", 6);
    if (dir) closedir(dir);
    return count;
}

// To the bit: alone, running through, from a checkpoint, and where none can be kept.
static void a_moment_alone_is_that_of_running_through(void **state)
{
    static const PatchMethod methods[] = {PATCH_METHOD_DIRECT, PATCH_METHOD_DEVICE};
    const double time = 0.7004;
    for (size_t k = 0; k < 2 * sizeof scenes / sizeof *scenes; k++) {
        char folder[] = "/tmp/scn-patch-XXXXXX", inside[64], command[64];
        assert_non_null(mkdtemp(folder));
        snprintf(inside, sizeof inside, "%s/scn", folder);
        setenv("XDG_CACHE_HOME", folder, 1);
        Bench bench = bench_new(scenes[k / 2]);
        double *alone = places(&bench, methods[k % 2], false, time, 0);
        assert_int_equal(checkpoints(inside), 0);
        double *through = places(&bench, methods[k % 2], true, time, 30);
        assert_int_equal(checkpoints(inside), 2); // after 256 and 512 of 701 steps
        double *again = places(&bench, methods[k % 2], true, time, 0);
        setenv("XDG_CACHE_HOME", "/dev/null", 1);
        double *nowhere = places(&bench, methods[k % 2], true, time, 3);
        assert_memory_equal(alone, through, PLACES * sizeof *alone);
        assert_memory_equal(alone, again, PLACES * sizeof *alone);
        assert_memory_equal(alone, nowhere, PLACES * sizeof *alone);
        free(alone);
        free(through);
        free(again);
        free(nowhere);
        bench_free(&bench);
        snprintf(command, sizeof command, "rm -r %s", folder);
        assert_int_equal(system(command), 0);
    }
}

static void diverging_is_told_by_each_solver(void **state)
{
    Bench bench =
        bench_new("patch p { grid: 9; density: 0.001; damping: 0; scheme: \"newmark\"; force: (0, 0, 1e12); }\np;\n");
    for (int method = 0; method < 2; method++) {
        FrameError error;
        PatchSolve *solve = solve_new(&bench, (PatchMethod)method, false);
        assert_false(patch_solve_to(solve, 0.5, bench.scene->inputs, &error));
        assert_non_null(strstr(error.text, "diverges"));
        assert_string_equal(diag_code_name(error.code), "patch-diverges");
        patch_solve_free(solve);
    }
    bench_free(&bench);
}

// A force beyond all bounds for a single step: what comes after it does not hide it.
static void a_stop_on_the_way_is_told(void **state)
{
    Bench bench =
        bench_new("patch p { grid: 9; force: (0, 0, if time > 10ms and time < 11.5ms { 1e14 } else { 0 }); }\np;\n");
    for (int method = 0; method < 2; method++) {
        FrameError error;
        PatchSolve *solve = solve_new(&bench, (PatchMethod)method, false);
        assert_false(patch_solve_to(solve, 0.5, bench.scene->inputs, &error));
        assert_non_null(strstr(error.text, "in step 11 "));
        assert_true(patch_solve_to(solve, 0.005, bench.scene->inputs, &error)); // it is solved anew
        patch_solve_free(solve);
    }
    bench_free(&bench);
}

// Of several grids, steps and kinds: those that step together have the bits that they have alone, also where they go back,
// are started by checkpoints, or have been solved to other times before.
static void patches_together_are_as_alone(void **state)
{
    static const char text[] =
        "patch a { grid: 9; force: (0, 0, 100); }\n"
        "patch b { grid: 9; step: 3ms; force: (0, 0, 300); edge(u: 1) { tangent: 1; }; }\n"
        "patch c { grid: 9; force: (0, 0, 800 * cos(360deg * (time / 100ms))); }\n"
        "patch d { grid: 9; step: 0.7ms; force: (0, 0, 800 * u * z); }\n"
        "patch e { grid: 9; contact(with: sphere(0.4).move(0.7, 0.3, -0.45 + time / 1s), stiffness: 1000); }\n"
        "patch f { grid: 9; contact(with: sphere(0.4).move(0.5, 0.5, 0.5), stiffness: 1000); }\n"
        "patch g { grid: 5; }\na; b; c; d; e; f; g;\n";
    enum { COUNT = 7 };
    char folder[] = "/tmp/scn-patch-XXXXXX", command[64];
    assert_non_null(mkdtemp(folder));
    setenv("XDG_CACHE_HOME", folder, 1);
    Bench bench = bench_new(text);
    const Plan *plan = bench.scene->package->plan;
    assert_int_equal(plan->patch_count, COUNT);
    for (int round = 0; round < 2; round++) { // the second finds checkpoints
        PatchSolve *solves[COUNT];
        PatchSolveDesc desc = {.fps = 24, .method = PATCH_METHOD_DEVICE, .device = bench.device, .cached = true};
        Failure failure;
        FrameError error;
        for (int k = 0; k < COUNT; k++) {
            solves[k] = patch_solve_new(&plan->patches[k], &desc, &failure);
            assert_non_null(solves[k]);
        }
        patch_solves_join(solves, COUNT);
        static const double times[] = {0.0503, 0.3, 0.6007, 0.02};
        for (int t = 0; t < 4; t++) {
            assert_true(patch_solves_to(solves, COUNT, times[t], bench.scene->inputs, &error));
            for (int k = 0; k < COUNT; k++) {
                desc.cached = false;
                PatchSolve *alone = patch_solve_new(&plan->patches[k], &desc, &failure);
                assert_true(patch_solve_to(alone, times[t], bench.scene->inputs, &error));
                PatchShape one = patch_solve_shape(alone), many = patch_solve_shape(solves[k]);
                size_t grid = (size_t)one.nodes * (size_t)one.nodes * sizeof(double);
                for (int c = 0; c < 3; c++) assert_memory_equal(one.x[c], many.x[c], grid);
                patch_solve_free(alone);
            }
        }
        for (int k = 0; k < COUNT; k++) patch_solve_free(solves[k]);
    }
    bench_free(&bench);
    snprintf(command, sizeof command, "rm -r %s", folder);
    assert_int_equal(system(command), 0);
}

static void the_oldest_checkpoints_give_way(void **state)
{
    char folder[] = "/tmp/scn-patch-XXXXXX", path[64];
    assert_non_null(mkdtemp(folder));
    for (int k = 0; k < 5; k++) {
        snprintf(path, sizeof path, "%s/%s-%d", folder, k == 4 ? "kernel" : "patch", k);
        FILE *file = fopen(path, "w");
        assert_non_null(file);
        for (int n = 0; n < 1000; n++) fputc('x', file);
        fclose(file);
        const struct timespec times[2] = {{.tv_sec = 1000 - k}, {.tv_sec = 1000 - k}}; // later ones are older
        assert_int_equal(utimensat(0, path, times, 0), 0);
    }
    patch_cache_prune(folder, 4000);
    assert_int_equal(checkpoints(folder), 4);
    patch_cache_prune(folder, 2500);
    assert_int_equal(checkpoints(folder), 2);
    snprintf(path, sizeof path, "%s/patch-0", folder);
    assert_int_equal(access(path, F_OK), 0);
    snprintf(path, sizeof path, "%s/kernel-4", folder);
    assert_int_equal(access(path, F_OK), 0);
    patch_cache_prune(folder, 0);
    assert_int_equal(checkpoints(folder), 0);
    unlink(path);
    rmdir(folder);
    patch_cache_prune(folder, 0); // a folder that is not there is nothing
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_device_agrees_with_the_host),  cmocka_unit_test(a_moment_alone_is_that_of_running_through),
        cmocka_unit_test(diverging_is_told_by_each_solver), cmocka_unit_test(a_stop_on_the_way_is_told),
        cmocka_unit_test(patches_together_are_as_alone),    cmocka_unit_test(the_oldest_checkpoints_give_way),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
