"""Loss and gradient of a design: what the optimisers see."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Floats, Ints
from sim.quasistatics import StaticRecord, StaticSolver
from sim.scene.objectives import (
    DisplacementMimicking,
    RelativeMimicking,
    StrainEnergyMimicking,
    combined,
    extent,
)
from sim.scene.plan import Plan, concrete_parameters, make_plan
from sim.scene.scene import Scene
from sim.solvers import PrescribedMotion, Solver, base, simulate
from sim.structure import ConcreteParameters, Parameters, parameters, shape
from sim.time_integration import simpson_weights

Objective = DisplacementMimicking | RelativeMimicking | StrainEnergyMimicking


def objective(
    scene: Scene, target: Floats | None = None, weights: Floats | None = None
) -> Objective:
    """The scene's loss.

    On samples it is the mean over the duration, by Simpson's rule; on load steps an energy is
    averaged. A motion to mimic gives a relative error: on samples the root of the mean square over
    the target's greatest size, on load steps the root of the sum of squares over its size at the
    last step (the authors' measure).

    Args:
        scene: the scene.
        target: (n_cases, n_asked, n_region, 3) what ``target_motion`` returned; it is simulated
            anew if a scene with a reference comes without.
        weights: (n_asked,) of other samples than the scene's own.
    """
    lattice, given = scene.lattice, _weights(scene) if weights is None else weights
    if scene.objective == "strain_energy":
        ligaments = scene.region_ligaments
        return StrainEnergyMimicking(ligaments, lattice.ligament_units[ligaments], given)
    if scene.reference is None:
        return DisplacementMimicking(scene.region, lattice.spacing, given)
    aim = target_motion(scene) if target is None else target
    size = extent(aim, lattice.spacing)
    whole = size.max(axis=1) if scene.steps is None else size[:, -1] / np.sqrt(scene.steps)
    return RelativeMimicking(scene.region, lattice.spacing, given, aim, whole)


def _weights(scene: Scene) -> Floats:
    if scene.steps is None:
        return simpson_weights(scene.samples, 1.0)
    return np.full(scene.steps, 1 / scene.steps)


def target_motion(scene: Scene, threads: int = 1) -> Floats:
    """Motion (n_cases, n_asked, n_region, 3) of the reference's region at the loss's samples.

    Raises:
        SimulationError: the reference cannot be simulated.
    """
    reference = scene.reference
    if reference is None:
        raise ValueError("the scene has no reference: it is compared with rest")
    plan = make_plan(reference, reference.lattice.vertices, threads=threads, every_case=True)
    values = concrete_parameters(reference, reference.lattice.vertices)
    motion, _, _ = base.forward(plan.solver, values, reference.drives)
    return motion[:, :, reference.region]


def structure(scene: Scene, shifts: Floats | None = None) -> Callable[[Array], Parameters]:
    """Compiled map from a design vector to the parameters of its structure.

    With ``shifts`` (n_groups, 2) in mm, to those of an imperfect copy of it.
    """
    off = 0.0 if shifts is None else jnp.asarray(shifts)[scene.lattice.group]

    @jax.jit
    def of_design(design: Array) -> Parameters:
        made = shape(scene.lattice, scene.space.vertices(design) + off)
        return parameters(scene.lattice, made, scene.material)

    return of_design


def losses(scene: Scene, plan: Plan) -> Callable[[Array], Array]:
    """Differentiable map from a design vector to the losses (n_cases,) of all load cases."""
    of_design = structure(scene)
    measure = jax.jit(objective(scene).__call__)
    drives, place = _simulated(scene, plan)

    def of_cases(design: Array) -> Array:
        values = of_design(design)
        response = simulate(plan.solver, values, drives)
        return measure(response.displacement, values)[place]

    return of_cases


class Memory(Protocol):
    """Remembers the equilibrium paths of designs, to start similar ones from."""

    def start(self) -> Sequence[StaticRecord] | None:
        """Records (n_cases,) to start the next evaluation from, if any."""
        ...

    def keep(self, design: Floats, records: Sequence[StaticRecord]) -> None:
        """Takes the records of an evaluation."""
        ...


def evaluator(
    scene: Scene, plan: Plan, memory: Memory | None = None
) -> Callable[[Floats], tuple[float, Floats, Floats]]:
    """Function from a design vector to loss, gradient (n_variables,) and losses of all cases.

    With a ``memory`` the paths of a static scene start from those that it offers; where imperfect
    copies are simulated, none does.

    It raises ``SimulationError`` where the simulation fails.
    """
    drives, place = _simulated(scene, plan)
    weights, measure = jnp.asarray(scene.weights), objective(scene)

    def mean(displacement: Array, values: Parameters[Array]) -> tuple[Array, Array]:
        each = measure(displacement, values)[place]
        return combined(each, weights, scene.sharpness), each

    if scene.copies is None:
        return value_and_gradient(structure(scene), mean, plan.solver, drives, memory)
    made = [
        value_and_gradient(structure(scene, shifts), mean, plan.solver, drives)
        for shifts in scene.copies
    ]
    return lambda design: _averaged([copy(design) for copy in made])


def _averaged(found: list[tuple[float, Floats, Floats]]) -> tuple[float, Floats, Floats]:
    value, gradient, each = (np.mean(part, axis=0) for part in zip(*found, strict=True))
    return float(value), gradient, each


def _simulated(scene: Scene, plan: Plan) -> tuple[tuple[PrescribedMotion, ...], Ints]:
    """Drives of the simulated cases, and the one among them that each load case stands for."""
    drives = tuple(scene.drives[case] for case in plan.simulated)
    return drives, np.searchsorted(plan.simulated, plan.case_of)


def value_and_gradient(
    of_design: Callable[[Array], Parameters[Array]],
    measure: Callable[[Array, Parameters[Array]], tuple[Array, Array]],
    solver: Solver,
    drives: tuple[PrescribedMotion, ...],
    memory: Memory | None = None,
) -> Callable[[Floats], tuple[float, Floats, Floats]]:
    """Compiled chain design -> parameters -> motion -> value, with its gradient.

    The same as ``jax.value_and_grad`` through ``simulate``, without tracing it at every call.

    Args:
        of_design: differentiable map of a design vector to parameters.
        measure: value and further numbers of displacements (n_cases, n_asked, n_units, 3) and
            parameters.
        solver: of the motion.
        drives: of the cases.
        memory: of equilibrium paths, for static solvers.
    """
    forwards = jax.jit(of_design)
    measured = jax.jit(jax.value_and_grad(measure, argnums=(0, 1), has_aux=True))
    pull_back = jax.jit(lambda design, bar: jax.vjp(of_design, design)[1](bar)[0])

    def evaluate(design: Floats) -> tuple[float, Floats, Floats]:
        made = forwards(design)
        values = ConcreteParameters(*(np.asarray(part) for part in made))
        motion, velocity, records = base.forward(solver, values, drives, _started(solver, memory))
        if memory is not None and isinstance(solver, StaticSolver):
            memory.keep(design, records.records)
        (value, more), (bar_motion, direct) = measured(motion, made)
        through = base.backward(
            solver, records, np.asarray(bar_motion), np.zeros_like(velocity)
        ).parameters
        bar = Parameters(*(one + two for one, two in zip(direct, through, strict=True)))
        return float(value), np.asarray(pull_back(design, bar)), np.asarray(more)

    return evaluate


def _started(solver: Solver, memory: Memory | None) -> list[Solver] | None:
    """A solver for each case that starts from the path remembered, if there is one."""
    if memory is None or not isinstance(solver, StaticSolver):
        return None
    records = memory.start()
    return None if records is None else [replace(solver, start=record) for record in records]
