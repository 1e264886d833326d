// Functions of numbers, vectors, colors, lists (lang/reference.md, section 9). Each is written in operations of the
// IR, so that it is the same at every rate.
#include <assert.h>
#include <string.h>

#include "compiler/evaluator.h"

typedef struct Math { // one call
    Eval *e;
    const Node *node;
} Math;

static Scalar add(Math m, Scalar a, Scalar b)
{
    return scalar_op2(m.e, OP_ADD, m.node, a, b);
}
static Scalar sub(Math m, Scalar a, Scalar b)
{
    return scalar_op2(m.e, OP_SUB, m.node, a, b);
}
static Scalar mul(Math m, Scalar a, Scalar b)
{
    return scalar_op2(m.e, OP_MUL, m.node, a, b);
}
static Scalar quotient(Math m, Scalar a, Scalar b)
{
    return scalar_op2(m.e, OP_DIV, m.node, a, b);
}
static Scalar least(Math m, Scalar a, Scalar b)
{
    return scalar_op2(m.e, OP_MIN, m.node, a, b);
}
static Scalar greatest(Math m, Scalar a, Scalar b)
{
    return scalar_op2(m.e, OP_MAX, m.node, a, b);
}

static Value vector(Math m, Type type, const Scalar *parts)
{
    return value_vector(&m.e->scratch, type, parts, value_size(type));
}

// --- vectors

static Scalar dot(Math m, const Value *a, const Value *b)
{
    Scalar sum = mul(m, a->vector[0], b->vector[0]);
    for (int k = 1; k < value_size(a->type); k++) sum = add(m, sum, mul(m, a->vector[k], b->vector[k]));
    return sum;
}

static Scalar length(Math m, const Value *v)
{
    return scalar_op1(m.e, OP_SQRT, m.node, dot(m, v, v));
}

static Value minus(Math m, const Value *a, const Value *b)
{
    Scalar parts[3];
    for (int k = 0; k < value_size(a->type); k++) parts[k] = sub(m, a->vector[k], b->vector[k]);
    return vector(m, a->type, parts);
}

static Value cross(Math m, const Value *a, const Value *b)
{
    Scalar parts[3];
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        parts[k] = sub(m, mul(m, a->vector[i], b->vector[j]), mul(m, a->vector[j], b->vector[i]));
    }
    return vector(m, type_of(TYPE_VEC3), parts);
}

static Value normalize(Math m, const Value *v)
{
    Scalar whole = length(m, v), parts[3];
    if (!whole.id && whole.number == 0) {
        complain(m.e, m.node, DIAG_DIVISION_BY_ZERO, "a vector of length 0 has no direction");
        return value_bad();
    }
    for (int k = 0; k < value_size(v->type); k++) parts[k] = quotient(m, v->vector[k], whole);
    return vector(m, type_of((TypeKind)v->type.kind), parts);
}

// --- numbers

static Value extreme(Math m, const Call *call, IrOp op, const Value *values)
{
    if (values->list.count == 0) {
        complain(m.e, m.node, DIAG_VALUE_COUNT, "%s wants at least one number", call->callee->name);
        return value_bad();
    }
    Scalar best = values->list.items[0].scalar;
    for (uint32_t i = 1; i < values->list.count; i++)
        best = scalar_op2(m.e, op, m.node, best, values->list.items[i].scalar);
    return value_scalar(call->result, best);
}

static Scalar fraction(Math m, const Value *range, Scalar v)
{
    Scalar t = quotient(m, sub(m, v, range->vector[0]), sub(m, range->vector[1], range->vector[0]));
    return least(m, greatest(m, t, scalar_of(0)), scalar_of(1));
}

static Scalar smoothstep(Math m, const Value *range, Scalar v)
{
    Scalar t = fraction(m, range, v); // 3 t² − 2 t³
    return mul(m, mul(m, t, t), sub(m, scalar_of(3), mul(m, scalar_of(2), t)));
}

static Value mix(Math m, const Call *call, const Value *a, const Value *b, Scalar t)
{
    int size = value_size(call->result);
    Scalar parts[3], rest = sub(m, scalar_of(1), t);
    for (int k = 0; k < size; k++) parts[k] = add(m, mul(m, value_part(a, k), rest), mul(m, value_part(b, k), t));
    return size == 1 ? value_scalar(call->result, parts[0]) : vector(m, call->result, parts);
}

// --- colors

static Scalar decode(Math m, Scalar encoded)
{
    if (!encoded.id) return scalar_of(srgb_to_linear(encoded.number));
    Scalar low = quotient(m, encoded, scalar_of(12.92));
    Scalar base = greatest(m, quotient(m, add(m, encoded, scalar_of(0.055)), scalar_of(1.055)), scalar_of(0));
    Scalar high = scalar_op2(m.e, OP_POW, m.node, base, scalar_of(2.4));
    return scalar_select(m.e, m.node, scalar_op2(m.e, OP_LE, m.node, encoded, scalar_of(0.04045)), low, high);
}

// f(n) = v − v s max(0, min(k, 4 − k, 1)), k = mod(n + h / 60deg, 6); r, g, b are n = 5, 3, 1.
static Value hsv(Math m, const Value *args)
{
    Scalar sixths = quotient(m, args[0].scalar, scalar_of(M_PI / 3)), s = args[1].scalar, v = args[2].scalar, parts[3];
    for (int i = 0; i < 3; i++) {
        Scalar k = scalar_op2(m.e, OP_MOD, m.node, add(m, scalar_of(5 - 2 * i), sixths), scalar_of(6));
        Scalar w = least(m, least(m, k, sub(m, scalar_of(4), k)), scalar_of(1));
        parts[i] = sub(m, v, mul(m, mul(m, v, s), greatest(m, w, scalar_of(0))));
    }
    return vector(m, type_of(TYPE_COLOR), parts);
}

// c0 + c1 u + c2 u² + c3 u³
static Scalar cubic(Math m, const double c[4], Scalar u)
{
    Scalar sum = scalar_of(c[3]);
    for (int k = 2; k >= 0; k--) sum = add(m, mul(m, sum, u), scalar_of(c[k]));
    return sum;
}

// The Planckian locus by Kim et al. (US patent 7024034), as chromaticity x and y by cubics in 1000 K / t, from 1667 K
// to 25000 K; then linear sRGB with the greatest part 1.
static Value kelvin(Math m, Scalar t)
{
    static const double x_low[4] = {0.179910, 0.8776956, -0.2343589, -0.2661239};
    static const double x_high[4] = {0.240390, 0.2226347, 2.1070379, -3.0258469};
    static const double y_low[4] = {-0.20219683, 2.18555832, -1.34811020, -1.1063814};
    static const double y_middle[4] = {-0.16748867, 2.09137015, -1.37418593, -0.9549476};
    static const double y_high[4] = {-0.37001483, 3.75112997, -5.87338670, 3.0817580};
    static const double rgb[3][3] = {
        {3.2404542, -1.5371385, -0.4985314}, {-0.9692660, 1.8760108, 0.0415560}, {0.0556434, -0.2040259, 1.0572252}};
    t = least(m, greatest(m, t, scalar_of(1667)), scalar_of(25000));
    Scalar u = quotient(m, scalar_of(1000), t);
    Scalar below4000 = scalar_op2(m.e, OP_LT, m.node, t, scalar_of(4000)),
           below2222 = scalar_op2(m.e, OP_LT, m.node, t, scalar_of(2222));
    Scalar x = scalar_select(m.e, m.node, below4000, cubic(m, x_low, u), cubic(m, x_high, u));
    Scalar y = scalar_select(m.e, m.node, below4000, cubic(m, y_middle, x), cubic(m, y_high, x));
    y = scalar_select(m.e, m.node, below2222, cubic(m, y_low, x), y);
    Scalar xyz[3] = {quotient(m, x, y), scalar_of(1), quotient(m, sub(m, sub(m, scalar_of(1), x), y), y)}, parts[3],
           most = scalar_of(0);
    for (int i = 0; i < 3; i++) {
        parts[i] = scalar_of(0);
        for (int k = 0; k < 3; k++) parts[i] = add(m, parts[i], mul(m, scalar_of(rgb[i][k]), xyz[k]));
        parts[i] = greatest(m, parts[i], scalar_of(0));
        most = greatest(m, most, parts[i]);
    }
    for (int i = 0; i < 3; i++) parts[i] = quotient(m, parts[i], most);
    return vector(m, type_of(TYPE_COLOR), parts);
}

// --- lists and text

static Value steps(Math m, const Call *call, const Value *args)
{
    double count;
    const Node *at = bound_node(call, 1, m.node);
    if (!want_const(m.e, at, args[1].scalar, "the length of a list", &count)) return value_bad();
    if (count < 0 || count > ITEMS_MAX) {
        complain(m.e, at, DIAG_OUT_OF_RANGE, "a list has from 0 to %d elements", ITEMS_MAX);
        return value_bad();
    }
    List list = {0};
    Type type = type_element(call->result);
    Scalar low = args[0].vector[0], high = args[0].vector[1];
    for (double i = 0; i < count && !m.e->stop; i++) {
        double t = count == 1 ? 0 : i / (count - 1); // both ends exactly
        Scalar step = t == 1 ? high : add(m, low, mul(m, sub(m, high, low), scalar_of(t)));
        values_add(m.e, &list, value_scalar(type, step), m.node);
    }
    return values_list(list, type);
}

static Value text(Math m, const Call *call, const Value *args)
{
    double digits;
    if (!want_const(m.e, bound_node(call, 1, m.node), args[1].scalar, "how many digits a text has", &digits))
        return value_bad();
    if (value_varying(&args[0])) {
        report_rate(m.e, bound_node(call, 0, m.node), DIAG_SHAPE_RATE, "a text");
        return value_bad();
    }
    if (digits < 1 || digits > 17) {
        complain(m.e, bound_node(call, 1, m.node), DIAG_OUT_OF_RANGE, "a text has from 1 to 17 digits");
        return value_bad();
    }
    return value_string(value_text(&m.e->unit->arena, &args[0], (int)digits));
}

// --- points

static Value polar(Math m, const Value *args)
{
    Scalar parts[3] = {mul(m, args[0].scalar, scalar_op1(m.e, OP_COS, m.node, args[1].scalar)),
                       mul(m, args[0].scalar, scalar_op1(m.e, OP_SIN, m.node, args[1].scalar)), args[2].scalar};
    return vector(m, type_of(TYPE_VEC3), parts);
}

static Value spherical(Math m, const Value *args)
{
    Scalar across = mul(m, args[0].scalar, scalar_op1(m.e, OP_COS, m.node, args[2].scalar));
    Scalar parts[3] = {mul(m, across, scalar_op1(m.e, OP_COS, m.node, args[1].scalar)),
                       mul(m, across, scalar_op1(m.e, OP_SIN, m.node, args[1].scalar)),
                       mul(m, args[0].scalar, scalar_op1(m.e, OP_SIN, m.node, args[2].scalar))};
    return vector(m, type_of(TYPE_VEC3), parts);
}

// --- all of them

static IrOp plain_op(BuiltinId id)
{
    switch (id) {
    case BUILTIN_SIN: return OP_SIN;
    case BUILTIN_COS: return OP_COS;
    case BUILTIN_TAN: return OP_TAN;
    case BUILTIN_ASIN: return OP_ASIN;
    case BUILTIN_ACOS: return OP_ACOS;
    case BUILTIN_ATAN: return OP_ATAN;
    case BUILTIN_SQRT: return OP_SQRT;
    case BUILTIN_EXP: return OP_EXP;
    case BUILTIN_LOG: return OP_LOG;
    case BUILTIN_ABS: return OP_ABS;
    case BUILTIN_SIGN: return OP_SIGN;
    case BUILTIN_FLOOR: return OP_FLOOR;
    case BUILTIN_CEIL: return OP_CEIL;
    case BUILTIN_ROUND: return OP_ROUND;
    default: return OP_NONE;
    }
}

// Between ends that stand the wrong way round there is nothing to clamp to.
static void test_upward(Eval *e, const Node *at, const Value *range)
{
    const Scalar *end = range->vector;
    Scalar upward = scalar_op2(e, OP_LE, at, end[0], end[1]);
    if (upward.id && !at_point(e, upward))
        add_assert(e, at, upward, "out-of-range: the range of clamp goes up: low .. high");
    else if (!upward.id && upward.number == 0)
        complain(e, at, DIAG_OUT_OF_RANGE, "the range of clamp goes up, low .. high, and %g > %g", end[0].number,
                 end[1].number);
}

Value eval_function(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Math m = {e, node};
    Type result = call->result;
    IrOp op = plain_op((BuiltinId)call->callee->id);
    if (op) return checked_int(e, node, value_scalar(result, scalar_op1(e, op, node, args[0].scalar)));
    switch (call->callee->id) {
    case BUILTIN_ATAN2: return value_scalar(result, scalar_op2(e, OP_ATAN2, node, args[0].scalar, args[1].scalar));
    case BUILTIN_MOD: return value_scalar(result, scalar_op2(e, OP_MOD, node, args[0].scalar, args[1].scalar));
    case BUILTIN_MIN: return extreme(m, call, OP_MIN, &args[0]);
    case BUILTIN_MAX: return extreme(m, call, OP_MAX, &args[0]);
    case BUILTIN_CLAMP:
        test_upward(e, bound_node(call, 1, node), &args[1]);
        return value_scalar(result, least(m, greatest(m, args[0].scalar, args[1].vector[0]), args[1].vector[1]));
    case BUILTIN_MIX: return mix(m, call, &args[0], &args[1], args[2].scalar);
    case BUILTIN_SMOOTHSTEP: return value_scalar(result, smoothstep(m, &args[0], args[1].scalar));
    case BUILTIN_LENGTH: return value_scalar(result, length(m, &args[0]));
    case BUILTIN_DISTANCE: {
        Value way = minus(m, &args[0], &args[1]);
        return value_scalar(result, length(m, &way));
    }
    case BUILTIN_DOT: return value_scalar(result, dot(m, &args[0], &args[1]));
    case BUILTIN_CROSS: {
        Value product = cross(m, &args[0], &args[1]);
        product.type = result;
        return product;
    }
    case BUILTIN_NORMALIZE: return normalize(m, &args[0]);
    case BUILTIN_POLAR: return polar(m, args);
    case BUILTIN_SPHERICAL: return spherical(m, args);
    case BUILTIN_GRAY: return vector(m, result, (Scalar[3]){args[0].scalar, args[0].scalar, args[0].scalar});
    case BUILTIN_SRGB:
        return vector(m, result,
                      (Scalar[3]){decode(m, args[0].scalar), decode(m, args[1].scalar), decode(m, args[2].scalar)});
    case BUILTIN_HSV: return hsv(m, args);
    case BUILTIN_KELVIN: return kelvin(m, args[0].scalar);
    case BUILTIN_COUNT: return value_int(args[0].list.count);
    case BUILTIN_STEPS: return steps(m, call, args);
    case BUILTIN_SPLINE: return eval_spline(e, node, call, args);
    case BUILTIN_HEADING: return eval_heading(e, node, call, args);
    case BUILTIN_RANDOM: return eval_random(e, node, call, args);
    case BUILTIN_NOISE:
    case BUILTIN_CELLS: return eval_noise(e, node, call, args);
    case BUILTIN_FBM: return eval_fbm(e, node, call, args);
    default:
        assert(call->callee->id == BUILTIN_TEXT && "check() reports what is not there yet");
        return text(m, call, args);
    }
}
