// What PoCL needs beyond OpenCL: a cache that it can write, and binaries that are the same bytes wherever and whenever
// they are made.
//
// PoCL compiles from a temporary file in its cache, FOLDER/tempfile_XXXXXX.cl, and LLVM keeps that path in the
// bitcode that is part of a binary: once as it is, once with seven bits a character. Nothing reads it there. It is
// overwritten with as many other characters, so what is left of the machine is the length of FOLDER, and `scn build`
// gives PoCL a folder of fixed length.
#ifndef SCN_RUNTIME_POCL_H
#define SCN_RUNTIME_POCL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The folder of PoCL's cache, as PoCL finds it; false where it has none or the path does not fit.
#define POCL_PATH_SIZE 1024
bool pocl_cache_folder(char path[static POCL_PATH_SIZE]);

// Before PoCL's first call. Where PoCL cannot make its cache it has no device at all, and where the disk is full it
// cannot compile; then it is given a folder of the user's own in /tmp, if there is room.
void pocl_ensure_cache(void);

// Whether the disk of PoCL's cache is so full that kernels cannot be compiled.
bool pocl_cache_full(void);

// Overwrites the path in a binary.
void pocl_clean_binary(uint8_t *bytes, size_t size);

// Makes an empty folder "/tmp/scn-XXXXXX" and makes it PoCL's cache, if PoCL has not been called yet in the process.
// False where it cannot be made. pocl_remove_cache() removes it with all that is in it, after the last use of PoCL.
#define POCL_FOLDER_SIZE 16
bool pocl_private_cache(char folder[static POCL_FOLDER_SIZE]);
void pocl_remove_cache(const char *folder);

#endif
