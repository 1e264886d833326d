// General fields along rays. Where F is positive is found by ranges of F and of its slope over pieces of the ray (tape.cl): a piece on which F cannot be
// positive is passed, one on which the slope has a sign is decided by F at its ends and, where the sign changes, holds one root, which a bracketed
// false position finds. Other pieces are halved. What floats cannot separate is decided by the signs at the ends of the piece, and the ray is marked: its
// pixel is not certified.
//
// Before its packets, a tile cuts the depth of each field into slabs. One evaluation over the tile's pyramid tells for all slabs at once which of them
// are empty or full; for the others the tape is shortened to what can decide there, and one more evaluation tells which packets they concern.
//
// s = w / W is the depth (tape_shared.h): rays are straight and s rises along them.

#define FIELD_SLABS 32
#define FIELDS_MAX 24      // of a tile, that have slabs; the others are searched as one
#define FIELD_STEPS 400    // evaluations for a piece of a packet, before what is left is sampled
#define SAMPLES 16

typedef struct FieldSlab {
    Tape tape;
    uint undecided, positive; // packets of the tile (all, where there are more than 32)
} FieldSlab;

typedef struct FieldTile { // a field in a tile
    uint leaf;
    uint first_slab, last_slab; // that are not empty; first > last: none
    float edges[FIELD_SLABS + 1];
    FieldSlab slabs[FIELD_SLABS];
} FieldTile;

static __global const FieldRecord *field_record(const Ray *ray, uint id)
{
    return (__global const FieldRecord *)(ray->records + id);
}

static Tape whole_tape(__global const TapeStep *steps, __global const FieldRecord *r)
{
    return (Tape){steps + r->first, r->count, TAPE_POINT + r->count - 1u};
}

typedef struct FieldLine { // o + s e in the field's coordinates
    FLOAT o[3], e[3];
} FieldLine;

static FieldLine field_line(__global const FieldRecord *r, FLOAT u, FLOAT v, float kappa)
{
    FieldLine line;
    for (int k = 0; k < 3; k++) {
        FLOAT across = r->u[k] * u + r->v[k] * v;
        line.o[k] = across + r->one[k];
        line.e[k] = kappa * across + r->w[k];
    }
    return line;
}

static FLOAT depth_of(FLOAT w, float kappa)
{
    if (kappa == 0.0f) return w;
    FLOAT far = INFINITY, eye = -1.0f / kappa;
    FLOAT s = w / (1.0f - kappa * w);
    s = w < -BIG ? eye : s;
    return 1.0f - kappa * w > 0.0f ? s : far;
}

static FLOAT w_of(FLOAT s, float kappa)
{
    return s / (1.0f + kappa * s);
}

static FLOAT field_value(const Tape *tape, const FieldLine *line, FLOAT s, float sign, __global FLOAT *memory)
{
    FLOAT point[3], f;
    for (int k = 0; k < 3; k++) point[k] = line->o[k] + s * line->e[k];
    tape_value(tape, point, memory, &f);
    FLOAT outside = -INFINITY;
    f = f == f ? f : outside;
    return sign * f;
}

// --- the search

// Between p, where F is not positive, and q, where it is: false position that halves the weight of an end that stays (Illinois). It ends where the bracket is
// as narrow as floats can tell, not where a step is short: a step beside an end may be short because F is flat there. So no step is shorter than half of that.
static FLOAT field_root(const Tape *tape, const FieldLine *line, FLOAT p, FLOAT q, FLOAT fp, FLOAT fq, INT live, float sign, __global FLOAT *memory)
{
    FLOAT largest = LARGEST;
    fp = most(fp, -largest);
    fq = least(fq, largest);
    for (int step = 0; step < 60; step++) {
        FLOAT width = q - p, tolerance = 1.2e-7f * size_of(q) + 1e-12f;
        FLOAT share = fp / (fp - fq), middle = 0.5f;
        share = ((share >= 0.0f) & (share <= 1.0f)) ? share : middle;
        if (step % 4 == 3) share = middle;
        FLOAT x = least(most(p + share * width, p + tolerance), q - tolerance);
        INT open = live & (width > 2.0f * tolerance) & (x > p) & (x < q);
        if (!ANY(open)) break;
        FLOAT f = field_value(tape, line, x, sign, memory);
        f = most(least(f, largest), -largest);
        INT up = open & (f > 0.0f), down = open & !(f > 0.0f);
        fp = up ? 0.5f * fp : down ? f : fp;
        fq = down ? 0.5f * fq : up ? f : fq;
        q = up ? x : q;
        p = down ? x : p;
    }
    return q;
}

// Where floats cannot go on: the first of a few places at which F is positive.
static FLOAT field_sampled(const Tape *tape, const FieldLine *line, FLOAT p, FLOAT end, INT live, float sign, __global FLOAT *memory)
{
    FLOAT found = INFINITY;
    FLOAT step = (end - p) / SAMPLES;
    for (int k = 0; k <= SAMPLES; k++) {
        FLOAT s = p + (float)k * step;
        FLOAT f = field_value(tape, line, s, sign, memory);
        found = (live & (f > 0.0f) & !(found < INFINITY)) ? s : found;
    }
    return found;
}

// The first place of [p, end] where sign * F is positive; infinity where there is none. `at_root`: p is a place where it has just turned negative.
NOINLINE void field_search(const Tape *tape, const FieldLine *line, const FLOAT *from, const FLOAT *to, INT live, float sign, INT at_root,
                                  int exists, __global FLOAT *memory, FLOAT *answer, INT *doubts)
{
    FLOAT p = *from, end = *to, found = INFINITY;
    FLOAT h = end - p;
    FLOAT least_step = 1e-7f * h;
    FLOAT low = p, high = p, f_low = 0.0f, f_high = 0.0f; // brackets
    INT bracketed = live & !live, uncertain = bracketed;
    for (int step = 0; ANY(live); step++) {
        if (step == FIELD_STEPS) {
            FLOAT sampled = field_sampled(tape, line, p, end, live, sign, memory);
            found = live ? sampled : found;
            uncertain = uncertain | live;
            break;
        }
        FLOAT q = least(p + h, end);
        q = h >= end - p ? end : q;
        Dual r;
        Doubt doubt;
        tape_dual(tape, line->o, line->e, &p, &q, memory, &r, &doubt);
        if (sign < 0.0f) r = (Dual){{-r.f.high, -r.f.low}, {-r.d.high, -r.d.low}};
        INT sure = !doubt.maybe;
        INT none = sign > 0.0f ? (r.f.high <= 0.0f) | doubt.never : (r.f.high <= 0.0f) & sure;
        INT all = sign > 0.0f ? (r.f.low > 0.0f) & sure : (r.f.low > 0.0f) | doubt.never;
        INT rising = sure & (r.d.low > 0.0f), falling = sure & (r.d.high < 0.0f);
        INT short_piece = (q - p) <= least_step + 2.5e-7f * most(size_of(p), size_of(q));
        INT ends = live & !none & !all & (rising | falling | short_piece);
        INT passed = live & none, met = live & all;
        if (ANY(ends)) {
            FLOAT fp = field_value(tape, line, p, sign, memory), fq = field_value(tape, line, q, sign, memory);
            INT begins = ends & (fp > 0.0f) & !at_root;
            INT crosses = ends & !begins & (fq > 0.0f) & (rising | short_piece);
            INT open = ends & short_piece & !rising & !falling & !begins & !crosses;
            uncertain = uncertain | open;
            least_step = open ? 2.0f * least_step : least_step;
            met = met | begins;
            low = crosses ? p : low;
            high = crosses ? q : high;
            f_low = crosses ? fp : f_low;
            f_high = crosses ? fq : f_high;
            bracketed = bracketed | crosses;
            live = live & !crosses;
            passed = passed | (ends & !begins & !crosses);
        }
        found = met ? p : found;
        live = live & !met;
        at_root = at_root & !passed;
        p = passed ? q : p;
        live = live & (p < end);
        h = passed ? least(2.0f * h, end - p) : 0.5f * h;
    }
    if (ANY(bracketed)) {
        FLOAT s = exists ? high : field_root(tape, line, low, high, f_low, f_high, bracketed, sign, memory);
        found = bracketed ? s : found;
    }
    *answer = found;
    *doubts = *doubts | uncertain;
}

static __global const FieldTile *field_tile(const Ray *ray, uint id)
{
    for (uint k = 0; k < ray->field_count; k++)
        if (ray->fields[k].leaf == id) return ray->fields + k;
    return 0;
}

// As freeform_next(): the first w from t on, before the bound, at which sign * F turns positive. `exists`: only whether there is one is asked.
static FLOAT field_next(const Ray *ray, uint id, FLOAT t, FLOAT bound, float sign, INT known, int exists)
{
    __global const FieldRecord *r = field_record(ray, id);
    FLOAT found = INFINITY;
    INT live = t < bound;
    if (!r->count) return sign < 0.0f ? t : found;
    float kappa = ray->kappa;
    FieldLine line = field_line(r, ray->u, ray->v, kappa);
    FLOAT first = r->s_low, last = r->s_high;
    FLOAT p = depth_of(t, kappa);
    FLOAT end = least(depth_of(bound, kappa), last);
    INT before = p < first, behind = live & !(p < last);
    if (sign < 0.0f) { // there is nothing outside of the depths that it has
        INT out = live & (before | behind);
        found = out ? t : found;
        live = live & !out;
    }
    live = live & !behind;
    p = before ? first : p;
    // The place of a root as w is not exactly that as s: a root that is known is stepped over.
    FLOAT beyond = p + 1e-6f * size_of(p) + 1e-9f;
    p = (known & !before) ? beyond : p;
    live = live & (p < end);
    FLOAT start = p;
    FLOAT s = INFINITY;
    __global const FieldTile *tile = field_tile(ray, id);
    uint bit = 1u << (ray->block & 31u);
    INT doubts = live & !live;
    uint slab = tile ? tile->first_slab : 0, slabs = tile ? tile->last_slab + 1u : 1u;
    for (; slab < slabs && ANY(live); slab++) {
        FLOAT far = tile ? (FLOAT)(tile->edges[slab + 1]) : last, near = tile ? (FLOAT)(tile->edges[slab]) : first;
        FLOAT stop = least(end, far);
        INT here = live & (p < stop);
        if (!ANY(here)) continue;
        if (sign < 0.0f && tile) { // empty slabs that were left out before this one
            INT out = here & (p < near);
            s = out ? p : s;
            live = live & !out;
            here = here & !out;
        }
        p = (here & (p < near)) ? near : p;
        Tape tape = tile ? tile->slabs[slab].tape : whole_tape(ray->tapes, r);
        int undecided = !tile || (tile->slabs[slab].undecided & bit), positive = tile && (tile->slabs[slab].positive & bit);
        FLOAT met = INFINITY;
        if (undecided) field_search(&tape, &line, &p, &stop, here, sign, known & (p == start), exists, ray->field_memory, &met, &doubts);
        else if (positive == (sign > 0.0f)) met = p;
        INT hit = here & (met < INFINITY);
        s = hit ? met : s;
        live = live & !hit;
        p = (here & !hit) ? stop : p;
        live = live & (p < end);
    }
    if (sign < 0.0f && tile) { // and behind the last
        INT out = live & (p < end);
        s = out ? p : s;
    }
    INT hit = s < INFINITY;
    FLOAT w = w_of(s, kappa);
    w = most(w, t);
    INT begins = (s == start) & !known;
    w = begins ? t : w;
    found = hit ? w : found;
    *ray->doubts = *ray->doubts | doubts;
    return found;
}

// As freeform_advance().
static FLOAT field_advance(const Ray *ray, uint id, Stretch *stretch, FLOAT t, FLOAT bound, float sign)
{
    INT stale = (t >= stretch->end) & (t < bound);
    if (ANY(stale)) {
        FLOAT limit = stale ? bound : (FLOAT)(-INFINITY);
        FLOAT entry = field_next(ray, id, t, limit, sign, (t == stretch->end) & (stretch->begin < INFINITY), 0);
        FLOAT end = field_next(ray, id, entry, limit, -sign, t == t, 0);
        FLOAT first = entry > t ? entry : (FLOAT)(-INFINITY);
        stretch->begin = stale ? first : stretch->begin;
        stretch->end = stale ? end : stretch->end;
    }
    return most(t, stretch->begin);
}

// --- normals

// W² F's place is taken by F: derivatives by U, V, w as surface_normal() turns them.
static Slope field_slope(const Ray *ray, uint id, FLOAT w, INT mine)
{
    __global const FieldRecord *r = field_record(ray, id);
    float kappa = ray->kappa;
    FieldLine line = field_line(r, ray->u, ray->v, kappa);
    FLOAT s = depth_of(w, kappa), point[3];
    for (int k = 0; k < 3; k++) point[k] = line.o[k] + s * line.e[k];
    __global const FieldTile *tile = field_tile(ray, id);
    Gradient g = {s, s, s, s}, part;
    INT todo = mine;
    for (uint slab = tile ? tile->first_slab : 0; tile && slab <= tile->last_slab && ANY(todo); slab++) {
        INT here = todo & (s >= tile->edges[slab]) & (s < tile->edges[slab + 1]);
        if (!ANY(here) || !tile->slabs[slab].tape.count) continue;
        Tape tape = tile->slabs[slab].tape;
        tape_gradient(&tape, point, ray->field_memory, &part);
        g.x = here ? part.x : g.x;
        g.y = here ? part.y : g.y;
        g.z = here ? part.z : g.z;
        todo = todo & !here;
    }
    if (ANY(todo)) {
        Tape tape = whole_tape(ray->tapes, r);
        tape_gradient(&tape, point, ray->field_memory, &part);
        g.x = todo ? part.x : g.x;
        g.y = todo ? part.y : g.y;
        g.z = todo ? part.z : g.z;
    }
    Slope slope;
    slope.value = 0.0f;
    slope.u = r->u[0] * g.x + r->u[1] * g.y + r->u[2] * g.z;
    slope.v = r->v[0] * g.x + r->v[1] * g.y + r->v[2] * g.z;
    FLOAT along = r->w[0] * g.x + r->w[1] * g.y + r->w[2] * g.z;
    // A gradient is as long as it likes to be: it is brought near to 1 before squares are taken.
    FLOAT size = most(most(size_of(slope.u), size_of(slope.v)), most(size_of(along), 1e-37f));
    slope.u /= size;
    slope.v /= size;
    along /= size;
    slope.w = (along + kappa * (ray->u * slope.u + ray->v * slope.v)) / (1.0f - kappa * w);
    return slope;
}

// --- tiles

#if LANES == 32
static uint lanes_bits(INT mask)
{
    return mask_bits(mask.lo) | mask_bits(mask.hi) << 16;
}

typedef struct Choices { // of a step: the lanes in which one operand alone decides
    uint first, second;
} Choices;

typedef struct FieldMemory {
    __global FLOAT *values;        // of an evaluation
    __global Choices *choices;     // of each step
    __global TapeStep *pool;       // shortened tapes
    uint pool_size, used;
} FieldMemory;

// The ranges of a tape over boxes, one a lane, and what decides in it.
NOINLINE void tape_boxes(const Tape *tape, const Range *box, __global FLOAT *memory, __global Choices *choices, Range *result, Doubt *doubt)
{
    __global Range *v = (__global Range *)memory;
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
        } else {
            b.low = b.high = as_float(step.b);
            if (!(step.word & TAPE_LITERAL) && takes_second(op)) b = v[step.b];
            r = step_range(step, a, b, doubt);
            if (op == TAPE_MIN) choices[k] = (Choices){lanes_bits(a.high < b.low), lanes_bits(b.high < a.low)};
            // What is 20 below is less than what floats can tell.
            if (op == TAPE_LSE) choices[k] = (Choices){lanes_bits(a.low > b.high + 20.0f), lanes_bits(b.low > a.high + 20.0f)};
            if (op == TAPE_MAX) choices[k] = (Choices){lanes_bits(a.low > b.high), lanes_bits(b.low > a.high)};
        }
        v[TAPE_POINT + k] = r;
    }
    *result = v[tape->root];
}

static int is_choice(uint op)
{
    return op == TAPE_MIN || op == TAPE_MAX || op == TAPE_LSE || op == TAPE_SELECT;
}

// The tape without what cannot decide in a lane; the same tape where too little would be gone, or there is no room.
static Tape tape_shortened(const Tape *tape, uint lane, FieldMemory *memory)
{
    __global ushort *map = (__global ushort *)memory->values; // first 1 where a value is needed, then its new number
    uint bit = 1u << lane, needed = 0;
    for (uint k = 0; k < TAPE_POINT + tape->count; k++) map[k] = 0;
    map[tape->root] = 1;
    for (uint k = tape->count; k-- > 0;) {
        if (!map[TAPE_POINT + k]) continue;
        TapeStep step = tape->steps[k];
        uint op = TAPE_OP(step.word), a = TAPE_A(step.word);
        int literal = (step.word & TAPE_LITERAL) != 0;
        int first = is_choice(op) && (memory->choices[k].first & bit), second = is_choice(op) && (memory->choices[k].second & bit);
        needed += !(first || second) || (second && literal);
        if (op == TAPE_NUMBER) continue;
        if (op == TAPE_SELECT) {
            if (!first && !second) map[a] = 1;
            if (!second) map[step.b & 0xffffu] = 1;
            if (!first) map[step.b >> 16] = 1;
        } else {
            if (!second) map[a] = 1;
            if (!first && !literal && takes_second(op)) map[step.b] = 1;
        }
    }
    if (needed * 8u > tape->count * 7u || needed + memory->used > memory->pool_size) return *tape;
    __global TapeStep *steps = memory->pool + memory->used;
    uint count = 0;
    for (uint k = 0; k < TAPE_POINT; k++) map[k] = (ushort)k;
    for (uint k = 0; k < tape->count; k++) {
        if (!map[TAPE_POINT + k]) continue;
        TapeStep step = tape->steps[k];
        uint op = TAPE_OP(step.word), a = TAPE_A(step.word);
        int literal = (step.word & TAPE_LITERAL) != 0;
        int first = is_choice(op) && (memory->choices[k].first & bit), second = is_choice(op) && (memory->choices[k].second & bit);
        if (first || (second && !literal)) {
            uint chosen = op == TAPE_SELECT ? (first ? step.b & 0xffffu : step.b >> 16) : first ? a : step.b;
            map[TAPE_POINT + k] = map[chosen];
            continue;
        }
        if (second) {
            step = (TapeStep){TAPE_NUMBER, step.b};
        } else if (op == TAPE_SELECT) {
            step = (TapeStep){(step.word & 255u) | (uint)map[a] << 8, (uint)map[step.b & 0xffffu] | (uint)map[step.b >> 16] << 16};
        } else if (op != TAPE_NUMBER) {
            step.word = (step.word & 255u) | (uint)map[a] << 8;
            if (!literal && takes_second(op)) step.b = map[step.b];
        }
        steps[count] = step;
        map[TAPE_POINT + k] = (ushort)(TAPE_POINT + count++);
    }
    memory->used += count;
    return (Tape){steps, count, map[tape->root]};
}

// The box of the field's coordinates in a cell of the view.
static void field_box(__global const FieldRecord *r, float kappa, Range u, Range v, Range s, Range *box)
{
    FLOAT one = 1.0f;
    Range wide = range_scale(s, kappa);
    wide = kappa > 0.0f ? range_add((Range){one, one}, wide) : (Range){one, one};
    for (int k = 0; k < 3; k++) {
        Range across = range_add(range_scale(u, r->u[k]), range_scale(v, r->v[k]));
        Range along = range_scale(s, r->w[k]);
        along = outward(along.low + r->one[k], along.high + r->one[k], 1.0f);
        box[k] = range_add(range_mul(across, wide), along);
    }
}

#define FIELD_LANE(value, lane) ((const float *)&(value))[lane]
#define LANE_NUMBER ((FLOAT)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31))

// Depths where slabs meet: evenly spaced, or, where the field has no end that is near, the wider the farther they are from what is looked at.
static FLOAT slab_edges(__global const FieldRecord *r, FLOAT number)
{
    FLOAT t = number / FIELD_SLABS;
    if (r->s_high - r->s_low < 64.0f) return r->s_low + t * (r->s_high - r->s_low);
    float low = asinh(4.0f * r->s_low), high = asinh(4.0f * r->s_high);
    FLOAT x = low + t * (high - low);
    return 0.125f * (each_exp(x) - each_exp(-x));
}

// One slab for which the tile's pyramid is not decided: a shorter tape, and the packets that it concerns.
static void slab_make(__global FieldSlab *slab, __global const FieldRecord *r, float kappa, Tape tape, uint lane, int shorten, float near, float far,
                      const Range *u, const Range *v, FieldMemory *memory)
{
    slab->tape = shorten ? tape_shortened(&tape, lane, memory) : tape;
    slab->undecided = 0xffffffffu;
    slab->positive = 0;
    if (!u) return;
    FLOAT low = near, high = far;
    Range box[3], f;
    Doubt doubt;
    Tape mine = slab->tape;
    field_box(r, kappa, *u, *v, (Range){low, high}, box);
    tape_boxes(&mine, box, memory->values, memory->choices + tape.count, &f, &doubt);
    INT empty = (f.high <= 0.0f) | doubt.never, full = (f.low > 0.0f) & !doubt.maybe;
    slab->positive = lanes_bits(full & !empty);
    slab->undecided = ~(lanes_bits(full) | lanes_bits(empty));
}

// u, v: of the packets, a lane each; NULL where they are not known.
static void field_tile_make(__global FieldTile *tile, __global const FieldRecord *r, __global const TapeStep *tapes, uint id, float kappa, const Rect *rect,
                            const Range *u, const Range *v, FieldMemory *memory)
{
    FLOAT near = slab_edges(r, LANE_NUMBER), far = slab_edges(r, LANE_NUMBER + 1.0f);
    FLOAT u_low = rect->u_low, u_high = rect->u_high, v_low = rect->v_low, v_high = rect->v_high;
    Range whole_u = {u_low, u_high}, whole_v = {v_low, v_high}, box[3], f;
    Doubt doubt;
    Tape tape = whole_tape(tapes, r);
    field_box(r, kappa, whole_u, whole_v, (Range){near, far}, box);
    tape_boxes(&tape, box, memory->values, memory->choices, &f, &doubt);
    uint empty = lanes_bits((f.high <= 0.0f) | doubt.never), full = lanes_bits((f.low > 0.0f) & !doubt.maybe), maybe = lanes_bits(doubt.maybe);
    tile->leaf = id;
    tile->first_slab = FIELD_SLABS;
    tile->last_slab = 0;
    for (uint k = 0; k < FIELD_SLABS; k++) {
        __global FieldSlab *slab = tile->slabs + k;
        tile->edges[k] = FIELD_LANE(near, k);
        tile->edges[k + 1] = FIELD_LANE(far, k);
        uint bit = 1u << k;
        slab->undecided = 0;
        slab->positive = full & bit ? 0xffffffffu : 0;
        slab->tape.count = 0;
        if (!((empty | full) & bit)) slab_make(slab, r, kappa, tape, k, !(maybe & bit), FIELD_LANE(near, k), FIELD_LANE(far, k), u, v, memory);
        if (!(slab->undecided | slab->positive)) continue;
        tile->first_slab = min(tile->first_slab, k);
        tile->last_slab = k;
    }
    // An end that floats have moved is put back, so that nothing lies behind the last slab.
    tile->edges[0] = r->s_low;
    tile->edges[FIELD_SLABS] = r->s_high;
}
#endif

// The fields among the items of a tile's list. `room` is the tile's memory for fields (shared.h).
static void fields_make(Ray *ray, __global const FrameConstants *frame, List list, const Rect *rect, const FLOAT *block_rects, __global uint *room)
{
    uint steps = frame->tape_longest + 4u;
    ray->fields = (__global const FieldTile *)room;
    ray->field_count = 0;
    ray->field_memory = (__global FLOAT *)(room + FIELD_TABLE) + (size_t)get_local_id(0) * steps * 4;
#if LANES == 32
    __global uint *after = room + FIELD_TABLE + steps * 4 * LANES;
    FieldMemory memory = {ray->field_memory, (__global Choices *)after, (__global TapeStep *)(after + 4 * steps), frame->tape_pool, 0};
    __global FieldTile *tiles = (__global FieldTile *)room;
    Range u, v;
    if (block_rects) {
        u = (Range){block_rects[0], block_rects[1]};
        v = (Range){block_rects[2], block_rects[3]};
    }
    for (uint k = 0; k < list.count; k++) {
        uint id = list.ids[k], after = ray->nodes[id].after; // 0: a perturbation
        for (uint leaf = id; leaf < after && ray->field_count < FIELDS_MAX; leaf = ray->nodes[leaf].end) {
            if (ray->nodes[leaf].count != NODE_FIELD || !field_record(ray, leaf)->count) continue;
            field_tile_make(tiles + ray->field_count++, field_record(ray, leaf), ray->tapes, leaf, ray->kappa, rect, block_rects ? &u : 0,
                            block_rects ? &v : 0, &memory);
        }
    }
#endif
}
