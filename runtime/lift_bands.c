#include "runtime/lift_bands.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/quadric.h"
#include "runtime/fold_patch.h"

enum {
    PERTURBATIONS = 32, // of a leaf, up to which its cells are bounded
    SLICES = 24,        // between the caps
    BLOCK = 4,          // cells a side
    HALVINGS = 3,       // of the slices at both ends of a cell's band
};

// The quadrics of a leaf in the coordinates of a lift's frame: the base, then its perturbations.
typedef struct FramedLeaf {
    double quadrics[1 + PERTURBATIONS][10], strengths[1 + PERTURBATIONS];
    uint32_t count;
    double low, high; // what other lifts of the leaf add
    bool known;       // few enough, and finite
} FramedLeaf;

// What is added to a leaf by a cell, or at most by those of a block.
typedef struct Added {
    double least, greatest;
} Added;

bool lift_bands_init(LiftBands *bands, const Plan *plan)
{
    *bands = (LiftBands){.count = plan->lift_count};
    bands->of = calloc(plan->lift_count + 1u, sizeof *bands->of);
    bands->known = calloc(plan->lift_count + 1u, sizeof *bands->known);
    bool ok = bands->of && bands->known;
    for (uint32_t k = 0; ok && k < plan->lift_count; k++) {
        size_t side = plan->patches[plan->lifts[k].patch].nodes - 1;
        bands->of[k] = calloc(side * side + 1, sizeof **bands->of);
        ok = bands->of[k] != NULL;
    }
    if (!ok) lift_bands_release(bands);
    return ok;
}

void lift_bands_release(LiftBands *bands)
{
    for (uint32_t k = 0; bands->of && k < bands->count; k++) free(bands->of[k]);
    free(bands->of);
    free(bands->known);
    *bands = (LiftBands){0};
}

void lift_bands_forget(LiftBands *bands)
{
    for (uint32_t k = 0; k < bands->count; k++) bands->known[k] = false;
}

// Bounds of a quadric's values over a box about `at`.
static void quadric_range(const double q[10], const double at[3], const double half[3], double *low, double *high)
{
    double x = at[0], y = at[1], z = at[2];
    double value = quadric_at(q, at), spread = 0;
    double gradient[3] = {2 * q[0] * x + q[3] * y + q[4] * z + q[6], 2 * q[1] * y + q[3] * x + q[5] * z + q[7],
                          2 * q[2] * z + q[4] * x + q[5] * y + q[8]};
    for (int k = 0; k < 3; k++) spread += fabs(gradient[k]) * half[k] + fabs(q[k]) * half[k] * half[k];
    spread += fabs(q[3]) * half[0] * half[1] + fabs(q[4]) * half[0] * half[2] + fabs(q[5]) * half[1] * half[2];
    spread += 1e-9 * (fabs(value) + spread);
    *low = value - spread;
    *high = value + spread;
}

static void framed_leaf(const Plan *plan, const double *values, const PlanLeaf *leaf, uint32_t lift,
                        const LiftPlace *place, FramedLeaf *framed)
{
    framed->count = 1 + leaf->count;
    framed->low = framed->high = 0;
    framed->known =
        leaf->count <= PERTURBATIONS && quadric_transform(values + leaf->quadric, place->frame, framed->quadrics[0]);
    for (uint32_t k = 0; framed->known && k < leaf->count; k++) {
        const PlanPerturbation *p = &plan->perturbations[leaf->begin + k];
        framed->strengths[1 + k] = values[p->strength];
        framed->known = quadric_transform(values + p->quadric, place->frame, framed->quadrics[1 + k]);
    }
    for (uint32_t k = leaf->lifts; k < leaf->lifts + leaf->lift_count; k++) {
        const PlanLift *other = &plan->lifts[k];
        const double *box = values + plan->patches[other->patch].box;
        double a = values[other->strength] * box[2], b = values[other->strength] * box[5];
        if (k == lift) continue;
        framed->low += fmin(0, fmin(a, b));
        framed->high += fmax(0, fmax(a, b));
    }
}

static double cube_of(double q)
{
    return q > 0 ? q * q * q : 0;
}

// Whether F may have either sign in a box of the frame, with what is added and without.
static bool matters(const FramedLeaf *leaf, const double at[3], const double half[3], Added added)
{
    double low, high;
    quadric_range(leaf->quadrics[0], at, half, &low, &high);
    for (uint32_t k = 1; k < leaf->count; k++) {
        double from, to;
        quadric_range(leaf->quadrics[k], at, half, &from, &to);
        if (to <= 0) continue;
        double a = leaf->strengths[k] * cube_of(from), b = leaf->strengths[k] * cube_of(to);
        low += fmin(a, b);
        high += fmax(a, b);
    }
    return !(high + leaf->high < fmin(0, -added.greatest)) && !(low + leaf->low > fmax(0, -added.least));
}

// A column of cells [i, i + size) × [j, j + size).
typedef struct Column {
    const FramedLeaf *leaf;
    double at[2], half;
    Added added;
} Column;

static bool column_matters(const Column *column, double low, double high)
{
    return matters(column->leaf, (const double[3]){column->at[0], column->at[1], (low + high) / 2},
                   (const double[3]){column->half, column->half, (high - low) / 2}, column->added);
}

// Narrows a band, in `slices` parts, to those in which the column matters.
static LiftBand narrowed(const Column *column, LiftBand band, int slices)
{
    double thick = (band.high - band.low) / slices;
    int first = 0, last = slices;
    while (first < last && !column_matters(column, band.low + first * thick, band.low + (first + 1) * thick)) first++;
    while (last > first && !column_matters(column, band.low + (last - 1) * thick, band.low + last * thick)) last--;
    if (first == last) return (LiftBand){INFINITY, -INFINITY};
    return (LiftBand){band.low + first * thick, last == slices ? band.high : band.low + last * thick};
}

static LiftBand sharpened(const Column *column, LiftBand band, double thick)
{
    for (int k = 0; k < HALVINGS; k++) {
        thick /= 2;
        if (band.high - band.low > thick && !column_matters(column, band.low, band.low + thick)) band.low += thick;
        if (band.high - band.low > thick && !column_matters(column, band.high - thick, band.high)) band.high -= thick;
    }
    return band;
}

static Added added_by(const PatchCells *cells, double strength, int i, int j)
{
    size_t side = (size_t)cells->count;
    const double *points = cells->points + ((2 * side + (size_t)i) * side + (size_t)j) * 16;
    Added added = {INFINITY, -INFINITY};
    for (int k = 0; k < 16; k++) {
        added.least = fmin(added.least, strength * points[k]);
        added.greatest = fmax(added.greatest, strength * points[k]);
    }
    return added;
}

// Only the perturbations that reach the block's column.
static void reaching(const FramedLeaf *leaf, const Column *column, LiftBand whole, FramedLeaf *near)
{
    near->count = 1;
    near->low = leaf->low;
    near->high = leaf->high;
    memcpy(near->quadrics[0], leaf->quadrics[0], sizeof near->quadrics[0]);
    for (uint32_t k = 1; k < leaf->count; k++) {
        double low, high;
        quadric_range(leaf->quadrics[k], (const double[3]){column->at[0], column->at[1], (whole.low + whole.high) / 2},
                      (const double[3]){column->half, column->half, (whole.high - whole.low) / 2}, &low, &high);
        if (high <= 0) continue;
        memcpy(near->quadrics[near->count], leaf->quadrics[k], sizeof near->quadrics[0]);
        near->strengths[near->count++] = leaf->strengths[k];
    }
}

static void bound_block(const FramedLeaf *leaf, const LiftPlace *place, const PatchCells *cells, int i, int j,
                        LiftBand *bands)
{
    int i_end = i + BLOCK < place->count ? i + BLOCK : place->count,
        j_end = j + BLOCK < place->count ? j + BLOCK : place->count;
    double n = place->count, thick = (place->high - place->low) / SLICES;
    LiftBand whole = {place->low, place->high};
    FramedLeaf near;
    Column column = {.leaf = leaf,
                     .at = {(i + i_end) / (2 * n), (j + j_end) / (2 * n)},
                     .half = fmax(i_end - i, j_end - j) / (2 * n),
                     .added = {INFINITY, -INFINITY}};
    for (int a = i; a < i_end; a++)
        for (int b = j; b < j_end; b++) {
            Added one = added_by(cells, place->strength, a, b);
            column.added.least = fmin(column.added.least, one.least);
            column.added.greatest = fmax(column.added.greatest, one.greatest);
        }
    reaching(leaf, &column, whole, &near);
    column.leaf = &near;
    LiftBand block = narrowed(&column, whole, SLICES);
    column.half = 0.5 / n;
    for (int a = i; a < i_end; a++)
        for (int b = j; b < j_end; b++) {
            LiftBand *band = &bands[a * place->count + b];
            *band = block;
            if (!(block.low < block.high)) continue;
            column.at[0] = (a + 0.5) / n;
            column.at[1] = (b + 0.5) / n;
            column.added = added_by(cells, place->strength, a, b);
            *band = narrowed(&column, block, (int)fmax(1, round((block.high - block.low) / thick)));
            if (band->low < band->high) *band = sharpened(&column, *band, thick);
        }
}

const LiftBand *lift_bands_get(LiftBands *bands, const Plan *plan, const double *values, const PlanLeaf *leaf,
                               uint32_t lift, const LiftPlace *place, const PatchCells *cells)
{
    LiftBand *own = bands->of[lift];
    if (bands->known[lift]) return own;
    bands->known[lift] = true;
    FramedLeaf framed;
    framed_leaf(plan, values, leaf, lift, place, &framed);
    LiftBand all = {place->low, place->high};
    if (!cells || place->flat) all = (LiftBand){INFINITY, -INFINITY};
    if (cells && !place->flat && framed.known) {
        for (int i = 0; i < place->count; i += BLOCK)
            for (int j = 0; j < place->count; j += BLOCK) bound_block(&framed, place, cells, i, j, own);
    } else {
        for (int k = 0; k < place->count * place->count; k++) own[k] = all;
    }
    return own;
}
