"""Controls steps for slow drives: finds a grid that meets a tolerance, to be frozen then."""

from dataclasses import replace

import numpy as np

from sim.collision import raise_new_pairs
from sim.core import Floats, NewContactPairs, SimulationError
from sim.energy import system_of, workspace
from sim.solvers import PrescribedMotion
from sim.structure import ConcreteParameters
from sim.time_integration import time_grid
from sim.time_integration.esdirk import march
from sim.time_integration.esdirk_stage import CONVERGED
from sim.time_integration.implicit import ImplicitSolver

SAFETY, SHRINK, GROW = 0.85, 0.2, 3.0
NO_STOPS = np.zeros(0)


def adapted(
    solver: ImplicitSolver,
    values: ConcreteParameters,
    drive: PrescribedMotion,
    tolerance: float,
    first: float = 1e-4,
    largest: float = np.inf,
    stops: Floats = NO_STOPS,
    most: float = np.inf,
) -> ImplicitSolver:
    """Adapts the grid until every step's error estimate stays below ``tolerance``, mm.

    The estimate is the difference of the displacement to the embedded method of order 2, as the
    root mean square over the free dofs (rotations times the topology's rotation scale), mm. Nothing
    but the ends is kept of the solver's grid; the `first` step to try and the `largest` are in s;
    steps end at `stops` (n,), ascending within the grid, s, but at one of those that lie near each
    other; `most` bounds their number.

    Raises:
        SimulationError: the step became too short to go on, or there are too many.
    """
    try:
        return _adapted(solver, values, drive, tolerance, first, largest, stops, most)
    except NewContactPairs as met:
        known = solver.coupling(met.pairs)
        return adapted(known, values, drive, tolerance, first, largest, stops, most)


def _adapted(
    solver: ImplicitSolver,
    values: ConcreteParameters,
    drive: PrescribedMotion,
    tolerance: float,
    first: float,
    largest: float,
    stops: Floats,
    most: float,
) -> ImplicitSolver:
    end = float(solver.times[-1])
    ends = time_grid.insert_times(np.array([0.0, end]), stops)[1:]
    times, state = [0.0], (np.zeros(solver.topology.n_dofs), np.zeros(solver.topology.n_dofs))
    step = min(first, end)
    while times[-1] < end * (1 - 1e-12):
        step, left = min(step, largest), ends[np.searchsorted(ends, times[-1], "right")] - times[-1]
        step = left if step >= left else min(step, left / 2)
        reached, error = _attempt(solver, values, drive, times[-1], step, state)
        accepted = reached is not None and error <= tolerance
        if reached is not None and accepted:
            times.append(times[-1] + step)
            state = reached
        if len(times) > most:
            raise SimulationError(
                f"the step control has taken {len(times) - 1} steps by t = {times[-1]:.6g} s;"
                " try integrator: explicit, or a looser accuracy"
            )
        if step < 1e-9 * end and not accepted:
            raise SimulationError(
                f"the step control stalled at t = {times[-1]:.6g} s;"
                " loosen the tolerance or smooth the drive",
                step=len(times) - 1,
            )
        change = SHRINK if reached is None else SAFETY * (tolerance / max(error, 1e-300)) ** (1 / 3)
        step *= min(GROW, max(SHRINK, change))
    times[-1] = end
    return replace(solver, times=np.array(times))


def _attempt(
    solver: ImplicitSolver,
    values: ConcreteParameters,
    drive: PrescribedMotion,
    start: float,
    step: float,
    state: tuple[Floats, Floats],
) -> tuple[tuple[Floats, Floats] | None, float]:
    """Returns a step's end and error estimate, or None if Newton's method failed."""
    top, tableau = solver.topology, solver.tableau
    times = np.array([start, start + step])
    u, v, a = (np.zeros((2, len(tableau.nodes), top.n_dofs)) for _ in range(3))
    u[0, 0], v[0, 0] = state
    held = drive.values(top.held, time_grid.stage_times(times, tableau.nodes))
    system, counts = system_of(top, values), np.zeros(3, dtype=np.int64)
    status, _, _ = march(
        times, 0, held, system, workspace(system), tableau.stages, tableau.nodes, solver.tolerance,
        u, v, a, counts,
    )  # fmt: skip
    raise_new_pairs(system.contacts)
    if status != CONVERGED:
        return None, np.inf
    difference = step * (tableau.error @ v[0]) * top.scale
    error = float(np.sqrt(np.mean(difference[top.free_dofs] ** 2)))
    return (u[1, 0].copy(), v[1, 0].copy()), error
