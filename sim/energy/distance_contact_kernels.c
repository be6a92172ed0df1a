/* Contact of units on their distance: energy, gradient, tangent, mixed derivatives.

   Derived by hand from sim/energy/distance_contact.py and tested against its automatic derivatives.
   Units are rigid, so each term is a function of where its vertex v lies in the frame of the other
   unit b: with g its gradient by v, r_a and r_b the arms of v from the two centroids, and J a
   quarter turn,

       dE/d(u_a, theta_a, u_b, theta_b) = (g, J r_a . g, -g, -J r_b . g).

   The term of an edge is a function of the vertex's distance s outside its line and its position x
   along it; with t and n the edge's direction and outer normal g = E_s n + E_x t. */
#include "sim/collision/collision.h"

#include <math.h>

/* A function and its first two derivatives. */
typedef struct {
    double value, slope, curvature;
} Jet;

/* Barrier by a squared distance. */
static inline Jet barrier(double square, const ContactArrays *contacts) {
    /* E = energy (1 - q)^3 / q with q = square / distance^2 */
    double unit = contacts->distance * contacts->distance;
    double q = square / unit, energy = contacts->energy, left = 1.0 - q;
    return (Jet){
        energy * (left * (left * left)) / q,
        energy / unit * (3.0 - 2.0 * q - 1.0 / (q * q)),
        energy / (unit * unit) * (2.0 / (q * q * q) - 2.0)};
}

/* Weight by the length from the end of an edge. */
static inline Jet fade(double length, double distance) {
    /* w = 10 x^3 - 15 x^4 + 6 x^5 with x = length / distance */
    double x = length / distance;
    if (x >= 1.0) return (Jet){1.0, 0.0, 0.0};
    return (Jet){
        x * x * x * (10.0 - 15.0 * x + 6.0 * x * x),
        30.0 * x * x * (1.0 - x) * (1.0 - x) / distance,
        60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (distance * distance)};
}

/* Direction of an edge, its length, and the vertex's distance s and position x. */
typedef struct {
    double tx, ty, length, s, x;
} Frame;

static inline Frame frame_of(Term term, const ContactArrays *contacts) {
    const double *place = contacts->cache.place;
    Vec p = at(place, term.p), e = between(p, at(place, term.q)), d = between(p, at(place, term.v));
    double length = sqrt(e.x * e.x + e.y * e.y), tx = e.x / length, ty = e.y / length;
    return (Frame){tx, ty, length, d.x * ty - d.y * tx, d.x * tx + d.y * ty};
}

/* Energy of a vertex and an edge, and its derivatives by s, x and the edge's length l. */
typedef struct {
    double energy, s, x, l, ss, sx, xx, sl, xl;
} EdgeSlopes;

static inline EdgeSlopes edge_slopes(Frame f, const ContactArrays *contacts) {
    /* E = w(x) w(l - x) B(s^2) */
    Jet b = barrier(f.s * f.s, contacts);
    Jet one = fade(f.x, contacts->distance), two = fade(f.length - f.x, contacts->distance);
    double weight = one.value * two.value;
    double rising = one.slope * two.value - one.value * two.slope;
    double bent = one.curvature * two.value - 2.0 * one.slope * two.slope
                  + one.value * two.curvature;
    double slope = 2.0 * f.s * b.slope, curvature = 2.0 * b.slope + 4.0 * f.s * f.s * b.curvature;
    return (EdgeSlopes){
        weight * b.value,
        weight * slope,
        rising * b.value,
        one.value * two.slope * b.value,
        weight * curvature,
        rising * slope,
        bent * b.value,
        one.value * two.slope * slope,
        (one.slope * two.slope - one.value * two.curvature) * b.value};
}

/* Energy of a term, its gradient and Hessian by the vertex. */
typedef struct {
    double energy, x, y, xx, xy, yy;
} Slopes;

static inline Slopes slopes_of(Term term, const ContactArrays *contacts) {
    if (term.q < 0) {
        const double *place = contacts->cache.place;
        Vec d = between(at(place, term.p), at(place, term.v));
        Jet b = barrier(d.x * d.x + d.y * d.y, contacts);
        double slope = 2.0 * b.slope, twice = 4.0 * b.curvature;
        return (Slopes){
            b.value,
            slope * d.x,
            slope * d.y,
            slope + twice * d.x * d.x,
            twice * d.x * d.y,
            slope + twice * d.y * d.y};
    }
    Frame f = frame_of(term, contacts);
    EdgeSlopes e = edge_slopes(f, contacts);
    double tx = f.tx, ty = f.ty;
    return (Slopes){
        e.energy,
        e.s * ty + e.x * tx,
        -e.s * tx + e.x * ty,
        e.ss * ty * ty + 2.0 * e.sx * tx * ty + e.xx * tx * tx,
        -e.ss * tx * ty + e.sx * (ty * ty - tx * tx) + e.xx * tx * ty,
        e.ss * tx * tx - 2.0 * e.sx * tx * ty + e.xx * ty * ty};
}

/* The two units of a term, and the arms of its vertex from their centroids. */
typedef struct {
    int64_t a, b;
    double ax, ay, bx, by;
} Arms;

static inline Arms arms_of(Term term, const ContactArrays *contacts) {
    int64_t a = contacts->owner[term.v], b = contacts->owner[term.p];
    Vec v = at(contacts->cache.place, term.v);
    Vec from_a = between(at(contacts->cache.centre, a), v);
    Vec from_b = between(at(contacts->cache.centre, b), v);
    return (Arms){a, b, from_a.x, from_a.y, from_b.x, from_b.y};
}

double distance_contact_kernels_add_gradient(
    double *motion, const ContactArrays *contacts, double *out) {
    int64_t count = neighbour_list_find(motion, contacts);
    if (count < 0) return INFINITY;
    double total = 0.0;
    for (int64_t k = 0; k < count; k++) {
        Term term = term_of(k, contacts);
        Slopes g = slopes_of(term, contacts);
        Arms r = arms_of(term, contacts);
        total += g.energy;
        out[3 * r.a] += g.x;
        out[3 * r.a + 1] += g.y;
        out[3 * r.a + 2] += r.ax * g.y - r.ay * g.x;
        out[3 * r.b] -= g.x;
        out[3 * r.b + 1] -= g.y;
        out[3 * r.b + 2] -= r.bx * g.y - r.by * g.x;
    }
    return total;
}

/* Fills the lower half of the Hessian of a term in the dofs of its two units. */
static void fill_block(Term term, Arms r, const ContactArrays *contacts, double block[6][6]) {
    Slopes g = slopes_of(term, contacts);
    /* how the vertex moves in the other unit's frame, by each dof */
    double moves[6][2] = {{1.0, 0.0}, {0.0, 1.0}, {-r.ay, r.ax}, {-1.0, 0.0}, {0.0, -1.0},
                          {r.by, -r.bx}};
    for (int row = 0; row < 6; row++) {
        double mx = moves[row][0], my = moves[row][1];
        double hx = g.xx * mx + g.xy * my, hy = g.xy * mx + g.yy * my;
        for (int column = 0; column <= row; column++)
            block[row][column] = hx * moves[column][0] + hy * moves[column][1];
    }
    block[2][2] -= g.x * r.ax + g.y * r.ay;
    block[5][5] -= g.x * r.bx + g.y * r.by;
    block[5][0] -= g.y;
    block[5][1] += g.x;
    block[5][2] += g.x * r.ax + g.y * r.ay;
    block[5][3] += g.y;
    block[5][4] -= g.x;
}

void distance_contact_kernels_add_tangent(
    double *motion, const ContactArrays *contacts, int64_t *free, const Matrix *matrix) {
    int64_t place[6], count = neighbour_list_find(motion, contacts);
    double block[6][6];
    for (int64_t k = 0; k < count; k++) {
        Term term = term_of(k, contacts);
        Arms r = arms_of(term, contacts);
        fill_block(term, r, contacts, block);
        for (int m = 0; m < 3; m++) place[m] = free[3 * r.a + m], place[3 + m] = free[3 * r.b + m];
        for (int row = 0; row < 6; row++)
            for (int column = 0; column <= row; column++)
                symmetric_add(matrix, place[row], place[column], block[row][column]);
    }
}

/* Derivatives along a direction: of a term's vertex in the other unit's frame, of its gradient. */
typedef struct {
    double mx, my, rx, ry;
} Rates;

static inline Rates rates_of(Slopes g, Arms r, const double *direction) {
    double la = direction[3 * r.a + 2], lb = direction[3 * r.b + 2];
    double mx = direction[3 * r.a] - direction[3 * r.b] - la * r.ay + lb * r.by;
    double my = direction[3 * r.a + 1] - direction[3 * r.b + 1] + la * r.ax - lb * r.bx;
    return (Rates){
        mx, my, g.xx * mx + g.xy * my - lb * g.y, g.xy * mx + g.yy * my + lb * g.x};
}

void distance_contact_kernels_add_hessian_product(
    double *motion, const ContactArrays *contacts, double *direction, double *out) {
    int64_t count = neighbour_list_find(motion, contacts);
    for (int64_t k = 0; k < count; k++) {
        Term term = term_of(k, contacts);
        Slopes g = slopes_of(term, contacts);
        Arms r = arms_of(term, contacts);
        Rates d = rates_of(g, r, direction);
        double la = direction[3 * r.a + 2], lb = direction[3 * r.b + 2];
        out[3 * r.a] += d.rx;
        out[3 * r.a + 1] += d.ry;
        out[3 * r.a + 2] += r.ax * d.ry - r.ay * d.rx - la * (r.ax * g.x + r.ay * g.y);
        out[3 * r.b] -= d.rx;
        out[3 * r.b + 1] -= d.ry;
        /* the arm r_b changes by the vertex's motion in b's frame, and turns with b */
        double mx = d.mx - lb * r.by, my = d.my + lb * r.bx;
        out[3 * r.b + 2] -= r.bx * d.ry - r.by * d.rx + mx * g.y - my * g.x;
    }
}

/* Adds what the slope of a term by one vertex, and its rate, give its arm and centroid. */
static void add_point(
    int64_t vertex, Vec slope, Vec rate, const double *turn, const double *direction,
    const ContactArrays *contacts, const Sensitivity *out) {
    int64_t unit = contacts->owner[vertex];
    double c = turn[4 * unit], s = turn[4 * unit + 1], spin = direction[3 * unit + 2];
    double hx = rate.x + spin * slope.y, hy = rate.y - spin * slope.x;
    out->corner[2 * vertex] += c * hx + s * hy;
    out->corner[2 * vertex + 1] += -s * hx + c * hy;
    out->centroid[2 * unit] += rate.x;
    out->centroid[2 * unit + 1] += rate.y;
}

/* Gradient of an edge's term by its end, and its rate, where the vertex moves by d in the frame of
   the edge, which turns at the rate `spin`. */
static void end_slopes(
    Term term, Rates d, double spin, const ContactArrays *contacts, Vec *slope, Vec *rate) {
    Frame f = frame_of(term, contacts);
    double tx = f.tx, ty = f.ty, nx = ty, ny = -tx, s = f.s, x = f.x;
    EdgeSlopes e = edge_slopes(f, contacts);
    double ds = nx * d.mx + ny * d.my, dx = tx * d.mx + ty * d.my;
    double lever = (s * e.x - x * e.s) / f.length;
    double d_lever = ds * e.x + s * (e.sx * ds + e.xx * dx) - dx * e.s - x * (e.ss * ds + e.sx * dx);
    d_lever = d_lever / f.length - spin * e.l;
    double d_length = e.sl * ds + e.xl * dx + spin * lever;
    *slope = (Vec){lever * nx + e.l * tx, lever * ny + e.l * ty};
    *rate = (Vec){d_lever * nx + d_length * tx, d_lever * ny + d_length * ty};
}

void distance_contact_kernels_add_mixed(
    double *motion, const ContactArrays *contacts, const Kinematics *kinematics,
    double *direction, const Sensitivity *out) {
    const double *turn = kinematics->turn;
    double by_energy = 0.0;
    int64_t count = neighbour_list_find(motion, contacts);
    for (int64_t k = 0; k < count; k++) {
        Term term = term_of(k, contacts);
        Slopes g = slopes_of(term, contacts);
        Rates d = rates_of(g, arms_of(term, contacts), direction);
        by_energy += g.x * d.mx + g.y * d.my;
        Vec slope = {g.x, g.y}, rate = {d.rx, d.ry}, end, end_rate;
        add_point(term.v, slope, rate, turn, direction, contacts, out);
        if (term.q >= 0) {
            double spin = direction[3 * contacts->owner[term.p] + 2];
            end_slopes(term, d, spin, contacts, &end, &end_rate);
            add_point(term.q, end, end_rate, turn, direction, contacts, out);
            slope.x += end.x, slope.y += end.y, rate.x += end_rate.x, rate.y += end_rate.y;
        }
        slope = (Vec){-slope.x, -slope.y}, rate = (Vec){-rate.x, -rate.y};
        add_point(term.p, slope, rate, turn, direction, contacts, out);
    }
    /* the scale of the energy is proportional to the mean contact stiffness */
    for (int64_t k = 0; k < out->n_contact; k++)
        out->contact[k] += by_energy * contacts->per_stiffness / contacts->energy;
}
