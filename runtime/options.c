#include "runtime/options.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "lang/intern.h"
#include "runtime/film.h"

typedef struct CommandEntry {
    const char *name, *arguments, *help;
} CommandEntry;

static const CommandEntry commands[] = {
#define COMMAND(id, name, arguments, help) {name, arguments, help},
#include "runtime/options.def"
};

#define ON(command) (1u << COMMAND_##command)

typedef struct OptionEntry {
    const char *name;
    char letter;
    const char *value;
    unsigned commands;
    const char *help;
} OptionEntry;

static const OptionEntry entries[] = {
#define OPTION(id, name, letter, value, commands, help) {name, letter, value, commands, help},
#include "runtime/options.def"
};

// What some commands say of an option instead.
typedef struct HelpEntry {
    OptionId option;
    unsigned commands;
    const char *help;
} HelpEntry;

static const HelpEntry helps[] = {
#define OPTION_FOR(id, commands, help) {OPTION_##id, commands, help},
#include "runtime/options.def"
};

static bool wrong(Options *options, const char *format, ...) __attribute__((format(printf, 2, 3)));
static bool wrong(Options *options, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(options->error, sizeof options->error, format, arguments);
    va_end(arguments);
    return false;
}

bool options_find_command(const char *name, CommandId *command)
{
    for (int i = 0; i < COMMAND_COUNT; i++) {
        if (strcmp(commands[i].name, name)) continue;
        *command = (CommandId)i;
        return true;
    }
    return false;
}

const char *options_nearest_command(const char *name)
{
    const char *names[COMMAND_COUNT];
    for (int i = 0; i < COMMAND_COUNT; i++) names[i] = commands[i].name;
    return nearest_name(name, names, COMMAND_COUNT);
}

// --- values

static bool whole(const char *text, long low, long high, int *value)
{
    char *end;
    errno = 0;
    long number = strtol(text, &end, 10);
    if (end == text || *end || errno || number < low || number > high) return false;
    *value = (int)number;
    return true;
}

static bool set_size(Options *options, const char *text)
{
    char *end;
    errno = 0;
    if (options->command == COMMAND_SLICE && whole(text, 1, FILM_MAX_SIZE, &options->width)) {
        options->height = 0;
        return true;
    }
    errno = 0;
    long width = strtol(text, &end, 10);
    bool ok = end != text && (*end == 'x' || *end == 'X');
    if (ok && !whole(end + 1, 1, FILM_MAX_SIZE, &options->height)) ok = false;
    if (!ok || errno || width < 1 || width > FILM_MAX_SIZE)
        return wrong(options, "--size wants WIDTHxHEIGHT of 1 to %d pixels, as 1280x720, not \"%s\"", FILM_MAX_SIZE,
                     text);
    options->width = (int)width;
    return true;
}

static bool set_frames(Options *options, const char *text)
{
    options->frames_given = true;
    if (!strcmp(text, "all")) {
        options->frames_all = true;
        return true;
    }
    char first[16] = "";
    const char *dots = strstr(text, ".."), *last = dots ? dots + 2 : text;
    size_t length = dots ? (size_t)(dots - text) : strlen(text);
    if (length < sizeof first) memcpy(first, text, length);
    if (!whole(first, 0, 100000000, &options->first_frame) || !whole(last, 0, 100000000, &options->last_frame))
        return wrong(options, "--frames wants A..B, one number or `all`, as 0..23, not \"%s\"", text);
    if (options->last_frame < options->first_frame)
        return wrong(options, "--frames counts up: write %d..%d", options->last_frame, options->first_frame);
    return true;
}

static bool set_lines(Options *options, const char *text)
{
    char first[16] = "";
    const char *dots = strstr(text, ".."), *last = dots ? dots + 2 : text;
    if (!dots && (dots = strchr(text, ':'))) last = dots + 1;
    size_t length = dots ? (size_t)(dots - text) : strlen(text);
    if (length < sizeof first) memcpy(first, text, length);
    if (!whole(first, 1, 1 << 30, &options->first_line) || !whole(last, 1, 1 << 30, &options->last_line))
        return wrong(options, "--lines wants A..B or one number, counted from 1, as 10..20, not \"%s\"", text);
    if (options->last_line < options->first_line)
        return wrong(options, "--lines counts up: write %d..%d", options->last_line, options->first_line);
    return true;
}

static bool set_layers(Options *options, const char *text)
{
    static const char *const names[] = {"color", "depth", "normal", "position", "id", "certificate", "all"};
    static const unsigned bits[] = {FILM_COLOR, FILM_DEPTH,       FILM_NORMAL, FILM_POSITION,
                                    FILM_ID,    FILM_CERTIFICATE, FILM_ALL};
    while (*text) {
        char name[32] = "";
        size_t length = strcspn(text, ",");
        if (length < sizeof name) memcpy(name, text, length);
        int found = -1;
        for (int i = 0; i < 7; i++)
            if (!strcmp(names[i], name)) found = i;
        if (found < 0) {
            const char *nearest = nearest_name(name, names, 7);
            return wrong(options, "there is no layer \"%.*s\": %s%s%s", (int)length, text,
                         nearest ? "do you mean " : "",
                         nearest ? nearest : "color, depth, normal, position, id, certificate, all are there",
                         nearest ? "?" : "");
        }
        options->layers |= bits[found];
        text += length;
        if (*text == ',') text++;
    }
    if (!options->layers) return wrong(options, "--layers wants at least one layer");
    return true;
}

// One of three words; their order is that of an enum.
static bool set_word(Options *options, const char *name, const char *text, const char *const words[3], int *value)
{
    for (int i = 0; i < 3; i++) {
        if (strcmp(text, words[i])) continue;
        *value = i;
        return true;
    }
    return wrong(options, "--%s wants %s, %s or %s, not \"%s\"", name, words[0], words[1], words[2], text);
}

static bool set_color(Options *options, const char *text)
{
    static const char *const words[] = {"auto", "always", "never"};
    int value = 0;
    bool ok = set_word(options, "color", text, words, &value);
    options->color = (ColorWhen)value;
    return ok;
}

static bool set_format(Options *options, const char *text)
{
    static const char *const words[] = {"text", "json", "sarif"};
    int value = 0;
    bool ok = set_word(options, "error-format", text, words, &value);
    options->format = (ErrorFormat)value;
    return ok;
}

static bool set_solver(Options *options, const char *text)
{
    static const char *const words[] = {"device", "direct", "gauss-seidel"};
    int value = 0;
    bool ok = set_word(options, "solver", text, words, &value);
    if (ok) options->solver = words[value];
    return ok;
}

static bool set_kernels(Options *options, const char *text)
{
    static const char *const words[] = {"auto", "quick", "full"};
    int value = 0;
    bool ok = set_word(options, "kernels", text, words, &value);
    options->kernels = (KernelsWhich)value;
    return ok;
}

static bool add(Options *options, const char **list, int *count, const char *text, const char *what)
{
    int limit = list == options->files ? OPTION_FILES : OPTION_LIMIT;
    if (*count == limit) return wrong(options, "more than %d %s", limit, what);
    list[(*count)++] = text;
    return true;
}

static bool set_define(Options *options, const char *text)
{
    const char *equals = strchr(text, '=');
    if (!equals || equals == text) return wrong(options, "-D wants NAME=VALUE, not \"%s\"", text);
    return add(options, options->defines, &options->define_count, text, "times -D");
}

static bool set_count(Options *options, const char *name, const char *text, int high, int *value)
{
    if (whole(text, 1, high, value)) return true;
    return wrong(options, "--%s wants a whole number from 1 to %d, not \"%s\"", name, high, text);
}

static bool set_either(Options *options, const char *name, const char *text, int a, int b, int *value)
{
    if (whole(text, a, b, value) && (*value == a || *value == b)) return true;
    return wrong(options, "--%s wants %d or %d, not \"%s\"", name, a, b, text);
}

static bool set_doc_format(Options *options, const char *text)
{
    options->markdown = !strcmp(text, "markdown") ? 2 : !strcmp(text, "html");
    return options->markdown || wrong(options, "--format wants html or markdown, not \"%s\"", text);
}

static bool set_option(Options *options, OptionId id, const char *value)
{
    switch (id) {
    case OPTION_OUTPUT: return add(options, options->outputs, &options->output_count, value, "times -o");
    case OPTION_SIZE: return set_size(options, value);
    case OPTION_TIME: options->time = value; return true;
    case OPTION_FRAMES: return set_frames(options, value);
    case OPTION_DEFINE: return set_define(options, value);
    case OPTION_CAMERA: options->camera = value; return true;
    case OPTION_ONLY: options->only = value; return true;
    case OPTION_LAYERS: return set_layers(options, value);
    case OPTION_SAMPLES: return set_count(options, "samples", value, 16, &options->samples);
    case OPTION_HALF: options->half = true; return true;
    case OPTION_FLOAT: options->full = true; return true;
    case OPTION_BITS: return set_either(options, "bits", value, 8, 16, &options->bits);
    case OPTION_STATS: options->stats = value; return true;
    case OPTION_DEVICE: options->device = value; return true;
    case OPTION_THREADS: return set_count(options, "threads", value, 4096, &options->threads);
    case OPTION_LANES: return set_either(options, "lanes", value, 1, 16, &options->lanes);
    case OPTION_INCLUDE: return add(options, options->includes, &options->include_count, value, "times -I");
    case OPTION_NO_CACHE: options->no_cache = true; return true;
    case OPTION_SOURCE: options->source = true; return true;
    case OPTION_REPEAT: return set_count(options, "repeat", value, 1000000, &options->repeat);
    case OPTION_AST: options->ast = true; return true;
    case OPTION_IR: options->ir = true; return true;
    case OPTION_AFTER: options->after = value; return true;
    case OPTION_KERNEL: options->kernel = true; return true;
    case OPTION_FMT_CHECK: options->check = true; return true;
    case OPTION_DIFF: options->diff = true; return true;
    case OPTION_LINES: return set_lines(options, value);
    case OPTION_BUILTINS: options->builtins = true; return true;
    case OPTION_DOC_FORMAT: return set_doc_format(options, value);
    case OPTION_NO_PICTURES: options->no_pictures = true; return true;
    case OPTION_DEPTH: return set_count(options, "depth", value, 1000000, &options->depth);
    case OPTION_JSON: options->json = true; return true;
    case OPTION_CSV: options->csv = true; return true;
    case OPTION_PROBE: return add(options, options->probes, &options->probe_count, value, "times --probe");
    case OPTION_PLANE: options->plane = value; return true;
    case OPTION_SLICE: options->slice = value; return true;
    case OPTION_WINDOW: options->window = value; return true;
    case OPTION_TIMES: options->times = value; return true;
    case OPTION_SOLVER: return set_solver(options, value);
    case OPTION_CHECKPOINTS: options->checkpoints = value; return true;
    case OPTION_SWEEPS: return set_count(options, "sweeps", value, 100000000, &options->sweeps);
    case OPTION_PATCH: options->patch = value; return true;
    case OPTION_DEPFILE: options->depfile = true; return true;
    case OPTION_DEPFILE_PATH: options->depfile_path = value; return true;
    case OPTION_DEPFILE_TARGET: options->depfile_target = value; return true;
    case OPTION_STRICT: options->strict = true; return true;
    case OPTION_WARN: return add(options, options->warnings, &options->warning_count, value, "times -W");
    case OPTION_FORMAT: return set_format(options, value);
    case OPTION_COLOR: return set_color(options, value);
    case OPTION_KERNELS: return set_kernels(options, value);
    case OPTION_QUIET: options->quiet = true; return true;
    case OPTION_HELP: options->help = true; return true;
    case OPTION_COUNT: break;
    }
    return true;
}

// --- words

typedef struct Reader {
    Options *options;
    char **words; // what is left, ended by NULL
} Reader;

static bool unknown_option(Reader *reader, const char *word, size_t length)
{
    const char *names[OPTION_COUNT];
    int count = 0;
    char name[64] = "";
    if (length < sizeof name) memcpy(name, word, length);
    for (int i = 0; i < OPTION_COUNT; i++)
        if (entries[i].commands & 1u << reader->options->command) names[count++] = entries[i].name;
    const char *nearest = nearest_name(name, names, count);
    const char *command = commands[reader->options->command].name;
    if (nearest)
        return wrong(reader->options, "`scn %s` has no option --%s: do you mean --%s?", command, name, nearest);
    return wrong(reader->options, "`scn %s` has no option --%.*s: `scn help %s` lists them", command, (int)length, word,
                 command);
}

// An option of another command is told as that.
static bool check_command(Reader *reader, int index)
{
    Options *options = reader->options;
    if (entries[index].commands & 1u << options->command) return true;
    char others[256] = "";
    for (int i = 0; i < COMMAND_COUNT; i++) {
        if (!(entries[index].commands & 1u << i)) continue;
        size_t used = strlen(others);
        snprintf(others + used, sizeof others - used, "%s%s", used ? ", " : "", commands[i].name);
    }
    return wrong(options, "`scn %s` has no option --%s: it is one of %s", commands[options->command].name,
                 entries[index].name, others);
}

static bool take_option(Reader *reader, int index, const char *value, bool is_long)
{
    const OptionEntry *entry = &entries[index];
    if (!check_command(reader, index)) return false;
    if (!entry->value) {
        if (value) return wrong(reader->options, "--%s takes no value", entry->name);
        return set_option(reader->options, (OptionId)index, NULL);
    }
    if (!value) value = *reader->words ? *reader->words++ : NULL;
    if (!value && is_long)
        return wrong(reader->options, "--%s wants a value: --%s %s", entry->name, entry->name, entry->value);
    if (!value) return wrong(reader->options, "-%c wants a value: -%c %s", entry->letter, entry->letter, entry->value);
    return set_option(reader->options, (OptionId)index, value);
}

static bool long_option(Reader *reader, const char *word)
{
    size_t length = strcspn(word, "=");
    for (int i = 0; i < OPTION_COUNT; i++)
        if (strlen(entries[i].name) == length && !strncmp(entries[i].name, word, length))
            return take_option(reader, i, word[length] ? word + length + 1 : NULL, true);
    return unknown_option(reader, word, length);
}

static bool short_options(Reader *reader, const char *letters)
{
    for (; *letters; letters++) {
        int found = -1;
        for (int i = 0; i < OPTION_COUNT; i++)
            if (entries[i].letter == *letters) found = i;
        if (found < 0) {
            const char *command = commands[reader->options->command].name;
            return wrong(reader->options, "`scn %s` has no option -%c: `scn help %s` lists them", command, *letters,
                         command);
        }
        bool rest = entries[found].value && letters[1];
        if (!take_option(reader, found, rest ? letters + 1 : NULL, false)) return false;
        if (rest) break;
    }
    return true;
}

static bool find_command(Options *options, char **words)
{
    const char *word = words[0];
    if (!word || !strcmp(word, "--help") || !strcmp(word, "-h")) {
        options->command = COMMAND_HELP;
        options->help = true;
        return true;
    }
    if (!strcmp(word, "--version") || !strcmp(word, "-V")) {
        options->command = COMMAND_VERSION;
        return true;
    }
    if (options_find_command(word, &options->command)) return true;
    const char *nearest = options_nearest_command(word);
    if (nearest) return wrong(options, "there is no command \"%s\": do you mean %s?", word, nearest);
    if (strchr(word, '.'))
        return wrong(options, "there is no command \"%s\": to render it, write `scn render %s`", word, word);
    return wrong(options, "there is no command \"%s\": `scn help` lists them", word);
}

static bool check_counts(Options *options)
{
    const CommandEntry *command = &commands[options->command];
    bool several = options->command == COMMAND_CHECK || options->command == COMMAND_FMT;
    bool optional = command->arguments[0] == '[';
    if (!command->arguments[0] && options->file_count)
        return wrong(options, "`scn %s` takes nothing but options, and there is \"%s\"", command->name,
                     options->files[0]);
    if (command->arguments[0] && !optional && !options->file_count)
        return wrong(options, "`scn %s` wants a file: scn %s %s", command->name, command->name, command->arguments);
    if (options->file_count > 1 && !several)
        return wrong(options, "`scn %s` takes one file, and there is \"%s\" too", command->name, options->files[1]);
    if (options->half && options->full) return wrong(options, "--half and --float exclude each other");
    if (options->time && options->frames_given)
        return wrong(options, "--time and --frames exclude each other: a time is for a still");
    return true;
}

bool options_parse(Options *options, int argc, char **argv)
{
    *options = (Options){0};
    if (!find_command(options, argv + 1)) return false;
    if (argc < 2) return true;
    Reader reader = {options, argv + 2};
    bool ended = false;
    while (*reader.words) {
        const char *word = *reader.words++;
        bool ok = true;
        if (ended || word[0] != '-' || !word[1])
            ok = add(options, options->files, &options->file_count, word, "files");
        else if (!strcmp(word, "--"))
            ended = true;
        else if (word[1] == '-')
            ok = long_option(&reader, word + 2);
        else
            ok = word[1] == 'M' ? long_option(&reader, word + 1) : short_options(&reader, word + 1);
        if (!ok) return false;
    }
    return options->help || check_counts(options);
}

bool options_time(const char *text, double fps, double *seconds)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || !isfinite(value)) return false;
    if (!strcmp(end, "s") || !*end)
        *seconds = value;
    else if (!strcmp(end, "ms"))
        *seconds = value / 1000;
    else if (!strcmp(end, "f"))
        *seconds = value / fps;
    else
        return false;
    return true;
}

// --- help

static int terminal_width(FILE *out)
{
    struct winsize size;
    if (isatty(fileno(out)) && !ioctl(fileno(out), TIOCGWINSZ, &size) && size.ws_col >= 40)
        return size.ws_col > 120 ? 120 : size.ws_col;
    return 100;
}

void options_wrap(FILE *out, const char *text, int indent)
{
    int column = indent, width = terminal_width(out);
    while (*text) {
        int length = (int)strcspn(text, " "), columns = 0;
        for (int i = 0; i < length; i++) columns += ((unsigned char)text[i] & 0xC0) != 0x80;
        if (column > indent && column + 1 + columns > width) {
            fprintf(out, "\n%*s", indent, "");
            column = indent;
        }
        if (column > indent) {
            fputc(' ', out);
            column++;
        }
        fwrite(text, 1, (size_t)length, out);
        column += columns;
        text += length;
        text += strspn(text, " ");
    }
    fputc('\n', out);
}

static void print_statuses(FILE *out)
{
    fputc('\n', out);
    options_wrap(
        out,
        "Exit status: 0 done; 1 the scene is wrong; 2 the command line is wrong; 3 the world failed (a file, a "
        "device, a disk); 130 stopped by Ctrl-C. Whatever happens, no file is left half written.",
        0);
}

static void help_all(FILE *out)
{
    fprintf(out, "scn %s: compiles scenes of functionally defined objects and renders them.\n\nUse: scn COMMAND …\n\n",
            SCN_VERSION);
    for (int i = 0; i < COMMAND_COUNT; i++) {
        int columns = 0; // the arguments may hold an ellipsis, which has more bytes than columns
        fprintf(out, "  %-8s %s", commands[i].name, commands[i].arguments);
        for (const char *c = commands[i].arguments; *c; c++) columns += ((unsigned char)*c & 0xC0) != 0x80;
        fprintf(out, "%*s%s\n", 16 - columns, "", commands[i].help);
    }
    fprintf(out, "\n`scn help COMMAND` lists the options of a command.\n");
    print_statuses(out);
}

static const char *help_of(int option, CommandId command)
{
    for (size_t k = 0; k < sizeof helps / sizeof *helps; k++)
        if ((int)helps[k].option == option && helps[k].commands & 1u << command) return helps[k].help;
    return entries[option].help;
}

void options_help(FILE *out, CommandId command)
{
    if (command == COMMAND_COUNT) {
        help_all(out);
        return;
    }
    const char *arguments = commands[command].arguments;
    fprintf(out, "scn %s%s%s\n\n  ", commands[command].name, *arguments ? " " : "", arguments);
    options_wrap(out, commands[command].help, 2);
    fprintf(out, "\nOptions:\n");
    for (int i = 0; i < OPTION_COUNT; i++) {
        const OptionEntry *entry = &entries[i];
        if (!(entry->commands & 1u << command)) continue;
        char left[64];
        snprintf(left, sizeof left, "%c%c%s %s%s%s%s", entry->letter ? '-' : ' ', entry->letter ? entry->letter : ' ',
                 entry->letter ? "," : " ", entry->name[0] == 'M' ? "-" : "--", entry->name, entry->value ? " " : "",
                 entry->value ? entry->value : "");
        fprintf(out, "  %-26s ", left);
        options_wrap(out, help_of(i, command), 29);
    }
    print_statuses(out);
}
