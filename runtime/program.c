// An entry of the cache is a header and the driver's binary. The name of the file is the key; the header repeats it,
// so a file that was renamed or cut is not taken for another.
#include "runtime/program.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "runtime/file.h"
#include "runtime/pocl.h"

#define ENTRY_MAGIC "scncl1\r\n"

typedef struct EntryHeader {
    char magic[8];
    uint8_t key[16];
    uint64_t size, hash; // of the binary that follows
} EntryHeader;

static double milliseconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

bool program_cache_folder(char *path, size_t size)
{
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    int length = -1;
    if (cache && cache[0] == '/')
        length = snprintf(path, size, "%s/scn", cache);
    else if (home && home[0] == '/')
        length = snprintf(path, size, "%s/.cache/scn", home);
    return length >= 0 && (size_t)length < size;
}

static void make_key(const Device *device, const ProgramDesc *desc, uint8_t key[16])
{
    char device_name[DEVICE_KEY_SIZE];
    device_key(device, device_name);
    const char *options = desc->options ? desc->options : "";
    XXH3_state_t *state = XXH3_createState();
    if (!state) abort(); // 600 bytes: as in arena_alloc(), nobody could go on
    XXH3_128bits_reset(state);
    // The terminating zeros keep the parts apart.
    XXH3_128bits_update(state, device_name, strlen(device_name) + 1);
    XXH3_128bits_update(state, options, strlen(options) + 1);
    XXH3_128bits_update(state, desc->source, desc->length);
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits_digest(state));
    XXH3_freeState(state);
    memcpy(key, canonical.digest, 16);
}

// Beside the command, as it is built and installed: bin/scn and share/scn. For programs that call the library and
// stand elsewhere, where scn was to be installed.
static void stock_folder(char *path, size_t size)
{
    char program[FILE_PATH_SIZE];
    ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    program[length > 0 ? length : 0] = 0;
    for (int level = 0; level < 2; level++) {
        char *slash = strrchr(program, '/');
        if (slash) *slash = 0;
    }
    int written = snprintf(path, size, "%s/share/scn", program);
    bool beside = written > 0 && (size_t)written < size && !access(path, R_OK | X_OK);
    if (!beside) snprintf(path, size, "%s", SCN_DATA_FOLDER);
}

static bool entry_path(const char *folder, const uint8_t key[16], char *path, size_t size)
{
    int length = snprintf(path, size, "%s/", folder);
    if (length < 0 || (size_t)length + 40 > size) return false;
    for (int i = 0; i < 16; i++) length += sprintf(path + length, "%02x", key[i]);
    strcpy(path + length, ".clb");
    return true;
}

static cl_program program_of_binary(Device *device, const void *binary, size_t size, const char *options)
{
    cl_int status, loaded;
    const unsigned char *bytes = binary;
    cl_program cl = clCreateProgramWithBinary(device->context, 1, &device->id, &size, &bytes, &loaded, &status);
    if (status != CL_SUCCESS || loaded != CL_SUCCESS) {
        if (status == CL_SUCCESS) clReleaseProgram(cl);
        return NULL;
    }
    if (clBuildProgram(cl, 1, &device->id, options, NULL, NULL) == CL_SUCCESS) return cl;
    clReleaseProgram(cl);
    return NULL;
}

// A program from an entry in a folder, or NULL. Drivers do not survive every damaged binary, so nothing reaches them
// whose hash is wrong.
static cl_program program_of_entry(Device *device, const char *folder, const uint8_t key[16], const char *options)
{
    char path[FILE_PATH_SIZE];
    FileBytes file;
    if (!entry_path(folder, key, path, sizeof path) || !bytes_open(&file, path, NULL)) return NULL;
    EntryHeader header;
    cl_program cl = NULL;
    if (file.size > sizeof header) {
        memcpy(&header, file.bytes, sizeof header);
        const uint8_t *binary = file.bytes + sizeof header;
        if (!memcmp(header.magic, ENTRY_MAGIC, sizeof header.magic) && !memcmp(header.key, key, 16) &&
            header.size == file.size - sizeof header && header.hash == XXH3_64bits(binary, header.size))
            cl = program_of_binary(device, binary, header.size, options);
    }
    bytes_close(&file);
    return cl;
}

// From the user's cache, or else from what was compiled with scn; NULL where neither has it.
static cl_program program_of_cache(Device *device, const uint8_t key[16], const char *options)
{
    char folder[FILE_PATH_SIZE];
    cl_program cl = NULL;
    if (program_cache_folder(folder, sizeof folder)) cl = program_of_entry(device, folder, key, options);
    if (cl) return cl;
    stock_folder(folder, sizeof folder);
    return program_of_entry(device, folder, key, options);
}

// Saves the source and what the compiler said about it. Returns the path in `path`.
static bool save_log(const ProgramDesc *desc, const char *log, char *path, size_t size)
{
    const char *folder = getenv("TMPDIR");
    snprintf(path, size, "%s/scn-build-XXXXXX.log", folder && *folder ? folder : "/tmp");
    int fd = mkstemps(path, 4);
    if (fd < 0) return false;
    bool ok = write_all(fd, log, strlen(log), -1) && write_all(fd, "\n\n", 2, -1) &&
              write_all(fd, desc->source, desc->length, -1);
    return !close(fd) && ok;
}

static void report_build(const ProgramDesc *desc, Device *device, cl_program cl, cl_int status, Failure *failure)
{
    size_t size = 0;
    clGetProgramBuildInfo(cl, device->id, CL_PROGRAM_BUILD_LOG, 0, NULL, &size);
    char *log = calloc(1, size + 1);
    if (log) clGetProgramBuildInfo(cl, device->id, CL_PROGRAM_BUILD_LOG, size, log, NULL);
    const char *text = log && *log ? log : "(the compiler says nothing)";
    const char *error = strstr(text, "error:");
    if (!error) error = text;
    char path[FILE_PATH_SIZE] = "", cache[POCL_PATH_SIZE];
    if (device->info.is_pocl && pocl_cache_full() && pocl_cache_folder(cache)) {
        fail(failure, "kernels cannot be compiled: the disk of the OpenCL driver's cache, %s, is full", cache);
        free(log);
        return;
    }
    bool saved = save_log(desc, text, path, sizeof path);
    fail(failure, "internal error: the OpenCL compiler of %s refuses the kernel (%s): %.*s%s%.200s", device->info.name,
         device_error(status), (int)strcspn(error, "\n"), error, saved ? "; its log and the source are in " : "",
         saved ? path : "");
    free(log);
}

static cl_program program_of_source(Device *device, const ProgramDesc *desc, Failure *failure)
{
    cl_int status;
    cl_program cl = clCreateProgramWithSource(device->context, 1, (const char **)&desc->source, &desc->length, &status);
    if (status != CL_SUCCESS) {
        fail(failure, "cannot make an OpenCL program (%s)", device_error(status));
        return NULL;
    }
    status = clBuildProgram(cl, 1, &device->id, desc->options, NULL, NULL);
    if (status == CL_SUCCESS) return cl;
    report_build(desc, device, cl, status, failure);
    clReleaseProgram(cl);
    return NULL;
}

Program *program_build(Device *device, const ProgramDesc *desc, Failure *failure)
{
    Program *program = calloc(1, sizeof *program);
    if (!program) {
        fail(failure, "out of memory");
        return NULL;
    }
    double start = milliseconds();
    program->device = device;
    program->no_cache = desc->no_cache || device->no_cache;
    make_key(device, desc, program->key);
    if (desc->binary) program->cl = program_of_binary(device, desc->binary, desc->binary_size, desc->options);
    program->from_binary = program->cl != NULL;
    if (!program->cl && !program->no_cache) {
        program->cl = program_of_cache(device, program->key, desc->options);
        program->from_cache = program->cl != NULL;
    }
    if (!program->cl && !desc->ready_only) {
        program->cl = program_of_source(device, desc, failure);
        program->builds = 1;
    }
    if (!program->cl) {
        free(program);
        return NULL;
    }
    program->build_ms = milliseconds() - start;
    return program;
}

void program_free(Program *program)
{
    if (!program) return;
    clReleaseProgram(program->cl);
    free(program);
}

void *program_binary(const Program *program, size_t *size, Failure *failure)
{
    *size = 0;
    cl_int status = clGetProgramInfo(program->cl, CL_PROGRAM_BINARY_SIZES, sizeof *size, size, NULL);
    if (status == CL_SUCCESS && !*size) status = CL_INVALID_BINARY;
    unsigned char *bytes = status == CL_SUCCESS ? malloc(*size) : NULL;
    if (bytes) status = clGetProgramInfo(program->cl, CL_PROGRAM_BINARIES, sizeof bytes, &bytes, NULL);
    if (bytes && status == CL_SUCCESS) {
        if (program->device->info.is_pocl) pocl_clean_binary(bytes, *size);
        return bytes;
    }
    free(bytes);
    fail(failure, "the driver of %s gives no binary (%s)", program->device->info.name,
         status == CL_SUCCESS ? "out of memory" : device_error(status));
    return NULL;
}

bool program_store(const Program *program, Failure *failure)
{
    if (program->from_cache || program->no_cache) return true;
    char path[FILE_PATH_SIZE], folder[FILE_PATH_SIZE];
    if (!program_cache_folder(folder, sizeof folder) || !entry_path(folder, program->key, path, sizeof path))
        return fail(failure, "there is no folder for the cache: HOME is not set");
    if (!access(path, R_OK) && program->from_binary) return true;
    char *slash = strrchr(path, '/');
    *slash = 0;
    bool made = make_folders(path);
    int error = errno;
    *slash = '/';
    if (!made) return fail(failure, "cannot make the folder of the cache for %s: %s", path, strerror(error));

    EntryHeader header = {.magic = ENTRY_MAGIC};
    memcpy(header.key, program->key, 16);
    size_t size;
    void *binary = program_binary(program, &size, failure);
    if (!binary) return false;
    header.size = size;
    header.hash = XXH3_64bits(binary, size);
    WholeFile file;
    bool ok = whole_open(&file, path, NULL, failure);
    if (ok) {
        ok = whole_write(&file, &header, sizeof header, failure) && whole_write(&file, binary, size, failure);
        if (ok)
            ok = whole_finish(&file, failure);
        else
            whole_drop(&file);
    }
    free(binary);
    return ok;
}
