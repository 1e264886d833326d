#include "compiler/stdlib.h"

#include <string.h>

#include "library_text.h"

const char *stdlib_library(const char *name, size_t *length)
{
    if (!name) {
        *length = strlen(STDLIB_LIBRARIES);
        return STDLIB_LIBRARIES;
    }
    for (const library_text_file *file = library_text_files; file->name; file++) {
        size_t stem = strcspn(file->name, "."); // of "brushes.scn"
        if (strlen(name) != stem || strncmp(file->name, name, stem)) continue;
        *length = file->length;
        return (const char *)file->text;
    }
    return NULL;
}
