/* Routines of LAPACK and BLAS, those that SciPy brings; filled when the library is loaded. Their names
   are none that another library has. */
#ifndef SIM_LAPACK_H
#define SIM_LAPACK_H

extern void (*lapack_dpbtrf)(char *, int *, int *, double *, int *, int *);
extern void (*lapack_dpbtrs)(char *, int *, int *, int *, double *, int *, double *, int *, int *);
extern void (*lapack_dpotrf)(char *, int *, double *, int *, int *);
extern void (*lapack_dtrsm)(
    char *, char *, char *, char *, int *, int *, double *, double *, int *, double *, int *);
extern void (*lapack_dsyrk)(
    char *, char *, int *, int *, double *, double *, int *, double *, double *, int *);
extern void (*lapack_dtrsv)(char *, char *, char *, int *, double *, int *, double *, int *);
extern void (*lapack_dgemv)(
    char *, int *, int *, double *, double *, int *, double *, int *, double *, double *, int *);

#endif
