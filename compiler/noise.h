// The hash behind random(), noise() and cells(), and the two of them, in double. These functions are the definition: whatever evaluates them
// elsewhere, an OpenCL kernel for one, gives the same hashes bit for bit and the same values to rounding.
//
//     mix(h, w)       fmix((h + 0x9e3779b9) ^ w), all modulo 2^32
//     fmix(h)         h ^= h >> 16; h *= 0x85ebca6b; h ^= h >> 13; h *= 0xc2b2ae35; h ^= h >> 16      (the finalizer of MurmurHash3)
//     corner(i, j, k) mix(mix(mix(0, i), j), k), i, j, k the two's complements of the whole numbers in 32 bits
//
// noise(p): gradient noise. With c = floor(p), r = p - c, and each of the eight corners c + o, o in {0, 1}^3:
//
//     g(h)     the twelve vectors from a cube's centre to the middles of its edges, by the low four bits of h = corner(c + o) as in the table of
//              noise.c (four of them occur twice)
//     n_o      g · (r - o)
//     noise    0.964921414852142333984375 · the n_o, mixed along x, then y, then z by the fade f(s) = s³ (10 + s (6 s - 15)) of r's parts
//
// It is 0 at whole points, has continuous second derivatives, and stays in -1 … 1: the factor is 1 over the greatest sum that there is.
//
// cells(p): the distance to the nearest of scattered points, at most 1. Each cell of whole numbers c has one, at
//
//     c + (h0, h1, h2) / 2^32,    h0 = corner(c), h1 = mix(h0, 1), h2 = mix(h1, 2)
//
// Points two cells away are farther than 1, so the 27 cells around p are all that count.
#ifndef SCN_COMPILER_NOISE_H
#define SCN_COMPILER_NOISE_H

#include <stdint.h>

uint32_t noise_mix(uint32_t hash, uint32_t word);

// One more whole number, |key| <= 2^53, into a hash in 0 … 2^32 - 1: the low 32 bits of its two's complement in 64, then the high ones. A hash
// begins at 0. NaN where the arguments are not such numbers.
double noise_hash(double hash, double key);

double noise_gradient(double x, double y, double z);
double noise_cells(double x, double y, double z);

// The same with the three derivatives.
double noise_gradient_slopes(const double point[3], double slopes[3]);
double noise_cells_slopes(const double point[3], double slopes[3]);

#endif
