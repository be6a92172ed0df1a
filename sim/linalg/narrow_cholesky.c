/* Factorises a narrow band by panels of four columns: short loops that vectorise. */
#include "sim/linalg/linalg.h"

#include <math.h>

enum { PANEL = 4, STRIDE = 128 };

static inline int64_t smaller(int64_t a, int64_t b) { return a < b ? a : b; }

static bool factorise_panel(double *band, int64_t n, int64_t width, int64_t first, int64_t count) {
    for (int64_t c = 0; c < count; c++) {
        double *column = band + (first + c) * (width + 1);
        if (!(column[0] > 0.0)) return false;
        double scale = 1.0 / sqrt(column[0]);
        int64_t reach = smaller(width, n - 1 - first - c);
        for (int64_t i = 0; i <= reach; i++) column[i] *= scale;
        for (int64_t q = 1; q < smaller(count - c, reach + 1); q++) {
            double factor = column[q];
            const double *restrict source = column + q;
            double *restrict target = band + (first + c + q) * (width + 1);
            for (int64_t i = 0; i < reach + 1 - q; i++) target[i] -= factor * source[i];
        }
    }
    return true;
}

static void gather_panel(const double *band, int64_t n, int64_t width, int64_t first, int64_t rows, double *panel) {
    for (int64_t c = 0; c < PANEL; c++) {
        int64_t known = smaller(width, n - 1 - first - c) - (PANEL - 1) + c, r = 0;
        for (; r < known; r++)
            panel[c * STRIDE + r] = band[(first + c) * (width + 1) + PANEL - c + r];
        for (; r < rows; r++) panel[c * STRIDE + r] = 0.0;
    }
}

bool narrow_cholesky_factorise(double *band, int64_t n, int64_t width) {
    double panel[PANEL * STRIDE] = {0};
    for (int64_t first = 0; first < n; first += PANEL) {
        if (!factorise_panel(band, n, width, first, smaller(PANEL, n - first))) return false;
        int64_t rows = smaller(width, n - first - PANEL);
        if (rows <= 0) continue;
        gather_panel(band, n, width, first, rows, panel);
        for (int64_t q = 0; q < rows; q++) {
            const double *restrict row = panel + q;
            double f0 = row[0], f1 = row[STRIDE], f2 = row[2 * STRIDE], f3 = row[3 * STRIDE];
            double *restrict target = band + (first + PANEL + q) * (width + 1);
            for (int64_t i = 0; i < rows - q; i++)
                target[i] -= f0 * row[i] + f1 * row[i + STRIDE] + f2 * row[i + 2 * STRIDE]
                             + f3 * row[i + 3 * STRIDE];
        }
    }
    return true;
}
