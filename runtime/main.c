// The command scn: finds the command that is meant and runs it.
//
// Ctrl-C ends the process at once, wherever it is: in the compiler, in a driver's, in a kernel. The only thing that
// would be left is the temporary file that is just being written, and the handler removes it; that is why its name is
// known outside of the library. Signal handlers have no context, so these few bytes are the only mutable state of the
// program that is not passed on.
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "runtime/command.h"
#include "runtime/file.h"
#include "runtime/pocl.h"
#include "runtime/report.h"

static ScnUnfinished unfinished;
static char folder[POCL_FOLDER_SIZE];

ScnUnfinished *command_unfinished(void)
{
    return &unfinished;
}

char *command_folder(void)
{
    return folder;
}

static void on_signal(int number)
{
    if (unfinished.open) unlink(unfinished.path);
    if (folder[0] && !fork()) {
        execl("/bin/rm", "rm", "-rf", folder, (char *)NULL);
        _exit(1);
    }
    if (number == SIGINT && isatty(STDERR_FILENO)) {
        static const char clear[] = "\r\033[K";
        ssize_t ignored = write(STDERR_FILENO, clear, sizeof clear - 1);
        (void)ignored;
    }
    // To die of the signal, status 130 in a shell, is what lets a shell end the loop that the command is in.
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, number);
    signal(number, SIG_DFL);
    sigprocmask(SIG_UNBLOCK, &set, NULL);
    raise(number);
    _exit(128 + number);
}

static void catch_signals(void)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
    for (int i = 0; i < 3; i++) {
        // What the parent ignores stays ignored: nohup.
        struct sigaction action;
        if (!sigaction(numbers[i], NULL, &action) && action.sa_handler == SIG_IGN) continue;
        action = (struct sigaction){.sa_handler = on_signal};
        sigaction(numbers[i], &action, NULL);
    }
    // A limit on the size of files is an error of writing, as a full disk is.
    signal(SIGXFSZ, SIG_IGN);
}

int command_result(const ScnScene *scene, ScnStatus status)
{
    static const int exits[] = {[SCN_OK] = EXIT_DONE,
                                [SCN_SCENE_WRONG] = EXIT_SCENE,
                                [SCN_CALL_WRONG] = EXIT_USAGE,
                                [SCN_WORLD_FAILED] = EXIT_WORLD,
                                [SCN_CANCELLED] = EXIT_CANCELLED};
    if (status == SCN_SCENE_WRONG && scn_status(scene) == SCN_OK)
        report_frame(scene);
    else if (status != SCN_OK && scn_error(scene)[0])
        command_error("%s", scn_error(scene));
    return exits[status];
}

bool command_color(const Options *options, FILE *out)
{
    const char *none = getenv("NO_COLOR"), *terminal = getenv("TERM");
    if (options->color != COLOR_AUTO) return options->color == COLOR_ALWAYS;
    return isatty(fileno(out)) && !(none && *none) && terminal && strcmp(terminal, "dumb");
}

double command_peak_memory(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return (double)usage.ru_maxrss * 1024;
}

bool command_json(FILE *out, cJSON *json)
{
    char *text = cJSON_Print(json);
    cJSON_Delete(json);
    bool ok = text && fprintf(out, "%s\n", text) > 0;
    cJSON_free(text);
    return ok;
}

int command_write_file(const char *path, const void *bytes, size_t size)
{
    if (!strcmp(path, "-")) {
        fwrite(bytes, 1, size, stdout); // what fails is found when it is flushed
        return EXIT_DONE;
    }
    Failure failure;
    WholeFile file;
    bool ok = whole_open(&file, path, &unfinished, &failure);
    if (ok && whole_write(&file, bytes, size, &failure)) {
        ok = whole_finish(&file, &failure);
    } else if (ok) {
        whole_drop(&file);
        ok = false;
    }
    if (!ok) command_error("%s", failure.text);
    return ok ? EXIT_DONE : EXIT_WORLD;
}

int command_json_file(const char *path, cJSON *json)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) abort(); // as in arena_alloc()
    command_json(out, json);
    fclose(out);
    int status = command_write_file(path, text, size);
    free(text);
    return status;
}

void command_describe(const Options *options, CommandScene *scene)
{
    for (int i = 0; i < options->define_count; i++) {
        const char *define = options->defines[i], *equals = strchr(define, '=');
        snprintf(scene->names[i], sizeof scene->names[i], "%.*s", (int)(equals - define), define);
        scene->settings[i] = (ScnSetting){scene->names[i], equals + 1};
    }
    scene->desc = (ScnSceneDesc){
        .path = options->files[0],
        .include_paths = options->includes,
        .include_path_count = options->include_count,
        .settings = scene->settings,
        .setting_count = options->define_count,
        .camera = options->camera,
        .only = options->only,
        .strict = options->strict,
        .warnings = options->warnings,
        .warning_count = options->warning_count,
        .device = options->device,
        .threads = options->threads,
        .lanes = options->lanes,
        .check_only = options->command == COMMAND_CHECK,
        .no_cache = options->no_cache,
        .solver = options->solver,
        .checkpoints = options->checkpoints,
    };
}

int command_loaded(ScnScene *scene)
{
    if (!scene) {
        command_error("out of memory");
        return EXIT_WORLD;
    }
    report_scene(scene);
    int status = command_result(scene, scn_status(scene));
    if (status != EXIT_DONE) scn_free(scene);
    return status;
}

ScnScene *command_load(const Options *options, int *status)
{
    CommandScene parts;
    command_describe(options, &parts);
    ScnScene *scene = scn_load(&parts.desc);
    *status = command_loaded(scene);
    return *status == EXIT_DONE ? scene : NULL;
}

#ifdef __has_feature
#define HAS_FEATURE(name) __has_feature(name)
#else
#define HAS_FEATURE(name) 0
#endif

void command_free(ScnScene *scene)
{
#if defined(__SANITIZE_ADDRESS__) || HAS_FEATURE(address_sanitizer)
    scn_free(scene);
#else
    (void)scene;
#endif
}

bool command_time(const Options *options, const ScnScene *scene, double *time, double *frame)
{
    ScnInfo info;
    *time = *frame = 0;
    if (!options->time || !scn_info(scene, &info)) return true;
    double fps = info.fps > 0 ? info.fps : 24;
    if (!options_time(options->time, fps, time)) {
        command_error("--time wants a time as 1.5s, 300ms or 12f, not \"%s\"", options->time);
        return false;
    }
    // The frame that is shown at that moment; a time that was written as frames is that frame in spite of rounding.
    *frame = (double)(long long)(*time * fps + 1e-6);
    return true;
}

// A model of one operation a line is no scene, but for those that say so in --help.
static bool takes_files(const Options *options)
{
    CommandId command = options->command;
    bool models = command == COMMAND_BUILD || command == COMMAND_SLICE || command == COMMAND_IMPORT;
    bool files = command != COMMAND_EXPLAIN && command != COMMAND_DOC;
    for (int k = 0; k < options->file_count && files && !models; k++) {
        if (!command_is_model(options->files[k])) continue;
        command_error(
            "%s is no scene, but an expression of one operation a line: `scn import %s -o FILE.scn` makes one of it",
            options->files[k], options->files[k]);
        return false;
    }
    return true;
}

static int run_command(const Options *options)
{
    if (!takes_files(options)) return EXIT_USAGE;
    switch (options->command) {
    case COMMAND_RENDER:
    case COMMAND_RUN: return command_render(options);
    case COMMAND_BUILD: return command_build(options);
    case COMMAND_CHECK: return command_check(options);
    case COMMAND_FMT: return command_fmt(options);
    case COMMAND_FLATTEN: return command_flatten(options);
    case COMMAND_IMPORT: return command_import(options);
    case COMMAND_SLICE: return command_slice(options);
    case COMMAND_INFO: return command_info(options);
    case COMMAND_TREE: return command_tree(options);
    case COMMAND_DOC: return command_doc(options);
    case COMMAND_DUMP: return command_dump(options);
    case COMMAND_PATCH: return command_patch(options);
    case COMMAND_BENCH: return command_bench(options);
    case COMMAND_DEVICES: return command_devices(options);
    case COMMAND_EXPLAIN: return command_explain(options);
    case COMMAND_VERSION: printf("scn %s\n", scn_version()); return EXIT_DONE;
    case COMMAND_HELP:
    case COMMAND_COUNT: break;
    }
    return EXIT_USAGE;
}

static int show_help(const Options *options)
{
    CommandId command = COMMAND_COUNT;
    if (options->command != COMMAND_HELP)
        command = options->command;
    else if (options->file_count && !options_find_command(options->files[0], &command)) {
        const char *nearest = options_nearest_command(options->files[0]);
        if (nearest)
            command_error("there is no command \"%s\": do you mean %s?", options->files[0], nearest);
        else
            command_error("there is no command \"%s\": `scn help` lists them", options->files[0]);
        return EXIT_USAGE;
    }
    options_help(stdout, command);
    return EXIT_DONE;
}

int main(int argc, char **argv)
{
    Options options;
    bool understood = options_parse(&options, argc, argv);
    report_begin(&options);
    if (!understood) {
        command_error("%s", options.error);
        report_end(EXIT_USAGE);
        return EXIT_USAGE;
    }
    catch_signals();
    int status = options.help || options.command == COMMAND_HELP ? show_help(&options) : run_command(&options);
    if (options.command == COMMAND_CHECK) report_end(status);
    // What was written may meet a full disk only now.
    if (fflush(stdout) || ferror(stdout)) {
        command_error("cannot write standard output: %s", strerror(errno));
        if (status == EXIT_DONE) status = EXIT_WORLD;
    }
    if (options.command != COMMAND_CHECK) report_end(status);
    return status;
}
