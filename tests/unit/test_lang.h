// What the tests of lang/ share: a unit with one text, and what came of it as text that can be compared.
#ifndef SCN_TEST_LANG_H
#define SCN_TEST_LANG_H

// cmocka wants these four before it.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lang/ast.h"
#include "lang/unit.h"

// Parses a text as "test.scn". The unit is made here and released by the caller.
static inline Node *parse_bytes(Unit *unit, const char *text, size_t length)
{
    unit_init(unit);
    Source *source = source_add(&unit->sources, "test.scn", text, length, (Span){0});
    return parse_source(unit, source);
}

// What was reported, as "line:column code" in order of place, joined by ", "; "" for nothing. In the unit's arena.
static inline const char *reported(Unit *unit)
{
    const char *text = "";
    int count;
    const Diag **sorted = diag_sorted(unit, &unit->arena, &count);
    for (int i = 0; i < count; i++) {
        Place place = source_place(&unit->sources, sorted[i]->span.begin);
        text = arena_printf(&unit->arena, "%s%s%u:%u %s", text, i ? ", " : "", place.line, place.column,
                            diag_code_name(sorted[i]->code));
    }
    return text;
}

// The printed tree. The caller frees it.
__attribute__((noinline, unused)) static char *tree_text(const Unit *unit, const Node *tree)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    ast_print(unit, tree, out);
    fclose(out);
    return text;
}

// What diag_print() prints. The caller frees it.
__attribute__((noinline, unused)) static char *printed(const Unit *unit, bool color)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    diag_print(unit, out, color);
    fclose(out);
    return text;
}

// The text gives exactly these reports.
#define assert_reports(text, expected)                                                                                 \
    do {                                                                                                               \
        Unit reports_unit;                                                                                             \
        parse_bytes(&reports_unit, (text), strlen(text));                                                              \
        assert_string_equal(reported(&reports_unit), (expected));                                                      \
        unit_release(&reports_unit);                                                                                   \
    } while (0)

// The text gives this tree and no report. The tree is compared without the line of the file and its indentation.
#define assert_tree(text, expected)                                                                                    \
    do {                                                                                                               \
        Unit tree_unit;                                                                                                \
        Node *tree_file = parse_bytes(&tree_unit, (text), strlen(text));                                               \
        assert_string_equal(reported(&tree_unit), "");                                                                 \
        char *tree_printed = tree_text(&tree_unit, tree_file);                                                         \
        assert_string_equal(tree_printed, "file\n" expected);                                                          \
        free(tree_printed);                                                                                            \
        unit_release(&tree_unit);                                                                                      \
    } while (0)

#endif
