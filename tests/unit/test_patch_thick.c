// Rays against dense sampling in double, where a patch is no function of x and y: of a thickness, and folded.
//
// Thick patches. F is a thickness less a distance, so the solid is the union of the balls about all places of the patch. Those
// about many thousand of its places are met by each ray in closed form: the renderer must have met the surface before the first of
// them, and where it says that it did, the distance to the patch has to be the radius.
//
// Sheets. The patch as many thousand triangles is drawn into a buffer of depths: whatever pixel they cover with all its neighbours the
// renderer must have met, no later; and where it says that it met the sheet, there has to be a place of the patch.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/patch_cells.h"
#include "runtime/patch_scene.h"
#include "runtime/scene.h"

enum { SIZE = 320, PLACES = 193 }; // rays and places a side

#define TIME 10e-3

typedef struct Look { // orthographic
    double origin[3], right[3], up[3], forward[3], height;
} Look;

// What is compared: the patch in double, its places, and what the renderer met.
typedef struct Trial {
    Look look;
    PatchCells *cells;
    double (*places)[3]; // PLACES² of them
    float *met, *color;
    ScnScene *scene;
} Trial;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static Look look_from(const double eye[3], const double at[3], double height)
{
    Look look = {.height = height};
    double length = 0;
    for (int k = 0; k < 3; k++) {
        look.origin[k] = eye[k];
        look.forward[k] = at[k] - eye[k];
        length += look.forward[k] * look.forward[k];
    }
    for (int k = 0; k < 3; k++) look.forward[k] /= sqrt(length);
    const double *f = look.forward;
    length = hypot(f[0], f[1]);
    look.right[0] = f[1] / length;
    look.right[1] = -f[0] / length;
    for (int k = 0; k < 3; k++)
        look.up[k] = look.right[(k + 1) % 3] * f[(k + 2) % 3] - look.right[(k + 2) % 3] * f[(k + 1) % 3];
    return look;
}

static void place_at(const PatchCells *cells, double u, double v, double place[3])
{
    for (int c = 0; c < 3; c++) place[c] = patch_cells_at(cells, c, u, v, NULL, NULL);
}

// Renders what `shown` makes of the patch p, and solves p.
static Trial trial_new(const char *patch, const char *shown, const double eye[3], const double at[3], double height)
{
    Trial trial = {.look = look_from(eye, at, height)};
    char text[2000];
    snprintf(text, sizeof text,
             "camera { eye: (%g, %g, %g); look_at: (%g, %g, %g); up: (0, 0, 1); projection: \"orthographic\"; height: "
             "%g; }\n%s\n%s\n",
             eye[0], eye[1], eye[2], at[0], at[1], at[2], height, patch, shown);
    trial.scene =
        scn_load(&(ScnSceneDesc){.bytes = (const uint8_t *)text, .size = strlen(text), .device = "cpu", .quick = true});
    if (scn_status(trial.scene) != SCN_OK)
        print_message("%s%s\n", scn_diagnostics_text(trial.scene, false), scn_error(trial.scene));
    assert_int_equal(scn_status(trial.scene), SCN_OK);
    trial.met = malloc(3 * SIZE * SIZE * sizeof *trial.met);
    trial.color = malloc(4 * SIZE * SIZE * sizeof *trial.color);
    trial.places = malloc(sizeof *trial.places * PLACES * PLACES);
    assert_int_equal(
        scn_render(
            trial.scene,
            &(ScnFrameDesc){.width = SIZE, .height = SIZE, .time = TIME, .color = trial.color, .position = trial.met}),
        SCN_OK);
    Failure failure = {""};
    FrameError error;
    const PlanPatch *plan = &trial.scene->package->plan->patches[0];
    PatchSolve *solve = patch_solve_new(plan, &(PatchSolveDesc){.fps = 24}, &failure);
    assert_true(solve && patch_solve_to(solve, TIME, trial.scene->inputs, &error));
    PatchShape shape = patch_solve_shape(solve);
    trial.cells = patch_cells_new(shape.nodes);
    patch_cells_fill(trial.cells, shape.x, shape.edges, shape.tangents);
    patch_solve_free(solve);
    for (int k = 0; k < PLACES * PLACES; k++)
        place_at(trial.cells, (double)(k / PLACES) / (PLACES - 1), (double)(k % PLACES) / (PLACES - 1),
                 trial.places[k]);
    return trial;
}

static void trial_free(Trial *trial)
{
    patch_cells_free(trial->cells);
    free(trial->places);
    free(trial->met);
    free(trial->color);
    scn_free(trial->scene);
}

// A place in the view: pixels across and down, and the depth.
static void to_view(const Look *look, const double place[3], double view[3])
{
    double off[3];
    for (int k = 0; k < 3; k++) off[k] = place[k] - look->origin[k];
    view[0] = (dot(off, look->right) / look->height + 0.5) * SIZE;
    view[1] = (0.5 - dot(off, look->up) / look->height) * SIZE;
    view[2] = dot(off, look->forward);
}

static bool is_met(const Trial *trial, int i, int j)
{
    return trial->color[4 * (j * SIZE + i) + 3] > 0;
}

static double depth_met(const Trial *trial, int i, int j)
{
    double off[3];
    for (int k = 0; k < 3; k++) off[k] = trial->met[3 * (j * SIZE + i) + k] - trial->look.origin[k];
    return dot(off, trial->look.forward);
}

static double square_to(const Trial *trial, const double at[3], double u, double v)
{
    double place[3], square = 0;
    place_at(trial->cells, u, v, place);
    for (int c = 0; c < 3; c++) square += (at[c] - place[c]) * (at[c] - place[c]);
    return square;
}

// The square of the distance to the patch about a place of it: in steps to whatever neighbour is nearer, that get shorter.
static double nearest_about(const Trial *trial, const double at[3], double u, double v)
{
    double best = square_to(trial, at, u, v);
    for (double step = 1.0 / (PLACES - 1); step > 1e-7;) {
        double from_u = u, from_v = v;
        for (int k = 0; k < 8; k++) {
            static const int ways[8][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}};
            double next_u = fmin(fmax(from_u + step * ways[k][0], 0), 1);
            double next_v = fmin(fmax(from_v + step * ways[k][1], 0), 1);
            double square = square_to(trial, at, next_u, next_v);
            if (square >= best) continue;
            best = square;
            u = next_u;
            v = next_v;
        }
        if (u == from_u && v == from_v) step /= 2;
    }
    return best;
}

// The distance from a place to the patch, which may come by more than once: about all of the many places that are hardly farther than the nearest.
static double distance_to(const Trial *trial, const double at[3])
{
    double *squares = malloc(sizeof *squares * PLACES * PLACES), least = INFINITY, best = INFINITY;
    for (int k = 0; k < PLACES * PLACES; k++) {
        squares[k] = 0;
        for (int c = 0; c < 3; c++) squares[k] += (at[c] - trial->places[k][c]) * (at[c] - trial->places[k][c]);
        least = fmin(least, squares[k]);
    }
    double reach = sqrt(least) + 2.0 / PLACES;
    for (int i = 0; i < PLACES; i++)
        for (int j = 0; j < PLACES; j++) {
            double own = squares[i * PLACES + j];
            bool lowest = own <= reach * reach;
            for (int k = 0; k < 9 && lowest; k++) {
                int a = i + k / 3 - 1, b = j + k % 3 - 1;
                if (a >= 0 && a < PLACES && b >= 0 && b < PLACES) lowest = own <= squares[a * PLACES + b];
            }
            if (lowest) best = fmin(best, nearest_about(trial, at, (double)i / (PLACES - 1), (double)j / (PLACES - 1)));
        }
    free(squares);
    return sqrt(best);
}

// The first ball about one of the many places that each ray meets.
static double *first_balls(const Trial *trial, double radius)
{
    double *first = malloc(sizeof *first * SIZE * SIZE), reach = radius * SIZE / trial->look.height;
    for (int k = 0; k < SIZE * SIZE; k++) first[k] = INFINITY;
    for (int k = 0; k < PLACES * PLACES; k++) {
        double view[3];
        to_view(&trial->look, trial->places[k], view);
        for (int j = (int)fmax(view[1] - reach, 0); j < SIZE && j <= view[1] + reach; j++)
            for (int i = (int)fmax(view[0] - reach, 0); i < SIZE && i <= view[0] + reach; i++) {
                double x = (i + 0.5 - view[0]) / SIZE * trial->look.height;
                double y = (j + 0.5 - view[1]) / SIZE * trial->look.height, square = radius * radius - x * x - y * y;
                if (square > 0) first[j * SIZE + i] = fmin(first[j * SIZE + i], view[2] - sqrt(square));
            }
    }
    return first;
}

static void compare_thick(const char *patch, double thickness, const double eye[3], const double at[3], double height)
{
    char shown[100];
    snprintf(shown, sizeof shown, "p.thicken(thickness: %g);", thickness);
    Trial trial = trial_new(patch, shown, eye, at, height);
    double *first = first_balls(&trial, thickness / 2);
    int met = 0, missed = 0, late = 0, made_up = 0;
    for (int k = 0; k < SIZE * SIZE; k++) {
        int i = k % SIZE, j = k / SIZE;
        bool hit = is_met(&trial, i, j);
        met += hit;
        missed += !hit && isfinite(first[k]);
        if (!hit) continue;
        late += depth_met(&trial, i, j) > first[k] + 2e-5;
        if (k % 29) continue; // looking for the nearest place takes its time
        double place[3];
        for (int c = 0; c < 3; c++) place[c] = trial.met[3 * k + c];
        made_up += fabs(distance_to(&trial, place) - thickness / 2) > 2e-5;
    }
    print_message("%d of %d rays meet it; missed %d, late %d, made up %d\n", met, SIZE * SIZE, missed, late, made_up);
    assert_true(met > SIZE * SIZE / 10);
    assert_int_equal(missed, 0);
    assert_int_equal(late, 0);
    assert_int_equal(made_up, 0);
    free(first);
    trial_free(&trial);
}

static const char bulge[] = "patch p { grid: 17; force: (0, 0, 500 * sin(540deg * u)); }";
// Its x goes to and fro: rays meet it three times.
static const char fold[] = "patch p { grid: 17; stiffness: (0.01, 0.02, 0.01); force: (0, 0, 0);\n"
                           "start: (u + 0.375 * sin(360deg * u), v, 2 * u * (1 - u) + 0.1 * v);\n"
                           "edge(u: 0) { position: (0, v, 0.1 * v); } edge(u: 1) { position: (1, v, 0.1 * v); }\n"
                           "edge(v: 0) { position: (u + 0.375 * sin(360deg * u), 0, 2 * u * (1 - u)); }\n"
                           "edge(v: 1) { position: (u + 0.375 * sin(360deg * u), 1, 2 * u * (1 - u) + 0.1); } }";

static void no_ball_about_a_patch_is_missed(void **state)
{
    compare_thick(bulge, 0.12, (double[]){2.6, -2.9, 1.9}, (double[]){0.5, 0.5, 0.1}, 1.9);
}

static void no_ball_about_a_folded_patch_is_missed(void **state)
{
    compare_thick(fold, 0.05, (double[]){3.1, -2.6, 1.2}, (double[]){0.5, 0.5, 0.3}, 1.8);
}

static double edge_of(const double a[3], const double b[3], double x, double y)
{
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
}

static void draw_triangle(double *depth, const double a[3], const double b[3], const double c[3])
{
    double area = edge_of(a, b, c[0], c[1]);
    if (area == 0) return;
    int left = (int)fmax(floor(fmin(a[0], fmin(b[0], c[0])) - 1), 0),
        top = (int)fmax(floor(fmin(a[1], fmin(b[1], c[1])) - 1), 0);
    for (int j = top; j < SIZE && j <= fmax(a[1], fmax(b[1], c[1])); j++)
        for (int i = left; i < SIZE && i <= fmax(a[0], fmax(b[0], c[0])); i++) {
            double u = edge_of(b, c, i + 0.5, j + 0.5) / area, v = edge_of(c, a, i + 0.5, j + 0.5) / area,
                   w = 1 - u - v;
            if (u < 0 || v < 0 || w < 0) continue;
            depth[j * SIZE + i] = fmin(depth[j * SIZE + i], u * a[2] + v * b[2] + w * c[2]);
        }
}

static void no_root_of_a_folded_sheet_is_missed(void **state)
{
    Trial trial = trial_new(fold, "p;", (double[]){3.1, -2.6, 1.2}, (double[]){0.5, 0.5, 0.3}, 1.8);
    double *depth = malloc(sizeof *depth * SIZE * SIZE);
    for (int k = 0; k < SIZE * SIZE; k++) depth[k] = INFINITY;
    for (int i = 0; i + 1 < PLACES; i++)
        for (int j = 0; j + 1 < PLACES; j++) {
            double corners[4][3];
            for (int k = 0; k < 4; k++)
                to_view(&trial.look, trial.places[(i + k / 2) * PLACES + j + k % 2], corners[k]);
            draw_triangle(depth, corners[0], corners[1], corners[3]);
            draw_triangle(depth, corners[0], corners[3], corners[2]);
        }
    int met = 0, missed = 0, late = 0, made_up = 0;
    for (int j = 1; j + 1 < SIZE; j++)
        for (int i = 1; i + 1 < SIZE; i++) {
            bool inside = true;
            double most = 0; // among the neighbours, by which the depth changes where triangles are off by a little
            for (int k = 0; k < 9; k++) {
                double other = depth[(j + k / 3 - 1) * SIZE + i + k % 3 - 1];
                inside &= isfinite(other);
                most = fmax(most, fabs(other - depth[j * SIZE + i]));
            }
            bool hit = is_met(&trial, i, j);
            met += hit;
            missed += inside && !hit;
            if (!hit) continue;
            late += inside && depth_met(&trial, i, j) > depth[j * SIZE + i] + 1e-4 + 0.2 * most;
            if ((j * SIZE + i) % 29) continue;
            double place[3];
            for (int c = 0; c < 3; c++) place[c] = trial.met[3 * (j * SIZE + i) + c];
            made_up += distance_to(&trial, place) > 2e-5;
        }
    print_message("%d of %d rays meet it; missed %d, late %d, made up %d\n", met, SIZE * SIZE, missed, late, made_up);
    assert_true(met > SIZE * SIZE / 10);
    assert_int_equal(missed, 0);
    assert_int_equal(late, 0);
    assert_int_equal(made_up, 0);
    free(depth);
    trial_free(&trial);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_ball_about_a_patch_is_missed),
        cmocka_unit_test(no_ball_about_a_folded_patch_is_missed),
        cmocka_unit_test(no_root_of_a_folded_sheet_is_missed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
