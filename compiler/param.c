#include "compiler/param.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/value.h"
#include "lang/intern.h"

int param_size(ParamType type)
{
    switch (type) {
    case PARAM_STRING: return 0;
    case PARAM_VEC2: return 2;
    case PARAM_VEC3:
    case PARAM_COLOR: return 3;
    default: return 1;
    }
}

const char *param_type_name(ParamType type)
{
    static const char *const names[] = {
        [PARAM_BOOL] = "bool",     [PARAM_INT] = "int",     [PARAM_STRING] = "string",
        [PARAM_SCALAR] = "scalar", [PARAM_ANGLE] = "angle", [PARAM_TIME] = "time",
        [PARAM_VEC2] = "vec2",     [PARAM_VEC3] = "vec3",   [PARAM_COLOR] = "color",
    };
    return names[type];
}

// What is wanted of each type, for messages.
static const char *example(ParamType type)
{
    static const char *const examples[] = {
        [PARAM_BOOL] = "true or false",
        [PARAM_INT] = "a whole number as 5",
        [PARAM_STRING] = "a text",
        [PARAM_SCALAR] = "a number as 0.5",
        [PARAM_ANGLE] = "an angle as 30deg",
        [PARAM_TIME] = "a time as 2s",
        [PARAM_VEC2] = "a vector as (1, 2)",
        [PARAM_VEC3] = "a vector as (1, 2, 3)",
        [PARAM_COLOR] = "a color as #ff8000 or, in linear light, (1, 0.5, 0)",
    };
    return examples[type];
}

static const char *skip_space(const char *at)
{
    while (*at == ' ' || *at == '\t') at++;
    return at;
}

// A decimal number; unlike strtod alone neither hexadecimal nor a name of a value.
static bool read_number(const char **at, double *number)
{
    const char *begin = skip_space(*at);
    const char *digits = begin + (*begin == '-' || *begin == '+');
    if (!(digits[0] >= '0' && digits[0] <= '9') && !(digits[0] == '.' && digits[1] >= '0' && digits[1] <= '9'))
        return false;
    if (digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X')) return false;
    char *end;
    *number = strtod(begin, &end);
    *at = end;
    return isfinite(*number);
}

static bool read_end(const char *at)
{
    return !*skip_space(at);
}

static bool read_word(const char **at, const char *word)
{
    size_t length = strlen(word);
    if (strncmp(*at, word, length)) return false;
    *at += length;
    return true;
}

static bool read_unit(const char **at, ParamType type, double *number)
{
    static const struct {
        const char *word;
        ParamType type;
        double factor;
    } units[] = {
        {"deg", PARAM_ANGLE, M_PI / 180}, {"rad", PARAM_ANGLE, 1}, {"turn", PARAM_ANGLE, 2 * M_PI},
        {"ms", PARAM_TIME, 1e-3},         {"s", PARAM_TIME, 1},
    };
    for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
        if (units[i].type != type || !read_word(at, units[i].word)) continue;
        *number *= units[i].factor;
        return true;
    }
    return *number == 0; // 0 has every unit
}

static bool read_vector(const char *at, int size, double *numbers)
{
    at = skip_space(at);
    bool bracket = *at == '(';
    at += bracket;
    for (int k = 0; k < size; k++) {
        if (k && *(at = skip_space(at)) == ',')
            at++;
        else if (k)
            return false;
        if (!read_number(&at, &numbers[k])) return false;
    }
    at = skip_space(at);
    if (bracket && *at++ != ')') return false;
    return read_end(at);
}

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

static bool read_color(const char *at, double *numbers)
{
    at = skip_space(at);
    if (*at != '#') return read_vector(at, 3, numbers);
    at++;
    size_t count = strcspn(at, " \t");
    if ((count != 3 && count != 6) || !read_end(at + count)) return false;
    for (int k = 0; k < 3; k++) {
        int high = hex_digit(count == 3 ? at[k] : at[2 * k]);
        int low = hex_digit(count == 3 ? at[k] : at[2 * k + 1]);
        if (high < 0 || low < 0) return false;
        numbers[k] = srgb_to_linear((16 * high + low) / 255.0);
    }
    return true;
}

static const char *read_string(Arena *arena, const char *text)
{
    size_t length = strlen(text);
    if (length >= 2 && text[0] == '"' && text[length - 1] == '"') return arena_text(arena, text + 1, length - 2);
    return arena_text(arena, text, length);
}

const char *param_parse_type(Arena *arena, ParamType type, const char *text, ParamValue *value)
{
    *value = (ParamValue){.text = NULL};
    const char *at = skip_space(text);
    bool good = false;
    switch (type) {
    case PARAM_BOOL:
        good = (read_word(&at, "true") && (value->number[0] = 1)) || read_word(&at, "false");
        good = good && read_end(at);
        break;
    case PARAM_INT:
        good = read_number(&at, &value->number[0]) && read_end(at);
        if (good && (value->number[0] != floor(value->number[0]) || fabs(value->number[0]) > 0x1p53)) good = false;
        break;
    case PARAM_STRING:
        value->text = read_string(arena, text);
        good = true;
        break;
    case PARAM_SCALAR: good = read_number(&at, &value->number[0]) && read_end(at); break;
    case PARAM_ANGLE:
    case PARAM_TIME:
        good = read_number(&at, &value->number[0]);
        if (good && read_end(at) && value->number[0] != 0) {
            return arena_printf(arena, "\"%s\" has no unit: write %s%s", text, text, type == PARAM_ANGLE ? "deg" : "s");
        }
        good = good && read_unit(&at, type, &value->number[0]) && read_end(at);
        break;
    case PARAM_VEC2: good = read_vector(at, 2, value->number); break;
    case PARAM_VEC3: good = read_vector(at, 3, value->number); break;
    case PARAM_COLOR: good = read_color(at, value->number); break;
    }
    if (good) return NULL;
    return arena_printf(arena, "\"%s\" is no %s: write %s", text, param_type_name(type), example(type));
}

const char *param_text(Arena *arena, ParamType type, const ParamValue *value)
{
    const double *n = value->number;
    switch (type) {
    case PARAM_BOOL: return n[0] ? "true" : "false";
    case PARAM_INT: return arena_printf(arena, "%.0f", n[0]);
    case PARAM_STRING: return value->text;
    case PARAM_SCALAR: return arena_printf(arena, "%.9g", n[0]);
    case PARAM_ANGLE: return arena_printf(arena, "%.9gdeg", n[0] * (180 / M_PI));
    case PARAM_TIME: return arena_printf(arena, "%.9gs", n[0]);
    case PARAM_VEC2: return arena_printf(arena, "(%.9g, %.9g)", n[0], n[1]);
    default: return arena_printf(arena, "(%.9g, %.9g, %.9g)", n[0], n[1], n[2]);
    }
}

const char *param_test(Arena *arena, const IrParam *param, const ParamValue *value)
{
    ParamType type = (ParamType)param->type;
    if (param->choices) {
        const char *text = param_text(arena, type, value), *all = NULL;
        for (const char *const *choice = param->choices; *choice; choice++) {
            if (!strcmp(*choice, text)) return NULL;
            all = all ? arena_printf(arena, "%s, %s", all, *choice) : *choice;
        }
        bool numbers = type != PARAM_STRING && type != PARAM_BOOL;
        return arena_printf(arena, "%s is none of the choices: write one of %s%s", text, all ? all : "none",
                            numbers ? "; a range is written low .. high" : "");
    }
    if (!param->ranged) return NULL;
    for (int k = 0; k < param_size(type); k++) {
        if (value->number[k] >= param->low && value->number[k] <= param->high) continue;
        // A vector is told by its number that is beyond.
        ParamType part = param_size(type) == 1 ? type : PARAM_SCALAR;
        return arena_printf(arena, "%s is beyond the range %s .. %s",
                            param_text(arena, part, &(ParamValue){.number = {value->number[k]}}),
                            param_text(arena, part, &(ParamValue){.number = {param->low}}),
                            param_text(arena, part, &(ParamValue){.number = {param->high}}));
    }
    return NULL;
}

const char *param_parse(Arena *arena, const IrParam *param, const char *text, ParamValue *value)
{
    const char *wrong = param_parse_type(arena, (ParamType)param->type, text, value);
    return wrong ? wrong : param_test(arena, param, value);
}

const char *param_nearest(const Ir *ir, const char *name)
{
    const char **names = arena_array(ir->arena, const char *, ir->param_count);
    for (uint32_t i = 0; i < ir->param_count; i++) names[i] = ir->params[i].name;
    return nearest_name(name, names, (int)ir->param_count);
}
