/* Moves along an equilibrium path by one increment: its length, its steps, its departure. */
#include "sim/quasistatics/quasistatics.h"

/* Departure of a smooth increment from the trapezoidal rule at most, over its length and in mm. */
static const double CROOKED = 0.05, CROOKED_LENGTH = 1e-5;
/* Newton steps at most by which an increment goes on where the barrier cuts its first step. */
enum { STEPS_AHEAD = 6 };
/* Part of the way to where the eigenvalue is expected to vanish that an increment goes at most: of a
   stiff structure, and of a soft one, as more of the path to a limit point is too crooked. */
static const double STIFF_PART = 0.75, SOFT_PART = 0.5;
/* Eigenvalue over the first state's up to which a structure is soft. */
static const double SOFT = 0.5;

void increments_tangent_step(double *motion, const System *s, const Workspace *w) {
    /* K_ff du_f = -K_fh du_h */
    total_locate(motion, s, &w->kinematics);
    total_hessian_product(motion, s, &w->kinematics, w->product, w->force);
    newton_solve_free(s, w);
    EACH(i, s->n_held) w->step[s->held[i]] = w->product[s->held[i]];
}

void increments_aim(double *motion, double *load, double share, const System *s, const Workspace *w) {
    memset(w->product, 0, sizeof(double) * s->n_mass);
    EACH(i, s->n_held) w->product[s->held[i]] = (load[i] - motion[s->held[i]]) * share;
}

/* Compares the way from `saved` with the trapezoidal rule; 1 is the most there may be. */
double increments_crookedness(double *motion, double *predicted, const System *s, const Workspace *w) {
    memset(w->product, 0, sizeof(double) * s->n_mass);
    EACH(i, s->n_held) w->product[s->held[i]] = motion[s->held[i]] - w->saved[s->held[i]];
    increments_tangent_step(motion, s, w);
    /* u1 - u0 = (t0 + t1) / 2 */
    EACH(d, s->n_mass) w->trial[d] = motion[d] - w->saved[d];
    EACH(d, s->n_mass) w->product[d] = w->trial[d] - 0.5 * (predicted[d] + w->step[d]);
    double limit = most(CROOKED * length_of(w->trial, s->dofs, s->n_dofs, s), CROOKED_LENGTH);
    return length_of(w->product, s->dofs, s->n_dofs, s) / limit;
}

double increments_next(double increment, double left, double way, const double *pace) {
    if (pace[RATE] >= 0.0) return least(increment, left);
    /* lambda^2 falls linearly towards a limit point, and faster than that towards a branching */
    double expected = square(pace[VALUE]) / (-pace[RATE] * way);
    double part = pace[VALUE] < SOFT * pace[FIRST] ? SOFT_PART : STIFF_PART;
    return least(least(increment, left), most(part * expected, SMALLEST_INCREMENT));
}

static void newton_ahead(double *motion, const System *s, const Workspace *w) {
    /* K_ff du_f = -(r_f + K_fh du_h) */
    double energy[2];
    total_gradient(motion, s, &w->kinematics, w->force, energy);
    copy(w->trial, w->force, s->n_mass);
    total_hessian_product(motion, s, &w->kinematics, w->product, w->force);
    EACH(i, s->n_dofs) w->force[s->dofs[i]] += w->trial[s->dofs[i]];
    newton_solve_free(s, w);
    EACH(i, s->n_held) w->step[s->held[i]] = w->product[s->held[i]];
}

/* Moves by a share of the way to a load short of the barrier; returns the part of it gone. */
double increments_step_ahead(
    double *motion, double *load, double share, double *predicted, const System *s,
    const Workspace *w, int64_t *counts) {
    copy(w->saved, motion, s->n_mass);
    increments_aim(motion, load, share, s, w);
    increments_tangent_step(motion, s, w);
    copy(predicted, w->step, s->n_mass);
    double gone = least(1.0, KEEP_FROM_BARRIER * total_admissible_step(motion, s, w->step));
    EACH(d, s->n_mass) motion[d] += gone * w->step[d];
    EACH(tries, STEPS_AHEAD) {
        if (gone == 1.0 || !newton_factorise_tangent(motion, s, w, 0.0, counts)) break;
        increments_aim(motion, load, share * (1.0 - gone) / (1.0 - share * gone), s, w);
        newton_ahead(motion, s, w);
        double allowed = least(1.0, KEEP_FROM_BARRIER * total_admissible_step(motion, s, w->step));
        EACH(d, s->n_mass) motion[d] += allowed * w->step[d];
        gone = allowed == 1.0 ? 1.0 : gone + allowed * (1.0 - gone);
    }
    EACH(d, s->n_mass) predicted[d] *= gone;
    if (gone == 1.0 && share == 1.0) EACH(i, s->n_held) motion[s->held[i]] = load[i];
    return gone;
}
