"""Our own solvers as ladders."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import jax.numpy as jnp
import numpy as np

from benchmarks.harness import Run, Sample, SettingLadder, Task
from benchmarks.scenes import LoadCase, case, counted
from sim.core import Floats
from sim.energy import Topology
from sim.linalg import number_free_dofs
from sim.quasistatics import StaticSolver
from sim.scene import STIFFENING, GradientChain, make_plan, parameters_of_design
from sim.solvers import Solver, solve_cases
from sim.structure import ConcreteParameters
from sim.time_integration import (
    BLANES_MOAN,
    LEAPFROG,
    ExplicitSolver,
    ImplicitSolver,
    Splitting,
    halved,
)
from sim.vibration import highest_frequency

Make = Callable[[LoadCase, float], Solver]
SPLITTINGS: dict[str, Splitting] = {"leapfrog": LEAPFROG, "Blanes-Moan": BLANES_MOAN}
HALVING = 8.0
"""By which the stage tolerance falls as the steps of an order 3 are halved."""


def in_time(name: str, halvings: int) -> tuple[SettingLadder, ...]:
    """Implicit with either way to solve, and the explicit methods."""
    implicit = tuple(("steps / " + str(2**k) if k else "default", k) for k in range(halvings + 1))
    explicit = tuple((f"{2**k} × stable" if k else "stable", k) for k in range(halvings - 1))
    return (
        SettingLadder(
            "ESDIRK3, band", partial(_prepare, name, partial(_implicit, False)), implicit, True
        ),
        SettingLadder(
            "ESDIRK3, fronts", partial(_prepare, name, partial(_implicit, True)), implicit[:2], True
        ),
        *(
            SettingLadder(
                f"explicit {key}", partial(_prepare, name, partial(_explicit, key)), explicit, True
            )
            for key in SPLITTINGS
        ),
    )


def at_rest(name: str, tolerances: tuple[float, ...]) -> tuple[SettingLadder, ...]:
    """Newton's method along the path, with either way to solve."""
    rungs = tuple((f"{tolerance:g}", tolerance) for tolerance in tolerances)
    return tuple(
        SettingLadder(
            f"Newton, {way}",
            partial(_prepare, name, partial(_static, way == "fronts")),
            rungs,
            True,
        )
        for way in ("band", "fronts")
    )


def differences(name: str) -> SettingLadder:
    """The gradient by central differences of the default solver, by their distance in mm."""
    rungs = tuple((f"{apart:g} mm", apart) for apart in (1e-2, 1e-4, 1e-6))
    return SettingLadder(
        "central differences", partial(_differences, name), rungs, True, ("gradient",)
    )


def _differences(name: str, apart: float, task: Task) -> Run:
    del task
    posed = case(name)
    solver = make_plan(posed.scene).solver
    of_design = parameters_of_design(posed.scene)

    def loss(design: Floats) -> tuple[Floats, Floats]:
        values = ConcreteParameters(*(np.asarray(part) for part in of_design(jnp.asarray(design))))
        motion, *_ = solve_cases(solver, values, posed.scene.loads.cases)
        value, _ = posed.measured(motion, values)
        return np.asarray(value), motion

    def run() -> Sample:
        steps = apart * np.eye(posed.scene.space.n_variables)
        gradient = [(loss(step)[0] - loss(-step)[0]) / (2 * apart) for step in steps]
        return Sample(posed.results(*loss(0 * steps[0]), np.array(gradient)), {})

    loss(np.zeros(posed.scene.space.n_variables))
    return run


def gradient_of(posed: LoadCase) -> Floats:
    """Gradient by the adjoint of the explicit method of order 4 at a quarter of a stable step."""
    return _gradient(posed, _explicit("Blanes-Moan", posed, 2))()["gradient"]


def _prepare(name: str, make: Make, value: float, task: Task) -> Run:
    posed = case(name)
    solver = make(posed, value)
    work = counted(posed.scene, solver, [0])
    run = _gradient(posed, solver) if task == "gradient" else _loss(posed, solver)

    def counting() -> Sample:
        return Sample(run(), work)

    counting()
    return counting


def _loss(posed: LoadCase, solver: Solver) -> Callable[[], dict[str, Floats]]:
    values = posed.values

    def run() -> dict[str, Floats]:
        motion, *_ = solve_cases(solver, values, posed.scene.loads.cases)
        return posed.results(*posed.measured(motion, values))

    return run


def _gradient(posed: LoadCase, solver: Solver) -> Callable[[], dict[str, Floats]]:
    of_design = parameters_of_design(posed.scene)
    evaluate = partial(
        GradientChain(of_design, posed.measure), solver=solver, cases=posed.scene.loads.cases
    )
    start = np.zeros(posed.scene.space.n_variables)

    def run() -> dict[str, Floats]:
        loss, gradient, motion = evaluate(start)
        return posed.results(loss, motion, gradient)

    return run


def _stored(posed: LoadCase, by_fronts: bool) -> Topology:
    """The topology with its tangent as a band or by fronts."""
    top = replace(posed.scene.topology)
    top.__dict__["numbering"] = number_free_dofs(top.site, top.ligament_units, top.held, by_fronts)
    return top


def _implicit(by_fronts: bool, posed: LoadCase, halvings: float) -> Solver:
    asked = posed.scene.updated(integrator="implicit", accuracy="default")
    solver = make_plan(asked).solver
    assert isinstance(solver, ImplicitSolver)
    times = solver.times
    for _ in range(int(halvings)):
        times = halved(times)
    tolerance = solver.tolerance / HALVING**halvings
    return replace(solver, topology=_stored(posed, by_fronts), times=times, tolerance=tolerance)


def _explicit(key: str, posed: LoadCase, doublings: float) -> Solver:
    scene, splitting = posed.scene, SPLITTINGS[key]
    highest = STIFFENING * highest_frequency(scene.topology, posed.values)
    stable = scene.loads.duration * highest / (0.9 * splitting.stability)
    n_steps = int(np.ceil(stable)) * 2 ** int(doublings)
    return ExplicitSolver(
        scene.topology, scene.loads.duration, n_steps, posed.times, splitting=splitting
    )


def _static(by_fronts: bool, posed: LoadCase, relative: float) -> Solver:
    return StaticSolver(_stored(posed, by_fronts), posed.times, relative=relative)
