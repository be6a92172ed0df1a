"""Simulated motion of a structure under several drives, as one differentiable function.

    motion = simulate(solver, parameters, drives)

is the displacement and velocity of every case at the asked times; ``jax.grad`` through it runs the
exact adjoint of the steps taken. The solvers are ``ImplicitSolver`` (slow drives) and
``explicit.ExplicitSolver`` (waves, tight tolerances).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero

from sim.arrays import Floats, Ints
from sim.kernels import Sensitivity
from sim.loads import Motion, held_values
from sim.model import Parameters, Topology, Values

T = TypeVar("T")
R = TypeVar("R")


class Response(NamedTuple):
    """Motion of all cases at the asked times.

    Attributes:
        displacement: (n_cases, n_asked, n_units, 3) mm, mm, rad.
        velocity: (n_cases, n_asked, n_units, 3) mm/s, mm/s, rad/s.
    """

    displacement: Array
    velocity: Array


class Drive(NamedTuple):
    """A motion and the units that follow it; all other held dofs rest."""

    units: Ints
    motion: Motion

    def values(self, held: Ints, times: Floats) -> Array:
        """Values (n_times, n_held) of the held dofs."""
        return held_values(held, self.units, self.motion, times)


class Solver(Protocol):
    """One way to integrate one case in time, forward and back."""

    @property
    def topology(self) -> Topology:
        """The structure."""
        ...

    @property
    def threads(self) -> int:
        """Cases solved side by side."""
        ...

    def refined(self) -> Solver:
        """A more accurate one of the same kind, to estimate the error by."""
        ...

    def forward(self, values: Values, drive: Drive) -> tuple[Floats, Floats, Any]:
        """Displacement and velocity (n_asked, n_dofs), and what ``backward`` needs.

        Raises:
            SimulationError: a step failed.
        """
        ...

    def backward(
        self, values: Values, record: Any, bar_u: Floats, bar_v: Floats
    ) -> tuple[Values, Floats, Floats]:
        """Loss derivatives by the parameters, and by the drive at the times also returned."""
        ...


@jax.tree_util.register_static
class _Records:
    """The solver's records of all cases, opaque to JAX."""

    def __init__(self, values: Values, drives: Sequence[Drive], records: list[Any]) -> None:
        self.values = values
        self.drives = drives
        self.records = records


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def simulate(solver: Solver, parameters: Parameters[Any], drives: tuple[Drive, ...]) -> Response:
    """Integrates every case and returns its motion at the solver's asked times.

    Not for use under ``jit``: the solvers run compiled code of their own on concrete arrays.

    Raises:
        SimulationError: a step failed even after it was cut; the error names it.
    """
    return _forward(solver, parameters, drives)[0]


def _forward(
    solver: Solver, parameters: Parameters[Any], drives: tuple[Drive, ...]
) -> tuple[Response, _Records]:
    values = Values(*(np.asarray(part) for part in parameters))
    results = _spread(lambda drive: solver.forward(values, drive), drives, solver.threads)
    shape = (len(drives), -1, solver.topology.n_units, 3)
    response = Response(
        jnp.asarray(np.stack([u for u, _, _ in results]).reshape(shape)),
        jnp.asarray(np.stack([v for _, v, _ in results]).reshape(shape)),
    )
    return response, _Records(values, drives, [record for _, _, record in results])


def _forward_rule(
    solver: Solver, parameters: Any, drives: Any
) -> tuple[Response, tuple[_Records, bool]]:
    plain = jax.tree.map(lambda primal: primal.value, (parameters, drives), is_leaf=_is_primal)
    driven = any(leaf.perturbed for leaf in jax.tree.leaves(drives, is_leaf=_is_primal))
    response, records = _forward(solver, *plain)
    return response, (records, driven)


def _is_primal(node: Any) -> bool:
    return hasattr(node, "perturbed")


def _backward_rule(
    solver: Solver, residual: tuple[_Records, bool], bar: Response
) -> tuple[Parameters[Array], Any]:
    records, driven = residual
    n_dofs = solver.topology.n_dofs
    bar_u, bar_v = (_dense(cotangent).reshape(len(records.drives), -1, n_dofs) for cotangent in bar)
    results = _spread(
        lambda case: solver.backward(
            records.values, records.records[case], bar_u[case], bar_v[case]
        ),
        range(len(records.drives)),
        solver.threads,
    )
    total = Parameters(
        *(jnp.asarray(sum(parts)) for parts in zip(*(r[0] for r in results), strict=True))
    )
    if not driven:
        return total, jax.tree.map(_zero, records.drives)
    return total, tuple(
        _drive_cotangent(solver.topology.held, drive, times, bar_drive)
        for drive, (_, times, bar_drive) in zip(records.drives, results, strict=True)
    )


simulate.defvjp(_forward_rule, _backward_rule, symbolic_zeros=True)


def _dense(cotangent: Any) -> Floats:
    if isinstance(cotangent, SymbolicZero):
        return np.zeros(cotangent.shape)
    return np.asarray(cotangent)


def _zero(leaf: Any) -> Any:
    array = np.asarray(leaf)
    return np.zeros(
        array.shape, jnp.asarray(array).dtype if array.dtype.kind == "f" else jax.dtypes.float0
    )


def _drive_cotangent(held: Ints, drive: Drive, times: Floats, bar: Floats) -> Drive:
    """Pulls derivatives by the held values back to the drive's own numbers."""
    _, pull_back = jax.vjp(
        lambda motion: held_values(held, np.asarray(drive.units), motion, times), drive.motion
    )
    return Drive(_zero(drive.units), pull_back(jnp.asarray(bar))[0])


def _spread(work: Callable[[T], R], items: Sequence[T], threads: int) -> list[R]:
    """Maps over cases on threads, in order; compiled loops run without the interpreter's lock."""
    if threads == 1 or len(items) == 1:
        return [work(item) for item in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, items))


def empty_sensitivity(values: Values) -> Sensitivity:
    """Zeros to add parameter derivatives to."""
    return Sensitivity(
        arm=np.zeros(values.arm.shape),
        vector=np.zeros(values.vector.shape),
        void=np.zeros(values.void.shape),
        law=np.zeros(values.law.shape),
        contact=np.zeros(values.contact.shape),
    )


def as_parameters(sensitivity: Sensitivity, mass: Floats, damping: Floats) -> Values:
    """Gathers the derivatives by all parameters."""
    return Values(*sensitivity, mass=mass.reshape(-1, 3), damping=damping.reshape(-1, 3))
