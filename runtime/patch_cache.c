#include "runtime/patch_cache.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "runtime/plan_tables.h"
#include "runtime/program.h"
#include "runtime/record.h"

struct PatchCache {
    char folder[FILE_PATH_SIZE];
    bool chosen; // the folder: nothing in it is deleted
    char key[33];
};

PatchCache *patch_cache_new(const PlanPatch *patch, const double *inputs, const char *solver, const char *folder)
{
    PatchCache *cache = calloc(1, sizeof *cache);
    if (!cache) return NULL;
    Record record = {.writing = true};
    plan_patch_record(&record, (PlanPatch *)(uintptr_t)patch);
    record_f64s(&record, (double *)(uintptr_t)inputs, patch->program->input_count);
    const char *version = SCN_VERSION;
    record_text(&record, &version);
    record_text(&record, &solver);
    cache->chosen = folder != NULL;
    bool ok = !record.bad && (folder ? snprintf(cache->folder, sizeof cache->folder, "%s", folder) < FILE_PATH_SIZE
                                     : program_cache_folder(cache->folder, sizeof cache->folder));
    if (ok) {
        XXH128_canonical_t canonical;
        XXH128_canonicalFromHash(&canonical, XXH3_128bits(record.bytes, record.size));
        for (int k = 0; k < 16; k++) sprintf(cache->key + 2 * k, "%02x", canonical.digest[k]);
    }
    record_release(&record);
    if (ok) return cache;
    patch_cache_free(cache);
    return NULL;
}

void patch_cache_free(PatchCache *cache)
{
    free(cache);
}

bool patch_cache_path(const PatchCache *cache, uint64_t steps, char path[static FILE_PATH_SIZE])
{
    int length =
        snprintf(path, FILE_PATH_SIZE, "%s/patch-%s-%llu", cache->folder, cache->key, (unsigned long long)steps);
    return length > 0 && length < FILE_PATH_SIZE;
}

typedef struct Entry {
    struct timespec time;
    uint64_t size;
    char name[64];
} Entry;

static int by_age(const void *a, const void *b)
{
    const Entry *x = a, *y = b;
    if (x->time.tv_sec != y->time.tv_sec) return x->time.tv_sec < y->time.tv_sec ? -1 : 1;
    if (x->time.tv_nsec != y->time.tv_nsec) return x->time.tv_nsec < y->time.tv_nsec ? -1 : 1;
    return strcmp(x->name, y->name);
}

void patch_cache_prune(const char *folder, uint64_t most)
{
    DIR *dir = opendir(folder);
    Entry *entries = NULL;
    size_t count = 0, capacity = 0;
    uint64_t total = 0;
    for (struct dirent *one; dir && (one = readdir(dir));) {
        struct stat status;
        if (strncmp(one->d_name, "patch-", 6) || strlen(one->d_name) >= sizeof entries->name) continue;
        if (fstatat(dirfd(dir), one->d_name, &status, AT_SYMLINK_NOFOLLOW) || !S_ISREG(status.st_mode)) continue;
        if (count == capacity) {
            Entry *more = realloc(entries, (capacity = 2 * capacity + 16) * sizeof *entries);
            if (!more) break;
            entries = more;
        }
        entries[count] = (Entry){.time = status.st_mtim, .size = (uint64_t)status.st_size};
        strcpy(entries[count++].name, one->d_name);
        total += (uint64_t)status.st_size;
    }
    if (count && total > most) qsort(entries, count, sizeof *entries, by_age);
    for (size_t k = 0; k < count && total > most; k++)
        if (!unlinkat(dirfd(dir), entries[k].name, 0)) total -= entries[k].size;
    free(entries);
    if (dir) closedir(dir);
}

void patch_cache_store(const PatchCache *cache, uint64_t steps, const void *bytes, size_t size)
{
    char path[FILE_PATH_SIZE];
    WholeFile file;
    if (!patch_cache_path(cache, steps, path) || !access(path, F_OK) || !make_folders(cache->folder)) return;
    if (!whole_open(&file, path, NULL, NULL)) return;
    if (whole_write(&file, bytes, size, NULL))
        whole_finish(&file, NULL);
    else
        whole_drop(&file);
}

void patch_cache_drop(const PatchCache *cache, uint64_t steps)
{
    char path[FILE_PATH_SIZE];
    if (patch_cache_path(cache, steps, path)) unlink(path);
}

void patch_cache_tidy(const PatchCache *cache)
{
    if (!cache->chosen) patch_cache_prune(cache->folder, PATCH_CACHE_BYTES);
}

bool patch_cache_load(const PatchCache *cache, uint64_t least, uint64_t most, uint64_t *steps, FileBytes *file)
{
    char path[FILE_PATH_SIZE];
    for (uint64_t k = most / PATCH_CACHE_STEPS * PATCH_CACHE_STEPS; k > least && k > 0; k -= PATCH_CACHE_STEPS) {
        if (!patch_cache_path(cache, k, path)) return false;
        if (access(path, R_OK) || !bytes_open(file, path, NULL)) continue;
        *steps = k;
        return true;
    }
    return false;
}
