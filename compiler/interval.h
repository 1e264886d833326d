// Intervals in double: what an operation may give for any numbers of its operands' intervals.
//
// [low, high] with infinite ends allowed; empty (low > high) where the operation is undefined for all of them. `partial`
// says that it may be undefined for some. Every end is moved outwards by more than the operation's rounding, so the
// real value of the operation on real numbers is in the result: one unit in the last place for arithmetic and roots,
// four for the functions of the C library (glibc's stated errors are below two).
//
//     Interval a = {1, 2}, b = {-1, 1};
//     interval_op2(TAPE_DIV, a, b)      // [-inf, inf]
#ifndef SCN_COMPILER_INTERVAL_H
#define SCN_COMPILER_INTERVAL_H

#include <stdbool.h>
#include <stdint.h>

typedef struct Interval {
    double low, high;
    bool partial; // may be undefined for some of the operands
} Interval;

Interval interval_of(double low, double high);
Interval interval_empty(void);
Interval interval_hull(Interval a, Interval b);
bool interval_is_empty(Interval a);

// The operations of kernels/tape_shared.h. TAPE_SELECT has operands of its own.
Interval interval_op1(uint32_t op, Interval a);
Interval interval_op2(uint32_t op, Interval a, Interval b);
Interval interval_op3(uint32_t op, const Interval place[3]); // TAPE_NOISE, TAPE_CELLS
Interval interval_power(Interval a, uint32_t exponent);      // exponent >= 2
Interval interval_select(Interval condition, Interval a, Interval b);

#endif
