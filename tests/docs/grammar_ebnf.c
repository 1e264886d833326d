// The rules as text: { } any number, [ ] optional, | a choice, ( ) a group.
#include <stdlib.h>
#include <string.h>

#include "tests/docs/grammar.h"

enum { COLUMNS = 110, NAME_COLUMNS = 11 };

static void put_part(FILE *out, const Part *part, bool alone);

static void put_joined(FILE *out, const Part *part, const char *between)
{
    for (int i = 0; i < part->count; i++) {
        if (i > 0) fputs(between, out);
        put_part(out, part->parts[i], false);
    }
}

// `alone`: brackets stand around it already.
static void put_part(FILE *out, const Part *part, bool alone)
{
    switch (part->kind) {
    case PART_WORD: fprintf(out, "\"%s\"", part->text); break;
    case PART_CLASS:
    case PART_RULE: fputs(part->text, out); break;
    case PART_SEQUENCE: put_joined(out, part, " "); break;
    case PART_CHOICE:
        if (!alone) fputs("( ", out);
        put_joined(out, part, " | ");
        if (!alone) fputs(" )", out);
        break;
    case PART_OPTIONAL:
    case PART_REPEAT:
    case PART_LOOP:
        fputs(part->kind == PART_OPTIONAL ? "[ " : "{ ", out);
        put_part(out, part->parts[0], true);
        fputs(part->kind == PART_OPTIONAL ? " ]" : " }", out);
        break;
    }
}

static char *text_of(const Part *part)
{
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    if (!out) abort();
    put_part(out, part, true);
    fclose(out);
    return text;
}

// Alternatives that do not fit in one line begin one each if they are long, and fill lines if they are words.
static void put_alternatives(FILE *out, const Part *choice)
{
    size_t column = NAME_COLUMNS + 2, longest = 0;
    char *texts[choice->count];
    for (int i = 0; i < choice->count; i++) {
        texts[i] = text_of(choice->parts[i]);
        size_t length = strlen(texts[i]);
        if (length > longest) longest = length;
    }
    for (int i = 0; i < choice->count; i++) {
        size_t length = strlen(texts[i]) + 3;
        if (i > 0 && (longest > 20 || column + length > COLUMNS)) {
            fprintf(out, "\n%*s", NAME_COLUMNS + 2, "");
            column = NAME_COLUMNS + 2;
        }
        fprintf(out, "%s%s", i > 0 ? "| " : "  ", texts[i]);
        if (i + 1 < choice->count && longest <= 20 && column + length + strlen(texts[i]) <= COLUMNS) fputc(' ', out);
        column += length;
    }
    for (int i = 0; i < choice->count; i++) free(texts[i]);
}

void grammar_ebnf(FILE *out, const Rule *rules, int count)
{
    for (int i = 0; i < count; i++) {
        char *text = text_of(rules[i].body);
        fprintf(out, "%-*s = ", NAME_COLUMNS, rules[i].name);
        if (NAME_COLUMNS + 5 + strlen(text) <= COLUMNS || rules[i].body->kind != PART_CHOICE)
            fputs(text, out);
        else
            put_alternatives(out, rules[i].body);
        fputs(" ;\n", out);
        free(text);
    }
}

// --- Precedence ---

static void put_word(FILE *out, const char *word, bool *first)
{
    fputs(*first ? "`" : " `", out);
    *first = false;
    for (; *word; word++) fprintf(out, *word == '|' ? "\\%c" : "%c", *word);
    fputc('`', out);
}

// What is written for a token of the grammar: itself, or the signs whose productions have its precedence (%prec).
static void put_operators(FILE *out, Grammar *grammar, const Level *level, bool *first, bool *sign)
{
    bool found = false;
    for (int i = 0; i < grammar->production_count; i++) {
        const Production *p = &grammar->productions[i];
        if (!p->precedence || strcmp(p->precedence, level->name) != 0) continue;
        found = *sign = true;
        if (!p->foreign) put_word(out, p->sequence->parts[0]->text, first);
    }
    if (found) return;
    const char *word = grammar_token(grammar, level->name)->text;
    for (int i = 0; i < grammar->production_count; i++) {
        const Production *p = &grammar->productions[i];
        bool used = false;
        for (int k = 0; k < p->sequence->count; k++) used |= strcmp(p->sequence->parts[k]->text, word) == 0;
        if (!used || p->foreign || p->precedence) continue;
        *sign |= p->sequence->count == 2 && strcmp(p->sequence->parts[0]->text, word) == 0;
        put_word(out, word, first);
        return;
    }
}

void grammar_precedence(FILE *out, Grammar *grammar)
{
    int highest = 0;
    for (int i = 0; i < grammar->level_count; i++)
        if (grammar->levels[i].level > highest) highest = grammar->levels[i].level;
    fputs("| operators | |\n| --- | --- |\n", out);
    for (int level = highest; level > 0; level--) {
        bool first = true, sign = false;
        const char *side = "";
        fputs("| ", out);
        for (int i = 0; i < grammar->level_count; i++) {
            if (grammar->levels[i].level != level) continue;
            side = grammar->levels[i].side;
            put_operators(out, grammar, &grammar->levels[i], &first, &sign);
        }
        const char *groups = sign                            ? "before a value"
                             : strcmp(side, "left") == 0     ? "from the left"
                             : strcmp(side, "right") == 0    ? "from the right"
                             : strcmp(side, "nonassoc") == 0 ? "does not chain"
                                                             : "behind a value";
        fprintf(out, " | %s |\n", groups);
    }
}
