// Makes an editor's syntax file of a template and the words of the language.
//
//     scn-fill-words words.json scn.tmLanguage.json.in scn.tmLanguage.json
//
// In the template
//
//     @words LIST KIND@       stands for the words of that list of words.json (reserved, units, marks, types, built_in) and that
//                             kind (* is any; KIND+KIND joins some), as alternatives of a pattern: a|b|c
//     @names LIST KIND@       the same with spaces between them: a b c
//
// Longer words come first, since alternatives of a pattern are tried in order, and each is there once. Whatever is no letter, digit or
// `_` is escaped as patterns of Oniguruma and of Vim's "very magic" kind want it, and once more in a file of JSON.
//
// A place that stands for no word at all is a mistake in the template, and so is one that is not understood; a word that no place stands
// for is found by tests/editors. Exit status: 0, 1 for a template that is wrong, 2 for a wrong call, 3 where a file fails.
#include <cjson/cJSON.h>
#include <ctype.h>
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_WORDS = 1000, MAX_PLACE = 200, EXIT_WORLD = 3 };

typedef struct Place { // one @…@ of the template
    bool pattern;      // else names
    char list[32], kinds[MAX_PLACE];
} Place;

static _Noreturn void die(const char *path)
{
    fprintf(stderr, "scn-fill-words: %s: %s\n", path, strerror(errno));
    exit(EXIT_WORLD);
}

static char *read_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    size_t room = 0;
    if (!file) die(path);
    if (getdelim(&text, &room, '\0', file) < 0) die(path); // a text has no zero byte, so this reads all of it
    fclose(file);
    return text;
}

// Whether `kind` is one of those that are joined by + in `kinds`.
static bool is_wanted(const char *kinds, const char *kind)
{
    if (strcmp(kinds, "*") == 0) return true;
    for (size_t length; *kinds; kinds += length + (kinds[length] == '+')) {
        length = strcspn(kinds, "+");
        if (strlen(kind) == length && memcmp(kinds, kind, length) == 0) return true;
    }
    return false;
}

static int longer_first(const void *a, const void *b)
{
    const char *one = *(const char *const *)a, *other = *(const char *const *)b;
    size_t length = strlen(one), other_length = strlen(other);
    if (length != other_length) return length < other_length ? 1 : -1;
    return strcmp(one, other);
}

// Returns how many words of the list the place wants, sorted, each once.
static int collect(const cJSON *list, const char *kinds, const char **words)
{
    int count = 0, kept = 0;
    const cJSON *entry;
    cJSON_ArrayForEach(entry, list)
    {
        const char *word = cJSON_GetStringValue(cJSON_GetObjectItem(entry, "word"));
        const char *kind = cJSON_GetStringValue(cJSON_GetObjectItem(entry, "kind"));
        if (word && kind && is_wanted(kinds, kind) && count < MAX_WORDS) words[count++] = word;
    }
    qsort(words, (size_t)count, sizeof *words, longer_first);
    for (int i = 0; i < count; i++)
        if (kept == 0 || strcmp(words[kept - 1], words[i]) != 0) words[kept++] = words[i];
    return kept;
}

static void put_word(FILE *out, const char *word, bool escape, bool json)
{
    for (; *word; word++) {
        if (escape && !isalnum((unsigned char)*word) && *word != '_') fputs(json ? "\\\\" : "\\", out);
        fputc(*word, out);
    }
}

static bool put_place(FILE *out, const cJSON *json, const Place *place, bool to_json)
{
    const char *words[MAX_WORDS];
    int count = collect(cJSON_GetObjectItem(json, place->list), place->kinds, words);
    for (int i = 0; i < count; i++) {
        if (i > 0) fputc(place->pattern ? '|' : ' ', out);
        put_word(out, words[i], place->pattern, to_json);
    }
    return count > 0;
}

// Reads the place that begins at `text`. Returns its length, 0 if it is none, -1 if it is not understood.
static int read_place(const char *text, Place *place)
{
    char what[8];
    int length = 0;
    if (strncmp(text, "@words ", 7) != 0 && strncmp(text, "@names ", 7) != 0) return 0;
    if (sscanf(text, "@%7s %31[a-z_] %199[a-z+*]@%n", what, place->list, place->kinds, &length) != 3 || length == 0)
        return -1;
    place->pattern = strcmp(what, "words") == 0;
    return length;
}

static int fill(FILE *out, const cJSON *json, const char *template_path, const char *text, bool to_json)
{
    int line = 1;
    for (const char *p = text; *p;) {
        Place place;
        int length = read_place(p, &place);
        if (length < 0 || (length > 0 && !put_place(out, json, &place, to_json))) {
            fprintf(stderr, "%s:%d: %s: %.*s\n", template_path, line,
                    length < 0 ? "not understood" : "there is no such word", (int)strcspn(p, "\n"), p);
            return 1;
        }
        if (length == 0) {
            line += *p == '\n';
            fputc(*p++, out);
        }
        p += length;
    }
    return 0;
}

int main(int argc, char **argv)
{
    if (argc != 4) {
        fputs("usage: scn-fill-words WORDS.json TEMPLATE OUT\n", stderr);
        return 2;
    }
    char *words = read_file(argv[1]), *text = read_file(argv[2]);
    cJSON *json = cJSON_Parse(words);
    FILE *out = fopen(argv[3], "wb");
    if (!json || !out) die(json ? argv[3] : argv[1]);
    size_t length = strlen(argv[3]);
    bool to_json = length > 5 && strcmp(argv[3] + length - 5, ".json") == 0;
    int status = fill(out, json, argv[2], text, to_json);
    if (fclose(out) != 0) die(argv[3]);
    if (status != 0) remove(argv[3]);
    cJSON_Delete(json);
    free(words);
    free(text);
    return status;
}
