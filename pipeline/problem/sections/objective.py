"""Describes the target of a design, and the loads and copies that it holds against."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.problem.fields import Angle, Count, Frequency, Length, Positive, Section, Share, fault
from pipeline.problem.sections.drives import Support
from pipeline.problem.sections.regions import Region
from pipeline.problem.sections.several_drives import Drive, read_several


class Load(Section):
    """The drive with another amplitude, another frequency, or both.

    Attributes:
        amplitude: in place of the drive's.
        frequency: in place of the drive's; its loss is over the drive's own horizon, in seconds,
            into which fewer periods of a slower load fit.
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
        stiffness: standard deviation of each of their ligaments' stiffnesses, as a share of it;
            none by default.
        copy_sharpness: p of the p-mean of the copies' losses: 1 is their mean, 8 or more leads to
            the worst of them.
        seed: of the shifts and stiffnesses.
    """

    loads: tuple[Load, ...] = ()
    sharpness: Annotated[float, Field(ge=1.0, le=64.0)] = 1.0
    copies: Annotated[int, Field(ge=0, le=64, strict=True)] = 0
    geometry: Share = 0.03
    stiffness: Share | None = None
    copy_sharpness: Annotated[float, Field(ge=1.0, le=64.0)] = 1.0
    seed: Annotated[int, Field(ge=0, strict=True)] = 0

    @model_validator(mode="after")
    def _of_copies(self) -> Self:
        """Refuses what copies are like where neither many nor none (`copies: 0`) are asked for."""
        given = self.model_fields_set
        for name in ("geometry", "stiffness", "copy_sharpness", "seed"):
            if name in given and "copies" not in given:
                what = "it is of imperfect copies, and none are asked for"
                raise fault(what, "give `copies` too, such as 4, or leave it out", name)
        return self


class _Ranges(Section):
    """Ranges of loads, each from its least to its greatest value.

    Attributes:
        directions: of the motion; the drive's outermost ones by default. Of two drives at once, of
            their amplitudes: 0 deg is the first alone, 90 deg the second.
        amplitude: of the motion; the drive's by default. Of two drives at once, the root of the sum
            of their squares.
        frequency: of a harmonic drive, whose horizon is in periods; the drive's by default.
    """

    directions: tuple[Angle, Angle] | None = None
    amplitude: tuple[Length, Length] | None = None
    frequency: tuple[Frequency, Frequency] | None = None

    @model_validator(mode="after")
    def _ascend(self) -> Self:
        for name in ("directions", "amplitude", "frequency"):
            given = getattr(self, name)
            if given is not None and given[0] > given[1]:
                raise fault("the range runs backwards", "give the least value first", name)
        return self


class TestSetup(_Ranges):
    """Another set-up of the structure, with loads of its own in ranges.

    Ranges of amplitudes and frequencies that are left out are those of the loads in the study's
    set-up; where these give none, its own drive's values.

    Attributes:
        supports: in it; none by default.
        drive: in it; a list of what moves it at once may stand under `drives` instead.
    """

    supports: tuple[Support, ...] = ()
    drive: Drive

    @model_validator(mode="before")
    @classmethod
    def _several_drives(cls, data: object) -> object:
        return read_several(data)


class LoadRanges(_Ranges):
    """Loads of the drive's kind in ranges, each from its least to its greatest value.

    The design minimises the worst loss under any of them. The loss under a load is relative to its
    size: with the target at rest it counts with the square of the drive's amplitude over the
    load's.

    Attributes:
        setups: other supports and drives, under which it is to hold loads as well.
        sharpness: p of the p-mean of the losses under the worst loads found so far.
        nominal: share, in what is minimised, of the mean loss under the drive's own loads.
        search_every: evaluations of the design, after which the worst load is searched again.
    """

    setups: tuple[TestSetup, ...] = ()
    sharpness: Annotated[float, Field(ge=1.0, le=64.0)] = 16.0
    nominal: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    search_every: Count = 16


class ObjectiveSection(Section):
    """Target of the surroundings or of a region; docs/concepts.md has the formulas of the losses.

    Attributes:
        kind: what is compared: displacements and rotations, or the strain energy.
        target: stay at rest, or do as in the intact lattice.
        region: the units that are looked at; `surroundings` are all but void, inclusion and cloak.
        reaction: weight of the relative error of the drive's force, added to that of the motion
            while designing, where the intact lattice is mimicked; none by default. Losses of
            responses are of the motion alone. The force is that of ligaments: where contact is on
            distance, without what units that touch press on those driven.
        robust: what else the design is to hold against, if anything.
        loads: all loads that it is to hold against, in ranges; in place of `robust`.
        snap: whether a static structure may snap to another branch of equilibria on its way, or is
            designed to avoid it; imperfect copies may.
        snap_margin: smallest eigenvalue of the tangent that all loads must then leave, as a share
            of that of the initial structure at rest.
    """

    kind: Literal["displacement", "strain_energy"]
    target: Literal["rest", "intact"]
    region: Literal["surroundings"] | Region = "surroundings"
    reaction: Positive | None = None
    robust: Robust | None = None
    loads: LoadRanges | None = None
    snap: Literal["allow", "avoid"] = "allow"
    snap_margin: Positive = 0.05
