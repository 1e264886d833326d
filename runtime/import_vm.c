#include "runtime/import_vm.h"

#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct Form { // how an operation is written here; %a and %b are its operands
    const char *name;
    int operands;
    const char *text;
} Form;

static const Form forms[] = {
    {"var-x", 0, "x"},
    {"var-y", 0, "y"},
    {"var-z", 0, "z"},
    {"add", 2, "%a + %b"},
    {"sub", 2, "%a - %b"},
    {"mul", 2, "%a * %b"},
    {"div", 2, "%a / %b"},
    {"max", 2, "max(%a, %b)"},
    {"min", 2, "min(%a, %b)"},
    {"neg", 1, "-%a"},
    {"square", 1, "%a^2"},
    {"sqrt", 1, "sqrt(%a)"},
    {"recip", 1, "1 / %a"},
    {"abs", 1, "abs(%a)"},
    {"exp", 1, "exp(%a)"},
    {"ln", 1, "log(%a)"},
    {"log", 1, "log(%a)"},
    {"sin", 1, "sin(%a * 1rad)"},
    {"cos", 1, "cos(%a * 1rad)"},
    {"tan", 1, "tan(%a * 1rad)"},
    {"asin", 1, "asin(%a) / 1rad"},
    {"acos", 1, "acos(%a) / 1rad"},
    {"atan", 1, "atan(%a) / 1rad"},
    {"atan2", 2, "atan2(%a, %b) / 1rad"},
    {"pow", 2, "%a^%b"},
    {"mod", 2, "mod(%a, %b)"},
    {"floor", 1, "floor(%a)"},
    {"ceil", 1, "ceil(%a)"},
    {"round", 1, "round(%a)"},
};

typedef struct Word {
    const char *begin;
    size_t length;
} Word;

typedef struct Known { // a name, chained by its hash
    Word name;
    uint32_t next;
} Known;

typedef struct Import {
    Arena *arena;
    FILE *out;
    Known *known; // [1, count)
    uint32_t count, capacity;
    uint32_t heads[4096];
    uint32_t line;
    Failure *failure;
} Import;

static bool wrong(Import *m, const char *what, Word word)
{
    int length = word.length > 60 ? 60 : (int)word.length;
    return fail(m->failure, "line %u: %s '%.*s'", m->line, what, length, word.begin);
}

// --- names

static uint32_t head_of(Word name)
{
    uint32_t hash = 2166136261u;
    for (size_t k = 0; k < name.length; k++) hash = (hash ^ (unsigned char)name.begin[k]) * 16777619u;
    return hash % 4096;
}

static uint32_t find(const Import *m, Word name)
{
    uint32_t k = m->heads[head_of(name)];
    while (k &&
           (m->known[k].name.length != name.length || memcmp(m->known[k].name.begin, name.begin, name.length) != 0))
        k = m->known[k].next;
    return k;
}

static void add(Import *m, Word name)
{
    if (m->count == m->capacity) {
        uint32_t capacity = m->capacity ? 2 * m->capacity : 1024;
        Known *known = arena_array(m->arena, Known, capacity);
        if (m->count) memcpy(known, m->known, m->count * sizeof *known);
        m->known = known;
        m->capacity = capacity;
    }
    uint32_t *head = &m->heads[head_of(name)];
    m->known[m->count] = (Known){name, *head};
    *head = m->count++;
}

// --- lines

static Word next_word(const char **at, const char *end)
{
    while (*at < end && isspace((unsigned char)**at)) (*at)++;
    Word word = {*at, 0};
    while (*at < end && !isspace((unsigned char)**at)) (*at)++;
    word.length = (size_t)(*at - word.begin);
    return word;
}

static bool is(Word word, const char *text)
{
    return word.length == strlen(text) && !memcmp(word.begin, text, word.length);
}

static bool write_number(Import *m, Word word)
{
    char text[64], *end;
    if (!word.length) return fail(m->failure, "line %u: const wants a number", m->line);
    if (word.length >= sizeof text) return wrong(m, "not a number:", word);
    memcpy(text, word.begin, word.length);
    text[word.length] = 0;
    double value = strtod(text, &end);
    if (*end || !isfinite(value)) return wrong(m, "not a number:", word);
    // What looks like an int would be one, with its arithmetic and its limits.
    snprintf(text, sizeof text, "%.17g", value);
    fprintf(m->out, "%s%s", text, text[strcspn(text, ".e")] ? "" : ".0");
    return true;
}

static bool write_form(Import *m, const Form *form, const uint32_t operands[2])
{
    for (const char *c = form->text; *c; c++) {
        if (*c == '%')
            fprintf(m->out, "v%u", operands[*++c == 'b']);
        else
            fputc(*c, m->out);
    }
    return true;
}

static bool write_value(Import *m, Word op, const char **at, const char *end)
{
    if (!op.length) return fail(m->failure, "line %u: an operation is missing behind the name", m->line);
    if (is(op, "const")) return write_number(m, next_word(at, end));
    for (size_t k = 0; k < sizeof forms / sizeof *forms; k++) {
        if (!is(op, forms[k].name)) continue;
        uint32_t operands[2] = {0};
        for (int i = 0; i < forms[k].operands; i++) {
            Word name = next_word(at, end);
            if (!name.length)
                return fail(m->failure, "line %u: %s wants %d value%s, and there %s %d", m->line, forms[k].name,
                            forms[k].operands, forms[k].operands == 1 ? "" : "s", i == 1 ? "is" : "are", i);
            operands[i] = find(m, name);
            if (!operands[i]) return wrong(m, "no value above has the name", name);
        }
        return write_form(m, &forms[k], operands);
    }
    return wrong(m, "there is no operation", op);
}

static bool read_line(Import *m, const char *at, const char *end)
{
    Word name = next_word(&at, end);
    if (!name.length || name.begin[0] == '#') return true;
    if (find(m, name)) return wrong(m, "there is a value above with the name", name);
    fprintf(m->out, "let v%u = ", m->count);
    if (!write_value(m, next_word(&at, end), &at, end)) return false;
    Word rest = next_word(&at, end);
    if (rest.length) return wrong(m, "nothing is to follow, and there is", rest);
    fputs(";\n", m->out);
    add(m, name);
    return true;
}

static bool read_lines(Import *m, const char *text, size_t length)
{
    const char *end = text + length;
    while (text < end) {
        const char *stop = memchr(text, '\n', (size_t)(end - text));
        if (!stop) stop = end;
        m->line++;
        if (!read_line(m, text, stop)) return false;
        text = stop < end ? stop + 1 : end;
    }
    if (m->count == 1) return fail(m->failure, "there is no operation in it");
    fprintf(m->out, "field(-v%u);\n", m->count - 1);
    return true;
}

const char *import_vm(Arena *arena, const char *text, size_t length, size_t *result_length, Failure *failure)
{
    char *written = NULL;
    size_t size = 0;
    Arena scratch = {0};
    Import *m = arena_new(&scratch, Import);
    *m = (Import){
        .arena = &scratch, .out = open_memstream(&written, &size), .count = 1, .capacity = 0, .failure = failure};
    m->known = arena_array(&scratch, Known, 1024);
    m->capacity = 1024;
    if (!m->out) abort();
    fputs("scn 1;\n", m->out);
    bool ok = read_lines(m, text, length);
    if (fclose(m->out)) abort();
    const char *result = ok ? arena_text(arena, written, size) : NULL;
    *result_length = size;
    free(written);
    arena_release(&scratch);
    return result;
}
