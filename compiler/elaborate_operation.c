// Operations on whole objects: offsets, blends, warps. What has an exact form of its own class is made as such; the rest
// is put into the leaves as expressions (compiler/object.h), so that names, paint and conditions stay where they are.
#include <assert.h>
#include <string.h>

#include "compiler/evaluator.h"
#include "compiler/expression.h"
#include "compiler/object.h"
#include "compiler/radius.h"

enum { OFFSET_OF, OFFSET_ISO, OFFSET_NORMAL, OFFSET_RADIUS, OFFSET_UNNORMALISED };

// The call that is evaluated, and how its expressions are written.
typedef struct Operation {
    Eval *e;
    Ir *ir;
    const Node *node;
    Span span;
} Operation;

static Operation operation_at(Eval *e, const Node *node)
{
    return (Operation){e, e->ir, node, span_of(e, node)};
}

static IrId op1(Operation *o, IrOp op, IrId a)
{
    return ir_op1(o->ir, op, o->span, a);
}

static IrId op2(Operation *o, IrOp op, IrId a, IrId b)
{
    return ir_op2(o->ir, op, o->span, a, b);
}

static IrId number(Operation *o, double value)
{
    return ir_const(o->ir, value);
}

static IrId axis(Operation *o, int k)
{
    static const IrOp axes[3] = {OP_X, OP_Y, OP_Z};
    return ir_node(o->ir, axes[k], o->span, NULL, 0);
}

static IrId clamped(Operation *o, IrId a, IrId low, IrId high)
{
    return op2(o, OP_MIN, op2(o, OP_MAX, a, low), high);
}

static bool given(const Call *call, int at)
{
    return call->bound[at].how != BOUND_DEFAULT;
}

bool takes_points(uint16_t builtin, uint32_t argument)
{
    enum { MORPH_T = 2 };
    return (builtin == BUILTIN_OFFSET && argument == OFFSET_ISO) || (builtin == BUILTIN_MORPH && argument == MORPH_T);
}

bool knows_expression(Eval *e, const Node *at, Scalar s)
{
    IrOp unknown = s.id ? expression_unknown(e->ir, s.id) : OP_NONE;
    if (!unknown) return true;
    complain(e, at, DIAG_NOT_YET, "%s at a point of a field is not there yet in this version of scn",
             ir_ops[unknown].name);
    return false;
}

// What a walk over the object gave; 0 is too many parts.
static Value object_or_report(Operation *o, IrId id)
{
    if (id) return value_node(TYPE_OBJECT, id);
    complain(o->e, o->node, DIAG_TOO_MANY_ITEMS, "the object has more than %d parts: use fewer copies", ITEMS_MAX);
    return value_bad();
}

static bool refuse_patched(Operation *o, IrId object)
{
    if (!object_is_patched(o->ir, object)) return false;
    complain(
        o->e, o->node, DIAG_NOT_YET,
        "offsets, blends and warps of sheets and of what patches displace are not there yet in this version of scn");
    return true;
}

// --- offsets

// F + c. A number is a perturbation that reaches everywhere, 1 cubed times c, so that the class stays what it is; what
// differs from point to point is added to the expressions of the leaves.
static Value offset_iso(Operation *o, IrId object, Scalar c)
{
    if (at_point(o->e, c)) {
        IrId leaves = object_leaves(o->ir, object);
        return object_or_report(o, leaves ? object_plus(o->ir, leaves, c.id) : 0);
    }
    IrId zero = number(o, 0), one = number(o, 1), everywhere[10];
    for (int k = 0; k < 10; k++) everywhere[k] = k < 9 ? zero : one;
    IrId q = ir_node(o->ir, OP_QUADRIC, o->span, everywhere, 10);
    IrId parts[2] = {object, ir_op3(o->ir, OP_PERTURB, o->span, q, scalar_id(o->e, c), zero)};
    return value_node(TYPE_OBJECT, ir_node(o->ir, OP_DEFORM, o->span, parts, 2));
}

// Where the gradient is 0 there is no normal, and the point stays where it is.
static IrId length_of(Operation *o, const IrId v[3])
{
    IrId sum = number(o, 0);
    for (int k = 0; k < 3; k++) sum = op2(o, OP_ADD, sum, op2(o, OP_MUL, v[k], v[k]));
    return op2(o, OP_MAX, op1(o, OP_SQRT, sum), number(o, 1e-18));
}

typedef struct Normal {
    Operation *o;
    IrId distance;
    bool unnormalised;
    bool *rough; // a leaf has noise, whose derivatives are no expressions
} Normal;

// F(X + d N) of one leaf. A part of N is within -1 … 1, which bounds over a box of points would not find out. What is
// subtracted has its normal the other way.
static IrId along_normal(void *context, Ir *ir, IrId expression, bool negative)
{
    const Normal *n = context;
    Operation *o = n->o;
    IrId gradient[3], coordinates[3];
    *n->rough |= expression_has(ir, expression, OP_NOISE) || expression_has(ir, expression, OP_CELLS);
    expression_gradient(ir, expression, gradient);
    IrId length = n->unnormalised ? 0 : length_of(o, gradient);
    for (int k = 0; k < 3; k++) {
        IrId part = gradient[k];
        if (length) part = clamped(o, op2(o, OP_DIV, part, length), number(o, -1), number(o, 1));
        coordinates[k] = op2(o, negative ? OP_SUB : OP_ADD, axis(o, k), op2(o, OP_MUL, part, n->distance));
    }
    return expression_substitute(ir, expression, coordinates);
}

static Value offset_normal(Operation *o, IrId object, Scalar distance, bool unnormalised)
{
    bool rough = false;
    Normal normal = {o, scalar_id(o->e, distance), unnormalised, &rough};
    IrId leaves = object_leaves(o->ir, object);
    IrId id = leaves ? object_changed(o->ir, leaves, along_normal, &normal) : 0;
    if (!rough) return object_or_report(o, id);
    complain(o->e, o->node, DIAG_NOT_YET,
             "an offset along normals of noise and cells is not there yet in this version of scn: write iso");
    return value_bad();
}

static const char *radius_text(RadiusProblem problem)
{
    switch (problem) {
    case RADIUS_CORNER:
        return "an offset by a radius where parts meet is not there yet in this version of scn, but of unions that "
               "grow, of intersections that shrink and of balls, cylinders, slabs and half-spaces at right angles: "
               "offset the parts, or write iso or normal";
    case RADIUS_MOVES:
        return "an offset by a radius of what is scaled or sheared by numbers that move is not there yet in this "
               "version "
               "of "
               "scn: offset it first, then scale it";
    case RADIUS_SIGN:
        return "a radius of several parts that is not known when compiled is not there yet in this version of scn: "
               "offset "
               "each part, or write a number, or a param with a range that begins or ends at 0";
    default:
        return "an offset by a radius of free forms, general fields and morphs is not there yet in this version of "
               "scn: offset "
               "the base before perturbations are added, or write iso or normal";
    }
}

static IrId offset_radius(Operation *o, IrId object, Scalar radius, RadiusSign sign)
{
    RadiusProblem problem;
    Span where;
    IrId id = radius_offset(o->ir, object, scalar_id(o->e, radius), sign, &problem, &where);
    if (problem == RADIUS_MANY) {
        object_or_report(o, 0);
    } else if (problem) {
        Diag *d = complain(o->e, o->node, DIAG_NOT_YET, "%s", radius_text(problem));
        if (d && where.end) diag_label(o->e->unit, d, where, "this part");
    }
    return id;
}

static Value eval_offset(Operation *o, const Call *call, const Value *args)
{
    int count = given(call, OFFSET_ISO) + given(call, OFFSET_NORMAL) + given(call, OFFSET_RADIUS);
    if (count != 1) {
        complain(o->e, o->node, count ? DIAG_TOO_MANY_ARGUMENTS : DIAG_MISSING_ARGUMENT,
                 "an offset is by one of iso, normal and radius, and here %s: write offset(radius: 0.1)",
                 count ? "are several" : "is none");
        return value_bad();
    }
    if (!knows_expression(o->e, bound_node(call, OFFSET_ISO, o->node), args[OFFSET_ISO].scalar)) return value_bad();
    if (given(call, OFFSET_ISO)) return offset_iso(o, args[OFFSET_OF].id, args[OFFSET_ISO].scalar);
    if (given(call, OFFSET_NORMAL)) {
        Scalar literal = args[OFFSET_UNNORMALISED].scalar;
        double unnormalised;
        if (!want_const(o->e, bound_node(call, OFFSET_UNNORMALISED, o->node), literal, "unnormalised", &unnormalised))
            return value_bad();
        return offset_normal(o, args[OFFSET_OF].id, args[OFFSET_NORMAL].scalar, unnormalised != 0);
    }
    IrId id = offset_radius(o, args[OFFSET_OF].id, args[OFFSET_RADIUS].scalar, RADIUS_ANY);
    return id ? value_node(TYPE_OBJECT, id) : value_bad();
}

static Value eval_shell(Operation *o, const Call *call, const Value *args)
{
    test_bounds(o->e, bound_node(call, 1, o->node), args[1].scalar, 0, true, INFINITY, "a thickness is greater than 0");
    Scalar half = scalar_op2(o->e, OP_MUL, o->node, args[1].scalar, scalar_of(0.5));
    IrId outer = offset_radius(o, args[0].id, half, RADIUS_GROWS), inner = 0;
    if (outer) inner = offset_radius(o, args[0].id, scalar_op1(o->e, OP_NEG, o->node, half), RADIUS_SHRINKS);
    if (!inner) return value_bad();
    return value_node(TYPE_OBJECT, op2(o, OP_INTERSECT, outer, op1(o, OP_COMPLEMENT, inner)));
}

// --- blends

typedef struct Blend {
    bool intersects, rfunction;
    IrId width;
    bool hides; // of one of the two: its F may be OBJECT_NOWHERE
} Blend;

// What the union of F and G gains, and their intersection loses: h² / 4w with h = max(w - |F - G|, 0). A width of 0 is
// none.
static IrId smooth_gain(Operation *o, const Blend *b, IrId f, IrId g)
{
    IrId apart = op1(o, OP_ABS, op2(o, OP_SUB, f, g));
    IrId h = op2(o, OP_MAX, op2(o, OP_SUB, b->width, apart), number(o, 0));
    IrId four = op2(o, OP_MUL, number(o, 4), op2(o, OP_MAX, b->width, number(o, 1e-12)));
    return op2(o, OP_DIV, op2(o, OP_MUL, h, h), four);
}

// The union of F and G is F + G + √(F² + G²), and outside of both -2 F G / (√(F² + G²) - F - G), which is the same number
// and shows its sign to bounds. The intersection is minus the union of -F and -G. Of what is nowhere only the other one is
// left; the sum would be lost in rounding.
static IrId rfunction(Operation *o, const Blend *b, IrId f, IrId g)
{
    if (b->intersects) {
        f = op1(o, OP_NEG, f);
        g = op1(o, OP_NEG, g);
    }
    IrId root = op1(o, OP_SQRT, op2(o, OP_ADD, op2(o, OP_MUL, f, f), op2(o, OP_MUL, g, g)));
    IrId sum = op2(o, OP_ADD, f, g), greater = op2(o, OP_MAX, f, g);
    IrId product = op2(o, OP_MUL, number(o, -2), op2(o, OP_MUL, f, g));
    IrId outside = op2(o, OP_DIV, product, op2(o, OP_SUB, root, sum));
    IrId out = op2(o, OP_LT, greater, number(o, 0));
    IrId result = ir_op3(o->ir, OP_SELECT, o->span, out, outside, op2(o, OP_ADD, sum, root));
    if (b->hides) {
        IrId far =
            op2(o, OP_LT, number(o, -0.5 * OBJECT_NOWHERE), op2(o, OP_MAX, op1(o, OP_ABS, f), op1(o, OP_ABS, g)));
        result = ir_op3(o->ir, OP_SELECT, o->span, far, greater, result);
    }
    return b->intersects ? op1(o, OP_NEG, result) : result;
}

// Two objects with all at their leaves. Each part of both gains the same, so the part that decides gives its paint and its
// name; where there are none, the whole is one expression.
static IrId blended(Operation *o, Blend *b, IrId one, IrId other)
{
    Ir *ir = o->ir;
    IrId f = object_expression(ir, one), g = object_expression(ir, other);
    if (!f || !g) return 0;
    b->hides = object_may_hide(ir, one) || object_may_hide(ir, other);
    IrId sharp = op2(o, b->intersects ? OP_MIN : OP_MAX, f, g), gain, result;
    if (b->rfunction) {
        result = rfunction(o, b, f, g);
        gain = op2(o, OP_SUB, result, sharp);
    } else {
        gain = smooth_gain(o, b, f, g);
        if (b->intersects) gain = op1(o, OP_NEG, gain);
        result = op2(o, OP_ADD, sharp, gain);
    }
    if (!object_has_marks(ir, one) && !object_has_marks(ir, other)) return op1(o, OP_FIELD, result);
    IrId a = object_plus(ir, one, gain), c = object_plus(ir, other, gain);
    return a && c ? op2(o, b->intersects ? OP_INTERSECT : OP_UNION, a, c) : 0;
}

Value eval_blend(Eval *e, const Node *node, const Call *call, const Value *args)
{
    enum { OBJECTS, BLEND, STYLE };
    Operation o = operation_at(e, node);
    bool subtracts = call->callee->id == BUILTIN_SUBTRACT;
    Blend b = {.intersects = call->callee->id != BUILTIN_UNION, .rfunction = strcmp(args[STYLE].string, "smooth") != 0};
    b.width = scalar_id(e, args[BLEND].scalar);
    if (b.rfunction && given(call, BLEND)) {
        complain(e, bound_node(call, BLEND, node), DIAG_OUT_OF_RANGE, "an R-function has no width: leave out blend");
        return value_bad();
    }
    test_bounds(e, bound_node(call, BLEND, node), args[BLEND].scalar, 0, false, INFINITY,
                "the width of a blend is at least 0");
    for (uint32_t k = 0; k < args[OBJECTS].list.count; k++) {
        if (refuse_patched(&o, args[OBJECTS].list.items[k].id)) return value_bad();
    }
    IrId result = object_leaves(o.ir, args[OBJECTS].list.items[0].id);
    for (uint32_t k = 1; k < args[OBJECTS].list.count && result; k++) {
        if (!count_item(e, node)) return value_bad();
        IrId next = args[OBJECTS].list.items[k].id;
        next = object_leaves(o.ir, subtracts ? op1(&o, OP_COMPLEMENT, next) : next);
        result = next ? blended(&o, &b, result, next) : 0;
    }
    return object_or_report(&o, result);
}

// --- warps: where F is looked at for a point

// The coordinates u and v turned by the angle: u cos - v sin, u sin + v cos.
static void turn(Operation *o, IrId angle, int u, int v, IrId at[3])
{
    IrId c = op1(o, OP_COS, angle), s = op1(o, OP_SIN, angle), a = at[u], b = at[v];
    at[u] = op2(o, OP_SUB, op2(o, OP_MUL, a, c), op2(o, OP_MUL, b, s));
    at[v] = op2(o, OP_ADD, op2(o, OP_MUL, a, s), op2(o, OP_MUL, b, c));
}

// Rz(-k z) X
static void twist(Operation *o, const Value *args, IrId at[3])
{
    turn(o, op1(o, OP_NEG, op2(o, OP_MUL, at[2], scalar_id(o->e, args[1].scalar))), 0, 1, at);
}

// Ry(k z) X: a turn from z to x
static void bend(Operation *o, const Value *args, IrId at[3])
{
    turn(o, op2(o, OP_MUL, at[2], scalar_id(o->e, args[1].scalar)), 2, 0, at);
}

// The range of a warp along z: its ends, after they are tested.
static void ends(Operation *o, const Call *call, const Value *args, IrId *low, IrId *length)
{
    Scalar a = value_part(&args[1], 0), size = scalar_op2(o->e, OP_SUB, o->node, value_part(&args[1], 1), a);
    test_bounds(o->e, bound_node(call, 1, o->node), size, 0, true, INFINITY, "a range along z goes up: low .. high");
    *low = scalar_id(o->e, a);
    *length = scalar_id(o->e, size);
}

// x / m and y / m, m from 1 at the lower end to k at the upper
static void taper(Operation *o, const Call *call, const Value *args, IrId at[3])
{
    IrId low, length;
    ends(o, call, args, &low, &length);
    test_bounds(o->e, bound_node(call, 2, o->node), args[2].scalar, 0, false, INFINITY,
                "what it tapers to is at least 0");
    IrId part = clamped(o, op2(o, OP_DIV, op2(o, OP_SUB, at[2], low), length), number(o, 0), number(o, 1));
    IrId less = op2(o, OP_SUB, scalar_id(o->e, args[2].scalar), number(o, 1));
    IrId m = op2(o, OP_ADD, op2(o, OP_MUL, part, less), number(o, 1));
    at[0] = op2(o, OP_DIV, at[0], m);
    at[1] = op2(o, OP_DIV, at[1], m);
}

// z as it was before the range was made k times as long: what is below, the part within, what is above
static void stretch(Operation *o, const Call *call, const Value *args, IrId at[3])
{
    IrId low, length, zero = number(o, 0);
    ends(o, call, args, &low, &length);
    test_bounds(o->e, bound_node(call, 2, o->node), args[2].scalar, 0, true, INFINITY, "a stretch is greater than 0");
    IrId by = scalar_id(o->e, args[2].scalar), longer = op2(o, OP_MUL, length, by);
    IrId above = op2(o, OP_SUB, at[2], low);
    IrId within = op2(o, OP_DIV, clamped(o, above, zero, longer), by);
    IrId rest = op2(o, OP_MAX, op2(o, OP_SUB, above, longer), zero);
    at[2] = op2(o, OP_ADD, op2(o, OP_ADD, op2(o, OP_MIN, at[2], low), within), rest);
}

// p + (X - p)(1 + m w), w = max(0, 1 - |X - p|² / r²)³
static void attract(Operation *o, const Call *call, const Value *args, IrId at[3])
{
    enum { AT = 1, RADIUS, AMOUNT };
    test_bounds(o->e, bound_node(call, RADIUS, o->node), args[RADIUS].scalar, 0, true, INFINITY,
                "a radius is greater than 0");
    IrId away[3], square = number(o, 0), one = number(o, 1), r = scalar_id(o->e, args[RADIUS].scalar);
    for (int k = 0; k < 3; k++) {
        away[k] = op2(o, OP_SUB, at[k], scalar_id(o->e, args[AT].vector[k]));
        square = op2(o, OP_ADD, square, op2(o, OP_MUL, away[k], away[k]));
    }
    IrId w = op2(o, OP_MAX, op2(o, OP_SUB, one, op2(o, OP_DIV, square, op2(o, OP_MUL, r, r))), number(o, 0));
    w = op2(o, OP_MUL, op2(o, OP_MUL, w, w), w);
    IrId factor = op2(o, OP_MUL, w, scalar_id(o->e, args[AMOUNT].scalar));
    for (int k = 0; k < 3; k++) at[k] = op2(o, OP_ADD, at[k], op2(o, OP_MUL, away[k], factor));
}

static Value eval_warp(Operation *o, const Call *call, const Value *args)
{
    IrId at[3] = {axis(o, 0), axis(o, 1), axis(o, 2)};
    switch (call->callee->id) {
    case BUILTIN_TWIST: twist(o, args, at); break;
    case BUILTIN_BEND: bend(o, args, at); break;
    case BUILTIN_TAPER: taper(o, call, args, at); break;
    case BUILTIN_STRETCH: stretch(o, call, args, at); break;
    default: assert(call->callee->id == BUILTIN_ATTRACT && "there are five warps"); attract(o, call, args, at);
    }
    IrId leaves = object_leaves(o->ir, args[0].id);
    return object_or_report(o, leaves ? object_warped(o->ir, leaves, at) : 0);
}

Value eval_operation(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Operation o = operation_at(e, node);
    if (refuse_patched(&o, args[0].id)) return value_bad();
    switch (call->callee->id) {
    case BUILTIN_OFFSET: return eval_offset(&o, call, args);
    case BUILTIN_SHELL: return eval_shell(&o, call, args);
    default: return eval_warp(&o, call, args);
    }
}
