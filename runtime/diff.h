// The difference of two texts by lines, in the unified form that `patch` reads.
#ifndef SCN_RUNTIME_DIFF_H
#define SCN_RUNTIME_DIFF_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

// Prints how `before` becomes `after`, with three lines around each change, under the name of the file. Nothing is printed for
// equal texts. `color` uses ANSI colours.
void diff_print(FILE *out, const char *name, const char *before, size_t before_length, const char *after,
                size_t after_length, bool color);

#endif
