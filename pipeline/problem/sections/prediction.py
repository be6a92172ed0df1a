"""Describes tolerances of specimens and constants: the section `prediction`."""

import math
from typing import Annotated, Any

from pydantic import Field

from pipeline.problem.fields import Angle, Gap, Samples, Section, Share


class Assembly(Section):
    """Deviation of units from their place once they are joined, at rest and without force.

    Attributes:
        shift: standard deviation along x and along y.
        turn: standard deviation of the rotation.
    """

    shift: Gap = 0.1
    turn: Angle = math.radians(0.4)


class Tolerances(Section):
    """Deviations of a specimen from its design, and of the constants from the true ones.

    Attributes:
        geometry: largest shift of a vertex along x and y, either way and evenly spread, as a share
            of the spacing.
        ligaments: standard deviation of every ligament's stiffnesses, as a share of them.
        stiffness: the same of each of the three stiffnesses, of all ligaments together.
        units: standard deviation of every unit's damping, as a share of it.
        damping: the same of the damping of all units together.
        assembly: how far units are off their place.
    """

    geometry: Share = 0.01
    ligaments: Share = 0.05
    stiffness: Share = 0.05
    units: Share = 0.1
    damping: Share = 0.2
    assembly: Assembly = Assembly()


class Prediction(Section):
    """The spread of the simulation that a measured course is compared with.

    A size that is not given is the smallest that `robustness` tries of its kind, where it tries
    some, and else the default of `virtual.specimen`.

    Attributes:
        samples: specimens drawn.
        level: part of the specimens between the limits of the band.
        seed: of the draws.
        geometry: largest shift of a vertex along x and y, either way and evenly spread, as a share
            of the spacing.
        ligaments: standard deviation of every ligament's stiffnesses, as a share of them.
        stiffness: the same of each of the three stiffnesses, of all ligaments together.
        units: standard deviation of every unit's damping, as a share of it.
        damping: the same of the damping of all units together.
        assembly: how far units are off their place.
    """

    samples: Samples = 64
    level: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    seed: Annotated[int, Field(ge=0, strict=True)] = 0
    geometry: Share | None = None
    ligaments: Share | None = None
    stiffness: Share | None = None
    units: Share | None = None
    damping: Share | None = None
    assembly: Assembly | None = None

    @property
    def given(self) -> dict[str, Any]:
        """Returns the sizes that are given, by name."""
        sizes = {name: getattr(self, name) for name in Tolerances.model_fields}
        return {name: size for name, size in sizes.items() if size is not None}
