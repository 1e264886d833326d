// What `scn explain` shows: each wrong example gets its diagnostic and nothing else, each right one nothing at all.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "compiler/compile.h"

// Examples that need files have these beside them.
static const struct {
    const char *path, *text;
} files[] = {
    {"parts/eye.scn", "let eye = sphere(1);\n"},
    {"eye.scn", "let eye = sphere(1);\n"},
    {"common.scn", "let shared = 1;\n"},
    {"this.scn", "include \"this.scn\";\n"},
};

static int make_files(void **state)
{
    static char folder[] = "/tmp/scn-examples-XXXXXX";
    if (!mkdtemp(folder) || chdir(folder) != 0 || mkdir("parts", 0777) != 0) return -1;
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        FILE *out = fopen(files[i].path, "w");
        if (!out) return -1;
        fputs(files[i].text, out);
        fclose(out);
    }
    *state = folder;
    return 0;
}

static int remove_files(void **state)
{
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) unlink(files[i].path);
    rmdir("parts");
    return chdir("/") || rmdir(*state);
}

// The codes that a text gets, joined by spaces. In the unit's arena. Examples define things without showing them, and use what the
// compiler is still to learn.
static const char *codes_of(Unit *unit, DiagCode about, const char *text)
{
    unit_init(unit);
    Source *source = source_add(&unit->sources, "example.scn", text, strlen(text), (Span){0});
    compile(unit, source, &(CompileOptions){.unused = true});
    const char *codes = "";
    int count;
    const Diag **sorted = diag_sorted(unit, &unit->arena, &count);
    for (int i = 0; i < count; i++) {
        bool beside = sorted[i]->code == DIAG_EMPTY_SCENE || sorted[i]->code == DIAG_NOT_YET;
        if (beside && sorted[i]->code != about) continue;
        codes = arena_printf(&unit->arena, "%s%s%s", codes, *codes ? " " : "", diag_code_name(sorted[i]->code));
    }
    return codes;
}

// What a small text cannot show, what takes seconds (tests/check has it), what the runtime reports, and what changes with every version.
static bool is_not_shown(DiagCode code)
{
    switch (code) {
    case DIAG_TOO_LARGE:
    case DIAG_TOO_MANY_ITEMS:
    case DIAG_PATCH_STEP:
    case DIAG_PATCH_DIVERGES:
    case DIAG_MORPH_RANGE:
    case DIAG_NOT_YET: return true;
    default: return false;
    }
}

static void wrong_examples_get_their_diagnostic_alone(void **state)
{
    int failed = 0;
    for (int i = 0; i < DIAG_COUNT; i++) {
        const char *name = diag_code_name((DiagCode)i);
        if (is_not_shown((DiagCode)i)) continue;
        Unit unit;
        const char *codes = codes_of(&unit, (DiagCode)i, diag_wrong_example((DiagCode)i));
        if (strcmp(codes, name) != 0) print_error("%s: the wrong example gets \"%s\"\n", name, codes), failed++;
        unit_release(&unit);
    }
    assert_int_equal(failed, 0);
}

static void right_examples_get_nothing(void **state)
{
    int failed = 0;
    for (int i = 0; i < DIAG_COUNT; i++) {
        const char *name = diag_code_name((DiagCode)i);
        if (is_not_shown((DiagCode)i)) continue;
        Unit unit;
        const char *codes = codes_of(&unit, (DiagCode)i, diag_right_example((DiagCode)i));
        if (*codes) print_error("%s: the right example gets \"%s\"\n", name, codes), failed++;
        unit_release(&unit);
    }
    assert_int_equal(failed, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(wrong_examples_get_their_diagnostic_alone),
        cmocka_unit_test(right_examples_get_nothing),
    };
    return cmocka_run_group_tests(tests, make_files, remove_files);
}
