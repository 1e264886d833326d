#include "runtime/patch_state.h"

#include <string.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#define STATE_MAGIC   "scnpatch"
#define STATE_VERSION 1

typedef struct StateHeader {
    char magic[8];
    uint32_t version, kind, nodes, count;
    uint64_t size, hash; // of the rest
} StateHeader;

void patch_write(PatchWriter *writer, const void *from, size_t size)
{
    if (writer->bytes && writer->length + size <= writer->capacity) memcpy(writer->bytes + writer->length, from, size);
    writer->length += size;
}

void patch_write_header(PatchWriter *writer, PatchStateKind kind, int nodes, int count)
{
    StateHeader header = {STATE_MAGIC, STATE_VERSION, kind, (uint32_t)nodes, (uint32_t)count, 0, 0};
    patch_write(writer, &header, sizeof header);
}

size_t patch_write_end(PatchWriter *writer)
{
    if (!writer->bytes || writer->length > writer->capacity) return writer->length;
    StateHeader header;
    memcpy(&header, writer->bytes, sizeof header);
    header.size = writer->length - sizeof header;
    header.hash = XXH3_64bits(writer->bytes + sizeof header, header.size);
    memcpy(writer->bytes, &header, sizeof header);
    return writer->length;
}

bool patch_read_header(PatchReader *reader, const void *bytes, size_t size, PatchStateKind kind, int nodes, int count,
                       Failure *failure)
{
    StateHeader header;
    if (size < sizeof header) return fail(failure, "the checkpoint of the patch is too short");
    memcpy(&header, bytes, sizeof header);
    if (memcmp(header.magic, STATE_MAGIC, sizeof header.magic))
        return fail(failure, "this is not the checkpoint of a patch");
    if (header.version != STATE_VERSION)
        return fail(failure, "the checkpoint of the patch has version %u, not %d", header.version, STATE_VERSION);
    if (header.kind != kind) return fail(failure, "the checkpoint of the patch was made by another solver");
    if (header.nodes != (uint32_t)nodes || header.count != (uint32_t)count)
        return fail(failure, "the checkpoint is of %u patches with %u nodes a side, not of %d with %d", header.count,
                    header.nodes, count, nodes);
    *reader = (PatchReader){(const uint8_t *)bytes + sizeof header, size - sizeof header};
    if (header.size != reader->left || header.hash != XXH3_64bits(reader->bytes, reader->left))
        return fail(failure, "the checkpoint of the patch is damaged");
    return true;
}

bool patch_read(PatchReader *reader, void *to, size_t size)
{
    if (size > reader->left) return false;
    memcpy(to, reader->bytes, size);
    reader->bytes += size;
    reader->left -= size;
    return true;
}
