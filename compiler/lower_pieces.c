// How a scene is cut into shapes and groups.
//
// A normalised field is a tree of unions and intersections over leaves, in which trees may be shared. A sweep up the
// nodes makes each a *piece*, a shape and its leaves: a node with at most LOWER_INLINE_LEAVES leaves is one tree. From
// a larger one, the most numerous kinds of children go into a group of their own until the rest fits: a box minus ten
// thousand spheres is an intersection of the box's leaves and of a group of complements, a thousand things cut by a
// plane are the intersection of a group with one leaf.
//
// Where that makes more than LOWER_SHAPES shapes, a second sweep keeps the most frequent small trees as they are and
// makes a group of every other node. The groups of a level of nesting all have one type, so the number of shapes then
// follows from the depth of the scene and not from how many different things are in it.
#include <stdlib.h>

#include "compiler/leaf.h"
#include "compiler/lower.h"

LeafParts leaf_parts(const Ir *ir, IrId id)
{
    LeafParts parts = {0};
    for (;; id = ir_operand(ir, id, 0)) {
        IrOp op = ir_at(ir, id)->op;
        if (op == OP_NAMED) {
            parts.name = id;
        } else if (op == OP_SHOW) {
            parts.shown = ir_operand(ir, id, 1);
        } else if (op == OP_PAINT) {
            parts.paint = ir_operand(ir, id, 1);
        } else {
            break;
        }
    }
    parts.core = parts.base = id;
    if (ir_at(ir, id)->op == OP_FREEFORM) parts.base = ir_operand(ir, id, 0);
    return parts;
}

static bool is_set(const Ir *ir, IrId id)
{
    return ir_at(ir, id)->op == OP_UNION || ir_at(ir, id)->op == OP_INTERSECT;
}

static PlanSetKind set_kind(const Ir *ir, IrId id)
{
    return ir_at(ir, id)->op == OP_UNION ? SET_UNION : SET_INTERSECT;
}

static uint32_t sum(Pieces *p, uint32_t a, uint32_t b)
{
    if (b > LOWER_LEAVES_MAX || a > LOWER_LEAVES_MAX - b) p->status = LOWER_TOO_MANY;
    return p->status ? 0 : a + b;
}

static ShapeNodeKind leaf_kind(const Ir *ir, IrId core)
{
    IrId matrix;
    if (leaf_is_sheet(ir, core)) return SHAPE_SHEET;
    if (leaf_is_thick(ir, core)) return SHAPE_THICK;
    if (ir_at(ir, leaf_function(ir, core, &matrix))->op == OP_FIELD) return SHAPE_FIELD;
    if (ir_at(ir, core)->op != OP_FREEFORM) return SHAPE_QUADRIC;
    for (uint32_t k = 1; k < ir_at(ir, core)->count; k++)
        if (ir_at(ir, ir_operand(ir, core, k))->op == OP_LIFT) return SHAPE_LIFTED;
    return SHAPE_FREEFORM;
}

static Piece leaf_piece(Pieces *p, IrId id)
{
    Piece piece = {
        .shape = shapes_leaf(&p->shapes, leaf_kind(p->ir, leaf_parts(p->ir, id).core)), .leaf_count = 1, .total = 1};
    piece.leaves = arena_new(p->scratch, PieceLeaf);
    piece.leaves[0].index = id;
    return piece;
}

// --- blocks

static uint32_t block_new(Pieces *p, PlanSetKind set, uint32_t room)
{
    p->blocks = array_room(p->scratch, p->blocks, p->block_count, &p->block_capacity, sizeof *p->blocks);
    Block *block = &p->blocks[p->block_count];
    *block = (Block){.set = set};
    block->members = arena_array(p->scratch, IrId, room);
    block->offsets = arena_array(p->scratch, uint32_t, room);
    return p->block_count++;
}

static void block_add(Pieces *p, uint32_t index, IrId member, uint32_t offset)
{
    Block *block = &p->blocks[index];
    block->members[block->count] = member;
    block->offsets[block->count++] = offset;
}

// Gives the block a type of its members' shapes.
static void block_close(Pieces *p, uint32_t index)
{
    Block *block = &p->blocks[index];
    uint32_t *list = arena_array(p->scratch, uint32_t, block->count);
    uint32_t count = 0;
    for (uint32_t k = 0; k < block->count; k++) {
        uint32_t shape = p->pieces[block->members[k]].shape;
        if (!count || list[count - 1] != shape) list[count++] = shape; // runs of one shape are common
    }
    block->type = shapes_type(&p->shapes, block->set, list, count);
}

static PieceLeaf block_leaf(uint32_t block, uint32_t offset)
{
    return (PieceLeaf){block, offset, true};
}

// --- kinds of children

typedef struct Kind { // the children of one shape
    uint32_t shape, leaves, first;
    bool grouped;
} Kind;

static int by_leaves(const void *a, const void *b)
{
    const Kind *x = a, *y = b;
    if (x->leaves != y->leaves) return x->leaves > y->leaves ? -1 : 1;
    return x->first < y->first ? -1 : 1;
}

static int by_shape(const void *a, const void *b)
{
    const Kind *x = a, *y = b;
    return x->shape < y->shape ? -1 : x->shape > y->shape;
}

static Kind *list_kinds(Pieces *p, IrId id, uint32_t *kind_count)
{
    const IrNode *node = ir_at(p->ir, id);
    Pairs index = pairs_new(p->scratch); // (shape, 0)
    Kind *kinds = NULL;
    uint32_t count = 0, capacity = 0;
    for (uint32_t k = 0; k < node->count; k++) {
        const Piece *piece = &p->pieces[ir_operand(p->ir, id, k)];
        bool added;
        uint32_t kind = pairs_index(&index, piece->shape, 0, &added) - 1;
        if (added) {
            kinds = array_room(p->scratch, kinds, count, &capacity, sizeof *kinds);
            kinds[count++] = (Kind){.shape = piece->shape, .first = k};
        }
        kinds[kind].leaves += piece->leaf_count;
    }
    *kind_count = count;
    return kinds;
}

// The kinds by shape; those with most leaves are marked until the rest and the group fit into one shape.
static Kind *choose_kinds(Pieces *p, IrId id, uint32_t leaves, uint32_t *count)
{
    Kind *kinds = list_kinds(p, id, count);
    qsort(kinds, *count, sizeof *kinds, by_leaves);
    for (uint32_t k = 0; k < *count && leaves + (k > 0) > LOWER_INLINE_LEAVES; k++) {
        kinds[k].grouped = true;
        leaves -= kinds[k].leaves;
    }
    qsort(kinds, *count, sizeof *kinds, by_shape);
    return kinds;
}

static bool is_grouped(const Kind *kinds, uint32_t count, uint32_t shape)
{
    if (!kinds) return false;
    const Kind *kind = bsearch(&(Kind){.shape = shape}, kinds, count, sizeof *kinds, by_shape);
    return kind->grouped;
}

// --- the first sweep

static void take_leaves(Piece *piece, const Piece *child, uint32_t offset)
{
    for (uint32_t k = 0; k < child->leaf_count; k++) {
        PieceLeaf leaf = child->leaves[k];
        leaf.offset += offset;
        piece->leaves[piece->leaf_count++] = leaf;
    }
}

static Piece set_piece(Pieces *p, IrId id)
{
    const IrNode *node = ir_at(p->ir, id);
    Piece piece = {0};
    uint32_t leaves = 0, kind_count = 0;
    for (uint32_t k = 0; k < node->count; k++) {
        const Piece *child = &p->pieces[ir_operand(p->ir, id, k)];
        leaves = sum(p, leaves, child->leaf_count);
        piece.total = sum(p, piece.total, child->total);
    }
    if (p->status) return piece;
    bool large = leaves > LOWER_INLINE_LEAVES;
    Kind *kinds = large ? choose_kinds(p, id, leaves, &kind_count) : NULL;
    uint32_t block = large ? block_new(p, set_kind(p->ir, id), node->count) : 0;
    uint32_t shapes[LOWER_INLINE_LEAVES + 1], shape_count = 0, offset = 0;
    piece.leaves = arena_array(p->scratch, PieceLeaf, large ? LOWER_INLINE_LEAVES : leaves);
    for (uint32_t k = 0; k < node->count; k++) {
        IrId operand = ir_operand(p->ir, id, k);
        const Piece *child = &p->pieces[operand];
        if (is_grouped(kinds, kind_count, child->shape)) {
            block_add(p, block, operand, offset);
        } else {
            take_leaves(&piece, child, offset);
            shapes[shape_count++] = child->shape;
        }
        offset += child->total;
    }
    if (large) {
        block_close(p, block);
        piece.leaves[piece.leaf_count++] = block_leaf(block, 0);
        shapes[shape_count++] = shapes_group(&p->shapes, p->blocks[block].type);
    }
    piece.shape = shapes_set(&p->shapes, set_kind(p->ir, id), shapes, shape_count);
    return piece;
}

// What the uppermost union holds, or the one thing that there is.
static uint32_t scene_block(Pieces *p)
{
    const Ir *ir = p->ir;
    bool united = ir_at(ir, ir->root)->op == OP_UNION;
    uint32_t count = !p->reached[ir->root] ? 0 : united ? ir_at(ir, ir->root)->count : 1;
    uint32_t offset = 0, block = block_new(p, SET_UNION, count);
    for (uint32_t k = 0; k < count && !p->status; k++) {
        IrId member = united ? ir_operand(ir, ir->root, k) : ir->root;
        block_add(p, block, member, offset);
        offset = sum(p, offset, p->pieces[member].total);
    }
    if (!p->status) block_close(p, block);
    return block;
}

// --- the second sweep

typedef struct Use { // how many components have a shape
    uint32_t shape, count;
} Use;

static int by_use(const void *a, const void *b)
{
    const Use *x = a, *y = b;
    if (x->count != y->count) return x->count > y->count ? -1 : 1;
    return x->shape < y->shape ? -1 : 1;
}

// The most frequent trees without groups, for three quarters of the code that there may be.
static bool *frequent_shapes(Pieces *p)
{
    uint32_t count = p->shapes.count;
    Use *uses = arena_array(p->scratch, Use, count);
    bool *kept = arena_array(p->scratch, bool, count);
    for (uint32_t k = 0; k < count; k++) uses[k].shape = k;
    for (uint32_t b = 0; b < p->block_count; b++) {
        const Block *block = &p->blocks[b];
        for (uint32_t k = 0; k < block->count; k++) uses[p->pieces[block->members[k]].shape].count++;
    }
    qsort(uses, count, sizeof *uses, by_use);
    for (uint32_t k = 0, left = LOWER_SHAPES * 3 / 4; k < count && uses[k].count && left; k++) {
        if (p->shapes.list[uses[k].shape].level > 0) continue;
        kept[uses[k].shape] = true;
        left--;
    }
    return kept;
}

static Piece group_piece(Pieces *p, IrId id, const Piece *pieces)
{
    const IrNode *node = ir_at(p->ir, id);
    uint32_t offset = 0, level = 0, block = block_new(p, set_kind(p->ir, id), node->count);
    for (uint32_t k = 0; k < node->count; k++) {
        IrId operand = ir_operand(p->ir, id, k);
        uint32_t shape_level = p->shapes.list[pieces[operand].shape].level;
        block_add(p, block, operand, offset);
        offset += pieces[operand].total;
        if (shape_level > level) level = shape_level;
    }
    uint32_t type = p->blocks[block].type = shapes_level_type(&p->shapes, set_kind(p->ir, id), level);
    for (uint32_t k = 0; k < node->count; k++)
        shapes_level_add(&p->shapes, type, pieces[ir_operand(p->ir, id, k)].shape);
    Piece piece = {.shape = shapes_group(&p->shapes, type), .leaf_count = 1, .total = offset};
    piece.leaves = arena_new(p->scratch, PieceLeaf);
    piece.leaves[0] = block_leaf(block, 0);
    return piece;
}

static void keep_frequent_shapes(Pieces *p)
{
    bool *kept = frequent_shapes(p);
    Piece *pieces = arena_array(p->scratch, Piece, p->ir->count);
    bool united = ir_at(p->ir, p->ir->root)->op == OP_UNION;
    p->block_count = 0;
    for (IrId id = 1; id <= p->ir->root; id++) {
        if (!p->reached[id] || (united && id == p->ir->root)) continue;
        bool whole = !is_set(p->ir, id) || kept[p->pieces[id].shape];
        pieces[id] = whole ? p->pieces[id] : group_piece(p, id, pieces);
    }
    p->pieces = pieces;
    p->scene = scene_block(p);
}

// --- both

static void find_fields(Pieces *p)
{
    const Ir *ir = p->ir;
    p->reached = arena_array(p->scratch, bool, ir->count);
    p->reached[ir->root] = ir_at(ir, ir->root)->op != OP_EMPTY;
    for (IrId id = ir->root; id > 0; id--) {
        if (!p->reached[id] || !is_set(ir, id)) continue;
        for (uint32_t k = 0; k < ir_at(ir, id)->count; k++) p->reached[ir_operand(ir, id, k)] = true;
    }
}

static uint32_t use_scene(Pieces *p)
{
    shapes_use_none(&p->shapes);
    return shapes_use(&p->shapes, p->blocks[p->scene].type);
}

Pieces pieces_new(const Ir *ir, Arena *scratch)
{
    Pieces p = {.ir = ir, .scratch = scratch, .shapes = shapes_new(scratch)};
    bool united = ir_at(ir, ir->root)->op == OP_UNION;
    find_fields(&p);
    p.pieces = arena_array(scratch, Piece, ir->count);
    for (IrId id = 1; id <= ir->root && !p.status; id++) {
        if (!p.reached[id] || (united && id == ir->root)) continue;
        p.pieces[id] = is_set(ir, id) ? set_piece(&p, id) : leaf_piece(&p, id);
        if (p.shapes.list[p.pieces[id].shape].level > LOWER_LEVELS_MAX) p.status = LOWER_TOO_DEEP;
    }
    if (!p.status) p.scene = scene_block(&p);
    if (p.status) return p;
    if (use_scene(&p) > LOWER_SHAPES) {
        keep_frequent_shapes(&p);
        if (p.shapes.types[p.blocks[p.scene].type].level > LOWER_LEVELS_MAX)
            p.status = LOWER_TOO_DEEP;
        else
            use_scene(&p);
    }
    return p;
}
