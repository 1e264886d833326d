// Any bytes as the text of an IR: what is read prints and reads back to the same text, goes through all passes whole,
// and its frame runs.
#include <assert.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compiler/bounds.h"
#include "compiler/frame.h"
#include "compiler/ir.h"
#include "compiler/lower.h"
#include "compiler/passes.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

// Objects in objects, each twice and moved, are 2^n of them, as they are meant to be; a fuzzer finds that soon and
// waits for it.
enum { MAPS_MAX = 12 };

static int count_of(const char *text, size_t size, const char *word)
{
    int count = 0;
    const char *end = text + size;
    for (const char *at = text; (at = memmem(at, (size_t)(end - at), word, strlen(word))); at++) count++;
    return count;
}

static char *printed(const Ir *ir, size_t *length)
{
    char *text;
    FILE *out = open_memstream(&text, length);
    if (!out) abort();
    ir_print(ir, out);
    fclose(out);
    return text;
}

static void check_text(const Ir *ir)
{
    Arena arena = {0};
    IrReadError error;
    size_t length, again_length;
    char *text = printed(ir, &length);
    Ir *again = ir_read(&arena, text, length, &error);
    assert(again && "what is printed can be read");
    char *again_text = printed(again, &again_length);
    assert(length == again_length && !memcmp(text, again_text, length) && "and is the same");
    free(text);
    free(again_text);
    arena_release(&arena);
}

static void run_frame(const Plan *plan)
{
    FrameError error;
    double *values = malloc(plan->slot_count * sizeof *values);
    assert(frame_check(plan) == plan->step_count && "the compiler's programs are sound");
    if (frame_evaluate(plan, &(FrameInput){.time = 0.5, .frame = 12}, values, &error)) {
        bounds_of_plan(plan, values);
        plan_field(plan, values, (const double[3]){0.1, 0.2, 0.3}, NULL);
    }
    free(values);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    const char *text = (const char *)bytes;
    if (count_of(text, size, "transform") + count_of(text, size, "place") + count_of(text, size, "deform") > MAPS_MAX)
        return 0;
    Arena arena = {0};
    IrReadError error;
    Ir *ir = ir_read(&arena, text, size, &error);
    if (ir) {
        check_text(ir);
        bool ok = true;
        for (int k = 0; k < PASS_COUNT && ok; k++) {
            Arena scratch = {0};
            ok = passes[k].run(ir, &scratch);
            arena_release(&scratch);
            assert((!ok || !pass_verify(ir, &passes[k])) && "an IR is whole between passes");
        }
        if (ok) check_text(ir);
        Plan *plan;
        if (ok && plan_lower(ir, &arena, &plan, NULL) == LOWER_DONE) run_frame(plan);
    }
    arena_release(&arena);
    return 0;
}
