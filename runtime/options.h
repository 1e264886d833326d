// The command line: the table of commands and options, its parser and its help.
//
//     Options options;
//     if (!options_parse(&options, argc, argv)) { fprintf(stderr, "scn: %s\n", options.error); return EXIT_USAGE; }
//
// Options may stand before and after what they belong to; `--` ends them. A value follows as `--name value`,
// `--name=value`, `-n value` or `-nvalue`. What does not exist is an error that names the nearest that does.
#ifndef SCN_RUNTIME_OPTIONS_H
#define SCN_RUNTIME_OPTIONS_H

#include <stdbool.h>
#include <stdio.h>

// Exit statuses of the command.
enum { EXIT_DONE = 0, EXIT_SCENE = 1, EXIT_USAGE = 2, EXIT_WORLD = 3, EXIT_CANCELLED = 130 };

typedef enum CommandId {
#define COMMAND(id, name, arguments, help) COMMAND_##id,
#include "runtime/options.def"
    COMMAND_COUNT
} CommandId;

typedef enum OptionId {
#define OPTION(id, name, letter, value, commands, help) OPTION_##id,
#include "runtime/options.def"
    OPTION_COUNT
} OptionId;

typedef enum KernelsWhich { KERNELS_AUTO, KERNELS_QUICK, KERNELS_FULL } KernelsWhich;
typedef enum ErrorFormat { FORMAT_TEXT, FORMAT_JSON, FORMAT_SARIF } ErrorFormat;
typedef enum ColorWhen { COLOR_AUTO, COLOR_ALWAYS, COLOR_NEVER } ColorWhen;

#define OPTION_LIMIT 64 // of -o, -D and -I, each
#define OPTION_FILES 4096

typedef struct Options {
    CommandId command;
    bool help;                       // --help, or no command at all
    const char *files[OPTION_FILES]; // what is no option
    int file_count;
    const char *outputs[OPTION_LIMIT];
    int output_count;
    const char *defines[OPTION_LIMIT]; // NAME=VALUE, with a name and a '='
    int define_count;
    const char *includes[OPTION_LIMIT];
    int include_count;
    int width, height; // 0 0: not given; height 0: the longer side (slice)
    const char *time;  // not yet understood: frames need the scene
    bool frames_given, frames_all;
    int first_frame, last_frame;
    const char *camera, *only, *device, *stats, *after;
    unsigned layers;                           // FilmLayer; 0: not given
    int samples, threads, lanes, repeat, bits; // 0: not given
    bool half, full;                           // --half, --float
    int first_line, last_line;                 // 0 0: not given
    const char *probes[OPTION_LIMIT];
    int probe_count;
    const char *depfile_path, *depfile_target; // of -MD
    bool depfile;
    const char *times, *patch;
    const char *plane, *window, *slice; // not yet understood
    const char *checkpoints;            // a folder; NULL: not given
    const char *solver;                 // of patches, as ScnSceneDesc has it; NULL: not given
    int sweeps;                         // 0: not given
    bool csv;
    int depth;    // 0: not given
    int markdown; // --format: 1 html, 2 markdown; 0: not given
    bool builtins, no_pictures;
    bool no_cache, source, ast, ir, kernel, json, strict, quiet, check, diff;
    const char *warnings[OPTION_LIMIT];
    int warning_count;
    ErrorFormat format;
    ColorWhen color;
    KernelsWhich kernels;
    char error[512];
} Options;

// False with `error` set. The texts point into argv.
bool options_parse(Options *options, int argc, char **argv);

// Prints the use of a command, or with COMMAND_COUNT that of scn.
void options_help(FILE *out, CommandId command);

// Prints a text whose first line is at column `indent`, broken between words to the width of the terminal, and a
// line's end.
void options_wrap(FILE *out, const char *text, int indent);

// The nearest of the commands to a misspelt one, or NULL.
const char *options_nearest_command(const char *name);
bool options_find_command(const char *name, CommandId *command);

// "1.5s", "300ms", "12f", "2" (seconds) to seconds. False where it is none of these.
bool options_time(const char *text, double fps, double *seconds);

#endif
