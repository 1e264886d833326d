// What the files that check a call share; nobody else needs it. check_call.c binds arguments to parameters, check_rules.c says
// what is missing, what single built-ins want beyond types, and what people write in place of a call.
#ifndef SCN_COMPILER_CHECK_CALL_H
#define SCN_COMPILER_CHECK_CALL_H

#include "compiler/checker.h"

typedef struct Argument {
    Node *node; // the expression
    Name name;  // NULL: positional
    Span span;  // of the name, or of the expression
    Type type;
    bool foreign; // its name was written with `=`, and reported
} Argument;

typedef struct Calling {
    Checker *c;
    Node *node;
    const Type *receiver; // or NULL
    Argument *arguments;
    uint32_t count, positional;
    const Callable *callee, *first; // the one that is meant, of those under this name
    Call *call;
    Type common;            // of the arguments whose types decide the result
    bool bad;               // something was reported
    bool number_for_vector; // and this among it
} Calling;

// The first list parameter, or the last; -1 if there is none.
int parameter_list_of(const Callable *callee, bool last);

// Neither optional nor with a default.
bool parameter_needed(const Parameter *p);

int parameter_named(const Callable *callee, Name name); // -1: none

// Mistakes that would be several messages, and of no help: a word where a string is wanted, a vector where a turn has three
// angles, a shape before the dot of a tool. True if there is one; then it was reported, and nothing of the call is bound.
bool call_report_habit(Calling *k);

// The same of one argument before its own type is asked: a name that nothing has, for a parameter that is a string.
bool call_report_word(Checker *c, const Callable *first, const Node *argument, uint32_t position);

// The hint behind "takes … arguments"; "" if nothing is known.
const char *call_hint_too_many(const Calling *k, uint32_t at);

void call_check_missing(Calling *k);
void call_check_rules(Calling *k); // of the built-in that is called
void call_check_place(Calling *k); // of a tool

#endif
