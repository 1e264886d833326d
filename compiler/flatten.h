// One scene of many files: the text of a scene with all that it includes and uses put into it.
//
//     unit.library = stdlib_library;
//     Node *tree = parse(&unit, source);
//     check(&unit, tree);
//     if (!unit.errors) text = flatten(&unit, tree, &length);
//
// What an include names stands in its place, without its version line. Of libraries only the definitions that the scene
// needs are there, behind it, with the comments before them; each keeps its name where no other definition and nothing
// built in has it, and is else called LIBRARY_name everywhere. Handles of libraries are renamed as well: a
// `param darkness` of clay is `-D clay.darkness` before and a param of the scene afterwards. The IR is the same but for
// the names of those.
#ifndef SCN_COMPILER_FLATTEN_H
#define SCN_COMPILER_FLATTEN_H

#include <stddef.h>

#include "lang/ast.h"
#include "lang/unit.h"

// Takes a tree that check() found nothing wrong with. The result is the unit's arena's, zero-terminated and not yet formatted.
// NULL with a message in the unit where the scene cannot be said in one file.
char *flatten(Unit *unit, Node *tree, size_t *length);

#endif
