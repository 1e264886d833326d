// The same scene as somebody who knows POV-Ray would write it.
//
// Set operations are POV-Ray's own, of quadrics, whose boxes it finds itself. A free form is an isosurface; one isosurface with a thousand terms
// would be hopeless, so space is cut into boxes, each with its own isosurface of the few perturbations that reach into it, with the
// largest gradient found there: POV-Ray's box hierarchy then finds the boxes, and each function stays short. Boxes without any surface are left out.
#include <math.h>
#include <stdlib.h>

#include "tests/bench/scene.h"

static double field(const double q[10], const double p[3], double g[3])
{
    double x = p[0], y = p[1], z = p[2];
    g[0] = 2 * q[0] * x + q[3] * y + q[4] * z + q[6];
    g[1] = 2 * q[1] * y + q[3] * x + q[5] * z + q[7];
    g[2] = 2 * q[2] * z + q[4] * x + q[5] * y + q[8];
    return (g[0] + q[6]) * x / 2 + (g[1] + q[7]) * y / 2 + (g[2] + q[8]) * z / 2 + q[9];
}

// A quadric without its closing brace; POV-Ray's inside is below zero.
static void open_quadric(const double q[10], FILE *out)
{
    fprintf(out, "quadric { <%.12g, %.12g, %.12g>, <%.12g, %.12g, %.12g>, <%.12g, %.12g, %.12g>, %.12g ", -q[0], -q[1],
            -q[2], -q[3], -q[4], -q[5], -q[6], -q[7], -q[8], -q[9]);
}

static void write_sets(const BenchNode *node, FILE *out)
{
    static const char *const words[] = {
        [BENCH_UNION] = "union", [BENCH_INTERSECT] = "intersection", [BENCH_SUBTRACT] = "difference"};
    if (node->kind == BENCH_QUADRIC) {
        open_quadric(node->q, out);
        fprintf(out, "}\n");
        return;
    }
    fprintf(out, "%s {\n", words[node->kind]);
    for (int k = 0; k < node->count; k++) write_sets(&node->children[k], out);
    fprintf(out, "}\n");
}

typedef struct Cell {
    double low[3], size;
    int *near; // perturbations that may act in it
    int count;
    double steepest; // largest gradient
    bool surface;
} Cell;

// Over a box the quadric is at most its value in the middle plus what gradient and curvature allow.
static bool reaches(const double q[10], const double middle[3], double half)
{
    double g[3], f = field(q, middle, g), bend = 0;
    for (int k = 0; k < 3; k++) bend += fmax(q[k], -0.0) * half * half;
    for (int k = 3; k < 6; k++) bend += fabs(q[k]) * half * half;
    double bound = f + (fabs(g[0]) + fabs(g[1]) + fabs(g[2])) * half + bend;
    if (bound <= 0) return false;
    double p[3]; // the bound is loose: look more closely
    for (int i = 0; i < 7 * 7 * 7; i++) {
        p[0] = middle[0] + half * (i % 7 - 3) / 2.7;
        p[1] = middle[1] + half * (i / 7 % 7 - 3) / 2.7;
        p[2] = middle[2] + half * (i / 49 - 3) / 2.7;
        if (field(q, p, g) > 0) return true;
    }
    return false;
}

// Samples the cell for its largest gradient and for both signs.
static void survey(const BenchNode *node, Cell *cell)
{
    enum { N = 9 };
    bool in = false, outside = false;
    for (int i = 0; i < N * N * N; i++) {
        double p[3] = {cell->low[0] + cell->size * (i % N) / (N - 1), cell->low[1] + cell->size * (i / N % N) / (N - 1),
                       cell->low[2] + cell->size * (i / N / N) / (N - 1)};
        double sum[3], g[3], f = field(node->q, p, sum);
        for (int k = 0; k < cell->count; k++) {
            double q = field(node->parts[cell->near[k]], p, g);
            if (q <= 0) continue;
            f += q * q * q;
            for (int j = 0; j < 3; j++) sum[j] += 3 * q * q * g[j];
        }
        double slope = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
        if (slope > cell->steepest) cell->steepest = slope;
        if (f >= 0)
            in = true;
        else
            outside = true;
    }
    cell->surface = in && outside;
}

static void write_polynomial(const double q[10], FILE *out)
{
    fprintf(out, "x*(%.12g*x+%.12g*y+%.12g*z+%.12g)+y*(%.12g*y+%.12g*z+%.12g)+z*(%.12g*z+%.12g)+%.12g", q[0], q[3],
            q[4], q[6], q[1], q[5], q[7], q[2], q[8], q[9]);
}

static void write_box(const Cell *cell, FILE *out)
{
    fprintf(out, "box { <%.9g, %.9g, %.9g>, <%.9g, %.9g, %.9g> }", cell->low[0], cell->low[1], cell->low[2],
            cell->low[0] + cell->size, cell->low[1] + cell->size, cell->low[2] + cell->size);
}

static void write_cell(const BenchNode *node, const Cell *cell, FILE *out)
{
    if (cell->count == 0) { // the base alone: no function is needed
        open_quadric(node->q, out);
        fprintf(out, "clipped_by { ");
        write_box(cell, out);
        fprintf(out, " } bounded_by { clipped_by } }\n");
        return;
    }
    fprintf(out, "isosurface { function { -(");
    write_polynomial(node->q, out);
    for (int k = 0; k < cell->count; k++) {
        fprintf(out, "\n+cubed(");
        write_polynomial(node->parts[cell->near[k]], out);
        fprintf(out, ")");
    }
    fprintf(out, ") } contained_by { ");
    write_box(cell, out);
    fprintf(out, " } open max_gradient %.6g }\n", cell->steepest * 1.02);
}

static void write_freeform(const BenchNode *node, double bound, FILE *out)
{
    int cells = node->count <= 64 ? 48 : node->count <= 512 ? 56 : 80; // the fastest of those tried
    int *near = calloc((size_t)node->count + 1, sizeof *near);
    if (!near) abort();
    fprintf(out, "union {\n");
    for (int i = 0; i < cells * cells * cells; i++) {
        Cell cell = {.size = 2 * bound / cells, .near = near};
        int at[3] = {i % cells, i / cells % cells, i / cells / cells};
        double middle[3];
        for (int k = 0; k < 3; k++) {
            cell.low[k] = -bound + cell.size * at[k];
            middle[k] = cell.low[k] + cell.size / 2;
        }
        double away = sqrt(middle[0] * middle[0] + middle[1] * middle[1] + middle[2] * middle[2]);
        if (away - cell.size * 0.87 > bound) continue;
        for (int k = 0; k < node->count; k++) {
            if (reaches(node->parts[k], middle, cell.size / 2)) near[cell.count++] = k;
        }
        survey(node, &cell);
        if (cell.surface) write_cell(node, &cell, out);
    }
    fprintf(out, "}\n");
    free(near);
}

void bench_write_pov(const BenchScene *s, FILE *out)
{
    fprintf(out, "#version 3.7;\nglobal_settings { assumed_gamma 1.0 }\n");
    fprintf(
        out,
        "camera { perspective location <%g, %g, %g> sky <%g, %g, %g> right -x up y angle %g look_at <%g, %g, %g> }\n",
        s->eye[0], s->eye[1], s->eye[2], s->up[0], s->up[1], s->up[2], s->fov, s->look_at[0], s->look_at[1],
        s->look_at[2]);
    fprintf(out, "light_source { <%g, %g, %g> color rgb 1 parallel point_at <0, 0, 0> }\n", 100 * s->light[0],
            100 * s->light[1], 100 * s->light[2]);
    fprintf(out, "background { color rgb <%g, %g, %g> }\n", s->background[0], s->background[1], s->background[2]);
    fprintf(out, "#declare cubed = function(a) { select(a, 0, a * a * a) };\n");
    fprintf(out, "object {\n");
    if (s->root.kind == BENCH_FREEFORM)
        write_freeform(&s->root, s->bound, out);
    else
        write_sets(&s->root, out);
    fprintf(out,
            "pigment { color rgb <%g, %g, %g> } finish { ambient %g diffuse %g specular 0 phong %g phong_size %g } }\n",
            s->color[0], s->color[1], s->color[2], s->ambient, s->diffuse, s->specular, s->shininess);
}
