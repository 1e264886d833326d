// The benchmark: `./dev bench [FOLDER]`.
//
//     scn-bench --scn SCN --work FOLDER [--size N] [--repeat N] [--stride N] [--no-pov] [--no-rays] [SCENES]
//
// SCENES is a folder of S1.json … S5.json; without it five scenes of the same kinds are made by a seeded generator. Everything is written to the work folder and
// left there to look at: the scenes as SCN and for POV-Ray, pictures, bench.json. All that is compared is measured in one run, by the CPU time of its
// process, in rounds: one thread, two threads, the reference, and again, so that what else the machine does meets all of them alike. Figures are medians of
// the rounds, ratios the medians of the ratios of each round.
//
//   cpu           CPU time of a frame of N x N, one primary and one shadow ray, one thread; scn bench, the median of the frames of a round
//   two           wall time with one thread divided by wall time with two
//   build, start  the kernels' build and the time to the end of the first frame, without the cache and the stock of kernels (runtime/program.h)
//   reference     the plain scalar double renderer (tests/oracle), every 8th pixel of every 8th line, times 64
//   noise         how far the rounds' ratios to the reference are apart; where wall time is much more than CPU time, others use the
//                 processors too, and "two" tells nothing: it has a question mark then
//   POV-Ray       its trace time (its own words) at the same size, one thread; where `povray` is installed
//
// Then once: package to first picture with empty caches, source to first picture with empty caches, a union of 10,000 spheres, 100,000 quadrics, 10,000
// uses of one form and as many forms, 100,000 scattered balls, 54 slabs in one free form, a free form that a patch displaces, 240 frames of a form that moves, with one kernel, general fields
// (colonnade.vm and bear.vm in or beside the folder of the scenes), and a million random rays against the oracle.
#include <cjson/cJSON.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "tests/bench/scene.h"

typedef struct Options {
    const char *scn, *work, *folder;
    char tools[512]; // the folder of scn-oracle and scn-property
    int size, repeat, stride;
    bool pov, rays;
} Options;

typedef struct Outcome { // of a command
    int status;
    double cpu_ms, wall_ms, peak_mb;
    char *out; // its standard output and error
} Outcome;

typedef struct Row {
    const char *name;
    double cpu, wall_one, wall_two, rays_per_s, build, start, reference, pov, peak_mb;
    double two, times; // medians of ratios
    double noise;      // of `times`: what the rounds are apart, over their median
    bool busy;
} Row;

#define ROUNDS 5
#define BUSY   1.15 // wall time over CPU time of one thread, beyond which others use its processor

// -- processes -----------------------------------------------------------------------------------------------------------------

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static char *read_rest(int fd)
{
    size_t length = 0, capacity = 1 << 16;
    char *text = malloc(capacity);
    for (;;) {
        if (!text) abort();
        ssize_t n = read(fd, text + length, capacity - length - 1);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        length += (size_t)n;
        if (length + 1 == capacity) text = realloc(text, capacity *= 2);
    }
    text[length] = 0;
    return text;
}

// Runs a command line of words, ended by NULL. `cache` NULL: the caches of the user; else a folder for all caches.
static Outcome run(const char *cache, const char *const *argv)
{
    Outcome outcome = {0};
    int out[2];
    if (pipe(out)) abort();
    double begin = now_ms();
    pid_t child = fork();
    if (child == 0) {
        dup2(out[1], 1);
        dup2(out[1], 2);
        close(out[0]);
        close(out[1]);
        if (cache) setenv("POCL_CACHE_DIR", cache, 1), setenv("XDG_CACHE_HOME", cache, 1);
        execvp(argv[0], (char *const *)argv);
        _exit(127);
    }
    close(out[1]);
    outcome.out = read_rest(out[0]);
    close(out[0]);
    struct rusage used;
    int status;
    while (wait4(child, &status, 0, &used) < 0 && errno == EINTR) continue;
    outcome.wall_ms = now_ms() - begin;
    outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
    outcome.cpu_ms = (double)(used.ru_utime.tv_sec + used.ru_stime.tv_sec) * 1e3 +
                     (double)(used.ru_utime.tv_usec + used.ru_stime.tv_usec) * 1e-3;
    outcome.peak_mb = (double)used.ru_maxrss / 1024;
    if (outcome.status)
        fprintf(stderr, "%s %s %s failed (%d):\n%.2000s\n", argv[0], argv[1], argv[2] ? argv[2] : "", outcome.status,
                outcome.out);
    return outcome;
}

static int remove_entry(const char *path, const struct stat *info, int kind, struct FTW *walk)
{
    return remove(path);
}

// An empty folder for caches.
static const char *fresh_cache(const Options *o, char path[600])
{
    snprintf(path, 600, "%s/cache", o->work);
    nftw(path, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
    mkdir(path, 0777);
    return path;
}

static double field(const char *json, const char *key)
{
    const char *brace = strchr(json, '{'); // diagnostics may stand before it
    cJSON *object = brace ? cJSON_Parse(brace) : NULL;
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    double value = cJSON_IsNumber(item) ? item->valuedouble : 0;
    cJSON_Delete(object);
    return value;
}

// -- one scene -----------------------------------------------------------------------------------------------------------------

static void work_path(const Options *o, const char *name, const char *suffix, char path[600])
{
    snprintf(path, 600, "%s/%s%s", o->work, name, suffix);
}

static void write_scene(const BenchScene *scene, const char *path, void (*write)(const BenchScene *, FILE *))
{
    FILE *file = fopen(path, "w");
    if (!file) {
        perror(path);
        exit(3);
    }
    write(scene, file);
    fclose(file);
}

static Outcome bench_frames(const Options *o, const char *cache, const char *path, const char *threads, int frames)
{
    char size[32], repeat[16];
    snprintf(size, sizeof size, "%dx%d", o->size, o->size);
    snprintf(repeat, sizeof repeat, "%d", frames);
    return run(cache, (const char *[]){o->scn, "bench", path, "--size", size, "--repeat", repeat, "--threads", threads,
                                       "--json", NULL});
}

static Outcome bench(const Options *o, const char *cache, const char *path, const char *threads)
{
    return bench_frames(o, cache, path, threads, o->repeat);
}

// Two frames with kernels that are compiled for them.
static Outcome bench_build(const Options *o, const char *cache, const char *path)
{
    char size[32];
    snprintf(size, sizeof size, "%dx%d", o->size, o->size);
    return run(cache, (const char *[]){o->scn, "bench", path, "--size", size, "--repeat", "1", "--threads", "1",
                                       "--no-cache", "--json", NULL});
}

static double reference(const Options *o, const char *path)
{
    char tool[600], size[32], stride[16];
    snprintf(tool, sizeof tool, "%s/scn-oracle", o->tools);
    snprintf(size, sizeof size, "%dx%d", o->size, o->size);
    snprintf(stride, sizeof stride, "%d", o->stride);
    Outcome outcome = run(NULL, (const char *[]){tool, path, "--size", size, "--stride", stride, "--samples", "8",
                                                 "--bias", "1e-3", NULL});
    double ms = field(outcome.out, "frame_cpu_ms");
    free(outcome.out);
    return ms;
}

static double pov(const Options *o, const BenchScene *scene)
{
    char path[600], in[620], out[620], width[16], height[16];
    work_path(o, scene->name, ".pov", path);
    write_scene(scene, path, bench_write_pov);
    snprintf(in, sizeof in, "+I%s", path);
    work_path(o, scene->name, "-pov.png", path);
    snprintf(out, sizeof out, "+O%s", path);
    snprintf(width, sizeof width, "+W%d", o->size);
    snprintf(height, sizeof height, "+H%d", o->size);
    Outcome outcome = run(NULL, (const char *[]){"povray", in, out, width, height, "+WT1", "-D", "+FN", NULL});
    const char *mark = strstr(outcome.out, "Trace Time:");
    mark = mark ? strchr(mark, '(') : NULL;
    double ms = mark ? 1e3 * atof(mark + 1) : 0;
    free(outcome.out);
    return ms;
}

static double over(double a, double b)
{
    return b > 0 ? a / b : 0;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

// Sorts them.
static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, compare_doubles);
    return count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}

// The building of a scene's kernels, and all rounds.
static Row measure(const Options *o, const BenchScene *scene)
{
    Row row = {.name = scene->name};
    double cpu[ROUNDS], one[ROUNDS], two[ROUNDS], reference_ms[ROUNDS], faster[ROUNDS], times[ROUNDS], rays[ROUNDS],
        busy[ROUNDS];
    int rounds = o->repeat < ROUNDS ? o->repeat : ROUNDS, frames = (o->repeat + rounds - 1) / rounds;
    char path[600], cache[600];
    work_path(o, scene->name, ".scn", path);
    write_scene(scene, path, bench_write_scn);
    Outcome built = bench_build(o, fresh_cache(o, cache), path);
    row.build = field(built.out, "build_ms");
    row.start = field(built.out, "start_up_ms");
    row.peak_mb = built.peak_mb;
    free(built.out);
    for (int k = 0; k < rounds; k++) {
        Outcome single = bench_frames(o, cache, path, "1", frames), both = bench_frames(o, cache, path, "2", frames);
        cpu[k] = field(single.out, "cpu_ms");
        one[k] = field(single.out, "wall_ms");
        two[k] = field(both.out, "wall_ms");
        rays[k] = field(single.out, "rays_per_s");
        reference_ms[k] = reference(o, path);
        faster[k] = over(one[k], two[k]);
        times[k] = over(reference_ms[k], cpu[k]);
        busy[k] = over(one[k], cpu[k]);
        free(single.out), free(both.out);
    }
    row.cpu = median(cpu, rounds);
    row.wall_one = median(one, rounds);
    row.wall_two = median(two, rounds);
    row.rays_per_s = median(rays, rounds);
    row.reference = median(reference_ms, rounds);
    row.two = median(faster, rounds);
    row.times = median(times, rounds);
    row.noise = over(times[rounds - 1] - times[0], row.times);
    row.busy = median(busy, rounds) > BUSY;
    if (o->pov) row.pov = pov(o, scene);
    return row;
}

static void print_head(const Options *o)
{
    printf("%dx%d, one primary and one shadow ray, one thread; the reference every %dth pixel of every %dth line, "
           "scaled\n\n",
           o->size, o->size, o->stride, o->stride);
    printf("%-6s %10s %7s %9s %10s %10s %9s %12s %8s %6s %12s %8s\n", "scene", "CPU ms", "two ", "Mrays/s", "build ms",
           "start ms", "peak MB", "reference ms", "times", "noise", "POV-Ray ms", "times");
}

static void print_row(const Row *r)
{
    printf("%-6s %10.2f %6.2f%c %9.1f %10.1f %10.1f %9.1f %12.0f %8.1f %5.0f%% ", r->name, r->cpu, r->two,
           r->busy ? '?' : ' ', r->rays_per_s * 1e-6, r->build, r->start, r->peak_mb, r->reference, r->times,
           100 * r->noise);
    if (r->pov > 0)
        printf("%12.0f %8.1f\n", r->pov, over(r->pov, r->cpu));
    else
        printf("%12s %8s\n", "-", "-");
    fflush(stdout);
}

static cJSON *row_json(const Row *r)
{
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "scene", r->name);
    cJSON_AddNumberToObject(json, "cpu_ms", r->cpu);
    cJSON_AddNumberToObject(json, "wall_ms_one_thread", r->wall_one);
    cJSON_AddNumberToObject(json, "wall_ms_two_threads", r->wall_two);
    cJSON_AddNumberToObject(json, "rays_per_s", r->rays_per_s);
    cJSON_AddNumberToObject(json, "kernel_build_ms", r->build);
    cJSON_AddNumberToObject(json, "start_up_ms", r->start);
    cJSON_AddNumberToObject(json, "peak_mb", r->peak_mb);
    cJSON_AddNumberToObject(json, "reference_cpu_ms", r->reference);
    cJSON_AddNumberToObject(json, "times_faster_than_reference", r->times);
    cJSON_AddNumberToObject(json, "times_noise", r->noise);
    cJSON_AddNumberToObject(json, "two_threads_over_one", r->two);
    cJSON_AddBoolToObject(json, "machine_busy", r->busy);
    if (r->pov > 0) cJSON_AddNumberToObject(json, "povray_trace_ms", r->pov);
    return json;
}

// -- what is measured once -----------------------------------------------------------------------------------------------------

// Prints a line and keeps it.
static void note(cJSON *json, const char *key, double value, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
static void note(cJSON *json, const char *key, double value, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vprintf(format, list);
    va_end(list);
    putchar('\n');
    fflush(stdout);
    cJSON_AddNumberToObject(json, key, value);
}

static void first_pictures(const Options *o, const char *name, cJSON *json)
{
    char scene[600], package[600], picture[600], cache[600];
    work_path(o, name, ".scn", scene);
    work_path(o, name, ".scnk", package);
    work_path(o, name, "-first.png", picture);
    Outcome built = run(NULL, (const char *[]){o->scn, "build", scene, "-o", package, "-q", NULL});
    Outcome loaded = run(fresh_cache(o, cache),
                         (const char *[]){o->scn, "run", package, "-o", picture, "--size", "512x512", "-q", NULL});
    Outcome cold = run(fresh_cache(o, cache),
                       (const char *[]){o->scn, "render", scene, "-o", picture, "--size", "512x512", "-q", NULL});
    note(json, "package_first_image_cpu_ms", loaded.cpu_ms,
         "package to a 512x512 picture on disk, empty caches: %.0f ms CPU, %.0f ms wall (at most 150)", loaded.cpu_ms,
         loaded.wall_ms);
    Outcome compiled = run(fresh_cache(o, cache), (const char *[]){o->scn, "render", scene, "-o", picture, "--size",
                                                                   "512x512", "-q", "--no-cache", NULL});
    note(json, "source_first_image_compiled_cpu_ms", compiled.cpu_ms,
         "the same with kernels that are not in the stock: %.0f ms CPU, %.0f ms wall", compiled.cpu_ms,
         compiled.wall_ms);
    free(compiled.out);
    note(json, "source_first_image_cpu_ms", cold.cpu_ms,
         "source to a 512x512 picture on disk, empty caches: %.0f ms CPU, %.0f ms wall (at most 1500)", cold.cpu_ms,
         cold.wall_ms);
    free(built.out), free(loaded.out), free(cold.out);
}

// Ten thousand uses of a form of 50 perturbations: as one branch, whose perturbations are there once, and as forms of their own.
static void copies(const Options *o, bool shared, cJSON *json)
{
    const char *name = shared ? "copies-10000" : "forms-10000";
    char path[600], cache[600], key[64];
    work_path(o, name, ".scn", path);
    FILE *out = fopen(path, "w");
    if (!out) return;
    fprintf(
        out,
        "scn 1;\ncamera { eye: (0, -120, 90); up: (0, 0, 1); }\nlight { direction: (-0.4, 0.6, -1); }\n"
        "tag make() { freeform(sphere(0.35)) { for i in 0 .. 50 {\n"
        "    let at = spherical(0.32, 137.5deg * i, asin(-0.98 + 0.04 * i));\n"
        "    perturb(sphere(0.12).move(at.x, at.y, at.z), strength: 120 * (1 - 2 * mod(i, 2)));\n} } }\n%s\n"
        "for i in 0 .. 100 { for j in 0 .. 100 {\n"
        "    form%s.rotate(z: 7deg * i, x: 11deg * j).move(i - 50, j - 50, 0).paint(hsv(3.6deg * i, 0.5, 0.8));\n} }\n",
        shared ? "let form = make();" : "tag form() { make() }", shared ? "" : "()");
    fclose(out);
    Outcome frame = bench(o, fresh_cache(o, cache), path, "5");
    double front = field(frame.out, "load_ms"), cpu = field(frame.out, "cpu_ms");
    double device = field(frame.out, "device_bytes") * 1e-6;
    snprintf(key, sizeof key, "%s_peak_mb", name);
    note(json, key, frame.peak_mb,
         "%s: front end and compiler %.0f ms, a frame %.1f ms CPU, %.0f MB on the device, %.0f MB", name, front, cpu,
         device, frame.peak_mb);
    snprintf(key, sizeof key, "%s_frame_cpu_ms", name);
    cJSON_AddNumberToObject(json, key, cpu);
    snprintf(key, sizeof key, "%s_device_mb", name);
    cJSON_AddNumberToObject(json, key, device);
    free(frame.out);
}

static void big_union(const Options *o, Arena *arena, int count, bool balls, cJSON *json)
{
    BenchScene scene;
    char name[32], path[600], cache[600], key[64];
    snprintf(name, sizeof name, "union-%d", count);
    bench_union(arena, name, count, balls, 2001, &scene);
    work_path(o, name, ".scn", path);
    write_scene(&scene, path, bench_write_scn);
    Outcome check = run(NULL, (const char *[]){o->scn, "check", path, NULL});
    Outcome built = bench_build(o, fresh_cache(o, cache), path), frame = bench(o, NULL, path, "1");
    double front = field(frame.out, "load_ms"), build = field(built.out, "build_ms"), cpu = field(frame.out, "cpu_ms");
    snprintf(key, sizeof key, "%s_check_cpu_ms", name);
    note(json, key, check.cpu_ms,
         "%s: check %.0f ms CPU, %.0f MB; to render: front end and compiler %.0f ms, kernels %.0f ms, a frame %.1f ms, "
         "%.0f MB",
         name, check.cpu_ms, check.peak_mb, front, build, cpu, frame.peak_mb);
    snprintf(key, sizeof key, "%s_load_ms", name);
    cJSON_AddNumberToObject(json, key, front);
    snprintf(key, sizeof key, "%s_kernel_build_ms", name);
    cJSON_AddNumberToObject(json, key, build);
    snprintf(key, sizeof key, "%s_peak_mb", name);
    cJSON_AddNumberToObject(json, key, frame.peak_mb);
    free(check.out), free(built.out), free(frame.out);
}

// What lists and free forms of many perturbations cost: thousands of balls far apart, where the shadow rays of a packet have nothing in common, and grooves,
// which no box bounds.
#define CROWD_HEAD                                                                                                     \
    "scn 1;\ncamera { eye: (14, 12, 30); look_at: (0, 0, 0); fov: 40deg; }\n"                                          \
    "light sun { direction: (-0.9, -1, -0.35); }\n"
#define GROOVE(axis) "            perturb(slab(" axis ": at - 0.2 .. at + 0.2), strength: -8000);\n"
static const char *const crowds[][2] = {
    // a name and a scene
    {"scattered-100000",
     CROWD_HEAD "fn hash(k: scalar) -> scalar { mod(sin(k * 12.9898rad) * 43758.5453, 1) }\n"
                "scene {\n"
                "    for k in 0..100000 {\n"
                "        sphere(0.03).move(20 * hash(k) - 10, 20 * hash(k + 0.37) - 10, 20 * hash(k + 0.71) - 10);\n"
                "    }\n}\n"},
    {"slabs-54", CROWD_HEAD
     "scene {\n    freeform(sphere(9)) {\n        for k in 0..18 {\n            let at = -7.65 + 0.9 * k;\n" GROOVE("x")
         GROOVE("y") GROOVE("z") "        }\n    }\n}\n"},
};

static void big_crowd(const Options *o, const char *const crowd[2], cJSON *json)
{
    char path[600], key[64];
    work_path(o, crowd[0], ".scn", path);
    FILE *file = fopen(path, "w");
    if (!file) {
        fprintf(stderr, "cannot write %s: %s\n", path, strerror(errno));
        return;
    }
    fputs(crowd[1], file);
    fclose(file);
    Outcome frame = bench(o, NULL, path, "1");
    snprintf(key, sizeof key, "%s_frame_cpu_ms", crowd[0]);
    note(json, key, field(frame.out, "cpu_ms"), "%s: a frame %.1f ms CPU, %.0f MB", crowd[0],
         field(frame.out, "cpu_ms"), frame.peak_mb);
    free(frame.out);
}

// What a displacement costs: a free form, and the same with a patch on most of what is seen of it, as it starts.
#define DISPLACED_BODY                                                                                                 \
    "scn 1;\ncamera { eye: (1.2, -3.2, 2.6); look_at: (0, 0, 0.1); up: (0, 0, 1); fov: 38deg; }\n"                     \
    "light key { direction: (-0.5, 0.8, -1); }\nlight fill { direction: (-0.9, -0.3, -0.4); intensity: 0.35; }\n"      \
    "object body = freeform(ellipsoid(1.1, 0.8, 0.75)) {\n"                                                            \
    "    perturb(sphere(0.55).move(0.9, 0, 0.3), strength: 3);\n"                                                      \
    "    perturb(sphere(0.4).move(-0.6, 0.2, 0.75), strength: -5);\n"                                                  \
    "    perturb(sphere(0.5).move(0.1, -0.75, 0.1), strength: 3);\n};\n"
static const char *const displaced[][2] = {
    {"free-form", DISPLACED_BODY "scene { body; }\n"},
    {"displaced", DISPLACED_BODY
     "patch chest { grid: 33; start: (u, v, 2 * u * (1 - u) * v * (1 - v) * (1 + 0.5 * sin(720deg * u))); }\n"
     "scene { body.displace(by: chest, corner: (-0.5, -0.4, 0), u: (0.9, 0, 0), v: (0, 0.8, 0), caps: 0.2 .. 1.6); "
     "}\n"},
};

static void displacement(const Options *o, cJSON *json)
{
    Options small = *o;
    double cost[2];
    small.size = 512;
    for (int k = 0; k < 2; k++) {
        char path[600];
        work_path(o, displaced[k][0], ".scn", path);
        FILE *file = fopen(path, "w");
        if (!file) {
            fprintf(stderr, "cannot write %s: %s\n", path, strerror(errno));
            return;
        }
        fputs(displaced[k][1], file);
        fclose(file);
        Outcome frame = bench(&small, NULL, path, "1");
        cost[k] = field(frame.out, "cpu_ms");
        free(frame.out);
    }
    note(json, "displaced_over_free_form", cost[1] / cost[0],
         "a displaced free form, 512x512: %.1f ms CPU a frame, %.1f ms without the patch: %.1f times (at most 3)",
         cost[1], cost[0], cost[1] / cost[0]);
}

// General fields: expressions of the benchmark's folder, in its format (`scn import`), seen straight along -z at 1024 x 1024 without a shadow: the first hit
// of every ray and its normal.
static const struct {
    const char *name, *place;
} models[] = {{"colonnade", ".rotate(z: -30deg).rotate(x: -60deg).scale(1 / 0.7)"}, {"bear", ""}};

// What is imported with a camera, in the work folder; false where there is none.
static bool model_scene(const Options *o, size_t k, char scene[600])
{
    char vm[600], model[600], line[256];
    snprintf(vm, sizeof vm, "%s/%s.vm", o->folder, models[k].name);
    if (access(vm, R_OK)) snprintf(vm, sizeof vm, "%s/../%s.vm", o->folder, models[k].name);
    if (access(vm, R_OK)) return false;
    work_path(o, models[k].name, "-model.scn", model);
    work_path(o, models[k].name, ".scn", scene);
    Outcome imported = run(NULL, (const char *[]){o->scn, "import", vm, "-o", model, NULL});
    free(imported.out);
    FILE *in = fopen(model, "r"), *out = fopen(scene, "w");
    bool good = imported.status == 0 && in && out;
    while (good && fgets(line, sizeof line, in)) { // the last line is the field
        fprintf(out, "%s%s", strncmp(line, "field(", 6) ? "" : "object model = ", line);
    }
    if (good)
        fprintf(out,
                "camera { eye: (0, 0, 1); look_at: (0, 0, 0); projection: \"orthographic\"; height: 2; }\n"
                "light key { direction: (-1, -1, -2); shadow: false; }\nscene { model%s; }\n",
                models[k].place);
    if (in) fclose(in);
    if (out) fclose(out);
    return good;
}

// Ten thousand rays of a model against F in double.
static bool model_rays(const Options *o, const char *scene, const char *name, cJSON *json)
{
    char tool[600], key[64];
    snprintf(tool, sizeof tool, "%s/scn-property", o->tools);
    Outcome rays = run(NULL, (const char *[]){tool, "--size", "100", "--sampled", "1000", scene, NULL});
    snprintf(key, sizeof key, "%s_rays_agree", name);
    printf("%s", rays.out);
    cJSON_AddBoolToObject(json, key, rays.status == 0);
    free(rays.out);
    return rays.status == 0;
}

static bool general_fields(const Options *o, cJSON *json)
{
    char scene[600], key[64];
    bool good = true;
    for (size_t k = 0; k < sizeof models / sizeof *models && o->folder; k++) {
        if (!model_scene(o, k, scene)) continue;
        Outcome one = bench(o, NULL, scene, "1"), two = bench(o, NULL, scene, "2");
        snprintf(key, sizeof key, "%s_frame_cpu_ms", models[k].name);
        note(json, key, field(one.out, "cpu_ms"),
             "%s: first hits and normals %.1f ms CPU; %.1f ms wall with two threads", models[k].name,
             field(one.out, "cpu_ms"), field(two.out, "wall_ms"));
        free(one.out), free(two.out);
        if (o->rays) good = model_rays(o, scene, models[k].name, json) && good;
    }
    return good;
}

// A morph of free forms and a tool that follows a ray, both in motion: 240 frames of 512 x 512, as a scene's author sees them.
static const char motion[] =
    "camera { eye: (0.6, 1, 4.5); look_at: (0, 0, 0); fov: 36deg; }\n"
    "light { direction: (-0.9, -1, -0.6); }\n"
    "animation { duration: 10s; fps: 24; }\n"
    "object pebble = freeform(ellipsoid(1.2, 0.8, 1)) {\n"
    "    for i in 0 .. 24 { bump(at: polar(0.6, 15deg * i) + (0, 0, 0.8 - 0.06 * i), radius: 0.25, height: 0.08); }\n"
    "};\n"
    "object stone = freeform(sphere(1)) { perturb(sphere(0.7).move(0.7, 0.3, 0.2), strength: 3); };\n"
    "let way = (3 * cos(36deg * (time / 1s)), 1, 3 * sin(36deg * (time / 1s)));\n"
    "freeform(morph(pebble, stone, 0.5 + 0.5 * sin(90deg * (time / 1s)))) {\n"
    "    bump(on: surface(from: way), radius: 0.5, height: 0.2);\n"
    "}\n";

static bool moving_form(const Options *o, cJSON *json)
{
    enum { FRAMES = 240 };
    char scene[600], stats[600], frames[600];
    work_path(o, "motion", ".scn", scene);
    work_path(o, "motion", ".stats.json", stats);
    work_path(o, "motion", ".####.png", frames);
    FILE *file = fopen(scene, "w");
    if (!file) return false;
    fputs(motion, file);
    fclose(file);
    Outcome all = run(NULL, (const char *[]){o->scn, "render", scene, "--size", "512x512", "--kernels", "full",
                                             "--frames", "0..239", "-o", frames, "-q", "--stats", stats, NULL});
    double builds = 0, ms = 0;
    FILE *read = all.status ? NULL : fopen(stats, "r");
    if (read) {
        char text[4096] = {0};
        size_t length = fread(text, 1, sizeof text - 1, read);
        text[length] = 0;
        builds = field(text, "kernel_builds");
        ms = field(text, "frames_ms");
        fclose(read);
    }
    note(json, "motion_frames_per_s", ms > 0 ? 1000 * FRAMES / ms : 0,
         "motion: a morph and a tool in %d frames of 512 x 512, %.0f a second, kernels built: %.0f", FRAMES,
         ms > 0 ? 1000 * FRAMES / ms : 0, builds);
    cJSON_AddNumberToObject(json, "motion_kernel_builds", builds);
    free(all.out);
    return all.status == 0 && builds <= 1; // the one that it began with
}

// A million rays: ten classes, 7 scenes each of 120 x 120.
static bool random_rays(const Options *o, cJSON *json)
{
    char tool[600];
    snprintf(tool, sizeof tool, "%s/scn-property", o->tools);
    Outcome rays = run(NULL, (const char *[]){tool, "--scenes", "7", "--size", "120", "--first", "100", NULL});
    printf("\nrandom rays against the oracle\n%s", rays.out);
    cJSON_AddBoolToObject(json, "random_rays_agree", rays.status == 0);
    free(rays.out);
    return rays.status == 0;
}

// -- the command ---------------------------------------------------------------------------------------------------------------

static bool read_options(int argc, char **argv, Options *o)
{
    *o = (Options){.size = 1024, .repeat = 9, .stride = 8, .pov = true, .rays = true};
    for (int k = 1; k < argc; k++) {
        if (!strcmp(argv[k], "--no-pov"))
            o->pov = false;
        else if (!strcmp(argv[k], "--no-rays"))
            o->rays = false;
        else if (argv[k][0] != '-')
            o->folder = argv[k];
        else if (k + 1 == argc)
            return false;
        else if (!strcmp(argv[k], "--scn"))
            o->scn = argv[++k];
        else if (!strcmp(argv[k], "--work"))
            o->work = argv[++k];
        else if (!strcmp(argv[k], "--size"))
            o->size = atoi(argv[++k]);
        else if (!strcmp(argv[k], "--repeat"))
            o->repeat = atoi(argv[++k]);
        else if (!strcmp(argv[k], "--stride"))
            o->stride = atoi(argv[++k]);
        else
            return false;
    }
    if (!o->scn || !o->work || o->size < 8 || o->repeat < 1 || o->stride < 1) return false;
    const char *slash = strrchr(o->scn, '/');
    snprintf(o->tools, sizeof o->tools, "%.*s", slash ? (int)(slash - o->scn) : 1, slash ? o->scn : ".");
    o->pov &= system("command -v povray >/dev/null 2>&1") == 0;
    mkdir(o->work, 0777);
    char *whole = realpath(o->work, NULL); // XDG_CACHE_HOME counts only if it is absolute
    if (!whole) return false;
    o->work = whole; // until the process ends
    return true;
}

static bool get_scene(const Options *o, Arena *arena, int k, BenchScene *scene)
{
    static const char *const names[] = {"S1", "S2", "S3", "S4", "S5"};
    static const int counts[] = {8, 64, 512, 0, 4096};
    char path[600], why[200];
    if (!o->folder) {
        if (counts[k])
            bench_freeform(arena, names[k], counts[k], 1001 + (unsigned)k, scene);
        else
            bench_sets(arena, names[k], 1001 + (unsigned)k, scene);
        return true;
    }
    snprintf(path, sizeof path, "%s/%s.json", o->folder, names[k]);
    if (bench_read_json(arena, path, scene, why)) return true;
    fprintf(stderr, "%s\n", why);
    return false;
}

int main(int argc, char **argv)
{
    Options o;
    if (!read_options(argc, argv, &o)) {
        fprintf(stderr, "usage: scn-bench --scn SCN --work FOLDER [--size N] [--repeat N] [--stride N] [--no-pov] "
                        "[--no-rays] [SCENES]\n");
        return 2;
    }
    Arena arena = {0};
    cJSON *json = cJSON_CreateObject(), *rows = cJSON_AddArrayToObject(json, "scenes");
    bool good = true, busy = false;
    print_head(&o);
    for (int k = 0; k < 5 && good; k++) {
        BenchScene scene;
        good = get_scene(&o, &arena, k, &scene);
        if (!good) break;
        Row row = measure(&o, &scene);
        print_row(&row);
        cJSON_AddItemToArray(rows, row_json(&row));
        good = row.cpu > 0;
        busy |= row.busy;
    }
    if (busy) printf("?: others use the processors: what two threads gain is not known\n");
    if (good) {
        putchar('\n');
        first_pictures(&o, "S3", json);
        big_union(&o, &arena, 10000, true, json);
        big_union(&o, &arena, 100000, false, json);
        copies(&o, true, json);
        copies(&o, false, json);
        for (size_t k = 0; k < sizeof crowds / sizeof *crowds; k++) big_crowd(&o, crowds[k], json);
        displacement(&o, json);
        good = general_fields(&o, json);
        good = moving_form(&o, json) && good;
        if (o.rays) good = random_rays(&o, json) && good;
    }
    char path[600], *text = cJSON_Print(json);
    work_path(&o, "bench", ".json", path);
    FILE *file = fopen(path, "w");
    if (file) fprintf(file, "%s\n", text), fclose(file), printf("\n%s\n", path);
    free(text);
    cJSON_Delete(json);
    arena_release(&arena);
    return good ? 0 : 1;
}
