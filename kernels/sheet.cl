// Sheets: patches as surfaces. A ray is where p.x = U q and p.y = V q, q = 1 + kappa p.z, with p the place in the view: two bicubics a(s, t) and b(s, t) in
// each cell that are 0 together. Their Bezier points bound them: where those of one have one sign, the ray passes by, for certain. What is left is
// searched ray by ray, by Krawczyk's test in boxes of (s, t): it says for certain that there is no root in a box, or exactly one, to which the same
// step then leads; else the box is halved.

#define SHEET_DEPTH 32 // boxes that wait

typedef struct SheetBox {
    float s0, s1, t0, t1;
} SheetBox;

// What holds for a bicubic on a part of its cell: value and slopes at the middle, and the slopes' bounds.
typedef struct SheetPart {
    float value, by_s, by_t;
    float low, high;
    float s_low, s_high, t_low, t_high;
} SheetPart;

// Bezier points of a cubic on [x0, x1], by its polar form.
static void sheet_cubic(const float *g, int step, float x0, float x1, float *r)
{
    float y0 = 1.0f - x0, y1 = 1.0f - x1;
    float p0 = y0 * g[0] + x0 * g[step], p1 = y0 * g[step] + x0 * g[2 * step], p2 = y0 * g[2 * step] + x0 * g[3 * step];
    float q0 = y1 * g[0] + x1 * g[step], q1 = y1 * g[step] + x1 * g[2 * step], q2 = y1 * g[2 * step] + x1 * g[3 * step];
    float pp0 = y0 * p0 + x0 * p1, pp1 = y0 * p1 + x0 * p2, pq0 = y1 * p0 + x1 * p1, pq1 = y1 * p1 + x1 * p2, qq0 = y1 * q0 + x1 * q1, qq1 = y1 * q1 + x1 * q2;
    r[0] = y0 * pp0 + x0 * pp1;
    r[step] = y1 * pp0 + x1 * pp1;
    r[2 * step] = y1 * pq0 + x1 * pq1;
    r[3 * step] = y1 * qq0 + x1 * qq1;
}

static SheetPart sheet_part(const float *points, SheetBox box)
{
    float rows[16], g[16];
    for (int k = 0; k < 4; k++) sheet_cubic(points + 4 * k, 1, box.t0, box.t1, rows + 4 * k);
    for (int l = 0; l < 4; l++) sheet_cubic(rows + l, 4, box.s0, box.s1, g + l);
    SheetPart part = {0, 0, 0, INFINITY, -INFINITY, INFINITY, -INFINITY, INFINITY, -INFINITY};
    float along_s = 3.0f / (box.s1 - box.s0), along_t = 3.0f / (box.t1 - box.t0);
    const float middle[4] = {0.125f, 0.375f, 0.375f, 0.125f}, slope[4] = {-0.75f, -0.75f, 0.75f, 0.75f};
    for (int k = 0; k < 4; k++)
        for (int l = 0; l < 4; l++) {
            float value = g[4 * k + l];
            part.value += middle[k] * middle[l] * value;
            part.by_s += slope[k] * middle[l] * value;
            part.by_t += middle[k] * slope[l] * value;
            part.low = min(part.low, value);
            part.high = max(part.high, value);
            if (k < 3) {
                float d = along_s * (g[4 * k + 4 + l] - value);
                part.s_low = min(part.s_low, d);
                part.s_high = max(part.s_high, d);
            }
            if (l < 3) {
                float d = along_t * (g[4 * k + l + 1] - value);
                part.t_low = min(part.t_low, d);
                part.t_high = max(part.t_high, d);
            }
        }
    part.by_s /= box.s1 - box.s0;
    part.by_t /= box.t1 - box.t0;
    return part;
}

static float sheet_at(const float *g, float s, float t, float *by_s, float *by_t)
{
    float r = 1.0f - s, q = 1.0f - t, value = 0.0f;
    const float us[4] = {r * r * r, 3.0f * r * r * s, 3.0f * r * s * s, s * s * s};
    const float ud[4] = {-3.0f * r * r, 3.0f * r * (r - 2.0f * s), 3.0f * s * (2.0f * r - s), 3.0f * s * s};
    const float vs[4] = {q * q * q, 3.0f * q * q * t, 3.0f * q * t * t, t * t * t};
    const float vd[4] = {-3.0f * q * q, 3.0f * q * (q - 2.0f * t), 3.0f * t * (2.0f * q - t), 3.0f * t * t};
    *by_s = *by_t = 0.0f;
    for (int k = 0; k < 4; k++) {
        float line = vs[0] * g[4 * k] + vs[1] * g[4 * k + 1] + vs[2] * g[4 * k + 2] + vs[3] * g[4 * k + 3];
        value += us[k] * line;
        *by_s += ud[k] * line;
        *by_t += us[k] * (vd[0] * g[4 * k] + vd[1] * g[4 * k + 1] + vd[2] * g[4 * k + 2] + vd[3] * g[4 * k + 3]);
    }
    return value;
}

// One ray in one cell, and its best root so far: the first that is not before `from`, or, with `target`, the one whose w is nearest to it.
typedef struct SheetSearch {
    const float *x, *y, *z; // of the cell's points
    float a[16], b[16];
    float kappa, from, target;
    int targeted;
    float best, s, t; // best: w, or the distance to the target
} SheetSearch;

static void sheet_found(SheetSearch *search, float s, float t)
{
    float unused1, unused2;
    float z = sheet_at(search->z, s, t, &unused1, &unused2);
    float w = z / (1.0f + search->kappa * z);
    float rank = search->targeted ? fabs(w - search->target) : w;
    if ((!search->targeted && w < search->from) || !(rank < search->best)) return;
    search->best = rank;
    search->s = s;
    search->t = t;
}

// Newton's steps from the middle of a box that holds one root.
static void sheet_polish(SheetSearch *search, SheetBox box)
{
    float s = 0.5f * (box.s0 + box.s1), t = 0.5f * (box.t0 + box.t1);
    for (int step = 0; step < 6; step++) {
        float as, at, bs, bt;
        float a = sheet_at(search->a, s, t, &as, &at), b = sheet_at(search->b, s, t, &bs, &bt);
        float det = as * bt - at * bs;
        if (det == 0.0f) break;
        float ds = (a * bt - b * at) / det, dt = (b * as - a * bs) / det;
        s = clamp(s - ds, box.s0, box.s1);
        t = clamp(t - dt, box.t0, box.t1);
        if (fabs(ds) + fabs(dt) < 1e-7f) break;
    }
    sheet_found(search, s, t);
}

// The size of m times an interval [low, high] minus one, for each of the four entries of Y J - I.
static float sheet_spread(float y0, float low0, float high0, float y1, float low1, float high1, float one)
{
    float low = min(y0 * low0, y0 * high0) + min(y1 * low1, y1 * high1) - one;
    float high = max(y0 * low0, y0 * high0) + max(y1 * low1, y1 * high1) - one;
    return max(-low, high);
}

// Narrows the box: 0 there is no root in it, 1 it is narrowed and may hold some, 2 it holds exactly one.
static int sheet_krawczyk(const SheetSearch *search, SheetBox *box)
{
    SheetPart a = sheet_part(search->a, *box), b = sheet_part(search->b, *box);
    if (a.low > 0.0f || a.high < 0.0f || b.low > 0.0f || b.high < 0.0f) return 0;
    float det = a.by_s * b.by_t - a.by_t * b.by_s;
    float size = fabs(a.by_s * b.by_t) + fabs(a.by_t * b.by_s);
    if (!(fabs(det) > 1e-5f * size)) return 1;
    float y00 = b.by_t / det, y01 = -a.by_t / det, y10 = -b.by_s / det, y11 = a.by_s / det;
    float rs = 0.5f * (box->s1 - box->s0), rt = 0.5f * (box->t1 - box->t0), ms = box->s0 + rs, mt = box->t0 + rt;
    float e00 = sheet_spread(y00, a.s_low, a.s_high, y01, b.s_low, b.s_high, 1.0f), e01 = sheet_spread(y00, a.t_low, a.t_high, y01, b.t_low, b.t_high, 0.0f);
    float e10 = sheet_spread(y10, a.s_low, a.s_high, y11, b.s_low, b.s_high, 0.0f), e11 = sheet_spread(y10, a.t_low, a.t_high, y11, b.t_low, b.t_high, 1.0f);
    float cs = ms - (y00 * a.value + y01 * b.value), ct = mt - (y10 * a.value + y11 * b.value);
    float ws = e00 * rs + e01 * rt + 1e-6f, wt = e10 * rs + e11 * rt + 1e-6f;
    if (cs + ws < box->s0 || cs - ws > box->s1 || ct + wt < box->t0 || ct - wt > box->t1) return 0;
    int one = e00 + e01 < 1.0f && e10 + e11 < 1.0f && cs - ws > box->s0 && cs + ws < box->s1 && ct - wt > box->t0 && ct + wt < box->t1;
    SheetBox cut = {max(box->s0, cs - ws), min(box->s1, cs + ws), max(box->t0, ct - wt), min(box->t1, ct + wt)};
    // A box at the rim of the cell never holds the root with room on all sides: where it is regular there is at most one root.
    if (!one && e00 + e01 < 1.0f && e10 + e11 < 1.0f && (cut.s1 - cut.s0) + (cut.t1 - cut.t0) < 1e-5f) one = 1;
    *box = cut;
    return one ? 2 : 1;
}

static void sheet_search(SheetSearch *search)
{
    SheetBox stack[SHEET_DEPTH];
    int count = 1;
    stack[0] = (SheetBox){0.0f, 1.0f, 0.0f, 1.0f};
    while (count) {
        SheetBox box = stack[--count];
        float before = (box.s1 - box.s0) + (box.t1 - box.t0);
        int answer = sheet_krawczyk(search, &box);
        if (answer == 0) continue;
        float after = (box.s1 - box.s0) + (box.t1 - box.t0);
        if (answer == 2 || after < 4e-6f || count + 2 > SHEET_DEPTH) { // as small as floats tell places apart: the surface is met there, or touched
            sheet_polish(search, box);
        } else if (after < 0.7f * before) {
            stack[count++] = box;
        } else if (box.s1 - box.s0 > box.t1 - box.t0) {
            float middle = 0.5f * (box.s0 + box.s1);
            stack[count++] = (SheetBox){box.s0, middle, box.t0, box.t1};
            stack[count++] = (SheetBox){middle, box.s1, box.t0, box.t1};
        } else {
            float middle = 0.5f * (box.t0 + box.t1);
            stack[count++] = (SheetBox){box.s0, box.s1, box.t0, middle};
            stack[count++] = (SheetBox){box.s0, box.s1, middle, box.t1};
        }
    }
}

// Which rays may meet the cell: those whose a and b have no sign of their own among the points.
INLINE INT sheet_near(const Ray *ray, __global const CellRecord *cell)
{
    FLOAT a_low = INFINITY, a_high = -INFINITY, b_low = INFINITY, b_high = -INFINITY;
    for (int k = 0; k < 16; k++) {
        float q = 1.0f + ray->kappa * cell[2].points[k];
        FLOAT a = cell[0].points[k] - q * ray->u, b = cell[1].points[k] - q * ray->v;
        a_low = least(a_low, a);
        a_high = most(a_high, a);
        b_low = least(b_low, b);
        b_high = most(b_high, b);
    }
    return (a_low <= 0.0f) & (a_high >= 0.0f) & (b_low <= 0.0f) & (b_high >= 0.0f);
}

#if WIDTH == 1
#define SHEET_LANE(vector, lane) (vector)
#else
#define SHEET_LANE(vector, lane) (((const float *)&(vector))[lane])
#endif

static void sheet_prepare(SheetSearch *search, const Ray *ray, __global const CellRecord *cell, float *points, float u, float v)
{
    for (int k = 0; k < 16; k++) {
        float x = cell[0].points[k], y = cell[1].points[k], z = cell[2].points[k];
        float q = 1.0f + ray->kappa * z;
        points[k] = x;
        points[16 + k] = y;
        points[32 + k] = z;
        search->a[k] = x - u * q;
        search->b[k] = y - v * q;
    }
    search->x = points;
    search->y = points + 16;
    search->z = points + 32;
    search->kappa = ray->kappa;
}

// The first place from t on, before the bound, at which the rays meet the cells ray->list[begin .. stop); infinity where there is none.
NOINLINE FLOAT sheet_next(const Ray *ray, uint begin, uint stop, FLOAT t, FLOAT bound)
{
    float found[LANES], points[48];
    for (int lane = 0; lane < LANES; lane++) found[lane] = INFINITY;
    FLOAT u = ray->u, v = ray->v;
    for (uint k = begin; k < stop; k++) {
        __global const CellRecord *cell = (__global const CellRecord *)(ray->records + ray->list[k]);
        INT near = sheet_near(ray, cell) & (t < bound);
        if (!ANY(near)) continue;
        FLOAT flags = near ? (FLOAT)(1.0f) : (FLOAT)(0.0f);
        for (int lane = 0; lane < LANES; lane++) {
            if (SHEET_LANE(flags, lane) == 0.0f) continue;
            SheetSearch search = {.from = SHEET_LANE(t, lane), .best = min(found[lane], SHEET_LANE(bound, lane))};
            sheet_prepare(&search, ray, cell, points, SHEET_LANE(u, lane), SHEET_LANE(v, lane));
            float before = search.best;
            sheet_search(&search);
            if (search.best < before) found[lane] = search.best;
        }
    }
    FLOAT result;
    for (int lane = 0; lane < LANES; lane++) ((float *)&result)[lane] = found[lane];
    return result;
}

// For set operations: keeps the place that was found last. A sheet has no inside, so it is left at once.
INLINE FLOAT sheet_enter(const Ray *ray, uint id, uint begin, uint stop, Stretch *stretch, FLOAT t, FLOAT bound)
{
    INT stale = ((t > stretch->end) | (stretch->begin > stretch->end)) & (t < bound); // at first nothing is found
    if (ANY(stale)) {
        FLOAT place = sheet_next(ray, begin, stop, t, stale ? bound : (FLOAT)(-INFINITY));
        stretch->begin = stale ? place : stretch->begin;
        stretch->end = stale ? place : stretch->end;
    }
    return most(t, stretch->begin);
}

INLINE FLOAT sheet_leave(const Ray *ray, uint id, uint begin, uint stop, Stretch *stretch, FLOAT t, FLOAT bound)
{
    return t;
}

// The slope of the surface at w, as that of a function: across x_s and x_t.
static Slope sheet_slope(const Ray *ray, uint begin, uint stop, INT mine, FLOAT w)
{
    float gx[LANES], gy[LANES], gz[LANES], best[LANES], points[48];
    for (int lane = 0; lane < LANES; lane++) {
        gx[lane] = gy[lane] = 0.0f;
        gz[lane] = 1.0f;
        best[lane] = INFINITY;
    }
    FLOAT u = ray->u, v = ray->v;
    for (uint k = begin; k < stop; k++) {
        __global const CellRecord *cell = (__global const CellRecord *)(ray->records + ray->list[k]);
        INT near = sheet_near(ray, cell) & mine;
        if (!ANY(near)) continue;
        FLOAT flags = near ? (FLOAT)(1.0f) : (FLOAT)(0.0f);
        for (int lane = 0; lane < LANES; lane++) {
            if (SHEET_LANE(flags, lane) == 0.0f) continue;
            SheetSearch search = {.target = SHEET_LANE(w, lane), .targeted = 1, .best = best[lane]};
            sheet_prepare(&search, ray, cell, points, SHEET_LANE(u, lane), SHEET_LANE(v, lane));
            sheet_search(&search);
            if (!(search.best < best[lane])) continue;
            best[lane] = search.best;
            float xs, xt, ys, yt, zs, zt;
            sheet_at(search.x, search.s, search.t, &xs, &xt);
            sheet_at(search.y, search.s, search.t, &ys, &yt);
            sheet_at(search.z, search.s, search.t, &zs, &zt);
            gx[lane] = ys * zt - zs * yt;
            gy[lane] = zs * xt - xs * zt;
            gz[lane] = xs * yt - ys * xt;
        }
    }
    FLOAT x, y, z;
    for (int lane = 0; lane < LANES; lane++) {
        float size = max(max(fabs(gx[lane]), fabs(gy[lane])), max(fabs(gz[lane]), 1e-30f));
        ((float *)&x)[lane] = gx[lane] / size;
        ((float *)&y)[lane] = gy[lane] / size;
        ((float *)&z)[lane] = gz[lane] / size;
    }
    float kappa = ray->kappa;
    FLOAT scale = 1.0f - kappa * w;
    Slope slope;
    slope.value = 0.0f;
    slope.u = x;
    slope.v = y;
    slope.w = (z + kappa * (u * x + v * y)) / scale;
    return slope;
}
