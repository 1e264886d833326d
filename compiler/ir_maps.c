// Affine maps as scene authors write them, from scalars of any rate. What is const folds on the way.
#include "compiler/ir.h"

#include <stddef.h>

static IrId add(Ir *ir, Span span, IrId a, IrId b)
{
    return ir_op2(ir, OP_ADD, span, a, b);
}
static IrId sub(Ir *ir, Span span, IrId a, IrId b)
{
    return ir_op2(ir, OP_SUB, span, a, b);
}
static IrId mul(Ir *ir, Span span, IrId a, IrId b)
{
    return ir_op2(ir, OP_MUL, span, a, b);
}

// The map with the linear part `m` (row by row) that leaves `about` where it is: d = p - M p.
static IrId map_about(Ir *ir, Span span, const IrId m[9], const IrId about[3])
{
    IrId rows[12];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) rows[4 * i + j] = m[3 * i + j];
        if (!about) {
            rows[4 * i + 3] = ir_const(ir, 0);
            continue;
        }
        IrId moved = mul(ir, span, m[3 * i], about[0]);
        for (int j = 1; j < 3; j++) moved = add(ir, span, moved, mul(ir, span, m[3 * i + j], about[j]));
        rows[4 * i + 3] = sub(ir, span, about[i], moved);
    }
    return ir_node(ir, OP_MATRIX, span, rows, 12);
}

IrId ir_move(Ir *ir, Span span, const IrId by[3])
{
    IrId zero = ir_const(ir, 0), one = ir_const(ir, 1);
    IrId rows[12] = {one, zero, zero, by[0], zero, one, zero, by[1], zero, zero, one, by[2]};
    return ir_node(ir, OP_MATRIX, span, rows, 12);
}

// Rodrigues: M = c I + s [a]x + (1 - c) a aT, with c and s the cosine and sine and a the axis of length 1. On the
// diagonal it is written c (1 - a_i^2) + a_i^2, which folds where the axis is one of space's.
IrId ir_rotate_axis(Ir *ir, Span span, const IrId axis[3], IrId angle, const IrId about[3])
{
    IrId square = add(ir, span, mul(ir, span, axis[0], axis[0]), mul(ir, span, axis[1], axis[1]));
    square = add(ir, span, square, mul(ir, span, axis[2], axis[2]));
    IrId length = ir_op1(ir, OP_SQRT, span, square);
    IrId a[3];
    for (int k = 0; k < 3; k++) a[k] = ir_op2(ir, OP_DIV, span, axis[k], length);
    IrId one = ir_const(ir, 1), c = ir_op1(ir, OP_COS, span, angle), s = ir_op1(ir, OP_SIN, span, angle);
    IrId rest = sub(ir, span, one, c);
    IrId m[9];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            IrId product = mul(ir, span, a[i], a[j]);
            int k = 3 - i - j; // the third axis where i and j differ
            if (i == j) {
                m[3 * i + j] = add(ir, span, mul(ir, span, c, sub(ir, span, one, product)), product);
            } else if ((i + 1) % 3 == j) { // [a]x has -a_k right of the diagonal, cyclically
                m[3 * i + j] = sub(ir, span, mul(ir, span, rest, product), mul(ir, span, s, a[k]));
            } else {
                m[3 * i + j] = add(ir, span, mul(ir, span, rest, product), mul(ir, span, s, a[k]));
            }
        }
    }
    return map_about(ir, span, m, about);
}

IrId ir_rotate_xyz(Ir *ir, Span span, const IrId angles[3], const IrId about[3])
{
    IrId zero = ir_const(ir, 0), one = ir_const(ir, 1);
    IrId map = ir_matrix(ir, span, (const double[12]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    for (int k = 0; k < 3; k++) {
        if (angles[k] == zero) continue;
        IrId axis[3] = {zero, zero, zero};
        axis[k] = one;
        map = ir_op2(ir, OP_COMPOSE, span, ir_rotate_axis(ir, span, axis, angles[k], about), map);
    }
    return map;
}

IrId ir_scale(Ir *ir, Span span, const IrId factors[3], const IrId about[3])
{
    IrId zero = ir_const(ir, 0);
    IrId m[9] = {factors[0], zero, zero, zero, factors[1], zero, zero, zero, factors[2]};
    return map_about(ir, span, m, about);
}

// x += xy y + xz z, and so on.
IrId ir_shear(Ir *ir, Span span, const IrId xy_xz_yx_yz_zx_zy[6])
{
    const IrId *s = xy_xz_yx_yz_zx_zy;
    IrId one = ir_const(ir, 1);
    IrId m[9] = {one, s[0], s[1], s[2], one, s[3], s[4], s[5], one};
    return map_about(ir, span, m, NULL);
}
