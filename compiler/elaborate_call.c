// Calls: the values of arguments, and calls of fn, tag and tool, which are inlined: their body is evaluated in a
// frame of its own.
#include <assert.h>
#include <string.h>

#include "compiler/evaluator.h"

// --- arguments

const Node *bound_node(const Call *call, uint32_t at, const Node *call_node)
{
    const Bound *bound = &call->bound[at];
    switch (bound->how) {
    case BOUND_ONE: return bound->node;
    case BOUND_LOOSE: return bound->count ? bound->items[0] : call_node;
    default: return call_node;
    }
}

static ParamType param_type_of(Type type)
{
    static const struct {
        TypeKind kind;
        ParamType type;
    } types[] = {
        {TYPE_BOOL, PARAM_BOOL}, {TYPE_INT, PARAM_INT},   {TYPE_STRING, PARAM_STRING}, {TYPE_NUMBER, PARAM_SCALAR},
        {TYPE_VEC2, PARAM_VEC2}, {TYPE_VEC3, PARAM_VEC3}, {TYPE_COLOR, PARAM_COLOR},
    };
    if (type.angle) return PARAM_ANGLE;
    if (type.time) return PARAM_TIME;
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        if (types[i].kind == (TypeKind)type.kind) return types[i].type;
    }
    return PARAM_SCALAR;
}

// A default of a built-in is text of the table; it is read as a param's value is, a range as two of them.
static Value parse_default(Eval *e, const Parameter *p)
{
    Arena *arena = &e->unit->arena;
    ParamType type = param_type_of(p->type);
    bool range = p->type.kind == TYPE_RANGE;
    const char *dots = range ? strstr(p->default_text, " .. ") : NULL;
    ParamValue parsed, end;
    const char *low = dots ? arena_text(arena, p->default_text, (size_t)(dots - p->default_text)) : p->default_text;
    const char *wrong = param_parse_type(arena, type, low, &parsed);
    if (!wrong && dots) wrong = param_parse_type(arena, type, dots + strlen(" .. "), &end);
    assert(!wrong && range == (dots != NULL) && "the defaults of the table are values");
    (void)wrong;
    if (type == PARAM_STRING) return value_string(parsed.text);
    Scalar parts[3];
    int size = param_size(type);
    for (int k = 0; k < size; k++) parts[k] = scalar_of(parsed.number[k]);
    if (dots) {
        parts[1] = scalar_of(end.number[0]);
        size = 2;
    }
    return size == 1 ? value_scalar(p->type, parts[0]) : value_vector(arena, p->type, parts, size);
}

Value builtin_default(Eval *e, const Parameter *p)
{
    if (p->default_text && !p->value && p->default_from < 0) {
        Value *value = arena_new(&e->unit->arena, Value);
        *value = parse_default(e, p);
        ((Parameter *)p)->value = value; // known from now on, for all calls
    }
    return p->value ? *p->value : value_bad();
}

static Value eval_argument(Eval *e, const Node *node, const Node *call_node, const Value *receiver)
{
    return receiver && node == call_node->a ? *receiver : eval_expr(e, node);
}

// Neither a default nor built: the value that is given for a parameter, converted to its type.
Value eval_bound(Eval *e, const Node *node, const Call *call, uint32_t at, const Value *receiver)
{
    const Bound *bound = &call->bound[at];
    const Parameter *p = &call->callee->parameters[at];
    Type want = p->generic ? type_of(TYPE_ANY) : p->type;
    if (bound->how == BOUND_ONE) return value_convert(&e->scratch, eval_argument(e, bound->node, node, receiver), want);
    List list = {0};
    Type element = p->generic || !want.list ? type_of(TYPE_ANY) : type_element(want);
    if (bound->how == BOUND_BLOCK) {
        eval_values(e, bound->node, element, &list, call->has_entries);
    } else {
        for (uint32_t i = 0; i < bound->count && !e->stop; i++) {
            values_splice(e, &list, eval_argument(e, bound->items[i], node, receiver), element, bound->items[i]);
        }
    }
    for (uint32_t i = 0; i < list.count; i++) {
        if (value_is_bad(&list.items[i])) return value_bad();
    }
    return values_list(list, element);
}

// --- results of blocks

Value sum_objects(Eval *e, const Node *at, const List *list)
{
    IrId *ids = arena_array(&e->scratch, IrId, list->count);
    for (uint32_t i = 0; i < list->count; i++) {
        if (value_is_bad(&list->items[i])) return value_bad();
        ids[i] = list->items[i].id;
    }
    return join_sets(e, at, OP_UNION, ids, list->count);
}

Value sum_perturbations(Eval *e, const List *list)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < list->count; i++) {
        if (value_is_bad(&list->items[i])) return value_bad();
        count += list->items[i].parts.count;
    }
    IrId *ids = arena_array(&e->scratch, IrId, count), *end = ids;
    for (uint32_t i = 0; i < list->count; i++) {
        const Value *one = &list->items[i];
        if (one->parts.count) memcpy(end, one->parts.ids, one->parts.count * sizeof *end);
        end += one->parts.count;
    }
    Value sum = {.type = {.kind = TYPE_PERTURBATION}};
    sum.parts.ids = ids;
    sum.parts.count = count;
    return sum;
}

static Value eval_body(Eval *e, const Node *node, const Callable *callee)
{
    Type result = callee->result;
    const Node *block = callee->node->c;
    bool sums = callee->kind != CALLABLE_FN && (type_is(result, TYPE_OBJECT) || type_is(result, TYPE_PERTURBATION));
    if (!result.list && !sums) return eval_block(e, block, result);
    List list = {0};
    Type element = result.list ? type_element(result) : result;
    eval_values(e, block, element, &list, false);
    if (e->stop) return value_bad();
    for (uint32_t i = 0; i < list.count; i++) {
        if (value_is_bad(&list.items[i])) return value_bad();
    }
    if (result.list) return values_list(list, element);
    return result.kind == TYPE_OBJECT ? sum_objects(e, node, &list) : sum_perturbations(e, &list);
}

// --- ranges of parameters

static bool check_range(Eval *e, const Node *at, const Parameter *p, const Value *value, const Value *range)
{
    for (int k = 0; k < value_size(value->type); k++) {
        Scalar part = value_part(value, k);
        Scalar low = scalar_op2(e, OP_LE, at, range->vector[0], part),
               high = scalar_op2(e, OP_LE, at, part, range->vector[1]);
        Scalar within = scalar_op2(e, OP_AND, at, low, high);
        const char *text = value_text(&e->scratch, range, 6);
        if (within.id && at_point(e, within)) continue;
        if (within.id) {
            add_assert(e, at, within, arena_printf(&e->unit->arena, "out-of-range: %s is in %s", p->name, text));
        } else if (within.number == 0) {
            complain(e, at, DIAG_OUT_OF_RANGE, "%s is in %s, and this is %s", p->name, text,
                     value_text(&e->scratch, value, 6));
            return false;
        }
    }
    return true;
}

static bool check_choices(Eval *e, const Node *at, const Parameter *p, const Value *value, const Value *choices)
{
    Scalar any = scalar_of(0);
    for (uint32_t i = 0; i < choices->list.count; i++) {
        Value equal = eval_equal(e, at, value, &choices->list.items[i]);
        any = scalar_op2(e, OP_OR, at, any, equal.scalar);
    }
    const char *text = "";
    for (uint32_t i = 0; i < choices->list.count; i++) {
        const Value *one = &choices->list.items[i];
        const char *quote = type_is(one->type, TYPE_STRING) ? "\"" : "";
        text = arena_printf(&e->unit->arena, "%s%s%s%s%s", text, i ? ", " : "", quote, value_text(&e->scratch, one, 6),
                            quote);
    }
    if (any.id && !at_point(e, any))
        add_assert(e, at, any, arena_printf(&e->unit->arena, "unknown-choice: %s is one of %s", p->name, text));
    if (any.id || any.number != 0) return true;
    complain(e, at, DIAG_UNKNOWN_CHOICE, "%s is one of %s", p->name, text);
    return false;
}

// `in` of a parameter, in the frame of the call. Known values are tested now, others in each frame. False after a report.
static bool check_limits(Eval *e, const Node *at, const Parameter *p, const Value *value)
{
    if (!p->node->c || value_is_bad(value)) return true;
    Value limits = eval_expr(e, p->node->c);
    if (value_is_bad(&limits)) return false;
    return limits.type.list ? check_choices(e, at, p, value, &limits) : check_range(e, at, p, value, &limits);
}

// --- frames

static bool enter(Eval *e, const Node *node, const Callable *callee)
{
    if (e->calls >= CALLS_MAX || stack_used(e->stack) > e->stack_size) {
        const Frame *frame = e->frame; // the scene's own function, where it is the prelude that goes too far
        while (frame && frame->outer && frame->call->callee->prelude) frame = frame->outer;
        const char *name = callee->prelude && frame ? frame->call->callee->name : callee->name;
        complain(e, node, DIAG_RECURSION_LIMIT, "calls are %d deep here: which branch of %s ends them?", e->calls,
                 name);
        e->stop = true;
        return false;
    }
    e->calls++;
    return true;
}

static void frame_push(Eval *e, Frame *frame, const Node *node, const Call *call, uint32_t base)
{
    *frame = (Frame){.call = call, .node = node, .outer = e->frame, .base = e->base, .site = e->site};
    if (call->callee->prelude && !e->site.end)
        e->site = node->span;
    else if (!call->callee->prelude)
        e->site = (Span){0};
    e->frame = frame;
    e->base = base;
}

static void frame_pop(Eval *e)
{
    e->site = e->frame->site;
    e->base = e->frame->base;
    e->frame = e->frame->outer;
}

// Evaluates the arguments in the caller's frame into the slots at `base`, defaults in the callee's, since they may
// use what stands before them. False if one is wrong.
static bool eval_arguments(Eval *e, const Node *node, const Call *call, const Value *receiver, uint32_t base,
                           Value *places)
{
    const Callable *callee = call->callee;
    bool good = true;
    uint32_t own = callee->count - (callee->kind == CALLABLE_TOOL ? TOOL_PARAMETERS : 0);
    for (uint32_t i = 0; i < callee->count; i++) {
        if (call->bound[i].how == BOUND_DEFAULT) continue;
        Value value = eval_bound(e, node, call, i, receiver);
        good &= !value_is_bad(&value);
        if (i < own)
            e->slots[base + i] = (Slot){.value = value};
        else
            places[i - own] = value;
    }
    return good && !e->stop;
}

static bool eval_defaults(Eval *e, const Node *node, const Call *call)
{
    const Callable *callee = call->callee;
    for (uint32_t i = 0; i < callee->count; i++) {
        const Parameter *p = &callee->parameters[i];
        if (!p->node) continue;
        if (call->bound[i].how == BOUND_DEFAULT) {
            Value value = value_convert(&e->scratch, eval_expr(e, p->node->b), p->type);
            if (value_is_bad(&value)) return false;
            e->slots[e->base + i] = (Slot){.value = value};
        }
        Value value = e->slots[e->base + i].value;
        if (!check_limits(e, bound_node(call, i, node), p, &value)) return false;
    }
    return true;
}

// --- tools

static IrId scalar_ids(Eval *e, const Value *vector, IrId ids[3])
{
    for (int k = 0; k < 3; k++) ids[k] = scalar_id(e, vector->vector[k]);
    return ids[0];
}

static bool place_is_bad(Eval *e, const Node *node, const Call *call, const Value *place, uint32_t at)
{
    for (int k = 0; k < value_size(place->type); k++) {
        if (!at_point(e, value_part(place, k))) continue;
        report_rate(e, bound_node(call, at, node), DIAG_POINT_RATE, "the place of a tool");
        return true;
    }
    return false;
}

static IrId map_turn(Eval *e, const Node *node, const Value *turn)
{
    IrId zero = ir_const(e->ir, 0), axis[3] = {zero, zero, ir_const(e->ir, 1)};
    return ir_rotate_axis(e->ir, span_of(e, node), axis, scalar_id(e, turn->scalar), NULL);
}

// The frame of a tool, in the coordinates of the frame that it is called in. 0 if it is that frame. False after a
// report.
static bool tool_frame(Eval *e, const Node *node, const Call *call, const Value *places, IrId *local)
{
    const Callable *callee = call->callee;
    uint32_t first = callee->count - TOOL_PARAMETERS;
    const Bound *bound = &call->bound[first];
    bool at = bound[TOOL_AT].how, normal = bound[TOOL_NORMAL].how, turn = bound[TOOL_TURN].how;
    for (uint32_t i = 0; i < TOOL_PARAMETERS; i++) {
        if (bound[i].how && place_is_bad(e, node, call, &places[i], first + i)) return false;
    }
    *local = 0;
    if (bound[TOOL_ON].how) {
        *local = places[TOOL_ON].id;
        if (turn) *local = ir_op2(e->ir, OP_COMPOSE, span_of(e, node), *local, map_turn(e, node, &places[TOOL_TURN]));
        return true;
    }
    Span span = span_of(e, node);
    IrId angle = scalar_id(e, turn ? places[TOOL_TURN].scalar : scalar_of(0));
    if (!at) {
        if (normal || !e->forming->matrix) {
            complain(e, node, DIAG_TOOL_PLACE,
                     normal ? "normal needs at: where does %s work?"
                            : "where does %s work? Write at: (x, y, z), or on: surface(from: (x, y, z))",
                     callee->name);
            return false;
        }
        if (turn) *local = map_turn(e, node, &places[TOOL_TURN]);
        return true;
    }
    IrId operands[7];
    if (normal) {
        scalar_ids(e, &places[TOOL_AT], operands);
        scalar_ids(e, &places[TOOL_NORMAL], operands + 3);
        operands[6] = angle;
        *local = ir_node(e->ir, OP_STAND, span, operands, 7);
        if (!ir_bad_fold(e->ir, *local)) return true;
        complain(e, bound_node(call, first + TOOL_NORMAL, node), DIAG_OUT_OF_RANGE, "a normal has a direction");
        return false;
    }
    operands[0] = formed_object(e, node);
    scalar_ids(e, &places[TOOL_AT], operands + 1);
    operands[4] = angle;
    *local = ir_node(e->ir, OP_PLACE, span, operands, 5);
    if (!ir_bad_fold(e->ir, *local)) return true;
    complain(e, bound_node(call, first + TOOL_AT, node), DIAG_TOOL_MISSES,
             "no surface is found from here: give a point nearer to it, or normal too");
    return false;
}

static Value eval_tool(Eval *e, const Node *node, const Call *call, const Value *places)
{
    if (!e->forming) {
        complain(e, node, DIAG_TOOL_PLACE,
                 "%s works on an object that is being formed: call it in freeform(object) { … }", call->callee->name);
        return value_bad();
    }
    const Forming *around = e->forming;
    IrId local;
    if (!tool_frame(e, node, call, places, &local)) return value_bad();
    if (!local) return eval_body(e, node, call->callee);
    Forming *forming = arena_new(&e->scratch, Forming); // slots of lets keep it
    forming->object = around->object;
    forming->matrix = around->matrix ? ir_op2(e->ir, OP_COMPOSE, span_of(e, node), around->matrix, local) : local;
    e->forming = forming;
    Value sum = eval_body(e, node, call->callee);
    e->forming = around;
    if (value_is_bad(&sum)) return sum;
    IrId *ids = arena_array(&e->scratch, IrId, sum.parts.count);
    for (uint32_t i = 0; i < sum.parts.count; i++)
        ids[i] = transform_parts(e, node, OP_PTRANSFORM, sum.parts.ids[i], local);
    sum.parts.ids = ids;
    return sum;
}

// --- calls

static Value eval_user(Eval *e, const Node *node, const Call *call, const Value *receiver)
{
    const Callable *callee = call->callee;
    if (!enter(e, node, callee)) return value_bad();
    uint32_t base = e->slot_count;
    slots_push(e, callee->slots);
    Value places[TOOL_PARAMETERS], result = value_bad();
    if (eval_arguments(e, node, call, receiver, base, places)) {
        Frame frame;
        frame_push(e, &frame, node, call, base);
        bool good = eval_defaults(e, node, call);
        if (!good)
            result = value_bad();
        else if (callee->kind == CALLABLE_TOOL)
            result = eval_tool(e, node, call, places);
        else
            result = eval_body(e, node, callee);
        frame_pop(e);
    }
    slots_pop(e, callee->slots);
    e->calls--;
    return value_convert(&e->scratch, result, callee->result);
}

static bool takes_block(const Call *call)
{
    for (uint32_t i = 0; i < call->callee->count; i++) {
        if (call->bound[i].how == BOUND_BLOCK) return true;
    }
    return false;
}

Value eval_call(Eval *e, const Node *node, const Value *receiver)
{
    const Call *call = node->note;
    assert(call && "check() has bound every call");
    if (receiver && value_is_bad(receiver)) return value_bad();
    if (call->block && call->has_entries) open_lets(e, call->block);
    Value value = call->callee->kind == CALLABLE_BUILTIN ? eval_builtin(e, node, call, receiver)
                                                         : eval_user(e, node, call, receiver);
    if (call->block && !takes_block(call)) { // it has asserts and prints only
        List none = {0};
        eval_values(e, call->block, type_of(TYPE_ANY), &none, call->has_entries);
    }
    return value;
}
