// Reading bison's report: <rule><lhs>…</lhs><rhs><symbol>…</symbol>…</rhs></rule>, <terminal name prec assoc> and <nonterminal name type>.
#include <expat.h>
#include <stdlib.h>
#include <string.h>

#include "tests/docs/grammar.h"
#include "tests/docs/section.h"

typedef struct Reading {
    Grammar *grammar;
    XML_Parser parser;
    char text[200]; // of the element that is open
    size_t length;
    const char *name;
    Part *parts[100];
    int count;
    bool in_rules;
} Reading;

static _Noreturn void fail(const char *path, const char *message)
{
    fprintf(stderr, "%s: %s\n", path, message);
    exit(3);
}

Part *part_leaf(Arena *arena, PartKind kind, const char *text)
{
    Part *part = arena_new(arena, Part);
    *part = (Part){.kind = kind, .text = text};
    return part;
}

Part *grammar_token(Grammar *grammar, const char *token)
{
    static const struct {
        const char *token, *text;
    } words[] = {
#define RESERVED(token, word, ...) {#token, word},
#define MARK(token, mark, ...)     {#token, mark},
#include "lang/words.def"
    };
    if (token[0] == '\'') return part_leaf(&grammar->arena, PART_WORD, arena_text(&grammar->arena, token + 1, 1));
    if (strcmp(token, "BODY") == 0) return part_leaf(&grammar->arena, PART_WORD, "{");
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (strncmp(words[i].token, "TOK_", 4) == 0 && strcmp(words[i].token + 4, token) == 0)
            return part_leaf(&grammar->arena, PART_WORD, words[i].text);
    bool class = token[0] >= 'A' && token[0] <= 'Z';
    return part_leaf(&grammar->arena, class ? PART_CLASS : PART_RULE,
                     arena_text(&grammar->arena, token, strlen(token)));
}

static const char *attribute(const char **attributes, const char *name)
{
    for (; *attributes; attributes += 2)
        if (strcmp(attributes[0], name) == 0) return attributes[1];
    return NULL;
}

static const char *kept(Reading *r, const char *text)
{
    return text ? arena_text(&r->grammar->arena, text, strlen(text)) : NULL;
}

static void begin_element(void *user, const char *element, const char **attributes)
{
    Reading *r = user;
    Grammar *g = r->grammar;
    r->length = 0;
    if (g->production_count == GRAMMAR_MAX || g->level_count == GRAMMAR_MAX || g->list_count == GRAMMAR_MAX)
        fail("the report", "has more rules or tokens than there is room for");
    if (strcmp(element, "rules") == 0) r->in_rules = true;
    if (strcmp(element, "rule") == 0 && r->in_rules) {
        r->count = 0;
        g->productions[g->production_count].precedence = kept(r, attribute(attributes, "percent_prec"));
    } else if (strcmp(element, "terminal") == 0 && attribute(attributes, "prec")) {
        g->levels[g->level_count++] = (Level){.name = kept(r, attribute(attributes, "name")),
                                              .level = atoi(attribute(attributes, "prec")),
                                              .side = kept(r, attribute(attributes, "assoc"))};
    } else if (strcmp(element, "nonterminal") == 0) {
        const char *type = attribute(attributes, "type");
        if (type && strcmp(type, "list") == 0) g->lists[g->list_count++] = kept(r, attribute(attributes, "name"));
    }
}

static void end_element(void *user, const char *element)
{
    Reading *r = user;
    Grammar *g = r->grammar;
    r->text[r->length] = 0;
    if (strcmp(element, "rules") == 0) r->in_rules = false;
    if (!r->in_rules) return;
    if (strcmp(element, "lhs") == 0) r->name = kept(r, r->text);
    if (strcmp(element, "symbol") == 0) {
        if (r->count == (int)(sizeof r->parts / sizeof *r->parts)) fail(r->name, "is too long");
        r->parts[r->count++] = grammar_token(g, r->text);
    }
    if (strcmp(element, "rule") != 0 || r->name[0] == '$') return; // $accept is bison's own
    Part *sequence = part_leaf(&g->arena, PART_SEQUENCE, NULL);
    sequence->parts = arena_array(&g->arena, Part *, r->count + 1);
    sequence->count = r->count;
    memcpy(sequence->parts, r->parts, (size_t)r->count * sizeof *r->parts);
    g->productions[g->production_count].name = r->name;
    g->productions[g->production_count++].sequence = sequence;
}

static void read_text(void *user, const char *text, int length)
{
    Reading *r = user;
    for (int i = 0; i < length && r->length + 1 < sizeof r->text; i++) r->text[r->length++] = text[i];
}

// A production begins a line of the grammar with its name and a colon, or with a bar.
static bool begins_production(const char *line)
{
    size_t name = strspn(line, "abcdefghijklmnopqrstuvwxyz_");
    if (name > 0) return line[name] == ':';
    return line[strspn(line, " ")] == '|';
}

static void read_foreign(Grammar *grammar, const char *path)
{
    char *text = section_read(path);
    if (!text) fail(path, "is not there");
    char *line = strstr(text, "\n%%"), *end = line ? strstr(line + 3, "\n%%") : NULL;
    if (!end) fail(path, "has no %% around its rules");
    int count = 0;
    for (line++; line < end; line += strcspn(line, "\n") + 1) {
        if (!begins_production(line)) continue;
        if (count == grammar->production_count) fail(path, "has more productions than bison's report");
        const char *mark = strstr(line, "// foreign");
        grammar->productions[count++].foreign = mark && mark < line + strcspn(line, "\n");
    }
    if (count != grammar->production_count)
        fail(path, "has fewer productions than bison's report: one begins each line");
    free(text);
}

void grammar_read(Grammar *grammar, const char *report_path, const char *grammar_path)
{
    char *text = section_read(report_path);
    if (!text) fail(report_path, "is not there");
    Reading reading = {.grammar = grammar, .parser = XML_ParserCreate("UTF-8")};
    if (!reading.parser) fail(report_path, "no memory to read it");
    XML_SetUserData(reading.parser, &reading);
    XML_SetElementHandler(reading.parser, begin_element, end_element);
    XML_SetCharacterDataHandler(reading.parser, read_text);
    if (!XML_Parse(reading.parser, text, (int)strlen(text), 1))
        fail(report_path, XML_ErrorString(XML_GetErrorCode(reading.parser)));
    XML_ParserFree(reading.parser);
    free(text);
    if (grammar->production_count == 0) fail(report_path, "has no rules");
    read_foreign(grammar, grammar_path);
}
