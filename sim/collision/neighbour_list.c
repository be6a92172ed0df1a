/* Searches vertices and edges within the reach of contact; conservative.

   The broad phase (sweep and prune along x) visits all units and notes the gap of each pair of them
   that may meet. The gap of a pair shrinks by no more than its units have moved since, so most pairs
   are skipped without a look at their vertices; once any unit has moved by `margin`, the sweep is
   repeated. Pairs whose coupling the tangent has no room for ("new pairs") are noted before they
   come within reach: the state then counts as not admissible, and the solve goes on, or is repeated,
   with more room. */
#include "sim/collision/collision.h"
#include "sim/core/numbers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Row of the units a < b among the pairs, -1 if they are none. */
static int64_t position(int64_t a, int64_t b, const ContactArrays *contacts) {
    const int64_t *pairs = contacts->pairs;
    int64_t low = 0, high = contacts->n_pairs;
    while (low < high) {
        int64_t middle = (low + high) / 2;
        const int64_t *pair = pairs + 2 * middle;
        if (pair[0] < a || (pair[0] == a && pair[1] < b))
            low = middle + 1;
        else
            high = middle;
    }
    bool found = low < contacts->n_pairs && pairs[2 * low] == a && pairs[2 * low + 1] == b;
    return found ? low : -1;
}

/* Notes the gap of two units nearer than the reach. */
static void record_new_pair(int64_t a, int64_t b, const ContactArrays *contacts) {
    const NeighbourCache *cache = &contacts->cache;
    double gap = least(polygons_gap_between(a, b, contacts), contacts->reach);
    int64_t row = position(a, b, contacts);
    if (row >= 0) {
        cache->gap[row] = gap;
        return;
    }
    cache->room[0] = least(cache->room[0], gap);
    int64_t *count = cache->found + 1;
    if (gap < contacts->distance + 2.0 * contacts->margin && *count < cache->n_new_pairs) {
        cache->new_pairs[2 * *count] = a, cache->new_pairs[2 * *count + 1] = b;
        (*count)++;
    }
}

typedef struct {
    double left;
    int64_t unit;
} Left;

static int compare(const void *one, const void *other) {
    const Left *a = one, *b = other;
    if (a->left != b->left) return a->left < b->left ? -1 : 1;
    return a->unit < b->unit ? -1 : 1;
}

/* Notes the gaps of all pairs of units, in the order of their left ends. */
static void sweep(const ContactArrays *contacts) {
    const NeighbourCache *cache = &contacts->cache;
    const double *radius = contacts->radius;
    int64_t n = contacts->n_radius;
    for (int64_t k = 0; k < cache->n_gap; k++) cache->gap[k] = contacts->reach;
    cache->room[0] = contacts->reach;
    Left *order = malloc(sizeof(Left) * n);
    for (int64_t unit = 0; unit < n; unit++)
        order[unit] = (Left){cache->centre[2 * unit] - radius[unit], unit};
    qsort(order, n, sizeof(Left), compare);
    for (int64_t i = 0; i < n; i++) {
        int64_t one = order[i].unit;
        double end = cache->centre[2 * one] + radius[one] + contacts->reach;
        for (int64_t j = i + 1; j < n && !(order[j].left > end); j++) {
            int64_t other = order[j].unit;
            Vec d = between(at(cache->centre, one), at(cache->centre, other));
            double within = radius[one] + radius[other] + contacts->reach;
            if (d.x * d.x + d.y * d.y < within * within)
                record_new_pair(least_of(one, other), most_of(one, other), contacts);
        }
    }
    free(order);
}

/* Bounds the motion since the last sweep; repeats it where that is due. */
static void follow_motion(const double *motion, const ContactArrays *contacts) {
    const NeighbourCache *cache = &contacts->cache;
    double largest = 0.0;
    for (int64_t unit = 0; unit < contacts->n_radius; unit++) {
        double dx = motion[3 * unit] - cache->searched[3 * unit];
        double dy = motion[3 * unit + 1] - cache->searched[3 * unit + 1];
        double turn = fabs(motion[3 * unit + 2] - cache->searched[3 * unit + 2]);
        cache->moved[unit] = sqrt(dx * dx + dy * dy) + contacts->radius[unit] * turn;
        largest = most(largest, cache->moved[unit]);
    }
    if (largest <= contacts->margin) return;
    memcpy(cache->searched, motion, sizeof(double) * cache->n_searched);
    memset(cache->moved, 0, sizeof(double) * cache->n_moved);
    sweep(contacts);
}

static void append(int64_t v, int64_t p, int64_t q, const ContactArrays *contacts) {
    const NeighbourCache *cache = &contacts->cache;
    int64_t *count = cache->found;
    if (*count == cache->n_terms) *count = -1;  /* more than edges of any length can have */
    if (*count < 0) return;
    int64_t *term = cache->terms + 3 * *count;
    term[0] = v, term[1] = p, term[2] = q;
    (*count)++;
}

/* Appends the terms of vertex v with the edges, and vertices, of a unit. */
static void append_near(
    int64_t v, int64_t unit, bool with_vertices, const ContactArrays *contacts) {
    const double *place = contacts->cache.place;
    double reach = contacts->distance;
    for (int64_t p = contacts->first[unit]; p < contacts->first[unit + 1]; p++) {
        int64_t q = contacts->following[p];
        Vec e = between(at(place, p), at(place, q)), d = between(at(place, p), at(place, v));
        if (with_vertices && d.x * d.x + d.y * d.y < reach * reach) append(v, p, -1, contacts);
        double square = e.x * e.x + e.y * e.y;
        double along = d.x * e.x + d.y * e.y, across = d.x * e.y - d.y * e.x;
        if (0.0 < along && along < square && across > 0.0
            && across * across < reach * reach * square)
            append(v, p, q, contacts);
    }
}

/* Lists the terms of one unit's vertices with another; false if the two overlap. */
static bool collect_pair(
    int64_t one, int64_t other, bool with_vertices, const ContactArrays *contacts) {
    const NeighbourCache *cache = &contacts->cache;
    double far = contacts->radius[other] + contacts->distance;
    for (int64_t v = contacts->first[one]; v < contacts->first[one + 1]; v++) {
        Vec d = between(at(cache->centre, other), at(cache->place, v));
        if (d.x * d.x + d.y * d.y >= far * far) continue;
        if (polygons_is_inside(v, other, contacts) || polygons_crosses(v, other, contacts))
            return false;
        append_near(v, other, with_vertices, contacts);
    }
    return true;
}

/* Lists the terms of all pairs within reach; none, and -1, if two units overlap. */
static void collect(const ContactArrays *contacts) {
    const NeighbourCache *cache = &contacts->cache;
    cache->found[0] = 0;
    for (int64_t k = 0; k < contacts->n_pairs; k++) {
        int64_t a = contacts->pairs[2 * k], b = contacts->pairs[2 * k + 1];
        if (cache->gap[k] - cache->moved[a] - cache->moved[b] >= contacts->distance) continue;
        if (collect_pair(a, b, true, contacts) && collect_pair(b, a, false, contacts)) continue;
        cache->found[0] = -1, cache->overlap[0] = a, cache->overlap[1] = b;
        return;
    }
}

bool neighbour_list_is_same(const double *one, const double *other, int64_t n) {
    int64_t d = 0;
    while (d < n && one[d] == other[d]) d++;
    return d == n;
}

int64_t neighbour_list_find(double *motion, const ContactArrays *contacts) {
    const NeighbourCache *cache = &contacts->cache;
    if (!neighbour_list_is_same(motion, cache->state, cache->n_state)) {
        memcpy(cache->state, motion, sizeof(double) * cache->n_state);
        polygons_place_vertices(motion, contacts);
        follow_motion(motion, contacts);
        collect(contacts);
    }
    return has_new_pairs(contacts) ? -1 : cache->found[0];
}

int64_t neighbour_list_pairs_in_contact(double *motion, const ContactArrays *contacts) {
    int64_t count = 0, last_a = -1, last_b = -1, n = neighbour_list_find(motion, contacts);
    for (int64_t k = 0; k < n; k++) {  /* the terms of a pair follow each other */
        Term term = term_of(k, contacts);
        int64_t one = contacts->owner[term.v], other = contacts->owner[term.p];
        int64_t a = least_of(one, other), b = most_of(one, other);
        if (a != last_a || b != last_b) count++, last_a = a, last_b = b;
    }
    return count;
}
