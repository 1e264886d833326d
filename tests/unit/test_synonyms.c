// The table of synonyms: each leads to something that there is.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <string.h>

#include "compiler/builtins.h"
#include "compiler/synonyms.h"
#include "lang/source.h"
#include "stdlib_text.h"

typedef struct Synonym {
    const char *written, *ours;
} Synonym;

static const Synonym synonyms[] = {
#define SYNONYM(written, ours) {written, ours},
#include "compiler/synonyms.def"
};

enum { COUNT = sizeof synonyms / sizeof *synonyms };

static void they_stand_in_the_order_of_the_alphabet(void **state)
{
    for (int i = 1; i < COUNT; i++) assert_true(strcmp(synonyms[i - 1].written, synonyms[i].written) < 0);
}

// True if a word stands in a text by itself.
static bool says(const char *text, const char *word, size_t length)
{
    for (const char *at = text; (at = strstr(at, word)); at++) {
        bool begins = at == text || !(at[-1] == '_' || (at[-1] >= 'a' && at[-1] <= 'z'));
        char behind = at[length];
        if (begins && !(behind == '_' || (behind >= 'a' && behind <= 'z') || (behind >= '0' && behind <= '9')))
            return true;
    }
    return false;
}

static bool there_is(const char *word, size_t length)
{
    static const char *const tables =
#define BUILTIN(id, kind, since, signature, documentation) " " signature
#include "compiler/builtins.def"
        ;
    char name[64] = {0};
    memcpy(name, word, length);
    if (says(tables, name, length)) return true;
    for (const stdlib_text_file *file = stdlib_text_files; file->name; file++) {
        if (says((const char *)file->text, name, length)) return true;
    }
    return false;
}

static void each_leads_to_a_name_or_an_argument(void **state)
{
    for (int i = 0; i < COUNT; i++) {
        for (const char *word = synonyms[i].ours; *word;) {
            size_t length = strcspn(word, " ");
            bool expression = strpbrk(synonyms[i].ours, "#~^.") != NULL || !strcmp(synonyms[i].ours, "print");
            if (!expression && !there_is(word, length))
                fail_msg("%s: there is no %s", synonyms[i].written, synonyms[i].ours);
            word += length + (word[length] == ' ');
        }
    }
}

static void the_first_that_there_is_counts(void **state)
{
    static const char *const of_camera[] = {"eye", "look_at", "fov"}, *const of_light[] = {"direction", "at", "color"};
    assert_string_equal(synonym_of("location", of_camera, 3), "eye");
    assert_string_equal(synonym_of("location", of_light, 3), "at");
    assert_string_equal(synonym_of("Colour", of_light, 3), "color");
    assert_null(synonym_of("colour", of_camera, 3));
    assert_string_equal(synonym_of("red", of_camera, 3), "#ff0000");
    assert_string_equal(suggested_name("eyes", of_camera, 3), "eye");
    assert_null(suggested_name("sphere", of_camera, 3));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(they_stand_in_the_order_of_the_alphabet),
        cmocka_unit_test(each_leads_to_a_name_or_an_argument),
        cmocka_unit_test(the_first_that_there_is_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
