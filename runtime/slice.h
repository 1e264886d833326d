// Slices on a device: the picture, one bit a pixel, of where a condition (compiler/formula.h) holds in a window.
//
// A pixel is decided at its centre: column i of n is at x0 + (i + 0.5) (x1 - x0) / n, row j at y1 - (j + 0.5) (y1 - y0) / n, rounded
// to float; there the picture is what the formula's floats say, bit for bit, however it is made.
//
//     Slicer *slicer = slicer_new(device, &(SlicerDesc){0}, &failure);
//     if (slicer_program(slicer, &steps, &failure) && slicer_draw(slicer, &view, SLICE_TILES, &failure)) …slicer_bits(slicer)…
//     slicer_free(slicer);
//
// The kernels are the same for all formulas: they are built once, and then come from PoCL's cache as those of scenes do (runtime/program.h).
//
// A formula can also be compiled (compiler/formula_emit.h, SlicerDesc.code): kernels of its own, which draw the same picture in half the time and take
// seconds to build. Packages hold them (runtime/slice_package.h).
//
// prospero (7,866 operations), `bench-slice prospero.vm`: CPU ms, and wall ms of the best of 101 pictures with two threads on a machine that others
// were using, an Intel Xeon with AVX-512:
//
//                1024²          2048²          4096²
//     program    1.18 / 0.67    1.90 / 1.11    3.6 / 2.1
//     code       0.38 / 0.31    0.80 / 0.58    2.1 / 1.4      built in 11 s of CPU time, loaded from a package in 0.16 s
#ifndef SCN_RUNTIME_SLICE_H
#define SCN_RUNTIME_SLICE_H

#include "compiler/formula_emit.h"
#include "runtime/device.h"
#include "runtime/program.h"

#define SLICE_SIZE_MAX 32768

typedef struct SliceView {
    uint32_t width, height; // 1 … SLICE_SIZE_MAX
    double x0, x1, y0, y1;  // x0 < x1, y0 < y1, all within FORMULA_REACH
} SliceView;

typedef enum SliceHow {
    SLICE_TILES, // tiles by their ranges, then pixels
    SLICE_BRUTE, // each pixel by itself: what the other is compared with
} SliceHow;

typedef struct Slicer Slicer;

typedef struct SlicerDesc {
    bool no_cache;
    uint32_t pool; // steps that there is room for, of programs of tiles; 0: as many as are good
    // A formula that is compiled, in the place of slicer_program(): draws by tiles alone. With a binary for the device, from a package.
    const FormulaCode *code;
    const void *binary;
    size_t binary_size;
} SlicerDesc;

// NULL with `failure` set. The device is borrowed.
Slicer *slicer_new(Device *device, const SlicerDesc *desc, Failure *failure);
void slicer_free(Slicer *slicer); // NULL is nothing
const Program *slicer_built(const Slicer *slicer);

// The formula to draw from now on. Steps are copied.
bool slicer_program(Slicer *slicer, const FormulaSteps *steps, Failure *failure);

bool slicer_draw(Slicer *slicer, const SliceView *view, SliceHow how, Failure *failure);

// The picture: rows of `slicer_stride()` words of 16 pixels, the lowest bit the left one; bits beyond the width are 0. Until the next
// slicer_draw(). NULL with `failure` set.
const uint16_t *slicer_bits(Slicer *slicer, Failure *failure);
uint32_t slicer_stride(const Slicer *slicer);

// Pixels that are inside.
uint64_t slicer_count(const Slicer *slicer, const uint16_t *bits);

#endif
