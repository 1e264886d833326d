// The text form of the IR, written and read.
//
//     ir 1                                         // version, the first line
//     param "squash" scalar slot 0 value 0.2 range 0 1 doc "How far."
//     param "style" string structure text "soft" choices "soft" "hard"
//     %1 = param[0]
//     %2 = mul %1 0.5                              // frame
//     %3 = quadric -1 -1 -1 0 0 0 0 0 0 %2         // frame quadric
//     %4 = named "ball" %3                         // frame quadric
//     camera %5   background %6   light %7   assert %8   patch %9   scene %4      (a line each)
//     animation 4 24                               // seconds, frames a second
//
// A node a line, in evaluation order, numbered by what the scene reaches. A number stands for its OP_CONST. `//`
// begins a comment. Numbers have as many digits as bring the same bits back. The reader builds by ir_node(), which
// folds; since IR is folded, what was printed comes back.
#include "compiler/ir.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/leaf.h"
#include "compiler/pairs.h"

static const char *const param_type_names[] = {"bool", "int",  "string", "scalar", "angle",
                                               "time", "vec2", "vec3",   "color"};
static const char *const rate_names[] = {"const", "frame", "point"};
static const char *const class_names[] = {"", "quadric", "freeform", "set", "general"};
enum { PARAM_TYPE_COUNT = sizeof param_type_names / sizeof *param_type_names };

static bool has_index(IrOp op)
{
    return op == OP_PARAM || op == OP_CAMERA || op == OP_LIGHT || op == OP_ENTRY || op == OP_COEFFICIENT;
}
static bool has_text(IrOp op)
{
    return op == OP_NAMED || op == OP_ASSERT || op == OP_PATCH;
}

// --- writing

static void print_number(double value, FILE *out)
{
    char text[40];
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value) break;
    }
    fputs(isnan(value) ? "nan" : text, out);
}

static void print_text(const char *text, FILE *out)
{
    fputc('"', out);
    for (const unsigned char *c = (const unsigned char *)text; *c; c++) {
        if (*c == '"' || *c == '\\') {
            fprintf(out, "\\%c", *c);
        } else if (*c < 32 || *c == 127) {
            fprintf(out, "\\x%02x", *c);
        } else {
            fputc(*c, out);
        }
    }
    fputc('"', out);
}

static void print_param(const IrParam *param, FILE *out)
{
    static const int values[PARAM_TYPE_COUNT] = {1, 1, 0, 1, 1, 1, 2, 3, 3};
    fputs("param ", out);
    print_text(param->name, out);
    fprintf(out, " %s", param_type_names[param->type]);
    if (param->structure) {
        fputs(" structure", out);
    } else {
        fprintf(out, " slot %u", param->slot);
    }
    if (values[param->type]) fputs(" value", out);
    for (int k = 0; k < values[param->type]; k++) {
        fputc(' ', out);
        print_number(param->value[k], out);
    }
    if (param->ranged) {
        fputs(" range ", out);
        print_number(param->low, out);
        fputc(' ', out);
        print_number(param->high, out);
    }
    if (param->text) {
        fputs(" text ", out);
        print_text(param->text, out);
    }
    if (param->choices) {
        fputs(" choices", out);
        for (const char *const *choice = param->choices; *choice; choice++) {
            fputc(' ', out);
            print_text(*choice, out);
        }
    }
    if (param->doc) {
        fputs(" doc ", out);
        print_text(param->doc, out);
    }
    fputc('\n', out);
}

static void print_node(const Ir *ir, IrId id, const uint32_t *numbers, FILE *out)
{
    const IrNode *node = ir_at(ir, id);
    fprintf(out, "%%%u = %s", numbers[id], ir_ops[node->op].name);
    if (has_index(node->op)) fprintf(out, "[%u]", node->index);
    if (has_text(node->op)) {
        fputc(' ', out);
        print_text(node->text, out);
    }
    for (uint32_t k = 0; k < node->count; k++) {
        IrId operand = ir_operand(ir, id, k);
        double value;
        fputc(' ', out);
        if (ir_is_const(ir, operand, &value)) {
            print_number(value, out);
        } else {
            fprintf(out, "%%%u", numbers[operand]);
        }
    }
    bool rated = node->rate != RATE_CONST;
    if (rated || node->class) fputs("  //", out);
    if (rated) fprintf(out, " %s", rate_names[node->rate]);
    if (node->class) fprintf(out, " %s", class_names[node->class]);
    fputc('\n', out);
}

void ir_print(const Ir *ir, FILE *out)
{
    Arena scratch = {0};
    bool *reached = ir_reached(ir, &scratch);
    uint32_t *numbers = arena_array(&scratch, uint32_t, ir->count);
    uint32_t next = 1;
    fputs("ir 1\n", out);
    for (uint32_t k = 0; k < ir->param_count; k++) print_param(&ir->params[k], out);
    for (IrId id = 1; id < ir->count; id++) {
        if (!reached[id] || ir_at(ir, id)->op == OP_CONST) continue;
        numbers[id] = next++;
        print_node(ir, id, numbers, out);
    }
    fprintf(out, "camera %%%u\nbackground %%%u\n", numbers[ir->camera], numbers[ir->background]);
    for (uint32_t k = 0; k < ir->light_count; k++) fprintf(out, "light %%%u\n", numbers[ir->lights[k]]);
    for (uint32_t k = 0; k < ir->assert_count; k++) fprintf(out, "assert %%%u\n", numbers[ir->asserts[k]]);
    for (uint32_t k = 0; k < ir->patch_count; k++) fprintf(out, "patch %%%u\n", numbers[ir->patches[k]]);
    fprintf(out, "scene %%%u\nanimation ", numbers[ir->root]);
    print_number(ir->duration, out);
    fputc(' ', out);
    print_number(ir->fps, out);
    fputc('\n', out);
    arena_release(&scratch);
}

// --- reading

typedef struct Known { // a number of the text and its node
    uint32_t number;
    IrId id;
} Known;

typedef struct Reader {
    Ir *ir;
    Arena *arena, *scratch;
    const char *next, *end; // of the line
    uint32_t line;
    Known *known; // ascending by number
    uint32_t known_count, known_capacity;
    IrId *operands;
    uint32_t operand_capacity;
    uint32_t param_capacity, light_capacity, assert_capacity, patch_capacity;
    bool animated;
    IrReadError *error;
    bool failed;
} Reader;

static bool fail(Reader *r, const char *format, ...) __attribute__((format(printf, 2, 3)));
static bool fail(Reader *r, const char *format, ...)
{
    if (!r->failed) {
        va_list values;
        va_start(values, format);
        r->error->line = r->line;
        vsnprintf(r->error->text, sizeof r->error->text, format, values);
        va_end(values);
    }
    r->failed = true;
    return false;
}

static void skip_space(Reader *r)
{
    while (r->next < r->end && isspace((unsigned char)*r->next)) r->next++;
    if (r->end - r->next >= 2 && r->next[0] == '/' && r->next[1] == '/') r->next = r->end;
}

static bool at_end(Reader *r)
{
    skip_space(r);
    return r->next == r->end;
}

// A word of letters, digits and '-', in a buffer of the caller.
static bool read_word(Reader *r, char word[32])
{
    skip_space(r);
    size_t length = 0;
    while (r->next < r->end && (isalnum((unsigned char)*r->next) || *r->next == '-')) {
        if (length == 31) return fail(r, "a word is too long");
        word[length++] = *r->next++;
    }
    word[length] = 0;
    return length > 0 || fail(r, "a word is missing");
}

static bool read_mark(Reader *r, char mark)
{
    skip_space(r);
    if (r->next == r->end || *r->next != mark) return fail(r, "'%c' is missing", mark);
    r->next++;
    return true;
}

static bool read_index(Reader *r, uint32_t *index)
{
    uint64_t value = 0;
    skip_space(r);
    if (r->next == r->end || !isdigit((unsigned char)*r->next)) return fail(r, "a whole number is missing");
    while (r->next < r->end && isdigit((unsigned char)*r->next)) {
        value = value * 10 + (uint64_t)(*r->next++ - '0');
        if (value >= UINT32_MAX) return fail(r, "a number is too large");
    }
    *index = (uint32_t)value;
    return true;
}

static bool read_number(Reader *r, double *value)
{
    char text[64], *stop;
    size_t length = 0;
    skip_space(r);
    while (r->next < r->end && (isalnum((unsigned char)*r->next) || strchr("+-.", *r->next)) && *r->next) {
        if (length == sizeof text - 1) return fail(r, "a number is too long");
        text[length++] = *r->next++;
    }
    text[length] = 0;
    *value = strtod(text, &stop);
    return (length > 0 && *stop == 0) || fail(r, "a number is missing");
}

static int hex_digit(char c)
{
    return isdigit((unsigned char)c) ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static bool read_text(Reader *r, const char **text)
{
    if (!read_mark(r, '"')) return false;
    char *copy = arena_text(r->arena, r->next, (size_t)(r->end - r->next));
    char *to = copy;
    for (; r->next < r->end && *r->next != '"'; r->next++) {
        char c = *r->next;
        if (c == 0) return fail(r, "a zero byte in a text");
        if (c == '\\') {
            ptrdiff_t left = r->end - r->next;
            if (left >= 2 && (r->next[1] == '"' || r->next[1] == '\\')) {
                c = *++r->next;
            } else if (left >= 4 && r->next[1] == 'x' && hex_digit(r->next[2]) >= 0 && hex_digit(r->next[3]) >= 0) {
                c = (char)(16 * hex_digit(r->next[2]) + hex_digit(r->next[3]));
                r->next += 3;
                if (c == 0) return fail(r, "a zero byte in a text");
            } else {
                return fail(r, "an escape that is none");
            }
        }
        *to++ = c;
    }
    *to = 0;
    *text = copy;
    return read_mark(r, '"');
}

static bool read_reference(Reader *r, IrId *id)
{
    uint32_t number;
    if (!read_mark(r, '%') || !read_index(r, &number)) return false;
    uint32_t low = 0, high = r->known_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (r->known[middle].number < number) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    if (low == r->known_count || r->known[low].number != number) return fail(r, "%%%u is not defined before", number);
    *id = r->known[low].id;
    return true;
}

static bool find_op(const char *word, IrOp *op)
{
    for (int k = 1; k < OP_COUNT; k++) {
        if (k != OP_CONST && !strcmp(ir_ops[k].name, word)) {
            *op = (IrOp)k;
            return true;
        }
    }
    return false;
}

static bool read_operands(Reader *r, IrOp op, uint32_t *count)
{
    static const char *const type_names[] = {"nothing",        "a scalar", "a matrix",          "a field",
                                             "a perturbation", "a patch",  "a part of a patch", "a material",
                                             "a camera",       "a light",  "a background",      "an assert"};
    const IrOpInfo *info = &ir_ops[op];
    for (*count = 0; !at_end(r); ++*count) {
        if (info->operands != IR_ANY && *count == info->operands)
            return fail(r, "%s takes %u operands", info->name, *count);
        IrType type = ir_operand_type(op, *count);
        r->operands = array_room(r->scratch, r->operands, *count, &r->operand_capacity, sizeof *r->operands);
        double value;
        if (*r->next == '%') {
            if (!read_reference(r, &r->operands[*count])) return false;
        } else {
            if (!read_number(r, &value)) return false;
            r->operands[*count] = ir_const(r->ir, value);
        }
        if (ir_at(r->ir, r->operands[*count])->type != type) {
            return fail(r, "operand %u of %s is to be %s", *count + 1, info->name, type_names[type]);
        }
    }
    uint32_t least = info->operands == IR_ANY ? info->letters : info->operands;
    bool list = op == OP_UNION || op == OP_FREEFORM || op == OP_DEFORM; // ir_node() makes something of fewer
    if (list && *count + 1 >= least) return true;
    return *count >= least || fail(r, "%s has too few operands", info->name);
}

static bool read_node(Reader *r)
{
    uint32_t number, index = 0, count;
    char word[32];
    const char *text = NULL;
    IrOp op;
    if (!read_mark(r, '%') || !read_index(r, &number) || !read_mark(r, '=') || !read_word(r, word)) return false;
    if (number == 0 || (r->known_count && r->known[r->known_count - 1].number >= number)) {
        return fail(r, "%%%u: numbers ascend", number);
    }
    if (!find_op(word, &op)) return fail(r, "'%s' is no operation", word);
    if (has_index(op) && (!read_mark(r, '[') || !read_index(r, &index) || !read_mark(r, ']'))) return false;
    if (has_text(op) && !read_text(r, &text)) return false;
    if (!read_operands(r, op, &count)) return false;
    if (op == OP_PERTURB && ir_at(r->ir, r->operands[0])->class != CLASS_QUADRIC) {
        return fail(r, "the function of a perturbation is to be a quadric");
    }
    if (op == OP_COEFFICIENT &&
        (index > 9 || !leaf_is_base(r->ir, r->operands[0]) || ir_at(r->ir, r->operands[0])->class != CLASS_QUADRIC)) {
        return fail(r, "coefficients 0 to 9 are of a quadric");
    }
    IrId id;
    if (has_index(op)) {
        id = ir_node_index(r->ir, op, (Span){0}, r->operands, count, index);
    } else if (has_text(op)) {
        id = ir_node_text(r->ir, op, (Span){0}, r->operands, count, text);
    } else {
        id = ir_node(r->ir, op, (Span){0}, r->operands, count);
    }
    r->known = array_room(r->scratch, r->known, r->known_count, &r->known_capacity, sizeof *r->known);
    r->known[r->known_count++] = (Known){number, id};
    return true;
}

static bool read_choices(Reader *r, const char *const **choices)
{
    const char **list = NULL;
    uint32_t count = 0, capacity = 0;
    while (skip_space(r), r->next < r->end && *r->next == '"') {
        list = array_room(r->arena, list, count + 1, &capacity, sizeof *list);
        if (!read_text(r, &list[count++])) return false;
    }
    if (!count) return fail(r, "choices are missing");
    list[count] = NULL;
    *choices = list;
    return true;
}

// One property of a param: a word and what follows it.
static bool read_property(Reader *r, IrParam *param)
{
    static const int values[PARAM_TYPE_COUNT] = {1, 1, 0, 1, 1, 1, 2, 3, 3};
    char word[32];
    if (!read_word(r, word)) return false;
    if (!strcmp(word, "structure")) return param->structure = true;
    if (!strcmp(word, "slot")) return read_index(r, &param->slot);
    if (!strcmp(word, "text")) return read_text(r, &param->text);
    if (!strcmp(word, "doc")) return read_text(r, &param->doc);
    if (!strcmp(word, "choices")) return read_choices(r, &param->choices);
    if (!strcmp(word, "range")) {
        param->ranged = true;
        return read_number(r, &param->low) && read_number(r, &param->high);
    }
    if (strcmp(word, "value")) return fail(r, "'%s' is no property of a param", word);
    for (int k = 0; k < values[param->type]; k++) {
        if (!read_number(r, &param->value[k])) return false;
    }
    return true;
}

static bool read_param(Reader *r)
{
    IrParam param = {0};
    char word[32];
    if (!read_text(r, &param.name) || !read_word(r, word)) return false;
    while (param.type < PARAM_TYPE_COUNT && strcmp(param_type_names[param.type], word)) param.type++;
    if (param.type == PARAM_TYPE_COUNT) return fail(r, "'%s' is no type of a param", word);
    while (!at_end(r)) {
        if (!read_property(r, &param)) return false;
    }
    Ir *ir = r->ir;
    uint32_t slots = param.type == PARAM_VEC2 ? 2 : param.type >= PARAM_VEC3 ? 3 : 1;
    if (!param.structure && param.slot != ir->input_count) return fail(r, "the next slot is %u", ir->input_count);
    if (!param.structure) ir->input_count += slots;
    ir->params = array_room(r->arena, ir->params, ir->param_count, &r->param_capacity, sizeof *ir->params);
    ir->params[ir->param_count++] = param;
    return true;
}

static bool read_part(Reader *r, const char *word, IrType type, IrId *part)
{
    if (*part) return fail(r, "a second '%s'", word);
    if (!read_reference(r, part)) return false;
    return ir_at(r->ir, *part)->type == type || fail(r, "this is no %s", word);
}

static bool read_into(Reader *r, const char *word, IrType type, IrId **list, uint32_t *count, uint32_t *capacity)
{
    IrId id = 0;
    if (!read_part(r, word, type, &id)) return false;
    *list = array_room(r->arena, *list, *count, capacity, sizeof **list);
    (*list)[(*count)++] = id;
    return true;
}

static bool read_animation(Reader *r)
{
    if (r->animated) return fail(r, "a second 'animation'");
    r->animated = true;
    return read_number(r, &r->ir->duration) && read_number(r, &r->ir->fps);
}

static bool read_line(Reader *r)
{
    Ir *ir = r->ir;
    char word[32];
    if (*r->next == '%') return read_node(r); // its operands end the line
    if (!read_word(r, word)) return false;
    bool ok;
    if (!strcmp(word, "param")) {
        ok = read_param(r);
    } else if (!strcmp(word, "camera")) {
        ok = read_part(r, word, IR_CAMERA, &ir->camera);
    } else if (!strcmp(word, "background")) {
        ok = read_part(r, word, IR_BACKGROUND, &ir->background);
    } else if (!strcmp(word, "scene")) {
        ok = read_part(r, word, IR_FIELD, &ir->root);
    } else if (!strcmp(word, "light")) {
        ok = read_into(r, word, IR_LIGHT, &ir->lights, &ir->light_count, &r->light_capacity);
    } else if (!strcmp(word, "assert")) {
        ok = read_into(r, word, IR_ASSERT, &ir->asserts, &ir->assert_count, &r->assert_capacity);
    } else if (!strcmp(word, "patch")) {
        ok = read_into(r, word, IR_PATCH, &ir->patches, &ir->patch_count, &r->patch_capacity);
    } else if (!strcmp(word, "animation")) {
        ok = read_animation(r);
    } else {
        ok = fail(r, "'%s' begins no line", word);
    }
    return ok && (at_end(r) || fail(r, "the line goes on behind its end"));
}

static bool read_first_line(Reader *r)
{
    char word[32];
    uint32_t version;
    if (!read_word(r, word) || strcmp(word, "ir") || !read_index(r, &version) || version != 1 || !at_end(r)) {
        r->failed = false;
        return fail(r, "the first line is to be 'ir 1'");
    }
    return true;
}

static void read_lines(Reader *r, const char *text, size_t length)
{
    const char *end = text + length;
    bool first = true;
    for (const char *line = text; line < end && !r->failed; line = r->end + 1) {
        const char *stop = memchr(line, '\n', (size_t)(end - line));
        r->next = line;
        r->end = stop ? stop : end;
        r->line++;
        if (at_end(r)) continue;
        if (first) {
            first = !read_first_line(r);
        } else {
            read_line(r);
        }
    }
    if (first) fail(r, "the first line is to be 'ir 1'");
}

Ir *ir_read(Arena *arena, const char *text, size_t length, IrReadError *error)
{
    Arena scratch = {0};
    Reader r = {.ir = ir_new(arena), .arena = arena, .scratch = &scratch, .error = error};
    *error = (IrReadError){0};
    read_lines(&r, text, length);
    if (!r.failed && !(r.ir->root && r.ir->camera && r.ir->background))
        fail(&r, "scene, camera or background is missing");
    const char *wrong = r.failed ? NULL : ir_verify(r.ir);
    if (wrong) fail(&r, "%s", wrong);
    arena_release(&scratch);
    return r.failed ? NULL : r.ir;
}
