// Myers' greedy algorithm (An O(ND) Difference Algorithm and Its Variations, 1986, section 4). Points (x, y) of a grid are reached after x
// lines of the one text and y of the other; diagonals x − y = k are free where lines are equal. For each number of changes d the
// furthest x on each diagonal is kept, and the way is followed back through them.
//
// What both texts begin and end with is left out before. Where more than DIFF_MOST changes are left, the whole rest is told as
// replaced: so memory and time stay small, and nobody reads that many.
#include "runtime/diff.h"

#include <stdint.h>
#include <string.h>

#include "lang/arena.h"

enum { DIFF_MOST = 2000, DIFF_AROUND = 3 };

typedef struct Line {
    const char *text;
    size_t length; // with its line break, if it has one
} Line;

typedef struct Lines {
    Line *list;
    int count;
} Lines;

typedef struct Change { // before[x, x + removed) becomes after[y, y + added)
    int x, y, removed, added;
} Change;

typedef struct Diff {
    Arena arena;
    Lines before, after;
    Change *changes; // from last to first
    int count, capacity;
} Diff;

static Lines lines_of(Arena *arena, const char *text, size_t length)
{
    size_t count = 0;
    for (size_t i = 0; i < length; i++) count += text[i] == '\n';
    Lines lines = {arena_array(arena, Line, count + 1), 0};
    const char *end = text + length;
    while (text < end) {
        const char *stop = memchr(text, '\n', (size_t)(end - text));
        stop = stop ? stop + 1 : end;
        lines.list[lines.count++] = (Line){text, (size_t)(stop - text)};
        text = stop;
    }
    return lines;
}

static bool equal(const Diff *d, int x, int y)
{
    const Line *a = &d->before.list[x], *b = &d->after.list[y];
    return a->length == b->length && memcmp(a->text, b->text, a->length) == 0;
}

// Changes come from last to first; one that touches the one after it is joined with it.
static void add_change(Diff *d, int x, int y, int removed, int added)
{
    Change *next = d->count ? &d->changes[d->count - 1] : NULL;
    if (next && next->x == x + removed && next->y == y + added) {
        *next = (Change){x, y, next->removed + removed, next->added + added};
        return;
    }
    if (d->count == d->capacity) {
        int capacity = d->capacity ? d->capacity * 2 : 64;
        Change *larger = arena_array(&d->arena, Change, capacity);
        if (d->count) memcpy(larger, d->changes, (size_t)d->count * sizeof *larger);
        d->changes = larger;
        d->capacity = capacity;
    }
    d->changes[d->count++] = (Change){x, y, removed, added};
}

// Whether the way to diagonal k with one more change comes from diagonal k + 1, by an added line, rather than from k - 1.
static bool comes_from_above(const int *furthest, int k, int changes)
{
    return k == -changes || (k != changes && furthest[k - 1] < furthest[k + 1]);
}

// Follows the way back from the end. rows[d] is what was furthest after d changes, its middle being diagonal 0.
static void follow_back(Diff *d, int *const *rows, int changes, int x, int y, int from)
{
    for (; changes > 0; changes--) {
        int k = x - y;
        const int *furthest = rows[changes - 1];
        bool above = comes_from_above(furthest, k, changes);
        x = above ? furthest[k + 1] : furthest[k - 1];
        y = x - (above ? k + 1 : k - 1);
        add_change(d, from + x, from + y, !above, above);
    }
}

// The shortest way through the lines [from, …) of both texts, n and m of them.
static void find_changes(Diff *d, int from, int n, int m)
{
    int most = n + m < DIFF_MOST ? n + m : DIFF_MOST;
    int **rows = arena_array(&d->arena, int *, most + 1);
    const int *before = NULL;
    for (int changes = 0; changes <= most; changes++) {
        int *furthest = (int *)arena_array(&d->arena, int, 2 * changes + 3) + changes + 1;
        rows[changes] = furthest;
        for (int k = -changes; k <= changes; k += 2) {
            int x = 0;
            if (changes) x = comes_from_above(before, k, changes) ? before[k + 1] : before[k - 1] + 1;
            while (x < n && x - k < m && equal(d, from + x, from + x - k)) x++;
            furthest[k] = x;
            if (x >= n && x - k >= m) {
                follow_back(d, rows, changes, n, m, from);
                return;
            }
        }
        before = furthest;
    }
    add_change(d, from, from, n, m);
}

static void print_line(FILE *out, char mark, const Line *line, bool color)
{
    const char *paint = mark == '-' ? "\033[31m" : mark == '+' ? "\033[32m" : "";
    bool whole = line->length && line->text[line->length - 1] == '\n';
    fprintf(out, "%s%c%.*s%s\n", color ? paint : "", mark, (int)(line->length - whole), line->text,
            color && *paint ? "\033[m" : "");
    if (!whole) fputs("\\ No newline at end of file\n", out);
}

static int smaller(int a, int b)
{
    return a < b ? a : b;
}

static void print_range(FILE *out, char mark, int first, int count)
{
    fprintf(out, "%c%d", mark, count ? first + 1 : first);
    if (count != 1) fprintf(out, ",%d", count);
}

// Prints the changes [last, first] of the list, which are near to each other, as one hunk.
static void print_hunk(const Diff *d, FILE *out, int first, int last, bool color)
{
    const Change *begin = &d->changes[first], *end = &d->changes[last];
    int lead = smaller(begin->x, DIFF_AROUND);
    int x = begin->x - lead, y = begin->y - lead;
    int tail = smaller(d->before.count - end->x - end->removed, DIFF_AROUND);
    if (color) fputs("\033[36m", out);
    fputs("@@ ", out);
    print_range(out, '-', x, end->x + end->removed + tail - x);
    fputc(' ', out);
    print_range(out, '+', y, end->y + end->added + tail - y);
    fprintf(out, " @@%s\n", color ? "\033[m" : "");
    for (int i = first; i >= last; i--) {
        const Change *change = &d->changes[i];
        for (; x < change->x; x++) print_line(out, ' ', &d->before.list[x], color);
        for (; x < change->x + change->removed; x++) print_line(out, '-', &d->before.list[x], color);
        for (int k = 0; k < change->added; k++) print_line(out, '+', &d->after.list[change->y + k], color);
    }
    for (int k = 0; k < tail; k++) print_line(out, ' ', &d->before.list[x + k], color);
}

void diff_print(FILE *out, const char *name, const char *before, size_t before_length, const char *after,
                size_t after_length, bool color)
{
    Diff d = {0};
    d.before = lines_of(&d.arena, before, before_length);
    d.after = lines_of(&d.arena, after, after_length);
    int n = d.before.count, m = d.after.count, from = 0;
    while (from < n && from < m && equal(&d, from, from)) from++;
    while (n > from && m > from && equal(&d, n - 1, m - 1)) n--, m--;
    if (n > from || m > from) {
        find_changes(&d, from, n - from, m - from);
        fprintf(out, "--- %s\n+++ %s\n", name, name);
    }
    for (int first = d.count - 1; first >= 0;) {
        int last = first;
        for (; last > 0; last--) {
            const Change *near = &d.changes[last], *next = &d.changes[last - 1];
            if (next->x - near->x - near->removed > 2 * DIFF_AROUND) break;
        }
        print_hunk(&d, out, first, last, color);
        first = last - 1;
    }
    arena_release(&d.arena);
}
