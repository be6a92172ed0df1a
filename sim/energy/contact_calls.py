"""Finds the kernels of contact on distance for structures that have it; others compile none."""

import numpy as np

from sim.collision import ContactArrays, collision_free_step, pairs_in_contact
from sim.core import Floats, Ints, address_of
from sim.energy.distance_contact_kernels import (
    add_gradient,
    add_hessian_product,
    add_mixed,
    add_tangent,
)
from sim.energy.network_arrays import NetworkArrays, Sensitivity, no_sensitivity
from sim.linalg import Matrix, Pattern, matrix

GRADIENT, TANGENT, HESSIAN_PRODUCT, MIXED, FREE_STEP, PAIRS = range(6)

_known: list[Ints] = []
"""The addresses, once any structure has needed them: all have arrays of the same kinds."""


def contact_calls(net: NetworkArrays, contacts: ContactArrays, pattern: Pattern) -> Ints:
    """Returns the addresses (6,) of the kernels in the order above, zeros where no units can meet.

    `pattern` is that of the tangent.
    """
    if len(contacts.pairs) == 0:
        return np.zeros(PAIRS + 1, dtype=np.int64)
    if not _known:
        _known.append(_compiled_for(contacts, matrix(pattern), no_sensitivity(net, contacts)))
    return _known[0]


def _compiled_for(contacts: ContactArrays, tangent: Matrix, out: Sensitivity) -> Ints:
    vector: Floats = np.zeros(1)
    table: Floats = np.zeros((1, 1))
    number: Ints = np.zeros(1, dtype=np.int64)
    return np.array(
        [
            address_of(add_gradient, vector, contacts, vector),
            address_of(add_tangent, vector, contacts, number, tangent),
            address_of(add_hessian_product, vector, contacts, vector, vector),
            address_of(add_mixed, vector, contacts, table, vector, out),
            address_of(collision_free_step, vector, contacts, vector),
            address_of(pairs_in_contact, vector, contacts),
        ]
    )
