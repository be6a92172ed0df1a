"""Describes ligaments that are strips of foil between rigid ends: stiffness and strain.

Both are those of a slender, linearly elastic beam without shear deformation (Euler-Bernoulli; Gere
and Timoshenko, Mechanics of Materials), of length l, width w and thickness t, with I = w t^3 / 12:

    axial E w t / l,    shear 12 E I / l^3,    bending E I / l.

A relative turn of the ends bends it to an arc, a shear angle to an S; the energies of the two add
up. Shear deformation makes it softer by 3.3 (t / l)^2 in shear, 4 % at a ninth. A strip wider than
it is long cannot curl across: it is up to 1 / (1 - nu^2) stiffer, 17 % of polyester.
"""

import math
from typing import TYPE_CHECKING, NamedTuple, TypeVar

if TYPE_CHECKING:
    from jax import Array

    from sim.core import Floats

Value = TypeVar("Value", float, "Floats", "Array")


class Foil(NamedTuple):
    """Holds what strips are cut from."""

    young_modulus: float  # MPa
    thickness: float  # mm
    width: float  # of the strips, across the plane of the structure, mm

    def stiffness(self, length: Value) -> tuple[Value, Value, Value]:
        """Computes axial, shear (N/mm) and bending stiffness (N mm/rad) of free lengths (mm)."""
        along = self.young_modulus * self.width * self.thickness
        bending = along * self.thickness**2 / 12.0
        return along / length, 12.0 * bending / length**3, bending / length


class FoilLimit(NamedTuple):
    """Bounds the strain of the foil that ligaments are made of."""

    thickness: float  # mm
    strain: float  # largest magnitude


class SlotRoom(NamedTuple):
    """Holds the size of the slots that hold foil, and the walls that they need; all in mm."""

    grip: float  # least length in which foil is held
    depth: float  # largest one of a slot, from the vertex
    width: float  # of a slot
    wall: float  # thinnest one around the inner end of a slot and between two slots
    tip: float  # units are cut back at a slot's mouth to walls of this thickness

    @property
    def cover(self) -> float:
        """Distance of a slot's inner end, taken as round, from an edge that leaves the wall."""
        return self.wall + self.width / 2.0

    @property
    def angle(self) -> float:
        """Least angle between a slot and an edge at its vertex, rad."""
        return math.asin(min(self.cover / self.depth, 1.0))


def face_strains(
    deformation: tuple[Value, Value, Value],
    law: tuple[Value, Value],
    length: Value,
    thickness: float,
) -> tuple[Value, Value, Value, Value]:
    """Computes the four extreme strains (...) of strips: at both faces of both ends.

    The moments at the ends are k_b kappa -+ k_s l^2 gamma / 2, and the curvature is kappa / l where
    the shear angle gamma is zero. So the strains are, with the ratio r = k_s l^2 / (2 k_b),

        dl / l +- t / 2 (kappa -+ r gamma) / l.

    Of a strip between rigid ends r is 6; it is less where measured stiffnesses tell that the ends
    give way. The deformation is stretch dl, mm, gamma and relative turn kappa of the ends, rad; the
    law k_s, N/mm, and k_b, N mm/rad; l is at rest, mm, and so is the thickness t.
    """
    (stretch, shear, bend), (shearing, bending) = deformation, law
    s_shaped = shearing * length**2 / (2.0 * bending) * shear
    first, second = (thickness / 2.0 * (bend + way * s_shaped) for way in (-1.0, 1.0))
    return (
        (stretch + first) / length,
        (stretch - first) / length,
        (stretch + second) / length,
        (stretch - second) / length,
    )
