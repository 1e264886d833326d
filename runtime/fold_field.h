// General fields seen in views: their records and boxes, and their tapes with a frame's numbers (kernels/tape_shared.h).
//
// Where a field is in its own coordinates is found once for the numbers of its expression (tape_bounds()), not for each
// view: a field that turns, or is there a hundred times, costs one search.
//
//     FieldTables tables;
//     field_tables_init(&tables, plan);
//     field_tables_frame(&tables, values);   // in each frame, before any fold
//     fold_field(&tables, values, leaf, projection, record, &box);
#ifndef SCN_RUNTIME_FOLD_FIELD_H
#define SCN_RUNTIME_FOLD_FIELD_H

#include <stdbool.h>
#include <stdint.h>

#include "compiler/plan.h"
#include "kernels/shared.h"
#include "runtime/camera.h"

struct Projection;

typedef struct FieldTables {
    const Plan *plan;
    Box *boxes;       // of each tape, in its own coordinates; sides without an end infinite, low > high: nothing
    TapeStep *baked;  // plan->tape_step_count
    TapeStep *before; // those that the boxes belong to
    uint64_t version; // how often they have changed; 0: no frame was yet
    uint32_t longest; // steps of a tape
} FieldTables;

bool field_tables_init(FieldTables *tables, const Plan *plan); // false: no memory
void field_tables_release(FieldTables *tables);

// Puts a frame's numbers into the tapes.
void field_tables_frame(FieldTables *tables, const double *values);

// The record of a leaf and the box of U, V, w where it can be. `record` may be NULL.
void fold_field(const FieldTables *tables, const double *values, const PlanLeaf *leaf,
                const struct Projection *projection, FieldRecord *record, Box *box);

// Narrows the depths of a record to those of a box of U, V, w outside of which the field does not matter.
void limit_field(const struct Projection *projection, const Box *limit, FieldRecord *record);

#endif
