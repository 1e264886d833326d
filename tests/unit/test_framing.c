// The camera of a scene without one: all that has an end is in the picture, and fills it; what has none does not count.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "compiler/compile.h"
#include "compiler/frame.h"
#include "runtime/framing.h"

enum { WIDTH = 160, HEIGHT = 120 };

typedef struct Ball {
    double at[3], radius;
} Ball;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void frame_scene(const char *text, double camera[15])
{
    Unit unit;
    unit_init(&unit);
    const Source *source = source_add(&unit.sources, "scene", text, strlen(text), (Span){0});
    const Compiled *compiled = compile(&unit, source, &(CompileOptions){0});
    assert_non_null(compiled->plan);
    double *values = arena_array(&unit.arena, double, compiled->plan->slot_count + 1u);
    FrameError error;
    assert_true(frame_evaluate(compiled->plan, &(FrameInput){0}, values, &error));
    memcpy(camera, values + compiled->plan->camera, 15 * sizeof *camera);
    assert_true(framing_camera(compiled->plan, &values, NULL, 1, WIDTH, HEIGHT, camera));
    unit_release(&unit);
}

// How far a ball reaches from the middle of the picture: 1 is its nearer edge. A ball is seen as the cone around it.
static double reach(const double camera[15], const Ball *ball)
{
    CameraAxes axes;
    camera_axes(camera, &axes);
    double v[3];
    for (int c = 0; c < 3; c++) v[c] = ball->at[c] - camera[c];
    double depth = -dot(v, axes.back), half = camera[9] / 2, farthest = 0;
    assert_true(depth > ball->radius);
    const double *sides[2] = {axes.right, axes.up};
    for (int c = 0; c < 2; c++) {
        double across = dot(v, sides[c]), distance = hypot(across, depth);
        double angle = fabs(atan2(across, depth)) + asin(fmin(1, ball->radius / distance));
        double edge = tan(half) * (c ? 1 : (double)WIDTH / HEIGHT);
        farthest = fmax(farthest, tan(angle) / edge);
    }
    return farthest;
}

static void expect_seen(const char *text, const Ball *balls, int count)
{
    double camera[15], farthest = 0;
    frame_scene(text, camera);
    for (int k = 0; k < count; k++) farthest = fmax(farthest, reach(camera, &balls[k]));
    if (farthest > 1 || farthest < 0.4) fail_msg("%s reaches %g of the way to the edge", text, farthest);
}

static const Ball two[] = {{{-4, 0, 0}, 1}, {{4, 0, 0}, 1}};

static void what_is_there_fills_the_picture(void **state)
{
    (void)state;
    expect_seen("sphere(3);", &(Ball){{0, 0, 0}, 3}, 1);
    expect_seen("sphere(1).move(4, 0, 0); sphere(1).move(-4, 0, 0);", two, 2);
}

static void what_has_no_end_does_not_count(void **state)
{
    (void)state;
    expect_seen("sphere(3); slab(y: -3.2 .. -3);", &(Ball){{0, 0, 0}, 3}, 1);
    expect_seen("sphere(1).move(4, 0, 0); halfspace(at: (0, -1, 0)); sphere(1).move(-4, 0, 0);", two, 2);
}

// The ends of the tube are those of a slab, which a view's boxes do not know.
static void what_others_cut_has_an_end(void **state)
{
    (void)state;
    expect_seen("sphere(1).move(4, 0, 0); (sphere(1) | cylinder(0.4)).move(-4, 0, 0) & slab(z: -1 .. 1);", two, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_there_fills_the_picture),
        cmocka_unit_test(what_has_no_end_does_not_count),
        cmocka_unit_test(what_others_cut_has_an_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
