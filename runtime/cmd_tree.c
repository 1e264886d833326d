// scn tree: what a scene is made of (runtime/tree.h), as lines or as JSON.
//
//     wheel ×3                     set        6.2   ±turn   (-1, -1, 0) .. (1, 1, 0.3)     brass
//     ├─ cylinder                  set        …
//     └─ − box ×12                 set        …
//
// A line has the name (or word, or kind), how many such siblings it stands for ("(of 9)": of all its uses), the class, the cost inside of what
// is around it, what moves it, the bounds and the material. "−" is taken away; what is hidden is in parentheses. Colours are those of messages: names bold, what moves yellow, what is hidden
// dim.
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/frame.h"
#include "lang/utf8.h"
#include "runtime/command.h"
#include "runtime/scene.h"
#include "runtime/tree.h"

enum { LABEL_MOST = 60, MOVERS_MOST = 24, SIBLINGS_MOST = 400, TEXT_SIZE = 512 };

typedef struct Printer {
    const Tree *tree;
    bool color;
    int depth; // levels to show
    int label_width, mover_width, bounds_width;
} Printer;

// --- Texts

static int width_of(const char *text)
{
    int width = 0;
    for (size_t length = strlen(text), at = 0; at < length;) {
        uint32_t code;
        at += (size_t)utf8_read(text + at, length - at, &code);
        width += (int)utf8_columns(code, (uint32_t)width);
    }
    return width;
}

static void append(char *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void append(char *text, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    size_t used = strlen(text);
    vsnprintf(text + used, TEXT_SIZE - used, format, arguments);
    va_end(arguments);
}

// "wheel", "tooth 1 … tooth 12", "box", "union"; the count and what is special.
static void label_text(const TreeNode *node, bool root, char text[TEXT_SIZE])
{
    text[0] = 0;
    if (node->subtracted) append(text, "− ");
    if (node->hidden) append(text, "(");
    if (node->name && node->last_name)
        append(text, "%s … %s", node->name, node->last_name);
    else
        append(text, "%s",
               root         ? "scene"
               : node->name ? node->name
               : node->word ? node->word
                            : tree_kind_name((TreeKind)node->kind));
    if (node->name && node->word) append(text, " = %s", node->word);
    if (node->count > 1) append(text, " ×%" PRIu32, node->count);
    if (node->uses > node->count) append(text, " (of %" PRIu64 ")", node->uses);
    if (node->hidden) append(text, node->conditional ? ") hidden now" : ") hidden");
}

static void movers_text(const Printer *p, const TreeNode *node, char text[TEXT_SIZE])
{
    text[0] = 0;
    int more = 0;
    for (uint32_t k = 0; k < p->tree->param_count + 2; k++) {
        if (!tree_moves(node, k)) continue;
        const char *name = tree_mover_name(p->tree, k);
        if (more || (*text && strlen(text) + strlen(name) + 2 > MOVERS_MOST))
            more++;
        else
            append(text, "%s%s", *text ? ", " : "", name);
    }
    if (more) append(text, " +%d", more);
}

static void bounds_text(const Bounds *b, char text[TEXT_SIZE])
{
    text[0] = 0;
    bool ends = false;
    for (int k = 0; k < 3; k++) ends |= isfinite(b->low[k]) || isfinite(b->high[k]);
    if (bounds_empty(b)) {
        append(text, "nothing");
    } else if (!ends) {
        append(text, "without end");
    } else {
        for (int side = 0; side < 2; side++) {
            for (int k = 0; k < 3; k++) {
                double v = side ? b->high[k] : b->low[k];
                append(text, "%s", k ? ", " : side ? ") .. (" : "(");
                if (isfinite(v))
                    append(text, "%.4g", fabs(v) < 5e-10 ? 0 : v);
                else
                    append(text, v < 0 ? "-∞" : "∞");
            }
        }
        append(text, ")");
    }
}

static void material_text(const Printer *p, const TreeNode *node, char text[TEXT_SIZE])
{
    text[0] = 0;
    if (node->material == TREE_MATERIALS)
        append(text, "several materials");
    else if (node->material != TREE_NO_MATERIAL)
        append(text, "%s", p->tree->materials[node->material].name);
}

// --- Lines

typedef void Visit(Printer *p, const TreeNode *node, const char *lead, int level, double share);

static int shorter(int width, int most)
{
    return width < most ? width : most;
}

static void measure(Printer *p, const TreeNode *node, const char *lead, int level, double share)
{
    char text[TEXT_SIZE];
    label_text(node, level == 0, text);
    int width = shorter(width_of(lead) + width_of(text), LABEL_MOST);
    if (width > p->label_width) p->label_width = width;
    movers_text(p, node, text);
    if (width_of(text) > p->mover_width) p->mover_width = width_of(text);
    bounds_text(&node->inside, text);
    if (width_of(text) > p->bounds_width) p->bounds_width = width_of(text);
}

static void put_column(const char *text, int width)
{
    int spaces = width - width_of(text);
    printf("%s%*s  ", text, spaces > 0 ? spaces : 0, "");
}

static int cost_digits(double cost)
{
    return cost >= 100 ? 0 : cost >= 1 ? 2 : 4;
}

static void print_line(Printer *p, const TreeNode *node, const char *lead, int level, double share)
{
    char text[TEXT_SIZE], material[TEXT_SIZE];
    label_text(node, level == 0, text);
    const char *on = !p->color                  ? ""
                     : node->hidden             ? "\033[2m"
                     : node->name || level == 0 ? "\033[1m"
                                                : "",
               *off = *on ? "\033[0m" : "";
    int spaces = p->label_width - width_of(lead) - width_of(text);
    printf("%s%s%s%s%*s  ", lead, on, text, off, spaces > 0 ? spaces : 0, "");
    printf("%-9s  ", tree_class_name(node));
    printf("%8.*f  ", cost_digits(node->cost * share), node->cost * share);
    movers_text(p, node, text);
    if (p->mover_width) {
        printf("%s", p->color ? "\033[33m" : "");
        put_column(text, p->mover_width);
        printf("%s", p->color ? "\033[0m" : "");
    }
    bounds_text(&node->inside, text);
    material_text(p, node, material);
    if (*material)
        put_column(text, p->bounds_width);
    else
        printf("%s", text);
    printf("%s\n", material);
}

static void print_more(const Printer *p, const char *lead, uint64_t count)
{
    printf("%s└─ %s… and %" PRIu64 " more (--json has all)%s\n", lead, p->color ? "\033[2m" : "", count,
           p->color ? "\033[0m" : "");
}

// Visits a node and what is below it. `lead` is what stands before its line, `below` before the lines of its parts, `share` the part of the
// costs that counts inside of what is around.
static void visit(Printer *p, const TreeNode *node, const char *lead, const char *below, int level, double share,
                  Visit *each)
{
    share *= node->share;
    each(p, node, lead, level, share);
    if (level + 1 >= p->depth) return;
    uint64_t shown = 0, all = 0;
    for (const TreeNode *part = node->first; part; part = part->next) all++;
    for (const TreeNode *part = node->first; part && shown < SIBLINGS_MOST; part = part->next, shown++) {
        bool last = !part->next;
        size_t length = strlen(below) + 8;
        char *first = malloc(length), *others = malloc(length);
        if (!first || !others) abort();
        snprintf(first, length, "%s%s", below, last ? "└─ " : "├─ ");
        snprintf(others, length, "%s%s", below, last ? "   " : "│  ");
        visit(p, part, first, others, level + 1, share, each);
        free(first);
        free(others);
    }
    if (shown < all && each == print_line) print_more(p, below, all - shown);
}

static void print_tree(const Options *options, const Tree *tree)
{
    Printer p = {
        .tree = tree, .color = command_color(options, stdout), .depth = options->depth ? options->depth : INT32_MAX};
    visit(&p, tree->root, "", "", 0, 1, measure);
    printf("%-*s  %-9s  %8s  ", p.label_width, "", "class", "cost");
    if (p.mover_width) printf("%-*s  ", p.mover_width, "moved by");
    printf("%s%s\n", "bounds", tree->material_count ? " and material" : "");
    visit(&p, tree->root, "", "", 0, 1, print_line);
    const TreeNode *root = tree->root;
    printf("\n%" PRIu64 " quadric%s", root->quadrics, root->quadrics == 1 ? "" : "s");
    if (root->supports) printf(" and %" PRIu64 " perturbation%s", root->supports, root->supports == 1 ? "" : "s");
    printf("; a ray through the scene's bounds is expected to meet the bounds of %.*f\n", cost_digits(root->cost),
           root->cost);
}

// --- JSON

static cJSON *bounds_json(const Bounds *b)
{
    if (bounds_empty(b)) return cJSON_CreateNull();
    cJSON *json = cJSON_CreateArray();
    for (int side = 0; side < 2; side++) {
        cJSON *point = cJSON_CreateArray();
        for (int k = 0; k < 3; k++) {
            double v = side ? b->high[k] : b->low[k];
            cJSON_AddItemToArray(point, isfinite(v) ? cJSON_CreateNumber(v) : cJSON_CreateNull()); // null: no end
        }
        cJSON_AddItemToArray(json, point);
    }
    return json;
}

static cJSON *movers_json(const Tree *tree, const TreeNode *node)
{
    cJSON *json = cJSON_CreateArray();
    for (uint32_t k = 0; k < tree->param_count + 2; k++) {
        if (tree_moves(node, k)) cJSON_AddItemToArray(json, cJSON_CreateString(tree_mover_name(tree, k)));
    }
    return json;
}

static cJSON *node_json(const ScnScene *scene, const Tree *tree, const TreeNode *node, int depth, double share)
{
    static const char *const rates[] = {"const", "frame", "point"};
    cJSON *json = cJSON_CreateObject();
    share *= node->share;
    cJSON_AddStringToObject(json, "kind", tree_kind_name((TreeKind)node->kind));
    if (node->name) cJSON_AddStringToObject(json, "name", node->name);
    if (node->last_name) cJSON_AddStringToObject(json, "last_name", node->last_name);
    if (node->word) cJSON_AddStringToObject(json, "word", node->word);
    cJSON_AddStringToObject(json, "class", tree_class_name(node));
    cJSON_AddBoolToObject(json, "exact", node->class != CLASS_GENERAL);
    cJSON_AddStringToObject(json, "rate", rates[node->rate]);
    cJSON_AddItemToObject(json, "moved_by", movers_json(tree, node));
    cJSON_AddNumberToObject(json, "count", node->count);
    if (node->uses > 1) cJSON_AddNumberToObject(json, "uses", (double)node->uses);
    cJSON_AddNumberToObject(json, "quadrics", (double)node->quadrics);
    cJSON_AddNumberToObject(json, "perturbations", (double)node->supports);
    cJSON_AddNumberToObject(json, "cost", node->cost * share);
    cJSON_AddItemToObject(json, "bounds", bounds_json(&node->inside));
    if (node->material == TREE_MATERIALS) cJSON_AddStringToObject(json, "material", "several");
    if (node->material >= 0) cJSON_AddStringToObject(json, "material", tree->materials[node->material].name);
    if (node->subtracted) cJSON_AddBoolToObject(json, "subtracted", true);
    if (node->hidden) cJSON_AddBoolToObject(json, "hidden", true);
    if (node->conditional) cJSON_AddBoolToObject(json, "conditional", true);
    Place place = node->span.end ? source_place(&scene->unit.sources, node->span.begin) : (Place){0};
    if (place.source && !place.source->prelude) {
        cJSON *at = cJSON_AddObjectToObject(json, "at");
        cJSON_AddStringToObject(at, "path", place.source->path);
        cJSON_AddNumberToObject(at, "line", place.line);
        cJSON_AddNumberToObject(at, "column", place.column);
    }
    if (!node->first || depth <= 1) return json;
    cJSON *parts = cJSON_AddArrayToObject(json, "parts");
    for (const TreeNode *part = node->first; part; part = part->next)
        cJSON_AddItemToArray(parts, node_json(scene, tree, part, depth - 1, share));
    return json;
}

static cJSON *tree_json(const ScnScene *scene, const Tree *tree, const TreeMoment *moment, int depth)
{
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "scene", scene->package->scene);
    cJSON_AddBoolToObject(json, "package", scene->is_package);
    cJSON_AddNumberToObject(json, "time", moment->time);
    cJSON_AddStringToObject(json, "cost_unit",
                            "quadrics whose bounds a ray through the scene's bounds is expected to meet");
    cJSON_AddItemToObject(json, "scene_bounds", bounds_json(&tree->scene));
    cJSON_AddItemToObject(json, "tree", node_json(scene, tree, tree->root, depth, 1));
    return json;
}

// --- The command

static int show(const Options *options, ScnScene *scene, const CompileElaborated *elaborated)
{
    const Plan *plan = scene->package->plan;
    Arena arena = {0};
    double *values = arena_array(&arena, double, plan->slot_count);
    TreeMoment moment = {.inputs = scene->inputs, .values = values};
    FrameError error;
    int status = command_time(options, scene, &moment.time, &moment.frame) ? EXIT_DONE : EXIT_USAGE;
    if (status == EXIT_DONE &&
        !frame_evaluate(plan, &(FrameInput){moment.time, moment.frame, moment.inputs}, values, &error)) {
        status = command_result(scene, scene_fail_frame(scene, &error, moment.time, moment.frame));
    }
    if (status == EXIT_DONE) {
        Tree *tree = scene->is_package
                         ? tree_of_plan(&arena, plan, &moment)
                         : tree_of_ir(&arena, &scene->unit.sources, elaborated->ir, elaborated->root, plan, &moment);
        if (options->json)
            command_json(stdout, tree_json(scene, tree, &moment, options->depth ? options->depth : INT32_MAX));
        else
            print_tree(options, tree);
    }
    arena_release(&arena);
    return status;
}

int command_tree(const Options *options)
{
    CommandScene parts;
    CompileElaborated elaborated = {0};
    command_describe(options, &parts);
    ScnScene *scene = scene_new(&parts.desc, &(CompileOptions){.elaborated = &elaborated});
    int status = command_loaded(scene);
    if (status != EXIT_DONE) return status;
    status = show(options, scene, &elaborated);
    scn_free(scene);
    return status;
}
