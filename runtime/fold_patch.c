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
    double q = 1 + projection->kappa * place[2], scale = 1 / q;
    if (!(q > NEAR)) {
        for (int k = 0; k < 3; k++) {
            box->low[k] = -INFINITY;
            box->high[k] = INFINITY;
        }
        return;
    }
    for (int k = 0; k < 3; k++) {
        double at = place[k] * scale; // rounded once more than a quotient, which the box's margin covers
        box->low[k] = at < box->low[k] ? at : box->low[k];
        box->high[k] = at > box->high[k] ? at : box->high[k];
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
    double world[3], origin[3], edges[3][3]; // in the view: the low corner, and the edges from there
    box_begin(box);
    if (place->flat) return;
    matrix_point(place->frame, low, world);
    to_view(projection, world, origin);
    for (int e = 0; e < 3; e++) {
        double at[3] = {low[0], low[1], low[2]};
        at[e] = high[e];
        matrix_point(place->frame, at, world);
        to_view(projection, world, edges[e]);
        for (int k = 0; k < 3; k++) edges[e][k] -= origin[k];
    }
    for (int corner = 0; corner < 8; corner++) {
        double view[3] = {origin[0], origin[1], origin[2]};
        for (int e = 0; e < 3; e++)
            for (int k = 0; k < 3 && corner >> e & 1; k++) view[k] += edges[e][k];
        box_add(box, projection, view);
    }
    box_end(box);
}

void lift_cell_band(const LiftBand *band, const CellRecord *cell, CellBand *record)
{
    *record = (CellBand){
        .low = (float)band->low, .high = (float)band->high, .least = cell->points[0], .most = cell->points[0]};
    for (int k = 1; k < 16; k++) {
        record->least = fminf(record->least, cell->points[k]);
        record->most = fmaxf(record->most, cell->points[k]);
    }
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

void sheet_place(const double map[12], const Projection *p, double place[12])
{
    for (int k = 0; k < 3; k++)
        for (int column = 0; column < 4; column++) {
            double sum = 0;
            for (int c = 0; c < 3; c++) sum += p->axis[k][c] * (map[4 * c + column] - (column == 3 ? p->origin[c] : 0));
            place[4 * k + column] = sum / p->unit;
        }
}

void sheet_cell(const PatchCells *cells, int i, int j, const double place[12], const Projection *projection,
                CellRecord *records, Box *box)
{
    const double *x = cell_points(cells, 0, i, j), *y = cell_points(cells, 1, i, j), *z = cell_points(cells, 2, i, j);
    box_begin(box);
    for (int k = 0; k < 16; k++) {
        double view[3];
        for (int c = 0; c < 3; c++) {
            const double *row = place + 4 * c;
            view[c] = row[0] * x[k] + row[1] * y[k] + row[2] * z[k] + row[3];
        }
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
