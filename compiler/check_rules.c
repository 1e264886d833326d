#include "compiler/check_call.h"

#include <string.h>

int parameter_list_of(const Callable *callee, bool last)
{
    int found = -1;
    for (uint32_t i = 0; i < callee->count; i++) {
        if (!callee->parameters[i].type.list) continue;
        found = (int)i;
        if (!last) break;
    }
    return found;
}

bool parameter_needed(const Parameter *p)
{
    return !p->optional && !p->default_text && !(p->node && p->node->b);
}

int parameter_named(const Callable *callee, Name name)
{
    for (uint32_t i = 0; i < callee->count; i++) {
        if (callee->parameters[i].name == name) return (int)i;
    }
    return -1;
}

// --- what is missing, and rules of single built-ins

void call_check_missing(Calling *k)
{
    const char *all = NULL, *named = NULL;
    for (uint32_t i = 0; i < k->callee->count; i++) {
        const Parameter *p = &k->callee->parameters[i];
        if (k->call->bound[i].how != BOUND_DEFAULT || !parameter_needed(p)) continue;
        named = arena_printf(&k->c->scratch, "%s%s%s:", all ? named : "", all ? " …, " : "", p->name);
        all = all ? arena_printf(&k->c->scratch, "%s, %s", all, p->name) : p->name;
    }
    if (!all) return;
    k->bad = true;
    diag(k->c->unit, k->node->name_span, DIAG_MISSING_ARGUMENT, "%s needs %s: write %s(%s …)", k->callee->name, all,
         k->callee->name, named);
}

static bool given(const Calling *k, const char *name)
{
    for (uint32_t i = 0; i < k->callee->count; i++) {
        if (!strcmp(k->callee->parameters[i].name, name)) return k->call->bound[i].how != BOUND_DEFAULT;
    }
    return false;
}

static void check_light(const Calling *k)
{
    Unit *unit = k->c->unit;
    Span span = k->node->name_span;
    bool direction = given(k, "direction"), at = given(k, "at"), cone = given(k, "cone");
    if (!direction && !at) {
        diag(unit, span, DIAG_MISSING_ARGUMENT,
             "light needs direction (the way the light travels) or at (a point light), or both and a cone (a spot)");
    } else if (direction && at && !cone) {
        diag(unit, span, DIAG_MISSING_ARGUMENT, "a light with both direction and at is a spot: write cone: 40deg too");
    } else if (cone && !(direction && at)) {
        diag(unit, span, DIAG_MISSING_ARGUMENT, "a light with a cone is a spot: it needs %s too",
             direction ? "at, where it stands,"
             : at      ? "direction, where it looks,"
                       : "direction and at");
    } else if (given(k, "soft") && !cone) {
        diag(unit, span, DIAG_MISSING_ARGUMENT, "soft is the rim of a spot's light: write direction, at and cone too");
    } else if (given(k, "fade") && !at) {
        diag(unit, span, DIAG_MISSING_ARGUMENT,
             "the light of a direction comes from infinitely far and does not fade: write at instead");
    }
}

void call_check_rules(Calling *k)
{
    Unit *unit = k->c->unit;
    Span span = k->node->name_span;
    switch (k->callee->id) {
    case BUILTIN_PERTURB:
        if (given(k, "strength") + given(k, "height") + given(k, "depth") > 1) {
            diag(unit, span, DIAG_DUPLICATE_ARGUMENT,
                 "strength, height and depth say the same thing: give one of them");
        }
        break;
    case BUILTIN_LIGHT: check_light(k); break;
    case BUILTIN_SCENE:
        if (k->c->body->symbol || k->c->body->block) {
            diag(unit, span, DIAG_MISPLACED,
                 "scene { … } stands in the file, and nothing is made of it: say union or object here");
        }
        break;
    default: break;
    }
}

// `on` says the whole place of a tool.
void call_check_place(Calling *k)
{
    if (given(k, "on") && (given(k, "at") || given(k, "normal")))
        diag(k->c->unit, k->node->name_span, DIAG_DUPLICATE_ARGUMENT,
             "on says where %s works and where outward is: leave out at and normal", k->callee->name);
}

// --- what people write in place of a call

static bool is_tool(const Callable *callee)
{
    return callee->kind == CALLABLE_TOOL;
}

// sphere(1).bump(at: …)
static bool report_tool_behind_shape(Calling *k)
{
    if (!is_tool(k->callee) || !k->receiver || !(type_is_field(*k->receiver) || type_is(*k->receiver, TYPE_PATCH)))
        return false;
    diag(k->c->unit, k->node->name_span, DIAG_TYPE_MISMATCH,
         "%s changes the surface of what it stands in: write freeform(%s) { %s(at: …); }", k->callee->name,
         type_is(*k->receiver, TYPE_QUADRIC) ? "sphere(1)" : "a", k->callee->name);
    return true;
}

// bump((0, 0, 1), 0.3): the place is no parameter of the tool's own.
static bool report_place_without_name(Calling *k)
{
    if (!is_tool(k->callee) || k->receiver || !k->positional) return false;
    const Argument *a = &k->arguments[0];
    const Parameter *p = k->callee->count ? &k->callee->parameters[0] : NULL;
    if (!type_is(a->type, TYPE_VEC3) || !p || type_is_vector(p->type) || p->type.list) return false;
    Diag *d = diag(k->c->unit, a->span, DIAG_TYPE_MISMATCH,
                   "the place of a tool has its name: write %s(at: (x, y, z)), behind what has none", k->callee->name);
    if (k->positional == 1) diag_fix(k->c->unit, d, (Span){a->span.begin, a->span.begin}, FIX_LIKELY, "at: ");
    return true;
}

// rotate((0, 90, 0)): the three angles of other languages.
static bool report_turn_by_vector(Calling *k)
{
    uint32_t first = k->receiver ? 1 : 0;
    if (k->callee->kind != CALLABLE_BUILTIN || strcmp(k->callee->name, "rotate") != 0 || k->node->c) return false;
    if (k->count != first + 1 || k->arguments[first].name || !type_is_vector(k->arguments[first].type)) return false;
    const Node *node = k->arguments[first].node;
    const char *angles = NULL;
    for (const Node *part = node->kind == NODE_VECTOR ? node->a : NULL; part; part = part->next) {
        bool plain = part->kind == NODE_NUMBER && part->unit == UNIT_NONE;
        if (!plain && part->kind != NODE_NUMBER) return false;
        const Source *source = source_of(&k->c->unit->sources, part->span.begin);
        int length = (int)(part->span.end - part->span.begin);
        const char *text = source->text + (part->span.begin - source->base);
        angles = arena_printf(&k->c->scratch, "%s%s%.*s%s", angles ? angles : "", angles ? ", " : "", length, text,
                              plain ? "deg" : "");
    }
    Diag *d = diag(k->c->unit, k->arguments[first].span, DIAG_MISSING_ARGUMENT,
                   "rotate takes an angle for each axis, rotate(%s), or an axis and an angle, rotate((0, 0, 1), 90deg)",
                   angles ? angles : "0deg, 90deg, 0deg");
    if (angles) diag_fix(k->c->unit, d, k->arguments[first].span, FIX_LIKELY, "%s", angles);
    return true;
}

// freeform { sphere(1); bump(…); }
static bool report_form_without_base(Calling *k)
{
    if (k->callee->kind != CALLABLE_BUILTIN || k->callee->id != BUILTIN_FREEFORM || k->count || !k->node->c)
        return false;
    for (const Node *item = k->node->c->a; item; item = item->next) {
        if (item->kind == NODE_ENTRY) return false; // base: … among them, or a mistake of its own
    }
    diag(k->c->unit, k->node->name_span, DIAG_MISSING_ARGUMENT,
         "the object that freeform changes stands in front of its block: freeform(sphere(1)) { … }");
    return true;
}

bool call_report_habit(Calling *k)
{
    return report_tool_behind_shape(k) || report_place_without_name(k) || report_turn_by_vector(k) ||
           report_form_without_base(k);
}

bool call_report_word(Checker *c, const Callable *first, const Node *argument, uint32_t position)
{
    const Node *word = argument->kind == NODE_ARGUMENT || argument->kind == NODE_ENTRY
                           ? (argument->kind == NODE_ENTRY ? argument->b : argument->a)
                           : argument;
    Name name = argument->kind == NODE_ARGUMENT                                  ? argument->name
                : argument->kind == NODE_ENTRY && argument->a->kind == NODE_NAME ? argument->a->name
                                                                                 : NULL;
    if (word->kind != NODE_NAME || names_find(c, word->name) || lost_name(c->unit, word->name)) return false;
    for (const Callable *callee = first; callee; callee = callee->overload) {
        int at = name ? parameter_named(callee, name) : position < callee->count ? (int)position : -1;
        if (at < 0 || !type_is(callee->parameters[at].type, TYPE_STRING)) continue;
        Diag *d = diag(c->unit, word->span, DIAG_UNKNOWN_NAME, "there is no %s, and %s of %s is a string: write \"%s\"",
                       word->name, callee->parameters[at].name, callee->name, word->name);
        diag_fix(c->unit, d, word->span, FIX_LIKELY, "\"%s\"", word->name);
        return true;
    }
    return false;
}

const char *call_hint_too_many(const Calling *k, uint32_t at)
{
    bool vector = false, color = false;
    for (uint32_t i = 0; i < at; i++) {
        if (i >= k->callee->count || !type_is_number(k->arguments[i].type)) continue;
        vector |= type_is_vector(k->callee->parameters[i].type);
        for (const Callable *other = k->first; other; other = other->overload)
            color |= i < other->count && type_is(other->parameters[i].type, TYPE_COLOR);
    }
    if (color) return ": a color is written #ff8000 or srgb(1, 0.5, 0)";
    if (vector) return ": a vector has parentheses of its own, (0, 0, 1)";
    const Node *a = at ? k->arguments[at - 1].node : NULL, *b = k->arguments[at].node;
    bool digits = a && a->kind == NODE_NUMBER && b->kind == NODE_NUMBER && a->flag && b->unit == UNIT_NONE;
    if (digits && a->span.end + 1 == b->span.begin) return ": the point of a number is `.`";
    return "";
}
