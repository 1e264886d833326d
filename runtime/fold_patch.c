#include "runtime/fold_patch.h"

#include <math.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/quadric.h"

#define MARGIN 4e-6 // of a box, for what floats may add
#define NEAR   1e-3 // of the distance to the eye: what is nearer to its plane has a box without an end

static const double *cell_points(const PatchCells *cells, int component, int i, int j)
{
    return cells->points +
           (((size_t)component * (size_t)cells->count + (size_t)i) * (size_t)cells->count + (size_t)j) * 16;
}

static void to_view(const Projection *p, const double world[3], double place[3])
{
    for (int k = 0; k < 3; k++) {
        place[k] = 0;
        for (int c = 0; c < 3; c++) place[k] += p->axis[k][c] * (world[c] - p->origin[c]);
        place[k] /= p->unit;
    }
}

static void box_begin(Box *box)
{
    for (int k = 0; k < 3; k++) {
        box->low[k] = INFINITY;
        box->high[k] = -INFINITY;
    }
}

static void box_add(Box *box, const Projection *projection, const double place[3])
{
    double q = 1 + projection->kappa * place[2];
    for (int k = 0; k < 3; k++) {
        double at = place[k] / q;
        box->low[k] = q > NEAR ? fmin(box->low[k], at) : -INFINITY;
        box->high[k] = q > NEAR ? fmax(box->high[k], at) : INFINITY;
    }
}

static void box_end(Box *box)
{
    for (int k = 0; k < 3; k++) {
        double margin = MARGIN * (1 + fmax(fabs(box->low[k]), fabs(box->high[k])));
        if (isfinite(margin)) {
            box->low[k] -= margin;
            box->high[k] += margin;
        }
    }
}

// --- lifts

void lift_place(const Plan *plan, const double *values, const PlanLift *lift, const PatchCells *cells, LiftPlace *place)
{
    const double *box = values + plan->patches[lift->patch].box;
    memcpy(place->frame, values + lift->frame, sizeof place->frame);
    place->flat = !matrix_inverse(place->frame, place->inverse);
    place->low = values[lift->low];
    place->high = values[lift->high];
    place->strength = values[lift->strength];
    place->count = (int)plan->patches[lift->patch].nodes - 1;
    place->automatic = place->high < place->low;
    if (!place->automatic) return;
    double margin = 1e-3 * (1 + fabs(box[2]) + fabs(box[5]));
    place->low = fmin(fmin(place->low, 0), box[2]) - margin;
    place->high = fmax(0, box[5]) + margin;
}

// The coordinates that a map from the world gives, of places in the view: three rows of a LiftRecord or a ThickRecord.
static void record_rows(const double inverse[12], const ScreenMap *map, float *x, float *y, float *z)
{
    float *const rows[3] = {x, y, z};
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++) {
            double sum = 0;
            for (int k = 0; k < 4; k++) sum += inverse[4 * row + k] * map->column[column][k];
            rows[row][column] = (float)sum;
        }
}

void lift_record(const LiftPlace *place, const ScreenMap *map, LiftRecord *record)
{
    record_rows(place->inverse, map, record->x, record->y, record->z);
    record->low = (float)place->low;
    record->high = (float)place->high;
    record->cells = (float)place->count;
    record->spare = 0;
}

void lift_cell(const LiftPlace *place, const PatchCells *cells, int i, int j, double factor, CellRecord *record)
{
    memset(record, 0, sizeof *record);
    if (!cells) return;
    const double *points = cell_points(cells, 2, i, j);
    for (int k = 0; k < 16; k++) record->points[k] = (float)(place->strength * factor * points[k]);
}

static void frame_box(const LiftPlace *place, const double low[3], const double high[3], const Projection *projection,
                      Box *box)
{
    box_begin(box);
    for (int corner = 0; corner < 8 && !place->flat; corner++) {
        double at[3] = {corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1], corner & 4 ? high[2] : low[2]};
        double world[3], view[3];
        matrix_point(place->frame, at, world);
        to_view(projection, world, view);
        box_add(box, projection, view);
    }
    box_end(box);
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

void framed_leaf(const Plan *plan, const double *values, const PlanLeaf *leaf, const LiftPlace *place,
                 FramedLeaf *framed)
{
    framed->count = 1 + leaf->count;
    framed->known = leaf->count <= BAND_PERTURBATIONS && leaf->lift_count == 1 &&
                    quadric_transform(values + leaf->quadric, place->frame, framed->quadrics[0]);
    for (uint32_t k = 0; framed->known && k < leaf->count; k++) {
        const PlanPerturbation *p = &plan->perturbations[leaf->begin + k];
        framed->strengths[1 + k] = values[p->strength];
        framed->known = quadric_transform(values + p->quadric, place->frame, framed->quadrics[1 + k]);
    }
}

static double cube_of(double q)
{
    return q > 0 ? q * q * q : 0;
}

static void leaf_range(const FramedLeaf *leaf, const double at[3], const double half[3], double *low, double *high)
{
    quadric_range(leaf->quadrics[0], at, half, low, high);
    for (uint32_t k = 1; k < leaf->count; k++) {
        double from, to;
        quadric_range(leaf->quadrics[k], at, half, &from, &to);
        double a = leaf->strengths[k] * cube_of(from), b = leaf->strengths[k] * cube_of(to);
        *low += fmin(a, b);
        *high += fmax(a, b);
    }
}

LiftBand lift_band(const FramedLeaf *leaf, const LiftPlace *place, const PatchCells *cells, int i, int j)
{
    enum { SLICES = 24 };
    LiftBand band = {INFINITY, -INFINITY};
    if (!cells || place->flat) return band;
    const double *points = cell_points(cells, 2, i, j);
    double least = INFINITY, greatest = -INFINITY, n = place->count;
    for (int k = 0; k < 16; k++) {
        least = fmin(least, place->strength * points[k]);
        greatest = fmax(greatest, place->strength * points[k]);
    }
    if (!leaf->known) return (LiftBand){place->low, place->high};
    double thick = (place->high - place->low) / SLICES, half[3] = {0.5 / n, 0.5 / n, 0.5 * thick};
    for (int k = 0; k < SLICES; k++) {
        double at[3] = {(i + 0.5) / n, (j + 0.5) / n, place->low + (k + 0.5) * thick}, low, high;
        leaf_range(leaf, at, half, &low, &high);
        if (high < fmin(0, -greatest) || low > fmax(0, -least)) continue; // the base decides, with the cell and without
        band.low = fmin(band.low, place->low + k * thick);
        band.high = fmax(band.high, place->low + (k + 1) * thick);
    }
    return band;
}

void lift_cell_box(const LiftPlace *place, const LiftBand *band, int i, int j, const Projection *projection, Box *box)
{
    double n = place->count;
    frame_box(place, (const double[3]){i / n, j / n, band->low},
              (const double[3]){(i + 1) / n, (j + 1) / n, band->high}, projection, box);
}

void lift_box(const LiftPlace *place, const Projection *projection, Box *box)
{
    frame_box(place, (const double[3]){0, 0, place->low}, (const double[3]){1, 1, place->high}, projection, box);
}

// --- sheets

void sheet_cell(const PatchCells *cells, int i, int j, const double map[12], const Projection *projection,
                CellRecord *records, Box *box)
{
    box_begin(box);
    for (int k = 0; k < 16; k++) {
        double place[3], world[3], view[3];
        for (int c = 0; c < 3; c++) place[c] = cell_points(cells, c, i, j)[k];
        matrix_point(map, place, world);
        to_view(projection, world, view);
        box_add(box, projection, view);
        for (int c = 0; records && c < 3; c++) records[c].points[k] = (float)view[c];
    }
    box_end(box);
}

// --- thick patches

_Static_assert(sizeof(ThickRecord) == sizeof(QuadricRecord), "it stands in a quadric's place");
_Static_assert(sizeof(ThickShape) == sizeof(CellRecord), "it stands behind three of a cell's");

void thick_place(const Plan *plan, const double *values, const PlanLeaf *leaf, ThickPlace *place)
{
    const double *box = values + plan->patches[leaf->begin].box, *map = values + leaf->quadric;
    double square = 0;
    memcpy(place->frame, map, sizeof place->frame);
    for (int k = 0; k < 3; k++) {
        place->middle[k] = (box[k] + box[3 + k]) / 2;
        square += (box[3 + k] - box[k]) * (box[3 + k] - box[k]);
    }
    for (int k = 0; k < 3; k++)
        place->frame[4 * k + 3] = map[4 * k + 3] + map[4 * k] * place->middle[0] + map[4 * k + 1] * place->middle[1] +
                                  map[4 * k + 2] * place->middle[2];
    place->radius = values[leaf->thickness] / 2;
    place->side = values[leaf->side];
    place->size = sqrt(square) + fabs(place->radius);
    if (!matrix_inverse(place->frame, place->inverse)) place->radius = 0; // flattened: nothing is left of it
}

void thick_record(const ThickPlace *place, const ScreenMap *map, ThickRecord *record)
{
    memset(record, 0, sizeof *record);
    if (place->radius > 0) record_rows(place->inverse, map, record->x, record->y, record->z);
    record->radius = (float)place->radius;
    record->side = (float)place->side;
    record->size = (float)place->size;
}

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross3(const double a[3], const double b[3], double r[3])
{
    for (int k = 0; k < 3; k++) r[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

// Makes `v` a unit vector; another one where it is too short to tell its direction.
static void make_unit(double v[3], const double other[3])
{
    double length = sqrt(dot3(v, v));
    for (int k = 0; k < 3; k++) v[k] = length > 1e-12 ? v[k] / length : other[k];
}

// The axes of a cell: along its chord in u, across, and its normal.
static void cell_axes(const double points[16][3], double axes[3][3])
{
    static const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
    double u[3], v[3], aside[3];
    for (int k = 0; k < 3; k++) {
        u[k] = points[12][k] + points[15][k] - points[0][k] - points[3][k];
        v[k] = points[3][k] + points[15][k] - points[0][k] - points[12][k];
    }
    make_unit(u, x);
    cross3(u, fabs(u[0]) < 0.6 ? x : y, aside);
    make_unit(aside, y);
    memcpy(axes[0], u, sizeof axes[0]);
    cross3(u, v, axes[2]);
    make_unit(axes[2], aside);
    cross3(axes[2], axes[0], axes[1]);
}

static void write_shape(const double points[16][3], double size, ThickShape *shape)
{
    double axes[3][3];
    float *const rows[3] = {shape->e, shape->f, shape->n};
    memset(shape, 0, sizeof *shape);
    cell_axes(points, axes);
    for (int a = 0; a < 3; a++) {
        double low = INFINITY, high = -INFINITY;
        for (int k = 0; k < 16; k++) {
            double at = dot3(axes[a], points[k]);
            low = fmin(low, at);
            high = fmax(high, at);
        }
        shape->extent[a] = (float)((high - low) / 2 + MARGIN * size);
        for (int k = 0; k < 3; k++) {
            rows[a][k] = (float)axes[a][k];
            shape->middle[k] += (float)((low + high) / 2 * axes[a][k]);
        }
    }
}

// The ball of the radius is an ellipsoid in the view: it reaches as far along an axis as the map's row there is long.
static void thick_box(const ThickPlace *place, const double points[16][3], const Projection *projection, Box *box)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int k = 0; k < 16; k++) {
        double world[3], view[3];
        matrix_point(place->frame, points[k], world);
        to_view(projection, world, view);
        for (int a = 0; a < 3; a++) {
            low[a] = fmin(low[a], view[a]);
            high[a] = fmax(high[a], view[a]);
        }
    }
    for (int a = 0; a < 3; a++) {
        double square = 0;
        for (int column = 0; column < 3; column++) {
            double sum = 0;
            for (int k = 0; k < 3; k++) sum += projection->axis[a][k] * place->frame[4 * k + column];
            square += sum * sum;
        }
        double reach = place->radius * sqrt(square) / projection->unit;
        low[a] -= reach;
        high[a] += reach;
    }
    box_begin(box);
    for (int corner = 0; corner < 8; corner++)
        box_add(
            box, projection,
            (double[3]){corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1], corner & 4 ? high[2] : low[2]});
    box_end(box);
}

void thick_cell(const ThickPlace *place, const PatchCells *cells, int i, int j, const Projection *projection,
                CellRecord *records, Box *box)
{
    double points[16][3];
    for (int k = 0; k < 16; k++)
        for (int c = 0; c < 3; c++) points[k][c] = cell_points(cells, c, i, j)[k] - place->middle[c];
    thick_box(place, points, projection, box);
    if (!records) return;
    for (int k = 0; k < 16; k++)
        for (int c = 0; c < 3; c++) records[c].points[k] = (float)points[k][c];
    write_shape(points, place->size, (ThickShape *)&records[3]);
}
