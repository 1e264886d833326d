// scn build: a scene becomes a package.
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "runtime/command.h"
#include "runtime/pocl.h"

// Without -o: the scene's name with another end, in the working folder.
static void default_package(const char *scene, char *path, size_t size)
{
    const char *name = strrchr(scene, '/');
    name = name ? name + 1 : scene;
    if (!strcmp(name, "-")) name = "scene";
    const char *dot = strrchr(name, '.');
    snprintf(path, size, "%.*s.scnk", dot && dot != name ? (int)(dot - name) : (int)strlen(name), name);
}

static int write_stats(const Options *options, const ScnScene *scene, double bytes)
{
    if (!options->stats) return EXIT_DONE;
    ScnStats stats;
    scn_stats(scene, &stats);
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "version", scn_version());
    cJSON_AddNumberToObject(json, "load_ms", stats.load_ms);
    cJSON_AddNumberToObject(json, "device_ms", stats.device_ms);
    cJSON_AddNumberToObject(json, "build_ms", stats.build_ms);
    cJSON_AddNumberToObject(json, "kernel_builds", stats.kernel_builds);
    cJSON_AddNumberToObject(json, "package_bytes", bytes);
    cJSON_AddNumberToObject(json, "peak_memory_bytes", command_peak_memory());
    return command_json_file(options->stats, json);
}

// Everything that `scn build` has the driver compile is compiled in a folder of its own (runtime/pocl.h).
static int write_package(const Options *options, ScnScene *scene, const char *path)
{
    char *folder = command_folder();
    if (!options->source && !pocl_private_cache(folder)) folder[0] = 0;
    int status = options->slice ? command_slice_code(options, scene) : EXIT_DONE;
    if (status != EXIT_DONE) return status;
    return command_result(scene, scn_write_package(scene, path, options->source, command_unfinished()));
}

static void remove_folder(void)
{
    char *folder = command_folder();
    if (folder[0]) pocl_remove_cache(folder);
    folder[0] = 0;
}

int command_build(const Options *options)
{
    char path[4096];
    if (options->output_count > 1) {
        command_error("`scn build` writes one package, and there are %d -o", options->output_count);
        return EXIT_USAGE;
    }
    if (options->output_count)
        snprintf(path, sizeof path, "%s", options->outputs[0]);
    else
        default_package(options->files[0], path, sizeof path);
    size_t length = strlen(path);
    if (length < 5 || strcasecmp(path + length - 5, ".scnk")) {
        command_error("-o %s: a package's name ends in .scnk", path);
        return EXIT_USAGE;
    }
    if (options->slice && options->source) {
        command_error("--slice is code for this machine, which --source leaves out: leave out one of them");
        return EXIT_USAGE;
    }
    int status;
    bool is_model = command_is_model(options->files[0]);
    ScnScene *scene = is_model ? command_load_model(options, &status) : command_load(options, &status);
    if (!scene) return status;
    ScnInfo info;
    scn_info(scene, &info);
    if (info.package) {
        command_error("%s is a package already", options->files[0]);
        scn_free(scene);
        return EXIT_USAGE;
    }
    status = write_package(options, scene, path);
    if (status == EXIT_DONE) {
        struct stat file;
        double bytes = stat(path, &file) ? 0 : (double)file.st_size;
        if (!options->quiet && options->format == FORMAT_TEXT) fprintf(stderr, "%s: %.0f kB\n", path, bytes / 1000);
        status = write_stats(options, scene, bytes);
        if (status == EXIT_DONE) status = command_depfile(options, scene, path);
    }
    scn_free(scene);
    remove_folder();
    return status;
}
