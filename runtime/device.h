// OpenCL devices: which there are, and opening one.
//
//     Failure failure;
//     Device *device = device_open(&(DeviceDesc){.choice = "cpu", .threads = 1}, &failure);
//     if (!device) …failure.text…
//     device_close(device);
//
// A Device owns a context and one in-order command queue. Only the thread that holds the device uses its queue. Threads
// that open devices at once take turns.
//
// PoCL takes its settings from the environment at its first call, so device_list() and device_open() set POCL_…
// variables (only those that the user did not set) before they call OpenCL for the first time in the process; a
// program with threads of its own makes its first call while no other thread reads or writes the environment. For the
// same reason the number of threads of a CPU is that of the first device_open() of the process.
#ifndef SCN_RUNTIME_DEVICE_H
#define SCN_RUNTIME_DEVICE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <CL/cl.h>

#include "runtime/failure.h"

typedef struct DeviceInfo {
    char name[256];     // as the driver says it
    char platform[128]; // "Portable Computing Language"
    char version[128];  // of OpenCL that it speaks: "OpenCL 3.0 PoCL …"
    char driver[128];   // version of the driver
    bool is_cpu;
    bool is_pocl;
    bool has_fp64;
    unsigned compute_units;
    size_t max_work_group; // work-items in a work-group
    uint64_t memory;       // bytes of global memory
    uint64_t max_buffer;   // bytes of the largest buffer
    uint64_t local_memory; // bytes of a work-group's
} DeviceInfo;

typedef struct Device {
    cl_platform_id platform;
    cl_device_id id;
    cl_context context;
    cl_command_queue queue; // in order
    DeviceInfo info;
    int width;     // lanes of a packet: 16 on a CPU, where a work-item does a packet; 1 elsewhere, where it does a ray
    bool no_cache; // as its description says
    struct Program
        *patches; // the kernels of patches, which all of them share (runtime/patch_device.h); NULL: not built so far
} Device;

typedef struct DeviceDesc {
    // "cpu", "gpu", a number of `scn devices`, or part of a name (case does not count); NULL: the first GPU, else the
    // CPU.
    const char *choice;
    int threads;    // of a CPU; 0: as many as it has
    int width;      // 1 or 16 to overrule the device's own; 0: its own
    bool profiling; // events carry times
    bool no_cache;  // what is built for it neither reads nor writes the cache (runtime/program.h)
} DeviceDesc;

// Fills up to `capacity` infos in the order of their numbers and returns how many devices there are, 0 if none;
// -1 with `failure` set where OpenCL itself failed.
int device_list(DeviceInfo *infos, int capacity, Failure *failure);

// Opens a device. NULL with `failure` set: none there (the text names the package to install), or none fits the choice.
Device *device_open(const DeviceDesc *desc, Failure *failure);

void device_close(Device *device); // NULL is nothing

// Names the driver, the device and the width for which a binary is good. Equal keys take each other's binaries.
#define DEVICE_KEY_SIZE 768
void device_key(const Device *device, char key[static DEVICE_KEY_SIZE]);

// "CL_OUT_OF_RESOURCES" for -5, for messages.
const char *device_error(cl_int status);

#endif
