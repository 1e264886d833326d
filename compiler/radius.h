// Offsets by a radius: the object whose F is at least 0 where the greatest F within the radius is (for a negative radius:
// where the least is). Solids grow by rounded edges and shrink from all sides.
//
// Exact where there is a closed form, with F of the same class: a quadric k |P X - m|² + c, where P is a projection, has
// another free term (balls, cylinders about any axis, slabs; what is outside of them), a half-space another offset. Any other
// quadric is a general field, F of which is the greatest in the ball (compiler/radius_quadric.h).
// Parts that grow are unions of what each part becomes; parts that shrink, intersections of that. An intersection of such
// parts at right angles, as boxes and cylinders of a height are, grows to
//
//     radius - sqrt(Σ max(dᵢ, 0)²) - min(max dᵢ, 0)        dᵢ: the distance to part i, negative inside
//
// which is a general field. Anything else has no closed form here.
#ifndef SCN_COMPILER_RADIUS_H
#define SCN_COMPILER_RADIUS_H

#include "compiler/ir.h"

typedef enum RadiusProblem {
    RADIUS_DONE,
    RADIUS_SHAPE,  // a free form, a general field, a morph; a quadric that moves and is not along the axes
    RADIUS_CORNER, // an intersection that grows or a union that shrinks
    RADIUS_MOVES,  // a map that moves and changes distances
    RADIUS_SIGN,   // several parts, and a radius whose sign is not known before the frame
    RADIUS_MANY    // too many parts
} RadiusProblem;

// What is known of a radius that is not: a thickness is greater than 0, whatever it is in a frame.
typedef enum RadiusSign { RADIUS_ANY, RADIUS_GROWS, RADIUS_SHRINKS } RadiusSign;

// The object offset by the radius, a scalar of frame rate at most. Its sign is known of a number and of a handle whose range
// is on one side of 0, and where the caller says so. Where there is a problem, `where` is the span of the
// part that has it.
IrId radius_offset(Ir *ir, IrId object, IrId radius, RadiusSign sign, RadiusProblem *problem, Span *where);

#endif
