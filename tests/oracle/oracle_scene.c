// From the IR to a tree of leaves, each in its own coordinates.
//
// Scalars and matrices are evaluated once, in the order of the nodes. The field is then walked from its root, carrying what the nodes above say
// of every leaf below: the map from the world, the perturbations of `deform` and outer free forms (with the sign that complements
// give them), the paint and the name. A walk by recursion is deep enough for scenes: their nesting is limited by the language.
//
// A morph of a and b is the tree of a in which each leaf is a tree of b, whose leaves are sums of both: with weights that are not negative, a sum may
// go into max and min. So b is walked once for each leaf of a, carrying what that leaf adds.
#include "tests/oracle/oracle.h"

#include <math.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/noise.h"
#include "tests/oracle/internal.h"

typedef struct Carried Carried;

typedef struct Pending { // the second operand of a morph whose first is being walked
    IrId other;
    const Carried *around; // what the morph inherits
    double t;
} Pending;

typedef struct Partner { // a leaf of the first operand, to be added to those of the second
    uint32_t first_base, base_count, first, count;
    double material[11];
    const char *name;
    const struct Partner *before;
} Partner;

struct Carried {       // what a leaf inherits
    const double *map; // world to here
    IrId paint;
    const char *name;
    uint32_t inherited_first, inherited_count; // in Walk.inherited
    int sign;                                  // -1 below an odd number of complements
    double weight;                             // below morphs, else 1
    const Pending *pending;                    // of the innermost morph that still wants its second operand
    const Partner *partner;                    // the last of those that are to be added
};

typedef struct Walk {
    Oracle *oracle;
    jmp_buf failed;
    char *why;
    OraclePerturbation *inherited;
    uint32_t inherited_count, inherited_capacity;
} Walk;

static const double identity_map[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

static _Noreturn void fail(Walk *walk, const char *what)
{
    snprintf(walk->why, ORACLE_ERROR, "%s", what);
    longjmp(walk->failed, 1);
}

// -- numbers ------------------------------------------------------------------------------------------------------------------

static double scalar_value(Walk *walk, const Ir *ir, const OracleFrame *frame, IrId id)
{
    const IrNode *node = ir_at(ir, id);
    const double *v = walk->oracle->scalars;
    double a = node->count > 0 ? v[ir_operand(ir, id, 0)] : 0;
    double b = node->count > 1 ? v[ir_operand(ir, id, 1)] : 0;
    double c = node->count > 2 ? v[ir_operand(ir, id, 2)] : 0;
    switch (node->op) {
    case OP_CONST: return node->number;
    case OP_PARAM: return frame->inputs[node->index];
    case OP_TIME: return frame->time;
    case OP_FRAME: return frame->frame;
    case OP_ADD: return a + b;
    case OP_SUB: return a - b;
    case OP_MUL: return a * b;
    case OP_DIV: return a / b;
    case OP_NEG: return -a;
    case OP_ABS: return fabs(a);
    case OP_SIGN: return (a > 0) - (a < 0);
    case OP_MIN: return fmin(a, b);
    case OP_MAX: return fmax(a, b);
    case OP_MOD: return a - b * floor(a / b);
    case OP_POW: return pow(a, b);
    case OP_SQRT: return sqrt(a);
    case OP_EXP: return exp(a);
    case OP_LOG: return log(a);
    case OP_SIN: return sin(a);
    case OP_COS: return cos(a);
    case OP_TAN: return tan(a);
    case OP_ASIN: return asin(a);
    case OP_ACOS: return acos(a);
    case OP_ATAN: return atan(a);
    case OP_ATAN2: return atan2(a, b);
    case OP_FLOOR: return floor(a);
    case OP_CEIL: return ceil(a);
    case OP_ROUND: return round(a);
    case OP_HASH: return noise_hash(a, b); // these three are what compiler/noise.h says they are
    case OP_NOISE: return noise_gradient(a, b, c);
    case OP_CELLS: return noise_cells(a, b, c);
    case OP_LT: return a < b;
    case OP_LE: return a <= b;
    case OP_EQ: return a == b;
    case OP_AND: return a != 0 && b != 0;
    case OP_OR: return a != 0 || b != 0;
    case OP_NOT: return a == 0;
    case OP_SELECT: return a != 0 ? b : c;
    default: fail(walk, "a scalar of point rate has no value of its own");
    }
}

static void map_compose(const double a[12], const double b[12], double out[12]) // X -> a(b(X))
{
    double r[12];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++) {
            r[4 * i + j] = a[4 * i] * b[j] + a[4 * i + 1] * b[4 + j] + a[4 * i + 2] * b[8 + j];
        }
        r[4 * i + 3] += a[4 * i + 3];
    }
    memcpy(out, r, sizeof r);
}

static bool map_inverse(const double m[12], double out[12])
{
    double c[9] = {
        m[5] * m[10] - m[6] * m[9], m[2] * m[9] - m[1] * m[10], m[1] * m[6] - m[2] * m[5],
        m[6] * m[8] - m[4] * m[10], m[0] * m[10] - m[2] * m[8], m[2] * m[4] - m[0] * m[6],
        m[4] * m[9] - m[5] * m[8],  m[1] * m[8] - m[0] * m[9],  m[0] * m[5] - m[1] * m[4],
    };
    double det = m[0] * c[0] + m[1] * c[3] + m[2] * c[6];
    if (det == 0 || !isfinite(det)) return false;
    double r[12];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) r[4 * i + j] = c[3 * i + j] / det;
        r[4 * i + 3] = -(r[4 * i] * m[3] + r[4 * i + 1] * m[7] + r[4 * i + 2] * m[11]);
    }
    memcpy(out, r, sizeof r);
    return true;
}

void oracle_map_point(const double m[12], const double x[3], double out[3])
{
    double r[3];
    for (int i = 0; i < 3; i++) r[i] = m[4 * i] * x[0] + m[4 * i + 1] * x[1] + m[4 * i + 2] * x[2] + m[4 * i + 3];
    memcpy(out, r, sizeof r);
}

// A gradient in the image of a map, seen before the map: the transposed linear part.
static void map_gradient(const double m[12], const double g[3], double out[3])
{
    double r[3];
    for (int j = 0; j < 3; j++) r[j] = m[j] * g[0] + m[4 + j] * g[1] + m[8 + j] * g[2];
    memcpy(out, r, sizeof r);
}

double oracle_quadric_field(const double a[10], const double p[3], double gradient[3])
{
    double x = p[0], y = p[1], z = p[2];
    if (gradient) {
        gradient[0] = 2 * a[0] * x + a[3] * y + a[4] * z + a[6];
        gradient[1] = 2 * a[1] * y + a[3] * x + a[5] * z + a[7];
        gradient[2] = 2 * a[2] * z + a[4] * x + a[5] * y + a[8];
    }
    return (a[0] * x + a[3] * y + a[4] * z + a[6]) * x + (a[1] * y + a[5] * z + a[7]) * y + (a[2] * z + a[8]) * z +
           a[9];
}

// -- fields of the IR at a point ----------------------------------------------------------------------------------------------

static void add_scaled(double g[3], double s, const double h[3])
{
    for (int i = 0; i < 3; i++) g[i] += s * h[i];
}

static double perturbation_field(const Oracle *oracle, IrId id, const double point[3], double gradient[3])
{
    const Ir *ir = oracle->ir;
    double g[3];
    if (ir_at(ir, id)->op == OP_PTRANSFORM) {
        double inverse[12], local[3];
        if (!map_inverse(oracle->maps[ir_operand(ir, id, 1)], inverse)) return NAN;
        oracle_map_point(inverse, point, local);
        double f = perturbation_field(oracle, ir_operand(ir, id, 0), local, g);
        map_gradient(inverse, g, gradient);
        return f;
    }
    double q = oracle_ir_field(oracle, ir_operand(ir, id, 0), point, g) + oracle->scalars[ir_operand(ir, id, 2)];
    double s = oracle->scalars[ir_operand(ir, id, 1)];
    double r = q > 0 ? q : 0;
    for (int i = 0; i < 3; i++) gradient[i] = 3 * s * r * r * g[i];
    return s * r * r * r;
}

double oracle_ir_field(const Oracle *oracle, IrId id, const double point[3], double gradient[3])
{
    const Ir *ir = oracle->ir;
    const IrNode *node = ir_at(ir, id);
    const IrId *operands = ir_operands(ir, id);
    double spare[3] = {0};
    if (!gradient) gradient = spare;
    memset(gradient, 0, sizeof spare);
    switch (node->op) {
    case OP_EMPTY: return -ORACLE_INFINITY;
    case OP_FIELD: {
        OracleExpression *expression = oracle_expression_new((Oracle *)oracle, id);
        return oracle_expression_at(expression, point, gradient);
    }
    case OP_QUADRIC: {
        double a[10];
        for (int k = 0; k < 10; k++) a[k] = oracle->scalars[operands[k]];
        return oracle_quadric_field(a, point, gradient);
    }
    case OP_FREEFORM:
    case OP_DEFORM: {
        double f = oracle_ir_field(oracle, operands[0], point, gradient);
        for (uint32_t k = 1; k < node->count; k++) {
            double g[3];
            f += perturbation_field(oracle, operands[k], point, g);
            add_scaled(gradient, 1, g);
        }
        return f;
    }
    case OP_UNION:
    case OP_INTERSECT: {
        double f = oracle_ir_field(oracle, operands[0], point, gradient);
        for (uint32_t k = 1; k < node->count; k++) {
            double g[3], h = oracle_ir_field(oracle, operands[k], point, g);
            if (node->op == OP_UNION ? h > f : h < f) {
                f = h;
                memcpy(gradient, g, sizeof g);
            }
        }
        return f;
    }
    case OP_COMPLEMENT: {
        double f = oracle_ir_field(oracle, operands[0], point, gradient);
        for (int i = 0; i < 3; i++) gradient[i] = -gradient[i];
        return -f;
    }
    case OP_TRANSFORM: {
        double inverse[12], local[3], g[3];
        if (!map_inverse(oracle->maps[operands[1]], inverse)) return NAN;
        oracle_map_point(inverse, point, local);
        double f = oracle_ir_field(oracle, operands[0], local, g);
        map_gradient(inverse, g, gradient);
        return f;
    }
    case OP_PAINT:
    case OP_NAMED: return oracle_ir_field(oracle, operands[0], point, gradient);
    case OP_MORPH: {
        double t = oracle->scalars[operands[2]], g[3];
        if (t <= 0 || t >= 1) return oracle_ir_field(oracle, operands[t >= 1], point, gradient);
        double f = oracle_ir_field(oracle, operands[0], point, gradient),
               h = oracle_ir_field(oracle, operands[1], point, g);
        for (int i = 0; i < 3; i++) gradient[i] = (1 - t) * gradient[i] + t * g[i];
        return (1 - t) * f + t * h;
    }
    case OP_SHOW:
        return oracle->scalars[operands[1]] != 0 ? oracle_ir_field(oracle, operands[0], point, gradient)
                                                 : -ORACLE_INFINITY;
    default: return NAN;
    }
}

// -- tools ---------------------------------------------------------------------------------------------------------------------

// The frame of a tool: z along the outward normal, x the cross product of z with the world axis it leans to least, turned.
static void stand(const double at[3], const double normal[3], double turn, double out[12])
{
    double z[3], length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    int least = 0;
    for (int i = 0; i < 3; i++) z[i] = normal[i] / length;
    for (int i = 1; i < 3; i++) {
        if (fabs(z[i]) < fabs(z[least])) least = i;
    }
    double axis[3] = {least == 0, least == 1, least == 2};
    double x[3] = {z[1] * axis[2] - z[2] * axis[1], z[2] * axis[0] - z[0] * axis[2], z[0] * axis[1] - z[1] * axis[0]};
    length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    for (int i = 0; i < 3; i++) x[i] /= length;
    double y[3] = {z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]};
    for (int i = 0; i < 3; i++) {
        out[4 * i] = cos(turn) * x[i] + sin(turn) * y[i];
        out[4 * i + 1] = cos(turn) * y[i] - sin(turn) * x[i];
        out[4 * i + 2] = z[i];
        out[4 * i + 3] = at[i];
    }
}

// The point of the surface nearest to `at` along ±∇F there: steps outwards on both sides at once, a bisection where the sign changes.
static void place(Walk *walk, IrId id)
{
    Oracle *oracle = walk->oracle;
    const IrId *operands = ir_operands(oracle->ir, id);
    double at[3], g[3];
    for (int i = 0; i < 3; i++) at[i] = oracle->scalars[operands[1 + i]];
    double f = oracle_ir_field(oracle, operands[0], at, g);
    double slope = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    if (!(slope > 0)) fail(walk, "a tool stands where the field has no direction");
    double step = fmax(fabs(f) / slope, 1e-9) / 64;
    double low = 0, high = 0;
    bool found = f == 0;
    for (int k = 0; k < 200000 && !found; k++, step *= 1.0002) {
        for (int side = -1; side <= 1 && !found; side += 2) {
            double reach = side * step * (k + 1), p[3];
            for (int i = 0; i < 3; i++) p[i] = at[i] + reach * g[i] / slope;
            if ((oracle_ir_field(oracle, operands[0], p, NULL) >= 0) == (f >= 0)) continue;
            low = 0, high = reach, found = true;
        }
    }
    if (!found) fail(walk, "a tool misses");
    for (int k = 0; k < 200 && f != 0; k++) {
        double middle = (low + high) / 2, p[3];
        for (int i = 0; i < 3; i++) p[i] = at[i] + middle * g[i] / slope;
        if ((oracle_ir_field(oracle, operands[0], p, NULL) >= 0) == (f >= 0))
            low = middle;
        else
            high = middle;
    }
    double on[3], normal[3];
    for (int i = 0; i < 3; i++) on[i] = at[i] + high * g[i] / slope;
    oracle_ir_field(oracle, operands[0], on, normal);
    for (int i = 0; i < 3; i++) normal[i] = -normal[i];
    stand(on, normal, oracle->scalars[operands[4]], oracle->maps[id]);
}

// Where the ray first crosses the surface: steps of a two thousandth of the way to `toward`, ten times as far, a bisection where the sign changes.
static void surface(Walk *walk, IrId id)
{
    Oracle *oracle = walk->oracle;
    const IrId *operands = ir_operands(oracle->ir, id);
    double from[3], way[3], p[3], normal[3], low = 0, high = 0;
    for (int i = 0; i < 3; i++) {
        from[i] = oracle->scalars[operands[1 + i]];
        way[i] = oracle->scalars[operands[4 + i]] - from[i];
    }
    bool inside = oracle_ir_field(oracle, operands[0], from, NULL) >= 0, found = false;
    for (int k = 1; k <= 20000 && !found; k++) {
        low = high, high = k / 2000.0;
        for (int i = 0; i < 3; i++) p[i] = from[i] + high * way[i];
        found = (oracle_ir_field(oracle, operands[0], p, NULL) >= 0) != inside;
    }
    if (!found) fail(walk, "a ray misses");
    for (int k = 0; k < 100; k++) {
        double middle = (low + high) / 2;
        for (int i = 0; i < 3; i++) p[i] = from[i] + middle * way[i];
        if ((oracle_ir_field(oracle, operands[0], p, NULL) >= 0) == inside)
            low = middle;
        else
            high = middle;
    }
    oracle_ir_field(oracle, operands[0], p, normal);
    for (int i = 0; i < 3; i++) normal[i] = -normal[i];
    stand(p, normal, 0, oracle->maps[id]);
}

static double height(Walk *walk, IrId id)
{
    Oracle *oracle = walk->oracle;
    const IrId *operands = ir_operands(oracle->ir, id);
    double local[3], world[3];
    for (int i = 0; i < 3; i++) local[i] = oracle->scalars[operands[3 + i]];
    oracle_map_point(oracle->maps[operands[2]], local, world);
    double f = oracle_ir_field(oracle, operands[0], world, NULL);
    double q = oracle_ir_field(oracle, operands[1], local, NULL);
    if (!(q > 0)) fail(walk, "a height outside the tool's support");
    return -f / (q * q * q);
}

static void evaluate_matrix(Walk *walk, IrId id)
{
    Oracle *oracle = walk->oracle;
    const Ir *ir = oracle->ir;
    const IrId *operands = ir_operands(ir, id);
    double *out = oracle->maps[id];
    switch (ir_at(ir, id)->op) {
    case OP_MATRIX:
        for (int k = 0; k < 12; k++) out[k] = oracle->scalars[operands[k]];
        break;
    case OP_COMPOSE: map_compose(oracle->maps[operands[0]], oracle->maps[operands[1]], out); break;
    case OP_INVERSE:
        if (!map_inverse(oracle->maps[operands[0]], out)) fail(walk, "a matrix is singular");
        break;
    case OP_PLACE: place(walk, id); break;
    case OP_SURFACE: surface(walk, id); break;
    case OP_STAND: {
        double v[7];
        for (int k = 0; k < 7; k++) v[k] = oracle->scalars[operands[k]];
        stand(v, v + 3, v[6], out);
        break;
    }
    default: fail(walk, "an unknown matrix");
    }
}

static double value_at(const Oracle *oracle, IrId id)
{
    const IrId *o = ir_operands(oracle->ir, id);
    double point[3] = {oracle->scalars[o[1]], oracle->scalars[o[2]], oracle->scalars[o[3]]};
    return oracle_ir_field(oracle, o[0], point, NULL);
}

static void evaluate_numbers(Walk *walk, const OracleFrame *frame)
{
    Oracle *oracle = walk->oracle;
    const Ir *ir = oracle->ir;
    oracle->scalars = arena_array(&oracle->arena, double, ir->count);
    oracle->maps = arena_alloc(&oracle->arena, sizeof *oracle->maps * ir->count);
    for (IrId id = 1; id < ir->count; id++) {
        const IrNode *node = ir_at(ir, id);
        if (node->rate == RATE_POINT && node->type == IR_SCALAR) continue;
        if (node->type == IR_MATRIX) evaluate_matrix(walk, id);
        if (node->type != IR_SCALAR) continue;
        oracle->scalars[id] = node->op == OP_HEIGHT  ? height(walk, id)
                              : node->op == OP_AT    ? value_at(oracle, id)
                              : node->op == OP_ENTRY ? oracle->maps[ir_operand(ir, id, 0)][node->index]
                                                     : scalar_value(walk, ir, frame, id);
        if (!isfinite(oracle->scalars[id])) fail(walk, "a value is not finite");
    }
}

// -- the tree of leaves --------------------------------------------------------------------------------------------------------

static void *grow(void *list, uint32_t count, uint32_t *capacity, size_t size)
{
    if (count < *capacity) return list;
    *capacity = *capacity ? *capacity * 2 : 64;
    list = realloc(list, *capacity * size);
    if (!list) abort();
    return list;
}

static uint32_t add_node(Oracle *oracle, OracleKind kind)
{
    oracle->nodes = grow(oracle->nodes, oracle->node_count, &oracle->node_capacity, sizeof *oracle->nodes);
    oracle->nodes[oracle->node_count] = (OracleNode){.kind = kind};
    return oracle->node_count++;
}

static void set_map(OracleMap *map, const double m[12])
{
    memcpy(map->m, m, sizeof map->m);
    map->identity = !memcmp(m, identity_map, sizeof identity_map);
}

// A quadric under whatever does not change its shape: names, paints, transforms.
static void read_quadric(Walk *walk, IrId id, const double map[12], OracleQuadric *out)
{
    const Oracle *oracle = walk->oracle;
    const IrId *operands = ir_operands(oracle->ir, id);
    switch (ir_at(oracle->ir, id)->op) {
    case OP_FIELD: set_map(&out->map, map); return;
    case OP_QUADRIC:
        for (int k = 0; k < 10; k++) out->a[k] = oracle->scalars[operands[k]];
        set_map(&out->map, map);
        return;
    case OP_PAINT:
    case OP_NAMED: read_quadric(walk, operands[0], map, out); return;
    case OP_COMPLEMENT:
        read_quadric(walk, operands[0], map, out);
        for (int k = 0; k < 10; k++) out->a[k] = -out->a[k];
        return;
    case OP_TRANSFORM: {
        double inverse[12], local[12];
        if (!map_inverse(oracle->maps[operands[1]], inverse)) fail(walk, "a transform is singular");
        map_compose(inverse, map, local);
        read_quadric(walk, operands[0], local, out);
        return;
    }
    default: fail(walk, "a perturbation that is not a quadric");
    }
}

static void read_perturbation(Walk *walk, IrId id, const double map[12], OraclePerturbation *out)
{
    const Oracle *oracle = walk->oracle;
    const IrId *operands = ir_operands(oracle->ir, id);
    if (ir_at(oracle->ir, id)->op == OP_PTRANSFORM) {
        double inverse[12], local[12];
        if (!map_inverse(oracle->maps[operands[1]], inverse)) fail(walk, "a transform is singular");
        map_compose(inverse, map, local);
        read_perturbation(walk, operands[0], local, out);
        return;
    }
    read_quadric(walk, operands[0], map, &out->quadric);
    out->quadric.a[9] += oracle->scalars[operands[2]];
    out->strength = oracle->scalars[operands[1]];
}

static OracleBase *add_base(Oracle *oracle)
{
    oracle->bases = grow(oracle->bases, oracle->base_count, &oracle->base_capacity, sizeof *oracle->bases);
    oracle->bases[oracle->base_count] = (OracleBase){0};
    return &oracle->bases[oracle->base_count++];
}

static OraclePerturbation *add_perturbation(Oracle *oracle)
{
    oracle->perturbations = grow(oracle->perturbations, oracle->perturbation_count, &oracle->perturbation_capacity,
                                 sizeof *oracle->perturbations);
    return &oracle->perturbations[oracle->perturbation_count++];
}

// What a leaf of the IR is in the outermost field, with its weight.
static Partner read_leaf(Walk *walk, IrId id, const Carried *carried)
{
    static const double plain[11] = {0.8, 0.8, 0.8, 0.1, 0.8, 0.2, 30, 0, 0, 1.5, 0}; // what nobody painted
    Oracle *oracle = walk->oracle;
    Partner leaf = {oracle->base_count, 1, oracle->perturbation_count, carried->inherited_count, {0}, carried->name,
                    carried->partner};
    OracleBase *base = add_base(oracle);
    read_quadric(walk, id, carried->map, &base->quadric);
    base->weight = carried->weight * carried->sign;
    if (ir_at(oracle->ir, id)->op == OP_FIELD) base->field = oracle_expression_new(oracle, id);
    for (uint32_t k = 0; k < carried->inherited_count; k++) {
        OraclePerturbation *p = add_perturbation(oracle);
        *p = walk->inherited[carried->inherited_first + k];
        p->strength *= carried->weight;
    }
    for (uint32_t k = 0; k < 11; k++) {
        leaf.material[k] =
            carried->weight * (carried->paint ? oracle->scalars[ir_operand(oracle->ir, carried->paint, k)] : plain[k]);
    }
    return leaf;
}

static void add_leaf(Walk *walk, const Partner *last, int sign)
{
    Oracle *oracle = walk->oracle;
    uint32_t node = add_node(oracle, ORACLE_LEAF);
    oracle->leaves = grow(oracle->leaves, oracle->leaf_count, &oracle->leaf_capacity, sizeof *oracle->leaves);
    OracleLeaf *leaf = &oracle->leaves[oracle->leaf_count];
    *leaf = (OracleLeaf){.first_base = oracle->base_count, .first = oracle->perturbation_count, .object = ""};
    for (const Partner *one = last; one; one = one->before) {
        for (uint32_t k = 0; k < one->base_count; k++, leaf->base_count++) {
            OracleBase *base = add_base(oracle);
            *base = oracle->bases[one->first_base + k];
            leaf->field_count += base->field != NULL;
            base->weight *= sign; // the complements above make it that of the outermost field again
        }
        for (uint32_t k = 0; k < one->count; k++, leaf->count++) {
            OraclePerturbation *p = add_perturbation(oracle);
            *p = oracle->perturbations[one->first + k];
            p->strength *= sign;
        }
        for (int k = 0; k < 11; k++) leaf->material[k] += one->material[k];
        if (*one->name) leaf->object = one->name; // of the first that has one
    }
    oracle->nodes[node].leaf = oracle->leaf_count++;
    oracle->nodes[node].after = oracle->node_count;
}

static void walk_field(Walk *walk, IrId id, Carried carried);

static void walk_leaf(Walk *walk, IrId id, const Carried *carried)
{
    Oracle *oracle = walk->oracle;
    Partner leaf = read_leaf(walk, id, carried);
    const Pending *pending = carried->pending;
    if (!pending) {
        add_leaf(walk, &leaf, carried->sign);
        return;
    }
    Carried second = *pending->around;
    second.weight = pending->t * pending->around->weight;
    second.partner = &leaf;
    if (carried->sign == second.sign) {
        walk_field(walk, pending->other, second);
        return;
    }
    uint32_t at = add_node(oracle, ORACLE_NOT); // so that b stands as the morph does
    walk_field(walk, pending->other, second);
    oracle->nodes[at].after = oracle->node_count;
}

static void walk_morph(Walk *walk, IrId id, Carried carried)
{
    const Oracle *oracle = walk->oracle;
    const IrId *operands = ir_operands(oracle->ir, id);
    double t = oracle->scalars[operands[2]];
    if (t <= 0 || t >= 1) { // only one of them is looked at
        walk_field(walk, operands[t >= 1], carried);
        return;
    }
    Pending pending = {operands[1], &carried, t};
    Carried first = carried;
    first.pending = &pending;
    first.weight *= 1 - t;
    walk_field(walk, operands[0], first);
}

// Everything below carries these perturbations too. The list of the nodes above is copied in front, so that a leaf finds its own in one piece.
static void walk_deformed(Walk *walk, IrId id, Carried carried)
{
    const Ir *ir = walk->oracle->ir;
    uint32_t first = walk->inherited_count, count = ir_at(ir, id)->count;
    for (uint32_t k = 0; k < carried.inherited_count + count - 1; k++) {
        walk->inherited =
            grow(walk->inherited, walk->inherited_count, &walk->inherited_capacity, sizeof *walk->inherited);
        OraclePerturbation *p = &walk->inherited[walk->inherited_count++];
        if (k < carried.inherited_count) {
            *p = walk->inherited[carried.inherited_first + k];
            continue;
        }
        read_perturbation(walk, ir_operand(ir, id, k - carried.inherited_count + 1), carried.map, p);
        p->strength *= carried.sign;
    }
    carried.inherited_first = first;
    carried.inherited_count += count - 1;
    walk_field(walk, ir_operand(ir, id, 0), carried);
    walk->inherited_count = first;
}

// The paint that the first leaf has within this field, 0 if it has none: what is cut from it and unpainted looks the same. False where there is no leaf.
static bool first_paint(const Ir *ir, IrId id, IrId *paint)
{
    const IrNode *node = ir_at(ir, id);
    const IrId *operands = ir_operands(ir, id);
    switch (node->op) {
    case OP_EMPTY: return false;
    case OP_FIELD:
    case OP_QUADRIC: *paint = 0; return true;
    case OP_PAINT:
        if (!first_paint(ir, operands[0], paint)) return false;
        if (!*paint) *paint = operands[1];
        return true;
    case OP_UNION:
    case OP_INTERSECT:
        for (uint32_t k = 0; k < node->count; k++) {
            if (first_paint(ir, operands[k], paint)) return true;
        }
        return false;
    default: return first_paint(ir, operands[0], paint);
    }
}

static void walk_field(Walk *walk, IrId id, Carried carried)
{
    Oracle *oracle = walk->oracle;
    const IrNode *node = ir_at(oracle->ir, id);
    const IrId *operands = ir_operands(oracle->ir, id);
    uint32_t at;
    double inverse[12], local[12];
    switch (node->op) {
    case OP_FIELD:
    case OP_QUADRIC: walk_leaf(walk, id, &carried); return;
    case OP_MORPH: walk_morph(walk, id, carried); return;
    case OP_FREEFORM:
    case OP_DEFORM: walk_deformed(walk, id, carried); return;
    case OP_PAINT:
        carried.paint = operands[1];
        walk_field(walk, operands[0], carried);
        return;
    case OP_NAMED:
        if (!*carried.name) carried.name = node->text;
        walk_field(walk, operands[0], carried);
        return;
    case OP_TRANSFORM:
        if (!map_inverse(oracle->maps[operands[1]], inverse)) fail(walk, "a transform is singular");
        map_compose(inverse, carried.map, local);
        carried.map = local;
        walk_field(walk, operands[0], carried);
        return;
    case OP_SHOW:
        if (oracle->scalars[operands[1]] != 0) {
            walk_field(walk, operands[0], carried);
            return;
        }
        at = add_node(oracle, ORACLE_EMPTY);
        break;
    case OP_EMPTY: at = add_node(oracle, ORACLE_EMPTY); break;
    case OP_COMPLEMENT:
        at = add_node(oracle, ORACLE_NOT);
        carried.sign = -carried.sign;
        walk_field(walk, operands[0], carried);
        break;
    case OP_UNION:
    case OP_INTERSECT:
        at = add_node(oracle, node->op == OP_UNION ? ORACLE_UNION : ORACLE_INTERSECT);
        for (uint32_t k = 0; k < node->count; k++) {
            Carried below = carried;
            IrId paint = 0;
            bool cut = node->op == OP_INTERSECT && k > 0 && ir_at(oracle->ir, operands[k])->op == OP_COMPLEMENT;
            if (cut && first_paint(oracle->ir, operands[0], &paint) && paint) below.paint = paint;
            walk_field(walk, operands[k], below);
        }
        break;
    default: fail(walk, "a general field: rays meet only quadrics, free forms and their sets here");
    }
    oracle->nodes[at].after = oracle->node_count;
}

// Where a quadric of an intersection is negative, nothing else of the intersection matters: so an endless field has an end on most rays.
static void find_guards(Oracle *oracle, uint32_t at, const uint32_t *above, uint32_t above_count)
{
    const OracleNode *node = &oracle->nodes[at];
    uint32_t guards[4], count = above_count;
    if (above_count) memcpy(guards, above, above_count * sizeof *above);
    if (node->kind == ORACLE_LEAF) {
        OracleLeaf *leaf = &oracle->leaves[node->leaf];
        memcpy(leaf->guards, guards, sizeof leaf->guards);
        leaf->guard_count = count;
        return;
    }
    for (uint32_t k = at + 1; node->kind == ORACLE_INTERSECT && k < node->after; k = oracle->nodes[k].after) {
        const OracleNode *child = &oracle->nodes[k];
        bool plain = child->kind == ORACLE_LEAF && !oracle->leaves[child->leaf].field_count &&
                     !oracle->leaves[child->leaf].count;
        if (plain && count < 4) guards[count++] = child->leaf;
    }
    for (uint32_t k = at + 1; k < node->after; k = oracle->nodes[k].after) find_guards(oracle, k, guards, count);
}

static void read_scene(Walk *walk)
{
    Oracle *oracle = walk->oracle;
    const Ir *ir = oracle->ir;
    for (int k = 0; k < 15; k++) oracle->camera[k] = oracle->scalars[ir_operand(ir, ir->camera, (uint32_t)k)];
    oracle->orthographic = ir_at(ir, ir->camera)->index == 1;
    for (int k = 0; k < 3; k++) oracle->background[k] = oracle->scalars[ir_operand(ir, ir->background, (uint32_t)k)];
    oracle->lights = arena_array(&oracle->arena, OracleLight, ir->light_count);
    oracle->light_count = ir->light_count;
    for (uint32_t i = 0; i < ir->light_count; i++) {
        oracle->lights[i].kind = (int)ir_at(ir, ir->lights[i])->index;
        for (int k = 0; k < 14; k++)
            oracle->lights[i].v[k] = oracle->scalars[ir_operand(ir, ir->lights[i], (uint32_t)k)];
    }
}

// Where something fails, fail() comes back here.
static bool read_all(Walk *walk, const OracleFrame *frame)
{
    if (setjmp(walk->failed)) return false;
    evaluate_numbers(walk, frame);
    read_scene(walk);
    walk_field(walk, walk->oracle->ir->root, (Carried){.map = identity_map, .name = "", .sign = 1, .weight = 1});
    find_guards(walk->oracle, 0, NULL, 0);
    return true;
}

static void default_inputs(const Ir *ir, double *inputs)
{
    for (uint32_t i = 0; i < ir->param_count; i++) {
        const IrParam *p = &ir->params[i];
        uint32_t slots = p->type == PARAM_VEC2 ? 2 : p->type == PARAM_VEC3 || p->type == PARAM_COLOR ? 3 : 1;
        for (uint32_t k = 0; k < slots && !p->structure; k++) inputs[p->slot + k] = p->value[k];
    }
}

Oracle *oracle_new(const Ir *ir, const OracleFrame *frame, char why[ORACLE_ERROR])
{
    Oracle *oracle = calloc(1, sizeof *oracle);
    if (!oracle) abort();
    oracle->ir = ir;
    double *inputs = arena_array(&oracle->arena, double, ir->input_count);
    default_inputs(ir, inputs);
    Walk walk = {.oracle = oracle, .why = why};
    OracleFrame given = {frame->time, frame->frame, frame->inputs ? frame->inputs : inputs};
    bool good = read_all(&walk, &given);
    free(walk.inherited);
    if (!good) {
        oracle_free(oracle);
        return NULL;
    }
    oracle->scratch = oracle_scratch_new();
    oracle->plain = oracle_plain_new(oracle);
    return oracle;
}

void oracle_free(Oracle *oracle)
{
    if (!oracle) return;
    oracle_scratch_free(oracle->scratch);
    oracle_plain_free(oracle->plain);
    free(oracle->nodes);
    oracle_expressions_free(oracle);
    free(oracle->leaves);
    free(oracle->bases);
    free(oracle->perturbations);
    arena_release(&oracle->arena);
    free(oracle);
}

// -- the tree at a point -------------------------------------------------------------------------------------------------------

static double quadric_at(const OracleQuadric *quadric, const double point[3], double gradient[3])
{
    if (quadric->map.identity) return oracle_quadric_field(quadric->a, point, gradient);
    double local[3];
    oracle_map_point(quadric->map.m, point, local);
    double f = oracle_quadric_field(quadric->a, local, gradient);
    if (gradient) map_gradient(quadric->map.m, gradient, gradient);
    return f;
}

static double base_at(const OracleBase *base, const double point[3], double gradient[3])
{
    if (!base->field) return quadric_at(&base->quadric, point, gradient);
    double local[3];
    oracle_map_point(base->quadric.map.m, point, local);
    double f = oracle_expression_at(base->field, local, gradient);
    if (gradient) map_gradient(base->quadric.map.m, gradient, gradient);
    return f;
}

double oracle_leaf_field(const Oracle *oracle, uint32_t index, const double point[3], double gradient[3])
{
    const OracleLeaf *leaf = &oracle->leaves[index];
    double f = 0;
    if (gradient) memset(gradient, 0, 3 * sizeof *gradient);
    for (uint32_t k = 0; k < leaf->base_count; k++) {
        const OracleBase *base = &oracle->bases[leaf->first_base + k];
        double g[3];
        f += base->weight * base_at(base, point, gradient ? g : NULL);
        if (gradient) add_scaled(gradient, base->weight, g);
    }
    for (uint32_t k = 0; k < leaf->count; k++) {
        const OraclePerturbation *p = &oracle->perturbations[leaf->first + k];
        double g[3], q = quadric_at(&p->quadric, point, gradient ? g : NULL);
        if (q <= 0) continue;
        f += p->strength * q * q * q;
        if (gradient) add_scaled(gradient, 3 * p->strength * q * q, g);
    }
    return f;
}

static double tree_field(const Oracle *oracle, uint32_t at, const double point[3], double gradient[3])
{
    const OracleNode *node = &oracle->nodes[at];
    double g[3] = {0}, f;
    switch (node->kind) {
    case ORACLE_LEAF: return oracle_leaf_field(oracle, node->leaf, point, gradient);
    case ORACLE_EMPTY: return -ORACLE_INFINITY;
    case ORACLE_NOT:
        f = tree_field(oracle, at + 1, point, gradient);
        for (int i = 0; gradient && i < 3; i++) gradient[i] = -gradient[i];
        return -f;
    default:
        f = tree_field(oracle, at + 1, point, gradient);
        for (uint32_t k = oracle->nodes[at + 1].after; k < node->after; k = oracle->nodes[k].after) {
            double h = tree_field(oracle, k, point, gradient ? g : NULL);
            if (node->kind == ORACLE_UNION ? h <= f : h >= f) continue;
            f = h;
            if (gradient) memcpy(gradient, g, sizeof g);
        }
        return f;
    }
}

double oracle_field(const Oracle *oracle, const double point[3], double gradient[3])
{
    if (gradient) memset(gradient, 0, 3 * sizeof *gradient);
    return tree_field(oracle, 0, point, gradient);
}
