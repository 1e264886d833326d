// The libraries that are compiled in: the files of stdlib/ beside its prelude and its gallery. `use brushes` finds
// stdlib/brushes.scn, where no folder has a brushes.scn of its own.
//
//     unit.library = stdlib_library;     before parse()
#ifndef SCN_COMPILER_STDLIB_H
#define SCN_COMPILER_STDLIB_H

#include <stddef.h>

// The text of the library of that name and its length; NULL if there is none. Of a NULL name: the names of all, joined
// by single spaces. Both outlive everything. (LibraryText of lang/unit.h.)
const char *stdlib_library(const char *name, size_t *length);

#endif
