#include "tests/oracle/load.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/check.h"
#include "compiler/elaborate.h"
#include "compiler/stdlib.h"
#include "lang/ast.h"

bool oracle_load(OracleSource *source, const char *path, const char *text, size_t length)
{
    Unit *unit = &source->unit;
    source->ir = NULL;
    source->bound = 0;
    unit_init(unit);
    if (!text) text = source_read(&unit->arena, path, &length);
    const Source *main_file = text ? source_add(&unit->sources, path, text, length, (Span){0}) : NULL;
    if (!main_file) {
        fprintf(stderr, "%s: %s\n", path, text ? "too long" : strerror(errno));
        return false;
    }
    const char *mark = memmem(text, length, "// bound: ", 10);
    if (mark) source->bound = strtod(mark + 10, NULL);
    unit->library = stdlib_library;
    Node *tree = parse(unit, main_file);
    check(unit, tree);
    ElaborateOptions options = {0};
    if (!unit->errors) source->ir = elaborate(unit, tree, &options);
    if (!source->ir) diag_print(unit, stderr, false);
    return source->ir != NULL;
}

void oracle_unload(OracleSource *source)
{
    unit_release(&source->unit);
}
