// Any bytes as a model of one operation a line: it is refused with a reason, or becomes the text of a scene that the parser has nothing to say about.
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lang/ast.h"
#include "lang/unit.h"
#include "runtime/import_vm.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length);

// An assert() would be left out of an optimised build.
static void require(bool holds, const char *what)
{
    if (holds) return;
    fprintf(stderr, "not true: %s\n", what);
    abort();
}

static void check_scene(Unit *unit, const char *text, size_t length)
{
    require(strlen(text) == length, "a scene is text");
    const Source *source = source_add(&unit->sources, "fuzz.scn", text, length, (Span){0});
    parse_source(unit, source);
    require(!unit->errors, "a scene that was written can be read");
    const char *field = strstr(text, "\nfield(-v");
    require(field && !strchr(field + 1, '\n')[1], "it ends with the field");
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length)
{
    if (length > 20000) return 0;
    Unit unit;
    unit_init(&unit);
    Failure failure = {0};
    size_t scene_length;
    const char *scene = import_vm(&unit.arena, (const char *)bytes, length, &scene_length, &failure);
    require(!scene == !!failure.text[0], "there is a scene or a reason");
    if (scene) check_scene(&unit, scene, scene_length);
    unit_release(&unit);
    return 0;
}
