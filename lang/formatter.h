// What the parts of the formatter share (format.h is the entry; nothing else includes this).
//
//   format_pieces.c   the text as pieces: words, and the comments and line breaks between them
//   format_boxes.c    the pieces as boxes that are broken over lines or not, and how wide they are
//   format_print.c    the boxes as text
//   format.c          the entry: ranges of lines, the test of the result
//
// It works on words and brackets, not on the tree: the tree has no commas, and what it leaves out must be kept. The brackets of a text
// without errors match, and the filter has marked which { is a body and where a `;` is understood, so that little grammar is left.
#ifndef SCN_LANG_FORMATTER_H
#define SCN_LANG_FORMATTER_H

#include <stdbool.h>
#include <stdint.h>

#include "lang/unit.h"

enum { FORMAT_WIDTH = 110, FORMAT_INDENT = 4, NO_PIECE = -1 };

typedef struct Comment {
    uint32_t begin, end; // offsets in the source; without space at the end
    uint8_t breaks;      // line breaks between what stands before it and it; 2 for more
    bool ends_line;      // it is a `//` comment
    bool several_lines;
    int columns; // of a comment on one line
} Comment;

typedef struct Piece {
    int code;            // of parse.y
    const char *text;    // what is written for it
    uint32_t begin, end; // offsets in the source; equal for a `;` that is understood
    uint32_t length;     // of the text; 0 for what is not written: it is there to hold its place and its comments
    int comments;        // index of the first comment before it
    int comment_count;
    uint8_t breaks;   // line breaks between the last comment, or the piece before, and it; 2 for more
    bool on_new_line; // there is a line break, in comments too, between the piece before and it
    bool forced;      // a comment before it needs a line break
    bool space;       // before it on a line
    int columns;
    int comment_columns; // of the comments before it on its line, with their spaces
    int match;           // the other bracket
    uint32_t line;       // where it begins, counted from 1
} Piece;

typedef struct Pieces {
    const Source *source;
    Piece *list; // the last is the end of the file
    int count, capacity;
    Comment *comments;
    int comment_count, comment_capacity;
} Pieces;

// Space that is not kept at the end of a line.
static inline bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

// The pieces of a source without errors, in the arena.
Pieces pieces_read(Unit *unit, const Source *source, Arena *arena);

typedef enum BoxKind {
    BOX_PIECE,
    BOX_SEQUENCE, // parts beside each other: `let a = 3`, `f(x) { … }`
    BOX_CHAIN,    // operands of one rank of operators
    BOX_DOTS,     // a value and what is called on it
    BOX_BRACKETS, // ( ) or [ ] and elements
    BOX_BLOCK,    // { } and items
    BOX_IF,       // a sequence whose blocks are broken together
} BoxKind;

typedef struct Size {
    int flat;    // on one line
    bool breaks; // it has line breaks whatever its place; then instead of `flat`:
    bool lined;  // some of them stand before an operator or a dot, outside of all brackets
    int head;    // up to the first one
    int middle;  // between two of them: the most, without the indentation
    int tail;    // from the last one
} Size;

typedef struct Box Box;
struct Box {
    uint8_t kind; // BoxKind
    bool broken;  // the author, or a comment, wants it on several lines
    bool call;    // BOX_DOTS's part: has arguments, so may begin a line
    int piece;    // the first of it
    int close;    // BOX_BRACKETS, BOX_BLOCK: the closing one
    int before;   // among the parts of a chain: its operator or dot
    int after;    // among elements and items: its comma or semicolon, or NO_PIECE
    int count;    // of parts
    Size size;
    Box *first, *last, *next;
};

// The file as a BOX_BLOCK whose brackets are not written. Sets which semicolons are written and the spaces of the pieces.
Box *boxes_make(Pieces *pieces, Arena *arena);

Size size_join(Size a, int gap, Size b);
int piece_gap(const Pieces *pieces, int piece); // columns between the piece before and it on one line
int piece_lead(const Pieces *pieces,
               int piece); // columns of comments before it on the line that one of them makes it begin; 0: none
bool piece_closes_up(const Piece *piece); // no space stands before it, even behind a comment
int piece_indent(
    const Piece *piece); // how much further it stands than what it goes on with, if a comment makes it begin a line

typedef struct Printed {
    char *text; // in the arena
    size_t length;
    size_t *begin; // of each piece: where it begins in the text, or NOT_WRITTEN
} Printed;

#define NOT_WRITTEN SIZE_MAX

Printed boxes_print(const Pieces *pieces, const Box *file, Arena *arena);

#endif
