#include "compiler/passes.h"

#include <stddef.h>

const Pass passes[PASS_COUNT] = {
    {"polynomials", pass_polynomials, (const IrOp[]){OP_NONE}},
    {"transforms", pass_transforms, (const IrOp[]){OP_PTRANSFORM, OP_NONE}},
    {"deformations", pass_deformations, (const IrOp[]){OP_PTRANSFORM, OP_DEFORM, OP_NONE}},
    {"attributes", pass_attributes, (const IrOp[]){OP_PTRANSFORM, OP_DEFORM, OP_NONE}},
    {"morphs", pass_morphs, (const IrOp[]){OP_PTRANSFORM, OP_DEFORM, OP_MORPH, OP_NONE}},
    {"sets", pass_sets, (const IrOp[]){OP_PTRANSFORM, OP_DEFORM, OP_MORPH, OP_NONE}},
    {"fields", pass_fields, (const IrOp[]){OP_PTRANSFORM, OP_DEFORM, OP_MORPH, OP_NONE}},
};

// Fields that places and heights look at are left as they are written; only those of the scene itself are rewritten.
static const IrOp *reached_gone(const Ir *ir, const Pass *pass, Arena *scratch)
{
    bool *reached = arena_array(scratch, bool, ir->count);
    reached[ir->root] = true;
    for (IrId id = ir->root; id > 0; id--) {
        if (!reached[id]) continue;
        for (const IrOp *op = pass->gone; *op; op++) {
            if (ir_at(ir, id)->op == *op) return op;
        }
        for (uint32_t k = 0; k < ir_at(ir, id)->count; k++) {
            IrId operand = ir_operand(ir, id, k);
            IrType type = ir_at(ir, operand)->type;
            if (type == IR_FIELD || type == IR_PERTURBATION) reached[operand] = true;
        }
    }
    return NULL;
}

const char *pass_verify(const Ir *ir, const Pass *pass)
{
    const char *wrong = ir_verify(ir);
    if (wrong) return wrong;
    Arena scratch = {0};
    const IrOp *left = reached_gone(ir, pass, &scratch);
    if (left) wrong = arena_printf(ir->arena, "after %s: '%s' is still there", pass->name, ir_ops[*left].name);
    arena_release(&scratch);
    return wrong;
}
