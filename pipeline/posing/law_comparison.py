"""Losses and overlaps of structures under either law of contact, as variables of a response."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sim.core import SimulationError
from sim.scene import by_distance, judge

if TYPE_CHECKING:
    import xarray as xr

    from pipeline.posing.case_result import PosedStructure
    from pipeline.problem import Problem
    from sim.scene import LawComparison

LOG = logging.getLogger(__name__)

LAWS = ("angle", "geometric")
DIFFERENCE = 0.1
"""Relative difference of the losses under the two laws at which a design depends on the law."""
_DIMS = ("structure", "contact_law", "case")
_MEASURES = {"loss_by_contact": "loss", "overlaps_by_contact": "overlaps", "gap_by_contact": "gap"}


def by_contact(
    structures: dict[str, PosedStructure], distance: float
) -> dict[str, tuple[Any, ...]]:
    """Loss, overlaps and smallest gap of static structures under either law.

    NaN in studies of motion in time, and where a structure cannot be simulated under a law.

    Args:
        structures: by name.
        distance: activation distance of geometric contact, mm.
    """
    judged = [
        [_judge(name, structure, law, distance) for law in LAWS]
        for name, structure in structures.items()
    ]
    n_cases = len(next(iter(structures.values())).scene.motions)

    def gather(field: str) -> NDArray[np.float64]:
        return np.array(
            [[_part(one, field, n_cases) for one in of_laws] for of_laws in judged], dtype=float
        )

    return {name: (_DIMS, gather(field)) for name, field in _MEASURES.items()}


def cloak_losses(response: xr.Dataset) -> tuple[float, float]:
    """Losses of a response's cloak by the angle law and with contact on distance; NaN if none."""
    losses = response["loss_by_contact"].sel(structure="cloaked").mean("case")
    angle, distance = (float(losses.sel(contact_law=law)) for law in LAWS)
    return angle, distance


def geometric(asked: Problem) -> Problem:
    """The problem with contact on the distance of units."""
    contact = asked.contact.model_copy(update={"law": "geometric"})
    return asked.model_copy(update={"contact": contact})


def _part(judgement: LawComparison | None, field: str, n_cases: int) -> NDArray[np.float64]:
    return np.full(n_cases, np.nan) if judgement is None else getattr(judgement, field)


def _judge(name: str, structure: PosedStructure, law: str, distance: float) -> LawComparison | None:

    if not structure.scene.static:
        return None
    scene = by_distance(structure.scene, distance if law == "geometric" else None)
    try:
        return judge(scene, structure.vertices)
    except SimulationError as error:
        LOG.warning("%s structure under %s contact: %s", name, law, error)
        return None
