// Words are cut from the source, not from the generated scanner's buffer, since texts and spans point into the source. The rule
// for all mistakes here: one message, and then the token that was most likely meant, so that the parser does not
// report the same mistake again.
#include "lang/scan_rules.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "lang/parse.h"
#include "lang/utf8.h"

typedef struct Word {
    const char *text;
    int code;
} Word;

static const Word reserved[] = {
#define RESERVED(token, word, ...) {word, token},
#include "lang/words.def"
};

static const Word units[] = {
#define UNIT(id, suffix, dimension, meaning) {suffix, UNIT_##id},
#include "lang/words.def"
};

static const Word marks[] = {
#define MARK(token, mark, ...) {mark, token},
#include "lang/words.def"
};

#define COUNT(array) (int)(sizeof(array) / sizeof *(array))

const char *token_text(int code)
{
    for (int i = 0; i < COUNT(reserved); i++) {
        if (reserved[i].code == code) return reserved[i].text;
    }
    for (int i = 0; i < COUNT(marks); i++) {
        if (marks[i].code == code) return marks[i].text;
    }
    return NULL;
}

Span scan_span(const Scanner *s, uint32_t at, uint32_t length)
{
    uint32_t begin = s->source->base + at;
    return (Span){begin, begin + length};
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}
static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

// --- Documentation ---

// True if nothing but space follows up to and over an empty line.
static bool empty_line_after(const Scanner *s, uint32_t at)
{
    int breaks = 0;
    for (; at < s->source->length; at++) {
        char c = s->source->text[at];
        if (c == '\n')
            breaks++;
        else if (c != ' ' && c != '\t' && c != '\r')
            break;
    }
    return breaks > 1;
}

// The text of `///` lines without the marks and what stands before them, joined by line breaks.
static const char *doc_text(const Scanner *s, uint32_t begin, uint32_t end)
{
    char *out = arena_alloc(&s->unit->arena, end - begin + 1);
    uint32_t length = 0;
    const char *text = s->source->text;
    for (uint32_t at = begin; at < end;) {
        while (at < end && text[at] != '/') at++;
        at += 3;
        if (at < end && text[at] == ' ') at++;
        uint32_t stop = at;
        while (stop < end && text[stop] != '\n') stop++;
        uint32_t last = stop;
        while (last > at && (text[last - 1] == ' ' || text[last - 1] == '\t' || text[last - 1] == '\r')) last--;
        if (length) out[length++] = '\n';
        if (last > at) memcpy(out + length, text + at, last - at);
        length += last > at ? last - at : 0;
        at = stop + 1;
    }
    return out;
}

static void doc_add(Scanner *s, uint32_t position)
{
    if (s->doc_count == s->doc_capacity) {
        uint32_t capacity = s->doc_capacity ? s->doc_capacity * 2 : 16;
        Doc *docs = arena_array(&s->unit->arena, Doc, capacity);
        if (s->doc_count) memcpy(docs, s->docs, sizeof *docs * s->doc_count);
        s->docs = docs;
        s->doc_capacity = capacity;
    }
    s->docs[s->doc_count++] = (Doc){position, doc_text(s, s->run_begin, s->run_end)};
}

// The lines that wait are the file's if nothing stands before them and an empty line or the version line follows.
static bool take_file_doc(Scanner *s, bool version_follows)
{
    if (s->any_word || s->file_doc || (!version_follows && !empty_line_after(s, s->run_end))) return false;
    s->file_doc = doc_text(s, s->run_begin, s->run_end);
    s->run_begin = s->run_end = 0;
    return true;
}

void scan_doc(Scanner *s, uint32_t at, uint32_t length)
{
    if (s->run_end) {
        uint32_t breaks = 0;
        bool only_space = true;
        for (uint32_t i = s->run_end; i < at; i++) {
            char c = s->source->text[i];
            if (c == '\n')
                breaks++;
            else if (c != ' ' && c != '\t' && c != '\r')
                only_space = false;
        }
        if (only_space && breaks == 1) {
            s->run_end = at + length;
            return;
        }
        take_file_doc(s, false);
    }
    s->run_begin = at;
    s->run_end = at + length;
}

void scan_end(Scanner *s)
{
    if (s->run_end) take_file_doc(s, true); // a file of nothing but its documentation
    s->run_begin = s->run_end = 0;
}

int scan_word(Scanner *s, int code, uint32_t at, uint32_t length)
{
    s->token->span = scan_span(s, at, length);
    if (s->run_end && !take_file_doc(s, code == TOK_SCN)) {
        doc_add(s, s->token->span.begin);
        s->run_begin = s->run_end = 0;
    }
    return code;
}

const char *scanner_doc(const Scanner *s, uint32_t position)
{
    uint32_t low = 0, high = s->doc_count;
    while (low < high) {
        uint32_t middle = (low + high) / 2;
        if (s->docs[middle].at == position) return s->docs[middle].text;
        if (s->docs[middle].at < position)
            low = middle + 1;
        else
            high = middle;
    }
    return NULL;
}

// --- Names and marks ---

int scan_name(Scanner *s, uint32_t at, uint32_t length)
{
    const char *text = s->source->text + at;
    s->token->value.name = name_of(&s->unit->names, text, length);
    if (text[0] >= 'a' && text[0] <= 'z') {
        for (int i = s->first_word[text[0] - 'a']; i < COUNT(reserved) && reserved[i].text[0] == text[0]; i++) {
            if (strlen(reserved[i].text) == length && memcmp(reserved[i].text, text, length) == 0) {
                return scan_word(s, reserved[i].code, at, length);
            }
        }
    }
    return scan_word(s, TOK_NAME, at, length);
}

int scan_mark(Scanner *s, uint32_t at, uint32_t length)
{
    const char *text = s->source->text + at;
    if (length == 1) return scan_word(s, (unsigned char)*text, at, 1); // a mark of one character is its own token
    for (int i = 0; i < COUNT(marks); i++) {
        if (strlen(marks[i].text) == length && memcmp(marks[i].text, text, length) == 0) {
            return scan_word(s, marks[i].code, at, length);
        }
    }
    return scan_word(s, TOK_SCN_YYerror, at, length);
}

// --- Numbers ---

static int number(Scanner *s, uint32_t at, uint32_t length, double value, NumberUnit unit, bool whole)
{
    s->token->value.number = (Number){value, unit, whole};
    return scan_word(s, whole && unit == UNIT_NONE ? TOK_INT : TOK_REAL, at, length);
}

// The digits of a number without its unit.
typedef struct Digits {
    uint32_t length;
    uint32_t places; // behind the point
    uint64_t value;  // of all digits, without the point; meaningless beyond 19 of them
    bool point, exponent;
} Digits;

static void read_run(Digits *d, const char *text, uint32_t length)
{
    for (; d->length < length && is_digit(text[d->length]); d->length++) {
        d->value = d->value * 10 + (uint64_t)(text[d->length] - '0');
    }
}

static Digits read_digits(const char *text, uint32_t length)
{
    Digits d = {0};
    read_run(&d, text, length);
    if (d.length < length && text[d.length] == '.') {
        uint32_t behind = ++d.length;
        d.point = true;
        read_run(&d, text, length);
        d.places = d.length - behind;
    }
    if (d.length < length && (text[d.length] == 'e' || text[d.length] == 'E')) {
        uint32_t at = d.length + 1;
        if (at < length && (text[at] == '+' || text[at] == '-')) at++;
        if (at < length && is_digit(text[at])) {
            d.exponent = true;
            while (at < length && is_digit(text[at])) at++;
            d.length = at;
        }
    }
    return d;
}

#if LDBL_MANT_DIG == 64
// Up to 19 digits are a whole number of 64 bits, which this machine's long double holds, as it holds the powers of ten up to 10^27: the
// quotient has 64 correct bits, and rounding it to 53 is right, unless what is cut off looks like exactly one half. False then.
static bool divided(uint64_t digits, uint32_t places, double *value)
{
    static const long double powers[] = {1,     1e1L,  1e2L,  1e3L,  1e4L,  1e5L,  1e6L,  1e7L,  1e8L,  1e9L,
                                         1e10L, 1e11L, 1e12L, 1e13L, 1e14L, 1e15L, 1e16L, 1e17L, 1e18L, 1e19L};
    long double quotient = (long double)digits / powers[places];
    uint64_t bits;
    memcpy(&bits, &quotient, sizeof bits); // the mantissa; in a double its last 11 bits are cut off
    *value = (double)quotient;
    return (bits & 0x7FF) != 0x400;
}
#else
static bool divided(uint64_t digits, uint32_t places, double *value)
{
    return false;
}
#endif

// The digits of most numbers are a whole number below 2^53, and the power of ten that their point divides by is exact too: then one
// division rounds correctly. Generated scenes write 17 digits and more. The library does the rest.
static double value_of(const Scanner *s, const char *text, const Digits *d)
{
    static const double powers[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
    double value;
    if (d->length <= 15 && !d->exponent) return (double)d->value / powers[d->places];
    if (d->length <= 20 && d->point && !d->exponent && divided(d->value, d->places, &value)) return value;
    char small[64];
    char *copy = d->length < sizeof small ? small : arena_alloc(&s->unit->arena, d->length + 1);
    memcpy(copy, text, d->length);
    copy[d->length] = 0;
    return strtod_l(copy, NULL, s->c_locale);
}

// The suffixes that people write for units, beside those that are near to a unit anyway.
static const struct {
    const char *text;
    NumberUnit unit;
} other_units[] = {
    {"\xC2\xB0", UNIT_DEG}, {"degree", UNIT_DEG}, {"degrees", UNIT_DEG}, {"radian", UNIT_RAD}, {"radians", UNIT_RAD},
    {"turns", UNIT_TURN},   {"rev", UNIT_TURN},   {"sec", UNIT_S},       {"secs", UNIT_S},     {"second", UNIT_S},
    {"seconds", UNIT_S},    {"msec", UNIT_MS},    {"frame", UNIT_F},     {"frames", UNIT_F},
};

// Reports a suffix that is no unit, and gives the unit that was meant, or none.
static NumberUnit report_suffix(Scanner *s, uint32_t at, uint32_t digits, uint32_t length)
{
    const char *text = s->source->text + at;
    const char *suffix = text + digits;
    uint32_t suffix_length = length - digits;
    Span span = scan_span(s, at + digits, suffix_length);
    if (digits == 1 && text[0] == '0' && suffix_length > 1 && (suffix[0] == 'x' || suffix[0] == 'X')) {
        char copy[20] = {0};
        memcpy(copy, text, length < sizeof copy ? length : sizeof copy - 1);
        Diag *d =
            diag(s->unit, scan_span(s, at, length), DIAG_NUMBER_FORM, "numbers are decimal; # and digits is a colour");
        diag_fix(s->unit, d, scan_span(s, at, length), FIX_LIKELY, "%llu", strtoull(copy, NULL, 16));
        return UNIT_NONE;
    }
    if (suffix[0] == '_') {
        diag(s->unit, span, DIAG_NUMBER_FORM, "the digits of a number are not grouped: leave out the `_`");
        return UNIT_NONE;
    }
    if (suffix_length == 1 && (suffix[0] == 'e' || suffix[0] == 'E')) {
        diag(s->unit, span, DIAG_NUMBER_FORM, "an exponent has digits: write 1e3 or 1e-3");
        return UNIT_NONE;
    }
    NumberUnit meant = UNIT_NONE;
    for (int i = 0; i < COUNT(other_units); i++) {
        if (strlen(other_units[i].text) == suffix_length && memcmp(other_units[i].text, suffix, suffix_length) == 0) {
            meant = other_units[i].unit;
        }
    }
    const char *candidates[COUNT(units)];
    for (int i = 0; i < COUNT(units); i++) candidates[i] = units[i].text;
    char *name = arena_text(&s->unit->arena, suffix, suffix_length);
    const char *near = suffix_length > 1 ? nearest_name(name, candidates, COUNT(units)) : NULL;
    for (int i = 0; near && meant == UNIT_NONE && i < COUNT(units); i++) {
        if (units[i].text == near) meant = (NumberUnit)units[i].code;
    }
    if (meant != UNIT_NONE) {
        Diag *d = diag(s->unit, span, DIAG_UNKNOWN_UNIT, "%s is no unit: write %.*s%s", name, (int)digits, text,
                       number_unit_text(meant));
        diag_fix(s->unit, d, span, FIX_LIKELY, "%s", number_unit_text(meant));
    } else {
        Diag *d = diag(
            s->unit, span, DIAG_UNKNOWN_UNIT,
            "%s is no unit: there are deg, rad and turn for angles, s, ms and f for times; lengths have none%s", name,
            suffix_length == 1 ? arena_printf(&s->unit->arena, ", and a product is %.*s * %s", (int)digits, text, name)
                               : "");
        diag_fix(s->unit, d, span, FIX_GUESS, "%s", "");
    }
    return meant;
}

static NumberUnit unit_of(Scanner *s, uint32_t at, uint32_t digits, uint32_t length)
{
    for (int i = 0; i < COUNT(units); i++) {
        if (strlen(units[i].text) == length - digits &&
            memcmp(units[i].text, s->source->text + at + digits, length - digits) == 0) {
            return (NumberUnit)units[i].code;
        }
    }
    return report_suffix(s, at, digits, length);
}

// True if digits are a whole number beyond 2^53, which a double would not hold exactly.
static bool beyond_exact(const char *digits, uint32_t count)
{
    uint64_t value = 0;
    for (uint32_t i = 0; i < count && value <= UINT64_C(1) << 53; i++) value = value * 10 + (uint64_t)(digits[i] - '0');
    return value > UINT64_C(1) << 53;
}

// `object 3d = …`: where a name must stand, digits with letters are one.
static bool is_name_with_digits(const Scanner *s, uint32_t at, uint32_t digits, uint32_t length)
{
    const char *text = s->source->text + at;
    if (digits == length || !is_letter(text[digits]) || memchr(text, '.', length)) return false;
    if (memchr(s->source->text + s->last_end, '\n', at - s->last_end)) return false;
    for (int i = 0; i < COUNT(units); i++) {
        if (strlen(units[i].text) == length - digits && !memcmp(units[i].text, text + digits, length - digits))
            return false;
    }
    switch (s->last_code) {
    case TOK_NAME:
    case TOK_LET:
    case TOK_FN:
    case TOK_TAG:
    case TOK_TOOL:
    case TOK_PARAM: return s->any_word;
    default: return false;
    }
}

static int name_with_digits(Scanner *s, uint32_t at, uint32_t length)
{
    Span span = scan_span(s, at, length);
    Diag *d = diag(s->unit, span, DIAG_NUMBER_FORM, "a name begins with a letter or `_`, not with a digit");
    diag_fix(s->unit, d, scan_span(s, at, 0), FIX_GUESS, "_");
    s->token->value.name = name_of(&s->unit->names, s->source->text + at, length);
    return scan_word(s, TOK_NAME, at, length);
}

int scan_number(Scanner *s, uint32_t at, uint32_t length, uint32_t *used)
{
    const char *text = s->source->text + at;
    Digits read = read_digits(text, length);
    uint32_t digits = read.length;
    bool whole = !read.point && !read.exponent;
    // `3×2` is a number and a mark that the next word reports; `90°` is a number with a unit.
    bool beyond_ascii = digits < length && (unsigned char)text[digits] >= 0x80;
    if (beyond_ascii && strncmp(text + digits, "\xC2\xB0", 2) == 0)
        length = digits + 2;
    else if (beyond_ascii)
        length = digits;
    *used = length;
    if (!beyond_ascii && is_name_with_digits(s, at, digits, length)) return name_with_digits(s, at, length);

    double value = value_of(s, text, &read);
    NumberUnit unit = digits < length ? unit_of(s, at, digits, length) : UNIT_NONE;
    if (whole && digits > 15 && unit == UNIT_NONE && beyond_exact(text, digits)) {
        Diag *d =
            diag(s->unit, scan_span(s, at, length), DIAG_NUMBER_FORM,
                 "whole numbers are exact up to 9007199254740992 (2^53): write it with a point to have it rounded");
        if (length == digits) diag_fix(s->unit, d, scan_span(s, at + length, 0), FIX_LIKELY, ".0");
        return number(s, at, length, value < HUGE_VAL ? value : 0, unit, false);
    }
    if (!(value < HUGE_VAL)) {
        diag(s->unit, scan_span(s, at, length), DIAG_NUMBER_FORM,
             "the number is too large: the largest is about 1.8e308");
        value = 0;
    }
    return number(s, at, length, value, unit, whole);
}

int scan_point_number(Scanner *s, uint32_t at, uint32_t length)
{
    const char *text = s->source->text + at;
    Span span = scan_span(s, at, length);
    bool touches = s->any_word && s->last_end == at;
    bool after_operand =
        s->last_code == TOK_NAME || s->last_code == TOK_INT || s->last_code == ')' || s->last_code == ']';
    if (touches && s->last_code == TOK_REAL) {
        diag(s->unit, span, DIAG_NUMBER_FORM, "a number has one point: write `,` or an operator before 0%.*s",
             (int)length, text);
        return scan_word(s, TOK_SCN_YYerror, at, length);
    }
    if (touches && after_operand) {
        Diag *d =
            diag(s->unit, span, DIAG_NUMBER_FORM, "after a point stands a name; an element of a list is written [%.*s]",
                 (int)length - 1, text + 1);
        diag_fix(s->unit, d, span, FIX_GUESS, "[%.*s]", (int)length - 1, text + 1);
        return scan_word(s, TOK_SCN_YYerror, at, length);
    }
    Diag *d = diag(s->unit, span, DIAG_NUMBER_FORM, "a digit stands on both sides of the point: write 0%.*s",
                   (int)length, text);
    diag_fix(s->unit, d, scan_span(s, at, 0), FIX_SURE, "0");
    Digits digits = read_digits(text, length);
    return number(s, at, length, value_of(s, text, &digits), UNIT_NONE, false);
}

int scan_number_point(Scanner *s, uint32_t at, uint32_t length, uint32_t *used)
{
    const char *text = s->source->text + at;
    char next = text[length];
    if (next == '.' || is_letter(next)) { // 0..5 and 5.max(3)
        *used = length - 1;
        return scan_number(s, at, length - 1, used);
    }
    Diag *d = diag(s->unit, scan_span(s, at, length), DIAG_NUMBER_FORM,
                   "a digit stands on both sides of the point: write %.*s0", (int)length, text);
    diag_fix(s->unit, d, scan_span(s, at + length, 0), FIX_SURE, "0");
    Digits digits = read_digits(text, length);
    return number(s, at, length, value_of(s, text, &digits), UNIT_NONE, false);
}

// --- Colours, and what POV-Ray and C write with # ---

static const struct {
    const char *text;
    int code;
    const char *instead;
} hash_words[] = {
    {"declare", TOK_LET, "let name = value;"},
    {"local", TOK_LET, "let name = value;"},
    {"define", TOK_SCN_YYerror, "let name = value; or fn name(x: scalar) { … }"},
    {"include", TOK_INCLUDE, "include \"file.scn\";"},
    {"macro", TOK_SCN_YYerror, "tag name(r: scalar) { … }, or fn for what computes"},
    {"version", TOK_SCN_YYerror, "scn 1; in the first line"},
    {"while", TOK_SCN_YYerror, "for i in 0..5 { … }"},
    {"for", TOK_SCN_YYerror, "for i in 0..5 { … }"},
    {"if", TOK_SCN_YYerror, "if a { … } else { … }"},
    {"ifdef", TOK_SCN_YYerror, "a param with a default, and if"},
    {"ifndef", TOK_SCN_YYerror, "a param with a default, and if"},
    {"else", TOK_SCN_YYerror, "if a { … } else { … }"},
    {"elseif", TOK_SCN_YYerror, "if a { … } else if b { … }"},
    {"end", TOK_SCN_YYerror, "a } where the block ends"},
    {"endif", TOK_SCN_YYerror, "a } where the block ends"},
    {"switch", TOK_SCN_YYerror, "match(v) { 1: a; 2: b; default: c; }"},
    {"case", TOK_SCN_YYerror, "match(v) { 1: a; 2: b; default: c; }"},
    {"range", TOK_SCN_YYerror, "match(v) { 0..5: a; default: b; }"},
    {"break", TOK_SCN_YYerror, "nothing: a case of a match ends by itself"},
    {"default", TOK_SCN_YYerror, "the values themselves, or a tag that has them as defaults"},
    {"undef", TOK_SCN_YYerror, "another name: a name is bound once"},
    {"error", TOK_SCN_YYerror, "assert condition, \"text\";"},
    {"debug", TOK_SCN_YYerror, "print value;"},
    {"warning", TOK_SCN_YYerror, "print value;"},
};

static int hex_value(char c)
{
    if (is_digit(c)) return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

int scan_color(Scanner *s, uint32_t at, uint32_t length)
{
    const char *text = s->source->text + at + 1;
    uint32_t count = length - 1;
    Span span = scan_span(s, at, length);
    for (int i = 0; i < COUNT(hash_words); i++) {
        if (strlen(hash_words[i].text) != count || memcmp(hash_words[i].text, text, count) != 0) continue;
        Diag *d = diag(s->unit, span, DIAG_FOREIGN_SYNTAX, "#%s is of another language: write %s", hash_words[i].text,
                       hash_words[i].instead);
        const char *replacement = hash_words[i].code == TOK_SCN_YYerror ? NULL : token_text(hash_words[i].code);
        if (replacement) diag_fix(s->unit, d, span, FIX_LIKELY, "%s", replacement);
        return scan_word(s, hash_words[i].code, at, length);
    }
    uint32_t color = 0;
    bool hexadecimal = true;
    for (uint32_t i = 0; i < count; i++) {
        int digit = hex_value(text[i]);
        if (digit < 0)
            hexadecimal = false;
        else if (count == 3)
            color = color << 8 | (uint32_t)digit * 17;
        else
            color = color << 4 | (uint32_t)digit;
    }
    if (!hexadecimal) {
        diag(s->unit, span, DIAG_COLOR_FORM,
             "a colour is # and three or six digits of 0-9 and a-f: write #f80 or #ff8800");
    } else if (count != 3 && count != 6) {
        Diag *d = diag(s->unit, span, DIAG_COLOR_FORM,
                       "a colour is # and three or six digits, not %u: write #f80 or #ff8800", count);
        if (count == 4) diag_fix(s->unit, d, span, FIX_GUESS, "#%.3s", text);
        if (count == 8) diag_fix(s->unit, d, span, FIX_GUESS, "#%.6s", text);
    }
    s->token->value.color = hexadecimal && (count == 3 || count == 6) ? color : 0x808080;
    return scan_word(s, TOK_COLOR, at, length);
}

// --- Marks of other languages ---

static const struct {
    const char *text;
    int code;
    const char *message, *fix;
} foreign_marks[] = {
    {"&&", TOK_AND, "`&&` is written `and`, and the intersection of objects a & b", "and"},
    {"||", TOK_OR, "`||` is written `or`, and the union of objects a | b", "or"},
    {"**", '^', "a power is written `^`: x^2", "^"},
    {"...", TOK_RANGE, "a range is written `..`: 0..5, which a for walks up to 4", ".."},
    {"..=", TOK_RANGE, "a range is written `..`: 0..5, which a for walks up to 4", ".."},
    {"..<", TOK_RANGE, "a range is written `..`: 0..5, which a for walks up to 4", ".."},
    {":=", '=', "a value is given with `=`: let a = 3;", "="},
    {"=>", ':', "a case is written with a colon: 1: a;", ":"},
    {"<>", TOK_NE, "unequal is written `!=`", "!="},
    {"+=", TOK_SCN_YYerror,
     "a name has one value for good, so there is no `+=`: give the new value a new name with let", NULL},
    {"-=", TOK_SCN_YYerror,
     "a name has one value for good, so there is no `-=`: give the new value a new name with let", NULL},
    {"*=", TOK_SCN_YYerror,
     "a name has one value for good, so there is no `*=`: give the new value a new name with let", NULL},
    {"/=", TOK_SCN_YYerror,
     "a name has one value for good, so there is no `/=`: give the new value a new name with let", NULL},
    {"++", TOK_SCN_YYerror, "a name has one value for good, so there is no `++`; a for counts: for i in 0..5 { … }",
     NULL},
    {"!", '!', "`!` is written `not`, and the complement of an object ~a", "not "},
    {"%", '%', NULL, NULL}, // reported by the parser, which knows the operands
    {"?", TOK_SCN_YYerror, "a choice is written if a { b } else { c }", NULL},
};

int scan_foreign(Scanner *s, uint32_t at, uint32_t length)
{
    for (int i = 0; i < COUNT(foreign_marks); i++) {
        if (strlen(foreign_marks[i].text) != length || memcmp(foreign_marks[i].text, s->source->text + at, length) != 0)
            continue;
        if (foreign_marks[i].message) {
            Span span = scan_span(s, at, length);
            Diag *d = diag(s->unit, span, DIAG_FOREIGN_SYNTAX, "%s", foreign_marks[i].message);
            if (foreign_marks[i].fix) diag_fix(s->unit, d, span, FIX_SURE, "%s", foreign_marks[i].fix);
        }
        return scan_word(s, foreign_marks[i].code, at, length);
    }
    return scan_word(s, TOK_SCN_YYerror, at, length);
}

int scan_quoted(Scanner *s, uint32_t at, uint32_t length)
{
    Span span = scan_span(s, at, length);
    const char *text = s->source->text + at + 1;
    Diag *d = diag(s->unit, span, DIAG_FOREIGN_SYNTAX, "strings are written in double quotes");
    if (!memchr(text, '"', length - 2)) diag_fix(s->unit, d, span, FIX_SURE, "\"%.*s\"", (int)length - 2, text);
    s->token->value.text = (Text){text, length - 2};
    return scan_word(s, TOK_STRING, at, length);
}

// --- Characters that are not of the language ---

static const struct {
    uint32_t code_point;
    int code; // SKIP for what is only space
    const char *name, *instead;
} look_alikes[] = {
    {0x00A0, SKIP, "a space that does not break", " "},
    {0x00AD, SKIP, "an invisible hyphen", ""},
    {0x2002, SKIP, "a wide space", " "},
    {0x2003, SKIP, "a wide space", " "},
    {0x2009, SKIP, "a thin space", " "},
    {0x200B, SKIP, "an invisible space", ""},
    {0x200E, SKIP, "an invisible mark", ""},
    {0x200F, SKIP, "an invisible mark", ""},
    {0x2028, SKIP, "an invisible line break", "\n"},
    {0x202F, SKIP, "a narrow space", " "},
    {0x3000, SKIP, "a wide space", " "},
    {0xFEFF, SKIP, "an invisible byte-order mark", ""},
    {0x00B2, SKIP, "a raised 2", "^2"},
    {0x00B3, SKIP, "a raised 3", "^3"},
    {0x2212, '-', "a minus sign", "-"},
    {0x2010, '-', "a hyphen", "-"},
    {0x2013, '-', "a dash", "-"},
    {0x2014, '-', "a dash", "-"},
    {0x00D7, '*', "a multiplication sign", "*"},
    {0x00B7, '*', "a dot for multiplication", "*"},
    {0x22C5, '*', "a dot for multiplication", "*"},
    {0x00F7, '/', "a division sign", "/"},
    {0x2215, '/', "a division sign", "/"},
    {0x2264, TOK_LE, "a sign for less or equal", "<="},
    {0x2265, TOK_GE, "a sign for greater or equal", ">="},
    {0x2260, TOK_NE, "a sign for unequal", "!="},
    {0x2192, TOK_ARROW, "an arrow", "->"},
    {0x2026, TOK_RANGE, "an ellipsis", ".."},
    {0x222A, '|', "a sign for union", "|"},
    {0x2229, '&', "a sign for intersection", "&"},
    {0x2227, TOK_AND, "a sign for and", "and"},
    {0x2228, TOK_OR, "a sign for or", "or"},
    {0x00AC, TOK_NOT, "a sign for not", "not"},
    {0x037E, ';', "a Greek question mark", ";"},
    {0xFF0C, ',', "a wide comma", ","},
    {0xFF1B, ';', "a wide semicolon", ";"},
    {0x201C, TOK_SCN_YYerror, "a typographic quote", "\""},
    {0x201D, TOK_SCN_YYerror, "a typographic quote", "\""},
    {0x201E, TOK_SCN_YYerror, "a typographic quote", "\""},
    {0x2018, TOK_SCN_YYerror, "a typographic quote", "\""},
    {0x2019, TOK_SCN_YYerror, "a typographic quote", "\""},
};

static int look_alike(uint32_t code_point)
{
    for (int i = 0; i < COUNT(look_alikes); i++) {
        if (look_alikes[i].code_point == code_point) return i;
    }
    return -1;
}

// At text of letters, digits and bytes beyond ASCII. Where a mark's look-alike stands first, it alone is the word; where
// one comes later, the word ends before it. The rest are letters that a name cannot have.
int scan_beyond_ascii(Scanner *s, uint32_t at, uint32_t length, uint32_t *used)
{
    const char *text = s->source->text + at;
    bool ascii = true;
    for (uint32_t i = 0; i < length;) {
        uint32_t code_point;
        uint32_t bytes = (uint32_t)utf8_read(text + i, s->source->length - at - i, &code_point);
        int like = look_alike(code_point);
        if (like >= 0 && i == 0) {
            Span span = scan_span(s, at, bytes);
            bool space = look_alikes[like].code == SKIP && look_alikes[like].instead[0] != '^';
            Diag *d = diag(s->unit, span, DIAG_BAD_CHARACTER, "this is %s (U+%04X): write %s", look_alikes[like].name,
                           (unsigned)code_point, space ? "a plain space" : look_alikes[like].instead);
            diag_fix(s->unit, d, span, FIX_SURE, "%s", look_alikes[like].instead);
            *used = bytes;
            return look_alikes[like].code == SKIP ? SKIP : scan_word(s, look_alikes[like].code, at, bytes);
        }
        if (like >= 0) {
            length = i;
            break;
        }
        if (code_point >= 0x80) ascii = false;
        i += bytes;
    }
    *used = length;
    if (ascii) return scan_name(s, at, length);
    // Broken bytes were reported with the text as a whole.
    bool broken = false;
    for (uint32_t i = 0; i < length;) {
        uint32_t code_point;
        uint32_t bytes = (uint32_t)utf8_read(text + i, length - i, &code_point);
        if (code_point == UTF8_BROKEN && bytes == 1) broken = true;
        i += bytes;
    }
    if (!broken) {
        diag(s->unit, scan_span(s, at, length), DIAG_BAD_CHARACTER,
             "names are written with the letters a-z and A-Z, digits and `_`; other letters may stand in strings and "
             "comments");
    }
    s->token->value.name = name_of(&s->unit->names, text, length);
    return scan_word(s, TOK_NAME, at, length);
}

int scan_control(Scanner *s, uint32_t at, uint32_t length)
{
    unsigned char c = (unsigned char)s->source->text[at];
    Span span = scan_span(s, at, length);
    if (c == '\\')
        diag(s->unit, span, DIAG_BAD_CHARACTER, "a `\\` stands only in strings; a line needs no mark to go on");
    else if (c == '\'')
        diag(s->unit, span, DIAG_BAD_CHARACTER, "strings are written in double quotes");
    else if (c == '$')
        diag(s->unit, span, DIAG_BAD_CHARACTER, "names are written without `$`");
    else if (c > 0x20 && c < 0x7F)
        diag(s->unit, span, DIAG_BAD_CHARACTER, "`%c` is not a character of the language", c);
    else
        diag(s->unit, span, DIAG_BAD_CHARACTER, "a character that cannot be seen (code %u) stands here: remove it", c);
    return scan_word(s, TOK_SCN_YYerror, at, length);
}

// --- Begin and end ---

void scan_open_comment(Scanner *s)
{
    diag(s->unit, scan_span(s, s->comment_begin, 2), DIAG_UNTERMINATED_COMMENT,
         "this comment does not end: write */ (comments nest, so each /* in it needs one too)");
    s->unit->lost.shape = true;
    // What the item before it lacks may stand in it.
    uint32_t begin = s->comment_begin;
    while (begin > 0 && strchr(" \t\r\n", s->source->text[begin - 1])) begin--;
    s->unit->lost.silent = scan_span(s, begin, s->source->length - begin + 1);
}

enum { TEXT_PROBE = 8000 }; // bytes that tell a text from other files

// One that got into a text is reported where it stands; other files are full of them.
static bool has_many_controls(const char *text, uint32_t length)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < length; i++) {
        unsigned char c = (unsigned char)text[i];
        count += c < 0x20 && c != '\t' && c != '\n' && c != '\r' && c != '\f';
    }
    return count > 4 && count > length / 32;
}

// Reports once what is not UTF-8, wherever it stands. False for a text that is of another encoding altogether.
static bool check_encoding(Scanner *s)
{
    const char *text = s->source->text;
    uint32_t length = s->source->length;
    bool wide = length >= 2 && (memcmp(text, "\xFF\xFE", 2) == 0 || memcmp(text, "\xFE\xFF", 2) == 0);
    if (wide || (length >= 4 && !text[1] && !text[3]) || (length >= 4 && !text[0] && !text[2])) {
        diag(s->unit, scan_span(s, 0, 1), DIAG_BAD_CHARACTER, "the file is UTF-16 or not a text: save it as UTF-8");
        return false;
    }
    if (has_many_controls(text, length < TEXT_PROBE ? length : TEXT_PROBE)) {
        diag(s->unit, scan_span(s, 0, 1), DIAG_BAD_CHARACTER, "the file is not a text: a scene is written in UTF-8");
        return false;
    }
    for (uint32_t i = 0; i < length;) {
        uint64_t eight;
        if (length - i >= sizeof eight) { // most texts have little else than ASCII
            memcpy(&eight, text + i, sizeof eight);
            if (!(eight & UINT64_C(0x8080808080808080))) {
                i += sizeof eight;
                continue;
            }
        }
        if ((unsigned char)text[i] < 0x80) {
            i++;
            continue;
        }
        uint32_t code;
        uint32_t bytes = (uint32_t)utf8_read(text + i, length - i, &code);
        if (bytes == 1) {
            diag(s->unit, scan_span(s, i, 1), DIAG_BAD_CHARACTER, "the byte %02X is not UTF-8: save the file as UTF-8",
                 (unsigned char)text[i]);
            return true;
        }
        i += bytes;
    }
    return true;
}

void scanner_init(Scanner *s, Unit *unit, const Source *source)
{
    *s = (Scanner){.unit = unit, .source = source};
    s->c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    s->buffer = calloc(1, (size_t)source->length + 2);
    if (!s->buffer || !s->c_locale) {
        fprintf(stderr, "scn: out of memory (the text of %s)\n", source->path);
        exit(3);
    }
    memcpy(s->buffer, source->text, source->length);
    for (int i = COUNT(reserved) - 1; i >= 0; i--) s->first_word[reserved[i].text[0] - 'a'] = (uint8_t)i;
    s->ended = !check_encoding(s);
    scan_start(s);
}

void scanner_release(Scanner *s)
{
    scan_stop(s);
    free(s->buffer);
    freelocale(s->c_locale);
    *s = (Scanner){0};
}
