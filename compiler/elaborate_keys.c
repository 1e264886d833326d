// keys: a value that goes through others as a driver grows (lang/reference.md, section 8.10).
//
// The cases are walked twice: for the keys, since where the driver stands in a loop depends on the last of them, and
// then for the values and how far the driver is between each and the one before, eased. What comes out is written in
// operations of the IR: a chain of choices from the last key back, each between the value after a key and the mix
// before it. So a key at a time costs one comparison, and no number of keys ever builds a kernel.
//
// At a key the value is the one that is written there, bit for bit, where the easing gives 0 at 0: a (1 - 0) + b 0 = a.
#include <assert.h>
#include <string.h>

#include "compiler/evaluator.h"

typedef struct Key {
    const Node *node;
    Scalar at, eased; // eased: from the key before, 0, to this, 1
    Value value;
} Key;

typedef struct Keys {
    const Node *node;
    const Call *call;
    Scalar driver;
    Key *keys;
    uint32_t count, capacity, next; // next: of the second walk
    bool bad;
} Keys;

// --- the keys

static void test_order(Eval *e, Keys *k, const Key *key, const Key *before)
{
    Scalar rises = scalar_op2(e, OP_LT, key->node, before->at, key->at);
    if (rises.id) {
        add_assert(e, key->node, rises, "keys-order: each key is greater than the one before");
    } else if (rises.number == 0) {
        Diag *d = complain(e, key->node, DIAG_KEYS_ORDER, "each key is greater than the one before");
        diag_label(e->unit, d, before->node->span, "the one before");
        k->bad = true;
    }
}

static void take_key(Eval *e, const Node *item, void *keys)
{
    Keys *k = keys;
    Value at = eval_expr(e, item->a);
    if (k->bad || value_is_bad(&at)) {
        k->bad = true;
        return;
    }
    if (!count_item(e, item)) return;
    if (k->count == k->capacity) {
        uint32_t capacity = k->capacity ? 2 * k->capacity : 8;
        Key *larger = arena_array(&e->scratch, Key, capacity);
        if (k->count) memcpy(larger, k->keys, k->count * sizeof *larger);
        k->keys = larger;
        k->capacity = capacity;
    }
    Key *key = &k->keys[k->count++];
    *key = (Key){.node = item->a, .at = at.scalar};
    if (k->count > 1) test_order(e, k, key, key - 1);
}

// Where the driver stands between the first key and the last.
static Scalar folded_driver(Eval *e, const Keys *k, Scalar driver, const char *after)
{
    const Node *at = k->node;
    if (!strcmp(after, "hold") || k->count < 2) return driver;
    Scalar first = k->keys[0].at, length = scalar_op2(e, OP_SUB, at, k->keys[k->count - 1].at, first);
    Scalar since = scalar_op2(e, OP_SUB, at, driver, first);
    if (!strcmp(after, "loop")) return scalar_op2(e, OP_ADD, at, first, scalar_op2(e, OP_MOD, at, since, length));
    // There and back: as far from the last key as the driver is from it, modulo twice the way.
    Scalar turn = scalar_op2(e, OP_MOD, at, since, scalar_op2(e, OP_MUL, at, scalar_of(2), length));
    Scalar rest = scalar_op1(e, OP_ABS, at, scalar_op2(e, OP_SUB, at, length, turn));
    return scalar_op2(e, OP_ADD, at, first, scalar_op2(e, OP_SUB, at, length, rest));
}

// --- the values

static Scalar eased(Eval *e, const Keys *k, const Node *item, const Key *key)
{
    Scalar way = scalar_op2(e, OP_SUB, item->a, key->at, key[-1].at);
    Scalar gone = scalar_op2(e, OP_SUB, item->a, k->driver, key[-1].at);
    Scalar t = unit_interval(e, item->a, scalar_op2(e, OP_DIV, item->a, gone, way));
    if (!item->note) return t;
    Value fraction = value_scalar(type_number(0, 0), t);
    Value value = eval_call(e, item->note, &fraction);
    return value_is_bad(&value) ? scalar_of(NAN) : value.scalar;
}

static void take_value(Eval *e, const Node *item, void *keys)
{
    Keys *k = keys;
    if (k->next == k->count) return; // a loop gave other cases than before, which was reported
    Key *key = &k->keys[k->next++];
    key->value = value_convert(&e->scratch, eval_expr(e, item->b), k->call->result);
    if (k->next > 1) key->eased = eased(e, k, item, key);
    k->bad |= value_is_bad(&key->value) || scalar_bad(key->eased);
}

// a (1 - t) + b t
static Scalar mixed(Eval *e, const Node *at, Scalar a, Scalar b, Scalar t)
{
    if (!a.id && !b.id && a.number == b.number) return a;
    Scalar rest = scalar_op2(e, OP_SUB, at, scalar_of(1), t);
    return scalar_op2(e, OP_ADD, at, scalar_op2(e, OP_MUL, at, a, rest), scalar_op2(e, OP_MUL, at, b, t));
}

typedef Scalar Part(const Eval *e, const Value *value, int k);

static Scalar number_part(const Eval *e, const Value *value, int k)
{
    (void)e;
    return value_part(value, k);
}

static Scalar material_part(const Eval *e, const Value *value, int k)
{
    double number;
    IrId id = ir_operand(e->ir, value->id, (uint32_t)k);
    return ir_is_const(e->ir, id, &number) ? scalar_of(number) : (Scalar){.id = id};
}

// One of the numbers that a value is made of. `held`: bools do not mix.
static Scalar keyed_part(Eval *e, const Keys *k, Part *part, int index, bool held)
{
    const Node *at = k->node;
    Scalar value = part(e, &k->keys[k->count - 1].value, index);
    for (uint32_t i = k->count - 1; i > 0; i--) {
        Scalar from = part(e, &k->keys[i - 1].value, index), to = part(e, &k->keys[i].value, index);
        Scalar before = held ? from : mixed(e, at, from, to, k->keys[i].eased);
        value = scalar_select(e, at, scalar_op2(e, OP_LT, at, k->driver, k->keys[i].at), before, value);
    }
    if (k->count < 2 || held) return value;
    // Before the first key it holds, whatever an easing gives at 0.
    Scalar first = part(e, &k->keys[0].value, index);
    return scalar_select(e, at, scalar_op2(e, OP_LT, at, k->driver, k->keys[0].at), first, value);
}

static Value keyed_numbers(Eval *e, const Keys *k)
{
    Type type = k->call->result;
    int size = value_size(type);
    bool held = type_is(type, TYPE_BOOL);
    Scalar parts[3];
    for (int i = 0; i < size; i++) parts[i] = keyed_part(e, k, number_part, i, held);
    return size == 1 ? value_scalar(type, parts[0]) : value_vector(&e->scratch, type, parts, size);
}

static Value keyed_material(Eval *e, const Keys *k)
{
    enum { PARTS = 11 };
    IrId ids[PARTS];
    for (int i = 0; i < PARTS; i++) ids[i] = scalar_id(e, keyed_part(e, k, material_part, i, false));
    return value_node(TYPE_MATERIAL, ir_node(e->ir, OP_MATERIAL, span_of(e, k->node), ids, PARTS));
}

// A union of morphs, of which one is shown. The first and the last hold outside, since their weights do.
static Value keyed_object(Eval *e, const Keys *k)
{
    const Node *at = k->node;
    if (k->count == 1) return k->keys[0].value;
    IrId *ids = arena_array(&e->scratch, IrId, k->count);
    uint32_t count = 0;
    for (uint32_t i = 1; i < k->count; i++) {
        Scalar shown = i + 1 < k->count ? scalar_op2(e, OP_LT, at, k->driver, k->keys[i].at) : scalar_of(1);
        if (i > 1) {
            Scalar begun = scalar_op2(e, OP_LE, at, k->keys[i - 1].at, k->driver);
            shown = scalar_op2(e, OP_AND, at, begun, shown);
        }
        if (!shown.id && shown.number == 0) continue;
        Scalar t = unit_interval(e, k->keys[i].node, k->keys[i].eased);
        IrId id = morph_objects(e, k->keys[i].node, k->keys[i - 1].value.id, k->keys[i].value.id, t);
        if (!id) return value_bad();
        ids[count++] = shown.id ? ir_op2(e->ir, OP_SHOW, span_of(e, at), id, shown.id) : id;
    }
    return join_sets(e, at, OP_UNION, ids, count);
}

static Value held_string(Eval *e, const Keys *k)
{
    double driver, at;
    const Node *node = bound_node(k->call, 0, k->node);
    if (!want_const(e, node, k->driver, "what chooses a string", &driver)) return value_bad();
    uint32_t i = 0;
    while (i + 1 < k->count) {
        const Key *next = &k->keys[i + 1];
        if (!want_const(e, next->node, next->at, "what chooses a string", &at)) return value_bad();
        if (driver < at) break;
        i++;
    }
    return k->keys[i].value;
}

Value eval_keys(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Keys k = {.node = node, .call = call, .driver = args[0].scalar};
    each_case(e, node, take_key, &k);
    if (k.bad || e->stop) return value_bad();
    if (!k.count) {
        complain(e, node, DIAG_VALUE_COUNT, "keys wants at least one key, and its loops give none");
        return value_bad();
    }
    k.driver = folded_driver(e, &k, k.driver, args[1].string);
    if (scalar_bad(k.driver)) return value_bad();
    each_case(e, node, take_value, &k);
    if (k.bad || e->stop) return value_bad();
    if (type_is(call->result, TYPE_STRING)) return held_string(e, &k);
    if (type_is(call->result, TYPE_MATERIAL)) return keyed_material(e, &k);
    if (type_is(call->result, TYPE_OBJECT) && at_point(e, k.driver)) {
        complain(e, bound_node(call, 0, node), DIAG_NOT_YET,
                 "keys of objects whose driver differs from point to point are not there yet in this version of scn: "
                 "write morph(a, b, weight)");
        return value_bad();
    }
    if (type_is(call->result, TYPE_OBJECT)) return keyed_object(e, &k);
    return keyed_numbers(e, &k);
}
