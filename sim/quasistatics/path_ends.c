/* Finds where a path begins, and how it goes on where it ends: by damped motion to rest. */
#include "sim/quasistatics/quasistatics.h"

#include <stdlib.h>

/* Eigenvalue at the end of a path below which it is singular there, over the first state's. */
static const double CRITICAL = 1e-3;
/* Share of the load that acts on a critical mode up to which it does not: there the path branches,
   elsewhere it turns back in a limit point. */
static const double UNLOADED = 1e-7;
/* Movement at the end of a path that is a jump, mm. */
static const double NOTICEABLE = 1e-2;
/* Displacement of the held dofs by which a branching is passed, mm: nearer to it no state is stable
   enough to be found. */
static const double BEYOND = 1e-3;

/* Makes fixed numbers without symmetry, the estimate of a mode. */
void path_ends_scatter(double *x, int64_t n) { EACH(i, n) x[i] = sin(1.0 + i); }

/* Goes on from the end of a path by damped motion; returns the part taken, negative without rest. */
double path_ends_leave(
    double *motion, double *load, double overshoot, double *mode, double sense, double first,
    const Tolerance *t, const System *s, const Workspace *w, int64_t *counts, int *end) {
    *end = LIMIT_POINT;
    copy(w->saved, motion, s->n_mass);
    path_ends_scatter(mode, s->n_dofs);
    double value = snap_lowest_mode(s, w, mode, SWEEPS_AT_LOADS, EIGENVALUE);
    increments_prescribe(motion, load, 1.0, s, w);
    double stroke = length_of(w->product, s->held, s->n_held, s);
    total_locate(motion, s, &w->kinematics);
    total_hessian_product(motion, s, &w->kinematics, w->product, w->force);
    double along = critical_modes_load(mode, s, w), force = 0.0;
    EACH(i, s->n_dofs) force += square(w->force[s->dofs[i]] / s->scale[s->dofs[i]]);
    double unloaded = UNLOADED * sqrt(force);
    bool branches = fabs(along) <= unloaded;
    if (branches) {
        if (isfinite(first)) critical_modes_mix(mode, CRITICAL * first, unloaded, s, w);
        along = sense;
        overshoot = most(overshoot, least(1.0, BEYOND / most(stroke, BEYOND)));
    }
    EACH(i, s->n_held) {
        int64_t d = s->held[i];
        motion[d] = overshoot == 1.0 ? load[i] : motion[d] + overshoot * (load[i] - motion[d]);
    }
    snap_push(motion, mode, along > 0.0 ? 1.0 : along < 0.0 ? -1.0 : along, s, w);
    if (!snap_follow_to_rest(motion, t, s, w, counts)) return -1.0;
    EACH(d, s->n_mass) w->trial[d] = motion[d] - w->saved[d];
    if (branches && fabs(value) < CRITICAL * first)
        *end = BRANCHING;
    else if (!(length_of(w->trial, s->dofs, s->n_dofs, s) > NOTICEABLE))
        *end = SMOOTH;
    return overshoot;
}

/* Moves the unloaded structure to its equilibrium; returns the smallest eigenvalue there, or -1. */
double path_ends_come_to_rest(
    double *motion, double *mode, double sense, const Tolerance *t, const System *s,
    const Workspace *w, int64_t *counts, int *end) {
    path_ends_scatter(mode, s->n_dofs);
    *end = SMOOTH;
    if (!newton_correct(motion, t, true, s, w, counts)) return -1.0;
    if (!newton_factorise_tangent(motion, s, w, 0.0, counts)) {
        newton_factorise_shifted(motion, s, w, counts);
        double *load = malloc(sizeof(double) * s->n_held);
        EACH(i, s->n_held) load[i] = motion[s->held[i]];
        double share = path_ends_leave(motion, load, 0.0, mode, sense, INFINITY, t, s, w, counts, end);
        free(load);
        if (share < 0.0) return -1.0;
    }
    return snap_lowest_mode(s, w, mode, SWEEPS_AT_LOADS, EIGENVALUE);
}
