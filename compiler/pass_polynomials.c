// General fields that are quadrics: F is a polynomial of degree 2 at most in x, y and z, whatever way it is written.
//
// Two sweeps over all nodes. The first, upwards, finds of each expression its degree, which costs a few comparisons; of what
// is a quadric's the second marks, downwards, and then makes, upwards, the ten coefficients, as scalars that a frame may
// change. Degrees are those of the text: x^3 - x^3 + x is one of degree 3 and stays a general field.
#include <string.h>

#include "compiler/leaf.h"
#include "compiler/passes.h"
#include "compiler/walk.h"

enum { DEGREE_NONE = 3 }; // and whatever is no polynomial

// The powers of coordinate i are at 1 + i (linear) in the order below; a product of two is at product[i][j].
enum { SQUARES = 0, LINEAR = 6, FREE = 9, COEFFICIENTS = 10 };
static const uint8_t product[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};

typedef struct Polynomial {
    IrId c[COEFFICIENTS]; // as OP_QUADRIC has them; 0: the number 0
} Polynomial;

typedef struct Polynomials {
    Ir *ir;
    IrId end;         // nodes that were there
    uint8_t *degrees; // of each scalar; 0 where it does not depend on the point
    bool *wanted;
    Polynomial **made;
    Arena *scratch;
} Polynomials;

// --- degrees

// x^0, x^1 and x^2, which may be written x^2.0.
static int exponent_of(const Ir *ir, IrId id)
{
    double value;
    if (!ir_is_const(ir, id, &value)) return DEGREE_NONE;
    return value == 0 || value == 1 || value == 2 ? (int)value : DEGREE_NONE;
}

static bool is_divisor(const Ir *ir, IrId id)
{
    double value;
    return ir_is_const(ir, id, &value) && value != 0;
}

static int degree_of(const Polynomials *p, IrId id)
{
    const Ir *ir = p->ir;
    const IrNode *node = ir_at(ir, id);
    if (node->type != IR_SCALAR) return DEGREE_NONE;
    if (node->rate != RATE_POINT) return 0;
    int a = node->count > 0 ? p->degrees[ir_operand(ir, id, 0)] : DEGREE_NONE;
    int b = node->count > 1 ? p->degrees[ir_operand(ir, id, 1)] : DEGREE_NONE;
    switch ((IrOp)node->op) {
    case OP_X:
    case OP_Y:
    case OP_Z: return 1;
    case OP_NEG: return a;
    case OP_ADD:
    case OP_SUB: return a > b ? a : b;
    case OP_MUL: return a + b < DEGREE_NONE ? a + b : DEGREE_NONE;
    case OP_DIV: return is_divisor(ir, ir_operand(ir, id, 1)) ? a : DEGREE_NONE;
    case OP_POW: {
        int power = exponent_of(ir, ir_operand(ir, id, 1));
        return a < DEGREE_NONE && power < DEGREE_NONE && a * power < DEGREE_NONE ? a * power : DEGREE_NONE;
    }
    default: return DEGREE_NONE;
    }
}

// --- coefficients

static IrId op2(Polynomials *p, IrOp op, Span span, IrId a, IrId b)
{
    return ir_op2(p->ir, op, span, a, b);
}

static IrId times(Polynomials *p, Span span, IrId a, IrId b)
{
    return a && b ? op2(p, OP_MUL, span, a, b) : 0;
}

static void add_to(Polynomials *p, Span span, IrId *sum, IrId term)
{
    if (term) *sum = *sum ? op2(p, OP_ADD, span, *sum, term) : term;
}

static void sum_of(Polynomials *p, Span span, IrOp op, const Polynomial *a, const Polynomial *b, Polynomial *result)
{
    for (int k = 0; k < COEFFICIENTS; k++) {
        IrId x = a->c[k], y = b->c[k];
        if (y && op == OP_SUB) y = ir_op1(p->ir, OP_NEG, span, y);
        result->c[k] = x;
        add_to(p, span, &result->c[k], y);
    }
}

// Of degree 2 at most.
static void product_of(Polynomials *p, Span span, const Polynomial *a, const Polynomial *b, Polynomial *result)
{
    for (int k = 0; k < FREE; k++) add_to(p, span, &result->c[k], times(p, span, a->c[k], b->c[FREE]));
    for (int k = 0; k < FREE; k++) add_to(p, span, &result->c[k], times(p, span, a->c[FREE], b->c[k]));
    add_to(p, span, &result->c[FREE], times(p, span, a->c[FREE], b->c[FREE]));
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            add_to(p, span, &result->c[product[i][j]], times(p, span, a->c[LINEAR + i], b->c[LINEAR + j]));
    }
}

static const Polynomial *polynomial_of(Polynomials *p, IrId id)
{
    if (p->made[id]) return p->made[id];
    p->made[id] = arena_new(p->scratch, Polynomial); // what does not depend on the point
    p->made[id]->c[FREE] = id;
    return p->made[id];
}

static void make(Polynomials *p, IrId id)
{
    IrNode node = *ir_at(p->ir, id);
    Polynomial *result = arena_new(p->scratch, Polynomial);
    IrId o[2] = {0};
    const Polynomial *part[2] = {0};
    for (uint32_t k = 0; k < node.count && k < 2; k++) {
        o[k] = ir_operand(p->ir, id, k);
        part[k] = polynomial_of(p, o[k]);
    }
    switch ((IrOp)node.op) {
    case OP_NEG: sum_of(p, node.span, OP_SUB, &(Polynomial){0}, part[0], result); break;
    case OP_ADD:
    case OP_SUB: sum_of(p, node.span, (IrOp)node.op, part[0], part[1], result); break;
    case OP_MUL: product_of(p, node.span, part[0], part[1], result); break;
    case OP_DIV:
        for (int k = 0; k < COEFFICIENTS; k++)
            if (part[0]->c[k]) result->c[k] = op2(p, OP_DIV, node.span, part[0]->c[k], o[1]);
        break;
    case OP_POW: {
        int power = exponent_of(p->ir, o[1]);
        if (power == 2) product_of(p, node.span, part[0], part[0], result);
        if (power == 1) *result = *part[0];
        if (power == 0) result->c[FREE] = ir_const(p->ir, 1);
        break;
    }
    default: result->c[LINEAR + (node.op - OP_X)] = ir_const(p->ir, 1);
    }
    p->made[id] = result;
}

// --- the fields

// Numbers that overflow stay in the field, where they are undefined at some points and not everywhere.
static IrId quadric_of(Polynomials *p, IrId field)
{
    IrId expression = ir_operand(p->ir, field, 0), operands[COEFFICIENTS], zero = ir_const(p->ir, 0);
    const Polynomial *f = polynomial_of(p, expression);
    for (int k = 0; k < COEFFICIENTS; k++) {
        operands[k] = f->c[k] ? f->c[k] : zero;
        const IrNode *node = ir_at(p->ir, operands[k]);
        if (node->rate == RATE_CONST && node->op != OP_CONST) return field;
    }
    return ir_node(p->ir, OP_QUADRIC, ir_at(p->ir, field)->span, operands, COEFFICIENTS);
}

static bool is_polynomial(const Polynomials *p, IrId id)
{
    return ir_at(p->ir, id)->op == OP_FIELD && p->degrees[ir_operand(p->ir, id, 0)] < DEGREE_NONE;
}

static void find(Polynomials *p)
{
    Ir *ir = p->ir;
    for (IrId id = 1; id < p->end; id++) p->degrees[id] = (uint8_t)degree_of(p, id);
    for (IrId id = p->end - 1; id > 0; id--) {
        if (is_polynomial(p, id)) p->wanted[ir_operand(ir, id, 0)] = true;
        if (!p->wanted[id] || ir_at(ir, id)->rate != RATE_POINT) continue;
        for (uint32_t k = 0; k < ir_at(ir, id)->count; k++) p->wanted[ir_operand(ir, id, k)] = true;
    }
    for (IrId id = 1; id < p->end; id++) {
        if (p->wanted[id] && ir_at(ir, id)->rate == RATE_POINT) make(p, id);
    }
}

static void down(Walk *walk, IrId id, uint32_t context)
{
    walk_reach_operands(walk, id, context);
}

static IrId up(Walk *walk, IrId id, uint32_t context)
{
    Polynomials *p = walk->pass;
    if (id < p->end && is_polynomial(p, id)) return quadric_of(p, id);
    return walk_rebuild(walk, id, context);
}

static bool has_polynomial(const Polynomials *p)
{
    for (IrId id = 1; id < p->end; id++)
        if (ir_at(p->ir, id)->op == OP_FIELD) return true;
    return false;
}

bool pass_polynomials(Ir *ir, Arena *scratch)
{
    Polynomials p = {.ir = ir, .end = ir->root + 1, .scratch = scratch};
    if (!has_polynomial(&p)) return true;
    p.degrees = arena_array(scratch, uint8_t, p.end);
    p.wanted = arena_array(scratch, bool, p.end);
    p.made = arena_array(scratch, Polynomial *, p.end);
    find(&p);
    Walk walk = {.ir = ir, .scratch = scratch, .pass = &p};
    IrId root = walk_run(&walk, ir->root, 0, down, up);
    if (root) ir->root = root;
    return root != 0;
}
