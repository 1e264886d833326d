// UTF-8 as far as sources need it: to decode, to tell what is broken, and to know how wide a terminal shows it.
#ifndef SCN_LANG_UTF8_H
#define SCN_LANG_UTF8_H

#include <stddef.h>
#include <stdint.h>

enum { UTF8_BROKEN = 0xFFFD }; // what a byte that is no UTF-8 decodes to, one byte long

// Decodes the character at text[0..length), length > 0. Returns how many bytes it takes. Overlong forms, surrogates and
// what is beyond U+10FFFF are broken.
size_t utf8_read(const char *text, size_t length, uint32_t *code);

// The columns that a terminal needs for a character that begins at column `at`: a tab goes to the next multiple of 8, a
// wide character takes 2, a combining one 0, a control character 1 (it is shown as a replacement).
uint32_t utf8_columns(uint32_t code, uint32_t at);

#endif
