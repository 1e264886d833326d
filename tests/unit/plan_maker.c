#include "tests/unit/plan_maker.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAX_LEAVES        4096
#define MAX_PERTURBATIONS 8192
#define MAX_COMPONENTS    4096
#define MAX_GROUPS        512
#define MAX_LIGHTS        40
#define SLOTS             ((MAX_LEAVES + MAX_PERTURBATIONS) * 11 + MAX_LIGHTS * 14 + 64)

typedef struct MadeLeaf {
    PlanLeaf leaf;
} MadeLeaf;

typedef struct MadeComponent {
    MakerShape shape;
    PlanLeaf leaves[8];
    uint32_t leaf_count;
} MadeComponent;

struct Maker {
    uint64_t state;
    double values[SLOTS];
    Slot next;
    MadeComponent components[MAX_COMPONENTS];
    uint32_t component_count;
    PlanPerturbation perturbations[MAX_PERTURBATIONS];
    uint32_t perturbation_count;
    // Groups hold single quadrics.
    PlanLeaf group_leaves[MAX_LEAVES];
    uint32_t group_begin[MAX_GROUPS], group_count[MAX_GROUPS], groups, group_leaf_count;
    bool in_group;
    uint32_t order;
    bool orthographic;
    PlanLight lights[MAX_LIGHTS];
    uint32_t light_count;
    Slot camera, background, material;

    Plan plan;
    PlanShape shapes[MAKER_SHAPES];
    PlanShapeNode nodes[MAKER_SHAPES][8];
    PlanGroupType types[3];
    uint32_t type_shapes[1 + MAKER_SHAPES];
    PlanGroup plan_groups[MAX_GROUPS + 1];
    PlanComponent plan_components[MAX_COMPONENTS + MAX_LEAVES];
    PlanLeaf plan_leaves[MAX_LEAVES];
    PlanMaterial plan_material;
    PlanObject object;
};

double maker_random(Maker *m, double low, double high)
{
    // splitmix64
    uint64_t z = m->state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return low + (high - low) * (double)(z >> 11) * 0x1p-53;
}

int maker_choice(Maker *m, int count)
{
    return (int)maker_random(m, 0, count);
}

static Slot put(Maker *m, const double *values, uint32_t count)
{
    if (m->next + count > SLOTS) abort();
    memcpy(m->values + m->next, values, count * sizeof *values);
    m->next += count;
    return m->next - count;
}

static void make_shapes(Maker *m)
{
    static const struct {
        int count;
        PlanShapeNode nodes[8];
        uint32_t leaves;
    } made[MAKER_SHAPES] = {
        [MAKER_QUADRIC] = {1, {{SHAPE_QUADRIC, 0, 0}}, 1},
        [MAKER_FREEFORM] = {1, {{SHAPE_FREEFORM, 0, 0}}, 1},
        [MAKER_MEET] = {5,
                        {{SHAPE_INTERSECT, 4, 0},
                         {SHAPE_QUADRIC, 0, 0},
                         {SHAPE_QUADRIC, 0, 1},
                         {SHAPE_QUADRIC, 0, 2},
                         {SHAPE_QUADRIC, 0, 3}},
                        4},
        [MAKER_TREE] = {8,
                        {{SHAPE_UNION, 2, 0},
                         {SHAPE_INTERSECT, 2, 0},
                         {SHAPE_QUADRIC, 0, 0},
                         {SHAPE_UNION, 2, 0},
                         {SHAPE_QUADRIC, 0, 1},
                         {SHAPE_QUADRIC, 0, 2},
                         {SHAPE_INTERSECT, 1, 0},
                         {SHAPE_QUADRIC, 0, 3}},
                        4},
        [MAKER_CARVED] =
            {4, {{SHAPE_INTERSECT, 3, 0}, {SHAPE_FREEFORM, 0, 0}, {SHAPE_QUADRIC, 0, 1}, {SHAPE_FREEFORM, 0, 2}}, 3},
        [MAKER_GROUPED] = {4,
                           {{SHAPE_INTERSECT, 3, 0}, {SHAPE_QUADRIC, 0, 0}, {SHAPE_GROUP, 0, 1}, {SHAPE_GROUP, 1, 2}},
                           3},
    };
    for (int k = 0; k < MAKER_SHAPES; k++) {
        memcpy(m->nodes[k], made[k].nodes, sizeof made[k].nodes);
        m->shapes[k] = (PlanShape){m->nodes[k], (uint32_t)made[k].count, made[k].leaves};
        m->type_shapes[1 + k] = (uint32_t)k;
    }
    m->type_shapes[0] = MAKER_QUADRIC;
    m->types[0] = (PlanGroupType){SET_UNION, m->type_shapes, 1};
    m->types[1] = (PlanGroupType){SET_INTERSECT, m->type_shapes, 1};
    m->types[2] = (PlanGroupType){SET_UNION, m->type_shapes + 1, MAKER_SHAPES};
}

Maker *maker_new(uint64_t seed)
{
    Maker *m = calloc(1, sizeof *m);
    if (!m) abort();
    m->state = seed;
    make_shapes(m);
    maker_clear(m);
    return m;
}

void maker_free(Maker *m)
{
    free(m);
}

void maker_clear(Maker *m)
{
    m->next = m->component_count = m->perturbation_count = m->groups = m->group_leaf_count = m->order = m->light_count =
        0;
    m->in_group = false;
    const double material[11] = {0.8, 0.5, 0.3, 0.1, 0.7, 0.3, 20, 0, 0, 1.5, 0}, background[4] = {0.1, 0.1, 0.2, 0},
                 camera[15] = {0};
    m->material = put(m, material, 11);
    m->background = put(m, background, 4);
    m->camera = put(m, camera, 15);
}

static PlanLeaf new_leaf(Maker *m, uint32_t kind, const double q[10])
{
    PlanLeaf leaf = {.kind = kind, .order = m->order++, .shown = NO_SLOT, .begin = m->perturbation_count};
    if (q) leaf.quadric = put(m, q, 10);
    return leaf;
}

void maker_begin(Maker *m, MakerShape shape)
{
    if (m->component_count == MAX_COMPONENTS) abort();
    m->components[m->component_count] = (MadeComponent){.shape = shape};
    m->in_group = false;
}

// Which kind the next leaf of the component is.
static uint32_t next_kind(const Maker *m, const MadeComponent *c)
{
    const PlanShape *shape = &m->shapes[c->shape];
    for (uint32_t k = 0; k < shape->node_count; k++) {
        const PlanShapeNode *node = &shape->nodes[k];
        if (node->kind == SHAPE_UNION || node->kind == SHAPE_INTERSECT || node->leaf != c->leaf_count) continue;
        return node->kind == SHAPE_QUADRIC ? LEAF_QUADRIC : node->kind == SHAPE_FREEFORM ? LEAF_FREEFORM : LEAF_GROUP;
    }
    abort();
}

void maker_quadric(Maker *m, const double q[10])
{
    MadeComponent *c = &m->components[m->component_count];
    if (m->in_group) {
        m->group_leaves[m->group_leaf_count++] = new_leaf(m, LEAF_QUADRIC, q);
        m->group_count[m->groups - 1]++;
        return;
    }
    uint32_t kind = next_kind(m, c);
    c->leaves[c->leaf_count++] = new_leaf(m, kind, q);
}

void maker_perturbation(Maker *m, const double q[10], double strength)
{
    MadeComponent *c = &m->components[m->component_count];
    if (m->perturbation_count == MAX_PERTURBATIONS) abort();
    m->perturbations[m->perturbation_count++] = (PlanPerturbation){put(m, q, 10), put(m, &strength, 1)};
    c->leaves[c->leaf_count - 1].count++;
}

void maker_group(Maker *m)
{
    MadeComponent *c = &m->components[m->component_count];
    if (m->groups == MAX_GROUPS) abort();
    PlanLeaf leaf = new_leaf(m, LEAF_GROUP, NULL);
    leaf.begin = 1 + m->groups;
    leaf.count = 1;
    c->leaves[c->leaf_count++] = leaf;
    m->group_begin[m->groups] = m->group_leaf_count;
    m->group_count[m->groups] = 0;
    m->groups++;
    m->in_group = true;
}

void maker_end(Maker *m)
{
    MadeComponent *c = &m->components[m->component_count++];
    if (c->leaf_count != m->shapes[c->shape].leaf_count) abort();
    m->in_group = false;
}

void maker_camera(Maker *m, const double eye[3], const double look_at[3], double fov, double height, bool orthographic)
{
    double *c = m->values + m->camera;
    memcpy(c, eye, 3 * sizeof *c);
    memcpy(c + 3, look_at, 3 * sizeof *c);
    c[6] = 0.1, c[7] = 1, c[8] = 0.05;
    c[9] = fov;
    c[10] = height;
    m->orthographic = orthographic;
}

static void add_light(Maker *m, uint32_t kind, const double v[6])
{
    double values[14] = {v[0], v[1], v[2], v[3], v[4], v[5], 1, 1, 1, 0, 0, 0, 0, 1};
    if (m->light_count == MAX_LIGHTS) abort();
    m->lights[m->light_count++] = (PlanLight){kind, put(m, values, 14)};
}

void maker_directional(Maker *m, double x, double y, double z)
{
    add_light(m, LIGHT_DIRECTIONAL, (const double[6]){x, y, z});
}

void maker_point(Maker *m, double x, double y, double z)
{
    add_light(m, LIGHT_POINT, (const double[6]){0, 0, 0, x, y, z});
}

const Plan *maker_plan(Maker *m)
{
    uint32_t components = 0, leaves = 0;
    for (int shape = 0; shape < MAKER_SHAPES; shape++) { // components are sorted by shape
        for (uint32_t k = 0; k < m->component_count; k++) {
            const MadeComponent *c = &m->components[k];
            if (c->shape != (MakerShape)shape) continue;
            m->plan_components[components++] = (PlanComponent){(uint32_t)shape, leaves};
            for (uint32_t n = 0; n < c->leaf_count; n++) m->plan_leaves[leaves++] = c->leaves[n];
        }
    }
    m->plan_groups[0] = (PlanGroup){2, 0, components};
    for (uint32_t g = 0; g < m->groups; g++) {
        // The first group of a MAKER_GROUPED component is a union, the second an intersection.
        m->plan_groups[1 + g] = (PlanGroup){g % 2, components, m->group_count[g]};
        for (uint32_t n = 0; n < m->group_count[g]; n++) {
            m->plan_components[components++] = (PlanComponent){MAKER_QUADRIC, leaves};
            m->plan_leaves[leaves++] = m->group_leaves[m->group_begin[g] + n];
        }
    }
    m->plan_material = (PlanMaterial){m->material, 20};
    m->object = (PlanObject){.name = ""};
    m->plan = (Plan){.slot_count = m->next,
                     .image = m->values,
                     .groups = m->plan_groups,
                     .group_count = 1 + m->groups,
                     .group_types = m->types,
                     .group_type_count = 3,
                     .shapes = m->shapes,
                     .shape_count = MAKER_SHAPES,
                     .components = m->plan_components,
                     .component_count = components,
                     .leaves = m->plan_leaves,
                     .leaf_count = leaves,
                     .perturbations = m->perturbations,
                     .perturbation_count = m->perturbation_count,
                     .materials = &m->plan_material,
                     .material_count = 1,
                     .objects = &m->object,
                     .object_count = 1,
                     .lights = m->lights,
                     .light_count = m->light_count,
                     .camera = m->camera,
                     .orthographic = m->orthographic,
                     .background = m->background};
    return &m->plan;
}

// Random quadrics.

static void random_axes(Maker *m, double axis[3][3])
{
    for (;;) {
        double v[2][3];
        for (int k = 0; k < 6; k++) v[k / 3][k % 3] = maker_random(m, -1, 1);
        double l = sqrt(v[0][0] * v[0][0] + v[0][1] * v[0][1] + v[0][2] * v[0][2]);
        if (l < 0.1) continue;
        for (int k = 0; k < 3; k++) axis[0][k] = v[0][k] / l;
        double d = v[1][0] * axis[0][0] + v[1][1] * axis[0][1] + v[1][2] * axis[0][2];
        for (int k = 0; k < 3; k++) axis[1][k] = v[1][k] - d * axis[0][k];
        l = sqrt(axis[1][0] * axis[1][0] + axis[1][1] * axis[1][1] + axis[1][2] * axis[1][2]);
        if (l < 0.1) continue;
        for (int k = 0; k < 3; k++) axis[1][k] /= l;
        axis[2][0] = axis[0][1] * axis[1][2] - axis[0][2] * axis[1][1];
        axis[2][1] = axis[0][2] * axis[1][0] - axis[0][0] * axis[1][2];
        axis[2][2] = axis[0][0] * axis[1][1] - axis[0][1] * axis[1][0];
        return;
    }
}

// F = constant + sum of (square (u/r)^2 + linear u/r) along the axes.
void maker_random_quadric(Maker *m, int kind, const double at[3], double size, double q[10])
{
    static const double squares[MAKER_KINDS][3] = {{-1, -1, -1}, {-1, -1, 1}, {-1, -1, 1}, {-1, -1, 1}, {-1, -1, 0},
                                                   {-1, 1, 0},   {-1, -1, 0}, {-1, 0, 0},  {0, 0, 0},   {0, 0, 0}};
    static const double constants[MAKER_KINDS] = {1, 1, -1, 0, 0, 0, 1, 1, 0, 0};
    static const double linears[MAKER_KINDS] = {0, 0, 0, 0, 1, 1, 0, 0, 1, 0};
    double axis[3][3], factor = exp(maker_random(m, -3, 3));
    random_axes(m, axis);
    memset(q, 0, 10 * sizeof *q);
    if (kind == 9) {
        for (int k = 0; k < 9; k++) q[k] = maker_random(m, -1, 1) / (k < 6 ? size * size : size);
        q[9] = maker_random(m, -1, 1);
    }
    q[9] += constants[kind];
    for (int k = 0; k < 3; k++) {
        const double *a = axis[k];
        double r = size * maker_random(m, 0.4, 1.6), s = squares[kind][k] / (r * r), l = k == 2 ? linears[kind] / r : 0;
        double c = a[0] * at[0] + a[1] * at[1] + a[2] * at[2];
        q[0] += s * a[0] * a[0];
        q[1] += s * a[1] * a[1];
        q[2] += s * a[2] * a[2];
        q[3] += 2 * s * a[0] * a[1];
        q[4] += 2 * s * a[0] * a[2];
        q[5] += 2 * s * a[1] * a[2];
        for (int n = 0; n < 3; n++) q[6 + n] += (l - 2 * s * c) * a[n];
        q[9] += s * c * c - l * c;
    }
    for (int k = 0; k < 10; k++) q[k] *= factor;
}

void quadric_negate(double q[10])
{
    for (int k = 0; k < 10; k++) q[k] = -q[k];
}

// Rays, in double.

static double quadric_value(const double *q, const double p[3])
{
    double x = p[0], y = p[1], z = p[2];
    return q[0] * x * x + q[1] * y * y + q[2] * z * z + q[3] * x * y + q[4] * x * z + q[5] * y * z + q[6] * x +
           q[7] * y + q[8] * z + q[9];
}

static double leaf_value(const Maker *m, const PlanLeaf *leaf, const double p[3])
{
    double f = quadric_value(m->values + leaf->quadric, p);
    for (uint32_t k = 0; k < leaf->count; k++) {
        const PlanPerturbation *r = &m->perturbations[leaf->begin + k];
        double q = quadric_value(m->values + r->quadric, p);
        if (q > 0) f += m->values[r->strength] * q * q * q;
    }
    return f;
}

static bool inside_group(const Maker *m, uint32_t group, const double p[3])
{
    const PlanGroup *g = &m->plan_groups[group];
    bool all = m->types[g->type].set == SET_INTERSECT;
    for (uint32_t k = 0; k < g->component_count; k++) {
        const PlanLeaf *leaf = &m->plan_leaves[m->plan_components[g->component_begin + k].leaf_begin];
        if ((leaf_value(m, leaf, p) >= 0) != all) return !all;
    }
    return all;
}

static bool inside_node(const Maker *m, const PlanShape *shape, const PlanLeaf *leaves, uint32_t *at, const double p[3])
{
    const PlanShapeNode *node = &shape->nodes[(*at)++];
    if (node->kind == SHAPE_GROUP) return inside_group(m, leaves[node->leaf].begin, p);
    if (node->kind == SHAPE_QUADRIC || node->kind == SHAPE_FREEFORM) return leaf_value(m, &leaves[node->leaf], p) >= 0;
    bool result = node->kind == SHAPE_INTERSECT;
    for (uint32_t k = 0; k < node->count; k++) {
        bool child = inside_node(m, shape, leaves, at, p);
        result = node->kind == SHAPE_INTERSECT ? result && child : result || child;
    }
    return result;
}

bool maker_inside(const Maker *m, const double p[3])
{
    for (uint32_t k = 0; k < m->plan_groups[0].component_count; k++) {
        const PlanComponent *c = &m->plan_components[k];
        uint32_t at = 0;
        if (inside_node(m, &m->shapes[c->shape], m->plan_leaves + c->leaf_begin, &at, p)) return true;
    }
    return false;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

// Roots of q along the ray, in order to be found in [near, far].
static uint32_t add_roots(const double *q, const double o[3], const double d[3], double near, double far,
                          double *events, uint32_t count)
{
    double a = q[0] * d[0] * d[0] + q[1] * d[1] * d[1] + q[2] * d[2] * d[2] + q[3] * d[0] * d[1] + q[4] * d[0] * d[2] +
               q[5] * d[1] * d[2];
    double b = 2 * (q[0] * o[0] * d[0] + q[1] * o[1] * d[1] + q[2] * o[2] * d[2]) + q[3] * (o[0] * d[1] + o[1] * d[0]) +
               q[4] * (o[0] * d[2] + o[2] * d[0]) + q[5] * (o[1] * d[2] + o[2] * d[1]) + q[6] * d[0] + q[7] * d[1] +
               q[8] * d[2];
    double c = quadric_value(q, o), square = b * b - 4 * a * c;
    if (square < 0) return count;
    double sum = -0.5 * (b + copysign(sqrt(square), b)), roots[2] = {sum / a, c / sum};
    for (int k = 0; k < 2; k++)
        if (roots[k] > near && roots[k] < far) events[count++] = roots[k];
    return count;
}

static bool inside_at(const Maker *m, const double o[3], const double d[3], double t)
{
    const double p[3] = {o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]};
    return maker_inside(m, p);
}

double maker_first(const Maker *m, const double o[3], const double d[3], double near, double far, double step)
{
    const Plan *plan = &m->plan;
    double end = isfinite(far) ? far : 1e9;
    uint32_t count = 0;
    double *events = malloc((2 * (plan->leaf_count + plan->perturbation_count) + 2) * sizeof *events);
    if (!events) abort();
    for (uint32_t k = 0; k < plan->leaf_count; k++)
        if (plan->leaves[k].kind != LEAF_GROUP)
            count = add_roots(m->values + plan->leaves[k].quadric, o, d, near, end, events, count);
    for (uint32_t k = 0; k < plan->perturbation_count; k++)
        count = add_roots(m->values + plan->perturbations[k].quadric, o, d, near, end, events, count);
    events[count++] = near;
    events[count++] = end;
    qsort(events, count, sizeof *events, by_value);
    // Without perturbations nothing changes between events; with them the signs of polynomials may.
    double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    double result = INFINITY, last = near;
    bool first = true, began = false;
    for (uint32_t k = 0; k + 1 < count && !isfinite(result); k++) {
        double span = (events[k + 1] - events[k]) * length;
        int samples = plan->perturbation_count ? 12 + (int)fmin(span / step, 4000) : 1;
        for (int n = 0; n < samples; n++) {
            double t = events[k] + (events[k + 1] - events[k]) * (n + 0.5) / samples;
            bool inside = inside_at(m, o, d, t);
            if (first) began = inside;
            first = false;
            if (inside == began) {
                last = t;
                continue;
            }
            double low = last, high = t;
            for (int halving = 0; halving < 60; halving++) {
                double middle = 0.5 * (low + high);
                if (inside_at(m, o, d, middle) == began)
                    low = middle;
                else
                    high = middle;
            }
            result = high;
            break;
        }
    }
    free(events);
    return result;
}
