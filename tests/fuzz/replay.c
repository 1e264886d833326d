// Runs a fuzz harness without a fuzzer, so that every build and every compiler does: on the files as they are, then on ROUNDS changed copies of them.
//
//     replay ROUNDS FILE…
//
// The changes come from a seeded generator, the same on every machine: bits and bytes changed, pieces taken out, doubled, or put in from another file. A finding is
// a crash or a round that takes longer than 20 seconds; its input is written to ./finding then.
#include <fcntl.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length);

enum { MAX_LENGTH = 1 << 20 };

typedef struct Seed {
    uint8_t *bytes;
    size_t length;
} Seed;

static Seed running; // for the handler alone

static void keep_input(int number)
{
    static const char text[] = "the input is in ./finding\n";
    int file = open("finding", O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (file < 0 || write(file, running.bytes, running.length) < 0 || write(2, text, sizeof text - 1) < 0) _exit(1);
    signal(number, SIG_DFL);
    raise(number);
}

static void try(const uint8_t *bytes, size_t length)
{
    uint8_t *exact = malloc(length + !length); // so that a sanitizer sees where it ends
    if (!exact) abort();
    memcpy(exact, bytes, length);
    running = (Seed){exact, length};
    alarm(20); // it takes milliseconds
    LLVMFuzzerTestOneInput(exact, length);
    free(exact);
}

static uint64_t next(uint64_t *state) // splitmix64
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static size_t below(uint64_t *state, size_t count)
{
    return count ? (size_t)(next(state) % count) : 0;
}

static Seed read_seed(const char *path)
{
    Seed seed = {malloc(MAX_LENGTH), 0};
    FILE *file = fopen(path, "rb");
    if (!file || !seed.bytes) {
        perror(path);
        exit(3);
    }
    seed.length = fread(seed.bytes, 1, MAX_LENGTH, file);
    fclose(file);
    return seed;
}

// Puts `count` bytes of `from` in at `at`, as far as there is room.
static size_t insert(uint8_t *bytes, size_t length, size_t at, const uint8_t *from, size_t count)
{
    if (count > MAX_LENGTH - length) count = MAX_LENGTH - length;
    memmove(bytes + at + count, bytes + at, length - at);
    memcpy(bytes + at, from, count);
    return length + count;
}

static size_t change(uint64_t *state, uint8_t *bytes, size_t length, const Seed *other)
{
    static const uint8_t marks[] = "(){}[];:,.\"\\/*-+<>=#0 1e9\n\xff\x00";
    uint8_t piece[256];
    size_t at = below(state, length), count = 1 + below(state, 64);
    if (count > length - at) count = length - at;
    switch (below(state, 6)) {
    case 0:
        if (length) bytes[at] ^= (uint8_t)(1 << below(state, 8));
        return length;
    case 1:
        if (length) bytes[at] = marks[below(state, sizeof marks)];
        return length;
    case 2: memmove(bytes + at, bytes + at + count, length - at - count); return length - count;
    case 3: memcpy(piece, bytes + at, count); return insert(bytes, length, below(state, length + 1), piece, count);
    case 4: {
        size_t from = below(state, other->length);
        count = 1 + below(state, sizeof piece);
        if (count > other->length - from) count = other->length - from;
        return insert(bytes, length, at, other->bytes + from, count);
    }
    default: return below(state, 8) ? length : below(state, length + 1); // cut off
    }
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        fprintf(stderr, "usage: replay ROUNDS FILE ...\n");
        return 2;
    }
    int rounds = atoi(argv[1]);
    size_t count = (size_t)argc - 2;
    Seed *seeds = calloc(count, sizeof *seeds);
    uint8_t *bytes = malloc(MAX_LENGTH);
    if (!seeds || !bytes) abort();
    signal(SIGABRT, keep_input), signal(SIGSEGV, keep_input), signal(SIGFPE, keep_input), signal(SIGALRM, keep_input);
    for (size_t k = 0; k < count; k++) {
        seeds[k] = read_seed(argv[2 + k]);
        try(seeds[k].bytes, seeds[k].length);
    }
    for (int k = 0; k < rounds; k++) {
        uint64_t state = (uint64_t)k;
        const Seed *seed = &seeds[below(&state, count)];
        size_t length = seed->length;
        memcpy(bytes, seed->bytes, length);
        for (size_t n = 1 + below(&state, 6); n; n--)
            length = change(&state, bytes, length, &seeds[below(&state, count)]);
        try(bytes, length);
    }
    alarm(0);
    printf("%zu files, %d rounds\n", count, rounds);
    for (size_t k = 0; k < count; k++) free(seeds[k].bytes);
    free(seeds);
    free(bytes);
    return 0;
}
