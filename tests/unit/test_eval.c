// The scalar evaluator: each operation, what is undefined, and the affine maps.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>

#include "compiler/eval.h"

static double eval(IrOp op, double a, double b, double c)
{
    return eval_scalar(op, (const double[3]){a, b, c});
}

static void assert_near(double a, double b)
{
    if (fabs(a - b) > 1e-14 * fmax(1, fabs(b))) fail_msg("%.17g is not %.17g", a, b);
}

static void arithmetic(void **state)
{
    const struct {
        IrOp op;
        double a, b, result;
    } cases[] = {
        {OP_ADD, 2, 3, 5},         {OP_SUB, 2, 3, -1},    {OP_MUL, 2, 3, 6},         {OP_DIV, 3, 2, 1.5},
        {OP_NEG, 2, 0, -2},        {OP_ABS, -2, 0, 2},    {OP_SIGN, -3, 0, -1},      {OP_SIGN, 0, 0, 0},
        {OP_SIGN, 5, 0, 1},        {OP_MIN, 2, 3, 2},     {OP_MAX, 2, 3, 3},         {OP_POW, 2, 10, 1024},
        {OP_SQRT, 9, 0, 3},        {OP_EXP, 0, 0, 1},     {OP_LOG, 1, 0, 0},         {OP_FLOOR, -1.5, 0, -2},
        {OP_CEIL, -1.5, 0, -1},    {OP_ROUND, 2.5, 0, 3}, {OP_ROUND, -2.5, 0, -3},   {OP_ATAN2, 0, -1, M_PI},
        {OP_ASIN, 1, 0, M_PI / 2}, {OP_ACOS, 1, 0, 0},    {OP_ATAN, 1, 0, M_PI / 4}, {OP_TAN, M_PI / 4, 0, 1},
        {OP_LT, 1, 2, 1},          {OP_LT, 2, 2, 0},      {OP_LE, 2, 2, 1},          {OP_EQ, 2, 2, 1},
        {OP_EQ, 2, 3, 0},          {OP_NOT, 0, 0, 1},     {OP_NOT, 7, 0, 0},         {OP_AND, 2, 3, 1},
        {OP_AND, 2, 0, 0},         {OP_OR, 0, 3, 1},      {OP_OR, 0, 0, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        assert_near(eval(cases[k].op, cases[k].a, cases[k].b, 0), cases[k].result);
    assert_near(eval(OP_SELECT, 1, 5, 6), 5);
    assert_near(eval(OP_SELECT, 0, 5, 6), 6);
}

static void mod_has_the_sign_of_its_second_operand(void **state)
{
    assert_near(eval(OP_MOD, 7, 3, 0), 1);
    assert_near(eval(OP_MOD, -7, 3, 0), 2);
    assert_near(eval(OP_MOD, 7, -3, 0), -2);
    assert_near(eval(OP_MOD, -7, -3, 0), -1);
    assert_near(eval(OP_MOD, -6, 3, 0), 0);
}

static void quarter_turns_are_exact(void **state)
{
    static const double wave[5] = {0, 1, 0, -1, 0};
    for (int k = -9; k <= 9; k++) {
        double angle = k * 90 * (M_PI / 180);
        assert_true(eval(OP_SIN, angle, 0, 0) == wave[(k + 12) % 4]);
        assert_true(eval(OP_COS, angle, 0, 0) == wave[(k + 12) % 4 + 1]);
    }
    assert_true(eval(OP_SIN, 1e-20, 0, 0) == 1e-20);
    assert_true(eval(OP_SIN, 3.14, 0, 0) == sin(3.14));
}

static void what_is_undefined_is_not_finite(void **state)
{
    assert_false(isfinite(eval(OP_DIV, 1, 0, 0)));
    assert_false(isfinite(eval(OP_SQRT, -1, 0, 0)));
    assert_false(isfinite(eval(OP_LOG, 0, 0, 0)));
    assert_false(isfinite(eval(OP_POW, -1, 0.5, 0)));
    assert_false(isfinite(eval(OP_ASIN, 1.1, 0, 0)));
    assert_false(isfinite(eval(OP_TAN, M_PI / 2, 0, 0)));
    assert_false(isfinite(eval(OP_MOD, 1, 0, 0)));
    assert_string_equal(eval_complaint(OP_DIV, (const double[3]){1, 0, 0}), "division by zero");
    assert_string_equal(eval_complaint(OP_SQRT, (const double[3]){-1, 0, 0}), "the square root of a negative number");
}

static void it_poisons_all_but_what_is_not_looked_at(void **state)
{
    for (int op = OP_ADD; op <= OP_SELECT; op++) {
        assert_true(eval_knows(op));
        assert_false(isfinite(eval(op, INFINITY, 1, 1)));
        if (ir_ops[op].operands == 2 && op != OP_AND && op != OP_OR) assert_false(isfinite(eval(op, 1, NAN, 1)));
    }
    assert_near(eval(OP_AND, 0, NAN, 0), 0);
    assert_near(eval(OP_OR, 1, NAN, 0), 1);
    assert_false(isfinite(eval(OP_AND, 1, NAN, 0)));
    assert_near(eval(OP_SELECT, 1, 5, INFINITY), 5);
    assert_near(eval(OP_SELECT, 0, NAN, 6), 6);
    assert_false(eval_knows(OP_CONST));
    assert_false(eval_knows(OP_HEIGHT));
}

static void maps_compose_and_invert(void **state)
{
    const double a[12] = {2, 1, 0, 3, -1, 1, 0.5, 4, 0, 0.25, 3, 5};
    double b[12], both[12], p[3] = {1, -2, 3}, q[3], back[3];
    assert_true(matrix_inverse(a, b));
    matrix_compose(a, b, both);
    for (int k = 0; k < 12; k++) assert_near(both[k], k % 5 == 0 ? 1 : 0);
    matrix_point(a, p, q);
    matrix_point(b, q, back);
    for (int k = 0; k < 3; k++) assert_near(back[k], p[k]);
}

static void what_flattens_space_has_no_inverse(void **state)
{
    double r[12];
    assert_false(matrix_inverse((const double[12]){1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0}, r));
    assert_false(matrix_inverse((const double[12]){1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0}, r));
    assert_false(matrix_inverse((const double[12]){NAN, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, r));
    assert_true(matrix_inverse((const double[12]){1e-3, 0, 0, 0, 0, 1e3, 0, 0, 0, 0, 1, 0}, r));
}

// z is the normal, x the cross product of z with the axis that it leans to least, and all are right-handed.
static void a_tool_stands_on_its_normal(void **state)
{
    const double at[3] = {1, 2, 3};
    double m[12];
    assert_true(matrix_stand(at, (const double[3]){0, 0, 2}, 0, m));
    for (int k = 0; k < 3; k++) {
        assert_near(m[4 * k + 2], k == 2); // z
        assert_near(m[4 * k + 3], at[k]);  // the origin
    }
    assert_near(m[0], 0); // z x (x axis) = y axis
    assert_near(m[4], 1);
    assert_near(m[1], -1); // and y = z x x
    assert_true(matrix_stand(at, (const double[3]){0.3, -0.2, 0.9}, 0.7, m));
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double dot = 0;
            for (int k = 0; k < 3; k++) dot += m[4 * k + i] * m[4 * k + j];
            assert_near(dot, i == j);
        }
    }
    double det =
        m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
    assert_near(det, 1);
    assert_false(matrix_stand(at, (const double[3]){0, 0, 0}, 0, m));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arithmetic),
        cmocka_unit_test(mod_has_the_sign_of_its_second_operand),
        cmocka_unit_test(quarter_turns_are_exact),
        cmocka_unit_test(what_is_undefined_is_not_finite),
        cmocka_unit_test(it_poisons_all_but_what_is_not_looked_at),
        cmocka_unit_test(maps_compose_and_invert),
        cmocka_unit_test(what_flattens_space_has_no_inverse),
        cmocka_unit_test(a_tool_stands_on_its_normal),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
