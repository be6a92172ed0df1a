"""A design problem posed: structure, drives, what counts and what may change."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from sim.core import Floats, Ints
from sim.energy import Topology, topology
from sim.solvers import MotionLaw, PrescribedMotion
from sim.structure import DesignSpace, Lattice, Material, Symmetry, design_space

Accuracy = Literal["draft", "default", "tight"]
Integrator = Literal["auto", "implicit", "explicit"]


@dataclass(frozen=True)
class Scene:
    """Everything that a simulation and its loss depend on but the design vector.

    Attributes:
        lattice: the initial structure.
        material: constants.
        barrier, cutoff: contact angles, rad.
        contact_distance: activation distance of contact on the distance of units, mm; None for
            contact on the void angles.
        clamped: (n,) ids (3 unit + dof) of dofs that rest.
        driven: (n,) units that follow the drive, all three dofs.
        motions: the drive of each load case.
        weights: (n_cases,) of the cases in the loss, sum 1.
        duration: s; the length of the load path in a static scene.
        frequency: highest frequency of the drive, Hz; None if it has none.
        static: whether inertia plays no part.
        cloak: units to redesign.
        region: units of interest.
        objective: what is compared with the target.
        samples: number of samples that the loss is integrated over.
        steps: number of equal load steps that it is taken at instead; the start is none of them.
        reference: the scene whose region should move alike, its units in the same order; None to
            compare with rest.
        frozen: units whose vertices stay, whoever shares them; None for the driven ones.
        symmetry: imposed on the design.
        sharpness: p of the weighted p-mean of the cases' losses that is minimised: 1 is their mean,
            a large one a smooth maximum.
        copies: (n_copies, n_groups, 2) shifts (mm) of imperfect copies over which the loss is then
            averaged; None for the structure alone.
        accuracy, integrator: as asked for.
    """

    lattice: Lattice
    material: Material
    barrier: float
    cutoff: float
    clamped: Ints
    driven: Ints
    motions: tuple[MotionLaw, ...]
    weights: Floats
    duration: float
    frequency: float | None
    static: bool
    cloak: Ints
    region: Ints
    objective: Literal["displacement", "strain_energy"] = "displacement"
    samples: int = 201
    steps: int | None = None
    reference: Scene | None = None
    contact_distance: float | None = None
    frozen: Ints | None = None
    symmetry: Symmetry = "none"
    sharpness: float = 1.0
    copies: Floats | None = None
    accuracy: Accuracy = "default"
    integrator: Integrator = "auto"

    @cached_property
    def space(self) -> DesignSpace:
        """Shifts of the cloak's vertices; those of frozen units stay."""
        frozen = self.driven if self.frozen is None else self.frozen
        return design_space(self.lattice, self.cloak, frozen, self.symmetry)

    def under(self, motions: tuple[MotionLaw, ...], duration: float, frequency: float) -> Scene:
        """The scene and its reference under other drives, weighted equally."""
        reference = self.reference
        return replace(
            self,
            motions=motions,
            weights=np.full(len(motions), 1 / len(motions)),
            duration=duration,
            frequency=frequency,
            reference=reference and reference.under(motions, duration, frequency),
        )

    @cached_property
    def drives(self) -> tuple[PrescribedMotion, ...]:
        """The cases as the solvers take them."""
        return tuple(PrescribedMotion(self.driven, motion) for motion in self.motions)

    @cached_property
    def held(self) -> Ints:
        """Ids of all prescribed dofs, ascending."""
        driven = (3 * self.driven[:, None] + np.arange(3)).ravel()
        return np.union1d(self.clamped, driven)

    @cached_property
    def topology(self) -> Topology:
        """The fixed structure; differentiable by what the design can change."""
        moved = np.unique(self.lattice.unit[self.space.free_vertices])
        distance = self.contact_distance
        return topology(self.lattice, self.held, self.barrier, self.cutoff, moved, distance)

    @cached_property
    def region_ligaments(self) -> Ints:
        """Ligaments that touch the region of interest."""
        return np.flatnonzero(np.isin(self.lattice.ligament_units, self.region).any(axis=1))
