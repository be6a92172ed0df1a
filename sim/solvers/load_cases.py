"""Solves a structure under several load cases side by side, forward and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import jax
import numpy as np

from sim.core import Floats, NewContactPairs
from sim.energy import Topology
from sim.solvers.prescribed_motion import PrescribedMotion
from sim.solvers.solver import Solver
from sim.solvers.validation import check_free_dofs, check_masses, check_parameters
from sim.structure import ConcreteParameters, Parameters

T = TypeVar("T")
R = TypeVar("R")


def solve_case(
    solver: Solver, values: ConcreteParameters, drive: PrescribedMotion
) -> tuple[Floats, Floats, Any]:
    """Solves one case: displacement and velocity (n_times, 3 n_units), and the solver's record.

    Raises:
        SimulationError: a step failed, or there is nothing meaningful to start from.
    """
    check_free_dofs(solver.topology)
    check_parameters(values, drive.motion)
    check_masses(values, at_rest=True)
    try:
        displacement, velocity, record = solver.forward(values, drive)
    except NewContactPairs as met:
        return solve_case(solver.coupling(met.pairs), values, drive)
    held = solver.topology.held
    displacement[:, held] = drive.values(held, solver.output_times)
    velocity[:, held] = drive.rates(held, solver.output_times)
    of_units = slice(3 * solver.topology.n_units)
    return displacement[:, of_units], velocity[:, of_units], record


@jax.tree_util.register_static
class Records:
    """Holds what the reverse sweeps of all cases need, opaque to JAX."""

    def __init__(
        self, values: ConcreteParameters, drives: Sequence[PrescribedMotion], records: list[Any]
    ) -> None:
        self.values = values
        self.drives = drives
        self.records = records


def concrete(parameters: Parameters[Any]) -> ConcreteParameters:
    """Converts parameters to arrays of NumPy, as the solvers take them.

    Raises:
        TypeError: JAX traces them.
    """
    check_untraced(parameters)
    return ConcreteParameters(*(np.asarray(part) for part in parameters))


def check_untraced(values: object) -> None:
    """Refuses a tree of values that JAX traces.

    Raises:
        TypeError: it does.
    """
    if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(values)):
        raise TypeError(
            "a simulation loops over concrete arrays and cannot be traced; call it outside jax.jit"
            " and jax.vmap, differentiate it once, and rows of a Jacobian one by one with jax.vjp"
        )


class Gradients(NamedTuple):
    """Holds loss derivatives that a reverse sweep returns."""

    parameters: ConcreteParameters  # summed over the cases
    # times, drive: of each case, the times and the derivatives by the held values there
    times: list[Floats]
    drive: list[Floats]


def solve_cases(
    solver: Solver,
    values: ConcreteParameters,
    drives: Sequence[PrescribedMotion],
    solvers: Sequence[Solver] | None = None,
) -> tuple[Floats, Floats, Records]:
    """Solves all cases: displacement and velocity (n_cases, n_times, n_units, 3), and records.

    With ``solvers`` (n_cases,) each case is solved by its own, otherwise alike.

    Raises:
        SimulationError: a step failed.
    """
    each = (
        _case_solver(one, solver.threads, len(drives)) for one in solvers or [solver] * len(drives)
    )
    jobs = list(zip(each, drives, strict=True))
    results = _map_cases(lambda job: solve_case(job[0], values, job[1]), jobs, solver.threads)
    shape = (len(drives), -1, solver.topology.n_units, 3)
    displacement = np.stack([u for u, _, _ in results]).reshape(shape)
    velocity = np.stack([v for _, v, _ in results]).reshape(shape)
    return displacement, velocity, Records(values, drives, [record for _, _, record in results])


def adjoint_cases(solver: Solver, records: Records, bar_u: Floats, bar_v: Floats) -> Gradients:
    """Sweeps back through ``solve_cases``, from loss derivatives shaped as its outputs."""
    flat_u, flat_v = (with_loads(solver.topology, bar) for bar in (bar_u, bar_v))
    alone = _case_solver(solver, solver.threads, len(flat_u))
    results = _map_cases(
        lambda case: _sweep_back(
            alone, records.values, records.records[case], flat_u[case], flat_v[case]
        ),
        range(len(flat_u)),
        solver.threads,
    )
    parts, times, drive = zip(*results, strict=True)
    summed = ConcreteParameters(*(np.asarray(sum(part)) for part in zip(*parts, strict=True)))
    return Gradients(summed, list(times), list(drive))


def _sweep_back(
    solver: Solver, values: ConcreteParameters, record: Any, bar_u: Floats, bar_v: Floats
) -> tuple[ConcreteParameters, Floats, Floats]:
    """Sweeps back through one case.

    The broad phase looks at other states than on the way forward, and may find pairs near that were
    not: their coupling gets room.
    """
    try:
        return solver.backward(values, record, bar_u, bar_v)
    except NewContactPairs as met:
        roomier = replace(record, topology=record.topology.coupling(met.pairs))
        return _sweep_back(solver, values, roomier, bar_u, bar_v)


def with_loads(topology: Topology, bar: Floats) -> Floats:
    """Appends zeros for the loads to derivatives by motions: (n_cases, n_times, n_dofs)."""
    flat = np.asarray(bar).reshape(len(bar), -1, 3 * topology.n_units)
    return np.pad(flat, ((0, 0), (0, 0), (0, 3 * len(topology.loaded))))


def _case_solver(solver: Any, threads: int, n_cases: int) -> Solver:
    """Returns a solver of one case of many, with the threads that are left to each."""
    return replace(solver, threads=max(1, threads // max(1, n_cases)))


def _map_cases(work: Callable[[T], R], items: Sequence[T], threads: int) -> list[R]:
    """Maps over cases on threads, in order; compiled loops run without the interpreter's lock."""
    if threads == 1 or len(items) == 1:
        return [work(item) for item in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, items))
