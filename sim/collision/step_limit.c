/* Limits a step so that no units pass through each other, by conservative advancement.

   Two outlines that do not cross can only come to cross where a vertex of one meets an edge of the
   other. In the frame of the edge's unit the vertex moves on a smooth curve, whose curvature is
   bounded; as long as it stays on the far side of one of the lines that bound the edge's
   neighbourhood (the edge's own, and its normals at both ends) it does not meet the edge. The step
   is advanced as far as that bound vouches for, again and again, until a meeting is close or the
   step's end reached. */
#include "sim/collision/collision.h"
#include "sim/core/numbers.h"

#include <math.h>
#include <stdlib.h>

/* Multiples of a step that are looked at: somewhat more than solvers keep of the limit. */
static const double FAR = 1.2;
/* A meeting is close once an advance adds less than this to the multiple reached. */
static const double CLOSE = 0.02;
enum { MAX_ADVANCES = 200 };

/* Bounds how far a positive value with this slope stays so, by its second derivative. */
static double advance(double value, double slope, double curvature) {
    double root = sqrt(slope * slope + 2.0 * curvature * value);
    if (slope < 0.0) return 2.0 * value / (root - slope);
    return curvature > 0.0 ? (slope + root) / curvature : INFINITY;
}

typedef struct {
    Vec start, direction;
    double length;
} Edge;

/* Advance of a point at y with velocity dy that surely does not meet an edge. */
static double past_edge(Vec y, Vec dy, double curvature, Edge edge) {
    Vec t = edge.direction, r = between(edge.start, y);
    double x = r.x * t.x + r.y * t.y, dx = dy.x * t.x + dy.y * t.y;
    double s = r.x * t.y - r.y * t.x, ds = dy.x * t.y - dy.y * t.x;
    double safe = s > 0.0 ? advance(s, ds, curvature) : 0.0;
    if (s < 0.0) safe = advance(-s, -ds, curvature);
    if (x < 0.0) safe = most(safe, advance(-x, -dx, curvature));
    if (x > edge.length) safe = most(safe, advance(x - edge.length, dx, curvature));
    return safe;
}

/* The motion of a unit's vertex in another unit's frame: w leads from the other unit's centroid to
   its own at the step's start and changes by d, r from its own to the vertex; `spin` is the rotation
   of the other unit, `relative` its own relative to that, `bent` bounds the path's curvature. */
typedef struct {
    Vec w, d, r;
    double spin, relative, bent;
} Path;

/* Place and velocity of the vertex at a multiple of the step. */
static void follow(double multiple, const Path *path, Vec *y, Vec *dy) {
    double spin = path->spin, relative = path->relative;
    double cb = cos(multiple * spin), sb = sin(multiple * spin);
    double cr = cos(multiple * relative), sr = sin(multiple * relative);
    double wx = path->w.x + multiple * path->d.x, wy = path->w.y + multiple * path->d.y;
    double vx = path->d.x + spin * wy, vy = path->d.y - spin * wx;
    double rx = cr * path->r.x - sr * path->r.y, ry = sr * path->r.x + cr * path->r.y;
    *y = (Vec){cb * wx + sb * wy + rx, -sb * wx + cb * wy + ry};
    *dy = (Vec){cb * vx + sb * vy - relative * ry, -sb * vx + cb * vy + relative * rx};
}

/* `largest`, or less: the multiple up to which a vertex does not meet the edge from p. */
static double pass_edge(
    int64_t p, int64_t other, double largest, const Path *path, const ContactArrays *contacts) {
    const double *place = contacts->cache.place;
    Vec e = between(at(place, p), at(place, contacts->following[p]));
    double length = sqrt(e.x * e.x + e.y * e.y);
    Vec start = between(at(contacts->cache.centre, other), at(place, p));
    Edge edge = {start, {e.x / length, e.y / length}, length};
    Vec w = path->w, r = path->r, y = {w.x + r.x, w.y + r.y};
    Vec dy = {
        path->d.x + path->spin * w.y - path->relative * r.y,
        path->d.y - path->spin * w.x + path->relative * r.x};
    double reached = 0.0;
    for (int step = 0; step < MAX_ADVANCES; step++) {
        double safe = past_edge(y, dy, path->bent, edge);
        reached += safe;
        if (reached >= largest) return largest;
        if (safe <= CLOSE * reached) break;
        follow(reached, path, &y, &dy);
    }
    return reached;
}

/* `largest`, or less: the multiple up to which no vertex of `one` meets `other`. */
static double pass_unit(
    int64_t one, int64_t other, double largest, const double *step,
    const ContactArrays *contacts) {
    const double *centre = contacts->cache.centre, *place = contacts->cache.place;
    Vec w = between(at(centre, other), at(centre, one));
    Vec d = {step[3 * one] - step[3 * other], step[3 * one + 1] - step[3 * other + 1]};
    double spin = step[3 * other + 2], relative = step[3 * one + 2] - spin;
    double apart = hypot(w.x, w.y), drift = hypot(d.x, d.y);
    double bent = relative * relative * contacts->radius[one];
    bent += fabs(spin) * (2.0 * drift + fabs(spin) * (apart + largest * drift));
    double speed = hypot(d.x + spin * w.y, d.y - spin * w.x);
    speed += fabs(relative) * contacts->radius[one] + FAR * bent;
    double far = contacts->radius[other] + largest * speed;
    for (int64_t v = contacts->first[one]; v < contacts->first[one + 1]; v++) {
        Vec from = between(at(centre, other), at(place, v));
        if (from.x * from.x + from.y * from.y > far * far) continue;
        Path path = {w, d, between(at(centre, one), at(place, v)), spin, relative, bent};
        for (int64_t p = contacts->first[other]; p < contacts->first[other + 1]; p++)
            largest = pass_edge(p, other, largest, &path, contacts);
    }
    return largest;
}

static double largest_of(const double *values, int64_t n) {
    double largest = values[0];
    for (int64_t i = 1; i < n; i++) largest = most(largest, values[i]);
    return largest;
}

/* Multiple of the step before which no pair comes near that the tangent has no room for. */
static double room_for_new_pairs(const double *speed, const ContactArrays *contacts) {
    const NeighbourCache *cache = &contacts->cache;
    double left = cache->room[0] - 2.0 * largest_of(cache->moved, cache->n_moved);
    double fastest = 2.0 * largest_of(speed, contacts->n_radius);
    return least(FAR, most(left, 0.0) / most(fastest, 1e-300));
}

double step_limit_collision_free_step(
    double *motion, const ContactArrays *contacts, double *step) {
    if (neighbour_list_find(motion, contacts) < 0) return 0.0;
    const NeighbourCache *cache = &contacts->cache;
    double fastest = 0.0, *speed = malloc(sizeof(double) * contacts->n_radius);
    for (int64_t unit = 0; unit < contacts->n_radius; unit++) {
        /* how far the step moves any point of the unit at most */
        speed[unit] = hypot(step[3 * unit], step[3 * unit + 1]);
        speed[unit] += contacts->radius[unit] * fabs(step[3 * unit + 2]);
        fastest = most(fastest, cache->moved[unit] + FAR * speed[unit]);
    }
    double largest = FAR;
    if (2.0 * fastest > cache->room[0])  /* new pairs meet no sooner than this */
        largest = room_for_new_pairs(speed, contacts);
    for (int64_t k = 0; k < contacts->n_pairs; k++) {
        int64_t a = contacts->pairs[2 * k], b = contacts->pairs[2 * k + 1];
        double gap = cache->gap[k] - cache->moved[a] - cache->moved[b];
        if (gap < largest * (speed[a] + speed[b])) {
            largest = pass_unit(a, b, largest, step, contacts);
            largest = pass_unit(b, a, largest, step, contacts);
        }
    }
    free(speed);
    return largest == FAR ? INFINITY : largest;
}
