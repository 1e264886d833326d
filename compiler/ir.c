// Nodes live in one array that grows by a factor. The arena keeps what was outgrown, but its pages go back to the system.
// Scalars and matrices are found again through a hash table of ids, so equal values are one node and a pass may
// compare them by id. Fields are not merged: two objects that are written twice are two objects, with a span each.
#include "compiler/ir.h"

#include <assert.h>
#include <math.h>
#include <string.h>
#include <sys/mman.h>

#include "compiler/eval.h"
#include "compiler/field.h"

#define ANY IR_ANY
const IrOpInfo ir_ops[OP_COUNT] = {
    {"none", "", 0, 0, IR_NONE},
#define OP(id, name, operands, types, result) {name, types, sizeof types - 1, operands, IR_##result},
#include "compiler/ops.def"
#undef OP
};
#undef ANY

// Open addressing. The hash beside the id spares the look at a node that is another, and at all nodes when the table
// grows.
typedef struct IrSlot {
    IrId id; // 0 is an empty place
    uint32_t hash;
} IrSlot;

typedef struct IrTable {
    IrSlot *slots;
    uint32_t capacity, count; // capacity is a power of two
} IrTable;

// --- memory

enum { PAGE = 4096, LARGE = 1 << 20 };

// Gives the pages of a large outgrown array back. The addresses stay the arena's; nobody reads there again.
static void forget(void *array, size_t size)
{
    uintptr_t begin = ((uintptr_t)array + PAGE - 1) / PAGE * PAGE, end = ((uintptr_t)array + size) / PAGE * PAGE;
    if (size >= LARGE && begin < end) madvise((void *)begin, end - begin, MADV_DONTNEED);
}

static void *grown(Arena *arena, void *old, uint32_t count, uint32_t *capacity, uint32_t wanted, size_t size)
{
    if (wanted <= *capacity) return old;
    uint32_t room = *capacity ? *capacity : 256;
    // A large array grows by more at once: what is not touched yet costs nothing, and copying it does.
    uint32_t factor = (size_t)room * size < LARGE ? 2 : 4;
    while (room < wanted) room = room > UINT32_MAX / factor ? UINT32_MAX : room * factor;
    void *array = arena_alloc_array(arena, size, room);
    if (count) memcpy(array, old, count * size);
    if (count) forget(old, count * size);
    *capacity = room;
    return array;
}

Ir *ir_new(Arena *arena)
{
    Ir *ir = arena_new(arena, Ir);
    ir->arena = arena;
    ir->table = arena_new(arena, IrTable);
    ir->nodes = grown(arena, NULL, 0, &ir->capacity, 1, sizeof *ir->nodes);
    ir->operands = grown(arena, NULL, 0, &ir->operand_capacity, 1, sizeof *ir->operands);
    ir->count = 1; // 0 is "none"
    ir->fps = 24;
    return ir;
}

void ir_reserve(Ir *ir, uint32_t nodes)
{
    enum { OPERANDS = 4 }; // of a node, where transformed quadrics are most of a scene
    if (nodes > UINT32_MAX / OPERANDS) return;
    ir->nodes = grown(ir->arena, ir->nodes, ir->count, &ir->capacity, nodes, sizeof *ir->nodes);
    ir->operands = grown(ir->arena, ir->operands, ir->operand_count, &ir->operand_capacity, nodes * OPERANDS,
                         sizeof *ir->operands);
}

// --- hash-consing

static bool is_shared(IrType type)
{
    return type == IR_SCALAR || type == IR_MATRIX;
}

static uint64_t mix(uint64_t h, uint64_t value)
{
    h = (h ^ value) * 0x9e3779b97f4a7c15u;
    return h ^ h >> 29;
}

static uint32_t hash_node(IrOp op, uint64_t bits, const IrId *operands, uint32_t count)
{
    uint64_t h = mix(op + 1, bits);
    for (uint32_t k = 0; k < count; k++) h = mix(h, operands[k]);
    return (uint32_t)(h >> 16);
}

static void table_put(IrTable *table, IrSlot slot)
{
    uint32_t mask = table->capacity - 1;
    uint32_t k = slot.hash & mask;
    while (table->slots[k].id) k = (k + 1) & mask;
    table->slots[k] = slot;
}

static void table_add(Ir *ir, IrId id, uint32_t hash)
{
    IrTable *table = ir->table;
    if (3 * (uint64_t)++table->count > 2 * (uint64_t)table->capacity) {
        IrSlot *old = table->slots;
        uint32_t old_capacity = table->capacity;
        table->capacity = old_capacity ? old_capacity * 2 : 1024;
        table->slots = arena_array(ir->arena, IrSlot, table->capacity);
        for (uint32_t k = 0; k < old_capacity; k++) {
            if (old[k].id) table_put(table, old[k]);
        }
        if (old) forget(old, old_capacity * sizeof *old);
    }
    table_put(table, (IrSlot){id, hash});
}

static IrId table_find(const Ir *ir, uint32_t hash, IrOp op, uint64_t bits, const IrId *operands, uint32_t count)
{
    const IrTable *table = ir->table;
    if (!table->capacity) return 0;
    uint32_t mask = table->capacity - 1;
    for (uint32_t k = hash & mask; table->slots[k].id; k = (k + 1) & mask) {
        if (table->slots[k].hash != hash) continue;
        IrId id = table->slots[k].id;
        const IrNode *node = ir_at(ir, id);
        bool same = node->op == op && node->bits == bits && node->count == count;
        const IrId *others = ir_operands(ir, id);
        for (uint32_t o = 0; same && o < count; o++) same = others[o] == operands[o];
        if (same) return id;
    }
    return 0;
}

// --- rates and classes

static IrRate own_rate(IrOp op)
{
    switch (op) {
    case OP_PARAM:
    case OP_TIME:
    case OP_FRAME: return RATE_FRAME;
    case OP_X:
    case OP_Y:
    case OP_Z:
    case OP_U:
    case OP_V: return RATE_POINT;
    default: return RATE_CONST;
    }
}

// The greater of both: of quadrics a quadric, of free forms one, of sets one.
static IrClass morph_class(const Ir *ir, const IrId *operands)
{
    IrClass a = ir_at(ir, operands[0])->class, b = ir_at(ir, operands[1])->class;
    return ir_at(ir, operands[2])->rate == RATE_POINT ? CLASS_GENERAL : a > b ? a : b;
}

static IrClass class_of(const Ir *ir, IrOp op, const IrId *operands, uint32_t count)
{
    if (ir_ops[op].result != IR_FIELD) return CLASS_NONE;
    if (op == OP_EMPTY || op == OP_SHEET || op == OP_THICKEN) return CLASS_SET;
    if (op == OP_FIELD) return CLASS_GENERAL;
    if (op == OP_QUADRIC) {
        for (uint32_t k = 0; k < count; k++) {
            if (ir_at(ir, operands[k])->rate == RATE_POINT) return CLASS_GENERAL;
        }
        return CLASS_QUADRIC;
    }
    IrClass base = ir_at(ir, operands[0])->class;
    switch (op) {
    case OP_FREEFORM:
    case OP_DEFORM: return base == CLASS_QUADRIC ? CLASS_FREEFORM : base;
    case OP_SHOW: return base == CLASS_GENERAL ? base : CLASS_SET;
    case OP_MORPH: return morph_class(ir, operands);
    case OP_UNION:
    case OP_INTERSECT:
        for (uint32_t k = 0; k < count; k++) {
            if (ir_at(ir, operands[k])->class == CLASS_GENERAL) return CLASS_GENERAL;
        }
        return CLASS_SET;
    default: return base; // a map or a mark of one field
    }
}

// --- nodes

static IrType letter_type(char letter)
{
    switch (letter) {
    case 's': return IR_SCALAR;
    case 'm': return IR_MATRIX;
    case 'f': return IR_FIELD;
    case 'p': return IR_PERTURBATION;
    case 'h': return IR_PATCH;
    case 'r': return IR_PART;
    default: return IR_MATERIAL;
    }
}

IrType ir_operand_type(IrOp op, uint32_t k)
{
    const IrOpInfo *info = &ir_ops[op];
    return info->letters ? letter_type(info->types[k < info->letters ? k : info->letters - 1u]) : IR_NONE;
}

__attribute__((unused)) // in builds without assertions
static bool
operands_fit(const Ir *ir, IrOp op, const IrId *operands, uint32_t count)
{
    const IrOpInfo *info = &ir_ops[op];
    if (info->operands == IR_ANY ? count < info->letters : count != info->operands) return false;
    for (uint32_t k = 0; k < count; k++) {
        if (!operands[k] || operands[k] >= ir->count || ir_at(ir, operands[k])->type != ir_operand_type(op, k))
            return false;
    }
    return true;
}

static bool is_question(IrOp op)
{
    return op == OP_PLACE || op == OP_SURFACE || op == OP_HEIGHT || op == OP_AT || op == OP_STEEPNESS;
}

IrRate ir_operand_rate(const Ir *ir, IrOp op, IrId operand)
{
    const IrNode *node = ir_at(ir, operand);
    if (is_question(op) && node->type == IR_FIELD) return node->moves ? RATE_FRAME : RATE_CONST;
    return (IrRate)node->rate;
}

static IrId append_new(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count, uint64_t bits)
{
    assert(operands_fit(ir, op, operands, count) && "operands are of the number and the types that ops.def says");
    IrRate rate = own_rate(op);
    bool moves = rate == RATE_FRAME || op == OP_PATCH;
    for (uint32_t k = 0; k < count; k++) {
        IrRate other = ir_operand_rate(ir, op, operands[k]);
        if (other > rate) rate = other;
        moves |= ir_at(ir, operands[k])->moves;
    }
    if (op == OP_PATCH) rate = RATE_FRAME; // its u, v, x, y, z are its own
    ir->nodes = grown(ir->arena, ir->nodes, ir->count, &ir->capacity, ir->count + 1, sizeof *ir->nodes);
    ir->operands = grown(ir->arena, ir->operands, ir->operand_count, &ir->operand_capacity, ir->operand_count + count,
                         sizeof *ir->operands);
    IrId id = ir->count++;
    ir->nodes[id] = (IrNode){.op = op,
                             .type = ir_ops[op].result,
                             .rate = rate,
                             .class = class_of(ir, op, operands, count) & 127,
                             .moves = moves,
                             .count = count,
                             .first = ir->operand_count,
                             .span = span,
                             .bits = bits};
    if (count) memcpy(ir->operands + ir->operand_count, operands, count * sizeof *operands);
    ir->operand_count += count;
    return id;
}

static IrId append(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count, uint64_t bits)
{
    if (!is_shared(ir_ops[op].result)) return append_new(ir, op, span, operands, count, bits);
    uint32_t hash = hash_node(op, bits, operands, count);
    IrId id = table_find(ir, hash, op, bits, operands, count);
    if (!id) {
        id = append_new(ir, op, span, operands, count, bits);
        table_add(ir, id, hash);
    }
    return id;
}

IrId ir_const(Ir *ir, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return append(ir, OP_CONST, (Span){0}, NULL, 0, bits);
}

IrId ir_const_alone(Ir *ir, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return append_new(ir, OP_CONST, (Span){0}, NULL, 0, bits);
}

IrId ir_matrix(Ir *ir, Span span, const double m[12])
{
    IrId operands[12];
    for (int k = 0; k < 12; k++) operands[k] = ir_const(ir, m[k]);
    return append(ir, OP_MATRIX, span, operands, 12, 0);
}

bool ir_is_const(const Ir *ir, IrId id, double *value)
{
    const IrNode *node = ir_at(ir, id);
    if (node->op != OP_CONST) return false;
    if (value) *value = node->number;
    return true;
}

bool ir_const_matrix(const Ir *ir, IrId id, double m[12])
{
    if (ir_at(ir, id)->op != OP_MATRIX) return false;
    for (uint32_t k = 0; k < 12; k++) {
        if (!ir_is_const(ir, ir_operand(ir, id, k), &m[k])) return false;
    }
    return true;
}

// --- folding

// What is folded: a scalar that is a number, a matrix of numbers, a field of them. A bad fold makes all that is above
// it unfolded.
static bool is_folded(const Ir *ir, IrId id)
{
    const IrNode *node = ir_at(ir, id);
    double m[12];
    if (node->type == IR_SCALAR) return node->op == OP_CONST;
    if (node->type == IR_MATRIX) return ir_const_matrix(ir, id, m);
    return !node->moves;
}

static bool all_folded(const Ir *ir, const IrId *operands, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) {
        if (!is_folded(ir, operands[k])) return false;
    }
    return true;
}

static void const_values(const Ir *ir, const IrId *operands, uint32_t count, double *values)
{
    for (uint32_t k = 0; k < count; k++) values[k] = ir_at(ir, operands[k])->number;
}

// Whether an expression has a value at every point, by a look at what is near its top.
static bool is_total(const Ir *ir, IrId id, int depth)
{
    const IrNode *node = ir_at(ir, id);
    switch ((IrOp)node->op) {
    case OP_CONST:
    case OP_X:
    case OP_Y:
    case OP_Z: return true;
    case OP_ADD:
    case OP_SUB:
    case OP_MUL:
    case OP_MIN:
    case OP_MAX:
        return depth > 0 && is_total(ir, ir_operand(ir, id, 0), depth - 1) &&
               is_total(ir, ir_operand(ir, id, 1), depth - 1);
    default: return false;
    }
}

// x + 0, x * 1 and the like, for numbers that are not yet known. 0 * x is 0 here: that x may have no finite value then
// is of no interest to anybody. At point rate nothing is dropped, since where F is undefined decides what is outside.
static IrId simplify(Ir *ir, IrOp op, Span span, const IrId *o)
{
    double a = 0, b = 0;
    if (op == OP_SELECT)
        return ir_is_const(ir, o[0], &a) && isfinite(a) ? a != 0 ? o[1] : o[2] : o[1] == o[2] ? o[1] : 0;
    if (op == OP_NEG && ir_at(ir, o[0])->op == OP_NEG) return ir_operand(ir, o[0], 0);
    if (ir_ops[op].operands != 2) return 0;
    bool left = ir_is_const(ir, o[0], &a), right = ir_is_const(ir, o[1], &b);
    if (!left && !right) return 0;
    IrId other = o[left ? 1 : 0];
    switch (op) {
    case OP_ADD: return (left ? a : b) == 0 ? other : 0;
    case OP_SUB:
        if (right && b == 0) return o[0];
        return left && a == 0 ? ir_op1(ir, OP_NEG, span, o[1]) : 0;
    case OP_DIV: return right && b == 1 ? o[0] : 0;
    case OP_POW: return right && b == 1 ? o[0] : 0;
    case OP_MUL:
        if ((left ? a : b) == 1) return other;
        if ((left ? a : b) != 0) return 0;
        return ir_at(ir, other)->rate <= RATE_FRAME || is_total(ir, other, 6) ? ir_const(ir, 0) : 0;
    case OP_AND: return left && a == 0 ? o[0] : 0;
    case OP_OR: return left && a != 0 && isfinite(a) ? ir_const(ir, 1) : 0;
    default: return 0;
    }
}

static IrId fold_scalar(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count)
{
    if (op == OP_HEIGHT) {
        double strength;
        return all_folded(ir, operands, count) && field_fold_height(ir, operands, &strength) ? ir_const(ir, strength)
                                                                                             : 0;
    }
    if (op == OP_AT) {
        double f;
        return all_folded(ir, operands, count) && field_fold_at(ir, operands, &f) ? ir_const(ir, f) : 0;
    }
    if (op == OP_STEEPNESS) {
        double steepness;
        bool known = all_folded(ir, operands, count) && field_fold_steepness(ir, operands, &steepness);
        return known ? ir_const(ir, steepness) : 0;
    }
    if (!eval_knows(op)) return 0;
    if (all_folded(ir, operands, count)) {
        double values[3];
        const_values(ir, operands, count, values);
        double value = eval_scalar(op, values);
        if (isfinite(value)) return ir_const(ir, value);
    }
    return simplify(ir, op, span, operands);
}

static bool is_identity(const double m[12])
{
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (int k = 0; k < 12; k++) {
        if (m[k] != identity[k]) return false;
    }
    return true;
}

static IrId fold_matrix(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count)
{
    double a[12], b[12], r[12];
    switch (op) {
    case OP_COMPOSE: {
        bool left = ir_const_matrix(ir, operands[0], a), right = ir_const_matrix(ir, operands[1], b);
        if (left && is_identity(a)) return operands[1];
        if (right && is_identity(b)) return operands[0];
        if (!left || !right) return 0;
        matrix_compose(a, b, r);
        return ir_matrix(ir, span, r);
    }
    case OP_INVERSE: return ir_const_matrix(ir, operands[0], a) && matrix_inverse(a, r) ? ir_matrix(ir, span, r) : 0;
    case OP_STAND:
        if (!all_folded(ir, operands, count)) return 0;
        const_values(ir, operands, count, a);
        return matrix_stand(a, a + 3, a[6], r) ? ir_matrix(ir, span, r) : 0;
    case OP_SURFACE:
        return all_folded(ir, operands, count) && field_fold_surface(ir, operands, r) ? ir_matrix(ir, span, r) : 0;
    case OP_PLACE:
        return all_folded(ir, operands, count) && field_fold_place(ir, operands, r) ? ir_matrix(ir, span, r) : 0;
    default: return 0;
    }
}

// Lists of one or none.
static IrId fold_field(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count)
{
    bool list = op == OP_UNION || op == OP_INTERSECT || op == OP_FREEFORM || op == OP_DEFORM;
    if (list && count == 1) return operands[0];
    if (op == OP_UNION && count == 0) return append(ir, OP_EMPTY, span, NULL, 0, 0);
    double t;
    if (op == OP_MORPH && ir_is_const(ir, operands[2], &t) && (t <= 0 || t >= 1)) return operands[t >= 1];
    return 0;
}

IrId ir_node(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count)
{
    IrId folded = 0;
    switch ((IrType)ir_ops[op].result) {
    case IR_SCALAR: folded = fold_scalar(ir, op, span, operands, count); break;
    case IR_MATRIX: folded = fold_matrix(ir, op, span, operands, count); break;
    case IR_FIELD: folded = fold_field(ir, op, span, operands, count); break;
    default: break;
    }
    return folded ? folded : append(ir, op, span, operands, count, 0);
}

IrId ir_node_index(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count, uint32_t index)
{
    if (op == OP_ENTRY && index < 12 && ir_at(ir, operands[0])->op == OP_MATRIX)
        return ir_operand(ir, operands[0], index);
    IrNode payload = {.bits = 0};
    payload.index = index;
    return append(ir, op, span, operands, count, payload.bits);
}

IrId ir_node_text(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count, const char *text)
{
    IrNode payload = {.bits = 0};
    payload.text = text;
    return append(ir, op, span, operands, count, payload.bits);
}

IrId ir_entry(Ir *ir, Span span, IrId matrix, uint32_t k)
{
    assert(k < 12 && "a map has twelve numbers");
    if (ir_at(ir, matrix)->op == OP_MATRIX) return ir_operand(ir, matrix, k);
    return ir_node_index(ir, OP_ENTRY, span, &matrix, 1, k);
}

IrId ir_op1(Ir *ir, IrOp op, Span span, IrId a)
{
    return ir_node(ir, op, span, &a, 1);
}

IrId ir_op2(Ir *ir, IrOp op, Span span, IrId a, IrId b)
{
    return ir_node(ir, op, span, (IrId[]){a, b}, 2);
}

IrId ir_op3(Ir *ir, IrOp op, Span span, IrId a, IrId b, IrId c)
{
    return ir_node(ir, op, span, (IrId[]){a, b, c}, 3);
}

bool ir_bad_fold(const Ir *ir, IrId id)
{
    const IrNode *node = ir_at(ir, id);
    if (node->op == OP_CONST) return false;
    if (node->op == OP_TRANSFORM || node->op == OP_PTRANSFORM) {
        double m[12];
        return ir_const_matrix(ir, ir_operand(ir, id, 1), m) && !matrix_inverse(m, m);
    }
    if (node->rate != RATE_CONST || node->op == OP_MATRIX || !is_shared(node->type)) return false;
    return all_folded(ir, ir_operands(ir, id), node->count); // and yet it is a node
}

const char *ir_complaint(const Ir *ir, IrId id)
{
    const IrNode *node = ir_at(ir, id);
    double values[3] = {0};
    if (eval_knows(node->op)) const_values(ir, ir_operands(ir, id), node->count, values);
    return eval_complaint(node->op, values);
}

bool *ir_reached(const Ir *ir, Arena *scratch)
{
    bool *reached = arena_array(scratch, bool, ir->count);
    reached[ir->root] = reached[ir->camera] = reached[ir->background] = true;
    for (uint32_t k = 0; k < ir->light_count; k++) reached[ir->lights[k]] = true;
    for (uint32_t k = 0; k < ir->assert_count; k++) reached[ir->asserts[k]] = true;
    for (uint32_t k = 0; k < ir->patch_count; k++) reached[ir->patches[k]] = true;
    reached[0] = false;
    for (IrId id = ir->count; id-- > 1;) { // operands come before what uses them
        if (!reached[id]) continue;
        const IrId *operands = ir_operands(ir, id);
        for (uint32_t k = 0; k < ir_at(ir, id)->count; k++) reached[operands[k]] = true;
    }
    return reached;
}
