#include "runtime/fold_field.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/tape.h"
#include "runtime/view.h"

#define MARGIN 4e-6 // what floats may add to the size of a box

_Static_assert(sizeof(FieldRecord) == sizeof(QuadricRecord), "a field's record stands in a quadric's place");

bool field_tables_init(FieldTables *tables, const Plan *plan)
{
    *tables = (FieldTables){.plan = plan};
    if (!plan->tape_count) return true;
    tables->boxes = calloc(plan->tape_count, sizeof *tables->boxes);
    tables->baked = calloc(plan->tape_step_count, sizeof *tables->baked);
    tables->before = calloc(plan->tape_step_count, sizeof *tables->before);
    for (uint32_t k = 0; k < plan->tape_count; k++) {
        if (plan->tapes[k].count > tables->longest) tables->longest = plan->tapes[k].count;
    }
    return tables->boxes && tables->baked && tables->before;
}

void field_tables_release(FieldTables *tables)
{
    free(tables->boxes);
    free(tables->baked);
    free(tables->before);
    *tables = (FieldTables){0};
}

void field_tables_frame(FieldTables *tables, const double *values)
{
    const Plan *plan = tables->plan;
    bool changed = !tables->version;
    for (uint32_t k = 0; k < plan->tape_count; k++) {
        const PlanTape *tape = &plan->tapes[k];
        TapeStep *baked = tables->baked + tape->first, *before = tables->before + tape->first;
        size_t size = tape->count * sizeof *baked;
        tape_bake(plan->tape_steps + tape->first, tape->count, values, baked);
        if (tables->version && !memcmp(baked, before, size)) continue;
        memcpy(before, baked, size);
        tape_bounds(plan, tape, values, tables->boxes[k].low, tables->boxes[k].high);
        changed = true;
    }
    if (changed) tables->version++;
}

// --- folding

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The place of a world point in the view: U, V and the depth s. Where it is not before the eye U and V are infinite.
static void see(const Projection *p, const double world[3], double seen[3])
{
    double way[3];
    for (int k = 0; k < 3; k++) way[k] = (world[k] - p->origin[k]) / p->unit;
    double s = dot3(way, p->axis[2]), scale = 1 + p->kappa * s;
    for (int k = 0; k < 2; k++) seen[k] = scale > 1e-9 ? dot3(way, p->axis[k]) / scale : INFINITY;
    seen[2] = s;
}

static void box_add(Box *box, int axis, double value)
{
    if (!isfinite(value)) {
        box->low[axis] = -INFINITY;
        box->high[axis] = INFINITY;
        return;
    }
    double margin = MARGIN * (1 + fabs(value));
    box->low[axis] = fmin(box->low[axis], value - margin);
    box->high[axis] = fmax(box->high[axis], value + margin);
}

// U, V, s of the corners of the field's box, as far as fields are looked for.
static void seen_box(const Box *local, const double inverse[12], const Projection *p, Box *box)
{
    double m[12];
    bool ok = matrix_inverse(inverse, m);
    *box = (Box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (int corner = 0; corner < 8; corner++) {
        double point[3], seen[3];
        for (int k = 0; k < 3; k++) {
            double end = corner >> k & 1 ? local->high[k] : local->low[k];
            point[k] = fmin(fmax(end, -TAPE_REACH), TAPE_REACH);
        }
        if (ok) matrix_point(m, point, point);
        see(p, point, seen);
        for (int axis = 0; axis < 3; axis++) box_add(box, axis, seen[axis]);
    }
    for (int k = 0; k < 3; k++) {
        if (isfinite(local->low[k]) && isfinite(local->high[k])) continue;
        for (int axis = 0; axis < 2; axis++) {
            box->low[axis] = -INFINITY;
            box->high[axis] = INFINITY;
        }
    }
}

// Between what the view begins with and where it ends.
static void cut_depth(const Projection *p, double *low, double *high)
{
    if (p->kappa > 0) {
        double eye = 1 / p->kappa;
        *low = fmax(*low, -eye * (1 - 1e-6));
        if (isfinite(p->limit)) *high = fmin(*high, p->limit / (1 - p->kappa * p->limit));
    } else if (isfinite(p->start)) {
        *low = fmax(*low, p->start);
    }
}

static double w_of(const Projection *p, double s)
{
    double scale = 1 + p->kappa * s;
    return scale > 0 ? s / scale : -INFINITY;
}

void fold_field(const FieldTables *tables, const double *values, const PlanLeaf *leaf, const Projection *p,
                FieldRecord *record, Box *box)
{
    const double *map = values + leaf->quadric;
    const PlanTape *tape = &tables->plan->tapes[leaf->begin];
    const Box *local = &tables->boxes[leaf->begin];
    if (record) memset(record, 0, sizeof *record);
    *box = (Box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    if (local->low[0] > local->high[0]) return;
    seen_box(local, map, p, box);
    double low = box->low[2], high = box->high[2];
    cut_depth(p, &low, &high);
    bool open = false;
    for (int k = 0; k < 3; k++) open |= !isfinite(local->low[k]) || !isfinite(local->high[k]);
    box->low[2] = open ? -INFINITY : w_of(p, box->low[2]);
    box->high[2] = open ? INFINITY : w_of(p, box->high[2]);
    if (!record || !(low < high)) return;
    double origin[3];
    matrix_point(map, p->origin, origin);
    for (int k = 0; k < 3; k++) {
        const double *row = map + 4 * k;
        record->u[k] = (float)(p->unit * dot3(row, p->axis[0]));
        record->v[k] = (float)(p->unit * dot3(row, p->axis[1]));
        record->w[k] = (float)(p->unit * dot3(row, p->axis[2]));
        record->one[k] = (float)origin[k];
    }
    record->s_low = (float)low;
    record->s_high = (float)high;
    record->first = tape->first;
    record->count = tape->count;
}

static double depth_of(const Projection *p, double w)
{
    double scale = 1 - p->kappa * w;
    if (p->kappa == 0) return w;
    if (w == -INFINITY) return -1 / p->kappa;
    return scale > 0 ? w / scale : INFINITY;
}

void limit_field(const Projection *p, const Box *limit, FieldRecord *record)
{
    double low = depth_of(p, limit->low[2]), high = depth_of(p, limit->high[2]);
    double margin = MARGIN * (1 + fmax(isfinite(low) ? fabs(low) : 0, isfinite(high) ? fabs(high) : 0));
    record->s_low = fmaxf(record->s_low, (float)(low - margin));
    record->s_high = fminf(record->s_high, (float)(high + margin));
    if (!(record->s_low < record->s_high)) record->count = 0;
}
