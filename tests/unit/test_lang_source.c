#include <errno.h>
#include <unistd.h>

#include "lang/utf8.h"
#include "test_lang.h"

static Source *add(Unit *unit, const char *path, const char *text)
{
    return source_add(&unit->sources, path, text, strlen(text), (Span){0});
}

static void all_texts_share_one_space_of_positions(void **state)
{
    Unit unit;
    unit_init(&unit);
    Source *a = add(&unit, "a.scn", "12345");
    Source *empty = add(&unit, "empty.scn", "");
    Source *b = add(&unit, "b.scn", "abc");
    assert_int_equal(a->base, 1); // 0 is nowhere
    assert_int_equal(empty->base, 7);
    assert_int_equal(b->base, 8);
    assert_null(source_of(&unit.sources, 0));
    assert_ptr_equal(source_of(&unit.sources, 1), a);
    assert_ptr_equal(source_of(&unit.sources, 6), a); // behind its last character
    assert_ptr_equal(source_of(&unit.sources, 7), empty);
    assert_ptr_equal(source_of(&unit.sources, 8), b);
    assert_ptr_equal(source_of(&unit.sources, 11), b);
    assert_null(source_of(&unit.sources, 12));
    unit_release(&unit);
}

static void many_sources_are_found(void **state)
{
    Unit unit;
    unit_init(&unit);
    for (int i = 0; i < 100; i++) add(&unit, "x.scn", "abc");
    for (uint32_t i = 0; i < 100; i++) assert_ptr_equal(source_of(&unit.sources, 1 + i * 4 + 2), unit.sources.list[i]);
    unit_release(&unit);
}

static void a_place_has_a_line_and_a_column_from_one(void **state)
{
    Unit unit;
    unit_init(&unit);
    Source *s = add(&unit, "a.scn", "ab\n\ncde\n");
    static const struct {
        uint32_t offset, line, column;
    } places[] = {{0, 1, 1}, {1, 1, 2}, {2, 1, 3}, {3, 2, 1}, {4, 3, 1}, {6, 3, 3}, {7, 3, 4}, {8, 4, 1}};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        Place place = source_place(&unit.sources, s->base + places[i].offset);
        assert_int_equal(place.line, places[i].line);
        assert_int_equal(place.column, places[i].column);
        assert_ptr_equal(place.source, s);
    }
    Place third = source_place(&unit.sources, s->base + 5);
    assert_int_equal(third.line_length, 3);
    assert_memory_equal(third.line_text, "cde", 3);
    assert_null(source_place(&unit.sources, 0).source);
    unit_release(&unit);
}

static void a_byte_order_mark_and_carriage_returns_do_not_count(void **state)
{
    Unit unit;
    unit_init(&unit);
    Source *s = add(&unit, "a.scn",
                    "\xEF\xBB\xBF"
                    "ab\r\ncd");
    assert_int_equal(s->length, 6);
    Place place = source_place(&unit.sources, s->base + 1);
    assert_int_equal(place.column, 2);
    assert_int_equal(place.line_length, 2);
    assert_int_equal(source_place(&unit.sources, s->base + 4).line, 2);
    unit_release(&unit);
}

static void columns_count_characters_and_widths_count_columns_of_a_terminal(void **state)
{
    Unit unit;
    unit_init(&unit);
    // a tab, é, a wide character, an e with a combining accent, x
    Source *s = add(&unit, "a.scn", "\té世e\xCC\x81x");
    Place place = source_place(&unit.sources, s->base + (uint32_t)strlen("\té世e\xCC\x81"));
    assert_int_equal(place.column, 6);
    assert_int_equal(place.width, 8 + 1 + 2 + 1 + 0);
    unit_release(&unit);
}

static void utf8_is_decoded_strictly(void **state)
{
    static const struct {
        const char *text;
        uint32_t code;
        size_t bytes;
    } cases[] = {
        {"a", 'a', 1},
        {"é", 0xE9, 2},
        {"世", 0x4E16, 3},
        {"\xF0\x9F\x98\x80", 0x1F600, 4},
        {"\xC0\x80", UTF8_BROKEN, 1},         // overlong
        {"\xE0\x80\x80", UTF8_BROKEN, 1},     // overlong
        {"\xED\xA0\x80", UTF8_BROKEN, 1},     // a surrogate
        {"\xF4\x90\x80\x80", UTF8_BROKEN, 1}, // beyond U+10FFFF
        {"\x80", UTF8_BROKEN, 1},
        {"\xFF", UTF8_BROKEN, 1},
        {"\xC3", UTF8_BROKEN, 1},
        {"\xE4\xB8", UTF8_BROKEN, 1},
        {"\xC3(", UTF8_BROKEN, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint32_t code;
        assert_int_equal(utf8_read(cases[i].text, strlen(cases[i].text), &code), cases[i].bytes);
        assert_int_equal(code, cases[i].code);
    }
}

static void files_are_read_whole(void **state)
{
    char path[] = "/tmp/scn-test-XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0);
    char block[1000];
    memset(block, 'x', sizeof block);
    for (int i = 0; i < 100; i++) assert_int_equal(write(file, block, sizeof block), (int)sizeof block);
    close(file);
    Arena arena = {0};
    size_t length;
    char *text = source_read(&arena, path, &length);
    assert_non_null(text);
    assert_int_equal(length, 100000);
    assert_int_equal(text[99999], 'x');
    assert_int_equal(text[100000], 0);
    unlink(path);
    assert_null(source_read(&arena, path, &length));
    assert_int_equal(errno, ENOENT);
    assert_null(source_read(&arena, "/tmp", &length));
    assert_int_equal(errno, EISDIR);
    arena_release(&arena);
}

static void spans_join_and_nowhere_adds_nothing(void **state)
{
    Span joined = span_join((Span){5, 7}, (Span){2, 3});
    assert_int_equal(joined.begin, 2);
    assert_int_equal(joined.end, 7);
    joined = span_join((Span){0}, (Span){2, 3});
    assert_int_equal(joined.begin, 2);
    joined = span_join((Span){2, 3}, (Span){0});
    assert_int_equal(joined.end, 3);
}

static void more_text_than_positions_is_refused(void **state)
{
    Unit unit;
    unit_init(&unit);
    // Only the lengths count: nothing is read of these texts.
    for (int i = 0; i < 3; i++) assert_non_null(source_add(&unit.sources, "x", "text", SOURCE_LENGTH_MAX, (Span){0}));
    assert_null(source_add(&unit.sources, "x", "text", SOURCE_LENGTH_MAX, (Span){0}));
    unit_release(&unit);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_texts_share_one_space_of_positions),
        cmocka_unit_test(many_sources_are_found),
        cmocka_unit_test(a_place_has_a_line_and_a_column_from_one),
        cmocka_unit_test(a_byte_order_mark_and_carriage_returns_do_not_count),
        cmocka_unit_test(columns_count_characters_and_widths_count_columns_of_a_terminal),
        cmocka_unit_test(utf8_is_decoded_strictly),
        cmocka_unit_test(files_are_read_whole),
        cmocka_unit_test(spans_join_and_nowhere_adds_nothing),
        cmocka_unit_test(more_text_than_positions_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
