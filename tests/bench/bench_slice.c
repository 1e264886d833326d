// Slices of general fields: `bench-slice [--quick] [--repeat N] [--no-brute] [MODEL.vm]`, with two threads. Without a model a page of rings and strokes
// is made, of about as many operations as a page of text has.
//
// For each size: CPU and wall time of a picture, the median and the best of series of N (warm: two pictures before them are not counted; neither sending
// the formula nor reading the picture is), how many pixels are inside, and how many differ from the picture whose pixels are computed one by one.
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "compiler/frame.h"
#include "compiler/section.h"
#include "lang/source.h"
#include "runtime/import_vm.h"
#include "runtime/scene.h"
#include "runtime/slice.h"

typedef struct Options {
    const char *model;
    int repeat;
    bool quick, brute;
} Options;

static double clock_ms(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int wrong(const char *text)
{
    fprintf(stderr, "bench-slice: %s\n", text);
    return 1;
}

// --- the model

// A page of letters, each a ring and a stroke, or two: lengths of 2 / 40 across and 2 / 20 up.
static const char *write_page(Arena *arena, bool short_one, size_t *length)
{
    enum { ROWS = 20, COLUMNS = 40 };
    int letters = short_one ? COLUMNS : ROWS * COLUMNS;
    char *text;
    FILE *out = open_memstream(&text, length);
    if (!out) abort();
    fputs("x var-x\ny var-y\nw const 0.006\nr const 0.014\nt0 const 1\n", out);
    for (int k = 0; k < letters; k++) {
        double at = -0.975 + 2.0 / COLUMNS * (k % COLUMNS), down = 0.95 - 2.0 / ROWS * (double)(k / COLUMNS);
        fprintf(out, "x%d const %.17g\ny%d const %.17g\nu%d sub x x%d\nv%d sub y y%d\n", k, at, k, down, k, k, k, k);
        fprintf(out, "a%d square u%d\nb%d square v%d\nc%d add a%d b%d\nd%d sqrt c%d\n", k, k, k, k, k, k, k, k, k);
        fprintf(out, "e%d sub d%d r\nf%d abs e%d\ng%d sub f%d w\n", k, k, k, k, k, k); // the ring
        fprintf(out, "h%d %s u%d r\ni%d abs h%d\nj%d sub i%d w\n", k, k % 3 ? "add" : "sub", k, k, k, k, k);
        fprintf(out, "k%d neg v%d\nl%d sub k%d r\nm%d max j%d l%d\n", k, k, k, k, k, k, k); // beside it the stroke
        fprintf(out, "n%d max m%d v%d\no%d min g%d n%d\nt%d min t%d o%d\n", k, k, k, k, k, k, k + 1, k, k);
    }
    if (fclose(out)) abort();
    const char *kept = arena_text(arena, text, *length);
    free(text);
    return kept;
}

static ScnScene *load_model(Arena *arena, const Options *o)
{
    const char *path = o->model;
    size_t length, size;
    Failure failure = {"cannot be read"};
    const char *text = path ? source_read(arena, path, &length) : write_page(arena, o->quick, &length);
    const char *scene = text ? import_vm(arena, text, length, &size, &failure) : NULL;
    if (!path) path = "a page";
    if (!scene) {
        fprintf(stderr, "bench-slice: %s: %s\n", path, failure.text);
        return NULL;
    }
    ScnScene *loaded = scn_load(&(ScnSceneDesc){.path = path, .bytes = scene, .size = size, .check_only = true});
    if (loaded && scn_status(loaded) == SCN_OK) return loaded;
    fprintf(stderr, "bench-slice: %s\n%s", scn_error(loaded), scn_diagnostics_text(loaded, false));
    scn_free(loaded);
    return NULL;
}

static bool formula_of_scene(Arena *arena, ScnScene *scene, bool pushing, FormulaSteps *steps, FormulaCode *code)
{
    const Plan *plan = scene->package->plan;
    double *values = arena_array(arena, double, plan->slot_count);
    FrameError error;
    SectionTrouble trouble;
    uint32_t inside;
    Formula *f = formula_new(arena, pushing);
    return frame_evaluate(plan, &(FrameInput){.inputs = scene->inputs}, values, &error) &&
           section_formula(f, plan, values, &(SectionPlane){.axis = 2}, &inside, &trouble) &&
           formula_steps(f, inside, arena, steps) &&
           (!code || formula_emit(f, inside, arena, code) || !(code->groups = 0));
}

// --- a size

typedef struct Measured {
    double cpu, wall, best;
} Measured;

static bool measure(Slicer *slicer, const SliceView *view, int repeat, Measured *result, Failure *failure)
{
    double *cpu = calloc((size_t)repeat, sizeof *cpu), *wall = calloc((size_t)repeat, sizeof *wall);
    bool ok = cpu && wall;
    for (int k = -2; k < repeat && ok; k++) {
        double cpu_begin = clock_ms(CLOCK_PROCESS_CPUTIME_ID), wall_begin = clock_ms(CLOCK_MONOTONIC);
        ok = slicer_draw(slicer, view, SLICE_TILES, failure);
        if (k < 0) continue;
        wall[k] = clock_ms(CLOCK_MONOTONIC) - wall_begin;
        cpu[k] = clock_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu_begin;
    }
    if (ok) {
        qsort(cpu, (size_t)repeat, sizeof *cpu, by_size);
        qsort(wall, (size_t)repeat, sizeof *wall, by_size);
        *result = (Measured){cpu[repeat / 2], wall[repeat / 2], wall[0]};
    }
    free(cpu);
    free(wall);
    return ok;
}

// Pixels that differ from those computed one by one; -1 where something failed.
static int64_t differences(Slicer *slicer, Slicer *plain, const SliceView *view, Failure *failure)
{
    const uint16_t *bits = slicer_bits(slicer, failure);
    const uint16_t *truth = slicer_draw(plain, view, SLICE_BRUTE, failure) ? slicer_bits(plain, failure) : NULL;
    int64_t count = 0;
    if (!bits || !truth) return -1;
    size_t words = (size_t)slicer_stride(slicer) * view->height;
    for (size_t k = 0; k < words; k++) count += __builtin_popcount(bits[k] ^ truth[k]);
    return count;
}

static bool bench_size(const Options *o, const char *what, Slicer *slicer, Slicer *plain, uint32_t size)
{
    Failure failure;
    Measured m;
    SliceView view = {.width = size, .height = size, .x0 = -1, .x1 = 1, .y0 = -1, .y1 = 1};
    if (!measure(slicer, &view, o->repeat, &m, &failure)) return !wrong(failure.text);
    const uint16_t *bits = slicer_bits(slicer, &failure);
    if (!bits) return !wrong(failure.text);
    printf("  %-9s %5ux%-5u %8.2f ms CPU %8.2f ms wall (best %.2f) %10llu pixels inside", what, size, size, m.cpu,
           m.wall, m.best, (unsigned long long)slicer_count(slicer, bits));
    fflush(stdout);
    int64_t different = o->brute ? differences(slicer, plain, &view, &failure) : 0;
    if (different < 0) return !wrong(failure.text);
    if (o->brute)
        printf(", %lld differ from those computed one by one\n", (long long)different);
    else
        putchar('\n');
    return different == 0;
}

// --- the command

static bool bench_sizes(const Options *o, const char *what, Slicer *slicer, Slicer *plain)
{
    static const uint32_t sizes[] = {1024, 2048, 4096}, small[] = {100, 256};
    bool ok = true;
    for (int k = 0; k < (o->quick ? 2 : 3) && ok; k++)
        ok = bench_size(o, what, slicer, plain, o->quick ? small[k] : sizes[k]);
    return ok;
}

// The formula as code, as packages hold it.
static bool bench_code(const Options *o, Device *device, const FormulaCode *code, Slicer *plain)
{
    Failure failure;
    double begin = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    Slicer *slicer = slicer_new(device, &(SlicerDesc){.code = code}, &failure);
    if (!slicer) return !wrong(failure.text);
    double build_ms = clock_ms(CLOCK_PROCESS_CPUTIME_ID) - begin;
    begin = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    bool ok = slicer_draw(slicer, &(SliceView){16, 16, -1, 1, -1, 1}, SLICE_TILES, &failure);
    printf("  code: %u steps in %u groups, %.0f kB, kernels %.0f ms CPU and %.0f ms for the first picture\n",
           code->steps, code->groups, (double)code->length / 1000, build_ms,
           clock_ms(CLOCK_PROCESS_CPUTIME_ID) - begin);
    ok = ok && bench_sizes(o, "package", slicer, plain);
    slicer_free(slicer);
    return ok;
}

static bool bench(const Options *o, Device *device, ScnScene *scene, Arena *arena)
{
    FormulaSteps pushed, plain;
    FormulaCode code = {0};
    Failure failure;
    double begin = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    if (!formula_of_scene(arena, scene, true, &pushed, NULL)) return !wrong("the model is no formula");
    double formula_ms = clock_ms(CLOCK_PROCESS_CPUTIME_ID) - begin;
    if (!formula_of_scene(arena, scene, true, &pushed, &code)) return !wrong("the model is no formula");
    if (!formula_of_scene(arena, scene, false, &plain, NULL)) return !wrong("the model is no formula");
    Slicer *slicer = slicer_new(device, &(SlicerDesc){0}, &failure),
           *one = slicer_new(device, &(SlicerDesc){0}, &failure);
    bool ok = slicer && one && slicer_program(slicer, &pushed, &failure) && slicer_program(one, &plain, &failure);
    if (!ok) return !wrong(failure.text);
    printf("%s: %u numbers, %u comparisons, %u and and or (%u numbers as written), formula %.1f ms, kernels %.0f ms\n",
           o->model ? o->model : "a page", pushed.numbers, pushed.compares, pushed.logics, plain.numbers, formula_ms,
           slicer_built(slicer)->build_ms);
    ok = bench_sizes(o, "tiles", slicer, one);
    if (ok && code.groups)
        ok = bench_code(o, device, &code, one);
    else if (ok)
        puts("  no code: functions are left to programs");
    slicer_free(slicer);
    slicer_free(one);
    return ok;
}

static bool read_options(int argc, char **argv, Options *o)
{
    *o = (Options){.repeat = 51, .brute = true};
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--quick"))
            o->quick = true;
        else if (!strcmp(argv[i], "--no-brute"))
            o->brute = false;
        else if (!strcmp(argv[i], "--repeat") && i + 1 < argc)
            o->repeat = atoi(argv[++i]);
        else if (!o->model)
            o->model = argv[i];
        else
            return false;
    }
    return o->repeat > 0;
}

int main(int argc, char **argv)
{
    Options o;
    Failure failure;
    if (!read_options(argc, argv, &o))
        return wrong("usage: bench-slice [--quick] [--repeat N] [--no-brute] [MODEL.vm]");
    Arena arena = {0};
    ScnScene *scene = load_model(&arena, &o);
    Device *device = scene ? device_open(&(DeviceDesc){.choice = "cpu", .threads = 2, .width = 16}, &failure) : NULL;
    if (scene && !device) wrong(failure.text);
    bool ok = device && bench(&o, device, scene, &arena);
    device_close(device);
    scn_free(scene);
    arena_release(&arena);
    return ok ? 0 : 1;
}
