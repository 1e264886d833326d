// Faces that lie in each other have the same numbers, bit for bit: planes of slabs and half-spaces whichever way they face, and quadrics up to a factor,
// after transforms that have rounded each of them in its own way. What only looks alike keeps its own.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "runtime/faces.h"

enum { LEAVES = 8 };

typedef struct Scene {
    Plan plan;
    PlanLeaf leaves[LEAVES];
    double values[10 * LEAVES];
    Faces faces;
} Scene;

static void begin(Scene *s, uint32_t count)
{
    memset(s, 0, sizeof *s);
    s->plan = (Plan){.leaf_count = count, .leaves = s->leaves};
    for (uint32_t k = 0; k < count; k++) s->leaves[k] = (PlanLeaf){.kind = LEAF_QUADRIC, .quadric = 10 * k};
    assert_true(faces_init(&s->faces, &s->plan));
}

static const LeafFace *face_of(const Scene *s, uint32_t leaf)
{
    return &s->faces.leaves[leaf];
}

// slab(z: a .. b), or its complement, turned about x by an angle and moved.
static void put_slab(Scene *s, uint32_t leaf, double a, double b, double angle, double x, double z, double sign)
{
    double *q = s->values + 10 * leaf, c = cos(angle), d = sin(angle);
    // z' = d (y) + c (z - Z) with everything multiplied out, as a transform does.
    double n[3] = {0, d, c}, at = c * z + 0 * x, scale = sign / (b - a);
    double low = at + a, high = at + b;
    for (int k = 0; k < 3; k++) q[k] = -scale * n[k] * n[k];
    q[5] = -2 * scale * n[1] * n[2];
    for (int k = 0; k < 3; k++) q[6 + k] = scale * n[k] * (low + high);
    q[9] = -scale * low * high;
}

static void assert_same_plane(const Plane *a, const Plane *b)
{
    assert_memory_equal(a, b, sizeof *a);
}

static void planes_of_slabs_of_different_heights_are_one(void **state)
{
    (void)state;
    static const double angles[] = {0, 0.3, M_PI / 6, M_PI / 3, M_PI / 4, M_PI / 2, 2, 3};
    static const double places[] = {0, 0.1, 1000, -1e-3};
    for (int i = 0; i < 8; i++) {
        for (int k = 0; k < 4; k++) {
            Scene s;
            begin(&s, 4);
            double angle = angles[i], at = places[k];
            put_slab(&s, 0, -0.5, 0.5, angle, 0, at, 1);
            put_slab(&s, 1, 0, 0.5, angle, 3, at, -1);          // cut flush above
            put_slab(&s, 2, 0.5, 0.8, angle + M_PI, 0, -at, 1); // the other way up, below
            double *half = s.values + 30;                       // and a half-space on top
            half[7] = sin(angle) * 3, half[8] = cos(angle) * 3, half[9] = -3 * (cos(angle) * at + 0.5);
            faces_frame(&s.faces, s.values);
            const LeafFace *a = face_of(&s, 0), *b = face_of(&s, 1), *c = face_of(&s, 2), *d = face_of(&s, 3);
            assert_int_equal(a->kind, FACE_SLAB);
            assert_int_equal(b->kind, FACE_SLAB);
            assert_int_equal(c->kind, FACE_SLAB);
            assert_int_equal(d->kind, FACE_HALFSPACE);
            // Which of a slab's planes is the upper one depends on the way that all of them face.
            bool up = fabs(a->planes[1].at - b->planes[1].at) < 1e-6;
            const Plane *top = &a->planes[up];
            assert_same_plane(top, &b->planes[up]);
            assert_same_plane(top, &d->planes[0]);
            assert_true(a->factor < 0 && b->factor > 0);
            assert_memory_not_equal(&a->planes[!up], &b->planes[!up], sizeof *top);
            if (at == 0) assert_same_plane(&a->planes[!up], &c->planes[up]);
            faces_release(&s.faces);
        }
    }
}

static void equal_quadrics_are_one_up_to_a_factor(void **state)
{
    (void)state;
    Scene s;
    begin(&s, 4);
    const double tube[10] = {-1, -1, 0, 0, 0, 0, 2000, 4000, 0, 0.25 - 5e6};
    for (int k = 0; k < 10; k++) {
        s.values[k] = tube[k];
        s.values[10 + k] = -3 * tube[k] * (1 + 2.3e-16 * (k & 1));
        s.values[20 + k] = tube[k] / 7;
        s.values[30 + k] = tube[k];
    }
    s.values[20 + 5] = 1e-13;  // rounding of a turn
    s.values[30 + 9] += 0.001; // another radius
    faces_frame(&s.faces, s.values);
    for (uint32_t k = 0; k < 3; k++) {
        assert_int_equal(face_of(&s, k)->kind, FACE_QUADRIC);
        assert_memory_equal(face_of(&s, k)->quadric, face_of(&s, 0)->quadric, sizeof tube);
        for (int i = 0; i < 10; i++) {
            double own = s.values[10 * k + (uint32_t)i], now = face_of(&s, k)->factor * face_of(&s, k)->quadric[i];
            assert_true(fabs(now - own) <= 1e-8 * fabs(s.values[10 * k + 9]) * 1e-5);
        }
    }
    assert_memory_equal(face_of(&s, 3)->quadric, s.values + 30, sizeof tube);
    faces_release(&s.faces);
}

static void what_only_looks_like_a_slab_is_none(void **state)
{
    (void)state;
    static const double quadrics[][10] = {
        {-1, 0, 0, 0, 0, 0, 0, 1, 0, 0},     // a parabolic cylinder
        {-1, -1e-7, 0, 0, 0, 0, 0, 0, 0, 1}, // almost a slab
        {-1, 0, 0, 0, 0, 0, 0, 0, 0, -1},    // empty
        {-1, 0, 0, 0, 0, 0, 0, 0, 0, 0},     // one plane, twice
        {0, 0, 0, 1, 0, 0, 0, 0, 0, 0},      // planes that cross
        {0, 0, 0, 0, 0, 0, 0, 0, 0, 1},      // everything
        {0, 0, 0, 0, 0, 0, 0, 0, 0, 0},      //
        {NAN, 0, 0, 0, 0, 0, 0, 0, 0, 0},    //
        {-1, 0, 0, 0, 0, 0, INFINITY, 0, 0, 0},
    };
    for (size_t k = 0; k < sizeof quadrics / sizeof *quadrics; k++) {
        LeafFace face;
        assert_int_equal(face_planes(quadrics[k], &face), FACE_QUADRIC);
    }
}

static void thin_slabs_keep_both_planes(void **state)
{
    (void)state;
    Scene s;
    begin(&s, 1);
    put_slab(&s, 0, 0, 1e-3, 0.3, 0, 100, 1);
    faces_frame(&s.faces, s.values);
    const LeafFace *face = face_of(&s, 0);
    assert_int_equal(face->kind, FACE_SLAB);
    assert_true(fabs(face->planes[1].at - face->planes[0].at - 1e-3) < 1e-8);
    faces_release(&s.faces);
}

static void a_frame_that_changes_nothing_keeps_the_numbers(void **state)
{
    (void)state;
    Scene s;
    begin(&s, 2);
    put_slab(&s, 0, -0.5, 0.5, 0.3, 0, 0, 1);
    put_slab(&s, 1, 0, 0.5, 0.3, 0, 0, 1);
    faces_frame(&s.faces, s.values);
    LeafFace before[2];
    memcpy(before, s.faces.leaves, sizeof before);
    faces_frame(&s.faces, s.values);
    assert_memory_equal(before, s.faces.leaves, sizeof before);
    put_slab(&s, 1, 0, 0.6, 0.3, 0, 0, 1); // a handle has moved
    faces_frame(&s.faces, s.values);
    assert_memory_not_equal(&face_of(&s, 0)->planes[1], &face_of(&s, 1)->planes[1], sizeof(Plane));
    faces_release(&s.faces);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planes_of_slabs_of_different_heights_are_one),
        cmocka_unit_test(equal_quadrics_are_one_up_to_a_factor),
        cmocka_unit_test(what_only_looks_like_a_slab_is_none),
        cmocka_unit_test(thin_slabs_keep_both_planes),
        cmocka_unit_test(a_frame_that_changes_nothing_keeps_the_numbers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
