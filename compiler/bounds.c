// Directions are the six along the axes. For each, what is wanted is the support h(e), the largest e · X of the set;
// the box is made of them. Planes are half-spaces n · X <= b with |n| = 1; a slab is two of them.
#include "compiler/bounds.h"

#include <math.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/quadric.h"
#include "compiler/tape.h"

static const double straight = 1e-12; // relative to the largest of its kind, below it a number is rounding's

static Bounds everything(void)
{
    return (Bounds){{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
}

static Bounds nothing(void)
{
    return (Bounds){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

bool bounds_empty(const Bounds *b)
{
    return b->low[0] > b->high[0] || b->low[1] > b->high[1] || b->low[2] > b->high[2];
}

bool bounds_finite(const Bounds *b)
{
    for (int k = 0; k < 3; k++) {
        if (!isfinite(b->low[k]) || !isfinite(b->high[k])) return false;
    }
    return !bounds_empty(b);
}

bool bounds_meet(const Bounds *a, const Bounds *b)
{
    for (int k = 0; k < 3; k++) {
        if (a->low[k] > b->high[k] || b->low[k] > a->high[k]) return false;
    }
    return true;
}

static void hull(Bounds *a, const Bounds *b)
{
    if (bounds_empty(b)) return;
    for (int k = 0; k < 3; k++) {
        a->low[k] = fmin(a->low[k], b->low[k]);
        a->high[k] = fmax(a->high[k], b->high[k]);
    }
}

static void meet(Bounds *a, const Bounds *b)
{
    for (int k = 0; k < 3; k++) {
        a->low[k] = fmax(a->low[k], b->low[k]);
        a->high[k] = fmin(a->high[k], b->high[k]);
    }
    if (bounds_empty(a)) *a = nothing();
}

// Outwards, by more than rounding can have moved it inwards.
static double up(double value, double size)
{
    return value + 1e-9 * (fabs(value) + size);
}

static void set_side(Bounds *b, int axis, double sign, double support, double size)
{
    if (sign > 0) {
        b->high[axis] = fmin(b->high[axis], up(support, size));
    } else {
        b->low[axis] = fmax(b->low[axis], -up(support, size));
    }
}

// --- quadrics

// An ellipsoid: negative definite, and not so flat that rounding decides. With A its quadratic part and c its centre,
// F = F(c) + (X - c) A (X - c), and the half extents are sqrt(F(c) (-A^-1)_kk).
static bool ellipsoid(const double q[10], Bounds *b)
{
    double a = q[0], d = q[1], f = q[2], bb = q[3] / 2, c = q[4] / 2, e = q[5] / 2;
    if (!(a < 0 && d < 0 && f < 0)) return false;
    double minor = a * d - bb * bb;
    double i00 = d * f - e * e, i11 = a * f - c * c, i22 = minor;
    double i01 = c * e - bb * f, i02 = bb * e - c * d, i12 = bb * c - a * e;
    double det = a * i00 + bb * i01 + c * i02;
    if (!(minor > 1e-10 * a * d) || !(det < 1e-10 * a * d * f)) return false;
    double centre[3] = {-(i00 * q[6] + i01 * q[7] + i02 * q[8]) / (2 * det),
                        -(i01 * q[6] + i11 * q[7] + i12 * q[8]) / (2 * det),
                        -(i02 * q[6] + i12 * q[7] + i22 * q[8]) / (2 * det)};
    double peak = quadric_at(q, centre), inverse[3] = {i00 / det, i11 / det, i22 / det};
    double noise = 1e-13 * (fabs(q[9]) + fabs(q[6] * centre[0]) + fabs(q[7] * centre[1]) + fabs(q[8] * centre[2]));
    if (!isfinite(peak)) return false;
    *b = nothing();
    if (peak < -noise) return true;
    for (int k = 0; k < 3; k++) {
        double extent = sqrt((fmax(peak, 0) + noise) * -inverse[k]);
        b->low[k] = -up(extent - centre[k], extent);
        b->high[k] = up(centre[k] + extent, extent);
    }
    return true;
}

typedef struct Plane { // n · X <= b
    double n[3], b;
} Plane;

// A slab: A = -m mT and the linear part along m, so F = peak - (m · X - s)^2. Gives its two planes; where peak < 0
// there is nothing between them.
static bool slab(const double q[10], Plane planes[2], double *peak)
{
    double a[3][3] = {{q[0], q[3] / 2, q[4] / 2}, {q[3] / 2, q[1], q[5] / 2}, {q[4] / 2, q[5] / 2, q[2]}};
    int big = 0;
    for (int k = 1; k < 3; k++) {
        if (fabs(a[k][k]) > fabs(a[big][big])) big = k;
    }
    double size = -a[big][big];
    if (!(size > 0)) return false;
    double m[3], root = sqrt(size), along = 0, across = 0, length = 0;
    for (int k = 0; k < 3; k++) {
        m[k] = -a[big][k] / root;
        length += m[k] * m[k];
        along += m[k] * q[6 + k];
    }
    for (int i = 0; i < 3; i++) {
        for (int j = i; j < 3; j++) {
            if (fabs(a[i][j] + m[i] * m[j]) > straight * size) return false;
        }
        across = fmax(across, fabs(q[6 + i] - along / length * m[i]));
    }
    if (across > straight * fmax(fabs(along) / sqrt(length), size)) return false;
    double s = along / length / 2; // -(mX)^2 + 2 s mX + A44
    double noise = 1e-12 * (fabs(q[9]) + s * s);
    *peak = q[9] + s * s + noise;
    length = sqrt(length);
    double half = sqrt(fmax(*peak, 0));
    for (int k = 0; k < 3; k++) {
        planes[0].n[k] = m[k] / length;
        planes[1].n[k] = -m[k] / length;
    }
    planes[0].b = (s + half) / length;
    planes[1].b = (half - s) / length;
    return true;
}

// A plane across an axis.
static void cut_by_plane(Bounds *box, const Plane *plane)
{
    for (int k = 0; k < 3; k++) {
        if (fabs(plane->n[(k + 1) % 3]) > straight || fabs(plane->n[(k + 2) % 3]) > straight) continue;
        set_side(box, k, plane->n[k], plane->b, fabs(plane->b));
    }
}

static bool half_space(const double q[10], Plane *plane)
{
    double length = hypot(hypot(q[6], q[7]), q[8]);
    for (int k = 0; k < 6; k++) {
        if (q[k] != 0) return false;
    }
    if (!(length > 0)) return false;
    for (int k = 0; k < 3; k++) plane->n[k] = -q[6 + k] / length;
    plane->b = q[9] / length;
    return true;
}

// A quadric without a positive square: an elliptic cylinder or paraboloid, F = peak + beta v - sum of |square| (u -
// centre)^2, where v is the direction of the linear part that has no square.
typedef struct Bowl {
    double square[3], centre[3]; // square > 0 in its axes; 0 where there is none
    const double (*axis)[3];
    double v[3], beta, peak;
} Bowl;

static bool bowl(const QuadricAxes *axes, Bowl *bowl)
{
    *bowl = (Bowl){.axis = axes->axis, .peak = axes->constant};
    for (int k = 0; k < 3; k++) {
        if (axes->square[k] > 0) return false;
        if (axes->square[k] < 0) {
            bowl->square[k] = -axes->square[k];
            bowl->centre[k] = axes->linear[k] / (2 * bowl->square[k]);
            bowl->peak += bowl->square[k] * bowl->centre[k] * bowl->centre[k];
        } else {
            for (int i = 0; i < 3; i++) bowl->v[i] += axes->linear[k] * axes->axis[k][i];
        }
    }
    bowl->beta = hypot(hypot(bowl->v[0], bowl->v[1]), bowl->v[2]);
    for (int i = 0; i < 3 && bowl->beta > 0; i++) bowl->v[i] /= bowl->beta;
    return true;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The support of a bowl in direction e. The part of e that is neither across the axes with squares nor along v goes to
// `rest`: there the bowl has no end.
static double bowl_support(const Bowl *b, const double e[3], double rest[3])
{
    double linear = 0, square = 0, down = -dot(e, b->v);
    for (int i = 0; i < 3; i++) rest[i] = e[i] + down * b->v[i];
    for (int k = 0; k < 3; k++) {
        if (b->square[k] == 0) continue;
        double along = dot(e, b->axis[k]);
        if (fabs(along) < straight) along = 0;
        linear += along * b->centre[k];
        square += along * along / b->square[k];
        for (int i = 0; i < 3; i++) rest[i] -= along * b->axis[k][i];
    }
    for (int i = 0; i < 3; i++) {
        if (fabs(rest[i]) < straight) rest[i] = 0;
    }
    if (b->beta == 0) return linear + sqrt(fmax(b->peak, 0) * square);
    if (down < straight) return down > -straight && square == 0 ? linear : INFINITY;
    return linear + square * b->beta / (4 * down) + down * b->peak / b->beta;
}

static Bounds bounds_of_bowl(const double q[10])
{
    Bounds box = everything();
    QuadricAxes axes;
    Bowl b;
    quadric_axes(q, &axes);
    if (!bowl(&axes, &b)) return box;
    if (b.beta == 0 && b.peak < -1e-12 * (fabs(q[9]) + fabs(b.peak - q[9]))) return nothing();
    for (int axis = 0; axis < 3; axis++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            double e[3] = {0}, rest[3];
            e[axis] = sign;
            double support = bowl_support(&b, e, rest);
            if (rest[0] == 0 && rest[1] == 0 && rest[2] == 0) set_side(&box, axis, sign, support, fabs(support));
        }
    }
    return box;
}

Bounds bounds_of_quadric(const double q[10])
{
    Bounds box = everything();
    bool constant = true;
    if (q[0] > 0 || q[1] > 0 || q[2] > 0) return box; // grows along that axis
    if (ellipsoid(q, &box)) return box;
    for (int k = 0; k < 9; k++) constant &= q[k] == 0;
    if (constant) return q[9] >= 0 ? box : nothing();
    Plane planes[2];
    double peak;
    if (slab(q, planes, &peak)) { // often, so not by way of eigenvectors
        if (peak < 0) return nothing();
        cut_by_plane(&box, &planes[0]);
        cut_by_plane(&box, &planes[1]);
        return box;
    }
    return bounds_of_bowl(q);
}

// --- intersections

enum { PARTS_MAX = 64, PLANES_MAX = 2 * PARTS_MAX + 6 };

typedef struct Meeting { // what meets
    const double *quadrics[PARTS_MAX];
    uint32_t count;
    Plane planes[PLANES_MAX];
    uint32_t plane_count;
    const PlanLeaf *fields[PARTS_MAX]; // which are asked for what they have within the others
    uint32_t field_count;
} Meeting;

static void add_plane(Meeting *m, Plane plane)
{
    if (m->plane_count < PLANES_MAX && isfinite(plane.b)) m->planes[m->plane_count++] = plane;
}

static void find_planes(Meeting *m, const Bounds *box)
{
    for (uint32_t k = 0; k < m->count; k++) {
        Plane planes[2];
        double peak;
        if (half_space(m->quadrics[k], &planes[0])) {
            add_plane(m, planes[0]);
        } else if (slab(m->quadrics[k], planes, &peak)) {
            add_plane(m, planes[0]);
            add_plane(m, planes[1]);
        }
    }
    for (int k = 0; k < 3; k++) { // and the sides that are known already
        Plane high = {.b = box->high[k]}, low = {.b = -box->low[k]};
        high.n[k] = 1;
        low.n[k] = -1;
        add_plane(m, high);
        add_plane(m, low);
    }
}

// Planes bound e · X where e is a sum of their normals with weights >= 0: it is at most that sum of their b. The least such sum is found by the simplex
// method on three rows, one for each coordinate: three normals are the basis at a time, at first unit vectors that no plane has.
typedef struct Basis {
    int plane[3];         // of the planes; NO_PLANE: a unit vector
    double weight[3];     // >= 0
    double inverse[3][3]; // a vector's coordinates in the basis
} Basis;

enum { NO_PLANE = -1, STEPS_MAX = 300, STEPS_GREEDY = 60 };

static Basis unit_basis(const double e[3])
{
    Basis basis = {.plane = {NO_PLANE, NO_PLANE, NO_PLANE}};
    for (int k = 0; k < 3; k++) {
        basis.weight[k] = fabs(e[k]);
        basis.inverse[k][k] = e[k] < 0 ? -1 : 1;
    }
    return basis;
}

// What a plane costs: in the first phase only unit vectors do.
static double plane_cost(const Meeting *m, int plane, bool first)
{
    if (plane == NO_PLANE) return first ? 1 : 0;
    return first ? 0 : m->planes[plane].b;
}

// The plane that lowers the cost most for its weight; after many steps the first that lowers it, so that none comes again and again.
static int entering_plane(const Meeting *m, const Basis *basis, bool first, bool greedy)
{
    double price[3] = {0}, best = 0, size = 0;
    int entering = NO_PLANE;
    for (int i = 0; i < 3; i++) {
        double cost = plane_cost(m, basis->plane[i], first);
        size = fmax(size, fabs(cost));
        for (int k = 0; k < 3; k++) price[k] += cost * basis->inverse[i][k];
    }
    for (uint32_t k = 0; k < m->plane_count; k++) {
        double cost = plane_cost(m, (int)k, first), change = cost - dot(price, m->planes[k].n);
        if (!(change < -1e-11 * (fabs(cost) + size)) || change >= best) continue;
        entering = (int)k;
        best = change;
        if (!greedy) break;
    }
    return entering;
}

// Puts a plane into the basis for what its weight drives to 0. Unit vectors that have no weight any more leave first. False
// where nothing hinders the weight from growing: then nothing is within all planes.
static bool exchange(const Meeting *m, Basis *basis, int entering, bool first)
{
    double part[3], least = INFINITY;
    int leaving = NO_PLANE;
    for (int i = 0; i < 3; i++) {
        part[i] = dot(basis->inverse[i], m->planes[entering].n);
        bool spent = !first && basis->plane[i] == NO_PLANE && fabs(part[i]) > 1e-9;
        double ratio = spent ? 0 : part[i] > 1e-9 ? basis->weight[i] / part[i] : INFINITY;
        if (ratio >= least) continue;
        least = ratio;
        leaving = i;
    }
    if (leaving == NO_PLANE) return false;
    basis->plane[leaving] = entering;
    basis->weight[leaving] /= part[leaving];
    for (int k = 0; k < 3; k++) basis->inverse[leaving][k] /= part[leaving];
    for (int i = 0; i < 3; i++) {
        if (i == leaving) continue;
        basis->weight[i] = fmax(basis->weight[i] - part[i] * basis->weight[leaving], 0);
        for (int k = 0; k < 3; k++) basis->inverse[i][k] -= part[i] * basis->inverse[leaving][k];
    }
    return true;
}

static void minimize(const Meeting *m, Basis *basis, bool first)
{
    for (int step = 0; step < STEPS_MAX; step++) {
        int entering = entering_plane(m, basis, first, step < STEPS_GREEDY);
        if (entering == NO_PLANE || !exchange(m, basis, entering, first)) return;
    }
}

// The largest e · X within all planes; infinite where they leave it open. `size` is how large the numbers were.
static double planes_support(const Meeting *m, const double e[3], double *size)
{
    Basis basis = unit_basis(e);
    double sum = 0, rest[3] = {e[0], e[1], e[2]};
    minimize(m, &basis, true);
    minimize(m, &basis, false);
    *size = 0;
    for (int i = 0; i < 3; i++) {
        if (basis.plane[i] == NO_PLANE) continue;
        const Plane *plane = &m->planes[basis.plane[i]];
        sum += basis.weight[i] * plane->b;
        *size += fabs(basis.weight[i] * plane->b);
        for (int k = 0; k < 3; k++) rest[k] -= basis.weight[i] * plane->n[k];
    }
    // The weights are proof, however they were found, if they sum to e.
    return fmax(fmax(fabs(rest[0]), fabs(rest[1])), fabs(rest[2])) <= straight ? sum : INFINITY;
}

static void cut_by_planes(Bounds *box, const Meeting *m)
{
    for (int axis = 0; axis < 3; axis++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            double e[3] = {0}, size;
            e[axis] = sign;
            double support = planes_support(m, e, &size);
            if (support < INFINITY) set_side(box, axis, sign, support, size);
        }
    }
}

// How far the planes let go in direction e (of any length): the nearest that is across it.
static double plane_support(const Meeting *m, const double e[3])
{
    double length = sqrt(dot(e, e)), best = INFINITY;
    for (uint32_t k = 0; k < m->plane_count; k++) {
        const Plane *plane = &m->planes[k];
        double off = 0;
        for (int i = 0; i < 3; i++) off = fmax(off, fabs(e[i] / length - plane->n[i]));
        if (off < straight) best = fmin(best, length * plane->b);
    }
    return best;
}

// A cylinder between planes across its axis: e is taken apart into what is across the axis, which the cylinder bounds,
// and the rest.
static void cut_by_cylinder(Bounds *box, const Meeting *m, const double q[10])
{
    QuadricAxes axes;
    Bowl b;
    if (q[0] > 0 || q[1] > 0 || q[2] > 0) return;
    quadric_axes(q, &axes);
    if (!bowl(&axes, &b) || b.beta > 0) return;
    for (int axis = 0; axis < 3; axis++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            double e[3] = {0}, rest[3];
            e[axis] = sign;
            double across = bowl_support(&b, e, rest);
            double along = rest[0] != 0 || rest[1] != 0 || rest[2] != 0 ? plane_support(m, rest) : 0;
            set_side(box, axis, sign, across + along, fabs(across) + fabs(along));
        }
    }
}

static double form_size(const double q[10])
{
    double size = 0;
    for (int k = 0; k < 6; k++) size = fmax(size, fabs(q[k]));
    return size;
}

// Sums f + w g with w from a thousandth to a thousand, f and g of equal size.
static void cut_by_sums(Bounds *box, const double f[10], const double g[10])
{
    double ratio = form_size(f) / form_size(g);
    if (!(ratio > 0) || !isfinite(ratio)) return;
    for (int step = -10; step <= 10; step++) {
        double sum[10], w = ldexp(ratio, step);
        for (int k = 0; k < 10; k++) sum[k] = f[k] + w * g[k];
        Bounds other;
        if (ellipsoid(sum, &other)) meet(box, &other);
    }
}

// The quadrics that meet in a box which is known already: a better one.
static void cut_by_quadrics(Bounds *box, Meeting *m)
{
    if (bounds_empty(box) || bounds_finite(box) || m->count < 2) return;
    find_planes(m, box);
    cut_by_planes(box, m);
    for (uint32_t k = 0; k < m->count && !bounds_finite(box); k++) cut_by_cylinder(box, m, m->quadrics[k]);
    for (uint32_t i = 0; i < m->count && i < 8; i++) {
        for (uint32_t j = i + 1; j < m->count && j < 8 && !bounds_finite(box); j++) {
            cut_by_sums(box, m->quadrics[i], m->quadrics[j]);
        }
    }
    if (bounds_empty(box)) *box = nothing();
}

void bounds_cut(Bounds *box, const double *const *quadrics, uint32_t count)
{
    Meeting m;
    m.count = m.plane_count = 0;
    for (uint32_t k = 0; k < count && m.count < PARTS_MAX; k++) m.quadrics[m.count++] = quadrics[k];
    cut_by_quadrics(box, &m);
}

// --- plans

typedef struct Scene {
    const Plan *plan;
    const double *values;
    uint32_t begin, count; // the perturbations last looked at, which leaves of a deformed object share,
    Bounds added;          // and where they add
    bool negative;         // (of minus the perturbations)
} Scene;

static Bounds group_bounds(Scene *s, uint32_t index);

// Where some of the perturbations are positive.
static const Bounds *added_by(Scene *s, uint32_t begin, uint32_t count, bool negative)
{
    if (s->begin == begin && s->count == count && s->negative == negative) return &s->added;
    s->begin = begin;
    s->count = count;
    s->negative = negative;
    s->added = nothing();
    for (uint32_t k = begin; k < begin + count; k++) {
        const PlanPerturbation *p = &s->plan->perturbations[k];
        double strength = s->values[p->strength];
        if (!(negative ? strength < 0 : strength > 0)) continue; // takes away
        Bounds support = bounds_of_quadric(s->values + p->quadric);
        hull(&s->added, &support);
    }
    return &s->added;
}

// The box around a box of a frame's coordinates, whose sides may be infinite, seen in the world.
static Bounds framed(const double frame[12], const double low[3], const double high[3])
{
    Bounds box;
    for (int i = 0; i < 3; i++) {
        double least = frame[4 * i + 3], most = least;
        for (int k = 0; k < 3; k++) {
            double m = frame[4 * i + k];
            if (m == 0) continue;
            least += m > 0 ? m * low[k] : m * high[k];
            most += m > 0 ? m * high[k] : m * low[k];
        }
        box.low[i] = -up(-least, 0);
        box.high[i] = up(most, 0);
    }
    return box;
}

// Of what of a general field is within a box of the world.
static Bounds field_bounds(const Scene *s, const PlanLeaf *leaf, const Bounds *within)
{
    const double *inverse = s->values + leaf->quadric;
    double m[12];
    if (!matrix_inverse(inverse, m)) return everything();
    Bounds local = framed(inverse, within->low, within->high);
    tape_bounds_within(s->plan, &s->plan->tapes[leaf->begin], s->values, local.low, local.high);
    return bounds_empty(&local) ? nothing() : framed(m, local.low, local.high);
}

// Where patches lift a free form whose box without them is `box`.
static void lifted(Scene *s, const PlanLeaf *leaf, Bounds *box)
{
    for (uint32_t k = leaf->lifts; k < leaf->lifts + leaf->lift_count; k++) {
        const PlanLift *lift = &s->plan->lifts[k];
        const double *patch = s->values + s->plan->patches[lift->patch].box;
        double low = s->values[lift->low], high = s->values[lift->high];
        bool automatic = high < low; // what lies beside the footprint is cut off by others
        if (automatic) {
            low = fmin(fmin(low, 0), patch[2]);
            high = fmax(0, patch[5]);
        }
        Bounds whole = framed(s->values + lift->frame, (const double[3]){0, 0, low}, (const double[3]){1, 1, high});
        if (automatic)
            *box = whole;
        else
            hull(box, &whole);
    }
}

// What is where the perturbations of a cluster add is found once for all of its copies that stand side by side.
static void copied(Scene *s, const PlanLeaf *leaf, Bounds *box)
{
    for (uint32_t k = leaf->copies; k < leaf->copies + leaf->copy_count; k++) {
        const PlanCopy *copy = &s->plan->copies[k];
        const PlanCluster *cluster = &s->plan->clusters[copy->cluster];
        double strength = s->values[copy->strength];
        if (strength == 0) continue;
        const Bounds *own = added_by(s, cluster->begin, cluster->count, strength < 0);
        if (bounds_empty(own)) continue;
        Bounds moved = framed(s->values + copy->matrix, own->low, own->high);
        hull(box, &moved);
    }
}

static Bounds thick_bounds(Scene *s, const PlanLeaf *leaf)
{
    const double *patch = s->values + s->plan->patches[leaf->begin].box;
    double reach = s->values[leaf->thickness] / 2, low[3], high[3];
    if (!(s->values[leaf->side] > 0)) return everything();
    if (!(reach > 0)) return nothing();
    for (int k = 0; k < 3; k++) {
        low[k] = patch[k] - reach;
        high[k] = patch[3 + k] + reach;
    }
    return framed(s->values + leaf->quadric, low, high);
}

static Bounds leaf_bounds(Scene *s, const PlanLeaf *leaf)
{
    if (leaf->kind == LEAF_GROUP) return group_bounds(s, leaf->begin);
    if (leaf->shown != NO_SLOT && s->values[leaf->shown] == 0) return nothing();
    if (leaf->kind == LEAF_FIELD) {
        Bounds whole = everything();
        return field_bounds(s, leaf, &whole);
    }
    if (leaf->kind == LEAF_SHEET) {
        const double *patch = s->values + s->plan->patches[leaf->begin].box;
        return framed(s->values + leaf->quadric, patch, patch + 3);
    }
    if (leaf->kind == LEAF_THICK) return thick_bounds(s, leaf);
    Bounds box = bounds_of_quadric(s->values + leaf->quadric);
    if (leaf->kind != LEAF_FREEFORM) return box;
    hull(&box, added_by(s, leaf->begin, leaf->count, false));
    copied(s, leaf, &box);
    lifted(s, leaf, &box);
    return box;
}

static void add_quadric(Scene *s, Meeting *m, const PlanLeaf *leaf)
{
    bool shown = leaf->shown == NO_SLOT || s->values[leaf->shown] != 0;
    if (leaf->kind == LEAF_QUADRIC && shown && m->count < PARTS_MAX)
        m->quadrics[m->count++] = s->values + leaf->quadric;
}

// What other parts of an intersection leave of a field may have an end where the field alone has none. True where the field
// waits for that.
static bool add_field(const Scene *s, Meeting *m, const PlanLeaf *leaf)
{
    bool shown = leaf->shown == NO_SLOT || s->values[leaf->shown] != 0;
    if (leaf->kind != LEAF_FIELD || !shown || m->field_count == PARTS_MAX) return false;
    m->fields[m->field_count++] = leaf;
    return true;
}

static void cut_by_fields(const Scene *s, Bounds *box, const Meeting *m)
{
    for (uint32_t k = 0; k < m->field_count && !bounds_empty(box); k++) {
        Bounds part = field_bounds(s, m->fields[k], box);
        meet(box, &part);
    }
}

// A set while its parts come one by one.
typedef struct Set {
    Meeting m;
    Bounds box;
    bool united;
} Set;

static void set_begin(Set *set, bool united)
{
    set->m.count = set->m.plane_count = set->m.field_count = 0;
    set->box = united ? nothing() : everything();
    set->united = united;
}

// A part of the kind of a shape's node, to be met with the others where it is a leaf that can be. True where that is all of it: a field that waits for
// what others leave of it.
static bool set_leaf(Scene *s, Set *set, unsigned kind, uint32_t leaf)
{
    if (set->united) return false;
    if (kind == SHAPE_QUADRIC) add_quadric(s, &set->m, &s->plan->leaves[leaf]);
    return kind == SHAPE_FIELD && add_field(s, &set->m, &s->plan->leaves[leaf]);
}

static void set_part(Set *set, Bounds part)
{
    if (set->united)
        hull(&set->box, &part);
    else
        meet(&set->box, &part);
}

static Bounds set_end(Scene *s, Set *set)
{
    if (!set->united) {
        cut_by_quadrics(&set->box, &set->m);
        cut_by_fields(s, &set->box, &set->m);
    }
    return set->box;
}

static Bounds tree_bounds(Scene *s, const PlanShape *shape, uint32_t leaf_begin, uint32_t *next)
{
    const PlanShapeNode *node = &shape->nodes[(*next)++];
    if (node->kind != SHAPE_UNION && node->kind != SHAPE_INTERSECT)
        return leaf_bounds(s, &s->plan->leaves[leaf_begin + node->leaf]);
    Set set;
    set_begin(&set, node->kind == SHAPE_UNION);
    for (uint32_t k = 0; k < node->count; k++) {
        const PlanShapeNode *child = &shape->nodes[*next];
        if (set_leaf(s, &set, child->kind, leaf_begin + child->leaf))
            (*next)++;
        else
            set_part(&set, tree_bounds(s, shape, leaf_begin, next));
    }
    return set_end(s, &set);
}

static Bounds component_bounds(Scene *s, uint32_t index)
{
    const PlanComponent *component = &s->plan->components[index];
    uint32_t next = 0;
    return tree_bounds(s, &s->plan->shapes[component->shape], component->leaf_begin, &next);
}

static Bounds group_bounds(Scene *s, uint32_t index)
{
    const PlanGroup *group = &s->plan->groups[index];
    Set set;
    set_begin(&set, s->plan->group_types[group->type].set == SET_UNION);
    for (uint32_t k = group->component_begin; k < group->component_begin + group->component_count; k++) {
        const PlanComponent *component = &s->plan->components[k];
        unsigned kind = s->plan->shapes[component->shape].nodes[0].kind;
        if (!set_leaf(s, &set, kind, component->leaf_begin)) set_part(&set, component_bounds(s, k));
    }
    return set_end(s, &set);
}

Bounds bounds_of_leaf(const Plan *plan, const double *values, const PlanLeaf *leaf)
{
    return leaf_bounds(&(Scene){.plan = plan, .values = values, .added = nothing()}, leaf);
}

Bounds bounds_of_component(const Plan *plan, const double *values, uint32_t component)
{
    return component_bounds(&(Scene){.plan = plan, .values = values, .added = nothing()}, component);
}

Bounds bounds_of_plan(const Plan *plan, const double *values)
{
    return group_bounds(&(Scene){.plan = plan, .values = values, .added = nothing()}, 0);
}

// Whether a leaf of the component, or of a group in it, belongs to the object.
static bool component_has(const Plan *plan, uint32_t index, uint32_t object)
{
    const PlanComponent *component = &plan->components[index];
    for (uint32_t k = 0; k < plan->shapes[component->shape].leaf_count; k++) {
        const PlanLeaf *leaf = &plan->leaves[component->leaf_begin + k];
        if (leaf->kind != LEAF_GROUP) {
            if (leaf->object == object) return true;
            continue;
        }
        const PlanGroup *group = &plan->groups[leaf->begin];
        for (uint32_t c = 0; c < group->component_count; c++) {
            if (component_has(plan, group->component_begin + c, object)) return true;
        }
    }
    return false;
}

Bounds bounds_of_object(const Plan *plan, const double *values, uint32_t object)
{
    Bounds box = nothing();
    const PlanGroup *scene = &plan->groups[0];
    for (uint32_t k = 0; k < scene->component_count; k++) {
        if (!component_has(plan, scene->component_begin + k, object)) continue;
        Bounds other = bounds_of_component(plan, values, scene->component_begin + k);
        hull(&box, &other);
    }
    return box;
}
