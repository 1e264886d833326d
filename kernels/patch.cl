// Deformable patches in the basis of clamped-beam modes: one work-group steps one component of one patch, by itself, as
// many steps as it is told. The equations are those of runtime/patch_model.h:
//
//     (L + μ + κ) e = f + g + touch + κ(a − ahead) − ηV − L·ahead     ahead = x + θ dt V
//     V⁺ = V + e/(θ² dt)                                              x⁺ = x + dt((1 − θ)V + θV⁺)
//
// over modes, where L Y = (bΛ_i + dΛ_j) Y + c B̂YB̂. The step is solved for its increment e and not for x⁺: V is then
// never the difference of two rounded shapes, which at small steps would be all noise in float.
//
// Conjugate gradients are preconditioned by the diagonal bΛ_i + dΛ_j + cβ_iβ_j + μ, which leaves 2 to 8 iterations of
// two products each. B̂ joins even modes with even and odd with odd ones only, so a product is two of half the depth.
// Pins are kept by projection: the preconditioned residual stays among the shapes that vanish at the pins, and what a
// pin pushes is taken out of the residual.
//
// A work-item does WIDTH columns of eight rows at once. On CPUs WIDTH is 16 and a work-group is one work-item;
// elsewhere a work-group is GROUP work-items of 32 columns by GROUP/32 rows. Sums are in a fixed order: the bits do not
// depend on threads.
#ifndef WIDTH
#define WIDTH 16
#endif
#ifndef GROUP
#define GROUP 1
#endif

#if WIDTH == 16
typedef float16 FLOAT;
// Arrays begin at multiples of 128 bytes, as buffers do, and so all vectors lie at multiples of their size: PoCL 3.1 makes one
// access of these, and several of vload16 and vstore16.
#define LOAD(p)     (*(global const float16 *)(p))
#define STORE(x, p) (*(global float16 *)(p) = (x))
#define LOAD_ANY(p) vload16(0, p)
static float sum_lanes(float16 x)
{
    float8 a = x.lo + x.hi;
    float4 b = a.lo + a.hi;
    float2 c = b.lo + b.hi;
    return c.x + c.y;
}
#else
typedef float FLOAT;
#define LOAD(p)     (*(p))
#define STORE(x, p) (*(p) = (x))
#define LOAD_ANY(p) (*(p))
#define sum_lanes(x) (x)
#endif

#if GROUP > 1
#define COLUMNS 32
#define SYNC barrier(CLK_GLOBAL_MEM_FENCE | CLK_LOCAL_MEM_FENCE)
#else
#define COLUMNS 1
#define SYNC
#endif
#define ROWS (GROUP / COLUMNS)
#define ME ((int)get_local_id(0))

// Walks this work-item's part of an order × order array (order = 2 span): rows i, columns j.
#define EACH_ROW(i, order, height) for (int i = ME / COLUMNS * (height); i < (order); i += ROWS * (height))
#define EACH_COLUMN(j, order)      for (int j = ME % COLUMNS * WIDTH; j < (order); j += COLUMNS * WIDTH)

// The sum over the work-group, the same for all.
#if GROUP > 1
static float sum_group(FLOAT x, local float *sums)
{
    SYNC;
    sums[ME] = sum_lanes(x);
    SYNC;
    float sum = 0;
    for (int k = 0; k < GROUP; k++) sum += sums[k];
    return sum;
}
#else
#define sum_group(x, sums) sum_lanes(x)
#endif

// Eight rows of a product: c[r][0 … WIDTH) = Σ_k a[r][k] b[k][0 … WIDTH), times scale, on top of c if `add`.
static void product8(global const float *a, int a_step, global const float *b, int b_step, int depth, global float *c,
                     int c_step, float scale, int add)
{
    FLOAT s0 = 0, s1 = 0, s2 = 0, s3 = 0, s4 = 0, s5 = 0, s6 = 0, s7 = 0;
    for (int k = 0; k < depth; k++) {
        FLOAT x = LOAD(b);
        s0 = fma((FLOAT)(a[k]), x, s0);
        s1 = fma((FLOAT)(a[k + a_step]), x, s1);
        s2 = fma((FLOAT)(a[k + 2 * a_step]), x, s2);
        s3 = fma((FLOAT)(a[k + 3 * a_step]), x, s3);
        s4 = fma((FLOAT)(a[k + 4 * a_step]), x, s4);
        s5 = fma((FLOAT)(a[k + 5 * a_step]), x, s5);
        s6 = fma((FLOAT)(a[k + 6 * a_step]), x, s6);
        s7 = fma((FLOAT)(a[k + 7 * a_step]), x, s7);
        b += b_step;
    }
#define PUT(r, s) STORE(add ? fma((FLOAT)(scale), s, LOAD(c + (r) * c_step)) : s * scale, c + (r) * c_step)
    PUT(0, s0);
    PUT(1, s1);
    PUT(2, s2);
    PUT(3, s3);
    PUT(4, s4);
    PUT(5, s5);
    PUT(6, s6);
    PUT(7, s7);
#undef PUT
}

// out = blocks · x: `blocks` are two span × span matrices, for the first and the second half of the rows.
static void multiply_left(global const float *blocks, global const float *x, global float *out, int span)
{
    int order = 2 * span;
    SYNC;
    EACH_ROW(i, order, 8) {
        int block = i >= span;
        global const float *rows = blocks + block * span * span + (i - block * span) * span;
        EACH_COLUMN(j, order)
            product8(rows, span, x + block * span * order + j, order, span, out + i * order + j, order, 1.0f, 0);
    }
    SYNC;
}

// out = scale · x · blocks, on top of out if `add`.
static void multiply_right(global const float *x, global const float *blocks, global float *out, int span, float scale,
                           int add)
{
    int order = 2 * span;
    SYNC;
    EACH_ROW(i, order, 8)
        EACH_COLUMN(j, order) {
            int block = j >= span;
            global const float *columns = blocks + block * span * span + j - block * span;
            product8(x + i * order + block * span, order, columns, span, span, out + i * order + j, order, scale, add);
        }
    SYNC;
}

#define ROOT_HALF 0.70710678f

// Folded arrays hold, at (r, s), the values of up to four mirrored nodes in combinations of signs; the four places (r,
// s), (r, span + s), (span + r, s), (span + r, span + s) belong together. This changes four such values into those of
// the nodes, and back. A middle row or column is its own mirror and stays.
static float4 fold_four(float4 x, int middle_row, int middle_column)
{
    float4 y = middle_column ? x : (float4)(x.x + x.y, x.x - x.y, x.z + x.w, x.z - x.w) * ROOT_HALF;
    return middle_row ? y : (float4)(y.x + y.z, y.y + y.w, y.x - y.z, y.y - y.w) * ROOT_HALF;
}

// Walks the quarter of folded places: row r, column s, with the nodes r, r2 and s, s2 that they stand for.
#define EACH_FOLDED(r, s, m)                                          \
    for (int r = ME / COLUMNS; 2 * r < (m); r += ROWS)                \
        for (int s = ME % COLUMNS; 2 * s < (m); s += COLUMNS)

// Reads nodes (i, j) of the inside of a grid, adding `more` where it is there, into a folded array.
static void fold_nodes(global const float *nodes, global const float *more, int side, int span, global float *folded)
{
    int m = side - 2, order = 2 * span;
    SYNC;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order)
            STORE((FLOAT)(0.0f), folded + i * order + j);
    SYNC;
    EACH_FOLDED(r, s, m) {
        int r2 = m - 1 - r, s2 = m - 1 - s;
        int p00 = (r + 1) * side + s + 1, p01 = (r + 1) * side + s2 + 1;
        int p10 = (r2 + 1) * side + s + 1, p11 = (r2 + 1) * side + s2 + 1;
        float4 x = 0;
        if (nodes) x = (float4)(nodes[p00], nodes[p01], nodes[p10], nodes[p11]);
        if (more) x += (float4)(more[p00], more[p01], more[p10], more[p11]);
        x = fold_four(x, r == r2, s == s2);
        folded[r * order + s] = x.x;
        if (s != s2) folded[r * order + span + s] = x.y;
        if (r != r2) folded[(span + r) * order + s] = x.z;
        if (r != r2 && s != s2) folded[(span + r) * order + span + s] = x.w;
    }
    SYNC;
}

// Writes a folded array to the nodes of the inside of a grid.
static void unfold_nodes(global const float *folded, int side, int span, global float *nodes)
{
    int m = side - 2, order = 2 * span;
    SYNC;
    EACH_FOLDED(r, s, m) {
        int r2 = m - 1 - r, s2 = m - 1 - s;
        global const float *a = folded + r * order + s, *b = a + span, *c = a + span * order, *d = c + span;
        float4 x = fold_four((float4)(*a, *b, *c, *d), r == r2, s == s2);
        nodes[(r + 1) * side + s + 1] = x.x;
        if (s != s2) nodes[(r + 1) * side + s2 + 1] = x.y;
        if (r != r2) nodes[(r2 + 1) * side + s + 1] = x.z;
        if (r != r2 && s != s2) nodes[(r2 + 1) * side + s2 + 1] = x.w;
    }
    SYNC;
}

// Puts the values of the nodes to where fold_nodes() puts their combinations: node (r, s) at (r, s), its mirrors at (r, span + s),
// (span + r, s) and (span + r, span + s).
static void place_nodes(global const float *nodes, int side, int span, global float *placed)
{
    int m = side - 2, order = 2 * span;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order)
            STORE((FLOAT)(0.0f), placed + i * order + j);
    SYNC;
    EACH_FOLDED(r, s, m) {
        int r2 = m - 1 - r, s2 = m - 1 - s;
        placed[r * order + s] = nodes[(r + 1) * side + s + 1];
        placed[r * order + span + s] = nodes[(r + 1) * side + s2 + 1];
        placed[(span + r) * order + s] = nodes[(r2 + 1) * side + s + 1];
        placed[(span + r) * order + span + s] = nodes[(r2 + 1) * side + s2 + 1];
    }
    SYNC;
}

// Multiplies a folded array by placed values. A middle row or column needs no care: both of its halves carry the same factor,
// so its combination keeps its place.
static void scale_folded(global float *folded, global const float *placed, int span)
{
    int order = 2 * span;
    SYNC;
    EACH_ROW(r, span, 1)
        EACH_COLUMN(s, span) {
            int p00 = r * order + s, p01 = p00 + span, p10 = p00 + span * order, p11 = p10 + span;
            FLOAT a = LOAD(folded + p00), b = LOAD(folded + p01), c = LOAD(folded + p10), d = LOAD(folded + p11);
            FLOAT sum_u = a + c, sum_v = b + d, gap_u = a - c, gap_v = b - d;
            FLOAT x00 = (sum_u + sum_v) * LOAD(placed + p00), x01 = (sum_u - sum_v) * LOAD(placed + p01);
            FLOAT x10 = (gap_u + gap_v) * LOAD(placed + p10), x11 = (gap_u - gap_v) * LOAD(placed + p11);
            STORE(0.25f * ((x00 + x01) + (x10 + x11)), folded + p00);
            STORE(0.25f * ((x00 - x01) + (x10 - x11)), folded + p01);
            STORE(0.25f * ((x00 + x01) - (x10 + x11)), folded + p10);
            STORE(0.25f * ((x00 - x01) - (x10 - x11)), folded + p11);
        }
    SYNC;
}

// What a work-group knows of its slot.
typedef struct Slot {
    PatchRecord record;
    global const float *table;
    global float *x, *v, *work;
    global const float *load, *force, *touch, *kappa; // NULL where there is none of the last three
    global const int *pins;                           // two a pin: the unknown's row and column
    global const float *targets, *inverse;
    global float *pushes; // PATCH_MAX_PINS
    local float *sums;
    int side, span;
} Slot;

static global float *work_of(const Slot *slot, int which) { return slot->work + which * 4 * slot->span * slot->span; }

// Modes of what is at the nodes, from a folded array in WORK_S, added to `out`; uses WORK_T.
static void add_modes(const Slot *slot, global float *out)
{
    multiply_left(slot->table + TABLE_QT(slot->span), work_of(slot, WORK_S), work_of(slot, WORK_T), slot->span);
    multiply_right(work_of(slot, WORK_T), slot->table + TABLE_Q(slot->span), out, slot->span, 1.0f, 1);
}

// out += κ y, both over modes; uses WORK_S and WORK_T.
static void add_kappa(const Slot *slot, global const float *y, global float *out)
{
    multiply_left(slot->table + TABLE_Q(slot->span), y, work_of(slot, WORK_T), slot->span);
    multiply_right(work_of(slot, WORK_T), slot->table + TABLE_QT(slot->span), work_of(slot, WORK_S), slot->span, 1.0f, 0);
    scale_folded(work_of(slot, WORK_S), work_of(slot, WORK_KAPPA), slot->span);
    add_modes(slot, out);
}

// out = (L + μ) y, κ left out; uses WORK_T.
static void apply(const Slot *slot, float mu, global const float *y, global float *out)
{
    int span = slot->span, order = 2 * span;
    global const float *lambda = slot->table + TABLE_LAMBDA(span);
    SYNC;
    EACH_ROW(i, order, 1) {
        float along_u = fma(slot->record.b, lambda[i], mu);
        EACH_COLUMN(j, order) {
            FLOAT both = fma((FLOAT)(slot->record.d), LOAD(lambda + j), (FLOAT)(along_u));
            STORE(both * LOAD(y + i * order + j), out + i * order + j);
        }
    }
    if (slot->record.c == 0) {
        SYNC;
        return;
    }
    multiply_left(slot->table + TABLE_B(span), y, work_of(slot, WORK_T), span);
    multiply_right(work_of(slot, WORK_T), slot->table + TABLE_B(span), out, span, slot->record.c, 1);
}

static float dot_of(const Slot *slot, global const float *x, global const float *y)
{
    int order = 2 * slot->span;
    FLOAT sum = 0;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order)
            sum = fma(LOAD(x + i * order + j), LOAD(y + i * order + j), sum);
    return sum_group(sum, slot->sums);
}

// The inverse diagonal into WORK_D.
static void make_diagonal(const Slot *slot)
{
    int span = slot->span, order = 2 * span;
    global const float *lambda = slot->table + TABLE_LAMBDA(span), *beta = slot->table + TABLE_BETA(span);
    EACH_ROW(i, order, 1) {
        float along_u = fma(slot->record.b, lambda[i], slot->record.mu), mixed = slot->record.c * beta[i];
        EACH_COLUMN(j, order) {
            FLOAT sum = fma((FLOAT)(slot->record.d), LOAD(lambda + j), fma((FLOAT)(mixed), LOAD(beta + j), (FLOAT)(along_u)));
            STORE((FLOAT)(1.0f) / sum, work_of(slot, WORK_D) + i * order + j);
        }
    }
    SYNC;
}

// The value of an array over modes at a pin.
static float at_pin(const Slot *slot, int pin, global const float *y)
{
    int span = slot->span, order = 2 * span;
    global const float *rows = slot->table + TABLE_ROWS(span);
    global const float *u = rows + slot->pins[2 * pin] * order, *v = rows + slot->pins[2 * pin + 1] * order;
    FLOAT sum = 0;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order)
            sum = fma(LOAD(y + i * order + j) * u[i], LOAD(v + j), sum);
    return sum_group(sum, slot->sums);
}

// Finds pushes at the pins so that D(r − Σ push) has the value `wanted` there (0 if NULL), and takes them out of r; z =
// D r. The inverse of the pins' own matrix is in float, so this is done twice.
static void hold_pins(const Slot *slot, global const float *wanted, global float *r, global float *z)
{
    int span = slot->span, order = 2 * span, count = slot->record.pins;
    global const float *rows = slot->table + TABLE_ROWS(span), *diagonal = work_of(slot, WORK_D);
    global float *values = slot->pushes + PATCH_MAX_PINS;
    for (int turn = 0; turn <= 2; turn++) {
        SYNC;
        EACH_ROW(i, order, 1)
            EACH_COLUMN(j, order)
                STORE(LOAD(diagonal + i * order + j) * LOAD(r + i * order + j), z + i * order + j);
        if (count == 0 || turn == 2) break;
        SYNC;
        for (int k = 0; k < count; k++) {
            float value = at_pin(slot, k, z) - (wanted ? wanted[k] : 0.0f);
            if (ME == 0) values[k] = value;
        }
        SYNC;
        for (int k = ME; k < count; k += GROUP) {
            float push = 0;
            for (int l = 0; l < count; l++) push = fma(slot->inverse[k * count + l], values[l], push);
            slot->pushes[k] = push;
        }
        SYNC;
        for (int k = 0; k < count; k++) {
            global const float *u = rows + slot->pins[2 * k] * order, *v = rows + slot->pins[2 * k + 1] * order;
            float push = slot->pushes[k];
            EACH_ROW(i, order, 1)
                EACH_COLUMN(j, order)
                    STORE(fma((FLOAT)(-push * u[i]), LOAD(v + j), LOAD(r + i * order + j)), r + i * order + j);
        }
    }
    SYNC;
}

// The right side of the increment into WORK_R, and x + θ dt V into WORK_AHEAD. Returns how large its terms are in the
// norm of the preconditioner, of which rounding leaves 1e-7.
static float right_side(const Slot *slot, int mode)
{
    int span = slot->span, order = 2 * span;
    global const float *sum_u = slot->table + TABLE_SUM(span);
    global float *ahead = work_of(slot, WORK_AHEAD), *r = work_of(slot, WORK_R);
    global float *a = work_of(slot, WORK_A), *e = work_of(slot, WORK_E);
    float forward = slot->record.theta * slot->record.dt;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order) {
            int at = i * order + j;
            STORE(fma((FLOAT)(forward), LOAD(slot->v + at), LOAD(slot->x + at)), ahead + at);
        }
    apply(slot, 0.0f, ahead, a);
    FLOAT size = 0;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order) {
            int at = i * order + j;
            FLOAT pushed = fma((FLOAT)(slot->record.force * sum_u[i]), LOAD(sum_u + j), LOAD(slot->load + at));
            FLOAT damped = slot->record.eta * LOAD(slot->v + at), bent = LOAD(a + at);
            STORE(pushed - damped - bent, r + at);
            size = fma(LOAD(work_of(slot, WORK_D) + at), pushed * pushed + damped * damped + bent * bent, size);
        }
    if (slot->force || slot->touch) {
        fold_nodes(slot->force, slot->touch, slot->side, span, work_of(slot, WORK_S));
        add_modes(slot, r);
    }
    if (slot->kappa) {
        // The contact's answer is at x, which is θ dt V behind, or at the trial, which is its increment ahead.
        EACH_ROW(i, order, 1)
            EACH_COLUMN(j, order) {
                int at = i * order + j;
                STORE(mode == STEP_AFTER ? LOAD(e + at) : LOAD(slot->v + at) * -forward, work_of(slot, WORK_P) + at);
            }
        add_kappa(slot, work_of(slot, WORK_P), r);
    }
    return sum_group(size, slot->sums);
}

// (L + μ + κ) e = r by conjugate gradients. Returns the status.
static int solve(const Slot *slot, float floor2, PatchResult *result)
{
    int order = 2 * slot->span;
    global float *e = work_of(slot, WORK_E), *r = work_of(slot, WORK_R);
    global float *p = work_of(slot, WORK_P), *a = work_of(slot, WORK_A);
    float wanted2 = slot->record.tolerance * slot->record.tolerance;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order)
            STORE((FLOAT)(0.0f), e + i * order + j);
    if (slot->record.pins) {
        // The increment that has the pins' values and no more; r then lacks what that pushes.
        EACH_ROW(i, order, 1)
            EACH_COLUMN(j, order)
                STORE((FLOAT)(0.0f), p + i * order + j);
        hold_pins(slot, slot->pushes + 2 * PATCH_MAX_PINS, p, e);
        apply(slot, slot->record.mu, e, a);
        if (slot->kappa) add_kappa(slot, e, a);
        EACH_ROW(i, order, 1)
            EACH_COLUMN(j, order)
                STORE(LOAD(r + i * order + j) - LOAD(a + i * order + j), r + i * order + j);
    }
    float first = 0, last = 0;
    int turn = 0;
    for (;; turn++) {
        global float *z = a; // K p is used up when z is made
        hold_pins(slot, 0, r, z);
        float rz = dot_of(slot, r, z);
        if (rz < 0) return SLOT_INDEFINITE;
        if (!(rz < INFINITY)) return SLOT_DIVERGED;
        if (turn == 0) first = rz;
        if (rz <= wanted2 * first || rz <= floor2 || turn == slot->record.iterations) {
            if (rz > floor2) result->residual = fmax(result->residual, sqrt(rz / first));
            break;
        }
        float beta = turn ? rz / last : 0.0f;
        EACH_ROW(i, order, 1)
            EACH_COLUMN(j, order) {
                int at = i * order + j;
                STORE(turn ? fma((FLOAT)(beta), LOAD(p + at), LOAD(z + at)) : LOAD(z + at), p + at);
            }
        apply(slot, slot->record.mu, p, a);
        if (slot->kappa) add_kappa(slot, p, a);
        float energy = dot_of(slot, p, a);
        if (!(energy > 0)) return SLOT_INDEFINITE;
        float length = rz / energy;
        EACH_ROW(i, order, 1)
            EACH_COLUMN(j, order) {
                int at = i * order + j;
                STORE(fma((FLOAT)(length), LOAD(p + at), LOAD(e + at)), e + at);
                STORE(fma((FLOAT)(-length), LOAD(a + at), LOAD(r + at)), r + at);
            }
        last = rz;
    }
    if (turn > result->iterations) result->iterations = turn;
    return SLOT_FINE;
}

// Takes the step if it leads to somewhere.
static int commit(const Slot *slot, PatchResult *result)
{
    int order = 2 * slot->span, m = slot->side - 2;
    global const float *e = work_of(slot, WORK_E);
    float dt = slot->record.dt, theta = slot->record.theta, gain = 1.0f / (theta * theta * dt);
    FLOAT sum = 0;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order) {
            int at = i * order + j;
            FLOAT v = LOAD(slot->v + at), faster = fma((FLOAT)(gain), LOAD(e + at), v);
            FLOAT x = fma((FLOAT)(dt), fma((FLOAT)(theta), faster, (1.0f - theta) * v), LOAD(slot->x + at));
            STORE(x, work_of(slot, WORK_S) + at);
            STORE(faster, work_of(slot, WORK_T) + at);
            sum = fma(x, x, sum);
        }
    float size = sqrt(sum_group(sum, slot->sums)) / m;
    result->size = size;
    if (!(size <= slot->record.limit)) return SLOT_DIVERGED;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order) {
            int at = i * order + j;
            STORE(LOAD(work_of(slot, WORK_S) + at), slot->x + at);
            STORE(LOAD(work_of(slot, WORK_T) + at), slot->v + at);
        }
    SYNC;
    return SLOT_FINE;
}

// Where the pins want the increment: θ(to − x − dt V), from the patch's state.
static void want_pins(const Slot *slot)
{
    int order = 2 * slot->span;
    global float *p = work_of(slot, WORK_P), *wanted = slot->pushes + 2 * PATCH_MAX_PINS;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order) {
            int at = i * order + j;
            STORE(fma((FLOAT)(slot->record.dt), LOAD(slot->v + at), LOAD(slot->x + at)), p + at);
        }
    SYNC;
    for (int k = 0; k < slot->record.pins; k++) {
        float value = slot->record.theta * (slot->targets[k] - at_pin(slot, k, p));
        if (ME == 0) wanted[k] = value;
    }
    SYNC;
}

// Whether any of `count` values is not zero.
static int is_any(global const float *values, int count, local float *sums)
{
    FLOAT sum = 0;
    float rest = 0;
    for (int k = ME * WIDTH; k + WIDTH <= count; k += GROUP * WIDTH) sum += fabs(LOAD_ANY(values + k));
    for (int k = count / WIDTH * WIDTH; k < count; k++) rest += fabs(values[k]);
    return sum_group(sum, sums) + rest != 0;
}

// One work-group a slot. `force` and `touch` are side² floats a slot, `kappa` side² a patch; `pushes` is 3
// PATCH_MAX_PINS a slot.
#if GROUP > 1
__attribute__((reqd_work_group_size(GROUP, 1, 1)))
#endif
kernel void patch_step(global const PatchRecord *records, global PatchResult *results, global const float *table,
                       global float *state, global float *work, global const float *load, global const float *force,
                       global const float *touch, global const float *kappa, global const int *pins,
                       global const float *targets, global const float *inverses, global float *pushes, int side, int span,
                       int pin_room, int mode)
{
#if GROUP > 1
    local float sums[GROUP];
#else
    local float *sums = 0;
#endif
    int number = (int)get_group_id(0), patch = number / 3, square = 4 * span * span, nodes = side * side;
    Slot slot;
    slot.record = records[number];
    PatchResult result = results[number];
    if (result.epoch != slot.record.epoch) result = (PatchResult){.epoch = slot.record.epoch};
    slot.table = table;
    slot.x = state + (size_t)number * STATE_ARRAYS * square;
    slot.v = slot.x + square;
    slot.work = work + (size_t)number * WORK_ARRAYS * square;
    slot.load = load + (size_t)number * square;
    slot.force = slot.record.flags & PATCH_HAS_FORCE ? force + (size_t)number * nodes : 0;
    slot.touch = 0;
    slot.kappa = 0;
    slot.pins = pins + 2 * patch * pin_room;
    slot.targets = targets + number * pin_room;
    slot.inverse = inverses + (size_t)number * pin_room * pin_room;
    slot.pushes = pushes + 3 * number * PATCH_MAX_PINS;
    slot.sums = sums;
    slot.side = side;
    slot.span = span;
    if (slot.record.flags & PATCH_HAS_TOUCH) {
        global const float *all = touch + (size_t)patch * 3 * nodes, *stiff = kappa + (size_t)patch * nodes;
        if (is_any(stiff, nodes, sums) || is_any(all, 3 * nodes, sums)) {
            slot.touch = all + (number - 3 * patch) * nodes;
            slot.kappa = stiff;
        }
    }
    result.iterations = 0;
    result.residual = 0;
    int steps = mode == STEP_COMMIT ? slot.record.steps : min(slot.record.steps, 1);
    if (steps) make_diagonal(&slot);
    if (steps && slot.kappa) place_nodes(slot.kappa, side, span, work_of(&slot, WORK_KAPPA));
    for (int k = 0; k < steps && result.status == SLOT_FINE; k++) {
        if (slot.record.pins) want_pins(&slot);
        float size = right_side(&slot, mode);
        int status = solve(&slot, size * 1e-14f, &result);
        if (mode == STEP_TRIAL) continue; // what is wrong with it shows in the step itself
        if (status == SLOT_FINE) status = commit(&slot, &result);
        result.status = status;
        if (status == SLOT_FINE) result.steps++;
    }
    if (ME == 0) results[number] = result;
}

// Writes places, those of the last trial, or velocities to nodes: side² floats a slot. `edges` holds the positions
// along the four edges, 4 side floats a slot.
#if GROUP > 1
__attribute__((reqd_work_group_size(GROUP, 1, 1)))
#endif
kernel void patch_nodes(global const PatchRecord *records, global const float *table, global const float *state,
                        global float *work, global const float *edges, global float *nodes, int side, int span, int what)
{
    int number = (int)get_group_id(0), square = 4 * span * span, order = 2 * span;
    global const float *x = state + (size_t)number * STATE_ARRAYS * square, *v = x + square;
    global float *mine = work + (size_t)number * WORK_ARRAYS * square, *out = nodes + (size_t)number * side * side;
    global float *s = mine + WORK_S * square, *t = mine + WORK_T * square;
    global const float *e = mine + WORK_E * square;
    float forward = records[number].theta * records[number].dt;
    EACH_ROW(i, order, 1)
        EACH_COLUMN(j, order) {
            int at = i * order + j;
            FLOAT shown = what == SHOW_VELOCITIES ? LOAD(v + at) : LOAD(x + at);
            if (what == SHOW_TRIAL) shown = fma((FLOAT)(forward), LOAD(v + at), shown) + LOAD(e + at);
            STORE(shown, s + at);
        }
    multiply_left(table + TABLE_Q(span), s, t, span);
    multiply_right(t, table + TABLE_QT(span), s, span, 1.0f, 0);
    unfold_nodes(s, side, span, out);
    edges += (size_t)number * 4 * side;
    for (int k = ME; k < side; k += GROUP) {
        float moving = what == SHOW_VELOCITIES ? 0.0f : 1.0f;
        if (k > 0 && k < side - 1) {
            out[k * side] = moving * edges[2 * side + k];
            out[k * side + side - 1] = moving * edges[3 * side + k];
        }
        out[k] = moving * edges[k];
        out[(side - 1) * side + k] = moving * edges[side + k];
    }
}

// The law of runtime/patch_contact.h: solids push nodes that are inside. A work-item does one line of nodes of one
// patch.
kernel void patch_contact(global const PatchSolidRecord *solids, int count, global const float *nodes, global float *touch,
                          global float *kappa, int side)
{
    int line = (int)get_global_id(0), patch = line / side, all = side * side;
    size_t start = (size_t)(line % side) * side;
    global const float *x = nodes + (size_t)patch * 3 * all + start, *y = x + all, *z = y + all;
    global float *fx = touch + (size_t)patch * 3 * all + start, *fy = fx + all, *fz = fy + all;
    global float *stiffness = kappa + (size_t)patch * all + start;
    for (int k = 0; k < side; k++) fx[k] = fy[k] = fz[k] = stiffness[k] = 0;
    for (int s = 0; s < count; s++) {
        if (solids[s].patch != patch) continue;
        global const float *a = solids[s].quadric;
        for (int k = 0; k < side; k++) {
            float f = (a[0] * x[k] + a[3] * y[k] + a[6]) * x[k] + (a[1] * y[k] + a[5] * z[k] + a[7]) * y[k] +
                      (a[2] * z[k] + a[4] * x[k] + a[8]) * z[k] + a[9];
            float gx = 2 * a[0] * x[k] + a[3] * y[k] + a[4] * z[k] + a[6];
            float gy = 2 * a[1] * y[k] + a[3] * x[k] + a[5] * z[k] + a[7];
            float gz = 2 * a[2] * z[k] + a[4] * x[k] + a[5] * y[k] + a[8];
            float length = sqrt(gx * gx + gy * gy + gz * gz);
            if (!(f > 0) || !(length > 0)) continue;
            float nx = gx / length, ny = gy / length, nz = gz / length;
            float bend = (a[0] * nx + a[3] * ny) * nx + (a[1] * ny + a[5] * nz) * ny + (a[2] * nz + a[4] * nx) * nz;
            float push = solids[s].stiffness * 2 * f / (length + sqrt(fmax(0.0f, length * length - 4 * bend * f)));
            fx[k] -= push * nx;
            fy[k] -= push * ny;
            fz[k] -= push * nz;
            stiffness[k] += solids[s].stiffness;
        }
    }
}
