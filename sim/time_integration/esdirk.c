/* Integrates a network's motion by diagonally implicit Runge-Kutta steps. */
#include "sim/time_integration/time_integration.h"

#include <stdlib.h>

/* Coefficients of the method, and its stage times in units of the step. */
typedef struct {
    const double *stages, *nodes;
    int64_t n_stages;
} Method;

/* Displacement, velocity and acceleration (n_stages, n_dofs) of the stages of one step of length
   h. */
typedef struct {
    double h, *u, *v, *a;
} Step;

/* Fills u* and v* of stage s from the stages before it. */
static void stage_base(
    int64_t s, const Method *method, const Step *step, int64_t n_dofs, Base *base) {
    copy(base->u, step->u, n_dofs);
    copy(base->v, step->v, n_dofs);
    EACH(j, s) {
        double weight = step->h * method->stages[s * method->n_stages + j];
        const double *v = step->v + j * n_dofs, *a = step->a + j * n_dofs;
        EACH(d, n_dofs) base->u[d] += weight * v[d];
        EACH(d, n_dofs) base->v[d] += weight * a[d];
    }
}

/* The motion goes on at the step's first acceleration. */
static void at_first_acceleration(
    const Step *step, const Base *base, int64_t n_dofs, double *motion) {
    double k = base->k;
    EACH(d, n_dofs) motion[d] = base->u[d] + k * (base->v[d] + k * step->a[d]);
}

/* The motion goes on along the parabola through the two stages before s that starts at the step's
   first velocity: next to it, accelerations of stages extrapolate ten times worse, for stiff modes
   are in them. */
static void along_a_parabola(
    int64_t s, const Method *method, const Step *step, int64_t n_dofs, double *motion) {
    double t = method->nodes[s], t1 = method->nodes[s - 2], t2 = method->nodes[s - 1];
    double w = (t * t - t2 * t2) / (t2 * t2 - t1 * t1);
    double slope = step->h * (t - t2 - w * (t2 - t1));
    const double *u2 = step->u + (s - 1) * n_dofs, *u1 = u2 - n_dofs;
    EACH(d, n_dofs) motion[d] = u2[d] + w * (u2[d] - u1[d]) + slope * step->v[d];
}

/* Guess of a stage: the motion extrapolated over the step, for all dofs alike.

   Held dofs are extrapolated too and moved to their values together with the others: a driven unit
   moved alone would make the tangent indefinite. */
static void guess(
    int64_t s, const Method *method, const Step *step, const Base *base, const System *system,
    const Workspace *work, double *motion) {
    int64_t n_dofs = system->n_mass;
    double *last = step->u + (s - 1) * n_dofs;
    if (s == 1)
        at_first_acceleration(step, base, n_dofs, motion);
    else
        along_a_parabola(s, method, step, n_dofs, motion);
    EACH(d, n_dofs) work->step[d] = motion[d] - last[d];
    if (total_admissible_step(last, system, work->step) <= 1.0) copy(motion, last, n_dofs);
}

/* Puts the held dofs of the initial state in place and fills its acceleration. */
static void start(
    const double *drive, const System *system, const Workspace *work, double *u, const double *v,
    double *a) {
    double energy[2];
    EACH(i, system->n_held) u[system->held[i]] = drive[i];
    set_to_zero(a, system->n_mass);
    total_gradient(u, system, &work->kinematics, work->force, energy);
    EACH(i, system->n_dofs) {  /* M a = -dW/du - C v */
        int64_t d = system->dofs[i];
        a[d] = -(work->force[d] + system->damping[d] * v[d]) / system->mass[d];
    }
}

/* Free dof with the largest (scaled) step. */
static int64_t worst_of(const System *system, const double *step) {
    int64_t worst = system->dofs[0];
    EACH(i, system->n_dofs) {
        int64_t d = system->dofs[i];
        if (fabs(step[d]) * system->scale[d] > fabs(step[worst]) * system->scale[worst]) worst = d;
    }
    return worst;
}

/* Solves stage s of a step, whose held dofs go to `target`; returns how that ended. */
static int solve(
    int64_t s, const Method *method, const Step *step, const double *target, const Base *base,
    double tolerance, const System *system, const Workspace *work, Contraction *contraction,
    double *motion, int64_t *counts) {
    guess(s, method, step, base, system, work, motion);
    int status = esdirk_stage_solve(
        motion, target, base, tolerance, system, work, contraction, counts);
    if (status != CONVERGED) {  /* after a kink in the drive extrapolation leads astray */
        copy(motion, base->u, system->n_mass);
        status = esdirk_stage_solve(
            motion, target, base, tolerance, system, work, contraction, counts);
    }
    return status;
}

/* Notes a stage's displacement, v = (u - u*) / k and a = (v - v*) / k. */
static void record_stage(
    int64_t s, const double *motion, const Base *base, int64_t n_dofs, const Step *step) {
    double *u = step->u + s * n_dofs, *v = step->v + s * n_dofs, *a = step->a + s * n_dofs;
    EACH(d, n_dofs) {
        u[d] = motion[d];
        v[d] = (motion[d] - base->u[d]) / base->k;
        a[d] = (v[d] - base->v[d]) / base->k;
    }
}

void esdirk_march(
    double *times, int64_t first, double *drive, const System *system, const Workspace *work,
    double *stages, double *nodes, double tolerance, double *u, double *v, double *a,
    int64_t *counts, int64_t n_times, int64_t n_nodes, double *returned) {
    int64_t n_steps = n_times - 1, n_dofs = system->n_mass, room = n_nodes * n_dofs;
    Method method = {stages, nodes, n_nodes};
    double *motion = malloc(sizeof(double) * 3 * n_dofs), factored_k = -1.0;
    Base base = {motion + n_dofs, motion + 2 * n_dofs, 0.0};
    Contraction contraction = {false, 0.1};
    int status = CONVERGED;
    int64_t n = first, worst = 0;
    if (first == 0) start(drive, system, work, u, v, a);
    for (; n < n_steps; n++) {
        Step step = {times[n + 1] - times[n], u + n * room, v + n * room, a + n * room};
        base.k = step.h * stages[n_nodes + 1];
        bool alike = fabs(base.k - factored_k) <= 1e-9 * base.k;
        contraction.fresh = contraction.fresh && alike;
        if (!contraction.fresh) factored_k = base.k;
        for (int64_t s = 1; s < n_nodes && status == CONVERGED; s++) {
            const double *target = drive + (n * (n_nodes - 1) + s) * system->n_held;
            stage_base(s, &method, &step, n_dofs, &base);
            status = solve(
                s, &method, &step, target, &base, tolerance * step.h, system, work, &contraction,
                motion, counts);
            if (status == CONVERGED) record_stage(s, motion, &base, n_dofs, &step);
        }
        if (status != CONVERGED) {
            worst = worst_of(system, work->step);
            break;
        }
        int64_t end = room - n_dofs;  /* the last stage is the step's end */
        copy(step.u + room, step.u + end, n_dofs);
        copy(step.v + room, step.v + end, n_dofs);
        copy(step.a + room, step.a + end, n_dofs);
    }
    free(motion);
    returned[0] = status, returned[1] = n, returned[2] = worst;
}
