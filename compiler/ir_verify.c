// What holds for every IR, between any two passes.
#include "compiler/ir.h"

#include <math.h>

#include "compiler/eval.h"

typedef struct Verifier {
    const Ir *ir;
    IrId id;
    const char *wrong;
} Verifier;

static bool check(Verifier *v, bool holds, const char *invariant)
{
    if (!holds && !v->wrong) {
        const char *name = v->id && v->ir->nodes[v->id].op < OP_COUNT ? ir_ops[v->ir->nodes[v->id].op].name : "scene";
        v->wrong = arena_printf(v->ir->arena, "node %u (%s): %s", v->id, name, invariant);
    }
    return holds;
}

static bool check_operands(Verifier *v, const IrNode *node)
{
    const IrOpInfo *info = &ir_ops[node->op];
    bool counted = info->operands == IR_ANY ? node->count >= info->letters : node->count == info->operands;
    if (!check(v, counted, "the number of operands is what ops.def says")) return false;
    if (!check(v, node->first <= v->ir->operand_count && node->count <= v->ir->operand_count - node->first,
               "operands are in the array")) {
        return false;
    }
    for (uint32_t k = 0; k < node->count; k++) {
        IrId operand = v->ir->operands[node->first + k];
        if (!check(v, operand > 0 && operand < v->id, "operands come before the node")) return false;
        check(v, v->ir->nodes[operand].type == ir_operand_type(node->op, k),
              "operands have the types that ops.def says");
    }
    return true;
}

static void check_rate(Verifier *v, const IrNode *node)
{
    IrRate rate = RATE_CONST;
    if (node->op == OP_PARAM || node->op == OP_TIME || node->op == OP_FRAME) rate = RATE_FRAME;
    if (node->op >= OP_X && node->op <= OP_V) rate = RATE_POINT;
    for (uint32_t k = 0; k < node->count; k++) {
        IrRate other = ir_operand_rate(v->ir, (IrOp)node->op, v->ir->operands[node->first + k]);
        if (other > rate) rate = other;
    }
    if (node->op == OP_PATCH) rate = RATE_FRAME;
    check(v, node->rate == rate, "the rate is the highest of the operands'");
    bool fixed = node->type == IR_MATRIX || node->type == IR_CAMERA || node->type == IR_LIGHT ||
                 node->type == IR_ASSERT || node->type == IR_PART || node->type == IR_PATCH;
    check(v, !fixed || rate <= RATE_FRAME, "maps, cameras, lights, patches and asserts are known once a frame");
}

// Class by class what it says: quadrics are maps and marks of ten coefficients, and so on.
static void check_class(Verifier *v, const IrNode *node)
{
    const Ir *ir = v->ir;
    if (node->type != IR_FIELD) {
        check(v, node->class == CLASS_NONE, "only fields have a class");
        return;
    }
    check(v, node->class >= CLASS_QUADRIC && node->class <= CLASS_GENERAL, "a field has a class");
    IrClass base = node->count && node->op != OP_QUADRIC ? ir->nodes[ir->operands[node->first]].class : CLASS_NONE;
    switch ((IrOp)node->op) {
    case OP_QUADRIC:
        check(v, node->class == (node->rate == RATE_POINT ? CLASS_GENERAL : CLASS_QUADRIC),
              "ten numbers are a quadric");
        break;
    case OP_FIELD: check(v, node->class == CLASS_GENERAL, "an expression is a general field"); break;
    case OP_FREEFORM:
    case OP_DEFORM:
        check(v, node->class == (base == CLASS_QUADRIC ? CLASS_FREEFORM : base), "a perturbed quadric is a free form");
        break;
    case OP_EMPTY:
    case OP_THICKEN:
    case OP_SHEET: check(v, node->class == CLASS_SET, "the empty set and sheets are sets"); break;
    case OP_SHOW:
    case OP_UNION:
    case OP_INTERSECT:
        check(v, node->class == CLASS_SET || node->class == CLASS_GENERAL, "set operations make sets");
        break;
    case OP_MORPH: check(v, node->class >= base, "a morph is at least what its operands are"); break;
    default: check(v, node->class == base, "maps and marks keep the class"); break;
    }
}

static void check_patch(Verifier *v, const IrNode *node)
{
    check(v, node->text != NULL, "a patch has a name");
    double nodes = 0, value;
    for (uint32_t k = 0; k < PATCH_CONSTS; k++) {
        bool known = ir_is_const(v->ir, v->ir->operands[node->first + k], &value);
        check(v, known && (k == 0 || value == 0 || value == 1), "what shapes a patch is known");
        if (k == 0) nodes = value;
    }
    check(v, nodes >= 0 && nodes <= 1e6 && nodes == floor(nodes), "a grid has a whole number of nodes");
}

static void check_payload(Verifier *v, const IrNode *node)
{
    const Ir *ir = v->ir;
    switch ((IrOp)node->op) {
    case OP_PARAM: check(v, node->index < ir->input_count, "a param names an input"); break;
    case OP_ENTRY: check(v, node->index < 12, "a map has twelve numbers"); break;
    case OP_CAMERA: check(v, node->index <= 1, "a camera is perspective or orthographic"); break;
    case OP_LIGHT: check(v, node->index <= LIGHT_SPOT, "a light is directional, a point or a spot"); break;
    case OP_COEFFICIENT:
        check(v, node->index <= 9 && ir->nodes[ir->operands[node->first]].class == CLASS_QUADRIC,
              "a quadric has ten coefficients");
        break;
    case OP_NAMED:
    case OP_ASSERT: check(v, node->text != NULL, "a name and a message have a text"); break;
    case OP_PATCH: check_patch(v, node); break;
    case OP_CONST: check(v, isfinite(node->number), "a number is finite"); break;
    case OP_PERTURB:
        check(v, ir->nodes[ir->operands[node->first]].class == CLASS_QUADRIC,
              "the function of a perturbation is a quadric");
        // fall through: it has no payload
        __attribute__((fallthrough));
    default: check(v, node->bits == 0, "only some operations have an index or a text"); break;
    }
}

// Scalars of numbers were folded, unless that has no finite value.
static void check_folded(Verifier *v, const IrNode *node)
{
    double values[3];
    if (!eval_knows(node->op)) return;
    for (uint32_t k = 0; k < node->count; k++) {
        if (!ir_is_const(v->ir, v->ir->operands[node->first + k], &values[k])) return;
    }
    check(v, !isfinite(eval_scalar(node->op, values)), "what is const is folded");
}

static void check_params(Verifier *v)
{
    const Ir *ir = v->ir;
    uint32_t next = 0;
    for (uint32_t k = 0; k < ir->param_count; k++) {
        const IrParam *param = &ir->params[k];
        check(v, param->name != NULL, "a param has a name");
        check(v, param->type <= PARAM_COLOR, "a param has a type");
        check(v, param->structure == (param->type <= PARAM_STRING), "bool, int and string params are structure");
        if (param->structure) continue;
        check(v, param->slot == next, "handles have slots one after another");
        next += param->type == PARAM_VEC2 ? 2 : param->type >= PARAM_VEC3 ? 3 : 1;
    }
    check(v, next == ir->input_count, "the handles' slots are all inputs");
}

static bool is_of(const Ir *ir, IrId id, IrType type)
{
    return id > 0 && id < ir->count && ir->nodes[id].type == type;
}

static void check_scene(Verifier *v)
{
    const Ir *ir = v->ir;
    v->id = 0;
    check(v, is_of(ir, ir->root, IR_FIELD), "the scene is a field");
    check(v, is_of(ir, ir->camera, IR_CAMERA), "there is a camera");
    check(v, is_of(ir, ir->background, IR_BACKGROUND), "there is a background");
    for (uint32_t k = 0; k < ir->light_count; k++) check(v, is_of(ir, ir->lights[k], IR_LIGHT), "lights are lights");
    for (uint32_t k = 0; k < ir->assert_count; k++)
        check(v, is_of(ir, ir->asserts[k], IR_ASSERT), "asserts are asserts");
    for (uint32_t k = 0; k < ir->patch_count; k++) check(v, is_of(ir, ir->patches[k], IR_PATCH), "patches are patches");
    check(v, isfinite(ir->duration) && ir->duration >= 0, "the duration is a time");
    check(v, isfinite(ir->fps) && ir->fps > 0, "frames a second are more than none");
    check_params(v);
}

const char *ir_verify(const Ir *ir)
{
    Verifier v = {.ir = ir};
    for (v.id = 1; v.id < ir->count && !v.wrong; v.id++) {
        const IrNode *node = &ir->nodes[v.id];
        if (!check(&v, node->op > OP_NONE && node->op < OP_COUNT, "there is such an operation")) break;
        check(&v, node->type == ir_ops[node->op].result, "the type is what ops.def says");
        if (!check_operands(&v, node) || v.wrong) break;
        check_rate(&v, node);
        check_class(&v, node);
        check_payload(&v, node);
        check_folded(&v, node);
    }
    if (!v.wrong) check_scene(&v);
    return v.wrong;
}
