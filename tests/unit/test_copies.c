// What a scene uses very often is in its plan once, and is the same object: F, boxes and pictures are those of copies that each have perturbations of their
// own, whoever makes the records of a copy.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/bounds.h"
#include "compiler/compile.h"
#include "compiler/emit.h"
#include "compiler/frame.h"
#include "runtime/plan_tables.h"
#include "runtime/program.h"
#include "runtime/renderer.h"

#define SIDE  14
#define PARTS 24

// %s: `let form = …` is one branch, `tag form() …` one for each use.
static const char *const scene =
    "camera { eye: (1, -22, 17); up: (0, 0, 1); fov: 44deg; }"
    "light { direction: (-0.4, 0.6, -1); } light { at: (3, -4, 6); }"
    "param turn: angle = 20deg in 0deg .. 90deg;"
    "tag made() { freeform(ellipsoid(0.45, 0.3, 0.35)) { for i in 0 .. 24 {"
    " perturb(ellipsoid(0.2, 0.12, 0.15).move(spherical(0.35, 137.5deg * i, asin(-0.97 + 0.08 * i))), strength: 0.6 - "
    "mod(i, 2)); } } }"
    "%s"
    "for i in 0 .. 14 { for j in 0 .. 14 {"
    " let one = form%s.rotate(z: turn * i, x: 31deg * j).scale(1, 1 + 0.03 * i, 1).move(1.2 * (i - 7), 1.2 * (j - 7), "
    "0);"
    " if mod(j, 3) == 0 { box(0.5).move(1.2 * (i - 7), 1.2 * (j - 7), 0.2) - one }"
    " else if mod(j, 3) == 1 { deform(one) { perturb(sphere(0.3).move(1.2 * (i - 7), 1.2 * (j - 7), 0.4)); } }"
    " else { one.paint(hsv(25deg * i, 0.6, 0.8)) } } }"
    "halfspace((0, 0, 1), at: (0, 0, -0.6));";

typedef struct Made {
    Unit unit;
    Plan *plan;
    const char *kernel;
    size_t length;
    double *values;
} Made;

static Made *made_new(bool shared)
{
    Made *made = calloc(1, sizeof *made);
    char text[4096];
    snprintf(text, sizeof text, scene, shared ? "let form = made();" : "tag form() { made() }", shared ? "" : "()");
    unit_init(&made->unit);
    Source *source = source_add(&made->unit.sources, "test.scn", text, strlen(text), (Span){0});
    Compiled *compiled = compile(&made->unit, source, &(CompileOptions){.kernel = true});
    if (!compiled->plan) {
        diag_print(&made->unit, stderr, false);
        fail_msg("it does not compile");
    }
    made->plan = compiled->plan;
    made->kernel = compiled->kernel;
    made->length = compiled->kernel_length;
    made->values = calloc(made->plan->slot_count, sizeof *made->values);
    FrameError error;
    const double turn = 0.3;
    assert_true(frame_evaluate(made->plan, &(FrameInput){.inputs = &turn}, made->values, &error));
    return made;
}

static void made_free(Made *made)
{
    free(made->values);
    unit_release(&made->unit);
    free(made);
}

static void perturbations_are_in_the_plan_once(void **state)
{
    Made *shared = made_new(true), *apart = made_new(false);
    const uint32_t deformed = SIDE * 5; // those of j = 1, 4, 7, 10, 13
    assert_int_equal(shared->plan->cluster_count, 1);
    assert_int_equal(shared->plan->copy_count, SIDE * SIDE);
    assert_int_equal(shared->plan->perturbation_count, PARTS + deformed);
    assert_int_equal(apart->plan->copy_count, 0);
    assert_int_equal(apart->plan->perturbation_count, SIDE * SIDE * PARTS + deformed);
    Failure failure;
    assert_true(plan_check(shared->plan, &failure));
    shared->plan->copies[7].cluster = 1;
    assert_false(plan_check(shared->plan, &failure));
    made_free(shared);
    made_free(apart);
}

static void copies_are_the_same_object(void **state)
{
    Made *shared = made_new(true), *apart = made_new(false);
    uint64_t bits = 7;
    for (int n = 0; n < 3000; n++) {
        double p[3];
        for (int k = 0; k < 3; k++) {
            bits = bits * 6364136223846793005u + 1442695040888963407u;
            p[k] = ((double)(bits >> 40) / (1 << 24) - 0.5) * (k < 2 ? 18 : 1.6);
        }
        uint32_t leaf[2];
        double f = plan_field(shared->plan, shared->values, p, &leaf[0]);
        assert_float_equal(f, plan_field(apart->plan, apart->values, p, &leaf[1]), 1e-9 * (1 + fabs(f)));
        assert_int_equal(shared->plan->leaves[leaf[0]].order, apart->plan->leaves[leaf[1]].order);
        if (f <= 0) continue;
        Bounds box = bounds_of_plan(shared->plan, shared->values);
        for (int k = 0; k < 3; k++) assert_true(box.low[k] <= p[k] && p[k] <= box.high[k]);
    }
    made_free(shared);
    made_free(apart);
}

static void render(const Made *made, Device *device, bool fp64, Film *film, RenderStats *stats)
{
    Failure failure = {"?"};
    Program *program = program_build(
        device,
        &(ProgramDesc){.source = made->kernel, .length = made->length, .options = emit_options((int)device->width)},
        &failure);
    if (!program) fail_msg("%s", failure.text);
    bool known = device->info.has_fp64;
    device->info.has_fp64 = known && fp64;
    Renderer *renderer = renderer_new(device, program->cl, made->plan, &failure);
    if (!renderer) fail_msg("%s", failure.text);
    if (renderer_frame(renderer, &(RenderJob){.values = made->values, .film = film}, stats, &failure) != RENDER_DONE)
        fail_msg("%s", failure.text);
    renderer_free(renderer);
    device->info.has_fp64 = known;
    program_free(program);
}

// How many pixels differ by more than floats do.
static int differences(const Film *a, const Film *b)
{
    int count = 0;
    for (int k = 0; k < a->width * a->height; k++) {
        bool same = isfinite(a->depth[k]) == isfinite(b->depth[k]);
        if (same && isfinite(a->depth[k])) same = fabsf(a->depth[k] - b->depth[k]) < 1e-4f;
        for (int c = 0; c < 4 && same; c++) same = fabsf(a->color[4 * k + c] - b->color[4 * k + c]) < 2e-3f;
        count += !same;
    }
    return count;
}

static void pictures_are_the_same(void **state)
{
    static const int widths[] = {16, 1};
    Made *shared = made_new(true), *apart = made_new(false);
    for (int k = 0; k < 2; k++) {
        Failure failure;
        int side = widths[k] == 16 ? 256 : 64;
        Device *device = device_open(&(DeviceDesc){.choice = "cpu", .threads = 2, .width = widths[k]}, &failure);
        if (!device) fail_msg("%s", failure.text);
        Film *one = film_new(side, side, FILM_COLOR | FILM_DEPTH),
             *parts = film_new(side, side, FILM_COLOR | FILM_DEPTH),
             *truth = film_new(side, side, FILM_COLOR | FILM_DEPTH);
        RenderStats of_one, of_parts;
        render(shared, device, true, one, &of_one);
        render(shared, device, false, parts, &of_parts);
        render(apart, device, true, truth, &of_parts);
        assert_true(differences(one, truth) <= side * side / 2000); // rays along silhouettes and the edges of shadows
        assert_true(differences(parts, truth) <= side * side / 2000);
        if (device->info.has_fp64) assert_true(of_one.items < of_parts.items / 5);
        film_free(one);
        film_free(parts);
        film_free(truth);
        device_close(device);
    }
    made_free(shared);
    made_free(apart);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(perturbations_are_in_the_plan_once),
        cmocka_unit_test(copies_are_the_same_object),
        cmocka_unit_test(pictures_are_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
