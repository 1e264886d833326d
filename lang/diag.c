// A report is kept in the order it came and sorted only to be printed. Texts are formatted into the unit's arena at once, so a
// caller may pass what it is about to change. What is beyond the limits is counted without being formatted: a
// binary file given by mistake must not fill the memory with messages.
#include "lang/diag.h"

#include <assert.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "lang/unit.h"
#include "lang/utf8.h"

typedef struct DiagFacts {
    const char *code;
    Severity severity;
    const char *explanation, *wrong, *right;
} DiagFacts;

static const DiagFacts facts[DIAG_COUNT] = {
#define DIAG(id, code, severity, explanation, wrong, right) {code, SEVERITY_##severity, explanation, wrong, right},
#include "lang/diag.def"
#undef DIAG
};

const char *diag_code_name(DiagCode code)
{
    assert(code < DIAG_COUNT && "a diagnostic of diag.def");
    return facts[code].code;
}

Severity diag_severity(DiagCode code)
{
    return facts[code].severity;
}
const char *diag_explanation(DiagCode code)
{
    return facts[code].explanation;
}
const char *diag_wrong_example(DiagCode code)
{
    return facts[code].wrong;
}
const char *diag_right_example(DiagCode code)
{
    return facts[code].right;
}

bool diag_code_find(const char *name, DiagCode *code)
{
    for (int i = 0; i < DIAG_COUNT; i++) {
        if (strcmp(facts[i].code, name) != 0) continue;
        *code = (DiagCode)i;
        return true;
    }
    return false;
}

// --- Which warnings there are ---

static const char *wrong_warning(Arena *arena, const char *name)
{
    const char *names[DIAG_COUNT];
    int count = 0;
    DiagCode code;
    if (diag_code_find(name, &code)) return arena_printf(arena, "%s is an error, and always reported", name);
    for (int i = 0; i < DIAG_COUNT; i++) {
        if (facts[i].severity == SEVERITY_WARNING) names[count++] = facts[i].code;
    }
    const char *near = nearest_name(name, names, count);
    if (near) return arena_printf(arena, "there is no warning %s: do you mean %s?", name, near);
    const char *all = names[0];
    for (int i = 1; i < count; i++) all = arena_printf(arena, "%s, %s", all, names[i]);
    return arena_printf(arena, "there is no warning %s: there are %s", name, all);
}

// Skips a beginning; true if it was there.
static bool skip(const char **text, const char *beginning)
{
    size_t length = strlen(beginning);
    if (strncmp(*text, beginning, length) != 0) return false;
    *text += length;
    return true;
}

const char *diag_set_warning(Arena *arena, Diagnostics *list, const char *setting)
{
    bool all = !strcmp(setting, "all"), none = !strcmp(setting, "none");
    if (!strcmp(setting, "error") || !strcmp(setting, "no-error")) {
        list->warnings_are_errors = setting[0] == 'e';
        return NULL;
    }
    if (all || none) {
        memset(list->levels, all ? LEVEL_DEFAULT : LEVEL_OFF, sizeof list->levels);
        return NULL;
    }
    const char *name = setting;
    WarningLevel level = LEVEL_DEFAULT;
    if (skip(&name, "error="))
        level = LEVEL_ERROR;
    else if (skip(&name, "no-error="))
        level = LEVEL_WARNING;
    else if (skip(&name, "no-"))
        level = LEVEL_OFF;
    DiagCode code;
    if (!diag_code_find(name, &code) || facts[code].severity != SEVERITY_WARNING) return wrong_warning(arena, name);
    // Naming a warning turns it on again, and leaves it the error that it may have been made.
    bool stays = name == setting && list->levels[code] != LEVEL_OFF;
    if (!stays) list->levels[code] = (uint8_t)level;
    return NULL;
}

static Severity severity_of(const Diagnostics *list, DiagCode code)
{
    if (facts[code].severity != SEVERITY_WARNING) return facts[code].severity;
    bool error = list->levels[code] == LEVEL_DEFAULT ? list->warnings_are_errors : list->levels[code] == LEVEL_ERROR;
    return error ? SEVERITY_ERROR : SEVERITY_WARNING;
}

// --- Reporting ---

// Where a report of a code at a span stands among those that are kept, or the empty place where it will stand. A text of nothing but
// mistakes has hundreds of thousands of them, so they are not looked through one by one.
static Diag **place_of(Unit *unit, DiagCode code, Span span)
{
    enum { PLACES = 8192 }; // a power of two above 3 * DIAG_KEPT_MAX
    Diagnostics *list = &unit->diagnostics;
    if (!list->places) list->places = arena_array(&unit->arena, Diag *, PLACES);
    uint64_t hash = (((uint64_t)span.begin << 32 | span.end) ^ (uint64_t)code << 24) * 0x9e3779b97f4a7c15u;
    for (uint32_t k = (uint32_t)(hash >> 51);; k++) {
        Diag **place = &list->places[k % PLACES];
        const Diag *d = *place;
        if (!d || (d->code == code && d->span.begin == span.begin && d->span.end == span.end)) return place;
    }
}

// Mistakes behind which a line is not what it was meant to be, however the parser goes on.
static bool loses_line(DiagCode code)
{
    switch (code) {
    case DIAG_BAD_CHARACTER:
    case DIAG_UNKNOWN_UNIT:
    case DIAG_RESERVED_WORD:
    case DIAG_UNEXPECTED:
    case DIAG_UNCLOSED:
    case DIAG_STRAY_BRACKET: return true;
    default: return false;
    }
}

Diag *diag(Unit *unit, Span span, DiagCode code, const char *format, ...)
{
    Diagnostics *list = &unit->diagnostics;
    if (lost_report(unit, span)) return &list->discarded;
    if (list->levels[code] == LEVEL_OFF && facts[code].severity == SEVERITY_WARNING) return &list->discarded;
    Diag **place = place_of(unit, code, span);
    if (*place) return &list->discarded;
    Severity severity = severity_of(list, code);
    if (severity == SEVERITY_ERROR) unit->errors++;
    if (severity == SEVERITY_ERROR && facts[code].severity == SEVERITY_WARNING) unit->promoted++;
    if (severity == SEVERITY_WARNING) unit->warnings++;
    if (list->kept[severity] >= DIAG_KEPT_MAX) return &list->discarded;
    list->kept[severity]++;
    if (loses_line(code)) lost_line(unit, span);

    Diag *d = *place = arena_new(&unit->arena, Diag);
    d->code = code;
    d->severity = severity;
    d->span = span;
    va_list values;
    va_start(values, format);
    d->text = arena_vprintf(&unit->arena, format, values);
    va_end(values);
    if (list->last)
        list->last->next = d;
    else
        list->first = d;
    list->last = d;
    return d;
}

void diag_take_back(Unit *unit, Diag *d)
{
    Diagnostics *list = &unit->diagnostics;
    Diag *before = NULL, *at = list->first;
    for (; at && at != d; at = at->next) before = at;
    if (!at || d->severity != SEVERITY_ERROR) return; // it was not kept
    if (before)
        before->next = d->next;
    else
        list->first = d->next;
    if (list->last == d) list->last = before;
    list->kept[d->severity]--;
    unit->errors--;
    d->span = (Span){UINT32_MAX, UINT32_MAX}; // its place in the table stays, and is nobody's
}

void diag_label(Unit *unit, Diag *d, Span span, const char *format, ...)
{
    if (d == &unit->diagnostics.discarded) return;
    DiagLabel *label = arena_new(&unit->arena, DiagLabel);
    label->span = span;
    va_list values;
    va_start(values, format);
    label->text = arena_vprintf(&unit->arena, format, values);
    va_end(values);
    DiagLabel **end = &d->labels;
    while (*end) end = &(*end)->next;
    *end = label;
}

void diag_fix(Unit *unit, Diag *d, Span span, FixKind kind, const char *format, ...)
{
    if (d == &unit->diagnostics.discarded) return;
    DiagFix *fix = arena_new(&unit->arena, DiagFix);
    fix->span = span;
    fix->kind = kind;
    va_list values;
    va_start(values, format);
    fix->text = arena_vprintf(&unit->arena, format, values);
    va_end(values);
    DiagFix **end = &d->fixes;
    while (*end) end = &(*end)->next;
    *end = fix;
}

// --- Sorting ---

typedef struct Sortable {
    const Diag *diag;
    int order; // of the report, so that the sort is stable
} Sortable;

static int compare_places(const void *left, const void *right)
{
    const Sortable *a = left, *b = right;
    if (a->diag->span.begin != b->diag->span.begin) return a->diag->span.begin < b->diag->span.begin ? -1 : 1;
    return a->order - b->order;
}

const Diag **diag_sorted(const Unit *unit, Arena *arena, int *count)
{
    int n = 0;
    for (const Diag *d = unit->diagnostics.first; d; d = d->next) n++;
    Sortable *list = arena_array(arena, Sortable, n);
    n = 0;
    for (const Diag *d = unit->diagnostics.first; d; d = d->next, n++) list[n] = (Sortable){d, n};
    qsort(list, (size_t)n, sizeof *list, compare_places);
    const Diag **sorted = arena_array(arena, const Diag *, n);
    for (int i = 0; i < n; i++) sorted[i] = list[i].diag;
    *count = n;
    return sorted;
}

// --- Printing ---

// Colours of the parts, as ANSI sequences.
#define BOLD   "\033[1m"
#define RED    "\033[1;31m"
#define YELLOW "\033[1;33m"
#define BLUE   "\033[1;34m"
#define GREEN  "\033[32m"
#define NORMAL "\033[0m"

typedef struct Printer {
    const Unit *unit;
    FILE *out;
    bool color;
} Printer;

static const char *color(const Printer *p, const char *sequence)
{
    return p->color ? sequence : "";
}

enum { SHOWN_COLUMNS = 100 }; // of a source line; what is longer is cut around the caret

// Prints the characters of a text from column `from` on, `columns` of them. Tabs become spaces, so the line below can be aligned;
// control characters and broken bytes become U+FFFD, so nothing in a source reaches the terminal as a command.
static void print_columns(FILE *out, const char *text, uint32_t length, uint32_t from, uint32_t columns)
{
    uint32_t column = 0;
    for (uint32_t at = 0; at < length && column < from + columns;) {
        uint32_t code;
        uint32_t bytes = (uint32_t)utf8_read(text + at, length - at, &code);
        uint32_t width = utf8_columns(code, column);
        if (code == '\t') {
            for (uint32_t i = 0; i < width; i++) {
                if (column + i >= from && column + i < from + columns) fputc(' ', out);
            }
        } else if (column >= from) {
            if (code < 0x20 || (code >= 0x7F && code < 0xA0) || code == UTF8_BROKEN)
                fputs("\xEF\xBF\xBD", out);
            else
                fwrite(text + at, 1, bytes, out);
        } else if (column + width > from) {
            fputc(' ', out); // half of a wide character that is cut
        }
        column += width;
        at += bytes;
    }
}

static uint32_t columns_between(const char *text, uint32_t length, uint32_t at_column)
{
    uint32_t column = at_column;
    for (uint32_t at = 0; at < length;) {
        uint32_t code;
        at += (uint32_t)utf8_read(text + at, length - at, &code);
        column += utf8_columns(code, column);
    }
    return column - at_column;
}

// The source line of a span and below it a mark under the span, as far as it is on that line.
static void print_line(const Printer *p, Place place, Span span, char mark, const char *mark_color)
{
    uint32_t begin = span.begin - place.source->base - (uint32_t)(place.line_text - place.source->text); // bytes
    if (begin > place.line_length) begin = place.line_length;
    uint32_t bytes = span.end > span.begin ? span.end - span.begin : 0;
    if (bytes > place.line_length - begin) bytes = place.line_length - begin;
    uint32_t marked = columns_between(place.line_text + begin, bytes, place.width);
    if (marked == 0) marked = 1;

    // A window of the line that has the mark's begin in it, with a third of it before the mark.
    uint32_t reach = 0; // bytes that are looked at: enough for the window
    uint32_t whole = place.width;
    while (begin + reach < place.line_length && whole < place.width + SHOWN_COLUMNS + 1) {
        uint32_t code;
        reach += (uint32_t)utf8_read(place.line_text + begin + reach, place.line_length - begin - reach, &code);
        whole += utf8_columns(code, whole);
    }
    uint32_t from = 0;
    if (whole > SHOWN_COLUMNS && place.width + marked + 10 > SHOWN_COLUMNS) {
        from = place.width > SHOWN_COLUMNS / 3 ? place.width - SHOWN_COLUMNS / 3 : 0;
    }
    uint32_t columns = whole - from < SHOWN_COLUMNS ? whole - from : SHOWN_COLUMNS;
    bool cut = whole - from > SHOWN_COLUMNS;
    if (marked > from + columns - place.width) marked = from + columns - place.width;
    if (marked == 0) marked = 1;

    const char *before = from ? "…" : "";
    fprintf(p->out, "%s%5u |%s %s", color(p, BLUE), place.line, color(p, NORMAL), before);
    print_columns(p->out, place.line_text, begin + reach, from, columns);
    fprintf(p->out, "%s\n%s      |%s ", cut ? "…" : "", color(p, BLUE), color(p, NORMAL));
    for (uint32_t i = from; i < place.width + (from ? 1 : 0); i++) fputc(' ', p->out);
    fputs(color(p, mark_color), p->out);
    fputc(mark, p->out);
    for (uint32_t i = 1; i < marked; i++) fputc(mark == '^' ? '~' : mark, p->out);
    fprintf(p->out, "%s\n", color(p, NORMAL));
}

// A message may quote a source. Only its line breaks and tabs pass; a break is indented.
static void print_text(FILE *out, const char *text)
{
    for (const char *p = text; *p; p++) {
        if (*p == '\n')
            fputs("\n      ", out);
        else if ((unsigned char)*p < 0x20 && *p != '\t')
            fputs("\xEF\xBF\xBD", out);
        else if (*p == 0x7F)
            fputs("\xEF\xBF\xBD", out);
        else
            fputc(*p, out);
    }
}

static void print_place(const Printer *p, Place place)
{
    fprintf(p->out, "%s%s:%u:%u:%s ", color(p, BOLD), place.source->path, place.line, place.column, color(p, NORMAL));
}

static void print_fix(const Printer *p, const DiagFix *fix)
{
    Place place = source_place(&p->unit->sources, fix->span.begin);
    fprintf(p->out, "%s      = %s%s ", color(p, GREEN), fix->kind == FIX_GUESS ? "perhaps" : "fix", color(p, NORMAL));
    bool insertion = fix->span.begin == fix->span.end;
    if (fix->text[0] == 0) {
        fputs("remove this", p->out);
    } else {
        fprintf(p->out, "%s `", insertion ? "insert" : "write");
        print_text(p->out, fix->text);
        fputc('`', p->out);
    }
    if (place.source) fprintf(p->out, " at %u:%u", place.line, place.column);
    fputc('\n', p->out);
}

static void print_include_chain(const Printer *p, const Source *source)
{
    for (int depth = 0; source && source->included_at.end && depth < DIAG_INCLUDES_SHOWN; depth++) {
        Place at = source_place(&p->unit->sources, source->included_at.begin);
        if (!at.source) return;
        fprintf(p->out, "      %s from %s:%u:%u\n", source->library ? "used" : "included", at.source->path, at.line,
                at.column);
        source = at.source;
    }
}

static void print_one(const Printer *p, const Diag *d)
{
    static const char *const words[] = {"note", "warning", "error"};
    static const char *const colors[] = {BLUE, YELLOW, RED};
    Place place = source_place(&p->unit->sources, d->span.begin);
    if (place.source)
        print_place(p, place);
    else
        fputs("scn: ", p->out);
    fprintf(p->out, "%s%s:%s %s", color(p, colors[d->severity]), words[d->severity], color(p, NORMAL), color(p, BOLD));
    print_text(p->out, d->text);
    fprintf(p->out, "%s [%s]\n", color(p, NORMAL), facts[d->code].code);
    if (place.source) print_line(p, place, d->span, '^', colors[d->severity]);
    for (const DiagLabel *label = d->labels; label; label = label->next) {
        Place at = source_place(&p->unit->sources, label->span.begin);
        if (at.source)
            print_place(p, at);
        else
            fputs("      ", p->out);
        print_text(p->out, label->text);
        fputc('\n', p->out);
        if (at.source) print_line(p, at, label->span, '-', BLUE);
    }
    for (const DiagFix *fix = d->fixes; fix; fix = fix->next) print_fix(p, fix);
    print_include_chain(p, place.source);
}

static void print_rest(FILE *out, int rest, const char *word)
{
    if (rest > 0) fprintf(out, "%d more %s%s not shown\n", rest, word, rest == 1 ? " is" : "s are");
}

void diag_print(const Unit *unit, FILE *out, bool use_color)
{
    Printer p = {unit, out, use_color};
    Arena arena = {0};
    int count;
    const Diag **sorted = diag_sorted(unit, &arena, &count);
    int limit = unit->diagnostics.shown_limit ? unit->diagnostics.shown_limit : 20;
    int shown[3] = {0};
    for (int i = 0; i < count; i++) {
        if (shown[sorted[i]->severity]++ < limit) print_one(&p, sorted[i]);
    }
    print_rest(out, unit->errors - limit, "error");
    print_rest(out, unit->warnings - limit, "warning");
    arena_release(&arena);
}
