#include "compiler/object_box.h"

#include <math.h>
#include <string.h>

#include "compiler/bounds.h"
#include "compiler/field.h"
#include "compiler/leaf.h"

static Bounds everything(void)
{
    return (Bounds){{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
}

static Bounds nothing(void)
{
    return (Bounds){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static void join(Bounds *box, const Bounds *other, bool united)
{
    for (int k = 0; k < 3; k++) {
        box->low[k] = united ? fmin(box->low[k], other->low[k]) : fmax(box->low[k], other->low[k]);
        box->high[k] = united ? fmax(box->high[k], other->high[k]) : fmin(box->high[k], other->high[k]);
    }
}

// The coefficients of a base that is a quadric of numbers, negative: of what is outside.
static bool base_quadric(const Ir *ir, IrId base, bool negative, double q[10])
{
    if (ir_at(ir, base)->op != OP_QUADRIC || !leaf_const_quadric(ir, base, q)) return false;
    for (int k = 0; negative && k < 10; k++) q[k] = -q[k];
    return true;
}

// A quadric, and where perturbations add to it.
static Bounds core_box(const Ir *ir, IrId core, bool negative)
{
    const IrNode *node = ir_at(ir, core);
    bool formed = node->op == OP_FREEFORM;
    Bounds box = everything();
    double q[10], strength, grow;
    if (node->op == OP_FIELD && !negative)
        return field_fold_bounds(ir, ir_operand(ir, core, 0), box.low, box.high) ? box : everything();
    if (!base_quadric(ir, formed ? ir_operand(ir, core, 0) : core, negative, q)) return everything();
    box = bounds_of_quadric(q);
    for (uint32_t k = 1; formed && k < node->count; k++) {
        IrId part = ir_operand(ir, core, k);
        bool known = ir_at(ir, part)->op == OP_PERTURB && base_quadric(ir, ir_operand(ir, part, 0), false, q) &&
                     ir_is_const(ir, ir_operand(ir, part, 1), &strength) &&
                     ir_is_const(ir, ir_operand(ir, part, 2), &grow);
        if (!known) return everything();
        if (negative ? strength >= 0 : strength <= 0) continue;
        q[9] += grow;
        Bounds support = bounds_of_quadric(q);
        join(&box, &support, true);
    }
    return box;
}

// The box of an object of leaves, from what its quadrics are bounded by, alone and where they meet.
static Bounds box_of(const Ir *ir, IrId id, bool negative, int depth)
{
    enum { DEPTH_MAX = 200, MEETING_MAX = 16 };
    const IrNode *node = ir_at(ir, id);
    bool set = node->op == OP_UNION || node->op == OP_INTERSECT, united = (node->op == OP_UNION) != negative;
    if (leaf_is_core(ir, id)) return core_box(ir, id, negative);
    if (depth == DEPTH_MAX) return everything();
    if (node->op == OP_COMPLEMENT) return box_of(ir, ir_operand(ir, id, 0), !negative, depth + 1);
    if (node->op == OP_PAINT || node->op == OP_NAMED || (node->op == OP_SHOW && !negative))
        return box_of(ir, ir_operand(ir, id, 0), negative, depth + 1);
    if (node->op == OP_EMPTY) return negative ? everything() : nothing();
    if (!set) return everything();
    double quadrics[MEETING_MAX][10];
    const double *meeting[MEETING_MAX];
    uint32_t count = 0;
    Bounds box = united ? nothing() : everything();
    for (uint32_t k = 0; k < node->count; k++) {
        IrId part = ir_operand(ir, id, k);
        bool outside = ir_at(ir, part)->op == OP_COMPLEMENT;
        IrId base = outside ? ir_operand(ir, part, 0) : part;
        Bounds other = box_of(ir, part, negative, depth + 1);
        join(&box, &other, united);
        if (!united && count < MEETING_MAX && base_quadric(ir, base, outside != negative, quadrics[count])) {
            meeting[count] = quadrics[count];
            count++;
        }
    }
    if (count) bounds_cut(&box, meeting, count);
    return box;
}

void object_box(const Ir *ir, IrId leaves, double low[3], double high[3])
{
    Bounds box = box_of(ir, leaves, false, 0);
    memcpy(low, box.low, sizeof box.low);
    memcpy(high, box.high, sizeof box.high);
}
