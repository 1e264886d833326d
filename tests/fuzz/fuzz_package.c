// The loader of packages against any bytes: it reads or refuses, and what it accepts can be evaluated and written
// again.
//
// Random bytes hardly get past checksums, so these are made right first: the header's and each section's are computed
// anew, which lets changes reach the tables. Built with libFuzzer (-DSCN_FUZZ=ON), or with SCN_FUZZ_MAIN as a program
// that takes files, mutates them by a seeded generator and so needs no fuzzer: fuzz_package ROUNDS FILE….
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "compiler/frame.h"
#include "runtime/framing.h"
#include "runtime/package.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static uint64_t get(const uint8_t *bytes, int count)
{
    uint64_t value = 0;
    for (int i = count - 1; i >= 0; i--) value = value << 8 | bytes[i];
    return value;
}

static void put64(uint8_t *bytes, uint64_t value)
{
    for (int i = 0; i < 8; i++) bytes[i] = (uint8_t)(value >> 8 * i);
}

// Makes magic, size and checksums right, as far as the section table lies inside.
static void mend(uint8_t *bytes, size_t size)
{
    if (size < 48) return;
    memcpy(bytes, "\x89SCNK\r\n\x1a", 8);
    put64(bytes + 16, size);
    uint64_t count = get(bytes + 12, 4);
    if (count > 64 || 48 + count * 32 > size) return;
    for (uint64_t i = 0; i < count; i++) {
        uint8_t *entry = bytes + 48 + i * 32;
        uint64_t offset = get(entry + 8, 8), length = get(entry + 16, 8);
        if (offset <= size && length <= size - offset) put64(entry + 24, XXH3_64bits(bytes + offset, length));
    }
    XXH3_state_t *state = XXH3_createState();
    XXH3_64bits_reset(state);
    XXH3_64bits_update(state, bytes, 40);
    XXH3_64bits_update(state, bytes + 48, count * 32);
    put64(bytes + 40, XXH3_64bits_digest(state));
    XXH3_freeState(state);
}

// Whatever is accepted must be usable: the frame program runs, or says what is wrong, and its values can be folded into
// a view.
static void use(Package *package)
{
    const Plan *plan = package->plan;
    double *values = malloc((plan->slot_count + 1u) * sizeof *values);
    FrameError error;
    double camera[15];
    if (frame_evaluate(plan, &(FrameInput){.time = 0.5, .frame = 12}, values, &error)) {
        memcpy(camera, values + plan->camera, sizeof camera);
        framing_camera(plan, &values, NULL, 1, 64, 48, camera);
    }
    free(values);
    size_t size;
    free(package_encode(package, &size, NULL));
    for (uint32_t i = 0; i < plan->step_count; i++) package_place(package, plan->steps[i].span);
}

static int try(const uint8_t *bytes, size_t size)
{
    Arena arena = {0};
    Failure failure = {0};
    Package *package = package_decode(&arena, bytes, size, &failure);
    if (package)
        use(package);
    else if (!failure.text[0])
        abort(); // a refusal has a reason
    arena_release(&arena);
    return package != NULL;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    try(data, size);
    uint8_t *copy = malloc(size ? size : 1);
    memcpy(copy, data, size);
    mend(copy, size);
    try(copy, size);
    free(copy);
    return 0;
}

#ifdef SCN_FUZZ_MAIN
static uint64_t next_random(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

// Changes one to eight places: a bit, a byte, a small or a large number, a stretch copied from elsewhere.
static void mutate(uint8_t *bytes, size_t size, uint64_t *state)
{
    for (uint64_t n = 1 + next_random(state) % 8; n; n--) {
        // Tables lie in front of the kernel and the binaries, so most places are chosen there.
        size_t limit = next_random(state) % 4 ? (size < 4096 ? size : 4096) : size;
        size_t at = next_random(state) % limit;
        switch (next_random(state) % 5) {
        case 0: bytes[at] ^= (uint8_t)(1u << next_random(state) % 8); break;
        case 1: bytes[at] = (uint8_t)next_random(state); break;
        case 2: bytes[at] = (uint8_t)(next_random(state) % 4); break;
        case 3: bytes[at] = 255; break;
        case 4: {
            size_t from = next_random(state) % limit, length = 1 + next_random(state) % 16;
            if (at + length <= size && from + length <= size) memmove(bytes + at, bytes + from, length);
        }
        }
    }
}

int main(int argc, char **argv)
{
    long rounds = argc > 1 ? atol(argv[1]) : 0, accepted = 0, tried = 0;
    uint64_t state = 0x9e3779b97f4a7c15u;
    for (int i = 2; i < argc; i++) {
        FileBytes file;
        Failure failure;
        if (!bytes_open(&file, argv[i], &failure)) {
            fprintf(stderr, "%s\n", failure.text);
            return 3;
        }
        uint8_t *copy = malloc(file.size);
        for (long round = 0; round < rounds && file.size; round++) {
            size_t size = next_random(&state) % 16 ? file.size : 1 + next_random(&state) % file.size;
            memcpy(copy, file.bytes, size);
            if (round) mutate(copy, size, &state);
            mend(copy, size);
            accepted += try(copy, size);
            tried++;
        }
        free(copy);
        bytes_close(&file);
    }
    printf("%ld packages tried, %ld of them accepted\n", tried, accepted);
    return 0;
}
#endif
