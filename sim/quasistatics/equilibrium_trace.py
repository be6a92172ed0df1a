"""Traces the path of equilibria that a snap leaves, stable or not, up to where it ends."""

from typing import NamedTuple

import numpy as np

from sim.collision import raise_new_pairs
from sim.core import Floats, Ints, NewContactPairs
from sim.energy import Topology
from sim.quasistatics.arc_length import LONGEST, ArcLengthPath
from sim.quasistatics.path_ends import BRANCHING
from sim.quasistatics.static_solver import StaticRecord, StaticSolver
from sim.solvers import PrescribedMotion
from sim.structure import ConcreteParameters

OVERSHOOT = 1e-6
"""Share of its load by which a path may pass the snap that it turns at."""


class EquilibriumTrace(NamedTuple):
    """Holds points of a path, in the order in which it passes them."""

    loads: Floats  # (n_points,) load parameters
    states: Floats  # (n_points, n_dofs) equilibria, stable or not
    # (n_points,) smallest one of the tangent, with rotations times the scale, N/mm; of several
    # negative ones that nearest to zero
    eigenvalue: Floats
    n_negative: Ints  # (n_points,) number of negative eigenvalues

    @property
    def turns(self) -> Ints:
        """(n_turns,) numbers of the points at which the path turns back or forward again."""
        return np.asarray(1 + np.flatnonzero(np.diff(np.sign(np.diff(self.loads)))))


def trace(
    topology: Topology,
    values: ConcreteParameters,
    drive: PrescribedMotion,
    start: tuple[float, Floats],
    end: float,
    points: int = 200,
    longest: float = LONGEST,
) -> EquilibriumTrace:
    """Traces the path of equilibria through a stable one, from load parameter and state (n_dofs,).

    It goes forward from there, and ends where its load passes ``end``, falls below that of rest, or
    after so many ``points``; earlier where no step leads on, as in jammed contact. `longest` is the
    arc length of a step at most, mm.
    """
    try:
        return _trace(topology, values, drive, start, end, points, longest)
    except NewContactPairs as met:
        return trace(topology.coupling(met.pairs), values, drive, start, end, points, longest)


def trace_first_snap(
    solver: StaticSolver, values: ConcreteParameters, drive: PrescribedMotion, record: StaticRecord
) -> EquilibriumTrace | None:
    """Traces the path that the first snap of a solution leaves, from the last load before it.

    It ends where it comes by that snap's load again, or by that of the last one before the next
    load; where it branches, at the full load.

    Returns:
        the path; None without a snap, or with one at rest.
    """
    if not len(record.snaps) or record.snaps[0] <= 0.0:
        return None
    loads, top = solver.output_times, record.topology or solver.topology
    number = int(np.searchsorted(loads, record.snaps[0]))
    rest = 0.0, np.zeros(top.n_dofs)
    before = (float(loads[number - 1]), record.states[number - 1]) if number else rest
    limit_point = record.jumped[number] != BRANCHING
    near = record.snaps[record.snaps <= loads[number]]
    end = float(near[-1] * (1.0 + OVERSHOOT) if limit_point else loads[-1])
    found = trace(top, values, drive, before, end)
    kept = found.loads <= end
    return EquilibriumTrace(
        found.loads[kept], found.states[kept], found.eigenvalue[kept], found.n_negative[kept]
    )


def _trace(
    topology: Topology, values: ConcreteParameters, drive: PrescribedMotion,
    start: tuple[float, Floats], end: float, points: int, longest: float,
) -> EquilibriumTrace:  # fmt: skip
    path = ArcLengthPath(topology, values, drive)
    found = list(path.points(start, end, points, longest))
    eigenvalue, n_negative = zip(*map(path.stability, found), strict=True)
    raise_new_pairs(path.system.contacts)
    return EquilibriumTrace(
        np.array([one.load for one in found]),
        np.stack([one.state for one in found]),
        np.array(eigenvalue),
        np.array(n_negative),
    )
