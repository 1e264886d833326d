// General fields, in double: an expression of the IR at a point with its gradient, and along a ray the places where its sign can change.
//
// The places are found by intervals: a stretch of the ray on which F has one sign, or is undefined throughout, is left alone; any other is halved until it
// is as short as doubles can tell. A shortest stretch at whose ends the signs differ is a place. Nothing is sampled, so nothing is missed but what touches
// zero within that length. The operations are written here a second time, with their own intervals: nothing is the compiler's.
#include "tests/oracle/oracle.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/oracle/internal.h"
#include "tests/oracle/oracle_noise.h"

#define REACH 65536.0 // fields end there, in their own coordinates
enum { BUDGET = 400000 };

struct OracleExpression {
    const Oracle *oracle;
    struct OracleExpression *next; // of all the oracle's
    IrId field;
    IrId *nodes; // of point rate, operands first
    uint32_t count;
    OraclePoint *points; // by node of the IR, while it is evaluated
    OracleSpan *spans;
};

// -- making ---------------------------------------------------------------------------------------------------------------------

OracleExpression *oracle_expression_new(Oracle *oracle, IrId field)
{
    for (OracleExpression *known = oracle->expressions; known; known = known->next) {
        if (known->field == field) return known;
    }
    const Ir *ir = oracle->ir;
    IrId root = ir_operand(ir, field, 0);
    OracleExpression *e = calloc(1, sizeof *e);
    bool *reached = calloc(root + 1, sizeof *reached);
    if (!e || !reached) abort();
    e->oracle = oracle;
    e->field = field;
    e->next = oracle->expressions;
    oracle->expressions = e;
    e->nodes = calloc(root + 1, sizeof *e->nodes);
    e->points = calloc(root + 1, sizeof *e->points);
    e->spans = calloc(root + 1, sizeof *e->spans);
    if (!e->nodes || !e->points || !e->spans) abort();
    reached[root] = true;
    for (IrId id = root; id > 0; id--) {
        for (uint32_t k = 0; reached[id] && ir_at(ir, id)->rate == RATE_POINT && k < ir_at(ir, id)->count; k++)
            reached[ir_operand(ir, id, k)] = true;
    }
    for (IrId id = 1; id <= root; id++) {
        if (!reached[id]) continue;
        if (ir_at(ir, id)->rate == RATE_POINT) {
            e->nodes[e->count++] = id;
            continue;
        }
        double value = oracle->scalars[id];
        e->points[id] = (OraclePoint){.f = value};
        e->spans[id] = (OracleSpan){value, value, false};
    }
    if (!e->count || e->nodes[e->count - 1] != root) e->nodes[e->count++] = root; // a number
    free(reached);
    return e;
}

void oracle_expressions_free(Oracle *oracle)
{
    while (oracle->expressions) {
        OracleExpression *e = oracle->expressions;
        oracle->expressions = e->next;
        free(e->nodes);
        free(e->points);
        free(e->spans);
        free(e);
    }
}

// -- points ---------------------------------------------------------------------------------------------------------------------

static OraclePoint combine(double f, const OraclePoint *a, double by_a, const OraclePoint *b, double by_b)
{
    OraclePoint r = {.f = f};
    for (int k = 0; k < 3; k++)
        r.g[k] = (a->g[k] == 0 ? 0 : by_a * a->g[k]) + (!b || b->g[k] == 0 ? 0 : by_b * b->g[k]);
    return r;
}

static double noise_value(IrOp op, const double p[3], long double slopes[3])
{
    long double place[3] = {p[0], p[1], p[2]};
    bool alone;
    return (double)(op == OP_NOISE ? oracle_noise(place, slopes) : oracle_cells(place, slopes, &alone));
}

static OraclePoint noise_of(IrOp op, const OraclePoint *a, const OraclePoint *b, const OraclePoint *c)
{
    const double place[3] = {a->f, b->f, c->f};
    long double slopes[3];
    if (!isfinite(a->f) || !isfinite(b->f) || !isfinite(c->f)) return (OraclePoint){.f = NAN};
    double f = noise_value(op, place, slopes);
    OraclePoint r = combine(f, a, (double)slopes[0], b, (double)slopes[1]);
    for (int k = 0; k < 3; k++) r.g[k] += c->g[k] == 0 ? 0 : (double)slopes[2] * c->g[k];
    return r;
}

static OraclePoint point_of(IrOp op, const OraclePoint *a, const OraclePoint *b, const OraclePoint *c)
{
    static const OraclePoint undefined = {.f = NAN};
    double f = a->f, g = b ? b->f : 0;
    if (isnan(f)) return undefined;
    if (op == OP_SELECT) return f != 0 ? *b : *c;
    if (op == OP_NOISE || op == OP_CELLS) return noise_of(op, a, b, c);
    if (op == OP_AND && f == 0) return (OraclePoint){.f = 0};
    if (op == OP_OR && f != 0) return (OraclePoint){.f = 1};
    if (isnan(g)) return undefined;
    switch (op) {
    case OP_ADD: return combine(f + g, a, 1, b, 1);
    case OP_SUB: return combine(f - g, a, 1, b, -1);
    case OP_MUL: return combine(f * g, a, g, b, f);
    case OP_DIV: return combine(f / g, a, 1 / g, b, -f / (g * g));
    case OP_NEG: return combine(-f, a, -1, NULL, 0);
    case OP_ABS: return combine(fabs(f), a, f < 0 ? -1 : 1, NULL, 0);
    case OP_MIN: return g < f ? *b : *a;
    case OP_MAX: return g > f ? *b : *a;
    case OP_MOD: return combine(f - g * floor(f / g), a, 1, b, -floor(f / g));
    case OP_POW: return combine(pow(f, g), a, g == 0 ? 0 : g * pow(f, g - 1), b, f > 0 ? pow(f, g) * log(f) : 0);
    case OP_SQRT: return combine(sqrt(f), a, 0.5 / sqrt(f), NULL, 0);
    case OP_EXP: return combine(exp(f), a, exp(f), NULL, 0);
    case OP_LOG: return combine(log(f), a, 1 / f, NULL, 0);
    case OP_SIN: return combine(sin(f), a, cos(f), NULL, 0);
    case OP_COS: return combine(cos(f), a, -sin(f), NULL, 0);
    case OP_TAN: return combine(tan(f), a, 1 + tan(f) * tan(f), NULL, 0);
    case OP_ASIN: return combine(asin(f), a, 1 / sqrt(1 - f * f), NULL, 0);
    case OP_ACOS: return combine(acos(f), a, -1 / sqrt(1 - f * f), NULL, 0);
    case OP_ATAN: return combine(atan(f), a, 1 / (1 + f * f), NULL, 0);
    case OP_ATAN2: return combine(atan2(f, g), a, g / (f * f + g * g), b, -f / (f * f + g * g));
    case OP_FLOOR: return (OraclePoint){.f = floor(f)};
    case OP_CEIL: return (OraclePoint){.f = ceil(f)};
    case OP_ROUND: return (OraclePoint){.f = round(f)};
    case OP_SIGN: return (OraclePoint){.f = (f > 0) - (f < 0)};
    case OP_LT: return (OraclePoint){.f = f < g};
    case OP_LE: return (OraclePoint){.f = f <= g};
    case OP_EQ: return (OraclePoint){.f = f == g};
    case OP_AND:
    case OP_OR: return (OraclePoint){.f = g != 0};
    case OP_NOT: return (OraclePoint){.f = f == 0};
    default: return undefined;
    }
}

double oracle_expression_at(OracleExpression *e, const double point[3], double gradient[3])
{
    const Ir *ir = e->oracle->ir;
    IrId id = 0;
    for (uint32_t k = 0; k < e->count; k++) {
        id = e->nodes[k];
        IrOp op = (IrOp)ir_at(ir, id)->op;
        uint32_t count = ir_at(ir, id)->count;
        if (op == OP_X || op == OP_Y || op == OP_Z) {
            e->points[id] = (OraclePoint){.f = point[op - OP_X]};
            e->points[id].g[op - OP_X] = 1;
        } else if (ir_at(ir, id)->rate == RATE_POINT) {
            const IrId *o = ir_operands(ir, id);
            e->points[id] = point_of(op, &e->points[o[0]], count > 1 ? &e->points[o[1]] : NULL,
                                     count > 2 ? &e->points[o[2]] : NULL);
        }
    }
    if (gradient) memcpy(gradient, e->points[id].g, 3 * sizeof *gradient);
    for (int k = 0; k < 3; k++) {
        if (fabs(point[k]) > REACH) return -ORACLE_INFINITY;
    }
    double f = e->points[id].f;
    return isnan(f) ? -ORACLE_INFINITY : fmax(fmin(f, ORACLE_INFINITY), -ORACLE_INFINITY);
}

// -- spans ----------------------------------------------------------------------------------------------------------------------

static OracleSpan grown(double low, double high)
{
    double by = 8 * DBL_EPSILON;
    if (isnan(low)) low = -INFINITY;
    if (isnan(high)) high = INFINITY;
    return (OracleSpan){low - by * fabs(low) - DBL_MIN, high + by * fabs(high) + DBL_MIN, false};
}

static OracleSpan anything(void)
{
    return (OracleSpan){-INFINITY, INFINITY, true};
}

static OracleSpan nothing(void)
{
    return (OracleSpan){INFINITY, -INFINITY, true};
}

static bool holds_zero(OracleSpan a)
{
    return a.low <= 0 && a.high >= 0;
}

static OracleSpan times(OracleSpan a, OracleSpan b)
{
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < 4; k++) {
        double x = k & 1 ? a.high : a.low, y = k & 2 ? b.high : b.low, p = x == 0 || y == 0 ? 0 : x * y;
        low = fmin(low, p);
        high = fmax(high, p);
    }
    return grown(low, high);
}

static OracleSpan over(OracleSpan a, OracleSpan b)
{
    if (holds_zero(b) || !isfinite(b.low) || !isfinite(b.high)) return anything();
    return times(a, grown(1 / b.high, 1 / b.low));
}

static OracleSpan between(double f(double), OracleSpan a)
{
    return grown(f(a.low), f(a.high));
}

// A function defined on low … high that rises there.
static OracleSpan cut(double f(double), OracleSpan a, double low, double high)
{
    if (a.high < low || a.low > high) return nothing();
    OracleSpan r = between(f, (OracleSpan){fmax(a.low, low), fmin(a.high, high), false});
    r.partial = a.low < low || a.high > high;
    return r;
}

static OracleSpan wave(OracleSpan a) // the sine
{
    if (!(a.high - a.low < 6.2) || !(fabs(a.low) + fabs(a.high) < 1e8)) return (OracleSpan){-1, 1, false};
    OracleSpan r = grown(fmin(sin(a.low), sin(a.high)), fmax(sin(a.low), sin(a.high)));
    double first = (a.low - M_PI_2) / (2 * M_PI), last = (a.high - M_PI_2) / (2 * M_PI);
    if (floor(last + 1e-12) >= ceil(first - 1e-12)) r.high = 1;
    if (floor(last + 0.5 + 1e-12) >= ceil(first + 0.5 - 1e-12)) r.low = -1;
    return r;
}

static OracleSpan power(OracleSpan a, OracleSpan b)
{
    if (b.low == b.high && b.low == floor(b.low) && fabs(b.low) < 4096) {
        int n = abs((int)b.low);
        double p = pow(a.low, n), q = pow(a.high, n);
        OracleSpan r = grown(fmin(p, q), fmax(p, q));
        if (n % 2 == 0 && holds_zero(a)) r.low = n ? 0 : 1;
        return b.low < 0 ? over((OracleSpan){1, 1, false}, r) : r;
    }
    if (a.high < 0) return b.low == b.high ? nothing() : anything();
    if (a.low < 0) {
        if (b.low != b.high || b.low < 0) return anything();
        return (OracleSpan){0, grown(0, pow(a.high, b.low)).high, true};
    }
    if (a.low == 0 && b.low <= 0) return anything();
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < 4; k++) {
        double p = pow(k & 1 ? a.high : a.low, k & 2 ? b.high : b.low);
        low = fmin(low, p);
        high = fmax(high, p);
    }
    if (b.low <= 0 && b.high >= 0) low = fmin(low, 1), high = fmax(high, 1);
    return grown(low, high);
}

static OracleSpan steps(double f(double), OracleSpan a)
{
    return (OracleSpan){f(a.low), f(a.high), false};
}

static double sign_of(double x)
{
    return (x > 0) - (x < 0);
}

static OracleSpan truth(bool no, bool yes)
{
    return (OracleSpan){no ? 0 : 1, yes ? 1 : 0, false};
}

static OracleSpan modulo(OracleSpan a, OracleSpan b)
{
    if (holds_zero(b)) return anything();
    OracleSpan q = over(a, b);
    if (floor(q.low) != floor(q.high)) return (OracleSpan){fmin(b.low, 0), fmax(b.high, 0), false};
    OracleSpan whole = times((OracleSpan){floor(q.low), floor(q.low), false}, b);
    return grown(a.low - whole.high, a.high - whole.low);
}

static OracleSpan angle(OracleSpan y, OracleSpan x)
{
    if (x.low <= 0 && holds_zero(y)) return (OracleSpan){-3.1416, 3.1416, false};
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < 4; k++) {
        double p = atan2(k & 1 ? y.high : y.low, k & 2 ? x.high : x.low);
        low = fmin(low, p);
        high = fmax(high, p);
    }
    return grown(low, high);
}

// Noise is nowhere steeper than 4 along an axis, a distance than 1.
static OracleSpan noise_over(IrOp op, const OracleSpan place[3])
{
    double middle[3], away = 1e-15, low = op == OP_NOISE ? -1 : 0;
    long double slopes[3];
    bool partial = false;
    for (int k = 0; k < 3; k++) {
        if (place[k].low > place[k].high) return nothing();
        middle[k] = place[k].low + (place[k].high - place[k].low) / 2;
        away += (op == OP_NOISE ? 4 : 1) * (place[k].high - place[k].low) / 2;
        partial |= place[k].partial || isinf(place[k].low) || isinf(place[k].high);
    }
    if (!(away < 2)) return (OracleSpan){low, 1, partial};
    double f = noise_value(op, middle, slopes);
    return (OracleSpan){fmax(f - away, low), fmin(f + away, 1), partial};
}

static OracleSpan span_of(IrOp op, OracleSpan a, OracleSpan b, OracleSpan c)
{
    if (a.low > a.high) return nothing();
    bool no = holds_zero(a), yes = a.low != 0 || a.high != 0, other_no = holds_zero(b),
         other_yes = b.low != 0 || b.high != 0;
    if (op == OP_SELECT) {
        if (!no) return b;
        if (!yes || b.low > b.high) return yes ? (OracleSpan){c.low, c.high, true} : c;
        return c.low > c.high ? (OracleSpan){b.low, b.high, true}
                              : (OracleSpan){fmin(b.low, c.low), fmax(b.high, c.high), b.partial || c.partial};
    }
    if (op == OP_NOISE || op == OP_CELLS) return noise_over(op, (const OracleSpan[3]){a, b, c});
    if (b.low > b.high && op != OP_AND && op != OP_OR) return nothing();
    switch (op) {
    case OP_ADD: return grown(a.low + b.low, a.high + b.high);
    case OP_SUB: return grown(a.low - b.high, a.high - b.low);
    case OP_MUL: return times(a, b);
    case OP_DIV: return over(a, b);
    case OP_NEG: return (OracleSpan){-a.high, -a.low, false};
    case OP_ABS: return (OracleSpan){no ? 0 : fmin(fabs(a.low), fabs(a.high)), fmax(fabs(a.low), fabs(a.high)), false};
    case OP_MIN: return (OracleSpan){fmin(a.low, b.low), fmin(a.high, b.high), false};
    case OP_MAX: return (OracleSpan){fmax(a.low, b.low), fmax(a.high, b.high), false};
    case OP_MOD: return modulo(a, b);
    case OP_POW: return power(a, b);
    case OP_SQRT: return cut(sqrt, a, 0, INFINITY);
    case OP_EXP: return between(exp, a);
    case OP_LOG: return cut(log, a, 0, INFINITY);
    case OP_SIN: return wave(a);
    case OP_COS: return wave(grown(a.low + M_PI_2, a.high + M_PI_2));
    case OP_TAN: return over(wave(a), wave(grown(a.low + M_PI_2, a.high + M_PI_2)));
    case OP_ASIN: return cut(asin, a, -1, 1);
    case OP_ACOS: {
        OracleSpan r = cut(asin, a, -1, 1);
        if (r.low > r.high) return r;
        OracleSpan s = grown(M_PI_2 - r.high, M_PI_2 - r.low);
        s.partial = r.partial;
        return s;
    }
    case OP_ATAN: return between(atan, a);
    case OP_ATAN2: return angle(a, b);
    case OP_FLOOR: return steps(floor, a);
    case OP_CEIL: return steps(ceil, a);
    case OP_ROUND: return steps(round, a);
    case OP_SIGN: return steps(sign_of, a);
    case OP_LT: return truth(a.high >= b.low, a.low < b.high);
    case OP_LE: return truth(a.high > b.low, a.low <= b.high);
    case OP_EQ: return truth(a.low != a.high || b.low != b.high || a.low != b.low, a.low <= b.high && b.low <= a.high);
    case OP_AND: return truth(no || other_no, yes && other_yes);
    case OP_OR: return truth(no && other_no, yes || other_yes);
    case OP_NOT: return truth(yes, no);
    default: return anything();
    }
}

static OracleSpan expression_over(OracleExpression *e, const OracleLine *line, double from, double to)
{
    const Ir *ir = e->oracle->ir;
    IrId id = 0;
    for (uint32_t k = 0; k < e->count; k++) {
        id = e->nodes[k];
        const IrNode *node = ir_at(ir, id);
        if (node->op == OP_X || node->op == OP_Y || node->op == OP_Z) {
            double p = line->origin[node->op - OP_X] + from * line->direction[node->op - OP_X];
            double q = line->origin[node->op - OP_X] + to * line->direction[node->op - OP_X];
            e->spans[id] = grown(fmin(p, q), fmax(p, q));
            continue;
        }
        if (node->rate != RATE_POINT) continue;
        const IrId *o = ir_operands(ir, id);
        OracleSpan a = e->spans[o[0]], b = node->count > 1 ? e->spans[o[1]] : a,
                   c = node->count > 2 ? e->spans[o[2]] : a;
        OracleSpan r = span_of((IrOp)node->op, a, b, c);
        if (r.low <= r.high) r.partial |= a.partial || (node->op != OP_SELECT && b.partial);
        e->spans[id] = r;
    }
    return e->spans[id];
}

// -- along a ray ----------------------------------------------------------------------------------------------------------------

// Where the line is within reach.
static bool within_reach(const OracleLine *line, double *near, double *far)
{
    for (int k = 0; k < 3; k++) {
        double o = line->origin[k], d = line->direction[k];
        if (d == 0) {
            if (fabs(o) > REACH) return false;
            continue;
        }
        double p = (-REACH - o) / d, q = (REACH - o) / d;
        *near = fmax(*near, fmin(p, q));
        *far = fmin(*far, fmax(p, q));
    }
    return *near < *far;
}

typedef struct Seeking {
    const OracleSeek *seek;
    int budget;
} Seeking;

// The sign change between two places whose signs differ.
static double change_between(const OracleSeek *seek, double low, double high)
{
    bool first = seek->at(seek->context, low) >= 0;
    for (int k = 0; k < 200; k++) {
        double middle = low + (high - low) / 2;
        if (middle <= low || middle >= high) break;
        if ((seek->at(seek->context, middle) >= 0) == first)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void seek_between(Seeking *s, double low, double high)
{
    const OracleSeek *seek = s->seek;
    OracleSpan f = {0, 0, false};
    for (int k = 0; k < seek->term_count && f.low <= f.high; k++) {
        const OracleTerm *term = &seek->terms[k];
        OracleSpan one = expression_over(term->expression, &term->line, low, high);
        bool partial = f.partial || one.partial, undefined = one.low > one.high;
        one = times(one, (OracleSpan){term->weight, term->weight, false});
        f = undefined ? nothing() : grown(f.low + one.low, f.high + one.high);
        f.partial |= partial;
    }
    OracleSpan more = seek->more ? seek->more(seek->context, low, high) : (OracleSpan){0, 0, false};
    bool never = f.low > f.high;
    if (never || f.high + more.high < 0 || (f.low + more.low > 0 && !f.partial)) return;
    if (high - low <= 1e-11 * (1 + fabs(low)) || --s->budget < 0) {
        bool before = seek->at(seek->context, low) >= 0, after = seek->at(seek->context, high) >= 0;
        if (before != after) seek->found(seek->context, change_between(seek, low, high));
        return;
    }
    double middle = low + (high - low) / 2;
    seek_between(s, low, middle);
    seek_between(s, middle, high);
}

void oracle_expression_seek(const OracleSeek *seek, double near, double far)
{
    Seeking s = {seek, BUDGET};
    for (int k = 0; k < seek->term_count; k++) {
        if (!within_reach(&seek->terms[k].line, &near, &far)) return;
    }
    seek->found(seek->context, near); // it begins and ends there
    seek->found(seek->context, far);
    seek_between(&s, near, far);
}
