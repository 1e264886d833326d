// Numbering and folding walk the plan alike: group by group, each component's leaves in order, each leaf's perturbations or group right after it. A
// component's box is known once its contents are folded; then it is cut from theirs, so whoever drops a component from a list drops them too.
#include "runtime/view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/fold.h"
#include "runtime/fold_patch.h"
#include "runtime/spatial.h"

#define FAR_LIGHT                                                                                                      \
    1000.0 // units: a point light so far from what is looked at has one view, also where the scene has no end
#define RECORD_LIMIT (1u << 28)
#define DEPTH_LIMIT  1000 // of groups in groups

// Layout.

// Numbers come from counting alone in a first walk (nodes NULL).
typedef struct Numbering {
    Layout *layout;
    uint32_t number, item;
    bool too_many;
} Numbering;

static void number_group(Numbering *n, uint32_t group, int depth);

// Numbers for the cells of a patch, of `records` each, that belong to `head`; each is an item.
static void number_cells(Numbering *n, uint32_t patch, uint32_t records, uint32_t head)
{
    const Layout *layout = n->layout;
    uint32_t count = layout->plan->patches[patch].nodes - 1;
    if (count * count * records > RECORD_LIMIT - n->number) {
        n->too_many = true;
        return;
    }
    for (uint32_t k = 0; k < count * count; k++, n->item++, n->number += records) {
        if (!layout->nodes) continue;
        layout->items[n->item] = n->number;
        layout->nodes[n->number].shape = head;
        layout->nodes[n->number].material = k / count;
        layout->nodes[n->number].object = k % count;
    }
}

static void number_lifts(Numbering *n, const PlanLeaf *leaf)
{
    for (uint32_t k = 0; k < leaf->lift_count && !n->too_many; k++) {
        uint32_t head = n->number++;
        number_cells(n, n->layout->plan->lifts[leaf->lifts + k].patch, LIFT_RECORDS, head);
    }
}

// A header and its record for each copy, or a number for each part of it.
static void number_copies(Numbering *n, const PlanLeaf *leaf)
{
    const Layout *layout = n->layout;
    for (uint32_t k = 0; k < leaf->copy_count; k++) {
        const PlanCopy *copy = &layout->plan->copies[leaf->copies + k];
        bool shares = layout->clusters.shares;
        uint32_t items = shares ? 1 : layout->plan->clusters[copy->cluster].count,
                 numbers = shares ? 1 + COPY_RECORDS : items;
        if (numbers > RECORD_LIMIT - n->number) {
            n->too_many = true;
            return;
        }
        for (uint32_t i = 0; layout->nodes && i < items; i++) layout->items[n->item + i] = n->number + i;
        if (layout->nodes && shares) layout->nodes[n->number].count = NODE_COPIES;
        n->item += items;
        n->number += numbers;
    }
}

static uint32_t leaf_marks(const PlanLeaf *leaf)
{
    if (leaf->kind == LEAF_SHEET) return NODE_SHEET;
    if (leaf->kind == LEAF_THICK) return NODE_THICK;
    if (leaf->kind == LEAF_FIELD) return NODE_FIELD;
    if (leaf->kind != LEAF_FREEFORM) return 0;
    return leaf->count | (leaf->lift_count ? NODE_LIFTED : 0) | (leaf->copy_count ? NODE_COPIES : 0);
}

static void number_component(Numbering *n, const PlanComponent *component, int depth)
{
    const Plan *plan = n->layout->plan;
    PlanNode *nodes = n->layout->nodes;
    uint32_t id = n->number;
    if (nodes) n->layout->items[n->item] = id;
    n->item++;
    for (uint32_t k = 0; k < plan->shapes[component->shape].leaf_count && !n->too_many; k++) {
        const PlanLeaf *leaf = &plan->leaves[component->leaf_begin + k];
        uint32_t number = n->number++;
        if (leaf->kind == LEAF_GROUP) {
            number_group(n, leaf->begin, depth + 1);
        } else if (leaf->kind == LEAF_FREEFORM) {
            if (leaf->count > RECORD_LIMIT - n->number) {
                n->too_many = true;
                return;
            }
            for (uint32_t p = 0; nodes && p < leaf->count; p++) n->layout->items[n->item + p] = n->number + p;
            n->item += leaf->count;
            n->number += leaf->count;
            number_copies(n, leaf);
            number_lifts(n, leaf);
        } else if (leaf->kind == LEAF_SHEET || leaf->kind == LEAF_THICK) {
            number_cells(n, leaf->begin, leaf->kind == LEAF_THICK ? THICK_RECORDS : SHEET_RECORDS, number);
        }
        if (!nodes) continue;
        nodes[number].end = n->number;
        nodes[number].material = leaf->kind == LEAF_GROUP ? 0 : leaf->material;
        nodes[number].object = leaf->kind == LEAF_GROUP ? 0 : leaf->object;
        nodes[number].rank = leaf->order;
        nodes[number].count = leaf_marks(leaf);
    }
    if (!nodes) return;
    nodes[id].shape = component->shape;
    nodes[id].after = n->number;
}

static void number_group(Numbering *n, uint32_t group, int depth)
{
    const PlanGroup *g = &n->layout->plan->groups[group];
    for (uint32_t k = 0; k < g->component_count; k++) {
        if (n->number >= RECORD_LIMIT || depth > DEPTH_LIMIT) n->too_many = true;
        if (n->too_many) return;
        number_component(n, &n->layout->plan->components[n->layout->components[g->component_begin + k]], depth);
    }
}

typedef struct Ranked {
    uint32_t order, number;
} Ranked;

static int by_order(const void *a, const void *b)
{
    const Ranked *x = a, *y = b;
    if (x->order != y->order) return x->order < y->order ? -1 : 1;
    return x->number < y->number ? -1 : x->number > y->number;
}

// Perturbations have numbers too but are no leaves; they come last and are never asked for.
static bool rank_leaves(Layout *layout)
{
    Ranked *ranked = calloc(layout->record_count + 1, sizeof *ranked);
    if (!ranked) return false;
    for (uint32_t k = 0; k < layout->record_count; k++) {
        bool leaf = layout->nodes[k].end != 0;
        layout->leaf_count += leaf;
        ranked[k] = (Ranked){leaf ? layout->nodes[k].rank : UINT32_MAX, k};
    }
    qsort(ranked, layout->record_count, sizeof *ranked, by_order);
    for (uint32_t k = 0; k < layout->record_count; k++) {
        layout->nodes[ranked[k].number].rank = k;
        layout->nodes[k].leaf = ranked[k].number;
    }
    free(ranked);
    return true;
}

bool layout_init(Layout *layout, const Plan *plan, bool shares)
{
    *layout = (Layout){.plan = plan};
    layout->components = calloc(plan->component_count + 1u, sizeof *layout->components);
    layout->perturbations = calloc(plan->perturbation_count + 1u, sizeof *layout->perturbations);
    if (!layout->components || !layout->perturbations ||
        !spatial_order(plan, layout->components, layout->perturbations)) {
        layout_release(layout);
        return false;
    }
    Numbering counting = {.layout = layout};
    bool ready = cluster_table_init(&layout->clusters, plan, shares);
    if (ready) number_group(&counting, 0, 0);
    if (!ready || counting.too_many) {
        layout_release(layout);
        return false;
    }
    layout->record_count = counting.number;
    layout->item_count = counting.item;
    layout->item_stride = STRIDE_OF(counting.item);
    layout->items = calloc(layout->item_stride, sizeof *layout->items);
    layout->nodes = calloc(layout->record_count + 1, sizeof *layout->nodes);
    layout->boxes = calloc(layout->record_count + 1, sizeof *layout->boxes);
    bool tables = field_tables_init(&layout->fields, plan) && faces_init(&layout->faces, plan) &&
                  lift_bands_init(&layout->bands, plan);
    if (!layout->items || !layout->nodes || !layout->boxes || !tables) {
        layout_release(layout);
        return false;
    }
    Numbering numbering = {.layout = layout};
    number_group(&numbering, 0, 0);
    if (!rank_leaves(layout)) {
        layout_release(layout);
        return false;
    }
    return true;
}

void layout_release(Layout *layout)
{
    free(layout->components);
    free(layout->perturbations);
    free(layout->items);
    free(layout->nodes);
    free(layout->boxes);
    field_tables_release(&layout->fields);
    faces_release(&layout->faces);
    cluster_table_release(&layout->clusters);
    lift_bands_release(&layout->bands);
    *layout = (Layout){0};
}

// Boxes.

static const Box box_empty = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
static const Box box_all = {{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};

static bool box_is_empty(const Box *box)
{
    return box->low[0] > box->high[0] || box->low[1] > box->high[1] || box->low[2] > box->high[2];
}

static void box_hull(Box *into, const Box *box)
{
    if (box_is_empty(box)) return;
    for (int k = 0; k < 3; k++) {
        into->low[k] = fmin(into->low[k], box->low[k]);
        into->high[k] = fmax(into->high[k], box->high[k]);
    }
}

static void box_cut(Box *into, const Box *box)
{
    for (int k = 0; k < 3; k++) {
        into->low[k] = fmax(into->low[k], box->low[k]);
        into->high[k] = fmin(into->high[k], box->high[k]);
    }
}

// Folding.

typedef struct Folding {
    Layout *layout;
    const double *values;
    const Projection *projection;
    ScreenMap map;
    QuadricRecord *records; // NULL where only bounds are wanted
    float *boxes;
    uint32_t number, item;
} Folding;

static void set_item_box(Folding *f, uint32_t item, const Box *box)
{
    if (!f->boxes) return;
    float *boxes = f->boxes + item;
    uint32_t stride = f->layout->item_stride;
    bool seen = !box_is_empty(box) && box->low[2] <= f->projection->limit && box->high[2] >= f->projection->start;
    boxes[BOX_U_LOW * stride] = seen ? (float)box->low[0] : INFINITY;
    boxes[BOX_U_HIGH * stride] = seen ? (float)box->high[0] : -INFINITY;
    boxes[BOX_V_LOW * stride] = seen ? (float)box->low[1] : INFINITY;
    boxes[BOX_V_HIGH * stride] = seen ? (float)box->high[1] : -INFINITY;
    boxes[BOX_W_LOW * stride] = seen ? (float)box->low[2] : INFINITY;
}

// Cuts the box of an item from those of its contents, so that no list has contents without what they belong to.
static void cut_item_boxes(Folding *f, uint32_t item, uint32_t end)
{
    if (!f->boxes) return;
    float *boxes = f->boxes;
    uint32_t stride = f->layout->item_stride;
    for (uint32_t k = item + 1; k < end; k++) {
        for (int array = 0; array < BOX_ARRAYS; array++) {
            float *mine = &boxes[(uint32_t)array * stride + k], whole = boxes[(uint32_t)array * stride + item];
            *mine = array == BOX_U_HIGH || array == BOX_V_HIGH ? fminf(*mine, whole) : fmaxf(*mine, whole);
        }
    }
}

static void fold_group(Folding *f, uint32_t group, Box *box);

// Folds a perturbation, with Q as `map` sees it, behind its base, whose own Q is `whole`; `box` grows by its support.
static void fold_perturbation(Folding *f, const double q[10], const ScreenMap *map, double strength,
                              const ScreenQuadric *whole, double factor, QuadricRecord *base, Box *box)
{
    uint32_t number = f->number++, item = f->item++;
    Box support = box_empty;
    if (strength != 0) {
        ScreenQuadric folded;
        fold_quadric(q, map, &folded);
        fold_box(&folded, &support);
        if (f->records) {
            fold_record(&folded, cbrt(strength * factor), &f->records[number]);
            f->records[number].w_low = (float)support.low[2];
            base->flags |= strength < 0 ? RECORD_SIGNED : RECORD_GROWS;
            if (fold_strong(whole, &folded, strength, &support, f->projection->kappa)) base->flags |= RECORD_STRONG;
        }
    } else if (f->records) {
        fold_hidden(&f->records[number]);
    }
    set_item_box(f, item, &support);
    if (strength > 0) box_hull(box, &support);
}

static void fold_perturbations(Folding *f, const PlanLeaf *leaf, bool shown, double factor, QuadricRecord *base,
                               Box *box)
{
    ScreenQuadric whole;
    fold_quadric(f->values + leaf->quadric, &f->map, &whole);
    for (uint32_t k = 0; k < leaf->count; k++) {
        const PlanPerturbation *p = &f->layout->plan->perturbations[f->layout->perturbations[leaf->begin + k]];
        fold_perturbation(f, f->values + p->quadric, &f->map, shown ? f->values[p->strength] : 0, &whole, factor, base,
                          box);
    }
}

// A copy part by part, where the device does not make its records.
static void fold_parts(Folding *f, const PlanCopy *copy, const double base[10], double strength, double factor,
                       QuadricRecord *record, Box *box)
{
    const Plan *plan = f->layout->plan;
    const PlanCluster *cluster = &plan->clusters[copy->cluster];
    ScreenMap own = {0};
    ScreenQuadric whole;
    fold_quadric(base, &f->map, &whole);
    if (!copy_map(f->values + copy->matrix, &f->map, &own)) strength = 0;
    for (uint32_t k = cluster->begin; k < cluster->begin + cluster->count; k++) {
        const PlanPerturbation *p = &plan->perturbations[k];
        fold_perturbation(f, f->values + p->quadric, &own, strength * f->values[p->strength], &whole, factor, record,
                          box);
    }
}

static void fold_copies(Folding *f, const PlanLeaf *leaf, bool shown, double factor, QuadricRecord *base, Box *box)
{
    for (uint32_t k = leaf->copies; k < leaf->copies + leaf->copy_count; k++) {
        const PlanCopy *copy = &f->layout->plan->copies[k];
        double strength = shown ? f->values[copy->strength] : 0;
        if (!f->layout->clusters.shares) {
            fold_parts(f, copy, f->values + leaf->quadric, strength, factor, base, box);
            continue;
        }
        Box seen = box_empty, added = box_empty;
        QuadricRecord *header = f->records ? &f->records[f->number] : NULL;
        unsigned flags = 0;
        if (header) fold_hidden(header);
        if (shown)
            copy_record(&f->layout->clusters, f->values, copy, factor, f->projection, &f->map,
                        header ? (CopyRecord *)(header + 1) : NULL, &seen, &added, &flags);
        else if (header)
            memset(header + 1, 0, sizeof(CopyRecord));
        base->flags |= flags;
        set_item_box(f, f->item++, &seen);
        box_hull(box, &added);
        f->number += 1 + COPY_RECORDS;
    }
}

static const PatchCells *cells_of(const Folding *f, uint32_t patch)
{
    return f->layout->cells ? f->layout->cells[patch] : NULL;
}

// Folds what patches add to a free form, behind its perturbations.
static void fold_lifts(Folding *f, const PlanLeaf *leaf, bool shown, double factor, Box *box)
{
    for (uint32_t k = 0; k < leaf->lift_count; k++) {
        const PlanLift *lift = &f->layout->plan->lifts[leaf->lifts + k];
        const PatchCells *cells = cells_of(f, lift->patch);
        LiftPlace place;
        lift_place(f->layout->plan, f->values, lift, cells, &place);
        const LiftBand *bands =
            lift_bands_get(&f->layout->bands, f->layout->plan, f->values, leaf, leaf->lifts + k, &place, cells);
        uint32_t head = f->number++;
        if (f->records) lift_record(&place, &f->map, (LiftRecord *)&f->records[head]);
        for (int cell = 0; cell < place.count * place.count; cell++) {
            uint32_t number = f->number, item = f->item++;
            int i = cell / place.count, j = cell % place.count;
            Box one = box_empty;
            LiftBand band = bands[cell];
            if (shown && band.low < band.high) lift_cell_box(&place, &band, i, j, f->projection, &one);
            if (f->records) {
                lift_cell(&place, cells, i, j, factor, (CellRecord *)&f->records[number]);
                lift_cell_band(&band, (CellRecord *)&f->records[number], (CellBand *)&f->records[number + 1]);
            }
            f->number += LIFT_RECORDS;
            set_item_box(f, item, &one);
        }
        Box all;
        lift_box(&place, f->projection, &all);
        if (shown && place.automatic)
            *box = all;
        else if (shown)
            box_hull(box, &all);
    }
}

static void fold_sheet(Folding *f, const PlanLeaf *leaf, bool shown, Box *box)
{
    const PatchCells *cells = cells_of(f, leaf->begin);
    uint32_t count = f->layout->plan->patches[leaf->begin].nodes - 1;
    double place[12];
    sheet_place(f->values + leaf->quadric, f->projection, place);
    for (uint32_t k = 0; k < count * count; k++, f->number += SHEET_RECORDS) {
        CellRecord *records = f->records ? (CellRecord *)&f->records[f->number] : NULL;
        Box one = box_empty;
        if (shown && cells) sheet_cell(cells, (int)(k / count), (int)(k % count), place, f->projection, records, &one);
        set_item_box(f, f->item++, &one);
        box_hull(box, &one);
    }
}

// The cells are in the patch's own coordinates, and rays are moved there.
static void fold_thick(Folding *f, const PlanLeaf *leaf, bool shown, uint32_t number, Box *box)
{
    const PatchCells *cells = cells_of(f, leaf->begin);
    uint32_t count = f->layout->plan->patches[leaf->begin].nodes - 1;
    ThickPlace place;
    thick_place(f->layout->plan, f->values, leaf, &place);
    if (f->records) thick_record(&place, &f->map, (ThickRecord *)&f->records[number]);
    for (uint32_t k = 0; k < count * count; k++, f->number += THICK_RECORDS) {
        CellRecord *records = f->records ? (CellRecord *)&f->records[f->number] : NULL;
        Box one = box_empty;
        if (shown && cells && place.radius > 0)
            thick_cell(&place, cells, (int)(k / count), (int)(k % count), f->projection, records, &one);
        set_item_box(f, f->item++, &one);
        box_hull(box, &one);
    }
    if (shown && place.side <= 0) *box = box_all;
}

static bool is_shown(const Folding *f, const PlanLeaf *leaf)
{
    return leaf->shown == NO_SLOT || f->values[leaf->shown] != 0;
}

// Returns what the record has Q multiplied by.
static double fold_face(const Folding *f, const LeafFace *face, QuadricRecord *record, Box *box)
{
    if (face->kind != FACE_QUADRIC) {
        *box = box_all;
        return fold_planes(face, f->projection, record);
    }
    ScreenQuadric own, folded = {0};
    fold_quadric(face->quadric, &f->map, &own);
    fold_add(&folded, face->factor < 0 ? -1 : 1, &own);
    fold_box(&folded, box);
    return fold_record(&folded, 0, record) / fabs(face->factor);
}

static void fold_leaf(Folding *f, const PlanLeaf *leaf)
{
    uint32_t number = f->number++;
    Box *box = &f->layout->boxes[number];
    *box = box_empty;
    bool shown = is_shown(f, leaf);
    if (leaf->kind == LEAF_GROUP) {
        if (f->records) fold_hidden(&f->records[number]);
        uint32_t begin = f->item;
        fold_group(f, leaf->begin, box);
        if (shown) return;
        *box = box_empty;
        for (uint32_t k = begin; k < f->item; k++) set_item_box(f, k, box);
        return;
    }
    if (leaf->kind == LEAF_FIELD) {
        FieldRecord *field = f->records ? (FieldRecord *)&f->records[number] : NULL;
        if (field) memset(field, 0, sizeof *field);
        if (shown) fold_field(&f->layout->fields, f->values, leaf, f->projection, field, box);
        return;
    }
    if (leaf->kind == LEAF_SHEET) {
        if (f->records) fold_hidden(&f->records[number]);
        fold_sheet(f, leaf, shown, box);
        return;
    }
    if (leaf->kind == LEAF_THICK) {
        fold_thick(f, leaf, shown, number, box);
        return;
    }
    QuadricRecord unused, *record = f->records ? &f->records[number] : &unused;
    double factor = 1;
    if (shown)
        factor = fold_face(f, &f->layout->faces.leaves[leaf - f->layout->plan->leaves], record, box);
    else
        fold_hidden(record);
    if (leaf->kind != LEAF_FREEFORM) return;
    fold_perturbations(f, leaf, shown, factor, record, box);
    fold_copies(f, leaf, shown, factor, record, box);
    fold_lifts(f, leaf, shown, factor, box);
}

// Where quadrics are all >= 0 their weighted sum is: three slabs, each without an end, give an ellipsoid around a box. Two
// weightings: by the size of their quadratic parts, and by their peaks (exact about the corners of long boxes).
static void cut_sum(Folding *f, const PlanShape *shape, uint32_t node, const PlanComponent *component, Box *box)
{
    const Plan *plan = f->layout->plan;
    ScreenQuadric sums[2];
    memset(sums, 0, sizeof sums);
    uint32_t count = 0, at = node + 1;
    for (uint32_t k = 0; k < shape->nodes[node].count; k++) {
        const PlanShapeNode *child = &shape->nodes[at];
        for (uint32_t left = 1; left; left--, at++) // to the next child
            if (shape->nodes[at].kind == SHAPE_UNION || shape->nodes[at].kind == SHAPE_INTERSECT)
                left += shape->nodes[at].count;
        if (child->kind != SHAPE_QUADRIC) continue;
        const PlanLeaf *leaf = &plan->leaves[component->leaf_begin + child->leaf];
        const double *q = f->values + leaf->quadric;
        double trace = q[0] + q[1] + q[2];
        double size = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + 0.5 * (q[3] * q[3] + q[4] * q[4] + q[5] * q[5]));
        if (!(trace < 0) || !(size > 0)) continue; // what is not bounded in any direction, and subtracted bodies
        ScreenQuadric folded;
        fold_quadric(q, &f->map, &folded);
        double peak = q[9] + (q[6] * q[6] + q[7] * q[7] + q[8] * q[8]) / (4 * size);
        fold_add(&sums[0], 1 / size, &folded);
        fold_add(&sums[1], peak > 0 ? 1 / peak : 1 / size, &folded);
        count++;
    }
    if (count < 2) return;
    for (int k = 0; k < 2; k++) {
        Box sum;
        fold_box(&sums[k], &sum);
        box_cut(box, &sum);
    }
}

// The box of a node of a component's tree; *at moves behind the node.
static void node_box(Folding *f, const PlanComponent *component, const uint32_t *numbers, uint32_t *at, Box *box)
{
    const PlanShape *shape = &f->layout->plan->shapes[component->shape];
    uint32_t index = (*at)++;
    const PlanShapeNode *node = &shape->nodes[index];
    if (node->kind != SHAPE_UNION && node->kind != SHAPE_INTERSECT) {
        *box = f->layout->boxes[numbers[node->leaf]];
        return;
    }
    *box = node->kind == SHAPE_UNION ? box_empty : box_all;
    for (uint32_t k = 0; k < node->count; k++) {
        Box child;
        node_box(f, component, numbers, at, &child);
        if (node->kind == SHAPE_UNION)
            box_hull(box, &child);
        else
            box_cut(box, &child);
    }
    if (node->kind == SHAPE_INTERSECT) cut_sum(f, shape, index, component, box);
}

// Where a component's other leaves leave nothing a general field need not be looked for: endless ones have an end there.
static void limit_fields(Folding *f, const PlanComponent *component, const uint32_t *numbers, uint32_t *at,
                         const Box *limit)
{
    const PlanShape *shape = &f->layout->plan->shapes[component->shape];
    uint32_t index = (*at)++;
    const PlanShapeNode *node = &shape->nodes[index];
    if (node->kind == SHAPE_FIELD) {
        FieldRecord *record = (FieldRecord *)&f->records[numbers[node->leaf]];
        if (record->count) limit_field(f->projection, limit, record);
    }
    if (node->kind != SHAPE_UNION && node->kind != SHAPE_INTERSECT) return;
    Box inner = *limit;
    uint32_t child = *at;
    for (uint32_t k = 0; k < node->count && node->kind == SHAPE_INTERSECT; k++) {
        Box box;
        node_box(f, component, numbers, &child, &box);
        box_cut(&inner, &box);
    }
    for (uint32_t k = 0; k < node->count; k++) limit_fields(f, component, numbers, at, &inner);
}

static void fold_component(Folding *f, const PlanComponent *component, bool in_union, Box *box)
{
    const Plan *plan = f->layout->plan;
    const PlanShape *shape = &plan->shapes[component->shape];
    uint32_t item = f->item++;
    uint32_t few[16], *numbers = shape->leaf_count > 16 ? malloc(shape->leaf_count * sizeof *numbers) : few;
    if (!numbers) abort();
    for (uint32_t k = 0; k < shape->leaf_count; k++) {
        numbers[k] = f->number;
        fold_leaf(f, &plan->leaves[component->leaf_begin + k]);
    }
    uint32_t at = 0;
    node_box(f, component, numbers, &at, box);
    at = 0;
    if (f->records && shape->leaf_count > 1) limit_fields(f, component, numbers, &at, &box_all);
    if (numbers != few) free(numbers);

    // In a union it matters where it is not empty, in an intersection where it is not everything.
    Box matters = *box;
    if (!in_union) {
        matters = box_all;
        const PlanLeaf *leaf = &plan->leaves[component->leaf_begin];
        if (f->boxes && shape->leaf_count == 1 && leaf->kind == LEAF_QUADRIC && is_shown(f, leaf)) {
            ScreenQuadric folded;
            fold_quadric(f->values + leaf->quadric, &f->map, &folded);
            fold_outside_box(&folded, &matters);
        }
    }
    set_item_box(f, item, &matters);
    cut_item_boxes(f, item, f->item);
}

static void fold_group(Folding *f, uint32_t group, Box *box)
{
    const Plan *plan = f->layout->plan;
    const PlanGroup *g = &plan->groups[group];
    bool in_union = plan->group_types[g->type].set == SET_UNION;
    *box = in_union ? box_empty : box_all;
    for (uint32_t k = 0; k < g->component_count; k++) {
        Box component;
        fold_component(f, &plan->components[f->layout->components[g->component_begin + k]], in_union, &component);
        if (in_union)
            box_hull(box, &component);
        else
            box_cut(box, &component);
    }
}

// The boxes of blocks, `from` of `count` items or blocks, to the arrays behind them; the rest of both strides is empty.
static float *fold_blocks(float *from, uint32_t count)
{
    uint32_t stride = STRIDE_OF(count), blocks = BLOCKS_OF(count), block_stride = STRIDE_OF(blocks);
    float *to = from + BOX_ARRAYS * stride;
    for (uint32_t array = 0; array < BOX_ARRAYS; array++) {
        bool high = array == BOX_U_HIGH || array == BOX_V_HIGH;
        float *in = from + array * stride, *out = to + array * block_stride;
        for (uint32_t k = count; k < stride; k++) in[k] = high ? -INFINITY : INFINITY;
        for (uint32_t k = 0; k < block_stride; k++) out[k] = high ? -INFINITY : INFINITY;
        for (uint32_t k = 0; k < count; k++) {
            float *box = &out[k / ITEM_STEP];
            if (high ? in[k] > *box : in[k] < *box) *box = in[k];
        }
    }
    return to;
}

void view_fold(Layout *layout, const double *values, const Projection *projection, QuadricRecord *records, float *boxes)
{
    Folding f = {.layout = layout, .values = values, .projection = projection, .records = records, .boxes = boxes};
    fold_map(projection, &f.map);
    Box box;
    fold_group(&f, 0, &box);
    float *blocks = fold_blocks(boxes, layout->item_count);
    fold_blocks(blocks, BLOCKS_OF(layout->item_count));
}

void view_frame(Layout *layout, const double *values)
{
    field_tables_frame(&layout->fields, values);
    faces_frame(&layout->faces, values);
    cluster_table_frame(&layout->clusters, values);
    lift_bands_forget(&layout->bands);
}

void view_bounds(Layout *layout, const double *values, Box *box)
{
    const Projection world = {
        .axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .unit = 1, .start = -INFINITY, .limit = INFINITY};
    Folding f = {.layout = layout, .values = values, .projection = &world};
    fold_map(&world, &f.map);
    fold_group(&f, 0, box);
}

bool view_same_geometry(const Layout *layout, const double *values, const double *others)
{
    const Plan *plan = layout->plan;
    for (uint32_t k = 0; k < plan->leaf_count; k++) {
        const PlanLeaf *leaf = &plan->leaves[k];
        if (leaf->shown != NO_SLOT && values[leaf->shown] != others[leaf->shown]) return false;
        size_t count = leaf->kind == LEAF_GROUP                                                           ? 0
                       : leaf->kind == LEAF_SHEET || leaf->kind == LEAF_THICK || leaf->kind == LEAF_FIELD ? 12
                                                                                                          : 10;
        if (count && memcmp(values + leaf->quadric, others + leaf->quadric, count * sizeof *values)) return false;
        if (leaf->kind == LEAF_THICK &&
            (values[leaf->thickness] != others[leaf->thickness] || values[leaf->side] != others[leaf->side]))
            return false;
    }
    for (uint32_t k = 0; k < plan->patch_count; k++)
        if (memcmp(values + plan->patches[k].box, others + plan->patches[k].box, 7 * sizeof *values)) return false;
    for (uint32_t k = 0; k < plan->lift_count; k++) {
        const PlanLift *lift = &plan->lifts[k];
        bool same = values[lift->strength] == others[lift->strength] && values[lift->low] == others[lift->low] &&
                    values[lift->high] == others[lift->high];
        if (!same || memcmp(values + lift->frame, others + lift->frame, 12 * sizeof *values)) return false;
    }
    for (uint32_t k = 0; k < plan->copy_count; k++) {
        const PlanCopy *copy = &plan->copies[k];
        if (values[copy->strength] != others[copy->strength]) return false;
        if (memcmp(values + copy->matrix, others + copy->matrix, 12 * sizeof *values)) return false;
    }
    for (uint32_t k = 0; k < plan->perturbation_count; k++) {
        const PlanPerturbation *p = &plan->perturbations[k];
        if (values[p->strength] != others[p->strength]) return false;
        if (memcmp(values + p->quadric, others + p->quadric, 10 * sizeof *values)) return false;
    }
    return true;
}

// Cameras and lights.

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool normalize3(double v[3])
{
    double size = fmax(fmax(fabs(v[0]), fabs(v[1])), fabs(v[2]));
    if (!(size > 0) || !isfinite(size)) return false;
    for (int k = 0; k < 3; k++) v[k] /= size;
    double length = sqrt(dot3(v, v));
    for (int k = 0; k < 3; k++) v[k] /= length;
    return true;
}

static void cross3(const double a[3], const double b[3], double result[3])
{
    result[0] = a[1] * b[2] - a[2] * b[1];
    result[1] = a[2] * b[0] - a[0] * b[2];
    result[2] = a[0] * b[1] - a[1] * b[0];
}

// r and s from f and what is up; up along f gives way to another axis.
static void set_axes(Projection *p, const double forward[3], const double up[3])
{
    double *r = p->axis[0], *s = p->axis[1], *f = p->axis[2];
    memcpy(f, forward, sizeof p->axis[2]);
    if (!normalize3(f)) f[0] = 0, f[1] = 0, f[2] = -1;
    double u[3] = {up[0], up[1], up[2]};
    if (normalize3(u)) cross3(f, u, r);
    if (!(dot3(r, r) > 1e-20)) {
        double other[3] = {0, 0, 0};
        other[fabs(f[0]) < 0.6 ? 0 : fabs(f[1]) < 0.6 ? 1 : 2] = 1;
        cross3(f, other, r);
    }
    normalize3(r);
    cross3(r, f, s);
}

// The ball around a box; false where it has no end or nothing in it.
static bool box_ball(const Box *box, double centre[3], double *radius)
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        centre[k] = 0.5 * (box->low[k] + box->high[k]);
        double half = 0.5 * (box->high[k] - box->low[k]);
        if (!isfinite(centre[k]) || !(half >= 0)) return false;
        square += half * half;
    }
    *radius = sqrt(square);
    return isfinite(*radius) && *radius > 0;
}

static void place_origin(Projection *p, const double eye[3], double distance)
{
    for (int k = 0; k < 3; k++) p->origin[k] = eye[k] + distance * p->axis[2][k];
}

void view_primary(Layout *layout, const double *values, const Box *bounds, int width, int height, Projection *p,
                  Screen *screen)
{
    const Plan *plan = layout->plan;
    const double *camera = values + plan->camera, *eye = camera, *look_at = camera + 3, *up = camera + 6;
    *p = (Projection){0};
    double forward[3] = {look_at[0] - eye[0], look_at[1] - eye[1], look_at[2] - eye[2]};
    set_axes(p, forward, up);

    // Floats are exact near the origin: it is in what is looked at, which is the scene if the eye is outside of it. The unit is half of what
    // the picture shows there, if the scene is not smaller.
    double centre[3], radius = INFINITY, distance = sqrt(dot3(forward, forward));
    if (!(distance > 0) || !isfinite(distance)) distance = 1;
    if (box_ball(bounds, centre, &radius)) {
        double to[3] = {centre[0] - eye[0], centre[1] - eye[1], centre[2] - eye[2]};
        if (sqrt(dot3(to, to)) > radius)
            distance = fmax(dot3(to, p->axis[2]), 0.5 * radius);
        else
            distance = fmin(distance, radius);
    }
    double shown = plan->orthographic ? 0.5 * camera[10] : distance * tan(0.5 * camera[9]);
    double unit = fmin(shown * fmax(1, (double)width / height), radius);
    p->unit = unit;
    place_origin(p, eye, distance);
    double far = distance / unit, half_height;
    if (plan->orthographic) {
        p->kappa = 0;
        p->start = -far;
        p->limit = INFINITY;
        half_height = 0.5 * camera[10] / unit;
    } else {
        // A surface farther away than half a million times what is looked at is not seen.
        p->kappa = 1 / far;
        p->start = -INFINITY;
        p->limit = far * (1 - 2e-6);
        half_height = far * tan(0.5 * camera[9]);
    }
    double half_width = half_height * width / height;
    *screen = (Screen){-half_width, half_height, 2 * half_width / width, -2 * half_height / height};
}

static void point_view(Projection *p, const double at[3], const double forward[3], double distance, double unit)
{
    static const double up[3] = {0.0123, 1, 0.0456};
    *p = (Projection){.unit = unit, .kappa = unit / distance, .start = -INFINITY, .limit = INFINITY};
    set_axes(p, forward, up);
    place_origin(p, at, distance);
}

int view_light(const Plan *plan, const double *values, const PlanLight *light, const Box *bounds,
               const Projection *primary, Projection views[6])
{
    const double *v = values + light->values;
    if (light->kind == LIGHT_DIRECTIONAL) {
        static const double up[3] = {0.0123, 1, 0.0456};
        views[0] = (Projection){.unit = primary->unit, .kappa = 0, .start = -INFINITY, .limit = INFINITY};
        set_axes(&views[0], v, up);
        memcpy(views[0].origin, primary->origin, sizeof primary->origin);
        return 1;
    }
    const double *at = v + 3;
    double centre[3], radius;
    if (box_ball(bounds, centre, &radius)) {
        double ahead[3] = {centre[0] - at[0], centre[1] - at[1], centre[2] - at[2]};
        double distance = sqrt(dot3(ahead, ahead));
        if (distance > 1.05 * radius) {
            point_view(&views[0], at, ahead, distance, primary->unit);
            return 1;
        }
    }
    // From far away all that can be told apart lies ahead, and six square views would not have the digits to tell it.
    double to[3] = {primary->origin[0] - at[0], primary->origin[1] - at[1], primary->origin[2] - at[2]};
    double away = sqrt(dot3(to, to));
    if (away > FAR_LIGHT * primary->unit) {
        point_view(&views[0], at, to, away, primary->unit);
        return 1;
    }
    for (int k = 0; k < 6; k++) {
        double forward[3] = {0, 0, 0};
        forward[k / 2] = k % 2 ? -1 : 1;
        point_view(&views[k], at, forward, primary->unit, primary->unit);
        set_axes(&views[k], forward,
                 (const double[3]){k / 2 == 1, k / 2 == 2, k / 2 == 0}); // square with the other faces
        place_origin(&views[k], at, primary->unit);
    }
    return 6;
}

void view_map(const Projection *from, const Projection *to, float map[12])
{
    double move[3];
    for (int k = 0; k < 3; k++) move[k] = from->origin[k] - to->origin[k];
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++)
            map[4 * row + column] = (float)(dot3(to->axis[row], from->axis[column]) * from->unit / to->unit);
        map[4 * row + 3] = (float)(dot3(to->axis[row], move) / to->unit);
    }
}
