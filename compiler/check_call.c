// Calls: which callable of a name is meant, what argument goes to which parameter, and the type of the result.
//
// The steps, in order: the arguments in the parentheses get their types; among several of a name the first that takes
// them (by names and types) is chosen; they are bound; then the block is read, its entries as named arguments, its
// values as the last list argument; then what is missing is reported, and the result follows. What a message says of
// a parameter is made up only when there is a message.
#include <assert.h>
#include <string.h>

#include "compiler/check_call.h"
#include "compiler/synonyms.h"

enum { FEW = 12 }; // arguments that find room on the stack

// --- which parameter

static bool is_named(const Calling *k, Name name)
{
    for (uint32_t i = k->positional; i < k->count; i++) {
        if (k->arguments[i].name == name) return true;
    }
    const Node *block = k->node->c && k->node->c->kind == NODE_BLOCK ? k->node->c->a : NULL;
    for (const Node *item = block; item; item = item->next) {
        if (item->kind == NODE_ENTRY && item->a->kind == NODE_NAME && item->a->name == name) return true;
    }
    return false;
}

// How many of the positional arguments are of needed parameters behind a loose list: in spline(p, q, r, t) the last.
static uint32_t kept_behind(const Calling *k, const Callable *callee, uint32_t list)
{
    uint32_t kept = 0;
    for (uint32_t i = list + 1; i < callee->count; i++) {
        const Parameter *p = &callee->parameters[i];
        kept += parameter_needed(p) && !p->type.list && !is_named(k, p->name);
    }
    uint32_t rest = k->positional > list ? k->positional - list - 1 : 0; // the list has one at least
    return kept < rest ? kept : rest;
}

// The parameter of the argument at a position, or -1. The first list parameter takes all that remain, but for those
// of needed parameters behind it.
static int parameter_at(const Calling *k, const Callable *callee, uint32_t position)
{
    int list = parameter_list_of(callee, false);
    if (list < 0 || position < (uint32_t)list) return position < callee->count ? (int)position : -1;
    uint32_t kept = kept_behind(k, callee, (uint32_t)list), behind = k->positional - position;
    if (behind > kept) return list;
    for (uint32_t i = callee->count; i-- > (uint32_t)list + 1;) { // from the last on
        const Parameter *p = &callee->parameters[i];
        bool takes = parameter_needed(p) && !p->type.list && !is_named(k, p->name);
        if (takes && --behind == 0) return (int)i;
    }
    return list;
}

static bool parameter_takes(const Parameter *p, Type have)
{
    Type want = p->type;
    if (type_bad(have)) return true;
    if (want.list && have.list < want.list) want = type_element(want); // one element of a loose list
    if (want.list != have.list) return type_converts(have, want);
    switch (p->generic) {
    case GENERIC_NONE: return type_converts(have, want);
    case GENERIC_NUMBER: return have.kind == TYPE_INT || have.kind == TYPE_NUMBER || have.kind == TYPE_ANY;
    case GENERIC_RANGE: return have.kind == TYPE_RANGE;
    case GENERIC_VECTOR: return have.kind == TYPE_VEC2 || have.kind == TYPE_VEC3;
    case GENERIC_NUMERIC: have.list = 0; return type_is_numeric(have);
    default:
        return have.kind == TYPE_QUADRIC || have.kind == TYPE_OBJECT || have.kind == TYPE_PATCH ||
               have.kind == TYPE_PERTURBATION;
    }
}

// --- which callable

// Marks a parameter as given. False where it was already: only a list takes several arguments.
static bool give(uint64_t *given, const Callable *callee, int at)
{
    if (at < 0 || at >= 64) return true;
    uint64_t bit = UINT64_C(1) << at;
    bool twice = *given & bit && !callee->parameters[at].type.list;
    *given |= bit;
    return !twice;
}

// How well a callable suits: the number of arguments and entries that it takes, or -1 if it takes all of them and
// nothing is missing.
static int suits(const Calling *k, const Callable *callee)
{
    uint64_t given = 0; // of the first 64 parameters; more has only what users define, and that is alone under its name
    int taken = 0;
    bool all = true;
    for (uint32_t i = 0; i < k->count; i++) {
        const Argument *a = &k->arguments[i];
        int at = a->name ? parameter_named(callee, a->name) : parameter_at(k, callee, i);
        bool takes = at >= 0 && parameter_takes(&callee->parameters[at], a->type);
        bool twice = !give(&given, callee, at);
        bool near = at >= 0 && (a->name || (type_is_vector(a->type) && type_is_vector(callee->parameters[at].type)));
        taken += takes && !twice ? 2 : near;
        all &= takes && !twice;
    }
    bool values = false;
    for (const Node *item = k->node->c && k->node->c->kind == NODE_BLOCK ? k->node->c->a : NULL; item;
         item = item->next) {
        if (item->kind == NODE_VALUE || item->kind == NODE_FOR) values = true;
        if (item->kind != NODE_ENTRY || item->a->kind != NODE_NAME) continue;
        int at = parameter_named(callee, item->a->name);
        bool takes = at >= 0 && give(&given, callee, at);
        taken += takes ? 2 : 0;
        all &= takes;
    }
    int list = parameter_list_of(callee, true);
    if (values && list >= 0) given |= UINT64_C(1) << list;
    for (uint32_t i = 0; i < callee->count && i < 64; i++) {
        const Parameter *p = &callee->parameters[i];
        if (parameter_needed(p) && !p->type.list && !(given >> i & 1)) all = false;
    }
    return all ? -1 : taken;
}

static const Callable *choose(const Calling *k, const Callable *first)
{
    if (!first->overload) return first;
    const Callable *best = first;
    int most = -1;
    for (const Callable *callee = first; callee; callee = callee->overload) {
        int taken = suits(k, callee);
        if (taken < 0) return callee;
        if (taken > most) {
            most = taken;
            best = callee;
        }
    }
    return best;
}

// --- types of arguments

static const char *parameter_phrase(Calling *k, const Parameter *p)
{
    bool function = k->callee->kind == CALLABLE_BUILTIN && builtins[k->callee->id].kind == KIND_FUNCTION;
    if (function && k->callee->count == 1) return arena_printf(&k->c->scratch, "what %s takes", k->callee->name);
    return arena_printf(&k->c->scratch, "%s of %s", p->name, k->callee->name);
}

static void report_generic(Calling *k, const Parameter *p, const Node *node, Type have)
{
    static const char *const wants[] = {
        [GENERIC_NUMBER] = "a number",
        [GENERIC_RANGE] = "a range",
        [GENERIC_VECTOR] = "a vector",
        [GENERIC_NUMERIC] = "a number, a vector or a color",
        [GENERIC_MOVABLE] = "an object, a quadric or a perturbation",
    };
    k->bad = true;
    const char *phrase = type_phrase(&k->c->unit->arena, have);
    if (p->generic == GENERIC_MOVABLE && type_is_numeric(have)) {
        diag(k->c->unit, node->span, DIAG_NOT_YET,
             "to move patterns of x, y and z, as this %s, is not there yet in this version of scn",
             type_text(&k->c->unit->arena, have));
        return;
    }
    const char *hint = k->callee->id == BUILTIN_FIELD && k->callee->kind == CALLABLE_BUILTIN && type_is(have, TYPE_BOOL)
                           ? ": write what is not negative inside, as 1 - x^2 - y^2"
                           : "";
    diag(k->c->unit, node->span, DIAG_TYPE_MISMATCH, "%s is %s, and this is %s%s", parameter_phrase(k, p),
         wants[p->generic], phrase, hint);
}

// Joins the type of an argument into what the call's arguments have in common.
static void join_common(Calling *k, const Parameter *p, const Node *node, Type have)
{
    if (have.list) have = type_element(have);
    if (p->generic == GENERIC_RANGE) have.kind = have.whole ? TYPE_INT : TYPE_NUMBER;
    if (have.kind == TYPE_ANY) return;
    Type joined;
    if (k->common.kind == TYPE_ANY) {
        k->common = have;
    } else if (p->generic == GENERIC_VECTOR) { // dimensions are the function's affair
        if (k->common.kind == have.kind) return;
        k->bad = true;
        diag(k->c->unit, node->span, DIAG_VECTOR_SIZE, "%s wants vectors of one size: this has %d numbers",
             k->callee->name, have.kind == TYPE_VEC2 ? 2 : 3);
    } else if (type_join(k->common, have, &joined)) {
        k->common = joined;
    } else {
        k->bad = true;
        expect(k->c, node, have, k->common, parameter_phrase(k, p));
    }
}

// What `any` of the patches' signatures stands for.
static void check_patch_argument(Calling *k, const Parameter *p, const Node *node, Type have)
{
    bool stiffness = k->callee->id == BUILTIN_PATCH && !strcmp(p->name, "stiffness");
    bool tangent = (k->callee->id == BUILTIN_EDGE_U || k->callee->id == BUILTIN_EDGE_V) && !strcmp(p->name, "tangent");
    if (!stiffness && !tangent) return;
    Type one = stiffness && have.list ? type_element(have) : have;
    if (type_converts(one, type_of(TYPE_VEC3)) || (tangent && type_converts(one, type_number(0, 0)))) return;
    k->bad = true;
    diag(k->c->unit, node->span, DIAG_TYPE_MISMATCH, "%s is %s, and this is %s", parameter_phrase(k, p),
         stiffness ? "three numbers (b, c, d), or a list of three such, for x, y and z"
                   : "a number, or three for x, y and z",
         type_phrase(&k->c->unit->arena, have));
}

// The numbers of a vector or of a list where each is an argument of its own, as in box([1, 2, 3]) and a.scale((1, 2, 3)).
static bool report_numbers_in_brackets(Calling *k, int at, const Node *node, Type have)
{
    Arena *arena = &k->c->scratch;
    bool list = node->kind == NODE_LIST && have.list == 1 && type_is_number(type_element(have));
    if (!list && node->kind != NODE_VECTOR) return false;
    const char *all = NULL;
    uint32_t i = (uint32_t)at;
    for (const Node *part = node->a; part; part = part->next, i++) {
        bool number = i < k->callee->count && !k->callee->parameters[i].type.list &&
                      type_is_number(k->callee->parameters[i].type);
        if (!number || k->call->bound[i].how != (part == node->a ? BOUND_ONE : BOUND_DEFAULT)) return false;
        size_t begin = part->span.begin, length = part->span.end - part->span.begin;
        const Source *source = source_of(&k->c->unit->sources, part->span.begin);
        const char *text = arena_text(arena, source->text + (begin - source->base), length);
        bool angle = part->kind == NODE_NUMBER && part->unit == UNIT_NONE && part->number != 0 &&
                     k->callee->parameters[i].type.angle;
        if (angle) text = arena_printf(arena, "%sdeg", text);
        all = all ? arena_printf(arena, "%s, %s", all, text) : text;
    }
    Diag *d =
        diag(k->c->unit, node->span, DIAG_TYPE_MISMATCH,
             "the numbers of %s stand without brackets of their own: %s(%.60s)", k->callee->name, k->callee->name, all);
    diag_fix(k->c->unit, d, node->span, FIX_LIKELY, "%s", all);
    return true;
}

// Where another way to call it takes something else at this place, both are named.
static bool report_several(Calling *k, int at, const Node *node, Type have)
{
    const Type mine = k->callee->parameters[at].type;
    const char *wants = type_phrase(&k->c->scratch, mine);
    bool several = false;
    for (const Callable *other = k->first; other; other = other->overload) {
        if (other == k->callee || (uint32_t)at >= other->count || type_is_number(have)) continue;
        const char *more = type_phrase(&k->c->scratch, other->parameters[at].type);
        if (!strstr(wants, more)) wants = arena_printf(&k->c->scratch, "%s or %s", wants, more);
        several = true;
    }
    if (!several || have.kind == TYPE_STRING || type_is_number(mine) || type_is_vector(mine)) return false;
    diag(k->c->unit, node->span, DIAG_TYPE_MISMATCH, "%s takes %s here, and this is %s", k->callee->name, wants,
         type_phrase(&k->c->unit->arena, have));
    return true;
}

static void check_argument(Calling *k, int at, Node *node, Type have)
{
    const Parameter *p = &k->callee->parameters[at];
    if (type_bad(have)) {
        k->bad = true;
        return;
    }
    if (!parameter_takes(p, have)) {
        bool number = type_is_number(have) && type_is_vector(p->type);
        number |= type_is_number(p->type) && type_is_vector(have);
        bool again = number && k->number_for_vector; // as in capsule(0, 0, 0), or box((0, 0, 0), (1, 1, 1))
        k->number_for_vector |= number;
        k->bad = true;
        if (again) return;
        if (report_numbers_in_brackets(k, at, node, have) || report_several(k, at, node, have)) return;
        Type want = p->type;
        if (want.list && !have.list) want = type_element(want);
        if (p->generic)
            report_generic(k, p, node, have);
        else
            expect(k->c, node, have, want, parameter_phrase(k, p));
    } else if (p->generic) {
        join_common(k, p, node, have);
    } else if (type_is(have, TYPE_PATCH) && p->type.list && k->callee->id != BUILTIN_SCENE &&
               k->callee->id != BUILTIN_OBJECT) {
        k->bad = true;
        diag(k->c->unit, node->span, DIAG_PATCH_SHEET,
             "a patch is a sheet without an inside: thicken it, or make it solid, first");
    } else {
        check_patch_argument(k, p, node, have);
    }
}

// A choice that is written as a plain string can be checked at once.
static void check_choice(Calling *k, const Parameter *p, const Node *node)
{
    if (!p->choices || node->kind != NODE_STRING || !node->a || node->a->kind != NODE_TEXT || node->a->next) return;
    const char *text = node->a->text, *all = NULL;
    int count = 0;
    for (; p->choices[count]; count++) {
        if (!strcmp(p->choices[count], text)) return;
        all = all ? arena_printf(&k->c->scratch, "%s, \"%s\"", all, p->choices[count])
                  : arena_printf(&k->c->scratch, "\"%s\"", p->choices[count]);
    }
    k->bad = true;
    const char *near = nearest_name(text, p->choices, count);
    Diag *d = diag(k->c->unit, node->span, DIAG_UNKNOWN_CHOICE, "%s is one of %s", parameter_phrase(k, p), all);
    if (near) diag_fix(k->c->unit, d, node->span, FIX_LIKELY, "\"%s\"", near);
}

// --- binding

// "(x, y, z, about)": what a call that stands behind a dot need not say is left out.
static const char *parameter_list(Calling *k, const Callable *callee)
{
    const char *all = NULL;
    for (uint32_t i = k->receiver ? 1 : 0; i < callee->count; i++)
        all =
            all ? arena_printf(&k->c->scratch, "%s, %s", all, callee->parameters[i].name) : callee->parameters[i].name;
    return arena_printf(&k->c->scratch, "(%s)", all ? all : "");
}

// A name that only another way to call it has: which names go together is said.
static bool report_mixed(Calling *k, Name name, Span span)
{
    const Callable *other = k->first;
    while (other && parameter_named(other, name) < 0) other = other->overload;
    if (!other) return false;
    diag(k->c->unit, span, DIAG_UNKNOWN_ARGUMENT, "%s is called with %s or with %s: %s is not among the first",
         k->callee->name, parameter_list(k, k->callee), parameter_list(k, other), name);
    return true;
}

static void report_unknown(Calling *k, Name name, Span span)
{
    enum { MOST = 64 };
    const char *known[MOST] = {0};
    int count = 0;
    const char *all = NULL;
    k->bad = true;
    if (report_mixed(k, name, span)) return;
    for (const Callable *callee = k->first; callee; callee = callee->overload) {
        for (uint32_t i = k->receiver ? 1 : 0; i < callee->count && count < MOST; i++) {
            bool seen = false;
            for (int j = 0; j < count; j++) seen |= known[j] == callee->parameters[i].name;
            if (seen) continue;
            known[count++] = callee->parameters[i].name;
            all = all ? arena_printf(&k->c->scratch, "%s, %s", all, known[count - 1]) : known[count - 1];
        }
    }
    const char *near = suggested_name(name, known, count), *callee = k->first->name;
    if (near) {
        Diag *d = diag(k->c->unit, span, DIAG_UNKNOWN_ARGUMENT, "%s has no %s: do you mean %s?", callee, name, near);
        diag_fix(k->c->unit, d, span, FIX_LIKELY, "%s", near);
    } else if (all) {
        diag(k->c->unit, span, DIAG_UNKNOWN_ARGUMENT, "%s has no %s: it has %s", callee, name, all);
    } else {
        diag(k->c->unit, span, DIAG_UNKNOWN_ARGUMENT, "%s has no arguments", callee);
    }
}

static bool bind_one(Calling *k, int at, Node *node, Span span, bool entry)
{
    const Parameter *p = &k->callee->parameters[at];
    Bound *bound = &k->call->bound[at];
    if (bound->how != BOUND_DEFAULT) {
        k->bad = true;
        diag(k->c->unit, span, DIAG_DUPLICATE_ARGUMENT, "%s of %s is already given", p->name, k->callee->name);
        return false;
    }
    *bound = (Bound){.how = BOUND_ONE, .entry = entry, .node = node};
    if (p->later) {
        k->bad = true;
        diag(k->c->unit, span, DIAG_NOT_YET, "%s of %s is not there yet in this version of scn", p->name,
             k->callee->name);
        return false;
    }
    check_choice(k, p, node);
    return true;
}

// The optional parameter behind a list that an argument too many may have been meant for, or NULL.
static const Parameter *meant_behind(const Calling *k, uint32_t list, const Argument *a)
{
    for (uint32_t i = list + 1; i < k->callee->count; i++) {
        const Parameter *p = &k->callee->parameters[i];
        if (!parameter_needed(p) && !is_named(k, p->name) && parameter_takes(p, a->type)) return p;
    }
    return NULL;
}

// A list among several arguments is the whole of the list parameter, or it would be a list in a list: the others are too many.
static bool gives_whole_and_more(Calling *k, int at, uint32_t position, uint32_t count)
{
    const Parameter *list = &k->callee->parameters[at];
    uint32_t whole = position;
    while (whole < position + count && k->arguments[whole].type.list < list->type.list) whole++;
    if (whole == position + count) return false;
    const Argument *more = &k->arguments[whole == position ? position + 1 : whole];
    const Parameter *meant = whole == position ? meant_behind(k, (uint32_t)at, more) : NULL;
    const char *hint =
        meant ? arena_printf(&k->c->scratch, "name this one, as %s: …", meant->name) : "put all of it into one list";
    k->bad = true;
    Diag *d = diag(k->c->unit, more->span, DIAG_DUPLICATE_ARGUMENT,
                   "%s of %s is given whole by a list, and here is more: %s", list->name, k->callee->name, hint);
    if (more->node != k->arguments[whole].node) diag_label(k->c->unit, d, k->arguments[whole].span, "the list");
    if (meant) diag_fix(k->c->unit, d, (Span){more->span.begin, more->span.begin}, FIX_LIKELY, "%s: ", meant->name);
    return true;
}

static void bind_loose(Calling *k, int at, uint32_t position, uint32_t count)
{
    if (count == 1 && k->arguments[position].type.list >= k->callee->parameters[at].type.list) { // the list itself
        if (bind_one(k, at, k->arguments[position].node, k->arguments[position].span, false)) {
            check_argument(k, at, k->arguments[position].node, k->arguments[position].type);
        }
        return;
    }
    if (gives_whole_and_more(k, at, position, count)) return;
    Node **items = arena_array(&k->c->unit->arena, Node *, count);
    for (uint32_t i = 0; i < count; i++) {
        const Argument *a = &k->arguments[position + i];
        items[i] = a->node;
        check_argument(k, at, a->node, a->type);
    }
    k->call->bound[at] = (Bound){.how = BOUND_LOOSE, .count = count, .items = items};
}

// More arguments than parameters are one mistake, whatever their types: membership(0, 0, 0, a).
static bool report_too_many(Calling *k)
{
    for (uint32_t i = 0; i < k->positional; i++) {
        if (parameter_at(k, k->callee, i) >= 0) continue;
        uint32_t count = k->callee->count;
        diag(k->c->unit, k->arguments[i].span, DIAG_TOO_MANY_ARGUMENTS, "%s takes %u argument%s%s%s", k->callee->name,
             count, count == 1 ? "" : "s", k->receiver ? ", that before the dot included" : "",
             call_hint_too_many(k, i));
        return k->bad = true;
    }
    return false;
}

static void bind_positional(Calling *k)
{
    if (report_too_many(k)) return;
    for (uint32_t i = 0; i < k->positional; i++) {
        const Argument *a = &k->arguments[i];
        int at = parameter_at(k, k->callee, i);
        if (k->callee->parameters[at].type.list) {
            uint32_t count = k->positional - i - kept_behind(k, k->callee, (uint32_t)at);
            bind_loose(k, at, i, count);
            i += count - 1;
            continue;
        }
        if (bind_one(k, at, a->node, a->span, false)) check_argument(k, at, a->node, a->type);
    }
}

static void bind_named(Calling *k)
{
    for (uint32_t i = k->positional; i < k->count; i++) {
        const Argument *a = &k->arguments[i];
        int at = parameter_named(k->callee, a->name);
        if (at < 0 && a->foreign)
            k->bad = true;
        else if (at < 0)
            report_unknown(k, a->name, a->span);
        else if (bind_one(k, at, a->node, a->span, false))
            check_argument(k, at, a->node, a->type);
    }
}

// --- the block

static void bind_entry(Calling *k, Node *item)
{
    k->call->has_entries = true;
    if (item->a->kind != NODE_NAME) {
        k->bad = true;
        diag(k->c->unit, item->a->span, DIAG_UNKNOWN_ARGUMENT, "in the block of %s each key is the name of an argument",
             k->callee->name);
        check_expr(k->c, item->b);
        return;
    }
    if (item->name) {
        k->bad = true;
        diag(k->c->unit, item->name_span, DIAG_MISPLACED,
             "an easing stands in keys only: end the entry with ; before %s", item->name);
    }
    bool word = call_report_word(k->c, k->callee, item, 0);
    Type have = word ? poison() : check_expr(k->c, item->b);
    int at = parameter_named(k->callee, item->a->name);
    if (at < 0 && item->flag) {
        k->bad = true;
        lost_add(k->c->unit, item->a->name); // it may have been meant as a let
    } else if (at < 0) {
        report_unknown(k, item->a->name, item->a->span);
    } else if (bind_one(k, at, item->b, item->a->span, true)) {
        check_argument(k, at, item->b, have);
    }
}

static bool has_values(const Node *block)
{
    for (const Node *item = block->a; item; item = item->next) {
        if (item->kind == NODE_VALUE || item->kind == NODE_FOR) return true;
    }
    return false;
}

// light { direction (0, 0, -1); }: the colon of an argument was forgotten. True with a message.
static bool is_entry_without_colon(Calling *k, Node *item)
{
    const Node *call = item->kind == NODE_VALUE ? item->a : NULL;
    if (!call || call->kind != NODE_CALL || call->a || call->c || parameter_named(k->callee, call->name) < 0)
        return false;
    if (names_find(k->c, call->name)) return false;
    k->bad = true;
    Diag *d = diag(k->c->unit, call->name_span, DIAG_NAMED_ARGUMENT,
                   "an argument with a name is written with a colon: write %s: …;", call->name);
    diag_fix(k->c->unit, d, (Span){call->name_span.end, call->name_span.end}, FIX_LIKELY, ":");
    return true;
}

static void bind_block(Calling *k)
{
    Node *block = k->node->c;
    if (!block) return;
    if (block->kind != NODE_BLOCK) {
        k->bad = true;
        return;
    }
    int at = parameter_list_of(k->callee, true);
    Values values = {.many = true, .what = k->callee->name};
    if (at >= 0) {
        const Parameter *p = &k->callee->parameters[at];
        values.known = p->generic == GENERIC_NONE && p->type.kind != TYPE_ANY;
        values.want = type_element(p->type);
        values.sheets =
            k->callee->kind == CALLABLE_BUILTIN && (k->callee->id == BUILTIN_SCENE || k->callee->id == BUILTIN_OBJECT);
    }
    BlockScope scope;
    uint32_t mark = names_open(k->c, &scope, block->a);
    bool meant_entries = false;
    for (Node *item = block->a; item; item = item->next) {
        if (item->kind == NODE_ENTRY)
            bind_entry(k, item);
        else if (at < 0 && is_entry_without_colon(k, item))
            meant_entries = true;
        else
            check_item(k->c, item, &values);
    }
    names_close(k->c, mark);
    k->call->block = block;
    if (meant_entries) return;
    if (!has_values(block)) {
        // An empty block still gives a list: `union { }` is the empty set.
        if (at >= 0 && k->call->bound[at].how == BOUND_DEFAULT)
            k->call->bound[at] = (Bound){.how = BOUND_BLOCK, .node = block};
    } else if (at < 0) {
        k->bad = true;
        bool formed = type_is(values.joined, TYPE_PERTURBATION) && type_is_field(k->callee->result);
        diag(k->c->unit, block->span, DIAG_TOO_MANY_ARGUMENTS, "%s takes no values in its block, %s%s%s",
             k->callee->name, formed ? "and perturbations change a free form: write freeform(" : "only name: value;",
             formed ? k->callee->name : "", formed ? "(…)) { … }" : "");
    } else if (k->call->bound[at].how != BOUND_DEFAULT) {
        k->bad = true;
        diag(k->c->unit, block->span, DIAG_DUPLICATE_ARGUMENT,
             "%s of %s is already given: put all of it into the block, or none", k->callee->parameters[at].name,
             k->callee->name);
    } else {
        k->call->bound[at] = (Bound){.how = BOUND_BLOCK, .node = block};
        if (!values.known) join_common(k, &k->callee->parameters[at], block, values.joined);
    }
}

// --- results

// Of what keys and match are called with.
static Type driver_type(const Calling *k)
{
    for (uint32_t i = 0; i < k->count && !k->bad; i++) {
        if (k->arguments[i].node == k->call->bound[0].node) return k->arguments[i].type;
    }
    return poison();
}

static Type result_of(const Calling *k)
{
    Type common = k->common, result = k->callee->result;
    if (k->callee->kind != CALLABLE_BUILTIN) return result;
    if (k->bad) return k->callee->result_same || result.kind == TYPE_ANY ? poison() : result;
    switch (k->callee->id) {
    case BUILTIN_SQRT: {
        if (common.angle % 2 || common.time % 2) {
            diag(k->c->unit, k->node->span, DIAG_UNIT_MISMATCH,
                 "the square root of %s has no unit: divide by the unit first",
                 type_phrase(&k->c->unit->arena, common));
            return poison();
        }
        return type_number(common.angle / 2, common.time / 2);
    }
    case BUILTIN_LENGTH:
    case BUILTIN_DISTANCE: return type_number(common.angle, common.time);
    case BUILTIN_NORMALIZE:
    case BUILTIN_HEADING: return type_of((TypeKind)common.kind);
    case BUILTIN_RANDOM: return type_number(common.angle, common.time);
    case BUILTIN_DOT:
    case BUILTIN_CROSS: {
        Type a = k->arguments[0].type, b = k->count > 1 ? k->arguments[1].type : a;
        Type product = type_number(a.angle + b.angle, a.time + b.time);
        if (k->callee->id == BUILTIN_CROSS) product.kind = TYPE_VEC3;
        return product;
    }
    case BUILTIN_STEPS: return type_list(type_number(common.angle, common.time));
    case BUILTIN_MIX:
    case BUILTIN_SPLINE:
        common.zero = false;
        if (common.kind == TYPE_INT) common.kind = TYPE_NUMBER;
        return common;
    default: break;
    }
    if (!k->callee->result_same) return result.kind == TYPE_ANY ? poison() : result;
    if (common.kind == TYPE_ANY) return poison();
    common.zero = common.whole = false;
    if (common.kind == TYPE_PATCH) common.kind = TYPE_OBJECT; // where it is moved, it is no patch any more
    return common;
}

// --- all of it

static void collect(Calling *k)
{
    uint32_t most = k->receiver ? 1 : 0;
    for (const Node *a = k->node->b; a; a = a->next) most++;
    if (most > FEW) k->arguments = arena_array(&k->c->scratch, Argument, most);
    if (k->receiver)
        k->arguments[k->count++] = (Argument){.node = k->node->a, .span = k->node->a->span, .type = *k->receiver};
    k->positional = k->count;
    for (Node *a = k->node->b; a; a = a->next) {
        bool named = a->kind == NODE_ARGUMENT;
        bool word = k->first && call_report_word(k->c, k->first, a, k->count);
        k->bad |= word;
        Type type = word ? poison() : check_expr(k->c, named ? a->a : a);
        if (named) {
            k->arguments[k->count++] = (Argument){a->a, a->name, a->name_span, type, a->flag};
        } else if (k->positional < k->count) {
            if (!k->bad) // once: what follows stands behind the same name
                diag(k->c->unit, a->span, DIAG_POSITIONAL_AFTER_NAMED,
                     "arguments without a name come first: name this one, or move it forward");
            k->bad = true;
        } else {
            k->arguments[k->count++] = (Argument){.node = a, .span = a->span, .type = type};
            k->positional++;
        }
    }
}

static void check_block_of_wrong_call(Checker *c, Node *block)
{
    Values values = {.many = true, .what = "this call"};
    if (!block || block->kind != NODE_BLOCK) return;
    BlockScope scope;
    uint32_t mark = names_open(c, &scope, block->a);
    for (Node *item = block->a; item; item = item->next) {
        if (item->kind == NODE_ENTRY)
            check_expr(c, item->b);
        else if (item->kind == NODE_VALUE)
            check_expr(c, item->a);
        else
            check_item(c, item, &values);
    }
    names_close(c, mark);
}

// brushes.dent() where there is no brushes: what it is a word of was reported.
static bool follows_unknown(Checker *c, const Node *node)
{
    const Symbol *symbol = node->a->kind == NODE_NAME ? node->a->note : NULL;
    return symbol && symbol->kind == SYMBOL_ERROR && !names_find(c, node->name);
}

// cylinder(1).height(2): what is no word, but an argument of the call before the dot.
static bool report_argument_behind(Checker *c, const Node *node)
{
    const Node *before = node->a;
    if (!before || before->kind != NODE_CALL || names_find(c, node->name) || lost_name(c->unit, node->name))
        return false;
    const Symbol *symbol = before->note ? names_find(c, before->name) : NULL;
    const Callable *callee = symbol && symbol->kind == SYMBOL_CALLABLE ? symbol->callable : NULL;
    while (callee && parameter_named(callee, node->name) < 0) callee = callee->overload;
    if (!callee) return false;
    diag(c->unit, node->name_span, DIAG_UNKNOWN_NAME, "%s is an argument of %s: write %s(…, %s: …)", node->name,
         callee->name, callee->name, node->name);
    return true;
}

Type check_call(Checker *c, Node *node, const Type *receiver, Symbol *symbol)
{
    Argument few[FEW];
    Calling k = {.c = c, .node = node, .receiver = receiver, .arguments = few, .common = type_of(TYPE_ANY)};
    bool argument = !symbol && receiver && (follows_unknown(c, node) || report_argument_behind(c, node));
    if (!symbol && !argument) symbol = names_use(c, node->name, node->name_span, true);
    if (!argument && symbol->kind == SYMBOL_CALLABLE) k.first = symbol->callable;
    collect(&k);
    if (argument) {
        check_block_of_wrong_call(c, node->c);
        return poison();
    }
    if (symbol->kind != SYMBOL_CALLABLE) {
        if (symbol->kind != SYMBOL_ERROR) {
            if (symbol->global) check_symbol(c, symbol);
        }
        if (symbol->kind != SYMBOL_ERROR && !(symbol->kind == SYMBOL_LET && type_bad(symbol->type))) {
            const char *what =
                symbol->kind == SYMBOL_LIBRARY ? "a library" : type_phrase(&c->unit->arena, symbol->type);
            Diag *d =
                diag(c->unit, node->name_span, DIAG_TYPE_MISMATCH, "%s is %s here and cannot be called%s", node->name,
                     what, symbol->kind != SYMBOL_LIBRARY && symbol->type.list ? ": an element is written [0]" : "");
            bool hides = symbol->kind != SYMBOL_LIBRARY && names_hide_builtin(c, node->name);
            if (symbol->span.end)
                diag_label(c->unit, d, symbol->span,
                           hides ? "defined here, which hides what is built in: give it another name" : "defined here");
        }
        check_block_of_wrong_call(c, node->c);
        return poison();
    }
    k.callee = choose(&k, k.first);
    if (k.callee->lost) {
        check_block_of_wrong_call(c, node->c);
        return k.callee->declared ? k.callee->result : poison();
    }
    if (symbol->global || k.callee->prelude) check_symbol(c, symbol);
    if (call_report_habit(&k)) {
        check_block_of_wrong_call(c, node->c);
        return k.callee->kind == CALLABLE_BUILTIN && !k.callee->result_same ? k.callee->result : poison();
    }
    bool built_in = k.callee->kind == CALLABLE_BUILTIN;
    bool cases = built_in && (k.callee->id == BUILTIN_KEYS || k.callee->id == BUILTIN_MATCH);
    k.call = arena_alloc(&c->unit->tree_arena, sizeof(Call) + k.callee->count * sizeof(Bound));
    k.call->callee = k.callee;
    bind_positional(&k);
    bind_named(&k);
    Type of_cases = poison();
    if (cases)
        of_cases = check_cases(c, node, k.call, driver_type(&k));
    else
        bind_block(&k);
    if (!k.bad) call_check_missing(&k);
    if (!k.bad && built_in) call_check_rules(&k);
    if (!k.bad && k.callee->kind == CALLABLE_TOOL) call_check_place(&k);
    node->note = k.call;
    k.call->wrong = k.bad;
    k.call->result = cases ? of_cases : result_of(&k);
    if (built_in && builtins[k.callee->id].since == SINCE_LATER) {
        diag(c->unit, node->name_span, DIAG_NOT_YET, "%s is not there yet in this version of scn", node->name);
    }
    return k.call->result;
}
