// -MD: what a scene was read from, as make and ninja want it.
#include <stdlib.h>
#include <string.h>

#include "runtime/command.h"
#include "runtime/file.h"

// In a makefile a space, a # and a backslash before one of them are escaped, and $ is written twice.
static void put_name(FILE *out, const char *name)
{
    for (const char *p = name; *p; p++) {
        if (*p == '$') fputc('$', out);
        if (*p == ' ' || *p == '\t' || *p == '#') {
            for (const char *back = p; back > name && back[-1] == '\\'; back--) fputc('\\', out);
            fputc('\\', out);
        }
        fputc(*p, out);
    }
}

static bool listed_before(const ScnScene *scene, int index)
{
    for (int i = 0; i < index; i++) {
        if (!strcmp(scn_source(scene, i), scn_source(scene, index))) return true;
    }
    return false;
}

static void put_rule(FILE *out, const ScnScene *scene, const char *target)
{
    put_name(out, target);
    fputc(':', out);
    for (int i = 0; scn_source(scene, i); i++) {
        if (listed_before(scene, i) || !strcmp(scn_source(scene, i), "<stdin>")) continue;
        fputs(" \\\n  ", out);
        put_name(out, scn_source(scene, i));
    }
    fputc('\n', out);
}

// "a.d" of "a.scnk" and of "a.scn".
static void default_path(const char *target, char *path, size_t size)
{
    const char *slash = strrchr(target, '/'), *dot = strrchr(target, '.');
    size_t length = dot && dot > (slash ? slash + 1 : target) ? (size_t)(dot - target) : strlen(target);
    snprintf(path, size, "%.*s.d", (int)length, target);
}

int command_depfile(const Options *options, const ScnScene *scene, const char *made)
{
    if (!options->depfile && !options->depfile_path) return EXIT_DONE;
    char path[FILE_PATH_SIZE];
    if (!options->depfile_path && !made && !strcmp(options->files[0], "-")) {
        command_error("-MD of standard input wants the name of the rule's file: -MF FILE");
        return EXIT_USAGE;
    }
    if (options->depfile_path)
        snprintf(path, sizeof path, "%s", options->depfile_path);
    else
        default_path(made ? made : options->files[0], path, sizeof path);
    const char *target = options->depfile_target ? options->depfile_target : made ? made : path;
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    Failure failure = {"out of memory"};
    WholeFile file;
    bool ok = out != NULL;
    if (ok) {
        put_rule(out, scene, target);
        ok = !fclose(out) && whole_open(&file, path, command_unfinished(), &failure);
    }
    if (ok && whole_write(&file, text, length, &failure))
        ok = whole_finish(&file, &failure);
    else if (ok) {
        whole_drop(&file);
        ok = false;
    }
    free(text);
    if (!ok) command_error("%s", failure.text);
    return ok ? EXIT_DONE : EXIT_WORLD;
}
