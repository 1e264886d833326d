// The kernel: a work-group renders a tile, and with packets then the next one that nobody has. In order: the tile's list; for each packet the first hit, its leaf and normal; for each light the list
// of what can shadow the tile's hits, and for each packet what is in between; shading and the film. All in one kernel, so what a tile's
// passes give each other stays in the cache: 29 kB of local memory for packets of 1 (devices have 32 kB), 41 kB for packets of 16.
//
// Tried, and not worth it, in shares of a frame of S1 at 1024² (S2 alike): one packet of 16 a work-item instead of two, 20 … 27 % longer; tiles of 16 x 16,
// 4 %; a list for each packet where the tile's is short, 3 %; the search of the first surface as one function for eye and lights, 6 %; what the film takes
// stored through the cache, 6 %; perturbations added whether rays are in their supports or not, 1 %. Without gain: a parabola for the chord that roots
// begin with (a tenth fewer steps, each dearer), leaving supports out of normals that no ray is in, a shorter way for packets that hit nothing (a sixth of an
// empty picture), normals as a function, roots without one.

typedef struct Buffers {
    __global const FrameConstants *frame;
    __global const ViewConstants *views; // 0 is the primary one
    __global const LightConstants *lights;
    __global const QuadricRecord *records;
    __global const float *boxes;
    __global const uint *items;
    __global const PlanNode *nodes;
    __global const MaterialConstants *materials;
#ifdef HAS_FIELD
    __global const TapeStep *tapes;
#endif
    __global uint *work, *slot; // of all tiles, of this one
    __global uint *counters;
    __global float *certificate;
} Buffers;

static void film_number(__global const FrameConstants *frame, __global float *film, int left, int top, FLOAT value); // film.cl

typedef struct Tile { // a FLOAT or UINT for each packet
    __local FLOAT *depth;         // of the hit: w / W
    __local FLOAT *x, *y, *z;     // normal
    __local UINT *leaf;           // rank of the leaf that was hit; NO_LEAF: none
    __local UINT *visible;        // a bit for each light
#if WIDTH == 16
    __local FLOAT *light_u, *light_v, *light_w; // the rays towards the light that is under way; w is -infinity where there is none
#endif
    __local uint *shared;
    int left, top; // pixels
    int inside;    // 1: rays of this work-item's packets begin inside of something
} Tile;

#if WIDTH == 16
#define FOR_EACH_BLOCK(k) for (uint k = 0; k < BLOCKS; k++)
#else
#define FOR_EACH_BLOCK(k) for (uint k = (uint)get_local_id(0); k < BLOCKS; k += (uint)get_local_size(0))
#endif

static List all_items(const Buffers *b, __global const ViewConstants *view)
{
    List all = {.ids = b->items, .boxes = b->boxes + view->first_box, .stride = b->frame->item_stride, .count = b->frame->item_count};
#ifdef HAS_COPIES
    uint first = b->frame->copy_first + (uint)get_group_id(0) * b->frame->list_capacity - view->first_record;
    all.copies = (Copies){b->nodes, (__global QuadricRecord *)b->records + view->first_record, (__global const ClusterPart *)b->records, first, view->kappa};
#endif
    return all;
}

static Ray ray_of(const Buffers *b, __global const ViewConstants *view)
{
    Ray ray;
    ray.u = ray.v = 0.0f;
    ray.kappa = view->kappa;
    ray.records = b->records + view->first_record;
    ray.nodes = b->nodes;
    ray.list = b->items;
    ray.count = 0;
    ray.shadow = 0;
#ifdef HAS_COPIES
    ray.copied = b->frame->copy_first - view->first_record;
#endif
#ifdef HAS_FIELD
    ray.tapes = b->tapes;
    ray.field_count = 0;
    ray.part = 0;
#endif
    return ray;
}

static FLOAT pixel_u(const Buffers *b, const Tile *tile, uint packet)
{
    float left = (float)(tile->left + (int)(packet % BLOCKS_ACROSS) * BLOCK_ACROSS);
    return b->frame->u0 + (LANE_X + (left + 0.5f)) * b->frame->du;
}

static FLOAT pixel_v(const Buffers *b, const Tile *tile, uint packet)
{
    float top = (float)(tile->top + (int)(packet / BLOCKS_ACROSS) * BLOCK_DOWN);
    return b->frame->v0 + (LANE_Y + (top + 0.5f)) * b->frame->dv;
}

// First surface of the scene on the rays, before the bound: where the rays enter it, or leave it where they begin inside; some_inside is
// set if any does.
INLINE FLOAT first_surface(const Ray *ray, FLOAT start, FLOAT bound, UINT *leaf, int *some_inside)
{
    FLOAT w = scene_enter(ray, start, bound, leaf);
    INT inside = (w <= start) & (w < bound);
    if (ANY(inside)) {
        *some_inside = 1;
        UINT left;
        FLOAT out = scene_leave(ray, start, inside ? bound : (FLOAT)(-INFINITY), &left), never = INFINITY;
        out = left == NO_LEAF ? never : out;
        w = inside ? out : w;
        *leaf = inside ? left : *leaf;
    }
    return w;
}

#ifdef HAS_FIELD
// What the region of a tile has found; NULL where there is none.
static __global uint *region_of(const Buffers *b, int left, int top)
{
    __global const FrameConstants *frame = b->frame;
    uint size = TILE_SIZE * REGION_TILES;
    if (!frame->regions_across) return 0;
    uint number = (uint)left / size + (uint)top / size * frame->regions_across;
    return b->work + (size_t)frame->region_first * frame->slot_size + (size_t)number * frame->region_size;
}

static uint tile_of_region(const Tile *tile)
{
    return (uint)(tile->left / TILE_SIZE) % REGION_TILES + (uint)(tile->top / TILE_SIZE) % REGION_TILES * REGION_TILES;
}

// The part of a tile that holds a packet.
static uint part_of(uint packet)
{
    uint across = packet % BLOCKS_ACROSS * BLOCK_ACROSS, down = packet / BLOCKS_ACROSS * BLOCK_DOWN;
    return across / 8u + down / 8u * 4u;
}

// Into the layer and into the count; a tile that is run again writes and counts anew.
static void count_doubts(const Buffers *b, const Tile *tile, uint packet, INT doubts)
{
    int left = tile->left + (int)(packet % BLOCKS_ACROSS) * BLOCK_ACROSS, top = tile->top + (int)(packet / BLOCKS_ACROSS) * BLOCK_DOWN;
    FLOAT one = 1.0f, zero = 0.0f;
    if (b->frame->layers & LAYER_CERTIFICATE) film_number(b->frame, b->certificate, left, top, doubts ? one : zero);
    if (!ANY(doubts)) return;
    FLOAT x = (float)left + LANE_X, y = (float)top + LANE_Y;
    INT counted = doubts & (x < (float)b->frame->width) & (y < (float)b->frame->height);
#if LANES == 32
    atomic_add(b->counters + COUNTER_UNCERTAIN, popcount(lanes_bits(counted)));
#elif LANES == 1
    if (counted) atomic_inc(b->counters + COUNTER_UNCERTAIN);
#else
    atomic_add(b->counters + COUNTER_UNCERTAIN, popcount(mask_bits(counted)));
#endif
}
#endif

#ifdef HAS_FIELD
// What a region's fields are, before its tiles.
PASS void region_make(const Buffers *b, uint number, __local uint *shared)
{
#if LANES == 32
    __global const FrameConstants *frame = b->frame;
    __global const ViewConstants *view = b->views;
    int size = TILE_SIZE * REGION_TILES, left = (int)(number % frame->regions_across) * size, top = (int)(number / frame->regions_across) * size;
    float u0 = frame->u0 + frame->du * (float)left, u1 = frame->u0 + frame->du * (float)(left + size);
    float v0 = frame->v0 + frame->dv * (float)top, v1 = frame->v0 + frame->dv * (float)(top + size);
    Rect rect = {u0, u1, v1, v0, view->limit};
    __global uint *region = region_of(b, left, top);
    region[0] = 0;
    List all = all_items(b, view);
#ifdef HAS_COPIES
    all.copies.nodes = 0; // of which a region has no use
#endif
    List list = list_make(all, &rect, b->slot, frame->list_capacity, shared);
    if (list.count > list.stride) return;
    Ray ray = ray_of(b, view);
    region_fields_make(&ray, frame, list, &rect, region, b->slot + frame->field_offset + FIELD_TABLE);
#endif
}
#endif

// Answers 0 where the tile's list has no room.
PASS int primary_hits(const Buffers *b, Tile *tile, uint stages)
{
    __global const FrameConstants *frame = b->frame;
    __global const ViewConstants *view = b->views;
    float u0 = frame->u0 + frame->du * (float)tile->left, u1 = frame->u0 + frame->du * (float)(tile->left + TILE_SIZE);
    float v0 = frame->v0 + frame->dv * (float)tile->top, v1 = frame->v0 + frame->dv * (float)(tile->top + TILE_SIZE);
    Rect rect = {u0, u1, v1, v0, view->limit}; // v rises where pixels go down
    List list = list_make(all_items(b, view), &rect, b->slot, frame->list_capacity, tile->shared);
    if (list.count > list.stride) return list_full(b->counters, list.count);
    if (stages == 1) return 1;
    Ray ray = ray_of(b, view);
#ifdef HAS_FIELD
    FieldMemory memory;
    fields_make(&ray, frame, list, &rect, 1, region_of(b, tile->left, tile->top), tile_of_region(tile), b->slot + frame->field_offset, &memory);
#endif
    FOR_EACH_BLOCK(k) {
#ifdef HAS_FIELD
        INT doubts = 0;
        ray.doubts = &doubts;
        ray.part = part_of(k);
#endif
        ray.u = pixel_u(b, tile, k);
        ray.v = pixel_v(b, tile, k);
        float x = (float)((k % BLOCKS_ACROSS) * BLOCK_ACROSS), y = (float)((k / BLOCKS_ACROSS) * BLOCK_DOWN);
        rect.u_low = u0 + x * frame->du;
        rect.u_high = rect.u_low + BLOCK_ACROSS * frame->du;
        rect.v_high = v0 + y * frame->dv;
        rect.v_low = rect.v_high + BLOCK_DOWN * frame->dv;
        ray.list = list_of_packet(list, &rect, SLOT_PACKET(b->slot, frame->list_capacity), frame->list_capacity, &ray.count);
        UINT leaf = NO_LEAF;
        if (ray.count) {
            FLOAT w = first_surface(&ray, view->start, view->limit, &leaf, &tile->inside);
            INT hit = (w < view->limit) & (leaf != NO_LEAF); // what nothing decided is no surface: rounding at the eye
            leaf = hit ? leaf : (UINT)(NO_LEAF);
            if (ANY(hit)) {
                Vector n = surface_normal(&ray, frame->leaf_count, leaf, hit, w);
                tile->depth[k] = w / (1.0f - view->kappa * w);
                tile->x[k] = n.x;
                tile->y[k] = n.y;
                tile->z[k] = n.z;
            }
        }
#ifdef HAS_FIELD
        count_doubts(b, tile, k, doubts);
#endif
        tile->leaf[k] = leaf;
        tile->visible[k] = 0;
    }
    BARRIER;
    return 1;
}

// The hit of a packet in the primary view's axes: p = (U, V, w) / W, where 1 / W = 1 + kappa w / W.
INLINE Vector hit_place(const Buffers *b, const Tile *tile, uint k)
{
    FLOAT depth = tile->depth[k], scale = 1.0f + b->views->kappa * depth;
    return (Vector){pixel_u(b, tile, k) * scale, pixel_v(b, tile, k) * scale, depth};
}

// Which hits of a packet face the light, and where their rays are in one of its views: u, v, and how far they go.
INLINE INT light_rays(const Buffers *b, const Tile *tile, uint k, __global const LightConstants *light, __global const ViewConstants *view,
                      FLOAT *u, FLOAT *v, FLOAT *w)
{
    Vector p = hit_place(b, tile, k);
    Vector n = {tile->x[k], tile->y[k], tile->z[k]};
    FLOAT nl;
    if (light->point) nl = n.x * (light->at[0] - p.x) + n.y * (light->at[1] - p.y) + n.z * (light->at[2] - p.z);
    else nl = n.x * light->at[0] + n.y * light->at[1] + n.z * light->at[2];
    INT mine = (tile->leaf[k] != NO_LEAF) & (nl > 0.0f);
    // Far away a place has fewer digits: the bias grows with it, or a plane would shadow itself towards its horizon.
    FLOAT bias = b->frame->bias * (1.0f + 0.02f * most(most(size_of(p.x), size_of(p.y)), size_of(p.z)));
    p.x += bias * n.x;
    p.y += bias * n.y;
    p.z += bias * n.z;
    __global const float *m = view->map;
    FLOAT x = m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3];
    FLOAT y = m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7];
    FLOAT z = m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11];
    FLOAT scale = 1.0f;
    if (view->kappa > 0.0f) {
        FLOAT depth = 1.0f + view->kappa * z;
        mine = mine & (depth > 0.0f);
        if (view->faced) {
            FLOAT reach = depth * view->unit_distance * 1.0001f;
            mine = mine & (size_of(x) <= reach) & (size_of(y) <= reach);
        }
        scale = 1.0f / depth;
    }
    *u = x * scale;
    *v = y * scale;
    *w = z * scale;
    return mine;
}

#if WIDTH == 1
// The rectangle around those of the work-items of the group.
static Rect rect_of_group(Rect rect, __local uint *shared)
{
    uint lane = (uint)get_local_id(0);
    shared[5 * lane] = as_uint(rect.u_low);
    shared[5 * lane + 1] = as_uint(rect.u_high);
    shared[5 * lane + 2] = as_uint(rect.v_low);
    shared[5 * lane + 3] = as_uint(rect.v_high);
    shared[5 * lane + 4] = as_uint(rect.w_high);
    BARRIER;
    for (uint k = 0; k < (uint)get_local_size(0); k++) {
        rect.u_low = min(rect.u_low, as_float(shared[5 * k]));
        rect.u_high = max(rect.u_high, as_float(shared[5 * k + 1]));
        rect.v_low = min(rect.v_low, as_float(shared[5 * k + 2]));
        rect.v_high = max(rect.v_high, as_float(shared[5 * k + 3]));
        rect.w_high = max(rect.w_high, as_float(shared[5 * k + 4]));
    }
    BARRIER;
    return rect;
}
#endif

INLINE Rect rect_around(FLOAT low_u, FLOAT high_u, FLOAT low_v, FLOAT high_v, FLOAT high_w)
{
    float4 lowest = lowest_of_four(low_u, -high_u, low_v, -high_v);
    return (Rect){lowest.x, -lowest.y, lowest.z, -lowest.w, highest(high_w)};
}

// How many rays of a packet belong to pixels of the picture; `edge`: of the tile they are not all.
INLINE uint rays_of_picture(const Buffers *b, const Tile *tile, uint packet, INT rays, int edge)
{
    if (edge) {
        FLOAT x = (float)(tile->left + (int)(packet % BLOCKS_ACROSS) * BLOCK_ACROSS) + LANE_X;
        FLOAT y = (float)(tile->top + (int)(packet / BLOCKS_ACROSS) * BLOCK_DOWN) + LANE_Y;
        rays = rays & (x < (float)b->frame->width) & (y < (float)b->frame->height);
    }
#if LANES == 1
    return rays ? 1u : 0u;
#else
    return popcount(packet_bits(rays));
#endif
}

static void count_rays(__global uint *counters, uint rays)
{
    if (!rays) return;
    uint before = atomic_add(counters + COUNTER_SHADOWS, rays);
    if (before + rays < before) atomic_inc(counters + COUNTER_SHADOWS_HIGH);
}

// Answers 0 where the list of what can shadow has no room.
PASS int shadow_view(const Buffers *b, const Tile *tile, __global const LightConstants *light, __global const ViewConstants *view, uint bit)
{
    // What the tile's hits span in the light's view.
    FLOAT low_u = INFINITY, high_u = -INFINITY, low_v = INFINITY, high_v = -INFINITY, high_w = -INFINITY;
    FLOAT infinite = INFINITY;
    uint rays = 0;
    int edge = tile->left + TILE_SIZE > b->frame->width || tile->top + TILE_SIZE > b->frame->height;
    FOR_EACH_BLOCK(k) {
        if (!ANY(tile->leaf[k] != NO_LEAF)) continue;
        FLOAT u, v, w;
        INT mine = light_rays(b, tile, k, light, view, &u, &v, &w);
        rays += rays_of_picture(b, tile, k, mine, edge);
#if WIDTH == 16 // kept: making them again would take 4 % of a frame of S1
        tile->light_u[k] = u;
        tile->light_v[k] = v;
        tile->light_w[k] = mine ? w : -infinite;
#endif
        low_u = (mine & (u < low_u)) ? u : low_u;
        high_u = (mine & (u > high_u)) ? u : high_u;
        low_v = (mine & (v < low_v)) ? v : low_v;
        high_v = (mine & (v > high_v)) ? v : high_v;
        high_w = (mine & (w > high_w)) ? w : high_w;
    }
    count_rays(b->counters, rays);
    Rect rect = rect_around(low_u, high_u, low_v, high_v, high_w);
#if WIDTH == 1
    rect = rect_of_group(rect, tile->shared);
#endif
    if (rect.u_low > rect.u_high) return 1;
    uint capacity = b->frame->list_capacity;
    List all = all_items(b, view), list = list_make(all, &rect, b->slot, capacity, tile->shared);
#if WIDTH == 16
    int far_apart = list.count > LONG_LIST;
#else
    int far_apart = 0;
#endif
    if (list.count > capacity && !far_apart) return list_full(b->counters, list.count);
    Ray ray = ray_of(b, view);
    // A search that ends at whatever it meets may not notice that the light is inside too. Where the eye is outside what it meets is in the way all
    // the same: from a light that is inside no ray reaches the outside of a surface.
    ray.shadow = !tile->inside;
    int light_inside;
#ifdef HAS_FIELD
    INT doubts = 0; // a shadow is not certified
    ray.doubts = &doubts;
    FieldMemory memory;
    fields_make(&ray, b->frame, list, &rect, 0, 0, 0, b->slot + b->frame->field_offset, &memory);
#endif
    FOR_EACH_BLOCK(k) {
        if (!ANY(tile->leaf[k] != NO_LEAF)) continue;
        FLOAT u, v, w;
#if WIDTH == 16
        u = tile->light_u[k], v = tile->light_v[k], w = tile->light_w[k];
        INT mine = w > -infinite;
#else
        INT mine = light_rays(b, tile, k, light, view, &u, &v, &w);
#endif
        if (!ANY(mine)) continue;
        INT clear = mine;
        if (list.count) {
            ray.u = u;
            ray.v = v;
            if (list.count > SHORT_LIST)
                rect = rect_around(mine ? u : infinite, mine ? u : -infinite, mine ? v : infinite, mine ? v : -infinite, mine ? w : -infinite);
            __global uint *ids = SLOT_PACKET(b->slot, capacity);
#if WIDTH == 16
            if (far_apart) ray.list = list_of_rays(all, &rect, u, v, w, ids, capacity, &ray.count);
            else
#endif
                ray.list = list_of_packet(list, &rect, ids, capacity, &ray.count);
            if (far_apart && ray.count > capacity) return list_full(b->counters, ray.count);
            if (ray.count) {
                FLOAT bound = mine ? w : -infinite;
                UINT leaf;
                clear = mine & !(first_surface(&ray, view->start, bound, &leaf, &light_inside) < bound);
            }
        }
        UINT set = bit, none = 0;
        tile->visible[k] |= clear ? set : none;
    }
    BARRIER;
    return 1;
}

static int light_visible(const Buffers *b, const Tile *tile, __global const LightConstants *light, uint bit)
{
    if (!light->shadow) {
        FOR_EACH_BLOCK(k) {
            tile->visible[k] |= bit;
        }
        BARRIER;
        return 1;
    }
    for (uint k = 0; k < light->view_count; k++)
        if (!shadow_view(b, tile, light, b->views + light->first_view + k, bit)) return 0;
    return 1;
}

static void clear_visible(const Tile *tile)
{
    FOR_EACH_BLOCK(k) {
        tile->visible[k] = 0;
    }
    BARRIER;
}
