/* Leaves a limit point or a branching as damped motion does.

   Where a stable path ends the structure snaps: held as it is there, it moves without inertia
   against its viscous damping, C dq/dt = -dE/dq, until it comes to rest. That rest depends on the
   critical point alone, not on the loads by which the path came to it. */
#include "sim/quasistatics/quasistatics.h"

/* Local error of a step of the damped motion, mm. */
static const double FLOW_ERROR = 3e-3;
/* Newton step below which the damped motion ends in the minimum that the step leads to, mm. */
static const double AT_REST = 0.02;
/* Factor of that limit after a step that led to no minimum. */
static const double CLOSER = 0.5;
/* Speed at which rest is looked for, over the fastest since it was last, and the number of steps
   after which it is anyway. */
static const double SLOWER = 0.5;
enum { PATIENCE = 10 };
/* First step of the damped motion, times the drag over the median axial stiffness. */
static const double FIRST_STEP = 1.0;
/* Limit of the next step over the last, the factor by which that comes back after 1 at a rejection,
   and the factor on a rejected step at most: while the structure leaves a critical point, the
   longest step for which the system is positive definite shrinks. */
static const double LONGER = 25.0, LONGER_AGAIN = 1.5, TOO_LONG = 0.5;
enum { MAX_STEPS = 5000 };
/* Largest movement by which a critical point is left along its mode, mm. */
static const double PUSH = 1e-2;

/* Smallest eigenvalue of K v = lambda S^2 v by inverse iteration from an estimate of S v. */
double snap_lowest_mode(
    const System *s, const Workspace *w, double *mode, int sweeps, double tolerance) {
    double value = INFINITY;
    EACH(sweep, sweeps) {
        EACH(i, s->n_dofs) w->right[i] = mode[i] * s->scale[s->dofs[i]];
        symmetric_solve(&w->matrix, w->right);
        double along = 0.0, squares = 0.0;
        EACH(i, s->n_dofs) {
            w->right[i] *= s->scale[s->dofs[i]];
            along += w->right[i] * mode[i];
            squares += square(w->right[i]);
        }
        double before = value, norm = sqrt(squares);
        value = along / squares;  /* the Rayleigh quotient of K */
        EACH(i, s->n_dofs) mode[i] = w->right[i] / norm;
        if (fabs(before - value) <= tolerance * fabs(value)) break;
    }
    return value;
}

void snap_push(double *motion, double *mode, double sense, const System *s, const Workspace *w) {
    double largest = 0.0;
    EACH(i, s->n_dofs) largest = most(largest, fabs(mode[i]));
    memset(w->step, 0, sizeof(double) * s->n_mass);
    EACH(i, s->n_dofs) {
        int64_t d = s->dofs[i];
        w->step[d] = sense * PUSH * mode[i] / (largest * s->scale[d]);
    }
    double allowed = KEEP_FROM_BARRIER * total_admissible_step(motion, s, w->step);
    allowed = least(1.0, allowed);
    EACH(d, s->n_mass) motion[d] += allowed * w->step[d];
}

static double largest_of(double *step, const System *s) {
    double largest = 0.0;
    EACH(i, s->n_dofs) largest = most(largest, fabs(step[s->dofs[i]]) * s->scale[s->dofs[i]]);
    return largest;
}

/* Solves (K + 2 C / h) u = -g + share C / h v, with g in `force`, v in `guess` and u in `step`. */
static void solve_stage(double share, double *drag, double h, const System *s, const Workspace *w) {
    EACH(i, s->n_dofs) {
        int64_t d = s->dofs[i];
        w->force[d] -= share * drag[d] / h * w->guess[d];
    }
    newton_solve_free(s, w);
}

/* Finds the gradient beyond `product` in `force`; false if the barrier is in the way. */
static bool look_ahead(double *motion, const System *s, const Workspace *w) {
    double energy[2];
    if (KEEP_FROM_BARRIER * total_admissible_step(motion, s, w->product) < 1.0) return false;
    EACH(d, s->n_mass) w->trial[d] = motion[d] + w->product[d];
    total_gradient(w->trial, s, &w->kinematics, w->force, energy);
    return true;
}

/* Fills `product` with a step of the damped motion by RODAS3, `guess` with its difference from
   second order (Sandu et al., Atmospheric Environment 31, 3459, 1997). */
static bool rodas3(
    double *motion, double *drag, double h, const System *s, const Workspace *w, int64_t *counts) {
    double energy[2];
    counts[FACTORS]++;
    total_gradient(motion, s, &w->kinematics, w->force, energy);
    symmetric_clear(&w->matrix);
    total_tangent(motion, s, &w->kinematics, &w->matrix);
    EACH(i, s->n_dofs) symmetric_add(&w->matrix, i, i, 2.0 * drag[s->dofs[i]] / h);
    if (!symmetric_factorise(&w->matrix)) return false;
    /* (K + 2 C / h) u1 = -g(q) */
    newton_solve_free(s, w);
    EACH(d, s->n_mass) w->product[d] = 2.0 * w->step[d];
    copy(w->guess, w->step, s->n_mass);
    /* (K + 2 C / h) u2 = -g(q) + 4 C / h u1 */
    solve_stage(4.0, drag, h, s, w);
    EACH(d, s->n_mass) w->guess[d] -= w->step[d];
    /* (K + 2 C / h) u3 = -g(q + 2 u1) + C / h (u1 - u2) */
    if (!look_ahead(motion, s, w)) return false;
    solve_stage(1.0, drag, h, s, w);
    EACH(d, s->n_mass) w->product[d] += w->step[d];
    EACH(d, s->n_mass) w->guess[d] -= 8.0 / 3.0 * w->step[d];
    /* (K + 2 C / h) u4 = -g(q + 2 u1 + u3) + C / h (u1 - u2 - 8/3 u3) */
    if (!look_ahead(motion, s, w)) return false;
    solve_stage(1.0, drag, h, s, w);
    EACH(d, s->n_mass) w->product[d] += w->step[d];
    copy(w->guess, w->step, s->n_mass);
    return true;
}

/* Follows the damped motion at fixed held dofs to its rest, a minimum. */
bool snap_follow_to_rest(
    double *motion, const Tolerance *t, const System *s, const Workspace *w, int64_t *counts) {
    double *drag = t->drag;
    double h = INFINITY, energy[2];
    EACH(i, s->n_dofs) h = least(h, drag[s->dofs[i]]);
    h = FIRST_STEP * h / newton_median_stiffness(s);
    double near = AT_REST, fastest = 0.0, growth = LONGER;
    int steps = 0;
    EACH(tries, MAX_STEPS) {
        if (has_new_pairs(&s->contacts)) return false;  /* no step is short enough */
        if (!rodas3(motion, drag, h, s, w, counts)) {
            h *= TOO_LONG;
            growth = 1.0;
            continue;
        }
        double error = largest_of(w->guess, s), moved = largest_of(w->product, s);
        double allowed = KEEP_FROM_BARRIER * total_admissible_step(motion, s, w->product);
        double longer = 0.8 * cbrt(FLOW_ERROR / most(error, 1e-300));
        if (error > FLOW_ERROR || allowed < 1.0) {
            h *= least(TOO_LONG, most(0.2, longer));
            growth = 1.0;
            continue;
        }
        double speed = moved / h;
        h *= least(growth, longer);
        growth = least(LONGER, LONGER_AGAIN * growth);
        EACH(d, s->n_mass) motion[d] += w->product[d];
        steps++;
        fastest = most(fastest, speed);
        if (moved >= AT_REST || (speed > SLOWER * fastest && steps < PATIENCE)) continue;
        fastest = speed, steps = 0;
        total_gradient(motion, s, &w->kinematics, w->force, energy);
        if (newton_factorise_tangent(motion, s, w, 0.0, counts)) {
            newton_solve_free(s, w);
            if (largest_of(w->step, s) < near) {
                /* just beyond a limit point the motion is as slow as at rest */
                copy(w->guess, motion, s->n_mass);
                if (newton_correct(motion, t, false, s, w, counts))
                    return newton_factorise_tangent(motion, s, w, 0.0, counts);
                copy(motion, w->guess, s->n_mass);
                near *= CLOSER;
            }
        }
    }
    return false;
}

bool snap_relax(
    double *motion, double *drag, double relative, double absolute, const System *system,
    const Workspace *work, int64_t *counts) {
    Tolerance tolerance = {relative, absolute, drag};
    return snap_follow_to_rest(motion, &tolerance, system, work, counts);
}
