// Where a checked tree names what is written in SCN: the definitions of files, locals, parameters, loops.
//
//     references_visit_file(&state, tree, visit);      // visit(&state, node, symbol, span) for each
//
// `span` is all of the name, a library's before it included: `clay.worn` of `clay.worn(a)`, `.clay.worn` without its
// first dot of `a.clay.worn()`. Words of declarations and easings of keys are names too. What is built in is not told,
// nor is a library by itself. Order: of the text but for chains, whose links come from the last to the first.
#ifndef SCN_COMPILER_REFERENCES_H
#define SCN_COMPILER_REFERENCES_H

#include "compiler/program.h"
#include "lang/ast.h"

typedef void ReferenceVisit(void *user, const Node *node, Symbol *symbol, Span span);

void references_visit(void *user, const Node *list, ReferenceVisit *visit);            // all of a list, but other files
void references_visit_definition(void *user, const Node *node, ReferenceVisit *visit); // one item alone
void references_visit_file(void *user, const Node *file, ReferenceVisit *visit);       // with what it includes

#endif
