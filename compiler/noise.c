// No table of random numbers, since kernels would have to carry it: a hash of two multiplications is as good. No square
// root but the last one, and no function that rounds differently on another machine.
#include "compiler/noise.h"

#include <math.h>
#include <stddef.h>

uint32_t noise_mix(uint32_t hash, uint32_t word)
{
    uint32_t h = (hash + 0x9e3779b9u) ^ word;
    h ^= h >> 16;
    h *= 0x85ebca6bu;
    h ^= h >> 13;
    h *= 0xc2b2ae35u;
    return h ^ h >> 16;
}

double noise_hash(double hash, double key)
{
    if (!(hash >= 0 && hash <= UINT32_MAX) || !(fabs(key) <= 0x1p53)) return NAN;
    uint64_t bits = (uint64_t)(int64_t)key;
    return noise_mix(noise_mix((uint32_t)hash, (uint32_t)bits), (uint32_t)(bits >> 32));
}

// The low 32 bits of a whole number in two's complement, of any size.
static uint32_t whole_bits(double whole)
{
    return (uint32_t)(int64_t)fmod(whole, 0x1p32);
}

static double fade(double s)
{
    return s * s * s * (10 + s * (6 * s - 15));
}

static double fade_slope(double s)
{
    return 30 * s * s * (1 - s) * (1 - s);
}

static double mixed(double a, double b, double t)
{
    return a + t * (b - a);
}

// g . (x, y, z), and g.
static double direction(uint32_t hash, double x, double y, double z, double g[3])
{
    static const signed char directions[16][3] = {
        {1, 1, 0}, {-1, 1, 0}, {1, -1, 0}, {-1, -1, 0}, {1, 0, 1}, {-1, 0, 1}, {1, 0, -1}, {-1, 0, -1},
        {0, 1, 1}, {0, -1, 1}, {0, 1, -1}, {0, -1, -1}, {1, 1, 0}, {-1, 1, 0}, {0, -1, 1}, {0, -1, -1},
    };
    for (int k = 0; k < 3; k++) g[k] = directions[hash & 15][k];
    return g[0] * x + g[1] * y + g[2] * z;
}

static const double SCALE = 0.964921414852142333984375;

double noise_gradient_slopes(const double point[3], double slopes[3])
{
    double c[3], r[3], t[3], n[2][2][2], g[2][2][2][3];
    for (int k = 0; k < 3; k++) {
        c[k] = floor(point[k]);
        r[k] = point[k] - c[k];
        t[k] = fade(r[k]);
    }
    for (int i = 0; i < 2; i++) {
        uint32_t of_x = noise_mix(0, whole_bits(c[0]) + (uint32_t)i);
        for (int j = 0; j < 2; j++) {
            uint32_t of_xy = noise_mix(of_x, whole_bits(c[1]) + (uint32_t)j);
            for (int k = 0; k < 2; k++)
                n[k][j][i] = direction(noise_mix(of_xy, whole_bits(c[2]) + (uint32_t)k), r[0] - i, r[1] - j, r[2] - k,
                                       g[k][j][i]);
        }
    }
    double along_x[2][2], along_y[2];
    for (int k = 0; k < 2; k++) {
        for (int j = 0; j < 2; j++) along_x[k][j] = mixed(n[k][j][0], n[k][j][1], t[0]);
        along_y[k] = mixed(along_x[k][0], along_x[k][1], t[1]);
    }
    for (int axis = 0; axis < 3 && slopes; axis++) { // of the directions, mixed, and of the mixing
        double by_x[2];
        for (int k = 0; k < 2; k++) {
            by_x[k] = mixed(mixed(g[k][0][0][axis], g[k][0][1][axis], t[0]),
                            mixed(g[k][1][0][axis], g[k][1][1][axis], t[0]), t[1]);
            if (axis == 0) by_x[k] += fade_slope(r[0]) * mixed(n[k][0][1] - n[k][0][0], n[k][1][1] - n[k][1][0], t[1]);
            if (axis == 1) by_x[k] += fade_slope(r[1]) * (along_x[k][1] - along_x[k][0]);
        }
        slopes[axis] = mixed(by_x[0], by_x[1], t[2]);
        if (axis == 2) slopes[axis] += fade_slope(r[2]) * (along_y[1] - along_y[0]);
        slopes[axis] *= SCALE;
    }
    return SCALE * mixed(along_y[0], along_y[1], t[2]);
}

double noise_gradient(double x, double y, double z)
{
    return noise_gradient_slopes((const double[3]){x, y, z}, NULL);
}

double noise_cells_slopes(const double point[3], double slopes[3])
{
    double c[3], r[3], nearest = 1;
    for (int k = 0; k < 3; k++) {
        c[k] = floor(point[k]);
        r[k] = point[k] - c[k];
        if (slopes) slopes[k] = 0;
    }
    for (int i = -1; i <= 1; i++) {
        uint32_t of_x = noise_mix(0, whole_bits(c[0]) + (uint32_t)i);
        for (int j = -1; j <= 1; j++) {
            uint32_t of_xy = noise_mix(of_x, whole_bits(c[1]) + (uint32_t)j);
            for (int k = -1; k <= 1; k++) {
                uint32_t h0 = noise_mix(of_xy, whole_bits(c[2]) + (uint32_t)k), h1 = noise_mix(h0, 1),
                         h2 = noise_mix(h1, 2);
                double away[3] = {r[0] - i - h0 * 0x1p-32, r[1] - j - h1 * 0x1p-32, r[2] - k - h2 * 0x1p-32};
                double square = away[0] * away[0] + away[1] * away[1] + away[2] * away[2];
                if (!(square < nearest)) continue;
                nearest = square;
                for (int axis = 0; axis < 3 && slopes; axis++) slopes[axis] = away[axis] / sqrt(square);
            }
        }
    }
    return sqrt(nearest);
}

double noise_cells(double x, double y, double z)
{
    return noise_cells_slopes((const double[3]){x, y, z}, NULL);
}
