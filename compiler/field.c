#include "compiler/field.h"

#include <math.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/quadric.h"
#include "compiler/ray.h"
#include "compiler/tape.h"

// --- building

// What is still to be written: a field, or an operation that waits for its operands.
typedef struct Pending {
    uint32_t words[3], count; // an operation; count 0: `field` is to be compiled
    IrId field;
} Pending;

typedef struct Builder {
    Arena *arena;
    const Ir *ir;
    const FieldSlots *slots;
    Pending *pending;
    uint32_t pending_count, pending_capacity;
    uint32_t *words;
    uint32_t count, capacity;
    uint32_t stack, points; // what the code written so far leaves
    bool ok;
} Builder;

static void push(Builder *b, Pending pending)
{
    if (b->pending_count == FIELD_WORDS_MAX) b->ok = false;
    if (!b->ok) return;
    if (b->pending_count == b->pending_capacity) {
        uint32_t room = b->pending_capacity ? 2 * b->pending_capacity : 64;
        Pending *array = arena_array(b->arena, Pending, room);
        if (b->pending_count) memcpy(array, b->pending, b->pending_count * sizeof *array);
        b->pending = array;
        b->pending_capacity = room;
    }
    b->pending[b->pending_count++] = pending;
}

static void push_field(Builder *b, IrId field)
{
    push(b, (Pending){.field = field});
}

static void push_op(Builder *b, uint32_t count, FieldOp op, uint32_t first, uint32_t second)
{
    push(b, (Pending){.words = {op, first, second}, .count = count});
}

static void emit(Builder *b, const uint32_t *words, uint32_t count)
{
    switch ((FieldOp)words[0]) {
    case FIELD_QUADRIC:
    case FIELD_TAPE:
    case FIELD_EMPTY: b->stack++; break;
    case FIELD_MAX:
    case FIELD_MIN:
    case FIELD_MIX:
    case FIELD_CUBE: b->stack--; break;
    case FIELD_MIX_AT: b->stack -= 2; break;
    case FIELD_ENTER: b->points++; break;
    case FIELD_LEAVE: b->points--; break;
    case FIELD_NEGATE:
    case FIELD_SHOW: break;
    }
    if (b->stack > FIELD_STACK_MAX || b->points > FIELD_POINTS_MAX || b->count + count > FIELD_WORDS_MAX) {
        b->ok = false;
        return;
    }
    if (b->count + count > b->capacity) {
        uint32_t room = b->capacity ? 2 * b->capacity : 64;
        while (room < b->count + count) room *= 2; // tapes are many words at once
        uint32_t *array = arena_array(b->arena, uint32_t, room);
        if (b->count) memcpy(array, b->words, b->count * sizeof *array);
        b->words = array;
        b->capacity = room;
    }
    memcpy(b->words + b->count, words, count * sizeof *words);
    b->count += count;
}

static void emit_enter(Builder *b, IrId matrix)
{
    emit(b, (uint32_t[]){FIELD_ENTER, b->slots->inverse(b->slots->context, matrix)}, 2);
}

// The base is on top. Q is computed at the points of all the maps around it, the cube is added outside of them.
static void perturbation(Builder *b, IrId id)
{
    const FieldSlots *slots = b->slots;
    uint32_t entered = 0;
    for (; ir_at(b->ir, id)->op == OP_PTRANSFORM && b->ok; id = ir_operand(b->ir, id, 0)) {
        emit_enter(b, ir_operand(b->ir, id, 1));
        entered++;
    }
    if (!b->ok) return;
    uint32_t strength = slots->scalar(slots->context, ir_operand(b->ir, id, 1));
    push_op(b, 3, FIELD_CUBE, strength, slots->scalar(slots->context, ir_operand(b->ir, id, 2)));
    while (entered--) push_op(b, 1, FIELD_LEAVE, 0, 0);
    push_field(b, ir_operand(b->ir, id, 0));
}

static void perturbed(Builder *b, IrId id)
{
    for (uint32_t k = ir_at(b->ir, id)->count; k-- > 1;) {
        IrId operand = ir_operand(b->ir, id, k);
        if (ir_at(b->ir, operand)->op != OP_LIFT) push_field(b, operand); // patches are not solved where fields are
    }
    push_field(b, ir_operand(b->ir, id, 0));
}

// Pair by pair from the first on, so that a long list needs room for two values only.
static void folded(Builder *b, IrId id, FieldOp op)
{
    for (uint32_t k = ir_at(b->ir, id)->count; k-- > 1;) {
        push_op(b, 1, op, 0, 0);
        push_field(b, ir_operand(b->ir, id, k));
    }
    push_field(b, ir_operand(b->ir, id, 0));
}

static void emit_tape(Builder *b, IrId expression)
{
    TapeSlots slots = {b->slots->context, b->slots->scalar};
    TapeStep *steps;
    uint32_t count;
    if (!tape_new(b->arena, b->ir, expression, &slots, &steps, &count)) {
        b->ok = false;
        return;
    }
    uint32_t *words = arena_array(b->arena, uint32_t, 2 + 2 * (size_t)count);
    words[0] = FIELD_TAPE;
    words[1] = count;
    memcpy(words + 2, steps, count * sizeof *steps);
    emit(b, words, 2 + 2 * count);
}

// The weight of a morph that differs from point to point is an expression as F of a field is: it waits as one.
static void morph(Builder *b, IrId id)
{
    IrId weight = ir_operand(b->ir, id, 2);
    if (ir_at(b->ir, weight)->rate == RATE_POINT) {
        push_op(b, 1, FIELD_MIX_AT, 0, 0);
        push_field(b, weight);
    } else {
        push_op(b, 2, FIELD_MIX, b->slots->scalar(b->slots->context, weight), 0);
    }
    push_field(b, ir_operand(b->ir, id, 1));
}

static void node(Builder *b, IrId id)
{
    const FieldSlots *slots = b->slots;
    if (ir_at(b->ir, id)->type == IR_SCALAR) {
        emit_tape(b, id);
        return;
    }
    switch ((IrOp)ir_at(b->ir, id)->op) {
    case OP_FIELD: emit_tape(b, ir_operand(b->ir, id, 0)); return;
    case OP_QUADRIC:
        b->ok = b->ok && ir_at(b->ir, id)->rate != RATE_POINT;
        if (b->ok) emit(b, (uint32_t[]){FIELD_QUADRIC, slots->quadric(slots->context, id)}, 2);
        return;
    case OP_THICKEN: // patches are solved for pictures, not for what is asked while a scene is made
    case OP_SHEET:   // no point is inside of a sheet, and its surface has no sign to be found by
    case OP_EMPTY: emit(b, (uint32_t[]){FIELD_EMPTY}, 1); return;
    case OP_UNION: folded(b, id, FIELD_MAX); return;
    case OP_INTERSECT: folded(b, id, FIELD_MIN); return;
    case OP_FREEFORM:
    case OP_DEFORM: perturbed(b, id); return;
    case OP_PERTURB:
    case OP_PTRANSFORM: perturbation(b, id); return;
    case OP_COMPLEMENT: push_op(b, 1, FIELD_NEGATE, 0, 0); break;
    case OP_SHOW: push_op(b, 2, FIELD_SHOW, slots->scalar(slots->context, ir_operand(b->ir, id, 1)), 0); break;
    case OP_TRANSFORM:
        emit_enter(b, ir_operand(b->ir, id, 1));
        push_op(b, 1, FIELD_LEAVE, 0, 0);
        break;
    case OP_MORPH: morph(b, id); break;
    case OP_PAINT:
    case OP_NAMED: break;
    default: b->ok = false; return; // not a field
    }
    push_field(b, ir_operand(b->ir, id, 0));
}

bool field_code(Arena *arena, const Ir *ir, IrId field, const FieldSlots *slots, FieldCode *code)
{
    Builder b = {.arena = arena, .ir = ir, .slots = slots, .ok = true};
    push_field(&b, field);
    while (b.pending_count && b.ok) {
        Pending pending = b.pending[--b.pending_count];
        if (pending.count) {
            emit(&b, pending.words, pending.count);
        } else {
            node(&b, pending.field);
        }
    }
    *code = (FieldCode){b.words, b.count};
    return b.ok;
}

uint32_t field_after(FieldCode code, uint32_t at)
{
    switch (code.words[at]) {
    case FIELD_TAPE: return at + 2 + 2 * code.words[at + 1];
    case FIELD_CUBE: return at + 3;
    case FIELD_QUADRIC:
    case FIELD_SHOW:
    case FIELD_MIX:
    case FIELD_ENTER: return at + 2;
    default: return at + 1;
    }
}

bool field_is_general(FieldCode code)
{
    for (uint32_t k = 0; k < code.count; k = field_after(code, k))
        if (code.words[k] == FIELD_TAPE || code.words[k] == FIELD_MIX_AT) return true;
    return false;
}

// The words of a tape behind its operation, 0: they make no sense.
static uint32_t tape_words(FieldCode code, uint32_t at, uint32_t value_count)
{
    if (at == code.count) return 0;
    uint32_t steps = code.words[at], left = code.count - at - 1;
    if (steps > left / 2 || !tape_check((const TapeStep *)(code.words + at + 1), steps, value_count)) return 0;
    return 1 + 2 * steps;
}

bool field_check(FieldCode code, uint32_t value_count)
{
    uint32_t stack = 0, points = 0;
    for (uint32_t k = 0; k < code.count;) {
        uint32_t op = code.words[k++], operands = 0, width = 1, needs = 1;
        switch (op) {
        case FIELD_TAPE:
            if (!tape_words(code, k, value_count)) return false;
            k += tape_words(code, k, value_count);
            needs = 0;
            stack++;
            break;
        case FIELD_MIX_AT: needs = 3; break;
        case FIELD_QUADRIC:
            operands = 1;
            width = 10;
            needs = 0;
            stack++;
            break;
        case FIELD_EMPTY:
            needs = 0;
            stack++;
            break;
        case FIELD_CUBE: operands = 2; // fall through
        case FIELD_MAX:
        case FIELD_MIN: needs = 2; break;
        case FIELD_NEGATE: break;
        case FIELD_SHOW: operands = 1; break;
        case FIELD_MIX:
            operands = 1;
            needs = 2;
            break;
        case FIELD_ENTER:
            operands = 1;
            width = 12;
            needs = 0;
            points++;
            break;
        case FIELD_LEAVE:
            if (!points--) return false;
            break;
        default: return false;
        }
        if (stack < needs || stack > FIELD_STACK_MAX || points > FIELD_POINTS_MAX || operands > code.count - k)
            return false;
        if (needs > 1) stack -= needs - 1;
        for (; operands; operands--, k++) {
            if (width > value_count || code.words[k] > value_count - width) return false;
        }
    }
    return stack == 1 && points == 0;
}

// --- evaluation

typedef struct Frame { // a point and the map that leads back from it
    double point[3];
    const double *inverse;
} Frame;

static void add_cube(FieldValue *top, const FieldValue *q, double strength, double grow)
{
    double value = q->f + grow;
    if (!(value > 0)) return;
    top->f += strength * value * value * value;
    for (int k = 0; k < 3; k++) top->gradient[k] += 3 * strength * value * value * q->gradient[k];
}

// What has no weight is not looked at, since it may be infinite.
static void mix(FieldValue *two, double t)
{
    if (t <= 0) return;
    if (t >= 1) {
        two[0] = two[1];
        return;
    }
    if (two[0].f == -INFINITY || two[1].f == -INFINITY) { // also where the other is all of space
        two[0] = (FieldValue){.f = -INFINITY};
        return;
    }
    two[0].f = (1 - t) * two[0].f + t * two[1].f;
    for (int k = 0; k < 3; k++) two[0].gradient[k] = (1 - t) * two[0].gradient[k] + t * two[1].gradient[k];
}

// By the chain rule: the gradient of F(M^-1 X) is M^-T of F's.
static void leave(FieldValue *top, const double *inverse)
{
    double g[3] = {0};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) g[k] += inverse[4 * i + k] * top->gradient[i];
    }
    memcpy(top->gradient, g, sizeof g);
}

static FieldValue tape_value(Arena *scratch, const uint32_t *words, const double *values, const double point[3])
{
    double *work = arena_array(scratch, double, TAPE_WORK *(size_t)(TAPE_POINT + words[0]));
    return tape_steps_at((const TapeStep *)(words + 1), words[0], values, point, work);
}

// The weight is on top, with its own gradient.
static void mix_at(FieldValue *two, const FieldValue *weight)
{
    FieldValue a = two[0], b = two[1];
    double t = isnan(weight->f) ? NAN : fmin(fmax(weight->f, 0), 1);
    if (isnan(t)) {
        *two = (FieldValue){.f = NAN};
        return;
    }
    mix(two, t);
    for (int k = 0; k < 3 && t > 0 && t < 1 && isfinite(two->f); k++)
        two->gradient[k] += weight->gradient[k] * (b.f - a.f);
}

FieldValue field_at(FieldCode code, const double *values, const double point[3])
{
    Arena scratch = {0};
    FieldValue stack[FIELD_STACK_MAX + 1]; // below the first there is nothing
    Frame frames[FIELD_POINTS_MAX + 1];
    FieldValue *top = stack;
    Frame *frame = frames;
    memcpy(frame->point, point, sizeof frame->point);
    for (const uint32_t *w = code.words; w < code.words + code.count;) {
        switch ((FieldOp)*w++) {
        case FIELD_QUADRIC:
            top++;
            top->f = quadric_at(values + *w, frame->point);
            quadric_gradient(values + *w++, frame->point, top->gradient);
            break;
        case FIELD_EMPTY: *++top = (FieldValue){.f = -INFINITY}; break;
        case FIELD_MAX:
            top--;
            if (top[1].f > top[0].f || isnan(top[0].f)) top[0] = top[1]; // undefined is outside
            break;
        case FIELD_MIN:
            top--;
            if (top[1].f < top[0].f || isnan(top[1].f)) top[0] = top[1];
            break;
        case FIELD_NEGATE:
            top->f = -top->f;
            for (int k = 0; k < 3; k++) top->gradient[k] = -top->gradient[k];
            break;
        case FIELD_CUBE:
            top--;
            add_cube(top, top + 1, values[w[0]], values[w[1]]);
            w += 2;
            break;
        case FIELD_SHOW:
            if (values[*w++] == 0) *top = (FieldValue){.f = -INFINITY};
            break;
        case FIELD_MIX:
            top--;
            mix(top, values[*w++]);
            break;
        case FIELD_MIX_AT:
            top -= 2;
            mix_at(top, top + 2);
            break;
        case FIELD_TAPE:
            *++top = tape_value(&scratch, w, values, frame->point);
            w += 1 + 2 * w[0];
            break;
        case FIELD_ENTER:
            frame[1].inverse = values + *w++;
            matrix_point(frame[1].inverse, frame->point, frame[1].point);
            frame++;
            break;
        case FIELD_LEAVE:
            leave(top, frame->inverse);
            frame--;
            break;
        }
    }
    arena_release(&scratch);
    return *top;
}

// --- places and heights

typedef struct Line {
    FieldCode code;
    const double *values;
    double origin[3], direction[3];
} Line;

static void line_point(const Line *line, double t, double p[3])
{
    for (int k = 0; k < 3; k++) p[k] = line->origin[k] + t * line->direction[k];
}

// F along the line, and its slope there.
static double line_at(const Line *line, double t, double *slope)
{
    double p[3];
    line_point(line, t, p);
    FieldValue value = field_at(line->code, line->values, p);
    *slope = 0;
    for (int k = 0; k < 3; k++) *slope += value.gradient[k] * line->direction[k];
    return value.f;
}

// The root between a and b, over whose ends the sign changes: Newton's steps, and a halving where they leave the
// bracket, and every third time in any case, so that the bracket shrinks. Ends where a step moves no more.
static double line_root(const Line *line, double a, double b, bool positive_at_a)
{
    double t = a + (b - a) / 2;
    for (int step = 0; step < 200; step++) {
        double slope, f = line_at(line, t, &slope);
        if (f == 0) break;
        if ((f > 0) == positive_at_a) {
            a = t;
        } else {
            b = t;
        }
        double next = t - f / slope;
        if (step % 3 == 2 || !(next > fmin(a, b) && next < fmax(a, b))) next = a + (b - a) / 2;
        if (fabs(next - t) <= 1e-16 * fabs(t)) break;
        t = next;
    }
    return t;
}

// The ends of a bracket of the root nearest to 0 on either side of it, `*b` the farther. F is `start` at 0.
static bool line_bracket(const Line *line, double start, double first_step, double *a, double *b)
{
    double before = 0;
    for (double t = first_step; t < 1e6 * first_step; before = t, t = t * 1.1 + first_step) {
        for (int side = -1; side <= 1; side += 2) {
            double slope, f = line_at(line, side * t, &slope);
            if (!isfinite(f) || (f != 0 && (f > 0) == (start > 0))) continue;
            *a = side * before;
            *b = side * t;
            return true;
        }
    }
    return false;
}

bool field_place(FieldCode code, const double *values, const double point[3], double turn, double result[12])
{
    Line line = {.code = code, .values = values};
    memcpy(line.origin, point, sizeof line.origin);
    FieldValue start = field_at(code, values, point);
    const double *g = start.gradient;
    double slope = hypot(hypot(g[0], g[1]), g[2]), t = 0;
    if (!isfinite(start.f) || !isfinite(slope) || slope == 0) return false;
    if (start.f != 0) {
        double a, b, step = fabs(start.f) / slope / 8; // of Newton's first step
        for (int k = 0; k < 3; k++) line.direction[k] = g[k] / slope;
        if (!(step > 0) || !line_bracket(&line, start.f, step, &a, &b)) return false;
        t = line_root(&line, a, b, start.f > 0);
    }
    double at[3], normal[3];
    line_point(&line, t, at);
    FieldValue hit = field_at(code, values, at);
    for (int k = 0; k < 3; k++) normal[k] = -hit.gradient[k];
    return matrix_stand(at, normal, turn, result);
}

double field_height(FieldCode field, FieldCode support, const double *values, const double matrix[12],
                    const double point[3])
{
    double p[3], q = field_at(support, values, point).f;
    if (!(q > 0)) return NAN;
    matrix_point(matrix, point, p);
    return -field_at(field, values, p).f / (q * q * q);
}

double field_value(FieldCode code, const double *values, const double point[3])
{
    double f = field_at(code, values, point).f;
    if (isnan(f) && isfinite(point[0]) && isfinite(point[1]) && isfinite(point[2])) return -1e300;
    return isinf(f) ? copysign(1e300, f) : f;
}

static FieldValue axis_value(FieldCode code, const double *values, const double frame[12], double height)
{
    double at[3];
    matrix_point(frame, (const double[3]){0.5, 0.5, height}, at);
    return field_at(code, values, at);
}

double field_steepness(FieldCode code, const double *values, const double frame[12], double low, double high)
{
    enum { STEPS = 1000, HALVINGS = 60 };
    bool inside = axis_value(code, values, frame, high).f >= 0;
    for (int k = 1; k <= STEPS; k++) {
        double at = high + (low - high) * k / STEPS;
        if ((axis_value(code, values, frame, at).f >= 0) == inside) continue;
        double above = high + (low - high) * (k - 1) / STEPS, below = at;
        for (int step = 0; step < HALVINGS; step++) {
            double middle = 0.5 * (above + below);
            if ((axis_value(code, values, frame, middle).f >= 0) == inside)
                above = middle;
            else
                below = middle;
        }
        FieldValue hit = axis_value(code, values, frame, below);
        return hypot(hypot(hit.gradient[0], hit.gradient[1]), hit.gradient[2]);
    }
    return NAN;
}

// --- folding

typedef struct Constants {
    Arena arena;
    const Ir *ir;
    double *values;
    uint32_t count, capacity;
    bool ok;
} Constants;

static uint32_t constants_add(Constants *c, const double *values, uint32_t count)
{
    if (c->count + count > c->capacity) {
        uint32_t room = c->capacity ? 2 * c->capacity : 64;
        double *array = arena_array(&c->arena, double, room);
        if (c->count) memcpy(array, c->values, c->count * sizeof *array);
        c->values = array;
        c->capacity = room;
    }
    uint32_t first = c->count;
    memcpy(c->values + first, values, count * sizeof *values);
    c->count += count;
    return first;
}

static uint32_t constant_scalar(void *context, IrId scalar)
{
    Constants *c = context;
    double value = NAN;
    if (!ir_is_const(c->ir, scalar, &value)) c->ok = false;
    return constants_add(c, &value, 1);
}

static bool const_quadric(const Ir *ir, IrId quadric, double q[10])
{
    if (ir_at(ir, quadric)->op != OP_QUADRIC) return false;
    for (uint32_t k = 0; k < 10; k++) {
        if (!ir_is_const(ir, ir_operand(ir, quadric, k), &q[k])) return false;
    }
    return true;
}

static uint32_t constant_quadric(void *context, IrId quadric)
{
    Constants *c = context;
    double q[10] = {0};
    if (!const_quadric(c->ir, quadric, q)) c->ok = false;
    return constants_add(c, q, 10);
}

static uint32_t constant_inverse(void *context, IrId matrix)
{
    Constants *c = context;
    double m[12] = {0};
    if (!ir_const_matrix(c->ir, matrix, m) || !matrix_inverse(m, m)) c->ok = false;
    return constants_add(c, m, 12);
}

static bool constants_code(Constants *c, const Ir *ir, IrId field, FieldCode *code)
{
    c->ir = ir;
    c->ok = true;
    FieldSlots slots = {c, constant_scalar, constant_quadric, constant_inverse};
    return field_code(&c->arena, ir, field, &slots, code) && c->ok;
}

static void numbers(const Ir *ir, const IrId *ids, uint32_t count, double *values)
{
    for (uint32_t k = 0; k < count; k++) values[k] = ir_at(ir, ids[k])->number;
}

bool field_fold_place(const Ir *ir, const IrId operands[5], double result[12])
{
    Constants c = {0};
    FieldCode code;
    double point[4];
    numbers(ir, operands + 1, 4, point);
    bool ok = constants_code(&c, ir, operands[0], &code) && field_place(code, c.values, point, point[3], result);
    arena_release(&c.arena);
    return ok;
}

bool field_fold_surface(const Ir *ir, const IrId operands[7], double result[12])
{
    Constants c = {0};
    FieldCode code;
    double ray[6];
    numbers(ir, operands + 1, 6, ray);
    bool ok = constants_code(&c, ir, operands[0], &code) && ray_surface(code, c.values, ray, ray + 3, result);
    arena_release(&c.arena);
    return ok;
}

bool field_fold_height(const Ir *ir, const IrId operands[6], double *strength)
{
    Constants c = {0};
    FieldCode field, support;
    double matrix[12], point[3];
    numbers(ir, operands + 3, 3, point);
    bool ok = ir_const_matrix(ir, operands[2], matrix) && constants_code(&c, ir, operands[0], &field) &&
              constants_code(&c, ir, operands[1], &support);
    if (ok) *strength = field_height(field, support, c.values, matrix, point);
    arena_release(&c.arena);
    return ok && isfinite(*strength);
}

bool field_fold_bounds(const Ir *ir, IrId expression, double low[3], double high[3])
{
    Constants c = {.ir = ir, .ok = true};
    TapeSlots slots = {&c, constant_scalar};
    PlanTape tape = {0};
    TapeStep *steps;
    bool ok = tape_new(&c.arena, ir, expression, &slots, &steps, &tape.count) && c.ok;
    if (ok) tape_bounds(&(Plan){.tape_steps = steps}, &tape, c.values, low, high);
    arena_release(&c.arena);
    return ok;
}

bool field_fold_at(const Ir *ir, const IrId operands[4], double *f)
{
    Constants c = {0};
    FieldCode field;
    double point[3];
    numbers(ir, operands + 1, 3, point);
    bool ok = constants_code(&c, ir, operands[0], &field);
    if (ok) *f = field_value(field, c.values, point);
    arena_release(&c.arena);
    return ok && isfinite(*f);
}

bool field_fold_steepness(const Ir *ir, const IrId operands[4], double *steepness)
{
    Constants c = {0};
    FieldCode field;
    double frame[12], caps[2];
    numbers(ir, operands + 2, 2, caps);
    bool ok = ir_const_matrix(ir, operands[1], frame) && constants_code(&c, ir, operands[0], &field);
    if (ok) *steepness = field_steepness(field, c.values, frame, caps[0], caps[1]);
    arena_release(&c.arena);
    return ok && isfinite(*steepness);
}
