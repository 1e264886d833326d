// The tree of a package. Its plan holds names only as the outermost object of each leaf, and sets as they are rendered: complements are in the
// coefficients, paint and names at the leaves. So the parts of a group that belong to one object are put under its name.
#include <math.h>
#include <stdlib.h>

#include "compiler/field.h"
#include "compiler/param.h"
#include "compiler/tape.h"
#include "runtime/tree.h"

typedef struct Maker {
    Tree *tree;
    const Plan *plan;
    const double *values;
    TreeMovers *movers; // of each slot
} Maker;

static void join_slots(Maker *m, TreeMovers *movers, Slot slot, uint32_t count)
{
    for (uint32_t k = 0; k < count && slot + k < m->plan->slot_count; k++)
        *movers = tree_join_movers(m->tree, *movers, m->movers[slot + k]);
}

enum { QUADRIC_SLOTS = 10, MATRIX_SLOTS = 12 };

// The slots that the steps of a tape name.
static void join_tape(Maker *m, TreeMovers *movers, const TapeStep *steps, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++)
        if (TAPE_OP(steps[k].word) == TAPE_NUMBER || steps[k].word & TAPE_LITERAL) join_slots(m, movers, steps[k].b, 1);
}

// The slots that a field program names, as field.h says. Returns the index behind it.
static uint32_t join_field(Maker *m, TreeMovers *movers, uint32_t at)
{
    FieldCode code = {m->plan->operands + at + 1, m->plan->operands[at]};
    for (uint32_t k = 0; k < code.count; k = field_after(code, k)) {
        uint32_t operand = k + 1 < code.count ? code.words[k + 1] : 0;
        switch ((FieldOp)code.words[k]) {
        case FIELD_QUADRIC: join_slots(m, movers, operand, QUADRIC_SLOTS); break;
        case FIELD_ENTER: join_slots(m, movers, operand, MATRIX_SLOTS); break;
        case FIELD_SHOW:
        case FIELD_MIX: join_slots(m, movers, operand, 1); break;
        case FIELD_CUBE:
            join_slots(m, movers, operand, 1);
            join_slots(m, movers, code.words[k + 2], 1);
            break;
        case FIELD_TAPE: join_tape(m, movers, (const TapeStep *)(code.words + k + 2), operand); break;
        default: break;
        }
    }
    return at + 1 + code.count;
}

static TreeMovers step_movers(Maker *m, const PlanStep *step)
{
    const uint32_t *operands = m->plan->operands;
    TreeMovers movers = NULL;
    uint32_t at = step->first, end = step->first + step->count, fields = 0, matrices = 0;
    switch ((StepKind)step->kind) {
    case STEP_MATRIX: matrices = step->op == OP_COMPOSE ? 2 : step->op == OP_INVERSE; break;
    case STEP_QUADRIC:
        join_slots(m, &movers, operands[at++], QUADRIC_SLOTS);
        matrices = 1;
        break;
    case STEP_PLACE:
    case STEP_AT: fields = 1; break;
    case STEP_HEIGHT: fields = 2, matrices = 1; break;
    case STEP_STEEPNESS: fields = 1, matrices = 1; break;
    case STEP_SCALAR:
    case STEP_GATHER:
    case STEP_ASSERT: break;
    }
    while (fields--) at = join_field(m, &movers, at);
    while (matrices--) join_slots(m, &movers, operands[at++], MATRIX_SLOTS);
    while (at < end) join_slots(m, &movers, operands[at++], 1);
    return movers;
}

static void find_movers(Maker *m)
{
    const Plan *plan = m->plan;
    m->movers[plan->time] = tree_mover(m->tree, 0);
    m->movers[plan->frame] = tree_mover(m->tree, 1);
    for (uint32_t k = 0; k < plan->param_count; k++) {
        const IrParam *param = &plan->params[k];
        for (int i = 0; !param->structure && i < param_size(param->type); i++)
            m->movers[plan->inputs + param->slot + (uint32_t)i] = tree_mover(m->tree, 2 + k);
    }
    for (uint32_t i = 0; i < plan->step_count; i++) {
        const PlanStep *step = &plan->steps[i];
        if (step->kind == STEP_ASSERT) continue;
        TreeMovers movers = step_movers(m, step);
        for (uint32_t k = 0; k < plan_step_width(step); k++) m->movers[step->result + k] = movers;
    }
}

static void take_movers(Maker *m, TreeNode *node, Slot slot, uint32_t count)
{
    join_slots(m, &node->movers, slot, count);
    node->rate = node->movers ? RATE_FRAME : RATE_CONST;
}

static TreeNode *make_group(Maker *m, uint32_t index);

static void add_supports(Maker *m, TreeNode *node, const PlanLeaf *leaf)
{
    node->kind = TREE_FREEFORM;
    node->class = CLASS_FREEFORM;
    node->supports = leaf->count + leaf->lift_count;
    for (uint32_t k = leaf->begin; k < leaf->begin + leaf->count; k++) {
        const PlanPerturbation *p = &m->plan->perturbations[k];
        Bounds support = bounds_of_quadric(m->values + p->quadric);
        support = tree_meeting(support, &node->inside);
        node->cost += tree_crossed(m->tree, &support);
        take_movers(m, node, p->quadric, QUADRIC_SLOTS);
        take_movers(m, node, p->strength, 1);
    }
    for (uint32_t k = leaf->copies; k < leaf->copies + leaf->copy_count; k++) {
        const PlanCopy *copy = &m->plan->copies[k];
        const PlanCluster *cluster = &m->plan->clusters[copy->cluster];
        take_movers(m, node, copy->matrix, MATRIX_SLOTS);
        take_movers(m, node, copy->strength, 1);
        node->supports += cluster->count;
        node->cost += tree_crossed(m->tree, &node->inside); // its perturbations' own boxes are not made for each copy
        for (uint32_t n = cluster->begin; n < cluster->begin + cluster->count; n++) {
            take_movers(m, node, m->plan->perturbations[n].quadric, QUADRIC_SLOTS);
            take_movers(m, node, m->plan->perturbations[n].strength, 1);
        }
    }
    for (uint32_t k = leaf->lifts; k < leaf->lifts + leaf->lift_count; k++) {
        take_movers(m, node, m->plan->lifts[k].frame, MATRIX_SLOTS);
        take_movers(m, node, m->plan->lifts[k].strength, 1);
        take_movers(m, node, m->plan->time, 1); // a patch moves by itself
        node->cost += tree_crossed(m->tree, &node->inside);
    }
}

static void add_tape(Maker *m, TreeNode *node, const PlanTape *tape)
{
    join_tape(m, &node->movers, m->plan->tape_steps + tape->first, tape->count);
    node->rate = node->movers ? RATE_FRAME : RATE_CONST;
}

// A general field or a patch.
static TreeNode *make_field(Maker *m, const PlanLeaf *leaf)
{
    TreeNode *node = tree_node(m->tree, TREE_FIELD);
    node->class = CLASS_GENERAL;
    take_movers(m, node, leaf->quadric, MATRIX_SLOTS);
    if (leaf->kind == LEAF_FIELD) {
        add_tape(m, node, &m->plan->tapes[leaf->begin]);
    } else {
        node->word = leaf->kind == LEAF_THICK ? "thick patch" : "patch";
        if (leaf->kind == LEAF_THICK) take_movers(m, node, leaf->thickness, 1);
        take_movers(m, node, m->plan->time, 1);
    }
    return node;
}

static TreeNode *make_leaf(Maker *m, const PlanLeaf *leaf)
{
    if (leaf->kind == LEAF_GROUP) return make_group(m, leaf->begin);
    bool field = leaf->kind == LEAF_FIELD || leaf->kind == LEAF_SHEET || leaf->kind == LEAF_THICK;
    TreeNode *node = field ? make_field(m, leaf) : tree_quadric(m->tree, m->values + leaf->quadric);
    if (!field) take_movers(m, node, leaf->quadric, QUADRIC_SLOTS);
    node->inside = bounds_of_leaf(m->plan, m->values, leaf);
    node->cost = tree_crossed(m->tree, &node->inside);
    if (leaf->kind == LEAF_FREEFORM) add_supports(m, node, leaf);
    node->plain = leaf->kind == LEAF_QUADRIC;
    if (leaf->shown != NO_SLOT) {
        node->conditional = m->movers[leaf->shown] != NULL;
        take_movers(m, node, leaf->shown, 1);
        node->hidden = m->values[leaf->shown] == 0;
        node->plain &= !node->hidden;
        if (node->hidden) node->cost = 0;
    }
    node->material = tree_material(m->tree, arena_printf(m->tree->arena, "material %u", leaf->material));
    return node;
}

static void add(Maker *m, TreeNode *set, TreeNode *part)
{
    set->movers = tree_join_movers(m->tree, set->movers, part->movers);
    set->rate = set->movers ? RATE_FRAME : RATE_CONST;
    if (part->class == CLASS_GENERAL) set->class = CLASS_GENERAL;
    tree_add(m->tree, set, part, false);
}

static TreeNode *make_shape(Maker *m, const PlanShape *shape, uint32_t leaf_begin, uint32_t *next)
{
    const PlanShapeNode *node = &shape->nodes[(*next)++];
    if (node->kind != SHAPE_UNION && node->kind != SHAPE_INTERSECT)
        return make_leaf(m, &m->plan->leaves[leaf_begin + node->leaf]);
    TreeNode *set = tree_node(m->tree, node->kind == SHAPE_UNION ? TREE_UNION : TREE_INTERSECTION);
    for (uint32_t k = 0; k < node->count; k++) add(m, set, make_shape(m, shape, leaf_begin, next));
    tree_finish(m->tree, set);
    return set;
}

static TreeNode *make_component(Maker *m, const PlanComponent *component)
{
    uint32_t next = 0;
    return make_shape(m, &m->plan->shapes[component->shape], component->leaf_begin, &next);
}

// The first leaf of a component that is no group, which says where the scene has it and whose it is.
static const PlanLeaf *first_leaf(const Plan *plan, const PlanComponent *component)
{
    const PlanLeaf *leaf = &plan->leaves[component->leaf_begin];
    while (leaf->kind == LEAF_GROUP) {
        const PlanGroup *group = &plan->groups[leaf->begin];
        if (!group->component_count) break;
        leaf = &plan->leaves[plan->components[group->component_begin].leaf_begin];
    }
    return leaf;
}

typedef struct Part {
    const PlanComponent *component;
    uint32_t object, order;
} Part;

static int by_order(const void *a, const void *b)
{
    const Part *x = a, *y = b;
    return (x->order > y->order) - (x->order < y->order);
}

static TreeNode *make_group(Maker *m, uint32_t index)
{
    const PlanGroup *group = &m->plan->groups[index];
    bool united = m->plan->group_types[group->type].set == SET_UNION;
    TreeNode *set = tree_node(m->tree, united ? TREE_UNION : TREE_INTERSECTION);
    for (uint32_t k = 0; k < group->component_count; k++)
        add(m, set, make_component(m, &m->plan->components[group->component_begin + k]));
    tree_finish(m->tree, set);
    return set;
}

// All parts of one object, from `i` on, under its name.
static TreeNode *make_object(Maker *m, const Part *parts, uint32_t count, uint32_t *i)
{
    uint32_t object = parts[*i].object;
    if (!object || !m->plan->objects[object].name[0]) return make_component(m, parts[(*i)++].component);
    TreeNode *set = tree_node(m->tree, TREE_UNION);
    for (; *i < count && parts[*i].object == object; (*i)++) add(m, set, make_component(m, parts[*i].component));
    tree_finish(m->tree, set);
    set->name = m->plan->objects[object].name;
    return set;
}

static TreeNode *make_scene(Maker *m)
{
    const PlanGroup *group = &m->plan->groups[0];
    Part *parts = arena_array(m->tree->arena, Part, group->component_count);
    for (uint32_t k = 0; k < group->component_count; k++) {
        const PlanComponent *component = &m->plan->components[group->component_begin + k];
        const PlanLeaf *leaf = first_leaf(m->plan, component);
        bool known = leaf->kind != LEAF_GROUP;
        parts[k] = (Part){component, known ? leaf->object : 0, known ? leaf->order : 0};
    }
    if (group->component_count) qsort(parts, group->component_count, sizeof *parts, by_order);
    TreeNode *scene = tree_node(m->tree, TREE_UNION);
    for (uint32_t i = 0; i < group->component_count;) add(m, scene, make_object(m, parts, group->component_count, &i));
    tree_finish(m->tree, scene);
    return scene;
}

Tree *tree_of_plan(Arena *arena, const Plan *plan, const TreeMoment *moment)
{
    Arena scratch = {0};
    Maker m = {.tree = tree_new(arena, plan, moment->values), .plan = plan, .values = moment->values};
    m.movers = arena_array(&scratch, TreeMovers, plan->slot_count);
    find_movers(&m);
    m.tree->root = make_scene(&m);
    arena_release(&scratch);
    return m.tree;
}
