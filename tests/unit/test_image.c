// Films and image files: what is written is read again by the libraries' own readers.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <dirent.h>
#include <openexr.h>
#include <png.h>

#include "runtime/file.h"
#include "runtime/film.h"
#include "runtime/image_exr.h"
#include "runtime/image_png.h"
#include "runtime/sample.h"

static char folder[] = "/tmp/scn-image-XXXXXX";

static const char *path_of(const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static int files_in_folder(void)
{
    DIR *dir = opendir(folder);
    int count = 0;
    for (struct dirent *entry; (entry = readdir(dir));)
        count += strcmp(entry->d_name, ".") && strcmp(entry->d_name, "..");
    closedir(dir);
    return count;
}

static void empty_folder(void)
{
    DIR *dir = opendir(folder);
    for (struct dirent *entry; (entry = readdir(dir));)
        if (entry->d_name[0] != '.' || strstr(entry->d_name, ".part")) unlink(path_of(entry->d_name));
    closedir(dir);
}

// 5 by 3 pixels, each number different; the last row is nothing.
static Film *small_film(void)
{
    Film *film = film_new(5, 3, FILM_ALL);
    assert_non_null(film);
    for (int i = 0; i < 15; i++) {
        bool hit = i < 10;
        for (int c = 0; c < 4; c++)
            film->color[4 * i + c] = c == 3 ? (float)hit : 0.0625f * (float)i + 0.25f * (float)c;
        film->depth[i] = hit ? 2.5f + (float)i / 3 : INFINITY;
        for (int c = 0; c < 3; c++) film->normal[3 * i + c] = hit ? (float)(c == i % 3) : 0;
        for (int c = 0; c < 3; c++) film->position[3 * i + c] = hit ? (float)i / 7 - (float)c : 0;
        film->id[i] = hit ? 1 + (uint32_t)i % 2 : 0;
    }
    return film;
}

static const char *const names[] = {"left eye", ""};

static ExrDesc description(const Film *film)
{
    return (ExrDesc){.film = film, .objects = names, .object_count = 2, .scene = "eye.scn", .time = 1.25, .frame = 30};
}

// Reads one channel of a file as floats, as the library converts it.
static void read_channel(const char *path, const char *name, float *values, exr_pixel_type_t *type)
{
    exr_context_t file;
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    assert_int_equal(exr_start_read(&file, path, &start), EXR_ERR_SUCCESS);
    exr_chunk_info_t chunk;
    exr_decode_pipeline_t pipeline = EXR_DECODE_PIPELINE_INITIALIZER;
    assert_int_equal(exr_read_scanline_chunk_info(file, 0, 0, &chunk), EXR_ERR_SUCCESS);
    assert_int_equal(exr_decoding_initialize(file, 0, &chunk, &pipeline), EXR_ERR_SUCCESS);
    bool found = false;
    for (int c = 0; c < pipeline.channel_count; c++) {
        exr_coding_channel_info_t *channel = &pipeline.channels[c];
        channel->decode_to_ptr = NULL;
        if (strcmp(channel->channel_name, name)) continue;
        found = true;
        *type = (exr_pixel_type_t)channel->data_type;
        channel->user_data_type = *type == EXR_PIXEL_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = 4;
        channel->user_pixel_stride = 4;
        channel->user_line_stride = 5 * 4;
        channel->decode_to_ptr = (uint8_t *)values;
    }
    assert_true(found);
    assert_int_equal(exr_decoding_choose_default_routines(file, 0, &pipeline), EXR_ERR_SUCCESS);
    assert_int_equal(exr_decoding_run(file, 0, &pipeline), EXR_ERR_SUCCESS);
    exr_decoding_destroy(file, &pipeline);
    exr_finish(&file);
}

static void exr_keeps_every_layer(void **state)
{
    Film *film = small_film();
    ExrDesc desc = description(film);
    Failure failure = {0};
    assert_true(image_write_exr(path_of("all.exr"), &desc, &failure));

    float values[15];
    exr_pixel_type_t type;
    read_channel(path_of("all.exr"), "G", values, &type);
    assert_int_equal(type, EXR_PIXEL_HALF);
    for (int i = 0; i < 15; i++) assert_true(values[i] == film->color[4 * i + 1]); // these numbers are exact as half
    read_channel(path_of("all.exr"), "Z", values, &type);
    assert_int_equal(type, EXR_PIXEL_FLOAT);
    for (int i = 0; i < 15; i++) assert_true(values[i] == film->depth[i]);
    read_channel(path_of("all.exr"), "P.Y", values, &type);
    assert_int_equal(type, EXR_PIXEL_FLOAT);
    for (int i = 0; i < 15; i++) assert_true(values[i] == film->position[3 * i + 1]);
    read_channel(path_of("all.exr"), "N.Z", values, &type);
    for (int i = 0; i < 15; i++) assert_true(values[i] == film->normal[3 * i + 2]);
    read_channel(path_of("all.exr"), "id", values, &type);
    assert_int_equal(type, EXR_PIXEL_UINT);
    assert_memory_equal(values, film->id, sizeof values);
    film_free(film);
}

static void exr_types_follow_half_and_float(void **state)
{
    Film *film = small_film();
    ExrDesc desc = description(film);
    float values[15];
    exr_pixel_type_t type;
    desc.pixels = EXR_PIXELS_FLOAT;
    assert_true(image_write_exr(path_of("float.exr"), &desc, NULL));
    read_channel(path_of("float.exr"), "R", values, &type);
    assert_int_equal(type, EXR_PIXEL_FLOAT);
    desc.pixels = EXR_PIXELS_HALF;
    assert_true(image_write_exr(path_of("half.exr"), &desc, NULL));
    read_channel(path_of("half.exr"), "P.X", values, &type);
    assert_int_equal(type, EXR_PIXEL_HALF);
    read_channel(path_of("half.exr"), "Z", values, &type);
    assert_int_equal(type, EXR_PIXEL_FLOAT);
    film_free(film);
}

static void exr_header_says_scene_time_and_objects(void **state)
{
    Film *film = small_film();
    ExrDesc desc = description(film);
    assert_true(image_write_exr(path_of("header.exr"), &desc, NULL));
    exr_context_t file;
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    assert_int_equal(exr_start_read(&file, path_of("header.exr"), &start), EXR_ERR_SUCCESS);
    const char *text;
    int32_t length, frame, count;
    double time;
    assert_int_equal(exr_attr_get_string(file, 0, "scn/scene", &length, &text), EXR_ERR_SUCCESS);
    assert_string_equal(text, "eye.scn");
    assert_int_equal(exr_attr_get_int(file, 0, "scn/frame", &frame), EXR_ERR_SUCCESS);
    assert_int_equal(frame, 30);
    assert_int_equal(exr_attr_get_double(file, 0, "scn/time", &time), EXR_ERR_SUCCESS);
    assert_true(time == 1.25);
    const char *objects[2];
    count = 2;
    assert_int_equal(exr_attr_get_string_vector(file, 0, "scn/objects", &count, objects), EXR_ERR_SUCCESS);
    assert_string_equal(objects[0], "left eye");
    assert_string_equal(objects[1], "unnamed2"); // what has no name gets one
    exr_finish(&file);
    film_free(film);
}

// The numbers of the Cryptomatte specification's own examples.
static void cryptomatte_numbers_are_those_of_the_specification(void **state)
{
    static const struct {
        const char *name;
        float number;
    } examples[] = {{"hello", 6.0705627102400005616e-17f},
                    {"cube", -4.08461912519e+15f},
                    {"sphere", 2.79018604383e+15f},
                    {"plane", 3.66557617593e-11f}};
    for (int i = 0; i < 4; i++) {
        uint32_t hash = cryptomatte_hash(examples[i].name);
        float number;
        memcpy(&number, &hash, sizeof number);
        assert_true(fabsf(number - examples[i].number) <= 1e-6f * fabsf(number));
    }
}

static void cryptomatte_channels_hold_ids_and_shares(void **state)
{
    Film *film = small_film();
    FilmCover cover[15] = {0};
    cover[0] = (FilmCover){.id = {2, 1}, .weight = {0.75f, 0.25f}};
    film->cover = cover;
    ExrDesc desc = description(film);
    assert_true(image_write_exr(path_of("crypto.exr"), &desc, NULL));
    float values[15];
    exr_pixel_type_t type;
    uint32_t hash = cryptomatte_hash("left eye");
    read_channel(path_of("crypto.exr"), "CryptoObject00.G", values, &type);
    assert_true(values[0] == 0.75f && values[1] == 0);
    read_channel(path_of("crypto.exr"), "CryptoObject00.B", values, &type);
    assert_memory_equal(&values[0], &hash, 4);
    film_free(film);
}

static void srgb_is_the_standards_curve(void **state)
{
    assert_true(srgb_encode(0) == 0 && srgb_encode(1) == 1);
    assert_true(srgb_encode(-1) == 0 && srgb_encode(7) == 1 && srgb_encode(NAN) == 0);
    assert_true(fabs(srgb_encode(0.0031308) - 0.0404499) < 1e-6);
    assert_true(fabs(srgb_encode(0.5) - 0.735356983) < 1e-9);
    assert_true(fabs(srgb_encode(0.2140411405) - 0.5) < 1e-9);
}

static uint8_t *read_png(const char *path, png_image *image, png_uint_32 format)
{
    memset(image, 0, sizeof *image);
    image->version = PNG_IMAGE_VERSION;
    assert_true(png_image_begin_read_from_file(image, path));
    image->format = format;
    uint8_t *bytes = malloc(PNG_IMAGE_SIZE(*image));
    assert_true(png_image_finish_read(image, NULL, bytes, 0, NULL));
    return bytes;
}

// All 8-bit values are reached, each by the linear values that round to it.
static void png_rounds_the_encoded_value(void **state)
{
    enum { WIDTH = 4096 };
    Film *film = film_new(WIDTH, 1, FILM_COLOR);
    for (int x = 0; x < WIDTH; x++)
        for (int c = 0; c < 4; c++) film->color[4 * x + c] = (float)x / (WIDTH - 1);
    Failure failure = {0};
    assert_true(
        image_write_png(path_of("ramp.png"), &(PngDesc){.film = film, .scene = "ramp", .software = "scn"}, &failure));
    png_image image;
    uint8_t *bytes = read_png(path_of("ramp.png"), &image, PNG_FORMAT_RGB);
    assert_int_equal(image.width, WIDTH);
    for (int x = 0; x < WIDTH; x++) {
        double exact = srgb_encode(film->color[4 * x]) * 255;
        assert_true(fabs(bytes[3 * x + 1] - exact) <= 0.5 + 1e-4);
    }
    free(bytes);
    film_free(film);
}

static void png_can_have_16_bits(void **state)
{
    Film *film = small_film();
    assert_true(image_write_png(path_of("16.png"), &(PngDesc){.film = film, .bits = 16}, NULL));
    FILE *file = fopen(path_of("16.png"), "rb");
    uint8_t head[26];
    assert_int_equal(fread(head, 1, sizeof head, file), sizeof head);
    fclose(file);
    assert_int_equal(head[24], 16);
    film_free(film);
}

static void nothing_stays_where_the_folder_is_missing(void **state)
{
    Film *film = small_film();
    ExrDesc desc = description(film);
    Failure failure = {0};
    assert_false(image_write_exr(path_of("none/a.exr"), &desc, &failure));
    assert_non_null(strstr(failure.text, "none/a.exr"));
    assert_non_null(strstr(failure.text, "folder does not exist"));
    assert_false(image_write_png("/proc/nothing/a.png", &(PngDesc){.film = film}, &failure));
    film_free(film);
}

// A limit on file sizes is a disk that is full.
static void nothing_stays_where_the_disk_is_full(void **state)
{
    empty_folder();
    Film *film = film_new(300, 300, FILM_ALL);
    for (int i = 0; i < 300 * 300 * 3; i++) film->position[i] = (float)rand(); // does not compress
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit before, limit;
    getrlimit(RLIMIT_FSIZE, &before);
    limit = (struct rlimit){20000, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
    ExrDesc desc = description(film);
    Failure failure = {0};
    Unfinished unfinished = {0};
    desc.unfinished = &unfinished;
    bool exr = image_write_exr(path_of("full.exr"), &desc, &failure);
    char exr_text[1024];
    strcpy(exr_text, failure.text);
    for (int i = 0; i < 300 * 300 * 4; i++) film->color[i] = (float)rand() / (float)RAND_MAX;
    bool png = image_write_png(path_of("full.png"), &(PngDesc){.film = film, .unfinished = &unfinished}, &failure);
    setrlimit(RLIMIT_FSIZE, &before);
    assert_false(exr);
    assert_false(png);
    assert_non_null(strstr(exr_text, "full.exr"));
    assert_non_null(strstr(exr_text, strerror(EFBIG)));
    assert_non_null(strstr(failure.text, "full.png"));
    assert_int_equal(files_in_folder(), 0);
    assert_int_equal(unfinished.open, 0);
    film_free(film);
}

static void what_was_there_stays_until_the_new_file_is_whole(void **state)
{
    empty_folder();
    WholeFile file;
    Unfinished unfinished = {0};
    assert_true(whole_open(&file, path_of("a"), NULL, NULL));
    assert_true(whole_write(&file, "old", 3, NULL));
    assert_true(whole_finish(&file, NULL));
    assert_true(whole_open(&file, path_of("a"), &unfinished, NULL));
    assert_true(whole_write(&file, "new one", 7, NULL));
    assert_int_equal(unfinished.open, 1);
    assert_int_equal(access(unfinished.path, F_OK), 0);
    struct stat status;
    stat(path_of("a"), &status);
    assert_int_equal(status.st_size, 3);
    whole_drop(&file);
    assert_int_equal(files_in_folder(), 1);
    stat(path_of("a"), &status);
    assert_int_equal(status.st_size, 3);
}

static void films_have_a_limit(void **state)
{
    assert_null(film_new(0, 10, FILM_COLOR));
    assert_null(film_new(10, FILM_MAX_SIZE + 1, FILM_COLOR));
    Film *film = film_new(3, 2, FILM_DEPTH);
    assert_null(film->color);
    assert_non_null(film->depth);
    film_free(film);
}

// Four samples of a pixel: two of object 1 (the nearer), one of object 2, one of nothing.
static void samples_are_means_and_shares(void **state)
{
    Film *film = film_new(1, 1, FILM_ALL);
    Samples *samples = samples_new(1, 1, FILM_ALL, 2);
    const float colors[4] = {1, 0, 1, 2}, depths[4] = {3, 5, 2, INFINITY};
    const uint32_t ids[4] = {1, 2, 1, 0};
    for (int i = 0; i < 4; i++) {
        samples_place(samples, i, film);
        assert_true(film->place_x == (i % 2 ? 0.75 : 0.25) && film->place_y == (i / 2 ? 0.75 : 0.25));
        for (int c = 0; c < 4; c++) film->color[c] = colors[i];
        for (int c = 0; c < 3; c++) film->normal[c] = ids[i] ? (float)(c == (int)ids[i]) : 0;
        for (int c = 0; c < 3; c++) film->position[c] = depths[i];
        film->depth[0] = depths[i];
        film->id[0] = ids[i];
        samples_add(samples, film, NULL);
    }
    samples_resolve(samples, film, NULL);
    assert_true(film->color[0] == 1 && film->depth[0] == 2 && film->position[1] == 2 && film->id[0] == 1);
    assert_true(fabsf(film->normal[1] - 2 / sqrtf(5)) < 1e-6f && fabsf(film->normal[2] - 1 / sqrtf(5)) < 1e-6f);
    assert_true(film->cover[0].id[0] == 1 && film->cover[0].weight[0] == 0.5f);
    assert_true(film->cover[0].id[1] == 2 && film->cover[0].weight[1] == 0.25f && film->cover[0].id[2] == 0);
    samples_free(samples);
    film_free(film);
}

int main(void)
{
    if (!mkdtemp(folder)) return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exr_keeps_every_layer),
        cmocka_unit_test(exr_types_follow_half_and_float),
        cmocka_unit_test(exr_header_says_scene_time_and_objects),
        cmocka_unit_test(cryptomatte_numbers_are_those_of_the_specification),
        cmocka_unit_test(cryptomatte_channels_hold_ids_and_shares),
        cmocka_unit_test(srgb_is_the_standards_curve),
        cmocka_unit_test(png_rounds_the_encoded_value),
        cmocka_unit_test(png_can_have_16_bits),
        cmocka_unit_test(nothing_stays_where_the_folder_is_missing),
        cmocka_unit_test(nothing_stays_where_the_disk_is_full),
        cmocka_unit_test(what_was_there_stays_until_the_new_file_is_whole),
        cmocka_unit_test(films_have_a_limit),
        cmocka_unit_test(samples_are_means_and_shares),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    empty_folder();
    rmdir(folder);
    return failed;
}
