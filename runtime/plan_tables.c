#include "runtime/plan_tables.h"

#include <math.h>
#include <stdlib.h>

#include "compiler/field.h"
#include "compiler/frame.h"
#include "compiler/tape.h"

static void span_record(Record *r, Span *span)
{
    record_u32(r, &span->begin);
    record_u32(r, &span->end);
}

static void step_record(Record *r, PlanStep *step)
{
    record_u16(r, &step->kind);
    record_u16(r, &step->op);
    record_u32(r, &step->count);
    record_u32(r, &step->first);
    record_u32(r, &step->result);
    span_record(r, &step->span);
    record_text(r, &step->text);
}

static void group_record(Record *r, PlanGroup *group)
{
    record_u32(r, &group->type);
    record_u32(r, &group->component_begin);
    record_u32(r, &group->component_count);
}

static void group_type_record(Record *r, PlanGroupType *type)
{
    record_u32(r, &type->set);
    record_table(r, type->shapes, type->shape_count, 4, record_u32);
}

static void shape_node_record(Record *r, PlanShapeNode *node)
{
    record_u16(r, &node->kind);
    record_u16(r, &node->count);
    record_u32(r, &node->leaf);
}

static void shape_record(Record *r, PlanShape *shape)
{
    record_table(r, shape->nodes, shape->node_count, 8, shape_node_record);
    record_u32(r, &shape->leaf_count);
}

static void component_record(Record *r, PlanComponent *component)
{
    record_u32(r, &component->shape);
    record_u32(r, &component->leaf_begin);
}

static void leaf_record(Record *r, PlanLeaf *leaf)
{
    record_u32(r, &leaf->kind);
    record_u32(r, &leaf->quadric);
    record_u32(r, &leaf->begin);
    record_u32(r, &leaf->count);
    record_u32(r, &leaf->material);
    record_u32(r, &leaf->object);
    record_u32(r, &leaf->order);
    record_u32(r, &leaf->shown);
    record_u32(r, &leaf->lifts);
    record_u32(r, &leaf->lift_count);
    record_u32(r, &leaf->thickness);
    record_u32(r, &leaf->side);
    record_u32(r, &leaf->copies);
    record_u32(r, &leaf->copy_count);
}

static void cluster_record(Record *r, PlanCluster *cluster)
{
    record_u32(r, &cluster->begin);
    record_u32(r, &cluster->count);
}

static void copy_record(Record *r, PlanCopy *copy)
{
    record_u32(r, &copy->cluster);
    record_u32(r, &copy->strength);
    record_u32(r, &copy->matrix);
}

static void perturbation_record(Record *r, PlanPerturbation *perturbation)
{
    record_u32(r, &perturbation->quadric);
    record_u32(r, &perturbation->strength);
}

static void tape_record(Record *r, PlanTape *tape)
{
    record_u32(r, &tape->first);
    record_u32(r, &tape->count);
}

static void tape_step_record(Record *r, TapeStep *step)
{
    record_u32(r, &step->word);
    record_u32(r, &step->b);
}

static void material_record(Record *r, PlanMaterial *material)
{
    uint32_t shininess = (uint32_t)material->integer_shininess;
    record_u32(r, &material->values);
    record_u32(r, &shininess);
    if (!r->writing) material->integer_shininess = (int32_t)shininess;
}

static void object_record(Record *r, PlanObject *object)
{
    record_text(r, &object->name);
    span_record(r, &object->span);
}

static void light_record(Record *r, PlanLight *light)
{
    record_u32(r, &light->kind);
    record_u32(r, &light->values);
}

static void choices_record(Record *r, IrParam *param)
{
    uint32_t count = 0;
    if (r->writing && param->choices)
        while (param->choices[count]) count++;
    record_count(r, &count, 4);
    if (!count) return;
    const char **choices = (const char **)(uintptr_t)param->choices;
    if (!r->writing) param->choices = choices = arena_array(r->arena, const char *, (size_t)count + 1);
    for (uint32_t i = 0; i < count; i++) record_text(r, &choices[i]);
}

static void param_record(Record *r, IrParam *param)
{
    record_text(r, &param->name);
    record_text(r, &param->doc);
    record_u8(r, &param->type);
    record_bool(r, &param->structure);
    record_bool(r, &param->ranged);
    record_u32(r, &param->slot);
    record_f64s(r, param->value, 3);
    record_f64(r, &param->low);
    record_f64(r, &param->high);
    record_text(r, &param->text);
    choices_record(r, param);
    span_record(r, &param->span);
}

// Values, steps, operands: what a frame's program is made of, and a patch's.
static void program_record(Record *r, Plan *plan)
{
    record_count(r, &plan->slot_count, sizeof(double));
    if (!r->writing) plan->image = arena_array(r->arena, double, plan->slot_count);
    record_f64s(r, plan->image, plan->slot_count);
    record_count(r, &plan->operand_count, sizeof(uint32_t));
    if (!r->writing) plan->operands = arena_array(r->arena, uint32_t, plan->operand_count);
    record_u32s(r, plan->operands, plan->operand_count);
    record_table(r, plan->steps, plan->step_count, 28, step_record);
    record_u32(r, &plan->time);
    record_u32(r, &plan->frame);
    record_u32(r, &plan->inputs);
    record_u32(r, &plan->input_count);
}

static void lift_record(Record *r, PlanLift *lift)
{
    record_u32(r, &lift->patch);
    record_u32(r, &lift->strength);
    record_u32(r, &lift->frame);
    record_u32(r, &lift->low);
    record_u32(r, &lift->high);
}

static void part_record(Record *r, PlanPart *part)
{
    record_u32(r, &part->kind);
    record_u32s(r, part->values, 5);
    record_u32(r, &part->field);
    span_record(r, &part->span);
}

static void run_record(Record *r, PlanRun *run)
{
    record_u32(r, &run->begin);
    record_u32(r, &run->end);
    record_bool(r, &run->points);
    record_bool(r, &run->varies);
    record_bool(r, &run->placed);
}

void plan_patch_record(Record *r, PlanPatch *patch)
{
    record_text(r, &patch->name);
    span_record(r, &patch->span);
    record_u32(r, &patch->nodes);
    record_bool(r, &patch->newmark);
    record_bool(r, &patch->all_tangents);
    record_bool(r, &patch->accurate);
    if (!r->writing) patch->program = arena_new(r->arena, Plan);
    program_record(r, patch->program);
    record_u32(r, &patch->point);
    record_u32(r, &patch->frame_end);
    run_record(r, &patch->edges);
    run_record(r, &patch->force);
    run_record(r, &patch->start);
    record_bool(r, &patch->varies);
    record_u32s(r, patch->model, PATCH_OPERANDS - PATCH_CONSTS);
    record_table(r, patch->parts, patch->part_count, 36, part_record);
    record_u32(r, &patch->box);
}

void plan_record(Record *r, Plan *plan)
{
    program_record(r, plan);
    record_table(r, plan->groups, plan->group_count, 12, group_record);
    record_table(r, plan->group_types, plan->group_type_count, 8, group_type_record);
    record_table(r, plan->shapes, plan->shape_count, 8, shape_record);
    record_table(r, plan->components, plan->component_count, 8, component_record);
    record_table(r, plan->leaves, plan->leaf_count, 56, leaf_record);
    record_table(r, plan->perturbations, plan->perturbation_count, 8, perturbation_record);
    record_table(r, plan->clusters, plan->cluster_count, 8, cluster_record);
    record_table(r, plan->copies, plan->copy_count, 12, copy_record);
    record_table(r, plan->tapes, plan->tape_count, 8, tape_record);
    record_table(r, plan->tape_steps, plan->tape_step_count, 8, tape_step_record);
    record_table(r, plan->materials, plan->material_count, 8, material_record);
    record_table(r, plan->objects, plan->object_count, 12, object_record);
    record_table(r, plan->lights, plan->light_count, 8, light_record);
    record_u32(r, &plan->camera);
    record_bool(r, &plan->orthographic);
    record_u32(r, &plan->background);
    record_table(r, plan->params, plan->param_count, 70, param_record);
    record_table(r, plan->patches, plan->patch_count, 4 * PATCH_OPERANDS, plan_patch_record);
    record_table(r, plan->lifts, plan->lift_count, 20, lift_record);
    record_f64(r, &plan->duration);
    record_f64(r, &plan->fps);
}

// --- checking

static bool slots_fit(const Plan *plan, Slot first, uint32_t count)
{
    return first <= plan->slot_count && count <= plan->slot_count - first;
}

static bool range_fits(uint32_t begin, uint32_t count, uint32_t size)
{
    return begin <= size && count <= size - begin;
}

// Whoever walks a plan does so by recursion, through the nodes of shapes and the groups at their leaves: this many
// levels at most.
#define DEPTH_LIMIT 4096

// A tree in prefix order: an inner node opens as many places as it has children, every node fills one, and the last
// node fills the last. Leaf places count from 0.
static bool check_shape(const Plan *plan, const PlanShape *shape)
{
    uint64_t open = 1, leaves = 0;
    for (uint32_t i = 0; i < shape->node_count; i++) {
        const PlanShapeNode *node = &shape->nodes[i];
        if (!open) return false;
        open--;
        if (node->kind == SHAPE_UNION || node->kind == SHAPE_INTERSECT) {
            if (!node->count) return false;
            open += node->count;
            continue;
        }
        if (node->kind > SHAPE_GROUP || node->leaf != leaves++) return false;
        if (node->kind == SHAPE_GROUP && node->count >= plan->group_type_count) return false;
    }
    return !open && shape->node_count && leaves == shape->leaf_count;
}

// What is known of shapes and group types while they are checked. Each shape is walked twice, however many types list
// it.
typedef struct Nesting {
    uint32_t *above;       // of each shape: one more than the highest group type at its leaves, 0 without any
    uint32_t *shape_depth; // levels of its tree, those of groups at its leaves included; 0: not known yet
    uint32_t *type_depth;
    uint32_t *stack; // children that are still to come at each level of a shape's tree
} Nesting;

static uint32_t find_above(const PlanShape *shape)
{
    uint32_t above = 0;
    for (uint32_t i = 0; i < shape->node_count; i++)
        if (shape->nodes[i].kind == SHAPE_GROUP && shape->nodes[i].count >= above) above = shape->nodes[i].count + 1u;
    return above;
}

// Levels of a shape that is known to be a tree of types whose depth is known; more than DEPTH_LIMIT where it is too
// deep.
static uint32_t find_depth(const PlanShape *shape, const Nesting *nesting)
{
    uint32_t level = 0, deepest = 0;
    for (uint32_t i = 0; i < shape->node_count; i++) {
        const PlanShapeNode *node = &shape->nodes[i];
        uint32_t here = level + 1;
        if (node->kind == SHAPE_GROUP) here += nesting->type_depth[node->count];
        if (here > deepest) deepest = here;
        if (deepest > DEPTH_LIMIT) return deepest;
        if (node->kind < SHAPE_QUADRIC) {
            nesting->stack[level++] = node->count;
            continue;
        }
        while (level && !--nesting->stack[level - 1]) level--;
    }
    return deepest;
}

// Types are numbered bottom-up: the groups in a type's shapes are of lower types, so no nesting has a circle.
static bool check_group_type(const Plan *plan, uint32_t index, Nesting *nesting)
{
    const PlanGroupType *type = &plan->group_types[index];
    if (type->set > SET_INTERSECT) return false;
    for (uint32_t s = 0; s < type->shape_count; s++) {
        uint32_t shape = type->shapes[s];
        if (shape >= plan->shape_count || (s && shape <= type->shapes[s - 1]) || nesting->above[shape] > index)
            return false;
        uint32_t *depth = &nesting->shape_depth[shape];
        if (!*depth) *depth = find_depth(&plan->shapes[shape], nesting);
        if (*depth >= nesting->type_depth[index]) nesting->type_depth[index] = *depth + 1;
        if (*depth >= DEPTH_LIMIT) return false;
    }
    return true;
}

static bool check_group_types(const Plan *plan, Failure *failure)
{
    Nesting nesting = {calloc(plan->shape_count + 1u, 4), calloc(plan->shape_count + 1u, 4),
                       calloc(plan->group_type_count + 1u, 4), malloc((DEPTH_LIMIT + 1) * sizeof(uint32_t))};
    bool ok = nesting.above && nesting.shape_depth && nesting.type_depth && nesting.stack;
    if (!ok) fail(failure, "there is no memory to check it");
    for (uint32_t i = 0; ok && i < plan->shape_count; i++) nesting.above[i] = find_above(&plan->shapes[i]);
    for (uint32_t i = 0; ok && i < plan->group_type_count; i++) {
        ok = check_group_type(plan, i, &nesting);
        if (!ok) fail(failure, "its group type %u makes no sense, or nests too deep", i);
    }
    free(nesting.above);
    free(nesting.shape_depth);
    free(nesting.type_depth);
    free(nesting.stack);
    return ok;
}

static bool check_image(const Plan *plan)
{
    for (Slot s = 0; s < plan->slot_count; s++)
        if (!isfinite(plan->image[s])) return false;
    return true;
}

static bool check_lift(const Plan *plan, const PlanLift *lift)
{
    return lift->patch < plan->patch_count && slots_fit(plan, lift->strength, 1) && slots_fit(plan, lift->frame, 12) &&
           slots_fit(plan, lift->low, 1) && slots_fit(plan, lift->high, 1);
}

static bool check_run(const PlanPatch *patch, const PlanRun *run)
{
    return run->begin <= run->end && run->end <= patch->program->step_count;
}

static bool check_part(const Plan *program, const PlanPart *part)
{
    if (part->kind > PART_CONTACT) return false;
    for (int k = 0; k < 5; k++)
        if (!slots_fit(program, part->values[k], 1)) return false;
    if (part->kind == PART_PIN) return true;
    if (part->field >= program->operand_count) return false;
    uint32_t count = program->operands[part->field];
    return range_fits(part->field + 1, count, program->operand_count) &&
           field_check((FieldCode){program->operands + part->field + 1, count}, program->slot_count);
}

static bool check_patch(const Plan *plan, const PlanPatch *patch)
{
    const Plan *program = patch->program;
    bool ok = patch->name && patch->nodes >= PATCH_NODES_MIN && patch->nodes <= PATCH_NODES_MAX &&
              program->input_count == plan->input_count && check_image(program) &&
              slots_fit(program, program->time, 1) && slots_fit(program, program->frame, 1) &&
              slots_fit(program, program->inputs, program->input_count) && slots_fit(program, patch->point, 5) &&
              patch->frame_end <= program->step_count && check_run(patch, &patch->edges) &&
              check_run(patch, &patch->force) && check_run(patch, &patch->start) && slots_fit(plan, patch->box, 7) &&
              frame_check(program) == program->step_count;
    for (int k = 0; ok && k < PATCH_OPERANDS - PATCH_CONSTS; k++) ok = slots_fit(program, patch->model[k], 1);
    for (uint32_t k = 0; ok && k < patch->part_count; k++) ok = check_part(program, &patch->parts[k]);
    return ok;
}

static bool check_leaf(const Plan *plan, const PlanLeaf *leaf)
{
    if (leaf->shown != NO_SLOT && !slots_fit(plan, leaf->shown, 1)) return false;
    if (leaf->kind == LEAF_GROUP) return leaf->begin < plan->group_count;
    if (leaf->kind > LEAF_GROUP || leaf->material >= plan->material_count || leaf->object >= plan->object_count)
        return false;
    if (leaf->kind == LEAF_FIELD) return leaf->begin < plan->tape_count && slots_fit(plan, leaf->quadric, 12);
    if (leaf->kind == LEAF_SHEET || leaf->kind == LEAF_THICK)
        return leaf->begin < plan->patch_count && slots_fit(plan, leaf->quadric, 12) &&
               slots_fit(plan, leaf->thickness, 1) && slots_fit(plan, leaf->side, 1);
    if (leaf->kind == LEAF_FREEFORM && (!range_fits(leaf->begin, leaf->count, plan->perturbation_count) ||
                                        !range_fits(leaf->lifts, leaf->lift_count, plan->lift_count) ||
                                        !range_fits(leaf->copies, leaf->copy_count, plan->copy_count)))
        return false;
    return slots_fit(plan, leaf->quadric, 10);
}

static bool leaf_matches(const Plan *plan, const PlanLeaf *leaf, const PlanShapeNode *node)
{
    switch (node->kind) {
    case SHAPE_QUADRIC: return leaf->kind == LEAF_QUADRIC;
    case SHAPE_FREEFORM: return leaf->kind == LEAF_FREEFORM && !leaf->lift_count;
    case SHAPE_FIELD: return leaf->kind == LEAF_FIELD;
    case SHAPE_LIFTED: return leaf->kind == LEAF_FREEFORM && leaf->lift_count;
    case SHAPE_SHEET: return leaf->kind == LEAF_SHEET;
    case SHAPE_THICK: return leaf->kind == LEAF_THICK;
    default: return leaf->kind == LEAF_GROUP && plan->groups[leaf->begin].type == node->count;
    }
}

static bool has_shape(const PlanGroupType *type, uint32_t shape)
{
    uint32_t low = 0, high = type->shape_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (type->shapes[middle] == shape) return true;
        if (type->shapes[middle] < shape)
            low = middle + 1;
        else
            high = middle;
    }
    return false;
}

// What is used already. Everything belongs to one owner, so walking the tree of groups takes as long as its tables are.
typedef struct Owners {
    uint8_t *leaf, *component, *group;
} Owners;

static bool check_component(const Plan *plan, const PlanComponent *component, const PlanGroupType *type, Owners *owners)
{
    if (!has_shape(type, component->shape)) return false;
    const PlanShape *shape = &plan->shapes[component->shape];
    if (!range_fits(component->leaf_begin, shape->leaf_count, plan->leaf_count)) return false;
    uint32_t place = component->leaf_begin;
    for (uint32_t i = 0; i < shape->node_count; i++) {
        const PlanShapeNode *node = &shape->nodes[i];
        if (node->kind < SHAPE_QUADRIC) continue;
        const PlanLeaf *leaf = &plan->leaves[place];
        if (owners->leaf[place]++ || !leaf_matches(plan, leaf, node)) return false;
        if (leaf->kind == LEAF_GROUP && owners->group[leaf->begin]++) return false;
        place++;
    }
    return true;
}

static bool check_group(const Plan *plan, const PlanGroup *group, Owners *owners)
{
    if (!range_fits(group->component_begin, group->component_count, plan->component_count)) return false;
    const PlanGroupType *type = &plan->group_types[group->type];
    for (uint32_t c = group->component_begin; c < group->component_begin + group->component_count; c++) {
        const PlanComponent *component = &plan->components[c];
        if (c > group->component_begin && component->shape < component[-1].shape) return false;
        if (owners->component[c]++ || !check_component(plan, component, type, owners)) return false;
    }
    return true;
}

static bool check_groups(const Plan *plan)
{
    for (uint32_t i = 0; i < plan->group_count; i++)
        if (plan->groups[i].type >= plan->group_type_count) return false;
    if (!plan->group_count || plan->group_types[plan->groups[0].type].set != SET_UNION) return false;
    Owners owners = {calloc(plan->leaf_count + 1u, 1), calloc(plan->component_count + 1u, 1),
                     calloc(plan->group_count, 1)};
    bool ok = owners.leaf && owners.component && owners.group;
    if (ok) owners.group[0] = 1; // the scene
    for (uint32_t i = 0; i < plan->group_count && ok; i++) ok = check_group(plan, &plan->groups[i], &owners);
    free(owners.leaf);
    free(owners.component);
    free(owners.group);
    return ok;
}

static bool check_param(const Plan *plan, const IrParam *param)
{
    static const uint8_t slots[] = {
        [PARAM_SCALAR] = 1, [PARAM_ANGLE] = 1, [PARAM_TIME] = 1, [PARAM_VEC2] = 2, [PARAM_VEC3] = 3, [PARAM_COLOR] = 3};
    if (!param->name || param->type > PARAM_COLOR) return false;
    if (param->structure != (param->type <= PARAM_STRING)) return false;
    if (param->type == PARAM_STRING && !param->text) return false;
    if (param->choices)
        for (const char *const *choice = param->choices; *choice; choice++)
            if (choice - param->choices > 10000) return false;
    for (int i = 0; i < 3; i++)
        if (!isfinite(param->value[i])) return false;
    if (isnan(param->low) || isnan(param->high)) return false;
    return param->structure || range_fits(param->slot, slots[param->type], plan->input_count);
}

static bool check_tapes(const Plan *plan)
{
    for (uint32_t i = 0; i < plan->tape_count; i++) {
        const PlanTape *tape = &plan->tapes[i];
        if (!range_fits(tape->first, tape->count, plan->tape_step_count)) return false;
        if (!tape_check(plan->tape_steps + tape->first, tape->count, plan->slot_count)) return false;
    }
    return true;
}

static bool check_things(const Plan *plan)
{
    for (uint32_t i = 0; i < plan->material_count; i++) {
        const PlanMaterial *material = &plan->materials[i];
        if (!slots_fit(plan, material->values, 11) || material->integer_shininess < -1 ||
            material->integer_shininess > 1024)
            return false;
    }
    for (uint32_t i = 0; i < plan->light_count; i++)
        if (plan->lights[i].kind > LIGHT_SPOT || !slots_fit(plan, plan->lights[i].values, 14)) return false;
    for (uint32_t i = 0; i < plan->object_count; i++)
        if (!plan->objects[i].name) return false;
    for (uint32_t i = 0; i < plan->perturbation_count; i++)
        if (!slots_fit(plan, plan->perturbations[i].quadric, 10) ||
            !slots_fit(plan, plan->perturbations[i].strength, 1))
            return false;
    for (uint32_t i = 0; i < plan->cluster_count; i++)
        if (!range_fits(plan->clusters[i].begin, plan->clusters[i].count, plan->perturbation_count)) return false;
    for (uint32_t i = 0; i < plan->copy_count; i++) {
        const PlanCopy *copy = &plan->copies[i];
        if (copy->cluster >= plan->cluster_count || !slots_fit(plan, copy->strength, 1) ||
            !slots_fit(plan, copy->matrix, 12))
            return false;
    }
    return slots_fit(plan, plan->camera, 15) && slots_fit(plan, plan->background, 4) &&
           slots_fit(plan, plan->time, 1) && slots_fit(plan, plan->frame, 1) &&
           slots_fit(plan, plan->inputs, plan->input_count) && plan->material_count && plan->object_count &&
           isfinite(plan->duration) && plan->duration >= 0 && isfinite(plan->fps) && plan->fps >= 0;
}

bool plan_check(const Plan *plan, Failure *failure)
{
    if (!check_image(plan)) return fail(failure, "its constants are not numbers");
    if (!check_things(plan)) return fail(failure, "its materials, lights or camera point nowhere");
    if (!check_tapes(plan)) return fail(failure, "its expressions make no sense");
    for (uint32_t i = 0; i < plan->shape_count; i++)
        if (!check_shape(plan, &plan->shapes[i])) return fail(failure, "its shape %u is no tree", i);
    if (!check_group_types(plan, failure)) return false;
    for (uint32_t i = 0; i < plan->patch_count; i++)
        if (!check_patch(plan, &plan->patches[i])) return fail(failure, "its patch %u makes no sense", i);
    for (uint32_t i = 0; i < plan->lift_count; i++)
        if (!check_lift(plan, &plan->lifts[i])) return fail(failure, "its lift %u points nowhere", i);
    for (uint32_t i = 0; i < plan->leaf_count; i++)
        if (!check_leaf(plan, &plan->leaves[i])) return fail(failure, "its leaf %u points nowhere", i);
    if (!check_groups(plan)) return fail(failure, "its groups make no tree");
    for (uint32_t i = 0; i < plan->param_count; i++)
        if (!check_param(plan, &plan->params[i])) return fail(failure, "its parameter %u makes no sense", i);
    uint32_t step = frame_check(plan);
    if (step < plan->step_count) return fail(failure, "its step %u makes no sense", step);
    return true;
}
