"""Makes the motions of all load cases one differentiable function, for JAX."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero

from sim.core import Floats, Ints, Numbers
from sim.solvers.load_cases import (
    Records,
    adjoint_cases,
    check_untraced,
    concrete,
    solve_cases,
    with_loads,
)
from sim.solvers.loads import MotionLaw, held_selection, selected
from sim.solvers.prescribed_motion import PrescribedMotion, rates_of
from sim.solvers.solver import Solver
from sim.structure import Parameters


class CaseMotions(NamedTuple):
    """Holds the motion of all cases at the solver's output times."""

    displacement: Array  # (n_cases, n_times, n_units, 3) mm, mm, rad
    velocity: Array  # (n_cases, n_times, n_units, 3) mm/s, mm/s, rad/s


def with_full_adjoint(solver: Any) -> Any:
    """Makes the adjoint of a solver cover all ligaments."""
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
        return _motion(solver if designed else with_full_adjoint(solver), parameters, cases)
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
    return _solve_all(solver, parameters, cases)[0]


def _solve_all(
    solver: Solver, parameters: Parameters[Any], cases: tuple[PrescribedMotion, ...]
) -> tuple[CaseMotions, Records]:
    check_untraced(cases)
    displacement, velocity, records = solve_cases(solver, concrete(parameters), cases)
    return CaseMotions(jnp.asarray(displacement), jnp.asarray(velocity)), records


def _forward_rule(
    solver: Solver, parameters: Any, drives: Any
) -> tuple[CaseMotions, tuple[Records, bool]]:
    plain = jax.tree.map(lambda primal: primal.value, (parameters, drives), is_leaf=_is_primal)
    driven = any(leaf.perturbed for leaf in jax.tree.leaves(drives, is_leaf=_is_primal))
    response, records = _solve_all(solver, *plain)
    return response, (records, driven)


def _is_primal(node: Any) -> bool:
    return hasattr(node, "perturbed")


def _backward_rule(
    solver: Solver, residual: tuple[Records, bool], bar: CaseMotions
) -> tuple[Parameters[Array], Any]:
    records, driven = residual
    bar_u, bar_v = (_materialise(part) for part in bar)
    gradients = adjoint_cases(solver, records, bar_u, bar_v)
    total = Parameters(*(jnp.asarray(part) for part in gradients.parameters))
    if not driven:
        return total, jax.tree.map(_zero, records.drives)
    held = solver.topology.held
    held_u, held_v = (with_loads(solver.topology, part)[..., held] for part in (bar_u, bar_v))
    return total, tuple(
        _drive_cotangent(
            held,
            drive,
            (gradients.times[case], solver.output_times),
            (gradients.drive[case], held_u[case], held_v[case]),
        )
        for case, drive in enumerate(records.drives)
    )


_motion.defvjp(_forward_rule, _backward_rule, symbolic_zeros=True)


def _materialise(cotangent: Any) -> Floats:
    if isinstance(cotangent, SymbolicZero):
        return np.zeros(cotangent.shape)
    check_untraced(cotangent)
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
        values_and_rates = (law(within), law(outputs), rates_of(law, outputs))
        return tuple(selected(selection, each) for each in values_and_rates)

    _, pull_back = jax.vjp(prescribed, motion)
    return cast(MotionLaw, pull_back(bars)[0])
