#include "compiler/object.h"

#include "compiler/expression.h"
#include "compiler/leaf.h"
#include "compiler/passes.h"
#include "compiler/walk.h"

// --- the form that the walks want

// The passes rewrite what the root reaches, so the object is the root for as long as they run.
IrId object_leaves(Ir *ir, IrId object)
{
    static PassRun *const runs[] = {pass_polynomials, pass_transforms, pass_deformations};
    IrId root = ir->root, result = object;
    for (size_t k = 0; k < sizeof runs / sizeof *runs && result; k++) {
        Arena scratch = {0};
        ir->root = result;
        result = runs[k](ir, &scratch) ? ir->root : 0;
        arena_release(&scratch);
    }
    ir->root = root;
    return result;
}

IrId object_core_expression(Ir *ir, IrId core)
{
    if (leaf_is_base(ir, core)) return expression_of_base(ir, core);
    uint32_t count = ir_at(ir, core)->count;
    Arena scratch = {0};
    IrId *operands = arena_array(&scratch, IrId, count);
    for (uint32_t k = 0; k < count; k++) operands[k] = ir_operand(ir, core, k);
    IrId field = expression_perturbed(ir, operands, count);
    arena_release(&scratch);
    return ir_operand(ir, field, 0);
}

// --- F of all

static IrId folded(Walk *walk, IrId id, IrOp op)
{
    Ir *ir = walk->ir;
    Span span = ir_at(ir, id)->span;
    IrId result = walk_result(walk, ir_operand(ir, id, 0), 0);
    for (uint32_t k = 1; k < ir_at(ir, id)->count; k++) {
        IrId other = walk_result(walk, ir_operand(ir, id, k), 0);
        result = expression_decided(ir, op, span, result, other);
    }
    return result;
}

// (1 - t) F + t G, of which only the one counts where t is 0 or 1.
static IrId mixed(Walk *walk, IrId id)
{
    Ir *ir = walk->ir;
    Span span = ir_at(ir, id)->span;
    IrId a = walk_result(walk, ir_operand(ir, id, 0), 0), b = walk_result(walk, ir_operand(ir, id, 1), 0);
    return expression_mixed(ir, span, a, b, ir_operand(ir, id, 2));
}

static void down_to_cores(Walk *walk, IrId id, uint32_t context)
{
    if (!leaf_is_core(walk->ir, id)) walk_reach_operands(walk, id, context);
}

static IrId up_expression(Walk *walk, IrId id, uint32_t context)
{
    Ir *ir = walk->ir;
    Span span = ir_at(ir, id)->span;
    if (leaf_is_core(ir, id)) return object_core_expression(ir, id);
    IrId first = ir_at(ir, id)->op == OP_EMPTY ? 0 : walk_result(walk, ir_operand(ir, id, 0), context);
    switch ((IrOp)ir_at(ir, id)->op) {
    case OP_EMPTY: return ir_const(ir, OBJECT_NOWHERE);
    case OP_UNION: return folded(walk, id, OP_MAX);
    case OP_INTERSECT: return folded(walk, id, OP_MIN);
    case OP_COMPLEMENT: return ir_op1(ir, OP_NEG, span, first);
    case OP_SHOW: return ir_op3(ir, OP_SELECT, span, ir_operand(ir, id, 1), first, ir_const(ir, OBJECT_NOWHERE));
    case OP_MORPH: return mixed(walk, id);
    default: return first; // paint and names
    }
}

IrId object_expression(Ir *ir, IrId leaves)
{
    Arena scratch = {0};
    Walk walk = {.ir = ir, .scratch = &scratch};
    IrId result = walk_run(&walk, leaves, 0, down_to_cores, up_expression);
    arena_release(&scratch);
    return result;
}

// --- other expressions for the leaves: -F is changed as F is, by the opposite, so a context is whether that is meant

typedef struct Rewrite {
    ObjectChange *change;
    void *context;
} Rewrite;

static uint32_t below(const Ir *ir, IrId id, uint32_t context)
{
    return ir_at(ir, id)->op == OP_COMPLEMENT ? !context : context;
}

static void down_rewrite(Walk *walk, IrId id, uint32_t context)
{
    if (!leaf_is_core(walk->ir, id)) walk_reach_operands(walk, id, below(walk->ir, id, context));
}

static IrId up_rewrite(Walk *walk, IrId id, uint32_t context)
{
    Ir *ir = walk->ir;
    const Rewrite *r = walk->pass;
    if (!leaf_is_core(ir, id)) return walk_rebuild(walk, id, below(ir, id, context));
    IrId changed = r->change(r->context, ir, object_core_expression(ir, id), context != 0);
    return ir_op1(ir, OP_FIELD, ir_at(ir, id)->span, changed);
}

// --- what meets at right or other angles is one field: each part alone may be endless, what they have in common is not

typedef struct Merge {
    const Walk *expressions;
    const bool *marked; // by id: paint, a name, a condition or a morph is on it or on a part of it
} Merge;

static bool is_merged(const Merge *m, const Ir *ir, IrId id)
{
    IrOp op = ir_at(ir, id)->op;
    return (op == OP_INTERSECT || op == OP_COMPLEMENT) && !m->marked[id];
}

static void down_merge(Walk *walk, IrId id, uint32_t context)
{
    if (!leaf_is_core(walk->ir, id) && !is_merged(walk->pass, walk->ir, id)) walk_reach_operands(walk, id, context);
}

static IrId up_merge(Walk *walk, IrId id, uint32_t context)
{
    const Merge *m = walk->pass;
    if (leaf_is_core(walk->ir, id)) return id;
    if (!is_merged(m, walk->ir, id)) return walk_rebuild(walk, id, context);
    return ir_op1(walk->ir, OP_FIELD, ir_at(walk->ir, id)->span, walk_result(m->expressions, id, 0));
}

static bool *marked_parts(const Ir *ir, IrId leaves, Arena *scratch)
{
    bool *marked = arena_array(scratch, bool, leaves + 1);
    for (IrId id = 1; id <= leaves; id++) {
        if (ir_at(ir, id)->type != IR_FIELD || leaf_is_core(ir, id)) continue;
        IrOp op = ir_at(ir, id)->op;
        marked[id] = op == OP_PAINT || op == OP_NAMED || op == OP_SHOW || op == OP_MORPH || op == OP_EMPTY;
        for (uint32_t k = 0; k < ir_at(ir, id)->count; k++) {
            IrId operand = ir_operand(ir, id, k);
            if (ir_at(ir, operand)->type == IR_FIELD && marked[operand]) marked[id] = true;
        }
    }
    return marked;
}

static IrId merged(Ir *ir, IrId leaves)
{
    Arena scratch = {0};
    Walk expressions = {.ir = ir, .scratch = &scratch};
    Merge m = {&expressions, marked_parts(ir, leaves, &scratch)};
    IrId result = walk_run(&expressions, leaves, 0, down_to_cores, up_expression);
    Walk walk = {.ir = ir, .scratch = &scratch, .pass = &m};
    if (result) result = walk_run(&walk, leaves, 0, down_merge, up_merge);
    arena_release(&scratch);
    return result;
}

IrId object_changed(Ir *ir, IrId leaves, ObjectChange *change, void *context)
{
    Arena scratch = {0};
    Rewrite rewrite = {change, context};
    Walk walk = {.ir = ir, .scratch = &scratch, .pass = &rewrite};
    IrId result = walk_run(&walk, leaves, 0, down_rewrite, up_rewrite);
    arena_release(&scratch);
    return result ? merged(ir, result) : 0;
}

static IrId warp(void *coordinates, Ir *ir, IrId expression, bool negative)
{
    return expression_substitute(ir, expression, coordinates);
}

IrId object_warped(Ir *ir, IrId leaves, const IrId coordinates[3])
{
    IrId copy[3] = {coordinates[0], coordinates[1], coordinates[2]};
    return object_changed(ir, leaves, warp, copy);
}

static IrId plus_addend(void *addend, Ir *ir, IrId expression, bool negative)
{
    return ir_op2(ir, negative ? OP_SUB : OP_ADD, ir_at(ir, expression)->span, expression, *(const IrId *)addend);
}

// max(F, G) + c = max(F + c, G + c), and -F + c = -(F - c)
IrId object_plus(Ir *ir, IrId leaves, IrId addend)
{
    return object_changed(ir, leaves, plus_addend, &addend);
}

// --- what is in it

static bool has_any(const Ir *ir, IrId leaves, IrOp one, IrOp other)
{
    Arena scratch = {0};
    bool *reached = arena_array(&scratch, bool, leaves + 1), found = false;
    reached[leaves] = true;
    for (IrId id = leaves; id > 0 && !found; id--) {
        if (!reached[id]) continue;
        found = ir_at(ir, id)->op == one || ir_at(ir, id)->op == other;
        for (uint32_t k = 0; k < ir_at(ir, id)->count && !leaf_is_core(ir, id); k++) {
            if (ir_at(ir, ir_operand(ir, id, k))->type == IR_FIELD) reached[ir_operand(ir, id, k)] = true;
        }
    }
    arena_release(&scratch);
    return found;
}

bool object_has_marks(const Ir *ir, IrId leaves)
{
    return has_any(ir, leaves, OP_PAINT, OP_NAMED);
}

bool object_may_hide(const Ir *ir, IrId leaves)
{
    return has_any(ir, leaves, OP_SHOW, OP_EMPTY);
}

bool object_has_thick(const Ir *ir, IrId object)
{
    return has_any(ir, object, OP_THICKEN, OP_THICKEN);
}

bool object_is_patched(const Ir *ir, IrId object)
{
    Arena scratch = {0};
    bool *reached = arena_array(&scratch, bool, object + 1), found = false;
    reached[object] = true;
    for (IrId id = object; id > 0 && !found; id--) {
        if (!reached[id]) continue;
        IrOp op = (IrOp)ir_at(ir, id)->op;
        found = op == OP_SHEET || op == OP_THICKEN || op == OP_LIFT;
        for (uint32_t k = 0; k < ir_at(ir, id)->count; k++) {
            IrType type = (IrType)ir_at(ir, ir_operand(ir, id, k))->type;
            if (type == IR_FIELD || type == IR_PERTURBATION) reached[ir_operand(ir, id, k)] = true;
        }
    }
    arena_release(&scratch);
    return found;
}

// --- derivatives

typedef struct Slope {
    Ir *ir;
    Span span;
    IrId *by; // three for each node, 0: the derivative is 0
} Slope;

static IrId op2(Slope *s, IrOp op, IrId a, IrId b)
{
    return ir_op2(s->ir, op, s->span, a, b);
}

// Numbers in which 0 stands for the number 0.
static IrId times(Slope *s, IrId a, IrId b)
{
    return a && b ? op2(s, OP_MUL, a, b) : 0;
}

static IrId plus(Slope *s, IrId a, IrId b)
{
    return a && b ? op2(s, OP_ADD, a, b) : a ? a : b;
}

static IrId minus(Slope *s, IrId a)
{
    return a ? ir_op1(s->ir, OP_NEG, s->span, a) : 0;
}

static IrId number(Slope *s, double value)
{
    return ir_const(s->ir, value);
}

static IrId square(Slope *s, IrId a)
{
    return op2(s, OP_MUL, a, a);
}

// 1 / r, for an r that is not negative; large instead of infinite where r is 0, so that 0 / r is 0.
static IrId over(Slope *s, IrId r)
{
    return op2(s, OP_DIV, number(s, 1), op2(s, OP_MAX, r, number(s, 1e-18)));
}

// The derivative of the function by its one operand.
static IrId outer(Slope *s, IrOp op, IrId id, IrId a)
{
    Ir *ir = s->ir;
    switch (op) {
    case OP_NEG: return number(s, -1);
    case OP_ABS: return ir_op1(ir, OP_SIGN, s->span, a);
    case OP_SQRT: return times(s, number(s, 0.5), over(s, id));
    case OP_EXP: return id;
    case OP_LOG: return op2(s, OP_DIV, number(s, 1), a);
    case OP_SIN: return ir_op1(ir, OP_COS, s->span, a);
    case OP_COS: return minus(s, ir_op1(ir, OP_SIN, s->span, a));
    case OP_TAN: return plus(s, number(s, 1), square(s, id));
    case OP_ASIN:
    case OP_ACOS: {
        IrId root = ir_op1(ir, OP_SQRT, s->span, op2(s, OP_SUB, number(s, 1), square(s, a)));
        return op == OP_ASIN ? over(s, root) : minus(s, over(s, root));
    }
    case OP_ATAN: return op2(s, OP_DIV, number(s, 1), plus(s, number(s, 1), square(s, a)));
    default: return 0; // steps and conditions are level
    }
}

// a^b: a known exponent has the derivative b a^(b - 1), of any sign of a.
static void power(Slope *s, IrId id, IrId a, IrId b, IrId *by_a, IrId *by_b)
{
    double exponent;
    *by_b = 0;
    if (ir_is_const(s->ir, b, &exponent) && exponent == 0.5) {
        *by_a = times(s, number(s, 0.5), over(s, id));
        return;
    }
    *by_a = times(s, b, op2(s, OP_POW, a, op2(s, OP_SUB, b, number(s, 1))));
    if (ir_at(s->ir, b)->rate == RATE_POINT) *by_b = times(s, id, ir_op1(s->ir, OP_LOG, s->span, a));
}

// The derivatives by two operands; false where one of them is chosen.
static bool outer2(Slope *s, IrOp op, IrId id, IrId a, IrId b, IrId *by_a, IrId *by_b)
{
    *by_a = *by_b = 0;
    switch (op) {
    case OP_ADD:
    case OP_SUB:
        *by_a = number(s, 1);
        *by_b = number(s, op == OP_ADD ? 1 : -1);
        return true;
    case OP_MUL:
        *by_a = b;
        *by_b = a;
        return true;
    case OP_DIV:
        *by_a = op2(s, OP_DIV, number(s, 1), b);
        *by_b = minus(s, op2(s, OP_DIV, id, b));
        return true;
    case OP_MOD:
        *by_a = number(s, 1);
        *by_b = minus(s, ir_op1(s->ir, OP_FLOOR, s->span, op2(s, OP_DIV, a, b)));
        return true;
    case OP_ATAN2: {
        IrId r = plus(s, square(s, a), square(s, b));
        *by_a = op2(s, OP_DIV, b, r);
        *by_b = minus(s, op2(s, OP_DIV, a, r));
        return true;
    }
    case OP_POW: power(s, id, a, b, by_a, by_b); return true;
    default: return false;
    }
}

static IrId chosen(Slope *s, IrId condition, IrId a, IrId b)
{
    if (a == b) return a;
    IrId zero = number(s, 0);
    return ir_op3(s->ir, OP_SELECT, s->span, condition, a ? a : zero, b ? b : zero);
}

static void slope_of(Slope *s, IrId id)
{
    Ir *ir = s->ir;
    IrOp op = (IrOp)ir_at(ir, id)->op;
    uint32_t count = ir_at(ir, id)->count;
    IrId o[3] = {0}, by_a, by_b, r[3] = {0};
    for (uint32_t k = 0; k < count && k < 3; k++) o[k] = ir_operand(ir, id, k);
    if (op == OP_X || op == OP_Y || op == OP_Z) {
        r[op - OP_X] = number(s, 1);
    } else if (op == OP_SELECT) {
        for (int k = 0; k < 3; k++) r[k] = chosen(s, o[0], s->by[3 * o[1] + k], s->by[3 * o[2] + k]);
    } else if (op == OP_MAX || op == OP_MIN) {
        IrId first = op == OP_MAX ? op2(s, OP_LE, o[1], o[0]) : op2(s, OP_LE, o[0], o[1]);
        for (int k = 0; k < 3; k++) r[k] = chosen(s, first, s->by[3 * o[0] + k], s->by[3 * o[1] + k]);
    } else if (count == 1) {
        by_a = outer(s, op, id, o[0]);
        for (int k = 0; k < 3; k++) r[k] = times(s, by_a, s->by[3 * o[0] + k]);
    } else if (count == 2 && outer2(s, op, id, o[0], o[1], &by_a, &by_b)) {
        for (int k = 0; k < 3; k++)
            r[k] = plus(s, times(s, by_a, s->by[3 * o[0] + k]), times(s, by_b, s->by[3 * o[1] + k]));
    }
    for (int k = 0; k < 3; k++) s->by[3 * id + k] = r[k];
}

void expression_gradient(Ir *ir, IrId expression, IrId gradient[3])
{
    Arena scratch = {0};
    const bool *reached = expression_reached(ir, expression, &scratch);
    Slope s = {.ir = ir, .span = ir_at(ir, expression)->span};
    s.by = arena_array(&scratch, IrId, 3 * ((size_t)expression + 1));
    for (IrId id = 1; id <= expression; id++) {
        if (reached[id]) slope_of(&s, id);
    }
    for (int k = 0; k < 3; k++) {
        IrId by = s.by[3 * expression + k];
        gradient[k] = by ? by : ir_const(ir, 0);
    }
    arena_release(&scratch);
}
