/* Follows equilibrium paths by Newton continuation, with their exact adjoint.

   Between two output loads the increment adapts itself. An increment is smooth if no tangent on the
   way or at its end was indefinite and the motion is that of the trapezoidal rule; one that is not
   is cut, and none is longer than the smallest eigenvalue of the tangent and the growth of its steps
   let expect, so that the path is followed up to where it ends: a limit point or a branching. From
   there it goes on in the state that damped motion comes to, and the critical point is recorded. */
#include "sim/quasistatics/quasistatics.h"

#include <stdlib.h>

/* Part of the way that the end of a path is passed by. */
static const double CLOSE = 1e-6;
/* Limits of the next increment over the last. */
static const double SHORTER = 0.25, LONGER = 4.0;
/* Increment with which a path goes on after a snap, of the way to the load. */
static const double RESTART = 1e-3;
/* Correction of a known step at most, over its length. */
static const double SHORT = 0.2;
/* Eigenvalue over the first state's up to which a path has ended: beyond, the residual's tolerance
   does not fix the critical mode. */
static const double SINGULAR = 1e-6;
/* Inverse iterations for the eigenvalue of an increment. */
enum { SWEEPS = 2 };
/* Length of numbers without symmetry that are added to the last mode at an output load. */
static const double SCATTER = 0.5;

static bool settle(double *motion, const Tolerance *t, const System *s, const Workspace *w, int64_t *counts) {
    return newton_correct(motion, t, false, s, w, counts) && newton_factorise_tangent(motion, s, w, 0.0, counts);
}

static void note(double *snaps, double place) {
    EACH(i, MOST_SNAPS) if (isnan(snaps[i])) {
        snaps[i] = place;
        break;
    }
}

static Outlook clear(double *bend) { return (Outlook){INFINITY, 0, 0.0, {INFINITY, 1.0, bend}}; }

static void fail(Outlook *outlook, double place) {
    outlook->wall = place, outlook->limit.distance = INFINITY;
    outlook->failures++;
}

static void pass(Outlook *outlook, double place, double gone) {
    outlook->length = gone;
    if (place < outlook->wall) return;
    outlook->wall = outlook->limit.distance = INFINITY;
    outlook->failures = 0;
}

typedef struct { double done, ended; int kind; } Advance;

/* Follows the path to one load; the workspace holds a factor of the tangent before and after. */
static Advance advance(
    double *motion, double *load, int64_t number, bool leaves, double sense, double *pace, double *mode,
    double *predicted, double *bend, const Tolerance *t, const System *s, const Workspace *w, double *snaps,
    int64_t *counts) {
    increments_aim(motion, load, 1.0, s, w);
    double way = length_of(w->product, s->held, s->n_held, s);
    Advance a = {0.0, NAN, SMOOTH};
    Outlook outlook = clear(bend);
    while (a.done < 1.0 && !has_new_pairs(&s->contacts)) {
        counts[INCREMENTS]++;
        double ahead = increments_next(pace[INCREMENT], a.done, way, pace, &outlook);
        double share = ahead / (1.0 - a.done);
        double gone = ahead * increments_step_ahead(
            motion, load, share, ahead, &outlook.limit, predicted, s, w, counts);
        if (!(gone >= least(SMALLEST_INCREMENT, ahead))) {
            copy(motion, w->saved, s->n_mass);  /* held units drive a void into its barrier */
            break;
        }
        bool last = share == 1.0 && gone == ahead;
        bool smooth = settle(motion, t, s, w, counts);
        double crooked = INFINITY;
        if (smooth) crooked = increments_crookedness(motion, predicted, gone, &outlook, s, w);
        double change = least(LONGER, most(SHORTER, 0.9 / sqrt(most(crooked, 1e-300))));
        if (crooked <= 1.0) {
            a.done = last ? 1.0 : a.done + gone;
            pass(&outlook, a.done, gone);
            double value = snap_lowest_mode(s, w, mode, SWEEPS, 0.0);
            pace[RATE] = (square(value) - square(pace[VALUE])) / most(gone * way, 1e-300);
            pace[VALUE] = value;
            pace[INCREMENT] = least(1.0, most(last ? pace[INCREMENT] : CLOSE, change * gone));
            if (value > SINGULAR * pace[FIRST] || a.done == 1.0) continue;
        } else {
            copy(motion, w->saved, s->n_mass);
            fail(&outlook, a.done + gone);
            pace[INCREMENT] = least(change, 0.9) * gone;
            if (newton_factorise_shifted(motion, s, w, counts) < 0.0) break;
            if (pace[INCREMENT] >= SMALLEST_INCREMENT) continue;
        }
        if (!leaves) {
            note(snaps, number + a.done);
            a.kind = LIMIT_POINT, a.ended = a.done;
            return a;
        }
        int end;
        double beyond = least(1.0, CLOSE / (1.0 - a.done));
        share = path_ends_leave(motion, load, beyond, mode, sense, pace[FIRST], t, s, w, counts, &end);
        if (share < 0.0) break;
        if (end != SMOOTH) {
            if (a.kind == SMOOTH) a.kind = end;
            a.ended = a.done;
            note(snaps, number + a.done);
        }
        a.done = share == 1.0 ? 1.0 : a.done + share * (1.0 - a.done);
        outlook = clear(bend);
        pace[INCREMENT] = RESTART, pace[RATE] = 0.0;
        pace[VALUE] = snap_lowest_mode(s, w, mode, SWEEPS, 0.0);
    }
    return a;
}

/* Goes to a load by a step known from a similar structure; false if that is not smooth. */
static bool repeat(
    double *motion, double *load, double *step, const Tolerance *t, const System *s,
    const Workspace *w, int64_t *counts) {
    copy(w->saved, motion, s->n_mass);
    if (KEEP_FROM_BARRIER * total_admissible_step(motion, s, step) < 1.0) return false;
    EACH(d, s->n_mass) motion[d] += step[d];
    EACH(i, s->n_held) motion[s->held[i]] = load[i];
    copy(w->guess, motion, s->n_mass);
    bool smooth = settle(motion, t, s, w, counts);
    EACH(d, s->n_mass) w->guess[d] = motion[d] - w->guess[d];
    double limit = SHORT * length_of(step, s->dofs, s->n_dofs, s);
    if (!(smooth && length_of(w->guess, s->dofs, s->n_dofs, s) <= limit)) {
        copy(motion, w->saved, s->n_mass);
        newton_factorise_shifted(motion, s, w, counts);
        return false;
    }
    return true;
}

/* Begins a path in the unloaded structure, or goes on from the last of `known` loads; returns the
   smallest eigenvalue there, negative if there is no equilibrium. */
static double begin(
    double *motion, double *mode, double sense, int64_t known, double *pace, const Branch *branch,
    const Tolerance *t, const System *s, const Workspace *w, int64_t *counts) {
    if (known > 0) {
        copy(motion, branch->states + (known - 1) * s->n_mass, s->n_mass);
        newton_factorise_tangent(motion, s, w, 0.0, counts);
        path_ends_scatter(mode, s->n_dofs);
        return pace[VALUE] = snap_lowest_mode(s, w, mode, SWEEPS_AT_LOADS, EIGENVALUE);
    }
    int end;
    double first = path_ends_come_to_rest(motion, mode, sense, t, s, w, counts, &end);
    if (first < 0.0) return first;
    if (end != SMOOTH) branch->jumped[0] = end, branch->snapped[0] = branch->snaps[0] = 0.0;
    return pace[VALUE] = pace[FIRST] = first;
}

void equilibrium_path_follow(
    double *loads, int64_t known, double *pace, double *bends, int64_t *trusted, bool leaves,
    double sense, const System *s, const Workspace *w, double relative, double absolute,
    double *drag, const Branch *branch, int64_t *counts, int64_t n_loads, double *returned) {
    Tolerance tolerance = {relative, absolute, drag}, *t = &tolerance;
    int64_t n = s->n_mass, p = known;
    double *motion = calloc(3 * n + s->n_dofs, sizeof(double));
    double *step = motion + n, *bend = step + n, *mode = bend + n;
    returned[0] = returned[1] = 0.0;
    if (begin(motion, mode, sense, known, pace, branch, t, s, w, counts) < 0.0 && known == 0) {
        free(motion);
        return;
    }
    pace[INCREMENT] = 1.0, pace[RATE] = 0.0;
    for (; p < n_loads; p++) {
        double *load = loads + p * s->n_held, done = 0.0;
        increments_aim(motion, load, 1.0, s, w);
        increments_tangent_step(motion, s, w);
        copy(branch->tangents + p * n, w->step, n);
        if (trusted[p]) {
            EACH(d, n) step[d] = w->step[d] + bends[p * n + d];
            if (repeat(motion, load, step, t, s, w, counts)) done = 1.0, pace[RATE] = 0.0;
        }
        if (done < 1.0) {
            Advance a = advance(
                motion, load, p, leaves, sense, pace, mode, step, bend, t, s, w, branch->snaps, counts);
            done = a.done;
            if (branch->jumped[p] == SMOOTH) branch->jumped[p] = a.kind;
            /* that of coming to rest stays where the way is smooth */
            if (!isnan(a.ended)) branch->snapped[p] = a.ended;
        }
        copy(branch->states + p * n, motion, n);
        if (done < 1.0 || has_new_pairs(&s->contacts)) {
            returned[1] = done;
            break;
        }
        /* of a symmetric structure the last mode has nothing of one that has crossed it */
        double share = SCATTER / sqrt(s->n_dofs);
        EACH(i, s->n_dofs) mode[i] += share * sin(1.0 + i);
        pace[VALUE] = snap_lowest_mode(s, w, mode, SWEEPS_AT_LOADS, EIGENVALUE);
        branch->eigenvalue[p] = pace[VALUE], branch->stable[p] = 1;
    }
    returned[0] = p;
    free(motion);
}

int64_t equilibrium_path_adjoint(
    double *states, double *bar, const System *s, const Workspace *w, int64_t *which,
    const Bars *bars, int64_t n_states, int64_t n_which) {
    int64_t counts[4] = {0};
    EACH(p, n_states) {
        double *state = states + p * s->n_mass, largest = 0.0;
        EACH(d, s->n_mass) largest = most(largest, fabs(bar[p * s->n_mass + d]));
        if (largest == 0.0) continue;
        if (!newton_factorise_tangent(state, s, w, 0.0, counts)) return p;
        copy(w->force, bar + p * s->n_mass, s->n_mass);
        newton_solve_free(s, w);
        total_mixed(state, s, &w->kinematics, w->step, which, &bars->sensitivity, n_which);
        total_hessian_product(state, s, &w->kinematics, w->step, w->product);
        EACH(i, s->n_held) bars->drive[p * s->n_held + i] += w->product[s->held[i]];
    }
    return -1;
}
