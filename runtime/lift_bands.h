// Where the cells of lifts matter in a frame: the same for all of its views, so it is found once.
//
//     LiftBands bands = {0};
//     if (!lift_bands_init(&bands, plan)) …no memory…
//     lift_bands_forget(&bands);                                  the values, or the patches, are others
//     const LiftBand *band = lift_bands_get(&bands, values, leaf, lift, cells);    of the cells, row by row
//     lift_bands_release(&bands);
//
// A cell matters between those heights of its lift's frame at which the function of its leaf, with what the cell adds and without it, may have
// either sign. Bounds of quadrics on boxes say so: first for blocks of cells in slices between the caps, then for the cells of a block in the slices that
// were left, then for ever thinner parts of the slices at both ends. A rendering that takes more than there is counts the more.
#ifndef SCN_RUNTIME_LIFT_BANDS_H
#define SCN_RUNTIME_LIFT_BANDS_H

#include <stdbool.h>

#include "compiler/plan.h"
#include "runtime/patch_cells.h"

struct LiftPlace; // runtime/fold_patch.h

// Heights of a lift's frame; low > high: nowhere.
typedef struct LiftBand {
    double low, high;
} LiftBand;

typedef struct LiftBands {
    LiftBand **of; // of each lift of the plan its cells'
    bool *known;
    uint32_t count;
} LiftBands;

bool lift_bands_init(LiftBands *bands, const Plan *plan);
void lift_bands_release(LiftBands *bands);
void lift_bands_forget(LiftBands *bands);

// `place` is that of the lift, which belongs to the leaf; `cells` are its patch's, or NULL.
const LiftBand *lift_bands_get(LiftBands *bands, const Plan *plan, const double *values, const PlanLeaf *leaf,
                               uint32_t lift, const struct LiftPlace *place, const PatchCells *cells);

#endif
