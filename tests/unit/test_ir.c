// The IR: what building shares and folds, rates and classes, the text form and the verifier.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>

#include "ir_random.h"

static Arena arena;

static char *printed(const Ir *ir)
{
    char *text;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    ir_print(ir, out);
    fclose(out);
    char *copy = arena_text(&arena, text, length);
    free(text);
    return copy;
}

static double number(const Ir *ir, IrId id)
{
    double value = NAN;
    assert_true(ir_is_const(ir, id, &value));
    return value;
}

static IrId time_of(Ir *ir)
{
    return ir_node(ir, OP_TIME, test_span, NULL, 0);
}

// --- building

static void equal_scalars_are_one_node(void **state)
{
    Ir *ir = ir_new(&arena);
    assert_int_equal(ir_const(ir, 2.5), ir_const(ir, 2.5));
    assert_int_not_equal(ir_const(ir, 2.5), ir_const(ir, 2.6));
    IrId t = time_of(ir);
    assert_int_equal(ir_op2(ir, OP_ADD, test_span, t, ir_const(ir, 1)),
                     ir_op2(ir, OP_ADD, test_span, t, ir_const(ir, 1)));
    IrId by[3] = {t, ir_const(ir, 0), ir_const(ir, 0)};
    assert_int_equal(ir_move(ir, test_span, by), ir_move(ir, test_span, by));
    assert_int_not_equal(ir_sphere(ir, 1), ir_sphere(ir, 1)); // two objects that are written twice
    for (int k = 0; k < 100000; k++) assert_int_equal(ir_const(ir, k), ir_const(ir, k));
}

static void what_is_const_folds(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId two = ir_const(ir, 2), three = ir_const(ir, 3);
    assert_true(number(ir, ir_op2(ir, OP_POW, test_span, two, three)) == 8);
    assert_true(number(ir, ir_op3(ir, OP_SELECT, test_span, ir_const(ir, 0), two, three)) == 3);
    double m[12];
    IrId by[3] = {two, three, two};
    assert_true(ir_const_matrix(ir, ir_op1(ir, OP_INVERSE, test_span, ir_move(ir, test_span, by)), m));
    assert_true(m[3] == -2 && m[7] == -3 && m[11] == -2);
    assert_true(ir_const_matrix(
        ir, ir_op2(ir, OP_COMPOSE, test_span, ir_move(ir, test_span, by), ir_move(ir, test_span, by)), m));
    assert_true(m[3] == 4 && m[7] == 6);
}

static void what_says_nothing_is_dropped(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId t = time_of(ir), zero = ir_const(ir, 0), one = ir_const(ir, 1);
    assert_int_equal(ir_op2(ir, OP_ADD, test_span, t, zero), t);
    assert_int_equal(ir_op2(ir, OP_MUL, test_span, one, t), t);
    assert_int_equal(ir_op2(ir, OP_MUL, test_span, zero, t), zero);
    assert_int_equal(ir_op2(ir, OP_DIV, test_span, t, one), t);
    assert_int_equal(ir_op1(ir, OP_NEG, test_span, ir_op1(ir, OP_NEG, test_span, t)), t);
    assert_int_equal(ir_op3(ir, OP_SELECT, test_span, one, t, zero), t);
    IrId x = ir_node(ir, OP_X, test_span, NULL, 0);
    assert_int_equal(ir_op2(ir, OP_MUL, test_span, zero, ir_op2(ir, OP_ADD, test_span, x, one)), zero);
    IrId pole = ir_op2(ir, OP_DIV, test_span, one, x);
    assert_int_not_equal(ir_op2(ir, OP_MUL, test_span, zero, pole),
                         zero); // where F is undefined is a question of points
    IrId ball = ir_sphere(ir, 1);
    assert_int_equal(ir_node(ir, OP_UNION, test_span, &ball, 1), ball);
    assert_int_equal(ir_node(ir, OP_FREEFORM, test_span, &ball, 1), ball);
    assert_int_equal(ir_at(ir, ir_node(ir, OP_UNION, test_span, NULL, 0))->op, OP_EMPTY);
    IrId identity = ir_matrix(ir, test_span, (const double[12]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    IrId by[3] = {t, zero, zero}, map = ir_move(ir, test_span, by);
    assert_int_equal(ir_op2(ir, OP_COMPOSE, test_span, identity, map), map);
    assert_int_equal(ir_op2(ir, OP_COMPOSE, test_span, map, identity), map);
}

static void what_has_no_value_stays_and_is_bad_once(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId zero = ir_const(ir, 0), one = ir_const(ir, 1);
    IrId bad = ir_op2(ir, OP_DIV, test_span, one, zero);
    assert_true(ir_bad_fold(ir, bad));
    assert_string_equal(ir_complaint(ir, bad), "division by zero");
    assert_false(ir_bad_fold(ir, ir_op2(ir, OP_ADD, test_span, bad, one)));          // because of what it is made of
    assert_false(ir_bad_fold(ir, ir_op2(ir, OP_DIV, test_span, time_of(ir), zero))); // the frame's affair
    IrId flat[3] = {one, zero, one};
    IrId scaled = ir_op2(ir, OP_TRANSFORM, test_span, ir_sphere(ir, 1), ir_scale(ir, test_span, flat, NULL));
    assert_true(ir_bad_fold(ir, scaled));
    assert_string_equal(ir_complaint(ir, scaled), "the transform cannot be inverted: it flattens space");
    IrId centre[5] = {ir_sphere(ir, 1), zero, zero, zero, zero};
    IrId place = ir_node(ir, OP_PLACE, test_span, centre, 5);
    assert_true(ir_bad_fold(ir, place));
    assert_non_null(strstr(ir_complaint(ir, place), "misses"));
    assert_false(ir_bad_fold(ir, ir_sphere(ir, 1)));
}

static void rates_and_classes_follow(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId t = time_of(ir), ball = ir_sphere(ir, 1), zero = ir_const(ir, 0);
    assert_int_equal(ir_at(ir, t)->rate, RATE_FRAME);
    assert_int_equal(ir_at(ir, ir_op2(ir, OP_ADD, test_span, t, ir_node(ir, OP_X, test_span, NULL, 0)))->rate,
                     RATE_POINT);
    assert_int_equal(ir_at(ir, ball)->rate, RATE_CONST);
    assert_int_equal(ir_at(ir, ball)->class, CLASS_QUADRIC);
    IrId by[3] = {t, zero, zero};
    IrId moved = ir_op2(ir, OP_TRANSFORM, test_span, ball, ir_move(ir, test_span, by));
    assert_int_equal(ir_at(ir, moved)->rate, RATE_FRAME);
    assert_int_equal(ir_at(ir, moved)->class, CLASS_QUADRIC);
    IrId bump = ir_op3(ir, OP_PERTURB, test_span, moved, ir_const(ir, 1), zero);
    IrId form = ir_op2(ir, OP_FREEFORM, test_span, ball, bump);
    assert_int_equal(ir_at(ir, form)->class, CLASS_FREEFORM);
    assert_int_equal(ir_at(ir, form)->rate, RATE_FRAME);
    IrId set = ir_op2(ir, OP_UNION, test_span, form, ball);
    assert_int_equal(ir_at(ir, set)->class, CLASS_SET);
    assert_int_equal(ir_at(ir, ir_op2(ir, OP_FREEFORM, test_span, set, bump))->class, CLASS_SET);
    assert_int_equal(ir_at(ir, ir_op2(ir, OP_SHOW, test_span, ball, t))->class, CLASS_SET);
}

// --- maps

static void assert_maps(const Ir *ir, IrId map, const double p[3], const double expected[3])
{
    double m[12], q[3];
    assert_true(ir_const_matrix(ir, map, m));
    matrix_point(m, p, q);
    for (int k = 0; k < 3; k++) {
        if (fabs(q[k] - expected[k]) > 1e-14)
            fail_msg("(%g, %g, %g) instead of (%g, %g, %g)", q[0], q[1], q[2], expected[0], expected[1], expected[2]);
    }
}

static void maps_are_what_they_are_called(void **state)
{
    Ir *ir = ir_new(&arena);
    const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1};
    IrId zero = ir_const(ir, 0), one = ir_const(ir, 1), quarter = ir_const(ir, M_PI / 2), two = ir_const(ir, 2);
    IrId about_z[3] = {zero, zero, two}, one_one[3] = {one, one, zero};
    assert_maps(ir, ir_rotate_axis(ir, test_span, about_z, quarter, NULL), x, y); // right-handed
    assert_maps(ir, ir_rotate_axis(ir, test_span, about_z, quarter, NULL), y, (const double[3]){-1, 0, 0});
    assert_maps(ir, ir_rotate_axis(ir, test_span, about_z, quarter, one_one), x, (const double[3]){2, 1, 0});
    IrId xyz[3] = {quarter, quarter, zero}; // about x first: y goes to z, and that about y to x
    assert_maps(ir, ir_rotate_xyz(ir, test_span, xyz, NULL), y, x);
    assert_maps(ir, ir_rotate_xyz(ir, test_span, xyz, NULL), z, (const double[3]){0, -1, 0});
    IrId factors[3] = {two, one, one};
    assert_maps(ir, ir_scale(ir, test_span, factors, one_one), (const double[3]){3, 5, 7}, (const double[3]){5, 5, 7});
    IrId shear[6] = {two, zero, zero, zero, zero, zero}; // x += 2 y
    assert_maps(ir, ir_shear(ir, test_span, shear), y, (const double[3]){2, 1, 0});
}

static void turns_by_quarters_are_exact(void **state)
{
    Ir *ir = ir_new(&arena);
    double m[12];
    IrId xyz[3] = {ir_const(ir, M_PI / 2), ir_const(ir, -M_PI), ir_const(ir, 3 * M_PI / 2)};
    assert_true(ir_const_matrix(ir, ir_rotate_xyz(ir, test_span, xyz, NULL), m));
    for (int k = 0; k < 12; k++) assert_true(m[k] == 0 || fabs(m[k]) == 1);
}

static void tools_find_their_place(void **state)
{
    Ir *ir = ir_new(&arena);
    double m[12];
    IrId operands[5] = {ir_moved(ir, ir_sphere(ir, 2), 1, 0, 0), ir_const(ir, 1), ir_const(ir, 7), ir_const(ir, 0),
                        ir_const(ir, 0)};
    assert_true(ir_const_matrix(ir, ir_node(ir, OP_PLACE, test_span, operands, 5), m));
    assert_true(fabs(m[3] - 1) < 1e-15 && fabs(m[7] - 2) < 1e-15 && fabs(m[11]) < 1e-15); // on the surface
    assert_true(fabs(m[6] - 1) < 1e-15);                                                  // z outward
    operands[2] = ir_const(ir, 0.1);                                                      // from inside
    assert_true(ir_const_matrix(ir, ir_node(ir, OP_PLACE, test_span, operands, 5), m));
    assert_true(fabs(m[7] - 2) < 1e-15);
    operands[2] = ir_const(ir, 2); // already there
    assert_true(ir_const_matrix(ir, ir_node(ir, OP_PLACE, test_span, operands, 5), m));
    assert_true(m[7] == 2);
}

// With the strength that HEIGHT gives, the surface passes through the point.
static void heights_are_lengths(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId zero = ir_const(ir, 0), ball = ir_sphere(ir, 1);
    IrId up[3] = {zero, zero, ir_const(ir, 1)}, map = ir_move(ir, test_span, up);
    IrId bump = ir_quadric(ir, (const double[10]){-9, -9, -4, 0, 0, 0, 0, 0, 0, 1});
    IrId operands[6] = {ball, bump, map, zero, zero, ir_const(ir, 0.2)};
    IrId strength = ir_node(ir, OP_HEIGHT, test_span, operands, 6);
    IrId perturbation = ir_op3(ir, OP_PERTURB, test_span, bump, strength, zero);
    perturbation = ir_op2(ir, OP_PTRANSFORM, test_span, perturbation, map);
    IrId form = ir_op2(ir, OP_FREEFORM, test_span, ball, perturbation);
    IrValues values = ir_evaluate(ir, &arena, 0, NULL);
    FieldCode code = ir_field_code(&values, form);
    assert_true(fabs(field_at(code, values.values, (const double[3]){0, 0, 1.2}).f) < 1e-15);
    operands[5] = ir_const(ir, 3); // out of the support's reach
    assert_true(ir_bad_fold(ir, ir_node(ir, OP_HEIGHT, test_span, operands, 6)));
}

// --- text

static void the_text_is_for_people(void **state)
{
    Ir *ir = ir_new(&arena);
    IrId ball = ir_sphere(ir, 0.5), named = ir_node_text(ir, OP_NAMED, test_span, &ball, 1, "a \"ball\"\n");
    IrId by[3] = {ir_op2(ir, OP_MUL, test_span, time_of(ir), ir_const(ir, 0.1)), ir_const(ir, 0), ir_const(ir, 0)};
    ir_complete(ir, ir_op2(ir, OP_TRANSFORM, test_span, named, ir_move(ir, test_span, by)));
    ir->duration = 4;
    assert_string_equal(printed(ir), "ir 1\n"
                                     "%1 = quadric -1 -1 -1 0 0 0 0 0 0 0.25  // quadric\n"
                                     "%2 = named \"a \\\"ball\\\"\\x0a\" %1  // quadric\n"
                                     "%3 = time  // frame\n"
                                     "%4 = mul %3 0.1  // frame\n"
                                     "%5 = matrix 1 0 0 %4 0 1 0 0 0 0 1 0  // frame\n"
                                     "%6 = transform %2 %5  // frame quadric\n"
                                     "%7 = camera[0] 0 0 5 0 0 0 0 1 0 0.7 2 0 0 0 0\n"
                                     "%8 = background 0.05 0.05 0.05 0.05\n"
                                     "camera %7\nbackground %8\nscene %6\nanimation 4 24\n");
}

static void it_reads_back(void **state)
{
    for (uint64_t seed = 1; seed <= 500; seed++) {
        Random random = {seed};
        Ir *ir = random_ir(&arena, &random, true);
        const char *text = printed(ir);
        IrReadError error;
        Ir *again = ir_read(&arena, text, strlen(text), &error);
        if (!again) fail_msg("seed %llu: line %u: %s", (unsigned long long)seed, error.line, error.text);
        assert_string_equal(printed(again), text);
        arena_release(&arena);
    }
}

static void numbers_read_back_bit_for_bit(void **state)
{
    Random random = {7};
    for (int n = 0; n < 3000; n++) {
        Ir *ir = ir_new(&arena);
        double q[10];
        for (int k = 0; k < 10; k++) {
            uint64_t bits = random_bits(&random);
            memcpy(&q[k], &bits, sizeof bits);
            if (!isfinite(q[k])) q[k] = -0.0;
        }
        ir_complete(ir, ir_quadric(ir, q));
        const char *text = printed(ir);
        IrReadError error;
        Ir *again = ir_read(&arena, text, strlen(text), &error);
        assert_non_null(again);
        for (uint32_t k = 0; k < 10; k++)
            assert_memory_equal(&again->nodes[ir_operand(again, again->root, k)].number, &q[k], 8);
        arena_release(&arena);
    }
}

static void params_read_back(void **state)
{
    const char *text = "ir 1\n"
                       "param \"squash\" scalar slot 0 value 0.2 range 0 1 doc \"How far.\"\n"
                       "param \"count\" int structure value 5 range 1 9\n"
                       "param \"style\" string structure text \"soft\" choices \"soft\" \"hard\"\n"
                       "param \"tint\" color slot 1 value 1 0.5 0.25\n"
                       "param \"on\" bool structure value 1\n"
                       "%1 = param[3]  // frame\n"
                       "%2 = quadric -1 -1 -1 0 0 0 0 0 0 %1  // frame quadric\n"
                       "%3 = camera[1] 0 0 5 0 0 0 0 1 0 0.7 2 0 0 0 0\n"
                       "%4 = background 0 0 0 0\n"
                       "%5 = light[1] 0 0 0 0 0 5 1 1 1 0 0 0 0 1\n"
                       "%6 = lt %1 2  // frame\n"
                       "%7 = assert \"too much\" %6  // frame\n"
                       "camera %3\nbackground %4\nlight %5\nassert %7\nscene %2\nanimation 2.5 30\n";
    IrReadError error;
    Ir *ir = ir_read(&arena, text, strlen(text), &error);
    if (!ir) fail_msg("line %u: %s", error.line, error.text);
    assert_string_equal(printed(ir), text);
    assert_int_equal(ir->input_count, 4);
    assert_string_equal(ir->params[2].choices[1], "hard");
}

static void assert_refused(const char *text, uint32_t line, const char *reason)
{
    char *whole = arena_printf(&arena,
                               "ir 1\n%%1 = camera[0] 0 0 5 0 0 0 0 1 0 0.7 2 0 0 0 0\n%%2 = background 0 0 0 0\n"
                               "%%3 = quadric -1 -1 -1 0 0 0 0 0 0 1\ncamera %%1\nbackground %%2\n%s",
                               text);
    IrReadError error;
    if (ir_read(&arena, whole, strlen(whole), &error)) fail_msg("accepted: %s", text);
    if (error.line != line + 6 || !strstr(error.text, reason))
        fail_msg("%s: line %u: %s", text, error.line, error.text);
}

static void what_is_no_ir_is_refused(void **state)
{
    IrReadError error;
    assert_null(ir_read(&arena, "", 0, &error));
    assert_null(ir_read(&arena, "ir 2\n", 5, &error));
    assert_string_equal(error.text, "the first line is to be 'ir 1'");
    assert_refused("%4 = nonsense 1 2\n", 1, "no operation");
    assert_refused("%4 = add 1\n", 1, "too few operands");
    assert_refused("%4 = neg 1 2\n", 1, "takes 1 operands");
    assert_refused("%4 = add %3 1\n", 1, "to be a scalar");
    assert_refused("%4 = union %9\n", 1, "not defined before");
    assert_refused("%4 = union %4\n", 1, "not defined before");
    assert_refused("%2 = empty\n", 1, "ascend");
    assert_refused("%4 = named ball %3\n", 1, "'\"' is missing");
    assert_refused("%4 = named \"ball %3\n", 1, "'\"' is missing");
    assert_refused("scene %1\n", 1, "no scene");
    assert_refused("scene %3\nscene %3\n", 2, "a second");
    assert_refused("scene %3 %3\n", 1, "goes on");
    assert_refused("%4 = empty\n%5 = perturb %4 1 0\n", 2, "to be a quadric");
    assert_refused("%4 = param[0]\nscene %3\n", 2, "names an input");
    assert_refused("%4 = x\n%5 = matrix %4 0 0 0 0 0 0 0 0 0 0 0\nscene %3\n", 3, "known once a frame");
    assert_refused("%4 = quadric 1e999 0 0 0 0 0 0 0 0 0\nscene %4\n", 2, "finite");
    assert_refused("param \"a\" scalar slot 3\n", 1, "next slot is 0");
    assert_refused("param \"a\" thing\n", 1, "no type");
    assert_refused("what\n", 1, "begins no line");
}

// --- the verifier

static void the_verifier_finds_what_is_broken(void **state)
{
    for (int fault = 0; fault < 9; fault++) {
        Random random = {11};
        Ir *ir = random_ir(&arena, &random, true);
        assert_null(ir_verify(ir));
        IrNode *last = &ir->nodes[ir->root];
        switch (fault) {
        case 0: ir->operands[last->first] = ir->root; break;
        case 1: last->rate = RATE_POINT; break;
        case 2: last->class = CLASS_NONE; break;
        case 3: last->type = IR_SCALAR; break;
        case 4: last->op = OP_COUNT; break;
        case 5: ir->camera = ir->root; break;
        case 6: ir->params[0].slot = 1; break;
        case 7: last->count = UINT32_MAX; break;
        case 8: ir->fps = 0; break;
        }
        if (!ir_verify(ir)) fail_msg("fault %d was not found", fault);
        arena_release(&arena);
    }
}

static int release(void **state)
{
    arena_release(&arena);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(equal_scalars_are_one_node, release),
        cmocka_unit_test_teardown(what_is_const_folds, release),
        cmocka_unit_test_teardown(what_says_nothing_is_dropped, release),
        cmocka_unit_test_teardown(what_has_no_value_stays_and_is_bad_once, release),
        cmocka_unit_test_teardown(rates_and_classes_follow, release),
        cmocka_unit_test_teardown(maps_are_what_they_are_called, release),
        cmocka_unit_test_teardown(turns_by_quarters_are_exact, release),
        cmocka_unit_test_teardown(tools_find_their_place, release),
        cmocka_unit_test_teardown(heights_are_lengths, release),
        cmocka_unit_test_teardown(the_text_is_for_people, release),
        cmocka_unit_test_teardown(it_reads_back, release),
        cmocka_unit_test_teardown(numbers_read_back_bit_for_bit, release),
        cmocka_unit_test_teardown(params_read_back, release),
        cmocka_unit_test_teardown(what_is_no_ir_is_refused, release),
        cmocka_unit_test_teardown(the_verifier_finds_what_is_broken, release),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
