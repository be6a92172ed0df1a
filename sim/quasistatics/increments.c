/* Moves along an equilibrium path by one increment: its length, its steps, its departure. */
#include "sim/quasistatics/quasistatics.h"

/* Departure of a smooth increment from the trapezoidal rule at most, over its length and in mm, and
   the part of it by which a limit point is noticed. */
static const double TRAPEZOIDAL = 0.05, TRAPEZOIDAL_FLOOR = 1e-5, NOTICED = 0.01;
/* Newton steps at most by which an increment goes on where the barrier cuts its first step. */
enum { STEPS_AHEAD = 6 };
/* Part of the way to where the eigenvalue is expected to vanish that an increment goes at most: of a
   stiff structure, and of a soft one that no limit point is in sight of, as more would depart too
   far from the trapezoidal rule. */
static const double STIFF_PART = 0.75, SOFT_PART = 0.5;
/* Eigenvalue over the first state's up to which a structure is soft. */
static const double SOFT = 0.5;
/* Failures before one place from which on increments are careful: they go a part of the way to the
   limit point in sight; one that would pass that place goes half of the way to it, or as far as the
   last one did. */
enum { REPEATED = 3 };
static const double LIMIT_PART = 0.75, FAILED_PART = 0.5;

/* Fills `step` with the motion along the path's tangent while the held dofs move by `product`. */
void increments_tangent_step(double *motion, const System *s, const Workspace *w) {
    /* K_ff du_f = -K_fh du_h */
    total_locate(motion, s, &w->kinematics);
    total_hessian_product(motion, s, &w->kinematics, w->product, w->force);
    newton_solve_free(s, w);
    EACH(i, s->n_held) w->step[s->held[i]] = w->product[s->held[i]];
}

/* Fills `product` with a share of the held dofs' displacement to a load. */
void increments_prescribe(
    double *motion, double *load, double share, const System *s, const Workspace *w) {
    memset(w->product, 0, sizeof(double) * s->n_mass);
    EACH(i, s->n_held) w->product[s->held[i]] = (load[i] - motion[s->held[i]]) * share;
}

/* Departure of the increment from `saved` from the trapezoidal rule, fitted to the limit point that
   is in sight, over the one allowed. Locates a limit point behind such a place. */
double increments_trapezoidal_error(
    double *motion, double *predicted, double taken, StepControl *control, const System *s,
    const Workspace *w) {
    memset(w->product, 0, sizeof(double) * s->n_mass);
    EACH(i, s->n_held) w->product[s->held[i]] = motion[s->held[i]] - w->saved[s->held[i]];
    increments_tangent_step(motion, s, w);
    /* u1 - u0 = (t0 + r t1) / (1 + r) */
    LimitPoint *limit = &control->limit;
    double r = limit_point_ratio(limit, taken);
    EACH(d, s->n_mass) w->trial[d] = motion[d] - w->saved[d];
    EACH(d, s->n_mass) w->product[d] = w->trial[d] - (predicted[d] + r * w->step[d]) / (1.0 + r);
    double allowed = most(
        TRAPEZOIDAL * length_of(w->trial, s->dofs, s->n_dofs, s), TRAPEZOIDAL_FLOOR);
    if (control->failures >= REPEATED)
        limit_point_locate(predicted, taken, NOTICED * allowed, limit, s, w);
    return length_of(w->product, s->dofs, s->n_dofs, s) / allowed;
}

/* Length of the next increment: at most `increment`, and what failures and the eigenvalue allow. */
double increments_next(
    double increment, double done, double stroke, const double *progress,
    const StepControl *control) {
    double next = least(increment, 1.0 - done);
    if (control->failures >= REPEATED) {
        next = least(next, most(LIMIT_PART * control->limit.distance, SMALLEST_INCREMENT));
        double careful = most(control->length, FAILED_PART * (control->failed_at - done));
        if (done + next >= control->failed_at)
            next = least(next, most(careful, SMALLEST_INCREMENT));
    }
    if (progress[RATE] >= 0.0) return next;
    /* lambda^2 falls linearly towards a limit point, and faster than that towards a branching */
    double expected = square(progress[VALUE]) / (-progress[RATE] * stroke);
    bool blind = progress[VALUE] < SOFT * progress[FIRST] && !isfinite(control->limit.distance);
    double part = blind ? SOFT_PART : STIFF_PART;
    return least(next, most(part * expected, SMALLEST_INCREMENT));
}

/* Fills `step` with a Newton step of the free dofs while the held ones move by `product`. */
static void newton_step_ahead(double *motion, const System *s, const Workspace *w) {
    /* K_ff du_f = -(r_f + K_fh du_h) */
    double energy[2];
    total_gradient(motion, s, &w->kinematics, w->force, energy);
    copy(w->trial, w->force, s->n_mass);
    total_hessian_product(motion, s, &w->kinematics, w->product, w->force);
    EACH(i, s->n_dofs) w->force[s->dofs[i]] += w->trial[s->dofs[i]];
    newton_solve_free(s, w);
    EACH(i, s->n_held) w->step[s->held[i]] = w->product[s->held[i]];
}

/* Predictor of an increment: moves along the tangent by a share of the way to a load, short of the
   barrier; where that cuts it, Newton steps go on. Returns the part of the share taken. */
double increments_predict(
    double *motion, double *load, double share, double requested, const LimitPoint *limit,
    double *predicted, const System *s, const Workspace *w, int64_t *counts) {
    copy(w->saved, motion, s->n_mass);
    increments_prescribe(motion, load, share, s, w);
    increments_tangent_step(motion, s, w);
    copy(predicted, w->step, s->n_mass);
    limit_point_bend(limit, requested, w->step, s);
    double taken = least(1.0, KEEP_FROM_BARRIER * total_admissible_step(motion, s, w->step));
    EACH(d, s->n_mass) motion[d] += taken * w->step[d];
    EACH(tries, STEPS_AHEAD) {
        if (taken == 1.0 || !newton_factorise_tangent(motion, s, w, 0.0, counts)) break;
        increments_prescribe(motion, load, share * (1.0 - taken) / (1.0 - share * taken), s, w);
        newton_step_ahead(motion, s, w);
        double allowed = least(1.0, KEEP_FROM_BARRIER * total_admissible_step(motion, s, w->step));
        EACH(d, s->n_mass) motion[d] += allowed * w->step[d];
        taken = allowed == 1.0 ? 1.0 : taken + allowed * (1.0 - taken);
    }
    EACH(d, s->n_mass) predicted[d] *= taken;
    if (taken == 1.0 && share == 1.0) EACH(i, s->n_held) motion[s->held[i]] = load[i];
    return taken;
}
