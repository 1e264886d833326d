// What is said where the text cannot go on. The parser knows every token that could stand there; people want to know what is
// missing. So the tokens are gathered into few words: all that begin a value are "a value", all operators "an operator" and
// named only when nothing else could stand there, and marks are named themselves. Frequent mistakes have words of their own.
#include "lang/parser.h"

#include <string.h>

#include "lang/classes.h"
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
        if (e.value && token_is(code, TOKEN_BEGINS)) continue;
        if (e.item && (token_is(code, TOKEN_ITEM) || code == ';')) continue;
        if (e.operation && token_is(code, TOKEN_CONTINUES)) continue;
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
    return token_is(code, TOKEN_CONTINUES) && code != '.' && code != '(' && code != '[' && code != '{';
}

// --- Mistakes that have words of their own ---

// Words that begin an item in other languages, and what is written here. They may be names in a scene, so they count only where the
// text cannot go on.
static const char let_advice[] = "a name gets its value by let: write let a = …;"; // only where an item begins

static const struct {
    const char *words, *advice;
} foreign_words[] = {
    {" def define function func fun proc procedure macro sub ",
     "a function is written fn f(x: scalar) { … }, and a shape of one's own tag f(r: scalar) { … }"},
    {" module class struct shape type ", "a shape of one's own is written tag name(r: scalar) { … }"},
    {" import require from using load ", "a file is brought by include \"file.scn\";, a library by use name;"},
    {" return yield ", "a block ends with its value: leave this word out"},
    {" repeat loop foreach ", "a for walks a range or a list: write for i in 0..5 { … }"},
    {" while until do ",
     "values do not change, so nothing is done until they do: a for walks a range or a list, for i in 0..5 { … }"},
    {" var const local set auto double float real int scalar ", let_advice},
    {" version ", "the version of the language is said by scn 1; in the first line"},
    {" elif elsif elseif ", "another condition is written } else if a { … }"},
    {" switch case when ", "a choice by value is written match(v) { 1: a; 2: b; }"},
    {" echo printf write puts ", "what is to be seen while compiling is written print value;"},
    {" then ", "a condition stands alone: write if a { … } else { … }"},
};

static bool goes_on(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

static const char *advice_for(const char *text, const char *end, bool begins)
{
    size_t length = 0;
    while (text + length < end && goes_on(text[length])) length++;
    char padded[16];
    if (length == 0 || length > sizeof padded - 3) return NULL;
    snprintf(padded, sizeof padded, " %.*s ", (int)length, text);
    for (size_t i = 0; i < sizeof foreign_words / sizeof *foreign_words; i++) {
        if (foreign_words[i].advice == let_advice && !begins) continue;
        if (strstr(foreign_words[i].words, padded)) return foreign_words[i].advice;
    }
    return NULL;
}

// The name that ends before a place, with space between; empty if another mark stands there.
static Span word_before(const Parser *p, uint32_t position)
{
    const char *text = p->source->text;
    uint32_t end = position - p->source->base;
    while (end > 0 && strchr(" \t\r\n", text[end - 1])) end--;
    uint32_t begin = end;
    while (begin > 0 && goes_on(text[begin - 1])) begin--;
    return (Span){p->source->base + begin, p->source->base + end};
}

static const char *text_at(const Parser *p, uint32_t position)
{
    return p->source->text + (position - p->source->base);
}

static bool report_foreign_word(Parser *p, const Token *found)
{
    const Filter *f = &p->filter;
    const Bracket *b = &f->stack[f->last_opened && f->depth > 0 ? f->depth - 1 : f->depth];
    bool items = b->closer == '}' || b->closer == TOK_YYEOF;
    const char *end = p->source->text + p->source->length;
    const char *advice = advice_for(text_at(p, found->span.begin), end, items);
    Span at = found->span;
    if (!advice && items && b->item_begin && b->item_begin < found->span.begin && found->code != '}') {
        at.begin = b->item_begin;
        advice = advice_for(text_at(p, at.begin), end, true);
        at.end = at.begin;
        while (goes_on(*text_at(p, at.end))) at.end++;
    }
    if (!advice) return false;
    diag(p->unit, at, DIAG_FOREIGN_SYNTAX, "%s", advice);
    return true;
}

static bool has_mark(const Expected *e, const char *mark)
{
    for (int i = 0; i < e->mark_count; i++) {
        if (!strcmp(e->marks[i], mark)) return true;
    }
    return false;
}

// True if the line goes on to a } that closes nothing in it.
static bool leads_to_brace(const Parser *p, const Token *found)
{
    int depth = 0;
    for (const char *at = text_at(p, found->span.begin); *at && *at != '\n' && depth >= 0; at++)
        depth += (*at == '{') - (*at == '}');
    return depth < 0;
}

// Behind a name, where two of them are a declaration: `sphere 1`, `object a: b`, `object my-ball`.
static bool report_after_names(Parser *p, const Token *found, const Expected *e)
{
    Span name = word_before(p, found->span.begin);
    int length = (int)(name.end - name.begin);
    const char *text = text_at(p, name.begin);
    if (length == 0) return false;
    bool in_call = has_mark(e, ":") && has_mark(e, ",") && has_mark(e, ")");
    bool twice = found->code == TOK_NAME && (int)(found->span.end - found->span.begin) == length &&
                 !memcmp(text_at(p, found->span.begin), text, (size_t)length);
    if (twice && (in_call || has_mark(e, "="))) {
        Diag *d = diag(p->unit, found->span, DIAG_UNEXPECTED, "%.*s stands twice: remove one", length, text);
        diag_fix(p->unit, d, found->span, FIX_LIKELY, "%s", "");
        return true;
    }
    if (in_call && token_is(found->code, TOKEN_BEGINS)) {
        Diag *d = diag(p->unit, found->span, DIAG_NAMED_ARGUMENT,
                       "an argument with a name is written with a colon: write %.*s: …", length, text);
        diag_fix(p->unit, d, (Span){name.end, name.end}, FIX_LIKELY, ":");
        lost_line(p->unit, found->span); // where these are parameters, they are not defined
        return true;
    }
    if (e->name && has_mark(e, "=") && token_is(found->code, TOKEN_BEGINS) && filter_in_arguments(&p->filter)) {
        Diag *d = diag(p->unit, found->span, DIAG_NAMED_ARGUMENT,
                       "an argument with a name is written with a colon: write %.*s: …;", length, text);
        diag_fix(p->unit, d, (Span){name.end, name.end}, FIX_LIKELY, ":");
        return true;
    }
    if (e->name && has_mark(e, "=") && token_is(found->code, TOKEN_BEGINS)) {
        diag(p->unit, found->span, DIAG_UNEXPECTED, "what a call takes stands in parentheses: write %.*s(…)", length,
             text);
        return true;
    }
    if (e->value || e->name || !has_mark(e, "=")) return false;
    if (found->code == '(' && has_mark(e, "{")) {
        diag(p->unit, found->span, DIAG_UNEXPECTED,
             "a declaration gives its arguments in a block: write %.*s { name: value; }", length, text);
        return true;
    }
    Span first = word_before(p, name.begin);
    bool same =
        first.end - first.begin == name.end - name.begin && !memcmp(text_at(p, first.begin), text, (size_t)length);
    if (found->code == ':' && same) {
        Diag *d = diag(p->unit, name, DIAG_UNEXPECTED, "%.*s stands twice: remove one", length, text);
        diag_fix(p->unit, d, name, FIX_LIKELY, "%s", "");
        return true;
    }
    if (found->code == ':' && has_mark(e, "{") && first.end > first.begin && leads_to_brace(p, found)) {
        Diag *d = diag(p->unit, name, DIAG_UNEXPECTED, "what %.*s takes stands in a block: write { before this",
                       (int)(first.end - first.begin), text_at(p, first.begin));
        diag_fix(p->unit, d, (Span){name.begin, name.begin}, FIX_LIKELY, "{ ");
        return true;
    }
    if (found->code == ':' && has_mark(e, "{")) {
        Diag *d = diag(p->unit, found->span, DIAG_UNEXPECTED, "a declaration gives its value with `=`: write %.*s = …",
                       length, text);
        diag_fix(p->unit, d, found->span, FIX_LIKELY, " =");
        return true;
    }
    if (found->code == '-' && name.end == found->span.begin) {
        diag(p->unit, found->span, DIAG_UNEXPECTED, "names have letters, digits and `_`, and no `-`: write %.*s_…",
             length, text);
        return true;
    }
    return false;
}

// True if an `else` only follows an `if` that was skipped, with a message.
static bool follows_lost(const Parser *p, const Token *found)
{
    const char *text = p->source->text, *at = text_at(p, found->span.begin);
    while (at > text && strchr(" \t\r\n", at[-1])) at--;
    uint32_t position = p->source->base + (uint32_t)(at - text);
    return p->lost.end && position == p->lost.end;
}

static bool report_else(Parser *p, const Token *found, const Expected *e)
{
    if (!e->item) return false;
    const char *behind = text_at(p, found->span.end);
    while (strchr(" \t\r\n", *behind) && *behind) behind++;
    if (*behind == ':')
        diag_fix(p->unit,
                 diag(p->unit, found->span, DIAG_UNEXPECTED, "what holds where no case fits is written default: …;"),
                 found->span, FIX_SURE, "default");
    else if (!follows_lost(p, found))
        diag(p->unit, found->span, DIAG_UNEXPECTED, "an else stands behind the } of an if: if a { … } else { … }");
    return true;
}

// camera { location <0, 2, -3> }: at its first comma, since `location < 0` could be a comparison.
static bool report_pointed_vector(Parser *p, const Token *found)
{
    const char *text = p->source->text, *at = text_at(p, found->span.begin);
    while (at > text && strchr("0123456789.-+eE ", at[-1])) at--;
    if (at == text || at[-1] != '<') return false;
    uint32_t mark = p->source->base + (uint32_t)(at - 1 - text);
    Span name = word_before(p, mark);
    if (name.begin == name.end) return false;
    diag(p->unit, (Span){mark, mark + 1}, DIAG_FOREIGN_SYNTAX,
         "a vector is written in parentheses, and an argument in a block with a colon: %.*s: (0, 0, 1);",
         (int)(name.end - name.begin), text_at(p, name.begin));
    return true;
}

static bool report_comma(Parser *p, const Token *found, const Expected *e)
{
    if (!e->operation || !has_mark(e, ";") || has_mark(e, ",")) return false;
    const char *at = text_at(p, found->span.begin);
    if (at > p->source->text && at[-1] >= '0' && at[-1] <= '9' && at[1] >= '0' && at[1] <= '9') {
        diag_fix(p->unit,
                 diag(p->unit, found->span, DIAG_UNEXPECTED,
                      "the point of a number is `.`, and several values need brackets"),
                 found->span, FIX_GUESS, ".");
        return true;
    }
    if (report_pointed_vector(p, found)) return true;
    Span stray;
    if (filter_leads_to_stray(&p->filter, found, &stray)) {
        filter_report_stray(&p->filter, stray);
        return true;
    }
    diag(p->unit, found->span, DIAG_UNEXPECTED,
         "each value ends with `;`; several in one are a vector (0, 0, 5), a list [0, 0, 5], or what a call takes: "
         "f(0, 0, 5)");
    return true;
}

static bool is_word(const Parser *p, const Token *found, const char *word)
{
    size_t length = strlen(word);
    return found->span.end - found->span.begin == length && !memcmp(text_at(p, found->span.begin), word, length);
}

// translate([1, 0, 0]) sphere(1); color("red") cube(2);: what stands in front of a shape in other languages.
static bool report_modifier_in_front(Parser *p, const Token *found)
{
    static const struct {
        const char *written, *ours;
    } modifiers[] = {
        {"translate", "move(1, 0, 0)"}, {"move", "move(1, 0, 0)"},       {"rotate", "rotate(x: 90deg)"},
        {"scale", "scale(2)"},          {"mirror", "mirror((1, 0, 0))"}, {"color", "paint(#ff8000)"},
        {"resize", "scale(2)"},         {"multmatrix", "matrix([…])"},
    };
    const Bracket *b = &p->filter.stack[p->filter.depth];
    if (!b->item_begin) return false;
    const char *begin = text_at(p, b->item_begin);
    size_t length = 0;
    while (goes_on(begin[length])) length++;
    for (size_t i = 0; i < sizeof modifiers / sizeof *modifiers; i++) {
        if (strlen(modifiers[i].written) != length || memcmp(modifiers[i].written, begin, length) != 0) continue;
        char here[64];
        describe_found(p, found, here, sizeof here);
        int shape = (int)(found->span.end - found->span.begin);
        diag(p->unit, (Span){b->item_begin, b->item_begin + (uint32_t)length}, DIAG_FOREIGN_SYNTAX,
             "a modifier stands behind what it changes: write %.*s(…).%s", shape < 40 ? shape : 0,
             text_at(p, found->span.begin), modifiers[i].ours);
        return true;
    }
    return false;
}

// Behind a value that is complete.
static bool report_second_value(Parser *p, const Token *found, const Expected *e)
{
    if (!e->operation || e->value) return false;
    if (has_mark(e, "{") && !has_mark(e, ";") && is_word(p, found, "step")) {
        diag(p->unit, found->span, DIAG_UNEXPECTED,
             "a for walks each whole number: count the turns, for i in 0..5 { … 2 * i … }");
        return true;
    }
    if (has_mark(e, "{") && !has_mark(e, ";")) {
        diag(p->unit, found->span, DIAG_UNEXPECTED, "what an if or a for decides on stands in a block: write { … }");
        return true;
    }
    const char *text = p->source->text, *at = text_at(p, found->span.begin);
    while (at > text && strchr(" \t\r\n", at[-1])) at--;
    if (has_mark(e, ",") && (has_mark(e, ")") || has_mark(e, "]")) && !token_is(found->code, TOKEN_CONTINUES)) {
        uint32_t end = p->source->base + (uint32_t)(at - text);
        Diag *d = diag(p->unit, found->span, DIAG_UNEXPECTED, "a comma stands between the %s: write `,` before this",
                       has_mark(e, ")") ? "arguments of a call, and the numbers of a vector" : "elements of a list");
        diag_fix(p->unit, d, (Span){end, end}, FIX_LIKELY, ",");
        return true;
    }
    if (found->code != TOK_NAME || !has_mark(e, ";") || at == text || at[-1] != ')') return false;
    if (report_modifier_in_front(p, found)) return true;
    char here[64];
    describe_found(p, found, here, sizeof here);
    diag(p->unit, found->span, DIAG_UNEXPECTED,
         "expected `;` or an operator before %s; a modifier stands behind what it changes: a.move(…)", here);
    return true;
}

// tag ring { … }, use brushes.dent;
static bool report_header(Parser *p, const Token *found, const Expected *e)
{
    Span name = word_before(p, found->span.begin);
    int length = (int)(name.end - name.begin);
    if (length && found->code == '{' && e->mark_count == 1 && has_mark(e, "(") && !e->operation && !e->value) {
        Diag *d = diag(p->unit, found->span, DIAG_UNEXPECTED,
                       "what is defined has parentheses, with nothing in them if it has no parameters: write %.*s()",
                       length, text_at(p, name.begin));
        diag_fix(p->unit, d, (Span){name.end, name.end}, FIX_SURE, "()");
        return true;
    }
    if (found->code == '.' && has_mark(e, ":") && has_mark(e, "as") && has_mark(e, ";")) {
        Diag *d =
            diag(p->unit, found->span, DIAG_UNEXPECTED,
                 "single words of a library are brought by a colon: use %.*s: word;", length, text_at(p, name.begin));
        diag_fix(p->unit, d, found->span, FIX_SURE, ": ");
        return true;
    }
    return false;
}

// push: scalar = 800; in a file, at its `=`.
static bool report_declaration_without_word(Parser *p, const Token *found)
{
    const Bracket *b = &p->filter.stack[p->filter.depth];
    if (b->closer != TOK_YYEOF || !b->item_colon || b->item_first != TOK_NAME) return false;
    const char *name = text_at(p, b->item_begin);
    int length = 0;
    while (goes_on(name[length])) length++;
    Diag *d = diag(p->unit, found->span, DIAG_UNEXPECTED,
                   "what is declared begins with a word: write param %.*s: … = …, or let %.*s = …", length, name,
                   length, name);
    diag_fix(p->unit, d, (Span){b->item_begin, b->item_begin}, FIX_GUESS, "param ");
    return true;
}

// True if it was one.
static bool report_known(Parser *p, const Token *found, const Expected *e)
{
    if (report_foreign_word(p, found) || report_after_names(p, found, e)) return true;
    if (token_is(found->code, TOKEN_BEGINS) && report_second_value(p, found, e)) return true;
    if (e->string && !e->value && !e->name) {
        diag(p->unit, found->span, DIAG_UNEXPECTED,
             "the name of a file stands in double quotes: include \"file.scn\";");
        return true;
    }
    if (report_header(p, found, e)) return true;
    switch (found->code) {
    case TOK_FOR: // [2 * i for i in 0..5], as in other languages
        if (!e->operation || !has_mark(e, "]")) return false;
        diag(p->unit, found->span, DIAG_FOREIGN_SYNTAX,
             "a for stands in front of its values, which stand in a block: write [for i in 0..5 { … }]");
        return true;
    case TOK_ELSE: return report_else(p, found, e);
    case ',': return report_comma(p, found, e);
    case '<':
        if (!e->value) return false;
        diag(p->unit, found->span, DIAG_FOREIGN_SYNTAX, "a vector is written in parentheses: (0, 0, 1)");
        return true;
    case '=':
        if (!e->operation && has_mark(e, "{") && !has_mark(e, "=")) {
            diag(p->unit, found->span, DIAG_UNEXPECTED,
                 "what a function gives stands in a block: write { … } instead of = …");
            return true;
        }
        if (!e->operation) return false;
        if (report_declaration_without_word(p, found)) return true;
        diag_fix(p->unit,
                 diag(p->unit, found->span, DIAG_UNEXPECTED,
                      "values are compared with `==`; `=` stands in let and declarations"),
                 found->span, FIX_GUESS, "==");
        return true;
    case TOK_FN:
        if (!e->value || e->item) return false;
        diag(p->unit, found->span, DIAG_UNEXPECTED,
             "a function is no value: write fn name(x: scalar) { … } in the file, and call it by its name");
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

// Nothing behind the token is read as it was meant.
static void lose_shape(Parser *p, const Token *found)
{
    p->unit->lost.shape = true;
    p->unit->lost.silent = (Span){found->span.end + 1, p->source->base + p->source->length};
}

void report_unexpected(Parser *p, const Token *found, const int *expected, int count)
{
    if (p->filter.end_reported) return; // what does not fit now was put in at the end, where something is not closed
    bool again = !p->filter.semicolon && filter_goes_on_wrong(&p->filter, found);
    p->filter.wrong_end = found->span.end;
    if (again) return;
    if (p->filter.semicolon) diag_take_back(p->unit, p->filter.semicolon); // something else was missing
    Expected e = gather(expected, count);
    if (has_mark(&e, "{") && found->code != TOK_YYEOF) filter_forgive_brace(&p->filter);
    if (report_known(p, found, &e)) return;
    char wanted[256], here[64];
    describe(&e, wanted, sizeof wanted);
    describe_found(p, found, here, sizeof here);
    if (e.value && !e.item && is_binary_operator(found->code)) {
        diag(p->unit, found->span, DIAG_UNEXPECTED, "a value is missing before the operator %s", here);
    } else if (wanted[0]) {
        diag(p->unit, found->span, DIAG_UNEXPECTED, "expected %s before %s", wanted, here);
        bool body = found->code == ';' && found->span.begin == found->span.end && !e.item && has_mark(&e, "{");
        if (body) lose_shape(p, found); // a body whose { was forgotten ends in a } that closes nothing
    } else {
        diag(p->unit, found->span, DIAG_UNEXPECTED, "%s cannot stand here", here);
    }
}
