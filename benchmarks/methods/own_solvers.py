"""Lists our own solvers as methods."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import get_args

import numpy as np

from benchmarks.harness import Method, Run, Sample, Task, settings_of
from benchmarks.scenes import LoadCase, case, counted, work_of
from sim.core import Floats
from sim.linalg import Storage
from sim.quasistatics import StaticSolver
from sim.scene import STIFFENING, GradientChain, ParameterMap, make_plan
from sim.solvers import Solver, solve_cases
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


def in_time(name: str, halvings: int) -> tuple[Method, ...]:
    """Lists the implicit method with two ways to solve, and the explicit methods."""
    implicit = tuple(("steps / " + str(2**k) if k else "default", k) for k in range(halvings + 1))
    explicit = tuple((f"{2**k} × stable" if k else "stable", k) for k in range(halvings - 1))
    makes: dict[str, tuple[Make, tuple[tuple[str, float], ...]]] = {
        "ESDIRK3, panels": (partial(_implicit, "panels"), implicit),
        "ESDIRK3, fronts": (partial(_implicit, "fronts"), implicit[:2]),
        **{f"explicit {key}": (partial(_explicit, key), explicit) for key in SPLITTINGS},
    }
    return tuple(
        Method(method, partial(_prepare, name, make), settings)
        for method, (make, settings) in makes.items()
    )


def at_rest(name: str, tolerances: tuple[float, ...]) -> tuple[Method, ...]:
    """Lists Newton's method along the path, with every way to solve."""
    return tuple(
        Method(
            f"Newton, {way}",
            partial(_prepare, name, partial(_static, way)),
            settings_of(tolerances),
        )
        for way in get_args(Storage)
    )


def differences(name: str) -> Method:
    """Takes the gradient by central differences of the default solver, by their distance in mm."""
    settings = settings_of((1e-2, 1e-4, 1e-6), " mm")
    return Method("central differences", partial(_differences, name), settings, tasks=("gradient",))


def _differences(name: str, apart: float, _: Task) -> Run:
    posed = case(name)
    solver = make_plan(posed.scene).solver

    def loss(design: Floats) -> tuple[Floats, Floats]:
        values = posed.values_of(design)
        motion, *_ = solve_cases(solver, values, posed.scene.loads.cases)
        return np.asarray(posed.measured(motion, values)[0]), motion

    def run() -> Sample:
        steps = apart * np.eye(posed.scene.space.n_variables)
        gradient = [(loss(step)[0] - loss(-step)[0]) / (2 * apart) for step in steps]
        return Sample(posed.results(*loss(0 * steps[0]), np.array(gradient)), {})

    loss(np.zeros(posed.scene.space.n_variables))
    return run


def gradient_of(posed: LoadCase) -> Floats:
    """Computes the gradient by the adjoint of order 4's explicit method at a quarter of stable."""
    return gradient_run(posed, _explicit("Blanes-Moan", posed, 2), {})().values["gradient"]


def _prepare(name: str, make: Make, value: float, task: Task) -> Run:
    posed = case(name)
    solver = make(posed, value)
    if task == "loss":
        return warmed_up(loss_run(posed, solver))
    return warmed_up(gradient_run(posed, solver, counted(posed.scene, solver, [0])))


def loss_run(posed: LoadCase, solver: Solver) -> Run:
    """Makes the run of a load case's loss by a solver."""

    def run() -> Sample:
        motion, _, records = solve_cases(solver, posed.values, posed.scene.loads.cases)
        work = work_of(records.records[0])
        return Sample(posed.results(*posed.measured(motion, posed.values)), work)

    return run


def gradient_run(posed: LoadCase, solver: Solver, work: Mapping[str, int]) -> Run:
    """Makes the run of a load case's loss and gradient by a solver."""
    evaluate = partial(
        GradientChain(ParameterMap(posed.of_design), posed.measure, designed=True),
        solver=solver,
        cases=posed.scene.loads.cases,
    )
    start = np.zeros(posed.scene.space.n_variables)

    def run() -> Sample:
        loss, gradient, motion = evaluate(start)
        return Sample(posed.results(loss, motion, gradient), work)

    return run


def warmed_up(run: Run) -> Run:
    """Runs once, so that nothing is left to compile."""
    run()
    return run


def _implicit(storage: Storage, posed: LoadCase, halvings: float) -> Solver:
    asked = posed.scene.updated(integrator="implicit", accuracy="default")
    solver = make_plan(asked).solver
    assert isinstance(solver, ImplicitSolver)
    times, tolerance = (
        refined_times(solver.times, int(halvings)),
        solver.tolerance / HALVING**halvings,
    )
    top = replace(posed.scene.topology, storages=(storage,))
    return replace(solver, topology=top, times=times, tolerance=tolerance)


def refined_times(times: Floats, halvings: int) -> Floats:
    """Halves the steps of a grid so many times."""
    for _ in range(halvings):
        times = halved(times)
    return times


def _explicit(key: str, posed: LoadCase, doublings: float) -> Solver:
    scene, splitting = posed.scene, SPLITTINGS[key]
    highest = STIFFENING * highest_frequency(scene.topology, posed.values)
    stable = scene.loads.duration * highest / (0.9 * splitting.stability)
    n_steps = int(np.ceil(stable)) * 2 ** int(doublings)
    return ExplicitSolver(
        scene.topology, scene.loads.duration, n_steps, posed.times, splitting=splitting
    )


def _static(storage: Storage, posed: LoadCase, relative: float) -> Solver:
    top = replace(posed.scene.topology, storages=(storage,))
    return StaticSolver(top, posed.times, relative=relative)
