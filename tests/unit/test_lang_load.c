#include <ftw.h>
#include <sys/stat.h>
#include <unistd.h>

#include "test_lang.h"

// A folder with files, removed again after each test.
typedef struct Folder {
    char path[64];
    char before[1024]; // the working folder, where the test runner was
} Folder;

static int make_folder(void **state)
{
    Folder *folder = calloc(1, sizeof *folder);
    strcpy(folder->path, "/tmp/scn-load-XXXXXX");
    if (!getcwd(folder->before, sizeof folder->before) || !mkdtemp(folder->path) || chdir(folder->path) != 0) return -1;
    *state = folder;
    return 0;
}

static int remove_one(const char *path, const struct stat *status, int kind, struct FTW *walk)
{
    return remove(path);
}

static int remove_folder(void **state)
{
    Folder *folder = *state;
    int failed = chdir(folder->before);
    nftw(folder->path, remove_one, 8, FTW_DEPTH | FTW_PHYS);
    free(folder);
    return failed;
}

static void write_file(const char *path, const char *text)
{
    char copy[128];
    snprintf(copy, sizeof copy, "%s", path);
    for (char *slash = strchr(copy, '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = 0;
        mkdir(copy, 0777);
        *slash = '/';
    }
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

// Reads main.scn of the folder and all it needs.
static Node *load(Unit *unit)
{
    size_t length;
    char *text = source_read(&unit->arena, "main.scn", &length);
    assert_non_null(text);
    return parse(unit, source_add(&unit->sources, "main.scn", text, length, (Span){0}));
}

static void an_included_file_hangs_at_its_include(void **state)
{
    write_file("main.scn", "include \"parts/eye.scn\";\nobject a = eye;");
    write_file("parts/eye.scn", "include \"iris.scn\";\nobject eye = iris;");
    write_file("parts/iris.scn", "object iris = sphere(1);"); // beside the including file
    Unit unit;
    unit_init(&unit);
    Node *file = load(&unit);
    assert_string_equal(reported(&unit), "");
    Node *eye = file->a->a;
    assert_int_equal(eye->kind, NODE_FILE);
    assert_string_equal(eye->text, "parts/eye.scn");
    assert_string_equal(eye->a->a->a->name, "iris");
    assert_int_equal(unit.sources.count, 3);
    assert_int_equal(unit.sources.list[1]->included_at.begin, file->a->span.begin);
    unit_release(&unit);
}

static void a_file_is_spliced_once_whatever_the_way_to_it(void **state)
{
    write_file("main.scn", "include \"a.scn\";\ninclude \"./parts/../a.scn\";\ninclude \"b.scn\";");
    write_file("a.scn", "let a = 1;");
    write_file("b.scn", "include \"a.scn\";");
    write_file("parts/none.scn", "");
    Unit unit;
    unit_init(&unit);
    Node *file = load(&unit);
    assert_string_equal(reported(&unit), "");
    assert_non_null(file->a->a);
    assert_null(file->a->next->a);
    assert_null(file->a->next->next->a->a->a);
    assert_int_equal(unit.sources.count, 3);
    unit_release(&unit);
}

static void folders_given_with_I_come_after_the_file_s_own(void **state)
{
    write_file("main.scn", "include \"a.scn\";\ninclude \"b.scn\";");
    write_file("a.scn", "let near = 1;");
    write_file("one/a.scn", "let far = 1;");
    write_file("one/b.scn", "let one = 1;");
    write_file("two/b.scn", "let two = 1;");
    Unit unit;
    unit_init(&unit);
    unit.include_paths = (const char *const[]){"one", "two/"};
    unit.include_path_count = 2;
    Node *file = load(&unit);
    assert_string_equal(reported(&unit), "");
    assert_string_equal(file->a->a->a->name, "near");
    assert_string_equal(file->a->next->a->a->name, "one");
    unit_release(&unit);
}

static void a_file_that_includes_itself_is_a_cycle(void **state)
{
    write_file("main.scn", "include \"a.scn\";");
    write_file("a.scn", "include \"b.scn\";");
    write_file("b.scn", "// back\ninclude \"main.scn\";\ninclude \"a.scn\";");
    Unit unit;
    unit_init(&unit);
    load(&unit);
    assert_string_equal(reported(&unit), "2:9 include-cycle, 3:9 include-cycle");
    char *text = printed(&unit, false);
    assert_non_null(strstr(text, "b.scn:2:9: error: main.scn includes itself"));
    assert_non_null(strstr(text, "included from a.scn:1:1"));
    assert_non_null(strstr(text, "included from main.scn:1:1"));
    free(text);
    unit_release(&unit);
}

static void a_missing_file_says_where_it_was_sought_and_what_is_near(void **state)
{
    write_file("main.scn", "include \"parts/eey.scn\";");
    write_file("parts/eye.scn", "");
    Unit unit;
    unit_init(&unit);
    unit.include_paths = (const char *const[]){"elsewhere"};
    unit.include_path_count = 1;
    load(&unit);
    assert_string_equal(reported(&unit), "1:9 include-missing");
    const Diag *d = unit.diagnostics.first;
    assert_string_equal(d->text, "there is no parts/eey.scn in ., elsewhere: write parts/eye.scn");
    assert_string_equal(d->fixes->text, "\"parts/eye.scn\"");
    unit_release(&unit);
}

static void what_cannot_be_read_is_said(void **state)
{
    write_file("main.scn", "include \"\";\ninclude \"folder\";\ninclude \"/dev/zero\";\ninclude \"nul\\n.scn\";");
    mkdir("folder", 0777);
    Unit unit;
    unit_init(&unit);
    load(&unit);
    assert_string_equal(reported(&unit),
                        "1:9 include-missing, 2:9 include-missing, 3:1 include-missing, 4:9 include-missing");
    unit_release(&unit);
}

static const char *compiled_in(const char *name, size_t *length)
{
    const char *text = NULL;
    if (!name)
        text = "brushes easing";
    else if (strcmp(name, "brushes") == 0)
        text = "use easing;\nlet b = 1;";
    else if (strcmp(name, "easing") == 0)
        text = "use brushes;\nlet e = 1;"; // libraries may use each other
    if (text) *length = strlen(text);
    return text;
}

static void libraries_are_found_beside_the_file_then_on_the_paths_then_compiled_in(void **state)
{
    write_file("main.scn",
               "use clay;\nuse wood;\nuse stone;\nuse brushes;\nuse brushes as b;\nuse \"lib/clay.scn\" as c;");
    write_file("clay.scn", "let clay = 1;");
    write_file("lib/clay.scn", "let other = 1;");
    write_file("lib/wood.scn", "let wood = 1;");
    write_file("far/stone.scn", "let stone = 1;");
    Unit unit;
    unit_init(&unit);
    unit.include_paths = (const char *const[]){"lib"};
    unit.include_path_count = 1;
    unit.search_path = "nowhere::far";
    unit.library = compiled_in;
    Node *file = load(&unit);
    assert_string_equal(reported(&unit), "");
    Node *item = file->a;
    assert_string_equal(item->file->a->name, "clay");
    item = item->next;
    assert_string_equal(item->file->a->name, "wood");
    item = item->next;
    assert_string_equal(item->file->a->name, "stone");
    item = item->next;
    Node *brushes = item->file;
    assert_string_equal(brushes->text, "<brushes>");
    assert_true(source_of(&unit.sources, brushes->span.begin)->library);
    assert_true(source_of(&unit.sources, brushes->span.begin)->prelude);
    Node *easing = brushes->a->file;
    assert_ptr_equal(easing->a->file, brushes);
    item = item->next;
    assert_ptr_equal(item->file, brushes); // loaded once
    assert_string_equal(item->alias, "b");
    item = item->next;
    assert_string_equal(item->file->a->name, "other");
    unit_release(&unit);
}

static void a_library_s_includes_are_its_own(void **state)
{
    write_file("main.scn", "include \"common.scn\";\nuse one;\nuse two;");
    write_file("one.scn", "include \"common.scn\";");
    write_file("two.scn", "include \"common.scn\";\ninclude \"common.scn\";");
    write_file("common.scn", "let c = 1;");
    Unit unit;
    unit_init(&unit);
    Node *file = load(&unit);
    assert_string_equal(reported(&unit), "");
    assert_non_null(file->a->a);
    assert_non_null(file->a->next->file->a->a);
    assert_non_null(file->a->next->next->file->a->a);
    assert_null(file->a->next->next->file->a->next->a); // once in each
    unit_release(&unit);
}

static void an_unknown_library_suggests_a_near_one(void **state)
{
    write_file("main.scn", "use brashes;\nuse caly;\nuse \"caly.scn\" as c;\nuse nothing_like_it;");
    write_file("clay.scn", "");
    Unit unit;
    unit_init(&unit);
    unit.library = compiled_in;
    load(&unit);
    assert_string_equal(reported(&unit),
                        "1:5 unknown-library, 2:5 unknown-library, 3:5 unknown-library, 4:5 unknown-library");
    const Diag *d = unit.diagnostics.first;
    assert_string_equal(d->fixes->text, "brushes");
    assert_string_equal(d->next->fixes->text, "clay");
    assert_string_equal(d->next->next->fixes->text, "\"clay.scn\"");
    assert_null(d->next->next->next->fixes);
    unit_release(&unit);
}

static void reports_in_a_library_show_who_uses_it(void **state)
{
    write_file("main.scn", "use bad;");
    write_file("bad.scn", "let = 1;");
    Unit unit;
    unit_init(&unit);
    load(&unit);
    char *text = printed(&unit, false);
    assert_non_null(strstr(text, "bad.scn:1:5: error:"));
    assert_non_null(strstr(text, "used from main.scn:1:1"));
    free(text);
    unit_release(&unit);
}

static void many_files_in_a_row_end(void **state)
{
    write_file("main.scn", "include \"f0.scn\";");
    for (int i = 0; i < 150; i++) {
        char name[32], text[64];
        snprintf(name, sizeof name, "f%d.scn", i);
        snprintf(text, sizeof text, "include \"f%d.scn\";", i + 1);
        write_file(name, i < 149 ? text : "");
    }
    Unit unit;
    unit_init(&unit);
    load(&unit);
    assert_string_equal(reported(&unit), "1:1 too-deep");
    unit_release(&unit);
}

int main(void)
{
#define IN_FOLDER(test) cmocka_unit_test_setup_teardown(test, make_folder, remove_folder)
    const struct CMUnitTest tests[] = {
        IN_FOLDER(an_included_file_hangs_at_its_include),
        IN_FOLDER(a_file_is_spliced_once_whatever_the_way_to_it),
        IN_FOLDER(folders_given_with_I_come_after_the_file_s_own),
        IN_FOLDER(a_file_that_includes_itself_is_a_cycle),
        IN_FOLDER(a_missing_file_says_where_it_was_sought_and_what_is_near),
        IN_FOLDER(what_cannot_be_read_is_said),
        IN_FOLDER(libraries_are_found_beside_the_file_then_on_the_paths_then_compiled_in),
        IN_FOLDER(a_library_s_includes_are_its_own),
        IN_FOLDER(an_unknown_library_suggests_a_near_one),
        IN_FOLDER(reports_in_a_library_show_who_uses_it),
        IN_FOLDER(many_files_in_a_row_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
