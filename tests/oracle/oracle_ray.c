// Where a ray meets the scene, exactly.
//
// On a ray each quadric is a parabola and each leaf a polynomial of degree 2 or 6 between the ends of its supports. All its roots on such a
// piece are found by isolation: between neighbouring roots of the derivative (found the same way, degree by degree) a polynomial is monotone, so
// a sign change there is exactly one root. The roots of all leaves are the only places where the sign of any leaf, and so of the whole tree,
// can change: sorted, they cut the ray into spans of constant sign, and one evaluation in the middle of a span decides it. Nothing is
// sampled, so nothing is missed; touching without crossing is no hit, as its sign does not change.
#include "tests/oracle/oracle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/oracle/internal.h"

#define SAME_PLACE 1e-11 // of the coordinates

typedef struct LiveParabola { // a perturbation that acts somewhere on the ray
    OracleParabola q;
    double strength;
} LiveParabola;

typedef struct RayLeaf {
    OracleParabola base;
    uint32_t first, count;   // of live
    const OracleLeaf *field; // with general fields among its bases; NULL: a free form
    OracleTerm terms[ORACLE_TERMS];
    int term_count;
    bool changes; // its sign, somewhere on the ray
} RayLeaf;

struct OracleScratch {
    RayLeaf *leaves;
    uint32_t leaf_capacity;
    LiveParabola *live;
    uint32_t live_count, live_capacity;
    OracleNode *nodes; // of the tree without what has one sign on the whole ray
    uint32_t node_count, node_capacity;
    double *events, *ends;
    uint32_t event_count, event_capacity, end_count, end_capacity;
};

OracleScratch *oracle_scratch_new(void)
{
    OracleScratch *scratch = calloc(1, sizeof *scratch);
    if (!scratch) abort();
    return scratch;
}

void oracle_scratch_free(OracleScratch *scratch)
{
    if (!scratch) return;
    free(scratch->leaves);
    free(scratch->live);
    free(scratch->nodes);
    free(scratch->events);
    free(scratch->ends);
    free(scratch);
}

static void *reserve(void *list, uint32_t count, uint32_t *capacity, size_t size)
{
    if (count <= *capacity) return list;
    *capacity = count * 2 + 16;
    list = realloc(list, *capacity * size);
    if (!list) abort();
    return list;
}

static void add_number(double **list, uint32_t *count, uint32_t *capacity, double value)
{
    *list = reserve(*list, *count + 1, capacity, sizeof **list);
    (*list)[(*count)++] = value;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// -- parabolas -----------------------------------------------------------------------------------------------------------------

OracleParabola oracle_parabola(const OracleQuadric *quadric, const OracleRay *ray)
{
    const double *a = quadric->a, *o = ray->origin, *d = ray->direction;
    double local_o[3], local_d[3];
    if (!quadric->map.identity) {
        const double *m = quadric->map.m;
        oracle_map_point(m, o, local_o);
        for (int i = 0; i < 3; i++) local_d[i] = m[4 * i] * d[0] + m[4 * i + 1] * d[1] + m[4 * i + 2] * d[2];
        o = local_o, d = local_d;
    }
    double g[3];
    OracleParabola q;
    q.c = oracle_quadric_field(a, o, g);
    q.b = g[0] * d[0] + g[1] * d[1] + g[2] * d[2];
    q.a = (a[0] * d[0] + a[3] * d[1] + a[4] * d[2]) * d[0] + (a[1] * d[1] + a[5] * d[2]) * d[1] + a[2] * d[2] * d[2];
    return q;
}

OracleParabola oracle_base_parabola(const Oracle *oracle, const OracleLeaf *leaf, const OracleRay *ray)
{
    OracleParabola sum = {0, 0, 0};
    for (uint32_t k = 0; k < leaf->base_count; k++) {
        const OracleBase *base = &oracle->bases[leaf->first_base + k];
        OracleParabola q = oracle_parabola(&base->quadric, ray);
        sum.a += base->weight * q.a;
        sum.b += base->weight * q.b;
        sum.c += base->weight * q.c;
    }
    return sum;
}

int oracle_parabola_roots(const OracleParabola *q, double roots[2])
{
    if (q->a == 0) {
        if (q->b == 0) return 0;
        roots[0] = -q->c / q->b;
        return isfinite(roots[0]) ? 1 : 0;
    }
    long double b = q->b, disc = b * b - 4 * (long double)q->a * q->c;
    if (!(disc > 0)) return 0;
    long double h = -(b + copysignl(sqrtl(disc), b)) / 2;
    double r0 = (double)(h / q->a), r1 = h != 0 ? (double)(q->c / h) : r0;
    if (!isfinite(r0) || fabs(r0) > 1e30) { // nearly linear: the far root is nowhere
        roots[0] = r1;
        return isfinite(r1) && fabs(r1) <= 1e30;
    }
    roots[0] = fmin(r0, r1);
    roots[1] = fmax(r0, r1);
    return roots[0] < roots[1] ? 2 : 0;
}

static double parabola_at(const OracleParabola *q, double t)
{
    return (q->a * t + q->b) * t + q->c;
}

// -- polynomials ---------------------------------------------------------------------------------------------------------------

static double horner(const double *p, int degree, double x)
{
    double f = p[degree];
    for (int k = degree - 1; k >= 0; k--) f = f * x + p[k];
    return f;
}

static double bisect(const double *p, int degree, double low, double high)
{
    bool rising = horner(p, degree, low) < 0;
    for (;;) {
        double middle = (low + high) / 2;
        if (middle <= low || middle >= high) return middle;
        if ((horner(p, degree, middle) < 0) == rising)
            low = middle;
        else
            high = middle;
        if (high - low < 1e-15) return (low + high) / 2;
    }
}

// All places in [-1, 1] where the polynomial changes its sign, ascending. Returns how many.
static int sign_changes(const double *p, int degree, double *roots)
{
    double rest = 0;
    for (int k = 1; k <= degree; k++) rest += fabs(p[k]);
    if (fabs(p[0]) > rest) return 0;
    while (degree > 0 && p[degree] == 0) degree--;
    if (degree == 0) return 0;
    double slope[6], turns[8];
    for (int k = 1; k <= degree; k++) slope[k - 1] = k * p[k];
    turns[0] = -1;
    int turn_count = 1;
    if (degree > 1) turn_count += sign_changes(slope, degree - 1, turns + 1);
    turns[turn_count++] = 1;
    int count = 0;
    for (int k = 0; k + 1 < turn_count; k++) {
        double low = horner(p, degree, turns[k]), high = horner(p, degree, turns[k + 1]);
        if ((low < 0) != (high < 0)) roots[count++] = bisect(p, degree, turns[k], turns[k + 1]);
    }
    return count;
}

// Adds strength · q³ to a polynomial of degree 6, q given by its three coefficients.
static void add_cube(double p[7], double strength, const double q[3])
{
    double square[5] = {q[0] * q[0], 2 * q[0] * q[1], 2 * q[0] * q[2] + q[1] * q[1], 2 * q[1] * q[2], q[2] * q[2]};
    for (int i = 0; i < 5; i++) {
        for (int j = 0; j < 3; j++) p[i + j] += strength * square[i] * q[j];
    }
}

// A parabola in u, where t = middle + half u.
static void recentre(const OracleParabola *q, double middle, double half, double out[3])
{
    out[0] = parabola_at(q, middle);
    out[1] = (2 * q->a * middle + q->b) * half;
    out[2] = q->a * half * half;
}

// -- one ray -------------------------------------------------------------------------------------------------------------------

static void add_event(OracleScratch *s, const OracleRay *ray, double t)
{
    if (t > ray->near && t < ray->far) add_number(&s->events, &s->event_count, &s->event_capacity, t);
}

// The sign changes of a free form's leaf on a piece on which the same perturbations act.
static void one_piece(OracleScratch *s, const OracleRay *ray, const RayLeaf *leaf, double low, double high)
{
    double middle = low + (high - low) / 2, half = (high - low) / 2, p[7] = {0}, q[3], roots[6];
    bool cubes = false;
    for (uint32_t i = 0; i < leaf->count; i++) {
        const LiveParabola *live = &s->live[leaf->first + i];
        if (parabola_at(&live->q, middle) <= 0) continue;
        recentre(&live->q, middle, half, q);
        add_cube(p, live->strength, q);
        cubes = true;
    }
    if (!cubes) { // the base alone, by its formula: a long span would lose digits when it is centred
        int count = oracle_parabola_roots(&leaf->base, roots);
        for (int i = 0; i < count; i++) {
            if (roots[i] >= low && roots[i] <= high) add_event(s, ray, roots[i]);
        }
        return;
    }
    recentre(&leaf->base, middle, half, q);
    for (int i = 0; i < 3; i++) p[i] += q[i];
    int count = sign_changes(p, 6, roots);
    for (int i = 0; i < count; i++) add_event(s, ray, middle + half * roots[i]);
}

static void piece_events(OracleScratch *s, const OracleRay *ray, const RayLeaf *leaf)
{
    s->end_count = 0;
    add_number(&s->ends, &s->end_count, &s->end_capacity, ray->near);
    add_number(&s->ends, &s->end_count, &s->end_capacity, ray->far);
    for (uint32_t k = 0; k < leaf->count; k++) {
        double roots[2];
        int count = oracle_parabola_roots(&s->live[leaf->first + k].q, roots);
        for (int i = 0; i < count; i++) {
            if (roots[i] > ray->near && roots[i] < ray->far)
                add_number(&s->ends, &s->end_count, &s->end_capacity, roots[i]);
        }
    }
    qsort(s->ends, s->end_count, sizeof *s->ends, ascending);
    for (uint32_t k = 0; k + 1 < s->end_count; k++) {
        double low = s->ends[k], high = s->ends[k + 1];
        while (high - low > 4 * fabs(low) + 1e-9 &&
               low < 1e15) { // a support may have no end: cut so that no part loses digits
            double cut = low + 2 * fabs(low) + 1e-9;
            one_piece(s, ray, leaf, low, cut);
            low = cut;
        }
        if (high < 1e16) one_piece(s, ray, leaf, low, high);
    }
}

static double added_at(const OracleScratch *s, const RayLeaf *leaf, double t)
{
    double f = 0;
    for (uint32_t k = 0; k < leaf->count; k++) {
        double q = parabola_at(&s->live[leaf->first + k].q, t);
        if (q > 0) f += s->live[leaf->first + k].strength * q * q * q;
    }
    return f;
}

static double line_at(const RayLeaf *leaf, double t)
{
    double sum = 0;
    for (int k = 0; k < leaf->term_count; k++) {
        const OracleTerm *term = &leaf->terms[k];
        double point[3];
        for (int i = 0; i < 3; i++) point[i] = term->line.origin[i] + t * term->line.direction[i];
        sum += term->weight * oracle_expression_at(term->expression, point, NULL);
    }
    return sum;
}

static double leaf_at(const OracleScratch *s, uint32_t index, double t)
{
    const RayLeaf *leaf = &s->leaves[index];
    return parabola_at(&leaf->base, t) + (leaf->field ? line_at(leaf, t) : 0) + added_at(s, leaf, t);
}

// -- general fields on a ray

typedef struct FieldSeeking {
    OracleScratch *scratch;
    const OracleRay *ray;
    const RayLeaf *leaf;
} FieldSeeking;

static double seeking_at(void *context, double t)
{
    const FieldSeeking *f = context;
    return parabola_at(&f->leaf->base, t) + line_at(f->leaf, t) + added_at(f->scratch, f->leaf, t);
}

static OracleSpan parabola_over(const OracleParabola *parabola, double low, double high)
{
    double p = parabola_at(parabola, low), q = parabola_at(parabola, high), turn = -parabola->b / (2 * parabola->a);
    double least = fmin(p, q), most = fmax(p, q);
    if (turn > low && turn < high) {
        least = fmin(least, parabola_at(parabola, turn));
        most = fmax(most, parabola_at(parabola, turn));
    }
    double margin = 1e-12 * (fabs(least) + fabs(most));
    return (OracleSpan){least - margin, most + margin, false};
}

static OracleSpan seeking_more(void *context, double low, double high)
{
    const FieldSeeking *f = context;
    OracleSpan sum = parabola_over(&f->leaf->base, low, high);
    for (uint32_t k = 0; k < f->leaf->count; k++) {
        const LiveParabola *live = &f->scratch->live[f->leaf->first + k];
        OracleSpan q = parabola_over(&live->q, low, high);
        double least = fmax(q.low, 0), most = fmax(q.high, 0);
        double a = live->strength * least * least * least, b = live->strength * most * most * most;
        double margin = 1e-12 * (fabs(a) + fabs(b));
        sum.low += fmin(a, b) - margin;
        sum.high += fmax(a, b) + margin;
    }
    return sum;
}

static void seeking_found(void *context, double t)
{
    const FieldSeeking *f = context;
    add_event(f->scratch, f->ray, t);
}

static void field_events(const Oracle *oracle, OracleScratch *s, const OracleRay *ray, const RayLeaf *leaf)
{
    FieldSeeking context = {s, ray, leaf};
    OracleSeek seek = {leaf->terms, leaf->term_count, &context, seeking_at, seeking_more, seeking_found};
    double near = ray->near, far = ray->far;
    for (uint32_t k = 0; k < leaf->field->guard_count; k++) {
        OracleParabola q = oracle_base_parabola(oracle, &oracle->leaves[leaf->field->guards[k]], ray);
        double roots[2];
        int count = oracle_parabola_roots(&q, roots);
        if (count == 0 && q.a <= 0 && q.c < 0 && (q.a < 0 || q.b == 0)) return;
        if (count != 2 || q.a >= 0) continue;
        double margin = 1e-9 * (fabs(roots[0]) + fabs(roots[1]));
        near = fmax(near, roots[0] - margin);
        far = fmin(far, roots[1] + margin);
    }
    if (near < far) oracle_expression_seek(&seek, near, far);
}

// The middle of the span that begins at event k (0: at the ray's beginning), and where the span begins.
static double span_middle(const OracleScratch *s, const OracleRay *ray, uint32_t k, double *begin, double *length)
{
    *begin = k == 0 ? ray->near : s->events[k - 1];
    double end = k < s->event_count ? s->events[k] : ray->far;
    if (end > *begin + 1e15) end = *begin + fmax(1, fabs(*begin)); // an endless span has one sign everywhere
    *length = end - *begin;
    return *begin + *length / 2;
}

// What a subtree is on the whole ray.
typedef enum Constancy { ALWAYS_OUTSIDE, ALWAYS_INSIDE, CHANGES } Constancy;

// Copies what changes its sign on the ray; `t` is a place on it. Of thousands of leaves a ray meets a few.
static Constancy prune(const Oracle *oracle, uint32_t at, double t)
{
    OracleScratch *s = oracle->scratch;
    const OracleNode *node = &oracle->nodes[at];
    Constancy c;
    if (node->kind == ORACLE_EMPTY) return ALWAYS_OUTSIDE;
    if (node->kind == ORACLE_LEAF && !s->leaves[node->leaf].changes)
        return leaf_at(s, node->leaf, t) >= 0 ? ALWAYS_INSIDE : ALWAYS_OUTSIDE;
    uint32_t place = s->node_count;
    s->nodes = reserve(s->nodes, place + 1, &s->node_capacity, sizeof *s->nodes);
    s->nodes[s->node_count++] = *node;
    if (node->kind == ORACLE_LEAF) {
        c = CHANGES;
    } else if (node->kind == ORACLE_NOT) {
        c = prune(oracle, at + 1, t);
        if (c != CHANGES) c = c == ALWAYS_INSIDE ? ALWAYS_OUTSIDE : ALWAYS_INSIDE;
    } else {
        Constancy strong = node->kind == ORACLE_UNION ? ALWAYS_INSIDE : ALWAYS_OUTSIDE;
        c = node->kind == ORACLE_UNION ? ALWAYS_OUTSIDE : ALWAYS_INSIDE;
        for (uint32_t k = at + 1; k < node->after && c != strong; k = oracle->nodes[k].after) {
            Constancy child = prune(oracle, k, t);
            if (child == strong || child == CHANGES) c = child;
        }
    }
    if (c == CHANGES)
        s->nodes[place].after = s->node_count;
    else
        s->node_count = place;
    return c;
}

// The general fields among the bases of a leaf, with the ray in their coordinates.
static void make_terms(const Oracle *oracle, const OracleRay *ray, RayLeaf *leaf)
{
    for (uint32_t i = 0; i < leaf->field->base_count; i++) {
        const OracleBase *base = &oracle->bases[leaf->field->first_base + i];
        if (!base->field || leaf->term_count == ORACLE_TERMS) continue;
        OracleTerm *term = &leaf->terms[leaf->term_count++];
        *term = (OracleTerm){.expression = base->field, .weight = base->weight};
        oracle_map_point(base->quadric.map.m, ray->origin, term->line.origin);
        for (int k = 0; k < 3; k++) {
            const double *row = base->quadric.map.m + 4 * k, *d = ray->direction;
            term->line.direction[k] = row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
        }
    }
}

// Fills the ray's leaves, the sorted places where any of them changes its sign, and the tree of those that do.
static Constancy cast(const Oracle *oracle, const OracleRay *ray)
{
    OracleScratch *s = oracle->scratch;
    s->live_count = s->event_count = 0;
    s->leaves = reserve(s->leaves, oracle->leaf_count, &s->leaf_capacity, sizeof *s->leaves);
    for (uint32_t i = 0; i < oracle->leaf_count; i++) {
        const OracleLeaf *leaf = &oracle->leaves[i];
        RayLeaf *out = &s->leaves[i];
        uint32_t before = s->event_count;
        *out = (RayLeaf){.base = oracle_base_parabola(oracle, leaf, ray), .first = s->live_count};
        for (uint32_t k = 0; k < leaf->count; k++) {
            const OraclePerturbation *p = &oracle->perturbations[leaf->first + k];
            OracleParabola q = oracle_parabola(&p->quadric, ray);
            double roots[2];
            int count = oracle_parabola_roots(&q, roots);
            if (count == 0 && q.a + q.b + q.c <= 0 && q.c <= 0)
                continue; // without a root its sign is the same everywhere
            if (count == 2 && q.a < 0 && (roots[1] <= ray->near || roots[0] >= ray->far)) continue;
            s->live = reserve(s->live, s->live_count + 1, &s->live_capacity, sizeof *s->live);
            s->live[s->live_count++] = (LiveParabola){q, p->strength};
            out->count++;
        }
        if (leaf->field_count) {
            out->field = leaf;
            make_terms(oracle, ray, out);
            field_events(oracle, s, ray, out);
        } else if (out->count) {
            piece_events(s, ray, out);
        } else {
            double roots[2];
            int count = oracle_parabola_roots(&out->base, roots);
            for (int k = 0; k < count; k++) add_event(s, ray, roots[k]);
        }
        out->changes = s->event_count > before;
    }
    if (s->event_count) qsort(s->events, s->event_count, sizeof *s->events, ascending);
    double begin, length;
    s->node_count = 0;
    return prune(oracle, 0, span_middle(s, ray, 0, &begin, &length));
}

// Is F >= 0 at t? Of the tree that is left.
static bool inside(const OracleScratch *s, uint32_t at, double t)
{
    const OracleNode *node = &s->nodes[at];
    switch (node->kind) {
    case ORACLE_LEAF: return leaf_at(s, node->leaf, t) >= 0;
    case ORACLE_NOT: return !inside(s, at + 1, t);
    default:
        for (uint32_t k = at + 1; k < node->after; k = s->nodes[k].after) {
            if (inside(s, k, t) == (node->kind == ORACLE_UNION)) return node->kind == ORACLE_UNION;
        }
        return node->kind == ORACLE_INTERSECT;
    }
}

// -- what is there -------------------------------------------------------------------------------------------------------------

typedef struct Decision {
    double f;
    uint32_t leaf;
    int sign;
} Decision;

// The leaf that decides at a point, the first of equals. Values that differ by rounding alone are equal: faces that coincide are
// decided by the order in which the scene says them.
static Decision decide(const Oracle *oracle, uint32_t at, const double point[3], double tolerance)
{
    const OracleNode *node = &oracle->nodes[at];
    Decision best;
    switch (node->kind) {
    case ORACLE_LEAF: return (Decision){oracle_leaf_field(oracle, node->leaf, point, NULL), node->leaf, 1};
    case ORACLE_EMPTY: return (Decision){-ORACLE_INFINITY, UINT32_MAX, 1};
    case ORACLE_NOT: best = decide(oracle, at + 1, point, tolerance); return (Decision){-best.f, best.leaf, -best.sign};
    default:
        best = decide(oracle, at + 1, point, tolerance);
        for (uint32_t k = oracle->nodes[at + 1].after; k < node->after; k = oracle->nodes[k].after) {
            Decision other = decide(oracle, k, point, tolerance);
            if (node->kind == ORACLE_UNION ? other.f > best.f + tolerance : other.f < best.f - tolerance) best = other;
        }
        return best;
    }
}

void oracle_describe(const Oracle *oracle, const OracleRay *ray, double t, bool leaving, OracleHit *hit)
{
    double g[3];
    *hit = (OracleHit){.t = t, .leaving = leaving};
    for (int i = 0; i < 3; i++) hit->point[i] = ray->origin[i] + t * ray->direction[i];
    double reach = fabs(t) + fabs(hit->point[0]) + fabs(hit->point[1]) + fabs(hit->point[2]);
    Decision decision = decide(oracle, 0, hit->point, 1e-13 * reach);
    hit->leaf = decision.leaf;
    if (decision.leaf == UINT32_MAX) return;
    oracle_leaf_field(oracle, hit->leaf, hit->point, g);
    double slope = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    for (int i = 0; i < 3; i++)
        hit->normal[i] = slope > 0 ? (leaving ? 1 : -1) * decision.sign * g[i] / slope : -ray->direction[i];
}

// -- hits ---------------------------------------------------------------------------------------------------------------------

// How many other leaves vanish where this one does.
static uint32_t count_ties(const Oracle *oracle, const OracleHit *hit)
{
    uint32_t ties = 0;
    double reach = fabs(hit->t) + fabs(hit->point[0]) + fabs(hit->point[1]) + fabs(hit->point[2]);
    for (uint32_t k = 0; k < oracle->leaf_count; k++) {
        if (k == hit->leaf) continue;
        double g[3], f = oracle_leaf_field(oracle, k, hit->point, g);
        ties += fabs(f) <= 1e-6 * reach * sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    }
    return ties;
}

// The first place where the sign changes, and whether it does so outwards.
static bool first_change(Oracle *oracle, const OracleRay *ray, double *t, bool *leaving)
{
    const OracleScratch *s = oracle->scratch;
    bool known = false;
    if (cast(oracle, ray) != CHANGES) return false;
    double away = 0;
    for (int i = 0; i < 3; i++) away = fmax(away, fabs(ray->origin[i]));
    for (uint32_t k = 0; k <= s->event_count; k++) {
        double begin, length, middle = span_middle(s, ray, k, &begin, &length);
        // Two roots in one place, as far as doubles can tell that have come through transforms: faces that coincide.
        if (length <= SAME_PLACE * fmax(away, fmax(fabs(begin), fabs(begin + length)))) continue;
        bool now = inside(s, 0, middle);
        *t = begin;
        if (known && now != *leaving) return true;
        *leaving = now;
        known = true;
    }
    return false;
}

bool oracle_hit(Oracle *oracle, const OracleRay *ray, OracleHit *hit)
{
    double t;
    bool leaving;
    if (!first_change(oracle, ray, &t, &leaving)) return false;
    oracle_describe(oracle, ray, t, leaving, hit);
    hit->ties = count_ties(oracle, hit);
    return true;
}

bool oracle_blocked(Oracle *oracle, const OracleRay *ray)
{
    double t;
    bool leaving;
    return first_change(oracle, ray, &t, &leaving);
}
