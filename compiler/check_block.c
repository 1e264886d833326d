// Blocks: their items, and how many values of which type they give.
#include <assert.h>
#include <string.h>

#include "compiler/checker.h"

// --- values of a block

static bool belongs_to_file(Type type)
{
    return type.kind == TYPE_LIGHT || type.kind == TYPE_CAMERA || type.kind == TYPE_BACKGROUND ||
           type.kind == TYPE_ANIMATION;
}

static bool is_sheet(Type type)
{
    return type.kind == TYPE_PATCH;
}

// A value of a file: what it shows, or what belongs to the scene by standing there.
static void check_shown(Checker *c, const Node *node, Type have)
{
    Type one = have;
    one.list = 0;
    if (one.kind == TYPE_ANY || belongs_to_file(one) || type_converts(one, type_of(TYPE_OBJECT))) return;
    const char *phrase = type_phrase(&c->unit->arena, have);
    if (one.kind == TYPE_PERTURBATION) {
        diag(c->unit, node->span, DIAG_TYPE_MISMATCH, "%s changes an object: put it into freeform(object) { … }",
             phrase);
    } else {
        diag(c->unit, node->span, DIAG_TYPE_MISMATCH,
             "a file shows objects, and this is %s: name it with let, or print it", phrase);
    }
}

// A call whose arguments were reported: what it would have given is no second mistake.
static bool is_wrong_call(const Node *node)
{
    const Call *call = node->kind == NODE_CALL ? node->note : NULL;
    return call && call->wrong;
}

void check_value(Checker *c, Node *node, Type have, Values *values)
{
    values->count++;
    if (type_bad(have)) {
        values->joined = have;
        return;
    }
    if (is_wrong_call(node) && (values->file || values->known)) return;
    if (values->file) {
        check_shown(c, node, have);
        return;
    }
    if (values->many && have.list && have.kind == TYPE_ANY) return; // [] gives nothing
    if (!values->known) {
        if (values->many && have.list) have = type_element(have); // a list gives its elements
        if (values->count == 1) {
            values->joined = have;
        } else if (!type_join(values->joined, have, &values->joined)) {
            bool unit = type_is_number(values->joined) && type_is_number(have);
            diag(c->unit, node->span, unit ? DIAG_UNIT_MISMATCH : DIAG_TYPE_MISMATCH,
                 "the values of %s are alike: this is %s among others that are %s", values->what,
                 type_phrase(&c->unit->arena, have), type_text(&c->unit->arena, values->joined));
            values->joined = poison();
        }
        return;
    }
    Type want = values->want, one = have;
    if (values->many && have.list > want.list) one = type_element(have);
    if (type_converts(one, want)) {
        if (is_sheet(one) && want.kind == TYPE_OBJECT && !values->sheets) {
            diag(c->unit, node->span, DIAG_PATCH_SHEET,
                 "a patch is a sheet without an inside, which %s wants: thicken it first", values->what);
        }
    } else if (want.kind == TYPE_OBJECT && belongs_to_file(one)) {
        diag(c->unit, node->span, DIAG_MISPLACED, "%s belongs to the file: write it outside of this block",
             type_phrase(&c->unit->arena, one));
    } else if (want.kind == TYPE_PERTURBATION && type_is_field(one)) {
        diag(c->unit, node->span, DIAG_TYPE_MISMATCH, "%s wants perturbations: write perturb(…) around this %s",
             values->what, type_text(&c->unit->arena, one));
    } else {
        const char *what =
            arena_printf(&c->scratch, values->many ? "each value of %s" : "the value of %s", values->what);
        expect(c, node, one, want, what);
    }
}

// --- definitions

// A block after a word is a call of it: `light key { … }` is `let key = light { … };`.
static Node *call_of(Checker *c, const Node *node)
{
    Node *call = arena_new(&c->unit->arena, Node);
    call->kind = NODE_CALL;
    call->span = node->span;
    call->name = node->word;
    call->name_span = (Span){node->span.begin, node->span.begin + (uint32_t)strlen(node->word)};
    if (node->b) {
        call->a = node->b->a; // a library
        call->name_span = node->b->name_span;
    }
    call->c = node->a;
    call->depth = node->depth;
    return call;
}

static Type check_stated(Checker *c, Node *node)
{
    Type type;
    Span word = {node->span.begin, node->span.begin + (uint32_t)strlen(node->word)};
    if (type_named(node->word, &type)) {
        const char *what = arena_printf(&c->scratch, "%s", node->name);
        return check_as(c, node->a, type, what);
    }
    Type have = check_expr(c, node->a);
    if (!strcmp(node->word, "query")) return have;
    Symbol *symbol = names_find(c, node->word);
    if (symbol && symbol->kind == SYMBOL_CALLABLE) {
        diag(c->unit, word, DIAG_TYPE_MISMATCH, "%s is no type: write let %s = …, or %s %s { … }", node->word,
             node->name, node->word, node->name);
        return have;
    }
    int count = 0;
    while (type_names[count]) count++;
    const char *near = nearest_name(node->word, type_names, count);
    Diag *d =
        near ? diag(c->unit, word, DIAG_UNKNOWN_NAME, "there is no type %s: do you mean %s?", node->word, near)
             : diag(c->unit, word, DIAG_UNKNOWN_NAME, "there is no type %s: write let %s = …", node->word, node->name);
    diag_fix(c->unit, d, word, FIX_LIKELY, "%s", near ? near : "let");
    return have;
}

Type check_definition(Checker *c, Node *node, Node **value)
{
    Type type;
    *value = node->a;
    if (node->kind == NODE_LET) {
        type = check_expr(c, node->a);
    } else if (node->flag) {
        *value = call_of(c, node);
        type = check_expr(c, *value);
    } else {
        type = check_stated(c, node);
    }
    type.zero = false; // only the literal 0 has no unit of its own
    return type;
}

static void check_let(Checker *c, Node *node)
{
    Node *value;
    Body *body = c->body;
    Symbol *around = body->symbol;
    // What this value needs is needed when it is used, not when the definition around it is.
    Symbol pending = {.slot = body->slots};
    body->symbol = &pending;
    int conditional = body->conditional;
    body->conditional = 0;
    Type type = check_definition(c, node, &value);
    body->symbol = around;
    body->conditional = conditional;
    Symbol *symbol = names_local(c, SYMBOL_LET, node->name, node->name_span, node, type);
    symbol->value = value;
    symbol->needs = pending.needs;
    symbol->need_count = pending.need_count;
    symbol->need_capacity = pending.need_capacity;
    node->note = symbol;
}

// --- items

void check_for(Checker *c, Node *node, Values *values)
{
    Type over = check_expr(c, node->a), each = poison();
    if (over.list) {
        each = type_element(over);
    } else if (type_is(over, TYPE_RANGE)) {
        each = type_of(TYPE_INT);
        if (over.angle || over.time) {
            diag(c->unit, node->a->span, DIAG_UNIT_MISMATCH,
                 "a for walks whole numbers, and this range is of %s: walk 0 .. n and multiply",
                 type_text(&c->unit->arena, type_number(over.angle, over.time)));
        } else if (!over.whole) {
            diag(c->unit, node->a->span, DIAG_NOT_WHOLE,
                 "a for walks whole numbers: write a range of ints, with floor(…) or round(…) if need be");
        }
    } else if (type_is_number(over)) {
        diag(c->unit, node->a->span, DIAG_TYPE_MISMATCH, "a for walks a range or a list: write 0 .. and this number");
    } else if (!type_bad(over)) {
        diag(c->unit, node->a->span, DIAG_TYPE_MISMATCH, "a for walks a range or a list, and this is %s%s",
             type_phrase(&c->unit->arena, over), type_is(over, TYPE_VEC2) ? ": a range is written 0 .. 5" : "");
    }
    BlockScope scope;
    uint32_t mark = names_open(c, &scope, NULL);
    node->note = names_local(c, SYMBOL_LOOP, node->name, node->name_span, node, each);
    c->body->conditional++; // it may walk nothing
    check_block(c, node->b, values);
    c->body->conditional--;
    names_close(c, mark);
}

static Type check_branch(Checker *c, Node *block, Values *values, Type before, bool first)
{
    if (values->many) {
        check_block(c, block, values);
        return poison();
    }
    Values branch = *values;
    branch.count = 0;
    Type type = check_block(c, block, &branch), joined;
    if (first) return type;
    if (type_join(before, type, &joined)) return joined;
    diag(c->unit, block->span, DIAG_TYPE_MISMATCH,
         "both branches give the same kind of value: this is %s, the one before is %s",
         type_phrase(&c->unit->arena, type), type_phrase(&c->unit->arena, before));
    return poison();
}

Type check_if(Checker *c, Node *node, Values *values)
{
    Type type = poison();
    c->body->conditional++;
    for (Node *at = node;; at = at->c) {
        Type condition = check_expr(c, at->a);
        expect(c, at->a, condition, type_of(TYPE_BOOL), "a condition");
        type = check_branch(c, at->b, values, type, at == node);
        if (!at->c) {
            if (!values->many) {
                diag(c->unit, at->span, DIAG_IF_WITHOUT_ELSE,
                     "used as a value, an if gives one either way: add else { … }");
            }
            break;
        }
        if (at->c->kind != NODE_IF) {
            type = check_branch(c, at->c, values, type, false);
            break;
        }
    }
    c->body->conditional--;
    return type;
}

static void check_entry_outside(Checker *c, Node *item, Values *values)
{
    if (!values->entries) {
        diag(c->unit, item->span, DIAG_MISPLACED,
             "name: value; is an argument of the call that a block belongs to, and %s takes none here", values->what);
    }
    check_expr(c, item->b);
    values->entries = !values->file;
    if (values->many || values->file) return;
    values->count = 1; // what the word before the block would have made of them
    values->joined = poison();
}

// print("r =", 2) reads as a vector; people who write it come from where print is called.
static void check_printed(Checker *c, Node *part)
{
    bool called = false;
    for (const Node *one = part->kind == NODE_VECTOR ? part->a : NULL; one; one = one->next)
        called |= one->kind == NODE_STRING;
    if (!called) {
        check_expr(c, part);
        return;
    }
    diag(c->unit, part->span, DIAG_TYPE_MISMATCH, "print has no parentheses: write print \"r =\", r;");
    for (Node *one = part->a; one; one = one->next) check_expr(c, one);
}

void check_item(Checker *c, Node *item, Values *values)
{
    switch (item->kind) {
    case NODE_VALUE:
        if (values->cases && item->a->kind != NODE_IF) {
            check_value_among_cases(c, item, values->cases);
        } else if (item->a->kind == NODE_IF && values->many) {
            check_if(c, item->a, values);
        } else if (item->a->kind == NODE_IF) {
            Values branch = *values;
            check_value(c, item->a, check_if(c, item->a, &branch), values);
        } else {
            check_value(c, item->a, check_expr(c, item->a), values);
        }
        break;
    case NODE_FOR:
        if (!values->many) {
            diag(c->unit, item->span, DIAG_VALUE_COUNT,
                 "%s has exactly one value, and a for gives any number: put it in [ ] for a list", values->what);
            Values any = {.many = true, .what = "a for"};
            check_for(c, item, &any);
            values->count = 1;
            values->joined = poison();
        } else {
            check_for(c, item, values);
        }
        break;
    case NODE_LET:
    case NODE_DECLARE: check_let(c, item); break;
    case NODE_ENTRY:
        if (values->cases)
            check_case(c, item, values->cases);
        else
            check_entry_outside(c, item, values);
        break;
    case NODE_ASSERT:
        expect(c, item->a, check_expr(c, item->a), type_of(TYPE_BOOL), "what is asserted");
        if (item->b) expect(c, item->b, check_expr(c, item->b), type_of(TYPE_STRING), "the message of an assert");
        break;
    case NODE_PRINT:
        for (Node *part = item->a; part; part = part->next) check_printed(c, part);
        break;
    case NODE_ERROR: // one value may have been meant
        values->count = 1;
        values->joined = poison();
        break;
    default: break; // what belongs into a file was reported where it was read
    }
}

Type check_block(Checker *c, Node *block, Values *values)
{
    if (block->kind != NODE_BLOCK) { // the parser has said what is wrong with it
        values->count = 1;
        values->joined = poison();
        return poison();
    }
    BlockScope scope;
    uint32_t mark = names_open(c, &scope, block->a);
    bool error = false;
    for (Node *item = block->a; item; item = item->next) {
        check_item(c, item, values);
        error |= item->kind == NODE_ERROR;
    }
    names_close(c, mark);
    if (values->many) return values->known ? values->want : values->joined;
    if (error) return poison();
    if (values->count == 0) {
        diag(c->unit, block->span, DIAG_VALUE_COUNT,
             "%s has exactly one value, and here is none: end it with an expression", values->what);
        return poison();
    }
    if (values->count > 1) {
        diag(c->unit, block->span, DIAG_VALUE_COUNT,
             "%s has exactly one value, and here are %d: for objects say union { … }, for a list [ … ]", values->what,
             values->count);
        return poison();
    }
    return values->known ? values->want : values->joined;
}
