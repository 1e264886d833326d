// Answers about objects: `surface(…)`, the place where a ray first meets an object, and `membership(…)` of a point.
//
// A place is the frame that stands there (OP_SURFACE): a map of the IR whose last column is the point and whose z column
// the outward normal. Where the object and the ray are const it is found while the scene is built; else it is a step of
// the frame program, so the place follows what moves and no kernel is built for it.
#include <string.h>

#include "compiler/evaluator.h"

enum { SURFACE_OF, SURFACE_FROM, SURFACE_TOWARD };

// The object that is being formed, in the coordinates of the frame around.
IrId formed_object(Eval *e, const Node *at)
{
    IrId object = e->forming->object;
    if (!e->forming->matrix) return object;
    Span span = span_of(e, at);
    return ir_op2(e->ir, OP_TRANSFORM, span, object, ir_op1(e->ir, OP_INVERSE, span, e->forming->matrix));
}

static bool same_point(const Value *a, const Value *b)
{
    for (int k = 0; k < 3; k++) {
        Scalar x = a->vector[k], y = b->vector[k];
        if (x.id != y.id || (!x.id && x.number != y.number)) return false;
    }
    return true;
}

Value eval_surface(Eval *e, const Node *node, const Call *call, const Value *args)
{
    IrId operands[7];
    bool of = call->bound[SURFACE_OF].how != BOUND_DEFAULT;
    if (!of && !e->forming) {
        complain(e, node, DIAG_TOOL_PLACE,
                 "the surface of what? Outside of freeform(object) { … } write surface(object, from: …)");
        return value_bad();
    }
    if (same_point(&args[SURFACE_FROM], &args[SURFACE_TOWARD])) {
        complain(e, bound_node(call, SURFACE_FROM, node), DIAG_OUT_OF_RANGE,
                 "the ray has no direction: from and toward are the same point");
        return value_bad();
    }
    operands[0] = of ? args[SURFACE_OF].id : formed_object(e, node);
    for (int k = 0; k < 3; k++) {
        operands[1 + k] = scalar_id(e, args[SURFACE_FROM].vector[k]);
        operands[4 + k] = scalar_id(e, args[SURFACE_TOWARD].vector[k]);
    }
    IrId place = ir_node(e->ir, OP_SURFACE, span_of(e, node), operands, 7);
    if (ir_bad_fold(e->ir, place)) {
        const Node *at = bound_node(call, SURFACE_FROM, node);
        complain(e, at, DIAG_TOOL_MISSES, "the ray from %s toward %s meets no surface: aim it at the object",
                 value_text(&e->scratch, &args[SURFACE_FROM], 4), value_text(&e->scratch, &args[SURFACE_TOWARD], 4));
        return value_bad();
    }
    return value_node(TYPE_PLACE, place);
}

// place.point and place.normal.
Value eval_place_member(Eval *e, const Node *node, const Value *place)
{
    uint32_t column = !strcmp(node->name, "point") ? 3 : 2;
    Scalar parts[3];
    for (uint32_t k = 0; k < 3; k++) {
        IrId entry = ir_entry(e->ir, span_of(e, node), place->id, 4 * k + column);
        double number;
        parts[k] = ir_is_const(e->ir, entry, &number) ? scalar_of(number) : (Scalar){.id = entry};
    }
    return value_vector(&e->scratch, type_of(TYPE_VEC3), parts, 3);
}

// --- membership: F at the point, which the members compare with 0

Value eval_membership(Eval *e, const Node *node, const Call *call, const Value *args)
{
    enum { POINT, OF };
    IrId operands[4] = {args[OF].id};
    for (int k = 0; k < 3; k++) operands[1 + k] = scalar_id(e, args[POINT].vector[k]);
    IrId id = ir_node(e->ir, OP_AT, span_of(e, node), operands, 4);
    double f;
    Scalar value = ir_is_const(e->ir, id, &f) ? scalar_of(f) : (Scalar){.id = id};
    return value_scalar(type_of(TYPE_MEMBERSHIP), value);
}

// What rounding leaves of 0 is 0: F is a length near the surface.
Value eval_membership_member(Eval *e, const Node *node, const Value *membership)
{
    Scalar f = membership->scalar, little = scalar_of(1e-12);
    Scalar inside = scalar_op2(e, OP_LT, node, little, f);
    Scalar outside = scalar_op2(e, OP_LT, node, f, scalar_op1(e, OP_NEG, node, little));
    if (!strcmp(node->name, "inside")) return value_scalar(type_of(TYPE_BOOL), inside);
    if (!strcmp(node->name, "outside")) return value_scalar(type_of(TYPE_BOOL), outside);
    Scalar neither = scalar_op1(e, OP_NOT, node, scalar_op2(e, OP_OR, node, inside, outside));
    return value_scalar(type_of(TYPE_BOOL), neither);
}
