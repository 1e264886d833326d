// The programs of patches.
//
// A patch's numbers are wanted at the times of its own steps, many in a frame, and some of them at each of its nodes.
// So each patch has a small plan of its own, made by the same values as the scene's: steps that are known once a step
// come first; those of its edges, its forces and its start, which wait for a node's u, v, x, y and z, follow in three
// runs. What two runs have in common is computed in both.
#include "compiler/lower.h"

#include <string.h>

typedef struct Patches {
    const Ir *ir;
    Arena *arena, *scratch;
    bool *moving, *placed; // of each scalar: changes with time; with the place of a node, x, y or z
} Patches;

static void find_moving(Patches *p)
{
    const Ir *ir = p->ir;
    p->moving = arena_array(p->scratch, bool, ir->count);
    p->placed = arena_array(p->scratch, bool, ir->count);
    for (IrId id = 1; id < ir->count; id++) {
        const IrNode *node = ir_at(ir, id);
        p->moving[id] = node->op == OP_TIME || node->op == OP_FRAME;
        p->placed[id] = node->op == OP_X || node->op == OP_Y || node->op == OP_Z;
        for (uint32_t k = 0; k < node->count; k++) {
            p->moving[id] |= p->moving[ir_operand(ir, id, k)];
            p->placed[id] |= p->placed[ir_operand(ir, id, k)];
        }
    }
}

// The scalars of the run are operands `first` … of the patch.
enum { FIRST_MODEL = PATCH_CONSTS, FIRST_FORCE = 17, FIRST_START = 20, FIRST_EDGES = 23 };

static PlanRun run_new(Patches *p, Values *v, IrId patch, uint32_t first, uint32_t count)
{
    PlanRun run = {.begin = v->plan->step_count};
    for (uint32_t k = first; k < first + count; k++) {
        IrId id = ir_operand(p->ir, patch, k);
        run.points |= ir_at(p->ir, id)->rate == RATE_POINT;
        run.varies |= p->moving[id] || p->placed[id];
        run.placed |= p->placed[id];
        values_need_checked(v, id);
    }
    values_emit(v);
    run.end = v->plan->step_count;
    return run;
}

static void note_slots(Values *v, PlanPatch *patch, IrId id, uint32_t first, uint32_t count)
{
    for (uint32_t k = first; k < first + count; k++)
        patch->model[k - FIRST_MODEL] = values_checked_slot(v, ir_operand(v->ir, id, k));
}

static uint32_t part_values(const Ir *ir, IrId part, IrId values[5], IrId *field)
{
    const IrNode *node = ir_at(ir, part);
    uint32_t count = 0;
    *field = 0;
    for (uint32_t k = 0; k < node->count; k++) {
        IrId operand = ir_operand(ir, part, k);
        if (ir_at(ir, operand)->type == IR_FIELD)
            *field = operand;
        else
            values[count++] = operand;
    }
    return count;
}

static void need_parts(Values *v, IrId driven)
{
    for (uint32_t k = 1; k < ir_at(v->ir, driven)->count; k++) {
        IrId values[5], field;
        uint32_t count = part_values(v->ir, ir_operand(v->ir, driven, k), values, &field);
        for (uint32_t i = 0; i < count; i++) values_need_checked(v, values[i]);
        if (field) values_need_field(v, field);
    }
}

static void make_parts(Patches *p, Values *v, PlanPatch *patch, IrId driven)
{
    patch->part_count = ir_at(p->ir, driven)->count - 1;
    patch->parts = arena_array(p->arena, PlanPart, patch->part_count);
    for (uint32_t k = 0; k < patch->part_count; k++) {
        IrId id = ir_operand(p->ir, driven, k + 1), values[5], field;
        const IrNode *node = ir_at(p->ir, id);
        PlanPart *part = &patch->parts[k];
        uint32_t count = part_values(p->ir, id, values, &field);
        part->kind = node->op == OP_PIN ? PART_PIN : node->op == OP_PRESS ? PART_PRESS : PART_CONTACT;
        part->span = node->span;
        for (uint32_t i = 0; i < count; i++) part->values[i] = values_checked_slot(v, values[i]);
        if (field) part->field = values_field(v, field);
    }
}

static Values program_new(Patches *p, PlanPatch *patch)
{
    static const double zeros[5] = {0};
    Plan *program = patch->program = arena_new(p->arena, Plan);
    Values v = values_new(p->ir, p->arena, p->scratch, program);
    program->time = values_constants(&v, zeros, 1);
    program->frame = values_constants(&v, zeros, 1);
    program->inputs = program->slot_count;
    for (uint32_t k = 0; k < p->ir->input_count; k++) values_constants(&v, zeros, 1);
    program->input_count = p->ir->input_count;
    program->params = p->ir->params;
    program->param_count = p->ir->param_count;
    v.point = patch->point = values_constants(&v, zeros, 5);
    return v;
}

static void patch_new(Patches *p, PlanPatch *patch, IrId id)
{
    const Ir *ir = p->ir;
    bool driven = ir_at(ir, id)->op == OP_DRIVEN;
    IrId equation = driven ? ir_operand(ir, id, 0) : id;
    double shape[PATCH_CONSTS];
    for (uint32_t k = 0; k < PATCH_CONSTS; k++) ir_is_const(ir, ir_operand(ir, equation, k), &shape[k]);
    *patch = (PlanPatch){.name = ir_at(ir, equation)->text,
                         .span = ir_at(ir, equation)->span,
                         .nodes = (uint32_t)shape[0],
                         .newmark = shape[1] != 0,
                         .all_tangents = shape[2] != 0,
                         .accurate = shape[3] != 0};
    Values v = program_new(p, patch);
    for (uint32_t k = FIRST_MODEL; k < FIRST_FORCE; k++) values_need_checked(&v, ir_operand(ir, equation, k));
    if (driven) need_parts(&v, id);
    // What runs need once a step is emitted here too, so that a node's steps are few.
    for (uint32_t k = FIRST_FORCE; k < PATCH_OPERANDS; k++) values_need_checked(&v, ir_operand(ir, equation, k));
    values_emit_frame(&v);
    note_slots(&v, patch, equation, FIRST_MODEL, FIRST_FORCE - FIRST_MODEL);
    for (uint32_t k = FIRST_MODEL; k < FIRST_FORCE; k++) patch->varies |= p->moving[ir_operand(ir, equation, k)];
    for (uint32_t k = 1; driven && k < ir_at(ir, id)->count; k++) patch->varies |= p->moving[ir_operand(ir, id, k)];
    if (driven) make_parts(p, &v, patch, id);
    patch->frame_end = v.plan->step_count;
    values_forget_points(&v);
    patch->edges = run_new(p, &v, equation, FIRST_EDGES, PATCH_OPERANDS - FIRST_EDGES);
    note_slots(&v, patch, equation, FIRST_EDGES, PATCH_OPERANDS - FIRST_EDGES);
    values_forget_points(&v);
    patch->force = run_new(p, &v, equation, FIRST_FORCE, 3);
    note_slots(&v, patch, equation, FIRST_FORCE, 3);
    values_forget_points(&v);
    patch->start = run_new(p, &v, equation, FIRST_START, 3);
    note_slots(&v, patch, equation, FIRST_START, 3);
}

void lower_patches(const Ir *ir, Arena *arena, Arena *scratch, Values *values, Plan *plan)
{
    static const double flat[7] = {0, 0, 0, 1, 1, 0, 0};
    if (!ir->patch_count) return;
    Patches p = {.ir = ir, .arena = arena, .scratch = scratch};
    find_moving(&p);
    plan->patches = arena_array(arena, PlanPatch, ir->patch_count);
    plan->patch_count = ir->patch_count;
    for (uint32_t k = 0; k < ir->patch_count; k++) {
        patch_new(&p, &plan->patches[k], ir->patches[k]);
        plan->patches[k].box = values_constants(values, flat, 7);
    }
}
