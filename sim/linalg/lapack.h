/* Routines of LAPACK and BLAS, those that SciPy brings; filled when the library is loaded. */
#ifndef SIM_LAPACK_H
#define SIM_LAPACK_H

extern void (*dpbtrf)(char *, int *, int *, double *, int *, int *);
extern void (*dpbtrs)(char *, int *, int *, int *, double *, int *, double *, int *, int *);
extern void (*dpotrf)(char *, int *, double *, int *, int *);
extern void (*dtrsm)(
    char *, char *, char *, char *, int *, int *, double *, double *, int *, double *, int *);
extern void (*dsyrk)(
    char *, char *, int *, int *, double *, double *, int *, double *, double *, int *);
extern void (*dtrsv)(char *, char *, char *, int *, double *, int *, double *, int *);
extern void (*dgemv)(
    char *, int *, int *, double *, double *, int *, double *, int *, double *, double *, int *);

#endif
