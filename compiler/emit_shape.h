// What the files that emit code for a scene's structure share: emit.c (groups and the whole source), emit_shape.c (the functions of shapes) and
// emit_deep.c (those of deep trees). The semantics are told in emit_shape.c.
//
// An Emitter walks a shape's nodes, which stand in preorder: `next` is the node that is written next, and `serial` numbers the variables of the
// function, so no two have one name.
#ifndef SCN_COMPILER_EMIT_SHAPE_H
#define SCN_COMPILER_EMIT_SHAPE_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "compiler/plan.h"

typedef struct Emitter {
    FILE *out;
    const Plan *plan;
    const PlanShape *shape; // that is being written
    bool leave;             // its leave function, not enter
    uint32_t next;          // node of the shape
    uint32_t serial;        // of the variables of the function
    int depth;              // of blocks
} Emitter;

// One line of code, indented by the blocks that are open.
void emit(Emitter *e, const char *format, ...) __attribute__((format(printf, 2, 3)));

// "enter" or "leave".
const char *emit_direction(const Emitter *e);

// Both functions of a shape, under a comment that says what it is.
void emit_shape(Emitter *e, uint32_t index);

// Writes the statements that advance from the place `from`; returns the number of the variable that holds the result.
uint32_t emit_advance(Emitter *e, const char *from);

// Whether loops would lie too deep in each other at the shape and direction that are being written. Such trees are marched through by one loop over
// a table, which stands before both functions.
bool emit_is_deep(const Emitter *e);
void emit_deep_tree(Emitter *e, uint32_t index);
void emit_deep_march(Emitter *e, uint32_t index);

bool shape_is_leaf(const PlanShapeNode *node);
bool shape_is_freeform_node(const PlanShapeNode *node);
bool shape_has_freeforms(const PlanShape *shape);

// A shape that is one free form: what is seen of it is found by a long function that is worth inlining (kernels/packet.cl), and where it ends is rarely asked.
bool shape_is_freeform(const PlanShape *shape);
const char *emit_linkage(bool freeform, bool leave);

// The functions of shapes of several leaves are long, and called for eyes and for shadows. One copy of each takes two thirds of the time to build (S4:
// 2.4 s instead of 3.5 s on a busy machine) for frames that are 1.5 % longer; called by places as kernels/freeform.cl says, else it would be 5 %.
bool shape_is_called(const PlanShape *shape);

// Of free forms that are equal somewhere, as neighbours with one deformation are, floats find places that differ by a few units of the last place, ray
// by ray another one first: so near they are one place, as far as who decides it is concerned. Quadrics that are equal have equal places.
#define SAME_PLACE "5e-7"

#endif
