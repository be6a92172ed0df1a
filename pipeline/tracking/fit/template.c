/* Samples cubic B-splines (Unser, 1999) of pictures. */
#include "pipeline/declarations.h"

#include <math.h>

enum { TAPS = 4 };

/* Fills the four basis values at an offset in [0, 1) behind the second knot. */
static void spline_weights(double offset, double *value) {
    double rest = 1.0 - offset, square = offset * offset, rest_square = rest * rest;
    value[0] = rest_square * rest / 6.0;
    value[1] = 2.0 / 3.0 - 0.5 * square * (2.0 - offset);
    value[2] = 2.0 / 3.0 - 0.5 * rest_square * (2.0 - rest);
    value[3] = square * offset / 6.0;
}

void template_sample_spline(
    float *coefs, int64_t columns, double *x, double *y, double *out, int64_t n_coefs,
    int64_t n_x) {
    double across[TAPS], along[TAPS];
    for (int64_t k = 0; k < n_x; k++) {
        double column = floor(x[k]), row = floor(y[k]);
        if (!(column >= 1 && row >= 1 && column <= columns - 3 && row <= n_coefs - 3)) {
            out[k] = NAN;
            continue;
        }
        spline_weights(x[k] - column, across);
        spline_weights(y[k] - row, along);
        const float *knots = coefs + columns * ((int64_t)row - 1) + (int64_t)column - 1;
        double total = 0.0;
        for (int a = 0; a < TAPS; a++) {
            double line = 0.0;
            for (int b = 0; b < TAPS; b++) line += across[b] * knots[columns * a + b];
            total += along[a] * line;
        }
        out[k] = total;
    }
}
