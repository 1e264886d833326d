// The public API as a program sees it: only scn.h is included.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "runtime/scn.h"

enum { WIDTH = 64, HEIGHT = 48 };

static ScnScene *load_text(const char *text)
{
    ScnScene *scene =
        scn_load(&(ScnSceneDesc){.path = "test.scn", .bytes = text, .size = strlen(text), .device = "cpu"});
    assert_non_null(scene);
    return scene;
}

static ScnScene *load(const char *text)
{
    ScnScene *scene = load_text(text);
    if (scn_status(scene) != SCN_OK) fail_msg("%s%s", scn_diagnostics_text(scene, false), scn_error(scene));
    return scene;
}

static void assert_ok(const ScnScene *scene, ScnStatus status)
{
    if (status != SCN_OK) fail_msg("status %d: %s", status, scn_error(scene));
}

static const char ball[] = "scn 1;\n"
                           "/// How big it is.\n"
                           "param size: scalar = 1 in 0.1..2;\n"
                           "param side: angle = 0deg;\n"
                           "param shift: vec3 = (0, 0, 0);\n"
                           "param count: int = 1;\n"
                           "camera { eye: (5 * sin(side), 0, 5 * cos(side)); fov: 40deg; }\n"
                           "light { direction: (0, 0, -1); }\n"
                           "material clay { color: (1, 0.5, 0.25); ambient: 0.5; diffuse: 0.5; specular: 0; }\n"
                           "background { color: (0, 0, 0.25); }\n"
                           "object ball = sphere(size).move(shift);\n"
                           "scene { ball.paint(clay); }\n";

static void a_frame_has_every_layer(void **state)
{
    ScnScene *scene = load(ball);
    static float color[WIDTH * HEIGHT * 4], depth[WIDTH * HEIGHT], normal[WIDTH * HEIGHT * 3],
        position[WIDTH * HEIGHT * 3];
    static uint32_t id[WIDTH * HEIGHT];
    assert_ok(scene, scn_render(scene, &(ScnFrameDesc){.width = WIDTH,
                                                       .height = HEIGHT,
                                                       .color = color,
                                                       .depth = depth,
                                                       .normal = normal,
                                                       .position = position,
                                                       .id = id}));
    int middle = HEIGHT / 2 * WIDTH + WIDTH / 2;
    // The ray goes through the corner of four pixels' middles: half a pixel from the axis.
    assert_true(fabsf(depth[middle] - 4) < 0.01f);
    assert_true(normal[3 * middle + 2] > 0.99f);
    assert_true(fabsf(position[3 * middle + 2] - 1) < 0.01f);
    assert_string_equal(scn_object_name(scene, (int)id[middle] - 1), "ball");
    assert_true(color[4 * middle + 3] == 1 && color[4 * middle] > 0.97f && color[4 * middle] < 1.01f);
    assert_true(fabsf(color[4 * middle + 1] - color[4 * middle] / 2) < 0.01f);
    // The corner is background.
    assert_true(color[0] == 0 && color[2] == 0.25f && color[3] == 0);
    assert_true(isinf(depth[0]) && id[0] == 0 && normal[0] == 0 && normal[2] == 0);
    scn_free(scene);
}

static int covered(ScnScene *scene)
{
    static uint32_t id[WIDTH * HEIGHT];
    assert_ok(scene, scn_render(scene, &(ScnFrameDesc){.width = WIDTH, .height = HEIGHT, .id = id}));
    int count = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) count += id[i] != 0;
    return count;
}

static void handles_move_without_a_build(void **state)
{
    ScnScene *scene = load(ball);
    int before = covered(scene);
    ScnStats stats;
    scn_stats(scene, &stats);
    int builds = stats.kernel_builds;
    assert_ok(scene, scn_set_text(scene, "size", "2"));
    assert_true(covered(scene) > 3 * before);
    assert_ok(scene, scn_set(scene, "shift", (double[]){100, 0, 0}, 3));
    assert_int_equal(covered(scene), 0);
    assert_ok(scene, scn_set_text(scene, "shift", "0,0,0"));
    assert_ok(scene, scn_set_text(scene, "side", "30deg"));
    assert_true(covered(scene) > 3 * before);
    scn_stats(scene, &stats);
    assert_int_equal(stats.kernel_builds, builds);
    assert_int_equal(stats.frames, 4);
    assert_true(stats.rays >= 4 * WIDTH * HEIGHT);
    scn_free(scene);
}

// Rays of one frame.
static uint64_t rays_of(ScnScene *scene, const ScnFrameDesc *frame)
{
    ScnStats before, after;
    scn_stats(scene, &before);
    assert_ok(scene, scn_render(scene, frame));
    scn_stats(scene, &after);
    return after.rays - before.rays;
}

// Every place of the ball that the eye sees faces the light, which shines past it.
static void rays_are_counted(void **state)
{
    enum { PIXELS = WIDTH * HEIGHT };
    ScnScene *scene = load(ball),
             *turned_away = load("camera { eye: (0, 0, 5); } light { direction: (0, 0, 1); } sphere(1);"),
             *unlit = load("camera { eye: (0, 0, 5); } light { direction: (0, 0, -1); shadow: false; } sphere(1);");
    ScnFrameDesc frame = {.width = WIDTH, .height = HEIGHT, .layers = SCN_LAYER_COLOR};
    uint64_t hits = (uint64_t)covered(scene);
    assert_int_equal(rays_of(scene, &frame), PIXELS + hits);
    assert_int_equal(rays_of(turned_away, &frame), PIXELS);
    assert_int_equal(rays_of(unlit, &frame), PIXELS);
    // The places of 3 x 3 samples are those of a picture of three times the size.
    uint64_t large =
        rays_of(scene, &(ScnFrameDesc){.width = 3 * WIDTH, .height = 3 * HEIGHT, .layers = SCN_LAYER_COLOR});
    frame.samples = 3;
    uint64_t sampled = rays_of(scene, &frame);
    assert_true(sampled > large - 4 && sampled < large + 4);
    frame.samples = 1;
    frame.layers = SCN_LAYER_DEPTH; // nothing is lit
    assert_int_equal(rays_of(scene, &frame), PIXELS);
    frame.layers = SCN_LAYER_COLOR;
    frame.width = 5; // half a packet
    frame.height = 3;
    uint64_t few = rays_of(scene, &frame);
    assert_true(few > 15 && few <= 30);
    scn_free(scene);
    scn_free(turned_away);
    scn_free(unlit);
}

typedef struct Told {
    ScnScene *scene;
    int count;
    double last;
    bool falls, cancels;
} Told;

static void on_progress(void *data, double share)
{
    Told *told = data;
    told->falls |= share < told->last || share > 1;
    told->last = share;
    told->count++;
    if (told->cancels && share > 0.5) scn_cancel(told->scene);
}

static void progress_is_told_and_may_cancel(void **state)
{
    ScnScene *scene = load(ball);
    Told told = {.scene = scene};
    ScnFrameDesc frame = {.width = 512, .height = 512, .samples = 3, .layers = SCN_LAYER_COLOR};
    frame.progress = on_progress;
    frame.progress_data = &told;
    assert_ok(scene, scn_render(scene, &frame));
    assert_true(told.count >= 9 && told.last > 0.8 && !told.falls);
    told = (Told){.scene = scene, .cancels = true};
    assert_int_equal(scn_render(scene, &frame), SCN_CANCELLED);
    assert_true(told.last > 0.5 && told.last < 0.9);
    scn_free(scene);
}

static void params_are_listed_and_checked(void **state)
{
    ScnScene *scene = load(ball);
    assert_int_equal(scn_param_count(scene), 4);
    ScnParam param;
    assert_true(scn_param(scene, 0, &param));
    assert_string_equal(param.name, "size");
    assert_string_equal(param.doc, "How big it is.");
    assert_true(param.ranged && param.low == 0.1 && param.high == 2 && param.value[0] == 1 && !param.structure);
    assert_ok(scene, scn_set_text(scene, "side", "180deg"));
    assert_true(scn_param(scene, 1, &param));
    assert_true(param.type == SCN_PARAM_ANGLE && fabs(param.value[0] - acos(-1)) < 1e-12 && param.initial[0] == 0);
    assert_true(scn_param(scene, 3, &param) && param.structure);
    assert_false(scn_param(scene, 4, &param));

    assert_int_equal(scn_set_text(scene, "syze", "1"), SCN_CALL_WRONG);
    assert_non_null(strstr(scn_error(scene), "do you mean size?"));
    assert_int_equal(scn_set_text(scene, "side", "90"), SCN_CALL_WRONG); // an angle needs a unit
    assert_int_equal(scn_set_text(scene, "size", "3"), SCN_CALL_WRONG);  // out of its range
    assert_int_equal(scn_set_text(scene, "size", "x"), SCN_CALL_WRONG);
    assert_int_equal(scn_set(scene, "shift", (double[]){1, 2}, 2), SCN_CALL_WRONG);
    assert_int_equal(scn_set(scene, "size", (double[]){NAN}, 1), SCN_CALL_WRONG);
    assert_int_equal(scn_set(scene, "count", (double[]){2}, 1), SCN_CALL_WRONG); // it is structure
    assert_non_null(strstr(scn_error(scene), "loaded"));
    scn_free(scene);
}

static void structure_is_set_when_loading(void **state)
{
    static const char text[] =
        "scn 1; param n: int = 1; object a { for i in 0..n { sphere(0.1).move(i, 0, 0); } } scene { a; }";
    ScnSetting setting = {"n", "7"};
    ScnScene *scene = scn_load(&(ScnSceneDesc){
        .path = "n.scn", .bytes = text, .size = sizeof text - 1, .settings = &setting, .setting_count = 1});
    assert_ok(scene, scn_status(scene));
    ScnInfo info;
    assert_true(scn_info(scene, &info));
    assert_int_equal(info.quadrics, 7);
    scn_free(scene);
}

static void a_wrong_scene_has_diagnostics_with_places(void **state)
{
    ScnScene *scene = load_text("scn 1;\nobject a = sphere(1).rotate(y: 90);\nscene { a; }\n");
    assert_int_equal(scn_status(scene), SCN_SCENE_WRONG);
    assert_int_equal(scn_diagnostic_count(scene), 1);
    ScnDiagnostic d;
    assert_true(scn_diagnostic(scene, 0, &d));
    assert_string_equal(d.severity, "error");
    assert_string_equal(d.code, "angle-unit");
    assert_string_equal(d.path, "test.scn");
    assert_int_equal(d.line, 2);
    assert_int_equal(d.column, 32);
    assert_false(scn_diagnostic(scene, 1, &d));
    assert_non_null(strstr(scn_diagnostics_text(scene, false), "test.scn:2:32: error:"));
    assert_null(strchr(scn_diagnostics_text(scene, false), '\033'));
    assert_non_null(strchr(scn_diagnostics_text(scene, true), '\033'));
    ScnInfo info;
    assert_false(scn_info(scene, &info));
    assert_int_equal(scn_render(scene, &(ScnFrameDesc){.width = 8, .height = 8, .layers = SCN_LAYER_COLOR}),
                     SCN_SCENE_WRONG);
    assert_int_equal(scn_set(scene, "x", NULL, 0), SCN_SCENE_WRONG);
    scn_free(scene);
}

static void a_frame_that_fails_says_where(void **state)
{
    ScnScene *scene = load("scn 1;\nparam r: scalar = 1;\nassert r < 2, \"too big\";\nscene { sphere(1 / r); }\n");
    uint32_t id[64];
    ScnFrameDesc frame = {.width = 8, .height = 8, .id = id};
    assert_ok(scene, scn_render(scene, &frame));
    assert_ok(scene, scn_set(scene, "r", (double[]){3}, 1));
    assert_int_equal(scn_render(scene, &frame), SCN_SCENE_WRONG);
    assert_non_null(strstr(scn_error(scene), "test.scn:3:"));
    assert_non_null(strstr(scn_error(scene), "too big"));
    assert_ok(scene, scn_set(scene, "r", (double[]){0}, 1));
    assert_int_equal(scn_render(scene, &frame), SCN_SCENE_WRONG);
    assert_non_null(strstr(scn_error(scene), "test.scn:4:"));
    assert_ok(scene, scn_set(scene, "r", (double[]){1}, 1));
    assert_ok(scene, scn_render(scene, &frame)); // the scene is not lost
    scn_free(scene);
}

static void files_that_are_missing_are_told(void **state)
{
    ScnScene *scene = scn_load(&(ScnSceneDesc){.path = "/nonexistent/eye.scn"});
    assert_int_equal(scn_status(scene), SCN_WORLD_FAILED);
    assert_non_null(strstr(scn_error(scene), "/nonexistent/eye.scn"));
    scn_free(scene);
    scene = scn_load(&(ScnSceneDesc){.path = "/tmp"});
    assert_int_equal(scn_status(scene), SCN_WORLD_FAILED);
    scn_free(scene);
    scn_free(NULL);
}

static void sizes_have_limits(void **state)
{
    ScnScene *scene = load(ball);
    assert_int_equal(scn_render(scene, &(ScnFrameDesc){.width = 0, .height = 8, .layers = 1}), SCN_CALL_WRONG);
    assert_int_equal(scn_render(scene, &(ScnFrameDesc){.width = 100000, .height = 8, .layers = 1}), SCN_CALL_WRONG);
    assert_int_equal(scn_render(scene, &(ScnFrameDesc){.width = 8, .height = 8}), SCN_CALL_WRONG); // nothing is wanted
    assert_int_equal(scn_render(scene, &(ScnFrameDesc){.width = 8, .height = 8, .layers = 1, .samples = 100}),
                     SCN_CALL_WRONG);
    assert_int_equal(scn_write_image(scene, "/tmp/x.png", &(ScnImageDesc){0}), SCN_CALL_WRONG); // nothing was rendered
    assert_ok(scene, scn_render(scene, &(ScnFrameDesc){.width = 8, .height = 8, .layers = 1}));
    assert_int_equal(scn_write_image(scene, "/tmp/x.png", &(ScnImageDesc){.bits = 10}), SCN_CALL_WRONG);
    scn_free(scene);
}

static void descriptions_are_checked(void **state)
{
    const ScnSceneDesc wrong[] = {
        {.bytes = ball, .size = sizeof ball - 1, .lanes = 4},
        {.bytes = ball, .size = sizeof ball - 1, .threads = -1},
        {.bytes = ball, .size = sizeof ball - 1, .solver = "guess"},
        {0},
    };
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        ScnScene *scene = scn_load(&wrong[k]);
        assert_int_equal(scn_status(scene), SCN_CALL_WRONG);
        assert_true(scn_error(scene)[0] != 0);
        assert_int_equal(scn_render(scene, &(ScnFrameDesc){.width = 8, .height = 8, .layers = 1}), SCN_CALL_WRONG);
        scn_free(scene);
    }
}

static void scenes_without_a_camera_are_framed(void **state)
{
    ScnScene *scene = load("scn 1; scene { sphere(0.001).move(500, 20, 3); }");
    ScnInfo info;
    scn_info(scene, &info);
    assert_true(info.automatic_camera);
    int count = covered(scene);
    assert_true(count > WIDTH * HEIGHT / 4 && count < WIDTH * HEIGHT * 3 / 4);
    scn_free(scene);
}

static void samples_smooth_edges(void **state)
{
    ScnScene *scene = load(ball);
    static float color[WIDTH * HEIGHT * 4];
    int between = 0;
    assert_ok(scene,
              scn_render(scene, &(ScnFrameDesc){.width = WIDTH, .height = HEIGHT, .color = color, .samples = 4}));
    for (int i = 0; i < WIDTH * HEIGHT; i++) between += color[4 * i + 3] > 0 && color[4 * i + 3] < 1;
    assert_true(between > 20);
    scn_free(scene);
}

static void *cancel_later(void *scene)
{
    nanosleep(&(struct timespec){0, 30000000}, NULL);
    scn_cancel(scene);
    return NULL;
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static void a_rendering_is_cancelled_from_another_thread(void **state)
{
    ScnScene *scene = load(ball);
    assert_ok(scene, scn_prepare(scene));
    static float color[16];
    assert_ok(scene, scn_render(scene, &(ScnFrameDesc){.width = 2, .height = 2, .color = color}));
    scn_cancel(scene);
    assert_int_equal(scn_render(scene, &(ScnFrameDesc){.width = 2, .height = 2, .color = color}), SCN_CANCELLED);
    assert_ok(scene, scn_render(scene, &(ScnFrameDesc){.width = 2, .height = 2, .color = color})); // it holds once

    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, cancel_later, scene), 0);
    double start = seconds();
    ScnStatus status =
        scn_render(scene, &(ScnFrameDesc){.width = 4096, .height = 4096, .samples = 8, .layers = SCN_LAYER_COLOR});
    double took = seconds() - start;
    pthread_join(thread, NULL);
    assert_int_equal(status, SCN_CANCELLED);
    assert_true(
        took < 20); // far from the minute that the picture takes, also on a busy machine; tests/cli measures it closely
    scn_free(scene);
}

static void a_package_gives_the_same_picture(void **state)
{
    char path[] = "/tmp/scn-api-XXXXXX.scnk";
    close(mkstemps(path, 5));
    static float color[2][WIDTH * HEIGHT * 4];
    ScnScene *scene = load(ball);
    ScnFrameDesc frame = {.width = WIDTH, .height = HEIGHT, .color = color[0]};
    assert_ok(scene, scn_render(scene, &frame));
    assert_ok(scene, scn_write_package(scene, path, false, NULL));
    scn_free(scene);

    scene = scn_load(&(ScnSceneDesc){.path = path, .device = "cpu", .no_cache = true});
    assert_ok(scene, scn_status(scene));
    ScnInfo info;
    scn_info(scene, &info);
    assert_true(info.package);
    assert_int_equal(info.binaries, 1);
    frame.color = color[1];
    assert_ok(scene, scn_render(scene, &frame));
    assert_memory_equal(color[0], color[1], sizeof color[0]);
    ScnStats stats;
    scn_stats(scene, &stats);
    assert_int_equal(stats.kernel_builds, 0);
    assert_true(stats.from_binary);
    scn_free(scene);
    unlink(path);
}

// Quick kernels give the same picture, and a package is made with the others.
static void quick_kernels_give_the_same_picture(void **state)
{
    char path[] = "/tmp/scn-api-XXXXXX.scnk";
    close(mkstemps(path, 5));
    static float color[2][WIDTH * HEIGHT * 4];
    ScnScene *scene =
        scn_load(&(ScnSceneDesc){.bytes = ball, .size = sizeof ball - 1, .quick = true, .no_cache = true});
    assert_ok(scene, scn_render(scene, &(ScnFrameDesc){.width = WIDTH, .height = HEIGHT, .color = color[0]}));
    assert_ok(scene, scn_write_package(scene, path, false, NULL));
    scn_free(scene);
    scene = scn_load(&(ScnSceneDesc){.path = path, .quick = true, .no_cache = true}); // what is ready is taken
    assert_ok(scene, scn_render(scene, &(ScnFrameDesc){.width = WIDTH, .height = HEIGHT, .color = color[1]}));
    ScnStats stats;
    scn_stats(scene, &stats);
    assert_true(stats.from_binary && !stats.quick && stats.kernel_builds == 0);
    assert_memory_equal(color[0], color[1], sizeof color[0]);
    scn_free(scene);
    unlink(path);
}

static char cache[] = "/tmp/scn-api-cache-XXXXXX";

static int set_up(void **state)
{
    return mkdtemp(cache) && !setenv("XDG_CACHE_HOME", cache, 1) ? 0 : 1;
}

static int tear_down(void **state)
{
    char command[100];
    snprintf(command, sizeof command, "rm -r '%s'", cache);
    return system(command) ? 1 : 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_frame_has_every_layer),
        cmocka_unit_test(handles_move_without_a_build),
        cmocka_unit_test(rays_are_counted),
        cmocka_unit_test(progress_is_told_and_may_cancel),
        cmocka_unit_test(params_are_listed_and_checked),
        cmocka_unit_test(structure_is_set_when_loading),
        cmocka_unit_test(a_wrong_scene_has_diagnostics_with_places),
        cmocka_unit_test(a_frame_that_fails_says_where),
        cmocka_unit_test(files_that_are_missing_are_told),
        cmocka_unit_test(sizes_have_limits),
        cmocka_unit_test(descriptions_are_checked),
        cmocka_unit_test(scenes_without_a_camera_are_framed),
        cmocka_unit_test(samples_smooth_edges),
        cmocka_unit_test(a_rendering_is_cancelled_from_another_thread),
        cmocka_unit_test(a_package_gives_the_same_picture),
        cmocka_unit_test(quick_kernels_give_the_same_picture),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
