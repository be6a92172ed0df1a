"""The typed problem: every section of `problem.yaml`, in working units once validated."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.problem.drives import Drive, Harmonic, LinearRamp, RampHarmonic, TanhRamp
from pipeline.problem.fabrication import Fabrication
from pipeline.problem.families import Designs
from pipeline.problem.lattices import Lattice
from pipeline.problem.prediction import Prediction, Tolerances
from pipeline.problem.quantities import (
    Angle,
    BendingStiffness,
    ContactStiffness,
    Count,
    Damping,
    Density,
    Duration,
    Frequency,
    Gap,
    Length,
    Positive,
    Ratio,
    RotaryDamping,
    Samples,
    Stiffness,
    fault,
)
from pipeline.problem.regions import CloakRegion, Region, VoidRegion
from pipeline.problem.report import Report, Robustness
from pipeline.problem.section import Section, exactly_one
from pipeline.problem.selection import Selector
from pipeline.problem.spectrum import Spectrum
from pipeline.problem.sweeping import Sweep

UNROTATED_AREA = 0.36125  # over spacing^2: the authors' square of half diagonal 0.425 spacings
UNROTATED_MOMENT = 0.02175026  # over spacing^4: its polar moment, to the authors' digits


class DampingLaw(Section):
    """Viscous damping to ground per unit: the authors' ratio, or the two coefficients.

    Attributes:
        ratio: over the critical damping of one unit on one ligament.
        translation: force over velocity; together with `rotation`.
        rotation: torque over angular velocity.
    """

    ratio: Ratio | None = None
    translation: Damping | None = None
    rotation: RotaryDamping | None = None

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        pair = [self.translation is not None, self.rotation is not None]
        if (self.ratio is not None) == any(pair) or any(pair) != all(pair):
            raise fault("one form of damping is wanted", "give ratio, or translation and rotation")
        return self


class Material(Section):
    """Units and ligaments.

    Attributes:
        density: mass of the units over their area, in the plane.
        axial_stiffness: force over elongation of a ligament.
        shear_stiffness: force over lateral displacement of its ends.
        bending_stiffness: torque over relative rotation of its ends.
        damping: of the units.
    """

    density: Density
    axial_stiffness: Stiffness
    shear_stiffness: Stiffness
    bending_stiffness: BendingStiffness
    damping: DampingLaw

    def damping_coefficients(self, spacing: float) -> tuple[float, float]:
        """Translational (tonne/s) and rotary (tonne mm^2/s) damping of every unit.

        The ratio is that of a single-ligament oscillator with the mass and inertia of a square
        that is not rotated, whatever the design (the authors' formula).
        """
        law = self.damping
        if law.ratio is None:
            assert law.translation is not None
            assert law.rotation is not None
            return law.translation, law.rotation
        mass = UNROTATED_AREA * self.density * spacing**2
        inertia = UNROTATED_MOMENT * self.density * spacing**4
        return (
            law.ratio * 2.0 * math.sqrt(mass * self.shear_stiffness),
            law.ratio * 2.0 * math.sqrt(inertia * self.bending_stiffness),
        )


class Contact(Section):
    """Contact of units: on the void angles of bonded ones (the authors'), or on true distances.

    On angles there is none above the cut-off and no bound at the barrier; on distances none beyond
    `distance` and no bound at a touch. Designs are judged by both.

    Attributes:
        law: by which the design is optimised.
        stiffness: of the contact, torque over angle squared.
        barrier_angle: void angle at which the energy is infinite.
        cutoff_angle: void angle above which there is no contact.
        distance: of two units beyond which there is none; by default a twelfth of the ligaments'
            length, or the gap that the constraints ask for if that is smaller.
    """

    law: Literal["angle", "geometric"]
    stiffness: ContactStiffness
    barrier_angle: Angle
    cutoff_angle: Angle
    distance: Length | None = None


class Support(Section):
    """Units with some of their degrees of freedom held at zero.

    Attributes:
        units: by side, or listed.
        clamp: the degrees of freedom.
    """

    units: Selector
    clamp: Annotated[tuple[Literal["ux", "uy", "theta"], ...], Field(min_length=1)] = (
        "ux",
        "uy",
        "theta",
    )


class Inclusion(Section):
    """Units made rigid.

    Attributes:
        region: where they are.
        stiffness_factor: how many times stiffer every ligament is that touches one of them.
    """

    region: Region
    stiffness_factor: Annotated[float, Field(gt=1.0, allow_inf_nan=False)] = 200.0


class Horizon(Section):
    """How long the loss looks, in periods of the drive or in time, and at how many instants.

    Attributes:
        periods: of the drive; or `duration`.
        duration: in time; or `periods`.
        samples: instants spread over a motion in time, both ends included.
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
    """What a design is to hold against besides the drive.

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


class Objective(Section):
    """What the surroundings or a region should do.

    Attributes:
        kind: what is compared: displacements and rotations, or the strain energy.
        target: stay at rest, or do as in the intact lattice.
        region: the units that are looked at; `surroundings` are all but void, inclusion and cloak.
        robust: what else the design is to hold against, if anything.
    """

    kind: Literal["displacement", "strain_energy"]
    target: Literal["rest", "intact"]
    region: Literal["surroundings"] | Region = "surroundings"
    robust: Robust | None = None


class Constraints(Section):
    """What can be made: lower bounds at every unit, none where a key is left out.

    Attributes:
        edge_length: of the units.
        block_angle: between two edges of a unit.
        void_angle: between the edges of neighbouring units, at either side of a ligament.
        gap: between two units.
        convex: whether units must be convex.
    """

    edge_length: Length | None = None
    block_angle: Angle | None = None
    void_angle: Angle | None = None
    gap: Gap | None = None
    convex: bool = True


class Method(Section):
    """The budget of one optimisation method.

    Attributes:
        evaluations: of loss and gradient, at most.
    """

    evaluations: Count


class Methods(Section):
    """The optimisation methods to run; the better design is shipped.

    Attributes:
        sqp: sequential quadratic programming in a trust region.
        mma: method of moving asymptotes, as the authors do.
    """

    sqp: Method | None = None
    mma: Method | None = None

    @property
    def chosen(self) -> dict[str, Method]:
        """The methods asked for, by name."""
        pairs = {"sqp": self.sqp, "mma": self.mma}
        return {name: method for name, method in pairs.items() if method is not None}


class Optimiser(Section):
    """How to look for the design; lengths are shifts of vertices.

    Attributes:
        methods: one or both.
        geometric: the budget with which a design by the angle law of contact is optimised again
            with contact on distance, where its loss depends on the law.
        symmetry: that the design is to have.
        trust_radius: at the start.
        trust_radius_max: at most.
        kick: random shifts with which an optimisation that has ended goes on, as far as its
            budget allows.
        seed: of the kicks.
    """

    methods: Methods
    geometric: Method = Method(evaluations=60)
    symmetry: Literal["none", "C4", "mirror_x", "mirror_y"] = "none"
    trust_radius: Length = 0.25
    trust_radius_max: Length = 1.0
    kick: Length = 0.15
    seed: Annotated[int, Field(ge=0, strict=True)] = 0


class Solver(Section):
    """Accuracy of the simulation, and the integrator.

    Attributes:
        accuracy: of steps and tolerances; a draft is good for a look.
        integrator: in time; `auto` chooses by the scene, see the page on numerics.
    """

    accuracy: Literal["draft", "default", "tight"] = "default"
    integrator: Literal["auto", "implicit", "explicit"] = "auto"


class Response(Section):
    """How much of the response the report shows.

    Attributes:
        cycles: periods of the drive.
        samples: instants or load steps, both ends included.
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
        drive: what moves it.
        horizon: over which the loss is taken.
        void: what is cut out.
        inclusion: what is made rigid.
        cloak: where units may be redesigned.
        objective: what is asked of the others.
        constraints: what can be made.
        optimiser: how to look for the design.
        solver: accuracy of the simulation.
        response: how much of it is shown.
        designs: values of one parameter, named by its keys joined by dots: a design for each.
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
    material: Material
    contact: Contact
    supports: tuple[Support, ...] = ()
    drive: Drive
    horizon: Horizon
    void: VoidRegion | None = None
    inclusion: Inclusion | None = None
    cloak: CloakRegion
    objective: Objective
    constraints: Constraints = Constraints()
    optimiser: Optimiser
    solver: Solver = Solver()
    response: Response = Response()
    designs: Designs | None = None
    sweep: Sweep | None = None
    robustness: Robustness | None = None
    prediction: Prediction = Prediction()
    spectrum: Spectrum | None = None
    report: Report = Report()
    fabrication: Fabrication = Fabrication()

    @property
    def static(self) -> bool:
        """Whether the load grows so slowly that inertia plays no part."""
        return isinstance(self.drive, LinearRamp | TanhRamp)

    @property
    def frequency(self) -> float | None:
        """The frequency of the drive in Hz, where it has one."""
        return self.drive.frequency if isinstance(self.drive, Harmonic | RampHarmonic) else None

    @property
    def horizon_time(self) -> float:
        """The time over which the loss is taken, in s."""
        if self.horizon.duration is not None:
            return self.horizon.duration
        assert self.horizon.periods is not None
        assert self.frequency is not None
        return self.horizon.periods / self.frequency

    @property
    def tolerances(self) -> Tolerances:
        """By how much specimens and constants may be off: see `Prediction`."""
        tried = self.robustness
        sizes = {"geometry": tried.geometry, "ligaments": tried.stiffness} if tried else {}
        found = {name: min(given) for name, given in sizes.items() if given}
        return Tolerances(**(found | self.prediction.given))

    @property
    def damping_coefficients(self) -> tuple[float, float]:
        """Translational (tonne/s) and rotary (tonne mm^2/s) damping of every unit."""
        return self.material.damping_coefficients(self.lattice.spacing)
