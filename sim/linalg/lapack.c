/* Holds the addresses of LAPACK's and BLAS's routines. */
#include "sim/linalg/lapack.h"

void (*dpbtrf)(char *, int *, int *, double *, int *, int *);
void (*dpbtrs)(char *, int *, int *, int *, double *, int *, double *, int *, int *);
void (*dpotrf)(char *, int *, double *, int *, int *);
void (*dtrsm)(
    char *, char *, char *, char *, int *, int *, double *, double *, int *, double *, int *);
void (*dsyrk)(char *, char *, int *, int *, double *, double *, int *, double *, double *, int *);
void (*dtrsv)(char *, char *, char *, int *, double *, int *, double *, int *);
void (*dgemv)(
    char *, int *, int *, double *, double *, int *, double *, int *, double *, double *, int *);
