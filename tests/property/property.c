// Random rays over random scenes of every class: what the device renders against the oracle, ray by ray.
//
//     scn-property [--scenes N] [--size N] [--first SEED] [--class NAME] [--lanes 1|16] [--keep FOLDER] [--sampled N] [--verbose] [SCENE.scn …]
//
// With scenes named, those are compared instead of random ones; their size is a third of the distance between the eye and where it looks.
//
// --sampled is for fields for which the oracle takes too long: of each ray F is asked at N places, in double, as far as four times that distance, and the first
// between which it changes its sign are narrowed by halves. What the device meets earlier counts as an edge where F changes its sign there: it is thinner than a step. Places
// alone are compared. ./dev bench asks colonnade.vm and bear.vm so.
// N scenes of each class are rendered N x N, a ray a pixel, through the public API. Of each ray are compared: whether it hits, where (depth), with which normal, which
// object, and the colour, in which the shadows are. What counts as wrong:
//
//   missed     the oracle hits and the device does not, or only behind it: something in front was not seen
//   invented   the device hits where the oracle finds nothing or nothing yet
//   misplaced  both hit, between 1e-4 and 1e-3 of the size apart (further apart is missed or invented)
//   normal     they differ by more than 0.01 (0.6 degrees) · object: the wrong one · colour: a channel differs by more than 0.02
//
// The silhouette tolerance. A ray that passes an edge closer than a float can tell may go either way. A disagreement is forgiven if the
// oracle gives the device's answer for some ray beside it: displaced by EDGE of the size and turned by EDGE (a radian), so EDGE of the distance away (sixteen such
// rays are tried, on two rings), or if the device's depth lies between the depths of two of them. The same rays say whether a normal, an object or a shadow
// is at an edge. Everything forgiven is counted and printed as a share.
//
// Errors of depth are divided by the scene's size, or by the distance where that is larger: a plane may be hit far outside. The program fails (exit 1)
// on a single missed or invented ray, on a median above 1e-6, where less than 99.99 % are within 1e-4, and where more than 0.1 % of all rays are wrong in
// normal, object or colour. --keep writes the scenes that fail.
//
// What a million rays gave (scn-property --scenes 7 --size 120 --first 100: 100,800 rays a class): none missed, none invented; errors of depth, relative:
//
//     class        hits    median   99.99 %   worst        class        hits    median   99.99 %   worst
//     quadrics     62502   5.2e-8   3.1e-6    7.2e-6       eye inside   34508   9.6e-8   7.4e-5    8.1e-5
//     degenerate   59728   4.1e-8   1.9e-6    5.0e-6       families     65762   3.9e-8   3.1e-6    6.7e-6
//     freeform     49515   3.9e-8   1.0e-6    2.1e-6       lights       30823   3.8e-8   1.1e-5    2.5e-5
//     sets         36269   5.0e-8   3.3e-6    5.6e-6       morphs       40748   3.7e-8   1.7e-6    5.7e-6
//     free sets    21347   8.7e-8   3.6e-5    9.9e-5       faces        32884   4.3e-8   4.1e-6    6.1e-6
//     bases        44431   6.4e-8   2.5e-6    2.3e-5       steep        95893   4.9e-8   1.4e-6    3.6e-6
//     fields       22608   4.2e-8   2.1e-6    3.3e-6
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/scn.h"
#include "tests/oracle/load.h"
#include "tests/oracle/oracle.h"
#include "tests/property/scenes.h"

enum { RING = 8, NEIGHBOURS = 2 * RING };
static const double EDGE = 1e-5, FAR = 1e-4, REACH = 65536;

typedef struct Options {
    int scenes, size, lanes, sampled;
    unsigned long long first;
    const char *only, *keep;
    bool verbose;
    char **files;
    int file_count;
} Options;

typedef struct Tally {
    long rays, hits, missed, invented, misplaced, normal, object, color;
    long edge_hit, edge_normal, edge_object, edge_color; // forgiven
    double worst;
    double *errors; // of the depths compared, relative
    size_t error_count, error_capacity;
} Tally;

typedef struct Picture { // what the device says
    float *color, *depth, *normal;
    uint32_t *id;
} Picture;

typedef struct Comparison { // of one scene
    const Options *options;
    const RandomScene *scene;
    Oracle *oracle;
    ScnScene *device;
    Picture picture;
    Tally *tally;
    double bias;
    bool reported;
} Comparison;

typedef struct Answer { // the oracle's, of one ray
    bool hit;
    OracleHit at;
} Answer;

static bool inside_at(const Comparison *c, const OracleRay *ray, double t)
{
    double point[3];
    for (int i = 0; i < 3; i++) point[i] = ray->origin[i] + t * ray->direction[i];
    return oracle_field(c->oracle, point, NULL) > 0;
}

// The first of many places that is inside, or, of a ray that begins inside, that is not.
static bool sampled_hit(const Comparison *c, const OracleRay *ray, OracleHit *hit)
{
    double step = 12 * c->scene->size / c->options->sampled;
    bool inside = inside_at(c, ray, 0);
    int k = 1;
    *hit = (OracleHit){.leaving = inside};
    while (k <= c->options->sampled && inside_at(c, ray, k * step) == inside) k++;
    double low = (k - 1) * step, high = k * step;
    for (int n = 0; n < 60; n++) {
        double middle = low + (high - low) / 2;
        *(inside_at(c, ray, middle) == inside ? &low : &high) = middle;
    }
    hit->t = high;
    return k <= c->options->sampled;
}

static bool meets(const Comparison *c, const OracleRay *ray, OracleHit *hit)
{
    return c->options->sampled ? sampled_hit(c, ray, hit) : oracle_hit(c->oracle, ray, hit);
}

// The rays around one: begun aside of it by EDGE of the size, and turned away by EDGE.
static void neighbours(const Comparison *c, const OracleRay *ray, Answer out[NEIGHBOURS])
{
    double side[3], up[3], length = 0;
    const double *d = ray->direction;
    int least = fabs(d[0]) < fabs(d[1]) ? (fabs(d[0]) < fabs(d[2]) ? 0 : 2) : (fabs(d[1]) < fabs(d[2]) ? 1 : 2);
    double axis[3] = {least == 0, least == 1, least == 2};
    for (int i = 0; i < 3; i++) side[i] = d[(i + 1) % 3] * axis[(i + 2) % 3] - d[(i + 2) % 3] * axis[(i + 1) % 3];
    for (int i = 0; i < 3; i++) up[i] = d[(i + 1) % 3] * side[(i + 2) % 3] - d[(i + 2) % 3] * side[(i + 1) % 3];
    for (int i = 0; i < 3; i++) length += side[i] * side[i];
    for (int k = 0; k < NEIGHBOURS; k++) {
        double angle = k % RING * 2 * acos(-1.0) / RING, r = (k < RING ? EDGE : EDGE / 5) / sqrt(length);
        OracleRay other = *ray;
        for (int i = 0; i < 3; i++) {
            double aside = r * (cos(angle) * side[i] + sin(angle) * up[i]);
            other.direction[i] += aside;
            other.origin[i] += c->scene->size * aside;
        }
        out[k].hit = meets(c, &other, &out[k].at);
    }
}

static bool same_place(const Comparison *c, double a, double b)
{
    return fabs(a - b) <= FAR * fmax(c->scene->size, fabs(b));
}

// Could the device's answer be that of a ray beside this one?
static bool at_edge(const Comparison *c, const Answer around[NEIGHBOURS], const Answer *here, bool hit, double t)
{
    double low = here->hit ? here->at.t : INFINITY, high = here->hit ? here->at.t : -INFINITY;
    for (int k = 0; k < NEIGHBOURS; k++) {
        if (around[k].hit != hit) continue;
        if (!hit || same_place(c, t, around[k].at.t)) return true;
        low = fmin(low, around[k].at.t);
        high = fmax(high, around[k].at.t);
    }
    return hit && t >= low && t <= high;
}

static void report(Comparison *c, const char *what, int x, int y, const Answer *true_answer, bool hit, double t)
{
    if (c->options->verbose || !c->reported) {
        printf("  %s at pixel %d %d: oracle %s %.9g (leaf %u of %s), device %s %.9g\n", what, x, y,
               true_answer->hit ? "hits" : "misses", true_answer->hit ? true_answer->at.t : 0,
               true_answer->hit ? true_answer->at.leaf : 0,
               true_answer->hit ? c->oracle->leaves[true_answer->at.leaf].object : "-", hit ? "hits" : "misses", t);
    }
    c->reported = true;
}

static void add_error(Tally *tally, double error)
{
    if (tally->error_count == tally->error_capacity) {
        tally->error_capacity = tally->error_capacity * 2 + 4096;
        tally->errors = realloc(tally->errors, tally->error_capacity * sizeof *tally->errors);
        if (!tally->errors) abort();
    }
    tally->errors[tally->error_count++] = error;
    tally->worst = fmax(tally->worst, error);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// -- colour --------------------------------------------------------------------------------------------------------------------

// What one light adds at a hit, in full light, and whether it is seen from there: 0 no, 1 yes, 2 that depends on how far from the surface one begins, or
// on which ray of the neighbourhood one takes.
static int light_part(const Comparison *c, uint32_t k, const OracleRay *ray, const OracleHit *hit,
                      const Answer around[NEIGHBOURS], double part[3])
{
    const OracleLight *light = &c->oracle->lights[k];
    const double *m = c->oracle->leaves[hit->leaf].material;
    OracleRay to_light;
    bool seen = false, hidden = false;
    for (int n = -1; n < NEIGHBOURS; n++) {
        const OracleHit *at = n < 0 ? hit : &around[n].at;
        if (n >= 0 && !around[n].hit) continue;
        for (int b = -1; b <= 1; b++) {
            if (n >= 0 && b) continue;
            bool facing = oracle_light_ray(c->oracle, light, at->point, at->normal, c->bias * pow(4, b), &to_light);
            bool shadows = light->v[13] != 0;
            if (!facing || (shadows && oracle_blocked(c->oracle, &to_light)))
                hidden = true;
            else
                seen = true;
        }
    }
    oracle_light_ray(c->oracle, light, hit->point, hit->normal, c->bias, &to_light);
    double lit = fmax(dot(hit->normal, to_light.direction), 0), mirrored = 0;
    for (int i = 0; i < 3; i++) mirrored -= (2 * lit * hit->normal[i] - to_light.direction[i]) * ray->direction[i];
    double shine = mirrored > 0 && lit > 0 ? m[5] * pow(mirrored, m[6]) : 0;
    double share = oracle_light_part(light, hit->point);
    for (int i = 0; i < 3; i++) part[i] = share * (m[i] * m[4] * lit + shine) * light->v[6 + i];
    return seen && hidden ? 2 : seen;
}

static bool color_close(const double a[3], const float b[3])
{
    for (int i = 0; i < 3; i++) {
        if (!(fabs(a[i] - b[i]) <= 0.02)) return false;
    }
    return true;
}

static void compare_color(Comparison *c, int x, int y, const OracleRay *ray, const Answer *here, const float *got)
{
    double color[3];
    oracle_shade(c->oracle, ray, &here->at, 0, c->bias, color);
    if (color_close(color, got)) return;
    Answer around[NEIGHBOURS];
    neighbours(c, ray, around);
    const double *m = c->oracle->leaves[here->at.leaf].material;
    double parts[8][3];
    int states[8], lights = (int)c->oracle->light_count < 8 ? (int)c->oracle->light_count : 8;
    for (int k = 0; k < lights; k++) states[k] = light_part(c, (uint32_t)k, ray, &here->at, around, parts[k]);
    for (int choice = 0; choice < 1 << lights; choice++) { // every way to decide what is undecided
        bool allowed = true;
        for (int i = 0; i < 3; i++) color[i] = m[i] * m[3];
        for (int k = 0; k < lights; k++) {
            int on = choice >> k & 1;
            allowed &= states[k] == 2 || states[k] == on;
            for (int i = 0; i < 3 && on; i++) color[i] += parts[k][i];
        }
        if (allowed && color_close(color, got)) {
            c->tally->edge_color++;
            return;
        }
    }
    for (int k = 0; k < NEIGHBOURS; k++) { // a crease: another leaf's normal or paint
        if (!around[k].hit) continue;
        oracle_shade(c->oracle, ray, &around[k].at, 0, c->bias, color);
        if (!color_close(color, got)) continue;
        c->tally->edge_color++;
        return;
    }
    c->tally->color++;
    if (!c->options->verbose && c->reported) return;
    oracle_shade(c->oracle, ray, &here->at, 0, c->bias, color);
    printf("  colour at pixel %d %d: oracle %.3f %.3f %.3f, device %.3f %.3f %.3f\n", x, y, color[0], color[1],
           color[2], got[0], got[1], got[2]);
    c->reported = true;
}

// -- one ray -------------------------------------------------------------------------------------------------------------------

static void compare_surface(Comparison *c, int x, int y, const OracleRay *ray, const Answer *here, size_t pixel)
{
    const float *n = c->picture.normal + 3 * pixel;
    double off = 0;
    for (int i = 0; i < 3; i++) off += (n[i] - here->at.normal[i]) * (n[i] - here->at.normal[i]);
    const char *name = scn_object_name(c->device, (int)c->picture.id[pixel] - 1);
    bool other_object = !name || strcmp(name, c->oracle->leaves[here->at.leaf].object) != 0;
    if (!(off <= 1e-4) || other_object) {
        Answer around[NEIGHBOURS];
        bool normal_known = off <= 1e-4, object_known = !other_object;
        neighbours(c, ray, around);
        double low[3], high[3];
        for (int i = 0; i < 3; i++) low[i] = high[i] = here->at.normal[i];
        for (int k = 0; k < NEIGHBOURS; k++) {
            if (!around[k].hit) continue;
            double distance = 0;
            for (int i = 0; i < 3; i++) {
                distance += (n[i] - around[k].at.normal[i]) * (n[i] - around[k].at.normal[i]);
                low[i] = fmin(low[i], around[k].at.normal[i]);
                high[i] = fmax(high[i], around[k].at.normal[i]);
            }
            normal_known |= distance <= 1e-4;
            object_known |= name && !strcmp(name, c->oracle->leaves[around[k].at.leaf].object);
        }
        bool between = true; // in a curved spot the normals of the neighbours enclose it
        for (int i = 0; i < 3; i++) between &= n[i] >= low[i] - 0.01 && n[i] <= high[i] + 0.01;
        normal_known |= between;
        if (!(off <= 1e-4)) *(normal_known ? &c->tally->edge_normal : &c->tally->normal) += 1;
        if (other_object) *(object_known ? &c->tally->edge_object : &c->tally->object) += 1;
        if ((!normal_known || !object_known) && (c->options->verbose || !c->reported)) {
            printf("  surface at pixel %d %d: oracle normal %.4f %.4f %.4f of '%s', device %.4f %.4f %.4f of '%s'\n", x,
                   y, here->at.normal[0], here->at.normal[1], here->at.normal[2],
                   c->oracle->leaves[here->at.leaf].object, n[0], n[1], n[2], name ? name : "?");
            c->reported = true;
        }
        return;
    }
    compare_color(c, x, y, ray, here, c->picture.color + 4 * pixel);
}

// Whether a place is farther away than a general field is looked for (lang/reference.md, section 8.12), in the coordinates of one of them.
static bool beyond_reach(const Oracle *oracle, const OracleRay *ray, double t)
{
    for (uint32_t k = 0; k < oracle->base_count; k++) {
        const OracleBase *base = &oracle->bases[k];
        for (int i = 0; i < 3 && base->field; i++) {
            const double *row = base->quadric.map.m + 4 * i;
            double at = row[3];
            for (int axis = 0; axis < 3; axis++) at += row[axis] * (ray->origin[axis] + t * ray->direction[axis]);
            if (fabs(at) > REACH) return true;
        }
    }
    return false;
}

static void compare_ray(Comparison *c, int x, int y)
{
    size_t pixel = (size_t)y * (size_t)c->options->size + (size_t)x;
    OracleRay ray = oracle_camera_ray(c->oracle, x + 0.5, y + 0.5, c->options->size, c->options->size);
    double forward[3], length = 0, depth = c->picture.depth[pixel];
    for (int i = 0; i < 3; i++)
        forward[i] = c->oracle->camera[3 + i] - c->oracle->camera[i], length += forward[i] * forward[i];
    double t = depth / (dot(forward, ray.direction) / sqrt(length));
    bool hit = isfinite(depth);
    Answer here;
    Tally *tally = c->tally;
    here.hit = meets(c, &ray, &here.at);
    tally->rays++;
    tally->hits += here.hit;
    if (!here.hit && !hit) return;
    if (here.hit && hit && same_place(c, t, here.at.t)) {
        add_error(tally, fabs(t - here.at.t) / fmax(c->scene->size, here.at.t));
        if (!c->options->sampled) compare_surface(c, x, y, &ray, &here, pixel);
        return;
    }
    double apart = FAR * fmax(c->scene->size, fabs(t));
    if (c->options->sampled && hit && (!here.hit || t < here.at.t) &&
        inside_at(c, &ray, t - apart) != inside_at(c, &ray, t + apart)) {
        tally->edge_hit++;
        return;
    }
    Answer around[NEIGHBOURS];
    neighbours(c, &ray, around);
    if (at_edge(c, around, &here, hit, t) || (hit && beyond_reach(c->oracle, &ray, t))) {
        tally->edge_hit++;
        return;
    }
    bool missed = here.hit && (!hit || t > here.at.t);
    bool close = here.hit && hit && fabs(t - here.at.t) <= 10 * FAR * fmax(c->scene->size, here.at.t);
    if (close) add_error(tally, fabs(t - here.at.t) / fmax(c->scene->size, here.at.t));
    *(close ? &tally->misplaced : missed ? &tally->missed : &tally->invented) += 1;
    report(c, close ? "misplaced" : missed ? "missed" : "invented", x, y, &here, hit, t);
}

// -- one scene -----------------------------------------------------------------------------------------------------------------

static void keep(const Options *o, const RandomScene *scene, const char *name)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s.scn", o->keep, name);
    FILE *file = fopen(path, "w");
    if (file) fputs(scene->text, file), fclose(file);
    printf("  the scene is %s\n", path);
}

static bool render(Comparison *c, const char *path)
{
    const Options *o = c->options;
    ScnSceneDesc desc = {.path = path, .bytes = c->scene->text, .size = strlen(c->scene->text), .lanes = o->lanes};
    c->device = scn_load(&desc);
    ScnFrameDesc frame = {.width = o->size,
                          .height = o->size,
                          .color = c->picture.color,
                          .depth = c->picture.depth,
                          .normal = c->picture.normal,
                          .id = c->picture.id};
    if (c->device && scn_status(c->device) == SCN_OK && scn_render(c->device, &frame) == SCN_OK) return true;
    printf("  %s\n%s", c->device ? scn_error(c->device) : "no memory",
           c->device ? scn_diagnostics_text(c->device, false) : "");
    return false;
}

// What lengths are measured by in a scene that has a camera.
static double size_seen(const Oracle *oracle)
{
    double away[3];
    for (int i = 0; i < 3; i++) away[i] = oracle->camera[3 + i] - oracle->camera[i];
    return sqrt(dot(away, away)) / 3;
}

// Reports to the tally. False if the scene does not work at all.
static bool compare_scene(const Options *o, const char *path, RandomScene *scene, Picture picture, Tally *tally)
{
    OracleSource source;
    char why[ORACLE_ERROR] = "it has errors";
    Comparison c = {.options = o, .scene = scene, .picture = picture, .tally = tally};
    long wrong = tally->missed + tally->invented + tally->misplaced,
         soft = tally->normal + tally->object + tally->color;
    bool good = oracle_load(&source, path, scene->text, strlen(scene->text));
    if (good) c.oracle = oracle_new(source.ir, &(OracleFrame){0}, why);
    if (!c.oracle) printf("  the oracle cannot read it: %s\n", why);
    if (c.oracle && !(scene->size > 0)) scene->size = size_seen(c.oracle);
    c.bias = 1e-4 * scene->size;
    good = c.oracle && render(&c, path);
    for (int y = 0; y < o->size && good; y++) {
        for (int x = 0; x < o->size; x++) compare_ray(&c, x, y);
    }
    wrong = tally->missed + tally->invented + tally->misplaced - wrong;
    soft = tally->normal + tally->object + tally->color - soft;
    if (!good || c.reported) printf("  in %s: %ld rays wrong, %ld surfaces or colours\n", path, wrong, soft);
    if ((!good || c.reported) && o->keep) keep(o, scene, path);
    oracle_free(c.oracle);
    scn_free(c.device);
    oracle_unload(&source);
    return good;
}

// -- the result ----------------------------------------------------------------------------------------------------------------

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double quantile(Tally *t, double share)
{
    if (!t->error_count) return 0;
    return t->errors[(size_t)(share * (double)(t->error_count - 1))];
}

static void join(Tally *all, const Tally *t)
{
    all->rays += t->rays, all->hits += t->hits, all->missed += t->missed, all->invented += t->invented,
        all->misplaced += t->misplaced;
    all->normal += t->normal, all->object += t->object, all->color += t->color;
    all->edge_hit += t->edge_hit, all->edge_normal += t->edge_normal, all->edge_object += t->edge_object,
        all->edge_color += t->edge_color;
    for (size_t k = 0; k < t->error_count; k++) add_error(all, t->errors[k]);
}

static bool print_tally(const char *name, Tally *t)
{
    if (t->error_count) qsort(t->errors, t->error_count, sizeof *t->errors, ascending);
    double median = quantile(t, 0.5), most = quantile(t, 0.9999);
    long soft = t->normal + t->object + t->color;
    bool good = !t->missed && !t->invented && median <= 1e-6 && most <= 1e-4 && (double)soft <= 1e-3 * (double)t->rays;
    printf("%-12s %9ld rays %8ld hits | missed %ld invented %ld misplaced %ld | |dt| median %.1e, 99.99 %% %.1e, worst "
           "%.1e | normal %ld object %ld colour %ld | edges: hit %.4f %% "
           "normal %.4f %% object %.4f %% colour %.4f %%%s\n",
           name, t->rays, t->hits, t->missed, t->invented, t->misplaced, median, most, t->worst, t->normal, t->object,
           t->color, 100.0 * (double)t->edge_hit / (double)(t->rays + !t->rays),
           100.0 * (double)t->edge_normal / (double)(t->rays + !t->rays),
           100.0 * (double)t->edge_object / (double)(t->rays + !t->rays),
           100.0 * (double)t->edge_color / (double)(t->rays + !t->rays), good ? "" : "  WRONG");
    fflush(stdout);
    return good;
}

static bool compare_classes(const Options *o, Picture picture, Tally *all)
{
    bool good = true;
    for (int kind = 0; kind < SCENE_CLASSES; kind++) {
        if (o->only && strcmp(o->only, scene_class_names[kind])) continue;
        Tally tally = {0};
        for (int k = 0; k < o->scenes; k++) {
            char name[64];
            snprintf(name, sizeof name, "%s-%llu", scene_class_names[kind], o->first + (unsigned long long)k);
            RandomScene scene = random_scene((SceneClass)kind, o->first + (unsigned long long)k);
            good &= compare_scene(o, name, &scene, picture, &tally);
            free(scene.text);
        }
        good &= print_tally(scene_class_names[kind], &tally);
        join(all, &tally);
        free(tally.errors);
    }
    return good;
}

static bool compare_files(const Options *o, Picture picture, Tally *all)
{
    bool good = true;
    for (int k = 0; k < o->file_count; k++) {
        Arena arena = {0};
        size_t length;
        RandomScene scene = {.text = source_read(&arena, o->files[k], &length)};
        Tally tally = {0};
        if (scene.text)
            good &= compare_scene(o, o->files[k], &scene, picture, &tally);
        else
            perror(o->files[k]), good = false;
        const char *slash = strrchr(o->files[k], '/');
        good &= print_tally(slash ? slash + 1 : o->files[k], &tally);
        join(all, &tally);
        free(tally.errors);
        arena_release(&arena);
    }
    return good;
}

static bool read_options(int argc, char **argv, Options *o)
{
    *o = (Options){.scenes = 1, .size = 48, .first = 1};
    int k = 1;
    for (; k < argc && argv[k][0] == '-'; k++) {
        if (!strcmp(argv[k], "--verbose")) {
            o->verbose = true;
            continue;
        }
        if (k + 1 == argc) return false;
        const char *value = argv[++k];
        if (!strcmp(argv[k - 1], "--scenes"))
            o->scenes = atoi(value);
        else if (!strcmp(argv[k - 1], "--size"))
            o->size = atoi(value);
        else if (!strcmp(argv[k - 1], "--first"))
            o->first = strtoull(value, NULL, 10);
        else if (!strcmp(argv[k - 1], "--class"))
            o->only = value;
        else if (!strcmp(argv[k - 1], "--lanes"))
            o->lanes = atoi(value);
        else if (!strcmp(argv[k - 1], "--keep"))
            o->keep = value;
        else if (!strcmp(argv[k - 1], "--sampled"))
            o->sampled = atoi(value);
        else
            return false;
    }
    o->files = argv + k;
    o->file_count = argc - k;
    return o->scenes > 0 && o->size > 0 && o->size <= 4096 && o->sampled >= 0;
}

int main(int argc, char **argv)
{
    Options o;
    if (!read_options(argc, argv, &o)) {
        fprintf(stderr, "usage: scn-property [--scenes N] [--size N] [--first SEED] [--class NAME] [--lanes 1|16] "
                        "[--keep FOLDER] [--sampled N] [--verbose] [SCENE.scn ...]\n");
        return 2;
    }
    size_t pixels = (size_t)o.size * (size_t)o.size;
    Picture picture = {calloc(pixels * 4, sizeof(float)), calloc(pixels, sizeof(float)),
                       calloc(pixels * 3, sizeof(float)), calloc(pixels, sizeof(uint32_t))};
    if (!picture.color || !picture.depth || !picture.normal || !picture.id) abort();
    Tally all = {0};
    bool good = o.file_count ? compare_files(&o, picture, &all) : compare_classes(&o, picture, &all);
    good &= print_tally("all", &all);
    free(all.errors);
    free(picture.color), free(picture.depth), free(picture.normal), free(picture.id);
    return good && all.rays ? 0 : 1;
}
