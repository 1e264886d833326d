// What a command has to say, as text or for programs: `--error-format` of every command.
//
//     report_begin(&options);              // text: messages are printed when they come; json, sarif: they are collected, …
//     report_scene(scene);
//     command_error("cannot read %s", path);
//     report_end(status);                  // … and one document is written when the command ends
//
// The document of `scn check`, which has nothing else to say, goes to standard output, that of every other command to standard error,
// where its messages are as text. JSON:
//
//     {"scn": "0.1.0", "errors": 1, "warnings": 0, "failures": ["cannot read b.scn: …"], "notices": ["…"], "printed": "…\n",
//      "diagnostics": [{"severity": "error", "code": "angle-unit", "message": "…", "at": PLACE,
//                       "notes": [{"message": "…", "at": PLACE}],
//                       "fixes": [{"confidence": "sure|likely|guess", "at": PLACE, "replacement": "90deg"}]}]}
//     PLACE: {"path": "a.scn", "line": 4, "column": 17, "end_line": 4, "end_column": 19}
//
// Lines and columns count from 1, columns are code points, an end is behind the last of them, and "at" is missing where there is no
// place. A fix replaces what stands at its place. Failures are not the scene's fault, notices nobody's, and "printed" is what `print` in
// the scene says. SARIF 2.1.0 says the same in its own words: notes are related locations, a fix's confidence stands in its description,
// failures, notices and what was printed are notifications of the invocation, and the rules are those of `scn explain`.
#ifndef SCN_RUNTIME_REPORT_H
#define SCN_RUNTIME_REPORT_H

#include "lang/unit.h"
#include "runtime/options.h"
#include "runtime/scn.h"

void report_begin(const Options *options);

// Writes the document, if there is one. False where it cannot be written.
bool report_end(int status);

// What the compiler says of a scene and what the scene prints.
void report_scene(ScnScene *scene);

// What is wrong in a frame: of a scene whose last scn_render() was SCN_SCENE_WRONG.
void report_frame(const ScnScene *scene);

// What was found in a text that becomes no scene: of fmt, flatten and doc.
void report_unit(const Unit *unit);

#endif
