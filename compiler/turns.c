// A turn is found by its u: a difference of two products, of two coordinates with a cosine and a sine of one angle. Its v
// is the sum with the factors exchanged, somewhere in the tape. Steps are then walked backwards from the result, where u
// and v are as good as coordinates: if nothing on the way takes p or q, the rest is a tape of its own.
#include "compiler/turns.h"

#include <stdlib.h>

#include "compiler/tape.h"

typedef struct Turn {
    uint32_t p, q;     // values of coordinates
    uint32_t cos, sin; // values
    uint32_t u, v;     // values
} Turn;

static const TapeStep *step_of(const TapeStep *steps, uint32_t value)
{
    return value < TAPE_POINT ? NULL : &steps[value - TAPE_POINT];
}

// A step of two values.
static bool is_binary(const TapeStep *step, uint32_t op)
{
    return step && TAPE_OP(step->word) == op && !(step->word & TAPE_LITERAL);
}

// A product of a coordinate and another value.
static bool is_product(const TapeStep *step, uint32_t *coordinate, uint32_t *factor)
{
    if (!is_binary(step, TAPE_MUL)) return false;
    uint32_t a = TAPE_A(step->word), b = step->b;
    *coordinate = a < TAPE_POINT ? a : b;
    *factor = a < TAPE_POINT ? b : a;
    return *coordinate < TAPE_POINT && *factor >= TAPE_POINT;
}

// Whether `value` is p cos t - q sin t.
static bool begins_turn(const TapeStep *steps, uint32_t value, Turn *turn)
{
    const TapeStep *step = step_of(steps, value);
    if (!is_binary(step, TAPE_SUB)) return false;
    if (!is_product(step_of(steps, TAPE_A(step->word)), &turn->p, &turn->cos)) return false;
    if (!is_product(step_of(steps, step->b), &turn->q, &turn->sin) || turn->p == turn->q) return false;
    const TapeStep *cosine = step_of(steps, turn->cos), *sine = step_of(steps, turn->sin);
    turn->u = value;
    return TAPE_OP(cosine->word) == TAPE_COS && TAPE_OP(sine->word) == TAPE_SIN &&
           TAPE_A(cosine->word) == TAPE_A(sine->word);
}

// Whether `value` is p sin t + q cos t.
static bool ends_turn(const TapeStep *steps, uint32_t value, const Turn *turn)
{
    const TapeStep *step = step_of(steps, value);
    uint32_t at[2], factor[2];
    if (!is_binary(step, TAPE_ADD)) return false;
    if (!is_product(step_of(steps, TAPE_A(step->word)), &at[0], &factor[0])) return false;
    if (!is_product(step_of(steps, step->b), &at[1], &factor[1])) return false;
    int first = at[0] == turn->p ? 0 : 1;
    return at[first] == turn->p && at[!first] == turn->q && factor[first] == turn->sin && factor[!first] == turn->cos;
}

// Marks what the result takes, up to u and v. False where p or q is among it.
static bool mark(const TapeStep *steps, uint32_t count, const Turn *turn, bool *taken)
{
    taken[TAPE_POINT + count - 1] = true;
    for (uint32_t value = TAPE_POINT + count; value-- > TAPE_POINT;) {
        uint32_t operands[3];
        if (!taken[value] || value == turn->u || value == turn->v) continue;
        int n = tape_operands(*step_of(steps, value), operands);
        for (int k = 0; k < n; k++) taken[operands[k]] = true;
    }
    return !taken[turn->p] && !taken[turn->q] &&
           !(turn->u == TAPE_POINT + count - 1 || turn->v == TAPE_POINT + count - 1);
}

// The taken steps with new numbers.
static void copy(const TapeStep *steps, uint32_t count, const Turn *turn, const bool *taken, uint32_t *number,
                 TapeStep *rest, uint32_t *rest_count)
{
    *rest_count = 0;
    for (uint32_t k = 0; k < TAPE_POINT; k++) number[k] = k;
    for (uint32_t k = 0; k < count; k++) {
        uint32_t value = TAPE_POINT + k;
        if (value == turn->u)
            number[value] = turn->p;
        else if (value == turn->v)
            number[value] = turn->q;
        else if (taken[value]) {
            rest[*rest_count] = tape_renumbered(steps[k], number);
            number[value] = TAPE_POINT + (*rest_count)++;
        }
    }
}

bool turns_take(const TapeStep *steps, uint32_t count, TapeStep *rest, uint32_t *rest_count, int turned[2])
{
    Turn turn;
    uint32_t u = TAPE_POINT, v = TAPE_POINT, end = TAPE_POINT + count;
    while (u < end && !begins_turn(steps, u, &turn)) u++;
    if (u == end) return false;
    while (v < end && !ends_turn(steps, v, &turn)) v++;
    if (v == end) return false;
    turn.v = v;
    bool *taken = calloc(end, sizeof *taken);
    uint32_t *number = calloc(end, sizeof *number);
    bool ok = taken && number && mark(steps, count, &turn, taken);
    if (ok) {
        copy(steps, count, &turn, taken, number, rest, rest_count);
        turned[0] = (int)turn.p;
        turned[1] = (int)turn.q;
    }
    free(number);
    free(taken);
    return ok;
}
