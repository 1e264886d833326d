// General fields along rays. Of a piece of a ray a strip (strip.cl) tells up to where F is negative and from where on it is positive: what lies before the one is
// passed, and between both is the first root. The piece between both is looked at again, and is narrower by the square each time where F is smooth, until
// it is as narrow as floats can tell. Pieces of which nothing is told are halved.
// What floats cannot separate is decided by the signs at places of the piece, and the ray is marked: its pixel is not certified.
//
// A ray goes through the cells of its tile that are not empty (cells.cl), with the tape of each.
//
// s = w / W is the depth (tape_shared.h): rays are straight and s rises along them.

#define FIELD_STEPS 400 // evaluations for a cell of a packet, before what is left is sampled
#define LAST_SAMPLES 16
#define SAMPLES 4         // of a piece that is lost in noise
#define NOISE_PART 1.0f   // of what floats may be wrong by: what F may be at most where it is lost in that

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
    for (int k = 0; k < 3; k++) point[k] = range_at(line->o[k], line->e[k], s);
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

// The first of `count` + 1 places of [p, end] at which F is positive, and the place before it; `beyond`: the first one is not asked.
static FLOAT field_sampled(const Tape *tape, const FieldLine *line, FLOAT p, FLOAT end, int count, INT live, INT beyond, float sign, FLOAT *before,
                           __global FLOAT *memory)
{
    FLOAT found = INFINITY, step = (end - p) / (float)count;
    *before = p;
    for (int k = 0; k <= count && ANY(live); k++) {
        FLOAT s = k < count ? p + (float)k * step : end;
        FLOAT f = field_value(tape, line, s, sign, memory);
        INT positive = live & (f > 0.0f) & (k ? live : !beyond);
        found = positive ? s : found;
        live = live & !positive;
        *before = live ? s : *before;
    }
    return found;
}

// What is known of sign * F over a piece, and what is undefined in it: that is outside.
INLINE Strip field_strip(const Tape *tape, const FieldLine *line, FLOAT p, FLOAT q, float sign, __global FLOAT *memory)
{
    Strip result, f;
    Doubt doubt;
    FLOAT least_number = -INFINITY, most_number = INFINITY;
    tape_strip(tape, line->o, line->e, &p, &q, memory, &result, &doubt);
    f = result;
    f.p.low = doubt.maybe ? least_number : f.p.low;
    f.q.low = doubt.maybe ? least_number : f.q.low;
    f.p.high = doubt.never ? least_number : f.p.high;
    f.q.high = doubt.never ? least_number : f.q.high;
    f = sign < 0.0f ? strip_negated(f) : f;
    f.p.high = f.p.high == f.p.high ? f.p.high : most_number;
    f.q.high = f.q.high == f.q.high ? f.q.high : most_number;
    return f;
}

// Where the line from a to b, which have other signs, is 0: as a part of its length.
INLINE FLOAT share_until_zero(FLOAT a, FLOAT b)
{
    return a / (a - b);
}

typedef struct Search { // of a packet in a cell, a ray a lane
    FLOAT p, h, end;       // the piece that is next begins at p and is h long; the search ends at `end`
    FLOAT certain;         // F is known to be positive there
    FLOAT found;
    FLOAT low, high;       // brackets of roots that are left to false position
    FLOAT f_low, f_high, noise;
    FLOAT least_step;      // shorter pieces tell nothing new
    INT live, at_root, bracketed, uncertain;
} Search;

INLINE void search_bracket(Search *m, INT which, FLOAT low, FLOAT high, FLOAT f_low, FLOAT f_high, FLOAT noise)
{
    m->low = which ? low : m->low;
    m->high = which ? high : m->high;
    m->f_low = which ? f_low : m->f_low;
    m->f_high = which ? f_high : m->f_high;
    m->noise = which ? noise : m->noise;
    m->bracketed = m->bracketed | which;
    m->live = m->live & !which;
}

// Pieces of which strips tell nothing new: the signs of F at a few places decide, and the ray is marked.
NOINLINE void search_sampled(const Tape *tape, const FieldLine *line, Search *m, const INT *pwhich, const FLOAT *pq, const FLOAT *pnoise, float sign,
                             __global FLOAT *memory)
{
    INT which = *pwhich;
    FLOAT q = *pq, before, large = LARGEST;
    FLOAT place = field_sampled(tape, line, m->p, q, SAMPLES, which, m->at_root, sign, &before, memory);
    INT positive = which & (place < INFINITY), at_once = positive & (place == m->p), between = positive & !at_once;
    INT marked = which & !m->at_root;
    if (ANY(marked)) { // what is positive for certain a little later leaves no doubt of the root: it is before that, and is found before that
        FLOAT at = positive ? place : q, beyond = least(at + 1e-4f * (size_of(at) + 0.1f), m->end); // a tape is that of its cell
        Range there = field_bounds(tape, line, beyond, sign, memory);
        marked = marked & !(there.low > 0.0f);
    }
    m->uncertain = m->uncertain | marked;
    m->found = at_once ? place : m->found;
    m->live = m->live & !at_once;
    if (!ANY(between)) return;
    FLOAT f_low = field_value(tape, line, before, sign, memory), f_high = field_value(tape, line, positive ? place : q, sign, memory);
    search_bracket(m, between, before, place, most(least(f_low, 0.0f), -large), least(f_high, large), *pnoise);
}

// Pieces where it is not known at their beginning whether F is positive, or where what is known of a root grows no narrower: how long the next one is to be, and
// of which ones floats cannot tell more.
NOINLINE void search_closer(const Tape *tape, const FieldLine *line, Search *m, const Strip *pf, const INT *popen, const FLOAT *pq, float sign,
                            __global FLOAT *memory)
{
    INT open = *popen;
    Strip f = *pf;
    FLOAT q = *pq, width = q - m->p;
    Range there = field_bounds(tape, line, m->p, sign, memory);
    INT begins = open & !m->at_root & (there.low > 0.0f);
    m->found = begins ? m->p : m->found;
    m->live = m->live & !begins;
    open = open & !begins;
    FLOAT noise = there.high - there.low, top = most(f.p.high, f.q.high), extent = top - least(f.p.low, f.q.low);
    FLOAT place = m->least_step + 2.5e-7f * most(size_of(m->p), size_of(q));
    INT near = width <= 0.02f * (1.0f + size_of(m->p)); // farther it may be less than at p
    INT lost = near & (((top <= NOISE_PART * noise) & (there.high + 4.0f * noise >= 0.0f)) | (extent <= 4.0f * noise));
    INT closed = open & (lost | (width <= place));
    INT sure = closed & (q >= m->certain), sampled = closed & !sure & !(m->at_root & (f.q.high <= 0.0f));
    m->found = sure ? 0.5f * (m->p + q) : m->found;
    m->live = m->live & !sure;
    if (ANY(sampled)) search_sampled(tape, line, m, &sampled, &q, &noise, sign, memory);
    closed = closed & m->live;
    m->least_step = closed ? 2.0f * m->least_step : m->least_step;
    // Where F is lost in noise at p, the next piece is as long as it takes F to be as large.
    FLOAT usual = 0.5f, least_part = 0.0625f, fit = NOISE_PART * noise / top;
    FLOAT part = there.high >= 0.0f ? most(least(fit, usual), least_part) : usual;
    m->h = open ? (closed ? 4.0f * width : part * width) : m->h;
    m->p = closed ? q : m->p;
    m->at_root = m->at_root & !closed;
}

// What a piece from p to q that is open tells: up to where F is not positive, from where on it is, and with that where to go on.
INLINE void search_open(const Tape *tape, const FieldLine *line, Search *m, Strip f, INT open, FLOAT q, int exists, int late, float sign, __global FLOAT *memory)
{
    FLOAT width = q - m->p, start = m->p, stop = q;
    INT before = open & (f.p.high < 0.0f), behind = f.q.low > 0.0f, crosses = open & (behind | (q >= m->certain));
    FLOAT ahead = sum_below(m->p, product_below(0.999999f * share_until_zero(f.p.high, f.q.high), width));
    FLOAT back = sum_above(m->p, product_above(1.000001f * share_until_zero(f.p.low, f.q.low), width));
    start = (before & (ahead > m->p)) ? ahead : start;
    stop = (behind & (back < q)) ? back : stop;
    FLOAT gap = stop - start;
    m->certain = crosses ? stop : m->certain;
    // Of two places between which the first root certainly is the middle of the strip is much nearer than they are to each other. A bracket that grows no narrower
    // is as good as floats are, or has an edge in it.
    FLOAT size = size_of(stop) + 1e-6f;
    INT found = (gap <= 1e-5f * size) | ((gap <= 5e-5f * size) & (gap > 0.5f * width));
    INT narrow = crosses & (exists ? crosses : (before | !m->at_root) & found);
    FLOAT middle = m->p + width * share_until_zero(f.p.low + f.p.high, f.q.low + f.q.high);
    m->found = narrow ? least(most(middle, start), stop) : m->found;
    m->live = m->live & !narrow;
    open = open & !narrow;
    FLOAT rest = q - start;
    INT shorter = open & crosses & (gap <= 0.5f * width), far = open & !crosses & (rest <= 0.5f * width);
    INT closer = open & !shorter & !far, asked = closer & (!before | crosses | (late ? closer : !closer));
    m->p = open ? start : m->p;
    m->h = shorter ? gap : far ? rest : closer ? 0.5f * (crosses ? gap : rest) : m->h;
    m->at_root = m->at_root & !before;
    FLOAT last = crosses ? stop : q;
    if (ANY(asked)) { // copies: what a function can reach stays in memory
        Search part = *m;
        Strip copy = f;
        search_closer(tape, line, &part, &copy, &asked, &last, sign, memory);
        *m = part;
    }
}

// The first place of [p, end] where sign * F is positive; infinity where there is none. `at_root`: p is a place where it has just turned negative.
NOINLINE void field_search(const Tape *tape, const FieldLine *line, const FLOAT *from, const FLOAT *to, INT live, float sign, INT at_root,
                                  int exists, float grain, __global FLOAT *memory, FLOAT *answer, INT *doubts)
{
    FLOAT never = INFINITY, none = 0.0f, begin = *from;
    INT no = live & !live;
    Search m = {begin, *to - begin, *to, never, never, begin, begin, none, none, none, grain, live, at_root, no, no};
    for (int step = 0; ANY(m.live); step++) {
        if (step == FIELD_STEPS) {
            FLOAT unused, sampled = field_sampled(tape, line, m.p, m.end, LAST_SAMPLES, m.live, m.at_root, sign, &unused, memory);
            m.found = m.live ? sampled : m.found;
            m.uncertain = m.uncertain | m.live;
            break;
        }
        FLOAT q = m.h >= m.end - m.p ? m.end : least(m.p + m.h, m.end);
        q = least(q, m.certain);
        Strip f = field_strip(tape, line, m.p, q, sign, memory);
        INT passed = m.live & (f.p.high <= 0.0f) & (f.q.high <= 0.0f), contrary = passed & (q >= m.certain);
        INT met = m.live & (f.p.low > 0.0f) & (!m.at_root | (f.q.low > 0.0f)), open = m.live & !passed & !met;
        m.found = met ? m.p : contrary ? q : m.found;
        m.live = m.live & !met & !contrary;
        m.at_root = m.at_root & !passed;
        m.h = passed ? 8.0f * m.h : m.h;
        m.p = passed ? q : m.p;
        if (ANY(open)) search_open(tape, line, &m, f, open, q, exists, step >= 8, sign, memory);
        m.live = m.live & (m.p < m.end);
    }
    if (ANY(m.bracketed)) {
        FLOAT s = exists ? m.high : field_root(tape, line, m.low, m.high, m.f_low, m.f_high, m.noise, m.bracketed, sign, memory);
        m.found = m.bracketed ? s : m.found;
    }
    *answer = m.found;
    *doubts = *doubts | m.uncertain;
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
    INT stale = stretch_is_over(stretch, t, bound);
    if (ANY(stale)) {
        FLOAT limit = stale ? bound : (FLOAT)(-INFINITY);
        FLOAT entry = field_next(ray, id, t, limit, sign, stretch_ends_at(stretch, t), 0);
        FLOAT end = field_next(ray, id, entry, limit, -sign, t == t, 0);
        stretch_keep(stretch, stale, t, entry, end);
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
#ifdef HAS_COPIES
        if (list.ids[k] >= ray->copied) continue;
#endif
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
