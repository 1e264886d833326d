// A group's numbers and conditions are numbered by the formula, so its functions read as the formula does: n12, c7.
#include "compiler/formula_emit.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/pairs.h"

typedef struct Group { // conditions roots[begin … end)
    uint32_t begin, end;
} Group;

typedef struct Emitter {
    const Formula *f;
    FILE *out;
    Arena scratch;
    uint32_t joined;                          // SLICE_OR or SLICE_AND: what joins groups
    uint32_t *number_marks, *condition_marks; // of the group that is being written: its serial number
    uint32_t serial, left;                    // left: steps that may still be marked
    uint32_t *roots, root_count, root_capacity;
    Group *groups;
    uint32_t group_count, group_capacity;
    uint32_t steps; // written so far
    bool ok;
} Emitter;

static void put(Emitter *e, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put(Emitter *e, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vfprintf(e->out, format, list);
    va_end(list);
}

static bool is_logic(const FormulaCondition *c)
{
    return c->op == SLICE_AND || c->op == SLICE_OR;
}

static bool has_two_numbers(const FormulaCondition *c)
{
    return c->op == SLICE_LESS || c->op == SLICE_NOT_LESS;
}

static bool has_second(uint32_t op)
{
    return op >= TAPE_ADD && op <= TAPE_MAX;
}

static bool is_emitted(uint32_t op)
{
    return op <= TAPE_SQRT || op == TAPE_OPS;
}

// --- groups

// Mark what a condition is made of, once a serial number, and count its steps, at most e->left of them: more are not looked at.
static uint32_t mark_number(Emitter *e, uint32_t k)
{
    const FormulaNumber *n = &e->f->numbers[k];
    if (e->number_marks[k] == e->serial || n->op == TAPE_NUMBER || !e->left) return 0;
    e->number_marks[k] = e->serial;
    if (n->op == TAPE_OPS) return 0;
    if (!is_emitted(n->op) || n->doubt) e->ok = false;
    if (!e->ok) return 0;
    e->left--;
    uint32_t count = 1 + mark_number(e, n->a);
    return count + (has_second(n->op) ? mark_number(e, n->b) : 0);
}

static uint32_t mark_condition(Emitter *e, uint32_t k)
{
    const FormulaCondition *c = &e->f->conditions[k];
    if (e->condition_marks[k] == e->serial || !e->ok || !e->left) return 0;
    e->condition_marks[k] = e->serial;
    e->left--;
    if (is_logic(c)) {
        uint32_t count = 1 + mark_condition(e, c->a);
        return count + mark_condition(e, c->b);
    }
    if (e->f->numbers[c->a].doubt) e->ok = false;
    uint32_t count = 1 + mark_number(e, c->a);
    return count + (has_two_numbers(c) ? mark_number(e, c->b) : 0);
}

// The steps of a condition, or most + 1 where there are more.
static uint32_t size_of(Emitter *e, uint32_t condition, uint32_t most)
{
    e->serial++;
    e->left = most + 1;
    return mark_condition(e, condition);
}

static void add_root(Emitter *e, uint32_t condition)
{
    e->roots = array_room(&e->scratch, e->roots, e->root_count, &e->root_capacity, sizeof *e->roots);
    e->roots[e->root_count++] = condition;
}

// The things that are joined, as long as they are larger than a group, from left to right.
static void find_roots(Emitter *e, uint32_t condition)
{
    uint32_t *waiting = NULL, count = 0, capacity = 0;
    waiting = array_room(&e->scratch, waiting, count, &capacity, sizeof *waiting);
    waiting[count++] = condition;
    while (count && e->ok) {
        uint32_t k = waiting[--count];
        const FormulaCondition *c = &e->f->conditions[k];
        if (c->op != e->joined || size_of(e, k, FORMULA_GROUP_STEPS) <= FORMULA_GROUP_STEPS) {
            add_root(e, k);
            continue;
        }
        waiting = array_room(&e->scratch, waiting, count, &capacity, sizeof *waiting);
        waiting[count++] = c->b;
        waiting = array_room(&e->scratch, waiting, count, &capacity, sizeof *waiting);
        waiting[count++] = c->a;
    }
}

// Neighbours share a group as long as there is room in it.
static void find_groups(Emitter *e)
{
    uint32_t size = 0;
    for (uint32_t k = 0; k < e->root_count && e->ok; k++) {
        uint32_t mine = size_of(e, e->roots[k], FORMULA_GROUP_MOST);
        if (mine > FORMULA_GROUP_MOST) e->ok = false;
        if (!e->group_count || size + mine > FORMULA_GROUP_STEPS) {
            e->groups = array_room(&e->scratch, e->groups, e->group_count, &e->group_capacity, sizeof *e->groups);
            e->groups[e->group_count++] = (Group){k, k};
            size = 0;
        }
        size += mine;
        e->groups[e->group_count - 1].end = k + 1;
        e->steps += mine;
        if (e->steps > FORMULA_CODE_MOST) e->ok = false;
    }
}

// --- text

static const char *const op_names[] = {
    [TAPE_ADD] = "ADD", [TAPE_SUB] = "SUB",           [TAPE_BACK_SUB] = "BACK_SUB", [TAPE_MUL] = "MUL",
    [TAPE_DIV] = "DIV", [TAPE_BACK_DIV] = "BACK_DIV", [TAPE_MIN] = "MIN",           [TAPE_MAX] = "MAX",
    [TAPE_NEG] = "NEG", [TAPE_ABS] = "ABS",           [TAPE_SQUARE] = "SQUARE",     [TAPE_SQRT] = "SQRT",
};
static const char *const compare_names[] = {"BELOW", "FROM", "LESS", "NOT_LESS"}; // from SLICE_BELOW on

// Where numbers stand: as ranges, as packets of pixels, or in a loop over rows of pixels.
typedef enum Where { IN_RANGES, IN_PIXELS, IN_ROW } Where;

static void put_operand(Emitter *e, uint32_t k, Where where)
{
    const FormulaNumber *n = &e->f->numbers[k];
    if (n->op == TAPE_NUMBER)
        put(e, where == IN_RANGES ? "ALONE(%af)" : "all_of(%af)", (double)n->value);
    else
        put(e, where == IN_ROW && n->depends == SLICE_UP ? "EACH(n%u)" : "n%u", k);
}

static void put_number(Emitter *e, uint32_t k, Where where)
{
    const FormulaNumber *n = &e->f->numbers[k];
    if (where == IN_ROW) put(e, "    ");
    put(e, where == IN_RANGES ? "    Range n%u = RANGE_%s(" : "    FLOAT n%u = POINT_%s(", k, op_names[n->op]);
    put_operand(e, n->a, where);
    if (has_second(n->op)) {
        put(e, ", ");
        put_operand(e, n->b, where);
    }
    put(e, ");\n");
}

// The operands of a comparison: two numbers, or one and a float.
static void put_compared(Emitter *e, const FormulaCondition *c, Where where)
{
    put(e, "%s(", compare_names[c->op - SLICE_BELOW]);
    put_operand(e, c->a, where);
    put(e, ", ");
    if (has_two_numbers(c))
        put_operand(e, c->b, where);
    else
        put(e, "%af", (double)c->value);
    put(e, ")");
}

static uint32_t depends(const Emitter *e, const FormulaCondition *c)
{
    return e->f->numbers[c->a].depends | (has_two_numbers(c) ? e->f->numbers[c->b].depends : 0);
}

static bool is_written(const Emitter *e, uint32_t number)
{
    return e->number_marks[number] == e->serial && e->f->numbers[number].op < TAPE_OPS;
}

// The conditions of a group, joined: `prefix` and c1, c2 …
static void put_joined(Emitter *e, const Group *group, const char *prefix)
{
    const char *name = e->joined == SLICE_OR ? "OR" : "AND";
    for (uint32_t k = group->begin + 1; k < group->end; k++) put(e, "%s_%s(", prefix, name);
    put(e, "c%u", e->roots[group->begin]);
    for (uint32_t k = group->begin + 1; k < group->end; k++) put(e, ", c%u)", e->roots[k]);
}

static void put_logic(Emitter *e, uint32_t k, const char *type, const char *prefix)
{
    const FormulaCondition *c = &e->f->conditions[k];
    put(e, "    %s c%u = %s_%s(c%u, c%u);\n", type, k, prefix, c->op == SLICE_OR ? "OR" : "AND", c->a, c->b);
}

static void put_known(Emitter *e, const Group *group, uint32_t serial)
{
    const Formula *f = e->f;
    put(e, "NOINLINE uint known_%u(FLOAT a, FLOAT b, FLOAT c, FLOAT d)\n{\n    Range n0 = {a, b}, n1 = {c, d};\n",
        serial);
    for (uint32_t k = SLICE_POINT; k < f->number_count; k++) {
        if (is_written(e, k)) put_number(e, k, IN_RANGES);
    }
    for (uint32_t k = 2; k < f->condition_count; k++) {
        const FormulaCondition *c = &f->conditions[k];
        if (e->condition_marks[k] != e->serial) continue;
        if (is_logic(c)) {
            put_logic(e, k, "uint", "KNOWN");
        } else {
            put(e, "    uint c%u = KNOWN_", k);
            put_compared(e, c, IN_RANGES);
            put(e, ";\n");
        }
    }
    put(e, "    return ");
    put_joined(e, group, "KNOWN");
    put(e, ";\n}\n\n");
}

// What depends on both is computed row by row.
static void put_rows(Emitter *e)
{
    const Formula *f = e->f;
    bool any = false;
    for (uint32_t k = 2; k < f->condition_count; k++) {
        const FormulaCondition *c = &f->conditions[k];
        if (e->condition_marks[k] != e->serial || is_logic(c) || depends(e, c) != 3) continue;
        put(e, "    ushort b%u[16];\n", k);
        any = true;
    }
    if (!any) return;
    put(e, "    for (uint row = 0; row < 16; row++) {\n");
    for (uint32_t k = SLICE_POINT; k < f->number_count; k++) {
        if (is_written(e, k) && f->numbers[k].depends == 3) put_number(e, k, IN_ROW);
    }
    for (uint32_t k = 2; k < f->condition_count; k++) {
        const FormulaCondition *c = &f->conditions[k];
        if (e->condition_marks[k] != e->serial || is_logic(c) || depends(e, c) != 3) continue;
        put(e, "        b%u[row] = (ushort)mask_bits(POINT_", k);
        put_compared(e, c, IN_ROW);
        put(e, ");\n");
    }
    put(e, "    }\n");
}

static void put_pixels(Emitter *e, const Group *group, uint32_t serial)
{
    static const char *const forms[] = {"", "ROWS_ALIKE", "COLUMNS_ALIKE"};
    const Formula *f = e->f;
    put(e, "NOINLINE ushort16 pixels_%u(FLOAT n0, FLOAT n1)\n{\n", serial);
    for (uint32_t k = SLICE_POINT; k < f->number_count; k++) {
        if (is_written(e, k) && f->numbers[k].depends != 3) put_number(e, k, IN_PIXELS);
    }
    put_rows(e);
    for (uint32_t k = 2; k < f->condition_count; k++) {
        const FormulaCondition *c = &f->conditions[k];
        if (e->condition_marks[k] != e->serial) continue;
        if (is_logic(c)) {
            put_logic(e, k, "ushort16", "PIXELS");
        } else if (depends(e, c) == 3) {
            put(e, "    ushort16 c%u = vload16(0, b%u);\n", k, k);
        } else {
            put(e, "    ushort16 c%u = %s(POINT_", k, forms[depends(e, c)]);
            put_compared(e, c, IN_PIXELS);
            put(e, ");\n");
        }
    }
    put(e, "    return ");
    put_joined(e, group, "PIXELS");
    put(e, ";\n}\n\n");
}

// The function of any group: `head` is what it is called, `operands` what it passes on.
static void put_switch(Emitter *e, const char *head, const char *name, const char *operands)
{
    put(e, "static %s\n{\n    switch (group) {\n", head);
    for (uint32_t k = 1; k < e->group_count; k++) put(e, "    case %u: return %s_%u(%s);\n", k, name, k, operands);
    put(e, "    default: return %s_0(%s);\n    }\n}\n\n", name, operands);
}

static void put_text(Emitter *e)
{
    put(e, "#define SLICE_GROUPS_ALL %d // 1: a point is inside where all groups hold\n\n", e->joined == SLICE_AND);
    for (uint32_t k = 0; k < e->group_count; k++) {
        e->serial++;
        e->left = UINT32_MAX;
        for (uint32_t root = e->groups[k].begin; root < e->groups[k].end; root++) mark_condition(e, e->roots[root]);
        put_known(e, &e->groups[k], k);
        put_pixels(e, &e->groups[k], k);
    }
    put_switch(e, "uint group_known(uint group, Range u, Range v)", "known", "u.low, u.high, v.low, v.high");
    put_switch(e, "ushort16 group_pixels(uint group, FLOAT u, FLOAT v)", "pixels", "u, v");
}

bool formula_emit(const Formula *f, uint32_t condition, Arena *arena, FormulaCode *code)
{
    if (condition <= FORMULA_TRUE) return false;
    char *text = NULL;
    size_t length = 0;
    Emitter e = {.f = f, .ok = true};
    e.joined = f->conditions[condition].op == SLICE_AND ? SLICE_AND : SLICE_OR;
    e.number_marks = arena_array(&e.scratch, uint32_t, f->number_count);
    e.condition_marks = arena_array(&e.scratch, uint32_t, f->condition_count);
    find_roots(&e, condition);
    find_groups(&e);
    if (e.ok) {
        e.out = open_memstream(&text, &length);
        if (!e.out) abort(); // as in arena_alloc()
        put_text(&e);
        if (fclose(e.out)) abort();
        *code = (FormulaCode){arena_text(arena, text, length), length, e.group_count, e.steps};
        free(text);
    }
    arena_release(&e.scratch);
    return e.ok;
}
