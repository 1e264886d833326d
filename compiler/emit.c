// Groups, the structure as a whole, and the source file that they stand in. The functions of shapes are emit_shape.c's.
#include "compiler/emit.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/emit_shape.h"
#include "kernel_source.h"

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

// The call for one component of a list, by its shape. What a called function can reach stays in memory, so it gets copies.
static void emit_call(Emitter *e, uint32_t shape)
{
    if (shape_is_called(&e->plan->shapes[shape])) {
        emit(e, "FLOAT from = t, to = bound;");
        emit(e, "UINT leaf;");
        emit(e, "place = shape_%u_%s(ray, id, first, at, &from, &to, &leaf);", shape, emit_direction(e));
        emit(e, "which = leaf;");
    } else {
        emit(e, "place = shape_%u_%s(ray, id, first, at, t, bound, &which);", shape, emit_direction(e));
    }
}

static void emit_dispatch(Emitter *e, const PlanGroupType *type)
{
    emit(e, "FLOAT place;");
    if (type->shape_count == 1) {
        emit(e, "{");
        e->depth++;
        emit_call(e, type->shapes[0]);
        e->depth--;
        emit(e, "}");
        return;
    }
    emit(e, "switch (ray->nodes[id].shape) {");
    for (uint32_t k = 0; k < type->shape_count; k++) {
        if (k + 1 < type->shape_count)
            emit(e, "case %u: {", type->shapes[k]);
        else
            emit(e, "default: {");
        e->depth++;
        emit_call(e, type->shapes[k]);
        emit(e, "break;");
        e->depth--;
        emit(e, "}");
    }
    emit(e, "}");
}

// The head of the loop over the components in ray->list[begin .. stop).
static void emit_component_loop(Emitter *e, const PlanGroupType *type)
{
    bool contents = false;
    for (uint32_t k = 0; k < type->shape_count; k++) contents |= has_contents(&e->plan->shapes[type->shapes[k]]);
    emit(e, "for (uint at = begin; at < stop;) {");
    e->depth++;
    emit(e, "uint id = ray->list[at++];");
    emit(e, "uint first = at;");
    if (contents) emit(e, "at = list_until(ray, at, stop, ray->nodes[id].after);");
    emit(e, "UINT which;");
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
    bool freeforms = type->shape_count == 1 && shape_is_freeform(&e->plan->shapes[type->shapes[0]]);
    emit(e, "%s FLOAT group_%u_%s(const Ray *ray, uint begin, uint stop, FLOAT t, FLOAT bound, UINT *decided)",
         emit_linkage(freeforms, leave), index, emit_direction(e));
    emit(e, "{");
    e->depth++;
    emit(e, "*decided = NO_LEAF;");
    bool least = (type->set == SET_UNION) != leave;
    if (least) {
        emit(e, "FLOAT nearest = INFINITY;");
        if (type->shape_count) {
            emit_component_loop(e, type);
            emit_dispatch(e, type);
            if (has_freeforms(e->plan, type)) {
                emit(e, "INT tied = size_of(place - nearest) <= " SAME_PLACE
                        "f * (1.0f + least(size_of(place), size_of(nearest)));");
                emit(e, "INT sooner = (place < nearest) & !(tied & (*decided < which));");
                emit(e, "*decided = (sooner | (tied & (which < *decided))) ? which : *decided;");
            } else {
                emit(e, "*decided = ((place < nearest) | ((place == nearest) & (which < *decided))) ? which : "
                        "*decided;");
            }
            emit(e, "nearest = least(nearest, place);");
            emit(e, "if (ray->shadow) {");
            emit(e, "    bound = nearest < bound ? (FLOAT)(-INFINITY) : bound;");
            emit(e, "    if (!ANY(bound > -INFINITY)) break;");
            emit(e, "} else {");
            emit(e, "    bound = least(bound, nearest + 1e-6f * (1.0f + size_of(nearest)));");
            emit(e, "}");
            e->depth--;
            emit(e, "}");
        }
        emit(e, "return nearest;");
    } else if (!type->shape_count) {
        emit(e, "return t;");
    } else {
        emit(e, "for (;;) {");
        e->depth++;
        emit(e, "FLOAT before = t;");
        emit_component_loop(e, type);
        emit_dispatch(e, type);
        emit(e, "*decided = place > t ? which : *decided;");
        emit(e, "t = most(t, place);");
        e->depth--;
        emit(e, "}");
        emit(e, "if (!ANY((t != before) & (t < bound))) return t;");
        e->depth--;
        emit(e, "}");
    }
    e->depth--;
    emit(e, "}\n");
}

// For groups that are leaves: keeps the stretch found last. What is around it asks where exactly the stretch begins and ends, also where the scene
// is only asked whether there is anything in the way. A stretch that is under way at t began before: -infinity, so no leaf decides there.
static void emit_group_advance(Emitter *e, uint32_t index, bool leave)
{
    e->leave = leave;
    const char *other = leave ? "enter" : "leave";
    emit(e,
         "static FLOAT group_%u_%s_advance(const Ray *ray, uint begin, uint stop, Stretch *stretch, UINT *decided, "
         "FLOAT t, FLOAT bound)",
         index, emit_direction(e));
    emit(e, "{");
    e->depth++;
    emit(e, "INT stale = (t >= stretch->end) & (t < bound);");
    emit(e, "if (ANY(stale)) {");
    e->depth++;
    emit(e, "FLOAT limit = stale ? bound : (FLOAT)(-INFINITY);");
    emit(e, "UINT which, unused;");
    emit(e, "Ray exact = *ray;");
    emit(e, "exact.shadow = 0;");
    emit(e, "FLOAT entry = group_%u_%s(&exact, begin, stop, t, limit, &which);", index, emit_direction(e));
    emit(e, "FLOAT end = group_%u_%s(&exact, begin, stop, entry, limit, &unused);", index, other);
    emit(e, "INT met = (entry > t) | (which != NO_LEAF);");
    emit(e, "FLOAT first = met ? entry : (FLOAT)(-INFINITY);");
    emit(e, "stretch->begin = stale ? first : stretch->begin;");
    emit(e, "stretch->end = stale ? end : stretch->end;");
    emit(e, "*decided = stale ? which : *decided;");
    e->depth--;
    emit(e, "}");
    emit(e, "return most(t, stretch->begin);");
    e->depth--;
    emit(e, "}\n");
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
        emit(e, "%s FLOAT scene_%s(const Ray *ray, FLOAT t, FLOAT bound, UINT *decided)",
             leave ? "static NOINLINE" : "INLINE", emit_direction(e));
        emit(e, "{");
        emit(e, "    return group_%u_%s(ray, 0, ray->count, t, bound, decided);", top, emit_direction(e));
        emit(e, "}\n");
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
