// One token is looked at at a time, in step(): either something is put in before it, or it is taken. What is put in has an
// empty span behind the last token. The stream that comes out has matching brackets, so the parser's error
// productions `( error )` and `error ;` always find their end, and the depth of its stack is bounded.
#include "lang/filter.h"

#include <assert.h>
#include <string.h>

#include "lang/classes.h"
#include "lang/parse.h"

void filter_init(Filter *f, Unit *unit, Scanner *scanner)
{
    f->unit = unit;
    f->scanner = scanner;
    f->stack[0] = (Bracket){.closer = TOK_YYEOF};
    f->depth = 0;
    f->look_first = f->look_count = 0;
    f->last = (Token){.span = {scanner->source->base, scanner->source->base}};
    f->last_opened = f->skipping = f->ended = f->end_reported = false;
    f->skip_depth = 0;
    f->semicolon = NULL;
    f->wrong_end = 0;
    f->suspect = (Span){0};
}

static Bracket *innermost(Filter *f)
{
    return &f->stack[f->depth];
}

static Token *peek(Filter *f, unsigned ahead)
{
    assert(ahead < FILTER_LOOK && "looks only as far ahead as there is room");
    while (f->look_count <= ahead) scan(f->scanner, &f->look[(f->look_first + f->look_count++) % FILTER_LOOK]);
    return &f->look[(f->look_first + ahead) % FILTER_LOOK];
}

static void drop(Filter *f)
{
    f->look_first = (f->look_first + 1) % FILTER_LOOK;
    f->look_count--;
}

static Token take(Filter *f)
{
    Token token = *peek(f, 0);
    drop(f);
    return token;
}

// A token that is not written, behind the last one.
static Token put_in(const Filter *f, int code)
{
    return (Token){.code = code, .span = {f->last.span.end, f->last.span.end}};
}

// --- Kinds of tokens ---

static bool is_reserved(int code)
{
    switch (code) {
#define RESERVED(token, ...) case token:
#include "lang/words.def"
        return true;
    default: return false;
    }
}

// Words that begin an item and stand nowhere else; a for stands in lists, too.
static bool begins_only_items(int code)
{
    return token_is(code, TOKEN_ITEM) && code != TOK_FOR;
}

// Could be the last of an item that wants a `;`. A } is not among them: it ends an item by itself.
static bool ends_value(int code)
{
    return token_is(code, TOKEN_ENDS) && code != '}';
}

static bool holds_items(const Bracket *b)
{
    return b->closer == '}' || b->closer == TOK_YYEOF;
}

static const char *opener_text(int closer)
{
    return closer == ')' ? "(" : closer == ']' ? "[" : "{";
}

static const char *closer_text(int closer)
{
    return closer == ')' ? ")" : closer == ']' ? "]" : "}";
}

static bool on_new_line(const Filter *f, const Token *token)
{
    const Source *source = f->scanner->source;
    uint32_t begin = f->last.span.end - source->base, end = token->span.begin - source->base;
    return begin < end && memchr(source->text + begin, '\n', end - begin) != NULL;
}

// --- The semicolon ---

// True if the name that comes next can be the easing of an entry: `2s: 1 smooth;`
static bool may_be_easing(Filter *f, const Bracket *b)
{
    if (!b->item_colon || begins_only_items(b->item_first) || peek(f, 0)->code != TOK_NAME) return false;
    int after = peek(f, 1)->code;
    return after == ';' || after == '}' || after == '(' || after == TOK_YYEOF;
}

// True if the name that comes next can be what a declaration names: `object head = …`
static bool may_be_declared(Filter *f, const Bracket *b)
{
    if (b->item_words != 1 || f->last.code != TOK_NAME || peek(f, 0)->code != TOK_NAME) return false;
    int after = peek(f, 1)->code;
    return !on_new_line(f, peek(f, 0)) || after == '=' || after == '{';
}

// The `;` that a line break stands for in other languages. It is put in only where no scene could go on, so nothing that
// is right is reported: a value ends, the next line begins one, and nothing joins the two.
static bool semicolon_is_missing(Filter *f, const Bracket *b)
{
    const Token *next = peek(f, 0);
    if (!ends_value(f->last.code) || b->item_words == 0 || b->headers > 0) return false;
    if (begins_only_items(next->code)) return true;
    bool next_entry = b->closer == '}' && b->item_colon && next->code == TOK_NAME && peek(f, 1)->code == ':';
    if (next_entry) return true;
    if (!token_begins_item(next->code) || !on_new_line(f, next)) return false;
    return !may_be_easing(f, b) && !may_be_declared(f, b);
}

static void report_semicolon(Filter *f)
{
    bool put_in_before =
        f->last.span.begin == f->last.span.end; // a ) that was missing has its message, and this is the same mistake
    if (f->skipping || put_in_before) return;   // as has what is skipped
    const Source *source = f->scanner->source;
    if (source->text[innermost(f)->item_begin - source->base] == '#')
        return; // a line of another language, reported as such
    Span after = {f->last.span.end, f->last.span.end};
    Diag *d = diag(f->unit, after, DIAG_MISSING_SEMICOLON, "an item ends with a semicolon: write `;` here");
    diag_fix(f->unit, d, after, FIX_SURE, ";");
    f->semicolon = d;
    if (!innermost(f)->semicolon) innermost(f)->semicolon = d;
}

// True if a line begins here with what can only be a declaration: `object head = …`
static bool declaration_begins(Filter *f)
{
    if (peek(f, 0)->code != TOK_NAME || !on_new_line(f, peek(f, 0)) || peek(f, 1)->code != TOK_NAME) return false;
    int after = peek(f, 2)->code;
    return after == '=' || after == '{';
}

// In an error only what certainly begins an item ends the skipping.
static bool restarts_after_error(Filter *f)
{
    const Token *next = peek(f, 0);
    if (!on_new_line(f, next)) return false;
    return begins_only_items(next->code) || next->code == TOK_FOR || declaration_begins(f);
}

// Decides whether a `;` stands before the next token though none is written.
static bool semicolon_comes(Filter *f)
{
    const Bracket *b = innermost(f);
    const Token *next = peek(f, 0);
    if (!holds_items(b) || b->item_words == 0 || next->code == ';') return false;
    if (next->code == b->closer || next->code == TOK_YYEOF) return true; // the end of the file closes what is open
    if (f->skipping && f->depth == f->skip_depth) {
        if (restarts_after_error(f)) return true;
        return f->last.code == '}' && b->headers == 0 && token_begins_item(next->code) && on_new_line(f, next);
    }
    if (f->last.code == '}' && b->headers == 0) {
        return token_begins_item_behind_brace(next->code);
    }
    if (!semicolon_is_missing(f, b)) return false;
    report_semicolon(f);
    return true;
}

// True at a `,` that stands where an entry or value of a block ends: `{ eye: (0, 0, 5), fov: 40deg }`.
static bool comma_for_semicolon(Filter *f)
{
    const Bracket *b = innermost(f);
    if (f->skipping || b->closer != '}' || b->item_words == 0 || b->headers > 0 || peek(f, 0)->code != ',')
        return false;
    if (begins_only_items(b->item_first)) return false;
    return peek(f, 1)->code == '}' || (peek(f, 1)->code == TOK_NAME && peek(f, 2)->code == ':');
}

bool filter_leads_to_stray(const Filter *f, const Token *comma, Span *stray)
{
    const Source *source = f->scanner->source;
    int depth = 0;
    for (const char *at = source->text + (comma->span.end - source->base); !strchr(";{}\"\n", *at); at++) {
        depth += (*at == '(' || *at == '[') - (*at == ')' || *at == ']');
        uint32_t place = source->base + (uint32_t)(at - source->text);
        *stray = (Span){place, place + 1};
        if (depth < 0) return true;
        if (at[0] == '/' && at[1] == '/') break;
    }
    return false;
}

static Token take_comma(Filter *f)
{
    Token comma = take(f);
    comma.code = ';';
    Span stray;
    if (filter_leads_to_stray(f, &comma, &stray)) return comma;
    Diag *d = diag(f->unit, comma.span, DIAG_MISSING_SEMICOLON,
                   "what stands in a block ends with `;`: write it instead of `,`");
    diag_fix(f->unit, d, comma.span, FIX_SURE, ";");
    return comma;
}

static Token give_semicolon(Filter *f, Token token)
{
    Bracket *b = innermost(f);
    b->item_words = 0;
    b->item_colon = b->function = false;
    b->headers = 0;
    return token;
}

// --- Brackets ---

static uint32_t indentation(const Source *source, uint32_t position, bool *first_of_line)
{
    uint32_t at = position - source->base, line = at;
    while (line > 0 && source->text[line - 1] != '\n') line--;
    uint32_t columns = 0;
    while (source->text[line + columns] == ' ' || source->text[line + columns] == '\t') columns++;
    *first_of_line = line + columns == at;
    return columns;
}

// A } that stands further left than the line of its { closes, to the eye, another one: then that { is the one that was forgotten.
static void note_suspect(Filter *f, Span open, Span close)
{
    if (f->suspect.end) return;
    const Source *source = f->scanner->source;
    uint32_t begin = open.begin - source->base, end = close.begin - source->base;
    if (!memchr(source->text + begin, '\n', end - begin)) return;
    bool first, ignored;
    uint32_t closer = indentation(source, close.begin, &first);
    if (first && closer < indentation(source, open.begin, &ignored)) f->suspect = open;
}

static Token open_bracket(Filter *f, Token token, int closer)
{
    if (f->depth == NODE_DEPTH_MAX) {
        diag(f->unit, token.span, DIAG_TOO_DEEP,
             "brackets are nested more than %d deep here: give parts of it names with let", NODE_DEPTH_MAX);
        f->ended = f->end_reported = true;
        return put_in(f, TOK_SCN_YYerror);
    }
    Bracket *outer = innermost(f);
    bool is_body = false;
    if (closer == '}') {
        if (outer->headers > 0 && f->last.code != TOK_ELSE) {
            outer->headers--;
            token.code = TOK_BODY;
            is_body = true;
        }
        if (f->last.code == TOK_ELSE || outer->function) is_body = true;
        outer->function = false;
    }
    f->stack[++f->depth] = (Bracket){.closer = closer, .open = token.span, .is_body = is_body};
    f->last_opened = true;
    return token;
}

// A closing mark that closes nothing. Behind a } of that kind all is outside of the block that it was meant for.
void filter_report_stray(Filter *f, Span span)
{
    char closer = f->scanner->source->text[span.begin - f->scanner->source->base];
    Diag *d = diag(f->unit, span, DIAG_STRAY_BRACKET, "no %s is open here that this %s would close: remove it",
                   opener_text(closer), closer_text(closer));
    diag_fix(f->unit, d, span, FIX_LIKELY, "%s", "");
    if (closer == '}') f->unit->lost.shape = true;
}

static Token close_bracket(Filter *f, Token token)
{
    Bracket *b = innermost(f);
    bool written = token.span.end > token.span.begin;
    if (written && b->stray.end) filter_report_stray(f, b->stray);
    if (token.code == '}' && written) note_suspect(f, b->open, token.span);
    token.code = b->closer;
    f->depth--;
    if (token.code == '}') innermost(f)->opened += b->opened; // the } was meant for what lacks its {
    return token;
}

static void report_unclosed(Filter *f, Span at, const char *what)
{
    const Bracket *b = innermost(f);
    Span silent = f->unit->lost.silent;
    bool in_lost = f->last.span.end > silent.begin && f->last.span.end <= silent.end;
    if (f->unit->lost.shape || in_lost) return; // it may be closed in what was lost
    if (b->closer == TOK_STRING_TAIL) return;   // the scanner has seen that it ends
    // What did not fit inside of it stood where it is because of that.
    for (Diag *last = f->unit->diagnostics.last;
         last && last->code == DIAG_UNEXPECTED && last->span.begin > b->open.begin; last = f->unit->diagnostics.last)
        diag_take_back(f->unit, last);
    Diag *d = diag(f->unit, b->open, DIAG_UNCLOSED, "this %s is not closed: write %s", opener_text(b->closer),
                   closer_text(b->closer));
    diag_label(f->unit, d, at, "it should be closed before %s", what);
    diag_fix(f->unit, d, (Span){f->last.span.end, f->last.span.end}, FIX_LIKELY, "%s", closer_text(b->closer));
    f->wrong_end = f->last.span.end;
}

// The end of the file closes everything, in one message: by the indentation, or else for the innermost.
static void report_unclosed_at_end(Filter *f, Span end)
{
    bool lost = f->unit->lost.shape;
    f->unit->lost.shape = true;
    if (f->end_reported || lost) return;
    f->end_reported = true;
    const Bracket *b = innermost(f);
    if (b->stray.end) {
        Diag *d = diag(f->unit, b->open, DIAG_UNCLOSED, "this %s is closed by the wrong mark: write %s instead",
                       opener_text(b->closer), closer_text(b->closer));
        diag_label(f->unit, d, b->stray, "closed here");
        diag_fix(f->unit, d, b->stray, FIX_LIKELY, "%s", closer_text(b->closer));
        return;
    }
    Span open = b->closer == '}' && f->suspect.end ? f->suspect : b->open;
    // What lacks its } goes on into what follows it, and its last value lacked no `;`.
    for (int i = f->depth; i > 0; i--)
        if (f->stack[i].open.begin == open.begin && f->stack[i].semicolon)
            diag_take_back(f->unit, f->stack[i].semicolon);
    Diag *d = diag(f->unit, open, DIAG_UNCLOSED, "this %s is not closed: write %s", opener_text(b->closer),
                   closer_text(b->closer));
    int labels = 0;
    for (int i = f->depth - 1; i > 0 && labels < 3; i--, labels++) {
        diag_label(f->unit, d, f->stack[i].open, "and this %s", opener_text(f->stack[i].closer));
    }
    if (open.begin != b->open.begin)
        diag_label(f->unit, d, b->open, "at the end of the file this one is open");
    else
        diag_fix(f->unit, d, (Span){end.begin, end.begin}, FIX_GUESS, "%s", closer_text(b->closer));
}

// True if a bracket that `closer` closes is open, inside of what a stronger one encloses. ( and [ do not reach through {, and
// nothing reaches through a string.
static bool is_open(const Filter *f, int closer)
{
    for (int i = f->depth; i > 0; i--) {
        if (f->stack[i].closer == closer) return true;
        if (f->stack[i].closer == TOK_STRING_TAIL) return false;
        if (closer != '}' && f->stack[i].closer == '}') return false;
    }
    return false;
}

// At a closing mark that is not the innermost bracket's. Returns false if the mark is to be left out.
static bool close_other(Filter *f, Token *given)
{
    Token next = *peek(f, 0);
    Bracket *b = innermost(f);
    if (is_open(f, next.code)) { // the brackets inside of it were forgotten
        report_unclosed(f, next.span, "this");
        *given = close_bracket(f, put_in(f, b->closer));
        return true;
    }
    if (!holds_items(b) && b->closer != TOK_STRING_TAIL) { // the wrong mark: (1, 2]
        Diag *d = diag(f->unit, b->open, DIAG_UNCLOSED, "this %s is closed by the wrong mark: write %s instead of %s",
                       opener_text(b->closer), closer_text(b->closer), closer_text(next.code));
        diag_label(f->unit, d, next.span, "closed here");
        diag_fix(f->unit, d, next.span, FIX_LIKELY, "%s", closer_text(b->closer));
        *given = close_bracket(f, take(f));
        return true;
    }
    take(f);
    if (b->forgiven > 0 && next.code != '}') {
        b->forgiven--; // its bracket was closed above, with a message
        return false;
    }
    if (b->opened > 0 && next.code == '}') {
        b->opened--;
        f->unit->lost.shape = true;
        return false;
    }
    if (f->skipping) return false; // what is skipped has its message
    if (f->depth > 0 && !b->stray.end) {
        b->stray = next.span; // whether it was meant to close this bracket is seen when that is closed
        return false;
    }
    filter_report_stray(f, next.span);
    return false;
}

// --- Reserved words ---

// A reserved word where only a name makes sense is reported and becomes one.
static void name_reserved_word(Filter *f)
{
    Token *next = peek(f, 0);
    if (!is_reserved(next->code)) return;
    int before = f->last.code;
    if (before == next->code && begins_only_items(before) && peek(f, 1)->code == TOK_NAME && !f->skipping) {
        Diag *d = diag(f->unit, next->span, DIAG_UNEXPECTED, "`%s` stands twice: remove one", token_text(before));
        diag_fix(f->unit, d, next->span, FIX_SURE, "%s", "");
        drop(f);
        return;
    }
    bool wanted = before == TOK_LET || before == TOK_FN || before == TOK_TAG || before == TOK_TOOL ||
                  before == TOK_PARAM || before == TOK_AS || before == '.' ||
                  (before == TOK_FOR && next->code != TOK_IN);
    if (!wanted && next->code != TOK_TRUE && next->code != TOK_FALSE) {
        int after = peek(f, 1)->code;
        const Bracket *b = innermost(f);
        bool first = holds_items(b) && (b->item_words == 0 || (before == '}' && b->headers == 0));
        bool nameless = first && (next->code == TOK_LET || next->code == TOK_PARAM); // `let = 3;` lacks its name
        bool entry = after == ':' && next->code != TOK_ELSE && (!nameless || b->closer == '}');
        wanted = (after == '=' && !nameless) || entry;
        bool second = holds_items(b) && b->item_words == 1 && before == TOK_NAME;
        bool goes_on = next->code == TOK_AND || next->code == TOK_OR; // a or { b }
        wanted = wanted || (second && !goes_on && after == '{' && next->code != TOK_IF && next->code != TOK_NOT);
    }
    if (!wanted || f->skipping) return;
    const char *word = token_text(next->code);
    Diag *d = diag(f->unit, next->span, DIAG_RESERVED_WORD,
                   "`%s` is a word of the language and cannot be a name: write another, such as %s_", word, word);
    diag_fix(f->unit, d, next->span, FIX_GUESS, "%s_", word);
    next->code = TOK_NAME;
    next->value.name = name_text(&f->unit->names, word); // what was written may be a look-alike or a foreign form
}

// --- Steps ---

static void report_no_member(Filter *f)
{
    Span after = {f->last.span.end, f->last.span.end};
    if (!f->skipping) diag(f->unit, after, DIAG_UNEXPECTED, "after a point stands a name: write a.x or a.move(…)");
    f->wrong_end = after.end;
}

// At the ( of `for (i = 0; i < 3; i++)`, whose semicolons would end items: one message, and the whole head is left out.
static bool is_counting_for(Filter *f)
{
    if (f->last.code != TOK_FOR || peek(f, 0)->code != '(' || peek(f, 1)->code != TOK_NAME) return false;
    return peek(f, 2)->code == '=' || (peek(f, 2)->code == TOK_NAME && peek(f, 3)->code == '=');
}

static Token leave_out_head(Filter *f)
{
    bool typed = peek(f, 2)->code == TOK_NAME;
    const char *name = peek(f, typed ? 2 : 1)->value.name;
    Token open = take(f);
    Diag *d = diag(f->unit, open.span, DIAG_FOREIGN_SYNTAX, "a for walks a range or a list: write for %s in 0..5 { … }",
                   name);
    int depth = 1;
    while (depth > 0) {
        int code = peek(f, 0)->code;
        if (code == TOK_YYEOF || code == '{' || code == '}') break;
        depth += (code == '(') - (code == ')');
        open.span.end = take(f).span.end;
    }
    d->span = open.span;
    open.code = TOK_SCN_YYerror;
    return open;
}

// Counts the token to the item that it is part of.
static void note_word(Filter *f, int code)
{
    Bracket *b = innermost(f);
    if (b->item_words == 0) b->item_begin = peek(f, 0)->span.begin;
    if (!holds_items(b)) {
        if (code == TOK_IF || code == TOK_FOR) b->headers++;
        return;
    }
    if (b->item_words++ == 0) b->item_first = code;
    if (code == ':') b->item_colon = true;
    if (code == TOK_IF || code == TOK_FOR) b->headers++;
    if (code == TOK_FN || code == TOK_TAG || code == TOK_TOOL) b->function = true;
}

// Closes what a `;` or a word that begins an item shows to be unclosed.
static bool item_in_brackets(Filter *f, int code)
{
    const Bracket *b = innermost(f);
    return (b->closer == ')' || b->closer == ']') && (code == ';' || begins_only_items(code) || declaration_begins(f));
}

// Gives a token, or returns false if one was left out.
static bool step(Filter *f, Token *given)
{
    name_reserved_word(f);
    Token next = {.code = peek(f, 0)->code, .span = peek(f, 0)->span};
    Bracket *b = innermost(f);
    f->last_opened = false;
    f->semicolon = NULL;
    if (f->last.code == '.' && next.code != TOK_NAME && next.code != TOK_SCN_YYerror) {
        report_no_member(f);
        *given = put_in(f, TOK_MISSING);
        return true;
    }
    if (semicolon_comes(f)) {
        *given = give_semicolon(f, put_in(f, ';'));
        return true;
    }
    if (comma_for_semicolon(f)) {
        *given = give_semicolon(f, take_comma(f));
        return true;
    }
    if (item_in_brackets(f, next.code)) {
        report_unclosed(f, next.span, "this");
        *given = close_bracket(f, put_in(f, b->closer));
        innermost(f)->forgiven++;
        return true;
    }
    if (is_counting_for(f)) {
        *given = leave_out_head(f);
        return true;
    }
    switch (next.code) {
    case '(':
        note_word(f, '(');
        *given = open_bracket(f, take(f), ')');
        return true;
    case '[':
        note_word(f, '[');
        *given = open_bracket(f, take(f), ']');
        return true;
    case '{':
        note_word(f, '{');
        *given = open_bracket(f, take(f), '}');
        return true;
    case TOK_STRING_HEAD:
        note_word(f, next.code);
        *given = open_bracket(f, take(f), TOK_STRING_TAIL);
        return true;
    case ')':
    case ']':
    case '}':
        if (b->closer == next.code) {
            *given = close_bracket(f, take(f));
            return true;
        }
        return close_other(f, given);
    case TOK_STRING_MIDDLE:
    case TOK_STRING_TAIL:
        if (b->closer != TOK_STRING_TAIL) {
            report_unclosed(f, next.span, "this");
            *given = close_bracket(f, put_in(f, b->closer));
            return true;
        }
        *given = next.code == TOK_STRING_TAIL ? close_bracket(f, take(f)) : take(f);
        return true;
    case TOK_YYEOF:
        if (f->depth == 0) {
            f->ended = true;
            *given = take(f);
            return true;
        }
        report_unclosed_at_end(f, next.span);
        *given = close_bracket(f, put_in(f, b->closer));
        return true;
    case ';': *given = holds_items(b) ? give_semicolon(f, take(f)) : take(f); return true;
    default:
        note_word(f, next.code);
        *given = take(f);
        return true;
    }
}

static bool ends_skipping(const Filter *f, const Token *token)
{
    if (token->code == TOK_YYEOF || f->depth < f->skip_depth) return true;
    return f->depth == f->skip_depth && (token->code == ';' || token->code == TOK_STRING_MIDDLE);
}

// True for numbers and the marks between them, where brackets hold values: nothing is decided there, and long lists of numbers are
// most of a large scene.
static bool is_plain(const Filter *f, int code)
{
    int closer = f->stack[f->depth].closer;
    if ((closer != ')' && closer != ']') || f->last.code == '.') return false;
    return code == TOK_INT || code == TOK_REAL || code == ',' || code == '-' || code == '+' || code == '*' ||
           code == '/';
}

const Token *filter_next(Filter *f)
{
    if (!f->skipping && !f->ended && is_plain(f, peek(f, 0)->code)) {
        f->last_opened = false;
        f->last = *peek(f, 0);
        drop(f);
        return &f->last;
    }
    Token token = {0};
    for (;;) {
        if (f->ended) {
            token = put_in(f, TOK_YYEOF);
            break;
        }
        if (!step(f, &token)) continue;
        f->last = token;
        if (!f->skipping || ends_skipping(f, &token)) break;
    }
    f->last = token;
    f->skipping = false;
    if (token.code == TOK_SCN_YYerror) filter_recover(f);
    return &f->last;
}

void filter_recover(Filter *f)
{
    switch (f->last.code) {
    case ';':
    case ')':
    case ']':
    case '}':
    case TOK_STRING_MIDDLE:
    case TOK_STRING_TAIL:
    case TOK_YYEOF: return;
    default: break;
    }
    f->skipping = true;
    f->skip_depth = f->last_opened ? f->depth - 1 : f->depth;
}

bool filter_goes_on_wrong(const Filter *f, const Token *token)
{
    const Source *source = f->scanner->source;
    const Diag *last = f->unit->diagnostics.last;
    uint32_t wrong = f->wrong_end;
    if (last && last->severity == SEVERITY_ERROR && last->span.end > wrong)
        wrong = last->span.end; // of the scanner, too
    if (wrong <= source->base || token->span.begin < wrong) return false;
    const char *at = source->text + (wrong - source->base), *end = source->text + (token->span.begin - source->base);
    while (at < end && strchr(" \t)]", *at)) at++;
    return at == end;
}

void filter_forgive_brace(Filter *f)
{
    f->stack[f->last_opened && f->depth > 0 ? f->depth - 1 : f->depth].opened++;
}

bool filter_in_arguments(const Filter *f)
{
    const Bracket *b = &f->stack[f->depth];
    return b->closer == '}' && !b->is_body;
}
