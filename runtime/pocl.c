#include "runtime/pocl.h"

#include <errno.h>
#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#define PATH_LIMIT POCL_PATH_SIZE
#define ROOM       (8u << 20) // bytes that compiling a kernel may want: a large one takes 3 MB
#define NAME       "/tempfile_"
#define NAME_SIZE  (sizeof NAME - 1 + 6 + 3) // six characters that differ, and ".cl"

bool pocl_cache_folder(char path[static POCL_PATH_SIZE])
{
    size_t size = POCL_PATH_SIZE;
    const char *own = getenv("POCL_CACHE_DIR"), *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    int length = -1;
    if (own && *own)
        length = snprintf(path, size, "%s", own);
    else if (cache && *cache)
        length = snprintf(path, size, "%s/pocl/kcache", cache);
    else if (home && *home)
        length = snprintf(path, size, "%s/.cache/pocl/kcache", home);
    return length > 0 && (size_t)length < size;
}

// The folder, or the nearest one above that is there.
static bool nearest_folder(const char *folder, char path[static PATH_LIMIT])
{
    snprintf(path, PATH_LIMIT, "%s", folder);
    while (access(path, F_OK)) {
        char *slash = strrchr(path, '/');
        if (!slash || slash == path) return false;
        *slash = 0;
    }
    return true;
}

// Whether a folder can be written, or made.
static bool can_write(const char *folder)
{
    char path[PATH_LIMIT];
    return nearest_folder(folder, path) && !access(path, W_OK | X_OK);
}

// A disk that does not tell how large it is has room.
static bool has_room(const char *folder)
{
    char path[PATH_LIMIT];
    struct statvfs disk;
    if (!nearest_folder(folder, path) || statvfs(path, &disk) || !disk.f_blocks) return true;
    return (uint64_t)disk.f_bavail * disk.f_frsize >= ROOM;
}

bool pocl_cache_full(void)
{
    char path[PATH_LIMIT];
    return pocl_cache_folder(path) && !has_room(path);
}

void pocl_ensure_cache(void)
{
    char path[PATH_LIMIT], own[64];
    if (!pocl_cache_folder(path) || (can_write(path) && has_room(path)) || !has_room("/tmp")) return;
    snprintf(own, sizeof own, "/tmp/scn-pocl-%ld", (long)geteuid());
    // What is there must be the user's: others could put code into it.
    struct stat status;
    if (mkdir(own, 0700) && errno != EEXIST) return;
    if (lstat(own, &status) || !S_ISDIR(status.st_mode) || status.st_uid != geteuid() || status.st_mode & 022) return;
    setenv("POCL_CACHE_DIR", own, 1);
}

static bool get_bit(const uint8_t *bytes, size_t bit)
{
    return bytes[bit / 8] >> bit % 8 & 1;
}

static void set_bit(uint8_t *bytes, size_t bit, bool value)
{
    uint8_t mask = (uint8_t)(1u << bit % 8);
    bytes[bit / 8] = value ? bytes[bit / 8] | mask : bytes[bit / 8] & (uint8_t)~mask;
}

// Whether characters of seven bits from `bit` on are the text; then `other` is put there.
static bool replace_at(uint8_t *bytes, size_t bit, const char *text, const char *other, size_t length)
{
    for (size_t i = 0; i < 7 * length; i++)
        if (get_bit(bytes, bit + i) != (text[i / 7] >> i % 7 & 1)) return false;
    for (size_t i = 0; i < 7 * length; i++) set_bit(bytes, bit + i, other[i / 7] >> i % 7 & 1);
    return true;
}

// Replaces the text where its characters have seven bits each and begin at any bit. Its bytes from the second on are
// looked for first, for each of the eight places that its first bit can have in a byte.
static void replace_packed(uint8_t *bytes, size_t size, const char *text, const char *other, size_t length)
{
    for (size_t shift = 0; shift < 8; shift++) {
        uint8_t packed[PATH_LIMIT] = {0};
        for (size_t i = 0; i < 7 * length; i++) set_bit(packed, shift + i, text[i / 7] >> i % 7 & 1);
        const uint8_t *inner = packed + 1;
        size_t inner_size = (shift + 7 * length) / 8 - 1;
        for (uint8_t *at = bytes + 1; (at = memmem(at, (size_t)(bytes + size - at), inner, inner_size)); at++) {
            size_t bit = 8 * (size_t)(at - 1 - bytes) + shift;
            if (bit + 7 * length <= 8 * size) replace_at(bytes, bit, text, other, length);
        }
    }
}

void pocl_clean_binary(uint8_t *bytes, size_t size)
{
    char text[PATH_LIMIT], other[PATH_LIMIT];
    if (!pocl_cache_folder(text) || strlen(text) >= sizeof text - NAME_SIZE) return;
    strcat(text, NAME);
    size_t begin = strlen(text), length = begin + 6 + 3;
    uint8_t *found = memmem(bytes, size, text, begin);
    if (!found || length > (size_t)(bytes + size - found)) return;
    memcpy(text, found, length);
    memset(other, 's', length);
    replace_packed(bytes, size, text, other, length);
    for (uint8_t *at = bytes; (at = memmem(at, (size_t)(bytes + size - at), text, length));) memcpy(at, other, length);
}

bool pocl_private_cache(char folder[static POCL_FOLDER_SIZE])
{
    strcpy(folder, "/tmp/scn-XXXXXX");
    return mkdtemp(folder) && !setenv("POCL_CACHE_DIR", folder, 1);
}

static int remove_one(const char *path, const struct stat *status, int kind, struct FTW *place)
{
    remove(path);
    return 0;
}

void pocl_remove_cache(const char *folder)
{
    nftw(folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
}
