// A component's middle is that of the sum of its bounded quadrics, each by its size: exact for one ellipsoid and for boxes of three slabs, and inside of what
// an intersection leaves of several. It only orders, so it need not be more.
#include "runtime/spatial.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define GROUP_DEPTH 8          // of groups in groups that are looked into
#define CELLS       (1u << 20) // along each axis of the box around a run

typedef struct Placed {
    double at[3];
    uint64_t key;
    uint32_t index;
} Placed;

// Adds a quadric that is bounded in some direction, by the size of its quadratic part.
static void add_bounded(const double q[10], double sum[10])
{
    double size = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + 0.5 * (q[3] * q[3] + q[4] * q[4] + q[5] * q[5]));
    if (!(q[0] + q[1] + q[2] < 0) || !(size > 0) || !isfinite(size)) return;
    for (int k = 0; k < 10; k++) sum[k] += q[k] / size;
}

static double determinant(const double a[3], const double b[3], const double c[3])
{
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

// Where the gradient is 0, by Cramer's rule; the origin where that is no point.
static void middle_of(const double q[10], double at[3])
{
    const double x[3] = {2 * q[0], q[3], q[4]}, y[3] = {q[3], 2 * q[1], q[5]}, z[3] = {q[4], q[5], 2 * q[2]};
    const double right[3] = {-q[6], -q[7], -q[8]};
    double whole = determinant(x, y, z);
    at[0] = determinant(right, y, z) / whole;
    at[1] = determinant(x, right, z) / whole;
    at[2] = determinant(x, y, right) / whole;
    for (int k = 0; k < 3; k++)
        if (!isfinite(at[k])) at[k] = 0;
}

static void add_component(const Plan *plan, const PlanComponent *component, int depth, double sum[10])
{
    for (uint32_t k = 0; k < plan->shapes[component->shape].leaf_count; k++) {
        const PlanLeaf *leaf = &plan->leaves[component->leaf_begin + k];
        if (leaf->kind == LEAF_QUADRIC || leaf->kind == LEAF_FREEFORM) {
            add_bounded(plan->image + leaf->quadric, sum);
        } else if (leaf->kind == LEAF_GROUP && depth < GROUP_DEPTH && plan->groups[leaf->begin].component_count) {
            add_component(plan, &plan->components[plan->groups[leaf->begin].component_begin], depth + 1, sum);
        }
    }
}

// The lowest 20 bits, each followed by two zeros.
static uint64_t spread_bits(uint64_t x)
{
    x = (x | x << 32) & 0x001f00000000ffffu;
    x = (x | x << 16) & 0x001f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;
}

static int by_key(const void *a, const void *b)
{
    const Placed *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    return x->index < y->index ? -1 : x->index > y->index;
}

// Orders a run whose places are known, and writes its indices.
static void order_run(Placed *run, uint32_t count, uint32_t *order)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t k = 0; k < count; k++) {
        for (int axis = 0; axis < 3; axis++) {
            low[axis] = fmin(low[axis], run[k].at[axis]);
            high[axis] = fmax(high[axis], run[k].at[axis]);
        }
    }
    for (uint32_t k = 0; k < count; k++) {
        run[k].key = 0;
        for (int axis = 0; axis < 3; axis++) {
            double part = (run[k].at[axis] - low[axis]) / (high[axis] - low[axis]);
            uint64_t cell = part > 0 && part <= 1 ? (uint64_t)(part * (CELLS - 1)) : 0;
            run[k].key |= spread_bits(cell) << axis;
        }
    }
    qsort(run, count, sizeof *run, by_key);
    for (uint32_t k = 0; k < count; k++) order[k] = run[k].index;
}

static void order_components(const Plan *plan, Placed *run, uint32_t begin, uint32_t count, uint32_t *order)
{
    if (count < SPATIAL_LEAST) return;
    for (uint32_t k = 0; k < count; k++) {
        double sum[10] = {0};
        add_component(plan, &plan->components[begin + k], 0, sum);
        run[k].index = begin + k;
        middle_of(sum, run[k].at);
    }
    order_run(run, count, order + begin);
}

static void order_perturbations(const Plan *plan, Placed *run, uint32_t begin, uint32_t count, uint32_t *order)
{
    if (count < SPATIAL_LEAST) return;
    for (uint32_t k = 0; k < count; k++) {
        run[k].index = begin + k;
        middle_of(plan->image + plan->perturbations[begin + k].quadric, run[k].at);
    }
    order_run(run, count, order + begin);
}

bool spatial_order(const Plan *plan, uint32_t *components, uint32_t *perturbations)
{
    uint32_t most = plan->component_count > plan->perturbation_count ? plan->component_count : plan->perturbation_count;
    Placed *run = calloc(most + 1u, sizeof *run);
    if (!run) return false;
    for (uint32_t k = 0; k < plan->component_count; k++) components[k] = k;
    for (uint32_t k = 0; k < plan->perturbation_count; k++) perturbations[k] = k;
    for (uint32_t g = 0; g < plan->group_count; g++) {
        uint32_t begin = plan->groups[g].component_begin, end = begin + plan->groups[g].component_count;
        while (begin < end) { // a run of one shape
            uint32_t next = begin + 1;
            while (next < end && plan->components[next].shape == plan->components[begin].shape) next++;
            order_components(plan, run, begin, next - begin, components);
            begin = next;
        }
    }
    for (uint32_t k = 0; k < plan->leaf_count; k++)
        if (plan->leaves[k].kind == LEAF_FREEFORM)
            order_perturbations(plan, run, plan->leaves[k].begin, plan->leaves[k].count, perturbations);
    free(run);
    return true;
}
