// A checked scene: what check() finds out about a tree and elaborate() builds on.
//
// check() hangs what it knows at Node.note:
//   NODE_FILE (the tree)      Program
//   NODE_NAME                 Symbol
//   NODE_CALL, NODE_DECLARE   Call (NODE_DECLARE with a block: the call of its word)
//   NODE_LET, NODE_DECLARE=   Symbol          NODE_FOR       Symbol of its name
//   NODE_PARAM                Symbol          NODE_FN TAG TOOL  Symbol
//   NODE_MEMBER               Symbol of what a library is asked for, as `tint` in `clay.tint`; a SYMBOL_LIBRARY where it
//                             says where the call behind it is found, as `clay` in `head.clay.worn()`; else NULL
//   NODE_FILE (of a library)  Module
// Names are bound to symbols once, so that evaluating never looks up a text. Calls live in the unit's tree_arena, as
// the nodes do; the rest in its arena.
#ifndef SCN_COMPILER_PROGRAM_H
#define SCN_COMPILER_PROGRAM_H

#include "compiler/builtins.h"
#include "compiler/types.h"
#include "lang/ast.h"
#include "lang/unit.h"

struct Value;

// The files whose definitions see each other without more: the scene with all that it includes, or a library with all
// that it includes. The prelude has none.
typedef struct Module {
    Name name; // of a library, as its params are called on the command line; unlike those of the others
    Node *file;
    bool library;
    bool quiet;           // is compiled in: nothing is said about its style
    struct Module *next;  // in the order in which they are met
    struct Symbol *first; // its definitions, in the order of the text
    struct Symbol **end;
} Module;

// A parameter of a call, of a built-in or a user's function alike.
typedef struct Parameter {
    Name name;
    Type type;
    uint8_t generic;      // Generic
    bool optional, later; // `type?`; not there yet
    const char *doc;
    const Node *node;           // NODE_PARAMETER of what is written in SCN, else NULL
    const char *default_text;   // of a built-in; NULL: none
    int default_from;           // a built-in's default is this earlier parameter, or -1
    const char *const *choices; // that are known as strings, ended by NULL, or NULL
    struct Symbol *symbol;      // the name in the body (SCN)
    const struct Value *value;  // of a constant default, once it has been evaluated
} Parameter;

typedef enum CallableKind { CALLABLE_BUILTIN, CALLABLE_FN, CALLABLE_TAG, CALLABLE_TOOL } CallableKind;

// What parameters every tool has behind its own.
enum { TOOL_AT, TOOL_NORMAL, TOOL_ON, TOOL_TURN, TOOL_PARAMETERS };

typedef struct Callable {
    Name name;
    uint8_t kind;  // CallableKind
    uint8_t state; // CheckState of the body
    bool prelude;  // compiled in: what happens in its body is told where the scene calls it
    bool lost;     // its parameters make no sense, which was reported
    bool declared; // its result type is written (or follows from its kind)
    uint16_t id;   // BuiltinId
    Parameter *parameters;
    uint32_t count; // a tool's: with TOOL_PARAMETERS at the end
    Type result;
    bool result_same;          // built-in: "same"
    const Node *node;          // NODE_FN, NODE_TAG, NODE_TOOL
    uint32_t slots;            // of a call's frame
    struct Callable *overload; // another of the same name, to be tried next (built-ins and prelude)
} Callable;

typedef enum SymbolKind {
    SYMBOL_LET,       // a let or declaration, of a file or a block
    SYMBOL_PARAM,     // of a file
    SYMBOL_PARAMETER, // of a fn, tag or tool
    SYMBOL_LOOP,
    SYMBOL_CALLABLE, // a user's fn, tag or tool; built-ins that are called
    SYMBOL_CONSTANT, // built in: pi, time, x …
    SYMBOL_LIBRARY,  // of a `use`: what stands before the dot
    SYMBOL_BROUGHT,  // a name of a library that a `use` brings as it is
    SYMBOL_ERROR,    // was reported
} SymbolKind;

typedef enum CheckState { CHECK_NOT, CHECK_NOW, CHECK_DONE } CheckState;

typedef struct Symbol {
    Name name;
    uint8_t kind;  // SymbolKind
    uint8_t state; // CheckState
    bool global;   // of a file
    bool hides;    // something built in has the name too
    bool used;
    bool reached;   // of a library: the scene needs it, by way of others perhaps
    Module *module; // of a file's definition; SYMBOL_LIBRARY, SYMBOL_BROUGHT: the one that uses it
    Type type;
    Span span;            // of the name, where it is defined
    const Node *node;     // the definition; NULL for built-ins
    Node *value;          // SYMBOL_LET: the expression
    Callable *callable;   // SYMBOL_CALLABLE
    uint16_t id;          // SYMBOL_CONSTANT: BuiltinId
    Module *opens;        // SYMBOL_LIBRARY: whose names it gives
    struct Symbol *means; // SYMBOL_BROUGHT: the definition in the library
    struct Symbol *next;  // of a file's definitions: the next of the module
    uint32_t slot;        // of a local name, in its frame
    uint32_t slots;       // of the frame in which a file's definition is evaluated
    uint32_t order;       // of a file's definition: its place in the text
    // Definitions that are evaluated for certain when this one is, so that long chains of them can be evaluated
    // without recursion.
    struct Symbol **needs;
    uint32_t need_count, need_capacity;
    struct Symbol *outer; // what the name means around its scope; of a file's: in another module
    uint32_t body, scope; // which body and block it is local to
    struct Value *memo;   // of a file's definition, once evaluated
    uint8_t progress;     // CheckState of the evaluation
    bool visited;         // while an order is looked for
} Symbol;

// One parameter's argument.
typedef enum BoundHow { BOUND_DEFAULT, BOUND_ONE, BOUND_LOOSE, BOUND_BLOCK } BoundHow;

typedef struct Bound {
    uint8_t how;    // BoundHow
    bool entry;     // BOUND_ONE: stands in the block, so is evaluated in its scope
    uint32_t count; // BOUND_LOOSE
    union {
        Node *node;   // BOUND_ONE: the expression; BOUND_BLOCK: the block
        Node **items; // BOUND_LOOSE: each an element or a list of elements
    };
} Bound;

typedef struct Call {
    const Callable *callee;
    Node *block; // NULL if the call has none
    bool has_entries;
    bool wrong;    // its arguments were reported
    Type result;   // of this call
    Bound bound[]; // callee->count
} Call;

typedef struct Program {
    Unit *unit;
    Symbol **items; // every item of the files in text order; entry i belongs to nodes[i]; NULL where it defines nothing
    Node **nodes;
    uint32_t count, capacity;
    uint32_t slots;  // of the frame in which file items are evaluated
    Module *modules; // the scene's, then the libraries
} Program;

// Bytes of the C stack between a place where a phase began and here. Definitions may wait for each other in chains of
// any length; the phases recurse along them while this is small, and order the rest of the chain by a loop.
static inline size_t stack_used(const char *begin)
{
    const char *here = __builtin_frame_address(0);
    return begin > here ? (size_t)(begin - here) : (size_t)(here - begin);
}

// Whether a node stands for a library and not for a value: `clay` in `clay.tint` and in `head.clay.worn()`.
static inline bool names_a_library(const Node *node)
{
    if (!node || (node->kind != NODE_NAME && node->kind != NODE_MEMBER) || !node->note) return false;
    return ((const Symbol *)node->note)->kind == SYMBOL_LIBRARY;
}

#endif
