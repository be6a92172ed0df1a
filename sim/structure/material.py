"""Holds the constants of a specimen."""

from __future__ import annotations

from typing import NamedTuple

from sim.core import Numbers


class Material(NamedTuple):
    """Constants of a specimen, each a number or an array over ligaments or units.

    Attributes:
        density: areal density, tonne/mm^2.
        axial, shear: ligament stiffness, N/mm.
        bending: ligament stiffness, N mm/rad.
        contact: contact stiffness, N mm/rad^2.
        damping_translation: to ground, per unit, tonne/s.
        damping_rotation: to ground, per unit, tonne mm^2/s.
    """

    density: float | Numbers
    axial: float | Numbers
    shear: float | Numbers
    bending: float | Numbers
    contact: float | Numbers
    damping_translation: float | Numbers
    damping_rotation: float | Numbers


def damping_of_ratio(
    ratio: float, density: float, spacing: float, shear: float, bending: float
) -> tuple[float, float]:
    """Damping constants (tonne/s, tonne mm^2/s) as the authors derive them from one damping ratio.

    They take the critical damping of one unrotated unit (diagonal 0.85 spacings) on one hinge.
    """
    area, polar_moment = 0.36125 * spacing**2, 0.02175026 * spacing**4
    return (
        2 * ratio * (density * area * shear) ** 0.5,
        2 * ratio * (density * polar_moment * bending) ** 0.5,
    )
