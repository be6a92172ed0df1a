"""Defines the paper's lattice and material, for scenes that need no problem file."""

import numpy as np

from sim.structure import Material, damping_of_ratio

SPACING, LIGAMENT = 15.0, 2.25
"""mm."""
BIAS = 20.0
"""Turn of the squares, deg."""
BARRIER, CUTOFF = (float(angle) for angle in np.deg2rad([-15.0, -10.0]))
"""Void angles at which contact ends and begins, rad."""
DAMPING_RATIO = 0.0186
_DENSITY, _AXIAL, _SHEAR, _BENDING, _CONTACT = 6.18e-9, 120.0, 1.19, 1.5, 1.5
MATERIAL = Material(
    _DENSITY,
    _AXIAL,
    _SHEAR,
    _BENDING,
    _CONTACT,
    *damping_of_ratio(DAMPING_RATIO, _DENSITY, SPACING, _SHEAR, _BENDING),
)
