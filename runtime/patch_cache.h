// Checkpoints of patches on disk, so that a frame far into an animation need not be solved for from the start.
//
// A file holds one patch after a number of its steps, named by a hash of its program, its params and this version of scn;
// so whatever changes the patch asks for other files. It appears whole or not at all. One that is cut or changed is not
// used, and the patch is solved from an earlier one, to the same bits. All of them may be deleted at any time: whenever one is
// stored, the oldest are, until they take no more than PATCH_CACHE_BYTES together.
//
//     PatchCache *cache = patch_cache_new(patch, inputs, count);       NULL: there is no folder for caches
//     patch_cache_store(cache, steps, bytes, size);
//     while (patch_cache_load(cache, &steps, &file) …) …not good: patch_cache_damaged(cache)…
#ifndef SCN_RUNTIME_PATCH_CACHE_H
#define SCN_RUNTIME_PATCH_CACHE_H

#include <stdint.h>

#include "compiler/plan.h"
#include "runtime/file.h"

// A checkpoint is kept after every so many steps.
#define PATCH_CACHE_STEPS 256

#define PATCH_CACHE_BYTES ((uint64_t)1 << 28) // of all checkpoints on disk

typedef struct PatchCache PatchCache;

// The program of the patch is hashed with the inputs (the plan's handles), and with what solves it: `solver` is a text that is another where the bits may be.
PatchCache *patch_cache_new(const PlanPatch *patch, const double *inputs, const char *solver);
void patch_cache_free(PatchCache *cache); // NULL is nothing

// Deletes the oldest checkpoints of a folder until the others take at most so many bytes.
void patch_cache_prune(const char *folder, uint64_t most);

// Where it cannot be written nothing is lost, and nobody is told.
void patch_cache_store(const PatchCache *cache, uint64_t steps, const void *bytes, size_t size);

// The checkpoint of the most steps that are at most `most` and more than `least`. False if there is none; the caller closes
// the file.
bool patch_cache_load(const PatchCache *cache, uint64_t least, uint64_t most, uint64_t *steps, FileBytes *file);

#endif
