// Semantics. A ray meets a set operation by marching half-open intervals. For every node of a shape's tree
//
//     enter(t) = the smallest t' >= t that is inside,    leave(t) = the smallest t' >= t that is not
//
//     union          enter: the least of the children's enter    leave: go on while some child is inside, until all agree
//     intersection   enter: go on while some child is outside    leave: the least of the children's leave
//
// So one recursion writes both functions: `least` where the set and the direction are of one kind, `agree` else. Quadrics answer from their two
// roots; free forms and groups keep the stretch they found last, so asking again gives the same number and the marching ends. The leaf that
// decides is the one whose boundary is where the marching ended; of several the lowest rank. Where trees are deep the marching is one loop over all
// leaves instead, and the tree a table (emit_deep_march()).
#include "compiler/emit.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kernel_source.h"

typedef struct Emitter {
    FILE *out;
    const Plan *plan;
    const PlanShape *shape; // that is being written
    bool leave;             // its leave function, not enter
    uint32_t next;          // node of the shape
    uint32_t serial;        // of the variables of the function
    int depth;              // of blocks
} Emitter;

static void line(Emitter *e, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void line(Emitter *e, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    for (int k = 0; k < e->depth; k++) fputs("    ", e->out);
    vfprintf(e->out, format, args);
    fputc('\n', e->out);
    va_end(args);
}

static const char *direction(const Emitter *e)
{
    return e->leave ? "leave" : "enter";
}

static bool is_leaf(const PlanShapeNode *node)
{
    return node->kind >= SHAPE_QUADRIC;
}

// Whether components of the shape bring items of their own into lists.
static bool has_contents(const PlanShape *shape)
{
    for (uint32_t k = 0; k < shape->node_count; k++)
        if (shape->nodes[k].kind > SHAPE_QUADRIC) return true;
    return false;
}

static bool plan_has(const Plan *plan, ShapeNodeKind kind)
{
    for (uint32_t k = 0; k < plan->shape_count; k++)
        for (uint32_t n = 0; n < plan->shapes[k].node_count; n++)
            if (plan->shapes[k].nodes[n].kind == kind) return true;
    return false;
}

// The tree in words: "intersect(quadric, union(quadric, free form))".
static void describe(Emitter *e)
{
    const PlanShapeNode *node = &e->shape->nodes[e->next++];
    switch ((ShapeNodeKind)node->kind) {
    case SHAPE_QUADRIC: fputs("quadric", e->out); return;
    case SHAPE_FREEFORM: fputs("free form", e->out); return;
    case SHAPE_FIELD: fputs("field", e->out); return;
    case SHAPE_LIFTED: fputs("lifted free form", e->out); return;
    case SHAPE_SHEET: fputs("sheet", e->out); return;
    case SHAPE_THICK: fputs("thick sheet", e->out); return;
    case SHAPE_GROUP: fprintf(e->out, "group %u", node->count); return;
    case SHAPE_UNION: fputs("union(", e->out); break;
    case SHAPE_INTERSECT: fputs("intersect(", e->out); break;
    }
    for (uint32_t k = 0; k < node->count; k++) {
        if (k) fputs(", ", e->out);
        describe(e);
    }
    fputc(')', e->out);
}

// Variables that hold what is known of each leaf: its number, its contents in the list, its roots or stretch.
static void emit_leaves(Emitter *e)
{
    const PlanShapeNode *last = NULL;
    bool many = e->shape->leaf_count > 1, before = false;
    for (uint32_t k = 0; k < e->shape->node_count; k++) {
        const PlanShapeNode *node = &e->shape->nodes[k];
        if (!is_leaf(node)) continue;
        uint32_t n = node->leaf;
        bool asked = many || node->kind != SHAPE_GROUP; // a group alone has no use for its number
        if (!last && asked)
            line(e, "uint leaf%u = id;", n);
        else if (last && (last->kind == SHAPE_QUADRIC || last->kind == SHAPE_FIELD))
            line(e, "uint leaf%u = leaf%u + 1u;", n, last->leaf);
        else if (last)
            line(e, "uint leaf%u = ray->nodes[leaf%u].end;", n, last->leaf);
        if (node->kind == SHAPE_QUADRIC) {
            line(e, "uint flags%u = ray->records[leaf%u].flags;", n, n);
            line(e, "Roots roots%u = record_roots(ray->records + leaf%u, ray->u, ray->v);", n, n);
        } else if (node->kind == SHAPE_FIELD) {
            line(e, "Stretch stretch%u = {INFINITY, -INFINITY};", n);
        } else {
            if (before)
                line(e, "uint begin%u = list_until(ray, begin, stop, leaf%u);", n, n);
            else
                line(e, "uint begin%u = begin;", n);
            if (many)
                line(e, "uint stop%u = list_until(ray, begin%u, stop, ray->nodes[leaf%u].end);", n, n, n);
            else
                line(e, "uint stop%u = stop;", n);
            line(e, "Stretch stretch%u = {INFINITY, -INFINITY};", n);
            if (node->kind == SHAPE_GROUP) line(e, "UINT decided%u = NO_LEAF;", n);
            before = true;
        }
        last = node;
    }
}

// Writes the statements that advance from the place `from`; returns the number of the variable that holds the result.
static uint32_t emit_advance(Emitter *e, const char *from)
{
    const PlanShapeNode *node = &e->shape->nodes[e->next++];
    uint32_t result = e->serial++;
    uint32_t n = node->leaf;
    const char *sign = e->leave ? "-1.0f" : "1.0f";
    switch ((ShapeNodeKind)node->kind) {
    case SHAPE_QUADRIC:
        line(e, "FLOAT t%u = quadric_%s(roots%u, flags%u, %s);", result, direction(e), n, n, from);
        return result;
    case SHAPE_FREEFORM:
        line(e, "FLOAT t%u = freeform_advance(ray, leaf%u, begin%u, stop%u, &stretch%u, %s, bound, %s);", result, n, n,
             n, n, from, sign);
        return result;
    case SHAPE_FIELD:
        line(e, "FLOAT t%u = field_advance(ray, leaf%u, &stretch%u, %s, bound, %s);", result, n, n, from, sign);
        return result;
    case SHAPE_LIFTED:
        line(e, "FLOAT t%u = lifted_advance(ray, leaf%u, begin%u, stop%u, &stretch%u, %s, bound, %s);", result, n, n, n,
             n, from, sign);
        return result;
    case SHAPE_SHEET:
        line(e, "FLOAT t%u = sheet_%s(ray, leaf%u, begin%u, stop%u, &stretch%u, %s, bound);", result, direction(e), n,
             n, n, n, from);
        return result;
    case SHAPE_THICK:
        line(e, "FLOAT t%u = thick_advance(ray, leaf%u, begin%u, stop%u, &stretch%u, %s, bound, %s);", result, n, n, n,
             n, from, sign);
        return result;
    case SHAPE_GROUP:
        line(e, "FLOAT t%u = group_%u_%s_advance(ray, begin%u, stop%u, &stretch%u, &decided%u, %s, bound);", result,
             node->count, direction(e), n, n, n, n, from);
        return result;
    default: break;
    }
    bool least = (node->kind == SHAPE_UNION) != e->leave;
    if (least) {
        line(e, "FLOAT t%u = INFINITY;", result);
        for (uint32_t k = 0; k < node->count; k++) {
            uint32_t child = emit_advance(e, from);
            line(e, "t%u = least(t%u, t%u);", result, result, child);
        }
        return result;
    }
    line(e, "FLOAT t%u = %s;", result, from);
    char self[16];
    snprintf(self, sizeof self, "t%u", result);
    line(e, "for (;;) {");
    e->depth++;
    line(e, "FLOAT before%u = t%u;", result, result);
    for (uint32_t k = 0; k < node->count; k++) {
        uint32_t child = emit_advance(e, self);
        line(e, "t%u = t%u;", result, child);
    }
    line(e, "if (!ANY((t%u != before%u) & (t%u < bound))) break;", result, result, result);
    e->depth--;
    line(e, "}");
    return result;
}

// Of free forms that are equal somewhere, as neighbours with one deformation are, floats find places that differ by a few units of the last place, ray
// by ray another one first: so near they are one place, as far as who decides it is concerned. Quadrics that are equal have equal places.
#define SAME_PLACE "5e-7"

static bool is_freeform_node(const PlanShapeNode *node)
{
    return node->kind == SHAPE_FREEFORM || node->kind == SHAPE_LIFTED;
}

static bool shape_has_freeforms(const PlanShape *shape)
{
    for (uint32_t n = 0; n < shape->node_count; n++)
        if (is_freeform_node(&shape->nodes[n])) return true;
    return false;
}

// Marching loops within each other at the node that stands next, which it moves over.
static uint32_t nested_loops(const Emitter *e, uint32_t *at)
{
    const PlanShapeNode *node = &e->shape->nodes[(*at)++];
    if (is_leaf(node)) return 0;
    uint32_t most = 0;
    for (uint32_t k = 0; k < node->count; k++) {
        uint32_t child = nested_loops(e, at);
        if (child > most) most = child;
    }
    bool least = (node->kind == SHAPE_UNION) != e->leave;
    return most + !least;
}

// Loops in loops take the compiler long: a chain of 64 steps (a - b) | c … took 15 s to build, and takes 2.6 s as one loop; one of 16 steps takes 2.2 s instead of
// 4.3 s, and 9.2 ms a frame of 512 x 512 instead of 8.1 ms. Where there are no more than LOOP_LIMIT, loops in loops are faster: with 8 steps, 4.3 ms instead of 7 ms.
#define LOOP_LIMIT 6

static bool is_deep(const Emitter *e)
{
    uint32_t at = 0;
    return nested_loops(e, &at) > LOOP_LIMIT;
}

#define TREE_UNION     0xfffeu
#define TREE_INTERSECT 0xffffu

static uint32_t after_node(const PlanShape *shape, uint32_t at)
{
    uint32_t count = is_leaf(&shape->nodes[at]) ? 0 : shape->nodes[at].count;
    for (at++; count; count--) at = after_node(shape, at);
    return at;
}

// Values on the stack while the node at `at` is worked out: the child that needs most comes first.
static uint32_t stack_need(const PlanShape *shape, uint32_t at)
{
    const PlanShapeNode *node = &shape->nodes[at++];
    if (is_leaf(node)) return 1;
    uint32_t first = 0, second = 0;
    for (uint32_t k = 0; k < node->count; k++, at = after_node(shape, at)) {
        uint32_t need = stack_need(shape, at);
        if (need > first) {
            second = first;
            first = need;
        } else if (need > second) {
            second = need;
        }
    }
    return first > second ? first : second + 1;
}

// The node as words of a stack machine: leaves by their numbers, and after two operands what joins them.
static void emit_tree(Emitter *e, uint32_t at)
{
    const PlanShapeNode *node = &e->shape->nodes[at];
    if (is_leaf(node)) {
        fprintf(e->out, "%u, ", node->leaf);
        return;
    }
    uint32_t first = at + 1, most = 0, child = at + 1;
    for (uint32_t k = 0; k < node->count; k++, child = after_node(e->shape, child)) {
        uint32_t need = stack_need(e->shape, child);
        if (need > most) first = child;
        if (need > most) most = need;
    }
    emit_tree(e, first);
    child = at + 1;
    for (uint32_t k = 0; k < node->count; k++, child = after_node(e->shape, child)) {
        if (child == first) continue;
        emit_tree(e, child);
        fprintf(e->out, "%uu, ", node->kind == SHAPE_UNION ? TREE_UNION : TREE_INTERSECT);
    }
}

// The words of a deep shape, for both of its functions.
static void emit_deep_tree(Emitter *e, uint32_t index)
{
    fprintf(e->out, "static __constant ushort shape_%u_tree[] = {", index);
    emit_tree(e, 0);
    fprintf(e->out, "};\nstatic __constant uchar shape_%u_quadrics[] = {", index);
    for (uint32_t k = 0; k < e->shape->node_count; k++)
        if (is_leaf(&e->shape->nodes[k])) fputs(e->shape->nodes[k].kind == SHAPE_QUADRIC ? "1, " : "0, ", e->out);
    fputs("};\n\n", e->out);
}

// Variables of the leaves that are not in the arrays, as emit_leaves() has them.
static void emit_other_leaves(Emitter *e)
{
    for (uint32_t k = 0; k < e->shape->node_count; k++) {
        const PlanShapeNode *node = &e->shape->nodes[k];
        if (!is_leaf(node) || node->kind == SHAPE_QUADRIC) continue;
        uint32_t n = node->leaf;
        line(e, "uint leaf%u = leaves[%u];", n, n);
        line(e, "Stretch stretch%u = {INFINITY, -INFINITY};", n);
        if (node->kind == SHAPE_FIELD) continue;
        line(e, "uint begin%u = list_until(ray, begin, stop, leaf%u);", n, n);
        line(e, "uint stop%u = list_until(ray, begin%u, stop, ray->nodes[leaf%u].end);", n, n, n);
        if (node->kind == SHAPE_GROUP) line(e, "UINT decided%u = NO_LEAF;", n);
    }
}

// What they say at t: on which side it is and where that ends, or what rank they have there.
static void emit_other_sides(Emitter *e, bool ranks)
{
    for (uint32_t k = 0; k < e->shape->node_count; k++) {
        const PlanShapeNode *node = &e->shape->nodes[k];
        if (!is_leaf(node) || node->kind == SHAPE_QUADRIC) continue;
        uint32_t n = node->leaf;
        if (ranks && is_freeform_node(node))
            line(e, "if (word == %uu) sides[top] = (t >= stretch%u.begin - close) & (t < stretch%u.end);", n, n, n);
        if (ranks && node->kind == SHAPE_GROUP)
            line(e, "if (word == %uu) rank = t == stretch%u.begin ? decided%u : none;", n, n, n);
        else if (ranks)
            line(e,
                 "if (word == %uu) rank = size_of(t - stretch%u.begin) <= %s ? (UINT)(ray->nodes[leaf%u].rank) : "
                 "none;",
                 n, n, is_freeform_node(node) ? "close" : "0.0f", n);
        if (ranks) continue;
        e->next = k;
        uint32_t place = emit_advance(e, "t");
        line(e, "on[%u] = t%u == t;", n, place);
        line(e, "next = least(next, on[%u] ? stretch%u.end : t%u);", n, n, place);
    }
}

// As emit_state(), with a stack.
static void emit_deep_decided(Emitter *e, uint32_t index, uint32_t depth)
{
    line(e, "UINT none = NO_LEAF, ranks[%u];", depth);
    if (shape_has_freeforms(e->shape)) line(e, "FLOAT close = " SAME_PLACE "f * (1.0f + least(size_of(t), BIG));");
    line(e, "for (uint k = 0, top = 0; k < words; k++) {");
    e->depth++;
    line(e, "uint word = shape_%u_tree[k];", index);
    line(e, "UINT rank = none;");
    line(e, "if (word < TREE_UNION) {");
    e->depth++;
    line(e, "uint leaf = leaves[word];");
    line(e, "if (shape_%u_quadrics[word])", index);
    line(e, "    rank = t == quadric_%s(roots[word], ray->records[leaf].flags) ? (UINT)(ray->nodes[leaf].rank) : none;",
         e->leave ? "exit" : "entry");
    line(e, "sides[top] = on[word];");
    emit_other_sides(e, true);
    line(e, "ranks[top++] = rank;");
    line(e, "continue;");
    e->depth--;
    line(e, "}");
    line(e, "top--;");
    line(e, "INT one = sides[top - 1u], other = sides[top];");
    line(e, "INT within = (one & (ranks[top - 1u] == none)) | (other & (ranks[top] == none));");
    line(e, "rank = ranks[top - 1u] < ranks[top] ? ranks[top - 1u] : ranks[top];");
    line(e, "if (word == TREE_%s) {", e->leave ? "UNION" : "INTERSECT");
    line(e, "    sides[top - 1u] = one & other;");
    line(e, "    ranks[top - 1u] = (one & other) ? rank : none;");
    line(e, "} else {");
    line(e, "    sides[top - 1u] = one | other;");
    line(e, "    ranks[top - 1u] = within ? none : rank;");
    line(e, "}");
    e->depth--;
    line(e, "}");
    line(e, "*decided = ranks[0];");
}

// One loop for a deep tree: at each place all leaves say on which side of them it is and where that ends, and the next place is the nearest of these ends. The tree
// is a table and what is known of quadrics is in arrays, so that the code does not grow with them. `on`: the place is on the wanted side, inside to
// enter and outside to leave.
static void emit_deep_march(Emitter *e, uint32_t index)
{
    uint32_t count = e->shape->leaf_count, depth = stack_need(e->shape, 0);
    const char *all = e->leave ? "UNION" : "INTERSECT";
    line(e, "Roots roots[%u];", count);
    line(e, "INT on[%u], sides[%u];", count, depth);
    line(e, "uint leaves[%u], count = 0;", count);
    line(e, "for (uint leaf = id; leaf < ray->nodes[id].after; leaf = ray->nodes[leaf].end) leaves[count++] = leaf;");
    line(e, "for (uint k = 0; k < count; k++)");
    line(e, "    if (shape_%u_quadrics[k]) roots[k] = record_roots(ray->records + leaves[k], ray->u, ray->v);", index);
    emit_other_leaves(e);
    line(e, "uint words = 2u * count - 1u;");
    line(e, "for (;;) {");
    e->depth++;
    line(e, "FLOAT next = INFINITY;");
    line(e, "for (uint k = 0; k < count; k++) {");
    line(e, "    if (!shape_%u_quadrics[k]) continue;", index);
    line(e, "    uint flags = ray->records[leaves[k]].flags;");
    line(e, "    FLOAT place = quadric_%s(roots[k], flags, t);", direction(e));
    line(e, "    on[k] = place == t;");
    line(e, "    next = least(next, on[k] ? quadric_%s(roots[k], flags, t) : place);", e->leave ? "enter" : "leave");
    line(e, "}");
    emit_other_sides(e, false);
    line(e, "for (uint k = 0, top = 0; k < words; k++) {");
    line(e, "    uint word = shape_%u_tree[k];", index);
    line(e, "    if (word < TREE_UNION) {");
    line(e, "        sides[top++] = on[word];");
    line(e, "        continue;");
    line(e, "    }");
    line(e, "    INT side = sides[--top];");
    line(e, "    sides[top - 1u] = word == TREE_%s ? sides[top - 1u] & side : sides[top - 1u] | side;", all);
    line(e, "}");
    line(e, "INT more = !sides[0] & (t < bound);");
    line(e, "if (!ANY(more)) break;");
    line(e, "t = more ? next : t;");
    e->depth--;
    line(e, "}");
    emit_deep_decided(e, index, depth);
    line(e, "return t < bound ? t : (FLOAT)(INFINITY);");
}

// The rank of a leaf where its boundary is at t; where it is asked for, also whether t is in it.
static void emit_leaf_state(Emitter *e, const PlanShapeNode *node, uint32_t result, const char *t, bool asked)
{
    uint32_t n = node->leaf;
    if (node->kind == SHAPE_QUADRIC)
        line(e, "UINT rank%u = %s == quadric_%s(roots%u, flags%u) ? (UINT)(ray->nodes[leaf%u].rank) : none;", result, t,
             e->leave ? "exit" : "entry", n, n, n);
    else if (is_freeform_node(node))
        line(e, "UINT rank%u = size_of(%s - stretch%u.begin) <= close ? (UINT)(ray->nodes[leaf%u].rank) : none;",
             result, t, n, n);
    else if (node->kind != SHAPE_GROUP)
        line(e, "UINT rank%u = %s == stretch%u.begin ? (UINT)(ray->nodes[leaf%u].rank) : none;", result, t, n, n);
    else
        line(e, "UINT rank%u = %s == stretch%u.begin ? decided%u : none;", result, t, n, n);
    if (!asked) return;
    if (node->kind == SHAPE_QUADRIC)
        line(e, "INT in%u = quadric_%s(roots%u, flags%u, %s) == %s;", result, direction(e), n, n, t, t);
    else if (is_freeform_node(node))
        line(e, "INT in%u = (%s >= stretch%u.begin - close) & (%s < stretch%u.end);", result, t, n, t, n);
    else
        line(e, "INT in%u = (%s >= stretch%u.begin) & (%s < stretch%u.end);", result, t, n, t, n);
}

// What decides at t, where the root is entered (or left). Of children that all have to be entered: those whose boundaries are there. Of children one of
// which suffices: the same, but nothing where t is within another of them, since then the boundary is none of theirs. So a face in the plane of a face, but
// beside it, has no say. `known`: t is in the node, since it is in the root. Returns the number of the variables rank and, where asked for, in.
static uint32_t emit_state(Emitter *e, const char *t, bool root, bool known, bool asked)
{
    const PlanShapeNode *node = &e->shape->nodes[e->next++];
    uint32_t result = e->serial++;
    if (is_leaf(node)) {
        emit_leaf_state(e, node, result, t, asked);
        return result;
    }
    bool all = (node->kind == SHAPE_INTERSECT) != e->leave;
    bool parts = all ? asked || !known : !root; // whether t is in the children matters
    uint32_t *children = calloc(node->count, sizeof *children);
    if (!children) abort();
    for (uint32_t k = 0; k < node->count; k++) children[k] = emit_state(e, t, false, all && known, parts);
    line(e, "UINT rank%u = none;", result);
    for (uint32_t k = 0; k < node->count; k++)
        line(e, "rank%u = rank%u < rank%u ? rank%u : rank%u;", result, children[k], result, children[k], result);
    for (uint32_t k = 0; k < node->count && parts; k++) {
        if (k)
            line(e, "in%u = in%u %c in%u;", result, result, all ? '&' : '|', children[k]);
        else
            line(e, "INT in%u = in%u;", result, children[k]);
    }
    if (all && parts) line(e, "rank%u = in%u ? rank%u : none;", result, result, result);
    for (uint32_t k = 0; k < node->count && parts && !all; k++)
        line(e, "rank%u = (in%u & (rank%u == none)) ? none : rank%u;", result, children[k], children[k], result);
    free(children);
    return result;
}

// The leaf that decides where the ray is at t; of several the lowest rank.
static void emit_decided(Emitter *e, const char *t)
{
    line(e, "UINT none = NO_LEAF;");
    if (shape_has_freeforms(e->shape)) line(e, "FLOAT close = " SAME_PLACE "f * (1.0f + least(size_of(%s), BIG));", t);
    e->next = 0;
    line(e, "*decided = rank%u;", emit_state(e, t, true, true, false));
}

// Whether the function is the marching through quadrics alone: the intersection of quadrics, entered, or their union, left.
static bool is_flat_march(const Emitter *e)
{
    const PlanShapeNode *root = &e->shape->nodes[0];
    if (root->kind != (e->leave ? SHAPE_UNION : SHAPE_INTERSECT)) return false;
    for (uint32_t k = 1; k < e->shape->node_count; k++)
        if (e->shape->nodes[k].kind != SHAPE_QUADRIC) return false;
    return true;
}

// The stretches of quadrics that are one between two roots meet in one stretch [near, far); those that are two, with a gap between the
// roots, are solved only if that one is not empty, and marched through.
static void emit_flat_march(Emitter *e)
{
    const char *gap = e->leave ? "!(flags%u & RECORD_OUTSIDE)" : "flags%u & RECORD_OUTSIDE";
    const char *whole = e->leave ? "flags%u & RECORD_OUTSIDE" : "!(flags%u & RECORD_OUTSIDE)";
    uint32_t count = e->shape->leaf_count;
    char test[64];
    line(e, "FLOAT far = INFINITY;");
    for (uint32_t k = 0; k < count; k++) {
        line(e, "uint leaf%u = id + %uu;", k, k);
        line(e, "uint flags%u = ray->records[leaf%u].flags;", k, k);
        line(e, "Roots roots%u;", k);
        snprintf(test, sizeof test, whole, k);
        line(e, "if (%s) {", test);
        line(e, "    roots%u = record_roots(ray->records + leaf%u, ray->u, ray->v);", k, k);
        line(e, "    t = most(t, roots%u.r0);", k);
        line(e, "    far = least(far, roots%u.r1);", k);
        line(e, "}");
    }
    line(e, "*decided = NO_LEAF;");
    line(e, "if (!ANY((t < far) & (t < bound))) return INFINITY;");
    for (uint32_t k = 0; k < count; k++) {
        snprintf(test, sizeof test, gap, k);
        line(e, "if (%s) roots%u = record_roots(ray->records + leaf%u, ray->u, ray->v);", test, k, k);
    }
    line(e, "for (;;) {");
    e->depth++;
    line(e, "FLOAT before = t;");
    for (uint32_t k = 0; k < count; k++) {
        snprintf(test, sizeof test, gap, k);
        line(e, "if (%s) t = roots_beyond(roots%u, t);", test, k);
    }
    line(e, "if (!ANY((t != before) & (t < far) & (t < bound))) break;");
    e->depth--;
    line(e, "}");
    line(e, "t = t < far ? t : (FLOAT)(INFINITY);");
}

// A shape that is one free form: what is seen of it is found by a long function that is worth inlining (kernels/packet.cl), and where it ends is rarely asked.
static bool is_freeform(const PlanShape *shape)
{
    return shape->node_count == 1 && shape->nodes[0].kind == SHAPE_FREEFORM;
}

static const char *linkage(bool freeform, bool leave)
{
    return !freeform ? "static" : leave ? "static NOINLINE" : "INLINE";
}

// The functions of shapes of several leaves are long, and called for eyes and for shadows. One copy of each takes two thirds of the time to build (S4:
// 2.4 s instead of 3.5 s on a busy machine) for frames that are 1.5 % longer; called by places as kernels/freeform.cl says, else it would be 5 %.
static bool is_called(const PlanShape *shape)
{
    return shape->leaf_count > 1;
}

// Unions of quadrics alone are found without a bound.
static bool uses_bound(const Emitter *e)
{
    for (uint32_t k = 0; k < e->shape->node_count; k++) {
        ShapeNodeKind kind = (ShapeNodeKind)e->shape->nodes[k].kind;
        if (kind != SHAPE_QUADRIC && kind != (e->leave ? SHAPE_INTERSECT : SHAPE_UNION)) return true;
    }
    return false;
}

static void emit_shape_function(Emitter *e, uint32_t index, bool leave)
{
    e->shape = &e->plan->shapes[index];
    e->leave = leave;
    e->next = e->serial = 0;
    bool called = is_called(e->shape);
    line(e, "%s FLOAT shape_%u_%s(const Ray *ray, uint id, uint begin, uint stop, %s, UINT *decided)",
         called ? "static NOINLINE" : linkage(is_freeform(e->shape), leave), index, direction(e),
         called ? "const FLOAT *from, const FLOAT *to" : "FLOAT t, FLOAT bound");
    line(e, "{");
    e->depth++;
    if (called) line(e, uses_bound(e) ? "FLOAT t = *from, bound = *to;" : "FLOAT t = *from;");
    const PlanShapeNode *root = &e->shape->nodes[0];
    if (e->shape->leaf_count == 1 && root->kind != SHAPE_GROUP) {
        line(e, "*decided = ray->nodes[id].rank;");
        if (root->kind == SHAPE_QUADRIC)
            line(e, "return quadric_%s(record_roots(ray->records + id, ray->u, ray->v), ray->records[id].flags, t);",
                 direction(e));
        else if (root->kind == SHAPE_FIELD)
            line(e, "return field_next(ray, id, t, bound, %s, t != t, ray->shadow);", leave ? "-1.0f" : "1.0f");
        else if (root->kind == SHAPE_LIFTED)
            line(e, leave ? "return lifted_next(ray, id, begin, stop, t, bound, -1.0f, t != t);"
                          : "return lifted_first(ray, id, begin, stop, t, bound);");
        else if (root->kind == SHAPE_SHEET)
            line(e, leave ? "return t;" : "return sheet_next(ray, begin, stop, t, bound);");
        else if (root->kind == SHAPE_THICK)
            line(e, "return thick_next(ray, id, begin, stop, t, bound, %s, t != t, ray->shadow);",
                 leave ? "-1.0f" : "1.0f");
        else if (leave)
            line(e, "return freeform_next(ray, id, begin, stop, t, bound, -1.0f, t != t);");
        else
            line(e, "return freeform_first(ray, id, begin, stop, t, bound);");
    } else if (is_flat_march(e)) {
        emit_flat_march(e);
        emit_decided(e, "t");
        line(e, "return t;");
    } else if (is_deep(e)) {
        emit_deep_march(e, index);
    } else {
        char t[16];
        emit_leaves(e);
        snprintf(t, sizeof t, "t%u", emit_advance(e, "t"));
        emit_decided(e, t);
        line(e, "return %s;", t);
    }
    e->depth--;
    line(e, "}\n");
}

static void emit_shape(Emitter *e, uint32_t index)
{
    e->shape = &e->plan->shapes[index];
    e->next = 0;
    fprintf(e->out, "// Shape %u: ", index);
    describe(e);
    fputs(".\n", e->out);
    e->leave = false;
    bool deep = is_deep(e);
    e->leave = true;
    if (deep || is_deep(e)) emit_deep_tree(e, index);
    emit_shape_function(e, index, false);
    emit_shape_function(e, index, true);
}

// The call for one component of a list, by its shape. What a called function can reach stays in memory, so it gets copies.
static void emit_call(Emitter *e, uint32_t shape)
{
    if (is_called(&e->plan->shapes[shape])) {
        line(e, "FLOAT from = t, to = bound;");
        line(e, "UINT leaf;");
        line(e, "place = shape_%u_%s(ray, id, first, at, &from, &to, &leaf);", shape, direction(e));
        line(e, "which = leaf;");
    } else {
        line(e, "place = shape_%u_%s(ray, id, first, at, t, bound, &which);", shape, direction(e));
    }
}

static void emit_dispatch(Emitter *e, const PlanGroupType *type)
{
    line(e, "FLOAT place;");
    if (type->shape_count == 1) {
        line(e, "{");
        e->depth++;
        emit_call(e, type->shapes[0]);
        e->depth--;
        line(e, "}");
        return;
    }
    line(e, "switch (ray->nodes[id].shape) {");
    for (uint32_t k = 0; k < type->shape_count; k++) {
        if (k + 1 < type->shape_count)
            line(e, "case %u: {", type->shapes[k]);
        else
            line(e, "default: {");
        e->depth++;
        emit_call(e, type->shapes[k]);
        line(e, "break;");
        e->depth--;
        line(e, "}");
    }
    line(e, "}");
}

// The head of the loop over the components in ray->list[begin .. stop).
static void emit_component_loop(Emitter *e, const PlanGroupType *type)
{
    bool contents = false;
    for (uint32_t k = 0; k < type->shape_count; k++) contents |= has_contents(&e->plan->shapes[type->shapes[k]]);
    line(e, "for (uint at = begin; at < stop;) {");
    e->depth++;
    line(e, "uint id = ray->list[at++];");
    line(e, "uint first = at;");
    if (contents) line(e, "at = list_until(ray, at, stop, ray->nodes[id].after);");
    line(e, "UINT which;");
}

static bool has_freeforms(const Plan *plan, const PlanGroupType *type)
{
    for (uint32_t k = 0; k < type->shape_count; k++)
        if (shape_has_freeforms(&plan->shapes[type->shapes[k]])) return true;
    return false;
}

static void emit_group_function(Emitter *e, uint32_t index, bool leave)
{
    const PlanGroupType *type = &e->plan->group_types[index];
    e->leave = leave;
    bool freeforms = type->shape_count == 1 && is_freeform(&e->plan->shapes[type->shapes[0]]);
    line(e, "%s FLOAT group_%u_%s(const Ray *ray, uint begin, uint stop, FLOAT t, FLOAT bound, UINT *decided)",
         linkage(freeforms, leave), index, direction(e));
    line(e, "{");
    e->depth++;
    line(e, "*decided = NO_LEAF;");
    bool least = (type->set == SET_UNION) != leave;
    if (least) {
        line(e, "FLOAT nearest = INFINITY;");
        if (type->shape_count) {
            emit_component_loop(e, type);
            emit_dispatch(e, type);
            if (has_freeforms(e->plan, type)) {
                line(e, "INT tied = size_of(place - nearest) <= " SAME_PLACE
                        "f * (1.0f + least(size_of(place), size_of(nearest)));");
                line(e, "INT sooner = (place < nearest) & !(tied & (*decided < which));");
                line(e, "*decided = (sooner | (tied & (which < *decided))) ? which : *decided;");
            } else {
                line(e, "*decided = ((place < nearest) | ((place == nearest) & (which < *decided))) ? which : "
                        "*decided;");
            }
            line(e, "nearest = least(nearest, place);");
            line(e, "if (ray->shadow) {");
            line(e, "    bound = nearest < bound ? (FLOAT)(-INFINITY) : bound;");
            line(e, "    if (!ANY(bound > -INFINITY)) break;");
            line(e, "} else {");
            line(e, "    bound = least(bound, nearest + 1e-6f * (1.0f + size_of(nearest)));");
            line(e, "}");
            e->depth--;
            line(e, "}");
        }
        line(e, "return nearest;");
    } else if (!type->shape_count) {
        line(e, "return t;");
    } else {
        line(e, "for (;;) {");
        e->depth++;
        line(e, "FLOAT before = t;");
        emit_component_loop(e, type);
        emit_dispatch(e, type);
        line(e, "*decided = place > t ? which : *decided;");
        line(e, "t = most(t, place);");
        e->depth--;
        line(e, "}");
        line(e, "if (!ANY((t != before) & (t < bound))) return t;");
        e->depth--;
        line(e, "}");
    }
    e->depth--;
    line(e, "}\n");
}

// For groups that are leaves: keeps the stretch found last. What is around it asks where exactly the stretch begins and ends, also where the scene
// is only asked whether there is anything in the way. A stretch that is under way at t began before: -infinity, so no leaf decides there.
static void emit_group_advance(Emitter *e, uint32_t index, bool leave)
{
    e->leave = leave;
    const char *other = leave ? "enter" : "leave";
    line(e,
         "static FLOAT group_%u_%s_advance(const Ray *ray, uint begin, uint stop, Stretch *stretch, UINT *decided, "
         "FLOAT t, FLOAT bound)",
         index, direction(e));
    line(e, "{");
    e->depth++;
    line(e, "INT stale = (t >= stretch->end) & (t < bound);");
    line(e, "if (ANY(stale)) {");
    e->depth++;
    line(e, "FLOAT limit = stale ? bound : (FLOAT)(-INFINITY);");
    line(e, "UINT which, unused;");
    line(e, "Ray exact = *ray;");
    line(e, "exact.shadow = 0;");
    line(e, "FLOAT entry = group_%u_%s(&exact, begin, stop, t, limit, &which);", index, direction(e));
    line(e, "FLOAT end = group_%u_%s(&exact, begin, stop, entry, limit, &unused);", index, other);
    line(e, "INT met = (entry > t) | (which != NO_LEAF);");
    line(e, "FLOAT first = met ? entry : (FLOAT)(-INFINITY);");
    line(e, "stretch->begin = stale ? first : stretch->begin;");
    line(e, "stretch->end = stale ? end : stretch->end;");
    line(e, "*decided = stale ? which : *decided;");
    e->depth--;
    line(e, "}");
    line(e, "return most(t, stretch->begin);");
    e->depth--;
    line(e, "}\n");
}

static bool group_is_leaf(const Plan *plan, uint32_t type)
{
    for (uint32_t k = 0; k < plan->shape_count; k++)
        for (uint32_t n = 0; n < plan->shapes[k].node_count; n++)
            if (plan->shapes[k].nodes[n].kind == SHAPE_GROUP && plan->shapes[k].nodes[n].count == type) return true;
    return false;
}

// Shapes and group types refer to each other; group types are numbered bottom-up, and a shape stands before the first group type that uses it.
static void emit_structure(Emitter *e)
{
    const Plan *plan = e->plan;
    bool *written = calloc(plan->shape_count + 1, sizeof *written);
    if (!written) abort();
    for (uint32_t k = 0; k < plan->group_type_count; k++) {
        const PlanGroupType *type = &plan->group_types[k];
        for (uint32_t n = 0; n < type->shape_count; n++) {
            if (!written[type->shapes[n]]) emit_shape(e, type->shapes[n]);
            written[type->shapes[n]] = true;
        }
        fprintf(e->out, "// Group type %u: %s.\n", k, type->set == SET_UNION ? "union" : "intersection");
        emit_group_function(e, k, false);
        emit_group_function(e, k, true);
        if (!group_is_leaf(plan, k)) continue;
        emit_group_advance(e, k, false);
        emit_group_advance(e, k, true);
    }
    free(written);

    // Where a ray that begins inside leaves is rarely asked: one copy, out of the way of what every ray runs (0.3 s of the 2.8 s that S4 takes to build).
    uint32_t top = plan->groups[0].type;
    for (int leave = 0; leave < 2; leave++) {
        e->leave = leave;
        line(e, "%s FLOAT scene_%s(const Ray *ray, FLOAT t, FLOAT bound, UINT *decided)",
             leave ? "static NOINLINE" : "INLINE", direction(e));
        line(e, "{");
        line(e, "    return group_%u_%s(ray, 0, ray->count, t, bound, decided);", top, direction(e));
        line(e, "}\n");
    }
}

static void emit_file(Emitter *e, const char *name)
{
    for (const kernel_source_file *file = kernel_source_files; file->name; file++) {
        if (strcmp(file->name, name)) continue;
        fwrite(file->text, 1, file->length, e->out);
        fputc('\n', e->out);
        return;
    }
    assert(!"the kernel file is embedded");
}

const char *emit_kernel(Arena *arena, const Plan *plan, size_t *length)
{
    char *text = NULL;
    size_t size = 0;
    Emitter e = {.out = open_memstream(&text, &size), .plan = plan};
    if (!e.out) abort();
    bool lifted = plan_has(plan, SHAPE_LIFTED), sheet = plan_has(plan, SHAPE_SHEET);
    bool thick = plan_has(plan, SHAPE_THICK);
    bool freeform = lifted || plan_has(plan, SHAPE_FREEFORM);
    bool field = plan_has(plan, SHAPE_FIELD), shininess = false;
    for (uint32_t k = 0; k < plan->material_count; k++) shininess |= plan->materials[k].integer_shininess >= 0;

    fputs("// Made by scn from the structure of a scene.\n", e.out);
    if (freeform) fputs("#define HAS_FREEFORM\n", e.out);
    if (field) fputs("#define HAS_FIELD\n", e.out);
    if (lifted) fputs("#define HAS_LIFTED\n", e.out);
    if (sheet) fputs("#define HAS_SHEET\n", e.out);
    if (thick) fputs("#define HAS_THICK\n", e.out);
    if (plan->copy_count) // numbers of copies are doubles; a device without these has copies as it has any perturbations
        fputs("#ifdef cl_khr_fp64\n#pragma OPENCL EXTENSION cl_khr_fp64 : enable\n#define HAS_COPIES\n#endif\n", e.out);
    if (shininess) fputs("#define INTEGER_SHININESS\n", e.out);
    emit_file(&e, "shared.h");
    if (field) emit_file(&e, "tape_shared.h");
    emit_file(&e, "packet.cl");
    emit_file(&e, "record.cl");
    if (freeform) {
        emit_file(&e, "roots.cl");
        emit_file(&e, "freeform.cl");
    }
    if (plan->copy_count) {
        fputs("#ifdef HAS_COPIES\n", e.out);
        emit_file(&e, "copies.cl");
        fputs("#endif\n", e.out);
    }
    if (field) { // fields look at a tile's list before its packets do
        emit_file(&e, "cull.cl");
        emit_file(&e, "noise.cl");
        emit_file(&e, "tape.cl");
        emit_file(&e, "strip.cl");
        emit_file(&e, "cells.cl");
        emit_file(&e, "field.cl");
    }
    if (lifted) emit_file(&e, "lifted.cl");
    if (sheet) emit_file(&e, "sheet.cl");
    if (thick) emit_file(&e, "thick.cl");
    emit_structure(&e);
    if (!field) emit_file(&e, "cull.cl");
    emit_file(&e, "shade.cl");
    emit_file(&e, "tile.cl");
    emit_file(&e, "film.cl");
    if (fclose(e.out)) abort();
    char *copy = arena_text(arena, text, size);
    free(text);
    *length = size;
    return copy;
}

const char *emit_options(int width)
{
    assert(width == 1 || width == 16);
    return width == 1 ? "-cl-std=CL1.2 -D WIDTH=1" : "-cl-std=CL1.2 -D WIDTH=16 -D PACKETS_SIDE_BY_SIDE=2";
}
