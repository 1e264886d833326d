// Static checking: names, types with dimensions, arguments and members, over the whole tree, also what nothing uses.
//
// check() reports to the unit and hangs what it finds out at the tree (compiler/program.h), where elaborate() takes
// it from. Nothing is evaluated here: rates, ranges and counts are elaborate()'s. A tree with errors of the parser
// may be checked too.
//
//     Node *tree = parse(unit, source);
//     check(unit, tree);
//     if (!unit->errors) ir = elaborate(unit, tree, &options);
#ifndef SCN_COMPILER_CHECK_H
#define SCN_COMPILER_CHECK_H

#include "lang/ast.h"
#include "lang/unit.h"

void check(Unit *unit, Node *tree);

#endif
