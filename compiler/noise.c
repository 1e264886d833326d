// No table of random numbers, since kernels would have to carry it: a hash of two multiplications is as good. No square
// root but the last one, and no function that rounds differently on another machine.
#include "compiler/noise.h"

#include <math.h>

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

static double mixed(double a, double b, double t)
{
    return a + t * (b - a);
}

static double slope(uint32_t hash, double x, double y, double z)
{
    static const signed char directions[16][3] = {
        {1, 1, 0}, {-1, 1, 0}, {1, -1, 0}, {-1, -1, 0}, {1, 0, 1}, {-1, 0, 1}, {1, 0, -1}, {-1, 0, -1},
        {0, 1, 1}, {0, -1, 1}, {0, 1, -1}, {0, -1, -1}, {1, 1, 0}, {-1, 1, 0}, {0, -1, 1}, {0, -1, -1},
    };
    const signed char *g = directions[hash & 15];
    return g[0] * x + g[1] * y + g[2] * z;
}

double noise_gradient(double x, double y, double z)
{
    double cx = floor(x), cy = floor(y), cz = floor(z), u, n[2][2][2];
    x -= cx, y -= cy, z -= cz;
    for (int i = 0; i < 2; i++) {
        uint32_t of_x = noise_mix(0, whole_bits(cx + i));
        for (int j = 0; j < 2; j++) {
            uint32_t of_xy = noise_mix(of_x, whole_bits(cy + j));
            for (int k = 0; k < 2; k++) n[k][j][i] = slope(noise_mix(of_xy, whole_bits(cz + k)), x - i, y - j, z - k);
        }
    }
    u = fade(x);
    double v = fade(y), w = fade(z), along_y[2];
    for (int k = 0; k < 2; k++)
        along_y[k] = mixed(mixed(n[k][0][0], n[k][0][1], u), mixed(n[k][1][0], n[k][1][1], u), v);
    return 0.964921414852142333984375 * mixed(along_y[0], along_y[1], w);
}

double noise_cells(double x, double y, double z)
{
    double cx = floor(x), cy = floor(y), cz = floor(z), nearest = 1;
    for (int i = -1; i <= 1; i++) {
        uint32_t of_x = noise_mix(0, whole_bits(cx + i));
        for (int j = -1; j <= 1; j++) {
            uint32_t of_xy = noise_mix(of_x, whole_bits(cy + j));
            for (int k = -1; k <= 1; k++) {
                uint32_t h0 = noise_mix(of_xy, whole_bits(cz + k)), h1 = noise_mix(h0, 1), h2 = noise_mix(h1, 2);
                double dx = cx + i - x + h0 * 0x1p-32, dy = cy + j - y + h1 * 0x1p-32, dz = cz + k - z + h2 * 0x1p-32;
                nearest = fmin(nearest, dx * dx + dy * dy + dz * dz);
            }
        }
    }
    return sqrt(nearest);
}
