/* Integrates a network's motion explicitly, with its exact discrete adjoint.

   A step alternates flights and kicks. A flight of length a h is free but for the barriers of
   closed voids (contact_substeps.c); a kick solves, for frozen u and the energy E of all else,

       v' = decay v - gain dE/dq,   decay = exp(-b h C / M),   gain = (1 - decay) / C.

   The reverse sweep needs the states at the kicks; they are kept at checkpoints and computed again
   segment by segment, so memory grows with the square root of the number of steps. */
#include "sim/time_integration/time_integration.h"

#include <stdlib.h>

/* States within some steps, for the reverse sweep: step n is at n % n_slots. */
typedef struct {
    int64_t n_slots;
    double *u, *v;   /* (n_slots, n_kicks + 1, n_dofs) where the flights start, that is at and
                        after the kicks */
    double *before;  /* (n_slots, n_kicks, n_dofs) velocities before the kicks */
    double *turn;    /* (n_slots, n_kicks, n_units, 4) of the kinematics at the kicks */
    double *shear;   /* (n_slots, n_kicks, n_ligaments) likewise */
} Trace;

/* A motion as it is integrated, with its state u, v (n_dofs,). */
typedef struct {
    const Steps *steps;
    const System *system;
    const Workspace *work;
    int64_t n_kicks, n_dofs;
    Flight flight;
    Trace trace;
    double *u, *v;
} Motion;

static Trace trace_of(int64_t n_slots, const Steps *steps, const System *system) {
    int64_t n_dofs = system->n_mass, n_kicks = n_slots * steps->n_gain;
    int64_t n_flights = n_kicks + n_slots, n_turn = 4 * (n_dofs / 3);
    int64_t n_all = 2 * n_flights * n_dofs + n_kicks * (n_dofs + n_turn + system->net.n_unit);
    Trace trace = {.n_slots = n_slots, .u = malloc(sizeof(double) * n_all)};
    trace.v = trace.u + n_flights * n_dofs;
    trace.before = trace.v + n_flights * n_dofs;
    trace.turn = trace.before + n_kicks * n_dofs;
    trace.shear = trace.turn + n_kicks * n_turn;
    return trace;
}

static Motion motion_of(
    int64_t n_slots, const int64_t *watched, int64_t n_watched, const Steps *steps,
    const System *system, const Workspace *work) {
    int64_t n_dofs = system->n_mass;
    double *u = calloc(2 * n_dofs, sizeof(double));
    return (Motion){
        steps, system, work, steps->n_gain, n_dofs,
        contact_substeps_flight_of(watched, n_watched, n_dofs / 3),
        trace_of(n_slots, steps, system), u, u + n_dofs};
}

static void free_motion(Motion *motion) {
    contact_substeps_free(&motion->flight);
    free(motion->trace.u);
    free(motion->u);
}

/* Number of a kick among those of the trace, and of a flight. */
static inline int64_t kick_at(int64_t n, int64_t m, const Motion *motion) {
    return n % motion->trace.n_slots * motion->n_kicks + m;
}

static inline int64_t flight_at(int64_t n, int64_t m, const Motion *motion) {
    return n % motion->trace.n_slots * (motion->n_kicks + 1) + m;
}

static Kinematics kinematics_at(int64_t kick, const Motion *motion) {
    int64_t n_units = motion->n_dofs / 3, n_ligaments = motion->system->net.n_unit;
    return (Kinematics){
        motion->trace.turn + kick * 4 * n_units, n_units,
        motion->trace.shear + kick * n_ligaments, n_ligaments};
}

/* Rows of the drive, or of the derivatives by it, at the kicks before and after a flight. */
typedef struct {
    double *last, *following;
} Around;

static Around around(int64_t n, int64_t m, double *drive, const Motion *motion) {
    int64_t last = most_of(m - 1, 0), following = least_of(m, motion->n_kicks - 1);
    int64_t first = n * motion->n_kicks, n_held = motion->system->n_held;
    return (Around){drive + (first + last) * n_held, drive + (first + following) * n_held};
}

/* Sets the held dofs for flight m of step n: between the kicks before and after it. */
static void hold(int64_t n, int64_t m, double *u, const Motion *motion) {
    Around drive = around(n, m, motion->steps->drive, motion);
    EACH(i, motion->system->n_held)
        u[motion->system->held[i]] = 0.5 * (drive.last[i] + drive.following[i]);
}

/* Takes the velocities through kick m of step n; returns the energy there. */
static double kick(int64_t n, int64_t m, Motion *motion) {
    const System *system = motion->system;
    int64_t at = kick_at(n, m, motion), n_dofs = motion->n_dofs;
    double *u = motion->u, *v = motion->v, *force = motion->work->force, energy[2];
    const double *decay = motion->steps->decay + m * n_dofs;
    const double *gain = motion->steps->gain + m * n_dofs;
    const double *drive = motion->steps->drive + (n * motion->n_kicks + m) * system->n_held;
    copy(motion->trace.before + at * n_dofs, v, n_dofs);
    EACH(i, system->n_held) u[system->held[i]] = drive[i];
    Kinematics kinematics = kinematics_at(at, motion);
    total_gradient(u, system, &kinematics, force, energy);
    EACH(i, system->n_dofs) {  /* v+ = e v- - g dW/du: the exact flow of M v' + C v = -dW/du */
        int64_t d = system->dofs[i];
        v[d] = decay[d] * v[d] - gain[d] * force[d];
    }
    return energy[0] + energy[1];
}

/* Advances the state by step n and keeps its states in the trace. Returns the sum of the energies
   at the kicks: not finite once a void is beyond its barrier. */
static double advance(int64_t n, Motion *motion) {
    const Steps *steps = motion->steps;
    double total = 0.0;
    for (int64_t m = 0; m <= motion->n_kicks; m++) {
        int64_t at = flight_at(n, m, motion) * motion->n_dofs;
        copy(motion->trace.u + at, motion->u, motion->n_dofs);
        copy(motion->trace.v + at, motion->v, motion->n_dofs);
        hold(n, m, motion->u, motion);
        double tau = steps->splitting.drifts[m] * steps->h;
        int64_t substeps = contact_substeps_advance(
            tau, motion->u, motion->v, &steps->splitting, motion->system, &motion->flight);
        if (substeps < 0) return INFINITY;
        if (m < motion->n_kicks) total += kick(n, m, motion);
    }
    return total;
}

/* Fills an output between two states by its weights (4,). */
static void interpolate(
    const double *w, const double *last_u, const double *u, const double *last_v, const double *v,
    int64_t n_dofs, double *out) {
    EACH(d, n_dofs) out[d] = w[0] * last_u[d] + w[1] * u[d] + w[2] * last_v[d] + w[3] * v[d];
}

int64_t symplectic_run(
    const Steps *steps, const Outputs *outputs, const System *system, const Workspace *work,
    int64_t *watched, double *checkpoints, double *out_u, double *out_v, int64_t n_watched) {
    int64_t n_dofs = system->n_mass, output = 0, failed = -1;
    Motion motion = motion_of(1, watched, n_watched, steps, system, work);
    double *u = motion.u, *v = motion.v;
    double *last_u = malloc(sizeof(double) * 2 * n_dofs), *last_v = last_u + n_dofs;
    EACH(n, steps->n_steps) {
        if (n % steps->segment == 0) {
            double *checkpoint = checkpoints + n / steps->segment * 2 * n_dofs;
            copy(checkpoint, u, n_dofs);
            copy(checkpoint + n_dofs, v, n_dofs);
        }
        copy(last_u, u, n_dofs);
        copy(last_v, v, n_dofs);
        if (!isfinite(advance(n, &motion))) {
            failed = n;
            break;
        }
        for (; output < outputs->n_interval && outputs->interval[output] == n; output++) {
            const double *w = outputs->values + 4 * output, *r = outputs->rates + 4 * output;
            interpolate(w, last_u, u, last_v, v, n_dofs, out_u + output * n_dofs);
            interpolate(r, last_u, u, last_v, v, n_dofs, out_v + output * n_dofs);
        }
    }
    free(last_u);
    free_motion(&motion);
    return failed;
}

/* Derivatives that a reverse sweep holds: u, v by the state that it is at, `left` by the start of
   the step that it goes through, and what it adds to. */
typedef struct {
    double *u, *v, *left_u, *left_v;
    const Bars *bars;
    double *decay, *gain;  /* (n_kicks, n_dofs) by those of the kicks */
    int64_t *which;        /* ligaments whose parameters are differentiated by */
    int64_t n_which;
} Reverse;

/* Takes derivatives by the end of flight m of step n to its start u, v. */
static void flight_back(
    int64_t n, int64_t m, double *u, double *v, Motion *motion, const Reverse *bar) {
    const Steps *steps = motion->steps;
    const System *system = motion->system;
    const Flight *flight = &motion->flight;
    hold(n, m, u, motion);
    contact_substeps_advance_adjoint(
        steps->splitting.drifts[m] * steps->h, u, v, bar->u, bar->v, &steps->splitting, system,
        &motion->flight, bar->bars);
    Around drive = around(n, m, bar->bars->drive, motion);
    EACH(i, system->n_held) {
        int64_t unit = system->held[i] / 3;
        if (system->held[i] % 3 == 2 && flight->listed[unit]) {
            drive.last[i] += 0.5 * flight->bar_held[unit];
            drive.following[i] += 0.5 * flight->bar_held[unit];
        }
    }
}

/* Takes derivatives by the velocities after kick m of step n to those before it. */
static void kick_back(int64_t n, int64_t m, Motion *motion, const Reverse *bar) {
    const System *system = motion->system;
    const Workspace *work = motion->work;
    int64_t n_dofs = motion->n_dofs, row = m * n_dofs, at = kick_at(n, m, motion);
    int64_t flight = flight_at(n, m + 1, motion);
    double *u = motion->trace.u + flight * n_dofs;
    const double *after = motion->trace.v + flight * n_dofs;
    const double *v = motion->trace.before + at * n_dofs;
    set_to_zero(work->step, n_dofs);
    EACH(i, system->n_dofs) {
        int64_t d = system->dofs[i];
        double gain = motion->steps->gain[row + d], decay = motion->steps->decay[row + d];
        work->step[d] = -gain * bar->v[d];
        bar->decay[row + d] += bar->v[d] * v[d];
        bar->gain[row + d] -= bar->v[d] * (decay * v[d] - after[d]) / gain;
        bar->v[d] *= decay;
    }
    Kinematics kinematics = kinematics_at(at, motion);
    total_hessian_product(u, system, &kinematics, work->step, work->product);
    total_mixed(
        u, system, &kinematics, work->step, bar->which, &bar->bars->sensitivity, bar->n_which);
    EACH(i, system->n_dofs) bar->u[system->dofs[i]] += work->product[system->dofs[i]];
    double *drive = bar->bars->drive + (n * motion->n_kicks + m) * system->n_held;
    EACH(i, system->n_held) drive[i] += work->product[system->held[i]];
}

/* Takes derivatives by the end of step n to its start. */
static void step_back(int64_t n, Motion *motion, const Reverse *bar) {
    const Workspace *work = motion->work;
    for (int64_t m = motion->n_kicks; m >= 0; m--) {
        int64_t at = flight_at(n, m, motion) * motion->n_dofs;
        copy(work->trial, motion->trace.u + at, motion->n_dofs);
        copy(work->saved, motion->trace.v + at, motion->n_dofs);
        flight_back(n, m, work->trial, work->saved, motion, bar);
        if (m > 0) kick_back(n, m - 1, motion, bar);
    }
}

/* Goes to the end of the step before: its derivatives are those by the start of this. */
static void to_step_before(const Reverse *bar, int64_t n_dofs) {
    EACH(d, n_dofs) bar->u[d] += bar->left_u[d];
    EACH(d, n_dofs) bar->v[d] += bar->left_v[d];
    set_to_zero(bar->left_u, n_dofs);
    set_to_zero(bar->left_v, n_dofs);
}

/* Adds the derivatives by an output (n_dofs,), with its weights (4,). */
static void add_output(
    const double *w, const double *r, const double *by_u, const double *by_v, int64_t n_dofs,
    const Reverse *bar) {
    EACH(d, n_dofs) {
        bar->left_u[d] += w[0] * by_u[d] + r[0] * by_v[d];
        bar->u[d] += w[1] * by_u[d] + r[1] * by_v[d];
        bar->left_v[d] += w[2] * by_u[d] + r[2] * by_v[d];
        bar->v[d] += w[3] * by_u[d] + r[3] * by_v[d];
    }
}

void symplectic_sweep_back(
    const Steps *steps, const Outputs *outputs, const System *system, const Workspace *work,
    int64_t *watched, double *checkpoints, double *out_bar_u, double *out_bar_v, int64_t *which,
    const Bars *bars, double *bar_decay, double *bar_gain, int64_t n_watched, int64_t n_which) {
    int64_t n_dofs = system->n_mass, output = outputs->n_interval - 1;
    Motion motion = motion_of(steps->segment, watched, n_watched, steps, system, work);
    double *u = calloc(4 * n_dofs, sizeof(double));
    Reverse bar = {
        u, u + n_dofs, u + 2 * n_dofs, u + 3 * n_dofs, bars, bar_decay, bar_gain, which, n_which};
    for (int64_t part = (steps->n_steps - 1) / steps->segment; part >= 0; part--) {
        int64_t start = part * steps->segment;
        int64_t count = least_of(steps->segment, steps->n_steps - start);
        const double *checkpoint = checkpoints + part * 2 * n_dofs;
        copy(motion.u, checkpoint, n_dofs);
        copy(motion.v, checkpoint + n_dofs, n_dofs);
        EACH(n, count) advance(start + n, &motion);
        for (int64_t n = start + count - 1; n >= start; n--) {
            to_step_before(&bar, n_dofs);
            for (; output >= 0 && outputs->interval[output] == n; output--)
                add_output(
                    outputs->values + 4 * output, outputs->rates + 4 * output,
                    out_bar_u + output * n_dofs, out_bar_v + output * n_dofs, n_dofs, &bar);
            step_back(n, &motion, &bar);
        }
    }
    free(u);
    free_motion(&motion);
}
