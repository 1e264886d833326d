// Elaboration: evaluates a checked tree into the IR.
//
// Calls of fn, tag and tool are inlined, loops walked, conditions decided, so that what is left are nodes: scalars of
// their rate, objects, materials, lights, cameras. What nothing uses is not evaluated. Definitions of a file are
// evaluated when they are first wanted, in blocks too; the order cannot be seen but in print, which keeps the order
// of the text.
//
//     ElaborateOptions options = {.print = stdout};
//     Ir *ir = elaborate(unit, tree, &options);
//     if (!ir) … unit->errors, or options.wrong says what is wrong with the command line
//
// Afterwards all values of the IR are finite or of a later rate, names and spans are those of the scene; what happens
// inside of the prelude is reported and located where the scene calls it.
#ifndef SCN_COMPILER_ELABORATE_H
#define SCN_COMPILER_ELABORATE_H

#include <stdio.h>

#include "compiler/ir.h"
#include "compiler/param.h"
#include "lang/ast.h"
#include "lang/unit.h"

typedef struct ElaborateOptions {
    const Define *defines; // -D name=value, in order; the last of a name counts
    int define_count;
    const char *camera; // the name of the camera to look through; NULL: the first
    const char *only;   // the name of the objects that are shown alone; NULL: all
    FILE *print;        // where `print` writes; NULL: nowhere
    bool patches;       // evaluates the file's patches, also those that nothing shows (scn patch)
    bool unused;        // evaluates also what nothing uses, to find its mistakes (scn check, editors)

    const char *
        wrong; // result: what is wrong with a define, the camera's name or the objects' (in the unit's arena), else NULL
} ElaborateOptions;

// Takes a tree without errors that check() has been over. Returns NULL if unit->errors grew or options->wrong is set.
Ir *elaborate(Unit *unit, Node *tree, ElaborateOptions *options);

#endif
