/* Correlates rigid patches: Gauss-Newton on the pose of each unit in the specimen's plane.

   The raw pixels of a frame are compared with the template of a unit, seen through the camera: no
   frame is interpolated, so its noise is not either. Four photometric unknowns (gain, offset and
   its slopes) go along with the three of the pose; weights of Geman and McClure take care of what
   does not belong to the unit. Light scales what it falls on, so its slopes do too. */
#include "pipeline/tracking/fit/patch_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Unknowns whose covariance is reported: the pose, and the light's slopes, which mimic shifts. */
enum { N_REPORTED = 5, SQUARE = N_REPORTED * N_REPORTED };
static const int REPORTED[N_REPORTED] = {0, 1, 2, 5, 6};
/* Columns of what is found of a unit, as `unpack` reads them. */
enum { WHITE = UNKNOWNS, BLOCKS = WHITE + SQUARE, LAST = BLOCKS + SQUARE, WIDTH = LAST + 5 };
static const double STRIDE = 1.4;    /* largest factor of a step */
static const double NEAR = 0.3;      /* px, of a step that leads to where the unit is */
static const double LONGEST = 3.0;   /* px in one step */
static const double STILL = 0.03;    /* px, of a step after which there is none */
static const double LARGE = 24.0;    /* px, radius of units of which a quarter tells where they are,
                                        roughly */
static const double FLOOR = 0.04;    /* smallest scale of the robust weights, in contrasts of the
                                        unit */
static const double SCALE = 4.0;     /* or so many times the noise */
static const double UNKNOWN = 1e6;   /* way from where the pixels were selected, scale */
static const double FEWEST = 5.0;    /* weights of pixels that a quarter of the blocks needs */
static const double ASLANT = 0.71;   /* from a block's middle to its corner, in its sizes */
static const int64_t LEAST_SIDE = 4; /* px, of a box */

/* One unit of a start, with its contrast and the largest number of full steps. */
typedef struct {
    double contrast, scale, radius, noise, tight;
    int64_t most;
} FitParameters;

/* What is allocated once for some units. */
typedef struct {
    PixelLists lists;
    uint8_t *kind;
    float *nodes;
    Equations equations;
} Buffers;

/* Rows and columns around a pixel, of whole blocks within the image. */
static Box box_around(const FramePixels *scene, const double *middle, double radius) {
    int64_t rows = scene->n_image / SIZE * SIZE, columns = scene->columns / SIZE * SIZE;
    return (Box){
        (int64_t)most(0.0, floor((middle[1] - radius) / SIZE) * SIZE),
        (int64_t)least((double)rows, ceil(middle[1] + radius) + 1.0),
        (int64_t)most(0.0, floor((middle[0] - radius) / SIZE) * SIZE),
        (int64_t)least((double)columns, ceil(middle[0] + radius) + 1.0)};
}

/* Fills the Gauss-Newton step of the unknowns from the first on, zero for the others. */
static void solve(Equations *found, int first) {
    for (int i = 0; i < UNKNOWNS; i++) {
        double total = 0.0;
        for (int j = first; j < UNKNOWNS; j++) total += found->inverse[i][j] * found->score[j];
        found->step[i] = i >= first ? total : 0.0;
    }
}

/* Goes on by the step, so many times as long. */
static void advance(Equations *found, double stride) {
    for (int i = 0; i < UNKNOWNS; i++) {
        found->at[i] = found->state[i];
        found->state[i] += stride * found->step[i];
    }
}

/* Takes the pose out of the normal equations. */
static void hold_pose(double matrix[UNKNOWNS][UNKNOWNS]) {
    for (int i = 0; i < POSE; i++) {
        for (int j = 0; j < UNKNOWNS; j++) matrix[i][j] = matrix[j][i] = 0.0;
        matrix[i][i] = 1.0;
    }
}

/* Scale of the robust weights: wide until the unit has found its place. */
static double next_scale(
    double scale, double moved, double gain, const FitParameters *given, const Equations *found) {
    if (given->tight > 0.0) return most(0.5 * scale, given->tight);
    double smallest = FLOOR * given->contrast * gain;
    if (given->noise > 0.0 && moved < NEAR) return most(SCALE * given->noise * gain, smallest);
    return least(scale, most(SCALE * sqrt(found->squares / found->weights), smallest));
}

/* Factor by which steps of fixed robust weights are too short. */
static double stride_of(const Equations *found) {
    return least(found->robust / most(found->curved, 1e-9), STRIDE);
}

/* Fills how the unit has moved since its pixels were selected. */
static void compare(const Template *template, Equations *found) {
    const double *state = found->state, *before = found->selected;
    double c = cos(before[2]) / template->step, s = sin(before[2]) / template->step;
    double x = state[0] - before[0], y = state[1] - before[1];
    found->moved[0] = (float)(c * x + s * y), found->moved[1] = (float)(c * y - s * x);
    found->moved[2] = (float)(state[2] - before[2]);
}

/* Improves the state of one unit; length of the last step in px, negative if it failed.

   Pixels are selected anew where it has moved on by more than a part of a pixel. */
static double descend(
    const FramePixels *scene, const Template *template, const FitParameters *given, Box box,
    PixelLists *lists, Equations *found) {
    bool blind = given->tight == 0.0, new = blind && given->noise == 0.0;
    int rough = given->radius > LARGE ? 0 : 1;
    double *state = found->state, moved = -1.0, travelled = UNKNOWN;
    double scale = new ? UNKNOWN : most(given->contrast * fabs(state[3]), given->tight);
    for (int64_t turn = new ? 0 : 1; turn <= given->most; turn++) {
        int part = turn == 0 ? 0 : turn == 1 && blind ? rough : ALL;
        if (travelled > NEAR) {
            compared_pixels_select(scene, template, state, box, lists);
            travelled = 0.0;
            memcpy(found->selected, state, sizeof found->selected);
        }
        compare(template, found);
        normal_equations_gather(template, lists, lists->blocks[part], 1.0 / (scale * scale), found);
        if (turn == 0) hold_pose(found->matrix);
        if (!(found->weights > FEWEST * (part + 1) && normal_equations_invert(found))) return -1.0;
        solve(found, turn == 0 ? POSE : 0);
        const double *step = found->step;
        moved = most(hypot(step[0], step[1]) * given->scale, fabs(step[2]) * given->radius);
        double stride = moved < NEAR ? stride_of(found) : 1.0;
        stride = least(stride, LONGEST / most(moved, 1e-9));
        advance(found, stride);
        travelled += moved * stride;
        double past = scale, gain = fabs(state[3]);
        scale = turn == 0 ? given->contrast * gain : next_scale(scale, moved, gain, given, found);
        if (turn > 0 && part == ALL && moved < STILL && scale > 0.7 * past) break;
    }
    return moved;
}

/* Writes a unit's row as `unpack` reads it. */
static void summarise(
    const Template *template, const PixelLists *lists, const Equations *found, double full,
    double moved, double *out) {
    double scatter[UNKNOWNS][UNKNOWNS], half[UNKNOWNS], gain = found->state[3] * found->state[3];
    normal_equations_scatter(template, found, lists->blocks[ALL], scatter);
    for (int i = 0; i < UNKNOWNS; i++) out[i] = found->state[i];
    for (int i = 0; i < N_REPORTED; i++) {
        const double *row = found->inverse[REPORTED[i]];
        for (int j = 0; j < UNKNOWNS; j++) {
            half[j] = 0.0;
            for (int k = 0; k < UNKNOWNS; k++) half[j] += row[k] * scatter[k][j];
        }
        for (int j = 0; j < N_REPORTED; j++) {
            double total = 0.0;
            for (int k = 0; k < UNKNOWNS; k++) total += half[k] * found->inverse[REPORTED[j]][k];
            out[BLOCKS + N_REPORTED * i + j] = total;
            out[WHITE + N_REPORTED * i + j] = row[REPORTED[j]];
        }
    }
    out[LAST] = sqrt(found->squares / found->weights);
    out[LAST + 1] = found->robust / most(full * gain, found->information);
    out[LAST + 2] = (double)lists->blocks[ALL];
    out[LAST + 3] = moved;
    out[LAST + 4] = found->information / gain;
}

/* Fills the row of one unit; it stays as it is if it cannot be fitted. */
static void fit(
    const FramePixels *scene, const Templates *templates, const FitStart *start, int64_t unit,
    int64_t size, int64_t steps, Buffers *buffers, double *out) {
    const TemplateCells *cells = &templates->cells;
    Box box = box_around(scene, start->middle + 2 * unit, start->radius[unit]);
    if (box.bottom - box.top < LEAST_SIDE || box.right - box.left < LEAST_SIDE) return;
    compared_pixels_cut_out(scene, box, &buffers->lists);
    int64_t first = size * size * unit;
    template_cells_unfold(
        templates->brightness + first, templates->weight + first, cells->span + 2 * size * unit,
        buffers->nodes, size);
    memcpy(buffers->kind, cells->kind + first, (size_t)(size * size));  /* read here and there */
    const double *drift = start->drift + POSE * unit;
    Template template = {
        buffers->kind,
        buffers->nodes,
        size,
        templates->half,
        templates->step,
        templates->centre[2 * unit],
        templates->centre[2 * unit + 1],
        templates->reach[unit] + ASLANT * SIZE / start->scale[unit],
        start->middle[2 * unit + 1],
        drift[0],
        drift[1],
        drift[2]};
    FitParameters given = {
        templates->contrast[unit], start->scale[unit], start->radius[unit],
        start->noise[unit],        start->tight[unit], steps};
    Equations *found = &buffers->equations;
    memcpy(found->state, start->state + UNKNOWNS * unit, sizeof found->state);
    double moved = descend(scene, &template, &given, box, &buffers->lists, found);
    if (moved >= 0.0) summarise(&template, &buffers->lists, found, start->full[unit], moved, out);
}

/* Number of blocks of the largest of the chosen units. */
static int64_t most_blocks(const FitStart *start, const bool *chosen, int64_t n) {
    double radius = 0.0;
    for (int64_t unit = 0; unit < n; unit++)
        if (chosen[unit]) radius = most(radius, start->radius[unit]);
    int64_t across = (int64_t)(2.0 * radius) / SIZE + 3;
    return across * across;
}

void patch_correlation_fit_patches(
    const FramePixels *scene, const Templates *templates, const FitStart *start, bool *chosen,
    int64_t size, int64_t steps, double *out, int64_t n_chosen) {
    int64_t blocks = most_blocks(start, chosen, n_chosen);
    Buffers buffers = {.lists = compared_pixels_make(blocks)};
    buffers.kind = aligned_room(size * size, 1);
    buffers.nodes = aligned_room(4 * size * size, sizeof(float));
    buffers.equations.parts = malloc(sizeof *buffers.equations.parts * (size_t)blocks);
    memset(buffers.nodes, 0, sizeof(float) * 4 * (size_t)(size * size));
    for (int64_t unit = 0; unit < n_chosen; unit++) {
        for (int64_t k = 0; k < WIDTH; k++) out[WIDTH * unit + k] = NAN;
        if (chosen[unit])
            fit(scene, templates, start, unit, size, steps, &buffers, out + WIDTH * unit);
    }
    compared_pixels_free(&buffers.lists);
    free(buffers.kind);
    free(buffers.nodes);
    free(buffers.equations.parts);
}
