// Push perturbations to the quadrics and join free forms.
//
// A context is the list of the free forms and deformations above a node, from the innermost out, and whether a
// complement stands between it and the innermost: then that one's perturbations reach it with the opposite sign. Lists
// are numbered by the pairs (context above, node); a context is 2 · list + sign, and 0 where there is no deformation.
#include "compiler/expression.h"
#include "compiler/leaf.h"
#include "compiler/passes.h"
#include "compiler/walk.h"

typedef struct Deformations {
    Pairs lists;
    IrId *negatives; // of a perturbation its negative, once made
    IrId *operands;  // of the free form that is made
    uint32_t count, capacity;
} Deformations;

static bool is_deformation(const Ir *ir, IrId id)
{
    IrOp op = ir_at(ir, id)->op;
    return op == OP_FREEFORM || op == OP_DEFORM;
}

// The context of the first operand.
static uint32_t below(Walk *walk, IrId id, uint32_t context)
{
    Deformations *d = walk->pass;
    if (is_deformation(walk->ir, id)) return 2 * pairs_index(&d->lists, context, id, NULL);
    return ir_at(walk->ir, id)->op == OP_COMPLEMENT && context ? context ^ 1 : context;
}

static void down(Walk *walk, IrId id, uint32_t context)
{
    if (leaf_is_base(walk->ir, id) || leaf_is_patch(walk->ir, id)) return;
    uint32_t inner = below(walk, id, context);
    if (is_deformation(walk->ir, id)) {
        walk_reach(walk, ir_operand(walk->ir, id, 0), inner);
    } else {
        walk_reach_operands(walk, id, inner);
    }
}

static void add_operand(Walk *walk, IrId id)
{
    Deformations *d = walk->pass;
    d->operands = array_room(walk->scratch, d->operands, d->count, &d->capacity, sizeof *d->operands);
    d->operands[d->count++] = id;
}

static void add_perturbation(Walk *walk, IrId perturbation, bool negative)
{
    Deformations *d = walk->pass;
    double strength;
    if (ir_is_const(walk->ir, ir_operand(walk->ir, perturbation, 1), &strength) && strength == 0) return;
    if (negative) {
        if (!d->negatives[perturbation]) d->negatives[perturbation] = leaf_negate_perturbation(walk->ir, perturbation);
        perturbation = d->negatives[perturbation];
    }
    add_operand(walk, perturbation);
}

// A perturbation whose quadric is a number adds a number everywhere, s max(c, 0)³: the base's free term takes it, and the
// class stays.
static bool is_level(const Ir *ir, IrId perturbation)
{
    if (ir_at(ir, perturbation)->op != OP_PERTURB) return false;
    IrId matrix, q = leaf_function(ir, ir_operand(ir, perturbation, 0), &matrix);
    for (uint32_t k = 0; k < 9; k++) {
        double value;
        if (!ir_is_const(ir, ir_operand(ir, q, k), &value) || value != 0) return false;
    }
    return true;
}

static IrId level_of(Ir *ir, IrId perturbation)
{
    IrId matrix, q = leaf_function(ir, ir_operand(ir, perturbation, 0), &matrix);
    Span span = ir_at(ir, perturbation)->span;
    IrId c = ir_op2(ir, OP_MAX, span, ir_operand(ir, q, 9), ir_const(ir, 0));
    IrId cube = ir_op2(ir, OP_MUL, span, ir_op2(ir, OP_MUL, span, c, c), c);
    return ir_op2(ir, OP_MUL, span, ir_operand(ir, perturbation, 1), cube);
}

static void join_levels(Walk *walk)
{
    Deformations *d = walk->pass;
    uint32_t kept = 1;
    for (uint32_t k = 1; k < d->count; k++) {
        if (is_level(walk->ir, d->operands[k]))
            d->operands[0] = leaf_grow_base(walk->ir, d->operands[0], level_of(walk->ir, d->operands[k]));
        else
            d->operands[kept++] = d->operands[k];
    }
    d->count = kept;
}

// What a patch lifts has perturbations of its own alone.
static void spread_copies(Walk *walk)
{
    Deformations *d = walk->pass;
    bool lifted = false;
    for (uint32_t k = 1; k < d->count; k++) lifted |= ir_at(walk->ir, d->operands[k])->op == OP_LIFT;
    for (uint32_t k = 1; lifted && k < d->count; k++) {
        IrId copy = d->operands[k];
        if (ir_at(walk->ir, copy)->op != OP_COPY) continue;
        uint32_t count = leaf_copy_count(walk->ir, copy);
        d->operands[k] = leaf_copy_part(walk->ir, copy, 0);
        for (uint32_t part = 1; part < count; part++) add_operand(walk, leaf_copy_part(walk->ir, copy, part));
    }
}

static IrId deformed(Walk *walk, IrId base, uint32_t context)
{
    Deformations *d = walk->pass;
    bool negative = false;
    Span span = {0};
    d->count = 0;
    add_operand(walk, base);
    while (context) {
        negative ^= context & 1;
        Pair list = d->lists.list[context / 2];
        if (!span.end) span = ir_at(walk->ir, list.b)->span;
        uint32_t count = ir_at(walk->ir, list.b)->count;
        for (uint32_t k = 1; k < count; k++) add_perturbation(walk, ir_operand(walk->ir, list.b, k), negative);
        context = list.a;
    }
    join_levels(walk);
    spread_copies(walk);
    IrId matrix;
    if (ir_at(walk->ir, leaf_function(walk->ir, base, &matrix))->op == OP_FIELD)
        return expression_perturbed(walk->ir, d->operands, d->count);
    return ir_node(walk->ir, OP_FREEFORM, span, d->operands, d->count);
}

static IrId up(Walk *walk, IrId id, uint32_t context)
{
    if (leaf_is_base(walk->ir, id)) return deformed(walk, id, context);
    if (ir_at(walk->ir, id)->op == OP_EMPTY || leaf_is_patch(walk->ir, id)) return id;
    uint32_t inner = below(walk, id, context);
    if (is_deformation(walk->ir, id)) return walk_result(walk, ir_operand(walk->ir, id, 0), inner);
    return walk_rebuild(walk, id, inner);
}

bool pass_deformations(Ir *ir, Arena *scratch)
{
    Deformations d = {.lists = pairs_new(scratch), .negatives = arena_array(scratch, IrId, ir->count)};
    Walk walk = {.ir = ir, .scratch = scratch, .pass = &d};
    IrId root = walk_run(&walk, ir->root, 0, down, up);
    if (root) ir->root = root;
    return root != 0;
}
