// Random programs through the formatter: scenes without a mistake, from random trees, printed with random space, line breaks and comments.
//
//     random-programs [COUNT [FIRST]]      seeds FIRST (1) to FIRST + COUNT - 1 (10000 of them)
//
// Of each: the formatted text holds the same comments in the same order, formatted again it stays as it is, and it compiles to the same IR,
// character by character. The suite runs a few hundred; `./dev fuzz` runs 10,000. A program that fails is printed with its seed.
//
// Trees are typed, so that every program compiles: a make_TYPE() function prints an expression of its type from what is in scope. Names are
// declared before they are used, and no name twice. Comments are numbered; what is compared is their text without the space around.
#include <ctype.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/compile.h"
#include "lang/ast.h"
#include "lang/format.h"

typedef enum NameType { NAME_SCALAR, NAME_VECTOR, NAME_OBJECT, NAME_MATERIAL, NAME_FN, NAME_TAG, NAME_TYPES } NameType;

enum { NAMES = 200 };

typedef struct Maker {
    uint64_t random;
    FILE *out;
    char *text;
    size_t length;
    char last;  // the last character that was printed
    int depth;  // of the tree
    int budget; // of nodes: what remains is made small when it is used up
    bool plain; // in a header, where a { would open its body
    int names[NAME_TYPES][NAMES], counts[NAME_TYPES];
    int made, comments;
} Maker;

static uint32_t pick(Maker *m, uint32_t below)
{
    m->random += UINT64_C(0x9e3779b97f4a7c15);
    uint64_t z = m->random;
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return (uint32_t)((z ^ (z >> 31)) % below);
}

// --- Words and what stands between them

static void put(Maker *m, const char *text)
{
    if (!*text) return;
    fputs(text, m->out);
    m->last = text[strlen(text) - 1];
}

static void putf(Maker *m, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void putf(Maker *m, const char *format, ...)
{
    char text[200];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    put(m, text);
}

static void gap(Maker *m)
{
    static const char *const spaces[] = {" ", "  ", "\n", "\n\n", "\n\n\n\n", "\t", " \n ", "\r\n"};
    if (pick(m, 4)) return;
    if (m->last == '/') put(m, " ");
    put(m, spaces[pick(m, 8)]);
    if (pick(m, 5)) return;
    int n = ++m->comments;
    switch (pick(m, 5)) {
    case 0: putf(m, "// %d\n", n); break;
    case 1: putf(m, "//%d: a longer remark, with \"marks\" ; } in it  \n", n); break;
    case 2: putf(m, "/* %d */", n); break;
    case 3: putf(m, "/* %d\n      over lines  \n*/", n); break;
    default: putf(m, "/*%d /* nested */ */", n); break;
    }
    put(m, spaces[pick(m, 8)]);
}

static void word(Maker *m, const char *text)
{
    gap(m);
    bool joins = (isalnum((unsigned char)m->last) || m->last == '_') && (isalnum((unsigned char)*text) || *text == '_');
    bool comment = (m->last == '/' && (*text == '/' || *text == '*'));
    if (joins || comment) put(m, " ");
    put(m, text);
}

static void words(Maker *m, const char *text) // each character a mark
{
    for (; *text; text++) word(m, (char[]){*text, 0});
}

static void name(Maker *m, int number)
{
    char text[20];
    snprintf(text, sizeof text, "n%d", number);
    word(m, text);
}

static int new_name(Maker *m)
{
    int number = ++m->made;
    name(m, number);
    return number;
}

static void declare(Maker *m, NameType type, int number)
{
    if (m->counts[type] < NAMES) m->names[type][m->counts[type]++] = number;
}

static bool use(Maker *m, NameType type)
{
    if (!m->counts[type]) return false;
    name(m, m->names[type][pick(m, (uint32_t)m->counts[type])]);
    return true;
}

static bool small(Maker *m)
{
    return m->depth > 7 || m->budget-- <= 0;
}

// --- Numbers

static void make_scalar(Maker *m);
static void make_object(Maker *m);
static void make_vector(Maker *m);

static void make_positive(Maker *m)
{
    static const char *const numbers[] = {"1", "0.5", "2.25", "0.125", "3", "1e-1"};
    word(m, numbers[pick(m, 6)]);
}

static void make_angle(Maker *m)
{
    static const char *const angles[] = {"90deg", "1.5rad", "0.25turn", "-30deg"};
    word(m, angles[pick(m, 4)]);
    if (pick(m, 4)) return;
    words(m, "*");
    words(m, "(");
    word(m, "time");
    words(m, "/");
    word(m, "1s");
    words(m, ")");
}

static void make_condition(Maker *m)
{
    static const char *const operators[] = {"<", "<=", ">", ">="};
    if (pick(m, 5) == 0) word(m, "not");
    if (pick(m, 6) == 0) {
        word(m, pick(m, 2) ? "true" : "false");
        return;
    }
    make_positive(m);
    word(m, operators[pick(m, 4)]);
    make_positive(m);
    if (pick(m, 4)) return;
    word(m, pick(m, 2) ? "and" : "or");
    make_condition(m);
}

static void make_if(Maker *m, void (*make)(Maker *))
{
    word(m, "if");
    bool plain = m->plain;
    m->plain = true;
    make_condition(m);
    m->plain = plain;
    words(m, "{");
    make(m);
    words(m, "}");
    word(m, "else");
    if (pick(m, 4) == 0) {
        make_if(m, make);
        return;
    }
    words(m, "{");
    make(m);
    words(m, "}");
}

static void make_call(Maker *m, const char *what, int count)
{
    word(m, what);
    words(m, "(");
    for (int i = 0; i < count; i++) {
        if (i) words(m, ",");
        make_scalar(m);
    }
    if (pick(m, 4) == 0) words(m, ",");
    words(m, ")");
}

static void make_scalar(Maker *m)
{
    static const char *const operators[] = {"+", "-", "*"};
    if (small(m)) {
        make_positive(m);
        return;
    }
    m->depth++;
    switch (pick(m, 14)) {
    case 0:
    case 1:
        make_scalar(m);
        word(m, operators[pick(m, 3)]);
        make_scalar(m);
        break;
    case 2:
        make_scalar(m);
        words(m, "/");
        make_positive(m);
        break;
    case 3:
        words(m, "-(");
        make_scalar(m);
        words(m, ")");
        break;
    case 4:
        if (!use(m, NAME_SCALAR)) make_positive(m);
        break;
    case 5: make_call(m, "min", 2 + (int)pick(m, 9)); break;
    case 6:
        word(m, "sin");
        words(m, "(");
        make_angle(m);
        words(m, ")");
        break;
    case 7:
        words(m, "(");
        make_vector(m);
        words(m, ").");
        word(m, "y");
        break;
    case 8:
        words(m, "[");
        make_scalar(m);
        words(m, ",");
        make_scalar(m);
        words(m, "]");
        words(m, "[");
        word(m, pick(m, 2) ? "0" : "1");
        words(m, "]");
        break;
    case 9:
        if (use(m, NAME_FN)) {
            words(m, "(");
            make_scalar(m);
            words(m, ")");
        } else {
            make_positive(m);
        }
        break;
    case 10:
        make_positive(m);
        words(m, "^");
        word(m, "2");
        break;
    case 11:
        if (m->plain) {
            make_positive(m);
            break;
        }
        words(m, "(");
        make_if(m, make_scalar);
        words(m, ")");
        break;
    default: make_positive(m); break;
    }
    m->depth--;
}

static void make_vector(Maker *m)
{
    if (pick(m, 4) == 0 && use(m, NAME_VECTOR)) return;
    words(m, "(");
    make_scalar(m);
    words(m, ",");
    make_scalar(m);
    words(m, ",");
    make_scalar(m);
    words(m, ")");
}

// --- Objects

static void make_shape(Maker *m)
{
    static const char *const shapes[] = {"sphere", "box", "ellipsoid"};
    uint32_t which = pick(m, 4);
    if (which == 3) {
        word(m, "cylinder");
        words(m, "(");
        word(m, "radius");
        words(m, ":");
        make_positive(m);
        words(m, ",");
        word(m, "height");
        words(m, ":");
        make_positive(m);
        words(m, ")");
        return;
    }
    word(m, shapes[which]);
    words(m, "(");
    make_positive(m);
    if (which && pick(m, 2)) {
        words(m, ",");
        make_positive(m);
    }
    words(m, ")");
}

static void make_link(Maker *m)
{
    words(m, ".");
    switch (pick(m, 6)) {
    case 0:
        word(m, "move");
        words(m, "(");
        make_vector(m);
        words(m, ")");
        break;
    case 1:
        word(m, "move");
        words(m, "(");
        word(m, "x");
        words(m, ":");
        make_scalar(m);
        words(m, ")");
        break;
    case 2:
        word(m, "rotate");
        words(m, "(");
        word(m, "y");
        words(m, ":");
        make_angle(m);
        words(m, ")");
        break;
    case 3:
        word(m, "scale");
        words(m, "(");
        make_positive(m);
        words(m, ")");
        break;
    case 4:
        word(m, "named");
        words(m, "(");
        word(m, pick(m, 2) ? "\"part {1 + 1}\"" : "\"a // name\"");
        words(m, ")");
        break;
    default:
        word(m, "paint");
        words(m, "(");
        if (!use(m, NAME_MATERIAL)) word(m, "#c8814b");
        words(m, ")");
        break;
    }
}

static void make_items(Maker *m, int least);

static void make_block(Maker *m, int least)
{
    int counts[NAME_TYPES];
    bool plain = m->plain;
    m->plain = false;
    memcpy(counts, m->counts, sizeof counts);
    words(m, "{");
    make_items(m, least);
    words(m, "}");
    memcpy(m->counts, counts, sizeof counts);
    m->plain = plain;
}

static void make_freeform(Maker *m)
{
    word(m, "freeform");
    words(m, "(");
    make_object(m);
    words(m, ")");
    words(m, "{");
    for (uint32_t count = 1 + pick(m, 3); count; count--) {
        word(m, "perturb");
        words(m, "(");
        word(m, "sphere");
        words(m, "(");
        make_positive(m);
        words(m, ").");
        word(m, "move");
        words(m, "(");
        make_vector(m);
        words(m, "),");
        word(m, "strength");
        words(m, ":");
        make_scalar(m);
        words(m, ")");
        if (count > 1 || pick(m, 2)) words(m, ";");
    }
    words(m, "}");
}

static void make_list(Maker *m)
{
    bool loose = pick(m, 2);
    word(m, "union");
    words(m, loose ? "(" : "([");
    for (uint32_t count = 1 + pick(m, 4); count; count--) {
        make_object(m);
        if (count > 1 || pick(m, 3) == 0) words(m, ",");
    }
    words(m, loose ? ")" : "])");
}

static void make_primary(Maker *m)
{
    static const char *const sets[] = {"union", "subtract", "intersect"};
    if (small(m)) {
        make_shape(m);
        return;
    }
    m->depth++;
    switch (pick(m, 10)) {
    case 0:
        words(m, "(");
        make_object(m);
        words(m, ")");
        break;
    case 1:
        word(m, sets[pick(m, 3)]);
        make_block(m, 1);
        break;
    case 2: make_list(m); break;
    case 3: make_freeform(m); break;
    case 4:
        words(m, "(");
        make_if(m, make_object);
        words(m, ")");
        break;
    case 5:
        if (!use(m, NAME_OBJECT)) make_shape(m);
        break;
    case 6:
        if (use(m, NAME_TAG)) {
            words(m, "(");
            word(m, "size");
            words(m, ":");
            make_positive(m);
            words(m, ")");
        } else {
            make_shape(m);
        }
        break;
    default: make_shape(m); break;
    }
    m->depth--;
}

static void make_object(Maker *m)
{
    static const char *const operators[] = {"|", "-", "&"};
    m->depth++;
    make_primary(m);
    for (uint32_t links = pick(m, 3) ? 0 : 1 + pick(m, 5); links; links--) make_link(m);
    if (!small(m) && pick(m, 4) == 0) {
        word(m, operators[pick(m, 3)]);
        make_object(m);
    }
    m->depth--;
}

// --- Items

static void make_let(Maker *m)
{
    word(m, "let");
    int number = new_name(m);
    words(m, "=");
    bool vector = pick(m, 3) == 0;
    if (vector)
        make_vector(m);
    else
        make_scalar(m);
    words(m, ";");
    declare(m, vector ? NAME_VECTOR : NAME_SCALAR, number);
}

static void make_for(Maker *m)
{
    word(m, "for");
    int number = new_name(m);
    word(m, "in");
    word(m, "0");
    word(m, "..");
    word(m, pick(m, 2) ? "2" : "3");
    int counts[NAME_TYPES];
    memcpy(counts, m->counts, sizeof counts);
    declare(m, NAME_SCALAR, number);
    make_block(m, 1);
    memcpy(m->counts, counts, sizeof counts);
}

static void make_items(Maker *m, int least)
{
    int count = small(m) ? least : least + (int)pick(m, 4);
    for (int i = 0; i < count; i++) {
        if (pick(m, 4) == 0) make_let(m);
        if (i && pick(m, 6) == 0) {
            m->depth += 2;
            make_for(m);
            m->depth -= 2;
            continue;
        }
        if (pick(m, 8) == 0) {
            word(m, "object");
            int number = new_name(m);
            words(m, "=");
            make_object(m);
            words(m, ";");
            declare(m, NAME_OBJECT, number);
        }
        make_object(m);
        words(m, ";");
        if (pick(m, 12) == 0) words(m, ";");
    }
}

static void make_thing(Maker *m)
{
    static const char *const kinds[] = {"camera", "light"};
    static const char *const entries[] = {"eye: (1, 2, 8); fov: 35deg", "direction: (-1, -1, -1); color: #fff"};
    uint32_t which = pick(m, 2);
    word(m, kinds[which]);
    new_name(m);
    words(m, "{");
    word(m, entries[which]);
    if (pick(m, 2)) words(m, ";");
    words(m, "}");
}

static void make_definition(Maker *m)
{
    bool tag = pick(m, 2);
    word(m, tag ? "tag" : "fn");
    int number = new_name(m), counts[NAME_TYPES];
    memcpy(counts, m->counts, sizeof counts);
    words(m, "(");
    if (tag) {
        word(m, "size");
        words(m, ":");
        word(m, "scalar");
        words(m, "=");
        make_positive(m);
        words(m, ")");
        if (pick(m, 2)) word(m, "->"), word(m, "object");
        make_block(m, 1);
    } else {
        int parameter = new_name(m);
        words(m, ":");
        word(m, "scalar");
        if (pick(m, 3) == 0) words(m, ",");
        words(m, ")");
        word(m, "->");
        word(m, "scalar");
        declare(m, NAME_SCALAR, parameter);
        words(m, "{");
        if (pick(m, 3) == 0) make_let(m);
        make_scalar(m);
        words(m, "}");
    }
    memcpy(m->counts, counts, sizeof counts);
    declare(m, tag ? NAME_TAG : NAME_FN, number);
}

static void make_file_item(Maker *m)
{
    m->depth = 0;
    if (pick(m, 6) == 0) putf(m, "\n/// %d: what it is\n", ++m->comments);
    int number;
    switch (pick(m, 7)) {
    case 0:
        word(m, "param");
        number = new_name(m);
        words(m, ":");
        word(m, "scalar");
        words(m, "=");
        make_positive(m);
        if (pick(m, 2)) word(m, "in"), word(m, "0"), word(m, ".."), word(m, "9");
        words(m, ";");
        declare(m, NAME_SCALAR, number);
        break;
    case 1:
        word(m, "material");
        number = new_name(m);
        words(m, "{");
        word(m, "color: #123456; specular: 0.25; shininess: 60");
        words(m, ";}");
        declare(m, NAME_MATERIAL, number);
        break;
    case 2: make_let(m); break;
    case 3: make_definition(m); break;
    case 4: make_thing(m); break;
    case 5:
        word(m, "assert");
        make_positive(m);
        words(m, ">");
        word(m, "0");
        words(m, ",");
        word(m, "\"it is {1 + 1}, not {0}\"");
        words(m, ";");
        break;
    default:
        word(m, "object");
        number = new_name(m);
        words(m, "=");
        make_object(m);
        words(m, ";");
        declare(m, NAME_OBJECT, number);
        break;
    }
}

static void make_program(Maker *m, uint64_t seed)
{
    *m = (Maker){.random = seed * UINT64_C(0xd1342543de82ef95), .last = '\n'};
    m->out = open_memstream(&m->text, &m->length);
    if (!m->out) abort();
    m->budget = 30 + (int)pick(m, 150);
    if (pick(m, 2)) put(m, "scn 1;");
    for (uint32_t count = pick(m, 8); count; count--) make_file_item(m);
    m->depth = 0;
    bool scene = pick(m, 2);
    if (scene) word(m, "scene"), words(m, "{");
    make_items(m, 1);
    if (scene) words(m, "}");
    gap(m);
    fclose(m->out);
}

// --- What is compared

// The next comment from `text` on, without space at the ends of its lines. NULL: there is none. The caller frees it.
static char *next_comment(const char **text)
{
    const char *c = *text;
    while (*c && !(c[0] == '/' && (c[1] == '/' || c[1] == '*'))) {
        if (*c == '"') {
            for (c++; *c != '"'; c++) c += *c == '\\';
        }
        c++;
    }
    if (!*c) return NULL;
    const char *begin = c;
    int depth = 0;
    if (c[1] == '/') {
        c += strcspn(c, "\n");
    } else {
        do {
            if (c[0] == '/' && c[1] == '*')
                depth++, c++;
            else if (c[0] == '*' && c[1] == '/')
                depth--, c++;
            c++;
        } while (depth);
    }
    *text = c;
    char *comment = malloc((size_t)(c - begin) + 1), *end = comment;
    if (!comment) abort();
    for (; begin < c; begin++) {
        if (*begin == '\n') {
            while (end > comment && strchr(" \t\r", end[-1])) end--;
        }
        *end++ = *begin;
    }
    while (end > comment && strchr(" \t\r", end[-1])) end--;
    *end = 0;
    return comment;
}

static bool same_comments(const char *before, const char *after)
{
    bool same = true, more = true;
    while (same && more) {
        char *a = next_comment(&before), *b = next_comment(&after);
        same = (!a && !b) || (a && b && strcmp(a, b) == 0);
        more = a != NULL;
        free(a);
        free(b);
    }
    return same;
}

static char *formatted(const char *text)
{
    Unit unit;
    unit_init(&unit);
    const Source *source = source_add(&unit.sources, "random.scn", text, strlen(text), (Span){0});
    parse_source(&unit, source);
    diag_print(&unit, stderr, false);
    size_t length;
    const char *result = unit.errors ? NULL : format_source(&unit, source, &(FormatOptions){0}, &length);
    char *copy = result ? strdup(result) : NULL;
    unit_release(&unit);
    return copy;
}

static char *ir_text(const char *text)
{
    Unit unit;
    unit_init(&unit);
    const Source *source = source_add(&unit.sources, "random.scn", text, strlen(text), (Span){0});
    char *ir = NULL;
    size_t length;
    FILE *out = open_memstream(&ir, &length);
    if (!out) abort();
    compile(&unit, source, &(CompileOptions){.dump_ir = out});
    fclose(out);
    if (unit.errors) {
        diag_print(&unit, stderr, false);
        free(ir);
        ir = NULL;
    }
    unit_release(&unit);
    return ir;
}

static const char *what_is_wrong(const char *text)
{
    char *once = formatted(text), *twice = once ? formatted(once) : NULL;
    char *before = ir_text(text), *after = once ? ir_text(once) : NULL;
    const char *wrong = NULL;
    if (!before)
        wrong = "the program does not compile: a mistake of this test";
    else if (!once || !twice)
        wrong = "it is not formatted";
    else if (strcmp(once, twice) != 0)
        wrong = "formatting it twice changes it";
    else if (!same_comments(text, once))
        wrong = "its comments are others";
    else if (!after || strcmp(before, after) != 0)
        wrong = "its IR is another";
    if (wrong)
        fprintf(stderr, "--- program:\n%s\n--- formatted:\n%s\n--- twice:\n%s\n", text, once ? once : "",
                twice ? twice : "");
    free(once);
    free(twice);
    free(before);
    free(after);
    return wrong;
}

int main(int argc, char **argv)
{
    unsigned long count = argc > 1 ? strtoul(argv[1], NULL, 10) : 10000,
                  first = argc > 2 ? strtoul(argv[2], NULL, 10) : 1;
    unsigned long long bytes = 0, comments = 0;
    for (unsigned long seed = first; seed < first + count; seed++) {
        Maker maker;
        make_program(&maker, seed);
        const char *wrong = what_is_wrong(maker.text);
        bytes += maker.length;
        comments += (unsigned long long)maker.comments;
        free(maker.text);
        if (!wrong) continue;
        fprintf(stderr, "random-programs: seed %lu: %s\n", seed, wrong);
        return 1;
    }
    printf("%lu programs of %llu bytes with %llu comments: the same IR, the same comments, formatted once for all\n",
           count, bytes, comments);
    return 0;
}
