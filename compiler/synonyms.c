#include "compiler/synonyms.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "lang/intern.h"

typedef struct Synonym {
    const char *written, *ours;
} Synonym;

static const Synonym synonyms[] = {
#define SYNONYM(written, ours) {written, ours},
#include "compiler/synonyms.def"
};

static int compare(const void *key, const void *element)
{
    return strcasecmp(key, ((const Synonym *)element)->written);
}

static bool is_name(const char *word)
{
    for (const char *p = word; *p; p++) {
        if (!isalnum((unsigned char)*p) && *p != '_') return false;
    }
    return true;
}

static bool is_reserved(const char *word)
{
#define RESERVED(token, reserved, ...)                                                                                 \
    if (!strcmp(word, reserved)) return true;
#include "lang/words.def"
    return false;
}

static const char *among(const char *word, size_t length, const char *const *candidates, int count)
{
    for (int i = 0; i < count; i++) {
        if (strlen(candidates[i]) == length && !memcmp(candidates[i], word, length)) return candidates[i];
    }
    return NULL;
}

const char *synonym_of(const char *wrong, const char *const *candidates, int count)
{
    const Synonym *found = bsearch(wrong, synonyms, sizeof synonyms / sizeof *synonyms, sizeof *synonyms, compare);
    if (!found) return NULL;
    if ((!is_name(found->ours) && !strchr(found->ours, ' ')) || is_reserved(found->ours)) return found->ours;
    for (const char *word = found->ours; *word;) {
        size_t length = strcspn(word, " ");
        const char *ours = among(word, length, candidates, count);
        if (ours && strcmp(ours, wrong) != 0) return ours;
        word += length + (word[length] == ' ');
    }
    return NULL;
}

const char *suggested_name(const char *wrong, const char *const *candidates, int count)
{
    const char *ours = synonym_of(wrong, candidates, count);
    return ours ? ours : nearest_name(wrong, candidates, count);
}
