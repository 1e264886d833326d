// Slots and steps.
//
// What is needed is marked first, from the plan's own needs down; a sweep up the nodes then gives slots and emits
// steps, since operands come before what uses them. So nothing is computed that no one needs, and depth costs nothing.
// What asserts need comes first, so that an assert speaks before the misfortune that it was written against.
#include "compiler/lower.h"

#include <assert.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/field.h"
#include "compiler/pairs.h"
#include "compiler/tape.h"

typedef enum ValueNeed {
    NEED_VALUE = 1,   // a scalar, a matrix, a base, a thing
    NEED_CHECKED = 2, // a scalar, finite
    NEED_INVERSE = 4, // of a matrix
    NEED_FIELD = 8,   // of a field: its parts for a field program
} ValueNeed;

Values values_new(const Ir *ir, Arena *arena, Arena *scratch, Plan *plan)
{
    Values v = {.ir = ir, .arena = arena, .scratch = scratch, .plan = plan};
    v.needs = arena_array(scratch, uint8_t, ir->count);
    v.slots = arena_array(scratch, Slot, ir->count);
    v.inverses = arena_array(scratch, Slot, ir->count);
    v.checked = arena_array(scratch, Slot, ir->count);
    return v;
}

// --- slots

static Slot slots_new(Values *v, uint32_t count)
{
    Plan *plan = v->plan;
    Slot first = plan->slot_count;
    if (first + count > v->image_capacity) {
        uint32_t room = v->image_capacity ? v->image_capacity * 4 : 1024; // pages that nothing touches cost nothing
        while (room < first + count) room *= 2;
        double *image = arena_array(v->arena, double, room);
        if (first) memcpy(image, plan->image, first * sizeof *image);
        plan->image = image;
        v->image_capacity = room;
    }
    plan->slot_count += count;
    return first;
}

Slot values_constants(Values *v, const double *numbers, uint32_t count)
{
    Slot first = slots_new(v, count);
    memcpy(v->plan->image + first, numbers, count * sizeof *numbers);
    return first;
}

Slot values_slot(const Values *v, IrId id)
{
    assert(v->slots[id] && "a value is asked for that was needed");
    return v->slots[id] - 1;
}

Slot values_checked_slot(const Values *v, IrId id)
{
    assert(v->checked[id] && "a value is asked for that was needed");
    return v->checked[id] - 1;
}

Slot values_inverse_slot(const Values *v, IrId id)
{
    assert(v->inverses[id] && "a value is asked for that was needed");
    return v->inverses[id] - 1;
}

// --- steps

static PlanStep *step_new(Values *v, StepKind kind, IrOp op, Span span, Slot result)
{
    Plan *plan = v->plan;
    plan->steps = array_room(v->arena, plan->steps, plan->step_count, &v->step_capacity, sizeof *plan->steps);
    PlanStep *step = &plan->steps[plan->step_count++];
    *step = (PlanStep){.kind = kind, .op = op, .first = plan->operand_count, .result = result, .span = span};
    return step;
}

static void step_operand(Values *v, PlanStep *step, uint32_t operand)
{
    Plan *plan = v->plan;
    plan->operands =
        array_room(v->arena, plan->operands, plan->operand_count, &v->operand_capacity, sizeof *plan->operands);
    plan->operands[plan->operand_count++] = operand;
    step->count++;
}

// Slots for scalars side by side: numbers in the image, a step for each run of others.
static Slot gather(Values *v, IrId id)
{
    const IrNode *node = ir_at(v->ir, id);
    const IrId *operands = ir_operands(v->ir, id);
    Slot first = slots_new(v, node->count);
    PlanStep *step = NULL;
    for (uint32_t k = 0; k < node->count; k++) {
        double value;
        if (ir_is_const(v->ir, operands[k], &value)) {
            v->plan->image[first + k] = value;
            step = NULL;
            continue;
        }
        if (!step) step = step_new(v, STEP_GATHER, OP_NONE, node->span, first + k);
        step_operand(v, step, values_slot(v, operands[k]));
    }
    return first;
}

static Slot node_slot(void *context, IrId id)
{
    return values_slot(context, id);
}
static Slot inverse_slot(void *context, IrId id)
{
    return ((Values *)context)->inverses[id] - 1;
}

static FieldCode field_words(Values *v, IrId field)
{
    FieldSlots slots = {v, node_slot, node_slot, inverse_slot};
    FieldCode code;
    if (!field_code(v->scratch, v->ir, field, &slots, &code)) {
        static const uint32_t nothing[] = {FIELD_EMPTY}; // beyond all limits: no tool finds a place there
        code = (FieldCode){nothing, 1};
    }
    return code;
}

static void field_operands(Values *v, PlanStep *step, IrId field)
{
    FieldCode code = field_words(v, field);
    step_operand(v, step, code.count);
    for (uint32_t k = 0; k < code.count; k++) step_operand(v, step, code.words[k]);
}

uint32_t values_field(Values *v, IrId field)
{
    PlanStep none = {0};
    uint32_t first = v->plan->operand_count;
    field_operands(v, &none, field);
    return first;
}

static Slot operation(Values *v, IrId id, StepKind kind, uint32_t width, uint32_t fields)
{
    const IrNode *node = ir_at(v->ir, id);
    Slot result = slots_new(v, width);
    PlanStep *step = step_new(v, kind, node->op, node->span, result);
    for (uint32_t k = 0; k < node->count; k++) {
        IrId operand = ir_operand(v->ir, id, k);
        if (k < fields) {
            field_operands(v, step, operand);
        } else {
            step_operand(v, step, values_slot(v, operand));
        }
    }
    return result;
}

static Slot value(Values *v, IrId id)
{
    const IrNode *node = ir_at(v->ir, id);
    switch ((IrOp)node->op) {
    case OP_CONST: return values_constants(v, &node->number, 1);
    case OP_PARAM: return v->plan->inputs + node->index;
    case OP_TIME: return v->plan->time;
    case OP_FRAME: return v->plan->frame;
    case OP_X:
    case OP_Y:
    case OP_Z:
    case OP_U:
    case OP_V: return v->point + (Slot)(node->op - OP_X);
    case OP_COEFFICIENT: return values_slot(v, ir_operand(v->ir, id, 0)) + node->index;
    case OP_MATRIX:
    case OP_QUADRIC:
    case OP_MATERIAL:
    case OP_CAMERA:
    case OP_LIGHT:
    case OP_BACKGROUND: return gather(v, id);
    case OP_COMPOSE:
    case OP_INVERSE:
    case OP_STAND: return operation(v, id, STEP_MATRIX, 12, 0);
    case OP_ENTRY: return values_slot(v, ir_operand(v->ir, id, 0)) + node->index;
    case OP_SURFACE:
    case OP_PLACE: return operation(v, id, STEP_PLACE, 12, 1);
    case OP_HEIGHT: return operation(v, id, STEP_HEIGHT, 1, 2);
    case OP_AT: return operation(v, id, STEP_AT, 1, 1);
    case OP_STEEPNESS: return operation(v, id, STEP_STEEPNESS, 1, 1);
    case OP_TRANSFORM: return operation(v, id, STEP_QUADRIC, 10, 0);
    case OP_ASSERT: {
        Slot none = operation(v, id, STEP_ASSERT, 0, 0);
        v->plan->steps[v->plan->step_count - 1].text = node->text;
        return none;
    }
    default: return operation(v, id, STEP_SCALAR, 1, 0);
    }
}

static Slot checked(Values *v, IrId id)
{
    double number;
    if (ir_is_const(v->ir, id, &number)) return values_slot(v, id);
    Slot result = slots_new(v, 1);
    PlanStep *step = step_new(v, STEP_GATHER, OP_NONE, ir_at(v->ir, id)->span, result);
    step_operand(v, step, values_slot(v, id));
    return result;
}

static Slot inverse(Values *v, IrId id)
{
    Slot result = slots_new(v, 12);
    PlanStep *step = step_new(v, STEP_MATRIX, OP_INVERSE, ir_at(v->ir, id)->span, result);
    step_operand(v, step, values_slot(v, id));
    return result;
}

// --- needs

void values_need(Values *v, IrId id)
{
    v->needs[id] |= NEED_VALUE;
}
void values_need_checked(Values *v, IrId id)
{
    v->needs[id] |= NEED_CHECKED | NEED_VALUE;
}
void values_need_field(Values *v, IrId id)
{
    v->needs[id] |= NEED_FIELD;
}

void values_need_inverse(Values *v, IrId id)
{
    v->needs[id] |= NEED_INVERSE | NEED_VALUE;
}

static void need_operand(Values *v, IrId operand, bool gathered)
{
    IrType type = ir_at(v->ir, operand)->type;
    if (type == IR_FIELD || type == IR_PERTURBATION) {
        v->needs[operand] |= NEED_FIELD;
    } else if (!gathered ||
               !ir_is_const(v->ir, operand, NULL)) { // constants that are gathered have no slot of their own
        v->needs[operand] |= NEED_VALUE;
    }
}

static void need_number(void *context, IrId scalar)
{
    values_need(context, scalar);
}

// Of what differs from point to point in a field program, what its tape names is known once a frame.
static bool need_of_tape(Values *v, IrId id)
{
    const IrNode *node = ir_at(v->ir, id);
    if (!(v->needs[id] & NEED_FIELD) || (node->op != OP_FIELD && node->op != OP_MORPH)) return false;
    IrId expression = ir_operand(v->ir, id, node->op == OP_FIELD ? 0 : 2);
    if (node->op == OP_MORPH && ir_at(v->ir, expression)->rate != RATE_POINT) return false;
    tape_needs(v->ir, expression, v, need_number);
    for (uint32_t k = 0; node->op == OP_MORPH && k < 2; k++) need_operand(v, ir_operand(v->ir, id, k), false);
    return true;
}

static void need_operands(Values *v, IrId id)
{
    if (need_of_tape(v, id)) return;
    const IrNode *node = ir_at(v->ir, id);
    if (node->op == OP_COEFFICIENT) {
        v->needs[ir_operand(v->ir, id, 0)] |= NEED_VALUE;
        return;
    }
    bool gathered =
        node->op == OP_QUADRIC || node->op == OP_MATRIX || (node->type >= IR_MATERIAL && node->op != OP_ASSERT);
    bool field = v->needs[id] & NEED_FIELD;
    if (field && node->op == OP_QUADRIC) v->needs[id] |= NEED_VALUE;
    bool map = node->op == OP_TRANSFORM || node->op == OP_PTRANSFORM;
    if (map && field) v->needs[ir_operand(v->ir, id, 1)] |= NEED_INVERSE;
    bool base = node->op == OP_TRANSFORM && v->needs[id] & NEED_VALUE;
    if (base) v->needs[ir_operand(v->ir, id, 0)] |= NEED_VALUE;
    for (uint32_t k = base && !field; k < node->count; k++) {
        if (node->op == OP_LIFT || node->op == OP_SHEET || node->op == OP_THICKEN)
            return;                                   // a field program knows no patches
        if (node->op == OP_PAINT && k == 1) continue; // where F is asked for, colours are not
        need_operand(v, ir_operand(v->ir, id, k), gathered);
    }
}

static void emit(Values *v, IrRate rate)
{
    for (IrId id = v->ir->count; id-- > 1;) {
        if (v->needs[id]) need_operands(v, id);
    }
    for (IrId id = 1; id < v->ir->count; id++) {
        if (ir_at(v->ir, id)->rate > rate) continue;
        if (v->needs[id] & NEED_VALUE && !v->slots[id]) v->slots[id] = value(v, id) + 1;
        if (v->needs[id] & NEED_CHECKED && !v->checked[id]) v->checked[id] = checked(v, id) + 1;
        if (v->needs[id] & NEED_INVERSE && !v->inverses[id]) v->inverses[id] = inverse(v, id) + 1;
    }
}

void values_emit(Values *v)
{
    emit(v, RATE_POINT);
}

void values_emit_frame(Values *v)
{
    emit(v, RATE_FRAME);
}

void values_forget_points(Values *v)
{
    for (IrId id = 1; id < v->ir->count; id++) {
        if (ir_at(v->ir, id)->rate == RATE_POINT) v->needs[id] = v->slots[id] = v->checked[id] = 0;
    }
}
