// The passes between what the scene says and what is lowered to a plan.
//
// Each takes an IR and leaves one that means the same, F at every point included, in a form that the next can use. (One
// difference: where something hidden is subtracted, F is no longer infinite, but as positive.)
//
//     polynomials   fields that are polynomials of degree 2 at most are quadrics.
//     transforms    maps are at the quadrics. Those with const coefficients and const maps are folded into
//                   coefficients; what moves stays TRANSFORM(QUADRIC), computed once a frame. General fields stay in
//                   their own coordinates, TRANSFORM(FIELD). `grow` of perturbations is in their free term. The
//                   perturbations of a branch that is used very often are a CLUSTER, which all its COPYs share.
//     deformations  perturbations are at the quadrics, since min(F, G) + R = min(F + R, G + R) and
//                   -F + R = -(F - R): a subtracted leaf gets -R. Free forms of free forms are one free form. What
//                   perturbs a general field becomes part of its expression.
//     attributes    complements, paint, names and visibility are at the leaves: a leaf is NAMED(SHOW(PAINT(core))),
//                   each of the three perhaps absent, and core what compiler/leaf.h says. Only COMPLEMENT(EMPTY), all of
//                   space, is left of complements; below a morph also what is all of space by a condition.
//     morphs        what is morphed is a free form, or a set of free forms (pass_morphs.c).
//     sets          unions of unions are one union, of two things at least; what is neutral or doubled is gone; EMPTY
//                   and all of space are alone or not there.
//
// Order is kept throughout: the leaves stand as the scene says them, which decides ties.
#ifndef SCN_COMPILER_PASSES_H
#define SCN_COMPILER_PASSES_H

#include "compiler/ir.h"

// Rewrites ir->root. False where the scene has too many items.
typedef bool PassRun(Ir *ir, Arena *scratch);

typedef struct Pass {
    const char *name;
    PassRun *run;
    const IrOp *gone; // operations that the scene's field no longer reaches, ended by OP_NONE
} Pass;

enum { PASS_COUNT = 7 };
extern const Pass passes[PASS_COUNT];

PassRun pass_polynomials, pass_transforms, pass_deformations, pass_attributes, pass_morphs, pass_sets, pass_fields;

// What is wrong after a pass: ir_verify(), and operations that should be gone. NULL if nothing.
const char *pass_verify(const Ir *ir, const Pass *pass);

#endif
