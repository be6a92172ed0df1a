"""Compares losses and overlaps under either law of contact, as variables of a response."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sim.core import SimulationError
from sim.scene import mimicking, simulate, target_motion
from sim.structure import clearance

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from pipeline.posing.case_result import CaseResult, PosedStructure, Times
    from pipeline.problem import Problem
    from sim.structure import ContactModel

LOG = logging.getLogger(__name__)

LAWS = ("angle", "geometric")
DIFFERENCE = 0.1
"""Relative difference of the losses under the two laws at which a design depends on the law."""
_DIMS = ("structure", "contact_law", "case")
_MEASURES = ("loss_by_contact", "overlaps_by_contact", "gap_by_contact", "snaps_by_contact")


def by_contact(
    structures: dict[str, PosedStructure],
    laws: dict[str, ContactModel],
    times: Times,
    measured: dict[str, list[CaseResult]],
) -> dict[str, tuple[Any, ...]]:
    """Compares loss, overlaps, smallest gap and snaps of static structures under either law.

    Under their own law they are as `measured`; under the other one they pass the same loads, all
    that are asked for. NaN in studies of motion in time, and where a structure cannot be simulated
    under the other law.
    """
    found = np.array(
        [
            [
                _as_measured(measured[name])
                if _is_own(structure, laws[law])
                else _under(name, structure, law, laws[law], times)
                for law in LAWS
            ]
            for name, structure in structures.items()
        ],
        dtype=float,
    )
    return {name: (_DIMS, found[:, :, k]) for k, name in enumerate(_MEASURES)}


def cloak_losses(response: xr.Dataset, weights: Sequence[float]) -> tuple[float, float]:
    """Reads the losses of a cloak by the angle law and with contact on distance; NaN if none.

    They are means over the load cases with these weights, which add up to 1.
    """
    losses = response["loss_by_contact"].sel(structure="cloaked")
    angle, distance = (float(np.dot(weights, losses.sel(contact_law=law).values)) for law in LAWS)
    return angle, distance


def under(asked: Problem, law: str) -> Problem:
    """Sets one of LAWS."""
    contact = asked.contact.model_copy(update={"law": law})
    return asked.model_copy(update={"contact": contact})


def _is_own(structure: PosedStructure, contact: ContactModel) -> bool:
    scene = structure.scene
    return scene.loads.static and type(scene.structure.contact) is type(contact)


def _as_measured(cases: list[CaseResult]) -> NDArray[np.float64]:
    """Collects losses, overlaps at most, smallest gaps and snaps (4, n_cases) of solved cases."""
    each = [(case.loss, case.overlapping.max(), case.gap.min(), len(case.snaps)) for case in cases]
    return np.array(each, dtype=float).T


def _under(
    name: str, structure: PosedStructure, law: str, contact: ContactModel, times: Times
) -> NDArray[np.float64]:
    """Simulates losses, overlaps at most, smallest gaps and snaps (4, n_cases) under a law."""
    nothing = np.full((len(_MEASURES), len(structure.scene.loads.cases)), np.nan)
    if not structure.scene.loads.static:
        return nothing
    scene, vertices = structure.scene.with_contact(contact), structure.vertices
    try:
        response = simulate(scene, vertices=vertices, times=times.asked)
        target = None if scene.objective.reference is None else target_motion(scene)
    except SimulationError as error:
        LOG.warning("%s structure under %s contact: %s", name, law, error)
        return nothing
    motion = response.displacement[:, times.shown]
    found = [clearance(scene.lattice, vertices, each) for each in motion]
    at_loss = response.displacement[:, times.integrated]
    return np.array(
        [
            mimicking(scene, target)(at_loss, response.parameters),
            [each.overlaps.max() for each in found],
            [each.gap.min() for each in found],
            [len(record.snaps) for record in response.records],
        ]
    )
