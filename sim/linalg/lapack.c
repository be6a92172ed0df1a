/* Holds the addresses of LAPACK's and BLAS's routines. */
#include "sim/linalg/lapack.h"

void (*lapack_dpbtrf)(char *, int *, int *, double *, int *, int *);
void (*lapack_dpbtrs)(char *, int *, int *, int *, double *, int *, double *, int *, int *);
void (*lapack_dpotrf)(char *, int *, double *, int *, int *);
void (*lapack_dtrsm)(
    char *, char *, char *, char *, int *, int *, double *, double *, int *, double *, int *);
void (*lapack_dsyrk)(char *, char *, int *, int *, double *, double *, int *, double *, double *, int *);
void (*lapack_dtrsv)(char *, char *, char *, int *, double *, int *, double *, int *);
void (*lapack_dgemv)(
    char *, int *, int *, double *, double *, int *, double *, int *, double *, double *, int *);
