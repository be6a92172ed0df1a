"""Describes the target of a design, and the loads and copies that it holds against."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pipeline.problem.fields import Frequency, Length, Positive, Ratio, Section
from pipeline.problem.sections.regions import Region


class Load(Section):
    """The drive with another amplitude, another frequency, or both.

    Attributes:
        amplitude: in place of the drive's.
        frequency: in place of the drive's.
        weight: in the loss, where the drive's own loads have the weight 1 together.
    """

    amplitude: Length | None = None
    frequency: Frequency | None = None
    weight: Positive = 1.0


class Robust(Section):
    """Loads and imperfections that a design is to hold against besides the drive.

    Attributes:
        loads: that are simulated besides, along all of the drive's directions.
        sharpness: p of the p-mean of the losses under all loads: 1 is their mean, 8 or more leads
            to the worst of them.
        copies: number of imperfect copies, whose mean loss is minimised in place of the perfect
            structure's; none by default.
        geometry: largest shift of their vertices along x and y, as a share of the spacing.
        seed: of the shifts.
    """

    loads: tuple[Load, ...] = ()
    sharpness: Annotated[float, Field(ge=1.0, le=64.0)] = 1.0
    copies: Annotated[int, Field(ge=0, le=64, strict=True)] = 0
    geometry: Ratio = 0.03
    seed: Annotated[int, Field(ge=0, strict=True)] = 0


class ObjectiveSection(Section):
    """Target of the surroundings or of a region.

    Attributes:
        kind: what is compared: displacements and rotations, or the strain energy.
        target: stay at rest, or do as in the intact lattice.
        region: the units that are looked at; `surroundings` are all but void, inclusion and cloak.
        robust: what else the design is to hold against, if anything.
        snap: whether a static structure may snap to another branch of equilibria on its way, or is
            designed to avoid it.
        snap_margin: smallest eigenvalue of the tangent that all loads must then leave, as a share
            of that of the initial structure at rest.
    """

    kind: Literal["displacement", "strain_energy"]
    target: Literal["rest", "intact"]
    region: Literal["surroundings"] | Region = "surroundings"
    robust: Robust | None = None
    snap: Literal["allow", "avoid"] = "allow"
    snap_margin: Ratio = 0.05
