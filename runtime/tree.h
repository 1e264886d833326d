// The tree of a scene as its author thinks of it: `scn tree`, and the model behind it.
//
// From source (tree_ir.c) a tree has the sets, names and words of the scene; from a package (tree_plan.c), which holds no scene, it has what
// is rendered: names at the top, under them unions and intersections of quadrics and free forms. Both are made by the same steps:
//
//     TreeNode *node = tree_node(tree, TREE_UNION);
//     … tree_add(tree, node, child, subtracted) for each part, from left to right …
//     tree_finish(tree, node);
//
// Siblings that are alike are one node with a count: of the same kind, word, name (but for digits), rate and parts, whatever their places,
// sizes and materials. So a forest of 100,000 trees is a few lines. A node then has the bounds, costs and counts of all that it stands for; its
// parts are those of the first.
//
// Bounds are outer ones (compiler/bounds.h) at one moment and for one setting of the params. `inside` is where F >= 0, `outside` where
// -F >= 0, which is what bounds the complement; both are kept, so that `a - ~b` has bounds.
//
// Cost is the number of quadrics that a ray is expected to meet the bounds of: 1 for a ray that crosses the bounds of a quadric, 1 more for
// each perturbation of a free form whose support it crosses there. A straight line that crosses a convex body crosses a smaller one inside of
// it with the ratio of their areas (Cauchy and Crofton), so the cost of a quadric is the area of its bounds over that of the scene's, both
// cut to the scene's finite bounds; what has no end costs 1. Inside of an intersection only the part of the bounds counts that lies in those
// of the intersection. It is what the kernel's culling aims at, tells which part of a scene is dear, and does not depend on a machine.
#ifndef SCN_RUNTIME_TREE_H
#define SCN_RUNTIME_TREE_H

#include <stdbool.h>
#include <stdint.h>

#include "compiler/bounds.h"
#include "compiler/ir.h"
#include "compiler/plan.h"
#include "lang/unit.h"

typedef enum TreeKind {
    TREE_EMPTY,
    TREE_QUADRIC,
    TREE_FREEFORM,
    TREE_UNION,
    TREE_INTERSECTION,
    TREE_DIFFERENCE, // an intersection some of whose parts are taken away
    TREE_COMPLEMENT,
    TREE_DEFORMED, // perturbations of what is no quadric
    TREE_FIELD,    // a general field
    TREE_NAMED,    // a second name for one thing
    TREE_KINDS
} TreeKind;

// What a value depends on: bit 0 the time, bit 1 the number of the frame, bit 2 + k param k. NULL: nothing.
typedef uint64_t *TreeMovers;

enum { TREE_MEETING = 32, TREE_NO_MATERIAL = -1, TREE_MATERIALS = -2 /* several */ };

typedef struct TreeNode TreeNode;
struct TreeNode {
    uint8_t kind, class, rate; // TreeKind, IrClass, IrRate
    bool subtracted;           // taken away from what stands before it
    bool conditional;          // shown or not by a value that moves
    bool hidden;               // not shown (at this moment, if conditional)
    const char *name;          // or NULL
    const char *last_name;     // of the last that it stands for, where it differs
    const char *word;          // what the scene calls it: "box", "petal"; or NULL
    int material;              // index into Tree.materials, or one of the two above
    TreeMovers movers;
    uint32_t count;              // of equal siblings that it stands for
    uint64_t uses;               // places in the whole scene where it is used, where that is not its count
    uint64_t quadrics, supports; // below it: quadrics and bases of free forms; perturbations
    Bounds inside, outside;
    double cost;  // of all that it stands for, without what is around it
    double share; // of its cost that counts inside of what is around it
    Span span;    // where the scene says it
    TreeNode *first, *last, *next;

    // For making it.
    uint64_t hash; // of what must be alike
    double q[10];  // of a quadric in world coordinates, if `plain`
    bool plain;
    const double *meeting[TREE_MEETING]; // quadrics among its parts, complements taken
    bool meeting_negated[TREE_MEETING];
    int meeting_count;
    TreeNode **table; // parts by hash, where there are many
    uint32_t parts, capacity;
};

typedef struct TreeMaterial {
    const char *name; // as the scene calls it, or a color: "clay", "#c8814b"
} TreeMaterial;

typedef struct Tree {
    Arena *arena;
    const IrParam *params;
    uint32_t param_count, words; // words: of a TreeMovers
    TreeMaterial *materials;
    int material_count, material_capacity;
    Bounds scene; // finite: what costs are relative to; empty if there is no such thing
    TreeNode *root;
    TreeNode *spare; // nodes to use again
} Tree;

// What moves, and where: the same as a frame is rendered with.
typedef struct TreeMoment {
    double time, frame;
    const double *inputs; // input_count values of the params
    const double *values; // of the plan, by frame_evaluate() of these
} TreeMoment;

// The tree of an elaborated scene, whose plan is given for its bounds. The tree is the arena's.
Tree *tree_of_ir(Arena *arena, const Sources *sources, const Ir *ir, IrId root, const Plan *plan,
                 const TreeMoment *moment);

// The tree of a package's plan.
Tree *tree_of_plan(Arena *arena, const Plan *plan, const TreeMoment *moment);

// --- for those that make trees

Tree *tree_new(Arena *arena, const Plan *plan, const double *values);
TreeNode *tree_node(Tree *tree, TreeKind kind);
TreeNode *tree_quadric(Tree *tree, const double q[10]); // world coordinates; NULL: it cannot be computed
void tree_add(Tree *tree, TreeNode *node, TreeNode *child, bool subtracted);
void tree_finish(Tree *tree, TreeNode *node);
TreeMovers tree_join_movers(const Tree *tree, TreeMovers a, TreeMovers b);
TreeMovers tree_mover(const Tree *tree, uint32_t bit);
int tree_material(Tree *tree, const char *name); // the material of that name, made where it is new
double tree_crossed(const Tree *tree, const Bounds *box);
Bounds tree_hull(Bounds a, const Bounds *b);
Bounds tree_meeting(Bounds a, const Bounds *b);

// --- for those that print them

const char *tree_kind_name(TreeKind kind);
const char *tree_class_name(const TreeNode *node);         // "quadric", "free form", "set", "field"
const char *tree_mover_name(const Tree *tree, uint32_t k); // of bit k
static inline bool tree_moves(const TreeNode *node, uint32_t k)
{
    return node->movers && (node->movers[k / 64] >> (k % 64) & 1);
}

#endif
