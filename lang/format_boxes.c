// A small parser for what is right already: precedence climbing for operators, and beside them only brackets, commas and semicolons.
//
// A box's size is known when it is made. What the author wants on several lines has a head and a tail, and what is around it may still be
// written as if it were flat, if all its lines fit. Then nothing in it has to be broken for want of room. So a second pass over the
// result, which finds those line breaks written that were made here, decides everything as the first.
#include <assert.h>

#include "lang/classes.h"
#include "lang/formatter.h"
#include "lang/parse.h"

typedef struct Maker {
    Pieces *pieces;
    Piece *list;
    Arena *arena;
    int at;        // the next piece
    bool function; // the item is a fn, tag or tool: its block is a body
} Maker;

// --- Sizes

static int larger(int a, int b)
{
    return a > b ? a : b;
}

Size size_join(Size a, int gap, Size b)
{
    if (!a.breaks && !b.breaks) return (Size){.flat = a.flat + gap + b.flat};
    Size size = {.breaks = true, .lined = a.lined || b.lined, .middle = larger(a.middle, b.middle)};
    if (a.breaks && b.breaks) size.middle = larger(size.middle, a.tail + gap + b.head);
    size.head = a.breaks ? a.head : a.flat + gap + b.head;
    size.tail = b.breaks ? b.tail : a.tail + gap + b.flat;
    return size;
}

static Size size_of_columns(int columns)
{
    return (Size){.flat = columns};
}

static Size size_broken(int head, int tail)
{
    return (Size){.breaks = true, .head = head, .tail = tail};
}

// A line break, and the indentation of the line behind it.
static Size size_line(int indent)
{
    return (Size){.breaks = true, .lined = true, .tail = indent};
}

// Of what stands in a line that is indented, with its own lines.
static Size size_indented(Size size)
{
    if (!size.breaks) return size;
    size.middle += FORMAT_INDENT;
    size.tail += FORMAT_INDENT;
    return size;
}

int piece_indent(const Piece *piece)
{
    switch (piece->code) {
    case '{':
    case '}':
    case ')':
    case ']':
    case TOK_BODY:
    case TOK_IF:
    case TOK_ELSE: return 0;
    default: return FORMAT_INDENT;
    }
}

bool piece_closes_up(const Piece *piece)
{
    int c = piece->code;
    return c == ',' || c == ';' || c == ')' || c == ']' || c == '.';
}

int piece_gap(const Pieces *pieces, int piece)
{
    const Piece *p = &pieces->list[piece];
    return p->comment_count ? p->comment_columns + !piece_closes_up(p) : p->space;
}

int piece_lead(const Pieces *pieces, int piece)
{
    const Piece *p = &pieces->list[piece];
    const Comment *comments = &pieces->comments[p->comments];
    if (!p->comment_count || p->breaks || comments[p->comment_count - 1].ends_line) return 0;
    int columns = 0;
    for (int i = 0; i < p->comment_count; i++) {
        if (comments[i].breaks || comments[i].several_lines)
            columns = 0; // the last of several lines may begin anywhere
        if (!comments[i].several_lines) columns += comments[i].columns + 1;
    }
    return columns;
}

// --- Making

static Box *box_new(Maker *m, BoxKind kind, int piece)
{
    Box *box = arena_new(m->arena, Box);
    box->kind = (uint8_t)kind;
    box->piece = piece;
    box->close = box->before = box->after = NO_PIECE;
    return box;
}

static void box_add(Box *box, Box *part)
{
    if (box->last)
        box->last->next = part;
    else
        box->first = part;
    box->last = part;
    box->count++;
}

static int code(const Maker *m)
{
    return m->list[m->at].code;
}

static Box *make_piece(Maker *m)
{
    Box *box = box_new(m, BOX_PIECE, m->at);
    box->size = size_of_columns(m->list[m->at].columns);
    m->at++;
    return box;
}

// What stands behind something else, in a line of an indentation; a comment may make it begin a line of its own.
static Size size_behind(const Maker *m, Size before, int indent, int piece, Size size)
{
    const Piece *first = &m->list[piece];
    if (!first->forced) return size_join(before, piece_gap(m->pieces, piece), size);
    return size_join(size_join(before, 0, size_line(indent + piece_indent(first) + piece_lead(m->pieces, piece))), 0,
                     size);
}

// Finishes a sequence: one part stands for itself.
static Box *sequence_of(Maker *m, Box *sequence)
{
    if (sequence->count == 1) return sequence->first;
    sequence->size = sequence->first->size;
    for (const Box *part = sequence->first->next; part; part = part->next) {
        sequence->size = size_behind(m, sequence->size, 0, part->piece, part->size);
    }
    return sequence;
}

static Box *make_expr(Maker *m);
static Box *make_words(Maker *m, bool element);

// --- Brackets

static bool is_closer(int c)
{
    return c == ')' || c == ']' || c == '}' || c == TOK_YYEOF;
}

static bool elements_broken(const Maker *m, const Box *box)
{
    if (box->count && m->list[box->piece + 1].on_new_line) return true;
    for (const Box *part = box->first; part; part = part->next) {
        if (m->list[part->piece].forced || part->size.lined) return true;
        if (part->after != NO_PIECE && m->list[part->after].forced) return true;
    }
    return m->list[box->close].forced;
}

static void measure_brackets(Maker *m, Box *box)
{
    box->broken = elements_broken(m, box);
    if (box->broken) {
        box->size = size_broken(1, 1);
        return;
    }
    box->size = size_of_columns(1);
    for (const Box *part = box->first; part; part = part->next) {
        int gap = m->list[part->piece].comment_columns + (part != box->first);
        box->size = size_join(box->size, gap, part->size);
        if (part->after != NO_PIECE)
            box->size = size_join(box->size, m->list[part->after].comment_columns, size_of_columns(part->next != NULL));
    }
    box->size = size_join(box->size, m->list[box->close].comment_columns, size_of_columns(1));
}

static Box *make_brackets(Maker *m)
{
    Box *box = box_new(m, BOX_BRACKETS, m->at++);
    while (!is_closer(code(m))) {
        Box *element = make_words(m, true);
        if (code(m) == ',') element->after = m->at++;
        box_add(box, element);
    }
    box->close = m->at++;
    measure_brackets(m, box);
    return box;
}

// --- Blocks

// True if a `///` comment stands before a piece. It would document what follows if the piece were left out.
static bool has_doc(const Maker *m, const Piece *piece)
{
    const char *text = m->pieces->source->text;
    for (int i = 0; i < piece->comment_count; i++) {
        const Comment *comment = &m->pieces->comments[piece->comments + i];
        if (comment->ends_line && text[comment->begin + 2] == '/') return true;
    }
    return false;
}

// Leaves a piece out: what stands before it stands before the next one.
static void hide(Piece *piece)
{
    Piece *next = piece + 1;
    piece->length = 0;
    piece->columns = 0;
    next->comments -= piece->comment_count;
    next->comment_count += piece->comment_count;
    next->comment_columns += piece->comment_columns;
    next->on_new_line |= piece->on_new_line;
    next->forced |= piece->forced;
    if (!next->breaks) next->breaks = piece->breaks;
    piece->comment_count = piece->comment_columns = 0;
    piece->forced = piece->on_new_line = false;
}

static void show_semicolon(Piece *piece)
{
    piece->text = ";";
    piece->length = 1;
    piece->columns = 1;
}

static bool has_mark(const Maker *m, const Box *item)
{
    if (item->kind != BOX_SEQUENCE) return false;
    for (const Box *part = item->first; part; part = part->next) {
        int c = part->kind == BOX_PIECE ? m->list[part->piece].code : 0;
        if (c == '=' || c == ':') return true;
    }
    return false;
}

static bool wants_semicolon(const Maker *m, const Box *item)
{
    int first = m->list[item->piece].code;
    return token_is(first, TOKEN_ITEM) ? !token_is(first, TOKEN_BODIED) : has_mark(m, item);
}

// Writes the semicolon of an item that wants one, and leaves out that behind a } where the next item begins by itself.
static void settle_semicolon(Maker *m, const Box *item, bool body)
{
    Piece *semicolon = &m->list[item->after];
    bool after_block = m->list[item->after - 1].code == '}';
    if (wants_semicolon(m, item) || (!body && !after_block)) {
        show_semicolon(semicolon);
    } else if (after_block && semicolon->length && !has_doc(m, semicolon)) {
        int next = item->after + 1;
        while (m->list[next].code == ';') next++; // empty items, which are left out
        int code = m->list[next].code;
        if (is_closer(code) || token_begins_item_behind_brace(code)) hide(semicolon);
    }
}

// `body`: a value at the end may be the result, and does without a semicolon where the author left it out.
static void make_items(Maker *m, Box *box, bool body)
{
    while (!is_closer(code(m))) {
        if (code(m) == ';') {                            // an empty item
            bool first = box->piece == 0 && !box->count; // without it a `///` behind it might be the file's
            if (has_doc(m, &m->list[m->at]) || (first && has_doc(m, &m->list[m->at + 1])))
                box_add(box, make_piece(m));
            else
                hide(&m->list[m->at++]);
            continue;
        }
        Box *item = make_words(m, false);
        if (code(m) == ';') {
            item->after = m->at++;
            settle_semicolon(m, item, body);
        }
        box_add(box, item);
    }
}

static void measure_block(Maker *m, Box *box)
{
    if (box->broken) {
        box->size = size_broken(1, 1);
        return;
    }
    box->size = size_of_columns(1);
    for (const Box *part = box->first; part; part = part->next) {
        int semicolon =
            part->after == NO_PIECE ? 0 : m->list[part->after].columns + m->list[part->after].comment_columns;
        box->size = size_join(box->size, 1 + m->list[part->piece].comment_columns, part->size);
        box->size = size_join(box->size, semicolon, size_of_columns(0));
    }
    box->size = size_join(box->size, 1 + m->list[box->close].comment_columns, size_of_columns(1));
}

static Box *make_block(Maker *m, bool body)
{
    Box *box = box_new(m, BOX_BLOCK, m->at++);
    make_items(m, box, body);
    box->close = m->at++;
    const Piece *close = &m->list[box->close];
    box->broken = (box->count || close->comment_count) && m->list[box->piece].line != close->line;
    measure_block(m, box);
    return box;
}

// --- Operands

static void break_blocks(Maker *m, Box *box)
{
    for (Box *part = box->first; part; part = part->next) {
        if (part->kind != BOX_BLOCK || !part->count) continue;
        part->broken = true;
        measure_block(m, part);
    }
}

// An if with all its `else if`.
static Box *make_if(Maker *m)
{
    Box *box = box_new(m, BOX_IF, m->at);
    while (code(m) == TOK_IF) {
        box_add(box, make_piece(m));
        box_add(box, make_expr(m));
        box_add(box, make_block(m, true));
        box->broken |= box->last->broken;
        if (code(m) == TOK_ELSE) box_add(box, make_piece(m));
    }
    if (box->last->kind != BOX_BLOCK) {
        box_add(box, make_block(m, true));
        box->broken |= box->last->broken;
    }
    if (box->broken) break_blocks(m, box);
    return sequence_of(m, box);
}

static bool is_prefix(int c)
{
    return c == '-' || c == '~' || c == '!';
}

// What a name takes with it: arguments and a block.
static void add_call(Maker *m, Box *sequence)
{
    if (code(m) == '(') box_add(sequence, make_brackets(m));
    if (code(m) == '{') box_add(sequence, make_block(m, m->function));
}

static void add_indices(Maker *m, Box *sequence)
{
    while (code(m) == '[') box_add(sequence, make_brackets(m));
}

static Box *make_primary(Maker *m)
{
    Box *sequence = box_new(m, BOX_SEQUENCE, m->at);
    switch (code(m)) {
    case '(':
    case '[': box_add(sequence, make_brackets(m)); break;
    case '{': box_add(sequence, make_block(m, true)); break;
    case TOK_IF: box_add(sequence, make_if(m)); break;
    case TOK_NAME:
        box_add(sequence, make_piece(m));
        add_call(m, sequence);
        break;
    default: box_add(sequence, make_piece(m)); break;
    }
    add_indices(m, sequence);
    return sequence_of(m, sequence);
}

static Box *make_link(Maker *m)
{
    int dot = m->at++;
    Box *sequence = box_new(m, BOX_SEQUENCE, m->at);
    box_add(sequence, make_piece(m));
    add_call(m, sequence);
    bool call = sequence->count > 1;
    add_indices(m, sequence);
    Box *link = sequence_of(m, sequence);
    link->before = dot;
    link->call = call;
    return link;
}

// If the value takes several lines, its last one takes the first dot, and one call alone needs no line.
static void measure_links(Maker *m, Box *box)
{
    bool tall = box->first->size.breaks, written = false;
    int calls = 0;
    for (const Box *link = box->first->next; link; link = link->next) {
        calls += link->call;
        written |= link->call && m->list[link->before].on_new_line;
    }
    box->broken = written && (!tall || calls > 1);
    box->size = box->first->size;
    for (const Box *link = box->first->next; link; link = link->next) {
        bool first = tall && link == box->first->next;
        bool line = box->broken && link->call && !first;
        int indent = box->broken && !first ? FORMAT_INDENT : 0;
        Size size = indent ? size_indented(link->size) : link->size;
        if (line) box->size = size_join(box->size, 0, size_line(indent));
        if (line)
            box->size = size_join(box->size, 0, size_of_columns(1));
        else
            box->size = size_behind(m, box->size, indent, link->before, size_of_columns(1));
        box->size = size_behind(m, box->size, indent, link->piece, size);
    }
}

static Box *make_postfix(Maker *m)
{
    Box *value = make_primary(m);
    if (code(m) != '.') return value;
    Box *box = box_new(m, BOX_DOTS, value->piece);
    box_add(box, value);
    while (code(m) == '.') box_add(box, make_link(m));
    measure_links(m, box);
    return box;
}

static Box *make_unary(Maker *m);

static Box *make_power(Maker *m)
{
    Box *base = make_postfix(m);
    if (code(m) != '^') return base;
    Box *sequence = box_new(m, BOX_SEQUENCE, base->piece);
    box_add(sequence, base);
    box_add(sequence, make_piece(m));
    box_add(sequence, make_unary(m));
    return sequence_of(m, sequence);
}

static Box *make_unary(Maker *m)
{
    if (!is_prefix(code(m))) return make_power(m);
    Box *sequence = box_new(m, BOX_SEQUENCE, m->at);
    while (is_prefix(code(m))) box_add(sequence, make_piece(m));
    box_add(sequence, make_power(m));
    return sequence_of(m, sequence);
}

// --- Operators

enum {
    RANK_OR,
    RANK_AND,
    RANK_NOT,
    RANK_COMPARE,
    RANK_RANGE,
    RANK_UNION,
    RANK_INTERSECT,
    RANK_SUM,
    RANK_PRODUCT,
    RANK_UNARY
};

static int rank_of(int c)
{
    switch (c) {
    case TOK_OR: return RANK_OR;
    case TOK_AND: return RANK_AND;
    case TOK_EQ:
    case TOK_NE:
    case '<':
    case TOK_LE:
    case '>':
    case TOK_GE: return RANK_COMPARE;
    case TOK_RANGE: return RANK_RANGE;
    case '|': return RANK_UNION;
    case '&': return RANK_INTERSECT;
    case '+':
    case '-': return RANK_SUM;
    case '*':
    case '/': return RANK_PRODUCT;
    default: return -1;
    }
}

static void measure_chain(Maker *m, Box *box)
{
    box->broken = box->first->size.lined;
    for (const Box *part = box->first->next; part; part = part->next) {
        if (m->list[part->before].on_new_line || m->list[part->piece].on_new_line || part->size.lined)
            box->broken = true;
    }
    int indent = box->broken ? FORMAT_INDENT : 0;
    box->size = box->first->size;
    for (const Box *part = box->first->next; part; part = part->next) {
        Size mark = size_of_columns(m->list[part->before].columns);
        if (box->broken)
            box->size = size_join(size_join(box->size, 0, size_line(indent)), 0, mark);
        else
            box->size = size_behind(m, box->size, indent, part->before, mark);
        box->size = size_behind(m, box->size, indent, part->piece, indent ? size_indented(part->size) : part->size);
    }
}

static Box *make_rank(Maker *m, int rank)
{
    if (rank == RANK_UNARY) return make_unary(m);
    if (rank == RANK_NOT) {
        Box *sequence = box_new(m, BOX_SEQUENCE, m->at);
        while (code(m) == TOK_NOT) box_add(sequence, make_piece(m));
        box_add(sequence, make_rank(m, rank + 1));
        return sequence_of(m, sequence);
    }
    Box *first = make_rank(m, rank + 1);
    if (rank_of(code(m)) != rank) return first;
    Box *box = box_new(m, BOX_CHAIN, first->piece);
    box_add(box, first);
    while (rank_of(code(m)) == rank) {
        int mark = m->at++;
        Box *operand = make_rank(m, rank + 1);
        operand->before = mark;
        box_add(box, operand);
    }
    measure_chain(m, box);
    return box;
}

static Box *make_expr(Maker *m)
{
    return make_rank(m, RANK_OR);
}

// --- Items and elements: words that lead, values, and the marks between them

static Box *make_words(Maker *m, bool element)
{
    Box *sequence = box_new(m, BOX_SEQUENCE, m->at);
    bool around = m->function;
    m->function = code(m) == TOK_FN || code(m) == TOK_TAG || code(m) == TOK_TOOL;
    do {
        if (code(m) == TOK_BODY)
            box_add(sequence, make_block(m, true));
        else
            box_add(sequence, token_is(code(m), TOKEN_BEGINS) ? make_expr(m) : make_piece(m));
    } while (code(m) != ';' && !is_closer(code(m)) && !(element && code(m) == ','));
    m->function = around;
    return sequence_of(m, sequence);
}

// --- Spaces

// Whether a space stands before `b`, which follows `a`. `sign`: `a` is the - or ~ of a value.
static bool space_between(int a, bool sign, int b)
{
    if (b == '}' || a == '{' || a == TOK_BODY) return true;
    if (sign || a == '(' || a == '[' || a == '.' || a == '^') return false;
    switch (b) {
    case ',':
    case ';':
    case ':':
    case ')':
    case ']':
    case '.':
    case '^': return false;
    case '(': return a != TOK_NAME;
    case '[': return !token_is(a, TOKEN_ENDS);
    default: return true;
    }
}

static void set_spaces(Pieces *pieces)
{
    int before = ';';
    bool sign = false;
    for (int i = 0; i < pieces->count; i++) {
        Piece *piece = &pieces->list[i];
        piece->space = i > 0 && space_between(before, sign, piece->code);
        sign = (piece->code == '-' || piece->code == '~' || piece->code == '!') && !token_is(before, TOKEN_ENDS);
        before = piece->code;
    }
}

Box *boxes_make(Pieces *pieces, Arena *arena)
{
    set_spaces(pieces);
    Maker maker = {.pieces = pieces, .list = pieces->list, .arena = arena};
    Box *file = box_new(&maker, BOX_BLOCK, 0);
    make_items(&maker, file, false);
    assert(code(&maker) == TOK_YYEOF && "the brackets of a text without errors match");
    file->close = maker.at;
    return file;
}
