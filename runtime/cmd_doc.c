// scn doc: the reference of a library, or of what is built in (runtime/doc.h).
//
//     scn doc leaves.scn                      a page of HTML to standard output; `leaves` alone finds the file, as `use` does
//     scn doc brushes -o out/                 out/brushes.html; a library of scn goes by its name
//     scn doc --builtins -o builtins.md       Markdown, with its pictures beside it
//
// The format is that of --format, else of the end of -o, else HTML. Markdown to standard output has no pictures, since it has no place for them.
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "compiler/stdlib.h"
#include "lang/ast.h"
#include "runtime/command.h"
#include "runtime/doc.h"
#include "runtime/file.h"
#include "runtime/report.h"

typedef struct Target {
    char path[FILE_PATH_SIZE]; // "" is standard output
    char stem[256];            // of the names of pictures
    bool markdown;
} Target;

static bool ends_with(const char *text, const char *end)
{
    size_t length = strlen(text), part = strlen(end);
    return length >= part && !strcmp(text + length - part, end);
}

static const char *base_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static bool is_folder(const char *path)
{
    struct stat status;
    return ends_with(path, "/") || (!stat(path, &status) && S_ISDIR(status.st_mode));
}

// Where to, and as what. False with a message.
static bool choose_target(const Options *options, Target *target)
{
    const char *out = options->output_count ? options->outputs[0] : "-";
    const char *name = options->builtins ? "builtins" : base_of(options->files[0]);
    bool folder = is_folder(out);
    *target = (Target){.markdown = options->markdown == 2};
    if (!options->markdown) target->markdown = ends_with(out, ".md");
    if (options->output_count > 1) {
        command_error("`scn doc` writes one reference, and there are %d -o", options->output_count);
        return false;
    }
    if (folder) {
        int stem = (int)(ends_with(name, ".scn") ? strlen(name) - 4 : strlen(name));
        const char *slash = ends_with(out, "/") ? "" : "/";
        snprintf(target->path, sizeof target->path, "%s%s%.*s%s", out, slash, stem, name,
                 target->markdown ? ".md" : ".html");
        if (make_folders(out)) return snprintf(target->stem, sizeof target->stem, "%.*s", stem, name) > 0;
        command_error("cannot make the folder %s: %s", out, strerror(errno));
        return false;
    }
    bool known = ends_with(out, ".md") || ends_with(out, ".html") || ends_with(out, ".htm") || !strcmp(out, "-");
    if (!known && !options->markdown) {
        command_error("-o %s: a reference's name ends in .html or .md, or --format says what it is", out);
        return false;
    }
    if (strcmp(out, "-") != 0) snprintf(target->path, sizeof target->path, "%s", out);
    snprintf(target->stem, sizeof target->stem, "%s", base_of(out));
    char *dot = strrchr(target->stem, '.');
    if (dot) *dot = 0;
    return true;
}

static int write_pictures(const Doc *doc, const Target *target)
{
    int worst = EXIT_DONE;
    for (const DocGroup *group = doc->groups; group; group = group->next) {
        for (const DocEntry *entry = group->entries; entry; entry = entry->next) {
            int k = 0;
            for (const DocForm *form = entry->forms; form; form = form->next) {
                for (const DocExample *example = form->examples; example; example = example->next) {
                    char name[512], path[FILE_PATH_SIZE + 512];
                    doc_picture_name(name, sizeof name, target->stem, entry->name, ++k);
                    snprintf(path, sizeof path, "%.*s%s", (int)(base_of(target->path) - target->path), target->path,
                             name);
                    int status = example->png ? command_write_file(path, example->png, example->png_size) : EXIT_DONE;
                    if (status > worst) worst = status;
                }
            }
        }
    }
    return worst;
}

static int write_doc(const Doc *doc, const Target *target)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = *target->path ? open_memstream(&text, &size) : stdout;
    if (!out) abort(); // as in arena_alloc()
    if (target->markdown)
        doc_write_markdown(doc, target->stem, out);
    else
        doc_write_html(doc, out);
    if (!*target->path) return EXIT_DONE; // what fails is found when it is flushed
    fclose(out);
    int status = command_write_file(target->path, text, size);
    free(text);
    if (status == EXIT_DONE && target->markdown) status = write_pictures(doc, target);
    return status;
}

// The file of a library that is given as `use` names it: in this folder or one of -I. As it is given, where there is none.
static const char *library_file(const Options *options, Arena *arena, const char *name)
{
    if (ends_with(name, ".scn") || !strcmp(name, "-") || !access(name, F_OK)) return name;
    const char *here = arena_printf(arena, "%s.scn", name);
    if (!access(here, F_OK)) return here;
    for (int k = 0; k < options->include_count; k++) {
        const char *there = arena_printf(arena, "%s/%s", options->includes[k], here);
        if (!access(there, F_OK)) return there;
    }
    return name;
}

// Reads a file, or a library by its name. NULL with a message and the status.
static Doc *read_library(const Options *options, Unit *unit, int *status)
{
    const char *name = library_file(options, &unit->arena, options->files[0]);
    size_t length;
    const char *text = ends_with(name, ".scn") ? NULL : stdlib_library(name, &length);
    bool standard = text != NULL;
    if (!text) text = source_read(&unit->arena, name, &length);
    *status = EXIT_WORLD;
    if (!text) {
        size_t all;
        command_error("cannot read %s: %s; libraries of scn are: %s", name, strerror(errno),
                      stdlib_library(NULL, &all));
        return NULL;
    }
    const Source *source = source_add(&unit->sources, name, text, length, (Span){0});
    Doc *doc = doc_of_library(unit, source, name, standard);
    report_unit(unit);
    *status = unit->errors ? EXIT_SCENE : EXIT_DONE;
    return unit->errors ? NULL : doc;
}

static int document(const Options *options, Unit *unit, const Target *target)
{
    int status = EXIT_DONE;
    Doc *doc = options->builtins ? doc_of_builtins(unit) : read_library(options, unit, &status);
    if (!doc) return status;
    if (!doc->entry_count) {
        command_error("%s has no tag, tool, function or param to document", options->files[0]);
        return EXIT_SCENE;
    }
    bool pictures = !options->no_pictures && (*target->path || !target->markdown);
    if (pictures) {
        status = doc_pictures(doc, &(DocPictures){
                                       .width = options->width ? options->width : 320,
                                       .height = options->height ? options->height : 240,
                                       .device = options->device,
                                       .includes = options->includes,
                                       .include_count = options->include_count,
                                   });
    }
    int written = status == EXIT_DONE ? write_doc(doc, target) : status; // half a reference would pass for a whole one
    doc_release(doc);
    return written;
}

int command_doc(const Options *options)
{
    Target target;
    if (options->builtins ? options->file_count > 0 : options->file_count != 1) {
        command_error("`scn doc` wants one library, or --builtins: scn doc brushes -o brushes.html");
        return EXIT_USAGE;
    }
    if (!choose_target(options, &target)) return EXIT_USAGE;
    Unit unit;
    unit_init(&unit);
    int status = document(options, &unit, &target);
    unit_release(&unit);
    return status;
}
