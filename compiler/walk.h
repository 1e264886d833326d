// A walk over the fields of an IR, as every pass makes one.
//
// A pass rewrites a field in a *context*: under which map, with which paint. The same node may be reached in many
// contexts, and a shared node in the same context twice; it is rewritten once for each. What a pass does is two rules:
//
//     down(walk, node, context)   says by walk_reach() which operands are needed, and in which contexts
//     up(walk, node, context)     makes the new node, from walk_result() of those operands
//
// No recursion: operands come before what uses them, so a sweep down the array meets each node after all that reach
// it, and a sweep up after all that it needs. So depth costs nothing, and sharing under many maps costs what the
// result costs.
#ifndef SCN_COMPILER_WALK_H
#define SCN_COMPILER_WALK_H

#include "compiler/ir.h"
#include "compiler/pairs.h"

typedef struct Walk Walk;
typedef void WalkDown(Walk *walk, IrId id, uint32_t context);
typedef IrId WalkUp(Walk *walk, IrId id, uint32_t context);

enum { WALK_MAX = 10000000 }; // nodes in contexts; beyond that the walk is given up

// A node in a context. The visits of a node are a list; where there are many, those behind the first few are found by
// a table.
typedef struct Visit {
    uint32_t context, next;
    IrId result;
} Visit;

struct Walk {
    Ir *ir;
    Arena *scratch;
    void *pass; // the pass's own state
    // Filled by walk_run():
    uint32_t *heads; // of each node its first visit
    Visit *visits;   // [1, visit_count)
    uint32_t visit_count, visit_capacity;
    Pairs more;           // (node, context) of the visits that the table holds
    uint32_t *more_visit; // of each of them
    uint32_t more_capacity;
    IrId *operands; // a buffer for walk_rebuild()
    uint32_t operand_capacity;
    bool overflow;
};

void walk_reach(Walk *walk, IrId id, uint32_t context);
IrId walk_result(const Walk *walk, IrId id, uint32_t context);

// Rewrites what the root reaches. Returns the root's result, or 0 where WALK_MAX was exceeded.
IrId walk_run(Walk *walk, IrId root, uint32_t context, WalkDown *down, WalkUp *up);

// The common case of both rules: all fields and perturbations among the operands, in the same context; the node itself
// where none changed.
void walk_reach_operands(Walk *walk, IrId id, uint32_t context);
IrId walk_rebuild(Walk *walk, IrId id, uint32_t context);

#endif
