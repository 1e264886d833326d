// The list of devices is made anew for each call: it is asked for once in a process, and drivers keep their own.
#include "runtime/device.h"

#include <ctype.h>
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "runtime/pocl.h"

#include "runtime/program.h"

#define DEVICE_LIMIT   64 // devices looked at
#define PLATFORM_LIMIT 16 // platforms looked at

// The one work-group size that is launched on a CPU is 1 1 1, with no offset and a grid below 65,536 work-items in
// each dimension. PoCL puts the functions for it into the binaries it makes when this says so, which is what lets a
// package start without a compiler.
#define POCL_WORK_GROUPS "1-1-1-goffs0-smallgrid"

static const char *const no_device =
    "there is no OpenCL device on this machine: install the package pocl-opencl-icd, which makes the processor one "
    "(apt-get install pocl-opencl-icd)";

const char *device_error(cl_int status)
{
    switch (status) {
#define NAME(code)                                                                                                     \
    case code: return #code;
        NAME(CL_SUCCESS)
        NAME(CL_DEVICE_NOT_FOUND)
        NAME(CL_DEVICE_NOT_AVAILABLE)
        NAME(CL_COMPILER_NOT_AVAILABLE)
        NAME(CL_MEM_OBJECT_ALLOCATION_FAILURE)
        NAME(CL_OUT_OF_RESOURCES)
        NAME(CL_OUT_OF_HOST_MEMORY)
        NAME(CL_PROFILING_INFO_NOT_AVAILABLE)
        NAME(CL_MEM_COPY_OVERLAP)
        NAME(CL_BUILD_PROGRAM_FAILURE)
        NAME(CL_MAP_FAILURE)
        NAME(CL_MISALIGNED_SUB_BUFFER_OFFSET)
        NAME(CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST)
        NAME(CL_COMPILE_PROGRAM_FAILURE)
        NAME(CL_LINKER_NOT_AVAILABLE)
        NAME(CL_LINK_PROGRAM_FAILURE)
        NAME(CL_INVALID_VALUE)
        NAME(CL_INVALID_DEVICE_TYPE)
        NAME(CL_INVALID_PLATFORM)
        NAME(CL_INVALID_DEVICE)
        NAME(CL_INVALID_CONTEXT)
        NAME(CL_INVALID_QUEUE_PROPERTIES)
        NAME(CL_INVALID_COMMAND_QUEUE)
        NAME(CL_INVALID_HOST_PTR)
        NAME(CL_INVALID_MEM_OBJECT)
        NAME(CL_INVALID_BINARY)
        NAME(CL_INVALID_BUILD_OPTIONS)
        NAME(CL_INVALID_PROGRAM)
        NAME(CL_INVALID_PROGRAM_EXECUTABLE)
        NAME(CL_INVALID_KERNEL_NAME)
        NAME(CL_INVALID_KERNEL_DEFINITION)
        NAME(CL_INVALID_KERNEL)
        NAME(CL_INVALID_ARG_INDEX)
        NAME(CL_INVALID_ARG_VALUE)
        NAME(CL_INVALID_ARG_SIZE)
        NAME(CL_INVALID_KERNEL_ARGS)
        NAME(CL_INVALID_WORK_DIMENSION)
        NAME(CL_INVALID_WORK_GROUP_SIZE)
        NAME(CL_INVALID_WORK_ITEM_SIZE)
        NAME(CL_INVALID_GLOBAL_OFFSET)
        NAME(CL_INVALID_EVENT_WAIT_LIST)
        NAME(CL_INVALID_EVENT)
        NAME(CL_INVALID_OPERATION)
        NAME(CL_INVALID_BUFFER_SIZE)
        NAME(CL_INVALID_GLOBAL_WORK_SIZE)
        NAME(CL_INVALID_PROPERTY)
#undef NAME
    case -1001: return "CL_PLATFORM_NOT_FOUND_KHR";
    default: return "an unknown OpenCL error";
    }
}

// Whether PoCL's threads, one for each processor, may be bound to processors 0, 1 …: all of the machine are allowed, and all are used, so that nothing
// else is shut out. Where other programs run, Linux wakes both of two threads on one processor, and a frame is over before it moves one of them:
// bound, S1, S4 and S5 take 4.5, 3.8 and 14.4 ms of a busy machine instead of 8.5, 6.6 and 20 … 27.
static bool can_bind(int threads)
{
#ifdef __linux__
    cpu_set_t allowed;
    long processors = sysconf(_SC_NPROCESSORS_CONF);
    if (processors < 2 || processors > CPU_SETSIZE || (threads > 0 && threads != processors)) return false;
    if (sched_getaffinity(0, sizeof allowed, &allowed)) return false;
    return CPU_COUNT(&allowed) == processors;
#else
    (void)threads;
    return false;
#endif
}

// Puts PoCL's settings where the user has none. A number of threads is the user's word too, so it replaces what is there.
static void set_environment(int threads)
{
    if (can_bind(threads)) setenv("POCL_AFFINITY", "1", 0);
    setenv("POCL_BINARY_SPECIALIZE_WG", POCL_WORK_GROUPS, 0);
    pocl_ensure_cache();
    if (threads <= 0) return;
    char text[16];
    snprintf(text, sizeof text, "%d", threads);
    setenv("POCL_MAX_PTHREAD_COUNT", text, 1);
}

static void device_text(cl_device_id id, cl_device_info what, char *text, size_t size)
{
    // A text that does not fit is an error for OpenCL, and no driver has one near this size.
    if (clGetDeviceInfo(id, what, size, text, NULL) != CL_SUCCESS) text[0] = 0;
    text[size - 1] = 0;
}

static DeviceInfo info_of(cl_platform_id platform, cl_device_id id)
{
    DeviceInfo info = {0};
    device_text(id, CL_DEVICE_NAME, info.name, sizeof info.name);
    device_text(id, CL_DEVICE_VERSION, info.version, sizeof info.version);
    device_text(id, CL_DRIVER_VERSION, info.driver, sizeof info.driver);
    if (clGetPlatformInfo(platform, CL_PLATFORM_NAME, sizeof info.platform, info.platform, NULL) != CL_SUCCESS)
        info.platform[0] = 0;

    cl_device_type type = 0;
    cl_device_fp_config doubles = 0;
    cl_uint units = 0;
    cl_ulong memory = 0, buffer = 0, local = 0;
    size_t group = 0;
    clGetDeviceInfo(id, CL_DEVICE_TYPE, sizeof type, &type, NULL);
    clGetDeviceInfo(id, CL_DEVICE_DOUBLE_FP_CONFIG, sizeof doubles, &doubles, NULL);
    clGetDeviceInfo(id, CL_DEVICE_MAX_COMPUTE_UNITS, sizeof units, &units, NULL);
    clGetDeviceInfo(id, CL_DEVICE_GLOBAL_MEM_SIZE, sizeof memory, &memory, NULL);
    clGetDeviceInfo(id, CL_DEVICE_MAX_MEM_ALLOC_SIZE, sizeof buffer, &buffer, NULL);
    clGetDeviceInfo(id, CL_DEVICE_LOCAL_MEM_SIZE, sizeof local, &local, NULL);
    clGetDeviceInfo(id, CL_DEVICE_MAX_WORK_GROUP_SIZE, sizeof group, &group, NULL);
    info.is_cpu = (type & CL_DEVICE_TYPE_CPU) != 0;
    info.is_pocl = strstr(info.version, "PoCL") || strstr(info.version, "pocl");
    info.has_fp64 = doubles != 0;
    info.compute_units = units;
    info.max_work_group = group;
    info.memory = memory;
    info.max_buffer = buffer;
    info.local_memory = local;
    return info;
}

typedef struct Found {
    cl_platform_id platform;
    cl_device_id id;
} Found;

// All devices in the order of platforms and of each platform's list. Returns their number, -1 with `failure` set.
static int find_devices(Found found[static DEVICE_LIMIT], Failure *failure)
{
    cl_platform_id platforms[PLATFORM_LIMIT];
    cl_uint platform_count = 0;
    cl_int status = clGetPlatformIDs(PLATFORM_LIMIT, platforms, &platform_count);
    if (status == -1001 || (status == CL_SUCCESS && !platform_count)) return 0;
    if (status != CL_SUCCESS) {
        fail(failure, "OpenCL does not answer (%s)", device_error(status));
        return -1;
    }
    if (platform_count > PLATFORM_LIMIT) platform_count = PLATFORM_LIMIT;
    int count = 0;
    for (cl_uint p = 0; p < platform_count && count < DEVICE_LIMIT; p++) {
        cl_device_id ids[DEVICE_LIMIT];
        cl_uint n = 0;
        if (clGetDeviceIDs(platforms[p], CL_DEVICE_TYPE_ALL, DEVICE_LIMIT, ids, &n) != CL_SUCCESS) continue;
        if (n > DEVICE_LIMIT) n = DEVICE_LIMIT;
        for (cl_uint i = 0; i < n && count < DEVICE_LIMIT; i++) found[count++] = (Found){platforms[p], ids[i]};
    }
    return count;
}

// Drivers and their loader start at the first call of a process and do not expect two at once: a second thread sees no
// devices, or halves of them. So threads take turns with what may be the first call.
static pthread_mutex_t first_call = PTHREAD_MUTEX_INITIALIZER;

int device_list(DeviceInfo *infos, int capacity, Failure *failure)
{
    pthread_mutex_lock(&first_call);
    set_environment(0);
    Found found[DEVICE_LIMIT];
    int count = find_devices(found, failure);
    for (int i = 0; i < count && i < capacity; i++) infos[i] = info_of(found[i].platform, found[i].id);
    pthread_mutex_unlock(&first_call);
    return count;
}

static bool contains_ignoring_case(const char *text, const char *part)
{
    size_t length = strlen(part);
    for (; *text; text++)
        if (!strncasecmp(text, part, length)) return true;
    return length == 0;
}

static bool is_number(const char *text)
{
    if (!*text) return false;
    for (; *text; text++)
        if (!isdigit((unsigned char)*text)) return false;
    return true;
}

static bool usable(Found found)
{
    cl_bool available = CL_FALSE, compiler = CL_FALSE;
    clGetDeviceInfo(found.id, CL_DEVICE_AVAILABLE, sizeof available, &available, NULL);
    clGetDeviceInfo(found.id, CL_DEVICE_COMPILER_AVAILABLE, sizeof compiler, &compiler, NULL);
    return available && compiler;
}

// The index of the first device of a kind, or -1.
static int first_of_kind(const Found *found, int count, bool cpu)
{
    for (int i = 0; i < count; i++) {
        cl_device_type type = 0;
        clGetDeviceInfo(found[i].id, CL_DEVICE_TYPE, sizeof type, &type, NULL);
        if (((type & CL_DEVICE_TYPE_CPU) != 0) == cpu && usable(found[i])) return i;
    }
    return -1;
}

// The index of the device that `choice` means, or -1 with `failure` set.
static int choose(const Found *found, int count, const char *choice, Failure *failure)
{
    int index = -1;
    if (!choice || !*choice) {
        index = first_of_kind(found, count, false);
        if (index < 0) index = first_of_kind(found, count, true);
        if (index < 0) fail(failure, "no OpenCL device of this machine is available");
        return index;
    }
    bool cpu = !strcasecmp(choice, "cpu");
    if (cpu || !strcasecmp(choice, "gpu")) {
        index = first_of_kind(found, count, cpu);
        if (index < 0 && cpu)
            fail(failure, "there is no processor among the OpenCL devices: install the package pocl-opencl-icd");
        else if (index < 0)
            fail(failure, "there is no graphics card among the OpenCL devices: install its driver's OpenCL package, "
                          "or choose the processor with --device cpu");
        return index;
    }
    if (is_number(choice)) {
        long number = strtol(choice, NULL, 10);
        if (number < count) return (int)number;
        fail(failure, "there is no device %s: they are numbered 0 to %d (scn devices)", choice, count - 1);
        return -1;
    }
    for (int i = 0; i < count; i++) {
        char name[256];
        device_text(found[i].id, CL_DEVICE_NAME, name, sizeof name);
        if (contains_ignoring_case(name, choice)) return i;
    }
    fail(failure, "no device has \"%s\" in its name: `scn devices` lists them", choice);
    return -1;
}

static Device *open_device(const DeviceDesc *desc, Failure *failure)
{
    set_environment(desc->threads);
    Found found[DEVICE_LIMIT];
    int count = find_devices(found, failure);
    if (count < 0) return NULL;
    if (!count) {
        fail(failure, "%s", no_device);
        return NULL;
    }
    int index = choose(found, count, desc->choice, failure);
    if (index < 0) return NULL;

    Device *device = calloc(1, sizeof *device);
    if (!device) {
        fail(failure, "out of memory");
        return NULL;
    }
    device->platform = found[index].platform;
    device->id = found[index].id;
    device->info = info_of(device->platform, device->id);
    device->no_cache = desc->no_cache;
    device->width = desc->width ? desc->width : device->info.is_cpu ? 16 : 1;

    cl_int status;
    device->context = clCreateContext(NULL, 1, &device->id, NULL, NULL, &status);
    if (status == CL_SUCCESS)
        device->queue =
            clCreateCommandQueue(device->context, device->id, desc->profiling ? CL_QUEUE_PROFILING_ENABLE : 0, &status);
    if (status != CL_SUCCESS) {
        fail(failure, "cannot open the OpenCL device %s (%s)", device->info.name, device_error(status));
        device_close(device);
        return NULL;
    }
    return device;
}

Device *device_open(const DeviceDesc *desc, Failure *failure)
{
    pthread_mutex_lock(&first_call);
    Device *device = open_device(desc, failure);
    pthread_mutex_unlock(&first_call);
    return device;
}

void device_close(Device *device)
{
    if (!device) return;
    program_free(device->patches);
    if (device->queue) clReleaseCommandQueue(device->queue);
    if (device->context) clReleaseContext(device->context);
    free(device);
}

void device_key(const Device *device, char key[static DEVICE_KEY_SIZE])
{
    // PoCL's platform version names the LLVM that compiled, its device version the processor.
    char platform[256] = "";
    if (clGetPlatformInfo(device->platform, CL_PLATFORM_VERSION, sizeof platform, platform, NULL) != CL_SUCCESS)
        platform[0] = 0;
    snprintf(key, DEVICE_KEY_SIZE, "%.200s|%.127s|%.127s|%.200s|%d", platform, device->info.driver,
             device->info.version, device->info.name, device->width);
}
