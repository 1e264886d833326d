// Any bytes are a text: they are parsed, what is reported about them is printed, and so is the tree. Nothing may crash, hang, or leave
// an error without a message. Files are not looked for: includes are parsed and not followed.
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "lang/ast.h"
#include "lang/unit.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length);

// An assert() would be left out of an optimised build.
static void require(bool holds, const char *what)
{
    if (holds) return;
    fprintf(stderr, "not true: %s\n", what);
    abort();
}

static int errors_in(const Node *node)
{
    int count = node->kind == NODE_ERROR;
    const Node *children[] = {node->a, node->b, node->c};
    for (int i = 0; i < 3; i++) {
        for (const Node *child = children[i]; child; child = child->next)
            count += errors_in(child); // the input bounds its chains
    }
    return count;
}

static void print_to_memory(const Unit *unit, const Node *tree)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    if (!out) return;
    diag_print(unit, out, true);
    ast_print(unit, tree, out);
    fclose(out);
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length)
{
    if (length > 20000) return 0;
    Unit unit;
    unit_init(&unit);
    char *text = arena_text(&unit.arena, (const char *)bytes, length);
    const Source *source = source_add(&unit.sources, "fuzz.scn", text, length, (Span){0});
    const Node *tree = parse_source(&unit, source);
    require(tree && tree->kind == NODE_FILE, "there is always a tree");
    require(unit.errors > 0 || errors_in(tree) == 0, "what makes no sense is reported");
    require(tree->depth <= NODE_DEPTH_MAX, "the tree can be walked by recursion");
    print_to_memory(&unit, tree);
    unit_release(&unit);
    return 0;
}
