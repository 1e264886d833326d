// morph, and keys of objects.
//
// A morph of two objects stays a node of the IR; pass_morphs.c makes free forms of it. Keys of objects are a union of
// morphs, each between two neighbouring keys and shown while the driver is between them: so however many keys there
// are, a frame has one morph of two objects in it, and the others cost a condition each.
#include <assert.h>

#include "compiler/evaluator.h"
#include "compiler/expression.h"
#include "compiler/object.h"

// Of a morph of sets each leaf of one is joined with each of the other.
enum { MORPH_LEAVES_MAX = 100000, MORPH_DEPTH_MAX = 1000 };

struct MorphSize { // of a node of the IR, as what is morphed
    double leaves;
    uint32_t depth; // of set operations
    bool patched;   // it has sheets, or is displaced
};

static MorphSize size_of(const Eval *e, IrId id)
{
    const IrNode *node = ir_at(e->ir, id);
    const MorphSize *sizes = e->morph_sizes;
    if (node->type != IR_FIELD) return (MorphSize){0};
    if (node->op == OP_QUADRIC || node->op == OP_FIELD || node->op == OP_EMPTY) return (MorphSize){1, 0, false};
    if (node->op == OP_SHEET || node->op == OP_THICKEN) return (MorphSize){1, 0, true};
    MorphSize first = sizes[ir_operand(e->ir, id, 0)];
    for (uint32_t k = 1; k < node->count; k++) first.patched |= ir_at(e->ir, ir_operand(e->ir, id, k))->op == OP_LIFT;
    if (node->op == OP_MORPH) {
        MorphSize second = sizes[ir_operand(e->ir, id, 1)];
        return (MorphSize){first.leaves * second.leaves, first.depth + second.depth, first.patched || second.patched};
    }
    if (node->op != OP_UNION && node->op != OP_INTERSECT) return first; // a map or a mark of one
    MorphSize size = {0};
    for (uint32_t k = 0; k < node->count; k++) {
        MorphSize one = sizes[ir_operand(e->ir, id, k)];
        size.leaves += one.leaves;
        size.patched |= one.patched;
        if (one.depth >= size.depth) size.depth = one.depth + 1;
    }
    return size;
}

// Sizes are computed for all nodes up to this one, once for each.
static MorphSize morph_size(Eval *e, IrId id)
{
    if (id >= e->morph_size_capacity) {
        uint32_t capacity = (id + 1) * 2;
        MorphSize *larger = arena_array(&e->scratch, MorphSize, capacity);
        for (uint32_t k = 0; k < e->morph_size_count; k++) larger[k] = e->morph_sizes[k];
        e->morph_sizes = larger;
        e->morph_size_capacity = capacity;
    }
    for (; e->morph_size_count <= id; e->morph_size_count++)
        e->morph_sizes[e->morph_size_count] = size_of(e, e->morph_size_count);
    return e->morph_sizes[id];
}

static bool can_be_morphed(Eval *e, const Node *at, IrId a, IrId b)
{
    if (morph_size(e, a).patched || morph_size(e, b).patched) {
        complain(e, at, DIAG_NOT_YET,
                 "a morph of sheets and of what patches displace is not there yet in this version of scn");
        return false;
    }
    MorphSize one = morph_size(e, a), other = morph_size(e, b);
    if (one.leaves * other.leaves > MORPH_LEAVES_MAX) {
        complain(e, at, DIAG_TOO_MANY_ITEMS,
                 "each of %.0f surfaces would be morphed with each of %.0f: morph parts of them, one by one",
                 one.leaves, other.leaves);
        return false;
    }
    if (one.depth + other.depth > MORPH_DEPTH_MAX) {
        complain(e, at, DIAG_TOO_DEEP, "unions and intersections are nested more than %d deep in this morph",
                 MORPH_DEPTH_MAX);
        return false;
    }
    return true;
}

// t is in 0 … 1; where it is 0 or 1 for certain that is a or b itself.
IrId morph_objects(Eval *e, const Node *at, IrId a, IrId b, Scalar t)
{
    if (!t.id && t.number <= 0) return a;
    if (!t.id && t.number >= 1) return b;
    if (!can_be_morphed(e, at, a, b)) return 0;
    return ir_op3(e->ir, OP_MORPH, span_of(e, at), a, b, scalar_id(e, t));
}

// A weight that differs from point to point makes one field of both.
static Value morph_at_points(Eval *e, const Node *node, IrId a, IrId b, IrId t)
{
    if (object_is_patched(e->ir, a) || object_is_patched(e->ir, b)) {
        complain(e, node, DIAG_NOT_YET,
                 "a morph of sheets and of what patches displace is not there yet in this version of scn");
        return value_bad();
    }
    IrId one = object_leaves(e->ir, a), other = object_leaves(e->ir, b);
    if (one && other && (object_has_marks(e->ir, one) || object_has_marks(e->ir, other))) {
        complain(e, node, DIAG_NOT_YET,
                 "a morph by a weight that differs from point to point is not there yet in this version of scn where a "
                 "part has paint or a name of its own: paint the morph");
        return value_bad();
    }
    IrId f = one ? object_expression(e->ir, one) : 0, g = other ? object_expression(e->ir, other) : 0;
    if (!f || !g) {
        complain(e, node, DIAG_TOO_MANY_ITEMS, "the objects have more than %d parts: use fewer copies", ITEMS_MAX);
        return value_bad();
    }
    Span span = span_of(e, node);
    return value_node(TYPE_OBJECT, ir_op1(e->ir, OP_FIELD, span, expression_mixed(e->ir, span, f, g, t)));
}

Value eval_morph(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Scalar t = args[2].scalar;
    if (!t.id && (t.number < 0 || t.number > 1)) {
        complain(e, bound_node(call, 2, node), DIAG_MORPH_RANGE,
                 "the weight of a morph is from 0 to 1, and this is %.6g: it is %d here", t.number, t.number > 1);
    }
    t = unit_interval(e, node, t);
    if (!knows_expression(e, bound_node(call, 2, node), t)) return value_bad();
    if (at_point(e, t)) return morph_at_points(e, node, args[0].id, args[1].id, scalar_id(e, t));
    IrId id = morph_objects(e, node, args[0].id, args[1].id, t);
    return id ? value_node(TYPE_OBJECT, id) : value_bad();
}
