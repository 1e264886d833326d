// scn fmt: puts scenes into the one style of lang/format.h.
//
// A file is read, formatted in memory, and written as a whole if that changed it: under its name, through links, with its permissions. One
// with errors of syntax is refused and stays as it is; the others of the command line are formatted all the same.
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "lang/ast.h"
#include "lang/format.h"
#include "runtime/command.h"
#include "runtime/diff.h"
#include "runtime/file.h"

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
    diag_print(unit, stderr, command_color(o, stderr));
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

int command_fmt(const Options *options)
{
    if (options->first_line && options->file_count > 1) {
        command_error("--lines is for one file");
        return EXIT_USAGE;
    }
    int worst = EXIT_DONE;
    for (int i = 0; i < options->file_count; i++) {
        int status = format_file(options, options->files[i]);
        if (status > worst) worst = status;
    }
    return worst;
}
