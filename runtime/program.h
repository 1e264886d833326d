// OpenCL programs: from source or from a binary, through the cache on disk.
//
//     Program *program = program_build(device, &(ProgramDesc){.source = text, .length = n, .options = options}, &failure);
//     cl_kernel kernel = clCreateKernel(program->cl, "primary", &status);
//
// The cache is a folder of files named by the hash of source, options and device; an entry that is damaged is built
// again and replaced. Nothing in it is needed, it can be deleted at any time. program_build() looks there first.
// program_store() puts a binary there, when the caller has the time: making one is free where the driver has it at
// hand, but PoCL compiles everything again for it (twice 0.3 s for a middle-sized scene), which a single picture
// should not wait for; PoCL's own cache makes that second picture start 40 ms later than ours would. So `scn build`
// and long renderings store.
//
// Behind the cache stands the stock: a folder of the same files that was filled when scn was built (runtime/stock), for
// the structures that most scenes have: unions of quadrics, of free forms, of both. A picture of one of them waits for
// no compiler: from source to 512 x 512 on disk with empty caches S1 takes 0.07 s of CPU time instead of 1.3 s. The key says for which
// device, driver and compiler an entry is, so on another machine it is found to be missing, and compiled.
//
// A binary holds the work-group functions for local size 1, which is the one that is used on CPUs: with it, on PoCL
// neither building nor the first enqueue compiles anything (runtime/device.c).
#ifndef SCN_RUNTIME_PROGRAM_H
#define SCN_RUNTIME_PROGRAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "runtime/device.h"

typedef struct ProgramDesc {
    const char *source; // whole OpenCL C source
    size_t length;
    const char *options; // of the OpenCL compiler; NULL: none
    const void *binary;  // tried first where there is one, made for this device (device_key); NULL: none
    size_t binary_size;
    bool no_cache;   // neither reads nor writes the cache
    bool ready_only; // no compiler: NULL, and `failure` as it was, where there is neither a binary nor an entry
} ProgramDesc;

typedef struct Program {
    Device *device; // borrowed
    cl_program cl;
    int builds;       // compiler runs: 1 if it came from source, 0 from a binary
    double build_ms;  // wall time of making it, whichever way
    bool from_cache;  // the binary came from the cache on disk
    bool from_binary; // … from the description
    uint8_t key[16];  // in the cache
    bool no_cache;
} Program;

// NULL with `failure` set. A compiler error is an error of scn itself: the text names the file that the log and the
// source were saved to.
Program *program_build(Device *device, const ProgramDesc *desc, Failure *failure);
void program_free(Program *program); // NULL is nothing

// The binary for the device of the program, to be put into a package; the caller frees it. NULL with `failure` set.
void *program_binary(const Program *program, size_t *size, Failure *failure);

// Puts the binary into the cache, where it is not there yet. NULL for `failure` where nobody is to be told.
bool program_store(const Program *program, Failure *failure);

// The folder of the cache: $XDG_CACHE_HOME/scn or ~/.cache/scn. False where there is no home.
bool program_cache_folder(char *path, size_t size);

#endif
