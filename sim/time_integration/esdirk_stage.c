/* Solves an implicit stage of a network's motion by Newton's method.

   Equation: M q'' = -dE/dq - C q' on the free dofs, the held ones prescribed. A stage solves

       M (u - u* - k v*) / k^2 + C (u - u*) / k + dE/du = 0,   k = gamma h,

   for its displacement u; then v = (u - u*) / k and a = (v - v*) / k. The factor is kept while it
   contracts fast. */
#include "sim/time_integration/time_integration.h"

enum { MAX_ITERATIONS = 30, MAX_FACTORS = 20 };
#ifdef NO_KEPT_FACTORS  /* what keeping them gains, for benchmarks */
enum { PATIENCE = 0 };
static const double KEEP_BELOW = 0.0;
#else
/* Iterations that take as long as a factor and the two or three after it. */
enum { PATIENCE = 6 };
/* Rate of a stage up to which its factor is kept for the next. */
static const double KEEP_BELOW = 0.1;
#endif
/* At which a new factor is presumed to contract at most, until it is seen. */
static const double NEW_RATE = 0.3;
/* Part of the way to a barrier that a step may go. */
static const double KEEP_FROM_BARRIER = 0.9;
/* Most that the rate may fall from one iteration to the next: one that gets rid of what contracts
   fast looks better than the iterations after it, which are left with the rest. */
static const double MEMORY = 0.5;

bool esdirk_stage_factorise(
    double *motion, const System *system, const Workspace *work, double k) {
    symmetric_clear(&work->matrix);
    total_tangent(motion, system, &work->kinematics, &work->matrix);
    EACH(i, system->n_dofs) {
        int64_t d = system->dofs[i];
        symmetric_add(&work->matrix, i, i, (system->mass[d] / k + system->damping[d]) / k);
    }
    return symmetric_factorise(&work->matrix);
}

/* A power of integer exponent, by squares. */
static double power(double x, int exponent) {
    double of = 1.0;
    for (; exponent > 0; exponent /= 2, x *= x)
        if (exponent % 2) of *= x;
    return of;
}

/* Largest move of a held dof, and the (scaled) largest of a free one. */
typedef struct {
    double gap, size;
} Move;

/* Fills the workspace's step: the held dofs to `target`, the free ones by Newton's method. The
   workspace has the force at `motion`, its kinematics and a factor. */
static Move newton_step(
    double *motion, const double *target, const Base *base, const System *system,
    const Workspace *work) {
    Move move = {0.0, 0.0};
    set_to_zero(work->step, system->n_mass);
    EACH(i, system->n_held) {
        int64_t d = system->held[i];
        work->step[d] = target[i] - motion[d];
        move.gap = most(move.gap, fabs(work->step[d]));
    }
    if (move.gap > 0.0) {
        total_hessian_product(motion, system, &work->kinematics, work->step, work->product);
        EACH(i, system->n_dofs) work->force[system->dofs[i]] += work->product[system->dofs[i]];
    }
    EACH(i, system->n_dofs) {
        int64_t d = system->dofs[i];
        /* residual M (v - v*) / k + C v + dW/du with v = (u - u*) / k */
        double velocity = (motion[d] - base->u[d]) / base->k;
        double inertia = system->mass[d] * (velocity - base->v[d]) / base->k;
        work->right[i] = -(inertia + system->damping[d] * velocity + work->force[d]);
    }
    symmetric_solve(&work->matrix, work->right);
    EACH(i, system->n_dofs) {
        int64_t d = system->dofs[i];
        work->step[d] = work->right[i];
        move.size = most(move.size, fabs(work->right[i]) * system->scale[d]);
    }
    return move;
}

/* Ends a stage that failed: nothing of it is of use to the next. */
static int give_up(int status, Contraction *contraction) {
    *contraction = (Contraction){false, 1.0};
    return status;
}

int esdirk_stage_solve(
    double *motion, const double *target, const Base *base, double tolerance,
    const System *system, const Workspace *work, Contraction *contraction, int64_t *counts) {
    double previous = 0.0, rate = contraction->rate, energy[2];
    bool fresh = contraction->fresh;
    int factors = 0;
    for (int iteration = 0; iteration < MAX_ITERATIONS; iteration++) {
        total_gradient(motion, system, &work->kinematics, work->force, energy);
        counts[0]++;
        if (!fresh) {
            factors++;
            counts[1]++;
            if (factors > MAX_FACTORS) return give_up(STALLED, contraction);
            if (!esdirk_stage_factorise(motion, system, work, base->k))
                return give_up(INDEFINITE, contraction);
            fresh = true, previous = 0.0, rate = least(rate, NEW_RATE);
        }
        Move move = newton_step(motion, target, base, system, work);
        counts[2]++;
        double size = move.size;
        double allowed = KEEP_FROM_BARRIER * total_admissible_step(motion, system, work->step);
        double part = least(1.0, allowed);
        EACH(d, system->n_mass) motion[d] += part * work->step[d];
        if (!(size < 1e6)) return give_up(STALLED, contraction);
        if (allowed < 1.0) {
            fresh = false;
            continue;
        }
        if (previous > 0.0) rate = most(size / previous, MEMORY * rate);
        double likely = least(rate, 0.9);
        bool settled = likely / (1.0 - likely) * size <= tolerance || size <= 1e-13;
        if (move.gap == 0.0 && settled) {
            *contraction = (Contraction){rate < KEEP_BELOW, rate};
            return CONVERGED;
        }
        if (previous > 0.0 && power(rate, PATIENCE) * size > tolerance) fresh = false;
        previous = size;
    }
    *contraction = (Contraction){false, rate};
    return STALLED;
}
