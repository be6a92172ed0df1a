/* Sums the energy of a system: ligaments, contact by the law of its structure, and dead loads. */
#include "sim/core/numbers.h"
#include "sim/declarations.h"

/* A load q on a degree of freedom u adds -q u: the last dofs are the loads. */
static inline int64_t first_load(const System *system) {
    return system->n_mass - 3 * system->n_loaded;
}

void total_locate(double *motion, const System *system, const Kinematics *kinematics) {
    ligament_kernels_locate(motion, &system->net, kinematics);
}

void total_gradient(
    double *motion, const System *system, const Kinematics *kinematics, double *out,
    double *returned) {
    double strain = ligament_kernels_gradient(motion, &system->net, kinematics, out);
    double contact = void_contact_kernels_add_gradient(motion, &system->net, out);
    if (system->contacts.n_pairs > 0)
        contact += distance_contact_kernels_add_gradient(motion, &system->contacts, out);
    int64_t first = first_load(system);
    for (int64_t k = 0; k < system->n_loaded; k++)
        for (int m = 0; m < 3; m++) {
            int64_t d = 3 * system->loaded[k] + m;
            double load = motion[first + 3 * k + m];
            out[d] -= load;
            strain -= load * motion[d];
        }
    returned[0] = strain, returned[1] = contact;
}

void total_tangent(
    double *motion, const System *system, const Kinematics *kinematics, const Matrix *matrix) {
    ligament_kernels_tangent(motion, &system->net, kinematics, system->entries, matrix->values);
    void_contact_kernels_add_tangent(motion, &system->net, system->free, matrix);
    if (system->contacts.n_pairs > 0)
        distance_contact_kernels_add_tangent(motion, &system->contacts, system->free, matrix);
}

void total_hessian_product(
    double *motion, const System *system, const Kinematics *kinematics, double *direction,
    double *out) {
    ligament_kernels_hessian_product(motion, &system->net, kinematics, direction, out);
    void_contact_kernels_add_hessian_product(motion, &system->net, direction, out);
    if (system->contacts.n_pairs > 0)
        distance_contact_kernels_add_hessian_product(motion, &system->contacts, direction, out);
    int64_t first = first_load(system);
    for (int64_t k = 0; k < system->n_loaded; k++)
        for (int m = 0; m < 3; m++) {
            int64_t d = 3 * system->loaded[k] + m, load = first + 3 * k + m;
            out[d] -= direction[load];
            out[load] -= direction[d];
        }
}

void total_mixed(
    double *motion, const System *system, const Kinematics *kinematics, double *direction,
    int64_t *which, const Sensitivity *out, int64_t n_which) {
    ligament_kernels_mixed(motion, &system->net, kinematics, direction, which, out, n_which);
    void_contact_kernels_add_mixed(motion, &system->net, direction, which, out, n_which);
    if (system->contacts.n_pairs > 0)
        distance_contact_kernels_add_mixed(
            motion, &system->contacts, kinematics, direction, out);
}

double total_admissible_step(double *motion, const System *system, double *step) {
    double largest = void_contact_kernels_barrier_step(motion, &system->net, step);
    if (system->contacts.n_pairs > 0)
        largest = least(
            largest, step_limit_collision_free_step(motion, &system->contacts, step));
    return largest;
}
