"""Integrates a structure under several load cases, as one differentiable function.

The solvers behind it are ``StaticSolver`` (equilibria), ``ImplicitSolver`` (slow drives) and
``ExplicitSolver`` (waves, tight tolerances).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, Protocol, TypeVar, cast

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero

from sim.core import Floats, Ints, NewContactPairs, Numbers
from sim.energy import Topology
from sim.solvers.loads import FORCE, MotionLaw, held_selection, held_values, loaded_units, selected
from sim.solvers.validation import check_free_dofs, check_masses, check_parameters
from sim.structure import ConcreteParameters, Parameters

T = TypeVar("T")
R = TypeVar("R")


class CaseMotions(NamedTuple):
    """Holds the motion of all cases at the solver's output times."""

    displacement: Array  # (n_cases, n_times, n_units, 3) mm, mm, rad
    velocity: Array  # (n_cases, n_times, n_units, 3) mm/s, mm/s, rad/s


class PrescribedMotion(NamedTuple):
    """Prescribes the motion of units, or the forces on them; all other held dofs rest.

    Attributes:
        units: (n,) ids.
        motion: of them, mm, mm, rad; N, N, N mm where it is a force.
        control: (n, 3) whether each component is a DISPLACEMENT, a FORCE, or the dof is FREE; by
            default all dofs are displaced.
    """

    units: Ints
    motion: MotionLaw
    control: Ints | None = None

    @property
    def loaded(self) -> Ints:
        """(n_loaded,) units under a force, ascending."""
        return self.units[:0] if self.control is None else loaded_units(self.units, self.control)

    def forces(self, times: Floats) -> Floats:
        """Forces (n_times, n, 3) that it puts on its units, N and N mm; zero where it puts none."""
        shape = (len(times), len(self.units), 3)
        if self.control is None:
            return np.zeros(shape)
        each = np.broadcast_to(self._at(times).reshape(len(times), -1, 3), shape)
        return np.where(self.control == FORCE, each, 0.0)

    def values(self, held: Ints, times: Floats) -> Floats:
        """Values (n_times, n_held) of the held dofs."""
        return np.asarray(held_values(held, self.units, self._at(times), self.control))

    def _at(self, times: Floats) -> Floats:
        """Computes the motion in NumPy, whichever arrays its numbers are."""
        plain = jax.tree.map(
            lambda leaf: np.asarray(leaf) if isinstance(leaf, Array) else leaf, self.motion
        )
        return np.asarray(plain(times))

    def start(self, topology: Topology, time: float) -> Floats:
        """State (n_dofs,) in which a motion from rest begins: the held dofs are in place."""
        state = np.zeros(topology.n_dofs)
        state[topology.held] = self.values(topology.held, np.array([time]))[0]
        return state

    def rates(self, held: Ints, times: Floats) -> Floats:
        """Their rates of change, per s."""
        # of a length that is a power of 2: JAX compiles for every new one
        padded = np.pad(times, (0, (1 << (len(times) - 1).bit_length()) - len(times)), mode="edge")
        rates = np.asarray(_rates(self.motion, padded))[: len(times)]
        return np.asarray(held_values(held, self.units, rates, self.control))


@jax.jit
def _rates(motion: MotionLaw, times: Array) -> Numbers:
    return jax.jvp(motion, (times,), (jnp.ones_like(times),))[1]


class Solver(Protocol):
    """Integrates one case in time, forward and back."""

    @property
    def topology(self) -> Topology:
        """The structure."""
        ...

    @property
    def output_times(self) -> Floats:
        """Times (n_times,) of the output, s."""
        ...

    @property
    def threads(self) -> int:
        """Cases solved side by side."""
        ...

    def refined(self, record: Any) -> Solver:
        """Returns one with half the steps that a record was made with, to estimate its error by."""
        ...

    def coupling(self, pairs: Ints) -> Solver:
        """Returns one with room in the tangent for contact of more pairs (n, 2) of units."""
        ...

    def forward(
        self, values: ConcreteParameters, drive: PrescribedMotion
    ) -> tuple[Floats, Floats, Any]:
        """Displacement and velocity (n_times, n_dofs), and what ``backward`` needs.

        The held dofs' own entries are of no account: they follow from the drive.

        Raises:
            SimulationError: a step failed.
            NewContactPairs: units met whose coupling the tangent has no room for.
        """
        ...

    def backward(
        self, values: ConcreteParameters, record: Any, bar_u: Floats, bar_v: Floats
    ) -> tuple[ConcreteParameters, Floats, Floats]:
        """Loss derivatives by the parameters, and by the drive at the times also returned.

        Raises:
            NewContactPairs: units are near whose coupling the record's topology has no room for.
        """
        ...


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
    _check_untraced(parameters)
    return ConcreteParameters(*(np.asarray(part) for part in parameters))


def _check_untraced(values: object) -> None:
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
    jobs = list(zip(solvers or [solver] * len(drives), drives, strict=True))
    results = _spread(lambda job: solve_case(job[0], values, job[1]), jobs, solver.threads)
    shape = (len(drives), -1, solver.topology.n_units, 3)
    displacement = np.stack([u for u, _, _ in results]).reshape(shape)
    velocity = np.stack([v for _, v, _ in results]).reshape(shape)
    return displacement, velocity, Records(values, drives, [record for _, _, record in results])


def adjoint_cases(solver: Solver, records: Records, bar_u: Floats, bar_v: Floats) -> Gradients:
    """Sweeps back through ``solve_cases``, from loss derivatives shaped as its outputs."""
    # copies, as jax's arrays are read only: loops would be compiled once more for these
    flat_u, flat_v = (_with_loads(solver.topology, bar) for bar in (bar_u, bar_v))
    results = _spread(
        lambda case: _sweep_back(
            solver, records.values, records.records[case], flat_u[case], flat_v[case]
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


def _with_loads(topology: Topology, bar: Floats) -> Floats:
    """Appends zeros for the loads to derivatives by motions: (n_cases, n_times, n_dofs)."""
    flat = np.asarray(bar).reshape(len(bar), -1, 3 * topology.n_units)
    return np.pad(flat, ((0, 0), (0, 0), (0, 3 * len(topology.loaded))))


def everywhere(solver: Any) -> Any:
    """Returns a solver whose adjoint skips no ligament."""
    top = solver.topology
    every = np.arange(len(top.ligament_units))
    if len(top.designed) == len(every):
        return solver
    return replace(solver, topology=replace(top, designed=every))


def differentiable_motion(
    solver: Solver,
    parameters: Parameters[Any],
    cases: tuple[PrescribedMotion, ...],
    *,
    designed: bool = False,
) -> CaseMotions:
    """Integrates every case; differentiable by the parameters and the numbers of the motions.

    ``jax.grad`` and ``jax.vjp`` run the exact adjoint of the steps taken. Under ``jax.jit`` and
    ``jax.vmap`` (and so ``jax.jacrev``) it cannot run: the solvers loop over concrete arrays. There
    are no forward or second derivatives.

    Args:
        solver: of each case.
        parameters: of the structure.
        cases: what drives it.
        designed: whether the parameters are those of a design vector alone: derivatives by
            ligaments that the design does not change are then skipped, and read zero.

    Raises:
        SimulationError: a step failed even after it was cut; the error names it.
        TypeError: a transform that is not supported.
    """
    try:
        return _motion(solver if designed else everywhere(solver), parameters, cases)
    except TypeError as error:
        if "jvp" not in str(error):
            raise
        raise TypeError(
            "a simulation has no forward derivative (jax.jvp, jacfwd, hessian); use jax.grad"
            " or jax.vjp"
        ) from error


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def _motion(
    solver: Solver, parameters: Parameters[Any], cases: tuple[PrescribedMotion, ...]
) -> CaseMotions:
    return _solved(solver, parameters, cases)[0]


def _solved(
    solver: Solver, parameters: Parameters[Any], cases: tuple[PrescribedMotion, ...]
) -> tuple[CaseMotions, Records]:
    _check_untraced(cases)
    displacement, velocity, records = solve_cases(solver, concrete(parameters), cases)
    return CaseMotions(jnp.asarray(displacement), jnp.asarray(velocity)), records


def _forward_rule(
    solver: Solver, parameters: Any, drives: Any
) -> tuple[CaseMotions, tuple[Records, bool]]:
    plain = jax.tree.map(lambda primal: primal.value, (parameters, drives), is_leaf=_is_primal)
    driven = any(leaf.perturbed for leaf in jax.tree.leaves(drives, is_leaf=_is_primal))
    response, records = _solved(solver, *plain)
    return response, (records, driven)


def _is_primal(node: Any) -> bool:
    return hasattr(node, "perturbed")


def _backward_rule(
    solver: Solver, residual: tuple[Records, bool], bar: CaseMotions
) -> tuple[Parameters[Array], Any]:
    records, driven = residual
    bar_u, bar_v = (_dense(part) for part in bar)
    pulled = adjoint_cases(solver, records, bar_u, bar_v)
    total = Parameters(*(jnp.asarray(part) for part in pulled.parameters))
    if not driven:
        return total, jax.tree.map(_zero, records.drives)
    held = solver.topology.held
    held_u, held_v = (_with_loads(solver.topology, part)[..., held] for part in (bar_u, bar_v))
    return total, tuple(
        _drive_cotangent(
            held,
            drive,
            (pulled.times[case], solver.output_times),
            (pulled.drive[case], held_u[case], held_v[case]),
        )
        for case, drive in enumerate(records.drives)
    )


_motion.defvjp(_forward_rule, _backward_rule, symbolic_zeros=True)


def _dense(cotangent: Any) -> Floats:
    if isinstance(cotangent, SymbolicZero):
        return np.zeros(cotangent.shape)
    _check_untraced(cotangent)
    return np.asarray(cotangent)


def _zero(leaf: Any) -> Any:
    array = np.asarray(leaf)
    return np.zeros(
        array.shape, jnp.asarray(array).dtype if array.dtype.kind == "f" else jax.dtypes.float0
    )


def _drive_cotangent(
    held: Ints,
    drive: PrescribedMotion,
    times: tuple[Floats, Floats],
    bars: tuple[Floats, Floats, Floats],
) -> PrescribedMotion:
    """Pulls derivatives back to the drive's own numbers.

    `times` are those of the solver's stages and of the output, `bars` derivatives by the held
    values at both, and by their rates at the output.
    """
    control = drive.control
    selection = held_selection(held, np.asarray(drive.units), control)
    return PrescribedMotion(
        _zero(drive.units),
        _pull_back(drive.motion, times, selection, bars),
        None if control is None else _zero(control),
    )


@jax.jit
def _pull_back(
    motion: MotionLaw,
    times: tuple[Array, Array],
    selection: Array,
    bars: tuple[Array, Array, Array],
) -> MotionLaw:
    """Pulls derivatives back to a law; compiled once for a kind of drive, eager at every call."""
    within, outputs = times

    def prescribed(law: MotionLaw) -> tuple[Numbers, ...]:
        followed = (law(within), law(outputs), _rates(law, outputs))
        return tuple(selected(selection, each) for each in followed)

    _, pull_back = jax.vjp(prescribed, motion)
    return cast(MotionLaw, pull_back(bars)[0])


def _spread(work: Callable[[T], R], items: Sequence[T], threads: int) -> list[R]:
    """Maps over cases on threads, in order; compiled loops run without the interpreter's lock."""
    if threads == 1 or len(items) == 1:
        return [work(item) for item in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, items))
