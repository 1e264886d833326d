// An order of a plan's components and perturbations in which neighbours in the order are neighbours in space: along a Morton curve through their middles.
//
//     uint32_t *components = …plan->component_count…, *perturbations = …plan->perturbation_count…;
//     if (!spatial_order(plan, components, perturbations)) …no memory…
//     plan->components[components[k]] …the one that stands at place k…
//
// Lists of what a tile or a packet meets are made from blocks of neighbours (kernels/cull.cl), so blocks should be small in space. Only what stands together
// moves: components of one shape within a group, perturbations within a free form, and no fewer than SPATIAL_LEAST of them. What they are in the scene, and
// which leaf decides where several do, is not touched: pictures do not know the order.
//
// Places are those of the plan's const values. What a frame moves, and general fields, which have no middle that is known here, stand where the scene put
// them, or at the origin: then blocks are large and lists are made more slowly, but not differently.
#ifndef SCN_RUNTIME_SPATIAL_H
#define SCN_RUNTIME_SPATIAL_H

#include <stdbool.h>
#include <stdint.h>

#include "compiler/plan.h"

#define SPATIAL_LEAST 64

// Fills both arrays with permutations. False if there is no memory.
bool spatial_order(const Plan *plan, uint32_t *components, uint32_t *perturbations);

#endif
