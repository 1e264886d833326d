#include "compiler/references.h"

#include <string.h>

// What a call means, where that is written in SCN and not built in.
static Symbol *called(const Node *node)
{
    const Call *call = node->note;
    const Node *definition = call ? call->callee->node : NULL;
    return definition ? definition->note : NULL;
}

static void visit_call(void *user, const Node *node, ReferenceVisit *visit)
{
    Symbol *symbol = called(node);
    Span span = node->name_span;
    if (symbol && names_a_library(node->a))
        span.begin = node->a->kind == NODE_NAME ? node->a->span.begin : node->a->name_span.begin;
    if (symbol) visit(user, node, symbol, span);
}

static void visit_node(void *user, const Node *node, ReferenceVisit *visit)
{
    switch (node->kind) {
    case NODE_NAME:
        if (node->note && !names_a_library(node)) visit(user, node, node->note, node->span);
        break;
    case NODE_MEMBER:
        if (node->note && !names_a_library(node))
            visit(user, node, node->note, (Span){node->a->span.begin, node->name_span.end});
        break;
    case NODE_CALL: visit_call(user, node, visit); break;
    case NODE_DECLARE: { // its word may be a tag
        const Symbol *own = node->note;
        Symbol *word = node->flag && own && own->value ? called(own->value) : NULL;
        Span span = {node->span.begin, node->span.begin + (uint32_t)strlen(node->word)};
        if (word) visit(user, node, word, node->b ? node->b->span : span);
        break;
    }
    case NODE_ENTRY: { // its easing
        Symbol *easing = node->name && node->note ? called(node->note) : NULL;
        if (easing) visit(user, node, easing, node->name_span);
        break;
    }
    default: break;
    }
}

// All nodes of a list, chains by a loop. Other files are not entered.
void references_visit(void *user, const Node *list, ReferenceVisit *visit)
{
    for (; list; list = list->next) {
        for (const Node *node = list; node;) {
            if (node->kind == NODE_INCLUDE || node->kind == NODE_USE) break;
            visit_node(user, node, visit);
            references_visit(user, node->b, visit);
            references_visit(user, node->c, visit);
            if (!node_is_link(node)) {
                references_visit(user, node->a, visit);
                break;
            }
            node = node->a;
        }
    }
}

// The definition alone, without what follows it in its file.
void references_visit_definition(void *user, const Node *node, ReferenceVisit *visit)
{
    Node alone = *node;
    alone.next = NULL;
    references_visit(user, &alone, visit);
}

void references_visit_file(void *user, const Node *file, ReferenceVisit *visit)
{
    references_visit(user, file->a, visit);
    for (const Node *node = file->a; node; node = node->next) {
        if (node->kind == NODE_INCLUDE && node->a) references_visit_file(user, node->a, visit);
    }
}
