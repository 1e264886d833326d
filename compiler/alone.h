// One branch of a scene alone: what `--only NAME` shows.
//
// What is left are the objects of a name, each where it stands: under the maps, the perturbations and the paint above it.
// The set operations, morphs and conditions above it are gone, and all that stands beside it; so a thing is seen that is
// hidden, or that is only taken away from another. Within the branch everything stays as it is.
#ifndef SCN_COMPILER_ALONE_H
#define SCN_COMPILER_ALONE_H

#include "compiler/ir.h"

// The union of what `root` has under that name, in an IR as elaborated. EMPTY: nothing has it. 0: too many items.
IrId alone(Ir *ir, IrId root, const char *name);

// The names that `root` reaches, with room for others behind them, in the arena. Returns how many.
int alone_names(const Ir *ir, IrId root, uint32_t room, Arena *arena, const char ***names);

#endif
