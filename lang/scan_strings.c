// Strings: where they end, their pieces, their escapes. Whether a string ends on its line is found out before its first piece is
// given, so that one that does not is one message and one token, whatever its braces hold.
#include "lang/scan_rules.h"

#include <string.h>

#include "lang/parse.h"
#include "lang/utf8.h"

typedef enum StringEnd { STRING_ENDS, STRING_OPEN, STRING_BRACE_OPEN, STRING_TOO_DEEP } StringEnd;

// Where a comment inside of an interpolation ends, or NULL if not on this line.
static const char *skip_comment(const char *p, const char *end)
{
    if (p[1] == '/') return NULL;
    int depth = 0;
    while (p + 1 < end && *p != '\n') {
        if (p[0] == '/' && p[1] == '*')
            depth++, p += 2;
        else if (p[0] == '*' && p[1] == '/')
            depth--, p += 2;
        else
            p++;
        if (depth == 0) return p;
    }
    return NULL;
}

// The last character of 'text', as scan.l reads it in one word; of a quote that stands alone it itself.
static const char *skip_quoted(const char *p, const char *end)
{
    for (const char *q = p + 1; q < end && *q != '\n'; q++) {
        if (*q == '\'') return q;
    }
    return p;
}

// Follows a string from behind its quote over the strings in it to its end. `depth` interpolations are open; braces[i] counts
// the braces inside of the i-th.
static StringEnd string_end(const char *p, const char *end)
{
    int braces[NODE_DEPTH_MAX];
    int depth = 0;
    bool in_text = true;
    for (; p < end && *p != '\n'; p++) {
        if (in_text) {
            if (*p == '\\' && p + 1 < end && p[1] != '\n') {
                p++;
            } else if (*p == '"') {
                if (depth == 0) return STRING_ENDS;
                in_text = false;
            } else if (*p == '{') {
                if (depth == NODE_DEPTH_MAX) return STRING_TOO_DEEP;
                braces[depth++] = 0;
                in_text = false;
            }
        } else if (*p == '"') {
            in_text = true;
        } else if (*p == '{') {
            braces[depth - 1]++;
        } else if (*p == '}') {
            if (braces[depth - 1]-- == 0) {
                depth--;
                in_text = true;
            }
        } else if (*p == '\'') {
            p = skip_quoted(p, end);
        } else if (*p == '/' && p + 1 < end && (p[1] == '/' || p[1] == '*')) {
            p = skip_comment(p, end);
            if (!p) return STRING_BRACE_OPEN;
            p--;
        }
    }
    return depth ? STRING_BRACE_OPEN : STRING_OPEN;
}

// The quote that ends a string on one of the lines behind it, or NULL: the only one of its line, with something behind it that
// follows strings and not something that begins one.
static const char *end_on_later_line(const char *p, const char *end)
{
    enum { LINES_MAX = 10 };
    int lines = 0;
    for (; p < end && lines <= LINES_MAX; p++) {
        if (*p == '{' || *p == '}') return NULL;
        if (*p == '\n') lines++;
        if (*p != '"') continue;
        const char *rest = p + 1;
        bool alone = !memchr(rest, '"', strcspn(rest, "\n"));
        return alone && (rest == end || strchr(" \t\r\n;,)]}", *rest)) ? p : NULL;
    }
    return NULL;
}

// A string over several lines is one word: in the scanner's copy of the text its line breaks become spaces.
static void join_lines(Scanner *s, uint32_t begin, uint32_t end)
{
    for (uint32_t at = begin; at < end; at++) {
        if (s->buffer[at] == '\n' || s->buffer[at] == '\\') s->buffer[at] = ' ';
    }
    s->unit->lost.silent = scan_span(s, begin + 1, end - begin);
}

bool scan_string_ends(Scanner *s, uint32_t at)
{
    const char *text = s->source->text;
    StringEnd how = string_end(text + at + 1, text + s->source->length);
    if (how == STRING_ENDS) return true;
    Span span = scan_span(s, at, 1);
    const char *later = how == STRING_OPEN ? end_on_later_line(text + at + 1, text + s->source->length) : NULL;
    if (later) {
        Diag *d = diag(s->unit, span, DIAG_UNTERMINATED_STRING,
                       "a string stands on one line: write \\n for a line break in it");
        diag_label(s->unit, d, scan_span(s, (uint32_t)(later - text), 1), "it ends here");
        join_lines(s, at, (uint32_t)(later - text));
        return true;
    }
    if (how == STRING_TOO_DEEP) {
        diag(s->unit, span, DIAG_TOO_DEEP, "strings are nested more than %d deep here: give parts of it names with let",
             NODE_DEPTH_MAX);
    } else if (how == STRING_BRACE_OPEN) {
        diag(s->unit, span, DIAG_UNTERMINATED_STRING,
             "a { in this string is not closed on its line: write } behind the value, or \\{ for a brace");
    } else {
        diag(s->unit, span, DIAG_UNTERMINATED_STRING,
             "this string does not end on its line: write \" where it ends, \\n for a line break");
    }
    // The rest of the line is text, or would have been something else: what seems wrong in it is this mistake.
    uint32_t line = (uint32_t)strcspn(text + at, "\n");
    Span rest = scan_span(s, at + 1, line);
    s->unit->lost.silent = rest;
    lost_text(s->unit, rest);
    return false;
}

// The rest of the line is the string, except for the marks at its end that close what is around it: so the mistake
// stays one.
int scan_broken_string(Scanner *s, uint32_t at, uint32_t length, uint32_t *used)
{
    const char *text = s->source->text + at;
    const char *comment = memmem(text, length, " //", 3);
    if (comment) length = (uint32_t)(comment - text);
    while (length && strchr(" \t\r\n;,)]}", text[length - 1]) && text[length - 1]) length--;
    *used = length;
    s->token->value.text = (Text){text, length};
    return scan_word(s, TOK_STRING, s->piece_begin, at + length - s->piece_begin);
}

static void bad_escape(Scanner *s, uint32_t at, const char *text, uint32_t length)
{
    uint32_t code;
    uint32_t bytes = length > 1 ? (uint32_t)utf8_read(text + 1, length - 1, &code) : 0;
    Diag *d = diag(s->unit, scan_span(s, at, 1 + bytes), DIAG_BAD_ESCAPE,
                   "\\%.*s is no escape: there are \\\" \\\\ \\n \\t \\{ and \\}; a backslash itself is written \\\\",
                   (int)bytes, text + 1);
    diag_fix(s->unit, d, scan_span(s, at, 1), FIX_GUESS, "%s", text[1] == '\'' ? "" : "\\\\");
}

// Replaces the escapes of text[0..length), which stands at offset `at`.
static Text cooked(Scanner *s, uint32_t at, const char *text, uint32_t length)
{
    for (uint32_t i = 0; i < length; i++) {
        if ((unsigned char)text[i] < 0x20 && text[i] != '\t' && text[i] != '\\') {
            diag(s->unit, scan_span(s, at + i, 1), DIAG_BAD_CHARACTER,
                 "a character that cannot be seen (code %d) stands in this string", text[i]);
            break;
        }
    }
    if (!memchr(text, '\\', length)) return (Text){text, length};
    char *out = arena_alloc(&s->unit->arena, length);
    uint32_t count = 0;
    for (uint32_t i = 0; i < length; i++) {
        if (text[i] != '\\') {
            out[count++] = text[i];
            continue;
        }
        char c = i + 1 < length ? text[i + 1] : 0;
        switch (c) {
        case '"':
        case '\\':
        case '{':
        case '}':
            out[count++] = c;
            i++;
            break;
        case 'n':
            out[count++] = '\n';
            i++;
            break;
        case 't':
            out[count++] = '\t';
            i++;
            break;
        default:
            bad_escape(s, at + i, text + i, length - i);
            out[count++] = '\\';
            break;
        }
    }
    return (Text){out, count};
}

int scan_piece(Scanner *s, uint32_t end)
{
    const char *text = s->source->text;
    uint32_t begin = s->piece_begin;
    bool continued = text[begin] == '}';
    bool goes_on = text[end - 1] == '{';
    s->token->value.text = cooked(s, begin + 1, text + begin + 1, end - begin - 2);
    int code = continued ? (goes_on ? TOK_STRING_MIDDLE : TOK_STRING_TAIL) : (goes_on ? TOK_STRING_HEAD : TOK_STRING);
    return scan_word(s, code, begin, end - begin);
}
