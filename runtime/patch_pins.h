// What holds the pins of a patch that is solved in the basis of modes (kernels/patch.cl).
//
// Conjugate gradients there are preconditioned by D, the inverse of the operator's diagonal. With C the pins' rows of
// modes, a shape D r has the values CᵀD r at the pins; pushes p at the pins change them by S p, S = CᵀD C. So S⁻¹ says
// how to push for any values.
#ifndef SCN_RUNTIME_PATCH_PINS_H
#define SCN_RUNTIME_PATCH_PINS_H

#include <stdbool.h>

#include "runtime/failure.h"
#include "runtime/patch_model.h"
#include "runtime/patch_modes.h"

// Writes S⁻¹ of a component, pin_count × pin_count. `work` has order² values. False with `failure` set where S is not
// positive definite, or without memory. It costs pin_count² · order² / 2 products.
bool patch_pins_inverse(const PatchModes *modes, const PatchModel *model, int component, double *work, float *inverse,
                        Failure *failure);

// Whether S is the same for two models.
bool patch_pins_same(const PatchModel *a, const PatchModel *b);

#endif
