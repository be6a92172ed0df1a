"""Compares answers with those of the same problem posed differently, and with those of SciPy."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from benchmarks.scenes import MATERIAL
from benchmarks.stress import (
    LAWS,
    NONE,
    Answer,
    Check,
    RandomDesigns,
    StressCase,
    StressScene,
    attempt,
    balance,
    family,
    largest_difference,
    posed,
    solved,
    squares,
    stiffness,
)
from sim.core import Floats, Ints
from sim.quasistatics import StaticSolver
from sim.solvers import LinearRamp, Solver, TimeSeries
from sim.structure import ContactModel, Lattice, listed
from sim.time_integration import ExplicitSolver, ImplicitSolver

EXACT = 1e-10
COLUMNS = 5
DURATION = 0.01
KINDS = ("turned", "mirrored", "moved", "renumbered", "exchanged", "all")
TIMES = np.linspace(0.0, DURATION, 21)
MOVED = np.array([-5.0, 2.0, 0.2])
"""Motion of the driven units at the end: closes voids to contact."""


class EquivalentProblem(NamedTuple):
    """Poses the same problem in other coordinates and order."""

    turn: Floats  # (2, 2) rotation, or rotation and mirror
    shift: Floats  # (2,) mm
    order: Ints  # (n_units,) the unit that comes at each place
    exchanged: np.ndarray  # (n_ligaments,) whether a ligament's ends change places


@family
def symmetry(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    draws = RandomDesigns(squares(COLUMNS), np.zeros(0, dtype=np.int64), 2.0, 0.8)
    for seed in range(1 if small else 6):
        for kind in ("all",) if small else KINDS:
            for law, contact in LAWS.items():
                for solver in ("static", "implicit", "explicit"):
                    name = f"design {seed}, {kind}, {solver}, contact on {law}"
                    yield attempt(name, _equivalent, draws, seed, kind, solver, contact)


def _equivalent(
    draws: RandomDesigns, seed: int, kind: str, solver: str, contact: ContactModel
) -> Sequence[Check]:
    lattice = replace(squares(COLUMNS), vertices=draws(seed))
    restated = _restatement(kind, lattice, np.random.default_rng(seed))
    one = _posed(lattice, _same(lattice), contact)
    other = _posed(_restated(lattice, restated), restated, contact)
    first, second = (solved(case, _solver(case, solver)).displacement for case in (one, other))
    expected = first.reshape(len(first), -1, 3)[:, restated.order]
    expected = np.concatenate(
        [expected[..., :2] @ restated.turn.T, np.linalg.det(restated.turn) * expected[..., 2:]],
        axis=-1,
    )
    off = np.abs(expected - second.reshape(expected.shape)).max() / np.abs(expected).max()
    return [Check("difference from the same told otherwise", float(off), EXACT)]


def _restatement(kind: str, lattice: Lattice, random: np.random.Generator) -> EquivalentProblem:
    told = _same(lattice)
    angle = random.uniform(0.2, 6.0)
    c, s = np.cos(angle), np.sin(angle)
    if kind in ("turned", "all"):
        told = told._replace(turn=np.array([[c, -s], [s, c]]))
    if kind in ("mirrored", "all"):
        told = told._replace(turn=told.turn @ np.diag([-1.0, 1.0]))
    if kind in ("moved", "all"):
        told = told._replace(shift=random.uniform(-1e3, 1e3, 2))
    if kind in ("renumbered", "all"):
        told = told._replace(order=random.permutation(lattice.n_units))
    if kind in ("exchanged", "all"):
        told = told._replace(exchanged=random.random(lattice.n_ligaments) < 0.5)
    return told


def _same(lattice: Lattice) -> EquivalentProblem:
    kept = np.zeros(lattice.n_ligaments, dtype=bool)
    return EquivalentProblem(np.eye(2), np.zeros(2), np.arange(lattice.n_units), kept)


def _restated(lattice: Lattice, restated: EquivalentProblem) -> Lattice:
    placed = lattice.vertices @ restated.turn.T + restated.shift
    rings = [placed[lattice.unit == unit].tolist() for unit in restated.order]
    ends = lattice.ligaments.copy()
    ends[restated.exchanged] = ends[restated.exchanged, ::-1]
    return listed(rings, placed[ends].tolist(), lattice.spacing)


def _posed(lattice: Lattice, restated: EquivalentProblem, contact: ContactModel) -> StressScene:
    """Clamps the left column; pushes, turns and shears the right one."""
    column = restated.order % COLUMNS
    push = np.concatenate([restated.turn @ MOVED[:2], [np.linalg.det(restated.turn) * MOVED[2]]])
    share = (1.0 - np.cos(np.pi * TIMES / DURATION)) / 2.0
    motion = TimeSeries(TIMES, share[:, None] * push)
    left, right = (np.flatnonzero(column == end) for end in (0, COLUMNS - 1))
    return posed(lattice, left, right, motion, duration=DURATION, contact=contact)


def _solver(case: StressScene, name: str) -> Solver:
    top = case.topology
    if name == "static":
        return StaticSolver(top, TIMES[5::5], relative=1e-14)
    if name == "implicit":
        return ImplicitSolver(top, TIMES, TIMES[5::5], tolerance=1e-9)
    return ExplicitSolver(top, DURATION, 400, TIMES[5::5])


SIDE = 4
KNOTS = np.linspace(0.0, 0.006, 13)
LOADS = np.linspace(0.04, 1.0, 25)


@family
def agreement(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    draws = RandomDesigns(squares(SIDE), NONE, 2.0, 0.8)
    for seed in range(1 if small else 12):
        yield attempt(f"scene {seed}, equilibria", _equilibria, draws, seed)
        yield attempt(f"scene {seed}, motions", _motions, draws, seed)


def _scene(draws: RandomDesigns, seed: int, static: bool) -> StressScene:
    random = np.random.default_rng(1000 + seed)
    lattice = replace(squares(SIDE), vertices=draws(seed))
    clamped, driven = np.split(random.permutation(lattice.n_units)[:4], 2)
    factor = 10.0 ** random.uniform(-0.5, 0.5, (5, lattice.n_ligaments))
    material = MATERIAL._replace(
        axial_stiffness=MATERIAL.axial_stiffness * factor[0],
        shear_stiffness=MATERIAL.shear_stiffness * factor[1],
        bending_stiffness=MATERIAL.bending_stiffness * factor[2],
        contact_stiffness=MATERIAL.contact_stiffness * factor[3],
        density=MATERIAL.density * factor[4, : lattice.n_units],
        damping_rotation=MATERIAL.damping_rotation * 10.0 ** random.uniform(-2, 2),
    )
    amplitude, direction = random.uniform(0.5, 2.0), random.uniform(0.0, 6.0)
    if static:
        ramp = LinearRamp(amplitude, 1.0, direction)
        return posed(lattice, clamped, driven, ramp, static=True, material=material)
    share = np.sin(np.pi * KNOTS / KNOTS[-1]) ** 2
    turn = np.array([np.cos(direction), np.sin(direction), 0.05])
    series = TimeSeries(KNOTS, amplitude * share[:, None] * turn)
    return posed(lattice, clamped, driven, series, duration=KNOTS[-1], material=material)


def _equilibria(draws: RandomDesigns, seed: int) -> Sequence[Check]:
    case = _scene(draws, seed, static=True)
    answer = solved(case, case.solver(LOADS))
    free, held = case.topology.free_dofs, case.topology.held
    drive, state = case.drive.values(held, LOADS), np.zeros(case.topology.n_dofs)
    found = []
    for load in drive:
        state[held] = load
        energy, slope = (partial(_energy, case, state, order=order) for order in (0, 1))
        curvature, precise = partial(_energy, case, state, order=2), {"gtol": 1e-10}
        given = {"jac": slope, "hess": curvature, "method": "trust-exact", "options": precise}
        state[free] = minimize(energy, state[free], **given).x
        found.append(state.copy())
    other = Answer(np.array(found), answer.velocity, answer.record)
    return [Check("distance from SciPy's minima", largest_difference(case, answer, other), 1e-6)]


def _energy(case: StressScene, state: Floats, free: Floats, order: int) -> Any:  # noqa: ANN401
    """Computes the energy, or its first or second derivatives, by the free dofs."""
    dofs, whole = case.topology.free_dofs, state.copy()
    whole[dofs] = free
    if order == 2:
        return stiffness(case.structure, whole)[np.ix_(dofs, dofs)].toarray()
    found = balance(case.structure, whole)
    return -found.force[dofs] if order else found.energy


def _motions(draws: RandomDesigns, seed: int) -> Sequence[Check]:
    case = _scene(draws, seed, static=False)
    top = case.topology
    exact = _by_scipy(case)
    implicit = ImplicitSolver(top, np.linspace(0.0, KNOTS[-1], 601), KNOTS[1:], tolerance=1e-6)
    explicit = ExplicitSolver(top, KNOTS[-1], 400, KNOTS[1:])
    checks = []
    solvers: dict[str, Solver] = {"implicit": implicit, "explicit": explicit}
    for name, solver in solvers.items():
        answer = solved(case, solver)
        off = largest_difference(case, answer, Answer(exact, answer.velocity, answer.record))
        checks.append(Check(f"distance of {name} steps from SciPy's", off, 2e-3))
    return checks


def _by_scipy(case: StressScene) -> Floats:
    """Displacements (n_knots - 1, n_dofs)."""
    top, drive = case.topology, case.drive
    free, held, n = top.free_dofs, top.held, top.n_dofs
    mass, damping = case.values.mass.ravel(), case.values.damping.ravel()
    state = np.zeros(n)

    def rates(t: float, y: Floats) -> Floats:
        state[free], state[held] = y[: len(free)], drive.values(held, np.array([t]))[0]
        force = balance(case.structure, state).force[free] - damping[free] * y[len(free) :]
        return np.concatenate([y[len(free) :], force / mass[free]])

    start = np.zeros(2 * len(free))
    found = np.zeros((len(KNOTS) - 1, n))
    for k, (begin, end) in enumerate(pairwise(KNOTS)):
        run = solve_ivp(rates, (begin, end), start, method="DOP853", rtol=1e-9, atol=1e-10)
        start = run.y[:, -1]
        found[k, free] = start[: len(free)]
    found[:, held] = drive.values(held, KNOTS[1:])
    return found
