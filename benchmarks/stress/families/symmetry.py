"""The same problem told otherwise: turned, mirrored, moved, numbered otherwise, ends exchanged."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from benchmarks.stress import (
    LAWS,
    Check,
    RandomDesigns,
    StressCase,
    StressFamily,
    StressScene,
    posed,
    solved,
    squares,
)
from sim.core import Floats, Ints
from sim.quasistatics import StaticSolver
from sim.solvers import Solver, TimeSeries
from sim.structure import ContactModel, Lattice, listed
from sim.time_integration import ExplicitSolver, ImplicitSolver

EXACT = 1e-10
SIDE = 5
DURATION = 0.01
KINDS = ("turned", "mirrored", "moved", "renumbered", "exchanged", "all")
TIMES = np.linspace(0.0, DURATION, 21)
MOVED = np.array([-5.0, 2.0, 0.2])
"""Motion of the driven units at the end: closes voids to contact."""


class EquivalentProblem(NamedTuple):
    """Another way to tell the same problem.

    Attributes:
        turn: (2, 2) rotation, or rotation and mirror.
        shift: (2,) mm.
        order: (n_units,) the unit that comes at each place.
        exchanged: (n_ligaments,) whether a ligament's ends change places.
    """

    turn: Floats
    shift: Floats
    order: Ints
    exchanged: np.ndarray


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "symmetry",
        "random designs turned by any angle, mirrored, moved by 1 m, their units renumbered, the"
        " ends of their ligaments exchanged, all of these: statics and motions, both contacts",
        "the answer must be the first one turned and renumbered likewise",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    draws = RandomDesigns(squares(SIDE), np.zeros(0, dtype=np.int64), 2.0, 0.8)
    for seed in range(1 if small else 6):
        for kind in ("all",) if small else KINDS:
            for law, contact in LAWS.items():
                for solver in ("static", "implicit", "explicit"):
                    name = f"design {seed}, {kind}, {solver}, contact on {law}"
                    attempt = partial(_attempt, draws, seed, kind, solver, contact)
                    yield StressCase(name, attempt)


def _attempt(
    draws: RandomDesigns, seed: int, kind: str, solver: str, contact: ContactModel
) -> Sequence[Check]:
    lattice = replace(squares(SIDE), vertices=draws(seed))
    telling = _telling(kind, lattice, np.random.default_rng(seed))
    one = _posed(lattice, _same(lattice), contact)
    other = _posed(_told(lattice, telling), telling, contact)
    first, second = (solved(case, _solver(case, solver)).displacement for case in (one, other))
    wanted = first.reshape(len(first), -1, 3)[:, telling.order]
    wanted = np.concatenate(
        [wanted[..., :2] @ telling.turn.T, np.linalg.det(telling.turn) * wanted[..., 2:]], axis=-1
    )
    off = np.abs(wanted - second.reshape(wanted.shape)).max() / np.abs(wanted).max()
    return [Check("difference from the same told otherwise", float(off), EXACT)]


def _telling(kind: str, lattice: Lattice, random: np.random.Generator) -> EquivalentProblem:
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
    return EquivalentProblem(
        np.eye(2),
        np.zeros(2),
        np.arange(lattice.n_units),
        np.zeros(lattice.n_ligaments, dtype=bool),
    )


def _told(lattice: Lattice, telling: EquivalentProblem) -> Lattice:
    placed = lattice.vertices @ telling.turn.T + telling.shift
    rings = [placed[lattice.unit == unit].tolist() for unit in telling.order]
    ends = lattice.ligaments.copy()
    ends[telling.exchanged] = ends[telling.exchanged, ::-1]
    return listed(rings, placed[ends].tolist(), lattice.spacing)


def _posed(lattice: Lattice, telling: EquivalentProblem, contact: ContactModel) -> StressScene:
    """The left column clamped, the right one pushed, turned and sheared."""
    column = telling.order % SIDE
    push = np.concatenate([telling.turn @ MOVED[:2], [np.linalg.det(telling.turn) * MOVED[2]]])
    share = (1.0 - np.cos(np.pi * TIMES / DURATION)) / 2.0
    motion = TimeSeries(TIMES, share[:, None] * push)
    left, right = (np.flatnonzero(column == end) for end in (0, SIDE - 1))
    return posed(lattice, left, right, motion, duration=DURATION, contact=contact)


def _solver(case: StressScene, name: str) -> Solver:
    top = case.topology
    if name == "static":
        return StaticSolver(top, TIMES[5::5], relative=1e-14)
    if name == "implicit":
        return ImplicitSolver(top, TIMES, TIMES[5::5], tolerance=1e-9)
    return ExplicitSolver(top, DURATION, 400, TIMES[5::5])
