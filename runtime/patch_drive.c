#include "runtime/patch_drive.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/field.h"
#include "compiler/quadric.h"

_Static_assert((int)PATCH_NODES_MIN == PATCH_MIN_NODES && (int)PATCH_NODES_MAX == PATCH_MAX_NODES,
               "the compiler and the solvers agree on what a grid is");

// Where the numbers of OP_PATCH are in PlanPatch.model.
enum {
    MODEL_STEP,
    MODEL_ACCURACY,
    MODEL_STIFFNESS,
    MODEL_DENSITY = 11,
    MODEL_DAMPING,
    MODEL_FORCE,
    MODEL_START = 16,
    MODEL_EDGES = 19
};

static size_t nodes_of(const PatchDriver *driver)
{
    return (size_t)driver->patch->nodes * driver->patch->nodes;
}

void patch_driver_free(PatchDriver *driver)
{
    if (!driver) return;
    patch_edges_free(driver->edges);
    free(driver->values);
    free(driver->pins);
    free(driver->memory);
    free(driver);
}

PatchDriver *patch_driver_new(const PlanPatch *patch, double fps)
{
    PatchDriver *driver = calloc(1, sizeof *driver);
    if (!driver) return NULL;
    driver->patch = patch;
    driver->fps = fps;
    driver->values = calloc(patch->program->slot_count, sizeof *driver->values);
    driver->pins = calloc(patch->part_count + 1, sizeof *driver->pins);
    driver->edges = patch_edges_new((int)patch->nodes);
    driver->memory = calloc(3 * nodes_of(driver), sizeof *driver->memory);
    if (!driver->values || !driver->pins || !driver->edges || !driver->memory) {
        patch_driver_free(driver);
        return NULL;
    }
    for (int c = 0; c < 3; c++) driver->force[c] = driver->memory + (size_t)c * nodes_of(driver);
    for (uint32_t k = 0; k < patch->part_count; k++) driver->has_contact |= patch->parts[k].kind == PART_CONTACT;
    return driver;
}

static double number(const PatchDriver *driver, int at)
{
    return driver->values[driver->patch->model[at]];
}

static const PlanPart *part_at(const PatchDriver *driver, uint32_t k)
{
    return &driver->patch->parts[k];
}

bool patch_driver_at(PatchDriver *driver, double time, const double *inputs, FrameError *error)
{
    const PlanPatch *patch = driver->patch;
    FrameInput input = {.time = time, .frame = floor(time * driver->fps + 1e-6), .inputs = inputs};
    if (!frame_begin(patch->program, &input, driver->values, error)) return false;
    if (!frame_run(patch->program, 0, patch->frame_end, driver->values, error)) return false;
    const PatchPin *pins = driver->model.pins;
    int pin_count = driver->model.pin_count;
    driver->model = (PatchModel){
        .nodes = (int)patch->nodes,
        .step = number(driver, MODEL_STEP),
        .density = number(driver, MODEL_DENSITY),
        .damping = number(driver, MODEL_DAMPING),
        .scheme = patch->newmark ? PATCH_NEWMARK : PATCH_IMPLICIT,
        .closure = patch->accurate ? PATCH_ACCURATE : PATCH_PLAIN,
        .tangents = patch->all_tangents ? PATCH_TANGENTS_ALL : PATCH_TANGENTS_X3,
        .pins = pins,
        .pin_count = pin_count,
        .accuracy = number(driver, MODEL_ACCURACY),
    };
    for (int c = 0; c < 3; c++) {
        int at = MODEL_STIFFNESS + 3 * c;
        driver->model.stiffness[c] =
            (PatchStiffness){number(driver, at), number(driver, at + 1), number(driver, at + 2)};
    }
    return true;
}

// Runs the steps of a run for a node, of which `x` (NULL: flat) gives the place.
static bool run_node(PatchDriver *driver, const PlanRun *run, double u, double v, const double place[3],
                     FrameError *error)
{
    double *point = driver->values + driver->patch->point;
    for (int c = 0; c < 3; c++) point[c] = place[c];
    point[3] = u;
    point[4] = v;
    return frame_run(driver->patch->program, run->begin, run->end, driver->values, error);
}

static void place_of(const double *const x[3], size_t at, double u, double v, double place[3])
{
    place[0] = x ? x[0][at] : u;
    place[1] = x ? x[1][at] : v;
    place[2] = x ? x[2][at] : 0;
}

// --- edges and pins

static void find_pins(PatchDriver *driver)
{
    int count = 0, last = (int)driver->patch->nodes - 1;
    for (uint32_t k = 0; k < driver->patch->part_count; k++) {
        const PlanPart *part = part_at(driver, k);
        if (part->kind != PART_PIN) continue;
        PatchPin *pin = &driver->pins[count++];
        pin->i = (int)lrint(fmin(fmax(driver->values[part->values[0]], 0), 1) * last);
        pin->j = (int)lrint(fmin(fmax(driver->values[part->values[1]], 0), 1) * last);
        for (int c = 0; c < 3; c++) pin->to[c] = driver->values[part->values[2 + c]];
    }
    driver->model.pins = driver->pins;
    driver->model.pin_count = count;
}

bool patch_driver_edges(PatchDriver *driver, const double *const x[3], FrameError *error)
{
    const PlanPatch *patch = driver->patch;
    int nodes = (int)patch->nodes;
    find_pins(driver);
    if (driver->edges_known) return true;
    for (int edge = 0; edge < PATCH_EDGES; edge++)
        for (int k = 0; k < nodes; k++) {
            double along = k / (double)(nodes - 1), end = edge % 2, place[3];
            double u = edge < 2 ? end : along, v = edge < 2 ? along : end;
            int i = edge < 2 ? (nodes - 1) * (edge % 2) : k, j = edge < 2 ? k : (nodes - 1) * (edge % 2);
            place_of(x, (size_t)i * (size_t)nodes + (size_t)j, u, v, place);
            if (!run_node(driver, &patch->edges, u, v, place, error)) return false;
            for (int c = 0; c < 3; c++) {
                driver->edges->position[edge][c][k] = number(driver, MODEL_EDGES + 6 * edge + c);
                driver->edges->tangent[edge][c][k] = number(driver, MODEL_EDGES + 6 * edge + 3 + c);
            }
        }
    return true;
}

// --- forces

typedef struct SurfaceFrame {
    double origin[3], axis[3][3]; // x, y, z
} SurfaceFrame;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double r[3])
{
    for (int k = 0; k < 3; k++) r[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static bool normalize(double v[3])
{
    double length = sqrt(dot(v, v));
    if (!(length > 1e-12)) return false;
    for (int k = 0; k < 3; k++) v[k] /= length;
    return true;
}

// The frame of the bilinear surface through the nodes around (u, v). False where it has no normal.
static bool surface_frame(const double *const x[3], int nodes, double u, double v, SurfaceFrame *frame)
{
    double a = fmin(fmax(u, 0), 1) * (nodes - 1), b = fmin(fmax(v, 0), 1) * (nodes - 1);
    int i = (int)fmin(a, nodes - 2), j = (int)fmin(b, nodes - 2);
    double s = a - i, t = b - j, by_v[3];
    for (int c = 0; c < 3; c++) {
        const double *g = x[c] + (size_t)i * (size_t)nodes + (size_t)j;
        double low = g[0] + t * (g[1] - g[0]), high = g[nodes] + t * (g[nodes + 1] - g[nodes]);
        frame->origin[c] = low + s * (high - low);
        frame->axis[0][c] = high - low;
        by_v[c] = (1 - s) * (g[1] - g[0]) + s * (g[nodes + 1] - g[nodes]);
    }
    if (!normalize(frame->axis[0])) return false;
    cross(frame->axis[0], by_v, frame->axis[2]);
    if (!normalize(frame->axis[2])) return false;
    cross(frame->axis[2], frame->axis[0], frame->axis[1]);
    return true;
}

static FieldCode field_of(const PatchDriver *driver, const PlanPart *part)
{
    const uint32_t *words = driver->patch->program->operands + part->field;
    return (FieldCode){words + 1, words[0]};
}

static void add_press(PatchDriver *driver, const PlanPart *part, const double *const x[3])
{
    const double *values = driver->values;
    double strength = values[part->values[2]];
    SurfaceFrame frame;
    if (!surface_frame(x, (int)driver->patch->nodes, values[part->values[0]], values[part->values[1]], &frame)) return;
    FieldCode code = field_of(driver, part);
    for (size_t k = 0; k < nodes_of(driver); k++) {
        double offset[3] = {x[0][k] - frame.origin[0], x[1][k] - frame.origin[1], x[2][k] - frame.origin[2]};
        double local[3] = {dot(offset, frame.axis[0]), dot(offset, frame.axis[1]), dot(offset, frame.axis[2])};
        double push = strength * field_at(code, values, local).f;
        for (int c = 0; c < 3; c++) driver->force[c][k] += push * frame.axis[2][c];
    }
}

static bool spread_force(PatchDriver *driver, const double *const x[3], FrameError *error)
{
    const PlanPatch *patch = driver->patch;
    int nodes = (int)patch->nodes;
    for (int i = 0; i < nodes; i++)
        for (int j = 0; j < nodes; j++) {
            size_t at = (size_t)i * (size_t)nodes + (size_t)j;
            double u = i / (double)(nodes - 1), v = j / (double)(nodes - 1), place[3];
            place_of(x, at, u, v, place);
            if (!run_node(driver, &patch->force, u, v, place, error)) return false;
            for (int c = 0; c < 3; c++) driver->force[c][at] = number(driver, MODEL_FORCE + c);
        }
    return true;
}

bool patch_driver_force(PatchDriver *driver, const double *const x[3], FrameError *error)
{
    const PlanPatch *patch = driver->patch;
    bool pressed = false;
    for (uint32_t k = 0; k < patch->part_count; k++) pressed |= part_at(driver, k)->kind == PART_PRESS;
    for (int c = 0; c < 3; c++) driver->has_force[c] = patch->force.points || pressed;
    if (!patch->force.points) {
        double place[3] = {0};
        if (!run_node(driver, &patch->force, 0, 0, place, error)) return false;
        for (int c = 0; c < 3; c++) driver->model.force[c] = number(driver, MODEL_FORCE + c);
        if (pressed) memset(driver->memory, 0, 3 * nodes_of(driver) * sizeof *driver->memory);
    } else if (!spread_force(driver, x, error)) {
        return false;
    }
    for (uint32_t k = 0; k < patch->part_count; k++)
        if (part_at(driver, k)->kind == PART_PRESS) add_press(driver, part_at(driver, k), x);
    return true;
}

bool patch_driver_start(PatchDriver *driver, double *const x[3], FrameError *error)
{
    const PlanPatch *patch = driver->patch;
    int nodes = (int)patch->nodes;
    for (int i = 0; i < nodes; i++)
        for (int j = 0; j < nodes; j++) {
            double u = i / (double)(nodes - 1), v = j / (double)(nodes - 1);
            if (!run_node(driver, &patch->start, u, v, (double[3]){u, v, 0}, error)) return false;
            for (int c = 0; c < 3; c++) x[c][(size_t)i * (size_t)nodes + (size_t)j] = number(driver, MODEL_START + c);
        }
    return true;
}

// --- contacts

// The length from a point inside along n to the surface; 0 where there is none within the first 2⁴⁰ lengths.
static double depth_along(FieldCode code, const double *values, const double at[3], const double n[3], double guess)
{
    double low = 0, high = guess > 0 ? guess : 1e-9;
    for (int k = 0;; k++) {
        double p[3] = {at[0] + high * n[0], at[1] + high * n[1], at[2] + high * n[2]};
        if (field_at(code, values, p).f <= 0) break;
        if (k == 40) return 0;
        low = high;
        high *= 2;
    }
    for (int k = 0; k < 60 && high - low > 1e-14 * high; k++) {
        double middle = low + (high - low) / 2;
        double p[3] = {at[0] + middle * n[0], at[1] + middle * n[1], at[2] + middle * n[2]};
        if (field_at(code, values, p).f > 0)
            low = middle;
        else
            high = middle;
    }
    return high;
}

static void push_out(const PatchDriver *driver, const PlanPart *part, const PatchTouch *touch)
{
    FieldCode code = field_of(driver, part);
    double stiffness = driver->values[part->values[0]];
    for (size_t k = 0; k < nodes_of(driver); k++) {
        double at[3] = {touch->x[0][k], touch->x[1][k], touch->x[2][k]};
        FieldValue here = field_at(code, driver->values, at);
        if (!(here.f > 0) || !isfinite(here.f)) continue;
        double n[3] = {-here.gradient[0], -here.gradient[1], -here.gradient[2]}, slope = sqrt(dot(n, n));
        if (!normalize(n)) continue; // in the very middle there is no way that is nearest
        double depth = depth_along(code, driver->values, at, n, here.f / slope);
        for (int c = 0; c < 3; c++) touch->force[c][k] += stiffness * depth * n[c];
        touch->stiffness[k] += stiffness;
    }
}

// A quadric within maps: its code is an ENTER for each of them, the quadric, and as many LEAVE.
bool patch_driver_solid(const PatchDriver *driver, const PlanPart *part, PatchSolid *solid)
{
    FieldCode code = field_of(driver, part);
    uint32_t maps = 0;
    while (2 * maps + 1 < code.count && code.words[2 * maps] == FIELD_ENTER) maps++;
    if (code.count != 3 * maps + 2 || code.words[2 * maps] != FIELD_QUADRIC) return false;
    solid->stiffness = driver->values[part->values[0]];
    memcpy(solid->quadric, driver->values + code.words[2 * maps + 1], sizeof solid->quadric);
    for (uint32_t k = maps; k-- > 0;)
        if (!quadric_transform(solid->quadric, driver->values + code.words[2 * k + 1], solid->quadric)) return false;
    return true;
}

void patch_driver_contact(void *context, const PatchTouch *touch)
{
    const PatchDriver *driver = context;
    for (uint32_t k = 0; k < driver->patch->part_count; k++) {
        const PlanPart *part = part_at(driver, k);
        PatchSolid solid;
        if (part->kind != PART_CONTACT) continue;
        if (patch_driver_solid(driver, part, &solid))
            patch_contact_solids(&(PatchSolids){&solid, 1}, touch);
        else
            push_out(driver, part, touch);
    }
}
