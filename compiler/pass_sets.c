// Normalise set operations.
//
// A union's operands are gathered through all unions directly below it, however deep, each of them once: what stands
// there twice adds nothing. EMPTY is neutral in a union and decides an intersection; all of space is the other way
// round. What then has one operand is that operand.
#include <string.h>

#include "compiler/passes.h"
#include "compiler/walk.h"

typedef struct Sets {
    uint32_t *seen; // of a node, the gathering that has met it last
    uint32_t seen_capacity, gathering;
    IrId *list; // what is gathered, and behind it what is still to be looked at
    uint32_t count, capacity;
    IrId *stack;
    uint32_t stack_count, stack_capacity;
} Sets;

static bool is_set(const Ir *ir, IrId id)
{
    return ir_at(ir, id)->op == OP_UNION || ir_at(ir, id)->op == OP_INTERSECT;
}

static void begin(Walk *walk)
{
    Sets *s = walk->pass;
    if (s->seen_capacity < walk->ir->count) {
        s->seen_capacity = 2 * walk->ir->count;
        s->seen = arena_array(walk->scratch, uint32_t, s->seen_capacity);
    }
    s->gathering++;
    s->count = s->stack_count = 0;
}

static bool first_time(Sets *s, IrId id)
{
    if (s->seen[id] == s->gathering) return false;
    s->seen[id] = s->gathering;
    return true;
}

static void push_operands(Walk *walk, IrId id)
{
    Sets *s = walk->pass;
    for (uint32_t k = ir_at(walk->ir, id)->count; k-- > 0;) { // backwards: the first is taken first
        s->stack = array_room(walk->scratch, s->stack, s->stack_count, &s->stack_capacity, sizeof *s->stack);
        s->stack[s->stack_count++] = ir_operand(walk->ir, id, k);
    }
}

// Fills the list with the operands of what is on the stack, through all nodes of the same operation.
static void gather(Walk *walk, IrOp op)
{
    Sets *s = walk->pass;
    while (s->stack_count) {
        IrId id = s->stack[--s->stack_count];
        if (!first_time(s, id)) continue;
        if (ir_at(walk->ir, id)->op == op) {
            push_operands(walk, id);
        } else {
            s->list = array_room(walk->scratch, s->list, s->count, &s->capacity, sizeof *s->list);
            s->list[s->count++] = id;
        }
    }
}

static void gather_below(Walk *walk, IrId id)
{
    begin(walk);
    push_operands(walk, id);
    gather(walk, ir_at(walk->ir, id)->op);
}

static void down(Walk *walk, IrId id, uint32_t context)
{
    Sets *s = walk->pass;
    if (!is_set(walk->ir, id)) return;
    gather_below(walk, id);
    for (uint32_t k = 0; k < s->count; k++) walk_reach(walk, s->list[k], context);
}

static bool is_all(const Ir *ir, IrId id)
{
    return ir_at(ir, id)->op == OP_COMPLEMENT;
} // of EMPTY: no other is left
static bool is_empty(const Ir *ir, IrId id)
{
    return ir_at(ir, id)->op == OP_EMPTY;
}

static bool same_operands(const Ir *ir, IrId id, const IrId *operands, uint32_t count)
{
    return ir_at(ir, id)->count == count && !memcmp(ir_operands(ir, id), operands, count * sizeof *operands);
}

static IrId up(Walk *walk, IrId id, uint32_t context)
{
    Sets *s = walk->pass;
    Ir *ir = walk->ir;
    if (!is_set(ir, id)) return id;
    IrOp op = ir_at(ir, id)->op;
    gather_below(walk, id);
    // The operands' results, which may be of the same operation where an operand has become its only operand.
    uint32_t count = s->count;
    for (uint32_t k = 0; k < count; k++) s->list[k] = walk_result(walk, s->list[k], context);
    begin(walk);
    for (uint32_t k = count; k-- > 0;) {
        s->stack = array_room(walk->scratch, s->stack, s->stack_count, &s->stack_capacity, sizeof *s->stack);
        s->stack[s->stack_count++] = s->list[k];
    }
    gather(walk, op);
    IrId absent = 0; // EMPTY or all of space, if that is all there is
    uint32_t kept = 0;
    for (uint32_t k = 0; k < s->count; k++) {
        bool all = is_all(ir, s->list[k]), empty = is_empty(ir, s->list[k]);
        if (op == OP_UNION ? all : empty) return s->list[k];
        if (all || empty) {
            absent = s->list[k];
        } else {
            s->list[kept++] = s->list[k];
        }
    }
    if (!kept) return absent;
    return same_operands(ir, id, s->list, kept) ? id : ir_node(ir, op, ir_at(ir, id)->span, s->list, kept);
}

bool pass_sets(Ir *ir, Arena *scratch)
{
    Sets s = {0};
    Walk walk = {.ir = ir, .scratch = scratch, .pass = &s};
    IrId root = walk_run(&walk, ir->root, 0, down, up);
    if (root) ir->root = root;
    return root != 0;
}
