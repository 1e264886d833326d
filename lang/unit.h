// One compilation: everything that its phases share. There are no globals.
#ifndef SCN_LANG_UNIT_H
#define SCN_LANG_UNIT_H

#include "lang/arena.h"
#include "lang/diag.h"
#include "lang/intern.h"
#include "lang/lost.h"
#include "lang/source.h"

// Gives the text of a library that is compiled in ("brushes" for `use brushes`) and its length in bytes; NULL if there
// is none of that name. The text outlives the unit. With a NULL name it gives instead the names of all, separated
// by single spaces, for suggestions.
typedef const char *LibraryText(const char *name, size_t *length);

typedef struct Unit {
    Arena arena;
    Arena
        tree_arena; // the nodes of the trees and what is known of them: released when nothing needs the trees any more
    Sources sources;
    Names names; // interned: equal names are equal pointers
    Diagnostics diagnostics;
    int errors, warnings; // counted as they are reported
    int promoted;         // of the errors those that are warnings by themselves: they hide nothing
    Lost lost;            // what mistakes have hidden

    // Options, set before parse().
    const char *const *include_paths; // -I, in order
    int include_path_count;
    const char *search_path; // SCN_PATH, ':' between folders; may be NULL
    LibraryText *library;    // the libraries that are compiled in; may be NULL
} Unit;

void unit_init(Unit *unit);
void unit_release(Unit *unit);

#endif
