// Steps run in order over one array of values. A scalar that is not finite is no error yet, since a branch that is not
// chosen may have made it; it is one where it is used. Then the steps are followed back to the first that made
// something not finite of finite values: its span and its reason are reported.
#include "compiler/frame.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/field.h"
#include "compiler/quadric.h"
#include "compiler/ray.h"

typedef struct Run {
    const Plan *plan;
    double *values;
    FrameError *error;
} Run;

DiagCode frame_error_code(const FrameError *error, const char **text)
{
    char word[32];
    DiagCode code = error->code;
    size_t length = strcspn(error->text, ":");
    snprintf(word, sizeof word, "%.*s", length < sizeof word ? (int)length : 0, error->text);
    bool own = !strncmp(error->text + length, ": ", 2) && diag_code_find(word, &code);
    *text = error->text + (own ? length + 2 : 0);
    return code;
}

static bool fail(Run *run, Span span, DiagCode code, const char *text)
{
    run->error->span = span;
    run->error->code = code;
    snprintf(run->error->text, sizeof run->error->text, "%s", text);
    return false;
}

static bool all_finite(const double *values, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) {
        if (!isfinite(values[k])) return false;
    }
    return true;
}

// --- errors

// The operand that a value that is not finite came from, or `step->count` if none: then the step itself made it.
static uint32_t guilty_operand(const Run *run, const PlanStep *step)
{
    const uint32_t *operands = run->plan->operands + step->first;
    const double *values = run->values;
    if (step->kind != STEP_SCALAR) return step->count;
    bool lazy = step->op == OP_SELECT || step->op == OP_AND || step->op == OP_OR;
    if (lazy && isfinite(values[operands[0]])) return step->op == OP_SELECT && values[operands[0]] == 0 ? 2 : 1;
    for (uint32_t k = 0; k < step->count; k++) {
        if (!isfinite(values[operands[k]])) return k;
    }
    return step->count;
}

// Reports why the value of a slot is not finite. `span` is where it is used.
static bool blame(Run *run, Span span, Slot slot)
{
    const Plan *plan = run->plan;
    for (uint32_t s = plan->step_count; s-- > 0;) { // what a step uses was made by steps before it
        const PlanStep *step = &plan->steps[s];
        if (slot < step->result || slot - step->result >= plan_step_width(step)) continue;
        if (step->kind == STEP_GATHER) {
            slot = plan->operands[step->first + (slot - step->result)];
            continue;
        }
        uint32_t guilty = guilty_operand(run, step);
        if (step->span.end) span = step->span;
        if (guilty == step->count) {
            double args[3] = {0};
            for (uint32_t k = 0; k < step->count && k < 3 && step->kind == STEP_SCALAR; k++) {
                args[k] = run->values[plan->operands[step->first + k]];
            }
            IrOp op = step->kind == STEP_HEIGHT      ? OP_HEIGHT
                      : step->kind == STEP_STEEPNESS ? OP_STEEPNESS
                                                     : (IrOp)step->op;
            bool zero = (op == OP_DIV || op == OP_MOD) && args[1] == 0;
            return fail(run, span, zero ? DIAG_DIVISION_BY_ZERO : DIAG_NOT_FINITE, eval_complaint(op, args));
        }
        slot = plan->operands[step->first + guilty];
    }
    return fail(run, span, DIAG_NOT_FINITE, "a value is not finite");
}

// --- steps

static bool gather(Run *run, const PlanStep *step)
{
    const uint32_t *operands = run->plan->operands + step->first;
    for (uint32_t k = 0; k < step->count; k++) {
        double value = run->values[operands[k]];
        if (!isfinite(value)) return blame(run, step->span, operands[k]);
        run->values[step->result + k] = value;
    }
    return true;
}

static bool stand(Run *run, const PlanStep *step)
{
    double args[7];
    for (int k = 0; k < 7; k++) {
        Slot slot = run->plan->operands[step->first + (uint32_t)k];
        args[k] = run->values[slot];
        if (!isfinite(args[k])) return blame(run, step->span, slot);
    }
    if (matrix_stand(args, args + 3, args[6], run->values + step->result)) return true;
    return fail(run, step->span, DIAG_NOT_FINITE, eval_complaint(OP_STAND, args));
}

static bool matrix(Run *run, const PlanStep *step)
{
    const uint32_t *operands = run->plan->operands + step->first;
    double *result = run->values + step->result;
    if (step->op == OP_STAND) return stand(run, step);
    if (step->op == OP_COMPOSE) {
        matrix_compose(run->values + operands[0], run->values + operands[1], result);
        return all_finite(result, 12) || fail(run, step->span, DIAG_NOT_FINITE, "the transform is too large");
    }
    return matrix_inverse(run->values + operands[0], result) ||
           fail(run, step->span, DIAG_NOT_FINITE, eval_complaint(OP_INVERSE, result));
}

static bool quadric(Run *run, const PlanStep *step)
{
    const uint32_t *operands = run->plan->operands + step->first;
    double inverse[12];
    if (!matrix_inverse(run->values + operands[1], inverse)) {
        return fail(run, step->span, DIAG_NOT_FINITE, eval_complaint(OP_TRANSFORM, inverse));
    }
    return quadric_transform(run->values + operands[0], inverse, run->values + step->result) ||
           fail(run, step->span, DIAG_NOT_FINITE, "the coefficients of the quadric are too large");
}

static FieldCode field_program(const Plan *plan, uint32_t *operand)
{
    FieldCode code = {plan->operands + *operand + 1, plan->operands[*operand]};
    *operand += 1 + code.count;
    return code;
}

static bool place(Run *run, const PlanStep *step)
{
    uint32_t next = step->first;
    FieldCode code = field_program(run->plan, &next);
    double args[6];
    bool ray = step->op == OP_SURFACE;
    for (uint32_t k = 0; k < (ray ? 6 : 4); k++) {
        Slot slot = run->plan->operands[next + k];
        args[k] = run->values[slot];
        if (!isfinite(args[k])) return blame(run, step->span, slot);
    }
    double *result = run->values + step->result;
    bool found = ray ? ray_surface(code, run->values, args, args + 3, result)
                     : field_place(code, run->values, args, args[3], result);
    return found || fail(run, step->span, DIAG_NOT_FINITE, eval_complaint(step->op, args));
}

static void height(Run *run, const PlanStep *step)
{
    const uint32_t *operands = run->plan->operands;
    uint32_t next = step->first;
    FieldCode field = field_program(run->plan, &next);
    FieldCode support = field_program(run->plan, &next);
    const double *m = run->values + operands[next];
    double point[3];
    for (uint32_t k = 0; k < 3; k++) point[k] = run->values[operands[next + 1 + k]];
    run->values[step->result] = all_finite(point, 3) ? field_height(field, support, run->values, m, point) : NAN;
}

static void value_at(Run *run, const PlanStep *step)
{
    uint32_t next = step->first;
    FieldCode field = field_program(run->plan, &next);
    double point[3];
    for (uint32_t k = 0; k < 3; k++) point[k] = run->values[run->plan->operands[next + k]];
    run->values[step->result] = all_finite(point, 3) ? field_value(field, run->values, point) : NAN;
}

static void steepness(Run *run, const PlanStep *step)
{
    const uint32_t *operands = run->plan->operands;
    uint32_t next = step->first;
    FieldCode code = field_program(run->plan, &next);
    const double *m = run->values + operands[next];
    double low = run->values[operands[next + 1]], high = run->values[operands[next + 2]];
    bool known = isfinite(low) && isfinite(high);
    run->values[step->result] = known ? field_steepness(code, run->values, m, low, high) : NAN;
}

static bool check_assert(Run *run, const PlanStep *step)
{
    Slot slot = run->plan->operands[step->first];
    if (!isfinite(run->values[slot])) return blame(run, step->span, slot);
    return run->values[slot] != 0 || fail(run, step->span, DIAG_ASSERT_FAILED, step->text);
}

static bool run_step(Run *run, const PlanStep *step)
{
    switch ((StepKind)step->kind) {
    case STEP_SCALAR: {
        const uint32_t *operands = run->plan->operands + step->first;
        double args[3];
        for (uint32_t k = 0; k < step->count; k++) args[k] = run->values[operands[k]];
        run->values[step->result] = eval_scalar(step->op, args);
        return true;
    }
    case STEP_GATHER: return gather(run, step);
    case STEP_MATRIX: return matrix(run, step);
    case STEP_QUADRIC: return quadric(run, step);
    case STEP_PLACE: return place(run, step);
    case STEP_HEIGHT: height(run, step); return true;
    case STEP_AT: value_at(run, step); return true;
    case STEP_STEEPNESS: steepness(run, step); return true;
    case STEP_ASSERT: return check_assert(run, step);
    }
    return false;
}

// --- a frame

static void default_inputs(const Plan *plan, double *values)
{
    for (uint32_t k = 0; k < plan->param_count; k++) {
        const IrParam *param = &plan->params[k];
        if (param->structure) continue;
        uint32_t count = param->type == PARAM_VEC2 ? 2 : param->type >= PARAM_VEC3 ? 3 : 1;
        memcpy(values + plan->inputs + param->slot, param->value, count * sizeof *values);
    }
}

bool frame_begin(const Plan *plan, const FrameInput *input, double *values, FrameError *error)
{
    Run run = {plan, values, error};
    *error = (FrameError){0};
    memcpy(values, plan->image, plan->slot_count * sizeof *values);
    values[plan->time] = input->time;
    values[plan->frame] = input->frame;
    if (input->inputs) {
        memcpy(values + plan->inputs, input->inputs, plan->input_count * sizeof *values);
    } else {
        default_inputs(plan, values);
    }
    bool known =
        isfinite(input->time) && isfinite(input->frame) && all_finite(values + plan->inputs, plan->input_count);
    return known || fail(&run, (Span){0}, DIAG_NOT_FINITE, "the time or a parameter is not a finite number");
}

bool frame_run(const Plan *plan, uint32_t from, uint32_t to, double *values, FrameError *error)
{
    Run run = {plan, values, error};
    for (uint32_t k = from; k < to; k++) {
        if (!run_step(&run, &plan->steps[k])) return false;
    }
    return true;
}

bool frame_evaluate(const Plan *plan, const FrameInput *input, double *values, FrameError *error)
{
    return frame_begin(plan, input, values, error) && frame_run(plan, 0, plan->step_count, values, error);
}

// --- programs of any origin

static bool slots_fit(const Plan *plan, Slot first, uint32_t count)
{
    return first <= plan->slot_count && count <= plan->slot_count - first;
}

static bool operands_fit(const Plan *plan, const PlanStep *step, uint32_t from, uint32_t count, uint32_t width)
{
    if (from > step->count || count > step->count - from) return false;
    for (uint32_t k = 0; k < count; k++) {
        if (!slots_fit(plan, plan->operands[step->first + from + k], width)) return false;
    }
    return true;
}

static bool scalars_fit(const Plan *plan, const PlanStep *step, uint32_t from, uint32_t count)
{
    return step->count == from + count && operands_fit(plan, step, from, count, 1);
}

// A field program at operand `*from`, which goes behind it.
static bool program_fits(const Plan *plan, const PlanStep *step, uint32_t *from)
{
    if (*from >= step->count) return false;
    uint32_t count = plan->operands[step->first + *from], left = step->count - *from - 1;
    if (count > left || !field_check((FieldCode){plan->operands + step->first + *from + 1, count}, plan->slot_count))
        return false;
    *from += 1 + count;
    return true;
}

static bool matrix_step_fits(const Plan *plan, const PlanStep *step)
{
    switch (step->op) {
    case OP_COMPOSE: return step->count == 2 && operands_fit(plan, step, 0, 2, 12);
    case OP_INVERSE: return step->count == 1 && operands_fit(plan, step, 0, 1, 12);
    case OP_STAND: return scalars_fit(plan, step, 0, 7);
    default: return false;
    }
}

static bool step_fits(const Plan *plan, const PlanStep *step)
{
    uint32_t next = 0;
    if (step->first > plan->operand_count || step->count > plan->operand_count - step->first) return false;
    if (!slots_fit(plan, step->result, plan_step_width(step))) return false;
    switch (step->kind) {
    case STEP_SCALAR: return eval_knows(step->op) && scalars_fit(plan, step, 0, ir_ops[step->op].operands);
    case STEP_GATHER: return scalars_fit(plan, step, 0, step->count);
    case STEP_MATRIX: return matrix_step_fits(plan, step);
    case STEP_QUADRIC:
        return step->count == 2 && operands_fit(plan, step, 0, 1, 10) && operands_fit(plan, step, 1, 1, 12);
    case STEP_PLACE:
        return (step->op == OP_PLACE || step->op == OP_SURFACE) && program_fits(plan, step, &next) &&
               scalars_fit(plan, step, next, step->op == OP_SURFACE ? 6 : 4);
    case STEP_HEIGHT:
        return program_fits(plan, step, &next) && program_fits(plan, step, &next) &&
               operands_fit(plan, step, next, 1, 12) && scalars_fit(plan, step, next + 1, 3);
    case STEP_AT: return program_fits(plan, step, &next) && scalars_fit(plan, step, next, 3);
    case STEP_STEEPNESS:
        return program_fits(plan, step, &next) && operands_fit(plan, step, next, 1, 12) &&
               scalars_fit(plan, step, next + 1, 2);
    case STEP_ASSERT: return step->text && scalars_fit(plan, step, 0, 1);
    default: return false;
    }
}

uint32_t frame_check(const Plan *plan)
{
    for (uint32_t k = 0; k < plan->step_count; k++) {
        if (!step_fits(plan, &plan->steps[k])) return k;
    }
    return plan->step_count;
}
