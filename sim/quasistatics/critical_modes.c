/* Mixes modes that are critical at once, as at both ends of a symmetric lattice.

   Inverse iteration finds some mixture of these; which one is rounding's. Fixed numbers have the same
   part of all of them, by whatever loads a path came to its branching. */
#include "sim/quasistatics/quasistatics.h"

#include <stdlib.h>

/* Modes that are mixed at most, and sweeps for each: those that are not critical are far stiffer. */
enum { MOST_MODES = 4, SWEEPS = 4 };

static double product(const double *x, const double *y, int64_t n) {
    double total = 0.0;
    EACH(i, n) total += x[i] * y[i];
    return total;
}

static void normalise(double *x, int64_t n) {
    double length = sqrt(product(x, x, n));
    EACH(i, n) x[i] /= length;
}

/* Takes from x (n,) its parts along orthonormal modes (count, n). */
static void make_orthogonal(double *x, const double *modes, int64_t count, int64_t n) {
    EACH(k, count) {
        double share = product(x, modes + k * n, n);
        EACH(i, n) x[i] -= share * modes[k * n + i];
    }
}

/* Load on a mode, by the forces of the held dofs' motion in `force`. */
double critical_modes_load(const double *mode, const System *s, const Workspace *w) {
    double along = 0.0;
    EACH(i, s->n_dofs) along -= mode[i] * w->force[s->dofs[i]] / s->scale[s->dofs[i]];
    return along;
}

/* Mixes the lowest mode with others whose eigenvalues and loads are below limits. */
void critical_modes_mix(
    double *mode, double largest_value, double largest_load, const System *s, const Workspace *w) {
    int64_t n = s->n_dofs, count = 1;
    double *modes = malloc(sizeof(double) * MOST_MODES * n);
    copy(modes, mode, n);
    for (; count < MOST_MODES; count++) {
        double *next = modes + count * n, value = INFINITY;
        path_ends_scatter(next, n);
        EACH(sweep, SWEEPS) {
            make_orthogonal(next, modes, count, n);
            value = snap_lowest_mode(s, w, next, 1, 0.0);
        }
        make_orthogonal(next, modes, count, n);
        normalise(next, n);
        if (!(value <= largest_value)) break;
        if (!(fabs(critical_modes_load(next, s, w)) <= largest_load)) break;
    }
    if (count > 1) {
        path_ends_scatter(mode, n);
        double share[MOST_MODES];
        EACH(k, count) share[k] = product(mode, modes + k * n, n);
        memset(mode, 0, sizeof(double) * n);
        EACH(k, count) EACH(i, n) mode[i] += share[k] * modes[k * n + i];
        normalise(mode, n);
    }
    free(modes);
}
