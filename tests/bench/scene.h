// A benchmark scene in memory: read from JSON or made by a seeded generator, written as SCN or for POV-Ray.
//
// F >= 0 is inside, F = A11 x² + A22 y² + A33 z² + A12 xy + A13 xz + A23 yz + A14 x + A24 y + A34 z + A44; a free form is its base plus the sum of max(Q, 0)³.
// Numbers are written with 17 digits, so that nothing is lost on the way.
#ifndef SCN_TESTS_BENCH_SCENE_H
#define SCN_TESTS_BENCH_SCENE_H

#include <stdbool.h>
#include <stdio.h>

#include "lang/arena.h"

typedef enum BenchKind { BENCH_QUADRIC, BENCH_FREEFORM, BENCH_UNION, BENCH_INTERSECT, BENCH_SUBTRACT } BenchKind;

typedef struct BenchNode {
    int kind;            // BenchKind
    double q[10];        // BENCH_QUADRIC; BENCH_FREEFORM: the base
    int count;           // perturbations or children
    double (*parts)[10]; // perturbations
    struct BenchNode *children;
} BenchNode;

typedef struct BenchScene {
    const char *name;
    double eye[3], look_at[3], up[3], fov; // degrees, vertical
    double light[3];                       // towards the light
    double color[3], ambient, diffuse, specular, shininess, background[3];
    double bound; // everything is inside the ball of this radius around the origin
    BenchNode root;
} BenchScene;

// Reads a scene from JSON: {"name", "bound_radius", "camera", "light", "material", "objects": […]}. Returns false and says why.
bool bench_read_json(Arena *arena, const char *path, BenchScene *scene, char why[200]);

// A unit sphere with `count` ellipsoidal perturbations of constant summed area; the same for the same seed on every machine.
void bench_freeform(Arena *arena, const char *name, int count, unsigned seed, BenchScene *scene);
// Three slabs minus three cylinders, united with twenty spheres.
void bench_sets(Arena *arena, const char *name, unsigned seed, BenchScene *scene);
// A union of `count` small spheres (balls true) or ellipsoids of any direction in the unit ball.
void bench_union(Arena *arena, const char *name, int count, bool balls, unsigned seed, BenchScene *scene);

void bench_write_scn(const BenchScene *scene, FILE *out);
void bench_write_pov(const BenchScene *scene, FILE *out);

#endif
