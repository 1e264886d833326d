// The compiler from end to end: a source text becomes a plan and a kernel.
//
//     Unit unit;
//     unit_init(&unit);
//     Source *source = source_add(&unit.sources, path, text, length, (Span){0});
//     Compiled *compiled = compile(&unit, source, &(CompileOptions){.kernel = true});
//     diag_print(&unit, stderr, color);
//     if (!compiled->plan) … unit.errors > 0, or compiled->wrong says what is wrong with the command line
//
// Everything that is made belongs to the unit's arena. Nothing is printed but what the options ask for.
#ifndef SCN_COMPILER_COMPILE_H
#define SCN_COMPILER_COMPILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "compiler/ir.h"
#include "compiler/param.h"
#include "compiler/plan.h"
#include "lang/unit.h"

typedef struct CompileElaborated { // the IR before the passes, in the unit's arena: they append to it and move its root
    const Ir *ir;
    IrId root;
} CompileElaborated;

typedef struct CompileOptions {
    const Define *defines; // -D name=value, in order
    int define_count;
    const char *camera; // the camera to look through; NULL: the first
    const char *only;   // the name of the objects that are shown alone; NULL: all
    bool unused;        // also finds the mistakes of what nothing uses (scn check, editors)
    bool patches;       // also those patches that nothing shows (scn patch)
    bool kernel;        // also makes the kernel's source
    FILE *print;        // where `print` in scenes writes; NULL: nowhere

    // `scn dump`: each is written as soon as it is there; NULL: not asked for.
    FILE *dump_tree, *dump_ir; // the tree; the IR as elaborated
    FILE *dump_after, *dump_kernel;
    const char *after;             // the pass whose IR goes to dump_after: compile_pass_name()
    CompileElaborated *elaborated; // filled for `scn tree`; NULL: not asked for
} CompileOptions;

typedef enum CompilePhase {
    PHASE_PARSE,
    PHASE_CHECK,
    PHASE_ELABORATE,
    PHASE_PASSES,
    PHASE_LOWER,
    PHASE_WARN,
    PHASE_EMIT,
    PHASE_COUNT
} CompilePhase;

typedef struct Compiled {
    Plan *plan;         // NULL where the scene has errors
    const char *kernel; // OpenCL C, if it was asked for
    size_t kernel_length;
    const char *wrong; // what is wrong with a define, the camera's name, `only` or `after`; NULL if nothing
    double milliseconds[PHASE_COUNT]; // CPU time of each phase
} Compiled;

Compiled *compile(Unit *unit, const Source *source, const CompileOptions *options);

const char *compile_phase_name(CompilePhase phase); // "parse"
const char *compile_pass_name(int k);               // the passes in their order; NULL behind the last

#endif
