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
typedef struct OracleParabola { double a, b, c; } OracleParabola;

OracleParabola oracle_parabola(const OracleQuadric *quadric, const OracleRay *ray);
OracleParabola oracle_base_parabola(const Oracle *oracle, const OracleLeaf *leaf, const OracleRay *ray);

// Real roots in ascending order, 0, 1 or 2 of them; a double root, where the sign stays, is none.
int oracle_parabola_roots(const OracleParabola *q, double roots[2]);

// Point, normal and leaf of a hit at ray parameter t.
void oracle_describe(const Oracle *oracle, const OracleRay *ray, double t, bool leaving, OracleHit *hit);

#endif
