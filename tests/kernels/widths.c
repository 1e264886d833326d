// Packets of 1 ray and of 16 must see the same: what a GPU runs (1) is tested on the processor this way.
//
//     test-widths SCENE.scn …
//
// The two kernels do the same operations in the same order, but the device's compiler may join a multiplication and an addition in one and not in the other. So
// they may differ by rounding: at most ULPS units in the last place of the largest value of the layer, for all but EDGES of the pixels, where a ray passes an edge.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/scn.h"

enum { WIDTH = 160, HEIGHT = 120, ULPS = 64 };
static const double EDGES = 0.002;

typedef struct Picture {
    float color[WIDTH * HEIGHT * 4], depth[WIDTH * HEIGHT], normal[WIDTH * HEIGHT * 3];
    uint32_t id[WIDTH * HEIGHT];
} Picture;

static bool render(const char *path, int lanes, Picture *picture)
{
    ScnScene *scene = scn_load(&(ScnSceneDesc){.path = path, .lanes = lanes});
    ScnFrameDesc frame = {.width = WIDTH,
                          .height = HEIGHT,
                          .color = picture->color,
                          .depth = picture->depth,
                          .normal = picture->normal,
                          .id = picture->id};
    bool good = scene && scn_status(scene) == SCN_OK && scn_render(scene, &frame) == SCN_OK;
    if (!good) printf("%s: %s\n", path, scene ? scn_error(scene) : "no memory");
    scn_free(scene);
    return good;
}

static bool near_enough(float a, float b, float largest)
{
    return a == b || fabsf(a - b) <= ULPS * 0x1p-24f * fmaxf(fabsf(a), largest);
}

static bool compare(const char *path, const Picture *a, const Picture *b)
{
    float far = 0;
    int differ = 0, exact = 0;
    for (int k = 0; k < WIDTH * HEIGHT; k++) {
        if (isfinite(a->depth[k])) far = fmaxf(far, a->depth[k]);
    }
    for (int k = 0; k < WIDTH * HEIGHT; k++) {
        bool same = a->id[k] == b->id[k] && near_enough(a->depth[k], b->depth[k], far);
        bool equal = a->id[k] == b->id[k] && a->depth[k] == b->depth[k] &&
                     !memcmp(a->color + 4 * k, b->color + 4 * k, 4 * sizeof(float));
        for (int i = 0; i < 3; i++) {
            same &= fabsf(a->normal[3 * k + i] - b->normal[3 * k + i]) <= 1e-3f &&
                    fabsf(a->color[4 * k + i] - b->color[4 * k + i]) <= 2e-3f;
        }
        differ += !same;
        exact += equal;
    }
    bool good = differ <= EDGES * WIDTH * HEIGHT;
    printf("%s: %.2f %% equal to the last bit, %d of %d pixels differ%s\n", path, 100.0 * exact / (WIDTH * HEIGHT),
           differ, WIDTH * HEIGHT, good ? "" : ": too many");
    return good;
}

int main(int argc, char **argv)
{
    Picture *wide = malloc(sizeof *wide), *narrow = malloc(sizeof *narrow);
    bool good = wide && narrow && argc > 1;
    for (int k = 1; k < argc; k++)
        good &= render(argv[k], 16, wide) && render(argv[k], 1, narrow) && compare(argv[k], wide, narrow);
    free(wide);
    free(narrow);
    return good ? 0 : 1;
}
