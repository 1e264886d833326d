// What the grammar's actions call, and what they share. For parse.y, build.c and expect.c alone.
//
// An action is one call of a constructor. A constructor takes the span of the whole; it fills in the node, documentation
// and depth, and reports what the grammar lets through on purpose: the forms of other languages. It never looks up a name.
#ifndef SCN_LANG_PARSER_H
#define SCN_LANG_PARSER_H

#include "lang/ast.h"
#include "lang/filter.h"
#include "lang/scan.h"
#include "lang/unit.h"

typedef struct Parser {
    Unit *unit;
    const Source *source;
    Scanner scanner;
    Filter filter;
    Node *file;    // the result
    Span lost;     // the last text that was skipped
    bool too_deep; // reported: once is enough
} Parser;

// --- Lists ---

NodeList list_of(Node *node); // of one node, or of none if it is NULL
NodeList list_add(NodeList list, Node *node);

// --- Items ---

Node *build_file(Parser *p, Span span, NodeList items);
Node *build_version(Parser *p, Span span, Number number, Span number_span);
Node *build_include(Parser *p, Span span, Text path, Span path_span);
Node *build_use(Parser *p, Span span, Name name, Text path, Span what, Node *alias, NodeList names);
Node *build_param(Parser *p, Span span, Node *parameter);
Node *build_function(Parser *p, NodeKind kind, Span span, Name name, Span name_span, NodeList parameters, Node *result,
                     Node *body);
Node *build_parameter(Parser *p, Span span, Name name, Span name_span, Node *type, Node *otherwise, Node *within);
Node *build_untyped(Parser *p, Span span, Name name, Span name_span, Node *otherwise);              // fn f(x)
Node *build_type_first(Parser *p, Span span, Name type, Span type_span, Name name, Span name_span); // fn f(float x)
Node *build_type(Parser *p, Span span, Name name, Node *element);

Node *build_block(Parser *p, Span span, NodeList items);
Node *build_value(Parser *p, Span span, Node *value);
Node *build_entry(Parser *p, Span span, Node *key, Node *value, Name easing, Span easing_span, NodeList arguments);
Node *build_let(Parser *p, Span span, Name name, Span name_span, Node *value);
Node *build_typed_let(Parser *p, Span span, Name name, Span name_span, Node *type, Node *value); // let x: scalar = 1;
// An easing of a library, and a declaration with a word of one.
Node *build_entry_within(Parser *p, Span span, Node *key, Node *value, Name library, Span library_span, Name easing,
                         Span easing_span, NodeList arguments);
Node *build_declaration_within(Parser *p, Span span, Node *library, Name word, Span word_span, Name name,
                               Span name_span, Node *block);
Node *build_declaration(Parser *p, Span span, Name word, Name name, Span name_span, Node *value, bool arguments);
Node *build_assignment(Parser *p, Span span, Name name, Span name_span, Span equals, Node *value); // x = 3;
Node *build_for(Parser *p, Span span, Name name, Span name_span, Node *range, Node *body);
Node *build_head_in_parentheses(Parser *p, Span span, Name name, Span name_span, Node *range); // (i in 0..5), for:
Node *build_for_with_head(Parser *p, Span span, Node *head, Node *body);
Node *build_assert(Parser *p, Span span, Node *condition, Node *message);
Node *build_print(Parser *p, Span span, NodeList values);

// --- Expressions ---

Node *build_error(Parser *p, Span span, Node *receiver); // receiver: what stands before a dot without a name, or NULL
Node *build_name(Parser *p, Span span, Name name);
Node *build_number(Parser *p, Span span, Number number);
Node *build_color(Parser *p, Span span, uint32_t color);
Node *build_bool(Parser *p, Span span, bool value);
Node *build_text(Parser *p, Span span, Text text); // NULL for an empty one
Node *build_string(Parser *p, Span span, NodeList pieces);
Node *build_vector(Parser *p, Span span, NodeList parts);
Node *build_list(Parser *p, Span span, NodeList elements);
Node *build_paren(Parser *p, Span span, Node *inner);
Node *build_unary(Parser *p, Span span, NodeOp op, Span op_span, Node *a);
Node *build_foreign_not(Parser *p, Span span, Span op_span, Node *a); // !a
Node *build_binary(Parser *p, Span span, NodeOp op, Span op_span, Node *a, Node *b);
Node *build_comparison(Parser *p, Span span, NodeOp op, Span op_span, Node *a, Node *b); // also a < b < c
Node *build_modulo(Parser *p, Span span, Span op_span, Node *a, Node *b);                // a % b
Node *build_call(Parser *p, Span span, Name name, Span name_span, Node *receiver, Node *call);
Node *build_arguments(Parser *p, Span span, bool parentheses, NodeList arguments, Node *block); // what build_call takes
Node *build_argument(Parser *p, Span span, Name name, Span name_span,
                     Node *value); // with a name: others are their expression
Node *build_named_with_equals(Parser *p, Span span, Name name, Span name_span, Span equals,
                              Node *value); // f(radius = 2)
Node *build_member(Parser *p, Span span, Node *a, Name name, Span name_span);
Node *build_index(Parser *p, Span span, Node *a, Node *index);
Node *build_if(Parser *p, Span span, Node *condition, Node *then, Node *otherwise);

// --- Syntax errors (expect.c) ---

// Says that `found` cannot stand where it does, when `expected` (token codes) could. `place` is where it stands.
void report_unexpected(Parser *p, const Token *found, const int *expected, int count);

#endif
