#include "tests/oracle/oracle_noise.h"

#include <math.h>
#include <stdint.h>

static uint32_t hash_of(uint32_t hash, uint32_t word)
{
    uint32_t h = (hash + 0x9e3779b9u) ^ word;
    h = (h ^ h >> 16) * 0x85ebca6bu;
    h = (h ^ h >> 13) * 0xc2b2ae35u;
    return h ^ h >> 16;
}

static uint32_t corner(const long double c[3], int i, int j, int k)
{
    const int o[3] = {i, j, k};
    uint32_t hash = 0;
    for (int axis = 0; axis < 3; axis++) {
        uint32_t whole = (uint32_t)(int64_t)fmodl(c[axis], 0x1p32L);
        hash = hash_of(hash, whole + (uint32_t)o[axis]);
    }
    return hash;
}

// A corner's weight along an axis, and its derivative.
static long double weight(long double s, int side, long double *slope)
{
    long double f = s * s * s * (10 + s * (6 * s - 15));
    *slope = (side ? 30 : -30) * s * s * (1 - s) * (1 - s);
    return side ? f : 1 - f;
}

long double oracle_noise(const long double p[3], long double slopes[3])
{
    static const int directions[16][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                                          {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1},
                                          {1, 1, 0},  {-1, 1, 0},  {0, -1, 1}, {0, -1, -1}};
    long double c[3], sum = 0;
    for (int k = 0; k < 3; k++) c[k] = floorl(p[k]), slopes[k] = 0;
    for (int o = 0; o < 8; o++) {
        const int *g = directions[corner(c, o & 1, o >> 1 & 1, o >> 2) & 15];
        long double n = 0, w[3], s[3], product = 1;
        for (int k = 0; k < 3; k++) {
            w[k] = weight(p[k] - c[k], o >> k & 1, &s[k]);
            n += g[k] * (p[k] - c[k] - (o >> k & 1));
            product *= w[k];
        }
        sum += product * n;
        for (int k = 0; k < 3; k++) slopes[k] += product * g[k] + s[k] * w[(k + 1) % 3] * w[(k + 2) % 3] * n;
    }
    for (int k = 0; k < 3; k++) slopes[k] *= 0.964921414852142333984375L;
    return 0.964921414852142333984375L * sum;
}

long double oracle_cells(const long double p[3], long double slopes[3], bool *alone)
{
    long double c[3], nearest = 1, second = 2;
    for (int k = 0; k < 3; k++) c[k] = floorl(p[k]), slopes[k] = 0;
    for (int o = 0; o < 27; o++) {
        int place[3] = {o % 3 - 1, o / 3 % 3 - 1, o / 9 - 1};
        uint32_t h = corner(c, place[0], place[1], place[2]);
        long double away[3], square = 0;
        for (int k = 0; k < 3; k++) {
            if (k) h = hash_of(h, (uint32_t)k);
            away[k] = p[k] - c[k] - place[k] - h * 0x1p-32L;
            square += away[k] * away[k];
        }
        second = fminl(second, fmaxl(square, nearest));
        if (square >= nearest) continue;
        nearest = square;
        for (int k = 0; k < 3; k++) slopes[k] = away[k] / sqrtl(square);
    }
    *alone = second - nearest > 1e-9L && nearest > 1e-9L;
    return sqrtl(nearest);
}
