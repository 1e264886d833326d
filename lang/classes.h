// What a token can be in a text: the one table of it, which the filter (semicolons that may be left out), the messages about
// what cannot stand there, and the formatter share.
//
//     TOKEN_BEGINS      a value may begin with it: a name, `-`, `(`, if …
//     TOKEN_CONTINUES   behind a whole value it goes on with that value: `-`, `(`, `.` …
//     TOKEN_ENDS        a value may end with it: a name, `)`, `}` …
//     TOKEN_ITEM        it begins an item and no value: let, fn, for …
//     TOKEN_BODIED      of these, those whose item ends with a block: fn, tag, tool, for
//
// A token of several classes is all of it: `-` begins a value, and continues one that stands before it.
#ifndef SCN_LANG_CLASSES_H
#define SCN_LANG_CLASSES_H

#include <stdbool.h>

enum { TOKEN_BEGINS = 1, TOKEN_CONTINUES = 2, TOKEN_ENDS = 4, TOKEN_ITEM = 8, TOKEN_BODIED = 16 };

// Whether a token, a code of parse.y, is of any of the classes.
bool token_is(int code, unsigned classes);

// Whether a token begins an item, by itself or as a value, where none is open. On a new line `(`, `[`, `{` and `-` could
// mean both, and go on.
bool token_begins_item(int code);

// The same behind a } that ends a value or a body: there `(` and `{` begin one, too.
bool token_begins_item_behind_brace(int code);

#endif
