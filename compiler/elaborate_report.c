// Where something went wrong and why.
//
// What is compiled in is not the author's text: what happens in it is told at the call that led into it, and if it comes from
// an argument, at that argument. Inside of the author's own functions it is told where it happens, with the calls
// that led there.
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "compiler/evaluator.h"

static bool in_prelude(const Eval *e, Span span)
{
    const Source *source = source_of(&e->unit->sources, span.begin);
    return source && source->prelude;
}

// The first parameter of the current function that an expression names; the frame's arguments say what it is.
static const Symbol *first_parameter(const Node *list)
{
    for (; list; list = list->next) {
        const Node *node = list;
        if (node->kind == NODE_NAME) {
            const Symbol *symbol = node->note;
            if (symbol && symbol->kind == SYMBOL_PARAMETER) return symbol;
            if (symbol && symbol->kind == SYMBOL_LET && !symbol->global && symbol->value) {
                const Symbol *within = first_parameter(symbol->value);
                if (within) return within;
            }
        }
        const Symbol *found = first_parameter(node->a);
        if (!found) found = first_parameter(node->b);
        if (found) return found;
    }
    return NULL;
}

static const Node *argument_of(const Frame *frame, const Symbol *parameter)
{
    const Callable *callee = frame->call->callee;
    for (uint32_t i = 0; i < callee->count; i++) {
        if (callee->parameters[i].symbol == parameter && frame->call->bound[i].how == BOUND_ONE)
            return frame->call->bound[i].node;
    }
    return NULL;
}

const Node *blame(const Eval *e, const Node *at)
{
    for (const Frame *frame = e->frame; frame && in_prelude(e, at->span); frame = frame->outer) {
        // Only what is looked at itself, not what follows it in a list.
        Node alone = *at;
        alone.next = NULL;
        const Symbol *parameter = first_parameter(&alone);
        const Node *argument = parameter ? argument_of(frame, parameter) : NULL;
        at = argument ? argument : frame->node;
    }
    return at;
}

// Which turns of the innermost loops it happened in.
static void label_loops(Eval *e, Diag *d)
{
    enum { LOOPS_SHOWN = 2 };
    int shown = 0;
    for (const Loop *loop = e->loop; loop && shown < LOOPS_SHOWN; loop = loop->outer) {
        if (in_prelude(e, loop->node->span) || value_size(loop->each->type) == 0) continue;
        const char *each = value_varying(loop->each) ? NULL : value_text(&e->scratch, loop->each, 6);
        if (each) diag_label(e->unit, d, loop->node->name_span, "where %s is %s", loop->node->name, each);
        shown++;
    }
}

Diag *complain(Eval *e, const Node *at, DiagCode code, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    char *text;
    if (vasprintf(&text, format, values) < 0) text = NULL;
    va_end(values);
    Span place = blame(e, at)->span;
    Diag *d = diag(e->unit, place, code, "%s", text ? text : "");
    free(text);
    enum { CALLS_SHOWN = 3 };
    int shown = 0;
    for (const Frame *frame = e->frame; frame && shown < CALLS_SHOWN; frame = frame->outer) {
        if (frame->call->callee->prelude || in_prelude(e, frame->node->span)) continue;
        if (place.begin >= frame->node->span.begin && place.end <= frame->node->span.end) continue; // one sees it there
        diag_label(e->unit, d, frame->node->name_span, "in this call of %s", frame->call->callee->name);
        shown++;
    }
    label_loops(e, d);
    // One mistake in a recursion of several branches comes again and again, and each time keeps it from ending.
    bool again = diag_severity(code) == SEVERITY_ERROR && ++e->complaints > COMPLAINTS_MAX;
    if (again || e->unit->errors - e->errors_before > ERRORS_MAX) e->stop = true;
    return d;
}

// --- the chain of rates

typedef struct Chain {
    Eval *e;
    Diag *diag;
    int labels, budget; // names that may still be looked at
} Chain;

static bool chain_list(Chain *chain, const Node *list, const Frame *frame, int depth);

static void chain_label(Chain *chain, Span span, const char *text, const char *name)
{
    enum { LABELS_MAX = 5 };
    if (chain->labels++ >= LABELS_MAX || in_prelude(chain->e, span)) return;
    diag_label(chain->e->unit, chain->diag, span, text, name);
}

static bool chain_name(Chain *chain, const Node *node, const Frame *frame, int depth)
{
    const Symbol *symbol = node->note;
    if (!symbol || chain->budget-- <= 0) return false;
    switch (symbol->kind) {
    case SYMBOL_CONSTANT:
        if (symbol->id == BUILTIN_TIME || symbol->id == BUILTIN_FRAME) {
            chain_label(chain, node->span, "%s is known in each frame", symbol->name);
            return true;
        }
        if (symbol->id == BUILTIN_U || symbol->id == BUILTIN_V) {
            chain_label(chain, node->span, "%s is known at each place of a patch", symbol->name);
            return true;
        }
        if (symbol->id == BUILTIN_X || symbol->id == BUILTIN_Y || symbol->id == BUILTIN_Z) {
            chain_label(chain, node->span, "%s is known at each point", symbol->name);
            return true;
        }
        return false;
    case SYMBOL_PARAM:
        if (symbol->type.kind == TYPE_BOOL || symbol->type.kind == TYPE_INT || symbol->type.kind == TYPE_STRING)
            return false;
        chain_label(chain, symbol->span, "%s is a handle that may move; a param of type int, bool or string is fixed",
                    symbol->name);
        return true;
    case SYMBOL_LET:
        if (!symbol->value || !chain_list(chain, symbol->value, symbol->global ? NULL : frame, depth + 1)) return false;
        chain_label(chain, symbol->span, "so %s is", symbol->name);
        return true;
    case SYMBOL_PARAMETER: {
        const Node *argument = frame ? argument_of(frame, symbol) : NULL;
        if (!argument) return false;
        Node alone = *argument;
        alone.next = NULL;
        return chain_list(chain, &alone, frame->outer, depth + 1);
    }
    default: return false;
    }
}

// Finds the first name that brings the rate, and labels the way to it from there.
static bool chain_list(Chain *chain, const Node *list, const Frame *frame, int depth)
{
    enum { DEPTH_MAX = 300 }; // of trees and definitions together; what is deeper is not explained
    if (depth > DEPTH_MAX) return false;
    for (; list; list = list->next) {
        for (const Node *node = list; node;) {
            bool name = node->kind == NODE_NAME || (node->kind == NODE_MEMBER && node->note);
            if (name && chain_name(chain, node, frame, depth)) return true;
            if (chain_list(chain, node->b, frame, depth + 1)) return true;
            if (node->kind != NODE_CALL && chain_list(chain, node->c, frame, depth + 1)) return true;
            if (!node_is_link(node)) {
                if (chain_list(chain, node->a, frame, depth + 1)) return true;
                break;
            }
            node = node->a;
        }
    }
    return false;
}

void report_rate(Eval *e, const Node *at, DiagCode code, const char *what)
{
    const char *why = code == DIAG_SHAPE_RATE
                          ? "must be known when the scene is compiled, since it shapes it"
                          : "cannot differ from point to point: x, y and z are for fields, materials and weights";
    Diag *d = complain(e, at, code, "%s %s", what, why);
    Chain chain = {.e = e, .diag = d, .budget = 1000};
    Node alone = *at;
    alone.next = NULL;
    chain_list(&chain, &alone, e->frame, 0);
}

bool at_point(const Eval *e, Scalar s)
{
    return s.id && ir_at(e->ir, s.id)->rate == RATE_POINT;
}

bool want_const(Eval *e, const Node *at, Scalar s, const char *what, double *number)
{
    if (s.id) {
        report_rate(e, at, DIAG_SHAPE_RATE, what);
        return false;
    }
    *number = s.number;
    return !isnan(s.number);
}
