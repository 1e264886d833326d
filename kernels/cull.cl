// Lists of what matters: for a tile of pixels, or for the light rays of its hits, the items whose boxes meet it; for a packet, the items of its tile's
// list. Lists are ascending, so the contents of groups and free forms stand together. A tile whose list would be longer than
// there is room for says how long and renders nothing: the host makes room and runs it again.

// Of all items of a view, of blocks of them, or of what a tile chose.
typedef struct List {
    __global const uint *ids;
    __global const float *boxes; // BOX_ARRAYS arrays of `stride` floats, as the ids
    uint stride, count;
#ifdef HAS_COPIES
    Copies copies; // of all items
#endif
} List;

// Room for lists: ids, their boxes, a packet's ids; `capacity` of each.
#define SHORT_LIST 4  // of a tile, that packets take as it is
#ifdef HAS_COPIES // whose parts would be folded again for each packet
#define LONG_LIST 4096
#else
#define LONG_LIST 512
#endif
//                    of what may shadow a tile, that packets do not go through: what each ray of theirs meets they choose from all items by blocks

#define SLOT_PACKET(slot, capacity) ((slot) + (1 + BOX_ARRAYS) * (capacity))

static int box_meets(__global const float *boxes, uint stride, uint i, const Rect *rect)
{
    return boxes[BOX_U_LOW * stride + i] <= rect->u_high && boxes[BOX_U_HIGH * stride + i] >= rect->u_low &&
           boxes[BOX_V_LOW * stride + i] <= rect->v_high && boxes[BOX_V_HIGH * stride + i] >= rect->v_low &&
           boxes[BOX_W_LOW * stride + i] <= rect->w_high;
}

static void list_append(List from, uint i, __global uint *slot, uint capacity, uint at)
{
    __global float *boxes = (__global float *)(slot + capacity);
    slot[at] = from.ids[i];
    for (uint array = 0; array < BOX_ARRAYS; array++) boxes[array * capacity + at] = from.boxes[array * from.stride + i];
}

#ifdef HAS_COPIES
static void item_box(List all, uint i, float *box)
{
    for (uint array = 0; array < BOX_ARRAYS; array++) box[array] = all.boxes[array * all.stride + i];
}

// What belongs to the header that is item i (copies.cl).
static uint list_append_copy(List all, uint i, const Rect *rect, __global uint *ids, __global float *boxes, uint capacity, uint at)
{
    float whole[BOX_ARRAYS];
    item_box(all, i, whole);
    return copy_append(&all.copies, all.ids[i], whole, rect, ids, boxes, capacity, at);
}
#endif

#if WIDTH == 16
// Which of the sixteen items from `i` on meet the rectangle, as bits.
INLINE uint boxes_meet(List list, uint i, const Rect *rect)
{
    __global const float *boxes = list.boxes + i;
    uint stride = list.stride;
    int16 meets = (vload16(0, boxes + BOX_U_LOW * stride) <= rect->u_high) & (vload16(0, boxes + BOX_U_HIGH * stride) >= rect->u_low) &
                  (vload16(0, boxes + BOX_V_LOW * stride) <= rect->v_high) & (vload16(0, boxes + BOX_V_HIGH * stride) >= rect->v_low) &
                  (vload16(0, boxes + BOX_W_LOW * stride) <= rect->w_high);
    uint bits = mask_bits(meets);
    return list.count - i < 16 ? bits & ((1u << (list.count - i)) - 1u) : bits;
}

static uint lowest_bit(uint bits)
{
    return popcount((bits & -bits) - 1u);
}

// The blocks of a list of all items, or of all blocks.
static List blocks_of(List of)
{
    uint count = BLOCKS_OF(of.count);
    return (List){.ids = of.ids, .boxes = of.boxes + BOX_ARRAYS * of.stride, .stride = STRIDE_OF(count), .count = count};
}

// Fills the slot with what of `all` meets the rectangle; returns how many there are, which may be more than fit. Blocks are asked first: that
// takes 0.8 ms less of the lists of 4096 perturbations (S5: 1.8 ms at 1024²), and half of a frame of 100,000 objects.
static uint list_fill(List all, const Rect *rect, __global uint *slot, uint capacity, __local uint *shared)
{
    List blocks = blocks_of(all), large = blocks_of(blocks);
    uint count = 0;
    for (uint at = 0; at < large.count; at += ITEM_STEP) {
        for (uint b = boxes_meet(large, at, rect); b; b &= b - 1u) {
            uint first = (at + lowest_bit(b)) * ITEM_STEP;
            for (uint c = boxes_meet(blocks, first, rect); c; c &= c - 1u) {
                uint i = (first + lowest_bit(c)) * ITEM_STEP;
                for (uint bits = boxes_meet(all, i, rect); bits; bits &= bits - 1u) {
                    if (count < capacity) list_append(all, i + lowest_bit(bits), slot, capacity, count);
                    count++;
#ifdef HAS_COPIES
                    uint id = all.ids[i + lowest_bit(bits)];
                    if (IS_HEADER(all.copies, id)) count = list_append_copy(all, i + lowest_bit(bits), rect, slot, (__global float *)(slot + capacity), capacity, count);
#endif
                }
            }
        }
    }
    return count;
}

// Which lanes of a packet meet box `i`, as bits.
static uint lanes_meet(List list, uint i, FLOAT u, FLOAT v, FLOAT w)
{
    __global const float *boxes = list.boxes + i;
    uint stride = list.stride;
    INT meets = (boxes[BOX_U_LOW * stride] <= u) & (boxes[BOX_U_HIGH * stride] >= u) & (boxes[BOX_V_LOW * stride] <= v) &
                (boxes[BOX_V_HIGH * stride] >= v) & (boxes[BOX_W_LOW * stride] <= w);
    return packet_bits(meets);
}

// Which of the sixteen items from `i` on meet one of the lanes' rays, as bits.
static uint boxes_meet_lanes(List list, uint i, uint lanes, const FLOAT *u, const FLOAT *v, const FLOAT *w)
{
    uint bits = 0;
    for (; lanes; lanes &= lanes - 1u) {
        uint lane = lowest_bit(lanes);
        float x = ((const float *)u)[lane], y = ((const float *)v)[lane], z = ((const float *)w)[lane];
        Rect rect = {x, x, y, y, z};
        bits |= boxes_meet(list, i, &rect);
    }
    return bits;
}

// The ids of the items that some ray of a packet meets on its way to w (-infinity: it has none), where the rays lie far apart: a rectangle around them would
// meet hundreds (100,000 scattered balls at 1024²: 2.4 s a frame so, 0.2 s with blocks and this). `count` may be more than fit.
static NOINLINE __global const uint *list_of_rays(List all, const Rect *rect, FLOAT u, FLOAT v, FLOAT w, __global uint *ids, uint capacity, uint *count)
{
    List blocks = blocks_of(all), large = blocks_of(blocks);
    uint n = 0;
    for (uint at = 0; at < large.count; at += ITEM_STEP) {
        for (uint b = boxes_meet(large, at, rect); b; b &= b - 1u) {
            uint block = at + lowest_bit(b);
            uint lanes = lanes_meet(large, block, u, v, w);
            if (!lanes) continue;
            for (uint c = boxes_meet_lanes(blocks, block * ITEM_STEP, lanes, &u, &v, &w); c; c &= c - 1u) {
                uint i = (block * ITEM_STEP + lowest_bit(c)) * ITEM_STEP;
                for (uint bits = boxes_meet_lanes(all, i, lanes, &u, &v, &w); bits; bits &= bits - 1u) {
                    uint id = all.ids[i + lowest_bit(bits)];
                    if (n < capacity) ids[n] = id;
                    n++;
#ifdef HAS_COPIES
                    if (IS_HEADER(all.copies, id)) n = list_append_copy(all, i + lowest_bit(bits), rect, ids, 0, capacity, n);
#endif
                }
            }
        }
    }
    *count = n;
    return ids;
}

// The ids of those in the list that meet the rectangle: as `ids`, with their count, or the list's own where there is no room.
INLINE __global const uint *list_of_packet(List list, const Rect *rect, __global uint *ids, uint capacity, uint *count)
{
    uint n = 0;
    if (list.count <= SHORT_LIST) capacity = 0;
    for (uint i = 0; i < list.count; i += 16) {
        uint bits = boxes_meet(list, i, rect);
        if (n + 16 > capacity && bits) {
            *count = list.count;
            return list.ids;
        }
        for (; bits; bits &= bits - 1u) ids[n++] = list.ids[i + lowest_bit(bits)];
    }
    *count = n;
    return ids;
}
#else
// As above, by all work-items of the group: each counts in a stretch of the items, then each writes behind those before it.
static uint list_fill(List all, const Rect *rect, __global uint *slot, uint capacity, __local uint *shared)
{
    uint lanes = (uint)get_local_size(0), lane = (uint)get_local_id(0);
    uint length = (all.count + lanes - 1) / lanes;
    uint begin = min(lane * length, all.count), end = min(begin + length, all.count);
    uint mine = 0;
    for (uint i = begin; i < end; i++) {
        if (!box_meets(all.boxes, all.stride, i, rect)) continue;
        mine++;
#ifdef HAS_COPIES
        float whole[BOX_ARRAYS];
        item_box(all, i, whole);
        if (IS_HEADER(all.copies, all.ids[i])) mine += copy_count(&all.copies, all.ids[i], whole, rect);
#endif
    }
    shared[lane] = mine;
    BARRIER;
    uint at = 0, total = 0;
    for (uint k = 0; k < lanes; k++) {
        if (k < lane) at += shared[k];
        total += shared[k];
    }
    for (uint i = begin; i < end; i++) {
        if (!box_meets(all.boxes, all.stride, i, rect)) continue;
        if (at < capacity) list_append(all, i, slot, capacity, at);
        at++;
#ifdef HAS_COPIES
        if (IS_HEADER(all.copies, all.ids[i])) at = list_append_copy(all, i, rect, slot, (__global float *)(slot + capacity), capacity, at);
#endif
    }
    BARRIER;
    return total;
}

// A ray uses its tile's list.
static __global const uint *list_of_packet(List list, const Rect *rect, __global uint *ids, uint capacity, uint *count)
{
    *count = list.count;
    return list.ids;
}
#endif

// Tells the host how much room a list takes that did not fit.
static int list_full(__global uint *counters, uint count)
{
    atomic_max(counters + COUNTER_LIST, count);
    return 0;
}

// The list for a rectangle, in the slot; where its count is more than `capacity` it is not whole.
static List list_make(List all, const Rect *rect, __global uint *slot, uint capacity, __local uint *shared)
{
    uint count = list_fill(all, rect, slot, capacity, shared);
    return (List){.ids = slot, .boxes = (__global const float *)(slot + capacity), .stride = capacity, .count = count};
}
