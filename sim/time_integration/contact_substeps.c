/* Moves the units between two kicks, with contact on void angles, and back.

   Units fly straight on but where a void is closed to its cutoff: there the barrier turns them
   back, the faster the deeper they are. This part of the motion is local and needs no ligament's
   force, so the rotations of those units take substeps of the same splitting (drift and kick), as
   many as the depth asks for that their energy can carry them to. The steps of all else need not
   follow the barrier. */
#include "sim/time_integration/time_integration.h"

#include <stdlib.h>

/* Voids that may come as near as this (2 degrees) to their cutoff during a flight are followed in
   it. */
static const double MARGIN = 0.03490658503988659;
/* Stiffness of voids that share units, over that of one alone. */
static const double SHARED = 2.0;
/* Substeps of one flight at most. */
enum { MOST = 4096 };

Flight contact_substeps_flight_of(const int64_t *watched, int64_t n_watched, int64_t n_units) {
    int64_t *near = calloc(n_watched + 2 * n_units, sizeof(int64_t));
    double *angle = calloc(4 * n_units, sizeof(double));
    return (Flight){
        .watched = watched, .n_watched = n_watched, .near = near, .units = near + n_watched,
        .listed = near + n_watched + n_units, .angle = angle, .rate = angle + n_units,
        .force = angle + 2 * n_units, .bar_held = angle + 3 * n_units};
}

void contact_substeps_free(Flight *flight) {
    free(flight->near);
    free(flight->angle);
}

/* The dofs of the rotations of the two units that a ligament joins, and these. */
typedef struct {
    int64_t a, b, turn_a, turn_b;
} EndDofs;

static inline EndDofs end_dofs(const System *system, int64_t k) {
    int64_t a = system->net.unit[2 * k], b = system->net.unit[2 * k + 1];
    return (EndDofs){a, b, 3 * a + 2, 3 * b + 2};
}

/* Energy of one void and its first two derivatives by the turn. */
typedef struct {
    double energy, slope, curvature;
} Slopes;

static inline Slopes slopes_of(const System *system, int64_t k, int64_t side, double turn) {
    double found[3];
    void_contact_kernels_void_slopes(&system->net, k, side, turn, found);
    return (Slopes){found[0], found[1], found[2]};
}

/* Notes a unit beside a void that may come to contact, once, and where it is. */
static void list_unit(int64_t unit, const double *u, const double *v, Flight *flight) {
    if (flight->listed[unit]) return;
    flight->listed[unit] = 1;
    flight->units[flight->n_units++] = unit;
    flight->angle[unit] = u[3 * unit + 2];
    flight->rate[unit] = v[3 * unit + 2];
}

/* Notes the voids that may come to contact within `tau`, and the units beside them. */
static void find_near_voids(
    double tau, const double *u, const double *v, const System *system, Flight *flight) {
    const NetworkArrays *net = &system->net;
    EACH(i, flight->n_units) flight->listed[flight->units[i]] = 0;
    flight->n_near = flight->n_units = 0;
    EACH(i, flight->n_watched) {
        int64_t k = flight->watched[i];
        EndDofs by = end_dofs(system, k);
        double turn = u[by.turn_a] - u[by.turn_b];
        double turning = tau * (v[by.turn_a] - v[by.turn_b]);
        double one = net->void_[2 * k] + turn + least(turning, 0.0);
        double other = net->void_[2 * k + 1] - turn - most(turning, 0.0);
        if (least(one, other) < net->contact[3 * k + 2] + MARGIN) {
            flight->near[flight->n_near++] = k;
            list_unit(by.a, u, v, flight);
            list_unit(by.b, u, v, flight);
        }
    }
}

/* Reciprocal rotational inertia of a unit, zero if its rotation is held. */
static inline double inverse_inertia_of(int64_t unit, const System *system) {
    int64_t d = 3 * unit + 2;
    return system->free[d] >= 0 ? 1.0 / system->mass[d] : 0.0;
}

/* Curvature of a void's barrier where all of an energy E is in it: by x^2 = E / (E + s), with
   s = k w^2 / 2 and w = cutoff - barrier, it is k / 2 (2 + 6 x^2) / (1 - x^2)^3. */
static double curvature_at(double energy, const double *law) {
    double stiffness = law[0], barrier = law[1], cutoff = law[2];
    double scale = 0.5 * stiffness * square(cutoff - barrier);
    double rest = scale / (scale + energy);
    return 0.5 * stiffness * (8.0 - 6.0 * rest) / (rest * (rest * rest));
}

/* Counts the substeps that follow the barrier where the energy of each void can carry it: the
   frequency there is the root of the curvature times the two units' inverse inertias. */
static int64_t count_substeps(
    double tau, const Substeps *splitting, const System *system, const Flight *flight) {
    double fastest = 0.0;
    EACH(i, flight->n_near) {
        int64_t k = flight->near[i];
        EndDofs by = end_dofs(system, k);
        double inverse_inertia =
            inverse_inertia_of(by.a, system) + inverse_inertia_of(by.b, system);
        if (inverse_inertia > 0.0) {
            double turn = flight->angle[by.a] - flight->angle[by.b];
            double rate = flight->rate[by.a] - flight->rate[by.b];
            double energy = 0.5 * rate * rate / inverse_inertia;
            EACH(side, 2) energy += slopes_of(system, k, side, turn).energy;
            double curvature = curvature_at(energy, system->net.contact + 3 * k);
            fastest = most(fastest, SHARED * curvature * inverse_inertia);
        }
    }
    double steps = fabs(tau) * sqrt(fastest) / splitting->longest;
    return steps <= MOST ? (int64_t)ceil(most(steps, 1.0)) : MOST + 1;
}

/* Fills the moments of the barriers on the units at these voids; tells whether none is passed. */
static bool fill_moments(const double *u, const System *system, Flight *flight) {
    EACH(i, flight->n_units) flight->force[flight->units[i]] = 0.0;
    EACH(i, flight->n_near) {
        int64_t k = flight->near[i];
        EndDofs by = end_dofs(system, k);
        EACH(side, 2) {
            Slopes of = slopes_of(system, k, side, u[by.turn_a] - u[by.turn_b]);
            if (!(of.energy < INFINITY)) return false;
            flight->force[by.a] += of.slope;
            flight->force[by.b] -= of.slope;
        }
    }
    return true;
}

/* Adds tau v to the rotations of the units at these voids. */
static void drift(double tau, double *u, const double *v, const Flight *flight) {
    EACH(i, flight->n_units) {
        int64_t d = 3 * flight->units[i] + 2;
        u[d] += tau * v[d];
    }
}

/* Takes tau M^-1 dW/du, by the moments in the flight, from their velocities. */
static void kick(double tau, double *v, const System *system, const Flight *flight) {
    EACH(i, flight->n_units) {
        int64_t unit = flight->units[i];
        v[3 * unit + 2] -= tau * inverse_inertia_of(unit, system) * flight->force[unit];
    }
}

/* Takes the units at these voids through n substeps; tells whether no barrier is passed. */
static bool take_substeps(
    double tau, int64_t n, double *u, double *v, const Substeps *splitting,
    const System *system, Flight *flight) {
    EACH(i, flight->n_units) {
        int64_t unit = flight->units[i];
        u[3 * unit + 2] = flight->angle[unit];
        v[3 * unit + 2] = flight->rate[unit];
    }
    double delta = tau / n;
    EACH(step, n) {
        EACH(m, splitting->n_kicks) {
            drift(splitting->drifts[m] * delta, u, v, flight);
            if (!fill_moments(u, system, flight)) return false;
            kick(splitting->kicks[m] * delta, v, system, flight);
        }
        drift(splitting->drifts[splitting->n_drifts - 1] * delta, u, v, flight);
    }
    return true;
}

int64_t contact_substeps_advance(
    double tau, double *u, double *v, const Substeps *splitting, const System *system,
    Flight *flight) {
    find_near_voids(tau, u, v, system, flight);
    EACH(i, system->n_dofs) u[system->dofs[i]] += tau * v[system->dofs[i]];
    if (flight->n_near == 0) return 0;
    for (int64_t n = count_substeps(tau, splitting, system, flight); n <= MOST; n *= 2)
        if (take_substeps(tau, n, u, v, splitting, system, flight)) return n;
    return -1;
}

/* Adjoint of `kick` at the moments held in the flight. */
static void kick_adjoint(
    double weight, const double *u, double *bar_u, const double *bar_v, const System *system,
    const Flight *flight, const Bars *bars) {
    const Sensitivity *out = &bars->sensitivity;
    EACH(i, flight->n_units) {
        int64_t unit = flight->units[i], d = 3 * unit + 2;
        double inverse = inverse_inertia_of(unit, system);
        bars->mass[d] += weight * inverse * inverse * flight->force[unit] * bar_v[d];
    }
    EACH(i, flight->n_near) {
        int64_t k = flight->near[i];
        EndDofs by = end_dofs(system, k);
        double turning = -weight * (
            inverse_inertia_of(by.a, system) * bar_v[by.turn_a]
            - inverse_inertia_of(by.b, system) * bar_v[by.turn_b]);
        EACH(side, 2) {
            Slopes of = slopes_of(system, k, side, u[by.turn_a] - u[by.turn_b]);
            double moment = of.curvature * turning;
            out->void_[2 * k + side] += (1.0 - 2.0 * side) * moment;
            out->contact[k] += of.slope / system->net.contact[3 * k] * turning;
            bar_u[by.turn_a] += moment;
            bar_u[by.turn_b] -= moment;
        }
    }
}

/* Adjoint of `drift`, which it undoes. */
static void drift_adjoint(
    double weight, double *u, const double *v, const double *bar_u, double *bar_v,
    const System *system, const Flight *flight) {
    EACH(i, flight->n_units) {
        int64_t d = 3 * flight->units[i] + 2;
        if (system->free[d] >= 0) bar_v[d] += weight * bar_u[d];
    }
    drift(-weight, u, v, flight);
}

/* Adjoint of `take_substeps` from its end; the states come back as they went, to rounding. */
static void substeps_adjoint(
    double tau, int64_t n, double *u, double *v, double *bar_u, double *bar_v,
    const Substeps *splitting, const System *system, Flight *flight, const Bars *bars) {
    double delta = tau / n;
    EACH(step, n) for (int64_t m = splitting->n_kicks; m >= 0; m--) {
        drift_adjoint(splitting->drifts[m] * delta, u, v, bar_u, bar_v, system, flight);
        if (m > 0) {
            double weight = splitting->kicks[m - 1] * delta;
            fill_moments(u, system, flight);
            kick(-weight, v, system, flight);
            kick_adjoint(weight, u, bar_u, bar_v, system, flight, bars);
        }
    }
}

void contact_substeps_advance_adjoint(
    double tau, double *u, double *v, double *bar_u, double *bar_v, const Substeps *splitting,
    const System *system, Flight *flight, const Bars *bars) {
    int64_t n = contact_substeps_advance(tau, u, v, splitting, system, flight);
    EACH(i, flight->n_units) {
        int64_t d = 3 * flight->units[i] + 2;
        if (system->free[d] < 0) bar_u[d] = 0.0;
    }
    EACH(i, system->n_dofs) {
        int64_t d = system->dofs[i];
        if (n == 0 || d % 3 != 2 || !flight->listed[d / 3]) bar_v[d] += tau * bar_u[d];
    }
    if (n > 0) substeps_adjoint(tau, n, u, v, bar_u, bar_v, splitting, system, flight, bars);
    EACH(i, flight->n_units) {
        int64_t unit = flight->units[i], d = 3 * unit + 2;
        if (system->free[d] < 0) flight->bar_held[unit] = bar_u[d];
    }
}
