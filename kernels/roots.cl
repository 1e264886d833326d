// First roots of polynomials of degree 6 in Bernstein form on [0, 1]. Coefficients bound the polynomial: where all are <= 0 there is no root,
// for certain; where they change sign once there is one. Powers of the ray's parameter are never expanded: that would lose every digit of a float.

typedef struct Bernstein {
    FLOAT c0, c1, c2, c3, c4, c5, c6;
} Bernstein;

// The part on [s, 1]: de Casteljau's triangle, its right edge.
#define TOWARDS(a, b) a += s * (b - a)
INLINE Bernstein bernstein_right(Bernstein b, FLOAT s)
{
    TOWARDS(b.c0, b.c1); TOWARDS(b.c1, b.c2); TOWARDS(b.c2, b.c3); TOWARDS(b.c3, b.c4); TOWARDS(b.c4, b.c5); TOWARDS(b.c5, b.c6);
    TOWARDS(b.c0, b.c1); TOWARDS(b.c1, b.c2); TOWARDS(b.c2, b.c3); TOWARDS(b.c3, b.c4); TOWARDS(b.c4, b.c5);
    TOWARDS(b.c0, b.c1); TOWARDS(b.c1, b.c2); TOWARDS(b.c2, b.c3); TOWARDS(b.c3, b.c4);
    TOWARDS(b.c0, b.c1); TOWARDS(b.c1, b.c2); TOWARDS(b.c2, b.c3);
    TOWARDS(b.c0, b.c1); TOWARDS(b.c1, b.c2);
    TOWARDS(b.c0, b.c1);
    return b;
}

// The same polynomial from its other end: q(s) = p(1 - s).
INLINE Bernstein bernstein_mirror(Bernstein b)
{
    return (Bernstein){b.c6, b.c5, b.c4, b.c3, b.c2, b.c1, b.c0};
}

INLINE Bernstein bernstein_choose(INT mask, Bernstein a, Bernstein b)
{
    return (Bernstein){mask ? a.c0 : b.c0, mask ? a.c1 : b.c1, mask ? a.c2 : b.c2, mask ? a.c3 : b.c3,
                       mask ? a.c4 : b.c4, mask ? a.c5 : b.c5, mask ? a.c6 : b.c6};
}

INLINE FLOAT bernstein_highest(const Bernstein *b)
{
    return most(most(most(b->c0, b->c1), most(b->c2, b->c3)), most(most(b->c4, b->c5), b->c6));
}

INLINE FLOAT bernstein_lowest(const Bernstein *b)
{
    return least(least(least(b->c0, b->c1), least(b->c2, b->c3)), least(least(b->c4, b->c5), b->c6));
}

INLINE FLOAT bernstein_largest(const Bernstein *b)
{
    return most(bernstein_highest(b), -bernstein_lowest(b));
}

// A positive coefficient has one that is not behind it: the sign may change more than once.
INLINE INT bernstein_falls(const Bernstein *b)
{
    return ((b->c1 > 0.0f) & (b->c2 <= 0.0f)) | ((b->c2 > 0.0f) & (b->c3 <= 0.0f)) | ((b->c3 > 0.0f) & (b->c4 <= 0.0f)) |
           ((b->c4 > 0.0f) & (b->c5 <= 0.0f)) | ((b->c5 > 0.0f) & (b->c6 <= 0.0f));
}

// The root of a polynomial that is <= 0 at 0 and > 0 at 1 and changes sign once. With x = s / (1 - s) it is
// (1 - s)^6 sum B_k x^k, B_k the coefficients times the binomials: a power form without cancellation. Mirrored where the root is in the
// right half, x stays in [0, 1].
//
// Halley's steps in a bracket: they take half as many as Newton's and three multiplications more each (5 % of a frame of S1). A lane has settled when the
// step is short and what bends the curve on it hardly matters, so that the step after it would be nothing to a float; a short step alone says little
// where the curve is flat, since there steps of any kind creep. Lanes that have not settled after ROOT_STEPS halve their bracket at every other step, so
// that ROOT_LIMIT steps end within 1e-5 of any root.
// Out of line: a call costs nothing beside its steps, and three copies would take a tenth of a second to compile.
#define ROOT_STEPS 6
#define ROOT_LIMIT 40
static NOINLINE FLOAT bernstein_root(const Bernstein *b, const INT *searched)
{
    INT live = *searched;
    FLOAT b1 = 6.0f * b->c1, b2 = 15.0f * b->c2, b3 = 20.0f * b->c3, b4 = 15.0f * b->c4, b5 = 6.0f * b->c5;
    INT mirrored = ((b->c0 + b1) + (b2 + b3)) + ((b4 + b5) + b->c6) < 0.0f;
    FLOAT a0 = mirrored ? -b->c6 : b->c0, a6 = mirrored ? -b->c0 : b->c6;
    FLOAT a1 = mirrored ? -b5 : b1, a5 = mirrored ? -b1 : b5;
    FLOAT a2 = mirrored ? -b4 : b2, a4 = mirrored ? -b2 : b4;
    FLOAT a3 = mirrored ? -b3 : b3;

    FLOAT low = 0.0f, high = 1.0f;
    FLOAT x = -a0 * rough_reciprocal(((a1 + a2) + (a3 + a4)) + (a5 + a6)); // where the chord meets 0
    x = ((x >= 0.0f) & (x <= 1.0f)) ? x : (FLOAT)(0.5f);
    for (int step = 0; step < ROOT_LIMIT; step++) {
        // The value, the slope, half the second derivative, by pairs: a quarter more multiplications than one after another, but few wait for others (2 % of
        // a frame of S1).
        FLOAT y = x * x;
        FLOAT p = ((a6 * y + (a5 * x + a4)) * y + (a3 * x + a2)) * y + (a1 * x + a0);
        FLOAT d = ((6.0f * a6 * x + 5.0f * a5) * y + (4.0f * a4 * x + 3.0f * a3)) * y + (2.0f * a2 * x + a1);
        FLOAT e = (15.0f * a6 * y + (10.0f * a5 * x + 6.0f * a4)) * y + (3.0f * a3 * x + a2);
        low = p <= 0.0f ? x : low;
        high = p > 0.0f ? x : high;
        FLOAT square = d * d, bend = p * e;
        FLOAT move = p * d * rough_reciprocal(square - bend);
        FLOAT next = x - move;
        INT inside = (next >= low) & (next <= high);
        INT settled = inside & (size_of(move) <= 1e-3f) & (size_of(move * bend) <= 1e-5f * square);
        if (step >= ROOT_STEPS && (step & 1)) inside = settled;
        x = inside ? next : 0.5f * (low + high);
        if (!ANY(live & !settled)) break;
    }
    FLOAT s = x / (1.0f + x);
    return mirrored ? 1.0f - s : s;
}

// What bernstein_first() knows of its lanes: where the sign changes once, the piece [left, left + span] of the polynomial.
typedef struct Pieces {
    Bernstein b;
    FLOAT left, span, found;
    INT live;
} Pieces;

// Narrows the lanes whose sign may change more than once to a piece with one change: cuts what lies before the steepest chord from the first
// coefficient, which the polynomial stays below; where that gains little, halves. Few packets have such lanes, and every copy of this takes long to compile.
static NOINLINE void bernstein_narrow(const Bernstein *whole, const INT *falls, Pieces *pieces)
{
    INT many = *falls;
    Bernstein b = *whole;
    FLOAT left = 0.0f, span = 1.0f, found = pieces->found;
    INT live = pieces->live;
    FLOAT tolerance = 1e-6f * bernstein_largest(whole);
    for (int step = 0; step < 48; step++) {
        FLOAT slope = most(most(6.0f * (b.c1 - b.c0), 3.0f * (b.c2 - b.c0)),
                          most(most(2.0f * (b.c3 - b.c0), 1.5f * (b.c4 - b.c0)), most(1.2f * (b.c5 - b.c0), b.c6 - b.c0)));
        FLOAT cut = many ? least(-b.c0 * (0.9999f * rough_reciprocal(slope)), 1.0f) : (FLOAT)(0.0f);
        b = bernstein_choose(many, bernstein_right(b, cut), b);
        left += cut * span;
        span -= cut * span;
        b.c0 = many ? least(b.c0, 0.0f) : b.c0;
        INT halve = many & (cut < 0.2f);
        if (ANY(halve)) {
            Bernstein half_piece = bernstein_mirror(bernstein_right(bernstein_mirror(b), (FLOAT)(0.5f)));
            b = bernstein_choose(halve, half_piece, b);
            span = halve ? 0.5f * span : span;
        }
        // A short piece whose sign is still open touches 0 as far as floats can tell: it counts only if it does.
        INT tangent = many & (span < 1e-5f);
        INT touches = tangent & (b.c0 >= -tolerance);
        found = touches ? left : found;
        live = live & !touches;
        many = many & !touches;
        // A piece without a root: go on with all that is left.
        INT empty = many & (tangent | (bernstein_highest(&b) <= 0.0f));
        if (ANY(empty)) {
            left = empty ? left + span : left;
            span = empty ? 1.0f - left : span;
            b = bernstein_choose(empty, bernstein_right(*whole, left), b);
            INT positive = empty & (b.c0 > 0.0f) & (span > 0.0f);
            found = positive ? left : found;
            INT over = positive | (empty & (bernstein_highest(&b) <= 0.0f)) | (empty & (span < 1e-6f));
            live = live & !over;
            many = many & !over;
        }
        many = many & bernstein_falls(&b);
        if (!ANY(many)) break;
    }
    *pieces = (Pieces){b, left, span, found, live & !many};
}

// The first s in [0, 1] from which on the polynomial is positive; infinity where there is none, or where not live. With `exists` the answer
// is only finite or not.
INLINE FLOAT bernstein_first(const Bernstein *whole, INT live, int exists)
{
    FLOAT found = INFINITY;
    INT now = live & (whole->c0 > 0.0f);
    found = now ? (FLOAT)(0.0f) : found;
    live = live & (whole->c0 <= 0.0f) & (bernstein_highest(whole) > 0.0f);
    if (exists) {
        INT certain = live & (whole->c6 > 0.0f);
        found = certain ? (FLOAT)(0.0f) : found;
        live = live & !certain;
    }
    if (!ANY(live)) return found;

    Pieces pieces = {*whole, 0.0f, 1.0f, found, live};
    INT many = live & bernstein_falls(whole);
    if (ANY(many)) {
        bernstein_narrow(whole, &many, &pieces);
        if (!ANY(pieces.live)) return pieces.found;
    }
    if (exists) return pieces.live ? pieces.left : pieces.found;
    return pieces.live ? pieces.left + pieces.span * bernstein_root(&pieces.b, &pieces.live) : pieces.found;
}
