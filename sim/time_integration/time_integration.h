/* Integrates motions in time: stages of the implicit method, flights of the explicit one. */
#ifndef SIM_TIME_INTEGRATION_H
#define SIM_TIME_INTEGRATION_H

#include "sim/core/numbers.h"
#include "sim/declarations.h"

#include <math.h>
#include <string.h>

static inline void set_to_zero(double *of, int64_t n) { memset(of, 0, sizeof(double) * n); }

/* How a stage ended, as in esdirk_stage.py. */
enum { CONVERGED, STALLED, INDEFINITE };

/* What a stage starts from: u* and v* (n_dofs,), and k = gamma h. */
typedef struct {
    double *u, *v;
    double k;
} Base;

/* What a stage leaves to the next: whether the factor in the workspace is still good, and the rate
   at which the iterations contract. */
typedef struct {
    bool fresh;
    double rate;
} Contraction;

/* Factor of a stage's tangent M/k^2 + C/k + K in the workspace, which has the kinematics of
   `motion`; false if it is not positive definite. */
bool esdirk_stage_factorise(
    double *motion, const System *system, const Workspace *work, double k);
/* Newton iteration of one stage from the guess in `motion`, the held dofs to `target`. */
int esdirk_stage_solve(
    double *motion, const double *target, const Base *base, double tolerance,
    const System *system, const Workspace *work, Contraction *contraction, int64_t *counts);

/* Scratch of one flight. */
typedef struct {
    const int64_t *watched;               /* ligaments whose voids may come to contact */
    int64_t n_watched;
    int64_t *near, n_near;                /* those that do in this flight */
    int64_t *units, n_units;              /* the units that these join */
    int64_t *listed;                      /* of each unit, whether it is among them */
    double *angle, *rate, *force, *bar_held;  /* rotations at the start, their rates, moments, and
                                                 derivatives by held rotations, of each unit */
} Flight;

/* Allocates scratch for flights of a structure. */
Flight contact_substeps_flight_of(const int64_t *watched, int64_t n_watched, int64_t n_units);
void contact_substeps_free(Flight *flight);
/* Advances u and v (n_dofs,) by `tau` under the voids' barriers and nothing else. Held dofs stay
   where they are and count as at rest. Returns the number of substeps taken by the units at
   the voids, or -1 if they pass a barrier. */
int64_t contact_substeps_advance(
    double tau, double *u, double *v, const Substeps *splitting, const System *system,
    Flight *flight);
/* Takes derivatives by the end of a flight to its start, which is given in u and v: these are
   overwritten. `bar_held` of the flight receives those by the rotations of held units. */
void contact_substeps_advance_adjoint(
    double tau, double *u, double *v, double *bar_u, double *bar_v, const Substeps *splitting,
    const System *system, Flight *flight, const Bars *bars);

#endif
