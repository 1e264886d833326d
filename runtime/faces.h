// Which surfaces of a frame lie in each other, so that all of them have the same numbers.
//
// What is cut flush and what stands side by side have faces in one place, but rarely the same coefficients: a slab's plane is one of two roots of its
// quadric, and every transform rounds. Set operations decide such faces by comparing places on rays, so these must be equal bit for bit. Here the
// planes of slabs and half-spaces are taken out of their quadrics, in double, and those that differ by rounding become one plane; so do quadrics with
// curved surfaces that are, but for a factor, equal up to rounding. Views are then folded from these numbers (runtime/fold.h).
//
//     Faces faces;
//     if (!faces_init(&faces, plan)) …no memory…
//     faces_frame(&faces, values);             // once a frame, before any fold
//     const LeafFace *face = &faces.leaves[k]; // of plan->leaves[k]; of the kinds LEAF_QUADRIC and LEAF_FREEFORM
//     faces_release(&faces);
//
// "Rounding" is 1e-9 of a slab's middle and thickness for planes, 1e-14 of the largest coefficient for quadrics: far below what a float can tell.
#ifndef SCN_RUNTIME_FACES_H
#define SCN_RUNTIME_FACES_H

#include <stdbool.h>
#include <stdint.h>

#include "compiler/plan.h"

typedef struct Plane { // n·X = at, n of length 1
    double normal[3], at;
} Plane;

typedef enum FaceKind {
    FACE_QUADRIC,   // Q = factor * quadric
    FACE_SLAB,      // Q = factor * (n·X - at) (n·X - at) of two planes, that face the same way
    FACE_HALFSPACE, // Q = factor * (n·X - at)
} FaceKind;

typedef struct LeafFace {
    FaceKind kind;
    double factor;
    union {
        double quadric[10];
        Plane planes[2];
    };
} LeafFace;

typedef struct Faces {
    const Plan *plan;
    LeafFace *leaves; // of each leaf of the plan
    double *before;   // the coefficients they were made of, ten of each leaf
    struct FaceSearch *search;
    bool known; // `before` holds a frame's
} Faces;

bool faces_init(Faces *faces, const Plan *plan);
void faces_release(Faces *faces);

// Takes a frame's coefficients. Costs a comparison of them where none has changed.
void faces_frame(Faces *faces, const double *values);

// The planes of a quadric that is a slab or a half-space (or the complement of one), as far as doubles can tell. Their normals face the way that
// equal planes of opposite quadrics do too.
FaceKind face_planes(const double quadric[10], LeafFace *face);

#endif
