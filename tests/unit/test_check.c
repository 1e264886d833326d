// Types, the table of what is built in, and that neither the length nor the order of a scene matters to the checker.
#include "test_lang.h"

#include "compiler/builtins.h"
#include "compiler/check.h"
#include "compiler/elaborate.h"
#include "compiler/program.h"

// --- types

static void only_some_conversions_happen_by_themselves(void **state)
{
    Type scalar = type_number(0, 0), angle = type_number(1, 0), zero = {.kind = TYPE_INT, .zero = true};
    assert_true(type_converts(type_of(TYPE_INT), scalar));
    assert_false(type_converts(scalar, type_of(TYPE_INT)));
    assert_true(type_converts(type_of(TYPE_QUADRIC), type_of(TYPE_OBJECT)));
    assert_false(type_converts(type_of(TYPE_OBJECT), type_of(TYPE_QUADRIC)));
    assert_true(type_converts(type_of(TYPE_VEC3), type_of(TYPE_COLOR)));
    assert_false(type_converts(type_of(TYPE_COLOR), type_of(TYPE_VEC3)));
    assert_true(type_converts(type_of(TYPE_PATCH), type_of(TYPE_OBJECT)));
    assert_false(type_converts(scalar, angle));
    assert_true(type_converts(zero, angle));
    assert_true(type_converts(type_list(type_of(TYPE_INT)), type_list(scalar)));
    assert_true(type_converts(type_list(type_of(TYPE_ANY)), type_list(angle)));
    assert_false(type_converts(scalar, type_list(scalar)));
    assert_true(type_converts(type_of(TYPE_ERROR), angle));
}

static void types_are_written_as_authors_write_them(void **state)
{
    Arena arena = {0};
    assert_string_equal(type_text(&arena, type_number(0, 0)), "scalar");
    assert_string_equal(type_text(&arena, type_number(1, 0)), "angle");
    assert_string_equal(type_text(&arena, type_number(1, -1)), "angle/time");
    assert_string_equal(type_text(&arena, type_number(0, -2)), "1/time^2");
    assert_string_equal(type_text(&arena, type_list(type_list(type_of(TYPE_VEC3)))), "[[vec3]]");
    assert_string_equal(type_phrase(&arena, type_list(type_of(TYPE_OBJECT))), "a list of objects");
    assert_string_equal(type_phrase(&arena, type_number(0, 1)), "a time");
    for (int i = 0; type_names[i]; i++) {
        Type type;
        assert_true(type_named(type_names[i], &type));
        assert_string_equal(type_text(&arena, type), type_names[i]);
    }
    arena_release(&arena);
}

// --- the table

static void every_signature_reads(void **state)
{
    Unit unit;
    unit_init(&unit);
    for (int id = 0; id < BUILTIN_END; id++) {
        assert_true(strlen(builtins[id].doc) > 0);
        if (builtins[id].kind == KIND_CONSTANT) {
            assert_false(type_bad(builtin_constant_type((BuiltinId)id)));
            continue;
        }
        Callable *callable = builtin_callable(&unit, (BuiltinId)id);
        assert_ptr_equal(callable->name, builtin_name(&unit, (BuiltinId)id));
        for (uint32_t i = 0; i < callable->count; i++) {
            const Parameter *p = &callable->parameters[i];
            assert_false(type_bad(p->type));
            if (!p->choices) continue;
            // The default is one of the choices.
            bool found = false;
            for (int k = 0; p->choices[k]; k++)
                found |= !strncmp(p->default_text + 1, p->choices[k], strlen(p->choices[k]));
            assert_true(found);
        }
    }
    unit_release(&unit);
}

// --- scenes that are made

static const char *checked(Unit *unit, const char *text)
{
    Node *tree = parse_bytes(unit, text, strlen(text));
    check(unit, tree);
    ElaborateOptions options = {0};
    if (!unit->errors) elaborate(unit, tree, &options);
    return reported(unit);
}

static char *made(const char *head, const char *line, int count, const char *tail)
{
    char *text;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    fputs(head, out);
    for (int i = 0; i < count; i++) fprintf(out, line, i, i + 1);
    fputs(tail, out);
    fclose(out);
    return text;
}

static void assert_good(char *text)
{
    Unit unit;
    assert_string_equal(checked(&unit, text), "");
    unit_release(&unit);
    free(text);
}

enum { MANY = 50000 };

static void definitions_may_wait_for_each_other_in_long_chains(void **state)
{
    // Each for the next one, so all are wanted before the last is known.
    assert_good(made("sphere(a0);\n", "let a%d = a%d + 1;\n", MANY, "let a50000 = 1;\nassert a0 == 50001;\n"));
    assert_good(made("let b0 = 1;\n", "let b%2$d = b%1$d + 1;\n", MANY, "sphere(b50000);\n"));
    assert_good(made("object o { let c0 = 1;\n", "let c%2$d = c%1$d + 1;\n", MANY / 5, "sphere(c10000); }\no;\n"));
    assert_good(made("sphere(f0());\n", "fn f%d() { f%d() }\n", 500, "fn f500() { 1 }\n"));
}

static void a_long_circle_is_one_message(void **state)
{
    char *text = made("sphere(a0);\n", "let a%d = a%d + 1;\n", MANY, "let a50000 = a0;\n");
    Unit unit;
    const char *said = checked(&unit, text);
    assert_int_equal(unit.errors, 1);
    assert_non_null(strstr(said, "cyclic-definition"));
    unit_release(&unit);
    free(text);
}

static void chains_of_operators_and_dots_may_be_long(void **state)
{
    assert_good(made("sphere(1)", " | sphere(%d + 1)", MANY, ";\n"));
    assert_good(made("sphere(1)", " - sphere(%d + 2).move(0, 5, 0)", MANY, ";\n"));
    assert_good(made("sphere(1)", ".move(%d, 0, 0)", MANY, ";\n"));
    assert_good(made("let a = 1", " + %d", MANY, ";\nsphere(a);\n"));
    assert_good(made("union(sphere(1)", ", sphere(%d + 1)", MANY, ");\n"));
}

static void an_unknown_name_is_told_once(void **state)
{
    char *text = made("", "let known%d = 1;\nlet b%d = unknown;\n", MANY / 10, "");
    Unit unit;
    checked(&unit, text);
    assert_int_equal(unit.errors, 1);
    unit_release(&unit);
    free(text);
}

static void many_unknown_names_are_told_quickly(void **state)
{
    char *text = made("let known = 1;\n", "let b%d = unknown%d;\n", MANY / 10, "");
    Unit unit;
    checked(&unit, text);
    assert_int_equal(unit.errors, MANY / 10);
    unit_release(&unit);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(only_some_conversions_happen_by_themselves),
        cmocka_unit_test(types_are_written_as_authors_write_them),
        cmocka_unit_test(every_signature_reads),
        cmocka_unit_test(definitions_may_wait_for_each_other_in_long_chains),
        cmocka_unit_test(a_long_circle_is_one_message),
        cmocka_unit_test(chains_of_operators_and_dots_may_be_long),
        cmocka_unit_test(an_unknown_name_is_told_once),
        cmocka_unit_test(many_unknown_names_are_told_quickly),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
