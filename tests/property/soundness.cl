// What soundness.c asks of kernels/tape.cl and strip.cl: the functions that pictures are made with, one work-item for a tape and LANES of its CASES cases.
//
// A case is a lane. In every array the CASES numbers of one quantity stand together: PART of the quantity are this work-item's.

#define CASES 32
#define GROUPS (CASES / LANES)
#define PART(array, quantity) (((__global FLOAT *)(array))[(size_t)(quantity) * GROUPS + group])

__kernel void soundness(__global const TapeStep *steps, __global const uint *heads, __global const float *in, __global float *out, __global float *memory,
                        uint memory_size)
{
    uint item = (uint)get_global_id(0), number = item / GROUPS, group = item % GROUPS;
    Tape tape = {steps + heads[2 * number], heads[2 * number + 1], TAPE_POINT + heads[2 * number + 1] - 1u};
    __global FLOAT *room = (__global FLOAT *)(memory + (size_t)item * memory_size * LANES);
    in += (size_t)number * IN_COUNT * CASES;
    out += (size_t)number * OUT_COUNT * CASES;

    Range box[3], range;
    Doubt doubt;
    for (uint k = 0; k < 3; k++) box[k] = (Range){PART(in, IN_BOX + 2 * k), PART(in, IN_BOX + 2 * k + 1)};
    tape_range(&tape, box, room, &range, &doubt);
    PART(out, OUT_RANGE) = range.low;
    PART(out, OUT_RANGE + 1) = range.high;
    PART(out, OUT_RANGE + 2) = truth(doubt.maybe);
    PART(out, OUT_RANGE + 3) = truth(doubt.never);

    for (uint n = 0; n < POINTS; n++) {
        FLOAT point[3], value;
        for (uint k = 0; k < 3; k++) point[k] = PART(in, IN_POINTS + 3 * n + k);
        tape_value(&tape, point, room, &value);
        PART(out, OUT_VALUES + n) = value;
        if (n) continue;
        Gradient gradient;
        tape_gradient(&tape, point, room, &gradient);
        PART(out, OUT_GRADIENT) = gradient.x;
        PART(out, OUT_GRADIENT + 1) = gradient.y;
        PART(out, OUT_GRADIENT + 2) = gradient.z;
    }

    FLOAT o[3], e[3], p = PART(in, IN_RAY + 6), q = PART(in, IN_RAY + 7);
    Strip strip;
    for (uint k = 0; k < 3; k++) {
        o[k] = PART(in, IN_RAY + k);
        e[k] = PART(in, IN_RAY + 3 + k);
    }
    tape_strip(&tape, o, e, &p, &q, room, &strip, &doubt);
    PART(out, OUT_STRIP) = strip.p.low;
    PART(out, OUT_STRIP + 1) = strip.p.high;
    PART(out, OUT_STRIP + 2) = strip.q.low;
    PART(out, OUT_STRIP + 3) = strip.q.high;
    PART(out, OUT_STRIP + 4) = truth(doubt.maybe);
    PART(out, OUT_STRIP + 5) = truth(doubt.never);
}
