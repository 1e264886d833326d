// A step builds the right side of Eq. 6 from V, as the literature does, and not from two old shapes: their difference
// would lose digits at small steps. Only with a contact is it built for the increment e (header of patch_model.h),
// which is what a contact's stiffness acts on. All three components are solved before any is committed, so a step that
// fails leaves the state alone.
#include "runtime/patch_host.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "runtime/patch_band.h"
#include "runtime/patch_diagnose.h"
#include "runtime/patch_state.h"

#define DEFAULT_SWEEPS       20000
#define DEFAULT_TOLERANCE    1e-10
#define CONTACT_TOLERANCE    1e-13 // of conjugate gradients, in the norm of the preconditioner
#define CONTACT_ITERATIONS   500
#define SWEEPS_BETWEEN_LOOKS 8 // computing the residual costs as much as a sweep

typedef struct Factor {
    PatchBand *band; // NULL: not needed so far
    bool valid;
    PatchStiffness stiffness;
    double mu;
} Factor;

typedef struct PatchHostWork {
    PatchCoefficients coefficients;
    PatchPin *pins;
    Factor factors[3];
    double origin;                             // time at which the present dt began
    uint64_t origin_step;                      // number of the step done then
    PatchEdges *edges, *next, *inside;         // now, at the end of the step, and those of w
    double *w[3];                              // over unknowns, one run: right sides, then solutions
    double *g;                                 // over unknowns: the edges' load
    double *ahead[3], *touch_force[3], *kappa; // over nodes, for contacts
    double *r, *z, *p, *q, *other;             // over unknowns
    double *padded;                            // Gauss–Seidel: unknowns with a frame of two zeros
    double *memory;
} PatchHostWork;

static size_t unknowns_of(const PatchHost *patch)
{
    size_t m = (size_t)patch->model.nodes - 2;
    return m * m;
}

static size_t nodes_of(const PatchHost *patch)
{
    return (size_t)patch->model.nodes * patch->model.nodes;
}

static bool allocate(PatchHost *patch)
{
    size_t n = nodes_of(patch), m = unknowns_of(patch);
    size_t side = (size_t)patch->model.nodes + 2; // the unknowns and the frame of two
    PatchHostWork *work = calloc(1, sizeof *work);
    if (!work) return false;
    patch->work = work;
    work->edges = patch_edges_new(patch->model.nodes);
    work->next = patch_edges_new(patch->model.nodes);
    work->inside = patch_edges_new(patch->model.nodes);
    double *memory = work->memory = calloc(13 * n + 9 * m + side * side, sizeof *memory);
    if (!work->edges || !work->next || !work->inside || !memory) return false;
    for (int c = 0; c < 3; c++) {
        patch->x[c] = memory + (size_t)(4 * c) * n;
        patch->v[c] = patch->x[c] + n;
        work->ahead[c] = patch->v[c] + n;
        work->touch_force[c] = work->ahead[c] + n;
    }
    work->kappa = memory + 12 * n;
    memory += 13 * n;
    for (int c = 0; c < 3; c++) work->w[c] = memory + (size_t)c * m;
    work->g = memory + 3 * m;
    work->r = memory + 4 * m;
    work->z = memory + 5 * m;
    work->p = memory + 6 * m;
    work->q = memory + 7 * m;
    work->other = memory + 8 * m;
    work->padded = memory + 9 * m;
    return true;
}

PatchHost *patch_host_new(const PatchModel *model, PatchSolver solver, Failure *failure)
{
    if (!patch_accept(model, failure)) return NULL;
    PatchHost *patch = calloc(1, sizeof *patch);
    if (patch) {
        patch->model.nodes = model->nodes;
        patch->solver = solver;
        patch->sweep_limit = DEFAULT_SWEEPS;
        patch->tolerance = DEFAULT_TOLERANCE;
    }
    if (!patch || !allocate(patch)) {
        fail(failure, "out of memory for a patch of %d nodes a side", model->nodes);
    } else if (patch_host_model(patch, model, failure)) {
        patch_host_start(patch, NULL, NULL, NULL);
        return patch;
    }
    patch_host_free(patch);
    return NULL;
}

void patch_host_free(PatchHost *patch)
{
    if (!patch) return;
    PatchHostWork *work = patch->work;
    if (work) {
        for (int c = 0; c < 3; c++) patch_band_free(work->factors[c].band);
        patch_edges_free(work->edges);
        patch_edges_free(work->next);
        patch_edges_free(work->inside);
        free(work->pins);
        free(work->memory);
        free(work);
    }
    free(patch);
}

static bool same_pins(const PatchModel *a, const PatchModel *b)
{
    if (a->pin_count != b->pin_count) return false;
    for (int k = 0; k < a->pin_count; k++)
        if (a->pins[k].i != b->pins[k].i || a->pins[k].j != b->pins[k].j) return false;
    return true;
}

bool patch_host_model(PatchHost *patch, const PatchModel *model, Failure *failure)
{
    PatchHostWork *work = patch->work;
    if (model->nodes != patch->model.nodes)
        return fail(failure, "a patch of %d nodes a side cannot get %d", patch->model.nodes, model->nodes);
    if (!patch_accept(model, failure)) return false;
    PatchPin *pins = NULL;
    if (model->pin_count) {
        pins = malloc((size_t)model->pin_count * sizeof *pins);
        if (!pins) return fail(failure, "out of memory for the pins of a patch");
        memcpy(pins, model->pins, (size_t)model->pin_count * sizeof *pins);
    }
    // A factor knows its numbers, but not which unknowns were taken out of it.
    if (!same_pins(model, &patch->model))
        for (int c = 0; c < 3; c++) work->factors[c].valid = false;
    if (model->step != patch->model.step) {
        work->origin = patch->time;
        work->origin_step = patch->steps;
    }
    free(work->pins);
    work->pins = pins;
    patch->model = *model;
    patch->model.pins = pins;
    work->coefficients = patch_coefficients(model);
    return true;
}

void patch_host_start(PatchHost *patch, const PatchEdges *edges, const double *const x[3], const double *const v[3])
{
    PatchHostWork *work = patch->work;
    int nodes = patch->model.nodes;
    patch->steps = work->origin_step = 0;
    patch->time = work->origin = 0;
    if (edges) patch_edges_copy(work->edges, edges);
    for (int c = 0; c < 3; c++) {
        double *to = patch->x[c], *speed = patch->v[c];
        memset(to, 0, nodes_of(patch) * sizeof *to);
        memset(speed, 0, nodes_of(patch) * sizeof *speed);
        if (x && x[c])
            memcpy(to, x[c], nodes_of(patch) * sizeof *to);
        else if (c < 2)
            for (int i = 0; i < nodes; i++)
                for (int j = 0; j < nodes; j++) to[i * nodes + j] = (c ? j : i) / (double)(nodes - 1);
        for (int i = 1; v && v[c] && i < nodes - 1; i++)
            memcpy(speed + (size_t)i * nodes + 1, v[c] + (size_t)i * nodes + 1, (size_t)(nodes - 2) * sizeof *speed);
        patch_edges_place(work->edges, c, to);
        for (int k = 0; k < patch->model.pin_count; k++) {
            const PatchPin *pin = &patch->model.pins[k];
            to[pin->i * nodes + pin->j] = pin->to[c];
            speed[pin->i * nodes + pin->j] = 0;
        }
    }
}

double patch_host_force_time(const PatchHost *patch)
{
    return patch->time + (patch->model.scheme == PATCH_NEWMARK ? patch->model.step / 2 : 0);
}

static bool __attribute__((format(printf, 5, 6)))
stop(PatchHost *patch, PatchFault *fault, PatchFaultKind kind, int component, const char *format, ...)
{
    if (!fault) return false;
    *fault = (PatchFault){.kind = kind, .component = component, .step = patch->steps};
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(fault->text, sizeof fault->text, format, arguments);
    va_end(arguments);
    return false;
}

// The factor of L + μ for a component, made where it is not there yet; NULL with `fault` set.
static PatchBand *factor_of(PatchHost *patch, int component, PatchFault *fault)
{
    PatchHostWork *work = patch->work;
    const PatchStiffness *s = &patch->model.stiffness[component];
    double mu = work->coefficients.mu;
    // Components of equal stiffness share the first one's.
    Factor *factor = NULL;
    for (int c = 0; c <= component && !factor; c++) {
        const PatchStiffness *other = &patch->model.stiffness[c];
        if (other->b == s->b && other->c == s->c && other->d == s->d) factor = &work->factors[c];
    }
    bool same =
        factor->stiffness.b == s->b && factor->stiffness.c == s->c && factor->stiffness.d == s->d && factor->mu == mu;
    if (factor->valid && same) return factor->band;
    if (!factor->band) factor->band = patch_band_new(patch->model.nodes, NULL);
    if (!factor->band) {
        stop(patch, fault, PATCH_INDEFINITE, component,
             "out of memory for the direct solver of a patch of %d nodes a side", patch->model.nodes);
        return NULL;
    }
    factor->stiffness = *s;
    factor->mu = mu;
    factor->valid =
        patch->model.insist
            ? patch_band_factor_any(factor->band, s, patch->model.closure, mu, work->pins, patch->model.pin_count)
            : patch_band_factor(factor->band, s, patch->model.closure, mu, work->pins, patch->model.pin_count);
    patch->factored++;
    if (factor->valid) return factor->band;
    stop(patch, fault, PATCH_INDEFINITE, component,
         "the patch cannot take step %llu: for x%d the matrix of a step of %gs is not positive definite",
         (unsigned long long)patch->steps, component + 1, patch->model.step);
    return NULL;
}

// Copies between arrays over nodes and over unknowns.
static void take_inside(int nodes, const double *full, double *inside)
{
    int m = nodes - 2;
    for (int i = 0; i < m; i++)
        memcpy(inside + (size_t)i * m, full + (size_t)(i + 1) * nodes + 1, (size_t)m * sizeof *inside);
}

// Where a pin puts w of its node: x⁺ is then its place.
static double pinned(const PatchHost *patch, const PatchPin *pin, int component)
{
    double theta = patch->work->coefficients.theta;
    return (1 - theta) * patch->x[component][pin->i * patch->model.nodes + pin->j] + theta * pin->to[component];
}

static size_t pin_place(const PatchHost *patch, const PatchPin *pin)
{
    return (size_t)(pin->i - 1) * (patch->model.nodes - 2) + pin->j - 1;
}

// Takes the pinned values to the right side: it becomes that of the matrix with their rows and columns taken out.
// `value` is over unknowns: what pinned unknowns have, zero elsewhere.
static void move_pins(PatchHost *patch, int component, const double *value, double *right)
{
    PatchHostWork *work = patch->work;
    size_t m = unknowns_of(patch);
    patch_apply(&patch->model.stiffness[component], patch->model.closure, patch->model.nodes, work->coefficients.mu,
                value, work->q);
    for (size_t k = 0; k < m; k++) right[k] -= work->q[k];
    for (int k = 0; k < patch->model.pin_count; k++) {
        size_t place = pin_place(patch, &work->pins[k]);
        right[place] = value[place];
    }
}

// f + g over unknowns, into `right`.
static void add_loads(PatchHost *patch, const PatchDrive *drive, int component, double *right)
{
    PatchHostWork *work = patch->work;
    int nodes = patch->model.nodes, m = nodes - 2;
    patch_edge_load(&patch->model, work->inside, component, right);
    const double *force = drive->force[component];
    for (int i = 0; i < m; i++)
        for (int j = 0; j < m; j++) {
            double f = patch->model.force[component];
            if (force) f += force[(size_t)(i + 1) * nodes + j + 1];
            right[(size_t)i * m + j] += f;
        }
}

// The right side of (L + μ) w, pins taken out.
static void right_side(PatchHost *patch, const PatchDrive *drive, int component)
{
    PatchHostWork *work = patch->work;
    int nodes = patch->model.nodes, m = nodes - 2;
    double *right = work->w[component], mu = work->coefficients.mu, nu = work->coefficients.nu;
    add_loads(patch, drive, component, right);
    for (int i = 0; i < m; i++) {
        const double *x = patch->x[component] + (size_t)(i + 1) * nodes + 1,
                     *v = patch->v[component] + (size_t)(i + 1) * nodes + 1;
        for (int j = 0; j < m; j++) right[(size_t)i * m + j] += mu * x[j] + nu * v[j];
    }
    if (!patch->model.pin_count) return;
    memset(work->p, 0, unknowns_of(patch) * sizeof *work->p);
    for (int k = 0; k < patch->model.pin_count; k++)
        work->p[pin_place(patch, &work->pins[k])] = pinned(patch, &work->pins[k], component);
    move_pins(patch, component, work->p, right);
}

static bool solve_direct(PatchHost *patch, PatchFault *fault)
{
    PatchHostWork *work = patch->work;
    PatchBand *bands[3];
    for (int c = 0; c < 3; c++) {
        bands[c] = factor_of(patch, c, fault);
        if (!bands[c]) return false;
    }
    // The right sides are one run, so those of one factor are one call.
    for (int c = 0; c < 3;) {
        int count = 1;
        while (c + count < 3 && bands[c + count] == bands[c]) count++;
        patch_band_solve(bands[c], work->w[c], count);
        c += count;
    }
    return true;
}

static double norm(size_t count, const double *x)
{
    double sum = 0;
    for (size_t k = 0; k < count; k++) sum += x[k] * x[k];
    return sqrt(sum);
}

// One sweep over the unknowns of a padded array, in the order of their numbers. `fixed` marks pinned ones; NULL: none.
static void sweep(const PatchStiffness *s, PatchClosure closure, int m, double mu, double *x, const double *right,
                  const double *fixed)
{
    int side = m + 4;
    double n = m + 1, scale = n * n * n * n, b = s->b * scale, c = s->c * scale, d = s->d * scale;
    double u[3], v[3];
    for (int i = 0; i < m; i++) {
        patch_line(closure, m, i, u);
        double diagonal = mu + u[1] * b + 4 * c;
        for (int j = 0; j < m; j++) {
            if (fixed && fixed[i * m + j] != 0) continue;
            double *at = x + (i + 2) * side + j + 2;
            patch_line(closure, m, j, v);
            double sum = (u[0] * b - 2 * c) * at[-side] + (u[2] * b - 2 * c) * at[side] + (v[0] * d - 2 * c) * at[-1] +
                         (v[2] * d - 2 * c) * at[1] + b * (at[-2 * side] + at[2 * side]) + d * (at[-2] + at[2]) +
                         c * (at[-side - 1] + at[-side + 1] + at[side - 1] + at[side + 1]);
            at[0] = (right[i * m + j] - sum) / (diagonal + v[1] * d);
        }
    }
}

// Sweeps until the residual is small or the sweeps are used up. The pins' values are in the right side, and their
// columns are not.
static void solve_gauss_seidel(PatchHost *patch, int component)
{
    PatchHostWork *work = patch->work;
    int m = patch->model.nodes - 2, side = m + 4;
    size_t count = unknowns_of(patch);
    const PatchStiffness *s = &patch->model.stiffness[component];
    double *right = work->w[component], *padded = work->padded, *fixed = NULL;
    take_inside(patch->model.nodes, patch->x[component], work->z);
    if (patch->model.pin_count) {
        fixed = work->p;
        memset(fixed, 0, count * sizeof *fixed);
        for (int k = 0; k < patch->model.pin_count; k++) {
            fixed[pin_place(patch, &work->pins[k])] = 1;
            work->z[pin_place(patch, &work->pins[k])] = 0;
        }
    }
    memset(padded, 0, (size_t)side * side * sizeof *padded);
    for (int i = 0; i < m; i++)
        memcpy(padded + (i + 2) * side + 2, work->z + (size_t)i * m, (size_t)m * sizeof *padded);

    double scale = norm(count, right), residual = 0;
    int sweeps = 0;
    do {
        for (int k = 0; k < SWEEPS_BETWEEN_LOOKS && sweeps < patch->sweep_limit; k++, sweeps++)
            sweep(s, patch->model.closure, m, work->coefficients.mu, padded, right, fixed);
        for (int i = 0; i < m; i++)
            memcpy(work->z + (size_t)i * m, padded + (i + 2) * side + 2, (size_t)m * sizeof *padded);
        patch_apply(s, patch->model.closure, patch->model.nodes, work->coefficients.mu, work->z, work->q);
        for (size_t k = 0; k < count; k++) work->q[k] = fixed && fixed[k] != 0 ? 0 : right[k] - work->q[k];
        residual = scale > 0 ? norm(count, work->q) / scale : 0;
    } while (residual > patch->tolerance && sweeps < patch->sweep_limit);

    for (size_t k = 0; k < count; k++)
        if (!fixed || fixed[k] == 0) right[k] = work->z[k];
    if (sweeps > patch->sweeps) patch->sweeps = sweeps;
    if (residual > patch->residual) patch->residual = residual;
}

// Asks the law what touches the nodes ahead. False if nothing does.
static bool touched(PatchHost *patch, const PatchDrive *drive)
{
    PatchHostWork *work = patch->work;
    size_t count = nodes_of(patch);
    PatchTouch touch = {.nodes = patch->model.nodes, .stiffness = work->kappa};
    memset(work->kappa, 0, count * sizeof *work->kappa);
    for (int c = 0; c < 3; c++) {
        patch_edges_place(work->inside, c, work->ahead[c]);
        memset(work->touch_force[c], 0, count * sizeof *work->touch_force[c]);
        touch.x[c] = work->ahead[c];
        touch.v[c] = patch->v[c];
        touch.force[c] = work->touch_force[c];
    }
    drive->contact(drive->context, &touch);
    for (size_t k = 0; k < count; k++)
        if (work->kappa[k] != 0 || work->touch_force[0][k] != 0 || work->touch_force[1][k] != 0 ||
            work->touch_force[2][k] != 0)
            return true;
    return false;
}

static double dot(size_t count, const double *x, const double *y)
{
    double sum = 0;
    for (size_t k = 0; k < count; k++) sum += x[k] * y[k];
    return sum;
}

static void clear_pins(const PatchHost *patch, double *x)
{
    for (int k = 0; k < patch->model.pin_count; k++) x[pin_place(patch, &patch->work->pins[k])] = 0;
}

// q = (L + μ + κ) x over unknowns.
static void apply_touched(PatchHost *patch, int component, const double *kappa, const double *x, double *q)
{
    patch_apply(&patch->model.stiffness[component], patch->model.closure, patch->model.nodes,
                patch->work->coefficients.mu, x, q);
    size_t count = unknowns_of(patch);
    for (size_t k = 0; k < count; k++) q[k] += kappa[k] * x[k];
}

// Adds to `e` the solution of (L + μ + κ) e = r by conjugate gradients, pins left alone.
static void solve_touched(PatchHost *patch, PatchBand *band, int component, const double *kappa, double *r, double *e)
{
    PatchHostWork *work = patch->work;
    size_t count = unknowns_of(patch);
    double *z = work->z, *p = work->p, *q = work->q, first = 0, last = 0;
    for (int k = 0; k < CONTACT_ITERATIONS; k++) {
        memcpy(z, r, count * sizeof *z);
        patch_band_solve(band, z, 1);
        double rz = dot(count, r, z);
        if (k == 0) first = rz;
        if (!(rz > CONTACT_TOLERANCE * CONTACT_TOLERANCE * first)) return;
        for (size_t t = 0; t < count; t++) p[t] = k ? z[t] + rz / last * p[t] : z[t];
        apply_touched(patch, component, kappa, p, q);
        clear_pins(patch, q);
        double step = rz / dot(count, p, q);
        for (size_t t = 0; t < count; t++) {
            e[t] += step * p[t];
            r[t] -= step * q[t];
        }
        last = rz;
        if (k + 1 > patch->iterations) patch->iterations = k + 1;
    }
}

// w of a component where something touches the nodes at `ahead`.
static bool step_touched(PatchHost *patch, const PatchDrive *drive, int component, PatchFault *fault)
{
    PatchHostWork *work = patch->work;
    PatchBand *band = factor_of(patch, component, fault);
    if (!band) return false;
    int nodes = patch->model.nodes;
    size_t count = unknowns_of(patch);
    double forward = work->coefficients.theta * patch->model.step;
    double *w = work->w[component], *r = work->r, *v = work->z, *e = work->other, *kappa = work->g;
    add_loads(patch, drive, component, r);
    take_inside(nodes, work->kappa, kappa);
    take_inside(nodes, work->ahead[component], e);
    take_inside(nodes, patch->x[component], w);
    take_inside(nodes, patch->v[component], v);
    for (size_t k = 0; k < count; k++) {
        w[k] += forward * v[k];
        r[k] += kappa[k] * (e[k] - w[k]) - patch->model.damping * v[k];
    }
    patch_apply(&patch->model.stiffness[component], patch->model.closure, nodes, 0, w, work->q);
    take_inside(nodes, work->touch_force[component], work->p);
    for (size_t k = 0; k < count; k++) r[k] += work->p[k] - work->q[k];

    memset(e, 0, count * sizeof *e);
    for (int k = 0; k < patch->model.pin_count; k++) {
        size_t place = pin_place(patch, &work->pins[k]);
        e[place] = pinned(patch, &work->pins[k], component) - w[place];
    }
    if (patch->model.pin_count) {
        apply_touched(patch, component, kappa, e, work->q);
        for (size_t k = 0; k < count; k++) r[k] -= work->q[k];
        clear_pins(patch, r);
    }
    solve_touched(patch, band, component, kappa, r, e);
    for (size_t k = 0; k < count; k++) w[k] += e[k];
    return true;
}

// The step without anything that touches.
static bool step_free(PatchHost *patch, const PatchDrive *drive, PatchFault *fault)
{
    for (int c = 0; c < 3; c++) right_side(patch, drive, c);
    if (patch->solver == PATCH_DIRECT) return solve_direct(patch, fault);
    for (int c = 0; c < 3; c++) solve_gauss_seidel(patch, c);
    return true;
}

// The step with a contact law: asked at the nodes' places first, then where that carried them.
static bool step_with_contact(PatchHost *patch, const PatchDrive *drive, PatchFault *fault)
{
    PatchHostWork *work = patch->work;
    int nodes = patch->model.nodes, m = nodes - 2;
    for (int c = 0; c < 3; c++) memcpy(work->ahead[c], patch->x[c], nodes_of(patch) * sizeof(double));
    bool solved = false;
    for (int pass = 0; pass < PATCH_CONTACT_PASSES; pass++) {
        bool is_touched = touched(patch, drive);
        if (!is_touched && solved) return true;
        if (!is_touched && !step_free(patch, drive, fault)) return false;
        for (int c = 0; c < 3; c++) {
            if (is_touched && !step_touched(patch, drive, c, fault)) return false;
            for (int i = 0; i < m; i++)
                memcpy(work->ahead[c] + (size_t)(i + 1) * nodes + 1, work->w[c] + (size_t)i * m,
                       (size_t)m * sizeof(double));
        }
        solved = !is_touched;
    }
    return true;
}

// Finds a coordinate that is not finite or too large among the new places.
static bool check_places(PatchHost *patch, PatchFault *fault)
{
    PatchHostWork *work = patch->work;
    int m = patch->model.nodes - 2;
    double limit = patch->model.limit > 0 ? patch->model.limit : PATCH_LIMIT;
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < m * m; k++) {
            double value = work->w[c][k];
            if (fabs(value) <= limit) continue;
            stop(patch, fault, PATCH_DIVERGED, c,
                 "the patch diverges: in step %llu (at %gs) x%d of node (%d, %d) became %g, beyond %g",
                 (unsigned long long)patch->steps, patch->time, c + 1, k / m + 1, k % m + 1, value, limit);
            if (fault) {
                fault->i = k / m + 1;
                fault->j = k % m + 1;
                fault->value = value;
            }
            return false;
        }
    return true;
}

static void commit(PatchHost *patch)
{
    PatchHostWork *work = patch->work;
    int nodes = patch->model.nodes, m = nodes - 2;
    double dt = patch->model.step;
    bool newmark = patch->model.scheme == PATCH_NEWMARK;
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < m; i++) {
            double *x = patch->x[c] + (size_t)(i + 1) * nodes + 1, *v = patch->v[c] + (size_t)(i + 1) * nodes + 1;
            const double *w = work->w[c] + (size_t)i * m;
            for (int j = 0; j < m; j++) {
                double old = x[j];
                x[j] = newmark ? 2 * w[j] - old : w[j];
                v[j] = newmark ? 2 * (x[j] - old) / dt - v[j] : (w[j] - old) / dt;
            }
        }
        patch_edges_place(work->next, c, patch->x[c]);
    }
    patch_edges_copy(work->edges, work->next);
    patch->steps++;
    patch->time = work->origin + (double)(patch->steps - work->origin_step) * dt;
}

bool patch_host_step(PatchHost *patch, const PatchDrive *drive, PatchFault *fault)
{
    PatchHostWork *work = patch->work;
    static const PatchDrive nothing;
    if (!drive) drive = &nothing;
    if (fault) fault->kind = PATCH_FINE;
    patch->iterations = patch->sweeps = 0;
    patch->residual = 0;
    patch_edges_copy(work->next, drive->edges ? drive->edges : work->edges);
    patch_edges_copy(work->inside, work->edges);
    patch_edges_mix(work->inside, work->next, work->coefficients.theta);

    bool contact = patch->solver == PATCH_DIRECT && drive->contact;
    if (!(contact ? step_with_contact(patch, drive, fault) : step_free(patch, drive, fault))) return false;
    if (!check_places(patch, fault)) return false;
    commit(patch);
    return true;
}

// Linear algebra takes what instructions a processor has: its name and its list of them.
void patch_host_key(char key[static PATCH_SOLVER_KEY])
{
    char line[4096];
    XXH64_hash_t hash = 0;
    FILE *file = fopen("/proc/cpuinfo", "r");
    for (bool first = true; file && first && fgets(line, sizeof line, file);) {
        first = line[0] != '\n'; // the rest is of other cores
        if (!strncmp(line, "model name", 10) || !strncmp(line, "flags", 5) || !strncmp(line, "Features", 8))
            hash = XXH3_64bits_withSeed(line, strlen(line), hash);
    }
    if (file) fclose(file);
    snprintf(key, PATCH_SOLVER_KEY, "direct-%016llx", (unsigned long long)hash);
}

size_t patch_host_save(const PatchHost *patch, void *bytes, size_t capacity)
{
    const PatchHostWork *work = patch->work;
    size_t size = nodes_of(patch) * sizeof(double);
    PatchWriter writer = {bytes, capacity, 0};
    patch_write_header(&writer, PATCH_STATE_HOST, patch->model.nodes, 1);
    patch_write(&writer, &patch->steps, sizeof patch->steps);
    patch_write(&writer, &patch->time, sizeof patch->time);
    patch_write(&writer, &work->origin, sizeof work->origin);
    patch_write(&writer, &work->origin_step, sizeof work->origin_step);
    for (int c = 0; c < 3; c++) {
        patch_write(&writer, patch->x[c], size);
        patch_write(&writer, patch->v[c], size);
    }
    patch_write(&writer, patch_edges_values(work->edges), patch_edges_count(patch->model.nodes) * sizeof(double));
    return patch_write_end(&writer);
}

bool patch_host_restore(PatchHost *patch, const void *bytes, size_t size, Failure *failure)
{
    PatchHostWork *work = patch->work;
    PatchReader reader;
    if (!patch_read_header(&reader, bytes, size, PATCH_STATE_HOST, patch->model.nodes, 1, failure)) return false;
    if (size != patch_host_save(patch, NULL, 0)) return fail(failure, "the checkpoint of the patch has a wrong length");
    size_t grid = nodes_of(patch) * sizeof(double);
    for (size_t at = 4 * sizeof(double); at < reader.left; at += sizeof(double)) {
        double value;
        memcpy(&value, reader.bytes + at, sizeof value);
        if (!isfinite(value)) return fail(failure, "the checkpoint of the patch is not finite");
    }
    patch_read(&reader, &patch->steps, sizeof patch->steps);
    patch_read(&reader, &patch->time, sizeof patch->time);
    patch_read(&reader, &work->origin, sizeof work->origin);
    patch_read(&reader, &work->origin_step, sizeof work->origin_step);
    for (int c = 0; c < 3; c++) {
        patch_read(&reader, patch->x[c], grid);
        patch_read(&reader, patch->v[c], grid);
    }
    patch_read(&reader, patch_edges_values(work->edges), patch_edges_count(patch->model.nodes) * sizeof(double));
    return true;
}

const PatchEdges *patch_host_edges(const PatchHost *patch)
{
    return patch->work->edges;
}

double patch_host_energy(const PatchHost *patch, int component)
{
    PatchHostWork *work = patch->work;
    size_t count = unknowns_of(patch);
    take_inside(patch->model.nodes, patch->x[component], work->p);
    take_inside(patch->model.nodes, patch->v[component], work->z);
    patch_apply(&patch->model.stiffness[component], patch->model.closure, patch->model.nodes, 0, work->p, work->q);
    double dt = patch->model.step, moving = patch->model.density / 2;
    if (patch->model.scheme == PATCH_IMPLICIT) moving += patch->model.damping * dt / 4;
    return moving * dot(count, work->z, work->z) + 0.5 * dot(count, work->p, work->q);
}
