// The tree of an elaborated scene. What moves is computed first: the IR is built anew with numbers for time and params, which folds all of
// it, tools on surfaces included. Then one walk from the root carries maps, perturbations and paint down and makes nodes on the way up.
//
// Words are read from the scene's text: `box(1, 2, 3)` is elaborated to an intersection of three quadrics, all of which the scene says at one
// place, so that node is one word without parts.
#include <ctype.h>
#include <math.h>
#include <string.h>

#include "compiler/eval.h"
#include "compiler/field.h"
#include "compiler/leaf.h"
#include "compiler/param.h"
#include "compiler/quadric.h"
#include "runtime/tree.h"

enum { DEEPEST = 2000 }; // deeper, sets are opaque; the compiler takes none that are nearly so deep

typedef struct Maker {
    Tree *tree;
    const Sources *sources;
    const Ir *ir;
    Ir *fixed; // the IR with numbers for what moves
    IrId *to;  // of each node that in `fixed`
    uint64_t *uses;
    TreeMovers *movers;
    int *materials; // of each OP_MATERIAL, -1: not asked for yet
} Maker;

typedef struct Added { // the perturbations of a free form around
    const struct Added *up;
    Bounds more, less; // where they add and where they take away
    Bounds *supports;
    uint32_t count;
} Added;

typedef struct Around { // what is around a node
    double map[12];
    bool mapped; // the map could be computed
    const Added *added;
    int depth;
} Around;

// --- The moment

static IrId fixed_node(Maker *m, IrId id, const TreeMoment *moment, IrId *operands)
{
    const IrNode *node = ir_at(m->ir, id);
    for (uint32_t k = 0; k < node->count; k++) operands[k] = m->to[ir_operand(m->ir, id, k)];
    switch ((IrOp)node->op) {
    case OP_CONST: return ir_const(m->fixed, node->number);
    case OP_PARAM: return ir_const(m->fixed, moment->inputs[node->index]);
    case OP_TIME: return ir_const(m->fixed, moment->time);
    case OP_FRAME: return ir_const(m->fixed, moment->frame);
    case OP_NAMED:
    case OP_ASSERT:
    case OP_PATCH: return ir_node_text(m->fixed, (IrOp)node->op, node->span, operands, node->count, node->text);
    default: break;
    }
    if (!node->bits) return ir_node(m->fixed, (IrOp)node->op, node->span, operands, node->count);
    return ir_node_index(m->fixed, (IrOp)node->op, node->span, operands, node->count, node->index);
}

static void fix(Maker *m, IrId root, const TreeMoment *moment, Arena *scratch)
{
    uint32_t most = 1;
    for (IrId id = 1; id <= root; id++) most = ir_at(m->ir, id)->count > most ? ir_at(m->ir, id)->count : most;
    IrId *operands = arena_array(scratch, IrId, most);
    for (IrId id = 1; id <= root; id++) m->to[id] = fixed_node(m, id, moment, operands);
}

static void find_movers(Maker *m, IrId root)
{
    for (IrId id = 1; id <= root; id++) {
        const IrNode *node = ir_at(m->ir, id);
        TreeMovers movers = NULL;
        if (node->op == OP_TIME || node->op == OP_FRAME) movers = tree_mover(m->tree, node->op == OP_FRAME);
        for (uint32_t k = 0; node->op == OP_PARAM && k < m->tree->param_count; k++) {
            const IrParam *param = &m->tree->params[k];
            bool this = !param->structure && param->slot <= node->index &&
                        node->index < param->slot + (uint32_t)param_size(param->type);
            if (this) movers = tree_mover(m->tree, 2 + k);
        }
        for (uint32_t k = 0; k < node->count; k++)
            movers = tree_join_movers(m->tree, movers, m->movers[ir_operand(m->ir, id, k)]);
        m->movers[id] = movers;
    }
}

// How often each node is used: the number of ways to it from the root.
static void count_uses(Maker *m, IrId root)
{
    m->uses[root] = 1;
    for (IrId id = root; id; id--) {
        for (uint32_t k = 0; m->uses[id] && k < ir_at(m->ir, id)->count; k++) {
            uint64_t *uses = &m->uses[ir_operand(m->ir, id, k)];
            *uses = *uses + m->uses[id] < *uses ? UINT64_MAX : *uses + m->uses[id];
        }
    }
}

// --- Words

// What the scene's text says at a span; NULL for nowhere.
static const char *text_at(const Maker *m, Span span, uint32_t *length)
{
    const Source *source = span.end ? source_of(m->sources, span.begin) : NULL;
    if (!source || source->prelude || span.end < span.begin || span.end - source->base > source->length) return NULL;
    *length = span.end - span.begin;
    return source->text + (span.begin - source->base);
}

static uint32_t name_length(const char *text, uint32_t length)
{
    uint32_t n = 0;
    while (n < length && (isalnum((unsigned char)text[n]) || text[n] == '_')) n++;
    return n && !isdigit((unsigned char)*text) ? n : 0;
}

// The end of what begins with the bracket at `at`, behind its closing one. Comments and strings are passed over.
static uint32_t behind_bracket(const char *text, uint32_t at, uint32_t length)
{
    for (int depth = 0; at < length; at++) {
        char c = text[at], next = at + 1 < length ? text[at + 1] : 0;
        if (c == '(' || c == '[' || c == '{') depth++;
        if ((c == ')' || c == ']' || c == '}') && --depth == 0) return at + 1;
        if (c == '"') {
            while (++at < length && text[at] != '"') at += text[at] == '\\';
        } else if (c == '/' && next == '/') {
            while (at < length && text[at] != '\n') at++;
        } else if (c == '/' && next == '*') {
            for (at += 2; at + 1 < length && !(text[at] == '*' && text[at + 1] == '/'); at++) continue;
            at++;
        }
    }
    return length;
}

static uint32_t behind_space(const char *text, uint32_t at, uint32_t length)
{
    while (at < length && isspace((unsigned char)text[at])) at++;
    return at;
}

// The word of a call, `box` of `box(1)` and of `box { x: 1; }`; NULL where the text is no call, or one of a set.
static const char *word_at(const Maker *m, Span span)
{
    static const char *const sets[] = {"union",    "intersect", "subtract", "object", "scene",
                                       "freeform", "deform",    "quadric",  "if",     "for"};
    uint32_t length = 0, n;
    const char *text = text_at(m, span, &length);
    if (!text || !(n = name_length(text, length))) return NULL;
    for (size_t k = 0; k < sizeof sets / sizeof *sets; k++) {
        if (strlen(sets[k]) == n && !memcmp(sets[k], text, n)) return NULL;
    }
    uint32_t at = behind_space(text, n, length);
    if (at == length || (text[at] != '(' && text[at] != '{')) return NULL;
    if (text[at] == '(') at = behind_space(text, behind_bracket(text, at, length), length);
    if (at < length && text[at] == '{') at = behind_bracket(text, at, length);
    return at == length ? arena_text(m->tree->arena, text, n) : NULL;
}

static int srgb(double v)
{
    v = v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
    return v <= 0 ? 0 : v >= 1 ? 255 : (int)lround(255 * v);
}

// `clay` of `material clay { … }`, else the color.
static const char *material_name(const Maker *m, IrId id)
{
    uint32_t length = 0, n;
    const char *text = text_at(m, ir_at(m->ir, id)->span, &length);
    if (text && (n = name_length(text, length)) == 8 && !memcmp(text, "material", n)) {
        while (n < length && text[n] == ' ') n++;
        uint32_t name = name_length(text + n, length - n);
        if (name) return arena_text(m->tree->arena, text + n, name);
    }
    double color[3];
    for (uint32_t k = 0; k < 3; k++) {
        if (!ir_is_const(m->fixed, ir_operand(m->fixed, m->to[id], k), &color[k])) return "a color";
    }
    return arena_printf(m->tree->arena, "#%02x%02x%02x", (unsigned)srgb(color[0]), (unsigned)srgb(color[1]),
                        (unsigned)srgb(color[2]));
}

static int material_of(Maker *m, IrId id)
{
    if (m->materials[id] == TREE_NO_MATERIAL) m->materials[id] = tree_material(m->tree, material_name(m, id));
    return m->materials[id];
}

// --- Quadrics and perturbations

static void enter_map(Maker *m, Around *around, IrId matrix)
{
    double map[12];
    around->mapped = around->mapped && ir_const_matrix(m->fixed, m->to[matrix], map);
    if (around->mapped) matrix_compose(around->map, map, around->map);
}

static bool world_quadric(Maker *m, IrId id, const Around *around, double q[10])
{
    double inverse[12];
    return around->mapped && leaf_const_quadric(m->fixed, m->to[id], q) && matrix_inverse(around->map, inverse) &&
           quadric_transform(q, inverse, q);
}

// The support of a perturbation, Q + grow >= 0, and its strength.
static bool read_perturbation(Maker *m, IrId id, Around around, Bounds *support, double *strength)
{
    for (; ir_at(m->ir, id)->op == OP_PTRANSFORM; id = ir_operand(m->ir, id, 0))
        enter_map(m, &around, ir_operand(m->ir, id, 1));
    if (ir_at(m->ir, id)->op != OP_PERTURB) return false;
    double q[10], grow;
    bool known = ir_is_const(m->fixed, m->to[ir_operand(m->ir, id, 1)], strength) &&
                 ir_is_const(m->fixed, m->to[ir_operand(m->ir, id, 2)], &grow);
    IrId quadric = ir_operand(m->ir, id, 0);
    for (IrOp op; known; quadric = ir_operand(m->ir, quadric, 0)) {
        op = (IrOp)ir_at(m->ir, quadric)->op;
        if (op == OP_TRANSFORM)
            enter_map(m, &around, ir_operand(m->ir, quadric, 1));
        else if (op != OP_NAMED && op != OP_PAINT)
            break;
    }
    if (!known || !world_quadric(m, quadric, &around, q)) return false;
    q[9] += grow;
    *support = bounds_of_quadric(q);
    return true;
}

static void read_perturbations(Maker *m, IrId id, const Around *around, Added *added)
{
    uint32_t count = ir_at(m->ir, id)->count - 1;
    Bounds none = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    *added = (Added){.up = around->added,
                     .more = none,
                     .less = none,
                     .supports = arena_array(m->tree->arena, Bounds, count),
                     .count = count};
    if (added->up) added->more = added->up->more, added->less = added->up->less;
    for (uint32_t k = 0; k < count; k++) {
        double strength = 0;
        Bounds *support = &added->supports[k];
        bool known = read_perturbation(m, ir_operand(m->ir, id, 1 + k), *around, support, &strength);
        if (!known) *support = (Bounds){{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
        if (!known || strength > 0) added->more = tree_hull(added->more, support);
        if (!known || strength < 0) added->less = tree_hull(added->less, support);
    }
}

static TreeNode *make_quadric(Maker *m, IrId id, const Around *around)
{
    double q[10];
    TreeNode *node = tree_quadric(m->tree, world_quadric(m, id, around, q) ? q : NULL);
    if (!around->added) return node;
    node->kind = TREE_FREEFORM;
    node->class = CLASS_FREEFORM;
    node->plain = false;
    node->inside = tree_hull(node->inside, &around->added->more);
    node->outside = tree_hull(node->outside, &around->added->less);
    node->cost = tree_crossed(m->tree, &node->inside);
    for (const Added *added = around->added; added; added = added->up) {
        node->supports += added->count;
        for (uint32_t k = 0; k < added->count; k++) {
            Bounds met = tree_meeting(added->supports[k], &node->inside);
            node->cost += tree_crossed(m->tree, &met);
        }
    }
    return node;
}

// --- Objects

static TreeNode *make_node(Maker *m, IrId id, Around around);

static TreeNode *make_set(Maker *m, IrId id, const Around *around)
{
    const IrNode *node = ir_at(m->ir, id);
    bool difference = false;
    for (uint32_t k = 1; k < node->count && node->op == OP_INTERSECT; k++)
        difference |= ir_at(m->ir, ir_operand(m->ir, id, k))->op == OP_COMPLEMENT;
    TreeNode *set = tree_node(m->tree, node->op == OP_UNION ? TREE_UNION
                                       : difference         ? TREE_DIFFERENCE
                                                            : TREE_INTERSECTION);
    bool word = true; // all of it is said at one place
    for (uint32_t k = 0; k < node->count; k++) {
        IrId part = ir_operand(m->ir, id, k);
        bool subtracted = difference && k && ir_at(m->ir, part)->op == OP_COMPLEMENT;
        if (subtracted) part = ir_operand(m->ir, part, 0);
        Span span = ir_at(m->ir, part)->span;
        word &= span.begin == node->span.begin && span.end == node->span.end;
        tree_add(m->tree, set, make_node(m, part, *around), subtracted);
    }
    tree_finish(m->tree, set);
    if (word && word_at(m, node->span)) set->first = set->last = NULL;
    return set;
}

// Where a general field is, of which the numbers are known by now; perturbations around it add what they reach.
static Bounds field_box(const Maker *m, IrId id, const Around *around)
{
    Bounds whole = {{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}}, box = whole, local;
    IrId field = m->to[id];
    if (!field || ir_at(m->fixed, field)->op != OP_FIELD || !around->mapped) return whole;
    if (!field_fold_bounds(m->fixed, ir_operand(m->fixed, field, 0), local.low, local.high)) return whole;
    if (bounds_empty(&local)) return local;
    for (int i = 0; i < 3; i++) {
        box.low[i] = box.high[i] = around->map[4 * i + 3];
        for (int k = 0; k < 3; k++) {
            double f = around->map[4 * i + k];
            if (f == 0) continue; // of a side without an end too
            box.low[i] += f * (f > 0 ? local.low[k] : local.high[k]);
            box.high[i] += f * (f > 0 ? local.high[k] : local.low[k]);
        }
    }
    for (const Added *added = around->added; added; added = added->up) box = tree_hull(box, &added->more);
    return box;
}

static TreeNode *make_field(Maker *m, IrId id, const Around *around)
{
    const IrNode *node = ir_at(m->ir, id);
    TreeNode *made;
    Added added;
    Around inner = *around;
    switch ((IrOp)node->op) {
    case OP_EMPTY: return tree_node(m->tree, TREE_EMPTY);
    case OP_QUADRIC: return make_quadric(m, id, around);
    case OP_UNION:
    case OP_INTERSECT: return make_set(m, id, around);
    case OP_COMPLEMENT:
        made = tree_node(m->tree, TREE_COMPLEMENT);
        tree_add(m->tree, made, make_node(m, ir_operand(m->ir, id, 0), *around), false);
        tree_finish(m->tree, made);
        return made;
    case OP_FREEFORM:
    case OP_DEFORM:
        read_perturbations(m, id, around, &added);
        inner.added = &added;
        made = make_node(m, ir_operand(m->ir, id, 0), inner);
        if (made->kind == TREE_FREEFORM && !made->name) return made;
        TreeNode *deformed = tree_node(m->tree, TREE_DEFORMED);
        tree_add(m->tree, deformed, made, false);
        tree_finish(m->tree, deformed);
        return deformed;
    default: break;
    }
    made = tree_node(m->tree, TREE_FIELD);
    made->inside = field_box(m, id, around);
    made->cost = tree_crossed(m->tree, &made->inside);
    return made;
}

// What is only said about an object is one node with it: names, paint, maps and visibility.
typedef struct Said {
    const char *name;
    int material;
    bool conditional, hidden;
    uint64_t uses;
} Said;

static IrId read_said(Maker *m, IrId id, Around *around, Said *said)
{
    for (;; id = ir_operand(m->ir, id, 0)) {
        const IrNode *node = ir_at(m->ir, id);
        double shown = 1;
        switch ((IrOp)node->op) {
        case OP_TRANSFORM: enter_map(m, around, ir_operand(m->ir, id, 1)); continue;
        case OP_PAINT: said->material = material_of(m, ir_operand(m->ir, id, 1)); continue;
        case OP_SHOW:
            said->conditional |= node->rate != RATE_CONST && ir_at(m->ir, ir_operand(m->ir, id, 1))->rate != RATE_CONST;
            ir_is_const(m->fixed, m->to[ir_operand(m->ir, id, 1)], &shown);
            said->hidden |= shown == 0;
            continue;
        case OP_NAMED:
            if (said->name) return id;
            said->name = node->text;
            said->uses = m->uses[id];
            continue;
        default: return id;
        }
    }
}

static TreeNode *make_node(Maker *m, IrId id, Around around)
{
    Said said = {.material = TREE_NO_MATERIAL};
    const IrNode *top = ir_at(m->ir, id);
    IrId core = read_said(m, id, &around, &said);
    const IrNode *node = ir_at(m->ir, core);
    TreeNode *made;
    if (around.depth++ > DEEPEST) {
        made = tree_node(m->tree, TREE_FIELD);
    } else if (node->op == OP_NAMED) {
        made = tree_node(m->tree, TREE_NAMED);
        tree_add(m->tree, made, make_node(m, core, around), false);
        tree_finish(m->tree, made);
    } else {
        made = make_field(m, core, &around);
    }
    made->rate = top->rate;
    made->class = made->kind == TREE_FREEFORM ? CLASS_FREEFORM : top->class; // a quadric that is deformed from around
    made->movers = m->movers[id];
    made->span = node->span;
    made->name = said.name;
    made->uses = said.uses;
    if (said.material != TREE_NO_MATERIAL) made->material = said.material;
    made->conditional = said.conditional;
    made->hidden = said.hidden;
    made->word = word_at(m, node->span);
    if (!made->word && made->kind == TREE_FIELD) made->word = ir_ops[node->op].name; // "morph", "sheet"
    if (said.hidden) { // it has bounds and costs when it is shown
        made->inside = (Bounds){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
        made->outside = (Bounds){{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
        made->cost = 0;
        made->plain = false;
    }
    return made;
}

Tree *tree_of_ir(Arena *arena, const Sources *sources, const Ir *ir, IrId root, const Plan *plan,
                 const TreeMoment *moment)
{
    Arena scratch = {0};
    Maker m = {.tree = tree_new(arena, plan, moment->values), .sources = sources, .ir = ir, .fixed = ir_new(&scratch)};
    m.to = arena_array(&scratch, IrId, root + 1);
    m.uses = arena_array(&scratch, uint64_t, root + 1);
    m.movers = arena_array(&scratch, TreeMovers, root + 1);
    m.materials = arena_array(&scratch, int, root + 1);
    for (IrId id = 0; id <= root; id++) m.materials[id] = TREE_NO_MATERIAL;
    fix(&m, root, moment, &scratch);
    find_movers(&m, root);
    count_uses(&m, root);
    Around around = {.map = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, .mapped = true};
    m.tree->root = make_node(&m, root, around);
    arena_release(&scratch);
    return m.tree;
}
