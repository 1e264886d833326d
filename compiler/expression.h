// Expressions: scalars of point rate, as nodes of the IR.
//
// An expression is F of a general field. Warps, maps and perturbations of a general field are expressions again: other
// coordinates put into it, something added to it. So there is one kind of general field, whatever the scene does to it.
//
// Everything is in the IR's arena; nodes that are equal are one, so what is built twice is there once.
#ifndef SCN_COMPILER_EXPRESSION_H
#define SCN_COMPILER_EXPRESSION_H

#include "compiler/ir.h"

// The first operation of the expression at point rate that is nothing for fields; OP_NONE if there is none.
IrOp expression_unknown(const Ir *ir, IrId expression);

// Whether the operation is somewhere in it, at point rate.
bool expression_has(const Ir *ir, IrId expression, IrOp op);

// The expression with other expressions for x, y and z.
IrId expression_substitute(Ir *ir, IrId expression, const IrId coordinates[3]);

// Where the inverse of a map (an IR_MATRIX of frame rate at most) takes the point: three expressions.
void expression_inverse_point(Ir *ir, Span span, IrId matrix, IrId coordinates[3]);

// The expression of a base (compiler/leaf.h) in the coordinates outside of its map.
IrId expression_of_base(Ir *ir, IrId base);

// operands[0] is the base of a general field, the others are perturbations whose functions are bases of quadrics: F and
// the sum of all s max(Q + c, 0)³, as a FIELD. With one operand it is the base as it is.
IrId expression_perturbed(Ir *ir, const IrId *operands, uint32_t count);

// The greater (OP_MAX) or the lesser (OP_MIN) of two. What is added to both is added to it once, which is the same number in
// floats too, since rounding is monotone: so the parts of a blend are again what the blend was made as, and are one node with it.
IrId expression_decided(Ir *ir, IrOp op, Span span, IrId a, IrId b);

// (1 - t) a + t b; where t is 0 or 1 it is a or b, also where the other is undefined.
IrId expression_mixed(Ir *ir, Span span, IrId a, IrId b, IrId t);

// What of point rate the expression is made of: flags by id up to the expression, in the scratch arena.
bool *expression_reached(const Ir *ir, IrId expression, Arena *scratch);

#endif
