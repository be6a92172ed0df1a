/* Written by `python -m pipeline declarations` from the types and functions of Python. */
#ifndef SIM_DECLARATIONS_H
#define SIM_DECLARATIONS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    double *state;
    int64_t n_state;
    double *place;
    int64_t n_place;
    double *centre;
    int64_t n_centre;
    double *searched;
    int64_t n_searched;
    double *moved;
    int64_t n_moved;
    double *gap;
    int64_t n_gap;
    double *room;
    int64_t n_room;
    int64_t *new_pairs;
    int64_t n_new_pairs;
    int64_t *terms;
    int64_t n_terms;
    int64_t *found;
    int64_t n_found;
    int64_t *overlap;
    int64_t n_overlap;
} NeighbourCache;

typedef struct {
    int64_t *pairs;
    int64_t n_pairs;
    int64_t *first;
    int64_t n_first;
    int64_t *owner;
    int64_t n_owner;
    int64_t *following;
    int64_t n_following;
    double *corner;
    int64_t n_corner;
    double *centroid;
    int64_t n_centroid;
    double *radius;
    int64_t n_radius;
    double energy;
    double per_stiffness;
    double distance;
    double reach;
    double margin;
    NeighbourCache cache;
} ContactArrays;

typedef struct {
    double *turn;
    int64_t n_turn;
    double *shear;
    int64_t n_shear;
} Kinematics;

typedef struct {
    double *arm;
    int64_t n_arm;
    double *vector;
    int64_t n_vector;
    double *void_;
    int64_t n_void;
    double *law;
    int64_t n_law;
    double *natural;
    int64_t n_natural;
    double *contact;
    int64_t n_contact;
    double *corner;
    int64_t n_corner;
    double *centroid;
    int64_t n_centroid;
} Sensitivity;

typedef struct {
    int64_t *first;
    int64_t n_first;
    int64_t *edge;
    int64_t n_edge;
    int64_t *boundary;
    int64_t n_boundary;
    int64_t *place;
    int64_t n_place;
    int64_t *child;
    int64_t n_child;
    int64_t *children;
    int64_t n_children;
    int64_t *parallel;
    int64_t n_parallel;
    int64_t *panel;
    int64_t n_panel;
    int64_t *update;
    int64_t n_update;
    int64_t *owner;
    int64_t n_owner;
    int64_t *scratch;
    int64_t n_scratch;
} Fronts;

typedef struct {
    int64_t *first;
    int64_t n_first;
} Panels;

typedef struct {
    int64_t *size;
    int64_t n_size;
    Fronts fronts;
    Panels panels;
} Pattern;

typedef struct {
    double *values;
    int64_t n_values;
    double *scratch;
    int64_t n_scratch;
    Pattern pattern;
    int64_t threads;
} Matrix;

typedef struct {
    int64_t *unit;
    int64_t n_unit;
    double *arm;
    int64_t n_arm;
    double *vector;
    int64_t n_vector;
    double *void_;
    int64_t n_void;
    double *law;
    int64_t n_law;
    double *natural;
    int64_t n_natural;
    double *contact;
    int64_t n_contact;
    int64_t *touching;
    int64_t n_touching;
} NetworkArrays;

typedef struct {
    NetworkArrays net;
    ContactArrays contacts;
    double *mass;
    int64_t n_mass;
    double *damping;
    int64_t n_damping;
    int64_t *free;
    int64_t n_free;
    int64_t *dofs;
    int64_t n_dofs;
    int64_t *held;
    int64_t n_held;
    int64_t *loaded;
    int64_t n_loaded;
    double *scale;
    int64_t n_scale;
    Pattern pattern;
    int64_t *entries;
    int64_t n_entries;
} System;

typedef struct {
    Kinematics kinematics;
    double *force;
    int64_t n_force;
    double *step;
    int64_t n_step;
    double *product;
    int64_t n_product;
    double *trial;
    int64_t n_trial;
    double *saved;
    int64_t n_saved;
    double *guess;
    int64_t n_guess;
    double *right;
    int64_t n_right;
    Matrix matrix;
} Workspace;

typedef struct {
    Sensitivity sensitivity;
    double *mass;
    int64_t n_mass;
    double *damping;
    int64_t n_damping;
    double *drive;
    int64_t n_drive;
} Bars;

typedef struct {
    double *states;
    int64_t n_states;
    double *tangents;
    int64_t n_tangents;
    int64_t *stable;
    int64_t n_stable;
    int64_t *jumped;
    int64_t n_jumped;
    double *snapped;
    int64_t n_snapped;
    double *snaps;
    int64_t n_snaps;
    double *eigenvalue;
    int64_t n_eigenvalue;
} Branch;

typedef struct {
    double *drifts;
    int64_t n_drifts;
    double *kicks;
    int64_t n_kicks;
    double longest;
} Substeps;

typedef struct {
    int64_t n_steps;
    double h;
    Substeps splitting;
    double *decay;
    int64_t n_decay;
    double *gain;
    int64_t n_gain;
    double *drive;
    int64_t n_drive;
    int64_t segment;
} Steps;

typedef struct {
    int64_t *interval;
    int64_t n_interval;
    double *values;
    int64_t n_values;
    double *rates;
    int64_t n_rates;
} Outputs;

double distance_contact_kernels_add_gradient(double *motion, const ContactArrays *contacts, double *out);
void distance_contact_kernels_add_hessian_product(double *motion, const ContactArrays *contacts, double *direction, double *out);
void distance_contact_kernels_add_mixed(double *motion, const ContactArrays *contacts, const Kinematics *kinematics, double *direction, const Sensitivity *out);
void distance_contact_kernels_add_tangent(double *motion, const ContactArrays *contacts, int64_t *free, const Matrix *matrix);
int64_t equilibrium_path_adjoint(double *states, double *bar, const System *system, const Workspace *work, int64_t *which, const Bars *bars, int64_t n_states, int64_t n_which);
void equilibrium_path_follow(double *loads, int64_t known, double *progress, double *bends, int64_t *trusted, bool leaves, double sense, const System *system, const Workspace *work, double relative, double absolute, double *drag, const Branch *branch, int64_t *counts, int64_t n_loads, double *returned);
bool esdirk_adjoint_adjoint(double *times, double *stage_u, double *stage_v, double *stage_a, double *bar_u, double *bar_v, const System *system, const Workspace *work, double *stages, int64_t *which, const Bars *bars, int64_t n_times, int64_t n_stages, int64_t n_which);
void esdirk_march(double *times, int64_t first, double *drive, const System *system, const Workspace *work, double *stages, double *nodes, double tolerance, double *u, double *v, double *a, int64_t *counts, int64_t n_times, int64_t n_nodes, double *returned);
double ligament_kernels_gradient(double *motion, const NetworkArrays *net, const Kinematics *kinematics, double *out);
void ligament_kernels_hessian_product(double *motion, const NetworkArrays *net, const Kinematics *kinematics, double *direction, double *out);
void ligament_kernels_largest_strains(double *motion, const NetworkArrays *net, const Kinematics *kinematics, double *out);
void ligament_kernels_locate(double *motion, const NetworkArrays *net, const Kinematics *kinematics);
void ligament_kernels_mixed(double *motion, const NetworkArrays *net, const Kinematics *kinematics, double *direction, int64_t *which, const Sensitivity *out, int64_t n_which);
void ligament_kernels_tangent(double *motion, const NetworkArrays *net, const Kinematics *kinematics, int64_t *entries, double *values);
int64_t neighbour_list_find(double *motion, const ContactArrays *contacts);
int64_t neighbour_list_pairs_in_contact(double *motion, const ContactArrays *contacts);
bool newton_factorise_tangent(double *motion, const System *system, const Workspace *work, double shift, int64_t *counts);
void observables_visit(double *states, const System *system, const Kinematics *kinematics, double *energies, double *forces, double *strains, int64_t *pairs, int64_t n_states);
bool snap_relax(double *motion, double *drag, double relative, double absolute, const System *system, const Workspace *work, int64_t *counts);
double step_limit_collision_free_step(double *motion, const ContactArrays *contacts, double *step);
void symmetric_add(const Matrix *of, int64_t i, int64_t j, double value);
void symmetric_clear(const Matrix *of);
int64_t symmetric_entry(const Pattern *pattern, int64_t i, int64_t j);
bool symmetric_factorise(const Matrix *of);
void symmetric_find_blocks(const Pattern *pattern, int64_t *free, int64_t *pairs, int64_t *found, int64_t n_pairs);
void symmetric_solve(const Matrix *factor, double *right);
int64_t symplectic_run(const Steps *steps, const Outputs *outputs, const System *system, const Workspace *work, int64_t *watched, double *checkpoints, double *out_u, double *out_v, int64_t n_watched);
void symplectic_sweep_back(const Steps *steps, const Outputs *outputs, const System *system, const Workspace *work, int64_t *watched, double *checkpoints, double *out_bar_u, double *out_bar_v, int64_t *which, const Bars *bars, double *bar_decay, double *bar_gain, int64_t n_watched, int64_t n_which);
double total_admissible_step(double *motion, const System *system, double *step);
void total_gradient(double *motion, const System *system, const Kinematics *kinematics, double *out, double *returned);
void total_hessian_product(double *motion, const System *system, const Kinematics *kinematics, double *direction, double *out);
void total_locate(double *motion, const System *system, const Kinematics *kinematics);
void total_mixed(double *motion, const System *system, const Kinematics *kinematics, double *direction, int64_t *which, const Sensitivity *out, int64_t n_which);
void total_tangent(double *motion, const System *system, const Kinematics *kinematics, const Matrix *matrix);
double void_contact_kernels_add_gradient(double *motion, const NetworkArrays *net, double *out);
void void_contact_kernels_add_hessian_product(double *motion, const NetworkArrays *net, double *direction, double *out);
void void_contact_kernels_add_mixed(double *motion, const NetworkArrays *net, double *direction, int64_t *which, const Sensitivity *out, int64_t n_which);
void void_contact_kernels_add_tangent(double *motion, const NetworkArrays *net, int64_t *free, const Matrix *matrix);
double void_contact_kernels_barrier_step(double *motion, const NetworkArrays *net, double *step);
void void_contact_kernels_void_slopes(const NetworkArrays *net, int64_t k, int64_t side, double turn, double *returned);

#endif
