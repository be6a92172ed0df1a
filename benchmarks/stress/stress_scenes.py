"""Poses stress cases: lattices of the paper's constants under any drive."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from benchmarks.scenes import BARRIER, BIAS, CUTOFF, LIGAMENT, MATERIAL, SPACING
from benchmarks.stress.reference_energy import ReferenceStructure
from sim.core import Floats, Ints
from sim.energy import Topology
from sim.scene import (
    Clamp,
    Design,
    Loads,
    Objective,
    Scene,
    Structure,
    concrete_parameters,
    make_plan,
)
from sim.solvers import LinearRamp, MotionLaw, PrescribedMotion, Solver
from sim.structure import (
    ConcreteParameters,
    ContactModel,
    DistanceContact,
    Lattice,
    VoidAngleContact,
    quads,
)

DISTANCE = LIGAMENT / 12
"""Activation distance of contact between units, mm."""
LAWS: dict[str, ContactModel] = {
    "angles": VoidAngleContact(BARRIER, CUTOFF),
    "distances": DistanceContact(DISTANCE),
}
NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class StressScene:
    """Poses a structure under one drive."""

    scene: Scene  # with a single load case
    vertices: Floats  # (n_vertices, 2) of the structure, mm

    @property
    def topology(self) -> Topology:
        """Returns the scene's topology."""
        return self.scene.topology

    @property
    def drive(self) -> PrescribedMotion:
        """Returns the drive of its load case."""
        return self.scene.loads.cases[0]

    @cached_property
    def values(self) -> ConcreteParameters:
        """Returns the parameters of the structure."""
        return concrete_parameters(self.scene, self.vertices)

    @property
    def structure(self) -> ReferenceStructure:
        """Returns the structure as the definition takes it."""
        posed = self.scene.structure
        return ReferenceStructure(posed.lattice, self.vertices, self.values, posed.contact)

    def solver(self, asked: Floats) -> Solver:
        """Returns the solver that the plan chooses for output at these times."""
        return make_plan(self.scene, self.vertices, asked, every_case=True).solver

    def with_material(self, **constants: Any) -> "StressScene":  # noqa: ANN401  (numbers or arrays)
        """Changes constants of the material."""
        material = self.scene.structure.material._replace(**constants)
        return replace(self, scene=self.scene.updated(material=material))


def squares(columns: int, rows: int | None = None, bias: float = BIAS) -> Lattice:
    """Makes the paper's lattice, its squares turned by ``bias`` (deg)."""
    return quads(columns, rows or columns, SPACING, LIGAMENT, np.deg2rad(bias))


def posed(
    lattice: Lattice,
    clamped: Sequence[int] | Ints,
    driven: Sequence[int] | Ints,
    motion: MotionLaw,
    **more: Any,  # noqa: ANN401
) -> StressScene:
    """Clamps and drives units, in time unless the scene is said to be static; it lasts 1 s."""
    every = np.arange(lattice.n_units)
    scene = Scene(
        Structure(lattice, MATERIAL, LAWS["angles"]),
        Loads(
            (PrescribedMotion(np.asarray(driven, dtype=np.int64), motion),),
            (Clamp(np.asarray(clamped, dtype=np.int64)),),
        ),
        Objective(region=every),
        Design(cloak=every),
    )
    return StressScene(scene.updated(**more), lattice.vertices)


def pressed(lattice: Lattice, share: float, **more: Any) -> StressScene:  # noqa: ANN401
    """Presses between plates, the left one clamped, the right pushed in by a share of the width."""
    left = np.flatnonzero(lattice.index[:, 0] == lattice.index[:, 0].min())
    right = np.flatnonzero(lattice.index[:, 0] == lattice.index[:, 0].max())
    depth = share * (1 + np.ptp(lattice.index[:, 0])) * lattice.spacing
    return posed(lattice, left, right, LinearRamp(-depth, 1.0), static=True, **more)


def shaken(lattice: Lattice, motion: MotionLaw, **more: Any) -> StressScene:  # noqa: ANN401
    """Shakes the middle unit of a lattice that is clamped at its four corners."""
    columns, rows = np.ptp(lattice.index, axis=0) + 1
    corners = np.array([0, columns - 1, columns * (rows - 1), columns * rows - 1])
    middle = columns * (rows // 2) + columns // 2
    return posed(lattice, corners, np.array([middle]), motion, **more)
