"""Poses a design problem: structure, loads, what counts, what may change, and how it is solved."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from sim.core import Floats, Ints
from sim.energy import Topology, topology
from sim.solvers import (
    DISPLACEMENT,
    Harmonic,
    LinearRamp,
    MotionLaw,
    PrescribedMotion,
    Pulse,
    TanhRamp,
    single_motions,
)
from sim.structure import (
    ContactModel,
    Copies,
    DesignSpace,
    FoilLimit,
    Lattice,
    Material,
    Symmetry,
    VoidAngleContact,
    design_space,
)

Accuracy = Literal["draft", "default", "tight"]
Integrator = Literal["auto", "implicit", "explicit"]
Dof = Literal["ux", "uy", "theta"]
DOFS: tuple[Dof, ...] = ("ux", "uy", "theta")
DIRECTED = Harmonic | Pulse | LinearRamp | TanhRamp
"""Motions along a direction."""


AUTHORS_CONTACT = VoidAngleContact(float(np.deg2rad(-15.0)), float(np.deg2rad(-10.0)))


def _none() -> Ints:
    return np.zeros(0, dtype=np.int64)


def displaced(case: PrescribedMotion) -> Ints:
    """Ids of the dofs whose displacement or rotation a load case prescribes."""
    dofs = 3 * case.units[:, None] + np.arange(3)
    return dofs.ravel() if case.control is None else dofs[case.control == DISPLACEMENT]


@dataclass(frozen=True)
class Structure:
    """Holds what is loaded.

    Attributes:
        lattice: the initial network, mm.
        material: constants of units and ligaments.
        contact: law by which units touch, rad or mm; the authors' by default.
    """

    lattice: Lattice
    material: Material
    contact: ContactModel = AUTHORS_CONTACT


@dataclass(frozen=True)
class Clamp:
    """Holds units at zero.

    Attributes:
        units: (n,) ids.
        dofs: which of their degrees of freedom.
    """

    units: Ints
    dofs: tuple[Dof, ...] = DOFS


@dataclass(frozen=True)
class Loads:
    """Holds what acts on a structure, one load case after the other.

    Attributes:
        cases: what acts in each load case: a motion, or forces, and the units that follow it; dofs
            that any case displaces are held in all, and all load the same units.
        supports: units that rest in all cases.
        duration: s; the length of the load path in a static scene.
        frequency: highest frequency of the drive, Hz; by default that of its harmonic motions,
            None if there are none.
        static: whether inertia plays no part.
        weights: (n_cases,) of the cases in the loss, sum 1; equal ones by default.
    """

    cases: tuple[PrescribedMotion, ...]
    supports: tuple[Clamp, ...] = ()
    duration: float = 1.0
    frequency: float | None = None
    static: bool = False
    weights: Floats | None = None

    @property
    def case_weights(self) -> Floats:
        """(n_cases,) weight of each case in the loss."""
        n = len(self.cases)
        return np.full(n, 1 / n) if self.weights is None else self.weights

    @property
    def drive_frequency(self) -> float | None:
        """Highest frequency of the drive, Hz; None if it has none."""
        every = [one for motion in self.motions for one in single_motions(motion)]
        found = [float(one.frequency) for one in every if isinstance(one, Harmonic)]
        return max(found, default=None) if self.frequency is None else self.frequency

    @property
    def motions(self) -> tuple[MotionLaw, ...]:
        """Lists the motion of each case."""
        return tuple(case.motion for case in self.cases)

    @cached_property
    def driven(self) -> Ints:
        """(n,) units that any case drives, ascending."""
        return np.unique(np.concatenate([_none(), *(case.units for case in self.cases)]))

    @cached_property
    def loaded(self) -> Ints:
        """(n,) units under forces, ascending.

        Raises:
            ValueError: load cases put forces on different units.
        """
        first, *others = [case.loaded for case in self.cases] or [_none()]
        if any(not np.array_equal(first, other) for other in others):
            raise ValueError("all load cases must put forces on the same units, if only of zero")
        return first

    def following(self, motion: MotionLaw) -> PrescribedMotion:
        """Prescribes another motion of the driven units, or forces on them."""
        if any(case.control is not None for case in self.cases):
            return self.cases[0]._replace(motion=motion)
        return PrescribedMotion(self.driven, motion)

    @cached_property
    def clamped(self) -> Ints:
        """(n,) ids (3 unit + dof) of the dofs that rest by a support, ascending."""
        dofs = [3 * each.units + DOFS.index(dof) for each in self.supports for dof in each.dofs]
        return np.unique(np.concatenate([_none(), *dofs]))

    @cached_property
    def held(self) -> Ints:
        """(n_held,) ids of all dofs whose motion is prescribed, ascending."""
        driven = [displaced(case) for case in self.cases]
        return np.unique(np.concatenate([self.clamped, *driven]))


@dataclass(frozen=True)
class Objective:
    """Holds what a design is to do.

    The loss of a load case is made of U = (ux / s, uy / s, theta) of the region's units, with the
    lattice's spacing s. Compared with rest it is the mean over the time of |U|^2 summed, not
    averaged, over the units: over the duration by Simpson's rule on samples, or the average of the
    load steps. A motion V to mimic gives a relative error, with |U - V| in place of |U| and the
    target's size, the root of |V|^2 summed over the units: on samples the root of that mean over
    the greatest size, on load steps the root of the sum over the steps over the last step's size
    (the authors' measure). A strain energy, N mm, is the mean over the time of that of the
    ligaments that touch the region, without contact, strains counted from where they rest.

    Attributes:
        region: (n,) ids of the units of interest.
        kind: what is compared: displacements and rotations, or the strain energy.
        samples: number of samples that the loss is integrated over, odd.
        steps: number of equal load steps that it is taken at instead; the start is none of them.
        reference: the scene whose region should move alike, its units in the same order; None to
            compare with rest.
        reaction: weight of the relative error of the drive's force, where a reference is mimicked,
            in the sum of both.
        sharpness: p of the weighted p-mean of the cases' losses that is minimised: 1 is their mean,
            a large one a smooth maximum.
        copy_sharpness: the same of the losses of the design's imperfect copies.
        snap_margin: smallest eigenvalue of the tangent that a design must keep at all loads of a
            static scene, over that of the initial structure at rest; None where it may snap.
        foil: largest strain of the foil of its ligaments that a design must keep to at all times;
            None where it may be strained.
    """

    region: Ints = field(default_factory=_none)
    kind: Literal["displacement", "strain_energy"] = "displacement"
    samples: int = 201
    steps: int | None = None
    reference: Scene | None = None
    reaction: float = 0.0
    sharpness: float = 1.0
    copy_sharpness: float = 1.0
    snap_margin: float | None = None
    foil: FoilLimit | None = None


@dataclass(frozen=True)
class Design:
    """Holds what may change.

    Attributes:
        cloak: (n,) ids of the units to redesign.
        frozen: (n,) ids of units whose vertices stay, whoever shares them; None for the driven.
        symmetry: imposed on the design.
        turning_slots: whether the slots that hold the ligaments turn as well: shims are then bent
            before any load, and all motion is counted from where the structure rests.
        copies: imperfect ones, whose losses count; None for the structure alone.
    """

    cloak: Ints = field(default_factory=_none)
    frozen: Ints | None = None
    symmetry: Symmetry = "none"
    turning_slots: bool = False
    copies: Copies | None = None


@dataclass(frozen=True)
class Numerics:
    """Holds how motions are computed.

    Attributes:
        accuracy: of steps and tolerances; a draft is good for a look.
        integrator: in time; ``auto`` chooses by the scene.
    """

    accuracy: Accuracy = "default"
    integrator: Integrator = "auto"


@dataclass(frozen=True, eq=False)
class Scene:
    """Holds everything that a simulation and its loss depend on but the design vector.

    Attributes:
        structure: what is loaded.
        loads: what acts on it.
        objective: what a design is to do.
        design: what may change.
        numerics: how motions are computed.
    """

    structure: Structure
    loads: Loads
    objective: Objective = Objective()
    design: Design = Design()
    numerics: Numerics = Numerics()

    @property
    def lattice(self) -> Lattice:
        """Returns the initial network."""
        return self.structure.lattice

    @property
    def is_held(self) -> bool:
        """Tells whether supports and prescribed motions hold it against moving or turning as one.

        A force holds nothing.
        """
        unit, dof = np.divmod(self.loads.held, 3)
        sites = (self.lattice.site - self.lattice.site.mean(axis=0)) / self.lattice.spacing
        x, y = sites[unit].T
        turned = np.select([dof == 0, dof == 1], [-y, x], 1.0)
        modes = np.stack([dof == 0, dof == 1, turned], axis=1)
        return bool(np.linalg.matrix_rank(modes) == modes.shape[1])

    def updated(self, **changes: Any) -> Scene:  # noqa: ANN401  (fields of the records)
        """Replaces fields of the records, whichever holds them, such as ``accuracy="tight"``.

        Raises:
            TypeError: no record has a field of that name.
        """
        records = {}
        for record in fields(self):
            old = getattr(self, record.name)
            own = {
                each.name: changes.pop(each.name) for each in fields(old) if each.name in changes
            }
            records[record.name] = replace(old, **own)
        if changes:
            raise TypeError(f"no record of a scene has the fields {', '.join(changes)}")
        return Scene(**records)

    def bent(self, end_angles: Floats) -> Scene:
        """Bends the ligaments by angles (n_ligaments, 2) at their ends, rad; see `Material`."""
        material = self.structure.material._replace(end_angles=end_angles)
        return self.updated(material=material, turning_slots=False)

    def driven_by(self, *motions: MotionLaw, **changes: Any) -> Scene:  # noqa: ANN401
        """Replaces the motions of the driven units, weighted equally; changes as of `updated`."""
        cases = tuple(self.loads.following(motion) for motion in motions)
        return self.updated(**{"cases": cases, "weights": None, **changes})

    def under(
        self,
        motions: tuple[MotionLaw, ...],
        duration: float,
        frequency: float | None,
        **changes: Any,  # noqa: ANN401
    ) -> Scene:
        """Replaces the motions of the driven units, of the reference as well; so with changes."""
        reference = self.objective.reference
        return self.driven_by(
            *motions,
            duration=duration,
            frequency=frequency,
            reference=reference and reference.under(motions, duration, frequency, **changes),
            **changes,
        )

    def alone(self, case: int) -> Scene:
        """Keeps one of the load cases, of the reference as well."""
        reference = self.objective.reference
        return self.updated(
            cases=(self.loads.cases[case],),
            weights=None,
            reference=reference and reference.alone(case),
        )

    def with_contact(self, contact: ContactModel) -> Scene:
        """Replaces the law of contact, of the reference as well."""
        reference = self.objective.reference
        return self.updated(
            contact=contact, reference=reference and reference.with_contact(contact)
        )

    @cached_property
    def space(self) -> DesignSpace:
        """Shifts of the cloak's vertices; those of frozen units stay."""
        design = self.design
        frozen = self.loads.driven if design.frozen is None else design.frozen
        return design_space(
            self.lattice, design.cloak, frozen, design.symmetry, design.turning_slots
        )

    @cached_property
    def topology(self) -> Topology:
        """Joins the fixed structure; differentiable by what the design can change.

        Turned slots move all free units to where the structure rests, and so all ligaments.
        """
        space = self.space
        moved = None if space.turning else np.unique(self.lattice.unit[space.free_vertices])
        loads, contact = self.loads, self.structure.contact
        return topology(self.lattice, loads.held, contact, moved, loads.loaded)

    @cached_property
    def region_ligaments(self) -> Ints:
        """Ligaments that touch the region of interest."""
        touched = np.isin(self.lattice.ligament_units, self.objective.region)
        return np.flatnonzero(touched.any(axis=1))
