/* Fills, factorises and solves with a symmetric matrix in the storage that its pattern names. */
#include "sim/linalg/linalg.h"

#include <string.h>

void symmetric_clear(const Matrix *of) {
    memset(of->values, 0, sizeof(double) * of->n_values);
    if (of->pattern.size[1] == BY_PANELS)
        panels_fill_padding(of->values, of->pattern.size[0], &of->pattern.panels);
}

int64_t symmetric_entry(const Pattern *pattern, int64_t i, int64_t j) {
    if (i < 0 || j < 0) return -1;
    int64_t row = i > j ? i : j, column = i > j ? j : i, width = pattern->size[1];
    if (width >= 0) return column * width + row;
    if (width == BY_PANELS) return panels_entry(&pattern->panels, row, column);
    return multifrontal_entry(&pattern->fronts, row, column);
}

void symmetric_add(const Matrix *of, int64_t i, int64_t j, double value) {
    int64_t at = symmetric_entry(&of->pattern, i, j);
    if (at >= 0) of->values[at] += value;
}

void symmetric_find_blocks(
    const Pattern *pattern, int64_t *free, int64_t *pairs, int64_t *found, int64_t n_pairs) {
    int64_t place[6];
    for (int64_t k = 0; k < n_pairs; k++) {
        for (int m = 0; m < 6; m++) place[m] = free[3 * pairs[2 * k + m / 3] + m % 3];
        for (int row = 0; row < 6; row++)
            for (int column = 0; column <= row; column++)
                *found++ = symmetric_entry(pattern, place[row], place[column]);
    }
}

bool symmetric_factorise(const Matrix *of) {
    int64_t n = of->pattern.size[0], width = of->pattern.size[1];
    if (width >= 0) return banded_factorise(of->values, n, width);
    if (width == BY_PANELS) return panels_factorise(of->values, &of->pattern.panels);
    return multifrontal_factorise(of->values, of->scratch, &of->pattern.fronts, of->threads);
}

void symmetric_solve(const Matrix *factor, double *right) {
    const Pattern *pattern = &factor->pattern;
    int64_t n = pattern->size[0], width = pattern->size[1];
    if (width >= 0)
        banded_solve(factor->values, n, width, right);
    else if (width == BY_PANELS)
        panels_solve(factor->values, &pattern->panels, n, right, factor->scratch);
    else
        multifrontal_solve(factor->values, &pattern->fronts, n, right);
}
