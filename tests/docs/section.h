// Parts of a text that a program makes, kept true.
//
// Such a part stands between two lines of the Markdown text,
//
//     <!-- NAME: made of lang/parse.y -->
//     <!-- end of NAME -->
//
// and is compared with what the program makes of it now: a part that differs is a failure, unless UPDATE is set in the environment, which
// writes it anew. Whole files that are made (pictures) are kept in the same way.
#ifndef SCN_TESTS_DOCS_SECTION_H
#define SCN_TESTS_DOCS_SECTION_H

#include <stdbool.h>

// Compares or replaces the part. Returns false, with a message, if it is not there or not as it should be. `text` ends with a line's end.
bool section_keep(const char *path, const char *name, const char *text);

// Compares or replaces a whole file.
bool section_keep_file(const char *path, const char *text);

// The text of a file, the caller's to free; NULL if there is none. Ends the process with status 3 for any other reason.
char *section_read(const char *path);

#endif
