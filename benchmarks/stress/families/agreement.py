"""Random scenes solved twice, the second time by SciPy on the definition of the energy alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import jax
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from benchmarks.scenes import MATERIAL
from benchmarks.stress import (
    NONE,
    Answer,
    Check,
    RandomDesigns,
    StressCase,
    StressFamily,
    StressScene,
    apart,
    balance,
    posed,
    solved,
    squares,
    stiffness,
)
from sim.core import Floats
from sim.solvers import LinearRamp, TimeSeries, held_values
from sim.time_integration import ExplicitSolver, ImplicitSolver

SIDE = 4
DURATION = 0.006
KNOTS = np.linspace(0.0, DURATION, 13)
LOADS = np.linspace(0.04, 1.0, 25)


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "agreement",
        f"random designs of {SIDE} x {SIDE} units with random constants, supports and drives:"
        " equilibria, motions by either integrator",
        "equilibria against SciPy's trust-region minimiser, motions against SciPy's DOP853, both on"
        " the definition of the energy",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    draws = RandomDesigns(squares(SIDE), NONE, 2.0, 0.8)
    for seed in range(1 if small else 12):
        yield StressCase(f"scene {seed}, equilibria", partial(_equilibria, draws, seed))
        yield StressCase(f"scene {seed}, motions", partial(_motions, draws, seed))


def _scene(draws: RandomDesigns, seed: int, static: bool) -> StressScene:
    random = np.random.default_rng(1000 + seed)
    lattice = replace(squares(SIDE), vertices=draws(seed))
    clamped, driven = np.split(random.permutation(lattice.n_units)[:4], 2)
    factor = 10.0 ** random.uniform(-0.5, 0.5, (5, lattice.n_ligaments))
    material = MATERIAL._replace(
        axial=MATERIAL.axial * factor[0],
        shear=MATERIAL.shear * factor[1],
        bending=MATERIAL.bending * factor[2],
        contact=MATERIAL.contact * factor[3],
        density=MATERIAL.density * factor[4, : lattice.n_units],
        damping_rotation=MATERIAL.damping_rotation * 10.0 ** random.uniform(-2, 2),
    )
    amplitude, direction = random.uniform(0.5, 2.0), random.uniform(0.0, 6.0)
    if static:
        ramp = LinearRamp(amplitude, 1.0, direction)
        return posed(lattice, clamped, driven, ramp, static=True, material=material)
    share = np.sin(np.pi * KNOTS / DURATION) ** 2
    turn = np.array([np.cos(direction), np.sin(direction), 0.05])
    series = TimeSeries(KNOTS, amplitude * share[:, None] * turn)
    return posed(lattice, clamped, driven, series, duration=DURATION, material=material)


def _equilibria(draws: RandomDesigns, seed: int) -> Sequence[Check]:
    case = _scene(draws, seed, static=True)
    answer = solved(case, case.solver(LOADS))
    free, held = case.topology.free_dofs, case.topology.held
    drive, state = case.drive.values(held, LOADS), np.zeros(case.topology.n_dofs)
    found = []
    for load in drive:
        state[held] = load
        minimum = minimize(
            lambda x: _at(case, state, x)[0],
            state[free],
            jac=lambda x: _at(case, state, x)[1],
            hess=lambda x: stiffness(case.structure, _with(case, state, x))[
                np.ix_(free, free)
            ].toarray(),
            method="trust-exact",
            options={"gtol": 1e-10},
        )
        state[free] = minimum.x
        found.append(state.copy())
    other = Answer(np.array(found), answer.velocity, answer.record)
    return [Check("distance from SciPy's minima", apart(case, answer, other), 1e-6)]


def _with(case: StressScene, state: Floats, free: Floats) -> Floats:
    whole = state.copy()
    whole[case.topology.free_dofs] = free
    return whole


def _at(case: StressScene, state: Floats, free: Floats) -> tuple[float, Floats]:
    """Energy and its gradient by the free dofs."""
    found = balance(case.structure, _with(case, state, free))
    return found.energy, -found.force[case.topology.free_dofs]


def _motions(draws: RandomDesigns, seed: int) -> Sequence[Check]:
    case = _scene(draws, seed, static=False)
    top = case.topology
    exact = _by_scipy(case)
    implicit = ImplicitSolver(top, np.linspace(0.0, DURATION, 601), KNOTS[1:], tolerance=1e-6)
    explicit = ExplicitSolver(top, DURATION, 400, KNOTS[1:])
    checks = []
    for name, solver, error in (("implicit", implicit, 2e-3), ("explicit", explicit, 2e-3)):
        answer = solved(case, solver)
        other = Answer(exact, answer.velocity, answer.record)
        checks.append(
            Check(f"distance of {name} steps from SciPy's", apart(case, answer, other), error)
        )
    return checks


def _by_scipy(case: StressScene) -> Floats:
    """Displacements (n_knots - 1, n_dofs)."""
    top, drive = case.topology, case.drive
    free, held, n = top.free_dofs, top.held, top.n_dofs
    mass, damping = case.values.mass.ravel(), case.values.damping.ravel()
    at = jax.jit(lambda t: held_values(held, drive.units, drive.motion, t))
    state = np.zeros(n)

    def rates(t: float, y: Floats) -> Floats:
        state[free], state[held] = y[: len(free)], np.asarray(at(np.array([t])))[0]
        force = balance(case.structure, state).force - damping * _whole(n, free, y[len(free) :])
        return np.concatenate([y[len(free) :], (force / mass)[free]])

    start = np.zeros(2 * len(free))
    found = np.zeros((len(KNOTS) - 1, n))
    for k, (begin, end) in enumerate(pairwise(KNOTS)):
        run = solve_ivp(rates, (begin, end), start, method="DOP853", rtol=1e-9, atol=1e-10)
        start = run.y[:, -1]
        found[k, free] = start[: len(free)]
    found[:, held] = drive.values(held, KNOTS[1:])
    return found


def _whole(n: int, free: np.ndarray, values: Floats) -> Floats:
    out = np.zeros(n)
    out[free] = values
    return out
