// Copies of clusters: perturbations that are on the device once, however many free forms have them (kernels/shared.h).
//
//     ClusterTable table;
//     if (!cluster_table_init(&table, plan, shares)) …no memory…
//     cluster_table_frame(&table, values);            // the parts of a frame, once: their numbers, where they are, how strong
//     copy_record(&table, values, copy, factor, projection, record, &box, &flags);      // of a copy in a view
//     cluster_table_release(&table);
//
// Without `shares` the table has no parts, and whoever folds a copy folds its perturbations one by one through copy_map().
#ifndef SCN_RUNTIME_FOLD_COPY_H
#define SCN_RUNTIME_FOLD_COPY_H

#include <stdbool.h>

#include "compiler/plan.h"
#include "kernels/shared.h"
#include "runtime/camera.h"
#include "runtime/fold.h"

typedef struct ClusterBox { // where some of a cluster's perturbations are positive, or negative, in its own coordinates
    Box positive, negative;
    bool strong; // some perturbation is much stronger than what it changes (fold_strong())
} ClusterBox;

typedef struct ClusterTable {
    const Plan *plan;
    bool shares;
    ClusterPart *parts; // of all clusters
    uint32_t part_count;
    uint32_t *first;      // of each cluster
    uint32_t *first_leaf; // that has a copy of it
    ClusterBox *boxes;
} ClusterTable;

bool cluster_table_init(ClusterTable *table, const Plan *plan, bool shares);
void cluster_table_release(ClusterTable *table);
void cluster_table_frame(ClusterTable *table, const double *values);

// The map of a view as a copy's cluster sees it: false where its own has no inverse (it is nowhere then).
bool copy_map(const double matrix[12], const ScreenMap *map, ScreenMap *own);

// What the device makes a copy's parts of, in a leaf whose base has this factor; where it can be seen and where it adds;
// RECORD_SIGNED, RECORD_GROWS and RECORD_STRONG of its leaf.
void copy_record(const ClusterTable *table, const double *values, const PlanCopy *copy, double factor,
                 const struct Projection *projection, const ScreenMap *map, CopyRecord *record, Box *seen, Box *added,
                 unsigned *flags);

#endif
