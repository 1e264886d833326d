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

// Copies that make fewer perturbations than this more than there are of one are folded one by one: nothing is faster for a
// ray. More of them are a cluster, which is there once, with a map and a record or two for each copy (runtime/view.h).
enum { SHARED_LEAST = 4096 };

typedef enum Sharing { SHARING_UNKNOWN, SHARING_NONE, SHARING_CLUSTER } Sharing;

typedef struct Transforms {
    Pairs contexts;
    Map *maps; // by context; 0 is the identity
    uint32_t map_capacity;
    uint8_t *sharing; // of each node that was there, Sharing
    IrId *clusters;   // of those that share
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

// Whether the perturbations of a free form or deformation, which is reached in all the contexts that it will be, are a cluster.
static bool is_shared(Walk *walk, IrId id)
{
    Transforms *t = walk->pass;
    const Ir *ir = walk->ir;
    IrOp op = (IrOp)ir_at(ir, id)->op;
    if (op != OP_FREEFORM && op != OP_DEFORM) return false;
    if (t->sharing[id] == SHARING_UNKNOWN) {
        uint64_t uses = 0, parts = ir_at(ir, id)->count - 1;
        for (uint32_t visit = walk->heads[id]; visit; visit = walk->visits[visit].next) uses++;
        bool shared = uses > 1 && parts > 1 && (uses - 1) * parts >= SHARED_LEAST;
        for (uint32_t k = 1; k <= parts && shared; k++) {
            IrId part = ir_operand(ir, id, k);
            while (ir_at(ir, part)->op == OP_PTRANSFORM) part = ir_operand(ir, part, 0);
            shared = ir_at(ir, part)->op == OP_PERTURB;
        }
        t->sharing[id] = shared ? SHARING_CLUSTER : SHARING_NONE;
    }
    return t->sharing[id] == SHARING_CLUSTER;
}

static void down(Walk *walk, IrId id, uint32_t context)
{
    IrOp op = ir_at(walk->ir, id)->op;
    if (is_shared(walk, id)) {
        walk_reach(walk, ir_operand(walk->ir, id, 0), context);
        for (uint32_t k = 1; k < ir_at(walk->ir, id)->count; k++) walk_reach(walk, ir_operand(walk->ir, id, k), 0);
        return;
    }
    if (op == OP_COPY) return; // made before: only its map changes
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

static IrId copy(Ir *ir, IrId id, const Map *map)
{
    if (!map->outer && !map->has_inner) return id;
    Span span = ir_at(ir, id)->span;
    IrId matrix = ir_op2(ir, OP_COMPOSE, span, whole(ir, span, map), ir_operand(ir, id, 2));
    return ir_op3(ir, OP_COPY, span, ir_operand(ir, id, 0), ir_operand(ir, id, 1), matrix);
}

static IrId sheet(Ir *ir, IrId id, const Map *map)
{
    if (!map->outer && !map->has_inner) return id;
    Span span = ir_at(ir, id)->span;
    return ir_op2(ir, OP_TRANSFORM, span, id, whole(ir, span, map));
}

// The object in the context, and the cluster that all contexts share moved there.
static IrId with_copy(Walk *walk, IrId id, uint32_t context)
{
    static const double same[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    Transforms *t = walk->pass;
    Ir *ir = walk->ir;
    Span span = ir_at(ir, id)->span;
    IrOp op = (IrOp)ir_at(ir, id)->op;
    uint32_t count = ir_at(ir, id)->count - 1;
    if (!t->clusters[id]) {
        IrId *parts = arena_array(walk->scratch, IrId, count);
        for (uint32_t k = 0; k < count; k++) parts[k] = walk_result(walk, ir_operand(ir, id, 1 + k), 0);
        t->clusters[id] = ir_node(ir, OP_CLUSTER, span, parts, count);
    }
    const Map *map = &t->maps[context];
    IrId matrix = map->outer || map->has_inner ? whole(ir, span, map) : ir_matrix(ir, span, same);
    IrId copy = ir_op3(ir, OP_COPY, span, t->clusters[id], ir_const(ir, 1), matrix);
    return ir_op2(ir, op, span, walk_result(walk, ir_operand(ir, id, 0), context), copy);
}

static IrId up(Walk *walk, IrId id, uint32_t context)
{
    Transforms *t = walk->pass;
    if (is_shared(walk, id)) return with_copy(walk, id, context);
    switch ((IrOp)ir_at(walk->ir, id)->op) {
    case OP_TRANSFORM:
    case OP_PTRANSFORM:
        return walk_result(walk, ir_operand(walk->ir, id, 0), below(walk, context, ir_operand(walk->ir, id, 1)));
    case OP_FIELD: return moved(walk->ir, id, &t->maps[context]);
    case OP_QUADRIC: return folded(walk->ir, id, &t->maps[context]);
    case OP_PERTURB: return perturbation(walk, id, context);
    case OP_THICKEN:
    case OP_SHEET: return sheet(walk->ir, id, &t->maps[context]);
    case OP_COPY: return copy(walk->ir, id, &t->maps[context]);
    case OP_LIFT: return lift(walk->ir, id, &t->maps[context]);
    default: return walk_rebuild(walk, id, context);
    }
}

bool pass_transforms(Ir *ir, Arena *scratch)
{
    Transforms t = {.contexts = pairs_new(scratch),
                    .sharing = arena_array(scratch, uint8_t, ir->root + 1),
                    .clusters = arena_array(scratch, IrId, ir->root + 1)};
    t.maps = array_room(scratch, NULL, 0, &t.map_capacity, sizeof *t.maps);
    Walk walk = {.ir = ir, .scratch = scratch, .pass = &t};
    IrId root = walk_run(&walk, ir->root, 0, down, up);
    if (root) ir->root = root;
    return root != 0;
}
