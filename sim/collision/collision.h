/* Finds the vertices and edges of units that are within the reach of contact. */
#ifndef SIM_COLLISION_H
#define SIM_COLLISION_H

#include "sim/declarations.h"

typedef struct {
    double x, y;
} Vec;

static inline Vec at(const double *table, int64_t row) {
    return (Vec){table[2 * row], table[2 * row + 1]};
}

static inline Vec between(Vec from, Vec to) { return (Vec){to.x - from.x, to.y - from.y}; }

/* Notes the positions of all vertices and centroids in a state. */
void polygons_place_vertices(const double *motion, const ContactArrays *contacts);
/* Tests if vertex v lies inside a unit, by the parity of the edges to its right. */
bool polygons_is_inside(int64_t v, int64_t unit, const ContactArrays *contacts);
/* Tests if the edge that starts at v crosses one of a unit's. */
bool polygons_crosses(int64_t v, int64_t unit, const ContactArrays *contacts);
/* Distance of the outlines of two units, zero if they cross. */
double polygons_gap_between(int64_t a, int64_t b, const ContactArrays *contacts);

/* Compares two states number by number. */
bool neighbour_list_is_same(const double *one, const double *other, int64_t n);
/* Tells whether pairs of units came near for whose coupling the tangent has no room. */
static inline bool has_new_pairs(const ContactArrays *contacts) {
    return contacts->cache.found[1] > 0;
}

/* Vertex, and start and end of the edge (-1: its start alone), of the k-th term found. */
typedef struct {
    int64_t v, p, q;
} Term;

static inline Term term_of(int64_t k, const ContactArrays *contacts) {
    const int64_t *row = contacts->cache.terms + 3 * k;
    return (Term){row[0], row[1], row[2]};
}

#endif
