// Two shapes are kept, of the last step and of the one before, since what is shown lies between them.
#include "runtime/patch_scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/patch_batch.h"
#include "runtime/patch_cache.h"
#include "runtime/patch_cells.h"
#include "runtime/patch_device.h"
#include "runtime/patch_diagnose.h"
#include "runtime/patch_drive.h"
#include "runtime/patch_host.h"

#define STEP_SLACK 1e-6 // of a step, by which a time may miss the end of one

struct PatchSolve {
    const PlanPatch *patch;
    PatchSolveDesc desc;
    PatchDriver *driver;
    PatchHost *host;     // of the direct and the iterative method
    PatchBatch *batch;   // of the device's method; `device` is its patches, and this one `member` of them
    PatchDevice *device; // NULL: not opened
    int member;
    int ahead; // steps that are prepared and not done yet
    bool started;
    double *inputs;
    double time, before_time, asked; // of the last step, of the one before; what was asked for last
    uint64_t steps;
    bool behind;  // `now` is not yet read from the device
    bool settled; // a step was done with these inputs: the device has the model, edges and forces
    double *memory;
    double *now[3], *before[3], *shown[3]; // over nodes
    PatchEdges *edges_now, *edges_before, *edges_shown;
    PatchModel set; // the model that the solver has
    PatchPin *set_pins;
    PatchCells *cells; // of what is shown
    bool cells_filled;
    PatchCache *cache; // of these inputs; NULL: not made, or handles have moved on the way
    int damaged;
    char damage[FILE_PATH_SIZE + 200]; // what is wrong with the last of them
    bool stored;                       // a checkpoint, since the folder was tidied
};

static size_t nodes_of(const PatchSolve *solve)
{
    return (size_t)solve->patch->nodes * solve->patch->nodes;
}

static bool trouble(const PatchSolve *solve, FrameError *error, DiagCode code, const char *text)
{
    const char *name = solve->patch->name;
    *error = (FrameError){.span = solve->patch->span, .code = code};
    snprintf(error->text, sizeof error->text, "patch%s%.24s: %.190s", *name ? " " : "", name, text);
    return false;
}

bool patch_method_named(const char *name, PatchMethod *method)
{
    static const char *const names[] = {
        [PATCH_METHOD_DIRECT] = "direct", [PATCH_METHOD_DEVICE] = "device", [PATCH_METHOD_ITERATIVE] = "gauss-seidel"};
    for (int k = 0; k < 3; k++) {
        if (strcmp(name, names[k])) continue;
        *method = (PatchMethod)k;
        return true;
    }
    return false;
}

// --- making

void patch_solve_free(PatchSolve *solve)
{
    if (!solve) return;
    patch_driver_free(solve->driver);
    patch_host_free(solve->host);
    patch_batch_leave(solve->batch);
    patch_edges_free(solve->edges_now);
    patch_edges_free(solve->edges_before);
    patch_edges_free(solve->edges_shown);
    patch_cells_free(solve->cells);
    patch_cache_free(solve->cache);
    free(solve->inputs);
    free(solve->set_pins);
    free(solve->memory);
    free(solve);
}

// Whether the device knows all that acts on the patch.
static bool device_knows(const PlanPatch *patch, const PatchDriver *driver)
{
    int pins = 0;
    for (uint32_t k = 0; k < patch->part_count; k++) {
        const PlanPart *part = &patch->parts[k];
        PatchSolid solid;
        pins += part->kind == PART_PIN;
        if (part->kind == PART_CONTACT && !patch_driver_solid(driver, part, &solid)) return false;
    }
    return pins <= PATCH_MAX_PINS;
}

PatchSolve *patch_solve_new(const PlanPatch *patch, const PatchSolveDesc *desc, Failure *failure)
{
    PatchSolve *solve = calloc(1, sizeof *solve);
    if (!solve) {
        fail(failure, "out of memory for a patch");
        return NULL;
    }
    int nodes = (int)patch->nodes;
    solve->patch = patch;
    solve->desc = *desc;
    solve->driver = patch_driver_new(patch, desc->fps);
    solve->inputs = calloc(patch->program->input_count + 1, sizeof *solve->inputs);
    solve->set_pins = calloc(patch->part_count + 1, sizeof *solve->set_pins);
    solve->memory = calloc(9 * nodes_of(solve), sizeof *solve->memory);
    solve->edges_now = patch_edges_new(nodes);
    solve->edges_before = patch_edges_new(nodes);
    solve->edges_shown = patch_edges_new(nodes);
    if (!solve->driver || !solve->inputs || !solve->set_pins || !solve->memory || !solve->edges_now ||
        !solve->edges_before || !solve->edges_shown) {
        fail(failure, "out of memory for a patch of %d nodes a side", nodes);
        patch_solve_free(solve);
        return NULL;
    }
    if (desc->method == PATCH_METHOD_DEVICE && desc->anyway && !device_knows(patch, solve->driver))
        solve->desc.method = PATCH_METHOD_DIRECT;
    for (int c = 0; c < 3; c++) {
        solve->now[c] = solve->memory + (size_t)c * nodes_of(solve);
        solve->before[c] = solve->memory + (size_t)(3 + c) * nodes_of(solve);
        solve->shown[c] = solve->memory + (size_t)(6 + c) * nodes_of(solve);
    }
    return solve;
}

// --- the solver

static const double *const *places(double *const x[3])
{
    return (const double *const *)x;
}

static bool device_trouble(PatchSolve *solve, const Failure *failure, FrameError *error)
{
    trouble(solve, error, DIAG_PATCH_DIVERGES, failure->text);
    error->world = true;
    return false;
}

static PatchBatch *batch_for(const PlanPatch *patch)
{
    return patch_batch_new((int)patch->nodes, patch->accurate ? PATCH_ACCURATE : PATCH_PLAIN);
}

static bool open_device(PatchSolve *solve, FrameError *error)
{
    Failure failure = {""};
    if (solve->device) return true;
    if (!solve->batch && (solve->batch = batch_for(solve->patch))) solve->member = patch_batch_join(solve->batch);
    if (!solve->batch || !patch_batch_open(solve->batch, solve->desc.device, solve->desc.cached, &failure))
        return device_trouble(solve, solve->batch ? &failure : &(Failure){"out of memory"}, error);
    solve->device = solve->batch->patches;
    return true;
}

// Gives the solver the driver's model, where it is another. What refuses it says why.
static bool set_model(PatchSolve *solve, FrameError *error)
{
    const PatchModel *model = &solve->driver->model;
    Failure failure = {""};
    if (solve->set.nodes && patch_model_same(model, &solve->set)) return true;
    bool ok;
    if (solve->desc.method == PATCH_METHOD_DEVICE) {
        if (!open_device(solve, error)) return false;
        ok = patch_device_model(solve->device, solve->member, model, &failure);
    } else if (solve->host) {
        ok = patch_host_model(solve->host, model, &failure);
    } else {
        bool direct = solve->desc.method == PATCH_METHOD_DIRECT;
        solve->host = patch_host_new(model, direct ? PATCH_DIRECT : PATCH_GAUSS_SEIDEL, &failure);
        ok = solve->host != NULL;
        if (ok && solve->desc.sweeps) solve->host->sweep_limit = solve->desc.sweeps;
    }
    if (!ok) return trouble(solve, error, DIAG_PATCH_ILL_POSED, failure.text);
    solve->set = *model;
    if (model->pin_count) memcpy(solve->set_pins, model->pins, (size_t)model->pin_count * sizeof *model->pins);
    solve->set.pins = solve->set_pins;
    return true;
}

static bool tell_solids(PatchSolve *solve, Failure *failure)
{
    const PlanPatch *patch = solve->patch;
    for (uint32_t k = 0; k < patch->part_count; k++) {
        PatchSolid solid;
        if (patch->parts[k].kind != PART_CONTACT) continue;
        if (!patch_driver_solid(solve->driver, &patch->parts[k], &solid))
            return fail(failure, "the device knows contacts with quadrics only: solve it with --solver direct");
        if (!patch_batch_touch(solve->batch, solve->member, &solid, failure)) return false;
    }
    return true;
}

// Tells the device one step, which is done with those of the others.
static bool device_step(PatchSolve *solve, FrameError *error)
{
    PatchDriver *driver = solve->driver;
    const double *force[3];
    Failure failure = {""};
    for (int c = 0; c < 3; c++) force[c] = driver->has_force[c] ? driver->force[c] : NULL;
    bool edges = !driver->edges_known || !solve->settled;
    bool ok = (!edges || patch_device_edges(solve->device, solve->member, driver->edges, &failure)) &&
              patch_device_force(solve->device, solve->member, force, &failure) && tell_solids(solve, &failure);
    if (!ok) return device_trouble(solve, &failure, error);
    patch_batch_will_step(solve->batch, solve->member, 1);
    return true;
}

// Places as they are now, from the device where they are behind. False if the patch has diverged on the way, too.
static bool catch_up(PatchSolve *solve, FrameError *error)
{
    Failure failure = {""};
    PatchFault fault;
    if (!solve->behind) return true;
    if (!patch_device_read(solve->device, solve->member, solve->now, NULL, &fault, &failure))
        return device_trouble(solve, &failure, error);
    solve->behind = false;
    return fault.kind == PATCH_FINE || trouble(solve, error, DIAG_PATCH_DIVERGES, fault.text);
}

static bool host_step(PatchSolve *solve, FrameError *error)
{
    PatchDriver *driver = solve->driver;
    PatchDrive drive = {.edges = driver->edges};
    PatchFault fault;
    for (int c = 0; c < 3; c++) drive.force[c] = driver->has_force[c] ? driver->force[c] : NULL;
    if (driver->has_contact) {
        drive.contact = patch_driver_contact;
        drive.context = driver;
    }
    if (!patch_host_step(solve->host, &drive, &fault)) return trouble(solve, error, DIAG_PATCH_DIVERGES, fault.text);
    for (int c = 0; c < 3; c++) memcpy(solve->now[c], solve->host->x[c], nodes_of(solve) * sizeof(double));
    return true;
}

// --- start and steps

static bool start(PatchSolve *solve, const double *inputs, FrameError *error)
{
    PatchDriver *driver = solve->driver;
    solve->started = false;
    solve->set.nodes = 0;
    driver->edges_known = false;
    if (inputs != solve->inputs) memcpy(solve->inputs, inputs, solve->patch->program->input_count * sizeof *inputs);
    if (!patch_driver_at(driver, 0, solve->inputs, error) || !patch_driver_edges(driver, NULL, error) ||
        !patch_driver_start(driver, solve->now, error) || !set_model(solve, error))
        return false;
    Failure failure = {""};
    if (solve->device) {
        if (!patch_device_start(solve->device, solve->member, driver->edges, places(solve->now), NULL, &failure))
            return device_trouble(solve, &failure, error);
    } else {
        patch_host_start(solve->host, driver->edges, places(solve->now), NULL);
        for (int c = 0; c < 3; c++) memcpy(solve->now[c], solve->host->x[c], nodes_of(solve) * sizeof(double));
    }
    patch_edges_copy(solve->edges_now, driver->edges);
    solve->time = solve->before_time = 0;
    solve->steps = 0;
    solve->started = true;
    solve->behind = solve->device != NULL; // pins may have moved nodes
    solve->settled = false;
    patch_cache_free(solve->cache);
    solve->cache = NULL;
    bool kept = solve->desc.cached || solve->desc.checkpoints;
    if (!kept || solve->desc.method == PATCH_METHOD_ITERATIVE) return true;
    char solver[PATCH_SOLVER_KEY];
    if (solve->device)
        patch_device_key(solve->device, solver);
    else
        patch_host_key(solver);
    solve->cache = patch_cache_new(solve->patch, inputs, solver, solve->desc.checkpoints);
    return true;
}

static double solver_time(const PatchSolve *solve)
{
    return solve->device ? patch_device_time(solve->device, solve->member) : solve->host->time;
}

// Whether the places of the nodes are asked for before each step.
static bool wants_places(const PlanPatch *patch)
{
    bool wants = patch->force.placed || patch->edges.placed;
    for (uint32_t k = 0; k < patch->part_count; k++) wants |= patch->parts[k].kind == PART_PRESS;
    return wants;
}

// Prepares a step. `target` is the time that is to be reached: the last step before it is one of two that are shown.
static bool prepare_step(PatchSolve *solve, double target, FrameError *error)
{
    PatchDriver *driver = solve->driver;
    const double *inputs = solve->inputs;
    if (!patch_driver_at(driver, solve->time, inputs, error)) return false;
    double end = solve->time + driver->model.step;
    PatchModel model = driver->model;
    bool last = !(end < target - STEP_SLACK * model.step);
    if ((last || wants_places(solve->patch)) && !catch_up(solve, error)) return false;
    if (model.scheme == PATCH_NEWMARK && !patch_driver_at(driver, solve->time + model.step / 2, inputs, error))
        return false;
    if (!patch_driver_force(driver, places(solve->now), error)) return false;
    memcpy(model.force, driver->model.force, sizeof model.force);
    // Edges, pins and what the patch touches are those of the end of the step.
    if (!patch_driver_at(driver, end, inputs, error) || !patch_driver_edges(driver, places(solve->now), error))
        return false;
    model.pins = driver->model.pins;
    model.pin_count = driver->model.pin_count;
    driver->model = model;
    if (!set_model(solve, error)) return false;
    for (int c = 0; c < 3 && !solve->behind; c++)
        memcpy(solve->before[c], solve->now[c], nodes_of(solve) * sizeof(double));
    patch_edges_copy(solve->edges_before, solve->edges_now);
    solve->before_time = solve->time;
    if (!(solve->device ? device_step(solve, error) : host_step(solve, error))) return false;
    solve->ahead = 1;
    return true;
}

// Whether nothing of the equation changes on the way, so that many steps are one launch.
static bool is_steady(const PlanPatch *patch)
{
    for (uint32_t k = 0; k < patch->part_count; k++)
        if (patch->parts[k].kind == PART_CONTACT) return false;
    return !patch->varies && !patch->force.varies && !patch->edges.varies && !wants_places(patch);
}

// Prepares as many steps in one launch as there are up to the last ones before `target`, or to a checkpoint. False where
// that is none.
static bool prepare_leap(PatchSolve *solve, double target)
{
    if (!solve->device || !solve->settled || !is_steady(solve->patch)) return false;
    double ahead = (target - solve->time) / solve->set.step - 2;
    if (!(ahead >= 2) || !(ahead < 1e9)) return false;
    uint64_t count = (uint64_t)ahead, whole = PATCH_CACHE_STEPS - solve->steps % PATCH_CACHE_STEPS;
    solve->ahead = (int)(count < whole ? count : whole);
    patch_batch_will_step(solve->batch, solve->member, solve->ahead);
    return true;
}

// Takes note of the steps that were done.
static void finish_steps(PatchSolve *solve)
{
    if (solve->ahead == 1) {
        patch_edges_copy(solve->edges_now, solve->driver->edges);
        solve->driver->edges_known = !solve->patch->edges.varies;
        solve->settled = true;
    } else {
        solve->before_time = solve->time + (double)(solve->ahead - 1) * solve->set.step;
    }
    solve->steps += (uint64_t)solve->ahead;
    solve->ahead = 0;
    solve->behind = solve->device != NULL;
    solve->time = solver_time(solve);
}

// --- checkpoints: the time of the step before, then the solver's own

static size_t save(PatchSolve *solve, void *bytes, size_t capacity, Failure *failure)
{
    if (solve->device) return patch_device_save(solve->device, solve->member, bytes, capacity, failure);
    return patch_host_save(solve->host, bytes, capacity);
}

// Places, steps and time are those of the solver.
static bool restore(PatchSolve *solve, const void *bytes, size_t size, Failure *failure)
{
    if (solve->device) {
        if (!patch_device_restore(solve->device, solve->member, bytes, size, failure)) return false;
        solve->steps = patch_device_steps(solve->device, solve->member);
    } else {
        if (!patch_host_restore(solve->host, bytes, size, failure)) return false;
        for (int c = 0; c < 3; c++) memcpy(solve->now[c], solve->host->x[c], nodes_of(solve) * sizeof(double));
        solve->steps = solve->host->steps;
    }
    solve->behind = solve->device != NULL;
    solve->settled = false;
    solve->time = solve->before_time = solver_time(solve);
    return true;
}

static void keep(PatchSolve *solve)
{
    if (!solve->cache || solve->steps % PATCH_CACHE_STEPS) return;
    Failure failure;
    FrameError error;
    if (!catch_up(solve, &error)) { // which is told when the shape is asked for
        solve->behind = true;
        return;
    }
    size_t size = save(solve, NULL, 0, &failure), lead = sizeof solve->before_time;
    uint8_t *bytes = size ? malloc(lead + size) : NULL;
    if (!bytes) return;
    memcpy(bytes, &solve->before_time, lead);
    if (save(solve, bytes + lead, size, &failure)) {
        patch_cache_store(solve->cache, solve->steps, bytes, lead + size);
        solve->stored = true;
    }
    free(bytes);
}

// Goes to a checkpoint. The solver gets the model that it had then, since it counts time from where its step changed.
static bool go_to(PatchSolve *solve, const FileBytes *file, uint64_t steps, double time, Failure *failure)
{
    double before;
    FrameError error;
    size_t lead = sizeof before;
    if (file->size < lead) return fail(failure, "it is too short");
    memcpy(&before, file->bytes, lead);
    if (!(before >= 0 && before <= time)) return fail(failure, "its time is not that of its steps");
    if (!patch_driver_at(solve->driver, before, solve->inputs, &error) ||
        !patch_driver_edges(solve->driver, places(solve->now), &error) || !set_model(solve, &error))
        return fail(failure, "the patch cannot be set to it: %s", error.text);
    if (!restore(solve, file->bytes + lead, file->size - lead, failure)) return false;
    solve->started = solve->steps == steps && solve->time > before && solve->time <= time;
    if (!solve->started) return fail(failure, "its time is not that of its steps");
    patch_edges_copy(solve->edges_now, solve->device ? patch_device_edges_now(solve->device, solve->member)
                                                     : patch_host_edges(solve->host));
    patch_edges_copy(solve->edges_before, solve->edges_now);
    solve->driver->edges_known = false;
    return true;
}

// Jumps to the last checkpoint before a time, where there is one ahead. False where the patch cannot be started again
// after a damaged one.
static bool jump(PatchSolve *solve, double time, FrameError *error)
{
    double ahead = (time - solve->time) / solve->driver->model.step;
    if (!solve->cache || !(ahead > PATCH_CACHE_STEPS) || !(ahead < 1e9)) return true;
    uint64_t most = solve->steps + (uint64_t)ahead, found;
    FileBytes file;
    while (patch_cache_load(solve->cache, solve->steps, most, &found, &file)) {
        Failure failure = {""};
        char path[FILE_PATH_SIZE];
        bool good = go_to(solve, &file, found, time, &failure);
        bytes_close(&file);
        if (good) return true;
        solve->damaged++;
        patch_cache_path(solve->cache, found, path);
        patch_cache_drop(solve->cache, found);
        snprintf(solve->damage, sizeof solve->damage, "%s: %.190s", path, failure.text);
        if (!start(solve, solve->inputs, error)) return false;
        most = found - 1;
    }
    return true;
}

int patch_solve_damaged(const PatchSolve *solve)
{
    return solve->damaged;
}

const char *patch_solve_damage(const PatchSolve *solve)
{
    return solve->damage;
}

static void show(PatchSolve *solve, double time)
{
    double length = solve->time - solve->before_time;
    double fraction = length > 0 ? (time - solve->before_time) / length : 1;
    bool whole = fraction >= 1 - STEP_SLACK;
    for (int c = 0; c < 3; c++) {
        const double *now = solve->now[c], *before = solve->before[c];
        for (size_t k = 0; k < nodes_of(solve); k++)
            solve->shown[c][k] = whole ? now[k] : before[k] + fraction * (now[k] - before[k]);
    }
    patch_edges_copy(solve->edges_shown, whole ? solve->edges_now : solve->edges_before);
    if (!whole) patch_edges_mix(solve->edges_shown, solve->edges_now, fraction);
    solve->cells_filled = false;
}

// Makes ready to go on to a time: from where the patch is, from its start, or from a checkpoint.
static bool set_out(PatchSolve *solve, double time, const double *inputs, FrameError *error)
{
    uint32_t count = solve->patch->program->input_count;
    bool moved = solve->started && count && memcmp(solve->inputs, inputs, count * sizeof *inputs);
    bool back = solve->started && time < solve->before_time - STEP_SLACK * (solve->time - solve->before_time);
    if (!solve->started || back || (moved && time <= solve->asked)) {
        if (!start(solve, inputs, error)) return false;
    } else if (moved) {
        memcpy(solve->inputs, inputs, count * sizeof *inputs);
        solve->driver->edges_known = solve->settled = false;
        patch_cache_free(solve->cache);
        solve->cache = NULL;
    }
    return jump(solve, time, error);
}

// One round: a step, or a leap, of each patch that is not there yet. `left` is whether there was one.
static bool do_round(PatchSolve *const *solves, uint32_t count, double time, bool *left, FrameError *error)
{
    *left = false;
    for (uint32_t k = 0; k < count; k++) {
        PatchSolve *solve = solves[k];
        if (!(solve->time < time - STEP_SLACK * solve->driver->model.step)) continue;
        if (!prepare_leap(solve, time) && !prepare_step(solve, time, error)) return false;
        *left = true;
    }
    for (uint32_t k = 0; k < count; k++) {
        Failure failure = {""};
        PatchBatch *batch = solves[k]->batch;
        if (batch && batch->waiting && !patch_batch_launch(batch, &failure))
            return device_trouble(solves[k], &failure, error);
    }
    for (uint32_t k = 0; k < count; k++) {
        if (!solves[k]->ahead) continue;
        finish_steps(solves[k]);
        keep(solves[k]);
    }
    return true;
}

static bool go_on(PatchSolve *const *solves, uint32_t count, double time, const double *inputs, FrameError *error)
{
    for (uint32_t k = 0; k < count; k++)
        if (!set_out(solves[k], time, inputs, error)) return false;
    for (bool left = true; left;)
        if (!do_round(solves, count, time, &left, error)) return false;
    for (uint32_t k = 0; k < count; k++)
        if (!catch_up(solves[k], error)) return false;
    return true;
}

// All of them are in one folder.
static void tidy(PatchSolve *const *solves, uint32_t count)
{
    bool tidied = false;
    for (uint32_t k = 0; k < count; k++) {
        if (solves[k]->stored && solves[k]->cache && !tidied) {
            patch_cache_tidy(solves[k]->cache);
            tidied = true;
        }
        solves[k]->stored = false;
    }
}

bool patch_solves_to(PatchSolve *const *solves, uint32_t count, double time, const double *inputs, FrameError *error)
{
    *error = (FrameError){0};
    if (time < 0) time = 0;
    bool ok = go_on(solves, count, time, inputs, error);
    tidy(solves, count);
    for (uint32_t k = 0; k < count; k++) {
        PatchSolve *solve = solves[k];
        if (ok) {
            solve->asked = time;
            show(solve, time);
            continue;
        }
        solve->started = false;
        solve->ahead = 0;
        if (solve->batch) patch_batch_drop(solve->batch);
    }
    return ok;
}

bool patch_solve_to(PatchSolve *solve, double time, const double *inputs, FrameError *error)
{
    return patch_solves_to(&solve, 1, time, inputs, error);
}

void patch_solves_join(PatchSolve *const *solves, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) {
        PatchSolve *solve = solves[k];
        if (solve->desc.method != PATCH_METHOD_DEVICE || solve->batch) continue;
        for (uint32_t l = 0; l < k && !solve->batch; l++) {
            const PatchSolve *other = solves[l];
            bool alike = other->batch && other->patch->nodes == solve->patch->nodes &&
                         other->patch->accurate == solve->patch->accurate &&
                         other->driver->has_contact == solve->driver->has_contact &&
                         is_steady(other->patch) == is_steady(solve->patch);
            if (alike) solve->batch = other->batch;
        }
        if (!solve->batch) solve->batch = batch_for(solve->patch);
        if (solve->batch) solve->member = patch_batch_join(solve->batch); // else it gets one of its own, or says so
    }
}

PatchShape patch_solve_shape(const PatchSolve *solve)
{
    PatchShape shape = {.nodes = (int)solve->patch->nodes,
                        .x = {solve->shown[0], solve->shown[1], solve->shown[2]},
                        .edges = solve->edges_shown,
                        .tangents = solve->patch->all_tangents ? PATCH_TANGENTS_ALL : PATCH_TANGENTS_X3,
                        .time = solve->asked,
                        .steps = solve->steps};
    if (solve->desc.method == PATCH_METHOD_ITERATIVE && solve->host) {
        shape.sweeps = solve->host->sweeps;
        shape.residual = solve->host->residual;
    }
    return shape;
}

bool patch_solve_point(PatchSolve *solve, double u, double v, double place[3])
{
    if (!solve->cells) solve->cells = patch_cells_new((int)solve->patch->nodes);
    if (!solve->cells) return false;
    if (!solve->cells_filled) {
        PatchShape shape = patch_solve_shape(solve);
        patch_cells_fill(solve->cells, shape.x, shape.edges, shape.tangents);
        solve->cells_filled = true;
    }
    for (int c = 0; c < 3; c++) place[c] = patch_cells_at(solve->cells, c, u, v, NULL, NULL);
    return true;
}
