// Valid scenes with one token deleted, doubled, or swapped with the next: each is a valid scene still, or gets sensible messages, and soon.
//
//     mutate [--every N] [--show COUNT] [--limit MS] FILE…
//
// Each N-th of the mutants is tried (1: all), chosen by a fixed pattern, the same on every machine. A file that is not valid by itself is left
// out. What fails is a crash, a mutant without a plan and without an error, and one that takes longer than 20 seconds, or MS of CPU. Printed is
// how many mutants are still valid, how many get one, two, three or more errors, and the longest time; --show prints those with at least
// COUNT errors, to read.
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "compiler/compile.h"
#include "lang/parse.h"
#include "lang/scan.h"

enum { DELETE, DOUBLE, SWAP, CHANGES };

typedef struct Tally {
    long tried, valid, errors[4]; // of 1, 2, 3 and more
    double slowest;               // ms of CPU
    long failed;
    int every, show, limit;
} Tally;

static char running[400]; // for the handler alone

static void on_alarm(int number)
{
    if (write(2, running, strlen(running)) < 0) _exit(3);
    _exit(1);
}

static double cpu_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec / 1e6;
}

// Where the tokens of a text are, as offsets.
static Span *tokens_of(Arena *arena, const char *text, size_t length, int *count)
{
    Unit unit;
    unit_init(&unit);
    Source *source = source_add(&unit.sources, "scene", text, length, (Span){0});
    Scanner scanner;
    scanner_init(&scanner, &unit, source);
    Span *tokens = arena_array(arena, Span, length + 1);
    Token token;
    *count = 0;
    for (scan(&scanner, &token); token.code != TOK_YYEOF; scan(&scanner, &token))
        tokens[(*count)++] = (Span){token.span.begin - source->base, token.span.end - source->base};
    scanner_release(&scanner);
    unit_release(&unit);
    return tokens;
}

static void append(char **to, const char *from, size_t length)
{
    memcpy(*to, from, length);
    *to += length;
}

static size_t mutant(char *out, const char *text, size_t length, const Span *tokens, int k, int change)
{
    char *to = out;
    Span a = tokens[k], b = change == SWAP ? tokens[k + 1] : a;
    append(&to, text, a.begin);
    if (change == DOUBLE) {
        append(&to, text + a.begin, a.end - a.begin);
        *to++ = ' ';
        append(&to, text + a.begin, a.end - a.begin);
    } else if (change == SWAP) {
        append(&to, text + b.begin, b.end - b.begin);
        append(&to, text + a.end, b.begin - a.end);
        append(&to, text + a.begin, a.end - a.begin);
    }
    append(&to, text + b.end, length - b.end);
    *to = 0;
    return (size_t)(to - out);
}

// Compiles a text under the path of its scene, so that its includes are found. The number of errors, or -1 for neither errors nor a plan.
static int compile_text(const char *path, const char *text, size_t length, FILE *show)
{
    Unit unit;
    unit_init(&unit);
    Source *source = source_add(&unit.sources, path, text, length, (Span){0});
    const Compiled *compiled = compile(&unit, source, &(CompileOptions){.unused = true});
    int errors = compiled->plan || unit.errors ? unit.errors : -1;
    if (show) diag_print(&unit, show, false);
    unit_release(&unit);
    return errors;
}

static void try(Tally *tally, const char *path, const char *text, size_t length)
{
    double begin = cpu_ms();
    alarm(20);
    int errors = compile_text(path, text, length, NULL);
    alarm(0);
    double took = cpu_ms() - begin;
    if (took > tally->slowest) tally->slowest = took;
    tally->tried++;
    if (errors < 0) printf("%s: neither a scene nor an error\n", running), tally->failed++;
    if (took > tally->limit) printf("%s: took %.0f ms\n", running, took), tally->failed++;
    if (errors == 0) tally->valid++;
    if (errors > 0) tally->errors[errors < 4 ? errors - 1 : 3]++;
    if (tally->show && errors >= tally->show) {
        printf("---- %s\n", running);
        compile_text(path, text, length, stdout);
    }
}

static void mutate(Tally *tally, const char *path, long *number)
{
    Arena arena = {0};
    size_t length;
    char *text = source_read(&arena, path, &length);
    if (!text) {
        perror(path);
        exit(3);
    }
    if (compile_text(path, text, length, NULL) == 0) {
        int count;
        Span *tokens = tokens_of(&arena, text, length, &count);
        for (int k = 0; k < count; k++) {
            for (int change = 0; change < CHANGES; change++) {
                if (++*number % tally->every || (change == SWAP && k + 1 == count)) continue;
                static const char *const words[] = {[DELETE] = "deleted", [DOUBLE] = "doubled", [SWAP] = "swapped"};
                char *changed = malloc(2 * length + 2);
                if (!changed) abort();
                size_t size = mutant(changed, text, length, tokens, k, change);
                snprintf(running, sizeof running, "%s: `%.*s` at byte %u %s\n", path,
                         (int)(tokens[k].end - tokens[k].begin), text + tokens[k].begin, tokens[k].begin,
                         words[change]);
                try(tally, path, changed, size);
                free(changed);
            }
        }
    }
    arena_release(&arena);
}

int main(int argc, char **argv)
{
    Tally tally = {.every = 1, .limit = 20000};
    long number = 0;
    signal(SIGALRM, on_alarm);
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--every") && i + 1 < argc)
            tally.every = atoi(argv[++i]);
        else if (!strcmp(argv[i], "--show") && i + 1 < argc)
            tally.show = atoi(argv[++i]);
        else if (!strcmp(argv[i], "--limit") && i + 1 < argc)
            tally.limit = atoi(argv[++i]);
        else if (tally.every > 0)
            mutate(&tally, argv[i], &number);
    }
    printf("%ld mutants: %ld valid, %ld with one error, %ld with two, %ld with three, %ld with more; the slowest took "
           "%.0f ms\n",
           tally.tried, tally.valid, tally.errors[0], tally.errors[1], tally.errors[2], tally.errors[3], tally.slowest);
    return tally.failed || !tally.tried ? 1 : 0;
}
