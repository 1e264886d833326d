// What the parts of elaboration share (elaborate.h is the entry; nothing else includes this).
//
//   elaborate.c           the scene: params, definitions, items of files, what is missing
//   elaborate_expr.c      expressions but calls
//   elaborate_block.c     blocks: values, loops, conditions, asserts, prints
//   elaborate_call.c      arguments, and calls of fn, tag and tool
//   elaborate_cases.c     match, and the cases of keys
//   elaborate_keys.c      keys: a value that goes through others as a driver grows
//   elaborate_morph.c     morphs of objects
//   elaborate_built.c     calls of what is built in: sets, perturbations, things
//   elaborate_modify.c    modifiers
//   elaborate_operation.c offsets, blends, warps
//   elaborate_patch.c     patches and their parts
//   elaborate_answer.c    answers about objects: places on surfaces
//   elaborate_math.c      functions of numbers, vectors, colors
//   elaborate_curves.c    splines, random numbers, noise
//   elaborate_report.c    where and why: the chain of calls, the chain of rates
#ifndef SCN_COMPILER_EVALUATOR_H
#define SCN_COMPILER_EVALUATOR_H

#include "compiler/elaborate.h"
#include "compiler/eval.h"
#include "compiler/program.h"
#include "compiler/value.h"

enum { CALLS_MAX = 1000, ITEMS_MAX = 10000000, BUILTIN_PARAMETERS_MAX = 16, ERRORS_MAX = 100, COMPLAINTS_MAX = 2000 };

// What perturbations act on: the first object of the freeform around, and the frame of the tool around.
typedef struct Forming {
    IrId object;
    IrId matrix; // of the tool's frame, in the object's coordinates; 0 outside of tools
} Forming;

// The value of a local name. A let is evaluated when it is first wanted, with what was being formed where it stands.
typedef struct Slot {
    Value value;
    const Forming *forming;
    bool pending;
} Slot;

typedef struct Frame { // a call of a fn, tag or tool
    const Call *call;
    const Node *node;
    struct Frame *outer;
    uint32_t base; // of its slots
    Span site;     // what was `site` where it was called
} Frame;

typedef struct Loop { // a turn of a for
    const Node *node;
    const Value *each;
    const struct Loop *outer;
} Loop;

typedef struct Print { // a line of `print`, sorted by the file's item that made it
    struct Print *next;
    uint32_t order, number;
    const char *text;
} Print;

typedef struct MorphSize MorphSize;

typedef struct Eval {
    Unit *unit;
    Program *program;
    Ir *ir;
    ElaborateOptions *options;
    Arena scratch; // values; released at the end
    Slot *slots;   // a stack of frames
    uint32_t slot_count, slot_capacity;
    uint32_t base; // of the current frame
    Frame *frame;  // NULL outside of calls
    const Forming *forming;
    const Loop *loop; // the innermost whose turn this is
    Scalar path;      // the conditions of frame rate under which this is evaluated; asserts hold under them
    Span site;        // inside of the prelude: the call in the scene; else nowhere
    uint32_t order;   // of the file's item that is evaluated
    double fps;
    uint64_t items;
    int calls;         // depth
    bool stop;         // a limit was met: everything unwinds
    bool trying;       // what nothing uses is being evaluated: no prints, no asserts
    const char *stack; // where evaluation began, and how far it may go from there
    size_t stack_size;
    Print *prints, **prints_end;
    int errors_before;
    int complaints;  // errors, the same ones again included
    Value animation; // of the scene, once it is known
    uint32_t assert_capacity;
    bool *asserted; // by node: this condition is tested already
    uint32_t asserted_capacity;
    MorphSize *morph_sizes; // by node (elaborate_morph.c)
    uint32_t morph_size_count, morph_size_capacity;
} Eval;

typedef struct List {
    Value *items;
    uint32_t count, capacity;
    const struct Cases *cases; // the block of keys or match whose cases are taken; else NULL
} List;

// --- elaborate.c
Value force(Eval *e, Symbol *symbol); // the value of a let or param, of the file or of the current frame
void slots_push(Eval *e, uint32_t count);
void slots_pop(Eval *e, uint32_t count);

// --- elaborate_expr.c
Value eval_expr(Eval *e, const Node *node);
Scalar scalar_op1(Eval *e, IrOp op, const Node *at, Scalar a);
Scalar scalar_op2(Eval *e, IrOp op, const Node *at, Scalar a, Scalar b);
Scalar scalar_select(Eval *e, const Node *at, Scalar condition, Scalar a, Scalar b);
IrId scalar_id(Eval *e, Scalar s);                         // the node; makes one of a constant
Span span_of(const Eval *e, const Node *node);             // where the scene says it
Scalar unit_interval(Eval *e, const Node *at, Scalar s);   // from 0 to 1: what is beyond is the nearer end
Value checked_int(Eval *e, const Node *node, Value value); // reports an int that is beyond 2^53
Value eval_equal(Eval *e, const Node *at, const Value *a, const Value *b);
Value join_sets(Eval *e, const Node *at, IrOp op, const IrId *ids, uint32_t count);

// --- elaborate_block.c
Value eval_block(Eval *e, const Node *block, Type want); // exactly one value
void eval_values(Eval *e, const Node *block, Type want, List *list,
                 bool opened); // any number, each as `want` (TYPE_ANY: as it is)
void open_lets(Eval *e, const Node *block);
Value eval_if(Eval *e, const Node *node, Type want);
void eval_for(Eval *e, const Node *node, Type want, List *list);
bool eval_item(Eval *e, const Node *item, Type want, List *list); // false: what follows makes no sense any more
void values_add(Eval *e, List *list, Value value, const Node *at);
void values_splice(Eval *e, List *list, Value value, Type want, const Node *at);
bool count_item(Eval *e, const Node *at); // false if there are too many
Value values_list(List list, Type element);
void add_assert(Eval *e, const Node *at, Scalar holds, const char *text);      // of frame rate: is tested in each frame
bool eval_condition(Eval *e, const Node *node, const char *what, bool *holds); // const; false after a report
Value select_value(Eval *e, const Node *at, Scalar condition, Value a, Value b);

// --- elaborate_call.c
Value eval_call(Eval *e, const Node *node, const Value *receiver);
Value eval_bound(Eval *e, const Node *node, const Call *call, uint32_t at, const Value *receiver);
const Node *bound_node(const Call *call, uint32_t at, const Node *call_node); // what to point at
Value builtin_default(Eval *e, const Parameter *p);
Value sum_objects(Eval *e, const Node *at, const List *list); // the union
Value sum_perturbations(Eval *e, const List *list);

// --- elaborate_answer.c
Value eval_membership(Eval *e, const Node *node, const Call *call, const Value *args);
Value eval_membership_member(Eval *e, const Node *node, const Value *membership);

// --- elaborate_curves.c
Value eval_spline(Eval *e, const Node *node, const Call *call, const Value *args);
Value eval_heading(Eval *e, const Node *node, const Call *call, const Value *args);
Value eval_random(Eval *e, const Node *node, const Call *call, const Value *args);
Value eval_noise(Eval *e, const Node *node, const Call *call, const Value *args); // noise, cells
Value eval_fbm(Eval *e, const Node *node, const Call *call, const Value *args);

// --- elaborate_morph.c
Value eval_morph(Eval *e, const Node *node, const Call *call, const Value *args);
IrId morph_objects(Eval *e, const Node *at, IrId a, IrId b, Scalar t); // t from 0 to 1; 0 after a report

// --- elaborate_cases.c, elaborate_keys.c
Value eval_match(Eval *e, const Node *node, const Call *call, const Value *args);
Value eval_keys(Eval *e, const Node *node, const Call *call, const Value *args);
typedef void EvalCase(Eval *e, const Node *item, void *whose);
void eval_case(Eval *e, const Node *item, const struct Cases *cases);
void each_case(Eval *e, const Node *node, EvalCase *each, void *whose); // in the order of the text, loops unrolled

// --- elaborate_built.c, elaborate_modify.c, elaborate_math.c
Value eval_builtin(Eval *e, const Node *node, const Call *call, const Value *receiver);
Value eval_modifier(Eval *e, const Node *node, const Call *call, const Value *args);
Value eval_function(Eval *e, const Node *node, const Call *call, const Value *args);
// A const argument between two bounds, the lower one excluded if `above`. What is not known yet is tested in each frame.
void test_bounds(Eval *e, const Node *at, Scalar s, double low, bool above, double high, const char *what);
Value default_camera(Eval *e);
Value default_background(Eval *e);
void default_lights(Eval *e, List *lights);
IrId transform_parts(Eval *e, const Node *at, IrOp op, IrId part, IrId matrix);

// --- elaborate_repeat.c
Value eval_endless(Eval *e, const Node *node, IrId object, const Value *step); // repeat without a count

// --- elaborate_operation.c
Value eval_operation(Eval *e, const Node *node, const Call *call,
                     const Value *args);                                          // offset, shell, twist, …, attract
Value eval_blend(Eval *e, const Node *node, const Call *call, const Value *args); // of a set with a width or a style
bool knows_expression(Eval *e, const Node *at, Scalar s); // false after a report: F cannot be made of it
bool takes_points(uint16_t builtin, uint32_t argument);   // whether an argument of an operation may be of point rate

// --- elaborate_patch.c
Value eval_patch_thing(Eval *e, const Node *node, const Call *call, const Value *args);
Value eval_pressed_by(Eval *e, const Node *node, const Call *call, const Value *receiver); // what presses a patch
bool patch_takes_points(uint16_t builtin, uint32_t argument); // whether an argument may be of point rate
IrId sheet_patch(const Ir *ir, IrId sheet);
void name_patch(Eval *e, IrId sheet, const char *name);
void collect_patches(Eval *e); // into the IR, when all that is shown is evaluated

// --- elaborate_answer.c
Value eval_surface(Eval *e, const Node *node, const Call *call, const Value *args);
Value eval_place_member(Eval *e, const Node *node, const Value *place);
IrId formed_object(Eval *e, const Node *at); // what is being formed, as the frame around sees it

// --- elaborate_report.c
Diag *complain(Eval *e, const Node *at, DiagCode code, const char *format, ...) __attribute__((format(printf, 4, 5)));
const Node *blame(const Eval *e, const Node *at); // inside of the prelude: the argument in the scene that it comes from
void report_rate(Eval *e, const Node *at, DiagCode code, const char *what); // shape-rate, point-rate, with the chain
bool want_const(Eval *e, const Node *at, Scalar s, const char *what, double *number);
bool at_point(const Eval *e, Scalar s); // of point rate

#endif
