// Names. One table, keyed by the interned pointer, says for each name what it means at the three levels: in the
// blocks around, in the file, built in. Local bindings of a name are a chain, innermost first; those of another body
// (a definition that was being checked when this one was wanted) are skipped, since a definition sees its file and
// never its user.
#include <ctype.h>
#include <string.h>

#include "compiler/checker.h"
#include "compiler/synonyms.h"

static void table_grow(Checker *c);

static NameEntry *entry_of(Checker *c, Name name)
{
    if (c->count * 2 >= c->capacity) table_grow(c);
    uint32_t mask = c->capacity - 1;
    uint32_t at = (uint32_t)(((uintptr_t)name >> 4) * 2654435761u) & mask;
    while (c->entries[at].name && c->entries[at].name != name) at = (at + 1) & mask;
    NameEntry *entry = &c->entries[at];
    if (!entry->name) {
        entry->name = name;
        c->count++;
    }
    return entry;
}

static void table_grow(Checker *c)
{
    NameEntry *old = c->entries;
    uint32_t capacity = c->capacity;
    c->capacity = capacity ? capacity * 2 : 1024;
    while (!capacity && c->capacity < 2 * c->unit->names.count + 1024) c->capacity *= 2; // what was read can be defined
    c->entries = arena_array(&c->scratch, NameEntry, c->capacity);
    c->count = 0;
    for (uint32_t i = 0; i < capacity; i++) {
        if (old[i].name) *entry_of(c, old[i].name) = old[i];
    }
}

static Symbol *symbol_new(Checker *c, SymbolKind kind, Name name)
{
    Symbol *symbol = arena_new(&c->unit->arena, Symbol);
    symbol->kind = (uint8_t)kind;
    symbol->name = name;
    return symbol;
}

void names_builtin(Checker *c)
{
    for (int id = 0; id < BUILTIN_END; id++) {
        c->builtin_names[id] = builtin_name(c->unit, (BuiltinId)id);
        NameEntry *entry = entry_of(c, c->builtin_names[id]);
        if (entry->builtin) continue; // another way to call it: found when the first is looked at
        bool constant = builtins[id].kind == KIND_CONSTANT;
        entry->builtin = symbol_new(c, constant ? SYMBOL_CONSTANT : SYMBOL_CALLABLE, entry->name);
        entry->builtin->id = (uint16_t)id;
        entry->builtin->state = CHECK_DONE;
        if (constant) entry->builtin->type = builtin_constant_type((BuiltinId)id);
    }
}

Symbol *names_prelude(Checker *c, Name name)
{
    NameEntry *entry = entry_of(c, name);
    if (!entry->builtin) entry->builtin = symbol_new(c, SYMBOL_CALLABLE, name);
    return entry->builtin;
}

// A callable that is built in is read from the table when it is first used, with all others of its name.
static void load_builtin(Checker *c, Symbol *symbol)
{
    if (symbol->kind != SYMBOL_CALLABLE || symbol->callable) return;
    Callable **end = &symbol->callable;
    for (int id = symbol->id; id < BUILTIN_END; id++) {
        if (c->builtin_names[id] != symbol->name) continue;
        *end = builtin_callable(c->unit, (BuiltinId)id);
        end = &(*end)->overload;
    }
}

// What may be hidden without a word: what is not there yet, and u and v, which mean something in patches alone.
static bool may_hide(const Symbol *builtin)
{
    bool table = !builtin->callable || builtin->callable->kind == CALLABLE_BUILTIN;
    if (builtin->kind == SYMBOL_CONSTANT && (builtin->id == BUILTIN_U || builtin->id == BUILTIN_V)) return true;
    return table && builtins[builtin->id].since == SINCE_LATER;
}

static Symbol *of_module(Symbol *symbol, const Module *module)
{
    while (symbol && symbol->module != module) symbol = symbol->outer;
    return symbol;
}

Symbol *names_in(Checker *c, const Module *module, Name name)
{
    return of_module(entry_of(c, name)->global, module);
}

bool names_hide_builtin(Checker *c, Name name)
{
    const Symbol *builtin = entry_of(c, name)->builtin;
    return builtin && builtin->kind == SYMBOL_CALLABLE;
}

Symbol *names_brought(Checker *c, const Module *module, Name name)
{
    return of_module(entry_of(c, name)->brought, module);
}

Symbol *names_bring(Checker *c, SymbolKind kind, Module *module, Name name, Span span)
{
    NameEntry *entry = entry_of(c, name);
    Symbol *symbol = symbol_new(c, kind, name);
    symbol->module = module;
    symbol->span = span;
    symbol->state = CHECK_DONE;
    symbol->type = poison();
    symbol->outer = entry->brought;
    entry->brought = symbol;
    return symbol;
}

Symbol *names_global(Checker *c, SymbolKind kind, Name name, Span span, const Node *node)
{
    NameEntry *entry = entry_of(c, name);
    Symbol *symbol = symbol_new(c, kind, name);
    symbol->global = true;
    symbol->span = span;
    symbol->node = node;
    symbol->module = c->module;
    symbol->hides = entry->builtin != NULL;
    *c->module->end = symbol;
    c->module->end = &symbol->next;
    bool assigned = node->kind == NODE_LET && node->flag; // `r = 2;`, and the message about that is enough
    Symbol *before = of_module(entry->global, c->module);
    if (before && assigned) return symbol;
    if (before) {
        before->used = symbol->used = true; // which of them is meant is not known
        Diag *d = diag(c->unit, span, DIAG_REDEFINED, "%s is already defined: give one of them another name", name);
        diag_label(c->unit, d, before->span, "first defined here");
        return symbol; // is checked, though no name leads to it
    }
    // A library's names are called with its own before them, so they hide nothing that its users see.
    if (entry->builtin && !may_hide(entry->builtin) && !c->module->library && !assigned) {
        diag(c->unit, span, DIAG_SHADOW, "%s hides what is built in under that name", name);
    }
    symbol->outer = entry->global;
    entry->global = symbol;
    return symbol;
}

static void report_hiding(Checker *c, const NameEntry *entry, SymbolKind kind, Span span, const Symbol *around)
{
    if (c->body->quiet) return;
    if (!around) around = of_module(entry->global, c->body->module);
    if (around && around->node && around->node->kind == NODE_LET && around->node->flag) return; // is none yet
    if (around) {
        Diag *d = diag(c->unit, span, DIAG_SHADOW, "%s hides a name from outside of this block", entry->name);
        diag_label(c->unit, d, around->span, "this one is hidden");
    } else if (entry->builtin && kind == SYMBOL_LET && !may_hide(entry->builtin)) {
        diag(c->unit, span, DIAG_SHADOW, "%s hides what is built in under that name", entry->name);
    }
}

static Symbol *visible_local(const Checker *c, const NameEntry *entry)
{
    if (!c->body) return NULL;
    for (Symbol *s = entry->local; s; s = s->outer) {
        if (s->body == c->body->id) return s;
    }
    return NULL;
}

Symbol *names_local(Checker *c, SymbolKind kind, Name name, Span span, const Node *node, Type type)
{
    NameEntry *entry = entry_of(c, name);
    Symbol *around = visible_local(c, entry);
    Symbol *symbol = symbol_new(c, kind, name);
    symbol->span = span;
    symbol->node = node;
    symbol->type = type;
    symbol->state = CHECK_DONE;
    symbol->body = c->body->id;
    symbol->scope = c->body->scope;
    symbol->slot = c->body->slots++;
    for (int i = 0; i < c->early_count; i++) symbol->used |= c->early[i] == node;
    if (kind == SYMBOL_LET && node->kind == NODE_LET && node->flag) { // `r = 2;`, which was reported
        symbol->used = true;
    } else if (around && around->scope == symbol->scope) {
        around->used = symbol->used = true; // which of them is meant is not known
        Diag *d = diag(c->unit, span, DIAG_REDEFINED,
                       "%s is already defined in this block: give one of them another name", name);
        diag_label(c->unit, d, around->span, "first defined here");
    } else {
        report_hiding(c, entry, kind, span, around);
    }
    symbol->outer = entry->local;
    entry->local = symbol;
    if (c->local_count == c->local_capacity) {
        uint32_t capacity = c->local_capacity ? c->local_capacity * 2 : 256;
        Symbol **locals = arena_array(&c->scratch, Symbol *, capacity);
        if (c->local_count) memcpy(locals, c->locals, c->local_count * sizeof *locals);
        c->locals = locals;
        c->local_capacity = capacity;
    }
    c->locals[c->local_count++] = symbol;
    return symbol;
}

uint32_t names_open(Checker *c, BlockScope *scope, const Node *items)
{
    *scope = (BlockScope){items, c->body->scope, c->body->block};
    c->body->block = scope;
    c->body->scope = ++c->scope_count;
    return c->local_count;
}

void names_close(Checker *c, uint32_t mark)
{
    while (c->local_count > mark) {
        Symbol *symbol = c->locals[--c->local_count];
        entry_of(c, symbol->name)->local = symbol->outer;
        bool wanted = symbol->kind == SYMBOL_LET || symbol->kind == SYMBOL_PARAMETER; // a loop may only count
        if (wanted && !symbol->used && symbol->name[0] != '_' && !lost_name(c->unit, symbol->name) && !c->body->quiet) {
            diag(c->unit, symbol->span, DIAG_UNUSED, "nothing uses %s: remove it, or begin its name with _",
                 symbol->name);
        }
    }
    c->body->scope = c->body->block->around;
    c->body->block = c->body->block->outer;
}

// What a name means here, as it is bound: a name that `use` brings is not followed into its library.
static Symbol *look_up(Checker *c, Name name)
{
    NameEntry *entry = entry_of(c, name);
    Symbol *symbol = visible_local(c, entry);
    if (!symbol && c->body->module) symbol = of_module(entry->global, c->body->module);
    if (!symbol && c->body->module) symbol = of_module(entry->brought, c->body->module);
    if (symbol) return symbol;
    // What begins with _ is the prelude's own affair.
    symbol = entry->builtin;
    if (symbol && name[0] == '_' && c->body->module) return NULL;
    if (symbol) load_builtin(c, symbol);
    return symbol;
}

Symbol *names_find(Checker *c, Name name)
{
    Symbol *symbol = look_up(c, name);
    return symbol && symbol->kind == SYMBOL_BROUGHT ? symbol->means : symbol;
}

static const Node *defined_later(const Checker *c, Name name)
{
    for (const BlockScope *scope = c->body->block; scope; scope = scope->outer) {
        for (const Node *item = scope->items; item; item = item->next) {
            if ((item->kind == NODE_LET || item->kind == NODE_DECLARE) && item->name == name) return item;
        }
    }
    return NULL;
}

// A name of the body itself that may be meant: it comes before all others, and is then no unused one.
static const char *nearest_local(Checker *c, Name name)
{
    const char **candidates = arena_array(&c->scratch, const char *, c->local_count + 1);
    int count = 0;
    for (uint32_t i = 0; i < c->local_count; i++) {
        if (c->locals[i]->body == c->body->id && c->locals[i]->name != name) candidates[count++] = c->locals[i]->name;
    }
    const char *near = nearest_name(name, candidates, count);
    Symbol *meant = near ? visible_local(c, entry_of(c, near)) : NULL;
    if (meant) meant->used = true;
    return meant ? near : NULL;
}

static const char *nearest_visible(Checker *c, Name name)
{
    enum { SUGGESTIONS_MAX = 50 }; // more are not read, and each looks at every name
    if (c->suggestions++ >= SUGGESTIONS_MAX) return NULL;
    const char *local = nearest_local(c, name);
    if (local) return local;
    const char **candidates = arena_array(&c->scratch, const char *, c->count);
    int count = 0;
    const char *later = NULL;
    for (uint32_t i = 0; i < c->capacity; i++) {
        const NameEntry *entry = &c->entries[i];
        if (!entry->name || entry->name == name || (entry->name[0] == '_' && name[0] != '_')) continue;
        const Module *module = c->body->module;
        bool there = entry->builtin && !may_hide(entry->builtin); // what is not there yet is no help
        if (entry->builtin && !entry->name[1]) continue;          // x of a field is no help to who writes width
        bool seen = visible_local(c, entry) || there;
        if (!seen && module) seen = of_module(entry->global, module) || of_module(entry->brought, module);
        if (seen) candidates[count++] = entry->name;
        if (!seen && entry->builtin && nearest_name(name, &entry->name, 1)) later = entry->name;
    }
    // What is meant may be what is not there yet; then another word is no help either.
    const char *near = suggested_name(name, candidates, count), *both[] = {near, later};
    return near && later && nearest_name(name, both, 2) == later ? NULL : near;
}

const char *names_nearest_in(Checker *c, const Module *module, Name name)
{
    enum { SUGGESTIONS_MAX = 50 };
    if (c->suggestions++ >= SUGGESTIONS_MAX) return NULL;
    int room = 0, count = 0;
    for (const Symbol *symbol = module->first; symbol; symbol = symbol->next) room++;
    const char **candidates = arena_array(&c->scratch, const char *, (size_t)room);
    for (const Symbol *symbol = module->first; symbol; symbol = symbol->next) {
        if (symbol->name[0] != '_') candidates[count++] = symbol->name;
    }
    return suggested_name(name, candidates, count);
}

Symbol *names_use(Checker *c, Name name, Span span, bool called)
{
    Symbol *symbol = look_up(c, name);
    if (symbol) {
        symbol->used = true;
        if (symbol->kind == SYMBOL_BROUGHT) symbol = symbol->means;
        symbol->used = true;
        return symbol;
    }
    const Node *later = defined_later(c, name);
    if (lost_name(c->unit, name)) {
        // What defines it was skipped, with a message.
    } else if (later) {
        Diag *d = diag(c->unit, span, DIAG_USED_EARLY,
                       "%s is defined further down in this block: move its definition up", name);
        diag_label(c->unit, d, later->name_span, "defined here");
        if (c->early_count < (int)(sizeof c->early / sizeof *c->early)) c->early[c->early_count++] = later;
    } else {
        const char *near = modules_offer(c, name), *library = near ? NULL : modules_library_of(c, name);
        if (!near && !library) near = nearest_visible(c, name);
        const char *what = called ? "there is nothing to call named" : "there is no";
        Diag *d =
            library ? diag(c->unit, span, DIAG_UNKNOWN_NAME,
                           "%s %s here, but the library %s has it: write use %s: %s; above", what, name, library,
                           library, name)
            : near  ? diag(c->unit, span, DIAG_UNKNOWN_NAME, "%s %s: do you mean %s?", what, name, near)
                    : diag(c->unit, span, DIAG_UNKNOWN_NAME, "%s %s: define it, or look for its spelling", what, name);
        if (near && (near[0] == '#' || near[0] == '_' || isalpha((unsigned char)near[0])) && !strpbrk(near, " ^"))
            diag_fix(c->unit, d, span, FIX_LIKELY, "%s", near);
        lost_add(c->unit, name);
    }
    symbol = symbol_new(c, SYMBOL_ERROR, name);
    symbol->state = CHECK_DONE;
    symbol->type = poison();
    return symbol;
}
