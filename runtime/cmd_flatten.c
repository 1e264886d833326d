// scn flatten: a scene of many files becomes one, in the one style of lang/format.h.
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/check.h"
#include "compiler/flatten.h"
#include "compiler/stdlib.h"
#include "lang/format.h"
#include "runtime/command.h"
#include "runtime/file.h"
#include "runtime/report.h"

// The flattened text is read again, so that a mistake of scn is told here and not where it is used.
static int format_and_write(const Options *options, Unit *unit, const char *text, size_t length)
{
    Source *source = source_add(&unit->sources, "<flattened>", text, length, (Span){0});
    if (source) parse_source(unit, source);
    FormatOptions format = {0};
    const char *result = source && !unit->errors ? format_source(unit, source, &format, &length) : NULL;
    if (result) return command_write_file(options->output_count ? options->outputs[0] : "-", result, length);
    report_unit(unit);
    command_error("%s: in one file it would be another scene: this is a mistake of scn", options->files[0]);
    return EXIT_WORLD;
}

static int flatten_text(const Options *options, Unit *unit, const char *text, size_t length)
{
    const char *name = strcmp(options->files[0], "-") ? options->files[0] : "<stdin>";
    unit->include_paths = options->includes;
    unit->include_path_count = options->include_count;
    unit->search_path = getenv("SCN_PATH");
    unit->library = stdlib_library;
    Node *tree = parse(unit, source_add(&unit->sources, name, text, length, (Span){0}));
    check(unit, tree);
    size_t flat_length;
    char *flat = unit->errors ? NULL : flatten(unit, tree, &flat_length);
    if (flat) return format_and_write(options, unit, flat, flat_length);
    report_unit(unit);
    if (unit->errors) return EXIT_SCENE;
    command_error("out of memory");
    return EXIT_WORLD;
}

int command_flatten(const Options *options)
{
    if (options->output_count > 1) {
        command_error("`scn flatten` writes one scene, and there are %d -o", options->output_count);
        return EXIT_USAGE;
    }
    Unit unit;
    unit_init(&unit);
    size_t length;
    const char *text = source_read(&unit.arena, options->files[0], &length);
    int status = EXIT_WORLD;
    if (text)
        status = flatten_text(options, &unit, text, length);
    else
        command_error("cannot read %s: %s", options->files[0], strerror(errno));
    unit_release(&unit);
    return status;
}
