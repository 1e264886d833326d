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
// leaves instead, and the tree a table (emit_deep.c).
#include "compiler/emit_shape.h"

#include <stdarg.h>
#include <stdlib.h>

void emit(Emitter *e, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    for (int k = 0; k < e->depth; k++) fputs("    ", e->out);
    vfprintf(e->out, format, args);
    fputc('\n', e->out);
    va_end(args);
}

const char *emit_direction(const Emitter *e)
{
    return e->leave ? "leave" : "enter";
}

bool shape_is_leaf(const PlanShapeNode *node)
{
    return node->kind >= SHAPE_QUADRIC;
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
        if (!shape_is_leaf(node)) continue;
        uint32_t n = node->leaf;
        bool asked = many || node->kind != SHAPE_GROUP; // a group alone has no use for its number
        if (!last && asked)
            emit(e, "uint leaf%u = id;", n);
        else if (last && (last->kind == SHAPE_QUADRIC || last->kind == SHAPE_FIELD))
            emit(e, "uint leaf%u = leaf%u + 1u;", n, last->leaf);
        else if (last)
            emit(e, "uint leaf%u = ray->nodes[leaf%u].end;", n, last->leaf);
        if (node->kind == SHAPE_QUADRIC) {
            emit(e, "uint flags%u = ray->records[leaf%u].flags;", n, n);
            emit(e, "Roots roots%u = record_roots(ray->records + leaf%u, ray->u, ray->v);", n, n);
        } else if (node->kind == SHAPE_FIELD) {
            emit(e, "Stretch stretch%u = {INFINITY, -INFINITY};", n);
        } else {
            if (before)
                emit(e, "uint begin%u = list_until(ray, begin, stop, leaf%u);", n, n);
            else
                emit(e, "uint begin%u = begin;", n);
            if (many)
                emit(e, "uint stop%u = list_until(ray, begin%u, stop, ray->nodes[leaf%u].end);", n, n, n);
            else
                emit(e, "uint stop%u = stop;", n);
            emit(e, "Stretch stretch%u = {INFINITY, -INFINITY};", n);
            if (node->kind == SHAPE_GROUP) emit(e, "UINT decided%u = NO_LEAF;", n);
            before = true;
        }
        last = node;
    }
}

uint32_t emit_advance(Emitter *e, const char *from)
{
    const PlanShapeNode *node = &e->shape->nodes[e->next++];
    uint32_t result = e->serial++;
    uint32_t n = node->leaf;
    const char *sign = e->leave ? "-1.0f" : "1.0f";
    switch ((ShapeNodeKind)node->kind) {
    case SHAPE_QUADRIC:
        emit(e, "FLOAT t%u = quadric_%s(roots%u, flags%u, %s);", result, emit_direction(e), n, n, from);
        return result;
    case SHAPE_FREEFORM:
        emit(e, "FLOAT t%u = freeform_advance(ray, leaf%u, begin%u, stop%u, &stretch%u, %s, bound, %s);", result, n, n,
             n, n, from, sign);
        return result;
    case SHAPE_FIELD:
        emit(e, "FLOAT t%u = field_advance(ray, leaf%u, &stretch%u, %s, bound, %s);", result, n, n, from, sign);
        return result;
    case SHAPE_LIFTED:
        emit(e, "FLOAT t%u = lifted_advance(ray, leaf%u, begin%u, stop%u, &stretch%u, %s, bound, %s);", result, n, n, n,
             n, from, sign);
        return result;
    case SHAPE_SHEET:
        emit(e, "FLOAT t%u = sheet_%s(ray, leaf%u, begin%u, stop%u, &stretch%u, %s, bound);", result, emit_direction(e),
             n, n, n, n, from);
        return result;
    case SHAPE_THICK:
        emit(e, "FLOAT t%u = thick_advance(ray, leaf%u, begin%u, stop%u, &stretch%u, %s, bound, %s);", result, n, n, n,
             n, from, sign);
        return result;
    case SHAPE_GROUP:
        emit(e, "FLOAT t%u = group_%u_%s_advance(ray, begin%u, stop%u, &stretch%u, &decided%u, %s, bound);", result,
             node->count, emit_direction(e), n, n, n, n, from);
        return result;
    default: break;
    }
    bool least = (node->kind == SHAPE_UNION) != e->leave;
    if (least) {
        emit(e, "FLOAT t%u = INFINITY;", result);
        for (uint32_t k = 0; k < node->count; k++) {
            uint32_t child = emit_advance(e, from);
            emit(e, "t%u = least(t%u, t%u);", result, result, child);
        }
        return result;
    }
    emit(e, "FLOAT t%u = %s;", result, from);
    char self[16];
    snprintf(self, sizeof self, "t%u", result);
    emit(e, "for (;;) {");
    e->depth++;
    emit(e, "FLOAT before%u = t%u;", result, result);
    for (uint32_t k = 0; k < node->count; k++) {
        uint32_t child = emit_advance(e, self);
        emit(e, "t%u = t%u;", result, child);
    }
    emit(e, "if (!ANY((t%u != before%u) & (t%u < bound))) break;", result, result, result);
    e->depth--;
    emit(e, "}");
    return result;
}

bool shape_is_freeform_node(const PlanShapeNode *node)
{
    return node->kind == SHAPE_FREEFORM || node->kind == SHAPE_LIFTED;
}

bool shape_has_freeforms(const PlanShape *shape)
{
    for (uint32_t n = 0; n < shape->node_count; n++)
        if (shape_is_freeform_node(&shape->nodes[n])) return true;
    return false;
}

// The rank of a leaf where its boundary is at t; where it is asked for, also whether t is in it.
static void emit_leaf_state(Emitter *e, const PlanShapeNode *node, uint32_t result, const char *t, bool asked)
{
    uint32_t n = node->leaf;
    if (node->kind == SHAPE_QUADRIC)
        emit(e, "UINT rank%u = %s == quadric_%s(roots%u, flags%u) ? (UINT)(ray->nodes[leaf%u].rank) : none;", result, t,
             e->leave ? "exit" : "entry", n, n, n);
    else if (shape_is_freeform_node(node))
        emit(e, "UINT rank%u = size_of(%s - stretch%u.begin) <= close ? (UINT)(ray->nodes[leaf%u].rank) : none;",
             result, t, n, n);
    else if (node->kind != SHAPE_GROUP)
        emit(e, "UINT rank%u = %s == stretch%u.begin ? (UINT)(ray->nodes[leaf%u].rank) : none;", result, t, n, n);
    else
        emit(e, "UINT rank%u = %s == stretch%u.begin ? decided%u : none;", result, t, n, n);
    if (!asked) return;
    if (node->kind == SHAPE_QUADRIC)
        emit(e, "INT in%u = quadric_%s(roots%u, flags%u, %s) == %s;", result, emit_direction(e), n, n, t, t);
    else if (shape_is_freeform_node(node))
        emit(e, "INT in%u = (%s >= stretch%u.begin - close) & (%s < stretch%u.end);", result, t, n, t, n);
    else
        emit(e, "INT in%u = (%s >= stretch%u.begin) & (%s < stretch%u.end);", result, t, n, t, n);
}

// What decides at t, where the root is entered (or left). Of children that all have to be entered: those whose boundaries are there. Of children one of
// which suffices: the same, but nothing where t is within another of them, since then the boundary is none of theirs. So a face in the plane of a face, but
// beside it, has no say. `known`: t is in the node, since it is in the root. Returns the number of the variables rank and, where asked for, in.
static uint32_t emit_state(Emitter *e, const char *t, bool root, bool known, bool asked)
{
    const PlanShapeNode *node = &e->shape->nodes[e->next++];
    uint32_t result = e->serial++;
    if (shape_is_leaf(node)) {
        emit_leaf_state(e, node, result, t, asked);
        return result;
    }
    bool all = (node->kind == SHAPE_INTERSECT) != e->leave;
    bool parts = all ? asked || !known : !root; // whether t is in the children matters
    uint32_t *children = calloc(node->count, sizeof *children);
    if (!children) abort();
    for (uint32_t k = 0; k < node->count; k++) children[k] = emit_state(e, t, false, all && known, parts);
    emit(e, "UINT rank%u = none;", result);
    for (uint32_t k = 0; k < node->count; k++)
        emit(e, "rank%u = rank%u < rank%u ? rank%u : rank%u;", result, children[k], result, children[k], result);
    for (uint32_t k = 0; k < node->count && parts; k++) {
        if (k)
            emit(e, "in%u = in%u %c in%u;", result, result, all ? '&' : '|', children[k]);
        else
            emit(e, "INT in%u = in%u;", result, children[k]);
    }
    if (all && parts) emit(e, "rank%u = in%u ? rank%u : none;", result, result, result);
    for (uint32_t k = 0; k < node->count && parts && !all; k++)
        emit(e, "rank%u = (in%u & (rank%u == none)) ? none : rank%u;", result, children[k], children[k], result);
    free(children);
    return result;
}

// The leaf that decides where the ray is at t; of several the lowest rank.
static void emit_decided(Emitter *e, const char *t)
{
    emit(e, "UINT none = NO_LEAF;");
    if (shape_has_freeforms(e->shape)) emit(e, "FLOAT close = " SAME_PLACE "f * (1.0f + least(size_of(%s), BIG));", t);
    e->next = 0;
    emit(e, "*decided = rank%u;", emit_state(e, t, true, true, false));
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
    emit(e, "FLOAT far = INFINITY;");
    for (uint32_t k = 0; k < count; k++) {
        emit(e, "uint leaf%u = id + %uu;", k, k);
        emit(e, "uint flags%u = ray->records[leaf%u].flags;", k, k);
        emit(e, "Roots roots%u;", k);
        snprintf(test, sizeof test, whole, k);
        emit(e, "if (%s) {", test);
        emit(e, "    roots%u = record_roots(ray->records + leaf%u, ray->u, ray->v);", k, k);
        emit(e, "    t = most(t, roots%u.r0);", k);
        emit(e, "    far = least(far, roots%u.r1);", k);
        emit(e, "}");
    }
    emit(e, "*decided = NO_LEAF;");
    emit(e, "if (!ANY((t < far) & (t < bound))) return INFINITY;");
    for (uint32_t k = 0; k < count; k++) {
        snprintf(test, sizeof test, gap, k);
        emit(e, "if (%s) roots%u = record_roots(ray->records + leaf%u, ray->u, ray->v);", test, k, k);
    }
    emit(e, "for (;;) {");
    e->depth++;
    emit(e, "FLOAT before = t;");
    for (uint32_t k = 0; k < count; k++) {
        snprintf(test, sizeof test, gap, k);
        emit(e, "if (%s) t = roots_beyond(roots%u, t);", test, k);
    }
    emit(e, "if (!ANY((t != before) & (t < far) & (t < bound))) break;");
    e->depth--;
    emit(e, "}");
    emit(e, "t = t < far ? t : (FLOAT)(INFINITY);");
}

bool shape_is_freeform(const PlanShape *shape)
{
    return shape->node_count == 1 && shape->nodes[0].kind == SHAPE_FREEFORM;
}

const char *emit_linkage(bool freeform, bool leave)
{
    return !freeform ? "static" : leave ? "static NOINLINE" : "INLINE";
}

bool shape_is_called(const PlanShape *shape)
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
    bool called = shape_is_called(e->shape);
    emit(e, "%s FLOAT shape_%u_%s(const Ray *ray, uint id, uint begin, uint stop, %s, UINT *decided)",
         called ? "static NOINLINE" : emit_linkage(shape_is_freeform(e->shape), leave), index, emit_direction(e),
         called ? "const FLOAT *from, const FLOAT *to" : "FLOAT t, FLOAT bound");
    emit(e, "{");
    e->depth++;
    if (called) emit(e, uses_bound(e) ? "FLOAT t = *from, bound = *to;" : "FLOAT t = *from;");
    const PlanShapeNode *root = &e->shape->nodes[0];
    if (e->shape->leaf_count == 1 && root->kind != SHAPE_GROUP) {
        emit(e, "*decided = ray->nodes[id].rank;");
        if (root->kind == SHAPE_QUADRIC)
            emit(e, "return quadric_%s(record_roots(ray->records + id, ray->u, ray->v), ray->records[id].flags, t);",
                 emit_direction(e));
        else if (root->kind == SHAPE_FIELD)
            emit(e, "return field_next(ray, id, t, bound, %s, t != t, ray->shadow);", leave ? "-1.0f" : "1.0f");
        else if (root->kind == SHAPE_LIFTED)
            emit(e, leave ? "return lifted_next(ray, id, begin, stop, t, bound, -1.0f, t != t);"
                          : "return lifted_first(ray, id, begin, stop, t, bound);");
        else if (root->kind == SHAPE_SHEET)
            emit(e, leave ? "return t;" : "return sheet_next(ray, begin, stop, t, bound);");
        else if (root->kind == SHAPE_THICK)
            emit(e, "return thick_next(ray, id, begin, stop, t, bound, %s, t != t, ray->shadow);",
                 leave ? "-1.0f" : "1.0f");
        else if (leave)
            emit(e, "return freeform_next(ray, id, begin, stop, t, bound, -1.0f, t != t);");
        else
            emit(e, "return freeform_first(ray, id, begin, stop, t, bound);");
    } else if (is_flat_march(e)) {
        emit_flat_march(e);
        emit_decided(e, "t");
        emit(e, "return t;");
    } else if (emit_is_deep(e)) {
        emit_deep_march(e, index);
    } else {
        char t[16];
        emit_leaves(e);
        snprintf(t, sizeof t, "t%u", emit_advance(e, "t"));
        emit_decided(e, t);
        emit(e, "return %s;", t);
    }
    e->depth--;
    emit(e, "}\n");
}

void emit_shape(Emitter *e, uint32_t index)
{
    e->shape = &e->plan->shapes[index];
    e->next = 0;
    fprintf(e->out, "// Shape %u: ", index);
    describe(e);
    fputs(".\n", e->out);
    e->leave = false;
    bool deep = emit_is_deep(e);
    e->leave = true;
    if (deep || emit_is_deep(e)) emit_deep_tree(e, index);
    emit_shape_function(e, index, false);
    emit_shape_function(e, index, true);
}
