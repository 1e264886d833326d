// Lists of what matters: for a tile of pixels, or for the light rays of its hits, the items whose boxes meet it; for a packet, the items of its tile's
// list. Lists are ascending, so the contents of groups and free forms stand together. A tile whose list would be longer than
// there is room for says how long and renders nothing: the host makes room and runs it again.

typedef struct Rect { // of U, V, and how far w goes
    float u_low, u_high, v_low, v_high, w_high;
} Rect;

typedef struct List {
    __global const uint *ids;
    __global const float *boxes; // BOX_ARRAYS arrays of `stride` floats, as the ids
    uint stride, count;
} List;

// Room for lists: ids, their boxes, a packet's ids; `capacity` of each.
#define SHORT_LIST 4 // of a tile, that packets take as it is

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

// Fills the slot with what of `all` meets the rectangle; returns how many there are, which may be more than fit.
static uint list_fill(List all, const Rect *rect, __global uint *slot, uint capacity, __local uint *shared)
{
    uint count = 0;
    for (uint i = 0; i < all.count; i += 16) {
        for (uint bits = boxes_meet(all, i, rect); bits; bits &= bits - 1u) {
            if (count < capacity) list_append(all, i + lowest_bit(bits), slot, capacity, count);
            count++;
        }
    }
    return count;
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
    for (uint i = begin; i < end; i++) mine += box_meets(all.boxes, all.stride, i, rect) ? 1 : 0;
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

// The list for a rectangle, in the slot. Where it does not fit there `full` is set, and the host hears how much room it takes.
static List list_make(List all, const Rect *rect, __global uint *slot, uint capacity, __global uint *counters, __local uint *shared, int *full)
{
    uint count = list_fill(all, rect, slot, capacity, shared);
    if (count > capacity) {
        atomic_max(counters + COUNTER_LIST, count);
        *full = 1;
        count = 0;
    }
    return (List){slot, (__global const float *)(slot + capacity), capacity, count};
}
