"""Converts the constants of a specimen to logarithms and back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pipeline.calibration.inputs.description import Calibration, ConstantName
from pipeline.problem.sections import Contact, MaterialConstants
from sim.core import Floats
from sim.structure import VoidAngleContact, unrotated_inertia

UNITS: dict[ConstantName, str] = {
    "axial_stiffness": "N/mm",
    "shear_stiffness": "N/mm",
    "bending_stiffness": "N mm/rad",
    "damping_ratio": "1",
    "damping_translation": "tonne/s",
    "damping_rotation": "tonne mm^2/s",
    "contact_cutoff": "rad",
}
"""Working unit of each."""

WRITTEN: dict[ConstantName, tuple[str, float]] = {
    "axial_stiffness": ("N/mm", 1.0),
    "shear_stiffness": ("N/mm", 1.0),
    "bending_stiffness": ("N mm/rad", 1.0),
    "damping_ratio": ("", 1.0),
    "damping_translation": ("kg/s", 1e3),
    "damping_rotation": ("kg m^2/s", 1e-3),
    "contact_cutoff": ("deg", float(np.rad2deg(1.0))),
}
"""Unit in words of each constant, and how many of it a working unit is."""


ELASTIC_NAMES: tuple[ConstantName, ...] = (
    "axial_stiffness",
    "shear_stiffness",
    "bending_stiffness",
)


class Constants(NamedTuple):
    """Holds values of all constants of a specimen, wanted or not.

    Attributes:
        material: density, stiffness and damping.
        contact: in the tests of forces, if there is any.
        spacing: of the lattice, mm.
        cutoff: cut-off angle of contact, rad, where it is wanted or is not that of `contact`.
    """

    material: MaterialConstants
    contact: Contact | None
    spacing: float
    cutoff: float | None = None

    @property
    def numbers(self) -> Floats:
        """(5,) axial, shear, bending stiffness, damping of translation and of rotation."""
        given = self.material
        stiffness = (given.axial_stiffness, given.shear_stiffness, given.bending_stiffness)
        return np.array([*stiffness, *given.damping_coefficients(self.spacing)])

    @property
    def ratio(self) -> float:
        """Damping ratio of the rotation of one unit on one ligament, by the authors' inertia."""
        if self.material.damping.ratio is not None:
            return self.material.damping.ratio
        _, inertia = unrotated_inertia(self.material.density, self.spacing)
        _, rotation = self.material.damping_coefficients(self.spacing)
        return rotation / (2 * math.sqrt(inertia * self.material.bending_stiffness))

    def value(self, name: ConstantName) -> float:
        """Computes the value of one constant in its working unit."""
        if name == "contact_cutoff":
            return self.law.cutoff_angle
        if name == "damping_ratio":
            return self.ratio
        if name.startswith("damping_"):
            coefficients = self.material.damping_coefficients(self.spacing)
            return coefficients[name == "damping_rotation"]
        return float(getattr(self.material, name))

    @property
    def law(self) -> VoidAngleContact:
        """Law of contact on the void angles; of angles that no void has where there is none."""
        if self.contact is None:
            return VoidAngleContact(-math.inf, -math.inf)
        given = self.contact.cutoff_angle
        return VoidAngleContact(
            self.contact.barrier_angle, given if self.cutoff is None else self.cutoff
        )

    def logs(self, names: Sequence[ConstantName]) -> Floats:
        """Natural logarithms of constants; of the cut-off, that of its distance to the barrier."""
        barrier = self.law.barrier_angle
        return np.log(
            [self.value(name) - (barrier if name == "contact_cutoff" else 0.0) for name in names]
        )

    def at(self, names: Sequence[ConstantName], logs: Floats) -> Constants:
        """Replaces the named constants."""
        stiffness: dict[str, float] = {}
        damping: dict[str, float] = {}
        cutoff = self.cutoff
        for name, value in zip(names, np.exp(logs).tolist(), strict=True):
            if name == "contact_cutoff":
                cutoff = self.law.barrier_angle + value
            elif name.startswith("damping_"):
                damping[name.removeprefix("damping_")] = value
            else:
                stiffness[name] = value
        law = self.material.damping.model_copy(update=damping)
        changed = self.material.model_copy(update={**stiffness, "damping": law})
        return self._replace(material=changed, cutoff=cutoff)


def start_constants(asked: Calibration) -> Constants:
    """Returns the constants that a calibration starts from."""
    made = Constants(asked.material, asked.contact, asked.spacing)
    return made._replace(cutoff=made.law.cutoff_angle) if "contact_cutoff" in asked.fit else made
