// A rule as a railroad: whoever follows the line from left to right, along its bends, reads what can be written.
//
// Every part is measured, then drawn at a point of the line. It takes `width` along the line, `up` above and `down` below it.
//
//      ──┬──────────┬──       ──╭─[ part ]─╮──
//        ╰─[ part ]─╯           ╰─( , )◀───╯
//        optional               a loop: once or more, with something between
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "tests/docs/grammar.h"

enum { HALF = 12, GAP = 12, ROW = 8, TURN = 10, PAD = 10, MARGIN = 14 };
static const double letter = 7.8; // the width of one at 13px

typedef struct Size {
    double width, up, down;
} Size;

// --- Loops ---

// x { y x } is a loop of x with y between; { x } is optional, a loop of x.
static Part *as_loops(Arena *arena, Part *part)
{
    if (part->count == 0) return part;
    Part *parts[64];
    int count = 0;
    for (int i = 0; i < part->count; i++) {
        Part *child = as_loops(arena, part->parts[i]);
        Part *again =
            child->kind == PART_OPTIONAL && child->parts[0]->kind == PART_LOOP ? child->parts[0]->parts[0] : NULL;
        if (part->kind == PART_SEQUENCE && again && again->kind == PART_SEQUENCE) {
            int body = again->count - 1; // how many parts before it the loop ends with
            if (body > count) body = count;
            while (body > 0) {
                bool same = true;
                for (int k = 0; k < body; k++)
                    same &= part_equal(parts[count - body + k], again->parts[again->count - body + k]);
                if (same) break;
                body--;
            }
            if (body > 0) {
                Part *loop = part_wrap(arena, PART_LOOP, part_sequence(arena, parts + count - body, body));
                loop->parts[1] = part_sequence(arena, again->parts, again->count - body);
                loop->count = 2;
                count -= body;
                parts[count++] = loop;
                continue;
            }
        }
        parts[count++] = child;
    }
    if (part->kind == PART_SEQUENCE) return part_sequence(arena, parts, count);
    if (part->kind == PART_CHOICE) return part_choice(arena, parts, count);
    if (part->kind == PART_REPEAT) return part_wrap(arena, PART_OPTIONAL, part_wrap(arena, PART_LOOP, parts[0]));
    return part_wrap(arena, part->kind, parts[0]);
}

// --- Sizes ---

static Size size_of(const Part *part);

static Size size_of_sequence(const Part *part)
{
    Size all = {0, HALF, HALF};
    for (int i = 0; i < part->count; i++) {
        Size one = size_of(part->parts[i]);
        all.width += one.width + (i > 0 ? GAP : 0);
        if (one.up > all.up) all.up = one.up;
        if (one.down > all.down) all.down = one.down;
    }
    return all;
}

static Size size_of_choice(const Part *part)
{
    Size all = {0, 0, 0};
    for (int i = 0; i < part->count; i++) {
        Size one = size_of(part->parts[i]);
        if (one.width > all.width) all.width = one.width;
        if (i == 0)
            all.up = one.up, all.down = one.down;
        else
            all.down += ROW + one.up + one.down;
    }
    all.width += 4 * TURN;
    return all;
}

static Size size_of(const Part *part)
{
    Size one, other = {0, 0, 0};
    switch (part->kind) {
    case PART_WORD:
    case PART_CLASS:
    case PART_RULE: return (Size){letter * (double)strlen(part->text) + 2 * PAD, HALF, HALF};
    case PART_CHOICE: return size_of_choice(part);
    case PART_OPTIONAL: one = size_of(part->parts[0]); return (Size){one.width + 4 * TURN, 2, ROW + one.up + one.down};
    case PART_LOOP:
        one = size_of(part->parts[0]);
        if (part->count > 1) other = size_of(part->parts[1]);
        return (Size){(one.width > other.width ? one.width : other.width) + 2 * TURN, one.up,
                      one.down + ROW + (part->count > 1 ? other.up + other.down : 4)};
    default: return size_of_sequence(part);
    }
}

// --- Drawing ---

static void draw(FILE *out, const Part *part, double x, double y, bool back);

static void line(FILE *out, double from, double to, double y)
{
    if (to > from) fprintf(out, "<path d=\"M%.1f %.1fH%.1f\"/>\n", from, y, to);
}

static void put_escaped(FILE *out, const char *text)
{
    for (; *text; text++) {
        if (*text == '<')
            fputs("&lt;", out);
        else if (*text == '>')
            fputs("&gt;", out);
        else if (*text == '&')
            fputs("&amp;", out);
        else
            fputc(*text, out);
    }
}

static void draw_leaf(FILE *out, const Part *part, double x, double y)
{
    double width = size_of(part).width;
    const char *fill = part->kind == PART_WORD ? "#fff1c9" : part->kind == PART_CLASS ? "#e3f1dc" : "#dde9f8";
    fprintf(out, "<rect fill=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%d\" rx=\"%d\"/>\n", fill, x,
            y - HALF, width, 2 * HALF, part->kind == PART_RULE ? 2 : HALF);
    fprintf(out, "<text fill=\"#111\" stroke=\"none\" x=\"%.1f\" y=\"%.1f\">", x + width / 2, y + 4.5);
    put_escaped(out, part->text);
    fputs("</text>\n", out);
}

// `back`: the line runs from right to left here, and the parts of a sequence with it.
static void draw_sequence(FILE *out, const Part *part, double x, double y, bool back)
{
    for (int i = 0; i < part->count; i++) {
        const Part *one = part->parts[back ? part->count - 1 - i : i];
        if (i > 0) {
            line(out, x, x + GAP, y);
            x += GAP;
        }
        draw(out, one, x, y, back);
        x += size_of(one).width;
    }
}

// One row of a choice, below the line: down, along, and up again.
static void draw_row(FILE *out, const Part *part, double x, double y, double width, double row, bool back)
{
    double inner = size_of(part).width, right = x + width;
    fprintf(out, "<path d=\"M%.1f %.1fa%d %d 0 0 1 %d %dV%.1fa%d %d 0 0 0 %d %d\"/>\n", x, y, TURN, TURN, TURN, TURN,
            row - TURN, TURN, TURN, TURN, TURN);
    draw(out, part, x + 2 * TURN, row, back);
    line(out, x + 2 * TURN + inner, right - 2 * TURN, row);
    fprintf(out, "<path d=\"M%.1f %.1fa%d %d 0 0 0 %d %dV%.1fa%d %d 0 0 1 %d %d\"/>\n", right - 2 * TURN, row, TURN,
            TURN, TURN, -TURN, y + TURN, TURN, TURN, TURN, -TURN);
}

static void draw_choice(FILE *out, const Part *part, double x, double y, bool back)
{
    double width = size_of(part).width, row = y;
    for (int i = 0; i < part->count; i++) {
        Size one = size_of(part->parts[i]);
        if (i == 0) {
            line(out, x, x + 2 * TURN, y);
            draw(out, part->parts[0], x + 2 * TURN, y, back);
            line(out, x + 2 * TURN + one.width, x + width, y);
        } else {
            row += ROW + one.up;
            draw_row(out, part->parts[i], x, y, width, row, back);
        }
        row += one.down;
    }
}

static void draw_optional(FILE *out, const Part *part, double x, double y, bool back)
{
    double width = size_of(part).width;
    line(out, x, x + width, y);
    draw_row(out, part->parts[0], x, y, width, y + ROW + size_of(part->parts[0]).up, back);
}

static void draw_loop(FILE *out, const Part *part, double x, double y, bool back)
{
    Size all = size_of(part), body = size_of(part->parts[0]), between = {0, 0, 0};
    if (part->count > 1) between = size_of(part->parts[1]);
    double row = y + body.down + ROW + (part->count > 1 ? between.up : 2), left = x + TURN,
           right = x + all.width - TURN;
    line(out, x, left, y);
    draw(out, part->parts[0], left, y, back);
    line(out, left + body.width, x + all.width, y);
    fprintf(out, "<path d=\"M%.1f %.1fa%d %d 0 0 1 %d %dV%.1fa%d %d 0 0 1 %d %dH%.1f\"/>\n", right, y, TURN, TURN, TURN,
            TURN, row - TURN, TURN, TURN, -TURN, TURN, left + between.width);
    if (part->count > 1) draw(out, part->parts[1], left, row, !back);
    fprintf(out, "<path d=\"M%.1f %.1fa%d %d 0 0 1 %d %dV%.1fa%d %d 0 0 1 %d %d\"/>\n", left, row, TURN, TURN, -TURN,
            -TURN, y + TURN, TURN, TURN, TURN, -TURN);
    fprintf(out, "<path fill=\"#555\" d=\"M%.1f %.1fl5 -3.5v7z\"/>\n",
            x - 0.5 + (right - left) / 2 + TURN + (part->count > 1 ? between.width / 2 : 0), row);
}

static void draw(FILE *out, const Part *part, double x, double y, bool back)
{
    switch (part->kind) {
    case PART_SEQUENCE: draw_sequence(out, part, x, y, back); break;
    case PART_CHOICE: draw_choice(out, part, x, y, back); break;
    case PART_OPTIONAL: draw_optional(out, part, x, y, back); break;
    case PART_LOOP: draw_loop(out, part, x, y, back); break;
    default: draw_leaf(out, part, x, y);
    }
}

void grammar_railroad(FILE *out, Arena *arena, const Rule *rule)
{
    Part *part = as_loops(arena, rule->body);
    Size size = size_of(part);
    double y = MARGIN + size.up, begin = MARGIN + GAP, end = begin + size.width;
    fprintf(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" role=\"img\">\n<title>%s</title>\n"
        "<rect width=\"100%%\" height=\"100%%\" rx=\"6\" fill=\"#fff\"/>\n"
        "<g fill=\"none\" stroke=\"#555\" stroke-width=\"1.4\" font-family=\"monospace\" font-size=\"13\" "
        "text-anchor=\"middle\">\n",
        end + GAP + MARGIN, y + size.down + MARGIN, rule->name);
    fprintf(out, "<path d=\"M%d %.1fv12M%.1f %.1fv12\" stroke-width=\"3\"/>\n", MARGIN, y - 6, end + GAP, y - 6);
    line(out, MARGIN, begin, y);
    draw(out, part, begin, y, false);
    line(out, end, end + GAP, y);
    fputs("</g>\n</svg>\n", out);
}
