// What is said where the text cannot go on. The parser knows every token that could stand there; people want to know what is
// missing. So the tokens are gathered into few words: all that begin a value are "a value", all operators "an operator" and
// named only when nothing else could stand there, and marks are named themselves. Frequent mistakes have words of their own.
#include "lang/parser.h"

#include <string.h>

#include "lang/diag.h"
#include "lang/parse.h"

typedef struct Expected {
    bool value, item, operation, name, type_or_list, string, whole;
    const char *marks[12]; // in quotes
    int mark_count;
} Expected;

static bool has(const int *expected, int count, int code)
{
    for (int i = 0; i < count; i++) {
        if (expected[i] == code) return true;
    }
    return false;
}

static bool is_operator(int code)
{
    switch (code) {
    case TOK_RANGE:
    case TOK_EQ:
    case TOK_NE:
    case TOK_LE:
    case TOK_GE:
    case '<':
    case '>':
    case '+':
    case '-':
    case '*':
    case '/':
    case '^':
    case '|':
    case '&':
    case '%':
    case '.':
    case '[':
    case '(':
    case '{':
    case TOK_AND:
    case TOK_OR: return true;
    default: return false;
    }
}

static bool is_value(int code)
{
    switch (code) {
    case TOK_NAME:
    case TOK_INT:
    case TOK_REAL:
    case TOK_COLOR:
    case TOK_TRUE:
    case TOK_FALSE:
    case TOK_STRING:
    case TOK_STRING_HEAD:
    case TOK_NOT:
    case TOK_IF:
    case '-':
    case '~':
    case '!':
    case '(':
    case '[':
    case '{': return true;
    default: return false;
    }
}

static bool is_item(int code)
{
    switch (code) {
    case TOK_SCN:
    case TOK_INCLUDE:
    case TOK_USE:
    case TOK_PARAM:
    case TOK_FN:
    case TOK_TAG:
    case TOK_TOOL:
    case TOK_LET:
    case TOK_FOR:
    case TOK_ASSERT:
    case TOK_PRINT: return true;
    default: return false;
    }
}

static void add_mark(Expected *e, const char *text)
{
    if (e->mark_count < (int)(sizeof e->marks / sizeof *e->marks)) e->marks[e->mark_count++] = text;
}

static Expected gather(const int *expected, int count)
{
    Expected e = {0};
    e.value = has(expected, count, TOK_REAL);
    e.item = has(expected, count, TOK_LET);
    e.operation = has(expected, count, '*');
    for (int i = 0; i < count; i++) {
        int code = expected[i];
        if (e.value && is_value(code)) continue;
        if (e.item && (is_item(code) || code == ';')) continue;
        if (e.operation && is_operator(code)) continue;
        switch (code) {
        case TOK_NAME: e.name = true; break;
        case TOK_INT: e.whole = true; break;
        case TOK_STRING: e.string = true; break;
        case '[': e.type_or_list = true; break;
        case TOK_BODY: add_mark(&e, "{"); break;
        case TOK_STRING_MIDDLE:
        case TOK_STRING_TAIL:
            if (!has(expected, i, TOK_STRING_MIDDLE) && !has(expected, i, TOK_STRING_TAIL)) add_mark(&e, "}");
            break;
        case TOK_YYEOF:
        case TOK_MISSING:
        case TOK_SCN_YYUNDEF:
        case '!':
        case '%': break;
        default:
            if (token_text(code)) add_mark(&e, token_text(code));
            break;
        }
    }
    return e;
}

static void append(char *text, size_t size, const char *more)
{
    size_t length = strlen(text);
    if (length < size - 1) strncat(text, more, size - 1 - length);
}

// "a value, `,` or `)`"
static void describe(const Expected *e, char *text, size_t size)
{
    const char *words[20];
    char quoted[12][8];
    int count = 0;
    if (e->item)
        words[count++] = "an item";
    else if (e->value && e->type_or_list)
        words[count++] = "a value or a list";
    else if (e->value)
        words[count++] = "a value";
    if (!e->value && e->name) words[count++] = e->type_or_list ? "a type" : "a name";
    if (!e->value && e->string) words[count++] = "a string";
    if (!e->value && e->whole) words[count++] = "a whole number";
    for (int i = 0; i < e->mark_count; i++) {
        snprintf(quoted[i], sizeof quoted[i], "`%s`", e->marks[i]);
        words[count++] = quoted[i];
    }
    if (e->operation && e->mark_count < 3) words[count++] = "an operator";
    text[0] = 0;
    for (int i = 0; i < count; i++) {
        if (i > 0) append(text, size, i == count - 1 ? " or " : ", ");
        append(text, size, words[i]);
    }
}

static void describe_found(const Parser *p, const Token *found, char *text, size_t size)
{
    const char *source = p->source->text + (found->span.begin - p->source->base);
    uint32_t length = found->span.end - found->span.begin;
    const char *line = memchr(source, '\n', length);
    if (line) length = (uint32_t)(line - source);
    bool cut = length > 24;
    if (cut) length = 24;
    while (cut && length > 0 && ((unsigned char)source[length] & 0xC0) == 0x80) length--; // not inside of a character
    if (found->code == TOK_YYEOF)
        snprintf(text, size, "the end of the file");
    else if (length == 0)
        snprintf(text, size, found->code == ';' ? "the end of the item" : "this");
    else
        snprintf(text, size, "`%.*s%s`", (int)length, source, cut ? "…" : "");
}

static bool is_binary_operator(int code)
{
    return is_operator(code) && code != '.' && code != '(' && code != '[' && code != '{';
}

// The mistakes that have words of their own. True if it was one.
static bool report_known(Parser *p, const Token *found, const Expected *e)
{
    switch (found->code) {
    case '<':
        if (!e->value) return false;
        diag(p->unit, found->span, DIAG_FOREIGN_SYNTAX, "a vector is written in parentheses: (0, 0, 1)");
        return true;
    case '=':
        if (!e->operation) return false;
        diag_fix(p->unit,
                 diag(p->unit, found->span, DIAG_UNEXPECTED,
                      "values are compared with `==`; `=` stands in let and declarations"),
                 found->span, FIX_GUESS, "==");
        return true;
    case ')':
        if (!e->value || e->mark_count) return false;
        diag(p->unit, found->span, DIAG_UNEXPECTED, "a value is missing before `)`");
        return true;
    case '+':
        if (!e->value) return false;
        diag_fix(p->unit,
                 diag(p->unit, found->span, DIAG_UNEXPECTED, "a value is missing before `+`; a number has no sign `+`"),
                 found->span, FIX_GUESS, "%s", "");
        return true;
    default: return false;
    }
}

void report_unexpected(Parser *p, const Token *found, const int *expected, int count)
{
    Expected e = gather(expected, count);
    if (report_known(p, found, &e)) return;
    char wanted[256], here[64];
    describe(&e, wanted, sizeof wanted);
    describe_found(p, found, here, sizeof here);
    if (e.value && !e.item && is_binary_operator(found->code)) {
        diag(p->unit, found->span, DIAG_UNEXPECTED, "a value is missing before the operator %s", here);
    } else if (wanted[0]) {
        diag(p->unit, found->span, DIAG_UNEXPECTED, "expected %s before %s", wanted, here);
    } else {
        diag(p->unit, found->span, DIAG_UNEXPECTED, "%s cannot stand here", here);
    }
}
