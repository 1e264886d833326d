// Files: their definitions, functions, values, and the prelude.
//
// Names of a file are seen in all of it, so a definition is checked when it is first wanted: check_symbol(). A chain
// of definitions that each want one further down could be as long as the file. Once the stack has grown by
// RECURSION_BYTES the rest of the chain is therefore put in order by a loop (order_and_check) and checked from its
// end, where nothing waits any more.
#include "compiler/check.h"

#include <assert.h>
#include <string.h>

#include "compiler/checker.h"
#include "compiler/synonyms.h"
#include "stdlib_text.h"

enum { RECURSION_BYTES = 1 << 20 };

// --- bodies

void body_enter(Checker *c, Body *body, Symbol *symbol, Module *module)
{
    *body = (Body){.id = ++c->body_count,
                   .scope = ++c->scope_count,
                   .symbol = symbol,
                   .module = module,
                   .quiet = !module || module->quiet,
                   .outer = c->body};
    c->body = body;
}

void body_leave(Checker *c)
{
    c->body = c->body->outer;
}

void need(Checker *c, Symbol *symbol)
{
    Symbol *by = c->body->symbol;
    // Of local names only those from outside of the definition: others are not there before it is evaluated.
    if (by && !symbol->global && (by->global || symbol->slot >= by->slot)) return;
    if (!by || c->body->conditional || (by->need_count && by->needs[by->need_count - 1] == symbol)) return;
    if (by->need_count == by->need_capacity) {
        uint32_t capacity = by->need_capacity ? by->need_capacity * 2 : 2;
        Symbol **needs = arena_array(&c->unit->arena, Symbol *, capacity);
        if (by->need_count) memcpy(needs, by->needs, by->need_count * sizeof *needs);
        by->needs = needs;
        by->need_capacity = capacity;
    }
    by->needs[by->need_count++] = symbol;
}

// --- types and signatures

Type check_type(Checker *c, const Node *node)
{
    Type type;
    if (!node || node->kind != NODE_TYPE) return poison();
    if (node->a) {
        type = check_type(c, node->a);
        return type_bad(type) ? type : type_list(type);
    }
    if (type_named(node->name, &type)) return type;
    int count = 0;
    while (type_names[count]) count++;
    const char *near = nearest_name(node->name, type_names, count);
    if (!near && (!strcmp(node->name, "float") || !strcmp(node->name, "number") || !strcmp(node->name, "double")))
        near = "scalar";
    Diag *d =
        near ? diag(c->unit, node->span, DIAG_UNKNOWN_NAME, "there is no type %s: do you mean %s?", node->name, near)
             : diag(c->unit, node->span, DIAG_UNKNOWN_NAME,
                    "there is no type %s: the types are bool, int, scalar, angle, time, vec2, "
                    "vec3, color, string, range, quadric, object, perturbation, material and lists of them",
                    node->name);
    if (near) diag_fix(c->unit, d, node->span, FIX_LIKELY, "%s", near);
    return poison();
}

static void add_tool_parameters(Checker *c, Callable *callable)
{
    static const struct {
        const char *name;
        Type type;
    } places[TOOL_PARAMETERS] = {
        [TOOL_AT] = {"at", {.kind = TYPE_VEC3}},
        [TOOL_NORMAL] = {"normal", {.kind = TYPE_VEC3}},
        [TOOL_ON] = {"on", {.kind = TYPE_PLACE}},
        [TOOL_TURN] = {"turn", {.kind = TYPE_NUMBER, .angle = 1}},
    };
    for (int i = 0; i < TOOL_PARAMETERS; i++) {
        Parameter *p = &callable->parameters[callable->count];
        *p = (Parameter){.name = name_text(&c->unit->names, places[i].name),
                         .type = places[i].type,
                         .optional = true,
                         .default_from = -1};
        for (uint32_t k = 0; k < callable->count; k++) {
            if (callable->parameters[k].name != p->name) continue;
            diag(c->unit, callable->parameters[k].node->name_span, DIAG_REDEFINED,
                 "every tool has the argument %s, its place on the surface: choose another name", p->name);
        }
        callable->count++;
    }
}

// Choices that are written as plain strings are known at once, as those of built-ins are.
static const char *const *plain_choices(Checker *c, const Node *list)
{
    if (!list || list->kind != NODE_LIST) return NULL;
    int count = 0;
    for (const Node *one = list->a; one; one = one->next, count++) {
        bool plain = one->kind == NODE_STRING && one->a && one->a->kind == NODE_TEXT && !one->a->next;
        if (!plain) return NULL;
    }
    const char **choices = arena_array(&c->unit->arena, const char *, count + 1);
    count = 0;
    for (const Node *one = list->a; one; one = one->next) choices[count++] = one->a->text;
    return choices;
}

static Callable *signature(Checker *c, Node *node, bool prelude)
{
    Callable *callable = arena_new(&c->unit->arena, Callable);
    callable->name = node->name;
    callable->kind = node->kind == NODE_FN ? CALLABLE_FN : node->kind == NODE_TAG ? CALLABLE_TAG : CALLABLE_TOOL;
    callable->prelude = prelude;
    callable->node = node;
    uint32_t most = TOOL_PARAMETERS;
    for (const Node *p = node->a; p; p = p->next) most++;
    callable->parameters = arena_array(&c->unit->arena, Parameter, most);
    for (Node *n = node->a; n; n = n->next) {
        callable->lost |= n->kind == NODE_ERROR || (n->kind == NODE_PARAMETER && n->a && n->a->kind == NODE_ERROR);
        if (n->kind != NODE_PARAMETER) continue;
        Parameter *p = &callable->parameters[callable->count++];
        *p = (Parameter){.name = n->name,
                         .type = check_type(c, n->a),
                         .doc = n->doc,
                         .node = n,
                         .default_from = -1,
                         .choices = plain_choices(c, n->c)};
    }
    if (callable->kind == CALLABLE_TOOL) add_tool_parameters(c, callable);
    callable->declared = node->kind != NODE_FN || node->b;
    if (node->b)
        callable->result = check_type(c, node->b);
    else if (node->kind == NODE_TAG)
        callable->result = type_of(TYPE_OBJECT);
    else if (node->kind == NODE_TOOL)
        callable->result = type_of(TYPE_PERTURBATION);
    return callable;
}

// --- what a definition checks

// `in` of a parameter: a range, or a list of choices.
static void check_limits(Checker *c, Node *limits, Type type, Name name)
{
    if (!limits || type_bad(type)) return;
    Type have = check_expr(c, limits);
    if (type_bad(have)) return;
    if (have.list) {
        if (!type_converts(have, type_list(type))) {
            diag(c->unit, limits->span, DIAG_TYPE_MISMATCH, "the choices for %s are %s, and these are %s", name,
                 type_text(&c->unit->arena, type_list(type)), type_text(&c->unit->arena, have));
        }
        return;
    }
    Type range = type;
    range.kind = TYPE_RANGE;
    if (type_is_numeric(type))
        expect(c, limits, have, range, arena_printf(&c->scratch, "what follows in, for %s,", name));
    else
        diag(c->unit, limits->span, DIAG_TYPE_MISMATCH, "the choices for %s are a list: write in [ … ]", name);
}

static void check_parameters(Checker *c, Callable *callable)
{
    for (uint32_t i = 0; i < callable->count; i++) {
        Parameter *p = &callable->parameters[i];
        if (!p->node) continue; // of a tool's place
        if (p->node->b) check_as(c, p->node->b, p->type, arena_printf(&c->scratch, "the default of %s", p->name));
        check_limits(c, p->node->c, p->type, p->name);
        p->symbol = names_local(c, SYMBOL_PARAMETER, p->name, p->node->name_span, p->node, p->type);
    }
}

static void check_callable(Checker *c, Symbol *symbol, Callable *callable)
{
    const Node *node = callable->node;
    callable->state = CHECK_NOW;
    Body body;
    body_enter(c, &body, symbol, symbol->module);
    body.conditional = 1; // what it needs is needed by its calls, not by its definition
    BlockScope scope;
    uint32_t mark = names_open(c, &scope, NULL);
    check_parameters(c, callable);
    static const char *const words[] = {[CALLABLE_FN] = "fn", [CALLABLE_TAG] = "tag", [CALLABLE_TOOL] = "tool"};
    Type result = callable->result;
    Values values = {.known = callable->declared,
                     .want = result,
                     .what = arena_printf(&c->scratch, "the %s %s", words[callable->kind], callable->name)};
    bool sums = type_is(result, TYPE_PERTURBATION) || type_is(result, TYPE_OBJECT);
    if (result.list) {
        values.many = true;
        values.want = type_element(result);
    } else if (sums && callable->kind != CALLABLE_FN) {
        values.many = true;
    }
    Type type = check_block(c, node->c, &values);
    if (!callable->declared) {
        callable->result = type;
        callable->result.zero = false;
    }
    names_close(c, mark);
    callable->slots = body.slots;
    body_leave(c);
    callable->state = CHECK_DONE;
}

static void check_param(Checker *c, Symbol *symbol)
{
    static const TypeKind allowed[] = {TYPE_BOOL, TYPE_INT, TYPE_STRING, TYPE_NUMBER, TYPE_VEC2, TYPE_VEC3, TYPE_COLOR};
    const Node *p = symbol->node->a;
    symbol->type = check_type(c, p->a);
    bool good = type_bad(symbol->type);
    for (size_t i = 0; i < sizeof allowed / sizeof *allowed; i++) good |= type_is(symbol->type, allowed[i]);
    if (!good) {
        diag(c->unit, p->a->span, DIAG_TYPE_MISMATCH,
             "a param is a bool, int, string, scalar, angle, time, vec2, vec3 or color, and this is %s",
             type_phrase(&c->unit->arena, symbol->type));
        symbol->type = poison();
    }
    if (p->b) {
        check_as(c, p->b, symbol->type, arena_printf(&c->scratch, "the default of %s", p->name));
    } else {
        diag(c->unit, p->name_span, DIAG_MISSING_ARGUMENT, "a param needs a value to start with: write %s: %s = …",
             p->name, type_text(&c->unit->arena, symbol->type));
    }
    check_limits(c, p->c, symbol->type, p->name);
}

static void report_cycle(Checker *c, Symbol *symbol)
{
    const char *color = synonym_of(symbol->name, NULL, 0); // material red { color: red; }
    Diag *d = color && color[0] == '#'
                  ? diag(c->unit, symbol->span, DIAG_CYCLIC_DEFINITION,
                         "%s is made of itself: the color of that name is written %s", symbol->name, color)
                  : diag(c->unit, symbol->span, DIAG_CYCLIC_DEFINITION,
                         "%s is made of itself: something in it must not be", symbol->name);
    enum { LABELS_MAX = 6 };
    int labels = 0;
    for (const Body *body = c->body; body && body->symbol != symbol && labels < LABELS_MAX; body = body->outer) {
        if (!body->symbol || !body->symbol->span.end) continue;
        diag_label(c->unit, d, body->symbol->span, "by way of %s", body->symbol->name);
        labels++;
    }
}

void check_now(Checker *c, Symbol *symbol)
{
    symbol->state = CHECK_NOW;
    Body body;
    switch (symbol->kind) {
    case SYMBOL_CALLABLE:
        for (Callable *callable = symbol->callable; callable; callable = callable->overload)
            check_callable(c, symbol, callable);
        break;
    case SYMBOL_PARAM:
        body_enter(c, &body, symbol, symbol->module);
        check_param(c, symbol);
        symbol->slots = body.slots;
        body_leave(c);
        break;
    default:
        assert(symbol->kind == SYMBOL_LET && "only what stands in a file is checked on demand");
        body_enter(c, &body, symbol, symbol->module);
        symbol->type = check_definition(c, (Node *)symbol->node, &symbol->value);
        symbol->slots = body.slots;
        body_leave(c);
    }
    symbol->state = CHECK_DONE;
}

// --- the order

typedef struct Order {
    Checker *c;
    Module *module; // of the symbol whose definition is walked
    Symbol **stack;
    uint32_t count, capacity;
} Order;

static void order_push(Order *order, Symbol *symbol)
{
    if (order->count == order->capacity) {
        uint32_t capacity = order->capacity ? order->capacity * 2 : 256;
        Symbol **stack = arena_array(&order->c->scratch, Symbol *, capacity);
        if (order->count) memcpy(stack, order->stack, order->count * sizeof *stack);
        order->stack = stack;
        order->capacity = capacity;
    }
    order->stack[order->count++] = symbol;
}

// `link` is what follows the name behind a dot, since that is looked up in it where it is a library; or NULL.
static void order_name(Order *order, Name name, const Node *link)
{
    Body *inner = order->c->body, file = {.id = 0, .module = order->module};
    order->c->body =
        &file; // so that only names of the file are found; that a local one may hide them does no harm here
    Symbol *symbol = names_find(order->c, name);
    order->c->body = inner;
    if (symbol && symbol->kind == SYMBOL_LIBRARY && link) symbol = names_in(order->c, symbol->opens, link->name);
    if (symbol && symbol->global && symbol->state == CHECK_NOT && !symbol->visited) order_push(order, symbol);
}

// All names in a tree, along chains by a loop.
static void order_walk(Order *order, const Node *list)
{
    for (; list; list = list->next) {
        for (const Node *node = list;;) {
            if (node->kind == NODE_NAME || node->kind == NODE_CALL) order_name(order, node->name, NULL);
            if (node->kind == NODE_DECLARE) order_name(order, node->word, NULL);
            bool dot = node->kind == NODE_CALL || node->kind == NODE_MEMBER;
            if (dot && node->a && (node->a->kind == NODE_NAME || node->a->kind == NODE_MEMBER))
                order_name(order, node->a->name, node);
            order_walk(order, node->b);
            order_walk(order, node->c);
            if (!node_is_link(node)) {
                order_walk(order, node->a);
                break;
            }
            if (!node->a) break;
            node = node->a;
        }
    }
}

static void order_and_check(Checker *c, Symbol *first)
{
    Order order = {.c = c};
    order_push(&order, first);
    while (order.count) {
        Symbol *symbol = order.stack[order.count - 1];
        if (symbol->state == CHECK_NOT && !symbol->visited) {
            symbol->visited = true;
            order.module = symbol->module;
            order_walk(&order, symbol->node->a);
            order_walk(&order, symbol->node->c);
            continue;
        }
        order.count--;
        if (symbol->state == CHECK_NOT) check_now(c, symbol);
        symbol->visited = false;
    }
}

void check_symbol(Checker *c, Symbol *symbol)
{
    bool callable = symbol->kind == SYMBOL_CALLABLE;
    if (symbol->state == CHECK_DONE || (callable && symbol->callable->kind == CALLABLE_BUILTIN)) return;
    // A body whose result is known need not be looked at for a call of it.
    if (callable && symbol->callable->declared && !symbol->callable->prelude) return;
    if (symbol->state == CHECK_NOW) {
        if (callable && symbol->callable->declared) return;
        if (callable) {
            diag(c->unit, symbol->span, DIAG_MISSING_TYPE,
                 "%s calls itself, so its result type must be written: fn %s(…) -> scalar { … }", symbol->name,
                 symbol->name);
            symbol->callable->declared = true;
            symbol->callable->result = poison();
        } else {
            report_cycle(c, symbol);
            symbol->type = poison();
        }
        return;
    }
    if (symbol->global && !symbol->visited && stack_used(c->stack) > RECURSION_BYTES) order_and_check(c, symbol);
    if (symbol->state == CHECK_NOT) check_now(c, symbol);
}

// --- files

static void add_item(Checker *c, Node *node, Symbol *symbol)
{
    if (c->module->library) return; // what it shows itself is left out
    Program *program = c->program;
    if (program->count == program->capacity) {
        uint32_t capacity = program->capacity ? program->capacity * 2 : 64;
        Symbol **items = arena_array(&c->unit->arena, Symbol *, capacity);
        Node **nodes = arena_array(&c->unit->arena, Node *, capacity);
        if (program->count) {
            memcpy(items, program->items, program->count * sizeof *items);
            memcpy(nodes, program->nodes, program->count * sizeof *nodes);
        }
        program->items = items;
        program->nodes = nodes;
        program->capacity = capacity;
    }
    if (symbol) symbol->order = program->count;
    program->nodes[program->count] = node;
    program->items[program->count++] = symbol;
}

void collect_file(Checker *c, Node *file)
{
    for (Node *node = file->a; node; node = node->next) {
        Symbol *symbol = NULL;
        switch (node->kind) {
        case NODE_INCLUDE:
            if (node->a) collect_file(c, node->a);
            continue;
        case NODE_USE: modules_use(c, node); continue;
        case NODE_PARAM:
            if (node->a->kind != NODE_PARAMETER) continue;
            symbol = names_global(c, SYMBOL_PARAM, node->a->name, node->a->name_span, node);
            break;
        case NODE_FN:
        case NODE_TAG:
        case NODE_TOOL:
            symbol = names_global(c, SYMBOL_CALLABLE, node->name, node->name_span, node);
            symbol->callable = signature(c, node, c->module->quiet);
            break;
        case NODE_LET:
        case NODE_DECLARE: symbol = names_global(c, SYMBOL_LET, node->name, node->name_span, node); break;
        case NODE_ERROR:
        case NODE_VERSION: continue;
        default: break;
        }
        if (symbol) node->note = symbol;
        add_item(c, node, symbol);
    }
}

static void check_file_item(Checker *c, Node *node)
{
    Values values = {.many = true, .file = true, .what = "a file"};
    Body body;
    body_enter(c, &body, NULL, c->program->modules);
    check_item(c, node, &values);
    if (body.slots > c->program->slots) c->program->slots = body.slots;
    body_leave(c);
}

static void load_prelude(Checker *c)
{
    Unit *unit = c->unit;
    for (const stdlib_text_file *file = stdlib_text_files; file->name; file++) {
        Source *source = source_add(&unit->sources, file->name, (const char *)file->text, file->length, (Span){0});
        if (!source) return; // the texts before fill the space of positions, which was reported
        source->prelude = source->library = true;
        for (Node *node = parse_source(unit, source)->a; node; node = node->next) {
            if (node->kind != NODE_FN && node->kind != NODE_TAG && node->kind != NODE_TOOL) continue;
            Symbol *symbol = names_prelude(c, node->name);
            Callable **end = &symbol->callable;
            while (*end) end = &(*end)->overload;
            *end = signature(c, node, true);
            symbol->node = node;
        }
    }
}

void check(Unit *unit, Node *tree)
{
    Checker checker = {.unit = unit, .stack = __builtin_frame_address(0)}, *c = &checker;
    c->program = arena_new(&unit->arena, Program);
    c->program->unit = unit;
    tree->note = c->program;
    names_builtin(c);
    load_prelude(c);
    modules_begin(c, tree);
    modules_bind(c);
    for (uint32_t i = 0; i < c->program->count; i++) {
        Symbol *symbol = c->program->items[i];
        if (!symbol)
            check_file_item(c, c->program->nodes[i]);
        else if (symbol->state == CHECK_NOT)
            check_now(c, symbol);
    }
    modules_check(c);
    modules_reach(c, tree);
    modules_report_unused(c, tree);
    arena_release(&c->scratch);
}
