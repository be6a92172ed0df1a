/* Factorises and solves by the fronts of a nested dissection. */
#include "sim/linalg/lapack.h"
#include "sim/linalg/linalg.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

int64_t multifrontal_entry(const Fronts *f, int64_t row, int64_t column) {
    int64_t front = f->owner[column];
    int64_t first = f->first[front], end = f->first[front + 1];
    int64_t low = f->edge[front], high = f->edge[front + 1];
    int64_t start = f->panel[front] + (column - first) * (end - first + high - low);
    if (row < end) return start + row - first;
    int64_t here = low;
    while (low < high) {  /* the row is in the boundary, which ascends */
        int64_t middle = (low + high) / 2;
        if (f->boundary[middle] < row)
            low = middle + 1;
        else
            high = middle;
    }
    return start + end - first + low - here;
}

/* Adds what a child left to the matrix of its parent: own columns, then the boundary's. */
static void add_child(
    int64_t child, int64_t k, int64_t b, double *panel, double *block, const double *scratch,
    const Fronts *f) {
    const int64_t *place = f->place + f->edge[child];
    int64_t n = f->edge[child + 1] - f->edge[child];
    const double *left = scratch + f->update[child];
    for (int64_t j = 0; j < n; j++) {
        const double *source = left + j * n;
        double *target = place[j] < k ? panel + place[j] * (k + b) : block + (place[j] - k) * b - k;
        for (int64_t i = j; i < n; i++) target[place[i]] += source[i];
    }
}

/* Factorises one front with what its children left; false if it is not positive definite. */
static bool eliminate(int64_t front, double *values, double *scratch, const Fronts *f) {
    double plus = 1.0, minus = -1.0;
    int64_t k = f->first[front + 1] - f->first[front], b = f->edge[front + 1] - f->edge[front];
    double *panel = values + f->panel[front], *block = scratch + f->update[front];
    for (int64_t j = 0; j < b; j++) memset(block + j * b + j, 0, sizeof(double) * (b - j));
    for (int64_t c = f->child[front]; c < f->child[front + 1]; c++)
        add_child(f->children[c], k, b, panel, block, scratch, f);
    int own = k, rest = b, height = k + b, info = 0;
    lapack_dpotrf("L", &own, panel, &height, &info);
    if (info != 0 || !isfinite(panel[(k - 1) * (k + b) + k - 1])) return false;
    if (b == 0) return true;
    double *below = panel + k;
    lapack_dtrsm("R", "L", "T", "N", &rest, &own, &plus, panel, &height, below, &height);
    lapack_dsyrk("L", "N", &rest, &own, &minus, below, &height, &plus, block, &rest);
    return true;
}

/* A run of fronts that ends with one whose children are in it, and the threads for them. */
typedef struct {
    int64_t first, last, threads;
    double *values, *scratch;
    const Fronts *f;
    atomic_bool *indefinite; /* found by any thread: the others need not go on */
} Run;

static void *factorise_run(void *given) {
    const Run *run = given;
    const Fronts *f = run->f;
    int64_t next = run->first, child = f->child[run->last], end = f->child[run->last + 1];
    if (run->threads > 1 && f->parallel[run->last]) {
        Run one = *run, other = *run;
        one.last = f->children[child], one.threads = run->threads / 2;
        other.threads = run->threads - one.threads;
        pthread_t helper;
        bool helped = !pthread_create(&helper, NULL, factorise_run, &one);
        if (!helped) factorise_run(&one);
        while (++child < end) {
            other.first = f->children[child - 1] + 1, other.last = f->children[child];
            factorise_run(&other);
        }
        if (helped) pthread_join(helper, NULL);
        next = run->last;
    }
    for (; next <= run->last && !*run->indefinite; next++)
        if (!eliminate(next, run->values, run->scratch, f)) *run->indefinite = true;
    return NULL;
}

/* Factorises by that many threads; by any number the factor has the same bits. */
bool multifrontal_factorise(double *values, double *scratch, const Fronts *f, int64_t threads) {
    atomic_bool indefinite = false;
    Run run = {0, 0, threads, values, scratch, f, &indefinite};
    for (; run.last < f->n_update; run.last++)
        if (f->edge[run.last] == f->edge[run.last + 1]) { /* it has no parent */
            factorise_run(&run);
            run.first = run.last + 1;
        }
    return !indefinite;
}

void multifrontal_solve(const double *values, const Fronts *f, int64_t n, double *right) {
    double plus = 1.0, minus = -1.0, none = 0.0, *gathered = malloc(sizeof(double) * n);
    int unit = 1;
    for (int64_t turn = 0; turn < 2 * f->n_update; turn++) {
        bool down = turn < f->n_update;
        int64_t front = down ? turn : 2 * f->n_update - 1 - turn;
        int64_t first = f->first[front], end = f->first[front + 1];
        const int64_t *rows = f->boundary + f->edge[front];
        int rest = f->edge[front + 1] - f->edge[front], own = end - first, height = own + rest;
        double *panel = (double *)values + f->panel[front], *below = panel + own, *x = right + first;
        if (down) {
            lapack_dtrsv("L", "N", "N", &own, panel, &height, x, &unit);
            if (rest)
                lapack_dgemv("N", &rest, &own, &plus, below, &height, x, &unit, &none, gathered, &unit);
            for (int i = 0; i < rest; i++) right[rows[i]] -= gathered[i];
        } else {
            for (int i = 0; i < rest; i++) gathered[i] = right[rows[i]];
            if (rest)
                lapack_dgemv("T", &rest, &own, &minus, below, &height, gathered, &unit, &plus, x, &unit);
            lapack_dtrsv("L", "T", "N", &own, panel, &height, x, &unit);
        }
    }
    free(gathered);
}
