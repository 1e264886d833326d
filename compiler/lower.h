// From the IR to a plan: which numbers there are and how a frame computes them (values), what the geometry is made of
// (pieces), and the tables of it all (lower).
//
// The IR must have been through all passes (compiler/passes.h).
#ifndef SCN_COMPILER_LOWER_H
#define SCN_COMPILER_LOWER_H

#include "compiler/ir.h"
#include "compiler/plan.h"
#include "compiler/shapes.h"

enum {
    LOWER_INLINE_LEAVES = 24, // leaves of a shape; a larger tree has groups
    LOWER_SHAPES = 64, // shapes for which code is made as they are; where there are more, the rarest become groups
    // How deep groups nest. Code of a level calls that of the level below, for OpenCL has no recursion, so each level is
    // code to be compiled and takes room on the stack of every ray; what is nested deeper is nearly always one union or
    // subtraction, written in turns.
    LOWER_LEVELS_MAX = 64,
    LOWER_LEAVES_MAX = 10000000, // of a scene
};

typedef enum LowerStatus {
    LOWER_DONE,
    LOWER_TOO_MANY, // leaves
    LOWER_TOO_LONG, // an expression
    LOWER_TOO_DEEP, // unions of intersections of unions …
} LowerStatus;

// Makes the plan; everything is in the arena, texts and params are the IR's. `origins` may be NULL.
LowerStatus plan_lower(const Ir *ir, Arena *arena, Plan **plan, PlanOrigins *origins);

// --- values: slots and steps

typedef struct Values {
    const Ir *ir;
    Arena *arena, *scratch;
    Plan *plan;
    uint8_t *needs; // of each node, what of it the plan uses (a set of ValueNeed)
    Slot *slots;    // of each node its first slot, + 1
    Slot *inverses; // of a matrix its inverse's, + 1
    Slot *checked;  // of a scalar the slot that is known to be finite, + 1
    Slot point;     // of a patch's program: where x y z u v are
    uint32_t image_capacity, step_capacity, operand_capacity;
} Values;

Values values_new(const Ir *ir, Arena *arena, Arena *scratch, Plan *plan);

// First what is needed is named, then values_emit() makes the steps, then the slots can be asked for. A base is here
// QUADRIC or TRANSFORM(QUADRIC); of a general field its numbers are needed and the inverse of its map.
void values_need(Values *v, IrId id);         // a base, material, camera, light, background, assert
void values_need_checked(Values *v, IrId id); // a scalar that the plan names
void values_need_inverse(Values *v, IrId id); // of a matrix
void values_emit(Values *v);
void values_need_field(Values *v, IrId id); // a field for values_field()
Slot values_slot(const Values *v, IrId id);
Slot values_checked_slot(const Values *v, IrId id);
Slot values_inverse_slot(const Values *v, IrId id);

// Where among the plan's operands the program of a field stands (compiler/field.h): its length, then its words.
uint32_t values_field(Values *v, IrId field);

// For the programs of patches: emits what is known once a frame; and forgets what is known at a point, so that it is
// emitted again where something else needs it.
void values_emit_frame(Values *v);
void values_forget_points(Values *v);

// New slots with these constants.
Slot values_constants(Values *v, const double *numbers, uint32_t count);

// --- patches

// Fills plan->patches with the IR's, in their order.
void lower_patches(const Ir *ir, Arena *arena, Arena *scratch, Values *values, Plan *plan);

// --- pieces: shapes and what they hold

// A leaf of a piece, of the scene or a group, and how many leaves of the piece stand before it in the scene.
typedef struct PieceLeaf {
    uint32_t index; // IrId, or a block
    uint32_t offset;
    bool is_block;
} PieceLeaf;

typedef struct Piece { // a node as a component
    uint32_t shape;
    uint32_t leaf_count;
    uint32_t total; // leaves with all that groups hold
    PieceLeaf *leaves;
} Piece;

typedef struct Block { // what a group holds
    PlanSetKind set;
    uint32_t type;
    IrId *members;
    uint32_t *offsets; // leaves that stand before each member
    uint32_t count;
} Block;

typedef struct Pieces {
    const Ir *ir;
    Arena *scratch;
    Shapes shapes;
    bool *reached; // nodes that the scene reaches as sets and leaves
    Piece *pieces; // of these
    Block *blocks;
    uint32_t block_count, block_capacity;
    uint32_t scene; // the block of group 0
    LowerStatus status;
} Pieces;

// Everything is in the scratch arena. pieces.status tells whether it could be done.
Pieces pieces_new(const Ir *ir, Arena *scratch);

// A leaf of the IR after pass_attributes(): its parts, 0 where one is absent.
typedef struct LeafParts {
    IrId core, base, paint, shown, name; // core and base: COMPLEMENT for all of space
} LeafParts;
LeafParts leaf_parts(const Ir *ir, IrId id);

#endif
