// Boxes to text, from the outside in. A box that fits on the rest of its line is written flat; else it is broken, and its parts get their
// turn. Every piece goes through put_piece(), which writes the comments before it too, so none can be lost: a comment that ends its
// line overrules whatever was to stand before the piece.
//
// `indent` is that of the line that a box begins in, `after` the columns that must stay free behind it.
#include <string.h>

#include "lang/formatter.h"
#include "lang/parse.h"
#include "lang/utf8.h"

typedef enum Wanted { WANT_NOTHING, WANT_SPACE, WANT_LINE } Wanted; // before the next piece

typedef struct Trailing { // a comment behind code, whose place is settled at the end
    size_t at;            // in the text, behind the code
    int columns;          // of the code
    int line;             // of the text
} Trailing;

typedef struct Printer {
    const Pieces *pieces;
    Arena *arena;
    char *text;
    size_t length, capacity;
    size_t *begin;
    int column, line;
    Wanted wanted;
    int indent;      // of the line that is wanted
    bool empty_line; // one may stand before it
    bool opened;     // a bracket was written last
    bool ended;      // the line ends with a `//` comment
    Trailing *trailing;
    int trailing_count, trailing_capacity;
} Printer;

// --- Text

static void put(Printer *p, const char *text, size_t length)
{
    if (p->length + length > p->capacity) {
        size_t capacity = (p->length + length) * 2;
        char *larger = arena_alloc(p->arena, capacity);
        if (p->length) memcpy(larger, p->text, p->length);
        p->text = larger;
        p->capacity = capacity;
    }
    if (length) memcpy(p->text + p->length, text, length);
    p->length += length;
}

static void put_columns(Printer *p, const char *text, size_t length, int columns)
{
    put(p, text, length);
    p->column += columns;
    p->opened = false;
}

static void put_spaces(Printer *p, int count)
{
    static const char spaces[] = "                                ";
    for (; count > 0; count -= 32) {
        int part = count < 32 ? count : 32;
        put_columns(p, spaces, (size_t)part, part);
    }
}

static void put_line(Printer *p, int indent, bool empty)
{
    if (p->length) put(p, "\n\n", empty ? 2 : 1);
    p->line += p->length ? (empty ? 2 : 1) : 0;
    p->column = 0;
    p->ended = false;
    put_spaces(p, indent);
}

static void want(Printer *p, bool space)
{
    p->wanted = space ? WANT_SPACE : WANT_NOTHING;
}

static void want_line(Printer *p, int indent, bool empty_line)
{
    p->wanted = WANT_LINE;
    p->indent = indent;
    p->empty_line = empty_line;
}

// --- Comments and pieces

static void put_comment_text(Printer *p, const Comment *comment)
{
    const char *text = p->pieces->source->text + comment->begin, *end = p->pieces->source->text + comment->end;
    int columns = comment->columns;
    while (comment->several_lines) { // its lines stay as they are, but for their ends
        const char *line = memchr(text, '\n', (size_t)(end - text));
        if (!line) break;
        const char *stop = line;
        while (stop > text && is_blank(stop[-1])) stop--;
        put(p, text, (size_t)(stop - text));
        put(p, "\n", 1);
        p->line++;
        p->column = 0;
        text = line + 1;
        columns = 0;
        for (const char *c = text; c < end && *c != '\n'; c++) columns += ((unsigned char)*c & 0xC0) != 0x80;
    }
    put_columns(p, text, (size_t)(end - text), columns);
}

static void note_trailing(Printer *p)
{
    if (p->trailing_count == p->trailing_capacity) {
        int capacity = p->trailing_capacity ? p->trailing_capacity * 2 : 64;
        Trailing *larger = arena_array(p->arena, Trailing, capacity);
        if (p->trailing_count) memcpy(larger, p->trailing, (size_t)p->trailing_count * sizeof *larger);
        p->trailing = larger;
        p->trailing_capacity = capacity;
    }
    p->trailing[p->trailing_count++] = (Trailing){p->length, p->column, p->line};
}

static void put_comments(Printer *p, const Piece *piece, int indent)
{
    for (int i = 0; i < piece->comment_count; i++) {
        const Comment *comment = &p->pieces->comments[piece->comments + i];
        bool own_line = comment->breaks > 0 || !p->length || p->ended;
        if (own_line) {
            bool line = p->wanted == WANT_LINE;
            put_line(p, line ? p->indent : indent, line && p->empty_line && comment->breaks > 1);
            if (line) p->empty_line = true;
        } else if (comment->ends_line) {
            note_trailing(p);
        } else if (!p->opened) {
            put_spaces(p, 1);
        }
        put_comment_text(p, comment);
        p->ended = comment->ends_line;
        if (p->wanted == WANT_LINE) continue;
        uint8_t breaks = i + 1 < piece->comment_count ? 0 : piece->breaks; // the next comment sees to its own
        if (comment->ends_line || (own_line && breaks))
            want_line(p, indent, false);
        else
            want(p, true);
    }
}

// `indent`: of the box around, for the line that it begins if only a comment makes it begin one.
static void put_piece(Printer *p, int index, int indent)
{
    const Piece *piece = &p->pieces->list[index];
    indent += piece_indent(piece);
    bool line = p->wanted == WANT_LINE;
    bool first = !p->length && piece->comment_count == 1; // a comment that begins the text begins a line too
    bool own_line =
        first || (piece->comment_count && p->pieces->comments[piece->comments + piece->comment_count - 1].breaks > 0);
    put_comments(p, piece, indent);
    bool after_comment =
        line && own_line && piece->breaks == 0 && p->length; // the comment has the line that was wanted
    if (after_comment && !p->pieces->comments[piece->comments + piece->comment_count - 1].ends_line) want(p, true);
    switch (p->wanted) {
    case WANT_LINE: {
        bool closes = piece->code == ')' || piece->code == ']' || piece->code == '}' || piece->code == TOK_YYEOF;
        put_line(p, p->indent, p->empty_line && piece->breaks > 1 && !closes);
        break;
    }
    case WANT_SPACE:
        if (!piece->comment_count || !piece_closes_up(piece)) put_spaces(p, 1);
        break;
    case WANT_NOTHING: break;
    }
    p->begin[index] = p->length;
    put_columns(p, piece->text, piece->length, piece->columns);
    p->opened = piece->code == '(' || piece->code == '[';
    want(p, false);
}

// --- Room

// Where a piece would begin if it is the next, in a line of an indentation.
static int next_column(const Printer *p, int piece, int indent)
{
    const Piece *next = &p->pieces->list[piece];
    if (p->wanted == WANT_LINE && next->forced) {
        bool goes_on =
            p->pieces->comments[next->comments + next->comment_count - 1].breaks > 0; // on the last comment's line
        return p->indent + (goes_on ? piece_lead(p->pieces, piece) : 0);
    }
    if (p->wanted == WANT_LINE) return p->indent + next->comment_columns;
    if (next->forced) return indent + piece_indent(next) + piece_lead(p->pieces, piece);
    if (!next->comment_count) return p->column + (p->wanted == WANT_SPACE);
    return p->column + (p->opened ? next->comment_columns : piece_gap(p->pieces, piece));
}

static bool fits(const Printer *p, int piece, Size size, int indent, int after)
{
    int at = next_column(p, piece, indent);
    if (!size.breaks) return at + size.flat + after <= FORMAT_WIDTH;
    return at + size.head <= FORMAT_WIDTH && indent + size.middle <= FORMAT_WIDTH &&
           indent + size.tail + after <= FORMAT_WIDTH;
}

// The columns of a box up to the first place where it may be broken. `whole` is set where there is none.
static int least_head(const Printer *p, const Box *box, bool *whole)
{
    *whole = false;
    switch ((BoxKind)box->kind) {
    case BOX_PIECE: *whole = true; return box->size.flat;
    case BOX_BRACKETS:
    case BOX_BLOCK: return 1;
    case BOX_CHAIN:
    case BOX_DOTS: return least_head(p, box->first, whole);
    case BOX_SEQUENCE:
    case BOX_IF: break;
    }
    int columns = 0;
    for (const Box *part = box->first; part; part = part->next) {
        if (part != box->first && p->pieces->list[part->piece].forced) {
            *whole = false;
            break;
        }
        columns += (part != box->first ? piece_gap(p->pieces, part->piece) : 0) + least_head(p, part, whole);
        if (!*whole) break;
    }
    return columns;
}

static int least_after(const Printer *p, const Box *part, int after)
{
    int columns = 0;
    for (; part; part = part->next) {
        bool whole;
        if (p->pieces->list[part->piece].forced) return columns;
        columns += piece_gap(p->pieces, part->piece) + least_head(p, part, &whole);
        if (!whole) return columns;
    }
    return columns + after;
}

// --- Boxes

static void print(Printer *p, const Box *box, int indent, int after);

static void print_sequence(Printer *p, const Box *box, int indent, int after)
{
    for (const Box *part = box->first; part; part = part->next) {
        if (part != box->first) want(p, p->pieces->list[part->piece].space);
        print(p, part, indent, least_after(p, part->next, after));
    }
}

// `a - union { … }` that does not fit is broken inside of the block: its head and its } show well enough what belongs together.
static bool ends_in_block(const Printer *p, const Box *box, int indent, int after)
{
    const Box *last = box->last;
    if (box->count != 2 || last->kind != BOX_SEQUENCE || last->last->kind != BOX_BLOCK) return false;
    Size head = size_join(box->first->size, piece_gap(p->pieces, last->before) + 1, (Size){.flat = 0});
    for (const Box *part = last->first; part; part = part->next) {
        if (p->pieces->list[part->piece].forced) return false;
        Size size = part == last->last ? (Size){.breaks = true, .head = 1, .tail = 1} : part->size;
        head = size_join(head, piece_gap(p->pieces, part->piece), size);
    }
    return fits(p, box->piece, head, indent, after);
}

// `inner`: of the lines that operators begin, if it is broken.
static void print_operands(Printer *p, const Box *box, int indent, int inner, int after)
{
    bool flat = !box->broken && (fits(p, box->piece, box->size, indent, after) || ends_in_block(p, box, indent, after));
    if (flat) inner = indent;
    for (const Box *part = box->first; part; part = part->next) {
        if (part != box->first) {
            if (flat)
                want(p, p->pieces->list[part->before].space);
            else
                want_line(p, inner, false);
            put_piece(p, part->before, indent);
            want(p, p->pieces->list[part->piece].space);
        }
        print(p, part, part == box->first ? indent : inner, part->next ? 0 : after);
    }
}

static void print_chain(Printer *p, const Box *box, int indent, int after)
{
    print_operands(p, box, indent, indent + FORMAT_INDENT, after);
}

static void print_link(Printer *p, const Box *link, int indent, int after)
{
    put_piece(p, link->before, indent);
    print(p, link, indent, after);
}

// The columns behind a link that must stay on its line.
static int after_link(const Printer *p, const Box *link, int after)
{
    bool whole;
    return link->next ? 1 + least_head(p, link->next, &whole) : after;
}

static int count_calls(const Box *box)
{
    int calls = 0;
    for (const Box *link = box->first->next; link; link = link->next) calls += link->call;
    return calls;
}

// The dots of a chain begin lines where they are broken. If the value before them takes several lines, its last one takes the first dot.
static void print_dots(Printer *p, const Box *box, int indent, int after)
{
    const Box *head = box->first, *link = head->next;
    bool tall = head->size.breaks || next_column(p, head->piece, indent) + head->size.flat > FORMAT_WIDTH;
    bool several = count_calls(box) > 1;
    bool broken = !tall && (box->broken || (several && !fits(p, box->piece, box->size, indent, after)));
    int inner = broken ? indent + FORMAT_INDENT : indent;
    print(p, head, indent, broken ? 0 : after_link(p, head, after));
    if (tall) {
        Size rest = {0};
        for (const Box *each = link; each; each = each->next) rest = size_join(rest, 1, each->size);
        broken = several && (box->broken || !fits(p, link->before, rest, indent, after));
        print_link(p, link, indent, broken && link->next ? 0 : after_link(p, link, after));
        link = link->next;
        inner = broken ? indent + FORMAT_INDENT : indent;
    }
    for (; link; link = link->next) {
        if (broken && link->call) want_line(p, inner, false);
        bool alone = broken && link->next && link->next->call;
        print_link(p, link, inner, alone ? 0 : after_link(p, link, after));
    }
}

// --- Brackets

// A closing mark on a line of its own. The comments before it belong to what is inside.
static void put_closer(Printer *p, const Box *box, int indent)
{
    const Piece *close = &p->pieces->list[box->close];
    want_line(p, indent + FORMAT_INDENT, box->count > 0);
    put_comments(p, close, indent + FORMAT_INDENT);
    put_line(p, indent, false);
    want(p, false);
    p->begin[box->close] = p->length;
    put_columns(p, close->text, close->length, close->columns);
}

static bool is_row(const Printer *p, const Box *box)
{
    for (const Box *part = box->first; part; part = part->next) {
        if (part->size.breaks || part->size.flat > 24) return false;
        for (const Box *word = part->kind == BOX_SEQUENCE ? part->first : NULL; word; word = word->next) {
            if (word->kind == BOX_PIECE && p->pieces->list[word->piece].code == ':') return false;
        }
    }
    return true;
}

static void print_comma(Printer *p, const Box *element, int indent)
{
    want(p, false);
    if (element->after != NO_PIECE)
        put_piece(p, element->after, indent);
    else
        put_columns(p, ",", 1, 1);
}

static void print_elements_flat(Printer *p, const Box *box, int indent)
{
    for (const Box *part = box->first; part; part = part->next) {
        bool whole;
        int after = part->next ? 2 + least_head(p, part->next, &whole) : 1;
        want(p, part != box->first);
        print(p, part, indent, after);
        if (part->next)
            print_comma(p, part, indent);
        else if (part->after != NO_PIECE)
            put_comments(p, &p->pieces->list[part->after], indent);
    }
}

static bool row_goes_on(const Printer *p, const Box *box, const Box *before, const Box *part, bool rows)
{
    const Piece *first = &p->pieces->list[part->piece];
    bool written = first->on_new_line || (before->after != NO_PIECE && p->pieces->list[before->after].on_new_line);
    if (box->broken ? written : !rows) return false;
    int columns = part->size.breaks ? part->size.head : part->size.flat + 1;
    return p->column + 1 + first->comment_columns + columns <= FORMAT_WIDTH;
}

static void print_elements_broken(Printer *p, const Box *box, int indent)
{
    bool rows = is_row(p, box);
    const Box *before = NULL;
    for (const Box *part = box->first; part; before = part, part = part->next) {
        if (before && row_goes_on(p, box, before, part, rows))
            want(p, true);
        else
            want_line(p, indent, before != NULL);
        if (box->count == 1 && part->kind == BOX_CHAIN)
            print_operands(p, part, indent, indent, 1); // the brackets show that it goes on
        else
            print(p, part, indent, 1);
        if (part->next || box->count > 1)
            print_comma(p, part, indent);
        else if (part->after != NO_PIECE)
            put_comments(p, &p->pieces->list[part->after], indent);
    }
}

// f([ … ]) is broken inside of the inner brackets.
static bool is_hugging(const Box *box)
{
    if (box->count != 1) return false;
    return box->first->kind == BOX_BLOCK || box->first->kind == BOX_BRACKETS;
}

static void print_brackets(Printer *p, const Box *box, int indent, int after)
{
    bool flat = !box->broken && (fits(p, box->piece, box->size, indent, after) || is_hugging(box) || !box->count);
    put_piece(p, box->piece, indent);
    if (flat) {
        print_elements_flat(p, box, indent);
        if (p->wanted != WANT_LINE) want(p, false);
        put_piece(p, box->close, indent);
    } else {
        print_elements_broken(p, box, indent + FORMAT_INDENT);
        put_closer(p, box, indent);
    }
}

// --- Blocks

static void print_items(Printer *p, const Box *box, int indent, bool flat)
{
    for (const Box *item = box->first; item; item = item->next) {
        if (flat)
            want(p, true);
        else
            want_line(p, indent, item != box->first);
        bool semicolon = item->after != NO_PIECE && p->pieces->list[item->after].length;
        print(p, item, indent, semicolon);
        if (!semicolon) continue;
        want(p, false);
        put_piece(p, item->after, indent);
    }
}

static void print_block(Printer *p, const Box *box, int indent, bool broken)
{
    bool empty = !box->count && !p->pieces->list[box->close].comment_count;
    bool flat = empty || !broken;
    put_piece(p, box->piece, indent);
    print_items(p, box, flat ? indent : indent + FORMAT_INDENT, flat);
    if (flat) {
        want(p, true);
        put_piece(p, box->close, indent);
    } else {
        put_closer(p, box, indent);
    }
}

// Its blocks are broken together.
static void print_if(Printer *p, const Box *box, int indent, int after)
{
    bool broken = box->broken || !fits(p, box->piece, box->size, indent, after);
    for (const Box *part = box->first; part; part = part->next) {
        if (part != box->first) want(p, true);
        if (part->kind == BOX_PIECE)
            put_piece(p, part->piece, indent); // if, else
        else if (part->kind == BOX_BLOCK)
            print_block(p, part, indent, broken);
        else
            print(p, part, indent, least_after(p, part->next, after));
    }
}

static void print(Printer *p, const Box *box, int indent, int after)
{
    switch ((BoxKind)box->kind) {
    case BOX_PIECE: put_piece(p, box->piece, indent); break;
    case BOX_SEQUENCE: print_sequence(p, box, indent, after); break;
    case BOX_CHAIN: print_chain(p, box, indent, after); break;
    case BOX_DOTS: print_dots(p, box, indent, after); break;
    case BOX_BRACKETS: print_brackets(p, box, indent, after); break;
    case BOX_BLOCK: print_block(p, box, indent, box->broken || !fits(p, box->piece, box->size, indent, after)); break;
    case BOX_IF: print_if(p, box, indent, after); break;
    }
}

// --- Comments behind code

enum { TRAILING_GAP = 2, TRAILING_MOST = 90 }; // longer lines of code do not push the comments around them away

// The columns between the code and the comment of each of the comments [i, end), which stand in lines that follow each other.
static int common_column(const Printer *p, int i, int end)
{
    int column = 0;
    for (; i < end; i++) {
        int columns = p->trailing[i].columns;
        if (columns <= TRAILING_MOST && columns > column) column = columns;
    }
    return column;
}

// Adds to the places of the pieces from `piece` on that are before `at`. Returns the first that is not.
static int move_pieces(Printer *p, int piece, size_t at, size_t by)
{
    for (; piece < p->pieces->count; piece++) {
        if (p->begin[piece] == NOT_WRITTEN) continue;
        if (p->begin[piece] >= at) break;
        p->begin[piece] += by;
    }
    return piece;
}

enum { TRAILING_APART = 2 }; // lines without a comment that may stand between two that share a column

static int line_indent(const Printer *p, size_t at)
{
    while (at && p->text[at - 1] != '\n') at--;
    int indent = 0;
    while (p->text[at + (size_t)indent] == ' ') indent++;
    return indent;
}

// Whether the next comment stands in the column of one: in the next line, or a little further down among lines of the same indentation, none of
// which is empty or begins with a comment.
static bool shares_column(const Printer *p, const Trailing *one, const Trailing *next)
{
    int apart = next->line - one->line - 1;
    if (apart == 0) return true;
    int indent = line_indent(p, one->at);
    if (apart > TRAILING_APART || line_indent(p, next->at) != indent) return false;
    const char *line = p->text + one->at;
    while (apart-- > 0) {
        line = (const char *)rawmemchr(line, '\n') + 1; // comments may hold any bytes
        int spaces = (int)strspn(line, " ");
        if (spaces != indent || line[spaces] == '\n' || line[spaces] == '/') return false;
    }
    return true;
}

// Moves the comments of neighbouring lines into one column. The text grows on the way, and the places of the pieces with it.
static void align_comments(Printer *p)
{
    Printer out = {.arena = p->arena};
    size_t done = 0;
    int piece = 0;
    for (int i = 0; i < p->trailing_count;) {
        int end = i + 1;
        while (end < p->trailing_count && shares_column(p, &p->trailing[end - 1], &p->trailing[end])) end++;
        int column = common_column(p, i, end);
        for (; i < end; i++) {
            const Trailing *t = &p->trailing[i];
            piece = move_pieces(p, piece, t->at, out.length - done);
            put(&out, p->text + done, t->at - done);
            done = t->at;
            put_spaces(&out, (t->columns < column ? column - t->columns : 0) + TRAILING_GAP);
        }
    }
    move_pieces(p, piece, p->length + 1, out.length - done);
    if (p->length > done) put(&out, p->text + done, p->length - done); // an empty file has no text at all
    p->text = out.text;
    p->length = out.length;
    p->capacity = out.capacity;
}

Printed boxes_print(const Pieces *pieces, const Box *file, Arena *arena)
{
    Printer p = {.pieces = pieces, .arena = arena};
    p.begin = arena_array(arena, size_t, pieces->count);
    for (int i = 0; i < pieces->count; i++) p.begin[i] = NOT_WRITTEN;
    p.opened = true;
    print_items(&p, file, 0, false);
    want_line(&p, 0, true);
    put_comments(&p, &pieces->list[file->close], 0);
    if (p.length) put(&p, "\n", 1);
    p.begin[file->close] = p.length;
    align_comments(&p);
    put(&p, "", 1);
    return (Printed){p.text, p.length - 1, p.begin};
}
