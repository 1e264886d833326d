// What the host (runtime/patch_device.c) and kernels/patch.cl share. The same text is compiled by both sides: members
// are int and float, 32 bits each on both; sizes are asserted in runtime/patch_device.c.
//
// A slot is one component of one patch: slot = 3 · patch + component. Each has a record, a result, and its part of the
// buffers.
#ifndef SCN_KERNELS_PATCH_SHARED_H
#define SCN_KERNELS_PATCH_SHARED_H

typedef struct PatchRecord {
    float b, c, d; // stiffness
    float mu, eta; // μ and η of the step, as in runtime/patch_model.h
    float dt, theta;
    float force;     // the same at all nodes
    float limit;     // root mean square of the places beyond which the slot diverges
    float tolerance; // of conjugate gradients, relative
    int iterations;  // at most
    int steps;       // to do in the next launch; 0: the slot rests
    int pins;        // of the patch
    int flags;       // PATCH_HAS_…
    int epoch;       // a result of another epoch is forgotten
    int spare;
} PatchRecord;

#define PATCH_HAS_FORCE 1 // forces of its own at the nodes
#define PATCH_HAS_TOUCH 2 // a contact's forces and stiffnesses at the nodes

typedef struct PatchResult {
    int epoch;
    int status;     // SLOT_…: a slot that is not fine rests, with its last good shape
    int steps;      // done in this epoch
    int iterations; // most in a step of the last launch
    float residual; // largest at the end of a step of the last launch, relative
    float size;     // root mean square of the places; of those refused where it diverged
    int spare[2];
} PatchResult;

#define SLOT_FINE       0
#define SLOT_DIVERGED   1
#define SLOT_INDEFINITE 2 // conjugate gradients met a direction of no positive energy

// A solid that pushes: quadric F >= 0 (the ten coefficients in the language's order) of stiffness k, for one patch.
typedef struct PatchSolidRecord {
    float quadric[10];
    float stiffness;
    int patch;
} PatchSolidRecord;

#define PATCH_MAX_PINS 64 // of a patch

// Modes a side are 2 span, span being `half`, padded as in runtime/patch_modes.h. Arrays of a slot are over modes, 2
// span × 2 span floats, first those of the state, which last, then scratch.
#define STATE_X      0
#define STATE_V      1
#define STATE_ARRAYS 2
#define WORK_AHEAD   0 // x + θ dt V
#define WORK_E       1 // the increment; stays from a trial to the step that follows
#define WORK_R       2
#define WORK_P       3
#define WORK_A       4
#define WORK_D       5 // inverse diagonal
#define WORK_S       6
#define WORK_T       7
#define WORK_KAPPA   8 // a contact's stiffness, mirrored nodes where their combinations are
#define WORK_ARRAYS  9

// The table of modes, in floats from its start: lambda, beta and the sum over nodes of each mode, 2 span each; B̂ of
// even and odd modes; Q of even and odd modes; their transposes: span × span each. Then the rows of Q, (nodes − 2) × 2
// span.
#define TABLE_LAMBDA(span) 0
#define TABLE_BETA(span)   (2 * (span))
#define TABLE_SUM(span)    (4 * (span))
#define TABLE_B(span)      (6 * (span))
#define TABLE_Q(span)      (6 * (span) + 2 * (span) * (span))
#define TABLE_QT(span)     (6 * (span) + 4 * (span) * (span))
#define TABLE_ROWS(span)   (6 * (span) + 6 * (span) * (span))

// What patch_step does, and what patch_nodes shows.
#define STEP_COMMIT     0 // steps, a contact's answer being at the places of the last trial if there was one
#define STEP_TRIAL      1 // finds where one step would lead, a contact's answer being at the places now
#define STEP_AFTER      2 // as STEP_COMMIT after a trial
#define SHOW_PLACES     0
#define SHOW_TRIAL      1
#define SHOW_VELOCITIES 2

#endif
