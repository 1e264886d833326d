// The plain reference: what a careful programmer writes in an afternoon, scalar and in double.
//
// Quadrics are folded to world coordinates once, ten numbers each. Per ray: every quadric's interval, quadrics that do not act on the ray dropped,
// the ends of all intervals sorted, samples between neighbouring ends, a bisection where the sign of F changes. Rays that miss the ball around the scene are not
// followed at all, and a perturbation whose support lies in a ball is looked at only by rays that meet the ball. Where no perturbation acts between two ends the sign is constant, so one sample is enough and the end itself is the hit. Between samples that
// stay below zero but rise and fall again the highest point is searched, so a thin crossing between two samples is found too.
#include "tests/oracle/oracle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/oracle/internal.h"

enum { EXTRA_ENDS = 24 }; // 4²⁴ times the last end is far enough

typedef struct Folded { // a quadric in world coordinates
    double a[10], strength;
} Folded;

typedef struct Ball {          // around the support of a perturbation, or a leaf
    double centre[3], radius2; // infinity where the support is not bounded
} Ball;

typedef struct Active { // a perturbation that acts on the ray
    OracleParabola q;
    const Folded *folded;
    double strength;
} Active;

struct OraclePlain { // lists of one ray, as long as the scene can need
    const Oracle *oracle;
    Folded *bases, *perturbations;
    Ball *base_balls, *balls; // by leaf, by perturbation
    OracleParabola *base;     // by leaf
    uint32_t *first, *count;  // by leaf, of active
    Active *active;
    uint32_t active_count;
    double *ends;
    int end_count;
};

static void *list(size_t count, size_t size)
{
    void *memory = calloc(count + 1, size);
    if (!memory) abort();
    return memory;
}

// F(M X) as ten coefficients: with S the symmetric 4 × 4 matrix of F, the matrix of the result is Mᵀ S M.
static void fold(const OracleQuadric *quadric, double strength, Folded *out)
{
    const double *q = quadric->a, *m = quadric->map.m;
    double s[4][4] = {{q[0], q[3] / 2, q[4] / 2, q[6] / 2},
                      {q[3] / 2, q[1], q[5] / 2, q[7] / 2},
                      {q[4] / 2, q[5] / 2, q[2], q[8] / 2},
                      {q[6] / 2, q[7] / 2, q[8] / 2, q[9]}};
    double sm[4][4], r[4][4];
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++)
            sm[i][j] = s[i][0] * m[j] + s[i][1] * m[4 + j] + s[i][2] * m[8 + j] + (j == 3 ? s[i][3] : 0);
    }
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++)
            r[i][j] = m[i] * sm[0][j] + m[4 + i] * sm[1][j] + m[8 + i] * sm[2][j] + (i == 3 ? sm[3][j] : 0);
    }
    *out = (Folded){{r[0][0], r[1][1], r[2][2], 2 * r[0][1], 2 * r[0][2], 2 * r[1][2], 2 * r[0][3], 2 * r[1][3],
                     2 * r[2][3], r[3][3]},
                    strength};
}

static void fold_base(const Oracle *oracle, const OracleLeaf *leaf, Folded *out)
{
    *out = (Folded){0};
    for (uint32_t k = 0; k < leaf->base_count; k++) {
        const OracleBase *base = &oracle->bases[leaf->first_base + k];
        Folded one;
        fold(&base->quadric, 0, &one);
        for (int i = 0; i < 10; i++) out->a[i] += base->weight * one.a[i];
    }
}

// The smallest eigenvalue of a symmetric matrix {xx, yy, zz, xy, xz, yz}, by the trigonometric formula.
static double least_eigenvalue(const double s[6])
{
    double off = s[3] * s[3] + s[4] * s[4] + s[5] * s[5], mean = (s[0] + s[1] + s[2]) / 3;
    double x = s[0] - mean, y = s[1] - mean, z = s[2] - mean;
    double spread = sqrt((x * x + y * y + z * z + 2 * off) / 6);
    if (spread == 0) return mean;
    double det = x * (y * z - s[5] * s[5]) - s[3] * (s[3] * z - s[5] * s[4]) + s[4] * (s[3] * s[5] - y * s[4]);
    double angle = acos(fmax(-1, fmin(1, det / (2 * spread * spread * spread)))) / 3;
    return mean + 2 * spread * cos(angle + 2 * acos(-1.0) / 3);
}

// Q >= 0 of a quadric whose matrix is negative definite is an ellipsoid: centre where the gradient vanishes, the longest half axis by the
// eigenvalue nearest to 0.
static Ball ball_around(const double a[10])
{
    double s[6] = {-a[0], -a[1], -a[2], -a[3] / 2, -a[4] / 2, -a[5] / 2};
    double least = least_eigenvalue(s);
    Ball ball = {.radius2 = INFINITY};
    double c[6] = {s[1] * s[2] - s[5] * s[5], s[0] * s[2] - s[4] * s[4], s[0] * s[1] - s[3] * s[3],
                   s[4] * s[5] - s[3] * s[2], s[3] * s[5] - s[4] * s[1], s[3] * s[4] - s[5] * s[0]};
    double det = s[0] * c[0] + s[3] * c[3] + s[4] * c[4];
    if (!(least > 1e-6 * (s[0] + s[1] + s[2])) || !(det > 0)) return ball;
    double h[3] = {a[6] / 2, a[7] / 2, a[8] / 2}, gradient[3];
    ball.centre[0] = (c[0] * h[0] + c[3] * h[1] + c[4] * h[2]) / det;
    ball.centre[1] = (c[3] * h[0] + c[1] * h[1] + c[5] * h[2]) / det;
    ball.centre[2] = (c[4] * h[0] + c[5] * h[1] + c[2] * h[2]) / det;
    double top = oracle_quadric_field(a, ball.centre, gradient);
    ball.radius2 = fmax(top, 0) / least * (1 + 1e-6);
    return ball;
}

static inline bool ball_missed(const Ball *ball, const double *o, const double *d, double d2)
{
    double x = ball->centre[0] - o[0], y = ball->centre[1] - o[1], z = ball->centre[2] - o[2];
    double along = x * d[0] + y * d[1] + z * d[2];
    return (x * x + y * y + z * z - ball->radius2) * d2 > along * along;
}

OraclePlain *oracle_plain_new(const Oracle *oracle)
{
    OraclePlain *plain = list(1, sizeof *plain);
    uint32_t leaves = oracle->leaf_count, perturbations = oracle->perturbation_count;
    plain->oracle = oracle;
    plain->bases = list(leaves, sizeof *plain->bases);
    plain->perturbations = list(perturbations, sizeof *plain->perturbations);
    plain->base_balls = list(leaves, sizeof *plain->base_balls);
    plain->balls = list(perturbations, sizeof *plain->balls);
    plain->base = list(leaves, sizeof *plain->base);
    plain->first = list(leaves, sizeof *plain->first);
    plain->count = list(leaves, sizeof *plain->count);
    plain->active = list(perturbations, sizeof *plain->active);
    plain->ends = list(2 * ((size_t)leaves + perturbations) + EXTRA_ENDS, sizeof *plain->ends);
    for (uint32_t i = 0; i < leaves; i++) {
        fold_base(oracle, &oracle->leaves[i], &plain->bases[i]);
        plain->base_balls[i] = ball_around(plain->bases[i].a);
    }
    for (uint32_t i = 0; i < perturbations; i++) {
        fold(&oracle->perturbations[i].quadric, oracle->perturbations[i].strength, &plain->perturbations[i]);
        plain->balls[i] = ball_around(plain->perturbations[i].a);
    }
    return plain;
}

void oracle_plain_free(OraclePlain *plain)
{
    if (!plain) return;
    free(plain->bases);
    free(plain->perturbations);
    free(plain->base_balls);
    free(plain->balls);
    free(plain->base);
    free(plain->first);
    free(plain->count);
    free(plain->active);
    free(plain->ends);
    free(plain);
}

static double value(const OracleParabola *q, double t)
{
    return (q->a * t + q->b) * t + q->c;
}

static double plain_leaf(const OraclePlain *plain, uint32_t leaf, double t)
{
    double f = value(&plain->base[leaf], t);
    const Active *active = plain->active + plain->first[leaf];
    for (uint32_t k = 0; k < plain->count[leaf]; k++) {
        double q = value(&active[k].q, t);
        if (q > 0) f += active[k].strength * q * q * q;
    }
    return f;
}

static double plain_field(const OraclePlain *plain, uint32_t at, double t)
{
    const OracleNode *nodes = plain->oracle->nodes, *node = &nodes[at];
    switch (node->kind) {
    case ORACLE_LEAF: return plain_leaf(plain, node->leaf, t);
    case ORACLE_EMPTY: return -ORACLE_INFINITY;
    case ORACLE_NOT: return -plain_field(plain, at + 1, t);
    default: {
        double f = plain_field(plain, at + 1, t);
        for (uint32_t k = nodes[at + 1].after; k < node->after; k = nodes[k].after) {
            double g = plain_field(plain, k, t);
            if (node->kind == ORACLE_UNION ? g > f : g < f) f = g;
        }
        return f;
    }
    }
}

static bool plain_inside(const OraclePlain *plain, uint32_t at, double t)
{
    const OracleNode *nodes = plain->oracle->nodes, *node = &nodes[at];
    switch (node->kind) {
    case ORACLE_LEAF: return plain_leaf(plain, node->leaf, t) >= 0;
    case ORACLE_EMPTY: return false;
    case ORACLE_NOT: return !plain_inside(plain, at + 1, t);
    default:
        for (uint32_t k = at + 1; k < node->after; k = nodes[k].after) {
            if (plain_inside(plain, k, t) == (node->kind == ORACLE_UNION)) return node->kind == ORACLE_UNION;
        }
        return node->kind == ORACLE_INTERSECT;
    }
}

static void add_end(OraclePlain *plain, const OracleRay *ray, double t)
{
    if (t <= ray->near || t >= ray->far) return;
    int k = plain->end_count++;
    while (k > 0 && plain->ends[k - 1] > t) { // the list is short: sorted by insertion
        plain->ends[k] = plain->ends[k - 1];
        k--;
    }
    plain->ends[k] = t;
}

static inline OracleParabola on_ray(const double *a, const double *o, const double *d)
{
    double x = o[0], y = o[1], z = o[2], u = d[0], v = d[1], w = d[2];
    double px = a[0] * x + a[3] * y + a[4] * z, py = a[1] * y + a[5] * z, pz = a[2] * z;
    return (OracleParabola){
        .a = (a[0] * u + a[3] * v + a[4] * w) * u + (a[1] * v + a[5] * w) * v + a[2] * w * w,
        .b = (px + a[0] * x + a[6]) * u + (py + a[3] * x + a[1] * y + a[7]) * v +
             (pz + a[4] * x + a[5] * y + a[2] * z + a[8]) * w,
        .c = (px + a[6]) * x + (py + a[7]) * y + (pz + a[8]) * z + a[9],
    };
}

// The two roots of a parabola, by the school's formula in its stable form.
static int interval(const OracleParabola *q, double roots[2])
{
    double disc = q->b * q->b - 4 * q->a * q->c;
    if (!(disc > 0)) return 0;
    double h = -0.5 * (q->b + copysign(sqrt(disc), q->b));
    if (q->a == 0) {
        roots[0] = q->c / h;
        return 1;
    }
    double r0 = h / q->a, r1 = q->c / h;
    roots[0] = fmin(r0, r1), roots[1] = fmax(r0, r1);
    return 2;
}

static void prepare(OraclePlain *plain, const OracleRay *ray)
{
    const Oracle *oracle = plain->oracle;
    const double *o = ray->origin, *d = ray->direction;
    double d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    plain->active_count = 0;
    plain->end_count = 0;
    double roots[2];
    for (uint32_t i = 0; i < oracle->leaf_count; i++) {
        const OracleLeaf *leaf = &oracle->leaves[i];
        plain->first[i] = plain->active_count;
        plain->count[i] = 0;
        if (leaf->count == 0 && ball_missed(&plain->base_balls[i], o, d, d2)) {
            plain->base[i] = (OracleParabola){.c = -1}; // below zero on the whole ray
            continue;
        }
        plain->base[i] = on_ray(plain->bases[i].a, o, d);
        int count = interval(&plain->base[i], roots);
        for (int k = 0; k < count; k++) add_end(plain, ray, roots[k]);
        const Folded *folded = plain->perturbations + leaf->first;
        const Ball *balls = plain->balls + leaf->first;
        for (uint32_t k = 0; k < leaf->count; k++) {
            if (ball_missed(&balls[k], o, d, d2)) continue;
            OracleParabola q = on_ray(folded[k].a, o, d);
            if (q.b * q.b - 4 * q.a * q.c <= 0 && q.c <= 0) continue;
            count = interval(&q, roots);
            if (count == 2 && q.a < 0 && (roots[1] <= ray->near || roots[0] >= ray->far)) continue;
            plain->active[plain->active_count++] = (Active){q, &folded[k], folded[k].strength};
            for (int n = 0; n < count; n++) add_end(plain, ray, roots[n]);
        }
        plain->count[i] = plain->active_count - plain->first[i];
    }
}

// Does any perturbation act around t?
static bool perturbed(const OraclePlain *plain, double t)
{
    for (uint32_t k = 0; k < plain->active_count; k++) {
        if (value(&plain->active[k].q, t) > 0) return true;
    }
    return false;
}

static double crossing(const OraclePlain *plain, double low, double high, bool below)
{
    for (int k = 0; k < 60 && high - low > 1e-12 * fabs(high); k++) {
        double middle = 0.5 * (low + high);
        if ((plain_field(plain, 0, middle) < 0) == below)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

// The place with the largest F (the smallest if `below` is false) in [low, high], where F rises and falls once.
static double summit(const OraclePlain *plain, double low, double high, bool below)
{
    const double golden = 0.6180339887498949;
    double sign = below ? 1 : -1;
    double x0 = high - golden * (high - low), x1 = low + golden * (high - low);
    double f0 = sign * plain_field(plain, 0, x0), f1 = sign * plain_field(plain, 0, x1);
    for (int k = 0; k < 40; k++) {
        if (f0 > f1) {
            high = x1, x1 = x0, f1 = f0;
            x0 = high - golden * (high - low), f0 = sign * plain_field(plain, 0, x0);
        } else {
            low = x0, x0 = x1, f0 = f1;
            x1 = low + golden * (high - low), f1 = sign * plain_field(plain, 0, x1);
        }
        if (f0 >= 0 || f1 >= 0) break;
    }
    return f0 > f1 ? x0 : x1;
}

// Looks for the first sign change in [low, high]; `below` is the sign before it.
static bool search_piece(const OraclePlain *plain, double low, double high, int samples, bool below, double *t)
{
    double before = low, older = low, f_before = 0, f_older = 0;
    for (int k = 0; k <= samples; k++) {
        double at = low + (high - low) * (k + 0.5) / samples;
        if (k == samples) at = high;
        double f = plain_field(plain, 0, at);
        if ((f < 0) != below) {
            *t = crossing(plain, before, at, below);
            return true;
        }
        bool peak = k >= 2 && (below ? f_before > f && f_before > f_older : f_before < f && f_before < f_older);
        if (peak) {
            double top = summit(plain, older, at, below);
            if ((plain_field(plain, 0, top) < 0) != below) {
                *t = crossing(plain, older, top, below);
                return true;
            }
        }
        older = before, f_older = f_before;
        before = at, f_before = f;
    }
    return false;
}

// Cuts the ray by the ball around the scene. False if it misses.
static bool clip_to_ball(const Oracle *oracle, OracleRay *ray)
{
    if (!(oracle->bound[3] > 0)) return true;
    double o[3], a = 0, b = 0, c = -oracle->bound[3] * oracle->bound[3];
    for (int i = 0; i < 3; i++) {
        o[i] = ray->origin[i] - oracle->bound[i];
        a += ray->direction[i] * ray->direction[i];
        b += ray->direction[i] * o[i];
        c += o[i] * o[i];
    }
    double disc = b * b - a * c;
    if (!(disc > 0)) return false;
    ray->near = fmax(ray->near, (-b - sqrt(disc)) / a);
    ray->far = fmin(ray->far, (-b + sqrt(disc)) / a);
    return ray->near < ray->far;
}

// The first sign change. Returns false if there is none.
static bool search(Oracle *oracle, const OracleRay *given, int samples, double *t, bool *leaving)
{
    OraclePlain *plain = oracle->plain;
    OracleRay ray = *given;
    if (!clip_to_ball(oracle, &ray)) return false;
    prepare(plain, &ray);
    // Behind the last end a support that has none may still act: go on in growing steps.
    double last = plain->end_count ? plain->ends[plain->end_count - 1] : ray.near, step = fmax(1e-3, fabs(last));
    int steps = perturbed(plain, fmin(ray.far, last + step)) ? EXTRA_ENDS : 1;
    for (; steps && last < ray.far; steps--, step *= 4)
        plain->ends[plain->end_count++] = last = fmin(ray.far, last + step);
    double low = ray.near;
    bool below = !plain_inside(plain, 0, low + 1e-9 * (plain->ends[0] - low));
    *leaving = !below;
    for (int k = 0; k < plain->end_count; low = plain->ends[k++]) {
        double high = plain->ends[k];
        double middle = 0.5 * (low + high);
        if (perturbed(plain, middle)) {
            if (search_piece(plain, low, high, samples, below, t)) return true;
        } else if (plain_inside(plain, 0, middle) == below) {
            *t = low; // the end of an interval is the root
            return true;
        }
    }
    return false;
}

// The leaf that decides at t, with the sign that complements give it.
static uint32_t deciding_leaf(const OraclePlain *plain, uint32_t at, double t, double *f, int *sign)
{
    const OracleNode *nodes = plain->oracle->nodes, *node = &nodes[at];
    *sign = 1;
    if (node->kind == ORACLE_EMPTY) {
        *f = -ORACLE_INFINITY;
        return UINT32_MAX;
    }
    if (node->kind == ORACLE_LEAF) {
        *f = plain_leaf(plain, node->leaf, t);
        return node->leaf;
    }
    uint32_t best = deciding_leaf(plain, at + 1, t, f, sign);
    if (node->kind == ORACLE_NOT) {
        *f = -*f, *sign = -*sign;
        return best;
    }
    for (uint32_t k = nodes[at + 1].after; k < node->after; k = nodes[k].after) {
        double g;
        int other_sign;
        uint32_t other = deciding_leaf(plain, k, t, &g, &other_sign);
        double tolerance = 1e-12 * fabs(t);
        if (node->kind == ORACLE_UNION ? g > *f + tolerance : g < *f - tolerance)
            best = other, *f = g, *sign = other_sign;
    }
    return best;
}

bool oracle_reference_hit(Oracle *oracle, const OracleRay *ray, int samples, OracleHit *hit)
{
    const OraclePlain *plain = oracle->plain;
    double f, t, sum[3], g[3];
    int sign;
    *hit = (OracleHit){0};
    if (!search(oracle, ray, samples, &t, &hit->leaving)) return false;
    hit->t = t;
    hit->leaf = deciding_leaf(plain, 0, t, &f, &sign);
    for (int i = 0; i < 3; i++) hit->point[i] = ray->origin[i] + t * ray->direction[i];
    if (hit->leaf == UINT32_MAX) return true;
    oracle_quadric_field(plain->bases[hit->leaf].a, hit->point, sum);
    const Active *active = plain->active + plain->first[hit->leaf];
    for (uint32_t k = 0; k < plain->count[hit->leaf]; k++) {
        double q = oracle_quadric_field(active[k].folded->a, hit->point, g);
        for (int i = 0; i < 3 && q > 0; i++) sum[i] += 3 * active[k].strength * q * q * g[i];
    }
    double slope = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (int i = 0; i < 3; i++)
        hit->normal[i] = slope > 0 ? (hit->leaving ? 1 : -1) * sign * sum[i] / slope : -ray->direction[i];
    return true;
}

bool oracle_reference_blocked(Oracle *oracle, const OracleRay *ray, int samples)
{
    double t;
    bool leaving;
    return search(oracle, ray, samples, &t, &leaving);
}
