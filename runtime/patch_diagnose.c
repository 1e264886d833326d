// The error of a mode's rate is computed and not estimated. The mode's equation is ρ s² + η s + λ = 0; a step
// multiplies it by the root z of
//
//     ρ (z − 2 + 1/z)/dt² + η (z − 1/z)/(2dt) + λ z = 0                      implicit
//     ρ (z − 2 + 1/z)/dt² + η (z − 1/z)/(2dt) + λ (z + 2 + 1/z)/4 = 0        newmark
//
// and log z / dt is compared with s. With z = 1 + dt y these are quadratics in y that go over into the mode's own as dt
// → 0:
//
//     (ρ + η dt/2 + λ dt²) y² + (η + 2λ dt) y + λ = 0          (ρ + η dt/2 + λ dt²/4) y² + (η + λ dt) y + λ = 0
#include "runtime/patch_diagnose.h"

#include <complex.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/patch_band.h"

// Of the clamped beam on [0, 1]: the fourth power of 4.730041, and the mean square of the first mode's slope.
#define BEAM_FOURTH 500.563902
#define BEAM_SECOND 12.302618

double patch_lowest(const PatchStiffness *s)
{
    return (s->b + s->d) * BEAM_FOURTH + s->c * BEAM_SECOND * BEAM_SECOND;
}

// The roots of a z² + b z + c, a not 0.
static void roots_of(double a, double b, double c, double complex roots[2])
{
    double complex root = csqrt(b * b - 4 * a * c);
    // The sum of equal signs first; the other root from the product, without cancellation.
    double complex q = creal(b * root) >= 0 ? -0.5 * (b + root) : -0.5 * (b - root);
    roots[0] = q / a;
    roots[1] = cabs(q) > 0 ? c / q : 0;
}

// log(1 + x), also for small x.
static double complex log_one_plus(double complex x)
{
    double a = creal(x), b = cimag(x);
    return 0.5 * log1p(2 * a + a * a + b * b) + I * atan2(b, 1 + a);
}

double patch_rate_error(const PatchModel *model, double lambda, double dt)
{
    double rho = model->density, eta = model->damping;
    bool newmark = model->scheme == PATCH_NEWMARK;
    double complex exact[2], discrete[2];
    if (rho > 0) {
        roots_of(rho, eta, lambda, exact);
    } else if (eta > 0) {
        exact[0] = exact[1] = -lambda / eta;
    } else {
        return 0; // the static shape is exact in time
    }
    roots_of(rho + eta * dt / 2 + lambda * dt * dt * (newmark ? 0.25 : 1), eta + lambda * dt * (newmark ? 1 : 2),
             lambda, discrete);
    // Of the exact rates the slowest to die counts, since it is what is seen; the scheme's is the one next to it.
    double complex slow = creal(exact[0]) > creal(exact[1]) ? exact[0] : exact[1];
    double error = INFINITY;
    for (int k = 0; k < 2; k++) {
        double complex rate = log_one_plus(dt * discrete[k]) / dt;
        // A pair of conjugate rates is one motion.
        error = fmin(error, fmin(cabs(rate - slow), cabs(conj(rate) - slow)) / cabs(slow));
    }
    return error;
}

double patch_step_bound(const PatchModel *model, double lambda, double error)
{
    double low = 1e-12, high = 1e6;
    if (patch_rate_error(model, lambda, high) <= error) return high;
    for (int k = 0; k < 120; k++) {
        double middle = sqrt(low * high);
        if (patch_rate_error(model, lambda, middle) <= error)
            low = middle;
        else
            high = middle;
    }
    return low;
}

const char *patch_problem_name(PatchProblem problem)
{
    static const char *const names[PATCH_PROBLEMS] = {
        "grid",      "step",       "not-finite", "density-negative", "damping-negative", "nothing-moves", "pin-place",
        "pin-twice", "b-negative", "d-negative", "c-below",          "operator",         "step-large",
    };
    return names[problem];
}

typedef struct Findings {
    PatchFinding *list;
    int capacity, count;
} Findings;

static void __attribute__((format(printf, 7, 8)))
find(Findings *findings, PatchProblem problem, bool error, int component, double value, double bound,
     const char *format, ...)
{
    if (findings->count < findings->capacity) {
        PatchFinding *finding = &findings->list[findings->count];
        *finding =
            (PatchFinding){.problem = problem, .error = error, .component = component, .value = value, .bound = bound};
        va_list arguments;
        va_start(arguments, format);
        vsnprintf(finding->text, sizeof finding->text, format, arguments);
        va_end(arguments);
    }
    findings->count++;
}

static bool all_finite(const PatchModel *model)
{
    bool ok = isfinite(model->step) && isfinite(model->density) && isfinite(model->damping) &&
              isfinite(model->accuracy) && !isnan(model->limit);
    for (int c = 0; c < 3; c++) {
        const PatchStiffness *s = &model->stiffness[c];
        ok = ok && isfinite(s->b) && isfinite(s->c) && isfinite(s->d) && isfinite(model->force[c]);
    }
    for (int k = 0; k < model->pin_count; k++)
        for (int c = 0; c < 3; c++) ok = ok && isfinite(model->pins[k].to[c]);
    return ok;
}

static void check_pins(const PatchModel *model, Findings *findings)
{
    int last = model->nodes - 2;
    char *taken = calloc((size_t)model->nodes * model->nodes, 1);
    if (!taken) return; // whoever solves will say so
    for (int k = 0; k < model->pin_count; k++) {
        const PatchPin *pin = &model->pins[k];
        if (pin->i < 1 || pin->i > last || pin->j < 1 || pin->j > last) {
            find(findings, PATCH_PIN_PLACE, true, -1, pin->i < 1 || pin->i > last ? pin->i : pin->j, last,
                 "a pin is at node (%d, %d): it can hold nodes from 1 to %d, the edges are held already", pin->i,
                 pin->j, last);
            break;
        }
        char *place = &taken[pin->i * model->nodes + pin->j];
        if (*place) {
            find(findings, PATCH_PIN_TWICE, true, -1, k, 1, "two pins hold node (%d, %d)", pin->i, pin->j);
            break;
        }
        *place = 1;
    }
    free(taken);
}

// Whether L is positive definite on the grid; true also where there is no memory to find out.
static bool is_positive(const PatchModel *model, const PatchStiffness *stiffness)
{
    PatchBand *band = patch_band_new(model->nodes, NULL);
    bool positive = !band || patch_band_factor(band, stiffness, model->closure, 0, NULL, 0);
    patch_band_free(band);
    return positive;
}

static void check_stiffness(const PatchModel *model, int component, Findings *findings)
{
    const PatchStiffness *s = &model->stiffness[component];
    int number = component + 1;
    double lowest = s->b > 0 && s->d > 0 ? -2 * sqrt(s->b * s->d) : 0;
    bool b = s->b < 0, c = s->c < lowest, d = s->d < 0, zero = s->b == 0 && s->c == 0 && s->d == 0;
    if (b)
        find(findings, PATCH_B_NEGATIVE, false, component, s->b, 0,
             "x%d: b = %g is negative, so waves along u grow the faster the shorter they are: take b >= 0", number,
             s->b);
    if (d)
        find(findings, PATCH_D_NEGATIVE, false, component, s->d, 0,
             "x%d: d = %g is negative, so waves along v grow the faster the shorter they are: take d >= 0", number,
             s->d);
    if (c && !b && !d)
        find(findings, PATCH_C_BELOW, false, component, s->c, lowest,
             "x%d: c = %g is below -2 sqrt(b d) = %g, so slanted waves grow the faster the shorter they are: take c >= "
             "%g",
             number, s->c, lowest, lowest);
    if ((b || c || d || zero) && !is_positive(model, s))
        find(findings, PATCH_OPERATOR, !model->insist, component, 0, 0,
             "x%d: the stiffness (%g, %g, %g) is not positive definite on %d nodes a side: shapes grow instead of "
             "coming to rest",
             number, s->b, s->c, s->d, model->nodes);
}

static bool same_stiffness(const PatchStiffness *a, const PatchStiffness *b)
{
    return a->b == b->b && a->c == b->c && a->d == b->d;
}

// The first component of those with the same stiffness says what is wrong with it.
static bool is_repeated(const PatchModel *model, int component)
{
    for (int c = 0; c < component; c++)
        if (same_stiffness(&model->stiffness[c], &model->stiffness[component])) return true;
    return false;
}

static void check_accuracy(const PatchModel *model, int component, Findings *findings)
{
    double lambda = patch_lowest(&model->stiffness[component]);
    if (!(model->accuracy > 0) || !(lambda > 0) || is_repeated(model, component)) return;
    double error = patch_rate_error(model, lambda, model->step);
    if (error <= model->accuracy) return;
    double bound = patch_step_bound(model, lambda, model->accuracy);
    find(findings, PATCH_STEP_LARGE, false, component, model->step, bound,
         "x%d: a step of %gs moves the slowest mode with an error of %.2g, more than %g: take at most %.3gs",
         component + 1, model->step, error, model->accuracy, bound);
}

int patch_diagnose(const PatchModel *model, PatchFinding *list, int capacity)
{
    Findings findings = {list, capacity, 0};
    bool grid = model->nodes >= PATCH_MIN_NODES && model->nodes <= PATCH_MAX_NODES;
    if (!grid) {
        bool few = model->nodes < PATCH_MIN_NODES;
        int bound = few ? PATCH_MIN_NODES : PATCH_MAX_NODES;
        find(&findings, PATCH_GRID, true, -1, model->nodes, bound,
             "a patch of %d nodes a side has too %s: take %d to %d", model->nodes, few ? "few" : "many",
             PATCH_MIN_NODES, PATCH_MAX_NODES);
    }
    if (!all_finite(model)) {
        find(&findings, PATCH_NOT_FINITE, true, -1, NAN, 0, "a number of the patch is not finite");
        return findings.count;
    }
    if (!(model->step > 0))
        find(&findings, PATCH_STEP, true, -1, model->step, 0, "the step is %gs: it has to be positive", model->step);
    if (model->density < 0)
        find(&findings, PATCH_DENSITY_NEGATIVE, true, -1, model->density, 0, "the density is %g: it cannot be negative",
             model->density);
    if (model->damping < 0)
        find(&findings, PATCH_DAMPING_NEGATIVE, true, -1, model->damping, 0, "the damping is %g: it cannot be negative",
             model->damping);
    if (model->scheme == PATCH_NEWMARK && model->density == 0 && model->damping == 0)
        find(&findings, PATCH_NOTHING_MOVES, true, -1, 0, 0,
             "without density and damping the scheme \"newmark\" never comes to rest: take \"implicit\", which gives "
             "the static shape");
    if (!grid) return findings.count;
    if (model->pin_count) check_pins(model, &findings);
    for (int c = 0; c < 3; c++)
        if (!is_repeated(model, c)) check_stiffness(model, c, &findings);
    bool moves = model->step > 0 && model->density >= 0 && model->damping >= 0;
    for (int c = 0; moves && c < 3; c++) check_accuracy(model, c, &findings);
    return findings.count;
}

bool patch_accept(const PatchModel *model, Failure *failure)
{
    PatchFinding findings[PATCH_FINDINGS];
    int count = patch_diagnose(model, findings, PATCH_FINDINGS);
    for (int k = 0; k < count && k < PATCH_FINDINGS; k++)
        if (findings[k].error) return fail(failure, "%s", findings[k].text);
    return true;
}
