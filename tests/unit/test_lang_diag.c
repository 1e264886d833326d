#include <ctype.h>

#include "test_lang.h"

static Source *begin(Unit *unit, const char *text)
{
    unit_init(unit);
    return source_add(&unit->sources, "eye.scn", text, strlen(text), (Span){0});
}

static void assert_printed(Unit *unit, const char *expected)
{
    char *text = printed(unit, false);
    assert_string_equal(text, expected);
    free(text);
    unit_release(unit);
}

static void a_report_is_a_place_a_text_a_code_the_line_and_a_mark(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "scn 1;\nobject a = sphere(1).rotate(y: 90);\n");
    Span ninety = {s->base + 38, s->base + 40};
    Diag *d = diag(&unit, ninety, DIAG_ANGLE_UNIT, "an angle needs a unit: write %ddeg", 90);
    diag_fix(&unit, d, ninety, FIX_SURE, "90deg");
    assert_int_equal(unit.errors, 1);
    assert_printed(&unit, "eye.scn:2:32: error: an angle needs a unit: write 90deg [angle-unit]\n"
                          "    2 | object a = sphere(1).rotate(y: 90);\n"
                          "      |                                ^~\n"
                          "      = fix write `90deg` at 2:32\n");
}

static void labels_show_further_places(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "let r = 1;\nlet r = 2;\n");
    Diag *d = diag(&unit, (Span){s->base + 15, s->base + 16}, DIAG_REDEFINED, "r is already defined");
    diag_label(&unit, d, (Span){s->base + 4, s->base + 5}, "first defined here");
    diag_fix(&unit, d, (Span){s->base + 11, s->base + 21}, FIX_GUESS, "%s", "");
    assert_printed(&unit, "eye.scn:2:5: error: r is already defined [redefined]\n"
                          "    2 | let r = 2;\n"
                          "      |     ^\n"
                          "eye.scn:1:5: first defined here\n"
                          "    1 | let r = 1;\n"
                          "      |     -\n"
                          "      = perhaps remove this at 2:1\n");
}

static void the_mark_stands_below_tabs_and_wide_characters(void **state)
{
    Unit unit;
    const char *text = "\tprint \"世界\", x;";
    Source *s = begin(&unit, text);
    uint32_t x = s->base + (uint32_t)(strchr(text, 'x') - text);
    diag(&unit, (Span){x, x + 1}, DIAG_UNKNOWN_NAME, "there is no x");
    assert_printed(&unit, "eye.scn:1:14: error: there is no x [unknown-name]\n"
                          "    1 |         print \"世界\", x;\n"
                          "      |                       ^\n");
}

static void a_long_line_is_cut_around_the_mark(void **state)
{
    Unit unit;
    char text[1001];
    memset(text, 'a', 1000);
    text[1000] = 0;
    memcpy(text + 500, "WRONG", 5);
    Source *s = begin(&unit, text);
    diag(&unit, (Span){s->base + 500, s->base + 505}, DIAG_UNEXPECTED, "wrong");
    char *out = printed(&unit, false);
    char *line = strchr(out, '\n') + 1, *mark = strchr(line, '\n') + 1;
    assert_true(mark - line < 130);
    assert_non_null(strstr(line, "aWRONGa"));
    assert_non_null(strstr(line, "…"));
    // `…` takes three bytes and one column.
    assert_int_equal(strchr(mark, '^') - mark, strstr(line, "WRONG") - line - 2);
    assert_non_null(strstr(mark, "^~~~~\n"));
    free(out);
    unit_release(&unit);
}

static void a_span_of_several_lines_is_marked_on_its_first(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "let a = (1,\n2);\n");
    diag(&unit, (Span){s->base + 8, s->base + 14}, DIAG_UNEXPECTED, "wrong");
    assert_printed(&unit, "eye.scn:1:9: error: wrong [unexpected]\n"
                          "    1 | let a = (1,\n"
                          "      |         ^~~\n");
}

static void what_is_missing_is_marked_behind_the_last_character(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "let a = 1");
    Diag *d = diag(&unit, (Span){s->base + 9, s->base + 9}, DIAG_MISSING_SEMICOLON, "write `;` here");
    diag_fix(&unit, d, (Span){s->base + 9, s->base + 9}, FIX_SURE, ";");
    assert_printed(&unit, "eye.scn:1:10: error: write `;` here [missing-semicolon]\n"
                          "    1 | let a = 1\n"
                          "      |          ^\n"
                          "      = fix insert `;` at 1:10\n");
}

static void control_characters_never_reach_the_terminal(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "a\033[2Jb");
    diag(&unit, (Span){s->base, s->base + 1}, DIAG_UNKNOWN_NAME, "no \033[2J");
    char *out = printed(&unit, false);
    assert_null(strchr(out, '\033'));
    free(out);
    unit_release(&unit);
}

static void reports_are_sorted_by_place_and_duplicates_dropped(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "a b c");
    Span a = {s->base, s->base + 1}, c = {s->base + 4, s->base + 5};
    diag(&unit, c, DIAG_UNKNOWN_NAME, "third");
    diag(&unit, a, DIAG_UNKNOWN_NAME, "first");
    Diag *again = diag(&unit, c, DIAG_UNKNOWN_NAME, "third again");
    diag_label(&unit, again, a, "nobody sees this");
    diag_fix(&unit, again, a, FIX_SURE, "nor this");
    diag(&unit, a, DIAG_UNUSED, "second");
    assert_int_equal(unit.errors, 2);
    assert_int_equal(unit.warnings, 1);
    int count;
    const Diag **sorted = diag_sorted(&unit, &unit.arena, &count);
    assert_int_equal(count, 3);
    assert_string_equal(sorted[0]->text, "first");
    assert_string_equal(sorted[1]->text, "second");
    assert_string_equal(sorted[2]->text, "third");
    unit_release(&unit);
}

static int count_of(const char *text, const char *part)
{
    int count = 0;
    for (; (text = strstr(text, part)); text += strlen(part)) count++;
    return count;
}

static void after_twenty_errors_the_rest_is_counted(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "abcdefghijklmnopqrstuvwxyz");
    for (uint32_t i = 0; i < 25; i++) diag(&unit, (Span){s->base + i, s->base + i + 1}, DIAG_UNKNOWN_NAME, "wrong");
    char *out = printed(&unit, false);
    assert_int_equal(count_of(out, "error:"), 20);
    assert_non_null(strstr(out, "\n5 more errors are not shown\n"));
    free(out);
    unit.diagnostics.shown_limit = 24;
    out = printed(&unit, false);
    assert_int_equal(count_of(out, "error:"), 24);
    assert_non_null(strstr(out, "\n1 more error is not shown\n"));
    free(out);
    unit_release(&unit);
}

static void of_a_flood_only_the_count_is_kept(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "x");
    for (uint32_t i = 0; i < 200000; i++) diag(&unit, (Span){s->base, s->base + 2 + i}, DIAG_UNEXPECTED, "wrong %u", i);
    assert_int_equal(unit.errors, 200000);
    assert_true(unit.arena.used < 1 << 20);
    unit_release(&unit);
}

static void warnings_can_be_errors(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "x");
    unit.diagnostics.warnings_are_errors = true;
    diag(&unit, (Span){s->base, s->base + 1}, DIAG_UNUSED, "unused");
    assert_int_equal(unit.errors, 1);
    assert_int_equal(unit.warnings, 0);
    unit_release(&unit);
}

// Reports `unused` and `shadow` under settings and gives what became of them: "error", "warning" or "off" of each.
static void assert_levels(const char *settings, const char *expected)
{
    Unit unit;
    Source *s = begin(&unit, "xy");
    char copy[100];
    strcpy(copy, settings);
    for (char *word = strtok(copy, " "); word; word = strtok(NULL, " "))
        assert_null(diag_set_warning(&unit.arena, &unit.diagnostics, word));
    diag(&unit, (Span){s->base, s->base + 1}, DIAG_UNUSED, "unused");
    diag(&unit, (Span){s->base, s->base + 2}, DIAG_SHADOW, "shadow");
    const char *words[2] = {"off", "off"};
    for (const Diag *d = unit.diagnostics.first; d; d = d->next)
        words[d->code == DIAG_SHADOW] = d->severity == SEVERITY_ERROR ? "error" : "warning";
    assert_string_equal(arena_printf(&unit.arena, "%s %s", words[0], words[1]), expected);
    unit_release(&unit);
}

static void warnings_are_set_by_name_and_the_last_setting_wins(void **state)
{
    assert_levels("", "warning warning");
    assert_levels("no-unused", "off warning");
    assert_levels("no-unused unused", "warning warning");
    assert_levels("error", "error error");
    assert_levels("error no-error", "warning warning");
    assert_levels("error no-unused", "off error");
    assert_levels("error=unused", "error warning");
    assert_levels("error=unused unused", "error warning");
    assert_levels("error no-error=unused", "warning error");
    assert_levels("none", "off off");
    assert_levels("none shadow", "off warning");
    assert_levels("none all", "warning warning");
}

static void a_setting_of_no_warning_is_refused(void **state)
{
    Unit unit;
    begin(&unit, "x");
    assert_string_equal(diag_set_warning(&unit.arena, &unit.diagnostics, "no-unusde"),
                        "there is no warning unusde: do you mean unused?");
    assert_string_equal(diag_set_warning(&unit.arena, &unit.diagnostics, "no-unexpected"),
                        "unexpected is an error, and always reported");
    assert_non_null(strstr(diag_set_warning(&unit.arena, &unit.diagnostics, "error=zzz"), "there are shadow, unused"));
    unit_release(&unit);
}

static void a_report_in_an_included_file_shows_the_way_there(void **state)
{
    Unit unit;
    Source *outer = begin(&unit, "scn 1;\ninclude \"parts.scn\";\n");
    Source *parts =
        source_add(&unit.sources, "parts.scn", "include \"eye.scn\";", 18, (Span){outer->base + 7, outer->base + 27});
    Source *eye = source_add(&unit.sources, "deep.scn", "oops", 4, (Span){parts->base, parts->base + 18});
    diag(&unit, (Span){eye->base, eye->base + 4}, DIAG_UNKNOWN_NAME, "there is no oops");
    assert_printed(&unit, "deep.scn:1:1: error: there is no oops [unknown-name]\n"
                          "    1 | oops\n"
                          "      | ^~~~\n"
                          "      included from parts.scn:1:1\n"
                          "      included from eye.scn:2:1\n");
}

static void a_report_without_a_place_has_no_line(void **state)
{
    Unit unit;
    begin(&unit, "x");
    diag(&unit, (Span){0}, DIAG_EMPTY_SCENE, "nothing is shown");
    assert_printed(&unit, "scn: warning: nothing is shown [empty-scene]\n");
}

static void colours_are_used_only_when_asked_for(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "x");
    diag(&unit, (Span){s->base, s->base + 1}, DIAG_UNKNOWN_NAME, "no x");
    char *out = printed(&unit, true);
    assert_non_null(strstr(out, "\033[1;31merror:\033[0m"));
    free(out);
    out = printed(&unit, false);
    assert_null(strchr(out, '\033'));
    free(out);
    unit_release(&unit);
}

static void every_code_has_a_name_an_explanation_and_two_examples(void **state)
{
    for (int i = 0; i < DIAG_COUNT; i++) {
        DiagCode code = (DiagCode)i, found;
        const char *name = diag_code_name(code);
        for (const char *c = name; *c; c++) assert_true(islower((unsigned char)*c) || *c == '-');
        assert_true(diag_code_find(name, &found));
        assert_int_equal(found, code); // so names are unique
        const char *text = diag_explanation(code);
        if (strlen(text) < 60 || text[strlen(text) - 1] != '.') fail_msg("%s: an explanation is whole sentences", name);
        const char *wrong = diag_wrong_example(code), *right = diag_right_example(code);
        if (!*wrong || !*right || wrong[strlen(wrong) - 1] != '\n' || right[strlen(right) - 1] != '\n')
            fail_msg("%s: examples are lines", name);
    }
    DiagCode code;
    assert_false(diag_code_find("no-such-code", &code));
}

// What scanner and parser report, their own examples show. The rest is reported by later phases, whose examples must at least
// be read without an error.
static void the_examples_are_what_they_say(void **state)
{
    for (int i = 0; i < DIAG_COUNT; i++) {
        const char *name = diag_code_name((DiagCode)i);
        Unit unit;
        parse_bytes(&unit, diag_right_example((DiagCode)i), strlen(diag_right_example((DiagCode)i)));
        if (unit.errors) fail_msg("%s: the right example reports %s", name, reported(&unit));
        unit_release(&unit);
        parse_bytes(&unit, diag_wrong_example((DiagCode)i), strlen(diag_wrong_example((DiagCode)i)));
        bool ours = i <= DIAG_VERSION_NEWER || i == DIAG_MISPLACED;
        if (ours) {
            if (unit.errors != 1 || unit.diagnostics.first->code != (DiagCode)i) {
                fail_msg("%s: the wrong example reports %s", name, reported(&unit));
            }
        } else if (unit.errors) {
            fail_msg("%s: the wrong example reports %s", name, reported(&unit));
        }
        unit_release(&unit);
    }
}

static void what_is_taken_back_was_never_said(void **state)
{
    Unit unit;
    Source *s = begin(&unit, "let a = ;\n");
    Span at = {s->base + 8, s->base + 9};
    Diag *first = diag(&unit, (Span){s->base, s->base + 3}, DIAG_UNKNOWN_NAME, "first");
    Diag *second = diag(&unit, at, DIAG_UNEXPECTED, "second");
    diag_take_back(&unit, second);
    assert_int_equal(unit.errors, 1);
    assert_ptr_equal(unit.diagnostics.last, first);
    diag_take_back(&unit, first);
    assert_int_equal(unit.errors, 0);
    assert_null(unit.diagnostics.first);
    diag(&unit, at, DIAG_UNEXPECTED, "third"); // at the place of one that was taken back
    assert_int_equal(unit.errors, 1);
    assert_printed(&unit, "eye.scn:1:9: error: third [unexpected]\n"
                          "    1 | let a = ;\n"
                          "      |         ^\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_report_is_a_place_a_text_a_code_the_line_and_a_mark),
        cmocka_unit_test(labels_show_further_places),
        cmocka_unit_test(the_mark_stands_below_tabs_and_wide_characters),
        cmocka_unit_test(a_long_line_is_cut_around_the_mark),
        cmocka_unit_test(a_span_of_several_lines_is_marked_on_its_first),
        cmocka_unit_test(what_is_missing_is_marked_behind_the_last_character),
        cmocka_unit_test(control_characters_never_reach_the_terminal),
        cmocka_unit_test(reports_are_sorted_by_place_and_duplicates_dropped),
        cmocka_unit_test(what_is_taken_back_was_never_said),
        cmocka_unit_test(after_twenty_errors_the_rest_is_counted),
        cmocka_unit_test(of_a_flood_only_the_count_is_kept),
        cmocka_unit_test(warnings_can_be_errors),
        cmocka_unit_test(warnings_are_set_by_name_and_the_last_setting_wins),
        cmocka_unit_test(a_setting_of_no_warning_is_refused),
        cmocka_unit_test(a_report_in_an_included_file_shows_the_way_there),
        cmocka_unit_test(a_report_without_a_place_has_no_line),
        cmocka_unit_test(colours_are_used_only_when_asked_for),
        cmocka_unit_test(every_code_has_a_name_an_explanation_and_two_examples),
        cmocka_unit_test(the_examples_are_what_they_say),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
