// The shapes and group types of a plan while it is made: equal ones are one, and in the end they are numbered by what
// they are and not by when they came, so that scenes of the same structure have the same kernel whatever the order and
// number of their parts.
#ifndef SCN_COMPILER_SHAPES_H
#define SCN_COMPILER_SHAPES_H

#include "compiler/pairs.h"
#include "compiler/plan.h"

// A tree in prefix order, a word a node: its kind in the lowest four bits, above them the number of children or, of
// SHAPE_GROUP, the type.
typedef struct Shape {
    uint32_t *words, word_count;
    uint32_t leaf_count;
    uint32_t level; // how deep groups nest in it
    uint64_t hash;  // of what it is, types included
    uint32_t next;  // another of the same hash
    bool used;
} Shape;

typedef struct GroupType {
    PlanSetKind set;
    uint32_t *shapes, count, capacity; // each once
    uint32_t level;                    // the highest of the shapes'
    uint64_t hash;
    uint32_t next;
    bool used;
} GroupType;

typedef struct Shapes {
    Arena *scratch;
    Shape *list; // [1, count)
    uint32_t count, capacity;
    GroupType *types; // [1, type_count)
    uint32_t type_count, type_capacity;
    Pairs hashes;    // of shapes and types together
    uint32_t *first; // of each hash the first shape or type
    uint32_t first_capacity;
    uint32_t *words, word_capacity; // of the shape that is being made
} Shapes;

Shapes shapes_new(Arena *scratch);

uint32_t shapes_leaf(Shapes *shapes, ShapeNodeKind kind); // SHAPE_QUADRIC, SHAPE_FREEFORM, SHAPE_FIELD
uint32_t shapes_group(Shapes *shapes, uint32_t type);
uint32_t shapes_set(Shapes *shapes, PlanSetKind set, const uint32_t *children,
                    uint32_t count); // of one child: the child

// A type of groups of these shapes, in any order and any number of times.
uint32_t shapes_type(Shapes *shapes, PlanSetKind set, const uint32_t *list, uint32_t count);

// The type of the groups of a level: there is one for each, and it takes whatever shapes up to that level are added to
// it.
uint32_t shapes_level_type(Shapes *shapes, PlanSetKind set, uint32_t level);
void shapes_level_add(Shapes *shapes, uint32_t type, uint32_t shape);

// Marks what a type needs as used, itself included. Returns how many shapes are newly so.
uint32_t shapes_use(Shapes *shapes, uint32_t type);
void shapes_use_none(Shapes *shapes);

// Fills the plan's shapes and group types with what is used. Gives the new numbers of shapes and types (by old ones).
void shapes_finish(const Shapes *shapes, Arena *arena, Plan *plan, uint32_t *new_shapes, uint32_t *new_types);

#endif
