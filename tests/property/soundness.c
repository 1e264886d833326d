// Is a bound ever wrong? Random tapes of every operation over random boxes and pieces of rays: what the host (compiler/tape.h) and the device (kernels/tape.cl and strip.cl, the
// text that pictures are made with) say of them, against a third evaluation in long double.
//
//     scn-soundness [--points N] [--first SEED] [--width 1|16|32] [--verbose]
//
// N points are asked in boxes, and half as many on rays (200,000; a million by --points 1000000). What must hold, of each of them:
//
//     value       the true value is within the range of the box, on the host and on the device
//     undefined   what has no value is not said to be certainly inside; what has one is not said to have none
//     device      the device's value is within the device's range, the host's within the host's
//     piece       the true value at a place of the ray is within the strip over the piece, and at its beginning within the range there
//     gradient    of tapes of one step, the device's is the true one but for 1e-5 of its size
//     ulps        of tapes of one step, the device's value is as near to the true one as kernels/tape.cl says, and the middle of its range at a point is within
//                 20 units in the last place
//
// Where the long double cannot tell either (the side of a jump) nothing is asked; how often is printed. Fails (exit 1) on a single violation.
#include <CL/cl.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/tape.h"
#include "runtime/device.h"
#include "runtime/program.h"
#include "soundness_kernels.h"
#include "tests/property/soundness_cases.h"
#include "tests/property/soundness_truth.h"

enum {
    MIDDLE_UNITS = 20
}; // what is 1 at most is cut there on one side: half of the rounding that is allowed for noise
enum { BATCH = 64, MEMORY = (TAPE_POINT + STEPS) * 4 };

typedef enum Check {
    CHECK_VALUE_HOST,
    CHECK_VALUE_DEVICE,
    CHECK_UNDEFINED_HOST,
    CHECK_UNDEFINED_DEVICE,
    CHECK_OWN_HOST,
    CHECK_OWN_DEVICE,
    CHECK_PIECE,
    CHECK_BEGINNING,
    CHECK_GRADIENT,
    CHECK_ULPS,
    CHECK_MIDDLE,
    CHECKS
} Check;

static const char *const check_names[CHECKS] = {
    "value on the host",       "value on the device",  "undefined on the host",
    "undefined on the device", "host within its own",  "device within its own",
    "piece of a ray",          "beginning of a piece", "gradient",
    "ulps of an operation",    "ulps of a middle"};

typedef struct Counts {
    long asked[CHECKS], wrong[CHECKS];
    long points, unsettled, undefined, infinite;
    double ulps[TAPE_OPS], middle[TAPE_OPS]; // the most that was seen
    bool verbose;
} Counts;

typedef struct Batch {
    RandomTape tapes[BATCH];
    TapeStep baked[BATCH][STEPS];
    float *in, *out; // of each tape IN_COUNT, OUT_COUNT quantities of CASES numbers
} Batch;

// --- the device

typedef struct Gpu {
    Device *device;
    Program *program;
    cl_kernel kernel;
    cl_mem steps, heads, in, out, memory;
    int lanes;
} Gpu;

static char *kernel_text(size_t *length)
{
    char *text = NULL;
    FILE *out = open_memstream(&text, length);
    if (!out) abort();
    for (const soundness_kernels_file *file = soundness_kernels_files; file->name; file++)
        fwrite(file->text, 1, file->length, out);
    if (fclose(out)) abort();
    return text;
}

static cl_mem room(const Gpu *g, size_t size)
{
    cl_int status;
    cl_mem mem = clCreateBuffer(g->device->context, CL_MEM_READ_WRITE, size, NULL, &status);
    if (status != CL_SUCCESS) abort();
    return mem;
}

static bool gpu_open(Gpu *g, int width)
{
    Failure failure = {0};
    size_t length;
    cl_int status;
    char *text = kernel_text(&length);
    *g = (Gpu){.device = device_open(&(DeviceDesc){.choice = "cpu", .threads = 2}, &failure), .lanes = width};
    const char *options = width == 1    ? "-cl-std=CL1.2 -D WIDTH=1"
                          : width == 16 ? "-cl-std=CL1.2 -D WIDTH=16"
                                        : "-cl-std=CL1.2 -D WIDTH=16 -D PACKETS_SIDE_BY_SIDE=2";
    if (g->device)
        g->program =
            program_build(g->device, &(ProgramDesc){.source = text, .length = length, .options = options}, &failure);
    free(text);
    if (!g->program) return fprintf(stderr, "scn-soundness: %s\n", failure.text), false;
    g->kernel = clCreateKernel(g->program->cl, "soundness", &status);
    if (status != CL_SUCCESS) abort();
    cl_uint memory = MEMORY;
    g->steps = room(g, sizeof((Batch *)0)->baked);
    g->heads = room(g, BATCH * 2 * sizeof(cl_uint));
    g->in = room(g, sizeof(float) * BATCH * IN_COUNT * CASES);
    g->out = room(g, sizeof(float) * BATCH * OUT_COUNT * CASES);
    g->memory = room(g, sizeof(float) * BATCH * CASES * MEMORY);
    const cl_mem mems[] = {g->steps, g->heads, g->in, g->out, g->memory};
    for (cl_uint k = 0; k < 5; k++) clSetKernelArg(g->kernel, k, sizeof(cl_mem), &mems[k]);
    clSetKernelArg(g->kernel, 5, sizeof memory, &memory);
    return true;
}

static void gpu_close(Gpu *g)
{
    const cl_mem mems[] = {g->steps, g->heads, g->in, g->out, g->memory};
    for (int k = 0; k < 5; k++)
        if (mems[k]) clReleaseMemObject(mems[k]);
    if (g->kernel) clReleaseKernel(g->kernel);
    program_free(g->program);
    device_close(g->device);
}

static void gpu_run(const Gpu *g, Batch *b)
{
    cl_uint heads[BATCH][2];
    for (cl_uint k = 0; k < BATCH; k++) heads[k][0] = k * STEPS, heads[k][1] = b->tapes[k].count;
    size_t global = (size_t)BATCH * CASES / (size_t)g->lanes, local = 1;
    cl_command_queue q = g->device->queue;
    cl_int status = clEnqueueWriteBuffer(q, g->steps, CL_FALSE, 0, sizeof b->baked, b->baked, 0, NULL, NULL);
    status |= clEnqueueWriteBuffer(q, g->heads, CL_FALSE, 0, sizeof heads, heads, 0, NULL, NULL);
    status |=
        clEnqueueWriteBuffer(q, g->in, CL_FALSE, 0, sizeof(float) * BATCH * IN_COUNT * CASES, b->in, 0, NULL, NULL);
    status |= clEnqueueNDRangeKernel(q, g->kernel, 1, NULL, &global, &local, 0, NULL, NULL);
    status |=
        clEnqueueReadBuffer(q, g->out, CL_TRUE, 0, sizeof(float) * BATCH * OUT_COUNT * CASES, b->out, 0, NULL, NULL);
    if (status != CL_SUCCESS) fprintf(stderr, "scn-soundness: the device failed\n"), abort();
}

// --- checking

typedef struct Case {
    Counts *counts;
    const RandomTape *tape;
    const TapeStep *baked;
    const float *in, *out; // CASES apart
    double work[(TAPE_POINT + STEPS) * TAPE_WORK];
    const char *where; // for messages
    double place[3];
} Case;

static float in_of(const Case *c, uint32_t quantity)
{
    return c->in[quantity * CASES];
}

static float out_of(const Case *c, uint32_t quantity)
{
    return c->out[quantity * CASES];
}

static void print_tape(const Case *c)
{
    for (uint32_t k = 0; k < c->tape->count; k++) {
        TapeStep step = c->tape->steps[k];
        uint32_t op = TAPE_OP(step.word);
        printf("    v%u = %s%s v%u", TAPE_POINT + k, tape_op_names[TAPE_OP(step.word)],
               step.word & TAPE_LAZY ? " (lazy)" : "", TAPE_A(step.word));
        if (op == TAPE_NUMBER || step.word & TAPE_LITERAL)
            printf(" %.9g", c->tape->values[step.b]);
        else if (TAPE_TAKES_THREE(op))
            printf(" v%u v%u", step.b & 0xffff, step.b >> 16);
        else
            printf(" %d", (int)step.b);
        printf("\n");
    }
    printf("    box");
    for (uint32_t k = 0; k < 3; k++) printf(" [%.9g, %.9g]", in_of(c, IN_BOX + 2 * k), in_of(c, IN_BOX + 2 * k + 1));
    printf("\n    ray o");
    for (uint32_t k = 0; k < 8; k++) printf(" %.9g", in_of(c, IN_RAY + k));
    printf("\n");
}

// Counts a thing that was asked, and tells of the first few that are wrong.
static void expect(Case *c, Check check, bool good, double value, double low, double high)
{
    c->counts->asked[check]++;
    if (good) return;
    if (c->counts->wrong[check]++ >= (c->counts->verbose ? 20 : 2)) return;
    printf("wrong: %s at %.9g %.9g %.9g: %.12g is not in [%.12g, %.12g]\n", check_names[check], c->place[0],
           c->place[1], c->place[2], value, low, high);
    print_tape(c);
}

static bool holds(double low, double high, Pair f)
{
    return !((Real)low > f.high) && !((Real)high < f.low);
}

// A range, with what it says about being defined, against the truth of one point of it.
static void check_range(Case *c, Check value, Check undefined, const Truth *t, double low, double high, bool maybe,
                        bool never)
{
    switch (t->state) {
    case TRUTH_KNOWN:
        expect(c, undefined, !never, NAN, low, high);
        if (!never) expect(c, value, holds(low, high, t->f), (double)t->f.low, low, high);
        break;
    case TRUTH_UNDEFINED: expect(c, undefined, maybe || never, NAN, low, high); break;
    case TRUTH_INFINITE: expect(c, undefined, maybe || isinf(low) || isinf(high), INFINITY, low, high); break;
    case TRUTH_UNSETTLED: break;
    }
}

static double float_ulp(double x)
{
    int exponent;
    frexp(x, &exponent);
    return ldexp(1, (exponent < -125 ? -125 : exponent) - 24);
}

// What an operation's error is measured by: units in the last place of its result, but of a remainder, which is a difference, those of its greater operand;
// and a power's are those that its exponent in e has.
static double unit_of(const Case *c, const Truth *v, const Truth *t)
{
    uint32_t op = TAPE_OP(c->baked->word);
    double r = (double)t->f.low, unit = float_ulp(r);
    if (op == TAPE_MOD) unit = fmax(float_ulp((double)v[TAPE_A(c->baked->word)].f.low), unit);
    if (op == TAPE_LSE || op == TAPE_NOISE || op == TAPE_CELLS) unit = fmax(unit, float_ulp(1));
    if (op == TAPE_POW) unit *= fmax(1, fabs(log(fabs(r))));
    if (op == TAPE_POWER) unit *= fmax(1, fabs((double)(int32_t)c->baked->b));
    return unit;
}

// The second operand of a tape of one step.
static Real second_of(const Case *c, const Truth *v)
{
    float literal;
    memcpy(&literal, &c->baked->b, sizeof literal);
    return c->baked->word & TAPE_LITERAL ? literal : v[c->baked->b].f.low;
}

// The most units that an operation may be wrong by: the head of kernels/tape.cl has what was seen.
static double units_allowed(uint32_t op)
{
    switch (op) {
    case TAPE_ADD:
    case TAPE_SUB:
    case TAPE_BACK_SUB:
    case TAPE_MUL:
    case TAPE_SQUARE: return 0.5;
    case TAPE_DIV:
    case TAPE_BACK_DIV:
    case TAPE_SQRT:
    case TAPE_POWER:
    case TAPE_MOD: return 1;
    case TAPE_EXP:
    case TAPE_LOG:
    case TAPE_ASIN:
    case TAPE_ACOS:
    case TAPE_ATAN:
    case TAPE_ATAN2: return 1.5;
    case TAPE_SIN:
    case TAPE_COS:
    case TAPE_POW:
    case TAPE_LSE: return 2;
    case TAPE_NOISE:
    case TAPE_CELLS:
    case TAPE_TAN: return 4;
    default: return 0;
    }
}

static void check_units(Case *c, const Truth *v, const Truth *t, float value)
{
    uint32_t op = TAPE_OP(c->baked->word);
    if (c->tape->count != 1 || t->state != TRUTH_KNOWN || !t->ordinary || op == TAPE_NUMBER) return;
    if ((op == TAPE_SIN || op == TAPE_COS || op == TAPE_TAN) && fabsl(v[TAPE_A(c->baked->word)].f.low) > 1e4L) return;
    if ((double)(t->f.high - t->f.low) > 1e-3 * unit_of(c, v, t)) return;
    double off = fabs((double)((Real)value - t->f.low));
    if (op == TAPE_MOD) off = fmin(off, fabs(fabs((double)second_of(c, v)) - off)); // on the other side of the jump
    off /= unit_of(c, v, t);
    if (off > c->counts->ulps[op]) c->counts->ulps[op] = off;
    expect(c, CHECK_ULPS, off <= units_allowed(op) * 1.001, value, (double)t->f.low, (double)t->f.high);
    for (uint32_t k = 0; k < 3; k++)
        if (in_of(c, IN_BOX + 2 * k) != in_of(c, IN_BOX + 2 * k + 1)) return;
    double middle = 0.5 * ((double)out_of(c, OUT_RANGE) + (double)out_of(c, OUT_RANGE + 1));
    if (!isfinite(middle)) return;
    off = fabs(middle - (double)t->f.low) / unit_of(c, v, t);
    if (op == TAPE_MOD) return; // both sides of the jump
    if (off > c->counts->middle[op]) c->counts->middle[op] = off;
    expect(c, CHECK_MIDDLE, off <= MIDDLE_UNITS, middle, (double)t->f.low, (double)t->f.high);
}

static void check_point(Case *c, uint32_t n, Interval host)
{
    Truth v[TAPE_POINT + STEPS];
    bool maybe = out_of(c, OUT_RANGE + 2) != 0, never = out_of(c, OUT_RANGE + 3) != 0;
    float low = out_of(c, OUT_RANGE), high = out_of(c, OUT_RANGE + 1), value = out_of(c, OUT_VALUES + n);
    for (uint32_t k = 0; k < 3; k++) {
        c->place[k] = in_of(c, IN_POINTS + 3 * n + k);
        v[k] = truth_number(c->place[k], 0);
    }
    Truth t = truth_of(c->baked, c->tape->count, v);
    c->counts->points++;
    c->counts->unsettled += t.state == TRUTH_UNSETTLED;
    c->counts->undefined += t.state == TRUTH_UNDEFINED;
    c->counts->infinite += t.state == TRUTH_INFINITE;
    check_range(c, CHECK_VALUE_HOST, CHECK_UNDEFINED_HOST, &t, host.low, host.high, host.partial,
                interval_is_empty(host));
    check_range(c, CHECK_VALUE_DEVICE, CHECK_UNDEFINED_DEVICE, &t, low, high, maybe, never);
    double own = tape_steps_at(c->tape->steps, c->tape->count, c->tape->values, c->place, c->work).f;
    if (isnan(own))
        expect(c, CHECK_OWN_HOST, host.partial || interval_is_empty(host) || !t.ordinary, own, host.low, host.high);
    else
        expect(c, CHECK_OWN_HOST, !interval_is_empty(host) && own >= host.low && own <= host.high, own, host.low,
               host.high);
    if (isnan(value))
        expect(c, CHECK_OWN_DEVICE, maybe || never || !t.ordinary || t.state == TRUTH_UNSETTLED, value, low, high);
    else
        expect(c, CHECK_OWN_DEVICE, (!never || !t.ordinary) && value >= low && value <= high, value, low, high);
    check_units(c, v, &t, value);
}

// At the first point, of operations alone, away from where floats end.
static void check_gradient(Case *c)
{
    double gradient[3], size = 0;
    if (c->tape->count != 1) return;
    for (uint32_t k = 0; k < 3; k++) {
        Truth v[TAPE_POINT + STEPS];
        for (uint32_t i = 0; i < 3; i++) {
            c->place[i] = in_of(c, IN_POINTS + i);
            if (fabs(c->place[i]) > 1e12) return;
            v[i] = truth_number(c->place[i], i == k);
        }
        Truth t = truth_of(c->baked, c->tape->count, v);
        if (t.state != TRUTH_KNOWN || !t.smooth || !t.ordinary) return;
        gradient[k] = (double)(t.d.low + t.d.high) / 2;
        size = fmax(size, fabs(gradient[k]));
        if (!(t.d.high - t.d.low <= 1e-6L * fabsl(t.d.low))) return;
    }
    if (!(size > 1e-30 && size < 1e30)) return;
    if (TAPE_TAKES_THREE(TAPE_OP(c->baked->word))) size = fmax(size, 1); // sums of what is about 1
    for (uint32_t k = 0; k < 3; k++) {
        double got = out_of(c, OUT_GRADIENT + k);
        expect(c, CHECK_GRADIENT, fabs(got - gradient[k]) <= 1e-5 * size, got, gradient[k], gradient[k]);
    }
}

// The line from a to b, which are `share` of it apart from a, and what rounding makes of it.
static Pair line_at(float a, float b, Real share)
{
    Real at = share == 0 || a == b ? a : isinf(a) ? a : isinf(b) ? b : a + share * ((Real)b - a);
    Real margin = 4 * (Real)DBL_EPSILON * (fabsl((Real)a) + fabsl((Real)b));
    return isinf(at) ? (Pair){at, at} : (Pair){at - margin, at + margin};
}

static void check_piece(Case *c, Random *r)
{
    float p = in_of(c, IN_RAY + 6), q = in_of(c, IN_RAY + 7), strip[6];
    for (uint32_t k = 0; k < 6; k++) strip[k] = out_of(c, OUT_STRIP + k);
    for (int n = 0; n < POINTS / 2; n++) {
        Truth v[TAPE_POINT + STEPS];
        float s = n ? random_float(r, p, q) : p;
        for (uint32_t k = 0; k < 3; k++) {
            v[k] = truth_ahead(in_of(c, IN_RAY + k), in_of(c, IN_RAY + 3 + k), s);
            c->place[k] = (double)v[k].f.low;
        }
        Truth t = truth_of(c->baked, c->tape->count, v);
        Real share = q > p ? ((Real)s - p) / ((Real)q - p) : 0;
        Pair low = line_at(strip[0], strip[2], share), high = line_at(strip[1], strip[3], share);
        check_range(c, n ? CHECK_PIECE : CHECK_BEGINNING, CHECK_UNDEFINED_DEVICE, &t, (double)low.low,
                    (double)high.high, strip[4] != 0, strip[5] != 0);
    }
}

static void check_tape(const Batch *b, uint32_t number, Counts *counts, Random *r)
{
    for (uint32_t lane = 0; lane < CASES; lane++) {
        Case c = {.counts = counts,
                  .tape = &b->tapes[number],
                  .baked = b->baked[number],
                  .in = b->in + (size_t)number * IN_COUNT * CASES + lane,
                  .out = b->out + (size_t)number * OUT_COUNT * CASES + lane};
        Interval box[3];
        for (uint32_t k = 0; k < 3; k++) box[k] = interval_of(in_of(&c, IN_BOX + 2 * k), in_of(&c, IN_BOX + 2 * k + 1));
        Interval host = tape_steps_over(c.tape->steps, c.tape->count, c.tape->values, box, c.work);
        for (uint32_t n = 0; n < POINTS; n++) check_point(&c, n, host);
        check_gradient(&c);
        check_piece(&c, r);
    }
}

// --- the program

static void fill(Batch *b, Random *r, uint64_t number)
{
    for (uint32_t k = 0; k < BATCH; k++) { // one in three is an operation alone, each of them in turn
        uint32_t op = k % 3 ? TAPE_OPS : (uint32_t)((number * BATCH + k) / 3 % TAPE_OPS);
        b->tapes[k] = random_tape(r, op);
        tape_bake(b->tapes[k].steps, b->tapes[k].count, b->tapes[k].values, b->baked[k]);
        for (uint32_t lane = 0; lane < CASES; lane++) random_case(r, b->in + (size_t)k * IN_COUNT * CASES + lane);
    }
}

static bool print_counts(const Counts *c)
{
    bool good = true;
    printf("%ld points: %ld undefined, %ld infinite, %ld that long doubles do not settle\n", c->points, c->undefined,
           c->infinite, c->unsettled);
    for (int k = 0; k < CHECKS; k++) {
        printf("  %-24s %9ld asked, %ld wrong\n", check_names[k], c->asked[k], c->wrong[k]);
        good &= c->asked[k] && !c->wrong[k];
    }
    if (!c->verbose) return good;
    printf("  units in the last place, the most that was seen: of the device's value, of the middle of its range\n");
    for (int op = 1; op < (int)TAPE_OPS; op++)
        printf("    %-9s %8.3f %8.3f\n", tape_op_names[op], c->ulps[op], c->middle[op]);
    return good;
}

int main(int argc, char **argv)
{
    long points = 200000;
    int width = 32;
    Random r = {1};
    Counts counts = {0};
    for (int k = 1; k < argc; k++) {
        if (!strcmp(argv[k], "--verbose"))
            counts.verbose = true;
        else if (!strcmp(argv[k], "--points") && k + 1 < argc)
            points = atol(argv[++k]);
        else if (!strcmp(argv[k], "--first") && k + 1 < argc)
            r.state = strtoull(argv[++k], NULL, 10);
        else if (!strcmp(argv[k], "--width") && k + 1 < argc)
            width = atoi(argv[++k]);
        else
            points = 0;
    }
    if (points < 1 || (width != 1 && width != 16 && width != 32)) {
        fprintf(stderr, "usage: scn-soundness [--points N] [--first SEED] [--width 1|16|32] [--verbose]\n");
        return 2;
    }
    Gpu gpu;
    Batch *batch = calloc(1, sizeof *batch);
    if (!batch) abort();
    batch->in = calloc((size_t)BATCH * IN_COUNT * CASES, sizeof(float));
    batch->out = calloc((size_t)BATCH * OUT_COUNT * CASES, sizeof(float));
    if (!batch->in || !batch->out) abort();
    bool good = gpu_open(&gpu, width);
    for (uint64_t number = 0; good && counts.points < points; number++) {
        fill(batch, &r, number);
        gpu_run(&gpu, batch);
        for (uint32_t k = 0; k < BATCH; k++) check_tape(batch, k, &counts, &r);
    }
    good = good && print_counts(&counts);
    gpu_close(&gpu);
    free(batch->in), free(batch->out), free(batch);
    return good ? 0 : 1;
}
