/* Loops over the ligaments: energy, gradient, tangent and mixed derivatives.

   Derived by hand from sim/energy/ligament.py and tested against its automatic derivatives. With d
   the current ligament vector, n and t the unit vectors along and across it, L its length and l0
   that at rest, gamma its shear angle, kappa the relative rotation of its units,

       dW/dd = k_l (L - l0) n + k_s l0^2 gamma t / L,
       dW/dtheta = -k_s l0^2 gamma / 2 -+ k_b kappa,

   each strain taken from its natural value (zero but where a ligament is not free of stress at
   rest), and the motions of the two units enter through

       d = vector + (u_b + R_b r_b - r_b) - (u_a + R_a r_a - r_a). */
#include "sim/core/numbers.h"
#include "sim/declarations.h"

#include <math.h>
#include <string.h>

/* Fills cos and sin of all rotations, from those of their halves, and these. */
static void trigonometry(const double *motion, int64_t n_units, double *turn) {
    for (int64_t unit = 0; unit < n_units; unit++) {
        double half = 0.5 * motion[3 * unit + 2];
        double c = cos(half), s = sin(half);
        double *t = turn + 4 * unit;
        t[0] = (c - s) * (c + s);
        t[1] = 2.0 * s * c;
        t[2] = c;
        t[3] = s;
    }
}

/* The arms R_a r_a and R_b r_b of both ends, and the ligament's vector d. */
typedef struct { double pax, pay, pbx, pby, dx, dy; } Rotated;
/* L, l0, and the stretch L - l0 and relative rotation kappa from their natural values. */
typedef struct { double length, rest, stretch, bend; } Lengths;
/* First derivatives of W: by d, and by the rotation of either unit with d held. */
typedef struct { double gx, gy, wa, wb; } Forces;
/* Second derivatives of W: by d twice, and by d and the rotation of either unit. */
typedef struct { double hxx, hxy, hyy, mx, my; } Second;

static inline Rotated rotated(const double *motion, const double *turn, const NetworkArrays *net, int64_t k) {
    int64_t a = net->unit[2 * k], b = net->unit[2 * k + 1];
    double ca = turn[4 * a], sa = turn[4 * a + 1], cb = turn[4 * b], sb = turn[4 * b + 1];
    const double *arm = net->arm + 4 * k, *v = net->vector + 2 * k;
    Rotated r;
    r.pax = ca * arm[0] - sa * arm[1];
    r.pay = sa * arm[0] + ca * arm[1];
    r.pbx = cb * arm[2] - sb * arm[3];
    r.pby = sb * arm[2] + cb * arm[3];
    r.dx = v[0] + (motion[3 * b] + r.pbx - arm[2]) - (motion[3 * a] + r.pax - arm[0]);
    r.dy = v[1] + (motion[3 * b + 1] + r.pby - arm[3]) - (motion[3 * a + 1] + r.pay - arm[1]);
    return r;
}

static inline double shear_of(const double *turn, const NetworkArrays *net, int64_t k, double dx, double dy) {
    const double *a = turn + 4 * net->unit[2 * k], *b = turn + 4 * net->unit[2 * k + 1];
    double vx = net->vector[2 * k], vy = net->vector[2 * k + 1];
    double ch = a[2] * b[2] - a[3] * b[3];
    double sh = a[3] * b[2] + a[2] * b[3];
    double ex = ch * vx - sh * vy, ey = sh * vx + ch * vy;
    /* gamma: angle from the reference vector, turned by the mean of both rotations, to d */
    return atan2(ex * dy - ey * dx, ex * dx + ey * dy) - net->natural[3 * k + 1];
}

static inline Lengths lengths(const double *motion, const NetworkArrays *net, int64_t k, double dx, double dy) {
    int64_t a = net->unit[2 * k], b = net->unit[2 * k + 1];
    double vx = net->vector[2 * k], vy = net->vector[2 * k + 1];
    Lengths l;
    l.length = sqrt(dx * dx + dy * dy);
    l.rest = sqrt(vx * vx + vy * vy);
    l.stretch = l.length - l.rest - net->natural[3 * k];
    l.bend = motion[3 * b + 2] - motion[3 * a + 2] - net->natural[3 * k + 2];
    return l;
}

static inline Forces forces(const NetworkArrays *net, int64_t k, double dx, double dy, Lengths l, double shear) {
    const double *law = net->law + 3 * k;
    /* dW/dd = k_l (L - l0) n + k_s l0^2 gamma t / L; dW/dtheta = -k_s l0^2 gamma / 2 -+ k_b kappa */
    double nx = dx / l.length, ny = dy / l.length;
    double tension = law[0] * l.stretch;
    double torque = law[1] * l.rest * l.rest * shear;
    double moment = law[2] * l.bend;
    Forces f;
    f.gx = tension * nx - torque * ny / l.length;
    f.gy = tension * ny + torque * nx / l.length;
    f.wa = -0.5 * torque - moment;
    f.wb = -0.5 * torque + moment;
    return f;
}

static inline Second second(const NetworkArrays *net, int64_t k, double dx, double dy, Lengths l, double shear) {
    /* d2W/dd2 = k_l n n' + (k_l (L - l0) / L + k_s l0^2 / L^2) t t'
                 - k_s l0^2 gamma / L^2 (n t' + t n'),
       d2W/dd dtheta = -k_s l0^2 t / (2 L) */
    double nx = dx / l.length, ny = dy / l.length;
    double axial = net->law[3 * k], torsion = net->law[3 * k + 1] * l.rest * l.rest;
    double along = axial;
    double across = axial * l.stretch / l.length + torsion / (l.length * l.length);
    double mixed = -torsion * shear / (l.length * l.length);
    Second h;
    h.hxx = along * nx * nx + across * ny * ny - 2.0 * mixed * nx * ny;
    h.hyy = along * ny * ny + across * nx * nx + 2.0 * mixed * nx * ny;
    h.hxy = (along - across) * nx * ny + mixed * (nx * nx - ny * ny);
    h.mx = 0.5 * torsion * ny / l.length;
    h.my = -0.5 * torsion * nx / l.length;
    return h;
}

void ligament_kernels_locate(
    double *motion, const NetworkArrays *net, const Kinematics *kinematics) {
    trigonometry(motion, kinematics->n_turn, kinematics->turn);
    for (int64_t k = 0; k < net->n_unit; k++) {
        Rotated r = rotated(motion, kinematics->turn, net, k);
        kinematics->shear[k] = shear_of(kinematics->turn, net, k, r.dx, r.dy);
    }
}

void ligament_kernels_largest_strains(
    double *motion, const NetworkArrays *net, const Kinematics *kinematics, double *out) {
    out[0] = out[1] = out[2] = 0.0;
    EACH(k, net->n_unit) {
        const double *natural = net->natural + 3 * k;
        Rotated r = rotated(motion, kinematics->turn, net, k);
        Lengths l = lengths(motion, net, k, r.dx, r.dy);
        double strain[3] = {
            (l.stretch + natural[0]) / l.rest, kinematics->shear[k] + natural[1], l.bend + natural[2]};
        EACH(m, 3) out[m] = isnan(strain[m]) ? strain[m] : most(out[m], fabs(strain[m]));
    }
}

double ligament_kernels_gradient(
    double *motion, const NetworkArrays *net, const Kinematics *kinematics,
    double *out) {
    double strain_energy = 0.0;
    trigonometry(motion, kinematics->n_turn, kinematics->turn);
    memset(out, 0, sizeof(double) * 3 * kinematics->n_turn);
    for (int64_t k = 0; k < net->n_unit; k++) {
        int64_t a = 3 * net->unit[2 * k], b = 3 * net->unit[2 * k + 1];
        const double *law = net->law + 3 * k;
        Rotated r = rotated(motion, kinematics->turn, net, k);
        Lengths l = lengths(motion, net, k, r.dx, r.dy);
        double shear = shear_of(kinematics->turn, net, k, r.dx, r.dy);
        kinematics->shear[k] = shear;
        Forces f = forces(net, k, r.dx, r.dy, l, shear);
        /* W = k_l (L - l0)^2 / 2 + k_s (l0 gamma)^2 / 2 + k_b kappa^2 / 2 */
        strain_energy += 0.5 * (
            law[0] * (l.stretch * l.stretch)
            + law[1] * ((l.rest * shear) * (l.rest * shear))
            + law[2] * l.bend * l.bend);
        out[a] -= f.gx;
        out[a + 1] -= f.gy;
        out[a + 2] += f.wa + f.gx * r.pay - f.gy * r.pax;
        out[b] += f.gx;
        out[b + 1] += f.gy;
        out[b + 2] += f.wb - f.gx * r.pby + f.gy * r.pbx;
    }
    return strain_energy;
}

/* Fills the lower half of the Hessian in the dofs (u_a, theta_a, u_b, theta_b). */
static inline void ligament_block(
    int64_t k, const double *motion, const Kinematics *kinematics, const NetworkArrays *net, double block[6][6]) {
    Rotated r = rotated(motion, kinematics->turn, net, k);
    Lengths l = lengths(motion, net, k, r.dx, r.dy);
    Forces f = forces(net, k, r.dx, r.dy, l, kinematics->shear[k]);
    Second h = second(net, k, r.dx, r.dy, l, kinematics->shear[k]);
    double torsion = 0.25 * net->law[3 * k + 1] * l.rest * l.rest, bending = net->law[3 * k + 2];
    /* dd/dtheta_a = (pay, -pax), dd/dtheta_b = (-pby, pbx); the second ones are R_a r_a, -R_b r_b */
    double hax = h.hxx * r.pay - h.hxy * r.pax, hay = h.hxy * r.pay - h.hyy * r.pax;
    double hbx = -h.hxx * r.pby + h.hxy * r.pbx, hby = -h.hxy * r.pby + h.hyy * r.pbx;
    double across_a = h.mx * r.pay - h.my * r.pax, across_b = h.my * r.pbx - h.mx * r.pby;
    block[0][0] = block[3][3] = h.hxx;
    block[1][0] = block[4][3] = h.hxy;
    block[1][1] = block[4][4] = h.hyy;
    block[3][0] = -h.hxx;
    block[3][1] = block[4][0] = -h.hxy;
    block[4][1] = -h.hyy;
    block[2][0] = -hax - h.mx;
    block[2][1] = -hay - h.my;
    block[3][2] = hax + h.mx;
    block[4][2] = hay + h.my;
    block[5][0] = -hbx - h.mx;
    block[5][1] = -hby - h.my;
    block[5][3] = hbx + h.mx;
    block[5][4] = hby + h.my;
    double stiff = torsion + bending;
    block[2][2] = r.pay * hax - r.pax * hay + 2.0 * across_a + stiff + f.gx * r.pax + f.gy * r.pay;
    block[5][2] = r.pay * hbx - r.pax * hby + across_a + across_b + torsion - bending;
    block[5][5] = r.pbx * hby - r.pby * hbx + 2.0 * across_b + stiff - f.gx * r.pbx - f.gy * r.pby;
}

void ligament_kernels_tangent(
    double *motion, const NetworkArrays *net, const Kinematics *kinematics,
    int64_t *entries, double *values) {
    double block[6][6];
    for (int64_t k = 0; k < net->n_unit; k++) {
        ligament_block(k, motion, kinematics, net, block);
        const int64_t *at = entries + 21 * k;
        for (int row = 0; row < 6; row++)
            for (int column = 0; column <= row; column++, at++)
                if (*at >= 0) values[*at] += block[row][column];
    }
}

/* Rates along a direction: of the rotations of both units, of d, and of dW/dd. */
typedef struct { double la, lb, ex, ey, fx, fy; } Rates;

static inline Rates rates_of(const double *direction, const NetworkArrays *net, int64_t k, Rotated r, Second h) {
    int64_t a = 3 * net->unit[2 * k], b = 3 * net->unit[2 * k + 1];
    double la = direction[a + 2], lb = direction[b + 2];
    double ex = direction[b] - direction[a] - r.pby * lb + r.pay * la;
    double ey = direction[b + 1] - direction[a + 1] + r.pbx * lb - r.pax * la;
    double fx = h.hxx * ex + h.hxy * ey + h.mx * (la + lb);
    double fy = h.hxy * ex + h.hyy * ey + h.my * (la + lb);
    return (Rates){la, lb, ex, ey, fx, fy};
}

void ligament_kernels_hessian_product(
    double *motion, const NetworkArrays *net, const Kinematics *kinematics,
    double *direction, double *out) {
    memset(out, 0, sizeof(double) * 3 * kinematics->n_turn);
    for (int64_t k = 0; k < net->n_unit; k++) {
        int64_t a = 3 * net->unit[2 * k], b = 3 * net->unit[2 * k + 1];
        Rotated r = rotated(motion, kinematics->turn, net, k);
        Lengths l = lengths(motion, net, k, r.dx, r.dy);
        Forces f = forces(net, k, r.dx, r.dy, l, kinematics->shear[k]);
        Second h = second(net, k, r.dx, r.dy, l, kinematics->shear[k]);
        Rates d = rates_of(direction, net, k, r, h);
        double fx = d.fx, fy = d.fy, la = d.la, lb = d.lb;
        double torsion = 0.25 * net->law[3 * k + 1] * l.rest * l.rest, bending = net->law[3 * k + 2];
        double common = h.mx * d.ex + h.my * d.ey + torsion * (la + lb);
        out[a] -= fx;
        out[a + 1] -= fy;
        out[a + 2] += fx * r.pay - fy * r.pax + common + bending * (la - lb)
                      + (f.gx * r.pax + f.gy * r.pay) * la;
        out[b] += fx;
        out[b + 1] += fy;
        out[b + 2] += -fx * r.pby + fy * r.pbx + common + bending * (lb - la)
                      - (f.gx * r.pbx + f.gy * r.pby) * lb;
    }
}

/* Adds what the force on one end gives its arm: dd = sign (R - I) dr, and the arm also turns with
   the direction. */
static inline void add_arm(
    double sign, const double *turn, double spin, Rates d, Forces f, double *out) {
    double c = turn[0], s = turn[1], hx = d.fx + spin * f.gy, hy = d.fy - spin * f.gx;
    out[0] += sign * (c * hx + s * hy - d.fx);
    out[1] += sign * (-s * hx + c * hy - d.fy);
}

void ligament_kernels_mixed(
    double *motion, const NetworkArrays *net, const Kinematics *kinematics,
    double *direction, int64_t *which, const Sensitivity *out, int64_t n_which) {
    for (int64_t w = 0; w < n_which; w++) {
        int64_t k = which[w], a = net->unit[2 * k], b = net->unit[2 * k + 1];
        double shear = kinematics->shear[k];
        Rotated r = rotated(motion, kinematics->turn, net, k);
        Lengths l = lengths(motion, net, k, r.dx, r.dy);
        Forces f = forces(net, k, r.dx, r.dy, l, shear);
        Second h = second(net, k, r.dx, r.dy, l, shear);
        Rates d = rates_of(direction, net, k, r, h);
        add_arm(-1.0, kinematics->turn + 4 * a, d.la, d, f, out->arm + 4 * k);
        add_arm(1.0, kinematics->turn + 4 * b, d.lb, d, f, out->arm + 4 * k + 2);
        /* k_l (L - l0) dL + k_s l0^2 gamma dgamma, with the rates dL and dgamma along the direction,
           by l0 and by the angle of the vector (over l0^2) */
        const double *law = net->law + 3 * k;
        double nx = r.dx / l.length, ny = r.dy / l.length;
        double stretching = nx * d.ex + ny * d.ey;
        double shearing = (nx * d.ey - ny * d.ex) / l.length - 0.5 * (d.la + d.lb);
        double vx = net->vector[2 * k], vy = net->vector[2 * k + 1];
        double by_rest = -law[0] * stretching + 2.0 * law[1] * l.rest * shear * shearing;
        double by_direction = -law[1] * shearing;
        out->vector[2 * k] += d.fx + by_rest * vx / l.rest - by_direction * vy;
        out->vector[2 * k + 1] += d.fy + by_rest * vy / l.rest + by_direction * vx;
        out->law[3 * k] += l.stretch * stretching;
        out->law[3 * k + 1] += l.rest * l.rest * shear * shearing;
        out->law[3 * k + 2] += l.bend * (d.lb - d.la);
        out->natural[3 * k] -= law[0] * stretching;
        out->natural[3 * k + 1] -= law[1] * l.rest * l.rest * shearing;
        out->natural[3 * k + 2] -= law[2] * (d.lb - d.la);
    }
}
