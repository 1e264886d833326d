// Slices: tiles and pictures. Of a tile first is asked what is known of its 16 parts (slice.cl); those that are decided are filled, and the others become
// tiles of the next level or, where they have 16 x 16 pixels, are drawn.

static void fill(__constant SliceFrame *frame, __global ushort *picture, uint x, uint y, uint size, int holds)
{
    uint rows = min(size, frame->height - y), columns = min(size / 64u, frame->stride / 4u - x / 64u);
    for (uint row = 0; row < rows; row++) {
        __global ulong *at = (__global ulong *)(picture + (size_t)(y + row) * frame->stride + x / 16u);
        for (uint k = 0; k < columns; k++) at[k] = holds ? ~0ul : 0ul;
    }
}

// A tile of 64 x 64 pixels, gathered so that each row is written at once.
typedef struct Drawn {
    ulong rows[64];
} Drawn;

INLINE void drawn_part(Drawn *drawn, uint part, ushort16 rows)
{
    const ushort *from = (const ushort *)&rows;
    ushort *to = (ushort *)drawn->rows + 64u * (part >> 2) + (part & 3u);
#pragma unroll
    for (uint row = 0; row < 16; row++) to[4u * row] = from[row];
}

static void drawn_write(const Drawn *drawn, __constant SliceFrame *frame, uint x, uint y, __global ushort *picture)
{
    uint rows = min(64u, frame->height - y), stride = frame->stride / 4u;
    __global ulong *at = (__global ulong *)picture + (size_t)y * stride + x / 64u;
    for (uint row = 0; row < rows; row++, at += stride) *at = drawn->rows[row];
}

// The ranges of places across and up in the parts of a tile, and which of them are there.
static uint part_ranges(__constant SliceFrame *frame, __global const float *across, __global const float *up, uint x, uint y, uint size, Range *u, Range *v)
{
    uint there = 0;
    float low[4], high[4], bottom[4], top[4];
    for (uint k = 0; k < 4; k++) {
        uint first = min(x + k * size, frame->width - 1u), last = min(x + (k + 1u) * size, frame->width) - 1u;
        low[k] = across[first];
        high[k] = across[last];
        first = min(y + k * size, frame->height - 1u);
        last = min(y + (k + 1u) * size, frame->height) - 1u;
        top[k] = up[first];
        bottom[k] = up[last];
        for (uint row = 0; row < 4; row++) there |= (uint)(x + k * size < frame->width && y + row * size < frame->height) << (4u * row + k);
    }
    float4 l = (float4)(low[0], low[1], low[2], low[3]), h = (float4)(high[0], high[1], high[2], high[3]);
    u->low = (float16)(l, l, l, l);
    u->high = (float16)(h, h, h, h);
    v->low = (float16)((float4)(bottom[0]), (float4)(bottom[1]), (float4)(bottom[2]), (float4)(bottom[3]));
    v->high = (float16)((float4)(top[0]), (float4)(top[1]), (float4)(top[2]), (float4)(top[3]));
    return there;
}

// What is there of 16 places that begin at `first`; beyond the last one it is repeated.
static FLOAT places(__global const float *list, uint first, uint count)
{
    if (first + 16u <= count) return vload16(0, list + first);
    FLOAT r;
    float *to = (float *)&r;
    for (uint k = 0; k < 16; k++) to[k] = list[min(first + k, count - 1u)];
    return r;
}

// Decides the parts of a tile as far as ranges do: bits 0-15 those that are inside, 16-31 those that are outside. `there`: those that the picture has.
static uint decide_parts(__constant SliceFrame *frame, const SliceNode *node, uint size, Steps steps, __global const float *across, __global const float *up,
                         uint *there, Memory m)
{
    Range u, v;
    *there = part_ranges(frame, across, up, node->x, node->y, size, &u, &v) & node->parts;
    m.ranges[0] = u;
    m.ranges[1] = v;
    return program_known(steps, node->numbers, node->compares, node->logics, m) & (*there | *there << 16);
}

#define NO_ROOM 0xffffffffu

// Where `count` steps have room in the pool, or NO_ROOM.
static uint pool_room(volatile __global uint *used, uint count, uint capacity)
{
    uint begin = *used;
    while (begin <= capacity && count <= capacity - begin) {
        uint seen = atomic_cmpxchg(used, begin, begin + count);
        if (seen == begin) return begin;
        begin = seen;
    }
    return NO_ROOM;
}

// Programs for the parts that are left, in the pool, and the parts as tiles of the next level. A part keeps its tile's program where little of it is gone, and
// where the pool is full.
static void split(const SliceNode *node, uint size, uint left, Steps steps, __global TapeStep *pool, uint capacity, __global uint *counters, uint level,
                  __global SliceNode *next, Memory m)
{
    Counts counts;
    uint numbers[16], compares[16], logics[16], first[16], at[16], total = 0, written = 0;
    uint all = node->numbers + node->compares + node->logics;
    trace(steps, node->numbers, node->compares, node->logics, left, m, &counts);
    vstore16(counts.numbers, 0, numbers);
    vstore16(counts.compares, 0, compares);
    vstore16(counts.logics, 0, logics);
    for (uint k = 0; k < 16; k++) {
        uint length = numbers[k] + compares[k] + logics[k];
        first[k] = total;
        if (!(left >> k & 1u) || length > all - all / 8u) continue;
        written |= 1u << k;
        total += length;
    }
    uint begin = written ? pool_room(counters + SLICE_COUNT_POOL, total, capacity) : 0;
    if (begin == NO_ROOM) written = 0;
    for (uint k = 0; k < 16; k++) at[k] = first[k] += begin;
    if (written) {
        write_numbers(steps, node->numbers, written, 0, m, pool, at);
        write_conditions(steps, node->numbers, node->compares, node->logics, written, m, pool, at);
    }
    uint to = atomic_add(counters + SLICE_COUNT_NODES(level), popcount(left));
    for (; left; left &= left - 1u) {
        uint part = LOW_BIT(left);
        SliceNode child = *node;
        child.x += (part & 3u) * size;
        child.y += (part >> 2) * size;
        child.parts = 0xffffu;
        if (written >> part & 1u) {
            child.first = first[part];
            child.numbers = numbers[part];
            child.compares = compares[part];
            child.logics = logics[part];
        }
        next[to++] = child;
    }
}

// The pixels of the parts of 16 x 16 that are left.
static void draw(__constant SliceFrame *frame, const SliceNode *node, uint left, Steps steps, __global const float *across, __global const float *up,
                 Drawn *drawn, Memory m)
{
    Counts counts;
    uint numbers[16], compares[16], logics[16], at[16], total = 0;
    trace(steps, node->numbers, node->compares, node->logics, left, m, &counts);
    vstore16(counts.numbers, 0, numbers);
    vstore16(counts.compares, 0, compares);
    vstore16(counts.logics, 0, logics);
    for (uint k = 0; k < 16; k++) {
        at[k] = total;
        total += numbers[k] + compares[k] + logics[k];
    }
    write_numbers(steps, node->numbers, left, 1, m, m.steps, at);
    write_conditions(steps, node->numbers, node->compares, node->logics, left, m, m.steps, at);
    for (; left; left &= left - 1u) {
        uint part = LOW_BIT(left), begin = at[part] - (numbers[part] + compares[part] + logics[part]);
        FLOAT u = places(across, node->x + (part & 3u) * SLICE_LEAF, frame->width), v = places(up, node->y + (part >> 2) * SLICE_LEAF, frame->height);
        drawn_part(drawn, part, leaf_pixels(m.steps + begin, numbers[part], compares[part], logics[part], u, v, m));
    }
}

// The same row by row, with the tile's program: for programs with more numbers than there is room for 16 rows of each.
static void draw_rows(__constant SliceFrame *frame, const SliceNode *node, uint left, Steps steps, __global const float *across, __global const float *up,
                      Drawn *drawn, Memory m)
{
    for (; left; left &= left - 1u) {
        uint part = LOW_BIT(left), y = node->y + (part >> 2) * SLICE_LEAF;
        FLOAT u = places(across, node->x + (part & 3u) * SLICE_LEAF, frame->width);
        ushort16 rows;
        ushort *to = (ushort *)&rows;
        for (uint row = 0; row < 16; row++)
            to[row] = (ushort)row_pixels(steps, node->numbers, node->compares, node->logics, u, up[min(y + row, frame->height - 1u)], m);
        drawn_part(drawn, part, rows);
    }
}

#define SLICE_ARGUMENTS                                                                                                                                  \
    __constant SliceFrame *frame, __global uint *counters, __global TapeStep *pool, __global SliceNode *nodes, __global SliceNode *next,                    \
        __global const float *across, __global const float *up, __global ushort *picture, __global uchar *memory, uint level, uint size

// The tiles of a level that a work-item does next: k … end - 1. Whether there are any.
static int take_tiles(__global uint *counters, uint level, uint *k, uint *end)
{
    uint count = counters[SLICE_COUNT_NODES(level)];
    uint share = clamp(count / (32u * (uint)get_global_size(0)), 1u, 8u);
    *k = atomic_add(counters + SLICE_COUNT_TAKEN(level), share);
    *end = min(*k + share, count);
    return *k < count;
}

static void split_tile(SLICE_ARGUMENTS, const SliceNode *node, Memory m)
{
    Steps steps = pool + node->first;
    uint there, known = decide_parts(frame, node, size, steps, across, up, &there, m), decided_parts = decided(known);
    for (uint left = decided_parts; left; left &= left - 1u) {
        uint part = LOW_BIT(left);
        fill(frame, picture, node->x + (part & 3u) * size, node->y + (part >> 2) * size, size, known >> part & 1u);
    }
    uint left = there & ~decided_parts;
    if (left) split(node, size, left, steps, pool, frame->pool, counters, level + 1u, next, m);
}

static void draw_tile(SLICE_ARGUMENTS, const SliceNode *node, Memory m)
{
    Steps steps = pool + node->first;
    Drawn drawn;
    uint there, known = decide_parts(frame, node, size, steps, across, up, &there, m), left = there & ~decided(known);
    for (uint part = 0; part < 16; part++) {
        if (!(left >> part & 1u)) drawn_part(&drawn, part, (ushort16)(known >> part & 1u ? (ushort)0xffffu : (ushort)0));
    }
    if (node->numbers <= frame->mixed || frame->mixed < SLICE_MIXED_MAX)
        draw(frame, node, left, steps, across, up, &drawn, m);
    else
        draw_rows(frame, node, left, steps, across, up, &drawn, m);
    drawn_write(&drawn, frame, node->x, node->y, picture);
}

#ifndef SLICE_EMITTED // else slice_lists.cl takes it from here

// The tiles of a level; `size` is that of their parts.
__kernel void slice_tiles(SLICE_ARGUMENTS)
{
    Memory m = memory_of(frame, memory);
    uint k, end;
    while (take_tiles(counters, level, &k, &end)) {
        for (; k < end; k++) {
            SliceNode node = nodes[k];
            if (size > SLICE_LEAF)
                split_tile(frame, counters, pool, nodes, next, across, up, picture, memory, level, size, &node, m);
            else
                draw_tile(frame, counters, pool, nodes, next, across, up, picture, memory, level, size, &node, m);
        }
    }
}

// Every pixel by the whole program: what the others are compared with, and for devices whose quotients and roots are not rounded to nearest.
__kernel void slice_each(SLICE_ARGUMENTS)
{
    Memory m = memory_of(frame, memory);
    SliceNode node = nodes[0];
    for (;;) {
        uint y = atomic_inc(counters + SLICE_COUNT_TAKEN(level));
        if (y >= frame->height) return;
        for (uint x = 0; x < frame->width; x += 16u) {
            uint bits = row_pixels(pool + node.first, node.numbers, node.compares, node.logics, places(across, x, frame->width), up[y], m);
            picture[(size_t)y * frame->stride + x / 16u] = (ushort)bits;
        }
    }
}
#endif
