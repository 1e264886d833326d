// Runs the scenes of a folder through the scn command and compares what comes out with what the scene says.
//
//     run-scenes --scn build/bin/scn [--parse] [--update] FOLDER [NAME.scn …]
//     run-scenes --codes TESTS_FOLDER
//
// Expected diagnostics stand in comments on their own line, or on a neighbour's where the line itself is what is broken:
//
//     object a = sphere(1).rotate(y: 90);      // error: angle-unit
//     let unused = 3;                          // warning: unused, shadow
//     // error-below: unclosed                    (error-above, warning-above, warning-below)
//
// All of these and no others must come, in the scene and in the files that it includes. With an error expected, `scn check` must exit with 1, else with 0.
// Comments at the beginning of a line set the rest:
//
//     // after: fold                 the pass whose IR is compared with the `.ir` (without it: as elaborated)
//     // size: 64x64                 of the picture
//     // tolerance: 0.5%             share of pixels that may differ by more than 2/255 (0.1 %)
//     // args: --time 0.5            given to every command, words separated by spaces
//     // frame-error: text           `scn render` exits with 1 and says this (for what only a frame can show)
//
// What stands beside the scene is compared too: `.ast` and `.ir` (scn dump), `.cl` (scn dump --kernel), `.err` (standard error of
// scn check), `.png` (scn render). --update, or UPDATE=1 in the environment, writes these files anew instead. Commands run in the folder, so that paths
// in messages are bare names; each has its own process and a time limit, so one scene cannot take the others down.
//
// --parse: the scenes are about their shape alone, and `scn dump --ast` takes the place of `scn check`.
// --codes checks that every diagnostic of lang/diag.def is expected by some scene or named by some unit test below the folder, but for those that
// codes-without-a-scene.txt lists with a reason.
#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <png.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "lang/diag.h"

enum { MAX_ARGS = 48, CHECK_SECONDS = 20, RENDER_SECONDS = 120 };

typedef struct Expectation {
    char file[128];
    int line;
    bool error;
    char code[48];
    bool met;
} Expectation;

typedef struct Text {
    char *bytes;
    size_t length;
} Text;

typedef struct Run {
    Text out, err;
    int status; // exit status; 128 + signal; 124 where the time ran out
} Run;

typedef struct Scene {
    const char *name; // with .scn
    char stem[128];
    Text text;
    char *files[64]; // the scene and what it includes
    int file_count;
    Expectation *expected;
    int expected_count, expected_capacity;
    char after[64], size[32], args[256], frame_error[256];
    double tolerance;
    bool failed;
} Scene;

typedef struct Suite {
    const char *scn;
    bool update, parse;
    int scenes, failures;
} Suite;

static void *must(void *memory)
{
    if (!memory) abort();
    return memory;
}

static bool read_all(int fd, Text *text)
{
    size_t capacity = 4096;
    text->bytes = must(malloc(capacity));
    text->length = 0;
    for (;;) {
        ssize_t n = read(fd, text->bytes + text->length, capacity - text->length - 1);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            text->bytes[text->length] = 0;
            return n == 0;
        }
        text->length += (size_t)n;
        if (text->length + 1 == capacity) text->bytes = must(realloc(text->bytes, capacity *= 2));
    }
}

static bool read_file(const char *path, Text *text)
{
    *text = (Text){0};
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return false;
    bool good = read_all(fd, text);
    close(fd);
    return good;
}

static void write_file(const char *path, Text text)
{
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(text.bytes, 1, text.length, file) != text.length || fclose(file)) {
        perror(path);
        exit(3);
    }
}

static void complain(Scene *scene, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void complain(Scene *scene, const char *format, ...)
{
    va_list list;
    printf("%s: ", scene->name);
    va_start(list, format);
    vprintf(format, list);
    va_end(list);
    putchar('\n');
    scene->failed = true;
}

// -- running the command -------------------------------------------------------------------------------------------------------

// Output goes to unnamed files, not pipes: nothing has to be read while the command runs.
static Run run(const char *const *argv, unsigned seconds)
{
    Run result = {0};
    FILE *out = must(tmpfile()), *err = must(tmpfile());
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        int null = open("/dev/null", O_RDONLY);
        dup2(null, 0);
        dup2(fileno(out), 1);
        dup2(fileno(err), 2);
        alarm(seconds); // survives exec; its signal ends the command
        execv(argv[0], (char *const *)argv);
        _exit(127);
    }
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) result.status = 124;
    rewind(out);
    rewind(err);
    read_all(fileno(out), &result.out);
    read_all(fileno(err), &result.err);
    fclose(out);
    fclose(err);
    return result;
}

static void run_free(Run *result)
{
    free(result->out.bytes);
    free(result->err.bytes);
}

// scn COMMAND… ARGS… SCENE; `command` ends with NULL.
static Run run_scn(const Suite *suite, const Scene *scene, unsigned seconds, const char *const *command)
{
    const char *argv[MAX_ARGS];
    char args[sizeof scene->args], *rest;
    int count = 0;
    argv[count++] = suite->scn;
    for (; *command; command++) argv[count++] = *command;
    memcpy(args, scene->args, sizeof args);
    for (char *word = strtok_r(args, " ", &rest); word && count < MAX_ARGS - 2; word = strtok_r(NULL, " ", &rest))
        argv[count++] = word;
    argv[count++] = scene->name;
    argv[count] = NULL;
    return run(argv, seconds);
}

static const char *describe_status(int status)
{
    static char text[64];
    if (status == 124) return "ran out of time";
    if (status > 128)
        snprintf(text, sizeof text, "was ended by signal %d (%s)", status - 128, strsignal(status - 128));
    else
        snprintf(text, sizeof text, "exited with %d", status);
    return text;
}

// -- what a scene expects ------------------------------------------------------------------------------------------------------

static void expect(Scene *scene, const char *file, int line, bool error, const char *codes, size_t length)
{
    while (length) {
        size_t word = strspn(codes, " ,\t");
        if (word >= length) return;
        codes += word, length -= word;
        word = 0;
        while (word < length &&
               (islower((unsigned char)codes[word]) || isdigit((unsigned char)codes[word]) || codes[word] == '-'))
            word++;
        if (word == 0) return;
        if (scene->expected_count == scene->expected_capacity) {
            scene->expected_capacity = scene->expected_capacity * 2 + 8;
            scene->expected =
                must(realloc(scene->expected, sizeof *scene->expected * (size_t)scene->expected_capacity));
        }
        Expectation *e = &scene->expected[scene->expected_count++];
        *e = (Expectation){.line = line, .error = error};
        snprintf(e->file, sizeof e->file, "%s", file);
        snprintf(e->code, sizeof e->code, "%.*s", (int)word, codes);
        codes += word, length -= word;
    }
}

static void setting(char *out, size_t size, const char *line, size_t length, const char *key)
{
    size_t n = strlen(key);
    if (length <= n || memcmp(line, key, n)) return;
    snprintf(out, size, "%.*s", (int)(length - n), line + n);
}

static void read_line(Scene *scene, const char *file, int number, const char *line, size_t length)
{
    static const struct {
        const char *mark;
        bool error;
        int offset;
    } marks[] = {
        {"// error: ", true, 0},       {"// warning: ", false, 0},        {"// error-above: ", true, -1},
        {"// error-below: ", true, 1}, {"// warning-above: ", false, -1}, {"// warning-below: ", false, 1},
    };
    for (size_t k = 0; k < sizeof marks / sizeof *marks; k++) {
        const char *at = memmem(line, length, marks[k].mark, strlen(marks[k].mark));
        if (!at) continue;
        at += strlen(marks[k].mark);
        const char *end = memmem(at, (size_t)(line + length - at), "//", 2); // a second mark may follow
        if (!end) end = line + length;
        expect(scene, file, number + marks[k].offset, marks[k].error, at, (size_t)(end - at));
    }
    char percent[32] = "";
    setting(scene->after, sizeof scene->after, line, length, "// after: ");
    setting(scene->size, sizeof scene->size, line, length, "// size: ");
    setting(scene->args, sizeof scene->args, line, length, "// args: ");
    setting(scene->frame_error, sizeof scene->frame_error, line, length, "// frame-error: ");
    setting(percent, sizeof percent, line, length, "// tolerance: ");
    if (*percent) scene->tolerance = atof(percent) / 100;
}

static void read_expectations(Scene *scene, const char *file, const Text *text)
{
    const char *line = text->bytes, *end = text->bytes + text->length;
    for (int number = 1; line < end; number++) {
        const char *stop = memchr(line, '\n', (size_t)(end - line));
        if (!stop) stop = end;
        size_t length = (size_t)(stop - line);
        if (length && line[length - 1] == '\r') length--;
        read_line(scene, file, number, line, length);
        line = stop + 1;
    }
}

// Adds a file that the scene names in an include or use, once, with those that it names itself.
static void read_included(Scene *scene, const char *file, const Text *text)
{
    for (int k = 0; k < scene->file_count; k++) {
        if (!strcmp(scene->files[k], file)) return;
    }
    if (scene->file_count == 64) return;
    scene->files[scene->file_count++] = must(strdup(file));
    read_expectations(scene, file, text);
    const char *slash = strrchr(file, '/');
    for (const char *at = text->bytes; (at = strstr(at, ".scn\"")); at += 5) {
        const char *begin = at;
        while (begin > text->bytes && begin[-1] != '"' && begin[-1] != '\n') begin--;
        char path[256];
        snprintf(path, sizeof path, "%.*s%.*s", slash ? (int)(slash + 1 - file) : 0, file, (int)(at + 4 - begin),
                 begin);
        Text inner;
        if (read_file(path, &inner)) read_included(scene, path, &inner);
        free(inner.bytes);
    }
}

// -- comparing -----------------------------------------------------------------------------------------------------------------

// "file:line:column: error: text [code]" gives true and the parts.
static bool parse_diagnostic(const char *line, size_t length, Expectation *found)
{
    *found = (Expectation){0};
    const char *mark = memmem(line, length, ": error: ", 9);
    found->error = mark != NULL;
    if (!mark) mark = memmem(line, length, ": warning: ", 11);
    if (!mark || length < 2 || line[length - 1] != ']') return false;
    const char *column = mark;
    while (column > line && isdigit((unsigned char)column[-1])) column--;
    if (column == mark || column <= line + 1 || column[-1] != ':') return false;
    const char *row = --column;
    while (row > line && isdigit((unsigned char)row[-1])) row--;
    if (row == column || row <= line || row[-1] != ':') return false;
    found->line = atoi(row);
    snprintf(found->file, sizeof found->file, "%.*s", (int)(row - 1 - line), line);
    const char *code = line + length - 1;
    while (code > mark && code[-1] != '[') code--;
    snprintf(found->code, sizeof found->code, "%.*s", (int)(line + length - 1 - code), code);
    return true;
}

static void compare_diagnostics(Scene *scene, const Text *err)
{
    const char *line = err->bytes, *end = err->bytes + err->length;
    while (line < end) {
        const char *stop = memchr(line, '\n', (size_t)(end - line));
        if (!stop) stop = end;
        Expectation found;
        if (parse_diagnostic(line, (size_t)(stop - line), &found)) {
            bool met = false;
            for (int k = 0; k < scene->expected_count && !met; k++) {
                Expectation *e = &scene->expected[k];
                if (e->met || e->line != found.line || e->error != found.error || strcmp(e->file, found.file) ||
                    strcmp(e->code, found.code))
                    continue;
                met = e->met = true;
            }
            if (!met) complain(scene, "unexpected: %.*s", (int)(stop - line), line);
        }
        line = stop + 1;
    }
    for (int k = 0; k < scene->expected_count; k++) {
        const Expectation *e = &scene->expected[k];
        if (!e->met)
            complain(scene, "missing: %s:%d: %s [%s]", e->file, e->line, e->error ? "error" : "warning", e->code);
    }
}

static void show_difference(Scene *scene, const char *path, const Text *got)
{
    complain(scene, "differs from %s (run with UPDATE=1 if the new one is right)", path);
    char name[] = "/tmp/scn-scene-XXXXXX";
    int fd = mkstemp(name);
    if (fd < 0) return;
    if (write(fd, got->bytes, got->length) == (ssize_t)got->length) {
        const char *argv[] = {"/usr/bin/diff", "-u", "--label", "expected", "--label", "got", path, name, NULL};
        Run diff = run(argv, 10);
        printf("%.6000s", diff.out.bytes);
        run_free(&diff);
    }
    close(fd);
    unlink(name);
}

static void compare_text(const Suite *suite, Scene *scene, const char *suffix, Text got)
{
    char path[160];
    snprintf(path, sizeof path, "%s%s", scene->stem, suffix);
    Text want;
    if (!read_file(path, &want)) return;
    if (suite->update)
        write_file(path, got);
    else if (want.length != got.length || memcmp(want.bytes, got.bytes, got.length))
        show_difference(scene, path, &got);
    free(want.bytes);
}

static bool beside(const Scene *scene, const char *suffix)
{
    char path[160];
    snprintf(path, sizeof path, "%s%s", scene->stem, suffix);
    return access(path, R_OK) == 0;
}

static void compare_dump(const Suite *suite, Scene *scene, const char *suffix, const char *const *command)
{
    if (!beside(scene, suffix)) return;
    Run dump = run_scn(suite, scene, CHECK_SECONDS, command);
    if (dump.status > 1)
        complain(scene, "scn dump %s\n%s", describe_status(dump.status), dump.err.bytes);
    else
        compare_text(suite, scene, suffix, dump.out);
    run_free(&dump);
}

static bool read_png(const char *path, png_image *image, png_bytep *pixels)
{
    *image = (png_image){.version = PNG_IMAGE_VERSION};
    if (!png_image_begin_read_from_file(image, path)) return false;
    image->format = PNG_FORMAT_RGBA;
    *pixels = must(malloc(PNG_IMAGE_SIZE(*image)));
    if (png_image_finish_read(image, NULL, *pixels, 0, NULL)) return true;
    free(*pixels);
    return false;
}

static void compare_png(Scene *scene, const char *want_path, const char *got_path)
{
    png_image want, got;
    png_bytep want_pixels, got_pixels;
    if (!read_png(want_path, &want, &want_pixels)) {
        complain(scene, "%s cannot be read: %s", want_path, want.message);
        return;
    }
    if (!read_png(got_path, &got, &got_pixels)) {
        complain(scene, "the rendered picture cannot be read: %s", got.message);
        free(want_pixels);
        return;
    }
    if (want.width != got.width || want.height != got.height) {
        complain(scene, "the picture has %ux%u pixels, %s has %ux%u", got.width, got.height, want_path, want.width,
                 want.height);
    } else {
        size_t pixels = (size_t)want.width * want.height, differ = 0;
        int worst = 0;
        for (size_t k = 0; k < pixels; k++) {
            int most = 0;
            for (size_t i = 4 * k; i < 4 * k + 4; i++) {
                int d = abs(want_pixels[i] - got_pixels[i]);
                if (d > most) most = d;
            }
            differ += most > 2;
            if (most > worst) worst = most;
        }
        if ((double)differ > scene->tolerance * (double)pixels) {
            complain(scene, "%zu of %zu pixels differ by more than 2/255 (worst %d) from %s; the new one is %s", differ,
                     pixels, worst, want_path, got_path);
        }
    }
    free(want_pixels);
    free(got_pixels);
}

static void compare_picture(const Suite *suite, Scene *scene)
{
    char want[160], got[200];
    snprintf(want, sizeof want, "%s.png", scene->stem);
    const char *folder = getenv("TMPDIR");
    snprintf(got, sizeof got, "%s/scn-scene-%s-%d.png", folder ? folder : "/tmp", scene->stem, (int)getpid());
    const char *path = suite->update ? want : got;
    const char *command[] = {"render", "-q", "--size", *scene->size ? scene->size : "96x96", "-o", path, NULL};
    Run render = run_scn(suite, scene, RENDER_SECONDS, command);
    if (*scene->frame_error) {
        if (render.status != 1) complain(scene, "scn render %s, 1 was expected", describe_status(render.status));
        if (!strstr(render.err.bytes, scene->frame_error)) {
            complain(scene, "scn render did not say \"%s\":\n%s", scene->frame_error, render.err.bytes);
        }
    } else if (render.status) {
        complain(scene, "scn render %s\n%s", describe_status(render.status), render.err.bytes);
    } else if (!suite->update) {
        compare_png(scene, want, got);
    }
    if (!scene->failed) unlink(got);
    run_free(&render);
}

static void check_scene(const Suite *suite, Scene *scene)
{
    static const char *const whole[] = {"check", NULL}, *const shape[] = {"dump", "--ast", NULL};
    Run check = run_scn(suite, scene, CHECK_SECONDS, suite->parse ? shape : whole);
    bool wrong = false;
    for (int k = 0; k < scene->expected_count; k++) wrong |= scene->expected[k].error;
    compare_diagnostics(scene, &check.err);
    if (check.status != (wrong ? 1 : 0)) {
        complain(scene, "scn %s %s, %d was expected\n%.4000s", suite->parse ? "dump --ast" : "check",
                 describe_status(check.status), wrong ? 1 : 0, check.err.bytes);
    }
    compare_text(suite, scene, ".err", check.err);
    run_free(&check);
    compare_dump(suite, scene, ".ast", (const char *[]){"dump", "--ast", NULL});
    char after[80];
    snprintf(after, sizeof after, "--after=%s", scene->after);
    compare_dump(suite, scene, ".ir", (const char *[]){"dump", *scene->after ? after : "--ir", NULL});
    compare_dump(suite, scene, ".cl", (const char *[]){"dump", "--kernel", NULL});
    if (beside(scene, ".png") || *scene->frame_error) compare_picture(suite, scene);
}

static void run_scene(Suite *suite, const char *name)
{
    Scene scene = {.name = name, .tolerance = 0.001};
    snprintf(scene.stem, sizeof scene.stem, "%.*s", (int)(strlen(name) - 4), name);
    if (!read_file(name, &scene.text)) {
        complain(&scene, "cannot be read: %s", strerror(errno));
    } else {
        read_included(&scene, name, &scene.text);
        check_scene(suite, &scene);
    }
    suite->scenes++;
    suite->failures += scene.failed;
    for (int k = 0; k < scene.file_count; k++) free(scene.files[k]);
    free(scene.expected);
    free(scene.text.bytes);
}

// -- every diagnostic has a test -----------------------------------------------------------------------------------------------

typedef struct Coverage {
    bool covered[DIAG_COUNT];
    bool excused[DIAG_COUNT];
} Coverage;

static bool names_code(const char *text, const char *code, bool scene)
{
    size_t length = strlen(code);
    for (const char *at = text; (at = strstr(at, code)); at += length) {
        char before = at > text ? at[-1] : ' ', after = at[length];
        if (isalnum((unsigned char)before) || before == '-' || isalnum((unsigned char)after) || after == '-') continue;
        if (!scene) return before == '"' && after == '"';
        const char *line = at;
        while (line > text && line[-1] != '\n') line--;
        const char *mark = memmem(line, (size_t)(at - line), "// error", 8);
        if (mark || memmem(line, (size_t)(at - line), "// warning", 10)) return true;
    }
    return false;
}

static void cover_file(Coverage *coverage, const char *path, bool scene)
{
    Text text;
    if (read_file(path, &text)) {
        for (int k = 0; k < DIAG_COUNT; k++) {
            if (!coverage->covered[k])
                coverage->covered[k] = names_code(text.bytes, diag_code_name((DiagCode)k), scene);
        }
    }
    free(text.bytes);
}

static void cover_folder(Coverage *coverage, const char *folder)
{
    DIR *dir = opendir(folder);
    if (!dir) return;
    for (struct dirent *entry; (entry = readdir(dir));) {
        if (entry->d_name[0] == '.') continue;
        char path[1024];
        struct stat info;
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        size_t length = strlen(path);
        if (stat(path, &info)) continue;
        if (S_ISDIR(info.st_mode))
            cover_folder(coverage, path);
        else if (length > 4 && !strcmp(path + length - 4, ".scn"))
            cover_file(coverage, path, true);
        else if (strstr(path, "/test_") && !strcmp(path + length - 2, ".c"))
            cover_file(coverage, path, false);
    }
    closedir(dir);
}

// Lines "code: reason"; '#' begins a comment.
static int read_excuses(Coverage *coverage, const char *folder)
{
    char path[1024], *line = NULL;
    size_t size = 0;
    int wrong = 0;
    snprintf(path, sizeof path, "%s/codes-without-a-scene.txt", folder);
    FILE *file = fopen(path, "r");
    if (!file) return 0;
    while (getline(&line, &size, file) > 0) {
        char *colon = strchr(line, ':');
        if (line[0] == '#' || line[0] == '\n') continue;
        bool known = false;
        if (colon) *colon = 0;
        for (int k = 0; k < DIAG_COUNT && colon; k++) {
            if (strcmp(line, diag_code_name((DiagCode)k))) continue;
            known = coverage->excused[k] = true;
        }
        if (!known) printf("%s: '%s' is no diagnostic with a reason\n", path, line), wrong++;
    }
    free(line);
    fclose(file);
    return wrong;
}

static int check_codes(const char *folder)
{
    Coverage coverage = {0};
    int wrong = read_excuses(&coverage, folder), excused = 0;
    cover_folder(&coverage, folder);
    for (int k = 0; k < DIAG_COUNT; k++) {
        excused += coverage.excused[k];
        if (!coverage.covered[k] && !coverage.excused[k])
            printf("%s: no test expects it\n", diag_code_name((DiagCode)k)), wrong++;
        if (coverage.covered[k] && coverage.excused[k])
            printf("%s: has a test now, strike it from the list\n", diag_code_name((DiagCode)k)), wrong++;
    }
    printf("%d diagnostics, %d excused, %d wrong\n", DIAG_COUNT, excused, wrong);
    return wrong ? 1 : 0;
}

// -- the command ---------------------------------------------------------------------------------------------------------------

static int only_scenes(const struct dirent *entry)
{
    size_t length = strlen(entry->d_name);
    return entry->d_name[0] != '.' && length > 4 && !strcmp(entry->d_name + length - 4, ".scn");
}

static void run_folder(Suite *suite)
{
    struct dirent **list;
    int count = scandir(".", &list, only_scenes, alphasort);
    for (int k = 0; k < count; k++) {
        run_scene(suite, list[k]->d_name);
        free(list[k]);
    }
    if (count >= 0) free(list);
}

int main(int argc, char **argv)
{
    Suite suite = {.update = getenv("UPDATE") != NULL};
    int k = 1;
    if (argc == 3 && !strcmp(argv[1], "--codes")) return check_codes(argv[2]);
    for (; k < argc && argv[k][0] == '-'; k++) {
        if (!strcmp(argv[k], "--update"))
            suite.update = true;
        else if (!strcmp(argv[k], "--parse"))
            suite.parse = true;
        else if (!strcmp(argv[k], "--scn") && k + 1 < argc)
            suite.scn = must(realpath(argv[++k], NULL));
        else
            break;
    }
    if (!suite.scn || k >= argc || argv[k][0] == '-') {
        fprintf(
            stderr,
            "usage: run-scenes --scn COMMAND [--parse] [--update] FOLDER [NAME.scn ...] | run-scenes --codes FOLDER\n");
        return 2;
    }
    const char *folder = argv[k++];
    if (chdir(folder)) {
        perror(folder);
        return 3;
    }
    if (k == argc) run_folder(&suite);
    for (; k < argc; k++) run_scene(&suite, argv[k]);
    printf("%d scenes, %d failed\n", suite.scenes, suite.failures);
    free((char *)suite.scn);
    if (!suite.scenes) return 1; // a folder without scenes tests nothing
    return suite.failures ? 1 : 0;
}
