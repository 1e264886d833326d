// Packets: a work-item does LANES rays at once, one on GPUs (WIDTH 1), on CPUs two packets of 16 (WIDTH 16): a block of 8 x 4 pixels. All code is
// written for the types FLOAT, INT and UINT, which are vectors or scalars.
//
// A comparison gives -1 in lanes of a vector and 1 as a scalar, so masks are joined by & and | and negated by !, and never
// counted or mixed with numbers. `mask ? a : b` chooses by lane.
//
// Two packets side by side hide each other's latencies: one waits for a chain of dependent multiplications or a division while the other goes on. The
// compiler is left to interleave them: it makes two instructions of each on a vector of 32.
#ifndef WIDTH
#define WIDTH 16
#endif
#ifndef PACKETS_SIDE_BY_SIDE
#define PACKETS_SIDE_BY_SIDE 1
#endif

#ifdef __has_builtin
#if __has_builtin(__builtin_reduce_or)
#define HAS_REDUCE 1
#endif
#if WIDTH == 16 && defined(__AVX512DQ__) && __has_builtin(__builtin_ia32_cvtd2mask512)
#define HAS_MASKS 1
#endif
#endif

#if WIDTH == 16
#if PACKETS_SIDE_BY_SIDE == 2
#define LANES 32
#define BLOCK_ACROSS 8
typedef float FLOAT __attribute__((ext_vector_type(32)));
typedef int INT __attribute__((ext_vector_type(32)));
typedef uint UINT __attribute__((ext_vector_type(32)));
#define BY_HALVES(function, x) \
    FLOAT result;              \
    result.lo = function(x.lo); \
    result.hi = function(x.hi); \
    return result;
#define LANE_X ((FLOAT)(0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 4, 5, 6, 7, 4, 5, 6, 7, 4, 5, 6, 7, 4, 5, 6, 7))
#define LANE_Y ((FLOAT)(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3))
#define FIRST_HALF(x) x.lo
#define SECOND_HALF(x) x.hi
#else
#define LANES 16
#define BLOCK_ACROSS 4
typedef float16 FLOAT;
typedef int16 INT;
typedef uint16 UINT;
#define BY_HALVES(function, x) return function(x);
#define LANE_X ((FLOAT)(0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3))
#define LANE_Y ((FLOAT)(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3))
#endif
#define BLOCK_DOWN 4
#ifdef HAS_MASKS // comparisons leave masks in registers of their own, which are tested as they are: 1 % of a frame of S1 less than by reducing
#define ANY(mask) any_lane(mask)
#elif defined(HAS_REDUCE) // `any` of a vector is done lane by lane in PoCL 3.1: 15 % of the primary pass
#define ANY(mask) (__builtin_reduce_or(mask) != 0)
#elif LANES == 32
#define ANY(mask) any((mask).lo | (mask).hi)
#else
#define ANY(mask) any(mask)
#endif
#define BARRIER // one work-item a work-group
#else
#define LANES 1
#define BLOCK_ACROSS 1
#define BLOCK_DOWN 1
typedef float FLOAT;
typedef int INT;
typedef uint UINT;
#define BY_HALVES(function, x) return function(x);
#define LANE_X 0.0f
#define LANE_Y 0.0f
#define ANY(mask) (mask)
#define BARRIER barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE)
#endif

#define BLOCKS_ACROSS (TILE_SIZE / BLOCK_ACROSS)
#define BLOCKS (BLOCKS_ACROSS * TILE_SIZE / BLOCK_DOWN) // of a tile

#define NO_LEAF 0xffffffffu // no rank of a leaf
#define SHARED_SIZE (5 * 256) // of a work-group's scratch; work-groups have at most 256 items
#define BIG 1e9f // roots beyond it count as infinite

// What every ray runs is inlined into the kernel, so that packets stay in registers (8 % of a frame of S1); what few rays run is kept out of its way.
// Compilers for GPUs inline everything as it is.
#if WIDTH == 16
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static
#endif
#define NOINLINE __attribute__((noinline))

// A pass over the packets of a tile. One function each and no barrier in it, where packets are work-items: the compiler takes a third less time for several
// small functions than for one large one (2.0 s instead of 2.8 s for S1), and frames take no longer, or 4 % less (S4).
#if WIDTH == 16
#define PASS static NOINLINE
#else
#define PASS static
#endif

#if WIDTH == 16 && defined(__AVX512F__) && defined(__has_builtin)
#if __has_builtin(__builtin_ia32_rcp14ps512_mask) && __has_builtin(__builtin_ia32_rsqrt14ps512_mask)
#define HAS_ROUGH 1
#endif
#if __has_builtin(__builtin_ia32_addps512) && __has_builtin(__builtin_ia32_subps512) && __has_builtin(__builtin_ia32_mulps512)
#define HAS_DIRECTED 1 // arithmetic that is rounded as each operation says
#endif
#endif

#ifdef HAS_ROUGH
// Estimates of 14 bits, and one step of Newton where they do not suffice: a division takes as long as sixteen multiplications, and a square root
// longer (4 % of a frame of S1).
INLINE float16 rough_reciprocal16(float16 x)
{
    return __builtin_ia32_rcp14ps512_mask(x, x, (ushort)0xffff);
}

INLINE float16 inverse_root16(float16 x)
{
    float16 y = __builtin_ia32_rsqrt14ps512_mask(x, x, (ushort)0xffff);
    return y * (1.5f - 0.5f * x * y * y);
}

INLINE float16 root16(float16 x)
{
    float16 y = __builtin_ia32_rsqrt14ps512_mask(x, x, (ushort)0xffff);
    float16 s = x * y;
    s += 0.5f * y * (x - s * s);
    return x == 0.0f ? x : s;
}
#else
#define rough_reciprocal16(x) (1.0f / (x))
#define inverse_root16 rsqrt
#define root16 sqrt
#endif

#ifdef HAS_MASKS
INLINE int any_lane(INT mask)
{
#if LANES == 32
    return (ushort)(__builtin_ia32_cvtd2mask512(mask.lo) | __builtin_ia32_cvtd2mask512(mask.hi)) != 0;
#else
    return (ushort)__builtin_ia32_cvtd2mask512(mask) != 0;
#endif
}
#endif

INLINE FLOAT root(FLOAT x)
{
    BY_HALVES(root16, x)
}

INLINE FLOAT inverse_root(FLOAT x)
{
    BY_HALVES(inverse_root16, x)
}

// 1 / x to at least 14 bits: for steps that need not be exact.
INLINE FLOAT rough_reciprocal(FLOAT x)
{
    BY_HALVES(rough_reciprocal16, x)
}

static FLOAT base2_power(FLOAT x)
{
    BY_HALVES(exp2, x)
}

static FLOAT base2_logarithm(FLOAT x)
{
    BY_HALVES(log2, x)
}

// One instruction each, where min() and max() take several to keep their promises about what is not a number.
static FLOAT least(FLOAT a, FLOAT b)
{
    return a < b ? a : b;
}

static FLOAT most(FLOAT a, FLOAT b)
{
    return a > b ? a : b;
}

static FLOAT size_of(FLOAT x)
{
    return most(x, -x);
}

#if WIDTH == 16
static float16 least16(float16 a, float16 b)
{
    return a < b ? a : b;
}

static float16 most16(float16 a, float16 b)
{
    return a > b ? a : b;
}

static float4 lowest_of_four16(float16 a, float16 b, float16 c, float16 d)
{
    float16 ab = least16((float16)(a.lo, b.lo), (float16)(a.hi, b.hi)), cd = least16((float16)(c.lo, d.lo), (float16)(c.hi, d.hi));
    float16 all = least16((float16)(ab.s0123, ab.s89ab, cd.s0123, cd.s89ab), (float16)(ab.s4567, ab.scdef, cd.s4567, cd.scdef));
    all = least16(all, all.s1032547698badcfe);
    all = least16(all, all.s23016745ab89efcd);
    return all.s048c;
}

static float highest16(float16 x)
{
    x = most16(x, x.s89abcdef01234567);
    x = most16(x, x.s456701234567cdef);
    x = most16(x, x.s23016745ab89efcd);
    return most16(x, x.s1032547698badcfe).s0;
}

static uint highest_uint16(uint16 x)
{
    uint8 a = max(x.lo, x.hi);
    uint4 b = max(a.lo, a.hi);
    return max(max(b.x, b.y), max(b.z, b.w));
}

#if LANES == 32
#define lowest_of_four(a, b, c, d) lowest_of_four16(least16((a).lo, (a).hi), least16((b).lo, (b).hi), least16((c).lo, (c).hi), least16((d).lo, (d).hi))
#define highest(x) highest16(most16((x).lo, (x).hi))
#define highest_uint(x) highest_uint16(max((x).lo, (x).hi))
#else
#define lowest_of_four(a, b, c, d) lowest_of_four16(a, b, c, d)
#define highest(x) highest16(x)
#define highest_uint(x) highest_uint16(x)
#endif

// The bits of a mask of 16, lane 0 the lowest.
static uint mask_bits(int16 mask)
{
#ifdef HAS_MASKS
    return (uint)__builtin_ia32_cvtd2mask512(mask) & 0xffffu;
#else
    // Its bytes, gathered by a multiplication.
    ulong2 bytes = (as_ulong2(convert_char16(mask)) & 0x0101010101010101ul) * 0x0102040810204080ul;
    return (uint)(bytes.x >> 56) | (uint)(bytes.y >> 56) << 8;
#endif
}

#if LANES == 32
#define packet_bits(mask) (mask_bits((mask).lo) | mask_bits((mask).hi) << 16)
#else
#define packet_bits(mask) mask_bits(mask)
#endif
#else
#define lowest_of_four(a, b, c, d) ((float4)(a, b, c, d))
#define highest(x) (x)
#define highest_uint(x) (x)
#endif

#ifdef HAS_FIELD
struct FieldTile; // cells.cl
struct FieldMemory;
#endif

typedef struct Rect { // of U, V, and how far w goes
    float u_low, u_high, v_low, v_high, w_high;
} Rect;

// What a ray (a packet of them) brings to every function that looks for its hits.
typedef struct Ray {
    FLOAT u, v;
    float kappa;
    __global const QuadricRecord *records; // of the view
    __global const PlanNode *nodes;
    __global const uint *list; // numbers of the items that can matter here, ascending
    uint count;
#ifdef HAS_COPIES
    uint copied; // numbers from here on are of records that belong to the number before them in the list (copies.cl)
#endif
#ifdef HAS_FIELD
    __global const TapeStep *tapes;
    __global struct FieldTile *fields; // of the tile, that have slabs
    uint field_count, part;            // part: number of the part of the tile that holds the packet
    struct FieldMemory *field_cells;   // for cells of the tile
    __global FLOAT *field_memory;      // of this work-item
    INT *doubts;                       // rays that met what floats cannot decide
#endif
    int shadow; // 1: whether there is a hit before the bound is all that is asked
} Ray;
