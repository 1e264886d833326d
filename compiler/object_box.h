// A box that certainly holds an object of the IR, before there is a plan (compiler/bounds.h is for plans).
#ifndef SCN_COMPILER_OBJECT_BOX_H
#define SCN_COMPILER_OBJECT_BOX_H

#include "compiler/ir.h"

// The object has its maps and perturbations at the leaves (object_leaves() of compiler/object.h). Quadrics, free forms and
// fields of numbers are bounded as those of a plan are, and what moves is without an end. Sides without an end are
// infinite; low > high: it is empty.
void object_box(const Ir *ir, IrId leaves, double low[3], double high[3]);

#endif
