// Colours and the other layers of a tile, into the film.

#if WIDTH == 16
#define LANE_COLUMN(lane) ((lane) / 16 * 4 + (lane) % 4)
#define LANE_ROW(lane) ((lane) % 16 / 4)
#define LANE(value, lane) ((const float *)&(value))[lane]
#define LANE_UINT(value, lane) ((const uint *)&(value))[lane]

// Four pixels of four channels: a line of the cache, written past it where that can be said, since nobody reads it soon (4 % of a frame of S1).
static void store_line(__global float *to, float16 pixels)
{
#ifdef __has_builtin
#if __has_builtin(__builtin_nontemporal_store)
    __builtin_nontemporal_store(pixels, (__global float16 *)to);
    return;
#endif
#endif
    vstore16(pixels, 0, to);
}

// A packet of 4 x 4 pixels, a vector for each channel, to four lines of the film. Pairs of channels are interleaved first and then pairs of pairs: eight
// permutations of two vectors in all. Picking the sixteen numbers of each line one by one took five times as long, 15 % of a frame of S1.
#define INTERLEAVE(x, y) (((float16)(x, y)).s08192a3b4c5d6e7f)
#define INTERLEAVE_PAIRS(x, y) (((float16)(x, y)).s018923ab45cd67ef)
static void store_packet(__global float *to, size_t row, float16 a, float16 b, float16 c, float16 d)
{
    float16 ab = INTERLEAVE(a.lo, b.lo), cd = INTERLEAVE(c.lo, d.lo);
    float16 line0 = INTERLEAVE_PAIRS(ab.lo, cd.lo), line1 = INTERLEAVE_PAIRS(ab.hi, cd.hi);
    ab = INTERLEAVE(a.hi, b.hi), cd = INTERLEAVE(c.hi, d.hi);
    float16 line2 = INTERLEAVE_PAIRS(ab.lo, cd.lo), line3 = INTERLEAVE_PAIRS(ab.hi, cd.hi);
    if ((((size_t)to | (row * sizeof(float))) & 63) == 0) {
        store_line(to, line0);
        store_line(to + row, line1);
        store_line(to + 2 * row, line2);
        store_line(to + 3 * row, line3);
    } else {
        vstore16(line0, 0, to);
        vstore16(line1, 0, to + row);
        vstore16(line2, 0, to + 2 * row);
        vstore16(line3, 0, to + 3 * row);
    }
}
#else
#define LANE_COLUMN(lane) 0
#define LANE_ROW(lane) 0
#define LANE(value, lane) (value)
#define LANE_UINT(value, lane) (value)
#endif

typedef struct Film {
    __global float *color, *depth, *normal, *position;
    __global uint *id;
} Film;

static void film_color(__global const FrameConstants *frame, __global float *film, int left, int top, Vector c, FLOAT alpha, int add)
{
#if WIDTH == 16
    if (!add && left + BLOCK_ACROSS <= frame->width && top + BLOCK_DOWN <= frame->height) {
        film += ((size_t)top * frame->width + left) * 4;
        size_t row = (size_t)frame->width * 4;
#if LANES == 32
        store_packet(film, row, c.x.lo, c.y.lo, c.z.lo, alpha.lo);
        store_packet(film + 16, row, c.x.hi, c.y.hi, c.z.hi, alpha.hi);
#else
        store_packet(film, row, c.x, c.y, c.z, alpha);
#endif
        return;
    }
#endif
    for (int lane = 0; lane < LANES; lane++) {
        int x = left + LANE_COLUMN(lane), y = top + LANE_ROW(lane);
        if (x >= frame->width || y >= frame->height) continue;
        __global float *pixel = film + ((size_t)y * frame->width + x) * 4;
        pixel[0] = (add ? pixel[0] : 0.0f) + LANE(c.x, lane);
        pixel[1] = (add ? pixel[1] : 0.0f) + LANE(c.y, lane);
        pixel[2] = (add ? pixel[2] : 0.0f) + LANE(c.z, lane);
        pixel[3] = LANE(alpha, lane);
    }
}

static void film_vector(__global const FrameConstants *frame, __global float *film, int left, int top, Vector c)
{
    for (int lane = 0; lane < LANES; lane++) {
        int x = left + LANE_COLUMN(lane), y = top + LANE_ROW(lane);
        if (x >= frame->width || y >= frame->height) continue;
        __global float *pixel = film + ((size_t)y * frame->width + x) * 3;
        pixel[0] = LANE(c.x, lane);
        pixel[1] = LANE(c.y, lane);
        pixel[2] = LANE(c.z, lane);
    }
}

static void film_number(__global const FrameConstants *frame, __global float *film, int left, int top, FLOAT value)
{
    for (int lane = 0; lane < LANES; lane++) {
        int x = left + LANE_COLUMN(lane), y = top + LANE_ROW(lane);
        if (x >= frame->width || y >= frame->height) continue;
        film[(size_t)y * frame->width + x] = LANE(value, lane);
    }
}

static Vector to_world(__global const float *axes, Vector p)
{
    return (Vector){axes[0] * p.x + axes[3] * p.y + axes[6] * p.z, axes[1] * p.x + axes[4] * p.y + axes[7] * p.z,
                    axes[2] * p.x + axes[5] * p.y + axes[8] * p.z};
}

// The layers that are not colour.
static void film_layers(const Buffers *b, const Tile *tile, uint k, const Film *film, int left, int top, INT hit, Vector n)
{
    __global const FrameConstants *frame = b->frame;
    FLOAT zero = 0.0f;
    Vector p = hit_place(b, tile, k);
    if (frame->layers & LAYER_DEPTH) {
        FLOAT depth = frame->orthographic != 0.0f ? p.z - b->views->start : p.z + b->views->unit_distance;
        film_number(frame, film->depth, left, top, hit ? frame->unit * depth : (FLOAT)(INFINITY));
    }
    if (frame->layers & LAYER_NORMAL) {
        Vector world = to_world(frame->axes, n);
        film_vector(frame, film->normal, left, top, (Vector){hit ? world.x : zero, hit ? world.y : zero, hit ? world.z : zero});
    }
    if (frame->layers & LAYER_POSITION) {
        Vector world = to_world(frame->axes, p);
        world.x = frame->origin[0] + frame->unit * world.x;
        world.y = frame->origin[1] + frame->unit * world.y;
        world.z = frame->origin[2] + frame->unit * world.z;
        film_vector(frame, film->position, left, top, (Vector){hit ? world.x : zero, hit ? world.y : zero, hit ? world.z : zero});
    }
#ifndef HAS_FIELD // else tile.cl writes it, where the doubts are known
    if (frame->layers & LAYER_CERTIFICATE) film_number(frame, b->certificate, left, top, zero);
#endif
    if (frame->layers & LAYER_ID) {
        UINT leaf = tile->leaf[k];
        for (int lane = 0; lane < LANES; lane++) {
            int x = left + LANE_COLUMN(lane), y = top + LANE_ROW(lane);
            if (x >= frame->width || y >= frame->height) continue;
            uint rank = LANE_UINT(leaf, lane);
            film->id[(size_t)y * frame->width + x] = rank == NO_LEAF ? 0u : 1u + b->nodes[b->nodes[rank].leaf].object;
        }
    }
}

// Colours of a tile, of the lights [first, first + count); with `more` they are added to what is there.
PASS void shade_tile(const Buffers *b, const Tile *tile, const Film *film, uint first, uint count, int more)
{
    __global const FrameConstants *frame = b->frame;
    FLOAT one = 1.0f, zero = 0.0f;
    FOR_EACH_BLOCK(k) {
        int left = tile->left + (int)(k % BLOCKS_ACROSS) * BLOCK_ACROSS;
        int top = tile->top + (int)(k / BLOCKS_ACROSS) * BLOCK_DOWN;
        if (left >= frame->width || top >= frame->height) continue;
        INT hit = tile->leaf[k] != NO_LEAF;
        Vector color;
        color.x = more ? 0.0f : frame->background[0];
        color.y = more ? 0.0f : frame->background[1];
        color.z = more ? 0.0f : frame->background[2];
        Vector n;
        n.x = n.y = n.z = 0.0f;
        if (ANY(hit)) {
            n = (Vector){tile->x[k], tile->y[k], tile->z[k]};
            Vector p = hit_place(b, tile, k);
            float kappa = b->views->kappa;
            Vector v = {-kappa * pixel_u(b, tile, k), -kappa * pixel_v(b, tile, k), (FLOAT)(-1.0f)};
            FLOAT scale = inverse_root(v.x * v.x + v.y * v.y + 1.0f);
            v.x *= scale;
            v.y *= scale;
            v.z *= scale;
            UINT leaves = tile->leaf[k];
            INT todo = hit;
            while (ANY(todo)) {
                uint rank = next_rank(leaves, todo, frame->leaf_count);
                INT mine = todo & (leaves == rank);
                todo = todo & !mine;
                uint leaf = b->nodes[rank].leaf;
                shade_material(b->materials + b->nodes[leaf].material, b->lights + first, count, p, n, v, tile->visible[k], mine, !more, &color);
            }
        }
        if (frame->layers & LAYER_COLOR) film_color(frame, film->color, left, top, color, hit ? one : zero, more);
        if (!more && (frame->layers & ~LAYER_COLOR)) film_layers(b, tile, k, film, left, top, hit, n);
    }
}

// The row of tiles that comes k-th: from the middle of the picture outwards, since tiles at the edges are mostly soon done, and the last of a frame should be
// (S1 … S5: with a work-group a tile two threads gained 1.90 … 1.96 with it instead of 1.85 … 1.90 from top to bottom).
static uint row_of(uint k, uint rows)
{
    return k & 1u ? rows / 2 - (k + 1) / 2 : rows / 2 + k / 2;
}

// A tile, as far as the stage asks for it.
PASS void render_tile(const Buffers *b, Tile *tile, const Film *film, uint stages)
{
    if (!primary_hits(b, tile, stages) || stages == 1 || stages == 2) return;
    // As many lights at a time as `visible` has bits.
    uint light_count = b->frame->layers & LAYER_COLOR ? b->frame->light_count : 0;
    for (uint first = 0; first == 0 || first < light_count; first += 32) {
        uint count = min(light_count - first, 32u);
        if (first) clear_visible(tile);
        for (uint k = 0; k < count; k++)
            if (!light_visible(b, tile, b->lights + first + k, 1u << k)) return;
        if (stages == 3) return;
        shade_tile(b, tile, film, first, count, first != 0);
    }
}

#if WIDTH == 16
// Work-items take tiles as they come, one after the other: the next number below `last`, or `last`. What a work-item has for its tiles stays in its cache, and
// none waits for another that has the costly ones (with a work-item a tile, two threads rendered bear 1.5 times as fast as one).
static uint next_tile(volatile __global uint *taken, uint last)
{
    uint number = *taken;
    while (number < last) {
        uint seen = atomic_cmpxchg(taken, number, number + 1u);
        if (seen == number) break;
        number = seen;
    }
    return number;
}
#endif

// `last`: behind the last tile (with packets, where work-items take several). `stages`: RenderStages of runtime/renderer.h.
__kernel void render(__global const FrameConstants *frame, __global const ViewConstants *views, __global const LightConstants *lights,
                     __global const QuadricRecord *records, __global const float *boxes, __global const uint *items,
                     __global const PlanNode *nodes, __global const MaterialConstants *materials, __global const uint *tapes, __global uint *work, __global uint *counters,
                     __global float *color, __global float *depth, __global float *normal, __global float *position, __global uint *id,
                     __global float *certificate, uint first_tile, uint last, uint stages)
{
    __local FLOAT hit_z[BLOCKS], normal_x[BLOCKS], normal_y[BLOCKS], normal_z[BLOCKS];
    __local UINT hit_leaf[BLOCKS], visible[BLOCKS];
    __local uint shared[SHARED_SIZE];
#if WIDTH == 16
    __local FLOAT light_u[BLOCKS], light_v[BLOCKS], light_w[BLOCKS];
#endif
    uint group = (uint)get_group_id(0), across = (uint)frame->tiles_across;
    Buffers b = {frame, views, lights, records, boxes, items, nodes, materials,
#ifdef HAS_FIELD
                 (__global const TapeStep *)tapes,
#endif
                 work, work + (size_t)group * frame->slot_size, counters, certificate};
    Film film = {color, depth, normal, position, id};
#if WIDTH == 16
    __global uint *taken = counters + (stages == STAGE_REGIONS ? COUNTER_REGIONS : COUNTER_TILES);
    for (uint number = next_tile(taken, last); number < last; number = next_tile(taken, last)) {
#else
    uint number = first_tile + group;
#endif
#ifdef HAS_FIELD
    if (stages == STAGE_REGIONS) {
        region_make(&b, number, shared);
    } else
#endif
    {
        Tile tile = {hit_z, normal_x, normal_y, normal_z, hit_leaf, visible,
#if WIDTH == 16
                     light_u, light_v, light_w,
#endif
                     shared,
                     (int)(number % across) * TILE_SIZE, (int)row_of(number / across, frame->tiles_down) * TILE_SIZE, 0};
        render_tile(&b, &tile, &film, stages);
    }
#if WIDTH == 16
    }
#endif
}
