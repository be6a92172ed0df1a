/* Selects the pixels of a frame that a unit is compared in, by blocks of 8 x 8 pixels.

   A block is what a codec quantises at once, so errors are alike within. Where the template is flat
   a pixel tells of the brightness alone: one of four is enough. */
#include "pipeline/tracking/fit/patch_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double MIDDLE = 0.5 * (SIZE - 1);
/* Columns, or rows, from a block's middle. */
static const float OFFSETS[SIZE] = {-3.5f, -2.5f, -1.5f, -0.5f, 0.5f, 1.5f, 2.5f, 3.5f};
/* One bit for each pixel of a block that is compared where the template is flat. */
static const uint64_t FEW = 0x4411441144114411u;
/* Order of the quarters, by column and row. */
static const int64_t ORDER[QUARTERS] = {0, 2, 1, 3};

/* The lowest bits of eight bytes. */
static const uint64_t LOWEST = 0x0101010101010101u;

/* One block: places of its pixels on the unit in nodes, and kinds of their cells. */
typedef struct {
    float x[PIXELS], y[PIXELS];
    int32_t node[PIXELS];
    uint8_t kind[PIXELS];
} Block;

void *aligned_room(int64_t count, int64_t bytes) {
    return aligned_alloc(ALIGNED, (size_t)((count * bytes + ALIGNED - 1) / ALIGNED * ALIGNED));
}

PixelLists compared_pixels_make(int64_t blocks) {
    int64_t pixels = blocks * PIXELS;
    float *numbers = aligned_room(5 * pixels, sizeof(float));
    return (PixelLists){
        .x = numbers,
        .y = numbers + pixels,
        .brightness = numbers + 2 * pixels,
        .steep = numbers + 3 * pixels,
        .patch = numbers + 4 * pixels,
        .ends = malloc(sizeof(int64_t) * (size_t)(blocks + 1))};
}

void compared_pixels_free(PixelLists *lists) {
    free(lists->x);
    free(lists->ends);
}

static int64_t width_of(Box box) { return (box.right - box.left + SIZE - 1) / SIZE * SIZE; }

void compared_pixels_cut_out(const FramePixels *scene, Box box, PixelLists *lists) {
    int64_t wide = width_of(box), tall = (box.bottom - box.top + SIZE - 1) / SIZE * SIZE;
    for (int64_t row = 0; row < tall; row++) {
        const float *seen = scene->image + scene->columns * (box.top + row) + box.left;
        for (int64_t k = 0; k < wide; k++) lists->patch[wide * row + k] = seen[k];
    }
}

/* Place of a block's middle, and its changes by column and by row, mm. */
static const double *block_of(const FramePixels *scene, int64_t top, int64_t left) {
    return scene->blocks + 6 * (scene->columns / SIZE * (top / SIZE) + left / SIZE);
}

static bool is_within(const Template *template, const double *pose, const double *middle) {
    double x = middle[0] - template->x - pose[0], y = middle[1] - template->y - pose[1];
    return x * x + y * y < template->reach * template->reach;
}

/* Fills where a block's pixels are on the unit. */
static void place(
    const Template *template, const double *pose, const double *at, int64_t top, Block *block) {
    double late = top + MIDDLE - template->row, turn = pose[2] + late * template->drift_turn;
    double c = cos(turn) / template->step, s = sin(turn) / template->step;
    double vx = at[0] - template->x - pose[0] - late * template->drift_x;
    double vy = at[1] - template->y - pose[1] - late * template->drift_y;
    double down_x = at[4] - template->drift_x + template->drift_turn * vy;
    double down_y = at[5] - template->drift_y - template->drift_turn * vx;
    float x = (float)(c * vx + s * vy), y = (float)(c * vy - s * vx);
    float ahead_x = (float)(c * at[2] + s * at[3]), ahead_y = (float)(c * at[3] - s * at[2]);
    float below_x = (float)(c * down_x + s * down_y), below_y = (float)(c * down_y - s * down_x);
    for (int row = 0; row < SIZE; row++) {
        float begin_x = x + OFFSETS[row] * below_x, begin_y = y + OFFSETS[row] * below_y;
        for (int k = 0; k < SIZE; k++) {
            block->x[SIZE * row + k] = begin_x + OFFSETS[k] * ahead_x;
            block->y[SIZE * row + k] = begin_y + OFFSETS[k] * ahead_y;
        }
    }
}

/* Fills the kinds of the cells that a block's pixels lie in; those at a template's rim are empty. */
static void find_cells(const Template *template, Block *block) {
    float middle = (float)((template->size - 1) / 2), end = (float)(template->size - 1);
    int32_t size = (int32_t)template->size;
    for (int k = 0; k < PIXELS; k++) {
        float u = least_single(most_single(block->x[k] + middle, 0.0f), end);
        float v = least_single(most_single(block->y[k] + middle, 0.0f), end);
        block->node[k] = (int32_t)v * size + (int32_t)u;
    }
    for (int k = 0; k < PIXELS; k++) block->kind[k] = template->kind[(uint32_t)block->node[k]];
}

/* Packs the lowest bits of eight bytes, as they lie in the memory of processors whose numbers begin
   with the lowest byte. */
static uint64_t packed(uint64_t bytes) { return bytes * 0x0102040810204080u >> 56; }

/* One bit for each pixel of a block that is compared, the first one's lowest. */
static uint64_t choose(const Block *block) {
    uint64_t steep = 0, seen = 0;
    for (int row = 0; row < SIZE; row++) {
        uint64_t kinds;
        memcpy(&kinds, block->kind + SIZE * row, sizeof kinds);
        steep |= packed(kinds / STEEP & LOWEST) << SIZE * row;
        seen |= packed(kinds & LOWEST) << SIZE * row;
    }
    return steep | (seen & FEW);
}

/* Copies all pixels of a block to the lists, where each tells of the place. */
static void append_all(
    const Block *block, const float *patch, int64_t wide, int64_t n, PixelLists *lists) {
    memcpy(lists->x + n, block->x, sizeof block->x);
    memcpy(lists->y + n, block->y, sizeof block->y);
    for (int row = 0; row < SIZE; row++)
        memcpy(lists->brightness + n + SIZE * row, patch + wide * row, SIZE * sizeof *patch);
    for (int k = 0; k < PIXELS; k++) lists->steep[n + k] = (float)(block->kind[k] / STEEP);
}

/* Appends the chosen pixels of a block to the lists' n, filled up; its patch has rows of `wide`.
   Returns what n is then. */
static int64_t append(
    const Block *block, uint64_t chosen, const float *patch, int64_t wide, int64_t n,
    PixelLists *lists) {
    if (chosen == UINT64_MAX) {
        append_all(block, patch, wide, n, lists);
        return n + PIXELS;
    }
    for (; chosen; chosen &= chosen - 1, n++) {
        int k = __builtin_ctzll(chosen);
        lists->x[n] = block->x[k], lists->y[n] = block->y[k];
        lists->brightness[n] = patch[wide * (k / SIZE) + k % SIZE];
        lists->steep[n] = (float)(block->kind[k] / STEEP);
    }
    for (; n % LANES; n++) {
        lists->x[n] = lists->y[n] = lists->brightness[n] = 0.0f;
        lists->steep[n] = -1.0f;
    }
    return n;
}

void compared_pixels_select(
    const FramePixels *scene, const Template *template, const double *pose, Box box,
    PixelLists *lists) {
    int64_t n = 0, blocks = 0, wide = width_of(box);
    Block block;
    lists->ends[0] = 0;
    for (int part = 0; part < QUARTERS; part++) {
        for (int64_t top = box.top; top < box.bottom; top += SIZE) {
            int64_t first = (ORDER[part] - top / SIZE - box.left / SIZE) & (QUARTERS - 1);
            for (int64_t left = box.left + SIZE * first; left < box.right;
                 left += QUARTERS * SIZE) {
                const double *at = block_of(scene, top, left);
                if (!is_within(template, pose, at)) continue;
                place(template, pose, at, top, &block);
                find_cells(template, &block);
                uint64_t chosen = choose(&block);
                if (!chosen) continue;
                const float *patch = lists->patch + wide * (top - box.top) + left - box.left;
                n = append(&block, chosen, patch, wide, n, lists);
                lists->ends[++blocks] = n;
            }
        }
        lists->blocks[part] = blocks;
    }
}
