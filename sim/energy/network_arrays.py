"""Arrays of one structure as the compiled kernels take them, and derivatives by them."""

from typing import NamedTuple

from sim.core import Floats, Ints


class NetworkArrays(NamedTuple):
    """Arrays of one structure as the kernels take them.

    Attributes:
        unit: (n_ligaments, 2) units that each ligament joins.
        arm: (n_ligaments, 2, 2) arm of either end, mm.
        vector: (n_ligaments, 2) reference ligament vector, mm.
        void: (n_ligaments, 2) reference void angles, rad.
        law: (n_ligaments, 3) axial, shear, bending stiffness.
        natural: (n_ligaments, 3) stretch, mm, shear angle and relative rotation, rad, free of
            stress.
        contact: (n_ligaments, 3) contact stiffness, barrier and cutoff angle.
        touching: (n_touching,) ligaments whose voids may close to the cutoff; empty to skip
            contact.
    """

    unit: Ints
    arm: Floats
    vector: Floats
    void: Floats
    law: Floats
    natural: Floats
    contact: Floats
    touching: Ints


class Kinematics(NamedTuple):
    """Holds what the derivatives of the energy share at one state of a network.

    Attributes:
        turn: (n_units, 4) cos and sin of all rotations, then of their halves.
        shear: (n_ligaments,) shear angles, from their natural values, rad.
    """

    turn: Floats
    shear: Floats


class Sensitivity(NamedTuple):
    """Derivatives with respect to a network's parameters, shaped as in ``NetworkArrays``.

    Attributes:
        arm, vector, void, law, natural: as there.
        contact: (n_ligaments,) of the contact stiffness alone.
        corner: (n_vertices, 2) by the arms of all vertices.
        centroid: (n_units, 2) by the centroids.
    """

    arm: Floats
    vector: Floats
    void: Floats
    law: Floats
    natural: Floats
    contact: Floats
    corner: Floats
    centroid: Floats
