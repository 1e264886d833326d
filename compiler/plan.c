#include "compiler/plan.h"

#include <math.h>

#include "compiler/eval.h"
#include "compiler/quadric.h"
#include "compiler/tape.h"

static double field_leaf_at(const Plan *plan, const double *values, const PlanLeaf *leaf, const double point[3])
{
    Arena scratch = {0};
    const PlanTape *tape = &plan->tapes[leaf->begin];
    double local[3], *work = arena_array(&scratch, double, TAPE_WORK *(size_t)(TAPE_POINT + tape->count));
    matrix_point(values + leaf->quadric, point, local);
    double f = tape_at(plan, tape, values, local, work).f;
    arena_release(&scratch);
    return isnan(f) ? -INFINITY : f; // what is undefined is outside
}

static double perturbed(const Plan *plan, const double *values, uint32_t begin, uint32_t count, const double point[3])
{
    double sum = 0;
    for (uint32_t k = begin; k < begin + count; k++) {
        const PlanPerturbation *perturbation = &plan->perturbations[k];
        double q = quadric_at(values + perturbation->quadric, point);
        if (q > 0) sum += values[perturbation->strength] * q * q * q;
    }
    return sum;
}

double plan_leaf_field(const Plan *plan, const double *values, const PlanLeaf *leaf, const double point[3])
{
    if (leaf->shown != NO_SLOT && values[leaf->shown] == 0) return -INFINITY;
    if (leaf->kind == LEAF_FIELD) return field_leaf_at(plan, values, leaf, point);
    if (leaf->kind == LEAF_SHEET || leaf->kind == LEAF_THICK) return -INFINITY;
    double f = quadric_at(values + leaf->quadric, point);
    if (leaf->kind != LEAF_FREEFORM) return f;
    f += perturbed(plan, values, leaf->begin, leaf->count, point);
    for (uint32_t k = leaf->copies; k < leaf->copies + leaf->copy_count; k++) {
        const PlanCopy *copy = &plan->copies[k];
        const PlanCluster *cluster = &plan->clusters[copy->cluster];
        double inverse[12], local[3];
        if (!matrix_inverse(values + copy->matrix, inverse)) continue;
        matrix_point(inverse, point, local);
        f += values[copy->strength] * perturbed(plan, values, cluster->begin, cluster->count, local);
    }
    return f;
}

// F and who decides it, of what has been looked at so far.
typedef struct Decided {
    double f;
    uint32_t leaf, order;
} Decided;

typedef struct At {
    const Plan *plan;
    const double *values;
    const double *point;
} At;

static void decide(Decided *best, Decided next, bool maximum)
{
    bool better = maximum ? next.f > best->f : next.f < best->f;
    if (better || (next.f == best->f && next.order < best->order)) *best = next;
}

static Decided nothing(bool maximum)
{
    return (Decided){maximum ? -INFINITY : INFINITY, UINT32_MAX, UINT32_MAX};
}

static Decided group_at(const At *at, uint32_t index);

// The tree whose root is node `*next` of the shape; `*next` goes behind it.
static Decided tree_at(const At *at, const PlanShape *shape, uint32_t leaf_begin, uint32_t *next)
{
    const PlanShapeNode *node = &shape->nodes[(*next)++];
    if (node->kind == SHAPE_UNION || node->kind == SHAPE_INTERSECT) {
        bool maximum = node->kind == SHAPE_UNION;
        Decided best = nothing(maximum);
        for (uint32_t k = 0; k < node->count; k++) decide(&best, tree_at(at, shape, leaf_begin, next), maximum);
        return best;
    }
    const PlanLeaf *leaf = &at->plan->leaves[leaf_begin + node->leaf];
    if (node->kind == SHAPE_GROUP) return group_at(at, leaf->begin);
    return (Decided){plan_leaf_field(at->plan, at->values, leaf, at->point), leaf_begin + node->leaf, leaf->order};
}

static Decided component_at(const At *at, uint32_t index)
{
    const PlanComponent *component = &at->plan->components[index];
    uint32_t next = 0;
    return tree_at(at, &at->plan->shapes[component->shape], component->leaf_begin, &next);
}

static Decided group_at(const At *at, uint32_t index)
{
    const PlanGroup *group = &at->plan->groups[index];
    bool maximum = at->plan->group_types[group->type].set == SET_UNION;
    Decided best = nothing(maximum);
    for (uint32_t k = 0; k < group->component_count; k++)
        decide(&best, component_at(at, group->component_begin + k), maximum);
    return best;
}

double plan_component_field(const Plan *plan, const double *values, uint32_t component, const double point[3],
                            uint32_t *leaf)
{
    Decided decided = component_at(&(At){plan, values, point}, component);
    if (leaf) *leaf = decided.leaf;
    return decided.f;
}

double plan_field(const Plan *plan, const double *values, const double point[3], uint32_t *leaf)
{
    Decided decided = group_at(&(At){plan, values, point}, 0);
    if (leaf) *leaf = decided.leaf;
    return decided.f;
}

uint32_t plan_step_width(const PlanStep *step)
{
    switch ((StepKind)step->kind) {
    case STEP_GATHER: return step->count;
    case STEP_QUADRIC: return 10;
    case STEP_MATRIX:
    case STEP_PLACE: return 12;
    case STEP_ASSERT: return 0;
    default: return 1;
    }
}

bool *plan_computed(const Plan *plan, Arena *arena)
{
    bool *computed = arena_array(arena, bool, plan->slot_count);
    computed[plan->time] = computed[plan->frame] = true;
    for (uint32_t k = 0; k < plan->input_count; k++) computed[plan->inputs + k] = true;
    for (uint32_t s = 0; s < plan->step_count; s++) {
        const PlanStep *step = &plan->steps[s];
        for (uint32_t k = 0; k < plan_step_width(step); k++) computed[step->result + k] = true;
    }
    return computed;
}
