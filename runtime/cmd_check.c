// scn check: what is wrong with scenes, for people as text, and for programs as JSON or as SARIF 2.1.0.
//
// JSON is one document for all files of the command line:
//
//     {"scn": "0.1.0", "errors": 1, "warnings": 0, "failures": ["cannot read b.scn: …"],
//      "diagnostics": [{"severity": "error", "code": "angle-unit", "message": "…", "at": PLACE,
//                       "notes": [{"message": "…", "at": PLACE}],
//                       "fixes": [{"confidence": "sure|likely|guess", "at": PLACE, "replacement": "90deg"}]}]}
//     PLACE: {"path": "a.scn", "line": 4, "column": 17, "end_line": 4, "end_column": 19}
//
// Lines and columns count from 1, columns are code points, an end is behind the last of them, and "at" is missing where there is no
// place. A fix replaces what stands at its place. SARIF says the same in its own words: notes are related locations, a fix's
// confidence stands in its description, failures are notifications of the invocation, and the rules are those of `scn explain`.
#include <ctype.h>
#include <stdlib.h>
#include <string.h>

#include "lang/diag.h"
#include "runtime/command.h"

typedef struct Report {
    ErrorFormat format;
    cJSON *results, *failures;
    int errors, warnings;
} Report;

// --- places

typedef struct Region {
    const char *path;
    uint32_t line, column, end_line, end_column;
} Region;

static cJSON *json_place(const Region *r)
{
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "path", r->path);
    cJSON_AddNumberToObject(json, "line", r->line);
    cJSON_AddNumberToObject(json, "column", r->column);
    cJSON_AddNumberToObject(json, "end_line", r->end_line);
    cJSON_AddNumberToObject(json, "end_column", r->end_column);
    return json;
}

static void add_place(cJSON *json, const Region *r)
{
    if (r->path) cJSON_AddItemToObject(json, "at", json_place(r));
}

// A path as a URI reference: bytes that have a meaning there, or none, as %XX. An absolute path is a file's URI; a colon in the first part
// of a relative one would be a scheme.
static cJSON *sarif_uri(const char *path)
{
    size_t length = strlen(path);
    char *uri = malloc(3 * length + 8), *out = uri;
    if (!uri) abort(); // as in arena_alloc()
    if (path[0] == '/') out += sprintf(out, "file://");
    for (const char *p = path; *p; p++) {
        unsigned char c = (unsigned char)*p;
        if (isalnum(c) || strchr("-._~/", c))
            *out++ = (char)c;
        else
            out += sprintf(out, "%%%02X", c);
    }
    *out = 0;
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "uri", uri);
    free(uri);
    return json;
}

static cJSON *sarif_region(const Region *r)
{
    cJSON *region = cJSON_CreateObject();
    cJSON_AddNumberToObject(region, "startLine", r->line);
    cJSON_AddNumberToObject(region, "startColumn", r->column);
    cJSON_AddNumberToObject(region, "endLine", r->end_line);
    cJSON_AddNumberToObject(region, "endColumn", r->end_column);
    return region;
}

static cJSON *sarif_text(const char *text)
{
    cJSON *message = cJSON_CreateObject();
    cJSON_AddStringToObject(message, "text", text);
    return message;
}

static cJSON *sarif_location(const Region *r)
{
    cJSON *location = cJSON_CreateObject(), *physical = cJSON_AddObjectToObject(location, "physicalLocation");
    cJSON_AddItemToObject(physical, "artifactLocation", sarif_uri(r->path));
    cJSON_AddItemToObject(physical, "region", sarif_region(r));
    return location;
}

// --- one diagnostic

static const char *confidence_word(ScnConfidence confidence)
{
    static const char *const words[] = {
        [SCN_FIX_SURE] = "sure", [SCN_FIX_LIKELY] = "likely", [SCN_FIX_GUESS] = "guess"};
    return words[confidence];
}

static Region diagnostic_region(const ScnDiagnostic *d)
{
    return (Region){d->path, d->line, d->column, d->end_line, d->end_column};
}

static Region note_region(const ScnDiagnosticNote *n)
{
    return (Region){n->path, n->line, n->column, n->end_line, n->end_column};
}

static Region fix_region(const ScnFix *f)
{
    return (Region){f->path, f->line, f->column, f->end_line, f->end_column};
}

static cJSON *json_result(const ScnScene *scene, int index, const ScnDiagnostic *d)
{
    Region at = diagnostic_region(d);
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "severity", d->severity);
    cJSON_AddStringToObject(json, "code", d->code);
    cJSON_AddStringToObject(json, "message", d->text);
    add_place(json, &at);
    cJSON *notes = cJSON_AddArrayToObject(json, "notes"), *fixes = cJSON_AddArrayToObject(json, "fixes");
    ScnDiagnosticNote note;
    for (int k = 0; scn_diagnostic_note(scene, index, k, &note); k++) {
        cJSON *one = cJSON_CreateObject();
        at = note_region(&note);
        cJSON_AddStringToObject(one, "message", note.text);
        add_place(one, &at);
        cJSON_AddItemToArray(notes, one);
    }
    ScnFix fix;
    for (int k = 0; scn_diagnostic_fix(scene, index, k, &fix); k++) {
        cJSON *one = cJSON_CreateObject();
        at = fix_region(&fix);
        cJSON_AddStringToObject(one, "confidence", confidence_word(fix.confidence));
        add_place(one, &at);
        cJSON_AddStringToObject(one, "replacement", fix.replacement);
        cJSON_AddItemToArray(fixes, one);
    }
    return json;
}

static cJSON *sarif_fix(const ScnFix *fix)
{
    char description[80];
    snprintf(description, sizeof description, "%s this (%s)", fix->replacement[0] ? "replace" : "remove",
             confidence_word(fix->confidence));
    Region at = fix_region(fix);
    cJSON *json = cJSON_CreateObject(), *change = cJSON_CreateObject(), *replacement = cJSON_CreateObject();
    cJSON_AddItemToObject(json, "description", sarif_text(description));
    cJSON_AddItemToArray(cJSON_AddArrayToObject(json, "artifactChanges"), change);
    cJSON_AddItemToObject(change, "artifactLocation", sarif_uri(fix->path));
    cJSON_AddItemToArray(cJSON_AddArrayToObject(change, "replacements"), replacement);
    cJSON_AddItemToObject(replacement, "deletedRegion", sarif_region(&at));
    cJSON_AddItemToObject(replacement, "insertedContent", sarif_text(fix->replacement));
    return json;
}

static cJSON *sarif_result(const ScnScene *scene, int index, const ScnDiagnostic *d)
{
    DiagCode code = 0;
    diag_code_find(d->code, &code);
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "ruleId", d->code);
    cJSON_AddNumberToObject(json, "ruleIndex", code);
    cJSON_AddStringToObject(json, "level", d->severity);
    cJSON_AddItemToObject(json, "message", sarif_text(d->text));
    Region at = diagnostic_region(d);
    cJSON *locations = cJSON_AddArrayToObject(json, "locations");
    if (at.path) cJSON_AddItemToArray(locations, sarif_location(&at));
    cJSON *related = cJSON_CreateArray(), *fixes = cJSON_CreateArray();
    ScnDiagnosticNote note;
    for (int k = 0; scn_diagnostic_note(scene, index, k, &note); k++) {
        at = note_region(&note);
        if (!at.path) continue;
        cJSON *location = sarif_location(&at);
        cJSON_AddNumberToObject(location, "id", k);
        cJSON_AddItemToObject(location, "message", sarif_text(note.text));
        cJSON_AddItemToArray(related, location);
    }
    ScnFix fix;
    for (int k = 0; scn_diagnostic_fix(scene, index, k, &fix); k++) {
        if (fix.path) cJSON_AddItemToArray(fixes, sarif_fix(&fix));
    }
    cJSON_AddItemToObject(json, "relatedLocations", related);
    cJSON_AddItemToObject(json, "fixes", fixes);
    return json;
}

// --- all of them

static void report_scene(Report *report, const ScnScene *scene)
{
    ScnDiagnostic d;
    for (int k = 0; scn_diagnostic(scene, k, &d); k++) {
        report->errors += !strcmp(d.severity, "error");
        report->warnings += !strcmp(d.severity, "warning");
        bool sarif = report->format == FORMAT_SARIF;
        cJSON_AddItemToArray(report->results, sarif ? sarif_result(scene, k, &d) : json_result(scene, k, &d));
    }
    if (scn_error(scene)[0]) cJSON_AddItemToArray(report->failures, cJSON_CreateString(scn_error(scene)));
}

static cJSON *sarif_rules(void)
{
    cJSON *rules = cJSON_CreateArray();
    for (int k = 0; k < DIAG_COUNT; k++) {
        DiagCode code = (DiagCode)k;
        const char *text = diag_explanation(code);
        char first[200]; // sentence
        snprintf(first, sizeof first, "%.*s.", (int)strcspn(text, "."), text);
        cJSON *rule = cJSON_CreateObject(), *configuration;
        cJSON_AddStringToObject(rule, "id", diag_code_name(code));
        cJSON_AddItemToObject(rule, "shortDescription", sarif_text(first));
        cJSON_AddItemToObject(rule, "fullDescription", sarif_text(text));
        configuration = cJSON_AddObjectToObject(rule, "defaultConfiguration");
        cJSON_AddStringToObject(configuration, "level", diag_severity(code) == SEVERITY_ERROR ? "error" : "warning");
        cJSON_AddItemToArray(rules, rule);
    }
    return rules;
}

static cJSON *sarif_document(Report *report, int status)
{
    cJSON *json = cJSON_CreateObject(), *run = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "$schema", "https://json.schemastore.org/sarif-2.1.0.json");
    cJSON_AddStringToObject(json, "version", "2.1.0");
    cJSON_AddItemToArray(cJSON_AddArrayToObject(json, "runs"), run);
    cJSON *driver = cJSON_AddObjectToObject(cJSON_AddObjectToObject(run, "tool"), "driver");
    cJSON_AddStringToObject(driver, "name", "scn");
    cJSON_AddStringToObject(driver, "version", scn_version());
    cJSON_AddItemToObject(driver, "rules", sarif_rules());
    cJSON *invocation = cJSON_CreateObject();
    cJSON_AddItemToArray(cJSON_AddArrayToObject(run, "invocations"), invocation);
    cJSON_AddNumberToObject(invocation, "exitCode", status);
    cJSON_AddBoolToObject(invocation, "executionSuccessful", status == EXIT_DONE || status == EXIT_SCENE);
    cJSON *notifications = cJSON_AddArrayToObject(invocation, "toolExecutionNotifications"), *failure;
    cJSON_ArrayForEach(failure, report->failures)
    {
        cJSON *notification = cJSON_CreateObject();
        cJSON_AddStringToObject(notification, "level", "error");
        cJSON_AddItemToObject(notification, "message", sarif_text(failure->valuestring));
        cJSON_AddItemToArray(notifications, notification);
    }
    cJSON_Delete(report->failures);
    cJSON_AddStringToObject(run, "columnKind", "unicodeCodePoints");
    cJSON_AddItemToObject(run, "results", report->results);
    return json;
}

static cJSON *json_document(Report *report)
{
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "scn", scn_version());
    cJSON_AddNumberToObject(json, "errors", report->errors);
    cJSON_AddNumberToObject(json, "warnings", report->warnings);
    cJSON_AddItemToObject(json, "failures", report->failures);
    cJSON_AddItemToObject(json, "diagnostics", report->results);
    return json;
}

// --- the command

static int check_one(const Options *one, Report *report)
{
    int status;
    if (report->format == FORMAT_TEXT) {
        ScnScene *loaded = command_load(one, &status);
        if (loaded) status = command_depfile(one, loaded, NULL);
        scn_free(loaded);
        return status;
    }
    static const int exits[] = {[SCN_OK] = EXIT_DONE,
                                [SCN_SCENE_WRONG] = EXIT_SCENE,
                                [SCN_CALL_WRONG] = EXIT_USAGE,
                                [SCN_WORLD_FAILED] = EXIT_WORLD,
                                [SCN_CANCELLED] = EXIT_CANCELLED};
    CommandScene parts;
    command_describe(one, &parts);
    ScnScene *scene = scn_load(&parts.desc);
    if (!scene) {
        command_error("out of memory");
        return EXIT_WORLD;
    }
    fputs(scn_printed(scene), stderr); // standard output is the document's
    report_scene(report, scene);
    status = exits[scn_status(scene)];
    if (status == EXIT_DONE) status = command_depfile(one, scene, NULL);
    scn_free(scene);
    return status;
}

int command_check(const Options *options)
{
    if (options->depfile_path && options->file_count > 1) {
        command_error("-MF is for one scene");
        return EXIT_USAGE;
    }
    Report report = {.format = options->format};
    if (report.format != FORMAT_TEXT) {
        report.results = cJSON_CreateArray();
        report.failures = cJSON_CreateArray();
    }
    int worst = EXIT_DONE;
    for (int i = 0; i < options->file_count; i++) {
        Options one = *options;
        one.files[0] = options->files[i];
        one.file_count = 1;
        int status = check_one(&one, &report);
        if (status > worst) worst = status;
    }
    if (report.format == FORMAT_TEXT) return worst;
    bool written =
        command_json(stdout, report.format == FORMAT_SARIF ? sarif_document(&report, worst) : json_document(&report));
    return written ? worst : EXIT_WORLD;
}
