// The truth for tests: a plain scalar renderer in double that shares nothing with the passes and the kernels.
//
// It reads the IR as elaboration leaves it, before any pass, evaluates the frame itself, and keeps every leaf in its own coordinates
// (rays are moved to leaves; no coefficient is ever folded), so a mistake in a pass cannot hide by being made twice.
//
//     char why[ORACLE_ERROR];
//     Oracle *oracle = oracle_new(ir, &(OracleFrame){.time = 1.5}, why);
//     OracleRay ray = oracle_camera_ray(oracle, x, y, width, height);
//     OracleHit hit;
//     if (oracle_hit(oracle, &ray, &hit)) …
//     oracle_free(oracle);
//
// Two ways to meet a ray:
//
//   oracle_hit()            exact: every quadric's interval, every root of every polynomial piece isolated through its derivatives, then
//                           the sign of the whole tree between neighbouring roots. The truth for the property tests.
//   oracle_reference_hit()  what a plain program does: intervals of the quadrics, sorted, sampled between and bisected. The yardstick of the
//                           benchmark, and a second opinion on the first. `samples` a piece: 8 … 16 as a yardstick, 4000 as a judge.
//
// Lengths are the scene's, angles radians, times seconds. Colours are linear light.
#ifndef SCN_TESTS_ORACLE_H
#define SCN_TESTS_ORACLE_H

#include <stdbool.h>
#include <stdint.h>

#include "compiler/ir.h"
#include "lang/arena.h"

#define ORACLE_ERROR    240
#define ORACLE_INFINITY 1e300 // |F| of the empty set and of its complement

typedef struct OracleMap { // world to local, three rows of four
    double m[12];
    bool identity;
} OracleMap;

typedef struct OracleQuadric {
    double a[10]; // A11 A22 A33 A12 A13 A23 A14 A24 A34 A44, in its own coordinates
    OracleMap map;
} OracleQuadric;

typedef struct OraclePerturbation { // strength · max(Q, 0)³
    OracleQuadric quadric;          // `grow` is in its free term
    double strength;
} OraclePerturbation;

typedef struct OracleBase { // weight · Q, or weight · F of a general field
    OracleQuadric quadric;
    struct OracleExpression *field; // instead of the quadric's numbers; NULL: it is one
    double weight;
} OracleBase;

typedef struct OracleLeaf {
    uint32_t first_base, base_count; // their sum: one of weight 1, or of a morph one for each of what is morphed
    uint32_t field_count;            // of the bases that are general fields
    uint32_t guards[4], guard_count; // if there are any: quadrics outside of which the leaf does not matter
    uint32_t first, count;           // perturbations
    double material[11];             // as OP_MATERIAL
    const char *object;              // outermost name, "" without one
} OracleLeaf;

typedef enum OracleKind { ORACLE_LEAF, ORACLE_EMPTY, ORACLE_UNION, ORACLE_INTERSECT, ORACLE_NOT } OracleKind;

typedef struct OracleNode { // in prefix order: a node is followed by its children
    uint32_t kind;
    uint32_t leaf;  // ORACLE_LEAF
    uint32_t after; // index behind the last node of this subtree
} OracleNode;

typedef struct OracleLight {
    int kind; // LightKind
    double v[14];
} OracleLight;

typedef struct OracleFrame {
    double time, frame;
    const double *inputs; // ir->input_count handle values; NULL: the defaults
} OracleFrame;

typedef struct Oracle {
    Arena arena;
    const Ir *ir;
    double *scalars;    // by node
    double (*maps)[12]; // by node, of type matrix (shared array of node count; others unused)
    OracleNode *nodes;
    uint32_t node_count, node_capacity;
    OracleLeaf *leaves;
    uint32_t leaf_count, leaf_capacity;
    OracleBase *bases;
    uint32_t base_count, base_capacity;
    OraclePerturbation *perturbations;
    uint32_t perturbation_count, perturbation_capacity;
    OracleLight *lights;
    uint32_t light_count;
    double camera[15];
    bool orthographic;
    double background[3];
    double bound[4]; // ball that holds the surface for the plain reference: centre, radius; radius 0: not known
    struct OracleExpression *expressions; // all of them
    struct OracleScratch *scratch;        // of the exact way
    struct OraclePlain *plain;            // of the plain one
} Oracle;

typedef struct OracleRay {
    double origin[3], direction[3]; // of length 1 where distances are wanted
    double near, far;
} OracleRay;

typedef struct OracleHit {
    double t;
    bool leaving;               // the ray began inside, this is where it comes out
    uint32_t leaf;              // the leaf that decides, the first of equals
    uint32_t ties;              // how many further leaves vanish at the same place
    double point[3], normal[3]; // of length 1, towards the viewer: outward, or inward where the ray comes from inside
} OracleHit;

// Returns NULL and says why where a value is not finite, a matrix singular or an operation has no plain meaning here.
// `ir` must outlive the oracle.
Oracle *oracle_new(const Ir *ir, const OracleFrame *frame, char why[ORACLE_ERROR]);
void oracle_free(Oracle *oracle);

// F and, unless NULL, its gradient at a point of the world, straight from the tree of leaves.
double oracle_field(const Oracle *oracle, const double point[3], double gradient[3]);
double oracle_leaf_field(const Oracle *oracle, uint32_t leaf, const double point[3], double gradient[3]);

// F of any field of the IR at a point, by recursion over the IR and nothing else.
double oracle_ir_field(const Oracle *oracle, IrId field, const double point[3], double gradient[3]);

bool oracle_hit(Oracle *oracle, const OracleRay *ray, OracleHit *hit);
// Does the ray's span meet a surface? From outside that is: is any of it inside. What begins inside and stays there is not blocked, so a light and an eye in
// the same object see each other's side of its surface.
bool oracle_blocked(Oracle *oracle, const OracleRay *ray);

bool oracle_reference_hit(Oracle *oracle, const OracleRay *ray, int samples, OracleHit *hit);
bool oracle_reference_blocked(Oracle *oracle, const OracleRay *ray, int samples);

// The ray through the pixel coordinates (x, y): (0, 0) is the upper left corner of the picture, (width, height) the lower right one.
OracleRay oracle_camera_ray(const Oracle *oracle, double x, double y, double width, double height);

// The shading formula at a hit; samples 0 asks the exact way for shadows, else the plain one with that many samples. `bias` is how far shadow rays
// start from the surface.
void oracle_shade(Oracle *oracle, const OracleRay *ray, const OracleHit *hit, int samples, double bias,
                  double color[3]);

// The ray from a surface point to a light, begun `bias` along the normal. False where the light does not reach that side.
bool oracle_light_ray(const Oracle *oracle, const OracleLight *light, const double point[3], const double normal[3],
                      double bias, OracleRay *ray);

// The share of a light that reaches a point where nothing is in the way: what fading and a spot's cone leave.
double oracle_light_part(const OracleLight *light, const double point[3]);

// Every stride-th pixel of every stride-th line of a width × height picture, as width/stride × height/stride × 3 floats into
// `rgb`. `samples` as above.
void oracle_render(Oracle *oracle, int width, int height, int stride, int samples, double bias, float *rgb);

#endif
