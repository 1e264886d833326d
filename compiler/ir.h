// The typed IR: a DAG of nodes in one array.
//
// A node comes after its operands, so the array is in evaluation order. A node has a type, a rate (when its value
// becomes known) and, if it is a field, a class (how rays can meet it). Scalars are hash-consed: equal nodes are one
// node. Objects are shared where the scene shares them. Building folds: what has const operands becomes const at once,
// by the evaluator that also runs frames.
//
//     IrId s = ir_op2(ir, OP_ADD, span, a, b);
//     IrId sphere = ir_node(ir, OP_QUADRIC, span, coefficients, 10);
//
// The text form (`scn dump --ir`) reads back to the same IR: ir_print(), ir_read(). ir_verify() states every invariant.
//
// Passes append nodes and move Ir.root; what the scene no longer reaches stays in the array and is neither printed nor
// compiled. Growing moves the arrays: a pointer to a node or to operands is good until the next node is made.
#ifndef SCN_COMPILER_IR_H
#define SCN_COMPILER_IR_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "lang/arena.h"
#include "lang/source.h"

typedef uint32_t IrId; // index of a node; 0 is "none"

typedef enum IrOp {
    OP_NONE,
#define OP(id, name, operands, types, result) OP_##id,
#include "compiler/ops.def"
#undef OP
    OP_COUNT
} IrOp;

typedef enum IrType {
    IR_NONE,
    IR_SCALAR,
    IR_MATRIX,
    IR_FIELD,
    IR_PERTURBATION,
    IR_PATCH,
    IR_PART, // of a patch
    IR_MATERIAL,
    IR_CAMERA,
    IR_LIGHT,
    IR_BACKGROUND,
    IR_ASSERT
} IrType;

typedef enum IrRate { RATE_CONST, RATE_FRAME, RATE_POINT } IrRate;

typedef enum IrClass { CLASS_NONE, CLASS_QUADRIC, CLASS_FREEFORM, CLASS_SET, CLASS_GENERAL } IrClass;
// CLASS_SET: set operations of quadrics and free forms only.

// Nodes a side that a patch may have, how many operands OP_PATCH has, and how many of these are const, the first.
enum { PATCH_NODES_MIN = 5, PATCH_NODES_MAX = 257, PATCH_OPERANDS = 47, PATCH_CONSTS = 4 };

typedef enum LightKind { LIGHT_DIRECTIONAL, LIGHT_POINT, LIGHT_SPOT } LightKind;

// ops.def as a table.
enum { IR_ANY = 255 };
typedef struct IrOpInfo {
    const char *name, *types; // types: a letter for each operand, the last for all that follow
    uint8_t letters;          // of types
    uint8_t operands;         // IR_ANY: any number, at least as many as there are letters
    uint8_t result;           // IrType
} IrOpInfo;
extern const IrOpInfo ir_ops[OP_COUNT];
IrType ir_operand_type(IrOp op, uint32_t k); // of operand k

typedef struct IrNode {
    uint8_t op;        // IrOp
    uint8_t type;      // IrType
    uint8_t rate;      // IrRate
    uint8_t class : 7; // IrClass
    uint8_t moves : 1; // it is made of the time, the frame or handles, whatever else
    uint32_t count;    // operands
    uint32_t first;    // the first of them in Ir.operands
    Span span;         // where the scene says it
    union {
        double number;    // OP_CONST
        uint32_t index;   // OP_PARAM, OP_CAMERA, OP_LIGHT, OP_COEFFICIENT
        const char *text; // OP_NAMED, OP_ASSERT, OP_PATCH; outlives the IR
        uint64_t bits;    // all of it, for comparing
    };
} IrNode;

typedef enum ParamType {
    PARAM_BOOL,
    PARAM_INT,
    PARAM_STRING,
    PARAM_SCALAR,
    PARAM_ANGLE,
    PARAM_TIME,
    PARAM_VEC2,
    PARAM_VEC3,
    PARAM_COLOR
} ParamType;

typedef struct IrParam {
    const char *name, *doc; // doc may be NULL
    uint8_t type;           // ParamType
    bool structure;         // bool, int, string: a change compiles again
    bool ranged;            // low and high say the range
    uint32_t slot;          // first input slot of a handle (1, 2 or 3 of them)
    double value[3];        // default, in radians and seconds (structure: the value compiled with, if a number)
    double low, high;
    const char *text;           // PARAM_STRING
    const char *const *choices; // NULL-terminated, or NULL
    Span span;
} IrParam;

typedef struct Ir {
    Arena *arena;
    IrNode *nodes; // [1, count)
    uint32_t count, capacity;
    IrId *operands;
    uint32_t operand_count, operand_capacity;
    struct IrTable *table; // for hash-consing

    IrParam *params;
    uint32_t param_count, input_count; // input_count: slots of all handles

    // What the scene is.
    IrId root;       // field: the union of what is shown; OP_EMPTY where nothing is
    IrId camera;     // OP_CAMERA, always there
    IrId background; // OP_BACKGROUND, always there
    IrId *lights;
    uint32_t light_count;
    IrId *asserts; // of frame rate
    uint32_t assert_count;
    IrId *patches; // those that the root reaches, and those that were asked for; each with what acts on it
    uint32_t patch_count;
    double duration, fps; // animation: seconds (0: a still), frames a second
} Ir;

Ir *ir_new(Arena *arena);
// Room for so many nodes, which spares the copies of arrays that grow. Memory that is not used is not touched.
void ir_reserve(Ir *ir, uint32_t nodes);

// Makes a node from operands, typed by ops.def: rate and class follow from the operands. `operands` may not point into
// ir->operands.
//
// Folds scalars and matrices whose operands are const, PLACE and HEIGHT of a const field included; where folding has
// no finite value, the node stays as it is and ir_bad_fold() of it is true: the caller reports, with ir_complaint() as
// the reason. A transform by a const singular matrix is bad in the same way. What is bad because an operand already
// was is not bad itself, so that one mistake is one message.
//
// Lists that say nothing are simplified: UNION of none is EMPTY; UNION, INTERSECT, FREEFORM and DEFORM of one operand
// are that operand. So is MORPH where t is 0 or 1.
IrId ir_node(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count);
// The same for PARAM, CAMERA, LIGHT and COEFFICIENT, and for NAMED, ASSERT and PATCH.
IrId ir_node_index(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count, uint32_t index);
IrId ir_node_text(Ir *ir, IrOp op, Span span, const IrId *operands, uint32_t count, const char *text);

// A finite number. The second is not shared: for many that are hardly ever equal, such as folded coefficients.
IrId ir_const(Ir *ir, double value);
IrId ir_const_alone(Ir *ir, double value);
IrId ir_op1(Ir *ir, IrOp op, Span span, IrId a);
IrId ir_op2(Ir *ir, IrOp op, Span span, IrId a, IrId b);
IrId ir_op3(Ir *ir, IrOp op, Span span, IrId a, IrId b, IrId c);
bool ir_bad_fold(const Ir *ir, IrId id);
const char *ir_complaint(const Ir *ir, IrId id); // of a bad fold: "division by zero"
// The rate that an operand gives to the operation: its own; of a field that is asked about (PLACE, SURFACE, HEIGHT, AT,
// STEEPNESS) not that of its points, which are its own.
IrRate ir_operand_rate(const Ir *ir, IrOp op, IrId operand);

bool ir_is_const(const Ir *ir, IrId id, double *value);    // a folded scalar; value may be NULL
bool ir_const_matrix(const Ir *ir, IrId id, double m[12]); // a folded matrix
IrId ir_matrix(Ir *ir, Span span, const double m[12]);
IrId ir_entry(Ir *ir, Span span, IrId matrix, uint32_t k); // one of its twelve numbers

// Affine maps as scene authors write them; operands are scalars (angles in radians). `about` may be NULL: the origin.
IrId ir_move(Ir *ir, Span span, const IrId by[3]);
IrId ir_rotate_axis(Ir *ir, Span span, const IrId axis[3], IrId angle, const IrId about[3]); // axis of any length but 0
IrId ir_rotate_xyz(Ir *ir, Span span, const IrId angles[3], const IrId about[3]);            // about x, then y, then z
IrId ir_scale(Ir *ir, Span span, const IrId factors[3], const IrId about[3]);
IrId ir_shear(Ir *ir, Span span, const IrId xy_xz_yx_yz_zx_zy[6]);

static inline const IrNode *ir_at(const Ir *ir, IrId id)
{
    return &ir->nodes[id];
}
static inline const IrId *ir_operands(const Ir *ir, IrId id)
{
    return ir->operands + ir->nodes[id].first;
}
static inline IrId ir_operand(const Ir *ir, IrId id, uint32_t k)
{
    return ir->operands[ir->nodes[id].first + k];
}

// Marks what the scene reaches (root, camera, background, lights, asserts, patches and all below them): count flags in the
// scratch arena, by id.
bool *ir_reached(const Ir *ir, Arena *scratch);

// The text form: what the scene reaches, numbered from 1. ir_read returns NULL and fills `error` (a line number and a
// text) where the text is not IR. It takes any bytes. Spans are not part of the text.
typedef struct IrReadError {
    uint32_t line;
    char text[200];
} IrReadError;
void ir_print(const Ir *ir, FILE *out);
Ir *ir_read(Arena *arena, const char *text, size_t length, IrReadError *error);

// Returns NULL, or what is wrong (a text in the arena).
const char *ir_verify(const Ir *ir);

#endif
