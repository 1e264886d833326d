#include "runtime/framing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/bounds.h"
#include "runtime/view.h"

#define STEPS  8    // a ball needs three
#define MARGIN 1.12 // of the picture around what is seen

typedef struct Framing {
    const Plan *plan;
    double *const *moments;
    const struct PatchCells *const *const *cells;
    int count, width, height;
    Layout layout;
    QuadricRecord *records;
    float *boxes;
    Box bounds; // in the world, of all moments
} Framing;

// What is seen in the picture's coordinates: -1 … 1 from side to side and from bottom to top.
typedef struct Extent {
    double low[2], high[2];
} Extent;

static void join_item(Extent *extent, const float *boxes, uint32_t stride, const Screen *screen)
{
    static const int low[2] = {BOX_U_LOW, BOX_V_LOW}, high[2] = {BOX_U_HIGH, BOX_V_HIGH};
    const double half[2] = {-screen->u0, screen->v0};
    if (!(boxes[BOX_U_LOW * stride] <= boxes[BOX_U_HIGH * stride])) return; // empty
    for (int c = 0; c < 2; c++) {
        extent->low[c] = fmin(extent->low[c], boxes[(uint32_t)low[c] * stride] / half[c]);
        extent->high[c] = fmax(extent->high[c], boxes[(uint32_t)high[c] * stride] / half[c]);
    }
}

// What all moments show. False where that is nothing, or goes beyond all sides.
static bool find_extent(Framing *f, const double camera[15], Extent *extent)
{
    *extent = (Extent){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (int m = 0; m < f->count; m++) {
        double *values = f->moments[m];
        memcpy(values + f->plan->camera, camera, 15 * sizeof(double));
        Projection projection;
        Screen screen;
        f->layout.cells = f->cells ? f->cells[m] : NULL;
        view_primary(&f->layout, values, &f->bounds, f->width, f->height, &projection, &screen);
        view_frame(&f->layout, values);
        view_fold(&f->layout, values, &projection, f->records, f->boxes);
        for (uint32_t i = 0; i < f->layout.item_count; i++)
            join_item(extent, f->boxes + i, f->layout.item_stride, &screen);
    }
    for (int c = 0; c < 2; c++)
        if (!isfinite(extent->low[c]) || !isfinite(extent->high[c]) || extent->low[c] >= extent->high[c]) return false;
    return true;
}

// Moves the camera sideways so that the middle of what is seen is in the middle of the picture, and along its view (or
// changes the height of an orthographic picture) so that it fills it.
static void improve(const Framing *f, double camera[15], const Extent *extent)
{
    CameraAxes axes;
    camera_axes(camera, &axes);
    double *eye = camera, *look_at = camera + 3, distance = 0;
    for (int c = 0; c < 3; c++) distance += (eye[c] - look_at[c]) * axes.back[c];
    double half_height = f->plan->orthographic ? camera[10] / 2 : distance * tan(camera[9] / 2);
    double half_width = half_height * f->width / f->height, size = 0;
    for (int c = 0; c < 2; c++) size = fmax(size, (extent->high[c] - extent->low[c]) / 2);
    double right = half_width * (extent->low[0] + extent->high[0]) / 2,
           up = half_height * (extent->low[1] + extent->high[1]) / 2;
    if (f->plan->orthographic)
        camera[10] *= size * MARGIN;
    else
        distance *= size * MARGIN;
    for (int c = 0; c < 3; c++) {
        look_at[c] += right * axes.right[c] + up * axes.up[c];
        eye[c] = look_at[c] + distance * axes.back[c];
    }
}

static bool fits(const Extent *extent)
{
    double most = fmax(fmax(-extent->low[0], extent->high[0]), fmax(-extent->low[1], extent->high[1]));
    return most <= 1;
}

static bool is_finite(const Box *box)
{
    bool finite = true;
    for (int c = 0; c < 3; c++)
        finite &= isfinite(box->low[c]) && isfinite(box->high[c]) && box->low[c] <= box->high[c];
    return finite;
}

// Joins the parts of the scene that have an end. The boxes of a view know an end of ellipsoids alone; these know that of
// a cylinder between planes, too. False where no part has one.
static bool join_parts(Framing *f, const double *values)
{
    const PlanGroup *scene = &f->plan->groups[0];
    bool any = false;
    for (uint32_t k = 0; k < scene->component_count; k++) {
        Bounds bounds = bounds_of_component(f->plan, values, scene->component_begin + k);
        Box box;
        memcpy(box.low, bounds.low, sizeof box.low);
        memcpy(box.high, bounds.high, sizeof box.high);
        if (!is_finite(&box)) continue;
        box_join(&f->bounds, &box);
        any = true;
    }
    return any;
}

// Of all moments. What has no end does not count where something has one.
static void find_bounds(Framing *f)
{
    f->bounds = (Box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    bool in_union = f->plan->group_types[f->plan->groups[0].type].set == SET_UNION;
    for (int m = 0; m < f->count; m++) {
        Box box;
        view_frame(&f->layout, f->moments[m]);
        f->layout.cells = f->cells ? f->cells[m] : NULL;
        view_bounds(&f->layout, f->moments[m], &box);
        if (is_finite(&box) || !in_union || !join_parts(f, f->moments[m])) box_join(&f->bounds, &box);
    }
}

bool framing_camera(const Plan *plan, double *const *moments, const struct PatchCells *const *const *cells, int count,
                    int width, int height, double camera[15])
{
    Framing f = {.plan = plan, .moments = moments, .cells = cells, .count = count, .width = width, .height = height};
    if (!layout_init(&f.layout, plan, false)) return false;
    f.records = malloc((f.layout.record_count + 1u) * sizeof *f.records);
    f.boxes = malloc(BOX_FLOATS((size_t)f.layout.item_count) * sizeof *f.boxes);
    bool ok = f.records && f.boxes;
    if (ok) {
        find_bounds(&f);
        camera_frame(camera, plan->orthographic, &f.bounds, (double)width / height);
        double best[15];
        memcpy(best, camera, sizeof best);
        for (int step = 0; step < STEPS; step++) {
            Extent extent;
            if (!find_extent(&f, camera, &extent)) break;
            if (step && fits(&extent)) memcpy(best, camera, sizeof best);
            improve(&f, camera, &extent);
        }
        memcpy(camera, best, sizeof best);
    }
    free(f.records);
    free(f.boxes);
    layout_release(&f.layout);
    return ok;
}
