// Quadric records (shared.h): where a ray enters and leaves one, its values on a piece of the ray, its gradient.

// Where Q is negative: before `first_end`, from `gap` to `gap_end`, and from `last` on. Intervals are half-open: a face belongs to what comes after it,
// on every ray and in every quadric, so faces of equal quadrics cancel exactly and leave no membrane.
//   between roots r0, r1 inside:    ---[r0 === r1)---     first_end = r0, gap empty,  last = r1
//   outside of the roots inside:    ===)r0 --- [r1===     first_end = -inf, gap r0 … r1, last = inf
typedef struct Roots {
    FLOAT r0, r1; // r0 = r1 = infinity where there are none
} Roots;

static FLOAT record_tm(__global const QuadricRecord *r, FLOAT du, FLOAT dv)
{
    return r->t0 + r->tu * du + r->tv * dv;
}

static FLOAT centred_h2(__global const QuadricRecord *r, FLOAT du, FLOAT dv)
{
    return r->h0 + du * (r->a * du + r->b * dv) + r->c * dv * dv;
}

static FLOAT record_h2(__global const QuadricRecord *r, FLOAT du, FLOAT dv)
{
    return r->h0 + du * (r->d + r->a * du + r->b * dv) + dv * (r->e + r->c * dv);
}

static FLOAT record_beta(__global const QuadricRecord *r, FLOAT u, FLOAT v)
{
    return r->t0 + r->tu * u + r->tv * v;
}

static FLOAT record_q(__global const QuadricRecord *r, FLOAT u, FLOAT v)
{
    return r->h0 + u * (r->d + r->a * u + r->b * v) + v * (r->e + r->c * v);
}

// Where the planes of a record are met.
static FLOAT record_plane(float at, float along_u, float along_v, FLOAT u, FLOAT v)
{
    return at + along_u * u + along_v * v;
}

static FLOAT beyond_all(FLOAT w)
{
    w = w > BIG ? (FLOAT)(INFINITY) : w;
    return w < -BIG ? (FLOAT)(-INFINITY) : w;
}

// What few quadrics are, out of line, so that what is inlined is short. Planes seen from the edge or far away; half-spaces, which have one plane; and the
// general form.
static NOINLINE Roots unusual_roots(__global const QuadricRecord *r, FLOAT u, FLOAT v)
{
    Roots roots;
    if (r->flags & RECORD_PLANES) {
        FLOAT p = beyond_all(record_plane(r->t0, r->tu, r->tv, u, v)), q = r->lead > 0.0f ? INFINITY : -INFINITY;
        if (!(r->flags & RECORD_HALF)) q = beyond_all(record_plane(r->h0, r->d, r->e, u, v));
        roots.r0 = least(p, q);
        roots.r1 = most(p, q);
        return roots;
    }
    FLOAT beta = record_beta(r, u, v);
    FLOAT q = record_q(r, u, v);
    FLOAT square = beta * beta - r->lead * q;
    // The root that would cancel is q over the sum that does not.
    FLOAT h = root(most(square, 0.0f));
    FLOAT sum = beta < 0.0f ? beta - h : beta + h;
    FLOAT x = sum / r->lead;
    FLOAT y = q / sum;
    y = sum == 0.0f ? x : y;
    FLOAT low = least(x, y);
    FLOAT high = most(x, y);
    low = low < -BIG ? (FLOAT)(-INFINITY) : low;
    high = high > BIG ? (FLOAT)(INFINITY) : high;
    INT none = (square < 0.0f) | (low > BIG);
    roots.r0 = none ? (FLOAT)(INFINITY) : low;
    roots.r1 = none ? (FLOAT)(INFINITY) : high;
    return roots;
}

static Roots record_roots(__global const QuadricRecord *r, FLOAT u, FLOAT v)
{
    Roots roots;
    if (r->flags & (RECORD_GENERAL | RECORD_STEEP)) return unusual_roots(r, u, v);
    if (r->flags & RECORD_PLANES) {
        FLOAT p = record_plane(r->t0, r->tu, r->tv, u, v);
        FLOAT q = record_plane(r->h0, r->d, r->e, u, v);
        roots.r0 = least(p, q);
        roots.r1 = most(p, q);
    } else {
        FLOAT du = u - r->uc;
        FLOAT dv = v - r->vc;
        FLOAT h2 = record_h2(r, du, dv);
        FLOAT tm = record_tm(r, du, dv);
        FLOAT h = root(h2);
        INT none = !(h2 > 0.0f);
        roots.r0 = none ? (FLOAT)(INFINITY) : tm - h;
        roots.r1 = none ? (FLOAT)(INFINITY) : tm + h;
    }
    return roots;
}

// The first place from t on that is inside (enter) or outside (leave); infinity where there is none.
static FLOAT roots_between(Roots roots, FLOAT t)
{
    return t < roots.r0 ? roots.r0 : t < roots.r1 ? t : (FLOAT)(INFINITY);
}

static FLOAT roots_beyond(Roots roots, FLOAT t)
{
    return ((t >= roots.r0) & (t < roots.r1)) ? roots.r1 : t;
}

static FLOAT quadric_enter(Roots roots, uint flags, FLOAT t)
{
    return flags & RECORD_OUTSIDE ? roots_beyond(roots, t) : roots_between(roots, t);
}

static FLOAT quadric_leave(Roots roots, uint flags, FLOAT t)
{
    return flags & RECORD_OUTSIDE ? roots_between(roots, t) : roots_beyond(roots, t);
}

// The boundary at which an entry (or an exit) took place.
static FLOAT quadric_entry(Roots roots, uint flags)
{
    return flags & RECORD_OUTSIDE ? roots.r1 : roots.r0;
}

static FLOAT quadric_exit(Roots roots, uint flags)
{
    return flags & RECORD_OUTSIDE ? roots.r0 : roots.r1;
}

// W² Q and its derivatives by U, V, w at a place.
typedef struct Slope {
    FLOAT value, u, v, w;
} Slope;

// Out of line, as above.
static NOINLINE Slope unusual_slope(__global const QuadricRecord *r, FLOAT u, FLOAT v, FLOAT w)
{
    Slope s;
    if (r->flags & RECORD_GENERAL) {
        FLOAT beta = record_beta(r, u, v);
        s.value = w * (r->lead * w - 2.0f * beta) + record_q(r, u, v);
        s.w = 2.0f * (r->lead * w - beta);
        s.u = r->d + 2.0f * (r->a * u - w * r->tu) + r->b * v;
        s.v = r->e + 2.0f * (r->c * v - w * r->tv) + r->b * u;
        return s;
    }
    FLOAT p = w - record_plane(r->t0, r->tu, r->tv, u, v), q, one = 1.0f;
    if (r->flags & RECORD_HALF) {
        q = 1.0f - r->a * w;
        s.value = r->lead * p * q;
        s.w = r->lead * (q - r->a * p);
        s.u = -r->lead * r->tu * q;
        s.v = -r->lead * r->tv * q;
        return s;
    }
    q = w - record_plane(r->h0, r->d, r->e, u, v);
    s.value = r->lead * p * q;
    q = ((p == 0.0f) & (q == 0.0f)) ? one : q; // a slab that is thinner than floats can tell has a normal all the same
    s.w = r->lead * (p + q);
    s.u = -r->lead * (q * r->tu + p * r->d);
    s.v = -r->lead * (q * r->tv + p * r->e);
    return s;
}

static Slope record_slope(__global const QuadricRecord *r, FLOAT u, FLOAT v, FLOAT w)
{
    if (r->flags & (RECORD_GENERAL | RECORD_PLANES)) return unusual_slope(r, u, v, w);
    Slope s;
    FLOAT du = u - r->uc;
    FLOAT dv = v - r->vc;
    FLOAT d = w - record_tm(r, du, dv);
    FLOAT lead = r->lead;
    s.value = lead * (d * d - record_h2(r, du, dv));
    s.w = 2.0f * lead * d;
    s.u = -lead * (2.0f * (d * r->tu + r->a * du) + r->b * dv + r->d);
    s.v = -lead * (2.0f * (d * r->tv + r->c * dv) + r->b * du + r->e);
    return s;
}

// The stretch of a ray, inside or outside of something, that was found last: half-open, from infinity to -infinity at first. Whoever asks for entries again and again (set
// operations) gets the same numbers, so the search ends, and equal free forms cancel exactly.
typedef struct Stretch {
    FLOAT begin, end;
} Stretch;

// Whether another stretch has to be found at t, and whether one was found and t is its end.
INLINE INT stretch_is_over(const Stretch *stretch, FLOAT t, FLOAT bound)
{
    return (t >= stretch->end) & (t < bound);
}

INLINE INT stretch_ends_at(const Stretch *stretch, FLOAT t)
{
    return (t == stretch->end) & (stretch->begin < INFINITY);
}

// The stretch that was found from t on, in the lanes that looked for one. One that is under way at t began before: -infinity, so that it does not decide there.
INLINE void stretch_keep(Stretch *stretch, INT stale, FLOAT t, FLOAT entry, FLOAT end)
{
    FLOAT first = entry > t ? entry : (FLOAT)(-INFINITY);
    stretch->begin = stale ? first : stretch->begin;
    stretch->end = stale ? end : stretch->end;
}

// Words of the tree of a shape (compiler/emit_deep.c) that are no leaf: what joins the two before them.
#define TREE_UNION 0xfffeu
#define TREE_INTERSECT 0xffffu

// Where the list's ids reach `id`, from the place `at` on.
static uint list_until(const Ray *ray, uint at, uint stop, uint id)
{
#ifdef HAS_COPIES
    while (at < stop && (ray->list[at] < id || ray->list[at] >= ray->copied)) at++;
#else
    while (at < stop && ray->list[at] < id) at++;
#endif
    return at;
}
