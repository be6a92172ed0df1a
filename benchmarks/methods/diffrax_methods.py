"""diffrax as ladders: what one would write in JAX, with its adjoints; statics as slow dynamics."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from benchmarks.harness import Run, Sample, SettingLadder, Task
from benchmarks.methods.jax_baseline import RungeKutta, respond
from benchmarks.scenes import LoadCase, case
from sim.scene import Scene, parameters_of_design
from sim.solvers import LinearRamp, TanhRamp
from sim.structure import damping_of_ratio

SOLVERS = ("Tsit5", "Dopri5", "Kvaerno5")
DENSITY, RATIO, TOLERANCE = 1.0, 0.0186, 1e-8
"""Of pseudo-dynamics as the authors run them: tonne/mm^2, damping ratio, tolerance of a step."""


class DiffraxProblem(NamedTuple):
    """What diffrax solves: a scene in time, by which method, and the times of the samples."""

    scene: Scene
    method: RungeKutta
    times: Array


Pose = Callable[[LoadCase, Array], DiffraxProblem]
"""From a case and the value of a setting."""


def in_time(name: str, tolerances: tuple[float, ...]) -> tuple[SettingLadder, ...]:
    """Runge-Kutta methods with checkpointed adjoints, and one with a continuous adjoint."""
    rungs = tuple((f"{tolerance:g}", tolerance) for tolerance in tolerances)
    plain = tuple(
        SettingLadder(f"diffrax {solver}", partial(_prepare, name, _to_tolerance(solver)), rungs)
        for solver in SOLVERS
    )
    backsolve = partial(_prepare, name, _to_tolerance("Tsit5", "BacksolveAdjoint"))
    continuous = SettingLadder(
        "diffrax Tsit5, backsolve", backsolve, rungs[:2], tasks=("gradient",)
    )
    return (*plain, continuous)


def at_rest(name: str, durations: tuple[float, ...]) -> tuple[SettingLadder, ...]:
    """Pseudo-dynamics: a heavy, damped lattice pushed slowly, the longer the closer to rest."""
    rungs = tuple((f"{duration:g} s", duration) for duration in durations)
    return (SettingLadder("pseudo-dynamics, Dopri5", partial(_prepare, name, _slowly), rungs),)


def _to_tolerance(solver: str, adjoint: str = "RecursiveCheckpointAdjoint") -> Pose:
    return partial(_by_steps, solver, adjoint)


def _by_steps(solver: str, adjoint: str, posed: LoadCase, tolerance: Array) -> DiffraxProblem:
    method = RungeKutta(tolerance, tolerance, solver=solver, adjoint=adjoint)
    return DiffraxProblem(posed.scene, method, jnp.asarray(posed.times))


def _slowly(posed: LoadCase, duration: Any) -> DiffraxProblem:  # noqa: ANN401  (traced in place of a float)
    """The static scene as the authors move it; times at which their ramp passes the loads."""
    scene, (ramp,) = posed.scene, posed.scene.loads.motions
    assert isinstance(ramp, LinearRamp)
    constants = scene.structure.material
    shear, bending = (float(np.mean(each)) for each in (constants.shear, constants.bending))
    damping = damping_of_ratio(RATIO, DENSITY, scene.lattice.spacing, shear, bending)
    heavy = constants._replace(
        density=DENSITY, damping_translation=damping[0], damping_rotation=damping[1]
    )
    most = np.tanh(6.0)
    share = np.clip(2 * posed.times / ramp.duration - 1, -most, most)
    slow = scene.driven_by(
        TanhRamp(ramp.amplitude, duration, ramp.direction),
        material=heavy,
        duration=duration,
        static=False,
    )
    times = duration * (1 + jnp.asarray(np.arctanh(share)) / 6) / 2
    return DiffraxProblem(slow, RungeKutta(TOLERANCE, TOLERANCE), jnp.minimum(times, duration))


def _prepare(name: str, pose: Pose, value: float, task: Task) -> Run:
    posed = case(name)
    compiled = _compiled(name, pose, task)

    def run() -> Sample:
        found = _in_a_line(compiled, jnp.asarray(value))
        (loss, (motion, counts)), gradient = found if task == "gradient" else (found, None)
        work = {what: int(count) for what, count in counts.items()}
        return Sample(posed.results(loss, motion, gradient), work)

    return run


def _in_a_line(compiled: Callable[[Array], Any], value: Array) -> Any:  # noqa: ANN401
    """Calls it.

    Raises:
        ArithmeticError: diffrax gave up; the reason alone, out of pages of traceback.
    """
    try:
        found = compiled(value)
        jax.block_until_ready(found)  # type: ignore[no-untyped-call]
    except jax.errors.JaxRuntimeError as error:
        reason = re.search(r"EquinoxRuntimeError: (.*)", str(error))
        raise ArithmeticError(reason[1] if reason else str(error).splitlines()[0]) from error
    return found


@cache
def _compiled(name: str, pose: Pose, task: Task) -> Callable[[Array], Any]:
    case_ = case(name)

    def evaluate(design: Array, value: Array) -> tuple[Array, Any]:
        posed = pose(case_, value)
        values = parameters_of_design(posed.scene)(design)
        motion, counts = respond(
            posed.scene, posed.scene.loads.cases[0], posed.method, posed.times
        )(values)
        return case_.measure(motion[None], values)[0], (motion[None], counts)

    start = jnp.zeros(case_.scene.space.n_variables)
    made = jax.value_and_grad(evaluate, has_aux=True) if task == "gradient" else evaluate
    whole = jax.jit(made).lower(start, jnp.asarray(1.0)).compile()
    return partial(whole, start)
