#include "lang/classes.h"

#include "lang/ast.h"
#include "lang/source.h"

#include "lang/parse.h"

#define B  TOKEN_BEGINS
#define C  TOKEN_CONTINUES
#define E  TOKEN_ENDS
#define I  TOKEN_ITEM
#define IB (TOKEN_ITEM | TOKEN_BODIED)

static const unsigned char classes_of[] = {
    [TOK_NAME] = B | E,
    [TOK_INT] = B | E,
    [TOK_REAL] = B | E,
    [TOK_COLOR] = B | E,
    [TOK_TRUE] = B | E,
    [TOK_FALSE] = B | E,
    [TOK_STRING] = B | E,
    [TOK_STRING_HEAD] = B,
    [TOK_STRING_TAIL] = E,
    [TOK_NOT] = B,
    [TOK_IF] = B,
    ['~'] = B,
    ['!'] = B,
    ['-'] = B | C,
    ['('] = B | C,
    ['['] = B | C,
    ['{'] = B | C,
    [')'] = E,
    [']'] = E,
    ['}'] = E,
    ['.'] = C,
    ['^'] = C,
    ['*'] = C,
    ['/'] = C,
    ['%'] = C,
    ['+'] = C,
    ['&'] = C,
    ['|'] = C,
    ['<'] = C,
    ['>'] = C,
    [TOK_RANGE] = C,
    [TOK_EQ] = C,
    [TOK_NE] = C,
    [TOK_LE] = C,
    [TOK_GE] = C,
    [TOK_AND] = C,
    [TOK_OR] = C,
    [TOK_SCN] = I,
    [TOK_INCLUDE] = I,
    [TOK_USE] = I,
    [TOK_PARAM] = I,
    [TOK_LET] = I,
    [TOK_ASSERT] = I,
    [TOK_PRINT] = I,
    [TOK_FN] = IB,
    [TOK_TAG] = IB,
    [TOK_TOOL] = IB,
    [TOK_FOR] = IB,
};

bool token_is(int code, unsigned classes)
{
    return code >= 0 && code < (int)(sizeof classes_of / sizeof *classes_of) && classes_of[code] & classes;
}

bool token_begins_item(int code)
{
    return token_is(code, TOKEN_ITEM) || (token_is(code, TOKEN_BEGINS) && !token_is(code, TOKEN_CONTINUES));
}

bool token_begins_item_behind_brace(int code)
{
    return token_begins_item(code) || code == '(' || code == '{';
}
