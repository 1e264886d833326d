// Patches: their numbers, edges and what acts on them become one node of the IR and its parts.
//
// The value of a patch is its SHEET, since that is the object it stands for where objects are wanted; sheet_patch()
// leads back. A part is an edge, which fills operands of the patch, or a node of the IR: Value.vector[0] says which.
#include <assert.h>
#include <string.h>

#include "compiler/evaluator.h"
#include "compiler/object.h"

enum {
    PATCH_GRID,
    PATCH_STEP,
    PATCH_STIFFNESS,
    PATCH_DENSITY,
    PATCH_DAMPING,
    PATCH_FORCE,
    PATCH_START,
    PATCH_SCHEME,
    PATCH_TANGENTS,
    PATCH_GRAVITY,
    PATCH_ACCURACY,
    PATCH_CLOSURE,
    PATCH_PARTS
};

// What a part is: of an edge its number, then its position and tangent; of others PART_NODE and the node.
enum { PART_EDGES = 4, PART_NODE = 4, PART_SCALARS = 7 };

static bool given(const Call *call, int at)
{
    return call->bound[at].how != BOUND_DEFAULT;
}

static Scalar coordinate(Eval *e, const Node *node, IrOp op)
{
    return (Scalar){.id = ir_node(e->ir, op, span_of(e, node), NULL, 0)};
}

// (u, v, 0): where a patch is flat.
static void flat_place(Eval *e, const Node *node, Scalar place[3])
{
    place[0] = coordinate(e, node, OP_U);
    place[1] = coordinate(e, node, OP_V);
    place[2] = scalar_of(0);
}

// --- parts

static Value part_of(Eval *e, const Scalar *parts, int count)
{
    Scalar own[PART_SCALARS] = {{0}};
    memcpy(own, parts, (size_t)count * sizeof *parts);
    return value_vector(&e->scratch, type_of(TYPE_PART), own, PART_SCALARS);
}

static Value node_part(Eval *e, IrId id)
{
    return part_of(e, (Scalar[]){scalar_of(PART_NODE), {.id = id}}, 2);
}

static Value eval_edge(Eval *e, const Node *node, const Call *call, const Value *args)
{
    enum { POSITION = 1, TANGENT = 2 };
    double end;
    bool along_v = call->callee->id == BUILTIN_EDGE_V;
    if (!want_const(e, bound_node(call, 0, node), args[0].scalar, "which edge of a patch this is", &end))
        return value_bad();
    if (end != 0 && end != 1) {
        complain(e, bound_node(call, 0, node), DIAG_OUT_OF_RANGE,
                 "an edge is at %s: 0 or %s: 1, since u and v of a patch go from 0 to 1", along_v ? "v" : "u",
                 along_v ? "v" : "u");
        return value_bad();
    }
    Scalar parts[PART_SCALARS] = {scalar_of(2 * along_v + end)};
    if (given(call, POSITION))
        memcpy(parts + 1, args[POSITION].vector, 3 * sizeof *parts);
    else
        flat_place(e, node, parts + 1);
    for (int k = 0; k < 3 && given(call, TANGENT); k++) {
        bool vector = type_is_vector(args[TANGENT].type);
        parts[4 + k] = vector ? args[TANGENT].vector[k] : args[TANGENT].scalar;
    }
    return part_of(e, parts, PART_SCALARS);
}

static bool within_patch(Eval *e, const Node *node, const Call *call, const Value *args, uint32_t first)
{
    for (uint32_t k = first; k < first + 2; k++) {
        double place = args[k].scalar.number;
        if (args[k].scalar.id || (place >= 0 && place <= 1)) continue;
        complain(e, bound_node(call, k, node), DIAG_OUT_OF_RANGE, "%s of a patch goes from 0 to 1, and this is %g",
                 k == first ? "u" : "v", place);
        return false;
    }
    return true;
}

static Value eval_pin(Eval *e, const Node *node, const Call *call, const Value *args)
{
    if (!within_patch(e, node, call, args, 0)) return value_bad();
    IrId ids[5] = {scalar_id(e, args[0].scalar), scalar_id(e, args[1].scalar)};
    for (int k = 0; k < 3; k++) ids[2 + k] = scalar_id(e, args[2].vector[k]);
    return node_part(e, ir_node(e->ir, OP_PIN, span_of(e, node), ids, 5));
}

// The perturbations added to a field that is 0 everywhere: F of that is their sum.
static Value eval_press(Eval *e, const Node *node, const Call *call, const Value *args)
{
    if (!within_patch(e, node, call, args, 1)) return value_bad();
    uint32_t count = args[0].parts.count;
    IrId *list = arena_array(&e->scratch, IrId, count + 1), zero = ir_const(e->ir, 0);
    IrId nothing[10] = {zero, zero, zero, zero, zero, zero, zero, zero, zero, zero};
    list[0] = ir_node(e->ir, OP_QUADRIC, span_of(e, node), nothing, 10);
    if (count) memcpy(list + 1, args[0].parts.ids, count * sizeof *list);
    IrId ids[4];
    for (int k = 0; k < 3; k++) ids[k] = scalar_id(e, args[1 + k].scalar);
    ids[3] = ir_node(e->ir, OP_FREEFORM, span_of(e, node), list, count + 1);
    return node_part(e, ir_node(e->ir, OP_PRESS, span_of(e, node), ids, 4));
}

// What presses a patch works on a plane, whose inside is below: tools find the frame of the surface there.
Value eval_pressed_by(Eval *e, const Node *node, const Call *call, const Value *receiver)
{
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    IrId operands[10], zero = ir_const(e->ir, 0);
    for (int k = 0; k < 10; k++) operands[k] = zero;
    operands[8] = ir_const(e->ir, -1);
    Forming *forming = arena_new(&e->scratch, Forming);
    forming->object = ir_node(e->ir, OP_QUADRIC, span_of(e, node), operands, 10);
    forming->matrix = ir_matrix(e->ir, span_of(e, node), identity);
    const Forming *around = e->forming;
    e->forming = forming;
    Value value = eval_bound(e, node, call, 0, receiver);
    e->forming = around;
    return value;
}

static Value eval_contact(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Scalar stiffness = args[1].scalar;
    if (!stiffness.id && !(stiffness.number > 0)) {
        complain(e, bound_node(call, 1, node), DIAG_OUT_OF_RANGE,
                 "the stiffness of a contact is greater than 0: it pushes with so much force for each unit of depth");
        return value_bad();
    }
    IrId ids[2] = {args[0].id, scalar_id(e, stiffness)};
    return node_part(e, ir_node(e->ir, OP_CONTACT, span_of(e, node), ids, 2));
}

// --- the equation

static bool refuse(Eval *e, const Node *node, const Call *call, uint32_t at, const char *format, double value)
{
    char text[200];
    snprintf(text, sizeof text, format, value);
    complain(e, bound_node(call, at, node), DIAG_PATCH_ILL_POSED, "%s", text);
    return false;
}

// What is known now and no patch can be solved with. The rest is told where the patch is solved.
static bool test_numbers(Eval *e, const Node *node, const Call *call, const Value *args, double nodes)
{
    if (!(nodes >= PATCH_NODES_MIN && nodes <= PATCH_NODES_MAX)) {
        complain(e, bound_node(call, PATCH_GRID, node), DIAG_PATCH_ILL_POSED,
                 "a patch of %g nodes a side has too %s: take %d to %d", nodes,
                 nodes < PATCH_NODES_MIN ? "few" : "many", PATCH_NODES_MIN, PATCH_NODES_MAX);
        return false;
    }
    Scalar step = args[PATCH_STEP].scalar, density = args[PATCH_DENSITY].scalar, damping = args[PATCH_DAMPING].scalar;
    if (!step.id && !(step.number > 0))
        return refuse(e, node, call, PATCH_STEP, "the step is %gs: it has to be positive", step.number);
    if (!density.id && density.number < 0)
        return refuse(e, node, call, PATCH_DENSITY, "the density is %g: it cannot be negative, take 0 or more",
                      density.number);
    if (!damping.id && damping.number < 0)
        return refuse(e, node, call, PATCH_DAMPING, "the damping is %g: it cannot be negative, take 0 or more",
                      damping.number);
    return true;
}

// One message for one stiffness: b < 0 or d < 0 before c, which is measured by them.
static void warn_of_stiffness(Eval *e, const Node *at, const Scalar s[3])
{
    if (s[0].id || s[1].id || s[2].id) return;
    double b = s[0].number, c = s[1].number, d = s[2].number, low = b > 0 && d > 0 ? -2 * sqrt(b * d) : 0;
    if (b < 0 || d < 0)
        complain(
            e, at, DIAG_PATCH_GROWS,
            "%s = %g is negative: waves along %s grow the faster the shorter they are, so the shape depends on the "
            "grid: take %s >= 0",
            b < 0 ? "b" : "d", b < 0 ? b : d, b < 0 ? "u" : "v", b < 0 ? "b" : "d");
    else if (c < low)
        complain(e, at, DIAG_PATCH_GROWS,
                 "c = %g is below -2 sqrt(b d) = %g: slanted waves grow the faster the shorter they are, so the shape "
                 "depends on the grid: take c >= %g",
                 c, low, low);
}

static bool read_stiffness(Eval *e, const Node *node, const Call *call, const Value *args, Scalar stiffness[9])
{
    const Node *at = bound_node(call, PATCH_STIFFNESS, node);
    const Value *value = &args[PATCH_STIFFNESS];
    if (!given(call, PATCH_STIFFNESS)) {
        for (int k = 0; k < 9; k++) stiffness[k] = scalar_of(k % 3 == 1 ? 2 : 1);
        return true;
    }
    if (value->type.list && value->list.count != 3) {
        complain(e, at, DIAG_VALUE_COUNT, "stiffness is one (b, c, d) or three, for x, y and z, and here are %u",
                 value->list.count);
        return false;
    }
    for (uint32_t c = 0; c < 3; c++) {
        const Value *one = value->type.list ? &value->list.items[c] : value;
        if (value_is_bad(one)) return false;
        for (int k = 0; k < 3; k++) {
            if (at_point(e, one->vector[k])) {
                report_rate(e, at, DIAG_POINT_RATE, "the stiffness of a patch");
                return false;
            }
            stiffness[3 * c + (uint32_t)k] = one->vector[k];
        }
        if (c == 0 || value->type.list) warn_of_stiffness(e, at, stiffness + 3 * c);
    }
    return true;
}

// --- edges and the rest

// Puts the operands of edges in their places; the others are collected. False after a report.
static bool take_parts(Eval *e, const Node *node, const Call *call, const Value *parts, Scalar *edges, IrId *nodes,
                       uint32_t *count)
{
    bool seen[PART_EDGES] = {false};
    for (int edge = 0; edge < PART_EDGES; edge++) {
        flat_place(e, node, edges + 6 * edge);
        for (int k = 3; k < 6; k++) edges[6 * edge + k] = scalar_of(0);
    }
    *count = 1; // behind the patch itself
    for (uint32_t i = 0; i < parts->list.count; i++) {
        const Scalar *part = parts->list.items[i].vector;
        int edge = (int)part[0].number;
        if (edge == PART_NODE) {
            nodes[(*count)++] = part[1].id;
            continue;
        }
        if (seen[edge]) {
            complain(e, bound_node(call, PATCH_PARTS, node), DIAG_DUPLICATE_ARGUMENT,
                     "the edge %s: %d is given twice: a patch has each of its four edges once", edge < 2 ? "u" : "v",
                     edge % 2);
            return false;
        }
        seen[edge] = true;
        memcpy(edges + 6 * edge, part + 1, 6 * sizeof *edges);
    }
    return true;
}

static void put(Eval *e, IrId *ids, uint32_t *count, const Scalar *scalars, int number)
{
    for (int k = 0; k < number; k++) ids[(*count)++] = scalar_id(e, scalars[k]);
}

static Value eval_patch(Eval *e, const Node *node, const Call *call, const Value *args)
{
    static const Value none = {.type = {.kind = TYPE_PART, .list = 1}};
    const Value *parts = given(call, PATCH_PARTS) ? &args[PATCH_PARTS] : &none;
    double nodes;
    Scalar stiffness[9], force[3], start[3], edges[6 * PART_EDGES];
    IrId *driven = arena_array(&e->scratch, IrId, parts->list.count + 1);
    uint32_t driven_count;
    const Node *grid = bound_node(call, PATCH_GRID, node);
    if (!want_const(e, grid, args[PATCH_GRID].scalar, "the grid of a patch", &nodes)) return value_bad();
    if (!test_numbers(e, node, call, args, nodes)) return value_bad();
    if (!read_stiffness(e, node, call, args, stiffness)) return value_bad();
    if (!take_parts(e, node, call, parts, edges, driven, &driven_count)) return value_bad();
    for (int k = 0; k < 3; k++) {
        Scalar weight = scalar_op2(e, OP_MUL, node, args[PATCH_DENSITY].scalar, args[PATCH_GRAVITY].vector[k]);
        force[k] = scalar_op2(e, OP_ADD, node, args[PATCH_FORCE].vector[k], weight);
    }
    flat_place(e, node, start);
    if (given(call, PATCH_START)) memcpy(start, args[PATCH_START].vector, sizeof start);
    Scalar shape[6] = {scalar_of(nodes),
                       scalar_of(!strcmp(args[PATCH_SCHEME].string, "newmark")),
                       scalar_of(!strcmp(args[PATCH_TANGENTS].string, "all")),
                       scalar_of(!strcmp(args[PATCH_CLOSURE].string, "accurate")),
                       args[PATCH_STEP].scalar,
                       args[PATCH_ACCURACY].scalar};
    Scalar weights[2] = {args[PATCH_DENSITY].scalar, args[PATCH_DAMPING].scalar};
    IrId ids[PATCH_OPERANDS];
    uint32_t count = 0;
    put(e, ids, &count, shape, 6);
    put(e, ids, &count, stiffness, 9);
    put(e, ids, &count, weights, 2);
    put(e, ids, &count, force, 3);
    put(e, ids, &count, start, 3);
    put(e, ids, &count, edges, 6 * PART_EDGES);
    assert(count == PATCH_OPERANDS && "OP_PATCH has as many operands");
    Span span = e->site.end ? e->site : node->name_span.end ? node->name_span : node->span;
    driven[0] = ir_node_text(e->ir, OP_PATCH, span, ids, count, "");
    IrId patch = driven_count > 1 ? ir_node(e->ir, OP_DRIVEN, span, driven, driven_count) : driven[0];
    return value_node(TYPE_PATCH, ir_op1(e->ir, OP_SHEET, span, patch));
}

IrId sheet_patch(const Ir *ir, IrId sheet)
{
    return ir_operand(ir, sheet, 0);
}

void name_patch(Eval *e, IrId sheet, const char *name)
{
    IrId patch = sheet_patch(e->ir, sheet);
    if (ir_at(e->ir, patch)->op == OP_DRIVEN) patch = ir_operand(e->ir, patch, 0);
    IrNode *node = &e->ir->nodes[patch];
    if (!*node->text) node->text = name; // of several names the first
}

bool patch_takes_points(uint16_t builtin, uint32_t argument)
{
    if (builtin == BUILTIN_PATCH) return argument == PATCH_FORCE || argument == PATCH_START;
    return (builtin == BUILTIN_EDGE_U || builtin == BUILTIN_EDGE_V) && argument > 0;
}

// --- what patches make of objects

// The frame of a footprint: u and v along the axes, then their normal at length 1.
static bool footprint(Eval *e, const Node *node, const Call *call, const Value *args, IrId *matrix)
{
    enum { CORNER = 2, U, V };
    const Scalar *corner = args[CORNER].vector, *u = args[U].vector, *v = args[V].vector;
    Scalar n[3], square = scalar_of(0);
    for (int k = 0; k < 3; k++) {
        int a = (k + 1) % 3, b = (k + 2) % 3;
        Scalar left = scalar_op2(e, OP_MUL, node, u[a], v[b]), right = scalar_op2(e, OP_MUL, node, u[b], v[a]);
        n[k] = scalar_op2(e, OP_SUB, node, left, right);
        square = scalar_op2(e, OP_ADD, node, square, scalar_op2(e, OP_MUL, node, n[k], n[k]));
    }
    if (!square.id && !(square.number > 0)) {
        complain(e, bound_node(call, V, node), DIAG_OUT_OF_RANGE,
                 "u and v of a footprint are two sides of a parallelogram, and these lie on one line");
        return false;
    }
    Scalar length = scalar_op1(e, OP_SQRT, node, square);
    IrId ids[12];
    for (int k = 0; k < 3; k++) {
        ids[4 * k] = scalar_id(e, u[k]);
        ids[4 * k + 1] = scalar_id(e, v[k]);
        ids[4 * k + 2] = scalar_id(e, scalar_op2(e, OP_DIV, node, n[k], length));
        ids[4 * k + 3] = scalar_id(e, corner[k]);
    }
    *matrix = ir_node(e->ir, OP_MATRIX, span_of(e, node), ids, 12);
    return true;
}

static IrId deformed(Eval *e, const Node *node, IrId object, IrId lift)
{
    IrClass class = (IrClass)ir_at(e->ir, object)->class;
    IrOp op = class == CLASS_QUADRIC || class == CLASS_FREEFORM ? OP_FREEFORM : OP_DEFORM;
    return ir_op2(e->ir, op, span_of(e, node), object, lift);
}

static Value eval_displace(Eval *e, const Node *node, const Call *call, const Value *args)
{
    enum { OF, BY, CAPS = 5 };
    const Scalar *caps = args[CAPS].vector;
    IrId matrix;
    if (ir_at(e->ir, args[OF].id)->class == CLASS_GENERAL) {
        complain(e, bound_node(call, OF, node), DIAG_NOT_YET,
                 "to displace a general field is not there yet in this version of scn: displace quadrics, free forms "
                 "and sets of them");
        return value_bad();
    }
    if (object_has_thick(e->ir, args[OF].id)) {
        complain(e, bound_node(call, OF, node), DIAG_NOT_YET,
                 "to displace a thick patch is not there yet in this version of scn: press or pull the patch instead");
        return value_bad();
    }
    if (!footprint(e, node, call, args, &matrix)) return value_bad();
    if (!caps[0].id && !caps[1].id && caps[0].number >= caps[1].number) {
        complain(e, bound_node(call, CAPS, node), DIAG_OUT_OF_RANGE,
                 "caps go up: from below the surface to above it, along the normal of the footprint");
        return value_bad();
    }
    IrId low = scalar_id(e, caps[0]), high = scalar_id(e, caps[1]);
    IrId axis[4] = {args[OF].id, matrix, low, high};
    IrId steepness = ir_node(e->ir, OP_STEEPNESS, span_of(e, node), axis, 4);
    if (ir_bad_fold(e->ir, steepness)) {
        complain(e, bound_node(call, CAPS, node), DIAG_OUT_OF_RANGE,
                 "the middle of the footprint is not above the object: between the caps its normal meets no surface");
        return value_bad();
    }
    IrId ids[5] = {sheet_patch(e->ir, args[BY].id), steepness, matrix, low, high};
    IrId lift = ir_node(e->ir, OP_LIFT, span_of(e, node), ids, 5);
    return value_node(TYPE_OBJECT, deformed(e, node, args[OF].id, lift));
}

// min(z(x, y) - z, z - floor) over the unit square: a lifted half-space, cut by quadrics.
static Value eval_solid(Eval *e, const Node *node, const Value *args)
{
    static const double below[10] = {[8] = -1}, across_x[10] = {[0] = -1, [6] = 1}, across_y[10] = {[1] = -1, [7] = 1};
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    Span span = span_of(e, node);
    IrId parts[4], ids[10];
    const double *const quadrics[3] = {below, across_x, across_y};
    for (int q = 0; q < 3; q++) {
        for (int k = 0; k < 10; k++) ids[k] = ir_const(e->ir, quadrics[q][k]);
        parts[q] = ir_node(e->ir, OP_QUADRIC, span, ids, 10);
    }
    for (int k = 0; k < 10; k++) ids[k] = ir_const(e->ir, k == 8);
    ids[9] = scalar_id(e, scalar_op1(e, OP_NEG, node, args[1].scalar));
    parts[3] = ir_node(e->ir, OP_QUADRIC, span, ids, 10);
    IrId one = ir_const(e->ir, 1), floor = scalar_id(e, args[1].scalar);
    IrId below_floor = scalar_id(e, scalar_op2(e, OP_SUB, node, args[1].scalar, scalar_of(1)));
    IrId lift[5] = {sheet_patch(e->ir, args[0].id), one, ir_matrix(e->ir, span, identity), floor, below_floor};
    parts[0] = deformed(e, node, parts[0], ir_node(e->ir, OP_LIFT, span, lift, 5));
    return value_node(TYPE_OBJECT, ir_node(e->ir, OP_INTERSECT, span, parts, 4));
}

static Value eval_thicken(Eval *e, const Node *node, const Call *call, const Value *args)
{
    Scalar thickness = args[1].scalar;
    if (!thickness.id && !(thickness.number > 0)) {
        complain(e, bound_node(call, 1, node), DIAG_OUT_OF_RANGE,
                 "a thickness is greater than 0, and this is %g; without one a patch is shown as a sheet",
                 thickness.number);
        return value_bad();
    }
    IrId patch = sheet_patch(e->ir, args[0].id), side = ir_const(e->ir, 1);
    return value_node(TYPE_OBJECT, ir_op3(e->ir, OP_THICKEN, span_of(e, node), patch, scalar_id(e, thickness), side));
}

Value eval_patch_thing(Eval *e, const Node *node, const Call *call, const Value *args)
{
    switch (call->callee->id) {
    case BUILTIN_PATCH: return eval_patch(e, node, call, args);
    case BUILTIN_EDGE_U:
    case BUILTIN_EDGE_V: return eval_edge(e, node, call, args);
    case BUILTIN_PIN: return eval_pin(e, node, call, args);
    case BUILTIN_PRESS: return eval_press(e, node, call, args);
    case BUILTIN_DISPLACE: return eval_displace(e, node, call, args);
    case BUILTIN_THICKEN: return eval_thicken(e, node, call, args);
    case BUILTIN_SOLID: return eval_solid(e, node, args);
    default:
        assert(call->callee->id == BUILTIN_CONTACT && "the things of patches are these");
        return eval_contact(e, node, call, args);
    }
}

// --- the patches of the scene

static void add_patch(Ir *ir, IrId id)
{
    for (uint32_t k = 0; k < ir->patch_count; k++)
        if (ir->patches[k] == id) return;
    ir->patches[ir->patch_count++] = id;
}

// u and v have no value where a field is asked for at a point of space.
static void report_stray(Eval *e, const bool *reached)
{
    for (IrId id = 1; id < e->ir->count; id++) {
        const IrNode *node = ir_at(e->ir, id);
        if (!reached[id] || (node->op != OP_U && node->op != OP_V)) continue;
        diag(e->unit, node->span, DIAG_POINT_RATE,
             "%s is a place on a patch, and known only in its edges, force and start", node->op == OP_U ? "u" : "v");
    }
}

void collect_patches(Eval *e)
{
    Ir *ir = e->ir;
    uint32_t most = e->program->count;
    for (IrId id = 1; id < ir->count; id++) most += ir_at(ir, id)->type == IR_PATCH;
    ir->patches = arena_array(ir->arena, IrId, most);
    bool *reached = arena_array(&e->scratch, bool, ir->count);
    reached[ir->root] = true;
    for (IrId id = ir->count; id-- > 1;) {
        if (!reached[id] || ir_at(ir, id)->op == OP_PATCH) continue;
        for (uint32_t k = 0; k < ir_at(ir, id)->count; k++) reached[ir_operand(ir, id, k)] = true;
    }
    report_stray(e, reached);
    bool *within = arena_array(&e->scratch, bool, ir->count);
    for (IrId id = 1; id < ir->count; id++)
        if (ir_at(ir, id)->op == OP_DRIVEN) within[ir_operand(ir, id, 0)] = true;
    for (IrId id = 1; id < ir->count; id++)
        if (reached[id] && ir_at(ir, id)->type == IR_PATCH && !within[id]) add_patch(ir, id);
    for (uint32_t i = 0; i < e->program->count && e->options->patches; i++) {
        Symbol *symbol = e->program->items[i];
        if (!symbol || symbol->kind != SYMBOL_LET || !type_is(symbol->type, TYPE_PATCH)) continue;
        Value value = force(e, symbol);
        if (!value_is_bad(&value)) add_patch(ir, sheet_patch(ir, value.id));
    }
}
