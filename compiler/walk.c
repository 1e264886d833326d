#include "compiler/walk.h"

#include <assert.h>

static bool is_walked(const Ir *ir, IrId id)
{
    IrType type = ir_at(ir, id)->type;
    return type == IR_FIELD || type == IR_PERTURBATION;
}

enum { LIST_LENGTH = 6 }; // visits of a node that are looked through before the table is asked

// The visit of a node in a context, or 0. `*last` is then the visit behind which a new one goes, 0 if it is the
// table's.
static uint32_t find(const Walk *walk, IrId id, uint32_t context, uint32_t *last)
{
    uint32_t length = 0;
    *last = 0;
    for (uint32_t visit = walk->heads[id]; visit && length < LIST_LENGTH; visit = walk->visits[visit].next, length++) {
        if (walk->visits[visit].context == context) return visit;
        *last = visit;
    }
    if (length < LIST_LENGTH) return 0;
    *last = 0;
    uint32_t index = pairs_find(&walk->more, id, context);
    return index ? walk->more_visit[index] : 0;
}

void walk_reach(Walk *walk, IrId id, uint32_t context)
{
    uint32_t last;
    if (walk->visit_count > WALK_MAX) walk->overflow = true;
    if (walk->overflow || find(walk, id, context, &last)) return;
    walk->visits =
        array_room(walk->scratch, walk->visits, walk->visit_count, &walk->visit_capacity, sizeof *walk->visits);
    uint32_t visit = walk->visit_count++;
    uint32_t head = walk->heads[id];
    walk->visits[visit] = (Visit){.context = context};
    if (!head) {
        walk->heads[id] = visit;
    } else if (last) {
        walk->visits[last].next = visit;
    } else { // behind the listed ones, where only a sweep over all of them comes by
        uint32_t listed = head;
        for (uint32_t k = 1; k < LIST_LENGTH; k++) listed = walk->visits[listed].next;
        walk->visits[visit].next = walk->visits[listed].next;
        walk->visits[listed].next = visit;
        uint32_t index = pairs_index(&walk->more, id, context, NULL);
        walk->more_visit =
            array_room(walk->scratch, walk->more_visit, index, &walk->more_capacity, sizeof *walk->more_visit);
        walk->more_visit[index] = visit;
    }
}

IrId walk_result(const Walk *walk, IrId id, uint32_t context)
{
    uint32_t last, visit = find(walk, id, context, &last);
    assert(visit && walk->visits[visit].result && "the rule up asks for what the rule down has reached");
    return walk->visits[visit].result;
}

IrId walk_run(Walk *walk, IrId root, uint32_t context, WalkDown *down, WalkUp *up)
{
    walk->heads = arena_array(walk->scratch, uint32_t, walk->ir->count);
    walk->more = pairs_new(walk->scratch);
    walk->visit_count = 1;
    walk_reach(walk, root, context);
    for (IrId id = root + 1; id-- > 1 && !walk->overflow;) {
        for (uint32_t visit = walk->heads[id]; visit; visit = walk->visits[visit].next) {
            down(walk, id, walk->visits[visit].context);
        }
    }
    if (walk->overflow) return 0;
    for (IrId id = 1; id <= root; id++) {
        for (uint32_t visit = walk->heads[id]; visit; visit = walk->visits[visit].next) {
            walk->visits[visit].result = up(walk, id, walk->visits[visit].context);
        }
    }
    return walk_result(walk, root, context);
}

void walk_reach_operands(Walk *walk, IrId id, uint32_t context)
{
    for (uint32_t k = 0; k < ir_at(walk->ir, id)->count; k++) {
        IrId operand = ir_operand(walk->ir, id, k);
        if (is_walked(walk->ir, operand)) walk_reach(walk, operand, context);
    }
}

IrId walk_rebuild(Walk *walk, IrId id, uint32_t context)
{
    Ir *ir = walk->ir;
    IrNode node = *ir_at(ir, id);
    bool changed = false;
    for (uint32_t k = 0; k < node.count; k++) {
        IrId operand = ir_operand(ir, id, k);
        IrId result = is_walked(ir, operand) ? walk_result(walk, operand, context) : operand;
        walk->operands = array_room(walk->scratch, walk->operands, k, &walk->operand_capacity, sizeof *walk->operands);
        walk->operands[k] = result;
        if (result != operand) changed = true;
    }
    if (!changed) return id;
    if (node.op == OP_NAMED) return ir_node_text(ir, node.op, node.span, walk->operands, node.count, node.text);
    return ir_node(ir, node.op, node.span, walk->operands, node.count);
}
