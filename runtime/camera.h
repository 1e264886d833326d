// The camera of scenes that have none, or one without an eye: it frames the scene's bounds.
//
// The eye stands in a direction from the middle of a box, as near as the whole box is seen with a margin.
#ifndef SCN_RUNTIME_CAMERA_H
#define SCN_RUNTIME_CAMERA_H

#include <stdbool.h>

typedef struct Box {
    double low[3], high[3]; // low > high: empty; infinite where something has no end
} Box;

// Makes `into` hold `box` too. Sides without an end do not count.
void box_join(Box *into, const Box *box);

// Places the camera whose fifteen values are those of OP_CAMERA (compiler/ops.def): its eye holds the direction in
// which it is to stand, 0 0 0 for the usual one. Eye, look_at, up (where it lies along the view), and height of an
// orthographic camera are filled in. `aspect` is width / height. An empty or endless box is taken for the cube -1 …
// 1.
void camera_frame(double values[15], bool orthographic, const Box *box, double aspect);

// The directions of a camera that has its eye: `back` goes from what it looks at to the eye.
typedef struct CameraAxes {
    double right[3], up[3], back[3]; // unit
} CameraAxes;
void camera_axes(const double values[15], CameraAxes *axes);

#endif
