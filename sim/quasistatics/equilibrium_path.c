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

/* A path as it is followed. */
typedef struct {
    double *motion;    /* (n_dofs,) the last equilibrium */
    double *mode;      /* (n_free,) estimate of the tangent's lowest mode there */
    double *predicted; /* (n_dofs,) step along the tangent at the start of an increment */
    double *progress;  /* (4,) see quasistatics.h */
    StepControl control;
    double stroke;     /* of the held dofs from the last load to the next, mm */
    double *load;      /* (n_held,) the next one */
    bool leaves;       /* goes on by a snap where the path ends */
    double sense;      /* in which the mode of a branching is followed */
    const Tolerance *t;
    const System *s;
    const Workspace *w;
    int64_t *counts;
} Path;

/* Part of the way to a load that is done and at which the path last ended, and how it went on. */
typedef struct { double done, ended; int kind; } Advance;

/* What an increment comes to: the path goes on, ends, or cannot be followed. */
typedef enum { GOES_ON, ENDS, STUCK } Outcome;

/* Corrects a predicted state and factorises the tangent there; false if that is indefinite. */
static bool correct_and_factorise(Path *path) {
    return newton_correct(path->motion, path->t, false, path->s, path->w, path->counts)
           && newton_factorise_tangent(path->motion, path->s, path->w, 0.0, path->counts);
}

static double lowest_eigenvalue(Path *path) {
    return snap_lowest_mode(path->s, path->w, path->mode, SWEEPS, 0.0);
}

/* Adds the place of a snap to those recorded before. */
static void record_snap(double *snaps, double place) {
    EACH(i, MOST_SNAPS) if (isnan(snaps[i])) {
        snaps[i] = place;
        break;
    }
}

static void reset(StepControl *control) {
    *control = (StepControl){INFINITY, 0, 0.0, {INFINITY, 1.0, control->limit.bend}};
}

static void record_failure(StepControl *control, double place) {
    control->failed_at = place, control->limit.distance = INFINITY;
    control->failures++;
}

static void record_success(StepControl *control, double place, double taken) {
    control->length = taken;
    if (place < control->failed_at) return;
    control->failed_at = control->limit.distance = INFINITY;
    control->failures = 0;
}

/* Keeps an increment that is smooth; the path ends where its tangent is singular. */
static Outcome accept(Path *path, double taken, double change, bool last, double done) {
    double *progress = path->progress;
    record_success(&path->control, done, taken);
    double value = lowest_eigenvalue(path);
    progress[RATE] = (square(value) - square(progress[VALUE])) / most(taken * path->stroke, 1e-300);
    progress[VALUE] = value;
    progress[INCREMENT] = least(1.0, most(last ? progress[INCREMENT] : CLOSE, change * taken));
    return value > SINGULAR * progress[FIRST] || done == 1.0 ? GOES_ON : ENDS;
}

/* Takes an increment back and shortens the next; the path ends where none is short enough. */
static Outcome reject(Path *path, double taken, double change, double done) {
    copy(path->motion, path->w->saved, path->s->n_mass);
    record_failure(&path->control, done + taken);
    path->progress[INCREMENT] = least(change, 0.9) * taken;
    if (newton_factorise_shifted(path->motion, path->s, path->w, path->counts) < 0.0) return STUCK;
    return path->progress[INCREMENT] >= SMALLEST_INCREMENT ? GOES_ON : ENDS;
}

/* Predicts and corrects one increment from the part of the way that is done. */
static Outcome increment(Path *path, double *done) {
    const System *s = path->s;
    double *motion = path->motion;
    path->counts[INCREMENTS]++;
    double requested = increments_next(
        path->progress[INCREMENT], *done, path->stroke, path->progress, &path->control);
    double share = requested / (1.0 - *done);
    double taken = requested * increments_predict(
        motion, path->load, share, requested, &path->control.limit, path->predicted, s, path->w,
        path->counts);
    if (!(taken >= least(SMALLEST_INCREMENT, requested))) {
        copy(motion, path->w->saved, s->n_mass);  /* held units drive a void into its barrier */
        return STUCK;
    }
    bool last = share == 1.0 && taken == requested;
    double error = INFINITY;
    if (correct_and_factorise(path))
        error = increments_trapezoidal_error(
            motion, path->predicted, taken, &path->control, s, path->w);
    double change = least(LONGER, most(SHORTER, 0.9 / sqrt(most(error, 1e-300))));
    if (!(error <= 1.0)) return reject(path, taken, change, *done);
    *done = last ? 1.0 : *done + taken;
    return accept(path, taken, change, last, *done);
}

/* Goes on from the end of the path by damped motion; false if that comes to no rest. */
static bool leave_critical_point(Path *path, int64_t number, Advance *a, double *snaps) {
    int end;
    double beyond = least(1.0, CLOSE / (1.0 - a->done));
    double share = path_ends_leave(
        path->motion, path->load, beyond, path->mode, path->sense, path->progress[FIRST], path->t,
        path->s, path->w, path->counts, &end);
    if (share < 0.0) return false;
    if (end != SMOOTH) {
        if (a->kind == SMOOTH) a->kind = end;
        a->ended = a->done;
        record_snap(snaps, number + a->done);
    }
    a->done = share == 1.0 ? 1.0 : a->done + share * (1.0 - a->done);
    reset(&path->control);
    path->progress[INCREMENT] = RESTART, path->progress[RATE] = 0.0;
    path->progress[VALUE] = lowest_eigenvalue(path);
    return true;
}

/* Follows the path to the next load; the workspace has a factor of the tangent before and after. */
static Advance advance(Path *path, int64_t number, double *snaps) {
    increments_prescribe(path->motion, path->load, 1.0, path->s, path->w);
    path->stroke = length_of(path->w->product, path->s->held, path->s->n_held, path->s);
    Advance a = {0.0, NAN, SMOOTH};
    reset(&path->control);
    while (a.done < 1.0 && !has_new_pairs(&path->s->contacts)) {
        Outcome outcome = increment(path, &a.done);
        if (outcome == STUCK) break;
        if (outcome == GOES_ON) continue;
        if (!path->leaves) {
            record_snap(snaps, number + a.done);
            a.kind = LIMIT_POINT, a.ended = a.done;
            return a;
        }
        if (!leave_critical_point(path, number, &a, snaps)) break;
    }
    return a;
}

/* Goes to the next load by a step known from a similar structure; false if that is not smooth. */
static bool try_known_step(Path *path, double *step) {
    const System *s = path->s;
    const Workspace *w = path->w;
    double *motion = path->motion;
    copy(w->saved, motion, s->n_mass);
    if (KEEP_FROM_BARRIER * total_admissible_step(motion, s, step) < 1.0) return false;
    EACH(d, s->n_mass) motion[d] += step[d];
    EACH(i, s->n_held) motion[s->held[i]] = path->load[i];
    copy(w->guess, motion, s->n_mass);
    bool smooth = correct_and_factorise(path);
    EACH(d, s->n_mass) w->guess[d] = motion[d] - w->guess[d];
    double limit = SHORT * length_of(step, s->dofs, s->n_dofs, s);
    if (!(smooth && length_of(w->guess, s->dofs, s->n_dofs, s) <= limit)) {
        copy(motion, w->saved, s->n_mass);
        newton_factorise_shifted(motion, s, w, path->counts);
        return false;
    }
    return true;
}

/* Begins a path in the unloaded structure, or goes on from the last of `known` loads; returns the
   smallest eigenvalue there, negative if there is no equilibrium. */
static double begin(Path *path, int64_t known, const Branch *branch) {
    const System *s = path->s;
    const Workspace *w = path->w;
    double *progress = path->progress;
    if (known > 0) {
        copy(path->motion, branch->states + (known - 1) * s->n_mass, s->n_mass);
        newton_factorise_tangent(path->motion, s, w, 0.0, path->counts);
        path_ends_scatter(path->mode, s->n_dofs);
        return progress[VALUE] = snap_lowest_mode(s, w, path->mode, SWEEPS_AT_LOADS, EIGENVALUE);
    }
    int end;
    double first = path_ends_come_to_rest(
        path->motion, path->mode, path->sense, path->t, s, w, path->counts, &end);
    if (first < 0.0) return first;
    if (end != SMOOTH) branch->jumped[0] = end, branch->snapped[0] = branch->snaps[0] = 0.0;
    return progress[VALUE] = progress[FIRST] = first;
}

void equilibrium_path_follow(
    double *loads, int64_t known, double *progress, double *bends, int64_t *trusted, bool leaves,
    double sense, const System *s, const Workspace *w, double relative, double absolute,
    double *drag, const Branch *branch, int64_t *counts, int64_t n_loads, double *returned) {
    Tolerance tolerance = {relative, absolute, drag};
    int64_t n = s->n_mass, p = known;
    double *motion = calloc(3 * n + s->n_dofs, sizeof(double));
    double *step = motion + n, *bend = step + n, *mode = bend + n;
    Path path = {
        .motion = motion, .mode = mode, .predicted = step, .progress = progress,
        .control.limit.bend = bend, .leaves = leaves, .sense = sense, .t = &tolerance, .s = s,
        .w = w, .counts = counts};
    returned[0] = returned[1] = 0.0;
    if (begin(&path, known, branch) < 0.0 && known == 0) {
        free(motion);
        return;
    }
    progress[INCREMENT] = 1.0, progress[RATE] = 0.0;
    for (; p < n_loads; p++) {
        double done = 0.0;
        path.load = loads + p * s->n_held;
        increments_prescribe(motion, path.load, 1.0, s, w);
        increments_tangent_step(motion, s, w);
        copy(branch->tangents + p * n, w->step, n);
        if (trusted[p]) {
            EACH(d, n) step[d] = w->step[d] + bends[p * n + d];
            if (try_known_step(&path, step)) done = 1.0, progress[RATE] = 0.0;
        }
        if (done < 1.0) {
            Advance a = advance(&path, p, branch->snaps);
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
        progress[VALUE] = snap_lowest_mode(s, w, mode, SWEEPS_AT_LOADS, EIGENVALUE);
        branch->eigenvalue[p] = progress[VALUE], branch->stable[p] = 1;
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
