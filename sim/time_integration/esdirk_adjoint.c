/* Sweeps back through an implicit integration: the derivative of the steps taken.

   It factors every stage's tangent anew, so that it does not depend on which factors were kept. */
#include "sim/time_integration/time_integration.h"

#include <stdlib.h>

/* What the sweep adds to, and the ligaments whose parameters are differentiated by. */
typedef struct {
    const Bars *bars;
    int64_t *which;
    int64_t n_which;
} Wanted;

/* Adds what the balance of one state contributes, `drive` (n_held,) by its held values. The
   workspace holds its multiplier (`right`) and its kinematics. */
static void gather(
    double *motion, const double *velocity, const double *acceleration, const System *system,
    const Workspace *work, const Wanted *wanted, double *drive) {
    const Bars *bars = wanted->bars;
    set_to_zero(work->step, system->n_mass);
    EACH(i, system->n_dofs) {
        int64_t d = system->dofs[i];
        work->step[d] = -work->right[i];
        bars->mass[d] -= work->right[i] * acceleration[d];
        bars->damping[d] -= work->right[i] * velocity[d];
    }
    total_mixed(
        motion, system, &work->kinematics, work->step, wanted->which, &bars->sensitivity,
        wanted->n_which);
    total_hessian_product(motion, system, &work->kinematics, work->step, work->product);
    EACH(i, system->n_held) drive[i] += work->product[system->held[i]];
}

/* Derivatives by the stages (n_stages, n_dofs) of one step, and by its start (n_dofs,). */
typedef struct {
    double *u, *v, *a;
    double *next_u, *next_v, *next_a;
} Derivatives;

/* Goes from a step to the one before it: what was by its start is by that one's last stage. */
static void to_last_stage(const double *start, double *stages, int64_t n_stages, int64_t n_dofs) {
    set_to_zero(stages, (n_stages - 1) * n_dofs);
    copy(stages + (n_stages - 1) * n_dofs, start, n_dofs);
}

/* Fills the right hand side of stage s with coefficient k = gamma h:
   (M / k^2 + C / k + K) lambda = du + dv / k + da / k^2. */
static void load_stage(
    int64_t s, double k, const Derivatives *by, const System *system, const Workspace *work) {
    int64_t row = s * system->n_mass;
    EACH(i, system->n_dofs) {
        int64_t d = row + system->dofs[i];
        work->right[i] = by->u[d] + (by->v[d] + by->a[d] / k) / k;
    }
}

/* Passes the derivatives of stage s to the step's start and to the stages before it; the
   workspace's right hand side holds the stage's multiplier. */
static void stage_back(
    int64_t s, double h, const double *coefficients, double k, const System *system,
    const Workspace *work, const Derivatives *by) {
    int64_t n_dofs = system->n_mass, row = s * n_dofs;
    EACH(i, system->n_dofs) {
        int64_t d = system->dofs[i];
        double multiplier = work->right[i], inertia = system->mass[d] / k;
        double by_a = by->a[row + d] / k;
        double base_v = inertia * multiplier - by_a;
        double base_u =
            (inertia + system->damping[d]) / k * multiplier - (by->v[row + d] + by_a) / k;
        by->next_u[d] += base_u;
        by->next_v[d] += base_v;
        EACH(j, s) {
            by->v[j * n_dofs + d] += h * coefficients[j] * base_u;
            by->a[j * n_dofs + d] += h * coefficients[j] * base_v;
        }
    }
}

/* The initial acceleration follows from the balance M a = -dW/du - C v of the first state. */
static void gather_start(
    double *u, const double *v, const double *a, const double *by_a, const System *system,
    const Workspace *work, const Wanted *wanted) {
    EACH(i, system->n_dofs) {
        int64_t d = system->dofs[i];
        work->right[i] = by_a[d] / system->mass[d];
    }
    total_locate(u, system, &work->kinematics);
    gather(u, v, a, system, work, wanted, wanted->bars->drive);
}

bool esdirk_adjoint_adjoint(
    double *times, double *stage_u, double *stage_v, double *stage_a, double *bar_u,
    double *bar_v, const System *system, const Workspace *work, double *stages, int64_t *which,
    const Bars *bars, int64_t n_times, int64_t n_stages, int64_t n_which) {
    int64_t n_steps = n_times - 1, n_dofs = system->n_mass, room = n_stages * n_dofs;
    Wanted wanted = {bars, which, n_which};
    double *scratch = calloc(3 * (room + n_dofs), sizeof(double)), *next = scratch + 3 * room;
    Derivatives by = {scratch, scratch + room, scratch + 2 * room,
                      next, next + n_dofs, next + 2 * n_dofs};
    copy(by.next_u, bar_u + n_steps * n_dofs, n_dofs);
    copy(by.next_v, bar_v + n_steps * n_dofs, n_dofs);
    for (int64_t n = n_steps - 1; n >= 0; n--) {
        double h = times[n + 1] - times[n];
        to_last_stage(by.next_u, by.u, n_stages, n_dofs);
        to_last_stage(by.next_v, by.v, n_stages, n_dofs);
        to_last_stage(by.next_a, by.a, n_stages, n_dofs);
        copy(by.next_u, bar_u + n * n_dofs, n_dofs);
        copy(by.next_v, bar_v + n * n_dofs, n_dofs);
        set_to_zero(by.next_a, n_dofs);
        for (int64_t s = n_stages - 1; s > 0; s--) {
            int64_t at = n * room + s * n_dofs, drive = n * (n_stages - 1) + s;
            double k = h * stages[s * n_stages + s];
            load_stage(s, k, &by, system, work);
            total_locate(stage_u + at, system, &work->kinematics);
            if (!esdirk_stage_factorise(stage_u + at, system, work, k)) {
                free(scratch);
                return false;
            }
            symmetric_solve(&work->matrix, work->right);
            gather(
                stage_u + at, stage_v + at, stage_a + at, system, work, &wanted,
                bars->drive + drive * system->n_held);
            stage_back(s, h, stages + s * n_stages, k, system, work, &by);
        }
        EACH(d, n_dofs) by.next_v[d] += by.v[d];
        EACH(d, n_dofs) by.next_a[d] += by.a[d];
    }
    gather_start(stage_u, stage_v, stage_a, by.next_a, system, work, &wanted);
    free(scratch);
    return true;
}
