// Free forms that patches lift: F' = F + sum of R + strength z(x, y), z a bicubic in each cell of a patch. W^6 z(x, y) is a polynomial of degree 6 in w along
// a ray, as all else is: so a cell is one more thing with a support, the stretch of the ray in which x and y are in the cell and z between the caps, and the
// Bernstein coefficients on the pieces between ends of supports tell for certain whether there is a root, as in freeform.cl.

#define LIFTED_LIMIT 128 // supports of a packet that are kept; those of more are found again for each piece

typedef struct Support {
    FLOAT low, high;
} Support;

// Where p + q w turns from negative to positive, as an end of a support: it bounds `low` where q > 0, else `high`.
INLINE void cut_support(Support *s, FLOAT p, FLOAT q)
{
    FLOAT none = INFINITY;
    FLOAT inverse = rough_reciprocal(q);
    inverse *= 2.0f - q * inverse; // a division takes three times as long
    FLOAT at = -p * inverse;
    FLOAT level = p >= 0.0f ? -none : none; // of q = 0: everywhere or nowhere
    at = q == 0.0f ? level : at;
    INT rises = q >= 0.0f;
    s->low = rises ? most(s->low, at) : s->low;
    s->high = rises ? s->high : least(s->high, at);
}

// x of a lift's frame times W is p + q w.
typedef struct LiftLine {
    FLOAT p;
    float q;
} LiftLine;

INLINE LiftLine lift_line(__global const float *row, FLOAT u, FLOAT v)
{
    return (LiftLine){row[0] * u + row[1] * v + row[3], row[2]};
}

// The stretch of the ray between two planes of a lift's frame, n x = i and n x = i + 1. Neighbours share their ends, bit by bit.
INLINE Support strip_support(LiftLine x, float n, float i, float kappa)
{
    Support s = {-INFINITY, INFINITY};
    cut_support(&s, n * x.p - i, n * x.q + i * kappa);
    cut_support(&s, -(n * x.p - (i + 1.0f)), -(n * x.q + (i + 1.0f) * kappa) + 0.0f * x.p);
    return s;
}

// Strips of a lift that were asked for last: the row of cells, since they come row by row, and columns, of which a packet meets few.
#define COLUMNS 8
typedef struct Strips {
    uint lift, row;
    uint columns[COLUMNS]; // at their number modulo COLUMNS
    Support along, across[COLUMNS];
} Strips;
#define NO_STRIP 0xffffffffu

INLINE void strips_clear(Strips *strips, uint lift)
{
    strips->lift = lift;
    strips->row = NO_STRIP;
    for (uint k = 0; k < COLUMNS; k++) strips->columns[k] = NO_STRIP;
}

// The stretch of the ray in a cell.
INLINE Support cell_support(const Ray *ray, uint id, Strips *strips)
{
    __global const PlanNode *node = ray->nodes + id;
    __global const LiftRecord *lift = (__global const LiftRecord *)(ray->records + node->shape);
    float n = lift->cells, kappa = ray->kappa;
    uint i = node->material, j = node->object, slot = j % COLUMNS;
    if (strips->lift != node->shape) strips_clear(strips, node->shape);
    if (strips->row != i) strips->along = strip_support(lift_line(lift->x, ray->u, ray->v), n, (float)i, kappa);
    if (strips->columns[slot] != j) strips->across[slot] = strip_support(lift_line(lift->y, ray->u, ray->v), n, (float)j, kappa);
    strips->row = i;
    strips->columns[slot] = j;
    Support s = {most(strips->along.low, strips->across[slot].low), least(strips->along.high, strips->across[slot].high)};
    LiftLine z = lift_line(lift->z, ray->u, ray->v);
    __global const CellBand *band = (__global const CellBand *)(ray->records + id + 1);
    cut_support(&s, z.p - band->low, z.q + band->low * kappa);
    cut_support(&s, -(z.p - band->high), -(z.q + band->high * kappa) + 0.0f * z.p);
    INT none = !(s.low < s.high);
    FLOAT never = INFINITY;
    s.low = none ? never : s.low;
    s.high = none ? never : s.high;
    return s;
}

INLINE int is_cell(const Ray *ray, uint leaf, uint id)
{
    return id > leaf + (ray->nodes[leaf].count & NODE_COUNT);
}

INLINE Support item_support(const Ray *ray, uint leaf, uint id, Strips *strips)
{
    if (is_cell(ray, leaf, id)) return cell_support(ray, id, strips);
    Roots r = record_roots(ray->records + id, ray->u, ray->v);
    return (Support){r.r0, r.r1};
}

// The four Bernstein coefficients on a piece of a cubic with Bezier points g, whose parameter is a / (a + b) with a and b linear along the piece: a0, b0 at its
// begin, a1, b1 at its end; times (a + b)^3. Its polar form.
typedef struct Cubic {
    FLOAT c0, c1, c2, c3;
} Cubic;

INLINE Cubic cubic_piece(FLOAT g0, FLOAT g1, FLOAT g2, FLOAT g3, FLOAT a0, FLOAT b0, FLOAT a1, FLOAT b1)
{
    FLOAT p0 = b0 * g0 + a0 * g1, p1 = b0 * g1 + a0 * g2, p2 = b0 * g2 + a0 * g3;
    FLOAT q0 = b1 * g0 + a1 * g1, q1 = b1 * g1 + a1 * g2, q2 = b1 * g2 + a1 * g3;
    FLOAT pp0 = b0 * p0 + a0 * p1, pp1 = b0 * p1 + a0 * p2;
    FLOAT pq0 = b1 * p0 + a1 * p1, pq1 = b1 * p1 + a1 * p2;
    FLOAT qq0 = b1 * q0 + a1 * q1, qq1 = b1 * q1 + a1 * q2;
    return (Cubic){b0 * pp0 + a0 * pp1, b1 * pp0 + a1 * pp1, b1 * pq0 + a1 * pq1, b1 * qq0 + a1 * qq1};
}

// Adds W^6 z of a cell on the piece between two places, in the lanes that are in it.
INLINE void add_cell(Bernstein *sum, const Ray *ray, uint id, RayPlace l, RayPlace h, INT in)
{
    __global const PlanNode *node = ray->nodes + id;
    __global const LiftRecord *lift = (__global const LiftRecord *)(ray->records + node->shape);
    __global const float *g = ((__global const CellRecord *)(ray->records + id))->points;
    LiftLine x = lift_line(lift->x, ray->u, ray->v), y = lift_line(lift->y, ray->u, ray->v);
    float n = lift->cells, i = (float)node->material, j = (float)node->object, kappa = ray->kappa;
    FLOAT w0 = l.o - kappa * l.w, w1 = h.o - kappa * h.w;
    FLOAT a0 = n * (x.p * l.o + x.q * l.w) - i * w0, a1 = n * (x.p * h.o + x.q * h.w) - i * w1;
    FLOAT c0 = n * (y.p * l.o + y.q * l.w) - j * w0, c1 = n * (y.p * h.o + y.q * h.w) - j * w1;
    FLOAT b0 = w0 - a0, b1 = w1 - a1, d0 = w0 - c0, d1 = w1 - c1;
    Cubic r0 = cubic_piece(g[0], g[4], g[8], g[12], a0, b0, a1, b1);
    Cubic r1 = cubic_piece(g[1], g[5], g[9], g[13], a0, b0, a1, b1);
    Cubic r2 = cubic_piece(g[2], g[6], g[10], g[14], a0, b0, a1, b1);
    Cubic r3 = cubic_piece(g[3], g[7], g[11], g[15], a0, b0, a1, b1);
    Cubic s0 = cubic_piece(r0.c0, r1.c0, r2.c0, r3.c0, c0, d0, c1, d1);
    Cubic s1 = cubic_piece(r0.c1, r1.c1, r2.c1, r3.c1, c0, d0, c1, d1);
    Cubic s2 = cubic_piece(r0.c2, r1.c2, r2.c2, r3.c2, c0, d0, c1, d1);
    Cubic s3 = cubic_piece(r0.c3, r1.c3, r2.c3, r3.c3, c0, d0, c1, d1);
    FLOAT zero = 0.0f;
    sum->c0 += in ? s0.c0 : zero;
    sum->c1 += in ? 0.5f * (s0.c1 + s1.c0) : zero;
    sum->c2 += in ? 0.2f * (s0.c2 + s2.c0) + 0.6f * s1.c1 : zero;
    sum->c3 += in ? 0.05f * (s0.c3 + s3.c0) + 0.45f * (s1.c2 + s2.c1) : zero;
    sum->c4 += in ? 0.2f * (s1.c3 + s3.c1) + 0.6f * s2.c2 : zero;
    sum->c5 += in ? 0.5f * (s2.c3 + s3.c2) : zero;
    sum->c6 += in ? s3.c3 : zero;
}

// What of a list some lane meets on its way from t to the bound: perturbations first, then cells. Where there is more of it than LIFTED_LIMIT, all of the list, found
// again each time it is asked for.
typedef struct Lifting {
    uint begin, perturbations, count;
    int all;
    uint ids[LIFTED_LIMIT];
    FLOAT lows[LIFTED_LIMIT], highs[LIFTED_LIMIT];
} Lifting;

static void lifting_find(Lifting *kept, const Ray *ray, uint id, uint begin, uint stop, FLOAT t, FLOAT bound)
{
    INT live = t < bound;
    kept->begin = begin;
    kept->all = 0;
    kept->perturbations = kept->count = 0;
    Strips strips;
    strips_clear(&strips, NO_STRIP);
    for (uint k = begin; k < stop; k++) {
        uint item = ray->list[k];
        Support s = item_support(ray, id, item, &strips);
        int cell = is_cell(ray, id, item);
        INT meets = !cell && ray->records[item].flags & RECORD_OUTSIDE ? (s.low > t) | (s.high < bound) : (s.low < bound) & (s.high > t);
        if (!ANY(meets & live)) continue;
        if (kept->count == LIFTED_LIMIT) {
            kept->all = 1;
            break;
        }
        kept->ids[kept->count] = item;
        kept->lows[kept->count] = s.low;
        kept->highs[kept->count++] = s.high;
        if (!cell) kept->perturbations = kept->count;
    }
    if (!kept->all) return;
    kept->count = stop - begin;
    kept->perturbations = 0;
    while (kept->perturbations < kept->count && !is_cell(ray, id, ray->list[begin + kept->perturbations])) kept->perturbations++;
}

INLINE uint lifting_get(const Lifting *kept, const Ray *ray, uint id, uint k, Support *s)
{
    if (!kept->all) {
        *s = (Support){kept->lows[k], kept->highs[k]};
        return kept->ids[k];
    }
    Strips strips;
    strips_clear(&strips, NO_STRIP);
    *s = item_support(ray, id, ray->list[kept->begin + k], &strips);
    return ray->list[kept->begin + k];
}

// Adds the perturbations that are on the piece [t, end] to the sum; which lanes have any.
static INT lifting_perturb(const Lifting *kept, const Ray *ray, uint id, FLOAT t, FLOAT end, RayPlace l, RayPlace h, INT live, Bernstein *sum)
{
    INT active = t > end; // none
    for (uint k = 0; k < kept->perturbations; k++) {
        Support s;
        uint item = lifting_get(kept, ray, id, k, &s);
        INT in = ray->records[item].flags & RECORD_OUTSIDE ? (end <= s.low) | (t >= s.high) : (s.low <= t) & (end <= s.high);
        in = in & live;
        if (!ANY(in)) continue;
        active = active | in;
        Bezier2 a = record_bezier(ray->records + item, ray->u, ray->v, l, h);
        FLOAT zero = 0.0f;
        add_cube(sum, in ? a.a0 : zero, in ? a.a1 : zero, in ? a.a2 : zero);
    }
    return active;
}

// Adds the cells that are on the piece, in the lanes where the sum may be positive with what they can be at most; which lanes have any. `sum` is of all else. Most
// pieces are far from the surface, and this tells it for less than a tenth of what their polynomials take.
static INT lifting_cells(const Lifting *kept, const Ray *ray, uint id, FLOAT t, FLOAT end, RayPlace l, RayPlace h, float sign, INT live, INT *maybe, Bernstein *sum)
{
    FLOAT w0 = l.o - ray->kappa * l.w, w1 = h.o - ray->kappa * h.w, low = least(w0, w1), high = most(w0, w1);
    FLOAT low6 = low * low * low, high6 = high * high * high, zero = 0.0f, raised = 0.0f, size = 0.0f;
    low6 *= low6;
    high6 *= high6;
    INT active = t > end;
    for (uint k = kept->perturbations; k < kept->count; k++) {
        Support s;
        uint item = lifting_get(kept, ray, id, k, &s);
        INT in = live & (s.low <= t) & (end <= s.high);
        if (!ANY(in)) continue;
        active = active | in;
        __global const CellBand *band = (__global const CellBand *)(ray->records + item + 1);
        float top = sign > 0.0f ? band->most : -band->least;
        FLOAT most_of_it = top > 0.0f ? top * high6 : top * low6;
        raised += in ? most_of_it : zero;
        size += in ? size_of(most_of_it) : zero;
    }
    *maybe = active;
    if (!ANY(active)) return active;
    FLOAT highest_of_it = sign > 0.0f ? bernstein_highest(sum) : -bernstein_lowest(sum);
    *maybe = active & (highest_of_it + raised + 1e-5f * (size + size_of(highest_of_it)) > 0.0f);
    if (!ANY(*maybe)) return active;
    for (uint k = kept->perturbations; k < kept->count; k++) {
        Support s;
        uint item = lifting_get(kept, ray, id, k, &s);
        INT in = *maybe & (s.low <= t) & (end <= s.high);
        if (ANY(in)) add_cell(sum, ray, item, l, h, in);
    }
    return active;
}

// As freeform_next(), with cells in the list behind the perturbations.
static FLOAT lifting_next(const Lifting *kept, const Ray *ray, uint id, FLOAT t, FLOAT bound, float sign, INT known)
{
    __global const QuadricRecord *base = ray->records + id;
    FLOAT u = ray->u, v = ray->v;
    Roots base_roots = record_roots(base, u, v);
    FLOAT found = INFINITY;
    INT live = t < bound;
    while (ANY(live)) {
        // The piece [t, end] up to the next end of a support.
        FLOAT end = bound;
        for (uint k = 0; k < kept->count; k++) {
            Support s;
            lifting_get(kept, ray, id, k, &s);
            FLOAT next = s.low > t ? s.low : s.high > t ? s.high : (FLOAT)(INFINITY);
            end = least(end, next);
        }
        RayPlace l = ray_place(t), h = ray_place(end);
        Bernstein sum;
        sum.c0 = sum.c1 = sum.c2 = sum.c3 = sum.c4 = sum.c5 = sum.c6 = 0.0f;
        INT perturbed = lifting_perturb(kept, ray, id, t, end, l, h, live, &sum);
        Bezier2 f = record_bezier(base, u, v, l, h);
        add_base(&sum, f.a0, f.a1, f.a2, l.o - ray->kappa * l.w, h.o - ray->kappa * h.w);
        INT maybe;
        INT lifted = lifting_cells(kept, ray, id, t, end, l, h, sign, live, &maybe, &sum);
        // The base alone.
        FLOAT closed = sign > 0.0f ? quadric_enter(base_roots, base->flags, t) : quadric_leave(base_roots, base->flags, t);
        INT alone = live & !perturbed & !lifted;
        INT met = alone & (closed < end);
        found = met ? closed : found;
        live = live & !met;
        INT solve = live & ((perturbed & !lifted) | maybe);
        if (ANY(solve)) {
            // As in freeform_next(): what is 0 as far as floats can tell is not yet positive.
            FLOAT tolerance = 2e-6f * bernstein_largest(&sum);
            Bernstein b = {sign * sum.c0, sign * sum.c1, sign * sum.c2, sign * sum.c3, sign * sum.c4, sign * sum.c5, sign * sum.c6};
            FLOAT none = 0.0f;
            b.c0 = (!known & ((b.c0 > tolerance) | (l.o == 0.0f))) ? b.c0 : least(b.c0, known ? -tolerance : none);
            FLOAT s = bernstein_first(&b, solve, 0);
            INT hit = solve & (s <= 1.0f);
            FLOAT o = (1.0f - s) * l.o + s * h.o;
            FLOAT w = ((1.0f - s) * l.w + s * h.w) / o;
            w = s == 0.0f ? t : most(least(w, end), t);
            found = hit ? w : found;
            live = live & !hit;
        }
        t = end;
        known = t == t;
        live = live & (t < bound);
    }
    return found;
}

NOINLINE FLOAT lifted_next(const Ray *ray, uint id, uint begin, uint stop, FLOAT t, FLOAT bound, float sign, INT known)
{
    Lifting kept;
    lifting_find(&kept, ray, id, begin, stop, t, bound);
    return lifting_next(&kept, ray, id, t, bound, sign, known);
}

// Whether the cells that are kept are of one lift: no two of them are on a ray at one place.
static int lifting_is_single(const Lifting *kept, const Ray *ray)
{
    return !kept->all && ray->nodes[kept->ids[kept->perturbations]].shape == ray->nodes[kept->ids[kept->count - 1u]].shape;
}

// The cells that are kept from front to back, as far as rows and columns say.
static void lifting_order(const Lifting *kept, const Ray *ray, uchar *order)
{
    __global const LiftRecord *lift = (__global const LiftRecord *)(ray->records + ray->nodes[kept->ids[kept->perturbations]].shape);
    uint count = kept->count - kept->perturbations, at = 0;
    int rows_fall = lift->x[2] < 0.0f, columns_fall = lift->y[2] < 0.0f;
    while (at < count) {
        uint first = rows_fall ? kept->count - 1u - at : kept->perturbations + at, row = ray->nodes[kept->ids[first]].material, length = 1;
        while (at + length < count && ray->nodes[kept->ids[rows_fall ? first - length : first + length]].material == row) length++;
        uint low = rows_fall ? first - length + 1u : first;
        for (uint k = 0; k < length; k++) order[at + k] = (uchar)(columns_fall ? low + length - 1u - k : low + k);
        at += length;
    }
}

// Up to where from `t` on, before `end`, the same perturbations are on the ray.
static FLOAT lifting_stretch(const Lifting *kept, FLOAT t, FLOAT end)
{
    for (uint k = 0; k < kept->perturbations; k++) {
        FLOAT low = kept->lows[k], high = kept->highs[k];
        FLOAT next = low > t ? low : high > t ? high : end;
        end = least(end, next);
    }
    return end;
}

// The first place on the piece [low, high] of cell k at which F' is positive, or infinity; `from` is where the rays begin.
static FLOAT lifting_cell(const Lifting *kept, const Ray *ray, uint id, uint k, FLOAT from, FLOAT low, FLOAT high, INT in)
{
    __global const QuadricRecord *base = ray->records + id;
    FLOAT infinite = INFINITY;
    RayPlace l = ray_place(low), h = ray_place(high);
    FLOAT w0 = l.o - ray->kappa * l.w, w1 = h.o - ray->kappa * h.w;
    Bezier2 f = record_bezier(base, ray->u, ray->v, l, h);
    Bernstein sum;
    sum.c0 = sum.c1 = sum.c2 = sum.c3 = sum.c4 = sum.c5 = sum.c6 = 0.0f;
    if (kept->perturbations) lifting_perturb(kept, ray, id, low, high, l, h, in, &sum);
    add_base(&sum, f.a0, f.a1, f.a2, w0, w1);
    // Most are far from the surface, which the most that the cell adds tells for less than a tenth of what its polynomial takes.
    __global const CellBand *band = (__global const CellBand *)(ray->records + kept->ids[k] + 1);
    FLOAT w = band->most > 0.0f ? most(w0, w1) : least(w0, w1), w3 = w * w * w;
    FLOAT raised = band->most * (w3 * w3), top = bernstein_highest(&sum);
    in = in & (top + raised + 1e-5f * (size_of(raised) + size_of(top)) > 0.0f);
    if (!ANY(in)) return infinite;
    add_cell(&sum, ray, kept->ids[k], l, h, in);
    // As in freeform_next(): what is 0 as far as floats can tell is not yet positive.
    FLOAT tolerance = 2e-6f * bernstein_largest(&sum), none = 0.0f;
    INT known = low > from;
    sum.c0 = (!known & ((sum.c0 > tolerance) | (l.o == 0.0f))) ? sum.c0 : least(sum.c0, known ? -tolerance : none);
    FLOAT s = bernstein_first(&sum, in, ray->shadow);
    FLOAT o = (1.0f - s) * l.o + s * h.o;
    FLOAT place = ((1.0f - s) * l.w + s * h.w) / o;
    place = s == 0.0f ? low : most(least(place, high), low);
    return (in & (s <= 1.0f)) ? place : infinite;
}

// As lifting_next() with sign 1, for cells of one lift: cell by cell, so that each is looked at once for all rays of the packet. `begin` and `cells` are where
// the list has the perturbations.
static NOINLINE FLOAT lifting_first(const Lifting *kept, const Ray *ray, uint id, uint begin, uint cells, FLOAT t, FLOAT bound)
{
    FLOAT found = INFINITY, infinite = INFINITY;
    INT live = t < bound;
    uchar order[LIFTED_LIMIT];
    lifting_order(kept, ray, order);
    for (uint at = 0; at < kept->count - kept->perturbations; at++) {
        uint k = order[at];
        FLOAT low = most(kept->lows[k], t), high = least(kept->highs[k], bound);
        INT in = live & (low < high) & (low < found);
        while (ANY(in)) {
            FLOAT end = lifting_stretch(kept, low, high);
            FLOAT place = lifting_cell(kept, ray, id, k, t, low, end, in);
            found = (in & (place < found)) ? place : found;
            low = end;
            in = in & (low < high) & (low < found);
        }
        if (ray->shadow && !ANY(live & !(found < bound))) return found;
    }
    // Beside the cells there is the free form without them.
    FLOAT limit = live ? least(found, bound) : -infinite;
    FLOAT alone = freeform_first(ray, id, begin, cells, t, limit);
    for (;;) {
        FLOAT leaves = -infinite;
        for (uint k = kept->perturbations; k < kept->count; k++) {
            INT in = (kept->lows[k] <= alone) & (alone < kept->highs[k]);
            leaves = in ? kept->highs[k] : leaves;
        }
        INT again = (alone < limit) & (leaves > alone);
        if (!ANY(again)) break;
        FLOAT next = freeform_next(ray, id, begin, cells, leaves, again ? limit : -infinite, 1.0f, t != t);
        alone = again ? next : alone;
    }
    return least(found, alone < limit ? alone : infinite);
}

// As freeform_first(), which it is where no cell meets the packet.
INLINE FLOAT lifted_first(const Ray *ray, uint id, uint begin, uint stop, FLOAT t, FLOAT bound)
{
    if (begin == stop || !is_cell(ray, id, ray->list[stop - 1u])) return freeform_first(ray, id, begin, stop, t, bound);
    Lifting kept;
    lifting_find(&kept, ray, id, begin, stop, t, bound);
    uint cells = begin;
    while (!is_cell(ray, id, ray->list[cells])) cells++;
    if (kept.perturbations == kept.count) return freeform_first(ray, id, begin, cells, t, bound);
    if (lifting_is_single(&kept, ray)) return lifting_first(&kept, ray, id, begin, cells, t, bound);
    return lifting_next(&kept, ray, id, t, bound, 1.0f, t != t);
}

// As freeform_advance().
static FLOAT lifted_advance(const Ray *ray, uint id, uint begin, uint stop, Stretch *stretch, FLOAT t, FLOAT bound, float sign)
{
    INT stale = stretch_is_over(stretch, t, bound);
    if (ANY(stale)) {
        FLOAT limit = stale ? bound : (FLOAT)(-INFINITY);
        FLOAT entry = lifted_next(ray, id, begin, stop, t, limit, sign, stretch_ends_at(stretch, t));
        FLOAT end = lifted_next(ray, id, begin, stop, entry, limit, -sign, t == t);
        stretch_keep(stretch, stale, t, entry, end);
    }
    return most(t, stretch->begin);
}

// Adds the value and derivatives of W^6 z of a cell at w, in the lanes whose x and y are in it and that are not done; which those are.
INLINE INT add_cell_slope(Slope *f, const Ray *ray, uint id, FLOAT w, INT todo)
{
    __global const PlanNode *node = ray->nodes + id;
    __global const LiftRecord *lift = (__global const LiftRecord *)(ray->records + node->shape);
    __global const float *g = ((__global const CellRecord *)(ray->records + id))->points;
    LiftLine x = lift_line(lift->x, ray->u, ray->v), y = lift_line(lift->y, ray->u, ray->v), z = lift_line(lift->z, ray->u, ray->v);
    float n = lift->cells, kappa = ray->kappa;
    FLOAT scale = 1.0f - kappa * w;
    FLOAT a = (x.p + x.q * w) / scale, b = (y.p + y.q * w) / scale, c = (z.p + z.q * w) / scale;
    FLOAT s = n * a - (float)node->material, t = n * b - (float)node->object;
    // A root may be beside its cell by rounding: at the rim it belongs to the cell there.
    float near = 1e-4f * n;
    FLOAT s_low = node->material == 0u ? -near : 0.0f, s_high = (float)(node->material + 1u) == n ? 1.0f + near : 1.0f;
    FLOAT t_low = node->object == 0u ? -near : 0.0f, t_high = (float)(node->object + 1u) == n ? 1.0f + near : 1.0f;
    INT in = todo & (s >= s_low) & (s <= s_high) & (t >= t_low) & (t <= t_high) & (c >= lift->low) & (c <= lift->high);
    if (!ANY(in)) return in;
    FLOAT r = 1.0f - s, q = 1.0f - t;
    FLOAT value = 0.0f, by_s = 0.0f, by_t = 0.0f;
    FLOAT us[4] = {r * r * r, 3.0f * r * r * s, 3.0f * r * s * s, s * s * s};
    FLOAT ud[4] = {-3.0f * r * r, 3.0f * r * (r - 2.0f * s), 3.0f * s * (2.0f * r - s), 3.0f * s * s};
    FLOAT vs[4] = {q * q * q, 3.0f * q * q * t, 3.0f * q * t * t, t * t * t};
    FLOAT vd[4] = {-3.0f * q * q, 3.0f * q * (q - 2.0f * t), 3.0f * t * (2.0f * q - t), 3.0f * t * t};
    for (int k = 0; k < 4; k++) {
        FLOAT line = vs[0] * g[4 * k] + vs[1] * g[4 * k + 1] + vs[2] * g[4 * k + 2] + vs[3] * g[4 * k + 3];
        value += us[k] * line;
        by_s += ud[k] * line;
        by_t += us[k] * (vd[0] * g[4 * k] + vd[1] * g[4 * k + 1] + vd[2] * g[4 * k + 2] + vd[3] * g[4 * k + 3]);
    }
    FLOAT w2 = scale * scale, w4 = w2 * w2, w5 = w4 * scale;
    FLOAT along_x = n * by_s * w5, along_y = n * by_t * w5, zero = 0.0f;
    f->value += in ? value * w4 * w2 : zero;
    f->u += in ? along_x * lift->x[0] + along_y * lift->y[0] : zero;
    f->v += in ? along_x * lift->x[1] + along_y * lift->y[1] : zero;
    f->w += in ? along_x * (x.q + kappa * a) + along_y * (y.q + kappa * b) - 6.0f * kappa * w5 * value : zero;
    return in;
}

// Value and derivatives of W^6 F' at a place.
static Slope lifted_slope(const Ray *ray, uint id, uint begin, uint stop, FLOAT w)
{
    uint cells = begin;
    while (cells < stop && !is_cell(ray, id, ray->list[cells])) cells++;
    Slope f = freeform_slope(ray, id, begin, cells, w);
    INT todo = w == w;
    uint head = 0;
    for (uint k = cells; k < stop; k++) {
        uint item = ray->list[k];
        if (ray->nodes[item].shape != head) todo = w == w; // another lift
        head = ray->nodes[item].shape;
        INT in = add_cell_slope(&f, ray, item, w, todo);
        todo = todo & !in;
    }
    return f;
}
