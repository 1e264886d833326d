// Reading, making and writing benchmark scenes as SCN. pov.c writes them for POV-Ray.
#include "tests/bench/scene.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

// -- JSON ----------------------------------------------------------------------------------------------------------------------

static bool numbers(const cJSON *list, double *out, int count)
{
    if (!cJSON_IsArray(list) || cJSON_GetArraySize(list) != count) return false;
    const cJSON *item;
    cJSON_ArrayForEach(item, list)
    {
        if (!cJSON_IsNumber(item)) return false;
        *out++ = item->valuedouble;
    }
    return true;
}

static bool number(const cJSON *object, const char *key, double *out)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    if (cJSON_IsNumber(item)) *out = item->valuedouble;
    return cJSON_IsNumber(item);
}

static bool vector(const cJSON *object, const char *key, double out[3])
{
    return numbers(cJSON_GetObjectItemCaseSensitive(object, key), out, 3);
}

static bool read_tree(Arena *arena, const cJSON *json, BenchNode *node)
{
    const cJSON *quadric = cJSON_GetObjectItemCaseSensitive(json, "quadric");
    if (quadric) return numbers(quadric, node->q, 10);
    const char *op = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(json, "op"));
    const cJSON *args = cJSON_GetObjectItemCaseSensitive(json, "args"), *arg;
    if (!op || !cJSON_IsArray(args)) return false;
    node->kind = !strcmp(op, "union") ? BENCH_UNION : !strcmp(op, "intersect") ? BENCH_INTERSECT : BENCH_SUBTRACT;
    node->children = arena_array(arena, BenchNode, cJSON_GetArraySize(args));
    cJSON_ArrayForEach(arg, args)
    {
        if (!read_tree(arena, arg, &node->children[node->count++])) return false;
    }
    return node->count > 0;
}

static bool read_object(Arena *arena, const cJSON *json, BenchNode *node)
{
    const cJSON *tree = cJSON_GetObjectItemCaseSensitive(json, "tree"), *part;
    if (tree) return read_tree(arena, tree, node);
    const cJSON *parts = cJSON_GetObjectItemCaseSensitive(json, "perturb");
    node->kind = BENCH_FREEFORM;
    node->parts = arena_alloc(arena, sizeof *node->parts * (size_t)cJSON_GetArraySize(parts));
    if (!numbers(cJSON_GetObjectItemCaseSensitive(json, "base"), node->q, 10)) return false;
    cJSON_ArrayForEach(part, parts)
    {
        if (!numbers(part, node->parts[node->count++], 10)) return false;
    }
    return true;
}

static bool read_scene(Arena *arena, const cJSON *json, BenchScene *scene)
{
    const cJSON *camera = cJSON_GetObjectItemCaseSensitive(json, "camera");
    const cJSON *light = cJSON_GetObjectItemCaseSensitive(json, "light");
    const cJSON *material = cJSON_GetObjectItemCaseSensitive(json, "material");
    const cJSON *objects = cJSON_GetObjectItemCaseSensitive(json, "objects");
    const char *name = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(json, "name"));
    scene->name = name ? arena_text(arena, name, strlen(name)) : "scene";
    return vector(camera, "eye", scene->eye) && vector(camera, "look_at", scene->look_at) &&
           vector(camera, "up", scene->up) && number(camera, "fov_y_deg", &scene->fov) &&
           vector(light, "dir", scene->light) && vector(material, "color", scene->color) &&
           vector(material, "background", scene->background) && number(material, "ambient", &scene->ambient) &&
           number(material, "diffuse", &scene->diffuse) && number(material, "specular", &scene->specular) &&
           number(material, "shininess", &scene->shininess) && number(json, "bound_radius", &scene->bound) &&
           cJSON_GetArraySize(objects) == 1 && read_object(arena, cJSON_GetArrayItem(objects, 0), &scene->root);
}

bool bench_read_json(Arena *arena, const char *path, BenchScene *scene, char why[200])
{
    *scene = (BenchScene){0};
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    size_t length = 0, n;
    if (!file) {
        snprintf(why, 200, "%s cannot be opened", path);
        return false;
    }
    do {
        text = realloc(text, length + 65537);
        if (!text) abort();
        n = fread(text + length, 1, 65536, file);
        length += n;
    } while (n);
    text[length] = 0;
    fclose(file);
    cJSON *json = cJSON_ParseWithLength(text, length);
    bool good = json && read_scene(arena, json, scene);
    if (!good) snprintf(why, 200, "%s is not a benchmark scene", path);
    cJSON_Delete(json);
    free(text);
    return good;
}

// -- generators ----------------------------------------------------------------------------------------------------------------

typedef uint64_t Random;

static double uniform(Random *r, double low, double high) // splitmix64
{
    uint64_t z = (*r += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return low + (high - low) * (double)(z >> 11) * 0x1p-53;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void unit(double v[3])
{
    double length = sqrt(dot(v, v));
    for (int i = 0; i < 3; i++) v[i] /= length;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1], out[1] = a[2] * b[0] - a[0] * b[2], out[2] = a[0] * b[1] - a[1] * b[0];
}

static void direction(Random *r, double out[3])
{
    double z = uniform(r, -1, 1), angle = uniform(r, 0, 2 * acos(-1.0)), s = sqrt(1 - z * z);
    out[0] = s * cos(angle), out[1] = s * sin(angle), out[2] = z;
}

static void frame(Random *r, double out[3][3])
{
    double other[3];
    direction(r, out[0]);
    direction(r, other);
    cross(out[0], other, out[1]);
    unit(out[1]);
    cross(out[0], out[1], out[2]);
}

// F = top − (X − p)ᵀ M (X − p).
static void quadric_from(const double m[3][3], const double p[3], double top, double q[10])
{
    double mp[3];
    for (int i = 0; i < 3; i++) mp[i] = dot(m[i], p);
    double all[10] = {-m[0][0],     -m[1][1],  -m[2][2],  -2 * m[0][1], -2 * m[0][2],
                      -2 * m[1][2], 2 * mp[0], 2 * mp[1], 2 * mp[2],    top - dot(p, mp)};
    memcpy(q, all, sizeof all);
}

// Σ uᵢ uᵢᵀ / axisᵢ², times `factor`.
static void axes_matrix(const double u[3][3], const double axis[3], double factor, double m[3][3])
{
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            m[i][j] = 0;
            for (int k = 0; k < 3; k++) m[i][j] += factor * u[k][i] * u[k][j] / (axis[k] * axis[k]);
        }
    }
}

static void common(BenchScene *scene, const char *name, double bound)
{
    *scene = (BenchScene){
        .name = name,
        .eye = {1.8, 1.2, 3.4},
        .up = {0, 1, 0},
        .fov = 40,
        .light = {0.9, 1.0, 0.35},
        .color = {0.85, 0.55, 0.35},
        .ambient = 0.12,
        .diffuse = 0.75,
        .specular = 0.4,
        .shininess = 40,
        .background = {0.08, 0.10, 0.16},
        .bound = bound,
    };
}

void bench_freeform(Arena *arena, const char *name, int count, unsigned seed, BenchScene *scene)
{
    Random r = seed;
    double radius = 2 / sqrt(count); // count · π · radius² = 4π
    common(scene, name, 1 + 1.3 * radius);
    scene->root = (BenchNode){.kind = BENCH_FREEFORM, .q = {-1, -1, -1, 0, 0, 0, 0, 0, 0, 1}, .count = count};
    scene->root.parts = arena_alloc(arena, sizeof *scene->root.parts * (size_t)count);
    for (int k = 0; k < count; k++) {
        double p[3], u[3][3], axis[3], m[3][3];
        direction(&r, p);
        frame(&r, u);
        for (int i = 0; i < 3; i++) axis[i] = radius * uniform(&r, 0.75, 1.25);
        double top =
            cbrt(0.8 * radius * uniform(&r, 0.6, 1.1)); // the cube of Q's maximum moves the surface by about half of it
        axes_matrix(u, axis, top, m);
        quadric_from(m, p, top, scene->root.parts[k]);
    }
}

static void ball(const double centre[3], double radius, double q[10])
{
    const double m[3][3] = {{1 / (radius * radius)}, {0, 1 / (radius * radius)}, {0, 0, 1 / (radius * radius)}};
    quadric_from(m, centre, 1, q);
}

void bench_sets(Arena *arena, const char *name, unsigned seed, BenchScene *scene)
{
    static const double half[3] = {0.9, 0.7, 0.8}, radius[3] = {0.45, 0.35, 0.4}, origin[3] = {0};
    Random r = seed;
    common(scene, name, 1.6);
    double u[3][3] = {{1, 0.15, 0.1}, {0}, {0}}, aside[3] = {0.1, -0.1, 1};
    unit(u[0]);
    cross(aside, u[0], u[1]);
    unit(u[1]);
    cross(u[0], u[1], u[2]);
    BenchNode *top = arena_array(arena, BenchNode, 21), *body = arena_array(arena, BenchNode, 4),
              *slabs = arena_array(arena, BenchNode, 3);
    for (int k = 0; k < 3; k++) {
        double slab[3][3], cylinder[3][3];
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                slab[i][j] = u[k][i] * u[k][j] / (half[k] * half[k]);
                cylinder[i][j] = ((i == j) - u[k][i] * u[k][j]) / (radius[k] * radius[k]);
            }
        }
        quadric_from(slab, origin, 1, slabs[k].q);
        quadric_from(cylinder, origin, 1, body[1 + k].q);
    }
    for (int k = 1; k <= 20; k++) {
        double centre[3], away = uniform(&r, 0.8, 1.25);
        direction(&r, centre);
        for (int i = 0; i < 3; i++) centre[i] *= away;
        ball(centre, uniform(&r, 0.1, 0.28), top[k].q);
    }
    body[0] = (BenchNode){.kind = BENCH_INTERSECT, .count = 3, .children = slabs};
    top[0] = (BenchNode){.kind = BENCH_SUBTRACT, .count = 4, .children = body};
    scene->root = (BenchNode){.kind = BENCH_UNION, .count = 21, .children = top};
}

void bench_union(Arena *arena, const char *name, int count, bool balls, unsigned seed, BenchScene *scene)
{
    Random r = seed;
    double size = 0.6 / cbrt(count);
    common(scene, name, 1 + 2 * size);
    scene->root = (BenchNode){.kind = BENCH_UNION, .count = count, .children = arena_array(arena, BenchNode, count)};
    for (int k = 0; k < count; k++) {
        double p[3], away = cbrt(uniform(&r, 0, 1)), u[3][3], axis[3], m[3][3];
        direction(&r, p);
        for (int i = 0; i < 3; i++) p[i] *= away;
        if (balls) {
            ball(p, size * uniform(&r, 0.6, 1.4), scene->root.children[k].q);
            continue;
        }
        frame(&r, u);
        for (int i = 0; i < 3; i++) axis[i] = size * uniform(&r, 0.5, 1.5);
        axes_matrix(u, axis, 1, m);
        quadric_from(m, p, 1, scene->root.children[k].q);
    }
}

// -- SCN -----------------------------------------------------------------------------------------------------------------------

static void write_quadric(const double q[10], FILE *out)
{
    fprintf(out, "quadric(");
    for (int k = 0; k < 10; k++) fprintf(out, "%s%.17g", k ? ", " : "", q[k]);
    fprintf(out, ")");
}

static void write_node(const BenchNode *node, int depth, FILE *out)
{
    static const char *const words[] = {"quadric", "freeform", "union", "intersect", "subtract"};
    fprintf(out, "%*s", 4 * depth, "");
    if (node->kind == BENCH_QUADRIC) {
        write_quadric(node->q, out);
    } else if (node->kind == BENCH_FREEFORM) {
        fprintf(out, "freeform(");
        write_quadric(node->q, out);
        fprintf(out, ") {\n");
        for (int k = 0; k < node->count; k++) {
            fprintf(out, "%*sperturb(", 4 * depth + 4, "");
            write_quadric(node->parts[k], out);
            fprintf(out, ");\n");
        }
        fprintf(out, "%*s}", 4 * depth, "");
    } else {
        fprintf(out, "%s {\n", words[node->kind]);
        for (int k = 0; k < node->count; k++) {
            write_node(&node->children[k], depth + 1, out);
            fprintf(out, ";\n");
        }
        fprintf(out, "%*s}", 4 * depth, "");
    }
}

void bench_write_scn(const BenchScene *s, FILE *out)
{
    fprintf(out, "scn 1;\n\n// bound: %.17g\n", s->bound);
    fprintf(out,
            "camera { eye: (%.17g, %.17g, %.17g); look_at: (%.17g, %.17g, %.17g); up: (%.17g, %.17g, %.17g); fov: "
            "%.17gdeg; }\n",
            s->eye[0], s->eye[1], s->eye[2], s->look_at[0], s->look_at[1], s->look_at[2], s->up[0], s->up[1], s->up[2],
            s->fov);
    fprintf(out, "light sun { direction: (%.17g, %.17g, %.17g); color: (1, 1, 1); }\n", -s->light[0], -s->light[1],
            -s->light[2]);
    fprintf(out, "background { color: (%.17g, %.17g, %.17g); }\n", s->background[0], s->background[1],
            s->background[2]);
    fprintf(out,
            "material clay { color: (%.17g, %.17g, %.17g); ambient: %.17g; diffuse: %.17g; specular: %.17g; shininess: "
            "%.17g; }\n\n",
            s->color[0], s->color[1], s->color[2], s->ambient, s->diffuse, s->specular, s->shininess);
    fprintf(out, "object shape =\n");
    write_node(&s->root, 1, out);
    fprintf(out, ";\n\nscene { shape.paint(clay); }\n");
}
