#include "runtime/file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool write_all(int fd, const void *bytes, size_t size, int64_t offset)
{
    const char *at = bytes;
    while (size) {
        ssize_t n = offset < 0 ? write(fd, at, size) : pwrite(fd, at, size, offset);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return false;
        if (n == 0) {
            errno = ENOSPC;
            return false;
        }
        at += n;
        size -= (size_t)n;
        if (offset >= 0) offset += n;
    }
    return true;
}

// Makes the temporary name `folder/.name.pid-k.part` and opens it, for the first k that is free.
static int open_temporary(WholeFile *file)
{
    const char *slash = strrchr(file->path, '/');
    int folder = slash ? (int)(slash - file->path + 1) : 0;
    for (int k = 0; k < 100; k++) {
        int length = snprintf(file->temporary, sizeof file->temporary, "%.*s.%.200s.%ld-%d.part", folder, file->path,
                              file->path + folder, (long)getpid(), k);
        if (length >= (int)sizeof file->temporary) {
            errno = ENAMETOOLONG;
            return -1;
        }
        // The signal handler may come between the two lines below; then it unlinks a file that is not there.
        if (file->unfinished) {
            memcpy(file->unfinished->path, file->temporary, (size_t)length + 1);
            file->unfinished->open = 1;
        }
        int fd = open(file->temporary, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd >= 0) return fd;
        if (file->unfinished) file->unfinished->open = 0;
        if (errno != EEXIST) return -1;
    }
    return -1;
}

bool whole_open(WholeFile *file, const char *path, Unfinished *unfinished, Failure *failure)
{
    *file = (WholeFile){.fd = -1, .unfinished = unfinished};
    if (strlen(path) >= sizeof file->path) return fail(failure, "cannot write %.60s…: the path is too long", path);
    strcpy(file->path, path);

    struct stat status;
    bool there = !stat(path, &status);
    if (there && S_ISDIR(status.st_mode)) return fail(failure, "cannot write %s: it is a folder", path);
    if (there && !S_ISREG(status.st_mode)) {
        file->fd = open(path, O_WRONLY | O_CLOEXEC);
    } else if (there && access(path, W_OK)) {
        file->fd = -1; // Renaming would replace what its owner has protected.
    } else {
        file->fd = open_temporary(file);
    }
    if (file->fd >= 0) return true;
    int error = errno;
    if (error == ENOENT) return fail(failure, "cannot write %s: its folder does not exist", path);
    return fail(failure, "cannot write %s: %s", path, strerror(error));
}

bool whole_write(WholeFile *file, const void *bytes, size_t size, Failure *failure)
{
    if (!write_all(file->fd, bytes, size, -1)) return fail(failure, "cannot write %s: %s", file->path, strerror(errno));
    file->offset += size;
    return true;
}

void whole_drop(WholeFile *file)
{
    if (file->fd >= 0) close(file->fd);
    file->fd = -1;
    if (file->temporary[0]) unlink(file->temporary);
    file->temporary[0] = 0;
    if (file->unfinished) file->unfinished->open = 0;
}

bool whole_finish(WholeFile *file, Failure *failure)
{
    int closed = close(file->fd); // a full disk may be told only here
    file->fd = -1;
    if (closed || (file->temporary[0] && rename(file->temporary, file->path))) {
        int error = errno;
        whole_drop(file);
        return fail(failure, "cannot write %s: %s", file->path, strerror(error));
    }
    file->temporary[0] = 0;
    if (file->unfinished) file->unfinished->open = 0;
    return true;
}

// Reads to the end. `expected` is how much will probably come.
static bool read_to_end(FileBytes *file, int fd, size_t expected)
{
    size_t capacity = expected + 1; // the one tells the end of a file of the expected size
    uint8_t *bytes = malloc(capacity);
    file->size = 0;
    while (bytes) {
        ssize_t n = read(fd, bytes + file->size, capacity - file->size);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) break;
        if (n == 0) {
            file->bytes = bytes;
            return true;
        }
        file->size += (size_t)n;
        if (file->size < capacity) continue;
        uint8_t *larger = realloc(bytes, capacity *= 2);
        if (!larger) break;
        bytes = larger;
    }
    int error = errno;
    free(bytes);
    errno = error;
    return false;
}

bool bytes_open(FileBytes *file, const char *path, Failure *failure)
{
    *file = (FileBytes){0};
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return fail(failure, "cannot open %s: %s", path, strerror(errno));
    struct stat status;
    size_t expected = 1 << 16;
    if (!fstat(fd, &status) && S_ISREG(status.st_mode)) expected = (size_t)status.st_size;
    bool ok = read_to_end(file, fd, expected);
    int error = errno;
    close(fd);
    return ok || fail(failure, "cannot read %s: %s", path, strerror(error));
}

void bytes_close(FileBytes *file)
{
    free(file->bytes);
    *file = (FileBytes){0};
}

bool make_folders(const char *path)
{
    char part[FILE_PATH_SIZE];
    size_t length = strlen(path);
    if (!length || length >= sizeof part) return false;
    memcpy(part, path, length + 1);
    for (char *slash = strchr(part + 1, '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = 0;
        if (mkdir(part, 0777) && errno != EEXIST) return false;
        *slash = '/';
    }
    return !mkdir(part, 0700) || errno == EEXIST;
}
