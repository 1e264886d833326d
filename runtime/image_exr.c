// The OpenEXRCore library encodes one chunk of 16 lines at a time. It is given pointers into the film and strides, so
// no layer is copied; only the Cryptomatte channels are made, a chunk at a time.
#include "runtime/image_exr.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <openexr.h>

#define CRYPTO_NAME     "CryptoObject"
#define CRYPTO_CHANNELS (2 * FILM_COVERS) // an id and a weight for each object
#define CHUNK_LINES     16                // of ZIP compression
#define MAX_CHANNELS    32

// Where the numbers of a channel are: in the film (`base`), or in the chunk's Cryptomatte values (base NULL, `crypto`
// their index).
typedef struct Channel {
    const char *name;
    exr_pixel_type_t type;   // in the file
    exr_pixel_type_t memory; // in the film
    const char *base;
    int crypto;
    size_t stride; // bytes between pixels
} Channel;

typedef struct ExrWriter {
    const ExrDesc *desc;
    WholeFile file;
    Failure *failure;
    exr_context_t context;
    Channel channels[MAX_CHANNELS];
    int channel_count;
    float *crypto;    // CHUNK_LINES lines of CRYPTO_CHANNELS values a pixel
    float *object_id; // Cryptomatte's number for each id, from 0
} ExrWriter;

// MurmurHash3_x86_32 with seed 0, by Austin Appleby (public domain), then Cryptomatte's rule that the bits make a
// float that is neither infinite, NaN nor denormal.
uint32_t cryptomatte_hash(const char *name)
{
    size_t length = strlen(name), blocks = length / 4;
    uint32_t h = 0, k;
    for (size_t i = 0; i < blocks; i++) {
        memcpy(&k, name + 4 * i, 4);
        k *= 0xcc9e2d51u;
        k = k << 15 | k >> 17;
        h ^= k * 0x1b873593u;
        h = h << 13 | h >> 19;
        h = h * 5 + 0xe6546b64u;
    }
    k = 0;
    for (size_t i = length; i > 4 * blocks; i--) k = k << 8 | (uint8_t)name[i - 1];
    if (length % 4) {
        k *= 0xcc9e2d51u;
        k = k << 15 | k >> 17;
        h ^= k * 0x1b873593u;
    }
    h ^= (uint32_t)length;
    h ^= h >> 16;
    h *= 0x85ebca6bu;
    h ^= h >> 13;
    h *= 0xc2b2ae35u;
    h ^= h >> 16;
    uint32_t exponent = h >> 23 & 255;
    if (exponent == 0 || exponent == 255) h ^= 1u << 23;
    return h;
}

static const char *object_name(const ExrDesc *desc, uint32_t index, char unnamed[static 32])
{
    if (index < desc->object_count && desc->objects[index][0]) return desc->objects[index];
    snprintf(unnamed, 32, "unnamed%" PRIu32, index + 1);
    return unnamed;
}

// OpenEXRCore tells errors of the writing function by its own code; the text is already in `failure`.
static int64_t on_write(exr_const_context_t context, void *data, const void *bytes, uint64_t size, uint64_t offset,
                        exr_stream_error_func_ptr_t error)
{
    ExrWriter *writer = data;
    if (write_all(writer->file.fd, bytes, size, (int64_t)offset)) return (int64_t)size;
    const char *reason = errno == ESPIPE ? "OpenEXR needs a file in which it can go back" : strerror(errno);
    fail(writer->failure, "cannot write %s: %s", writer->file.path, reason);
    return -1;
}

static void on_error(exr_const_context_t context, exr_result_t code, const char *message) {}

static void add_channel(ExrWriter *writer, Channel channel)
{
    writer->channels[writer->channel_count++] = channel; // 20 at most
}

static void add_floats(ExrWriter *writer, const char *const *names, int count, exr_pixel_type_t type, const float *base)
{
    for (int c = 0; c < count; c++)
        add_channel(writer, (Channel){names[c], type, EXR_PIXEL_FLOAT, (const char *)(base + c), 0,
                                      (size_t)count * sizeof(float)});
}

static void choose_channels(ExrWriter *writer)
{
    static const char *const color[] = {"R", "G", "B", "A"}, *const depth[] = {"Z"},
                             *const certificate[] = {"certificate"};
    static const char *const normal[] = {"N.X", "N.Y", "N.Z"}, *const position[] = {"P.X", "P.Y", "P.Z"};
    static const char *const crypto[] = {
        CRYPTO_NAME "00.R", CRYPTO_NAME "00.G", CRYPTO_NAME "00.B", CRYPTO_NAME "00.A",
        CRYPTO_NAME "01.R", CRYPTO_NAME "01.G", CRYPTO_NAME "01.B", CRYPTO_NAME "01.A",
    };
    const ExrDesc *desc = writer->desc;
    const Film *film = desc->film;
    unsigned layers = film->layers & (desc->layers ? desc->layers : FILM_ALL);
    exr_pixel_type_t small = desc->pixels == EXR_PIXELS_FLOAT ? EXR_PIXEL_FLOAT : EXR_PIXEL_HALF;
    exr_pixel_type_t places = desc->pixels == EXR_PIXELS_HALF ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
    if (layers & FILM_COLOR) add_floats(writer, color, 4, small, film->color);
    if (layers & FILM_DEPTH) add_floats(writer, depth, 1, EXR_PIXEL_FLOAT, film->depth);
    if (layers & FILM_NORMAL) add_floats(writer, normal, 3, small, film->normal);
    if (layers & FILM_POSITION) add_floats(writer, position, 3, places, film->position);
    if (layers & FILM_CERTIFICATE) add_floats(writer, certificate, 1, small, film->certificate);
    if (!(layers & FILM_ID)) return;
    add_channel(writer, (Channel){"id", EXR_PIXEL_UINT, EXR_PIXEL_UINT, (const char *)film->id, 0, sizeof(uint32_t)});
    for (int c = 0; c < CRYPTO_CHANNELS; c++)
        add_channel(writer,
                    (Channel){crypto[c], EXR_PIXEL_FLOAT, EXR_PIXEL_FLOAT, NULL, c, CRYPTO_CHANNELS * sizeof(float)});
}

static bool has_ids(const ExrWriter *writer)
{
    return writer->desc->film->layers & (writer->desc->layers ? writer->desc->layers : FILM_ALL) & FILM_ID;
}

// {"name":"1a2b3c4d",…}; names of the language need no escaping beyond quotes and backslashes. The caller frees it.
static char *make_manifest(const ExrDesc *desc)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) return NULL;
    fputc('{', out);
    for (uint32_t i = 0; i < desc->object_count; i++) {
        char unnamed[32];
        const char *name = object_name(desc, i, unnamed);
        fprintf(out, "%s\"", i ? "," : "");
        for (const char *c = name; *c; c++) {
            if ((unsigned char)*c < ' ')
                fprintf(out, "\\u%04x", (unsigned)*c);
            else
                fprintf(out, "%s%c", *c == '"' || *c == '\\' ? "\\" : "", *c);
        }
        fprintf(out, "\":\"%08" PRIx32 "\"", cryptomatte_hash(name));
    }
    fputc('}', out);
    if (fclose(out)) {
        free(text);
        return NULL;
    }
    return text;
}

static exr_result_t put_cryptomatte(ExrWriter *writer)
{
    static const char *const values[][2] = {
        {"name", CRYPTO_NAME}, {"hash", "MurmurHash3_32"}, {"conversion", "uint32_to_float32"}};
    char key[9], name[64];
    snprintf(key, sizeof key, "%08" PRIx32, cryptomatte_hash(CRYPTO_NAME));
    key[7] = 0; // Cryptomatte takes the first seven digits
    exr_result_t status = EXR_ERR_SUCCESS;
    for (int i = 0; i < 3 && status == EXR_ERR_SUCCESS; i++) {
        snprintf(name, sizeof name, "cryptomatte/%s/%s", key, values[i][0]);
        status = exr_attr_set_string(writer->context, 0, name, values[i][1]);
    }
    char *manifest = make_manifest(writer->desc);
    if (!manifest) return EXR_ERR_OUT_OF_MEMORY;
    snprintf(name, sizeof name, "cryptomatte/%s/manifest", key);
    if (status == EXR_ERR_SUCCESS) status = exr_attr_set_string(writer->context, 0, name, manifest);
    free(manifest);
    return status;
}

static exr_result_t put_objects(ExrWriter *writer)
{
    const ExrDesc *desc = writer->desc;
    if (!desc->object_count) return EXR_ERR_SUCCESS;
    const char **names = malloc(desc->object_count * sizeof *names);
    char(*unnamed)[32] = malloc(desc->object_count * sizeof *unnamed);
    exr_result_t status = EXR_ERR_OUT_OF_MEMORY;
    if (names && unnamed) {
        for (uint32_t i = 0; i < desc->object_count; i++) names[i] = object_name(desc, i, unnamed[i]);
        status = exr_attr_set_string_vector(writer->context, 0, "scn/objects", (int32_t)desc->object_count, names);
    }
    free(unnamed);
    free(names);
    return status;
}

static exr_result_t put_header(ExrWriter *writer)
{
    const ExrDesc *desc = writer->desc;
    const Film *film = desc->film;
    int part;
    exr_result_t status = exr_add_part(writer->context, "scn", EXR_STORAGE_SCANLINE, &part);
#define TRY(call)                                                                                                      \
    if (status == EXR_ERR_SUCCESS) status = (call)
    TRY(exr_initialize_required_attr_simple(writer->context, 0, film->width, film->height, EXR_COMPRESSION_ZIP));
    for (int c = 0; c < writer->channel_count; c++)
        TRY(exr_add_channel(writer->context, 0, writer->channels[c].name, writer->channels[c].type,
                            EXR_PERCEPTUALLY_LINEAR, 1, 1));
    TRY(exr_attr_set_string(writer->context, 0, "software", "scn " SCN_VERSION));
    TRY(exr_attr_set_string(writer->context, 0, "scn/version", SCN_VERSION));
    if (desc->scene) TRY(exr_attr_set_string(writer->context, 0, "scn/scene", desc->scene));
    TRY(exr_attr_set_int(writer->context, 0, "scn/frame", desc->frame));
    TRY(exr_attr_set_double(writer->context, 0, "scn/time", desc->time));
    if (has_ids(writer)) {
        TRY(put_objects(writer));
        TRY(put_cryptomatte(writer));
    }
    TRY(exr_write_header(writer->context));
#undef TRY
    return status;
}

// Cryptomatte's numbers, ready as floats: number 0 for nothing.
static bool make_object_ids(ExrWriter *writer)
{
    const ExrDesc *desc = writer->desc;
    writer->object_id = malloc(((size_t)desc->object_count + 1) * sizeof(float));
    writer->crypto = malloc((size_t)desc->film->width * CHUNK_LINES * CRYPTO_CHANNELS * sizeof(float));
    if (!writer->object_id || !writer->crypto) return false;
    writer->object_id[0] = 0;
    for (uint32_t i = 0; i < desc->object_count; i++) {
        char unnamed[32];
        uint32_t hash = cryptomatte_hash(object_name(desc, i, unnamed));
        memcpy(&writer->object_id[i + 1], &hash, sizeof hash);
    }
    return true;
}

static void fill_crypto(ExrWriter *writer, int y, int lines)
{
    const ExrDesc *desc = writer->desc;
    const Film *film = desc->film;
    size_t begin = (size_t)y * (size_t)film->width, count = (size_t)lines * (size_t)film->width;
    memset(writer->crypto, 0, count * CRYPTO_CHANNELS * sizeof(float));
    for (size_t i = 0; i < count; i++) {
        float *values = writer->crypto + i * CRYPTO_CHANNELS;
        for (int k = 0; k < (film->cover ? FILM_COVERS : 1); k++) {
            uint32_t id = film->cover ? film->cover[begin + i].id[k] : film->id[begin + i];
            if (!id || id > desc->object_count) continue;
            values[2 * k] = writer->object_id[id];
            values[2 * k + 1] = film->cover ? film->cover[begin + i].weight[k] : 1;
        }
    }
}

static const Channel *find_channel(const ExrWriter *writer, const char *name)
{
    for (int c = 0; c < writer->channel_count; c++)
        if (!strcmp(writer->channels[c].name, name)) return &writer->channels[c];
    return NULL;
}

// The file keeps channels sorted by name, so each is looked up.
static void point_channels(const ExrWriter *writer, exr_encode_pipeline_t *pipeline, int y)
{
    size_t width = (size_t)writer->desc->film->width;
    for (int c = 0; c < pipeline->channel_count; c++) {
        exr_coding_channel_info_t *coding = &pipeline->channels[c];
        const Channel *channel = find_channel(writer, coding->channel_name);
        const char *crypto = (const char *)(writer->crypto + channel->crypto);
        coding->user_data_type = (uint16_t)channel->memory;
        coding->user_bytes_per_element = 4;
        coding->user_pixel_stride = (int32_t)channel->stride;
        coding->user_line_stride = (int32_t)(channel->stride * width);
        coding->encode_from_ptr =
            (const uint8_t *)(channel->base ? channel->base + (size_t)y * width * channel->stride : crypto);
    }
}

static exr_result_t put_pixels(ExrWriter *writer)
{
    exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
    exr_result_t status = EXR_ERR_SUCCESS;
    int height = writer->desc->film->height;
    for (int y = 0; y < height && status == EXR_ERR_SUCCESS; y += CHUNK_LINES) {
        exr_chunk_info_t chunk = {0};
        status = exr_write_scanline_chunk_info(writer->context, 0, y, &chunk);
        if (status == EXR_ERR_SUCCESS)
            status = y ? exr_encoding_update(writer->context, 0, &chunk, &pipeline)
                       : exr_encoding_initialize(writer->context, 0, &chunk, &pipeline);
        if (status != EXR_ERR_SUCCESS) break;
        if (has_ids(writer)) fill_crypto(writer, y, chunk.height);
        point_channels(writer, &pipeline, y);
        if (!y) status = exr_encoding_choose_default_routines(writer->context, 0, &pipeline);
        if (status == EXR_ERR_SUCCESS) status = exr_encoding_run(writer->context, 0, &pipeline);
    }
    exr_encoding_destroy(writer->context, &pipeline);
    return status;
}

static exr_result_t put_file(ExrWriter *writer)
{
    // Level 2 of zlib: on rendered pictures half the time of the default level 6, for files a few percent larger.
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    start.error_handler_fn = on_error;
    start.user_data = writer;
    start.write_fn = on_write;
    start.zip_level = 2;
    start.flags = 0;
    exr_result_t status = exr_start_write(&writer->context, writer->file.path, EXR_WRITE_FILE_DIRECTLY, &start);
    if (status != EXR_ERR_SUCCESS) return status;
    status = put_header(writer);
    if (status == EXR_ERR_SUCCESS) status = put_pixels(writer);
    exr_result_t finished = exr_finish(&writer->context); // writes the table of chunks
    return status == EXR_ERR_SUCCESS ? finished : status;
}

bool image_write_exr(const char *path, const ExrDesc *desc, Failure *failure)
{
    ExrWriter writer = {.desc = desc, .failure = failure};
    if (!whole_open(&writer.file, path, desc->unfinished, failure)) return false;
    choose_channels(&writer);
    bool ok = false;
    if (has_ids(&writer) && !make_object_ids(&writer)) {
        fail(failure, "cannot write %s: out of memory", path);
    } else {
        exr_result_t status = put_file(&writer);
        ok = status == EXR_ERR_SUCCESS;
        if (!ok && status != EXR_ERR_WRITE_IO)
            fail(failure, "cannot write %s: %s", path, exr_get_default_error_message(status));
    }
    free(writer.crypto);
    free(writer.object_id);
    if (ok) return whole_finish(&writer.file, failure);
    whole_drop(&writer.file);
    return false;
}
