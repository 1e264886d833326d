// OpenCL C for a scene: the kernels written by hand (kernels/) joined with code made for the structure of the plan.
//
// What is emitted: for each shape two functions, which find where a ray next enters and next leaves a component of that shape; for each group type two
// that choose among the components of a tile's list; which features the scene has. Nothing else: numbers stay in tables, so scenes that
// differ in coefficients, counts, cameras, lights or materials have the same text, byte for byte, and share a kernel.
//
//     size_t length;
//     const char *source = emit_kernel(&arena, plan, &length);
//     program_build(device, &(ProgramDesc){.source = source, .length = length, .options = emit_options(device->width)}, &failure);
#ifndef SCN_COMPILER_EMIT_H
#define SCN_COMPILER_EMIT_H

#include <stddef.h>

#include "compiler/plan.h"
#include "lang/arena.h"

// The whole source, zero-terminated, in the arena. Never NULL. It holds one kernel, EMIT_KERNEL.
const char *emit_kernel(Arena *arena, const Plan *plan, size_t *length);
#define EMIT_KERNEL "render"

// Options for the OpenCL compiler: rays in a packet, 1 or 16.
const char *emit_options(int width);

#endif
