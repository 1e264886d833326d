// General fields along rays. Where F is positive is found by ranges of F and of its slope over pieces of the ray (tape.cl): a piece on which F cannot be
// positive is passed, and one on which the slope has a sign is decided by F at its ends and, where the sign changes, holds one root, which a bracketed
// false position finds. From a place where F is negative a piece is passed as far as the steepest slope in it needs to reach 0; the rest of it is halved.
// What floats cannot separate is decided by the signs at the ends of the piece, and the ray is marked: its pixel is not certified.
//
// A ray goes through the cells of its tile that are not empty (cells.cl), with the tape of each.
//
// s = w / W is the depth (tape_shared.h): rays are straight and s rises along them.

#define FIELD_STEPS 400 // evaluations for a cell of a packet, before what is left is sampled
#define SAMPLES 16

static __global const FieldRecord *field_record(const Ray *ray, uint id)
{
    return (__global const FieldRecord *)(ray->records + id);
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

// What F can be at the place s, whatever floats make of it.
static Range field_bounds(const Tape *tape, const FieldLine *line, FLOAT s, float sign, __global FLOAT *memory)
{
    Range point[3], f;
    Doubt doubt;
    FLOAT nothing = -INFINITY, anything = INFINITY;
    for (int k = 0; k < 3; k++) point[k] = range_ahead(line->o[k], line->e[k], s, s);
    tape_range(tape, point, memory, &f, &doubt);
    f.low = doubt.maybe ? nothing : f.low;
    f.high = doubt.never ? nothing : f.high;
    f.high = f.high == f.high ? f.high : anything;
    return sign < 0.0f ? (Range){-f.high, -f.low} : f;
}

// Between p, where F is not positive, and q, where it is: false position that halves the weight of an end that stays (Illinois). It ends where the bracket is
// as narrow as floats can tell or F is lost in noise, not where a step is short: a step beside an end may be short because F is flat there.
static FLOAT field_root(const Tape *tape, const FieldLine *line, FLOAT p, FLOAT q, FLOAT fp, FLOAT fq, FLOAT noise, INT live, float sign,
                        __global FLOAT *memory)
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
        INT enough = open & (size_of(f) <= 0.03f * noise);
        q = enough ? x : q;
        live = live & !enough;
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
                                  int exists, float grain, __global FLOAT *memory, FLOAT *answer, INT *doubts)
{
    FLOAT p = *from, end = *to, found = INFINITY;
    FLOAT h = end - p;
    FLOAT least_step = grain;
    FLOAT low = p, high = p, f_low = 0.0f, f_high = 0.0f, f_noise = 0.0f; // brackets
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
        if (sign < 0.0f) r = dual_negated(r);
        INT sure = !doubt.maybe;
        INT none = sign > 0.0f ? (r.f.high <= 0.0f) | doubt.never : (r.f.high <= 0.0f) & sure;
        INT all = sign > 0.0f ? (r.f.low > 0.0f) & sure : (r.f.low > 0.0f) | doubt.never;
        INT passed = live & none, met = live & all, open = live & !none & !all;
        FLOAT reach = p, shorter = 0.5f * h;
        if (ANY(open)) {
            FLOAT place = least_step + 2.5e-7f * most(size_of(p), size_of(q));
            INT rising = sure & (r.d.low > 0.0f), falling = sure & (r.d.high < 0.0f), steep = rising | falling;
            INT tiny = (q - p) <= place;
            Range at_p = r.at;
            if (ANY(open & !sure)) {
                Range there = field_bounds(tape, line, p, sign, memory);
                at_p = range_choose(sure, at_p, there);
            }
            // Floats know a place to `place` only, and F there no better than to `noise`: where F is a quarter of that at most, halves tell nothing new. (Of all
            // of it, rays along a face miss what is in front of it; of nothing, colonnade takes 540 ms instead of 490.)
            FLOAT noise = at_p.high - at_p.low;
            INT near = q - p <= 0.02f * (1.0f + size_of(p)); // farther the steepest slope says little
            INT flat = open & sure & near & (r.f.high <= 0.25f * noise);
            INT positive = open & (at_p.high > 0.0f) & !at_root, certain = at_p.low > 0.0f;
            INT begins = positive & (certain | rising);
            uncertain = uncertain | (positive & !certain & falling);
            INT closing = open & (tiny | flat) & !steep & !begins;
            INT rises = open & rising & !begins;
            FLOAT f_q = r.f.high, f_p = least(at_p.high, 0.0f);
            if (ANY(rises | closing)) f_q = field_value(tape, line, q, sign, memory);
            INT crosses = (rises | closing) & (f_q > 0.0f);
            // A root at p whose slope has no sign however short the piece is, since faces lie in each other there: where F is positive for certain as soon as floats
            // can tell, it turns so in between.
            FLOAT behind = q;
            INT turning = positive & !begins & !rises & !closing;
            if (ANY(turning)) {
                FLOAT beyond = p + most(place, 4.0f * noise / most(size_of(r.d.low), size_of(r.d.high)));
                Range there = field_bounds(tape, line, beyond, sign, memory);
                INT turned = turning & sure & (beyond < q) & (there.low > 0.0f);
                behind = turned ? beyond : behind;
                f_q = turned ? there.high : f_q;
                crosses = crosses | turned;
            }
            if (ANY(closing)) {
                FLOAT f = field_value(tape, line, p, sign, memory);
                INT at_once = closing & (f > 0.0f) & !at_root;
                begins = begins | at_once;
                crosses = crosses & !at_once;
                INT undecided = closing & !at_once & !crosses;
                uncertain = uncertain | undecided;
                least_step = undecided ? 2.0f * least_step : least_step;
            }
            met = met | begins;
            low = crosses ? p : low;
            high = crosses ? behind : high;
            f_low = crosses ? f_p : f_low;
            f_high = crosses ? f_q : f_high;
            f_noise = crosses ? noise : f_noise;
            bracketed = bracketed | crosses;
            live = live & !crosses;
            // F rises by the steepest slope at most.
            FLOAT ahead = p + 0.99999f * (-at_p.high / most(r.d.high, 1e-37f));
            INT reaches = open & sure & (at_p.high < 0.0f) & (ahead > p);
            reach = reaches ? least(ahead, q) : reach;
            // At a root F rises to its most there at the earliest where its steepest slope would have brought it: up to there it may have a sign.
            FLOAT climb = 0.9f * (r.f.high / r.d.high);
            shorter = (positive & (climb < shorter) & (climb > 0.0f)) ? most(climb, place) : shorter;
            passed = passed | (open & !begins & !crosses & (steep | closing | (reach >= q)));
        }
        found = met ? p : found;
        live = live & !met;
        INT far = passed | (reach - p > 0.5f * (q - p));
        at_root = at_root & !passed & !(reach > p);
        h = far ? (passed ? 8.0f * h : h) : shorter;
        p = passed ? q : reach;
        live = live & (p < end);
        h = least(h, end - p);
    }
    if (ANY(bracketed)) {
        FLOAT s = exists ? high : field_root(tape, line, low, high, f_low, f_high, f_noise, bracketed, sign, memory);
        found = bracketed ? s : found;
    }
    *answer = found;
    *doubts = *doubts | uncertain;
}

static __global FieldTile *field_tile(const Ray *ray, uint id)
{
    for (uint k = 0; k < ray->field_count; k++)
        if (ray->fields[k].leaf == id) return ray->fields + k;
    return 0;
}

typedef struct March { // of a packet through the cells of a field
    FieldLine line;
    FLOAT p, end; // what is still to be searched
    FLOAT start;  // where it began
    FLOAT s;      // what was found
    INT live, known, doubts;
    float sign;
    int exists;
    float grain; // of a cell: pieces that are shorter are not halved
} March;

// Goes through one cell, from p or `near` on.
static void march_cell(const Ray *ray, March *m, const Tape *tape, float near, float far)
{
    FLOAT back = far, front = near, stop = least(m->end, back);
    INT here = m->live & (m->p < stop);
    if (!ANY(here)) return;
    INT gap = here & (m->p < near);
    if (m->sign < 0.0f) { // what was left out before this one is empty
        m->s = gap ? m->p : m->s;
        m->live = m->live & !gap;
        here = here & !gap;
    } else {
        m->p = gap ? front : m->p;
    }
    FLOAT met = INFINITY;
    if (tape->count) field_search(tape, &m->line, &m->p, &stop, here, m->sign, m->known & (m->p == m->start), m->exists, m->grain * (far - near), ray->field_memory, &met, &m->doubts);
    else if ((tape->root != 0) == (m->sign > 0.0f)) met = m->p;
    INT hit = here & (met < INFINITY);
    m->s = hit ? met : m->s;
    m->p = (here & !hit) ? stop : m->p;
    m->live = m->live & !hit & (m->p < m->end);
}

// Through all cells of a tile that are not empty.
static void march_tile(const Ray *ray, March *m, __global FieldTile *tile, __global const FieldRecord *r)
{
    for (ulong busy = tile->busy; busy && ANY(m->live); busy &= busy - 1ul) {
        uint slab = (uint)popcount((busy & -busy) - 1ul);
        float near = tile->edges[slab], far = tile->edges[slab + 1];
        if (!ANY(m->live & (m->p < far))) continue;
        if (!ANY(m->live & (m->end > near))) break;
        Tape tape = tile->cells[slab];
        __global const Tape *parts = 0;
#if LANES == 32
        if (tape.count) parts = parts_of(ray, tile, r, slab);
#endif
        if (!parts) {
            march_cell(ray, m, &tape, near, far);
            continue;
        }
        float middle = half_way(near, far);
        Tape first = parts[ray->part], second = parts[ray->part + 16u];
        if (first.count || first.root) march_cell(ray, m, &first, near, middle);
        if (second.count || second.root) march_cell(ray, m, &second, middle, far);
    }
    if (m->sign < 0.0f) { // behind the last there is nothing
        INT out = m->live & (m->p < m->end);
        m->s = out ? m->p : m->s;
    }
}

// As freeform_next(): the first w from t on, before the bound, at which sign * F turns positive. `exists`: only whether there is one is asked.
static FLOAT field_next(const Ray *ray, uint id, FLOAT t, FLOAT bound, float sign, INT known, int exists)
{
    __global const FieldRecord *r = field_record(ray, id);
    FLOAT found = INFINITY;
    if (!r->count) return sign < 0.0f ? t : found;
    March m = {field_line(r, ray->u, ray->v, ray->kappa), depth_of(t, ray->kappa), least(depth_of(bound, ray->kappa), (FLOAT)(r->s_high))};
    FLOAT first = r->s_low;
    INT before = m.p < r->s_low, behind = !(m.p < r->s_high);
    m.live = t < bound;
    m.s = INFINITY;
    m.sign = sign;
    m.exists = exists;
    m.grain = field_tile(ray, id) ? 1e-5f : 1e-7f;
    m.known = known;
    m.doubts = m.live & !m.live;
    if (sign < 0.0f) { // there is nothing outside of the depths that it has; where these begin with the eye, nothing is before them
        INT out = first * ray->kappa <= -0.999998f ? m.live & behind : m.live & (before | behind);
        found = out ? t : found;
        m.live = m.live & !out;
    }
    m.live = m.live & !behind;
    m.p = before ? first : m.p;
    // The place of a root as w is not exactly that as s: a root that is known is stepped over.
    FLOAT beyond = m.p + 1e-6f * size_of(m.p) + 1e-9f;
    m.p = (known & !before) ? beyond : m.p;
    m.live = m.live & (m.p < m.end);
    m.start = m.p;
    __global FieldTile *tile = field_tile(ray, id);
    if (tile) {
        march_tile(ray, &m, tile, r);
    } else {
        Tape tape = whole_tape(ray->tapes, r);
        march_cell(ray, &m, &tape, r->s_low, r->s_high);
    }
    INT hit = m.s < INFINITY;
    FLOAT w = w_of(m.s, ray->kappa);
    w = most(w, t);
    INT begins = (m.s == m.start) & !known;
    w = begins ? t : w;
    found = hit ? w : found;
    *ray->doubts = *ray->doubts | m.doubts;
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

// The tape of the cell that holds a depth, and where the cell ends. The whole tape where the cell is decided: the surface is at its end.
static Tape tape_at(const Ray *ray, __global const FieldRecord *r, __global const FieldTile *tile, float s, float *near, float *far)
{
    Tape whole = whole_tape(ray->tapes, r);
    *near = -INFINITY;
    *far = INFINITY;
    if (!tile) return whole;
    uint slab = 0;
    for (uint step = tile->slabs / 2; step; step /= 2)
        if (tile->edges[slab + step] <= s) slab += step;
    *near = tile->edges[slab];
    *far = tile->edges[slab + 1];
    Tape tape = tile->cells[slab];
#if LANES == 32
    __global const Tape *parts = tile->parts[slab];
    if (parts) {
        float middle = half_way(*near, *far);
        tape = parts[s < middle ? ray->part : ray->part + 16u];
        if (s < middle) *far = middle;
        else *near = middle;
    }
#endif
    return tape.count ? tape : whole;
}

// W² F's place is taken by F: derivatives by U, V, w as surface_normal() turns them.
static Slope field_slope(const Ray *ray, uint id, FLOAT w, INT mine)
{
    __global const FieldRecord *r = field_record(ray, id);
    float kappa = ray->kappa, near, far;
    FieldLine line = field_line(r, ray->u, ray->v, kappa);
    FLOAT s = depth_of(w, kappa), point[3];
    for (int k = 0; k < 3; k++) point[k] = line.o[k] + s * line.e[k];
    __global const FieldTile *tile = field_tile(ray, id);
    Gradient g = {s, s, s, s}, part;
    INT todo = mine;
    while (ANY(todo)) {
        FLOAT none = -INFINITY;
        float last = highest(todo ? s : none);
        Tape tape = tape_at(ray, r, tile, last, &near, &far);
        INT here = todo & ((s >= near) | (s == last));
        tape_gradient(&tape, point, ray->field_memory, &part);
        g.x = here ? part.x : g.x;
        g.y = here ? part.y : g.y;
        g.z = here ? part.z : g.z;
        todo = todo & !here;
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

// The fields among the items of a tile's list. `room` is the tile's memory for fields (shared.h); `region` what the region of the tile has found, of the tile
// with that number in it; NULL where there is none. `splits`: packets are parts of the tile.
static void fields_make(Ray *ray, __global const FrameConstants *frame, List list, const Rect *rect, int splits, __global uint *region, uint number,
                        __global uint *room, struct FieldMemory *memory)
{
    uint steps = frame->tape_longest + 4u;
    ray->fields = (__global FieldTile *)room;
    ray->field_count = 0;
    ray->field_memory = (__global FLOAT *)(room + FIELD_TABLE) + (size_t)get_local_id(0) * steps * FIELD_VALUE;
#if LANES == 32
    *memory = field_memory(room + FIELD_TABLE, frame, (__global TapeStep *)(room + FIELD_TABLE + FIELD_SCRATCH(frame->tape_longest, LANES)));
    ray->field_cells = memory;
    for (uint k = 0; k < list.count; k++) {
        uint id = list.ids[k], after = ray->nodes[id].after; // 0: a perturbation
        for (uint leaf = id; leaf < after && ray->field_count < FIELDS_MAX; leaf = ray->nodes[leaf].end) {
            if (ray->nodes[leaf].count != NODE_FIELD || !field_record(ray, leaf)->count) continue;
            __global FieldTile *tile = ray->fields + ray->field_count++;
            __global const RegionField *known = region_field(region, leaf);
            if (known) tile_begin(tile, leaf, SLABS, known->edges, known->cells + number * SLABS, rect, splits);
            else tile_make(tile, field_record(ray, leaf), ray->tapes, leaf, ray->kappa, rect, splits, memory);
        }
    }
#endif
}
