// How the scenes are made: a grammar of random choices, written straight to text.
//
// All lengths are multiplied by the scene's size, which is 1 for most and 0.001 or 1000 for some; strengths have the unit that keeps a bump's shape.
#include "tests/property/scenes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const char *const scene_class_names[SCENE_CLASSES] = {"quadrics",  "degenerate", "freeform", "bases",     "sets",
                                                      "free sets", "eye inside", "families", "faces",     "lights",
                                                      "morphs",    "fields",     "steep",    "operations"};

typedef struct Maker {
    FILE *out;
    uint64_t state;
    double size;
    double toward[3]; // the eye, of length 1
} Maker;

static uint64_t next(Maker *m) // splitmix64
{
    uint64_t z = (m->state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static double any(Maker *m, double low, double high)
{
    return low + (high - low) * (double)(next(m) >> 11) * 0x1p-53;
}

static int below(Maker *m, int count)
{
    return (int)(next(m) % (uint64_t)count);
}

static double length(Maker *m, double low, double high)
{
    return m->size * any(m, low, high);
}

static void direction(Maker *m, double out[3])
{
    double z = any(m, -1, 1), angle = any(m, 0, 2 * acos(-1.0)), s = sqrt(1 - z * z);
    out[0] = s * cos(angle), out[1] = s * sin(angle), out[2] = z;
}

// -- objects -------------------------------------------------------------------------------------------------------------------

static void turn(Maker *m)
{
    if (below(m, 4))
        fprintf(m->out, ".rotate(x: %.9gdeg, y: %.9gdeg, z: %.9gdeg)", any(m, -180, 180), any(m, -180, 180),
                any(m, -180, 180));
    else
        fprintf(m->out, ".rotate(axis: (%.9g, %.9g, 1), angle: %.9gdeg)", any(m, -1, 1), any(m, -1, 1),
                any(m, -180, 180));
}

static void transform(Maker *m, double reach)
{
    if (!below(m, 3)) fprintf(m->out, ".scale(%.9g, %.9g, %.9g)", any(m, 0.6, 1.5), any(m, 0.6, 1.5), any(m, 0.6, 1.5));
    if (!below(m, 5)) fprintf(m->out, ".shear(xy: %.9g, zx: %.9g)", any(m, -0.5, 0.5), any(m, -0.5, 0.5));
    if (below(m, 4)) turn(m);
    if (!below(m, 6)) {
        fprintf(m->out, ".matrix([%.9g, %.9g, 0, 0,  0, %.9g, %.9g, 0,  %.9g, 0, %.9g, 0])", any(m, 0.7, 1.3),
                any(m, -0.3, 0.3), any(m, 0.7, 1.3), any(m, -0.3, 0.3), any(m, -0.3, 0.3), any(m, -1.3, -0.7));
    }
    if (below(m, 4))
        fprintf(m->out, ".move(%.9g, %.9g, %.9g)", length(m, -reach, reach), length(m, -reach, reach),
                length(m, -reach, reach));
}

static void ball(Maker *m, double low, double high)
{
    fprintf(m->out, "sphere(%.9g)", length(m, low, high));
}

// A quadric by its coefficients: quadratic ones by the inverse square of a length, linear ones by the inverse.
static void coefficients(Maker *m, const double a[10])
{
    double s = m->size;
    fprintf(m->out, "quadric(");
    for (int k = 0; k < 10; k++) fprintf(m->out, "%s%.12g", k ? ", " : "", a[k] / (k < 6 ? s * s : k < 9 ? s : 1));
    fprintf(m->out, ")");
}

static void unbounded(Maker *m)
{
    double s = m->size;
    switch (below(m, 9)) {
    case 0: fprintf(m->out, "cylinder(radius: %.9g)", length(m, 0.1, 0.8)); return;
    case 1: fprintf(m->out, "cone(radius: %.9g)", any(m, 0.2, 1.2)); return;
    case 2: fprintf(m->out, "paraboloid(radius: %.9g)", sqrt(s) * any(m, 0.4, 1.2)); return;
    case 3: fprintf(m->out, "hyperboloid1(radius: %.9g, slope: %.9g)", length(m, 0.1, 0.6), any(m, 0.2, 1)); return;
    case 4: fprintf(m->out, "hyperboloid2(gap: %.9g, slope: %.9g)", length(m, 0.1, 0.6), any(m, 0.3, 1)); return;
    case 5: fprintf(m->out, "saddle(%.9g, %.9g)", sqrt(s) * any(m, 0.5, 1.5), sqrt(s) * any(m, 0.5, 1.5)); return;
    case 6:
        fprintf(m->out, "halfspace(normal: (%.9g, 1, %.9g), at: (0, %.9g, 0))", any(m, -1, 1), any(m, -1, 1),
                length(m, -0.6, 0.6));
        return;
    case 7: {
        double a = length(m, -0.8, 0.4);
        fprintf(m->out, "slab(z: %.9g .. %.9g)", a, a + length(m, 0.02, 0.8));
        return;
    }
    default: {
        double a[10];
        for (int k = 0; k < 10; k++) a[k] = any(m, -1, 1);
        coefficients(m, a);
    }
    }
}

static void bounded(Maker *m)
{
    switch (below(m, 6)) {
    case 0: ball(m, 0.3, 1); return;
    case 1:
        fprintf(m->out, "ellipsoid(%.9g, %.9g, %.9g)", length(m, 0.2, 1), length(m, 0.2, 1), length(m, 0.2, 1));
        return;
    case 2: fprintf(m->out, "cylinder(radius: %.9g, height: %.9g)", length(m, 0.1, 0.7), length(m, 0.1, 1.5)); return;
    case 3: fprintf(m->out, "cone(radius: %.9g, height: %.9g)", length(m, 0.1, 0.8), length(m, 0.3, 1.5)); return;
    case 4:
        fprintf(m->out, "box(%.9g, %.9g, %.9g)", length(m, 0.2, 1.2), length(m, 0.2, 1.2), length(m, 0.2, 1.2));
        return;
    default:
        fprintf(m->out, "paraboloid(radius: %.9g, height: %.9g)", sqrt(m->size) * any(m, 0.4, 1), length(m, 0.3, 1.2));
    }
}

// Any quadric, cut by a ball so that the scene has an end; now and then left without one.
static void quadric(Maker *m)
{
    if (below(m, 2)) {
        bounded(m);
        transform(m, 0.5);
        return;
    }
    bool cut = below(m, 4) != 0;
    fprintf(m->out, cut ? "(" : "");
    unbounded(m);
    transform(m, 0.4);
    if (!cut) return;
    fprintf(m->out, " & ");
    ball(m, 0.8, 1.4);
    fprintf(m->out, ")");
}

static void degenerate(Maker *m)
{
    static const double shapes[][10] = {
        {-1, 0, 0, 0, 0, 0, 0, 0, 0, 0.2},      // slab
        {0, 0, 0, 1, 0, 0, 0, 0, 0, 0},         // two crossing planes
        {1, -1, 0, 0, 0, 0, 0, 0, 0, 0},        // the same, turned
        {-1, -4, 0, 0, 0, 0, 0, 0, 0, 0.3},     // elliptic cylinder
        {1, -1, 0, 0, 0, 0, 0, 0, 0, -0.1},     // hyperbolic cylinder
        {-1, 0, 0, 0, 0, 0, 0, 1, 0, 0},        // parabolic cylinder
        {-1, -1, 1, 0, 0, 0, 0, 0, 0, 0},       // cone
        {0, 0, 0, 0, 0, 0, 1, 2, -1, 0.1},      // half-space
        {1, 1, 0, 0, 0, 0, 0, 0, 0, -0.1},      // outside of a cylinder
        {-1, -1, -1e-7, 0, 0, 0, 0, 0, 0, 0.3}, // almost a cylinder
        {-1, 0, 0, 0, 0, 0, 0, 0, 0, 1e-4},     // a thin slab
    };
    fprintf(m->out, "(");
    coefficients(m, shapes[below(m, (int)(sizeof shapes / sizeof *shapes))]);
    transform(m, 0.3);
    fprintf(m->out, " & ");
    ball(m, 0.8, 1.3);
    fprintf(m->out, ")");
}

// A perturbation somewhere near the ball of radius `around`; its largest height is about the support's radius.
static void perturbation(Maker *m, double around, double radius)
{
    double p[3], s = m->size, r = radius * any(m, 0.7, 1.3), away = around * any(m, 0.8, 1.15);
    direction(m, p);
    fprintf(m->out, "    perturb(");
    if (below(m, 6)) { // Q = c(1 − |M x|²): c³ is the largest value of R
        double c = cbrt(r * any(m, 0.4, 1.2));
        double a[10] = {-c, -c, -c, 0, 0, 0, 0, 0, 0, c * r * r};
        for (int i = 0; i < 3; i++) a[6 + i] = 2 * c * p[i] * away, a[9] -= c * p[i] * p[i] * away * away;
        for (int k = 0; k < 10; k++) a[k] /= r * r;
        coefficients(m, a);
        fprintf(m->out, ", strength: %.9g", (below(m, 3) ? 1 : -1) * any(m, 0.3, 1.2) * (below(m, 2) ? 1 : s));
    } else { // by shape: Q is a length
        fprintf(m->out, "ellipsoid(%.9g, %.9g, %.9g)", s * r, s * r * any(m, 0.5, 1), s * r);
        turn(m);
        fprintf(m->out, ".move(%.9g, %.9g, %.9g)", s * p[0] * away, s * p[1] * away, s * p[2] * away);
        double top = s * r / 2;
        fprintf(m->out, ", strength: %.9g", (below(m, 3) ? 1 : -1) * s * r * any(m, 0.2, 1) / (top * top * top));
    }
    if (!below(m, 8)) fprintf(m->out, ", grow: %.9g", 0.01 * s);
    fprintf(m->out, ");\n");
}

static void perturbations(Maker *m, int count, double around, double radius)
{
    fprintf(m->out, " {\n");
    for (int k = 0; k < count; k++) perturbation(m, around, radius);
    fprintf(m->out, "}");
}

static void freeform(Maker *m, int count)
{
    fprintf(m->out, "freeform(");
    if (below(m, 2))
        fprintf(m->out, "sphere(%.9g)", 0.9 * m->size);
    else
        fprintf(m->out, "ellipsoid(%.9g, %.9g, %.9g)", length(m, 0.5, 1), length(m, 0.5, 1), length(m, 0.5, 1));
    fprintf(m->out, ")");
    perturbations(m, count, 0.85, 1.4 / sqrt(count + 3));
    if (!below(m, 3)) transform(m, 0.1);
}

// A free form whose perturbations are a hundredth to a half of it wide and up to ten thousand times as strong as it, around where the eye looks. Their
// quadrics are 1 in the middle, so that the strength is what they add; nearly flat at the rim of their supports, and steep within.
static void steep(Maker *m)
{
    double s = m->size;
    int base = below(m, 4), count = 1 + below(m, 4);
    fprintf(m->out, "freeform(");
    if (base == 0)
        fprintf(m->out, "cylinder(%.9g, axis: (%.9g, 1, %.9g)", 0.9 * s, any(m, -0.5, 0.5), any(m, -0.5, 0.5));
    else if (base == 1)
        fprintf(m->out, "halfspace((%.9g, %.9g, %.9g), at: (%.9g, %.9g, %.9g)", m->toward[0], m->toward[1],
                m->toward[2], 0.9 * s * m->toward[0], 0.9 * s * m->toward[1], 0.9 * s * m->toward[2]);
    else
        fprintf(m->out, "sphere(%.9g", 0.9 * s);
    fprintf(m->out, ")) {\n");
    for (int k = 0; k < count; k++) {
        double p[3], r = pow(10, any(m, -2, -0.3)), wide = any(m, 1, 3), a[10], at[3], square = 0;
        direction(m, p);
        for (int i = 0; i < 3; i++) p[i] = m->toward[i] + fmax(0.25, r) * p[i];
        double away = (0.9 + r * any(m, -1, 0.9)) / sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        for (int i = 0; i < 3; i++) {
            at[i] = away * p[i];
            a[i] = -1 / (r * r * (i == k % 3 ? wide * wide : 1));
            a[3 + i] = 0;
            a[6 + i] = -2 * a[i] * at[i];
            square += a[i] * at[i] * at[i];
        }
        a[9] = 1 + square;
        fprintf(m->out, "    perturb(");
        coefficients(m, a);
        fprintf(m->out, ", strength: %.9g);\n", (below(m, 3) ? 1 : -1) * s * pow(10, any(m, -1, 4)));
    }
    fprintf(m->out, "}");
}

static void free_base(Maker *m)
{
    fprintf(m->out, "(freeform(");
    unbounded(m);
    turn(m);
    fprintf(m->out, ")");
    perturbations(m, 2 + below(m, 6), 0.5, 0.4);
    fprintf(m->out, " & ");
    ball(m, 0.9, 1.3);
    fprintf(m->out, ")");
}

static void set(Maker *m, int depth, void (*leaf)(Maker *))
{
    static const char *const words[] = {"union", "union", "subtract", "intersect"};
    if (depth == 0 || !below(m, 5)) {
        leaf(m);
        return;
    }
    if (!below(m, 6)) {
        fprintf(m->out, "~(~");
        set(m, depth - 1, leaf);
        fprintf(m->out, ")");
        return;
    }
    int count = 2 + below(m, 3);
    fprintf(m->out, "%s {\n", words[below(m, 4)]);
    for (int k = 0; k < count; k++) {
        set(m, depth - 1, leaf);
        fprintf(m->out, ";\n");
    }
    fprintf(m->out, "}");
}

static void lump(Maker *m)
{
    freeform(m, 1 + below(m, 6));
    fprintf(m->out, ".move(%.9g, %.9g, %.9g)", length(m, -0.4, 0.4), length(m, -0.4, 0.4), length(m, -0.4, 0.4));
}

static void free_or_plain(Maker *m)
{
    if (below(m, 2))
        lump(m);
    else
        quadric(m);
}

static void free_sets(Maker *m)
{
    bool deformed = below(m, 2);
    if (deformed) fprintf(m->out, "deform(");
    set(m, 2, free_or_plain);
    if (deformed) {
        fprintf(m->out, ")");
        perturbations(m, 1 + below(m, 3), 0.7, 0.5);
    }
}

static void family(Maker *m)
{
    int kind = below(m, 3), count = 100 + below(m, 400);
    if (kind == 0) {
        freeform(m, count);
        return;
    }
    if (kind == 1) fprintf(m->out, "sphere(%.9g) - ", m->size);
    fprintf(m->out, "union {\n");
    for (int k = 0; k < count; k++) {
        double p[3], away = cbrt(any(m, 0.2, 1));
        direction(m, p);
        fprintf(m->out, "    %s(%.9g).move(%.9g, %.9g, %.9g);\n", below(m, 4) ? "sphere" : "box", length(m, 0.03, 0.15),
                m->size * p[0] * away, m->size * p[1] * away, m->size * p[2] * away);
    }
    fprintf(m->out, "}");
}

// What is morphed: at rest or turning, bare or painted, now and then cut or hidden.
static void morphed(Maker *m, int depth)
{
    if (below(m, 4))
        free_or_plain(m);
    else
        set(m, depth, free_or_plain);
    if (!below(m, 3)) fprintf(m->out, ".rotate(y: %.9gdeg + time * 10deg / 1s)", any(m, 0, 360));
    if (!below(m, 3)) fprintf(m->out, ".paint((%.3f, %.3f, %.3f))", any(m, 0.3, 1), any(m, 0.3, 1), any(m, 0.3, 1));
    if (!below(m, 8))
        fprintf(m->out, " - sphere(%.9g).move(%.9g, 0, 0).show(when: time < 1s * %d)", length(m, 0.2, 0.6),
                length(m, 0.2, 0.6), below(m, 2));
}

static void morph(Maker *m)
{
    bool deformed = !below(m, 4);
    if (deformed) fprintf(m->out, "deform(");
    bool complement = !below(m, 4);
    if (complement) fprintf(m->out, "~(~");
    if (below(m, 3)) {
        fprintf(m->out, "morph(");
        morphed(m, 2);
        fprintf(m->out, ", ");
        morphed(m, 1);
        fprintf(m->out, ", %.9g%s)", any(m, 0, 1), below(m, 2) ? " + time / 1s" : "");
    } else {
        fprintf(m->out, "keys(time + %.9gs) {\n", any(m, -0.5, 4));
        for (int k = 0; k < 4; k++) {
            fprintf(m->out, "    %ds: (", k);
            morphed(m, 1);
            fprintf(m->out, ") %s;\n", below(m, 2) ? "smooth" : "");
        }
        fprintf(m->out, "}");
    }
    if (complement) fprintf(m->out, ")");
    if (!deformed) return;
    fprintf(m->out, ")");
    perturbations(m, 1 + below(m, 3), 0.7, 0.5);
}

// A solid whose faces lie on a coarse grid, or a tube about one of its lines. Radii are no multiples of the grid's: where curved faces touch flat ones they
// leave slivers that are as thin as one likes, which no float can tell.
static void block(Maker *m)
{
    double s = 0.4 * m->size;
    switch (below(m, 7)) {
    case 0: fprintf(m->out, "cylinder(%.9g, height: %.9g)", 0.93 * s, s * (1 + below(m, 2))); break;
    case 1: fprintf(m->out, "cylinder(%.9g, height: %.9g).move(0, 0, %.9g)", 0.47 * s, 2 * s, s / 2); break;
    case 2: fprintf(m->out, "sphere(%.9g)", 1.07 * s); return;
    default: fprintf(m->out, "box(%.9g, %.9g, %.9g)", s * (1 + below(m, 2)), s * (1 + below(m, 2)), s);
    }
    fprintf(m->out, ".move(%.9g, %.9g, %.9g)", s / 2 * (below(m, 5) - 2), s / 2 * (below(m, 5) - 2),
            s / 2 * (below(m, 5) - 2));
    if (!below(m, 3)) fprintf(m->out, ".paint((%.3f, %.3f, %.3f))", any(m, 0.3, 1), any(m, 0.3, 1), any(m, 0.3, 1));
}

// Solids on one grid, so that many of their faces lie in each other: side by side, cut flush, and sets of sets of them. Turned and moved as a whole, so
// that faces that are equal have numbers that are not.
static void faces(Maker *m)
{
    double s = 0.4 * m->size;
    int count = 2 + below(m, 3);
    bool turned = below(m, 2);
    if (!below(m, 4)) {
        fprintf(m->out, "(halfspace((0, 0, 1), at: (0, 0, %.9g)) & ", s / 2 * below(m, 2));
        ball(m, 0.9, 1.2);
        fprintf(m->out, " | ");
    } else {
        fprintf(m->out, "(");
    }
    fprintf(m->out, "union {\n");
    for (int k = 0; k < count; k++) {
        set(m, 2, block);
        fprintf(m->out, ";\n");
    }
    fprintf(m->out, "})");
    if (turned) transform(m, 0.1);
}

// -- general fields --------------------------------------------------------------------------------------------------------------

static void coordinate(Maker *m)
{
    static const char *const names[] = {"x", "y", "z"};
    fprintf(m->out, m->size == 1 ? "%s" : "(%s / %.9g)", names[below(m, 3)], m->size);
}

// A number that depends on the point, smooth for the most part, of about 1 within the size.
static void expression(Maker *m, int depth)
{
    static const char *const around[][2] = {{"sin(2rad * (", "))"},  {"cos(3rad * (", "))"}, {"sqrt(0.1 + (", ")^2)"},
                                            {"abs(", ")"},           {"exp(-(", ")^2)"},     {"(", ")^3"},
                                            {"log(1.5 + (", ")^2)"}, {"atan(", ") / 1rad"},  {"sin(5rad * (", "))"}};
    static const char *const between[] = {" + ", " - ", " * "};
    if (depth == 0) {
        coordinate(m);
        if (below(m, 2)) fprintf(m->out, " * %.4g", any(m, 0.4, 1.6));
        if (!below(m, 3)) fprintf(m->out, " + %.4g", any(m, -0.5, 0.5));
        return;
    }
    int choice = below(m, 8);
    if (choice < 4) {
        const char *const *form = around[below(m, sizeof around / sizeof *around)];
        fputs(form[0], m->out);
        expression(m, depth - 1);
        fputs(form[1], m->out);
        return;
    }
    fputs(choice == 4 ? "max(" : choice == 5 ? "min(" : "(", m->out);
    expression(m, depth - 1);
    fputs(choice < 6 ? ", " : between[below(m, 3)], m->out);
    expression(m, depth - 1);
    fputc(')', m->out);
}

// A ball with something on it, a level of something cut by a ball, a pipe, or a heap of smooth balls.
static void field_of(Maker *m)
{
    double s = m->size;
    switch (below(m, 4)) {
    case 0:
        fprintf(m->out, "field(%.4g - sqrt(x^2 + y^2 + z^2) / %.9g + %.4g * ", any(m, 0.4, 0.8), s, any(m, 0.05, 0.3));
        expression(m, 2);
        break;
    case 1:
        fprintf(m->out, "(field(%.4g - abs(", any(m, 0.05, 0.3));
        expression(m, 3);
        fprintf(m->out, ")) & sphere(%.9g", length(m, 0.6, 1.1));
        fputc(')', m->out);
        break;
    case 2:
        fprintf(m->out, "field(%.9g - (sqrt(x^2 + y^2) - %.9g)^2 - z^2", pow(length(m, 0.1, 0.3), 2),
                length(m, 0.4, 0.8));
        break;
    default:
        fprintf(m->out, "field(log(");
        for (int k = 0; k < 3; k++)
            fprintf(m->out, "%sexp(4 - 8 * distance((x, y, z), (%.9g, %.9g, %.9g)) / %.9g)", k ? " + " : "",
                    length(m, -0.5, 0.5), length(m, -0.5, 0.5), length(m, -0.5, 0.5), s);
        fputc(')', m->out);
    }
    fputc(')', m->out);
}

static void field_leaf(Maker *m)
{
    bool deformed = !below(m, 5);
    if (deformed) fprintf(m->out, "deform(");
    field_of(m);
    if (below(m, 2)) transform(m, 0.3);
    if (!deformed) return;
    fprintf(m->out, ")");
    perturbations(m, 1 + below(m, 2), 0.6, 0.4);
}

// Few leaves: the oracle asks each for all of its roots.
static void fields(Maker *m)
{
    static const char *const words[] = {" | ", " - ", " & "};
    if (below(m, 2)) {
        field_leaf(m);
        return;
    }
    fprintf(m->out, "(");
    field_leaf(m);
    fprintf(m->out, ")%s(", words[below(m, 3)]);
    if (below(m, 2))
        field_leaf(m);
    else
        bounded(m);
    fprintf(m->out, ")");
}

// -- operations --------------------------------------------------------------------------------------------------------------

static void solid(Maker *m)
{
    switch (below(m, 4)) {
    case 0: ball(m, 0.3, 0.6); return;
    case 1:
        fprintf(m->out, "ellipsoid(%.9g, %.9g, %.9g)", length(m, 0.3, 0.7), length(m, 0.3, 0.7), length(m, 0.3, 0.7));
        return;
    case 2: fprintf(m->out, "box(%.9g, %.9g, %.9g)", length(m, 0.3, 1), length(m, 0.3, 1), length(m, 0.3, 1)); return;
    default: fprintf(m->out, "cylinder(radius: %.9g, height: %.9g)", length(m, 0.2, 0.5), length(m, 0.4, 1)); return;
    }
}

static void blend(Maker *m)
{
    static const char *const words[] = {"union", "intersect", "subtract"};
    fprintf(m->out, "%s(", words[below(m, 3)]);
    solid(m);
    fprintf(m->out, ", ");
    solid(m);
    transform(m, 0.3);
    if (below(m, 3))
        fprintf(m->out, ", blend: %.9g)", length(m, 0.05, 0.3));
    else
        fprintf(m->out, ", style: \"rfunction\")");
}

static void warp(Maker *m)
{
    solid(m);
    switch (below(m, 5)) {
    case 0: fprintf(m->out, ".twist(rate: %.9gdeg)", any(m, -90, 90) / m->size); return;
    case 1: fprintf(m->out, ".bend(rate: %.9gdeg)", any(m, -40, 40) / m->size); return;
    case 2:
        fprintf(m->out, ".taper(z: %.9g .. %.9g, to: %.9g)", length(m, -0.6, -0.2), length(m, 0.2, 0.6),
                any(m, 0.3, 1.5));
        return;
    case 3:
        fprintf(m->out, ".stretch(z: %.9g .. %.9g, by: %.9g)", length(m, -0.3, -0.1), length(m, 0.1, 0.3),
                any(m, 0.4, 2));
        return;
    default:
        fprintf(m->out, ".attract(at: (%.9g, 0, %.9g), radius: %.9g, amount: %.9g)", length(m, -0.4, 0.4),
                length(m, -0.4, 0.4), length(m, 0.4, 0.9), any(m, -0.6, 0.6));
    }
}

// One of everything that the exact classes are not closed under, and what they are.
static void operation(Maker *m)
{
    switch (below(m, 8)) {
    case 0:
        solid(m);
        fprintf(m->out, ".offset(radius: %.9g)", length(m, 0.05, 0.3));
        return;
    case 1:
        ball(m, 0.5, 0.8);
        fprintf(m->out, ".scale(1, %.9g, %.9g).offset(radius: %.9g)", any(m, 0.8, 1.2), any(m, 0.8, 1.2),
                length(m, -0.2, -0.05));
        return;
    case 2:
        solid(m);
        fprintf(m->out, ".offset(normal: %.9g)", length(m, 0.02, 0.1));
        return;
    case 3:
        fprintf(m->out, "(shell(sphere(%.9g), %.9g) & halfspace((%.3f, 1, 0.2)))", length(m, 0.4, 0.7),
                length(m, 0.05, 0.2), any(m, -1, 1));
        return;
    case 4:
        fprintf(m->out, "(");
        solid(m);
        fprintf(m->out, ".scale(0.4).repeat((%.9g, 0, %.9g)) & sphere(%.9g))", length(m, 0.5, 0.9),
                length(m, -0.3, 0.3), length(m, 0.9, 1.1));
        return;
    case 5:
        fprintf(m->out, "morph(");
        field_of(m);
        fprintf(m->out, ", ");
        solid(m);
        fprintf(m->out, ", %.3f)", any(m, 0.2, 0.8));
        return;
    case 6: blend(m); return;
    default: warp(m);
    }
}

static void operations(Maker *m)
{
    operation(m);
    transform(m, 0.3);
}

// -- the rest of the scene -------------------------------------------------------------------------------------------------------

static void camera(Maker *m, bool near)
{
    double d[3], away = near ? length(m, 0.1, 0.9) : length(m, 2.5, 4);
    direction(m, d);
    fprintf(m->out, "camera { eye: (%.9g, %.9g, %.9g); look_at: (%.9g, %.9g, %.9g); up: (0.1, 1, 0.05); ", away * d[0],
            away * d[1], away * d[2], length(m, -0.1, 0.1), length(m, -0.1, 0.1), length(m, -0.1, 0.1));
    if (below(m, 5))
        fprintf(m->out, "fov: %.9gdeg; }\n", near ? any(m, 60, 100) : any(m, 30, 50));
    else
        fprintf(m->out, "projection: \"orthographic\"; height: %.9g; }\n", length(m, 2, 3));
}

// From near, towards the middle.
static void close_camera(Maker *m)
{
    direction(m, m->toward);
    double away = length(m, 1, 1.8);
    fprintf(m->out,
            "camera { eye: (%.9g, %.9g, %.9g); look_at: (%.9g, %.9g, %.9g); up: (0.1, 1, 0.05); fov: %.9gdeg; }\n",
            away * m->toward[0], away * m->toward[1], away * m->toward[2], length(m, -0.1, 0.1), length(m, -0.1, 0.1),
            length(m, -0.1, 0.1), any(m, 20, 70));
}

static void light(Maker *m, int number, bool unusual)
{
    double d[3];
    direction(m, d);
    int kind = unusual ? 2 + below(m, 4) : below(m, 3);
    double away = m->size * (kind == 2 ? 3 : kind == 3 ? 1e6 : kind == 4 ? 0.3 : 1.2);
    fprintf(m->out, "light l%d { ", number);
    if (kind < 2)
        fprintf(m->out, "direction: (%.9g, %.9g, %.9g); ", d[0], d[1], d[2]);
    else
        fprintf(m->out, "at: (%.9g, %.9g, %.9g); ", away * d[0], away * d[1], away * d[2]);
    if (kind >= 2 && !below(m, 3)) fprintf(m->out, "fade: %.9g; ", away * any(m, 0.5, 2));
    if (kind >= 2 && !below(m, 3)) {
        fprintf(m->out, "direction: (%.9g, %.9g, %.9g); cone: %.9gdeg; soft: %.9gdeg; ", any(m, -0.1, 0.1) - d[0],
                any(m, -0.1, 0.1) - d[1], any(m, -0.1, 0.1) - d[2], any(m, 10, 60), any(m, 5, 20));
    }
    if (unusual && !below(m, 4)) fprintf(m->out, "shadow: false; ");
    fprintf(m->out, "color: (%.9g, %.9g, %.9g); }\n", any(m, 0.2, 0.6), any(m, 0.2, 0.6), any(m, 0.2, 0.6));
}

static void object(Maker *m, SceneClass kind)
{
    switch (kind) {
    case SCENE_QUADRICS:
    case SCENE_LIGHTS: quadric(m); return;
    case SCENE_DEGENERATE: degenerate(m); return;
    case SCENE_FREEFORM: freeform(m, 1 + below(m, 40)); return;
    case SCENE_BASES: free_base(m); return;
    case SCENE_SETS: set(m, 3, quadric); return;
    case SCENE_FREE_SETS: free_sets(m); return;
    case SCENE_EYE:
        if (below(m, 2))
            freeform(m, 3 + below(m, 8));
        else
            quadric(m);
        return;
    case SCENE_FAMILY: family(m); return;
    case SCENE_MORPHS: morph(m); return;
    case SCENE_FIELDS: fields(m); return;
    case SCENE_STEEP: steep(m); return;
    case SCENE_OPERATIONS: operations(m); return;
    default: faces(m); return;
    }
}

RandomScene random_scene(SceneClass kind, uint64_t seed)
{
    static const double sizes[] = {1, 1, 1, 1e-3, 1e3};
    RandomScene scene;
    size_t bytes;
    Maker m = {.out = open_memstream(&scene.text, &bytes), .state = seed * 1000003 + (uint64_t)kind};
    if (!m.out) abort();
    m.size = scene.size = sizes[below(&m, 5)];
    fprintf(m.out, "scn 1;\n// class: %s, seed %llu\n", scene_class_names[kind], (unsigned long long)seed);
    if (kind == SCENE_STEEP)
        close_camera(&m);
    else
        camera(&m, kind == SCENE_EYE);
    int lights = kind == SCENE_LIGHTS ? 2 + below(&m, 2) : 1 + !below(&m, 3);
    for (int k = 0; k < lights; k++) light(&m, k, kind == SCENE_LIGHTS);
    fprintf(m.out, "background { color: (0.1, 0.1, 0.2); }\n");
    int objects = kind == SCENE_QUADRICS || kind == SCENE_LIGHTS ? 1 + below(&m, 4)
                  : kind == SCENE_DEGENERATE                     ? 1 + below(&m, 2)
                                                                 : 1;
    for (int k = 0; k < objects; k++) {
        fprintf(
            m.out,
            "material m%d { color: (%.3f, %.3f, %.3f); ambient: 0.1; diffuse: 0.7; specular: %.3f; shininess: %d; }\n",
            k, any(&m, 0.3, 1), any(&m, 0.3, 1), any(&m, 0.3, 1), below(&m, 2) * 0.4, 5 + below(&m, 40));
        fprintf(m.out, "object o%d = ", k);
        object(&m, kind);
        fprintf(m.out, ";\n");
    }
    fprintf(m.out, "scene { ");
    for (int k = 0; k < objects; k++) fprintf(m.out, "o%d.paint(m%d); ", k, k);
    fprintf(m.out, "}\n");
    fclose(m.out);
    return scene;
}
