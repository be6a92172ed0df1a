/* Contact on the angle of the voids: energy, gradient, tangent, mixed derivatives.

   Derived by hand from sim/energy/void_contact.py and tested against its automatic derivatives. Units
   are rigid, so the two voids beside a ligament open and close with the rotation of its first unit
   against its second, the "turn". */
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

static inline double curvature_of(const NetworkArrays *net, int64_t k, double turn) {
    return slopes_of(net, k, 0, turn).curvature + slopes_of(net, k, 1, turn).curvature;
}

double void_contact_kernels_add_gradient(
    double *motion, const NetworkArrays *net, double *out) {
    double total = 0.0;
    for (int64_t t = 0; t < net->n_touching; t++) {
        int64_t k = net->touching[t], a = 3 * net->unit[2 * k] + 2, b = 3 * net->unit[2 * k + 1] + 2;
        for (int side = 0; side < 2; side++) {
            Slopes v = slopes_of(net, k, side, motion[a] - motion[b]);
            total += v.energy;
            out[a] += v.slope;
            out[b] -= v.slope;
        }
    }
    return total;
}

void void_contact_kernels_add_tangent(
    double *motion, const NetworkArrays *net, int64_t *free, const Matrix *matrix) {
    for (int64_t t = 0; t < net->n_touching; t++) {
        int64_t k = net->touching[t], a = 3 * net->unit[2 * k] + 2, b = 3 * net->unit[2 * k + 1] + 2;
        double curvature = curvature_of(net, k, motion[a] - motion[b]);
        if (curvature > 0.0) {
            symmetric_add(matrix, free[a], free[a], curvature);
            symmetric_add(matrix, free[b], free[b], curvature);
            symmetric_add(matrix, free[a], free[b], -curvature);
        }
    }
}

void void_contact_kernels_add_hessian_product(
    double *motion, const NetworkArrays *net, double *direction, double *out) {
    for (int64_t t = 0; t < net->n_touching; t++) {
        int64_t k = net->touching[t], a = 3 * net->unit[2 * k] + 2, b = 3 * net->unit[2 * k + 1] + 2;
        double moment = curvature_of(net, k, motion[a] - motion[b]) * (direction[a] - direction[b]);
        out[a] += moment;
        out[b] -= moment;
    }
}

void void_contact_kernels_add_mixed(
    double *motion, const NetworkArrays *net, double *direction, int64_t *which,
    const Sensitivity *out, int64_t n_which) {
    if (net->n_touching == 0) return;
    for (int64_t w = 0; w < n_which; w++) {
        int64_t k = which[w], a = 3 * net->unit[2 * k] + 2, b = 3 * net->unit[2 * k + 1] + 2;
        double turning = direction[a] - direction[b];
        for (int side = 0; side < 2; side++) {
            Slopes v = slopes_of(net, k, side, motion[a] - motion[b]);
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
        int64_t k = net->touching[t], a = 3 * net->unit[2 * k] + 2, b = 3 * net->unit[2 * k + 1] + 2;
        double turn = motion[a] - motion[b], turning = step[a] - step[b];
        if (turning < 0.0) {
            double room = net->void_[2 * k] + turn - net->contact[3 * k + 1];
            largest = least(largest, room / -turning);
        } else if (turning > 0.0) {
            double room = net->void_[2 * k + 1] - turn - net->contact[3 * k + 1];
            largest = least(largest, room / turning);
        }
    }
    return largest;
}
