#include <locale.h>
#include <math.h>

#include "lang/parse.h"
#include "lang/scan.h"
#include "test_lang.h"

// The words of a text as the scanner gives them: reserved words and marks as they are written, the rest by kind and value.
static const char *words(Unit *unit, const char *text, size_t length)
{
    unit_init(unit);
    Source *source = source_add(&unit->sources, "test.scn", text, length, (Span){0});
    Scanner scanner;
    scanner_init(&scanner, unit, source);
    const char *all = "";
    Token token;
    for (scan(&scanner, &token); token.code != TOK_YYEOF; scan(&scanner, &token)) {
        Arena *arena = &unit->arena;
        const char *word = token_text(token.code);
        Value v = token.value;
        switch (token.code) {
        case TOK_NAME: word = arena_printf(arena, "'%s", v.name); break;
        case TOK_INT: word = arena_printf(arena, "int:%.17g", v.number.value); break;
        case TOK_REAL:
            word = arena_printf(arena, "%.17g%s%s", v.number.value, number_unit_text(v.number.unit),
                                v.number.whole ? "!" : "");
            break;
        case TOK_COLOR: word = arena_printf(arena, "#%06x", v.color); break;
        case TOK_STRING: word = arena_printf(arena, "\"%.*s\"", (int)v.text.length, v.text.text); break;
        case TOK_STRING_HEAD: word = arena_printf(arena, "\"%.*s{", (int)v.text.length, v.text.text); break;
        case TOK_STRING_MIDDLE: word = arena_printf(arena, "}%.*s{", (int)v.text.length, v.text.text); break;
        case TOK_STRING_TAIL: word = arena_printf(arena, "}%.*s\"", (int)v.text.length, v.text.text); break;
        case TOK_SCN_YYerror: word = "?"; break;
        default: break;
        }
        assert_non_null(word);
        all = arena_printf(arena, "%s%s%s", all, *all ? " " : "", word);
    }
    scanner_release(&scanner);
    return all;
}

#define assert_words(text, expected)                                                                                   \
    do {                                                                                                               \
        Unit words_unit;                                                                                               \
        assert_string_equal(words(&words_unit, (text), strlen(text)), (expected));                                     \
        assert_string_equal(reported(&words_unit), "");                                                                \
        unit_release(&words_unit);                                                                                     \
    } while (0)

#define assert_words_and_reports(text, expected, reports)                                                              \
    do {                                                                                                               \
        Unit words_unit;                                                                                               \
        assert_string_equal(words(&words_unit, (text), strlen(text)), (expected));                                     \
        assert_string_equal(reported(&words_unit), (reports));                                                         \
        unit_release(&words_unit);                                                                                     \
    } while (0)

static void names_are_letters_digits_and_underscores(void **state)
{
    assert_words("a _b c1 Sphere look_at A11", "'a '_b 'c1 'Sphere 'look_at 'A11");
    assert_words("object camera scene keys sphere time",
                 "'object 'camera 'scene 'keys 'sphere 'time"); // built in, not reserved
    assert_words("lets fnx iff ino nota", "'lets 'fnx 'iff 'ino 'nota");
}

static void every_word_and_mark_of_the_table_is_recognised(void **state)
{
#define RESERVED(token, word, ...)           assert_words(word, word);
#define MARK(token, mark, ...)               assert_words(" " mark " ", mark);
#define UNIT(id, suffix, dimension, meaning) assert_words("2.5" suffix, "2.5" suffix);
#include "lang/words.def"
}

static void of_two_marks_the_longer_one_wins(void **state)
{
    assert_words("a<=b>=c==d!=e", "'a <= 'b >= 'c == 'd != 'e");
    assert_words("->-.. .", "-> - .. .");
    assert_words("a=-b", "'a = - 'b");
    assert_words("a--b", "'a - - 'b");
}

static void numbers_have_a_digit_on_both_sides_of_a_point(void **state)
{
    assert_words("5 0.5 1e-3 2E+6 1.25e2 007", "int:5 0.5 0.001 2000000 125 int:7");
    assert_words("0..5", "int:0 .. int:5");
    assert_words("0.5..1.5", "0.5 .. 1.5");
    assert_words("5.max(3)", "int:5 . 'max ( int:3 )");
    assert_words("v[0].x", "'v [ int:0 ] . 'x");
    assert_words_and_reports("a(.5)", "'a ( 0.5 )", "1:3 number-form");
    assert_words_and_reports("5. ", "5", "1:1 number-form");
    assert_words_and_reports("5.", "5", "1:1 number-form");
    assert_words_and_reports("1.5.2", "1.5 ?", "1:4 number-form");
    assert_words_and_reports("v.0", "'v ?", "1:2 number-form");
}

static void numbers_are_read_exactly(void **state)
{
    static const char *const texts[] = {"0.1",
                                        "0.2",
                                        "1e22",
                                        "1e23",
                                        "123456789012345",
                                        "0.000001",
                                        "3.141592653589793",
                                        "1.7976931348623157e308",
                                        "2.2250738585072014e-308",
                                        "4.9e-324",
                                        "0.30000000000000004",
                                        "9007199254740993.0",
                                        "123456.789e-5"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        Unit unit;
        const char *all = words(&unit, texts[i], strlen(texts[i]));
        double value = strtod(strncmp(all, "int:", 4) == 0 ? all + 4 : all, NULL);
        assert_true(value == strtod(texts[i], NULL));
        unit_release(&unit);
    }
}

// Sixteen to twenty digits take a way of their own. Numbers that lie halfway between two doubles, and next to it, are where it could fail.
static void numbers_of_many_digits_are_read_as_the_library_reads_them(void **state)
{
    char text[64], all[200 * 64];
    for (int round = 0; round < 200; round++) {
        uint64_t random = 0x9e3779b97f4a7c15u * (uint64_t)(round + 1);
        size_t length = 0;
        double expected[200];
        for (int k = 0; k < 200; k++) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            double value = ldexp((double)(random >> 11), -(int)(random % 52)); // at most 2^53
            double half = ldexp(1, (int)floor(log2(value)) - 53);
            if (k % 2)
                snprintf(text, sizeof text, "%.*Lf", (int)(random % 19), (long double)value + (long double)half);
            else
                snprintf(text, sizeof text, "%.17f", value / 9007199254740992.0);
            expected[k] = strtod(text, NULL);
            length += (size_t)snprintf(all + length, sizeof all - length, "%s%s ", text, strchr(text, '.') ? "" : ".0");
        }
        Unit unit;
        const char *read = words(&unit, all, length);
        for (int k = 0; k < 200; k++) {
            char *end;
            assert_true(strtod(read, &end) == expected[k]);
            read = end;
        }
        unit_release(&unit);
    }
}

static void whole_numbers_are_exact_up_to_two_to_the_53(void **state)
{
    assert_words("9007199254740992", "int:9007199254740992");
    assert_words_and_reports("9007199254740993", "9007199254740992", "1:1 number-form");
    assert_words_and_reports("1e999", "0", "1:1 number-form");
}

static void a_comma_as_decimal_point_of_the_locale_changes_nothing(void **state)
{
    // Where no such locale is installed the test says nothing, and hurts nobody.
    setlocale(LC_ALL, "de_DE.UTF-8");
    Unit unit;
    words(&unit, "x = 0.123456789012345678;", 25);
    Source *source = unit.sources.list[0];
    Scanner scanner;
    scanner_init(&scanner, &unit, source);
    Token token;
    for (int i = 0; i < 3; i++) scan(&scanner, &token);
    assert_true(fabs(token.value.number.value - 123456789012345678e-18) < 1e-15);
    scanner_release(&scanner);
    unit_release(&unit);
    setlocale(LC_ALL, "C");
}

static void units_follow_their_number_directly(void **state)
{
    assert_words("90deg 1.5rad 1turn 2s 20ms 12f", "90deg! 1.5rad 1turn! 2s! 20ms! 12f!");
    assert_words("1e3s", "1000s");
    assert_words("90 deg", "int:90 'deg");
    assert_words_and_reports("12px", "int:12", "1:3 unknown-unit");
    assert_words_and_reports("90degrees", "90deg!", "1:3 unknown-unit");
    assert_words_and_reports("90dge", "90deg!", "1:3 unknown-unit");
    assert_words_and_reports("90°", "90deg!", "1:3 unknown-unit");
    assert_words_and_reports("1e", "int:1", "1:2 number-form");
    assert_words_and_reports("1_000", "int:1", "1:2 number-form");
    assert_words_and_reports("0xff", "int:0", "1:1 number-form");
}

static void colours_have_three_or_six_digits(void **state)
{
    assert_words("#fff #C8814b #012", "#ffffff #c8814b #001122");
    assert_words_and_reports("#ff", "#808080", "1:1 color-form");
    assert_words_and_reports("#ff000080", "#808080", "1:1 color-form");
    assert_words_and_reports("#red", "#808080", "1:1 color-form");
    assert_words_and_reports("#", "#808080", "1:1 color-form");
}

static void strings_have_few_escapes(void **state)
{
    assert_words("\"\" \"a b\"", "\"\" \"a b\"");
    assert_words("\"\\\"\\\\\\n\\t\\{\\}\"", "\"\"\\\n\t{}\"");
    assert_words("\"// no comment /* neither\"", "\"// no comment /* neither\"");
    assert_words("\"a } b\"", "\"a } b\"");
    assert_words_and_reports("\"C:\\scenes\"", "\"C:\\scenes\"", "1:4 bad-escape");
    assert_words_and_reports("\"\\é\"", "\"\\é\"", "1:2 bad-escape");
    assert_words_and_reports("'a'", "\"a\"", "1:1 foreign-syntax");
}

static void strings_have_values_in_them(void **state)
{
    assert_words("\"a {b} c\"", "\"a { 'b } c\"");
    assert_words("\"{a}{b}\"", "\"{ 'a }{ 'b }\"");
    assert_words("\"{f { 1 }}\"", "\"{ 'f { int:1 } }\"");
    assert_words("\"{\"inner {x}\"}\"", "\"{ \"inner { 'x }\" }\"");
    assert_words("\"{\"}\"}\"", "\"{ \"}\" }\"");
    assert_words("\"{a /* } \" */}\"", "\"{ 'a }\"");
    assert_words_and_reports("\"{'}\"'}\"", "\"{ \"}\"\" }\"", "1:3 foreign-syntax");
    assert_words_and_reports("\"{'}\"", "\"{ ? }\"", "1:3 bad-character");
}

static void a_string_ends_on_its_line(void **state)
{
    // Marks at the end of the line are probably not of the string.
    assert_words_and_reports("f(\"abc);\nb", "'f ( \"abc\" ) ; 'b", "1:3 unterminated-string");
    assert_words_and_reports("\"abc", "\"abc\"", "1:1 unterminated-string");
    assert_words_and_reports("\"", "\"\"", "1:1 unterminated-string");
    assert_words_and_reports("\"\nb", "\"\" 'b", "1:1 unterminated-string");
    assert_words_and_reports("\"a {b c\";\nd", "\"a {b c\"\" ; 'd", "1:1 unterminated-string");
    assert_words_and_reports("\"a {b // c}\"\nd", "\"a {b\" 'd", "1:1 unterminated-string");
    assert_words_and_reports("\"a\\\nb", "\"a\\\" 'b", "1:1 unterminated-string");
}

static void comments_nest(void **state)
{
    assert_words("a // b\nc", "'a 'c");
    assert_words("a /* b */ c", "'a 'c");
    assert_words("a /* /* b */ c */ d", "'a 'd");
    assert_words("a /***/ b /**/ c /*/ */ d", "'a 'b 'c 'd");
    assert_words("a /* // */ b", "'a 'b");
    assert_words_and_reports("a /* b", "'a", "1:3 unterminated-comment");
    assert_words_and_reports("a /* /* b */ c", "'a", "1:3 unterminated-comment");
}

static void only_space_separates_and_carriage_returns_are_space(void **state)
{
    assert_words("\xEF\xBB\xBF"
                 "a\r\n\tb\n\n  c\r",
                 "'a 'b 'c");
    assert_words("", "");
    assert_words("   ", "");
}

static void look_alikes_are_understood(void **state)
{
    assert_words_and_reports("3 × 2", "int:3 * int:2", "1:3 bad-character");
    assert_words_and_reports("3×2", "int:3 * int:2", "1:2 bad-character");
    assert_words_and_reports("a−b", "'a - 'b", "1:2 bad-character");
    assert_words_and_reports("a\xC2\xA0"
                             "b",
                             "'a 'b", "1:2 bad-character"); // a space that does not break
    assert_words_and_reports("a ≤ b", "'a <= 'b", "1:3 bad-character");
}

static void other_characters_are_one_message_a_word(void **state)
{
    assert_words_and_reports("größe = 1", "'größe = int:1", "1:1 bad-character");
    assert_words_and_reports("a @ b", "'a ? 'b", "1:3 bad-character");
    assert_words_and_reports("a \\ b", "'a ? 'b", "1:3 bad-character");
    assert_words_and_reports("a \x01\x02\x03 b", "'a ? 'b", "1:3 bad-character");
}

static void nul_bytes_and_broken_utf8_are_reported(void **state)
{
    Unit unit;
    assert_string_equal(words(&unit, "a \0 b", 5), "'a ? 'b");
    assert_string_equal(reported(&unit), "1:3 bad-character");
    unit_release(&unit);
    assert_string_equal(words(&unit, "\"a\0b\"", 5), "\"a\"");
    assert_string_equal(reported(&unit), "1:3 bad-character");
    unit_release(&unit);
    // Once for the whole file, wherever it stands.
    assert_string_equal(words(&unit, "// caf\xE9\na // \xE9", 14), "'a");
    assert_string_equal(reported(&unit), "1:7 bad-character");
    unit_release(&unit);
    assert_string_equal(words(&unit,
                              "\xFF\xFE"
                              "a\0b\0",
                              6),
                        ""); // UTF-16
    assert_string_equal(reported(&unit), "1:1 bad-character");
    unit_release(&unit);
}

static void what_other_languages_write_is_understood(void **state)
{
    assert_words_and_reports("a && b || c", "'a and 'b or 'c", "1:3 foreign-syntax, 1:8 foreign-syntax");
    assert_words_and_reports("0...5 0..=5 0..<5", "int:0 .. int:5 int:0 .. int:5 int:0 .. int:5",
                             "1:2 foreign-syntax, 1:8 foreign-syntax, 1:14 foreign-syntax");
    assert_words_and_reports("a**b", "'a ^ 'b", "1:2 foreign-syntax");
    assert_words_and_reports("#declare x = 1;", "let 'x = int:1 ;", "1:1 foreign-syntax");
    assert_words_and_reports("a += 1", "'a ? int:1", "1:3 foreign-syntax");
}

static void documentation_waits_for_the_word_that_follows(void **state)
{
    static const char text[] = "/// The file.\n/// Two lines.\n\n/// A ball,\n///   round.\n//// no "
                               "documentation\nobject a;\n/// stray\n\n/// Near.\nb";
    Unit unit;
    unit_init(&unit);
    Source *source = source_add(&unit.sources, "test.scn", text, sizeof text - 1, (Span){0});
    Scanner scanner;
    scanner_init(&scanner, &unit, source);
    Token token;
    do scan(&scanner, &token);
    while (token.code != TOK_YYEOF);
    assert_string_equal(scanner.file_doc, "The file.\nTwo lines.");
    assert_string_equal(scanner_doc(&scanner, source->base + (uint32_t)(strstr(text, "object") - text)),
                        "A ball,\n  round.");
    assert_string_equal(scanner_doc(&scanner, source->base + (uint32_t)sizeof text - 2), "Near.");
    assert_null(scanner_doc(&scanner, source->base + (uint32_t)(strstr(text, "a;") - text)));
    scanner_release(&scanner);
    unit_release(&unit);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(names_are_letters_digits_and_underscores),
        cmocka_unit_test(every_word_and_mark_of_the_table_is_recognised),
        cmocka_unit_test(of_two_marks_the_longer_one_wins),
        cmocka_unit_test(numbers_have_a_digit_on_both_sides_of_a_point),
        cmocka_unit_test(numbers_are_read_exactly),
        cmocka_unit_test(numbers_of_many_digits_are_read_as_the_library_reads_them),
        cmocka_unit_test(whole_numbers_are_exact_up_to_two_to_the_53),
        cmocka_unit_test(a_comma_as_decimal_point_of_the_locale_changes_nothing),
        cmocka_unit_test(units_follow_their_number_directly),
        cmocka_unit_test(colours_have_three_or_six_digits),
        cmocka_unit_test(strings_have_few_escapes),
        cmocka_unit_test(strings_have_values_in_them),
        cmocka_unit_test(a_string_ends_on_its_line),
        cmocka_unit_test(comments_nest),
        cmocka_unit_test(only_space_separates_and_carriage_returns_are_space),
        cmocka_unit_test(look_alikes_are_understood),
        cmocka_unit_test(other_characters_are_one_message_a_word),
        cmocka_unit_test(nul_bytes_and_broken_utf8_are_reported),
        cmocka_unit_test(what_other_languages_write_is_understood),
        cmocka_unit_test(documentation_waits_for_the_word_that_follows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
