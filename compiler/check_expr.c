// Expressions but calls: the type of each, and what is said where two do not fit.
//
// Chains that grow to the left may have any number of links (lang/ast.h), so they are walked by a loop: check_expr()
// takes the innermost left and lets each link make a type of it. Everything else recurses, which the tree's depth
// limit allows.
#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/checker.h"

Type poison(void)
{
    return type_of(TYPE_ERROR);
}

static const Node *bare(const Node *node) // without parentheses
{
    while (node->kind == NODE_PAREN) node = node->a;
    return node;
}

// --- conversions and their messages

static void report_angle(Checker *c, const Node *node, const char *what)
{
    const Node *n = bare(node);
    bool negative = n->kind == NODE_UNARY && n->op == NODE_OP_NEG;
    if (negative) n = bare(n->a);
    if (n->kind != NODE_NUMBER) {
        diag(c->unit, node->span, DIAG_ANGLE_UNIT,
             "%s is an angle, and this is a plain number: multiply it by 1deg or 1rad", what);
        return;
    }
    const char *text = arena_printf(&c->unit->arena, "%s%.12gdeg", negative ? "-" : "", n->number);
    Diag *d = diag(c->unit, node->span, DIAG_ANGLE_UNIT, "%s is an angle and needs a unit: write %s, or %s%.12grad",
                   what, text, negative ? "-" : "", n->number);
    diag_fix(c->unit, d, node->span, FIX_LIKELY, "%s", text);
}

// A dimension that is not the wanted one, in numbers, vectors and ranges alike.
static void report_unit(Checker *c, const Node *node, Type have, Type want, const char *what)
{
    Arena *arena = &c->unit->arena;
    const Node *n = bare(node);
    bool plain = !want.angle && !want.time;
    if (n->kind == NODE_NUMBER && n->unit == UNIT_F && plain) {
        Diag *d =
            diag(c->unit, node->span, DIAG_UNIT_MISMATCH, "%gf is a time of %g frames: %s is a plain number, write %g",
                 n->number, n->number, what, n->number);
        diag_fix(c->unit, d, node->span, FIX_LIKELY, "%.12g", n->number);
    } else if (n->kind == NODE_NUMBER && n->unit == UNIT_NONE && type_equal(want, type_number(0, 1))) {
        Diag *d = diag(c->unit, node->span, DIAG_UNIT_MISMATCH, "%s is a time and needs a unit: write %.12gs", what,
                       n->number);
        diag_fix(c->unit, d, node->span, FIX_LIKELY, "%.12gs", n->number);
    } else if (type_equal(want, type_number(1, 0)) && type_equal(have, type_number(0, 1))) {
        diag(c->unit, node->span, DIAG_UNIT_MISMATCH,
             "%s is an angle, and this is a time: multiply it by an angle a second, 360deg / 1s", what);
    } else if (have.time == want.time + 1 && have.angle == want.angle && !plain) {
        diag(c->unit, node->span, DIAG_UNIT_MISMATCH,
             "%s is %s, and this has a time in it: write (time / 1s) for the time", what, type_phrase(arena, want));
    } else if (plain && type_equal(have, type_number(1, 0))) {
        diag(c->unit, node->span, DIAG_UNIT_MISMATCH,
             "%s is a plain number, and this is an angle: divide it by 1rad or 1deg", what);
    } else if (plain && type_equal(have, type_number(0, 1))) {
        diag(c->unit, node->span, DIAG_UNIT_MISMATCH, "%s is a plain number, and this is a time: divide it by 1s",
             what);
    } else {
        bool time = plain && have.time == 1 && !have.angle, angle = plain && have.angle == 1 && !have.time;
        diag(c->unit, node->span, DIAG_UNIT_MISMATCH, "%s is %s, and this is %s%s", what, type_phrase(arena, want),
             type_phrase(arena, have),
             time    ? ": divide it by 1s"
             : angle ? ": divide it by 1rad or 1deg"
                     : "");
    }
}

static bool is_quoted_number(const Node *node)
{
    if (node->kind != NODE_STRING || !node->a || node->a->kind != NODE_TEXT || node->a->next) return false;
    char *end;
    strtod(node->a->text, &end);
    return end != node->a->text && !*end;
}

// What to write instead of a value of another kind, where people are known to mistake one for the other; "" if nothing is known.
static const char *kind_hint(const Node *node, Type have, Type want)
{
    bool single = !have.list && !want.list;
    if (single && have.kind == TYPE_STRING && (want.kind == TYPE_MATERIAL || want.kind == TYPE_COLOR))
        return ": write a colour such as #ff8000";
    if (single && have.kind == TYPE_STRING && type_is_numeric(want) && is_quoted_number(node))
        return ": leave out the quotes";
    if (single && have.kind == TYPE_OBJECT && want.kind == TYPE_QUADRIC)
        return ": one quadric is a sphere, an ellipsoid, a cylinder without a height …";
    if (single && have.kind == TYPE_BOOL && type_is_number(want))
        return ": by a condition, write if a { 1 } else { 0 }";
    if (single && type_is_number(have) && want.kind == TYPE_RANGE) return ": write 0 .. and a number";
    if (single && type_is_number(have) && want.kind == TYPE_VEC3) return ": write (0, 0, 1)";
    if (single && type_is_number(have) && want.kind == TYPE_COLOR) return ": write gray(…) of it";
    if (have.list == 1 && !want.list && type_is_numeric(want) && type_is_number(type_element(have)))
        return ": a vector is written in parentheses, (0, 0, 1)";
    if (have.list == 1 && !want.list && want.kind == TYPE_OBJECT && type_is_field(type_element(have)))
        return ": write union(…) of it";
    if (!have.list && want.list == 1 && type_converts(have, type_element(want))) return ": write it in [ ]";
    return "";
}

// [0, 0, 5] in place of a vector.
static void fix_brackets(Checker *c, Diag *d, const Node *node, Type have, Type want)
{
    if (node->kind != NODE_LIST || have.list != 1 || want.list || !(type_is_vector(want) || want.kind == TYPE_COLOR))
        return;
    int count = 0;
    for (const Node *part = node->a; part; part = part->next) count += part->kind == NODE_FOR ? 9 : 1;
    if (count != (want.kind == TYPE_VEC2 ? 2 : 3)) return;
    const Source *source = source_of(&c->unit->sources, node->span.begin);
    const char *text = source->text + (node->span.begin - source->base);
    int length = (int)(node->span.end - node->span.begin);
    if (length > 2) diag_fix(c->unit, d, node->span, FIX_LIKELY, "(%.*s)", length - 2, text + 1);
}

bool expect(Checker *c, const Node *node, Type have, Type want, const char *what)
{
    if (type_converts(have, want)) return true;
    Arena *arena = &c->unit->arena;
    bool numbers = type_is_number(have) && type_is_number(want);
    if (numbers && type_equal(want, type_number(1, 0)) && !have.angle && !have.time) {
        report_angle(c, node, what);
    } else if (numbers && want.kind == TYPE_INT && !have.angle && !have.time) {
        const Node *n = bare(node);
        Diag *d = diag(c->unit, node->span, DIAG_NOT_WHOLE,
                       "%s is a whole number: write one, or floor(…), ceil(…) or round(…)", what);
        if (n->kind == NODE_NUMBER && n->number == floor(n->number) && fabs(n->number) < 1e15) {
            diag_fix(c->unit, d, node->span, FIX_SURE, "%.0f", n->number);
        }
    } else if (numbers || (have.kind == want.kind && have.list == want.list && !type_same_dimension(have, want))) {
        report_unit(c, node, have, want, what);
    } else if (type_is_vector(have) && (type_is_vector(want) || type_is(want, TYPE_COLOR))) {
        diag(c->unit, node->span, DIAG_VECTOR_SIZE, "%s has %d numbers, and this vector has %d", what,
             want.kind == TYPE_VEC2 ? 2 : 3, have.kind == TYPE_VEC2 ? 2 : 3);
    } else {
        Diag *d = diag(c->unit, node->span, DIAG_TYPE_MISMATCH, "%s is %s, and this is %s%s", what,
                       type_phrase(arena, want), type_phrase(arena, have), kind_hint(node, have, want));
        fix_brackets(c, d, node, have, want);
    }
    return false;
}

Type check_as(Checker *c, Node *node, Type want, const char *what)
{
    return expect(c, node, check_expr(c, node), want, what) ? want : poison();
}

// --- leaves

static const char *first_public(const Module *library)
{
    for (const Symbol *symbol = library->first; symbol; symbol = symbol->next) {
        if (symbol->name[0] != '_') return symbol->name;
    }
    return "name";
}

Type check_symbol_value(Checker *c, Symbol *symbol, const Node *node)
{
    switch (symbol->kind) {
    case SYMBOL_LIBRARY:
        diag(c->unit, node->span, DIAG_TYPE_MISMATCH,
             "%s is a library: write what of it is meant behind a dot, as %s.%s", symbol->name, symbol->name,
             first_public(symbol->opens));
        return poison();
    case SYMBOL_CALLABLE:
        if (lost_definition(c->unit, node->name)) return poison(); // what was skipped, with a message, had it
        diag(c->unit, node->span, DIAG_TYPE_MISMATCH,
             "%s is called with arguments, as %s%s%s(…): it is not a value by itself", node->name,
             node->kind == NODE_MEMBER ? node->a->name : "", node->kind == NODE_MEMBER ? "." : "", node->name);
        return poison();
    case SYMBOL_CONSTANT:
        if (lost_definition(c->unit, node->name)) return poison();
        if (builtins[symbol->id].since == SINCE_LATER) {
            diag(c->unit, node->span, DIAG_NOT_YET, "%s is not there yet in this version of scn", node->name);
            return poison();
        }
        break;
    case SYMBOL_LET:
    case SYMBOL_PARAM:
        if (symbol->global) check_symbol(c, symbol);
        need(c, symbol);
        break;
    default: break;
    }
    return symbol->type;
}

static Type check_name(Checker *c, Node *node)
{
    Symbol *symbol = names_use(c, node->name, node->span, false);
    node->note = symbol;
    return check_symbol_value(c, symbol, node);
}

static Type check_number(const Node *node)
{
    Type type = type_of(node->flag ? TYPE_INT : TYPE_NUMBER);
    switch (node->unit) {
    case UNIT_DEG:
    case UNIT_RAD:
    case UNIT_TURN: type = type_number(1, 0); break;
    case UNIT_S:
    case UNIT_MS:
    case UNIT_F: type = type_number(0, 1); break;
    default: type.zero = node->number == 0; break;
    }
    return type;
}

static Type check_vector(Checker *c, const Node *node)
{
    Type type = {0};
    int count = 0;
    bool bad = false;
    for (Node *part = node->a; part; part = part->next, count++) {
        Type have = check_expr(c, part);
        if (type_bad(have)) {
            bad = true;
        } else if (!type_is_number(have)) {
            if (!bad)
                diag(c->unit, part->span, DIAG_TYPE_MISMATCH, "a vector is made of numbers, and this is %s",
                     type_phrase(&c->unit->arena, have));
            bad = true;
        } else if (count == 0 || (type.zero && !have.zero)) {
            type = have;
        } else if (!bad && !type_same_dimension(type, have)) {
            Diag *d = diag(c->unit, part->span, DIAG_UNIT_MISMATCH,
                           "the numbers of a vector have one unit, and this is %s", type_phrase(&c->unit->arena, have));
            diag_label(c->unit, d, node->a->span, "this is %s", type_phrase(&c->unit->arena, type));
            bad = true;
        }
    }
    if (bad) return poison();
    type.kind = count == 2 ? TYPE_VEC2 : TYPE_VEC3;
    return type;
}

static Type check_list(Checker *c, Node *node)
{
    Values values = {.many = true, .what = "a list"};
    for (Node *item = node->a; item; item = item->next) {
        if (item->kind == NODE_FOR) {
            check_for(c, item, &values);
            continue;
        }
        Type have = check_expr(c, item);
        if (values.count++ == 0) {
            values.joined = have;
        } else if (!type_join(values.joined, have, &values.joined)) {
            bool unit = type_is_number(values.joined) && type_is_number(have);
            diag(c->unit, item->span, unit ? DIAG_UNIT_MISMATCH : DIAG_TYPE_MISMATCH,
                 "the elements of a list are alike: this is %s among others that are %s",
                 type_phrase(&c->unit->arena, have), type_text(&c->unit->arena, values.joined));
            values.joined = poison();
        }
    }
    if (values.count == 0) return type_list(type_of(TYPE_ANY));
    if (type_bad(values.joined)) return poison();
    return type_list(values.joined);
}

static Type check_string(Checker *c, const Node *node)
{
    for (Node *piece = node->a; piece; piece = piece->next) {
        if (piece->kind != NODE_TEXT) check_expr(c, piece);
    }
    return type_of(TYPE_STRING);
}

static Type check_unary(Checker *c, Node *node)
{
    Type type = check_expr(c, node->a);
    if (type_bad(type)) return type;
    const char *phrase = type_phrase(&c->unit->arena, type);
    switch (node->op) {
    case NODE_OP_NOT:
        if (node->flag && !type_is(type, TYPE_BOOL)) return poison();
        return expect(c, node->a, type, type_of(TYPE_BOOL), "what follows not") ? type_of(TYPE_BOOL) : poison();
    case NODE_OP_NEG:
        if (type_is_number(type) || type_is_vector(type)) return type;
        diag(c->unit, node->span, DIAG_TYPE_MISMATCH,
             type_is_field(type) ? "- before %s: write ~ for its complement, or a - b" : "- before %s has no meaning",
             phrase);
        return poison();
    default:
        assert(node->op == NODE_OP_COMPLEMENT && "there are three unary operators");
        if (type_is_field(type)) return type_of(TYPE_OBJECT);
        if (type_is(type, TYPE_PATCH)) {
            diag(c->unit, node->a->span, DIAG_PATCH_SHEET, "a patch is a sheet without an inside: thicken it first");
        } else {
            diag(c->unit, node->span, DIAG_TYPE_MISMATCH, "~ is the complement of an object, and this is %s", phrase);
        }
        return poison();
    }
}

// --- operators: the left side's type is known, `node` gives the right

static Type operator_mismatch(Checker *c, const Node *node, Type a, Type b)
{
    Arena *arena = &c->unit->arena;
    const char *op = node_op_text((NodeOp)node->op), *hint = "";
    bool fields = type_is_field(a) && type_is_field(b), sum = node->op == NODE_OP_ADD || node->op == NODE_OP_SUB;
    if (fields && node->op == NODE_OP_ADD)
        hint = ": write a | b for the union";
    else if (fields && node->op == NODE_OP_MUL)
        hint = ": write a & b for the intersection";
    else if (type_is_vector(a) && type_is_vector(b) && node->op == NODE_OP_MUL)
        hint = ": write dot(a, b) or cross(a, b)";
    else if (type_is_field(a) != type_is_field(b) && (type_is_number(a) || type_is_number(b)) &&
             (node->op == NODE_OP_MUL || node->op == NODE_OP_DIV))
        hint = ": to make an object larger or smaller write a.scale(2)";
    else if (type_is_field(a) && type_is_vector(b) && node->op == NODE_OP_ADD)
        hint = ": to move an object write a.move(v)";
    else if (type_is(a, TYPE_PERTURBATION) || type_is(b, TYPE_PERTURBATION))
        hint = ": write freeform(object) { perturbation; … }";
    else if (type_is_vector(a) != type_is_vector(b) && (type_is_number(a) || type_is_number(b)) && sum)
        hint = ": a vector takes a vector, as v + (1, 1, 1)";
    else if ((type_is(a, TYPE_STRING) || type_is(b, TYPE_STRING)) && node->op == NODE_OP_ADD)
        hint = ": write \"{a}{b}\"";
    else if ((type_is(a, TYPE_BOOL) || type_is(b, TYPE_BOOL)) && sum)
        hint = ": write if b { 1 } else { 0 } for the bool";
    else if (type_is(a, TYPE_BOOL) && node->op == NODE_OP_UNION)
        hint = ": write a or b";
    else if (type_is(a, TYPE_BOOL) && node->op == NODE_OP_INTERSECT)
        hint = ": write a and b";
    diag(c->unit, node->name_span.end ? node->name_span : node->span, DIAG_TYPE_MISMATCH,
         "%s between %s and %s has no meaning%s", op, type_phrase(arena, a), type_phrase(arena, b), hint);
    return poison();
}

// What to write where one side is a plain number and the other has a unit: the unit behind a literal, else a factor.
static const char *unit_hint(Arena *arena, const Node *plain, Type want)
{
    const char *unit = want.angle == 1 && !want.time ? "deg" : want.time == 1 && !want.angle ? "s" : NULL;
    const Node *n = bare(plain);
    if (!unit) return "";
    if (n->kind == NODE_NUMBER) return arena_printf(arena, ": write %.12g%s", n->number, unit);
    return arena_printf(arena, ": multiply the plain number by 1%s, or divide the other by 1%s", unit, unit);
}

static Type unit_mismatch(Checker *c, const Node *node, Type a, Type b)
{
    Arena *arena = &c->unit->arena;
    bool plain_a = !a.angle && !a.time, plain_b = !b.angle && !b.time;
    const Node *plain = plain_a ? node->a : node->b;
    const char *hint = plain_a || plain_b ? unit_hint(arena, plain, plain_a ? b : a) : "";
    Diag *d = diag(c->unit, node->b->span, DIAG_UNIT_MISMATCH,
                   "%s wants one unit on both sides: the left is %s, this is %s%s", node_op_text((NodeOp)node->op),
                   type_phrase(arena, a), type_phrase(arena, b), hint);
    diag_label(c->unit, d, node->a->span, "%s", type_phrase(arena, a));
    if (*hint && bare(plain)->kind == NODE_NUMBER) {
        const char *unit = (plain_a ? b : a).angle ? "deg" : "s";
        diag_fix(c->unit, d, plain->span, FIX_LIKELY, "%.12g%s", bare(plain)->number, unit);
    }
    return poison();
}

static Type vector_mismatch(Checker *c, const Node *node)
{
    diag(c->unit, node->b->span, DIAG_VECTOR_SIZE, "%s wants two vectors of one size: one has 2 numbers, the other 3",
         node_op_text((NodeOp)node->op));
    return poison();
}

// + - of numbers, vectors and colours.
static Type type_sum(Checker *c, const Node *node, Type a, Type b)
{
    bool numbers = type_is_number(a) && type_is_number(b), vectors = type_is_vector(a) && type_is_vector(b);
    Type color = type_of(TYPE_COLOR);
    if (type_is(a, TYPE_COLOR) || type_is(b, TYPE_COLOR)) {
        bool left = type_converts(a, color) || type_converts(a, type_number(0, 0));
        bool right = type_converts(b, color) || type_converts(b, type_number(0, 0));
        return left && right ? color : operator_mismatch(c, node, a, b);
    }
    if (!numbers && !vectors) return operator_mismatch(c, node, a, b);
    if (vectors && a.kind != b.kind) return vector_mismatch(c, node);
    if (!type_same_dimension(a, b)) return unit_mismatch(c, node, a, b);
    Type sum = a.zero ? b : a;
    if (numbers) sum.kind = a.kind == TYPE_INT && b.kind == TYPE_INT ? TYPE_INT : TYPE_NUMBER;
    sum.zero = false;
    return sum;
}

static bool dimension_fits(int angle, int time)
{
    return angle >= -100 && angle <= 100 && time >= -100 && time <= 100;
}

static Type type_product(Checker *c, const Node *node, Type a, Type b)
{
    bool divided = node->op == NODE_OP_DIV;
    if (type_is(a, TYPE_COLOR) || type_is(b, TYPE_COLOR)) return type_sum(c, node, a, b);
    if (!(type_is_number(a) || type_is_vector(a)) ||
        !(type_is_number(b) || (type_is_vector(b) && type_is_number(a) && !divided))) {
        return operator_mismatch(c, node, a, b);
    }
    int sign = divided ? -1 : 1;
    int angle = a.angle + sign * b.angle, time = a.time + sign * b.time;
    if (!dimension_fits(angle, time)) {
        diag(c->unit, node->span, DIAG_UNIT_MISMATCH, "units to a power beyond 100 are a mistake");
        return poison();
    }
    Type product = type_number(angle, time);
    if (type_is_vector(a))
        product.kind = a.kind;
    else if (type_is_vector(b))
        product.kind = b.kind;
    else if (!divided && a.kind == TYPE_INT && b.kind == TYPE_INT)
        product.kind = TYPE_INT;
    return product;
}

static bool literal_int(const Node *node, double *value)
{
    node = bare(node);
    double sign = 1;
    if (node->kind == NODE_UNARY && node->op == NODE_OP_NEG) {
        sign = -1;
        node = bare(node->a);
    }
    if (node->kind != NODE_NUMBER || !node->flag || node->unit != UNIT_NONE) return false;
    *value = sign * node->number;
    return true;
}

static Type type_power(Checker *c, const Node *node, Type a, Type b)
{
    if (!type_is_number(a) || !type_is_number(b)) return operator_mismatch(c, node, a, b);
    if (!expect(c, node->b, b, type_number(0, 0), "an exponent")) return poison();
    double exponent;
    bool literal = literal_int(node->b, &exponent);
    if (a.kind == TYPE_INT && b.kind == TYPE_INT) return type_of(literal && exponent < 0 ? TYPE_NUMBER : TYPE_INT);
    if (!a.angle && !a.time) return type_number(0, 0);
    if (!literal) {
        diag(c->unit, node->b->span, DIAG_UNIT_MISMATCH,
             "what has a unit is raised only to a whole number that is written here: divide by the unit first");
        return poison();
    }
    if (fabs(exponent) > 100 || !dimension_fits(a.angle * (int)exponent, a.time * (int)exponent)) {
        diag(c->unit, node->b->span, DIAG_UNIT_MISMATCH, "units to a power beyond 100 are a mistake");
        return poison();
    }
    return type_number(a.angle * (int)exponent, a.time * (int)exponent);
}

static Type type_equality(Checker *c, const Node *node, Type a, Type b)
{
    Type joined;
    bool objects = type_is_field(a) || type_is_field(b) || type_is(a, TYPE_PATCH) || type_is(b, TYPE_PATCH) ||
                   type_is(a, TYPE_VOLUME) || type_is(b, TYPE_VOLUME);
    if (objects) {
        diag(c->unit, node->name_span, DIAG_COMPARE_OBJECTS,
             "objects are sets of points and not compared: ask where a point lies, membership(p, of: a)");
        return poison();
    }
    if (type_is_number(a) && type_is_number(b) && !type_same_dimension(a, b)) return unit_mismatch(c, node, a, b);
    if (type_is_vector(a) && type_is_vector(b) && a.kind != b.kind) return vector_mismatch(c, node);
    bool comparable = (type_is_numeric(a) && type_is_numeric(b)) || (type_is(a, TYPE_BOOL) && type_is(b, TYPE_BOOL)) ||
                      (type_is(a, TYPE_STRING) && type_is(b, TYPE_STRING));
    if (!comparable || !type_join(a, b, &joined)) return operator_mismatch(c, node, a, b);
    return type_of(TYPE_BOOL);
}

static Type type_set(Checker *c, const Node *node, Type a, Type b)
{
    if (type_is(a, TYPE_PATCH) || type_is(b, TYPE_PATCH)) {
        const Node *patch = type_is(a, TYPE_PATCH) ? node->a : node->b;
        diag(c->unit, patch->span, DIAG_PATCH_SHEET,
             "a patch is a sheet without an inside: thicken it, or make it solid, first");
        return poison();
    }
    if (type_is_field(a) && type_is_field(b)) return type_of(TYPE_OBJECT);
    return operator_mismatch(c, node, a, b);
}

static Type check_binary(Checker *c, Node *node, Type a)
{
    bool logic = node->op == NODE_OP_AND || node->op == NODE_OP_OR;
    c->body->conditional += logic; // the right side of these is not always evaluated
    Type b = check_expr(c, node->b);
    c->body->conditional -= logic;
    if (logic && type_is_field(a) && type_is_field(b)) {
        bool both = node->op == NODE_OP_AND;
        const Source *source = source_of(&c->unit->sources, node->name_span.begin);
        if (strchr("&|", source->text[node->name_span.begin - source->base]))
            return poison(); // && and || were reported
        diag(c->unit, node->name_span, DIAG_TYPE_MISMATCH, "`%s` joins conditions: write a %c b for the %s of objects",
             both ? "and" : "or", both ? '&' : '|', both ? "intersection" : "union");
        return poison();
    }
    if (logic) {
        const char *what = node->op == NODE_OP_AND ? "each side of and" : "each side of or";
        bool left = expect(c, node->a, a, type_of(TYPE_BOOL), what);
        bool right = expect(c, node->b, b, type_of(TYPE_BOOL), what);
        return left && right ? type_of(TYPE_BOOL) : poison();
    }
    if (type_bad(a) || type_bad(b)) return poison();
    if (node->flag) return type_of(TYPE_BOOL); // of a chain of comparisons, which was reported
    switch (node->op) {
    case NODE_OP_EQ:
    case NODE_OP_NE: return type_equality(c, node, a, b);
    case NODE_OP_LT:
    case NODE_OP_LE:
    case NODE_OP_GT:
    case NODE_OP_GE:
        if (!type_is_number(a) || !type_is_number(b)) return operator_mismatch(c, node, a, b);
        return type_same_dimension(a, b) ? type_of(TYPE_BOOL) : unit_mismatch(c, node, a, b);
    case NODE_OP_RANGE: {
        if (!type_is_number(a) || !type_is_number(b)) return operator_mismatch(c, node, a, b);
        if (!type_same_dimension(a, b)) return unit_mismatch(c, node, a, b);
        Type range = a.zero ? b : a;
        range.zero = a.zero && b.zero;
        range.whole = a.kind == TYPE_INT && b.kind == TYPE_INT;
        range.kind = TYPE_RANGE;
        return range;
    }
    case NODE_OP_UNION:
    case NODE_OP_INTERSECT: return type_set(c, node, a, b);
    case NODE_OP_SUB:
        if ((type_is_field(a) || type_is(a, TYPE_PATCH)) && (type_is_field(b) || type_is(b, TYPE_PATCH)))
            return type_set(c, node, a, b);
        return type_sum(c, node, a, b);
    case NODE_OP_ADD: return type_sum(c, node, a, b);
    case NODE_OP_MUL:
    case NODE_OP_DIV: return type_product(c, node, a, b);
    default: assert(node->op == NODE_OP_POW && "every binary operator has a rule"); return type_power(c, node, a, b);
    }
}

// --- members and elements

static const struct {
    TypeKind kind;
    const char *name;
    Type type;
} members[] = {
    {TYPE_CONTACT, "hit", {.kind = TYPE_BOOL}},        {TYPE_CONTACT, "undecided", {.kind = TYPE_BOOL}},
    {TYPE_CONTACT, "point", {.kind = TYPE_VEC3}},      {TYPE_CONTACT, "normal", {.kind = TYPE_VEC3}},
    {TYPE_CONTACT, "depth", {.kind = TYPE_NUMBER}},    {TYPE_CONTACT, "objects", {.kind = TYPE_STRING, .list = 1}},
    {TYPE_MEMBERSHIP, "inside", {.kind = TYPE_BOOL}},  {TYPE_MEMBERSHIP, "boundary", {.kind = TYPE_BOOL}},
    {TYPE_MEMBERSHIP, "outside", {.kind = TYPE_BOOL}}, {TYPE_INTERVAL, "low", {.kind = TYPE_NUMBER}},
    {TYPE_INTERVAL, "high", {.kind = TYPE_NUMBER}},    {TYPE_PLACE, "point", {.kind = TYPE_VEC3}},
    {TYPE_PLACE, "normal", {.kind = TYPE_VEC3}},
};
enum { MEMBERS = sizeof members / sizeof *members };

// The members that a type has, at most MEMBERS. Their number.
static int members_of(Type a, const char *known[MEMBERS])
{
    int count = 0;
    const char *letters = type_is_vector(a) ? "x\0y\0z" : type_is(a, TYPE_COLOR) ? "r\0g\0b" : NULL;
    if (letters) {
        for (int i = 0; i < (a.kind == TYPE_VEC2 ? 2 : 3); i++) known[count++] = letters + 2 * i;
    } else if (type_is(a, TYPE_RANGE)) {
        known[count++] = "low";
        known[count++] = "high";
    }
    for (int i = 0; i < MEMBERS && !a.list; i++) {
        if (members[i].kind == (TypeKind)a.kind) known[count++] = members[i].name;
    }
    return count;
}

bool type_has_member(Type type, const char *name)
{
    const char *known[MEMBERS];
    int count = members_of(type, known);
    for (int i = 0; i < count; i++) {
        if (!strcmp(known[i], name)) return true;
    }
    return false;
}

static Type check_member(Checker *c, const Node *node, Type a)
{
    if (type_bad(a)) return a;
    const char *known[MEMBERS];
    int count = members_of(a, known);
    for (int i = 0; i < count; i++) {
        if (strcmp(known[i], node->name)) continue;
        for (int k = 0; k < MEMBERS; k++) {
            if (members[k].kind == (TypeKind)a.kind && members[k].name == known[i]) return members[k].type;
        }
        Type part = type_number(a.angle, a.time);
        if (a.kind == TYPE_RANGE && a.whole) part.kind = TYPE_INT;
        return part;
    }
    const char *phrase = type_phrase(&c->unit->arena, a);
    const char *near = nearest_name(node->name, known, count);
    Symbol *callable = names_find(c, node->name);
    static const char *const of_lists[] = {"length", "len", "size", "count", "Count", "Length"};
    bool how_many = false;
    for (size_t i = 0; i < sizeof of_lists / sizeof *of_lists && a.list; i++)
        how_many |= !strcmp(node->name, of_lists[i]);
    if (how_many) {
        Diag *d = diag(c->unit, node->name_span, DIAG_UNKNOWN_MEMBER,
                       "%s has no member %s: how many elements it has is count(…)", phrase, node->name);
        diag_fix(c->unit, d, node->name_span, FIX_LIKELY, "count()");
    } else if (near) {
        Diag *d = diag(c->unit, node->name_span, DIAG_UNKNOWN_MEMBER, "%s has no member %s: do you mean %s?", phrase,
                       node->name, near);
        diag_fix(c->unit, d, node->name_span, FIX_LIKELY, "%s", near);
    } else if (callable && callable->kind == SYMBOL_CALLABLE) {
        Diag *d = diag(c->unit, node->name_span, DIAG_UNKNOWN_MEMBER, "%s has no member %s: to call it, write .%s()",
                       phrase, node->name, node->name);
        diag_fix(c->unit, d, node->name_span, FIX_LIKELY, "%s()", node->name);
    } else if (count) {
        const char *all = known[0];
        for (int i = 1; i < count; i++) all = arena_printf(&c->unit->arena, "%s, %s", all, known[i]);
        diag(c->unit, node->name_span, DIAG_UNKNOWN_MEMBER, "%s has no member %s, only %s", phrase, node->name, all);
    } else {
        diag(c->unit, node->name_span, DIAG_UNKNOWN_MEMBER, "%s has no members, so no %s", phrase, node->name);
    }
    return poison();
}

static Type check_index(Checker *c, Node *node, Type a)
{
    Type index = check_expr(c, node->b);
    bool good = expect(c, node->b, index, type_of(TYPE_INT), "an index");
    if (type_bad(a)) return a;
    if (!a.list) {
        diag(c->unit, node->a->span, DIAG_TYPE_MISMATCH, "only a list has elements, and this is %s%s",
             type_phrase(&c->unit->arena, a), type_is_vector(a) ? ": write .x, .y or .z" : "");
        return poison();
    }
    return good ? type_element(a) : poison();
}

// --- names of libraries

// The library that a name before a dot stands for, or NULL.
static Symbol *library_of(Checker *c, const Node *node)
{
    if (!node || (node->kind != NODE_NAME && node->kind != NODE_MEMBER)) return NULL;
    Symbol *symbol = names_find(c, node->name);
    return symbol && symbol->kind == SYMBOL_LIBRARY ? symbol : NULL;
}

// `clay.worn(…)` with or without a receiver before it, `clay.tint`.
static Type check_within(Checker *c, Node *node, Symbol *library, const Type *receiver)
{
    library->used = true;
    Symbol *symbol = modules_find(c, library->opens, node->name, node->name_span);
    if (node->kind == NODE_CALL) return check_call(c, node, receiver, symbol);
    node->note = symbol;
    return check_symbol_value(c, symbol, node);
}

// --- all of them

static Type check_link(Checker *c, Node *node, Type left)
{
    switch (node->kind) {
    case NODE_BINARY: return check_binary(c, node, left);
    case NODE_CALL: return check_call(c, node, node->a ? &left : NULL, NULL);
    case NODE_MEMBER: return check_member(c, node, left);
    default: assert(node->kind == NODE_INDEX && "there are four kinds of links"); return check_index(c, node, left);
    }
}

// The innermost link with what stands before it.
static Type check_first_link(Checker *c, Node *node)
{
    Symbol *library = node->kind == NODE_CALL || node->kind == NODE_MEMBER ? library_of(c, node->a) : NULL;
    if (library && node->a->kind == NODE_NAME) {
        node->a->note = library;
        return check_within(c, node, library, NULL);
    }
    return check_link(c, node, node->a ? check_expr(c, node->a) : poison());
}

static Type check_chain(Checker *c, Node *node)
{
    if (!node->a || !node_is_link(node->a)) return check_first_link(c, node);
    int count;
    Node **link = node_spine(&c->scratch, node, &count);
    int i = 0;
    Type type = poison();
    if (link[0]->kind != NODE_MEMBER || !link[0]->a || library_of(c, link[0]->a) || !library_of(c, link[0]))
        type = check_first_link(c, link[i++]);
    else
        type = check_expr(c, link[0]->a);
    for (; i < count; i++) {
        Symbol *library = NULL; // `head.clay.worn()` is clay.worn(head), unless a head has a clay of its own
        if (link[i]->kind == NODE_MEMBER && i + 1 < count && link[i + 1]->kind == NODE_CALL &&
            !type_has_member(type, link[i]->name))
            library = library_of(c, link[i]);
        if (library) {
            link[i]->note = library;
            i++;
            type = check_within(c, link[i], library, &type);
        } else {
            type = check_link(c, link[i], type);
        }
    }
    return type;
}

static Type check_block_value(Checker *c, Node *node)
{
    Values values = {.what = "a block that is used as a value"};
    return check_block(c, node, &values);
}

Type check_expr(Checker *c, Node *node)
{
    if (node_is_link(node)) return check_chain(c, node);
    switch (node->kind) {
    case NODE_ERROR: return poison();
    case NODE_NAME: return check_name(c, node);
    case NODE_NUMBER: return check_number(node);
    case NODE_COLOR: return type_of(TYPE_COLOR);
    case NODE_BOOL: return type_of(TYPE_BOOL);
    case NODE_STRING: return check_string(c, node);
    case NODE_VECTOR: return check_vector(c, node);
    case NODE_LIST: return check_list(c, node);
    case NODE_PAREN: return check_expr(c, node->a);
    case NODE_UNARY: return check_unary(c, node);
    case NODE_BLOCK: return check_block_value(c, node);
    case NODE_IF: {
        Values values = {.what = "an if that is used as a value"};
        return check_if(c, node, &values);
    }
    default: assert(false && "every expression has a rule"); return poison();
    }
}
