#include "runtime/failure.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

bool fail(Failure *failure, const char *format, ...)
{
    if (!failure) return false;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(failure->text, sizeof failure->text, format, arguments);
    va_end(arguments);
    return false;
}

bool fail_prefix(Failure *failure, const char *format, ...)
{
    if (!failure) return false;
    char prefix[sizeof failure->text];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(prefix, sizeof prefix, format, arguments);
    va_end(arguments);

    // The prefix goes before the old text in place; what does not fit is cut at the end.
    size_t length = strlen(prefix), room = sizeof failure->text;
    if (length > room - 3) length = room - 3;
    size_t old = strlen(failure->text);
    if (length + 2 + old > room - 1) old = room - 1 - length - 2;
    memmove(failure->text + length + 2, failure->text, old);
    memcpy(failure->text, prefix, length);
    memcpy(failure->text + length, ": ", 2);
    failure->text[length + 2 + old] = 0;
    return false;
}
