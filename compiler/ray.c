// The field program is run once with polynomials in t instead of numbers. What it leaves is a tree of unions and
// intersections over leaves: a complement goes to the leaves at once (max becomes min, each leaf changes its sign), and
// a perturbation of a set operation is added to each leaf below it, and in a morph each leaf of the one is joined with
// each of the other, so none of these has nodes of its own.
//
//     values on the stack     ranges of leaves and nodes that follow each other, since a program is in postfix order
//     Leaf                    base polynomial and a list of cubes
//     Tree node               max or min, and how many of its children are positive just now
//
// A chain a | b | c … is one node of many children, so a change of sign climbs the nesting and not the chain.
#include "compiler/ray.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/eval.h"

enum { NONE = UINT32_MAX, DEGREE_MAX = 6, HALVINGS_MAX = 52 };

typedef struct Cube { // strength max(q, 0)^3, q = q[0] + q[1] t + q[2] t^2
    double strength, q[3];
    uint32_t next;
} Cube;

typedef struct Leaf {
    double base[3];
    uint32_t cubes;  // the first of its list
    uint32_t parent; // tree node
    bool fixed;      // infinite everywhere: nothing is added to it
    int sign;        // as the ray goes on
} Leaf;

typedef struct Tree {
    uint32_t parent, children, positive;
    bool max;
} Tree;

typedef struct Operand { // a value on the stack: what it is made of begins here and goes up to the next one's
    uint32_t leaf, node;
    uint32_t root; // 2 i: leaf i; 2 i + 1: node i
} Operand;

typedef struct Line { // the ray in the coordinates of the maps around
    double point[3], direction[3];
} Line;

typedef struct Event { // a leaf changes its sign
    double t;
    uint32_t leaf;
} Event;

typedef struct Tracer {
    Arena arena;
    Leaf *leaves;
    Tree *nodes;
    Cube *cubes;
    Event *events;
    uint32_t leaf_count, leaf_room, node_count, node_room, cube_count, cube_room, event_count, event_room;
    double *ends; // of the supports of one leaf
    uint32_t end_room;
} Tracer;

static void *room(Tracer *r, void *array, uint32_t count, uint32_t *capacity, size_t size)
{
    if (count < *capacity) return array;
    *capacity = *capacity ? 2 * *capacity : 16;
    void *larger = arena_alloc(&r->arena, *capacity * size);
    if (count) memcpy(larger, array, count * size);
    return larger;
}

// --- the program, with polynomials

static void quadric_along(const double q[10], const Line *line, double p[3])
{
    const double *o = line->point, *d = line->direction;
    double x = o[0], y = o[1], z = o[2], a = d[0], b = d[1], c = d[2];
    p[0] = q[0] * x * x + q[1] * y * y + q[2] * z * z + q[3] * x * y + q[4] * x * z + q[5] * y * z + q[6] * x +
           q[7] * y + q[8] * z + q[9];
    p[1] = 2 * (q[0] * x * a + q[1] * y * b + q[2] * z * c) + q[3] * (x * b + y * a) + q[4] * (x * c + z * a) +
           q[5] * (y * c + z * b) + q[6] * a + q[7] * b + q[8] * c;
    p[2] = q[0] * a * a + q[1] * b * b + q[2] * c * c + q[3] * a * b + q[4] * a * c + q[5] * b * c;
}

static Operand push_leaf(Tracer *r, const double base[3], bool fixed)
{
    Operand value = {r->leaf_count, r->node_count, 2 * r->leaf_count};
    r->leaves = room(r, r->leaves, r->leaf_count, &r->leaf_room, sizeof *r->leaves);
    Leaf *leaf = &r->leaves[r->leaf_count++];
    *leaf = (Leaf){.cubes = NONE, .parent = NONE, .fixed = fixed};
    memcpy(leaf->base, base, sizeof leaf->base);
    return value;
}

static Operand push_empty(Tracer *r)
{
    return push_leaf(r, (const double[3]){-1, 0, 0}, true);
}

static void adopt(Tracer *r, uint32_t parent, uint32_t child)
{
    if (child % 2)
        r->nodes[child / 2].parent = parent;
    else
        r->leaves[child / 2].parent = parent;
    r->nodes[parent].children++;
}

static void join(Tracer *r, Operand *a, const Operand *b, bool max)
{
    bool same = a->root % 2 && r->nodes[a->root / 2].max == max;
    if (!same) {
        r->nodes = room(r, r->nodes, r->node_count, &r->node_room, sizeof *r->nodes);
        r->nodes[r->node_count] = (Tree){.parent = NONE, .max = max};
        adopt(r, r->node_count, a->root);
        a->root = 2 * r->node_count++ + 1;
    }
    adopt(r, a->root / 2, b->root);
}

static void negate(Tracer *r, const Operand *value)
{
    for (uint32_t i = value->node; i < r->node_count; i++) r->nodes[i].max = !r->nodes[i].max;
    for (uint32_t i = value->leaf; i < r->leaf_count; i++) {
        Leaf *leaf = &r->leaves[i];
        for (int k = 0; k < 3; k++) leaf->base[k] = -leaf->base[k];
        for (uint32_t c = leaf->cubes; c != NONE; c = r->cubes[c].next) r->cubes[c].strength = -r->cubes[c].strength;
    }
}

// Whether q is positive anywhere on the ray.
static bool reaches(const double q[3])
{
    if (q[0] > 0 || q[2] > 0 || (q[2] == 0 && q[1] > 0)) return true;
    if (q[2] == 0 || q[1] <= 0) return false; // it falls from a start that is not positive
    return q[1] * q[1] >= 4 * q[0] * q[2];    // its peak lies ahead
}

static void drop(Tracer *r, const Operand *value)
{
    r->leaf_count = value->leaf;
    r->node_count = value->node;
}

// Q is on top, what it is added to below.
static bool add_cube(Tracer *r, const Operand *base, const Operand *q, double strength, double grow)
{
    if (q->root % 2 || r->leaves[q->root / 2].cubes != NONE) return false; // a support is a quadric
    Leaf support = r->leaves[q->root / 2];
    drop(r, q);
    support.base[0] += grow;
    if (support.fixed || strength == 0 || !reaches(support.base)) return true;
    for (uint32_t i = base->leaf; i < r->leaf_count; i++) {
        Leaf *leaf = &r->leaves[i];
        if (leaf->fixed) continue;
        r->cubes = room(r, r->cubes, r->cube_count, &r->cube_room, sizeof *r->cubes);
        Cube *cube = &r->cubes[r->cube_count];
        *cube = (Cube){.strength = strength, .next = leaf->cubes};
        memcpy(cube->q, support.base, sizeof cube->q);
        leaf->cubes = r->cube_count++;
    }
    return true;
}

// --- morphs

typedef struct Saved { // what two values are made of, before their product takes its place
    const Leaf *leaves;
    const Tree *nodes;
    uint32_t leaf_count, node_count, leaf, node; // leaf, node: where they began
    uint32_t root;
} Saved;

static Saved save(Tracer *r, const Operand *value, uint32_t leaf_end, uint32_t node_end)
{
    Saved saved = {.leaf_count = leaf_end - value->leaf,
                   .node_count = node_end - value->node,
                   .leaf = value->leaf,
                   .node = value->node,
                   .root = value->root};
    Leaf *leaves = arena_array(&r->arena, Leaf, saved.leaf_count);
    Tree *nodes = arena_array(&r->arena, Tree, saved.node_count + 1);
    memcpy(leaves, r->leaves + value->leaf, saved.leaf_count * sizeof *leaves);
    if (saved.node_count) memcpy(nodes, r->nodes + value->node, saved.node_count * sizeof *nodes);
    saved.leaves = leaves;
    saved.nodes = nodes;
    return saved;
}

static void weigh(Tracer *r, uint32_t leaf, const Leaf *from, double weight)
{
    for (int k = 0; k < 3; k++) r->leaves[leaf].base[k] += weight * from->base[k];
    for (uint32_t c = from->cubes; c != NONE; c = r->cubes[c].next) {
        r->cubes = room(r, r->cubes, r->cube_count, &r->cube_room, sizeof *r->cubes);
        r->cubes[r->cube_count] = r->cubes[c];
        r->cubes[r->cube_count].strength *= weight;
        r->cubes[r->cube_count].next = r->leaves[leaf].cubes;
        r->leaves[leaf].cubes = r->cube_count++;
    }
}

// One leaf of a with one of b, under a node of the product. What is infinite stays so.
static uint32_t mixed_leaf(Tracer *r, const Leaf *a, const Leaf *b, double t, uint32_t parent)
{
    bool fixed = a->fixed || b->fixed;
    const Leaf *infinite = a->fixed && !(b->fixed && b->base[0] < 0) ? a : b; // of both, what is empty
    uint32_t leaf = push_leaf(r, fixed ? infinite->base : (const double[3]){0, 0, 0}, fixed).leaf;
    r->leaves[leaf].parent = parent;
    if (!fixed) {
        weigh(r, leaf, a, 1 - t);
        weigh(r, leaf, b, t);
    }
    return leaf;
}

// b's tree in the place of a leaf of a, whose parent is given. Returns its root.
static uint32_t put_tree(Tracer *r, const Saved *b, const Leaf *a, double t, uint32_t parent)
{
    uint32_t first = r->node_count;
    for (uint32_t i = 0; i < b->node_count; i++) {
        r->nodes = room(r, r->nodes, r->node_count, &r->node_room, sizeof *r->nodes);
        Tree node = b->nodes[i];
        node.parent = node.parent == NONE ? parent : first + (node.parent - b->node);
        r->nodes[r->node_count++] = node;
    }
    uint32_t root = b->root % 2 ? 2 * (first + (b->root / 2 - b->node)) + 1 : 2 * r->leaf_count;
    for (uint32_t i = 0; i < b->leaf_count; i++) {
        uint32_t above = b->leaves[i].parent;
        mixed_leaf(r, a, &b->leaves[i], t, above == NONE ? parent : first + (above - b->node));
    }
    return root;
}

// (1 - t) a + t b, the two on top: each leaf of a becomes a tree of b, whose leaves are sums of both. Where a weight is 0
// only the other counts.
static void mix(Tracer *r, Operand *a, const Operand *b, double t)
{
    if (t <= 0) {
        drop(r, b);
        return;
    }
    static const Leaf nothing = {.cubes = NONE, .parent = NONE};
    Saved first = save(r, a, b->leaf, b->node), second = save(r, b, r->leaf_count, r->node_count);
    r->leaf_count = a->leaf;
    if (t >= 1) {
        r->node_count = a->node;
        a->root = put_tree(r, &second, &nothing, 1, NONE);
        return;
    }
    r->node_count = a->node + first.node_count; // a's nodes stay where they are
    for (uint32_t i = 0; i < first.leaf_count; i++) {
        uint32_t root = put_tree(r, &second, &first.leaves[i], t, first.leaves[i].parent);
        if (!(a->root % 2)) a->root = root; // a is this leaf alone
    }
}

static void enter(const double m[12], const Line *outer, Line *inner)
{
    matrix_point(m, outer->point, inner->point);
    for (int i = 0; i < 3; i++) {
        inner->direction[i] = 0;
        for (int k = 0; k < 3; k++) inner->direction[i] += m[4 * i + k] * outer->direction[k];
    }
}

// Runs the program. Where a set is a complement with perturbations below, their signs have followed.
static bool trace(Tracer *r, FieldCode code, const double *values, const Line *ray, uint32_t *root)
{
    Operand *stack = arena_array(&r->arena, Operand, FIELD_STACK_MAX + 1), *top = stack - 1;
    Line *line = arena_array(&r->arena, Line, FIELD_POINTS_MAX + 1);
    *line = *ray;
    for (const uint32_t *w = code.words; w < code.words + code.count;) {
        switch ((FieldOp)*w++) {
        case FIELD_QUADRIC: {
            double p[3];
            quadric_along(values + *w++, line, p);
            if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) return false;
            *++top = push_leaf(r, p, false);
            break;
        }
        case FIELD_EMPTY: *++top = push_empty(r); break;
        case FIELD_MAX:
        case FIELD_MIN:
            top--;
            join(r, top, top + 1, w[-1] == FIELD_MAX);
            break;
        case FIELD_NEGATE: negate(r, top); break;
        case FIELD_CUBE:
            top--;
            if (!add_cube(r, top, top + 1, values[w[0]], values[w[1]])) return false;
            w += 2;
            break;
        case FIELD_SHOW:
            if (values[*w++] == 0) {
                drop(r, top);
                *top = push_empty(r);
            }
            break;
        case FIELD_MIX:
            top--;
            mix(r, top, top + 1, values[*w++]);
            break;
        case FIELD_MIX_AT:
        case FIELD_TAPE: return false; // no polynomials
        case FIELD_ENTER:
            enter(values + *w++, line, line + 1);
            line++;
            break;
        case FIELD_LEAVE: line--; break;
        }
    }
    *root = top->root;
    return true;
}

// --- roots of a leaf

// A piece of the ray as u in 0 … 1. Near: t = begin + (end - begin) u. Far, without an end: t = begin / u, so that
// infinity is at u = 0, and the polynomial is multiplied by the power of u that leaves no fraction.
typedef struct Piece {
    double begin, end;
    bool far;
} Piece;

static double piece_t(const Piece *piece, double u)
{
    return piece->far ? piece->begin / u : piece->begin + (piece->end - piece->begin) * u;
}

// q of the piece's u, in powers of u.
static void in_piece(const Piece *piece, const double q[3], double p[3])
{
    double a = piece->begin, h = piece->end - piece->begin;
    if (piece->far) {
        p[0] = q[2] * a * a;
        p[1] = q[1] * a;
        p[2] = q[0];
    } else {
        p[0] = q[0] + a * (q[1] + a * q[2]);
        p[1] = h * (q[1] + 2 * a * q[2]);
        p[2] = h * h * q[2];
    }
}

static double square(const double q[3], double t)
{
    return q[0] + t * (q[1] + t * q[2]);
}

static bool active(const Cube *cube, const Piece *piece)
{
    return square(cube->q, piece->far ? 2 * piece->begin : piece->begin + (piece->end - piece->begin) / 2) > 0;
}

// The leaf's polynomial over the piece, in powers of u. `size` is what it would be without cancellation. Its degree.
static int leaf_polynomial(const Tracer *r, const Leaf *leaf, const Piece *piece, double p[DEGREE_MAX + 1],
                           double *size)
{
    double base[3], q[3];
    int degree = 2;
    memset(p, 0, (DEGREE_MAX + 1) * sizeof *p);
    in_piece(piece, leaf->base, base);
    *size = fabs(base[0]) + fabs(base[1]) + fabs(base[2]);
    for (uint32_t c = leaf->cubes; c != NONE; c = r->cubes[c].next) {
        if (!active(&r->cubes[c], piece)) continue;
        degree = DEGREE_MAX;
        in_piece(piece, r->cubes[c].q, q);
        double squared[5] = {0}, sum = fabs(q[0]) + fabs(q[1]) + fabs(q[2]);
        for (int i = 0; i < 3; i++) {
            for (int k = 0; k < 3; k++) squared[i + k] += q[i] * q[k];
        }
        for (int i = 0; i < 5; i++) {
            for (int k = 0; k < 3; k++) p[i + k] += r->cubes[c].strength * squared[i] * q[k];
        }
        *size += fabs(r->cubes[c].strength) * sum * sum * sum;
    }
    int shift = piece->far ? degree - 2 : 0;
    for (int k = 0; k < 3; k++) p[k + shift] += base[k];
    return degree;
}

static void to_bernstein(const double *p, int n, double *c)
{
    static const double binomial[DEGREE_MAX + 1][DEGREE_MAX + 1] = {
        {1}, {1, 1}, {1, 2, 1}, {1, 3, 3, 1}, {1, 4, 6, 4, 1}, {1, 5, 10, 10, 5, 1}, {1, 6, 15, 20, 15, 6, 1}};
    for (int i = 0; i <= n; i++) {
        c[i] = 0;
        for (int k = 0; k <= i; k++) c[i] += binomial[i][k] / binomial[n][k] * p[k];
    }
}

static double polynomial_at(const double *p, int n, double u)
{
    double sum = p[n];
    for (int k = n; k-- > 0;) sum = sum * u + p[k];
    return sum;
}

typedef struct Search { // the signs of one leaf, followed along the ray
    Tracer *tracer;
    uint32_t leaf;
    Piece piece;
    double p[DEGREE_MAX + 1], noise; // what rounding can make of 0
    int degree;
    int sign; // so far; 0: nothing but zeros yet
} Search;

static void see(Search *s, int sign, double u)
{
    if (sign == 0 || sign == s->sign) return;
    Tracer *r = s->tracer;
    if (s->sign == 0) {
        r->leaves[s->leaf].sign = sign; // how it begins
    } else {
        r->events = room(r, r->events, r->event_count, &r->event_room, sizeof *r->events);
        r->events[r->event_count++] = (Event){piece_t(&s->piece, u), s->leaf};
    }
    s->sign = sign;
}

// The one root between two ends where the signs differ.
static double bisect(const Search *s, double low, double high, int sign_low)
{
    for (int step = 0; step < 200; step++) {
        double middle = low + (high - low) / 2;
        if (middle <= low || middle >= high) break;
        double f = polynomial_at(s->p, s->degree, middle);
        if (f == 0) return middle;
        if ((f > 0) == (sign_low > 0))
            low = middle;
        else
            high = middle;
    }
    return low;
}

// Follows the signs over low … high, whose Bernstein coefficients are c, in the direction in which t grows.
static void follow(Search *s, const double *c, double low, double high, int depth)
{
    int n = s->degree, first = 0, last = 0, changes = 0;
    for (int i = 0; i <= n; i++) {
        int sign = c[i] > s->noise ? 1 : c[i] < -s->noise ? -1 : 0;
        if (!sign) continue;
        if (!first) first = sign;
        changes += last && sign != last;
        last = sign;
    }
    bool far = s->piece.far;
    if (changes == 0 || depth == HALVINGS_MAX || (changes == 1 && c[0] * c[n] < 0)) {
        see(s, far ? last : first, far ? high : low);
        if (first != last)
            see(s, far ? first : last, changes == 1 ? bisect(s, low, high, first) : low + (high - low) / 2);
        return;
    }
    double left[DEGREE_MAX + 1], right[DEGREE_MAX + 1], middle = low + (high - low) / 2;
    memcpy(right, c, (size_t)(n + 1) * sizeof *c);
    for (int i = 0; i <= n; i++) { // de Casteljau
        left[i] = right[0];
        for (int k = 0; k < n - i; k++) right[k] = (right[k] + right[k + 1]) / 2;
    }
    follow(s, far ? right : left, far ? middle : low, far ? high : middle, depth + 1);
    follow(s, far ? left : right, far ? low : middle, far ? middle : high, depth + 1);
}

static void follow_piece(Search *s, double begin, double end)
{
    double size, c[DEGREE_MAX + 1];
    s->piece = (Piece){begin, end, isinf(end)};
    s->degree = leaf_polynomial(s->tracer, &s->tracer->leaves[s->leaf], &s->piece, s->p, &size);
    s->noise = 16 * DBL_EPSILON * size;
    to_bernstein(s->p, s->degree, c);
    follow(s, c, 0, 1, 0);
}

static int compare_ends(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static void add_end(Tracer *r, uint32_t *count, double t)
{
    if (!(t > 0) || !isfinite(t)) return;
    r->ends = room(r, r->ends, *count, &r->end_room, sizeof *r->ends);
    r->ends[(*count)++] = t;
}

// The places where q changes its sign, without cancellation.
static void add_ends(Tracer *r, uint32_t *count, const double q[3])
{
    double discriminant = q[1] * q[1] - 4 * q[0] * q[2];
    if (q[2] == 0) {
        add_end(r, count, -q[0] / q[1]);
    } else if (discriminant > 0) {
        double half = -(q[1] + copysign(sqrt(discriminant), q[1])) / 2;
        add_end(r, count, half / q[2]);
        add_end(r, count, q[0] / half);
    }
}

static void follow_leaf(Tracer *r, uint32_t leaf)
{
    Search s = {.tracer = r, .leaf = leaf};
    uint32_t count = 0;
    for (uint32_t c = r->leaves[leaf].cubes; c != NONE; c = r->cubes[c].next) add_ends(r, &count, r->cubes[c].q);
    if (count) qsort(r->ends, count, sizeof *r->ends, compare_ends);
    double begin = 0;
    for (uint32_t k = 0; k < count; k++) {
        if (!(r->ends[k] > begin)) continue;
        follow_piece(&s, begin, r->ends[k]);
        begin = r->ends[k];
    }
    if (begin == 0) { // a far piece begins beyond 0
        follow_piece(&s, 0, 1);
        begin = 1;
    }
    follow_piece(&s, begin, INFINITY);
    if (s.sign == 0) r->leaves[leaf].sign = 1; // zero all along: the set is closed
}

// --- the tree

static bool tree_positive(const Tree *node)
{
    return node->max ? node->positive > 0 : node->positive == node->children;
}

// A child of `node` has become positive, or has ceased to be.
static void climb(Tracer *r, uint32_t node, bool positive)
{
    while (node != NONE) {
        Tree *at = &r->nodes[node];
        bool before = tree_positive(at);
        if (positive)
            at->positive++;
        else
            at->positive--;
        bool after = tree_positive(at);
        if (before == after) return;
        positive = after;
        node = at->parent;
    }
}

static bool root_positive(const Tracer *r, uint32_t root)
{
    return root % 2 ? tree_positive(&r->nodes[root / 2]) : r->leaves[root / 2].sign > 0;
}

// Before anything is positive: a min of nothing positive is not, and children come before their parents.
static void begin_tree(Tracer *r)
{
    for (uint32_t i = 0; i < r->leaf_count; i++) {
        uint32_t parent = r->leaves[i].parent;
        if (r->leaves[i].sign > 0 && parent != NONE) climb(r, parent, true);
    }
}

static int compare_events(const void *a, const void *b)
{
    const Event *x = a, *y = b;
    if (x->t != y->t) return x->t < y->t ? -1 : 1;
    return x->leaf < y->leaf ? -1 : x->leaf > y->leaf;
}

// Changes that rounding cannot tell apart happen together, so that equal faces leave no sliver between them.
static bool first_change(Tracer *r, uint32_t root, double *t)
{
    static const double together = 1e-12;
    bool start = root_positive(r, root);
    for (uint32_t k = 0; k < r->event_count;) {
        double begin = r->events[k].t;
        for (; k < r->event_count && r->events[k].t - begin <= together * (1 + begin); k++) {
            Leaf *leaf = &r->leaves[r->events[k].leaf];
            leaf->sign = -leaf->sign;
            climb(r, leaf->parent, leaf->sign > 0);
        }
        *t = begin;
        if (root_positive(r, root) != start) return true;
    }
    return false;
}

bool ray_first(FieldCode code, const double *values, const double from[3], const double direction[3], double *t)
{
    if (field_is_general(code)) return ray_first_general(code, values, from, direction, t);
    Tracer tracer = {0}, *r = &tracer;
    Line ray;
    memcpy(ray.point, from, sizeof ray.point);
    memcpy(ray.direction, direction, sizeof ray.direction);
    uint32_t root;
    bool found = trace(r, code, values, &ray, &root);
    if (found) {
        for (uint32_t i = 0; i < r->leaf_count; i++) follow_leaf(r, i);
        begin_tree(r);
        if (r->event_count) qsort(r->events, r->event_count, sizeof *r->events, compare_events);
        found = first_change(r, root, t);
    }
    arena_release(&r->arena);
    return found;
}

bool ray_surface(FieldCode code, const double *values, const double from[3], const double toward[3], double result[12])
{
    double direction[3], point[3], normal[3], t;
    for (int k = 0; k < 3; k++) direction[k] = toward[k] - from[k];
    if (!ray_first(code, values, from, direction, &t)) return false;
    for (int k = 0; k < 3; k++) point[k] = from[k] + t * direction[k];
    FieldValue hit = field_at(code, values, point);
    for (int k = 0; k < 3; k++) normal[k] = -hit.gradient[k];
    return matrix_stand(point, normal, 0, result);
}
