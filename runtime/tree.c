// Trees are made from the leaves up; what is folded away is used again, so memory follows what is kept.
#include "runtime/tree.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

// --- Bounds

static Bounds everything(void)
{
    return (Bounds){{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
}

static Bounds nothing(void)
{
    return (Bounds){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

Bounds tree_hull(Bounds a, const Bounds *b)
{
    if (bounds_empty(b)) return a;
    for (int k = 0; k < 3; k++) {
        a.low[k] = fmin(a.low[k], b->low[k]);
        a.high[k] = fmax(a.high[k], b->high[k]);
    }
    return a;
}

Bounds tree_meeting(Bounds a, const Bounds *b)
{
    for (int k = 0; k < 3; k++) {
        a.low[k] = fmax(a.low[k], b->low[k]);
        a.high[k] = fmin(a.high[k], b->high[k]);
    }
    return bounds_empty(&a) ? nothing() : a;
}

static double area(const Bounds *box)
{
    double d[3];
    for (int k = 0; k < 3; k++) d[k] = box->high[k] - box->low[k];
    return 2 * (d[0] * d[1] + d[1] * d[2] + d[2] * d[0]);
}

// The share of the rays through the scene's bounds that cross a box.
double tree_crossed(const Tree *tree, const Bounds *box)
{
    if (bounds_empty(box)) return 0;
    if (!bounds_finite(&tree->scene) || !(area(&tree->scene) > 0)) return 1;
    Bounds inside = tree_meeting(*box, &tree->scene);
    return bounds_empty(&inside) ? 0 : area(&inside) / area(&tree->scene);
}

// The hull of all that is bounded.
static Bounds scene_bounds(const Plan *plan, const double *values)
{
    Bounds box = nothing();
    const PlanGroup *scene = &plan->groups[0];
    for (uint32_t k = 0; k < scene->component_count; k++) {
        Bounds part = bounds_of_component(plan, values, scene->component_begin + k);
        if (bounds_finite(&part)) box = tree_hull(box, &part);
    }
    return box;
}

Tree *tree_new(Arena *arena, const Plan *plan, const double *values)
{
    Tree *tree = arena_new(arena, Tree);
    tree->arena = arena;
    tree->params = plan->params;
    tree->param_count = plan->param_count;
    tree->words = (plan->param_count + 2 + 63) / 64;
    tree->scene = scene_bounds(plan, values);
    return tree;
}

// --- What moves

TreeMovers tree_mover(const Tree *tree, uint32_t bit)
{
    TreeMovers movers = arena_array(tree->arena, uint64_t, tree->words);
    movers[bit / 64] |= UINT64_C(1) << bit % 64;
    return movers;
}

static bool includes(const Tree *tree, const uint64_t *a, const uint64_t *b)
{
    for (uint32_t k = 0; k < tree->words; k++) {
        if (b[k] & ~a[k]) return false;
    }
    return true;
}

// One of the two where it includes the other: most nodes share what they depend on.
TreeMovers tree_join_movers(const Tree *tree, TreeMovers a, TreeMovers b)
{
    if (!b || a == b) return a;
    if (!a || includes(tree, b, a)) return b;
    if (includes(tree, a, b)) return a;
    TreeMovers both = arena_array(tree->arena, uint64_t, tree->words);
    for (uint32_t k = 0; k < tree->words; k++) both[k] = a[k] | b[k];
    return both;
}

const char *tree_mover_name(const Tree *tree, uint32_t k)
{
    if (k < 2) return k ? "frame" : "time";
    return tree->params[k - 2].name;
}

int tree_material(Tree *tree, const char *name)
{
    for (int k = tree->material_count - 1; k >= 0 && k >= tree->material_count - 64; k--) {
        if (!strcmp(tree->materials[k].name, name)) return k;
    }
    if (tree->material_count == tree->material_capacity) {
        tree->material_capacity = tree->material_capacity ? tree->material_capacity * 2 : 64;
        TreeMaterial *larger = arena_array(tree->arena, TreeMaterial, tree->material_capacity);
        if (tree->material_count) memcpy(larger, tree->materials, (size_t)tree->material_count * sizeof *larger);
        tree->materials = larger;
    }
    tree->materials[tree->material_count] = (TreeMaterial){name};
    return tree->material_count++;
}

// --- Nodes

TreeNode *tree_node(Tree *tree, TreeKind kind)
{
    TreeNode *node = tree->spare;
    if (node) {
        tree->spare = node->next;
        memset(node, 0, sizeof *node);
    } else {
        node = arena_new(tree->arena, TreeNode);
    }
    node->kind = (uint8_t)kind;
    node->count = 1;
    node->share = 1;
    node->class = CLASS_SET;
    node->material = TREE_NO_MATERIAL;
    node->inside =
        kind == TREE_INTERSECTION || kind == TREE_DIFFERENCE || kind == TREE_FIELD ? everything() : nothing();
    node->outside = kind == TREE_UNION || kind == TREE_EMPTY || kind == TREE_FIELD ? everything() : nothing();
    return node;
}

TreeNode *tree_quadric(Tree *tree, const double q[10])
{
    TreeNode *node = tree_node(tree, TREE_QUADRIC);
    node->class = CLASS_QUADRIC;
    node->quadrics = 1;
    node->inside = node->outside = everything();
    if (q) {
        double negative[10];
        for (int k = 0; k < 10; k++) negative[k] = -q[k];
        memcpy(node->q, q, sizeof node->q);
        node->plain = true;
        node->inside = bounds_of_quadric(q);
        node->outside = bounds_of_quadric(negative);
    }
    node->cost = tree_crossed(tree, &node->inside);
    return node;
}

static uint64_t mixed(uint64_t hash, uint64_t value)
{
    hash = (hash ^ value) * UINT64_C(0x9e3779b97f4a7c15);
    return hash ^ (hash >> 29);
}

// Of a text in which all numbers are alike.
static uint64_t text_hash(const char *text)
{
    uint64_t hash = 1;
    for (; text && *text; text++) {
        bool digit = isdigit((unsigned char)*text);
        if (digit && isdigit((unsigned char)text[1])) continue;
        hash = mixed(hash, digit ? '0' : (unsigned char)*text);
    }
    return hash;
}

static void set_hash(const Tree *tree, TreeNode *node)
{
    uint64_t hash = mixed(node->kind, node->rate);
    hash = mixed(hash, (uint64_t)node->class | (uint64_t)node->subtracted << 8 | (uint64_t)node->conditional << 9 |
                           (uint64_t)node->hidden << 10);
    hash = mixed(mixed(hash, text_hash(node->name)), text_hash(node->word));
    hash = mixed(hash, node->material != TREE_NO_MATERIAL);
    hash = mixed(mixed(hash, node->quadrics), node->supports);
    for (uint32_t k = 0; k < tree->words && node->movers; k++) hash = mixed(hash, node->movers[k]);
    for (const TreeNode *part = node->first; part; part = part->next)
        hash = mixed(mixed(hash, part->hash), part->count);
    node->hash = hash | 1; // 0 is no node's
}

static void release(Tree *tree, TreeNode *node)
{
    while (node->first) { // a part's parts come before it: no recursion
        TreeNode *part = node->first;
        node->first = part->next;
        if (part->first) {
            part->last->next = node->first;
            node->first = part->first;
        }
        part->next = tree->spare;
        tree->spare = part;
    }
    node->next = tree->spare;
    tree->spare = node;
}

// --- Folding

enum { TABLE_LEAST = 8 }; // parts that are looked through one by one

static void table_insert(TreeNode **table, uint32_t capacity, TreeNode *part)
{
    uint32_t at = (uint32_t)part->hash & (capacity - 1);
    while (table[at]) at = (at + 1) & (capacity - 1);
    table[at] = part;
}

static void table_add(Tree *tree, TreeNode *node, TreeNode *part)
{
    node->parts++;
    if (node->parts <= TABLE_LEAST) return;
    if (node->parts * 2 >= node->capacity) {
        node->capacity = node->capacity ? node->capacity * 4 : 4 * TABLE_LEAST;
        node->table = arena_array(tree->arena, TreeNode *, node->capacity);
        for (TreeNode *each = node->first; each; each = each->next) {
            if (each != part) table_insert(node->table, node->capacity, each);
        }
    }
    table_insert(node->table, node->capacity, part);
}

static TreeNode *alike(const TreeNode *node, const TreeNode *part)
{
    TreeNode *other = node->capacity ? NULL : node->first;
    for (; other && other->hash != part->hash; other = other->next) continue;
    for (uint32_t at = (uint32_t)part->hash; node->capacity; at++) {
        other = node->table[at & (node->capacity - 1)];
        if (!other || other->hash == part->hash) break;
    }
    return other;
}

static void fold(Tree *tree, TreeNode *into, TreeNode *part)
{
    into->count += part->count;
    into->quadrics += part->quadrics;
    into->supports += part->supports;
    into->cost += part->cost;
    into->inside = tree_hull(into->inside, &part->inside);
    if (into->material != part->material) into->material = TREE_MATERIALS;
    if (part->name && strcmp(part->name, into->name)) into->last_name = part->name;
    release(tree, part);
}

// --- Joining

static void keep_quadric(Tree *tree, TreeNode *node, const TreeNode *child, bool negated)
{
    const TreeNode *leaf = child;
    for (; leaf->kind == TREE_COMPLEMENT && leaf->first; leaf = leaf->first) negated = !negated;
    if (!leaf->plain || node->meeting_count == TREE_MEETING) return;
    double *q = arena_array(tree->arena, double, 10); // the child may be folded away
    memcpy(q, leaf->q, sizeof leaf->q);
    node->meeting_negated[node->meeting_count] = negated;
    node->meeting[node->meeting_count++] = q;
}

void tree_add(Tree *tree, TreeNode *node, TreeNode *child, bool subtracted)
{
    const Bounds *in = subtracted ? &child->outside : &child->inside,
                 *out = subtracted ? &child->inside : &child->outside;
    switch ((TreeKind)node->kind) {
    case TREE_UNION:
        node->inside = tree_hull(node->inside, in);
        node->outside = tree_meeting(node->outside, out);
        break;
    case TREE_INTERSECTION:
    case TREE_DIFFERENCE:
        node->inside = tree_meeting(node->inside, in);
        node->outside = tree_hull(node->outside, out);
        break;
    case TREE_COMPLEMENT:
        node->inside = child->outside;
        node->outside = child->inside;
        break;
    default:
        node->inside = child->inside;
        node->outside = child->outside;
        break;
    }
    keep_quadric(tree, node, child, subtracted);
    node->quadrics += child->quadrics;
    node->supports += child->supports;
    child->subtracted = subtracted;
    set_hash(tree, child);
    TreeNode *same = alike(node, child);
    if (same) {
        fold(tree, same, child);
        return;
    }
    if (node->last)
        node->last->next = child;
    else
        node->first = child;
    node->last = child;
    table_add(tree, node, child);
}

// The better bounds of an intersection of quadrics; of a union they are those of what is outside.
static void cut(TreeNode *node)
{
    bool united = node->kind == TREE_UNION;
    if (!united && node->kind != TREE_INTERSECTION && node->kind != TREE_DIFFERENCE) return;
    double copies[TREE_MEETING][10];
    const double *quadrics[TREE_MEETING];
    for (int i = 0; i < node->meeting_count; i++) {
        double sign = node->meeting_negated[i] != united ? -1 : 1;
        for (int k = 0; k < 10; k++) copies[i][k] = sign * node->meeting[i][k];
        quadrics[i] = copies[i];
    }
    bounds_cut(united ? &node->outside : &node->inside, quadrics, (uint32_t)node->meeting_count);
}

void tree_finish(Tree *tree, TreeNode *node)
{
    cut(node);
    bool meets = node->kind == TREE_INTERSECTION || node->kind == TREE_DIFFERENCE;
    node->cost = 0;
    for (TreeNode *part = node->first; part; part = part->next) {
        if (meets) {
            Bounds both = tree_meeting(part->inside, &node->inside);
            double alone = tree_crossed(tree, &part->inside);
            part->share = alone > 0 ? tree_crossed(tree, &both) / alone : 0;
        }
        node->cost += part->cost * part->share;
    }
    node->table = NULL;
    node->capacity = node->parts = 0;
}

// --- Words

const char *tree_kind_name(TreeKind kind)
{
    static const char *const names[TREE_KINDS] = {"nothing",    "quadric",    "free form", "union", "intersection",
                                                  "difference", "complement", "deformed",  "field", "named"};
    return names[kind];
}

const char *tree_class_name(const TreeNode *node)
{
    switch ((IrClass)node->class) {
    case CLASS_QUADRIC: return "quadric";
    case CLASS_FREEFORM: return "free form";
    case CLASS_GENERAL: return "field";
    case CLASS_NONE:
    case CLASS_SET: break;
    }
    return "set";
}
