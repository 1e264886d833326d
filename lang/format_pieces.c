// The words come from the scanner through the filter, so a piece is what the parser sees; what lies between two words is space and
// comments, and is read here. A string with values in it is one piece: its inside is the author's.
#include <string.h>

#include "lang/filter.h"
#include "lang/formatter.h"
#include "lang/parse.h"
#include "lang/utf8.h"

typedef struct Reader {
    Pieces *pieces;
    Arena *arena;
    const char *text;
    int open[NODE_DEPTH_MAX + 1];
    int depth;
    uint32_t line, line_at; // the line of the offset line_at
} Reader;

static int columns_of(const char *text, uint32_t length)
{
    int columns = 0;
    for (uint32_t i = 0; i < length;) {
        uint32_t code;
        i += (uint32_t)utf8_read(text + i, length - i, &code);
        columns += (int)utf8_columns(code, (uint32_t)columns);
    }
    return columns;
}

static void *grown(Arena *arena, void *list, int count, int *capacity, size_t size)
{
    if (count < *capacity) return list;
    *capacity = *capacity ? *capacity * 2 : 256;
    void *larger = arena_alloc_array(arena, size, (size_t)*capacity);
    if (count) memcpy(larger, list, (size_t)count * size);
    return larger;
}

static uint32_t comment_end(const char *text, uint32_t at, uint32_t end)
{
    if (text[at + 1] == '/') {
        const char *line = memchr(text + at, '\n', end - at);
        return line ? (uint32_t)(line - text) : end;
    }
    int depth = 0;
    while (at + 1 < end) {
        if (text[at] == '/' && text[at + 1] == '*')
            depth++, at += 2;
        else if (text[at] == '*' && text[at + 1] == '/')
            depth--, at += 2;
        else
            at++;
        if (depth == 0) return at;
    }
    return end;
}

static uint32_t without_space(const char *text, uint32_t begin, uint32_t end)
{
    while (end > begin && is_blank(text[end - 1])) end--;
    return end;
}

static void add_comment(Reader *r, Piece *piece, Comment comment)
{
    Pieces *p = r->pieces;
    const char *text = r->text + comment.begin;
    uint32_t length = comment.end - comment.begin;
    comment.ends_line = text[1] == '/';
    comment.several_lines = memchr(text, '\n', length) != NULL;
    comment.columns = columns_of(text, length);
    if (comment.ends_line || comment.several_lines || comment.breaks) piece->forced = true;
    if (comment.breaks || comment.several_lines) piece->on_new_line = true;
    piece->comment_columns += comment.columns + 1;
    p->comments = grown(r->arena, p->comments, p->comment_count, &p->comment_capacity, sizeof *p->comments);
    p->comments[p->comment_count++] = comment;
    piece->comment_count++;
}

// What lies between the piece before, which ends at `at`, and a piece.
static void read_gap(Reader *r, Piece *piece, uint32_t at)
{
    piece->comments = r->pieces->comment_count;
    int breaks = 0;
    while (at < piece->begin) {
        char c = r->text[at];
        if (c == '/') {
            uint32_t end = comment_end(r->text, at, piece->begin);
            Comment comment = {
                .begin = at, .end = without_space(r->text, at, end), .breaks = (uint8_t)(breaks > 2 ? 2 : breaks)};
            add_comment(r, piece, comment);
            breaks = 0;
            at = end;
            continue;
        }
        if (c == '\n') breaks++;
        at++;
    }
    piece->breaks = (uint8_t)(breaks > 2 ? 2 : breaks);
    if (breaks) piece->on_new_line = true;
}

static void match_brackets(Reader *r, Piece *piece, int index)
{
    switch (piece->code) {
    case '(':
    case '[':
    case '{':
    case TOK_BODY: r->open[r->depth++] = index; break;
    case ')':
    case ']':
    case '}':
        piece->match = r->open[--r->depth];
        r->pieces->list[piece->match].match = index;
        break;
    default: break;
    }
}

static void add_piece(Reader *r, int code, uint32_t begin, uint32_t end)
{
    Pieces *p = r->pieces;
    uint32_t before = p->count ? p->list[p->count - 1].end : 0;
    Piece piece = {
        .code = code, .text = r->text + begin, .begin = begin, .end = end, .length = end - begin, .match = NO_PIECE};
    piece.columns = columns_of(piece.text, piece.length);
    read_gap(r, &piece, before);
    while (r->line_at < begin) r->line += r->text[r->line_at++] == '\n';
    piece.line = r->line;
    p->list = grown(r->arena, p->list, p->count, &p->capacity, sizeof *p->list);
    p->list[p->count] = piece;
    match_brackets(r, &p->list[p->count], p->count);
    p->count++;
}

Pieces pieces_read(Unit *unit, const Source *source, Arena *arena)
{
    Pieces pieces = {.source = source};
    Reader reader = {.pieces = &pieces, .arena = arena, .text = source->text, .line = 1};
    Scanner scanner;
    Filter filter;
    scanner_init(&scanner, unit, source);
    filter_init(&filter, unit, &scanner);
    int strings = 0; // that are open around
    uint32_t string_begin = 0;
    const Token *token;
    do {
        token = filter_next(&filter);
        uint32_t begin = token->span.begin - source->base, end = token->span.end - source->base;
        if (token->code == TOK_STRING_HEAD && strings++ == 0) string_begin = begin;
        if (token->code == TOK_STRING_TAIL && --strings == 0)
            add_piece(&reader, TOK_STRING, string_begin, end);
        else if (!strings)
            add_piece(&reader, token->code, begin, end);
    } while (token->code != TOK_YYEOF);
    scanner_release(&scanner);
    return pieces;
}
