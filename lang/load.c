// A scene and the files that it is made of.
//
// After a file is parsed its top-level items are walked for `include` and `use`. Files are told apart by device and
// inode, so a file that is reached by two ways is still one; libraries that are compiled in are told apart by name. An
// included file's tree hangs at the first include of it. A library's tree is shared by every `use` of it. A file that is being
// read when it is included again is a cycle; a library may use one that uses it, since names are looked up later.
//
//     main.scn ── include "a.scn" ──▶ a: NODE_FILE          a library's files are read with the library's own
//              └─ use brushes ──────▶ file: NODE_FILE       "spliced once": two libraries may both include a file
#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "lang/ast.h"
#include "lang/unit.h"

typedef struct Loaded Loaded;
struct Loaded { // a file that was read, for one root: the scene or one library
    Loaded *next;
    const Loaded *root; // the library whose names its items belong to; NULL for the scene's
    const Source *source;
    Node *file;
    bool compiled_in;
    const char *library; // its name, if it is compiled in
    dev_t device;
    ino_t inode;
    bool reading; // its includes are being followed
};

typedef struct Loader {
    Unit *unit;
    Loaded *all;
    int depth; // of includes and uses that are being followed
} Loader;

enum { LOAD_DEPTH_MAX = 100 }; // files that include each other in a row; each takes a few frames of the stack

static void load_items(Loader *l, Loaded *from);

// --- Paths ---

static const char *folder_of(Unit *unit, const char *path)
{
    const char *slash = strrchr(path, '/');
    if (!slash) return "";
    return arena_text(&unit->arena, path, (size_t)(slash - path) + 1);
}

static const char *join(Unit *unit, const char *folder, const char *path)
{
    size_t length = strlen(folder);
    if (length == 0 || path[0] == '/') return path;
    return arena_printf(&unit->arena, folder[length - 1] == '/' ? "%s%s" : "%s/%s", folder, path);
}

// The folders that are looked in, in order. A folder is "" for the current one.
typedef struct Folders {
    const char **list;
    int count;
} Folders;

static Folders folders_for(Unit *unit, const Loaded *from, bool search_path)
{
    int room = 1 + unit->include_path_count;
    const char *path = search_path && unit->search_path ? unit->search_path : "";
    for (const char *c = path; *c; c++) room += *c == ':';
    Folders folders = {arena_array(&unit->arena, const char *, room + 1), 0};
    if (!from->compiled_in) folders.list[folders.count++] = folder_of(unit, from->source->path);
    for (int i = 0; i < unit->include_path_count; i++) folders.list[folders.count++] = unit->include_paths[i];
    while (*path) {
        size_t length = strcspn(path, ":");
        if (length) folders.list[folders.count++] = arena_text(&unit->arena, path, length);
        path += length + (path[length] == ':');
    }
    return folders;
}

static bool find(Unit *unit, Folders folders, const char *path, const char **found, struct stat *status)
{
    int count = path[0] == '/' && folders.count > 1 ? 1 : folders.count;
    for (int i = 0; i < count; i++) {
        const char *candidate = join(unit, folders.list[i], path);
        if (stat(candidate, status) == 0 && !S_ISDIR(status->st_mode)) {
            *found = candidate;
            return true;
        }
    }
    return false;
}

static const char *folder_list(Unit *unit, Folders folders)
{
    const char *text = "";
    for (int i = 0; i < folders.count; i++) {
        const char *shown = folders.list[i][0] ? folders.list[i] : ".";
        text = arena_printf(&unit->arena, "%s%s%s", text, i ? ", " : "", shown);
    }
    return text;
}

// The name of a file in those folders that is nearest to the wrong one, in the folder that it names.
static const char *nearest_file(Unit *unit, Folders folders, const char *wrong)
{
    const char *inner = folder_of(unit, wrong);
    const char *name = wrong + strlen(inner);
    for (int i = 0; i < folders.count; i++) {
        const char *folder = join(unit, folders.list[i], inner);
        DIR *open = opendir(folder[0] ? folder : ".");
        if (!open) continue;
        const char *nearest = NULL;
        struct dirent *entry;
        while ((entry = readdir(open))) {
            const char *pair[2] = {entry->d_name, nearest};
            const char *best = nearest_name(name, pair, nearest ? 2 : 1);
            if (best == entry->d_name) nearest = arena_text(&unit->arena, best, strlen(best));
        }
        closedir(open);
        if (nearest) return arena_printf(&unit->arena, "%s%s", inner, nearest);
    }
    return NULL;
}

// --- Reading ---

static Loaded *loaded_file(const Loader *l, const struct stat *status, const Loaded *root)
{
    for (Loaded *one = l->all; one; one = one->next) {
        if (!one->compiled_in && one->device == status->st_dev && one->inode == status->st_ino && one->root == root)
            return one;
    }
    return NULL;
}

static Loaded *loaded_library(const Loader *l, const char *name)
{
    for (Loaded *one = l->all; one; one = one->next) {
        if (one->compiled_in && strcmp(one->library, name) == 0) return one;
    }
    return NULL;
}

static Loaded *remember(Loader *l, Loaded one)
{
    Loaded *kept = arena_new(&l->unit->arena, Loaded);
    *kept = one;
    kept->next = l->all;
    l->all = kept;
    return kept;
}

// Adds and parses a text. NULL, with a message, if there is no room for it.
static Loaded *load_text(Loader *l, Loaded one, const char *path, const char *text, size_t length, Span at,
                         bool library)
{
    Source *source = source_add(&l->unit->sources, path, text, length, at);
    if (!source) {
        diag(l->unit, at, DIAG_TOO_LARGE, "all files together are larger than 4 GiB at %s", path);
        return NULL;
    }
    source->library = library;
    source->prelude = one.compiled_in;
    one.source = source;
    Loaded *kept = remember(l, one);
    if (library) kept->root = kept;
    kept->file = parse_source(l->unit, source);
    kept->reading = true;
    load_items(l, kept);
    kept->reading = false;
    return kept;
}

// Reads a file that exists. NULL, with a message, if that fails.
static Loaded *load_file(Loader *l, const char *path, const struct stat *status, Span at, bool library,
                         const Loaded *root)
{
    if (!S_ISREG(status->st_mode) && !S_ISFIFO(status->st_mode)) {
        diag(l->unit, at, DIAG_INCLUDE_MISSING, "%s is not a file that can be read", path);
        return NULL;
    }
    size_t length;
    char *text = source_read(&l->unit->arena, path, &length);
    if (!text) {
        if (errno == EFBIG)
            diag(l->unit, at, DIAG_TOO_LARGE, "%s is larger than 1 GiB", path);
        else
            diag(l->unit, at, DIAG_INCLUDE_MISSING, "%s cannot be read: %s", path, strerror(errno));
        return NULL;
    }
    Loaded one = {.root = root, .device = status->st_dev, .inode = status->st_ino};
    return load_text(l, one, path, text, length, at, library);
}

// --- include ---

static void report_cycle(Loader *l, const Node *node, const Loaded *file)
{
    // The way here, which every message shows, is the way round.
    diag(l->unit, node->name_span, DIAG_INCLUDE_CYCLE, "%s includes itself: put what both need into a file of its own",
         file->source->path);
}

static void report_missing(Unit *unit, Folders folders, const Node *node)
{
    const char *wanted = node->text;
    bool absolute = wanted[0] == '/';
    struct stat status;
    for (int i = 0; i < (absolute ? 1 : folders.count); i++) {
        if (stat(join(unit, folders.list[i], wanted), &status) != 0 || !S_ISDIR(status.st_mode)) continue;
        diag(unit, node->name_span, DIAG_INCLUDE_MISSING, "%s is a folder: name a file in it, as %s/parts.scn", wanted,
             wanted);
        return;
    }
    const char *near = nearest_file(unit, folders, wanted);
    const char *in = absolute ? "" : " in ", *where = absolute ? "" : folder_list(unit, folders);
    const char *help = near ? ": write " : absolute ? ": look for its place" : ": give its folder with -I";
    Diag *d = diag(unit, node->name_span, DIAG_INCLUDE_MISSING, "there is no %s%s%s%s%s", wanted, in, where, help,
                   near ? near : "");
    if (near) diag_fix(unit, d, node->name_span, FIX_LIKELY, "\"%s\"", near);
}

static void include(Loader *l, const Loaded *from, Node *node)
{
    Unit *unit = l->unit;
    if (node->length == 0 || strlen(node->text) != node->length) {
        diag(unit, node->name_span, DIAG_INCLUDE_MISSING,
             "include wants the name of a file: write include \"parts.scn\";");
        return;
    }
    Folders folders = folders_for(unit, from, false);
    const char *path;
    struct stat status;
    if (!find(unit, folders, node->text, &path, &status)) {
        report_missing(unit, folders, node);
        return;
    }
    Loaded *file = loaded_file(l, &status, from->root);
    if (file) {
        if (file->reading) report_cycle(l, node, file);
        return; // spliced before
    }
    file = load_file(l, path, &status, node->span, false, from->root);
    if (file) node->a = file->file;
}

// --- use ---

static const char *nearest_compiled_in(Unit *unit, const char *wrong)
{
    size_t length;
    const char *names = unit->library(NULL, &length);
    if (!names) return NULL;
    const char *nearest = NULL;
    char *rest = NULL;
    for (char *name = strtok_r(arena_text(&unit->arena, names, length), " ", &rest); name;
         name = strtok_r(NULL, " ", &rest)) {
        const char *pair[2] = {name, nearest};
        nearest = nearest_name(wrong, pair, nearest ? 2 : 1);
    }
    return nearest;
}

static void report_unknown_library(Loader *l, const Node *node, Folders folders, const char *path)
{
    Unit *unit = l->unit;
    const char *near = nearest_file(unit, folders, path);
    if (near && node->name) { // without its .scn
        size_t length = strlen(near);
        if (length > 4 && strcmp(near + length - 4, ".scn") == 0)
            near = arena_text(&unit->arena, near, length - 4);
        else
            near = NULL;
    }
    if (!near && node->name && unit->library) near = nearest_compiled_in(unit, node->name);
    Diag *d = diag(unit, node->name_span, DIAG_UNKNOWN_LIBRARY, "there is no library %s in %s%s%s%s",
                   node->name ? node->name : path, folder_list(unit, folders),
                   node->name ? ", nor is it compiled in" : "", near ? ": write " : "", near ? near : "");
    if (near) diag_fix(unit, d, node->name_span, FIX_LIKELY, node->name ? "%s" : "\"%s\"", near);
}

static void use(Loader *l, const Loaded *from, Node *node)
{
    Unit *unit = l->unit;
    const char *path = node->name ? arena_printf(&unit->arena, "%s.scn", node->name) : node->b->text;
    if (!node->name && (node->b->length == 0 || strlen(path) != node->b->length)) {
        diag(unit, node->name_span, DIAG_UNKNOWN_LIBRARY,
             "use wants a library: write use brushes; or use \"parts/eyes.scn\" as eyes;");
        return;
    }
    Folders folders = folders_for(unit, from, node->name != NULL);
    const char *found;
    struct stat status;
    if (find(unit, folders, path, &found, &status)) {
        Loaded *file = NULL;
        for (Loaded *one = l->all; one; one = one->next) { // a library is its own root
            if (!one->compiled_in && one->root == one && one->device == status.st_dev && one->inode == status.st_ino)
                file = one;
        }
        if (!file) file = load_file(l, found, &status, node->span, true, NULL);
        if (file) node->file = file->file;
        return;
    }
    size_t length;
    const char *text = node->name && unit->library ? unit->library(node->name, &length) : NULL;
    if (!text) {
        report_unknown_library(l, node, folders, path);
        return;
    }
    Loaded *library = loaded_library(l, node->name);
    if (!library) {
        Loaded one = {.compiled_in = true, .library = node->name};
        library = load_text(l, one, arena_printf(&unit->arena, "<%s>", node->name), text, length, node->span, true);
    }
    if (library) node->file = library->file;
}

// --- A file's items ---

static void load_items(Loader *l, Loaded *from)
{
    for (Node *item = from->file->a; item; item = item->next) {
        if (item->kind != NODE_INCLUDE && item->kind != NODE_USE) continue;
        if (l->depth >= LOAD_DEPTH_MAX) {
            diag(l->unit, item->span, DIAG_TOO_DEEP, "more than %d files include each other in a row", LOAD_DEPTH_MAX);
            return;
        }
        l->depth++;
        int errors = l->unit->errors;
        if (item->kind == NODE_INCLUDE)
            include(l, from, item);
        else
            use(l, from, item);
        bool missing = l->unit->errors > errors && item->kind == NODE_INCLUDE && !item->a;
        l->unit->lost.files = l->unit->lost.files || missing;
        l->depth--;
    }
}

Node *parse(Unit *unit, const Source *source)
{
    Loader l = {.unit = unit};
    struct stat status;
    Loaded one = {.source = source};
    if (!source->prelude && stat(source->path, &status) == 0) {
        one.device = status.st_dev;
        one.inode = status.st_ino;
    }
    one.compiled_in = source->prelude;
    one.library = "";
    Loaded *main_file = remember(&l, one);
    main_file->file = parse_source(unit, source);
    main_file->reading = true;
    load_items(&l, main_file);
    return main_file->file;
}
