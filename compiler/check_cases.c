// The blocks of keys and match: cases `key: value easing;`, which may stand in `for` and `if` too.
//
// An easing is a call whose first argument is the fraction between two keys: `smooth` is smooth(t), `bezier(0.2, 0,
// 0.8, 1)` is bezier(t, 0.2, 0, 0.8, 1). It is checked, and evaluated, as the call with that argument before the dot.
#include <string.h>

#include "compiler/checker.h"

struct Cases {
    BuiltinId id; // BUILTIN_KEYS or BUILTIN_MATCH
    Type driver;
    Type value; // of the values so far, joined
    int count;
    const Node *rest; // the first `default`
    bool bad;
};

static const char *word(const Cases *k)
{
    return k->id == BUILTIN_KEYS ? "keys" : "match";
}

static bool is_default(const Node *key)
{
    return key->kind == NODE_NAME && !strcmp(key->name, "default");
}

// --- keys of cases

static void check_default(Checker *c, Cases *k, const Node *key)
{
    if (k->id == BUILTIN_KEYS) {
        diag(c->unit, key->span, DIAG_MISPLACED,
             "default is of match: before the first key and behind the last, keys holds what stands there");
        k->bad = true;
    } else if (k->rest) {
        Diag *d = diag(c->unit, key->span, DIAG_DUPLICATE_ARGUMENT, "a match has one default: remove one of them");
        diag_label(c->unit, d, k->rest->span, "the first");
        k->bad = true;
    } else {
        k->rest = key;
    }
}

// A case of match is a value to be equal to, or a range to be in.
static bool case_fits(Type have, Type driver)
{
    if (type_is(have, TYPE_RANGE)) return type_is_number(driver) && type_same_dimension(have, driver);
    Type joined;
    bool comparable = (type_is_numeric(have) && type_is_numeric(driver)) ||
                      (type_is(have, TYPE_BOOL) && type_is(driver, TYPE_BOOL)) ||
                      (type_is(have, TYPE_STRING) && type_is(driver, TYPE_STRING));
    return comparable && type_join(have, driver, &joined);
}

static void check_key(Checker *c, Cases *k, Node *key)
{
    if (is_default(key)) {
        check_default(c, k, key);
        return;
    }
    if (k->id == BUILTIN_MATCH && key->kind == NODE_NAME && !strcmp(key->name, "_") && !names_find(c, key->name)) {
        Diag *d = diag(c->unit, key->span, DIAG_UNKNOWN_NAME, "what holds where no case fits is written default: …;");
        diag_fix(c->unit, d, key->span, FIX_SURE, "default");
        k->bad = true;
        return;
    }
    Type have = check_expr(c, key);
    if (type_bad(have) || type_bad(k->driver)) return;
    if (k->id == BUILTIN_KEYS) {
        Type want = type_number(k->driver.angle, k->driver.time);
        want.zero = k->driver.zero;
        k->bad |= !expect(c, key, have, want, "each key");
    } else if (!case_fits(have, k->driver)) {
        bool unit = (type_is_number(have) || type_is(have, TYPE_RANGE)) && type_is_number(k->driver);
        Arena *arena = &c->unit->arena;
        diag(c->unit, key->span, unit ? DIAG_UNIT_MISMATCH : DIAG_TYPE_MISMATCH,
             "this match is of %s, and this case is %s: it would never fit", type_phrase(arena, k->driver),
             type_phrase(arena, have));
        k->bad = true;
    }
}

// --- values and easings

static bool can_be_keyed(Type type)
{
    return type_is_numeric(type) || type_is_field(type) || type_is(type, TYPE_BOOL) || type_is(type, TYPE_STRING) ||
           type_is(type, TYPE_MATERIAL);
}

static void join_value(Checker *c, Cases *k, const Node *node, Type have)
{
    if (type_bad(have)) {
        k->bad = true;
    } else if (k->id == BUILTIN_KEYS && !can_be_keyed(have)) {
        diag(c->unit, node->span, DIAG_TYPE_MISMATCH,
             "keys goes through numbers, vectors, colors, materials, objects, bools or strings, and this is %s",
             type_phrase(&c->unit->arena, have));
        k->bad = true;
    } else if (k->count == 0) {
        k->value = have;
    } else if (!k->bad && !type_join(k->value, have, &k->value)) {
        const char *first = type_phrase(&c->unit->arena, k->value), *this = type_phrase(&c->unit->arena, have);
        bool unit = type_is_number(k->value) && type_is_number(have);
        diag(c->unit, node->span, unit ? DIAG_UNIT_MISMATCH : DIAG_TYPE_MISMATCH,
             "the values of %s are alike: this is %s, the one before is %s", word(k), this, first);
        k->bad = true;
    }
    k->count++;
}

// An easing that nothing defines: the nearest, or where there are more.
static bool report_no_easing(Checker *c, const Node *item)
{
    static const char *const built_in[] = {"linear", "smooth", "hold", "bezier"};
    if (item->word || names_find(c, item->name) || lost_name(c->unit, item->name)) return false;
    const char *near = nearest_name(item->name, built_in, sizeof built_in / sizeof *built_in);
    if (near) {
        Diag *d = diag(c->unit, item->name_span, DIAG_UNKNOWN_NAME, "there is no easing %s: do you mean %s?",
                       item->name, near);
        diag_fix(c->unit, d, item->name_span, FIX_LIKELY, "%s", near);
    } else {
        diag(c->unit, item->name_span, DIAG_UNKNOWN_NAME,
             "there is no easing %s: linear, smooth, hold and bezier(x1, y1, x2, y2) are built in, and use easing; "
             "brings easing.sine_in and more",
             item->name);
    }
    lost_add(c->unit, item->name);
    return true;
}

static void check_easing(Checker *c, Cases *k, Node *item)
{
    if (!item->name) return;
    if (k->id == BUILTIN_MATCH) {
        diag(c->unit, item->name_span, DIAG_MISPLACED, "an easing stands in keys only: end the case with ; before %s",
             item->name);
        k->bad = true;
        return;
    }
    if (report_no_easing(c, item)) {
        k->bad = true;
        return;
    }
    Node *fraction = arena_new(&c->unit->tree_arena, Node), *call = arena_new(&c->unit->tree_arena, Node);
    *fraction = (Node){.kind = NODE_NUMBER, .span = item->name_span};
    *call = (Node){.kind = NODE_CALL,
                   .span = {item->name_span.begin, item->span.end},
                   .name_span = item->name_span,
                   .a = fraction,
                   .b = item->c,
                   .name = item->name,
                   .depth = item->depth};
    Symbol *symbol = NULL;
    if (item->word) { // of a library
        Span library = {item->name_span.begin, item->name_span.begin + (uint32_t)strlen(item->word)};
        call->name_span.begin = item->name_span.end - (uint32_t)strlen(item->name);
        symbol = modules_find_within(c, item->word, library, item->name, call->name_span);
    }
    Type scalar = type_number(0, 0), type = check_call(c, call, &scalar, symbol);
    if (type_bad(type)) {
        k->bad = true;
    } else if (!type_converts(type, type_number(0, 0))) {
        diag(c->unit, item->name_span, DIAG_TYPE_MISMATCH,
             "an easing gives a number, how far it is from the key before to this one, and %s gives %s", item->name,
             type_phrase(&c->unit->arena, type));
        k->bad = true;
    }
    item->note = call;
}

void check_case(Checker *c, Node *item, Cases *k)
{
    check_key(c, k, item->a);
    join_value(c, k, item->b, check_expr(c, item->b));
    check_easing(c, k, item);
}

void check_value_among_cases(Checker *c, Node *item, Cases *k)
{
    diag(c->unit, item->span, DIAG_MISPLACED, "in %s each value stands behind its key: write %s: …;", word(k),
         k->id == BUILTIN_KEYS ? "2s" : "default");
    check_expr(c, item->a);
    k->bad = true;
}

// --- the whole

static Type result_of(const Cases *k)
{
    Type type = k->value;
    type.zero = false;
    if (k->id == BUILTIN_KEYS && type.kind == TYPE_INT) type.kind = TYPE_NUMBER; // between two ints is no int
    if (k->id == BUILTIN_KEYS && type.kind == TYPE_QUADRIC) type.kind = TYPE_OBJECT;
    return type;
}

Type check_cases(Checker *c, const Node *node, const Call *call, Type driver)
{
    Cases cases = {.id = (BuiltinId)call->callee->id, .driver = driver};
    Values values = {.many = true, .what = call->callee->name, .cases = &cases};
    Node *block = node->c;
    if (block && block->kind == NODE_BLOCK) check_block(c, block, &values);
    bool broken = block && block->kind != NODE_BLOCK;
    if (cases.count == 0 && !cases.bad && !broken) {
        bool keys = cases.id == BUILTIN_KEYS;
        diag(c->unit, node->name_span, DIAG_VALUE_COUNT, "%s has no cases: write %s", call->callee->name,
             keys ? "keys(time) { 0s: …; 2s: …; }" : "match(v) { 1: …; default: …; }");
        cases.bad = true;
    }
    return cases.bad || broken || type_bad(driver) ? poison() : result_of(&cases);
}
