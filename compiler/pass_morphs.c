// Morphs become free forms, and sets of them.
//
// F = (1 - t) F_a + t F_b with t in 0 … 1. A sum of two quadrics is the quadric of the summed coefficients, and a sum of
// free forms is the free form of the summed bases and of all perturbations, each with its weight on the strength:
//
//     (1 - t)(A + Σ s_i R_i) + t (B + Σ s_j R_j) = ((1 - t) A + t B) + Σ (1 - t) s_i R_i + Σ t s_j R_j
//
// A perturbation of both, as one that deforms the whole morph, keeps its strength: (1 - t) s + t s = s. And since the
// weights are not negative, sums distribute over max and min:
//
//     (1 - t) max(F, G) + t H = max((1 - t) F + t H, (1 - t) G + t H)
//
// so a morph of set operations is a set operation of morphs, of each leaf of a with each of b. Nothing is approximated,
// and rays meet it as they meet any free form.
//
// Where a or b is a general field so is the morph: the expression of both.
//
// The coefficients of a base that moves are computed in the frame; COEFFICIENT names one of them. Visibility: an
// operand is looked at only where its weight is not 0, so what is hidden in it counts only there.
#include "compiler/expression.h"
#include "compiler/leaf.h"
#include "compiler/object.h"
#include "compiler/passes.h"
#include "compiler/walk.h"

typedef struct Part { // a leaf, as pass_attributes() leaves it below a morph
    IrId core;        // 0: the empty set or all of space, which low or high say
    IrId paint, name; // name: the NAMED
    IrId low, high;   // conditions, 0: always true. Where low is 0 it is empty, else where high is 0 all of space
} Part;

typedef struct Morphs {
    Ir *ir;
    Arena *scratch;
    Span span;
    IrId t, rest;    // of the morph at hand; rest = 1 - t
    IrId at_b, at_a; // conditions: t is 1, t is 0
    Pairs pairs;     // of nodes of a and b
    IrId *results;   // of each pair, 0 while it is not known
    uint32_t capacity;
    uint64_t made; // leaves so far
} Morphs;

enum { MADE_MAX = 10000000 };

// --- leaves

static IrId truth(Ir *ir, bool value)
{
    return ir_const(ir, value);
}

static Part part_of(Ir *ir, IrId id)
{
    Part part = {0};
    for (;; id = ir_operand(ir, id, 0)) {
        IrOp op = ir_at(ir, id)->op;
        if (op == OP_NAMED) {
            part.name = id;
        } else if (op == OP_PAINT) {
            part.paint = ir_operand(ir, id, 1);
        } else if (op == OP_SHOW) {
            part.low = ir_operand(ir, id, 1);
        } else {
            break;
        }
    }
    if (ir_at(ir, id)->op == OP_EMPTY) {
        part.low = truth(ir, false);
    } else if (ir_at(ir, id)->op == OP_COMPLEMENT) { // of nothing, or of SHOW(complement)
        IrId inner = ir_operand(ir, id, 0);
        bool all = ir_at(ir, inner)->op == OP_EMPTY;
        part.high = all ? truth(ir, false) : ir_operand(ir, inner, 1);
        if (!all) part.core = ir_operand(ir, ir_operand(ir, inner, 0), 0);
    } else {
        part.core = id;
    }
    return part;
}

// A condition that is known to hold is none.
static IrId condition(const Ir *ir, IrId id, bool *never)
{
    double value = 1;
    bool known = id && ir_is_const(ir, id, &value);
    *never = known && value == 0;
    return known && value != 0 ? 0 : id;
}

static IrId leaf_of(Ir *ir, Span span, Part part)
{
    bool empty, all;
    part.low = condition(ir, part.low, &empty);
    part.high = condition(ir, part.high, &all);
    if (empty) return ir_node(ir, OP_EMPTY, span, NULL, 0);
    if (all && !part.low) return ir_op1(ir, OP_COMPLEMENT, span, ir_node(ir, OP_EMPTY, span, NULL, 0));
    if (all || !part.core) { // nothing or all of space, as the frame says
        part.core = leaf_quadric(ir, span, (const double[10]){[9] = part.high ? 1 : -1});
        part.high = 0;
    }
    IrId id = part.high ? leaf_mark_all(ir, part.core, part.high) : part.core;
    return leaf_marked(ir, span, id, part.paint, part.low, part.name);
}

// --- numbers

static IrId sum(Morphs *m, IrId a, IrId b)
{
    Ir *ir = m->ir;
    if (a == b) return a;
    return ir_op2(ir, OP_ADD, m->span, ir_op2(ir, OP_MUL, m->span, a, m->rest), ir_op2(ir, OP_MUL, m->span, b, m->t));
}

static IrId coefficient(Morphs *m, IrId base, uint32_t k)
{
    if (ir_at(m->ir, base)->op == OP_QUADRIC) return ir_operand(m->ir, base, k);
    return ir_node_index(m->ir, OP_COEFFICIENT, ir_at(m->ir, base)->span, &base, 1, k);
}

static IrId mixed_base(Morphs *m, IrId a, IrId b)
{
    if (a == b) return a;
    IrId operands[10];
    for (uint32_t k = 0; k < 10; k++) operands[k] = sum(m, coefficient(m, a, k), coefficient(m, b, k));
    return ir_node(m->ir, OP_QUADRIC, m->span, operands, 10);
}

// --- free forms

static IrId base_of(const Ir *ir, IrId core)
{
    return ir_at(ir, core)->op == OP_FREEFORM ? ir_operand(ir, core, 0) : core;
}

static uint32_t perturbation_count(const Ir *ir, IrId core)
{
    return ir_at(ir, core)->op == OP_FREEFORM ? ir_at(ir, core)->count - 1 : 0;
}

static bool has_perturbation(const Ir *ir, IrId core, IrId perturbation)
{
    for (uint32_t k = 0; k < perturbation_count(ir, core); k++) {
        if (ir_operand(ir, core, 1 + k) == perturbation) return true;
    }
    return false;
}

static IrId weighted(Morphs *m, IrId perturbation, IrId weight)
{
    Ir *ir = m->ir;
    IrNode node = *ir_at(ir, perturbation); // PERTURB, COPY
    IrId first = ir_operand(ir, perturbation, 0), s = ir_operand(ir, perturbation, 1),
         last = ir_operand(ir, perturbation, 2);
    return ir_op3(ir, (IrOp)node.op, node.span, first, ir_op2(ir, OP_MUL, m->span, s, weight), last);
}

static bool is_general(const Ir *ir, IrId core)
{
    IrId matrix;
    return ir_at(ir, leaf_function(ir, base_of(ir, core), &matrix))->op == OP_FIELD;
}

static IrId mixed_core(Morphs *m, IrId a, IrId b)
{
    Ir *ir = m->ir;
    if (!a || !b) return a ? a : b; // the other is never looked at where this one has a weight
    if (a == b) return a;
    if (is_general(ir, a) || is_general(ir, b)) {
        IrId f = object_core_expression(ir, a), g = object_core_expression(ir, b);
        return ir_op1(ir, OP_FIELD, m->span, expression_mixed(ir, m->span, f, g, m->t));
    }
    uint32_t in_a = perturbation_count(ir, a), in_b = perturbation_count(ir, b), count = 0;
    Arena scratch = {0};
    IrId *operands = arena_array(&scratch, IrId, in_a + in_b + 1);
    operands[count++] = mixed_base(m, base_of(ir, a), base_of(ir, b));
    for (uint32_t k = 0; k < in_a; k++) {
        IrId one = ir_operand(ir, a, 1 + k);
        operands[count++] = has_perturbation(ir, b, one) ? one : weighted(m, one, m->rest);
    }
    for (uint32_t k = 0; k < in_b; k++) {
        IrId one = ir_operand(ir, b, 1 + k);
        if (!has_perturbation(ir, a, one)) operands[count++] = weighted(m, one, m->t);
    }
    IrId core = ir_node(ir, OP_FREEFORM, m->span, operands, count);
    arena_release(&scratch);
    return core;
}

// --- marks

static IrId mixed_paint(Morphs *m, IrId a, IrId b)
{
    Ir *ir = m->ir;
    if (a == b) return a;
    IrId operands[LEAF_MATERIAL_PARTS];
    for (uint32_t k = 0; k < LEAF_MATERIAL_PARTS; k++) {
        IrId of_a = a ? ir_operand(ir, a, k) : ir_const(ir, leaf_default_material[k]);
        IrId of_b = b ? ir_operand(ir, b, k) : ir_const(ir, leaf_default_material[k]);
        operands[k] = sum(m, of_a, of_b);
    }
    return ir_node(ir, OP_MATERIAL, m->span, operands, LEAF_MATERIAL_PARTS);
}

// Both conditions, each only where its operand has a weight. 0 stands for true.
static IrId mixed_condition(Morphs *m, IrId a, IrId b)
{
    Ir *ir = m->ir;
    if (a == b) return a;
    IrId of_a = a ? ir_op2(ir, OP_OR, m->span, m->at_b, a) : 0, of_b = b ? ir_op2(ir, OP_OR, m->span, m->at_a, b) : 0;
    if (!of_a || !of_b) return of_a ? of_a : of_b;
    return ir_op2(ir, OP_AND, m->span, of_a, of_b);
}

static IrId mixed_leaf(Morphs *m, IrId a, IrId b)
{
    Part one = part_of(m->ir, a), other = part_of(m->ir, b);
    Part part = {.core = mixed_core(m, one.core, other.core),
                 .paint = mixed_paint(m, one.paint, other.paint),
                 .name = one.name ? one.name : other.name,
                 .low = mixed_condition(m, one.low, other.low),
                 .high = mixed_condition(m, one.high, other.high)};
    m->made++;
    return leaf_of(m->ir, m->span, part);
}

// --- sets

static bool is_set(const Ir *ir, IrId id)
{
    return ir_at(ir, id)->op == OP_UNION || ir_at(ir, id)->op == OP_INTERSECT;
}

static IrId mixed(Morphs *m, IrId a, IrId b);

// Each child of the set with the other operand.
static IrId mixed_set(Morphs *m, IrId set, IrId a, IrId b)
{
    Ir *ir = m->ir;
    uint32_t count = ir_at(ir, set)->count;
    IrOp op = ir_at(ir, set)->op;
    Arena scratch = {0};
    IrId *operands = arena_array(&scratch, IrId, count);
    bool ok = true;
    for (uint32_t k = 0; k < count && ok; k++) {
        IrId child = ir_operand(ir, set, k);
        operands[k] = set == a ? mixed(m, child, b) : mixed(m, a, child);
        ok = operands[k] != 0;
    }
    IrId result = ok ? ir_node(ir, op, ir_at(ir, set)->span, operands, count) : 0;
    arena_release(&scratch);
    return result;
}

// 0 where there would be too many leaves. How deep sets nest in a morph was limited when it was made.
static IrId mixed(Morphs *m, IrId a, IrId b)
{
    bool added;
    uint32_t pair = pairs_index(&m->pairs, a, b, &added);
    if (!added) return m->results[pair];
    m->results = array_room(m->scratch, m->results, pair, &m->capacity, sizeof *m->results);
    m->results[pair] = 0;
    IrId result;
    if (m->made > MADE_MAX)
        result = 0;
    else if (is_set(m->ir, a))
        result = mixed_set(m, a, a, b);
    else if (is_set(m->ir, b))
        result = mixed_set(m, b, a, b);
    else
        result = mixed_leaf(m, a, b);
    m->results[pair] = result;
    return result;
}

// --- the walk

static void down(Walk *walk, IrId id, uint32_t context)
{
    IrOp op = ir_at(walk->ir, id)->op;
    if (op != OP_UNION && op != OP_INTERSECT && op != OP_MORPH) return;
    uint32_t count = op == OP_MORPH ? 2 : ir_at(walk->ir, id)->count;
    for (uint32_t k = 0; k < count; k++) walk_reach(walk, ir_operand(walk->ir, id, k), context);
}

static IrId morphed(Walk *walk, IrId id, uint32_t context)
{
    Morphs *m = walk->pass;
    Ir *ir = walk->ir;
    m->span = ir_at(ir, id)->span;
    m->t = ir_operand(ir, id, 2);
    IrId one = ir_const(ir, 1), zero = ir_const(ir, 0);
    m->rest = ir_op2(ir, OP_SUB, m->span, one, m->t);
    m->at_b = ir_op2(ir, OP_LE, m->span, one, m->t);
    m->at_a = ir_op2(ir, OP_LE, m->span, m->t, zero);
    m->pairs = pairs_new(m->scratch);
    IrId a = walk_result(walk, ir_operand(ir, id, 0), context), b = walk_result(walk, ir_operand(ir, id, 1), context);
    IrId result = mixed(m, a, b);
    if (!result) walk->overflow = true;
    return result ? result : id;
}

static IrId up(Walk *walk, IrId id, uint32_t context)
{
    IrOp op = ir_at(walk->ir, id)->op;
    if (op == OP_MORPH) return morphed(walk, id, context);
    return op == OP_UNION || op == OP_INTERSECT ? walk_rebuild(walk, id, context) : id;
}

// Conditions under which a leaf is all of space are needed as such while something may still be added to it.
static IrId settled(Ir *ir, IrId id)
{
    Part part = part_of(ir, id);
    if (!part.core || !part.high) return id;
    part.core = leaf_unless_all(ir, part.core, part.high);
    part.high = 0;
    return leaf_of(ir, ir_at(ir, id)->span, part);
}

static IrId up_settled(Walk *walk, IrId id, uint32_t context)
{
    return is_set(walk->ir, id) ? walk_rebuild(walk, id, context) : settled(walk->ir, id);
}

static bool has_morph(const Ir *ir)
{
    for (IrId id = 1; id <= ir->root; id++) {
        if (ir_at(ir, id)->op == OP_MORPH) return true;
    }
    return false;
}

bool pass_morphs(Ir *ir, Arena *scratch)
{
    if (!has_morph(ir)) return true;
    Morphs m = {.ir = ir, .scratch = scratch};
    Walk walk = {.ir = ir, .scratch = scratch, .pass = &m};
    IrId root = walk_run(&walk, ir->root, 0, down, up);
    if (!root || walk.overflow) return false;
    Walk last = {.ir = ir, .scratch = scratch};
    ir->root = walk_run(&last, root, 0, down, up_settled);
    return ir->root != 0;
}
