// scn fmt: puts scenes into the one style of lang/format.h.
//
// A file is read, formatted in memory, and written as a whole if that changed it: under its name, through links, with its permissions. One
// with errors of syntax is refused and stays as it is; the others of the command line are formatted all the same. A folder stands for the
// scenes in it and below, in the order of their names; hidden files and folders, and links to folders, are passed over.
#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "lang/ast.h"
#include "lang/format.h"
#include "runtime/command.h"
#include "runtime/diff.h"
#include "runtime/file.h"
#include "runtime/report.h"

typedef struct Job {
    const Options *options;
    const char *path; // "-" is standard input
    const char *name; // as it is shown
    const char *before, *after;
    size_t before_length, after_length;
} Job;

static bool write_file(const Job *job, Failure *failure)
{
    char *real = realpath(job->path, NULL); // a link stays one
    struct stat status;
    WholeFile file;
    bool ok = real && !stat(real, &status);
    if (!ok) fail(failure, "cannot write %s: %s", job->path, strerror(errno));
    ok = ok && whole_open(&file, real, command_unfinished(), failure);
    free(real);
    if (!ok) return false;
    fchmod(file.fd, status.st_mode & 07777); // on a file system that has no permissions it fails, and nothing is lost
    if (whole_write(&file, job->after, job->after_length, failure)) return whole_finish(&file, failure);
    whole_drop(&file);
    return false;
}

// What is done with the result. Returns the exit status.
static int finish(const Job *job)
{
    const Options *o = job->options;
    bool changed = job->before_length != job->after_length || memcmp(job->before, job->after, job->after_length) != 0;
    bool input = strcmp(job->path, "-") == 0;
    if (o->diff)
        diff_print(stdout, job->name, job->before, job->before_length, job->after, job->after_length,
                   command_color(o, stdout));
    else if (o->check && changed)
        printf("%s\n", job->name);
    if (o->check) return changed ? EXIT_SCENE : EXIT_DONE;
    if (o->diff) return EXIT_DONE;
    if (input) {
        fwrite(job->after, 1, job->after_length, stdout); // what fails is found when it is flushed
        return EXIT_DONE;
    }
    Failure failure;
    if (!changed || write_file(job, &failure)) return EXIT_DONE;
    command_error("%s", failure.text);
    return EXIT_WORLD;
}

static int format_text(Unit *unit, Job *job)
{
    const Options *o = job->options;
    Source *source = source_add(&unit->sources, job->name, job->before, job->before_length, (Span){0});
    parse_source(unit, source);
    report_unit(unit);
    if (unit->errors) return EXIT_SCENE;
    FormatOptions options = {.first_line = (uint32_t)o->first_line, .last_line = (uint32_t)o->last_line};
    job->after = format_source(unit, source, &options, &job->after_length);
    if (job->after) return finish(job);
    command_error("%s: formatted it would be another scene, so it stays as it is: this is a mistake of scn", job->name);
    return EXIT_WORLD;
}

static int format_file(const Options *options, const char *path)
{
    Unit unit;
    unit_init(&unit);
    Job job = {.options = options, .path = path, .name = strcmp(path, "-") ? path : "<stdin>"};
    job.before = source_read(&unit.arena, path, &job.before_length);
    int status = EXIT_WORLD;
    if (job.before)
        status = format_text(&unit, &job);
    else if (errno == EFBIG)
        command_error("cannot read %s: it is larger than 1 GiB", job.name);
    else
        command_error("cannot read %s: %s", job.name, strerror(errno));
    unit_release(&unit);
    return status;
}

// --- Folders

typedef enum PathKind { PATH_SCENE, PATH_FOLDER, PATH_OTHER } PathKind;

// What a name in a folder stands for. What only a stat() can tell is asked for: some file systems say nothing in the entry.
static PathKind path_kind(const char *path, const struct dirent *entry)
{
    size_t length = strlen(entry->d_name);
    if (entry->d_name[0] == '.') return PATH_OTHER;
    bool scene = length > 4 && !strcmp(entry->d_name + length - 4, ".scn");
    struct stat status;
    if (lstat(path, &status)) return PATH_OTHER;
    if (S_ISDIR(status.st_mode)) return PATH_FOLDER;
    if (S_ISLNK(status.st_mode) && stat(path, &status)) return PATH_OTHER;
    return scene && S_ISREG(status.st_mode) ? PATH_SCENE : PATH_OTHER;
}

static int worse(int a, int b)
{
    return a > b ? a : b;
}

static int format_folder(const Options *options, const char *folder, int *scenes)
{
    struct dirent **entries;
    int count = scandir(folder, &entries, NULL, alphasort), worst = EXIT_DONE;
    if (count < 0) {
        command_error("cannot read %s: %s", folder, strerror(errno));
        return EXIT_WORLD;
    }
    for (int i = 0; i < count; i++) {
        char path[FILE_PATH_SIZE];
        size_t length = strlen(folder);
        const char *slash = length && folder[length - 1] == '/' ? "" : "/";
        int needed = snprintf(path, sizeof path, "%s%s%s", folder, slash, entries[i]->d_name);
        PathKind kind = needed < (int)sizeof path ? path_kind(path, entries[i]) : PATH_OTHER;
        if (kind == PATH_FOLDER) worst = worse(worst, format_folder(options, path, scenes));
        if (kind == PATH_SCENE) worst = worse(worst, format_file(options, path));
        *scenes += kind == PATH_SCENE;
        free(entries[i]);
    }
    free(entries);
    return worst;
}

// A file, a folder or "-".
static int format_path(const Options *options, const char *path)
{
    struct stat status;
    if (!strcmp(path, "-") || stat(path, &status) || !S_ISDIR(status.st_mode)) return format_file(options, path);
    if (options->first_line) {
        command_error("--lines is for one file, and %s is a folder", path);
        return EXIT_USAGE;
    }
    int scenes = 0, worst = format_folder(options, path, &scenes);
    if (scenes || worst) return worst;
    command_error("there is no scene (.scn) in %s", path);
    return EXIT_WORLD;
}

int command_fmt(const Options *options)
{
    if (options->first_line && options->file_count > 1) {
        command_error("--lines is for one file");
        return EXIT_USAGE;
    }
    int worst = EXIT_DONE;
    for (int i = 0; i < options->file_count; i++) worst = worse(worst, format_path(options, options->files[i]));
    return worst;
}
