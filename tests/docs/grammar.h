// The grammar as people read it, made of what bison says of it.
//
//     parse.y ─bison --xml─▶ productions ─grammar_simplify─▶ rules ─┬─ebnf─▶ text
//                                                                   └─railroad─▶ a picture each
//
// A grammar for bison is written for its automaton: lists are left recursions, what may be left out is an alternative of its own, and there
// are productions that only recover from errors or understand other languages. The rules here describe the same texts without those:
//
//   - productions with `error`, with MISSING (what the filter puts in after a report), or marked "foreign" in parse.y are left out;
//   - a left recursion is a repetition, an alternative that only has something more is an optional part;
//   - the binary operators of a rule, which precedence decides between, are one loop over operands; the table beside it says what binds first;
//   - rules that only name a list are put where they are used.
//
// All memory is the arena's.
#ifndef SCN_TESTS_DOCS_GRAMMAR_H
#define SCN_TESTS_DOCS_GRAMMAR_H

#include <stdbool.h>
#include <stdio.h>

#include "lang/arena.h"

typedef enum PartKind {
    PART_WORD,     // text is the word or mark itself: let, ;
    PART_CLASS,    // text names a class of words: NAME, INT
    PART_RULE,     // text is the rule's name
    PART_SEQUENCE, // of any number of parts; of none: nothing
    PART_CHOICE,
    PART_OPTIONAL, // of one part
    PART_REPEAT,   // one part, any number of times
    PART_LOOP      // the first part at least once, the second between two of them; only in pictures
} PartKind;

typedef struct Part {
    PartKind kind;
    const char *text;
    struct Part **parts;
    int count;
} Part;

typedef struct Production {
    const char *name;
    Part *sequence;
    const char *precedence; // of %prec, or NULL
    bool foreign;
} Production;

typedef struct Level { // of precedence: what is written for it, and which way it groups
    const char *name;  // bison's, of a token
    int level;         // more binds more
    const char *side;  // "left", "right", "nonassoc", "precedence"
} Level;

enum { GRAMMAR_MAX = 400 };

typedef struct Grammar {
    Arena arena;
    Production productions[GRAMMAR_MAX];
    int production_count;
    Level levels[GRAMMAR_MAX];
    int level_count;
    const char *lists[GRAMMAR_MAX]; // names of nonterminals whose values are lists
    int list_count;
} Grammar;

typedef struct Rule {
    const char *name;
    Part *body;
} Rule;

// Reads bison's report and the marks "foreign" of the grammar itself. Ends the process with a message if they do not fit together.
void grammar_read(Grammar *grammar, const char *report_path, const char *grammar_path);

// The word or class that a token of bison stands for: "let" for LET, ";" for ';'.
Part *grammar_token(Grammar *grammar, const char *token);

// The rules, in the order of the grammar. Returns how many.
int grammar_simplify(Grammar *grammar, Rule *rules);

bool part_equal(const Part *a, const Part *b);
Part *part_leaf(Arena *arena, PartKind kind, const char *text);
Part *part_sequence(Arena *arena, Part **parts, int count); // flattened; of one part: that part
Part *part_choice(Arena *arena, Part **parts, int count);
Part *part_wrap(Arena *arena, PartKind kind, Part *part);

// The rules as text, lines of up to 110 columns.
void grammar_ebnf(FILE *out, const Rule *rules, int count);

// The table of precedence, in Markdown.
void grammar_precedence(FILE *out, Grammar *grammar);

// One rule as a picture (SVG).
void grammar_railroad(FILE *out, Arena *arena, const Rule *rule);

#endif
