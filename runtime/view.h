// From a frame's values to what the kernels read: cameras and lights are folded into the quadrics, in double, on the host.
//
// A projection is a view (kernels/shared.h) in double. Folding a quadric into it gives a record of a few floats, about the centre of its own conic,
// so that nothing of the accuracy is lost to far eyes, small objects or large coordinates; and the box where it can be seen.
//
//     Layout layout;
//     if (!layout_init(&layout, plan)) …no memory…
//     view_primary(&layout, values, width, height, &projection);
//     view_fold(&layout, values, &projection, records, boxes);
//     layout_release(&layout);
#ifndef SCN_RUNTIME_VIEW_H
#define SCN_RUNTIME_VIEW_H

#include <stdbool.h>
#include <stdint.h>

#include "compiler/plan.h"
#include "kernels/shared.h"
#include "runtime/camera.h"
#include "runtime/faces.h"
#include "runtime/fold_copy.h"
#include "runtime/fold_field.h"
#include "runtime/lift_bands.h"

// The plan's leaves and perturbations under one numbering (PlanNode in shared.h), and the items that tiles choose from.
struct PatchCells;

typedef struct Layout {
    const Plan *plan;
    PlanNode *nodes; // record_count
    uint32_t record_count;
    uint32_t leaf_count; // that rays can hit
    uint32_t *items;     // numbers of components and perturbations, ascending
    uint32_t item_count, item_stride;
    uint32_t *components, *perturbations; // of the plan, as they are numbered (runtime/spatial.h)
    Box *boxes;                           // of each number, while folding
    FieldTables fields;
    Faces faces;
    ClusterTable clusters; // of what a device shares; without parts where copies have records part by part
    LiftBands bands;       // of `cells`
    const struct PatchCells *const *cells; // of the plan's patches, borrowed; NULL among them, or NULL: not solved
} Layout;

// `shares`: the device makes the records of copies of clusters itself (kernels/copies.cl); else there are records for each.
// False if there is no memory, or if groups that stand in groups that … make more than 2^28 records.
bool layout_init(Layout *layout, const Plan *plan, bool shares);
void layout_release(Layout *layout);

typedef struct Projection {
    double origin[3];  // O
    double axis[3][3]; // r, s, f
    double unit;       // world length of a unit
    double kappa;      // 1 / (distance of the eye before O, in units); 0: parallel rays
    double start;      // first w; -INFINITY
    double limit;      // w beyond which nothing is seen
} Projection;

// Before anything of a frame is folded: takes the numbers of its general fields, and of the faces of its leaves.
void view_frame(Layout *layout, const double *values);

// Bounds of the scene in the world; sides without an end are infinite, an empty scene has low > high.
void view_bounds(Layout *layout, const double *values, Box *box);

// The camera's view, and where the picture is on its plane: U, V of the left upper corner and a pixel's steps.
typedef struct Screen {
    double u0, v0, du, dv;
} Screen;
void view_primary(Layout *layout, const double *values, const Box *bounds, int width, int height,
                  Projection *projection, Screen *screen);

// The views of a light: 1, or 6 around a point among the scene. `primary` gives the unit and the place to be exact about.
int view_light(const Plan *plan, const double *values, const PlanLight *light, const Box *bounds,
               const Projection *primary, Projection views[6]);

// Whether no record of any view can differ between two frames' values.
bool view_same_geometry(const Layout *layout, const double *values, const double *others);

// Fills layout->record_count records and BOX_FLOATS(layout->item_count) floats.
void view_fold(Layout *layout, const double *values, const Projection *projection, QuadricRecord *records,
               float *boxes);

// Three rows of four: from p = (U, V, w)/W of `from` to that of `to`.
void view_map(const Projection *from, const Projection *to, float map[12]);

#endif
