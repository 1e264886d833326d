// Noise at points of fields (compiler/noise.h has the definitions): values with their derivatives, and ranges of both over boxes.
//
// A range is that about the value in the middle of the box: what the function may differ from it is bounded by its slopes all over the box, and these are the
// slopes in the middle and what they may differ by, which is bounded by the greatest second derivatives that there are. Of noise() these bounds hold for any
// choice of directions at the corners: the greatest slope along an axis is 3.619, the greatest derivatives of second order are 11.62 (xx) and 10.42 (xy), found
// by trying all directions at each corner separately on a grid of 160³ places in a cell; what stands here is more. The distance of cells() has the slope
// 1 at most, and while one of the scattered points is the nearest all over the box its direction turns by less than the box is wide as seen from it.
//
// Hashes are those of the host, bit for bit. Values differ from the host's by what floats round: 4e-7 was seen (scn-soundness); NOISE_ROUNDING is a bound by the
// sums of the errors of all operations, which is more.

#define NOISE_ROUNDING 4e-6f
#define NOISE_SLOPE_ROUNDING 3e-5f
#define NOISE_SLOPE 3.7f
#define NOISE_BEND 12.0f   // the second derivatives along an axis
#define NOISE_TWIST 10.8f  // and the mixed ones
#define CELLS_ROUNDING 1.5e-6f

typedef struct Noise { // a value and its derivatives
    FLOAT f, x, y, z;
} Noise;

typedef struct Places { // a floor, and what is above it
    FLOAT whole, rest;
} Places;

static FLOAT whole_part(FLOAT x) { BY_HALVES(floor, x) }
static FLOAT nearest_whole(FLOAT x) { BY_HALVES(rint, x) }

static UINT bits_of_size(FLOAT x)
{
#if LANES == 32
    UINT bits;
    bits.lo = convert_uint16(x.lo);
    bits.hi = convert_uint16(x.hi);
    return bits;
#elif LANES == 16
    return convert_uint16(x);
#else
    return convert_uint(x);
#endif
}

// The low 32 bits of a whole number, of any size, in two's complement: all of it is exact.
static UINT whole_bits(FLOAT whole)
{
    FLOAT low = whole - 4294967296.0f * nearest_whole(whole * 2.3283064e-10f), zero = 0.0f;
    low = size_of(low) <= 2147483648.0f ? low : zero;
    UINT bits = bits_of_size(size_of(low));
    return low < 0.0f ? 0u - bits : bits;
}

static FLOAT bits_number(UINT bits) // 0 … 1
{
#if LANES == 32
    FLOAT number;
    number.lo = convert_float16(bits.lo);
    number.hi = convert_float16(bits.hi);
    return number * 2.3283064e-10f;
#elif LANES == 16
    return convert_float16(bits) * 2.3283064e-10f;
#else
    return convert_float(bits) * 2.3283064e-10f;
#endif
}

static UINT noise_mix(UINT hash, UINT word)
{
    UINT h = (hash + 0x9e3779b9u) ^ word;
    h ^= h >> 16;
    h *= 0x85ebca6bu;
    h ^= h >> 13;
    h *= 0xc2b2ae35u;
    return h ^ (h >> 16);
}

// Weights of the two corners along an axis, and their derivatives: s³ (10 + s (6 s - 15)) of the nearer one's distance, so that nothing cancels.
static void fade(FLOAT s, FLOAT *weights, FLOAT *slopes)
{
    FLOAT rest = 1.0f - s, near = least(s, rest), part = near * near * near * (10.0f + near * (6.0f * near - 15.0f));
    weights[0] = s < 0.5f ? 1.0f - part : part;
    weights[1] = s < 0.5f ? part : 1.0f - part;
    slopes[1] = 30.0f * (s * s) * (rest * rest);
    slopes[0] = -slopes[1];
}

// Adds a corner whose hash is h: x, y, z lead from it to the point. The direction is along two axes, u and v.
static void noise_corner(UINT h, FLOAT x, FLOAT y, FLOAT z, FLOAT wx, FLOAT wy, FLOAT wz, FLOAT sx, FLOAT sy, FLOAT sz, Noise *sum)
{
    FLOAT zero = 0.0f, one = 1.0f, minus = -1.0f;
    h &= 15u;
    INT z_first = h >= 14u, x_first = ((h < 8u) | (h >= 12u)) & !z_first, y_second = (h < 4u) | (h >= 12u);
    INT y_first = !x_first & !z_first;
    FLOAT first = (h & 1u) != 0u ? minus : one, second = (h & 2u) != 0u ? minus : one;
    FLOAT gx = x_first ? first : zero, gy = (y_first ? first : zero) + (y_second ? second : zero), gz = (z_first ? first : zero) + (y_second ? zero : second);
    FLOAT n = gx * x + gy * y + gz * z, w = wx * wy * wz;
    sum->f += w * n;
    sum->x += w * gx + sx * wy * wz * n;
    sum->y += w * gy + wx * sy * wz * n;
    sum->z += w * gz + wx * wy * sz * n;
}

NOINLINE void noise_at(const FLOAT *point, Noise *result)
{
    FLOAT whole[3], rest[3], weights[3][2], slopes[3][2];
    UINT zero = 0u;
    Noise sum;
    sum.f = sum.x = sum.y = sum.z = 0.0f;
    for (uint k = 0; k < 3; k++) {
        whole[k] = whole_part(point[k]);
        rest[k] = point[k] - whole[k];
        fade(rest[k], weights[k], slopes[k]);
    }
    for (uint i = 0; i < 2; i++) {
        UINT of_x = noise_mix(zero, whole_bits(whole[0]) + i);
        for (uint j = 0; j < 2; j++) {
            UINT of_xy = noise_mix(of_x, whole_bits(whole[1]) + j);
            for (uint k = 0; k < 2; k++) {
                UINT h = noise_mix(of_xy, whole_bits(whole[2]) + k);
                noise_corner(h, rest[0] - (float)i, rest[1] - (float)j, rest[2] - (float)k, weights[0][i], weights[1][j], weights[2][k], slopes[0][i], slopes[1][j],
                             slopes[2][k], &sum);
            }
        }
    }
    result->f = 0.96492141f * sum.f;
    result->x = 0.96492141f * sum.x;
    result->y = 0.96492141f * sum.y;
    result->z = 0.96492141f * sum.z;
}

// The distance to the nearest point, which may be more than 1, its derivatives, and the distance to the second.
NOINLINE void cells_at(const FLOAT *point, Noise *result, FLOAT *second)
{
    FLOAT whole[3], rest[3], nearest = 16.0f, next = 16.0f;
    UINT zero = 0u;
    for (uint k = 0; k < 3; k++) {
        whole[k] = whole_part(point[k]);
        rest[k] = point[k] - whole[k];
    }
    Noise r;
    r.x = r.y = r.z = 0.0f;
    for (uint i = 0; i < 3; i++) {
        UINT of_x = noise_mix(zero, whole_bits(whole[0]) + i - 1u);
        for (uint j = 0; j < 3; j++) {
            UINT of_xy = noise_mix(of_x, whole_bits(whole[1]) + j - 1u);
            for (uint k = 0; k < 3; k++) {
                UINT one = 1u, two = 2u;
                UINT h0 = noise_mix(of_xy, whole_bits(whole[2]) + k - 1u), h1 = noise_mix(h0, one), h2 = noise_mix(h1, two);
                FLOAT x = rest[0] - ((float)i - 1.0f) - bits_number(h0), y = rest[1] - ((float)j - 1.0f) - bits_number(h1);
                FLOAT z = rest[2] - ((float)k - 1.0f) - bits_number(h2), square = x * x + y * y + z * z;
                INT nearer = square < nearest;
                next = nearer ? nearest : least(next, square);
                r.x = nearer ? x : r.x;
                r.y = nearer ? y : r.y;
                r.z = nearer ? z : r.z;
                nearest = nearer ? square : nearest;
            }
        }
    }
    r.f = root(nearest);
    *second = root(next);
    FLOAT scale = 1.0f / most(r.f, 1e-20f), nothing = NAN;
    INT known = (rest[0] == rest[0]) & (rest[1] == rest[1]) & (rest[2] == rest[2]); // not of what is infinite
    r.x *= scale;
    r.y *= scale;
    r.z *= scale;
    r.f = known ? r.f : nothing;
    *result = r;
}

// The value that a tape has, and its derivatives, which are 0 where no point is near.
static void noise_value(uint op, const FLOAT *point, Noise *result)
{
    FLOAT second, zero = 0.0f, one = 1.0f;
    if (op == TAPE_NOISE) {
        noise_at(point, result);
        return;
    }
    cells_at(point, result, &second);
    INT far = result->f > 1.0f;
    result->f = far ? one : result->f;
    result->x = far ? zero : result->x;
    result->y = far ? zero : result->y;
    result->z = far ? zero : result->z;
}

// What the slopes may differ by from those in the middle of a box with those half sides, `none` where that is not known.
static void noise_bends(const FLOAT *sides, FLOAT *by)
{
    FLOAT all = sides[0] + sides[1] + sides[2];
    for (uint k = 0; k < 3; k++) by[k] = (NOISE_TWIST * all + (NOISE_BEND - NOISE_TWIST) * sides[k]) * 1.000001f + NOISE_SLOPE_ROUNDING;
}

// The range of the operation over a box, and those of its three slopes.
NOINLINE void noise_range(uint op, const FLOAT *low, const FLOAT *high, FLOAT *f_low, FLOAT *f_high, FLOAT *slope_low, FLOAT *slope_high)
{
    FLOAT middle[3], sides[3], by[3], slopes[3], zero = 0.0f, one = 1.0f, steepest = op == TAPE_NOISE ? NOISE_SLOPE : 1.0f, second = 0.0f;
    FLOAT rounding = op == TAPE_NOISE ? NOISE_ROUNDING : CELLS_ROUNDING, least_value = op == TAPE_NOISE ? -1.0f : 0.0f;
    Noise n;
    INT near = low[0] == low[0];
    for (uint k = 0; k < 3; k++) {
        middle[k] = 0.5f * low[k] + 0.5f * high[k];
        sides[k] = most(high[k] - middle[k], middle[k] - low[k]) * 1.000001f;
        near = near & (sides[k] <= 1.0f);
        sides[k] = sides[k] <= 1.0f ? sides[k] : one;
        middle[k] = size_of(middle[k]) < 1e30f ? middle[k] : zero;
    }
    if (op == TAPE_NOISE) {
        noise_at(middle, &n);
        noise_bends(sides, by);
    } else {
        cells_at(middle, &n, &second);
        FLOAT radius = root(sides[0] * sides[0] + sides[1] * sides[1] + sides[2] * sides[2]) * 1.000001f + CELLS_ROUNDING;
        FLOAT turn = radius / (n.f - radius) * 1.00001f + 2e-5f;
        INT alone = (second - n.f > 2.0f * radius + CELLS_ROUNDING) & (n.f > 2.0f * radius) & (n.f + radius < 1.0f), far = n.f - radius > 1.0f;
        turn = alone ? turn : (FLOAT)(2.0f);
        for (uint k = 0; k < 3; k++) by[k] = far ? zero : turn;
        n.f = least(n.f, one);
        n.x = far ? zero : n.x;
        n.y = far ? zero : n.y;
        n.z = far ? zero : n.z;
    }
    slopes[0] = n.x;
    slopes[1] = n.y;
    slopes[2] = n.z;
    FLOAT away = rounding;
    for (uint k = 0; k < 3; k++) {
        slope_low[k] = near ? most(slopes[k] - by[k], -steepest) : -steepest;
        slope_high[k] = near ? least(slopes[k] + by[k], steepest) : steepest;
        away += most(-slope_low[k], slope_high[k]) * sides[k];
    }
    away *= 1.000001f;
    *f_low = near ? most(n.f - away, least_value) : least_value;
    *f_high = near ? least(n.f + away, one) : one;
}
