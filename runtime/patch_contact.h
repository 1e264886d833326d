// What pushes a patch when something touches it, and how a step takes that in.
//
// A contact law sees the nodes at places a, and adds to each node a force and a stiffness κ, which says how fast the
// force goes down as the node yields:
//
//     f(w) = force − κ (w − a)
//
// The step solves with it: (L + μ + κ) e = f + force + κ (a − x − θ dt V) − ηV − L(x + θ dt V). The law is asked
// PATCH_CONTACT_PASSES times a step, at a = x first, where a node that rests on something stays as it is, and then
// where the step with that answer would carry the nodes, which catches those that arrive. κ has to be as large as the
// law's own derivative: then the force is implicit and no stiffness and no step makes nodes bounce off; a force without
// κ is good for small steps only. (Asking at x + θ dt V instead makes nodes chatter in and out at large steps: it does
// not know how fast the patch springs back.)
//
// The law here: solids given as quadrics F >= 0, as the language's are. A node inside is pushed out along n = −∇F/|∇F|
// with k times its depth, the length from the node along n to the surface, and κ = k.
#ifndef SCN_RUNTIME_PATCH_CONTACT_H
#define SCN_RUNTIME_PATCH_CONTACT_H

#define PATCH_CONTACT_PASSES 2

// The nodes of all three components, and what a law adds to. Arrays over nodes.
typedef struct PatchTouch {
    int nodes;
    const double *x[3]; // places
    const double *v[3]; // velocities
    double *force[3];
    double *stiffness; // κ, the same for the three components; never negative
} PatchTouch;

typedef void PatchContactLaw(void *context, const PatchTouch *touch);

// F = A11 x² + A22 y² + A33 z² + A12 xy + A13 xz + A23 yz + A14 x + A24 y + A34 z + A44, in that order.
typedef struct PatchSolid {
    double quadric[10];
    double stiffness; // k
} PatchSolid;

typedef struct PatchSolids {
    const PatchSolid *solids;
    int count;
} PatchSolids;

// A PatchContactLaw whose context is a PatchSolids. A node inside several is pushed by each.
void patch_contact_solids(void *context, const PatchTouch *touch);

#endif
