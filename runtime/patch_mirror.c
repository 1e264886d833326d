#include "runtime/patch_mirror.h"

#include <stdint.h>
#include <stdlib.h>

bool patch_device_did(cl_int status, const char *what, Failure *failure)
{
    return status == CL_SUCCESS || fail(failure, "the device cannot %s patches (%s)", what, device_error(status));
}

static void wait_for_upload(PatchMirror *mirror)
{
    if (!mirror->uploaded) return;
    clWaitForEvents(1, &mirror->uploaded);
    clReleaseEvent(mirror->uploaded);
    mirror->uploaded = NULL;
}

void patch_mirror_free(PatchMirror *mirror)
{
    wait_for_upload(mirror);
    if (mirror->buffer) clReleaseMemObject(mirror->buffer);
    free(mirror->bytes);
    *mirror = (PatchMirror){0};
}

bool patch_mirror_clear(PatchMirror *mirror, Device *device, Failure *failure)
{
    uint32_t zero = 0;
    return patch_device_did(
        clEnqueueFillBuffer(device->queue, mirror->buffer, &zero, sizeof zero, 0, mirror->size, 0, NULL, NULL), "clear",
        failure);
}

bool patch_mirror_make(PatchMirror *mirror, Device *device, size_t size, bool on_host, Failure *failure)
{
    // OpenCL knows no empty buffers and fills whole words.
    size = size < 4 ? 4 : (size + 3) / 4 * 4;
    PatchMirror made = {.size = size, .high = on_host ? size : 0};
    cl_int status;
    made.buffer = clCreateBuffer(device->context, CL_MEM_READ_WRITE, size, NULL, &status);
    if (status != CL_SUCCESS)
        return fail(failure, "the device has no %zu bytes for patches (%s)", size, device_error(status));
    if (on_host) made.bytes = calloc(1, size);
    bool ok =
        on_host ? made.bytes || fail(failure, "out of memory for patches") : patch_mirror_clear(&made, device, failure);
    if (!ok) {
        patch_mirror_free(&made);
        return false;
    }
    patch_mirror_free(mirror);
    *mirror = made;
    return true;
}

void *patch_mirror_change(PatchMirror *mirror, size_t start, size_t size)
{
    wait_for_upload(mirror);
    if (mirror->low >= mirror->high) {
        mirror->low = start;
        mirror->high = start + size;
    } else {
        if (start < mirror->low) mirror->low = start;
        if (start + size > mirror->high) mirror->high = start + size;
    }
    return mirror->bytes + start;
}

bool patch_mirror_upload(PatchMirror *mirror, Device *device, Failure *failure)
{
    if (mirror->low >= mirror->high) return true;
    wait_for_upload(mirror);
    cl_int status =
        clEnqueueWriteBuffer(device->queue, mirror->buffer, CL_FALSE, mirror->low, mirror->high - mirror->low,
                             mirror->bytes + mirror->low, 0, NULL, &mirror->uploaded);
    if (status != CL_SUCCESS)
        mirror->uploaded = NULL;
    else
        mirror->low = mirror->high = 0;
    return patch_device_did(status, "take changes of", failure);
}

bool patch_mirror_read(const PatchMirror *mirror, Device *device, size_t start, size_t size, void *to, Failure *failure)
{
    return patch_device_did(clEnqueueReadBuffer(device->queue, mirror->buffer, CL_TRUE, start, size, to, 0, NULL, NULL),
                            "give back", failure);
}

bool patch_mirror_write(const PatchMirror *mirror, Device *device, size_t start, size_t size, const void *from,
                        Failure *failure)
{
    return patch_device_did(
        clEnqueueWriteBuffer(device->queue, mirror->buffer, CL_TRUE, start, size, from, 0, NULL, NULL), "take",
        failure);
}
