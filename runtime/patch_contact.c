#include "runtime/patch_contact.h"

#include <math.h>

static double value_of(const double a[10], const double p[3])
{
    double x = p[0], y = p[1], z = p[2];
    return (a[0] * x + a[3] * y + a[6]) * x + (a[1] * y + a[5] * z + a[7]) * y + (a[2] * z + a[4] * x + a[8]) * z +
           a[9];
}

static void gradient_of(const double a[10], const double p[3], double gradient[3])
{
    double x = p[0], y = p[1], z = p[2];
    gradient[0] = 2 * a[0] * x + a[3] * y + a[4] * z + a[6];
    gradient[1] = 2 * a[1] * y + a[3] * x + a[5] * z + a[7];
    gradient[2] = 2 * a[2] * z + a[4] * x + a[5] * y + a[8];
}

// How far the surface is from a point inside in the direction n = −∇F/|∇F|: the smaller root of F − s |∇F| + s² nᵀAn,
// which is where that line leaves the solid. A line that never does is taken to leave where F is least.
static double depth_of(const double a[10], double f, const double gradient[3], double length)
{
    double x = gradient[0] / length, y = gradient[1] / length, z = gradient[2] / length;
    double bend = a[0] * x * x + a[1] * y * y + a[2] * z * z + a[3] * x * y + a[4] * x * z + a[5] * y * z;
    return 2 * f / (length + sqrt(fmax(0, length * length - 4 * bend * f)));
}

static void push(const PatchSolid *solid, const PatchTouch *touch, int node)
{
    double p[3] = {touch->x[0][node], touch->x[1][node], touch->x[2][node]};
    double f = value_of(solid->quadric, p);
    if (!(f > 0)) return;
    double gradient[3];
    gradient_of(solid->quadric, p, gradient);
    double length = sqrt(gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2]);
    // At a centre no way is out, and the neighbours pull the node.
    if (!(length > 0)) return;
    double force = solid->stiffness * depth_of(solid->quadric, f, gradient, length);
    for (int c = 0; c < 3; c++) touch->force[c][node] -= force * gradient[c] / length;
    touch->stiffness[node] += solid->stiffness;
}

void patch_contact_solids(void *context, const PatchTouch *touch)
{
    const PatchSolids *solids = context;
    for (int node = 0; node < touch->nodes * touch->nodes; node++)
        for (int s = 0; s < solids->count; s++) push(&solids->solids[s], touch, node);
}
