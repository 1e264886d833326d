// Names of what is in the tree, its chains, and its printed form. A line of the printed form is
//
//     kind  what it is called  op  =value
//
// and its children are two columns deeper, those of `a` first. Only where the role of a child is not plain from its place
// a line says it: `else`, `in`, `key`. The form is read by tests, so it changes only with the tree.
#include "lang/ast.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "lang/unit.h"

static const char *const kind_names[NODE_KIND_COUNT] = {
    [NODE_ERROR] = "error",   [NODE_FILE] = "file",           [NODE_VERSION] = "scn", [NODE_INCLUDE] = "include",
    [NODE_USE] = "use",       [NODE_PARAM] = "param",         [NODE_FN] = "fn",       [NODE_TAG] = "tag",
    [NODE_TOOL] = "tool",     [NODE_PARAMETER] = "parameter", [NODE_TYPE] = "type",   [NODE_BLOCK] = "block",
    [NODE_VALUE] = "value",   [NODE_ENTRY] = "entry",         [NODE_LET] = "let",     [NODE_DECLARE] = "declare",
    [NODE_FOR] = "for",       [NODE_ASSERT] = "assert",       [NODE_PRINT] = "print", [NODE_NAME] = "name",
    [NODE_NUMBER] = "number", [NODE_COLOR] = "color",         [NODE_BOOL] = "bool",   [NODE_STRING] = "string",
    [NODE_TEXT] = "text",     [NODE_VECTOR] = "vector",       [NODE_LIST] = "list",   [NODE_PAREN] = "paren",
    [NODE_UNARY] = "unary",   [NODE_BINARY] = "binary",       [NODE_CALL] = "call",   [NODE_ARGUMENT] = "argument",
    [NODE_MEMBER] = "member", [NODE_INDEX] = "index",         [NODE_IF] = "if",
};

const char *node_kind_name(NodeKind kind)
{
    assert(kind < NODE_KIND_COUNT && "a kind of node");
    return kind_names[kind];
}

const char *node_op_text(NodeOp op)
{
    static const char *const texts[] = {
        [NODE_OP_NONE] = "",       [NODE_OP_OR] = "or", [NODE_OP_AND] = "and",  [NODE_OP_NOT] = "not",
        [NODE_OP_EQ] = "==",       [NODE_OP_NE] = "!=", [NODE_OP_LT] = "<",     [NODE_OP_LE] = "<=",
        [NODE_OP_GT] = ">",        [NODE_OP_GE] = ">=", [NODE_OP_RANGE] = "..", [NODE_OP_UNION] = "|",
        [NODE_OP_INTERSECT] = "&", [NODE_OP_ADD] = "+", [NODE_OP_SUB] = "-",    [NODE_OP_MUL] = "*",
        [NODE_OP_DIV] = "/",       [NODE_OP_POW] = "^", [NODE_OP_NEG] = "-",    [NODE_OP_COMPLEMENT] = "~",
    };
    return texts[op];
}

const char *number_unit_text(NumberUnit unit)
{
    static const char *const texts[] = {
        [UNIT_NONE] = "",
#define UNIT(id, suffix, dimension, meaning) [UNIT_##id] = suffix,
#include "lang/words.def"
    };
    return texts[unit];
}

Node **node_spine(Arena *scratch, Node *node, int *count)
{
    int length = 1;
    if (node_is_link(node)) {
        for (const Node *left = node->a; left && node_is_link(left); left = left->a) length++;
    }
    Node **links = arena_array(scratch, Node *, length);
    Node *link = node;
    for (int i = length - 1; i >= 0; i--, link = link->a) links[i] = link;
    *count = length;
    return links;
}

// --- Printing ---

typedef struct Printer {
    const Unit *unit;
    FILE *out;
} Printer;

static void indent(const Printer *p, int depth)
{
    fprintf(p->out, "%*s", 2 * depth, "");
}

static void print_quoted(const Printer *p, const char *text, size_t length)
{
    fputc('"', p->out);
    for (size_t i = 0; i < length; i++) {
        unsigned char c = (unsigned char)text[i];
        if (c == '\n')
            fputs("\\n", p->out);
        else if (c == '\t')
            fputs("\\t", p->out);
        else if (c == '"' || c == '\\')
            fprintf(p->out, "\\%c", c);
        else if (c < 0x20 || c == 0x7F)
            fprintf(p->out, "\\x%02x", c);
        else
            fputc(c, p->out);
    }
    fputc('"', p->out);
}

static void print_doc(const Printer *p, const char *doc)
{
    if (!doc) return;
    fputs(" /// ", p->out);
    print_quoted(p, doc, strlen(doc));
}

static void print_node(const Printer *p, const Node *node, int depth);

static void print_list(const Printer *p, const Node *list, int depth)
{
    for (; list; list = list->next) print_node(p, list, depth);
}

// Arguments: one without a name is its expression in the tree, but has a line of its own here.
static void print_arguments(const Printer *p, const Node *list, int depth)
{
    for (; list; list = list->next) {
        bool named = list->kind == NODE_ARGUMENT;
        if (!named) {
            indent(p, depth);
            fputs("argument\n", p->out);
        }
        print_node(p, list, named ? depth : depth + 1);
    }
}

// A child, or a list of them, under a line that says its role.
static void print_role(const Printer *p, const char *role, const Node *list, int depth)
{
    if (!list) return;
    indent(p, depth);
    fprintf(p->out, "%s\n", role);
    print_list(p, list, depth + 1);
}

// What stands in the line of a node behind its kind.
static void print_facts(const Printer *p, const Node *node)
{
    switch ((NodeKind)node->kind) {
    case NODE_VERSION: fprintf(p->out, " %.0f", node->number); break;
    case NODE_FILE: print_doc(p, node->doc); break;
    case NODE_INCLUDE:
        fputc(' ', p->out);
        print_quoted(p, node->text, node->length);
        break;
    case NODE_USE:
        if (node->name && !node->b) fprintf(p->out, " %s", node->name);
        if (node->alias) fprintf(p->out, " as %s", node->alias);
        break;
    case NODE_FN:
    case NODE_TAG:
    case NODE_TOOL:
    case NODE_LET:
    case NODE_PARAMETER:
        fprintf(p->out, " %s", node->name);
        print_doc(p, node->doc);
        break;
    case NODE_DECLARE:
        fprintf(p->out, " %s%s%s %s%s", node->b ? node->b->a->name : "", node->b ? "." : "", node->word, node->name,
                node->flag ? " { }" : "");
        print_doc(p, node->doc);
        break;
    case NODE_TYPE:
        if (node->name)
            fprintf(p->out, " %s", node->name);
        else
            fputs(" [ ]", p->out);
        break;
    case NODE_ENTRY:
        if (node->name) fprintf(p->out, " %s%s%s", node->word ? node->word : "", node->word ? "." : "", node->name);
        break;
    case NODE_ARGUMENT:
    case NODE_FOR:
    case NODE_NAME: fprintf(p->out, " %s", node->name); break;
    case NODE_NUMBER: {
        char text[40]; // the shorter of the two forms that reads back as the same number
        snprintf(text, sizeof text, "%.15g", node->number);
        if (strtod(text, NULL) != node->number) snprintf(text, sizeof text, "%.17g", node->number);
        fprintf(p->out, " %s%s%s", text, number_unit_text((NumberUnit)node->unit), node->flag ? " int" : "");
        break;
    }
    case NODE_COLOR: fprintf(p->out, " #%06x", node->color); break;
    case NODE_BOOL: fputs(node->flag ? " true" : " false", p->out); break;
    case NODE_TEXT:
        fputc(' ', p->out);
        print_quoted(p, node->text, node->length);
        break;
    case NODE_UNARY: fprintf(p->out, " %s", node_op_text((NodeOp)node->op)); break;
    default: break;
    }
}

// A link of a chain without what is to its left: `.move`, `|`.
static void print_link(const Printer *p, const Node *node, int depth)
{
    indent(p, depth);
    switch ((NodeKind)node->kind) {
    case NODE_BINARY:
        fprintf(p->out, "%s\n", node_op_text((NodeOp)node->op));
        print_list(p, node->b, depth + 1);
        break;
    case NODE_MEMBER: fprintf(p->out, ".%s\n", node->name); break;
    case NODE_INDEX:
        fprintf(p->out, "[ ]\n");
        print_list(p, node->b, depth + 1);
        break;
    default:
        fprintf(p->out, ".%s%s\n", node->name, node->flag ? "()" : "");
        print_arguments(p, node->b, depth + 1);
        print_list(p, node->c, depth + 1);
        break;
    }
}

static void print_chain(const Printer *p, const Node *node, int depth)
{
    Arena arena = {0};
    int count;
    Node **links = node_spine(&arena, (Node *)node, &count); // only read
    int next = 0;
    if (links[0]->a) {
        if (node->kind == NODE_BINARY && count == 1) { // a + b, without a line for the chain
            indent(p, depth);
            fprintf(p->out, "%s\n", node_op_text((NodeOp)node->op));
            print_list(p, node->a, depth + 1);
            print_list(p, node->b, depth + 1);
            arena_release(&arena);
            return;
        }
        indent(p, depth);
        fputs("chain\n", p->out);
        print_node(p, links[0]->a, depth + 1);
    } else { // a call without a receiver begins the chain
        if (count > 1) {
            indent(p, depth++);
            fputs("chain\n", p->out);
        }
        indent(p, depth);
        fprintf(p->out, "call %s%s\n", links[0]->name, links[0]->flag ? "()" : "");
        print_arguments(p, links[0]->b, depth + 1);
        print_list(p, links[0]->c, depth + 1);
        depth--;
        next = 1;
    }
    for (; next < count; next++) print_link(p, links[next], depth + 1);
    arena_release(&arena);
}

static void print_node(const Printer *p, const Node *node, int depth)
{
    if (node_is_link(node)) {
        print_chain(p, node, depth);
        return;
    }
    indent(p, depth);
    fputs(node_kind_name((NodeKind)node->kind), p->out);
    print_facts(p, node);
    fputc('\n', p->out);
    depth++;
    switch ((NodeKind)node->kind) {
    case NODE_USE: // the library has a tree of its own, printed once by itself
        print_list(p, node->b, depth);
        print_list(p, node->a, depth);
        break;
    case NODE_FN:
    case NODE_TAG:
    case NODE_TOOL:
        print_list(p, node->a, depth);
        print_role(p, "->", node->b, depth);
        print_list(p, node->c, depth);
        break;
    case NODE_PARAMETER:
        print_list(p, node->a, depth);
        print_role(p, "=", node->b, depth);
        print_role(p, "in", node->c, depth);
        break;
    case NODE_ENTRY:
        print_list(p, node->a, depth);
        print_list(p, node->b, depth);
        if (node->c) {
            indent(p, depth);
            fputs("easing\n", p->out);
            print_arguments(p, node->c, depth + 1);
        }
        break;
    case NODE_IF:
        print_list(p, node->a, depth);
        print_list(p, node->b, depth);
        print_role(p, "else", node->c, depth);
        break;
    default:
        print_list(p, node->a, depth);
        print_list(p, node->b, depth);
        print_list(p, node->c, depth);
        break;
    }
}

void ast_print(const Unit *unit, const Node *tree, FILE *out)
{
    Printer p = {unit, out};
    print_node(&p, tree, 0);
}
