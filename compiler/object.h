// Objects as expressions, for the operations that no exact class is closed under: warps, blends, offsets along the normal.
//
// An object of any kind is max, min and minus of its leaves, and the expression of a leaf may be changed: other
// coordinates put into it, something added to it. The sets, names, paint and conditions around the leaves stay, so what
// was red is red where it went. Leaves become general fields (compiler/expression.h) in doing so.
//
//     IrId coordinates[3] = …;                                    // expressions at point rate
//     IrId leaves = object_leaves(ir, object);
//     IrId warped = object_warped(ir, leaves, coordinates);       // F(coordinates(X))
//     IrId grown = object_plus(ir, leaves, object_expression(ir, other));   // F(X) + G(X)
//
// Each function walks over what the object reaches once, whatever it shares. They return 0 where the object has too many
// parts (WALK_MAX).
#ifndef SCN_COMPILER_OBJECT_H
#define SCN_COMPILER_OBJECT_H

#include "compiler/ir.h"

// F where there is nothing, in expressions: they have no infinite numbers, and its square is still a float. Where all is
// inside, it is minus that.
#define OBJECT_NOWHERE (-1e15)

// The object with its maps and perturbations at the leaves. The others want this form.
IrId object_leaves(Ir *ir, IrId object);

// F of a core (compiler/leaf.h).
IrId object_core_expression(Ir *ir, IrId core);

// F of the whole object.
IrId object_expression(Ir *ir, IrId leaves);

// The object with other expressions for the leaves. `negative`: minus the leaf counts, so what is done is the opposite.
// Intersections of leaves without paint, names and conditions become one leaf.
typedef IrId ObjectChange(void *context, Ir *ir, IrId expression, bool negative);
IrId object_changed(Ir *ir, IrId leaves, ObjectChange *change, void *context);

// The object whose F at X is F at the three coordinates.
IrId object_warped(Ir *ir, IrId leaves, const IrId coordinates[3]);

// The object whose F is F + addend, in any part of it.
IrId object_plus(Ir *ir, IrId leaves, IrId addend);

// Whether paint or a name is on a part of it; whether a part of it may be nowhere.
bool object_has_marks(const Ir *ir, IrId leaves);
bool object_may_hide(const Ir *ir, IrId leaves);

// Whether a sheet is a part of it, or a patch displaces one: of these there are no expressions. Any object.
bool object_is_patched(const Ir *ir, IrId object);

// Whether a thick patch is a part of it, to which nothing can be added. Any object.
bool object_has_thick(const Ir *ir, IrId object);

// The derivatives of an expression by x, y and z, as expressions. At a crease they are those of the operand that decides,
// the first where both do; where |a| and sqrt(a) have none they are 0.
void expression_gradient(Ir *ir, IrId expression, IrId gradient[3]);

#endif
