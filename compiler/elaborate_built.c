// Calls of what is built in: sets, quadrics, perturbations, things. The arguments are evaluated here, with defaults,
// and tested for what every use of them wants: to be known at the latest in each frame.
#include <assert.h>
#include <string.h>

#include "compiler/evaluator.h"
#include "compiler/expression.h"
#include "compiler/object.h"

static Value arg_default(Eval *e, const Call *call, const Value *args, uint32_t i)
{
    const Parameter *p = &call->callee->parameters[i];
    return p->default_from >= 0 ? args[p->default_from] : builtin_default(e, p);
}

static bool given(const Call *call, int at)
{
    return call->bound[at].how != BOUND_DEFAULT;
}

// Appends the nodes of a value's parts to `ids`.
static uint32_t push_ids(Eval *e, const Value *value, IrId *ids)
{
    int size = value_size(value->type);
    for (int k = 0; k < size; k++) ids[k] = scalar_id(e, value_part(value, k));
    return (uint32_t)size;
}

static bool varies_at_point(const Eval *e, const Value *value)
{
    for (int k = 0; k < value_size(value->type); k++) {
        if (at_point(e, value_part(value, k))) return true;
    }
    return false;
}

// Reports arguments of point rate where there may be none.
static bool test_rates(Eval *e, const Node *node, const Call *call, const Value *args)
{
    BuiltinKind kind = (BuiltinKind)builtins[call->callee->id].kind;
    if (kind == KIND_FUNCTION || call->callee->id == BUILTIN_FIELD) return true;
    for (uint32_t i = 0; i < call->callee->count; i++) {
        if (type_bad(args[i].type) || !varies_at_point(e, &args[i])) continue;
        if (patch_takes_points(call->callee->id, i) || takes_points(call->callee->id, i)) continue;
        const Node *at = bound_node(call, i, node);
        const char *name = call->callee->parameters[i].name;
        if (call->callee->id == BUILTIN_MATERIAL || call->callee->id == BUILTIN_BACKGROUND ||
            call->callee->id == BUILTIN_PAINT_COLOR) {
            complain(e, at, DIAG_NOT_YET,
                     "a %s that differs from point to point is not there yet in this version of scn", name);
        } else {
            report_rate(e, at, DIAG_POINT_RATE,
                        e->site.end ? "this argument"
                                    : arena_printf(&e->scratch, "%s of %s", name, call->callee->name));
        }
        return false;
    }
    return true;
}

void test_bounds(Eval *e, const Node *at, Scalar s, double low, bool above, double high, const char *what)
{
    if (s.id) {
        Scalar holds = scalar_op2(e, above ? OP_LT : OP_LE, at, scalar_of(low), s);
        if (isfinite(high)) holds = scalar_op2(e, OP_AND, at, holds, scalar_op2(e, OP_LT, at, s, scalar_of(high)));
        add_assert(e, at, holds, arena_printf(&e->unit->arena, "out-of-range: %s", what));
        return;
    }
    if (isnan(s.number) || (above ? s.number > low : s.number >= low) == false || s.number >= high) {
        if (!isnan(s.number)) complain(e, at, DIAG_OUT_OF_RANGE, "%s", what);
    }
}

// --- sets

static Value eval_set(Eval *e, const Node *node, const Call *call, const Value *objects)
{
    uint32_t count = objects->list.count;
    IrId *ids = arena_array(&e->scratch, IrId, count);
    for (uint32_t i = 0; i < count; i++) ids[i] = objects->list.items[i].id;
    switch (call->callee->id) {
    case BUILTIN_INTERSECT:
    case BUILTIN_SUBTRACT:
        if (count == 0) {
            complain(e, node, DIAG_VALUE_COUNT, "%s wants at least one object", call->callee->name);
            return value_bad();
        }
        for (uint32_t i = 1; i < count && call->callee->id == BUILTIN_SUBTRACT; i++) {
            ids[i] = ir_op1(e->ir, OP_COMPLEMENT, span_of(e, node), ids[i]);
        }
        return join_sets(e, node, OP_INTERSECT, ids, count);
    default: return join_sets(e, node, OP_UNION, ids, count);
    }
}

// Coefficients with few digits, such as -1 and 0.5, are found again; a table of all others would hardly ever find one.
static IrId coefficient(Eval *e, Scalar s)
{
    if (!s.id && s.number == 0) s.number = 0; // -0 is 0
    bool few_digits = (double)(float)s.number == s.number;
    return s.id || few_digits || isnan(s.number) ? scalar_id(e, s) : ir_const_alone(e->ir, s.number);
}

static Value eval_quadric(Eval *e, const Node *node, const Value *args)
{
    IrId ids[10];
    for (int k = 0; k < 10; k++) ids[k] = coefficient(e, args[k].scalar);
    return value_node(TYPE_QUADRIC, ir_node(e->ir, OP_QUADRIC, span_of(e, node), ids, 10));
}

static Value eval_field(Eval *e, const Node *node, const Call *call, const Value *args)
{
    if (!knows_expression(e, bound_node(call, 0, node), args[0].scalar)) return value_bad();
    return value_node(TYPE_OBJECT, ir_op1(e->ir, OP_FIELD, span_of(e, node), scalar_id(e, args[0].scalar)));
}

// --- perturbations

// Q + grow: the free term moves, also below transforms, which leave it as it is.
static IrId grown(Eval *e, const Node *node, IrId quadric, Scalar grow)
{
    const IrNode *n = ir_at(e->ir, quadric);
    if (n->op == OP_TRANSFORM) {
        IrId matrix = ir_operand(e->ir, quadric, 1);
        return ir_op2(e->ir, OP_TRANSFORM, n->span, grown(e, node, ir_operand(e->ir, quadric, 0), grow), matrix);
    }
    IrId ids[10];
    memcpy(ids, ir_operands(e->ir, quadric), sizeof ids);
    Span span = n->span;
    ids[9] = ir_op2(e->ir, OP_ADD, span_of(e, node), ids[9], scalar_id(e, grow));
    return ir_node(e->ir, OP_QUADRIC, span, ids, 10);
}

enum { PERTURB_Q, PERTURB_STRENGTH, PERTURB_HEIGHT, PERTURB_GROW, PERTURB_DEPTH, PERTURB_SHARE };

// The strength with which the surface passes through (0, 0, height) of the tool's frame.
static bool height_strength(Eval *e, const Node *node, const Call *call, const Value *args, IrId quadric,
                            IrId *strength)
{
    bool depth = given(call, PERTURB_DEPTH);
    uint32_t at = depth ? PERTURB_DEPTH : PERTURB_HEIGHT;
    const Node *where = bound_node(call, at, node);
    if (!e->forming || !e->forming->matrix) {
        complain(e, where, DIAG_TOOL_PLACE,
                 "%s is known in a tool, in the frame of a surface point: write strength, or make a tool",
                 depth ? "a depth" : "a height");
        return false;
    }
    Scalar height = depth ? scalar_op1(e, OP_NEG, where, args[at].scalar) : args[at].scalar;
    IrId zero = ir_const(e->ir, 0);
    IrId operands[6] = {e->forming->object, quadric, e->forming->matrix, zero, zero, scalar_id(e, height)};
    *strength = ir_node(e->ir, OP_HEIGHT, span_of(e, node), operands, 6);
    if (!ir_bad_fold(e->ir, *strength)) return true;
    complain(e, where, DIAG_OUT_OF_RANGE,
             "the perturbation does not reach this height: its quadric is to be positive there");
    return false;
}

static Value eval_perturb(Eval *e, const Node *node, const Call *call, const Value *args)
{
    IrId operands[3] = {args[PERTURB_Q].id, 0, scalar_id(e, args[PERTURB_GROW].scalar)};
    if (given(call, PERTURB_HEIGHT) || given(call, PERTURB_DEPTH)) {
        Scalar grow = args[PERTURB_GROW].scalar;
        if (grow.id || grow.number != 0) {
            operands[0] = grown(e, node, operands[0], grow);
            operands[2] = ir_const(e->ir, 0);
        }
        if (!height_strength(e, node, call, args, operands[0], &operands[1])) return value_bad();
    } else {
        operands[1] = scalar_id(e, args[PERTURB_STRENGTH].scalar);
    }
    Scalar share = args[PERTURB_SHARE].scalar;
    if (share.id || share.number != 1)
        operands[1] = ir_op2(e->ir, OP_MUL, span_of(e, node), operands[1], scalar_id(e, share));
    IrId *ids = arena_array(&e->scratch, IrId, 1);
    ids[0] = ir_node(e->ir, OP_PERTURB, span_of(e, node), operands, 3);
    Value value = {.type = {.kind = TYPE_PERTURBATION}};
    value.parts.ids = ids;
    value.parts.count = 1;
    return value;
}

static bool refuse_thick(Eval *e, const Node *node, const Value *base)
{
    bool thick = !base->type.list && object_has_thick(e->ir, base->id);
    for (uint32_t k = 0; base->type.list && k < base->list.count; k++)
        thick |= object_has_thick(e->ir, base->list.items[k].id);
    if (thick)
        complain(e, node, DIAG_NOT_YET,
                 "perturbations of a thick patch are not there yet in this version of scn: press the patch instead");
    return thick;
}

// freeform and deform: what is formed is evaluated first, since the tools among the parts work on it.
static Value eval_forming(Eval *e, const Node *node, const Call *call, const Value *receiver)
{
    Value base = eval_bound(e, node, call, 0, receiver);
    if (value_is_bad(&base)) return value_bad();
    if (refuse_thick(e, node, &base)) return value_bad();
    if (base.type.list && base.list.count == 0) {
        complain(e, node, DIAG_VALUE_COUNT, "deform wants at least one object");
        return value_bad();
    }
    IrId first = base.type.list ? base.list.items[0].id : base.id;
    if (base.type.list) base = eval_set(e, node, call, &base);
    Forming *forming = arena_new(&e->scratch, Forming);
    forming->object = first;
    const Forming *around = e->forming;
    e->forming = forming;
    if (call->block && call->has_entries) open_lets(e, call->block);
    Value parts = eval_bound(e, node, call, 1, receiver);
    e->forming = around;
    if (value_is_bad(&parts)) return value_bad();
    List list = {.items = (Value *)parts.list.items, .count = parts.list.count};
    Value sum = sum_perturbations(e, &list);
    if (value_is_bad(&sum)) return sum;
    IrId *ids = arena_array(&e->scratch, IrId, sum.parts.count + 1);
    ids[0] = base.id;
    if (sum.parts.count) memcpy(ids + 1, sum.parts.ids, sum.parts.count * sizeof *ids);
    IrClass class = (IrClass)ir_at(e->ir, base.id)->class;
    IrOp op = class == CLASS_QUADRIC || class == CLASS_FREEFORM ? OP_FREEFORM : OP_DEFORM;
    return value_node(TYPE_OBJECT, ir_node(e->ir, op, span_of(e, node), ids, sum.parts.count + 1));
}

// --- things

enum {
    CAMERA_EYE,
    CAMERA_LOOK_AT,
    CAMERA_UP,
    CAMERA_FOV,
    CAMERA_PROJECTION,
    CAMERA_HEIGHT,
    CAMERA_APERTURE,
    CAMERA_FOCUS,
    CAMERA_SHUTTER
};

static bool same_const(const Value *a, const Value *b)
{
    for (int k = 0; k < 3; k++) {
        if (a->vector[k].id || b->vector[k].id || a->vector[k].number != b->vector[k].number) return false;
    }
    return true;
}

static bool zero_const(const Value *a)
{
    for (int k = 0; k < 3; k++) {
        if (a->vector[k].id || a->vector[k].number != 0) return false;
    }
    return true;
}

// Stops a frame in which a vector is that of `from`, or with NULL 0. What is so in every frame is reported where it is
// written.
static void test_length(Eval *e, const Node *at, const Value *to, const Value *from, const char *what)
{
    bool varies = false;
    Scalar square = scalar_of(0);
    for (int k = 0; k < 3; k++) {
        Scalar part = to->vector[k];
        if (from) part = scalar_op2(e, OP_SUB, at, part, from->vector[k]);
        varies |= part.id != 0;
        square = scalar_op2(e, OP_ADD, at, square, scalar_op2(e, OP_MUL, at, part, part));
    }
    if (!varies) return;
    Scalar holds = scalar_op2(e, OP_LT, at, scalar_of(0), square);
    add_assert(e, at, holds, arena_printf(&e->unit->arena, "out-of-range: %s", what));
}

// From where the scene is seen if no eye is given: from the front, a little from above and the right.
static const double automatic_direction[3] = {0.5, 0.4, 1};

static Value eval_camera(Eval *e, const Node *node, const Call *call, const Value *args)
{
    bool automatic = !given(call, CAMERA_EYE);
    if (!automatic && same_const(&args[CAMERA_EYE], &args[CAMERA_LOOK_AT])) {
        complain(e, bound_node(call, CAMERA_EYE, node), DIAG_OUT_OF_RANGE,
                 "the camera looks at where it stands: move eye or look_at");
        return value_bad();
    }
    if (zero_const(&args[CAMERA_UP])) {
        complain(e, bound_node(call, CAMERA_UP, node), DIAG_OUT_OF_RANGE, "up is a direction: write (0, 1, 0)");
        return value_bad();
    }
    if (!automatic) {
        test_length(e, bound_node(call, CAMERA_EYE, node), &args[CAMERA_EYE], &args[CAMERA_LOOK_AT],
                    "the camera looks at where it stands: move eye or look_at");
    }
    test_length(e, bound_node(call, CAMERA_UP, node), &args[CAMERA_UP], NULL, "up is a direction: it is longer than 0");
    test_bounds(e, bound_node(call, CAMERA_FOV, node), args[CAMERA_FOV].scalar, 0, true, M_PI,
                "fov is between 0deg and 180deg");
    test_bounds(e, bound_node(call, CAMERA_HEIGHT, node), args[CAMERA_HEIGHT].scalar, 0, true, INFINITY,
                "a height is greater than 0");
    IrId ids[15];
    uint32_t count = 0;
    if (automatic) {
        for (int k = 0; k < 3; k++) ids[count++] = ir_const(e->ir, automatic_direction[k]);
    } else {
        count += push_ids(e, &args[CAMERA_EYE], ids);
    }
    count += push_ids(e, &args[CAMERA_LOOK_AT], ids + count);
    count += push_ids(e, &args[CAMERA_UP], ids + count);
    ids[count++] = scalar_id(e, args[CAMERA_FOV].scalar);
    ids[count++] = scalar_id(e, args[CAMERA_HEIGHT].scalar);
    ids[count++] = scalar_id(e, args[CAMERA_APERTURE].scalar);
    ids[count++] = given(call, CAMERA_FOCUS) ? scalar_id(e, args[CAMERA_FOCUS].scalar) : ir_const(e->ir, 0);
    ids[count++] = scalar_id(e, args[CAMERA_SHUTTER].scalar);
    ids[count++] = ir_const(e->ir, automatic);
    assert(count == 15 && "OP_CAMERA has fifteen operands");
    bool orthographic = !strcmp(args[CAMERA_PROJECTION].string, "orthographic");
    return value_node(TYPE_CAMERA, ir_node_index(e->ir, OP_CAMERA, span_of(e, node), ids, count, orthographic));
}

enum {
    LIGHT_DIRECTION,
    LIGHT_AT,
    LIGHT_COLOR,
    LIGHT_INTENSITY,
    LIGHT_CONE,
    LIGHT_SOFT,
    LIGHT_RADIUS,
    LIGHT_FADE,
    LIGHT_SHADOW
};

static Value eval_light(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Span span = span_of(e, node);
    bool direction = given(call, LIGHT_DIRECTION), at = given(call, LIGHT_AT);
    if (direction && zero_const(&args[LIGHT_DIRECTION])) {
        complain(e, bound_node(call, LIGHT_DIRECTION, node), DIAG_OUT_OF_RANGE, "a direction is longer than 0");
        return value_bad();
    }
    if (direction) {
        test_length(e, bound_node(call, LIGHT_DIRECTION, node), &args[LIGHT_DIRECTION], NULL,
                    "a direction is longer than 0");
    }
    test_bounds(e, bound_node(call, LIGHT_INTENSITY, node), args[LIGHT_INTENSITY].scalar, 0, false, INFINITY,
                "an intensity is at least 0");
    if (given(call, LIGHT_CONE)) {
        test_bounds(e, bound_node(call, LIGHT_CONE, node), args[LIGHT_CONE].scalar, 0, true, 2 * M_PI,
                    "a cone is between 0deg and 360deg");
    }
    test_bounds(e, bound_node(call, LIGHT_SOFT, node), args[LIGHT_SOFT].scalar, 0, false, INFINITY,
                "a soft rim is at least 0deg wide");
    test_bounds(e, bound_node(call, LIGHT_FADE, node), args[LIGHT_FADE].scalar, 0, false, INFINITY,
                "a fade is at least 0");
    IrId zero = ir_const(e->ir, 0), ids[14] = {zero, zero, zero, zero, zero, zero};
    if (direction) push_ids(e, &args[LIGHT_DIRECTION], ids);
    if (at) push_ids(e, &args[LIGHT_AT], ids + 3);
    for (int k = 0; k < 3; k++) {
        Scalar part = scalar_op2(e, OP_MUL, node, args[LIGHT_COLOR].vector[k], args[LIGHT_INTENSITY].scalar);
        ids[6 + k] = scalar_id(e, part);
    }
    ids[9] = given(call, LIGHT_CONE) ? scalar_id(e, args[LIGHT_CONE].scalar) : zero;
    ids[10] = scalar_id(e, args[LIGHT_SOFT].scalar);
    ids[11] = scalar_id(e, args[LIGHT_RADIUS].scalar);
    ids[12] = scalar_id(e, args[LIGHT_FADE].scalar);
    ids[13] = scalar_id(e, args[LIGHT_SHADOW].scalar);
    LightKind kind = !at ? LIGHT_DIRECTIONAL : direction ? LIGHT_SPOT : LIGHT_POINT;
    return value_node(TYPE_LIGHT, ir_node_index(e->ir, OP_LIGHT, span, ids, 14, kind));
}

static Value eval_material(Eval *e, const Node *node, const Call *call, const Value *args)
{
    enum { AMBIENT = 1, SHININESS = 4, PARTS = 9 };
    IrId ids[11];
    uint32_t count = push_ids(e, &args[0], ids);
    for (int i = 1; i < PARTS; i++) {
        if (i >= AMBIENT && i <= SHININESS) {
            const char *what = arena_printf(&e->scratch, "%s is at least 0", call->callee->parameters[i].name);
            test_bounds(e, bound_node(call, (uint32_t)i, node), args[i].scalar, 0, false, INFINITY, what);
        }
        ids[count++] = scalar_id(e, args[i].scalar);
    }
    assert(count == 11 && "OP_MATERIAL has eleven operands");
    return value_node(TYPE_MATERIAL, ir_node(e->ir, OP_MATERIAL, span_of(e, node), ids, count));
}

static Value eval_background(Eval *e, const Node *node, const Value *args)
{
    IrId ids[4];
    push_ids(e, &args[0], ids);
    ids[3] = scalar_id(e, args[2].scalar);
    return value_node(TYPE_BACKGROUND, ir_node(e->ir, OP_BACKGROUND, span_of(e, node), ids, 4));
}

// The rate comes first, since the duration may be said in frames.
static Value eval_animation(Eval *e, const Node *node, const Call *call, const Value *receiver)
{
    double fps, duration;
    Value rate =
        given(call, 1) ? eval_bound(e, node, call, 1, receiver) : builtin_default(e, &call->callee->parameters[1]);
    if (value_is_bad(&rate) || !want_const(e, bound_node(call, 1, node), rate.scalar, "the rate of an animation", &fps))
        return value_bad();
    if (!(fps > 0 && fps <= 1000)) {
        complain(e, bound_node(call, 1, node), DIAG_OUT_OF_RANGE, "fps is greater than 0 and at most 1000");
        return value_bad();
    }
    e->fps = fps;
    Value length =
        given(call, 0) ? eval_bound(e, node, call, 0, receiver) : builtin_default(e, &call->callee->parameters[0]);
    if (value_is_bad(&length)) return value_bad();
    if (!want_const(e, bound_node(call, 0, node), length.scalar, "the duration of an animation", &duration))
        return value_bad();
    if (!(duration >= 0 && duration <= 1e9)) {
        complain(e, bound_node(call, 0, node), DIAG_OUT_OF_RANGE, "a duration is at least 0s");
        return value_bad();
    }
    return value_vector(&e->scratch, type_of(TYPE_ANIMATION), (Scalar[2]){scalar_of(duration), scalar_of(fps)}, 2);
}

// --- what a scene has that says nothing of it

Value default_camera(Eval *e)
{
    double parts[15] = {automatic_direction[0],
                        automatic_direction[1],
                        automatic_direction[2],
                        0,
                        0,
                        0,
                        0,
                        1,
                        0,
                        40 * (M_PI / 180),
                        2,
                        0,
                        0,
                        0,
                        1};
    IrId ids[15];
    for (int k = 0; k < 15; k++) ids[k] = ir_const(e->ir, parts[k]);
    return value_node(TYPE_CAMERA, ir_node_index(e->ir, OP_CAMERA, (Span){0}, ids, 15, 0));
}

Value default_background(Eval *e)
{
    IrId gray = ir_const(e->ir, 0.05), ids[4] = {gray, gray, gray, ir_const(e->ir, 0)};
    return value_node(TYPE_BACKGROUND, ir_node(e->ir, OP_BACKGROUND, (Span){0}, ids, 4));
}

// A key from the upper left and a fill from the right, whose shadows would only confuse.
void default_lights(Eval *e, List *lights)
{
    static const struct {
        double direction[3], intensity, shadow;
    } two[] = {{{0.6, -1, -0.8}, 0.9, 1}, {{-0.9, -0.3, -0.4}, 0.3, 0}};
    for (int i = 0; i < 2; i++) {
        double parts[14] = {two[i].direction[0],
                            two[i].direction[1],
                            two[i].direction[2],
                            0,
                            0,
                            0,
                            two[i].intensity,
                            two[i].intensity,
                            two[i].intensity,
                            0,
                            0,
                            0,
                            0,
                            two[i].shadow};
        IrId ids[14];
        for (int k = 0; k < 14; k++) ids[k] = ir_const(e->ir, parts[k]);
        IrId light = ir_node_index(e->ir, OP_LIGHT, (Span){0}, ids, 14, LIGHT_DIRECTIONAL);
        values_add(e, lights, value_node(TYPE_LIGHT, light), NULL);
    }
}

// --- all of them

// A width that is known to be 0 is none.
static bool is_blended(const Call *call, const Value *args)
{
    enum { BLEND = 1, STYLE };
    if (call->callee->count <= STYLE || args[0].list.count < 2) return false;
    return args[BLEND].scalar.id || args[BLEND].scalar.number != 0 || strcmp(args[STYLE].string, "smooth") != 0;
}

Value eval_builtin(Eval *e, const Node *node, const Call *call, const Value *receiver)
{
    const Callable *callee = call->callee;
    if (callee->id == BUILTIN_FREEFORM || callee->id == BUILTIN_DEFORM) return eval_forming(e, node, call, receiver);
    if (callee->id == BUILTIN_ANIMATION) return eval_animation(e, node, call, receiver);
    assert(callee->count <= BUILTIN_PARAMETERS_MAX && "no built-in has more parameters");
    Value args[BUILTIN_PARAMETERS_MAX];
    for (uint32_t i = 0; i < callee->count; i++) {
        if (!given(call, (int)i)) {
            args[i] = arg_default(e, call, args, i);
            continue;
        }
        args[i] = callee->id == BUILTIN_PRESS && i == 0 ? eval_pressed_by(e, node, call, receiver)
                                                        : eval_bound(e, node, call, i, receiver);
        if (value_is_bad(&args[i])) return value_bad();
        const Parameter *p = &callee->parameters[i];
        if (p->choices) {
            int k = 0;
            while (p->choices[k] && strcmp(p->choices[k], args[i].string)) k++;
            if (p->choices[k]) continue;
            complain(e, bound_node(call, i, node), DIAG_UNKNOWN_CHOICE, "%s of %s is not \"%s\"", p->name, callee->name,
                     args[i].string);
            return value_bad();
        }
    }
    if (!test_rates(e, node, call, args)) return value_bad();
    switch (builtins[callee->id].kind) {
    case KIND_SET: return is_blended(call, args) ? eval_blend(e, node, call, args) : eval_set(e, node, call, &args[0]);
    case KIND_MODIFIER: return eval_modifier(e, node, call, args);
    case KIND_FUNCTION:
        if (callee->id == BUILTIN_KEYS) return eval_keys(e, node, call, args);
        if (callee->id == BUILTIN_MATCH) return eval_match(e, node, call, args);
        return eval_function(e, node, call, args);
    default: break;
    }
    switch (callee->id) {
    case BUILTIN_QUADRIC: return eval_quadric(e, node, args);
    case BUILTIN_MORPH: return eval_morph(e, node, call, args);
    case BUILTIN_FIELD: return eval_field(e, node, call, args);
    case BUILTIN_OFFSET:
    case BUILTIN_SHELL: return eval_operation(e, node, call, args);
    case BUILTIN_PERTURB: return eval_perturb(e, node, call, args);
    case BUILTIN_CAMERA: return eval_camera(e, node, call, args);
    case BUILTIN_LIGHT: return eval_light(e, node, call, args);
    case BUILTIN_SURFACE: return eval_surface(e, node, call, args);
    case BUILTIN_MEMBERSHIP: return eval_membership(e, node, call, args);
    case BUILTIN_MATERIAL: return eval_material(e, node, call, args);
    case BUILTIN_BACKGROUND: return eval_background(e, node, args);
    default: return eval_patch_thing(e, node, call, args);
    }
}
