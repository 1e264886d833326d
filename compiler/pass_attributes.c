// Push complements, paint, names and visibility to the leaves.
//
// A context is what holds for a node from above:
//   paint     what unpainted leaves get. An inner PAINT is there first and wins. In `a - b`, an unpainted b gets the
//             paint of a's first leaf, so a cavity looks like what it is cut from (lang/reference.md, section 8).
//   name      the outermost NAMED above, which names the object that a leaf belongs to.
//   low       where this condition is 0 the leaf is the empty set, F = -infinity (0: no condition).
//   high      where this one is 0 (and low is not) it is all of space: hiding what is subtracted subtracts nothing.
//   negative  whether the number of complements above is odd.
//   morphed   whether a morph is above: to what is all of space something may still be added then, so it is marked as
//             such and not made a positive constant (pass_morphs.c).
//
// Hiding a branch may be done leaf by leaf since min and max are monotone: a tree of which all leaves are empty is
// empty. With what is above already decided by low and high, a SHOW(s) below an even number of complements makes low
// into low ∧ (s ∨ ¬high), below an odd one high into high ∧ s.
#include "compiler/leaf.h"
#include "compiler/passes.h"
#include "compiler/walk.h"

typedef struct Context {
    IrId paint, name, low, high;
    bool negative, morphed;
} Context;

typedef struct Attributes {
    Pairs marks, shows, contexts; // (paint, name), (low, high), the two of them
    IrId *first_paints;           // of each node the paint of its first leaf within itself, or 0
} Attributes;

static uint32_t number_of(Attributes *a, Context c)
{
    uint32_t marks = pairs_index(&a->marks, c.paint, c.name, NULL);
    uint32_t shows = pairs_index(&a->shows, c.low, c.high, NULL);
    return 4 * pairs_index(&a->contexts, marks, shows, NULL) + 2 * c.morphed + c.negative;
}

static Context context_of(const Attributes *a, uint32_t number)
{
    Pair both = a->contexts.list[number / 4];
    Pair marks = a->marks.list[both.a], shows = a->shows.list[both.b];
    return (Context){marks.a, marks.b, shows.a, shows.b, number & 1, number >> 1 & 1};
}

// a ∧ b, where 0 stands for true.
static IrId both(Ir *ir, Span span, IrId a, IrId b)
{
    return !a ? b : !b ? a : ir_op2(ir, OP_AND, span, a, b);
}

static Context shown(Ir *ir, IrId id, Context c)
{
    IrId condition = ir_operand(ir, id, 1);
    Span span = ir_at(ir, id)->span;
    double value;
    if (ir_is_const(ir, condition, &value) && value != 0) return c;
    if (c.negative) {
        c.high = both(ir, span, c.high, condition);
    } else {
        IrId needed = c.high ? ir_op2(ir, OP_OR, span, condition, ir_op1(ir, OP_NOT, span, c.high)) : condition;
        c.low = both(ir, span, c.low, needed);
    }
    return c;
}

// The context of operand k.
static uint32_t below(Walk *walk, IrId id, uint32_t k, uint32_t context)
{
    Attributes *a = walk->pass;
    Context c = context_of(a, context);
    IrId operand = ir_operand(walk->ir, id, k);
    switch ((IrOp)ir_at(walk->ir, id)->op) {
    case OP_PAINT: c.paint = ir_operand(walk->ir, id, 1); break;
    case OP_NAMED: c.name = c.name ? c.name : id; break;
    case OP_COMPLEMENT: c.negative = !c.negative; break;
    case OP_SHOW: c = shown(walk->ir, id, c); break;
    case OP_MORPH: c.morphed = true; break;
    case OP_INTERSECT: {
        IrId first = a->first_paints[ir_operand(walk->ir, id, 0)];
        if (k > 0 && ir_at(walk->ir, operand)->op == OP_COMPLEMENT && first) c.paint = first;
        break;
    }
    default: return context;
    }
    return number_of(a, c);
}

static bool is_leaf(const Ir *ir, IrId id)
{
    return ir_at(ir, id)->op == OP_EMPTY || leaf_is_core(ir, id) || leaf_is_patch(ir, id);
}

static void down(Walk *walk, IrId id, uint32_t context)
{
    if (is_leaf(walk->ir, id)) return;
    IrOp op = ir_at(walk->ir, id)->op;
    bool set = op == OP_UNION || op == OP_INTERSECT;
    uint32_t count = set ? ir_at(walk->ir, id)->count : op == OP_MORPH ? 2 : 1;
    for (uint32_t k = 0; k < count; k++) walk_reach(walk, ir_operand(walk->ir, id, k), below(walk, id, k, context));
}

static IrId all_or_nothing(Ir *ir, Span span, bool all)
{
    IrId empty = ir_node(ir, OP_EMPTY, span, NULL, 0);
    return all ? ir_op1(ir, OP_COMPLEMENT, span, empty) : empty;
}

// The leaf with its sign, its conditions and its marks.
static IrId leaf(Ir *ir, IrId id, Context c)
{
    Span span = ir_at(ir, id)->span;
    double low = 1, high = 1;
    if (c.low && ir_is_const(ir, c.low, &low) && low == 0) return all_or_nothing(ir, span, false);
    if (c.high && ir_is_const(ir, c.high, &high) && high == 0) {
        if (!c.low) return all_or_nothing(ir, span, true);
        c.high = 0;
        id = leaf_quadric(ir, (Span){0}, (const double[10]){[9] = c.negative ? -1 : 1});
    }
    if (leaf_is_sheet(ir,
                      id)) { // -F is a distance, which nothing is below: all points are in it, but where it is hidden
        if (c.negative) return all_or_nothing(ir, span, true);
        c.high = 0;
    }
    if (ir_at(ir, id)->op == OP_EMPTY) { // a condition matters only where it would make something else of it
        if (c.negative ? !c.low : !c.high) return all_or_nothing(ir, span, c.negative);
        id = leaf_quadric(ir, (Span){0}, (const double[10]){[9] = -1});
    }
    if (c.negative) id = leaf_negate(ir, id);
    if (c.high) id = c.morphed ? leaf_mark_all(ir, id, c.high) : leaf_unless_all(ir, id, c.high);
    return leaf_marked(ir, span, id, c.paint, c.low, c.name);
}

static IrId set(Walk *walk, IrId id, uint32_t context)
{
    Ir *ir = walk->ir;
    Context c = context_of(walk->pass, context);
    IrNode node = *ir_at(ir, id);
    bool united = (node.op == OP_UNION) != c.negative; // -max(F, G) = min(-F, -G)
    bool changed = c.negative;
    for (uint32_t k = 0; k < node.count; k++) {
        IrId operand = ir_operand(ir, id, k);
        IrId result = walk_result(walk, operand, below(walk, id, k, context));
        walk->operands = array_room(walk->scratch, walk->operands, k, &walk->operand_capacity, sizeof *walk->operands);
        walk->operands[k] = result;
        if (result != operand) changed = true;
    }
    return changed ? ir_node(ir, united ? OP_UNION : OP_INTERSECT, node.span, walk->operands, node.count) : id;
}

// -((1 - t) F + t G) = (1 - t)(-F) + t (-G)
static IrId morph(Walk *walk, IrId id, uint32_t context)
{
    Ir *ir = walk->ir;
    IrId a = walk_result(walk, ir_operand(ir, id, 0), below(walk, id, 0, context));
    IrId b = walk_result(walk, ir_operand(ir, id, 1), below(walk, id, 1, context));
    return ir_op3(ir, OP_MORPH, ir_at(ir, id)->span, a, b, ir_operand(ir, id, 2));
}

static IrId up(Walk *walk, IrId id, uint32_t context)
{
    if (is_leaf(walk->ir, id)) return leaf(walk->ir, id, context_of(walk->pass, context));
    IrOp op = ir_at(walk->ir, id)->op;
    if (op == OP_UNION || op == OP_INTERSECT) return set(walk, id, context);
    if (op == OP_MORPH) return morph(walk, id, context);
    return walk_result(walk, ir_operand(walk->ir, id, 0), below(walk, id, 0, context));
}

static void find_first_paints(const Ir *ir, IrId *paints)
{
    for (IrId id = 1; id <= ir->root; id++) {
        const IrNode *node = ir_at(ir, id);
        if (node->type != IR_FIELD || is_leaf(ir, id)) continue;
        uint32_t first = 0; // what is nothing has no first leaf
        while (first + 1 < node->count && ir_at(ir, ir_operand(ir, id, first))->op == OP_EMPTY &&
               (node->op == OP_UNION || node->op == OP_INTERSECT)) {
            first++;
        }
        paints[id] = paints[ir_operand(ir, id, first)];
        if (node->op == OP_PAINT && !paints[id]) paints[id] = ir_operand(ir, id, 1);
    }
}

bool pass_attributes(Ir *ir, Arena *scratch)
{
    Attributes a = {.marks = pairs_new(scratch), .shows = pairs_new(scratch), .contexts = pairs_new(scratch)};
    a.first_paints = arena_array(scratch, IrId, ir->count);
    find_first_paints(ir, a.first_paints);
    Walk walk = {.ir = ir, .scratch = scratch, .pass = &a};
    IrId root = walk_run(&walk, ir->root, number_of(&a, (Context){0}), down, up);
    if (root) ir->root = root;
    return root != 0;
}
