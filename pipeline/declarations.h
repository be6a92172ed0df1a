/* Written by `python -m pipeline declarations` from the types and functions of Python. */
#ifndef PIPELINE_DECLARATIONS_H
#define PIPELINE_DECLARATIONS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    float *image;
    int64_t n_image;
    int64_t columns;
    double *blocks;
    int64_t n_blocks;
} FramePixels;

typedef struct {
    uint8_t *kind;
    int64_t n_kind;
    int64_t *span;
    int64_t n_span;
} TemplateCells;

typedef struct {
    float *brightness;
    int64_t n_brightness;
    float *weight;
    int64_t n_weight;
    double half;
    double step;
    double *centre;
    int64_t n_centre;
    double *contrast;
    int64_t n_contrast;
    double *reach;
    int64_t n_reach;
    double noise;
    TemplateCells cells;
} Templates;

typedef struct {
    double *state;
    int64_t n_state;
    double *middle;
    int64_t n_middle;
    double *radius;
    int64_t n_radius;
    double *scale;
    int64_t n_scale;
    double *full;
    int64_t n_full;
    double *noise;
    int64_t n_noise;
    double *tight;
    int64_t n_tight;
    double *drift;
    int64_t n_drift;
} FitStart;

void coverage_integrate(double *points, int64_t *start, double *shade, double *picture, int64_t columns, int64_t n_shade, int64_t n_picture);
void patch_correlation_fit_patches(const FramePixels *scene, const Templates *templates, const FitStart *start, bool *chosen, int64_t size, int64_t steps, double *out, int64_t n_chosen);
void template_cells_classify(float *brightness, float *weight, double contrast, double noise, uint8_t *kind, int64_t *span, int64_t n_span);
void template_cells_unfold(float *brightness, float *weight, int64_t *span, float *nodes, int64_t n_span);
void template_measure_distance(double *line, double *polygon, double *scratch, float *out, int64_t n_line, int64_t n_polygon);
void template_sample_spline(float *coefs, int64_t columns, double *x, double *y, double *out, int64_t n_coefs, int64_t n_x);

#endif
