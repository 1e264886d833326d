#include "compiler/radius.h"

#include <math.h>
#include <string.h>

#include "compiler/leaf.h"
#include "compiler/object.h"
#include "compiler/radius_quadric.h"
#include "compiler/rigid.h"
#include "compiler/walk.h"

// A quadric of a closed form: k |P X + h|² + c with the projection P on `rank` axes, k = 0 for half-spaces. Its entries
// are known within rounding: FORM_ERROR of the largest.
typedef struct Form {
    int rank; // 0: a half-space
    double k, P[3][3];
    double linear[3]; // of the quadric
    double square;    // the radius or half thickness, squared; negative: empty
} Form;

#define FORM_ERROR 1e-12

typedef struct Offset {
    Pairs radii; // contexts: the radius of each, a scalar, and its RadiusSign
    RadiusProblem problem;
    Span where;
} Offset;

static bool near(double a, double b, double scale)
{
    return fabs(a - b) <= FORM_ERROR * scale;
}

// P P = P
static bool is_projection(double P[3][3])
{
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++) sum += P[i][k] * P[k][j];
            if (!near(sum, P[i][j], 16)) return false;
        }
    }
    return true;
}

// Whether the quadric is of this rank; S is its symmetric matrix, of another size than 0.
static bool has_rank(double S[3][3], const double q[10], int rank, Form *form)
{
    form->rank = rank;
    form->k = (S[0][0] + S[1][1] + S[2][2]) / rank;
    if (form->k == 0) return false;
    double length = 0, projected = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) form->P[i][j] = S[i][j] / form->k;
        form->linear[i] = q[6 + i];
        length += q[6 + i] * q[6 + i];
    }
    if (!is_projection(form->P)) return false;
    for (int i = 0; i < 3; i++) {
        double along = 0;
        for (int j = 0; j < 3; j++) along += form->P[i][j] * q[6 + j];
        projected += (along - q[6 + i]) * (along - q[6 + i]);
    }
    form->square = (length / (4 * form->k) - q[9]) / form->k;
    return projected <= FORM_ERROR * FORM_ERROR * length;
}

static bool form_of(const double q[10], Form *form)
{
    double S[3][3] = {{q[0], q[3] / 2, q[4] / 2}, {q[3] / 2, q[1], q[5] / 2}, {q[4] / 2, q[5] / 2, q[2]}};
    double largest = 0;
    for (int k = 0; k < 6; k++) largest = fmax(largest, fabs(q[k]));
    if (largest == 0) {
        *form = (Form){.linear = {q[6], q[7], q[8]}};
        return q[6] != 0 || q[7] != 0 || q[8] != 0;
    }
    for (int rank = 1; rank <= 3; rank++) {
        if (has_rank(S, q, rank, form)) return true;
    }
    return false;
}

// --- quadrics

static IrId op2(Ir *ir, Span span, IrOp op, IrId a, IrId b)
{
    return ir_op2(ir, op, span, a, b);
}

static IrId with_free_term(Ir *ir, IrId quadric, IrId free_term)
{
    IrId operands[10];
    memcpy(operands, ir_operands(ir, quadric), sizeof operands);
    operands[9] = free_term;
    return ir_node(ir, OP_QUADRIC, ir_at(ir, quadric)->span, operands, 10);
}

// r |r| for r = sqrt(square) ± radius, so that what shrinks to nothing is empty and stays so. What is outside of a ball
// (k > 0) shrinks the ball as it grows.
static IrId changed_square(Ir *ir, Span span, IrId square, double k, IrId radius)
{
    IrId root = ir_op1(ir, OP_SQRT, span, op2(ir, span, OP_MAX, square, ir_const(ir, 0)));
    IrId r = op2(ir, span, k < 0 ? OP_ADD : OP_SUB, root, radius);
    IrId signed_square = op2(ir, span, OP_MUL, r, ir_op1(ir, OP_ABS, span, r));
    return ir_op3(ir, OP_SELECT, span, op2(ir, span, OP_LT, square, ir_const(ir, 0)), square, signed_square);
}

static IrId offset_const(Ir *ir, IrId quadric, const double q[10], IrId radius)
{
    Form form;
    Span span = ir_at(ir, quadric)->span;
    if (!form_of(q, &form)) return 0;
    IrId free_term = ir_operand(ir, quadric, 9);
    if (form.rank == 0) {
        IrId slope = ir_const(ir, sqrt(q[6] * q[6] + q[7] * q[7] + q[8] * q[8]));
        return with_free_term(ir, quadric, op2(ir, span, OP_ADD, free_term, op2(ir, span, OP_MUL, slope, radius)));
    }
    IrId square = ir_const(ir, form.square), k = ir_const(ir, form.k);
    IrId change = op2(ir, span, OP_SUB, changed_square(ir, span, square, form.k, radius), square);
    return with_free_term(ir, quadric, op2(ir, span, OP_SUB, free_term, op2(ir, span, OP_MUL, k, change)));
}

static bool is_zero(const Ir *ir, IrId id)
{
    double value;
    return ir_is_const(ir, id, &value) && value == 0;
}

// A ball about any point whose coefficients move: three equal ones, the mixed ones 0, and k < 0 since `sphere` says so by
// its radius. The square of the radius is (|b|² / 4k - c) / k.
static IrId offset_moving_ball(Ir *ir, IrId quadric, IrId radius)
{
    IrId o[10];
    memcpy(o, ir_operands(ir, quadric), sizeof o);
    Span span = ir_at(ir, quadric)->span;
    if (o[0] != o[1] || o[1] != o[2] || is_zero(ir, o[0])) return 0;
    if (!is_zero(ir, o[3]) || !is_zero(ir, o[4]) || !is_zero(ir, o[5])) return 0;
    IrId length = ir_const(ir, 0), k = o[0];
    for (int i = 6; i < 9; i++) length = op2(ir, span, OP_ADD, length, op2(ir, span, OP_MUL, o[i], o[i]));
    IrId quarter = op2(ir, span, OP_DIV, length, op2(ir, span, OP_MUL, ir_const(ir, 4), k));
    IrId square = op2(ir, span, OP_DIV, op2(ir, span, OP_SUB, quarter, o[9]), k);
    IrId outward = op2(ir, span, OP_MUL, radius, ir_op1(ir, OP_SIGN, span, ir_op1(ir, OP_NEG, span, k)));
    IrId change = op2(ir, span, OP_SUB, changed_square(ir, span, square, -1, outward), square);
    return with_free_term(ir, quadric, op2(ir, span, OP_SUB, o[9], op2(ir, span, OP_MUL, k, change)));
}

// Where the class cannot stay, a general field.
static IrId offset_quadric(Ir *ir, IrId quadric, IrId radius)
{
    double q[10];
    IrId same = leaf_const_quadric(ir, quadric, q) ? offset_const(ir, quadric, q, radius)
                                                   : offset_moving_ball(ir, quadric, radius);
    if (same) return same;
    IrId expression = radius_quadric(ir, quadric, radius);
    return expression ? ir_op1(ir, OP_FIELD, ir_at(ir, quadric)->span, expression) : 0;
}

static IrId failed(Offset *o, const Ir *ir, IrId id, RadiusProblem problem)
{
    if (!o->problem) {
        o->problem = problem;
        o->where = ir_at(ir, id)->span;
    }
    return id;
}

static IrId offset_base(Walk *walk, IrId base, IrId radius)
{
    Ir *ir = walk->ir;
    IrId matrix, function = leaf_function(ir, base, &matrix);
    if (ir_at(ir, function)->op != OP_QUADRIC) return failed(walk->pass, ir, base, RADIUS_SHAPE);
    // Maps that do not move are in the coefficients already.
    if (matrix && !matrix_is_rigid(ir, matrix)) return failed(walk->pass, ir, base, RADIUS_MOVES);
    IrId result = offset_quadric(ir, function, radius);
    if (!result) return failed(walk->pass, ir, base, RADIUS_SHAPE);
    return matrix ? ir_op2(ir, OP_TRANSFORM, ir_at(ir, base)->span, result, matrix) : result;
}

// --- intersections of parts at right angles

enum { CORNER_MAX = 3 };

typedef struct Corner {
    IrId parts[CORNER_MAX];
    Form forms[CORNER_MAX];
    int count;
    IrId matrix; // that moves all of them together; 0: none
} Corner;

// All parts are quadrics that do not move, or all together, convex, and each depends on directions of its own.
static bool find_corner(const Ir *ir, IrId id, Corner *corner)
{
    for (uint32_t k = 0; k < ir_at(ir, id)->count; k++) {
        IrId part = ir_operand(ir, id, k);
        double q[10];
        if (ir_at(ir, part)->op == OP_INTERSECT) {
            if (!find_corner(ir, part, corner)) return false;
            continue;
        }
        IrId matrix;
        part = leaf_function(ir, part, &matrix);
        if (corner->count == CORNER_MAX || !leaf_const_quadric(ir, part, q)) return false;
        if (corner->count && matrix != corner->matrix) return false;
        corner->matrix = matrix;
        Form *form = &corner->forms[corner->count];
        if (!form_of(q, form) || form->k > 0 || (form->rank && form->square < 0)) return false;
        corner->parts[corner->count++] = part;
    }
    return true;
}

// The directions that a part depends on, as a projection.
static void directions(const Form *form, double P[3][3])
{
    memcpy(P, form->P, sizeof form->P);
    const double *n = form->linear;
    double length = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    for (int i = 0; i < 3 && form->rank == 0; i++) {
        for (int j = 0; j < 3; j++) P[i][j] = n[i] * n[j] / length;
    }
}

static bool at_right_angles(const Form *a, const Form *b)
{
    double A[3][3], B[3][3];
    directions(a, A);
    directions(b, B);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++) sum += A[i][k] * B[k][j];
            if (fabs(sum) > FORM_ERROR) return false;
        }
    }
    return true;
}

static IrId linear(Ir *ir, Span span, const double a[3], double constant)
{
    static const IrOp axes[3] = {OP_X, OP_Y, OP_Z};
    IrId sum = ir_const(ir, constant);
    for (int k = 0; k < 3; k++) {
        if (a[k] == 0) continue;
        IrId axis = ir_node(ir, axes[k], span, NULL, 0);
        sum = op2(ir, span, OP_ADD, op2(ir, span, OP_MUL, axis, ir_const(ir, a[k])), sum);
    }
    return sum;
}

// How far a point is outside of a part; negative: how deep inside. With k |P X + h|² + c, h = b / 2k: |P X + h| - r.
static IrId distance(Ir *ir, Span span, IrId quadric, const Form *form)
{
    double free_term = 0, row[3];
    if (form->rank == 0) {
        const double *n = form->linear;
        double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        ir_is_const(ir, ir_operand(ir, quadric, 9), &free_term);
        for (int k = 0; k < 3; k++) row[k] = -n[k] / length;
        return linear(ir, span, row, -free_term / length);
    }
    double r = sqrt(form->square);
    if (form->rank == 1) { // P = n nᵀ: the row of the largest entry gives n
        int i = form->P[0][0] > 0.3 ? 0 : form->P[1][1] > 0.3 ? 1 : 2;
        double along = 0, n = sqrt(form->P[i][i]);
        for (int k = 0; k < 3; k++) {
            row[k] = form->P[i][k] / n;
            along += row[k] * form->linear[k];
        }
        IrId x = ir_op1(ir, OP_ABS, span, linear(ir, span, row, along / (2 * form->k)));
        return op2(ir, span, OP_SUB, x, ir_const(ir, r));
    }
    IrId sum = ir_const(ir, 0);
    for (int i = 0; i < 3; i++) {
        IrId x = linear(ir, span, form->P[i], form->linear[i] / (2 * form->k));
        sum = op2(ir, span, OP_ADD, sum, op2(ir, span, OP_MUL, x, x));
    }
    return op2(ir, span, OP_SUB, ir_op1(ir, OP_SQRT, span, sum), ir_const(ir, r));
}

// 0 where it is no such intersection.
static IrId grown_corner(Ir *ir, IrId id, IrId radius)
{
    Corner corner = {0};
    Span span = ir_at(ir, id)->span;
    if (!find_corner(ir, id, &corner)) return 0;
    if (corner.matrix && !matrix_is_rigid(ir, corner.matrix)) return 0;
    for (int i = 0; i < corner.count; i++) {
        for (int j = 0; j < i; j++) {
            if (!at_right_angles(&corner.forms[i], &corner.forms[j])) return 0;
        }
    }
    IrId zero = ir_const(ir, 0), squares = zero, deepest = 0;
    for (int k = 0; k < corner.count; k++) {
        IrId d = distance(ir, span, corner.parts[k], &corner.forms[k]), outside = op2(ir, span, OP_MAX, d, zero);
        squares = op2(ir, span, OP_ADD, squares, op2(ir, span, OP_MUL, outside, outside));
        deepest = deepest ? op2(ir, span, OP_MAX, deepest, d) : d;
    }
    IrId away = op2(ir, span, OP_ADD, ir_op1(ir, OP_SQRT, span, squares), op2(ir, span, OP_MIN, deepest, zero));
    IrId grown = ir_op1(ir, OP_FIELD, span, op2(ir, span, OP_SUB, radius, away));
    return corner.matrix ? ir_op2(ir, OP_TRANSFORM, span, grown, corner.matrix) : grown;
}

// --- the walk

static uint32_t below(Walk *walk, IrId id, uint32_t context)
{
    Offset *o = walk->pass;
    if (ir_at(walk->ir, id)->op != OP_COMPLEMENT) return context;
    IrId radius = o->radii.list[context].a;
    double value;
    IrId opposite = ir_is_const(walk->ir, radius, &value) ? ir_const(walk->ir, 0 - value)
                                                          : ir_op1(walk->ir, OP_NEG, ir_at(walk->ir, id)->span, radius);
    uint32_t sign = o->radii.list[context].b;
    return pairs_index(&o->radii, opposite, sign ? RADIUS_GROWS + RADIUS_SHRINKS - sign : RADIUS_ANY, NULL);
}

static void down(Walk *walk, IrId id, uint32_t context)
{
    IrOp op = ir_at(walk->ir, id)->op;
    if (op == OP_UNION || op == OP_INTERSECT || op == OP_COMPLEMENT || op == OP_PAINT || op == OP_NAMED ||
        op == OP_SHOW)
        walk_reach_operands(walk, id, below(walk, id, context));
}

// Unions grow and intersections shrink part by part; the others have edges or seams of their own.
static IrId offset_set(Walk *walk, IrId id, uint32_t context)
{
    Offset *o = walk->pass;
    Ir *ir = walk->ir;
    IrId radius = o->radii.list[context].a;
    RadiusSign sign = (RadiusSign)o->radii.list[context].b;
    if (sign == RADIUS_ANY) return failed(o, ir, id, RADIUS_SIGN);
    bool simple = (ir_at(ir, id)->op == OP_UNION) == (sign == RADIUS_GROWS);
    if (simple) return walk_rebuild(walk, id, context);
    IrId grown = sign == RADIUS_GROWS ? grown_corner(ir, id, radius) : 0;
    return grown ? grown : failed(o, ir, id, RADIUS_CORNER);
}

static IrId up(Walk *walk, IrId id, uint32_t context)
{
    Offset *o = walk->pass;
    Ir *ir = walk->ir;
    if (leaf_is_base(ir, id)) return offset_base(walk, id, o->radii.list[context].a);
    switch ((IrOp)ir_at(ir, id)->op) {
    case OP_EMPTY: return id;
    case OP_UNION:
    case OP_INTERSECT: return offset_set(walk, id, context);
    case OP_COMPLEMENT:
    case OP_PAINT:
    case OP_NAMED:
    case OP_SHOW: return walk_rebuild(walk, id, below(walk, id, context));
    default: return failed(o, ir, id, RADIUS_SHAPE);
    }
}

// Of a number, and of a handle with a range.
static RadiusSign sign_of(const Ir *ir, IrId radius, RadiusSign said)
{
    double value;
    if (ir_is_const(ir, radius, &value)) return value >= 0 ? RADIUS_GROWS : RADIUS_SHRINKS;
    for (uint32_t k = 0; said == RADIUS_ANY && ir_at(ir, radius)->op == OP_PARAM && k < ir->param_count; k++) {
        const IrParam *param = &ir->params[k];
        if (param->structure || !param->ranged || param->slot != ir_at(ir, radius)->index) continue;
        said = param->low >= 0 ? RADIUS_GROWS : param->high <= 0 ? RADIUS_SHRINKS : RADIUS_ANY;
    }
    return said;
}

IrId radius_offset(Ir *ir, IrId object, IrId radius, RadiusSign sign, RadiusProblem *problem, Span *where)
{
    Arena scratch = {0};
    Offset o = {.radii = pairs_new(&scratch)};
    Walk walk = {.ir = ir, .scratch = &scratch, .pass = &o};
    IrId result = 0;
    *problem = RADIUS_DONE;
    if (is_zero(ir, radius)) return object;
    IrId leaves = object_leaves(ir, object);
    if (leaves)
        result = walk_run(&walk, leaves, pairs_index(&o.radii, radius, sign_of(ir, radius, sign), NULL), down, up);
    *problem = result ? o.problem : RADIUS_MANY;
    *where = o.where;
    arena_release(&scratch);
    return o.problem ? 0 : result;
}
