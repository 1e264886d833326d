// scn info, scn devices: what there is, in words or as JSON.
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "runtime/command.h"

static const char *const type_names[] = {"bool", "int", "string", "scalar", "angle", "time", "vec2", "vec3", "color"};

// --- info

// A value as it is written in a scene.
static void print_value(const ScnParam *param, const double *value)
{
    switch (param->type) {
    case SCN_PARAM_STRING: printf("\"%s\"", param->text); break;
    case SCN_PARAM_BOOL: printf("%s", value[0] != 0 ? "true" : "false"); break;
    case SCN_PARAM_ANGLE: printf("%.10gdeg", value[0] * 180 / M_PI); break;
    case SCN_PARAM_TIME: printf("%.10gs", value[0]); break;
    case SCN_PARAM_VEC2: printf("(%.10g, %.10g)", value[0], value[1]); break;
    case SCN_PARAM_VEC3:
    case SCN_PARAM_COLOR: printf("(%.10g, %.10g, %.10g)", value[0], value[1], value[2]); break;
    default: printf("%.10g", value[0]);
    }
}

static void print_param(const ScnParam *param)
{
    printf("  %s: %s = ", param->name, type_names[param->type]);
    print_value(param, param->value);
    if (param->ranged) {
        double low = param->low, high = param->high;
        printf(" in ");
        print_value(param, &low);
        printf("..");
        print_value(param, &high);
    }
    for (int i = 0; param->choices && param->choices[i]; i++)
        printf("%s\"%s\"%s", i ? ", " : " in [", param->choices[i], param->choices[i + 1] ? "" : "]");
    if (param->structure) printf("  (compiled in)");
    if (param->doc) printf("\n      %s", param->doc);
    printf("\n");
}

static void print_objects(const ScnScene *scene)
{
    int named = 0;
    for (int i = 0; i < scn_object_count(scene); i++) named += scn_object_name(scene, i)[0] != 0;
    if (!named) return;
    printf("\nobjects with names\n  ");
    int shown = 0;
    for (int i = 0; i < scn_object_count(scene) && shown < 50; i++) {
        const char *name = scn_object_name(scene, i);
        if (name[0]) printf("%s%s", shown++ ? ", " : "", name);
    }
    if (named > shown) printf(" and %d more", named - shown);
    printf("\n");
}

static void print_info(const ScnScene *scene, const ScnInfo *info)
{
    printf("%s: %s, scn %s\n\n", info->scene, info->package ? "a package" : "a scene", info->version);
    printf("  %-22s %" PRIu32 " quadrics, %" PRIu32 " free forms with %" PRIu32 " perturbations\n", "leaves",
           info->quadrics, info->freeforms, info->perturbations);
    printf("  %-22s %" PRIu32 " in %" PRIu32 " groups\n", "shapes", info->shapes, info->groups);
    printf("  %-22s %" PRIu32 "\n", "objects", info->objects);
    printf("  %-22s %" PRIu32 "\n", "materials", info->materials);
    printf("  %-22s %" PRIu32 "\n", "lights", info->lights);
    printf("  %-22s %s%s\n", "camera", info->automatic_camera ? "frames the scene, " : "",
           info->orthographic ? "orthographic" : "perspective");
    if (info->duration > 0)
        printf("  %-22s %g s, %d frames at %g a second\n", "animation", info->duration, info->frames, info->fps);
    else
        printf("  %-22s none\n", "animation");
    printf("  %-22s %" PRIu32 "\n", "computed every frame", info->frame_values);
    printf("  %-22s %zu bytes, structure %.16s\n", "kernel source", info->kernel_bytes, info->structure);
    printf("  %-22s %zu bytes\n", "values", info->value_bytes);
    if (info->package) printf("  %-22s %zu bytes\n", "file", info->file_bytes);
    const char *device;
    size_t size;
    for (int i = 0; scn_binary_device(scene, i, &device, &size); i++)
        printf("  %-22s %zu bytes for %s\n", "binary", size, device);
    if (info->params) printf("\nparams\n");
    ScnParam param;
    for (int i = 0; scn_param(scene, i, &param); i++) print_param(&param);
    print_objects(scene);
}

static cJSON *value_json(const ScnParam *param, const double *value)
{
    if (param->type == SCN_PARAM_STRING) return cJSON_CreateString(param->text);
    if (param->type == SCN_PARAM_BOOL) return cJSON_CreateBool(value[0] != 0);
    return param->count == 1 ? cJSON_CreateNumber(value[0]) : cJSON_CreateDoubleArray(value, param->count);
}

static cJSON *param_json(const ScnParam *param)
{
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "name", param->name);
    cJSON_AddStringToObject(json, "type", type_names[param->type]);
    cJSON_AddItemToObject(json, "value", value_json(param, param->value));
    cJSON_AddBoolToObject(json, "structure", param->structure);
    if (param->doc) cJSON_AddStringToObject(json, "doc", param->doc);
    if (param->ranged) {
        cJSON_AddNumberToObject(json, "low", param->low);
        cJSON_AddNumberToObject(json, "high", param->high);
    }
    cJSON *choices = param->choices ? cJSON_AddArrayToObject(json, "choices") : NULL;
    for (int i = 0; choices && param->choices[i]; i++)
        cJSON_AddItemToArray(choices, cJSON_CreateString(param->choices[i]));
    return json;
}

static cJSON *info_json(const ScnScene *scene, const ScnInfo *info)
{
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "scene", info->scene);
    cJSON_AddStringToObject(json, "version", info->version);
    cJSON_AddBoolToObject(json, "package", info->package);
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"leaves", info->leaves},
                   {"quadrics", info->quadrics},
                   {"freeforms", info->freeforms},
                   {"perturbations", info->perturbations},
                   {"shapes", info->shapes},
                   {"groups", info->groups},
                   {"materials", info->materials},
                   {"lights", info->lights},
                   {"frame_values", info->frame_values},
                   {"duration_s", info->duration},
                   {"fps", info->fps},
                   {"frames", info->frames},
                   {"kernel_bytes", (double)info->kernel_bytes},
                   {"value_bytes", (double)info->value_bytes},
                   {"file_bytes", (double)info->file_bytes}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        cJSON_AddNumberToObject(json, numbers[i].name, numbers[i].value);
    cJSON *camera = cJSON_AddObjectToObject(json, "camera");
    cJSON_AddBoolToObject(camera, "automatic", info->automatic_camera);
    cJSON_AddStringToObject(camera, "projection", info->orthographic ? "orthographic" : "perspective");
    cJSON_AddStringToObject(json, "structure", info->structure);
    cJSON *objects = cJSON_AddArrayToObject(json, "objects");
    for (int i = 0; i < scn_object_count(scene); i++)
        cJSON_AddItemToArray(objects, cJSON_CreateString(scn_object_name(scene, i)));
    cJSON *params = cJSON_AddArrayToObject(json, "params");
    ScnParam param;
    for (int i = 0; scn_param(scene, i, &param); i++) cJSON_AddItemToArray(params, param_json(&param));
    cJSON *binaries = cJSON_AddArrayToObject(json, "binaries");
    const char *device;
    size_t size;
    for (int i = 0; scn_binary_device(scene, i, &device, &size); i++) {
        cJSON *binary = cJSON_CreateObject();
        cJSON_AddStringToObject(binary, "device", device);
        cJSON_AddNumberToObject(binary, "bytes", (double)size);
        cJSON_AddItemToArray(binaries, binary);
    }
    return json;
}

int command_info(const Options *options)
{
    int status;
    ScnScene *scene = command_load(options, &status);
    if (!scene) return status;
    ScnInfo info;
    scn_info(scene, &info);
    if (options->json)
        command_json(stdout, info_json(scene, &info));
    else
        print_info(scene, &info);
    scn_free(scene);
    return EXIT_DONE;
}

// --- devices

#define DEVICE_LIMIT 64

static cJSON *devices_json(const ScnDevice *devices, int count)
{
    cJSON *json = cJSON_CreateArray();
    for (int i = 0; i < count; i++) {
        const ScnDevice *device = &devices[i];
        cJSON *entry = cJSON_CreateObject();
        cJSON_AddNumberToObject(entry, "number", i);
        cJSON_AddStringToObject(entry, "name", device->name);
        cJSON_AddStringToObject(entry, "kind", device->cpu ? "cpu" : "gpu");
        cJSON_AddStringToObject(entry, "platform", device->platform);
        cJSON_AddStringToObject(entry, "version", device->version);
        cJSON_AddStringToObject(entry, "driver", device->driver);
        cJSON_AddNumberToObject(entry, "compute_units", device->compute_units);
        cJSON_AddNumberToObject(entry, "memory_bytes", (double)device->memory);
        cJSON_AddNumberToObject(entry, "buffer_bytes", (double)device->max_buffer);
        cJSON_AddBoolToObject(entry, "fp64", device->fp64);
        cJSON_AddItemToArray(json, entry);
    }
    return json;
}

int command_devices(const Options *options)
{
    ScnDevice devices[DEVICE_LIMIT];
    int count = scn_devices(devices, DEVICE_LIMIT);
    if (count > DEVICE_LIMIT) count = DEVICE_LIMIT;
    if (options->json && count >= 0) {
        command_json(stdout, devices_json(devices, count));
        return EXIT_DONE;
    }
    for (int i = 0; i < count; i++) {
        const ScnDevice *device = &devices[i];
        printf("%d  %s  %s\n   %s, %s, driver %s\n   %u compute units, %.1f GB memory\n", i,
               device->cpu ? "cpu" : "gpu", device->name, device->platform, device->version, device->driver,
               device->compute_units, (double)device->memory / 1e9);
    }
    if (count > 0) return EXIT_DONE;
    if (count < 0)
        command_error("OpenCL does not answer");
    else
        command_error("there is no OpenCL device on this machine: install the package pocl-opencl-icd, which makes the "
                      "processor one");
    return EXIT_WORLD;
}
