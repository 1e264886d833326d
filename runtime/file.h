// Files that appear whole or not at all.
//
// A WholeFile is written under a temporary name in the folder of its path and gets its name when all of it is there.
// Whatever goes wrong in between, nothing is left.
//
//     WholeFile file;
//     if (!whole_open(&file, path, NULL, failure)) return false;
//     …write to file.fd, or whole_write()…
//     return whole_finish(&file, failure);     // or whole_drop(&file)
#ifndef SCN_RUNTIME_FILE_H
#define SCN_RUNTIME_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "runtime/failure.h"
#include "runtime/scn.h"

#define FILE_PATH_SIZE 4096

// The temporary file that is open, for a signal handler that ends the process: it unlinks `path` where `open` is not 0.
typedef ScnUnfinished Unfinished;

typedef struct WholeFile {
    int fd;
    char path[FILE_PATH_SIZE], temporary[FILE_PATH_SIZE];
    Unfinished *unfinished; // may be NULL
    uint64_t offset;        // bytes written by whole_write
} WholeFile;

// Paths to what is not a plain file (/dev/stdout, a pipe, a device) are written directly.
bool whole_open(WholeFile *file, const char *path, Unfinished *unfinished, Failure *failure);
bool whole_write(WholeFile *file, const void *bytes, size_t size, Failure *failure);
bool whole_finish(WholeFile *file, Failure *failure); // drops the file where it fails
void whole_drop(WholeFile *file);

// Writes all bytes at an offset, or where `offset` is negative at the end of what is written. False with errno set.
bool write_all(int fd, const void *bytes, size_t size, int64_t offset);

// Makes a folder and those above it, as far as they are missing. False with errno set.
bool make_folders(const char *path);

// A whole file in memory. It is read, not mapped: a file that somebody else shortens must not end the process.
typedef struct FileBytes {
    uint8_t *bytes; // owned; not NULL after success, also for an empty file
    size_t size;
} FileBytes;
bool bytes_open(FileBytes *file, const char *path, Failure *failure); // failure names the path
void bytes_close(FileBytes *file);

#endif
