/* Factorises and solves by panels of four columns, each as long as its columns reach. */
#include "sim/linalg/linalg.h"

#include <math.h>
#include <string.h>

#ifdef __FMA__
#include <immintrin.h>
#endif

#ifdef FP_FAST_FMA
#define MULTIPLY_ADD(a, b, c) fma(a, b, c)
#else
#define MULTIPLY_ADD(a, b, c) ((a) * (b) + (c))
#endif

/* Four numbers of a row, in the register that compilers do not find by themselves. */
typedef double Row __attribute__((vector_size(32), aligned(8), may_alias));

/* Adds share row to a sum, rounded once where that is fast: loops over rows and sums alike are made
   into shuffles, which take twice as long. */
static inline void add_product(Row *sum, double share, const Row *row) {
#ifdef __FMA__
    *sum = _mm256_fmadd_pd(_mm256_set1_pd(share), *row, *sum);
#else
    for (int j = 0; j < 4; j++) (*sum)[j] = MULTIPLY_ADD(share, (*row)[j], (*sum)[j]);
#endif
}

int64_t panels_entry(const Panels *panels, int64_t row, int64_t column) {
    int64_t panel = column / 4;
    return panels->first[panel] + 4 * (row - 4 * panel) + column % 4;
}

/* Replaces a row t by share t + s F, with the row s and the matrix F, rows first. */
static inline void add_row_product(double *t, double share, const double *s, const Row F[4]) {
    Row total = share * *(Row *)t;
    for (int i = 0; i < 4; i++) add_product(&total, s[i], F + i);
    *(Row *)t = total;
}

void panels_fill_padding(double *values, int64_t n, const Panels *panels) {
    for (int64_t column = n; column < 4 * (panels->n_first - 1); column++)
        values[panels_entry(panels, column, column)] = 1.0;
}

static inline bool factorise_block(double *v) {
    double pivot = v[0];
    if (!(pivot > 0.0)) return false;
    double l00 = sqrt(pivot), l10 = v[4] / l00, l20 = v[8] / l00, l30 = v[12] / l00;
    pivot = v[5] - l10 * l10;
    if (!(pivot > 0.0)) return false;
    double l11 = sqrt(pivot), l21 = (v[9] - l20 * l10) / l11, l31 = (v[13] - l30 * l10) / l11;
    pivot = v[10] - l20 * l20 - l21 * l21;
    if (!(pivot > 0.0)) return false;
    double l22 = sqrt(pivot), l32 = (v[14] - l30 * l20 - l31 * l21) / l22;
    pivot = v[15] - l30 * l30 - l31 * l31 - l32 * l32;
    if (!(pivot > 0.0)) return false;
    v[0] = l00, v[4] = l10, v[5] = l11, v[8] = l20, v[9] = l21;
    v[10] = l22, v[12] = l30, v[13] = l31, v[14] = l32, v[15] = sqrt(pivot);
    return true;
}

static inline void inverse_transposed(const double *v, Row F[4]) {
    double d0 = 1.0 / v[0], d1 = 1.0 / v[5], d2 = 1.0 / v[10], d3 = 1.0 / v[15];
    double m10 = -v[4] * d0 * d1, m21 = -v[9] * d1 * d2, m32 = -v[14] * d2 * d3;
    double m20 = -(v[8] * d0 + v[9] * m10) * d2;
    double m31 = -(v[13] * d1 + v[14] * m21) * d3;
    double m30 = -(v[12] * d0 + v[13] * m10 + v[14] * m20) * d3;
    F[0] = (Row){d0, m10, m20, m30};
    F[1] = (Row){0.0, d1, m21, m31};
    F[2] = (Row){0.0, 0.0, d2, m32};
    F[3] = (Row){0.0, 0.0, 0.0, d3};
}

bool panels_factorise(double *v, const Panels *panels) {
    const int64_t *first = panels->first, n_panels = panels->n_first - 1;
    Row F[4];
    for (int64_t panel = 0; panel < n_panels; panel++) {
        int64_t at = first[panel], end = first[panel + 1];
        if (!factorise_block(v + at)) return false;
        inverse_transposed(v + at, F);
        for (int64_t row = at + 16; row < end; row += 4) add_row_product(v + row, 0.0, v + row, F);
        for (int64_t b = at + 16; b < end; b += 16) {  /* four rows that are columns of a later panel */
            for (int c = 0; c < 4; c++)
                F[c] = (Row){-v[b + c], -v[b + c + 4], -v[b + c + 8], -v[b + c + 12]};
            double *target = v + first[panel + (b - at) / 16] - b;
            for (int64_t row = b; row < end; row += 4) add_row_product(target + row, 1.0, v + row, F);
        }
    }
    return true;
}

void panels_solve(
    const double *v, const Panels *panels, int64_t n, double *right, double *x) {
    const int64_t *first = panels->first, n_panels = panels->n_first - 1;
    memcpy(x, right, sizeof(double) * n);
    memset(x + n, 0, sizeof(double) * (4 * n_panels - n));
    for (int64_t panel = 0; panel < n_panels; panel++) {
        const double *rows = v + first[panel];
        int64_t count = (first[panel + 1] - first[panel]) / 4;
        double *b = x + 4 * panel;
        double x0 = b[0] / rows[0];
        double x1 = (b[1] - rows[4] * x0) / rows[5];
        double x2 = (b[2] - rows[8] * x0 - rows[9] * x1) / rows[10];
        double x3 = (b[3] - rows[12] * x0 - rows[13] * x1 - rows[14] * x2) / rows[15];
        b[0] = x0, b[1] = x1, b[2] = x2, b[3] = x3;
        for (int64_t i = 4; i < count; i++)
            b[i] -= (rows[4 * i] * x0 + rows[4 * i + 1] * x1)
                    + (rows[4 * i + 2] * x2 + rows[4 * i + 3] * x3);
    }
    for (int64_t panel = n_panels - 1; panel >= 0; panel--) {
        const double *rows = v + first[panel];
        int64_t count = (first[panel + 1] - first[panel]) / 4;
        double *b = x + 4 * panel;
        Row left = *(Row *)b;
        for (int64_t i = 4; i < count; i++) left -= ((const Row *)rows)[i] * b[i];
        double x3 = left[3] / rows[15];
        double x2 = (left[2] - rows[14] * x3) / rows[10];
        double x1 = (left[1] - rows[9] * x2 - rows[13] * x3) / rows[5];
        double x0 = (left[0] - rows[4] * x1 - rows[8] * x2 - rows[12] * x3) / rows[0];
        b[0] = x0, b[1] = x1, b[2] = x2, b[3] = x3;
    }
    memcpy(right, x, sizeof(double) * n);
}
