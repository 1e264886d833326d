// Slices: the picture of where a condition on two numbers holds, as the host (runtime/slice.c) gives it to the kernels (slice.cl).
//
// A program is a list of steps: first those that compute numbers, as tapes do (tape_shared.h), then comparisons of numbers, then AND and OR of what is
// before them; the last one is whether a point is inside. Numbers 0 and 1 are the point's place across and up, step k gives number 2 + k. Conditions
// are numbered by themselves, comparisons first.
//
// A step's word:
//
//     bits 0-5    operation: of tape_shared.h, or one of those below
//     bit  6      SLICE_LITERAL: there is no second operand; b is a float, or what the operation says
//     bit  7      SLICE_DOUBT: the number may be undefined or without bounds
//     bits 8-9    what the first operand depends on: SLICE_ACROSS, SLICE_UP, both, or nothing
//     bits 10-11  the same of the second
//     bit  12     SLICE_VANISHES: of a sum or difference, an operand may be 0 all over a tile
//     bits 14-15  the same of the result
//     bits 16-31  first operand
//
// and b is the second operand, or a float. Of what TAPE_TAKES_THREE b holds two operands of 16 bits, which depend on both.
//
// The same text is compiled by both sides (shared.h says how).
#ifndef SCN_KERNELS_SLICE_SHARED_H
#define SCN_KERNELS_SLICE_SHARED_H

#define SLICE_BELOW 40u    // a < b, a float
#define SLICE_FROM 41u     // a >= b, a float
#define SLICE_LESS 42u     // a < b
#define SLICE_NOT_LESS 43u // a >= b
#define SLICE_AND 44u
#define SLICE_OR 45u
#define SLICE_SPREAD 46u // the same number, as one that depends on both

#define SLICE_LITERAL 64u
#define SLICE_DOUBT 128u
#define SLICE_VANISHES 4096u
#define SLICE_ACROSS 1u
#define SLICE_UP 2u
#define SLICE_CLASS_A(word) ((word) >> 8 & 3u)
#define SLICE_CLASS_B(word) ((word) >> 10 & 3u)
#define SLICE_CLASS(word) ((word) >> 14 & 3u)
#define SLICE_A(word) ((word) >> 16)
#define SLICE_KEY(word) ((word) & 127u) // operation and SLICE_LITERAL

#define SLICE_POINT 2u
#define SLICE_STEPS_MAX 65000u // of a program; operands have 16 bits

// Tiles are squares of 16, 64, 256 … pixels; a pass looks at the 4 x 4 parts of each tile that is not decided.
#define SLICE_LEAF 16u
#define SLICE_LEVELS 8 // of tiles that have parts: 64 … 1048576 pixels
#define SLICE_MIXED_MAX 2048u // numbers of a tile of 16 x 16 that depend on both; tiles with more are done row by row

typedef struct SliceNode { // a tile that is not decided
    unsigned x, y;         // its first pixel
    unsigned first;        // of its program's steps
    unsigned numbers, compares, logics;
    unsigned parts; // a bit each: those that are looked at
    unsigned unused;
} SliceNode;

typedef struct SliceFrame {
    unsigned width, height; // pixels
    unsigned stride;        // of the picture's rows, in units of 16 pixels; a multiple of 4
    unsigned pool;          // steps that there is room for
    unsigned numbers, conditions, mixed; // of the program; mixed: numbers that depend on both, SLICE_MIXED_MAX at most
    unsigned room;          // of a work-item's memory, in bytes
} SliceFrame;

// Counters: steps in the pool, then of each level how many tiles are there and how many have been taken.
#define SLICE_COUNT_POOL 0
#define SLICE_COUNT_NODES(level) (1 + 2 * (level))
#define SLICE_COUNT_TAKEN(level) (2 + 2 * (level))
#define SLICE_COUNTERS (3 + 2 * SLICE_LEVELS)

// Memory of a work-item, in bytes, all parts in units of 64.
#define SLICE_ROUND(bytes) (((bytes) + 63u) & ~63u)
#define SLICE_RANGES 0u // ranges of numbers, and where there are none any more numbers
#define SLICE_MIXED(n) (SLICE_RANGES + 128u * ((n) + SLICE_POINT))                          // numbers of 16 rows
#define SLICE_NEED(n, mixed) (SLICE_MIXED(n) + 1024u * (mixed))                             // parts that need a number
#define SLICE_CHOICE(n, mixed) (SLICE_NEED(n, mixed) + SLICE_ROUND(2u * ((n) + SLICE_POINT))) // of MIN and MAX, for each part
#define SLICE_MAP(n, mixed) (SLICE_CHOICE(n, mixed) + SLICE_ROUND(4u * ((n) + SLICE_POINT))) // new numbers, for each part
#define SLICE_KNOWN(n, mixed) (SLICE_MAP(n, mixed) + SLICE_ROUND(32u * ((n) + SLICE_POINT)))      // conditions known for a part
#define SLICE_WANT(n, c, mixed) (SLICE_KNOWN(n, mixed) + SLICE_ROUND(4u * (c)))             // parts that need a condition
#define SLICE_PLACE(n, c, mixed) (SLICE_WANT(n, c, mixed) + SLICE_ROUND(2u * (c)))          // its new number, for each part
#define SLICE_BITS(n, c, mixed) (SLICE_PLACE(n, c, mixed) + SLICE_ROUND(32u * (c)))         // conditions of 256 pixels
#define SLICE_STEPS(n, c, mixed) (SLICE_BITS(n, c, mixed) + SLICE_ROUND(32u * (c)))         // programs of parts of 16 x 16
#define SLICE_ROOM(n, c, mixed) (SLICE_STEPS(n, c, mixed) + 128u * ((n) + (c)))

#endif
