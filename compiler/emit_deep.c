// Deep trees of sets: one loop over all leaves, and the tree as a table of words.
//
// The loops in loops of emit_shape.c are the faster code while there are few, and take the OpenCL compiler the longer to build the deeper they lie. Here
// the tree is written twice as data: the words of a stack machine in postfix order (a leaf by its number, TREE_UNION or TREE_INTERSECT for what joins the
// two values before it), and which leaves are quadrics. At each place all leaves say on which side of them it is; the words join these to the side of the root.
#include "compiler/emit_shape.h"

// Marching loops within each other at the node that stands next, which it moves over.
static uint32_t nested_loops(const Emitter *e, uint32_t *at)
{
    const PlanShapeNode *node = &e->shape->nodes[(*at)++];
    if (shape_is_leaf(node)) return 0;
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

bool emit_is_deep(const Emitter *e)
{
    uint32_t at = 0;
    return nested_loops(e, &at) > LOOP_LIMIT;
}

// As kernels/record.cl has them.
#define TREE_UNION     0xfffeu
#define TREE_INTERSECT 0xffffu

static uint32_t after_node(const PlanShape *shape, uint32_t at)
{
    uint32_t count = shape_is_leaf(&shape->nodes[at]) ? 0 : shape->nodes[at].count;
    for (at++; count; count--) at = after_node(shape, at);
    return at;
}

// Values on the stack while the node at `at` is worked out: the child that needs most comes first.
static uint32_t stack_need(const PlanShape *shape, uint32_t at)
{
    const PlanShapeNode *node = &shape->nodes[at++];
    if (shape_is_leaf(node)) return 1;
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
    if (shape_is_leaf(node)) {
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
void emit_deep_tree(Emitter *e, uint32_t index)
{
    fprintf(e->out, "static __constant ushort shape_%u_tree[] = {", index);
    emit_tree(e, 0);
    fprintf(e->out, "};\nstatic __constant uchar shape_%u_quadrics[] = {", index);
    for (uint32_t k = 0; k < e->shape->node_count; k++)
        if (shape_is_leaf(&e->shape->nodes[k])) fputs(e->shape->nodes[k].kind == SHAPE_QUADRIC ? "1, " : "0, ", e->out);
    fputs("};\n\n", e->out);
}

// Variables of the leaves that are not in the arrays, as emit_leaves() of emit_shape.c has them.
static void emit_other_leaves(Emitter *e)
{
    for (uint32_t k = 0; k < e->shape->node_count; k++) {
        const PlanShapeNode *node = &e->shape->nodes[k];
        if (!shape_is_leaf(node) || node->kind == SHAPE_QUADRIC) continue;
        uint32_t n = node->leaf;
        emit(e, "uint leaf%u = leaves[%u];", n, n);
        emit(e, "Stretch stretch%u = {INFINITY, -INFINITY};", n);
        if (node->kind == SHAPE_FIELD) continue;
        emit(e, "uint begin%u = list_until(ray, begin, stop, leaf%u);", n, n);
        emit(e, "uint stop%u = list_until(ray, begin%u, stop, ray->nodes[leaf%u].end);", n, n, n);
        if (node->kind == SHAPE_GROUP) emit(e, "UINT decided%u = NO_LEAF;", n);
    }
}

// What they say at t: on which side it is and where that ends, or what rank they have there.
static void emit_other_sides(Emitter *e, bool ranks)
{
    for (uint32_t k = 0; k < e->shape->node_count; k++) {
        const PlanShapeNode *node = &e->shape->nodes[k];
        if (!shape_is_leaf(node) || node->kind == SHAPE_QUADRIC) continue;
        uint32_t n = node->leaf;
        if (ranks && shape_is_freeform_node(node))
            emit(e, "if (word == %uu) sides[top] = (t >= stretch%u.begin - close) & (t < stretch%u.end);", n, n, n);
        if (ranks && node->kind == SHAPE_GROUP)
            emit(e, "if (word == %uu) rank = t == stretch%u.begin ? decided%u : none;", n, n, n);
        else if (ranks)
            emit(e,
                 "if (word == %uu) rank = size_of(t - stretch%u.begin) <= %s ? (UINT)(ray->nodes[leaf%u].rank) : "
                 "none;",
                 n, n, shape_is_freeform_node(node) ? "close" : "0.0f", n);
        if (ranks) continue;
        e->next = k;
        uint32_t place = emit_advance(e, "t");
        emit(e, "on[%u] = t%u == t;", n, place);
        emit(e, "next = least(next, on[%u] ? stretch%u.end : t%u);", n, n, place);
    }
}

// What decides, as emit_state() of emit_shape.c, with a stack.
static void emit_deep_decided(Emitter *e, uint32_t index, uint32_t depth)
{
    emit(e, "UINT none = NO_LEAF, ranks[%u];", depth);
    if (shape_has_freeforms(e->shape)) emit(e, "FLOAT close = " SAME_PLACE "f * (1.0f + least(size_of(t), BIG));");
    emit(e, "for (uint k = 0, top = 0; k < words; k++) {");
    e->depth++;
    emit(e, "uint word = shape_%u_tree[k];", index);
    emit(e, "UINT rank = none;");
    emit(e, "if (word < TREE_UNION) {");
    e->depth++;
    emit(e, "uint leaf = leaves[word];");
    emit(e, "if (shape_%u_quadrics[word])", index);
    emit(e, "    rank = t == quadric_%s(roots[word], ray->records[leaf].flags) ? (UINT)(ray->nodes[leaf].rank) : none;",
         e->leave ? "exit" : "entry");
    emit(e, "sides[top] = on[word];");
    emit_other_sides(e, true);
    emit(e, "ranks[top++] = rank;");
    emit(e, "continue;");
    e->depth--;
    emit(e, "}");
    emit(e, "top--;");
    emit(e, "INT one = sides[top - 1u], other = sides[top];");
    emit(e, "INT within = (one & (ranks[top - 1u] == none)) | (other & (ranks[top] == none));");
    emit(e, "rank = ranks[top - 1u] < ranks[top] ? ranks[top - 1u] : ranks[top];");
    emit(e, "if (word == TREE_%s) {", e->leave ? "UNION" : "INTERSECT");
    emit(e, "    sides[top - 1u] = one & other;");
    emit(e, "    ranks[top - 1u] = (one & other) ? rank : none;");
    emit(e, "} else {");
    emit(e, "    sides[top - 1u] = one | other;");
    emit(e, "    ranks[top - 1u] = within ? none : rank;");
    emit(e, "}");
    e->depth--;
    emit(e, "}");
    emit(e, "*decided = ranks[0];");
}

// One loop for a deep tree: at each place all leaves say on which side of them it is and where that ends, and the next place is the nearest of these ends. The tree
// is a table and what is known of quadrics is in arrays, so that the code does not grow with them. `on`: the place is on the wanted side, inside to
// enter and outside to leave.
void emit_deep_march(Emitter *e, uint32_t index)
{
    uint32_t count = e->shape->leaf_count, depth = stack_need(e->shape, 0);
    const char *all = e->leave ? "UNION" : "INTERSECT";
    emit(e, "Roots roots[%u];", count);
    emit(e, "INT on[%u], sides[%u];", count, depth);
    emit(e, "uint leaves[%u], count = 0;", count);
    emit(e, "for (uint leaf = id; leaf < ray->nodes[id].after; leaf = ray->nodes[leaf].end) leaves[count++] = leaf;");
    emit(e, "for (uint k = 0; k < count; k++)");
    emit(e, "    if (shape_%u_quadrics[k]) roots[k] = record_roots(ray->records + leaves[k], ray->u, ray->v);", index);
    emit_other_leaves(e);
    emit(e, "uint words = 2u * count - 1u;");
    emit(e, "for (;;) {");
    e->depth++;
    emit(e, "FLOAT next = INFINITY;");
    emit(e, "for (uint k = 0; k < count; k++) {");
    emit(e, "    if (!shape_%u_quadrics[k]) continue;", index);
    emit(e, "    uint flags = ray->records[leaves[k]].flags;");
    emit(e, "    FLOAT place = quadric_%s(roots[k], flags, t);", emit_direction(e));
    emit(e, "    on[k] = place == t;");
    emit(e, "    next = least(next, on[k] ? quadric_%s(roots[k], flags, t) : place);", e->leave ? "enter" : "leave");
    emit(e, "}");
    emit_other_sides(e, false);
    emit(e, "for (uint k = 0, top = 0; k < words; k++) {");
    emit(e, "    uint word = shape_%u_tree[k];", index);
    emit(e, "    if (word < TREE_UNION) {");
    emit(e, "        sides[top++] = on[word];");
    emit(e, "        continue;");
    emit(e, "    }");
    emit(e, "    INT side = sides[--top];");
    emit(e, "    sides[top - 1u] = word == TREE_%s ? sides[top - 1u] & side : sides[top - 1u] | side;", all);
    emit(e, "}");
    emit(e, "INT more = !sides[0] & (t < bound);");
    emit(e, "if (!ANY(more)) break;");
    emit(e, "t = more ? next : t;");
    e->depth--;
    emit(e, "}");
    emit_deep_decided(e, index, depth);
    emit(e, "return t < bound ? t : (FLOAT)(INFINITY);");
}
