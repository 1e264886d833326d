// Patches of a thickness: what is within `radius` of the surface of bicubic cells. Rays are moved to the patch's own coordinates, where the solid is the union of the
// balls about all places of the surface, so each affine image of one is exact.
//
// A ray enters the union where it enters the first ball. That is a minimum over the cells' (s, t), found by halving them: a piece lies in a box along its
// chords and normal, and what is within radius of that box bounds what its balls can be; a ball about a place of the piece is a ball that is met. A piece is left as soon as
// its bound is no better than what is met, so no entry is missed by more than the tolerance. A flat piece of length L is off its box by L squared; so boxes alone
// would have to be halved until that is the tolerance. But where the square of the distance to a place of the ray is convex over a piece, which bounds of its
// derivatives show, its least value there is known from one gradient, and the piece is done.
//
// It leaves the union by going from ball to ball: from a place inside to where it leaves the ball about the nearest place of the surface, until that is a radius away.

#define THICK_DEPTH 48     // pieces that wait
#define THICK_JUMPS 4096   // balls on the way out
#define THICK_RELATIVE 2e-6f // of the size of a patch: what floats tell apart

typedef struct ThickBox {
    float s0, s1, t0, t1;
} ThickBox;

typedef struct ThickCell {
    float16 x, y, z; // Bezier points
} ThickCell;

// A piece of a cell in its box: axes along its u chord and its normal, coordinates about the middle of the chords.
typedef struct ThickPiece {
    float3 about, e, f, n;
    float3 middle, extent; // of the box, in these axes
    float3 u, v;           // chords
    float chord_u, along_v, across_v;
    ThickCell own; // its Bezier points, about the middle of the chords
} ThickPiece;

INLINE float dot_of(float3 a, float3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

INLINE float3 cross_of(float3 a, float3 b)
{
    return (float3)(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

INLINE float least16_of(float16 x)
{
    float8 a = min(x.lo, x.hi);
    float4 b = min(a.lo, a.hi);
    float2 c = min(b.lo, b.hi);
    return min(c.x, c.y);
}

INLINE float sum16_of(float16 x)
{
    float8 a = x.lo + x.hi;
    float4 b = a.lo + a.hi;
    float2 c = b.lo + b.hi;
    return c.x + c.y;
}

// The weights of a cubic's points in its polar form at (a, b, c).
INLINE float4 thick_blossom(float a, float b, float c)
{
    float p = 1.0f - a, q = 1.0f - b, r = 1.0f - c;
    return (float4)(p * q * r, a * q * r + p * b * r + p * q * c, a * b * r + a * q * c + p * b * c, a * b * c);
}

INLINE float16 thick_along_t(float16 g, float4 w0, float4 w1, float4 w2, float4 w3)
{
    float4 a = (float4)(w0.x, w1.x, w2.x, w3.x), b = (float4)(w0.y, w1.y, w2.y, w3.y), c = (float4)(w0.z, w1.z, w2.z, w3.z), d = (float4)(w0.w, w1.w, w2.w, w3.w);
    return g.s000044448888cccc * (float16)(a, a, a, a) + g.s111155559999dddd * (float16)(b, b, b, b) + g.s22226666aaaaeeee * (float16)(c, c, c, c) +
           g.s33337777bbbbffff * (float16)(d, d, d, d);
}

INLINE float16 thick_along_s(float16 g, float4 w0, float4 w1, float4 w2, float4 w3)
{
    return g.s0123012301230123 * (float16)((float4)(w0.x), (float4)(w1.x), (float4)(w2.x), (float4)(w3.x)) +
           g.s4567456745674567 * (float16)((float4)(w0.y), (float4)(w1.y), (float4)(w2.y), (float4)(w3.y)) +
           g.s89ab89ab89ab89ab * (float16)((float4)(w0.z), (float4)(w1.z), (float4)(w2.z), (float4)(w3.z)) +
           g.scdefcdefcdefcdef * (float16)((float4)(w0.w), (float4)(w1.w), (float4)(w2.w), (float4)(w3.w));
}

INLINE float3 thick_direction(float3 v, float3 other)
{
    float square = dot_of(v, v);
    return square > 1e-24f ? v * rsqrt(square) : other;
}

static NOINLINE void thick_piece(const ThickCell *cell, ThickBox box, ThickPiece *piece)
{
    float4 s0 = thick_blossom(box.s0, box.s0, box.s0), s1 = thick_blossom(box.s0, box.s0, box.s1), s2 = thick_blossom(box.s0, box.s1, box.s1), s3 = thick_blossom(box.s1, box.s1, box.s1);
    float4 t0 = thick_blossom(box.t0, box.t0, box.t0), t1 = thick_blossom(box.t0, box.t0, box.t1), t2 = thick_blossom(box.t0, box.t1, box.t1), t3 = thick_blossom(box.t1, box.t1, box.t1);
    float16 x = thick_along_s(thick_along_t(cell->x, t0, t1, t2, t3), s0, s1, s2, s3);
    float16 y = thick_along_s(thick_along_t(cell->y, t0, t1, t2, t3), s0, s1, s2, s3);
    float16 z = thick_along_s(thick_along_t(cell->z, t0, t1, t2, t3), s0, s1, s2, s3);
    float3 p00 = (float3)(x.s0, y.s0, z.s0), p01 = (float3)(x.s3, y.s3, z.s3), p10 = (float3)(x.sc, y.sc, z.sc), p11 = (float3)(x.sf, y.sf, z.sf);
    float3 u = 0.5f * ((p10 + p11) - (p00 + p01)), v = 0.5f * ((p01 + p11) - (p00 + p10));
    ThickPiece p;
    p.about = 0.25f * ((p00 + p01) + (p10 + p11));
    p.e = thick_direction(u, (float3)(1.0f, 0.0f, 0.0f));
    float3 aside = fabs(p.e.x) < 0.6f ? (float3)(1.0f, 0.0f, 0.0f) : (float3)(0.0f, 1.0f, 0.0f);
    aside = cross_of(p.e, aside);
    p.n = thick_direction(cross_of(p.e, v), aside * rsqrt(dot_of(aside, aside)));
    p.f = cross_of(p.n, p.e);
    p.chord_u = dot_of(u, p.e);
    p.along_v = dot_of(v, p.e);
    p.across_v = dot_of(v, p.f);
    x -= p.about.x;
    y -= p.about.y;
    z -= p.about.z;
    float16 a = x * p.e.x + y * p.e.y + z * p.e.z, b = x * p.f.x + y * p.f.y + z * p.f.z, c = x * p.n.x + y * p.n.y + z * p.n.z;
    float3 low = (float3)(least16_of(a), least16_of(b), least16_of(c)), high = -(float3)(least16_of(-a), least16_of(-b), least16_of(-c));
    p.middle = 0.5f * (low + high);
    p.extent = 0.5f * (high - low);
    p.u = u;
    p.v = v;
    p.own = (ThickCell){x, y, z};
    *piece = p;
}

// A place of space in the piece's axes.
INLINE float3 thick_local(const ThickPiece *p, float3 at)
{
    at -= p->about;
    return (float3)(dot_of(at, p->e), dot_of(at, p->f), dot_of(at, p->n));
}

INLINE float3 thick_turned(const ThickPiece *p, float3 way)
{
    return (float3)(dot_of(way, p->e), dot_of(way, p->f), dot_of(way, p->n));
}

// Distance from a place in the piece's axes to its box.
INLINE float thick_gap(const ThickPiece *p, float3 q)
{
    float3 beyond = max(fabs(q - p->middle) - p->extent, (float3)(0.0f));
    return sqrt(dot_of(beyond, beyond));
}

// Where on the piece a place in its axes is, if the piece is flat.
INLINE float2 thick_guess(const ThickPiece *p, ThickBox box, float3 q)
{
    float t = fabs(p->across_v) > 1e-12f ? q.y / p->across_v : 0.0f;
    float s = p->chord_u > 1e-12f ? (q.x - p->along_v * t) / p->chord_u : 0.0f;
    return (float2)(box.s0 + clamp(0.5f + s, 0.0f, 1.0f) * (box.s1 - box.s0), box.t0 + clamp(0.5f + t, 0.0f, 1.0f) * (box.t1 - box.t0));
}

INLINE float3 thick_sum(const ThickCell *cell, float4 a, float4 b)
{
    float16 w = (float16)(a.x * b, a.y * b, a.z * b, a.w * b);
    return (float3)(sum16_of(cell->x * w), sum16_of(cell->y * w), sum16_of(cell->z * w));
}

INLINE float4 thick_weights(float s)
{
    float r = 1.0f - s;
    return (float4)(r * r * r, 3.0f * r * r * s, 3.0f * r * s * s, s * s * s);
}

INLINE float4 thick_slopes(float s)
{
    float r = 1.0f - s;
    return (float4)(-3.0f * r * r, 3.0f * r * (r - 2.0f * s), 3.0f * s * (2.0f * r - s), 3.0f * s * s);
}

INLINE float3 thick_place(const ThickCell *cell, float2 st)
{
    return thick_sum(cell, thick_weights(st.x), thick_weights(st.y));
}

// Whether a piece is halved along s: along what is longer, but a piece whose chords vanish may be long along neither, so both sides get shorter in turn.
INLINE int thick_splits_s(const ThickPiece *p, ThickBox box)
{
    float s = box.s1 - box.s0, t = box.t1 - box.t0;
    return p->extent.x >= p->extent.y ? 8.0f * s > t : s > 8.0f * t;
}

INLINE int thick_is_small(const ThickPiece *p, ThickBox box, float tolerance)
{
    return p->extent.x + p->extent.y < tolerance || (box.s1 - box.s0) + (box.t1 - box.t0) < 1e-5f;
}

// One step of Gauss and Newton from (s, t) towards the place of the cell that is nearest to `at`.
static NOINLINE float2 thick_nearer(const ThickCell *cell, float2 st, float3 at)
{
    float4 us = thick_weights(st.x), vs = thick_weights(st.y);
    float3 way = at - thick_sum(cell, us, vs);
    float3 by_s = thick_sum(cell, thick_slopes(st.x), vs), by_t = thick_sum(cell, us, thick_slopes(st.y));
    float a = dot_of(by_s, by_s), b = dot_of(by_s, by_t), c = dot_of(by_t, by_t), p = dot_of(by_s, way), q = dot_of(by_t, way);
    float det = a * c - b * b;
    float2 step = det > 1e-7f * a * c ? (float2)((p * c - q * b) / det, (q * a - p * b) / det) : (float2)(0.0f);
    float2 next = clamp(st + step, 0.0f, 1.0f);
    // Held by one side the other goes on alone.
    if (next.x != st.x + step.x && c > 0.0f) next.y = clamp(st.y + (q - b * (next.x - st.x)) / c, 0.0f, 1.0f);
    else if (next.y != st.y + step.y && a > 0.0f) next.x = clamp(st.x + (p - b * (next.y - st.y)) / a, 0.0f, 1.0f);
    return next;
}

// Differences of neighbours along s and along t; those that there are no more of are the last ones again.
INLINE float16 thick_steps_s(float16 x)
{
    return x.s456789abcdefcdef - x.s0123456789ab89ab;
}

INLINE float16 thick_steps_t(float16 x)
{
    return x.s123356779abbdeff - x.s0122456689aacdee;
}

INLINE float most16_of(float16 x)
{
    return -least16_of(-x);
}

// Control values of polynomials of lower degrees as those of bicubics: of three values along s or t that thick_steps_…() give, and of two.
#define THICK_THIRDS (float4)(1.0f, 1.0f / 3.0f, 2.0f / 3.0f, 1.0f)

INLINE float16 thick_three_s(float16 d)
{
    return mix(d.s0123456789ab89ab, d.s01230123456789ab, (float16)((float4)(1.0f), (float4)(1.0f / 3.0f), (float4)(2.0f / 3.0f), (float4)(1.0f)));
}

INLINE float16 thick_three_t(float16 d)
{
    return mix(d.s0122456689aacdee, d.s00124456889accde, (float16)(THICK_THIRDS, THICK_THIRDS, THICK_THIRDS, THICK_THIRDS));
}

INLINE float16 thick_two_s(float16 d)
{
    return mix(d.s4567456701230123, d.s0123012345674567, (float16)((float4)(1.0f), (float4)(2.0f / 3.0f), (float4)(2.0f / 3.0f), (float4)(1.0f)));
}

INLINE float16 thick_two_t(float16 d)
{
    float4 w = (float4)(1.0f, 2.0f / 3.0f, 2.0f / 3.0f, 1.0f);
    return mix(d.s110055449988ddcc, d.s001144558899ccdd, (float16)(w, w, w, w));
}

INLINE float thick_mean(float16 x)
{
    return sum16_of(x) / 16.0f;
}

// The second derivatives of half the squared distance from a place, which is `way` before the middle of the chords, and from those up to `back` away.
//
// They are J'J + D·P'', J the slopes, D the way to the surface. Parameters are taken in which the chords are e and f: J is then near 1 in their plane, and what it is out of
// the plane adds nothing negative; so a slope that turns with the surface costs its square. `modulus` is below the least eigenvalue in these parameters: where it is positive
// the function is convex over the piece. `drift` is above how fast the surface goes along a unit vector there.
typedef struct ThickConvex {
    float3 ss, st, tt; // of the surface, their means
    float modulus, drift;
} ThickConvex;

// Vectors along the piece's axes.
INLINE void thick_axes(const ThickPiece *p, float16 x, float16 y, float16 z, ThickCell *turned)
{
    turned->x = x * p->e.x + y * p->e.y + z * p->e.z;
    turned->y = x * p->f.x + y * p->f.y + z * p->f.z;
    turned->z = x * p->n.x + y * p->n.y + z * p->n.z;
}

// The least product of one of the vectors with one of a box, and the largest size of one.
INLINE float thick_least(const ThickCell *v, float3 middle, float3 room)
{
    return least16_of(v->x * middle.x + v->y * middle.y + v->z * middle.z - (fabs(v->x) * room.x + fabs(v->y) * room.y + fabs(v->z) * room.z));
}

INLINE float thick_size(const ThickCell *v, float3 middle, float3 room)
{
    return most16_of(fabs(v->x * middle.x + v->y * middle.y + v->z * middle.z) + (fabs(v->x) * room.x + fabs(v->y) * room.y + fabs(v->z) * room.z));
}

static NOINLINE void thick_convex(const ThickPiece *p, float3 way, float back, float3 along, ThickConvex *convex)
{
    const ThickCell *own = &p->own;
    convex->modulus = 0.0f;
    if (!(p->chord_u > 1e-12f) || !(fabs(p->across_v) > 1e-12f)) return;
    float i = 1.0f / p->chord_u, j = 1.0f / p->across_v, k = p->along_v * i;
    float16 xs = 3.0f * thick_steps_s(own->x), ys = 3.0f * thick_steps_s(own->y), zs = 3.0f * thick_steps_s(own->z);
    float16 xt = 3.0f * thick_steps_t(own->x), yt = 3.0f * thick_steps_t(own->y), zt = 3.0f * thick_steps_t(own->z);
    // How far the slopes are from e and f, along the three axes.
    float16 x1 = i * thick_three_s(xs), y1 = i * thick_three_s(ys), z1 = i * thick_three_s(zs);
    float16 x2 = j * thick_three_t(xt) - (j * p->along_v) * x1, y2 = j * thick_three_t(yt) - (j * p->along_v) * y1, z2 = j * thick_three_t(zt) - (j * p->along_v) * z1;
    ThickCell p1, p2;
    thick_axes(p, x1, y1, z1, &p1);
    thick_axes(p, x2, y2, z2, &p2);
    p1.x -= 1.0f;
    p2.y -= 1.0f;
    float stretch = 1.0f - sqrt(most16_of(p1.x * p1.x + p1.y * p1.y) + most16_of(p2.x * p2.x + p2.y * p2.y));
    if (!(stretch > 0.0f)) return;
    float drift_1 = most16_of(fabs(x1 * along.x + y1 * along.y + z1 * along.z)), drift_2 = most16_of(fabs(x2 * along.x + y2 * along.y + z2 * along.z));
    convex->drift = sqrt(drift_1 * drift_1 + drift_2 * drift_2);
    // Steps of steps: along s a cubic has two, of which thick_steps_s() takes the first three of its four.
    float16 xss = 2.0f * (xs.s456789ab89ab89ab - xs.s0123456745674567), yss = 2.0f * (ys.s456789ab89ab89ab - ys.s0123456745674567);
    float16 zss = 2.0f * (zs.s456789ab89ab89ab - zs.s0123456745674567);
    float16 xtt = 2.0f * (xt.s122256669aaadeee - xt.s011145558999cddd), ytt = 2.0f * (yt.s122256669aaadeee - yt.s011145558999cddd);
    float16 ztt = 2.0f * (zt.s122256669aaadeee - zt.s011145558999cddd);
    float16 xst = 3.0f * thick_steps_t(xs), yst = 3.0f * thick_steps_t(ys), zst = 3.0f * thick_steps_t(zs);
    // In the piece's axes, where what is large of the way is small of these: the extent along the piece and the bend out of it.
    float3 middle = thick_turned(p, way) + p->middle, room = p->extent + back * fabs(thick_turned(p, along));
    ThickCell ss, st, tt;
    thick_axes(p, xss, yss, zss, &ss);
    thick_axes(p, xst, yst, zst, &st);
    thick_axes(p, xtt, ytt, ztt, &tt);
    ss = (ThickCell){thick_two_s(ss.x), thick_two_s(ss.y), thick_two_s(ss.z)};
    st = (ThickCell){thick_three_t(thick_three_s(st.x)), thick_three_t(thick_three_s(st.y)), thick_three_t(thick_three_s(st.z))};
    tt = (ThickCell){thick_two_t(tt.x), thick_two_t(tt.y), thick_two_t(tt.z)};
    ThickCell bent_1 = {i * i * ss.x, i * i * ss.y, i * i * ss.z};
    ThickCell bent_2 = {j * j * (tt.x - 2.0f * k * st.x + k * k * ss.x), j * j * (tt.y - 2.0f * k * st.y + k * k * ss.y), j * j * (tt.z - 2.0f * k * st.z + k * k * ss.z)};
    ThickCell twist = {i * j * (st.x - k * ss.x), i * j * (st.y - k * ss.y), i * j * (st.z - k * ss.z)};
    convex->modulus = stretch * stretch + min(thick_least(&bent_1, middle, room), thick_least(&bent_2, middle, room)) - thick_size(&twist, middle, room);
    convex->ss = (float3)(thick_mean(xss), thick_mean(yss), thick_mean(zss));
    convex->st = (float3)(thick_mean(xst), thick_mean(yst), thick_mean(zst));
    convex->tt = (float3)(thick_mean(xtt), thick_mean(ytt), thick_mean(ztt));
}

// Where thick_settle() ends.
typedef struct ThickSettled {
    float2 st;    // in the piece
    float3 to;    // from the place outside to that of the surface
    float bound;  // below the square of the distance to any place of the piece
    float excess; // of the square of `to` over that
} ThickSettled;

// Goes to the place of the piece that is nearest to one `way` before its middle, where the distance is convex.
static NOINLINE void thick_settle(const ThickPiece *p, const ThickConvex *convex, float3 way, ThickSettled *settled)
{
    float2 at = settled->st;
    for (int turn = 0; turn < 4; turn++) {
        float4 us = thick_weights(at.x), vs = thick_weights(at.y);
        float3 to = way + thick_sum(&p->own, us, vs), by_s = thick_sum(&p->own, thick_slopes(at.x), vs), by_t = thick_sum(&p->own, us, thick_slopes(at.y));
        float g = dot_of(by_s, to), h = dot_of(by_t, to), square = dot_of(to, to);
        // A convex function is above its tangent plane.
        float below = square + 2.0f * (min(-g * at.x, g * (1.0f - at.x)) + min(-h * at.y, h * (1.0f - at.y)));
        *settled = (ThickSettled){at, to, below, square - below};
        if (square - below <= 1e-6f * square || turn == 3) break;
        float a = dot_of(by_s, by_s) + dot_of(to, convex->ss), b = dot_of(by_s, by_t) + dot_of(to, convex->st), c = dot_of(by_t, by_t) + dot_of(to, convex->tt);
        float det = a * c - b * b;
        if (!(det > 0.0f)) break;
        float2 step = (float2)((b * h - c * g) / det, (b * g - a * h) / det), next = clamp(at + step, 0.0f, 1.0f);
        if (next.x != at.x + step.x) next.y = clamp(at.y - (h + b * (next.x - at.x)) / c, 0.0f, 1.0f);
        else if (next.y != at.y + step.y) next.x = clamp(at.x - (g + b * (next.y - at.y)) / a, 0.0f, 1.0f);
        at = next;
    }
}

// Parameters of the piece as those of its cell, and back.
INLINE float2 thick_outer(ThickBox box, float2 st)
{
    return (float2)(box.s0 + st.x * (box.s1 - box.s0), box.t0 + st.y * (box.t1 - box.t0));
}

INLINE float2 thick_inner(ThickBox box, float2 st)
{
    return clamp((float2)((st.x - box.s0) / (box.s1 - box.s0), (st.y - box.t0) / (box.t1 - box.t0)), 0.0f, 1.0f);
}

INLINE ThickCell thick_cell(__global const CellRecord *records)
{
    return (ThickCell){vload16(0, records[0].points), vload16(0, records[1].points), vload16(0, records[2].points)};
}

// A ray in the patch's coordinates: from + l way, l a length.
typedef struct ThickRay {
    float3 from, way;
    float radius, tolerance;
} ThickRay;

// The stretch of a ray within a radius of the box of a piece, or of a cell: bounds of it. low > high: none.
INLINE float2 thick_stretch(float3 o, float3 d, float3 extent, float radius)
{
    float3 safe = select(d, (float3)(1e-12f), fabs(d) < 1e-12f), grown = extent + radius;
    float3 a = (-grown - o) / safe, b = (grown - o) / safe;
    float3 low = min(a, b), high = max(a, b);
    float round = sqrt(dot_of(extent, extent)) + radius, middle = -dot_of(o, d);
    float square = round * round - (dot_of(o, o) - middle * middle);
    if (square < 0.0f) return (float2)(1.0f, -1.0f);
    float reach = sqrt(square);
    return (float2)(max(max(low.x, low.y), max(low.z, middle - reach)), min(min(high.x, high.y), min(high.z, middle + reach)));
}

// Where the ray enters the ball about a place: what is met first so far.
INLINE void thick_meet(const ThickRay *ray, float3 centre, float from, int known, float *best, float *entry)
{
    float3 way = centre - ray->from;
    float middle = dot_of(way, ray->way);
    float3 off = way - middle * ray->way;
    float square = ray->radius * ray->radius - dot_of(off, off);
    *entry = middle;
    if (square < -2.0f * ray->radius * ray->tolerance) return;
    float reach = sqrt(max(square, 0.0f)), low = middle - reach; // what is touched within the tolerance is met
    *entry = low;
    if (known ? low <= from + ray->tolerance : middle + reach <= from) return;
    *best = min(*best, max(low, from));
}

// Whether no ball about a place of the piece is entered before `best` by more than the tolerance; lowers `best` to where one that there is is entered. `low` is what none
// can be before.
//
// If from no place of the ray between `low` and `best` the piece is within the radius, that is so. Where the distance is convex, from the last of them its least is known;
// and from those before it is greater, if from each the nearest place of the piece is ahead. How far that one has moved is bounded by the drift and the modulus.
static int thick_settles(const ThickRay *ray, const ThickCell *cell, ThickBox box, const ThickPiece *piece, float2 st, float from, int known, float low, float *best)
{
    ThickConvex convex;
    ThickSettled settled = {.st = thick_inner(box, st)};
    float back = *best - low;
    for (int turn = 0; turn < 4; turn++) {
        float3 at = ray->from + (*best - ray->tolerance) * ray->way, way = piece->about - at;
        if (turn == 0) {
            thick_convex(piece, way, back, ray->way, &convex);
            if (!(convex.modulus > 0.0f)) return 0;
        }
        thick_settle(piece, &convex, way, &settled);
        if (settled.bound >= ray->radius * ray->radius) {
            float moved = convex.drift * convex.drift / convex.modulus - 1.0f, unsure = convex.drift * sqrt(0.5f * max(settled.excess, 0.0f) / convex.modulus);
            return dot_of(settled.to, ray->way) >= back * max(moved, 0.0f) + unsure;
        }
        float entry, last = *best;
        thick_meet(ray, thick_place(cell, thick_outer(box, settled.st)), from, known, best, &entry);
        if (!(*best < last)) return 0;
    }
    return 0;
}

// Lowers `best` to where the ray enters what is about a cell, if that is before it.
static NOINLINE float thick_enter(const ThickRay *ray, const ThickCell *cell, float from, int known, float best, int look)
{
    ThickBox stack[THICK_DEPTH];
    float tolerance = ray->tolerance, behind = known ? from + tolerance : from;
    int count = 1;
    stack[0] = (ThickBox){0.0f, 1.0f, 0.0f, 1.0f};
    while (count) {
        ThickBox box = stack[--count];
        ThickPiece piece;
        thick_piece(cell, box, &piece);
        float3 o = thick_local(&piece, ray->from), d = thick_turned(&piece, ray->way);
        float2 stretch = thick_stretch(o - piece.middle, d, piece.extent, ray->radius);
        float low = max(stretch.x, from);
        if (!(low <= stretch.y) || stretch.y <= behind || low >= best - tolerance) continue;
        for (int k = 0; k < 6; k++) { // the rim is round
            float gap = thick_gap(&piece, o + low * d) - ray->radius;
            if (gap <= 0.25f * tolerance) break;
            low += gap;
        }
        if (low > stretch.y || low >= best - tolerance) continue;
        float2 st = thick_guess(&piece, box, o + low * d);
        float entry;
        thick_meet(ray, thick_place(cell, st), from, known, &best, &entry);
        float2 better = thick_nearer(cell, st, ray->from + max(entry, low) * ray->way);
        thick_meet(ray, thick_place(cell, better), from, known, &best, &entry);
        if (look || low >= best - tolerance || thick_is_small(&piece, box, tolerance) || count + 2 > THICK_DEPTH) continue;
        if (best < INFINITY && thick_settles(ray, cell, box, &piece, better, from, known, low, &best)) continue;
        ThickBox first = box, second = box;
        int upper;
        if (thick_splits_s(&piece, box)) {
            first.s1 = second.s0 = 0.5f * (box.s0 + box.s1);
            upper = st.x > first.s1;
        } else {
            first.t1 = second.t0 = 0.5f * (box.t0 + box.t1);
            upper = st.y > first.t1;
        }
        stack[count++] = upper ? first : second;
        stack[count++] = upper ? second : first;
    }
    return best;
}

// What is nearest to a place so far, and at what distance the search may end.
typedef struct ThickNearest {
    float3 at, place;
    float distance, enough;
} ThickNearest;

INLINE void thick_compare(ThickNearest *nearest, float3 place)
{
    float gap = sqrt(dot_of(nearest->at - place, nearest->at - place));
    if (gap < nearest->distance) {
        nearest->distance = gap;
        nearest->place = place;
    }
}

static NOINLINE void thick_nearest(ThickNearest *nearest, const ThickCell *cell, float tolerance)
{
    ThickBox stack[THICK_DEPTH];
    int count = 1;
    stack[0] = (ThickBox){0.0f, 1.0f, 0.0f, 1.0f};
    while (count && nearest->distance > nearest->enough) {
        ThickBox box = stack[--count];
        ThickPiece piece;
        thick_piece(cell, box, &piece);
        float3 q = thick_local(&piece, nearest->at);
        float gap = thick_gap(&piece, q);
        if (gap >= nearest->distance - tolerance) continue;
        float2 st = thick_guess(&piece, box, q);
        for (int k = 0; k < 3; k++) {
            thick_compare(nearest, thick_place(cell, st));
            st = thick_nearer(cell, st, nearest->at);
        }
        thick_compare(nearest, thick_place(cell, st));
        if (gap >= nearest->distance - tolerance || thick_is_small(&piece, box, tolerance) || count + 2 > THICK_DEPTH) continue;
        ThickConvex convex;
        float3 way = piece.about - nearest->at;
        thick_convex(&piece, way, 0.0f, (float3)(0.0f), &convex);
        if (convex.modulus > 0.0f) {
            ThickSettled settled = {.st = thick_inner(box, st)};
            thick_settle(&piece, &convex, way, &settled);
            thick_compare(nearest, thick_place(cell, thick_outer(box, settled.st)));
            float limit = max(nearest->distance - tolerance, 0.0f);
            if (settled.bound >= limit * limit) continue;
        }
        ThickBox first = box, second = box;
        if (thick_splits_s(&piece, box)) first.s1 = second.s0 = 0.5f * (box.s0 + box.s1);
        else first.t1 = second.t0 = 0.5f * (box.t0 + box.t1);
        stack[count++] = second;
        stack[count++] = first;
    }
}

// The rays of a packet in the patch's coordinates: place z / W is at length z scale + shift on from + length way.
typedef struct ThickRays {
    FLOAT from[3], way[3], scale, shift;
    float kappa;
} ThickRays;

INLINE ThickRays thick_rays(const Ray *ray, __global const ThickRecord *record)
{
    ThickRays r;
    __global const float *const rows[3] = {record->x, record->y, record->z};
    FLOAT square = 0.0f, shift = 0.0f;
    for (int k = 0; k < 3; k++) {
        r.from[k] = rows[k][0] * ray->u + rows[k][1] * ray->v + rows[k][3];
        r.way[k] = ray->kappa * r.from[k] + rows[k][2];
        square += r.way[k] * r.way[k];
    }
    r.scale = root(square);
    for (int k = 0; k < 3; k++) {
        r.way[k] /= r.scale;
        shift += r.way[k] * r.from[k];
    }
    for (int k = 0; k < 3; k++) r.from[k] -= shift * r.way[k];
    r.shift = shift;
    r.kappa = ray->kappa;
    return r;
}

INLINE FLOAT thick_length(const ThickRays *rays, FLOAT w)
{
    FLOAT z = w;
    if (rays->kappa > 0.0f) {
        FLOAT below = 1.0f - rays->kappa * w, infinite = INFINITY, eye = -1.0f / rays->kappa;
        z = w < -BIG ? eye : below > 0.0f ? w / below : infinite;
    }
    return z * rays->scale + rays->shift;
}

INLINE FLOAT thick_depth(const ThickRays *rays, FLOAT length)
{
    FLOAT z = (length - rays->shift) / rays->scale, infinite = INFINITY;
    FLOAT w = z / (1.0f + rays->kappa * z);
    return length < infinite ? w : infinite;
}

#if WIDTH == 1
#define THICK_LANE(vector, lane) (vector)
#else
#define THICK_LANE(vector, lane) (((const float *)&(vector))[lane])
#endif

INLINE ThickRay thick_ray(const ThickRays *rays, __global const ThickRecord *record, int lane)
{
    ThickRay ray;
    ray.from = (float3)(THICK_LANE(rays->from[0], lane), THICK_LANE(rays->from[1], lane), THICK_LANE(rays->from[2], lane));
    ray.way = (float3)(THICK_LANE(rays->way[0], lane), THICK_LANE(rays->way[1], lane), THICK_LANE(rays->way[2], lane));
    ray.radius = record->radius;
    ray.tolerance = THICK_RELATIVE * record->size;
    return ray;
}

// Before which length the rays cannot be about the cell, infinity where they never are, from its box.
INLINE FLOAT thick_reach(const ThickRays *rays, __global const ThickShape *shape, float radius, FLOAT from)
{
    FLOAT low = from, high = INFINITY, never = INFINITY;
    __global const float *const axes[3] = {shape->e, shape->f, shape->n};
    for (int k = 0; k < 3; k++) {
        __global const float *axis = axes[k];
        FLOAT o = axis[0] * (rays->from[0] - shape->middle[0]) + axis[1] * (rays->from[1] - shape->middle[1]) + axis[2] * (rays->from[2] - shape->middle[2]);
        FLOAT d = axis[0] * rays->way[0] + axis[1] * rays->way[1] + axis[2] * rays->way[2];
        d = size_of(d) < 1e-12f ? (FLOAT)(1e-12f) : d;
        float grown = shape->extent[k] + radius;
        FLOAT a = (-grown - o) / d, b = (grown - o) / d;
        low = most(low, least(a, b));
        high = least(high, most(a, b));
    }
    return low <= high ? low : never;
}

INLINE float thick_beside(__global const ThickShape *shape, float3 at)
{
    float3 off = at - vload3(0, shape->middle);
    float3 q = (float3)(dot_of(off, vload3(0, shape->e)), dot_of(off, vload3(0, shape->f)), dot_of(off, vload3(0, shape->n)));
    float3 beyond = max(fabs(q) - vload3(0, shape->extent), (float3)(0.0f));
    return sqrt(dot_of(beyond, beyond));
}

// The place of the cells ray->list[begin .. stop) that is nearest to `at`, if it is within nearest->distance.
static void thick_search(const Ray *ray, uint begin, uint stop, ThickNearest *nearest, float tolerance)
{
    for (uint k = begin; k < stop && nearest->distance > nearest->enough; k++) {
        __global const CellRecord *records = (__global const CellRecord *)(ray->records + ray->list[k]);
        if (thick_beside((__global const ThickShape *)(records + 3), nearest->at) >= nearest->distance) continue;
        ThickCell cell = thick_cell(records);
        thick_nearest(nearest, &cell, tolerance);
    }
}

// Where the ray leaves the union, from a place where it is in it, or, if that is known, enters it.
static float thick_leave(const Ray *ray, uint begin, uint stop, const ThickRay *one, float from, int known, float bound)
{
    float length = from;
    for (int jump = 0; jump < THICK_JUMPS && length < bound; jump++) {
        ThickNearest nearest = {.at = one->from + length * one->way, .distance = one->radius + 8.0f * one->tolerance, .enough = 0.75f * one->radius};
        nearest.place = nearest.at;
        float limit = nearest.distance;
        thick_search(ray, begin, stop, &nearest, 0.25f * one->tolerance);
        if (nearest.distance >= limit) return length;
        if (nearest.distance > one->radius - one->tolerance && !(known && jump == 0)) return length;
        float3 off = nearest.at - nearest.place;
        float middle = dot_of(off, one->way), square = middle * middle + one->radius * one->radius - dot_of(off, off);
        float step = sqrt(max(square, 0.0f)) - middle;
        if (!(step > one->tolerance)) return length;
        length += step;
    }
    return length < bound ? length : INFINITY;
}

// As freeform_next(): the first place from t on, before the bound, at which sign * F turns positive; with `any`, if any such place will do, a later one perhaps.
NOINLINE FLOAT thick_next(const Ray *ray, uint id, uint begin, uint stop, FLOAT t, FLOAT bound, float sign, INT known, int any)
{
    __global const ThickRecord *record = (__global const ThickRecord *)(ray->records + id);
    FLOAT never = INFINITY;
    INT live = t < bound;
    if (record->side == 0.0f) return sign > 0.0f ? t : never;
    int enters = (record->side > 0.0f) == (sign > 0.0f);
    if (begin == stop || !(record->radius > 0.0f)) return enters ? never : t;
    ThickRays rays = thick_rays(ray, record);
    FLOAT from = thick_length(&rays, t), last = thick_length(&rays, bound), found = INFINITY;
    FLOAT one = 1.0f, zero = 0.0f, flags = live ? one : zero, knows = known ? one : zero;
    if (enters) {
        // First a look at each cell, so that most of them need no more.
        for (int looks = 1; looks >= 0; looks--) {
            for (uint k = begin; k < stop; k++) {
                __global const CellRecord *records = (__global const CellRecord *)(ray->records + ray->list[k]);
                FLOAT reach = thick_reach(&rays, (__global const ThickShape *)(records + 3), record->radius, from);
                INT near = live & (reach < found) & (reach < last);
                if (any) near = near & !(found < last);
                if (!ANY(near)) continue;
                ThickCell cell = thick_cell(records);
                FLOAT marks = near ? one : zero;
                for (int lane = 0; lane < LANES; lane++) {
                    if (THICK_LANE(marks, lane) == 0.0f) continue;
                    ThickRay single = thick_ray(&rays, record, lane);
                    ((float *)&found)[lane] = thick_enter(&single, &cell, THICK_LANE(from, lane), THICK_LANE(knows, lane) != 0.0f, THICK_LANE(found, lane), looks);
                }
            }
        }
    } else {
        for (int lane = 0; lane < LANES; lane++) {
            if (THICK_LANE(flags, lane) == 0.0f) continue;
            ThickRay single = thick_ray(&rays, record, lane);
            float begins = THICK_LANE(from, lane);
            ((float *)&found)[lane] = begins > -INFINITY ? thick_leave(ray, begin, stop, &single, begins, THICK_LANE(knows, lane) != 0.0f, THICK_LANE(last, lane)) : begins;
        }
    }
    FLOAT w = thick_depth(&rays, found);
    w = found > from ? most(w, t) : t; // the same place is the same number
    return (live & (found < never)) ? w : never;
}

// As freeform_advance().
static FLOAT thick_advance(const Ray *ray, uint id, uint begin, uint stop, Stretch *stretch, FLOAT t, FLOAT bound, float sign)
{
    INT stale = stretch_is_over(stretch, t, bound);
    if (ANY(stale)) {
        FLOAT limit = stale ? bound : (FLOAT)(-INFINITY);
        FLOAT entry = thick_next(ray, id, begin, stop, t, limit, sign, stretch_ends_at(stretch, t), 0);
        FLOAT end = thick_next(ray, id, begin, stop, entry, limit, -sign, t == t, 0);
        stretch_keep(stretch, stale, t, entry, end);
    }
    return most(t, stretch->begin);
}

// The slope of F at w: from there to the nearest place of the patch.
static Slope thick_slope(const Ray *ray, uint id, uint begin, uint stop, INT mine, FLOAT w)
{
    __global const ThickRecord *record = (__global const ThickRecord *)(ray->records + id);
    ThickRays rays = thick_rays(ray, record);
    FLOAT length = thick_length(&rays, w), one = 1.0f, zero = 0.0f, flags = mine ? one : zero;
    FLOAT gx = 0.0f, gy = 0.0f, gz = 0.0f, x = 0.0f, y = 0.0f, z = 0.0f;
    for (int lane = 0; lane < LANES; lane++) {
        if (THICK_LANE(flags, lane) == 0.0f) continue;
        ThickRay single = thick_ray(&rays, record, lane);
        ThickNearest nearest = {.at = single.from + THICK_LANE(length, lane) * single.way, .distance = single.radius + 64.0f * single.tolerance,
                                .enough = single.radius + 2.0f * single.tolerance};
        nearest.place = nearest.at;
        thick_search(ray, begin, stop, &nearest, 0.25f * single.tolerance);
        float3 way = record->side * thick_direction(nearest.place - nearest.at, single.way);
        ((float *)&gx)[lane] = way.x;
        ((float *)&gy)[lane] = way.y;
        ((float *)&gz)[lane] = way.z;
        ((float *)&x)[lane] = nearest.at.x;
        ((float *)&y)[lane] = nearest.at.y;
        ((float *)&z)[lane] = nearest.at.z;
    }
    float kappa = ray->kappa;
    Slope slope;
    slope.value = 0.0f;
    slope.u = gx * record->x[0] + gy * record->y[0] + gz * record->z[0];
    slope.v = gx * record->x[1] + gy * record->y[1] + gz * record->z[1];
    slope.w = gx * (record->x[2] + kappa * x) + gy * (record->y[2] + kappa * y) + gz * (record->z[2] + kappa * z);
    return slope;
}
