// Free forms F' = F + sum of s most(Q, 0)^3 along a ray. In screen coordinates and multiplied by W^6 it is W^4 F + sum of R, each a polynomial in w, and
// between the ends of supports one polynomial of degree <= 6: its Bernstein coefficients on such a piece tell exactly whether and where it is first positive.

// Adds W^4 F on a piece: f0, f1, f2 the Bezier values of F, p and q the W at its ends.
INLINE void add_base(Bernstein *sum, FLOAT f0, FLOAT f1, FLOAT f2, FLOAT p, FLOAT q)
{
    FLOAT p2 = p * p, q2 = q * q, pq = p * q;
    FLOAT e0 = p2 * p2, e1 = p2 * pq, e2 = p2 * q2, e3 = pq * q2, e4 = q2 * q2;
    sum->c0 += f0 * e0;
    sum->c1 += (2.0f / 3.0f) * (f0 * e1) + (1.0f / 3.0f) * (f1 * e0);
    sum->c2 += 0.4f * (f0 * e2) + (8.0f / 15.0f) * (f1 * e1) + (1.0f / 15.0f) * (f2 * e0);
    sum->c3 += 0.2f * (f0 * e3 + f2 * e1) + 0.6f * (f1 * e2);
    sum->c4 += 0.4f * (f2 * e2) + (8.0f / 15.0f) * (f1 * e3) + (1.0f / 15.0f) * (f0 * e4);
    sum->c5 += (2.0f / 3.0f) * (f2 * e3) + (1.0f / 3.0f) * (f1 * e4);
    sum->c6 += f2 * e4;
}

// The same where W is 1, for parallel rays.
INLINE void add_parallel_base(Bernstein *sum, FLOAT f0, FLOAT f1, FLOAT f2)
{
    sum->c0 += f0;
    sum->c1 += (2.0f / 3.0f) * f0 + (1.0f / 3.0f) * f1;
    sum->c2 += 0.4f * f0 + (8.0f / 15.0f) * f1 + (1.0f / 15.0f) * f2;
    sum->c3 += 0.2f * (f0 + f2) + 0.6f * f1;
    sum->c4 += 0.4f * f2 + (8.0f / 15.0f) * f1 + (1.0f / 15.0f) * f0;
    sum->c5 += (2.0f / 3.0f) * f2 + (1.0f / 3.0f) * f1;
    sum->c6 += f2;
}

// Adds the cube of the quadratic with Bezier values a0, a1, a2.
INLINE void add_cube(Bernstein *sum, FLOAT a0, FLOAT a1, FLOAT a2)
{
    FLOAT s0 = a0 * a0, s1 = a1 * a1, s2 = a2 * a2;
    sum->c0 += s0 * a0;
    sum->c1 += s0 * a1;
    sum->c2 += a0 * (0.2f * (a0 * a2) + 0.8f * s1);
    sum->c3 += a1 * (0.6f * (a0 * a2) + 0.4f * s1);
    sum->c4 += a2 * (0.2f * (a0 * a2) + 0.8f * s1);
    sum->c5 += s2 * a1;
    sum->c6 += s2 * a2;
}

// A place on a ray as w / o: o = 0 is infinitely far, or the eye.
typedef struct RayPlace {
    FLOAT w, o;
} RayPlace;

static RayPlace ray_place(FLOAT t)
{
    RayPlace place;
    INT first = t < -BIG;
    INT last = t > BIG;
    place.w = first ? (FLOAT)(-1.0f) : last ? (FLOAT)(1.0f) : t;
    place.o = (first | last) ? (FLOAT)(0.0f) : (FLOAT)(1.0f);
    return place;
}

typedef struct Bezier2 {
    FLOAT a0, a1, a2;
} Bezier2;

// The Bezier values of W² Q between two places: its polar form.
static Bezier2 record_bezier(__global const QuadricRecord *r, FLOAT u, FLOAT v, RayPlace l, RayPlace h)
{
    Bezier2 a;
    if (r->flags & RECORD_PLANES) {
        FLOAT p = record_plane(r->t0, r->tu, r->tv, u, v);
        FLOAT q = record_plane(r->h0, r->d, r->e, u, v);
        FLOAT pl = r->lead * (l.w - p * l.o), ph = r->lead * (h.w - p * h.o), ql, qh;
        if (r->flags & RECORD_HALF) ql = l.o - r->a * l.w, qh = h.o - r->a * h.w;
        else ql = l.w - q * l.o, qh = h.w - q * h.o;
        a.a0 = pl * ql;
        a.a1 = 0.5f * (pl * qh + ph * ql);
        a.a2 = ph * qh;
    } else if (r->flags & RECORD_GENERAL) {
        FLOAT beta = record_beta(r, u, v);
        FLOAT q = record_q(r, u, v);
        a.a0 = l.w * (r->lead * l.w - 2.0f * beta * l.o) + q * l.o * l.o;
        a.a1 = r->lead * l.w * h.w - beta * (l.w * h.o + h.w * l.o) + q * l.o * h.o;
        a.a2 = h.w * (r->lead * h.w - 2.0f * beta * h.o) + q * h.o * h.o;
    } else {
        FLOAT du = u - r->uc;
        FLOAT dv = v - r->vc;
        FLOAT tm = record_tm(r, du, dv);
        FLOAT h2 = record_h2(r, du, dv);
        FLOAT dl = l.w - tm * l.o, dh = h.w - tm * h.o;
        a.a0 = r->lead * (dl * dl - h2 * l.o * l.o);
        a.a1 = r->lead * (dl * dh - h2 * l.o * h.o);
        a.a2 = r->lead * (dh * dh - h2 * h.o * h.o);
    }
    return a;
}

#if WIDTH > 1
#define ACTIVE_LIMIT 96 // perturbations that meet one packet; more of them take the slower way
#endif

// The supports that a packet meets between two places, and where. For packets of 1, and where there are more than ACTIVE_LIMIT: all of the list, found again
// each time they are asked for, so that what a ray takes grows with their square.
typedef struct Supports {
    uint begin, count;
    int all, wide; // wide: some of them may reach far beyond what is looked at
#if WIDTH > 1
    uint ids[ACTIVE_LIMIT];
    Roots roots[ACTIVE_LIMIT];
#endif
} Supports;

static void supports_find(Supports *supports, const Ray *ray, uint begin, uint stop, FLOAT t, FLOAT bound)
{
    supports->begin = begin;
    supports->count = stop - begin;
    supports->all = supports->wide = 1;
#if WIDTH > 1
    int wide = 0;
    uint count = 0;
    for (uint k = begin; k < stop; k++) {
        __global const QuadricRecord *record = ray->records + ray->list[k];
        Roots r = record_roots(record, ray->u, ray->v);
        INT meets = record->flags & RECORD_OUTSIDE ? (r.r0 > t) | (r.r1 < bound) : (r.r0 < bound) & (r.r1 > t);
        if (!ANY(meets & (t < bound))) continue;
        if (record->flags & RECORD_OUTSIDE || ANY(meets & ((r.r0 < -8.0f) | (r.r1 > 8.0f)))) wide = 1;
        if (count == ACTIVE_LIMIT) return;
        supports->ids[count] = ray->list[k];
        supports->roots[count++] = r;
    }
    supports->count = count;
    supports->all = 0;
    supports->wide = wide;
#endif
}

static __global const QuadricRecord *supports_get(const Supports *supports, const Ray *ray, uint k, Roots *roots)
{
#if WIDTH > 1
    if (!supports->all) {
        *roots = supports->roots[k];
        return ray->records + supports->ids[k];
    }
#endif
    __global const QuadricRecord *record = ray->records + ray->list[supports->begin + k];
    *roots = record_roots(record, ray->u, ray->v);
    return record;
}

// Where a piece that begins at t ends at the latest, if supports are wide: 1 or 8 or 64 … from what is looked at. On a long piece the surface would weigh
// nothing beside what is far away: R grows with the sixth power of the distance, and without an end a millionth of W^6 F' is left at a tenth of the way.
static FLOAT piece_cut(FLOAT t)
{
    FLOAT cut = INFINITY;
    for (float far = 4096.0f; far > 0.5f; far *= 0.125f) cut = t < far ? (FLOAT)(far) : cut;
    for (float far = 1.0f; far < 5000.0f; far *= 8.0f) cut = t < -far ? (FLOAT)(-far) : cut;
    return cut;
}

// Value and derivatives of W^6 F' at a place.
INLINE Slope freeform_slope(const Ray *ray, uint id, uint begin, uint stop, FLOAT w)
{
    Slope f = record_slope(ray->records + id, ray->u, ray->v, w);
    FLOAT p = 1.0f - ray->kappa * w;
    FLOAT p3 = p * p * p;
    FLOAT p4 = p3 * p;
    f.w = f.w * p4 - 4.0f * ray->kappa * p3 * f.value;
    f.u *= p4;
    f.v *= p4;
    f.value *= p4;
    FLOAT zero = 0.0f;
    for (uint k = begin; k < stop; k++) {
        __global const QuadricRecord *r = ray->records + ray->list[k];
        Slope q = record_slope(r, ray->u, ray->v, w);
        // The factor's sign is the strength's; inside the support the value has that of -lead between the roots, of lead outside.
        INT in = q.value * (r->flags & RECORD_OUTSIDE ? r->lead : -r->lead) > 0.0f;
        FLOAT square = in ? q.value * q.value : zero;
        f.value += square * q.value;
        f.u += 3.0f * square * q.u;
        f.v += 3.0f * square * q.v;
        f.w += 3.0f * square * q.w;
    }
    return f;
}

// A root of a piece whose coefficients are much larger than the base there: what they have lost is found again by Newton's steps on F' itself, which are
// exact about perturbations that are small at the root. Only for free forms with perturbations that are as strong (RECORD_STRONG): of scenes of narrow ones
// up to 10,000 times as strong as what they change, 0.03 % of the rays were off by up to 2.7e-4 of the size without it, and are by 2.8e-6 with it.
#define POLISH_STEPS 24
static NOINLINE FLOAT freeform_polish(const Ray *ray, uint id, uint begin, uint stop, FLOAT w, INT rough)
{
    FLOAT size = 1.0f + size_of(w);
    // Near the rim of a support a step goes only a third of the way, as at a triple root.
    for (int step = 0; step < POLISH_STEPS && ANY(rough); step++) {
        Slope f = freeform_slope(ray, id, begin, stop, w);
        FLOAT move = f.value / f.w;
        rough = rough & (size_of(move) <= 2e-3f * size);
        w = rough ? w - move : w;
        rough = rough & (size_of(move) > 1e-7f * size);
    }
    return w;
}

// The first place from t on, before the bound, at which sign * F' turns positive: t itself if it is so there, unless it is known that it is not (the
// place is a root, where floats give either sign). Infinity (or anything from the bound on) if there is none. Any base, any strength, any support. The
// perturbations are ray->list[begin .. stop). Written to be right; freeform_first() below is for speed.
static NOINLINE FLOAT freeform_next(const Ray *ray, uint id, uint begin, uint stop, FLOAT t, FLOAT bound, float sign, INT known)
{
    __global const QuadricRecord *base = ray->records + id;
    FLOAT u = ray->u, v = ray->v;
    Roots base_roots = record_roots(base, u, v);
    FLOAT found = INFINITY;
    INT live = t < bound;
    Supports supports;
    supports_find(&supports, ray, begin, stop, t, bound);
    while (ANY(live)) {
        // The piece [t, end] up to the next end of a support.
        FLOAT end = bound;
        for (uint k = 0; k < supports.count; k++) {
            Roots r;
            supports_get(&supports, ray, k, &r);
            FLOAT next = r.r0 > t ? r.r0 : r.r1 > t ? r.r1 : (FLOAT)(INFINITY);
            end = least(end, next);
        }
        if (supports.wide) end = least(end, piece_cut(t));
        RayPlace l = ray_place(t), h = ray_place(end);
        Bernstein sum;
        sum.c0 = sum.c1 = sum.c2 = sum.c3 = sum.c4 = sum.c5 = sum.c6 = 0.0f;
        INT active = t > end; // none
        for (uint k = 0; k < supports.count; k++) {
            Roots r;
            __global const QuadricRecord *record = supports_get(&supports, ray, k, &r);
            INT in = record->flags & RECORD_OUTSIDE ? (end <= r.r0) | (t >= r.r1) : (r.r0 <= t) & (end <= r.r1);
            if (!ANY(in & live)) continue;
            active = active | in;
            Bezier2 a = record_bezier(record, u, v, l, h);
            FLOAT zero = 0.0f;
            add_cube(&sum, in ? a.a0 : zero, in ? a.a1 : zero, in ? a.a2 : zero);
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
            // A value that is 0 as far as floats can tell is not yet positive, and is no root that could be found again. At the eye, or
            // infinitely far, it may be small, but its sign is right.
            FLOAT tolerance = 2e-6f * bernstein_largest(&sum);
            Bernstein b = {sign * sum.c0, sign * sum.c1, sign * sum.c2, sign * sum.c3, sign * sum.c4, sign * sum.c5, sign * sum.c6};
            FLOAT none = 0.0f;
            b.c0 = (!known & ((b.c0 > tolerance) | (l.o == 0.0f))) ? b.c0 : least(b.c0, known ? -tolerance : none);
            FLOAT s = bernstein_first(&b, solve, 0);
            INT hit = solve & (s <= 1.0f);
            FLOAT o = (1.0f - s) * l.o + s * h.o;
            FLOAT w = ((1.0f - s) * l.w + s * h.w) / o;
            w = s == 0.0f ? t : most(least(w, end), t);
            if (base->flags & RECORD_STRONG) w = most(least(freeform_polish(ray, id, begin, stop, w, hit & (s > 0.0f)), end), t);
            found = hit ? w : found;
            live = live & !hit;
        }
        t = end;
        known = t == t;
        live = live & (t < bound);
    }
    return found;
}

#if WIDTH > 1
INLINE FLOAT closed_h2(__global const QuadricRecord *r, FLOAT du, FLOAT dv)
{
    FLOAT h2 = centred_h2(r, du, dv);
    if (!(r->flags & RECORD_CENTRED)) h2 += r->d * du + r->e * dv;
    return h2;
}

// What is known of a perturbation that meets a packet: where its support begins and ends (between them, or if its record says so before and after them), and
// two numbers of its record there: tm and h2, or beta and q.
typedef struct Kept {
    FLOAT low, high, middle, square;
} Kept;

// Fills `kept` of a perturbation of any kind. What adds to its free form moves *first and *far to where it begins and ends; 0 if that is not near.
static NOINLINE int keep_any(Kept *kept, __global const QuadricRecord *r, const Ray *ray, const FLOAT *from, const FLOAT *to,
                             FLOAT *first, FLOAT *far)
{
    FLOAT u = ray->u, v = ray->v, start = *from, limit = *to;
    int outside = (r->flags & RECORD_OUTSIDE) != 0, general = (r->flags & RECORD_GENERAL) != 0;
    Roots roots = record_roots(r, u, v);
    FLOAT du = u - r->uc, dv = v - r->vc;
    *kept = (Kept){roots.r0, roots.r1, general ? record_beta(r, u, v) : record_tm(r, du, dv),
                   general ? record_q(r, u, v) : record_h2(r, du, dv)};
    if ((r->lead < 0.0f) == outside) return 1; // a negative strength
    INT used = (roots.r0 < limit) & (roots.r1 > start);
    if (outside || ANY(used & ((roots.r0 == -INFINITY) | (roots.r1 == INFINITY)))) return 0;
    *first = least(*first, used ? roots.r0 : *first);
    *far = most(*far, used ? roots.r1 : *far);
    return 1;
}

// As freeform_next() with sign 1 for rays that begin outside of a closed base: what is seen of free forms from outside. Keeps what it learnt of each
// perturbation that meets the packet. Answers 0 where that does not hold, and the caller takes freeform_next().
//
// Packets go into calls by their addresses: as arguments they would be copied by halves, and reading them whole waits for that (4 % of a frame of S1).
//
// Out of line: within the loop over packets its variables would fight with others for registers (5 % of a frame of S1, S2), and twice as many of its
// kind would take 0.15 s more to compile.
static NOINLINE int freeform_fast(const Ray *ray, uint id, uint begin, uint stop, const FLOAT *from, const FLOAT *to, FLOAT *answer)
{
    FLOAT start = *from, bound = *to;
    Kept kept[ACTIVE_LIMIT];
    float leads[ACTIVE_LIMIT];
    uint flags[ACTIVE_LIMIT], all_flags = 0;
    __global const QuadricRecord *base = ray->records + id;
    if (base->flags & (RECORD_GENERAL | RECORD_OUTSIDE | RECORD_STEEP)) return 0;

    FLOAT u = ray->u, v = ray->v;
    FLOAT base_tm, base_h2, entry, leaves;
    if (base->flags & RECORD_PLANES) {
        Roots roots = record_roots(base, u, v);
        entry = roots.r0, leaves = roots.r1;
        base_tm = 0.5f * (entry + leaves);
        base_h2 = 0.25f * (leaves - entry) * (leaves - entry);
    } else {
        FLOAT base_du = u - base->uc, base_dv = v - base->vc;
        base_h2 = closed_h2(base, base_du, base_dv);
        base_tm = record_tm(base, base_du, base_dv);
        FLOAT base_h = root(base_h2);
        entry = base_tm - base_h, leaves = base_tm + base_h;
    }
    INT meets = base_h2 > 0.0f;
    entry = meets ? entry : (FLOAT)(INFINITY);
    leaves = meets ? leaves : (FLOAT)(INFINITY);
    if (ANY((entry <= start) & (leaves > start) & (start < bound))) return 0;
    entry = entry > start ? entry : (FLOAT)(INFINITY);

    // Where all strengths are positive the base's own entry ends the search; where all are negative there is nothing before it, and nothing behind the base.
    int is_signed = (base->flags & RECORD_SIGNED) != 0;
    FLOAT limit = is_signed ? bound : least(bound, entry);
    FLOAT t = is_signed ? entry : (FLOAT)(INFINITY);
    if (is_signed && !(base->flags & RECORD_GROWS)) {
        limit = entry < bound ? least(bound, leaves) : (FLOAT)(-INFINITY);
        start = most(start, entry);
    }
    if (ray->shadow && !is_signed) limit = entry < bound ? start : limit;
    FLOAT far = meets ? leaves : (FLOAT)(-INFINITY), peaks = 0.0f;
    uint count = 0;
    for (uint k = begin; k < stop; k++) {
        __global const QuadricRecord *r = ray->records + ray->list[k];
        if (!ANY(limit > r->w_low)) continue;
        if (r->flags & (RECORD_GENERAL | RECORD_OUTSIDE)) {
            if (!is_signed || count == ACTIVE_LIMIT) return 0;
            // Copies: what a call can reach stays in memory.
            FLOAT begins = start, ends = limit, first = t, last = far;
            if (!keep_any(kept + count, r, ray, &begins, &ends, &first, &last)) return 0;
            t = first;
            far = last;
            all_flags |= r->flags;
            leads[count] = r->lead;
            flags[count++] = r->flags;
            continue;
        }
        FLOAT du = u - r->uc, dv = v - r->vc;
        FLOAT h2 = closed_h2(r, du, dv);
        FLOAT tm = record_tm(r, du, dv);
        FLOAT behind = tm - limit;
        if (!ANY((h2 > 0.0f) & ((behind < 0.0f) | (behind * behind < h2)))) continue; // as low < limit, without the root
        if (count == ACTIVE_LIMIT) return 0;
        FLOAT h = root(most(h2, 0.0f));
        FLOAT low = tm - h, high = tm + h;
        INT used = (h2 > 0.0f) & (low < limit) & (high > start);
        if (!ANY(used)) continue;
        low = used ? low : (FLOAT)(INFINITY);
        if (r->lead < 0.0f) { // a positive strength: what it adds may begin and end here
            t = least(t, low);
            far = most(far, used ? high : far);
            FLOAT peak = used ? -r->lead * h2 : (FLOAT)(0.0f); // of the cube's root
            peaks += peak * peak * peak;
        }
        kept[count] = (Kept){low, high, tm, h2};
        leads[count] = r->lead;
        flags[count++] = 0;
    }
    if (is_signed) limit = least(limit, far);
    // What the perturbations add on a ray is at most the sum of what each adds where it is highest: nothing is in front of or behind the base made larger by
    // that. Most of what lies between supports' ends is left out so (of S5 at 1024², a third of all pieces and 12 % of the frame; S3 6 %). W is least at the
    // far end, and a thousandth more than the sum covers what floats lose.
    if (count && !all_flags) {
        FLOAT p = most(1.0f - ray->kappa * least(limit, far), 1e-6f), p2 = p * p, highest = base->lead * (p2 * p2) * base_h2;
        INT reached = 1.001f * peaks > highest;
        limit = reached ? limit : (FLOAT)(-INFINITY);
        if (count > 1 && ANY(reached)) { // for one alone this does not pay
            FLOAT h2 = base_h2 - 1.001f * peaks * rough_reciprocal(base->lead * (p2 * p2));
            FLOAT h = root(least(most(h2, 0.0f), 1e30f));
            t = most(t, base_tm - h);
            limit = least(limit, base_tm + h);
        }
    }
    FLOAT found = INFINITY;
    if (!is_signed) found = entry < least(t, bound) ? entry : found;
    t = most(t, start);
    INT live = (t < limit) & !(found < bound);
    while (ANY(live)) {
        FLOAT end = limit;
        for (uint k = 0; k < count; k++) {
            FLOAT next = kept[k].low > t ? kept[k].low : kept[k].high > t ? kept[k].high : (FLOAT)(INFINITY);
            end = least(end, next);
        }
        Bernstein sum;
        sum.c0 = sum.c1 = sum.c2 = sum.c3 = sum.c4 = sum.c5 = sum.c6 = 0.0f;
        INT active = t > end; // none
        FLOAT zero = 0.0f;
        for (uint k = 0; k < count; k++) {
            INT in = live;
            if (all_flags && (flags[k] & RECORD_OUTSIDE)) in = in & ((kept[k].low >= end) | (kept[k].high <= t));
            else in = in & (kept[k].low <= t) & (kept[k].high >= end);
            if (!ANY(in)) continue;
            active = active | in;
            float lead = leads[k];
            FLOAT a0, a1, a2;
            if (all_flags && (flags[k] & RECORD_GENERAL)) {
                FLOAT beta = kept[k].middle, q = kept[k].square;
                a0 = t * (lead * t - 2.0f * beta) + q;
                a1 = lead * t * end - beta * (t + end) + q;
                a2 = end * (lead * end - 2.0f * beta) + q;
            } else {
                FLOAT dl = t - kept[k].middle, dh = end - kept[k].middle, h2 = kept[k].square;
                a0 = lead * (dl * dl - h2);
                a1 = lead * (dl * dh - h2);
                a2 = lead * (dh * dh - h2);
            }
            add_cube(&sum, in ? a0 : zero, in ? a1 : zero, in ? a2 : zero);
        }
        if (is_signed) {
            INT alone = live & !active;
            FLOAT closed = t < entry ? entry : t < leaves ? t : (FLOAT)(INFINITY);
            INT met = alone & (closed < end);
            found = met ? closed : found;
            live = live & !met;
        }
        INT solve = live & active;
        if (ANY(solve)) {
            FLOAT dl = t - base_tm, dh = end - base_tm;
            float lead = base->lead;
            FLOAT f0 = lead * (dl * dl - base_h2), f1 = lead * (dl * dh - base_h2), f2 = lead * (dh * dh - base_h2);
            if (ray->kappa == 0.0f) add_parallel_base(&sum, f0, f1, f2);
            else add_base(&sum, f0, f1, f2, 1.0f - ray->kappa * t, 1.0f - ray->kappa * end);
            FLOAT s = bernstein_first(&sum, solve, ray->shadow);
            INT hit = solve & (s <= 1.0f);
            found = hit ? t + s * (end - t) : found;
            live = live & !hit;
        }
        t = end;
        live = live & (t < limit);
    }
    if (!is_signed) found = ((found < bound) | !(entry < bound)) ? found : entry;
    if (base->flags & RECORD_STRONG) found = freeform_polish(ray, id, begin, stop, found, (found < bound) & (found != entry));
    *answer = found;
    return 1;
}
#endif

// The first place from t on, before the bound, that is inside; infinity (or anything from the bound on) if there is none.
INLINE FLOAT freeform_first(const Ray *ray, uint id, uint begin, uint stop, FLOAT t, FLOAT bound)
{
#if WIDTH > 1
    FLOAT found;
    if (freeform_fast(ray, id, begin, stop, &t, &bound, &found)) return found;
#endif
    return freeform_next(ray, id, begin, stop, t, bound, 1.0f, t != t);
}

// As quadric_enter() (sign 1) and quadric_leave() (sign -1), for set operations: keeps the stretch that was found last.
static FLOAT freeform_advance(const Ray *ray, uint id, uint begin, uint stop, Stretch *stretch, FLOAT t, FLOAT bound, float sign)
{
    INT stale = stretch_is_over(stretch, t, bound);
    if (ANY(stale)) {
        FLOAT limit = stale ? bound : (FLOAT)(-INFINITY);
        FLOAT entry = freeform_next(ray, id, begin, stop, t, limit, sign, stretch_ends_at(stretch, t));
        FLOAT end = freeform_next(ray, id, begin, stop, entry, limit, -sign, t == t);
        stretch_keep(stretch, stale, t, entry, end);
    }
    return most(t, stretch->begin);
}
