// 8-bit values come from a table of the 255 linear values at which the encoded one changes, which is exact and needs
// no power for each pixel. libpng reports errors by longjmp, so nothing that is changed after setjmp is read behind
// it but through `writer`.
#include "runtime/image_png.h"

#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#include <png.h>

double srgb_encode(double linear)
{
    if (!(linear > 0)) return 0; // also NaN
    if (linear >= 1) return 1;
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
}

static double srgb_decode(double encoded)
{
    return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

typedef struct PngWriter {
    WholeFile file;
    Failure *failure;
    png_structp png;
    png_infop info;
    uint8_t *row;
    float steps[256]; // steps[k]: the least linear value that is encoded as k
} PngWriter;

static void on_error(png_structp png, png_const_charp message)
{
    PngWriter *writer = png_get_error_ptr(png);
    if (message) fail(writer->failure, "cannot write %s: %s", writer->file.path, message);
    longjmp(png_jmpbuf(png), 1);
}

static void on_warning(png_structp png, png_const_charp message) {}

static void on_write(png_structp png, png_bytep bytes, png_size_t size)
{
    PngWriter *writer = png_get_io_ptr(png);
    if (!whole_write(&writer->file, bytes, size, writer->failure)) png_error(png, NULL);
}

static void on_flush(png_structp png) {}

static void fill_steps(float steps[256])
{
    steps[0] = 0;
    for (int k = 1; k < 256; k++) steps[k] = (float)srgb_decode((k - 0.5) / 255);
}

static uint8_t encode8(const float steps[256], float linear)
{
    if (!(linear > 0)) return 0;
    int low = 0; // steps[low] <= linear
    for (int half = 128; half; half /= 2)
        if (linear >= steps[low + half]) low += half;
    return (uint8_t)low;
}

static void encode_row(const PngWriter *writer, const float *color, int width, int bits, uint8_t *row)
{
    for (int x = 0; x < width; x++, color += 4) {
        for (int c = 0; c < 3; c++) {
            if (bits == 8) {
                *row++ = encode8(writer->steps, color[c]);
                continue;
            }
            unsigned value = (unsigned)lrint(srgb_encode(color[c]) * 65535);
            *row++ = (uint8_t)(value >> 8);
            *row++ = (uint8_t)value;
        }
    }
}

static void put_texts(PngWriter *writer, const PngDesc *desc)
{
    // libpng's structure has no const, though it copies the texts.
    static char software[] = "Software", title[] = "Title";
    const struct {
        char *key;
        const char *text;
        int kind;
    } all[] = {{software, desc->software, PNG_TEXT_COMPRESSION_NONE}, {title, desc->scene, PNG_ITXT_COMPRESSION_NONE}};
    for (int i = 0; i < 2; i++) {
        if (!all[i].text) continue;
        char *copy = strdup(all[i].text);
        if (!copy) png_error(writer->png, "out of memory");
        png_text text = {.compression = all[i].kind, .key = all[i].key, .text = copy};
        png_set_text(writer->png, writer->info, &text, 1);
        free(copy);
    }
}

static bool write_picture(PngWriter *writer, const PngDesc *desc)
{
    const Film *film = desc->film;
    int bits = desc->bits == 16 ? 16 : 8;
    int width = film ? film->width : desc->width, height = film ? film->height : desc->height;
    if (setjmp(png_jmpbuf(writer->png))) return false;
    png_set_write_fn(writer->png, writer, on_write, on_flush);
    png_set_user_limits(writer->png, FILM_MAX_SIZE, FILM_MAX_SIZE);
    // Measured on rendered pictures of 512² and 1024²: the filter Up with level 3 takes a quarter of the time of
    // libpng's defaults for files about a tenth larger.
    png_set_compression_level(writer->png, 3);
    png_set_filter(writer->png, 0, PNG_FILTER_UP);
    png_set_IHDR(writer->png, writer->info, (png_uint_32)width, (png_uint_32)height, bits, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB_gAMA_and_cHRM(writer->png, writer->info, PNG_sRGB_INTENT_RELATIVE);
    put_texts(writer, desc);
    png_write_info(writer->png, writer->info);
    for (int y = 0; y < height; y++) {
        if (film)
            encode_row(writer, film->color + (size_t)y * (size_t)width * 4, width, bits, writer->row);
        else
            desc->row(desc->context, y, writer->row);
        png_write_row(writer->png, writer->row);
    }
    png_write_end(writer->png, writer->info);
    return true;
}

bool image_write_png(const char *path, const PngDesc *desc, Failure *failure)
{
    PngWriter writer = {.failure = failure};
    if (!whole_open(&writer.file, path, desc->unfinished, failure)) return false;
    fill_steps(writer.steps);
    bool ok = false;
    writer.row = malloc((size_t)(desc->film ? desc->film->width : desc->width) * 6);
    writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &writer, on_error, on_warning);
    if (writer.png) writer.info = png_create_info_struct(writer.png);
    if (!writer.row || !writer.info)
        fail(failure, "cannot write %s: out of memory", path);
    else
        ok = write_picture(&writer, desc);
    png_destroy_write_struct(&writer.png, &writer.info);
    free(writer.row);
    if (ok) return whole_finish(&writer.file, failure);
    whole_drop(&writer.file);
    return false;
}
