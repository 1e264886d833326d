// From productions to rules. Each rule is made of its own productions first (repetitions, optional parts), then lists are put where they
// are used.
#include <assert.h>
#include <string.h>

#include "tests/docs/grammar.h"

enum { ALTERNATIVES = 64 };

// --- Parts ---

bool part_equal(const Part *a, const Part *b)
{
    if (a->kind != b->kind || a->count != b->count) return false;
    if (a->text && strcmp(a->text, b->text) != 0) return false;
    for (int i = 0; i < a->count; i++)
        if (!part_equal(a->parts[i], b->parts[i])) return false;
    return true;
}

static Part *with_parts(Arena *arena, PartKind kind, Part **parts, int count)
{
    Part *part = part_leaf(arena, kind, NULL);
    part->parts = arena_array(arena, Part *, count + 1);
    part->count = count;
    if (count) memcpy(part->parts, parts, (size_t)count * sizeof *parts);
    return part;
}

Part *part_sequence(Arena *arena, Part **parts, int count)
{
    Part *flat[ALTERNATIVES];
    int length = 0;
    for (int i = 0; i < count; i++) {
        bool nested = parts[i]->kind == PART_SEQUENCE;
        int inner = nested ? parts[i]->count : 1;
        assert(length + inner <= ALTERNATIVES && "productions are short");
        for (int k = 0; k < inner; k++) flat[length++] = nested ? parts[i]->parts[k] : parts[i];
    }
    return length == 1 ? flat[0] : with_parts(arena, PART_SEQUENCE, flat, length);
}

Part *part_choice(Arena *arena, Part **parts, int count)
{
    return count == 1 ? parts[0] : with_parts(arena, PART_CHOICE, parts, count);
}

Part *part_wrap(Arena *arena, PartKind kind, Part *part)
{
    return with_parts(arena, kind, &part, 1);
}

static int size_of(const Part *part)
{
    int size = part->count == 0;
    for (int i = 0; i < part->count; i++) size += size_of(part->parts[i]);
    return size;
}

static bool names(const Part *part, const char *rule)
{
    return part->kind == PART_RULE && strcmp(part->text, rule) == 0;
}

// The parts of a sequence; any other part is a sequence of itself.
static Part **items_of(Part **part, int *count)
{
    bool sequence = (*part)->kind == PART_SEQUENCE;
    *count = sequence ? (*part)->count : 1;
    return sequence ? (*part)->parts : part;
}

// --- Alternatives that are nearly the same ---

typedef struct Alternatives {
    Part *list[ALTERNATIVES];
    int count;
} Alternatives;

// x y and x i y are x [i] y. Returns NULL if the longer has not just something more.
static Part *joined_by_insertion(Arena *arena, Part *a, Part *b)
{
    int short_count, long_count, same = 0;
    if (items_of(&a, &short_count), items_of(&b, &long_count), short_count > long_count) {
        Part *other = a;
        a = b;
        b = other;
    }
    Part **shorter = items_of(&a, &short_count), **longer = items_of(&b, &long_count);
    if (short_count == long_count) return NULL;
    while (same < short_count && part_equal(shorter[same], longer[same])) same++;
    int more = long_count - short_count;
    for (int i = same; i < short_count; i++)
        if (!part_equal(shorter[i], longer[i + more])) return NULL;
    if (same == 0) return NULL;
    Part *parts[3] = {part_sequence(arena, longer, same),
                      part_wrap(arena, PART_OPTIONAL, part_sequence(arena, longer + same, more)),
                      part_sequence(arena, longer + same + more, short_count - same)};
    return part_sequence(arena, parts, 3);
}

// x a y and x b y are x (a | b) y, where a and b are names of rules or classes, and x y is longer than three.
static Part *joined_by_choice(Arena *arena, Part *a, Part *b)
{
    int count, other_count, place = -1;
    Part **one = items_of(&a, &count), **other = items_of(&b, &other_count);
    if (count != other_count || count < 4) return NULL;
    for (int i = 0; i < count; i++) {
        if (part_equal(one[i], other[i])) continue;
        bool name = one[i]->kind == PART_RULE || one[i]->kind == PART_CLASS;
        if (place >= 0 || i == 0 || !name || one[i]->kind != other[i]->kind) return NULL;
        place = i;
    }
    if (place < 0) return NULL;
    Part *both[2] = {one[place], other[place]};
    Part *parts[3] = {part_sequence(arena, one, place), part_choice(arena, both, 2),
                      part_sequence(arena, one + place + 1, count - place - 1)};
    return part_sequence(arena, parts, 3);
}

static int total_size(const Alternatives *all)
{
    int size = 0;
    for (int i = 0; i < all->count; i++) size += size_of(all->list[i]);
    return size;
}

// Tries every order in which the alternatives of a small group can be joined, and keeps the one that leaves the fewest and shortest.
static void join_group(Arena *arena, const Alternatives *group, Alternatives *best)
{
    bool better = group->count < best->count || (group->count == best->count && total_size(group) < total_size(best));
    if (best->count == 0 || better) *best = *group;
    for (int i = 0; i < group->count; i++) {
        for (int k = i + 1; k < group->count; k++) {
            Part *joined = joined_by_insertion(arena, group->list[i], group->list[k]);
            if (!joined) joined = joined_by_choice(arena, group->list[i], group->list[k]);
            if (!joined) continue;
            Alternatives next = *group;
            next.list[i] = joined;
            memmove(&next.list[k], &next.list[k + 1], (size_t)(next.count - k - 1) * sizeof *next.list);
            next.count--;
            join_group(arena, &next, best);
        }
    }
}

// Only alternatives that begin alike can be joined: each group of those by itself, at the place of its first.
static Alternatives join(Arena *arena, const Alternatives *all)
{
    Alternatives result = {.count = 0};
    bool used[ALTERNATIVES] = {false};
    for (int i = 0; i < all->count; i++) {
        if (used[i]) continue;
        Alternatives group = {.count = 0}, best = {.count = 0};
        for (int k = i; k < all->count; k++) {
            Part *a = all->list[i], *b = all->list[k];
            int count;
            Part **first = items_of(&a, &count), **other = items_of(&b, &count);
            if (used[k] || !part_equal(first[0], other[0])) continue;
            used[k] = true;
            group.list[group.count++] = b;
        }
        join_group(arena, &group, &best);
        for (int k = 0; k < best.count; k++) result.list[result.count++] = best.list[k];
    }
    return result;
}

static Part *choice_of(Arena *arena, Alternatives all)
{
    Alternatives joined = join(arena, &all);
    return part_choice(arena, joined.list, joined.count);
}

// --- One rule ---

typedef struct Shape {                           // the productions of one rule by their form
    Alternatives bases, tails, operators, signs; // A: x, A: A x, A: A x A, A: x A
    bool empty;
} Shape;

static bool is_left_out(const Production *production)
{
    if (production->foreign) return true;
    const Part *sequence = production->sequence;
    for (int i = 0; i < sequence->count; i++) {
        const char *text = sequence->parts[i]->text;
        if (strcmp(text, "error") == 0 || strcmp(text, "MISSING") == 0) return true;
    }
    return false;
}

static void add(Alternatives *all, Part *part)
{
    assert(all->count < ALTERNATIVES && "a rule has a few dozen productions");
    all->list[all->count++] = part;
}

static Shape shape_of(Grammar *grammar, const char *name)
{
    Shape shape = {.empty = false};
    Arena *arena = &grammar->arena;
    Alternatives right = {.count = 0};
    for (int i = 0; i < grammar->production_count; i++) {
        const Production *p = &grammar->productions[i];
        if (strcmp(p->name, name) != 0 || is_left_out(p)) continue;
        Part **parts = p->sequence->parts;
        int count = p->sequence->count;
        bool left_recursive = count > 0 && names(parts[0], name),
             right_recursive = count > 1 && names(parts[count - 1], name);
        if (count == 0)
            shape.empty = true;
        else if (left_recursive && right_recursive && count == 3)
            add(&shape.operators, parts[1]);
        else if (left_recursive)
            add(&shape.tails, part_sequence(arena, parts + 1, count - 1));
        else if (right_recursive && count == 2)
            add(&right, p->sequence);
        else
            add(&shape.bases, part_sequence(arena, parts, count));
    }
    for (int i = 0; i < right.count; i++) { // a sign, if there are operators that it stands between
        if (shape.operators.count)
            add(&shape.signs, right.list[i]->parts[0]);
        else
            add(&shape.bases, right.list[i]);
    }
    return shape;
}

// What operators stand between: signs, a base, tails. A base of several forms becomes the rule `primary`.
static Part *operand_of(Arena *arena, const Shape *shape, Rule *rules, int *count)
{
    Part *parts[3], *base = choice_of(arena, shape->bases);
    int length = 0;
    if (base->kind == PART_CHOICE) {
        rules[(*count)++] = (Rule){"primary", base};
        base = part_leaf(arena, PART_RULE, "primary");
    }
    if (shape->signs.count) parts[length++] = part_wrap(arena, PART_REPEAT, choice_of(arena, shape->signs));
    parts[length++] = base;
    if (shape->tails.count) parts[length++] = part_wrap(arena, PART_REPEAT, choice_of(arena, shape->tails));
    return part_sequence(arena, parts, length);
}

static void add_expression(Arena *arena, const char *name, const Shape *shape, Rule *rules, int *count)
{
    int own = (*count)++, operand_rule = own + 1;
    Rule made[2];
    int made_count = 0;
    Part *operand = operand_of(arena, shape, made, &made_count);
    if (made_count || size_of(operand) > 3) {
        rules[operand_rule] = (Rule){"operand", operand};
        (*count)++;
        operand = part_leaf(arena, PART_RULE, "operand");
    }
    for (int i = 0; i < made_count; i++) rules[(*count)++] = made[i];
    Part *more[2] = {choice_of(arena, shape->operators), operand};
    Part *parts[2] = {operand, part_wrap(arena, PART_REPEAT, part_sequence(arena, more, 2))};
    rules[own] = (Rule){name, part_sequence(arena, parts, 2)};
}

static void add_rule(Grammar *grammar, const char *name, Rule *rules, int *count)
{
    Shape shape = shape_of(grammar, name);
    Arena *arena = &grammar->arena;
    if (shape.operators.count) {
        add_expression(arena, name, &shape, rules, count);
        return;
    }
    Part *parts[2];
    int length = 0;
    if (shape.bases.count) {
        Part *base = choice_of(arena, shape.bases);
        parts[length++] = shape.empty ? part_wrap(arena, PART_OPTIONAL, base) : base;
    }
    if (shape.tails.count) parts[length++] = part_wrap(arena, PART_REPEAT, choice_of(arena, shape.tails));
    if (length) rules[(*count)++] = (Rule){name, part_sequence(arena, parts, length)};
}

// --- All rules ---

static int uses(const Part *part, const char *name)
{
    int count = names(part, name);
    for (int i = 0; i < part->count; i++) count += uses(part->parts[i], name);
    return count;
}

static Part *put(Arena *arena, Part *part, const Rule *rule)
{
    if (names(part, rule->name)) return rule->body;
    if (part->count == 0) return part;
    Part *parts[ALTERNATIVES];
    for (int i = 0; i < part->count; i++) parts[i] = put(arena, part->parts[i], rule);
    return part->kind == PART_SEQUENCE ? part_sequence(arena, parts, part->count)
                                       : with_parts(arena, part->kind, parts, part->count);
}

static bool is_list(const Grammar *grammar, const char *name)
{
    for (int i = 0; i < grammar->list_count; i++)
        if (strcmp(grammar->lists[i], name) == 0) return true;
    return false;
}

// A rule is put where it is used if it only names another, is short and optional or repeated, or is a list that is used once.
static bool is_put(const Grammar *grammar, const Rule *rule, int used)
{
    const Part *body = rule->body;
    if (used == 0 || uses(body, rule->name)) return false;
    bool list = body->kind == PART_REPEAT || body->kind == PART_OPTIONAL;
    return body->count == 0 || (list && size_of(body) <= 3) || (used == 1 && is_list(grammar, rule->name));
}

static void remove_rule(Rule *rules, int *count, int which)
{
    memmove(&rules[which], &rules[which + 1], (size_t)(*count - which - 1) * sizeof *rules);
    (*count)--;
}

int grammar_simplify(Grammar *grammar, Rule *rules)
{
    int count = 0;
    for (int i = 0; i < grammar->production_count; i++) {
        const char *name = grammar->productions[i].name;
        if (i == 0 || strcmp(name, grammar->productions[i - 1].name) != 0) add_rule(grammar, name, rules, &count);
    }
    for (int i = count - 1; i > 0; i--) { // the first is where reading begins
        int used = 0;
        for (int k = 0; k < count; k++) used += uses(rules[k].body, rules[i].name);
        bool put_in = is_put(grammar, &rules[i], used);
        if (!put_in && used) continue;
        Rule rule = rules[i];
        remove_rule(rules, &count, i);
        for (int k = 0; k < count; k++) rules[k].body = put(&grammar->arena, rules[k].body, &rule);
        i = count; // what it uses may now be used once
    }
    return count;
}
