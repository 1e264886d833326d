// Warnings about geometry: each with a scene that has it and with scenes that look alike and do not. A warning is
// never false.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "compiler/compile.h"

static Unit unit;

// The warnings of a text as "code code", in the order of their places.
static const char *warnings(const char *text)
{
    unit_release(&unit);
    unit_init(&unit);
    Source *source = source_add(&unit.sources, "test.scn", text, strlen(text), (Span){0});
    Compiled *compiled = compile(&unit, source, &(CompileOptions){0});
    if (!compiled->plan) {
        diag_print(&unit, stderr, false);
        fail_msg("it does not compile: %s", text);
    }
    int count;
    const Diag **list = diag_sorted(&unit, &unit.arena, &count);
    const char *codes = "";
    for (int k = 0; k < count; k++)
        codes = arena_printf(&unit.arena, "%s%s%s", codes, k ? " " : "", diag_code_name(list[k]->code));
    return codes;
}

static void assert_warnings(const char *text, const char *expected)
{
    const char *codes = warnings(text);
    if (strcmp(codes, expected)) {
        diag_print(&unit, stderr, false);
        fail_msg("%s: '%s' instead of '%s'", text, codes, expected);
    }
}

static void quadrics_without_a_surface(void **state)
{
    assert_warnings("quadric(-1, -1, -1, 0, 0, 0, 0, 0, 0, -1);", "empty-quadric");
    assert_warnings("quadric(0, 0, 0, 0, 0, 0, 0, 0, 0, 1);", "degenerate-quadric");
    assert_warnings("sphere(1) - quadric(-1, -1, -1, 0, 0, 0, 0, 0, 0, -2).move(3, 0, 0);", "empty-quadric");
    assert_warnings("quadric(-1, 0, 0, 0, 0, 0, 0, 0, 0, -1) | sphere(1);",
                    "empty-quadric"); // a slab with its faces exchanged
}

static void quadrics_with_one(void **state)
{
    assert_warnings("quadric(-1, -1, -1, 0, 0, 0, 0, 0, 0, 1);", "");
    assert_warnings("quadric(-1, -1, -1, 0, 0, 0, 8, 0, 0, -15);", "");  // a sphere at x = 4
    assert_warnings("quadric(-1, -1, -1, 0, 0, 0, 0, 0, 0, 0);", "");    // a point
    assert_warnings("quadric(-1, -1, 1, 0, 0, 0, 0, 0, 0, -1);", "");    // two sheets
    assert_warnings("quadric(0, 0, 0, 0, 0, 0, 0, 0, 1e-6, -1e6);", ""); // a plane far away
    assert_warnings(
        "sphere(1); cylinder(radius: 0.2, height: 3); cone(); box(1, 2, 3); slab(z: 2..3); halfspace(); paraboloid();",
        "");
    assert_warnings("(sphere(1e-4) - box(1e-5)).scale(1e6);", "");
    assert_warnings("quadric(-1, -1, -1, 0, 0, 0, 0, 0, 0, time / 1s - 1);", ""); // moves
}

static void an_empty_base_may_have_perturbations(void **state)
{
    const char *blobs =
        "freeform(quadric(0, 0, 0, 0, 0, 0, 0, 0, 0, -0.2)) { perturb(sphere(2)); perturb(sphere(2).move(1, 0, 0)); };";
    assert_warnings(blobs, "");
}

static void perturbations_that_miss(void **state)
{
    assert_warnings("freeform(sphere(1)) { perturb(sphere(0.1).move(9, 0, 0)); };", "perturbation-misses");
    assert_warnings("freeform(sphere(1)) { perturb(sphere(0.1)); };", "perturbation-misses"); // wholly inside
    assert_warnings("freeform(sphere(1)) { perturb(sphere(0.1), strength: -1); };", "perturbation-misses");
    assert_warnings("freeform(sphere(1)) { perturb(quadric(-1, -1, -1, 0, 0, 0, 0, 0, 0, -1)); };",
                    "perturbation-misses");
    assert_warnings("freeform(sphere(1)) { perturb(sphere(0.1).move(9, 0, 0)); perturb(sphere(0.3).move(1, 0, 0)); };",
                    "perturbation-misses");
}

static void perturbations_that_do_something(void **state)
{
    assert_warnings("freeform(sphere(1)) { perturb(sphere(0.1).move(1, 0, 0)); };", "");
    assert_warnings("freeform(sphere(1)) { perturb(sphere(0.2).move(0.81, 0, 0)); };", "");           // just reaches it
    assert_warnings("freeform(sphere(1)) { perturb(sphere(0.5), strength: -1e6); };", "");            // digs a cave
    assert_warnings("freeform(sphere(1)) { perturb(sphere(1).move(5, 0, 0), strength: 1e6); };", ""); // makes an island
    assert_warnings("freeform(sphere(1)) { perturb(cylinder(radius: 0.2)); };", "");
    assert_warnings("freeform(sphere(1)) { perturb(sphere(0.1).move(9 * sin(1rad * (time / 1s)), 0, 0)); };",
                    ""); // moves there
    assert_warnings("freeform(sphere(1)) { for i in 0 .. 5 { perturb(sphere(0.3).move(i, 0, 0)); } };",
                    ""); // some of them do
    // The second reaches the surface that the first one makes.
    assert_warnings("freeform(sphere(1)) { perturb(sphere(0.6).move(1.2, 0, 0), strength: 200); "
                    "perturb(sphere(0.3).move(1.7, 0, 0)); };",
                    "");
    assert_warnings("deform(sphere(1), sphere(1).move(9, 0, 0)) { perturb(sphere(0.2).move(10, 0, 0)); };",
                    ""); // one part of two
}

static void scenes_that_show_nothing(void **state)
{
    assert_warnings("sphere(1).hide();", "empty-scene");
    assert_warnings("sphere(1) & sphere(1).move(9, 0, 0);", "empty-scene");
    assert_warnings("object a = sphere(1); scene { }", "empty-scene");
    assert_warnings("sphere(1) & sphere(1).move(1.9, 0, 0);", "");
    assert_warnings("sphere(1) & sphere(1).move(9 - time / 1s, 0, 0);", ""); // later they meet
    assert_warnings("sphere(1).show(when: time > 1s);", "");
}

static void cameras_inside_of_objects(void **state)
{
    assert_warnings("camera { eye: (0, 0, 0.5); } sphere(1);", "camera-hidden");
    assert_warnings("camera { eye: (0, 0, 5); } sphere(1);", "");
    assert_warnings("camera { eye: (0, 0, 0.5); } sphere(2) - sphere(1);", ""); // in a cave
    assert_warnings("sphere(1);", "");                                          // none given
    assert_warnings("camera { eye: (0, 0, 0.5); projection: \"orthographic\"; } sphere(1);", "");
}

static int release(void **state)
{
    unit_release(&unit);
    unit = (Unit){0};
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(quadrics_without_a_surface, release),
        cmocka_unit_test_teardown(quadrics_with_one, release),
        cmocka_unit_test_teardown(an_empty_base_may_have_perturbations, release),
        cmocka_unit_test_teardown(perturbations_that_miss, release),
        cmocka_unit_test_teardown(perturbations_that_do_something, release),
        cmocka_unit_test_teardown(scenes_that_show_nothing, release),
        cmocka_unit_test_teardown(cameras_inside_of_objects, release),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
