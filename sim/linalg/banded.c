/* Factorises and solves with a band, by loops of our own if it is narrow, else by LAPACK. */
#include "sim/linalg/lapack.h"
#include "sim/linalg/linalg.h"

#include <math.h>

enum { NARROW = 100 };

bool banded_factorise(double *band, int64_t n, int64_t width) {
    if (n == 0) return true;
    if (width + 1 <= NARROW) return narrow_cholesky_factorise(band, n, width);
    int rows = n, below = width, stride = width + 1, info = 0;
    lapack_dpbtrf("L", &rows, &below, band, &stride, &info);
    return info == 0 && isfinite(band[(n - 1) * (width + 1)]);
}

void banded_solve(const double *factor, int64_t n, int64_t width, double *right) {
    if (n == 0) return;
    int rows = n, below = width, one = 1, stride = width + 1, info = 0;
    lapack_dpbtrs("L", &rows, &below, &one, (double *)factor, &stride, right, &rows, &info);
}
