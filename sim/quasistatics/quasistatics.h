/* Follows equilibrium paths: Newton's method, increments, ends of paths, damped motion to rest. */
#ifndef SIM_QUASISTATICS_H
#define SIM_QUASISTATICS_H

#include "sim/collision/collision.h"
#include "sim/core/numbers.h"
#include "sim/declarations.h"

#include <math.h>
#include <string.h>

/* Part of the way to a barrier that a step may go. */
static const double KEEP_FROM_BARRIER = 0.9;
/* Least relative change of an eigenvalue that iterations go on for. */
static const double EIGENVALUE = 1e-6;
/* Least part of the way to a load that an increment may be. */
static const double SMALLEST_INCREMENT = 1e-8;

/* Places in the counts that the solvers gather, as in newton.py. */
enum { GRADIENTS, FACTORS, SHIFTED, INCREMENTS };
/* Places in the progress of a path: the increment, the lowest eigenvalue and its rate, the first one. */
enum { INCREMENT, VALUE, RATE, FIRST };
/* How a way went on, as in path_ends.py. */
enum { SMOOTH, LIMIT_POINT, BRANCHING };
/* Snaps of a path that are recorded, as in equilibrium_path.py. */
enum { MOST_SNAPS = 64 };
/* Sweeps of the inverse iteration at a load. */
enum { SWEEPS_AT_LOADS = 40 };

/* Length of a step in some dofs, rotations times the scale, mm. */
static inline double length_of(const double *step, const int64_t *dofs, int64_t n, const System *s) {
    double total = 0.0;
    EACH(i, n) total += square(step[dofs[i]] * s->scale[dofs[i]]);
    return sqrt(total);
}

/* Tolerance of the residual over the largest reaction, its floor, N, and the viscous drag of each
   dof in the motion after a snap. */
typedef struct {
    double relative, absolute;
    double *drag;
} Tolerance;

/* Energy, and the largest out-of-balance and reaction force (moments over the scale), N. */
typedef struct {
    double energy, residual, reaction;
} Balance;

/* A limit point ahead, as the last increment told of it. Lengths are parts of the way to a load. */
typedef struct {
    double distance; /* infinite if none is in sight */
    double ratio;    /* of the root of the distance to that before the increment */
    double *bend;    /* growth of the tangent's step over the increment */
} LimitPoint;

/* Bounds the next increment by those that failed and those that did not. */
typedef struct {
    double failed_at; /* place that one failed to pass last, infinite once it is passed */
    int failures;     /* of increments since such a place was passed */
    double length;    /* of the last one that did not fail */
    LimitPoint limit;
} StepControl;

Balance newton_balance_of(double *motion, const System *s, const Workspace *w);
double newton_median_stiffness(const System *s);
double newton_factorise_shifted(
    double *motion, const System *s, const Workspace *w, int64_t *counts);
void newton_solve_free(const System *s, const Workspace *w);
bool newton_correct(
    double *motion, const Tolerance *t, bool shifted, const System *s, const Workspace *w,
    int64_t *counts);

double snap_lowest_mode(
    const System *s, const Workspace *w, double *mode, int sweeps, double tolerance);
void snap_push(double *motion, double *mode, double sense, const System *s, const Workspace *w);
bool snap_follow_to_rest(
    double *motion, const Tolerance *t, const System *s, const Workspace *w, int64_t *counts);

void increments_tangent_step(double *motion, const System *s, const Workspace *w);
void increments_prescribe(
    double *motion, double *load, double share, const System *s, const Workspace *w);
double increments_trapezoidal_error(
    double *motion, double *predicted, double taken, StepControl *control, const System *s,
    const Workspace *w);
double increments_next(
    double increment, double done, double stroke, const double *progress,
    const StepControl *control);
double increments_predict(
    double *motion, double *load, double share, double requested, const LimitPoint *limit,
    double *predicted, const System *s, const Workspace *w, int64_t *counts);

double limit_point_ratio(const LimitPoint *limit, double taken);
void limit_point_locate(
    double *predicted, double taken, double noticed, LimitPoint *limit, const System *s,
    const Workspace *w);
void limit_point_bend(const LimitPoint *limit, double taken, double *step, const System *s);

double critical_modes_load(const double *mode, const System *s, const Workspace *w);
void critical_modes_mix(
    double *mode, double largest_value, double largest_load, const System *s, const Workspace *w);

void path_ends_scatter(double *mode, int64_t n);
double path_ends_leave(
    double *motion, double *load, double overshoot, double *mode, double sense, double first,
    const Tolerance *t, const System *s, const Workspace *w, int64_t *counts, int *end);
double path_ends_come_to_rest(
    double *motion, double *mode, double sense, const Tolerance *t, const System *s,
    const Workspace *w, int64_t *counts, int *end);

#endif
