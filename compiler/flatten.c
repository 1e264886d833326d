// Names are bound by check(), so the text is not written anew from the tree: it is copied, and edited at the places
// where a name of a library stands (compiler/references.h). check() knows which definitions of libraries the scene
// needs. What is defined twice anywhere, or built in, is renamed; then edits are made name by name, sorted by place, and
// the files are copied with them.
//
// A local name can hide nothing that was seen before: a library's definition keeps its name only where no other
// definition of any kind has it.
#include "compiler/flatten.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/references.h"

typedef struct Edit {
    Span span;
    const char *text;
    uint32_t order; // of those at one place
} Edit;

typedef struct Renamed { // a library's definition that the scene needs
    Symbol *symbol;
    const char *name; // as it is called from now on
} Renamed;

typedef struct Flattener {
    Unit *unit;
    Program *program;
    Arena scratch;
    Renamed *needed;
    uint32_t needed_count, needed_room;
    Name *names; // of all definitions, sorted; those that occur twice are there twice
    uint32_t name_count, name_room;
    Edit *edits;
    uint32_t edit_count, edit_room;
    FILE *out;
} Flattener;

static void *room(Flattener *f, void *array, uint32_t count, uint32_t *capacity, size_t size)
{
    if (count < *capacity) return array;
    *capacity = *capacity ? 2 * *capacity : 64;
    void *larger = arena_alloc(&f->scratch, *capacity * size);
    if (count) memcpy(larger, array, count * size);
    return larger;
}

// --- what is needed

static bool of_library(const Symbol *symbol)
{
    return symbol->global && symbol->module && symbol->module->library;
}

static Renamed *needed(const Flattener *f, const Symbol *symbol)
{
    return symbol->order ? &f->needed[symbol->order - 1] : NULL;
}

// `order` of a library's symbol is not used otherwise: here its place among the needed, from 1.
static void list_needed(Flattener *f)
{
    for (const Module *m = f->program->modules->next; m; m = m->next) {
        for (Symbol *symbol = m->first; symbol; symbol = symbol->next) {
            symbol->order = 0;
            if (!symbol->reached) continue;
            f->needed = room(f, f->needed, f->needed_count, &f->needed_room, sizeof *f->needed);
            f->needed[f->needed_count++] = (Renamed){symbol, symbol->name};
            symbol->order = f->needed_count;
        }
    }
}

// --- names

static void add_name(Flattener *f, Name name)
{
    f->names = room(f, f->names, f->name_count, &f->name_room, sizeof *f->names);
    f->names[f->name_count++] = name;
}

static void collect_names(Flattener *f, const Node *list)
{
    for (; list; list = list->next) {
        for (const Node *node = list; node;) {
            bool defines = node->kind == NODE_LET || node->kind == NODE_DECLARE || node->kind == NODE_FOR ||
                           node->kind == NODE_PARAMETER || node->kind == NODE_FN || node->kind == NODE_TAG ||
                           node->kind == NODE_TOOL;
            if (defines) add_name(f, node->name);
            if (node->kind == NODE_INCLUDE || node->kind == NODE_USE) {
                if (node->kind == NODE_INCLUDE && node->a) collect_names(f, node->a->a);
                break;
            }
            collect_names(f, node->b);
            collect_names(f, node->c);
            if (!node_is_link(node)) {
                collect_names(f, node->a);
                break;
            }
            node = node->a;
        }
    }
}

static int compare_names(const void *a, const void *b)
{
    uintptr_t x = (uintptr_t) * (const Name *)a, y = (uintptr_t) * (const Name *)b;
    return x < y ? -1 : x > y;
}

static uint32_t definitions_of(const Flattener *f, Name name)
{
    Name *found = bsearch(&name, f->names, f->name_count, sizeof *f->names, compare_names);
    if (!found) return 0;
    Name *first = found, *last = found;
    while (first > f->names && first[-1] == name) first--;
    while (last + 1 < f->names + f->name_count && last[1] == name) last++;
    return (uint32_t)(last - first) + 1;
}

static bool taken_by_another(const Flattener *f, const char *name, uint32_t before)
{
    for (uint32_t i = 0; i < before; i++) {
        if (!strcmp(f->needed[i].name, name)) return true;
    }
    return false;
}

// clay_worn, and _clay_worn of what begins with _: a name of its own.
static const char *new_name(Flattener *f, const Symbol *symbol, uint32_t before)
{
    Arena *arena = &f->unit->arena;
    bool hidden = symbol->name[0] == '_';
    char *library = arena_text(arena, symbol->module->name, strlen(symbol->module->name));
    for (char *p = library; *p; p++) {
        bool fits = (*p >= 'a' && *p <= 'z') || (*p >= 'A' && *p <= 'Z') || (*p >= '0' && *p <= '9');
        if (!fits) *p = '_';
    }
    const char *plain = arena_printf(arena, "%s%s_%s", hidden || (*library >= '0' && *library <= '9') ? "_" : "",
                                     library, symbol->name + hidden);
    const char *name = plain;
    for (int k = 2; definitions_of(f, name_text(&f->unit->names, name)) || taken_by_another(f, name, before); k++)
        name = arena_printf(arena, "%s_%d", plain, k);
    return name;
}

static void choose_names(Flattener *f, const Node *tree)
{
    collect_names(f, tree->a);
    for (uint32_t i = 0; i < f->needed_count; i++) {
        Node alone = *f->needed[i].symbol->node;
        alone.next = NULL;
        collect_names(f, &alone);
    }
    if (f->name_count) qsort(f->names, f->name_count, sizeof *f->names, compare_names);
    for (uint32_t i = 0; i < f->needed_count; i++) {
        const Symbol *symbol = f->needed[i].symbol;
        bool unlike = !symbol->hides && definitions_of(f, symbol->name) == 1;
        if (!unlike) f->needed[i].name = new_name(f, symbol, i);
    }
}

// --- edits

static void add_edit(Flattener *f, Span span, const char *text)
{
    f->edits = room(f, f->edits, f->edit_count, &f->edit_room, sizeof *f->edits);
    f->edits[f->edit_count] = (Edit){span, text, f->edit_count};
    f->edit_count++;
}

static void edit_reference(void *user, const Node *node, Symbol *symbol, Span span)
{
    Flattener *f = user;
    const Renamed *now = of_library(symbol) ? needed(f, symbol) : NULL;
    if (now) add_edit(f, span, now->name);
}

// An object that is declared has its name in pictures too, so with another name for the text it keeps that one:
// `object head = e;` becomes `let clay_head = (e).named("head");`
static void edit_named_object(Flattener *f, const Node *node, const Renamed *now)
{
    Arena *arena = &f->unit->arena;
    uint32_t begin = node->span.begin, value = node->a->span.begin;
    const char *word = node->flag ? arena_printf(arena, "%s ", node->word) : "(";
    add_edit(f, (Span){begin, value}, arena_printf(arena, "let %s = %s", now->name, word));
    add_edit(f, (Span){node->a->span.end, node->span.end},
             arena_printf(arena, "%s.named(\"%s\");", node->flag ? "" : ")", now->symbol->name));
}

static void edit_definition(Flattener *f, const Renamed *now)
{
    const Node *node = now->symbol->node;
    references_visit_definition(f, node, edit_reference);
    if (!strcmp(now->name, now->symbol->name)) return;
    if (node->kind == NODE_DECLARE && type_is(now->symbol->type, TYPE_OBJECT))
        edit_named_object(f, node, now);
    else
        add_edit(f, node->kind == NODE_PARAM ? node->a->name_span : node->name_span, now->name);
}

static int compare_edits(const void *a, const void *b)
{
    const Edit *x = a, *y = b;
    if (x->span.begin != y->span.begin) return x->span.begin < y->span.begin ? -1 : 1;
    return x->order < y->order ? -1 : 1;
}

// --- copying

static const Edit *first_edit(const Flattener *f, uint32_t position)
{
    uint32_t low = 0, high = f->edit_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (f->edits[middle].span.begin < position)
            low = middle + 1;
        else
            high = middle;
    }
    return f->edits + low;
}

// A part of a source, with its edits. What an edit replaces may hold others, which are then for nothing.
static void copy(Flattener *f, const Source *source, uint32_t begin, uint32_t end)
{
    const char *text = source->text - source->base;
    for (const Edit *edit = first_edit(f, begin); edit < f->edits + f->edit_count && edit->span.end <= end; edit++) {
        if (edit->span.begin < begin) continue;
        fwrite(text + begin, 1, edit->span.begin - begin, f->out);
        fputs(edit->text, f->out);
        begin = edit->span.end;
    }
    fwrite(text + begin, 1, end - begin, f->out);
}

// A file with what it includes in the places of the includes; nothing stands for a use, and only the scene has a version.
static void copy_file(Flattener *f, const Node *file, bool scene)
{
    const Source *source = source_of(&f->unit->sources, file->span.begin);
    uint32_t at = source->base, end = source->base + source->length;
    for (const Node *node = file->a; node; node = node->next) {
        bool version = node->kind == NODE_VERSION && !scene;
        if (node->kind != NODE_INCLUDE && node->kind != NODE_USE && !version) continue;
        copy(f, source, at, node->span.begin);
        if (node->kind == NODE_INCLUDE && node->a) copy_file(f, node->a, false);
        at = node->span.end;
    }
    copy(f, source, at, end);
    fputc('\n', f->out);
}

// Where the lines of comments begin that stand right before a definition, and where a comment behind it ends.
static Span with_comments(const Source *source, Span span)
{
    const char *text = source->text - source->base;
    uint32_t begin = span.begin, end = span.end;
    for (;;) {
        uint32_t line = begin;
        while (line > source->base && text[line - 1] != '\n') line--;
        if (strspn(text + line, " \t") != begin - line || line == source->base) break;
        uint32_t before = line - 1;
        while (before > source->base && text[before - 1] != '\n') before--;
        const char *word = text + before + strspn(text + before, " \t");
        if (strncmp(word, "//", 2) != 0) break;
        begin = before + (uint32_t)strspn(text + before, " \t");
    }
    uint32_t behind = end + (uint32_t)strspn(text + end, " \t;");
    if (!strncmp(text + behind, "//", 2)) end = behind + (uint32_t)strcspn(text + behind, "\n");
    return (Span){begin, end};
}

static void copy_library(Flattener *f, const Module *module)
{
    bool any = false;
    for (const Symbol *symbol = module->first; symbol; symbol = symbol->next) {
        if (!symbol->order) continue;
        const Source *source = source_of(&f->unit->sources, symbol->node->span.begin);
        if (!any)
            fprintf(f->out, "\n// From %s.\n",
                    module->quiet ? arena_printf(&f->scratch, "the library %s", module->name) : source->path);
        any = true;
        Span span = with_comments(source, symbol->node->span);
        fputc('\n', f->out);
        copy(f, source, span.begin, span.end);
        fputc('\n', f->out);
    }
}

// A light or camera is of the scene by being declared in it, and in a library it is not.
static bool can_stand_in_scene(Flattener *f)
{
    for (uint32_t i = 0; i < f->needed_count; i++) {
        const Symbol *symbol = f->needed[i].symbol;
        int kind = symbol->kind == SYMBOL_LET ? symbol->type.kind : TYPE_ERROR;
        if (kind != TYPE_LIGHT && kind != TYPE_CAMERA && kind != TYPE_BACKGROUND && kind != TYPE_ANIMATION) continue;
        diag(
            f->unit, symbol->span, DIAG_MISPLACED,
            "%s of a library is used by the scene: in one file it would be shown twice. Make a fn of it: fn %s() { … }",
            symbol->name, symbol->name);
        return false;
    }
    return true;
}

char *flatten(Unit *unit, Node *tree, size_t *length)
{
    Flattener flattener = {.unit = unit, .program = tree->note}, *f = &flattener;
    char *text = NULL, *result = NULL;
    list_needed(f);
    if (can_stand_in_scene(f) && (f->out = open_memstream(&text, length))) {
        choose_names(f, tree);
        references_visit_file(f, tree, edit_reference);
        for (uint32_t i = 0; i < f->needed_count; i++) edit_definition(f, &f->needed[i]);
        if (f->edit_count) qsort(f->edits, f->edit_count, sizeof *f->edits, compare_edits);
        copy_file(f, tree, true);
        for (const Module *m = f->program->modules->next; m; m = m->next) copy_library(f, m);
        fclose(f->out);
        result = arena_text(&unit->arena, text, *length);
        free(text);
    }
    arena_release(&f->scratch);
    return result;
}
