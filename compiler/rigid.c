#include "compiler/rigid.h"

#include <math.h>

#include "compiler/eval.h"

enum { DRAWS = 8 };

#define RIGID_ERROR 1e-9 // what rounding leaves of a unit length

// A number between 0.1 and 1.1 that depends on the node and the draw alone.
static double drawn(IrId id, int draw)
{
    uint64_t bits = ((uint64_t)id << 8 | (uint64_t)draw) * 0x9e3779b97f4a7c15u;
    bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9u;
    bits ^= bits >> 27;
    return 0.1 + (double)(bits >> 11) / (double)(UINT64_C(1) << 53);
}

static bool is_looked_into(IrOp op)
{
    return op == OP_ADD || op == OP_SUB || op == OP_MUL || op == OP_DIV || op == OP_NEG || op == OP_SQRT ||
           op == OP_SIN || op == OP_COS;
}

// The rows of a MATRIX at a draw. Operands come before what uses them, so one sweep up is enough.
static void rows_at(const Ir *ir, IrId matrix, int draw, const bool *reached, double *values, double rows[3][3])
{
    for (IrId id = 1; id < matrix; id++) {
        const IrNode *node = ir_at(ir, id);
        if (!reached[id]) continue;
        if (node->op == OP_CONST) {
            values[id] = node->number;
        } else if (is_looked_into((IrOp)node->op)) {
            double o[3] = {0};
            for (uint32_t k = 0; k < node->count; k++) o[k] = values[ir_operand(ir, id, k)];
            values[id] = eval_scalar((IrOp)node->op, o);
        } else {
            values[id] = drawn(id, draw);
        }
    }
    for (uint32_t k = 0; k < 12; k++)
        if (k % 4 < 3) rows[k / 4][k % 4] = values[ir_operand(ir, matrix, k)];
}

static bool are_orthonormal(double rows[3][3])
{
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = i == j ? -1 : 0;
            for (int k = 0; k < 3; k++) sum += rows[i][k] * rows[j][k];
            if (!(fabs(sum) <= RIGID_ERROR)) return false;
        }
    }
    return true;
}

static bool numbers_are_rigid(const Ir *ir, IrId matrix)
{
    Arena scratch = {0};
    bool *reached = arena_array(&scratch, bool, matrix + 1), rigid = true;
    double *values = arena_array(&scratch, double, matrix + 1);
    reached[matrix] = true;
    for (IrId id = matrix; id > 0; id--) {
        bool inside = id == matrix || is_looked_into((IrOp)ir_at(ir, id)->op);
        for (uint32_t k = 0; reached[id] && inside && k < ir_at(ir, id)->count; k++)
            reached[ir_operand(ir, id, k)] = true;
    }
    for (int draw = 0; draw < DRAWS && rigid; draw++) {
        double rows[3][3];
        rows_at(ir, matrix, draw, reached, values, rows);
        rigid = are_orthonormal(rows);
    }
    arena_release(&scratch);
    return rigid;
}

bool matrix_is_rigid(const Ir *ir, IrId matrix)
{
    // Chains of maps are as long as the text has them: one side after the other, without recursion.
    IrId waiting[64];
    uint32_t count = 1;
    waiting[0] = matrix;
    while (count) {
        IrId id = waiting[--count];
        switch ((IrOp)ir_at(ir, id)->op) {
        case OP_PLACE:
        case OP_SURFACE:
        case OP_STAND: break;
        case OP_INVERSE: waiting[count++] = ir_operand(ir, id, 0); break;
        case OP_COMPOSE:
            if (count + 2 > sizeof waiting / sizeof *waiting) return false;
            waiting[count++] = ir_operand(ir, id, 0);
            waiting[count++] = ir_operand(ir, id, 1);
            break;
        case OP_MATRIX:
            if (!numbers_are_rigid(ir, id)) return false;
            break;
        default: return false;
        }
    }
    return true;
}
