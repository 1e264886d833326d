// What is wrong with a patch's equation, by name and with the bound, before anything is solved.
//
//     PatchFinding findings[PATCH_FINDINGS];
//     int count = patch_diagnose(&model, findings, PATCH_FINDINGS);
//     for (int k = 0; k < count; k++) if (findings[k].error) …findings[k].text…
//
// A pure function of the model: the compiler calls it where all is known, the runtime when a handle moves. It costs
// next to nothing for an equation that is well-posed; one with b < 0, d < 0 or c < −2√(bd) has the operator factored on
// its grid (4 ms at 65 nodes, 50 at 129). Such an equation grows without bound as the grid gets finer, but a coarse
// grid may not see it: then it is a warning. Where the operator is not positive definite on the grid, some mode grows
// at every step below a certain length: an error, unless the model insists.
#ifndef SCN_RUNTIME_PATCH_DIAGNOSE_H
#define SCN_RUNTIME_PATCH_DIAGNOSE_H

#include "runtime/failure.h"
#include "runtime/patch_model.h"

typedef enum PatchProblem {
    PATCH_GRID,             // nodes outside PATCH_MIN_NODES … PATCH_MAX_NODES
    PATCH_STEP,             // dt <= 0
    PATCH_NOT_FINITE,       // a number of the model
    PATCH_DENSITY_NEGATIVE, // ρ < 0
    PATCH_DAMPING_NEGATIVE, // η < 0
    PATCH_NOTHING_MOVES,    // newmark with ρ = η = 0
    PATCH_PIN_PLACE,        // a pin outside the unknowns
    PATCH_PIN_TWICE,        // two pins on one node
    PATCH_B_NEGATIVE,       // b < 0
    PATCH_D_NEGATIVE,       // d < 0
    PATCH_C_BELOW,          // c < −2√(bd)
    PATCH_OPERATOR,         // L is not positive definite on this grid
    PATCH_STEP_LARGE,       // dt too large for the wanted accuracy
    PATCH_PROBLEMS
} PatchProblem;

typedef struct PatchFinding {
    PatchProblem problem;
    bool error;          // the model cannot be solved; else a warning
    int component;       // 0 … 2 where it concerns one (the first of those that are alike); −1
    double value, bound; // what it is and what it may be
    char text[220];      // a sentence for people with both, without a full stop
} PatchFinding;

// As many as there can be: five a component and those of the whole.
#define PATCH_FINDINGS 24

// Writes up to `capacity` findings, errors and warnings in the order of the enum, and returns how many there are.
int patch_diagnose(const PatchModel *model, PatchFinding *findings, int capacity);

// False with `failure` set to the first error's text, if there is one.
bool patch_accept(const PatchModel *model, Failure *failure);

// "step-large" for PATCH_STEP_LARGE: what tests and editors match.
const char *patch_problem_name(PatchProblem problem);

// The lowest eigenvalue of L of a component, estimated by its quotient for the product of the beam's first modes: exact
// to about a percent for stiffnesses near b = d = 1, c = 2, too large otherwise.
double patch_lowest(const PatchStiffness *stiffness);

// The relative error of the rate (complex frequency) with which the scheme moves a mode of eigenvalue λ, and the
// largest dt that keeps it below a bound.
double patch_rate_error(const PatchModel *model, double lambda, double dt);
double patch_step_bound(const PatchModel *model, double lambda, double error);

#endif
