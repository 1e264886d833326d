// Renders a scene with the oracle, to look at and to time.
//
//     scn-oracle SCENE [--size WxH] [--stride N] [--time SECONDS] [--samples N] [--bias LENGTH] [-o PICTURE.png]
//
// --samples 0 (the default) is the exact way, else the plain reference with N samples a piece. --stride N renders every Nth pixel of every Nth line. Prints one line of
// JSON: CPU milliseconds for the rays that were followed and, by the square of the stride, for all.
#include <math.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "tests/oracle/load.h"
#include "tests/oracle/oracle.h"

typedef struct Options {
    const char *scene, *picture;
    int width, height, stride, samples;
    double time, bias;
} Options;

static double cpu_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static bool read_options(int argc, char **argv, Options *o)
{
    *o = (Options){.width = 512, .height = 512, .stride = 1, .bias = 1e-4};
    for (int k = 1; k < argc; k++) {
        const char *value = k + 1 < argc ? argv[k + 1] : "";
        if (argv[k][0] != '-') {
            o->scene = argv[k];
            continue;
        }
        k++;
        if (!strcmp(argv[k - 1], "-o"))
            o->picture = value;
        else if (!strcmp(argv[k - 1], "--size"))
            sscanf(value, "%dx%d", &o->width, &o->height);
        else if (!strcmp(argv[k - 1], "--stride"))
            o->stride = atoi(value);
        else if (!strcmp(argv[k - 1], "--samples"))
            o->samples = atoi(value);
        else if (!strcmp(argv[k - 1], "--time"))
            o->time = atof(value);
        else if (!strcmp(argv[k - 1], "--bias"))
            o->bias = atof(value);
        else
            return false;
    }
    return o->scene && o->width > 0 && o->height > 0 && o->stride > 0 && o->samples >= 0;
}

static bool write_png(const char *path, const float *rgb, int width, int height)
{
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)width,
                       .height = (png_uint_32)height,
                       .format = PNG_FORMAT_RGB};
    size_t count = (size_t)width * (size_t)height * 3;
    png_bytep pixels = malloc(count);
    if (!pixels) abort();
    for (size_t k = 0; k < count; k++) {
        double v = fmin(fmax(rgb[k], 0), 1);
        v = v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
        pixels[k] = (png_byte)lround(255 * v);
    }
    bool good = png_image_write_to_file(&image, path, 0, pixels, 0, NULL);
    free(pixels);
    return good;
}

int main(int argc, char **argv)
{
    Options o;
    OracleSource source;
    char why[ORACLE_ERROR] = "";
    if (!read_options(argc, argv, &o)) {
        fprintf(stderr, "usage: scn-oracle SCENE [--size WxH] [--stride N] [--time SECONDS] [--samples N] [--bias "
                        "LENGTH] [-o PICTURE.png]\n");
        return 2;
    }
    if (!oracle_load(&source, o.scene, NULL, 0)) return 1;
    Oracle *oracle = oracle_new(source.ir, &(OracleFrame){.time = o.time}, why);
    if (!oracle) {
        fprintf(stderr, "%s: %s\n", o.scene, why);
        return 1;
    }
    oracle->bound[3] = source.bound;
    int columns = (o.width - o.stride / 2 + o.stride - 1) / o.stride,
        rows = (o.height - o.stride / 2 + o.stride - 1) / o.stride;
    float *rgb = malloc(sizeof *rgb * 3 * (size_t)columns * (size_t)rows);
    if (!rgb) abort();
    double begin = cpu_ms();
    oracle_render(oracle, o.width, o.height, o.stride, o.samples, o.bias, rgb);
    double spent = cpu_ms() - begin;
    printf("{\"scene\": \"%s\", \"samples\": %d, \"rays\": %d, \"cpu_ms\": %.3f, \"frame_cpu_ms\": %.3f}\n", o.scene,
           o.samples, columns * rows, spent, spent * ((double)o.width * o.height) / ((double)columns * rows));
    int status = 0;
    if (o.picture && !write_png(o.picture, rgb, columns, rows)) {
        fprintf(stderr, "%s cannot be written\n", o.picture);
        status = 3;
    }
    free(rgb);
    oracle_free(oracle);
    oracle_unload(&source);
    return status;
}
