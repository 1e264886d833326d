// Packages: a compiled scene in one file (.scnk), which runs without its sources and without a compiler.
//
//   0   magic          89 'S' 'C' 'N' 'K' 0D 0A 1A
//   8   u32 version    of the format: PACKAGE_VERSION
//   12  u32 sections
//   16  u64 size       of the whole file
//   24  16 bytes       structure: equal where kernel source is equal
//   40  u64 checksum   XXH3-64 of bytes 0 … 40 and of the section table
//   48  the section table, 32 bytes each: u32 tag, u32 reserved (0), u64 offset, u64 size, u64 checksum (XXH3-64)
//       the sections, each at a multiple of 16, zeros between
//
//   tag   holds
//   INFO  version of scn, name of the scene
//   PLAN  the tables of compiler/plan.h (runtime/plan_tables.h)
//   MAPS  where the scene says what the plan's spans name: file, line, column
//   KERN  OpenCL C
//   BINA  a binary: the key of its device (device_key) or of a slice (runtime/slice_package.h), then the driver's bytes; any number of these
//
// Numbers are little-endian. Nothing in the file depends on the time, the machine or a folder, so the same scene
// gives the same bytes (a driver's binaries as far as the driver does so). A reader refuses a newer version, and
// knows all sections of its own.
//
// package_decode() trusts no byte: checksums find damage, and every index, count and nesting is checked, so that
// whatever it accepts can be evaluated and uploaded. The kernel and the binaries however are programs that the device
// runs: a package is to be trusted as any program is.
#ifndef SCN_RUNTIME_PACKAGE_H
#define SCN_RUNTIME_PACKAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "compiler/plan.h"
#include "lang/arena.h"
#include "lang/source.h"
#include "runtime/failure.h"
#include "runtime/file.h"

#define PACKAGE_VERSION 4

typedef struct PackageBinary {
    const char *key; // device_key()
    const uint8_t *bytes;
    size_t size;
} PackageBinary;

typedef struct PackagePlace {
    Span span;
    const char *path; // relative to the folder of the scene's main file, where it is below it
    uint32_t line, column;
} PackagePlace;

typedef struct Package {
    const char *version; // of the scn that made it
    const char *scene;   // file name of the scene, without its folder
    Plan *plan;
    const char *kernel; // OpenCL C, zero-terminated
    size_t kernel_length;
    uint8_t structure[16]; // of the kernel: package_hash_structure(), package_decode()
    PackagePlace *places;  // sorted by begin, then end; each span once
    uint32_t place_count;
    PackageBinary *binaries;
    uint32_t binary_count;
} Package;

// Whether these bytes begin as a package does.
bool package_is(const uint8_t *bytes, size_t size);

// Whether the file there begins as a package does; also where it is cut off within the first bytes, or one that was
// changed by a transfer as text: package_decode() says more then. What is no file but a pipe is none.
bool package_file(const char *path);

// Fills `structure` from the kernel.
void package_hash_structure(Package *package);

// The whole file in memory; the caller frees it. NULL with `failure` set where memory is missing.
uint8_t *package_encode(Package *package, size_t *size, Failure *failure);

// Reads a package. Everything is copied to the arena but the binaries, which point into `bytes`. NULL with the reason
// in `failure`.
Package *package_decode(Arena *arena, const uint8_t *bytes, size_t size, Failure *failure);

bool package_write(const char *path, Package *package, Unfinished *unfinished, Failure *failure);

// Collects the places that a frame's errors and `scn info` need.
void package_map_places(Package *package, Arena *arena, Sources *sources);

// The place of a span, or NULL.
const PackagePlace *package_place(const Package *package, Span span);

// The binary for a device, or NULL.
const PackageBinary *package_binary(const Package *package, const char *device_key);

#endif
