// The automatic camera of a scene: placed by camera_frame() about the scene's bounds, then brought nearer and aimed
// until what can be seen of the scene fills the picture.
//
// How much is seen is known exactly, in double on the host: the boxes of all quadrics and free forms in the view, as
// for culling. So a ball fills the picture though its box has corners, and the result does not depend on the device.
#ifndef SCN_RUNTIME_FRAMING_H
#define SCN_RUNTIME_FRAMING_H

#include <stdbool.h>

#include "compiler/plan.h"
#include "runtime/camera.h"

struct PatchCells;

// Fills the camera for a plan and the values of some moments (`count` arrays of plan->slot_count, whose camera slots
// are written to): all of them are seen. `camera` holds OP_CAMERA's fifteen values, as camera_frame() takes them.
// `cells` are the plan's patches at each moment (a NULL, or NULL: flat). False where memory is missing.
bool framing_camera(const Plan *plan, double *const *moments, const struct PatchCells *const *const *cells, int count,
                    int width, int height, double camera[15]);

#endif
