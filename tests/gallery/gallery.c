// Renders scenes, puts them on one sheet, and compares them with pictures that were looked at.
//
//     scn-gallery --scn SCN --out FOLDER [--size N] [--time T] [--compare PICTURES | --update PICTURES] SCENE.scn ...
//
// Each scene is rendered by the command SCN, at the time T (default 0s), N x N pixels (default 512), 9 rays a pixel, to FOLDER/NAME.png, and all
// of them together to FOLDER/contact-sheet.png, in the order in which they were named, as near to a square as their
// count allows.
//
// --compare PICTURES  compares each picture with PICTURES/NAME.png instead of making the sheet. Two pictures agree if
//                     they have one size, at most 0.5 % of the pixels have a channel that is more than 8 steps of 255
//                     away, and the mean distance of all channels is at most 0.5 steps: edges may fall a little
//                     differently with another compiler's rounding, surfaces and colours may not. What differs is
//                     written to FOLDER/NAME-difference.png.
// --update PICTURES   writes the pictures there, after somebody looked at them.
//
// Exit status: 0 if all went well, 1 if a picture differs or a scene does not render, 2 for a wrong call, 3 where a
// file fails.
#include <png.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { CHANNELS = 3, MAX_SCENES = 256, NEAR = 8, EXIT_WORLD = 3 };

static const double far_share = 0.005, mean_limit = 0.5; // of pixels; of 255 steps
static const int gap = 8;                                // pixels between pictures of the sheet

typedef struct Picture { // rows from the top, sRGB, three bytes a pixel
    unsigned width, height;
    png_bytep pixels; // freed by picture_release()
} Picture;

typedef struct Options {
    const char *scn, *out, *compare, *update, *time;
    const char *scenes[MAX_SCENES];
    int scene_count, size;
} Options;

static bool picture_new(Picture *picture, unsigned width, unsigned height)
{
    *picture = (Picture){.width = width, .height = height, .pixels = calloc((size_t)width * height, CHANNELS)};
    return picture->pixels != NULL;
}

static void picture_release(Picture *picture)
{
    free(picture->pixels);
    *picture = (Picture){0};
}

static bool picture_read(Picture *picture, const char *path)
{
    png_image image = {.version = PNG_IMAGE_VERSION};
    if (!png_image_begin_read_from_file(&image, path)) {
        fprintf(stderr, "scn-gallery: %s: %s\n", path, image.message);
        return false;
    }
    image.format = PNG_FORMAT_RGB;
    if (!picture_new(picture, image.width, image.height) ||
        !png_image_finish_read(&image, NULL, picture->pixels, 0, NULL)) {
        fprintf(stderr, "scn-gallery: %s: %s\n", path, picture->pixels ? image.message : "no memory");
        png_image_free(&image);
        picture_release(picture);
        return false;
    }
    return true;
}

static bool picture_write(const Picture *picture, const char *path)
{
    png_image image = {
        .version = PNG_IMAGE_VERSION, .width = picture->width, .height = picture->height, .format = PNG_FORMAT_RGB};
    if (png_image_write_to_file(&image, path, 0, picture->pixels, 0, NULL)) return true;
    fprintf(stderr, "scn-gallery: %s: %s\n", path, image.message);
    return false;
}

// Writes FOLDER/NAME.png into `path`, NAME being the scene's file name without its ending; `suffix` is put behind it.
static void picture_path(char *path, size_t size, const char *folder, const char *scene, const char *suffix)
{
    const char *slash = strrchr(scene, '/');
    const char *name = slash ? slash + 1 : scene;
    snprintf(path, size, "%s/%.*s%s.png", folder, (int)strcspn(name, "."), name, suffix);
}

// Runs the command on one scene. It says itself what is wrong with a scene.
static bool render(const Options *options, const char *scene, const char *path)
{
    char size[32];
    snprintf(size, sizeof size, "%dx%d", options->size, options->size);
    pid_t child = fork();
    if (child == 0) {
        execl(options->scn, options->scn, "render", scene, "-o", path, "--size", size, "--samples", "3", "-q", "--time",
              options->time, (char *)NULL);
        perror(options->scn);
        _exit(EXIT_WORLD);
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child) {
        perror("scn-gallery");
        exit(EXIT_WORLD);
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return true;
    fprintf(stderr, "scn-gallery: %s did not render\n", scene);
    return false;
}

// Compares two pictures of one size and writes the distances, eight times enlarged, into `difference`.
static bool pictures_agree(const char *name, const Picture *a, const Picture *b, Picture *difference)
{
    size_t pixels = (size_t)a->width * a->height, far_pixels = 0;
    double sum = 0;
    for (size_t i = 0; i < pixels; i++) {
        bool is_far = false;
        for (size_t k = i * CHANNELS; k < (i + 1) * CHANNELS; k++) {
            int distance = abs(a->pixels[k] - b->pixels[k]);
            sum += distance;
            is_far |= distance > NEAR;
            difference->pixels[k] = (png_byte)(distance * 8 > 255 ? 255 : distance * 8);
        }
        far_pixels += is_far;
    }
    double mean = sum / (double)(pixels * CHANNELS), share = (double)far_pixels / (double)pixels;
    printf("%s: mean distance %.4f of 255, %.3f %% of the pixels far\n", name, mean, 100 * share);
    return mean <= mean_limit && share <= far_share;
}

static bool compare(const Options *options, const char *scene, const char *path)
{
    char stored_path[4096], difference_path[4096];
    picture_path(stored_path, sizeof stored_path, options->compare, scene, "");
    picture_path(difference_path, sizeof difference_path, options->out, scene, "-difference");
    Picture stored = {0}, made = {0}, difference = {0};
    bool good = picture_read(&stored, stored_path) && picture_read(&made, path);
    if (good && (stored.width != made.width || stored.height != made.height)) {
        printf("%s: %ux%u, stored %ux%u\n", scene, made.width, made.height, stored.width, stored.height);
        good = false;
    }
    good = good && picture_new(&difference, made.width, made.height);
    if (good && !pictures_agree(scene, &stored, &made, &difference)) {
        good = false;
        if (picture_write(&difference, difference_path)) printf("see %s\n", difference_path);
    }
    picture_release(&stored);
    picture_release(&made);
    picture_release(&difference);
    return good;
}

// Copies a picture into the sheet's cell number `cell`. A picture of another size than the cell is cut.
static void sheet_put(Picture *sheet, const Picture *picture, int cell, int columns, unsigned size)
{
    unsigned left = (unsigned)gap + (unsigned)(cell % columns) * (size + (unsigned)gap);
    unsigned top = (unsigned)gap + (unsigned)(cell / columns) * (size + (unsigned)gap);
    unsigned width = picture->width < size ? picture->width : size;
    unsigned height = picture->height < size ? picture->height : size;
    for (unsigned y = 0; y < height; y++)
        memcpy(sheet->pixels + ((size_t)(top + y) * sheet->width + left) * CHANNELS,
               picture->pixels + (size_t)y * picture->width * CHANNELS, (size_t)width * CHANNELS);
}

static bool make_sheet(const Options *options, const char *path)
{
    int columns = 1;
    while (columns * columns < options->scene_count) columns++;
    int rows = (options->scene_count + columns - 1) / columns;
    unsigned cell = (unsigned)(options->size + gap);
    Picture sheet = {0};
    if (!picture_new(&sheet, cell * (unsigned)columns + (unsigned)gap, cell * (unsigned)rows + (unsigned)gap))
        return false;
    bool good = true;
    for (int i = 0; i < options->scene_count; i++) {
        char picture[4096];
        picture_path(picture, sizeof picture, options->out, options->scenes[i], "");
        Picture part = {0};
        if (picture_read(&part, picture))
            sheet_put(&sheet, &part, i, columns, (unsigned)options->size);
        else
            good = false;
        picture_release(&part);
    }
    good = picture_write(&sheet, path) && good;
    picture_release(&sheet);
    return good;
}

static void usage(void)
{
    fputs("usage: scn-gallery --scn SCN --out FOLDER [--size N] [--time T] [--compare PICTURES | --update PICTURES] "
          "SCENE.scn ...\n",
          stderr);
    exit(2);
}

static Options read_options(int argc, char **argv)
{
    Options options = {.size = 512, .time = "0s"};
    for (int i = 1; i < argc; i++) {
        const char *word = argv[i];
        if (strncmp(word, "--", 2) != 0) {
            if (options.scene_count == MAX_SCENES) usage();
            options.scenes[options.scene_count++] = word;
            continue;
        }
        if (++i == argc) usage();
        if (strcmp(word, "--scn") == 0)
            options.scn = argv[i];
        else if (strcmp(word, "--out") == 0)
            options.out = argv[i];
        else if (strcmp(word, "--compare") == 0)
            options.compare = argv[i];
        else if (strcmp(word, "--update") == 0)
            options.update = argv[i];
        else if (strcmp(word, "--time") == 0)
            options.time = argv[i];
        else if (strcmp(word, "--size") == 0)
            options.size = atoi(argv[i]);
        else
            usage();
    }
    if (!options.scn || !options.out || options.scene_count == 0 || options.size < 1 || options.size > 8192) usage();
    return options;
}

int main(int argc, char **argv)
{
    Options options = read_options(argc, argv);
    mkdir(options.out, 0777); // it may exist; if it cannot be made, the first picture says so
    int failures = 0;
    for (int i = 0; i < options.scene_count; i++) {
        char path[4096];
        picture_path(path, sizeof path, options.update ? options.update : options.out, options.scenes[i], "");
        bool good = render(&options, options.scenes[i], path);
        if (good && options.compare) good = compare(&options, options.scenes[i], path);
        failures += !good;
    }
    if (!options.compare && !options.update && failures == 0) {
        char path[4096];
        snprintf(path, sizeof path, "%s/contact-sheet.png", options.out);
        if (!make_sheet(&options, path)) return EXIT_WORLD;
        puts(path);
    }
    return failures > 0;
}
