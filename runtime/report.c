#include "runtime/report.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "lang/diag.h"
#include "runtime/command.h"
#include "runtime/scene.h"

// Messages come from everywhere, as they do on the standard error stream, which is as global: what is collected is kept here.
typedef struct Report {
    const Options *options;
    cJSON *results, *failures, *notices; // NULL: messages are text
    char *printed;
    int errors, warnings;
} Report;

static Report report;

static bool is_sarif(void)
{
    return report.options->format == FORMAT_SARIF;
}

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

static void add_diagnostic(const ScnScene *scene, int index, const ScnDiagnostic *d)
{
    report.errors += !strcmp(d->severity, "error");
    report.warnings += !strcmp(d->severity, "warning");
    cJSON_AddItemToArray(report.results, is_sarif() ? sarif_result(scene, index, d) : json_result(scene, index, d));
}

static void add_printed(const char *text)
{
    size_t before = report.printed ? strlen(report.printed) : 0, more = strlen(text);
    report.printed = realloc(report.printed, before + more + 1);
    if (!report.printed) abort(); // as in arena_alloc()
    memcpy(report.printed + before, text, more + 1);
}

void report_scene(ScnScene *scene)
{
    if (!report.results) {
        if (!report.options->quiet) fputs(scn_printed(scene), stderr);
        fputs(scn_diagnostics_text(scene, command_color(report.options, stderr)), stderr);
        return;
    }
    ScnDiagnostic d;
    for (int k = 0; scn_diagnostic(scene, k, &d); k++) add_diagnostic(scene, k, &d);
    if (!report.options->quiet) add_printed(scn_printed(scene));
}

void report_frame(const ScnScene *scene)
{
    ScnDiagnostic d;
    if (!report.results)
        fprintf(stderr, "%s\n", scn_error(scene));
    else if (scn_frame_diagnostic(scene, &d))
        add_diagnostic(scene, -1, &d);
}

void report_unit(const Unit *unit)
{
    if (!report.results) {
        diag_print(unit, stderr, command_color(report.options, stderr));
        return;
    }
    // What is asked of a scene here is in its unit alone.
    Arena scratch = {0};
    ScnScene scene = {.unit = *unit};
    scene.diagnostics = diag_sorted(unit, &scratch, &scene.diagnostic_count);
    ScnDiagnostic d;
    for (int k = 0; scn_diagnostic(&scene, k, &d); k++) add_diagnostic(&scene, k, &d);
    arena_release(&scratch);
}

static void add_text(cJSON *to, const char *lead, const char *format, va_list arguments)
{
    va_list again;
    va_copy(again, arguments);
    int length = vsnprintf(NULL, 0, format, again);
    va_end(again);
    char *text = malloc((size_t)length + 1);
    if (!text) abort(); // as in arena_alloc()
    vsnprintf(text, (size_t)length + 1, format, arguments);
    if (to)
        cJSON_AddItemToArray(to, cJSON_CreateString(text));
    else
        fprintf(stderr, "scn: %s%s\n", lead, text);
    free(text);
}

void command_error(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    add_text(report.failures, "", format, arguments);
    va_end(arguments);
}

void command_warning(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    add_text(report.notices, "warning: ", format, arguments);
    va_end(arguments);
}

// --- documents

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

static cJSON *sarif_notification(const char *level, const char *text)
{
    cJSON *notification = cJSON_CreateObject();
    cJSON_AddStringToObject(notification, "level", level);
    cJSON_AddItemToObject(notification, "message", sarif_text(text));
    return notification;
}

static void add_notifications(cJSON *to, const cJSON *texts, const char *level)
{
    const cJSON *text;
    cJSON_ArrayForEach(text, texts) cJSON_AddItemToArray(to, sarif_notification(level, text->valuestring));
}

static cJSON *sarif_document(int status)
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
    cJSON *notifications = cJSON_AddArrayToObject(invocation, "toolExecutionNotifications");
    add_notifications(notifications, report.failures, "error");
    add_notifications(notifications, report.notices, "warning");
    if (report.printed && *report.printed)
        cJSON_AddItemToArray(notifications, sarif_notification("note", report.printed));
    cJSON_Delete(report.failures);
    cJSON_Delete(report.notices);
    cJSON_AddStringToObject(run, "columnKind", "unicodeCodePoints");
    cJSON_AddItemToObject(run, "results", report.results);
    return json;
}

static cJSON *json_document(void)
{
    cJSON *json = cJSON_CreateObject();
    cJSON_AddStringToObject(json, "scn", scn_version());
    cJSON_AddNumberToObject(json, "errors", report.errors);
    cJSON_AddNumberToObject(json, "warnings", report.warnings);
    cJSON_AddItemToObject(json, "failures", report.failures);
    cJSON_AddItemToObject(json, "notices", report.notices);
    cJSON_AddStringToObject(json, "printed", report.printed ? report.printed : "");
    cJSON_AddItemToObject(json, "diagnostics", report.results);
    return json;
}

void report_begin(const Options *options)
{
    report = (Report){.options = options};
    if (options->format == FORMAT_TEXT) return;
    report.results = cJSON_CreateArray();
    report.failures = cJSON_CreateArray();
    report.notices = cJSON_CreateArray();
}

bool report_end(int status)
{
    if (!report.results) return true;
    FILE *out = report.options->command == COMMAND_CHECK ? stdout : stderr;
    bool written = command_json(out, is_sarif() ? sarif_document(status) : json_document());
    free(report.printed);
    report = (Report){.options = report.options};
    return written;
}
