// The one style of scenes.
//
// The formatter changes space, line breaks, and two kinds of marks that mean nothing. What it keeps: every other word, every comment
// in its order, at most one empty line wherever there was one, and what the author put on several lines.
//
//  - 4 spaces a level, lines of up to 110 columns, comments as they are.
//  - An item a line. A block stands on one line if it was written on one and fits; so do all blocks of an if.
//  - A list in ( ) or [ ] that fits stands on one line, unless it was written with a line break behind its opening mark: then its lines stay
//    as they are, as far as they fit. One that does not fit is broken between its elements, and ends with a comma.
//  - Operators of one rank stand at the beginning of lines if one of them was written at a line's beginning or end, or if they do not fit
//    on one line; so do the dots of several calls.
//  - Spaces around operators but `^`, behind commas and colons, and inside of { }.
//  - A `;` that ends no item goes; so does the one behind a } that ends a value. All else ends with one, but a value that is last in the
//    body of a fn, tag, tool, if or for may do without: so results are written.
//  - `a - union { … }` that does not fit is broken inside of the block alone.
//  - Comments at the ends of neighbouring lines begin in one column, also where one or two lines between them have none.
//
// Formatting twice changes nothing more, and the tree is the same afterwards: format_source() tests the latter each time.
//
//     if (!unit->errors) text = format_source(unit, source, &(FormatOptions){0}, &length);
#ifndef SCN_LANG_FORMAT_H
#define SCN_LANG_FORMAT_H

#include <stddef.h>
#include <stdint.h>

#include "lang/source.h"
#include "lang/unit.h"

typedef struct FormatOptions {
    uint32_t first_line, last_line; // format what stands in these lines of the source, counted from 1; 0 and 0: in all
} FormatOptions;

// Formats the text of `source`, which parse_source() must have found nothing wrong with. The result, with a terminating zero, is the unit's
// arena's. NULL if the result would not be the same scene, which would be a mistake of the formatter.
char *format_source(Unit *unit, const Source *source, const FormatOptions *options, size_t *length);

#endif
