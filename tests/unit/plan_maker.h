// Plans made by hand, for tests of what takes plans: a scene is told piece by piece, without a text, and its values are random or given. And a ray
// tracer for plans in plain double, to compare with.
//
//     Maker *m = maker_new(7);
//     maker_begin(m, MAKER_FREEFORM); maker_quadric(m, q); maker_perturbation(m, q2, 0.5); maker_end(m);
//     const Plan *plan = maker_plan(m);
//     double t = maker_first(m, eye, direction, 0, INFINITY, 0.01);
//     maker_free(m);
//
// All these scenes have one structure: a union of components of any of the shapes below, in any number. So one kernel renders them all.
#ifndef SCN_TESTS_PLAN_MAKER_H
#define SCN_TESTS_PLAN_MAKER_H

#include <stdbool.h>
#include <stdint.h>

#include "compiler/plan.h"

typedef enum MakerShape {
    MAKER_QUADRIC,  // a quadric
    MAKER_FREEFORM, // a free form
    MAKER_MEET,     // intersect(quadric, quadric, quadric, quadric)
    MAKER_TREE,     // union(intersect(quadric, union(quadric, quadric)), intersect(quadric))
    MAKER_CARVED,   // intersect(free form, quadric, free form)
    MAKER_GROUPED,  // intersect(quadric, group of a union of quadrics, group of an intersection of quadrics)
    MAKER_SHAPES
} MakerShape;

typedef struct Maker Maker;

Maker *maker_new(uint64_t seed);
void maker_free(Maker *m);
void maker_clear(Maker *m); // no components, lights or perturbations any more

// A component. Its leaves are told in order, perturbations after their free form, the quadrics of a group after maker_group().
void maker_begin(Maker *m, MakerShape shape);
void maker_quadric(Maker *m, const double q[10]);
void maker_perturbation(Maker *m, const double q[10], double strength);
void maker_group(Maker *m);
void maker_end(Maker *m);

void maker_camera(Maker *m, const double eye[3], const double look_at[3], double fov, double height, bool orthographic);
void maker_directional(Maker *m, double x, double y, double z);
void maker_point(Maker *m, double x, double y, double z);

// Sorts, numbers; the plan is the maker's until the next change. Its values are plan->image.
const Plan *maker_plan(Maker *m);

// Random numbers, the same everywhere for the same seed: uniform in [low, high).
double maker_random(Maker *m, double low, double high);
int maker_choice(Maker *m, int count);

// Random quadrics about `at`, of a size. Kinds: 0 ellipsoid, 1 one-sheet and 2 two-sheet hyperboloid, 3 cone, 4 paraboloid, 5 saddle, 6 cylinder,
// 7 slab, 8 half-space, 9 anything. Scaled by any factor.
#define MAKER_KINDS 10
void maker_random_quadric(Maker *m, int kind, const double at[3], double size, double q[10]);
void quadric_negate(double q[10]);

// Is the point inside the scene?
bool maker_inside(const Maker *m, const double point[3]);

// The first t in [near, far] at which the ray origin + t direction changes from outside to inside, or from inside to outside if it begins
// inside; infinity if there is none. In double, by the roots of all quadrics; free forms are sampled between them in steps of at most that length.
double maker_first(const Maker *m, const double origin[3], const double direction[3], double near, double far,
                   double step);

#endif
