// Equal surfaces are found as in a list of names: each has a key, one number in which all of its numbers are mixed, so that equal ones have keys that
// differ by rounding alone. Sorted by key, each is compared with the first ones of their kind whose keys are that near: with one, seldom with more.
#include "runtime/faces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PLANE_ROUNDING   1e-9
#define QUADRIC_ROUNDING 1e-14

#define FACE_NUMBERS 10 // of a quadric; a plane has four

typedef struct Face {
    double key, rounding;
    uint32_t leaf, plane;
} Face;

// Memory for all faces of one sort.
typedef struct FaceSearch {
    Face *faces; // two a leaf
    uint32_t count;
    uint32_t *firsts; // those that others are compared with
} FaceSearch;

bool faces_init(Faces *faces, const Plan *plan)
{
    *faces = (Faces){.plan = plan};
    size_t count = (size_t)plan->leaf_count + 1;
    faces->leaves = calloc(count, sizeof *faces->leaves);
    faces->before = calloc(count, FACE_NUMBERS * sizeof *faces->before);
    faces->search = calloc(1, sizeof *faces->search);
    if (faces->search) {
        faces->search->faces = calloc(2 * count, sizeof *faces->search->faces);
        faces->search->firsts = calloc(2 * count, sizeof *faces->search->firsts);
    }
    if (faces->leaves && faces->before && faces->search && faces->search->faces && faces->search->firsts) return true;
    faces_release(faces);
    return false;
}

void faces_release(Faces *faces)
{
    if (faces->search) {
        free(faces->search->faces);
        free(faces->search->firsts);
    }
    free(faces->search);
    free(faces->leaves);
    free(faces->before);
    *faces = (Faces){0};
}

// -- planes --------------------------------------------------------------------------------------------------------------------

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Which way a normal faces is told by its first component that is not small: one of them is at least 0.577. The limit is a number that no usual angle has.
static double facing(const double n[3])
{
    int k = 0;
    while (k < 2 && fabs(n[k]) < 0.5432) k++;
    return n[k] < 0 ? -1 : 1;
}

static FaceKind half_space(const double q[10], LeafFace *face)
{
    const double *b = q + 6;
    double length = sqrt(dot3(b, b));
    if (!(length > 0) || !isfinite(length)) return FACE_QUADRIC;
    double n[3] = {b[0] / length, b[1] / length, b[2] / length}, way = facing(n);
    face->kind = FACE_HALFSPACE;
    face->factor = way * length;
    face->planes[0] = (Plane){{way * n[0], way * n[1], way * n[2]}, -way * q[9] / length};
    return FACE_HALFSPACE;
}

// Q = s (n·X)² + b·X + c with b along n, and two roots. What is left over may bend or tilt the planes by less than the rounding.
FaceKind face_planes(const double q[10], LeafFace *face)
{
    face->kind = FACE_QUADRIC;
    double a[3][3] = {{q[0], 0.5 * q[3], 0.5 * q[4]}, {0.5 * q[3], q[1], 0.5 * q[5]}, {0.5 * q[4], 0.5 * q[5], q[2]}};
    int most = fabs(q[0]) >= fabs(q[1]) ? (fabs(q[0]) >= fabs(q[2]) ? 0 : 2) : fabs(q[1]) >= fabs(q[2]) ? 1 : 2;
    if (a[most][most] == 0) {
        bool flat = q[3] == 0 && q[4] == 0 && q[5] == 0;
        return flat ? half_space(q, face) : FACE_QUADRIC;
    }
    double length = sqrt(dot3(a[most], a[most])), way = facing(a[most]);
    double n[3] = {way * a[most][0] / length, way * a[most][1] / length, way * a[most][2] / length};
    way = facing(n); // now that they have their length
    for (int k = 0; k < 3; k++) n[k] *= way;
    double s = q[0] + q[1] + q[2], b = dot3(q + 6, n), rest = 0, tilt = 0;
    for (int i = 0; i < 3; i++) {
        tilt = fmax(tilt, fabs(q[6 + i] - b * n[i]));
        for (int k = 0; k < 3; k++) rest = fmax(rest, fabs(a[i][k] - s * n[i] * n[k]));
    }
    double square = b * b - 4 * s * q[9];
    if (!(rest <= 1e-14 * fabs(s)) || !(square > 1e-15 * (b * b + fabs(4 * s * q[9])))) return FACE_QUADRIC;
    double thick = sqrt(square) / fabs(s);
    if (!(tilt <= PLANE_ROUNDING * fabs(s) * thick + 1e-15 * fabs(b)) || !isfinite(thick)) return FACE_QUADRIC;
    double h = -0.5 * (b + copysign(sqrt(square), b)), x = h / s, y = q[9] / h;
    face->kind = FACE_SLAB;
    face->factor = s;
    face->planes[0] = (Plane){{n[0], n[1], n[2]}, fmin(x, y)};
    face->planes[1] = (Plane){{n[0], n[1], n[2]}, fmax(x, y)};
    return FACE_SLAB;
}

// -- what is equal -------------------------------------------------------------------------------------------------------------

static int by_key(const void *a, const void *b)
{
    const Face *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    return x->leaf != y->leaf ? (x->leaf < y->leaf ? -1 : 1) : (x->plane > y->plane) - (x->plane < y->plane);
}

static const double mixing[FACE_NUMBERS] = {0.8541, 0.7236, 0.9397, 0.6180, 0.7639, 0.5878, 0.9135, 0.6691, 0.8090, 1};

static void add_face(FaceSearch *search, Face face)
{
    search->faces[search->count++] = face;
}

// A length that planes of the scene have in common: normals are mixed with places, in proportion to it, so that neither
// drowns the other.
static double middle_size(const Faces *faces)
{
    double sum = 0;
    uint32_t count = 0;
    for (uint32_t k = 0; k < faces->plan->leaf_count; k++) {
        const LeafFace *face = &faces->leaves[k];
        if (face->kind != FACE_SLAB) continue;
        sum += log(fabs(face->planes[0].at) + fabs(face->planes[1].at));
        count++;
    }
    return count ? exp(sum / count) : 1;
}

static void add_planes(Faces *faces, double size)
{
    for (uint32_t k = 0; k < faces->plan->leaf_count; k++) {
        const LeafFace *face = &faces->leaves[k];
        if (face->kind == FACE_QUADRIC) continue;
        bool slab = face->kind == FACE_SLAB;
        double half = slab ? 0.5 * (face->planes[1].at - face->planes[0].at) : size;
        for (uint32_t p = 0; p < (slab ? 2u : 1u); p++) {
            const Plane *plane = &face->planes[p];
            double rounding = fmin(PLANE_ROUNDING * (fabs(plane->at) + half), 0.1 * half);
            add_face(faces->search, (Face){size * dot3(mixing, plane->normal) + plane->at, rounding, k, p});
        }
    }
}

static bool same_plane(const Plane *a, const Plane *b, double rounding)
{
    for (int k = 0; k < 3; k++)
        if (!(fabs(a->normal[k] - b->normal[k]) <= PLANE_ROUNDING)) return false;
    return fabs(a->at - b->at) <= rounding;
}

// Quadrics are compared by their coefficients divided by the one that is largest: the first of those that are nearly so, since rounding
// must not choose between two that are equal.
static double quadric_size(const double q[10])
{
    double largest = 0;
    for (int k = 0; k < 10; k++) largest = fmax(largest, fabs(q[k]));
    for (int k = 0; k < 10; k++)
        if (fabs(q[k]) > 0.8765 * largest) return q[k];
    return 0;
}

static void add_quadrics(Faces *faces)
{
    for (uint32_t k = 0; k < faces->plan->leaf_count; k++) {
        LeafFace *face = &faces->leaves[k];
        uint32_t kind = faces->plan->leaves[k].kind;
        if ((kind != LEAF_QUADRIC && kind != LEAF_FREEFORM) || face->kind != FACE_QUADRIC) continue;
        double size = quadric_size(face->quadric), key = 0;
        if (!(fabs(size) > 0) || !isfinite(size)) continue;
        for (int i = 0; i < 10; i++) key += mixing[i] * (face->quadric[i] / size);
        add_face(faces->search, (Face){key, QUADRIC_ROUNDING, k, 0});
    }
}

static bool same_quadric(const double a[10], const double b[10])
{
    double x = quadric_size(a), y = quadric_size(b);
    for (int k = 0; k < 10; k++)
        if (!(fabs(a[k] / x - b[k] / y) <= QUADRIC_ROUNDING)) return false;
    return true;
}

static bool same_face(const Faces *faces, const Face *a, const Face *b)
{
    const LeafFace *x = &faces->leaves[a->leaf], *y = &faces->leaves[b->leaf];
    if (x->kind == FACE_QUADRIC) return same_quadric(x->quadric, y->quadric);
    return same_plane(&x->planes[a->plane], &y->planes[b->plane], fmin(a->rounding, b->rounding));
}

// Gives a face the numbers of the one that is equal and was there first.
static void take_face(Faces *faces, const Face *to, const Face *from)
{
    LeafFace *face = &faces->leaves[to->leaf];
    const LeafFace *other = &faces->leaves[from->leaf];
    if (face->kind != FACE_QUADRIC) {
        face->planes[to->plane] = other->planes[from->plane];
        return;
    }
    face->factor = quadric_size(face->quadric) / quadric_size(other->quadric);
    memcpy(face->quadric, other->quadric, sizeof face->quadric);
}

// How far keys of faces may be apart that are equal.
static double key_reach(const Faces *faces, const Face *face, double size)
{
    if (faces->leaves[face->leaf].kind == FACE_QUADRIC) return FACE_NUMBERS * QUADRIC_ROUNDING;
    return face->rounding + 3 * PLANE_ROUNDING * size;
}

static void join_equal(Faces *faces, double size)
{
    FaceSearch *search = faces->search;
    if (search->count < 2) return;
    qsort(search->faces, search->count, sizeof *search->faces, by_key);
    uint32_t count = 0; // of firsts
    for (uint32_t k = 0; k < search->count; k++) {
        const Face *face = &search->faces[k];
        double reach = key_reach(faces, face, size);
        const Face *first = NULL;
        for (uint32_t i = count; i > 0 && !first; i--) {
            const Face *other = &search->faces[search->firsts[i - 1]];
            if (!(face->key - other->key <= reach)) break;
            if (same_face(faces, face, other)) first = other;
        }
        if (first)
            take_face(faces, face, first);
        else
            search->firsts[count++] = k;
    }
}

// Whether some coefficient is another than before; they are kept.
static bool take_coefficients(Faces *faces, const double *values)
{
    bool changed = !faces->known;
    for (uint32_t k = 0; k < faces->plan->leaf_count; k++) {
        const PlanLeaf *leaf = &faces->plan->leaves[k];
        if (leaf->kind != LEAF_QUADRIC && leaf->kind != LEAF_FREEFORM) continue;
        double *before = faces->before + (size_t)FACE_NUMBERS * k;
        const double *now = values + leaf->quadric;
        if (!memcmp(before, now, FACE_NUMBERS * sizeof *now)) continue;
        memcpy(before, now, FACE_NUMBERS * sizeof *now);
        changed = true;
    }
    faces->known = true;
    return changed;
}

void faces_frame(Faces *faces, const double *values)
{
    if (!take_coefficients(faces, values)) return;
    for (uint32_t k = 0; k < faces->plan->leaf_count; k++) {
        const PlanLeaf *leaf = &faces->plan->leaves[k];
        LeafFace *face = &faces->leaves[k];
        face->kind = FACE_QUADRIC;
        if (leaf->kind != LEAF_QUADRIC && leaf->kind != LEAF_FREEFORM) continue;
        if (face_planes(values + leaf->quadric, face) != FACE_QUADRIC) continue;
        face->factor = 1;
        memcpy(face->quadric, values + leaf->quadric, sizeof face->quadric);
    }
    double size = middle_size(faces);
    faces->search->count = 0;
    add_planes(faces, size);
    join_equal(faces, size);
    faces->search->count = 0;
    add_quadrics(faces);
    join_equal(faces, size);
}
