// Blocks: their values, loops, conditions, asserts and prints.
#include <assert.h>
#include <string.h>

#include "compiler/evaluator.h"

// --- lists

static void stop_at_items(Eval *e, const Node *at)
{
    complain(e, at, DIAG_TOO_MANY_ITEMS,
             "the scene has more than 10 million items: does a loop run further than meant?");
    e->stop = true;
}

bool count_item(Eval *e, const Node *at)
{
    if (e->stop) return false;
    if (++e->items <= ITEMS_MAX) return true;
    stop_at_items(e, at);
    return false;
}

void values_add(Eval *e, List *list, Value value, const Node *at)
{
    if (!count_item(e, at)) return;
    if (list->count == list->capacity) {
        uint32_t capacity = list->capacity ? list->capacity * 2 : 8;
        Value *items = arena_array(&e->scratch, Value, capacity);
        if (list->count) memcpy(items, list->items, list->count * sizeof *items);
        list->items = items;
        list->capacity = capacity;
    }
    list->items[list->count++] = value;
}

void values_splice(Eval *e, List *list, Value value, Type want, const Node *at)
{
    if (type_bad(value.type) || value.type.list <= want.list) {
        values_add(e, list, value_convert(&e->scratch, value, want), at);
        return;
    }
    for (uint32_t i = 0; i < value.list.count && !e->stop; i++) {
        values_add(e, list, value_convert(&e->scratch, value.list.items[i], want), at);
    }
}

Value values_list(List list, Type element)
{
    Value value = {.type = type_list(element)};
    value.list.items = list.items;
    value.list.count = list.count;
    return value;
}

// --- conditions

bool eval_condition(Eval *e, const Node *node, const char *what, bool *holds)
{
    Value value = eval_expr(e, node);
    double number;
    if (value_is_bad(&value) || !want_const(e, node, value.scalar, what, &number)) return false;
    *holds = number != 0;
    return true;
}

static bool selectable(const Value *a, const Value *b)
{
    int size = value_size(a->type);
    return size > 0 && size == value_size(b->type) && !type_is(a->type, TYPE_ANIMATION) &&
           !type_is(b->type, TYPE_ANIMATION);
}

Value select_value(Eval *e, const Node *at, Scalar condition, Value a, Value b)
{
    assert(selectable(&a, &b) && "only numbers are chosen in a frame");
    Type type = a.type;
    if (type.kind == TYPE_INT && b.type.kind == TYPE_NUMBER) type = b.type;
    if (b.type.kind == TYPE_COLOR ||
        (!type.angle && !type.time && !type_equal(type, b.type) && type.kind != TYPE_COLOR))
        type = b.type;
    type.whole = a.type.whole && b.type.whole;
    int size = value_size(type);
    if (size == 1) {
        if (a.type.kind == TYPE_NUMBER && b.type.kind == TYPE_INT) type = a.type;
        return value_scalar(type, scalar_select(e, at, condition, a.scalar, b.scalar));
    }
    Scalar parts[3];
    for (int k = 0; k < size; k++) parts[k] = scalar_select(e, at, condition, a.vector[k], b.vector[k]);
    return value_vector(&e->scratch, type, parts, size);
}

// Both branches of a condition that only the frame knows: numbers are chosen then, what shapes the scene cannot be.
static Value eval_both(Eval *e, const Node *node, Scalar condition, Type want)
{
    Scalar path = e->path;
    e->path = scalar_op2(e, OP_AND, node, path, condition);
    Value a = eval_block(e, node->b, want);
    e->path = scalar_op2(e, OP_AND, node, path, scalar_op1(e, OP_NOT, node, condition));
    Value b = node->c->kind == NODE_IF ? eval_if(e, node->c, want) : eval_block(e, node->c, want);
    e->path = path;
    if (value_is_bad(&a) || value_is_bad(&b)) return value_bad();
    if (selectable(&a, &b)) return select_value(e, node, condition, a, b);
    const char *what = arena_printf(&e->scratch, "a condition that chooses %s", type_phrase(&e->scratch, a.type));
    report_rate(e, node->a, DIAG_SHAPE_RATE, what);
    return value_bad();
}

Value eval_if(Eval *e, const Node *node, Type want)
{
    for (;; node = node->c) {
        Value condition = eval_expr(e, node->a);
        if (value_is_bad(&condition)) return value_bad();
        if (condition.scalar.id) return eval_both(e, node, condition.scalar, want);
        if (condition.scalar.number != 0) return eval_block(e, node->b, want);
        if (node->c->kind != NODE_IF) return eval_block(e, node->c, want);
    }
}

static void eval_if_item(Eval *e, const Node *node, Type want, List *list)
{
    for (; node; node = node->c) {
        if (node->kind != NODE_IF) {
            eval_values(e, node, want, list, false);
            return;
        }
        bool holds;
        if (!eval_condition(e, node->a, "a condition that decides which values a block has", &holds)) return;
        if (!holds) continue;
        eval_values(e, node->b, want, list, false);
        return;
    }
}

// --- loops

static void eval_turn(Eval *e, const Node *node, Value each, Type want, List *list)
{
    const Symbol *symbol = node->note;
    if (!count_item(e, node)) return;
    e->slots[e->base + symbol->slot] = (Slot){.value = each};
    const Loop loop = {node, &each, e->loop};
    e->loop = &loop;
    eval_values(e, node->b, want, list, false);
    e->loop = loop.outer;
}

void eval_for(Eval *e, const Node *node, Type want, List *list)
{
    Value over = eval_expr(e, node->a);
    if (value_is_bad(&over)) return;
    if (over.type.list) {
        for (uint32_t i = 0; i < over.list.count && !e->stop; i++) eval_turn(e, node, over.list.items[i], want, list);
        return;
    }
    double begin, end;
    if (!want_const(e, node->a, over.vector[0], "how often a for runs", &begin)) return;
    if (!want_const(e, node->a, over.vector[1], "how often a for runs", &end)) return;
    if (begin > end) {
        Diag *d =
            complain(e, node->a, DIAG_EMPTY_RANGE, "the range %.0f .. %.0f is empty: a for walks upward", begin, end);
        if (node->a->kind == NODE_BINARY) diag_fix(e->unit, d, node->a->span, FIX_GUESS, "%.0f .. %.0f", end, begin);
    }
    // Each turn counts, so what is too much is known before seconds and gigabytes went into the first ten million.
    if (!e->stop && end - begin > ITEMS_MAX - (double)e->items) {
        stop_at_items(e, node);
        return;
    }
    for (double i = begin; i < end && !e->stop; i++) eval_turn(e, node, value_int(i), want, list);
}

// --- asserts and prints

// True the second time: a loop may assert the same of the same value many times.
static bool is_asserted(Eval *e, IrId condition)
{
    if (condition >= e->asserted_capacity) {
        uint32_t capacity = (condition + 1) * 2;
        bool *larger = arena_array(&e->scratch, bool, capacity);
        if (e->asserted_capacity) memcpy(larger, e->asserted, e->asserted_capacity * sizeof *larger);
        e->asserted = larger;
        e->asserted_capacity = capacity;
    }
    bool before = e->asserted[condition];
    e->asserted[condition] = true;
    return before;
}

void add_assert(Eval *e, const Node *at, Scalar holds, const char *text)
{
    Ir *ir = e->ir;
    if (e->trying) return;
    holds = scalar_op2(e, OP_OR, at, scalar_op1(e, OP_NOT, at, e->path), holds);
    if (!holds.id || is_asserted(e, holds.id)) return;
    if (ir->assert_count == e->assert_capacity) {
        e->assert_capacity = e->assert_capacity ? e->assert_capacity * 2 : 16;
        IrId *asserts = arena_array(ir->arena, IrId, e->assert_capacity);
        if (ir->assert_count) memcpy(asserts, ir->asserts, ir->assert_count * sizeof *asserts);
        ir->asserts = asserts;
    }
    const Node *place = blame(e, at);
    ir->asserts[ir->assert_count++] = ir_node_text(ir, OP_ASSERT, place->span, &holds.id, 1, text);
}

static const Node *comparison(const Node *node)
{
    while (node->kind == NODE_PAREN) node = node->a;
    return node->kind == NODE_BINARY && node->op >= NODE_OP_EQ && node->op <= NODE_OP_GE ? node : NULL;
}

// Of what is joined by `and` the first part that does not hold.
static Node *part_that_fails(Eval *e, Node *condition)
{
    for (;;) {
        while (condition->kind == NODE_PAREN) condition = condition->a;
        if (condition->kind != NODE_BINARY || condition->op != NODE_OP_AND) return condition;
        Value first = eval_expr(e, condition->a);
        bool holds = !value_is_bad(&first) && first.scalar.number != 0;
        condition = holds ? condition->b : condition->a;
    }
}

// The sides of a comparison that does not hold, for the message.
static const char *assert_sides(Eval *e, const Node *condition)
{
    const Node *node = comparison(condition);
    if (!node) return "";
    Value a = eval_expr(e, node->a), b = eval_expr(e, node->b);
    if (value_is_bad(&a) || value_is_bad(&b)) return "";
    int digits = 9;
    if (!strcmp(value_text(&e->scratch, &a, digits), value_text(&e->scratch, &b, digits))) digits = 17; // 0.1 + 0.2
    // "a radius is greater than 0" needs only to hear what it is instead.
    if (e->site.end && node->b->kind == NODE_NUMBER)
        return arena_printf(&e->scratch, ", and this is %s", value_text(&e->scratch, &a, 9));
    return arena_printf(&e->scratch, " (%s %s %s)", value_text(&e->scratch, &a, digits), node_op_text((NodeOp)node->op),
                        value_text(&e->scratch, &b, digits));
}

static const char *assert_message(Eval *e, const Node *node)
{
    if (!node->b) return NULL;
    Value message = eval_expr(e, node->b);
    return value_is_bad(&message) ? NULL : message.string;
}

// False if an assert of the prelude fails, behind which the arguments make no sense.
static bool eval_assert(Eval *e, const Node *node)
{
    Value condition = eval_expr(e, node->a);
    if (value_is_bad(&condition)) return true;
    bool prelude = e->site.end != 0;
    if (condition.scalar.id) {
        if (at_point(e, condition.scalar)) {
            report_rate(e, node->a, DIAG_POINT_RATE, prelude ? "this argument" : "what is asserted");
            return !prelude;
        }
        const char *message = assert_message(e, node);
        add_assert(e, node->a, condition.scalar, message ? message : "an assert does not hold");
        return true;
    }
    if (condition.scalar.number != 0) return true;
    const char *message = assert_message(e, node);
    if (prelude) { // an assert of the prelude says what an argument may be
        complain(e, node->a, DIAG_OUT_OF_RANGE, "%s%s", message ? message : "this is out of range",
                 assert_sides(e, node->a));
    } else if (e->path.id) { // it fails in the frames that come here
        add_assert(e, node->a, scalar_of(0), message ? message : "an assert does not hold");
    } else {
        Node *part = part_that_fails(e, node->a);
        complain(e, part, DIAG_ASSERT_FAILED, "%s%s", message ? message : "this does not hold", assert_sides(e, part));
    }
    return !prelude;
}

static void eval_print(Eval *e, const Node *node)
{
    const char *line = "";
    for (const Node *part = node->a; part; part = part->next) {
        Value value = eval_expr(e, part);
        if (value_is_bad(&value)) return;
        if (value_varying(&value)) {
            report_rate(e, part, DIAG_SHAPE_RATE, "what is printed");
            return;
        }
        const char *text = value_text(&e->scratch, &value, 6);
        line = part == node->a ? text : arena_printf(&e->scratch, "%s %s", line, text);
    }
    if (e->trying) return;
    Print *print = arena_new(&e->scratch, Print);
    *print = (Print){.order = e->order, .text = line};
    *e->prints_end = print;
    e->prints_end = &print->next;
}

// --- items

static void open_let(Eval *e, const Node *item)
{
    const Symbol *symbol = item->note;
    e->slots[e->base + symbol->slot] = (Slot){.pending = true, .forming = e->forming};
}

void open_lets(Eval *e, const Node *block)
{
    for (const Node *item = block->a; item; item = item->next) {
        if (item->kind == NODE_LET || item->kind == NODE_DECLARE) open_let(e, item);
    }
}

bool eval_item(Eval *e, const Node *item, Type want, List *list)
{
    switch (item->kind) {
    case NODE_VALUE:
        if (item->a->kind == NODE_IF)
            eval_if_item(e, item->a, want, list);
        else
            values_splice(e, list, eval_expr(e, item->a), want, item);
        break;
    case NODE_FOR: eval_for(e, item, want, list); break;
    case NODE_ASSERT: return eval_assert(e, item);
    case NODE_PRINT: eval_print(e, item); break;
    case NODE_ENTRY:
        if (list && list->cases) eval_case(e, item, list->cases);
        break;
    default: break;
    }
    return true;
}

void eval_values(Eval *e, const Node *block, Type want, List *list, bool opened)
{
    bool good = true;
    for (const Node *item = block->a; item && good && !e->stop; item = item->next) {
        bool let = item->kind == NODE_LET || item->kind == NODE_DECLARE;
        if (let && !opened)
            open_let(e, item);
        else if (!let)
            good = eval_item(e, item, want, list);
    }
    if (!good) values_add(e, list, value_bad(), block);
}

Value eval_block(Eval *e, const Node *block, Type want)
{
    Value value = value_bad();
    for (const Node *item = block->a; item && !e->stop; item = item->next) {
        if (item->kind == NODE_LET || item->kind == NODE_DECLARE) {
            open_let(e, item);
        } else if (item->kind == NODE_VALUE) {
            value = item->a->kind == NODE_IF ? eval_if(e, item->a, want) : eval_expr(e, item->a);
            value = value_convert(&e->scratch, value, want);
        } else if (!eval_item(e, item, want, NULL)) { // asserts and prints
            return value_bad();
        }
    }
    return value;
}
