// The bytes of a checkpoint: what a solver needs to go on as if it had never stopped.
//
//     header  "scnpatch", version, kind of solver, nodes, number of patches, length of the rest, XXH3 of the rest
//     rest    whatever the solver puts, as it is in memory
//
// A checkpoint is for the same build on the same kind of machine: it is a cache of what can be computed again. Reading
// one that was cut, changed, or made by another solver or for another grid fails with a reason and changes nothing.
//
//     PatchWriter writer = {bytes, capacity, 0};
//     patch_write_header(&writer, kind, nodes, 1);
//     patch_write(&writer, x, n * sizeof *x);
//     size_t size = patch_write_end(&writer);
//
//     PatchReader reader;
//     if (!patch_read_header(&reader, bytes, size, kind, nodes, 1, failure)) …
//     patch_read(&reader, x, n * sizeof *x);
//
// A writer without bytes counts, so the size of a checkpoint is found by the same calls that write it.
#ifndef SCN_RUNTIME_PATCH_STATE_H
#define SCN_RUNTIME_PATCH_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "runtime/failure.h"

typedef enum PatchStateKind { PATCH_STATE_HOST = 1, PATCH_STATE_DEVICE = 2 } PatchStateKind;

// Room for what names a solver whose bits are the same: its code and what runs it. Checkpoints of equal keys are each other's.
#define PATCH_SOLVER_KEY 48

typedef struct PatchWriter {
    uint8_t *bytes; // NULL: counts only
    size_t capacity, length;
} PatchWriter;

void patch_write_header(PatchWriter *writer, PatchStateKind kind, int nodes, int count);
void patch_write(PatchWriter *writer, const void *from, size_t size);

// Completes the header and returns the number of bytes that the checkpoint needs; it is whole if that is at most the
// capacity.
size_t patch_write_end(PatchWriter *writer);

typedef struct PatchReader {
    const uint8_t *bytes;
    size_t left;
} PatchReader;

// Checks all that can be wrong with the bytes, so that only a rest of another length remains to be tested by the
// solver.
bool patch_read_header(PatchReader *reader, const void *bytes, size_t size, PatchStateKind kind, int nodes, int count,
                       Failure *failure);

// False where fewer bytes are left; `to` is then as before.
bool patch_read(PatchReader *reader, void *to, size_t size);

#endif
