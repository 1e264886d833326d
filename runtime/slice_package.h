// Slices in packages: the binary of a formula that was compiled (compiler/formula_emit.h), beside those of the scene's kernels.
//
// Its key is "slice ", a hash of the formula's program, and the key of the device. Whoever draws a slice of the package makes the formula
// from the plan, and where there is a binary of the same formula it draws what the program would have drawn, sooner; for another
// plane, or other params, there is none.
#ifndef SCN_RUNTIME_SLICE_PACKAGE_H
#define SCN_RUNTIME_SLICE_PACKAGE_H

#include "runtime/package.h"
#include "runtime/slice.h"

#define SLICE_KEY_SIZE (DEVICE_KEY_SIZE + 64)

void slice_package_key(const FormulaSteps *steps, const Device *device, char key[static SLICE_KEY_SIZE]);

// Whether a binary is one of these.
bool slice_package_is(const PackageBinary *binary);

// Compiles the code and adds its binary, in the arena. False with `failure` set.
bool slice_package_add(Package *package, Arena *arena, Device *device, const FormulaSteps *steps,
                       const FormulaCode *code, bool no_cache, Failure *failure);

// A slicer of the binary that is for this formula and device, or NULL.
Slicer *slice_package_slicer(const Package *package, Device *device, const FormulaSteps *steps,
                             const FormulaCode *code);

#endif
