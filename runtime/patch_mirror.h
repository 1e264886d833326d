// A buffer of the device and, where the host writes it, the bytes it is to hold.
//
// A change marks its range; an upload enqueues what is marked and does not wait. Only a change of bytes whose upload
// has not been done yet waits for it, so the host prepares one step while the device does another.
//
//     float *load = patch_mirror_change(&mirror, start, size);   …write…   patch_mirror_upload(&mirror, device, &failure)
#ifndef SCN_RUNTIME_PATCH_MIRROR_H
#define SCN_RUNTIME_PATCH_MIRROR_H

#include <stdbool.h>
#include <stddef.h>

#include "runtime/device.h"
#include "runtime/failure.h"

typedef struct PatchMirror {
    cl_mem buffer;
    char *bytes; // NULL: the device alone writes it
    size_t size;
    size_t low, high;  // changed since the last upload; low >= high: nothing
    cl_event uploaded; // the last upload; NULL: none under way
} PatchMirror;

// Makes a buffer of `size` bytes, all zero, with bytes of the host's if `on_host`. What the mirror was before is freed,
// but only if that succeeds.
bool patch_mirror_make(PatchMirror *mirror, Device *device, size_t size, bool on_host, Failure *failure);
void patch_mirror_free(PatchMirror *mirror); // zero is nothing

// Gives a range of the bytes to write to.
void *patch_mirror_change(PatchMirror *mirror, size_t start, size_t size);

bool patch_mirror_upload(PatchMirror *mirror, Device *device, Failure *failure);

// Enqueues zeros over the whole buffer.
bool patch_mirror_clear(PatchMirror *mirror, Device *device, Failure *failure);

// Wait, and copy a range of the buffer.
bool patch_mirror_read(const PatchMirror *mirror, Device *device, size_t start, size_t size, void *to,
                       Failure *failure);
bool patch_mirror_write(const PatchMirror *mirror, Device *device, size_t start, size_t size, const void *from,
                        Failure *failure);

// True if OpenCL did what was asked; else sets "the device cannot WHAT patches (CL_…)".
bool patch_device_did(cl_int status, const char *what, Failure *failure);

#endif
