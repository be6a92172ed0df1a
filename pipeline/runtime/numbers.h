/* Small functions of numbers. */
#ifndef PIPELINE_NUMBERS_H
#define PIPELINE_NUMBERS_H

#include <stdint.h>

/* The smaller or larger of two; the first where one is no number. */
static inline double least(double a, double b) { return b < a ? b : a; }
static inline double most(double a, double b) { return b > a ? b : a; }
static inline float least_single(float a, float b) { return b < a ? b : a; }
static inline float most_single(float a, float b) { return b > a ? b : a; }
static inline int64_t least_of(int64_t a, int64_t b) { return b < a ? b : a; }
static inline int64_t most_of(int64_t a, int64_t b) { return b > a ? b : a; }

#endif
