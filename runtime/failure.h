// What went wrong in the world: a file, a device, a disk.
//
// A function that can fail takes a Failure as its last argument and returns false or NULL after filling it with
// a sentence for people, without a full stop. Whoever knows more of the user's words puts them before it.
//
//     if (!file) return fail(failure, "cannot open %s: %s", path, strerror(errno));
#ifndef SCN_RUNTIME_FAILURE_H
#define SCN_RUNTIME_FAILURE_H

#include <stdbool.h>

typedef struct Failure {
    char text[1024];
} Failure;

// Says what failed and returns false. `failure` may be NULL, where nobody wants to know. (The brackets keep off the
// macro of this name that cmocka.h has.)
bool(fail)(Failure *failure, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Puts "prefix: " before what was said, and returns false.
bool fail_prefix(Failure *failure, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
