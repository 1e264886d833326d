// What the rules of scan.l do: for scan.l, scan_rules.c and scan_strings.c alone.
//
// Each takes the offset of the matched text in the source and its length, fills scanner->token and returns the code of the
// token. `*used`, where there is one, is how many of the bytes belong to the word; the scanner goes on behind them. SKIP stands
// for what is no word and gives none.
#ifndef SCN_LANG_SCAN_RULES_H
#define SCN_LANG_SCAN_RULES_H

#include "lang/scan.h"

enum { SKIP = -1 };

Span scan_span(const Scanner *s, uint32_t at, uint32_t length);

// Every word goes through here: its place is noted, and it takes the documentation that waits. Returns `code`.
int scan_word(Scanner *s, int code, uint32_t at, uint32_t length);

int scan_name(Scanner *s, uint32_t at, uint32_t length);
int scan_number(Scanner *s, uint32_t at, uint32_t length, uint32_t *used);
int scan_point_number(Scanner *s, uint32_t at, uint32_t length);                 // .5
int scan_number_point(Scanner *s, uint32_t at, uint32_t length, uint32_t *used); // 5.
int scan_color(Scanner *s, uint32_t at, uint32_t length);
int scan_mark(Scanner *s, uint32_t at, uint32_t length);
int scan_foreign(Scanner *s, uint32_t at, uint32_t length);
int scan_quoted(Scanner *s, uint32_t at, uint32_t length); // 'text'
int scan_beyond_ascii(Scanner *s, uint32_t at, uint32_t length, uint32_t *used);
int scan_control(Scanner *s, uint32_t at, uint32_t length);

// At a quote that begins a string: true if the string ends on its line. Else it is reported.
bool scan_string_ends(Scanner *s, uint32_t at);
int scan_piece(Scanner *s, uint32_t end); // of a string, from piece_begin to its quote or brace
int scan_broken_string(Scanner *s, uint32_t at, uint32_t length, uint32_t *used);
void scan_doc(Scanner *s, uint32_t at, uint32_t length);
void scan_open_comment(Scanner *s); // the text ends in it

void scan_end(Scanner *s); // after the last word

// The generated scanner on scanner->buffer, which holds the text and two zeros.
void scan_start(Scanner *s);
void scan_stop(Scanner *s);

#endif
