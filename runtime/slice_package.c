#include "runtime/slice_package.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#define PREFIX "slice "

void slice_package_key(const FormulaSteps *steps, const Device *device, char key[static SLICE_KEY_SIZE])
{
    char name[DEVICE_KEY_SIZE];
    XXH128_canonical_t hash;
    size_t count = (size_t)steps->numbers + steps->compares + steps->logics;
    XXH128_canonicalFromHash(&hash, XXH3_128bits(steps->steps, count * sizeof *steps->steps));
    device_key(device, name);
    int length = snprintf(key, SLICE_KEY_SIZE, PREFIX);
    for (int k = 0; k < 16; k++) length += snprintf(key + length, 3, "%02x", hash.digest[k]);
    snprintf(key + length, SLICE_KEY_SIZE - (size_t)length, " %s", name);
}

bool slice_package_is(const PackageBinary *binary)
{
    return !strncmp(binary->key, PREFIX, strlen(PREFIX));
}

bool slice_package_add(Package *package, Arena *arena, Device *device, const FormulaSteps *steps,
                       const FormulaCode *code, bool no_cache, Failure *failure)
{
    Slicer *slicer = slicer_new(device, &(SlicerDesc){.code = code, .no_cache = no_cache}, failure);
    if (!slicer) return false;
    size_t size;
    void *bytes = program_binary(slicer_built(slicer), &size, failure);
    slicer_free(slicer);
    if (!bytes) return false;
    char *key = arena_array(arena, char, SLICE_KEY_SIZE);
    slice_package_key(steps, device, key);
    PackageBinary *binaries = arena_array(arena, PackageBinary, package->binary_count + 1);
    if (package->binary_count) memcpy(binaries, package->binaries, package->binary_count * sizeof *binaries);
    uint8_t *copy = arena_array(arena, uint8_t, size);
    memcpy(copy, bytes, size);
    free(bytes);
    binaries[package->binary_count] = (PackageBinary){.key = key, .bytes = copy, .size = size};
    package->binaries = binaries;
    package->binary_count++;
    return true;
}

Slicer *slice_package_slicer(const Package *package, Device *device, const FormulaSteps *steps, const FormulaCode *code)
{
    char key[SLICE_KEY_SIZE];
    Failure failure;
    slice_package_key(steps, device, key);
    const PackageBinary *binary = package_binary(package, key);
    if (!binary) return NULL;
    return slicer_new(device, &(SlicerDesc){.code = code, .binary = binary->bytes, .binary_size = binary->size},
                      &failure);
}
