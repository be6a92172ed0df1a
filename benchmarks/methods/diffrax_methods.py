"""Lists methods of diffrax: the law in JAX, with its adjoints; statics as slow dynamics."""

import re
from collections.abc import Callable
from functools import cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from benchmarks.harness import Method, Run, Sample, Task, settings_of
from benchmarks.methods.jax_baseline import RungeKutta, respond
from benchmarks.scenes import LoadCase, case
from sim.scene import Scene, parameters_of_design
from sim.solvers import LinearRamp, TanhRamp
from sim.structure import damping_of_ratio

SOLVERS = ("Tsit5", "Dopri5", "Kvaerno5")
DENSITY, RATIO, TOLERANCE = 1.0, 0.0186, 1e-8
"""Of pseudo-dynamics as the authors run them: tonne/mm^2, damping ratio, tolerance of a step."""


class DiffraxProblem(NamedTuple):
    """Poses a problem to diffrax: a scene in time, the method, and the times of the samples."""

    scene: Scene
    method: RungeKutta
    times: Array


Pose = Callable[[LoadCase, Array], DiffraxProblem]
"""From a case and the value of a setting."""


def in_time(name: str, tolerances: tuple[float, ...]) -> tuple[Method, ...]:
    """Lists Runge-Kutta methods with checkpointed adjoints, and one with a continuous adjoint."""
    settings, checkpoints = settings_of(tolerances), "RecursiveCheckpointAdjoint"
    poses = {solver: partial(_by_steps, solver, checkpoints) for solver in SOLVERS}
    runs = {f"diffrax {solver}": partial(_prepare, name, pose) for solver, pose in poses.items()}
    plain = (Method(method, run, settings, own=False) for method, run in runs.items())
    backsolve = partial(_prepare, name, partial(_by_steps, "Tsit5", "BacksolveAdjoint"))
    continuous = "diffrax Tsit5, backsolve"
    return (*plain, Method(continuous, backsolve, settings[:2], own=False, tasks=("gradient",)))


def at_rest(name: str, durations: tuple[float, ...]) -> tuple[Method, ...]:
    """Lists pseudo-dynamics: a heavy, damped lattice, pushed the longer the closer to rest."""
    settings = settings_of(durations, " s")
    prepare = partial(_prepare, name, _slowly)
    return (Method("pseudo-dynamics, Dopri5", prepare, settings, own=False),)


def _by_steps(solver: str, adjoint: str, posed: LoadCase, tolerance: Array) -> DiffraxProblem:
    method = RungeKutta(tolerance, tolerance, solver=solver, adjoint=adjoint)
    return DiffraxProblem(posed.scene, method, jnp.asarray(posed.times))


def _slowly(posed: LoadCase, duration: Any) -> DiffraxProblem:  # noqa: ANN401  (traced in place of a float)
    """Moves the static scene as the authors do; samples as their ramp passes the loads."""
    scene, (ramp,) = posed.scene, posed.scene.loads.motions
    assert isinstance(ramp, LinearRamp)
    constants = scene.structure.material
    shear, bending = (
        float(np.mean(each)) for each in (constants.shear_stiffness, constants.bending_stiffness)
    )
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
        found = _called(compiled, jnp.asarray(value))
        (loss, (motion, counts)), gradient = found if task == "gradient" else (found, None)
        work = {what: int(count) for what, count in counts.items()}
        return Sample(posed.results(loss, motion, gradient), work)

    return run


def _called(compiled: Callable[[Array], Any], value: Array) -> Any:  # noqa: ANN401
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
