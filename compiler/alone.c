// One branch of a scene: a walk that stops at the name. Leaves that it meets before are not asked for, so they are EMPTY, and
// what is made of EMPTY alone is EMPTY again.
#include "compiler/alone.h"

#include <string.h>

#include "compiler/walk.h"

static bool is_wanted(const Walk *walk, IrId id)
{
    const Ir *ir = walk->ir;
    const IrNode *node = ir_at(ir, id);
    if (node->op == OP_SHEET || node->op == OP_THICKEN) { // has the name of its patch
        node = ir_at(ir, ir_operand(ir, id, 0));
        if (node->op == OP_DRIVEN) node = ir_at(ir, ir->operands[node->first]);
    } else if (node->op != OP_NAMED) {
        return false;
    }
    return node->text && !strcmp(node->text, walk->pass);
}

// What is taken as it is: the branch itself, and perturbations, whose quadrics are no objects.
static bool stays(const Walk *walk, IrId id)
{
    return is_wanted(walk, id) || ir_at(walk->ir, id)->type == IR_PERTURBATION;
}

static bool is_leaf(const Ir *ir, IrId id)
{
    IrOp op = ir_at(ir, id)->op;
    return op == OP_EMPTY || op == OP_QUADRIC || op == OP_FIELD || op == OP_SHEET || op == OP_THICKEN;
}

static void down(Walk *walk, IrId id, uint32_t context)
{
    if (!stays(walk, id) && !is_leaf(walk->ir, id)) walk_reach_operands(walk, id, context);
}

static IrId nothing(Ir *ir)
{
    return ir_node(ir, OP_EMPTY, (Span){0}, NULL, 0);
}

// The union of what is left of a node's fields.
static IrId joined(Walk *walk, IrId id, uint32_t context)
{
    Ir *ir = walk->ir;
    uint32_t count = 0, fields = ir_at(ir, id)->op == OP_MORPH ? 2 : ir_at(ir, id)->count;
    IrId *kept = arena_array(walk->scratch, IrId, fields);
    for (uint32_t k = 0; k < fields; k++) {
        IrId result = walk_result(walk, ir_operand(ir, id, k), context);
        if (ir_at(ir, result)->op != OP_EMPTY) kept[count++] = result;
    }
    return ir_node(ir, OP_UNION, ir_at(ir, id)->span, kept, count);
}

static IrId up(Walk *walk, IrId id, uint32_t context)
{
    Ir *ir = walk->ir;
    if (stays(walk, id)) return id;
    if (is_leaf(ir, id)) return nothing(ir);
    IrId inner = walk_result(walk, ir_operand(ir, id, 0), context);
    switch ((IrOp)ir_at(ir, id)->op) {
    case OP_UNION:
    case OP_INTERSECT:
    case OP_MORPH: return joined(walk, id, context);
    case OP_COMPLEMENT:
    case OP_SHOW:
    case OP_NAMED: return inner;
    default: return ir_at(ir, inner)->op == OP_EMPTY ? inner : walk_rebuild(walk, id, context);
    }
}

IrId alone(Ir *ir, IrId root, const char *name)
{
    Arena scratch = {0};
    Walk walk = {.ir = ir, .scratch = &scratch, .pass = (void *)name};
    IrId result = walk_run(&walk, root, 0, down, up);
    arena_release(&scratch);
    return result;
}

int alone_names(const Ir *ir, IrId root, uint32_t room, Arena *arena, const char ***names)
{
    bool *reached = arena_array(arena, bool, root + 1);
    const char **list = arena_array(arena, const char *, root + 1 + room);
    int count = 0;
    reached[root] = true;
    for (IrId id = root; id > 0; id--) {
        for (uint32_t k = 0; reached[id] && k < ir_at(ir, id)->count; k++) reached[ir_operand(ir, id, k)] = true;
    }
    for (IrId id = 1; id <= root; id++) {
        if (reached[id] && ir_at(ir, id)->op == OP_NAMED) list[count++] = ir_at(ir, id)->text;
    }
    *names = list;
    return count;
}
