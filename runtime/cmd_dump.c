// scn dump, scn explain: what the compiler makes of a scene, and what its messages mean.
#include <stdlib.h>
#include <string.h>

#include "lang/diag.h"
#include "lang/intern.h"
#include "runtime/command.h"
#include "runtime/scene.h"

// --- explain

static void list_codes(void)
{
    static const char *const severities[] = {
        [SEVERITY_NOTE] = "note", [SEVERITY_WARNING] = "warning", [SEVERITY_ERROR] = "error"};
    for (int code = 0; code < DIAG_COUNT; code++)
        printf("%-24s %s\n", diag_code_name((DiagCode)code), severities[diag_severity((DiagCode)code)]);
}

static void print_example(const char *title, const char *text)
{
    if (!text || !*text) return;
    printf("\n%s:\n", title);
    while (*text) {
        int length = (int)strcspn(text, "\n");
        printf("    %.*s\n", length, text);
        text += length + (text[length] == '\n');
    }
}

int command_explain(const Options *options)
{
    if (!options->file_count) {
        list_codes();
        return EXIT_DONE;
    }
    DiagCode code;
    if (diag_code_find(options->files[0], &code)) {
        printf("%s\n\n", diag_code_name(code));
        options_wrap(stdout, diag_explanation(code), 0);
        print_example("Wrong", diag_wrong_example(code));
        print_example("Right", diag_right_example(code));
        return EXIT_DONE;
    }
    const char *names[DIAG_COUNT];
    for (int i = 0; i < DIAG_COUNT; i++) names[i] = diag_code_name((DiagCode)i);
    const char *nearest = nearest_name(options->files[0], names, DIAG_COUNT);
    if (nearest)
        command_error("there is no diagnostic %s: do you mean %s?", options->files[0], nearest);
    else
        command_error("there is no diagnostic %s: `scn explain` lists them", options->files[0]);
    return EXIT_USAGE;
}

// --- dump

static void list_passes(void)
{
    for (int k = 0; compile_pass_name(k); k++) printf("%s\n", compile_pass_name(k));
}

static int check_pass(const char *name)
{
    const char *names[64];
    int count = 0;
    for (; count < 64 && compile_pass_name(count); count++) {
        names[count] = compile_pass_name(count);
        if (!strcmp(names[count], name)) return EXIT_DONE;
    }
    const char *nearest = nearest_name(name, names, count);
    if (nearest)
        command_error("there is no pass %s: do you mean %s?", name, nearest);
    else
        command_error("there is no pass %s: `scn dump --after list` names them", name);
    return EXIT_USAGE;
}

// A package holds no more than its kernel.
static int dump_package(const Options *options)
{
    int status;
    if (options->ast || options->ir || options->after) {
        command_error("a package holds neither tree nor IR, only --kernel");
        return EXIT_USAGE;
    }
    ScnScene *scene = command_load(options, &status);
    if (scene) fwrite(scene->package->kernel, 1, scene->package->kernel_length, stdout);
    scn_free(scene);
    return status;
}

int command_dump(const Options *options)
{
    if (options->ast + options->ir + options->kernel + (options->after != NULL) != 1) {
        command_error("`scn dump` wants one of --ast, --ir, --after PASS, --kernel");
        return EXIT_USAGE;
    }
    if (options->after && !strcmp(options->after, "list")) {
        list_passes();
        return EXIT_DONE;
    }
    if (options->after && check_pass(options->after)) return EXIT_USAGE;
    if (package_file(options->files[0])) return dump_package(options);
    CommandScene parts;
    command_describe(options, &parts);
    ScnScene *scene = scene_new(&parts.desc, &(CompileOptions){
                                                 .dump_tree = options->ast ? stdout : NULL,
                                                 .dump_ir = options->ir ? stdout : NULL,
                                                 .dump_after = options->after ? stdout : NULL,
                                                 .after = options->after,
                                                 .dump_kernel = options->kernel ? stdout : NULL,
                                             });
    int status = command_loaded(scene);
    if (status == EXIT_DONE) scn_free(scene);
    return status;
}
