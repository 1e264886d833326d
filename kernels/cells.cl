// Cells of a tile: where in the pyramid that a tile sees a general field is undecided, and the shortest tape that decides there.
//
// A cell is a rectangle of the view and a piece of its depth. One evaluation of a tape over 32 cells, a lane each (tape_boxes()), tells which of them are
// empty or full, and for the others which operand of each choice (minimum, maximum, …) decides: what cannot decide is left out of their tapes
// (tapes_shortened()). From the whole view down, for pictures of 1024²:
//
//     region   128 x 128 pixels    2 x 2 parts in 8 pieces of depth, each then 2 x 2 tiles in 8 slabs     before the tiles, once a frame
//     tile      32 x 32 pixels     64 slabs of depth
//     part       8 x 8 pixels      4 x 4 parts of a slab in 2 halves                                     where a packet first comes to the slab
//
// so that cells are about as deep as wide. A region keeps what it finds of up to FIELDS_MAX fields in memory of its own behind that of the tiles. Where
// there are no regions (shadows, and pictures for which they would take too much memory) a tile has 32 slabs, found from the whole tape.
//
// A child shares its parent's tape where less than an eighth would be gone, or where the pool of its tile or region is full.
//
// Measured on one thread (./dev bench FOLDER, 1024²): packets of colonnade (679 steps) run 17 steps on average, 3.7 evaluations of strips for a block of 8 x 4 pixels;
// making cells takes an eighth of its frame. bear (523 steps, smooth unions of all its parts) keeps 400 in most cells; that its values share places takes its
// frame from 1030 to 910 ms CPU.

#define SLABS 64      // of a field in a region
#define LOCAL_SLABS 32
#define FIELDS_MAX 24 // of a tile or region, that have slabs; the others are searched as one

typedef struct FieldTile { // a field in a tile
    uint leaf, slabs;
    ulong busy;                       // a bit for each slab that is not empty
    __global const float *edges;      // slabs + 1 depths
    __global const Tape *cells;       // of each slab: no steps where it is decided, and then root is 1 where it is full
    __global const Tape *parts[SLABS]; // of each slab, the nearer half first; NULL: not looked for yet
    Tape own_cells[LOCAL_SLABS];
    float own_edges[LOCAL_SLABS + 1];
    uint splits; // 1: slabs have parts
    float u_low, u_high, v_low, v_high;
} FieldTile;

typedef struct RegionField {
    uint leaf, spare;
    float edges[SLABS + 2];
    Tape cells[REGION_TILES * REGION_TILES * SLABS]; // tile by tile
} RegionField;

static float half_way(float near, float far)
{
    return 0.5f * (near + far);
}

static Tape whole_tape(__global const TapeStep *steps, __global const FieldRecord *r)
{
    return (Tape){steps + r->first, r->count, TAPE_POINT + r->count - 1u};
}

#if LANES != 32
typedef struct FieldMemory {
    uint none;
} FieldMemory;
#else
#define LANE_FLOAT(value, lane) ((float *)&(value))[lane]
#define LANE_COUNT(value, lane) ((const uint *)&(value))[lane]
#define LANE_NUMBER ((FLOAT)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31))
#define LANE_NUMBER_UINT ((UINT)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31))

static uint lanes_bits(INT mask)
{
    return mask_bits(mask.lo) | mask_bits(mask.hi) << 16;
}

typedef struct Choices { // of a step: the lanes in which one operand alone decides
    uint first, second;
} Choices;

typedef struct FieldMemory {
    __global FLOAT *values;    // of an evaluation; then, of each value in each lane, its number in the shortened tape
    __global Choices *choices; // of each step
    __global uint *need;       // lanes that need a value
    __global TapeStep *pool;   // shortened tapes, and tables of parts
    uint pool_size, used;
    __global const TapeStep *shared_from; // the tape that was last made to share places, and what became of it
    Tape shared;
} FieldMemory;

// The ranges of a tape over boxes, one a lane, and what decides in it.
NOINLINE void tape_boxes(const Tape *tape, const Range *box, const FieldMemory *memory, Range *result, Doubt *doubt)
{
    __global Range *v = (__global Range *)memory->values;
    __global Choices *choices = memory->choices;
    doubt->maybe = doubt->never = (box[0].low != box[0].low) & (box[0].low == box[0].low); // none
    for (uint k = 0; k < TAPE_POINT; k++) v[k] = box[k];
    for (uint k = 0; k < tape->count; k++) {
        TapeStep step = tape->steps[k];
        uint op = TAPE_OP(step.word);
        Range a = v[TAPE_A(step.word)], b, r;
        if (op == TAPE_SELECT) {
            Range first = v[step.b & 0xffffu], second = v[step.b >> 16];
            INT one = !has_zero(a), two = !has_other(a);
            r = range_choose(one, first, range_choose(two, second, range_hull(first, second)));
            choices[k] = (Choices){lanes_bits(one), lanes_bits(two)};
        } else if (TAPE_TAKES_THREE(op)) {
            range_noise(step, v, doubt, &r);
        } else {
            if (!(step.word & TAPE_LITERAL) && takes_second(op)) b = v[step.b];
            else b = range_literal(step.b);
            r = step_range(step, a, b, doubt);
            if (op == TAPE_MIN) choices[k] = (Choices){lanes_bits(a.high < b.low), lanes_bits(b.high < a.low)};
            if (op == TAPE_MAX) choices[k] = (Choices){lanes_bits(a.low > b.high), lanes_bits(b.low > a.high)};
            // What is 20 below is less than what floats can tell.
            if (op == TAPE_LSE) choices[k] = (Choices){lanes_bits(a.low > b.high + 20.0f), lanes_bits(b.low > a.high + 20.0f)};
            if (op == TAPE_ABS) choices[k] = (Choices){lanes_bits(a.low >= 0.0f), 0};
        }
        v[TAPE_POINT + k] = r;
    }
    *result = v[tape->root];
}

static int is_choice(uint op)
{
    return op == TAPE_MIN || op == TAPE_MAX || op == TAPE_LSE || op == TAPE_SELECT || op == TAPE_ABS;
}

typedef struct Fate { // of a step: the lanes in which it stands, and those in which an operand stands for it
    uint own, first, second;
} Fate;

static Fate fate_of(TapeStep step, __global const Choices *choices, uint need)
{
    Fate fate = {need, 0, 0};
    if (!is_choice(TAPE_OP(step.word))) return fate;
    fate.first = choices->first & need;
    fate.second = choices->second & need & ~fate.first;
    fate.own = need & ~(fate.first | fate.second);
    return fate;
}

// Which values the lanes need, and how many steps each of them would have.
static UINT steps_needed(const Tape *tape, uint lanes, const FieldMemory *memory)
{
    __global uint *need = memory->need;
    UINT count = 0, numbers = LANE_NUMBER_UINT, one = 1;
    for (uint k = 0; k < TAPE_POINT + tape->count; k++) need[k] = 0;
    need[tape->root] = lanes;
    for (uint k = tape->count; k-- > 0;) {
        uint mine = need[TAPE_POINT + k];
        if (!mine) continue;
        TapeStep step = tape->steps[k];
        uint op = TAPE_OP(step.word), a = TAPE_A(step.word);
        int literal = (step.word & TAPE_LITERAL) != 0;
        Fate fate = fate_of(step, memory->choices + k, mine);
        count += ((UINT)(fate.own | (literal ? fate.second : 0u)) >> numbers) & one;
        if (op == TAPE_NUMBER) continue;
        if (TAPE_TAKES_THREE(op)) { // of a choice: the condition, where nothing is chosen
            need[a] |= fate.own;
            need[step.b & 0xffffu] |= mine & ~fate.second;
            need[step.b >> 16] |= mine & ~fate.first;
        } else {
            need[a] |= mine & ~fate.second;
            if (!literal && takes_second(op)) need[step.b] |= mine & ~fate.first;
        }
    }
    return count;
}

// A step of a lane's tape, its operands by their new numbers.
static TapeStep step_renumbered(TapeStep step, int number, __global const ushort *numbers)
{
    uint op = TAPE_OP(step.word), a = numbers[LANES * TAPE_A(step.word)];
    if (number) return (TapeStep){TAPE_NUMBER, step.b};
    if (op == TAPE_NUMBER) return step;
    step.word = (step.word & 255u) | a << 8;
    if (TAPE_TAKES_THREE(op)) step.b = (uint)numbers[LANES * (step.b & 0xffffu)] | (uint)numbers[LANES * (step.b >> 16)] << 16;
    else if (!(step.word & TAPE_LITERAL) && takes_second(op)) step.b = numbers[LANES * step.b];
    return step;
}

// The tapes of those lanes without what cannot decide in them, as tape_boxes() has just found it.
NOINLINE void tapes_shortened(const Tape *tape, uint lanes, FieldMemory *memory, Tape *out)
{
    UINT counts = steps_needed(tape, lanes, memory);
    uint shorter = 0;
    for (uint left = lanes; left; left &= left - 1u) {
        uint lane = lowest_bit(left), count = LANE_COUNT(counts, lane);
        out[lane] = *tape;
        if (count * 8u > tape->count * 7u || count + memory->used > memory->pool_size) continue;
        out[lane] = (Tape){memory->pool + memory->used, 0, 0};
        memory->used += count;
        shorter |= 1u << lane;
    }
    if (!shorter) return;
    __global ushort *numbers = (__global ushort *)memory->values;
    for (uint k = 0; k < TAPE_POINT * LANES; k++) numbers[k] = (ushort)(k / LANES);
    for (uint k = 0; k < tape->count; k++) {
        uint mine = memory->need[TAPE_POINT + k] & shorter;
        if (!mine) continue;
        TapeStep step = tape->steps[k];
        uint op = TAPE_OP(step.word), literal = step.word & TAPE_LITERAL;
        Fate fate = fate_of(step, memory->choices + k, mine);
        for (; mine; mine &= mine - 1u) {
            uint lane = lowest_bit(mine), bit = 1u << lane;
            __global ushort *to = numbers + LANES * (TAPE_POINT + k) + lane;
            if ((fate.first & bit) || ((fate.second & bit) && !literal)) {
                uint first = op == TAPE_SELECT ? step.b & 0xffffu : TAPE_A(step.word), second = op == TAPE_SELECT ? step.b >> 16 : step.b;
                *to = numbers[LANES * (fate.first & bit ? first : second) + lane];
                continue;
            }
            ((__global TapeStep *)out[lane].steps)[out[lane].count] = step_renumbered(step, (fate.second & bit) != 0, numbers + lane);
            *to = (ushort)(TAPE_POINT + out[lane].count++);
        }
    }
    for (; shorter; shorter &= shorter - 1u) {
        uint lane = lowest_bit(shorter);
        out[lane].root = numbers[LANES * tape->root + lane];
        // What is a coordinate or a number that stands for all the rest is a step all the same: no steps means decided.
        if (!out[lane].count) out[lane] = *tape;
    }
}

// The same tape with values that share places: a long one's are then in the nearest cache (512 bytes each). The tape itself where more than 256 are needed at a
// time, where it is short, or where there is no room.
#define LONG_TAPE 48u
NOINLINE void tape_sharing(Tape *tape, FieldMemory *memory)
{
    if (tape->count < LONG_TAPE) return;
    if (memory->shared_from == tape->steps) {
        *tape = memory->shared;
        return;
    }
    if (memory->used + tape->count > memory->pool_size) return;
    __global TapeStep *to = memory->pool + memory->used;
    __global uint *last = memory->need; // step that needs a value
    __global ushort *places = (__global ushort *)memory->values;
    uchar spare[256];
    uint spares = 0, next = TAPE_POINT;
    for (uint k = 0; k < TAPE_POINT; k++) places[k] = (ushort)k;
    for (uint k = 0; k < tape->count; k++) {
        TapeStep step = tape->steps[k];
        uint op = TAPE_OP(step.word);
        if (op == TAPE_NUMBER) continue;
        last[TAPE_A(step.word)] = k;
        if (TAPE_TAKES_THREE(op)) last[step.b & 0xffffu] = last[step.b >> 16] = k;
        else if (!(step.word & TAPE_LITERAL) && takes_second(op)) last[step.b] = k;
    }
    last[tape->root] = tape->count;
    for (uint k = 0; k < tape->count; k++) {
        TapeStep step = tape->steps[k];
        uint op = TAPE_OP(step.word), operands[3], count = 0;
        if (op != TAPE_NUMBER) {
            operands[count++] = TAPE_A(step.word);
            step.word = (step.word & 255u) | (uint)places[operands[0]] << 8;
            if (TAPE_TAKES_THREE(op)) {
                operands[count++] = step.b & 0xffffu;
                operands[count++] = step.b >> 16;
                step.b = (uint)places[operands[1]] | (uint)places[operands[2]] << 16;
            } else if (!(step.word & TAPE_LITERAL) && takes_second(op)) {
                operands[count++] = step.b;
                step.b = places[operands[1]];
            }
        }
        for (uint n = 0; n < count; n++) {
            if (operands[n] < TAPE_POINT || last[operands[n]] != k) continue;
            last[operands[n]] = 0xffffffffu; // once, where it is both operands
            spare[spares++] = (uchar)places[operands[n]];
        }
        uint place = spares ? spare[--spares] : next++;
        if (place > 255u) return;
        places[TAPE_POINT + k] = (ushort)place;
        step.word |= place << 24;
        to[k] = step;
    }
    memory->used += tape->count;
    memory->shared_from = tape->steps;
    memory->shared = (Tape){to, tape->count, places[tape->root] | TAPE_SHARES};
    *tape = memory->shared;
}

// The box of the field's coordinates in a cell of the view.
static void field_box(__global const FieldRecord *r, float kappa, Range u, Range v, Range s, Range *box)
{
    FLOAT one = 1.0f;
    Range wide = range_scale(s, kappa);
    wide = kappa > 0.0f ? range_add((Range){one, one}, wide) : (Range){one, one};
    for (int k = 0; k < 3; k++) {
        Range across = range_add(range_scale(u, r->u[k]), range_scale(v, r->v[k]));
        Range along = range_scale(s, r->w[k]), offset;
        offset.low = offset.high = r->one[k];
        box[k] = range_add(range_mul(across, wide), range_add(along, offset));
    }
}

// The cells of 32 boxes.
static void cells_make(__global const FieldRecord *r, float kappa, const Tape *tape, Range u, Range v, Range s, FieldMemory *memory, Tape *cells)
{
    Range box[3], f;
    Doubt doubt;
    field_box(r, kappa, u, v, s, box);
    tape_boxes(tape, box, memory, &f, &doubt);
    uint empty = lanes_bits((f.high <= 0.0f) | doubt.never), full = lanes_bits((f.low > 0.0f) & !doubt.maybe) & ~empty;
    uint open = ~(empty | full), whole = open & lanes_bits(doubt.maybe); // what is left out may be what is undefined
    for (uint lane = 0; lane < LANES; lane++) {
        Tape none = {tape->steps, 0, full >> lane & 1u};
        cells[lane] = whole >> lane & 1u ? *tape : none;
    }
    if (open & ~whole) tapes_shortened(tape, open & ~whole, memory, cells);
}

// Depths where slabs meet: evenly spaced, or, where the field has no end that is near, the wider the farther they are from what is looked at. An end that
// floats have moved is put back, so that nothing lies behind the last slab.
static void slab_edges(__global const FieldRecord *r, uint slabs, __global float *edges)
{
    int near = r->s_high - r->s_low < 64.0f;
    float low = near ? r->s_low : asinh(4.0f * r->s_low), high = near ? r->s_high : asinh(4.0f * r->s_high);
    for (uint k = 0; k <= slabs; k++) {
        float x = low + (float)k / (float)slabs * (high - low);
        edges[k] = near ? x : 0.25f * sinh(x);
    }
    edges[0] = r->s_low;
    edges[slabs] = r->s_high;
}

// Lane by lane the `number`-th of `count` equal parts; of rows, which run downwards, from high to low.
static Range columns(float low, float high, FLOAT number, float count)
{
    float step = (high - low) / count;
    return (Range){low + number * step, low + (number + 1.0f) * step};
}

static Range rows(float high, float low, FLOAT number, float count)
{
    float step = (high - low) / count;
    return (Range){high - (number + 1.0f) * step, high - number * step};
}

static FLOAT lane_digit(float unit, float base) // of the lane's number: (number / unit) mod base
{
    FLOAT number = LANE_NUMBER;
    number = each_floor(number / unit);
    return number - base * each_floor(number / base);
}

// --- regions

// Cells of 2 x 2 squares, column lowest, in 8 pieces of depth, whose ends are `edges`, each `stride` after the one before.
static void cells_2x2x8(__global const FieldRecord *r, float kappa, const Tape *tape, const Rect *rect, __global const float *edges, uint stride,
                        FieldMemory *memory, Tape *cells)
{
    FLOAT near = 0.0f, far = 0.0f;
    for (uint lane = 0; lane < LANES; lane++) {
        LANE_FLOAT(near, lane) = edges[lane / 4 * stride];
        LANE_FLOAT(far, lane) = edges[(lane / 4 + 1) * stride];
    }
    cells_make(r, kappa, tape, columns(rect->u_low, rect->u_high, lane_digit(1.0f, 2.0f), 2.0f), rows(rect->v_high, rect->v_low, lane_digit(2.0f, 2.0f), 2.0f),
               (Range){near, far}, memory, cells);
}

// The cells of one field in a region.
static void region_field_make(__global RegionField *field, __global const FieldRecord *r, __global const TapeStep *tapes, uint leaf, float kappa,
                              const Rect *rect, FieldMemory *memory)
{
    Tape tape = whole_tape(tapes, r), large[LANES], small[LANES];
    float du = 0.5f * (rect->u_high - rect->u_low), dv = 0.5f * (rect->v_high - rect->v_low);
    field->leaf = leaf;
    slab_edges(r, SLABS, field->edges);
    cells_2x2x8(r, kappa, &tape, rect, field->edges, 8, memory, large);
    for (uint k = 0; k < LANES; k++) {
        uint column = k & 1u, row = k >> 1 & 1u, slab = k / 4 * 8;
        Rect part = {rect->u_low + (float)column * du, rect->u_low + (float)(column + 1u) * du, rect->v_high - (float)(row + 1u) * dv,
                     rect->v_high - (float)row * dv, rect->w_high};
        if (large[k].count) cells_2x2x8(r, kappa, &large[k], &part, field->edges + slab, 1, memory, small);
        for (uint lane = 0; lane < LANES; lane++) {
            uint tile = 2 * column + (lane & 1u) + REGION_TILES * (2 * row + (lane >> 1 & 1u));
            field->cells[tile * SLABS + slab + lane / 4] = large[k].count ? small[lane] : large[k];
        }
    }
}

// Memory as FIELD_SCRATCH says, at `room`.
static FieldMemory field_memory(__global uint *room, __global const FrameConstants *frame, __global TapeStep *pool)
{
    uint steps = frame->tape_longest + 4u;
    __global uint *after = room + steps * FIELD_VALUE * LANES;
    return (FieldMemory){(__global FLOAT *)room, (__global Choices *)after, after + 2 * steps, pool, frame->tape_pool, 0, 0, {0, 0, 0}};
}

// The fields among the items of a region's list.
static void region_fields_make(const Ray *ray, __global const FrameConstants *frame, List list, const Rect *rect, __global uint *region, __global uint *scratch)
{
    __global RegionField *fields = (__global RegionField *)(region + REGION_HEAD);
    FieldMemory memory = field_memory(scratch, frame, (__global TapeStep *)(region + REGION_HEAD + frame->region_fields * REGION_FIELD));
    uint count = 0;
    for (uint k = 0; k < list.count; k++) {
#ifdef HAS_COPIES
        if (list.ids[k] >= ray->copied) continue;
#endif
        uint id = list.ids[k], after = ray->nodes[id].after; // 0: a perturbation
        for (uint leaf = id; leaf < after && count < frame->region_fields; leaf = ray->nodes[leaf].end) {
            __global const FieldRecord *r = (__global const FieldRecord *)(ray->records + leaf);
            if (ray->nodes[leaf].count != NODE_FIELD || !r->count) continue;
            region_field_make(fields + count++, r, ray->tapes, leaf, ray->kappa, rect, &memory);
        }
    }
    region[0] = count;
}

static __global const RegionField *region_field(__global const uint *region, uint leaf)
{
    if (!region) return 0;
    __global const RegionField *fields = (__global const RegionField *)(region + REGION_HEAD);
    for (uint k = 0; k < region[0]; k++)
        if (fields[k].leaf == leaf) return fields + k;
    return 0;
}

// --- tiles

static void tile_begin(__global FieldTile *tile, uint leaf, uint slabs, __global const float *edges, __global const Tape *cells, const Rect *rect, uint splits)
{
    tile->leaf = leaf;
    tile->slabs = slabs;
    tile->edges = edges;
    tile->cells = cells;
    tile->splits = splits;
    tile->u_low = rect->u_low;
    tile->u_high = rect->u_high;
    tile->v_low = rect->v_low;
    tile->v_high = rect->v_high;
    tile->busy = 0;
    for (uint k = 0; k < slabs; k++) {
        tile->parts[k] = 0;
        if (cells[k].count || cells[k].root) tile->busy |= 1ul << k;
    }
}

// Slabs of a tile that is in no region.
static void tile_make(__global FieldTile *tile, __global const FieldRecord *r, __global const TapeStep *tapes, uint leaf, float kappa, const Rect *rect,
                      uint splits, FieldMemory *memory)
{
    Tape tape = whole_tape(tapes, r), cells[LANES];
    FLOAT near = 0.0f, far = 0.0f;
    slab_edges(r, LANES, tile->own_edges);
    for (uint lane = 0; lane < LANES; lane++) {
        LANE_FLOAT(near, lane) = tile->own_edges[lane];
        LANE_FLOAT(far, lane) = tile->own_edges[lane + 1];
    }
    FLOAT u_low = rect->u_low, u_high = rect->u_high, v_low = rect->v_low, v_high = rect->v_high;
    cells_make(r, kappa, &tape, (Range){u_low, u_high}, (Range){v_low, v_high}, (Range){near, far}, memory, cells);
    for (uint lane = 0; lane < LANES; lane++) tile->own_cells[lane] = cells[lane];
    tile_begin(tile, leaf, LANES, tile->own_edges, tile->own_cells, rect, splits);
}

// The parts of a slab, made when they are first asked for; NULL where there are none.
static __global const Tape *parts_of(const Ray *ray, __global FieldTile *tile, __global const FieldRecord *r, uint slab)
{
    FieldMemory *memory = ray->field_cells;
    uint room = LANES * sizeof(Tape) / sizeof(TapeStep);
    if (tile->parts[slab] || !tile->splits || memory->used + room > memory->pool_size) return tile->parts[slab];
    __global Tape *table = (__global Tape *)(memory->pool + memory->used);
    memory->used += room;
    Tape tape = tile->cells[slab], cells[LANES];
    float near = tile->edges[slab], far = tile->edges[slab + 1], middle = half_way(near, far);
    FLOAT low = near, high = far, behind = lane_digit(16.0f, 2.0f);
    low = behind > 0.0f ? (FLOAT)(middle) : low;
    high = behind > 0.0f ? high : (FLOAT)(middle);
    cells_make(r, ray->kappa, &tape, columns(tile->u_low, tile->u_high, lane_digit(1.0f, 4.0f), 4.0f), rows(tile->v_high, tile->v_low, lane_digit(4.0f, 4.0f), 4.0f),
               (Range){low, high}, memory, cells);
    for (uint lane = 0; lane < LANES; lane++) {
        tape_sharing(&cells[lane], memory);
        table[lane] = cells[lane];
    }
    tile->parts[slab] = table;
    return table;
}
#endif
