#include "tests/docs/section.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { EXIT_WORLD = 3 };

static _Noreturn void die(const char *path)
{
    fprintf(stderr, "%s: %s\n", path, strerror(errno));
    exit(EXIT_WORLD);
}

char *section_read(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file && errno == ENOENT) return NULL;
    char *text = NULL;
    size_t room = 0;
    if (!file) die(path);
    if (getdelim(&text, &room, '\0', file) < 0) { // a text has no zero byte, so this reads all of it
        if (ferror(file)) die(path);
        text = realloc(text, 1);
        if (!text) die(path);
        *text = 0;
    }
    fclose(file);
    return text;
}

static void write_parts(const char *path, const char *head, size_t length, const char *middle, const char *tail)
{
    FILE *file = fopen(path, "wb");
    if (!file) die(path);
    fwrite(head, 1, length, file);
    fputs(middle, file);
    fputs(tail, file);
    if (fclose(file) != 0) die(path);
}

static int line_of(const char *text, const char *place)
{
    int line = 1;
    for (; text < place; text++) line += *text == '\n';
    return line;
}

// How much two texts have in common at their beginning.
static size_t common(const char *a, const char *b)
{
    size_t length = 0;
    while (a[length] && a[length] == b[length]) length++;
    return length;
}

// `have` and `want` are the first lines that differ.
static bool differs(const char *path, int line, const char *have, const char *want)
{
    printf("%s:%d: is not what is made of its source now; UPDATE=1 and this test write it anew\n  there is %.*s\n  "
           "made is  %.*s\n",
           path, line, (int)strcspn(have, "\n"), have, (int)strcspn(want, "\n"), want);
    return false;
}

bool section_keep(const char *path, const char *name, const char *text)
{
    char *whole = section_read(path), begin_mark[100], end_mark[100];
    if (!whole) die(path);
    snprintf(begin_mark, sizeof begin_mark, "<!-- %s: ", name);
    snprintf(end_mark, sizeof end_mark, "<!-- end of %s -->", name);
    char *begin = strstr(whole, begin_mark), *end = begin ? strstr(begin, end_mark) : NULL;
    bool good = true;
    if (!end) {
        printf("%s: the lines `%s… -->` and `%s` are not there\n", path, begin_mark, end_mark);
        good = false;
    } else {
        begin += strcspn(begin, "\n") + 1;
        size_t length = (size_t)(end - begin);
        if (length != strlen(text) || memcmp(begin, text, length) != 0) {
            if (getenv("UPDATE")) {
                write_parts(path, whole, (size_t)(begin - whole), text, end);
            } else {
                size_t same = common(begin, text);
                while (same > 0 && text[same - 1] != '\n') same--;
                good = differs(path, line_of(whole, begin + same), begin + same, text + same);
            }
        }
    }
    free(whole);
    return good;
}

bool section_keep_file(const char *path, const char *text)
{
    char *whole = section_read(path);
    bool good = whole && strcmp(whole, text) == 0;
    if (!good && getenv("UPDATE")) {
        write_parts(path, "", 0, text, "");
        good = true;
    } else if (!good) {
        printf("%s: %s: UPDATE=1 and this test write it anew\n", path, whole ? "is out of date" : "is missing");
    }
    free(whole);
    return good;
}
