/* Samples cubic B-splines (Unser, 1999) of pictures, and measures distances to outlines. */
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

/* Compares with an edge from a to b the nodes of a row: least squared distance, and whether an odd
   number of edges crosses the ray to the right. */
static void pass_edge(
    const double *line, int64_t n_line, double y, const double *a, const double *b,
    double *restrict square, double *restrict odd) {
    double ex = b[0] - a[0], ey = b[1] - a[1], up = y - a[1], size = ex * ex + ey * ey;
    for (int64_t k = 0; k < n_line; k++) {
        double right = line[k] - a[0], along = (right * ex + up * ey) / size;
        along = along < 0.0 ? 0.0 : along;
        along = along > 1.0 ? 1.0 : along;
        double across = right - along * ex, ahead = up - along * ey;
        double found = across * across + ahead * ahead;
        square[k] = found < square[k] ? found : square[k];
    }
    if ((y < a[1]) == (y < b[1])) return;
    double meets = a[0] + up * ex / ey;
    for (int64_t k = 0; k < n_line; k++) odd[k] = line[k] < meets ? -odd[k] : odd[k];
}

void template_measure_distance(
    double *line, double *polygon, double *scratch, float *out, int64_t n_line, int64_t n_polygon) {
    double *square = scratch, *sign = scratch + n_line;
    for (int64_t row = 0; row < n_line; row++) {
        for (int64_t k = 0; k < n_line; k++) square[k] = INFINITY, sign[k] = -1.0;
        for (int64_t k = 0; k < n_polygon; k++)
            pass_edge(
                line, n_line, line[row], polygon + 2 * k, polygon + 2 * ((k + 1) % n_polygon),
                square, sign);
        for (int64_t k = 0; k < n_line; k++)
            out[row * n_line + k] = (float)(sign[k] * sqrt(square[k]));
    }
}
