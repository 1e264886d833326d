// Patches seen in a view: the records and boxes of their cells (kernels/shared.h), from their Bézier points in double.
//
// A cell of a lift is what it is in every view: its points times the strength; where it is on a ray follows from the
// LiftRecord. A cell of a sheet has its points moved to the view's p. Boxes hold what a cell may add or show, with a
// margin for floats; one that reaches behind the eye has no end.
#ifndef SCN_RUNTIME_FOLD_PATCH_H
#define SCN_RUNTIME_FOLD_PATCH_H

#include "compiler/plan.h"
#include "kernels/shared.h"
#include "runtime/fold.h"
#include "runtime/lift_bands.h"
#include "runtime/patch_cells.h"
#include "runtime/view.h"

// Where a lift is: its frame, the caps between which it acts, and how many cells a side it has.
typedef struct LiftPlace {
    double frame[12], inverse[12]; // to the world and back
    double low, high;
    double strength;
    int count;
    bool automatic; // the caps follow the patch, and what lies beside them is cut off by others
    bool flat;      // the frame flattens space: nothing is lifted
} LiftPlace;

// `cells` may be NULL: a patch that is not solved is flat.
void lift_place(const Plan *plan, const double *values, const PlanLift *lift, const PatchCells *cells,
                LiftPlace *place);
void lift_record(const LiftPlace *place, const ScreenMap *map, LiftRecord *record);
void lift_cell(const LiftPlace *place, const PatchCells *cells, int i, int j, double factor, CellRecord *record);
// Behind the cell's record: also the least and the most that the cell adds, as the device knows its points.
void lift_cell_band(const LiftBand *band, const CellRecord *cell, CellBand *record);
void lift_cell_box(const LiftPlace *place, const LiftBand *band, int i, int j, const Projection *projection, Box *box);
void lift_box(const LiftPlace *place, const Projection *projection, Box *box); // of all cells

// The map from a sheet that `map` moves to the world into a view, and a cell of that sheet. `records` may be NULL.
void sheet_place(const double map[12], const Projection *projection, double place[12]);
void sheet_cell(const PatchCells *cells, int i, int j, const double place[12], const Projection *projection,
                CellRecord *records, Box *box);

// Where a thick patch is: the map from its own coordinates, about their middle, to the world, and how thick it is.
typedef struct ThickPlace {
    double frame[12], inverse[12];
    double middle[3]; // in the patch's coordinates
    double radius, side, size;
} ThickPlace;

void thick_place(const Plan *plan, const double *values, const PlanLeaf *leaf, ThickPlace *place);
void thick_record(const ThickPlace *place, const ScreenMap *map, ThickRecord *record);

// `records` may be NULL: THICK_RECORDS of them.
void thick_cell(const ThickPlace *place, const PatchCells *cells, int i, int j, const Projection *projection,
                CellRecord *records, Box *box);

#endif
