// Curves through points, and what is random and yet always the same.
//
// spline: on the piece between two points it is a cubic, whose coefficients are known when the points are. Which piece
// it is, a frame finds out by one comparison for each, and chooses the coefficients by it: so a long path costs a frame
// a few operations a point, and moves without compiling anything.
#include <string.h>

#include "compiler/evaluator.h"

typedef struct Curve {
    Eval *e;
    const Node *node;
    const Value *points; // a list
    uint32_t count, pieces;
    bool closed;
} Curve;

static Scalar op(const Curve *c, IrOp operation, Scalar a, Scalar b)
{
    return scalar_op2(c->e, operation, c->node, a, b);
}

static Scalar times(const Curve *c, double factor, Scalar a)
{
    return op(c, OP_MUL, scalar_of(factor), a);
}

// Part k of a point. Beyond the ends of an open curve it is the reflection of the last but one at the last.
static Scalar part(const Curve *c, int64_t i, int k)
{
    const Value *items = c->points->list.items;
    int64_t n = c->count;
    if (c->closed) return value_part(&items[(i % n + n) % n], k);
    if (i < 0) return op(c, OP_SUB, times(c, 2, value_part(&items[0], k)), value_part(&items[1], k));
    if (i >= n) return op(c, OP_SUB, times(c, 2, value_part(&items[n - 1], k)), value_part(&items[n - 2], k));
    return value_part(&items[i], k);
}

// p + s/2 ((c − a) + s ((2a − 5p + 4c − d) + s (3 (p − c) + d − a))) between p and c; a is before them, d behind.
static void coefficients(const Curve *c, uint32_t piece, int k, Scalar r[4])
{
    Scalar a = part(c, (int64_t)piece - 1, k), p = part(c, piece, k), n = part(c, (int64_t)piece + 1, k),
           d = part(c, (int64_t)piece + 2, k);
    r[0] = p;
    r[1] = times(c, 0.5, op(c, OP_SUB, n, a));
    Scalar bend = op(c, OP_SUB, op(c, OP_SUB, times(c, 2, a), times(c, 5, p)), op(c, OP_SUB, d, times(c, 4, n)));
    r[2] = times(c, 0.5, bend);
    Scalar turn = op(c, OP_ADD, times(c, 3, op(c, OP_SUB, p, n)), op(c, OP_SUB, d, a));
    r[3] = times(c, 0.5, turn);
}

// How far along its piece the curve is at t, and for each part the coefficients of that piece.
static Scalar find_piece(const Curve *c, Scalar t, int size, Scalar r[3][4])
{
    Scalar whole = c->closed ? op(c, OP_MOD, t, scalar_of(1)) : unit_interval(c->e, c->node, t);
    Scalar u = times(c, c->pieces, whole), begin = scalar_of(c->pieces - 1);
    for (int k = 0; k < size; k++) coefficients(c, c->pieces - 1, k, r[k]);
    for (uint32_t i = c->pieces - 1; i-- > 0;) {
        Scalar here = op(c, OP_LT, u, scalar_of(i + 1));
        begin = scalar_select(c->e, c->node, here, scalar_of(i), begin);
        for (int k = 0; k < size; k++) {
            Scalar own[4];
            coefficients(c, i, k, own);
            for (int j = 0; j < 4; j++) r[k][j] = scalar_select(c->e, c->node, here, own[j], r[k][j]);
        }
    }
    return op(c, OP_SUB, u, begin);
}

static bool curve_of(Eval *e, const Node *node, const Call *call, const Value *args, Curve *c)
{
    double closed;
    if (!want_const(e, bound_node(call, 2, node), args[2].scalar, "whether a curve is closed", &closed)) return false;
    *c = (Curve){.e = e, .node = node, .points = &args[0], .count = args[0].list.count, .closed = closed != 0};
    c->pieces = c->closed ? c->count : c->count - 1;
    if (c->count >= 2) return true;
    complain(e, bound_node(call, 0, node), DIAG_VALUE_COUNT, "a curve goes through two points at least");
    return false;
}

Value eval_spline(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Curve c;
    if (!curve_of(e, node, call, args, &c)) return value_bad();
    Type type = call->result;
    int size = value_size(type);
    Scalar r[3][4], parts[3], s = find_piece(&c, args[1].scalar, size, r);
    for (int k = 0; k < size; k++) {
        parts[k] = r[k][3];
        for (int j = 2; j >= 0; j--) parts[k] = op(&c, OP_ADD, op(&c, OP_MUL, parts[k], s), r[k][j]);
    }
    return size == 1 ? value_scalar(type, parts[0]) : value_vector(&e->scratch, type, parts, size);
}

// The direction in which the curve goes on, of length 1.
Value eval_heading(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Curve c;
    if (!curve_of(e, node, call, args, &c)) return value_bad();
    Type type = call->result;
    int size = value_size(type);
    Scalar r[3][4], parts[3], s = find_piece(&c, args[1].scalar, size, r), square = scalar_of(0);
    for (int k = 0; k < size; k++) { // c₁ + 2 c₂ s + 3 c₃ s²
        Scalar rest = op(&c, OP_ADD, times(&c, 2, r[k][2]), times(&c, 3, op(&c, OP_MUL, r[k][3], s)));
        parts[k] = op(&c, OP_ADD, r[k][1], op(&c, OP_MUL, rest, s));
        square = op(&c, OP_ADD, square, op(&c, OP_MUL, parts[k], parts[k]));
    }
    if (!square.id && square.number == 0) {
        complain(e, node, DIAG_DIVISION_BY_ZERO,
                 "the curve stands still here, so it has no heading: move its points apart");
        return value_bad();
    }
    Scalar length = scalar_op1(e, OP_SQRT, node, square);
    for (int k = 0; k < size; k++) parts[k] = op(&c, OP_DIV, parts[k], length);
    return value_vector(&e->scratch, type, parts, size);
}

// --- what is random

Value eval_random(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Scalar hash = scalar_of(0), low = args[1].vector[0], high = args[1].vector[1];
    for (uint32_t i = 0; i < args[0].list.count; i++)
        hash = scalar_op2(e, OP_HASH, node, hash, args[0].list.items[i].scalar);
    Scalar t = scalar_op2(e, OP_MUL, node, hash, scalar_of(0x1p-32));
    Scalar way = scalar_op2(e, OP_MUL, node, scalar_op2(e, OP_SUB, node, high, low), t);
    return value_scalar(call->result, scalar_op2(e, OP_ADD, node, low, way));
}

static Scalar op3(Eval *e, const Node *node, IrOp operation, const Scalar p[3])
{
    for (int k = 0; k < 3; k++) {
        if (scalar_bad(p[k])) return p[k];
    }
    IrId id = ir_op3(e->ir, operation, span_of(e, node), scalar_id(e, p[0]), scalar_id(e, p[1]), scalar_id(e, p[2]));
    double number;
    return ir_is_const(e->ir, id, &number) ? scalar_of(number) : (Scalar){.id = id};
}

Value eval_noise(Eval *e, const Node *node, const Call *call, const Value *args)
{
    IrOp operation = call->callee->id == BUILTIN_CELLS ? OP_CELLS : OP_NOISE;
    return value_scalar(call->result, op3(e, node, operation, args[0].vector));
}

// Σ 2^-i noise(2^i p + i · shift) / Σ 2^-i. The shift keeps the whole points of the octaves, where each is 0, apart.
Value eval_fbm(Eval *e, const Node *node, const Call *call, const Value *args)
{
    static const double shift[3] = {5.3125, 9.6875, 2.1875};
    const Node *at = bound_node(call, 1, node);
    double octaves, total = 0;
    if (!want_const(e, at, args[1].scalar, "the number of octaves", &octaves)) return value_bad();
    if (octaves < 1 || octaves > 16) {
        complain(e, at, DIAG_OUT_OF_RANGE, "there are 1 to 16 octaves");
        return value_bad();
    }
    Scalar sum = scalar_of(0);
    for (int i = 0; i < octaves; i++) {
        Scalar p[3];
        for (int k = 0; k < 3; k++) {
            Scalar scaled = scalar_op2(e, OP_MUL, node, args[0].vector[k], scalar_of(ldexp(1, i)));
            p[k] = scalar_op2(e, OP_ADD, node, scaled, scalar_of(i * shift[k]));
        }
        Scalar one = scalar_op2(e, OP_MUL, node, op3(e, node, OP_NOISE, p), scalar_of(ldexp(1, -i)));
        sum = scalar_op2(e, OP_ADD, node, sum, one);
        total += ldexp(1, -i);
    }
    return value_scalar(call->result, scalar_op2(e, OP_DIV, node, sum, scalar_of(total)));
}
