/* Descends to an equilibrium at fixed held dofs by Newton's method.

   Every step descends the energy and stops short of the contact barrier. An indefinite tangent is
   shifted until it is positive definite, so that the descent ends in a minimum or, rarely, exactly
   on a saddle. */
#include "sim/quasistatics/quasistatics.h"

#include <stdlib.h>

enum { MAX_CORRECTIONS = 200, MAX_BACKTRACKS = 30, MAX_SHIFTS = 40 };
/* Of an indefinite tangent, over the median axial stiffness: a few ligaments may be far stiffer. */
static const double FIRST_SHIFT = 1e-4;
/* Over the last one that did, where the next trial of shifts begins. */
static const double SMALLER_SHIFT = 0.125;
/* A step that reduces the residual by more than the one has a factor worth keeping, until a step
   reduces it by less than the other. */
#ifdef NO_KEPT_FACTORS  /* what keeping them gains, for benchmarks */
static const double KEEP_FACTOR = 0.0, RENEW_FACTOR = 0.0;
#else
static const double KEEP_FACTOR = 1e-2, RENEW_FACTOR = 0.1;
#endif

static double kth(double *x, int64_t n, int64_t k) {  /* quickselect */
    int64_t low = 0, high = n - 1;
    while (low < high) {
        double pivot = x[(low + high) / 2];
        int64_t i = low, j = high;
        while (i <= j) {
            while (x[i] < pivot) i++;
            while (x[j] > pivot) j--;
            if (i <= j) {
                double held = x[i];
                x[i++] = x[j];
                x[j--] = held;
            }
        }
        if (k <= j) high = j;
        else if (k >= i) low = i;
        else break;
    }
    return x[k];
}

double newton_median_stiffness(const System *s) {
    int64_t n = s->net.n_unit;
    double *x = malloc(sizeof(double) * n);
    EACH(k, n) x[k] = s->net.law[3 * k];
    double found = kth(x, n, n / 2);
    if (n % 2 == 0) found = (kth(x, n, n / 2 - 1) + found) / 2;
    free(x);
    return found;
}

Balance newton_balance_of(double *motion, const System *s, const Workspace *w) {
    double energy[2];
    total_gradient(motion, s, &w->kinematics, w->force, energy);
    Balance b = {energy[0] + energy[1], 0.0, 0.0};
    EACH(i, s->n_dofs) {
        int64_t d = s->dofs[i];
        b.residual = most(b.residual, fabs(w->force[d]) / s->scale[d]);
    }
    EACH(i, s->n_held) {
        int64_t d = s->held[i];
        b.reaction = most(b.reaction, fabs(w->force[d]) / s->scale[d]);
    }
    return b;
}

/* Factor of the (shifted) tangent; false if it is not positive definite. */
bool newton_factorise_tangent(
    double *motion, const System *s, const Workspace *w, double shift, int64_t *counts) {
    counts[FACTORS]++;
    symmetric_clear(&w->matrix);
    total_locate(motion, s, &w->kinematics);
    total_tangent(motion, s, &w->kinematics, &w->matrix);
    if (shift > 0.0)
        EACH(i, s->n_dofs) symmetric_add(&w->matrix, i, i, shift * square(s->scale[s->dofs[i]]));
    return symmetric_factorise(&w->matrix);
}

/* The tangent, shifted by `first` or more if need be; returns the shift, negative if none helped. */
static double factorise_from(
    double *motion, const System *s, const Workspace *w, double first, int64_t *counts) {
    double shift = 0.0;
    EACH(tries, MAX_SHIFTS) {
        if (newton_factorise_tangent(motion, s, w, shift, counts)) return shift;
        if (tries == 0) {
            counts[SHIFTED]++;
            shift = first;
        } else
            shift *= 4.0;
    }
    return -1.0;
}

double newton_factorise_shifted(double *motion, const System *s, const Workspace *w, int64_t *counts) {
    return factorise_from(motion, s, w, FIRST_SHIFT * newton_median_stiffness(s), counts);
}

void newton_solve_free(const System *s, const Workspace *w) {
    EACH(i, s->n_dofs) w->right[i] = -w->force[s->dofs[i]];
    symmetric_solve(&w->matrix, w->right);
    EACH(i, s->n_held) w->step[s->held[i]] = 0.0;
    EACH(i, s->n_dofs) w->step[s->dofs[i]] = w->right[i];
}

/* Moves `motion` along the step by backtracking; returns its length, 0 if none was found. */
static double descend(
    double *motion, Balance *at, bool newton, const System *s, const Workspace *w, int64_t *counts) {
    double slope = 0.0;
    EACH(i, s->n_dofs) slope += w->step[s->dofs[i]] * w->force[s->dofs[i]];
    double length = least(1.0, KEEP_FROM_BARRIER * total_admissible_step(motion, s, w->step));
    EACH(tries, MAX_BACKTRACKS) {
        EACH(d, s->n_mass) w->trial[d] = motion[d] + length * w->step[d];
        Balance new = newton_balance_of(w->trial, s, w);
        counts[GRADIENTS]++;
        bool descends = new.energy <= at->energy + 1e-4 * length * slope;
        if (isfinite(new.energy) && (descends || (newton && new.residual < 0.5 * at->residual))) {
            copy(motion, w->trial, s->n_mass);
            *at = new;
            return length;
        }
        length *= 0.5;
    }
    at->reaction = 0.0;
    return 0.0;
}

/* Newton descent at fixed held dofs; true once the residual is below its tolerance. */
bool newton_correct(
    double *motion, const Tolerance *t, bool shifted, const System *s, const Workspace *w,
    int64_t *counts) {
    Balance at = newton_balance_of(motion, s, w);
    counts[GRADIENTS]++;
    bool keep = false;
    double shift = 0.0, first = FIRST_SHIFT * newton_median_stiffness(s);
    EACH(tries, MAX_CORRECTIONS) {
        if (at.residual <= most(t->relative * at.reaction, t->absolute)) return true;
        if (!(keep || shifted)) {
            if (!newton_factorise_tangent(motion, s, w, 0.0, counts)) return false;
        } else if (!keep) {
            shift = factorise_from(motion, s, w, first, counts);
            if (shift < 0.0) return false;
            if (shift > 0.0) first = SMALLER_SHIFT * shift;  /* the smallest leads furthest */
        }
        newton_solve_free(s, w);
        double before = at.residual;
        double length = descend(motion, &at, shift == 0.0, s, w, counts);
        if (length == 0.0) {
            if (!keep) return false;
            at = newton_balance_of(motion, s, w);
        }
        double limit = keep ? RENEW_FACTOR : KEEP_FACTOR;
        keep = shift == 0.0 && length == 1.0 && at.residual < limit * before;
    }
    return false;
}
