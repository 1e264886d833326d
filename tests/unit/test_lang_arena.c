#include "test_lang.h"

static void memory_is_zeroed_and_aligned(void **state)
{
    Arena arena = {0};
    for (size_t size = 0; size < 5000; size += 7) {
        char *memory = arena_alloc(&arena, size);
        assert_non_null(memory);
        assert_int_equal((uintptr_t)memory % 8, 0);
        for (size_t i = 0; i < size; i++) assert_int_equal(memory[i], 0);
        memset(memory, 0xAA, size);
    }
    typedef struct {
        long double wide;
    } Wide;
    arena_text(&arena, "x", 1);
    assert_int_equal((uintptr_t)arena_new(&arena, Wide) % alignof(Wide), 0);
    arena_release(&arena);
}

static void allocations_do_not_overlap(void **state)
{
    enum { COUNT = 20000 };
    Arena arena = {0};
    unsigned char **all = calloc(COUNT, sizeof *all);
    for (int i = 0; i < COUNT; i++) {
        size_t size = (size_t)(i * 37 % 900) + 1;
        all[i] = arena_alloc(&arena, size);
        memset(all[i], i & 255, size);
    }
    for (int i = 0; i < COUNT; i++) {
        size_t size = (size_t)(i * 37 % 900) + 1;
        for (size_t j = 0; j < size; j++) assert_int_equal(all[i][j], i & 255);
    }
    free(all);
    arena_release(&arena);
}

static void a_large_request_does_not_waste_the_newest_block(void **state)
{
    Arena arena = {0};
    char *before = arena_alloc(&arena, 64);
    char *large = arena_alloc(&arena, 10 << 20);
    large[(10 << 20) - 1] = 1;
    char *after = arena_alloc(&arena, 64);
    assert_ptr_equal(after, before + 64);
    arena_release(&arena);
}

static void empty_allocations_are_different_places(void **state)
{
    Arena arena = {0};
    assert_ptr_not_equal(arena_alloc(&arena, 0), arena_alloc(&arena, 0));
    arena_release(&arena);
}

static void texts_are_copied_and_terminated(void **state)
{
    Arena arena = {0};
    assert_string_equal(arena_text(&arena, "sphere(1)", 6), "sphere");
    assert_string_equal(arena_text(&arena, NULL, 0), "");
    assert_string_equal(arena_printf(&arena, "%s %d", "F", 3), "F 3");
    char *long_text = arena_printf(&arena, "%50000d", 7);
    assert_int_equal(strlen(long_text), 50000);
    arena_release(&arena);
}

static void a_released_arena_can_be_used_again(void **state)
{
    Arena arena = {0};
    arena_alloc(&arena, 1000);
    arena_release(&arena);
    assert_int_equal(arena.used, 0);
    assert_non_null(arena_alloc(&arena, 1000));
    arena_release(&arena);
    arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(memory_is_zeroed_and_aligned),
        cmocka_unit_test(allocations_do_not_overlap),
        cmocka_unit_test(a_large_request_does_not_waste_the_newest_block),
        cmocka_unit_test(empty_allocations_are_different_places),
        cmocka_unit_test(texts_are_copied_and_terminated),
        cmocka_unit_test(a_released_arena_can_be_used_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
