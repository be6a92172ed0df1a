"""Constants of a specimen, and the damping of one damping ratio."""

from __future__ import annotations

import math
from typing import NamedTuple

from sim.core import Numbers


class Material(NamedTuple):
    """Constants of a specimen, each a number or an array over ligaments or units.

    Attributes:
        density: areal density, tonne/mm^2.
        axial_stiffness, shear_stiffness: of ligaments, N/mm.
        bending_stiffness: of ligaments, N mm/rad.
        contact_stiffness: of voids, N mm/rad^2.
        damping_translation: to ground, per unit, tonne/s.
        damping_rotation: to ground, per unit, tonne mm^2/s.
        end_angles: (n_ligaments, 2) at which a ligament, straight by itself, is held at its first
            and its second end, against its vector, counter-clockwise, rad; it is bent where they
            are not zero. A motion begins with all units where the lattice has them, and with that
            stress in the ligaments, as if they were let go there: `sim.scene.relaxed` counts it
            from where the structure lies at rest, as a specimen does.
        elongation: by which a ligament is longer by itself than its vector, mm; as `end_angles`.
    """

    density: float | Numbers
    axial_stiffness: float | Numbers
    shear_stiffness: float | Numbers
    bending_stiffness: float | Numbers
    contact_stiffness: float | Numbers
    damping_translation: float | Numbers
    damping_rotation: float | Numbers
    end_angles: float | Numbers = 0.0
    elongation: float | Numbers = 0.0

    def scaled(self, factors: Numbers) -> Material:
        """Multiplies the axial, shear and bending stiffnesses by factors (3, n_ligaments)."""
        return self._replace(
            axial_stiffness=self.axial_stiffness * factors[0],
            shear_stiffness=self.shear_stiffness * factors[1],
            bending_stiffness=self.bending_stiffness * factors[2],
        )


def unrotated_inertia(density: float, spacing: float) -> tuple[float, float]:
    """Returns mass (tonne) and inertia (tonne mm^2) of the authors' unrotated square.

    Its half diagonal is 0.425 spacings: 0.36125 spacing^2, and its polar moment to their digits.
    """
    return 0.36125 * density * spacing**2, 0.02175026 * density * spacing**4


def damping_of_ratio(
    ratio: float, density: float, spacing: float, shear: float, bending: float
) -> tuple[float, float]:
    """Derives the damping of every unit (tonne/s, tonne mm^2/s) from one damping ratio.

    The ratio is that of one unrotated square on one ligament, whatever the design (the authors'
    formula).
    """
    mass, inertia = unrotated_inertia(density, spacing)
    # c = 2 ratio sqrt(m k), and likewise of the rotation
    return ratio * 2.0 * math.sqrt(mass * shear), ratio * 2.0 * math.sqrt(inertia * bending)
