// Expressions but calls. Chains to the left are walked by a loop, as in check_expr.c; a chain of set operations
// becomes one node of many operands, so `a | b | c | …` of any length is one union.
#include <assert.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "compiler/evaluator.h"

Span span_of(const Eval *e, const Node *node)
{
    return e->site.end ? e->site : node->span;
}

// --- scalars

IrId scalar_id(Eval *e, Scalar s)
{
    if (s.id) return s.id;
    return ir_const(e->ir, isnan(s.number) ? 0 : s.number); // a NaN was reported, so the IR is not used
}

static Scalar scalar_node(Eval *e, IrId id)
{
    double number;
    if (ir_is_const(e->ir, id, &number)) return scalar_of(number);
    return (Scalar){.id = id};
}

static Scalar folded(Eval *e, IrOp op, const Node *at, const double *args, int count)
{
    for (int k = 0; k < count; k++) {
        if (isnan(args[k])) return scalar_of(NAN);
    }
    double result = eval_scalar(op, args);
    if (isfinite(result)) return scalar_of(result);
    bool zero = (op == OP_DIV || op == OP_MOD) && args[1] == 0;
    const char *complaint = eval_complaint(op, args);
    complain(e, at, zero ? DIAG_DIVISION_BY_ZERO : DIAG_NOT_FINITE, "%s",
             zero ? "a division by zero has no value" : complaint);
    return scalar_of(NAN);
}

Scalar scalar_op1(Eval *e, IrOp op, const Node *at, Scalar a)
{
    if (!a.id) return folded(e, op, at, &a.number, 1);
    return scalar_node(e, ir_op1(e->ir, op, span_of(e, at), a.id));
}

Scalar scalar_op2(Eval *e, IrOp op, const Node *at, Scalar a, Scalar b)
{
    if (!a.id && !b.id) return folded(e, op, at, (double[2]){a.number, b.number}, 2);
    if (scalar_bad(a) || scalar_bad(b)) return scalar_of(NAN);
    return scalar_node(e, ir_op2(e->ir, op, span_of(e, at), scalar_id(e, a), scalar_id(e, b)));
}

Scalar scalar_select(Eval *e, const Node *at, Scalar condition, Scalar a, Scalar b)
{
    if (scalar_bad(condition)) return condition;
    if (!condition.id) return condition.number ? a : b;
    if (scalar_bad(a) || scalar_bad(b)) return scalar_of(NAN);
    if (!a.id && !b.id && a.number == b.number) return a;
    return scalar_node(e, ir_op3(e->ir, OP_SELECT, span_of(e, at), condition.id, scalar_id(e, a), scalar_id(e, b)));
}

Scalar unit_interval(Eval *e, const Node *at, Scalar s)
{
    return scalar_op2(e, OP_MIN, at, scalar_op2(e, OP_MAX, at, s, scalar_of(0)), scalar_of(1));
}

// --- leaves

static Value eval_number(const Eval *e, const Node *node)
{
    double n = node->number;
    switch (node->unit) {
    case UNIT_DEG: return value_scalar(type_number(1, 0), scalar_of(n * (M_PI / 180)));
    case UNIT_RAD: return value_scalar(type_number(1, 0), scalar_of(n));
    case UNIT_TURN: return value_scalar(type_number(1, 0), scalar_of(n * (2 * M_PI)));
    case UNIT_S: return value_scalar(type_number(0, 1), scalar_of(n));
    case UNIT_MS: return value_scalar(type_number(0, 1), scalar_of(n / 1000));
    case UNIT_F: return value_scalar(type_number(0, 1), scalar_of(n / e->fps));
    default: return value_scalar(type_of(node->flag ? TYPE_INT : TYPE_NUMBER), scalar_of(n));
    }
}

static Value eval_constant(Eval *e, const Node *node, const Symbol *symbol)
{
    IrOp op;
    switch (symbol->id) {
    case BUILTIN_PI: return value_scalar(symbol->type, scalar_of(M_PI));
    case BUILTIN_TIME: op = OP_TIME; break;
    case BUILTIN_FRAME: op = OP_FRAME; break;
    case BUILTIN_X: op = OP_X; break;
    case BUILTIN_Y: op = OP_Y; break;
    case BUILTIN_U: op = OP_U; break;
    case BUILTIN_V: op = OP_V; break;
    default:
        assert(symbol->id == BUILTIN_Z && "what is not there yet was reported by check()");
        op = OP_Z;
        break;
    }
    return value_scalar(symbol->type, (Scalar){.id = ir_node(e->ir, op, span_of(e, node), NULL, 0)});
}

static Value eval_name(Eval *e, const Node *node)
{
    Symbol *symbol = node->note;
    switch (symbol->kind) {
    case SYMBOL_CONSTANT: return eval_constant(e, node, symbol);
    case SYMBOL_LET:
    case SYMBOL_PARAM: return force(e, symbol);
    default: return e->slots[e->base + symbol->slot].value;
    }
}

static Value eval_color(Eval *e, const Node *node)
{
    Scalar parts[3];
    for (int k = 0; k < 3; k++) parts[k] = scalar_of(srgb_to_linear((node->color >> (16 - 8 * k) & 255) / 255.0));
    return value_vector(&e->scratch, type_of(TYPE_COLOR), parts, 3);
}

static Value eval_vector(Eval *e, const Node *node)
{
    Scalar parts[3];
    Type type = type_of(TYPE_ANY);
    int count = 0;
    for (const Node *part = node->a; part; part = part->next) {
        Value value = eval_expr(e, part);
        if (value_is_bad(&value)) return value_bad();
        // A literal 0 has the unit of the others.
        if (count == 0 || (type.angle == 0 && type.time == 0)) type = value.type;
        parts[count++] = value.scalar;
    }
    type.kind = count == 2 ? TYPE_VEC2 : TYPE_VEC3;
    type.zero = false;
    return value_vector(&e->scratch, type, parts, count);
}

static Value eval_list(Eval *e, const Node *node)
{
    List list = {0};
    for (const Node *item = node->a; item && !e->stop; item = item->next) {
        if (item->kind == NODE_FOR)
            eval_for(e, item, type_of(TYPE_ANY), &list);
        else
            values_add(e, &list, eval_expr(e, item), item);
    }
    // The elements of a list are of one type: [1, 2.5] are two scalars, [sphere(1), box(1)] two objects.
    Type type = list.count ? list.items[0].type : type_of(TYPE_ANY);
    for (uint32_t i = 0; i < list.count; i++) {
        Type joined;
        if (type_bad(list.items[i].type)) return value_bad();
        if (type_join(type, list.items[i].type, &joined))
            type = joined;
        else if (!type.angle && !type.time)
            type = list.items[i].type; // a literal 0 among others
    }
    for (uint32_t i = 0; i < list.count; i++) list.items[i] = value_convert(&e->scratch, list.items[i], type);
    return values_list(list, type);
}

static Value eval_string(Eval *e, const Node *node)
{
    const char *text = "";
    for (const Node *piece = node->a; piece; piece = piece->next) {
        const char *more = piece->text;
        if (piece->kind != NODE_TEXT) {
            Value value = eval_expr(e, piece);
            if (value_is_bad(&value)) return value_bad();
            if (value_varying(&value)) {
                report_rate(e, piece, DIAG_SHAPE_RATE, "what stands in a string");
                return value_bad();
            }
            more = value_text(&e->unit->arena, &value, 6);
        }
        text = *text ? arena_printf(&e->unit->arena, "%s%s", text, more) : more;
    }
    return value_string(text);
}

static Value eval_unary(Eval *e, const Node *node)
{
    Value value = eval_expr(e, node->a);
    if (value_is_bad(&value)) return value_bad();
    if (node->op == NODE_OP_COMPLEMENT)
        return value_node(TYPE_OBJECT, ir_op1(e->ir, OP_COMPLEMENT, span_of(e, node), value.id));
    IrOp op = node->op == NODE_OP_NOT ? OP_NOT : OP_NEG;
    if (value_size(value.type) == 1) {
        value.scalar = scalar_op1(e, op, node, value.scalar);
        return value;
    }
    Scalar parts[3];
    int size = value_size(value.type);
    for (int k = 0; k < size; k++) parts[k] = scalar_op1(e, op, node, value.vector[k]);
    return value_vector(&e->scratch, value.type, parts, size);
}

// --- operators

static Type sum_type(Type a, Type b)
{
    Type type = a;
    if (b.angle || b.time) { // a literal 0 may stand on the left
        type.angle = b.angle;
        type.time = b.time;
    }
    if (a.kind == TYPE_COLOR || b.kind == TYPE_COLOR)
        type.kind = TYPE_COLOR;
    else if (a.kind == TYPE_INT)
        type.kind = b.kind;
    type.zero = type.whole = false;
    return type;
}

static Value int_beyond(Eval *e, const Node *node)
{
    complain(e, node, DIAG_OUT_OF_RANGE,
             "this int is beyond 9007199254740992, where whole numbers are exact: use scalars");
    return value_bad();
}

Value checked_int(Eval *e, const Node *node, Value value)
{
    bool beyond = value.type.kind == TYPE_INT && !value.scalar.id && fabs(value.scalar.number) > 0x1p53;
    return beyond ? int_beyond(e, node) : value;
}

// Whether + - * of two ints leave ±2⁵³. Doubles would round 2⁵³ + 1 to 2⁵³, so this counts in integers.
static bool leaves_ints(IrOp op, double a, double b)
{
    if (isnan(a) || isnan(b)) return false; // was reported
    if (fabs(a) > 0x1p53 || fabs(b) > 0x1p53) return true;
    int64_t x = (int64_t)a, y = (int64_t)b, result = 0, limit = INT64_C(1) << 53;
    if (op == OP_MUL && __builtin_mul_overflow(x, y, &result)) return true;
    if (op == OP_ADD) result = x + y;
    if (op == OP_SUB) result = x - y;
    return result > limit || result < -limit;
}

// + - * / by parts; a number goes with each part of a vector or color.
static Value eval_arithmetic(Eval *e, const Node *node, IrOp op, const Value *a, const Value *b)
{
    Type type = sum_type(a->type, b->type);
    int sa = value_size(a->type), sb = value_size(b->type), size = sa > sb ? sa : sb;
    if (op == OP_MUL || op == OP_DIV) {
        int sign = op == OP_MUL ? 1 : -1;
        type.angle = (int8_t)(a->type.angle + sign * b->type.angle);
        type.time = (int8_t)(a->type.time + sign * b->type.time);
        if (size > 1 && type.kind != TYPE_COLOR)
            type.kind = sa > 1 ? a->type.kind : b->type.kind;
        else if (size == 1)
            type.kind = op == OP_MUL && a->type.kind == TYPE_INT && b->type.kind == TYPE_INT ? TYPE_INT : TYPE_NUMBER;
    } else if (size > 1 && type.kind != TYPE_COLOR) {
        type.kind = a->type.kind;
    }
    bool known = size == 1 && type.kind == TYPE_INT && !a->scalar.id && !b->scalar.id;
    if (known && leaves_ints(op, a->scalar.number, b->scalar.number)) return int_beyond(e, node);
    if (size == 1) return value_scalar(type, scalar_op2(e, op, node, a->scalar, b->scalar));
    Scalar parts[3];
    for (int k = 0; k < size; k++) {
        parts[k] = scalar_op2(e, op, node, sa == 1 ? a->scalar : a->vector[k], sb == 1 ? b->scalar : b->vector[k]);
    }
    return value_vector(&e->scratch, type, parts, size);
}

static Value eval_power(Eval *e, const Node *node, const Value *a, const Value *b)
{
    bool ints = a->type.kind == TYPE_INT && b->type.kind == TYPE_INT;
    Type type = type_of(TYPE_NUMBER);
    if (!b->scalar.id && (a->type.angle || a->type.time)) {
        type = type_number(a->type.angle * (int)b->scalar.number, a->type.time * (int)b->scalar.number);
    }
    if (ints && !b->scalar.id && b->scalar.number < 0) {
        const Node *exponent = node->b;
        while (exponent->kind == NODE_PAREN) exponent = exponent->a;
        if (exponent->kind != NODE_UNARY &&
            exponent->kind != NODE_NUMBER) { // a literal makes a scalar, which check() knows
            complain(e, node->b, DIAG_OUT_OF_RANGE,
                     "an int to the power of %.0f is no int: write the base with a point, as a scalar",
                     b->scalar.number);
            return value_bad();
        }
    } else if (ints) {
        type.kind = TYPE_INT;
    }
    return checked_int(e, node, value_scalar(type, scalar_op2(e, OP_POW, node, a->scalar, b->scalar)));
}

Value eval_equal(Eval *e, const Node *at, const Value *a, const Value *b)
{
    if (type_is(a->type, TYPE_STRING)) return value_bool(!strcmp(a->string, b->string));
    Scalar all = scalar_of(1);
    for (int k = 0; k < value_size(a->type); k++) {
        Scalar equal = scalar_op2(e, OP_EQ, at, value_part(a, k), value_part(b, k));
        all = k == 0 ? equal : scalar_op2(e, OP_AND, at, all, equal);
    }
    return value_scalar(type_of(TYPE_BOOL), all);
}

static Value eval_comparison(Eval *e, const Node *node, const Value *a, const Value *b)
{
    Type type = type_of(TYPE_BOOL);
    switch (node->op) {
    case NODE_OP_LT: return value_scalar(type, scalar_op2(e, OP_LT, node, a->scalar, b->scalar));
    case NODE_OP_LE: return value_scalar(type, scalar_op2(e, OP_LE, node, a->scalar, b->scalar));
    case NODE_OP_GT: return value_scalar(type, scalar_op2(e, OP_LT, node, b->scalar, a->scalar));
    case NODE_OP_GE: return value_scalar(type, scalar_op2(e, OP_LE, node, b->scalar, a->scalar));
    default: break;
    }
    Value equal = eval_equal(e, node, a, b);
    if (node->op == NODE_OP_NE) equal.scalar = scalar_op1(e, OP_NOT, node, equal.scalar);
    return equal;
}

// The right side is evaluated only where the left does not decide.
static Value eval_logic(Eval *e, const Node *node, const Value *a)
{
    bool and = node->op == NODE_OP_AND;
    if (!a->scalar.id) {
        if ((a->scalar.number != 0) != and) return *a;
        return eval_expr(e, node->b);
    }
    Scalar path = e->path;
    Scalar under = and? a->scalar : scalar_op1(e, OP_NOT, node, a->scalar);
    e->path = scalar_op2(e, OP_AND, node, path, under);
    Value b = eval_expr(e, node->b);
    e->path = path;
    if (value_is_bad(&b)) return value_bad();
    return value_scalar(type_of(TYPE_BOOL), scalar_op2(e, and? OP_AND : OP_OR, node, a->scalar, b.scalar));
}

static Value eval_binary(Eval *e, const Node *node, const Value *a)
{
    if (value_is_bad(a)) return value_bad();
    if (node->op == NODE_OP_AND || node->op == NODE_OP_OR) return eval_logic(e, node, a);
    Value b = eval_expr(e, node->b);
    if (value_is_bad(&b)) return value_bad();
    switch (node->op) {
    case NODE_OP_ADD: return eval_arithmetic(e, node, OP_ADD, a, &b);
    case NODE_OP_SUB: return eval_arithmetic(e, node, OP_SUB, a, &b);
    case NODE_OP_MUL: return eval_arithmetic(e, node, OP_MUL, a, &b);
    case NODE_OP_DIV: return eval_arithmetic(e, node, OP_DIV, a, &b);
    case NODE_OP_POW: return eval_power(e, node, a, &b);
    case NODE_OP_RANGE: {
        Type type = sum_type(a->type, b.type);
        type.kind = TYPE_RANGE;
        type.whole = a->type.kind == TYPE_INT && b.type.kind == TYPE_INT;
        return value_vector(&e->scratch, type, (Scalar[2]){a->scalar, b.scalar}, 2);
    }
    default: return eval_comparison(e, node, a, &b);
    }
}

// --- sets

static IrOp set_op(const Node *node, const Value *left)
{
    if (node->kind != NODE_BINARY || !type_is_field(left->type)) return OP_NONE;
    if (node->op == NODE_OP_UNION) return OP_UNION;
    return node->op == NODE_OP_INTERSECT || node->op == NODE_OP_SUB ? OP_INTERSECT : OP_NONE;
}

Value join_sets(Eval *e, const Node *at, IrOp op, const IrId *ids, uint32_t count)
{
    return value_node(TYPE_OBJECT, ir_node(e->ir, op, span_of(e, at), ids, count));
}

// Takes links from `*i` on as long as they are the same set operation.
static Value eval_set_chain(Eval *e, Node *const *link, int count, int *i, Value left, IrOp op)
{
    int end = *i;
    while (end < count && set_op(link[end], &left) == op) end++;
    uint32_t many = (uint32_t)(end - *i) + 1;
    IrId few[8], *ids = many <= 8 ? few : arena_array(&e->scratch, IrId, many);
    ids[0] = left.id;
    bool bad = false;
    const Node *last = link[end - 1];
    for (uint32_t k = 1; k < many; k++) {
        const Node *node = link[(*i)++];
        Value right = eval_expr(e, node->b);
        if (!count_item(e, node) || value_is_bad(&right)) {
            bad = true;
            continue;
        }
        ids[k] = node->op == NODE_OP_SUB ? ir_op1(e->ir, OP_COMPLEMENT, span_of(e, node->b), right.id) : right.id;
    }
    return bad ? value_bad() : join_sets(e, last, op, ids, many);
}

// --- members and elements

static Value eval_member(Eval *e, const Node *node, const Value *a)
{
    if (value_is_bad(a)) return value_bad();
    if (type_is(a->type, TYPE_PLACE)) return eval_place_member(e, node, a);
    if (type_is(a->type, TYPE_MEMBERSHIP)) return eval_membership_member(e, node, a);
    Type type = type_number(a->type.angle, a->type.time);
    int k;
    if (type_is(a->type, TYPE_RANGE)) {
        k = !strcmp(node->name, "high");
        if (a->type.whole) type.kind = TYPE_INT;
    } else {
        k = node->name[0] == 'x' || node->name[0] == 'r' ? 0 : node->name[0] == 'y' || node->name[0] == 'g' ? 1 : 2;
    }
    return value_scalar(type, value_part(a, k));
}

static Value eval_index(Eval *e, const Node *node, const Value *a)
{
    Value index = eval_expr(e, node->b);
    if (value_is_bad(a) || value_is_bad(&index)) return value_bad();
    uint32_t count = a->list.count;
    if (count == 0 || (!index.scalar.id && (index.scalar.number < 0 || index.scalar.number >= count))) {
        if (count) {
            complain(e, node->b, DIAG_INDEX_RANGE, "the list has %u element%s, numbered from 0 to %u", count,
                     count == 1 ? "" : "s", count - 1);
        } else {
            complain(e, node->b, DIAG_INDEX_RANGE, "the list is empty");
        }
        return value_bad();
    }
    if (!index.scalar.id) return a->list.items[(uint32_t)index.scalar.number];
    if (!type_is_numeric(a->list.items[0].type) && !type_is(a->list.items[0].type, TYPE_BOOL)) {
        report_rate(e, node->b, DIAG_SHAPE_RATE, "the index of a list of these");
        return value_bad();
    }
    // An index of frame rate is tested in each frame.
    Scalar low = scalar_op2(e, OP_LE, node, scalar_of(0), index.scalar),
           high = scalar_op2(e, OP_LT, node, index.scalar, scalar_of(count));
    add_assert(e, node->b, scalar_op2(e, OP_AND, node, low, high),
               arena_printf(&e->unit->arena, "index-range: the list has %u elements, numbered from 0", count));
    Value chosen = a->list.items[count - 1];
    for (uint32_t k = count - 1; k-- > 0;) {
        Scalar here = scalar_op2(e, OP_EQ, node, index.scalar, scalar_of(k));
        chosen = select_value(e, node, here, a->list.items[k], chosen);
    }
    return chosen;
}

// --- all of them

static Value eval_link(Eval *e, const Node *node, const Value *left)
{
    switch (node->kind) {
    case NODE_BINARY: return eval_binary(e, node, left);
    case NODE_CALL: return eval_call(e, node, left);
    case NODE_MEMBER: return node->note ? eval_name(e, node) : eval_member(e, node, left);
    default: return eval_index(e, node, left);
    }
}

static Value eval_links(Eval *e, Node *const *link, int count)
{
    Value value = link[0]->a && !names_a_library(link[0]->a) ? eval_expr(e, link[0]->a) : value_bad();
    for (int i = 0; i < count && !e->stop;) {
        IrOp op = set_op(link[i], &value);
        if (op) {
            value = eval_set_chain(e, link, count, &i, value, op);
        } else {
            const Node *node = link[i++];
            if (names_a_library(node)) continue; // it says where the call behind it is found
            bool alone = !node->a || (node->a->kind == NODE_NAME && names_a_library(node->a));
            value = node->kind == NODE_CALL && alone ? eval_call(e, node, NULL) : eval_link(e, node, &value);
        }
    }
    return value;
}

Value eval_expr(Eval *e, const Node *node)
{
    if (e->stop) return value_bad();
    switch (node->kind) {
    case NODE_NAME: return eval_name(e, node);
    case NODE_NUMBER: return eval_number(e, node);
    case NODE_PAREN: return eval_expr(e, node->a);
    case NODE_BINARY:
    case NODE_CALL:
    case NODE_MEMBER:
    case NODE_INDEX: {
        if (!node->a || !node_is_link(node->a)) {
            Node *one = (Node *)node;
            return eval_links(e, &one, 1);
        }
        int count;
        Node **link = node_spine(&e->scratch, (Node *)node, &count);
        return eval_links(e, link, count);
    }
    case NODE_COLOR: return eval_color(e, node);
    case NODE_BOOL: return value_bool(node->flag);
    case NODE_STRING: return eval_string(e, node);
    case NODE_VECTOR: return eval_vector(e, node);
    case NODE_LIST: return eval_list(e, node);
    case NODE_UNARY: return eval_unary(e, node);
    case NODE_BLOCK: return eval_block(e, node, type_of(TYPE_ANY));
    default:
        assert(node->kind == NODE_IF && "check() has been over the tree");
        return eval_if(e, node, type_of(TYPE_ANY));
    }
}
