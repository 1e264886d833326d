// The tree of a source text.
//
// Nodes live in the unit's tree_arena, which may be released before the unit; names, texts and documentation live in its arena.
// parse() always gives a tree: NODE_ERROR stands where the text made no sense (and was reported). The
// grammar's actions call the constructors below and do nothing else; no name is looked up here and no type known.
// Children that are lists are linked by `next`.
//
// Depth: no path from the root has more than NODE_DEPTH_MAX steps, so recursion over the tree is safe, with
// one exception that each walk must mind. Chains that grow to the left, `a | b | c …` and `a.f().g() …`, may have any
// number of links, since a chain counts as one step: a node and its left child `a` are one chain where both are
// of the kinds that node_is_link() names. Walk a chain by a loop, and recurse only into what hangs at its links:
//
//     int count;
//     Node **link = node_spine(&scratch, node, &count);   // link[0] innermost, link[count - 1] == node
//     Value value = check(link[0]->a);                     // NULL for a call without a receiver
//     for (int i = 0; i < count; i++) value = check_link(link[i], value);
//
// An `if` with many `else if` is nested in `c` and counts as deep as it is.
#ifndef SCN_LANG_AST_H
#define SCN_LANG_AST_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "lang/arena.h"
#include "lang/intern.h"
#include "lang/source.h"

struct Unit;

typedef enum NodeKind {
    NODE_ERROR,
    // A file: items. Top-level items are VERSION INCLUDE USE PARAM FN TAG TOOL and what a block holds.
    NODE_FILE,      // a: items; doc: the file's own documentation; text: its path
    NODE_VERSION,   // number
    NODE_INCLUDE,   // text, length; a: the NODE_FILE it stands for, or NULL where it was spliced before
    NODE_USE,       // name, or NULL and b: NODE_TEXT of the path; a: list of NODE_NAME after ':'; alias: `as`, and
                    //   c: its NODE_NAME; file: the NODE_FILE, shared by all that use it, or NULL if it was not found
    NODE_PARAM,     // a: NODE_PARAMETER
    NODE_FN,        // name; a: parameters; b: result NODE_TYPE or NULL; c: NODE_BLOCK
    NODE_TAG,       // as NODE_FN
    NODE_TOOL,      // as NODE_FN, b is NULL
    NODE_PARAMETER, // name; a: NODE_TYPE; b: default or NULL; c: range or choices or NULL; doc
    NODE_TYPE,      // name, or a: the NODE_TYPE of the elements of a list
    // Items of a block.
    NODE_BLOCK,   // a: items
    NODE_VALUE,   // a: expression
    NODE_ENTRY,   // a: key expression; b: value; name: easing or NULL; c: list of arguments of the easing
                  //   word: the library that the easing is of, or NULL; name_span then holds both
    NODE_LET,     // name; a: value
    NODE_DECLARE, // word (the kind: object, light …), name; a: value after '=' or a NODE_BLOCK (then flag is set);
                  //   b: NODE_MEMBER of the word where it is of a library, else NULL
    NODE_FOR,     // name; a: what is walked; b: NODE_BLOCK. Also an element of a list. doc is never set
    NODE_ASSERT,  // a: condition; b: message or NULL
    NODE_PRINT,   // a: list of expressions
    // Expressions.
    NODE_NAME,     // name
    NODE_NUMBER,   // number, with the sign before it, unit, flag: an int (no point and no exponent)
    NODE_COLOR,    // color: 0xrrggbb
    NODE_BOOL,     // flag
    NODE_STRING,   // a: pieces: NODE_TEXT and expressions, in order
    NODE_TEXT,     // text, length: escapes already replaced
    NODE_VECTOR,   // a: two or three expressions
    NODE_LIST,     // a: expressions and NODE_FOR
    NODE_PAREN,    // a: expression in parentheses, kept for the formatter
    NODE_UNARY,    // op; a, which is no number if op is NODE_OP_NEG; flag: written in a foreign way, and reported
    NODE_BINARY,   // op; a, b. Also ranges, comparisons, and/or
    NODE_CALL,     // name; a: receiver of a dot or NULL; b: list of arguments; c: NODE_BLOCK or NULL
                   //   flag: had parentheses. `a.f` without parentheses or block is NODE_MEMBER
    NODE_ARGUMENT, // an argument with a name: name; a: expression; flag: written with `=`, and reported. One without stands in the list as its expression
    NODE_MEMBER,   // a; name
    NODE_INDEX,    // a; b: index
    NODE_IF,       // a: condition; b: NODE_BLOCK; c: NODE_BLOCK, NODE_IF or NULL
    NODE_KIND_COUNT
} NodeKind;

typedef enum NodeOp { // unary: NEG, COMPLEMENT, NOT
    NODE_OP_NONE,
    NODE_OP_OR,
    NODE_OP_AND,
    NODE_OP_NOT,
    NODE_OP_EQ,
    NODE_OP_NE,
    NODE_OP_LT,
    NODE_OP_LE,
    NODE_OP_GT,
    NODE_OP_GE,
    NODE_OP_RANGE,
    NODE_OP_UNION,
    NODE_OP_INTERSECT,
    NODE_OP_ADD,
    NODE_OP_SUB,
    NODE_OP_MUL,
    NODE_OP_DIV,
    NODE_OP_POW,
    NODE_OP_NEG,
    NODE_OP_COMPLEMENT,
} NodeOp;

typedef enum NumberUnit { // the suffix of a number
    UNIT_NONE,
    UNIT_DEG,
    UNIT_RAD,
    UNIT_TURN, // angles
    UNIT_S,
    UNIT_MS,
    UNIT_F, // times; f is frames
} NumberUnit;

typedef struct Node Node;
struct Node {
    uint8_t kind; // NodeKind
    uint8_t op;   // NodeOp
    uint8_t unit; // NumberUnit
    bool flag;
    uint16_t depth; // steps to the deepest node below; see the top of this file
    Span span;      // the whole of it
    Span name_span; // the name alone, or the operator
    Node *next;     // in a list
    Node *a, *b, *c;
    union {
        Name name;
        double number;
        uint32_t color;
        uint32_t length; // of text
    };
    union {
        Name word;        // NODE_DECLARE, NODE_ENTRY
        Name alias;       // NODE_USE
        const char *text; // NODE_TEXT, NODE_INCLUDE, NODE_FILE (its path)
    };
    union {
        const char *doc; // of `///` before it, lines joined by \n; NULL if none
        Node *file;      // NODE_USE
    };
    void *note; // what later phases know about it
};

// Parses the text of `source` alone. Reports to the unit. Never NULL.
Node *parse_source(struct Unit *unit, const Source *source);

// Parses `source` and all that it includes and uses, each once. The tree of an included file hangs at its NODE_INCLUDE.
Node *parse(struct Unit *unit, const Source *source);

// Prints the tree, a node a line, for `scn dump --ast` and tests. A chain is a line and, deeper, its links in order.
void ast_print(const struct Unit *unit, const Node *tree, FILE *out);

enum { NODE_DEPTH_MAX = 256 };

// True for the kinds that make chains: NODE_BINARY, NODE_CALL, NODE_MEMBER, NODE_INDEX (their `a` is the left of the chain).
static inline bool node_is_link(const Node *node)
{
    return node->kind == NODE_BINARY || node->kind == NODE_CALL || node->kind == NODE_MEMBER ||
           node->kind == NODE_INDEX;
}

// The chain that ends in `node`, from the innermost link on, in an array of the arena. For a node that is no link, it alone.
Node **node_spine(Arena *scratch, Node *node, int *count);

const char *node_kind_name(NodeKind kind);     // "binary"
const char *node_op_text(NodeOp op);           // "|"
const char *number_unit_text(NumberUnit unit); // "deg"; "" for none

#endif
