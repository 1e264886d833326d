// How fast the front end is: large texts, deep ones and garbage, each read from memory to a plan or to its messages.
//
//     bench-front [--quick]
//
// A row is one text, compiled as `scn check` does in a process of its own. Milliseconds are CPU time of one run, from the text to the plan, and of its phases;
// tokens are those of the text, counted beside; a rate is tokens by the time of the scanner, parser and checker together. MB is the most memory
// that the process held, the text included. Behind a row stands what is asked for, and what was reported. --quick takes a
// hundredth of each text, to see that it runs.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "compiler/compile.h"
#include "lang/parse.h"
#include "lang/scan.h"
#include "tests/bench/scene.h"

typedef struct Row {
    const char *name;
    void (*write)(FILE *out, int count);
    int count;
    bool wrong;     // must end in a message; else in none
    double at_most; // ms; 0: nothing is asked for
} Row;

static uint64_t next(uint64_t *state) // splitmix64
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

// -- the texts

static void write_quadrics(FILE *out, int count)
{
    Arena arena = {0};
    BenchScene scene;
    bench_union(&arena, "quadrics", count, false, 2001, &scene);
    bench_write_scn(&scene, out);
    arena_release(&arena);
}

static void write_boxes(FILE *out, int count)
{
    uint64_t random = 1;
    fputs("scene {\n", out);
    for (int k = 0; k < count; k++) {
        fprintf(out, "    box(0.1, 0.2, 0.3).rotate(y: %d.%ddeg).move(%d, 0, %d);\n", (int)(next(&random) % 90), k % 10,
                k % 300, k / 300);
    }
    fputs("}\n", out);
}

static void write_objects(FILE *out, int count)
{
    for (int k = 0; k < count; k++)
        fprintf(out, "object o%d = sphere(0.%d).move(%d, 0, %d);\n", k, k % 9 + 1, k % 300, k / 300);
    fputs("scene { o0; }\n", out);
}

static void write_lets(FILE *out, int count)
{
    for (int k = 0; k < count; k++) fprintf(out, "let v%d = %d * 2 + 1;\n", k, k);
    fputs("sphere(1);\n", out);
}

// Each of the last one: nothing is known until the end of the chain is.
static void write_chain(FILE *out, int count)
{
    for (int k = count; k > 0; k--) fprintf(out, "let v%d = v%d + 1;\n", k, k - 1);
    fprintf(out, "let v0 = 0;\nsphere(v%d);\n", count);
}

static void write_nested(FILE *out, int count, const char *open, const char *inside, const char *close)
{
    fputs("let b = true;\nlet a = ", out);
    for (int k = 0; k < count; k++) fputs(open, out);
    fputs(inside, out);
    for (int k = 0; k < count; k++) fputs(close, out);
    fputs(";\n", out);
}

static void write_parentheses(FILE *out, int count)
{
    write_nested(out, count, "(", "1", ")");
}
static void write_lists(FILE *out, int count)
{
    write_nested(out, count, "[", "1", "]");
}
static void write_blocks(FILE *out, int count)
{
    write_nested(out, count, "union { ", "sphere(1);", "}");
}
static void write_signs(FILE *out, int count)
{
    write_nested(out, count, "not ", "b", "");
}
static void write_elses(FILE *out, int count)
{
    write_nested(out, count, "if b { 1 } else ", "{ 2 }", "");
}
static void write_strings(FILE *out, int count)
{
    write_nested(out, count, "\"{", "1", "}\"");
}
static void write_comments(FILE *out, int count)
{
    write_nested(out, count, "/* ", "1", "");
}

static void write_bytes(FILE *out, int count)
{
    uint64_t random = 2;
    for (int k = 0; k < count; k++) fputc((int)(0x20 + next(&random) % 0xE0), out); // controls would be no text
}

static void write_marks(FILE *out, int count)
{
    static const char marks[] = "(){}[];:,.\"+-*/^|&~=<> \n abc123#@'";
    uint64_t random = 3;
    for (int k = 0; k < count; k++) fputc(marks[next(&random) % (sizeof marks - 1)], out);
}

static void write_words(FILE *out, int count)
{
    static const char *const words[] = {
#define RESERVED(token, word, ...) word,
#define MARK(token, mark, role)    mark,
#include "lang/words.def"
        "sphere", "object", "(", ")", "{", "}", ";", ",", ".", "1", "0.5", "90deg", "\"", "a", "b", "\n"};
    uint64_t random = 4;
    for (int bytes = 0; bytes < count;)
        bytes += fprintf(out, "%s ", words[next(&random) % (sizeof words / sizeof *words)]);
}

static const Row rows[] = {
    {"a union of 100,000 quadrics", write_quadrics, 100000, false, 1000},
    {"100,000 turned boxes", write_boxes, 100000, false, 0},
    {"100,000 objects", write_objects, 100000, false, 500},
    {"100,000 lets", write_lets, 100000, false, 500},
    {"a chain of 100,000 lets", write_chain, 100000, false, 500},
    {"( 10,000 deep", write_parentheses, 10000, true, 0},
    {"[ 10,000 deep", write_lists, 10000, true, 0},
    {"{ 10,000 deep", write_blocks, 10000, true, 0},
    {"not 10,000 deep", write_signs, 10000, true, 0},
    {"else if 10,000 deep", write_elses, 10000, true, 0},
    {"strings 10,000 deep", write_strings, 10000, true, 0},
    {"comments 10,000 deep", write_comments, 10000, true, 0},
    {"10 MB of random bytes", write_bytes, 10000000, true, 0},
    {"10 MB of random marks", write_marks, 10000000, true, 0},
    {"10 MB of random words", write_words, 10000000, true, 0},
};

// -- measuring

static char *text_of(const Row *row, int count, size_t *length)
{
    char *text;
    FILE *out = open_memstream(&text, length);
    if (!out) abort();
    row->write(out, count);
    fclose(out);
    return text;
}

static long count_tokens(const char *text, size_t length)
{
    Unit unit;
    unit_init(&unit);
    Scanner scanner;
    scanner_init(&scanner, &unit, source_add(&unit.sources, "bench.scn", text, length, (Span){0}));
    Token token;
    long count = 0;
    for (scan(&scanner, &token); token.code != TOK_YYEOF; scan(&scanner, &token)) count++;
    scanner_release(&scanner);
    unit_release(&unit);
    return count;
}

// In a process of its own, so that a row's memory is its own. Its status says whether all is as the row wants it.
static _Noreturn void run_row(const Row *row, int count)
{
    size_t length;
    char *text = text_of(row, count, &length);
    struct rusage before, after;
    getrusage(RUSAGE_SELF, &before);
    Unit unit;
    unit_init(&unit);
    Source *source = source_add(&unit.sources, "bench.scn", text, length, (Span){0});
    Compiled *compiled = compile(&unit, source, &(CompileOptions){.unused = true});
    getrusage(RUSAGE_SELF, &after);
    const double *ms = compiled->milliseconds;
    double all = 0;
    for (int k = 0; k < PHASE_COUNT; k++) all += ms[k];
    long tokens = count_tokens(text, length);
    double behind = ms[PHASE_PASSES] + ms[PHASE_LOWER] + ms[PHASE_WARN];
    double checked = (ms[PHASE_PARSE] + ms[PHASE_CHECK]) * 1e3; // tokens by microseconds are millions a second
    printf("%-28s %6.1f %9ld %7.0f %7.0f %7.0f %7.0f %7.0f %8.1f %6.0f", row->name, (double)length / 1e6, tokens,
           ms[PHASE_PARSE], ms[PHASE_CHECK], ms[PHASE_ELABORATE], behind, all,
           checked > 0 ? (double)tokens / checked : 0, (double)after.ru_maxrss / 1024);
    if (row->at_most > 0) printf("   at most %.0f ms", row->at_most);
    if (unit.errors)
        printf("   %d error%s, first %s", unit.errors, unit.errors == 1 ? "" : "s",
               diag_code_name(unit.diagnostics.first->code));
    putchar('\n');
    fflush(stdout);
    _exit((unit.errors > 0) == row->wrong ? 0 : 1);
}

int main(int argc, char **argv)
{
    bool quick = argc > 1 && !strcmp(argv[1], "--quick");
    if (argc > (quick ? 2 : 1)) {
        fprintf(stderr, "usage: bench-front [--quick]\n");
        return 2;
    }
    printf("%-28s %6s %9s %7s %7s %7s %7s %7s %8s %6s\n", "text", "MB", "tokens", "parse", "check", "elabor.", "passes",
           "all ms", "Mtok/s", "MB");
    fflush(stdout);
    int failed = 0;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        // Depth is what a deep text is about, and it is small anyway.
        int count = quick && rows[k].count > 10000 ? rows[k].count / 100 : rows[k].count;
        int status = 0;
        pid_t child = fork();
        if (child == 0) run_row(&rows[k], count);
        if (child < 0 || waitpid(child, &status, 0) < 0) {
            perror("bench-front");
            return 3;
        }
        if (WIFEXITED(status) && WEXITSTATUS(status) == 0) continue;
        printf("%s: %s\n", rows[k].name, WIFSIGNALED(status) ? "a crash" : "not what was expected");
        failed++;
    }
    return failed ? 1 : 0;
}
