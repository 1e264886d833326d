// scn check: what is wrong with scenes, as text or as one document for all of them (report.h).
#include "runtime/command.h"

static int check_one(const Options *one)
{
    int status;
    ScnScene *scene = command_load(one, &status);
    if (scene) status = command_depfile(one, scene, NULL);
    scn_free(scene);
    return status;
}

int command_check(const Options *options)
{
    if (options->depfile_path && options->file_count > 1) {
        command_error("-MF is for one scene");
        return EXIT_USAGE;
    }
    int worst = EXIT_DONE;
    for (int i = 0; i < options->file_count; i++) {
        Options one = *options;
        one.files[0] = options->files[i];
        one.file_count = 1;
        int status = check_one(&one);
        if (status > worst) worst = status;
    }
    return worst;
}
