// Notation of shared.h: W² Q = lead w² - 2 beta w + q with beta, q polynomials of (U, V). The conic is h2 = (beta/lead)² - q/lead; where the rays
// meet Q, h2 >= 0. About the conic's centre h2 has no linear part, and floats keep all their digits for it.
#include "runtime/fold.h"

#include <math.h>
#include <string.h>

#include "runtime/view.h"

// Where the form by the middle is used: nearer than this (in units, about what is looked at), with these ranks. Beyond it, squares of large numbers would
// cancel in float; the general form has the root that is near from a quotient instead.
#define REACH      8.0
#define LEAD_RANK  1e-7
#define CONIC_RANK 1e-6

// From how many times the size of the base on a perturbation is strong.
#define STRONG 16.0

// What floats may add to the size of a box.
#define BOX_MARGIN 4e-6

void fold_map(const Projection *projection, ScreenMap *map)
{
    double kappa = projection->kappa, unit = projection->unit;
    for (int k = 0; k < 3; k++) {
        map->column[0][k] = unit * projection->axis[0][k];
        map->column[1][k] = unit * projection->axis[1][k];
        map->column[2][k] = unit * projection->axis[2][k] - kappa * projection->origin[k];
        map->column[3][k] = projection->origin[k];
    }
    map->column[0][3] = map->column[1][3] = 0;
    map->column[2][3] = -kappa;
    map->column[3][3] = 1;
}

static void form_column(const double q[10], const double x[4], double result[4])
{
    result[0] = q[0] * x[0] + 0.5 * (q[3] * x[1] + q[4] * x[2] + q[6] * x[3]);
    result[1] = q[1] * x[1] + 0.5 * (q[3] * x[0] + q[5] * x[2] + q[7] * x[3]);
    result[2] = q[2] * x[2] + 0.5 * (q[4] * x[0] + q[5] * x[1] + q[8] * x[3]);
    result[3] = q[9] * x[3] + 0.5 * (q[6] * x[0] + q[7] * x[1] + q[8] * x[2]);
}

static double dot4(const double a[4], const double b[4])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

void fold_quadric(const double q[10], const ScreenMap *map, ScreenQuadric *folded)
{
    const double(*m)[4] = map->column;
    double t[4];
    form_column(q, m[0], t);
    folded->uu = dot4(m[0], t);
    form_column(q, m[1], t);
    folded->uv = dot4(m[0], t);
    folded->vv = dot4(m[1], t);
    form_column(q, m[2], t);
    folded->uw = dot4(m[0], t);
    folded->vw = dot4(m[1], t);
    folded->ww = dot4(m[2], t);
    form_column(q, m[3], t);
    folded->u1 = dot4(m[0], t);
    folded->v1 = dot4(m[1], t);
    folded->w1 = dot4(m[2], t);
    folded->one = dot4(m[3], t);
}

void fold_add(ScreenQuadric *sum, double factor, const ScreenQuadric *folded)
{
    double *s = &sum->uu;
    const double *f = &folded->uu;
    for (int k = 0; k < 10; k++) s[k] += factor * f[k];
}

double fold_largest(const ScreenQuadric *folded)
{
    const double *f = &folded->uu;
    double largest = 0;
    for (int k = 0; k < 10; k++) largest = fmax(largest, fabs(f[k]));
    return largest;
}

// The conic about a place: h2 = h0 + du (d + a du + b dv) + dv (e + c dv), and tm there.
typedef struct Conic {
    double uc, vc, h0, a, b, c, d, e, t0, tu, tv;
    bool centred; // it has a centre
    double det;   // of its quadratic part, 4 a c - b²
} Conic;

static void find_conic(const ScreenQuadric *f, Conic *k)
{
    double inverse = 1 / f->ww;
    double tu = -f->uw * inverse, tv = -f->vw * inverse, t1 = -f->w1 * inverse;
    double a = tu * tu - f->uu * inverse, c = tv * tv - f->vv * inverse, half_b = tu * tv - f->uv * inverse;
    double d = tu * t1 - f->u1 * inverse, e = tv * t1 - f->v1 * inverse, g = t1 * t1 - f->one * inverse;
    double det = a * c - half_b * half_b;
    double size = fmax(fmax(fabs(a), fabs(c)), fabs(half_b));
    k->a = a, k->b = 2 * half_b, k->c = c, k->tu = tu, k->tv = tv, k->det = 4 * det;
    // The determinant of slabs and cylinders is noise of either sign.
    k->centred = fabs(det) > CONIC_RANK * size * size;
    k->uc = k->vc = k->d = k->e = 0;
    if (k->centred) {
        k->uc = (half_b * e - c * d) / det;
        k->vc = (half_b * d - a * e) / det;
    }
    k->h0 = g + d * k->uc + e * k->vc;
    k->t0 = t1 + tu * k->uc + tv * k->vc;
}

static bool is_float(double x)
{
    return fabs(x) < 1e18;
}

static void general_record(const ScreenQuadric *f, double factor, QuadricRecord *r)
{
    r->flags |= RECORD_GENERAL;
    // The kernel divides by the leading coefficient, which may be 0 or noise: then the second root is beyond all that is seen.
    double lead = f->ww, least = 1e-13 * fold_largest(f);
    if (fabs(lead) < least) lead = lead > 0 ? least : -least;
    if (lead == 0) lead = -1e-30;
    r->lead = (float)(factor * lead);
    r->t0 = (float)(-factor * f->w1);
    r->tu = (float)(-factor * f->uw);
    r->tv = (float)(-factor * f->vw);
    r->h0 = (float)(factor * f->one);
    r->d = (float)(factor * 2 * f->u1);
    r->e = (float)(factor * 2 * f->v1);
    r->a = (float)(factor * f->uu);
    r->b = (float)(factor * 2 * f->uv);
    r->c = (float)(factor * f->vv);
}

static bool is_near(const Conic *k)
{
    return fabs(k->uc) < REACH && fabs(k->vc) < REACH && fabs(k->t0) < REACH && fabs(k->h0) < REACH * REACH;
}

// Moves the conic's reference to 0 0.
static void conic_uncentre(Conic *k, const ScreenQuadric *f)
{
    double inverse = 1 / f->ww, t1 = -f->w1 * inverse;
    k->uc = k->vc = 0;
    k->d = 2 * (k->tu * t1 - f->u1 * inverse);
    k->e = 2 * (k->tv * t1 - f->v1 * inverse);
    k->h0 = t1 * t1 - f->one * inverse;
    k->t0 = t1;
}

// What is far from 0 0 has large numbers that cancel.
static bool is_small(const Conic *k)
{
    double size = fmax(fabs(k->d) + fabs(k->e), fabs(k->a) + fabs(k->b) + fabs(k->c));
    return is_near(k) && size < 2 * REACH * REACH && fabs(k->tu) < REACH && fabs(k->tv) < REACH;
}

double fold_record(const ScreenQuadric *f, double factor, QuadricRecord *r)
{
    memset(r, 0, sizeof *r);
    double largest = fold_largest(f);
    if (f->ww > 0) r->flags |= RECORD_OUTSIDE;
    bool lead = fabs(f->ww) > LEAD_RANK * largest;
    Conic k = {0};
    if (lead) find_conic(f, &k);
    bool centred = lead && k.centred && is_near(&k) && is_float(k.a) && is_float(k.b) && is_float(k.c) &&
                   is_float(k.tu) && is_float(k.tv);
    if (lead && !centred) conic_uncentre(&k, f);
    bool middle = centred || (lead && is_small(&k));
    if (factor == 0) factor = middle ? 1 / fabs(f->ww) : largest > 0 ? 1 / largest : 1;
    if (!middle) {
        general_record(f, factor, r);
        return factor;
    }
    if (centred) r->flags |= RECORD_CENTRED;
    r->uc = (float)k.uc;
    r->vc = (float)k.vc;
    r->h0 = (float)k.h0;
    r->a = (float)k.a;
    r->b = (float)k.b;
    r->c = (float)k.c;
    r->d = (float)k.d;
    r->e = (float)k.e;
    r->t0 = (float)k.t0;
    r->tu = (float)k.tu;
    r->tv = (float)k.tv;
    r->lead = (float)(factor * f->ww);
    return factor;
}

// W (n·X - at) = rise (w - (place + along_u U + along_v V)).
typedef struct ScreenPlane {
    double place, along_u, along_v, rise;
} ScreenPlane;

static ScreenPlane fold_plane(const Plane *plane, const Projection *p)
{
    double across[3], off = -plane->at;
    for (int k = 0; k < 3; k++) {
        const double *axis = p->axis[k], *n = plane->normal;
        across[k] = p->unit * (n[0] * axis[0] + n[1] * axis[1] + n[2] * axis[2]);
        off += n[k] * p->origin[k];
    }
    // Seen from the edge it is met infinitely far, before or behind all that is seen.
    double rise = across[2] - p->kappa * off, least = 1e-13 * (p->unit + fabs(off));
    if (fabs(rise) < least) rise = rise < 0 ? -least : least;
    return (ScreenPlane){-off / rise, -across[0] / rise, -across[1] / rise, rise};
}

static double largest_of(const ScreenPlane *s)
{
    return fmax(fmax(1, fabs(s->place)), fmax(fabs(s->along_u), fabs(s->along_v)));
}

double fold_planes(const LeafFace *face, const Projection *projection, QuadricRecord *r)
{
    memset(r, 0, sizeof *r);
    bool half = face->kind == FACE_HALFSPACE;
    ScreenPlane first = fold_plane(&face->planes[0], projection), second = {.rise = 1};
    r->flags = RECORD_PLANES;
    r->t0 = (float)first.place;
    r->tu = (float)first.along_u;
    r->tv = (float)first.along_v;
    double lead = face->factor * first.rise, largest = largest_of(&first);
    if (half) {
        r->flags |= RECORD_HALF | RECORD_STEEP;
        r->a = (float)projection->kappa;
    } else {
        second = fold_plane(&face->planes[1], projection);
        r->h0 = (float)second.place;
        r->d = (float)second.along_u;
        r->e = (float)second.along_v;
        lead *= second.rise;
        if (largest > REACH || largest_of(&second) > REACH) r->flags |= RECORD_STEEP;
        largest *= largest_of(&second);
        if (lead > 0) r->flags |= RECORD_OUTSIDE;
    }
    double factor = 1 / (fabs(lead) * largest);
    r->lead = (float)(factor * lead);
    return factor;
}

void fold_hidden(QuadricRecord *r)
{
    memset(r, 0, sizeof *r);
    r->flags = RECORD_CENTRED;
    r->h0 = -1;
    r->lead = -1;
    r->w_low = INFINITY;
}

// W² Q at a place, and how far it goes from there within a box around it.
static double fold_value(const ScreenQuadric *f, const double p[3], const double half[3], double *range)
{
    double u = p[0], v = p[1], w = p[2];
    double by_u = f->uu * u + f->uv * v + f->uw * w + f->u1, by_v = f->uv * u + f->vv * v + f->vw * w + f->v1;
    double by_w = f->uw * u + f->vw * v + f->ww * w + f->w1;
    *range = 2 * (fabs(by_u) * half[0] + fabs(by_v) * half[1] + fabs(by_w) * half[2]);
    return by_u * u + by_v * v + by_w * w + f->u1 * u + f->v1 * v + f->w1 * w + f->one;
}

bool fold_strong(const ScreenQuadric *base, const ScreenQuadric *perturbation, double strength, const Box *support,
                 double kappa)
{
    double middle[3], half[3], range, unused;
    for (int k = 0; k < 3; k++) {
        middle[k] = 0.5 * (support->low[k] + support->high[k]);
        half[k] = 0.5 * (support->high[k] - support->low[k]);
        if (!isfinite(middle[k])) return true;
    }
    double peak = fold_value(perturbation, middle, half, &unused);
    double own = fabs(fold_value(base, middle, half, &range)), square = pow(1 - kappa * middle[2], 2);
    return !(fabs(strength) * fabs(peak * peak * peak) <= STRONG * (own + range) * square * square);
}

static void box_infinite(Box *box)
{
    for (int k = 0; k < 3; k++) {
        box->low[k] = -INFINITY;
        box->high[k] = INFINITY;
    }
}

static void box_range(Box *box, int axis, double middle, double half)
{
    double margin = BOX_MARGIN * (1 + fabs(middle) + half);
    box->low[axis] = middle - half - margin;
    box->high[axis] = middle + half + margin;
}

// lead < 0: the rays through the inside of the conic meet it between two roots.
void fold_box(const ScreenQuadric *f, Box *box)
{
    box_infinite(box);
    if (!(f->ww < -LEAD_RANK * fold_largest(f))) return;
    Conic k;
    find_conic(f, &k);
    if (!k.centred || !(k.a < 0) || !(k.c < 0) || !(k.det > 0)) return;
    if (k.h0 < -1e-6) {
        for (int axis = 0; axis < 3; axis++) box->low[axis] = INFINITY, box->high[axis] = -INFINITY;
        return;
    }
    // With N = -(a b/2; b/2 c): U reaches sqrt(h0 N^-1_uu), and w = tm + sqrt(h2) at most sqrt(h0 (1 + t N^-1 t)).
    double h0 = fmax(k.h0, 0), det = k.det / 4;
    double uu = -k.c / det, vv = -k.a / det, uv = k.b / 2 / det;
    box_range(box, 0, k.uc, sqrt(h0 * uu));
    box_range(box, 1, k.vc, sqrt(h0 * vv));
    box_range(box, 2, k.t0, sqrt(h0 * (1 + k.tu * k.tu * uu + 2 * k.tu * k.tv * uv + k.tv * k.tv * vv)));
}

void fold_outside_box(const ScreenQuadric *f, Box *box)
{
    ScreenQuadric negative = {0};
    fold_add(&negative, -1, f);
    fold_box(&negative, box);
}
