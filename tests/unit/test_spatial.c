// The order of components and perturbations in space: a permutation within runs of what belongs together, neighbours next to each other, whatever the numbers are.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdlib.h>

#include "runtime/spatial.h"

enum { SIDE = 16, BALLS = SIDE * SIDE * SIDE };

// Balls on the places of a grid, in an order that jumps about, in two groups; those of the second have perturbations.
typedef struct Scene {
    Plan plan;
    PlanShape shapes[2];
    PlanShapeNode nodes[2];
    PlanGroup groups[1];
    PlanComponent components[BALLS + 1];
    PlanLeaf leaves[BALLS + 1];
    PlanPerturbation perturbations[BALLS];
    double image[10 * (BALLS + 1)];
} Scene;

static void put_ball(double q[10], double x, double y, double z)
{
    const double ball[10] = {-1, -1, -1, 0, 0, 0, 2 * x, 2 * y, 2 * z, 0.01 - x * x - y * y - z * z};
    for (int k = 0; k < 10; k++) q[k] = ball[k];
}

static Scene *make_scene(void)
{
    Scene *s = calloc(1, sizeof *s);
    assert_non_null(s);
    s->nodes[0].kind = SHAPE_QUADRIC;
    s->nodes[1].kind = SHAPE_FREEFORM;
    for (int k = 0; k < 2; k++) s->shapes[k] = (PlanShape){&s->nodes[k], 1, 1};
    for (uint32_t k = 0; k < BALLS; k++) {
        uint32_t place = k * 2731 % BALLS;
        put_ball(s->image + 10 * k, place % SIDE, place / SIDE % SIDE, place / (SIDE * SIDE));
        s->components[k].leaf_begin = k;
        s->leaves[k].quadric = 10 * k;
        s->perturbations[k].quadric = 10 * k;
    }
    // The last component is a free form with all the balls as perturbations.
    s->components[BALLS] = (PlanComponent){1, BALLS};
    s->leaves[BALLS] = (PlanLeaf){.kind = LEAF_FREEFORM, .quadric = 10 * BALLS, .count = BALLS};
    put_ball(s->image + 10 * BALLS, 0, 0, 0);
    s->groups[0].component_count = BALLS + 1;
    s->plan = (Plan){.slot_count = 10 * (BALLS + 1),
                     .image = s->image,
                     .groups = s->groups,
                     .group_count = 1,
                     .shapes = s->shapes,
                     .shape_count = 2,
                     .components = s->components,
                     .component_count = BALLS + 1,
                     .leaves = s->leaves,
                     .leaf_count = BALLS + 1,
                     .perturbations = s->perturbations,
                     .perturbation_count = BALLS};
    return s;
}

static void assert_permutation(const uint32_t *order, uint32_t count)
{
    char *seen = calloc(count, 1);
    assert_non_null(seen);
    for (uint32_t k = 0; k < count; k++) {
        assert_true(order[k] < count);
        assert_false(seen[order[k]]);
        seen[order[k]] = 1;
    }
    free(seen);
}

// The sum of the volumes of the boxes of every sixteen in a row.
static double volume_of_blocks(const Scene *s, const uint32_t *order)
{
    double sum = 0;
    for (uint32_t k = 0; k < BALLS; k += 16) {
        double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
        for (uint32_t i = 0; i < 16; i++) {
            const double *q = s->image + s->leaves[order[k + i]].quadric;
            for (int axis = 0; axis < 3; axis++) {
                low[axis] = fmin(low[axis], q[6 + axis] / 2);
                high[axis] = fmax(high[axis], q[6 + axis] / 2);
            }
        }
        sum += (1 + high[0] - low[0]) * (1 + high[1] - low[1]) * (1 + high[2] - low[2]);
    }
    return sum;
}

static uint32_t components[BALLS + 1], perturbations[BALLS];

static void neighbours_stand_together(void **state)
{
    (void)state;
    Scene *s = make_scene();
    assert_true(spatial_order(&s->plan, components, perturbations));
    assert_permutation(components, BALLS + 1);
    assert_permutation(perturbations, BALLS);
    // Sixteen balls of a grid in boxes without gaps fill it once; a curve comes within twice that.
    assert_true(volume_of_blocks(s, components) < 2.0 * BALLS);
    assert_true(volume_of_blocks(s, perturbations) < 2.0 * BALLS);
    free(s);
}

static void shapes_stay_apart_and_few_stay_as_they_are(void **state)
{
    (void)state;
    Scene *s = make_scene();
    assert_true(spatial_order(&s->plan, components, perturbations));
    assert_int_equal(components[BALLS], BALLS); // the free form is a run of its own
    s->groups[0].component_count = SPATIAL_LEAST - 1;
    s->leaves[BALLS].count = SPATIAL_LEAST - 1;
    assert_true(spatial_order(&s->plan, components, perturbations));
    for (uint32_t k = 0; k < BALLS; k++) assert_true(components[k] == k && perturbations[k] == k);
    free(s);
}

static void numbers_without_a_place_are_ordered_too(void **state)
{
    (void)state;
    Scene *s = make_scene();
    for (uint32_t k = 0; k < BALLS; k += 3) {
        double *q = s->image + 10 * k;
        const double strange[4] = {NAN, INFINITY, -INFINITY, 0};
        for (int i = 0; i < 10; i++) q[i] = strange[(k + (uint32_t)i) % 4];
    }
    assert_true(spatial_order(&s->plan, components, perturbations));
    assert_permutation(components, BALLS + 1);
    assert_permutation(perturbations, BALLS);
    free(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(neighbours_stand_together),
        cmocka_unit_test(shapes_stay_apart_and_few_stay_as_they_are),
        cmocka_unit_test(numbers_without_a_place_are_ordered_too),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
