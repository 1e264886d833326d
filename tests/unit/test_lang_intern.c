#include "test_lang.h"

static void equal_texts_are_equal_pointers(void **state)
{
    Arena arena = {0};
    Names names = {.arena = &arena};
    Name sphere = name_text(&names, "sphere");
    assert_ptr_equal(name_of(&names, "sphere(1)", 6), sphere);
    assert_ptr_not_equal(name_text(&names, "spher"), sphere);
    assert_ptr_not_equal(name_text(&names, "Sphere"), sphere);
    assert_string_equal(sphere, "sphere");
    assert_ptr_equal(name_text(&names, ""), name_of(&names, "x", 0));
    arena_release(&arena);
}

static void names_stay_where_they_are_while_the_table_grows(void **state)
{
    enum { COUNT = 50000 };
    Arena arena = {0};
    Names names = {.arena = &arena};
    Name *all = calloc(COUNT, sizeof *all);
    for (int i = 0; i < COUNT; i++) {
        char text[16];
        all[i] = name_of(&names, text, (size_t)snprintf(text, sizeof text, "name%d", i));
    }
    assert_int_equal(names.count, COUNT);
    for (int i = 0; i < COUNT; i++) {
        char text[16];
        snprintf(text, sizeof text, "name%d", i);
        assert_ptr_equal(name_text(&names, text), all[i]);
    }
    free(all);
    arena_release(&arena);
}

static const char *const words[] = {"sphere", "ellipsoid", "cylinder", "fov", "eye",
                                    "radius", "rotate",    "strength", "x",   "ry"};
#define NEAREST(wrong) nearest_name(wrong, words, (int)(sizeof words / sizeof *words))

static void the_nearest_name_is_the_one_that_was_meant(void **state)
{
    assert_string_equal(NEAREST("shpere"), "sphere");      // swapped
    assert_string_equal(NEAREST("spere"), "sphere");       // left out
    assert_string_equal(NEAREST("spheres"), "sphere");     // one too many
    assert_string_equal(NEAREST("spxere"), "sphere");      // a wrong one
    assert_string_equal(NEAREST("SPHERE"), "sphere");      // a letter in the wrong case is half a mistake
    assert_string_equal(NEAREST("elipsiod"), "ellipsoid"); // two mistakes in a long name
    assert_string_equal(NEAREST("fv"), "fov");
    assert_string_equal(NEAREST("X"), "x");
}

static void what_is_far_from_all_is_not_guessed(void **state)
{
    assert_null(NEAREST("banana"));
    assert_null(NEAREST("sp"));
    assert_null(NEAREST(""));
    assert_null(NEAREST("q"));
    assert_null(NEAREST("sphere")); // no suggestion for what is right
    assert_null(NEAREST("a_name_that_is_longer_than_anything_that_is_typed_by_hand_and_mistyped"));
    assert_null(nearest_name("sphere", NULL, 0));
}

static void of_equally_near_names_the_first_in_the_alphabet_is_given(void **state)
{
    static const char *const alike[] = {"cat", "bat", "hat"}; // in whatever order a hash table gives them
    assert_string_equal(nearest_name("rat", alike, 3), "bat");
    assert_string_equal(nearest_name("hatt", alike, 3), "hat");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_texts_are_equal_pointers),
        cmocka_unit_test(names_stay_where_they_are_while_the_table_grows),
        cmocka_unit_test(the_nearest_name_is_the_one_that_was_meant),
        cmocka_unit_test(what_is_far_from_all_is_not_guessed),
        cmocka_unit_test(of_equally_near_names_the_first_in_the_alphabet_is_given),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
