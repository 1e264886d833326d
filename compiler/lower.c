// The tables of a plan. Groups are laid out from the scene's on: components sorted by shape, leaves of a component
// side by side, the groups among them in a queue. What the scene shares is repeated here, since a leaf of a plan is in
// one place; its values, its perturbations and its material are not.
#include "compiler/lower.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/leaf.h"
#include "compiler/pairs.h"
#include "compiler/tape.h"

enum { SHININESS = 6 };

typedef struct Waiting { // a group that is to be laid out
    uint32_t block, order;
} Waiting;

typedef struct Lowering {
    const Ir *ir;
    Arena *arena, *scratch;
    Plan *plan;
    PlanOrigins *origins;
    Values values;
    Pieces pieces;
    uint32_t *new_shapes, *new_types;
    Pairs lists;      // hashes of lists of operands
    IrId *list_owner; // of each the node that had it first
    uint32_t list_capacity;
    uint32_t
        *indices;     // of a free form the first perturbation, of a general field its tape, of a material its index, of
                      // a name its object; + 1
    Waiting *waiting; // by group
    uint32_t *starts, *sorted; // for sorting a group's members by shape
    uint32_t group_capacity, component_capacity, leaf_capacity, perturbation_capacity, material_capacity,
        object_capacity;
    uint32_t tape_capacity, tape_step_capacity;
    bool *clustered; // of a cluster whether its values are needed
    Slot identity;   // + 1, once a field without a map has wanted it
    uint32_t leaf_span_capacity, perturbation_span_capacity, lift_capacity, copy_capacity, cluster_capacity;
} Lowering;

// --- what is there more than once

static uint64_t list_hash(const Ir *ir, IrId id, uint32_t from)
{
    uint64_t hash = ir_at(ir, id)->op;
    for (uint32_t k = from; k < ir_at(ir, id)->count; k++) {
        hash = (hash ^ ir_operand(ir, id, k)) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 29;
    }
    return hash;
}

// The first node that was asked for with the same operation and, from `from` on, the same operands: often the node
// itself.
static IrId first_alike(Lowering *l, IrId id, uint32_t from)
{
    const IrNode *node = ir_at(l->ir, id);
    uint64_t hash = list_hash(l->ir, id, from);
    bool added;
    uint32_t index = pairs_index(&l->lists, (uint32_t)(hash >> 32), (uint32_t)hash, &added);
    if (added) {
        l->list_owner = array_room(l->scratch, l->list_owner, index, &l->list_capacity, sizeof *l->list_owner);
        l->list_owner[index] = id;
        return id;
    }
    IrId first = l->list_owner[index];
    const IrNode *other = ir_at(l->ir, first);
    bool same =
        other->op == node->op && other->count == node->count &&
        !memcmp(ir_operands(l->ir, id) + from, ir_operands(l->ir, first) + from, (node->count - from) * sizeof(IrId));
    return same ? first : id;
}

// --- materials and objects

static int32_t integer_shininess(const Ir *ir, IrId material)
{
    double value;
    bool whole = ir_is_const(ir, ir_operand(ir, material, SHININESS), &value) && value == floor(value);
    return whole && value >= 0 && value <= 1024 ? (int32_t)value : -1;
}

static uint32_t material_new(Lowering *l, Slot values, int32_t shininess)
{
    Plan *plan = l->plan;
    plan->materials =
        array_room(l->arena, plan->materials, plan->material_count, &l->material_capacity, sizeof *plan->materials);
    plan->materials[plan->material_count] = (PlanMaterial){values, shininess};
    return plan->material_count++;
}

static uint32_t material_of(Lowering *l, IrId material)
{
    if (!material) return 0;
    uint32_t *index = &l->indices[material];
    if (!*index) {
        IrId first = first_alike(l, material, 0);
        if (first == material) {
            *index = material_new(l, values_slot(&l->values, material), integer_shininess(l->ir, material)) + 1;
        } else {
            *index = material_of(l, first) + 1;
        }
    }
    return *index - 1;
}

static uint32_t object_new(Lowering *l, const char *name, Span span)
{
    Plan *plan = l->plan;
    plan->objects = array_room(l->arena, plan->objects, plan->object_count, &l->object_capacity, sizeof *plan->objects);
    plan->objects[plan->object_count] = (PlanObject){name, span};
    return plan->object_count++;
}

typedef struct NamedLeaf {
    IrId name;
    const char *text;
} NamedLeaf;

static int by_text(const void *a, const void *b)
{
    const NamedLeaf *x = a, *y = b;
    int order = strcmp(x->text, y->text);
    return order ? order : x->name < y->name ? -1 : x->name > y->name;
}

static int by_first(const void *a, const void *b)
{
    const NamedLeaf *x = a, *y = b;
    return x->name < y->name ? -1 : x->name > y->name;
}

// Objects are told apart by their names, and numbered in the order in which the scene makes them.
static void name_objects(Lowering *l)
{
    const Ir *ir = l->ir;
    NamedLeaf *names = NULL;
    uint32_t count = 0, capacity = 0, different = 0;
    for (IrId id = 1; id <= ir->root; id++) {
        if (!l->pieces.reached[id] || ir_at(ir, id)->op != OP_NAMED) continue;
        names = array_room(l->scratch, names, count, &capacity, sizeof *names);
        names[count++] = (NamedLeaf){id, ir_at(ir, id)->text};
    }
    object_new(l, "", (Span){0});
    if (!count) return;
    qsort(names, count, sizeof *names, by_text);
    NamedLeaf *firsts = arena_array(l->scratch, NamedLeaf, count);
    uint32_t *group = arena_array(l->scratch, uint32_t, ir->count); // of the first of a name its others' representative
    for (uint32_t k = 0; k < count; k++) {
        if (!k || strcmp(names[k].text, names[k - 1].text)) firsts[different++] = names[k];
        group[names[k].name] = firsts[different - 1].name;
    }
    qsort(firsts, different, sizeof *firsts, by_first);
    for (uint32_t k = 0; k < different; k++) {
        l->indices[firsts[k].name] = object_new(l, firsts[k].text, ir_at(ir, firsts[k].name)->span) + 1;
    }
    for (uint32_t k = 0; k < count; k++) l->indices[names[k].name] = l->indices[group[names[k].name]];
}

// --- needs

static void need_number(void *context, IrId scalar)
{
    values_need_checked(context, scalar);
}

static void need_perturbation(Lowering *l, IrId perturbation)
{
    values_need_checked(&l->values, ir_operand(l->ir, perturbation, 1));
    switch ((IrOp)ir_at(l->ir, perturbation)->op) {
    case OP_LIFT:
        values_need(&l->values, ir_operand(l->ir, perturbation, 2));
        for (uint32_t cap = 3; cap < 5; cap++) values_need_checked(&l->values, ir_operand(l->ir, perturbation, cap));
        return;
    case OP_COPY: {
        IrId cluster = ir_operand(l->ir, perturbation, 0);
        values_need(&l->values, ir_operand(l->ir, perturbation, 2));
        if (l->clustered[cluster]) return;
        l->clustered[cluster] = true;
        for (uint32_t k = 0; k < ir_at(l->ir, cluster)->count; k++) need_perturbation(l, ir_operand(l->ir, cluster, k));
        return;
    }
    default: values_need(&l->values, ir_operand(l->ir, perturbation, 0));
    }
}

static void need_leaf(Lowering *l, IrId id)
{
    LeafParts parts = leaf_parts(l->ir, id);
    if (parts.paint) values_need(&l->values, parts.paint);
    if (parts.shown) values_need_checked(&l->values, parts.shown);
    if (ir_at(l->ir, parts.base)->op == OP_COMPLEMENT) return; // all of space has constants of its own
    IrId matrix, function = leaf_function(l->ir, parts.base, &matrix);
    if (leaf_is_patch(l->ir, parts.base)) {
        if (matrix) values_need(&l->values, matrix);
        for (uint32_t k = 1; k < ir_at(l->ir, function)->count; k++)
            values_need_checked(&l->values, ir_operand(l->ir, function, k));
        return;
    }
    if (ir_at(l->ir, function)->op == OP_FIELD) {
        tape_needs(l->ir, ir_operand(l->ir, function, 0), &l->values, need_number);
        if (matrix) values_need_inverse(&l->values, matrix);
        return;
    }
    values_need(&l->values, parts.base);
    for (uint32_t k = 1; parts.core != parts.base && k < ir_at(l->ir, parts.core)->count; k++)
        need_perturbation(l, ir_operand(l->ir, parts.core, k));
}

static void make_values(Lowering *l)
{
    const Ir *ir = l->ir;
    Plan *plan = l->plan;
    l->clustered = arena_array(l->scratch, bool, ir->count);
    plan->time = values_constants(&l->values, (const double[]){0}, 1);
    plan->frame = values_constants(&l->values, (const double[]){0}, 1);
    plan->inputs = plan->slot_count;
    for (uint32_t k = 0; k < ir->input_count; k++) values_constants(&l->values, (const double[]){0}, 1);
    plan->input_count = ir->input_count;
    for (uint32_t k = 0; k < ir->assert_count; k++) values_need(&l->values, ir->asserts[k]);
    values_emit(&l->values);
    values_need(&l->values, ir->camera);
    values_need(&l->values, ir->background);
    for (uint32_t k = 0; k < ir->light_count; k++) values_need(&l->values, ir->lights[k]);
    for (IrId id = 1; id <= ir->root; id++) {
        IrOp op = ir_at(ir, id)->op;
        if (l->pieces.reached[id] && op != OP_UNION && op != OP_INTERSECT) need_leaf(l, id);
    }
    values_emit(&l->values);
}

// --- leaves

static void note_span(Lowering *l, Span **spans, uint32_t index, uint32_t *capacity, IrId id)
{
    if (!l->origins) return;
    *spans = array_room(l->arena, *spans, index, capacity, sizeof **spans);
    (*spans)[index] = ir_at(l->ir, id)->span;
}

static void add_perturbation(Lowering *l, IrId perturbation)
{
    Plan *plan = l->plan;
    Slot quadric = values_slot(&l->values, ir_operand(l->ir, perturbation, 0));
    Slot strength = values_checked_slot(&l->values, ir_operand(l->ir, perturbation, 1));
    plan->perturbations = array_room(l->arena, plan->perturbations, plan->perturbation_count, &l->perturbation_capacity,
                                     sizeof *plan->perturbations);
    if (l->origins)
        note_span(l, &l->origins->perturbations, plan->perturbation_count, &l->perturbation_span_capacity,
                  perturbation);
    plan->perturbations[plan->perturbation_count++] = (PlanPerturbation){quadric, strength};
}

static uint32_t cluster_of(Lowering *l, IrId cluster)
{
    Plan *plan = l->plan;
    uint32_t *index = &l->indices[cluster];
    if (*index) return *index - 1;
    uint32_t begin = plan->perturbation_count, count = ir_at(l->ir, cluster)->count;
    for (uint32_t k = 0; k < count; k++) add_perturbation(l, ir_operand(l->ir, cluster, k));
    plan->clusters =
        array_room(l->arena, plan->clusters, plan->cluster_count, &l->cluster_capacity, sizeof *plan->clusters);
    plan->clusters[plan->cluster_count++] = (PlanCluster){begin, count};
    *index = plan->cluster_count;
    return *index - 1;
}

// The copies of clusters in a free form; `count` is how many perturbations are none.
static void take_copies(Lowering *l, IrId freeform, PlanLeaf *leaf)
{
    Plan *plan = l->plan;
    leaf->copies = plan->copy_count;
    for (uint32_t k = 1; k < ir_at(l->ir, freeform)->count; k++) {
        IrId id = ir_operand(l->ir, freeform, k);
        if (ir_at(l->ir, id)->op != OP_COPY) continue;
        uint32_t cluster = cluster_of(l, ir_operand(l->ir, id, 0));
        plan->copies = array_room(l->arena, plan->copies, plan->copy_count, &l->copy_capacity, sizeof *plan->copies);
        plan->copies[plan->copy_count++] =
            (PlanCopy){cluster, values_checked_slot(&l->values, ir_operand(l->ir, id, 1)),
                       values_slot(&l->values, ir_operand(l->ir, id, 2))};
        leaf->copy_count++;
        leaf->count--;
    }
}

// Where the perturbations of a free form begin. Free forms with the same ones, as the parts of a deformed object,
// share them.
static uint32_t perturbations_of(Lowering *l, IrId freeform)
{
    Plan *plan = l->plan;
    uint32_t *index = &l->indices[freeform];
    if (*index) return *index - 1;
    IrId first = first_alike(l, freeform, 1);
    if (first != freeform) {
        *index = perturbations_of(l, first) + 1;
        return *index - 1;
    }
    uint32_t begin = plan->perturbation_count;
    for (uint32_t k = 1; k < ir_at(l->ir, freeform)->count; k++) {
        IrId perturbation = ir_operand(l->ir, freeform, k);
        if (ir_at(l->ir, perturbation)->op == OP_PERTURB) add_perturbation(l, perturbation);
    }
    *index = begin + 1;
    return begin;
}

static Slot number_slot(void *context, IrId scalar)
{
    return values_checked_slot(context, scalar);
}

// The tape of a FIELD: one for all its instances.
static uint32_t tape_of(Lowering *l, IrId field)
{
    Plan *plan = l->plan;
    uint32_t *index = &l->indices[field];
    if (*index) return *index - 1;
    Arena scratch = {0};
    TapeSlots slots = {&l->values, number_slot};
    TapeStep *steps;
    uint32_t count;
    if (!tape_new(&scratch, l->ir, ir_operand(l->ir, field, 0), &slots, &steps, &count))
        l->pieces.status = LOWER_TOO_LONG;
    plan->tapes = array_room(l->arena, plan->tapes, plan->tape_count, &l->tape_capacity, sizeof *plan->tapes);
    plan->tapes[plan->tape_count] = (PlanTape){plan->tape_step_count, count};
    for (uint32_t k = 0; k < count; k++) {
        plan->tape_steps = array_room(l->arena, plan->tape_steps, plan->tape_step_count, &l->tape_step_capacity,
                                      sizeof *plan->tape_steps);
        plan->tape_steps[plan->tape_step_count++] = steps[k];
    }
    arena_release(&scratch);
    *index = ++plan->tape_count;
    return *index - 1;
}

static PlanLeaf field_leaf(Lowering *l, IrId base, PlanLeaf leaf)
{
    IrId matrix, function = leaf_function(l->ir, base, &matrix);
    leaf.kind = LEAF_FIELD;
    leaf.begin = tape_of(l, function);
    leaf.count = 1;
    if (!matrix && !l->identity) {
        static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        l->identity = values_constants(&l->values, identity, 12) + 1;
    }
    leaf.quadric = matrix ? values_inverse_slot(&l->values, matrix) : l->identity - 1;
    return leaf;
}

static uint32_t patch_of(const Lowering *l, IrId patch)
{
    uint32_t k = 0;
    while (l->ir->patches[k] != patch) k++; // what is reached is among them
    return k;
}

// The lifts of a free form; `count` is how many perturbations are none.
static void take_lifts(Lowering *l, IrId freeform, PlanLeaf *leaf)
{
    Plan *plan = l->plan;
    leaf->lifts = plan->lift_count;
    for (uint32_t k = 1; k < ir_at(l->ir, freeform)->count; k++) {
        IrId id = ir_operand(l->ir, freeform, k);
        if (ir_at(l->ir, id)->op != OP_LIFT) continue;
        plan->lifts = array_room(l->arena, plan->lifts, plan->lift_count, &l->lift_capacity, sizeof *plan->lifts);
        plan->lifts[plan->lift_count++] = (PlanLift){
            .patch = patch_of(l, ir_operand(l->ir, id, 0)),
            .strength = values_checked_slot(&l->values, ir_operand(l->ir, id, 1)),
            .frame = values_slot(&l->values, ir_operand(l->ir, id, 2)),
            .low = values_checked_slot(&l->values, ir_operand(l->ir, id, 3)),
            .high = values_checked_slot(&l->values, ir_operand(l->ir, id, 4)),
        };
        leaf->lift_count++;
        leaf->count--;
    }
}

static PlanLeaf sheet_leaf(Lowering *l, IrId id, PlanLeaf leaf)
{
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    IrId matrix, sheet = leaf_function(l->ir, id, &matrix);
    bool thick = leaf_is_thick(l->ir, id);
    leaf.kind = thick ? LEAF_THICK : LEAF_SHEET;
    leaf.begin = patch_of(l, ir_operand(l->ir, sheet, 0));
    leaf.quadric = matrix ? values_slot(&l->values, matrix) : values_constants(&l->values, identity, 12);
    if (thick) {
        leaf.thickness = values_checked_slot(&l->values, ir_operand(l->ir, sheet, 1));
        leaf.side = values_checked_slot(&l->values, ir_operand(l->ir, sheet, 2));
    }
    return leaf;
}

static PlanLeaf scene_leaf(Lowering *l, IrId id)
{
    LeafParts parts = leaf_parts(l->ir, id);
    PlanLeaf leaf = {.kind = LEAF_QUADRIC, .shown = NO_SLOT, .material = material_of(l, parts.paint)};
    IrId matrix;
    if (leaf_is_patch(l->ir, parts.base)) {
        leaf = sheet_leaf(l, parts.base, leaf);
    } else if (ir_at(l->ir, leaf_function(l->ir, parts.base, &matrix))->op == OP_FIELD) {
        leaf = field_leaf(l, parts.base, leaf);
    } else if (ir_at(l->ir, parts.base)->op == OP_COMPLEMENT) {
        leaf.quadric = values_constants(&l->values, (const double[10]){[9] = 1}, 10);
    } else {
        leaf.quadric = values_slot(&l->values, parts.base);
    }
    if (parts.core != parts.base) {
        leaf.kind = LEAF_FREEFORM;
        leaf.begin = perturbations_of(l, parts.core);
        leaf.count = ir_at(l->ir, parts.core)->count - 1;
        take_lifts(l, parts.core, &leaf);
        take_copies(l, parts.core, &leaf);
    }
    if (parts.shown) leaf.shown = values_checked_slot(&l->values, parts.shown);
    if (parts.name) leaf.object = l->indices[parts.name] - 1;
    return leaf;
}

// --- groups

static uint32_t group_new(Lowering *l, uint32_t block, uint32_t order)
{
    Plan *plan = l->plan;
    uint32_t capacity = l->group_capacity;
    l->waiting = array_room(l->scratch, l->waiting, plan->group_count, &capacity, sizeof *l->waiting);
    plan->groups = array_room(l->arena, plan->groups, plan->group_count, &l->group_capacity, sizeof *plan->groups);
    l->waiting[plan->group_count] = (Waiting){block, order};
    plan->groups[plan->group_count] = (PlanGroup){.type = l->new_types[l->pieces.blocks[block].type]};
    return plan->group_count++;
}

static void leaf_new(Lowering *l, const PieceLeaf *piece_leaf, uint32_t order)
{
    Plan *plan = l->plan;
    PlanLeaf leaf = {.kind = LEAF_GROUP, .count = 1, .shown = NO_SLOT};
    if (piece_leaf->is_block) {
        leaf.begin = group_new(l, piece_leaf->index, order);
    } else {
        leaf = scene_leaf(l, piece_leaf->index);
    }
    leaf.order = order;
    plan->leaves = array_room(l->arena, plan->leaves, plan->leaf_count, &l->leaf_capacity, sizeof *plan->leaves);
    if (l->origins) {
        IrId id = piece_leaf->is_block ? l->pieces.blocks[piece_leaf->index].members[0]
                                       : leaf_parts(l->ir, piece_leaf->index).base;
        note_span(l, &l->origins->leaves, plan->leaf_count, &l->leaf_span_capacity, id);
    }
    plan->leaves[plan->leaf_count++] = leaf;
}

static void component_new(Lowering *l, const Piece *piece, uint32_t order)
{
    Plan *plan = l->plan;
    plan->components =
        array_room(l->arena, plan->components, plan->component_count, &l->component_capacity, sizeof *plan->components);
    plan->components[plan->component_count++] = (PlanComponent){l->new_shapes[piece->shape], plan->leaf_count};
    for (uint32_t k = 0; k < piece->leaf_count; k++) leaf_new(l, &piece->leaves[k], order + piece->leaves[k].offset);
}

// Fills the group: its members sorted by shape, those of a shape in the order of the scene.
static void lay_out(Lowering *l, uint32_t group)
{
    Waiting waiting = l->waiting[group];
    const Block *block = &l->pieces.blocks[waiting.block];
    const Piece *pieces = l->pieces.pieces;
    uint32_t *starts = l->starts, *sorted = l->sorted;
    memset(starts, 0, (l->plan->shape_count + 1) * sizeof *starts);
    for (uint32_t k = 0; k < block->count; k++) starts[l->new_shapes[pieces[block->members[k]].shape] + 1]++;
    for (uint32_t k = 0; k < l->plan->shape_count; k++) starts[k + 1] += starts[k];
    for (uint32_t k = 0; k < block->count; k++) sorted[starts[l->new_shapes[pieces[block->members[k]].shape]]++] = k;
    l->plan->groups[group].component_begin = l->plan->component_count;
    l->plan->groups[group].component_count = block->count;
    for (uint32_t k = 0; k < block->count; k++) {
        uint32_t member = sorted[k];
        component_new(l, &pieces[block->members[member]], waiting.order + block->offsets[member]);
    }
}

static void make_tables(Lowering *l)
{
    Shapes *shapes = &l->pieces.shapes;
    l->new_shapes = arena_array(l->scratch, uint32_t, shapes->count);
    l->new_types = arena_array(l->scratch, uint32_t, shapes->type_count);
    shapes_finish(shapes, l->arena, l->plan, l->new_shapes, l->new_types);
    l->indices = arena_array(l->scratch, uint32_t, l->ir->count);
    l->lists = pairs_new(l->scratch);
    material_new(l, values_constants(&l->values, leaf_default_material, 11), (int32_t)leaf_default_material[SHININESS]);
    name_objects(l);
    uint32_t longest = 0;
    for (uint32_t k = 0; k < l->pieces.block_count; k++) {
        if (l->pieces.blocks[k].count > longest) longest = l->pieces.blocks[k].count;
    }
    l->starts = arena_array(l->scratch, uint32_t, l->plan->shape_count + 1);
    l->sorted = arena_array(l->scratch, uint32_t, longest);
    group_new(l, l->pieces.scene, 0);
    for (uint32_t group = 0; group < l->plan->group_count; group++) lay_out(l, group); // laying out adds groups
}

static void make_things(Lowering *l)
{
    const Ir *ir = l->ir;
    Plan *plan = l->plan;
    plan->lights = arena_array(l->arena, PlanLight, ir->light_count);
    plan->light_count = ir->light_count;
    for (uint32_t k = 0; k < ir->light_count; k++) {
        plan->lights[k] = (PlanLight){ir_at(ir, ir->lights[k])->index, values_slot(&l->values, ir->lights[k])};
    }
    plan->camera = values_slot(&l->values, ir->camera);
    plan->orthographic = ir_at(ir, ir->camera)->index == 1;
    plan->background = values_slot(&l->values, ir->background);
    plan->params = ir->params;
    plan->param_count = ir->param_count;
    plan->duration = ir->duration;
    plan->fps = ir->fps;
}

LowerStatus plan_lower(const Ir *ir, Arena *arena, Plan **plan, PlanOrigins *origins)
{
    Arena scratch = {0};
    Lowering l = {.ir = ir, .arena = arena, .scratch = &scratch, .origins = origins};
    if (origins) *origins = (PlanOrigins){0};
    l.pieces = pieces_new(ir, &scratch);
    LowerStatus status = l.pieces.status;
    if (status == LOWER_DONE) {
        *plan = l.plan = arena_new(arena, Plan);
        l.values = values_new(ir, arena, &scratch, l.plan);
        make_values(&l);
        make_tables(&l);
        make_things(&l);
        lower_patches(ir, arena, &scratch, &l.values, l.plan);
        status = l.pieces.status;
    }
    arena_release(&scratch);
    return status;
}
