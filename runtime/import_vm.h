// Expressions as text of one operation a line, as a scene: the format in which models of this kind are exchanged.
//
//     # a comment
//     _0 var-x
//     _1 const 0.5
//     _2 mul _0 _1
//     _3 max _2 _1
//
// Each line names a value and makes it of values above; the last one is the field, which is inside where it is
// negative. The scene is `let` after `let`, in the same order, and an object field(-last).
#ifndef SCN_RUNTIME_IMPORT_VM_H
#define SCN_RUNTIME_IMPORT_VM_H

#include <stdbool.h>
#include <stddef.h>

#include "lang/arena.h"
#include "runtime/failure.h"

// The scene's text, in the arena; NULL with `failure` (the line and what is wrong with it). Takes any bytes.
const char *import_vm(Arena *arena, const char *text, size_t length, size_t *result_length, Failure *failure);

#endif
