// What the parts of the checker share (check.h is the entry; nothing else includes this).
//
//   check.c         files, definitions, functions, the order in which they are checked
//   check_names.c   scopes: binding and finding names
//   check_modules.c libraries: collecting their definitions, names of `use`, what nothing uses
//   check_block.c   blocks and their items
//   check_expr.c    expressions but calls, conversions and their messages
//   check_cases.c   the cases of keys and match
//   check_call.c    calls: which of several of a name, what argument goes to which parameter, the type of the result
#ifndef SCN_COMPILER_CHECKER_H
#define SCN_COMPILER_CHECKER_H

#include "compiler/program.h"
#include "lang/ast.h"
#include "lang/unit.h"

typedef struct NameEntry { // what a name means, by level
    Name name;
    Symbol *local;   // innermost first, linked by `outer`
    Symbol *global;  // of files, one of each module
    Symbol *brought; // by `use`, one of each module
    Symbol *builtin;
} NameEntry;

typedef struct BlockScope { // the blocks around, for used-early
    const Node *items;
    uint32_t around; // scope of the block around
    struct BlockScope *outer;
} BlockScope;

// What is being checked: a definition of a file or the body of a function. Checking another in between saves and
// restores it.
typedef struct Body {
    uint32_t id;    // names of other bodies are not seen
    uint32_t scope; // of the innermost block
    uint32_t slots; // of its frame, so far
    BlockScope *block;
    Symbol *symbol;  // the definition, or NULL for an item that defines nothing
    int conditional; // depth of branches that may not be evaluated
    Module *module;  // whose names it sees; NULL in the prelude
    bool quiet;      // compiled in: no warnings of style
    struct Body *outer;
} Body;

typedef struct Checker {
    Unit *unit;
    Program *program;
    Arena scratch;
    NameEntry *entries; // open addressing, by pointer
    uint32_t count, capacity;
    Symbol **locals; // bound names, innermost last
    uint32_t local_count, local_capacity;
    uint32_t body_count, scope_count;
    Module *module, **modules_end; // whose definitions are being collected
    struct Use *uses, **uses_end;
    Body *body;
    const char *stack; // where checking began
    Name builtin_names[BUILTIN_END];
    const Node *early[8]; // definitions that were used before they stand, and reported: they are not unused
    int early_count;
    int suggestions; // made so far: each costs a look at every name
} Checker;

// --- check_names.c

void names_builtin(Checker *c); // binds the table of built-ins
Symbol *names_global(Checker *c, SymbolKind kind, Name name, Span span, const Node *node); // reports redefined, shadow
Symbol *names_prelude(Checker *c, Name name); // where a tag of the prelude is bound; its overloads are chained
Symbol *names_local(Checker *c, SymbolKind kind, Name name, Span span, const Node *node, Type type);
Symbol *names_find(Checker *c, Name name);                     // NULL if it means nothing here
bool names_hide_builtin(Checker *c, Name name);                // something that is called is built in under the name
Symbol *names_in(Checker *c, const Module *module, Name name); // a definition of a module, or NULL
Symbol *names_bring(Checker *c, SymbolKind kind, Module *module, Name name, Span span); // what `use` binds
Symbol *names_brought(Checker *c, const Module *module, Name name); // by a `use` of a module, or NULL
const char *names_nearest_in(Checker *c, const Module *module, Name name);
Symbol *names_use(Checker *c, Name name, Span span, bool called); // reports unknown-name and used-early; never NULL
uint32_t names_open(Checker *c, BlockScope *scope, const Node *items); // gives what names_close wants
void names_close(Checker *c, uint32_t mark);

// --- check.c

void check_symbol(Checker *c, Symbol *symbol); // makes its type known
void check_now(Checker *c, Symbol *symbol);    // the same of one that nothing has looked at
void body_enter(Checker *c, Body *body, Symbol *symbol, Module *module);
void collect_file(Checker *c, Node *file);
void body_leave(Checker *c);
void need(Checker *c, Symbol *symbol);         // the current definition evaluates this one for certain
Type check_type(Checker *c, const Node *node); // a NODE_TYPE

// --- check_modules.c

typedef struct Use { // a `use` in a module
    struct Use *next;
    Module *module;
    Node *node;
} Use;

void modules_begin(Checker *c, Node *tree);
void modules_use(Checker *c, Node *node);   // collects the library's definitions, if they are not yet
void modules_bind(Checker *c);              // binds the names of all `use`, when all definitions are known
void modules_check(Checker *c);             // the definitions of libraries
void modules_reach(Checker *c, Node *tree); // marks what of libraries the scene needs
void modules_report_unused(Checker *c, Node *tree);
Symbol *modules_find(Checker *c, const Module *library, Name name, Span span);                  // reports; never NULL
Symbol *modules_find_within(Checker *c, Name library, Span library_span, Name name, Span span); // the same, by its name
const char *modules_offer(Checker *c, Name name);      // "clay.worn", where a library in use has that name
const char *modules_library_of(Checker *c, Name name); // "brushes", where a library of scn has it that is not in use

// --- check_block.c

// The cases of a call of keys or match (check_cases.c).
typedef struct Cases Cases;

// How a block is read: as any number of values or as exactly one.
typedef struct Values {
    bool many;
    bool known;       // `want` says what they are to be; otherwise they are joined
    bool sheets;      // patches are taken, though `want` is object
    bool file;        // whatever may stand in a file: objects, lights, cameras …
    Type want;        // of each
    Cases *cases;     // not values but cases are wanted; else NULL
    Type joined;      // what they are, if not known
    int count;        // values written, an `if` counts as one
    bool entries;     // it has some, though nothing takes them: reported once
    const char *what; // "union", "the tool nip": who wants them, for messages
} Values;

Type check_block(Checker *c, Node *block, Values *values); // the joined type, or what was wanted
void check_item(Checker *c, Node *item, Values *values);   // in the scope that is open
Type check_if(Checker *c, Node *node, Values *values);     // as an item if values->many, else as a value
void check_for(Checker *c, Node *node, Values *values);
void check_value(Checker *c, Node *node, Type have, Values *values);
Type check_definition(Checker *c, Node *node, Node **value); // of either: the type, and the expression it stands for

// --- check_expr.c

Type check_expr(Checker *c, Node *node);
Type check_symbol_value(Checker *c, Symbol *symbol, const Node *node); // of a name that is used as a value
bool type_has_member(Type type, const char *name);
Type check_as(Checker *c, Node *node, Type want, const char *what); // want, or poisoned after a report
bool expect(Checker *c, const Node *node, Type have, Type want, const char *what);
Type poison(void);

// --- check_cases.c

Type check_cases(Checker *c, const Node *node, const Call *call,
                 Type driver); // the block of such a call: the type of its value
void check_case(Checker *c, Node *item, Cases *cases);
void check_value_among_cases(Checker *c, Node *item, Cases *cases);

// --- check_call.c

// A call of what `symbol` means, or NULL: of what its name means here. The receiver is NULL if nothing stands before the
// dot, or a library does.
Type check_call(Checker *c, Node *node, const Type *receiver, Symbol *symbol);

#endif
