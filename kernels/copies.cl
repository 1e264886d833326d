// Copies of clusters (shared.h): when a list meets a copy's header, those of its parts whose boxes meet the list's rectangle are folded into the view, as
// runtime/fold.c does it on the host, in double. Their records stand in room that each tile has for as many as its list may be long: the record of the
// list's place k at k, its number there is that of the room's first record, plus k. These numbers are above all others.

typedef struct Copies {
    __global const PlanNode *nodes;
    __global QuadricRecord *records; // of the view
    __global const ClusterPart *parts;
    uint first; // number of the room's first record in the view
    float kappa;
} Copies;

#define IS_HEADER(copies, id) ((copies).nodes && (copies).nodes[id].count == NODE_COPIES)

// Where a part can be seen, as BOX_ARRAYS are.
static void part_box(const Copies *c, __global const CopyRecord *copy, __global const ClusterPart *part, float *box)
{
    float low[3], high[3];
    box[BOX_U_LOW] = box[BOX_V_LOW] = box[BOX_W_LOW] = -INFINITY;
    box[BOX_U_HIGH] = box[BOX_V_HIGH] = INFINITY;
    if (part->extent[0] == INFINITY) return;
    for (int k = 0; k < 3; k++) {
        __global const float *r = copy->rows + 4 * k, *e = part->extent;
        float middle = r[0] * part->middle[0] + r[1] * part->middle[1] + r[2] * part->middle[2] + r[3];
        float square = r[0] * (r[0] * e[0] + 2.0f * (r[1] * e[3] + r[2] * e[BOX_W_LOW])) + r[1] * (r[1] * e[1] + 2.0f * r[2] * e[5]) + r[2] * r[2] * e[2];
        float reach = sqrt(max(square, 0.0f));
        float size = fabs(r[0] * part->middle[0]) + fabs(r[1] * part->middle[1]) + fabs(r[2] * part->middle[2]) + fabs(r[3]) + reach;
        float margin = 8e-6f * (1.0f + size);
        low[k] = middle - reach - margin;
        high[k] = middle + reach + margin;
    }
    if (c->kappa > 0.0f) { // U = a / (1 + kappa c), and the least of it where the divisor is the least or the largest
        float near = 1.0f + c->kappa * low[2], far = 1.0f + c->kappa * high[2];
        if (!(near > 1e-3f)) return; // about the eye
        for (int k = 0; k < 2; k++) {
            low[k] = low[k] / (low[k] < 0.0f ? near : far);
            high[k] = high[k] / (high[k] > 0.0f ? near : far);
        }
        low[2] = low[2] / near;
        high[2] = high[2] / far;
    }
    box[BOX_U_LOW] = low[0], box[BOX_U_HIGH] = high[0], box[BOX_V_LOW] = low[1], box[BOX_V_HIGH] = high[1], box[BOX_W_LOW] = low[2];
}

// Whether the rectangle meets a part, and the box that lists have of it: cut from that of its header, `whole`, so that no list has it without the header.
static int part_meets(const Copies *c, __global const CopyRecord *copy, __global const ClusterPart *part, const float *whole, const Rect *rect, float *box)
{
    if (part->root == 0.0f) return 0;
    part_box(c, copy, part, box);
    for (int k = 0; k < BOX_ARRAYS; k++) box[k] = k == BOX_U_HIGH || k == BOX_V_HIGH ? min(box[k], whole[k]) : max(box[k], whole[k]);
    return box[BOX_U_LOW] <= rect->u_high && box[BOX_U_HIGH] >= rect->u_low && box[BOX_V_LOW] <= rect->v_high && box[BOX_V_HIGH] >= rect->v_low &&
           box[BOX_W_LOW] <= rect->w_high;
}

// How many parts of a copy a list for the rectangle gets.
static uint copy_count(const Copies *c, uint id, const float *whole, const Rect *rect)
{
    __global const CopyRecord *copy = (__global const CopyRecord *)(c->records + id + 1u);
    uint count = 0;
    float box[BOX_ARRAYS];
    for (uint k = 0; k < copy->count; k++) count += part_meets(c, copy, c->parts + copy->first + k, whole, rect, box) ? 1 : 0;
    return count;
}

// ScreenQuadric of runtime/fold.h.
typedef struct Folded {
    double uu, uv, uw, u1, vv, vw, v1, ww, w1, one;
} Folded;

static double4 form_column(__global const double *q, double4 x)
{
    return (double4)(q[0] * x.x + 0.5 * (q[3] * x.y + q[4] * x.z + q[6] * x.w), q[1] * x.y + 0.5 * (q[3] * x.x + q[5] * x.z + q[7] * x.w),
                     q[2] * x.z + 0.5 * (q[4] * x.x + q[5] * x.y + q[8] * x.w), q[9] * x.w + 0.5 * (q[6] * x.x + q[7] * x.y + q[8] * x.z));
}

static double dot4(double4 a, double4 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}

static Folded fold_part(__global const double *q, __global const double *columns)
{
    double4 u = vload4(0, columns), v = vload4(1, columns), w = vload4(2, columns), one = vload4(3, columns), t = form_column(q, u);
    Folded f;
    f.uu = dot4(u, t);
    t = form_column(q, v);
    f.uv = dot4(u, t);
    f.vv = dot4(v, t);
    t = form_column(q, w);
    f.uw = dot4(u, t);
    f.vw = dot4(v, t);
    f.ww = dot4(w, t);
    t = form_column(q, one);
    f.u1 = dot4(u, t);
    f.v1 = dot4(v, t);
    f.w1 = dot4(w, t);
    f.one = dot4(one, t);
    return f;
}

static double largest_of(const Folded *f)
{
    double a = fmax(fmax(fabs(f->uu), fabs(f->uv)), fmax(fabs(f->uw), fabs(f->u1)));
    double b = fmax(fmax(fabs(f->vv), fabs(f->vw)), fmax(fabs(f->v1), fabs(f->ww)));
    return fmax(fmax(a, b), fmax(fabs(f->w1), fabs(f->one)));
}

static void general_part(const Folded *f, double largest, double factor, QuadricRecord *r)
{
    double lead = f->ww, least = 1e-13 * largest;
    if (fabs(lead) < least) lead = lead > 0 ? least : -least;
    if (lead == 0) lead = -1e-30;
    r->flags |= RECORD_GENERAL;
    r->lead = (float)(factor * lead);
    r->t0 = (float)(-factor * f->w1);
    r->tu = (float)(-factor * f->uw);
    r->tv = (float)(-factor * f->vw);
    r->h0 = (float)(factor * f->one);
    r->d = (float)(factor * 2 * f->u1);
    r->e = (float)(factor * 2 * f->v1);
    r->a = (float)(factor * f->uu);
    r->b = (float)(factor * 2 * f->uv);
    r->c = (float)(factor * f->vv);
}

// fold_record() of runtime/fold.c, whose limits these are.
#define COPY_REACH 8.0
static QuadricRecord part_record(const Folded *f, double factor, float w_low)
{
    QuadricRecord r = {0};
    double largest = largest_of(f);
    r.w_low = w_low;
    if (f->ww > 0) r.flags |= RECORD_OUTSIDE;
    if (!(fabs(f->ww) > 1e-7 * largest)) {
        general_part(f, largest, factor, &r);
        return r;
    }
    double inverse = 1 / f->ww, tu = -f->uw * inverse, tv = -f->vw * inverse, t1 = -f->w1 * inverse;
    double a = tu * tu - f->uu * inverse, c = tv * tv - f->vv * inverse, half_b = tu * tv - f->uv * inverse;
    double d = 2 * (tu * t1 - f->u1 * inverse), e = 2 * (tv * t1 - f->v1 * inverse), h0 = t1 * t1 - f->one * inverse, t0 = t1;
    double det = a * c - half_b * half_b, size = fmax(fmax(fabs(a), fabs(c)), fabs(half_b)), uc = 0, vc = 0;
    int centred = fabs(det) > 1e-6 * size * size;
    if (centred) {
        uc = 0.5 * (half_b * e - c * d) / det;
        vc = 0.5 * (half_b * d - a * e) / det;
        double h = h0 + 0.5 * (d * uc + e * vc), t = t1 + tu * uc + tv * vc;
        centred = fabs(uc) < COPY_REACH && fabs(vc) < COPY_REACH && fabs(t) < COPY_REACH && fabs(h) < COPY_REACH * COPY_REACH && size < 1e18 &&
                  fabs(tu) < 1e18 && fabs(tv) < 1e18;
        if (centred) d = e = 0, h0 = h, t0 = t;
        else uc = vc = 0;
    }
    double wide = fmax(fabs(d) + fabs(e), fabs(a) + 2 * fabs(half_b) + fabs(c));
    int small = fabs(t0) < COPY_REACH && fabs(h0) < COPY_REACH * COPY_REACH && wide < 2 * COPY_REACH * COPY_REACH && fabs(tu) < COPY_REACH && fabs(tv) < COPY_REACH;
    if (!centred && !small) {
        general_part(f, largest, factor, &r);
        return r;
    }
    if (centred) r.flags |= RECORD_CENTRED;
    r.uc = (float)uc;
    r.vc = (float)vc;
    r.h0 = (float)h0;
    r.a = (float)a;
    r.b = (float)(2 * half_b);
    r.c = (float)c;
    r.d = (float)d;
    r.e = (float)e;
    r.t0 = (float)t0;
    r.tu = (float)tu;
    r.tv = (float)tv;
    r.lead = (float)(factor * f->ww);
    return r;
}

// Adds the parts of a copy that the rectangle meets to a list, at its place `at`, with their boxes in arrays of `capacity` floats unless these are NULL.
// Returns the next place, which may be beyond the capacity.
static NOINLINE uint copy_append(const Copies *c, uint id, const float *whole, const Rect *rect, __global uint *ids, __global float *boxes, uint capacity, uint at)
{
    __global const CopyRecord *copy = (__global const CopyRecord *)(c->records + id + 1u);
    float box[BOX_ARRAYS];
    for (uint k = 0; k < copy->count; k++) {
        __global const ClusterPart *part = c->parts + copy->first + k;
        if (!part_meets(c, copy, part, whole, rect, box)) continue;
        if (at < capacity) {
            Folded folded = fold_part(part->q, copy->columns);
            c->records[c->first + at] = part_record(&folded, (double)part->root * copy->root, box[BOX_W_LOW]);
            ids[at] = c->first + at;
            for (uint array = 0; boxes && array < BOX_ARRAYS; array++) boxes[array * capacity + at] = box[array];
        }
        at++;
    }
    return at;
}
