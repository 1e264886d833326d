// libscn: load a scene or a package, move its parameters, render frames into memory or files.
//
//     ScnScene *scene = scn_load(&(ScnSceneDesc){.path = "eye.scn"});
//     float *pixels = malloc(640 * 480 * 4 * sizeof *pixels);
//     if (scn_render(scene, &(ScnFrameDesc){.width = 640, .height = 480, .color = pixels}) != SCN_OK)
//         fprintf(stderr, "%s\n", scn_error(scene));
//     scn_free(scene);
//
// Descriptions are structs of which a field left out means its default; handles are opaque. Nothing is printed: what
// there is to say is asked for. tests/example/render_example.c is a whole program.
//
// Errors. scn_load() always returns a scene, and scn_status() says whether it can be used; once that is
// SCN_SCENE_WRONG or SCN_WORLD_FAILED it stays so. Other functions return a status, and scn_error() has the text of
// the last one that was not SCN_OK. What the compiler found is in scn_diagnostic(), with places.
//
// Threads. A scene is used by one thread at a time; only scn_cancel() may be called from any thread (and from a
// signal handler) at any moment between scn_load() and scn_free(). Different scenes can be used by different threads.
// The first scn_load(), scn_render() or scn_devices() of a process sets environment variables for the OpenCL driver
// and should come before other threads read them; the number of threads of a processor device is that of the first
// scene that renders (the driver starts its threads once).
//
// Memory. Texts belong to the scene and live until the next call with it, unless said otherwise. Running out of
// memory while compiling ends the process with status 3; running out of device memory or image memory is an error.
#ifndef SCN_H
#define SCN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define SCN_API __attribute__((visibility("default")))
#else
#define SCN_API
#endif

typedef struct ScnScene ScnScene;

// The command's exit statuses follow these (SCN_CANCELLED is 130 there).
typedef enum ScnStatus {
    SCN_OK = 0,
    SCN_SCENE_WRONG = 1,  // the scene, or a value that a frame computes
    SCN_CALL_WRONG = 2,   // an argument of the call
    SCN_WORLD_FAILED = 3, // a file, a device, memory
    SCN_CANCELLED = 4,
} ScnStatus;

typedef struct ScnSetting { // of a param; see scn_set_text()
    const char *name, *value;
} ScnSetting;

typedef struct ScnSceneDesc {
    const char *path;  // a scene (.scn) or a package (.scnk), told apart by their first bytes; "-" is standard input
    const void *bytes; // instead of reading the file; copied. `path` is then what it is called
    size_t size;
    const char *const *include_paths; // for `include` and `use`, in order
    int include_path_count;
    const char *search_path;    // for `use`, ':' between folders; NULL: $SCN_PATH
    const ScnSetting *settings; // params, as scn_set_text(); bool, int and string params can only be set here
    int setting_count;
    const char *camera; // the name of a camera of the scene; NULL: the first
    const char *only;   // the name of the objects that are shown, hidden ones too; NULL: all that the scene shows
    bool strict;        // warnings are errors
    const char *const *warnings; // as -W of the command: "no-unused", "error=shadow", "error"; later ones win
    int warning_count;
    const char *device; // "cpu", "gpu", a number of scn_devices(), part of a name; NULL: the first GPU, else CPU
    int threads;        // of a CPU; 0: all
    int lanes;          // rays that a work-item follows: 1 or 16; 0: as the device likes it
    bool check_only;    // only for its diagnostics: also looks at what nothing uses, and makes no kernels
    bool no_cache;      // neither reads nor writes the cache of compiled kernels and of patches
    const char
        *solver; // of patches: "device", "direct", "gauss-seidel"; NULL: the device, and direct what it does not know
    const char *checkpoints; // a folder for those of patches, read and filled, with no_cache too; NULL: the cache
    bool quick; // kernels that are built sooner and run slower, for a few pictures; those that are ready are taken
} ScnSceneDesc;

// Reads and compiles. No device is opened yet, so this works without any. NULL only where there is no memory for the
// handle.
SCN_API ScnScene *scn_load(const ScnSceneDesc *desc);
SCN_API void scn_free(ScnScene *scene); // NULL is nothing

SCN_API ScnStatus scn_status(const ScnScene *scene);

// What failed, for people: one line without a full stop; "" where all went well.
SCN_API const char *scn_error(const ScnScene *scene);

// --- what the compiler says

typedef struct ScnDiagnostic {
    const char *severity; // "error", "warning", "note"
    const char *code;     // "angle-unit"
    const char *text;
    const char *path;              // NULL: no place
    uint32_t line, column;         // from 1; columns are code points
    uint32_t end_line, end_column; // behind the last character
} ScnDiagnostic;

// A further place that has to do with a diagnostic, or how the text got there: by an include, a call, a loop.
typedef struct ScnDiagnosticNote {
    const char *text, *path; // path: NULL: no place
    uint32_t line, column, end_line, end_column;
} ScnDiagnosticNote;

// How sure a fix is: what was meant, for certain; most likely; a guess that needs a look.
typedef enum ScnConfidence { SCN_FIX_SURE, SCN_FIX_LIKELY, SCN_FIX_GUESS } ScnConfidence;

typedef struct ScnFix { // replaces what stands from line:column to before end_line:end_column
    ScnConfidence confidence;
    const char *replacement, *path;
    uint32_t line, column, end_line, end_column;
} ScnFix;

// By place. False: there is none with that index.
SCN_API int scn_diagnostic_count(const ScnScene *scene);
SCN_API bool scn_diagnostic(const ScnScene *scene, int index, ScnDiagnostic *diagnostic);
SCN_API bool scn_diagnostic_note(const ScnScene *scene, int index, int note, ScnDiagnosticNote *found);
SCN_API bool scn_diagnostic_fix(const ScnScene *scene, int index, int fix, ScnFix *found);

// Why scn_render() was SCN_SCENE_WRONG the last time it was: what is wrong in that frame. False: it never was. The text lives until the
// next such frame. A package knows where it begins and not where it ends.
SCN_API bool scn_frame_diagnostic(const ScnScene *scene, ScnDiagnostic *diagnostic);

// All of them as the command prints them: with source lines, carets and fixes. "" if there are none. The text lives
// as long as the scene.
SCN_API const char *scn_diagnostics_text(ScnScene *scene, bool color);

// What `print` in the scene wrote while it was compiled, or "".
SCN_API const char *scn_printed(const ScnScene *scene);

// --- what a scene holds

typedef enum ScnParamType {
    SCN_PARAM_BOOL,
    SCN_PARAM_INT,
    SCN_PARAM_STRING,
    SCN_PARAM_SCALAR,
    SCN_PARAM_ANGLE,
    SCN_PARAM_TIME,
    SCN_PARAM_VEC2,
    SCN_PARAM_VEC3,
    SCN_PARAM_COLOR
} ScnParamType;

typedef struct ScnParam {
    const char *name, *doc; // doc: NULL where there is none
    ScnParamType type;
    bool structure;  // bool, int, string: set when the scene is loaded; the others at any time, compiling nothing
    int count;       // numbers: 0 for a string, 1, 2 or 3
    double value[3]; // as it is now; radians, seconds, linear light
    double initial[3];
    const char *text;           // of a string
    const char *const *choices; // NULL-terminated, or NULL
    bool ranged;
    double low, high;
} ScnParam;

typedef struct ScnInfo {
    const char *scene;   // file name
    const char *version; // of the scn that compiled it
    bool package;
    uint32_t objects, shapes, leaves, quadrics, freeforms, perturbations, groups, materials, lights, params;
    uint32_t frame_values; // numbers computed anew for each frame
    bool automatic_camera, orthographic;
    double duration, fps;                         // of the animation; 0 seconds: a still
    int frames;                                   // of the animation; 1 for a still
    size_t kernel_bytes, value_bytes, file_bytes; // file_bytes: of a package, else 0
    int binaries;                                 // in a package
    char structure[33];                           // hash of the kernel's source: equal for scenes that share kernels
} ScnInfo;

SCN_API bool scn_info(const ScnScene *scene, ScnInfo *info); // false: the scene cannot be used
// The files that a scene was read from, from 0 on: its own, then what it includes and uses. NULL behind the last, and of a
// package.
SCN_API const char *scn_source(const ScnScene *scene, int index);

SCN_API int scn_param_count(const ScnScene *scene);
SCN_API bool scn_param(const ScnScene *scene, int index, ScnParam *param);
SCN_API int scn_object_count(const ScnScene *scene);

// "" of what has no name; NULL: there is none with that index. In images the id of object k is k + 1.
SCN_API const char *scn_object_name(const ScnScene *scene, int index);
SCN_API bool scn_binary_device(const ScnScene *scene, int index, const char **device, size_t *size); // of a package

// Sets a param that is no structure: `count` numbers in radians, seconds or linear light.
SCN_API ScnStatus scn_set(ScnScene *scene, const char *name, const double *values, int count);

// The same with a value as the command's -D has it: "0.5", "30deg", "2s", "1,2,3", "#c8814b".
SCN_API ScnStatus scn_set_text(ScnScene *scene, const char *name, const char *value);

// --- rendering

typedef enum ScnLayer {
    SCN_LAYER_COLOR = 1,
    SCN_LAYER_DEPTH = 2,
    SCN_LAYER_NORMAL = 4,
    SCN_LAYER_POSITION = 8,
    SCN_LAYER_ID = 16,
    SCN_LAYER_CERTIFICATE = 32,
    SCN_LAYERS = 63
} ScnLayer;

// Rows from the top, pixels from the left, without padding. What has no buffer and is not in `layers` is not computed.
typedef struct ScnFrameDesc {
    int width, height;
    double time;        // seconds
    double frame;       // the number of the frame
    int samples;        // N: N x N rays a pixel; 0: 1
    float *color;       // 4 a pixel: red, green, blue in linear light, coverage
    float *depth;       // 1: along the viewing direction; +infinity where nothing is
    float *normal;      // 3: unit length, towards the viewer
    float *position;    // 3
    uint32_t *id;       // 1: object k is k + 1; 0 where nothing is
    float *certificate; // 1: 0 where what is seen is certain; 1 where a general field was finer than floats can tell
    unsigned layers;    // ScnLayer bits: what to compute without a buffer, for scn_write_image()
    // Called now and then by the thread that renders, with what is done of the frame, 0 … 1; NULL: not. It may call
    // scn_cancel() and nothing else of the scene.
    void (*progress)(void *progress_data, double share);
    void *progress_data;
} ScnFrameDesc;

// Renders one frame. The first one opens the device and builds the kernels; later ones, with whatever time and
// params, build nothing.
SCN_API ScnStatus scn_render(ScnScene *scene, const ScnFrameDesc *desc);

// Makes the scn_render() or scn_prepare() that runs, or else the next one, return SCN_CANCELLED within a tenth of a second
// (what builds kernels ends when they are built).
SCN_API void scn_cancel(ScnScene *scene);

// Opens the device and builds the kernels, which else the first scn_render() does.
SCN_API ScnStatus scn_prepare(ScnScene *scene);

typedef struct ScnStats {
    double load_ms;                // reading and compiling
    double device_ms;              // opening the device
    double build_ms;               // building the kernels, or loading their binary
    int kernel_builds;             // programs given to the device's compiler as source since the scene was loaded;
                                   // a driver may have them in a cache of its own, as PoCL: build_ms is small then
    bool from_cache, from_binary;  // where the kernels came from, if not from source
    bool quick;                    // they are the slower ones
    uint64_t frames;               // rendered since loading
    uint64_t rays;                 // followed: one for each pixel and sample, and from what it meets one for each light
                                   // with a shadow that the surface faces; none of frames without colour
    uint64_t uncertain;            // rays from the eye whose first surface is not certain; with one ray a pixel: pixels
    double frame_ms, frame_cpu_ms; // the last frame: wall time and CPU time of the process
    uint64_t device_bytes;         // memory on the device
    const char *device;            // its name; NULL before it is opened
    int damaged_checkpoints;       // of patches, which were not used
    const char *damage;            // the file that was the last of them and what is wrong with it; NULL: none was
} ScnStats;

SCN_API void scn_stats(const ScnScene *scene, ScnStats *stats);

// --- files

// The temporary file that is being written, for a signal handler that ends the process: it unlinks `path` where
// `open` is not 0. A file appears under its name only when it is whole.
typedef struct ScnUnfinished {
    char path[4096];
    volatile int open;
} ScnUnfinished;

typedef struct ScnImageDesc {
    unsigned layers;           // of an OpenEXR file; 0: color
    bool half, full;           // 16-bit or 32-bit numbers wherever possible, instead of each layer's own
    int bits;                  // of a PNG file: 8 or 16; 0: 8
    ScnUnfinished *unfinished; // may be NULL
} ScnImageDesc;

// Writes the frame that was rendered last; the path's end says the format: .exr or .png.
SCN_API ScnStatus scn_write_image(ScnScene *scene, const char *path, const ScnImageDesc *desc);

// Writes a package. With `source_only` it has no binary and no device is needed; else one for the scene's device.
SCN_API ScnStatus scn_write_package(ScnScene *scene, const char *path, bool source_only, ScnUnfinished *unfinished);

// Puts the kernels into the cache, where they are not yet. It costs as much as building them; worth it for scenes
// that are rendered often.
SCN_API ScnStatus scn_store_kernels(ScnScene *scene);

// --- devices

typedef struct ScnDevice {
    char name[256], platform[128], version[128], driver[128];
    bool cpu, fp64;
    unsigned compute_units;
    uint64_t memory, max_buffer;
} ScnDevice;

// Fills up to `capacity` and returns how many there are: 0 without any; -1 where OpenCL fails.
SCN_API int scn_devices(ScnDevice *devices, int capacity);

SCN_API const char *scn_version(void);

#ifdef __cplusplus
}
#endif

#endif
