#include "compiler/shapes.h"

#include <stdlib.h>
#include <string.h>

#define KIND_BITS 4
#define KIND_MASK ((1 << KIND_BITS) - 1)

_Static_assert(SHAPE_GROUP <= KIND_MASK, "the kind of a node fits into its bits of a word");

Shapes shapes_new(Arena *scratch)
{
    Shapes shapes = {.scratch = scratch, .count = 1, .type_count = 1, .hashes = pairs_new(scratch)};
    shapes.list = array_room(scratch, NULL, 0, &shapes.capacity, sizeof(Shape));
    shapes.types = array_room(scratch, NULL, 0, &shapes.type_capacity, sizeof(GroupType));
    shapes.first = array_room(scratch, NULL, 0, &shapes.first_capacity, sizeof(uint32_t));
    return shapes;
}

static uint64_t mix(uint64_t h, uint64_t value)
{
    h = (h ^ value) * 0x9e3779b97f4a7c15u;
    return h ^ h >> 31;
}

// Where the first shape or type of a hash stands.
static uint32_t *first_of(Shapes *s, uint64_t hash)
{
    bool added;
    uint32_t index = pairs_index(&s->hashes, (uint32_t)(hash >> 32), (uint32_t)hash, &added);
    if (added) {
        s->first = array_room(s->scratch, s->first, index, &s->first_capacity, sizeof *s->first);
        s->first[index] = 0;
    }
    return &s->first[index];
}

static ShapeNodeKind word_kind(uint32_t word)
{
    return word & KIND_MASK;
}
static uint32_t word_count(uint32_t word)
{
    return word >> KIND_BITS;
}
static uint32_t word_of(ShapeNodeKind kind, uint32_t count)
{
    return count << KIND_BITS | kind;
}

// The shape of the words that stand in the buffer.
static uint32_t intern(Shapes *s, uint32_t count)
{
    uint64_t hash = 1;
    uint32_t leaves = 0, level = 0;
    for (uint32_t k = 0; k < count; k++) {
        uint32_t word = s->words[k];
        if (word_kind(word) == SHAPE_GROUP) {
            const GroupType *type = &s->types[word_count(word)];
            hash = mix(mix(hash, SHAPE_GROUP), type->hash);
            if (type->level + 1 > level) level = type->level + 1;
        } else {
            hash = mix(hash, word);
        }
        if (word_kind(word) >= SHAPE_QUADRIC) leaves++;
    }
    uint32_t *first = first_of(s, hash);
    for (uint32_t k = *first; k; k = s->list[k].next) {
        if (s->list[k].word_count == count && !memcmp(s->list[k].words, s->words, count * sizeof *s->words)) return k;
    }
    s->list = array_room(s->scratch, s->list, s->count, &s->capacity, sizeof *s->list);
    Shape *shape = &s->list[s->count];
    *shape = (Shape){.word_count = count, .leaf_count = leaves, .level = level, .hash = hash, .next = *first};
    shape->words = arena_array(s->scratch, uint32_t, count);
    memcpy(shape->words, s->words, count * sizeof *s->words);
    return *first = s->count++;
}

static void put_word(Shapes *s, uint32_t at, uint32_t word)
{
    s->words = array_room(s->scratch, s->words, at, &s->word_capacity, sizeof *s->words);
    s->words[at] = word;
}

uint32_t shapes_leaf(Shapes *s, ShapeNodeKind kind)
{
    put_word(s, 0, word_of(kind, 0));
    return intern(s, 1);
}

uint32_t shapes_group(Shapes *s, uint32_t type)
{
    put_word(s, 0, word_of(SHAPE_GROUP, type));
    return intern(s, 1);
}

uint32_t shapes_set(Shapes *s, PlanSetKind set, const uint32_t *children, uint32_t count)
{
    if (count == 1) return children[0];
    uint32_t at = 0;
    put_word(s, at++, word_of(set == SET_UNION ? SHAPE_UNION : SHAPE_INTERSECT, count));
    for (uint32_t k = 0; k < count; k++) {
        for (uint32_t w = 0; w < s->list[children[k]].word_count; w++) put_word(s, at++, s->list[children[k]].words[w]);
    }
    return intern(s, at);
}

// --- group types

static int by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return x < y ? -1 : x > y;
}

static uint32_t type_new(Shapes *s, GroupType type)
{
    s->types = array_room(s->scratch, s->types, s->type_count, &s->type_capacity, sizeof *s->types);
    s->types[s->type_count] = type;
    return s->type_count++;
}

uint32_t shapes_type(Shapes *s, PlanSetKind set, const uint32_t *list, uint32_t count)
{
    uint32_t *sorted = arena_array(s->scratch, uint32_t, count);
    uint32_t kept = 0, level = 0;
    uint64_t hash = 0;
    if (count) memcpy(sorted, list, count * sizeof *sorted);
    qsort(sorted, count, sizeof *sorted, by_number);
    for (uint32_t k = 0; k < count; k++) {
        if (kept && sorted[kept - 1] == sorted[k]) continue;
        const Shape *shape = &s->list[sorted[k]];
        sorted[kept++] = sorted[k];
        hash += mix(3, shape->hash); // a sum: the same in any order
        if (shape->level > level) level = shape->level;
    }
    hash = mix(mix(5, set), hash);
    uint32_t *first = first_of(s, hash);
    for (uint32_t k = *first; k; k = s->types[k].next) {
        const GroupType *type = &s->types[k];
        if (type->set == set && type->count == kept && !memcmp(type->shapes, sorted, kept * sizeof *sorted)) return k;
    }
    GroupType type = {.set = set, .shapes = sorted, .count = kept, .level = level, .hash = hash, .next = *first};
    return *first = type_new(s, type);
}

uint32_t shapes_level_type(Shapes *s, PlanSetKind set, uint32_t level)
{
    uint64_t hash = mix(mix(7, set), level);
    uint32_t *first = first_of(s, hash);
    for (uint32_t k = *first; k; k = s->types[k].next) {
        if (s->types[k].set == set && s->types[k].capacity && s->types[k].level == level) return k;
    }
    GroupType type = {.set = set, .level = level, .hash = hash, .next = *first};
    type.shapes = array_room(s->scratch, NULL, 0, &type.capacity, sizeof *type.shapes);
    return *first = type_new(s, type);
}

void shapes_level_add(Shapes *s, uint32_t index, uint32_t shape)
{
    GroupType *type = &s->types[index];
    for (uint32_t k = type->count; k-- > 0;) {
        if (type->shapes[k] == shape) return;
    }
    type->shapes = array_room(s->scratch, type->shapes, type->count, &type->capacity, sizeof *type->shapes);
    type->shapes[type->count++] = shape;
}

// --- what is used

uint32_t shapes_use(Shapes *s, uint32_t index)
{
    GroupType *type = &s->types[index];
    uint32_t added = 0;
    if (type->used) return 0;
    type->used = true;
    for (uint32_t k = 0; k < type->count; k++) {
        Shape *shape = &s->list[type->shapes[k]];
        if (shape->used) continue;
        shape->used = true;
        added++;
        for (uint32_t w = 0; w < shape->word_count; w++) {
            if (word_kind(shape->words[w]) == SHAPE_GROUP) added += shapes_use(s, word_count(shape->words[w]));
        }
    }
    return added;
}

void shapes_use_none(Shapes *s)
{
    for (uint32_t k = 1; k < s->count; k++) s->list[k].used = false;
    for (uint32_t k = 1; k < s->type_count; k++) s->types[k].used = false;
}

// --- the plan

typedef struct Rank { // what a shape or type is numbered by
    uint32_t level, size, old;
    uint64_t hash;
} Rank;

static int by_rank(const void *a, const void *b)
{
    const Rank *x = a, *y = b;
    if (x->level != y->level) return x->level < y->level ? -1 : 1;
    if (x->size != y->size) return x->size < y->size ? -1 : 1;
    if (x->hash != y->hash) return x->hash < y->hash ? -1 : 1;
    return x->old < y->old ? -1 : 1;
}

static PlanShape finished_shape(const Shape *shape, Arena *arena, const uint32_t *new_types)
{
    PlanShape result = {.node_count = shape->word_count, .leaf_count = shape->leaf_count};
    uint32_t leaf = 0;
    result.nodes = arena_array(arena, PlanShapeNode, shape->word_count);
    for (uint32_t w = 0; w < shape->word_count; w++) {
        PlanShapeNode *node = &result.nodes[w];
        uint32_t count = word_count(shape->words[w]);
        node->kind = word_kind(shape->words[w]);
        node->count = (uint16_t)(node->kind == SHAPE_GROUP ? new_types[count] : count);
        if (node->kind >= SHAPE_QUADRIC) node->leaf = leaf++;
    }
    return result;
}

static PlanGroupType finished_type(const GroupType *type, Arena *arena, const uint32_t *new_shapes)
{
    PlanGroupType result = {.set = type->set, .shape_count = type->count};
    result.shapes = arena_array(arena, uint32_t, type->count);
    for (uint32_t k = 0; k < type->count; k++) result.shapes[k] = new_shapes[type->shapes[k]];
    qsort(result.shapes, type->count, sizeof *result.shapes, by_number);
    return result;
}

// A type's level is that of its highest shape, and a shape's is above those of its groups' types: so by level both are
// bottom-up.
void shapes_finish(const Shapes *s, Arena *arena, Plan *plan, uint32_t *new_shapes, uint32_t *new_types)
{
    Rank *ranks = arena_array(s->scratch, Rank, s->count + s->type_count);
    uint32_t types = 0, shapes = 0;
    for (uint32_t k = 1; k < s->type_count; k++) {
        const GroupType *type = &s->types[k];
        if (type->used) ranks[types++] = (Rank){type->level, type->count, k, type->hash};
    }
    qsort(ranks, types, sizeof *ranks, by_rank);
    for (uint32_t k = 0; k < types; k++) new_types[ranks[k].old] = k;
    Rank *shape_ranks = ranks + types;
    for (uint32_t k = 1; k < s->count; k++) {
        const Shape *shape = &s->list[k];
        if (shape->used) shape_ranks[shapes++] = (Rank){shape->level, shape->word_count, k, shape->hash};
    }
    qsort(shape_ranks, shapes, sizeof *ranks, by_rank);
    plan->shapes = arena_array(arena, PlanShape, shapes);
    plan->shape_count = shapes;
    for (uint32_t k = 0; k < shapes; k++) {
        new_shapes[shape_ranks[k].old] = k;
        plan->shapes[k] = finished_shape(&s->list[shape_ranks[k].old], arena, new_types);
    }
    plan->group_types = arena_array(arena, PlanGroupType, types);
    plan->group_type_count = types;
    for (uint32_t k = 0; k < types; k++)
        plan->group_types[k] = finished_type(&s->types[ranks[k].old], arena, new_shapes);
}
