// Pictures against plain double: random scenes of every class, from outside, from within, in parallel and in perspective, small and large.
//
// What is counted: rays whose hit the kernels miss, rays that hit what is not there, and how far hits are off. A ray that would be right
// if it went by within TOLERANCE of the scene's size is at a silhouette and is not counted. SCN_TEST_SCENES=n renders n scenes of each class instead of a few.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "compiler/emit.h"
#include "runtime/device.h"
#include "runtime/program.h"
#include "runtime/renderer.h"
#include "tests/unit/plan_maker.h"

#define PIXELS    48
#define TOLERANCE 1e-4

typedef struct Bench {
    Device *device;
    Program *program;
    Maker *maker;
} Bench;

static int scene_count(int usual)
{
    const char *text = getenv("SCN_TEST_SCENES");
    return text ? atoi(text) : usual;
}

static Bench *bench_open(int width)
{
    Bench *b = calloc(1, sizeof *b);
    Failure failure;
    Arena arena = {0};
    b->maker = maker_new(20);
    b->device = device_open(&(DeviceDesc){.choice = "cpu", .threads = 2, .width = width}, &failure);
    if (!b->device) fail_msg("%s", failure.text);
    size_t length;
    const char *source = emit_kernel(&arena, maker_plan(b->maker), &length);
    b->program = program_build(
        b->device, &(ProgramDesc){.source = source, .length = length, .options = emit_options(width)}, &failure);
    if (!b->program) fail_msg("%s", failure.text);
    arena_release(&arena);
    return b;
}

static void bench_close(Bench *b)
{
    program_free(b->program);
    device_close(b->device);
    maker_free(b->maker);
    free(b);
}

static void render(Bench *b, Film *film)
{
    const Plan *plan = maker_plan(b->maker);
    Failure failure = {"?"};
    Renderer *renderer = renderer_new(b->device, b->program->cl, plan, &failure);
    if (!renderer) fail_msg("%s", failure.text);
    RenderResult result = renderer_frame(renderer, &(RenderJob){.values = plan->image, .film = film}, NULL, &failure);
    if (result != RENDER_DONE) fail_msg("%s", failure.text);
    renderer_free(renderer);
}

typedef struct View {
    double eye[3], r[3], s[3], f[3], half, size;
    bool orthographic;
} View;

static void view_of(const double eye[3], const double at[3], double fov, double height, bool orthographic, double size,
                    View *v)
{
    const double up[3] = {0.1, 1, 0.05};
    double length = 0;
    memcpy(v->eye, eye, sizeof v->eye);
    for (int k = 0; k < 3; k++) v->f[k] = at[k] - eye[k];
    for (int k = 0; k < 3; k++) length += v->f[k] * v->f[k];
    for (int k = 0; k < 3; k++) v->f[k] /= sqrt(length);
    for (int k = 0; k < 3; k++) v->r[k] = v->f[(k + 1) % 3] * up[(k + 2) % 3] - v->f[(k + 2) % 3] * up[(k + 1) % 3];
    length = v->r[0] * v->r[0] + v->r[1] * v->r[1] + v->r[2] * v->r[2];
    for (int k = 0; k < 3; k++) v->r[k] /= sqrt(length);
    for (int k = 0; k < 3; k++) v->s[k] = v->r[(k + 1) % 3] * v->f[(k + 2) % 3] - v->r[(k + 2) % 3] * v->f[(k + 1) % 3];
    v->orthographic = orthographic;
    v->half = orthographic ? height / 2 : tan(fov / 2);
    v->size = size;
}

// The ray through a pixel, moved aside by (du, dv); t counts along f.
static void pixel_ray(const View *v, double x, double y, double du, double dv, double o[3], double d[3])
{
    double u = (2 * (x + 0.5) / PIXELS - 1) * v->half, w = (1 - 2 * (y + 0.5) / PIXELS) * v->half;
    for (int k = 0; k < 3; k++) {
        double aside = u * v->r[k] + w * v->s[k];
        o[k] = v->eye[k] + du * v->r[k] + dv * v->s[k] + (v->orthographic ? aside : 0);
        d[k] = v->f[k] + (v->orthographic ? 0 : aside);
    }
}

typedef struct Tally {
    long rays, hits, missed, invented, silhouettes, unsampled;
    double *errors; // of the hits, parts of the scene's size
    long capacity;
} Tally;

static void tally_error(Tally *t, double error)
{
    if (t->hits == t->capacity) {
        t->capacity = t->capacity ? 2 * t->capacity : 65536;
        t->errors = realloc(t->errors, (size_t)t->capacity * sizeof *t->errors);
        if (!t->errors) abort();
    }
    t->errors[t->hits++] = error;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double quantile(Tally *t, double share)
{
    if (!t->hits) return 0;
    qsort(t->errors, (size_t)t->hits, sizeof *t->errors, by_value);
    return t->errors[(long)(share * (double)(t->hits - 1))];
}

static bool agrees(double seen, double truth, double size)
{
    if (!isfinite(seen) || !isfinite(truth)) return isfinite(seen) == isfinite(truth);
    return fabs(seen - truth) < 0.02 * size;
}

static bool is_silhouette(const Maker *m, const View *v, int x, int y, double seen, double far)
{
    for (int k = 0; k < 24; k++) {
        double angle = k * 0.7853981, step = TOLERANCE * v->size * (k < 8 ? 1 : k < 16 ? 0.3 : 0.03), o[3], d[3];
        pixel_ray(v, x, y, step * cos(angle), step * sin(angle), o, d);
        double t = maker_first(m, o, d, 0, far, 0.01 * v->size);
        if (agrees(seen, t, v->size) || (isfinite(seen) && isfinite(t) && fabs(seen - t) < 0.1 * v->size)) return true;
    }
    return false;
}

// Whether the ray does change sides where it is said to: then the double reference stepped over a thin place.
static bool crosses(const Maker *m, const double o[3], const double d[3], double t, double size)
{
    double low = t - TOLERANCE * size, high = t + TOLERANCE * size;
    const double a[3] = {o[0] + low * d[0], o[1] + low * d[1], o[2] + low * d[2]},
                 b[3] = {o[0] + high * d[0], o[1] + high * d[1], o[2] + high * d[2]};
    return maker_inside(m, a) != maker_inside(m, b);
}

static void compare(const Maker *m, const View *v, const Film *film, double far, Tally *tally, const char *what)
{
    for (int y = 0; y < PIXELS; y++) {
        for (int x = 0; x < PIXELS; x++) {
            double o[3], d[3];
            pixel_ray(v, x, y, 0, 0, o, d);
            double truth = maker_first(m, o, d, 0, far, 0.005 * v->size), seen = INFINITY;
            const float *p = film->position + 3 * (y * PIXELS + x);
            if (isfinite(film->depth[y * PIXELS + x]))
                seen = (p[0] - v->eye[0]) * v->f[0] + (p[1] - v->eye[1]) * v->f[1] + (p[2] - v->eye[2]) * v->f[2];
            if (seen > far) seen = INFINITY;
            tally->rays++;
            if (agrees(seen, truth, v->size)) {
                if (isfinite(truth)) tally_error(tally, fabs(seen - truth) / v->size);
            } else if (is_silhouette(m, v, x, y, seen, far)) {
                tally->silhouettes++;
            } else if (isfinite(seen) && crosses(m, o, d, seen, v->size)) {
                tally->unsampled++;
            } else {
                bool missed = !isfinite(seen) || seen > truth;
                if (missed)
                    tally->missed++;
                else
                    tally->invented++;
                if (getenv("SCN_TEST_VERBOSE"))
                    printf("    %s pixel %d %d: seen %g, true %g\n", what, x, y, seen, truth);
            }
        }
    }
}

// A scene of one kind of component. Scenes: at the origin, radius about 1, times `scale`.
static void random_at(Maker *m, double reach, double at[3])
{
    for (int k = 0; k < 3; k++) at[k] = maker_random(m, -reach, reach);
}

static void add_quadric(Maker *m, int kind, double size, double reach, double scale, bool outside)
{
    double at[3], q[10];
    random_at(m, reach * scale, at);
    maker_random_quadric(m, kind, at, size * scale, q);
    if (outside) quadric_negate(q);
    maker_quadric(m, q);
}

static void add_perturbations(Maker *m, int count, double scale, bool tame)
{
    for (int k = 0; k < count; k++) {
        double at[3], q[10];
        random_at(m, scale, at);
        maker_random_quadric(m, tame ? 0 : maker_choice(m, MAKER_KINDS), at, maker_random(m, 0.2, 0.8) * scale, q);
        // Without its random factor, so that strengths mean something.
        double size = 0;
        for (int n = 0; n < 6; n++) size = fmax(size, fabs(q[n]));
        for (int n = 0; n < 10; n++) q[n] *= size > 0 ? 2 / (size * scale * scale) : 1;
        if (!tame && maker_choice(m, 8) == 0) quadric_negate(q);
        maker_perturbation(m, q, maker_random(m, tame ? 0.1 : -0.6, 0.6));
    }
}

static void add_freeform(Maker *m, int kind, int perturbations, double scale, bool tame)
{
    double at[3], q[10], size = 0;
    random_at(m, 0.3 * scale, at);
    maker_random_quadric(m, kind, at, 0.8 * scale, q);
    for (int n = 0; n < 6; n++) size = fmax(size, fabs(q[n]));
    for (int n = 0; n < 10 && size > 0; n++) q[n] *= 1 / (size * scale * scale);
    maker_quadric(m, q);
    add_perturbations(m, perturbations, scale, tame);
}

static void add_component(Maker *m, MakerShape shape, double scale)
{
    maker_begin(m, shape);
    switch (shape) {
    case MAKER_QUADRIC: add_quadric(m, maker_choice(m, MAKER_KINDS), maker_random(m, 0.1, 0.6), 1, scale, false); break;
    case MAKER_FREEFORM:
        add_freeform(m, maker_choice(m, 3) ? 0 : maker_choice(m, MAKER_KINDS), 1 + maker_choice(m, 12), scale,
                     maker_choice(m, 2));
        break;
    case MAKER_MEET:
        for (int k = 0; k < 4; k++)
            add_quadric(m, maker_choice(m, MAKER_KINDS), maker_random(m, 0.3, 0.9), 0.4, scale, maker_choice(m, 2));
        break;
    case MAKER_TREE:
        for (int k = 0; k < 4; k++)
            add_quadric(m, maker_choice(m, MAKER_KINDS), maker_random(m, 0.2, 0.7), 0.6, scale,
                        maker_choice(m, 3) == 0);
        break;
    case MAKER_CARVED:
        add_freeform(m, 0, 1 + maker_choice(m, 5), scale, maker_choice(m, 2));
        add_quadric(m, maker_choice(m, MAKER_KINDS), 0.7, 0.4, scale, maker_choice(m, 2));
        {
            double at[3], q[10];
            random_at(m, 0.8 * scale, at);
            maker_random_quadric(m, 0, at, 0.5 * scale, q);
            double size = fmax(fmax(fabs(q[0]), fabs(q[1])), fabs(q[2])) * scale * scale;
            for (int n = 0; n < 10; n++) q[n] /= -size;
            maker_quadric(m, q);
            add_perturbations(m, maker_choice(m, 4), scale, true);
        }
        break;
    case MAKER_GROUPED:
        add_quadric(m, 0, 1.2, 0.2, scale, false);
        maker_group(m);
        for (int k = 0; k < 12; k++) add_quadric(m, maker_choice(m, 7), maker_random(m, 0.1, 0.5), 1, scale, false);
        maker_group(m);
        for (int k = 0; k < 8; k++)
            add_quadric(m, maker_choice(m, 2) ? 0 : 8, maker_random(m, 0.2, 0.4), 1.2, scale, maker_choice(m, 2));
        break;
    default: break;
    }
    maker_end(m);
}

typedef enum Eye { EYE_OUTSIDE, EYE_AMONG, EYE_PARALLEL, EYE_FAR, EYE_KINDS } Eye;

static void random_view(Maker *m, Eye kind, double scale, View *v)
{
    double eye[3], at[3];
    random_at(m, 1, eye);
    random_at(m, 0.3 * scale, at);
    double length = sqrt(eye[0] * eye[0] + eye[1] * eye[1] + eye[2] * eye[2]);
    double distance = kind == EYE_OUTSIDE || kind == EYE_PARALLEL ? 4 : kind == EYE_FAR ? 1000 : maker_random(m, 0, 1);
    for (int k = 0; k < 3; k++) eye[k] *= distance * scale / length;
    double fov = kind == EYE_FAR ? 0.003 : maker_random(m, 0.4, 1.4), height = 2.5 * scale;
    maker_camera(m, eye, at, fov, height, kind == EYE_PARALLEL);
    view_of(eye, at, fov, height, kind == EYE_PARALLEL, 2 * scale, v);
}

static void check_class(Bench *b, MakerShape shape, int components, Eye eye, double scale, int scenes, Tally *tally)
{
    Maker *m = b->maker;
    Film *film = film_new(PIXELS, PIXELS, FILM_DEPTH | FILM_POSITION);
    for (int k = 0; k < scenes; k++) {
        View view;
        maker_clear(m);
        int count = 1 + maker_choice(m, components);
        for (int n = 0; n < count; n++) add_component(m, shape, scale);
        random_view(m, eye, scale, &view);
        render(b, film);
        char what[80];
        snprintf(what, sizeof what, "shape %d eye %d scale %g scene %d", shape, eye, scale, k);
        compare(m, &view, film, eye == EYE_FAR ? 1020 * scale : 20 * scale, tally, what);
    }
    film_free(film);
}

static void check_tally(const char *name, Tally *t)
{
    double median = quantile(t, 0.5), most = quantile(t, 0.9999);
    printf("    %-34s %8ld rays %8ld hits: %ld missed, %ld invented, %ld at silhouettes, %ld thin; |dt| median %.1e, "
           "99.99 %% %.1e, most %.1e\n",
           name, t->rays, t->hits, t->missed, t->invented, t->silhouettes, t->unsampled, median, most, quantile(t, 1));
    if (!getenv("SCN_TEST_VERBOSE")) {
        assert_int_equal(t->missed, 0);
        assert_int_equal(t->invented, 0);
        assert_true(median <= 1e-6);
        assert_true(most <= 1e-4);
    }
    free(t->errors);
}

static void check_shape(void **state, MakerShape shape, int components, const char *name)
{
    static const char *const eyes[EYE_KINDS] = {"from outside", "from among them", "in parallel", "from far"};
    static const double scales[3] = {1, 1e-3, 1e3};
    Bench *b = *state;
    for (int eye = 0; eye < EYE_KINDS; eye++) {
        Tally tally = {0};
        for (int k = 0; k < 3; k++)
            check_class(b, shape, components, (Eye)eye, scales[k], scene_count(k ? 1 : 3), &tally);
        char text[80];
        snprintf(text, sizeof text, "%s, %s", name, eyes[eye]);
        check_tally(text, &tally);
    }
}

static void test_quadrics(void **state)
{
    check_shape(state, MAKER_QUADRIC, 12, "quadrics");
}

static void test_intersections(void **state)
{
    check_shape(state, MAKER_MEET, 4, "intersections");
}

static void test_trees(void **state)
{
    check_shape(state, MAKER_TREE, 4, "trees");
}

static void test_freeforms(void **state)
{
    check_shape(state, MAKER_FREEFORM, 2, "free forms");
}

static void test_carved_freeforms(void **state)
{
    check_shape(state, MAKER_CARVED, 1, "carved free forms");
}

static void test_groups(void **state)
{
    check_shape(state, MAKER_GROUPED, 1, "groups");
}

static int open_wide(void **state)
{
    *state = bench_open(16);
    return 0;
}

static int close_bench(void **state)
{
    bench_close(*state);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quadrics),  cmocka_unit_test(test_intersections),    cmocka_unit_test(test_trees),
        cmocka_unit_test(test_freeforms), cmocka_unit_test(test_carved_freeforms), cmocka_unit_test(test_groups),
    };
    return cmocka_run_group_tests_name("renderer", tests, open_wide, close_bench);
}
