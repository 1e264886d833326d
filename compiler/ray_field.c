// The first change of sign along a ray of objects with general fields.
//
// The field program is run with what its values may be over a piece of the ray. The coordinates of a piece are intervals;
// quadrics and the quadrics of perturbations are polynomials of degree 2 there, whose range is exact but for rounding. What
// is undefined is outside, so a range knows whether that may be, and a union ignores it where the other part has a
// value.
//
// Pieces of twice the length follow each other from the start of the ray, and each is halved from its near side on until
// its sign is certain, or until it is too short or too much has been looked at: then the sign in its middle decides.
#include <float.h>
#include <math.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/quadric.h"
#include "compiler/ray.h"
#include "compiler/tape.h"

enum { HALVINGS_MAX = 48, LOOKS_MAX = 1 << 16 }; // per ray

typedef struct Line { // the ray in the coordinates of the maps around
    double point[3], direction[3];
} Line;

typedef struct Ray {
    FieldCode code;
    const double *values;
    Line line;
    Arena scratch;
    Interval *stack;
    Line *lines;
    double *work;
    uint32_t looks;
    int start;   // the sign it began with, 0: not known yet
    double sure; // up to here it is the same
} Ray;

// --- the range over a piece

// The coordinates of a piece. Its ends are rounded to numbers beyond what they are.
static void box_of(const Line *line, double a, double b, Interval box[3])
{
    Interval t = interval_of(a, b);
    for (int k = 0; k < 3; k++) {
        Interval d = interval_of(line->direction[k], line->direction[k]);
        Interval o = interval_of(line->point[k], line->point[k]);
        box[k] = interval_op2(TAPE_ADD, o, interval_op2(TAPE_MUL, t, d));
    }
}

// q along the line is p[0] + p[1] t + p[2] t². What rounding may make of it is far below 64 units in the last place of
// its terms' sizes.
static Interval quadric_over(const double q[10], const Line *line, double a, double b)
{
    const double *o = line->point, *d = line->direction;
    double reach = 0, size = fabs(q[9]), gradient[3], p[3] = {quadric_at(q, o), 0, 0};
    for (int k = 0; k < 3; k++) reach = fmax(reach, fabs(o[k]) + fabs(d[k]) * b);
    for (int k = 0; k < 9; k++) size += fabs(q[k]) * (k < 6 ? reach * reach : reach);
    quadric_gradient(q, o, gradient);
    for (int k = 0; k < 3; k++) p[1] += gradient[k] * d[k];
    p[2] = q[0] * d[0] * d[0] + q[1] * d[1] * d[1] + q[2] * d[2] * d[2] + q[3] * d[0] * d[1] + q[4] * d[0] * d[2] +
           q[5] * d[1] * d[2];
    double at_a = p[0] + a * (p[1] + a * p[2]), at_b = p[0] + b * (p[1] + b * p[2]);
    double low = fmin(at_a, at_b), high = fmax(at_a, at_b), peak = -p[1] / (2 * p[2]);
    if (peak > a && peak < b) {
        double at_peak = p[0] + peak * (p[1] + peak * p[2]);
        low = fmin(low, at_peak);
        high = fmax(high, at_peak);
    }
    double noise = 64 * DBL_EPSILON * size;
    if (isnan(low) || isnan(high) || isnan(noise)) return interval_of(-INFINITY, INFINITY);
    return interval_of(low - noise, high + noise);
}

// Undefined parts are outside: the union is what the others make of it.
static Interval max_over(Interval a, Interval b)
{
    if (interval_is_empty(a)) return b;
    if (interval_is_empty(b)) return a;
    double low = a.partial ? (b.partial ? fmin(a.low, b.low) : b.low) : b.partial ? a.low : fmax(a.low, b.low);
    return (Interval){low, fmax(a.high, b.high), a.partial && b.partial};
}

static Interval min_over(Interval a, Interval b)
{
    if (interval_is_empty(a) || interval_is_empty(b)) return interval_empty();
    return (Interval){fmin(a.low, b.low), fmin(a.high, b.high), a.partial || b.partial};
}

static Interval cube_over(Interval q, double strength, double grow)
{
    Interval zero = interval_of(0, 0);
    q = interval_op2(TAPE_MAX, interval_op2(TAPE_ADD, q, interval_of(grow, grow)), zero);
    return interval_op2(TAPE_MUL, interval_power(q, 3), interval_of(strength, strength));
}

static Interval mix_over(Interval a, Interval b, Interval t)
{
    Interval one = interval_of(1, 1);
    if (t.high <= 0) return a;
    if (t.low >= 1) return b;
    if (a.low == -INFINITY || b.low == -INFINITY || a.high == INFINITY || b.high == INFINITY)
        return (Interval){-INFINITY, INFINITY, a.partial || b.partial || t.partial};
    Interval rest = interval_op2(TAPE_SUB, one, t);
    Interval sum = interval_op2(TAPE_ADD, interval_op2(TAPE_MUL, rest, a), interval_op2(TAPE_MUL, t, b));
    sum.partial = a.partial || b.partial || t.partial; // where t is 0 or 1 less is undefined, which is no matter
    return sum;
}

static Interval weight_over(Interval t)
{
    if (interval_is_empty(t)) return t;
    return (Interval){fmin(fmax(t.low, 0), 1), fmin(fmax(t.high, 0), 1), t.partial};
}

static void enter(const double m[12], const Line *outer, Line *inner)
{
    matrix_point(m, outer->point, inner->point);
    for (int i = 0; i < 3; i++) {
        inner->direction[i] = 0;
        for (int k = 0; k < 3; k++) inner->direction[i] += m[4 * i + k] * outer->direction[k];
    }
}

static Interval tape_range(Ray *r, const uint32_t *words, const Line *line, double a, double b)
{
    Interval box[3];
    box_of(line, a, b, box);
    return tape_steps_over((const TapeStep *)(words + 1), words[0], r->values, box, r->work);
}

static Interval range_over(Ray *r, double a, double b)
{
    Interval *top = r->stack;
    Line *line = r->lines;
    const double *values = r->values;
    *line = r->line;
    for (const uint32_t *w = r->code.words; w < r->code.words + r->code.count;) {
        switch ((FieldOp)*w++) {
        case FIELD_QUADRIC: *++top = quadric_over(values + *w++, line, a, b); break;
        case FIELD_EMPTY: *++top = interval_of(-INFINITY, -INFINITY); break;
        case FIELD_MAX:
            top--;
            *top = max_over(top[0], top[1]);
            break;
        case FIELD_MIN:
            top--;
            *top = min_over(top[0], top[1]);
            break;
        case FIELD_NEGATE:
            if (!interval_is_empty(*top)) *top = (Interval){-top->high, -top->low, top->partial};
            break;
        case FIELD_CUBE:
            top--;
            *top = interval_op2(TAPE_ADD, top[0], cube_over(top[1], values[w[0]], values[w[1]]));
            w += 2;
            break;
        case FIELD_SHOW:
            if (values[*w++] == 0) *top = interval_of(-INFINITY, -INFINITY);
            break;
        case FIELD_MIX:
            top--;
            *top = mix_over(top[0], top[1], interval_of(values[*w], values[*w]));
            w++;
            break;
        case FIELD_MIX_AT:
            top -= 2;
            *top = mix_over(top[0], top[1], weight_over(top[2]));
            break;
        case FIELD_TAPE:
            *++top = tape_range(r, w, line, a, b);
            w += 1 + 2 * w[0];
            break;
        case FIELD_ENTER:
            enter(values + *w++, line, line + 1);
            line++;
            break;
        case FIELD_LEAVE: line--; break;
        }
    }
    return *top;
}

// --- the search

static int sign_at(const Ray *r, double t)
{
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = r->line.point[k] + t * r->line.direction[k];
    return field_at(r->code, r->values, p).f >= 0 ? 1 : -1; // what is undefined is outside
}

static int certain_sign(Interval f)
{
    if (interval_is_empty(f) || f.high < 0) return -1;
    return f.low >= 0 && !f.partial ? 1 : 0;
}

// Whether the sign changes between a and b; then `sure` is where.
static bool changes(Ray *r, double a, double b, int depth)
{
    int sign = certain_sign(range_over(r, a, b));
    double middle = a + (b - a) / 2;
    if (!sign && depth < HALVINGS_MAX && r->looks++ < LOOKS_MAX)
        return changes(r, a, middle, depth + 1) || changes(r, middle, b, depth + 1);
    if (!sign) sign = sign_at(r, middle);
    if (!r->start) r->start = sign;
    if (sign != r->start) return true;
    r->sure = b;
    return false;
}

static uint32_t longest_tape(FieldCode code)
{
    uint32_t most = 0;
    for (uint32_t k = 0; k < code.count; k = field_after(code, k))
        if (code.words[k] == FIELD_TAPE && code.words[k + 1] > most) most = code.words[k + 1];
    return most;
}

bool ray_first_general(FieldCode code, const double *values, const double from[3], const double direction[3], double *t)
{
    Ray ray = {.code = code, .values = values};
    double length = hypot(hypot(direction[0], direction[1]), direction[2]);
    double away = hypot(hypot(from[0], from[1]), from[2]), end = (away + 2 * TAPE_REACH) / length;
    if (!(length > 0) || !isfinite(end)) return false;
    memcpy(ray.line.point, from, sizeof ray.line.point);
    memcpy(ray.line.direction, direction, sizeof ray.line.direction);
    ray.stack = arena_array(&ray.scratch, Interval, FIELD_STACK_MAX + 1);
    ray.lines = arena_array(&ray.scratch, Line, FIELD_POINTS_MAX + 1);
    ray.work = arena_array(&ray.scratch, double, TAPE_WORK *(size_t)(TAPE_POINT + longest_tape(code)));
    bool found = false;
    for (double a = 0, b = 1; a < end && !found; a = b, b *= 2) found = changes(&ray, a, b, 0);
    *t = ray.sure;
    arena_release(&ray.scratch);
    return found;
}
