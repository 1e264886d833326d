// Slices by lists: tiles hold the numbers of the groups of a formula (compiler/formula_emit.h, whose functions stand before this text) that are not decided all
// over them, in the place of programs. Otherwise it is as in slice_tiles.cl: 16 parts at a time, parts of 16 x 16 pixels drawn at once, work-items that
// take tiles by a counter. With SLICE_GROUPS_ALL everything is the other way round: a group that fails decides a part, and one that holds does not matter.

// Decides the parts of a tile as far as each group alone does; known[k] are the parts where the group does not matter (bits 16-31).
static uint list_decides(__global const uint *list, uint count, Range u, Range v, uint there, __global uint *known)
{
    uint decides = 0;
    for (uint k = 0; k < count && decides != there; k++) {
        uint bits = group_known(list[k], u, v);
        if (SLICE_GROUPS_ALL) bits = bits >> 16 | bits << 16;
        known[k] = bits;
        decides |= bits & there;
    }
    return decides;
}

static uint16 list_lengths(uint count, uint left, __global const uint *known)
{
    uint16 lengths = (uint16)(0);
    for (uint k = 0; k < count; k++) lengths += each_bit(left & ~(known[k] >> 16));
    return lengths;
}

static void split_list(SLICE_ARGUMENTS, const SliceNode *node, uint left, uint16 lengths, __global const uint *known)
{
    __global uint *lists = (__global uint *)pool;
    uint length[16], first[16], at[16], total = 0;
    vstore16(lengths, 0, length);
    for (uint k = 0; k < 16; k++) {
        first[k] = at[k] = total;
        total += length[k];
    }
    uint begin = pool_room(counters + SLICE_COUNT_POOL, total, frame->pool);
    for (uint k = 0; k < node->numbers && begin != NO_ROOM; k++) {
        for (uint parts = left & ~(known[k] >> 16); parts; parts &= parts - 1u) lists[begin + at[LOW_BIT(parts)]++] = lists[node->first + k];
    }
    uint to = atomic_add(counters + SLICE_COUNT_NODES(level + 1u), popcount(left));
    for (; left; left &= left - 1u) {
        uint part = LOW_BIT(left);
        SliceNode child = *node; // with its tile's list where there is no room
        child.x += (part & 3u) * size;
        child.y += (part >> 2) * size;
        child.parts = 0xffffu;
        if (begin != NO_ROOM) {
            child.first = begin + first[part];
            child.numbers = length[part];
        }
        next[to++] = child;
    }
}

static void draw_list(__global const uint *list, const SliceNode *node, __constant SliceFrame *frame, __global const float *across,
                      __global const float *up, uint left, __global const uint *known, Drawn *drawn)
{
    for (; left; left &= left - 1u) {
        uint part = LOW_BIT(left);
        FLOAT u = places(across, node->x + (part & 3u) * SLICE_LEAF, frame->width), v = places(up, node->y + (part >> 2) * SLICE_LEAF, frame->height);
        ushort16 rows = (ushort16)(SLICE_GROUPS_ALL ? (ushort)0xffffu : (ushort)0);
        for (uint k = 0; k < node->numbers; k++) {
            if (known[k] >> (16u + part) & 1u) continue;
            ushort16 pixels = group_pixels(list[k], u, v);
            rows = SLICE_GROUPS_ALL ? rows & pixels : rows | pixels;
        }
        drawn_part(drawn, part, rows);
    }
}

static void list_tile(SLICE_ARGUMENTS, const SliceNode *node, __global uint *known)
{
    __global const uint *list = (__global const uint *)pool + node->first;
    Range u, v;
    uint there = part_ranges(frame, across, up, node->x, node->y, size, &u, &v) & node->parts;
    uint decides = list_decides(list, node->numbers, u, v, there, known), left = there & ~decides, rest = 0;
    uint16 lengths = (uint16)(0);
    if (left) lengths = list_lengths(node->numbers, left, known);
    if (left) rest = mask_bits(lengths == 0u) & left; // no group matters there
    left &= ~rest;
    uint inside = SLICE_GROUPS_ALL ? rest : decides;
    if (size > SLICE_LEAF) {
        for (uint parts = decides | rest; parts; parts &= parts - 1u) {
            uint part = LOW_BIT(parts);
            fill(frame, picture, node->x + (part & 3u) * size, node->y + (part >> 2) * size, size, inside >> part & 1u);
        }
        if (left) split_list(frame, counters, pool, nodes, next, across, up, picture, memory, level, size, node, left, lengths, known);
        return;
    }
    Drawn drawn;
    for (uint part = 0; part < 16; part++) {
        if (!(left >> part & 1u)) drawn_part(&drawn, part, (ushort16)(inside >> part & 1u ? (ushort)0xffffu : (ushort)0));
    }
    draw_list(list, node, frame, across, up, left, known, &drawn);
    drawn_write(&drawn, frame, node->x, node->y, picture);
}

__kernel void slice_lists(SLICE_ARGUMENTS)
{
    Memory m = memory_of(frame, memory);
    uint k, end;
    while (take_tiles(counters, level, &k, &end)) {
        for (; k < end; k++) {
            SliceNode node = nodes[k];
            list_tile(frame, counters, pool, nodes, next, across, up, picture, memory, level, size, &node, m.known);
        }
    }
}
