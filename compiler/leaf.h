// Making quadrics, free forms and general fields from others, for the passes. A *base* is QUADRIC, FIELD or
// TRANSFORM(one of these, matrix); a *core* is a base or FREEFORM(base of a quadric, perturbations).
#ifndef SCN_COMPILER_LEAF_H
#define SCN_COMPILER_LEAF_H

#include "compiler/ir.h"

bool leaf_is_base(const Ir *ir, IrId id);
bool leaf_is_core(const Ir *ir, IrId id);

// A patch as a surface, SHEET or TRANSFORM(SHEET, matrix): a leaf that no perturbation changes and whose complement is all
// of space.
bool leaf_is_sheet(const Ir *ir, IrId id);

// A patch of a thickness, THICKEN or TRANSFORM(THICKEN, matrix): a leaf that no perturbation changes.
bool leaf_is_thick(const Ir *ir, IrId id);
bool leaf_is_patch(const Ir *ir, IrId id); // one of the two

// The ten coefficients of a QUADRIC if all are const.
bool leaf_const_quadric(const Ir *ir, IrId quadric, double q[10]);
IrId leaf_quadric(Ir *ir, Span span, const double q[10]);

// The QUADRIC or FIELD of a base, and its map (0: none).
IrId leaf_function(const Ir *ir, IrId base, IrId *matrix);

IrId leaf_negate_base(Ir *ir, IrId base);
IrId leaf_grow_base(Ir *ir, IrId base, IrId grow); // F + grow
IrId leaf_negate_perturbation(Ir *ir, IrId perturbation);
// Perturbation k of the COPY of a cluster as one in the coordinates outside.
uint32_t leaf_copy_count(const Ir *ir, IrId copy);
IrId leaf_copy_part(Ir *ir, IrId copy, uint32_t k);

IrId leaf_negate(Ir *ir, IrId leaf); // a core or a thick patch

// COMPLEMENT(SHOW(COMPLEMENT(core), condition)): the core where the condition holds, else all of space.
IrId leaf_mark_all(Ir *ir, IrId core, IrId condition);

// What nobody painted: the parts of `material()`, as OP_MATERIAL has them.
enum { LEAF_MATERIAL_PARTS = 11 };
extern const double leaf_default_material[LEAF_MATERIAL_PARTS];

// The leaf with its paint, the condition under which it is there and its NAMED node's name; each may be 0.
IrId leaf_marked(Ir *ir, Span span, IrId leaf, IrId paint, IrId shown, IrId named);

// The core, or the thick patch, where the condition holds, else F = 1 everywhere: all of space.
IrId leaf_unless_all(Ir *ir, IrId leaf, IrId condition);

#endif
