// The scanner: from text to words, one at a time.
//
// A word is a token of parse.y with a value and a place. Comments and space are skipped; what a `///` comment says is kept in
// `docs` by the place of the word that follows it. What is no word is reported here, and the scanner gives what was
// most likely meant, or TOK_SCN_YYerror if that is not known: the parser then skips to the end of the item in silence.
//
//     Scanner scanner;
//     scanner_init(&scanner, unit, source);
//     Token token;
//     do scan(&scanner, &token); while (token.code != TOK_YYEOF);
//     scanner_release(&scanner);
//
// Texts with values in them come in pieces: "a {b} c" is STRING_HEAD b STRING_TAIL, "{a}{b}" is STRING_HEAD a STRING_MIDDLE b
// STRING_TAIL. Braces are counted to know which } goes on with the text.
#ifndef SCN_LANG_SCAN_H
#define SCN_LANG_SCAN_H

#include <locale.h>
#include <stdbool.h>
#include <stdint.h>

#include "lang/ast.h"
#include "lang/unit.h"

typedef struct Text {
    const char *text; // not terminated: it may point into the source
    uint32_t length;
} Text;

typedef struct Number {
    double value;
    NumberUnit unit;
    bool whole; // without a point and an exponent
} Number;

typedef struct NodeList {
    Node *first, *last;
} NodeList;

typedef union Value { // of a symbol of the grammar
    Name name;        // NAME and reserved words
    Number number;    // INT, REAL
    uint32_t color;
    Text text; // STRING and its pieces
    Node *node;
    NodeList list;
    NodeOp op;
} Value;

typedef struct Token {
    int code; // of parse.y: TOK_NAME, '(' …; TOK_YYEOF (0) at the end, for ever
    Span span;
    Value value;
} Token;

typedef struct Doc { // what `///` lines said
    uint32_t at;     // where the word that follows begins
    const char *text;
} Doc;

typedef struct Scanner {
    Unit *unit;
    const Source *source;
    void *flex;             // the state of the generated scanner
    char *buffer;           // its copy of the text
    locale_t c_locale;      // numbers have a point, whatever the program's locale
    uint8_t first_word[26]; // of the reserved words with this letter

    Doc *docs; // in order of place
    uint32_t doc_count, doc_capacity;
    uint32_t run_begin, run_end; // of `///` lines that wait for their word, as offsets; empty: none
    const char *file_doc;        // of the whole file, or NULL

    int braces[NODE_DEPTH_MAX]; // open in each interpolation
    int interpolations;
    uint32_t piece_begin; // offset of the quote or brace that begins a piece of a string
    uint32_t comment_begin;
    int comment_depth;
    Token *token;      // where the current word goes
    int last_code;     // of the word before
    uint32_t last_end; // and where it ended, as an offset
    bool any_word, ended;
} Scanner;

void scanner_init(Scanner *scanner, Unit *unit, const Source *source);
void scanner_release(Scanner *scanner);
void scan(Scanner *scanner, Token *token);

// What is written for a token: "let", "..", or NULL for those that have many forms.
const char *token_text(int code);

// The documentation that stands before the word at a position, or NULL.
const char *scanner_doc(const Scanner *scanner, uint32_t position);

#endif
