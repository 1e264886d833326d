// A reference as one HTML page, which needs nothing beside it, or as Markdown.
//
// The page is valid HTML 5: styles and pictures (as data: addresses) are inside; light or dark as the reader has it. Texts of the author are
// escaped; of their marks paragraphs, lists, `code` and fenced blocks are known.
#include <inttypes.h>
#include <string.h>

#include "runtime/doc.h"

static const char style[] =
    ":root { color-scheme: light dark; --text: #1d2129; --soft: #5b6472; --back: #ffffff; --panel: #f3f5f8; --line: "
    "#d9dee6; --link: #1f5fbf; }\n"
    "@media (prefers-color-scheme: dark) {\n"
    "  :root { --text: #dfe4ec; --soft: #98a2b3; --back: #14171c; --panel: #1e232b; --line: #343b47; --link: #7db0ff; "
    "}\n"
    "}\n"
    "* { box-sizing: border-box; }\n"
    "body { margin: 0; color: var(--text); background: var(--back); font: 16px/1.55 system-ui, sans-serif; }\n"
    "main { max-width: 60rem; margin: 0 auto; padding: 1rem 1.25rem 4rem; }\n"
    "h1 { font-size: 2rem; margin: 1.5rem 0 0.5rem; }\n"
    "h2 { font-size: 1.4rem; margin: 3rem 0 0.5rem; border-bottom: 1px solid var(--line); }\n"
    "h3 { font-size: 1.15rem; margin: 2.25rem 0 0.5rem; font-family: ui-monospace, monospace; }\n"
    "h3 small { font: 0.75rem system-ui, sans-serif; color: var(--soft); margin-left: 0.5rem; }\n"
    "a { color: var(--link); text-decoration: none; }\n"
    "a:hover { text-decoration: underline; }\n"
    "h3 a.self { visibility: hidden; margin-left: 0.4rem; }\n"
    "h3:hover a.self { visibility: visible; }\n"
    "code, pre { font: 0.875rem/1.5 ui-monospace, monospace; }\n"
    "p code, li code, td code { background: var(--panel); padding: 0.1em 0.3em; border-radius: 3px; }\n"
    "pre { background: var(--panel); padding: 0.75rem 1rem; border-radius: 6px; overflow-x: auto; margin: 0.75rem 0; "
    "}\n"
    "pre.signature { background: none; border-left: 3px solid var(--link); border-radius: 0; padding: 0.25rem 0 "
    "0.25rem 1rem; white-space: pre-wrap; }\n"
    "nav ul { list-style: none; padding: 0; margin: 0.25rem 0 1rem; display: flex; flex-wrap: wrap; gap: 0.15rem 1rem; "
    "}\n"
    "nav li { font: 0.875rem/1.7 ui-monospace, monospace; }\n"
    "nav p { margin: 0.75rem 0 0; font-weight: 600; }\n"
    "table { border-collapse: collapse; width: 100%; margin: 0.75rem 0; font-size: 0.9375rem; }\n"
    "th, td { text-align: left; vertical-align: top; padding: 0.3rem 0.75rem 0.3rem 0; border-bottom: 1px solid "
    "var(--line); }\n"
    "th { font-weight: 600; color: var(--soft); font-size: 0.8125rem; }\n"
    "figure { display: flex; flex-wrap: wrap; gap: 1rem; align-items: flex-start; margin: 0.75rem 0; }\n"
    "figure pre { flex: 1 1 20rem; margin: 0; min-width: 0; white-space: pre-wrap; }\n"
    "figure img { max-width: 100%; height: auto; border-radius: 6px; }\n"
    ".later { color: var(--soft); }\n";

// --- Words that both formats share

// How a value of a type is written.
static const char *unit_of(const char *type)
{
    static const char *const units[][2] = {
        {"angle", "deg, rad, turn"}, {"time", "s, ms, f"},     {"color", "#rrggbb"},  {"bool", "true, false"},
        {"string", "\"…\""},         {"range", "low .. high"}, {"vec3", "(x, y, z)"}, {"vec2", "(x, y)"},
    };
    for (size_t k = 0; k < sizeof units / sizeof *units; k++) {
        if (!strcmp(type, units[k][0])) return units[k][1];
    }
    return "";
}

// "bump(radius: scalar = 0.2, height: scalar = 0.1) -> object"; on several lines where it is long.
static const char *signature(Arena *arena, const DocEntry *entry, const DocForm *form)
{
    if (!form->called) {
        const DocParameter *p = form->parameters;
        if (!p) return form->result ? arena_printf(arena, "%s: %s", entry->name, form->result) : entry->name;
        return arena_printf(arena, "%s: %s%s%s%s%s", p->name, p->type, p->initial ? " = " : "",
                            p->initial ? p->initial : "", p->range ? " in " : "", p->range ? p->range : "");
    }
    const char *flat = "", *tall = "";
    for (const DocParameter *p = form->parameters; p; p = p->next) {
        const char *text =
            arena_printf(arena, "%s: %s%s%s%s%s%s", p->name, p->type, p->optional ? "?" : "", p->initial ? " = " : "",
                         p->initial ? p->initial : "", p->range ? " in " : "", p->range ? p->range : "");
        flat = arena_printf(arena, "%s%s%s", flat, *flat ? ", " : "", text);
        tall = arena_printf(arena, "%s    %s,\n", tall, text);
    }
    const char *arrow = form->result ? arena_printf(arena, " -> %s", form->result) : "";
    if (strlen(flat) + strlen(arrow) + strlen(entry->name) < 92)
        return arena_printf(arena, "%s(%s)%s", entry->name, flat, arrow);
    return arena_printf(arena, "%s(\n%s)%s", entry->name, tall, arrow);
}

static bool has_table(const DocForm *form)
{
    bool said = false;
    for (const DocParameter *p = form->parameters; p; p = p->next)
        said |= p->doc || p->later || *unit_of(p->type) || p->range;
    return form->called && said;
}

static bool has_range(const DocForm *form)
{
    for (const DocParameter *p = form->parameters; p; p = p->next) {
        if (p->range) return true;
    }
    return false;
}

static const char *what_of(Arena *arena, const DocParameter *p)
{
    const char *later = p->later ? "Not in this version yet." : "";
    return arena_printf(arena, "%s%s%s", p->doc ? p->doc : "", p->doc && *later ? " " : "", later);
}

// --- HTML: texts

static void escape(FILE *out, const char *text, size_t length)
{
    for (const char *c = text; c < text + length; c++) {
        switch (*c) {
        case '<': fputs("&lt;", out); break;
        case '>': fputs("&gt;", out); break;
        case '&': fputs("&amp;", out); break;
        case '"': fputs("&quot;", out); break;
        default:
            if ((unsigned char)*c >= ' ' || *c == '\n' || *c == '\t')
                fputc(*c, out); // HTML has no other control characters
        }
    }
}

static void escape_all(FILE *out, const char *text)
{
    escape(out, text, strlen(text));
}

// A line with `code` in it.
static void write_line(FILE *out, const char *text, size_t length)
{
    const char *end = text + length;
    while (text < end) {
        const char *tick = memchr(text, '`', (size_t)(end - text)), *close = NULL;
        if (tick) close = memchr(tick + 1, '`', (size_t)(end - tick - 1));
        if (!close) {
            escape(out, text, (size_t)(end - text));
            return;
        }
        escape(out, text, (size_t)(tick - text));
        fputs("<code>", out);
        escape(out, tick + 1, (size_t)(close - tick - 1));
        fputs("</code>", out);
        text = close + 1;
    }
}

static void write_base64(FILE *out, const uint8_t *bytes, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        uint32_t three = (uint32_t)bytes[i] << 16 | (i + 1 < size ? (uint32_t)bytes[i + 1] << 8 : 0) |
                         (i + 2 < size ? bytes[i + 2] : 0);
        for (size_t k = 0; k < 4; k++) fputc(i + k <= size ? digits[three >> (18 - 6 * k) & 63] : '=', out);
    }
}

static void write_example(FILE *out, const DocEntry *entry, const DocExample *example)
{
    fputs("<figure>\n<pre><code>", out);
    escape_all(out, example->shown);
    fputs("</code></pre>\n", out);
    if (example->png) {
        fputs("<img alt=\"Picture of ", out);
        escape_all(out, entry->name);
        fputs("\" src=\"data:image/png;base64,", out);
        write_base64(out, example->png, example->png_size);
        fputs("\">\n", out);
    }
    fputs("</figure>\n", out);
}

typedef enum Open { OPEN_NOTHING, OPEN_PARAGRAPH, OPEN_LIST } Open;

static void close_open(FILE *out, Open *open)
{
    if (*open == OPEN_PARAGRAPH) fputs("</p>\n", out);
    if (*open == OPEN_LIST) fputs("</li>\n</ul>\n", out);
    *open = OPEN_NOTHING;
}

// A fenced block; returns what is behind it. An example is written with its picture.
static const char *write_fence(FILE *out, const char *line, const DocEntry *entry, const DocExample **example)
{
    bool scene = !strncmp(line, "```scn\n", 7);
    const char *begin = line + strcspn(line, "\n");
    if (*begin) begin++;
    const char *end = strstr(begin, "```");
    if (!end) end = begin + strlen(begin);
    if (scene && *example) {
        write_example(out, entry, *example);
        *example = (*example)->next;
    } else {
        fputs("<pre><code>", out);
        escape(out, begin, (size_t)(end - begin));
        fputs("</code></pre>\n", out);
    }
    end += strcspn(end, "\n");
    return *end ? end + 1 : end;
}

// `example`: the first of the examples that stand in the text; the next one afterwards. May point to NULL.
static void write_text(FILE *out, const char *text, const DocEntry *entry, const DocExample **example)
{
    Open open = OPEN_NOTHING;
    while (text && *text) {
        size_t length = strcspn(text, "\n");
        const char *next = text + length + (text[length] != 0);
        if (!strncmp(text, "```", 3)) {
            close_open(out, &open);
            text = write_fence(out, text, entry, example);
            continue;
        }
        if (strspn(text, " \t") >= length) {
            close_open(out, &open);
        } else if (!strncmp(text, "- ", 2)) {
            if (open != OPEN_LIST) close_open(out, &open);
            fputs(open == OPEN_LIST ? "</li>\n<li>" : "<ul>\n<li>", out);
            write_line(out, text + 2, length - 2);
            open = OPEN_LIST;
        } else {
            fputs(open == OPEN_NOTHING ? "<p>" : "\n", out);
            if (open == OPEN_NOTHING) open = OPEN_PARAGRAPH;
            write_line(out, text, length);
        }
        text = next;
    }
    close_open(out, &open);
}

// --- HTML: the page

static void write_code_cell(FILE *out, const char *text, const char *more)
{
    fputs("<td>", out);
    if (*text) {
        fputs("<code>", out);
        escape_all(out, text);
        fputs("</code>", out);
    }
    if (*more) {
        fputs(" <span class=\"later\">", out);
        escape_all(out, more);
        fputs("</span>", out);
    }
    fputs("</td>", out);
}

static void write_table(FILE *out, Arena *arena, const DocForm *form)
{
    bool ranged = has_range(form);
    fprintf(out,
            "<table>\n<thead><tr><th>parameter</th><th>type</th><th>default</th>%s<th></th></tr></thead>\n<tbody>\n",
            ranged ? "<th>range</th>" : "");
    for (const DocParameter *p = form->parameters; p; p = p->next) {
        fputs("<tr>", out);
        write_code_cell(out, p->name, "");
        write_code_cell(out, p->type, unit_of(p->type));
        write_code_cell(out, p->initial ? p->initial : "",
                        p->initial    ? ""
                        : p->optional ? "may be left out"
                                      : "needed");
        if (ranged) write_code_cell(out, p->range ? p->range : "", "");
        const char *what = what_of(arena, p);
        fputs("<td>", out);
        write_line(out, what, strlen(what));
        fputs("</td></tr>\n", out);
    }
    fputs("</tbody>\n</table>\n", out);
}

static void write_form(FILE *out, Arena *arena, const DocEntry *entry, const DocForm *form)
{
    fputs("<pre class=\"signature\"><code>", out);
    escape_all(out, signature(arena, entry, form));
    fputs("</code></pre>\n", out);
    const DocExample *example = form->examples;
    write_text(out, form->doc, entry, &example);
    if (form->later) fputs("<p class=\"later\">Not in this version yet.</p>\n", out);
    if (has_table(form)) write_table(out, arena, form);
    for (; example; example = example->next) { // those that stand in no text
        if (!example->made_up || example->png) write_example(out, entry, example);
    }
}

static void write_entry(FILE *out, Arena *arena, const DocEntry *entry, const DocEntry *again)
{
    fputs("<section>\n<h3 id=\"", out);
    escape_all(out, entry->name);
    if (again) fprintf(out, "-%s", entry->kind); // a name of two kinds
    fputs("\">", out);
    escape_all(out, entry->name);
    fprintf(out, "<small>%s</small><a class=\"self\" href=\"#%s%s%s\" aria-label=\"Link to %s\">#</a></h3>\n",
            entry->kind, entry->name, again ? "-" : "", again ? entry->kind : "", entry->name);
    for (const DocForm *form = entry->forms; form; form = form->next) write_form(out, arena, entry, form);
    fputs("</section>\n", out);
}

// The entry before this one that has its name, or NULL.
static const DocEntry *entry_before(const Doc *doc, const DocEntry *entry)
{
    for (const DocGroup *group = doc->groups; group; group = group->next) {
        for (const DocEntry *each = group->entries; each; each = each->next) {
            if (each == entry) return NULL;
            if (!strcmp(each->name, entry->name)) return each;
        }
    }
    return NULL;
}

static void write_index(FILE *out, const Doc *doc)
{
    fputs("<nav aria-label=\"Index\">\n", out);
    for (const DocGroup *group = doc->groups; group; group = group->next) {
        if (!group->entries) continue;
        fprintf(out, "<p>%s</p>\n<ul>\n", group->title);
        for (const DocEntry *entry = group->entries; entry; entry = entry->next) {
            bool again = entry_before(doc, entry);
            fprintf(out, "<li><a href=\"#%s%s%s\">%s</a></li>\n", entry->name, again ? "-" : "",
                    again ? entry->kind : "", entry->name);
        }
        fputs("</ul>\n", out);
    }
    fputs("</nav>\n", out);
}

void doc_write_html(const Doc *doc, FILE *out)
{
    Arena scratch = {0};
    fputs("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
          "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"generator\" "
          "content=\"scn " SCN_VERSION "\">\n<title>",
          out);
    escape_all(out, doc->title);
    fprintf(out, "</title>\n<style>\n%s</style>\n</head>\n<body>\n<main>\n<h1>", style);
    escape_all(out, doc->title);
    fputs("</h1>\n", out);
    const DocExample *none = NULL;
    write_text(out, doc->intro, NULL, &none);
    write_index(out, doc);
    for (const DocGroup *group = doc->groups; group; group = group->next) {
        if (!group->entries) continue;
        fprintf(out, "<h2>%s</h2>\n", group->title);
        write_text(out, group->intro, NULL, &none);
        for (const DocEntry *entry = group->entries; entry; entry = entry->next)
            write_entry(out, &scratch, entry, entry_before(doc, entry));
    }
    fputs("</main>\n</body>\n</html>\n", out);
    arena_release(&scratch);
}

// --- Markdown

void doc_picture_name(char *text, size_t size, const char *stem, const char *entry, int k)
{
    snprintf(text, size, "%s-%s-%d.png", stem, entry, k);
}

// In a table `|` would end a cell and a line end the table.
static void write_cell(FILE *out, const char *text, bool code)
{
    if (code && *text) fputc('`', out);
    for (; *text; text++) {
        if (*text == '|') fputc('\\', out);
        fputc(*text == '\n' ? ' ' : *text, out);
        if (code && !text[1]) fputc('`', out);
    }
    fputs(" | ", out);
}

static void write_markdown_table(FILE *out, Arena *arena, const DocForm *form)
{
    bool ranged = has_range(form);
    fprintf(out, "| parameter | type | default |%s |\n| --- | --- | --- |%s --- |\n", ranged ? " range |" : "",
            ranged ? " --- |" : "");
    for (const DocParameter *p = form->parameters; p; p = p->next) {
        fputs("| ", out);
        write_cell(out, p->name, true);
        const char *unit = unit_of(p->type);
        write_cell(out, arena_printf(arena, "`%s`%s%s", p->type, *unit ? " " : "", unit), false);
        write_cell(out, p->initial ? p->initial : p->optional ? "may be left out" : "needed", p->initial != NULL);
        if (ranged) write_cell(out, p->range ? p->range : "", true);
        const char *what = what_of(arena, p);
        for (; *what; what++) fputc(*what == '\n' ? ' ' : *what, out);
        fputs(" |\n", out);
    }
    fputc('\n', out);
}

static void write_picture(FILE *out, const char *stem, const DocEntry *entry, const DocExample *example, int k)
{
    char name[512];
    if (!example->png) return;
    doc_picture_name(name, sizeof name, stem, entry->name, k);
    fprintf(out, "![%s](%s)\n\n", entry->name, name);
}

// The text, with each example's picture behind it. `k` counts the examples of the word.
static void write_markdown_text(FILE *out, const char *stem, const DocEntry *entry, const DocForm *form, int *k)
{
    const DocExample *example = form->examples;
    for (const char *text = form->doc; text && *text;) {
        const char *fence = strstr(text, "```scn\n"), *end = fence ? strstr(fence + 7, "```") : NULL;
        if (end) end += 3;
        size_t length = end ? (size_t)(end - text) : strlen(text);
        fprintf(out, "%.*s\n\n", (int)length, text);
        text += length;
        text += strspn(text, "\n");
        if (!fence || !example) continue;
        write_picture(out, stem, entry, example, ++*k);
        example = example->next;
    }
    for (; example; example = example->next) {
        ++*k;
        if (example->made_up && !example->png) continue;
        size_t length = strlen(example->shown);
        fprintf(out, "```scn\n%s%s```\n\n", example->shown, length && example->shown[length - 1] == '\n' ? "" : "\n");
        write_picture(out, stem, entry, example, *k);
    }
}

void doc_write_markdown(const Doc *doc, const char *stem, FILE *out)
{
    Arena scratch = {0};
    fprintf(out, "# %s\n\n", doc->title);
    if (doc->intro) fprintf(out, "%s\n\n", doc->intro);
    for (const DocGroup *group = doc->groups; group; group = group->next) {
        if (!group->entries) continue;
        fprintf(out, "**%s:**", group->title);
        for (const DocEntry *entry = group->entries; entry; entry = entry->next)
            fprintf(out, " [`%s`](#%s)%s", entry->name, entry->name, entry->next ? "," : "\n\n");
    }
    for (const DocGroup *group = doc->groups; group; group = group->next) {
        if (!group->entries) continue;
        fprintf(out, "## %s\n\n", group->title);
        if (group->intro) fprintf(out, "%s\n\n", group->intro);
        for (const DocEntry *entry = group->entries; entry; entry = entry->next) {
            int k = 0;
            fprintf(out, "### %s\n\n", entry->name);
            for (const DocForm *form = entry->forms; form; form = form->next) {
                fprintf(out, "```text\n%s\n```\n\n", signature(&scratch, entry, form));
                write_markdown_text(out, stem, entry, form, &k);
                if (form->later) fputs("Not in this version yet.\n\n", out);
                if (has_table(form)) write_markdown_table(out, &scratch, form);
            }
        }
    }
    arena_release(&scratch);
}
