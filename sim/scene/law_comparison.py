"""A structure judged under either law of contact: what its loss and its overlaps depend on."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sim.core import Floats, Ints
from sim.scene.evaluation import objective, target_motion
from sim.scene.plan import concrete_parameters, make_plan
from sim.scene.scene import Scene
from sim.solvers import base
from sim.structure import clearance


class LawComparison(NamedTuple):
    """A structure under one law.

    Attributes:
        loss: (n_cases,).
        overlaps: (n_cases,) largest number of overlapping pairs of units at the loss's samples,
            counted by independent geometry.
        gap: (n_cases,) smallest distance of two units there, mm.
    """

    loss: Floats
    overlaps: Ints
    gap: Floats


def by_distance(scene: Scene, distance: float | None) -> Scene:
    """The scene, and its reference, with contact on the distance of units (mm), or on angles."""
    reference = scene.reference and by_distance(scene.reference, distance)
    return replace(scene, contact_distance=distance, reference=reference)


def judge(scene: Scene, vertices: Floats, threads: int = 1) -> LawComparison:
    """Loss, overlaps and gaps of the structure with these vertices (n_vertices, 2).

    Raises:
        SimulationError: it, or what it should mimic, cannot be simulated under the scene's law.
    """
    plan = make_plan(scene, vertices, threads=threads, every_case=True)
    values = concrete_parameters(scene, vertices)
    motion, _, _ = base.forward(plan.solver, values, scene.drives)
    target = None if scene.reference is None else target_motion(scene, threads)
    found = [clearance(scene.lattice, vertices, of_case) for of_case in motion]
    return LawComparison(
        np.asarray(objective(scene, target)(motion, values)),
        np.array([each.overlaps.max() for each in found]),
        np.array([each.gap.min() for each in found]),
    )
