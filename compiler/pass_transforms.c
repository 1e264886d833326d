// Push maps to the quadrics and fold them.
//
// A context is the product M of the maps from the scene down to a node, as outer · inner: outer is a matrix of the IR
// that is known once a frame (or 0), inner twelve numbers that are known now. A const map is multiplied to inner; one
// that moves takes all before it into outer. So below a group that turns, each of its thousand parts is folded into
// coefficients as far as it does not move on its own, and all share one matrix of the frame. Contexts are numbered by
// the pairs (context above, matrix).
//
// A map that cannot be inverted, or coefficients that overflow, stay as TRANSFORM: the frame reports them.
#include <string.h>

#include "compiler/eval.h"
#include "compiler/leaf.h"
#include "compiler/passes.h"
#include "compiler/quadric.h"
#include "compiler/walk.h"

typedef struct Map {
    IrId outer;
    bool has_inner;
    double inner[12];
} Map;

typedef struct Transforms {
    Pairs contexts;
    Map *maps; // by context; 0 is the identity
    uint32_t map_capacity;
} Transforms;

static IrId whole(Ir *ir, Span span, const Map *map)
{
    if (!map->has_inner) return map->outer;
    IrId inner = ir_matrix(ir, span, map->inner);
    return map->outer ? ir_op2(ir, OP_COMPOSE, span, map->outer, inner) : inner;
}

static uint32_t below(Walk *walk, uint32_t context, IrId matrix)
{
    Transforms *t = walk->pass;
    bool added;
    uint32_t index = pairs_index(&t->contexts, context, matrix, &added);
    if (!added) return index;
    Map map = t->maps[context];
    double m[12];
    if (!ir_const_matrix(walk->ir, matrix, m)) {
        Span span = ir_at(walk->ir, matrix)->span;
        IrId above = whole(walk->ir, span, &map);
        map = (Map){.outer = above ? ir_op2(walk->ir, OP_COMPOSE, span, above, matrix) : matrix};
    } else if (map.has_inner) {
        matrix_compose(map.inner, m, map.inner);
    } else {
        map.has_inner = true;
        memcpy(map.inner, m, sizeof m);
    }
    t->maps = array_room(walk->scratch, t->maps, index, &t->map_capacity, sizeof *t->maps);
    t->maps[index] = map;
    return index;
}

static void down(Walk *walk, IrId id, uint32_t context)
{
    IrOp op = ir_at(walk->ir, id)->op;
    if (op == OP_TRANSFORM || op == OP_PTRANSFORM) context = below(walk, context, ir_operand(walk->ir, id, 1));
    walk_reach_operands(walk, id, context);
}

// A general field keeps its coordinates: only its point moves, so equal expressions stay one.
static IrId moved(Ir *ir, IrId field, const Map *map)
{
    if (!map->outer && !map->has_inner) return field;
    Span span = ir_at(ir, field)->span;
    return ir_op2(ir, OP_TRANSFORM, span, field, whole(ir, span, map));
}

static IrId folded(Ir *ir, IrId quadric, const Map *map)
{
    double q[10], inverse[12];
    Span span = ir_at(ir, quadric)->span;
    if (!map->outer && !map->has_inner) return quadric;
    if (!map->has_inner) return ir_op2(ir, OP_TRANSFORM, span, quadric, map->outer);
    bool ok =
        leaf_const_quadric(ir, quadric, q) && matrix_inverse(map->inner, inverse) && quadric_transform(q, inverse, q);
    if (!ok) return ir_op2(ir, OP_TRANSFORM, span, quadric, whole(ir, span, map));
    IrId inner = leaf_quadric(ir, span, q);
    return map->outer ? ir_op2(ir, OP_TRANSFORM, span, inner, map->outer) : inner;
}

// The function of a perturbation: without the marks that only objects need, and with `grow` in its free term.
static IrId perturbation(Walk *walk, IrId id, uint32_t context)
{
    Ir *ir = walk->ir;
    IrId q = walk_result(walk, ir_operand(ir, id, 0), context);
    bool negative = false;
    for (; !leaf_is_base(ir, q); q = ir_operand(ir, q, 0)) {
        if (ir_at(ir, q)->op == OP_COMPLEMENT) negative = !negative;
    }
    if (negative) q = leaf_negate_base(ir, q);
    q = leaf_grow_base(ir, q, ir_operand(ir, id, 2));
    return ir_op3(ir, OP_PERTURB, ir_at(ir, id)->span, q, ir_operand(ir, id, 1), ir_const(ir, 0));
}

// The frame of what a patch lifts moves with it.
static IrId lift(Ir *ir, IrId id, const Map *map)
{
    if (!map->outer && !map->has_inner) return id;
    IrId operands[5];
    Span span = ir_at(ir, id)->span;
    for (uint32_t k = 0; k < 5; k++) operands[k] = ir_operand(ir, id, k);
    operands[2] = ir_op2(ir, OP_COMPOSE, span, whole(ir, span, map), operands[2]);
    return ir_node(ir, OP_LIFT, span, operands, 5);
}

static IrId sheet(Ir *ir, IrId id, const Map *map)
{
    if (!map->outer && !map->has_inner) return id;
    Span span = ir_at(ir, id)->span;
    return ir_op2(ir, OP_TRANSFORM, span, id, whole(ir, span, map));
}

static IrId up(Walk *walk, IrId id, uint32_t context)
{
    Transforms *t = walk->pass;
    switch ((IrOp)ir_at(walk->ir, id)->op) {
    case OP_TRANSFORM:
    case OP_PTRANSFORM:
        return walk_result(walk, ir_operand(walk->ir, id, 0), below(walk, context, ir_operand(walk->ir, id, 1)));
    case OP_FIELD: return moved(walk->ir, id, &t->maps[context]);
    case OP_QUADRIC: return folded(walk->ir, id, &t->maps[context]);
    case OP_PERTURB: return perturbation(walk, id, context);
    case OP_THICKEN:
    case OP_SHEET: return sheet(walk->ir, id, &t->maps[context]);
    case OP_LIFT: return lift(walk->ir, id, &t->maps[context]);
    default: return walk_rebuild(walk, id, context);
    }
}

bool pass_transforms(Ir *ir, Arena *scratch)
{
    Transforms t = {.contexts = pairs_new(scratch)};
    t.maps = array_room(scratch, NULL, 0, &t.map_capacity, sizeof *t.maps);
    Walk walk = {.ir = ir, .scratch = scratch, .pass = &t};
    IrId root = walk_run(&walk, ir->root, 0, down, up);
    if (root) ir->root = root;
    return root != 0;
}
