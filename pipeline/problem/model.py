"""Defines the typed problem: every section of `problem.yaml`, in working units."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.problem.fields import (
    Angle,
    Count,
    Duration,
    Gap,
    Length,
    Positive,
    PositiveShare,
    Samples,
    Section,
    exactly_one,
)
from pipeline.problem.sections import (
    STIFFNESSES,
    CloakRegion,
    Contact,
    Designs,
    Drive,
    Fabrication,
    Lattice,
    LinearRampDrive,
    MaterialConstants,
    ObjectiveSection,
    Optimiser,
    Prediction,
    Region,
    ReportOptions,
    Robustness,
    Spectrum,
    Support,
    Sweep,
    TanhRampDrive,
    TestSetup,
    TimeSeriesDrive,
    Tolerances,
    VoidRegion,
    read_several,
    single_drives,
)

SWITCHES = frozenset({("robustness", "together"), ("fabrication", "shims", "tabs")})
"""Keys that are on by default, and off with null."""
_STATIC_INFILL = 0.15


class Inclusion(Section):
    """Units made rigid.

    Attributes:
        region: where they are.
        stiffness_factor: how many times stiffer every ligament is that touches one of them.
    """

    region: Region
    stiffness_factor: Annotated[float, Field(gt=1.0, allow_inf_nan=False)] = 200.0


class Horizon(Section):
    """Time over which the loss is taken, in periods of the drive or in s, and its samples.

    Attributes:
        periods: of the drive; or `duration`.
        duration: in time; or `periods`.
        samples: instants spread over a motion in time, both ends included; six or more a period.
        steps: equal load steps of a static path, the unloaded start left out.
    """

    periods: Positive | None = None
    duration: Duration | None = None
    samples: Samples = 200
    steps: Count | None = None

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        exactly_one(self, "periods", "duration")
        return self


class ConstraintLimits(Section):
    """Bounds of designs that can be made and last, none where a key is left out.

    Attributes:
        edge_length: of the units.
        block_angle: between two edges of a unit.
        void_angle: between the edges of neighbouring units, at either side of a ligament.
        gap: between two units.
        convex: whether units must be convex.
        shim_strain: largest strain of the shims' foil, in the perfect structure under the drive's
            own loads and those of `objective.robust`, not under loads in ranges; of
            `material.foil`, or of foil as thick as `fabrication.shims.thickness`.
        straight_shims: whether units must have room for slots along their ligaments (of
            `fabrication.slots`), so that no shim is bent before any load; for convex units.
    """

    edge_length: Length | None = None
    block_angle: Angle | None = None
    void_angle: Angle | None = None
    gap: Gap | None = None
    convex: bool = True
    shim_strain: PositiveShare | None = None
    straight_shims: bool = False


class SolverOptions(Section):
    """Accuracy of the simulation, and the integrator.

    Attributes:
        accuracy: of steps and tolerances; a draft is good for a look.
        integrator: in time; `auto` chooses by the scene, see the page on numerics.
    """

    accuracy: Literal["draft", "default", "tight"] = "default"
    integrator: Literal["auto", "implicit", "explicit"] = "auto"


class ResponseOptions(Section):
    """Part of the response that the report shows.

    Attributes:
        cycles: periods of the drive, in steady motion; a measured one is shown over the horizon.
        samples: instants or load steps, both ends included; six or more a period.
    """

    cycles: Positive = 4.0
    samples: Samples = 401


class Problem(Section):
    """A study: what to design, under which loads, to which end; in mm, N, s, tonne, rad.

    Attributes:
        title: of figure and page.
        doc: what the study shows, in some sentences.
        lattice: the intact structure.
        material: of units and ligaments.
        contact: of units.
        supports: what holds the structure.
        drive: what moves it; a list of what moves it at once may stand under `drives` instead.
        horizon: over which the loss is taken.
        void: what is cut out.
        inclusion: what is made rigid.
        cloak: where units may be redesigned.
        objective: what is asked of the others.
        constraints: what can be made.
        optimiser: how to look for the design.
        solver: accuracy of the simulation.
        response: how much of it is shown.
        designs: values of one parameter, named by its keys joined by dots: a design for each, and,
            of a harmonic drive, one page of all.
        sweep: the losses at many settings of parameters, if they are wanted.
        robustness: trials of imperfect copies, if there are to be any.
        prediction: by how much specimens and constants may be off.
        spectrum: analysis of small vibrations, if there is to be one.
        report: choices of figure and page.
        fabrication: how it is made.
    """

    title: str = ""
    doc: str = ""
    lattice: Lattice
    material: MaterialConstants
    contact: Contact
    supports: tuple[Support, ...] = ()
    drive: Drive
    horizon: Horizon
    void: VoidRegion | None = None
    inclusion: Inclusion | None = None
    cloak: CloakRegion
    objective: ObjectiveSection
    constraints: ConstraintLimits = ConstraintLimits()
    optimiser: Optimiser
    solver: SolverOptions = SolverOptions()
    response: ResponseOptions = ResponseOptions()
    designs: Designs | None = None
    sweep: Sweep | None = None
    robustness: Robustness | None = None
    prediction: Prediction = Prediction()
    spectrum: Spectrum | None = None
    report: ReportOptions = ReportOptions()
    fabrication: Fabrication = Fabrication()

    @model_validator(mode="after")
    def _made_of_foil(self) -> Self:
        """Fills in what follows from the foil of the ligaments, where it is given."""
        if (strip := self.material.foil) is None:
            return self
        stiffness = strip.foil.stiffness(self.lattice.ligament_length)
        constants = dict(zip(STIFFNESSES, stiffness, strict=True))
        made = self.fabrication
        shims = made.shims.model_copy(
            update={
                name: getattr(strip, name)
                for name in ("thickness", "young_modulus")
                if name not in made.shims.model_fields_set
            }
        )
        update: dict[str, object] = {"shims": shims}
        if "thickness" not in made.model_fields_set:
            update["thickness"] = strip.width
        return self.model_copy(
            update={
                "material": self.material.model_copy(update=constants),
                "fabrication": made.model_copy(update=update),
            }
        )

    @property
    def shim_thickness(self) -> float:
        """Returns the thickness of the ligaments' foil in mm."""
        return self.fabrication.shims.thickness

    @model_validator(mode="before")
    @classmethod
    def _several_drives(cls, data: object) -> object:
        return read_several(data)

    @property
    def infill(self) -> float:
        """Returns the share of the parts' inside that is printed."""
        if (infill := self.fabrication.print.infill) is not None:
            return infill
        return _STATIC_INFILL if self.static else min(1.0, self.solid_share)

    @property
    def solid_share(self) -> float:
        """Returns the simulated mass of the units over that of solid ones as they are made."""
        made = self.fabrication
        return self.material.density / (made.solid_density * made.thickness)

    @property
    def static(self) -> bool:
        """Tells a load that grows so slowly that inertia plays no part."""
        return all(
            isinstance(drive, LinearRampDrive | TanhRampDrive) or getattr(drive, "static", False)
            for drive in single_drives(self.drive)
        )

    def with_optimiser(self, **values: object) -> Problem:
        """Returns the problem with other values of these keys of its optimiser."""
        return self.model_copy(update={"optimiser": self.optimiser.model_copy(update=values)})

    def in_setup(self, setup: TestSetup) -> Problem:
        """Returns the problem with the supports and drives of another set-up."""
        return self.model_copy(update={"supports": setup.supports, "drive": setup.drive})

    def asks_more_than(self, own: Problem) -> bool:
        """Tells a preset of the study `own` that is to hold against more or other loads."""
        robust = self.objective.robust
        other = robust is not None and robust != own.objective.robust
        return other or self.drive.kind != own.drive.kind

    @property
    def frequency(self) -> float | None:
        """Returns the frequency of the drive in Hz, where it has one; the highest of several."""
        every = (getattr(drive, "frequency", None) for drive in single_drives(self.drive))
        return max((each for each in every if each is not None), default=None)

    @property
    def horizon_time(self) -> float:
        """Computes the time over which the loss is taken, in s."""
        if self.horizon.duration is not None:
            return self.horizon.duration
        assert self.horizon.periods is not None
        assert self.frequency is not None
        return self.horizon.periods / self.frequency

    @property
    def measured(self) -> bool:
        """Tells a drive that follows a file, if only one of several."""
        return any(isinstance(drive, TimeSeriesDrive) for drive in single_drives(self.drive))

    @property
    def response_time(self) -> float:
        """Computes the time that is shown, in s: as many cycles as are asked for.

        It is the horizon at least, and no more where a file need not go on.
        """
        if self.frequency is None or self.measured:
            return self.horizon_time
        return max(self.horizon_time, self.response.cycles / self.frequency)

    @property
    def tolerances(self) -> Tolerances:
        """Combines `prediction` and `robustness` to tolerances of specimens and constants."""
        tried = self.robustness
        sizes = {"geometry": tried.geometry, "ligaments": tried.stiffness} if tried else {}
        found = {name: min(given) for name, given in sizes.items() if given}
        return Tolerances(**(found | self.prediction.given))

    @property
    def damping_coefficients(self) -> tuple[float, float]:
        """Translational (tonne/s) and rotary (tonne mm^2/s) damping of every unit."""
        return self.material.damping_coefficients(self.lattice.spacing)
