#include "runtime/camera.h"

#include <math.h>
#include <string.h>

#define MARGIN 1.04 // of the picture around the box

// A little from the right and from above: three faces of a cube are seen, the front most.
static const double usual_direction[3] = {0.48, 0.36, 0.8};

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double result[3])
{
    result[0] = a[1] * b[2] - a[2] * b[1];
    result[1] = a[2] * b[0] - a[0] * b[2];
    result[2] = a[0] * b[1] - a[1] * b[0];
}

static bool normalize(double v[3])
{
    double length = sqrt(dot(v, v));
    if (!(length > 0) || !isfinite(length)) return false;
    for (int c = 0; c < 3; c++) v[c] /= length;
    return true;
}

void box_join(Box *into, const Box *box)
{
    for (int c = 0; c < 3; c++) {
        if (isfinite(box->low[c])) into->low[c] = fmin(into->low[c], box->low[c]);
        if (isfinite(box->high[c])) into->high[c] = fmax(into->high[c], box->high[c]);
    }
}

// Half sizes and middle of a box that can be looked at: a side that is missing is as long as the longest of the others.
static void usable_box(const Box *box, double middle[3], double half[3])
{
    double longest = 0;
    bool there[3];
    for (int c = 0; c < 3; c++) {
        there[c] = isfinite(box->low[c]) && isfinite(box->high[c]) && box->low[c] <= box->high[c];
        if (there[c]) longest = fmax(longest, (box->high[c] - box->low[c]) / 2);
    }
    if (!(longest > 0)) longest = 1;
    for (int c = 0; c < 3; c++) {
        middle[c] = there[c] ? (box->low[c] + box->high[c]) / 2 : 0;
        half[c] = there[c] ? (box->high[c] - box->low[c]) / 2 : longest;
    }
}

void camera_axes(const double values[15], CameraAxes *axes)
{
    for (int c = 0; c < 3; c++) axes->back[c] = values[c] - values[3 + c];
    normalize(axes->back);
    cross(values + 6, axes->back, axes->right);
    normalize(axes->right);
    cross(axes->back, axes->right, axes->up);
}

// The same for a camera whose eye is a direction yet.
static void make_axes(double values[15], CameraAxes *axes)
{
    memcpy(axes->back, values, sizeof axes->back);
    if (!normalize(axes->back)) {
        memcpy(axes->back, usual_direction, sizeof axes->back);
        normalize(axes->back);
    }
    cross(values + 6, axes->back, axes->right);
    if (dot(axes->right, axes->right) < 1e-12 * dot(values + 6, values + 6) || !normalize(axes->right)) {
        // Seen from straight above or below: the far side is up.
        double other[3] = {0, 0, fabs(axes->back[2]) < 0.9 ? -1 : 0};
        if (other[2] == 0) other[1] = 1;
        memcpy(values + 6, other, sizeof other);
        cross(other, axes->back, axes->right);
        normalize(axes->right);
    }
    cross(axes->back, axes->right, axes->up);
}

void camera_frame(double values[15], bool orthographic, const Box *box, double aspect)
{
    double middle[3], half[3];
    usable_box(box, middle, half);
    CameraAxes axes;
    make_axes(values, &axes);

    double vertical = tan(values[9] / 2), horizontal = vertical * aspect, distance = 0, height = 0;
    for (int corner = 0; corner < 8; corner++) {
        double p[3];
        for (int c = 0; c < 3; c++) p[c] = corner >> c & 1 ? half[c] : -half[c];
        double x = fabs(dot(p, axes.right)), y = fabs(dot(p, axes.up)), nearer = dot(p, axes.back);
        distance = fmax(distance, nearer + MARGIN * fmax(x / horizontal, y / vertical));
        height = fmax(height, 2 * MARGIN * fmax(y, x / aspect));
    }
    if (orthographic) {
        values[10] = height;
        distance = 2 * sqrt(dot(half, half));
    }
    for (int c = 0; c < 3; c++) {
        values[c] = middle[c] + distance * axes.back[c];
        values[3 + c] = middle[c];
    }
}
