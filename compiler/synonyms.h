// Words that people bring along for what the language calls otherwise: synonyms.def, and its table for messages.
#ifndef SCN_COMPILER_SYNONYMS_H
#define SCN_COMPILER_SYNONYMS_H

// What to write instead of `wrong`: the first of its synonyms that is among the candidates, or one that is no name (#ff0000, a^2).
// NULL if there is none.
const char *synonym_of(const char *wrong, const char *const *candidates, int count);

// The synonym of `wrong`, or else the candidate that is nearest in spelling (lang/intern.h), or NULL.
const char *suggested_name(const char *wrong, const char *const *candidates, int count);

#endif
