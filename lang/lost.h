// What a mistake hides from the phases behind it, so that one mistake stays one message.
//
// Text that the parser has skipped may define names, and a file that is missing surely does: a name that is not found because of that
// is no second mistake. Where a string, a comment or a brace that was forgotten ends is a guess: nothing that would follow
// from the guess is reported, and a unit whose shape is lost is not checked at all.
#ifndef SCN_LANG_LOST_H
#define SCN_LANG_LOST_H

#include <stdbool.h>
#include <stdint.h>

#include "lang/intern.h"
#include "lang/source.h"

struct Unit;

typedef struct NameSet { // open addressing by pointer
    Name *names;
    uint32_t count, capacity;
} NameSet;

typedef struct Lost {
    bool shape;  // brackets, strings or comments do not end where they should: only what was reported so far is sure
    bool files;  // a file that was to be included or used is not there: any name may be one of its
    Span silent; // reports that begin in here follow from one that was made, and are dropped
    bool
        read; // the parser is done: what is reported in a line of `lines` from now on follows from what was wrong with its shape
    Span *lines; // that the parser could not make sense of
    uint32_t line_count, line_capacity;
    NameSet words;   // of texts that were skipped
    NameSet defined; // those of them with a colon or `=` behind, as parameters and definitions have it
} Lost;

// A stretch of a source was skipped, with a report: the words in it may be names that it defined.
void lost_text(struct Unit *unit, Span span);

// The line of a place makes no sense as it stands: its words may be names, too, that it was to define.
void lost_line(struct Unit *unit, Span span);

// True if the line of a place is one that makes no sense.
bool lost_in_line(const struct Unit *unit, Span span);

// True if a report at a place would only follow from what was lost.
bool lost_report(const struct Unit *unit, Span span);

// A name was reported to mean nothing: once is enough, however often it is used.
void lost_add(struct Unit *unit, Name name);

// True if a name that means nothing here may have been defined by what was lost.
bool lost_name(const struct Unit *unit, Name name);

// True if what was lost may have been a definition of that name: then what is built in under it is not meant.
bool lost_definition(const struct Unit *unit, Name name);

#endif
