/* Gathers the normal equations of one unit against a frame.

   Pixels are taken by windows of whole blocks that a processor's cache holds, in loops over arrays
   of one record: only then compilers know that what one loop writes is not what it reads. The
   equations are those of the slopes in the unit's own frame, its brightness, the light and its
   slopes, the basis; at last they are made those of the unknowns. */
#include "pipeline/tracking/fit/patch_fit.h"

#include <math.h>
#include <string.h>

/* APART is not a power of two, whose multiples share a place in the cache. */
enum { WINDOW = 512, APART = WINDOW + 16 };
/* The basis: derivatives in the order of the unknowns. */
enum { SLOPE_X, SLOPE_Y, TURN, FACE, ONE, LIT_X, LIT_Y };
/* Numbers of a node: brightness, its slopes in x and y, weight. */
enum { NUMBERS = 4 };

typedef struct {
    float basis[UNKNOWNS][APART];
    float x[APART], y[APART];           /* places on the unit, in nodes */
    float across[APART], along[APART];  /* from the node, in x and y */
    float face[APART], slope_x[APART], slope_y[APART];  /* means of the four nodes */
    float right[APART], lower[APART];  /* slope in x of the right ones, in y of the lower ones */
    float weight[APART], residual[APART];  /* at last robust, and weighed so */
    int32_t node[APART];               /* the first of the four nodes about a pixel */
} Window;

/* Finds the nodes about pixels, on a unit that has moved since they were selected. */
static void locate(
    const Template *template, const float *moved, const float *from_x, const float *from_y,
    int64_t count, Window *window) {
    float middle = (float)((template->size - 1) / 2), end = (float)(template->size - 2);
    float c = cosf(moved[2]), s = sinf(moved[2]);
    int32_t size = (int32_t)template->size;
    for (int64_t n = 0; n < count; n++) {
        float dx = from_x[n] - moved[0], dy = from_y[n] - moved[1];
        float x = c * dx + s * dy, y = c * dy - s * dx;
        float u = least_single(most_single(x + middle, 0.0f), end);
        float v = least_single(most_single(y + middle, 0.0f), end);
        int32_t iu = (int32_t)u, iv = (int32_t)v;
        window->x[n] = x, window->y[n] = y;
        window->node[n] = iv * size + iu;
        window->across[n] = u - (float)iu, window->along[n] = v - (float)iv;
    }
}

/* The four numbers of a node, which make one vector of a processor. */
typedef float Node __attribute__((vector_size(NUMBERS * sizeof(float))));

static inline Node node_at(const float *numbers) {
    Node node;
    memcpy(&node, numbers, sizeof node);
    return node;
}

/* Mixes the four nodes about pixels. */
static void mix(const Template *template, int64_t count, Window *window) {
    for (int64_t n = 0; n < count; n++) {
        const float *upper = template->nodes + NUMBERS * (int64_t)(uint32_t)window->node[n];
        const float *lower = upper + NUMBERS * template->size;
        float across = window->across[n], along = window->along[n], both = across * along;
        float left = 1.0f - across - along + both, right = across - both, low_left = along - both;
        Node low_right = both * node_at(lower + NUMBERS);
        Node beside = right * node_at(upper + NUMBERS) + low_right;
        Node corner = low_left * node_at(lower), below = corner + low_right;
        Node mean = left * node_at(upper) + corner + beside;
        window->face[n] = mean[0];
        window->slope_x[n] = mean[1], window->slope_y[n] = mean[2];
        window->weight[n] = mean[3];
        window->right[n] = beside[1], window->lower[n] = below[2];
    }
}

/* Fills the basis, and the weights of what is no filling.

   The brightness is mixed of what the four nodes about a pixel extrapolate to halfway, which is
   exact for parabolas. */
static void derive(const float *steep, int64_t count, Window *window) {
    float(*basis)[APART] = window->basis;
    for (int64_t n = 0; n < count; n++) {
        float slope_x = window->slope_x[n], slope_y = window->slope_y[n];
        float bow_x = window->across[n] * slope_x - window->right[n];
        float bow_y = window->along[n] * slope_y - window->lower[n];
        float face = window->face[n] + 0.5f * (bow_x + bow_y);
        float informative = most_single(steep[n], 0.0f);
        float x = window->x[n], y = window->y[n];
        slope_x *= informative, slope_y *= informative;
        basis[SLOPE_X][n] = slope_x, basis[SLOPE_Y][n] = slope_y;
        basis[TURN][n] = slope_x * y - slope_y * x;
        basis[FACE][n] = face;
        basis[LIT_X][n] = x * face, basis[LIT_Y][n] = y * face;
        window->weight[n] *= least_single(steep[n], 0.0f) + 1.0f;
    }
}

/* Fills residuals, with robust weights of Geman and McClure, and adds to the sums. */
static void weigh(
    const Template *template, double tight, const float *brightness, int64_t count, Window *window,
    Equations *found) {
    float(*basis)[APART] = window->basis;
    const double *state = found->state;
    float per_half = (float)(template->step / template->half), narrow = (float)tight;
    float gain = (float)state[3], offset = (float)state[4];
    float slope_x = (float)state[5] * per_half, slope_y = (float)state[6] * per_half;
    float full = 0.0f, left = 0.0f, curved = 0.0f, total = 0.0f, squares = 0.0f;
    for (int64_t n = 0; n < count; n++) {
        float along_x = basis[SLOPE_X][n], along_y = basis[SLOPE_Y][n], weight = window->weight[n];
        float lit = gain * basis[FACE][n] + slope_x * basis[LIT_X][n] + slope_y * basis[LIT_Y][n];
        float residual = brightness[n] - (lit + offset), square = residual * residual;
        float steep = along_x * along_x + along_y * along_y;
        float closeness = 1.0f / (1.0f + square * narrow);
        float robust = weight * closeness * closeness;
        window->residual[n] = residual * robust, window->weight[n] = robust;
        full += weight * steep;
        left += robust * steep;
        curved += robust * steep * (4.0f * closeness - 3.0f);
        total += robust;
        squares += robust * square;
    }
    found->information += full, found->robust += left, found->curved += curved;
    found->weights += total, found->squares += squares;
}

/* Adds the weighted products of one of the basis with itself and those before it. */
static inline void add_row(int i, int64_t count, const Window *window, Equations *found) {
    float products[UNKNOWNS] = {0.0f};
    for (int64_t n = 0; n < count; n++) {
        float weighed = window->weight[n] * window->basis[i][n];
        for (int j = 0; j <= i; j++) products[j] += weighed * window->basis[j][n];
    }
    for (int j = 0; j <= i; j++) found->matrix[i][j] += products[j];
}

/* Adds the weighted products of the basis to the lower triangle of the matrix. */
static void add_products(int64_t count, const Window *window, Equations *found) {
    add_row(0, count, window, found);
    add_row(1, count, window, found);
    add_row(2, count, window, found);
    add_row(3, count, window, found);
    add_row(4, count, window, found);
    add_row(5, count, window, found);
    add_row(6, count, window, found);
}

/* Fills the score of a block, whose pixels begin and end there in the window, and adds it. */
static void add_block(
    int64_t begin, int64_t end, const Window *window, float *part, double *score) {
    float products[UNKNOWNS] = {0.0f};
    for (int64_t n = begin; n < end; n++) {
        float residual = window->residual[n];
        for (int i = 0; i < UNKNOWNS; i++) products[i] += residual * window->basis[i][n];
    }
    for (int i = 0; i < UNKNOWNS; i++) {
        part[i] = products[i];
        score[i] += products[i];
    }
}

/* Makes derivatives, so far apart, after the unknowns of those of the basis. */
static void after_unknowns(
    const Template *template, const double *state, double *vector, int64_t apart) {
    double steepness = state[3] / template->step, per_half = template->step / template->half;
    double c = steepness * cos(state[2]), s = steepness * sin(state[2]);
    double x = vector[0], y = vector[apart];
    vector[0] = s * y - c * x, vector[apart] = -s * x - c * y;
    vector[2 * apart] *= state[3];
    vector[5 * apart] *= per_half;
    vector[6 * apart] *= per_half;
}

/* Makes products of derivatives those of the unknowns; the lower triangle is read. */
static void products_after_unknowns(
    const Template *template, const double *state, double matrix[UNKNOWNS][UNKNOWNS]) {
    for (int i = 0; i < UNKNOWNS; i++)
        for (int j = 0; j < i; j++) matrix[j][i] = matrix[i][j];
    for (int i = 0; i < UNKNOWNS; i++) after_unknowns(template, state, matrix[i], 1);
    for (int i = 0; i < UNKNOWNS; i++) after_unknowns(template, state, &matrix[0][i], UNKNOWNS);
}

void normal_equations_gather(
    const Template *template, const PixelLists *lists, int64_t blocks, double tight,
    Equations *found) {
    _Alignas(ALIGNED) Window window;
    for (int n = 0; n < WINDOW; n++) window.basis[ONE][n] = 1.0f;
    memset(found->matrix, 0, sizeof found->matrix);
    memset(found->score, 0, sizeof found->score);
    found->information = found->robust = found->curved = found->weights = found->squares = 0.0;
    for (int64_t block = 0, after; block < blocks; block = after) {
        int64_t first = lists->ends[block];
        for (after = block + 1; after < blocks; after++)
            if (lists->ends[after + 1] - first > WINDOW) break;
        int64_t count = (lists->ends[after] - first) / LANES * LANES;
        locate(template, found->moved, lists->x + first, lists->y + first, count, &window);
        mix(template, count, &window);
        derive(lists->steep + first, count, &window);
        weigh(template, tight, lists->brightness + first, count, &window, found);
        add_products(count, &window, found);
        for (int64_t k = block; k < after; k++) {
            int64_t begin = lists->ends[k] - first, end = lists->ends[k + 1] - first;
            add_block(begin, end, &window, found->parts[k], found->score);
        }
    }
    products_after_unknowns(template, found->state, found->matrix);
    after_unknowns(template, found->state, found->score, 1);
    double steepness = found->state[3] / template->step;
    found->information *= steepness * steepness;
    found->robust *= steepness * steepness;
    found->curved *= steepness * steepness;
}

void normal_equations_scatter(
    const Template *template, const Equations *found, int64_t blocks,
    double scatter[UNKNOWNS][UNKNOWNS]) {
    memset(scatter, 0, sizeof(double) * UNKNOWNS * UNKNOWNS);
    for (int64_t block = 0; block < blocks; block++) {
        const float *part = found->parts[block];
        for (int i = 0; i < UNKNOWNS; i++)
            for (int j = 0; j <= i; j++) scatter[i][j] += (double)part[i] * part[j];
    }
    products_after_unknowns(template, found->at, scatter);
}

/* Factors by Cholesky from the lower triangle; false if it is singular.

   The factor's diagonal is inverted. */
static bool factorise(Equations *found) {
    double(*factor)[UNKNOWNS] = found->factor;
    for (int i = 0; i < UNKNOWNS; i++)
        for (int j = 0; j <= i; j++) {
            double total = found->matrix[i][j];
            for (int k = 0; k < j; k++) total -= factor[i][k] * factor[j][k];
            if (i != j)
                factor[i][j] = total * factor[j][j];
            else if (total > 1e-10 * found->matrix[i][i])
                factor[i][i] = 1.0 / sqrt(total);
            else
                return false;
        }
    return true;
}

/* By the Cholesky factor L, which becomes its own inverse: L'^-1 L^-1. */
bool normal_equations_invert(Equations *found) {
    double(*factor)[UNKNOWNS] = found->factor;
    if (!factorise(found)) return false;
    for (int column = 0; column < UNKNOWNS; column++)
        for (int i = column + 1; i < UNKNOWNS; i++) {
            double total = factor[i][column] * factor[column][column];
            for (int k = column + 1; k < i; k++) total += factor[i][k] * factor[k][column];
            factor[i][column] = -total * factor[i][i];
        }
    for (int i = 0; i < UNKNOWNS; i++)
        for (int j = 0; j <= i; j++) {
            double total = 0.0;
            for (int k = i; k < UNKNOWNS; k++) total += factor[k][i] * factor[k][j];
            found->inverse[i][j] = found->inverse[j][i] = total;
        }
    return true;
}
