"""What joins the units: a shim for each ligament, cut to the slots at its two ends."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from pipeline.fabrication.parts import Ligament, Shim, Unit
from pipeline.fabrication.units.unit_network import UnitNetwork
from pipeline.problem.sections import Fabrication
from sim.core import Floats


def ligaments(net: UnitNetwork, units: dict[int, Unit]) -> tuple[Ligament, ...]:
    """The ligaments between units (by id) as they are made."""
    made = []
    for number, (a, p), (b, q), along in net.ligaments:
        one, other = (
            next(slot for slot in units[unit].slots if slot.vertex == vertex)
            for unit, vertex in ((a, p), (b, q))
        )
        gap = float(np.linalg.norm(other.mouth - one.mouth))
        bend = _angle(-one.direction, along) + _angle(along, other.direction)
        pair = (net.labels[a], net.labels[b])
        length = round(gap + one.depth + other.depth, 4)
        free = gap + one.truncation + other.truncation
        made.append(Ligament(number, pair, length, free, bend))
    return tuple(made)


def _angle(first: Floats, second: Floats) -> float:
    cross = first[0] * second[1] - first[1] * second[0]
    return abs(float(np.arctan2(cross, first @ second)))


def shims(ligaments: Sequence[Ligament], wanted: Fabrication) -> tuple[Shim, ...]:
    """The pieces to cut, one kind for each length."""
    taken: dict[float, list[int]] = defaultdict(list)
    for ligament in ligaments:
        taken[ligament.length].append(ligament.number)
    return tuple(
        Shim(
            f"S{length:g}",
            length,
            wanted.thickness,
            tuple(taken[length]),
            max(1, math.ceil(wanted.shims.spares * len(taken[length]))),
        )
        for length in sorted(taken)
    )
