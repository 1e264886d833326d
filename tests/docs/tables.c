// Keeps the tables of what is built in true to the compiler's.
//
//     scn-tables reference.md
//
// Compared, or with UPDATE=1 written anew, are these parts of the reference (section.h), each a table of signatures and what they mean:
//
//     reserved words, units, marks
//                       the fixed words, of lang/words.def
//     built-in KIND     what is there of a kind of compiler/builtins.def, and of the prelude's file of that kind
//     library NAME      the tools, tags and functions of a library of stdlib
//     not-yet           what is read and answered with not-yet: words, and arguments of words
//
// Every parameter of camera, light and material has to have a row of its own in the text, so that none stays without a word about it. Exit status: 0, 1 where something differs, 2 for a wrong call, 3 where a file fails.
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/builtins.h"
#include "lang/ast.h"
#include "lang/unit.h"
#include "library_text.h"
#include "stdlib_text.h"
#include "tests/docs/section.h"

static const struct {
    BuiltinKind kind;
    const char *name, *prelude; // the file of the prelude that has words of this kind
} kinds[] = {{KIND_SHAPE, "shapes", "shapes"},
             {KIND_SET, "sets", NULL},
             {KIND_PERTURBATION, "perturbations", "tools"},
             {KIND_OPERATION, "operations", "operations"},
             {KIND_MODIFIER, "modifiers", "modifiers"},
             {KIND_THING, "things", NULL},
             {KIND_ANSWER, "answers", NULL},
             {KIND_FUNCTION, "functions", "functions"},
             {KIND_CONSTANT, "values", NULL}};

// --- Signatures ---

// The end of the parameter that begins at `text`: its comma, or the bracket that closes the list.
static const char *parameter_end(const char *text)
{
    int depth = 0;
    for (bool string = false; *text; text++) {
        if (*text == '"') string = !string;
        if (string) continue;
        if (depth == 0 && (*text == ',' || *text == ')')) return text;
        depth += (*text == '(' || *text == '[') - (*text == ')' || *text == ']');
    }
    return text;
}

static bool is_later(const char *begin, const char *end)
{
    static const char mark[] = " later";
    size_t length = sizeof mark - 1;
    return (size_t)(end - begin) > length && memcmp(end - length, mark, length) == 0;
}

// Calls `use` for each parameter of a signature.
static void for_each_parameter(const char *signature, void (*use)(void *, const char *, const char *), void *user)
{
    const char *p = strchr(signature, '(');
    if (!p) return;
    for (p++; *p && *p != ')';) {
        const char *end = parameter_end(p);
        use(user, p, end);
        p = *end == ',' ? end + 1 + strspn(end + 1, " ") : end;
    }
}

typedef struct Listing { // parameters that are being written
    FILE *out;
    bool later; // those that are not there yet, by name; else the others, whole
    int count;
} Listing;

static void put_parameter(void *user, const char *begin, const char *end)
{
    Listing *list = user;
    if (is_later(begin, end) != list->later) return;
    if (list->count++ > 0) fputs(", ", list->out);
    if (list->later)
        fprintf(list->out, "`%.*s`", (int)strcspn(begin, ":"), begin);
    else
        fprintf(list->out, "%.*s", (int)(end - begin), begin);
}

static const char *behind_parameters(const char *signature)
{
    const char *p = strchr(signature, '(');
    if (!p) return signature + strlen(signature);
    for (p++; *p && *p != ')'; p = *p == ',' ? p + 1 : p) p = parameter_end(p);
    return *p ? p + 1 : p;
}

static void put_signature(FILE *out, const char *signature)
{
    Listing list = {.out = out};
    size_t name = strcspn(signature, "(");
    fprintf(out, "%.*s", (int)name, signature);
    if (!signature[name]) return;
    fputc('(', out);
    for_each_parameter(signature, put_parameter, &list);
    fprintf(out, ")%s", behind_parameters(signature));
}

// In a table a bar is escaped and a line's end is a space. A text of several paragraphs gives its first.
static void put_cell(FILE *out, const char *text)
{
    for (; text && *text && strncmp(text, "\n\n", 2) != 0; text++) {
        if (*text == '|') fputc('\\', out);
        fputc(*text == '\n' ? ' ' : *text, out);
    }
}

static void put_row(FILE *out, const char *signature, const char *doc)
{
    char *text = NULL;
    size_t length = 0;
    FILE *cell = open_memstream(&text, &length);
    if (!cell) abort();
    put_signature(cell, signature);
    fclose(cell);
    fputs("| `", out);
    put_cell(out, text);
    fputs("` | ", out);
    put_cell(out, doc);
    fputs(" |\n", out);
    free(text);
}

// --- What is written in SCN ---

// The signature of a tag, tool or fn: its text up to its block, without its first word and comments, each space once.
static void put_item(FILE *out, const Source *source, const Node *item)
{
    const char *p = source->text + (item->name_span.begin - source->base);
    const char *end = source->text + (item->span.end - source->base);
    char *text = malloc((size_t)(end - p) + 1), *to = text;
    if (!text) abort();
    for (; p < end && *p != '{'; p++) {
        if (strncmp(p, "//", 2) == 0) p += strcspn(p, "\n");
        bool space = isspace((unsigned char)*p);
        if (space && to > text && to[-1] == '(') continue;
        if (!space || (to > text && to[-1] != ' ')) *to++ = space ? ' ' : *p;
    }
    while (to > text && to[-1] == ' ') to--;
    *to = 0;
    put_row(out, text, item->doc);
    free(text);
}

static int put_items(FILE *out, const char *name, const unsigned char *text, size_t length)
{
    Unit unit;
    unit_init(&unit);
    const Source *source = source_add(&unit.sources, name, (const char *)text, length, (Span){0});
    const Node *tree = parse_source(&unit, source);
    int count = 0;
    for (const Node *item = tree->a; item; item = item->next) {
        bool word = item->kind == NODE_TAG || item->kind == NODE_TOOL || item->kind == NODE_FN;
        if (!word || item->name[0] == '_') continue;
        put_item(out, source, item);
        count++;
    }
    unit_release(&unit);
    return count;
}

static int put_prelude(FILE *out, const char *name)
{
    int count = 0;
    for (const stdlib_text_file *file = stdlib_text_files; name && file->name; file++)
        if (strstr(file->name, name))
            count += put_items(out, file->name, (const unsigned char *)file->text, file->length);
    return count;
}

// --- Tables ---

static const char table_head[] = "| | |\n| --- | --- |\n";

typedef struct Table {
    FILE *out;
    char *text;
    size_t length;
    int rows;
} Table;

static void table_begin(Table *table, const char *head)
{
    *table = (Table){0};
    table->out = open_memstream(&table->text, &table->length);
    if (!table->out) abort();
    fputs(head, table->out);
}

static bool table_keep(Table *table, const char *path, const char *part)
{
    fclose(table->out);
    bool good = section_keep(path, part, table->rows ? table->text : "None yet (section 14).\n");
    free(table->text);
    return good;
}

static bool keep_words(const char *path)
{
    static const char *const words[][3] = {
#define RESERVED(token, word, role, meaning) {"reserved words", word, meaning},
#define UNIT(id, suffix, dimension, meaning) {"units", suffix, dimension ": " meaning},
#define MARK(token, mark, role)              {"marks", mark, ""},
#include "lang/words.def"
    };
    static const char *const parts[] = {"reserved words", "units", "marks"};
    bool good = true;
    for (size_t p = 0; p < sizeof parts / sizeof *parts; p++) {
        Table table;
        bool marks = strcmp(parts[p], "marks") == 0; // they need no words about them: one line
        table_begin(&table, marks ? "```text\n" : table_head);
        for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
            if (strcmp(words[i][0], parts[p]) != 0) continue;
            if (marks)
                fprintf(table.out, "%s%s", table.rows ? " " : "", words[i][1]);
            else
                put_row(table.out, words[i][1], words[i][2]);
            table.rows++;
        }
        if (marks) fputs("\n```\n", table.out);
        good &= table_keep(&table, path, parts[p]);
    }
    return good;
}

static bool keep_kind(const char *path, int k)
{
    Table table;
    char part[64];
    table_begin(&table, table_head);
    for (int id = 0; id < BUILTIN_END; id++) {
        const Builtin *b = &builtins[id];
        if (b->kind != kinds[k].kind || b->since == SINCE_LATER) continue;
        put_row(table.out, b->signature, b->doc);
        table.rows++;
    }
    table.rows += put_prelude(table.out, kinds[k].prelude);
    snprintf(part, sizeof part, "built-in %s", kinds[k].name);
    return table_keep(&table, path, part);
}

static bool keep_easings(const char *path)
{
    Table table;
    table_begin(&table, table_head);
    table.rows = put_prelude(table.out, "easings");
    return table_keep(&table, path, "built-in easings");
}

static bool keep_libraries(const char *path)
{
    bool good = true;
    for (const library_text_file *file = library_text_files; file->name; file++) {
        Table table;
        char part[64];
        table_begin(&table, table_head);
        table.rows = put_items(table.out, file->name, (const unsigned char *)file->text, file->length);
        snprintf(part, sizeof part, "library %.*s", (int)strcspn(file->name, "."), file->name);
        good &= table_keep(&table, path, part);
    }
    return good;
}

static bool keep_later(const char *path)
{
    Table table;
    table_begin(&table, table_head);
    for (int id = 0; id < BUILTIN_END; id++) {
        const Builtin *b = &builtins[id];
        if (b->since == SINCE_LATER) {
            put_row(table.out, b->signature, b->doc);
            table.rows++;
            continue;
        }
        Listing list = {.out = NULL, .later = true};
        char *text = NULL;
        size_t length = 0;
        list.out = open_memstream(&text, &length);
        if (!list.out) abort();
        for_each_parameter(b->signature, put_parameter, &list);
        fclose(list.out);
        if (list.count) fprintf(table.out, "| %s of `%.*s` | |\n", text, (int)strcspn(b->signature, "("), b->signature);
        table.rows += list.count;
        free(text);
    }
    return table_keep(&table, path, "not-yet");
}

// A new file of the prelude needs a table.
static bool prelude_is_told(void)
{
    bool all = true;
    for (const stdlib_text_file *file = stdlib_text_files; file->name; file++) {
        bool told = strstr(file->name, "easings") != NULL;
        for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
            told |= kinds[k].prelude && strstr(file->name, kinds[k].prelude);
        if (!told)
            printf("stdlib/prelude/%s belongs to no table of tests/docs/tables.c: give it one in `kinds`\n",
                   file->name);
        all &= told;
    }
    return all;
}

// --- Parameters of things ---

typedef struct Search {
    const char *path, *text, *thing;
    int missing;
} Search;

static void find_row(void *user, const char *begin, const char *end)
{
    Search *s = user;
    if (is_later(begin, end)) return;
    char row[100];
    size_t name = strcspn(begin, ":");
    snprintf(row, sizeof row, "| `%.*s: ", (int)name, begin);
    if (strstr(s->text, row)) return;
    printf("%s: section 9.4 has no row for `%.*s` of %.*s\n", s->path, (int)(end - begin), begin,
           (int)strcspn(s->thing, "("), s->thing);
    s->missing++;
}

static int missing_parameters(const char *path)
{
    char *text = section_read(path);
    Search search = {.path = path, .text = text ? text : ""};
    for (int id = 0; id < BUILTIN_END; id++) {
        const Builtin *b = &builtins[id];
        bool told = strncmp(b->signature, "camera(", 7) == 0 || strncmp(b->signature, "light(", 6) == 0 ||
                    strncmp(b->signature, "material(", 9) == 0;
        search.thing = b->signature;
        if (told) for_each_parameter(b->signature, find_row, &search);
    }
    free(text);
    return search.missing;
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        fputs("usage: scn-tables REFERENCE.md\n", stderr);
        return 2;
    }
    bool good = keep_words(argv[1]);
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) good &= keep_kind(argv[1], (int)k);
    good &= keep_easings(argv[1]);
    good &= keep_libraries(argv[1]);
    good &= keep_later(argv[1]);
    good &= prelude_is_told();
    good &= missing_parameters(argv[1]) == 0;
    return !good;
}
