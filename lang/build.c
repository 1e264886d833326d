// The constructors of the tree. Beside filling in nodes they keep two promises of ast.h: that every list is linked by
// `next`, and that no node is deeper than NODE_DEPTH_MAX. What would be deeper is reported once and cut off, so what
// walks the tree later may recurse.
#include "lang/parser.h"

#include <string.h>

#include "lang/diag.h"
#include "lang/parse.h"

static int depth_of_list(const Node *list)
{
    int depth = -1;
    for (; list; list = list->next) {
        if (list->depth > depth) depth = list->depth;
    }
    return depth;
}

// Sets the depth of a node whose children are complete. A link and its left child are one step together.
static Node *finish(Parser *p, Node *node)
{
    bool link = node_is_link(node);
    int below = depth_of_list(node->b), c = depth_of_list(node->c);
    if (c > below) below = c;
    bool chain = link && node->a && node_is_link(node->a);
    int a = chain ? node->a->depth - 1 : depth_of_list(node->a);
    if (a > below) below = a;
    if (below + 1 > NODE_DEPTH_MAX) {
        if (!p->too_deep) {
            diag(p->unit, node->span, DIAG_TOO_DEEP,
                 "this is nested more than %d deep: give parts of it names with let", NODE_DEPTH_MAX);
        }
        p->too_deep = true;
        node->kind = NODE_ERROR;
        node->a = node->b = node->c = NULL;
        below = -1;
    }
    node->depth = (uint16_t)(below + 1);
    return node;
}

static Node *start(Parser *p, NodeKind kind, Span span)
{
    Node *node = arena_new(&p->unit->tree_arena, Node);
    node->kind = (uint8_t)kind;
    node->span = span;
    node->name_span = span;
    return node;
}

static Node *start_named(Parser *p, NodeKind kind, Span span, Name name, Span name_span)
{
    Node *node = start(p, kind, span);
    node->name = name;
    node->name_span = name_span;
    return node;
}

static Node *start_text(Parser *p, Span span, Text text)
{
    Node *node = start(p, NODE_TEXT, span);
    node->text = arena_text(&p->unit->arena, text.text, text.length);
    node->length = text.length;
    return node;
}

static const char *source_text(const Parser *p, Span span)
{
    return p->source->text + (span.begin - p->source->base);
}

// The source between two places as a message or a fix quotes it: cut after 60 bytes in messages.
static int quoted_length(Span span)
{
    return (int)(span.end - span.begin);
}

static bool is_short(Span span)
{
    return span.end - span.begin <= 60;
}

// --- Lists ---

NodeList list_of(Node *node)
{
    return (NodeList){node, node};
}

NodeList list_add(NodeList list, Node *node)
{
    if (!node) return list;
    if (list.last)
        list.last->next = node;
    else
        list.first = node;
    list.last = node;
    return list;
}

// --- Items ---

static const char *item_word(NodeKind kind)
{
    switch (kind) {
    case NODE_VERSION: return "scn";
    case NODE_INCLUDE: return "include";
    case NODE_USE: return "use";
    case NODE_PARAM: return "param";
    case NODE_FN: return "fn";
    case NODE_TAG: return "tag";
    case NODE_TOOL: return "tool";
    default: return NULL;
    }
}

Node *build_file(Parser *p, Span span, NodeList items)
{
    Node *node = start(p, NODE_FILE, (Span){p->source->base, p->source->base + p->source->length});
    node->a = items.first;
    node->text = p->source->path;
    node->doc = p->scanner.file_doc;
    for (const Node *item = items.first; item; item = item->next) {
        if (item->kind != NODE_VERSION || item == items.first) continue;
        diag(p->unit, item->span, DIAG_MISPLACED, "the version line comes first in a file: move it there");
    }
    return finish(p, node);
}

Node *build_version(Parser *p, Span span, Number number, Span number_span)
{
    Node *node = start(p, NODE_VERSION, span);
    node->number = number.value;
    node->name_span = number_span;
    if (number.value > 1) {
        diag(p->unit, number_span, DIAG_VERSION_NEWER,
             "this file is written in version %.0f of the language, and this compiler knows version 1", number.value);
    } else if (number.value < 1) {
        Diag *d = diag(p->unit, number_span, DIAG_VERSION_NEWER,
                       "there is no version %.0f of the language: write scn 1;", number.value);
        diag_fix(p->unit, d, number_span, FIX_LIKELY, "1");
    }
    return finish(p, node);
}

Node *build_include(Parser *p, Span span, Text path, Span path_span)
{
    Node *node = start(p, NODE_INCLUDE, span);
    node->name_span = path_span;
    node->length = path.length;
    node->text = arena_text(&p->unit->arena, path.text, path.length);
    return finish(p, node);
}

Node *build_use(Parser *p, Span span, Name name, Text path, Span what, Node *alias, NodeList names)
{
    Node *node = start_named(p, NODE_USE, span, name, what);
    node->a = names.first;
    if (!name) node->b = start_text(p, what, path);
    node->c = alias;
    node->alias = alias ? alias->name : NULL;
    if (!name && !alias && !names.first) {
        Diag *d = diag(p->unit, what, DIAG_UNEXPECTED,
                       "a library that is given by its file needs a name: write use \"%.*s\" as name;",
                       (int)path.length, path.text);
        diag_fix(p->unit, d, (Span){what.end, what.end}, FIX_GUESS, " as name");
        return build_error(p, span, NULL);
    }
    return finish(p, node);
}

Node *build_param(Parser *p, Span span, Node *parameter)
{
    Node *node = start(p, NODE_PARAM, span);
    node->a = parameter;
    node->name_span = parameter->name_span;
    // Documentation stands before `param`, and belongs to what it declares.
    if (parameter->kind == NODE_PARAMETER) parameter->doc = scanner_doc(&p->scanner, span.begin);
    return finish(p, node);
}

Node *build_function(Parser *p, NodeKind kind, Span span, Name name, Span name_span, NodeList parameters, Node *result,
                     Node *body)
{
    Node *node = start_named(p, kind, span, name, name_span);
    node->a = parameters.first;
    node->b = result;
    node->c = body;
    node->doc = scanner_doc(&p->scanner, span.begin);
    return finish(p, node);
}

Node *build_parameter(Parser *p, Span span, Name name, Span name_span, Node *type, Node *otherwise, Node *within)
{
    Node *node = start_named(p, NODE_PARAMETER, span, name, name_span);
    node->a = type;
    node->b = otherwise;
    node->c = within;
    node->doc = scanner_doc(&p->scanner, span.begin);
    return finish(p, node);
}

Node *build_untyped(Parser *p, Span span, Name name, Span name_span, Node *otherwise)
{
    Diag *d = diag(p->unit, name_span, DIAG_MISSING_TYPE,
                   "a parameter has a type: write %s: scalar, or the type that is meant", name);
    diag_fix(p->unit, d, (Span){name_span.end, name_span.end}, FIX_GUESS, ": scalar");
    return build_parameter(p, span, name, name_span, build_error(p, name_span, NULL), otherwise, NULL);
}

static bool is_type_word(Name name)
{
    static const char words[] =
        " bool int scalar angle time vec2 vec3 color string range quadric object perturbation material ";
    char padded[20];
    return strlen(name) < sizeof padded - 3 && snprintf(padded, sizeof padded, " %s ", name) > 0 &&
           strstr(words, padded);
}

Node *build_type_first(Parser *p, Span span, Name type, Span type_span, Name name, Span name_span)
{
    if (is_type_word(name) && !is_type_word(type)) { // fn f(x scalar): they are in order, and the colon is missing
        Diag *missing = diag(p->unit, name_span, DIAG_MISSING_TYPE,
                             "a colon stands before the type of a parameter: write %s: %s", type, name);
        diag_fix(p->unit, missing, (Span){type_span.end, type_span.end}, FIX_SURE, ":");
        return build_parameter(p, span, type, type_span, build_type(p, name_span, name, NULL), NULL, NULL);
    }
    if (type == name) { // fn f(size size: scalar)
        Diag *twice = diag(p->unit, name_span, DIAG_UNEXPECTED, "%s stands twice: remove one", name);
        diag_fix(p->unit, twice, name_span, FIX_LIKELY, "%s", "");
        return build_parameter(p, span, name, name_span, build_error(p, name_span, NULL), NULL, NULL);
    }
    bool c_type = strcmp(type, "float") == 0 || strcmp(type, "double") == 0;
    const char *ours = c_type ? "scalar" : type;
    Diag *d = diag(p->unit, span, DIAG_MISSING_TYPE, "the type of a parameter stands behind its name: write %s: %s",
                   name, ours);
    diag_fix(p->unit, d, span, FIX_LIKELY, "%s: %s", name, ours);
    return build_parameter(p, span, name, name_span, build_type(p, type_span, name_text(&p->unit->names, ours), NULL),
                           NULL, NULL);
}

Node *build_type(Parser *p, Span span, Name name, Node *element)
{
    Node *node = start_named(p, NODE_TYPE, span, name, span);
    node->a = element;
    return finish(p, node);
}

Node *build_block(Parser *p, Span span, NodeList items)
{
    for (const Node *item = items.first; item; item = item->next) {
        const char *word = item_word(item->kind);
        if (!word || p->filter.end_reported) continue; // a } is missing before it
        uint32_t length = (uint32_t)strlen(word);
        Span at = {item->span.begin, item->span.begin + length};
        diag(p->unit, at, DIAG_MISPLACED, "%s stands in a file, not in a block: move it out of the { }", word);
    }
    Node *node = start(p, NODE_BLOCK, span);
    node->a = items.first;
    return finish(p, node);
}

Node *build_value(Parser *p, Span span, Node *value)
{
    Node *node = start(p, NODE_VALUE, span);
    node->a = value;
    return finish(p, node);
}

Node *build_entry(Parser *p, Span span, Node *key, Node *value, Name easing, Span easing_span, NodeList arguments)
{
    Node *node = start_named(p, NODE_ENTRY, span, easing, easing_span);
    node->a = key;
    node->b = value;
    node->c = arguments.first;
    return finish(p, node);
}

Node *build_let(Parser *p, Span span, Name name, Span name_span, Node *value)
{
    Node *node = start_named(p, NODE_LET, span, name, name_span);
    node->a = value;
    node->doc = scanner_doc(&p->scanner, span.begin);
    return finish(p, node);
}

Node *build_typed_let(Parser *p, Span span, Name name, Span name_span, Node *type, Node *value)
{
    Span head = {span.begin, type->span.end};
    const char *type_text = source_text(p, type->span);
    if (type->kind == NODE_TYPE && type->name && is_short(type->span)) {
        Diag *d =
            diag(p->unit, head, DIAG_FOREIGN_SYNTAX, "a value that states its type is a declaration: write %.*s %s",
                 quoted_length(type->span), type_text, name);
        diag_fix(p->unit, d, head, FIX_SURE, "%.*s %s", quoted_length(type->span), type_text, name);
    } else {
        Diag *d = diag(p->unit, head, DIAG_FOREIGN_SYNTAX, "a let takes its type from its value: write let %s", name);
        diag_fix(p->unit, d, head, FIX_SURE, "let %s", name);
    }
    return build_let(p, span, name, name_span, value);
}

// `object a = { … };` has its block behind an equals sign: it is a value, and not the arguments of the word.
Node *build_declaration(Parser *p, Span span, Name word, Name name, Span name_span, Node *value, bool arguments)
{
    Node *node = start_named(p, NODE_DECLARE, span, name, name_span);
    node->word = word;
    node->a = value;
    node->flag = arguments;
    node->doc = scanner_doc(&p->scanner, span.begin);
    return finish(p, node);
}

Node *build_entry_within(Parser *p, Span span, Node *key, Node *value, Name library, Span library_span, Name easing,
                         Span easing_span, NodeList arguments)
{
    Node *node = build_entry(p, span, key, value, easing, span_join(library_span, easing_span), arguments);
    node->word = library;
    return node;
}

Node *build_declaration_within(Parser *p, Span span, Node *library, Name word, Span word_span, Name name,
                               Span name_span, Node *block)
{
    if (library->kind != NODE_NAME) {
        diag(p->unit, library->span, DIAG_UNEXPECTED, "a declaration begins with a word: write let %s = …", name);
        return build_error(p, span, NULL);
    }
    Node *node = build_declaration(p, span, word, name, name_span, block, true);
    node->b = build_member(p, span_join(library->span, word_span), library, word, word_span);
    return finish(p, node);
}

// In the block of a call or a declaration `x = 3;` means an argument, elsewhere a let.
Node *build_assignment(Parser *p, Span span, Name name, Span name_span, Span equals, Node *value)
{
    if (filter_in_arguments(&p->filter)) {
        Span gap = {name_span.end, equals.end};
        Diag *d =
            diag(p->unit, equals, DIAG_NAMED_ARGUMENT,
                 "an argument is written with a colon, %s: …, and a name gets its value by let %s = …", name, name);
        diag_fix(p->unit, d, gap, FIX_SURE, ":");
        Node *node = build_entry(p, span, build_name(p, name_span, name), value, NULL, equals, list_of(NULL));
        node->flag = true; // if there is no such argument, that is no second mistake
        return node;
    }
    Diag *d = diag(p->unit, name_span, DIAG_ASSIGNMENT, "a name gets its value by let, once: write let %s = …", name);
    diag_fix(p->unit, d, (Span){name_span.begin, name_span.begin}, FIX_LIKELY, "let ");
    Node *node = build_let(p, span, name, name_span, value);
    node->flag = true; // so the name that it seems to define is not said to hide, or to be defined twice
    return node;
}

Node *build_for(Parser *p, Span span, Name name, Span name_span, Node *range, Node *body)
{
    Node *node = start_named(p, NODE_FOR, span, name, name_span);
    node->a = range;
    node->b = body;
    return finish(p, node);
}

Node *build_head_in_parentheses(Parser *p, Span span, Name name, Span name_span, Node *range)
{
    Diag *d = diag(p->unit, span, DIAG_FOREIGN_SYNTAX, "a for has no parentheses: write for %s in …", name);
    Span inside = {span.begin + 1, span.end - 1};
    if (span.end - span.begin > 2)
        diag_fix(p->unit, d, span, FIX_SURE, "%.*s", quoted_length(inside), source_text(p, inside));
    Node *node = start_named(p, NODE_FOR, span, name, name_span);
    node->a = range;
    return node; // build_for_with_head() completes it
}

Node *build_for_with_head(Parser *p, Span span, Node *head, Node *body)
{
    if (head->kind != NODE_FOR) return head; // an error
    return build_for(p, span, head->name, head->name_span, head->a, body);
}

// assert(condition, "message"); reads as a vector.
static Node *unwrap_assert(Parser *p, Node *condition)
{
    Node *message = condition->a->next;
    Diag *d =
        diag(p->unit, condition->span, DIAG_FOREIGN_SYNTAX, "assert is no call: write assert condition, \"message\";");
    Span inside = {condition->span.begin + 1, condition->span.end - 1};
    if (is_short(inside))
        diag_fix(p->unit, d, condition->span, FIX_LIKELY, " %.*s", quoted_length(inside), source_text(p, inside));
    condition->a->next = NULL;
    return message;
}

Node *build_assert(Parser *p, Span span, Node *condition, Node *message)
{
    if (!message && condition->kind == NODE_VECTOR && condition->a->next->kind == NODE_STRING &&
        !condition->a->next->next) {
        message = unwrap_assert(p, condition);
        condition = condition->a;
    }
    Node *node = start(p, NODE_ASSERT, span);
    node->a = condition;
    node->b = message;
    return finish(p, node);
}

Node *build_print(Parser *p, Span span, NodeList values)
{
    Node *node = start(p, NODE_PRINT, span);
    node->a = values.first;
    return finish(p, node);
}

// --- Expressions ---

Node *build_error(Parser *p, Span span, Node *receiver)
{
    if (!receiver) {
        lost_text(p->unit, span);
        p->lost = span;
    }
    Node *node = start(p, NODE_ERROR, span);
    node->a = receiver;
    return finish(p, node);
}

Node *build_name(Parser *p, Span span, Name name)
{
    return start_named(p, NODE_NAME, span, name, span);
}

Node *build_number(Parser *p, Span span, Number number)
{
    Node *node = start(p, NODE_NUMBER, span);
    node->number = number.value;
    node->unit = (uint8_t)number.unit;
    node->flag = number.whole;
    return node;
}

Node *build_color(Parser *p, Span span, uint32_t color)
{
    Node *node = start(p, NODE_COLOR, span);
    node->color = color;
    return node;
}

Node *build_bool(Parser *p, Span span, bool value)
{
    Node *node = start(p, NODE_BOOL, span);
    node->flag = value;
    return node;
}

Node *build_text(Parser *p, Span span, Text text)
{
    return text.length ? start_text(p, span, text) : NULL;
}

Node *build_string(Parser *p, Span span, NodeList pieces)
{
    Node *node = start(p, NODE_STRING, span);
    node->a = pieces.first;
    return finish(p, node);
}

Node *build_vector(Parser *p, Span span, NodeList parts)
{
    int count = 0;
    for (Node *part = parts.first; part; part = part->next) {
        if (++count != 3 || !part->next) continue;
        Span more = span_join(part->next->span, parts.last->span);
        if (!lost_in_line(p->unit, more)) // else a bracket of the line is not where it was meant to be
            diag(p->unit, more, DIAG_VECTOR_SIZE,
                 "a vector has two or three components; a list of any length is written [a, b, c, d]");
        part->next = NULL;
    }
    Node *node = start(p, NODE_VECTOR, span);
    node->a = parts.first;
    return finish(p, node);
}

Node *build_list(Parser *p, Span span, NodeList elements)
{
    Node *node = start(p, NODE_LIST, span);
    node->a = elements.first;
    return finish(p, node);
}

Node *build_paren(Parser *p, Span span, Node *inner)
{
    Node *node = start(p, NODE_PAREN, span);
    node->a = inner;
    return finish(p, node);
}

// -5 is a number: half of the numbers of a scene have a sign, and need no second node. In -x^2 and -5.f() the number is not next.
Node *build_unary(Parser *p, Span span, NodeOp op, Span op_span, Node *a)
{
    if (op == NODE_OP_NEG && a->kind == NODE_NUMBER) {
        a->number = -a->number;
        a->span = a->name_span = span;
        return a;
    }
    Node *node = start(p, NODE_UNARY, span);
    node->op = (uint8_t)op;
    node->name_span = op_span;
    node->a = a;
    return finish(p, node);
}

Node *build_binary(Parser *p, Span span, NodeOp op, Span op_span, Node *a, Node *b)
{
    Node *node = start(p, NODE_BINARY, span);
    node->op = (uint8_t)op;
    node->name_span = op_span;
    node->a = a;
    node->b = b;
    return finish(p, node);
}

// The flag says that it was reported: what follows is not, if it stands before an object, say.
Node *build_foreign_not(Parser *p, Span span, Span op_span, Node *a)
{
    Node *node = build_unary(p, span, NODE_OP_NOT, op_span, a);
    node->flag = true;
    return node;
}

// a < b < c as (a < b) and (b < c). `comparison` is a < b, or such a chain, whose last comparison is its b.
static Node *build_chain(Parser *p, Span span, NodeOp op, Span op_span, Node *comparison, Node *c)
{
    bool longer = comparison->op == NODE_OP_AND;
    Node *last = longer ? comparison->b : comparison;
    Node *shared = last->b; // b stands in both comparisons
    if (!longer && shared) {
        Span place = {op_span.begin, c->span.end};
        Diag *d = diag(p->unit, place, DIAG_CHAINED_COMPARISON, "comparisons do not chain: write a %s b and b %s c",
                       node_op_text((NodeOp)last->op), node_op_text(op));
        if (is_short(shared->span)) {
            diag_fix(p->unit, d, (Span){op_span.begin, op_span.begin}, FIX_SURE, "and %.*s ",
                     quoted_length(shared->span), source_text(p, shared->span));
        }
    }
    Node *again = build_binary(p, (Span){shared ? shared->span.begin : op_span.begin, c->span.end}, op, op_span,
                               shared ? shared : build_error(p, op_span, NULL), c);
    again->flag = true; // whether its sides suit each other is no matter any more
    return build_binary(p, span, NODE_OP_AND, op_span, comparison, again);
}

// An `and` is looser than a comparison: without parentheses one can stand to the left of it only as a chain of comparisons.
Node *build_comparison(Parser *p, Span span, NodeOp op, Span op_span, Node *a, Node *b)
{
    bool chained = a->kind == NODE_BINARY && (a->op == NODE_OP_AND || (a->op >= NODE_OP_EQ && a->op <= NODE_OP_GE));
    return chained ? build_chain(p, span, op, op_span, a, b) : build_binary(p, span, op, op_span, a, b);
}

Node *build_modulo(Parser *p, Span span, Span op_span, Node *a, Node *b)
{
    if (is_short(a->span) && is_short(b->span)) {
        const char *a_text = source_text(p, a->span), *b_text = source_text(p, b->span);
        int a_length = quoted_length(a->span), b_length = quoted_length(b->span);
        Diag *d = diag(p->unit, op_span, DIAG_FOREIGN_SYNTAX, "the remainder is written mod(%.*s, %.*s)", a_length,
                       a_text, b_length, b_text);
        diag_fix(p->unit, d, (Span){a->span.begin, b->span.end}, FIX_SURE, "mod(%.*s, %.*s)", a_length, a_text,
                 b_length, b_text);
    } else {
        diag(p->unit, op_span, DIAG_FOREIGN_SYNTAX, "the remainder is written mod(a, b)");
    }
    NodeList arguments = list_add(list_of(a), b);
    return build_call(p, span, name_text(&p->unit->names, "mod"), op_span, NULL,
                      build_arguments(p, span, true, arguments, NULL));
}

Node *build_arguments(Parser *p, Span span, bool parentheses, NodeList arguments, Node *block)
{
    Node *node = start(p, NODE_CALL, span);
    node->flag = parentheses;
    node->b = arguments.first;
    node->c = block;
    return node; // build_call completes it
}

Node *build_call(Parser *p, Span span, Name name, Span name_span, Node *receiver, Node *call)
{
    call->span = span;
    call->name = name;
    call->name_span = name_span;
    call->a = receiver;
    return finish(p, call);
}

Node *build_argument(Parser *p, Span span, Name name, Span name_span, Node *value)
{
    Node *node = start_named(p, NODE_ARGUMENT, span, name, name_span);
    node->a = value;
    return finish(p, node);
}

Node *build_named_with_equals(Parser *p, Span span, Name name, Span name_span, Span equals, Node *value)
{
    Diag *d = diag(p->unit, equals, DIAG_NAMED_ARGUMENT, "an argument with a name is written with a colon: write %s: …",
                   name);
    diag_fix(p->unit, d, (Span){name_span.end, equals.end}, FIX_SURE, ":");
    Node *node = build_argument(p, span, name, name_span, value);
    node->flag = true;
    return node;
}

Node *build_member(Parser *p, Span span, Node *a, Name name, Span name_span)
{
    Node *node = start_named(p, NODE_MEMBER, span, name, name_span);
    node->a = a;
    return finish(p, node);
}

Node *build_index(Parser *p, Span span, Node *a, Node *index)
{
    Node *node = start(p, NODE_INDEX, span);
    node->name_span = index->span;
    node->a = a;
    node->b = index;
    return finish(p, node);
}

Node *build_if(Parser *p, Span span, Node *condition, Node *then, Node *otherwise)
{
    Node *node = start(p, NODE_IF, span);
    node->name_span = (Span){span.begin, span.begin + 2};
    node->a = condition;
    node->b = then;
    node->c = otherwise;
    return finish(p, node);
}
