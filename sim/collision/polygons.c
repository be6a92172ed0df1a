/* Outlines of units in a state: where they are, how near two come, and whether they cross. */
#include "sim/collision/collision.h"
#include "sim/core/numbers.h"

#include <math.h>

void polygons_place_vertices(const double *motion, const ContactArrays *contacts) {
    const NeighbourCache *cache = &contacts->cache;
    for (int64_t unit = 0; unit < contacts->n_radius; unit++) {
        double c = cos(motion[3 * unit + 2]), s = sin(motion[3 * unit + 2]);
        double x = contacts->centroid[2 * unit] + motion[3 * unit];
        double y = contacts->centroid[2 * unit + 1] + motion[3 * unit + 1];
        cache->centre[2 * unit] = x, cache->centre[2 * unit + 1] = y;
        for (int64_t v = contacts->first[unit]; v < contacts->first[unit + 1]; v++) {
            Vec r = at(contacts->corner, v);
            cache->place[2 * v] = x + c * r.x - s * r.y;
            cache->place[2 * v + 1] = y + s * r.x + c * r.y;
        }
    }
}

/* Squared distance of vertex v to the edge from p to q. */
static double square_to_edge(Vec v, Vec p, Vec q) {
    Vec e = between(p, q), d = between(p, v);
    double along = least(most((d.x * e.x + d.y * e.y) / (e.x * e.x + e.y * e.y), 0.0), 1.0);
    d.x -= along * e.x;
    d.y -= along * e.y;
    return d.x * d.x + d.y * d.y;
}

bool polygons_is_inside(int64_t v, int64_t unit, const ContactArrays *contacts) {
    const double *place = contacts->cache.place;
    bool inside = false;
    Vec here = at(place, v);
    for (int64_t k = contacts->first[unit]; k < contacts->first[unit + 1]; k++) {
        Vec p = at(place, k), q = at(place, contacts->following[k]);
        if ((p.y > here.y) == (q.y > here.y)) continue;
        double share = (here.y - p.y) / (q.y - p.y);
        if (here.x < p.x + share * (q.x - p.x)) inside = !inside;
    }
    return inside;
}

/* Tests if a vertex lies to the left of the line from p to q. */
static inline bool is_left(Vec p, Vec q, Vec v) {
    Vec e = between(p, q);
    return e.x * (v.y - p.y) > e.y * (v.x - p.x);
}

bool polygons_crosses(int64_t v, int64_t unit, const ContactArrays *contacts) {
    const double *place = contacts->cache.place;
    Vec start = at(place, v), end = at(place, contacts->following[v]);
    for (int64_t k = contacts->first[unit]; k < contacts->first[unit + 1]; k++) {
        Vec p = at(place, k), q = at(place, contacts->following[k]);
        bool apart = is_left(start, end, p) == is_left(start, end, q);
        if (!apart && is_left(p, q, start) != is_left(p, q, end)) return true;
    }
    return false;
}

double polygons_gap_between(int64_t a, int64_t b, const ContactArrays *contacts) {
    const double *place = contacts->cache.place;
    double smallest = INFINITY;
    for (int turn = 0; turn < 2; turn++) {
        int64_t one = turn ? b : a, other = turn ? a : b;
        for (int64_t v = contacts->first[one]; v < contacts->first[one + 1]; v++) {
            if (turn == 0 && polygons_crosses(v, other, contacts)) return 0.0;
            for (int64_t p = contacts->first[other]; p < contacts->first[other + 1]; p++) {
                Vec q = at(place, contacts->following[p]);
                smallest = least(smallest, square_to_edge(at(place, v), at(place, p), q));
            }
        }
    }
    return sqrt(smallest);
}
