/* Estimates how far ahead a limit point is, and predicts the path up to it.

   At a distance d before a limit point the tangent goes as a + b / sqrt(d). Over an increment from
   d0 to d1, with r^2 = d1 / d0 and the steps t0 and t1 along the tangents at its ends, so

       u1 - u0 = (t0 + r t1) / (1 + r),

   the trapezoidal rule where no limit point is near (r = 1). */
#include "sim/quasistatics/quasistatics.h"

/* Finds r of an increment of that length. */
double limit_point_ratio(const LimitPoint *limit, double taken) {
    return taken < limit->distance ? sqrt(1.0 - taken / limit->distance) : 1.0;
}

/* Locates a limit point by an increment: t0 is `predicted`, t1 is in `step`, u1 - u0 in `trial`;
   where these depart by less than `noticed` from the trapezoidal rule none is in sight. */
void limit_point_locate(
    double *predicted, double taken, double noticed, LimitPoint *limit, const System *s,
    const Workspace *w) {
    double along = 0.0, squares = 0.0, departure = 0.0;
    EACH(i, s->n_dofs) {
        int64_t d = s->dofs[i];
        double bend = w->step[d] - predicted[d];
        double apart = w->trial[d] - 0.5 * (predicted[d] + w->step[d]);
        limit->bend[d] = bend;
        along += bend * apart * square(s->scale[d]);
        squares += square(bend * s->scale[d]), departure += square(apart * s->scale[d]);
    }
    /* u1 - u0 - (t0 + t1) / 2 = q (t1 - t0), q = -(1 - r) / (2 (1 + r)) */
    double q = along / most(squares, 1e-300);
    bool near = sqrt(departure) > noticed && q > -0.5 && q < 0.0;
    limit->ratio = near ? (1.0 + 2.0 * q) / (1.0 - 2.0 * q) : 1.0;
    limit->distance = near ? taken * square(limit->ratio) / (1.0 - square(limit->ratio)) : INFINITY;
}

/* Bends a step along the tangent as the path does on its way to the limit point. */
void limit_point_bend(const LimitPoint *limit, double taken, double *step, const System *s) {
    if (!isfinite(limit->distance)) return;
    /* b (2 (sqrt(d1) - sqrt(d2)) - (d1 - d2) / sqrt(d1)), b = (t1 - t0) / (1/sqrt(d1) - 1/sqrt(d0)) */
    double r = limit->ratio, next = limit_point_ratio(limit, taken);
    double more = square(r * (1.0 - next)) / ((1.0 - square(r)) * (1.0 - r));
    EACH(i, s->n_dofs) step[s->dofs[i]] += more * limit->bend[s->dofs[i]];
}
