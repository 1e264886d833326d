// Writes the words of the language as JSON, for editors: words.json in the build folder.
//
//     {"reserved": [{"word", "kind", "about"} …], "units": […], "marks": […], "types": […],
//      "built_in": [{"word", "kind", "signature", "about", "later"} …]}
//
// The kind of a reserved word or mark is its role in the table, that of a unit its dimension; types and marks have no "about".
//
// They come from the tables of the scanner (lang/words.def) and the checker (compiler/builtins.def, the types), and from the tags and
// tools of the prelude, so no list of words is written twice.
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/builtins.h"
#include "lang/ast.h"
#include "lang/unit.h"
#include "stdlib_text.h"

static cJSON *add_word(cJSON *list, const char *word, size_t length, const char *about)
{
    cJSON *entry = cJSON_CreateObject();
    char *text = strndup(word, length);
    if (!entry || !text) abort();
    cJSON_AddStringToObject(entry, "word", text);
    if (about) cJSON_AddStringToObject(entry, "about", about);
    cJSON_AddItemToArray(list, entry);
    free(text);
    return entry;
}

static void add_kind(cJSON *entry, const char *kind)
{
    cJSON_AddStringToObject(entry, "kind", kind);
}

static const char *const kinds[] = {[KIND_SET] = "set",
                                    [KIND_SHAPE] = "shape",
                                    [KIND_PERTURBATION] = "perturbation",
                                    [KIND_OPERATION] = "operation",
                                    [KIND_MODIFIER] = "modifier",
                                    [KIND_THING] = "thing",
                                    [KIND_ANSWER] = "answer",
                                    [KIND_FUNCTION] = "function",
                                    [KIND_CONSTANT] = "constant"};

static void add_table(cJSON *list)
{
    for (int k = 0; k < BUILTIN_END; k++) {
        const Builtin *b = &builtins[k];
        cJSON *entry = add_word(list, b->signature, strcspn(b->signature, "(: "), b->doc);
        add_kind(entry, kinds[b->kind]);
        cJSON_AddStringToObject(entry, "signature", b->signature);
        cJSON_AddBoolToObject(entry, "later", b->since == SINCE_LATER);
    }
}

// What a file of the prelude holds.
static const char *prelude_kind(const char *file)
{
    static const char *const files[][2] = {
        {"shapes", "shape"}, {"tools", "perturbation"}, {"easings", "easing"}, {"modifiers", "modifier"}};
    for (size_t k = 0; k < sizeof files / sizeof *files; k++) {
        if (strstr(file, files[k][0])) return files[k][1];
    }
    return "function";
}

// The tags, tools and functions of the prelude; names that begin with _ are its own.
static void add_prelude(cJSON *list)
{
    Unit unit;
    unit_init(&unit);
    for (const stdlib_text_file *file = stdlib_text_files; file->name; file++) {
        const Source *source = source_add(&unit.sources, file->name, (const char *)file->text, file->length, (Span){0});
        const Node *tree = parse_source(&unit, source);
        for (const Node *item = tree->a; item; item = item->next) {
            bool word = item->kind == NODE_TAG || item->kind == NODE_TOOL || item->kind == NODE_FN;
            if (!word || item->name[0] == '_') continue;
            cJSON *entry = add_word(list, item->name, strlen(item->name), item->doc);
            add_kind(entry, prelude_kind(file->name));
            cJSON_AddBoolToObject(entry, "later", false);
        }
    }
    unit_release(&unit);
}

int main(int argc, char **argv)
{
    FILE *out = argc > 1 ? fopen(argv[1], "w") : stdout;
    if (!out) {
        perror(argv[1]);
        return 3;
    }
    cJSON *json = cJSON_CreateObject();
    cJSON *reserved = cJSON_AddArrayToObject(json, "reserved"), *units = cJSON_AddArrayToObject(json, "units");
    cJSON *marks = cJSON_AddArrayToObject(json, "marks"), *types = cJSON_AddArrayToObject(json, "types");
    cJSON *built_in = cJSON_AddArrayToObject(json, "built_in");
#define RESERVED(token, word, role, meaning) add_kind(add_word(reserved, word, strlen(word), meaning), role);
#define UNIT(id, suffix, dimension, meaning)                                                                           \
    add_kind(add_word(units, suffix, strlen(suffix), dimension ": " meaning), dimension);
#define MARK(token, mark, role) add_kind(add_word(marks, mark, strlen(mark), NULL), role);
#include "lang/words.def"
    for (const char *const *name = type_names; *name; name++)
        add_kind(add_word(types, *name, strlen(*name), NULL), "type");
    add_table(built_in);
    add_prelude(built_in);
    char *text = cJSON_Print(json);
    if (!text) abort();
    int status = fputs(text, out) < 0 || fputc('\n', out) == EOF || fclose(out) != 0 ? 3 : 0;
    cJSON_free(text);
    cJSON_Delete(json);
    return status;
}
