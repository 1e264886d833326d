#include "runtime/patch_pins.h"

#include <stdlib.h>
#include <string.h>

#include <lapacke.h>

// work = (u vᵀ) D, u and v the pin's rows of modes.
static void weigh(const PatchModes *modes, const PatchStiffness *s, double mu, const double *u, const double *v,
                  double *work)
{
    size_t order = (size_t)modes->order;
    for (size_t a = 0; a < order; a++)
        for (size_t c = 0; c < order; c++) {
            double along = s->b * modes->lambda[a] + s->d * modes->lambda[c];
            work[a * order + c] = u[a] * v[c] / (along + s->c * modes->beta[a] * modes->beta[c] + mu);
        }
}

// uᵀ work v.
static double between(size_t order, const double *u, const double *v, const double *work)
{
    double sum = 0;
    for (size_t a = 0; a < order; a++) {
        double row = 0;
        for (size_t c = 0; c < order; c++) row += work[a * order + c] * v[c];
        sum += row * u[a];
    }
    return sum;
}

bool patch_pins_inverse(const PatchModes *modes, const PatchModel *model, int component, double *work, float *inverse,
                        Failure *failure)
{
    size_t order = (size_t)modes->order, count = (size_t)model->pin_count;
    double *u = malloc((2 * count * order + count * count) * sizeof *u);
    if (!u) return fail(failure, "out of memory for the pins of a patch");
    double *v = u + count * order, *matrix = v + count * order;
    for (size_t k = 0; k < count; k++) {
        patch_modes_row(modes, model->pins[k].i - 1, u + k * order);
        patch_modes_row(modes, model->pins[k].j - 1, v + k * order);
    }
    double mu = patch_coefficients(model).mu;
    for (size_t k = 0; k < count; k++) {
        weigh(modes, &model->stiffness[component], mu, u + k * order, v + k * order, work);
        for (size_t l = k; l < count; l++) matrix[k * count + l] = between(order, u + l * order, v + l * order, work);
    }
    // The lower half by columns, which is all that LAPACK reads and writes here.
    int size = (int)count;
    bool ok = !LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', size, matrix, size) &&
              !LAPACKE_dpotri_work(LAPACK_COL_MAJOR, 'L', size, matrix, size);
    for (size_t k = 0; k < count; k++)
        for (size_t l = k; l < count; l++)
            inverse[k * count + l] = inverse[l * count + k] = (float)matrix[k * count + l];
    free(u);
    return ok || fail(failure, "the pins cannot all be held: the patch is not positive definite on %d nodes a side",
                      modes->nodes);
}

bool patch_pins_same(const PatchModel *a, const PatchModel *b)
{
    if (a->pin_count != b->pin_count || memcmp(a->stiffness, b->stiffness, sizeof a->stiffness) || a->step != b->step ||
        a->density != b->density || a->damping != b->damping || a->scheme != b->scheme)
        return false;
    for (int k = 0; k < a->pin_count; k++)
        if (a->pins[k].i != b->pins[k].i || a->pins[k].j != b->pins[k].j) return false;
    return true;
}
