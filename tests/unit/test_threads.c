// Scenes in several threads. This is a program of its own, since the first calls of a process, at which drivers start, are what it is about.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/scn.h"

enum { WIDTH = 40, HEIGHT = 30, THREADS = 4, FRAMES = 8 };

typedef struct Worker {
    pthread_t thread;
    pthread_barrier_t *begin;
    const char *text, *wrong;
    char error[600];
    float first[WIDTH * HEIGHT * 4], last[WIDTH * HEIGHT * 4];
} Worker;

// Frames of a handle that moves, the last where the first was. Assertions belong to the main thread.
static void *render_frames(void *data)
{
    Worker *w = data;
    pthread_barrier_wait(w->begin);
    ScnScene *scene =
        scn_load(&(ScnSceneDesc){.bytes = w->text, .size = strlen(w->text), .device = "cpu", .quick = true});
    for (int i = 0; i < FRAMES && !w->wrong; i++) {
        double size = 1 + (i + 1 < FRAMES ? 0.1 * i : 0);
        ScnFrameDesc frame = {.width = WIDTH, .height = HEIGHT, .color = i ? w->last : w->first};
        if (scn_set(scene, "size", &size, 1) != SCN_OK) w->wrong = "scn_set";
        if (scn_render(scene, &frame) != SCN_OK) w->wrong = "scn_render";
    }
    snprintf(w->error, sizeof w->error, "%s", scn_error(scene));
    scn_free(scene);
    return NULL;
}

static void scenes_are_rendered_in_many_threads_at_once(void **state)
{
    static const char *const texts[] = {"param size: scalar = 1; sphere(size) - cylinder(0.4);",
                                        "param size: scalar = 1; box(size) | sphere(0.5).move(size, 0, 0);"};
    static Worker workers[THREADS];
    pthread_barrier_t begin;
    pthread_barrier_init(&begin, NULL, THREADS);
    for (int k = 0; k < THREADS; k++) {
        workers[k].begin = &begin;
        workers[k].text = texts[k % 2];
        assert_int_equal(pthread_create(&workers[k].thread, NULL, render_frames, &workers[k]), 0);
    }
    for (int k = 0; k < THREADS; k++) pthread_join(workers[k].thread, NULL);
    pthread_barrier_destroy(&begin);
    for (int k = 0; k < THREADS; k++) {
        if (workers[k].wrong) fail_msg("%s in thread %d: %s", workers[k].wrong, k, workers[k].error);
        assert_memory_equal(workers[k].first, workers[k].last, sizeof workers[k].first);
        assert_memory_equal(workers[k].first, workers[k % 2].first, sizeof workers[k].first);
    }
}

static char cache[] = "/tmp/scn-threads-XXXXXX";

static int set_up(void **state)
{
    return mkdtemp(cache) && !setenv("XDG_CACHE_HOME", cache, 1) ? 0 : 1;
}

static int tear_down(void **state)
{
    char command[300];
    snprintf(command, sizeof command, "rm -r '%s'", cache);
    return system(command) ? 1 : 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scenes_are_rendered_in_many_threads_at_once),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
