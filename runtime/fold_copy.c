#include "runtime/fold_copy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/bounds.h"
#include "compiler/eval.h"
#include "compiler/quadric.h"
#include "runtime/view.h"

// A matrix of a support whose determinant is less than this part of what its size would make has no end that is known.
#define SUPPORT_RANK 1e-9

// What floats add to where a part is, in parts of its size.
#define PART_MARGIN 1e-5

static const Box nowhere = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

bool cluster_table_init(ClusterTable *table, const Plan *plan, bool shares)
{
    *table = (ClusterTable){.plan = plan, .shares = shares && plan->copy_count};
    if (!table->shares) return true;
    table->first = calloc(plan->cluster_count + 1u, sizeof *table->first);
    table->first_leaf = calloc(plan->cluster_count + 1u, sizeof *table->first_leaf);
    table->boxes = calloc(plan->cluster_count + 1u, sizeof *table->boxes);
    if (!table->first || !table->first_leaf || !table->boxes) return false;
    for (uint32_t k = 0; k < plan->cluster_count; k++) {
        table->first[k] = table->part_count;
        table->part_count += plan->clusters[k].count;
    }
    for (uint32_t k = plan->leaf_count; k-- > 0;) {
        const PlanLeaf *leaf = &plan->leaves[k];
        for (uint32_t n = 0; leaf->kind == LEAF_FREEFORM && n < leaf->copy_count; n++)
            table->first_leaf[plan->copies[leaf->copies + n].cluster] = k;
    }
    table->parts = calloc(table->part_count + 1u, sizeof *table->parts);
    return table->parts != NULL;
}

void cluster_table_release(ClusterTable *table)
{
    free(table->parts);
    free(table->first);
    free(table->first_leaf);
    free(table->boxes);
    *table = (ClusterTable){0};
}

// --- a frame

// Where Q >= 0: its middle m, and E with (x - m)ᵀ E⁻¹ (x - m) <= 1 there.
static void part_extent(const double q[10], ClusterPart *part)
{
    double a = -q[0], b = -q[1], c = -q[2], d = -q[3] / 2, e = -q[4] / 2, f = -q[5] / 2; // -S: a d e, d b f, e f c
    double cofactors[6] = {b * c - f * f, a * c - e * e, a * b - d * d, e * f - d * c, d * f - e * b, d * e - a * f};
    double det = a * cofactors[0] + d * cofactors[3] + e * cofactors[4];
    double size = fmax(fmax(fabs(a), fabs(b)), fmax(fabs(c), fmax(fabs(d), fmax(fabs(e), fabs(f)))));
    part->extent[0] = INFINITY;
    if (!(a > 0 && cofactors[2] > 0 && det > SUPPORT_RANK * size * size * size)) return;
    const double *k = cofactors, g[3] = {q[6] / (2 * det), q[7] / (2 * det), q[8] / (2 * det)};
    double m[3] = {k[0] * g[0] + k[3] * g[1] + k[4] * g[2], k[3] * g[0] + k[1] * g[1] + k[5] * g[2],
                   k[4] * g[0] + k[5] * g[1] + k[2] * g[2]};
    double peak = quadric_at(q, m), grown = (1 + PART_MARGIN) * (1 + PART_MARGIN);
    if (!(peak > 0)) { // empty, but for rounding
        if (peak < 0) part->root = 0;
        return;
    }
    for (int i = 0; i < 3; i++) part->middle[i] = (float)m[i];
    for (int i = 0; i < 6; i++) part->extent[i] = (float)(grown * peak * k[i] / det);
}

static void join(Box *into, const Bounds *bounds)
{
    if (bounds_empty(bounds)) return;
    for (int k = 0; k < 3; k++) {
        into->low[k] = fmin(into->low[k], bounds->low[k]);
        into->high[k] = fmax(into->high[k], bounds->high[k]);
    }
}

// Whether a perturbation is strong is asked once for all copies, of the first: maps change the answer little.
static bool is_strong(const ClusterTable *table, const double *values, uint32_t index)
{
    static const Projection world = {.axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .unit = 1};
    const Plan *plan = table->plan;
    const PlanCluster *cluster = &plan->clusters[index];
    const PlanLeaf *leaf = &plan->leaves[table->first_leaf[index]];
    const PlanCopy *copy = &plan->copies[leaf->copies];
    while (copy->cluster != index) copy++;
    double q[10];
    if (!quadric_transform(values + leaf->quadric, values + copy->matrix, q)) return true;
    ScreenMap map;
    ScreenQuadric base, own;
    fold_map(&world, &map);
    fold_quadric(q, &map, &base);
    for (uint32_t k = cluster->begin; k < cluster->begin + cluster->count; k++) {
        const PlanPerturbation *p = &plan->perturbations[k];
        double strength = values[p->strength] * values[copy->strength];
        Box support;
        fold_quadric(values + p->quadric, &map, &own);
        fold_box(&own, &support);
        if (strength != 0 && fold_strong(&base, &own, strength, &support, 0)) return true;
    }
    return false;
}

void cluster_table_frame(ClusterTable *table, const double *values)
{
    const Plan *plan = table->plan;
    for (uint32_t c = 0; table->shares && c < plan->cluster_count; c++) {
        const PlanCluster *cluster = &plan->clusters[c];
        ClusterBox *box = &table->boxes[c];
        box->positive = box->negative = nowhere;
        for (uint32_t k = 0; k < cluster->count; k++) {
            const PlanPerturbation *p = &plan->perturbations[cluster->begin + k];
            ClusterPart *part = &table->parts[table->first[c] + k];
            double strength = values[p->strength];
            memcpy(part->q, values + p->quadric, sizeof part->q);
            part->root = (float)cbrt(strength);
            part_extent(part->q, part);
            Bounds support = bounds_of_quadric(part->q);
            if (strength != 0) join(strength > 0 ? &box->positive : &box->negative, &support);
        }
        box->strong = is_strong(table, values, c);
    }
}

// --- a view

bool copy_map(const double matrix[12], const ScreenMap *map, ScreenMap *own)
{
    double inverse[12];
    if (!matrix_inverse(matrix, inverse)) return false;
    for (int column = 0; column < 4; column++) {
        const double *from = map->column[column];
        double *to = own->column[column];
        for (int row = 0; row < 3; row++) {
            const double *r = inverse + 4 * row;
            to[row] = r[0] * from[0] + r[1] * from[1] + r[2] * from[2] + r[3] * from[3];
        }
        to[3] = from[3];
    }
    return true;
}

// (U, V, w) / W of places of the cluster.
static void find_rows(const Projection *p, const double m[12], double rows[12])
{
    for (int k = 0; k < 3; k++) {
        const double *axis = p->axis[k];
        for (int column = 0; column < 4; column++) {
            double sum = 0;
            for (int i = 0; i < 3; i++) sum += axis[i] * (m[4 * i + column] - (column == 3 ? p->origin[i] : 0));
            rows[4 * k + column] = sum / p->unit;
        }
    }
}

static void join_box(Box *into, const Box *box)
{
    for (int k = 0; k < 3 && box->low[0] <= box->high[0]; k++) {
        into->low[k] = fmin(into->low[k], box->low[k]);
        into->high[k] = fmax(into->high[k], box->high[k]);
    }
}

// Where a box of the cluster can be seen.
static Box box_seen(const Box *own, const double rows[12], double kappa)
{
    Box box = nowhere;
    if (own->low[0] > own->high[0]) return box;
    for (int k = 0; k < 3; k++) {
        const double *r = rows + 4 * k;
        double low = r[3], high = r[3], size = fabs(r[3]);
        for (int i = 0; i < 3; i++) {
            if (r[i] == 0) continue;
            low += r[i] > 0 ? r[i] * own->low[i] : r[i] * own->high[i];
            high += r[i] > 0 ? r[i] * own->high[i] : r[i] * own->low[i];
            size += fabs(r[i]) * fmax(fabs(own->low[i]), fabs(own->high[i]));
        }
        double margin = PART_MARGIN * (1 + size);
        box.low[k] = low - (isfinite(margin) ? margin : 0);
        box.high[k] = high + (isfinite(margin) ? margin : 0);
    }
    if (kappa == 0) return box;
    double near = 1 + kappa * box.low[2], far = 1 + kappa * box.high[2];
    if (!(near > 1e-3) || !isfinite(far))
        return (Box){{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
    for (int k = 0; k < 2; k++) {
        box.low[k] /= box.low[k] < 0 ? near : far;
        box.high[k] /= box.high[k] > 0 ? near : far;
    }
    box.low[2] /= near;
    box.high[2] /= far;
    return box;
}

void copy_record(const ClusterTable *table, const double *values, const PlanCopy *copy, double factor,
                 const Projection *projection, const ScreenMap *map, CopyRecord *record, Box *seen, Box *added,
                 unsigned *flags)
{
    const ClusterBox *box = &table->boxes[copy->cluster];
    const double *matrix = values + copy->matrix;
    double strength = values[copy->strength], rows[12];
    ScreenMap own;
    *seen = *added = nowhere;
    if (record) *record = (CopyRecord){0};
    if (strength == 0 || !copy_map(matrix, map, &own)) return;
    find_rows(projection, matrix, rows);
    Box positive = box_seen(&box->positive, rows, projection->kappa),
        negative = box_seen(&box->negative, rows, projection->kappa);
    *added = strength > 0 ? positive : negative;
    join_box(seen, &positive);
    join_box(seen, &negative);
    bool grows = added->low[0] <= added->high[0],
         taken = strength > 0 ? negative.low[0] <= negative.high[0] : positive.low[0] <= positive.high[0];
    *flags |= (grows ? RECORD_GROWS : 0) | (taken ? RECORD_SIGNED : 0) | (box->strong ? RECORD_STRONG : 0);
    if (!record) return;
    memcpy(record->columns, own.column, sizeof record->columns);
    for (int k = 0; k < 12; k++) record->rows[k] = (float)rows[k];
    record->root = (float)cbrt(strength * factor);
    record->first = table->first[copy->cluster];
    record->count = table->plan->clusters[copy->cluster].count;
}
