// Tapes and intervals as a specification: what an expression becomes, its value and gradient, and that no value is ever outside of its bound.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "compiler/expression.h"
#include "compiler/tape.h"
#include "runtime/import_vm.h"
#include "tests/unit/ir_random.h"

enum { SLOTS_MAX = 4096 };

typedef struct Numbers { // the slots of a test: every number that a tape names
    const Ir *ir;
    double values[SLOTS_MAX];
    uint32_t count;
} Numbers;

static Slot number_slot(void *context, IrId scalar)
{
    Numbers *n = context;
    assert_true(n->count < SLOTS_MAX);
    assert_true(ir_is_const(n->ir, scalar, &n->values[n->count]));
    return n->count++;
}

typedef struct Taped { // an expression, ready to be evaluated
    Arena arena;
    Numbers numbers;
    Plan plan;
    PlanTape tape;
    double *work;
} Taped;

static void taped_init(Taped *t, const Ir *ir, IrId expression)
{
    *t = (Taped){.numbers = {.ir = ir}};
    TapeSlots slots = {&t->numbers, number_slot};
    assert_true(tape_new(&t->arena, ir, expression, &slots, &t->plan.tape_steps, &t->tape.count));
    assert_true(tape_check(t->plan.tape_steps, t->tape.count, t->numbers.count));
    t->work = arena_array(&t->arena, double, TAPE_WORK *(size_t)(TAPE_POINT + t->tape.count));
}

static double taped_at(Taped *t, const double p[3], double gradient[3])
{
    FieldValue f = tape_at(&t->plan, &t->tape, t->numbers.values, p, t->work);
    if (gradient) memcpy(gradient, f.gradient, sizeof f.gradient);
    return f.f;
}

static IrId axis(Ir *ir, IrOp op)
{
    return ir_node(ir, op, test_span, NULL, 0);
}

// A random expression over x, y, z and numbers, of every operation that fields have.
static IrId random_expression(Random *r, Ir *ir, int depth)
{
    static const IrOp axes[3] = {OP_X, OP_Y, OP_Z};
    static const IrOp ops[] = {OP_ADD, OP_SUB,  OP_MUL,  OP_DIV,  OP_NEG,   OP_ABS,   OP_SIGN,  OP_MIN,
                               OP_MAX, OP_MOD,  OP_POW,  OP_SQRT, OP_EXP,   OP_LOG,   OP_SIN,   OP_COS,
                               OP_TAN, OP_ASIN, OP_ACOS, OP_ATAN, OP_ATAN2, OP_FLOOR, OP_CEIL,  OP_ROUND,
                               OP_LT,  OP_LE,   OP_EQ,   OP_AND,  OP_OR,    OP_NOT,   OP_SELECT};
    if (depth == 0 || random_below(r, 8) == 0) {
        if (random_below(r, 3)) return axis(ir, axes[random_below(r, 3)]);
        return ir_const(ir, random_below(r, 2) ? random_below(r, 9) - 4 : random_in(r, -3, 3));
    }
    IrOp op = ops[random_below(r, sizeof ops / sizeof *ops)];
    IrId operands[3];
    for (uint32_t k = 0; k < ir_ops[op].operands; k++) operands[k] = random_expression(r, ir, depth - 1);
    return ir_node(ir, op, test_span, operands, ir_ops[op].operands);
}

static void random_box(Random *r, Interval box[3])
{
    double size = exp(random_in(r, -9, 3));
    for (int k = 0; k < 3; k++) {
        double middle = random_in(r, -4, 4);
        box[k] = interval_of(middle - size * random_in(r, 0, 1), middle + size * random_in(r, 0, 1));
    }
}

static double random_within(Random *r, Interval side)
{
    int choice = random_below(r, 8); // the ends too
    return choice == 0 ? side.low : choice == 1 ? side.high : side.low + (side.high - side.low) * random_in(r, 0, 1);
}

// A million points in all, each in a random box of a random expression.
static void no_value_is_outside_of_its_interval(void **state)
{
    Random r = {7};
    long points = 0, undefined = 0, empty = 0;
    for (int expression = 0; expression < 6000; expression++) {
        Arena arena = {0};
        Ir *ir = ir_new(&arena);
        IrId id = random_expression(&r, ir, 1 + random_below(&r, 5));
        if (ir_at(ir, id)->rate != RATE_POINT) {
            arena_release(&arena);
            continue;
        }
        Taped t;
        bool numbers_known = true;
        for (IrId k = 1; k < ir->count; k++)
            numbers_known &= ir_at(ir, k)->rate == RATE_POINT || ir_is_const(ir, k, NULL);
        if (numbers_known) {
            taped_init(&t, ir, id);
            for (int boxes = 0; boxes < 8; boxes++) {
                Interval box[3], f;
                random_box(&r, box);
                f = tape_over(&t.plan, &t.tape, t.numbers.values, box, t.work);
                empty += interval_is_empty(f);
                for (int k = 0; k < 40; k++, points++) {
                    double p[3] = {random_within(&r, box[0]), random_within(&r, box[1]), random_within(&r, box[2])};
                    double value = taped_at(&t, p, NULL);
                    if (isnan(value)) {
                        undefined++;
                        assert_true(interval_is_empty(f) || f.partial || !isfinite(f.low) || !isfinite(f.high));
                    } else {
                        assert_true(value >= f.low && value <= f.high);
                    }
                }
            }
            arena_release(&t.arena);
        }
        arena_release(&arena);
    }
    assert_true(points >= 1000000);
    assert_true(undefined > 0 && empty > 0);
}

static void a_tape_is_worth_what_its_expression_is(void **state)
{
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    IrId x = axis(ir, OP_X), y = axis(ir, OP_Y), three = ir_const(ir, 3), half = ir_const(ir, 0.5);
    IrId cube = ir_op2(ir, OP_POW, test_span, x, three), root = ir_op2(ir, OP_POW, test_span, y, half);
    Taped t;
    double g[3];
    taped_init(&t, ir, ir_op2(ir, OP_SUB, test_span, three, ir_op2(ir, OP_MUL, test_span, cube, root)));
    assert_true(fabs(taped_at(&t, (double[]){2, 9, 0}, g) - (3 - 24)) < 1e-12);
    assert_true(fabs(g[0] + 36) < 1e-12 && fabs(g[1] + 8.0 / 6) < 1e-12 && g[2] == 0);
    assert_true(isnan(taped_at(&t, (double[]){2, -9, 0}, NULL))); // the root of a negative number
    for (uint32_t k = 0; k < t.tape.count; k++) assert_int_not_equal(TAPE_OP(t.plan.tape_steps[k].word), TAPE_POW);
    arena_release(&t.arena);
    arena_release(&arena);
}

static void bounds_hold_the_object_and_little_else(void **state)
{
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    IrId x = axis(ir, OP_X), y = axis(ir, OP_Y), z = axis(ir, OP_Z), two = ir_const(ir, 2), one = ir_const(ir, 1);
    IrId square =
        ir_op2(ir, OP_ADD, test_span, ir_op2(ir, OP_POW, test_span, x, two), ir_op2(ir, OP_POW, test_span, y, two));
    IrId disc = ir_op2(ir, OP_SUB, test_span, one, square);
    IrId ball = ir_op2(ir, OP_SUB, test_span, disc, ir_op2(ir, OP_POW, test_span, z, two));
    IrId away[3];
    for (int k = 0; k < 3; k++) away[k] = ir_op2(ir, OP_SUB, test_span, axis(ir, OP_X + k), ir_const(ir, 999 - k));
    IrId moved = expression_substitute(ir, ball, away);
    Taped t;
    double low[3], high[3];
    taped_init(&t, ir, ball);
    tape_bounds(&t.plan, &t.tape, t.numbers.values, low, high);
    for (int k = 0; k < 3; k++) assert_true(low[k] <= -1 && low[k] > -1.3 && high[k] >= 1 && high[k] < 1.3);
    arena_release(&t.arena);
    taped_init(&t, ir, disc); // endless along z
    tape_bounds(&t.plan, &t.tape, t.numbers.values, low, high);
    assert_true(low[2] == -INFINITY && high[2] == INFINITY);
    for (int k = 0; k < 2; k++) assert_true(low[k] <= -1 && low[k] > -1.1 && high[k] >= 1 && high[k] < 1.1);
    for (int k = 0; k < 3; k++) low[k] = k == 0 ? 0.5 : -7, high[k] = 9; // of what is within a box
    tape_bounds_within(&t.plan, &t.tape, t.numbers.values, low, high);
    assert_true(low[0] == 0.5 && high[0] < 1.1 && low[1] > -1 && high[1] < 1 && low[2] == -7 && high[2] == 9);
    arena_release(&t.arena);
    taped_init(&t, ir, moved);
    tape_bounds(&t.plan, &t.tape, t.numbers.values, low, high);
    for (int k = 0; k < 3; k++)
        assert_true(low[k] <= 998 - k && low[k] > 997 - k && high[k] >= 1000 - k && high[k] < 1001 - k);
    arena_release(&t.arena);
    arena_release(&arena);
}

// The coordinates u and v of `at` turned by `rate` times z.
static void turn(Ir *ir, double rate, int u, int v, IrId at[3])
{
    IrId angle = ir_op2(ir, OP_MUL, test_span, at[2], ir_const(ir, rate)), c = ir_op1(ir, OP_COS, test_span, angle),
         s = ir_op1(ir, OP_SIN, test_span, angle), a = at[u], b = at[v];
    at[u] = ir_op2(ir, OP_SUB, test_span, ir_op2(ir, OP_MUL, test_span, a, c), ir_op2(ir, OP_MUL, test_span, b, s));
    at[v] = ir_op2(ir, OP_ADD, test_span, ir_op2(ir, OP_MUL, test_span, b, c), ir_op2(ir, OP_MUL, test_span, a, s));
}

// 1 less the square of the distance from (x, 0, 0).
static IrId ball_at(Ir *ir, double x)
{
    IrId sum = ir_const(ir, 1);
    for (int k = 0; k < 3; k++) {
        IrId away = k ? axis(ir, OP_X + k) : ir_op2(ir, OP_SUB, test_span, axis(ir, OP_X), ir_const(ir, x));
        sum = ir_op2(ir, OP_SUB, test_span, sum, ir_op2(ir, OP_MUL, test_span, away, away));
    }
    return sum;
}

// Bounds of an expression, and whether all points of it that random ones hit are in them.
static void bounds_that_hold(const Ir *ir, IrId expression, double low[3], double high[3])
{
    Taped t;
    Random r = {7};
    taped_init(&t, ir, expression);
    tape_bounds(&t.plan, &t.tape, t.numbers.values, low, high);
    for (int k = 0; k < 20000; k++) {
        double p[3];
        for (int c = 0; c < 3; c++) p[c] = random_in(&r, -60, 60) * (k % 2 ? 1 : 0.05);
        if (!(taped_at(&t, p, NULL) >= 0)) continue;
        for (int c = 0; c < 3; c++) assert_true(low[c] <= p[c] && p[c] <= high[c]);
    }
    arena_release(&t.arena);
}

static void what_is_turned_keeps_its_distance_from_the_axis(void **state)
{
    Arena arena = {0};
    Ir *ir = ir_new(&arena);
    IrId ball = ball_at(ir, 2), at[3] = {axis(ir, OP_X), axis(ir, OP_Y), axis(ir, OP_Z)};
    double low[3], high[3];
    turn(ir, -2, 0, 1, at); // a twist
    bounds_that_hold(ir, expression_substitute(ir, ball, at), low, high);
    for (int k = 0; k < 3; k++) assert_true(low[k] > (k < 2 ? -3.7 : -1.2) && high[k] < (k < 2 ? 3.7 : 1.2));
    turn(ir, 1, 2, 0, at); // a bend that was twisted before
    bounds_that_hold(ir, expression_substitute(ir, ball, at), low, high);
    for (int k = 0; k < 3; k++) assert_true(low[k] > -4 && high[k] < 4);
    // A part that is not turned with it stays where it is.
    IrId turned[3] = {axis(ir, OP_X), axis(ir, OP_Y), axis(ir, OP_Z)};
    turn(ir, 2, 0, 1, turned);
    IrId other = ir_op2(ir, OP_MAX, test_span, expression_substitute(ir, ball, turned), ball_at(ir, 50));
    bounds_that_hold(ir, other, low, high);
    assert_true(high[0] >= 51);
    // Nor does a turn of angles that are not one angle keep anything.
    IrId sum = ir_op2(ir, OP_ADD, test_span,
                      ir_op2(ir, OP_MUL, test_span, axis(ir, OP_X), ir_op1(ir, OP_SIN, test_span, axis(ir, OP_Y))),
                      ir_op2(ir, OP_MUL, test_span, axis(ir, OP_Y), ir_op1(ir, OP_COS, test_span, axis(ir, OP_Y))));
    IrId other_angles[3] = {turned[0], sum, axis(ir, OP_Z)};
    bounds_that_hold(ir, expression_substitute(ir, ball, other_angles), low, high);
    arena_release(&arena);
}

static const char *imported(Arena *arena, const char *text, Failure *failure)
{
    size_t length;
    return import_vm(arena, text, strlen(text), &length, failure);
}

static void an_imported_model_is_a_scene(void **state)
{
    Arena arena = {0};
    Failure failure;
    const char *scene = imported(&arena, "# a disc\n_0 var-x\n_1 square _0\n_2 const -0.25\n_3 add _1 _2\n", &failure);
    assert_string_equal(scene,
                        "scn 1;\nlet v1 = x;\nlet v2 = v1^2;\nlet v3 = -0.25;\nlet v4 = v2 + v3;\nfield(-v4);\n");
    assert_null(imported(&arena, "_0 var-x\n_1 add _0 _7\n", &failure));
    assert_string_equal(failure.text, "line 2: no value above has the name '_7'");
    assert_null(imported(&arena, "_0 twirl\n", &failure));
    assert_null(imported(&arena, "_0 const 1e999\n", &failure));
    assert_null(imported(&arena, "_0 var-x _1\n", &failure));
    assert_null(imported(&arena, "# nothing\n", &failure));
    arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_value_is_outside_of_its_interval),
        cmocka_unit_test(a_tape_is_worth_what_its_expression_is),
        cmocka_unit_test(bounds_hold_the_object_and_little_else),
        cmocka_unit_test(what_is_turned_keeps_its_distance_from_the_axis),
        cmocka_unit_test(an_imported_model_is_a_scene),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
