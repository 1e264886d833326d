// Renders scenes that say themselves what is seen in their pixels, and compares.
//
//     test-pixels SCENE.scn …
//
// A scene predicts by `print`, so that the numbers are computed from the reference's formulas by the language itself:
//
//     // size: 33x33                                the picture (33x33: pixel 16,16 is its middle)
//     // camera: side                               the camera to look through
//     // only: wheel                                objects that are shown alone
//     // samples: 4                                 4 x 4 rays a pixel
//     print "pixel 16,16 depth", 4 - sqrt(0.75);    also normal, position, color, alpha (coverage), certificate
//     print "pixel 16,16 depth 3 within 0.01";      instead of the tolerance below
//     print "pixel 16,16 object ball";              the name of section 8.8; `unnamed` where it has none
//     print "pixel 0,0 nothing";                    no object: coverage 0, depth infinite, id 0
//     print "frame 0.5 lift=30deg";                 what follows is of another moment, in seconds, with these params
//     print "area 240 within 8";                    how many pixels objects cover
//
// Pixels count from the left and from the top. Tolerances: depth and position 2e-5 of the number or of 1, whichever is
// more; normal 2e-4; colour and coverage 5e-4. Every scene predicts something, or it fails.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/scn.h"

typedef struct Picture {
    ScnScene *scene;
    const char *path;
    ScnFrameDesc frame; // with its buffers
    bool rendered;
    int predictions, failures;
} Picture;

static void complain(Picture *picture, const char *line, const char *what)
{
    printf("%s: %s: %s\n", picture->path, line, what);
    picture->failures++;
}

static bool render(Picture *picture, const char *line)
{
    if (picture->rendered) return true;
    picture->rendered = true;
    if (scn_render(picture->scene, &picture->frame) == SCN_OK) return true;
    complain(picture, line, scn_error(picture->scene));
    return false;
}

// "frame SECONDS NAME=VALUE …"
static void next_frame(Picture *picture, const char *line)
{
    char text[512], *rest;
    snprintf(text, sizeof text, "%s", line + strlen("frame"));
    char *word = strtok_r(text, " ", &rest);
    picture->frame.time = word ? strtod(word, NULL) : 0;
    picture->rendered = false;
    while (word && (word = strtok_r(NULL, " ", &rest))) {
        char *equals = strchr(word, '=');
        if (equals) *equals = 0;
        if (!equals || scn_set_text(picture->scene, word, equals + 1) != SCN_OK)
            complain(picture, line, equals ? scn_error(picture->scene) : "name=value is wanted");
    }
}

// Reads what `print` made of a number, a vector or a colour, and "within" with a number behind it. The count of numbers.
static int read_numbers(const char *text, double numbers[3], double *within)
{
    int count = 0;
    for (;;) {
        text += strspn(text, " (,)");
        char *end;
        double number = strtod(text, &end);
        if (end == text || count == 3) break;
        numbers[count++] = number;
        text = end;
    }
    text += strspn(text, " (,)");
    if (!strncmp(text, "within", 6)) *within = strtod(text + 6, NULL);
    return count;
}

static void compare_numbers(Picture *picture, const char *line, const char *wanted, const float *got, int count,
                            double within)
{
    double want[3];
    bool relative = within < 0;
    if (relative) within = -within;
    if (read_numbers(wanted, want, &within) != count) {
        complain(picture, line, "another number of values is wanted");
        return;
    }
    bool good = true;
    for (int k = 0; k < count; k++) {
        double scale = relative && fabs(want[k]) > 1 ? fabs(want[k]) : 1;
        good &= fabs(want[k] - got[k]) <= within * scale;
    }
    if (good) return;
    char text[128];
    if (count == 3)
        snprintf(text, sizeof text, "it is (%.7g, %.7g, %.7g)", (double)got[0], (double)got[1], (double)got[2]);
    else
        snprintf(text, sizeof text, "it is %.7g", (double)got[0]);
    complain(picture, line, text);
}

static void compare_object(Picture *picture, const char *line, const char *wanted, uint32_t id)
{
    const char *name = id ? scn_object_name(picture->scene, (int)id - 1) : "nothing";
    if (!name || !*name) name = "unnamed";
    if (!strcmp(wanted, name)) return;
    char text[256];
    snprintf(text, sizeof text, "it is %s", name);
    complain(picture, line, text);
}

// "pixel X,Y WHAT VALUE"
static void compare_pixel(Picture *picture, const char *line)
{
    const ScnFrameDesc *frame = &picture->frame;
    int x = -1, y = -1, end = 0;
    char what[32] = "";
    if (sscanf(line, "pixel %d,%d %31s%n", &x, &y, what, &end) != 3 || x < 0 || y < 0 || x >= frame->width ||
        y >= frame->height) {
        complain(picture, line, "\"pixel X,Y WHAT\" is wanted, within the picture");
        return;
    }
    if (!render(picture, line)) return;
    const char *value = line + end + strspn(line + end, " ");
    size_t k = (size_t)y * (size_t)frame->width + (size_t)x;
    if (!strcmp(what, "depth"))
        compare_numbers(picture, line, value, frame->depth + k, 1, -2e-5);
    else if (!strcmp(what, "normal"))
        compare_numbers(picture, line, value, frame->normal + 3 * k, 3, 2e-4);
    else if (!strcmp(what, "position"))
        compare_numbers(picture, line, value, frame->position + 3 * k, 3, -2e-5);
    else if (!strcmp(what, "color"))
        compare_numbers(picture, line, value, frame->color + 4 * k, 3, 5e-4);
    else if (!strcmp(what, "alpha"))
        compare_numbers(picture, line, value, frame->color + 4 * k + 3, 1, 5e-4);
    else if (!strcmp(what, "certificate"))
        compare_numbers(picture, line, value, frame->certificate + k, 1, 0);
    else if (!strcmp(what, "object"))
        compare_object(picture, line, value, frame->id[k]);
    else if (strcmp(what, "nothing"))
        complain(picture, line, "that is no layer");
    else if (frame->id[k] || frame->color[4 * k + 3] != 0 || frame->depth[k] != INFINITY)
        complain(picture, line, "something is there");
}

static void compare_area(Picture *picture, const char *line)
{
    if (!render(picture, line)) return;
    float covered = 0;
    for (int k = 0; k < picture->frame.width * picture->frame.height; k++) covered += picture->frame.id[k] != 0;
    compare_numbers(picture, line, line + strlen("area"), &covered, 1, 0);
}

static void *room(int width, int height, size_t size)
{
    void *memory = calloc((size_t)width * (size_t)height, size);
    if (!memory) abort();
    return memory;
}

// The comments at the beginning of the file's lines.
static void read_settings(const char *path, ScnFrameDesc *frame, char camera[64], char only[64])
{
    char line[256];
    frame->width = frame->height = 33;
    camera[0] = only[0] = 0;
    FILE *file = fopen(path, "r");
    while (file && fgets(line, sizeof line, file)) {
        int width, height;
        sscanf(line, "// camera: %63s", camera);
        sscanf(line, "// only: %63s", only);
        sscanf(line, "// samples: %d", &frame->samples);
        if (sscanf(line, "// size: %dx%d", &width, &height) != 2) continue;
        if (width > 0 && height > 0 && width <= 512 && height <= 512) frame->width = width, frame->height = height;
    }
    if (file) fclose(file);
}

static void compare_all(Picture *picture)
{
    char *text = strdup(scn_printed(picture->scene)), *rest = NULL; // the scene's own text lives until the next call
    if (!text) abort();
    for (char *line = strtok_r(text, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
        bool pixel = !strncmp(line, "pixel ", 6), area = !strncmp(line, "area ", 5);
        if (!strncmp(line, "frame ", 6)) next_frame(picture, line);
        if (pixel) compare_pixel(picture, line);
        if (area) compare_area(picture, line);
        picture->predictions += pixel || area;
    }
    free(text);
    if (!picture->predictions) complain(picture, "the scene", "it predicts nothing");
}

static int test_scene(const char *path)
{
    Picture picture = {.path = path};
    ScnFrameDesc *frame = &picture.frame;
    char camera[64], only[64];
    read_settings(path, frame, camera, only);
    int w = frame->width, h = frame->height;
    frame->color = room(w, h, 4 * sizeof(float));
    frame->depth = room(w, h, sizeof(float));
    frame->normal = room(w, h, 3 * sizeof(float));
    frame->position = room(w, h, 3 * sizeof(float));
    frame->certificate = room(w, h, sizeof(float));
    frame->id = room(w, h, sizeof(uint32_t));
    picture.scene = scn_load(
        &(ScnSceneDesc){.path = path, .camera = *camera ? camera : NULL, .only = *only ? only : NULL, .quick = true});
    if (!picture.scene || scn_status(picture.scene) != SCN_OK) {
        complain(&picture, "the scene", picture.scene ? scn_error(picture.scene) : "out of memory");
        if (picture.scene) printf("%s", scn_diagnostics_text(picture.scene, false));
    } else {
        if (scn_diagnostic_count(picture.scene)) printf("%s", scn_diagnostics_text(picture.scene, false));
        compare_all(&picture);
    }
    scn_free(picture.scene);
    free(frame->color);
    free(frame->depth);
    free(frame->normal);
    free(frame->position);
    free(frame->certificate);
    free(frame->id);
    printf("%s: %d predictions, %d failed\n", path, picture.predictions, picture.failures);
    return picture.failures;
}

int main(int argc, char **argv)
{
    int failures = argc < 2;
    for (int k = 1; k < argc; k++) failures += test_scene(argv[k]);
    return failures ? 1 : 0;
}
