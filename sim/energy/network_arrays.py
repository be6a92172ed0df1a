"""Lays out arrays of one structure as the compiled kernels take them, and derivatives by them."""

from typing import NamedTuple

import numpy as np

from sim.collision import ContactArrays
from sim.core import Floats, Ints


class NetworkArrays(NamedTuple):
    """Holds the arrays of one structure as the kernels take them."""

    unit: Ints  # (n_ligaments, 2) units that each ligament joins
    arm: Floats  # (n_ligaments, 2, 2) arm of either end, mm
    vector: Floats  # (n_ligaments, 2) reference ligament vector, mm
    void: Floats  # (n_ligaments, 2) reference void angles, rad
    law: Floats  # (n_ligaments, 3) axial, shear, bending stiffness
    natural: Floats  # (n_ligaments, 3) stretch, mm, shear, bend, rad, free of stress
    contact: Floats  # (n_ligaments, 3) contact stiffness, barrier and cutoff angle
    touching: Ints  # (n_touching,) ligaments whose voids may close; empty: no contact


class Kinematics(NamedTuple):
    """Holds what the derivatives of the energy share at one state of a network."""

    turn: Floats  # (n_units, 4) cos and sin of all rotations, then of their halves
    shear: Floats  # (n_ligaments,) shear angles, from their natural values, rad


class Sensitivity(NamedTuple):
    """Holds derivatives with respect to a network's parameters, shaped as in ``NetworkArrays``."""

    # arm, vector, void, law, natural: as there
    arm: Floats
    vector: Floats
    void: Floats
    law: Floats
    natural: Floats
    contact: Floats  # (n_ligaments,) of the contact stiffness alone
    corner: Floats  # (n_vertices, 2) by the arms of all vertices
    centroid: Floats  # (n_units, 2) by the centroids


def no_sensitivity(net: NetworkArrays, contacts: ContactArrays) -> Sensitivity:
    """Makes zeros to add derivatives to."""
    return Sensitivity(
        arm=np.zeros_like(net.arm),
        vector=np.zeros_like(net.vector),
        void=np.zeros_like(net.void),
        law=np.zeros_like(net.law),
        natural=np.zeros_like(net.natural),
        contact=np.zeros(len(net.contact)),
        corner=np.zeros_like(contacts.corner),
        centroid=np.zeros_like(contacts.centroid),
    )
