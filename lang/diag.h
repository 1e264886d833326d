// Diagnostics: what is said to the author of a scene.
//
// diag.def lists each diagnostic once: its code, its severity, an explanation. The wording is a literal at the
// call, where the compiler checks its format. A report says where, what, and what to write instead:
//
//     diag(unit, node->span, DIAG_ANGLE_UNIT, "an angle needs a unit: write %gdeg", number);
//
// or, with more to show:
//
//     Diag *d = diag(unit, span, DIAG_REDEFINED, "%s is already defined", name);
//     diag_label(unit, d, first->span, "first defined here");
//     diag_fix(unit, d, span, FIX_LIKELY, "%s2", name);
//
// One mistake is one message: values that are wrong are poisoned (type_error, NODE_ERROR) and agree with
// everything. A second report of the same code at the same span is dropped. After 20 errors the rest is counted.
#ifndef SCN_LANG_DIAG_H
#define SCN_LANG_DIAG_H

#include <stdbool.h>
#include <stdio.h>

#include "lang/source.h"

typedef enum Severity { SEVERITY_NOTE, SEVERITY_WARNING, SEVERITY_ERROR } Severity;

typedef enum DiagCode {
#define DIAG(id, code, severity, explanation, wrong, right) DIAG_##id,
#include "lang/diag.def"
#undef DIAG
    DIAG_COUNT
} DiagCode;

typedef enum FixKind { FIX_SURE, FIX_LIKELY, FIX_GUESS } FixKind;

typedef struct DiagLabel { // a further place that has to do with it
    struct DiagLabel *next;
    Span span;
    const char *text;
} DiagLabel;

typedef struct DiagFix { // replace `span` by `text`
    struct DiagFix *next;
    Span span;
    FixKind kind;
    const char *text;
} DiagFix;

typedef struct Diag {
    struct Diag *next;
    DiagCode code;
    Severity severity;
    Span span;
    const char *text;
    DiagLabel *labels; // in the order they were added
    DiagFix *fixes;
} Diag;

typedef struct Diagnostics {
    Diag *first, *last; // as they were reported; at most DIAG_KEPT_MAX of each severity
    Diag **places;      // those that are kept, by code and span
    Diag discarded;     // given for what is not kept
    int kept[3];        // by severity
    int shown_limit;    // errors printed, and warnings printed; 0 means 20
    bool warnings_are_errors;
    uint8_t levels[DIAG_COUNT]; // WarningLevel, of warnings
} Diagnostics;

// What becomes of a warning: LEVEL_DEFAULT is a warning, or an error if warnings_are_errors.
typedef enum WarningLevel { LEVEL_DEFAULT, LEVEL_OFF, LEVEL_WARNING, LEVEL_ERROR } WarningLevel;

enum { DIAG_KEPT_MAX = 1000, DIAG_INCLUDES_SHOWN = 50 };

struct Unit;

// Reports. Never returns NULL: what is dropped as a duplicate is still a Diag, printed by nobody.
// What is beyond DIAG_KEPT_MAX is counted only.
Diag *diag(struct Unit *unit, Span span, DiagCode code, const char *format, ...) __attribute__((format(printf, 4, 5)));
// Takes back an error that turned out to be the consequence, or the beginning, of another one that is reported instead.
void diag_take_back(struct Unit *unit, Diag *d);
void diag_label(struct Unit *unit, Diag *d, Span span, const char *format, ...) __attribute__((format(printf, 4, 5)));
void diag_fix(struct Unit *unit, Diag *d, Span span, FixKind kind, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

// Sets what becomes of warnings, as -W of the command does; later settings win. Returns NULL, or what is wrong with the setting (in the arena).
//
//     name        on, if it was off             error          all of them are errors
//     no-name     off                           error=name     this one is an error
//     all, none   all on, all off               no-error=name  this one is none, though all others are
//
// What is an error by itself stays one.
const char *diag_set_warning(Arena *arena, Diagnostics *diagnostics, const char *setting);

const char *diag_code_name(DiagCode code); // "angle-unit"
Severity diag_severity(DiagCode code);
const char *diag_explanation(DiagCode code);   // one paragraph of sentences, not broken into lines
const char *diag_wrong_example(DiagCode code); // a scene that gets this diagnostic; lines end in \n
const char *diag_right_example(DiagCode code); // one that does not
bool diag_code_find(const char *name, DiagCode *code);

// What was reported, sorted by place (nowhere first), in an array of the arena. For editors and --json.
const Diag **diag_sorted(const struct Unit *unit, Arena *arena, int *count);

// Prints all that was reported, sorted by place: "file:line:column: error: text [code]", the source line, a caret, labels,
// fixes, the chain of includes. `color` uses ANSI colours. Ends with a count where more than shown_limit errors came.
void diag_print(const struct Unit *unit, FILE *out, bool color);

#endif
