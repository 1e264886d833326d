#include "runtime/scene_patches.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/file.h"
#include "runtime/patch_scene.h"

typedef struct ScenePatches {
    PatchSolve **solves;
    PatchCells **cells;
    uint32_t count;
    double number; // of the shapes that were made so far
    bool solved;
    double time; // to which they are
    double *inputs;
} ScenePatches;

void scene_patches_free(ScnScene *scene)
{
    ScenePatches *patches = scene->patches;
    if (!patches) return;
    for (uint32_t k = 0; k < patches->count; k++) {
        if (patches->solves) patch_solve_free(patches->solves[k]);
        if (patches->cells) patch_cells_free(patches->cells[k]);
    }
    free(patches->solves);
    free(patches->cells);
    free(patches->inputs);
    free(patches);
    scene->patches = NULL;
}

static bool make(ScnScene *scene, Failure *failure)
{
    const Plan *plan = scene->package->plan;
    ScenePatches *patches = scene->patches = calloc(1, sizeof *patches);
    if (!patches) return fail(failure, "out of memory for the patches");
    patches->solves = calloc(plan->patch_count, sizeof(PatchSolve *));
    patches->cells = calloc(plan->patch_count, sizeof(PatchCells *));
    patches->inputs = calloc(plan->input_count + 1, sizeof *patches->inputs);
    bool ok = patches->solves && patches->cells && patches->inputs;
    PatchSolveDesc desc = {.fps = plan->fps,
                           .method = PATCH_METHOD_DEVICE,
                           .device = scene->device,
                           .anyway = !scene->solver,
                           .cached = !scene->no_cache,
                           .checkpoints = scene->checkpoints};
    if (scene->checkpoints && !make_folders(scene->checkpoints))
        return fail(failure, "cannot make the folder for checkpoints %s: %s", scene->checkpoints, strerror(errno));
    if (scene->solver && !patch_method_named(scene->solver, &desc.method))
        return fail(failure, "patches are solved by device, direct or gauss-seidel, not by \"%s\"", scene->solver);
    if (ok) patches->count = plan->patch_count;
    for (uint32_t k = 0; ok && k < plan->patch_count; k++) {
        patches->solves[k] = patch_solve_new(&plan->patches[k], &desc, failure);
        patches->cells[k] = patch_cells_new((int)plan->patches[k].nodes);
        ok = patches->solves[k] && patches->cells[k];
    }
    if (ok) patch_solves_join(patches->solves, patches->count);
    return ok || fail(failure, "out of memory for the patches");
}

static void note_box(const PatchCells *cells, double number, double box[7])
{
    size_t points = (size_t)cells->count * (size_t)cells->count * 16;
    for (int c = 0; c < 3; c++) {
        const double *p = cells->points + (size_t)c * points;
        double low = INFINITY, high = -INFINITY;
        for (size_t k = 0; k < points; k++) {
            low = p[k] < low ? p[k] : low;
            high = p[k] > high ? p[k] : high;
        }
        box[c] = low;
        box[3 + c] = high;
    }
    box[6] = number;
}

// Over the unit square a solid knows z as a function of x and y alone: a lift whose caps follow the patch.
static bool check_solids(const Plan *plan, const ScenePatches *patches, const double *values, FrameError *error)
{
    for (uint32_t k = 0; k < plan->lift_count; k++) {
        const PlanLift *lift = &plan->lifts[k];
        const PlanPatch *patch = &plan->patches[lift->patch];
        if (!(values[lift->high] < values[lift->low])) continue;
        PatchShape shape = patch_solve_shape(patches->solves[lift->patch]);
        double worst = 0;
        for (int i = 0; i < shape.nodes; i++)
            for (int j = 0; j < shape.nodes; j++) {
                worst = fmax(worst, fabs(shape.x[0][i * shape.nodes + j] - i / (double)(shape.nodes - 1)));
                worst = fmax(worst, fabs(shape.x[1][i * shape.nodes + j] - j / (double)(shape.nodes - 1)));
            }
        if (worst < 1e-6) continue;
        *error = (FrameError){.span = patch->span, .code = DIAG_OUT_OF_RANGE};
        snprintf(error->text, sizeof error->text,
                 "out-of-range: patch %s: solid wants a patch whose x and y are u and v, and they are %.2g away: give "
                 "it no other places and forces along x and y, or move the solid",
                 patch->name, worst);
        return false;
    }
    return true;
}

// A thickness that a handle or the time has brought to nothing.
static bool check_thickness(const Plan *plan, const double *values, FrameError *error)
{
    for (uint32_t k = 0; k < plan->leaf_count; k++) {
        const PlanLeaf *leaf = &plan->leaves[k];
        bool hidden = leaf->shown != NO_SLOT && values[leaf->shown] == 0;
        if (leaf->kind != LEAF_THICK || hidden || values[leaf->thickness] > 0) continue;
        const PlanPatch *patch = &plan->patches[leaf->begin];
        *error = (FrameError){.span = patch->span};
        snprintf(error->text, sizeof error->text,
                 "out-of-range: patch %s: its thickness is %g now: it has to be greater than 0; hide it where there is "
                 "to be none",
                 patch->name, values[leaf->thickness]);
        return false;
    }
    return true;
}

bool scene_patches_to(ScnScene *scene, double time, double *values, FrameError *error)
{
    const Plan *plan = scene->package->plan;
    Failure failure = {""};
    if (!plan->patch_count) return true;
    if (!scene->patches && !make(scene, &failure)) {
        *error = (FrameError){.world = true};
        snprintf(error->text, sizeof error->text, "%.200s", failure.text);
        scene_patches_free(scene);
        return false;
    }
    ScenePatches *patches = scene->patches;
    size_t inputs = plan->input_count * sizeof *patches->inputs;
    bool same =
        patches->solved && patches->time == time && (!inputs || !memcmp(patches->inputs, scene->inputs, inputs));
    patches->solved = false;
    int damaged = 0;
    if (!same) {
        patches->number++;
        if (!patch_solves_to(patches->solves, patches->count, time, scene->inputs, error)) return false;
    }
    for (uint32_t k = 0; k < patches->count; k++) {
        if (!same) {
            if (patch_solve_damaged(patches->solves[k])) scene->stats.damage = patch_solve_damage(patches->solves[k]);
            damaged += patch_solve_damaged(patches->solves[k]);
            PatchShape shape = patch_solve_shape(patches->solves[k]);
            patch_cells_fill(patches->cells[k], shape.x, shape.edges, shape.tangents);
        }
        note_box(patches->cells[k], patches->number, values + plan->patches[k].box);
    }
    if (!same) scene->stats.damaged_checkpoints = damaged;
    if (!check_solids(plan, patches, values, error) || !check_thickness(plan, values, error)) return false;
    if (inputs) memcpy(patches->inputs, scene->inputs, inputs);
    patches->time = time;
    patches->solved = true;
    return true;
}

const PatchCells *const *scene_patches_cells(const ScnScene *scene)
{
    return scene->patches ? (const PatchCells *const *)scene->patches->cells : NULL;
}

const PatchCells *const *scene_patches_copy(const ScnScene *scene)
{
    const ScenePatches *patches = scene->patches;
    if (!patches) return NULL;
    PatchCells **copy = calloc(patches->count, sizeof *copy);
    for (uint32_t k = 0; copy && k < patches->count; k++) {
        const PatchCells *from = patches->cells[k];
        copy[k] = patch_cells_new(from->nodes);
        if (!copy[k]) continue; // is taken for flat
        memcpy(copy[k]->points, from->points, (size_t)from->count * (size_t)from->count * 48 * sizeof *from->points);
    }
    return (const PatchCells *const *)copy;
}

void patches_copy_free(const PatchCells *const *copy, uint32_t count)
{
    for (uint32_t k = 0; copy && k < count; k++) patch_cells_free((PatchCells *)(uintptr_t)copy[k]);
    free((void *)(uintptr_t)copy);
}
