/* Correlates rigid patches with the pixels of a frame: what the files of this folder share. */
#ifndef PIPELINE_PATCH_FIT_H
#define PIPELINE_PATCH_FIT_H

#include "pipeline/declarations.h"
#include "sim/core/numbers.h"

/* Codecs quantise blocks of 8 x 8 pixels. Processors add 8 numbers at once: the pixels of a block
   that are compared are filled up to a multiple of LANES, and arrays begin at a multiple of ALIGNED
   bytes, so that sums are the same wherever they lie. */
enum { SIZE = 8, PIXELS = SIZE * SIZE, LANES = 8, ALIGNED = 64 };
/* Kinds of cells between the nodes of a template. */
enum { EMPTY = 0, FLAT = 1, STEEP = 2 };
/* ux, uy, theta; gain, offset, slope in x, slope in y. */
enum { POSE = 3, UNKNOWNS = 7 };
/* Blocks are listed by quarters: some of the first stand for all. */
enum { QUARTERS = 4, ALL = QUARTERS - 1 };

/* Room for so many numbers of some bytes each, aligned, to be freed. */
void *aligned_room(int64_t count, int64_t bytes);

/* The template of one unit, (size, size) nodes at a distance of `step` in mm, with its place at
   rest. Blocks whose middle is farther than `reach` (mm) from its own hold nothing of it. From row
   to row of the frame the unit moves by its drift, which is zero in the row of its middle. */
typedef struct {
    const uint8_t *kind;  /* of the cells */
    const float *nodes;   /* brightness, its slopes, weight; node by node */
    int64_t size;
    double half, step;
    double x, y;
    double reach;
    double row, drift_x, drift_y, drift_turn;
} Template;

/* Rows and columns to look at, the first of each on a block. */
typedef struct {
    int64_t top, bottom, left, right;
} Box;

/* The pixels that are compared, block by block. */
typedef struct {
    float *x, *y;       /* places on the unit as it was posed when they were selected, in nodes */
    float *brightness;  /* of the frame */
    float *steep;       /* one where the template tells of the place, zero where it is flat, minus
                           one of what only fills up */
    int64_t *ends;      /* where each block begins in the list, and the last ends */
    int64_t blocks[QUARTERS];  /* numbers of blocks in the first quarters */
    float *patch;       /* brightness of the blocks about the unit, row by row */
} PixelLists;

/* Room for the pixels of units of at most so many blocks. */
PixelLists compared_pixels_make(int64_t blocks);
void compared_pixels_free(PixelLists *lists);
/* Copies the patch in the box, in the order in which it lies in the memory. */
void compared_pixels_cut_out(const FramePixels *scene, Box box, PixelLists *lists);
/* Fills the lists with blocks of a first, a second and the other two quarters. */
void compared_pixels_select(
    const FramePixels *scene, const Template *template, const double *pose, Box box,
    PixelLists *lists);

/* The normal equations of one unit, and what they are solved by. */
typedef struct {
    double state[UNKNOWNS];  /* pose and photometry */
    double at[UNKNOWNS];     /* before the last step */
    double selected[POSE];   /* pose in which the pixels were selected */
    float moved[POSE];       /* since, in the unit's own frame as it was then, in nodes and rad */
    double matrix[UNKNOWNS][UNKNOWNS], factor[UNKNOWNS][UNKNOWNS], inverse[UNKNOWNS][UNKNOWNS];
    double score[UNKNOWNS], step[UNKNOWNS];  /* right-hand side, Gauss-Newton step */
    double information, robust, curved;  /* the same with robust weights, with their loss's
                                            curvature */
    double weights, squares;  /* robust weights, the same with squared residuals */
    float (*parts)[UNKNOWNS];  /* (blocks) scores of the blocks, of the basis */
} Equations;

/* Fills matrix, score and sums, of the unknowns, and the parts, with the pixels of so many blocks;
   `tight` is one over the squared scale of the robust weights. */
void normal_equations_gather(
    const Template *template, const PixelLists *lists, int64_t blocks, double tight,
    Equations *found);
/* Fills the sum of the blocks' scores times themselves. */
void normal_equations_scatter(
    const Template *template, const Equations *found, int64_t blocks,
    double scatter[UNKNOWNS][UNKNOWNS]);
/* Fills the inverse of the matrix; false if it is singular. */
bool normal_equations_invert(Equations *found);

#endif
