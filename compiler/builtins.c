// A signature is read by a scanner of its own, some fifty lines, rather than by the parser of scenes: it has marks
// that the language has not (`type?`, `later`, `same`), and reading the few that a scene calls must cost nothing.
#include "compiler/builtins.h"

#include <assert.h>
#include <ctype.h>
#include <string.h>

#include "compiler/program.h"

const Builtin builtins[BUILTIN_END] = {
#define BUILTIN(id, kind, since, signature, doc) [BUILTIN_##id] = {signature, doc, KIND_##kind, SINCE_##since},
#include "compiler/builtins.def"
#undef BUILTIN
};

typedef struct Reader {
    Unit *unit;
    const char *at;
} Reader;

static void skip_space(Reader *r)
{
    while (*r->at == ' ') r->at++;
}

static bool skip(Reader *r, const char *mark)
{
    skip_space(r);
    size_t length = strlen(mark);
    if (strncmp(r->at, mark, length)) return false;
    if (isalpha((unsigned char)mark[0]) && isalnum((unsigned char)r->at[length]))
        return false; // only the beginning of a word
    r->at += length;
    return true;
}

static Name read_word(Reader *r)
{
    skip_space(r);
    const char *begin = r->at;
    while (isalnum((unsigned char)*r->at) || *r->at == '_') r->at++;
    assert(r->at > begin && "a signature has a word here");
    return name_of(&r->unit->names, begin, (size_t)(r->at - begin));
}

static Type read_type(Reader *r, uint8_t *generic)
{
    static const struct {
        const char *word;
        TypeKind kind;
        Generic generic;
    } special[] = {
        {"number", TYPE_NUMBER, GENERIC_NUMBER},
        {"vector", TYPE_VEC3, GENERIC_VECTOR},
        {"numeric", TYPE_NUMBER, GENERIC_NUMERIC},
        {"movable", TYPE_OBJECT, GENERIC_MOVABLE},
        {"any", TYPE_ANY, GENERIC_NONE},
        {"same", TYPE_ANY, GENERIC_NONE},
        {"part", TYPE_PART, GENERIC_NONE},
        {"background", TYPE_BACKGROUND, GENERIC_NONE},
        {"animation", TYPE_ANIMATION, GENERIC_NONE},
    };
    *generic = GENERIC_NONE;
    if (skip(r, "[")) {
        Type list = type_list(read_type(r, generic));
        bool closed = skip(r, "]");
        assert(closed && "a list type of a signature is closed");
        (void)closed;
        return list;
    }
    Name word = read_word(r);
    Type type;
    if (type_named(word, &type)) return type;
    for (size_t i = 0; i < sizeof special / sizeof *special; i++) {
        if (strcmp(word, special[i].word)) continue;
        *generic = (uint8_t)special[i].generic;
        return type_of(special[i].kind);
    }
    assert(false && "a signature names types that there are");
    return type_of(TYPE_ERROR);
}

// A default reaches to the next word or mark of the signature outside brackets and strings.
static const char *read_default(Reader *r)
{
    skip_space(r);
    const char *begin = r->at;
    int open = 0;
    bool quoted = false;
    for (; *r->at; r->at++) {
        char c = *r->at;
        if (c == '"') quoted = !quoted;
        if (quoted) continue;
        if (c == '(') open++;
        if (open == 0 && (c == ',' || c == ')' || !strncmp(r->at, " in ", 4) || !strncmp(r->at, " later", 6))) break;
        if (c == ')') open--;
    }
    return arena_text(&r->unit->arena, begin, (size_t)(r->at - begin));
}

static const char *const *read_choices(Reader *r)
{
    enum { MOST = 8 };
    const char **choices = arena_array(&r->unit->arena, const char *, MOST + 1);
    int count = 0;
    bool open = skip(r, "[");
    assert(open && "choices stand in [ ]");
    (void)open;
    while (skip(r, "\"")) {
        assert(count < MOST && "few choices");
        const char *end = strchr(r->at, '"');
        choices[count++] = arena_text(&r->unit->arena, r->at, (size_t)(end - r->at));
        r->at = end + 1;
        skip(r, ",");
    }
    skip(r, "]");
    return choices;
}

static void read_parameter(Reader *r, Callable *callable, Parameter *p)
{
    p->name = read_word(r);
    skip(r, ":");
    p->type = read_type(r, &p->generic);
    // The range of a function of numbers is one of their dimension.
    if (type_is(p->type, TYPE_RANGE) && builtins[callable->id].kind == KIND_FUNCTION) p->generic = GENERIC_RANGE;
    p->default_from = -1;
    p->optional = skip(r, "?");
    if (skip(r, "=")) {
        p->default_text = read_default(r);
        for (uint32_t i = 0; i < callable->count; i++) {
            if (!strcmp(callable->parameters[i].name, p->default_text)) p->default_from = (int)i;
        }
    }
    if (skip(r, "in")) p->choices = read_choices(r);
    p->later = skip(r, "later");
}

Name builtin_name(Unit *unit, BuiltinId id)
{
    return name_of(&unit->names, builtins[id].signature, strcspn(builtins[id].signature, "(:"));
}

Callable *builtin_callable(Unit *unit, BuiltinId id)
{
    const Builtin *builtin = &builtins[id];
    Reader r = {unit, builtin->signature};
    Callable *callable = arena_new(&unit->arena, Callable);
    callable->name = read_word(&r);
    callable->kind = CALLABLE_BUILTIN;
    callable->state = CHECK_DONE;
    callable->declared = true;
    callable->id = (uint16_t)id;
    int most = 1; // parameters are separated by commas, so there are at most that many
    for (const char *c = r.at; *c; c++) most += *c == ',';
    callable->parameters = arena_array(&unit->arena, Parameter, most);
    bool called = skip(&r, "(");
    assert(called && "the signature of what is called has parentheses");
    (void)called;
    while (!skip(&r, ")")) {
        read_parameter(&r, callable, &callable->parameters[callable->count]);
        callable->count++;
        skip(&r, ",");
    }
    skip(&r, "->");
    skip_space(&r);
    callable->result_same = !strcmp(r.at, "same");
    uint8_t generic;
    callable->result = read_type(&r, &generic);
    return callable;
}

Type builtin_constant_type(BuiltinId id)
{
    assert(builtins[id].kind == KIND_CONSTANT && "only constants have a type of their own");
    Type type = type_of(TYPE_NUMBER);
    const char *text = strchr(builtins[id].signature, ':') + 2;
    bool known = type_named(text, &type);
    assert(known && "a constant has a type that authors can write");
    (void)known;
    return type;
}
