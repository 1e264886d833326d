// What a ScnScene is inside: shared by the parts of the public API (scn.c, scn_render.c) and the commands that look
// into the compiler.
//
// A scene comes from source (then `unit` holds what the compiler said) or from a package; after loading both are a
// Package: a plan, a kernel, places, and binaries if there are any. Device, program, renderer and film are made when
// the first frame wants them and kept.
#ifndef SCN_RUNTIME_SCENE_H
#define SCN_RUNTIME_SCENE_H

#include <stdatomic.h>

#include "compiler/compile.h"
#include "compiler/frame.h"
#include "lang/unit.h"
#include "runtime/camera.h"
#include "runtime/device.h"
#include "runtime/film.h"
#include "runtime/package.h"
#include "runtime/program.h"
#include "runtime/renderer.h"
#include "runtime/sample.h"
#include "runtime/scn.h"

struct ScnScene {
    ScnStatus status;       // of loading
    Failure failure;        // of the last call that failed
    FrameError frame_error; // why the last frame that failed did, and …
    bool frame_wrong;       // … whether there is one
    Unit unit;              // its arena holds everything that loading made
    FileBytes file;         // a package's bytes, which its binaries point into
    bool is_package;
    Package *package;         // NULL where loading failed
    const Diag **diagnostics; // by place
    int diagnostic_count;
    CompileOptions compile_options; // what to dump while compiling
    char *printed;                  // by the scene; NULL: nothing
    char *diagnostics_text[2];      // plain and coloured, made when asked for

    // Copies of what the description said about rendering.
    char *device_choice;
    int threads, lanes;
    bool no_cache, quick;
    char *solver;      // of patches; NULL: not said
    char *checkpoints; // their folder; NULL: the cache

    double *inputs;                  // handles: plan->input_count
    double *values;                  // slots of the frame: plan->slot_count
    double camera[15];               // the automatic camera, placed for these inputs and …
    int camera_width, camera_height; // … this size; 0 0: not yet

    Device *device;
    Program *program;
    Renderer *renderer;
    struct ScenePatches *patches; // runtime/scene_patches.h; NULL: not needed so far
    Film *film;
    Samples *samples;
    int samples_n;
    bool frame_there; // the film holds a whole frame
    double frame_time;
    int frame_number;

    atomic_bool cancel;
    ScnStats stats;
};

// scn_load() that also writes the dumps that the options ask for.
ScnScene *scene_new(const ScnSceneDesc *desc, const CompileOptions *dumps);

// Sets the failure and returns the status.
ScnStatus scene_fail(ScnScene *scene, ScnStatus status, const char *format, ...) __attribute__((format(printf, 3, 4)));

// Sets the failure to what is wrong in a frame. Returns SCN_SCENE_WRONG.
ScnStatus scene_fail_frame(ScnScene *scene, const FrameError *error, double time, double frame);

// Parses or reads, and compiles; `scene->status` and diagnostics say how it went.
void scene_load(ScnScene *scene, const ScnSceneDesc *desc);

// "eye.scn:4:17" for a span of the plan, or "".
const char *scene_place(const ScnScene *scene, Span span, char *text, size_t size);

double scene_milliseconds(void);     // wall clock
double scene_cpu_milliseconds(void); // CPU time of the process

#endif
