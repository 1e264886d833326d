// The commands of scn: each takes the parsed command line and returns the exit status (options.h).
#ifndef SCN_RUNTIME_COMMAND_H
#define SCN_RUNTIME_COMMAND_H

#include <stdio.h>

#include <cjson/cJSON.h>

#include "runtime/options.h"
#include "runtime/scn.h"

int command_render(const Options *options); // render and run
int command_build(const Options *options);
int command_check(const Options *options);
int command_fmt(const Options *options);
int command_flatten(const Options *options);
int command_import(const Options *options);
int command_slice(const Options *options);

// Compiles the slice of --slice and puts the binary into the scene's package. The exit status; what fails is printed.
int command_slice_code(const Options *options, ScnScene *scene);
int command_info(const Options *options);
int command_tree(const Options *options);
int command_doc(const Options *options);
int command_dump(const Options *options);
int command_patch(const Options *options);
int command_bench(const Options *options);
int command_devices(const Options *options);
int command_explain(const Options *options);

// The temporary file that is open, which the signal handlers of main.c remove.
ScnUnfinished *command_unfinished(void);

// The folder of temporary files that is in use, which they remove too; "" if there is none.
char *command_folder(void);

// "scn: …" and the end of the line to standard error, or into the document of the command (report.h). A warning is "scn: warning: …".
void command_error(const char *format, ...) __attribute__((format(printf, 1, 2)));
void command_warning(const char *format, ...) __attribute__((format(printf, 1, 2)));

// The exit status for a status of the library; what is not SCN_OK is printed.
int command_result(const ScnScene *scene, ScnStatus status);

// Whether messages on a stream are coloured.
bool command_color(const Options *options, FILE *out);

// Loads the file of the command line and prints what the compiler says. NULL with the exit status in `status`.
// scn_free() it.
ScnScene *command_load(const Options *options, int *status);

// FILE.vm, which becomes a scene in memory; the same as command_load().
bool command_is_model(const char *path);
ScnScene *command_load_model(const Options *options, int *status);

// Writes what -MD asks for, if it does: what `made` depends on; NULL if nothing is made. The exit status; what fails is printed.
int command_depfile(const Options *options, const ScnScene *scene, const char *made);

// What command_load() gives to scn_load(): its parts point into `options` and into `names`.
typedef struct CommandScene {
    ScnSceneDesc desc;
    ScnSetting settings[OPTION_LIMIT];
    char names[OPTION_LIMIT][256];
} CommandScene;
void command_describe(const Options *options, CommandScene *scene);

// Prints what the compiler says and what the scene prints, and returns the exit status; where that is not 0 the scene
// is freed.
int command_loaded(ScnScene *scene);

// For a scene whose kernels may have been compiled, where the process ends next. PoCL takes 60 ms to give back the
// library of functions that it compiled them with, so nothing is freed, but for who looks for leaks.
void command_free(ScnScene *scene);

// The moment and the number of the frame of --time. False with a message.
bool command_time(const Options *options, const ScnScene *scene, double *time, double *frame);

// Prints JSON to a stream and frees it; false where it cannot be written.
bool command_json(FILE *out, cJSON *json);

// Writes a file that appears whole, or for "-" to standard output. The exit status; what fails is printed.
int command_write_file(const char *path, const void *bytes, size_t size);

// command_json() in that way.
int command_json_file(const char *path, cJSON *json);

// Largest memory of the process so far, in bytes.
double command_peak_memory(void);

#endif
