// Random IR for property tests, and the value of any IR by the plainest means: node after node, without passes and
// without a plan.
//
// A random field has quadrics of all kinds, const and of frame rate, under maps, set operations, free forms,
// deformations, paint, names and visibility, with sharing. The same seed gives the same IR.
#ifndef SCN_TESTS_IR_RANDOM_H
#define SCN_TESTS_IR_RANDOM_H

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/field.h"
#include "compiler/ir.h"
#include "compiler/quadric.h"

// --- numbers

typedef struct Random {
    uint64_t state;
} Random;

static inline uint64_t random_bits(Random *r)
{
    r->state += 0x9e3779b97f4a7c15u; // splitmix64
    uint64_t z = r->state;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static inline int random_below(Random *r, int n)
{
    return (int)(random_bits(r) % (uint64_t)n);
}

static inline double random_in(Random *r, double low, double high)
{
    return low + (high - low) * (double)(random_bits(r) >> 11) / 9007199254740992.0;
}

// --- IR

static const Span test_span = {10, 20};

typedef struct RandomIr {
    Ir *ir;
    Random *random;
    IrId pool[64]; // fields that may be shared
    int pool_count;
    int left;    // nodes that may still be made
    bool moving; // frame-rate values are made
} RandomIr;

static inline IrId ir_quadric(Ir *ir, const double q[10])
{
    IrId operands[10];
    for (int k = 0; k < 10; k++) operands[k] = ir_const(ir, q[k]);
    return ir_node(ir, OP_QUADRIC, test_span, operands, 10);
}

// (r^2 - |X|^2) / 2r
static inline IrId ir_sphere(Ir *ir, double r)
{
    double a = -1 / (2 * r);
    return ir_quadric(ir, (const double[10]){a, a, a, 0, 0, 0, 0, 0, 0, r / 2});
}

static inline IrId ir_moved(Ir *ir, IrId field, double x, double y, double z)
{
    IrId by[3] = {ir_const(ir, x), ir_const(ir, y), ir_const(ir, z)};
    return ir_op2(ir, OP_TRANSFORM, test_span, field, ir_move(ir, test_span, by));
}

// A camera and a background, so that the IR is whole.
static inline void ir_complete(Ir *ir, IrId root)
{
    static const double camera[15] = {0, 0, 5, 0, 0, 0, 0, 1, 0, 0.7, 2, 0, 0, 0, 0};
    IrId operands[15];
    for (int k = 0; k < 15; k++) operands[k] = ir_const(ir, camera[k]);
    ir->root = root;
    ir->camera = ir_node_index(ir, OP_CAMERA, test_span, operands, 15, 0);
    for (int k = 0; k < 4; k++) operands[k] = ir_const(ir, 0.05);
    ir->background = ir_node(ir, OP_BACKGROUND, test_span, operands, 4);
}

static inline IrId ir_material(Ir *ir, double red)
{
    static const double rest[10] = {0.8, 0.8, 0.1, 0.8, 0.2, 30, 0, 0, 1.5, 0};
    IrId operands[11] = {ir_const(ir, red)};
    for (int k = 0; k < 10; k++) operands[k + 1] = ir_const(ir, rest[k]);
    return ir_node(ir, OP_MATERIAL, test_span, operands, 11);
}

// A handle "h" with the default value, in the next slot.
static inline IrId ir_handle(Ir *ir, double value)
{
    IrParam *params = arena_array(ir->arena, IrParam, ir->param_count + 1);
    if (ir->param_count) memcpy(params, ir->params, ir->param_count * sizeof *params);
    params[ir->param_count++] = (IrParam){.name = "h", .type = PARAM_SCALAR, .slot = ir->input_count, .value = {value}};
    ir->params = params;
    return ir_node_index(ir, OP_PARAM, test_span, NULL, 0, ir->input_count++);
}

static inline bool chance(RandomIr *g, int percent)
{
    return random_below(g->random, 100) < percent;
}

static inline IrId random_scalar(RandomIr *g, double low, double high)
{
    Ir *ir = g->ir;
    double value = random_in(g->random, low, high);
    if (!g->moving || !chance(g, 12)) return ir_const(ir, value);
    IrId source =
        chance(g, 50) ? ir_node(ir, OP_TIME, test_span, NULL, 0) : ir_node_index(ir, OP_PARAM, test_span, NULL, 0, 0);
    IrId wave =
        ir_op1(ir, OP_SIN, test_span, ir_op2(ir, OP_MUL, test_span, source, ir_const(ir, random_in(g->random, 1, 3))));
    IrId span = ir_op2(ir, OP_MUL, test_span, wave, ir_const(ir, (high - low) / 4));
    return ir_op2(ir, OP_ADD, test_span, ir_const(ir, (low + high) / 2), span);
}

static inline IrId random_quadric(RandomIr *g)
{
    Ir *ir = g->ir;
    IrId o[10];
    for (int k = 0; k < 10; k++) o[k] = ir_const(ir, 0);
    switch (random_below(g->random, 6)) {
    case 0: // ellipsoid
    case 1:
        for (int k = 0; k < 3; k++) o[k] = random_scalar(g, -2, -0.3);
        o[9] = random_scalar(g, 0.3, 1);
        break;
    case 2: // slab
        o[random_below(g->random, 3)] = random_scalar(g, -1.5, -0.5);
        o[9] = random_scalar(g, 0.2, 1);
        break;
    case 3: // half-space
        for (int k = 6; k < 10; k++) o[k] = random_scalar(g, -1, 1);
        break;
    case 4: // cone or hyperboloid
        o[0] = o[1] = random_scalar(g, -1, -0.5);
        o[2] = random_scalar(g, 0.2, 1);
        o[9] = random_scalar(g, -0.5, 0.5);
        break;
    default: // anything
        for (int k = 0; k < 10; k++) o[k] = random_scalar(g, -1, 1);
        break;
    }
    return ir_node(ir, OP_QUADRIC, test_span, o, 10);
}

static inline IrId random_matrix(RandomIr *g)
{
    Ir *ir = g->ir;
    IrId v[6];
    switch (random_below(g->random, 5)) {
    case 0:
    case 1:
        for (int k = 0; k < 3; k++) v[k] = random_scalar(g, -2, 2);
        return ir_move(ir, test_span, v);
    case 2: {
        IrId axis[3], about[3];
        for (int k = 0; k < 3; k++) axis[k] = ir_const(ir, random_in(g->random, 0.2, 1));
        for (int k = 0; k < 3; k++) about[k] = random_scalar(g, -1, 1);
        return ir_rotate_axis(ir, test_span, axis, random_scalar(g, -3, 3), chance(g, 50) ? about : NULL);
    }
    case 3:
        for (int k = 0; k < 3; k++) v[k] = random_scalar(g, 0.5, 2);
        return ir_scale(ir, test_span, v, NULL);
    default:
        for (int k = 0; k < 6; k++) v[k] = random_scalar(g, -0.3, 0.3);
        return ir_shear(ir, test_span, v);
    }
}

static inline IrId random_perturbation(RandomIr *g)
{
    Ir *ir = g->ir;
    IrId q = random_quadric(g);
    if (chance(g, 30)) q = ir_op2(ir, OP_TRANSFORM, test_span, q, random_matrix(g));
    if (chance(g, 10)) q = ir_op1(ir, OP_COMPLEMENT, test_span, q);
    IrId p = ir_op3(ir, OP_PERTURB, test_span, q, random_scalar(g, -1, 1),
                    chance(g, 30) ? random_scalar(g, -0.3, 0.3) : ir_const(ir, 0));
    if (chance(g, 40)) p = ir_op2(ir, OP_PTRANSFORM, test_span, p, random_matrix(g));
    if (chance(g, 10)) p = ir_op2(ir, OP_PTRANSFORM, test_span, p, random_matrix(g));
    return p;
}

static inline IrId random_field(RandomIr *g, int depth);

static inline IrId random_list(RandomIr *g, IrOp op, int depth)
{
    IrId operands[8];
    int count = 1 + random_below(g->random, 4);
    for (int k = 0; k < count; k++) operands[k] = random_field(g, depth - 1);
    return ir_node(g->ir, op, test_span, operands, (uint32_t)count);
}

static inline IrId random_perturbed(RandomIr *g, IrOp op, int depth)
{
    IrId operands[8] = {random_field(g, depth - 1)};
    int count = 1 + random_below(g->random, 4);
    for (int k = 1; k < count; k++) operands[k] = random_perturbation(g);
    return ir_node(g->ir, op, test_span, operands, (uint32_t)count);
}

static inline IrId random_condition(RandomIr *g)
{
    return ir_op2(g->ir, OP_LT, test_span, random_scalar(g, 0, 1), ir_const(g->ir, 0.6));
}

static inline IrId random_node(RandomIr *g, int depth)
{
    static const char *const names[] = {"head", "eye", "ring"};
    Ir *ir = g->ir;
    int kind = depth <= 0 || g->left <= 0 ? 0 : random_below(g->random, 21);
    g->left--;
    switch (kind) {
    case 3:
    case 4:
    case 5: return random_list(g, OP_UNION, depth);
    case 6:
    case 7:
    case 8: return random_list(g, OP_INTERSECT, depth);
    case 9:
    case 10: return ir_op1(ir, OP_COMPLEMENT, test_span, random_field(g, depth - 1));
    case 11:
    case 12: return random_perturbed(g, OP_FREEFORM, depth);
    case 13: return random_perturbed(g, OP_DEFORM, depth);
    case 14:
    case 15: return ir_op2(ir, OP_TRANSFORM, test_span, random_field(g, depth - 1), random_matrix(g));
    case 16:
        return ir_op2(ir, OP_PAINT, test_span, random_field(g, depth - 1), ir_material(ir, random_in(g->random, 0, 1)));
    case 17: {
        IrId field = random_field(g, depth - 1);
        return ir_node_text(ir, OP_NAMED, test_span, &field, 1, names[random_below(g->random, 3)]);
    }
    case 18: return ir_op2(ir, OP_SHOW, test_span, random_field(g, depth - 1), random_condition(g));
    case 20: {
        IrId a = random_field(g, depth - 1), b = random_field(g, depth - 2);
        return ir_op3(ir, OP_MORPH, test_span, a, b, random_scalar(g, 0.1, 0.9));
    }
    case 19:
        if (chance(g, 20)) return ir_node(ir, OP_EMPTY, test_span, NULL, 0);
        // fall through
    default: return random_quadric(g);
    }
}

static inline IrId random_field(RandomIr *g, int depth)
{
    if (g->pool_count && chance(g, 15)) return g->pool[random_below(g->random, g->pool_count)];
    IrId id = random_node(g, depth);
    if (g->pool_count < 64 && chance(g, 40)) g->pool[g->pool_count++] = id;
    return id;
}

static inline Ir *random_ir(Arena *arena, Random *random, bool moving)
{
    RandomIr g = {.ir = ir_new(arena), .random = random, .left = 40, .moving = moving};
    ir_handle(g.ir, random_in(random, -1, 1));
    ir_complete(g.ir, random_field(&g, 6));
    return g.ir;
}

// --- values

typedef struct IrValues {
    const Ir *ir;
    Arena *arena;
    double *scalars;        // by node
    double (*matrices)[12]; // by node
    double *values;         // of a field program
    uint32_t count, capacity;
} IrValues;

static inline uint32_t values_add(IrValues *v, const double *numbers, uint32_t count)
{
    if (v->count + count > v->capacity) {
        uint32_t room = 2 * (v->count + count) + 64;
        double *values = arena_array(v->arena, double, room);
        if (v->count) memcpy(values, v->values, v->count * sizeof *values);
        v->values = values;
        v->capacity = room;
    }
    memcpy(v->values + v->count, numbers, count * sizeof *numbers);
    v->count += count;
    return v->count - count;
}

static inline uint32_t values_scalar(void *context, IrId id)
{
    IrValues *v = context;
    return values_add(v, &v->scalars[id], 1);
}

static inline uint32_t values_quadric(void *context, IrId id)
{
    IrValues *v = context;
    double q[10];
    for (uint32_t k = 0; k < 10; k++) q[k] = v->scalars[ir_operand(v->ir, id, k)];
    return values_add(v, q, 10);
}

static inline uint32_t values_inverse(void *context, IrId id)
{
    IrValues *v = context;
    double m[12] = {0};
    bool ok = matrix_inverse(v->matrices[id], m);
    assert(ok && "random maps can be inverted");
    (void)ok;
    return values_add(v, m, 12);
}

static inline FieldCode ir_field_code(IrValues *v, IrId field)
{
    FieldSlots slots = {v, values_scalar, values_quadric, values_inverse};
    FieldCode code = {0};
    bool ok = field_code(v->arena, v->ir, field, &slots, &code);
    assert(ok && "the field is not too large");
    (void)ok;
    return code;
}

static inline void ir_evaluate_matrix(IrValues *v, IrId id)
{
    const IrId *o = ir_operands(v->ir, id);
    double *m = v->matrices[id], args[7];
    bool ok = true;
    switch ((IrOp)ir_at(v->ir, id)->op) {
    case OP_MATRIX:
        for (int k = 0; k < 12; k++) m[k] = v->scalars[o[k]];
        break;
    case OP_COMPOSE: matrix_compose(v->matrices[o[0]], v->matrices[o[1]], m); break;
    case OP_INVERSE: ok = matrix_inverse(v->matrices[o[0]], m); break;
    case OP_STAND:
        for (int k = 0; k < 7; k++) args[k] = v->scalars[o[k]];
        ok = matrix_stand(args, args + 3, args[6], m);
        break;
    default: // OP_PLACE
        for (int k = 0; k < 4; k++) args[k] = v->scalars[o[k + 1]];
        ok = field_place(ir_field_code(v, o[0]), v->values, args, args[3], m);
        break;
    }
    assert(ok && "random maps can be computed");
    (void)ok;
}

static inline double ir_evaluate_coefficient(IrValues *v, IrId id)
{
    IrId base = ir_operand(v->ir, id, 0),
         quadric = ir_at(v->ir, base)->op == OP_QUADRIC ? base : ir_operand(v->ir, base, 0);
    double q[10], inverse[12];
    for (uint32_t k = 0; k < 10; k++) q[k] = v->scalars[ir_operand(v->ir, quadric, k)];
    if (base == quadric) return q[ir_at(v->ir, id)->index];
    bool ok = matrix_inverse(v->matrices[ir_operand(v->ir, base, 1)], inverse) && quadric_transform(q, inverse, q);
    assert(ok && "random maps can be inverted");
    (void)ok;
    return q[ir_at(v->ir, id)->index];
}

// The values of all scalars and matrices of an IR at a time.
static inline IrValues ir_evaluate(const Ir *ir, Arena *arena, double time, const double *inputs)
{
    IrValues v = {.ir = ir, .arena = arena};
    v.scalars = arena_array(arena, double, ir->count);
    v.matrices = (double(*)[12])arena_alloc(arena, ir->count * sizeof *v.matrices);
    for (IrId id = 1; id < ir->count; id++) {
        const IrNode *node = ir_at(ir, id);
        const IrId *o = ir_operands(ir, id);
        double args[6];
        if (node->type == IR_MATRIX) ir_evaluate_matrix(&v, id);
        if (node->type != IR_SCALAR || node->rate == RATE_POINT) continue; // expressions are for tapes
        for (uint32_t k = 0; k < node->count && k < 6; k++) args[k] = v.scalars[o[k]];
        switch ((IrOp)node->op) {
        case OP_CONST: v.scalars[id] = node->number; break;
        case OP_PARAM: v.scalars[id] = inputs[node->index]; break;
        case OP_TIME: v.scalars[id] = time; break;
        case OP_FRAME: v.scalars[id] = floor(time * 24); break;
        case OP_HEIGHT: {
            FieldCode field = ir_field_code(&v, o[0]), support = ir_field_code(&v, o[1]);
            v.scalars[id] = field_height(field, support, v.values, v.matrices[o[2]], args + 3);
            break;
        }
        case OP_ENTRY: v.scalars[id] = v.matrices[o[0]][node->index]; break;
        case OP_COEFFICIENT: v.scalars[id] = ir_evaluate_coefficient(&v, id); break;
        default: v.scalars[id] = eval_scalar(node->op, args); break;
        }
    }
    return v;
}

#endif
