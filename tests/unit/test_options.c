// The command line: what is understood, and what is said about the rest.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/film.h"
#include "runtime/options.h"
#include "runtime/progress.h"

static Options parsed;

// Parses the words up to NULL behind "scn".
static bool parse(const char *first, ...)
{
    char name[] = "scn", *words[32] = {name};
    int count = 1;
    va_list more;
    va_start(more, first);
    for (const char *word = first; word; word = va_arg(more, const char *)) words[count++] = (char *)(uintptr_t)word;
    va_end(more);
    return options_parse(&parsed, count, words);
}

static void assert_says(const char *part)
{
    if (!strstr(parsed.error, part)) fail_msg("\"%s\" is not in \"%s\"", part, parsed.error);
}

static void a_rendering_with_everything(void **state)
{
    assert_true(parse("render", "eye.scn", "-o", "a.exr", "-ob.png", "--size", "640x480", "--frames=3..7",
                      "-Dlift=30deg", "-D", "n=4", "--layers", "color,id", "-j2", "--samples", "4", "-q", NULL));
    assert_int_equal(parsed.command, COMMAND_RENDER);
    assert_int_equal(parsed.file_count, 1);
    assert_string_equal(parsed.outputs[0], "a.exr");
    assert_string_equal(parsed.outputs[1], "b.png");
    assert_int_equal(parsed.width, 640);
    assert_int_equal(parsed.height, 480);
    assert_int_equal(parsed.first_frame, 3);
    assert_int_equal(parsed.last_frame, 7);
    assert_string_equal(parsed.defines[0], "lift=30deg");
    assert_string_equal(parsed.defines[1], "n=4");
    assert_int_equal(parsed.layers, FILM_COLOR | FILM_ID);
    assert_int_equal(parsed.threads, 2);
    assert_int_equal(parsed.samples, 4);
    assert_true(parsed.quiet);
}

static void options_stand_anywhere_and_end_at_two_dashes(void **state)
{
    assert_true(parse("check", "--strict", "--", "-odd.scn", "--strict", NULL));
    assert_int_equal(parsed.file_count, 2);
    assert_string_equal(parsed.files[0], "-odd.scn");
    assert_string_equal(parsed.files[1], "--strict");
    assert_true(parse("check", "-", NULL)); // standard input
    assert_string_equal(parsed.files[0], "-");
}

static void misspelt_words_are_told_with_the_nearest(void **state)
{
    assert_false(parse("rendr", NULL));
    assert_says("do you mean render?");
    assert_false(parse("render", "a.scn", "--sise", "1x1", NULL));
    assert_says("do you mean --size?");
    assert_false(parse("render", "a.scn", "--layers", "color,dept", NULL));
    assert_says("do you mean depth?");
    assert_false(parse("eye.scn", NULL));
    assert_says("scn render eye.scn");
    assert_false(parse("render", "a.scn", "-z", NULL));
    assert_says("scn help render");
}

static void an_option_of_another_command_is_told_as_that(void **state)
{
    assert_false(parse("check", "a.scn", "--size", "1x1", NULL));
    assert_says("render, run, slice, doc, bench");
}

static void wrong_values_are_told_with_what_is_wanted(void **state)
{
    static const char *const cases[][3] = {
        {"--size", "640", "WIDTHxHEIGHT"},
        {"--size", "0x10", "WIDTHxHEIGHT"},
        {"--size", "40000x10", "32768"},
        {"--size", "10x10x10", "1280x720"},
        {"--frames", "a..b", "A..B"},
        {"--frames", "7..3", "write 3..7"},
        {"--frames", "-1..3", "A..B"},
        {"--samples", "0", "1 to 16"},
        {"--threads", "many", "whole number"},
        {"--lanes", "8", "1 or 16"},
        {"--bits", "12", "8 or 16"},
        {"-D", "lift", "NAME=VALUE"},
        {"-D", "=3", "NAME=VALUE"},
        {"--color", "red", "auto, always or never"},
        {"--layers", "", "at least one"},
        {"--layers", "colour", "color"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        assert_false(parse("render", "a.scn", cases[i][0], cases[i][1], NULL));
        assert_says(cases[i][2]);
    }
}

static void what_is_missing_or_too_much_is_told(void **state)
{
    assert_false(parse("render", NULL));
    assert_says("wants a file");
    assert_false(parse("render", "a.scn", "b.scn", NULL));
    assert_says("b.scn");
    assert_false(parse("render", "a.scn", "-o", NULL));
    assert_says("-o wants a value");
    assert_false(parse("render", "a.scn", "--size", NULL));
    assert_says("--size wants a value");
    assert_false(parse("render", "a.scn", "--quiet=yes", NULL));
    assert_says("takes no value");
    assert_false(parse("devices", "x", NULL));
    assert_says("nothing but options");
    assert_false(parse("render", "a.scn", "--half", "--float", NULL));
    assert_says("exclude");
    assert_false(parse("render", "a.scn", "--time", "1s", "--frames", "1..2", NULL));
    assert_says("exclude");
}

static void help_is_always_there(void **state)
{
    assert_true(parse(NULL, NULL));
    assert_true(parsed.help);
    assert_true(parse("render", "--help", NULL)); // without a file
    assert_true(parsed.help);
    assert_true(parse("--version", NULL));
    assert_int_equal(parsed.command, COMMAND_VERSION);
    for (int command = 0; command <= COMMAND_COUNT; command++) {
        char *text = NULL;
        size_t size = 0;
        FILE *out = open_memstream(&text, &size);
        options_help(out, (CommandId)command);
        fclose(out);
        assert_non_null(strstr(text, "Exit status"));
        free(text);
    }
}

static void times_have_units(void **state)
{
    double seconds;
    assert_true(options_time("1.5s", 24, &seconds) && seconds == 1.5);
    assert_true(options_time("300ms", 24, &seconds) && fabs(seconds - 0.3) < 1e-15);
    assert_true(options_time("12f", 24, &seconds) && seconds == 0.5);
    assert_true(options_time("2", 24, &seconds) && seconds == 2);
    assert_false(options_time("", 24, &seconds));
    assert_false(options_time("1min", 24, &seconds));
    assert_false(options_time("inf", 24, &seconds));
}

static void the_bar_fits_its_terminal(void **state)
{
    char text[512];
    progress_text(text, sizeof text, 120, 240, 14.4, 80);
    assert_non_null(strstr(text, " 120/240  8.3 frames/s  0:14 left"));
    progress_text(text, sizeof text, 1, 3, 75, 80);
    assert_non_null(strstr(text, "75.0 s a frame  2:30 left"));
    progress_text(text, sizeof text, 0, 3, 0, 12);
    assert_string_equal(text, "▕     ▏ 0/3");
    progress_text(text, sizeof text, 0.5, 3, 2, 80); // half of the first frame
    assert_non_null(strstr(text, " 0/3  0:10 left"));
    progress_text(text, sizeof text, 0.25, 1, 5, 80);
    assert_non_null(strstr(text, " 25%  0:15 left"));
    progress_text(text, sizeof text, 1, 90000, 1, 30); // no room for a bar
    assert_null(strstr(text, "▕"));
    assert_non_null(strstr(text, "24:59:59 left"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_rendering_with_everything),
        cmocka_unit_test(options_stand_anywhere_and_end_at_two_dashes),
        cmocka_unit_test(misspelt_words_are_told_with_the_nearest),
        cmocka_unit_test(an_option_of_another_command_is_told_as_that),
        cmocka_unit_test(wrong_values_are_told_with_what_is_wanted),
        cmocka_unit_test(what_is_missing_or_too_much_is_told),
        cmocka_unit_test(help_is_always_there),
        cmocka_unit_test(times_have_units),
        cmocka_unit_test(the_bar_fits_its_terminal),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
