// Values of params as they are written outside of a scene.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "compiler/param.h"

static ParamValue good(Arena *arena, ParamType type, const char *text)
{
    ParamValue value;
    const char *wrong = param_parse_type(arena, type, text, &value);
    if (wrong) fail_msg("%s", wrong);
    return value;
}

static bool is_wrong(Arena *arena, ParamType type, const char *text, const char *says)
{
    ParamValue value;
    const char *wrong = param_parse_type(arena, type, text, &value);
    return wrong && strstr(wrong, says);
}

static void numbers_have_the_unit_of_their_type(void **state)
{
    Arena arena = {0};
    assert_true(good(&arena, PARAM_SCALAR, "0.5").number[0] == 0.5);
    assert_true(good(&arena, PARAM_SCALAR, " -1e-3 ").number[0] == -1e-3);
    assert_true(good(&arena, PARAM_SCALAR, ".5").number[0] == 0.5);
    assert_true(good(&arena, PARAM_ANGLE, "180deg").number[0] == M_PI);
    assert_true(good(&arena, PARAM_ANGLE, "1.5rad").number[0] == 1.5);
    assert_true(good(&arena, PARAM_ANGLE, "0.25turn").number[0] == M_PI / 2);
    assert_true(good(&arena, PARAM_ANGLE, "0").number[0] == 0);
    assert_true(good(&arena, PARAM_TIME, "2s").number[0] == 2);
    assert_true(good(&arena, PARAM_TIME, "250ms").number[0] == 0.25);
    assert_true(is_wrong(&arena, PARAM_ANGLE, "30", "write 30deg"));
    assert_true(is_wrong(&arena, PARAM_TIME, "2", "write 2s"));
    assert_true(is_wrong(&arena, PARAM_TIME, "30deg", "write a time"));
    assert_true(is_wrong(&arena, PARAM_SCALAR, "2s", "write a number"));
    assert_true(is_wrong(&arena, PARAM_SCALAR, "", "write a number"));
    assert_true(is_wrong(&arena, PARAM_SCALAR, "nan", "write a number"));
    assert_true(is_wrong(&arena, PARAM_SCALAR, "0x10", "write a number"));
    assert_true(is_wrong(&arena, PARAM_SCALAR, "1e999", "write a number"));
    arena_release(&arena);
}

static void ints_are_whole(void **state)
{
    Arena arena = {0};
    assert_true(good(&arena, PARAM_INT, "-7").number[0] == -7);
    assert_true(is_wrong(&arena, PARAM_INT, "2.5", "whole"));
    assert_true(is_wrong(&arena, PARAM_INT, "1e300", "whole"));
    assert_true(is_wrong(&arena, PARAM_INT, "seven", "whole"));
    arena_release(&arena);
}

static void vectors_and_colors(void **state)
{
    Arena arena = {0};
    ParamValue v = good(&arena, PARAM_VEC3, "(1, 2,3)");
    assert_true(v.number[0] == 1 && v.number[1] == 2 && v.number[2] == 3);
    v = good(&arena, PARAM_VEC2, "1, 2");
    assert_true(v.number[0] == 1 && v.number[1] == 2);
    v = good(&arena, PARAM_COLOR, "#f00");
    assert_true(v.number[0] == 1 && v.number[1] == 0);
    v = good(&arena, PARAM_COLOR, "(0.5, 0.25, 0)");
    assert_true(v.number[0] == 0.5 && v.number[1] == 0.25);
    v = good(&arena, PARAM_COLOR, "#808080");
    assert_true(fabs(v.number[0] - 0.21586) < 1e-5);
    assert_true(is_wrong(&arena, PARAM_VEC3, "(1, 2)", "(1, 2, 3)"));
    assert_true(is_wrong(&arena, PARAM_VEC3, "(1, 2, 3", "(1, 2, 3)"));
    assert_true(is_wrong(&arena, PARAM_VEC3, "(1 2 3)", "(1, 2, 3)"));
    assert_true(is_wrong(&arena, PARAM_COLOR, "#ff", "#ff8000"));
    assert_true(is_wrong(&arena, PARAM_COLOR, "#ggg", "#ff8000"));
    arena_release(&arena);
}

static void words(void **state)
{
    Arena arena = {0};
    assert_true(good(&arena, PARAM_BOOL, "true").number[0] == 1);
    assert_true(good(&arena, PARAM_BOOL, "false").number[0] == 0);
    assert_true(is_wrong(&arena, PARAM_BOOL, "yes", "true or false"));
    assert_true(is_wrong(&arena, PARAM_BOOL, "truely", "true or false"));
    assert_string_equal(good(&arena, PARAM_STRING, "round one").text, "round one");
    assert_string_equal(good(&arena, PARAM_STRING, "\"quoted\"").text, "quoted");
    assert_string_equal(good(&arena, PARAM_STRING, "").text, "");
    arena_release(&arena);
}

static void ranges_and_choices_are_tested(void **state)
{
    Arena arena = {0};
    ParamValue value;
    IrParam ranged = {.name = "a", .type = PARAM_ANGLE, .ranged = true, .low = 0, .high = M_PI};
    assert_null(param_parse(&arena, &ranged, "90deg", &value));
    assert_non_null(
        strstr(param_parse(&arena, &ranged, "200deg", &value), "200deg is beyond the range 0deg .. 180deg"));
    const char *const choices[] = {"round", "square", NULL};
    IrParam chosen = {.name = "b", .type = PARAM_STRING, .choices = choices};
    assert_null(param_parse(&arena, &chosen, "square", &value));
    assert_non_null(strstr(param_parse(&arena, &chosen, "oval", &value), "round, square"));
    IrParam vector = {.name = "c", .type = PARAM_VEC3, .ranged = true, .low = 0, .high = 1};
    assert_null(param_parse(&arena, &vector, "(0, 0.5, 1)", &value));
    assert_non_null(param_parse(&arena, &vector, "(0, 2, 1)", &value));
    arena_release(&arena);
}

static void what_is_written_reads_back(void **state)
{
    static const struct {
        ParamType type;
        const char *text;
    } values[] = {
        {PARAM_BOOL, "true"},         {PARAM_INT, "-12"},           {PARAM_SCALAR, "0.125"},
        {PARAM_ANGLE, "30deg"},       {PARAM_TIME, "2.5s"},         {PARAM_VEC2, "(1, 2)"},
        {PARAM_VEC3, "(1, -2, 0.5)"}, {PARAM_COLOR, "(1, 0.5, 0)"}, {PARAM_STRING, "word"},
    };
    Arena arena = {0};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        ParamValue value = good(&arena, values[i].type, values[i].text);
        assert_string_equal(param_text(&arena, values[i].type, &value), values[i].text);
    }
    arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_have_the_unit_of_their_type),
        cmocka_unit_test(ints_are_whole),
        cmocka_unit_test(vectors_and_colors),
        cmocka_unit_test(words),
        cmocka_unit_test(ranges_and_choices_are_tested),
        cmocka_unit_test(what_is_written_reads_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
