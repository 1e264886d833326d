// Building the model, from trees and from the table of built-ins, and the default scenes.
#include "runtime/doc.h"

#include <ctype.h>
#include <string.h>

#include "compiler/builtins.h"
#include "lang/ast.h"
#include "stdlib_text.h"

// --- Groups and entries

static DocGroup *add_group(Doc *doc, const char *title, const char *intro)
{
    for (DocGroup *group = doc->groups; group; group = group->next) {
        if (!strcmp(group->title, title)) return group;
    }
    DocGroup *group = arena_new(&doc->unit->arena, DocGroup);
    group->title = title;
    group->intro = intro;
    if (doc->last_group)
        doc->last_group->next = group;
    else
        doc->groups = group;
    doc->last_group = group;
    return group;
}

static DocForm *add_form(Doc *doc, DocGroup *group, const char *name, const char *kind)
{
    Arena *arena = &doc->unit->arena;
    DocEntry *entry = group->entries;
    while (entry && strcmp(entry->name, name) != 0) entry = entry->next;
    if (!entry) {
        entry = arena_new(arena, DocEntry);
        entry->name = name;
        entry->kind = kind;
        if (group->last)
            group->last->next = entry;
        else
            group->entries = entry;
        group->last = entry;
        doc->entry_count++;
    }
    DocForm *form = arena_new(arena, DocForm);
    if (entry->last_form)
        entry->last_form->next = form;
    else
        entry->forms = form;
    entry->last_form = form;
    return form;
}

static void add_example(Doc *doc, DocForm *form, DocExample example)
{
    DocExample *made = arena_new(&doc->unit->arena, DocExample);
    *made = example;
    made->span = form->span;
    if (form->last_example)
        form->last_example->next = made;
    else
        form->examples = made;
    form->last_example = made;
}

// --- Examples in texts

static bool has_word(const char *text, const char *word)
{
    size_t length = strlen(word);
    for (const char *at = strstr(text, word); at; at = strstr(at + 1, word)) {
        bool begins = at == text || at[-1] == '\n' || at[-1] == ';';
        if (begins && isspace((unsigned char)at[length])) return true;
    }
    return false;
}

static void find_examples(Doc *doc, DocForm *form)
{
    static const char fence[] = "```scn\n";
    for (const char *at = form->doc ? form->doc : ""; (at = strstr(at, fence));) {
        at += sizeof fence - 1;
        const char *end = strstr(at, "```");
        if (!end) end = at + strlen(at);
        char *text = arena_text(&doc->unit->arena, at, (size_t)(end - at));
        bool brings = has_word(text, "use") || has_word(text, "include");
        add_example(doc, form, (DocExample){.shown = text, .before = brings ? "" : doc->include});
        at = end;
    }
}

// --- Default scenes

// A value of a type, for the k-th parameter of it that needs one. NULL: of this type there is none.
static const char *made_up(Arena *arena, const DocParameter *parameter, int k)
{
    static const char *const values[][2] = {
        {"scalar", "1"},
        {"number", "1"},
        {"int", "5"},
        {"angle", "45deg"},
        {"time", "1s"},
        {"bool", "true"},
        {"color", "#c8814b"},
        {"range", "0 .. 1"},
        {"object", "sphere(1)"},
        {"quadric", "sphere(1)"},
        {"[object]", "[sphere(1)]"},
        {"material", "material(color: #c8814b)"},
        {"movable", "sphere(1)"},
        {"vec2", "(1, 1)"},
        {"[scalar]", "[0.3, 0.6, 1]"},
        {"[vec3]", "[(-0.5, 0, 0.87), (0, 0, 1), (0.5, 0, 0.87)]"},
    };
    if (parameter->range && !strcmp(parameter->type, "scalar"))
        return arena_printf(arena, "(%s).low", parameter->range);
    if (!strcmp(parameter->type, "vec3")) return k % 2 ? "(0, 0, 1)" : "(0, 0, -0.5)";
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        if (!strcmp(values[i][0], parameter->type)) return values[i][1];
    }
    return NULL;
}

// What the parameters without a default need: "from: (0, 0, -0.5), to: (0, 0, 1)". NULL if it cannot be made up.
static const char *made_up_arguments(Arena *arena, const DocForm *form)
{
    const char *text = "";
    int points = 0;
    for (const DocParameter *p = form->parameters; p; p = p->next) {
        if (p->initial || p->optional || p->later) continue;
        const char *value = made_up(arena, p, points);
        if (!value) return NULL;
        points += !strcmp(p->type, "vec3");
        text = arena_printf(arena, "%s%s%s: %s", text, *text ? ", " : "", p->name, value);
    }
    return text;
}

// `material clay { … }` is shown on a ball, `object pawn { … }` as it is.
static void add_default_value(Doc *doc, const DocEntry *entry, DocForm *form)
{
    Arena *arena = &doc->unit->arena;
    const char *scene = NULL;
    if (!strcmp(entry->kind, "material"))
        scene = arena_printf(arena, "sphere(1).paint(%s%s);", doc->prefix, entry->name);
    if (!strcmp(entry->kind, "object")) scene = arena_printf(arena, "%s%s;", doc->prefix, entry->name);
    if (scene) add_example(doc, form, (DocExample){.shown = scene, .before = doc->use, .made_up = true});
}

static void add_default(Doc *doc, const DocEntry *entry, DocForm *form)
{
    Arena *arena = &doc->unit->arena;
    if (!form->called && !form->examples) add_default_value(doc, entry, form);
    bool tag = !strcmp(entry->kind, "tag"), tool = !strcmp(entry->kind, "tool");
    if (form->examples || form->later || (!tag && !tool)) return;
    const char *arguments = made_up_arguments(arena, form), *result = form->result ? form->result : "object";
    if (!arguments) return;
    const char *call = arena_printf(arena, "%s%s(%s)", doc->prefix, entry->name, arguments), *scene = NULL,
               *clipped = NULL;
    if (tool) {
        const char *comma = *arguments ? ", " : "";
        scene = arena_printf(arena, "freeform(sphere(1)) { %s%s(on: surface(from: (2, 1, 3))%s%s); }", doc->prefix,
                             entry->name, comma, arguments);
    } else if (!strcmp(result, "object") || !strcmp(result, "quadric")) {
        scene = arena_printf(arena, "%s.paint(#c8a06a);", call);
        clipped = arena_printf(arena, "(%s & box(3)).paint(#c8a06a);", call);
    } else if (!strcmp(result, "[object]")) {
        scene = arena_printf(arena, "union(%s).paint(#c8a06a);", call);
    } else if (!strcmp(result, "perturbation")) {
        scene = arena_printf(arena, "freeform(sphere(1)) { %s; }", call);
    } else if (!strcmp(result, "material") || !strcmp(result, "color")) {
        scene = arena_printf(arena, "sphere(1).paint(%s);", call);
    }
    if (!scene) return;
    add_example(doc, form, (DocExample){.shown = scene, .clipped = clipped, .before = doc->use, .made_up = true});
}

static void finish_doc(Doc *doc)
{
    for (DocGroup *group = doc->groups; group; group = group->next) {
        for (DocEntry *entry = group->entries; entry; entry = entry->next) {
            for (DocForm *form = entry->forms; form; form = form->next) {
                find_examples(doc, form);
                add_default(doc, entry, form);
            }
        }
    }
}

// --- Trees

// The text of a node, on one line.
static const char *node_text(Doc *doc, const Source *source, const Node *node)
{
    if (!node) return NULL;
    uint32_t begin = node->span.begin - source->base, end = node->span.end - source->base;
    char *text = arena_text(&doc->unit->arena, source->text + begin, end - begin), *out = text;
    for (const char *c = text; *c; c++) {
        bool space = isspace((unsigned char)*c);
        if (!space || (out > text && out[-1] != ' ')) *out++ = space ? ' ' : *c;
    }
    *out = 0;
    return text;
}

static DocParameter *read_parameter(Doc *doc, const Source *source, const Node *node)
{
    DocParameter *parameter = arena_new(&doc->unit->arena, DocParameter);
    parameter->name = node->name;
    parameter->type = node->a ? node_text(doc, source, node->a) : "";
    parameter->initial = node_text(doc, source, node->b);
    parameter->range = node_text(doc, source, node->c);
    parameter->doc = node->doc;
    return parameter;
}

static const char *node_kind(const Node *item)
{
    switch ((NodeKind)item->kind) {
    case NODE_TAG: return "tag";
    case NODE_TOOL: return "tool";
    case NODE_FN: return "function";
    case NODE_PARAM: return "param";
    case NODE_LET: return item->doc ? "value" : NULL;
    case NODE_DECLARE: return item->doc ? item->word : NULL;
    default: return NULL;
    }
}

static const char tool_places[] = "Besides its own parameters a tool takes where it stands: `on: surface(from: …)`, or "
                                  "`at:` with `normal:`; and `turn:`, an "
                                  "angle about its normal.";

static void read_item(Doc *doc, const Source *source, const Node *item, DocGroup *given)
{
    const char *kind = node_kind(item);
    const Node *named = item->kind == NODE_PARAM ? item->a : item;
    if (!kind || named->name[0] == '_') return;
    DocGroup *group = given;
    if (!group && item->kind == NODE_TAG) group = add_group(doc, "Tags", NULL);
    if (!group && item->kind == NODE_TOOL) group = add_group(doc, "Tools", tool_places);
    if (!group && item->kind == NODE_FN) group = add_group(doc, "Functions", NULL);
    if (!group && item->kind == NODE_PARAM) group = add_group(doc, "Params", NULL);
    if (!group) group = add_group(doc, "Values", NULL);
    DocForm *form = add_form(doc, group, named->name, kind);
    form->doc = item->doc ? item->doc : named->doc;
    form->span = item->span;
    form->called = item->kind == NODE_TAG || item->kind == NODE_TOOL || item->kind == NODE_FN;
    if (item->kind == NODE_PARAM) {
        form->parameters = read_parameter(doc, source, named);
        return;
    }
    if (!form->called) return;
    if (item->kind != NODE_TOOL) form->result = node_text(doc, source, item->b);
    DocParameter **end = &form->parameters;
    for (const Node *node = item->a; node; node = node->next, end = &(*end)->next)
        *end = read_parameter(doc, source, node);
}

static const char *base_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

// The name of a library by its file: letters, digits and _ of "my-brushes.scn"; scenes of its examples call it so.
static const char *alias_of(Arena *arena, const char *base)
{
    char *alias = arena_text(arena, base, strcspn(base, "."));
    for (char *c = alias; *c; c++) {
        if (!isalnum((unsigned char)*c)) *c = '_';
    }
    return *alias && !isdigit((unsigned char)*alias) ? alias : "library";
}

Doc *doc_of_library(Unit *unit, const Source *source, const char *name, bool standard)
{
    Doc *doc = arena_new(&unit->arena, Doc);
    const char *base = base_of(name);
    const Node *tree = parse_source(unit, source);
    doc->unit = unit;
    doc->title = standard ? name : arena_text(&unit->arena, base, strcspn(base, "."));
    doc->intro = tree->doc;
    doc->path = arena_printf(&unit->arena, "%.*sexample", (int)(base - name), name);
    const char *alias = standard ? name : alias_of(&unit->arena, base);
    doc->prefix = arena_printf(&unit->arena, "%s.", alias);
    doc->use = standard ? arena_printf(&unit->arena, "use %s;\n", name)
                        : arena_printf(&unit->arena, "use \"%s\" as %s;\n", base, alias);
    doc->include = standard ? doc->use : arena_printf(&unit->arena, "include \"%s\";\n", base);
    for (const Node *item = tree->a; item; item = item->next) read_item(doc, source, item, NULL);
    finish_doc(doc);
    return doc;
}

// --- What is built in

// The end of what begins at `text`: a comma, a closing bracket or a word of `stops`, outside of brackets and strings.
static const char *part_end(const char *text, const char *stop)
{
    int depth = 0;
    for (; *text; text++) {
        if (*text == '"') {
            for (text++; *text && *text != '"'; text++) continue;
            if (!*text) break;
        }
        if (depth == 0 && stop && !strncmp(text, stop, strlen(stop))) return text;
        if (*text == '(' || *text == '[') depth++;
        if ((*text == ')' || *text == ']') && depth-- == 0) return text;
        if (*text == ',' && depth == 0) return text;
    }
    return text;
}

// Cuts what stands behind `mark` off `text`, which ends at `*end`; NULL if there is none.
static const char *cut_behind(Arena *arena, const char *text, const char **end, const char *mark)
{
    const char *at = part_end(text, mark);
    if (at >= *end || strncmp(at, mark, strlen(mark)) != 0) return NULL;
    const char *behind = at + strlen(mark);
    const char *part = arena_text(arena, behind, (size_t)(*end - behind));
    *end = at;
    return part;
}

// "radius: scalar = 1 in 0 .. 2 later"
static DocParameter *read_signature_part(Arena *arena, const char *text, const char *end)
{
    DocParameter *parameter = arena_new(arena, DocParameter);
    parameter->later = cut_behind(arena, text, &end, " later") != NULL;
    parameter->range = cut_behind(arena, text, &end, " in ");
    parameter->initial = cut_behind(arena, text, &end, " = ");
    const char *type = cut_behind(arena, text, &end, ": ");
    size_t length = type ? strlen(type) : 0;
    parameter->optional = length && type[length - 1] == '?';
    parameter->type = type ? arena_text(arena, type, length - parameter->optional) : "";
    parameter->name = arena_text(arena, text, (size_t)(end - text));
    return parameter;
}

static void read_builtin(Doc *doc, const Builtin *builtin, DocGroup *group, const char *kind)
{
    Arena *arena = &doc->unit->arena;
    const char *text = builtin->signature;
    size_t length = strcspn(text, "(:");
    DocForm *form = add_form(doc, group, arena_text(arena, text, length), kind);
    form->doc = builtin->doc;
    form->later = builtin->since == SINCE_LATER;
    form->called = text[length] == '(';
    DocParameter **end = &form->parameters;
    if (!form->called) form->result = text + length + 2;
    const char *at = text + length + 1;
    for (; form->called && *at && *at != ')'; end = &(*end)->next) {
        const char *stop = part_end(at, NULL);
        *end = read_signature_part(arena, at, stop);
        at = *stop == ',' ? stop + 2 : stop;
    }
    const char *arrow = form->called ? strstr(at, "-> ") : NULL;
    if (arrow) form->result = arrow + 3;
}

typedef struct KindTitle {
    const char *title, *kind;
} KindTitle;

static const KindTitle kind_titles[] = {
    [KIND_SET] = {"Sets", "set"},
    [KIND_SHAPE] = {"Shapes", "shape"},
    [KIND_PERTURBATION] = {"Free forms", "perturbation"},
    [KIND_OPERATION] = {"Operations", "operation"},
    [KIND_MODIFIER] = {"Modifiers", "modifier"},
    [KIND_THING] = {"Things", "thing"},
    [KIND_ANSWER] = {"Answers", "answer"},
    [KIND_FUNCTION] = {"Functions", "function"},
    [KIND_CONSTANT] = {"Values", "value"},
};

typedef struct BuiltinExample {
    BuiltinId id;
    const char *scene;
} BuiltinExample;

typedef struct PreludeExample {
    const char *name;
    int form;
    const char *scene;
} PreludeExample;

static const PreludeExample prelude_examples[] = {
#define PRELUDE(name, form, scene) {name, form, scene},
#include "runtime/doc_examples.def"
#undef PRELUDE
};

static const BuiltinExample builtin_examples[] = {
#define EXAMPLE(id, scene) {BUILTIN_##id, scene},
#include "runtime/doc_examples.def"
#undef EXAMPLE
};

static void read_table(Doc *doc)
{
    for (int id = 0; id < BUILTIN_END; id++) {
        const KindTitle *kind = &kind_titles[builtins[id].kind];
        DocGroup *group = add_group(doc, kind->title, NULL);
        read_builtin(doc, &builtins[id], group, kind->kind);
        for (size_t k = 0; k < sizeof builtin_examples / sizeof *builtin_examples; k++) {
            if (builtin_examples[k].id != (BuiltinId)id) continue;
            add_example(doc, group->last->last_form, (DocExample){.shown = builtin_examples[k].scene, .before = ""});
        }
    }
}

static DocGroup *prelude_group(Doc *doc, const char *file)
{
    if (strstr(file, "shapes")) return add_group(doc, "Shapes", NULL);
    if (strstr(file, "tools")) return add_group(doc, "Tools", tool_places);
    if (strstr(file, "easings"))
        return add_group(doc, "Easings",
                         "Written behind a key's value, as in `2s: 1 smooth;`, or called with a number from 0 to 1.");
    return add_group(doc, "Functions", NULL);
}

static void add_prelude_examples(Doc *doc)
{
    for (const DocGroup *group = doc->groups; group; group = group->next) {
        for (const DocEntry *entry = group->entries; entry; entry = entry->next) {
            int k = 0;
            for (DocForm *form = entry->forms; form; form = form->next, k++) {
                for (size_t i = 0; i < sizeof prelude_examples / sizeof *prelude_examples; i++) {
                    const PreludeExample *example = &prelude_examples[i];
                    if (strcmp(example->name, entry->name) != 0 || example->form != k) continue;
                    add_example(doc, form, (DocExample){.shown = example->scene, .before = ""});
                }
            }
        }
    }
}

Doc *doc_of_builtins(Unit *unit)
{
    Doc *doc = arena_new(&unit->arena, Doc);
    *doc = (Doc){.unit = unit, .title = "Built in", .path = "example", .prefix = "", .use = "", .include = ""};
    doc->intro = "What every scene can call. A scene's own words of the same name win. What takes an object first is "
                 "also a modifier: "
                 "`a.move(x: 1)`.";
    add_group(doc, "Shapes", NULL);
    for (const stdlib_text_file *file = stdlib_text_files; file->name; file++) {
        const Source *source =
            source_add(&unit->sources, file->name, (const char *)file->text, file->length, (Span){0});
        const Node *tree = parse_source(unit, source);
        for (const Node *item = tree->a; item; item = item->next)
            read_item(doc, source, item, prelude_group(doc, file->name));
    }
    add_prelude_examples(doc);
    read_table(doc);
    finish_doc(doc);
    return doc;
}
