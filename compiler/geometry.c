#include "compiler/geometry.h"

#include <math.h>
#include <string.h>

#include "compiler/bounds.h"
#include "compiler/frame.h"
#include "compiler/leaf.h"
#include "compiler/pairs.h"
#include "compiler/quadric.h"

// --- quadrics

static void warn_of_quadric(Unit *unit, Span span, const double q[10])
{
    double size = 0;
    bool constant = true;
    for (int k = 0; k < 10; k++) size = fmax(size, fabs(q[k]));
    for (int k = 0; k < 9; k++) constant &= q[k] == 0;
    if (constant) {
        diag(unit, span, DIAG_DEGENERATE_QUADRIC,
             "this quadric is the constant %g: give it a coefficient at x, y or z, or leave it out", q[9]);
    } else if (quadric_peak(q) < -1e-9 * size) {
        diag(unit, span, DIAG_EMPTY_QUADRIC,
             "this quadric is negative everywhere, so it is empty: is A44 = %g of the wrong sign?", q[9]);
    }
}

// Quadrics that perturbations add to may well be empty on their own: blobs are made so.
void warn_of_quadrics(Unit *unit, const Ir *ir)
{
    Arena scratch = {0};
    bool *shown = arena_array(&scratch, bool, ir->count); // reached without a deformation in between
    shown[ir->root] = true;
    for (IrId id = ir->root; id > 0; id--) {
        const IrNode *node = ir_at(ir, id);
        double q[10];
        if (!shown[id] || node->op == OP_FREEFORM || node->op == OP_DEFORM) continue;
        if (leaf_const_quadric(ir, id, q)) warn_of_quadric(unit, node->span, q);
        for (uint32_t k = 0; k < node->count; k++) {
            IrId operand = ir_operand(ir, id, k);
            if (ir_at(ir, operand)->type == IR_FIELD) shown[operand] = true;
        }
    }
    arena_release(&scratch);
}

// --- perturbations

// F is negative wherever Q > 0, and stays so with s Q^3 added. By the S-lemma: if F + w Q <= 0 everywhere for some w
// >= 0, then F <= -w Q, and F + s Q^3 <= Q (s Q^2 - w), which is not positive where w >= s peak(Q)^2.
static bool stays_negative(const double f[10], const double q[10], double strength, double peak)
{
    double least = strength > 0 ? strength * peak * peak : 0;
    double size_f = 0, size_q = 0;
    for (int k = 0; k < 10; k++) {
        size_f = fmax(size_f, fabs(f[k]));
        size_q = fmax(size_q, fabs(q[k]));
    }
    if (quadric_sum_not_positive(f, least, q)) return true;
    for (int step = -8; step <= 8; step++) {
        double w = ldexp(size_f / size_q, step);
        if (w >= least && isfinite(w) && quadric_sum_not_positive(f, w, q)) return true;
    }
    return false;
}

// A few points of the support tell most often that F has both signs in it.
static bool plainly_crosses(const double f[10], const double q[10], const Bounds *support)
{
    bool inside = false, outside = false;
    for (int k = 0; k < 7; k++) {
        double p[3];
        for (int i = 0; i < 3; i++) p[i] = (support->low[i] + support->high[i]) / 2;
        if (k > 0) {
            int axis = (k - 1) / 2;
            p[axis] += (k % 2 ? 0.45 : -0.45) * (support->high[axis] - support->low[axis]);
        }
        if (!(quadric_at(q, p) > 0)) continue;
        double value = quadric_at(f, p);
        inside |= value >= 0;
        outside |= value <= 0;
    }
    return inside && outside;
}

// Whether the perturbation may well change something, by a quick look; else misses() decides.
static bool plainly_useful(const double f[10], const double q[10])
{
    Bounds support = bounds_of_quadric(q);
    if (bounds_empty(&support)) return false;
    return !bounds_finite(&support) || plainly_crosses(f, q, &support);
}

static bool misses(const double f[10], const double q[10], double strength)
{
    double peak = quadric_peak(q), negative[10];
    if (peak <= 0) return true;
    if (!isfinite(peak)) return false;
    for (int k = 0; k < 10; k++) negative[k] = -f[k];
    return stays_negative(f, q, strength, peak) || stays_negative(negative, q, -strength, peak);
}

// A perturbation of a composed object reaches many leaves, and one place in the text may make many: it is reported
// where all of them are in vain. So that a scene of many of both takes no time, they are looked at quickly first, and
// thoroughly as long as there is work left; what then was not looked at is taken for useful.
enum { WORK = 2000000, THOROUGH_WORK = 60 };

typedef struct Perturbations {
    const Plan *plan;
    const double *values;
    const bool *computed;
    Pairs places;       // spans
    uint32_t *place_of; // of each perturbation
    bool *useful;       // by place
    int64_t work;
} Perturbations;

static bool moves(const Perturbations *p, Slot first, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) {
        if (p->computed[first + k]) return true;
    }
    return false;
}

// What is perturbed, seen from where the perturbations are.
typedef struct Perturbed {
    double f[10];
    bool moves;
    uint32_t begin, count; // perturbations
} Perturbed;

// Another one that reaches into the support might bring the surface there.
static bool is_alone(Perturbations *p, const Perturbed *of, uint32_t index)
{
    Bounds support = bounds_of_quadric(p->values + p->plan->perturbations[index].quadric);
    p->work -= of->count;
    for (uint32_t k = of->begin; k < of->begin + of->count; k++) {
        const PlanPerturbation *other = &p->plan->perturbations[k];
        if (k == index) continue;
        Bounds box = bounds_of_quadric(p->values + other->quadric);
        if (moves(p, other->quadric, 10) || bounds_meet(&support, &box)) return false;
    }
    return true;
}

static bool is_useful(Perturbations *p, const Perturbed *of, uint32_t index, bool thorough)
{
    const PlanPerturbation *perturbation = &p->plan->perturbations[index];
    const double *q = p->values + perturbation->quadric;
    p->work -= thorough ? THOROUGH_WORK : 1;
    if (p->work < 0) return true;
    if (thorough) return !misses(of->f, q, p->values[perturbation->strength]) || !is_alone(p, of, index);
    bool moving = of->moves || moves(p, perturbation->quadric, 10) || moves(p, perturbation->strength, 1);
    return moving || plainly_useful(of->f, q);
}

static void look_at(Perturbations *p, const Perturbed *of, bool thorough)
{
    for (uint32_t n = of->begin; n < of->begin + of->count; n++) {
        bool *useful = &p->useful[p->place_of[n]];
        if (!*useful) *useful = is_useful(p, of, n, thorough);
    }
}

static void look_at_copy(Perturbations *p, const PlanLeaf *leaf, const PlanCopy *copy, bool thorough)
{
    const PlanCluster *cluster = &p->plan->clusters[copy->cluster];
    Perturbed of = {.begin = cluster->begin, .count = cluster->count};
    of.moves = moves(p, leaf->quadric, 10) || moves(p, copy->matrix, 12) || moves(p, copy->strength, 1);
    if (!quadric_transform(p->values + leaf->quadric, p->values + copy->matrix, of.f)) of.moves = true;
    look_at(p, &of, thorough);
}

static void look_at_perturbations(Perturbations *p, bool thorough)
{
    for (uint32_t k = 0; k < p->plan->leaf_count; k++) {
        const PlanLeaf *leaf = &p->plan->leaves[k];
        if (leaf->kind != LEAF_FREEFORM) continue;
        Perturbed own = {.moves = moves(p, leaf->quadric, 10), .begin = leaf->begin, .count = leaf->count};
        memcpy(own.f, p->values + leaf->quadric, sizeof own.f);
        look_at(p, &own, thorough);
        for (uint32_t n = leaf->copies; n < leaf->copies + leaf->copy_count; n++)
            look_at_copy(p, leaf, &p->plan->copies[n], thorough);
    }
}

static void warn_of_perturbations(Unit *unit, const Plan *plan, const PlanOrigins *origins, const double *values,
                                  Arena *scratch)
{
    Perturbations p = {.plan = plan, .values = values, .places = pairs_new(scratch), .work = WORK};
    p.computed = plan_computed(plan, scratch);
    p.place_of = arena_array(scratch, uint32_t, plan->perturbation_count);
    for (uint32_t n = 0; n < plan->perturbation_count; n++) {
        Span span = origins->perturbations[n];
        p.place_of[n] = pairs_index(&p.places, span.begin, span.end, NULL);
    }
    p.useful = arena_array(scratch, bool, p.places.count);
    look_at_perturbations(&p, false);
    look_at_perturbations(&p, true);
    for (uint32_t place = 1; place < p.places.count; place++) {
        Span span = {p.places.list[place].a, p.places.list[place].b};
        if (p.useful[place] || !span.end) continue;
        diag(unit, span, DIAG_PERTURBATION_MISSES,
             "this perturbation is zero wherever the surface is: move its quadric to the surface, or make it larger");
    }
}

// --- the scene

static bool nothing_moves(const Plan *plan, Arena *scratch)
{
    const bool *computed = plan_computed(plan, scratch);
    for (uint32_t k = 0; k < plan->leaf_count; k++) {
        const PlanLeaf *leaf = &plan->leaves[k];
        if (leaf->kind == LEAF_GROUP) continue;
        if (leaf->shown != NO_SLOT && computed[leaf->shown]) return false;
        if (leaf->kind == LEAF_FIELD) return false; // its numbers may move
        for (uint32_t q = 0; q < 10; q++) {
            if (computed[leaf->quadric + q]) return false;
        }
    }
    for (uint32_t k = 0; k < plan->copy_count; k++) {
        if (computed[plan->copies[k].strength] || computed[plan->copies[k].matrix]) return false;
    }
    for (uint32_t k = 0; k < plan->perturbation_count; k++) {
        const PlanPerturbation *p = &plan->perturbations[k];
        if (computed[p->strength]) return false;
        for (uint32_t q = 0; q < 10; q++) {
            if (computed[p->quadric + q]) return false;
        }
    }
    return true;
}

static bool was_said(const Unit *unit, DiagCode code)
{
    for (const Diag *d = unit->diagnostics.first; d; d = d->next) {
        if (d->code == code) return true;
    }
    return false;
}

static void warn_of_emptiness(Unit *unit, const Ir *ir, const Plan *plan, const double *values, Arena *scratch)
{
    if (was_said(unit, DIAG_EMPTY_SCENE) || was_said(unit, DIAG_EMPTY_QUADRIC)) return; // one mistake is one message
    Span span = ir_at(ir, ir->root)->span;
    if (!plan->groups[0].component_count) {
        if (!plan->patch_count)
            diag(unit, span, DIAG_EMPTY_SCENE,
                 "the scene shows nothing: write an object as a value, or scene { name; }");
        return;
    }
    Bounds box = bounds_of_plan(plan, values);
    if (bounds_empty(&box) && nothing_moves(plan, scratch)) {
        diag(unit, span, DIAG_EMPTY_SCENE, "what the scene shows is empty: its parts have no point in common");
    }
}

enum { CAMERA_AUTOMATIC = 14 };

static void warn_of_camera(Unit *unit, const Ir *ir, const Plan *plan, const double *values)
{
    const double *camera = values + plan->camera;
    uint32_t leaf = UINT32_MAX;
    if (plan->orthographic || camera[CAMERA_AUTOMATIC] != 0) return;
    if (!(plan_field(plan, values, camera, &leaf) > 0)) return;
    const char *name = leaf == UINT32_MAX ? "" : plan->objects[plan->leaves[leaf].object].name;
    diag(unit, ir_at(ir, ir->camera)->span, DIAG_CAMERA_HIDDEN, "the eye of the camera is inside of %s: move it out",
         *name ? name : "an object");
}

void warn_of_geometry(Unit *unit, const Ir *ir, const Plan *plan, const PlanOrigins *origins)
{
    Arena scratch = {0};
    FrameError error;
    double *values = arena_array(&scratch, double, plan->slot_count);
    if (frame_evaluate(plan, &(FrameInput){0}, values, &error)) {
        warn_of_perturbations(unit, plan, origins, values, &scratch);
        warn_of_emptiness(unit, ir, plan, values, &scratch);
        warn_of_camera(unit, ir, plan, values);
    }
    arena_release(&scratch);
}
