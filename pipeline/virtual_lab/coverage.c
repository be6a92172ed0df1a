/* Computes the exact coverage of pixels by polygons: what a pixel integrates, without samples.

   Every edge adds to a buffer by how much the coverage changes from one pixel of a row to the next;
   its running sum along the rows is the picture. It is linear, so polygons that lie within others
   carry the difference of their shades, and all go into one buffer. */
#include "pipeline/declarations.h"
#include "sim/core/numbers.h"

#include <math.h>

/* Mean of max(value - x, 0) for x from left to right. */
static double mean_excess(double value, double left, double right) {
    if (value <= left) return 0.0;
    if (value >= right) return value - 0.5 * (left + right);
    return 0.5 * (value - left) * (value - left) / (right - left);
}

/* Adds an edge, row by row; what is to its right is covered if it runs downwards. */
static void add_edge(
    const double *a, const double *b, double shade, double *change, int64_t rows,
    int64_t columns) {
    if (a[1] == b[1]) return;
    bool upwards = a[1] > b[1];
    double sign = upwards ? -shade : shade, end = columns - 2.0;
    const double *low = upwards ? b : a, *high = upwards ? a : b;
    double slope = (high[0] - low[0]) / (high[1] - low[1]);
    int64_t last = (int64_t)least((double)rows, ceil(high[1]));
    for (int64_t row = (int64_t)most(0.0, floor(low[1])); row < last; row++) {
        double top = most(low[1], (double)row), bottom = least(high[1], row + 1.0);
        double x = low[0] + slope * (top - low[1]), y = low[0] + slope * (bottom - low[1]);
        double left = least(most(least(x, y), 0.0), end), right = least(most(most(x, y), 0.0), end);
        double before = 0.0;
        for (int64_t column = (int64_t)left; column < (int64_t)right + 2; column++) {
            double covered = mean_excess(column + 1.0, left, right);
            covered -= mean_excess((double)column, left, right);
            change[columns * row + column] += sign * (bottom - top) * (covered - before);
            before = covered;
        }
    }
}

void coverage_integrate(
    double *points, int64_t *start, double *shade, double *picture, int64_t columns,
    int64_t n_shade, int64_t n_picture) {
    for (int64_t ring = 0; ring < n_shade; ring++) {
        int64_t first = start[ring], end = start[ring + 1];
        for (int64_t k = first; k < end; k++) {
            int64_t following = k + 1 < end ? k + 1 : first;
            add_edge(
                points + 2 * k, points + 2 * following, shade[ring], picture, n_picture, columns);
        }
    }
    for (int64_t row = 0; row < n_picture; row++)
        for (int64_t k = columns * row + 1; k < columns * (row + 1); k++) picture[k] += picture[k - 1];
}
