#include <time.h>

#include "lang/parse.h"
#include "lang/scan.h"
#include "test_lang.h"

// --- Shape (more of it, in whole scenes, is in tests/parse) ---

static void an_entry_may_have_an_easing(void **state)
{
    assert_tree(
        "keys(time) { 0s: 0; 2s: 1 smooth; 4s: 0 bezier(1, x: 2) }",
        "  value\n    call keys()\n      argument\n        name time\n      block\n"
        "        entry\n          number 0s int\n          number 0 int\n"
        "        entry smooth\n          number 2s int\n          number 1 int\n"
        "        entry bezier\n          number 4s int\n          number 0 int\n          easing\n"
        "            argument\n              number 1 int\n            argument x\n              number 2 int\n");
    // A value that ends in a } takes its easing in parentheses around the value.
    assert_tree("k { 1: (a { }) smooth; }",
                "  value\n    call k\n      block\n        entry smooth\n          number 1 int\n          paren\n"
                "            call a\n              block\n");
}

static void keys_may_be_any_expression(void **state)
{
    assert_tree("m { 0..1: a; -1: b; \"x\": c; true: d; }",
                "  value\n    call m\n      block\n"
                "        entry\n          ..\n            number 0 int\n            number 1 int\n          name a\n"
                "        entry\n          number -1 int\n          name b\n"
                "        entry\n          string\n            text \"x\"\n          name c\n"
                "        entry\n          bool true\n          name d\n");
}

static void a_block_after_an_equals_sign_is_a_value(void **state)
{
    Unit unit;
    const char *text = "object a = { b }\nobject c { b }";
    Node *file = parse_bytes(&unit, text, strlen(text));
    assert_int_equal(unit.errors, 0);
    assert_false(file->a->flag);
    assert_true(file->a->next->flag);
    assert_int_equal(file->a->a->kind, NODE_BLOCK);
    assert_int_equal(file->a->next->a->kind, NODE_BLOCK);
    unit_release(&unit);
}

static void tools_and_uses_are_read(void **state)
{
    assert_tree("tool nip(radius: scalar = 0.2) { bump(radius: radius) }\nuse easing: bounce, elastic;\nuse clay as c;",
                "  tool nip\n    parameter radius\n      type scalar\n      =\n        number 0.2\n    block\n      "
                "value\n        call bump()\n"
                "          argument radius\n            name radius\n"
                "  use easing\n    name bounce\n    name elastic\n  use clay as c\n");
}

// --- Places ---

static const char *text_of(const Unit *unit, Span span)
{
    const Source *s = source_of(&unit->sources, span.begin);
    static char copy[200];
    snprintf(copy, sizeof copy, "%.*s", (int)(span.end - span.begin), s->text + (span.begin - s->base));
    return copy;
}

static void spans_cover_what_they_name(void **state)
{
    Unit unit;
    const char *text = "// first\nobject head = a.rotate(y: 90deg) | b[2];\nlet r = (1 + 2);";
    Node *file = parse_bytes(&unit, text, strlen(text));
    Node *head = file->a, *binary = head->a, *call = binary->a;
    assert_string_equal(text_of(&unit, file->span), text);
    assert_string_equal(text_of(&unit, head->span), "object head = a.rotate(y: 90deg) | b[2];");
    assert_string_equal(text_of(&unit, head->name_span), "head");
    assert_string_equal(text_of(&unit, binary->span), "a.rotate(y: 90deg) | b[2]");
    assert_string_equal(text_of(&unit, binary->name_span), "|");
    assert_string_equal(text_of(&unit, call->name_span), "rotate");
    assert_string_equal(text_of(&unit, call->b->span), "y: 90deg");
    assert_string_equal(text_of(&unit, call->b->name_span), "y");
    assert_string_equal(text_of(&unit, call->b->a->span), "90deg");
    assert_string_equal(text_of(&unit, binary->b->name_span), "2");
    assert_string_equal(text_of(&unit, head->next->a->span), "(1 + 2)");
    unit_release(&unit);
}

static void documentation_belongs_to_what_follows(void **state)
{
    Unit unit;
    const char *text = "/// A file.\n\n/// A let.\nlet a = 1;\n/// An object.\nobject b { /// inner\n let c = 1; c }\n"
                       "/// A handle.\nparam p: scalar = 1;\n/// A tag.\ntag t(/// its r\nr: scalar, s: scalar) { r "
                       "}\n/// nobody's\nt(1);";
    Node *file = parse_bytes(&unit, text, strlen(text));
    assert_string_equal(reported(&unit), "");
    Node *a = file->a, *b = a->next, *p = b->next, *t = p->next;
    assert_string_equal(file->doc, "A file.");
    assert_string_equal(a->doc, "A let.");
    assert_string_equal(b->doc, "An object.");
    assert_string_equal(b->a->a->doc, "inner");
    assert_string_equal(p->a->doc, "A handle.");
    assert_string_equal(t->doc, "A tag.");
    assert_string_equal(t->a->doc, "its r");
    assert_null(t->a->next->doc);
    unit_release(&unit);
}

// --- Depth ---

static char *repeated(const char *before, const char *middle, int count, const char *after)
{
    size_t length = strlen(middle);
    char *text = malloc(strlen(before) + length * (size_t)count + strlen(after) + 1);
    char *end = stpcpy(text, before);
    for (int i = 0; i < count; i++) end = stpcpy(end, middle);
    strcpy(end, after);
    return text;
}

static int depth_by_walking(const Node *node)
{
    int depth = 0;
    const Node *children[] = {node->a, node->b, node->c};
    for (int i = 0; i < 3; i++) {
        for (const Node *child = children[i]; child; child = child->next) {
            bool same_chain = i == 0 && node_is_link(node) && node_is_link(child);
            int below = depth_by_walking(child) + (same_chain ? 0 : 1);
            if (below > depth) depth = below;
        }
    }
    return depth;
}

static void depth_counts_a_chain_as_one_step(void **state)
{
    Unit unit;
    const char *text = "a | b | c.d().e(f(1 + 2)) - g;\nif a { b } else { [c] }";
    Node *file = parse_bytes(&unit, text, strlen(text));
    assert_int_equal(file->depth, depth_by_walking(file));
    assert_int_equal(file->a->depth, depth_by_walking(file->a));
    unit_release(&unit);
}

static void chains_of_any_length_are_read_and_printed(void **state)
{
    static const char *const links[] = {" | a", ".f(1)", ".x", "[0]", " + a", " and a", " * a", "/a & b - c"};
    for (size_t i = 0; i < sizeof links / sizeof *links; i++) {
        enum { COUNT = 100000 };
        char *text = repeated("let u = a", links[i], COUNT, ";");
        Unit unit;
        Node *file = parse_bytes(&unit, text, strlen(text));
        assert_string_equal(reported(&unit), "");
        assert_true(file->depth < 10);
        int count;
        node_spine(&unit.arena, file->a->a, &count);
        assert_true(count >= COUNT);
        char *tree = tree_text(&unit, file);
        assert_true(strlen(tree) > COUNT);
        free(tree);
        unit_release(&unit);
        free(text);
    }
}

static void nesting_without_end_is_one_message(void **state)
{
    static const char *const parts[][2] = {{"(", ")"},
                                           {"[", "]"},
                                           {"f(", ")"},
                                           {"{ ", " }"},
                                           {"- ", ""},
                                           {"not ", ""},
                                           {"~", ""},
                                           {"2 ^ ", ""},
                                           {"a[", "]"},
                                           {"\"{", "}\""},
                                           {"f { ", " }"},
                                           {"if a { 1 } else ", ""},
                                           {"if ", " { 1 } else { 2 }"},
                                           {"1 + (", ")"}};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        for (int closed = 0; closed < 2; closed++) {
            char *open = repeated("let a = ", parts[i][0], 10000, "1");
            char *text = repeated(open, closed ? parts[i][1] : "", 10000, ";");
            Unit unit;
            Node *file = parse_bytes(&unit, text, strlen(text));
            if (unit.errors != 1 || unit.diagnostics.first->code != DIAG_TOO_DEEP) {
                // What is left open is also not closed, or does not end, on its one line.
                bool open_string = !closed && parts[i][0][0] == '"' && unit.errors == 1;
                if (!open_string) fail_msg("%s: %s", parts[i][0], reported(&unit));
            }
            free(tree_text(&unit, file));
            unit_release(&unit);
            free(text);
            free(open);
        }
    }
}

static void reasonable_nesting_is_not_too_deep(void **state)
{
    char *open = repeated("let a = ", "f((", 60, "1");
    char *text = repeated(open, "))", 60, ";");
    assert_reports(text, "");
    free(text);
    free(open);
}

// --- Recovery: what is after a mistake is read ---

static void items_after_a_mistake_are_read(void **state)
{
    static const char *const mistakes[] = {
        "let a = ;",
        "let a = 1 + ;",
        "let = 3;",
        "object;;",
        "sphere(1 2);",
        "f(,);",
        "[1, , 2];",
        "a b c d;",
        "fn f( { 1 }",
        "fn f(a b c) { 1 }",
        "for i on 3 { x; y; }",
        "if { a; }",
        "param;",
        "\"{}\";",
        "let a = 3 @ 4;",
        "a.;",
        "a.();",
        "use;",
        "x = ;",
        "light a b { c: 1; d: 2; }",
        "(1, 2;",
        "f(g(h(1);",
        "a ] b;",
        "let a = {(} ;",
        "let a = f(1), 2);",
        "if a { b } else;",
        "k { 1: ; 2: 3; }",
        "print;",
        "assert;",
        "let 3 = 4;",
        "1 = 2;",
        "a < ;",
        "..;",
        "let a = \"b;",
    };
    for (size_t i = 0; i < sizeof mistakes / sizeof *mistakes; i++) {
        char text[200];
        snprintf(text, sizeof text, "%s\nlet last = 1;\nobject o { sphere(1); }", mistakes[i]);
        Unit unit;
        Node *file = parse_bytes(&unit, text, strlen(text));
        if (unit.errors == 0 && strcmp(mistakes[i], "object;;") != 0) fail_msg("%s: nothing reported", mistakes[i]);
        const Node *let = NULL, *object = NULL;
        for (const Node *item = file->a; item; item = item->next) {
            if (item->kind == NODE_LET && strcmp(item->name, "last") == 0) let = item;
            if (item->kind == NODE_DECLARE && strcmp(item->name, "o") == 0) object = item;
        }
        if (!let || !object) {
            char *tree = tree_text(&unit, file);
            fail_msg("%s: what follows is lost\n%s", mistakes[i], tree);
        }
        unit_release(&unit);
    }
}

static void in_a_block_the_rest_of_the_block_is_read(void **state)
{
    Unit unit;
    const char *text = "object a { sphere(1 +); box(2); let b = * 3; b }\nsphere(4);";
    Node *file = parse_bytes(&unit, text, strlen(text));
    assert_string_equal(reported(&unit), "1:22 unexpected, 1:41 unexpected");
    char *tree = tree_text(&unit, file);
    assert_string_equal(tree, "file\n  declare object a { }\n    block\n      value\n        call sphere()\n          "
                              "argument\n            error\n"
                              "      value\n        call box()\n          argument\n            number 2 int\n      "
                              "error\n      value\n        name b\n"
                              "  value\n    call sphere()\n      argument\n        number 4 int\n");
    free(tree);
    unit_release(&unit);
}

static void before_a_dot_without_a_name_the_receiver_is_kept(void **state)
{
    Unit unit;
    const char *text = "object a = head.rotate(y: 1deg).;";
    Node *file = parse_bytes(&unit, text, strlen(text));
    assert_int_equal(file->a->a->kind, NODE_ERROR);
    assert_int_equal(file->a->a->a->kind, NODE_CALL);
    unit_release(&unit);
}

static void a_library_by_its_file_needs_a_name(void **state)
{
    assert_reports("use \"a.scn\";", "1:5 unexpected");
    assert_reports("use \"a.scn\" as a;\nuse \"a.scn\": b, c;", "");
    assert_reports("use easing: bounce\nobject a = b(1);", "1:19 missing-semicolon");
}

static void a_foreign_word_where_a_name_stands_is_a_name(void **state)
{
    assert_reports("fn #declare(a: scalar) { a }", "1:4 foreign-syntax, 1:4 reserved-word");
    assert_reports("let a = b.∧;", "1:11 bad-character, 1:11 reserved-word");
}

static void foreign_forms_become_what_was_meant(void **state)
{
    static const struct {
        const char *wrong, *right;
    } forms[] = {
        {"let a = b && !c || d;", "let a = b and not c or d;"},
        {"x = 3;", "let x = 3;"},
        {"let r: scalar = 3;", "let r = 3;"},
        {"f(radius = 2);", "f(radius: 2);"},
        {"camera { fov = 35deg; }", "camera { fov: 35deg; }"},
        {"for (i in 0..5) { a; }", "for i in 0..5 { a; }"},
        {"let a = 7 % 2;", "let a = mod(7, 2);"},
        {"let a = 2 ** 3;", "let a = 2 ^ 3;"},
        {"let a = 0 < 1 < 2;", "let a = 0 < 1 and 1 < 2;"},
        {"#declare a = 1;", "let a = 1;"},
        {"let a = 3 × 2 − 1;", "let a = 3 * 2 - 1;"},
        {"let a = .5 + 5. ;", "let a = 0.5 + 5.0;"},
        {"print 'a';", "print \"a\";"},
        {"fn f(float a) { a }", "fn f(a: scalar) { a }"},
        {"object a = b\nobject c = d;", "object a = b; object c = d;"},
        {"let a = f(1;\nlet b = [1, 2);", "let a = f(1); let b = [1, 2];"},
    };
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
        Unit wrong, right;
        Node *wrong_file = parse_bytes(&wrong, forms[i].wrong, strlen(forms[i].wrong));
        Node *right_file = parse_bytes(&right, forms[i].right, strlen(forms[i].right));
        assert_string_equal(reported(&right), "");
        assert_true(wrong.errors > 0);
        char *a = tree_text(&wrong, wrong_file), *b = tree_text(&right, right_file);
        assert_string_equal(a, b);
        free(a);
        free(b);
        unit_release(&wrong);
        unit_release(&right);
    }
}

// Applies the sure fixes of a text and expects the right one.
static void sure_fixes_give_a_right_text(void **state)
{
    static const struct {
        const char *wrong, *right;
    } fixes[] = {
        {"let a = b && c;", "let a = b and c;"},
        {"let a = !b;", "let a = not b;"},
        {"let a = .5;", "let a = 0.5;"},
        {"let a = 5. ;", "let a = 5.0 ;"},
        {"let a = 7 % 2;", "let a = mod(7, 2);"},
        {"let a = 0 < 1 < 2;", "let a = 0 < 1 and 1 < 2;"},
        {"for (i in 0..5) { a; }", "for i in 0..5 { a; }"},
        {"f(radius = 2);", "f(radius: 2);"},
        {"camera { fov = 35deg; }", "camera { fov: 35deg; }"},
        {"let r: scalar = 3;", "scalar r = 3;"},
        {"object a = b\nobject c = d;", "object a = b;\nobject c = d;"},
        {"print 'a';", "print \"a\";"},
        {"let a = 3 × 2;", "let a = 3 * 2;"},
    };
    for (size_t i = 0; i < sizeof fixes / sizeof *fixes; i++) {
        Unit unit;
        parse_bytes(&unit, fixes[i].wrong, strlen(fixes[i].wrong));
        assert_int_equal(unit.errors, 1);
        const DiagFix *fix = unit.diagnostics.first->fixes;
        assert_non_null(fix);
        assert_int_equal(fix->kind, FIX_SURE);
        char fixed[200];
        uint32_t begin = fix->span.begin - 1, end = fix->span.end - 1; // the first text begins at position 1
        snprintf(fixed, sizeof fixed, "%.*s%s%s", (int)begin, fixes[i].wrong, fix->text, fixes[i].wrong + end);
        assert_string_equal(fixed, fixes[i].right);
        assert_reports(fixed, "");
        unit_release(&unit);
    }
}

// --- Any text ends quickly and says something ---

static const char sample[] = "scn 1;\n/// A handle.\nparam squash: scalar = 0.2 in 0..1;\ncamera { eye: (0, 1, 5); "
                             "fov: 35deg; }\nlight key { color: #fff; }\n"
                             "tag ring(major: scalar = 1, minor: scalar = 0.25) -> object {\n    let wall = "
                             "cylinder(radius: major + minor) - cylinder(radius: major - minor);\n"
                             "    wall & slab(z: -minor .. minor)\n}\nobject head = freeform(sphere(1).scale(1, 1 - "
                             "squash, 1)) {\n    for i in 0 .. 5 { nip(at: polar(1, 72deg * i), height: 0.1); }\n};\n"
                             "let names = [for i in [1, 2] { \"n{i + 1}\" }];\nobject b = if squash > 0.5 and true { "
                             "head } else if not false { ~ring() } else { head | ring(2) };\n"
                             "object m = morph(head, b, keys(time) { 0s: 0; 2s: 1 smooth; });\nassert count(names) == "
                             "2, \"{names[0]} only\";\nscene { head; m.move(3, 0, 0); }\n";

typedef struct Piece {
    uint32_t begin, end;
} Piece;

static int pieces_of(const char *text, Piece *pieces, int most)
{
    Unit unit;
    unit_init(&unit);
    Source *source = source_add(&unit.sources, "test.scn", text, strlen(text), (Span){0});
    Scanner scanner;
    scanner_init(&scanner, &unit, source);
    Token token;
    int count = 0;
    for (scan(&scanner, &token); token.code != TOK_YYEOF && count < most; scan(&scanner, &token)) {
        pieces[count++] = (Piece){token.span.begin - source->base, token.span.end - source->base};
    }
    scanner_release(&scanner);
    unit_release(&unit);
    return count;
}

static void parse_and_print(const char *text, size_t length)
{
    Unit unit;
    Node *file = parse_bytes(&unit, text, length);
    assert_non_null(file);
    for (const Node *item = file->a; item && unit.errors == 0; item = item->next)
        assert_int_not_equal(item->kind, NODE_ERROR);
    assert_true(unit.errors < 25); // one wrong word is not a flood
    free(tree_text(&unit, file));
    free(printed(&unit, false));
    unit_release(&unit);
}

static void a_text_with_one_wrong_word_is_read_to_its_end(void **state)
{
    enum { MOST = 1000 };
    Piece pieces[MOST];
    assert_reports(sample, "");
    int count = pieces_of(sample, pieces, MOST);
    assert_true(count > 200);
    size_t length = strlen(sample);
    char *text = malloc(2 * length);
    clock_t start = clock();
    for (int i = 0; i < count; i++) {
        Piece p = pieces[i], q = pieces[(i * 7 + 3) % count];
        // left out
        memcpy(text, sample, p.begin);
        memcpy(text + p.begin, sample + p.end, length - p.end);
        parse_and_print(text, length - (p.end - p.begin));
        // doubled
        memcpy(text, sample, p.end);
        text[p.end] = ' ';
        memcpy(text + p.end + 1, sample + p.begin, length - p.begin);
        parse_and_print(text, p.end + 1 + length - p.begin);
        // replaced by another word of the text
        memcpy(text, sample, p.begin);
        memcpy(text + p.begin, sample + q.begin, q.end - q.begin);
        memcpy(text + p.begin + (q.end - q.begin), sample + p.end, length - p.end);
        parse_and_print(text, p.begin + (q.end - q.begin) + length - p.end);
        // the text ends here
        memcpy(text, sample, p.end);
        parse_and_print(text, p.end);
    }
    assert_true((double)(clock() - start) / CLOCKS_PER_SEC < 60);
    free(text);
}

static void bytes_without_sense_are_read_to_their_end(void **state)
{
    unsigned seed = 1;
    for (int round = 0; round < 300; round++) {
        char text[301] = {0};
        for (size_t i = 0; i < sizeof text - 1; i++) {
            seed = seed * 1664525u + 1013904223u;
            static const char marks[] = "(){}[];:,.\"\\=<>+-*/^|&~ \n0a#!%'\xC3\xA9";
            text[i] = round % 2 ? (char)(seed >> 24) : marks[(seed >> 16) % (sizeof marks - 1)];
        }
        Unit unit;
        Node *file = parse_bytes(&unit, text, sizeof text - 1);
        free(tree_text(&unit, file));
        free(printed(&unit, true));
        unit_release(&unit);
    }
}

static void a_hundred_thousand_declarations_are_read_in_a_moment(void **state)
{
    char *text = repeated("", "object s = quadric(-1, -1, -1, 0, 0, 0, 2, 0, 0, 0.5);\n", 100000, "");
    Unit unit;
    clock_t start = clock();
    Node *file = parse_bytes(&unit, text, strlen(text));
    double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    assert_int_equal(unit.errors, 0);
    assert_non_null(file->a);
    print_message("%.1f million words a second\n", 2.8 / seconds);
    assert_true(seconds <
                20); // only a guard against what is not linear: the machine may be slow, and checked by sanitizers
    unit_release(&unit);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_entry_may_have_an_easing),
        cmocka_unit_test(keys_may_be_any_expression),
        cmocka_unit_test(a_block_after_an_equals_sign_is_a_value),
        cmocka_unit_test(tools_and_uses_are_read),
        cmocka_unit_test(spans_cover_what_they_name),
        cmocka_unit_test(documentation_belongs_to_what_follows),
        cmocka_unit_test(depth_counts_a_chain_as_one_step),
        cmocka_unit_test(chains_of_any_length_are_read_and_printed),
        cmocka_unit_test(nesting_without_end_is_one_message),
        cmocka_unit_test(reasonable_nesting_is_not_too_deep),
        cmocka_unit_test(items_after_a_mistake_are_read),
        cmocka_unit_test(in_a_block_the_rest_of_the_block_is_read),
        cmocka_unit_test(before_a_dot_without_a_name_the_receiver_is_kept),
        cmocka_unit_test(a_library_by_its_file_needs_a_name),
        cmocka_unit_test(a_foreign_word_where_a_name_stands_is_a_name),
        cmocka_unit_test(foreign_forms_become_what_was_meant),
        cmocka_unit_test(sure_fixes_give_a_right_text),
        cmocka_unit_test(a_text_with_one_wrong_word_is_read_to_its_end),
        cmocka_unit_test(bytes_without_sense_are_read_to_their_end),
        cmocka_unit_test(a_hundred_thousand_declarations_are_read_in_a_moment),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
