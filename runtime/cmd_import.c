// scn import: a model of another format becomes a scene (import_vm.h).
#include <errno.h>
#include <string.h>

#include "lang/source.h"
#include "runtime/command.h"
#include "runtime/file.h"
#include "runtime/import_vm.h"

int command_import(const Options *options)
{
    if (options->output_count > 1) {
        command_error("`scn import` writes one scene, and there are %d -o", options->output_count);
        return EXIT_USAGE;
    }
    Arena arena = {0};
    Failure failure;
    size_t length, scene_length;
    int status = EXIT_SCENE;
    const char *text = source_read(&arena, options->files[0], &length);
    if (!text) {
        command_error("cannot read %s: %s", options->files[0], strerror(errno));
        status = EXIT_WORLD;
    } else {
        const char *scene = import_vm(&arena, text, length, &scene_length, &failure);
        if (scene)
            status = command_write_file(options->output_count ? options->outputs[0] : "-", scene, scene_length);
        else
            command_error("%s: %s", options->files[0], failure.text);
    }
    arena_release(&arena);
    return status;
}
