// Free forms that patches lift: F' = F + sum of R + strength z(x, y), z a bicubic in each cell of a patch. W^6 z(x, y) is a polynomial of degree 6 in w along
// a ray, as all else is: so a cell is one more thing with a support, the stretch of the ray in which x and y are in the cell and z between the caps, and the
// Bernstein coefficients on the pieces between ends of supports tell for certain whether there is a root, as in freeform.cl.

#define LIFTED_LIMIT 64 // supports of a packet that are kept; those of more are found again for each piece

typedef struct Support {
    FLOAT low, high;
} Support;

// Where p + q w turns from negative to positive, as an end of a support: it bounds `low` where q > 0, else `high`.
INLINE void cut_support(Support *s, FLOAT p, FLOAT q)
{
    FLOAT none = INFINITY;
    FLOAT at = -p / q;
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

// The stretch of the ray in a cell. Neighbours share their ends, bit by bit.
INLINE Support cell_support(const Ray *ray, uint id)
{
    __global const PlanNode *node = ray->nodes + id;
    __global const LiftRecord *lift = (__global const LiftRecord *)(ray->records + node->shape);
    LiftLine x = lift_line(lift->x, ray->u, ray->v), y = lift_line(lift->y, ray->u, ray->v), z = lift_line(lift->z, ray->u, ray->v);
    float n = lift->cells, kappa = ray->kappa, i = (float)node->material, j = (float)node->object;
    Support s = {-INFINITY, INFINITY};
    cut_support(&s, n * x.p - i, n * x.q + i * kappa);
    cut_support(&s, -(n * x.p - (i + 1.0f)), -(n * x.q + (i + 1.0f) * kappa) + 0.0f * x.p);
    cut_support(&s, n * y.p - j, n * y.q + j * kappa);
    cut_support(&s, -(n * y.p - (j + 1.0f)), -(n * y.q + (j + 1.0f) * kappa) + 0.0f * y.p);
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

INLINE Support item_support(const Ray *ray, uint leaf, uint id)
{
    if (is_cell(ray, leaf, id)) return cell_support(ray, id);
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

// As freeform_next(), with cells in the list behind the perturbations.
NOINLINE FLOAT lifted_next(const Ray *ray, uint id, uint begin, uint stop, FLOAT t, FLOAT bound, float sign, INT known)
{
    FLOAT lows[LIFTED_LIMIT], highs[LIFTED_LIMIT];
    __global const QuadricRecord *base = ray->records + id;
    FLOAT u = ray->u, v = ray->v;
    Roots base_roots = record_roots(base, u, v);
    FLOAT found = INFINITY;
    INT live = t < bound;
    for (uint k = begin; k < stop && k - begin < LIFTED_LIMIT; k++) {
        Support s = item_support(ray, id, ray->list[k]);
        lows[k - begin] = s.low;
        highs[k - begin] = s.high;
    }
    while (ANY(live)) {
        // The piece [t, end] up to the next end of a support.
        FLOAT end = bound;
        for (uint k = begin; k < stop; k++) {
            Support s;
            if (k - begin < LIFTED_LIMIT) s = (Support){lows[k - begin], highs[k - begin]};
            else s = item_support(ray, id, ray->list[k]);
            FLOAT next = s.low > t ? s.low : s.high > t ? s.high : (FLOAT)(INFINITY);
            end = least(end, next);
        }
        RayPlace l = ray_place(t), h = ray_place(end);
        Bernstein sum;
        sum.c0 = sum.c1 = sum.c2 = sum.c3 = sum.c4 = sum.c5 = sum.c6 = 0.0f;
        INT active = t > end; // none
        for (uint k = begin; k < stop; k++) {
            uint item = ray->list[k];
            int cell = is_cell(ray, id, item);
            Support s;
            if (k - begin < LIFTED_LIMIT) s = (Support){lows[k - begin], highs[k - begin]};
            else s = item_support(ray, id, item);
            INT in = (!cell && ray->records[item].flags & RECORD_OUTSIDE) ? (end <= s.low) | (t >= s.high) : (s.low <= t) & (end <= s.high);
            in = in & live;
            if (!ANY(in)) continue;
            active = active | in;
            if (cell) {
                add_cell(&sum, ray, item, l, h, in);
            } else {
                Bezier2 a = record_bezier(ray->records + item, u, v, l, h);
                FLOAT zero = 0.0f;
                add_cube(&sum, in ? a.a0 : zero, in ? a.a1 : zero, in ? a.a2 : zero);
            }
        }
        // The base alone.
        FLOAT closed = sign > 0.0f ? quadric_enter(base_roots, base->flags, t) : quadric_leave(base_roots, base->flags, t);
        INT alone = live & !active;
        INT met = alone & (closed < end);
        found = met ? closed : found;
        live = live & !met;
        INT solve = live & active;
        if (ANY(solve)) {
            Bezier2 f = record_bezier(base, u, v, l, h);
            add_base(&sum, f.a0, f.a1, f.a2, l.o - ray->kappa * l.w, h.o - ray->kappa * h.w);
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

// As freeform_first(), which it is where no cell meets the packet.
INLINE FLOAT lifted_first(const Ray *ray, uint id, uint begin, uint stop, FLOAT t, FLOAT bound)
{
    if (begin == stop || !is_cell(ray, id, ray->list[stop - 1u])) return freeform_first(ray, id, begin, stop, t, bound);
    return lifted_next(ray, id, begin, stop, t, bound, 1.0f, t != t);
}

// As freeform_advance().
static FLOAT lifted_advance(const Ray *ray, uint id, uint begin, uint stop, Stretch *stretch, FLOAT t, FLOAT bound, float sign)
{
    INT stale = (t >= stretch->end) & (t < bound);
    if (ANY(stale)) {
        FLOAT limit = stale ? bound : (FLOAT)(-INFINITY);
        FLOAT entry = lifted_next(ray, id, begin, stop, t, limit, sign, (t == stretch->end) & (stretch->begin < INFINITY));
        FLOAT end = lifted_next(ray, id, begin, stop, entry, limit, -sign, t == t);
        FLOAT first = entry > t ? entry : (FLOAT)(-INFINITY);
        stretch->begin = stale ? first : stretch->begin;
        stretch->end = stale ? end : stretch->end;
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
