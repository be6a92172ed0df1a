/* Factorises and solves with symmetric matrices, stored as a band, by panels or by fronts. */
#ifndef SIM_LINALG_H
#define SIM_LINALG_H

#include "sim/declarations.h"

enum { BY_FRONTS = -1, BY_PANELS = -2 };

/* A narrow band (n, width + 1), column by column: band[column][row - column]. */
bool narrow_cholesky_factorise(double *band, int64_t n, int64_t width);

bool banded_factorise(double *band, int64_t n, int64_t width);
void banded_solve(const double *factor, int64_t n, int64_t width, double *right);

int64_t panels_entry(const Panels *panels, int64_t row, int64_t column);
void panels_fill_padding(double *values, int64_t n, const Panels *panels);
bool panels_factorise(double *values, const Panels *panels);
void panels_solve(
    const double *values, const Panels *panels, int64_t n, double *right, double *scratch);

int64_t multifrontal_entry(const Fronts *fronts, int64_t row, int64_t column);
bool multifrontal_factorise(
    double *values, double *scratch, const Fronts *fronts, int64_t threads);
void multifrontal_solve(const double *factor, const Fronts *fronts, int64_t n, double *right);

#endif
