#include "compiler/section.h"

#include <math.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/quadric.h"
#include "compiler/tape.h"

typedef struct Section {
    Formula *f;
    const Plan *plan;
    const double *values;
    int axis, across, up;
    double at;
    SectionTrouble *trouble;
    bool ok;
} Section;

void section_axes(const SectionPlane *plane, int axes[2])
{
    axes[0] = plane->axis == 0 ? 1 : 0;
    axes[1] = plane->axis == 2 ? 1 : 2;
}

static uint32_t value(Section *s, double x)
{
    return formula_value(s->f, (float)x);
}

static uint32_t add(Section *s, uint32_t a, uint32_t b)
{
    return formula_op2(s->f, TAPE_ADD, a, b);
}

static uint32_t times(Section *s, double factor, uint32_t a)
{
    return factor == 1 ? a : formula_op2(s->f, TAPE_MUL, a, value(s, factor));
}

// --- conics

typedef struct Conic { // a u² + h u v + b v² + d u + e v + g
    double a, h, b, d, e, g;
} Conic;

// Where the coefficients of x², y², z², xy, xz, yz, x, y, z, 1 stand for two axes.
static int mixed_index(int i, int k)
{
    return i + k == 1 ? 3 : i + k == 2 ? 4 : 5;
}

static Conic conic_of(const Section *s, const double q[10])
{
    int i = s->across, k = s->up, n = s->axis;
    return (Conic){
        .a = q[i],
        .h = q[mixed_index(i, k)],
        .b = q[k],
        .d = q[6 + i] + q[mixed_index(i, n)] * s->at,
        .e = q[6 + k] + q[mixed_index(k, n)] * s->at,
        .g = (q[n] * s->at + q[6 + n]) * s->at + q[9],
    };
}

// The place about which the linear terms vanish, as far as there is one near by.
static void centre_of(const Conic *c, double centre[2])
{
    double determinant = 4 * c->a * c->b - c->h * c->h;
    centre[0] = centre[1] = 0;
    if (c->h == 0) {
        if (c->a != 0) centre[0] = -c->d / (2 * c->a);
        if (c->b != 0) centre[1] = -c->e / (2 * c->b);
    } else if (fabs(determinant) > 1e-6 * c->h * c->h) {
        centre[0] = (c->h * c->e - 2 * c->b * c->d) / determinant;
        centre[1] = (c->h * c->d - 2 * c->a * c->e) / determinant;
    }
    for (int k = 0; k < 2; k++) {
        if (!(fabs(centre[k]) < FORMULA_REACH)) centre[k] = 0;
    }
}

// The conic as a polynomial of u - centre[0] and v - centre[1].
static Conic moved(const Conic *c, const double centre[2])
{
    double u = centre[0], v = centre[1];
    Conic r = *c;
    r.d = c->d + 2 * c->a * u + c->h * v;
    r.e = c->e + 2 * c->b * v + c->h * u;
    r.g = c->g + (c->a * u + c->h * v + c->d) * u + (c->b * v + c->e) * v;
    // What is left of the linear terms is what rounding left.
    if (fabs(r.d) <= 1e-12 * (fabs(c->d) + fabs(c->a * u))) r.d = 0;
    if (fabs(r.e) <= 1e-12 * (fabs(c->e) + fabs(c->b * v))) r.e = 0;
    return r;
}

static uint32_t conic_number(Section *s, const double q[10])
{
    Formula *f = s->f;
    Conic c = conic_of(s, q);
    double centre[2];
    centre_of(&c, centre);
    c = moved(&c, centre);
    uint32_t u = add(s, FORMULA_ACROSS, value(s, -centre[0])), v = add(s, FORMULA_UP, value(s, -centre[1]));
    if (centre[0] == 0) u = FORMULA_ACROSS;
    if (centre[1] == 0) v = FORMULA_UP;
    const double factors[5] = {c.a, c.d, c.b, c.e, c.h};
    uint32_t sum = value(s, c.g);
    bool first = true;
    for (int k = 0; k < 5; k++) {
        if (factors[k] == 0) continue;
        uint32_t term = k == 0   ? formula_op1(f, TAPE_SQUARE, u)
                        : k == 1 ? u
                        : k == 2 ? formula_op1(f, TAPE_SQUARE, v)
                        : k == 3 ? v
                                 : formula_op2(f, TAPE_MUL, u, v);
        term = times(s, factors[k], term);
        sum = first ? term : add(s, sum, term);
        first = false;
    }
    return first ? sum : add(s, sum, value(s, c.g));
}

// strength * max(Q, 0)^3
static uint32_t cube_number(Section *s, const double q[10], double strength)
{
    Formula *f = s->f;
    uint32_t positive = formula_op2(f, TAPE_MAX, conic_number(s, q), value(s, 0));
    return times(s, strength, formula_op2(f, TAPE_MUL, formula_op1(f, TAPE_SQUARE, positive), positive));
}

static uint32_t freeform_number(Section *s, const PlanLeaf *leaf)
{
    uint32_t sum = conic_number(s, s->values + leaf->quadric);
    for (uint32_t k = leaf->begin; k < leaf->begin + leaf->count; k++) {
        const PlanPerturbation *p = &s->plan->perturbations[k];
        sum = add(s, sum, cube_number(s, s->values + p->quadric, s->values[p->strength]));
    }
    for (uint32_t k = leaf->copies; k < leaf->copies + leaf->copy_count; k++) {
        const PlanCopy *copy = &s->plan->copies[k];
        const PlanCluster *cluster = &s->plan->clusters[copy->cluster];
        double inverse[12], q[10];
        if (!matrix_inverse(s->values + copy->matrix, inverse)) continue;
        for (uint32_t n = cluster->begin; n < cluster->begin + cluster->count; n++) {
            const PlanPerturbation *p = &s->plan->perturbations[n];
            if (!quadric_transform(s->values + p->quadric, inverse, q)) continue;
            sum = add(s, sum, cube_number(s, q, s->values[p->strength] * s->values[copy->strength]));
        }
    }
    return sum;
}

// --- general fields

// The field's own coordinates; `map` takes the world there.
static uint32_t coordinate(Section *s, const double row[4])
{
    double constant = row[s->axis] * s->at + row[3];
    uint32_t sum = value(s, constant);
    bool first = constant == 0;
    const int axes[2] = {s->across, s->up};
    for (uint32_t k = 0; k < 2; k++) {
        if (row[axes[k]] == 0) continue;
        uint32_t term = times(s, row[axes[k]], k);
        sum = first ? term : add(s, term, sum);
        first = false;
    }
    return sum;
}

static bool has_number(TapeStep step)
{
    return TAPE_OP(step.word) == TAPE_NUMBER || step.word & TAPE_LITERAL;
}

static float float_of(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static bool has_second(uint32_t op)
{
    return (op >= TAPE_ADD && op <= TAPE_MAX) || op == TAPE_POW || op == TAPE_LSE || op == TAPE_ATAN2 ||
           op == TAPE_MOD || (op >= TAPE_LT && op <= TAPE_OR);
}

static uint32_t step_number(Section *s, TapeStep step, const uint32_t *numbers)
{
    uint32_t op = TAPE_OP(step.word), a = numbers[TAPE_A(step.word)];
    if (op == TAPE_NUMBER) return formula_value(s->f, float_of(step.b));
    if (op == TAPE_POWER) return formula_power(s->f, a, (int32_t)step.b);
    if (TAPE_TAKES_THREE(op)) return formula_op3(s->f, op, a, numbers[step.b & 0xffff], numbers[step.b >> 16]);
    if (!has_second(op)) return formula_op1(s->f, op, a);
    return formula_op2(s->f, op, a, has_number(step) ? formula_value(s->f, float_of(step.b)) : numbers[step.b]);
}

static uint32_t field_number(Section *s, const PlanLeaf *leaf)
{
    Arena scratch = {0};
    const PlanTape *tape = &s->plan->tapes[leaf->begin];
    uint32_t *numbers = arena_array(&scratch, uint32_t, TAPE_POINT + tape->count);
    TapeStep *steps = arena_array(&scratch, TapeStep, tape->count);
    tape_bake(s->plan->tape_steps + tape->first, tape->count, s->values, steps);
    for (uint32_t k = 0; k < TAPE_POINT; k++) numbers[k] = coordinate(s, s->values + leaf->quadric + 4 * k);
    for (uint32_t k = 0; k < tape->count; k++) numbers[TAPE_POINT + k] = step_number(s, steps[k], numbers);
    uint32_t result = numbers[TAPE_POINT + tape->count - 1];
    arena_release(&scratch);
    return result;
}

// --- sets

static uint32_t trouble(Section *s, uint32_t leaf, const char *reason)
{
    if (s->ok) *s->trouble = (SectionTrouble){leaf, reason};
    s->ok = false;
    return FORMULA_FALSE;
}

static uint32_t leaf_condition(Section *s, uint32_t index)
{
    const PlanLeaf *leaf = &s->plan->leaves[index];
    if (leaf->shown != NO_SLOT && s->values[leaf->shown] == 0) return FORMULA_FALSE;
    uint32_t number;
    switch ((PlanLeafKind)leaf->kind) {
    case LEAF_QUADRIC: number = conic_number(s, s->values + leaf->quadric); break;
    case LEAF_FREEFORM:
        if (leaf->lift_count)
            return trouble(s, index, "a patch displaces it, and the heights of a patch are no expression");
        number = freeform_number(s, leaf);
        break;
    case LEAF_FIELD: number = field_number(s, leaf); break;
    case LEAF_SHEET: return trouble(s, index, "a patch is a surface without an inside");
    case LEAF_THICK:
        return trouble(s, index, "it is a patch made thick, and the distance from a patch is no expression");
    default: return trouble(s, index, "it is no expression");
    }
    return formula_compare(s->f, number, true, 0);
}

static uint32_t joined(Section *s, bool either, uint32_t a, uint32_t b)
{
    return either ? formula_or(s->f, a, b) : formula_and(s->f, a, b);
}

static uint32_t group_condition(Section *s, uint32_t index);

// The tree whose root is node `*next` of the shape; `*next` goes behind it.
static uint32_t tree_condition(Section *s, const PlanShape *shape, uint32_t leaf_begin, uint32_t *next)
{
    const PlanShapeNode *node = &shape->nodes[(*next)++];
    if (node->kind == SHAPE_GROUP) return group_condition(s, s->plan->leaves[leaf_begin + node->leaf].begin);
    if (node->kind >= SHAPE_QUADRIC) return leaf_condition(s, leaf_begin + node->leaf);
    bool either = node->kind == SHAPE_UNION;
    uint32_t result = either ? FORMULA_FALSE : FORMULA_TRUE;
    for (uint32_t k = 0; k < node->count; k++)
        result = joined(s, either, result, tree_condition(s, shape, leaf_begin, next));
    return result;
}

// Halves, so that no condition is deep.
static uint32_t components_condition(Section *s, bool either, uint32_t begin, uint32_t end)
{
    if (begin == end) return either ? FORMULA_FALSE : FORMULA_TRUE;
    if (begin + 1 == end) {
        const PlanComponent *component = &s->plan->components[begin];
        uint32_t next = 0;
        return tree_condition(s, &s->plan->shapes[component->shape], component->leaf_begin, &next);
    }
    uint32_t middle = begin + (end - begin) / 2;
    uint32_t first = components_condition(s, either, begin, middle);
    return joined(s, either, first, components_condition(s, either, middle, end));
}

static uint32_t group_condition(Section *s, uint32_t index)
{
    const PlanGroup *group = &s->plan->groups[index];
    bool either = s->plan->group_types[group->type].set == SET_UNION;
    return components_condition(s, either, group->component_begin, group->component_begin + group->component_count);
}

bool section_formula(Formula *f, const Plan *plan, const double *values, const SectionPlane *plane, uint32_t *inside,
                     SectionTrouble *why)
{
    int axes[2];
    section_axes(plane, axes);
    Section s = {.f = f,
                 .plan = plan,
                 .values = values,
                 .axis = plane->axis,
                 .across = axes[0],
                 .up = axes[1],
                 .at = plane->at,
                 .trouble = why,
                 .ok = true};
    *inside = group_condition(&s, 0);
    return s.ok;
}
