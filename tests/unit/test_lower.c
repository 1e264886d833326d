// Plans: how scenes are cut into groups, components and shapes, in which order, and with which materials, names and
// lists.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>

#include "compiler/frame.h"
#include "compiler/lower.h"
#include "compiler/passes.h"
#include "ir_random.h"

static Arena arena;
static PlanOrigins origins;

static LowerStatus lower(Ir *ir, IrId root, Plan **plan)
{
    ir_complete(ir, root);
    for (int k = 0; k < PASS_COUNT; k++) {
        Arena scratch = {0};
        assert_true(passes[k].run(ir, &scratch));
        arena_release(&scratch);
    }
    return plan_lower(ir, &arena, plan, &origins);
}

static Plan *plan_of(Ir *ir, IrId root)
{
    Plan *plan = NULL;
    assert_int_equal(lower(ir, root, &plan), LOWER_DONE);
    return plan;
}

static IrId list(Ir *ir, IrOp op, const IrId *fields, uint32_t count)
{
    return ir_node(ir, op, test_span, fields, count);
}
static IrId both(Ir *ir, IrOp op, IrId a, IrId b)
{
    return ir_op2(ir, op, test_span, a, b);
}
static IrId not(Ir * ir, IrId field)
{
    return ir_op1(ir, OP_COMPLEMENT, test_span, field);
}
static IrId named(Ir *ir, IrId field, const char *name)
{
    return ir_node_text(ir, OP_NAMED, test_span, &field, 1, name);
}

static IrId ball_at(Ir *ir, double x)
{
    return ir_moved(ir, ir_sphere(ir, 1), x, 0, 0);
}

static IrId *balls(Ir *ir, uint32_t count)
{
    IrId *fields = arena_array(&arena, IrId, count);
    for (uint32_t k = 0; k < count; k++) fields[k] = ball_at(ir, k);
    return fields;
}

static IrId box(Ir *ir)
{
    IrId o[3];
    for (int k = 0; k < 3; k++) {
        double q[10] = {[9] = 4};
        q[k] = -1;
        o[k] = ir_quadric(ir, q);
    }
    return list(ir, OP_INTERSECT, o, 3);
}

// "U(Q I(Q F) G0)": a shape as text.
static const char *shape_text(const PlanShape *shape, uint32_t *next)
{
    const PlanShapeNode *node = &shape->nodes[(*next)++];
    if (node->kind == SHAPE_QUADRIC) return "Q";
    if (node->kind == SHAPE_FREEFORM) return "F";
    if (node->kind == SHAPE_GROUP) return arena_printf(&arena, "G%u", node->count);
    const char *text = node->kind == SHAPE_UNION ? "U(" : "I(";
    for (uint32_t k = 0; k < node->count; k++)
        text = arena_printf(&arena, "%s%s%s", text, k ? " " : "", shape_text(shape, next));
    return arena_printf(&arena, "%s)", text);
}

// A plan's structure: its types, each with the shapes of its groups.
static const char *structure(const Plan *plan)
{
    const char *text = "";
    for (uint32_t t = 0; t < plan->group_type_count; t++) {
        const PlanGroupType *type = &plan->group_types[t];
        text = arena_printf(&arena, "%s%s%s{", text, t ? " " : "", type->set == SET_UNION ? "union" : "intersect");
        for (uint32_t k = 0; k < type->shape_count; k++) {
            uint32_t next = 0;
            text =
                arena_printf(&arena, "%s%s%s", text, k ? "; " : "", shape_text(&plan->shapes[type->shapes[k]], &next));
        }
        text = arena_printf(&arena, "%s}", text);
    }
    return text;
}

static void a_union_of_many_is_one_shape(void **state)
{
    Ir *ir = ir_new(&arena);
    Plan *plan = plan_of(ir, list(ir, OP_UNION, balls(ir, 10000), 10000));
    assert_string_equal(structure(plan), "union{Q}");
    assert_int_equal(plan->groups[0].component_count, 10000);
    assert_int_equal(plan->leaf_count, 10000);
    for (uint32_t k = 0; k < 10000; k++) assert_int_equal(plan->leaves[k].order, k);
}

static void equal_trees_share_a_shape(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId o[4];
    for (int k = 0; k < 3; k++) o[k] = both(ir, OP_INTERSECT, ball_at(ir, k), not(ir, ball_at(ir, k + 0.5)));
    o[3] = ball_at(ir, 9);
    Plan *plan = plan_of(ir, list(ir, OP_UNION, o, 4));
    assert_string_equal(structure(plan), "union{Q; I(Q Q)}");
    assert_int_equal(plan->components[0].shape, 0); // sorted by shape
    assert_int_equal(plan->leaves[plan->components[0].leaf_begin].order, 6);
    for (uint32_t k = 1; k < 4; k++) assert_int_equal(plan->leaves[plan->components[k].leaf_begin].order, 2 * (k - 1));
}

static void unions_of_unions_are_one(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId chain = ball_at(ir, 0);
    for (int k = 1; k < 50000; k++) chain = both(ir, OP_UNION, chain, ball_at(ir, k)); // a | b | c …
    Plan *plan = plan_of(ir, chain);
    assert_string_equal(structure(plan), "union{Q}");
    assert_int_equal(plan->leaf_count, 50000);
    for (uint32_t k = 0; k < 50000; k += 77)
        assert_true(plan->image[plan->leaves[k].quadric + 6] == k); // x of (1 - |X - k|^2) / 2
}

static void what_is_twice_there_is_there_once(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId a = ir_sphere(ir, 1), b = ball_at(ir, 3);
    Plan *plan = plan_of(ir, both(ir, OP_UNION, both(ir, OP_UNION, a, b), both(ir, OP_UNION, b, a)));
    assert_int_equal(plan->leaf_count, 2);
    IrId doubled = ball_at(ir, 0); // 2^40 times the same
    for (int k = 0; k < 40; k++) doubled = both(ir, OP_UNION, doubled, doubled);
    assert_int_equal(plan_of(ir, doubled)->leaf_count, 1);
}

static void a_box_minus_many_is_a_group(void **state)
{
    Ir *ir = ir_new(&arena);
    const uint32_t count = 10000;
    IrId *fields = arena_array(&arena, IrId, count + 1);
    fields[0] = both(ir, OP_FREEFORM, ir_sphere(ir, 2),
                     ir_op3(ir, OP_PERTURB, test_span, ball_at(ir, 2), ir_const(ir, 1), ir_const(ir, 0)));
    for (uint32_t k = 0; k < count; k++) fields[k + 1] = not(ir, ball_at(ir, k));
    Plan *plan = plan_of(ir, list(ir, OP_INTERSECT, fields, count + 1));
    assert_string_equal(structure(plan), "intersect{Q} union{I(F G0)}");
    assert_int_equal(plan->group_count, 2);
    assert_int_equal(plan->groups[1].component_count, count);
    assert_int_equal(plan->leaves[0].order, 0);
    assert_int_equal(plan->leaves[1].kind, LEAF_GROUP);
    assert_int_equal(plan->leaves[2].order, 1);
}

static void many_things_cut_by_a_plane_are_a_group(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId half = ir_quadric(ir, (const double[10]){[6] = 1});
    Plan *plan = plan_of(ir, both(ir, OP_INTERSECT, list(ir, OP_UNION, balls(ir, 1000), 1000), half));
    assert_string_equal(structure(plan), "union{Q} union{I(G0 Q)}");
}

static void structure_does_not_depend_on_order_or_number(void **state)
{
    const char *texts[2];
    for (int turn = 0; turn < 2; turn++) {
        Ir *ir = ir_new(&arena);
        IrId o[40];
        for (int k = 0; k < 40; k++) {
            int kind = turn ? (39 - k) % 3 : k % 3;
            o[k] = kind == 0   ? ball_at(ir, k)
                   : kind == 1 ? box(ir)
                               : both(ir, OP_INTERSECT, box(ir), not(ir, ball_at(ir, k)));
        }
        texts[turn] = structure(plan_of(ir, list(ir, OP_UNION, o, turn ? 40 : 30)));
    }
    assert_string_equal(texts[0], texts[1]);
}

// A thousand different trees: the frequent ones stay code of their own, the others become groups of leaves.
static void many_different_things_have_few_shapes(void **state)
{
    for (uint64_t seed = 1; seed <= 5; seed++) {
        Ir *ir = ir_new(&arena);
        Random random = {seed};
        RandomIr g = {.ir = ir, .random = &random};
        ir_handle(ir, 0.5);
        IrId *fields = arena_array(&arena, IrId, 1200);
        for (int k = 0; k < 1000; k++) {
            g.left = 30;
            g.pool_count = 0;
            fields[k] = random_field(&g, 6);
        }
        for (int k = 1000; k < 1200; k++) fields[k] = box(ir);
        IrId root = list(ir, OP_UNION, fields, 1200);
        double points[20][3], before[20], size = 0;
        IrValues values = ir_evaluate(ir, &arena, 0, (const double[]){0.5});
        FieldCode code = ir_field_code(&values, root);
        for (int k = 0; k < 20; k++) {
            for (int i = 0; i < 3; i++) points[k][i] = random_in(&random, -3, 3);
            before[k] = field_at(code, values.values, points[k]).f;
            size = fmax(size, fabs(before[k]));
        }
        Plan *plan = plan_of(ir, root);
        assert_true(plan->shape_count <= LOWER_SHAPES);
        assert_true(plan->group_type_count < 40);
        FrameError error;
        double *numbers = arena_array(&arena, double, plan->slot_count);
        assert_true(frame_evaluate(plan, &(FrameInput){0}, numbers, &error));
        for (int k = 0; k < 20; k++) {
            double f = plan_field(plan, numbers, points[k], NULL);
            if (f != before[k] && fabs(f - before[k]) > 1e-8 * size)
                fail_msg("seed %d: %g instead of %g", (int)seed, f, before[k]);
        }
        arena_release(&arena);
    }
}

static void the_order_is_that_of_the_text(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId o[3] = {both(ir, OP_INTERSECT, ball_at(ir, 0), ball_at(ir, 1)), ball_at(ir, 2),
                 both(ir, OP_INTERSECT, ball_at(ir, 3), ball_at(ir, 4))};
    IrId *many = balls(ir, 100);
    IrId big = both(ir, OP_INTERSECT, list(ir, OP_UNION, many, 100), list(ir, OP_UNION, o, 3));
    Plan *plan = plan_of(ir, both(ir, OP_UNION, ball_at(ir, 500), big));
    bool *seen = arena_array(&arena, bool, plan->leaf_count + 1000);
    uint32_t leaves = 0;
    for (uint32_t k = 0; k < plan->leaf_count; k++) {
        const PlanLeaf *leaf = &plan->leaves[k];
        if (leaf->kind == LEAF_GROUP) continue;
        leaves++;
        assert_false(seen[leaf->order]);
        seen[leaf->order] = true;
        double x = plan->image[leaf->quadric + 6]; // the ball's place is its x
        double expected = leaf->order == 0 ? 500 : leaf->order <= 100 ? leaf->order - 1 : leaf->order - 101;
        assert_true(x == expected);
    }
    assert_int_equal(leaves, 106);
}

static void ties_go_to_the_first(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId a = ir_op2(ir, OP_PAINT, test_span, ir_sphere(ir, 1), ir_material(ir, 0.25));
    IrId b = ir_op2(ir, OP_PAINT, test_span, ir_sphere(ir, 1), ir_material(ir, 0.75));
    Plan *plan = plan_of(ir, both(ir, OP_UNION, both(ir, OP_INTERSECT, a, b), b));
    uint32_t leaf;
    plan_field(plan, plan->image, (const double[]){1, 0, 0}, &leaf);
    assert_int_equal(plan->leaves[leaf].order, 0);
    assert_true(plan->image[plan->materials[plan->leaves[leaf].material].values] == 0.25);
}

static void materials_are_told_apart_by_what_they_are(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId o[5];
    for (int k = 0; k < 4; k++) o[k] = ir_op2(ir, OP_PAINT, test_span, ball_at(ir, k), ir_material(ir, k % 2));
    o[4] = ball_at(ir, 4);
    Plan *plan = plan_of(ir, list(ir, OP_UNION, o, 5));
    assert_int_equal(plan->material_count, 3);
    assert_int_equal(plan->leaves[4].material, 0);
    assert_int_equal(plan->leaves[0].material, plan->leaves[2].material);
    assert_int_equal(plan->materials[1].integer_shininess, 30);
    assert_true(plan->image[plan->materials[0].values] == 0.8); // the default
}

static void a_cavity_has_the_paint_of_the_first(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId red = ir_material(ir, 1), blue = ir_material(ir, 0.5);
    IrId body = ir_op2(ir, OP_PAINT, test_span, ir_sphere(ir, 2), red);
    IrId cut = both(ir, OP_INTERSECT, body, not(ir, ir_sphere(ir, 1)));
    Plan *plan = plan_of(ir, ir_op2(ir, OP_PAINT, test_span, cut, blue));
    assert_int_equal(plan->leaves[0].material, plan->leaves[1].material);
    assert_true(plan->image[plan->materials[plan->leaves[1].material].values] == 1);
    cut = both(ir, OP_INTERSECT, body, not(ir, ir_op2(ir, OP_PAINT, test_span, ir_sphere(ir, 1), blue)));
    plan = plan_of(ir, cut);
    assert_true(plan->image[plan->materials[plan->leaves[1].material].values] == 0.5);
    cut = both(ir, OP_INTERSECT, ir_sphere(ir, 2),
               not(ir, ir_sphere(ir, 1))); // both unpainted: what comes from outside fills both
    plan = plan_of(ir, ir_op2(ir, OP_PAINT, test_span, cut, blue));
    assert_int_equal(plan->leaves[0].material, plan->leaves[1].material);
    assert_true(plan->image[plan->materials[plan->leaves[0].material].values] == 0.5);
}

static void objects_are_the_outermost_names(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId wheel = named(ir, ir_sphere(ir, 1), "wheel");
    IrId car = named(ir, both(ir, OP_UNION, box(ir), ir_moved(ir, wheel, 2, 0, 0)), "car");
    IrId o[4] = {car, ir_moved(ir, wheel, 9, 0, 0), ball_at(ir, 20), ir_moved(ir, car, 30, 0, 0)};
    Plan *plan = plan_of(ir, list(ir, OP_UNION, o, 4));
    assert_int_equal(plan->object_count, 3);
    int counts[3] = {0};
    for (uint32_t k = 0; k < plan->leaf_count; k++) counts[plan->leaves[k].object]++;
    assert_int_equal(counts[0], 1);
    for (uint32_t k = 1; k < 3; k++) assert_int_equal(counts[k], strcmp(plan->objects[k].name, "car") ? 1 : 8);
}

static void deformed_parts_share_their_perturbations(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId operands[101] = {list(ir, OP_UNION, balls(ir, 50), 50)};
    for (int k = 1; k <= 100; k++) {
        operands[k] = ir_op3(ir, OP_PERTURB, test_span, ball_at(ir, k), ir_const(ir, 0.1), ir_const(ir, 0));
    }
    Plan *plan = plan_of(ir, ir_node(ir, OP_DEFORM, test_span, operands, 101));
    assert_string_equal(structure(plan), "union{F}");
    assert_int_equal(plan->perturbation_count, 100);
    for (uint32_t k = 0; k < plan->leaf_count; k++) {
        assert_int_equal(plan->leaves[k].begin, 0);
        assert_int_equal(plan->leaves[k].count, 100);
    }
    assert_int_equal(origins.perturbations[99].begin, test_span.begin);
}

static void a_scene_may_be_empty_or_everything(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId empty = ir_node(ir, OP_EMPTY, test_span, NULL, 0);
    Plan *plan = plan_of(ir, empty);
    assert_int_equal(plan->group_count, 1);
    assert_int_equal(plan->groups[0].component_count, 0);
    assert_true(plan_field(plan, plan->image, (const double[3]){0}, NULL) == -INFINITY);
    plan = plan_of(ir, not(ir, empty));
    assert_true(plan_field(plan, plan->image, (const double[3]){0}, NULL) > 0);
    plan = plan_of(ir, both(ir, OP_INTERSECT, ir_sphere(ir, 1), empty));
    assert_int_equal(plan->leaf_count, 0);
    plan = plan_of(ir, both(ir, OP_INTERSECT, ir_sphere(ir, 1), not(ir, empty)));
    assert_int_equal(plan->leaf_count, 1);
}

// Doubling by moved copies: 2^k leaves from k nodes.
static void copies_of_copies_are_counted(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId field = ir_sphere(ir, 1);
    for (int k = 0; k < 15; k++) field = both(ir, OP_UNION, field, ir_moved(ir, field, ldexp(1, k), 0, 0));
    assert_int_equal(plan_of(ir, field)->leaf_count, 1 << 15);
    arena_release(&arena);
    ir = ir_new(&arena);
    field = ir_sphere(ir, 1);
    for (int k = 0; k < 12; k++)
        field =
            both(ir, OP_INTERSECT, both(ir, OP_UNION, field, ir_moved(ir, field, 1, 0, 0)), not(ir, ball_at(ir, k)));
    Plan *plan;
    LowerStatus status = lower(ir, field, &plan);
    assert_true(status == LOWER_DONE && plan->shape_count <= LOWER_SHAPES);
}

static void what_alternates_too_deep_is_refused(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId field = ball_at(ir, 0);
    Plan *plan;
    for (int k = 0; k < 20000; k++)
        field = both(ir, OP_INTERSECT, both(ir, OP_UNION, field, ball_at(ir, k)), not(ir, ball_at(ir, k + 0.5)));
    assert_int_equal(lower(ir, field, &plan), LOWER_TOO_DEEP);
}

static int release(void **state)
{
    arena_release(&arena);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(a_union_of_many_is_one_shape, release),
        cmocka_unit_test_teardown(equal_trees_share_a_shape, release),
        cmocka_unit_test_teardown(unions_of_unions_are_one, release),
        cmocka_unit_test_teardown(what_is_twice_there_is_there_once, release),
        cmocka_unit_test_teardown(a_box_minus_many_is_a_group, release),
        cmocka_unit_test_teardown(many_things_cut_by_a_plane_are_a_group, release),
        cmocka_unit_test_teardown(structure_does_not_depend_on_order_or_number, release),
        cmocka_unit_test_teardown(many_different_things_have_few_shapes, release),
        cmocka_unit_test_teardown(the_order_is_that_of_the_text, release),
        cmocka_unit_test_teardown(ties_go_to_the_first, release),
        cmocka_unit_test_teardown(materials_are_told_apart_by_what_they_are, release),
        cmocka_unit_test_teardown(a_cavity_has_the_paint_of_the_first, release),
        cmocka_unit_test_teardown(objects_are_the_outermost_names, release),
        cmocka_unit_test_teardown(deformed_parts_share_their_perturbations, release),
        cmocka_unit_test_teardown(a_scene_may_be_empty_or_everything, release),
        cmocka_unit_test_teardown(copies_of_copies_are_counted, release),
        cmocka_unit_test_teardown(what_alternates_too_deep_is_refused, release),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
