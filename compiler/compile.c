// The compiler's table of contents.
#include "compiler/compile.h"

#include <assert.h>
#include <string.h>
#include <time.h>

#include "compiler/check.h"
#include "compiler/elaborate.h"
#include "compiler/emit.h"
#include "compiler/geometry.h"
#include "compiler/lower.h"
#include "compiler/passes.h"
#include "compiler/stdlib.h"
#include "lang/ast.h"

typedef struct Compilation {
    Unit *unit;
    const CompileOptions *options;
    Compiled *result;
    double begun; // of the phase, ms
} Compilation;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec / 1e6;
}

static void phase_done(Compilation *c, CompilePhase phase)
{
    double end = now();
    c->result->milliseconds[phase] += end - c->begun;
    c->begun = end;
}

// Whether a file has tags, tools or functions for others, and nothing that a scene is made of.
static bool is_library(const Node *tree)
{
    bool defines = false;
    for (const Node *item = tree->a; item; item = item->next) {
        bool callable = item->kind == NODE_FN || item->kind == NODE_TAG || item->kind == NODE_TOOL;
        bool named = item->kind == NODE_LET || (item->kind == NODE_DECLARE && item->name);
        if (item->kind == NODE_VALUE || item->kind == NODE_FOR || (item->kind == NODE_DECLARE && !named)) return false;
        defines |= callable;
    }
    return defines;
}

static Node *read_tree(Compilation *c, const Source *source)
{
    if (!c->unit->library) c->unit->library = stdlib_library;
    Node *tree = parse(c->unit, source);
    c->unit->lost.read = true;
    phase_done(c, PHASE_PARSE);
    if (c->options->dump_tree) ast_print(c->unit, tree, c->options->dump_tree);
    if (c->unit->lost.shape)
        return tree; // brackets are not where they were meant: what would be found is not what is wrong
    if (c->options->unused && is_library(tree)) c->unit->diagnostics.levels[DIAG_EMPTY_SCENE] = LEVEL_OFF;
    check(c->unit, tree);
    phase_done(c, PHASE_CHECK);
    return tree;
}

static Ir *make_ir(Compilation *c, Node *tree)
{
    const CompileOptions *o = c->options;
    ElaborateOptions options = {.defines = o->defines,
                                .define_count = o->define_count,
                                .camera = o->camera,
                                .only = o->only,
                                .print = o->print,
                                .patches = o->patches,
                                .unused = o->unused};
    Ir *ir = elaborate(c->unit, tree, &options);
    c->result->wrong = options.wrong;
    arena_release(&c->unit->tree_arena); // the largest part of a large scene: it need not stand beside the plan
    phase_done(c, PHASE_ELABORATE);
    if (ir && o->dump_ir) ir_print(ir, o->dump_ir);
    if (ir && o->elaborated) *o->elaborated = (CompileElaborated){ir, ir->root};
    return ir;
}

static bool run_pass(Compilation *c, Ir *ir, const Pass *pass)
{
    Arena scratch = {0};
    bool ok = pass->run(ir, &scratch);
    arena_release(&scratch);
    if (!ok) {
        diag(c->unit, (Span){0}, DIAG_TOO_MANY_ITEMS, "the scene has more than 10 million items: use fewer copies");
        return false;
    }
#ifndef NDEBUG
    const char *wrong = pass_verify(ir, pass);
    if (wrong) fprintf(stderr, "scn: %s\n", wrong);
    assert(!wrong && "an IR is whole between passes");
#endif
    return true;
}

static bool run_passes(Compilation *c, Ir *ir)
{
    for (int k = 0; k < PASS_COUNT; k++) {
        if (!run_pass(c, ir, &passes[k])) return false;
        phase_done(c, PHASE_PASSES);
        bool dumped = c->options->dump_after && c->options->after && !strcmp(c->options->after, passes[k].name);
        if (dumped) ir_print(ir, c->options->dump_after);
    }
    return true;
}

static Plan *make_plan(Compilation *c, const Ir *ir, PlanOrigins *origins)
{
    Plan *plan = NULL;
    switch (plan_lower(ir, &c->unit->arena, &plan, origins)) {
    case LOWER_DONE: break;
    case LOWER_TOO_MANY:
        diag(c->unit, (Span){0}, DIAG_TOO_MANY_ITEMS, "the scene has more than 10 million leaves: use fewer copies");
        break;
    case LOWER_TOO_LONG:
        diag(c->unit, (Span){0}, DIAG_TOO_MANY_ITEMS, "the expression of a field has more than %u operations",
             TAPE_STEPS_MAX);
        break;
    case LOWER_TOO_DEEP:
        diag(c->unit, (Span){0}, DIAG_TOO_DEEP,
             "unions and intersections of many parts are nested more than %d deep: join what can be one union",
             LOWER_LEVELS_MAX);
        break;
    }
    phase_done(c, PHASE_LOWER);
    return plan;
}

static void make_kernel(Compilation *c, const Plan *plan)
{
    c->result->kernel = emit_kernel(&c->unit->arena, plan, &c->result->kernel_length);
    phase_done(c, PHASE_EMIT);
    if (c->options->dump_kernel) fwrite(c->result->kernel, 1, c->result->kernel_length, c->options->dump_kernel);
}

static bool known_pass(Compilation *c)
{
    const char *after = c->options->after;
    if (!after) return true;
    for (int k = 0; k < PASS_COUNT; k++) {
        if (!strcmp(after, passes[k].name)) return true;
    }
    const char *names = "";
    for (int k = 0; k < PASS_COUNT; k++)
        names = arena_printf(&c->unit->arena, "%s%s%s", names, k ? ", " : "", passes[k].name);
    c->result->wrong = arena_printf(&c->unit->arena, "there is no pass '%s': write one of %s", after, names);
    return false;
}

Compiled *compile(Unit *unit, const Source *source, const CompileOptions *options)
{
    Compilation c = {unit, options, arena_new(&unit->arena, Compiled), now()};
    PlanOrigins origins;
    if (!known_pass(&c)) return c.result;
    Node *tree = read_tree(&c, source); // always a tree; names and types are known after it
    if (unit->errors) return c.result;
    Ir *ir = make_ir(&c, tree); // tags and tools inlined, what is const computed
    if (!ir) return c.result;
    warn_of_quadrics(unit, ir);
    phase_done(&c, PHASE_WARN);
    if (!run_passes(&c, ir)) return c.result; // everything at the leaves, sets normalised
    Plan *plan = make_plan(&c, ir, &origins); // tables, and a program for what moves
    if (!plan) return c.result;
    warn_of_geometry(unit, ir, plan, &origins);
    phase_done(&c, PHASE_WARN);
    if (unit->errors) return c.result; // warnings may count as errors
    if (options->kernel || options->dump_kernel) make_kernel(&c, plan);
    c.result->plan = plan;
    return c.result;
}

const char *compile_phase_name(CompilePhase phase)
{
    static const char *const names[PHASE_COUNT] = {"parse", "check",    "elaborate", "passes",
                                                   "lower", "warnings", "emit"};
    return names[phase];
}

const char *compile_pass_name(int k)
{
    return k >= 0 && k < PASS_COUNT ? passes[k].name : NULL;
}
