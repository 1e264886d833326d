// The reference of a library, or of what is built in: `scn doc`, and the model behind it.
//
//     Doc *doc = doc_of_library(&unit, source, "brushes", true);   or doc_of_builtins(&unit)
//     doc_pictures(doc, options, …);                               renders its examples
//     doc_write_html(doc, out);                                    or doc_write_markdown()
//
// What is documented are the tags, tools, functions and params of a file, and its declarations and lets that have a `///`; not what begins
// with `_`. Several of one name are one entry with several forms. A `///` is text of paragraphs, `code`, lists of lines that begin with "- ",
// and blocks between lines of ```; a block ```scn is a scene, which is rendered. It sees the library as it stands: it says `use` itself; one
// that says neither `use` nor `include` gets the library included before it. What can be shown and has no example gets a default scene: a
// shape is shown as it is (cut to a box if it has no end), a tool on a ball, a perturbation in one, a material on one. What a parameter needs is
// made up by its type.
//
// Everything is in the unit's arena but the pictures, which doc_release() frees.
#ifndef SCN_RUNTIME_DOC_H
#define SCN_RUNTIME_DOC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "lang/unit.h"

typedef struct DocParameter {
    const char *name, *type;
    const char *initial, *range; // as they are written; NULL: none
    const char *doc;             // or NULL
    bool optional;               // may be left out without a default
    bool later;                  // this version has it not yet
    struct DocParameter *next;
} DocParameter;

typedef struct DocExample {
    const char *shown;   // the text that is printed
    const char *before;  // and what stands before it when it is rendered: "" or an `include`, `use`
    const char *clipped; // a default scene for what has no end, or NULL
    bool made_up;        // a default scene, which stands in no text
    Span span;           // of the documented word
    uint8_t *png;        // owned; NULL: no picture
    size_t png_size;
    struct DocExample *next;
} DocExample;

typedef struct DocForm {
    const char *result, *doc; // or NULL
    DocParameter *parameters;
    DocExample *examples, *last_example;
    bool later, called; // called: has parentheses
    Span span;
    struct DocForm *next;
} DocForm;

typedef struct DocEntry {
    const char *name, *kind; // "tag", "tool", "function", …
    DocForm *forms, *last_form;
    struct DocEntry *next;
} DocEntry;

typedef struct DocGroup {
    const char *title, *intro; // intro: or NULL
    DocEntry *entries, *last;
    struct DocGroup *next;
} DocGroup;

typedef struct Doc {
    Unit *unit;
    const char *title, *intro; // intro: the file's own text, or NULL
    const char *path;          // what examples are read as: beside the library
    const char *prefix;        // what names its words from outside: "brushes." or ""
    const char *use;           // the line that brings it, for default scenes; "" for what is built in
    const char *include;       // the line for examples that bring nothing themselves
    DocGroup *groups, *last_group;
    int entry_count;
} Doc;

// The documentation of a parsed file. `name` is how a scene uses it: of a file its path from its folder, of a library of scn its name.
Doc *doc_of_library(Unit *unit, const Source *source, const char *name, bool standard);
Doc *doc_of_builtins(Unit *unit);

// Renders all examples. Mistakes of examples go to standard error, as the compiler says them. Returns the worst exit status.
typedef struct DocPictures {
    int width, height;
    const char *device;
    const char *const *includes;
    int include_count;
} DocPictures;
int doc_pictures(Doc *doc, const DocPictures *pictures);
void doc_release(Doc *doc);

void doc_write_html(const Doc *doc, FILE *out);

// Pictures are named as files beside it: STEM-NAME-K.png, by doc_picture_name().
void doc_write_markdown(const Doc *doc, const char *stem, FILE *out);
void doc_picture_name(char *text, size_t size, const char *stem, const char *entry, int k);

#endif
