// scn import: a model of another format becomes a scene (import_vm.h).
#include <errno.h>
#include <string.h>

#include "lang/source.h"
#include "runtime/command.h"
#include "runtime/file.h"
#include "runtime/import_vm.h"

static int write_scene(const Options *options, const char *text, size_t length)
{
    Failure failure;
    WholeFile file;
    const char *path = options->output_count ? options->outputs[0] : "-";
    if (!strcmp(path, "-")) {
        fwrite(text, 1, length, stdout); // what fails is found when it is flushed
        return EXIT_DONE;
    }
    bool ok = whole_open(&file, path, command_unfinished(), &failure);
    if (ok && whole_write(&file, text, length, &failure)) {
        ok = whole_finish(&file, &failure);
    } else if (ok) {
        whole_drop(&file);
        ok = false;
    }
    if (!ok) command_error("%s", failure.text);
    return ok ? EXIT_DONE : EXIT_WORLD;
}

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
            status = write_scene(options, scene, scene_length);
        else
            command_error("%s: %s", options->files[0], failure.text);
    }
    arena_release(&arena);
    return status;
}
