// Quadrics: ten coefficients under maps, in their own axes, at their peak.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "ir_random.h"

static void random_coefficients(Random *r, double q[10])
{
    for (int k = 0; k < 10; k++) q[k] = random_in(r, -2, 2);
}

static void random_vector(Random *r, double p[3])
{
    for (int k = 0; k < 3; k++) p[k] = random_in(r, -3, 3);
}

static void the_gradient_is_the_derivative(void **state)
{
    Random r = {1};
    for (int n = 0; n < 1000; n++) {
        double q[10], p[3], g[3];
        random_coefficients(&r, q);
        random_vector(&r, p);
        quadric_gradient(q, p, g);
        for (int k = 0; k < 3; k++) {
            double a[3] = {p[0], p[1], p[2]}, b[3] = {p[0], p[1], p[2]};
            a[k] -= 0.5;
            b[k] += 0.5;
            assert_true(fabs(quadric_at(q, b) - quadric_at(q, a) - g[k]) < 1e-12 * 100);
        }
    }
}

static void a_map_substitutes_its_inverse(void **state)
{
    Random r = {2};
    for (int n = 0; n < 2000; n++) {
        double q[10], m[12], inverse[12], p[3], back[3], moved[10];
        random_coefficients(&r, q);
        for (int k = 0; k < 12; k++) m[k] = random_in(&r, -2, 2);
        random_vector(&r, p);
        if (!matrix_inverse(m, inverse)) continue;
        assert_true(quadric_transform(q, inverse, moved));
        matrix_point(inverse, p, back);
        double expected = quadric_at(q, back), size = 0;
        for (int k = 0; k < 10; k++) size = fmax(size, fabs(moved[k]));
        assert_true(fabs(quadric_at(moved, p) - expected) <= 1e-11 * fmax(1, fmax(size * 10, fabs(expected))));
    }
}

static void a_map_that_overflows_is_refused(void **state)
{
    double q[10] = {-1, -1, -1, 0, 0, 0, 0, 0, 0, 1};
    const double huge[12] = {1e200, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    assert_false(quadric_transform(q, huge, q));
    assert_true(q[0] == -1);
}

static void it_is_the_same_in_its_axes(void **state)
{
    Random r = {3};
    for (int n = 0; n < 2000; n++) {
        double q[10], p[3], f;
        QuadricAxes axes;
        random_coefficients(&r, q);
        random_vector(&r, p);
        quadric_axes(q, &axes);
        f = axes.constant;
        for (int k = 0; k < 3; k++) {
            double u = 0;
            for (int i = 0; i < 3; i++) u += axes.axis[k][i] * p[i];
            f += axes.square[k] * u * u + axes.linear[k] * u;
            assert_true(!k || axes.square[k - 1] <= axes.square[k]);
        }
        assert_true(fabs(f - quadric_at(q, p)) < 1e-10);
    }
}

static void the_peak_is_where_it_is(void **state)
{
    assert_true(quadric_peak((const double[10]){-1, -1, -1, 0, 0, 0, 0, 0, 0, 1}) == 1);
    assert_true(quadric_peak((const double[10]){-1, -2, -4, 0, 0, 0, 2, 0, 0, 0}) == 1); // at x = 1
    assert_true(quadric_peak((const double[10]){-1, 0, 0, 0, 0, 0, 0, 0, 0, -3}) == -3); // a slab without an inside
    assert_true(isinf(quadric_peak((const double[10]){-1, -1, 1, 0, 0, 0, 0, 0, 0, -1})));
    assert_true(isinf(quadric_peak((const double[10]){0, 0, 0, 0, 0, 0, 1, 0, 0, 0}))); // a half-space
    assert_true(quadric_peak((const double[10]){[9] = 5}) == 5);
    Random r = {4};
    for (int n = 0; n < 500; n++) { // no point is above it, and moving does not change it
        double q[10] = {-1, -0.7, -1.3, 0, 0, 0, 0.3, 0.5, -0.2, 0.4}, m[12], inverse[12], moved[10], p[3];
        double peak = quadric_peak(q);
        for (int k = 0; k < 12; k++) m[k] = random_in(&r, -2, 2);
        if (!matrix_inverse(m, inverse) || !quadric_transform(q, inverse, moved)) continue;
        double size = 0;
        for (int k = 0; k < 10; k++) size = fmax(size, fabs(moved[k]));
        if (size > 1e3) continue;
        assert_true(fabs(quadric_peak(moved) - peak) < 1e-7);
        random_vector(&r, p);
        assert_true(quadric_at(moved, p) <= peak + 1e-9 * size * 10);
    }
}

static void sums_are_judged_with_care(void **state)
{
    const double ball[10] = {-1, -1, -1, 0, 0, 0, 0, 0, 0, 1};
    const double far[10] = {-9, -9, -9, 0, 0, 0, 90, 0, 0, -224};  // a small ball at x = 5
    const double near[10] = {-9, -9, -9, 0, 0, 0, 18, 0, 0, -8.5}; // one at x = 1
    bool found = false;
    for (double w = 1e-3; w < 1e3; w *= 2) {
        found |= quadric_sum_not_positive(ball, w, far);
        assert_false(quadric_sum_not_positive(ball, w, near));
    }
    assert_true(found);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_gradient_is_the_derivative),  cmocka_unit_test(a_map_substitutes_its_inverse),
        cmocka_unit_test(a_map_that_overflows_is_refused), cmocka_unit_test(it_is_the_same_in_its_axes),
        cmocka_unit_test(the_peak_is_where_it_is),         cmocka_unit_test(sums_are_judged_with_care),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
