// Any bytes are a text: where the parser finds nothing wrong with it, it can be formatted. The result is the same scene (which
// format_source() tests by itself), and formatted again it stays as it is.
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lang/ast.h"
#include "lang/format.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length);

// An assert() would be left out of an optimised build.
static void require(bool holds, const char *what)
{
    if (holds) return;
    fprintf(stderr, "not true: %s\n", what);
    abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length)
{
    if (length > 20000) return 0;
    Unit unit;
    unit_init(&unit);
    char *text = arena_text(&unit.arena, (const char *)bytes, length);
    const Source *source = source_add(&unit.sources, "fuzz.scn", text, length, (Span){0});
    parse_source(&unit, source);
    if (!unit.errors) {
        size_t once_length, twice_length;
        const char *once = format_source(&unit, source, &(FormatOptions){0}, &once_length);
        require(once, "it is the same scene");
        const Source *again = source_add(&unit.sources, "again.scn", once, once_length, (Span){0});
        const char *twice = format_source(&unit, again, &(FormatOptions){0}, &twice_length);
        require(twice && once_length == twice_length && memcmp(once, twice, once_length) == 0,
                "it is formatted once for all");
        require(format_source(&unit, source, &(FormatOptions){2, 3}, &once_length), "so are its lines");
    }
    unit_release(&unit);
    return 0;
}
