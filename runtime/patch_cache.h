// Checkpoints of patches on disk, so that a frame far into an animation need not be solved for from the start.
//
// A file holds one patch after a number of its steps, named by a hash of its program, its params, what solves it and this
// version of scn; so whatever changes the patch asks for other files. It appears whole or not at all. One that is cut or
// changed is not used, and the patch is solved from an earlier one, to the same bits. All of them may be deleted at any
// time. They are in the folder of the cache, where patch_cache_prune() deletes the oldest, or in one that somebody chose,
// where all stay: it can be copied to other machines, which use what a device like theirs has written.
//
//     PatchCache *cache = patch_cache_new(patch, inputs, solver, NULL);       NULL: there is no folder for caches
//     patch_cache_store(cache, steps, bytes, size);
//     while (patch_cache_load(cache, least, most, &steps, &file)) …not good: patch_cache_drop(cache, steps)…
#ifndef SCN_RUNTIME_PATCH_CACHE_H
#define SCN_RUNTIME_PATCH_CACHE_H

#include <stdint.h>

#include "compiler/plan.h"
#include "runtime/file.h"

// A checkpoint is kept after every so many steps.
#define PATCH_CACHE_STEPS 256

#define PATCH_CACHE_BYTES ((uint64_t)1 << 28) // of all checkpoints on disk

typedef struct PatchCache PatchCache;

// `folder` NULL: that of the cache. The program of the patch is hashed with the inputs (the plan's handles), and with what solves it: `solver` is a text that is another where the bits may be.
PatchCache *patch_cache_new(const PlanPatch *patch, const double *inputs, const char *solver, const char *folder);
void patch_cache_free(PatchCache *cache); // NULL is nothing

// Of which file those of a number of steps are. False where the name is too long.
bool patch_cache_path(const PatchCache *cache, uint64_t steps, char path[static FILE_PATH_SIZE]);

// Deletes one that is damaged, so that a good one takes its place when the patch passes there again.
void patch_cache_drop(const PatchCache *cache, uint64_t steps);

// Deletes the oldest checkpoints of the cache until the others take at most PATCH_CACHE_BYTES, if there may be more.
void patch_cache_tidy(const PatchCache *cache);

// Deletes the oldest checkpoints of a folder until the others take at most so many bytes.
void patch_cache_prune(const char *folder, uint64_t most);

// Where it cannot be written nothing is lost, and nobody is told.
void patch_cache_store(const PatchCache *cache, uint64_t steps, const void *bytes, size_t size);

// The checkpoint of the most steps that are at most `most` and more than `least`. False if there is none; the caller closes
// the file.
bool patch_cache_load(const PatchCache *cache, uint64_t least, uint64_t most, uint64_t *steps, FileBytes *file);

#endif
