// The formatter: what the goldens of tests/fmt do not show one by one. Random programs come from a generator that writes random trees as
// text, with any space and any comments between the words. Formatted, each must be the same tree with the same comments (which
// format_source() itself tests), and formatting it again must change nothing.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "lang/ast.h"
#include "lang/format.h"

// --- Formatting

// cmocka cuts long messages.
#define fail_with(what, text)                                                                                          \
    do {                                                                                                               \
        fprintf(stderr, "%s:\n%s\n", what, text);                                                                      \
        fail_msg("%s", what);                                                                                          \
    } while (0)

// The formatted text, in the unit's arena. Fails the test where the text is wrong or would become another scene.
static const char *formatted_lines(Unit *unit, const char *text, uint32_t first, uint32_t last)
{
    unit_init(unit);
    const char *copy = arena_text(&unit->arena, text, strlen(text)); // sources of several units may be the same text
    const Source *source = source_add(&unit->sources, "test.scn", copy, strlen(copy), (Span){0});
    parse_source(unit, source);
    if (unit->errors) {
        diag_print(unit, stderr, false);
        fail_with("this is no scene", text);
    }
    size_t length;
    const char *result = format_source(unit, source, &(FormatOptions){first, last}, &length);
    if (!result) fail_with("formatted, this is another scene", text);
    assert_int_equal(strlen(result), length);
    return result;
}

static void expect(const char *text, const char *wanted)
{
    Unit unit, again;
    assert_string_equal(formatted_lines(&unit, text, 0, 0), wanted);
    assert_string_equal(formatted_lines(&again, wanted, 0, 0), wanted);
    unit_release(&again);
    unit_release(&unit);
}

static void expect_lines(uint32_t first, uint32_t last, const char *text, const char *wanted)
{
    Unit unit;
    assert_string_equal(formatted_lines(&unit, text, first, last), wanted);
    unit_release(&unit);
}

// --- Single rules

static void an_empty_file_stays_empty(void **state)
{
    expect("", "");
    expect("\n\n \n", "");
    expect("// nothing", "// nothing\n");
    expect("\xEF\xBB\xBFsphere(1);", "sphere(1);\n");
    expect("a;\r\nb;\r\n", "a;\nb;\n");
}

static void space_stands_around_operators_but_powers(void **state)
{
    expect("let a=-b^2*(c+~d)-e[1].x;", "let a = -b^2 * (c + ~d) - e[1].x;\n");
    expect("let a=b..c;let d=not e and f<=g or h;", "let a = b .. c;\nlet d = not e and f <= g or h;\n");
    expect("let a=[-1,- -2,2^-x];", "let a = [-1, --2, 2^-x];\n");
    expect("print(a),[b],{c};", "print (a), [b], { c };\n");
    expect("fn f(a:[object])->[scalar]{a[0]}", "fn f(a: [object]) -> [scalar] { a[0] }\n");
}

static void semicolons_that_end_nothing_go(void **state)
{
    expect(";;a;;b;", "a;\nb;\n");
    expect("light key { color: #fff };", "light key { color: #fff; }\n");
    expect("union { a };", "union { a; }\n");
    expect("for i in 0..3 { a };-b;", "for i in 0 .. 3 { a };\n-b;\n");
    expect("let a = union { b; }", "let a = union { b; };\n");
}

static void a_result_may_do_without_a_semicolon(void **state)
{
    expect("fn f() { let a = 1; a }", "fn f() { let a = 1; a }\n");
    expect("fn f() { let a = 1; a; }", "fn f() { let a = 1; a; }\n");
    expect("tool t() { if a { b } else { c } }", "tool t() { if a { b } else { c } }\n");
}

static void comments_stay_where_they_were_written(void **state)
{
    expect("a; // one\n\n\n// two\nb; /* three */ c;", "a;  // one\n\n// two\nb; /* three */\nc;\n");
    expect("f(a, // first\nb /* second */, c);", "f(\n    a,  // first\n    b /* second */, c,\n);\n");
    expect("let a = // why\n3;", "let a =  // why\n    3;\n");
    expect("union { // all\na; }", "union {  // all\n    a;\n}\n");
    expect("union {\n// nothing\n}", "union {\n    // nothing\n}\n");
    expect("union { a; // last\n}", "union {\n    a;  // last\n}\n");
    expect("{ /* c */ }", "{ /* c */ }\n");
}

static void comments_of_neighbouring_lines_begin_in_one_column(void **state)
{
    expect("let a = 1; // one\nlet long = 2; // two\n\nlet b = 3; // three\n",
           "let a = 1;     // one\nlet long = 2;  // two\n\nlet b = 3;  // three\n");
}

static void a_range_of_lines_leaves_the_rest(void **state)
{
    const char *text = "let  a=1;\nlet  b=2;\nlet  c=3;\n";
    expect_lines(2, 2, text, "let  a=1;\nlet b = 2;\nlet  c=3;\n");
    expect_lines(1, 2, text, "let a = 1;\nlet b = 2;\nlet  c=3;\n");
    expect_lines(3, 9, text, "let  a=1;\nlet  b=2;\nlet c = 3;\n");
    expect_lines(9, 9, text, text);
    expect_lines(2, 2, "f(a ,\n  b ,c,\n d ,);;\n", "f(a , b, c,\n d ,);;\n");
}

// --- Random programs

typedef struct Maker {
    uint64_t random;
    char *text;
    size_t length, capacity;
    int depth;
    int budget;   // of what may still grow
    int comments; // how many have been written
    bool plain;   // in the head of an if or for: a { would open its body
    bool calm;    // no comments and line breaks, as inside of a string
} Maker;

static uint32_t pick(Maker *m, uint32_t count)
{
    m->random = m->random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(m->random >> 33) % count;
}

static void add(Maker *m, const char *text)
{
    size_t length = strlen(text);
    if (m->length + length + 1 > m->capacity) {
        m->capacity = (m->length + length + 1) * 2;
        m->text = realloc(m->text, m->capacity);
        assert_non_null(m->text);
    }
    memcpy(m->text + m->length, text, length + 1);
    m->length += length;
}

static void comment(Maker *m)
{
    static const char *const forms[] = {" // c%d \n",    "\n  // c%d\n",
                                        " /* c%d */",    " /* c%d\n  more   \n */ ",
                                        "\n\n/// c%d\n", "\n// %d\xC3\xA9\n\n\n"};
    char text[64];
    snprintf(text, sizeof text, forms[pick(m, 6)], m->comments++);
    add(m, text);
}

// What stands between two words.
static void gap(Maker *m)
{
    if (m->calm) {
        add(m, " ");
        return;
    }
    switch (pick(m, 24)) {
    case 0: add(m, "\n"); break;
    case 1: add(m, "\n\n\n   "); break;
    case 2: add(m, "\t \r\n"); break;
    case 3:
        if (pick(m, 3) == 0) comment(m);
        add(m, " ");
        break;
    default: add(m, " "); break;
    }
}

static void word(Maker *m, const char *text)
{
    add(m, text);
    gap(m);
}

// A mark, which needs no space around it.
static void mark(Maker *m, const char *text)
{
    if (m->length && m->text[m->length - 1] == ' ' && pick(m, 2)) m->text[--m->length] = 0;
    add(m, text);
    if (pick(m, 2) || strlen(text) > 1 || strchr("-~.<>=/*", *text)) gap(m);
}

static const char *name(Maker *m)
{
    static const char *const names[] = {"a", "b2",     "radius",  "object", "a_rather_long_name_for_one_thing",
                                        "x", "sphere", "_private"};
    return names[pick(m, 8)];
}

static void make_expr(Maker *m, int rank);
static void make_block(Maker *m);

static void make_arguments(Maker *m)
{
    mark(m, "(");
    bool plain = m->plain;
    m->plain = false;
    int count = (int)pick(m, 4);
    for (int i = 0; i < count; i++) {
        if (i == count - 1 && pick(m, 3) == 0) {
            word(m, name(m));
            mark(m, ":");
        }
        make_expr(m, 0);
        if (i < count - 1 || pick(m, 5) == 0) mark(m, ",");
    }
    m->plain = plain;
    mark(m, ")");
}

static void make_elements(Maker *m, const char *open, const char *close, int least, int most)
{
    mark(m, open);
    bool plain = m->plain;
    m->plain = false;
    int count = least + (int)pick(m, (uint32_t)(most - least + 1));
    for (int i = 0; i < count; i++) {
        make_expr(m, 0);
        if (i < count - 1 || (count > 1 && pick(m, 5) == 0)) mark(m, ",");
    }
    m->plain = plain;
    mark(m, close);
}

static void make_string(Maker *m)
{
    if (m->calm || pick(m, 2)) {
        word(m, pick(m, 2) ? "\"text \\n \\{\"" : "\"\xE7\x90\x83 // no comment\"");
        return;
    }
    add(m, "\"a {");
    m->calm = true;
    bool plain = m->plain;
    int budget = m->budget;
    m->plain = false;
    m->budget = 2;
    make_expr(m, 6);
    m->plain = plain;
    m->budget = budget;
    m->calm = false;
    add(m, "} b\"");
    gap(m);
}

static void make_if(Maker *m)
{
    bool plain = m->plain;
    word(m, "if");
    m->plain = true;
    make_expr(m, 0);
    m->plain = false;
    make_block(m);
    if (pick(m, 2)) {
        word(m, "else");
        if (pick(m, 3) == 0)
            make_if(m);
        else
            make_block(m);
    }
    m->plain = plain;
}

static void make_simple(Maker *m)
{
    static const char *const simple[] = {"1", "0.5", "1e-3", "90deg", "12f", "#fff", "true", "1.5turn", "123456", "x"};
    word(m, simple[pick(m, 10)]);
}

static void make_primary(Maker *m)
{
    if (m->depth > 6 || m->budget-- <= 0) {
        make_simple(m);
        return;
    }
    m->depth++;
    switch (pick(m, m->plain || m->calm ? 8 : 11)) {
    case 0:
    case 1: make_simple(m); break;
    case 2: word(m, name(m)); break;
    case 3:
        word(m, name(m));
        make_arguments(m);
        break;
    case 4: make_string(m); break;
    case 5: make_elements(m, "(", ")", 2, 3); break;
    case 6: make_elements(m, "[", "]", 0, 12); break;
    case 7: make_elements(m, "(", ")", 1, 1); break;
    case 8:
        word(m, name(m));
        if (pick(m, 2)) make_arguments(m);
        make_block(m);
        break;
    case 9: make_if(m); break;
    default: make_block(m); break;
    }
    m->depth--;
}

static void make_postfix(Maker *m)
{
    if (m->depth > 5 || m->budget <= 0 || pick(m, 4)) {
        make_primary(m);
        return;
    }
    m->depth++;
    if (pick(m, 2)) // a number would take the point for its own
        word(m, name(m));
    else
        make_elements(m, "(", ")", 1, 3);
    for (int links = (int)pick(m, 5); links > 0; links--) {
        if (pick(m, 6) == 0) {
            make_elements(m, "[", "]", 1, 1);
            continue;
        }
        mark(m, ".");
        word(m, name(m));
        if (pick(m, 5)) make_arguments(m);
    }
    m->depth--;
}

// Ranks as in the reference, from the loosest; each operator's right side is one rank tighter.
static void make_expr(Maker *m, int rank)
{
    static const char *const operators[][3] = {{"or"}, {"and"}, {NULL},     {"==", "<=", ">"}, {".."},
                                               {"|"},  {"&"},   {"+", "-"}, {"*", "/"}};
    enum { NOT = 2, COMPARE = 3, RANGE = 4, UNARY = 9 };
    if (rank == UNARY) {
        if (pick(m, 8) == 0) mark(m, pick(m, 2) ? "-" : "~");
        make_postfix(m);
        if (pick(m, 12) == 0) {
            mark(m, "^");
            make_simple(m);
        }
        return;
    }
    if (rank == NOT) {
        if (pick(m, 12) == 0) word(m, "not");
        make_expr(m, rank + 1);
        return;
    }
    make_expr(m, rank + 1);
    bool once = rank == COMPARE || rank == RANGE;
    for (int count = pick(m, 9) || m->budget <= 0 ? 0 : once ? 1 : 1 + (int)pick(m, 3); count > 0; count--) {
        int which = operators[rank][2] ? (int)pick(m, 3) : operators[rank][1] ? (int)pick(m, 2) : 0;
        gap(m);
        mark(m, operators[rank][which]);
        gap(m);
        make_expr(m, rank + 1);
    }
}

static void end_item(Maker *m)
{
    mark(m, ";");
    if (pick(m, 12) == 0) mark(m, ";");
}

static void make_parameters(Maker *m)
{
    mark(m, "(");
    int count = (int)pick(m, 4);
    for (int i = 0; i < count; i++) {
        word(m, name(m));
        mark(m, ":");
        if (pick(m, 4))
            word(m, "scalar");
        else
            word(m, "[object]");
        if (pick(m, 2)) {
            mark(m, "=");
            make_expr(m, 0);
        }
        if (pick(m, 4) == 0) {
            word(m, "in");
            make_simple(m);
            mark(m, "..");
            make_simple(m);
        }
        if (i < count - 1 || pick(m, 4) == 0) mark(m, ",");
    }
    mark(m, ")");
}

static void make_item(Maker *m)
{
    switch (pick(m, 9)) {
    case 0:
        word(m, "let");
        word(m, name(m));
        mark(m, "=");
        make_expr(m, 0);
        end_item(m);
        break;
    case 1:
        word(m, name(m));
        mark(m, ":");
        make_expr(m, 0);
        if (pick(m, 4) == 0 && m->text[m->length - 1] == ' ' && !strchr("}\n\t", m->text[m->length - 2]))
            word(m, "smooth");
        end_item(m);
        break;
    case 2:
        word(m, "object");
        word(m, name(m));
        mark(m, "=");
        make_expr(m, 0);
        end_item(m);
        break;
    case 3:
        word(m, "light");
        word(m, name(m));
        make_block(m);
        if (pick(m, 4) == 0) end_item(m);
        break;
    case 4:
        word(m, "for");
        word(m, name(m));
        word(m, "in");
        m->plain = true;
        make_expr(m, 0);
        m->plain = false;
        make_block(m);
        break;
    case 5:
        word(m, "assert");
        make_expr(m, 0);
        mark(m, ",");
        make_string(m);
        end_item(m);
        break;
    case 6:
        word(m, "print");
        make_expr(m, 0);
        mark(m, ",");
        make_expr(m, 0);
        end_item(m);
        break;
    default:
        make_expr(m, 0);
        end_item(m);
        break;
    }
}

static void make_block(Maker *m)
{
    bool plain = m->plain;
    m->plain = false;
    m->depth++;
    mark(m, "{");
    for (int count = m->depth > 6 || m->budget <= 0 ? 0 : (int)pick(m, 4); count > 0; count--) make_item(m);
    if (pick(m, 3) == 0) make_simple(m); // a result
    mark(m, "}");
    m->depth--;
    m->plain = plain;
}

static void make_file_item(Maker *m)
{
    switch (pick(m, 8)) {
    case 0:
        word(m, "include");
        word(m, "\"parts/eye.scn\"");
        end_item(m);
        break;
    case 1:
        word(m, "use");
        word(m, "brushes");
        mark(m, ":");
        word(m, "dent");
        mark(m, ",");
        word(m, "bump");
        end_item(m);
        break;
    case 2:
        word(m, "param");
        word(m, name(m));
        mark(m, ":");
        word(m, "scalar");
        mark(m, "=");
        make_simple(m);
        end_item(m);
        break;
    case 3: {
        static const char *const words[] = {"fn", "tag", "tool"};
        uint32_t which = pick(m, 3);
        word(m, words[which]);
        word(m, name(m));
        make_parameters(m);
        if (which < 2 && pick(m, 2)) {
            mark(m, "->");
            word(m, pick(m, 2) ? "object" : "[scalar]");
        }
        make_block(m);
        break;
    }
    default: make_item(m); break;
    }
}

static void make_program(Maker *m, uint64_t seed)
{
    *m = (Maker){.random = seed * UINT64_C(0x9E3779B97F4A7C15) + 1};
    m->budget = 4 + (int)pick(m, 30);
    add(m, "");
    if (pick(m, 3) == 0) add(m, "/// The file.\n\n");
    for (int count = 1 + (int)pick(m, 6); count > 0; count--) make_file_item(m);
}

static void no_line_ends_in_space(const char *text)
{
    for (const char *line = text; *line; line = strchr(line, '\n') + 1) {
        assert_non_null(strchr(line, '\n'));
        size_t length = strcspn(line, "\n");
        if (length && strchr(" \t\r", line[length - 1])) fail_with("a line ends in space", text);
    }
    if (strstr(text, "\n\n\n")) fail_with("two empty lines", text);
}

enum { PROGRAMS = 2000 }; // tests/fmt/random_programs.c runs any number

static void random_programs_keep_their_trees_and_are_formatted_once_for_all(void **state)
{
    for (uint64_t seed = 1; seed <= PROGRAMS; seed++) {
        Maker maker;
        make_program(&maker, seed);
        Unit unit, again;
        const char *once = formatted_lines(&unit, maker.text, 0, 0);
        const char *twice = formatted_lines(&again, once, 0, 0);
        if (strcmp(once, twice) != 0) {
            fprintf(stderr, "--- program:\n%s\n--- once:\n%s\n--- twice:\n%s\n", maker.text, once, twice);
            fail_msg("program %d is formatted again", (int)seed);
        }
        no_line_ends_in_space(once);
        unit_release(&again);
        unit_release(&unit);
        free(maker.text);
    }
}

static void random_ranges_keep_the_tree(void **state)
{
    for (uint64_t seed = 1; seed <= PROGRAMS / 10; seed++) {
        Maker maker;
        make_program(&maker, seed);
        uint32_t first = 1 + pick(&maker, 20);
        Unit unit;
        formatted_lines(&unit, maker.text, first, first + pick(&maker, 10));
        unit_release(&unit);
        free(maker.text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_file_stays_empty),
        cmocka_unit_test(space_stands_around_operators_but_powers),
        cmocka_unit_test(semicolons_that_end_nothing_go),
        cmocka_unit_test(a_result_may_do_without_a_semicolon),
        cmocka_unit_test(comments_stay_where_they_were_written),
        cmocka_unit_test(comments_of_neighbouring_lines_begin_in_one_column),
        cmocka_unit_test(a_range_of_lines_leaves_the_rest),
        cmocka_unit_test(random_programs_keep_their_trees_and_are_formatted_once_for_all),
        cmocka_unit_test(random_ranges_keep_the_tree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
