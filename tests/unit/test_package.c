// Packages: what is written is read, the same bytes for the same scene; and nothing that is damaged, cut, foreign,
// newer or senseless is taken.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <endian.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "runtime/package.h"
#include "runtime/plan_tables.h"

static Arena arena;

// A scene with one of everything: object "a", a quadric cut by a free form, and a nested group of two quadrics.
static Plan *small_plan(void)
{
    Plan *plan = arena_new(&arena, Plan);
    plan->slot_count = 200;
    plan->image = arena_array(&arena, double, 200);
    for (int i = 0; i < 200; i++) plan->image[i] = i / 7.0;
    plan->time = 150;
    plan->frame = 151;
    plan->inputs = 152;
    plan->input_count = 4;

    static uint32_t operands[] = {150, 152, 20, 30, 160};
    plan->operands = operands;
    plan->operand_count = 5;
    static PlanStep steps[] = {
        {.kind = STEP_SCALAR, .op = OP_ADD, .count = 2, .first = 0, .result = 160, .span = {10, 20}},
        {.kind = STEP_ASSERT, .count = 1, .first = 4, .span = {30, 35}, .text = "the ring runs into the head"},
    };
    plan->steps = steps;
    plan->step_count = 2;

    static PlanShapeNode cut[] = {
        {SHAPE_INTERSECT, 3, 0}, {SHAPE_QUADRIC, 0, 0}, {SHAPE_FREEFORM, 0, 1}, {SHAPE_GROUP, 0, 2}};
    static PlanShapeNode ball[] = {{SHAPE_QUADRIC, 0, 0}};
    static PlanShape shapes[] = {{ball, 1, 1}, {cut, 4, 3}};
    plan->shapes = shapes;
    plan->shape_count = 2;
    static uint32_t inner[] = {0}, outer[] = {0, 1};
    static PlanGroupType types[] = {{SET_UNION, inner, 1}, {SET_UNION, outer, 2}};
    plan->group_types = types;
    plan->group_type_count = 2;
    static PlanGroup groups[] = {{1, 0, 1}, {0, 1, 2}};
    plan->groups = groups;
    plan->group_count = 2;
    static PlanComponent components[] = {{1, 0}, {0, 3}, {0, 4}};
    plan->components = components;
    plan->component_count = 3;
    static PlanLeaf leaves[] = {
        {LEAF_QUADRIC, 0, 0, 0, 0, 1, 0, NO_SLOT, 0, 0, 0, 0, 0, 0},
        {LEAF_FREEFORM, 10, 0, 1, 1, 1, 1, 161, 0, 0, 0, 0, 0, 0},
        {LEAF_GROUP, 0, 1, 1, 0, 0, 2, NO_SLOT, 0, 0, 0, 0, 0, 0},
        {LEAF_QUADRIC, 20, 0, 0, 0, 0, 3, NO_SLOT, 0, 0, 0, 0, 0, 0},
        {LEAF_QUADRIC, 30, 0, 0, 0, 0, 4, NO_SLOT, 0, 0, 0, 0, 0, 0},
    };
    plan->leaves = leaves;
    plan->leaf_count = 5;
    static PlanPerturbation perturbations[] = {{40, 50}};
    plan->perturbations = perturbations;
    plan->perturbation_count = 1;
    static PlanMaterial materials[] = {{60, 30}, {71, -1}};
    plan->materials = materials;
    plan->material_count = 2;
    static PlanObject objects[] = {{"", {0, 0}}, {"a", {40, 50}}};
    plan->objects = objects;
    plan->object_count = 2;
    static PlanLight lights[] = {{LIGHT_POINT, 90}};
    plan->lights = lights;
    plan->light_count = 1;
    plan->camera = 110;
    plan->background = 130;
    static const char *const choices[] = {"smooth", "rfunction", NULL};
    static IrParam params[] = {
        {.name = "lift", .doc = "How high.", .type = PARAM_VEC3, .slot = 0, .value = {1, 2, 3}, .span = {60, 64}},
        {.name = "squash",
         .type = PARAM_SCALAR,
         .slot = 3,
         .ranged = true,
         .low = 0,
         .high = 1,
         .value = {0.2},
         .span = {60, 64}},
        {.name = "style", .type = PARAM_STRING, .structure = true, .text = "smooth", .choices = choices},
    };
    plan->params = params;
    plan->param_count = 3;
    plan->duration = 4;
    plan->fps = 24;
    return plan;
}

static Package small_package(void)
{
    static PackagePlace places[] = {
        {{10, 20}, "eye.scn", 2, 3}, {{10, 25}, "eye.scn", 2, 3}, {{30, 35}, "parts/ring.scn", 7, 1}};
    static PackageBinary binaries[] = {{"pocl|x", (const uint8_t *)"binary\0bytes", 12},
                                       {"other", (const uint8_t *)"", 0}};
    static const char kernel[] = "kernel void primary() {}\n";
    return (Package){.version = "0.1.0",
                     .scene = "eye.scn",
                     .plan = small_plan(),
                     .kernel = kernel,
                     .kernel_length = sizeof kernel - 1,
                     .places = places,
                     .place_count = 3,
                     .binaries = binaries,
                     .binary_count = 2};
}

static uint8_t *encode(Package *package, size_t *size)
{
    uint8_t *bytes = package_encode(package, size, NULL);
    assert_non_null(bytes);
    return bytes;
}

static void assert_refused(const uint8_t *bytes, size_t size, const char *reason)
{
    Arena other = {0};
    Failure failure = {0};
    assert_null(package_decode(&other, bytes, size, &failure));
    if (!strstr(failure.text, reason)) fail_msg("\"%s\" is not in \"%s\"", reason, failure.text);
    arena_release(&other);
}

static void what_is_written_is_read(void **state)
{
    Package package = small_package();
    size_t size;
    uint8_t *bytes = encode(&package, &size);
    Failure failure = {0};
    Package *read = package_decode(&arena, bytes, size, &failure);
    if (!read) fail_msg("%s", failure.text);
    assert_string_equal(read->scene, "eye.scn");
    assert_string_equal(read->version, "0.1.0");
    assert_string_equal(read->kernel, package.kernel);
    assert_memory_equal(read->structure, package.structure, 16);
    const Plan *plan = read->plan, *was = package.plan;
    assert_int_equal(plan->slot_count, 200);
    assert_memory_equal(plan->image, was->image, 200 * sizeof(double));
    assert_int_equal(plan->step_count, 2);
    assert_string_equal(plan->steps[1].text, "the ring runs into the head");
    assert_null(plan->steps[0].text);
    assert_memory_equal(plan->leaves, was->leaves, 5 * sizeof(PlanLeaf));
    assert_memory_equal(plan->groups, was->groups, 2 * sizeof(PlanGroup));
    assert_memory_equal(plan->shapes[1].nodes, was->shapes[1].nodes, 4 * sizeof(PlanShapeNode));
    assert_int_equal(plan->materials[1].integer_shininess, -1);
    assert_string_equal(plan->objects[1].name, "a");
    assert_string_equal(plan->params[0].doc, "How high.");
    assert_true(plan->params[1].high == 1 && plan->params[0].value[2] == 3);
    assert_string_equal(plan->params[2].choices[1], "rfunction");
    assert_null(plan->params[2].choices[2]);
    assert_true(plan->duration == 4 && plan->fps == 24);
    assert_int_equal(read->binary_count, 2);
    const PackageBinary *binary = package_binary(read, "pocl|x");
    assert_int_equal(binary->size, 12);
    assert_memory_equal(binary->bytes, "binary\0bytes", 12);
    assert_null(package_binary(read, "pocl|y"));
    assert_int_equal(package_place(read, (Span){30, 35})->line, 7);
    assert_null(package_place(read, (Span){30, 36}));
    free(bytes);
}

static void the_same_scene_gives_the_same_bytes(void **state)
{
    Package package = small_package();
    size_t size, again_size;
    uint8_t *bytes = encode(&package, &size), *again = encode(&package, &again_size);
    assert_int_equal(size, again_size);
    assert_memory_equal(bytes, again, size);
    // … and so does what was read from it.
    Package *read = package_decode(&arena, bytes, size, NULL);
    free(again);
    again = encode(read, &again_size);
    assert_int_equal(size, again_size);
    assert_memory_equal(bytes, again, size);
    free(bytes);
    free(again);
}

static void every_damaged_byte_is_found(void **state)
{
    Package package = small_package();
    size_t size, found = 0, padding = 0;
    uint8_t *bytes = encode(&package, &size);
    for (size_t i = 0; i < size; i++) {
        bytes[i] ^= 0x20;
        Arena other = {0};
        if (package_decode(&other, bytes, size, NULL))
            padding++;
        else
            found++;
        arena_release(&other);
        bytes[i] ^= 0x20;
    }
    assert_true(padding < 16 * 7); // what lies between two sections is nobody's
    assert_int_equal(found + padding, size);
    free(bytes);
}

static void every_cut_is_found(void **state)
{
    Package package = small_package();
    size_t size;
    uint8_t *bytes = encode(&package, &size);
    assert_refused(bytes, 0, "no package");
    for (size_t cut = 1; cut < size; cut++) assert_refused(bytes, cut, "cut off");
    uint8_t *longer = calloc(1, size + 1);
    memcpy(longer, bytes, size);
    assert_refused(longer, size + 1, "after its end");
    free(longer);
    free(bytes);
}

static void foreign_and_newer_files_are_told(void **state)
{
    Package package = small_package();
    size_t size;
    uint8_t *bytes = encode(&package, &size);
    assert_true(package_is(bytes, size));
    assert_false(package_is((const uint8_t *)"scn 1;\nsphere(1);", 17));
    assert_refused((const uint8_t *)"scn 1;\nsphere(1); // a scene, and no package of one", 51, "no package");
    bytes[5] = '\n'; // what a transfer as text does to a carriage return
    assert_refused(bytes, size, "transfer as text");
    bytes[5] = '\r';
    bytes[8] = PACKAGE_VERSION + 1;
    assert_refused(bytes, size, "newer than this scn");
    bytes[8] = PACKAGE_VERSION - 1;
    assert_refused(bytes, size, "older than that of this scn");
    bytes[8] = PACKAGE_VERSION;
    bytes[12] ^= 1;
    assert_refused(bytes, size, "header is damaged");
    free(bytes);
}

// A package whose checksums are right and whose tables are not: each of these must be found by plan_check().
static void senseless_tables_are_refused(void **state)
{
#define WRONG(change, reason)                                                                                          \
    do {                                                                                                               \
        Package package = small_package();                                                                             \
        change;                                                                                                        \
        size_t size;                                                                                                   \
        uint8_t *bytes = encode(&package, &size);                                                                      \
        assert_refused(bytes, size, reason);                                                                           \
        free(bytes);                                                                                                   \
    } while (0)
#define WITH(place, value, reason)                                                                                     \
    do {                                                                                                               \
        Plan *plan = small_plan();                                                                                     \
        __typeof__(plan->place) *at = &plan->place, old = *at;                                                         \
        Failure failure = {0};                                                                                         \
        *at = (value);                                                                                                 \
        bool ok = plan_check(plan, &failure);                                                                          \
        *at = old;                                                                                                     \
        assert_false(ok);                                                                                              \
        if (!strstr(failure.text, reason)) fail_msg("\"%s\" is not in \"%s\"", reason, failure.text);                  \
    } while (0)
    assert_true(plan_check(small_plan(), NULL));
    WITH(leaves[0].quadric, 191, "leaf 0");
    WITH(leaves[1].begin, 1, "leaf 1");
    WITH(leaves[1].count, UINT32_MAX, "leaf 1");
    WITH(leaves[1].material, 2, "leaf 1");
    WITH(leaves[1].object, 2, "leaf 1");
    WITH(leaves[1].shown, 200, "leaf 1");
    WITH(leaves[2].begin, 2, "leaf 2");
    WITH(leaves[2].begin, 0, "tree"); // a group that holds itself
    WITH(leaves[0].kind, 9, "leaf 0");
    WITH(leaves[0].kind, LEAF_FREEFORM, "tree"); // not what the shape says
    WITH(groups[0].type, 2, "tree");
    WITH(groups[0].component_count, 4, "tree");
    WITH(groups[1].component_begin, 0, "tree"); // a component of two groups
    WITH(components[1].leaf_begin, 4, "tree");  // a leaf of two components
    WITH(components[1].shape, 1, "tree");
    WITH(components[0].leaf_begin, UINT32_MAX, "tree");
    WITH(group_types[0].shapes[0], 1, "type 0"); // a type that holds itself
    WITH(group_types[1].shapes[0], 1, "type 1");
    WITH(group_types[1].set, 2, "type 1");
    WITH(group_types[1].set, SET_INTERSECT, "tree"); // the scene is a union
    WITH(shapes[1].nodes[0].count, 4, "shape 1");
    WITH(shapes[1].nodes[0].count, 0, "shape 1");
    WITH(shapes[1].nodes[2].leaf, 0, "shape 1");
    WITH(shapes[1].nodes[3].count, 2, "shape 1");
    WITH(shapes[1].leaf_count, 2, "shape 1");
    WITH(shapes[0].node_count, 0, "shape 0");
    WITH(perturbations[0].quadric, 195, "point nowhere");
    WITH(perturbations[0].strength, UINT32_MAX, "point nowhere");
    WITH(materials[0].values, 190, "point nowhere");
    WITH(materials[0].integer_shininess, 1025, "point nowhere");
    WITH(lights[0].kind, 3, "point nowhere");
    WITH(camera, 186, "point nowhere");
    WITH(inputs, 197, "point nowhere");
    WITH(time, 200, "point nowhere");
    WITH(fps, 0.0 / 0.0, "point nowhere");
    WITH(image[3], 1e308 * 10, "not numbers");
    WITH(params[0].slot, 2, "parameter 0");
    WITH(params[0].type, 77, "parameter 0");
    WITH(params[2].structure, false, "parameter 2");
    WITH(params[2].text, NULL, "parameter 2");
    WITH(steps[0].result, 200, "step 0");
    WITH(steps[0].first, 4, "step 0");
    WITH(steps[0].count, 3, "step 0");
    WITH(steps[0].op, OP_UNION, "step 0");
    WITH(steps[0].kind, 99, "step 0");
    WITH(steps[1].text, NULL, "step 1");
    WITH(operands[1], 200, "step 0");
    WRONG(package.plan->leaves = arena_array(&arena, PlanLeaf, 5), "tree");
    WRONG(package.kernel_length = 0; package.version = NULL, "INFO");
    WRONG(package.place_count = 2; static PackagePlace twice[2]; package.places = twice, "MAPS");
#undef WITH
#undef WRONG
}

static void a_file_is_written_whole(void **state)
{
    char path[] = "/tmp/scn-package-XXXXXX";
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    Package package = small_package();
    Failure failure = {0};
    assert_true(package_write(path, &package, NULL, &failure));
    FileBytes file;
    assert_true(bytes_open(&file, path, &failure));
    assert_non_null(package_decode(&arena, file.bytes, file.size, &failure));
    bytes_close(&file);
    assert_false(package_write("/proc/none/x.scnk", &package, NULL, &failure));
    assert_non_null(strstr(failure.text, "/proc/none/x.scnk"));
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_is_read),          cmocka_unit_test(the_same_scene_gives_the_same_bytes),
        cmocka_unit_test(every_damaged_byte_is_found),      cmocka_unit_test(every_cut_is_found),
        cmocka_unit_test(foreign_and_newer_files_are_told), cmocka_unit_test(senseless_tables_are_refused),
        cmocka_unit_test(a_file_is_written_whole),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    arena_release(&arena);
    return failed;
}
