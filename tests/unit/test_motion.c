// Operations in motion, through the public API: what moves builds no kernel, and a morph's ends are its objects.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "runtime/scn.h"

enum { SIZE = 48, PIXELS = SIZE * SIZE };

typedef struct Picture {
    float color[4 * PIXELS], depth[PIXELS], normal[3 * PIXELS];
    uint32_t id[PIXELS];
} Picture;

static ScnScene *load(const char *text)
{
    ScnScene *scene = scn_load(
        &(ScnSceneDesc){.path = "test.scn", .bytes = text, .size = strlen(text), .device = "cpu", .quick = true});
    if (!scene || scn_status(scene) != SCN_OK)
        fail_msg("%s%s\n%s", scn_diagnostics_text(scene, false), scn_error(scene), text);
    return scene;
}

static void render(ScnScene *scene, double time, Picture *p)
{
    ScnFrameDesc desc = {.width = SIZE,
                         .height = SIZE,
                         .time = time,
                         .color = p->color,
                         .depth = p->depth,
                         .normal = p->normal,
                         .id = p->id};
    ScnStatus status = scn_render(scene, &desc);
    if (status != SCN_OK) fail_msg("status %d: %s", status, scn_error(scene));
}

// A morph of free forms and a tool on a ray that turns: 240 frames, one kernel.
static void a_morph_and_a_tool_that_move_build_no_kernel(void **state)
{
    static const char text[] =
        "camera { eye: (0.6, 1, 4.5); look_at: (0, 0, 0); fov: 36deg; }\n"
        "light { direction: (-0.9, -1, -0.6); }\n"
        "animation { duration: 10s; fps: 24; }\n"
        "object pebble = freeform(ellipsoid(1.2, 0.8, 1)) {\n"
        "    for i in 0 .. 8 { bump(at: polar(0.6, 45deg * i) + (0, 0, 0.7), radius: 0.3, height: 0.1); }\n"
        "};\n"
        "object stone = freeform(sphere(1)) { perturb(sphere(0.7).move(0.7, 0.3, 0.2), strength: 3); };\n"
        "let way = (3 * cos(36deg * (time / 1s)), 1, 3 * sin(36deg * (time / 1s)));\n"
        "freeform(morph(pebble, stone, 0.5 + 0.5 * sin(90deg * (time / 1s)))) {\n"
        "    bump(on: surface(from: way), radius: 0.5, height: 0.2);\n"
        "}\n";
    static Picture last, next;
    ScnScene *scene = load(text);
    ScnStats stats;
    render(scene, 0, &last);
    scn_stats(scene, &stats);
    int builds = stats.kernel_builds, changed = 0;
    for (int frame = 1; frame < 240; frame++) {
        render(scene, frame / 24.0, &next);
        changed += memcmp(last.depth, next.depth, sizeof last.depth) != 0;
        last = next;
    }
    scn_stats(scene, &stats);
    assert_int_equal(stats.kernel_builds, builds);
    assert_int_equal(changed, 239); // it is no still picture
    scn_free(scene);
}

static const char stage[] = "camera { eye: (1.8, 1.2, 5.4); look_at: (0, 0, 0); fov: 32deg; }\n"
                            "light { direction: (-0.9, -1, -0.35); }\n"
                            "let form = freeform(ellipsoid(1, 0.8, 0.7)) {\n"
                            "    bump(at: (0, 0, 1), radius: 0.4, height: 0.2);\n"
                            "    perturb(sphere(0.5).move(0.8, 0.3, 0.2), strength: -2);\n"
                            "};\n"
                            "let set = (box(1.4) - cylinder(radius: 0.4)) | sphere(0.5).move(0.8, 0, 0);\n"
                            "let field_ = field(0.9 - sqrt(x^2 + y^2 + z^2) + 0.1 * sin(9rad * x) * sin(9rad * y));\n"
                            "let _all = [form, set, field_];\n";

static void picture_of(const char *object, Picture *p)
{
    char text[1500];
    snprintf(text, sizeof text, "%sobject shown = %s.paint(#c84);\nscene { shown; }\n", stage, object);
    ScnScene *scene = load(text);
    render(scene, 0, p);
    scn_free(scene);
}

static const char *const kinds[] = {"form", "set", "field_"};

// Where the weight is a number, the other object is not there at all: the picture is the same, bit for bit.
static void a_morph_ends_with_its_objects(void **state)
{
    static Picture morphed, alone;
    for (int k = 0; k < 18; k++) {
        const char *a = kinds[k % 3], *b = kinds[k / 3 % 3];
        char text[100];
        snprintf(text, sizeof text, "morph(%s, %s, %d)", a, b, k / 9);
        picture_of(text, &morphed);
        picture_of(k / 9 ? b : a, &alone);
        if (memcmp(&morphed, &alone, sizeof alone)) fail_msg("%s is not %s", text, k / 9 ? b : a);
    }
}

static double worst(const float *a, const float *b, int count, int *different)
{
    double most = 0;
    for (int k = 0; k < count; k++) {
        if (memcmp(&a[k], &b[k], sizeof *a) == 0) continue;
        ++*different;
        most = fmax(most, fabs((double)a[k] - b[k]));
    }
    return most;
}

// Where the weight moves there are both in one kernel, of which the one has no weight: the same but for rounding.
static void a_morph_that_comes_to_an_end_is_the_object_there(void **state)
{
    static Picture morphed, alone;
    for (int k = 0; k < 4; k++) {
        const char *a = kinds[k % 2], *b = kinds[k % 2 + 1];
        char text[200];
        snprintf(text, sizeof text, "morph(%s, %s, if time >= 0s { %d } else { %d })", a, b, k / 2, 1 - k / 2);
        picture_of(text, &morphed);
        picture_of(k / 2 ? b : a, &alone);
        int different = 0, ids = 0;
        double d = worst(morphed.depth, alone.depth, PIXELS, &different);
        double n = worst(morphed.normal, alone.normal, 3 * PIXELS, &different);
        double c = worst(morphed.color, alone.color, 4 * PIXELS, &different);
        for (int i = 0; i < PIXELS; i++) ids += morphed.id[i] != alone.id[i];
        if (d > 1e-5 || n > 1e-4 || c > 1e-4 || ids)
            fail_msg("%s: %d numbers differ, depth %g normal %g color %g, %d ids", text, different, d, n, c, ids);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_morph_and_a_tool_that_move_build_no_kernel),
        cmocka_unit_test(a_morph_ends_with_its_objects),
        cmocka_unit_test(a_morph_that_comes_to_an_end_is_the_object_there),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
