// scn render, scn run: stills and animations into files.
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "runtime/command.h"
#include "runtime/package.h"
#include "runtime/progress.h"

#define NAME_SIZE 4096

// What was measured of all frames.
typedef struct Times {
    double *frame_ms; // of each frame
    int count;
    double cpu_ms, write_ms;
} Times;

typedef struct Job {
    const Options *options;
    ScnScene *scene;
    ScnInfo info;
    const char *outputs[OPTION_LIMIT];
    int output_count;
    char default_output[NAME_SIZE];
    int first, last; // frames, where the job is an animation
    bool animation;
    double time, frame; // of a still
    int width, height;
    unsigned layers; // of OpenEXR files
    Progress progress;
    Times times;
    int damaged; // checkpoints, told so far
} Job;

static bool ends_with(const char *text, const char *end)
{
    size_t length = strlen(text), tail = strlen(end);
    return length >= tail && !strcasecmp(text + length - tail, end);
}

// The picture's name without -o: that of the scene, in the working folder.
static void default_output(Job *job)
{
    const char *name = strrchr(job->options->files[0], '/');
    name = name ? name + 1 : job->options->files[0];
    if (!strcmp(name, "-")) name = "scene";
    const char *dot = strrchr(name, '.');
    int length = dot && dot != name ? (int)(dot - name) : (int)strlen(name);
    const char *format = job->options->layers & ~(unsigned)SCN_LAYER_COLOR ? "exr" : "png";
    snprintf(job->default_output, sizeof job->default_output, "%.*s.%s", length, name, format);
    job->outputs[job->output_count++] = job->default_output;
}

// A folder that is missing is told before anything is rendered for it.
static int check_folder(const char *path)
{
    char folder[NAME_SIZE];
    const char *slash = strrchr(path, '/');
    snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) + 1 : 1, slash ? path : ".");
    struct stat status;
    bool there = !stat(folder, &status);
    if (there && S_ISDIR(status.st_mode)) return EXIT_DONE;
    if (there || errno == ENOENT)
        command_error("cannot write %s: its folder does not exist", path);
    else
        command_error("cannot write %s: %s", path, strerror(errno));
    return EXIT_WORLD;
}

static int choose_outputs(Job *job)
{
    const Options *options = job->options;
    for (int i = 0; i < options->output_count; i++) {
        const char *path = options->outputs[i];
        if (!ends_with(path, ".exr") && !ends_with(path, ".png")) {
            command_error("-o %s: a picture's name ends in .exr or .png", path);
            return EXIT_USAGE;
        }
        for (int k = 0; k < i; k++) {
            if (strcmp(options->outputs[k], path)) continue;
            command_error("-o %s is there twice", path);
            return EXIT_USAGE;
        }
        if (check_folder(path)) return EXIT_WORLD;
        job->outputs[job->output_count++] = path;
    }
    if (!job->output_count) default_output(job);
    bool exr = false;
    for (int i = 0; i < job->output_count; i++) exr |= ends_with(job->outputs[i], ".exr");
    if (options->layers & ~(unsigned)SCN_LAYER_COLOR && !exr) {
        command_error("--layers is for OpenEXR files, and no -o names one: a PNG holds the colour only");
        return EXIT_USAGE;
    }
    job->layers = options->layers ? options->layers : SCN_LAYER_COLOR;
    return EXIT_DONE;
}

static int choose_frames(Job *job)
{
    const Options *options = job->options;
    job->animation = options->frames_given;
    if (!job->animation) return command_time(options, job->scene, &job->time, &job->frame) ? EXIT_DONE : EXIT_USAGE;
    job->first = options->first_frame;
    job->last = options->last_frame;
    if (options->frames_all) {
        job->first = 0;
        job->last = job->info.frames - 1;
    }
    return EXIT_DONE;
}

// out.####.exr gives out.0012.exr; a name without # gets .0012 before its end.
static bool frame_path(char *path, size_t size, const char *pattern, int frame)
{
    const char *begin = strchr(pattern, '#');
    int digits = 4, length;
    if (begin) {
        digits = (int)strspn(begin, "#");
        length = snprintf(path, size, "%.*s%0*d%s", (int)(begin - pattern), pattern, digits, frame, begin + digits);
    } else {
        begin = strrchr(pattern, '.');
        length = snprintf(path, size, "%.*s.%0*d%s", (int)(begin - pattern), pattern, digits, frame, begin);
    }
    return length > 0 && (size_t)length < size;
}

static ScnStatus write_files(Job *job, int frame, char *last_path)
{
    double start = progress_seconds();
    const Options *options = job->options;
    ScnStatus status = SCN_OK;
    for (int i = 0; i < job->output_count && status == SCN_OK; i++) {
        if (!job->animation)
            snprintf(last_path, NAME_SIZE, "%s", job->outputs[i]);
        else if (!frame_path(last_path, NAME_SIZE, job->outputs[i], frame))
            return SCN_CALL_WRONG;
        status = scn_write_image(job->scene, last_path,
                                 &(ScnImageDesc){
                                     .layers = job->layers,
                                     .half = options->half,
                                     .full = options->full,
                                     .bits = options->bits,
                                     .unfinished = command_unfinished(),
                                 });
    }
    job->times.write_ms += (progress_seconds() - start) * 1e3;
    return status;
}

// Between two frames, or in the middle of one.
static void on_progress(void *data, double share)
{
    Job *job = data;
    progress_step(&job->progress, job->times.count + share);
}

static ScnStatus render_frame(Job *job, double time, double frame)
{
    // A PNG needs colour even where only other layers go into the OpenEXR file.
    unsigned layers = job->layers;
    for (int i = 0; i < job->output_count; i++)
        if (ends_with(job->outputs[i], ".png")) layers |= SCN_LAYER_COLOR;
    ScnStatus status = scn_render(job->scene, &(ScnFrameDesc){
                                                  .width = job->width,
                                                  .height = job->height,
                                                  .time = time,
                                                  .frame = frame,
                                                  .samples = job->options->samples,
                                                  .layers = layers,
                                                  .progress = job->progress.shown ? on_progress : NULL,
                                                  .progress_data = job,
                                              });
    if (status != SCN_OK) return status;
    ScnStats stats;
    scn_stats(job->scene, &stats);
    job->times.frame_ms[job->times.count++] = stats.frame_ms;
    job->times.cpu_ms += stats.frame_cpu_ms;
    if (stats.damaged_checkpoints > job->damaged) {
        int count = stats.damaged_checkpoints - job->damaged;
        command_warning("%d checkpoint%s of patches could not be used: %s", count, count == 1 ? "" : "s", stats.damage);
        job->damaged = stats.damaged_checkpoints;
    }
    return SCN_OK;
}

static ScnStatus render_all(Job *job, char *last_path)
{
    int count = job->animation ? job->last - job->first + 1 : 1;
    job->times.frame_ms = calloc((size_t)count, sizeof(double));
    if (!job->times.frame_ms) return SCN_WORLD_FAILED;
    bool silent = job->options->quiet || job->options->format != FORMAT_TEXT;
    progress_start(&job->progress, count, silent);
    progress_say(&job->progress, "building kernels …");
    ScnStatus status = scn_prepare(job->scene);
    progress_start(&job->progress, count, silent);
    progress_step(&job->progress, 0);
    double fps = job->info.fps > 0 ? job->info.fps : 24;
    for (int i = 0; i < count && status == SCN_OK; i++) {
        int frame = job->first + i;
        if (job->animation)
            status = render_frame(job, frame / fps, frame);
        else
            status = render_frame(job, job->time, job->frame);
        if (status == SCN_OK) status = write_files(job, frame, last_path);
        if (status == SCN_OK) progress_step(&job->progress, i + 1);
    }
    progress_clear(&job->progress);
    return status;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static cJSON *stats_json(Job *job)
{
    Times *times = &job->times;
    ScnStats stats;
    scn_stats(job->scene, &stats);
    double total = 0;
    for (int i = 0; i < times->count; i++) total += times->frame_ms[i];
    qsort(times->frame_ms, (size_t)times->count, sizeof(double), compare_doubles);
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "scene", job->info.scene);
    cJSON_AddStringToObject(json, "version", scn_version());
    cJSON_AddStringToObject(json, "device", stats.device ? stats.device : "");
    cJSON_AddNumberToObject(json, "width", job->width);
    cJSON_AddNumberToObject(json, "height", job->height);
    cJSON_AddNumberToObject(json, "samples", job->options->samples ? job->options->samples : 1);
    cJSON_AddNumberToObject(json, "frames", times->count);
    cJSON_AddNumberToObject(json, "load_ms", stats.load_ms);
    cJSON_AddNumberToObject(json, "device_ms", stats.device_ms);
    cJSON_AddNumberToObject(json, "build_ms", stats.build_ms);
    cJSON_AddNumberToObject(json, "kernel_builds", stats.kernel_builds);
    cJSON_AddBoolToObject(json, "kernel_quick", stats.quick);
    cJSON_AddStringToObject(json, "kernel_from", stats.from_binary ? "package" : stats.from_cache ? "cache" : "source");
    cJSON_AddNumberToObject(json, "frame_ms_median", times->count ? times->frame_ms[times->count / 2] : 0);
    cJSON_AddNumberToObject(json, "frame_ms_least", times->count ? times->frame_ms[0] : 0);
    cJSON_AddNumberToObject(json, "frame_ms_most", times->count ? times->frame_ms[times->count - 1] : 0);
    cJSON_AddNumberToObject(json, "frames_ms", total);
    cJSON_AddNumberToObject(json, "frames_cpu_ms", times->cpu_ms);
    cJSON_AddNumberToObject(json, "write_ms", times->write_ms);
    cJSON_AddNumberToObject(json, "rays", (double)stats.rays);
    cJSON_AddNumberToObject(json, "uncertain_pixels", (double)stats.uncertain);
    cJSON_AddNumberToObject(json, "device_bytes", (double)stats.device_bytes);
    cJSON_AddNumberToObject(json, "peak_memory_bytes", command_peak_memory());
    return json;
}

// What is not certain is said, however little it is.
static void report_doubts(const Job *job)
{
    ScnStats stats;
    scn_stats(job->scene, &stats);
    if (!stats.uncertain) return;
    unsigned long long rays = stats.uncertain;
    command_warning("%llu ray%s a general field where it is finer than floats can tell: %s", rays,
                    rays == 1 ? " meets" : "s meet",
                    job->layers & SCN_LAYER_CERTIFICATE ? "the layer certificate is 1 there"
                                                        : "`-o a.exr --layers color,certificate` shows where");
}

static void report(const Job *job, const char *last_path)
{
    if (job->options->quiet) return;
    report_doubts(job);
    if (job->options->format != FORMAT_TEXT) return; // standard error is the document's
    if (job->animation) {
        double seconds = progress_seconds() - job->progress.start;
        fprintf(stderr, "%d frames in %.1f s, the last is %s\n", job->times.count, seconds, last_path);
        return;
    }
    for (int i = 0; i < job->output_count; i++) fprintf(stderr, "%s%s", i ? ", " : "", job->outputs[i]);
    fprintf(stderr, ": %dx%d in %.0f ms\n", job->width, job->height, job->times.frame_ms[0]);
}

// A rendering that took long does not notice what storing costs, and a scene that is rendered for long is rendered
// again.
static void store_kernels(const Job *job)
{
    if (progress_seconds() - job->progress.start > 20) scn_store_kernels(job->scene);
}

// Few rays are followed sooner by kernels that were built quickly. Where the two meet: quick ones lose 0.1 to 0.5 s
// in a million rays and win 1.3 to 3.3 s.
static bool wants_quick_kernels(const Job *job)
{
    const Options *options = job->options;
    double samples = options->samples ? options->samples * options->samples : 1, frames = 1;
    if (options->frames_given) frames = options->frames_all ? INFINITY : options->last_frame - options->first_frame + 1;
    if (options->kernels != KERNELS_AUTO) return options->kernels == KERNELS_QUICK;
    return (double)job->width * job->height * samples * frames < 4e6;
}

// What is there and no package is not compiled to say so. scn_load() knows more about what is called one.
static bool runs_no_package(const Options *options)
{
    const char *path = options->files[0];
    if (options->command != COMMAND_RUN || ends_with(path, ".scnk") || package_file(path)) return false;
    return !strcmp(path, "-") || !access(path, R_OK);
}

int command_render(const Options *options)
{
    int status;
    if (runs_no_package(options)) {
        command_error("%s is no package: `scn render` takes scenes, `scn build` makes packages of them",
                      options->files[0]);
        return EXIT_USAGE;
    }
    Job job = {.options = options,
               .width = options->width ? options->width : 1280,
               .height = options->height ? options->height : 720};
    CommandScene parts;
    command_describe(options, &parts);
    parts.desc.quick = wants_quick_kernels(&job);
    job.scene = scn_load(&parts.desc);
    status = command_loaded(job.scene);
    if (status != EXIT_DONE) return status;
    scn_info(job.scene, &job.info);
    char last_path[NAME_SIZE] = "";
    status = choose_outputs(&job);
    if (status == EXIT_DONE) status = choose_frames(&job);
    if (status == EXIT_DONE) status = command_result(job.scene, render_all(&job, last_path));
    if (status == EXIT_DONE) report(&job, last_path);
    if (status == EXIT_DONE) store_kernels(&job);
    if (status == EXIT_DONE && options->stats) status = command_json_file(options->stats, stats_json(&job));
    free(job.times.frame_ms);
    command_free(job.scene);
    return status;
}
