// The filter between scanner and parser: what brackets alone decide.
//
// It keeps the stack of open brackets and gives the parser a stream in which they always match. On the way it
//  - puts in the `;` that is understood, and the one that is certainly missing (and reports that),
//  - gives the `{` that opens the body of an `if` or `for` a token of its own, TOK_BODY,
//  - reports brackets that are closed by the wrong mark or not at all where they were opened, and puts in what closes them,
//  - reports words that are reserved where only a name makes sense, and passes them on as names,
//  - ends the text where brackets are nested deeper than NODE_DEPTH_MAX,
//  - after a syntax error skips what is left of the item or bracket, so that recovery never stops inside of a deeper bracket.
#ifndef SCN_LANG_FILTER_H
#define SCN_LANG_FILTER_H

#include "lang/scan.h"

typedef struct Bracket {
    int closer;          // ')' ']' '}', TOK_STRING_TAIL of an interpolation; TOK_YYEOF of the file
    Span open;           // the opening mark
    int headers;         // of `if` and `for` that wait for their body
    int item_words;      // since the current item began; 0 between items
    int item_first;      // the first of them
    uint32_t item_begin; // and where it stands
    bool item_colon;     // it has a colon of its own
    bool function;       // the next { in this bracket is the body of an fn, tag or tool
    bool is_body;        // opened by TOK_BODY or the body of a function: no arguments in it
    Span stray;          // the first mark in it that closes nothing
    int forgiven;        // closers of ( or [ that were put in here because they were missing
    int opened;          // { that were missing in it, with a message: their } close nothing
    Diag *semicolon;     // the first that was reported to be missing in it
} Bracket;

enum { FILTER_LOOK = 4 }; // a power of two

typedef struct Filter {
    Unit *unit;
    Scanner *scanner;
    Bracket stack[NODE_DEPTH_MAX + 1]; // [0] is the file
    int depth;                         // of the innermost
    Token look[FILTER_LOOK];           // a ring of what is read and not yet given
    unsigned look_first, look_count;
    Token last;       // the one given last; code 0 before the first
    bool last_opened; // it opened a bracket
    bool skipping;    // in an error, to the end of what is open at skip_depth
    int skip_depth;
    bool ended, end_reported;
    Diag *semicolon;    // that `last` is, when it was reported to be missing
    uint32_t wrong_end; // of the last token that was reported, or the place where one was missing
    Span suspect;       // the first { whose } stands further left than its line: the likely one that is not closed
} Filter;

void filter_init(Filter *filter, Unit *unit, Scanner *scanner);

// The next token for the parser: `last`, until the next call.
const Token *filter_next(Filter *filter);

// The parser has found the last token wrong: skip to where it can go on.
void filter_recover(Filter *filter);

// True if nothing but space and closing marks stands between the token and what was reported before it: the same mistake, met once more.
bool filter_goes_on_wrong(const Filter *filter, const Token *token);

// True if the line goes on to a ) or ] that closes nothing: then the one that opens was forgotten, and the commas are what stood in it.
bool filter_leads_to_stray(const Filter *filter, const Token *comma, Span *stray);
void filter_report_stray(Filter *filter, Span span);

// The parser has found that a { is missing before the last token: its } is no second mistake.
void filter_forgive_brace(Filter *filter);

// True if the innermost bracket takes arguments as its entries (the block of a call or declaration), false for
// the file and for bodies.
bool filter_in_arguments(const Filter *filter);

#endif
