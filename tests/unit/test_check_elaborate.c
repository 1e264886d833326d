// Elaboration: options from the command line, prints, and the IR that scenes become.
#include "test_lang.h"

#include <math.h>

#include "compiler/check.h"
#include "compiler/elaborate.h"
#include "compiler/ir.h"

typedef struct Made {
    Unit unit;
    ElaborateOptions options;
    Ir *ir;
} Made;

static void make(Made *made, const char *text)
{
    Node *tree = parse_bytes(&made->unit, text, strlen(text));
    check(&made->unit, tree);
    if (made->unit.errors) fail_msg("%s", reported(&made->unit));
    made->ir = elaborate(&made->unit, tree, &made->options);
    if (made->ir) assert_null(ir_verify(made->ir));
}

static void release(Made *made)
{
    unit_release(&made->unit);
}

static const IrNode *root(const Made *made)
{
    return ir_at(made->ir, made->ir->root);
}

static double operand(const Made *made, IrId id, uint32_t k)
{
    double value = NAN;
    assert_true(ir_is_const(made->ir, ir_operand(made->ir, id, k), &value));
    return value;
}

static void handles_are_slots_and_structure_is_compiled_in(void **state)
{
    Made m = {0};
    make(&m, "/// how big\nparam size: scalar = 2 in 1 .. 3;\nparam n: int = 3;\nparam c: color = #fff;\nparam k: "
             "string = \"a\" in [\"a\", \"b\"];\n"
             "union { for i in 0 .. n { sphere(size).move(i, 0, 0); } }\n");
    assert_int_equal(m.ir->param_count, 4);
    assert_int_equal(m.ir->input_count, 4);
    const IrParam *p = m.ir->params;
    assert_string_equal(p[0].name, "size");
    assert_string_equal(p[0].doc, "how big");
    assert_true(p[0].ranged && p[0].low == 1 && p[0].high == 3 && p[0].value[0] == 2 && !p[0].structure);
    assert_true(p[1].structure && p[1].value[0] == 3);
    assert_int_equal(p[2].slot, 1);
    assert_string_equal(p[3].choices[1], "b");
    assert_int_equal(root(&m)->count, 3);
    assert_int_equal(root(&m)->rate, RATE_FRAME);
    assert_int_equal(m.ir->assert_count, 1); // that a radius is greater than 0
    release(&m);
}

static void defines_replace_defaults(void **state)
{
    static const Define defines[] = {{"n", "2"}, {"size", "0.5"}, {"n", "4"}};
    Made m = {.options = {.defines = defines, .define_count = 3}};
    make(&m, "param size: scalar = 2;\nparam n: int = 3 in 1 .. 9;\nunion { for i in 0 .. n { sphere(size).move(i, 0, "
             "0); } }\n");
    assert_int_equal(root(&m)->count, 4);
    assert_true(m.ir->params[0].value[0] == 0.5);
    release(&m);
}

static void wrong_defines_are_not_the_scenes_fault(void **state)
{
    static const struct {
        Define define;
        const char *says;
    } cases[] = {
        {{"sise", "2"}, "do you mean size"},
        {{"size", "big"}, "param size: \"big\" is no scalar"},
        {{"n", "10"}, "beyond the range 1 .. 9"},
        {{"zzz", "1"}, "no param zzz"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Made m = {.options = {.defines = &cases[i].define, .define_count = 1}};
        make(&m, "param size: scalar = 2;\nparam n: int = 3 in 1 .. 9;\nsphere(size + n);\n");
        assert_null(m.ir);
        assert_int_equal(m.unit.errors, 0);
        assert_null(m.unit.diagnostics.first); // one mistake is one message: no warning that nothing is shown
        assert_non_null(strstr(m.options.wrong, cases[i].says));
        release(&m);
    }
}

static void the_first_camera_or_that_of_the_name(void **state)
{
    const char *scene =
        "camera front { eye: (0, 0, 5); }\ncamera side { eye: (5, 0, 0); projection: \"orthographic\"; }\nsphere(1);\n";
    Made m = {0};
    make(&m, scene);
    assert_true(operand(&m, m.ir->camera, 2) == 5);
    release(&m);
    m = (Made){.options = {.camera = "side"}};
    make(&m, scene);
    assert_true(operand(&m, m.ir->camera, 0) == 5);
    assert_int_equal(ir_at(m.ir, m.ir->camera)->index, 1);
    release(&m);
    m = (Made){.options = {.camera = "sid"}};
    make(&m, scene);
    assert_null(m.ir);
    assert_non_null(strstr(m.options.wrong, "do you mean side"));
    release(&m);
}

static void what_is_missing_is_made_up(void **state)
{
    Made m = {0};
    make(&m, "sphere(1);\n");
    assert_int_equal(m.ir->light_count, 2);
    assert_true(operand(&m, m.ir->camera, 14) == 1);
    assert_int_equal(ir_at(m.ir, m.ir->background)->op, OP_BACKGROUND);
    assert_true(m.ir->duration == 0 && m.ir->fps == 24);
    release(&m);
}

static void prints_come_in_the_order_of_the_text(void **state)
{
    char *text;
    size_t size;
    Made m = {.options = {.print = open_memstream(&text, &size)}};
    make(&m, "print \"one\", late;\nlet late = { print \"three\"; 2 };\nprint \"four\";\nsphere(1);\n");
    fclose(m.options.print);
    assert_string_equal(text, "one 2\nthree\nfour\n");
    free(text);
    release(&m);
}

static void what_nothing_uses_is_looked_at_on_demand(void **state)
{
    const char *scene = "let never = 1 / 0;\nsphere(1);\n";
    Made m = {0};
    make(&m, scene);
    assert_non_null(m.ir);
    release(&m);
    m = (Made){.options = {.unused = true}};
    make(&m, scene);
    assert_null(m.ir);
    assert_string_equal(reported(&m.unit), "1:5 unused, 1:13 division-by-zero");
    release(&m);
}

static void objects_are_shared_and_named(void **state)
{
    Made m = {0};
    make(&m, "object ball = sphere(1);\nball;\nball.move(1, 0, 0);\n");
    const IrNode *union_node = root(&m);
    assert_int_equal(union_node->op, OP_UNION);
    IrId first = ir_operand(m.ir, m.ir->root, 0), second = ir_operand(m.ir, m.ir->root, 1);
    assert_int_equal(ir_at(m.ir, first)->op, OP_NAMED);
    assert_string_equal(ir_at(m.ir, first)->text, "ball");
    assert_int_equal(ir_operand(m.ir, second, 0), first);
    release(&m);
}

static void chains_of_sets_are_one_node(void **state)
{
    Made m = {0};
    make(&m, "sphere(1) | sphere(2) | sphere(3) | sphere(4);\n");
    assert_int_equal(root(&m)->op, OP_UNION);
    assert_int_equal(root(&m)->count, 4);
    release(&m);
    m = (Made){0};
    make(&m, "sphere(4) - sphere(1) - sphere(2);\n");
    assert_int_equal(root(&m)->op, OP_INTERSECT);
    assert_int_equal(root(&m)->count, 3);
    assert_int_equal(ir_at(m.ir, ir_operand(m.ir, m.ir->root, 2))->op, OP_COMPLEMENT);
    release(&m);
}

// F of shapes is 0 and its gradient 1 where section 9 of the reference says so.
static void shapes_are_scaled_to_lengths(void **state)
{
    static const struct {
        const char *scene;
        double at[3], gradient;
    } cases[] = {
        {"sphere(2);", {0, 2, 0}, 1},
        {"ellipsoid(1, 2, 4);", {1, 0, 0}, 1},
        {"ellipsoid(1, 2, 4);", {0, 0, 4}, 0.25},
        {"cylinder(3);", {0, 3, 7}, 1},
        {"cylinder(3, axis: (0, 2, 0));", {3, 5, 0}, 1},
        {"cone(2);", {2, 0, 1}, 1},
        {"paraboloid(2);", {0, 0, 0}, 1},
        {"hyperboloid1(2, 0.5);", {0, 2, 0}, 1},
        {"hyperboloid2(2, 0.5);", {0, 0, 2}, 1},
        {"saddle(1, 2);", {0, 0, 0}, 1},
        {"halfspace((3, 4, 0), at: (1, 1, 1));", {1, 1, 9}, 1},
        {"slab(y: 1 .. 3);", {5, 3, 0}, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Made m = {0};
        make(&m, cases[i].scene);
        assert_int_equal(root(&m)->op, OP_QUADRIC);
        double q[10];
        for (uint32_t k = 0; k < 10; k++) q[k] = operand(&m, m.ir->root, k);
        double x = cases[i].at[0], y = cases[i].at[1], z = cases[i].at[2];
        double f = q[0] * x * x + q[1] * y * y + q[2] * z * z + q[3] * x * y + q[4] * x * z + q[5] * y * z + q[6] * x +
                   q[7] * y + q[8] * z + q[9];
        double gx = 2 * q[0] * x + q[3] * y + q[4] * z + q[6], gy = 2 * q[1] * y + q[3] * x + q[5] * z + q[7];
        double gz = 2 * q[2] * z + q[4] * x + q[5] * y + q[8];
        if (fabs(f) > 1e-12) fail_msg("%s: F is %g", cases[i].scene, f);
        double length = sqrt(gx * gx + gy * gy + gz * gz);
        if (fabs(length - cases[i].gradient) > 1e-12) fail_msg("%s: the gradient is %g", cases[i].scene, length);
        release(&m);
    }
}

static void asserts_of_a_branch_hold_where_it_is_taken(void **state)
{
    Made m = {0};
    make(&m, "param a: scalar = 1;\nfn f(v: scalar) -> scalar { assert v > 0, \"above zero\"; v }\nsphere(if a > 2 { "
             "f(a) } else { 1 });\n");
    assert_int_equal(m.ir->assert_count, 2); // its own, and that of the sphere
    const IrNode *assert_node = ir_at(m.ir, m.ir->asserts[0]);
    assert_string_equal(assert_node->text, "above zero");
    assert_int_equal(ir_at(m.ir, ir_operand(m.ir, m.ir->asserts[0], 0))->op, OP_OR);
    release(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(handles_are_slots_and_structure_is_compiled_in),
        cmocka_unit_test(defines_replace_defaults),
        cmocka_unit_test(wrong_defines_are_not_the_scenes_fault),
        cmocka_unit_test(the_first_camera_or_that_of_the_name),
        cmocka_unit_test(what_is_missing_is_made_up),
        cmocka_unit_test(prints_come_in_the_order_of_the_text),
        cmocka_unit_test(what_nothing_uses_is_looked_at_on_demand),
        cmocka_unit_test(objects_are_shared_and_named),
        cmocka_unit_test(chains_of_sets_are_one_node),
        cmocka_unit_test(shapes_are_scaled_to_lengths),
        cmocka_unit_test(asserts_of_a_branch_hold_where_it_is_taken),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
