// match, and walking the cases of a block.
//
// The cases of match are tested in the order of the text. As long as it is known whether they fit, only the value of
// the first that does is evaluated. From the first on that only the frame knows, each value is evaluated under the
// condition that it is the chosen one, and numbers are chosen in the frame.
#include <assert.h>
#include <string.h>

#include "compiler/evaluator.h"

// --- walking

struct Cases {
    EvalCase *each;
    void *whose;
};

void eval_case(Eval *e, const Node *item, const struct Cases *cases)
{
    cases->each(e, item, cases->whose);
}

void each_case(Eval *e, const Node *node, EvalCase *each, void *whose)
{
    struct Cases cases = {each, whose};
    List list = {.cases = &cases};
    eval_values(e, node->c, type_of(TYPE_ANY), &list, false);
}

// --- match

typedef struct Chosen { // a case that a frame may choose
    Scalar condition;
    Value value;
} Chosen;

typedef struct Match {
    const Node *node;
    Value driver;
    Type result;
    Chosen *chosen;
    uint32_t count, capacity;
    Scalar none; // none of the cases before fits
    Value known; // of the case that fits for certain where none before does
    bool settled, bad;
    const Node *rest; // of `default`
} Match;

static bool is_default(const Node *key)
{
    return key->kind == NODE_NAME && !strcmp(key->name, "default");
}

static Scalar fits(Eval *e, const Node *at, const Value *driver, const Value *key)
{
    if (!type_is(key->type, TYPE_RANGE)) return eval_equal(e, at, driver, key).scalar;
    Scalar above = scalar_op2(e, OP_LE, at, key->vector[0], driver->scalar);
    Scalar below = scalar_op2(e, OP_LT, at, driver->scalar, key->vector[1]); // without its end
    return scalar_op2(e, OP_AND, at, above, below);
}

// The value of a case, evaluated where `condition` holds.
static Value value_under(Eval *e, Match *m, const Node *node, Scalar condition)
{
    Scalar path = e->path;
    e->path = scalar_op2(e, OP_AND, node, path, condition);
    Value value = value_convert(&e->scratch, eval_expr(e, node), m->result);
    e->path = path;
    m->bad |= value_is_bad(&value);
    return value;
}

static void choose_case(Eval *e, const Node *item, Match *m, Scalar condition)
{
    Value value = value_under(e, m, item->b, scalar_op2(e, OP_AND, item, m->none, condition));
    if (!condition.id) {
        m->known = value;
        m->settled = true;
        return;
    }
    if (m->count == m->capacity) {
        uint32_t capacity = m->capacity ? 2 * m->capacity : 8;
        Chosen *chosen = arena_array(&e->scratch, Chosen, capacity);
        if (m->count) memcpy(chosen, m->chosen, m->count * sizeof *chosen);
        m->chosen = chosen;
        m->capacity = capacity;
    }
    m->chosen[m->count++] = (Chosen){condition, value};
    m->none = scalar_op2(e, OP_AND, item, m->none, scalar_op1(e, OP_NOT, item, condition));
}

static void test_case(Eval *e, const Node *item, void *match)
{
    Match *m = match;
    if (m->settled || m->bad) return;
    if (is_default(item->a)) {
        m->rest = item->b;
        return;
    }
    Value key = eval_expr(e, item->a);
    if (value_is_bad(&key)) {
        m->bad = true;
        return;
    }
    if (type_is(key.type, TYPE_STRING) && !strcmp(key.string, m->driver.string)) {
        choose_case(e, item, m, scalar_of(1));
    } else if (!type_is(key.type, TYPE_STRING)) {
        Scalar condition = fits(e, item->a, &m->driver, &key);
        Scalar size =
            type_is(key.type, TYPE_RANGE) ? scalar_op2(e, OP_SUB, item->a, key.vector[1], key.vector[0]) : scalar_of(1);
        if (!size.id && size.number <= 0)
            complain(e, item->a, DIAG_EMPTY_RANGE, "no number is in %s: a range goes up, and is without its end here",
                     value_text(&e->scratch, &key, 6));
        m->bad |= scalar_bad(condition);
        if (condition.id || condition.number != 0) choose_case(e, item, m, condition);
    }
}

// What is left where none of the cases fits for certain: default, or an error.
static void settle(Eval *e, Match *m)
{
    const Node *at = bound_node(m->node->note, 0, m->node);
    if (m->rest) {
        m->known = value_under(e, m, m->rest, m->none);
    } else if (!m->count) {
        complain(e, at, DIAG_NO_CASE, "no case fits %s: add it, or default: …;",
                 value_text(&e->scratch, &m->driver, 9));
        m->bad = true;
    } else { // one of the others does, or the frame stops
        add_assert(e, at, scalar_op1(e, OP_NOT, at, m->none), "no-case: no case of the match fits");
        m->known = m->chosen[--m->count].value;
    }
}

static bool can_choose(const Value *a, const Value *b)
{
    int size = value_size(a->type);
    return size > 0 && size == value_size(b->type) && a->type.kind != TYPE_ANIMATION;
}

Value eval_match(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Match m = {.node = node, .driver = args[0], .result = call->result, .none = scalar_of(1)};
    each_case(e, node, test_case, &m);
    if (!m.bad && !m.settled && !e->stop) settle(e, &m);
    if (m.bad || e->stop) return value_bad();
    Value value = m.known;
    for (uint32_t k = m.count; k-- > 0;) {
        if (!can_choose(&m.chosen[k].value, &value)) {
            const char *what = arena_printf(&e->scratch, "what chooses %s", type_phrase(&e->scratch, value.type));
            report_rate(e, bound_node(call, 0, node), DIAG_SHAPE_RATE, what);
            return value_bad();
        }
        value = select_value(e, node, m.chosen[k].condition, m.chosen[k].value, value);
    }
    return value;
}
