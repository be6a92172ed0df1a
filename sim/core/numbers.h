/* Small functions of numbers, which round and order as written. */
#ifndef SIM_NUMBERS_H
#define SIM_NUMBERS_H

#include <stdint.h>
#include <string.h>

#define EACH(i, n) for (int64_t i = 0; i < (n); i++)

/* The smaller or larger of two; the first where one is no number. */
static inline double least(double a, double b) { return b < a ? b : a; }
static inline double most(double a, double b) { return b > a ? b : a; }
static inline float least_single(float a, float b) { return b < a ? b : a; }
static inline float most_single(float a, float b) { return b > a ? b : a; }
static inline int64_t least_of(int64_t a, int64_t b) { return b < a ? b : a; }
static inline int64_t most_of(int64_t a, int64_t b) { return b > a ? b : a; }
static inline double square(double x) { return x * x; }

static inline void copy(double *to, const double *from, int64_t n) {
    memcpy(to, from, sizeof(double) * n);
}

#endif
