#include "runtime/patch_check.h"

#include "compiler/frame.h"
#include "lang/diag.h"
#include "runtime/patch_diagnose.h"
#include "runtime/patch_drive.h"

// Whether a stiffness may change: what is const, the compiler has warned of where it is written.
static bool stiffness_moves(const PlanPatch *patch, Arena *scratch)
{
    enum { FIRST = 2, COUNT = 9 };
    bool *computed = plan_computed(patch->program, scratch), moves = false;
    for (int k = FIRST; k < FIRST + COUNT; k++) moves |= computed[patch->model[k]];
    return moves;
}

static void tell(Unit *unit, const PlanPatch *patch, const PatchFinding *finding, bool moves)
{
    if (finding->error)
        diag(unit, patch->span, DIAG_PATCH_ILL_POSED, "%s", finding->text);
    else if (finding->problem == PATCH_STEP_LARGE)
        diag(unit, patch->span, DIAG_PATCH_STEP, "%s", finding->text);
    else if (moves)
        diag(unit, patch->span, DIAG_PATCH_GROWS, "%s", finding->text);
}

// Whether what is only a warning belongs to a stiffness that is refused: then one message is enough.
static bool is_refused(const PatchFinding *findings, int count, const PatchFinding *finding)
{
    bool grows = finding->problem == PATCH_B_NEGATIVE || finding->problem == PATCH_D_NEGATIVE ||
                 finding->problem == PATCH_C_BELOW;
    for (int k = 0; k < count && grows; k++)
        if (findings[k].problem == PATCH_OPERATOR && findings[k].error && findings[k].component == finding->component)
            return true;
    return false;
}

static void check_one(Unit *unit, const PlanPatch *patch, double fps, const double *inputs, Arena *scratch)
{
    PatchDriver *driver = patch_driver_new(patch, fps);
    FrameError error;
    // What has no value at the beginning is told by the frame that needs it.
    if (driver && patch_driver_at(driver, 0, inputs, &error) && patch_driver_edges(driver, NULL, &error)) {
        PatchFinding findings[PATCH_FINDINGS];
        int count = patch_diagnose(&driver->model, findings, PATCH_FINDINGS);
        if (count > PATCH_FINDINGS) count = PATCH_FINDINGS;
        for (int k = 0; k < count; k++)
            if (!is_refused(findings, count, &findings[k]))
                tell(unit, patch, &findings[k], stiffness_moves(patch, scratch));
    }
    patch_driver_free(driver);
}

void patch_check(Unit *unit, const Plan *plan, const double *inputs)
{
    Arena scratch = {0};
    for (uint32_t k = 0; k < plan->patch_count; k++) check_one(unit, &plan->patches[k], plan->fps, inputs, &scratch);
    arena_release(&scratch);
}
