// Keeps the grammar of the reference true to the parser's.
//
//     scn-grammar REPORT.xml parse.y reference.md FOLDER
//
// REPORT.xml is what `bison --xml` says of parse.y. Compared, or with UPDATE=1 written anew, are the parts `grammar`, `precedence` and
// `diagrams` of the reference and a picture FOLDER/RULE.svg for each rule; a picture of a rule that is no more is a failure. Exit status: 0, 1
// where something differs, 2 for a wrong call, 3 where a file fails.
#include "tests/docs/grammar.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>

#include "tests/docs/section.h"

typedef struct Text { // what is being written
    FILE *out;
    char *text;
    size_t length;
} Text;

static FILE *text_begin(Text *text)
{
    *text = (Text){0};
    text->out = open_memstream(&text->text, &text->length);
    if (!text->out) abort();
    return text->out;
}

static bool keep_part(Text *text, const char *path, const char *name)
{
    fclose(text->out);
    bool good = section_keep(path, name, text->text);
    free(text->text);
    return good;
}

static bool keep_pictures(Arena *arena, const Rule *rules, int count, const char *folder)
{
    bool good = true;
    for (int i = 0; i < count; i++) {
        Text text;
        grammar_railroad(text_begin(&text), arena, &rules[i]);
        fclose(text.out);
        good &= section_keep_file(arena_printf(arena, "%s/%s.svg", folder, rules[i].name), text.text);
        free(text.text);
    }
    return good;
}

// Pictures that no rule has.
static bool no_others(const Rule *rules, int count, const char *folder)
{
    bool good = true;
    DIR *dir = opendir(folder);
    for (struct dirent *entry; dir && (entry = readdir(dir));) {
        const char *suffix = strstr(entry->d_name, ".svg");
        bool known = !suffix;
        for (int i = 0; i < count && !known; i++)
            known = strlen(rules[i].name) == (size_t)(suffix - entry->d_name) &&
                    !strncmp(rules[i].name, entry->d_name, strlen(rules[i].name));
        if (known) continue;
        printf("%s/%s: there is no such rule: remove it\n", folder, entry->d_name);
        good = false;
    }
    if (dir) closedir(dir);
    return good;
}

int main(int argc, char **argv)
{
    if (argc != 5) {
        fputs("usage: scn-grammar REPORT.xml PARSE.y REFERENCE.md FOLDER\n", stderr);
        return 2;
    }
    static Grammar grammar;
    Rule rules[GRAMMAR_MAX];
    grammar_read(&grammar, argv[1], argv[2]);
    int count = grammar_simplify(&grammar, rules);
    const char *reference = argv[3], *folder = argv[4];

    Text text;
    FILE *out = text_begin(&text);
    fputs("```ebnf\n", out);
    grammar_ebnf(out, rules, count);
    fputs("```\n", out);
    bool good = keep_part(&text, reference, "grammar");
    grammar_precedence(text_begin(&text), &grammar);
    good &= keep_part(&text, reference, "precedence");
    out = text_begin(&text);
    for (int i = 0; i < count; i++)
        fprintf(out, "`%s`\n\n![%s](grammar/%s.svg)\n\n", rules[i].name, rules[i].name, rules[i].name);
    good &= keep_part(&text, reference, "diagrams");
    good &= keep_pictures(&grammar.arena, rules, count, folder);
    good &= no_others(rules, count, folder);
    printf("%s: %d rules of %d productions\n", reference, count, grammar.production_count);
    arena_release(&grammar.arena);
    return !good;
}
