/* Classifies the cells of a template's nodes, and unfolds the nodes.

   Where the template is flat, a pixel tells of the brightness alone: one of four is enough. */
#include "pipeline/tracking/fit/patch_fit.h"

#include <math.h>
#include <string.h>

/* Change from node to node in a cell that tells of the place, at least: in contrasts of the unit;
   in standard deviations of the template's noise; and in these, if it is the mean of four changes.
*/
static const double STEEPEST = 0.04, NOISY = 3.0, MEAN_NOISY = 1.5;
/* Nodes from the rim that slopes need. */
enum { RIM = 2 };

/* Tells whether the brightness changes in the cell from this node on, by more than `needed` between
   two nodes, or `needed_sum` in the sum of four changes. */
static bool is_steep(const float *at, int64_t size, float needed, float needed_sum) {
    float across = most_single(fabsf(at[1] - at[0]), fabsf(at[size + 1] - at[size]));
    float along = most_single(fabsf(at[size] - at[0]), fabsf(at[size + 1] - at[1]));
    float across_all = 0.0f, along_all = 0.0f;
    for (int64_t j = -1; j < 3; j++) {
        across_all += at[size * j + 1] - at[size * j];
        along_all += at[size + j] - at[j];
    }
    if (most_single(across, along) > needed) return true;
    return most_single(fabsf(across_all), fabsf(along_all)) > needed_sum;
}

/* Widens the spans of the rows that a cell of this one needs. */
static void widen(int64_t row, int64_t first, int64_t last, int64_t size, int64_t *span) {
    int64_t end = least_of(row + 3, size - RIM);
    for (int64_t line = most_of(row - 1, RIM); line < end; line++) {
        int64_t *of = span + 2 * line;
        of[0] = of[1] > 0 ? least_of(first, of[0]) : first;
        of[1] = most_of(last, of[1]);
    }
}

void template_cells_classify(
    float *brightness, float *weight, double contrast, double noise, uint8_t *kind, int64_t *span,
    int64_t n_span) {
    int64_t size = n_span;
    float needed = (float)most(STEEPEST * contrast, NOISY * noise);
    float needed_sum = (float)(4.0 * most(STEEPEST * contrast, MEAN_NOISY * noise));
    memset(kind, EMPTY, (size_t)(size * size));
    memset(span, 0, sizeof(int64_t) * 2 * (size_t)size);
    for (int64_t row = RIM; row < size - RIM - 1; row++) {
        int64_t first = size, last = 0;
        for (int64_t k = RIM; k < size - RIM - 1; k++) {
            const float *mask = weight + size * row + k;
            if (!(mask[0] + mask[1] + (mask[size] + mask[size + 1]) > 0.0f)) continue;
            bool steep = is_steep(brightness + size * row + k, size, needed, needed_sum);
            kind[size * row + k] = steep ? STEEP : FLAT;
            first = least_of(first, most_of(k - 1, RIM));
            last = least_of(k + 3, size - RIM);
        }
        if (last > 0) widen(row, first, last, size, span);
    }
}

/* One unit's nodes at a time fit a processor's cache, which all units' do not. */
void template_cells_unfold(
    float *brightness, float *weight, int64_t *span, float *nodes, int64_t n_span) {
    const float near = 8.0f / 12.0f, far = 1.0f / 12.0f;
    int64_t size = n_span;
    for (int64_t row = RIM; row < size - RIM; row++) {
        int64_t begin = span[2 * row], count = span[2 * row + 1] - begin;
        if (count <= 0) continue;
        /* what is left of a row costs as much for each node as for as many as go at once */
        count = least_of((count + LANES - 1) / LANES * LANES, size - RIM - begin);
        const float *at = brightness + size * row + begin, *mask = weight + size * row + begin;
        float *restrict out = nodes + 4 * (size * row + begin);
        for (int64_t k = 0; k < count; k++) {
            float x = at[k + 1] - at[k - 1], farther_x = at[k + 2] - at[k - 2];
            float y = at[k + size] - at[k - size], farther_y = at[k + 2 * size] - at[k - 2 * size];
            out[4 * k] = at[k];
            out[4 * k + 1] = near * x - far * farther_x;
            out[4 * k + 2] = near * y - far * farther_y;
            out[4 * k + 3] = mask[k];
        }
    }
}
