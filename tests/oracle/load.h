// From a scene's text to the IR as elaborated, before any pass: what the oracle reads.
//
//     OracleSource source;
//     if (oracle_load(&source, "a.scn", NULL, 0)) oracle_new(source.ir, …);
//     oracle_unload(&source);
#ifndef SCN_TESTS_ORACLE_LOAD_H
#define SCN_TESTS_ORACLE_LOAD_H

#include <stdbool.h>
#include <stddef.h>

#include "compiler/ir.h"
#include "lang/unit.h"

typedef struct OracleSource {
    Unit unit;
    Ir *ir;       // NULL where the scene has errors
    double bound; // of a "// bound: R" line: everything is in the ball of this radius around the origin; 0 without one
} OracleSource;

// `text` NULL: reads the file. Says what is wrong on standard error.
bool oracle_load(OracleSource *source, const char *path, const char *text, size_t length);
void oracle_unload(OracleSource *source);

#endif
