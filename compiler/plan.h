// What a compiled scene is to whoever renders it: tables and a program for the values that change by frame.
//
// Values. Every number that a frame may change lives in one array of doubles, the *slots*. `image` holds their const
// values, `frame_evaluate()` (compiler/frame.h) computes the rest for a time and the handles. Everything below names
// slots, never numbers, so a camera, light, material, coefficient or handle that moves changes no structure and
// rebuilds no kernel.
//
// Geometry. Complements have been pushed into coefficients, transforms into leaves, so only min and max of leaves are
// left.
//
//   group      union (max) or intersection (min) of any number of components; the scene is group 0, a union
//   component  one instance of a shape: its leaves stand one after another in `leaves`
//   shape      a small tree of unions and intersections over leaf places; equal trees are one shape, so code is
//              emitted once for each shape and components are data
//   leaf       a quadric; a free form (a quadric and perturbations); a general field (a tape); or again a group
//
// F(component) = the shape's min/max of F(leaf); F(free form) = base + sum of strength * max(Q, 0)^3. World
// coordinates throughout, but in clusters: a free form that a scene uses often has its perturbations in one, once. Leaves are in the order in which the scene says them within a component; `order` orders all
// leaves of the scene: where two decide equally, the lower order gives normal and paint.
//
// Components of a group are sorted by shape. Groups nest by structure, never in a circle; group types are numbered
// bottom-up. A group belongs to one leaf. A type may list shapes of which a group of it has no component.
//
// A scene that shows nothing has a group 0 without components. The set of all points, which a complement of nothing
// is, is a leaf whose quadric is the constant 1. Such constant quadrics and others without a surface may also come
// from the scene.
#ifndef SCN_COMPILER_PLAN_H
#define SCN_COMPILER_PLAN_H

#include <stdbool.h>
#include <stdint.h>

#include "compiler/ir.h"
#include "kernels/tape_shared.h"

typedef uint32_t Slot; // index of a double in the values

typedef enum PlanLeafKind { LEAF_QUADRIC, LEAF_FREEFORM, LEAF_FIELD, LEAF_SHEET, LEAF_THICK, LEAF_GROUP } PlanLeafKind;
typedef enum PlanSetKind { SET_UNION, SET_INTERSECT } PlanSetKind;

typedef struct PlanPerturbation {
    Slot quadric;  // ten slots: Q, world coordinates, free term with `grow` added
    Slot strength; // one slot
} PlanPerturbation;

// Perturbations that stand together, in coordinates of their own, and where they are once more.
typedef struct PlanCluster {
    uint32_t begin, count; // perturbations
} PlanCluster;

typedef struct PlanCopy {
    uint32_t cluster;
    Slot strength; // times those of the cluster
    Slot matrix;   // twelve slots: from the cluster's coordinates to the world
} PlanCopy;

typedef struct PlanTape { // an expression: steps in Plan.tape_steps whose numbers are slots
    uint32_t first, count;
} PlanTape;

// A patch that lifts a free form: F + strength * z(x, y) where the frame's x and y are in 0 … 1 and its z between low and high.
typedef struct PlanLift {
    uint32_t patch;
    Slot strength;
    Slot frame;     // twelve slots: from the frame to the world
    Slot low, high; // high < low: wherever the patch is
} PlanLift;

typedef struct PlanLeaf {
    uint32_t kind; // PlanLeafKind
    Slot quadric;  // ten slots: F or the free form's base (LEAF_GROUP: unused); LEAF_FIELD: twelve, the map from
                   // the world into the expression's coordinates; LEAF_SHEET, LEAF_THICK: twelve, from the patch to the
                   // world
    uint32_t begin,
        count; // LEAF_FREEFORM: perturbations; begin is the tape of LEAF_FIELD, the patch of LEAF_SHEET and LEAF_THICK, the
               // group of LEAF_GROUP; count 1
    uint32_t material; // index into materials (LEAF_GROUP: unused)
    uint32_t
        object; // index into objects: the outermost name above the leaf, so of `object car = body | wheels` it is car
    uint32_t order;              // rank among all leaves as the scene says them
    Slot shown;                  // one slot: 0 hides the leaf (F = -infinity); NO_SLOT: always shown
    uint32_t lifts, lift_count;  // LEAF_FREEFORM: with any, it is a SHAPE_LIFTED
    Slot thickness, side;        // LEAF_THICK: a slot each, as OP_THICKEN
    uint32_t copies, copy_count; // LEAF_FREEFORM without lifts: what clusters add to it
} PlanLeaf;
#define NO_SLOT UINT32_MAX

// A shape's tree in prefix order: an inner node is followed by its `count` children.
typedef enum ShapeNodeKind {
    SHAPE_UNION,
    SHAPE_INTERSECT,
    SHAPE_QUADRIC,
    SHAPE_FREEFORM,
    SHAPE_FIELD,
    SHAPE_LIFTED, // a free form that a patch lifts
    SHAPE_SHEET,
    SHAPE_THICK,
    SHAPE_GROUP
} ShapeNodeKind;
typedef struct PlanShapeNode {
    uint16_t kind;  // ShapeNodeKind
    uint16_t count; // children of UNION, INTERSECT; SHAPE_GROUP: the group type
    uint32_t leaf;  // leaf kinds: place in the component, 0 …, in prefix order
} PlanShapeNode;

typedef struct PlanShape {
    PlanShapeNode *nodes;
    uint32_t node_count, leaf_count;
} PlanShape;

typedef struct PlanGroupType { // what code a group needs: emitted once
    uint32_t set;              // PlanSetKind
    uint32_t *shapes;          // ascending
    uint32_t shape_count;
} PlanGroupType;

typedef struct PlanComponent {
    uint32_t shape;
    uint32_t leaf_begin;
} PlanComponent;

typedef struct PlanGroup {
    uint32_t type;
    uint32_t component_begin, component_count; // sorted by shape
} PlanGroup;

typedef struct PlanMaterial {
    Slot values;               // eleven slots, as OP_MATERIAL
    int32_t integer_shininess; // its value where it is const, whole and 0 … 1024; else -1
} PlanMaterial;

typedef struct PlanObject {
    const char *name; // as the scene names it; "" if it does not
    Span span;
} PlanObject;

typedef struct PlanLight {
    uint32_t kind; // LightKind
    Slot values;   // fourteen slots, as OP_LIGHT
} PlanLight;

// One step of the frame program. Its operands are words of Plan.operands, slots unless said otherwise. Matrices take
// 12 slots, quadrics 10. Scalar steps may give what is not finite (in a branch that is not chosen); the others stop
// the frame then.
typedef enum StepKind {
    STEP_SCALAR,  // op: IrOp, one of eval_knows(): result = op of the operands
    STEP_GATHER,  // result … = the operands, each one value: all finite, or the frame stops
    STEP_MATRIX,  // op: OP_COMPOSE of two matrices, OP_INVERSE of one, OP_STAND of seven scalars
    STEP_QUADRIC, // a quadric, a matrix M: the quadric of F(M^-1 X)
    STEP_PLACE, // a field program, then x y z turn: the frame on its surface (OP_PLACE); or from xyz, toward xyz: OP_SURFACE
    STEP_HEIGHT,    // a field program, that of a quadric, a matrix, x y z: OP_HEIGHT, one scalar
    STEP_STEEPNESS, // a field program, a matrix, low, high: OP_STEEPNESS, one scalar
    STEP_ASSERT,    // a scalar that is not 0, or the frame stops with `text`
    STEP_AT,        // a field program, then x y z: F there (OP_AT), one scalar
} StepKind;
// A field program among operands: the number of its words, then the words (compiler/field.h), whose values are slots.

typedef struct PlanStep {
    uint16_t kind; // StepKind
    uint16_t op;
    uint32_t count, first; // operands
    Slot result;
    Span span; // of the scene: where a value that is not finite is reported
    const char *text;
} PlanStep;

// What acts on a patch, in slots of its program.
typedef enum PlanPartKind { PART_PIN, PART_PRESS, PART_CONTACT } PlanPartKind;
typedef struct PlanPart {
    uint32_t kind;  // PlanPartKind
    Slot values[5]; // PIN: u v x y z; PRESS: u v strength; CONTACT: stiffness
    uint32_t field; // PRESS, CONTACT: where among the program's operands the field program begins
    Span span;
} PlanPart;

// Steps of a patch's program that are run at each node, for a few of its numbers.
typedef struct PlanRun {
    uint32_t begin, end;
    bool points; // the numbers differ from node to node
    bool varies; // they change with time, or with where the nodes are
    bool placed; // with where the nodes are
} PlanRun;

// A patch of the scene (runtime/patch_scene.h solves it). What its equation needs is computed by a program of its own, which
// is run for the times of its steps and not for those of frames: first the steps before `frame_end`, once, then those
// of a run for each node, with its place in `point`.
typedef struct PlanPatch {
    const char *name; // "" if it has none
    Span span;
    uint32_t nodes; // a side
    bool newmark, all_tangents, accurate;
    struct Plan *program; // values, steps and operands only
    Slot point;           // x y z u v
    uint32_t frame_end;
    PlanRun edges, force, start;
    bool varies;                               // numbers of its equation, or of a part, change with time
    Slot model[PATCH_OPERANDS - PATCH_CONSTS]; // the operands of OP_PATCH from the step on
    PlanPart *parts;
    uint32_t part_count;
    Slot
        box; // seven slots of the plan: low x y z, high x y z of its places, and a number that is another when its shape is;
             // whoever solves it fills them (the image has the flat square)
} PlanPatch;

typedef struct Plan {
    Slot slot_count;
    double *image; // slot_count values: the constants; elsewhere 0

    PlanStep *steps; // in order of evaluation
    uint32_t step_count;
    uint32_t *operands;
    uint32_t operand_count;
    Slot time, frame, inputs; // where the evaluator puts what comes from outside (inputs: input_count slots)

    PlanGroup *groups;
    uint32_t group_count;
    PlanGroupType *group_types;
    uint32_t group_type_count;
    PlanShape *shapes;
    uint32_t shape_count;
    PlanComponent *components;
    uint32_t component_count;
    PlanLeaf *leaves;
    uint32_t leaf_count;
    PlanPerturbation *perturbations;
    uint32_t perturbation_count;
    PlanCluster *clusters;
    uint32_t cluster_count;
    PlanCopy *copies;
    uint32_t copy_count;
    PlanTape *tapes;
    uint32_t tape_count;
    TapeStep *tape_steps; // of all tapes
    uint32_t tape_step_count;
    PlanMaterial *materials; // 0 is the default material
    uint32_t material_count;
    PlanObject *objects; // 0 is the unnamed one
    uint32_t object_count;
    PlanLight *lights;
    uint32_t light_count;
    Slot camera; // fifteen slots, as OP_CAMERA
    bool orthographic;
    Slot background; // four slots
    IrParam *params;
    uint32_t param_count, input_count;
    PlanPatch *patches;
    uint32_t patch_count;
    PlanLift *lifts;
    uint32_t lift_count;
    double duration, fps;
} Plan;

// What a leaf and a perturbation are in the IR, for messages about them: made beside a plan by plan_lower().
typedef struct PlanOrigins {
    Span *leaves;        // leaf_count: of the quadric
    Span *perturbations; // perturbation_count
} PlanOrigins;

// How many slots a step computes.
uint32_t plan_step_width(const PlanStep *step);

// For each slot whether a step computes it (else it is const): slot_count flags.
bool *plan_computed(const Plan *plan, Arena *arena);

// F of the scene at a point, in double, and which leaf decides it (NULL: not asked for; UINT32_MAX where there is
// none: F is then infinite). Ties go to the leaf of the lowest order.
double plan_field(const Plan *plan, const double *values, const double point[3], uint32_t *leaf);
double plan_component_field(const Plan *plan, const double *values, uint32_t component, const double point[3],
                            uint32_t *leaf);
double plan_leaf_field(
    const Plan *plan, const double *values, const PlanLeaf *leaf,
    const double point[3]); // not of LEAF_GROUP; patches are not known here: sheets, thick or not, are empty, lifts 0

#endif
