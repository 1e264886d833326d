// What the host (runtime/view.c, runtime/renderer.c) and the kernels share: the layout of every buffer.
//
// The same text is compiled by both sides, so it uses only float and unsigned (32 bits each on both). Structs are made of
// members of 4 bytes; their sizes are asserted in runtime/renderer.c.
//
// Views. A view is a projective frame: the place X of screen coordinates (U, V, w), in the scene's world, is
//
//     X = O + unit (U r + V s + w f) / W,   W = 1 - kappa w
//
// with O its origin, r, s, f unit vectors at right angles (f along the rays) and kappa the inverse distance, in units, of the eye before O. So rays are
// parallel to the w axis in screen coordinates, whatever the view: kappa = 0 for orthographic cameras and directional lights; for a perspective one the
// eye is at w = -infinity and infinity at w = 1/kappa. Quadrics stay quadrics:  W² Q(X) = lead w² - 2 beta(U, V) w + q(U, V)  with a constant lead.
#ifndef SCN_KERNELS_SHARED_H
#define SCN_KERNELS_SHARED_H

#define TILE_SIZE 32     // pixels, square
#define TILE_PIXELS 1024

// A quadric seen in a view. The numbers mean one of three things:
//   by its middle, du = U - uc, dv = V - vc:
//     W² Q = lead ((w - tm)² - h2),  tm = t0 + tu du + tv dv,  h2 = h0 + du (d + a du + b dv) + dv (e + c dv)
//     where (uc, vc) is the centre of the conic h2 = 0 and d = e = 0 (RECORD_CENTRED), or, where it has none that is near (slabs, cylinders), 0 0
//   general, where the middle or its root would be too large for floats (planes, very large quadrics, the eye on the surface):
//     W² Q = lead w² - 2 beta w + q,  beta = t0 + tu U + tv V,  q = h0 + U (d + a U + b V) + V (e + c V)
//   by planes, of leaves that are slabs and half-spaces: where a ray meets a plane depends on the plane alone, so what they share they share exactly
//     W² Q = lead (w - p) (w - q),  p = t0 + tu U + tv V,  q = h0 + d U + e V;  of a half-space  W² Q = lead (w - p) W,  a = kappa
// The roots in w do not depend on a factor of Q. In a leaf the factor is free; in a perturbation it is cbrt(strength / factor of the base), with its sign.
typedef struct QuadricRecord {
    float uc, vc, h0, a, b, c;
    float t0, tu, tv;
    float lead;
    unsigned flags;
    float d, e;
    float w_low; // of a perturbation: its support begins behind this
    float spare[2];
} QuadricRecord;

#define RECORD_GENERAL 1u // the second form
#define RECORD_OUTSIDE 2u // Q >= 0 outside the roots, not between them
#define RECORD_SIGNED 4u  // a free form's base: some perturbation has a negative strength
#define RECORD_GROWS 8u   // a free form's base: some perturbation has a positive strength
#define RECORD_CENTRED 16u
#define RECORD_PLANES 32u // the third form
#define RECORD_HALF 64u   // of a half-space
#define RECORD_STRONG 256u // a free form's base: some perturbation is so much stronger that the polynomials of pieces lose digits
#define RECORD_STEEP 128u // its planes are met too far away for their middle to be a float's

// A patch that lifts a free form (compiler/plan.h): its frame's coordinates x, y, z are, times W, (a U + b V + c w + d) of these fours.
typedef struct LiftRecord {
    float x[4], y[4], z[4];
    float low, high; // of z
    float cells;     // a side
    float spare;
} LiftRecord;

// A bicubic cell of a lift: its Bezier points, times strength and the factor of the base, point (k, l) at 4 k + l.
typedef struct CellRecord {
    float points[16];
} CellRecord;

// Where it acts, in z of the lift's frame: beyond it F has the sign of the base. Behind its points; low > high: nowhere.
typedef struct CellBand {
    float low, high;
    float least, most; // of its points
    float spare[12];
} CellBand;

#define LIFT_RECORDS 2 // of a cell of a lift
// A bicubic cell of a sheet takes three of them: x, y, z of the view's p (ViewConstants.map).
#define SHEET_RECORDS 3

// A patch of a thickness: the map from a view to the patch's own coordinates about the middle of the patch, which are, times W, (a U + b V + c w + d) of these
// fours. Behind its number come its cells, in those coordinates.
typedef struct ThickRecord {
    float x[4], y[4], z[4];
    float radius; // half the thickness
    float side;   // 1: what is within it of the patch; -1: what is not; 0: all of space
    float size;   // of the patch, for what floats can tell
    float spare;
} ThickRecord;

// Behind the three records of a cell: the box around it, with axes of its own.
typedef struct ThickShape {
    float middle[3], e[3], f[3], n[3], extent[3];
    float spare;
} ThickShape;
#define THICK_RECORDS 4 // of a cell

// Clusters: perturbations that many free forms share, in coordinates of their own, in doubles. Where a device has these (HAS_COPIES) a copy of a cluster is a
// header among the perturbations of its leaf, an empty one, behind which stands a CopyRecord; whatever list has the header gets records of those of the
// cluster's parts that matter there (copies.cl). Elsewhere copies are folded part by part, as other perturbations are.
#if defined(HAS_COPIES) || !defined(__OPENCL_C_VERSION__)
typedef struct ClusterPart {
    double q[10];
    float middle[3];
    float root;      // the cube root of its strength, with its sign; 0: there is nothing
    float extent[6]; // xx yy zz xy xz yz: along a direction n its support reaches sqrt(n extent n) from its middle; xx infinite: without an end
    float spare[2];
} ClusterPart;

typedef struct CopyRecord {
    double columns[16]; // homogeneous places of the cluster from (U, V, w, 1) of the view: of each of these a column
    float rows[12];     // from places of the cluster to (U, V, w) / W of the view: three rows of four
    float root;         // of the factor of its parts' records: the cube root of its strength over the base's factor
    unsigned first, count; // parts
    float spare;
} CopyRecord;
#endif
#define COPY_RECORDS 3 // behind a header
#define PART_RECORDS 2 // all parts stand before the records of views

// Numbers of the plan. All leaves and perturbations have one number each, in prefix order: a component's first leaf, that leaf's
// perturbations (or, if it is a group, that group's components), its second leaf … A component is named by the number of its first leaf.
typedef struct PlanNode {
    unsigned end;      // first number after this leaf and all that belongs to it
    unsigned shape;    // of the component that begins here
    unsigned after;    // first number after the component that begins here
    unsigned material, object;
    unsigned rank;     // among the leaves, as the scene says them: what packets keep of a leaf, so the lower wins by min()
    unsigned leaf;     // not of this number: the leaf whose rank this index is
    unsigned count;    // of perturbations, with NODE_LIFTED, NODE_SHEET or NODE_THICK where cells follow; NODE_FIELD: it is a general field
} PlanNode;
#define NODE_FIELD 0xffffffffu

// Behind the perturbations of a lifted free form come, for each of its lifts, a LiftRecord and its cells, row by row; behind a
// sheet's number, thick or not, its cells. Of a cell's node `shape` is the number of its LiftRecord or sheet, `material` and `object` are its place along u and v.
#define NODE_LIFTED 0x80000000u
#define NODE_SHEET 0x40000000u
#define NODE_THICK 0x20000000u
#define NODE_COPIES 0x10000000u // of a free form: headers of copies follow its perturbations; alone: of a header
#define NODE_COUNT 0x0fffffffu

// Items are what tiles choose from: components and perturbations, in ascending order of their numbers, which follow
// space where that is free (runtime/spatial.h). The box of an item in a view is where it can
// matter: outside of it a component of a union is empty, one of an intersection everything, a perturbation 0. Arrays of item_stride floats each:
#define BOX_U_LOW 0
#define BOX_U_HIGH 1
#define BOX_V_LOW 2
#define BOX_V_HIGH 3
#define BOX_W_LOW 4
#define BOX_ARRAYS 5
#define ITEM_STEP 16 // item_stride is a multiple of it; the rest is filled with empty boxes

// Behind the boxes of a view's items stand those of blocks of ITEM_STEP items each, and behind them those of blocks of ITEM_STEP blocks, each in arrays of
// their own stride: a block's box is around those of all that is in it.
#define BLOCKS_OF(count) (((count) + ITEM_STEP - 1) / ITEM_STEP)
#define STRIDE_OF(count) (((count) + ITEM_STEP) / ITEM_STEP * ITEM_STEP)
#define BOX_FLOATS(items) (BOX_ARRAYS * (STRIDE_OF(items) + STRIDE_OF(BLOCKS_OF(items)) + STRIDE_OF(BLOCKS_OF(BLOCKS_OF(items)))))

typedef struct ViewConstants {
    float kappa;
    float start;       // first w of the rays; -infinity where they come from the eye or from infinitely far
    float limit;       // w beyond which nothing is seen
    unsigned faced;    // 1: one of six views around a point, that sees a square cone of 90 degrees
    unsigned first_record; // of the view
    unsigned first_box;    // of the view, in floats
    float unit_distance;   // 1/kappa; 0 for parallel views
    float map[12];     // from the primary view's p = (U, V, w) / W to this one's, before division: three rows of four
} ViewConstants;

typedef struct LightConstants {
    float color[3];
    float at[3];       // directional: towards the light, unit length; point: its place; in the primary view's p
    unsigned point;    // 1: a point light
    unsigned shadow;
    float fade;        // of a point light: its light is divided by 1 + fade d^2, d in units
    float axis[3];     // of a spot: the way its light travels, in the primary view's axes
    float rim, rise;   // c the cosine of the angle to the axis: smooth((c - rim) rise) of the light; everywhere 1 with rim -2 and rise 1
    unsigned first_view, view_count;
} LightConstants;

typedef struct MaterialConstants {
    float color[3];
    float ambient, diffuse, specular, shininess, emission;
    float dull; // a cosine up to this one gives no highlight that a float could show
} MaterialConstants;

typedef struct FrameConstants {
    int width, height;
    int tiles_across;
    unsigned tiles_down;
    unsigned layers;    // LAYER_ bits
    float u0, v0;       // U, V of the left upper corner of the picture
    float du, dv;       // a pixel's step
    unsigned item_count, item_stride, light_count;
    unsigned leaf_count;    // that rays can hit
    unsigned list_capacity; // items in the list of a tile
    unsigned slot_size;     // of a tile's lists, in unsigneds
    unsigned field_offset;  // in the slot: memory for general fields
    unsigned tape_longest;  // steps of a tape
    unsigned tape_pool;     // steps of the shortened tapes of a tile, or region
    unsigned regions_across; // 0: there are none
    unsigned region_fields;  // that a region has room for
    unsigned region_size;    // in unsigneds
    unsigned region_first;   // in the tiles' memory: where the first one's is, in slots
    float bias;         // shadow rays begin this far off the surface, in units
    float orthographic; // 1: w - start is the depth
    float unit;         // world length of one unit
    float origin[3];    // world place of the primary view's O
    float axes[9];      // r, s, f of the primary view
    float background[3];
    unsigned copy_first; // where the records begin that lists make of copies: list_capacity for each tile of a band
} FrameConstants;

#define LAYER_COLOR 1u
#define LAYER_DEPTH 2u
#define LAYER_NORMAL 4u
#define LAYER_POSITION 8u
#define LAYER_ID 16u
#define LAYER_CERTIFICATE 32u

// Counters that the kernel gives back.
#define COUNTER_LIST 0  // longest list that a tile wanted
#define COUNTER_UNCERTAIN 1 // pixels whose first surface is not certified
#define COUNTER_SHADOWS 2   // rays from what is seen to lights, modulo 2^32 …
#define COUNTER_SHADOWS_HIGH 3 // … and how often 2^32
#define COUNTER_TILES 4   // that work-items have taken
#define COUNTER_REGIONS 5
#define COUNTER_COUNT 6

// Memory of a tile for general fields, in unsigneds: a table of fields (cells.cl), scratch, and shortened tapes. `lanes`: rays of all work-items together.
// Scratch are the values of one evaluation for each work-item and, with packets, what is chosen in each step and who needs it.
#define FIELD_TABLE 10240
#define FIELD_VALUE 4u // numbers of a value in an evaluation, at most, for each ray
#define FIELD_SCRATCH(longest, lanes) (((longest) + 4u) * (FIELD_VALUE * (lanes) + 4u))
#define FIELD_ROOM(longest, pool, lanes) ((FIELD_TABLE + FIELD_SCRATCH(longest, lanes) + 2u * (pool) + 31u) & ~31u)

// Regions (cells.cl) of REGION_TILES x REGION_TILES tiles: a table of up to `fields` fields and shortened tapes.
#define REGION_TILES 4
#define REGION_HEAD 2
#define REGION_FIELD 4168
#define REGION_ROOM(fields, pool) ((REGION_HEAD + (fields) * REGION_FIELD + 2u * (pool) + 31u) & ~31u)
#define STAGE_REGIONS 16u // the kernel's stage that makes them: its work-items are regions

#endif
