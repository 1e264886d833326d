// The scene: params, definitions, what files show, and what is missing.
//
// Definitions are evaluated when they are first wanted (force). Like in check.c a chain of them may be as long as the
// file: when the stack has grown by RECURSION_BYTES, what a definition needs for certain (Symbol.needs, found by
// check()) is evaluated first, by a loop.
#include "compiler/elaborate.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/alone.h"
#include "compiler/evaluator.h"

enum { RECURSION_BYTES = 1 << 20 };

typedef struct Shown { // what the files' values and declarations add up to
    List objects, lights;
    Value camera; // the first
    Value background;
    Span background_span, animation_span;
} Shown;

// --- slots

void slots_push(Eval *e, uint32_t count)
{
    if (e->slot_count + count > e->slot_capacity) {
        uint32_t capacity = (e->slot_count + count) * 2 + 64;
        Slot *slots = arena_array(&e->scratch, Slot, capacity);
        if (e->slot_count) memcpy(slots, e->slots, e->slot_count * sizeof *slots);
        e->slots = slots;
        e->slot_capacity = capacity;
    }
    if (count) memset(e->slots + e->slot_count, 0, count * sizeof *e->slots);
    e->slot_count += count;
}

void slots_pop(Eval *e, uint32_t count)
{
    e->slot_count -= count;
}

// --- definitions

static Value named_value(Eval *e, const Symbol *symbol, Value value)
{
    if (value_is_bad(&value)) return value_bad();
    value = value_convert(&e->scratch, value, symbol->type);
    if (type_is(value.type, TYPE_PATCH)) name_patch(e, value.id, symbol->name);
    if (symbol->node->kind != NODE_DECLARE || !type_is(value.type, TYPE_OBJECT)) return value;
    return value_node(TYPE_OBJECT, ir_node_text(e->ir, OP_NAMED, symbol->span, &value.id, 1, symbol->name));
}

typedef struct Context { // where evaluation stands
    uint32_t base, order;
    Frame *frame;
    const Forming *forming;
    const Loop *loop;
    Scalar path;
    Span site;
} Context;

static Context context_enter(Eval *e, uint32_t slots, uint32_t order)
{
    Context before = {e->base, e->order, e->frame, e->forming, e->loop, e->path, e->site};
    e->base = e->slot_count;
    e->order = order;
    e->frame = NULL;
    e->forming = NULL;
    e->loop = NULL;
    e->path = scalar_of(1);
    e->site = (Span){0};
    slots_push(e, slots);
    return before;
}

static void context_leave(Eval *e, uint32_t slots, Context before)
{
    slots_pop(e, slots);
    e->base = before.base;
    e->order = before.order;
    e->frame = before.frame;
    e->forming = before.forming;
    e->loop = before.loop;
    e->path = before.path;
    e->site = before.site;
}

static Value make_param(Eval *e, const Symbol *symbol);

static Value force_global(Eval *e, Symbol *symbol)
{
    symbol->progress = CHECK_NOW;
    Context before = context_enter(e, symbol->slots, symbol->order);
    Value *memo = arena_new(&e->scratch, Value);
    if (symbol->kind == SYMBOL_PARAM)
        *memo = make_param(e, symbol);
    else
        *memo = named_value(e, symbol, eval_expr(e, symbol->value));
    context_leave(e, symbol->slots, before);
    symbol->memo = memo;
    symbol->progress = CHECK_DONE;
    return *memo;
}

static Value force_local(Eval *e, const Symbol *symbol)
{
    const Forming *forming = e->forming;
    e->forming = e->slots[e->base + symbol->slot].forming;
    Value value = named_value(e, symbol, eval_expr(e, symbol->value));
    e->forming = forming;
    e->slots[e->base + symbol->slot] = (Slot){.value = value};
    return value;
}

static bool is_pending(const Eval *e, const Symbol *symbol)
{
    if (symbol->kind != SYMBOL_LET && symbol->kind != SYMBOL_PARAM) return false;
    return symbol->global ? symbol->progress == CHECK_NOT : e->slots[e->base + symbol->slot].pending;
}

static Value force_now(Eval *e, Symbol *symbol)
{
    return symbol->global ? force_global(e, symbol) : force_local(e, symbol);
}

// Evaluates what `first` needs for certain, the deepest first, and then `first`.
static void force_in_order(Eval *e, Symbol *first)
{
    uint32_t capacity = 256, count = 0;
    Symbol **stack = arena_array(&e->scratch, Symbol *, capacity);
    stack[count++] = first;
    while (count) {
        Symbol *symbol = stack[count - 1];
        if (is_pending(e, symbol) && !symbol->visited) {
            symbol->visited = true;
            if (count + symbol->need_count > capacity) {
                capacity = (count + symbol->need_count) * 2;
                Symbol **larger = arena_array(&e->scratch, Symbol *, capacity);
                memcpy(larger, stack, count * sizeof *larger);
                stack = larger;
            }
            // Local names of another frame cannot be wanted here: a file's definition needs only those of files.
            for (uint32_t i = 0; i < symbol->need_count; i++) {
                Symbol *need = symbol->needs[i];
                if ((need->global || !symbol->global) && is_pending(e, need) && !need->visited) stack[count++] = need;
            }
            continue;
        }
        count--;
        if (is_pending(e, symbol)) force_now(e, symbol);
        symbol->visited = false;
    }
}

Value force(Eval *e, Symbol *symbol)
{
    if (symbol->global && symbol->memo) return *symbol->memo;
    if (!symbol->global && !e->slots[e->base + symbol->slot].pending) return e->slots[e->base + symbol->slot].value;
    if (symbol->global && symbol->progress == CHECK_NOW) {
        diag(e->unit, symbol->span, DIAG_CYCLIC_DEFINITION, "%s is made of itself, by way of what it calls",
             symbol->name);
        return value_bad();
    }
    if (!symbol->visited && stack_used(e->stack) > RECURSION_BYTES) {
        force_in_order(e, symbol);
        return force(e, symbol);
    }
    return force_now(e, symbol);
}

// --- params

static ParamType param_type(Type type)
{
    switch (type.kind) {
    case TYPE_BOOL: return PARAM_BOOL;
    case TYPE_INT: return PARAM_INT;
    case TYPE_STRING: return PARAM_STRING;
    case TYPE_VEC2: return PARAM_VEC2;
    case TYPE_VEC3: return PARAM_VEC3;
    case TYPE_COLOR: return PARAM_COLOR;
    default: return type.angle ? PARAM_ANGLE : type.time ? PARAM_TIME : PARAM_SCALAR;
    }
}

static bool const_value(Eval *e, const Node *node, const Value *value, const char *what)
{
    if (value_is_bad(value)) return false;
    if (!value_varying(value)) return true;
    report_rate(e, node, DIAG_SHAPE_RATE, what);
    return false;
}

static void param_limits(Eval *e, const Node *limits, IrParam *param)
{
    if (!limits) return;
    Value value = eval_expr(e, limits);
    if (!const_value(e, limits, &value, "what a param may be")) return;
    if (!value.type.list) {
        param->low = value.vector[0].number;
        param->high = value.vector[1].number;
        param->ranged = param->low <= param->high;
        if (!param->ranged)
            complain(e, limits, DIAG_OUT_OF_RANGE, "a range goes up: write low .. high, and this is %s",
                     value_text(&e->scratch, &value, 6));
        return;
    }
    const char **choices = arena_array(&e->unit->arena, const char *, value.list.count + 1);
    for (uint32_t i = 0; i < value.list.count; i++) {
        const Value *choice = &value.list.items[i];
        if (!const_value(e, limits, choice, "what a param may be")) return;
        ParamValue v = {.text = type_is(choice->type, TYPE_STRING) ? choice->string : NULL};
        for (int k = 0; k < value_size(choice->type); k++) v.number[k] = value_part(choice, k).number;
        choices[i] = param_text(&e->unit->arena, (ParamType)param->type, &v);
    }
    param->choices = choices;
}

static const Define *define_of(const Eval *e, const char *name)
{
    const Define *found = NULL;
    for (int i = 0; i < e->options->define_count; i++) {
        if (!strcmp(e->options->defines[i].name, name)) found = &e->options->defines[i];
    }
    return found;
}

// The default, or what the command line says instead.
static bool param_default(Eval *e, const Symbol *symbol, IrParam *param, ParamValue *result)
{
    const Node *node = symbol->node->a->b;
    Value value = value_convert(&e->scratch, eval_expr(e, node), symbol->type);
    if (!const_value(e, node, &value, "the default of a param")) return false;
    *result = (ParamValue){.text = type_is(value.type, TYPE_STRING) ? value.string : NULL};
    for (int k = 0; k < value_size(value.type); k++) result->number[k] = value_part(&value, k).number;
    const char *wrong = param_test(&e->unit->arena, param, result);
    if (wrong)
        complain(e, node, param->choices ? DIAG_UNKNOWN_CHOICE : DIAG_OUT_OF_RANGE, "the default of %s: %s",
                 symbol->name, wrong);
    const Define *define = define_of(e, param->name);
    if (!define) return !wrong;
    wrong = param_parse(&e->unit->arena, param, define->text, result);
    if (wrong && !e->options->wrong)
        e->options->wrong = arena_printf(&e->unit->arena, "param %s: %s", param->name, wrong);
    return !wrong;
}

// The value of a param: known if it is structure, else the handle's slots.
static Value make_param(Eval *e, const Symbol *symbol)
{
    IrParam *param = &e->ir->params[symbol->slot];
    const Node *node = symbol->node->a;
    ParamValue value;
    param_limits(e, node->c, param);
    if (!param_default(e, symbol, param, &value)) return value_bad();
    memcpy(param->value, value.number, sizeof param->value);
    param->text = value.text;
    int size = param_size((ParamType)param->type);
    if (size == 0) return value_string(value.text);
    Scalar parts[3];
    for (int k = 0; k < size; k++) {
        if (param->structure)
            parts[k] = scalar_of(value.number[k]);
        else
            parts[k] =
                (Scalar){.id = ir_node_index(e->ir, OP_PARAM, node->name_span, NULL, 0, param->slot + (uint32_t)k)};
    }
    return size == 1 ? value_scalar(symbol->type, parts[0]) : value_vector(&e->unit->arena, symbol->type, parts, size);
}

static bool is_param(const Module *module, const Symbol *symbol)
{
    return symbol->kind == SYMBOL_PARAM && (!module->library || symbol->reached);
}

static void list_param(Eval *e, const Module *module, Symbol *symbol)
{
    Ir *ir = e->ir;
    const Node *node = symbol->node->a;
    ParamType type = param_type(symbol->type);
    bool structure = type == PARAM_BOOL || type == PARAM_INT || type == PARAM_STRING;
    symbol->slot = ir->param_count;
    ir->params[ir->param_count++] = (IrParam){
        .name = module->library ? arena_printf(&e->unit->arena, "%s.%s", module->name, symbol->name) : symbol->name,
        .doc = node->doc ? node->doc : symbol->node->doc,
        .type = (uint8_t)type,
        .structure = structure,
        .slot = structure ? 0 : ir->input_count,
        .span = symbol->span};
    if (!structure) ir->input_count += (uint32_t)param_size(type);
}

// Lists the params in the order of the text, so that slots are the same whatever is wanted first: those of the scene,
// and behind them those of libraries that something uses.
static void list_params(Eval *e)
{
    uint32_t count = 0;
    for (const Module *m = e->program->modules; m; m = m->next) {
        for (const Symbol *symbol = m->first; symbol; symbol = symbol->next) count += is_param(m, symbol);
    }
    e->ir->params = arena_array(e->ir->arena, IrParam, count);
    for (const Module *m = e->program->modules; m; m = m->next) {
        for (Symbol *symbol = m->first; symbol; symbol = symbol->next) {
            if (is_param(m, symbol)) list_param(e, m, symbol);
        }
    }
    for (const Module *m = e->program->modules; m; m = m->next) {
        for (Symbol *symbol = m->first; symbol; symbol = symbol->next) {
            if (is_param(m, symbol)) force(e, symbol);
        }
    }
}

static void check_defines(Eval *e)
{
    for (int i = 0; i < e->options->define_count && !e->options->wrong; i++) {
        const char *name = e->options->defines[i].name;
        bool known = false;
        for (uint32_t k = 0; k < e->ir->param_count; k++) known |= !strcmp(e->ir->params[k].name, name);
        if (known) continue;
        const char *near = param_nearest(e->ir, name);
        e->options->wrong =
            near ? arena_printf(&e->unit->arena, "the scene has no param %s: do you mean %s?", name, near)
                 : arena_printf(&e->unit->arena, "the scene has no param %s", name);
    }
}

// --- what is shown

static void show(Eval *e, Shown *shown, const Node *node, Value value)
{
    if (value_is_bad(&value)) return;
    if (value.type.list) {
        for (uint32_t i = 0; i < value.list.count; i++) show(e, shown, node, value.list.items[i]);
        return;
    }
    switch (value.type.kind) {
    case TYPE_QUADRIC:
    case TYPE_PATCH:
    case TYPE_OBJECT: values_add(e, &shown->objects, value, node); break;
    case TYPE_LIGHT: values_add(e, &shown->lights, value, node); break;
    case TYPE_CAMERA:
        if (!shown->camera.id) shown->camera = value;
        break;
    case TYPE_BACKGROUND:
        if (shown->background.id) {
            Diag *d = diag(e->unit, node->span, DIAG_REDEFINED, "a scene has one background: remove one of them");
            diag_label(e->unit, d, shown->background_span, "the first");
        }
        shown->background = value;
        shown->background_span = node->span;
        break;
    case TYPE_ANIMATION:
        if (e->animation.type.kind == TYPE_ANIMATION && e->animation.vector != value.vector) {
            Diag *d = diag(e->unit, node->span, DIAG_REDEFINED, "a scene has one animation: remove one of them");
            diag_label(e->unit, d, shown->animation_span, "the first");
        }
        e->animation = value;
        shown->animation_span = node->span;
        break;
    default: break;
    }
}

static bool belongs_to_scene(Type type)
{
    return type.kind == TYPE_LIGHT || type.kind == TYPE_CAMERA || type.kind == TYPE_BACKGROUND ||
           type.kind == TYPE_ANIMATION;
}

static bool is_animation(const Node *node, const Symbol *symbol)
{
    if (symbol) return symbol->kind == SYMBOL_LET && symbol->type.kind == TYPE_ANIMATION;
    if (node->kind != NODE_VALUE || node->a->kind != NODE_CALL || !node->a->note) return false;
    const Callable *callee = ((const Call *)node->a->note)->callee;
    return callee->kind == CALLABLE_BUILTIN && callee->id == BUILTIN_ANIMATION;
}

static void eval_file_item(Eval *e, Shown *shown, uint32_t i)
{
    Node *node = e->program->nodes[i];
    Symbol *symbol = e->program->items[i];
    if (symbol) {
        if (symbol->kind == SYMBOL_LET && belongs_to_scene(symbol->type)) show(e, shown, node, force(e, symbol));
        return;
    }
    List list = {0};
    Context before = context_enter(e, e->program->slots, i);
    eval_item(e, node, type_of(TYPE_ANY), &list);
    context_leave(e, e->program->slots, before);
    for (uint32_t k = 0; k < list.count; k++) show(e, shown, node, list.items[k]);
}

// The animation first, since it says how long a frame is.
static void eval_file(Eval *e, Shown *shown)
{
    const Program *program = e->program;
    for (int turn = 0; turn < 2; turn++) {
        for (uint32_t i = 0; i < program->count && !e->stop; i++) {
            if (is_animation(program->nodes[i], program->items[i]) == (turn == 0)) eval_file_item(e, shown, i);
        }
    }
}

static void choose_camera(Eval *e, Shown *shown)
{
    const char *wanted = e->options->camera;
    if (!wanted) return;
    const Program *program = e->program;
    const char **names = arena_array(&e->scratch, const char *, program->count);
    int count = 0;
    for (uint32_t i = 0; i < program->count; i++) {
        Symbol *symbol = program->items[i];
        if (!symbol || symbol->kind != SYMBOL_LET || !type_is(symbol->type, TYPE_CAMERA)) continue;
        if (!strcmp(symbol->name, wanted)) {
            shown->camera = force(e, symbol);
            return;
        }
        names[count++] = symbol->name;
    }
    if (e->options->wrong) return;
    const char *near = nearest_name(wanted, names, count);
    if (near)
        e->options->wrong = arena_printf(&e->unit->arena, "the scene has no camera %s: do you mean %s?", wanted, near);
    else if (count)
        e->options->wrong = arena_printf(&e->unit->arena, "the scene has no camera %s, but %s", wanted, names[0]);
    else
        e->options->wrong = arena_printf(&e->unit->arena, "the scene has no camera with a name, so no %s", wanted);
}

// The object of the file that is called so, also where nothing shows it. 0: there is none.
static IrId declared(Eval *e, const char *wanted)
{
    for (uint32_t i = 0; i < e->program->count; i++) {
        Symbol *symbol = e->program->items[i];
        if (!symbol || symbol->kind != SYMBOL_LET || !type_is_field(symbol->type) || strcmp(symbol->name, wanted) != 0)
            continue;
        Value value = force(e, symbol);
        return value_is_bad(&value) ? ir_node(e->ir, OP_EMPTY, symbol->span, NULL, 0) : value.id;
    }
    return 0;
}

// `--only`: what is shown under that name, else what is declared under it.
static void choose_objects(Eval *e)
{
    Ir *ir = e->ir;
    const char *wanted = e->options->only;
    if (!wanted || e->options->wrong) return;
    IrId found = alone(ir, ir->root, wanted), object = 0;
    if (!found) {
        e->options->wrong = "the scene has more than 10 million items: use fewer copies";
        return;
    }
    if (ir_at(ir, found)->op == OP_EMPTY) object = declared(e, wanted);
    if (object || ir_at(ir, found)->op != OP_EMPTY) {
        ir->root = object ? object : found;
        return;
    }
    const char **names;
    int count = alone_names(ir, ir->root, e->program->count, &e->scratch, &names);
    for (uint32_t i = 0; i < e->program->count; i++) {
        const Symbol *symbol = e->program->items[i];
        if (symbol && symbol->kind == SYMBOL_LET && type_is_field(symbol->type)) names[count++] = symbol->name;
    }
    const char *near = nearest_name(wanted, names, count);
    e->options->wrong =
        near ? arena_printf(&e->unit->arena, "the scene has no object %s: do you mean %s?", wanted, near)
             : arena_printf(&e->unit->arena, "the scene has no object %s: `scn tree` lists their names", wanted);
}

static void warn_empty(Eval *e, const Node *tree)
{
    const Symbol *object = NULL;
    for (uint32_t i = 0; i < e->program->count; i++) {
        const Symbol *symbol = e->program->items[i];
        if (symbol && symbol->kind == SYMBOL_LET && type_is_field(symbol->type)) object = symbol;
    }
    if (object)
        diag(e->unit, object->span, DIAG_EMPTY_SCENE, "nothing is shown: write scene { %s; }", object->name);
    else
        diag(e->unit, tree->span, DIAG_EMPTY_SCENE, "nothing is shown: write an object, as sphere(1);");
}

// `scn patch` is content with a file that has patches alone.
static bool declares_patches(const Eval *e)
{
    for (uint32_t i = 0; e->options->patches && i < e->program->count; i++) {
        const Symbol *symbol = e->program->items[i];
        if (symbol && symbol->kind == SYMBOL_LET && type_is(symbol->type, TYPE_PATCH)) return true;
    }
    return false;
}

static void assemble(Eval *e, Shown *shown, const Node *tree)
{
    Ir *ir = e->ir;
    bool wrong =
        e->options->wrong || e->unit->errors != e->errors_before; // what is made of that may be what is lacking
    if (!shown->objects.count && !wrong && !e->options->only && !declares_patches(e)) warn_empty(e, tree);
    IrId *ids = arena_array(&e->scratch, IrId, shown->objects.count);
    for (uint32_t i = 0; i < shown->objects.count; i++) ids[i] = shown->objects.items[i].id;
    ir->root = ir_node(ir, OP_UNION, tree->span, ids, shown->objects.count);
    choose_objects(e);
    if (!shown->lights.count) default_lights(e, &shown->lights);
    ir->light_count = shown->lights.count;
    ir->lights = arena_array(ir->arena, IrId, ir->light_count);
    for (uint32_t i = 0; i < ir->light_count; i++) ir->lights[i] = shown->lights.items[i].id;
    ir->camera = shown->camera.id ? shown->camera.id : default_camera(e).id;
    ir->background = shown->background.id ? shown->background.id : default_background(e).id;
    if (e->animation.type.kind == TYPE_ANIMATION) ir->duration = e->animation.vector[0].number;
    ir->fps = e->fps;
    collect_patches(e);
}

// --- prints

static int compare_prints(const void *a, const void *b)
{
    const Print *p = *(Print *const *)a, *q = *(Print *const *)b;
    if (p->order != q->order) return p->order < q->order ? -1 : 1;
    return p->number < q->number ? -1 : 1;
}

// In the order of the text: definitions were evaluated when they were wanted, so their lines may have come early.
static void write_prints(Eval *e)
{
    if (!e->options->print || !e->prints) return;
    size_t count = 0, k = 0;
    for (const Print *p = e->prints; p; p = p->next) count++;
    Print **sorted = arena_array(&e->scratch, Print *, count);
    for (Print *p = e->prints; p; p = p->next) {
        p->number = (uint32_t)k;
        sorted[k++] = p;
    }
    qsort(sorted, count, sizeof *sorted, compare_prints);
    for (k = 0; k < count; k++) fprintf(e->options->print, "%s\n", sorted[k]->text);
}

static void try_unused(Eval *e)
{
    e->trying = true;
    for (uint32_t i = 0; i < e->program->count && !e->stop; i++) {
        Symbol *symbol = e->program->items[i];
        if (symbol && symbol->kind == SYMBOL_LET && symbol->progress == CHECK_NOT) force(e, symbol);
    }
}

static Ir *evaluate(Unit *unit, Node *tree, ElaborateOptions *options, size_t stack_size)
{
    Eval evaluator = {.unit = unit,
                      .program = tree->note,
                      .ir = ir_new(&unit->arena),
                      .options = options,
                      .path = scalar_of(1),
                      .fps = 24,
                      .stack = __builtin_frame_address(0),
                      .stack_size = stack_size,
                      .errors_before = unit->errors};
    Eval *e = &evaluator;
    Shown shown = {.camera = value_node(TYPE_CAMERA, 0), .background = value_node(TYPE_BACKGROUND, 0)};
    options->wrong = NULL;
    ir_reserve(e->ir, (uint32_t)(unit->tree_arena.used / sizeof(Node))); // most of a tree become one node each
    e->prints_end = &e->prints;
    list_params(e);
    check_defines(e);
    eval_file(e, &shown);
    choose_camera(e, &shown);
    assemble(e, &shown, tree);
    if (options->unused) try_unused(e);
    write_prints(e);
    arena_release(&e->scratch);
    for (const Module *module = e->program->modules; module; module = module->next) {
        for (Symbol *symbol = module->first; symbol; symbol = symbol->next) {
            symbol->memo = NULL; // what they held is gone; the program may be elaborated again
            symbol->progress = CHECK_NOT;
        }
    }
    return unit->errors || options->wrong ? NULL : e->ir;
}

// --- the stack

typedef struct Job {
    Unit *unit;
    Node *tree;
    ElaborateOptions *options;
    Ir *result;
} Job;

enum { LARGE_STACK = 256 << 20, STACK_SPARE = 2 << 20, COMMON_STACK = 8 << 20 };

static void *run_job(void *argument)
{
    Job *job = argument;
    job->result = evaluate(job->unit, job->tree, job->options, LARGE_STACK - STACK_SPARE);
    return NULL;
}

// A thousand calls deep, each some trees deep, is more than the stack that a program begins with. The evaluation
// therefore has a thread of its own, for its stack alone: the system gives pages of it when they are touched. Without
// such a thread it makes do with less.
Ir *elaborate(Unit *unit, Node *tree, ElaborateOptions *options)
{
    assert(tree->note && !unit->errors && "elaborate takes a tree that check() found nothing wrong with");
    Job job = {unit, tree, options, NULL};
    pthread_attr_t attributes;
    pthread_t thread;
    pthread_attr_init(&attributes);
    bool started =
        !pthread_attr_setstacksize(&attributes, LARGE_STACK) && !pthread_create(&thread, &attributes, run_job, &job);
    pthread_attr_destroy(&attributes);
    if (!started) return evaluate(unit, tree, options, COMMON_STACK - STACK_SPARE);
    pthread_join(thread, NULL);
    return job.result;
}
