/* Visits states one by one. */
#include "sim/declarations.h"

void observables_visit(
    double *states, const System *system, const Kinematics *kinematics, double *energies,
    double *forces, double *strains, int64_t *pairs, int64_t n_states) {
    for (int64_t n = 0; n < n_states; n++) {
        int64_t at = n * system->n_mass;
        total_gradient(states + at, system, kinematics, forces + at, energies + 2 * n);
        ligament_kernels_largest_strains(states + at, &system->net, kinematics, strains + 3 * n);
        if (system->contacts.n_pairs > 0)
            pairs[n] = neighbour_list_pairs_in_contact(states + at, &system->contacts);
    }
}
