/* Contact on the angle of the voids: energy, gradient, tangent, mixed derivatives.

   Derived by hand from sim/energy/void_contact.py and tested against its automatic derivatives.
   Units are rigid, so the two voids beside a ligament open and close with the rotation of its first
   unit against its second, the "turn". */
#include "sim/core/numbers.h"
#include "sim/declarations.h"

#include <math.h>

/* Energy of one void and its first two derivatives by the turn; infinite past the barrier. */
typedef struct { double energy, slope, curvature; } Slopes;

static inline Slopes slopes_of(const NetworkArrays *net, int64_t k, int side, double turn) {
    double sign = 1.0 - 2.0 * side;
    double stiffness = net->contact[3 * k], barrier = net->contact[3 * k + 1];
    double cutoff = net->contact[3 * k + 2];
    double angle = net->void_[2 * k + side] + sign * turn;
    if (angle >= cutoff) return (Slopes){0.0, 0.0, 0.0};
    /* E = k w^2 x^2 / (2 (1 - x^2)) with x = (angle - cutoff) / w and w = cutoff - barrier */
    double width = cutoff - barrier;
    double x = (angle - cutoff) / width;
    if (x <= -1.0) return (Slopes){INFINITY, 0.0, 0.0};
    double rest = 1.0 - x * x;
    double scale = 0.5 * stiffness;
    return (Slopes){
        scale * width * width * x * x / rest,
        sign * scale * width * 2.0 * x / (rest * rest),
        scale * (2.0 + 6.0 * x * x) / (rest * rest * rest)};
}

void void_contact_kernels_void_slopes(
    const NetworkArrays *net, int64_t k, int64_t side, double turn, double *returned) {
    Slopes found = slopes_of(net, k, side, turn);
    returned[0] = found.energy, returned[1] = found.slope, returned[2] = found.curvature;
}

/* The rotations' dofs of the two units that a ligament joins, and its turn. */
typedef struct { int64_t a, b; double turn; } Joined;

static inline Joined joined_by(const NetworkArrays *net, int64_t k, const double *motion) {
    int64_t a = 3 * net->unit[2 * k] + 2, b = 3 * net->unit[2 * k + 1] + 2;
    return (Joined){a, b, motion[a] - motion[b]};
}

static inline double curvature_of(const NetworkArrays *net, int64_t k, double turn) {
    return slopes_of(net, k, 0, turn).curvature + slopes_of(net, k, 1, turn).curvature;
}

double void_contact_kernels_add_gradient(
    double *motion, const NetworkArrays *net, double *out) {
    double total = 0.0;
    for (int64_t t = 0; t < net->n_touching; t++) {
        int64_t k = net->touching[t];
        Joined by = joined_by(net, k, motion);
        for (int side = 0; side < 2; side++) {
            Slopes v = slopes_of(net, k, side, by.turn);
            total += v.energy;
            out[by.a] += v.slope;
            out[by.b] -= v.slope;
        }
    }
    return total;
}

void void_contact_kernels_add_tangent(
    double *motion, const NetworkArrays *net, int64_t *free, const Matrix *matrix) {
    for (int64_t t = 0; t < net->n_touching; t++) {
        int64_t k = net->touching[t];
        Joined by = joined_by(net, k, motion);
        double curvature = curvature_of(net, k, by.turn);
        if (curvature > 0.0) {
            symmetric_add(matrix, free[by.a], free[by.a], curvature);
            symmetric_add(matrix, free[by.b], free[by.b], curvature);
            symmetric_add(matrix, free[by.a], free[by.b], -curvature);
        }
    }
}

void void_contact_kernels_add_hessian_product(
    double *motion, const NetworkArrays *net, double *direction, double *out) {
    for (int64_t t = 0; t < net->n_touching; t++) {
        int64_t k = net->touching[t];
        Joined by = joined_by(net, k, motion);
        double moment = curvature_of(net, k, by.turn) * (direction[by.a] - direction[by.b]);
        out[by.a] += moment;
        out[by.b] -= moment;
    }
}

void void_contact_kernels_add_mixed(
    double *motion, const NetworkArrays *net, double *direction, int64_t *which,
    const Sensitivity *out, int64_t n_which) {
    if (net->n_touching == 0) return;
    for (int64_t w = 0; w < n_which; w++) {
        int64_t k = which[w];
        Joined by = joined_by(net, k, motion);
        double turning = direction[by.a] - direction[by.b];
        for (int side = 0; side < 2; side++) {
            Slopes v = slopes_of(net, k, side, by.turn);
            if (v.curvature > 0.0) {
                out->void_[2 * k + side] += (1.0 - 2.0 * side) * v.curvature * turning;
                out->contact[k] += v.slope / net->contact[3 * k] * turning;
            }
        }
    }
}

double void_contact_kernels_barrier_step(
    double *motion, const NetworkArrays *net, double *step) {
    double largest = INFINITY;
    for (int64_t t = 0; t < net->n_touching; t++) {
        int64_t k = net->touching[t];
        Joined by = joined_by(net, k, motion);
        double turning = step[by.a] - step[by.b];
        if (turning < 0.0) {
            double room = net->void_[2 * k] + by.turn - net->contact[3 * k + 1];
            largest = least(largest, room / -turning);
        } else if (turning > 0.0) {
            double room = net->void_[2 * k + 1] - by.turn - net->contact[3 * k + 1];
            largest = least(largest, room / turning);
        }
    }
    return largest;
}
