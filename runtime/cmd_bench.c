// scn bench: how long frames take. One frame warms up and is not counted; no picture is written.
#include <stdlib.h>
#include <time.h>

#include "runtime/command.h"
#include "runtime/progress.h"

typedef struct Measured {
    double wall, cpu; // ms
} Measured;

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double median(const Measured *frames, int count, bool cpu)
{
    double *values = malloc((size_t)count * sizeof *values);
    if (!values) return 0;
    for (int i = 0; i < count; i++) values[i] = cpu ? frames[i].cpu : frames[i].wall;
    qsort(values, (size_t)count, sizeof *values, compare_doubles);
    double result = count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
    free(values);
    return result;
}

typedef struct Bench {
    const Options *options;
    ScnScene *scene;
    ScnInfo info;
    int width, height, repeat;
    double time, frame;
    double start_up_ms; // from the start of the process to the end of the first frame, CPU time
    double start_up_wall_ms;
    uint64_t rays; // of one frame
    Measured *frames;
} Bench;

static double process_cpu_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

static ScnStatus render(Bench *bench)
{
    return scn_render(bench->scene, &(ScnFrameDesc){
                                        .width = bench->width,
                                        .height = bench->height,
                                        .time = bench->time,
                                        .frame = bench->frame,
                                        .samples = bench->options->samples,
                                        .layers = SCN_LAYER_COLOR,
                                    });
}

static ScnStatus measure(Bench *bench, double start)
{
    ScnStats stats;
    ScnStatus status = render(bench);
    bench->start_up_ms = process_cpu_ms();
    bench->start_up_wall_ms = (progress_seconds() - start) * 1e3;
    scn_stats(bench->scene, &stats);
    uint64_t before = stats.rays;
    for (int i = 0; i < bench->repeat && status == SCN_OK; i++) {
        status = render(bench);
        scn_stats(bench->scene, &stats);
        bench->frames[i] = (Measured){stats.frame_ms, stats.frame_cpu_ms};
    }
    bench->rays = (stats.rays - before) / (uint64_t)bench->repeat;
    return status;
}

static cJSON *bench_json(const Bench *bench, const ScnStats *stats, double wall, double cpu)
{
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "scene", bench->info.scene);
    cJSON_AddStringToObject(json, "device", stats->device);
    cJSON_AddNumberToObject(json, "width", bench->width);
    cJSON_AddNumberToObject(json, "height", bench->height);
    cJSON_AddNumberToObject(json, "threads", bench->options->threads);
    cJSON_AddNumberToObject(json, "repeat", bench->repeat);
    cJSON_AddNumberToObject(json, "cpu_ms", cpu);
    cJSON_AddNumberToObject(json, "wall_ms", wall);
    cJSON_AddNumberToObject(json, "rays_per_frame", (double)bench->rays);
    cJSON_AddNumberToObject(json, "rays_per_s", wall > 0 ? (double)bench->rays / wall * 1e3 : 0);
    cJSON_AddNumberToObject(json, "load_ms", stats->load_ms);
    cJSON_AddNumberToObject(json, "device_ms", stats->device_ms);
    cJSON_AddNumberToObject(json, "build_ms", stats->build_ms);
    cJSON_AddNumberToObject(json, "kernel_builds", stats->kernel_builds);
    cJSON_AddStringToObject(json, "kernel_from",
                            stats->from_binary  ? "package"
                            : stats->from_cache ? "cache"
                                                : "source");
    cJSON_AddNumberToObject(json, "start_up_ms", bench->start_up_ms);
    cJSON_AddNumberToObject(json, "start_up_wall_ms", bench->start_up_wall_ms);
    cJSON_AddNumberToObject(json, "device_bytes", (double)stats->device_bytes);
    cJSON_AddNumberToObject(json, "peak_memory_bytes", command_peak_memory());
    return json;
}

static void print_bench(const Bench *bench, const ScnStats *stats, double wall, double cpu)
{
    printf("%s on %s, %dx%d, median of %d frames\n", bench->info.scene, stats->device, bench->width, bench->height,
           bench->repeat);
    printf("  frame      %8.2f ms CPU, %.2f ms wall\n", cpu, wall);
    printf("  rays       %8.2f million a frame, %.1f million a second\n", (double)bench->rays * 1e-6,
           wall > 0 ? (double)bench->rays / wall * 1e-3 : 0);
    printf("  compile    %8.1f ms\n", stats->load_ms);
    printf("  kernels    %8.1f ms, %d built\n", stats->build_ms, stats->kernel_builds);
    printf("  start-up   %8.1f ms CPU, %.1f ms wall, to the end of the first frame\n", bench->start_up_ms,
           bench->start_up_wall_ms);
    printf("  memory     %8.1f MB at most, %.1f MB on the device\n", command_peak_memory() * 1e-6,
           (double)stats->device_bytes * 1e-6);
}

int command_bench(const Options *options)
{
    int status;
    double start = progress_seconds();
    Bench bench = {
        .options = options,
        .width = options->width ? options->width : 1024,
        .height = options->height ? options->height : 1024,
        .repeat = options->repeat ? options->repeat : 9,
    };
    bench.scene = command_load(options, &status);
    if (!bench.scene) return status;
    scn_info(bench.scene, &bench.info);
    bench.frames = calloc((size_t)bench.repeat, sizeof *bench.frames);
    if (!command_time(options, bench.scene, &bench.time, &bench.frame)) status = EXIT_USAGE;
    if (status == EXIT_DONE && bench.frames) status = command_result(bench.scene, measure(&bench, start));
    if (status == EXIT_DONE && bench.frames) {
        ScnStats stats;
        scn_stats(bench.scene, &stats);
        double wall = median(bench.frames, bench.repeat, false), cpu = median(bench.frames, bench.repeat, true);
        if (options->json)
            command_json(stdout, bench_json(&bench, &stats, wall, cpu));
        else
            print_bench(&bench, &stats, wall, cpu);
    }
    free(bench.frames);
    command_free(bench.scene);
    return status;
}
