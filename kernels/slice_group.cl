// What the functions of groups are made of (compiler/formula_emit.c writes them): operations on ranges and on pixels.

#define ALONE(x) ((Range){all_of(x), all_of(x)})
#define EACH(x) all_of(((const float *)&(x))[row])

#define RANGE_ADD(a, b) range_sum(a, b)
#define RANGE_SUB(a, b) range_difference(a, b)
#define RANGE_BACK_SUB(a, b) range_difference(b, a)
#define RANGE_MUL(a, b) product_range(a, b)
#define RANGE_DIV(a, b) quotient_range(a, b)
#define RANGE_BACK_DIV(a, b) quotient_range(b, a)
#define RANGE_MIN(a, b) range_least(a, b)
#define RANGE_MAX(a, b) range_most(a, b)
#define RANGE_NEG(a) range_minus(a)
#define RANGE_ABS(a) absolute_range(a)
#define RANGE_SQUARE(a) square_range(a)
#define RANGE_SQRT(a) range_of_root(a)

INLINE Range range_sum(Range a, Range b) { return (Range){a.low + b.low, a.high + b.high}; }
INLINE Range range_difference(Range a, Range b) { return (Range){a.low - b.high, a.high - b.low}; }
INLINE Range range_least(Range a, Range b) { return (Range){least(a.low, b.low), least(a.high, b.high)}; }
INLINE Range range_most(Range a, Range b) { return (Range){most(a.low, b.low), most(a.high, b.high)}; }
INLINE Range range_minus(Range a) { return (Range){-a.high, -a.low}; }
INLINE Range range_of_root(Range a) { return (Range){sqrt(most(a.low, all_of(0.0f))), sqrt(most(a.high, all_of(0.0f)))}; }

#define POINT_ADD(a, b) ((a) + (b))
#define POINT_SUB(a, b) ((a) - (b))
#define POINT_BACK_SUB(a, b) ((b) - (a))
#define POINT_MUL(a, b) ((a) * (b))
#define POINT_DIV(a, b) ((a) / (b))
#define POINT_BACK_DIV(a, b) ((b) / (a))
#define POINT_MIN(a, b) least(b, a)
#define POINT_MAX(a, b) most(b, a)
#define POINT_NEG(a) (-(a))
#define POINT_ABS(a) absolute(a)
#define POINT_SQUARE(a) ((a) * (a))
#define POINT_SQRT(a) sqrt(a)

INLINE FLOAT absolute(FLOAT a) { return a < 0.0f ? -a : a; }

// Comparisons of ranges with floats and with ranges: bits 0-15 where they hold all over, 16-31 where they hold nowhere.
#define KNOWN_BELOW(a, t) (mask_bits((a).high < (t)) | mask_bits((a).low >= (t)) << 16)
#define KNOWN_FROM(a, t) (mask_bits((a).low >= (t)) | mask_bits((a).high < (t)) << 16)
#define KNOWN_LESS(a, b) (mask_bits((a).high < (b).low) | mask_bits((a).low >= (b).high) << 16)
#define KNOWN_NOT_LESS(a, b) (mask_bits((a).low >= (b).high) | mask_bits((a).high < (b).low) << 16)
#define KNOWN_AND(a, b) ((a) & (b) & 0xffffu | ((a) | (b)) & 0xffff0000u)
#define KNOWN_OR(a, b) (((a) | (b)) & 0xffffu | (a) & (b) & 0xffff0000u)

#define POINT_BELOW(a, t) ((a) < (t))
#define POINT_FROM(a, t) ((a) >= (t))
#define POINT_LESS(a, b) ((a) < (b))
#define POINT_NOT_LESS(a, b) ((a) >= (b))
#define ROWS_ALIKE(mask) ((ushort16)((ushort)mask_bits(mask)))
#define COLUMNS_ALIKE(mask) convert_ushort16(mask)
#define PIXELS_AND(a, b) ((a) & (b))
#define PIXELS_OR(a, b) ((a) | (b))
