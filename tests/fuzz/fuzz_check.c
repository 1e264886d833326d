// Any bytes as a scene, through the whole front end: parsed, checked, elaborated, lowered to a plan, and its messages printed. There is a plan or an
// error, never neither, and every message stands in the text. Files are not looked for beyond the folder of the process.
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/compile.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length);

// An assert() would be left out of an optimised build.
static void require(bool holds, const char *what)
{
    if (holds) return;
    fprintf(stderr, "not true: %s\n", what);
    abort();
}

// Loops may run ten million times, as the language allows; a fuzzer would wait for them. Of numbers with many digits the last are cut off.
static size_t without_large_numbers(char *text, size_t length)
{
    enum { DIGITS_MAX = 2 };
    size_t kept = 0, digits = 0;
    for (size_t i = 0; i < length; i++) {
        bool digit = text[i] >= '0' && text[i] <= '9';
        digits = digit ? digits + 1 : 0;
        if (digits <= DIGITS_MAX) text[kept++] = text[i];
    }
    return kept;
}

static bool is_word(char c)
{
    return c == '_' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

// Nested loops and calls multiply. So few of them that what they make stays small.
static bool may_explode(const char *text, size_t length)
{
    enum { LOOPS_MAX = 2, CALLS_MAX = 2 };
    int loops = 0, callables = 0;
    for (size_t i = 0; i < length; i++) {
        if (i > 0 && is_word(text[i - 1])) continue;
        loops += length - i > 3 && !memcmp(text + i, "for", 3) && !is_word(text[i + 3]);
        callables += length - i > 2 && !memcmp(text + i, "fn", 2) && !is_word(text[i + 2]);
        callables += length - i > 3 && !memcmp(text + i, "tag", 3) && !is_word(text[i + 3]);
        callables += length - i > 4 && !memcmp(text + i, "tool", 4) && !is_word(text[i + 4]);
    }
    return loops > LOOPS_MAX || callables > CALLS_MAX;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length)
{
    if (length > 4000 || may_explode((const char *)bytes, length)) return 0;
    Unit unit;
    unit_init(&unit);
    char *text = arena_text(&unit.arena, (const char *)bytes, length);
    length = without_large_numbers(text, length);
    text[length] = 0;
    const Source *source = source_add(&unit.sources, "fuzz.scn", text, length, (Span){0});
    const Compiled *compiled = compile(&unit, source, &(CompileOptions){.unused = true, .kernel = true});
    require(compiled->plan || unit.errors > 0, "there is a plan or an error");
    for (const Diag *d = unit.diagnostics.first; d; d = d->next) {
        require(d->text && d->text[0], "a message says something");
        require(!d->span.end || source_of(&unit.sources, d->span.begin) == source,
                "a message stands in the author's text");
    }
    char *printed = NULL;
    size_t size;
    FILE *out = open_memstream(&printed, &size);
    if (out) {
        diag_print(&unit, out, true);
        fclose(out);
    }
    free(printed);
    unit_release(&unit);
    return 0;
}
