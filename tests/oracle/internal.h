// What the oracle's files share.
#ifndef SCN_TESTS_ORACLE_INTERNAL_H
#define SCN_TESTS_ORACLE_INTERNAL_H

#include "tests/oracle/oracle.h"

typedef struct OracleScratch OracleScratch; // lists of one ray, kept between rays

OracleScratch *oracle_scratch_new(void);
void oracle_scratch_free(OracleScratch *scratch);

typedef struct OraclePlain OraclePlain;

OraclePlain *oracle_plain_new(const Oracle *oracle);
void oracle_plain_free(OraclePlain *plain);

void oracle_map_point(const double m[12], const double x[3], double out[3]);
double oracle_quadric_field(const double a[10], const double point[3], double gradient[3]);

// A quadric on a ray: a t² + b t + c.
typedef struct OracleParabola {
    double a, b, c;
} OracleParabola;

OracleParabola oracle_parabola(const OracleQuadric *quadric, const OracleRay *ray);
OracleParabola oracle_base_parabola(const Oracle *oracle, const OracleLeaf *leaf, const OracleRay *ray);

// Real roots in ascending order, 0, 1 or 2 of them; a double root, where the sign stays, is none.
int oracle_parabola_roots(const OracleParabola *q, double roots[2]);

// -- general fields (oracle_fields.c)

typedef struct OracleExpression OracleExpression;

typedef struct OraclePoint {
    double f, g[3];
} OraclePoint; // a value and its gradient; NaN: undefined
typedef struct OracleSpan {
    double low, high;
    bool partial;
} OracleSpan; // low > high: undefined; partial: perhaps
typedef struct OracleLine {
    double origin[3], direction[3];
} OracleLine; // in the field's own coordinates

// Of OP_FIELD, after the numbers are evaluated; one for each node, and the oracle's.
OracleExpression *oracle_expression_new(Oracle *oracle, IrId field);
void oracle_expressions_free(Oracle *oracle);

// F, -ORACLE_INFINITY where it is undefined or out of reach. `gradient` may be NULL.
double oracle_expression_at(OracleExpression *expression, const double point[3], double gradient[3]);

enum { ORACLE_TERMS = 8 };
typedef struct OracleTerm {
    OracleExpression *expression;
    OracleLine line;
    double weight;
} OracleTerm;

// Calls `found` at the places between near and far where the sign of F (with what is added to it) changes, and at some where it does not.
typedef struct OracleSeek {
    const struct OracleTerm *terms; // F is their sum, each by its weight, and what is added
    int term_count;
    void *context;
    double (*at)(void *context, double t);                      // F with all that is added
    OracleSpan (*more)(void *context, double low, double high); // what is added to the expression; NULL: nothing
    void (*found)(void *context, double t);
} OracleSeek;
void oracle_expression_seek(const OracleSeek *seek, double near, double far);

// Point, normal and leaf of a hit at ray parameter t.
void oracle_describe(const Oracle *oracle, const OracleRay *ray, double t, bool leaving, OracleHit *hit);

#endif
