// Libraries: whose definitions there are, the names that `use` brings, and what nothing uses.
//
// A module is the scene with all that it includes, or a library with all that it includes. Each file's definitions see
// those of their module, then what `use` brings into it, then what is built in. collect_file() meets the `use` items:
// it collects the library's definitions at once, and binds names only when all are known (modules_bind), since two
// libraries may use each other.
//
//     use clay;              clay         SYMBOL_LIBRARY: names_find() looks behind its dot
//     use clay as c;         c            the same
//     use clay: worn, tint;  worn, tint   SYMBOL_BROUGHT: stand for what they mean in the library
//
// What a library shows itself (values, scene, asserts, prints) is left out: nothing of it is checked or evaluated.
#include <string.h>

#include "compiler/checker.h"
#include "compiler/references.h"

// --- modules

static bool name_taken(const Checker *c, Name name)
{
    for (const Module *m = c->program->modules; m; m = m->next) {
        if (m->name == name) return true;
    }
    return false;
}

// "eyes" of "parts/eyes.scn" and of "<eyes>", or that with a number behind it where another library has the name.
static Name module_name(Checker *c, const Source *source)
{
    const char *slash = strrchr(source->path, '/'), *stem = slash ? slash + 1 : source->path;
    size_t length = strlen(stem);
    if (source->prelude && length > 2) {
        stem++;
        length -= 2;
    } else if (length > 4 && !strcmp(stem + length - 4, ".scn")) {
        length -= 4;
    }
    Name plain = name_of(&c->unit->names, stem, length), name = plain;
    for (int k = 2; name_taken(c, name); k++)
        name = name_text(&c->unit->names, arena_printf(&c->scratch, "%s_%d", plain, k));
    return name;
}

static Module *module_new(Checker *c, Node *file, bool library)
{
    Module *module = arena_new(&c->unit->arena, Module);
    module->file = file;
    module->library = library;
    module->end = &module->first;
    if (library) {
        const Source *source = source_of(&c->unit->sources, file->span.begin);
        module->name = module_name(c, source);
        module->quiet = source->prelude;
    }
    *c->modules_end = module;
    c->modules_end = &module->next;
    return module;
}

void modules_begin(Checker *c, Node *tree)
{
    c->modules_end = &c->program->modules;
    c->uses_end = &c->uses;
    c->module = module_new(c, tree, false);
    collect_file(c, tree);
}

static Module *module_of(const Checker *c, const Node *file)
{
    for (Module *m = c->program->modules; m; m = m->next) {
        if (m->file == file) return m;
    }
    return NULL;
}

void modules_use(Checker *c, Node *node)
{
    if (!node->file) return; // was not found, and reported
    Use *use = arena_new(&c->scratch, Use);
    *use = (Use){NULL, c->module, node};
    *c->uses_end = use;
    c->uses_end = &use->next;
    if (module_of(c, node->file)) return;
    Module *around = c->module;
    c->module = module_new(c, node->file, true);
    collect_file(c, node->file);
    c->module = around;
}

// --- names

static Symbol *error_symbol(Checker *c, Name name)
{
    Symbol *symbol = arena_new(&c->unit->arena, Symbol);
    *symbol = (Symbol){.name = name, .kind = SYMBOL_ERROR, .state = CHECK_DONE, .used = true, .type = poison()};
    return symbol;
}

Symbol *modules_find(Checker *c, const Module *library, Name name, Span span)
{
    Symbol *symbol = names_in(c, library, name);
    if (symbol && name[0] == '_') {
        diag(c->unit, span, DIAG_PRIVATE_NAME,
             "%s begins with _, so it is %s's own affair: use what %s offers without _", name, library->name,
             library->name);
    } else if (symbol) {
        symbol->used = true;
        return symbol;
    } else {
        const char *near = names_nearest_in(c, library, name);
        Diag *d = near ? diag(c->unit, span, DIAG_NOT_IN_LIBRARY, "the library %s has no %s: do you mean %s?",
                              library->name, name, near)
                       : diag(c->unit, span, DIAG_NOT_IN_LIBRARY, "the library %s has no %s: look for its spelling",
                              library->name, name);
        if (near) diag_fix(c->unit, d, span, FIX_LIKELY, "%s", near);
    }
    return error_symbol(c, name);
}

Symbol *modules_find_within(Checker *c, Name library, Span library_span, Name name, Span span)
{
    Symbol *symbol = names_use(c, library, library_span, false);
    if (symbol->kind == SYMBOL_LIBRARY) return modules_find(c, symbol->opens, name, span);
    if (symbol->kind != SYMBOL_ERROR)
        diag(c->unit, library_span, DIAG_TYPE_MISMATCH, "%s is no library, so it has no %s to call", library, name);
    return error_symbol(c, name);
}

// Whether a `use` may bind a name: what has it already, in the file or by another `use`, is reported.
static bool may_bind(Checker *c, const Module *module, Name name, Span span, const Symbol *means, const Module *opens)
{
    const Symbol *own = names_in(c, module, name);
    if (own) {
        if (!module->quiet) {
            Diag *d =
                diag(c->unit, own->span, DIAG_SHADOW, "%s hides what use brings under that name: write use … as", name);
            diag_label(c->unit, d, span, "this is hidden");
        }
        return false;
    }
    const Symbol *before = names_brought(c, module, name);
    if (!before) return true;
    if (before->opens == opens && before->means == means) return false; // the same, from two of the files
    Diag *d = diag(c->unit, span, DIAG_REDEFINED, "another use brings a %s already: write use … as another name", name);
    diag_label(c->unit, d, before->span, "first brought here");
    return false;
}

static void bind_library(Checker *c, const Use *use, Module *library)
{
    const Node *node = use->node;
    Name name = node->c ? node->alias : node->name;
    Span span = node->c ? node->c->span : node->name_span;
    if (!name || !may_bind(c, use->module, name, span, NULL, library)) return;
    names_bring(c, SYMBOL_LIBRARY, use->module, name, span)->opens = library;
}

static void bind_name(Checker *c, const Use *use, Module *library, Node *name)
{
    Symbol *means = modules_find(c, library, name->name, name->span);
    if (!may_bind(c, use->module, name->name, name->span, means, NULL)) return;
    Symbol *brought = names_bring(c, SYMBOL_BROUGHT, use->module, name->name, name->span);
    brought->means = means;
    brought->used = means->kind == SYMBOL_ERROR;
    name->note = brought;
}

void modules_bind(Checker *c)
{
    for (const Use *use = c->uses; use; use = use->next) {
        Module *library = module_of(c, use->node->file);
        bool names = use->node->a != NULL;
        if (!names) bind_library(c, use, library);
        for (Node *name = use->node->a; name; name = name->next) bind_name(c, use, library, name);
    }
}

const char *modules_offer(Checker *c, Name name)
{
    if (!c->body->module) return NULL;
    for (const Use *use = c->uses; use; use = use->next) {
        const Node *node = use->node;
        if (use->module != c->body->module || node->a || name[0] == '_') continue;
        Name prefix = node->c ? node->alias : node->name;
        if (prefix && names_in(c, module_of(c, node->file), name))
            return arena_printf(&c->unit->arena, "%s.%s", prefix, name);
    }
    return NULL;
}

// Whether a text that is laid out by `scn fmt` defines a name in a line of its own.
static bool text_defines(const char *text, Name name)
{
    static const char *const words[] = {"\nfn ", "\ntag ", "\ntool "};
    size_t length = strlen(name);
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
        size_t word = strlen(words[i]);
        for (const char *at = text; (at = strstr(at, words[i])); at += word)
            if (!strncmp(at + word, name, length) && at[word + length] == '(') return true;
    }
    return false;
}

const char *modules_library_of(Checker *c, Name name)
{
    size_t length;
    enum { SUGGESTIONS_MAX = 50 }; // more are not read
    if (!c->unit->library || !c->body->module || name[0] == '_' || c->suggestions >= SUGGESTIONS_MAX) return NULL;
    const char *all = c->unit->library(NULL, &length);
    while (all && *all) {
        size_t word = strcspn(all, " ");
        const char *library = arena_text(&c->scratch, all, word);
        const char *text = c->unit->library(library, &length);
        if (text && text_defines(arena_text(&c->scratch, text, length), name)) return library;
        all += word + (all[word] == ' ');
    }
    return NULL;
}

// --- what a library defines

void modules_check(Checker *c)
{
    for (const Module *m = c->program->modules->next; m; m = m->next) {
        for (Symbol *symbol = m->first; symbol && !m->quiet; symbol = symbol->next) {
            if (symbol->state == CHECK_NOT) check_now(c, symbol);
        }
    }
}

// --- what of libraries the scene needs

typedef struct Reached {
    Arena *scratch;
    Symbol **list;
    uint32_t count, capacity;
} Reached;

static void reach(void *user, const Node *node, Symbol *symbol, Span span)
{
    Reached *r = user;
    if (!symbol->global || symbol->reached || !symbol->module || !symbol->module->library) return;
    symbol->reached = true;
    if (r->count == r->capacity) {
        r->capacity = r->capacity ? 2 * r->capacity : 64;
        Symbol **list = arena_array(r->scratch, Symbol *, r->capacity);
        if (r->count) memcpy(list, r->list, r->count * sizeof *list);
        r->list = list;
    }
    r->list[r->count++] = symbol;
}

void modules_reach(Checker *c, Node *tree)
{
    if (!c->uses || c->unit->errors) return;
    Reached reached = {.scratch = &c->scratch};
    references_visit_file(&reached, tree, reach);
    for (uint32_t i = 0; i < reached.count; i++) references_visit_definition(&reached, reached.list[i]->node, reach);
}

// --- what nothing uses
//
// A file that shows nothing is a library, and what it defines is for others. In a scene the names of the main file are
// looked at one by one, an included file as a whole: of twenty materials a scene may use three.

static bool shows(const Node *node)
{
    if (node->kind == NODE_FOR) return true;
    if (node->kind != NODE_VALUE) return false;
    const Node *call = node->a; // `scene { }` shows nothing
    return call->kind != NODE_CALL || call->a || call->b || !call->c || call->c->a;
}

// Lights, cameras and such belong to the scene by being declared.
static bool declares_for_scene(const Symbol *symbol)
{
    int kind = symbol->type.kind;
    return symbol->kind == SYMBOL_LET && (kind == TYPE_LIGHT || kind == TYPE_CAMERA || kind == TYPE_BACKGROUND ||
                                          kind == TYPE_ANIMATION || kind == TYPE_ERROR);
}

static bool reported_as_unused(const Node *node, const Symbol *symbol)
{
    bool query = node->kind == NODE_DECLARE && !strcmp(node->word, "query");
    bool loop = node->kind == NODE_FOR; // may be there to count alone
    return !symbol->used && symbol->name[0] != '_' && !query && !loop && !declares_for_scene(symbol);
}

static bool file_shows(const Node *file)
{
    for (const Node *node = file->a; node; node = node->next) {
        if (shows(node) || node->kind == NODE_ERROR) return true;
        if (node->kind == NODE_INCLUDE && node->a && file_shows(node->a)) return true;
    }
    return false;
}

// The library that a `use` of the scene binds as a whole, or NULL.
static const Symbol *library_used(Checker *c, const Node *node)
{
    Name prefix = node->a ? NULL : node->c ? node->alias : node->name;
    return prefix && node->file ? names_brought(c, c->program->modules, prefix) : NULL;
}

static bool use_used(Checker *c, const Node *node)
{
    const Symbol *library = library_used(c, node);
    bool used = !node->file || (library && library->used);
    for (const Node *name = node->a; name; name = name->next) {
        const Symbol *brought = name->note;
        used |= !brought || brought->used;
    }
    return used;
}

// Whether a scene has anything from a file that it includes.
static bool file_used(Checker *c, const Node *file)
{
    for (const Node *node = file->a; node; node = node->next) {
        const Symbol *symbol = node->kind == NODE_INCLUDE || node->kind == NODE_USE ? NULL : node->note;
        if (node->kind == NODE_VERSION) continue;
        if (node->kind == NODE_INCLUDE && (!node->a || file_used(c, node->a))) return true;
        if (node->kind == NODE_USE && use_used(c, node)) return true;
        if (node->kind == NODE_INCLUDE || node->kind == NODE_USE) continue;
        if (!symbol) return true;
        if (symbol && (symbol->used || declares_for_scene(symbol))) return true;
    }
    return false;
}

static void report_use(Checker *c, Node *node)
{
    for (const Node *name = node->a; name; name = name->next) {
        const Symbol *brought = name->note;
        if (brought && !brought->used)
            diag(c->unit, name->span, DIAG_UNUSED, "nothing uses %s: do not bring it", brought->name);
    }
    const Symbol *library = library_used(c, node);
    if (!library || library->used) return;
    Diag *d = diag(c->unit, library->span, DIAG_UNUSED, "nothing uses the library %s: remove this use", library->name);
    diag_fix(c->unit, d, node->span, FIX_LIKELY, "%s", "");
}

void modules_report_unused(Checker *c, Node *tree)
{
    if (c->unit->errors > c->unit->promoted || !file_shows(tree)) return;
    for (Node *node = tree->a; node; node = node->next) {
        if (node->kind == NODE_USE) {
            report_use(c, node);
        } else if (node->kind == NODE_INCLUDE) {
            if (node->a && !file_used(c, node->a))
                diag(c->unit, node->name_span, DIAG_UNUSED, "nothing of %s is used: remove this include", node->text);
        } else if (node->note && node->kind != NODE_VALUE) {
            const Symbol *symbol = node->note;
            if (reported_as_unused(node, symbol))
                diag(c->unit, symbol->span, DIAG_UNUSED, "nothing uses %s: remove it, or begin its name with _",
                     symbol->name);
        }
    }
}
