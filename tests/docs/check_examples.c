// Checks the examples of a Markdown text with the scn command.
//
//     scn-check-examples SCN TEXT.md FOLDER [--names]
//
// SCN is the command to run, TEXT.md the text, FOLDER where the examples are written (it exists). An example is a
// block that is fenced by ``` and whose language is one of
//
//     ```scn                     a complete file
//     ```scn cup.scn             a complete file of that name, which later examples of the text can include and use
//     ```scn fragment            items of a file that also declares `a`, `b` (objects) and `clay` (a material)
//
// and in it
//
//     object a = box(1).rotate(y: 90);   // error: angle-unit
//
// says that this line, and no other, has this diagnostic; `// warning: code` likewise. Every example goes through
// `scn check`; the diagnostics that come must be those that are announced, each on its line, and the exit status must
// be 0 without an error and 1 with one. `--names` also demands that the text names every diagnostic of lang/diag.def
// and every built-in name of compiler/builtins.def, so that a new one cannot stay undocumented.
//
// The command is run as a user would run it, and its printed form is read (file:line:column: severity: text [code]):
// the test is of that form too. Exit status: 0 if all is as the text says, 1 if not, 2 for a wrong call, 3 where a
// file or process fails.
#include <ctype.h>
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

enum { MAX_NOTES = 64, MAX_CODE = 48, EXIT_WORLD = 3 };

// What stands around a fragment. The first part is one line, so that line k of the example is line k + 1 of the file.
static const char fragment_head[] =
    "object a = sphere(1); object b = box(1, 2, 1).move(0.5, 0, 0); material clay { color: #c8814b; }\n";
static const char fragment_tail[] = "scene { a; }\n";

typedef struct Note { // a diagnostic, announced or come
    int line;         // in the example, from 1
    bool error;       // else a warning
    char code[MAX_CODE];
    bool matched;
} Note;

typedef struct Notes {
    Note list[MAX_NOTES];
    int count;
} Notes;

typedef struct Example {
    const char *text; // in the Markdown text, not terminated
    size_t length;
    int line;         // of the Markdown text, where the example's first line stands
    const char *name; // of its file, if it has one, up to the end of the line; else NULL
    bool fragment;
} Example;

typedef struct Reader { // walks through a Markdown text
    const char *next;
    int line; // of `next`
} Reader;

static void die(const char *what, const char *path)
{
    fprintf(stderr, "scn-check-examples: %s %s: %s\n", what, path, strerror(errno));
    exit(EXIT_WORLD);
}

static char *read_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file) die("cannot open", path);
    size_t length = 0, capacity = 1 << 16;
    char *text = malloc(capacity + 1);
    while (text) {
        length += fread(text + length, 1, capacity - length, file);
        if (length < capacity) break;
        capacity *= 2;
        char *more = realloc(text, capacity + 1);
        if (!more) free(text);
        text = more;
    }
    if (!text || ferror(file)) die("cannot read", path);
    fclose(file);
    text[length] = 0;
    return text;
}

static const char *line_end(const char *line)
{
    const char *end = strchr(line, '\n');
    return end ? end : line + strlen(line);
}

static void skip_line(Reader *reader)
{
    const char *end = line_end(reader->next);
    reader->next = *end ? end + 1 : end;
    reader->line++;
}

static bool starts_fence(const char *line)
{
    return strncmp(line, "```", 3) == 0;
}

// The file that a fence names, "" if none; NULL if its words are not those of an example.
static const char *example_name(const char *fence, bool *fragment)
{
    const char *end = line_end(fence);
    if (end > fence && end[-1] == '\r') end--;
    size_t length = (size_t)(end - fence);
    *fragment = length == strlen("```scn fragment") && memcmp(fence, "```scn fragment", length) == 0;
    if (*fragment || (length == strlen("```scn") && memcmp(fence, "```scn", length) == 0)) return "";
    bool named = length > strlen("```scn .scn") && memcmp(fence, "```scn ", 7) == 0 && memcmp(end - 4, ".scn", 4) == 0;
    return named ? fence + 7 : NULL;
}

// Finds the next example. Returns false at the end of the text.
static bool next_example(Reader *reader, Example *example)
{
    while (*reader->next) {
        bool fence = starts_fence(reader->next), fragment = false;
        const char *name = fence ? example_name(reader->next, &fragment) : NULL;
        skip_line(reader);
        if (!fence) continue;
        *example = (Example){.text = reader->next, .line = reader->line, .fragment = fragment};
        if (name && *name) example->name = name;
        while (*reader->next && !starts_fence(reader->next)) skip_line(reader);
        example->length = (size_t)(reader->next - example->text);
        if (*reader->next) skip_line(reader);
        if (name) return true;
    }
    return false;
}

static void add_note(Notes *notes, int line, bool error, const char *code, size_t length)
{
    if (notes->count == MAX_NOTES) return;
    Note *note = &notes->list[notes->count++];
    *note = (Note){.line = line, .error = error};
    snprintf(note->code, sizeof note->code, "%.*s", (int)length, code);
}

static size_t code_length(const char *text)
{
    size_t length = 0;
    while (isalnum((unsigned char)text[length]) || text[length] == '-') length++;
    return length;
}

// Reads what the example announces: `// error: code` and `// warning: code`, any number on a line.
static void read_announced(const Example *example, Notes *notes)
{
    static const char error_mark[] = "// error: ", warning_mark[] = "// warning: ";
    int line = 1;
    for (const char *p = example->text; p < example->text + example->length; p++) {
        if (*p == '\n') line++;
        bool error = strncmp(p, error_mark, sizeof error_mark - 1) == 0;
        if (!error && strncmp(p, warning_mark, sizeof warning_mark - 1) != 0) continue;
        const char *code = p + (error ? sizeof error_mark : sizeof warning_mark) - 1;
        add_note(notes, line, error, code, code_length(code));
    }
}

// Reads one line of the command's output; only lines of the form "PATH:line:column: severity: text [code]" are
// diagnostics.
static void read_diagnostic(const char *text, const char *path, int first_line, Notes *notes)
{
    size_t path_length = strlen(path);
    if (strncmp(text, path, path_length) != 0 || text[path_length] != ':') return;
    int line, column, used = 0;
    if (sscanf(text + path_length, ":%d:%d: %n", &line, &column, &used) < 2 || used == 0) return;
    const char *rest = text + path_length + used;
    bool error = strncmp(rest, "error: ", 7) == 0;
    if (!error && strncmp(rest, "warning: ", 9) != 0) return;
    const char *bracket = strrchr(rest, '[');
    if (!bracket) return;
    add_note(notes, line - first_line + 1, error, bracket + 1, code_length(bracket + 1));
}

// Runs `scn check` on the file and reads what it says. Returns the exit status, or -1 if it did not exit by itself.
static int run_check(const char *scn, const char *path, int first_line, Notes *notes, char *output, size_t size)
{
    char command[4096];
    snprintf(command, sizeof command, "'%s' check '%s' 2>&1", scn, path);
    FILE *pipe = popen(command, "r");
    if (!pipe) die("cannot run", scn);
    size_t length = fread(output, 1, size - 1, pipe);
    output[length] = 0;
    int status = pclose(pipe);
    for (const char *line = output; *line; line = *line_end(line) ? line_end(line) + 1 : line_end(line)) {
        char text[2048];
        snprintf(text, sizeof text, "%.*s", (int)(line_end(line) - line), line);
        read_diagnostic(text, path, first_line, notes);
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void write_example(const Example *example, const char *path)
{
    FILE *file = fopen(path, "wb");
    if (!file) die("cannot write", path);
    if (example->fragment) fputs(fragment_head, file);
    fwrite(example->text, 1, example->length, file);
    if (example->fragment) fputs(fragment_tail, file);
    if (fclose(file) != 0) die("cannot write", path);
}

// Pairs what was announced with what came. Prints what has no partner; returns whether everything has one.
static bool compare_notes(const Example *example, const char *text_path, Notes *announced, Notes *came)
{
    bool good = true;
    for (int i = 0; i < came->count; i++) {
        Note *note = &came->list[i];
        for (int j = 0; j < announced->count && !note->matched; j++) {
            Note *other = &announced->list[j];
            if (other->matched || other->line != note->line || other->error != note->error ||
                strcmp(other->code, note->code) != 0)
                continue;
            other->matched = note->matched = true;
        }
        bool unused = !note->error && strcmp(note->code, "unused") == 0;
        if (note->matched || (example->fragment && unused))
            continue; // a fragment shows what is said of it, not all of it
        printf("%s:%d: not announced: %s [%s]\n", text_path, example->line + note->line - 1,
               note->error ? "error" : "warning", note->code);
        good = false;
    }
    for (int j = 0; j < announced->count; j++) {
        const Note *note = &announced->list[j];
        if (note->matched) continue;
        printf("%s:%d: did not come: %s [%s]\n", text_path, example->line + note->line - 1,
               note->error ? "error" : "warning", note->code);
        good = false;
    }
    return good;
}

static bool check_example(const char *scn, const char *text_path, const char *folder, const Example *example)
{
    static char output[1 << 16];
    char path[2048];
    const char *name = strrchr(text_path, '/') ? strrchr(text_path, '/') + 1 : text_path;
    if (example->name)
        snprintf(path, sizeof path, "%s/%.*s", folder, (int)strcspn(example->name, "\r\n"), example->name);
    else
        snprintf(path, sizeof path, "%s/%.*s-%d.scn", folder, (int)strcspn(name, "."), name, example->line);
    write_example(example, path);

    Notes announced = {0}, came = {0};
    read_announced(example, &announced);
    int status = run_check(scn, path, example->fragment ? 2 : 1, &came, output, sizeof output);
    bool good = compare_notes(example, text_path, &announced, &came);
    int wanted = 0;
    for (int i = 0; i < announced.count; i++) wanted |= announced.list[i].error;
    if (status != wanted) {
        printf("%s:%d: the exit status is %d, not %d\n", text_path, example->line, status, wanted);
        good = false;
    }
    if (!good) printf("%s\n", output);
    return good;
}

// Whether the name stands in the text as a word of its own.
static bool is_named(const char *text, const char *name)
{
    size_t length = strlen(name);
    for (const char *p = text; (p = strstr(p, name)) != NULL; p++) {
        bool begins = p > text && !isalnum((unsigned char)p[-1]) && p[-1] != '_' && p[-1] != '-';
        char after = p[length];
        if (begins && !isalnum((unsigned char)after) && after != '_' && after != '-') return true;
    }
    return false;
}

// The names that the text has to have: those of the diagnostics, and the built-in ones at the beginning of their
// signatures.
static const char *const diagnostic_names[] = {
#define DIAG(id, code, ...) code,
#include "lang/diag.def"
#undef DIAG
    NULL};

static const char *const built_in_names[] = {
#define BUILTIN(id, kind, since, signature, documentation) signature,
#include "compiler/builtins.def"
#undef BUILTIN
    NULL};

static int missing_names(const char *text_path, const char *text, const char *kind, const char *const *names)
{
    int missing = 0;
    for (; *names; names++) {
        char name[MAX_CODE];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(*names, "(:"), *names);
        if (is_named(text, name)) continue;
        printf("%s: the %s %s is not in the text\n", text_path, kind, name);
        missing++;
    }
    return missing;
}

int main(int argc, char **argv)
{
    if (argc < 4 || argc > 5 || (argc == 5 && strcmp(argv[4], "--names") != 0)) {
        fputs("usage: scn-check-examples SCN TEXT.md FOLDER [--names]\n", stderr);
        return 2;
    }
    const char *scn = argv[1], *text_path = argv[2], *folder = argv[3];
    char *text = read_file(text_path);
    int examples = 0, failures = 0;
    Reader reader = {.next = text, .line = 1};
    for (Example example; next_example(&reader, &example); examples++)
        failures += !check_example(scn, text_path, folder, &example);
    if (argc > 4) {
        failures += missing_names(text_path, text, "diagnostic", diagnostic_names);
        failures += missing_names(text_path, text, "built-in name", built_in_names);
    }
    printf("%s: %d examples, %d failures\n", text_path, examples, failures);
    free(text);
    return failures > 0;
}
