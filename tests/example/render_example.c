// A program that uses libscn: it renders a scene that it has in memory from two sides, and stops a third picture half
// way.
//
//     cc render_example.c $(pkg-config --cflags --libs scn) -lpthread
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <scn.h>

static const char scene_text[] = "scn 1;\n"
                                 "param side: angle = 0deg;\n"
                                 "camera { eye: (4 * sin(side), 1.5, 4 * cos(side)); }\n"
                                 "light { direction: (-1, -2, -1.5); }\n"
                                 "scene { sphere(1) - cylinder(radius: 0.4); }\n";

enum { WIDTH = 160, HEIGHT = 120 };

static void *cancel_soon(void *scene)
{
    scn_cancel(scene);
    return NULL;
}

// How many pixels show the object.
static int covered(const float *pixels)
{
    int count = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) count += pixels[4 * i + 3] > 0.5f;
    return count;
}

int main(void)
{
    ScnScene *scene = scn_load(&(ScnSceneDesc){.path = "example.scn", .bytes = scene_text, .size = strlen(scene_text)});
    if (!scene || scn_status(scene) != SCN_OK) {
        fprintf(stderr, "%s%s\n", scene ? scn_diagnostics_text(scene, false) : "",
                scene ? scn_error(scene) : "out of memory");
        scn_free(scene);
        return 1;
    }
    float *pixels = malloc((size_t)WIDTH * HEIGHT * 4 * sizeof *pixels);
    ScnStatus status = SCN_OK;
    for (int i = 0; i < 2 && status == SCN_OK; i++) {
        status = scn_set_text(scene, "side", i ? "40deg" : "10deg");
        if (status == SCN_OK)
            status = scn_render(scene, &(ScnFrameDesc){.width = WIDTH, .height = HEIGHT, .color = pixels});
        if (status == SCN_OK) printf("picture %d shows the object in %d pixels\n", i, covered(pixels));
    }

    // Another thread may stop a rendering at any time.
    pthread_t thread;
    if (status == SCN_OK && !pthread_create(&thread, NULL, cancel_soon, scene)) {
        pthread_join(thread, NULL);
        ScnStatus stopped = scn_render(scene, &(ScnFrameDesc){.width = WIDTH, .height = HEIGHT, .color = pixels});
        printf("the third picture was %s\n", stopped == SCN_CANCELLED ? "stopped" : "not stopped");
    }

    ScnStats stats;
    scn_stats(scene, &stats);
    printf("%d kernels built for %llu frames\n", stats.kernel_builds, (unsigned long long)stats.frames);
    if (status != SCN_OK) fprintf(stderr, "%s\n", scn_error(scene));
    free(pixels);
    scn_free(scene);
    return status != SCN_OK;
}
